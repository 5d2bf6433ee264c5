//! The certified range of polynomials of total degree over the box [-1, 1]^k, for so many parameters that the tensor
//! of coefficients is too large for the Bernstein basis.
//!
//! Branch and bound on the Chebyshev coefficients themselves. Axes along which the polynomial is proved to be
//! monotone in a box are fixed at their better end. The rest is bounded by the range of its terms of one variable up
//! to degree two plus the sizes of all other terms. Boxes are halved along the axis whose mixed and higher terms are
//! largest. Rounding errors are bounded by the standard model of floating-point sums and added to every bound.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

use super::regression::{exponents, term_count};
use crate::study::chebyshev::GridError;
use crate::study::pool::in_parallel;
use crate::study::range::Ranges;
use crate::study::sweep::Monitor;

/// Accuracy and largest work of an end of a range.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Distance of the bound from an attained value at which the search ends, relative to the sum of the
    /// coefficients.
    pub tolerance: f64,
    /// Largest number of boxes for one end; its bound is then as good as it is.
    pub boxes: usize,
}

/// For ranges that are results themselves.
pub const FINE: Effort = Effort { tolerance: 1e-6, boxes: 1000 };

/// For bands, to which the error of the polynomial is added.
pub const COARSE: Effort = Effort { tolerance: 1e-3, boxes: 60 };

/// One end of the range of a polynomial.
#[derive(Clone, Debug, PartialEq)]
pub struct End {
    /// Bound of all values.
    pub bound: f64,
    /// A value that is attained, but for rounding.
    pub attained: f64,
    /// Where, in [-1, 1].
    pub at: Vec<f64>,
}

/// Finds the ranges of polynomials of one total degree.
pub struct SparseRange {
    parameters: usize,
    degree: usize,
    effort: Effort,
    exponents: Vec<usize>,
    /// Number of the term whose exponent along an axis is lowered to m, axes x terms x (degree + 1).
    lowered: Vec<usize>,
    /// T_n of the lower and of the upper half of [-1, 1] in the T_m of the half, (degree + 1)^2 each.
    halves: [Vec<f64>; 2],
    /// Largest sum of the sizes of a row of `halves`.
    growth: f64,
}

/// The range of every polynomial of total degree over [-1, 1]^k; `coefficients` are terms x `columns`.
///
/// On `threads` threads of a private pool (default: one for every processor), the same bits for any number. None
/// if the monitor cancels.
///
/// # Errors
///
/// No parameter, no column, another number of coefficients than terms x columns, one that is not finite, threads
/// that cannot be started.
pub fn total_degree_ranges(
    coefficients: &[f64],
    columns: usize,
    parameters: usize,
    degree: usize,
    threads: Option<usize>,
    monitor: Monitor,
) -> Result<Option<Ranges>, GridError> {
    let terms = term_count(parameters, degree);
    if parameters == 0 || columns == 0 || terms.checked_mul(columns) != Some(coefficients.len()) {
        return Err(GridError::new(format!(
            "{} coefficients are not {terms} terms x {columns} columns of degree {degree} in {parameters} parameters",
            coefficients.len()
        )));
    }
    if let Some(at) = coefficients.iter().position(|c| !c.is_finite()) {
        let message = format!("column {} has a coefficient {}", at % columns, coefficients[at]);
        return Err(GridError::new(message));
    }
    let search = SparseRange::new(parameters, degree, FINE);
    let one = |column: usize| {
        let values = || coefficients.iter().skip(column).step_by(columns).copied().collect::<Vec<f64>>();
        monitor().then(|| search.range(&values()))
    };
    let found = in_parallel(columns, threads, one)?;
    Ok(found.map(|ends| {
        let mut ranges = Ranges::default();
        for [low, high] in ends {
            ranges.push([low.bound, high.bound], [low.attained, high.attained], [&low.at, &high.at]);
        }
        ranges
    }))
}

/// A part of the box, with its polynomial in variables that run from -1 to 1 over it.
struct Part {
    coefficients: Vec<f64>,
    /// Middle and half-length along each axis; no length where the axis is fixed.
    sides: Vec<[f64; 2]>,
    /// Bound of the rounding error of the polynomial in the part.
    error: f64,
    bound: f64,
}

impl SparseRange {
    /// Prepares the search for polynomials with terms in the order of [`exponents`].
    pub fn new(parameters: usize, degree: usize, effort: Effort) -> Self {
        let exponents = exponents(parameters, degree);
        let terms = exponents.chunks_exact(parameters);
        let number: HashMap<&[usize], usize> =
            terms.clone().enumerate().map(|(number, term)| (term, number)).collect();
        let mut lowered = Vec::with_capacity(exponents.len() * (degree + 1));
        for axis in 0..parameters {
            for term in terms.clone() {
                let mut other = term.to_vec();
                lowered.extend((0..=degree).map(|m| {
                    other[axis] = m.min(term[axis]);
                    number[other.as_slice()]
                }));
            }
        }
        let halves = [half(degree, -0.5), half(degree, 0.5)];
        let sums = halves.iter().flat_map(|half| half.chunks_exact(degree + 1));
        let growth = sums.map(|row| row.iter().map(|m| m.abs()).sum()).fold(1.0, f64::max);
        Self { parameters, degree, effort, exponents, lowered, halves, growth }
    }

    /// The lower and the upper end of the range of the polynomial with these coefficients.
    pub fn range(&self, coefficients: &[f64]) -> [End; 2] {
        let opposite: Vec<f64> = coefficients.iter().map(|c| -c).collect();
        let low = self.upper_end(opposite);
        let low = End { bound: -low.bound, attained: -low.attained, at: low.at };
        [low, self.upper_end(coefficients.to_vec())]
    }

    /// The largest value of a polynomial.
    pub fn upper_end(&self, coefficients: Vec<f64>) -> End {
        let size: f64 = coefficients.iter().skip(1).map(|c| c.abs()).sum();
        let tolerance = self.effort.tolerance * size;
        let whole = Part { coefficients, sides: vec![[0.0, 1.0]; self.parameters], error: 0.0, bound: 0.0 };
        let mut best = End { bound: 0.0, attained: f64::NEG_INFINITY, at: vec![0.0; self.parameters] };
        let mut parts = BinaryHeap::from([self.bounded(whole, &mut best)]);
        let mut boxes = 0;
        while let Some(part) = parts.pop() {
            if part.bound <= best.attained + tolerance || boxes >= self.effort.boxes {
                // No other part has a larger bound.
                best.bound = part.bound.max(best.attained);
                return best;
            }
            boxes += 2;
            let axis = self.worst_axis(&part);
            for side in 0..2 {
                parts.push(self.bounded(self.halved(&part, axis, side), &mut best));
            }
        }
        best.bound = best.attained;
        best
    }

    fn terms(&self) -> impl Iterator<Item = &[usize]> {
        self.exponents.chunks_exact(self.parameters)
    }

    fn lower(&self, axis: usize, term: usize, exponent: usize) -> usize {
        let terms = self.exponents.len() / self.parameters;
        self.lowered[(axis * terms + term) * (self.degree + 1) + exponent]
    }

    /// A part with its monotone axes fixed, its bound, and a value that may be the best.
    fn bounded(&self, mut part: Part, best: &mut End) -> Part {
        while let Some((axis, end)) = self.monotone(&part) {
            self.fix(&mut part, axis, end);
        }
        let sizes: f64 = part.coefficients.iter().map(|c| c.abs()).sum();
        // Sums of so many terms, each a product of two roundings.
        let sums = 2.0 * f64::EPSILON * (part.coefficients.len() + 8) as f64 * sizes;
        let (bound, local) = self.bound(&part);
        part.bound = bound + part.error + sums;
        let value = self.value(&part.coefficients, &local);
        if value > best.attained {
            best.attained = value;
            best.at = part.sides.iter().zip(&local).map(|([middle, half], s)| middle + half * s).collect();
        }
        part
    }

    /// An axis along which the polynomial is proved to rise (1) or to fall (-1), if there is one.
    fn monotone(&self, part: &Part) -> Option<(usize, f64)> {
        // |T_n'| is at most n².
        let mut slopes = vec![0.0; self.parameters];
        let mut others = vec![part.error * (self.degree * self.degree) as f64; self.parameters];
        for (term, &c) in self.terms().zip(&part.coefficients) {
            let total: usize = term.iter().sum();
            for (axis, &n) in term.iter().enumerate().filter(|(_, n)| **n > 0) {
                if total == 1 {
                    slopes[axis] = c;
                } else {
                    others[axis] += c.abs() * (n * n) as f64;
                }
            }
        }
        let certain = 1.0 + 1e-12;
        (0..self.parameters)
            .find(|&axis| part.sides[axis][1] > 0.0 && slopes[axis].abs() >= others[axis] * certain)
            .map(|axis| (axis, if slopes[axis] >= 0.0 { 1.0 } else { -1.0 }))
    }

    /// Fixes an axis at an end: T_n is 1 or, at the lower end of odd n, -1.
    fn fix(&self, part: &mut Part, axis: usize, end: f64) {
        let mut moved = 0.0;
        for (number, term) in self.terms().enumerate() {
            let n = term[axis];
            if n > 0 {
                let c = std::mem::take(&mut part.coefficients[number]);
                part.coefficients[self.lower(axis, number, 0)] += if n % 2 == 1 { end * c } else { c };
                moved += c.abs();
            }
        }
        let sizes: f64 = part.coefficients.iter().map(|c| c.abs()).sum();
        part.error += f64::EPSILON * (self.degree as f64) * (sizes + moved);
        let [middle, half] = part.sides[axis];
        part.sides[axis] = [middle + end * half, 0.0];
    }

    /// An upper bound of the polynomial, but for rounding, and a place where it may be attained.
    fn bound(&self, part: &Part) -> (f64, Vec<f64>) {
        let mut bound = part.coefficients[0];
        let mut alone = vec![[0.0; 2]; self.parameters];
        for (term, &c) in self.terms().zip(&part.coefficients).skip(1) {
            let total: usize = term.iter().sum();
            match term.iter().position(|&n| n == total) {
                Some(axis) if total <= 2 => alone[axis][total - 1] = c,
                _ => bound += c.abs(),
            }
        }
        let mut at = vec![0.0; self.parameters];
        for (place, [linear, square]) in at.iter_mut().zip(alone) {
            // linear s + square (2 s² - 1)
            *place = if linear >= 0.0 { 1.0 } else { -1.0 };
            let mut most = linear.abs() + square;
            if square < 0.0 && linear.abs() < -4.0 * square {
                *place = -linear / (4.0 * square);
                most = -linear * linear / (8.0 * square) - square;
            }
            bound += most;
        }
        (bound, at)
    }

    fn value(&self, coefficients: &[f64], at: &[f64]) -> f64 {
        let powers: Vec<f64> = at.iter().flat_map(|&s| chebyshev(s, self.degree)).collect();
        let term_value = |term: &[usize]| -> f64 {
            term.iter().enumerate().map(|(axis, n)| powers[axis * (self.degree + 1) + n]).product()
        };
        self.terms().zip(coefficients).map(|(term, c)| c * term_value(term)).sum()
    }

    /// The axis whose higher and mixed terms are largest.
    fn worst_axis(&self, part: &Part) -> usize {
        let mut weights = vec![0.0; self.parameters];
        for (term, c) in self.terms().zip(&part.coefficients) {
            let total: usize = term.iter().sum();
            let mixed = term.iter().all(|&n| n < total);
            for (axis, &n) in term.iter().enumerate().filter(|(_, n)| **n > 0) {
                // The parts of one variable are bounded exactly up to the second degree.
                if mixed || total > 2 {
                    weights[axis] += c.abs() * n as f64;
                }
            }
        }
        (0..self.parameters).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0)
    }

    /// The lower or upper half of a part along an axis.
    fn halved(&self, part: &Part, axis: usize, side: usize) -> Part {
        let half = &self.halves[side];
        let mut coefficients = vec![0.0; part.coefficients.len()];
        for (number, (term, &c)) in self.terms().zip(&part.coefficients).enumerate() {
            if c != 0.0 {
                let row = &half[term[axis] * (self.degree + 1)..];
                for (m, factor) in row.iter().enumerate().take(term[axis] + 1) {
                    coefficients[self.lower(axis, number, m)] += factor * c;
                }
            }
        }
        let sizes: f64 = part.coefficients.iter().map(|c| c.abs()).sum();
        let roundings = 2.0 * (self.degree + 4) as f64 * f64::EPSILON;
        // The bound of a part holds in its halves too.
        let error = part.error + self.growth * roundings * sizes;
        let mut sides = part.sides.clone();
        let [middle, length] = sides[axis];
        sides[axis] = [middle + if side == 0 { -0.5 } else { 0.5 } * length, 0.5 * length];
        Part { coefficients, sides, error, bound: f64::INFINITY }
    }
}

/// T_0 to T_degree at a place.
fn chebyshev(s: f64, degree: usize) -> Vec<f64> {
    let mut values = vec![1.0, s];
    for n in 1..degree {
        values.push(2.0 * s * values[n] - values[n - 1]);
    }
    values.truncate(degree + 1);
    values
}

/// T_n(middle + s / 2) as sums of T_m(s), rows n.
fn half(degree: usize, middle: f64) -> Vec<f64> {
    let width = degree + 1;
    let mut rows = vec![0.0; width * width];
    rows[0] = 1.0;
    for n in 1..=degree {
        // T_n = 2 x T_{n-1} - T_{n-2}, but T_1 = x; s T_m is the mean of its neighbors.
        let before = rows[(n - 1) * width..n * width].to_vec();
        let factor = if n == 1 { 1.0 } else { 2.0 };
        for m in 0..width {
            let from_below = if m > 0 { before[m - 1] * if m == 1 { 1.0 } else { 0.5 } } else { 0.0 };
            let from_above = if m + 1 < width { 0.5 * before[m + 1] } else { 0.0 };
            let earlier = if n > 1 { rows[(n - 2) * width + m] } else { 0.0 };
            rows[n * width + m] = factor * (middle * before[m] + 0.5 * (from_below + from_above)) - earlier;
        }
    }
    rows
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}
