//! One step of a Rosenbrock method in second-order structure, and its dense output.
//!
//! For `q̇ = v`, `v̇ = a(q, v, t)` the position rows of `W u = r` are eliminated,
//!
//! ```text
//! u_q = hγ (u_v + r_q),     (I/(hγ) - a_v - hγ a_q) u_v = r_v + hγ a_q r_q
//! ```
//!
//! so that a d x d matrix is factored instead of 2d x 2d `[SanduNegrut2003]`.

use crate::dynamics::Linearization;
use crate::integrators::dense::{DenseStep, Factors};
use crate::integrators::stages::{Stages, Weights};
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, StateAt, Stats, Stepper};
use crate::numerics::instant::Instant;
use crate::numerics::linear::lu_factor;

/// Evaluations that a Jacobian is worth besides the one that it contains, and a factorization.
pub(super) const JACOBIAN: f64 = 1.0;
pub(super) const FACTORIZATION: f64 = 0.5;

/// A Rosenbrock method with its scratch memory.
#[derive(Clone, Debug)]
pub struct Rosenbrock {
    tableau: Tableau,
    d: usize,
    /// Stage vectors u_i as (u_q, u_v).
    stages: Stages,
    /// Reciprocal velocity tolerances: the scaling of the rows for the choice of pivots.
    pub weights: Vec<f64>,
    /// State (q, v) at which the present stage evaluates the accelerations.
    argument: Vec<f64>,
    /// Right-hand sides r_q and r_v of the present stage.
    residual: Vec<f64>,
    a: Vec<f64>,
    /// The step last taken.
    pub step: DenseStep,
    /// Whether the dense output of that step is complete.
    dense: bool,
    /// Accelerations and Jacobian at the start of the present step.
    linear: Linearization,
}

impl Rosenbrock {
    /// The method for `d` degrees of freedom.
    pub fn new(tableau: Tableau, d: usize) -> Self {
        let n = 2 * d;
        let mut step = DenseStep::new(n, tableau.h.len(), tableau.embedded_order, false);
        step.factors = Factors { w: vec![0.0; d * d], pivots: vec![0; d], diagonal: 0.0 };
        Self {
            tableau,
            d,
            stages: Stages::new(tableau.stages, n),
            weights: vec![1.0; d],
            argument: vec![0.0; n],
            residual: vec![0.0; n],
            a: vec![0.0; d],
            step,
            dense: false,
            linear: Linearization::new(d),
        }
    }

    /// Evaluations of a step, with what its Jacobian and its factorization are worth.
    pub(super) fn work(&self) -> f64 {
        self.tableau.stages as f64 + JACOBIAN + FACTORIZATION
    }

    /// Factors W = I/(hγ) - a_v - hγ a_q; false where it is singular.
    fn factor(&mut self, diagonal: f64) -> bool {
        let Self { d, linear, weights, .. } = self;
        let (d, Factors { w, pivots, diagonal: of_step }) = (*d, &mut self.step.factors);
        *of_step = diagonal;
        for i in 0..d * d {
            w[i] = -linear.a_v[i] - diagonal * linear.a_q[i];
        }
        for i in 0..d {
            w[i * d + i] += 1.0 / diagonal;
        }
        lu_factor(w, d, weights, pivots)
    }

    /// Upper bound of the fastest rate of the motion [1/s], from the Jacobian of the last [`Stepper::begin`].
    pub fn rate(&self) -> f64 {
        self.norm(&self.linear.a_v) + self.norm(&self.linear.a_q).sqrt()
    }

    /// Upper bound of the rate at which velocities are damped [1/s], from the Jacobian of the last
    /// [`Stepper::begin`].
    pub fn damping(&self) -> f64 {
        self.norm(&self.linear.a_v)
    }

    /// Computes the dense output of the step last taken.
    fn write_dense(&mut self) {
        if std::mem::replace(&mut self.dense, true) {
            return;
        }
        // At least 1: without a degree of freedom there are no rows, and no chunks of length zero.
        let rows = self.step.rows.chunks_exact_mut((2 * self.d).max(1));
        for (row, weights) in rows.zip(self.tableau.h) {
            self.stages.combine_all([Weights::dense(weights)], row, |[sum]| sum);
        }
    }

    /// Maximum row sum, with rows and columns scaled by the tolerances so that units do not matter.
    fn norm(&self, matrix: &[f64]) -> f64 {
        let row_sum = |(row, weight): (&[f64], &f64)| {
            weight * row.iter().zip(&self.weights).map(|(a, weight)| a.abs() / weight).sum::<f64>()
        };
        matrix.chunks_exact(self.d.max(1)).zip(&self.weights).map(row_sum).fold(0.0, f64::max)
    }
}

impl Stepper for Rosenbrock {
    fn restart(&mut self, _position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        for (weight, tolerance) in self.weights.iter_mut().zip(velocity_tolerance) {
            *weight = 1.0 / tolerance;
        }
    }

    fn begin(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool {
        let StateAt { t, q, v } = at;
        stats.jacobians += 1;
        stats.evaluations += 1;
        self.step.t = t;
        self.step.start[..self.d].copy_from_slice(q);
        self.step.start[self.d..].copy_from_slice(v);
        if !system.linearize(t, q, v, &mut self.linear) {
            return false;
        }
        system.begin(t, q, v, &self.linear.a);
        true
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        stats.stages += self.tableau.stages;
        stats.evaluations += self.tableau.stages - 1;
        stats.factorizations += 1;
        let d = self.d;
        let Tableau { stages, gamma, alpha, d: time_weight, a, c, .. } = self.tableau;
        let diagonal = h * gamma;
        self.step.damping = h * self.damping();
        if !self.factor(diagonal) {
            return false;
        }
        self.dense = false;
        self.step.h = h;
        let Self { linear, step, .. } = self;
        let t = step.t;
        let inverse = 1.0 / h;
        for i in 0..stages {
            self.stages.add(&step.start, a[i], &mut self.argument);
            self.stages.combine_all([Weights::dense(c[i])], &mut self.residual, |[sum]| sum * inverse);
            if i == 0 {
                self.a.copy_from_slice(&linear.a);
            } else {
                let (stage_q, stage_v) = self.argument.split_at(d);
                if !system.acceleration(Instant::after(t, alpha[i] * h), stage_q, stage_v, &mut self.a) {
                    return false;
                }
            }
            let (r_q, r_v) = self.residual.split_at_mut(d);
            let by_time = h * time_weight[i];
            for (r_q, velocity) in r_q.iter_mut().zip(&self.argument[d..]) {
                *r_q += velocity;
            }
            for (k, r_v) in r_v.iter_mut().enumerate() {
                let coupling: f64 = linear.a_q[k * d..k * d + d].iter().zip(&*r_q).map(|(a, r)| a * r).sum();
                *r_v += self.a[k] + by_time * linear.a_t[k] + diagonal * coupling;
            }
            step.solve(r_v);
            let (u_q, u_v) = self.stages.row_mut(i).split_at_mut(d);
            u_v.copy_from_slice(r_v);
            for ((u_q, u_v), r_q) in u_q.iter_mut().zip(&*u_v).zip(&*r_q) {
                *u_q = diagonal * (u_v + r_q);
            }
        }
        self.stages.advance(&step.start, 1.0, self.tableau.m, &mut step.end);
        self.stages.combine_all([Weights::dense(self.tableau.e)], &mut step.error, |[sum]| sum);
        step.end.iter().all(|y| y.is_finite())
    }

    fn step(&mut self) -> &mut DenseStep {
        &mut self.step
    }

    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        self.write_dense();
        self.step.at(theta, q, v);
    }

    fn nodes(&self) -> &'static [f64] {
        self.tableau.alpha
    }

    fn finish_dense(&mut self, _system: &mut dyn HybridSystem, _stats: &mut Stats) -> bool {
        self.write_dense();
        true
    }
}
