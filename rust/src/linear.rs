//! Small dense linear algebra in place: the step loop may not allocate.

/// Factors a symmetric positive definite row-major `n` x `n` matrix as L Lᵀ, in its lower
/// triangle. Returns false where a pivot is not positive (or not a number).
pub fn cholesky_factor(matrix: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        for i in j..n {
            let mut sum = matrix[i * n + j];
            for k in 0..j {
                sum -= matrix[i * n + k] * matrix[j * n + k];
            }
            if i == j {
                if !(sum > 0.0 && sum.is_finite()) {
                    return false;
                }
                matrix[i * n + i] = sum.sqrt();
            } else {
                matrix[i * n + j] = sum / matrix[j * n + j];
            }
        }
    }
    true
}

/// Solves L Lᵀ x = b in place, with the factor of [`cholesky_factor`].
pub fn cholesky_solve(factor: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= factor[i * n + k] * b[k];
        }
        b[i] = sum / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= factor[k * n + i] * b[k];
        }
        b[i] = sum / factor[i * n + i];
    }
}

/// Factors a row-major `n` x `n` matrix with partial pivoting; the diagonal of U is stored
/// inverted. Returns false where the matrix is singular or not finite.
pub fn lu_factor(matrix: &mut [f64], n: usize, pivots: &mut [usize]) -> bool {
    for column in 0..n {
        let mut pivot = column;
        for row in column + 1..n {
            if matrix[row * n + column].abs() > matrix[pivot * n + column].abs() {
                pivot = row;
            }
        }
        pivots[column] = pivot;
        if pivot != column {
            for k in 0..n {
                matrix.swap(column * n + k, pivot * n + k);
            }
        }
        let inverse = 1.0 / matrix[column * n + column];
        if !inverse.is_finite() {
            return false;
        }
        matrix[column * n + column] = inverse;
        for row in column + 1..n {
            let factor = matrix[row * n + column] * inverse;
            matrix[row * n + column] = factor;
            for k in column + 1..n {
                matrix[row * n + k] -= factor * matrix[column * n + k];
            }
        }
    }
    true
}

/// Solves A x = b in place, with the factor of [`lu_factor`].
pub fn lu_solve(factor: &[f64], n: usize, pivots: &[usize], b: &mut [f64]) {
    for i in 0..n {
        b.swap(i, pivots[i]);
    }
    for i in 1..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= factor[i * n + k] * b[k];
        }
        b[i] = sum;
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= factor[i * n + k] * b[k];
        }
        b[i] = sum * factor[i * n + i];
    }
}
