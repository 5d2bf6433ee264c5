//! Coefficients of the polynomial through past accelerations `[ShampineGordon1975]`: they belong to the instants
//! alone.
//!
//! ```text
//! c_1(θ) = 1,   c_{i+1}(θ) = c_i(θ) (α_i θ + 1 - α_i)
//! ```

/// Largest order of the predictor.
pub(super) const MOST: usize = 12;
/// Accelerations kept: one more than the predictor uses, for the error of the next order.
pub(super) const KEPT: usize = MOST + 1;

/// The α_1, α_2, ... of a step, and one place that none takes.
pub(in crate::integrators) type Alphas = [f64; KEPT + 1];

/// Single and double integrals of c_1, c_2, ..., in h and h².
pub(super) type Integrals = [[f64; KEPT]; 2];

/// 1, 1/2, 1/3, ...: at equal steps the α.
pub(super) const RECIPROCALS: Alphas = {
    let mut values = [0.0; KEPT + 1];
    let mut i = 0;
    while i <= KEPT {
        values[i] = 1.0 / (i + 1) as f64;
        i += 1;
    }
    values
};

/// The integrals over a whole step, one of equal ones.
pub(super) const REGULAR: Integrals = integrals::<MOST, true>(&RECIPROCALS, 1.0);

/// Integrals of c_1, ..., c_{order + 1} over a whole step.
pub(super) fn integrals_over_step(alpha: &Alphas, order: usize) -> Integrals {
    of_order::<true>(alpha, order, 1.0)
}

/// The same from its start to its part θ.
pub(in crate::integrators) fn integrals_to(alpha: &Alphas, order: usize, theta: f64) -> Integrals {
    of_order::<false>(alpha, order, theta)
}

/// Integrals to θ, which is 1 where WHOLE says so. Loops of known length are the faster ones.
#[inline(always)]
fn of_order<const WHOLE: bool>(alpha: &Alphas, order: usize, theta: f64) -> Integrals {
    match order {
        0 => integrals::<0, WHOLE>(alpha, theta),
        1 => integrals::<1, WHOLE>(alpha, theta),
        2 => integrals::<2, WHOLE>(alpha, theta),
        3 => integrals::<3, WHOLE>(alpha, theta),
        4 => integrals::<4, WHOLE>(alpha, theta),
        5 => integrals::<5, WHOLE>(alpha, theta),
        6 => integrals::<6, WHOLE>(alpha, theta),
        7 => integrals::<7, WHOLE>(alpha, theta),
        8 => integrals::<8, WHOLE>(alpha, theta),
        9 => integrals::<9, WHOLE>(alpha, theta),
        10 => integrals::<10, WHOLE>(alpha, theta),
        11 => integrals::<11, WHOLE>(alpha, theta),
        _ => integrals::<MOST, WHOLE>(alpha, theta),
    }
}

#[inline(always)]
const fn integrals<const ORDER: usize, const WHOLE: bool>(alpha: &Alphas, theta: f64) -> Integrals {
    // Row i of the recursion g_{i+1,q} = (α_i θ + 1 - α_i) g_{i,q} - α_i g_{i,q+1}, g_{1,q} = θ^q/q; columns q = 1
    // and 2 are the single and the double integral.
    let mut row = RECIPROCALS;
    if !WHOLE {
        let (mut power, mut q) = (theta, 0);
        while q < ORDER + 2 {
            row[q] *= power;
            power *= theta;
            q += 1;
        }
    }
    let mut integrals = [[0.0; KEPT]; 2];
    (integrals[0][0], integrals[1][0]) = (row[0], row[1]);
    let mut i = 1;
    while i <= ORDER {
        let ratio = alpha[i - 1];
        let kept = if WHOLE { 1.0 } else { ratio * theta + (1.0 - ratio) };
        let mut q = 0;
        while q < ORDER + 2 - i {
            row[q] = kept * row[q] - ratio * row[q + 1];
            q += 1;
        }
        (integrals[0][i], integrals[1][i]) = (row[0], row[1]);
        i += 1;
    }
    integrals
}
