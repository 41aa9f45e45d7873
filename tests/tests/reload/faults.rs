//! Faults of a newer build while an older one is still there, and without one.

use std::time::Duration;

use reef_plugin::Health;

use crate::{Place, another, builds};

fn scene(fault_in: u64) -> String {
    format!(
        "[scene]\nname = \"Faults\"\n\n[modules.sick]\nuse = \"fixture.growing\"\nfault_in = {fault_in}\n\n\
         [modules.well]\nuse = \"fixture.growing\"\n"
    )
}

fn news(place: &mut Place) -> String {
    place.live.take_notices().into_iter().map(|notice| notice.text + "\n").collect()
}

#[test]
fn an_older_build_takes_over_from_one_that_fails_and_makes_up_for_every_step() {
    let mut place = Place::new(&builds(""), &scene(300));
    place.rename_into_place(&builds("faulty"));
    place.until(1, 0);
    assert!(place.world.clock().step < 250, "the reload took too long for this test");
    let mut all = String::new();
    let took = place.run(|live, _| live.counts().takeovers == 1);
    all += &news(&mut place);
    assert!(took, "{all}");
    assert!(all.contains("sick: generation 1 has taken over"), "{all}");
    assert_eq!(place.world.instance(0).map(|i| i.health().clone()), Some(Health::Running));
    let steps = place.world.clock().step;
    assert!(steps >= 300, "{steps}");
    place.world.step();
    assert!(
        (place.height() - 1.0 - 0.001 * (steps + 1) as f64).abs() < 1e-4,
        "{} after {steps}",
        place.height()
    );
    let standing = place.live.standing(&place.world, 0);
    assert_eq!(standing.generation, 1);
    assert!(standing.trouble.is_some_and(|text| text.contains("chosen panic in step 300")));
}

#[test]
fn without_a_sound_older_build_the_last_good_picture_stands_and_a_mended_build_or_a_retry_revives_it() {
    let mut place = Place::new(&builds("faulty"), &scene(40));
    place.rename_into_place(&another(builds("faulty")));
    place.until(1, 0);
    let stood = place.run(|live, world| {
        let _ = live;
        world.clock().step > 90
    });
    assert!(stood);
    let all = news(&mut place);
    assert!(all.contains("sick stands still: the older build fails, too: sick:"), "{all}");
    let outputs = &place.world.frame().outputs;
    let [sick, well] = [0, 1].map(|module| outputs[module].fibre_nodes[1].position[1]);
    assert!((sick - 1.039).abs() < 1e-5, "its last good picture is of step 39, not {sick}");
    assert!(well > 1.089, "the rest goes on: {well}");
    // A retry begins at the last good step, and fails again in its next one.
    place.live.retry(0);
    let end = place.world.clock().step + 30;
    place.run(|_, world| world.clock().step > end);
    let all = news(&mut place);
    assert!(all.contains("sick: once more from the last good state"), "{all}");
    assert!(matches!(place.world.instance(0).map(|i| i.health()), Some(Health::Faulty(_))));
    // The build that mends it makes up for all that was missed.
    place.rename_into_place(&builds(""));
    place.until(2, 0);
    let steps = place.world.clock().step;
    assert!((place.height() - 1.0 - 0.001 * steps as f64).abs() < 1e-4, "{} after {steps}", place.height());
    std::thread::sleep(Duration::from_millis(1));
}
