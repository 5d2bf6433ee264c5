//! The explicit Runge-Kutta method DOP853 of Hairer, Norsett and Wanner, order 8(5,3)
//! `[HairerNorsettWanner1993]`.
//!
//! The error estimate is that of the authors with a second combination of order 5 added to theirs, so that it
//! does not vanish by chance where a step crosses a kink of the friction law or a change of contact.
//!
//! The method needs no Jacobian and solves no linear equations. While no contact sticks it reaches the
//! accuracy of a Rosenbrock method with a fraction of the work. Sticking friction is stiff; there stability
//! limits the steps, which costs time but not accuracy.

use crate::integrators::dense::DenseStep;
use crate::integrators::dop853_coefficients::{A, C, D, E3, E5, E5_OTHER, SLOPES, STAGES};
use crate::integrators::rates::{fastest_rate, squares};
use crate::integrators::stages::{Stages, Weights};
use crate::integrators::{HybridSystem, NextLimits, StateAt, Stats, Stepper};
use crate::numerics::instant::Instant;

/// Stability limit of the step times the fastest rate: 6.3 on the negative real axis (damping), 5.9 on the
/// imaginary axis (oscillation). Half, twice: work +1, +1 % (35 of 122 runs).
const STABLE: f64 = 5.9;

/// The first slope after that at the start with a weight in the solution.
const WEIGHTED: usize = 5;
/// Instants of the slopes.
static INSTANTS: [f64; SLOPES] = C;
/// Weights of the slopes before each one.
static ROWS: [Weights; SLOPES] = {
    let mut rows = [Weights::sparse(&[]); SLOPES];
    let mut stage = 0;
    while stage < SLOPES {
        rows[stage] = Weights::sparse(A[stage]);
        stage += 1;
    }
    rows
};
/// Weights of the error estimates: two of order 5 and one of order 3.
const ESTIMATES: [Weights; 3] = [Weights::sparse(&E5), Weights::sparse(&E5_OTHER), Weights::sparse(&E3)];

/// The method with its scratch memory.
#[derive(Clone, Debug)]
pub struct Dop853 {
    d: usize,
    /// Slopes (v, a).
    slopes: Stages,
    argument: Vec<f64>,
    step: DenseStep,
    /// State of the last stage, which like the solution belongs to the end of the step.
    last_argument: Vec<f64>,
    /// Reciprocal tolerances of the components of the state.
    weights: Vec<f64>,
    /// Whether the slope at the end of the last step holds in the present phase.
    end_slope_holds: bool,
}

impl Dop853 {
    /// The method for `d` degrees of freedom.
    pub fn new(d: usize) -> Self {
        let n = 2 * d;
        Self {
            d,
            slopes: Stages::new(SLOPES, n),
            argument: vec![0.0; n],
            // The estimate combines those of orders 5 and 3; it is proportional to the eighth power of the
            // step.
            step: DenseStep::new(n, 6, 7, true),
            last_argument: vec![0.0; n],
            weights: vec![1.0; n],
            end_slope_holds: false,
        }
    }

    /// Length of the last step times the fastest rate of the motion [-], by the differences between the last stage and the
    /// solution, which both belong to the end of the step.
    pub fn stiffness(&self) -> f64 {
        let (weights, end, d) = (&self.weights[..self.d], self.step.end.split_at(self.d), self.d);
        let (last_q, last_v) = self.last_argument.split_at(d);
        let (end_a, last_a) = (&self.slopes.row(STAGES)[d..], &self.slopes.row(STAGES - 1)[d..]);
        let differences = [(end_a, last_a), (end.0, last_q), (end.1, last_v)]
            .map(|(end, last)| squares(weights, end.iter().zip(last).map(|(end, last)| end - last)));
        self.step.h * fastest_rate(differences, weights, end)
    }

    /// Evaluates the slope number `stage` from the ones before it.
    fn evaluate(&mut self, system: &mut dyn HybridSystem, stage: usize, stats: &mut Stats) -> bool {
        let d = self.d;
        let h = self.step.h;
        self.slopes.advance_by(&self.step.start, h, ROWS[stage], &mut self.argument);
        stats.evaluations += 1;
        let (q, v) = self.argument.split_at(d);
        let (slope_q, slope_v) = self.slopes.row_mut(stage).split_at_mut(d);
        slope_q.copy_from_slice(v);
        system.acceleration(Instant::after(self.step.t, C[stage] * h), q, v, slope_v)
    }
}

impl Stepper for Dop853 {
    fn restart(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        // The forces change with the phase, so the last slope does not hold.
        self.end_slope_holds = false;
        let tolerances = position_tolerance.iter().chain(velocity_tolerance);
        for (weight, tolerance) in self.weights.iter_mut().zip(tolerances) {
            *weight = 1.0 / tolerance;
        }
    }

    fn begin(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool {
        let StateAt { t, q, v } = at;
        // Where the last step ended in this state and phase, its last slope is the first of the next one.
        let ended_here = self.step.instant(1.0) == t.into() && self.step.end.split_at(self.d) == (q, v);
        let known = self.end_slope_holds && ended_here;
        self.step.t = t;
        self.step.start[..self.d].copy_from_slice(q);
        self.step.start[self.d..].copy_from_slice(v);
        if known {
            self.slopes.copy_row(STAGES, 0);
        } else {
            stats.evaluations += 1;
            let (slope_q, slope_v) = self.slopes.row_mut(0).split_at_mut(self.d);
            slope_q.copy_from_slice(v);
            if !system.acceleration(t.into(), q, v, slope_v) {
                return false;
            }
        }
        system.begin(t, q, v, &self.slopes.row_mut(0)[self.d..]);
        true
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        self.step.h = h;
        self.end_slope_holds = false;
        stats.stages += STAGES;
        // Row 12 of A holds the weights of the solution.
        for stage in 1..=STAGES {
            if !self.evaluate(system, stage, stats) {
                return false;
            }
            if stage == STAGES - 1 {
                self.last_argument.copy_from_slice(&self.argument);
            }
        }
        self.step.end.copy_from_slice(&self.argument);
        self.slopes.combine_all(ESTIMATES, &mut self.step.error, |[fifth, other, third]| {
            let square = fifth * fifth + other * other;
            let size = (square + 0.01 * third * third).sqrt();
            if size > 0.0 { h * square / size } else { 0.0 * size }
        });
        self.end_slope_holds = self.step.end.iter().all(|y| y.is_finite());
        self.end_slope_holds
    }

    fn step(&mut self) -> &mut DenseStep {
        &mut self.step
    }

    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        // The cubic Hermite interpolant of both ends; the full dense output costs three evaluations.
        let (h, rest) = (self.step.h, 1.0 - theta);
        let ends = self.step.start.iter().zip(&self.step.end);
        let slopes = self.slopes.row(0).iter().zip(self.slopes.row(STAGES));
        for (inside, ((start, end), (first, last))) in self.argument.iter_mut().zip(ends.zip(slopes)) {
            let change = end - start;
            let bend = rest * (h * first - change) - theta * (h * last - change);
            *inside = rest * start + theta * end + theta * rest * bend;
        }
        let (inside_q, inside_v) = self.argument.split_at(self.d);
        q.copy_from_slice(inside_q);
        v.copy_from_slice(inside_v);
    }

    fn nodes(&self) -> &'static [f64] {
        // The slopes between have no weight in the solution and in the estimates of its error.
        &INSTANTS[WEIGHTED..STAGES]
    }

    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool {
        for stage in STAGES + 1..SLOPES {
            if !self.evaluate(system, stage, stats) {
                return false;
            }
        }
        let n = 2 * self.d;
        let h = self.step.h;
        for (weights, row) in D.iter().zip(self.step.rows.chunks_exact_mut(n.max(1))) {
            self.slopes.combine_all([Weights::sparse(weights)], row, |[sum]| h * sum);
        }
        for k in 0..n {
            let change = self.step.end[k] - self.step.start[k];
            let slope = |stage: usize| self.slopes.at(stage, k);
            let f1 = h * slope(0) - change;
            let f2 = 2.0 * change - h * (slope(STAGES) + slope(0));
            let [f3, f4, f5, f6] = [0, 1, 2, 3].map(|row| self.step.rows[row * n + k]);
            // Hairer's nested form, rewritten in the powers that all methods share.
            let rows = [f1, f2 + f3, f4 + f5 - f3, f6 - 2.0 * f5 - f4, f5 - 2.0 * f6, f6];
            for (row, value) in rows.into_iter().enumerate() {
                self.step.rows[row * n + k] = value;
            }
        }
        true
    }

    fn next_limits(
        &mut self,
        _system: &mut dyn HybridSystem,
        _at: StateAt,
        _stats: &mut Stats,
    ) -> NextLimits {
        let stiffness = self.stiffness();
        let largest_growth = if stiffness > 0.0 { STABLE / stiffness } else { f64::INFINITY };
        NextLimits { largest_growth, ..NextLimits::UNLIMITED }
    }
}
