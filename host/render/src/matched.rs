//! Which things of two steps are the same: objects by their ids, elements by their order within their object.

use std::collections::HashMap;

use reef_streams::{Outputs, frame::Frame};

/// Where the things of a step were in the list of the step before. None: each at its own place, which is the
/// usual case, and the fast one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matched(Option<Vec<Option<usize>>>);

impl Matched {
    /// Of the objects of each module; those of a module that was not there before were nowhere.
    pub fn modules(previous: &Frame, current: &Frame) -> Vec<Self> {
        let modules = current.outputs.iter().enumerate();
        modules.map(|(i, now)| Self::objects(previous.of_module(i), now)).collect()
    }

    fn objects(before: &Outputs, now: &Outputs) -> Self {
        let [ids_before, ids] = [before, now].map(|outputs| outputs.objects.iter().map(|object| object.id));
        if std::ptr::eq(before, now) || ids_before.clone().eq(ids.clone()) {
            return Self(None);
        }
        let places: HashMap<u64, usize> = ids_before.zip(0..).collect();
        Self(Some(ids.map(|id| places.get(&id).copied()).collect()))
    }

    /// Of elements, by the number of the object of each.
    pub fn elements(
        &self,
        before: impl ExactSizeIterator<Item = u32> + Clone,
        now: impl ExactSizeIterator<Item = u32> + Clone,
    ) -> Self {
        if self.0.is_none() && before.clone().eq(now.clone()) {
            return Self(None);
        }
        // Counting sort: where each object's elements begin, then these one after the other.
        let objects = before.clone().max().map_or(0, |most| most as usize + 1);
        let mut begins = vec![0; objects + 1];
        before.clone().for_each(|object| begins[object as usize + 1] += 1);
        (0..objects).for_each(|object| begins[object + 1] += begins[object]);
        let mut ends = begins.clone();
        let mut sorted = vec![0; before.len()];
        for (i, object) in before.enumerate() {
            let end = &mut ends[object as usize];
            sorted[*end] = i;
            *end += 1;
        }
        let mut met = vec![0; now.clone().max().map_or(0, |most| most as usize + 1)];
        let place = |object: u32| {
            let object = object as usize;
            let number = met[object];
            met[object] += 1;
            let then = self.of(object).filter(|then| *then < objects)?;
            sorted[begins[then]..begins[then + 1]].get(number).copied()
        };
        Self(Some(now.map(place).collect()))
    }

    /// The place before of what is at `place` now; None: it was not there.
    pub fn of(&self, place: usize) -> Option<usize> {
        match &self.0 {
            None => Some(place),
            Some(places) => places[place],
        }
    }
}

#[cfg(test)]
mod tests {
    use reef_abi as abi;

    use super::*;

    fn objects(ids: &[u64]) -> Outputs {
        let objects = ids.iter().map(|id| abi::Object { id: *id, ..abi::Object::default() }).collect();
        Outputs { objects, ..Outputs::default() }
    }

    fn places(matched: &Matched, count: usize) -> Vec<Option<usize>> {
        (0..count).map(|place| matched.of(place)).collect()
    }

    #[test]
    fn objects_are_found_by_their_ids_and_elements_by_their_order_within_them() {
        let [before, now] = [objects(&[7, 3, 9]), objects(&[9, 5, 7])];
        let matched = Matched::objects(&before, &now);
        assert_eq!(places(&matched, 3), [Some(2), None, Some(0)]);
        // Two elements of 7 before, one of 3, three of 9; now one of 9 less, some of 5, and one of 7 more.
        let elements = matched.elements([2, 0, 1, 2, 0, 2].into_iter(), [0, 2, 0, 1, 2, 2].into_iter());
        assert_eq!(places(&elements, 6), [Some(0), Some(1), Some(3), None, Some(4), None]);
        let none = matched.elements([].into_iter(), [0, 1, 2].into_iter());
        assert_eq!(places(&none, 3), [None; 3]);
    }

    #[test]
    fn what_stays_is_matched_without_a_list() {
        let [before, now] = [objects(&[7, 3]), objects(&[7, 3])];
        let matched = Matched::objects(&before, &now);
        assert_eq!(matched, Matched(None));
        assert_eq!(matched.elements([1, 0].into_iter(), [1, 0].into_iter()), Matched(None));
        let more = matched.elements([1].into_iter(), [0, 1].into_iter());
        assert_eq!(places(&more, 2), [None, Some(0)]);
    }
}
