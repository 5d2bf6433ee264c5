//! Bounds of a multivariate Chebyshev polynomial over the box [-1, 1]^k.
//!
//! They enclose the *polynomial*. The error of the surrogate, the difference between the response and the
//! polynomial, is not included in any bound here.

use crate::study::chebyshev::{GridError, Polynomials, zeros};

/// Lower and upper bounds by interval arithmetic, Eq. (31) of `[Xiang2020]`: T_i([-1, 1]) = [-1, 1].
///
/// ```text
/// lower = c_0 - Σ |c_i|,    upper = c_0 + Σ |c_i|,    sums over all terms but the constant one
/// ```
///
/// The factors (1/2)^s of the paper are inside the plain coefficients; the two results hold one bound per
/// column, in the unit of the coefficients. Bounds of a column that holds a NaN are NaN.
///
/// The terms are treated as independent, so the bounds are too wide if two terms do not reach their extremes
/// at the same point; for a single term they are exact. Rounding is to nearest: a bound may be too narrow by
/// the rounding error of its sum.
///
/// # Errors
///
/// If the bounds do not fit into the memory.
pub fn interval_bounds(polynomials: &Polynomials) -> Result<(Vec<f64>, Vec<f64>), GridError> {
    let &Polynomials { coefficients, columns, .. } = polynomials;
    let (center, others) = coefficients.split_at(columns);

    let mut radius = zeros(columns)?;
    for row in others.chunks_exact(columns) {
        for (r, c) in radius.iter_mut().zip(row) {
            *r += c.abs();
        }
    }
    let mut lower = zeros(columns)?;
    for ((lower, radius), c) in lower.iter_mut().zip(&mut radius).zip(center) {
        (*lower, *radius) = (c - *radius, c + *radius);
    }
    Ok((lower, radius))
}
