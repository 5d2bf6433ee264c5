//! The range of multivariate Chebyshev polynomials over the box [-1, 1]^k, certified.
//!
//! Blocks of columns are transformed to the Bernstein basis together. Most columns of a smooth response are
//! monotone in every variable there: two corners are their extremes. The others are searched one by one.
//!
//! Source: `[Garloff1986]`. Rounding errors are bounded by the standard model of floating-point arithmetic,
//! with a margin of a factor of two.

use crate::study::BLOCK;
use crate::study::bernstein::{Axis, LANES, Lanes, MOST_DEGREE};
use crate::study::branch_and_bound::{End, Polynomial, Search};
use crate::study::chebyshev::{GridError, Polynomials};
use crate::study::pool::in_parallel;
use crate::study::sweep::Monitor;

/// Largest coefficient; with larger ones the sums of the transformation could overflow.
const LARGEST: f64 = 1e280;

/// Bound of the error by underflow in a transformed coefficient, with a wide margin.
/// Half and twice change none of 150 ranges.
const UNDERFLOW: f64 = 1e-290;

/// Ranges of polynomials over the box, one for every column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ranges {
    /// Certified lower bounds of the polynomial, rounding errors included.
    pub lower: Vec<f64>,
    /// Certified upper bounds.
    pub upper: Vec<f64>,
    /// Smallest values found, which the polynomial attains to rounding.
    pub attained_lower: Vec<f64>,
    /// Largest values found.
    pub attained_upper: Vec<f64>,
    /// Points of the smallest values, columns x k, in [-1, 1].
    pub lowest_at: Vec<f64>,
    /// Points of the largest values, columns x k, in [-1, 1].
    pub highest_at: Vec<f64>,
    /// Boxes processed beyond the first of each column: a measure of the work.
    pub boxes: usize,
}

/// The range of every polynomial over [-1, 1]^k.
///
/// The bounds hold for the polynomial, not for the response it was fitted to. They exceed values that the
/// polynomial attains by at most 1e-6 of the range, apart from rounding and from polynomials that need too
/// much work, and are wider than those of Eq. (31) by rounding at most.
///
/// The columns are processed on `threads` threads of a private pool (default: one for every processor); the
/// results do not depend on the number.
///
/// ```
/// use chebclear::study::chebyshev::Polynomials;
/// use chebclear::study::range::polynomial_ranges;
///
/// // 2 T_1 - T_2 = 1 + 2 x - 2 x²: from -3 at the lower end to 3/2 at x = 1/2
/// let ranges = polynomial_ranges(&Polynomials::new(&[0.0, 2.0, -1.0], 1, &[2])?, None)?;
/// assert_eq!(ranges.lowest_at, [-1.0]);
/// assert!((ranges.lower[0] + 3.0).abs() < 1e-14 && (ranges.upper[0] - 1.5).abs() < 1e-5);
/// # Ok::<(), chebclear::study::chebyshev::GridError>(())
/// ```
///
/// # Errors
///
/// A degree above 30, a coefficient that is not finite or beyond 1e280, threads that cannot be started.
pub fn polynomial_ranges(polynomials: &Polynomials, threads: Option<usize>) -> Result<Ranges, GridError> {
    Ok(watched_ranges(polynomials, threads, &|| true)?.unwrap_or_default())
}

/// As [`polynomial_ranges`], but `None` if the monitor, which is called between blocks of columns, cancels.
///
/// # Errors
///
/// As [`polynomial_ranges`].
pub fn watched_ranges(
    polynomials: &Polynomials,
    threads: Option<usize>,
    monitor: Monitor,
) -> Result<Option<Ranges>, GridError> {
    let &Polynomials { coefficients, columns, degrees, .. } = polynomials;
    if let Some(axis) = degrees.iter().position(|&degree| degree > MOST_DEGREE) {
        return Err(GridError::new(format!(
            "axis {axis} has degree {}: a certified range is found up to degree {MOST_DEGREE}",
            degrees[axis]
        )));
    }
    if let Some(at) = coefficients.iter().position(|c| !c.is_finite() || c.abs() > LARGEST) {
        return Err(GridError::new(format!(
            "column {} has a coefficient {}: all must be finite and at most {LARGEST:e} in size",
            at % columns,
            coefficients[at]
        )));
    }

    let form = Form::new(degrees);
    let task = |index: usize| {
        let (start, end) = (index * BLOCK, columns.min((index + 1) * BLOCK));
        let mut ranges = Ranges::default();
        let mut workspace = Workspace::default();
        for first in (start..end).step_by(LANES) {
            if !monitor() {
                return None;
            }
            let used = LANES.min(end - first);
            workspace.gather(coefficients, columns, first, used);
            workspace.append_ranges(&form, used, &mut ranges);
        }
        ranges.boxes = workspace.search.boxes;
        Some(ranges)
    };
    let blocks = in_parallel(columns.div_ceil(BLOCK), threads, task)?;
    Ok(blocks.map(|blocks| {
        let mut all = Ranges::default();
        blocks.into_iter().for_each(|block| all.append(block));
        all
    }))
}

impl Ranges {
    fn append(&mut self, other: Self) {
        self.lower.extend(other.lower);
        self.upper.extend(other.upper);
        self.attained_lower.extend(other.attained_lower);
        self.attained_upper.extend(other.attained_upper);
        self.lowest_at.extend(other.lowest_at);
        self.highest_at.extend(other.highest_at);
        self.boxes += other.boxes;
    }

    /// Appends the range of one more column; values found are moved inside the bounds.
    pub(in crate::study) fn push(
        &mut self,
        [lower, upper]: [f64; 2],
        [lowest, highest]: [f64; 2],
        [lowest_at, highest_at]: [&[f64]; 2],
    ) {
        self.lower.push(lower);
        self.upper.push(upper);
        self.attained_lower.push(lowest.max(lower));
        self.attained_upper.push(highest.min(upper));
        self.lowest_at.extend(lowest_at);
        self.highest_at.extend(highest_at);
    }
}

/// Data that all columns share.
struct Form {
    degrees: Vec<usize>,
    axes: Vec<Axis>,
    /// Number of coefficients per step along each axis.
    strides: Vec<usize>,
    /// Indices of the corners of the box along the axes of a degree above 0; bit q of the number of a corner is set at
    /// the upper end of the q-th of these.
    corners: Vec<usize>,
    /// Largest absolute Bernstein coefficient of each term.
    weights: Vec<f64>,
    /// Error of a transformed coefficient, relative to Σ |coefficient| x weight.
    transform_error: f64,
    /// Error that a split adds, relative to the same.
    split_error: f64,
}

impl Form {
    fn new(degrees: &[usize]) -> Self {
        let axes: Vec<Axis> = degrees.iter().map(|&degree| Axis::new(degree)).collect();
        let mut weights = vec![1.0];
        for axis in &axes {
            weights = weights.iter().flat_map(|w| axis.largest.iter().map(move |l| w * l)).collect();
        }
        let mut strides = vec![1; degrees.len()];
        for axis in (1..degrees.len()).rev() {
            strides[axis - 1] = strides[axis] * (degrees[axis] + 1);
        }
        let mut corners = vec![0];
        for (degree, stride) in degrees.iter().zip(&strides).filter(|&(&degree, _)| degree > 0) {
            corners.extend_from_within(..);
            let lower = corners.len() / 2;
            corners[lower..].iter_mut().for_each(|corner| *corner += degree * stride);
        }
        // On an axis of degree n a coefficient is a sum of n + 1 products of factors with two roundings, and
        // of the two parts of a pair: less than n + 6 roundings of half an epsilon, counted as whole ones. A
        // split averages n times, with two roundings each.
        let roundings: usize = degrees.iter().map(|n| n + 6).sum();
        let averages = degrees.iter().max().copied().unwrap_or(0);
        Self {
            degrees: degrees.to_vec(),
            axes,
            strides,
            corners,
            weights,
            transform_error: roundings as f64 * f64::EPSILON,
            split_error: 2.0 * averages as f64 * f64::EPSILON,
        }
    }

    /// The lowest and the highest corner of a polynomial.
    fn extreme_corners(&self, block: &[Lanes], lane: usize, lowest: &mut End, highest: &mut End) {
        let (mut low, mut high) = ((f64::INFINITY, 0), (f64::NEG_INFINITY, 0));
        for (corner, offset) in self.corners.iter().enumerate() {
            let value = block[*offset][lane];
            low = if value < low.0 { (value, corner) } else { low };
            high = if value > high.0 { (value, corner) } else { high };
        }
        for (end, (value, corner)) in [(lowest, low), (highest, high)] {
            end.attained = value;
            end.at.clear();
            let mut sides = (0..).map(|bit| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 });
            let side = |&degree: &usize| if degree == 0 { None } else { sides.next() };
            end.at.extend(self.degrees.iter().map(side).map(|side| side.unwrap_or(0.0)));
        }
    }
}

/// Memory of one task, kept from block to block of columns.
#[derive(Default)]
struct Workspace {
    /// Coefficients, and room for their transformation.
    block: Vec<Lanes>,
    spare: Vec<Lanes>,
    /// Smallest and largest difference of neighbors along each axis.
    differences: Vec<[Lanes; 2]>,
    slopes: Vec<f64>,
    lowest: End,
    highest: End,
    search: Search,
}

impl Workspace {
    /// Takes up to [`LANES`] columns; the lanes beyond hold zeros.
    fn gather(&mut self, coefficients: &[f64], columns: usize, first: usize, used: usize) {
        self.block.clear();
        self.block.extend(coefficients.chunks_exact(columns).map(|row| {
            let mut lanes = [0.0; LANES];
            lanes[..used].copy_from_slice(&row[first..first + used]);
            lanes
        }));
    }

    /// Appends the ranges of the columns taken.
    fn append_ranges(&mut self, form: &Form, used: usize, ranges: &mut Ranges) {
        let Self { block, spare, differences, slopes, lowest, highest, search } = self;
        let sums = Sums::of(block, &form.weights);
        spare.resize(block.len(), [0.0; LANES]);
        for (axis, &stride) in form.axes.iter().zip(&form.strides) {
            axis.transform(block, spare, stride);
            std::mem::swap(block, spare);
        }
        differences.clear();
        differences
            .extend(form.degrees.iter().zip(&form.strides).map(|(&n, &inner)| extremes(block, n, inner)));

        for lane in 0..used {
            let (least, most) = sums.outward(lane);
            let error = form.transform_error * sums.weighted[lane] + UNDERFLOW;
            form.extreme_corners(block, lane, lowest, highest);
            slopes.clear();
            slopes.extend(differences.iter().map(|[smallest, largest]| {
                let falls = if largest[lane] <= 0.0 { -1.0 } else { 0.0 };
                if smallest[lane] >= 0.0 { 1.0 } else { falls }
            }));
            let (lower, upper) = if slopes.iter().all(|&slope| slope != 0.0) {
                (lowest.attained - error, highest.attained + error)
            } else {
                let mut polynomial = Polynomial {
                    degrees: &form.degrees,
                    strides: &form.strides,
                    values: block,
                    lane,
                    sign: 1.0,
                    slopes,
                    error,
                    split_error: form.split_error * sums.weighted[lane],
                    bound: most,
                };
                let opposite = lowest.attained;
                let top = search.climb(&polynomial, highest, opposite);
                (polynomial.sign, polynomial.bound) = (-1.0, -least);
                lowest.attained = -opposite;
                let bottom = search.climb(&polynomial, lowest, -highest.attained);
                lowest.attained = -lowest.attained;
                (-bottom, top)
            };
            ranges.push(
                [lower.max(least), upper.min(most)],
                [lowest.attained, highest.attained],
                [&lowest.at, &highest.at],
            );
        }
    }
}

/// Sums over the coefficients of every column.
struct Sums {
    center: Lanes,
    /// Σ |c| over all terms but the constant one.
    radius: Lanes,
    /// Bound of the rounding error of the radius.
    lost: Lanes,
    /// Σ |c| x weight over all terms.
    weighted: Lanes,
}

impl Sums {
    fn of(block: &[Lanes], weights: &[f64]) -> Self {
        let center = block[0];
        let (mut radius, mut lost, mut weighted) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            weighted[lane] = weights[0] * center[lane].abs();
        }
        for (row, weight) in block.iter().zip(weights).skip(1) {
            for lane in 0..LANES {
                let added = row[lane].abs();
                weighted[lane] += weight * added;
                // The exact error of a sum, [Knuth1998].
                let sum = radius[lane] + added;
                let back = sum - radius[lane];
                lost[lane] += ((radius[lane] - (sum - back)) + (added - back)).abs();
                radius[lane] = sum;
            }
        }
        Self { center, radius, lost, weighted }
    }

    /// The bounds of Eq. (31), rounded outward; exact if no operation was rounded.
    fn outward(&self, lane: usize) -> (f64, f64) {
        let (center, sum, lost) = (self.center[lane], self.radius[lane], self.lost[lane]);
        // The sum of the errors is itself rounded, by far less than half of it.
        let radius = if lost > 0.0 { (sum + 2.0 * lost).next_up() } else { sum };
        let (lower, upper) = (center - radius, center + radius);
        let exact = |sum: f64, added: f64| sum - center == added && sum - added == center;
        (
            if exact(lower, -radius) { lower } else { lower.next_down() },
            if exact(upper, radius) { upper } else { upper.next_up() },
        )
    }
}

/// The smallest and largest difference of neighbors along an axis.
fn extremes(block: &[Lanes], degree: usize, inner: usize) -> [Lanes; 2] {
    let (mut smallest, mut largest) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    for part in block.chunks_exact((degree + 1) * inner) {
        for (before, after) in part.iter().zip(&part[inner..]) {
            for lane in 0..LANES {
                let difference = after[lane] - before[lane];
                smallest[lane] = if difference < smallest[lane] { difference } else { smallest[lane] };
                largest[lane] = if difference > largest[lane] { difference } else { largest[lane] };
            }
        }
    }
    [smallest, largest]
}
