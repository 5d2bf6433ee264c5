//! Events: zeros of guard functions inside a step.
//!
//! A guard is positive while the present phase lasts. Three cases need care:
//! a guard that is negative only inside the step (found by interior samples, then by the minimum between a
//! falling and a rising sample), a guard that is zero to rounding because an event has just
//! happened on it (it counts as crossed only below minus its resolution), and several guards
//! in one step (the earliest is located, the others are tested where the step ends).

use crate::integrators::control::Failure;
use crate::integrators::dense::DenseStep;
use crate::integrators::{HybridSystem, Status};
use crate::numerics::accuracy::{ROUNDING, SEARCH_STEPS};
use crate::numerics::extremum::highest_within;

/// Value of a guard function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guard {
    /// Positive while the phase lasts.
    pub value: f64,
    /// Its rate; NaN where it is not known.
    pub rate: f64,
    /// Where the rate is not known: values below this need a search inside the step, besides what the change
    /// of the value over the step asks for.
    pub margin: f64,
    /// Size of its rounding errors: closer to zero its sign is undetermined.
    pub resolution: f64,
    /// Largest distance below zero at which a step may end on the event.
    pub overshoot: f64,
}

impl Guard {
    /// A guard that is not watched in the present phase.
    pub const INACTIVE: Guard =
        Guard { value: f64::INFINITY, rate: 0.0, margin: 0.0, resolution: 0.0, overshoot: f64::INFINITY };

    fn is_crossed(&self) -> bool {
        self.value < -self.resolution
    }
}

/// The guards are sampled at every PIECES-th part of the step. With the test of the rates at the samples,
/// only two extrema within one piece can be missed. Half, twice: the same work (43 of 102 runs).
const PIECES: usize = 8;
/// The same in a step that is short against every oscillation of the motion.
/// Twice: work +1 %, same errors (92 of 106 runs).
const PIECES_OF_SHORT: usize = 2;

/// Finds events on steps; owns the scratch memory.
#[derive(Clone, Debug)]
pub(super) struct EventFinder {
    /// Guards at the start of the step, at its interior samples and at its end.
    samples: Vec<Guard>,
    /// Parts of the step between them.
    pieces: usize,
    count: usize,
    q: Vec<f64>,
    v: Vec<f64>,
    trial: Vec<Guard>,
}

/// A step whose dense output is finished, on which events are looked for.
struct Search<'a> {
    finder: &'a mut EventFinder,
    system: &'a mut dyn HybridSystem,
    step: &'a DenseStep,
}

impl EventFinder {
    /// A finder for `count` guards and `d` degrees of freedom.
    pub(super) fn new(count: usize, d: usize) -> Self {
        Self {
            samples: vec![Guard::INACTIVE; (PIECES + 1) * count],
            pieces: PIECES,
            count,
            q: vec![0.0; d],
            v: vec![0.0; d],
            trial: vec![Guard::INACTIVE; count],
        }
    }

    /// Whether an event in a step of length `h` is possible, judged by the guards at its ends.
    ///
    /// The cubic through the values and rates at the ends falls at most 4/27 h (|g'₀| + |g'₁|) below the
    /// lower end. An event is excluded only if both values exceed h max(|g'₀|, |g'₁|), more than three times
    /// that. A guard of unknown rate must exceed its change over the step plus its margin. A guard that is exactly zero
    /// at both ends, and has no rate there, watches what does not move: searched in every step, it cost a run the
    /// tenfold time.
    pub(super) fn may_have_event(h: f64, start: &[Guard], end: &[Guard]) -> bool {
        start.iter().zip(end).any(|(a, b)| {
            let margin = h * a.rate.abs().max(b.rate.abs());
            let margin = if margin.is_nan() { (a.value - b.value).abs() + a.margin } else { margin };
            let at_rest =
                [a, b].iter().all(|guard| guard.value == 0.0 && (guard.rate == 0.0 || guard.rate.is_nan()));
            let clear = a.value > margin && b.value > margin || at_rest;
            // True also where a value is not a number.
            !clear
        })
    }

    /// The guard of the earliest event on a step, whose dense output must be finished, and the part of the step up to it.
    pub(super) fn earliest(
        &mut self,
        system: &mut dyn HybridSystem,
        step: &DenseStep,
        start: &[Guard],
        end: &[Guard],
    ) -> Result<Option<(usize, f64)>, Failure> {
        let count = self.count;
        let pieces = if step.is_short { PIECES_OF_SHORT } else { PIECES };
        self.pieces = pieces;
        self.samples[..count].copy_from_slice(start);
        for piece in 1..pieces {
            let theta = piece as f64 / pieces as f64;
            step.corrected_at(system, theta, &mut self.q, &mut self.v);
            let range = piece * count..(piece + 1) * count;
            system.guards(step.instant(theta), &self.q, &self.v, &mut self.samples[range]);
        }
        self.samples[pieces * count..(pieces + 1) * count].copy_from_slice(end);
        let mut search = Search { finder: self, system, step };
        let mut first: Option<(usize, f64)> = None;
        for index in 0..count {
            if let Some(theta) = search.root_of(index)?
                && first.is_none_or(|(_, known)| theta < known)
            {
                first = Some((index, theta));
            }
        }
        Ok(first)
    }

    /// Whether a guard may have a negative minimum inside a piece: it falls at its start and rises at its
    /// end. Where the rate is unknown, it is that of the parabolas through neighboring samples, and their
    /// minimum must reach zero.
    fn may_have_minimum(&self, piece: usize, index: usize) -> bool {
        let guard = |sample: usize| self.samples[sample * self.count + index];
        let (left, right) = (guard(piece), guard(piece + 1));
        if !left.rate.is_nan() && !right.rate.is_nan() {
            return left.rate < 0.0 && right.rate > 0.0;
        }
        // Slope at a sample and second difference, in the spacing of the samples.
        let parabola = |sample: usize| {
            let middle = sample.clamp(1, self.pieces - 1);
            let [a, b, c] = [middle - 1, middle, middle + 1].map(|sample| guard(sample).value);
            let curvature = a - 2.0 * b + c;
            (0.5 * (c - a) + curvature * (sample as f64 - middle as f64), curvature)
        };
        let ((falls, first), (rises, second)) = (parabola(piece), parabola(piece + 1));
        // The minimum of a parabola lies at most an eighth of its second difference below the lower end;
        // the test allows eight times that.
        falls <= 0.0 && rises >= 0.0 && left.value.min(right.value) <= first.max(second)
    }
}

impl Search<'_> {
    fn root_of(&mut self, index: usize) -> Result<Option<f64>, Failure> {
        let EventFinder { pieces, count, .. } = *self.finder;
        for piece in 0..pieces {
            let left = self.finder.samples[piece * count + index];
            let right = self.finder.samples[(piece + 1) * count + index];
            if left.value.is_nan() || right.value.is_nan() {
                return Err((Status::EventLocation, Some(index)));
            }
            let [mut a, mut b] = [piece, piece + 1].map(|sample| sample as f64 / pieces as f64);
            let mut bracketed = right.is_crossed();
            if !bracketed && self.finder.may_have_minimum(piece, index) {
                let (theta, lowest) = self.minimum(index, a, b);
                bracketed = lowest.is_crossed();
                if bracketed {
                    b = theta;
                }
            }
            if !bracketed {
                continue;
            }
            let mut value_a = left.value;
            if value_a <= 0.0 {
                if left.rate <= 0.0 {
                    return Ok(Some(a));
                }
                // The guard is zero to rounding after an event, rises (or has an unknown rate), and has
                // fallen again before b: bisect toward a until the guard is positive.
                let mut width = b - a;
                for _ in 0..SEARCH_STEPS {
                    width *= 0.5;
                    let guard = self.evaluate(index, a + width);
                    if guard.value > 0.0 {
                        (a, value_a) = (a + width, guard.value);
                        break;
                    }
                    b = a + width;
                }
                if value_a <= 0.0 {
                    return Ok(Some(a));
                }
            }
            return self.illinois(index, a, value_a, b).map(Some);
        }
        Ok(None)
    }

    fn evaluate(&mut self, index: usize, theta: f64) -> Guard {
        let Self { finder, system, step } = self;
        step.corrected_at(*system, theta, &mut finder.q, &mut finder.v);
        system.guards(step.instant(theta), &finder.q, &finder.v, &mut finder.trial);
        finder.trial[index]
    }

    /// Minimum between a falling and a rising end, by bisection on the rate; stops at the first crossed
    /// value.
    fn minimum(&mut self, index: usize, mut a: f64, mut b: f64) -> (f64, Guard) {
        let mut lowest = (b, Guard::INACTIVE);
        for _ in 0..SEARCH_STEPS {
            let theta = 0.5 * (a + b);
            let guard = self.evaluate(index, theta);
            if guard.value < lowest.1.value {
                lowest = (theta, guard);
            }
            if guard.is_crossed() || !(theta > a && theta < b) {
                break;
            }
            if guard.rate.is_nan() {
                let depth = |theta: f64| -self.evaluate(index, theta).value;
                let (theta, _) = highest_within([a, b], (theta, -guard.value), depth);
                return (theta, self.evaluate(index, theta));
            }
            if guard.rate < 0.0 { a = theta } else { b = theta }
        }
        lowest
    }

    /// Root between `a` (value > 0) and `b` (value < 0): the Illinois variant of regula falsi,
    /// with bisection whenever it fails to halve the bracket in three steps.
    fn illinois(&mut self, index: usize, mut a: f64, mut value_a: f64, mut b: f64) -> Result<f64, Failure> {
        let mut value_b = self.evaluate(index, b).value;
        let tolerance = ROUNDING * (self.step.t.abs() + self.step.h) / self.step.h;
        let mut side = 0;
        let mut width = b - a;
        for iteration in 0..SEARCH_STEPS {
            if b - a <= tolerance {
                break;
            }
            let bisect = iteration % 3 == 2 && b - a > 0.5 * width;
            if iteration % 3 == 2 {
                width = b - a;
            }
            let secant = b - value_b * (b - a) / (value_b - value_a);
            let theta = if bisect || !(secant > a && secant < b) { 0.5 * (a + b) } else { secant };
            let value = self.evaluate(index, theta).value;
            if value.is_nan() {
                return Err((Status::EventLocation, Some(index)));
            }
            // Signs are compared as signs: a product of tiny values would underflow.
            if value > 0.0 {
                (a, value_a) = (theta, value);
                if side == 1 {
                    value_b *= 0.5;
                }
                side = 1;
            } else {
                (b, value_b) = (theta, value);
                if value == 0.0 {
                    break;
                }
                if side == -1 {
                    value_a *= 0.5;
                }
                side = -1;
            }
        }
        Ok(b)
    }
}
