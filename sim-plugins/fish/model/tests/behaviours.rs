//! A minute of each behaviour. `cargo run --release -p reef-fish-model --example fish_minutes` looks at ten.

#[path = "common/behaviours.rs"]
mod behaviours;

use behaviours::{Behaviour, Seen, watch};

/// What holds of every behaviour, of bodies and of points.
fn sound(behaviour: Behaviour, bodies: bool) -> Seen {
    let seen = watch(behaviour, bodies, 60.0);
    println!("{behaviour:?}, bodies {bodies}: {seen:?}");
    assert!(seen.beyond < 0.0, "one leaves its habitat: {seen:?}");
    assert!(seen.stuck == 0.0, "one is in a rock: {seen:?}");
    assert!(seen.touching < 0.4, "two are inside one another: {seen:?}");
    // Points turn as sharply as the bodies of which their gait was taken; neighbours' water turns bodies,
    // too.
    assert!(seen.turning < if bodies { 2.75 } else { 1.01 }, "{seen:?}");
    seen
}

#[test]
fn a_shoal_stays_a_shoal() {
    for bodies in [false, true] {
        let seen = sound(Behaviour::Shoal, bodies);
        assert!(seen.polarisation > 0.6, "{seen:?}");
        assert!(seen.spread[0] > 0.12 && seen.spread[1] < 1.6, "{seen:?}");
    }
}

#[test]
fn a_hunter_eats_and_the_shoal_closes_behind_it() {
    for bodies in [false, true] {
        let seen = sound(Behaviour::Hunter, bodies);
        assert!(seen.caught > 0 && seen.polarisation > 0.6, "{seen:?}");
        assert!(seen.spread[0] > 0.12 && seen.spread[1] < 1.6, "it comes together again: {seen:?}");
    }
}

#[test]
fn clownfish_keep_to_their_anemones() {
    for bodies in [false, true] {
        let seen = sound(Behaviour::Home, bodies);
        // Who gives way to another, or courts, goes farther for a while.
        assert!(seen.strayed > 0.1 && seen.strayed < 3.0, "{seen:?}");
    }
}

#[test]
fn who_wanders_between_rocks_gets_about() {
    for bodies in [false, true] {
        let seen = sound(Behaviour::Wandering, bodies);
        assert!(seen.spread[1] > 0.5, "{seen:?}");
    }
}
