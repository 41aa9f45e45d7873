//! The fixed-step clock: time is a count of steps.

/// The last step that a saved run or a journal may be at: time counts no further in whole steps.
pub const LATEST: u64 = 1 << 53;

/// Where the sea is in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Steps since the start.
    pub step: u64,
    /// Length of a step [s].
    pub dt: f64,
}

impl Clock {
    /// A clock at its start.
    pub fn new(dt: f64) -> Self {
        Self { step: 0, dt }
    }

    /// Time since the start [s]: a product, so that rounding never adds up.
    pub fn time(&self) -> f64 {
        self.time_of(self.step)
    }

    /// Time at the end of a step [s].
    pub fn time_of(&self, step: u64) -> f64 {
        step as f64 * self.dt
    }

    /// Number of steps that reach at least this time [s].
    pub fn steps_to(&self, time: f64) -> u64 {
        // A hair below a whole number is rounding.
        (time.max(0.0) / self.dt - 1e-6).ceil().max(0.0) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_exact_after_a_million_steps() {
        let clock = Clock { step: 1_000_000, dt: 1.0 / 60.0 };
        assert_eq!(clock.time(), 1_000_000.0 / 60.0);
    }

    #[test]
    fn steps_to_a_time_are_not_fooled_by_rounding() {
        let clock = Clock::new(1.0 / 60.0);
        let times = [0.0, 1.0, 0.1, 8.3, 1.0 / 60.0, 1.001];
        assert_eq!(times.map(|time| clock.steps_to(time)), [0, 60, 6, 498, 1, 61]);
    }
}
