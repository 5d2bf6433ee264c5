//! Polynomials of total degree fitted to scattered points by least squares, and their errors at points they
//! were not fitted to.
//!
//! ```text
//! y(z) ≈ Σ_e c_e T_{e_1}(z_1) ··· T_{e_k}(z_k),    e_1 + ... + e_k <= degree
//! ```
//!
//! The terms are in the order of their degrees. With the basis matrix A = Q R, the first columns of Q then belong to
//! the polynomials of every lower degree, so that one factorization serves all. With the leverage h_i, the squared
//! norm of row i of Q, the error at a point left out is its residual over 1 - h_i (`[Allen1974]`).

use crate::numerics::accuracy::SINGULAR;
use nalgebra::DMatrix;

use crate::study::chebyshev::add_scaled;
use crate::study::sweep::Monitor;

/// Exponents of all terms up to a total degree, row-major terms x parameters, in the order of their degrees.
pub fn exponents(parameters: usize, degree: usize) -> Vec<usize> {
    let mut all = Vec::new();
    let mut term = vec![0; parameters];
    for total in 0..=degree {
        append_terms(&mut all, &mut term, 0, total);
    }
    all
}

fn append_terms(all: &mut Vec<usize>, term: &mut Vec<usize>, axis: usize, left: usize) {
    if axis + 1 == term.len() {
        term[axis] = left;
        all.extend_from_slice(term);
        return;
    }
    for exponent in (0..=left).rev() {
        term[axis] = exponent;
        append_terms(all, term, axis + 1, left - exponent);
    }
}

/// Number of terms up to a total degree, C(parameters + degree, degree), at most `usize::MAX`.
pub fn term_count(parameters: usize, degree: usize) -> usize {
    (1..=degree).fold(1usize, |count, d| count.saturating_mul(parameters + d) / d)
}

/// Values of all terms at points of [-1, 1]^k, row-major points x terms.
pub fn basis(points: &[f64], parameters: usize, degree: usize) -> Vec<f64> {
    let exponents = exponents(parameters, degree);
    let mut values = Vec::with_capacity(points.len() / parameters * exponents.len() / parameters);
    let mut powers = vec![0.0; parameters * (degree + 1)];
    for point in points.chunks_exact(parameters) {
        for (&z, row) in point.iter().zip(powers.chunks_exact_mut(degree + 1)) {
            let (mut previous, mut current) = (z, 1.0);
            for power in row {
                *power = current;
                (previous, current) = (current, 2.0 * z * current - previous);
            }
        }
        for term in exponents.chunks_exact(parameters) {
            values.push(term.iter().enumerate().map(|(axis, e)| powers[axis * (degree + 1) + e]).product());
        }
    }
    values
}

/// The factors Q, with orthonormal columns, and R of a matrix; None if the monitor said no.
///
/// By the method of Gram and Schmidt, twice for every column: Q is then orthogonal to rounding while the columns are
/// independent (`[GiraudLangouRozloznik2005]`). The work is that of Householder's method with Q formed, but the monitor
/// is asked at every column: 500 columns of 20 000 points take some 10 s.
fn orthonormalized(mut matrix: DMatrix<f64>, monitor: Monitor) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let count = matrix.ncols();
    let mut triangle = DMatrix::zeros(count, count);
    for column in 0..count {
        if !monitor() {
            return None;
        }
        let (known, mut rest) = matrix.columns_range_pair_mut(..column, column..);
        let mut vector = rest.column_mut(0);
        for _ in 0..2 {
            let along = known.tr_mul(&vector);
            vector.gemv(-1.0, &known, &along, 1.0);
            triangle.column_mut(column).rows_mut(0, column).axpy(1.0, &along, 1.0);
        }
        let length = vector.norm();
        triangle[(column, column)] = length;
        if length > 0.0 {
            vector /= length;
        }
    }
    Some((matrix, triangle))
}

/// The least-squares problem of a set of points, for all total degrees up to a largest one.
#[derive(Clone, Debug)]
pub struct Regression {
    /// Number of parameters.
    pub parameters: usize,
    /// Number of terms of every degree, from 0; the last one is that of the largest degree.
    pub terms: Vec<usize>,
    /// Orthonormal basis at the points, runs x terms.
    orthonormal: Vec<f64>,
    /// The upper triangle R: coefficients of the terms times R are those in the orthonormal basis.
    triangle: DMatrix<f64>,
    /// Squared norms of the rows of the orthonormal basis, one list for every degree.
    leverages: Vec<Vec<f64>>,
}

impl Regression {
    /// Prepares the fits to points of [-1, 1]^k, row-major runs x parameters: of every total degree up to
    /// `largest_degree` with at most `largest_term_count` terms that are linearly
    /// independent at the points. None if the monitor said no.
    pub fn new(
        points: &[f64],
        parameters: usize,
        largest_degree: usize,
        largest_term_count: usize,
        monitor: Monitor,
    ) -> Option<Self> {
        let runs = points.len() / parameters;
        let mut degree = 0;
        while degree < largest_degree && term_count(parameters, degree + 1) <= largest_term_count.min(runs) {
            degree += 1;
        }
        let terms: Vec<usize> = (0..=degree).map(|degree| term_count(parameters, degree)).collect();
        let columns = terms[degree];
        let matrix = DMatrix::from_row_slice(runs, columns, &basis(points, parameters, degree));
        let norms: Vec<f64> = (0..columns).map(|column| matrix.column(column).norm()).collect();
        let (orthonormal, triangle) = orthonormalized(matrix, monitor)?;
        let orthonormal: Vec<f64> = orthonormal.transpose().iter().copied().collect();
        let mut regression =
            Self { parameters, terms: Vec::new(), orthonormal, triangle, leverages: Vec::new() };
        for count in terms {
            let independent = (0..count).all(|c| regression.triangle[(c, c)].abs() > SINGULAR * norms[c]);
            let leverages: Vec<f64> = (0..runs)
                .map(|run| regression.orthonormal[run * columns..][..count].iter().map(|q| q * q).sum())
                .collect();
            if !independent || leverages.iter().any(|&leverage| 1.0 - leverage < SINGULAR) {
                break;
            }
            regression.terms.push(count);
            regression.leverages.push(leverages);
        }
        Some(regression)
    }

    /// Largest degree whose errors at points left out are defined; None where there is only one run.
    pub fn largest_degree(&self) -> Option<usize> {
        self.terms.len().checked_sub(1)
    }

    /// Row of the orthonormal basis of a degree at a point.
    pub fn row(&self, run: usize, degree: usize) -> &[f64] {
        &self.orthonormal[run * self.triangle.ncols()..][..self.terms[degree]]
    }

    /// Coefficients in the orthonormal basis of a degree, terms x `columns`, of values runs x `columns`.
    pub fn project(&self, values: &[f64], columns: usize, degree: usize) -> Vec<f64> {
        let mut result = vec![0.0; self.terms[degree] * columns];
        for (run, row) in values.chunks_exact(columns).enumerate() {
            for (&factor, target) in self.row(run, degree).iter().zip(result.chunks_exact_mut(columns)) {
                add_scaled(target, factor, row);
            }
        }
        result
    }

    /// Subtracts the terms of a degree that are not of the degree below from residuals, runs x `columns`.
    pub fn reduce(&self, residuals: &mut [f64], projected: &[f64], columns: usize, degree: usize) {
        let first = if degree == 0 { 0 } else { self.terms[degree - 1] };
        for (run, row) in residuals.chunks_exact_mut(columns).enumerate() {
            for term in first..self.terms[degree] {
                add_scaled(row, -self.row(run, degree)[term], &projected[term * columns..][..columns]);
            }
        }
    }

    /// Errors at points left out, runs x `columns`: every residual over one minus its leverage.
    pub fn leave_one_out(&self, residuals: &[f64], columns: usize, degree: usize) -> Vec<f64> {
        let mut errors = residuals.to_vec();
        for (row, leverage) in errors.chunks_exact_mut(columns).zip(&self.leverages[degree]) {
            row.iter_mut().for_each(|error| *error /= 1.0 - leverage);
        }
        errors
    }

    /// Coefficients of the terms of a degree from those in its orthonormal basis, both terms x `columns`.
    pub fn coefficients(&self, projected: &[f64], columns: usize, degree: usize) -> Vec<f64> {
        let mut result = projected[..self.terms[degree] * columns].to_vec();
        for term in (0..self.terms[degree]).rev() {
            let (before, from) = result.split_at_mut(term * columns);
            let row = &mut from[..columns];
            let pivot = self.triangle[(term, term)];
            row.iter_mut().for_each(|value| *value /= pivot);
            for (earlier, target) in before.chunks_exact_mut(columns).enumerate() {
                add_scaled(target, -self.triangle[(earlier, term)], row);
            }
        }
        result
    }
}
