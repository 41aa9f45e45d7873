//! One component of the velocity on its faces, with a rim of mirrored values around it.

use crate::lanes::{Real, WIDTH};

/// Rows and columns of the rim: a cubic reaches two cells beyond its own.
pub(crate) const RIM: usize = 4;
/// Unused or rim numbers before and behind each row, so that a vector may begin and end there.
const MARGIN: usize = WIDTH;

/// Which component a field is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    /// Along x, on the faces between columns: n + 1 wide, n high.
    X,
    /// Along y, on the faces between rows: n wide, n + 1 high.
    Y,
}

/// Numbers on n × n cells or their faces, row by row, x along a row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field<T> {
    n: usize,
    stride: usize,
    pub(crate) data: Vec<T>,
}

impl<T: Real> Field<T> {
    pub(crate) fn new(n: usize) -> Self {
        let stride = 2 * MARGIN + (n + 1).next_multiple_of(WIDTH);
        Self { n, stride, data: vec![T::default(); stride * (n + 1 + 2 * RIM)] }
    }

    /// From one row to the next.
    #[inline(always)]
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Where column `i` of row `j` is, counted from the first that is not of the rim.
    #[inline(always)]
    pub(crate) fn at(&self, i: usize, j: usize) -> usize {
        (j + RIM) * self.stride + MARGIN + i
    }

    /// Whether a place of [`Self::at`] is one that the rim mirrors.
    #[inline(always)]
    pub(crate) fn near_rim(&self, at: usize) -> bool {
        let (row, column) = (at / self.stride, at % self.stride);
        let inside = |k: usize, first: usize| (first + RIM..first + self.n - RIM).contains(&k);
        !(inside(row, RIM) && inside(column, MARGIN))
    }

    /// The first `count` numbers of a row.
    #[inline(always)]
    pub(crate) fn row(&self, j: usize, count: usize) -> &[T] {
        let at = self.at(0, j);
        &self.data[at..at + count]
    }

    /// Makes the velocity across the walls exactly 0 and fills the rim for free slip: what is along a wall is
    /// mirrored at it, what is across it is mirrored with the opposite sign. Behind the rim each row is 0:
    /// the last vector of a row reaches there, and no state has these numbers.
    pub(crate) fn close(&mut self, axis: Axis) {
        let (n, stride) = (self.n, self.stride);
        let height = if axis == Axis::X { n } else { n + 1 };
        for j in 0..height {
            let first = self.at(0, j);
            let row = &mut self.data[first - RIM..(j + RIM + 1) * stride];
            row[RIM + n + RIM..].fill(T::default());
            match axis {
                Axis::X => {
                    row[RIM] = T::default();
                    row[RIM + n] = T::default();
                    for k in 1..=RIM {
                        row[RIM - k] = -row[RIM + k];
                    }
                    for k in 1..RIM {
                        row[RIM + n + k] = -row[RIM + n - k];
                    }
                }
                Axis::Y => {
                    for k in 0..RIM {
                        row[RIM - 1 - k] = row[RIM + k];
                        row[RIM + n + k] = row[RIM + n - 1 - k];
                    }
                }
            }
        }
        let row = |j: usize| j * stride..(j + 1) * stride;
        match axis {
            Axis::X => {
                for k in 0..RIM {
                    self.data.copy_within(row(RIM + k), (RIM - 1 - k) * stride);
                    self.data.copy_within(row(RIM + n - 1 - k), (RIM + n + k) * stride);
                }
            }
            Axis::Y => {
                self.data[row(RIM)].fill(T::default());
                self.data[row(RIM + n)].fill(T::default());
                for k in 1..=RIM {
                    self.mirror_row(RIM + k, RIM - k);
                    if k < RIM {
                        self.mirror_row(RIM + n - k, RIM + n + k);
                    }
                }
            }
        }
    }

    /// Row `to` becomes the negative of row `from`.
    fn mirror_row(&mut self, from: usize, to: usize) {
        let stride = self.stride;
        let (low, high) = self.data.split_at_mut(from.max(to) * stride);
        let (near, far) = (&mut low[from.min(to) * stride..][..stride], &mut high[..stride]);
        let (source, target) = if from < to { (near, far) } else { (far, near) };
        target.iter_mut().zip(source.iter()).for_each(|(target, source)| *target = -*source);
    }

    /// Moves everything by whole cells, (columns, rows); what comes in is 0.
    pub(crate) fn shift(&mut self, [dx, dy]: [isize; 2], axis: Axis) {
        let (n, stride) = (self.n, self.stride);
        let (width, height) = if axis == Axis::X { (n + 1, n) } else { (n, n + 1) };
        let from =
            |to: usize, by: isize, count: usize| to.checked_add_signed(-by).filter(|from| *from < count);
        // Rows in the order in which none is overwritten before it has moved.
        let order = |k: usize| if dy > 0 { height - 1 - k } else { k };
        for j in (0..height).map(order) {
            let to = self.at(0, j);
            match from(j, dy, height) {
                Some(source) if dy != 0 => {
                    let start = self.at(0, source);
                    self.data.copy_within(start..start + width, to);
                }
                Some(_) => {}
                None => self.data[to..to + width].fill(T::default()),
            }
        }
        if dx == 0 {
            return;
        }
        for j in 0..height {
            let row = &mut self.data[(j + RIM) * stride + MARGIN..][..width];
            let by = dx.unsigned_abs().min(width);
            if dx > 0 {
                row.copy_within(..width - by, by);
                row[..by].fill(T::default());
            } else {
                row.copy_within(by.., 0);
                row[width - by..].fill(T::default());
            }
        }
    }
}
