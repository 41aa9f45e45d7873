//! What a chore says while it works: each step by name as it begins, and how long it took as it ends.

use std::time::Instant;

use crate::Failure;

/// The steps of one chore, in order.
pub struct Steps {
    count: usize,
    at: usize,
    began: Instant,
}

impl Steps {
    /// A chore of `count` steps that begins now.
    pub fn of(count: usize) -> Self {
        Self { count, at: 0, began: Instant::now() }
    }

    /// Takes the next step.
    pub fn take<T>(&mut self, what: &str, act: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
        self.at += 1;
        let step = format!("[{}/{}] {what}", self.at, self.count);
        println!("{step} …");
        let began = Instant::now();
        let outcome = act();
        let end = if outcome.is_ok() { "done" } else { "failed" };
        println!("{step}: {end} in {:.1} s", began.elapsed().as_secs_f64());
        outcome
    }

    /// Says how long all of it took.
    pub fn end(self) {
        let seconds = self.began.elapsed().as_secs();
        println!("All done in {} min {:02} s", seconds / 60, seconds % 60);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_hands_on_what_came_of_it() {
        let mut steps = Steps::of(2);
        assert_eq!(steps.take("count", || Ok(7)).ok(), Some(7));
        assert_eq!(steps.take("fail", || Err::<(), _>(Failure::check("no"))).err().map(|f| f.code), Some(1));
        assert_eq!(steps.at, steps.count);
    }
}
