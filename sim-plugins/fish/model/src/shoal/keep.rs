//! Where fish are kept: those of a kind about in the order of its grid, so that whoever swims beside whom is
//! near it in memory, too. Everybody else knows them by their numbers.

use core::ops::Index;

use super::Fish;

/// All fish by their numbers.
#[derive(Clone, Copy, Debug)]
pub struct Everybody<'a> {
    fish: &'a [Fish],
    kept: &'a [u32],
}

impl<'a> Everybody<'a> {
    /// `kept`: where the fish of each number is among `fish`.
    pub(super) fn new(fish: &'a [Fish], kept: &'a [u32]) -> Self {
        Self { fish, kept }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.kept.len()
    }

    /// Whether there is nobody.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// A fish. Panics where there is none of this number.
    pub fn one(&self, number: usize) -> &'a Fish {
        &self.fish[self.kept[number] as usize]
    }

    /// One after the other.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &'a Fish> + Clone + use<'a> {
        let Self { fish, kept } = *self;
        kept.iter().map(move |at| &fish[*at as usize])
    }
}

impl Index<usize> for Everybody<'_> {
    type Output = Fish;

    fn index(&self, number: usize) -> &Fish {
        self.one(number)
    }
}

/// Puts the fish of a kind, the first of whom is kept at `first`, in an order: `order` has their slots, and
/// `kept` says by slots where each is.
pub(super) fn put_in_order(fish: &mut [Fish], first: usize, order: &[u32], kept: &mut [u32]) {
    for (place, slot) in order.iter().enumerate() {
        let at = kept[*slot as usize] as usize - first;
        if at != place {
            kept[fish[place].slot as usize] = (first + at) as u32;
            kept[*slot as usize] = (first + place) as u32;
            fish.swap(place, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use reef_flow::{Level, random::Random};
    use reef_sdk::Workers;

    use crate::{
        shoal::{Habitat, Kind, Shoal, Start, Surroundings, Waves},
        species::Species,
    };

    const COUNT: usize = 300;

    fn shoal() -> Shoal {
        let kind = || Kind::new(&Species::default(), Vec::new()).expect("a kind");
        let habitat = Habitat { low: DVec3::splat(-3.0), high: DVec3::splat(3.0) };
        let mut random = Random::new(7, 7);
        let mut place = || DVec3::from([(); 3].map(|()| 2.9 * random.signed()));
        let start = |kind: u32, position: DVec3, seed: u64| Start {
            kind,
            position,
            heading: 0.0,
            size: 1.0,
            habitat: 0,
            home: None,
            seed,
        };
        let starts: Vec<Start> = (0..COUNT as u64).map(|i| start((i % 2) as u32, place(), i)).collect();
        Shoal::new(vec![kind(), kind()], vec![habitat], &starts).expect("a shoal")
    }

    fn step(shoal: &mut Shoal) {
        shoal.step(&Surroundings {
            flow: &[],
            bed: None,
            waves: Waves::default(),
            obstacles: &[],
            strangers: &[],
            surface: 10.0,
            hosts: &[],
            eye: DVec3::ZERO,
            // Some are stepped with their bodies.
            near: 1.0,
            dt: 1.0 / 60.0,
            level: Level::best(),
            workers: Workers::inline(),
        });
    }

    #[test]
    fn where_fish_are_kept_changes_nothing_of_what_they_do() {
        let (mut ordered, mut as_sown) = (shoal(), shoal());
        for _ in 0..150 {
            // Never their turn.
            as_sown.orderly = u32::MAX;
            step(&mut ordered);
            step(&mut as_sown);
        }
        assert!(as_sown.kept.is_sorted() && !ordered.kept.is_sorted());
        assert!(ordered.save() == as_sown.save());
    }

    #[test]
    fn fish_are_kept_in_the_order_of_their_grids_and_known_by_their_numbers() {
        let mut shoal = shoal();
        step(&mut shoal);
        for (grid, first) in shoal.grids.iter().zip(&shoal.firsts) {
            let first = *first as usize;
            let kept = shoal.fish[first..first + grid.len()].iter().map(|fish| fish.slot);
            assert_eq!(kept.collect::<Vec<_>>(), grid.slots);
        }
        let numbers = shoal.fish().iter().map(|fish| shoal.firsts[fish.kind as usize] + fish.slot);
        assert_eq!(numbers.collect::<Vec<_>>(), (0..COUNT as u32).collect::<Vec<_>>());
        assert_eq!((shoal.fish().len(), shoal.fish().is_empty()), (COUNT, false));
    }
}
