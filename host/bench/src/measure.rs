//! Time, on a machine that others use, too: several things take turns in many short rounds, each short enough
//! to fit between two interruptions, and what counts is each thing's best round.

use std::time::{Duration, Instant};

/// Time that one turn of one thing takes, about: several steps of a sea, so that steps follow one another as
/// they do in a sea that runs, and not every second one begins with caches full of what the other things left
/// there.
const TURN: Duration = Duration::from_micros(8000);

/// One of the things that take turns: does its unit of work once.
pub type Work<'a> = Box<dyn FnMut() + 'a>;

/// Seconds a call of each thing, one row a round. Each thing is first run until it is warm and its turn's
/// number of calls is known.
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

/// Seconds a call of one thing, undisturbed: its best round. NaN without rounds.
pub fn best(rounds: &[Vec<f64>], column: usize) -> f64 {
    rounds.iter().filter_map(|round| round.get(column).copied()).fold(f64::NAN, f64::min)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_that_were_disturbed_do_not_count() {
        let disturbed = [vec![4.0, 2.0], vec![1.0, 9.0], vec![8.0, 2.5]];
        assert_eq!((best(&disturbed, 0), best(&disturbed, 1)), (1.0, 2.0));
        assert!(median(Vec::new()).is_nan());
        assert_eq!(median(vec![4.0, 1.0]), 2.5);
        assert!(best(&[], 0).is_nan() && best(&disturbed, 2).is_nan());
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
        let seen = rounds(vec![spin(2_000), spin(20_000)], 30);
        let seen = best(&seen, 1) / best(&seen, 0);
        // Wide: other programs run beside this test.
        assert!((5.0..20.0).contains(&seen), "{seen}");
    }
}
