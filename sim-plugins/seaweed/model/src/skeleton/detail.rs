//! What the levels of detail make of a skeleton's segments (§4.4.1), and at which of them waves are felt.

use super::Segment;

/// What the levels of detail make of a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Detail {
    pub(super) tier: u8,
    pub(super) middle: usize,
    pub(super) far: usize,
    pub(super) stations: [[usize; 2]; STATIONS.len()],
    pub(super) between: [f64; STATIONS.len()],
}

/// Farthest that two segments of a branch are apart between which the waves' motion is taken to be linear
/// [m], the coarsest first: which of them is used follows from the waves, so that it errs by 3 % at most.
pub(crate) const STATIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// The levels of detail of each segment (§4.4.1). Computed are: the first of a branch at all levels, the rest
/// of the branch's lower half (⌈n/2⌉ in all) near and in the middle, its upper half near alone. What is not
/// computed by itself feels the water of the middle of its half, and far of the branch's middle. A branch
/// goes on with the first segment at its end.
pub(super) fn levels(segments: &[Segment]) -> Vec<Detail> {
    let (mut next, mut goes_on) = (vec![None; segments.len()], vec![false; segments.len()]);
    for (number, segment) in segments.iter().enumerate() {
        let Some(parent) = segment.parent else { continue };
        if next[parent].is_none() && segment.height >= 0.999 * segments[parent].length {
            next[parent] = Some(number);
            goes_on[number] = true;
        }
    }
    let (mut levels, mut branch) = (vec![Detail::default(); segments.len()], Vec::new());
    for number in (0..segments.len()).filter(|number| !goes_on[*number]) {
        branch.clear();
        branch.extend(core::iter::successors(Some(number), |at| next[*at]));
        let (half, far) = (branch.len().div_ceil(2), branch[branch.len().div_ceil(2) - 1]);
        let upper = branch[(half + branch.len()) / 2 - usize::from(half == branch.len())];
        let mut along = 0.0;
        let middle = |here: &usize| {
            along += segments[*here].length;
            along - 0.5 * segments[*here].length
        };
        let middles: Vec<f64> = branch.iter().map(middle).collect();
        let mut spans = [[0, 0]; STATIONS.len()];
        for (i, here) in branch.iter().enumerate() {
            let mut detail = Detail { tier: 2, middle: upper, far, ..Detail::default() };
            for (number, ([before, after], apart)) in spans.iter_mut().zip(STATIONS).enumerate() {
                if i == *after {
                    *before = i;
                    let near = (i + 1..branch.len()).take_while(|next| middles[*next] - middles[i] <= apart);
                    *after = near.last().unwrap_or((i + 1).min(branch.len() - 1));
                }
                let [from, to] = [*before, *after];
                detail.stations[number] = if i == from { [*here; 2] } else { [branch[from], branch[to]] };
                detail.between[number] =
                    (middles[i] - middles[from]) / (middles[to] - middles[from]).max(1e-9);
            }
            levels[*here] = match i {
                0 => Detail { tier: 0, middle: *here, ..detail },
                _ if i < half => Detail { tier: 1, middle: *here, ..detail },
                _ => detail,
            };
        }
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::{Joint, Skeleton, tests::chain};

    #[test]
    fn levels_compute_all_the_lower_half_and_the_first() {
        // A stem of five with a branch of two on its third segment.
        let mut segments = chain(5);
        segments.push(Segment { parent: Some(2), height: 0.05, ..Segment::default() });
        segments.push(Segment { parent: Some(5), height: 0.1, ..Segment::default() });
        let skeleton = Skeleton::new(&segments).unwrap();
        let tiers: Vec<u8> = skeleton.joints.iter().map(|joint| joint.tier).collect();
        assert_eq!(tiers, [0, 1, 1, 2, 2, 0, 2]);
        assert_eq!([0, 1, 2].map(|level| skeleton.computed(level)), [7, 4, 2]);
        // In the middle the stem's upper half and the branch's end feel the water of one of theirs.
        let water: Vec<[u32; 2]> = skeleton.joints.iter().map(|joint| [joint.middle, joint.far]).collect();
        assert_eq!(water, [[0, 2], [1, 2], [2, 2], [4, 2], [4, 2], [5, 5], [6, 5]]);
        assert_eq!([0, 1, 2].map(|level| skeleton.evaluated(level)), [7, 6, 2]);
    }

    #[test]
    fn waves_are_felt_at_both_ends_of_a_branch_and_at_stations_between() {
        // Twelve of a decimetre, and a single one on the third.
        let mut segments = chain(12);
        segments.push(Segment { parent: Some(2), height: 0.05, ..Segment::default() });
        let skeleton = Skeleton::new(&segments).unwrap();
        let own = |apart: usize| -> Vec<u32> {
            let is_one = |(i, joint): &(u32, &Joint)| joint.stations[apart][0] == *i;
            (0..).zip(&skeleton.joints).filter(is_one).map(|(i, _)| i).collect()
        };
        assert_eq!(own(0), [0, 10, 11, 12]);
        assert_eq!(own(1), [0, 5, 10, 11, 12]);
        assert_eq!(own(2), [0, 2, 4, 6, 8, 10, 11, 12]);
        assert_eq!(own(3), (0..=12).collect::<Vec<u32>>());
        for (number, joint) in skeleton.joints.iter().enumerate().take(11) {
            for (stations, between) in joint.stations.iter().zip(joint.between) {
                let [a, b] = stations.map(f64::from);
                let at = a + (b - a) * f64::from(between);
                assert!((at - number as f64).abs() < 1e-5, "{number}: {a} {b} {between}");
            }
        }
    }
}
