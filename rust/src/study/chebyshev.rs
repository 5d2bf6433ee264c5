//! Tensor grids of Chebyshev polynomials, section 4 of `[Xiang2020]`: values at the root nodes to
//! coefficients, evaluation, derivative.
//!
//! ```text
//! y(x) ≈ Σ_i c_i T_{i_1}(x_1) ··· T_{i_k}(x_k),    x in [-1, 1]^k,    0 <= i_q <= degree_q
//! ```
//!
//! The coefficients c are *plain*: they include the factors (2/m)^k and (1/2)^s of Eq. (24) to (28).
//! All variables x here are normalized; the physical parameter of Eq. (26) is
//!
//! ```text
//! ξ_q = (b_q + a_q)/2 + x_q (b_q - a_q)/2
//! ```
//!
//! *Erratum.* Eq. (28) as printed evaluates the response at x = cos θ; the runs must be made at ξ.
//!
//! Arrays are flat and row-major: the rows are the runs of a grid or the terms of a polynomial in C order
//! (first parameter slowest), the columns are independent responses, such as time samples of several outputs.
//! A column that contains a NaN (a failed run) is NaN in every result; other columns are unaffected.

use std::f64::consts::PI;
use std::fmt;

use crate::numerics::memory::filled;
use crate::study::BLOCK;

/// Most nodes per parameter; more would only exhaust the memory.
pub const MOST_NODES: usize = 10_000;

/// A grid, polynomial or point that does not fit the other arguments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GridError {
    /// The problem, the value found and what would be accepted.
    pub message: String,
    /// Whether the only problem is too little memory, for the result or for threads.
    pub out_of_memory: bool,
}

impl GridError {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), out_of_memory: false }
    }
}

impl From<rayon::ThreadPoolBuildError> for GridError {
    fn from(error: rayon::ThreadPoolBuildError) -> Self {
        // Their number is bounded, so what lacks is memory for their stacks.
        Self { message: format!("threads cannot be started: {error}"), out_of_memory: true }
    }
}

/// Tensor polynomials of the same degrees, one for every column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomials<'a> {
    /// Plain coefficients, terms x columns, as [`fit`] returns them.
    pub(crate) coefficients: &'a [f64],
    pub(crate) columns: usize,
    /// Degree in every parameter.
    pub(crate) degrees: &'a [usize],
    /// ∏ (degree + 1).
    pub(crate) terms: usize,
}

impl<'a> Polynomials<'a> {
    /// Polynomials of plain coefficients, terms x `columns` with ∏ (`degrees[q]` + 1) terms, as [`fit`]
    /// returns them.
    ///
    /// # Errors
    ///
    /// No parameter, no column, or a number of coefficients other than terms x columns.
    pub fn new(coefficients: &'a [f64], columns: usize, degrees: &'a [usize]) -> Result<Self, GridError> {
        let sizes: Vec<usize> = degrees.iter().map(|degree| degree.saturating_add(1)).collect();
        let terms = check_rows(coefficients.len(), columns, &sizes, "coefficients")?;
        Ok(Self { coefficients, columns, degrees, terms })
    }
}

/// Zeros for a result.
pub(crate) fn zeros(count: usize) -> Result<Vec<f64>, GridError> {
    filled(count, 0.0).map_err(|_| GridError {
        message: format!("{count} numbers do not fit into the memory"),
        out_of_memory: true,
    })
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for GridError {}

/// The roots of the Chebyshev polynomial of degree `count`, from nearly +1 down to nearly -1 [-].
///
/// ```text
/// x_j = cos θ_j,    θ_j = (2j - 1) π / (2 count),    j = 1, ..., count            Eq. (26)
/// ```
///
/// Exactly antisymmetric, x_j = -x_{count+1-j}; the middle one of an odd count is exactly 0.
pub fn root_nodes(count: usize) -> Vec<f64> {
    (0..count).map(|j| cosine(2 * j + 1, count)).collect()
}

/// Coefficients of the polynomial through, or nearest to, the values of a tensor grid of root nodes.
///
/// ```text
/// c_i = (2/m_1) ··· (2/m_k) (1/2)^s Σ_j y(x_j) cos(i_1 θ_{j_1}) ··· cos(i_k θ_{j_k})    Eq. (28)
/// ```
///
/// with m_q = `nodes[q]` and s the number of zeros among i_1, ..., i_k. With m_q = degree_q + 1 the
/// polynomial interpolates; with more nodes it is the discrete least-squares approximation
/// (`[MasonHandscomb2003]`). With fewer, the highest coefficient would vanish whatever the response.
///
/// `values` is runs x `columns`, with one run for each of the ∏ `nodes[q]` grid points; the result is
/// terms x `columns`, with ∏ (`degrees[q]` + 1) terms, in the unit of the values. A response that is
/// even (odd) in a variable to the last bit has odd (even) coefficients of exactly zero.
///
/// ```
/// use chebclear::study::chebyshev::{fit, root_nodes};
///
/// // 2 x² + x = T_0 + T_1 + T_2, from three nodes
/// let values: Vec<f64> = root_nodes(3).iter().map(|x| 2.0 * x * x + x).collect();
/// let coefficients = fit(&values, 1, &[3], &[2])?;
/// assert!(coefficients.iter().all(|c| (c - 1.0).abs() < 1e-15));
/// # Ok::<(), chebclear::study::chebyshev::GridError>(())
/// ```
///
/// # Errors
///
/// No parameter, no column, fewer than degree + 1 nodes on an axis, or a number of values other than
/// runs x columns.
pub fn fit(
    values: &[f64],
    columns: usize,
    nodes: &[usize],
    degrees: &[usize],
) -> Result<Vec<f64>, GridError> {
    if nodes.len() != degrees.len() {
        return Err(GridError::new(format!(
            "{} numbers of nodes for {} degrees: one of each per parameter is needed",
            nodes.len(),
            degrees.len()
        )));
    }
    for (axis, (&count, &degree)) in nodes.iter().zip(degrees).enumerate() {
        if count > MOST_NODES {
            return Err(GridError::new(format!("axis {axis} has {count} nodes, more than {MOST_NODES}")));
        }
        if count <= degree {
            return Err(GridError::new(format!(
                "axis {axis} has {count} nodes: degree {degree} needs at least degree + 1"
            )));
        }
    }
    check_rows(values.len(), columns, nodes, "values")?;

    // Axis by axis: the axes before `axis` already hold terms, those after it still hold nodes.
    let mut array = vec![];
    for axis in 0..degrees.len() {
        let inner = nodes[axis + 1..].iter().product::<usize>() * columns;
        let source = if axis == 0 { values } else { &array };
        array = fit_axis(source, nodes[axis], degrees[axis], inner)?;
    }
    Ok(array)
}

/// Values of polynomials at points of [-1, 1]^k.
///
/// `points` is points x k [-]; the result is points x columns, in the unit of the coefficients. At the
/// midpoint of the box, the point 0, every polynomial T_i is exactly 0, 1 or -1.
///
/// # Errors
///
/// A number of coordinates that k does not divide, a coordinate that is not finite or outside [-1, 1]. There
/// is no allowance for rounding: a caller who maps physical parameters clamps the ends.
pub fn evaluate(polynomials: &Polynomials, points: &[f64]) -> Result<Vec<f64>, GridError> {
    let &Polynomials { coefficients, columns, degrees, terms } = polynomials;
    let parameters = degrees.len();
    if !points.len().is_multiple_of(parameters) {
        return Err(GridError::new(format!(
            "{} coordinates do not make points of {parameters} parameters",
            points.len()
        )));
    }
    if let Some(at) = points.iter().position(|x| !(-1.0..=1.0).contains(x)) {
        let (point, axis) = (at / parameters, at % parameters);
        return Err(GridError::new(format!(
            "point {point} has coordinate {} on axis {axis}: it must be in [-1, 1]",
            points[at]
        )));
    }

    let mut values = zeros(points.len() / parameters * columns)?;
    let mut products = Vec::with_capacity(BLOCK * terms);
    for (batch, targets) in points.chunks(BLOCK * parameters).zip(values.chunks_mut(BLOCK * columns)) {
        products.clear();
        for point in batch.chunks_exact(parameters) {
            append_products(&mut products, point, degrees);
        }
        for start in (0..columns).step_by(BLOCK) {
            let end = columns.min(start + BLOCK);
            for (factors, target) in products.chunks_exact(terms).zip(targets.chunks_exact_mut(columns)) {
                // Highest terms first: small numbers are added before the large ones. Measured on
                // two smooth functions with 13³ terms: a quarter to a sixth of the rounding error.
                for (&factor, row) in factors.iter().zip(coefficients.chunks_exact(columns)).rev() {
                    add_scaled(&mut target[start..end], factor, &row[start..end]);
                }
            }
        }
    }
    Ok(values)
}

/// Coefficients of the derivative with respect to the normalized variable of `axis`.
///
/// ```text
/// d_n = 0,    d_{i-1} = d_{i+1} + 2 i c_i  for i = n, ..., 2,    d_0 = d_2 / 2 + c_1
/// ```
///
/// (`[MasonHandscomb2003]`), where n is the degree on that axis. The result has the shape of
/// the coefficients, terms x columns; its highest term is zero. The sensitivity of Eq. (32), at the
/// midpoint of the box, is its value at the point 0, times 2/(b - a).
///
/// *Erratum.* Eq. (33) is the derivative with respect to the normalized variable, so Eq. (32) needs
/// that factor; its sign is plus; and it holds at the midpoint only, because elsewhere the factor
/// 1/sin θ is missing. The recurrence has no such factor and no 0/0 at the ends.
///
/// # Errors
///
/// No such axis.
pub fn derivative(polynomials: &Polynomials, axis: usize) -> Result<Vec<f64>, GridError> {
    let &Polynomials { coefficients, columns, degrees, .. } = polynomials;
    if axis >= degrees.len() {
        return Err(GridError::new(format!("axis {axis} of a polynomial in {} parameters", degrees.len())));
    }
    let degree = degrees[axis];
    let inner = degrees[axis + 1..].iter().map(|n| n + 1).product::<usize>() * columns;
    let row = |i: usize| i * inner..(i + 1) * inner;

    let mut result = zeros(coefficients.len())?;
    let blocks = coefficients.chunks_exact((degree + 1) * inner);
    for (source, target) in blocks.zip(result.chunks_exact_mut((degree + 1) * inner)) {
        // Zero times the source rather than zero: at degree 0 the NaN of a failed run must remain.
        add_scaled(&mut target[row(degree)], 0.0, &source[row(degree)]);
        for i in (1..=degree).rev() {
            if i < degree {
                target.copy_within(row(i + 1), (i - 1) * inner);
            }
            add_scaled(&mut target[row(i - 1)], 2.0 * i as f64, &source[row(i)]);
        }
        if degree > 0 {
            target[row(0)].iter_mut().for_each(|d| *d *= 0.5);
        }
    }
    Ok(result)
}

/// Checks that an array has ∏ `sizes` rows of `columns`; returns the number of rows.
fn check_rows(length: usize, columns: usize, sizes: &[usize], what: &str) -> Result<usize, GridError> {
    if sizes.is_empty() {
        return Err(GridError::new("no parameter: at least one is needed"));
    }
    if columns == 0 {
        return Err(GridError::new("no column: at least one is needed"));
    }
    let rows = sizes.iter().try_fold(1, |rows: usize, &size| rows.checked_mul(size));
    match rows {
        Some(rows) if rows.checked_mul(columns) == Some(length) => Ok(rows),
        _ => {
            let product = sizes.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ");
            Err(GridError::new(format!("{length} {what}: {product} rows of {columns} columns are needed")))
        }
    }
}

/// Fits along one axis: an array outer x `nodes` x `inner` becomes outer x (`degree` + 1) x `inner`.
///
/// Sums and differences over the node pairs x and -x are formed first, because cos(i θ) is even in x for even
/// i and odd for odd i. That halves the work and keeps exact symmetries of the response exact.
fn fit_axis(values: &[f64], nodes: usize, degree: usize, inner: usize) -> Result<Vec<f64>, GridError> {
    let terms = degree + 1;
    let pairs = nodes.div_ceil(2);
    let weights = pair_weights(nodes, degree);
    let outer = values.len() / (nodes * inner);

    let mut coefficients = zeros(outer * terms * inner)?;
    let mut sums = vec![0.0; pairs * BLOCK];
    let mut differences = vec![0.0; pairs * BLOCK];
    for o in 0..outer {
        for start in (0..inner).step_by(BLOCK) {
            let width = BLOCK.min(inner - start);
            for j in 0..pairs {
                let first = &values[(o * nodes + j) * inner + start..][..width];
                let last = &values[(o * nodes + nodes - 1 - j) * inner + start..][..width];
                let sum = &mut sums[j * BLOCK..][..width];
                let difference = &mut differences[j * BLOCK..][..width];
                for column in 0..width {
                    sum[column] = first[column] + last[column];
                    difference[column] = first[column] - last[column];
                }
            }
            for i in 0..terms {
                let folded = if i % 2 == 0 { &sums } else { &differences };
                let target = &mut coefficients[(o * terms + i) * inner + start..][..width];
                for j in 0..pairs {
                    add_scaled(target, weights[i * pairs + j], &folded[j * BLOCK..][..width]);
                }
            }
        }
    }
    Ok(coefficients)
}

/// Weights of the node pairs in the coefficients, terms x pairs: (2/m) cos(i θ_j), halved for i = 0,
/// and halved for the middle node, which is its own partner.
fn pair_weights(nodes: usize, degree: usize) -> Vec<f64> {
    let pairs = nodes.div_ceil(2);
    let mut weights = Vec::with_capacity((degree + 1) * pairs);
    for i in 0..=degree {
        for j in 0..pairs {
            let halvings = usize::from(i == 0) + usize::from(2 * j + 1 == nodes);
            let scale = [2.0, 1.0, 0.5][halvings] / nodes as f64;
            weights.push(scale * cosine(i * (2 * j + 1), nodes));
        }
    }
    weights
}

/// cos(multiple π / (2 count)), reduced in integers to the first octant: exactly 0, 1 and -1 where it
/// should be, exactly symmetric, and accurate next to its zeros.
fn cosine(multiple: usize, count: usize) -> f64 {
    let turn = multiple % (4 * count);
    let half_turn = turn.min(4 * count - turn);
    let (sign, quarter_turn) =
        if half_turn > count { (-1.0, 2 * count - half_turn) } else { (1.0, half_turn) };
    let angle = |steps: usize| steps as f64 * PI / (2 * count) as f64;
    if quarter_turn == count {
        0.0
    } else if 2 * quarter_turn > count {
        sign * angle(count - quarter_turn).sin()
    } else {
        sign * angle(quarter_turn).cos()
    }
}

/// Appends T_{i_1}(x_1) ··· T_{i_k}(x_k) for all terms in C order.
fn append_products(products: &mut Vec<f64>, point: &[f64], degrees: &[usize]) {
    let start = products.len();
    products.push(1.0);
    for (&x, &degree) in point.iter().zip(degrees) {
        let leading = products.split_off(start);
        for product in leading {
            let (mut previous, mut current) = (x, 1.0);
            for _ in 0..=degree {
                products.push(product * current);
                (previous, current) = (current, 2.0 * x * current - previous);
            }
        }
    }
}

pub(super) fn add_scaled(target: &mut [f64], factor: f64, source: &[f64]) {
    for (t, s) in target.iter_mut().zip(source) {
        *t += factor * s;
    }
}
