//! Time, on a machine that others use, too: several things take turns in short rounds, and what counts is the median of
//! the ratios within the rounds.

use std::time::{Duration, Instant};

/// Time that one turn of one thing takes, about.
const TURN: Duration = Duration::from_millis(12);

/// One of the things that take turns: does its unit of work once.
pub type Work<'a> = Box<dyn FnMut() + 'a>;

/// Seconds a call of each thing, one row a round. Each thing is first run until it is warm and its turn's number of calls
/// is known.
pub fn rounds(mut things: Vec<Work<'_>>, count: usize) -> Vec<Vec<f64>> {
    let calls: Vec<u32> = things.iter_mut().map(calls_a_turn).collect();
    (0..count)
        .map(|_| {
            things
                .iter_mut()
                .zip(&calls)
                .map(|(thing, &calls)| {
                    let start = Instant::now();
                    for _ in 0..calls {
                        thing();
                    }
                    start.elapsed().as_secs_f64() / f64::from(calls)
                })
                .collect()
        })
        .collect()
}

fn calls_a_turn(thing: &mut Work<'_>) -> u32 {
    for _ in 0..3 {
        thing();
    }
    let mut calls: u32 = 1;
    loop {
        let start = Instant::now();
        for _ in 0..calls {
            thing();
        }
        let took = start.elapsed();
        if took >= TURN || calls >= 1 << 20 {
            return calls;
        }
        // Toward the turn's length, but not by more than a factor: the first calls may have been slow.
        let wanted = TURN.as_secs_f64() / took.as_secs_f64().max(1e-9);
        calls = calls.saturating_mul((wanted.ceil() as u32).clamp(2, 16));
    }
}

/// The median; NaN of nothing.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

/// Median over the rounds of one column.
pub fn typical(rounds: &[Vec<f64>], column: usize) -> f64 {
    median(rounds.iter().filter_map(|round| round.get(column).copied()).collect())
}

/// Median over the rounds of the ratio of two columns.
pub fn ratio(rounds: &[Vec<f64>], over: usize, under: usize) -> f64 {
    median(rounds.iter().filter_map(|round| Some(round.get(over)? / round.get(under)?)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_within_rounds_does_not_feel_a_machine_that_slows_down() {
        let slowing: Vec<Vec<f64>> = (1..=9).map(|i| vec![f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(ratio(&slowing, 1, 0), 2.0);
        assert_eq!(typical(&slowing, 0), 5.0);
        assert!(median(Vec::new()).is_nan());
        assert_eq!(median(vec![4.0, 1.0]), 2.5);
    }

    #[test]
    fn work_that_takes_ten_times_as_long_is_seen_to() {
        let spin = |n: u32| {
            Box::new(move || {
                for i in 0..n {
                    std::hint::black_box(i);
                }
            }) as Work<'static>
        };
        let seen = ratio(&rounds(vec![spin(2_000), spin(20_000)], 5), 1, 0);
        // Wide: other programs run beside this test.
        assert!((5.0..20.0).contains(&seen), "{seen}");
    }
}
