//! Anemones as homes: who takes which, and keeps it.

use glam::DVec3;
use reef_fish_model::{
    shoal::{Host, Kind, Shoal, Start, Surroundings},
    species::Species,
};
use reef_sdk::abi::fnv1a_32;

use crate::{
    DT,
    shoal::{around, habitat},
    species::species,
};

const ANEMONE: &str = "host-anemone";

/// An anemone at so many metres along x, with its number.
fn anemone(id: u64, x: f64) -> Host {
    let position = DVec3::new(x, -5.0, 0.0);
    Host { id, species: fnv1a_32(ANEMONE.as_bytes()), position, radius: 0.2 }
}

fn start(x: f64) -> Start {
    let position = DVec3::new(x, -4.9, 0.1);
    Start { kind: 0, position, heading: 0.0, size: 1.0, habitat: 0, home: None, seed: (x * 100.0) as u64 }
}

fn of(species: &Species, size: f64, starts: &[Start]) -> Shoal {
    let kind = Kind::new(species, Vec::new()).expect("a kind");
    Shoal::new(vec![kind], vec![habitat(size)], starts).expect("a shoal")
}

/// One step among these anemones, then the x of each fish's home.
fn homes(shoal: &mut Shoal, hosts: &[Host]) -> Vec<Option<f64>> {
    shoal.step(&Surroundings { hosts, ..around(0.0) });
    (0..shoal.fish().len()).map(|number| shoal.home(number).map(|home| home.x)).collect()
}

#[test]
fn each_takes_the_nearest_that_is_not_crowded_in_whatever_order() {
    let species = species("clownfish");
    let starts = [start(0.1), start(0.2), start(-0.1), start(2.9)];
    let hosts = [anemone(7, 0.0), anemone(3, 0.5), anemone(9, 3.0)];
    // The third finds two in the nearest: half a metre further there is room.
    let expected = [Some(0.0), Some(0.5), Some(0.0), Some(3.0)];
    let take = |hosts: &[Host]| homes(&mut of(&species, 10.0, &starts), hosts);
    assert_eq!(take(&hosts), expected);
    assert_eq!(take(&[hosts[2], hosts[0], hosts[1]]), expected);
    let renamed = hosts.map(|host| Host { id: 100 - host.id, ..host });
    assert_eq!(take(&renamed), expected, "ids decide nothing");
    // As far from both, and nobody knows which came first.
    let twins = [anemone(1, 0.4), anemone(2, -0.2)];
    let lone = |hosts: &[Host]| homes(&mut of(&species, 10.0, &[start(0.1)]), hosts);
    assert_eq!(lone(&twins), lone(&[twins[1], twins[0]]));
}

#[test]
fn what_is_no_home_or_out_of_the_box_is_not_taken() {
    let species = species("clownfish");
    let take = |host: Host| homes(&mut of(&species, 2.0, &[start(0.1)]), &[host])[0];
    assert_eq!(take(anemone(1, 0.3)), Some(0.3));
    assert_eq!(take(anemone(1, 1.3)), None, "outside of its box");
    assert_eq!(take(Host { species: 1, ..anemone(1, 0.3) }), None, "another species");
    let mut stray = species.clone();
    stray.mind.home = 0.0;
    assert_eq!(homes(&mut of(&stray, 2.0, &[start(0.1)]), &[anemone(1, 0.3)]), [None]);
    let given = Start { home: Some(DVec3::new(0.7, -5.0, 0.0)), ..start(0.1) };
    assert_eq!(homes(&mut of(&species, 2.0, &[given]), &[anemone(1, 0.3)]), [Some(0.7)], "by hand");
}

#[test]
fn a_home_is_kept_over_saves_new_ids_and_nearer_ones() {
    let species = species("clownfish");
    let starts = [start(0.1), start(0.2)];
    let hosts = [anemone(7, 0.0), anemone(3, 0.5)];
    let mut shoal = of(&species, 10.0, &starts);
    let taken = homes(&mut shoal, &hosts);
    let mut loaded = of(&species, 10.0, &starts);
    loaded.load(&shoal.save()).expect("its own state");
    // A nearer one comes, the ids of all change, and the old ones are others' now: a module was added before
    // theirs.
    let later = [anemone(7, 0.5), anemone(3, 0.12), anemone(8, 0.0)];
    assert_eq!(homes(&mut loaded, &later), taken);
    assert_eq!(homes(&mut loaded, &[]), taken, "nobody shows any in this step");
    // A tentacle's width aside, as it sways.
    let swaying = later.map(|host| Host { position: host.position + DVec3::X * 0.01, ..host });
    assert_eq!(homes(&mut loaded, &swaying), [Some(0.01), Some(0.51)]);
    // It is gone: another one is taken.
    assert_eq!(homes(&mut loaded, &[anemone(5, 0.12)]), [Some(0.12); 2]);
    // A state of before there were homes.
    let mut old = shoal.save();
    old.homes.fill(0);
    old.home_places.fill(0.0);
    loaded.load(&old).expect("an old state");
    assert!((0..loaded.fish().len()).all(|number| loaded.home(number).is_none()));
}

#[test]
fn a_clownfish_stays_with_its_anemone_and_pushes_its_tentacles_away() {
    for near in [0.0, 1e9] {
        let species = species("clownfish");
        let hosts = [anemone(1, 0.3)];
        let mut shoal = of(&species, 8.0, &[start(-1.5)]);
        let length = shoal.kinds()[0].length();
        let (mut farthest, mut pushed) = (0.0_f64, 0);
        for step in 0..(180.0 / DT) as usize {
            shoal.step(&Surroundings { hosts: &hosts, ..around(near) });
            if step > (60.0 / DT) as usize {
                farthest = farthest.max(shoal.fish()[0].position.distance(hosts[0].position));
                pushed += usize::from(!shoal.flows().is_empty());
            }
        }
        println!("{near}: {farthest:.2} m, {pushed} steps");
        assert!(farthest < 1.6 * species.mind.home * length, "it came from 1.8 m, now {farthest} m");
        assert!(pushed as f64 > 0.9 * 120.0 / DT);
    }
}
