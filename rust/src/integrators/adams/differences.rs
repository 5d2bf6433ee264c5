//! Modified divided differences of the accelerations at past instants, and the coefficients with which they
//! extrapolate and integrate over the next step `[ShampineGordon1975]`.
//!
//! With ψ_i the time back to the i-th instant before the present one, the polynomial through the last k
//! accelerations is, on the next step of length h,
//!
//! ```text
//! a(t + θh) = Σ c_i(θ) β_i φ_i,   c_i(θ) = Π_{j<i} α_j (θ + ψ_{j-1}/h),   α_j = h / (h + ψ_{j-1})
//! ```
//!
//! All coefficients belong to the instants alone and are shared by all components. The single and the double
//! integral of the polynomial give velocities and positions.

use super::coefficients::{Alphas, Integrals, KEPT, RECIPROCALS, REGULAR, integrals_over_step};
use crate::integrators::stages::Stages;
use crate::numerics::accuracy::ROUNDING;

/// Components that are summed together: one vector register, which two coordinates fill.
pub(super) const LANES: usize = 2;

/// The weights at equal steps.
const REGULAR_WEIGHTS: [[f64; 3]; KEPT] = {
    let mut weights = [[1.0; 3]; KEPT];
    let mut i = 0;
    while i < KEPT {
        weights[i] = [REGULAR[1][i], REGULAR[0][i], 1.0];
        i += 1;
    }
    weights
};

/// The differences, and the coefficients of the step that was last prepared.
#[derive(Clone, Debug)]
pub(super) struct Differences {
    /// φ_1 (the present accelerations), φ_2, ...
    rows: Stages<LANES>,
    /// Number of instants they know.
    count: usize,
    /// ψ_0 = 0, ψ_1, ...: time from the present instant back to each one [s].
    back: [f64; KEPT],
    /// Length of the prepared step [s].
    h: f64,
    /// α_1, ..., α_{count}.
    alpha: Alphas,
    /// β_1, ..., β_{count}: their products with the differences continue these over the step.
    beta: [f64; KEPT],
    /// Products of 1 α_1, 2 α_2, ...
    at_equal_steps: [f64; KEPT + 1],
    /// Single and double integral of every c_i over the step, in h and h².
    integrals: Integrals,
    /// Weights of the differences in the changes of position and velocity, in h² and h, and in the accelerations at
    /// the end: β times double and single integral, and β.
    weights: [[f64; 3]; KEPT],
    /// Number of last distances between the instants that are equal, and their length [s].
    equal: usize,
    length: f64,
    /// Differences of lengths that are roundings of the time [s].
    slack: f64,
    /// Whether the prepared step and all that it follows from are equally long.
    regular: bool,
    /// Whether the coefficients are those of equal steps.
    constant: bool,
}

impl Differences {
    /// No differences yet, for `d` components.
    pub(super) fn new(d: usize) -> Self {
        Self {
            rows: Stages::new(KEPT, d),
            count: 0,
            back: [0.0; KEPT],
            h: 0.0,
            alpha: [1.0; KEPT + 1],
            beta: [1.0; KEPT],
            at_equal_steps: [1.0; KEPT + 1],
            integrals: REGULAR,
            weights: REGULAR_WEIGHTS,
            equal: 0,
            length: 0.0,
            slack: 0.0,
            regular: false,
            constant: false,
        }
    }

    /// Number of instants whose accelerations are known.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Starts with `count` accelerations at equal distances `h` [s], the earliest first, each written to `out`.
    pub(super) fn begin(
        &mut self,
        h: f64,
        count: usize,
        out: &mut [f64],
        mut accelerations: impl FnMut(usize, &mut [f64]),
    ) {
        self.clear();
        self.beta = [1.0; KEPT];
        self.constant = false;
        for index in 0..count {
            accelerations(index, out);
            self.push(out);
        }
        for (index, back) in self.back.iter_mut().enumerate() {
            *back = index as f64 * h;
        }
        (self.equal, self.length) = (count - 1, h);
    }

    /// Computes the coefficients of a step of length `h` from `t` at order `order`, and those that tell its
    /// error.
    pub(super) fn prepare(&mut self, t: f64, h: f64, order: usize) {
        self.h = h;
        // A step may raise the order by one, and that needs one difference more.
        self.count = self.count.min(order + 2);
        self.slack = ROUNDING * (t.abs() + h);
        self.regular = self.equal > order && (h - self.length).abs() <= self.slack;
        if self.regular {
            if !std::mem::replace(&mut self.constant, true) {
                (self.alpha, self.beta, self.at_equal_steps) = (RECIPROCALS, [1.0; KEPT], [1.0; KEPT + 1]);
                (self.integrals, self.weights) = (REGULAR, REGULAR_WEIGHTS);
            }
            return;
        }
        self.constant = false;
        // The first of all these are 1.
        let (mut ahead, mut product, mut number, mut at_equal_steps) = (h, 1.0, 1.0, 1.0);
        let coefficients =
            self.alpha[1..].iter_mut().zip(&mut self.beta[1..]).zip(&mut self.at_equal_steps[2..]);
        for (((alpha, beta), at_equal), back) in coefficients.zip(&self.back[1..self.count]) {
            product *= ahead / back;
            ahead = h + back;
            number += 1.0;
            (*alpha, *beta) = (h / ahead, product);
            at_equal_steps *= number * *alpha;
            *at_equal = at_equal_steps;
        }
        self.integrals = integrals_over_step(&self.alpha, order);
        let [once, twice] = &self.integrals;
        let integrals = twice.iter().zip(once).zip(&self.beta);
        for (weights, ((twice, once), beta)) in self.weights[..order].iter_mut().zip(integrals) {
            *weights = [beta * twice, beta * once, *beta];
        }
    }

    /// Extrapolates at an order over the prepared step, a block of the `d` components: the changes of their positions
    /// besides those by their velocities, the changes of their velocities, and their accelerations at the end.
    #[inline(always)]
    pub(super) fn extrapolated(&self, d: usize, order: usize, block: usize) -> [[f64; LANES]; 3] {
        let [positions, velocities, accelerations] = self.rows.sums(d, block, &self.weights[..order]);
        let h = self.h;
        [positions.map(|change| h * h * change), velocities.map(|change| h * change), accelerations]
    }

    /// What the difference number `order` (from 0) at the end of the prepared step adds to positions and
    /// velocities, per unit of it.
    pub(super) fn correction(&self, order: usize) -> [f64; 2] {
        [self.h * self.h * self.integrals[1][order], self.h * self.integrals[0][order]]
    }

    /// β_i φ_i of a component: the difference number i (from 0) continued over the prepared step.
    pub(super) fn continued(&self, i: usize, component: usize) -> f64 {
        self.beta[i] * self.rows.at(i, component)
    }

    /// The same of all components.
    pub(super) fn write_continued(&self, i: usize, out: &mut [f64]) {
        for (out, component) in out.iter_mut().zip(self.rows.row(i)) {
            *out = self.beta[i] * component;
        }
    }

    /// The α of the prepared step.
    pub(super) fn alpha(&self) -> &Alphas {
        &self.alpha
    }

    /// φ_i: the difference number i (from 0) at the present instant.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        self.rows.row(i)
    }

    /// Ratio of the difference number i (from 0) at equal steps of the prepared length to that at the end of the
    /// prepared step.
    pub(super) fn at_equal_steps(&self, i: usize) -> f64 {
        self.at_equal_steps[i]
    }

    /// Moves to the end of the prepared step, with the accelerations there.
    #[inline(always)]
    pub(super) fn advance(&mut self, a: &[f64]) {
        for i in (1..KEPT.min(self.count + 1)).rev() {
            self.back[i] = self.h + self.back[i - 1];
        }
        if (self.h - self.length).abs() <= self.slack {
            self.equal += 1;
        } else {
            (self.equal, self.length) = (1, self.h);
        }
        self.push(a);
    }

    /// New accelerations as the first row; every other one is the row before less what was continued in its place.
    #[inline(always)]
    fn push(&mut self, a: &[f64]) {
        let count = (self.count + 1).min(KEPT);
        self.rows.renew(&self.beta[..count - 1], a);
        self.count = count;
    }
}
