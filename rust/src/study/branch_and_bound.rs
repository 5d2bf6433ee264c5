//! Maximum of a polynomial on [-1, 1]^k by branch and bound on its Bernstein form.
//!
//! A box is finished when its largest coefficient does not exceed the largest value found so far by more than
//! a tolerance. Otherwise every axis along which all coefficients rise, or all fall, is reduced to the end
//! where the polynomial is largest, and the box is split along the axis whose differences vary most.
//! Comparisons of numbers are exact, so that only the transformation and the splits add rounding errors.

use crate::study::bernstein::{Lanes, split};

/// Distance between the certified and the attained end of a range, relative to the range. On the cases of
/// `benchmarks/ranges.rs` 1e-3 takes 0.3 to 0.9 times the boxes of 1e-6, and 1e-9 1.1 to 1.6 times.
const GAP: f64 = 1e-6;

/// Coefficients that a search for one end of one range may process. Polynomials with random coefficients
/// without decay, in six parameters at degree 3, take half of it. Half and twice change none of 67 searches.
const MOST_WORK: usize = 5_000_000;

/// Distances that are tried one after the other where the work for a smaller one does not suffice, as along a ridge of
/// equal maxima: sin(3 (a + b + c)) at degree 12 takes 1e-2. After the last one the remaining boxes count with their
/// certified bounds. Half and twice change none of 67 searches.
const COARSER_GAPS: [f64; 3] = [1e-4, 1e-2, 0.1];

/// Shortest part of a split, a power of two so that fractions are exact.
/// With half and twice 42 of 58 searches split elsewhere.
const SHORTEST: f64 = 1.0 / (1 << 16) as f64;

/// The upper end of a range; for the lower end values are negated.
#[derive(Clone, Debug, Default)]
pub(super) struct End {
    /// Largest value found.
    pub(super) attained: f64,
    /// Its point in [-1, 1]^k.
    pub(super) at: Vec<f64>,
}

/// A polynomial in the Bernstein basis.
pub(super) struct Polynomial<'a> {
    pub(super) degrees: &'a [usize],
    /// Number of coefficients per step along each axis.
    pub(super) strides: &'a [usize],
    /// Its coefficients are those of one lane.
    pub(super) values: &'a [Lanes],
    pub(super) lane: usize,
    /// 1, or -1 for the negated polynomial.
    pub(super) sign: f64,
    /// For each axis: 1 if all coefficients rise along it, -1 if all fall, otherwise 0; with the sign of
    /// `values`.
    pub(super) slopes: &'a [f64],
    /// Error of each coefficient.
    pub(super) error: f64,
    /// Error that each split adds.
    pub(super) split_error: f64,
    /// A bound known in advance.
    pub(super) bound: f64,
}

struct Piece {
    /// Its coefficients in the stack of values, to the end of the stack when it is the last piece.
    start: usize,
    /// Axes not yet reduced to an end, a bit each.
    free: u64,
    splits: usize,
    /// Its largest coefficient.
    bound: f64,
}

struct FreeAxis {
    axis: usize,
    degree: usize,
    inner: usize,
    /// How much the differences along it vary.
    spread: f64,
}

/// A search and its memory, which is kept from polynomial to polynomial.
#[derive(Default)]
pub(super) struct Search {
    pieces: Vec<Piece>,
    values: Vec<f64>,
    /// Lower end and width of every piece on every axis, pieces x k x 2.
    sides: Vec<f64>,
    /// Axes of the last piece that are free, the last axis first.
    free: Vec<FreeAxis>,
    offsets: Vec<usize>,
    /// Boxes processed so far.
    pub(super) boxes: usize,
}

impl Search {
    /// Certified largest value of a polynomial.
    ///
    /// `end` holds a value of the polynomial and its place, and is improved; `opposite` is a value from near
    /// the other end of the range.
    pub(super) fn climb(&mut self, polynomial: &Polynomial, end: &mut End, opposite: f64) -> f64 {
        let (mut certified, mut finished) = self.climb_within(GAP, polynomial, end, opposite);
        for gap in COARSER_GAPS {
            if finished {
                break;
            }
            let (coarser, done) = self.climb_within(gap, polynomial, end, opposite);
            (certified, finished) = (certified.min(coarser), done);
        }
        certified
    }

    /// The same to a distance from the value that is found, relative to the range, and whether the work sufficed.
    fn climb_within(
        &mut self,
        gap: f64,
        polynomial: &Polynomial,
        end: &mut End,
        opposite: f64,
    ) -> (f64, bool) {
        let Polynomial { degrees, error, split_error, bound, .. } = *polynomial;
        let after = |splits: usize| error + splits as f64 * split_error;
        self.begin(polynomial);
        let (mut certified, mut deepest, mut work) = (end.attained, 0, 0);
        while let Some(piece) = self.pieces.last() {
            let tolerance = (gap * (end.attained - opposite)).max(after(piece.splits));
            // Values up to a bound that is already certified need no further search.
            let enough = certified.max(end.attained + tolerance);
            if piece.bound > enough && enough < bound && work < MOST_WORK {
                deepest = deepest.max(piece.splits);
                work += self.values.len() - piece.start;
                self.boxes += 1;
                self.reduce(degrees);
                self.try_corners(degrees.len(), end);
                if self.pieces.last().is_some_and(|piece| piece.free != 0 && piece.bound > enough) {
                    self.split(degrees.len());
                    continue;
                }
            }
            certified = certified.max(self.drop_last(degrees.len()));
        }
        (bound.min(certified.max(end.attained) + after(deepest)), work < MOST_WORK)
    }

    /// Makes the whole box the only piece, reduced along the axes of one slope.
    fn begin(&mut self, polynomial: &Polynomial) {
        let Polynomial { degrees, strides, values, lane, sign, slopes, .. } = *polynomial;
        let Self { pieces, values: numbers, sides, offsets, .. } = self;
        let (mut free, mut base) = (0, 0);
        sides.clear();
        for axis in 0..degrees.len() {
            let slope = sign * slopes[axis];
            sides.extend(if degrees[axis] == 0 {
                [0.0, 0.0]
            } else if slope == 0.0 {
                [-1.0, 2.0]
            } else {
                [slope, 0.0]
            });
            if degrees[axis] > 0 && slope == 0.0 {
                free |= 1 << axis;
            } else if slope > 0.0 {
                base += degrees[axis] * strides[axis];
            }
        }
        offsets.clear();
        offsets.push(base);
        for axis in (0..degrees.len()).rev().filter(|axis| free >> axis & 1 == 1) {
            let inner = offsets.len();
            for i in 1..=degrees[axis] {
                for index in 0..inner {
                    offsets.push(offsets[index] + i * strides[axis]);
                }
            }
        }
        numbers.clear();
        numbers.extend(offsets.iter().map(|offset| sign * values[*offset][lane]));
        pieces.clear();
        pieces.push(Piece { start: 0, free, splits: 0, bound: largest(numbers) });
    }

    /// Reduces the axes of the last piece along which its coefficients only rise or only fall.
    fn reduce(&mut self, degrees: &[usize]) {
        let Some(piece) = self.pieces.last_mut() else { return };
        let values = &mut self.values;
        let sides = self.sides.len() - 2 * degrees.len();
        let before = values.len();
        let mut unsettled = true;
        while unsettled {
            unsettled = false;
            list_free(&mut self.free, piece.free, degrees);
            for index in 0..self.free.len() {
                let FreeAxis { axis, degree, inner, spread } = &mut self.free[index];
                let (smallest, most) = differences(&values[piece.start..], *degree, *inner);
                *spread = most - smallest;
                if smallest < 0.0 && most > 0.0 {
                    continue;
                }
                let kept = if smallest >= 0.0 { *degree } else { 0 };
                let side = &mut self.sides[sides + 2 * *axis..][..2];
                (side[0], side[1]) = (if kept == 0 { side[0] } else { side[0] + side[1] }, 0.0);
                keep_slice(values, piece.start, *degree, *inner, kept);
                piece.free &= !(1 << *axis);
                unsettled = true;
                break;
            }
        }
        if values.len() < before {
            piece.bound = largest(&values[piece.start..]);
        }
    }

    /// Compares the corners of the last piece with the largest value so far.
    fn try_corners(&mut self, parameters: usize, end: &mut End) {
        let Some(piece) = self.pieces.last() else { return };
        let values = &self.values[piece.start..];
        let (mut best, mut corner) = (end.attained, None);
        for upper in 0..1usize << self.free.len() {
            let at_upper = self.free.iter().enumerate().filter(|(bit, _)| upper >> bit & 1 == 1);
            let value = values[at_upper.map(|(_, free)| free.degree * free.inner).sum::<usize>()];
            if value > best {
                (best, corner) = (value, Some(upper));
            }
        }
        let Some(upper) = corner else { return };
        end.attained = best;
        let sides = &self.sides[self.sides.len() - 2 * parameters..];
        end.at.clear();
        end.at.extend(sides.chunks_exact(2).map(|side| side[0]));
        for (bit, free) in self.free.iter().enumerate() {
            end.at[free.axis] += f64::from(u8::from(upper >> bit & 1 == 1)) * sides[2 * free.axis + 1];
        }
    }

    /// Splits the last piece in two; the part with the larger bound comes last and is processed first.
    fn split(&mut self, parameters: usize) {
        let Some(whole) = self.pieces.last_mut() else { return };
        let Some(cut) = self.free.iter().max_by(|a, b| a.spread.total_cmp(&b.spread)) else { return };
        let (start, middle) = (whole.start, self.values.len());
        // With more axes the maximum along one line is a poor guide: halving took half as many boxes with
        // six.
        let t = if self.free.len() > 2 {
            0.5
        } else {
            top(&self.values[start..], cut.degree, cut.inner, whole.splits)
        };
        self.values.resize(2 * middle - start, 0.0);
        let (first, second) = self.values[start..].split_at_mut(middle - start);
        split(first, second, cut.degree, cut.inner, t);

        let sides = self.sides.len() - 2 * parameters;
        self.sides.extend_from_within(sides..);
        let (old, new) = self.sides.split_at_mut(sides + 2 * parameters);
        let (old, new) = (&mut old[sides + 2 * cut.axis..][..2], &mut new[2 * cut.axis..][..2]);
        let (end, width) = (old[0] + old[1], t * old[1]);
        (new[1], old[0]) = (width, new[0] + width);
        old[1] = end - old[0];

        let (upper, lower) = (largest(first), largest(second));
        (whole.splits, whole.bound) = (whole.splits + 1, upper);
        let mut last = Piece { start: middle, bound: lower, ..*whole };
        if lower < upper {
            first.swap_with_slice(second);
            (whole.bound, last.bound) = (lower, upper);
            old.swap_with_slice(new);
        }
        self.pieces.push(last);
    }

    /// Drops the last piece and returns its bound.
    fn drop_last(&mut self, parameters: usize) -> f64 {
        let Some(piece) = self.pieces.pop() else { return f64::NEG_INFINITY };
        self.values.truncate(piece.start);
        self.sides.truncate(2 * parameters * self.pieces.len());
        piece.bound
    }
}

/// Position at which to split an axis: the maximum of the parabola through the largest coefficient and its
/// neighbors, which converges to a smooth maximum much faster than halving; the middle where there is none,
/// and in every fourth split.
fn top(values: &[f64], degree: usize, inner: usize, splits: usize) -> f64 {
    let most = values.iter().enumerate().fold((0, f64::NEG_INFINITY), |most, (index, &value)| {
        if value > most.1 { (index, value) } else { most }
    });
    let (index, i) = (most.0, most.0 / inner % (degree + 1));
    if i == 0 || i == degree || splits % 4 == 3 {
        return 0.5;
    }
    let (rise, fall) = (values[index] - values[index - inner], values[index] - values[index + inner]);
    // The derivative, of degree n - 1, has these two coefficients at (i - 1)/(n - 1) and i/(n - 1).
    let at = (i as f64 - 1.0 + rise / (rise + fall)) / (degree as f64 - 1.0);
    (at.clamp(SHORTEST, 1.0 - SHORTEST) / SHORTEST).round() * SHORTEST
}

fn list_free(free: &mut Vec<FreeAxis>, axes: u64, degrees: &[usize]) {
    free.clear();
    let mut inner = 1;
    for axis in (0..degrees.len()).rev().filter(|axis| axes >> axis & 1 == 1) {
        free.push(FreeAxis { axis, degree: degrees[axis], inner, spread: 0.0 });
        inner *= degrees[axis] + 1;
    }
}

/// Smallest and largest difference of neighbors along an axis.
fn differences(values: &[f64], degree: usize, inner: usize) -> (f64, f64) {
    let (mut smallest, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for block in values.chunks_exact((degree + 1) * inner) {
        for (after, before) in block[inner..].iter().zip(block) {
            let difference = after - before;
            smallest = if difference < smallest { difference } else { smallest };
            most = if difference > most { difference } else { most };
        }
    }
    (smallest, most)
}

/// Keeps one of the `degree` + 1 slices along an axis of the array from `start` to the end.
fn keep_slice(values: &mut Vec<f64>, start: usize, degree: usize, inner: usize, kept: usize) {
    let blocks = (values.len() - start) / ((degree + 1) * inner);
    for block in 0..blocks {
        let source = start + (block * (degree + 1) + kept) * inner;
        values.copy_within(source..source + inner, start + block * inner);
    }
    values.truncate(start + blocks * inner);
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(f64::NEG_INFINITY, |most, &value| if value > most { value } else { most })
}
