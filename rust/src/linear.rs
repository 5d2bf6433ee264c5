//! Small dense linear algebra in place: the step loop may not allocate.

/// Factors a symmetric positive definite row-major `n` x `n` matrix as L Lᵀ, in its lower
/// triangle; the diagonal of L is stored inverted. Returns false where a pivot is not positive
/// (or not a number).
#[inline]
pub fn cholesky_factor(matrix: &mut [f64], n: usize) -> bool {
    for i in 0..n {
        let (above, rest) = matrix.split_at_mut(i * n);
        let row = &mut rest[..n];
        for j in 0..i {
            let other = &above[j * n..j * n + n];
            row[j] = (row[j] - dot(&row[..j], &other[..j])) * other[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        row[i] = 1.0 / pivot.sqrt();
    }
    true
}

/// Solves L Lᵀ x = b in place, with the factor of [`cholesky_factor`].
#[inline]
pub fn cholesky_solve(factor: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let row = &factor[i * n..i * n + n];
        b[i] = (b[i] - dot(&row[..i], &b[..i])) * row[i];
    }
    for i in (0..n).rev() {
        let row = &factor[i * n..i * n + n];
        b[i] *= row[i];
        let (before, at) = b.split_at_mut(i);
        for (x, l) in before.iter_mut().zip(row) {
            *x -= l * at[0];
        }
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
#[inline]
pub fn lu_solve(factor: &[f64], n: usize, pivots: &[usize], b: &mut [f64]) {
    for (i, &pivot) in pivots.iter().enumerate() {
        b.swap(i, pivot);
    }
    for i in 1..n {
        let row = &factor[i * n..i * n + n];
        b[i] -= dot(&row[..i], &b[..i]);
    }
    for i in (0..n).rev() {
        let row = &factor[i * n..i * n + n];
        b[i] = (b[i] - dot(&row[i + 1..], &b[i + 1..n])) * row[i];
    }
}
