//! The Adams method of variable order and step in the form PECE `[ShampineGordon1975]`. In: a system, lengths
//! of steps; out: steps with their errors and dense output. Uses `integrators`, `numerics`.
//!
//! For equations of second order: differences of the accelerations alone, whose single and double integrals are velocities
//! and positions `[Krogh1974]`.
//!
//! A step costs two evaluations whatever its order: one in the predicted state, which tells the error, and
//! one in the corrected state. Its dense output costs none. After a change of phase the past is of no use; a
//! step of a Runge-Kutta method then supplies the first differences.

pub(super) mod coefficients;
mod differences;
mod start;

use crate::integrators::dense::{DenseStep, Form};
use crate::integrators::rates::{fastest_rate, squares};
use crate::integrators::rosenbrock::{FACTORIZATION, JACOBIAN};
use crate::integrators::tableaus::RODAS5P;
use crate::integrators::{HybridSystem, NextLimits, StateAt, Stats, Stepper};
use crate::numerics::instant::Instant;
use crate::numerics::logarithm::{binary_logarithm, binary_power, power};
use coefficients::{MOST, RECIPROCALS};
use differences::{Differences, LANES};
use start::Start;

/// Accelerations that the first step supplies, at equal distances in it: the order of the next one.
/// Half, twice: work +8, +4 % (100 of 125 runs).
const STARTING: usize = 4;
/// Failures in a row after which the past is forgotten. Half, twice: work +17, -2 % (107 of 146 runs).
const FAILURES: u32 = 2;
/// Largest growth of a step. Twice: work -1 % (97 of 150 runs); at half of it no step grows.
const LARGEST_GROWTH: f64 = 2.0;
/// Stability limit of the step times the frequency of an oscillation, for orders up to 9.
/// Half, twice: work +2, +2 % (71 of 124 runs).
const STABLE: f64 = 1.0;
/// A force that follows the velocity looks like an oscillation of 1 / h at a fraction of that rate, and is
/// stable for longer. So after as many steps at the limit it is raised by a factor, and if a step fails
/// thereafter, it is what it was and the next trial comes after twice as many steps.
/// Half, twice: work -1, +1 %; never: +2 % (144 of 451 runs).
const PATIENCE: [u32; 2] = [8, 256];
/// 1.13 and 1.38: work -2, 0 %, errors times 0.83, 0.94 (230 of 304 runs).
const RAISE: f64 = 1.25;
/// The start goes on while its error is below this, no attempt fails and the bound of the system leaves room, so that
/// its steps grow fivefold. Where an attempt has failed, stability limits them; at the bound, a step of the start costs
/// more than one of the method.
/// Half, twice: work +1, 0 %; never: -4 %, errors times 1.07; always: +63 % (350 of 448 runs).
const FAR_BELOW: f64 = 1e-4;
/// Factor on the error estimate of the start. Its embedded error is close to the error, while that of an Adams
/// step is the whole last difference, some hundred times the error; with equal tolerances the starts made
/// 98 % of the error of the energy of slider-cranks at rtol 1e-3, and 2.5 times as many events at 1e-1. 10 and
/// 100 need as many evaluations for equal errors. Half, twice: work +2, +1 % (85 of 128 runs).
const START_CAUTION: f64 = 30.0;
/// No step is as stiff: it would not be stable. A larger ratio of the differences is noise of the
/// accelerations. Half, twice: work +35, +8 %, errors times 1.8, 1 (53 of 141 runs).
const LARGEST_STIFFNESS: f64 = 2.5;
/// A lower order is taken if its steps may be longer by this factor.
/// Half and twice of its logarithm: work -1, +10 %, errors times 1.1, 0.8 (380 of 424 runs).
const CLEARLY_LONGER: f64 = 1.1;
/// Its binary logarithm.
const CLEARLY: f64 = binary_logarithm(CLEARLY_LONGER);
/// Growth of a step that pays for one of Rodas5P: the ratio of their work.
const PAYING: f64 = (RODAS5P.stages as f64 + JACOBIAN + FACTORIZATION) / Adams::WORK;

/// The method with its scratch memory.
#[derive(Clone, Debug)]
pub struct Adams {
    d: usize,
    differences: Differences,
    start: Start,
    /// Order of the predictor in the next attempt; that of the solution is one higher.
    order: usize,
    /// That in the last one.
    taken_order: usize,
    /// Accelerations at the start of the step, and at its end once it has limits.
    a: Vec<f64>,
    /// The state (q, v, a) that was predicted for its end.
    predicted: Vec<f64>,
    /// Accelerations there less the extrapolated ones: the difference number `taken_order`.
    last: Vec<f64>,
    step: DenseStep,
    /// Largest error of the step relative to the tolerances.
    error: f64,
    /// Ratio of the length that the error of the next step alone would allow to that of the last one.
    pub(super) possible_growth: f64,
    /// Reciprocal tolerances of positions and velocities.
    weights: [Vec<f64>; 2],
    /// Error relative to the tolerances that a difference of accelerations tells of, per unit of it, for every
    /// component over the prepared step.
    error_weights: Vec<f64>,
    /// Instant of the state at which [`Stepper::next_limits`] has taken the accelerations into the differences.
    limits: Option<f64>,
    /// Whether the start took the last step.
    started: bool,
    /// Failed attempts in a row.
    failures: u32,
    /// Whether the dense output of the step is complete.
    dense: bool,
    stiffness: Option<f64>,
    /// Present limit of the stiffness, number of steps at it, and after how many it is raised.
    limit: f64,
    held: u32,
    patience: u32,
}

impl Adams {
    /// Evaluations of a step, and of one that starts anew.
    pub(super) const WORK: f64 = 2.0;
    pub(super) const STARTING_WORK: f64 = Start::EVALUATIONS as f64 + 1.0;

    /// The method for `d` degrees of freedom.
    pub fn new(d: usize) -> Self {
        Self {
            d,
            differences: Differences::new(d),
            start: Start::new(2 * d),
            order: STARTING,
            taken_order: STARTING,
            a: vec![0.0; d],
            predicted: vec![0.0; 3 * d],
            last: vec![0.0; d],
            step: DenseStep::new(2 * d, MOST + 1, STARTING, true),
            error: 0.0,
            possible_growth: 1.0,
            weights: [vec![1.0; d], vec![1.0; d]],
            error_weights: vec![0.0; d],
            limits: None,
            started: false,
            failures: 0,
            dense: false,
            stiffness: None,
            limit: STABLE,
            held: 0,
            patience: PATIENCE[0],
        }
    }

    /// Length of the last step times the fastest rate of the motion [-], by the differences between the predicted and the
    /// corrected state at its end; zero where they are noise. `None` after the first step.
    pub fn stiffness(&self) -> Option<f64> {
        self.stiffness
    }

    /// Error of positions and velocities that a difference of accelerations tells of, per unit of it.
    ///
    /// The asymptotic error is a small part of the last difference, but relies on differences that fall with
    /// their order, which they do not where friction changes within a few steps. The whole difference gives
    /// the errors of DOP853 at the same tolerance.
    fn error_factors(&self) -> [f64; 2] {
        let [position, velocity] = self.differences.correction(self.taken_order);
        let h = self.step.h;
        [h * position / velocity, h]
    }

    /// Computes the weights of [`Adams::error_of`] for the prepared step.
    #[inline(always)]
    fn weigh_errors(&mut self, d: usize, [of_position, of_velocity]: [f64; 2]) {
        let [positions, velocities] = &self.weights;
        for (error_weight, (position, velocity)) in
            self.error_weights[..d].iter_mut().zip(positions[..d].iter().zip(&velocities[..d]))
        {
            *error_weight = (of_velocity * velocity).max(of_position * position);
        }
    }

    /// Largest error relative to the tolerances that differences of the components tell of.
    #[inline(always)]
    fn error_of(&self, d: usize, differences: impl Iterator<Item = f64>) -> f64 {
        self.error_weights[..d].iter().zip(differences).fold(0.0, |largest, (weight, difference)| {
            let error = weight * difference.abs();
            // A NaN must not get lost.
            if error > largest || error.is_nan() { error } else { largest }
        })
    }

    /// Predicts the end of the step, evaluates there and corrects; false where something is not finite.
    ///
    /// Inlined with the numbers of degrees of freedom that most mechanisms have, for which its loops are unrolled.
    #[inline(always)]
    fn take(&mut self, d: usize, system: &mut dyn HybridSystem) -> bool {
        let h = self.step.h;
        let order = self.order.min(self.differences.count());
        (self.order, self.taken_order) = (order, order);
        self.differences.prepare(self.step.t, h, order);
        // Slices of the length d, so that the compiler knows that indices are inside.
        let (q_start, v_start) = (&self.step.start[..d], &self.step.start[d..][..d]);
        let (q, rest) = self.predicted[..3 * d].split_at_mut(d);
        let (v, a) = rest.split_at_mut(d);
        let last = &mut self.last[..d];
        for (block, first) in (0..d).step_by(LANES).enumerate() {
            let [positions, velocities, accelerations] = self.differences.extrapolated(d, order, block);
            for (k, lane) in (first..d).zip(0..LANES) {
                q[k] = q_start[k] + (h * v_start[k] + positions[lane]);
                v[k] = v_start[k] + velocities[lane];
                last[k] = accelerations[lane];
            }
        }
        if !system.acceleration(Instant::after(self.step.t, h), q, v, a) {
            return false;
        }
        let [position, velocity] = self.differences.correction(order);
        let (q_end, v_end) = self.step.end[..2 * d].split_at_mut(d);
        for k in 0..d {
            let difference = a[k] - last[k];
            last[k] = difference;
            q_end[k] = q[k] + position * difference;
            v_end[k] = v[k] + velocity * difference;
        }
        let factors = self.error_factors();
        self.weigh_errors(d, factors);
        self.error = self.error_of(d, self.last[..d].iter().copied());
        if self.error > 1.0 && order > 1 {
            // The next attempt takes the lower order if its error would have been smaller.
            let lower =
                self.error_of(d, (0..d).map(|k| self.last[k] + self.differences.continued(order - 1, k)));
            if lower < self.error {
                (self.order, self.error) = (order - 1, lower);
            }
        }
        self.step.embedded_order = self.order;
        let (q_error, v_error) = self.step.error[..2 * d].split_at_mut(d);
        let last = &self.last[..d];
        for k in 0..d {
            let difference =
                if self.order < order { last[k] + self.differences.continued(order - 1, k) } else { last[k] };
            q_error[k] = factors[0] * difference;
            v_error[k] = factors[1] * difference;
        }
        self.step.end[..2 * d].iter().all(|y| y.is_finite())
    }

    /// Takes the step by the start; false where something is not finite.
    fn take_start(&mut self, system: &mut dyn HybridSystem) -> bool {
        let finite = self.start.take(system, &self.a, &mut self.step);
        self.step.error.iter_mut().for_each(|error| *error *= START_CAUTION);
        let [positions, velocities] = &self.weights;
        let scaled = self.step.error.iter().zip(positions.iter().chain(velocities));
        self.error = scaled.map(|(error, weight)| (error * weight).abs()).fold(0.0, f64::max);
        finite
    }

    /// Takes the accelerations in the start and at the end of its step into the differences; returns the
    /// possible growth of an Adams step.
    fn begin_differences(&mut self) -> f64 {
        self.write_dense();
        let parts = (STARTING - 1) as f64;
        let Self { differences, step, a, last, .. } = self;
        differences.begin(step.h / parts, STARTING, last, |index, out| {
            if index + 1 == STARTING { out.copy_from_slice(a) } else { step.rates(index as f64 / parts, out) }
        });
        differences.prepare(step.t, step.h, STARTING);
        (self.order, self.taken_order) = (STARTING, STARTING);
        // Differences at distances of a whole step. The next one is not known: it continues the last two.
        let d = self.d;
        self.weigh_errors(d, self.error_factors());
        let [before, last] = [STARTING - 2, STARTING - 1]
            .map(|i| parts.powi(i as i32) * self.error_of(d, self.differences.row(i).iter().copied()));
        power(last * (last / before).min(1.0), -RECIPROCALS[self.order])
    }

    /// Takes the accelerations at the end of the step into the differences and chooses the order of the next
    /// one; returns its possible growth. Inlined as [`Adams::take`].
    #[inline(always)]
    fn advance(&mut self, d: usize) -> f64 {
        let order = self.taken_order;
        self.measure_stiffness(d);
        // A higher order needs a difference more than are used.
        let highest = if self.differences.count() > order { (order + 1).min(MOST) } else { order };
        let lowest = (order - 1).max(1);
        self.differences.advance(&self.a[..d]);
        let (same, lower) = (self.length_at(d, order), self.length_at(d, lowest));
        let (chosen, length) = if lower > same + CLEARLY {
            (lowest, lower)
        } else if highest > order {
            let higher = self.length_at(d, highest);
            if higher > same { (highest, higher) } else { (order, same) }
        } else {
            (order, same)
        };
        self.order = chosen;
        binary_power(length)
    }

    /// The binary logarithm of the length of steps at an order, relative to the last one.
    #[inline(always)]
    fn length_at(&self, d: usize, order: usize) -> f64 {
        let difference = self.error_of(d, self.differences.row(order)[..d].iter().copied());
        let error = self.differences.at_equal_steps(order) * difference;
        -binary_logarithm(error) * RECIPROCALS[order]
    }

    /// Computes [`Adams::stiffness`] from the accelerations in the predicted and in the corrected state.
    #[inline(always)]
    fn measure_stiffness(&mut self, d: usize) {
        let weights = &self.weights[0][..d];
        let (q, v) = self.step.end[..2 * d].split_at(d);
        let predicted = &self.predicted[2 * d..3 * d];
        let accelerations =
            squares(weights, self.a[..d].iter().zip(predicted).map(|(a, predicted)| a - predicted));
        let corrections = squares(weights, self.last[..d].iter().copied());
        let [position, velocity] = self.differences.correction(self.taken_order);
        let [positions, velocities] = [position, velocity].map(|part| part * part * corrections);
        let stiffness = self.step.h * fastest_rate([accelerations, positions, velocities], weights, (q, v));
        self.stiffness = Some(if stiffness < LARGEST_STIFFNESS { stiffness } else { 0.0 });
    }

    /// Largest growth of the next step within the limit of stability.
    fn stable_growth(&mut self) -> f64 {
        let stiffness = match self.stiffness {
            Some(stiffness) if stiffness > 0.0 => stiffness,
            _ => return LARGEST_GROWTH,
        };
        if self.failures > 0 && self.limit > STABLE {
            (self.limit, self.held) = (STABLE, 0);
            self.patience = (2 * self.patience).min(PATIENCE[1]);
        }
        let growth = self.limit / stiffness;
        if growth < CLEARLY_LONGER && self.possible_growth > RAISE {
            self.held += 1;
            if self.held >= self.patience {
                (self.limit, self.held) = (RAISE * self.limit, 0);
            }
        }
        growth.min(LARGEST_GROWTH)
    }

    /// Completes the dense output, once: the polynomial whose integral the corrector is.
    fn write_dense(&mut self) {
        if std::mem::replace(&mut self.dense, true) {
            return;
        }
        if self.started {
            self.start.finish_dense(&mut self.step);
            return;
        }
        let Self { d, taken_order: order, .. } = *self;
        self.step.form = Form::Differences(*self.differences.alpha());
        self.step.rows.resize((order + 1) * d, 0.0);
        // At least 1: without a degree of freedom there are no chunks of length zero.
        let (rows, last) = self.step.rows.split_at_mut(order * d);
        for (i, row) in rows.chunks_exact_mut(d.max(1)).enumerate() {
            self.differences.write_continued(i, row);
        }
        last.copy_from_slice(&self.last);
    }
}

impl Stepper for Adams {
    fn restart(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        // The next step starts anew.
        self.limits = None;
        (self.limit, self.held, self.patience) = (STABLE, 0, PATIENCE[0]);
        for (weights, tolerances) in self.weights.iter_mut().zip([position_tolerance, velocity_tolerance]) {
            for (weight, tolerance) in weights.iter_mut().zip(tolerances) {
                *weight = 1.0 / tolerance;
            }
        }
    }

    fn begin(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool {
        let StateAt { t, q, v } = at;
        self.step.t = t;
        self.failures = 0;
        self.step.start[..self.d].copy_from_slice(q);
        self.step.start[self.d..].copy_from_slice(v);
        if self.limits.take() != Some(t) {
            self.differences.clear();
            stats.evaluations += 1;
            if !system.acceleration(t.into(), q, v, &mut self.a) {
                return false;
            }
        }
        system.begin(t, q, v, &self.a);
        true
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        self.step.h = h;
        self.dense = false;
        if self.failures >= FAILURES {
            self.differences.clear();
        }
        self.started = self.differences.count() == 0;
        self.step.is_short = !self.started;
        let evaluations = if self.started { Start::EVALUATIONS } else { 1 };
        stats.stages += evaluations;
        stats.evaluations += evaluations;
        match self.d {
            _ if self.started => self.take_start(system),
            1 => self.take(1, system),
            2 => self.take(2, system),
            d => self.take(d, system),
        }
    }

    fn reject(&mut self, _next: f64, _stats: &Stats) -> Option<f64> {
        self.failures += 1;
        None
    }

    fn step(&mut self) -> &mut DenseStep {
        &mut self.step
    }

    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        self.write_dense();
        self.step.at(theta, q, v);
    }

    fn nodes(&self) -> &'static [f64] {
        &[]
    }

    fn finish_dense(&mut self, _system: &mut dyn HybridSystem, _stats: &mut Stats) -> bool {
        self.write_dense();
        true
    }

    fn next_limits(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> NextLimits {
        let StateAt { t, q, v } = at;
        self.stiffness = None;
        stats.stages += 1;
        stats.evaluations += 1;
        if !system.acceleration(t.into(), q, v, &mut self.a) {
            return NextLimits::UNLIMITED;
        }
        self.limits = Some(t);
        if t >= system.next_break() {
            // What was before a break of a driven motion or a force says nothing of what comes.
            self.differences.clear();
            return NextLimits::UNLIMITED;
        }
        let has_room = LARGEST_GROWTH * self.step.h < system.step_bound();
        if self.started && self.error < FAR_BELOW && self.failures == 0 && has_room {
            self.differences.clear();
            return NextLimits::UNLIMITED;
        }
        self.possible_growth = match self.d {
            _ if self.started => self.begin_differences(),
            1 => self.advance(1),
            2 => self.advance(2),
            d => self.advance(d),
        };
        self.step.embedded_order = self.order;
        let largest_growth = self.stable_growth();
        if largest_growth < CLEARLY_LONGER && self.possible_growth > PAYING {
            stats.limited += 1;
            stats.enough += PAYING / self.possible_growth;
        }
        NextLimits { largest_growth, possible_growth: Some(self.possible_growth) }
    }
}
