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

use crate::integrators::stages::{BLOCK, Stages};

/// Largest order of the predictor.
pub(super) const MOST: usize = 12;
/// Accelerations kept: one more than the predictor uses, for the error of the next order.
pub(super) const KEPT: usize = MOST + 1;
/// Lengths of steps are equal if they differ by so many roundings of the time: the steps end on rounded
/// instants.
const ROUNDINGS: f64 = 4.0;

/// The differences, and the coefficients of the step that was last prepared.
#[derive(Clone, Debug)]
pub(super) struct Differences {
    d: usize,
    /// φ_1 (the present accelerations), φ_2, ...
    rows: Stages,
    /// Number of instants they know.
    count: usize,
    /// ψ_0 = 0, ψ_1, ...: time from the present instant back to each one [s].
    back: [f64; KEPT],
    /// Length of the prepared step [s].
    h: f64,
    /// α_1, ..., α_{count}, and one place that none takes.
    alpha: [f64; KEPT + 1],
    /// β_1, ..., β_{count}: their products with the differences continue these over the step.
    beta: [f64; KEPT],
    /// Single and double integral of every c_i over the step, in h and h².
    integrals: [[f64; KEPT]; 2],
    /// Products of these with β.
    weights: [[f64; KEPT]; 2],
    /// Number of last distances between the instants that are equal, and their length [s].
    equal: usize,
    length: f64,
    /// Differences of lengths that are roundings of the time [s].
    slack: f64,
    /// Whether the prepared step and all that it follows from are equally long.
    regular: bool,
    /// Whether the coefficients are those of equal steps.
    constant: bool,
    /// Coefficients of powers of the prepared step, where it is not regular.
    powers: Powers,
}

impl Differences {
    /// No differences yet, for `d` components.
    pub(super) fn new(d: usize) -> Self {
        Self {
            d,
            rows: Stages::new(KEPT + 1, d),
            count: 0,
            back: [0.0; KEPT],
            h: 0.0,
            alpha: [1.0; KEPT + 1],
            beta: [1.0; KEPT],
            integrals: REGULAR,
            weights: REGULAR,
            equal: 0,
            length: 0.0,
            slack: 0.0,
            regular: false,
            constant: false,
            powers: [[0.0; KEPT]; KEPT],
        }
    }

    /// Number of instants whose accelerations are known.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Starts with accelerations at equal distances `h` [s], the earliest first.
    pub(super) fn begin(&mut self, h: f64, mut accelerations: impl FnMut(usize, &mut [f64]), count: usize) {
        self.clear();
        self.beta = [1.0; KEPT];
        self.constant = false;
        for index in 0..count {
            self.push(|out| accelerations(index, out));
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
        self.slack = ROUNDINGS * f64::EPSILON * (t.abs() + h);
        self.regular = self.equal > order && (h - self.length).abs() <= self.slack;
        if self.regular {
            if !std::mem::replace(&mut self.constant, true) {
                (self.alpha, self.beta) = (RECIPROCALS, [1.0; KEPT]);
                (self.integrals, self.weights) = (REGULAR, REGULAR);
            }
            return;
        }
        self.constant = false;
        let mut product = 1.0;
        for i in 0..self.count {
            let ahead = h + self.back[i];
            self.alpha[i] = h / ahead;
            self.beta[i] = product;
            if i + 1 < self.count {
                product *= ahead / self.back[i + 1];
            }
        }
        // Loops of fixed length are the faster ones, and low orders need few columns.
        self.integrals = match order + 2 {
            ..6 => integrals::<6>(&self.alpha, order),
            6..11 => integrals::<10>(&self.alpha, order),
            _ => integrals::<{ KEPT + 1 }>(&self.alpha, order),
        };
        for (weights, integrals) in self.weights.iter_mut().zip(&self.integrals) {
            for ((weight, integral), beta) in weights.iter_mut().zip(integrals).zip(&self.beta) {
                *weight = beta * integral;
            }
        }
    }

    /// Extrapolates at an order over the prepared step. Gives `take` the number of each component with the change
    /// of its position besides that by its velocity, the change of its velocity, and its acceleration at the end.
    pub(super) fn extrapolate(&self, order: usize, mut take: impl FnMut(usize, [f64; 3])) {
        let (h, d) = (self.h, self.d);
        let [once, twice] = &self.weights;
        let weights = [&twice[..order], &once[..order], &self.beta[..order]];
        self.rows.sum_blocks(weights, |first, [positions, velocities, accelerations]| {
            for lane in 0..BLOCK.min(d - first) {
                take(first + lane, [h * h * positions[lane], h * velocities[lane], accelerations[lane]]);
            }
        });
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

    /// The same of as many components of a block as asked for, from the number `first` on.
    pub(super) fn continued_block<const LANES: usize>(&self, i: usize, first: usize) -> [f64; LANES] {
        let block = self.rows.block(i, first);
        std::array::from_fn(|lane| self.beta[i] * block[lane])
    }

    /// φ_i of a component: the difference number i (from 0) at the present instant.
    pub(super) fn row(&self, i: usize, component: usize) -> f64 {
        self.rows.at(i, component)
    }

    /// Ratios of the differences up to the number `last` (from 0) at equal steps of the prepared length to those at
    /// the end of the prepared step.
    pub(super) fn at_equal_steps(&self, last: usize) -> [f64; KEPT] {
        let mut ratios = [1.0; KEPT];
        if !self.regular {
            for (i, alpha) in self.alpha[..last].iter().enumerate() {
                ratios[i + 1] = ratios[i] * ((i + 1) as f64 * alpha);
            }
        }
        ratios
    }

    /// Moves to the end of the prepared step, with the accelerations there.
    pub(super) fn advance(&mut self, a: &[f64]) {
        for i in (1..KEPT.min(self.count + 1)).rev() {
            self.back[i] = self.h + self.back[i - 1];
        }
        if (self.h - self.length).abs() <= self.slack {
            self.equal += 1;
        } else {
            (self.equal, self.length) = (1, self.h);
        }
        self.push(|out| out.copy_from_slice(a));
    }

    /// New first row; every other one is the row before less what was continued in its place.
    fn push(&mut self, accelerations: impl FnOnce(&mut [f64])) {
        let count = (self.count + 1).min(KEPT);
        // The row behind the last one is free: the new accelerations wait there.
        accelerations(self.rows.row_mut(KEPT));
        self.rows.renew(&self.beta[..count - 1], KEPT);
        self.count = count;
    }

    /// Computes [`Differences::powers`] up to an order.
    pub(super) fn find_powers(&mut self, order: usize) {
        if !self.regular {
            write_powers(&mut self.powers, &self.alpha, order);
        }
    }

    /// Coefficients of the powers of θ in c_1, ..., c_{order + 1} on the prepared step: a row of each; after
    /// [`Differences::find_powers`].
    pub(super) fn powers(&self) -> &Powers {
        if self.regular { &REGULAR_POWERS } else { &self.powers }
    }
}

/// Rows of coefficients of powers.
pub(super) type Powers = [[f64; KEPT]; KEPT];

/// Writes the coefficients of the powers of θ in c_1, ..., c_{order + 1}, a row of each, from the α.
const fn write_powers(rows: &mut Powers, alpha: &[f64; KEPT + 1], order: usize) {
    assert!(order <= MOST);
    rows[0] = [0.0; KEPT];
    rows[0][0] = 1.0;
    let mut i = 1;
    while i <= order {
        // c_{i+1} = c_i (α_i θ + 1 - α_i)
        let (last, linear) = (rows[i - 1], alpha[i - 1]);
        let constant = 1.0 - linear;
        rows[i][0] = constant * last[0];
        let mut p = 1;
        // All of the row: loops of fixed length are the faster ones.
        while p < KEPT {
            rows[i][p] = constant * last[p] + linear * last[p - 1];
            p += 1;
        }
        i += 1;
    }
}

/// Single and double integrals of c_1, ..., c_{order + 1} over the step, from the α.
const fn integrals<const COLUMNS: usize>(alpha: &[f64; KEPT + 1], order: usize) -> [[f64; KEPT]; 2] {
    assert!(order + 2 <= COLUMNS && COLUMNS <= KEPT + 1);
    // Row i of the recursion g_{i+1,q} = g_{i,q} - α_i g_{i,q+1}, g_{1,q} = 1/q; columns q = 1 and 2 are the
    // single and the double integral. The last column is not renewed, and what follows from it reaches these
    // after the last row only.
    let mut row = [0.0; COLUMNS];
    row.copy_from_slice(RECIPROCALS.split_at(COLUMNS).0);
    let mut integrals = [[0.0; KEPT]; 2];
    (integrals[0][0], integrals[1][0]) = (row[0], row[1]);
    let mut i = 1;
    while i <= order {
        let mut q = 0;
        while q + 1 < COLUMNS {
            row[q] -= alpha[i - 1] * row[q + 1];
            q += 1;
        }
        (integrals[0][i], integrals[1][i]) = (row[0], row[1]);
        i += 1;
    }
    integrals
}

/// 1, 1/2, 1/3, ...: at equal steps the α.
pub(super) const RECIPROCALS: [f64; KEPT + 1] = {
    let mut values = [0.0; KEPT + 1];
    let mut i = 0;
    while i <= KEPT {
        values[i] = 1.0 / (i + 1) as f64;
        i += 1;
    }
    values
};

/// The integrals at equal steps.
const REGULAR: [[f64; KEPT]; 2] = integrals::<{ KEPT + 1 }>(&RECIPROCALS, MOST);

/// The coefficients of the powers at equal steps.
static REGULAR_POWERS: Powers = {
    let mut rows = [[0.0; KEPT]; KEPT];
    write_powers(&mut rows, &RECIPROCALS, MOST);
    rows
};
