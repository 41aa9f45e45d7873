//! Looks at everything that a step emitted before the host uses any of it. A message names stream, index and
//! field.

mod elements;
pub(crate) mod meshes;

use std::{
    fmt::Display,
    ops::Range,
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
};

use crate::{Outputs, Stream, Visit};
use reef_abi::{self as abi, Element};

pub use elements::{FARTHEST, FARTHEST_LOCAL};
pub(crate) use elements::{FIBRE_FLAGS, SIDES, is_unit};

/// Elements that one job looks at, unless they are small.
pub(crate) const PIECE: usize = 2048;

/// Who shares the work: calls the job once for each number below the count, and returns when all are done.
pub type Share<'a> = &'a dyn Fn(usize, &(dyn Fn(usize) + Sync));

/// Nobody shares it: one job after the other.
pub fn alone(count: usize, job: &(dyn Fn(usize) + Sync)) {
    (0..count).for_each(job);
}

/// What the host knows about the elements of a stream that it takes.
pub trait Emitted: Element {
    /// The number of elements that one job looks at; None: they are few in most seas, and one job looks at
    /// all such streams.
    const PIECE: Option<usize>;

    /// What is wrong with it, among the streams that it refers to.
    fn check(&self, outputs: &Outputs) -> Result<(), Fault>;

    /// Its id, where no two elements of its stream may have the same.
    fn id(&self) -> Option<u64>;

    /// The index of the object that it belongs to, where it says so itself.
    fn object(&self) -> Option<u32>;

    /// Whether what the header calls spare is zero.
    fn spare_is_zero(&self) -> bool;

    /// What it has of a later contract than this host's: what is left out of it is no fault.
    fn unknown(&self) -> Option<Unknown> {
        None
    }

    /// What is wrong with it, spare fields and all.
    fn verdict(&self, outputs: &Outputs) -> Result<(), Fault> {
        self.check(outputs)?;
        if self.spare_is_zero() {
            return Ok(());
        }
        Err(Fault { field: "spare", problem: "is not zero".to_owned() })
    }

    /// The index of the first element that is wrong beside others of its stream but for their ids, and what
    /// is wrong. Looked for only where some part of the stream is not in order. `room`: memory to use.
    fn beside(_elements: &[Self], _room: &mut Vec<u64>) -> Option<(usize, Fault)> {
        None
    }

    /// Whether `part` of the stream is sound, and whether it is in order: its ids grow, the first one from
    /// `before`. May doubt what is allowed, but never passes what [`Emitted::verdict`] refuses, nor what is
    /// unknown; and calls nothing in order in which two elements exclude each other.
    fn glance(part: &[Self], before: u64, outputs: &Outputs) -> (bool, bool) {
        let sound =
            part.iter().all(|element| element.verdict(outputs).is_ok() && element.unknown().is_none());
        let mut last = before;
        let grow = part.iter().filter_map(Self::id).all(|id| std::mem::replace(&mut last, id) < id);
        (sound, grow)
    }
}

/// What is wrong with one element.
#[derive(Debug)]
pub struct Fault {
    field: &'static str,
    problem: String,
}

impl Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.field, self.problem)
    }
}

/// Something of a later contract: the bits of a field that mean nothing here, or its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknown {
    pub(crate) field: &'static str,
    pub(crate) value: u32,
}

impl Unknown {
    /// The bits beyond those that are known.
    pub(crate) fn bits(value: u32, known: u32) -> Option<Self> {
        (value & !known != 0).then_some(Self { field: "flags", value: value & !known })
    }
}

/// More of these, of one instance, are no news.
const MOST_UNKNOWN: usize = 16;

/// Reusable memory of the checks.
#[derive(Debug, Default)]
pub struct Checker {
    ids: Vec<u64>,
    /// What was met so far of a later contract, each once, with its stream.
    unknown: Vec<(u32, Unknown)>,
    /// How many of these were told.
    told: usize,
}

impl Checker {
    /// Checks all streams, each against those that it refers to.
    ///
    /// Nearly always everything is sound. So jobs first look at that alone, without a word to say
    /// (`glance.rs`); only when something seems wrong, a second pass finds the first wrong element and its
    /// message.
    pub fn check(&mut self, outputs: &Outputs, share: Share<'_>) -> Result<(), String> {
        let verdict = Verdict { sound: AtomicBool::new(true), unordered: AtomicU32::new(0) };
        let mut pieces = Pieces(0);
        outputs.show_all(&mut pieces);
        // The last job looks at all that is short in most seas.
        share(pieces.0 + 1, &|at| {
            let at = (at < pieces.0).then_some(at);
            outputs.show_all(&mut Look { outputs, at, verdict: &verdict });
        });
        let sound = verdict.sound.into_inner();
        let mut find = Find {
            outputs,
            sound,
            unordered: verdict.unordered.into_inner(),
            ids: &mut self.ids,
            unknown: &mut self.unknown,
            found: None,
        };
        if !sound || find.unordered != 0 {
            outputs.show_all(&mut find);
        }
        find.found.map_or(Ok(()), Err)
    }

    /// What was met of a later contract and not told yet: a text each.
    pub fn news(&mut self) -> impl Iterator<Item = String> + '_ {
        let untold = &self.unknown[std::mem::replace(&mut self.told, self.unknown.len())..];
        untold.iter().map(|(stream, unknown)| {
            let name = Stream::numbered(*stream).map_or("unknown", |stream| stream.name);
            let Unknown { field, value } = unknown;
            format!("stream {name}: {field} {value:#x} is not known here, and left out")
        })
    }
}

/// Whether what all jobs of a check looked at is sound.
struct Verdict {
    sound: AtomicBool,
    /// Bit s: stream s is not in the order that proves its ids to be unique, or its ranges.
    unordered: AtomicU32,
}

/// [`Verdict`] has a bit for each stream.
const _: () = assert!(abi::STREAM_COUNT <= u32::BITS);

/// How many jobs look at one piece of a stream.
struct Pieces(usize);

impl Visit for Pieces {
    fn visit<T: Emitted>(&mut self, elements: &[T]) {
        self.0 += T::PIECE.map_or(0, |piece| elements.len().div_ceil(piece));
    }
}

/// One job of a check: a piece of a long stream, or all short ones.
struct Look<'a> {
    outputs: &'a Outputs,
    /// Which of all pieces from here on; None: all short streams.
    at: Option<usize>,
    verdict: &'a Verdict,
}

impl Visit for Look<'_> {
    fn visit<T: Emitted>(&mut self, elements: &[T]) {
        let part = match (T::PIECE, &mut self.at) {
            (None, None) => 0..elements.len(),
            (Some(size), Some(at)) => {
                let part = piece(elements.len(), *at, size);
                // The last one's turn is over: it finds no piece in any other stream.
                *at = at.wrapping_sub(elements.len().div_ceil(size));
                part
            }
            _ => return,
        };
        if part.is_empty() {
            return;
        }
        let before = part.start.checked_sub(1).and_then(|last| elements[last].id()).unwrap_or(0);
        let (sound, grow) = T::glance(&elements[part], before, self.outputs);
        if !sound {
            self.verdict.sound.store(false, Ordering::Relaxed);
        }
        if !grow {
            self.verdict.unordered.fetch_or(1 << T::STREAM, Ordering::Relaxed);
        }
    }
}

/// Piece `at` of `length` elements; empty beyond the last.
fn piece(length: usize, at: usize, size: usize) -> Range<usize> {
    let start = at.saturating_mul(size).min(length);
    start..start.saturating_add(size).min(length)
}

/// Finds the first element that is wrong.
struct Find<'a> {
    outputs: &'a Outputs,
    sound: bool,
    unordered: u32,
    ids: &'a mut Vec<u64>,
    unknown: &'a mut Vec<(u32, Unknown)>,
    /// The message.
    found: Option<String>,
}

impl Visit for Find<'_> {
    fn visit<T: Emitted>(&mut self, elements: &[T]) {
        if self.found.is_some() {
            return;
        }
        let name = Stream::of::<T>().name;
        let unordered = self.unordered & 1 << T::STREAM != 0;
        let mut wrong = None;
        if !self.sound {
            wrong = elements
                .iter()
                .enumerate()
                .find_map(|(i, element)| Some((i, element.verdict(self.outputs).err()?)));
            for unknown in elements.iter().filter_map(T::unknown) {
                let met = (T::STREAM, unknown);
                if self.unknown.len() < MOST_UNKNOWN && !self.unknown.contains(&met) {
                    self.unknown.push(met);
                }
            }
        }
        if unordered && let Some((i, fault)) = T::beside(elements, self.ids) {
            // Of one element, what is wrong with it alone comes first, but for its spare fields.
            let alone = |own: &usize| *own < i || *own == i && elements[i].check(self.outputs).is_err();
            if !wrong.as_ref().is_some_and(|(own, _)| alone(own)) {
                wrong = Some((i, fault));
            }
        }
        self.found = wrong.map(|(i, fault)| format!("stream {name}, element {i}: {fault}"));
        if self.found.is_none() && unordered {
            self.ids.clear();
            self.ids.extend(elements.iter().filter_map(T::id));
            self.ids.sort_unstable();
            let twice = self.ids.windows(2).find(|pair| pair[0] == pair[1]);
            self.found = twice.map(|pair| format!("stream {name}: two elements have the id {}", pair[0]));
        }
    }
}

#[cfg(test)]
mod tests;
