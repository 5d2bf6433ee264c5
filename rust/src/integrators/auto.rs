//! The Adams method and a Rosenbrock method, switched by what limits the steps.
//!
//! The stiffness of a step is its length times the fastest rate of the motion. Adams steps are stable up to a
//! stiffness of about 1 and cost two evaluations, a Rosenbrock step four times as much. While a contact
//! oscillates, its accuracy needs steps of about that length with any method, so the Adams method is the
//! cheapest. The friction of a sticking contact damps velocities at a rate of 1e5 to 1e8 1/s: there accuracy
//! allows steps many times longer, and stability does not. The error estimate of an Adams step at its limit
//! tells that longer ones may be as accurate, but not what limits them: the corrections of positions and
//! velocities are in proportion. The Jacobian tells damping and oscillation apart.

use crate::integrators::adams::Adams;
use crate::integrators::dense::DenseStep;
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, NextLimits, StateAt, Stats, Stepper};

/// Stiffness from which an Adams step counts as limited by stability.
/// 0.5 and 1: work -1, -2 %, same errors (70 of 413 runs).
const STIFF: f64 = 0.8;
/// Growth that the error of a step at the limit would allow, from which the Jacobian is asked. 2 to 3 need
/// the same work. Half, twice: work +5, -6 % (88 of 108 runs).
const LONGER: f64 = 3.0;
/// The same from which the Rosenbrock method is tried without asking: an oscillation that is hardly excited.
/// 12 costs slider-cranks as printed 8 % more work at an error of 1e-2.
/// Half, twice: work -33, +57 % in 25 and 15 of 234 runs.
const MUCH_LONGER: f64 = 30.0;
/// Least share of damping in the fastest rate for the Rosenbrock method. 0.3 and 0.5 need the same work.
/// 0.3, 0.75: work -6, +2 % (47 of 224 runs).
const DAMPED: f64 = 0.5;
/// Stiffness of a Rosenbrock step, by the norms of its Jacobian, below which the Adams method returns. 2 to 6
/// are alike over the classes of `benchmarks/stiffness.rs`; with 4 a pendulum that rests in its bearing
/// needs 1.5 times the work of 5. Half, twice: work +2, -3 % (46 of 81 runs).
const NOT_STIFF: f64 = 5.0;
/// Consecutive steps that must agree on a switch. With one, the methods alternate.
/// Half, twice: work +7, -3 % (331 of 437 runs).
const PERSISTENCE: u32 = 2;
/// A Rosenbrock method that is left within so many steps was no gain. Half, twice: work 0, -4 % (10 of 92 runs).
const SHORT_STAY: u32 = 10;
/// Steps without a switch after the Rosenbrock method was no gain or the Jacobian showed no damping; doubled
/// with every repetition until the Rosenbrock method is kept. Without this pause, methods of equal cost
/// alternate every few steps. Half, twice: work -9, -8 %, errors times 0.58, 0.73 (20 of 136 runs).
const PAUSE: u32 = 20;
/// The Adams method and a Rosenbrock method, one of them active.
#[derive(Clone, Debug)]
pub struct Auto {
    explicit: Adams,
    implicit: Rosenbrock,
    /// Whether the next step is implicit.
    is_implicit: bool,
    /// Accepted steps since the last switch.
    steps: u32,
    /// Consecutive last steps that favored the other method.
    contradictions: u32,
    /// Remaining steps of the present pause, in which no switch is considered.
    pause: u32,
    /// Length of the next pause.
    next_pause: u32,
}

impl Auto {
    /// The Adams method and the Rosenbrock method of a tableau, for `d` degrees of freedom; the first step is
    /// explicit.
    pub fn new(tableau: Tableau, d: usize) -> Self {
        Self {
            explicit: Adams::new(d),
            implicit: Rosenbrock::new(tableau, d),
            is_implicit: false,
            steps: 0,
            contradictions: 0,
            pause: 0,
            next_pause: PAUSE,
        }
    }

    fn active(&mut self) -> &mut dyn Stepper {
        if self.is_implicit { &mut self.implicit } else { &mut self.explicit }
    }

    /// Starts a pause, twice as long as the previous one.
    fn pause(&mut self) {
        self.pause = self.next_pause;
        self.next_pause = self.next_pause.saturating_mul(2);
    }

    /// Whether the other method takes the next step, after a step to a state.
    fn switches(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool {
        self.steps = self.steps.saturating_add(1);
        if self.pause > 0 {
            self.pause -= 1;
            return false;
        }
        let contradicts = if self.is_implicit {
            self.implicit.stiffness() < NOT_STIFF
        } else {
            let stiffness = self.explicit.stiffness();
            stiffness.is_some_and(|stiffness| stiffness > STIFF) && self.explicit.possible_growth > LONGER
        };
        self.contradictions = if contradicts { self.contradictions + 1 } else { 0 };
        if self.contradictions < PERSISTENCE {
            return false;
        }
        self.contradictions = 0;
        if self.is_implicit {
            if self.steps <= SHORT_STAY {
                self.pause();
            } else {
                self.next_pause = PAUSE;
            }
        } else if self.explicit.possible_growth < MUCH_LONGER {
            let damped = self.implicit.linearize(system, at, stats)
                && self.implicit.damping() > DAMPED * self.implicit.rate();
            if !damped {
                self.pause();
                return false;
            }
        }
        self.steps = 0;
        self.is_implicit = !self.is_implicit;
        true
    }
}

impl Stepper for Auto {
    fn restart(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        self.explicit.restart(position_tolerance, velocity_tolerance);
        self.implicit.restart(position_tolerance, velocity_tolerance);
        (self.contradictions, self.pause) = (0, 0);
    }

    fn begin(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool {
        self.active().begin(system, at, stats)
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        self.active().attempt(system, h, stats)
    }

    fn reject(&mut self) {
        self.active().reject();
    }

    fn step(&mut self) -> &mut DenseStep {
        // Not through `active`: every step asks several times.
        if self.is_implicit { self.implicit.step() } else { self.explicit.step() }
    }

    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        self.active().estimate_inside(theta, q, v);
    }

    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool {
        self.active().finish_dense(system, stats)
    }

    fn next_limits(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> NextLimits {
        let limits = self.active().next_limits(system, at, stats);
        match (self.switches(system, at, stats), self.is_implicit) {
            (false, _) => limits,
            (true, true) => NextLimits { switched: true, ..NextLimits::UNLIMITED },
            // The first step of the Adams method is stable at the present length and not far beyond.
            (true, false) => NextLimits { largest_growth: 1.0, switched: true, possible_growth: None },
        }
    }
}
