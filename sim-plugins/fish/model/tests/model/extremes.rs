//! Speeds and forces that no fish has (§5.5: "extreme values").

use reef_fish_model::tank::Stepping;

use crate::*;

#[test]
fn speed_25_and_force_0_9_stretch_no_spring_to_twice_its_length() {
    let mut tank = one(usual(), drive(25.0, 0.9));
    let mut worst: f64 = 0.0;
    for _ in 0..360 {
        step(&mut tank, DT, &implicit());
        let nodes = nodes(&tank, 0);
        assert!(nodes.iter().all(|at| at.is_finite()));
        worst = worst.max(longest(tank.plan(), &nodes));
    }
    println!("at most {worst:.3} of its length at rest");
    assert!(worst < 2.0);
}

#[test]
fn speed_100_and_force_1_in_steps_of_40_ms_stay_finite() {
    let mut tank = one(usual(), drive(100.0, 1.0));
    let mut worst: f64 = 0.0;
    for _ in 0..1500 {
        step(&mut tank, THESIS_DT, &Stepping { longest: 1.0, ..implicit() });
        let nodes = nodes(&tank, 0);
        assert!(nodes.iter().all(|at| at.is_finite()));
        worst = worst.max(longest(tank.plan(), &nodes));
    }
    println!("at most {worst:.3} of its length at rest");
    assert!(worst < 3.0);
}
