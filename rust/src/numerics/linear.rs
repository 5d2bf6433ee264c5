//! Small dense linear algebra in place, since the loop over the steps must not allocate memory.

/// Factors a symmetric positive definite row-major `n` x `n` matrix as L D Lᵀ, in its lower
/// triangle; the diagonal holds the inverse of D. Returns false where a pivot is not positive (or
/// not a number).
///
/// There are no square roots as in Cholesky's form, whose last bits would depend on the unit of mass even if
/// units differ by a factor of two.
pub fn symmetric_factor(matrix: &mut [f64], n: usize) -> bool {
    // Where the compiler knows the size it unrolls the loops and knows that no index is out of bounds.
    match n {
        1 => symmetric_factor_of(matrix, 1),
        2 => symmetric_factor_of(matrix, 2),
        3 => symmetric_factor_of(matrix, 3),
        4 => symmetric_factor_of(matrix, 4),
        5 => symmetric_factor_of(matrix, 5),
        6 => symmetric_factor_of(matrix, 6),
        8 => symmetric_factor_of(matrix, 8),
        _ => symmetric_factor_of(matrix, n),
    }
}

#[inline(always)]
fn symmetric_factor_of(matrix: &mut [f64], n: usize) -> bool {
    let matrix = &mut matrix[..n * n];
    for i in 0..n {
        let (above, rest) = matrix.split_at_mut(i * n);
        let row = &mut rest[..n];
        // First the row of L D, from which the pivot follows while it is scaled to L.
        for j in 1..i {
            row[j] -= dot(&row[..j], &above[j * n..j * n + j]);
        }
        let mut pivot = row[i];
        for j in 0..i {
            let scaled = row[j] * above[j * n + j];
            pivot -= row[j] * scaled;
            row[j] = scaled;
        }
        if !is_pivot(pivot) {
            return false;
        }
        row[i] = 1.0 / pivot;
    }
    true
}

fn is_pivot(pivot: f64) -> bool {
    pivot > 0.0 && pivot.is_finite()
}

/// Solves L D Lᵀ x = b in place, with the factor of [`symmetric_factor`].
pub fn symmetric_solve(factor: &[f64], n: usize, b: &mut [f64]) {
    match n {
        1 => symmetric_solve_of(factor, 1, b),
        2 => symmetric_solve_of(factor, 2, b),
        3 => symmetric_solve_of(factor, 3, b),
        4 => symmetric_solve_of(factor, 4, b),
        5 => symmetric_solve_of(factor, 5, b),
        6 => symmetric_solve_of(factor, 6, b),
        8 => symmetric_solve_of(factor, 8, b),
        _ => symmetric_solve_of(factor, n, b),
    }
}

#[inline(always)]
fn symmetric_solve_of(factor: &[f64], n: usize, b: &mut [f64]) {
    let (factor, b) = (&factor[..n * n], &mut b[..n]);
    for i in 1..n {
        b[i] -= dot(&factor[i * n..i * n + i], &b[..i]);
    }
    for i in 0..n {
        b[i] *= factor[i * n + i];
    }
    // Row by row, as the factor lies in memory.
    for i in (1..n).rev() {
        let (above, x) = b.split_at_mut(i);
        for (above, lower) in above.iter_mut().zip(&factor[i * n..i * n + i]) {
            *above -= lower * x[0];
        }
    }
}

#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Factors a row-major `n` x `n` matrix with partial pivoting; the diagonal of U is stored
/// inverted. Returns false where the matrix is singular or not finite.
///
/// Rows are scaled by `weights` for the choice of pivots, which must not depend on the units of the equations
/// (angles and lengths). The weights are permuted with the rows and restored.
pub fn lu_factor(matrix: &mut [f64], n: usize, weights: &mut [f64], pivots: &mut [usize]) -> bool {
    let regular = match n {
        1 => eliminate(matrix, 1, weights, pivots),
        2 => eliminate(matrix, 2, weights, pivots),
        3 => eliminate(matrix, 3, weights, pivots),
        4 => eliminate(matrix, 4, weights, pivots),
        5 => eliminate(matrix, 5, weights, pivots),
        6 => eliminate(matrix, 6, weights, pivots),
        8 => eliminate(matrix, 8, weights, pivots),
        _ => eliminate(matrix, n, weights, pivots),
    };
    for (column, &pivot) in pivots.iter().enumerate().rev() {
        weights.swap(column, pivot);
    }
    regular
}

#[inline(always)]
fn eliminate(matrix: &mut [f64], n: usize, weights: &mut [f64], pivots: &mut [usize]) -> bool {
    let (matrix, weights, pivots) = (&mut matrix[..n * n], &mut weights[..n], &mut pivots[..n]);
    for (column, pivot) in pivots.iter_mut().enumerate() {
        *pivot = column;
    }
    for column in 0..n {
        let mut pivot = column;
        let mut largest = weights[column] * matrix[column * n + column].abs();
        for row in column + 1..n {
            let size = weights[row] * matrix[row * n + column].abs();
            if size > largest {
                (pivot, largest) = (row, size);
            }
        }
        weights.swap(column, pivot);
        pivots[column] = pivot;
        if pivot != column {
            for k in 0..n {
                matrix.swap(column * n + k, pivot * n + k);
            }
        }
        let inverse = 1.0 / matrix[column * n + column];
        // The inverse of an infinite pivot is zero: the step would have length zero and no error.
        if !inverse.is_finite() || inverse == 0.0 {
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
    match n {
        1 => lu_solve_of(factor, 1, pivots, b),
        2 => lu_solve_of(factor, 2, pivots, b),
        3 => lu_solve_of(factor, 3, pivots, b),
        4 => lu_solve_of(factor, 4, pivots, b),
        5 => lu_solve_of(factor, 5, pivots, b),
        6 => lu_solve_of(factor, 6, pivots, b),
        8 => lu_solve_of(factor, 8, pivots, b),
        _ => lu_solve_of(factor, n, pivots, b),
    }
}

#[inline(always)]
fn lu_solve_of(factor: &[f64], n: usize, pivots: &[usize], b: &mut [f64]) {
    let (factor, pivots, b) = (&factor[..n * n], &pivots[..n], &mut b[..n]);
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
