//! Chebyshev polynomials in the Bernstein basis, whose coefficients enclose the polynomial.
//!
//! ```text
//! p(x) = Σ_i b_i Π_q C(n_q, i_q) u_q^{i_q} (1 - u_q)^{n_q - i_q},    u = (x + 1)/2 in [0, 1]^k
//! min b <= p <= max b;    a coefficient at a corner of the array b is the value at that corner of the box
//! ```
//!
//! Source: `[Garloff1986]`.

/// Largest degree on an axis: the coefficients of T_n reach 2^n / √2 with alternating signs, and the
/// binomials of their numerators have to stay below 2^127. At degree 30 the rounding error is 1e-4 of the
/// highest coefficient.
pub(super) const MOST_DEGREE: usize = 30;

/// Number of polynomials that are transformed together.
pub(super) const LANES: usize = 8;

/// The same coefficient of each of them.
pub(super) type Lanes = [f64; LANES];

/// The Bernstein coefficients of T_0, ..., T_n on one axis.
pub(super) struct Axis {
    degree: usize,
    /// Coefficient i of T_j, row-major in i.
    matrix: Vec<f64>,
    /// Largest size of a coefficient of each T_j.
    pub(super) largest: Vec<f64>,
}

impl Axis {
    /// The axis of a polynomial of `degree` <= [`MOST_DEGREE`].
    ///
    /// With cos² and sin² of half the angle for u and 1 - u, T_j = Re (cos + i sin)^{2j}; raised to degree n,
    ///
    /// ```text
    /// coefficient i of T_j = Σ_l (-1)^{j-l} C(2j, 2l) C(n - j, i - l) / C(n, i)
    /// ```
    ///
    /// The sum is one of integers: only its conversion and the quotient are rounded.
    pub(super) fn new(degree: usize) -> Self {
        let binomials = binomials(2 * degree);
        let size = degree + 1;
        let mut matrix = vec![0.0; size * size];
        for i in 0..=degree {
            for j in 0..=degree {
                let terms = (0..=i.min(j)).filter(|l| i - l <= degree - j).map(|l| {
                    let product = binomials[2 * j][2 * l] * binomials[degree - j][i - l];
                    if (j - l).is_multiple_of(2) { product } else { -product }
                });
                matrix[i * size + j] = terms.sum::<i128>() as f64 / binomials[degree][i] as f64;
            }
        }
        let largest = |j: usize| matrix.iter().skip(j).step_by(size).fold(0.0, |a: f64, b| a.max(b.abs()));
        let largest = (0..size).map(largest).collect();
        Self { degree, matrix, largest }
    }

    /// An array outer x (degree + 1) x `inner` from the Chebyshev basis on this axis to the Bernstein basis.
    ///
    /// Coefficients n - i and i of T_j agree up to the sign (-1)^j: each pair is summed separately over even
    /// and odd j, which halves the work.
    pub(super) fn transform(&self, source: &[Lanes], target: &mut [Lanes], inner: usize) {
        let size = self.degree + 1;
        for (from, to) in source.chunks_exact(size * inner).zip(target.chunks_exact_mut(size * inner)) {
            for i in 0..size.div_ceil(2) {
                let weights = &self.matrix[i * size..(i + 1) * size];
                for at in 0..inner {
                    let (mut even, mut odd) = ([0.0; LANES], [0.0; LANES]);
                    for (pair, j) in weights.chunks(2).zip((0..).step_by(2)) {
                        add_scaled(&mut even, pair[0], &from[j * inner + at]);
                        if let Some(&weight) = pair.get(1) {
                            add_scaled(&mut odd, weight, &from[(j + 1) * inner + at]);
                        }
                    }
                    // In the middle the odd sum is zero.
                    let (upper, lower) = ((self.degree - i) * inner + at, i * inner + at);
                    for lane in 0..LANES {
                        to[upper][lane] = even[lane] - odd[lane];
                        to[lower][lane] = even[lane] + odd[lane];
                    }
                }
            }
        }
    }
}

/// Splits a polynomial outer x (degree + 1) x `inner` at the fraction `t` of an axis (de Casteljau): `whole`
/// becomes the upper part, `lower` gets the lower one. `t` and 1 - `t` must both be exact.
pub(super) fn split(whole: &mut [f64], lower: &mut [f64], degree: usize, inner: usize, t: f64) {
    let block = (degree + 1) * inner;
    let s = 1.0 - t;
    for (b, low) in whole.chunks_exact_mut(block).zip(lower.chunks_exact_mut(block)) {
        low[..inner].copy_from_slice(&b[..inner]);
        for r in 1..=degree {
            let active = (degree + 1 - r) * inner;
            for index in 0..active {
                b[index] = s * b[index] + t * b[index + inner];
            }
            low[r * inner..(r + 1) * inner].copy_from_slice(&b[..inner]);
        }
    }
}

/// Pascal's triangle to row `last`.
fn binomials(last: usize) -> Vec<Vec<i128>> {
    let mut rows = vec![vec![1]];
    for n in 1..=last {
        let above: &Vec<i128> = &rows[n - 1];
        let inside = above.windows(2).map(|pair| pair[0] + pair[1]);
        rows.push(std::iter::once(1).chain(inside).chain(std::iter::once(1)).collect());
    }
    rows
}

fn add_scaled(target: &mut Lanes, factor: f64, source: &Lanes) {
    for (t, s) in target.iter_mut().zip(source) {
        *t += factor * s;
    }
}
