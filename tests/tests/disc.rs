//! The oral disc of an anemone's foot stands in its model, which seats tentacles on it, and in the renderer,
//! which closes the foot with it: modules and renderer know nothing of each other.

use reef_anemone_model::plant::disc_height;
use reef_render::twin::disc_profile;

#[test]
fn tentacles_sit_on_the_disc_that_is_drawn() {
    for i in 0..=1000 {
        let distance = f64::from(i) / 1000.0;
        let drawn = f64::from(disc_profile(1.0 - distance as f32));
        // Roundings of f32 in sums of four numbers below a quarter.
        let apart = (disc_height(distance) - drawn).abs();
        assert!(apart < 1e-6, "{distance} radii from the axis: {apart}");
    }
}
