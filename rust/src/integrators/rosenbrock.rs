//! One step of a Rosenbrock method in second-order structure, and its dense output.
//!
//! For `q̇ = v`, `v̇ = a(q, v, t)` the position rows of `W u = r` are eliminated,
//!
//! ```text
//! u_q = hγ (u_v + r_q),     (I/(hγ) - a_v - hγ a_q) u_v = r_v + hγ a_q r_q
//! ```
//!
//! so that a d x d matrix is factored instead of 2d x 2d `[SanduNegrut2003]`.

use crate::dynamics::Linearisation;
use crate::integrators::HybridSystem;
use crate::integrators::tableaus::Tableau;
use crate::linear::{lu_factor, lu_solve};

/// A step `t .. t + h` and the polynomial through it.
#[derive(Clone, Debug, Default)]
pub struct DenseStep {
    /// Start of the step [s].
    pub t: f64,
    /// Length of the step [s].
    pub h: f64,
    /// (q, v) at the start.
    pub start: Vec<f64>,
    /// (q, v) at the end.
    pub end: Vec<f64>,
    /// Rows K_r of the dense output.
    rows: Vec<f64>,
}

impl DenseStep {
    /// State at `t + theta h`, theta in [0, 1], written to `q` and `v`.
    pub fn at(&self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        let n = self.start.len();
        let rest = 1.0 - theta;
        let count = self.rows.len() / n;
        for k in 0..n {
            let mut sum = 0.0;
            for r in (0..count).rev() {
                sum = sum * theta + self.rows[r * n + k];
            }
            let value = rest * self.start[k] + theta * (self.end[k] + rest * sum);
            if k < n / 2 { q[k] = value } else { v[k - n / 2] = value }
        }
    }

    /// End of the step [s].
    pub fn end_time(&self) -> f64 {
        self.t + self.h
    }
}

/// A Rosenbrock method with its scratch memory.
#[derive(Clone, Debug)]
pub struct Rosenbrock {
    tableau: Tableau,
    d: usize,
    /// Stage vectors u_i as (u_q, u_v), one row a stage.
    stages: Vec<f64>,
    w: Vec<f64>,
    pivots: Vec<usize>,
    /// y + Σ A u and (1/h) Σ C u of the present stage.
    argument: Vec<f64>,
    memory: Vec<f64>,
    a: Vec<f64>,
    /// Local error estimate of (q, v).
    pub error: Vec<f64>,
    /// The step last taken.
    pub step: DenseStep,
}

impl Rosenbrock {
    /// The method for `d` degrees of freedom.
    pub fn new(tableau: Tableau, d: usize) -> Self {
        let n = 2 * d;
        Self {
            tableau,
            d,
            stages: vec![0.0; tableau.stages * n],
            w: vec![0.0; d * d],
            pivots: vec![0; d],
            argument: vec![0.0; n],
            memory: vec![0.0; n],
            a: vec![0.0; d],
            error: vec![0.0; n],
            step: DenseStep {
                t: 0.0,
                h: 0.0,
                start: vec![0.0; n],
                end: vec![0.0; n],
                rows: vec![0.0; tableau.h.len() / tableau.stages * n],
            },
        }
    }

    /// The coefficients.
    pub fn tableau(&self) -> &Tableau {
        &self.tableau
    }

    /// Takes a step of length `h` from (q, v) at `t`, where the accelerations and their
    /// derivatives are `linear`. Returns false where W is singular or something is not finite.
    pub fn take(
        &mut self,
        system: &mut dyn HybridSystem,
        linear: &Linearisation,
        t: f64,
        h: f64,
        q: &[f64],
        v: &[f64],
    ) -> bool {
        let d = self.d;
        let n = 2 * d;
        let Tableau { stages, gamma, alpha, d: time_weight, a: a_coefficients, c: c_coefficients, .. } =
            self.tableau;
        let diagonal = h * gamma;
        for i in 0..d * d {
            self.w[i] = -linear.a_v[i] - diagonal * linear.a_q[i];
        }
        for i in 0..d {
            self.w[i * d + i] += 1.0 / diagonal;
        }
        if !lu_factor(&mut self.w, d, &mut self.pivots) {
            return false;
        }
        self.step.t = t;
        self.step.h = h;
        self.step.start[..d].copy_from_slice(q);
        self.step.start[d..].copy_from_slice(v);
        let inverse = 1.0 / h;
        for i in 0..stages {
            let (done, rest) = self.stages.split_at_mut(i * n);
            let u = &mut rest[..n];
            self.argument.copy_from_slice(&self.step.start);
            self.memory.fill(0.0);
            for (j, earlier) in done.chunks_exact(n).enumerate() {
                let (a, c) = (a_coefficients[i * stages + j], c_coefficients[i * stages + j] * inverse);
                for k in 0..n {
                    self.argument[k] += a * earlier[k];
                    self.memory[k] += c * earlier[k];
                }
            }
            if i == 0 {
                self.a.copy_from_slice(&linear.a);
            } else {
                let (stage_q, stage_v) = self.argument.split_at(d);
                if !system.acceleration(t + alpha[i] * h, stage_q, stage_v, &mut self.a) {
                    return false;
                }
            }
            let (u_q, u_v) = u.split_at_mut(d);
            for k in 0..d {
                // r_q waits in u_q until u_v is known.
                u_q[k] = self.argument[d + k] + self.memory[k];
                u_v[k] = self.a[k] + self.memory[d + k] + h * time_weight[i] * linear.a_t[k];
            }
            for k in 0..d {
                let mut sum = 0.0;
                for l in 0..d {
                    sum += linear.a_q[k * d + l] * u_q[l];
                }
                u_v[k] += diagonal * sum;
            }
            lu_solve(&self.w, d, &self.pivots, u_v);
            for k in 0..d {
                u_q[k] = diagonal * (u_v[k] + u_q[k]);
            }
        }
        self.step.end.copy_from_slice(&self.step.start);
        combine(self.tableau.m, &self.stages, &mut self.step.end);
        self.error.fill(0.0);
        combine(self.tableau.e, &self.stages, &mut self.error);
        self.step.end.iter().all(|y| y.is_finite())
    }

    /// Computes the dense output of the step last taken.
    pub fn finish_dense(&mut self) {
        let n = 2 * self.d;
        self.step.rows.fill(0.0);
        let weights = self.tableau.h.chunks_exact(self.tableau.stages);
        for (row, weights) in self.step.rows.chunks_exact_mut(n).zip(weights) {
            combine(weights, &self.stages, row);
        }
    }
}

/// Adds the weighted stages to `sum`.
fn combine(weights: &[f64], stages: &[f64], sum: &mut [f64]) {
    for (weight, stage) in weights.iter().zip(stages.chunks_exact(sum.len())) {
        if *weight != 0.0 {
            for (total, u) in sum.iter_mut().zip(stage) {
                *total += weight * u;
            }
        }
    }
}
