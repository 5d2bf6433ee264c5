//! DOP853 and a Rosenbrock method, switched by the stiffness of the motion.
//!
//! The stiffness of a step is its length times the fastest rate of the motion. Free flight and sliding
//! contacts are not stiff; there the explicit method needs the least work for an accuracy. A sticking contact
//! is stiff: its friction damps velocities at a rate of 1e5 to 1e8 1/s, and stability limits the steps of the
//! explicit method.
//!
//! At a loose tolerance the explicit method follows the oscillation of a contact with steps of several
//! radians, where its high order gains nothing. The Rosenbrock method costs less per step and may take steps
//! nearly as long, so it is tried and kept while its steps are long enough. At a tight tolerance steps are
//! shorter and this case does not occur.
//!
//! In a slow, lightly loaded mechanism the penetration of a resting contact is not far above the rounding
//! errors of the positions. The contact stiffness turns these into noise of the accelerations. The weights of
//! the explicit method, up to 6, amplify it, so that it fills the error estimate at steps of 1 or 2 divided
//! by the frequency. The Rosenbrock method takes steps two to five times as long, so it takes over there as
//! well, if the Jacobian confirms that noise.

use crate::integrators::dense::DenseStep;
use crate::integrators::dop853::Dop853;
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, Settled, Stats, Stepper};

/// Stiffness of a step (its length times the fastest rate of the motion) from which the Rosenbrock method is
/// tried, and below which the explicit method returns. A Rosenbrock step takes two thirds of the evaluations,
/// Jacobian included, so it may be two thirds as long; the explicit method is stable up to about 6. Tuned on
/// slider-cranks, four-bar, six-bar, quick return, pendulum and journals at rtol 1e-2 to 1e-8: thresholds of
/// 5 and 4 cost up to 46 % more at 1e-2 and 26 % at 1e-3, 2 and 1.4 up to 5 % more at 1e-5.
const STIFF: f64 = 2.5;
const NOT_STIFF: f64 = STIFF * 2.0 / 3.0;
/// Change of the velocities within a step by the rounding of the positions, estimated from the Jacobian and
/// relative to the tolerance, from which the Rosenbrock method is taken. Tuned on the paper's slider-crank at
/// 0.003 to 3 r/min in both conventions: from 0.001 on auto takes the Rosenbrock method where that is
/// cheaper; 0.005 misses that at 0.1 r/min, for a quarter more work.
const NOISY: f64 = 0.002;
/// Consecutive steps that must agree on a switch. With one, the methods alternate; 2 to 4 perform alike.
const PERSISTENCE: u32 = 2;
/// Steps without a switch to the Rosenbrock method after it was kept for no more than these, or after the
/// Jacobian did not confirm the noise; doubled with every repetition in a phase. Without this pause, methods
/// of equal cost alternate every few steps, at a loss of up to 80 %.
const PAUSE: u32 = 10;
const LONGEST_PAUSE: u32 = 80;

/// History of the steps before the present one.
#[derive(Clone, Copy, Debug, Default)]
struct Memory {
    /// Whether the next step is implicit.
    implicit: bool,
    /// Accepted steps since the last switch.
    steps: u32,
    /// Consecutive last steps whose stiffness favored the other method.
    contradictions: u32,
    /// Remaining steps of the present pause, in which no switch is considered.
    pause: u32,
    /// Length of the next pause.
    next_pause: u32,
}

/// DOP853 and a Rosenbrock method, one of them active.
#[derive(Clone, Debug)]
pub struct Auto {
    explicit: Dop853,
    implicit: Rosenbrock,
    memory: Memory,
}

impl Auto {
    /// DOP853 and the Rosenbrock method of a tableau, for `d` degrees of freedom; the first step is
    /// explicit.
    pub fn new(tableau: Tableau, d: usize) -> Self {
        Self {
            explicit: Dop853::new(d),
            implicit: Rosenbrock::new(tableau, d),
            memory: Memory { next_pause: PAUSE, ..Memory::default() },
        }
    }

    fn active(&mut self) -> &mut dyn Stepper {
        if self.memory.implicit { &mut self.implicit } else { &mut self.explicit }
    }

    /// Starts a pause, twice as long as the previous one in this phase.
    fn pause(&mut self) {
        self.memory.pause = self.memory.next_pause;
        self.memory.next_pause = (2 * self.memory.next_pause).min(LONGEST_PAUSE);
    }

    /// Whether the other method takes the next step, after a step with this stiffness to (q, v) at `t`.
    fn switches(
        &mut self,
        stiffness: f64,
        system: &mut dyn HybridSystem,
        (t, q, v): (f64, &[f64], &[f64]),
        stats: &mut Stats,
    ) -> bool {
        let implicit = self.memory.implicit;
        self.memory.steps = self.memory.steps.saturating_add(1);
        if self.memory.pause > 0 {
            self.memory.pause -= 1;
            return false;
        }
        // The states differ by rounding alone, so the stiffness is unknown, but the error estimate is not
        // small.
        let unmeasurable = !implicit && stiffness == 0.0 && self.explicit.error_in_tolerances() > NOISY;
        let contradicts = if implicit {
            let h = self.implicit.step().h;
            stiffness < NOT_STIFF && self.implicit.noise(h) < NOISY
        } else {
            stiffness > STIFF || unmeasurable
        };
        self.memory.contradictions = if contradicts { self.memory.contradictions + 1 } else { 0 };
        if self.memory.contradictions < PERSISTENCE {
            return false;
        }
        self.memory.contradictions = 0;
        if implicit {
            if self.memory.steps <= PAUSE {
                self.pause();
            } else {
                self.memory.next_pause = PAUSE;
            }
        } else if unmeasurable {
            let h = self.explicit.step().h;
            let confirmed = self.implicit.begin(system, t, q, v, stats) && self.implicit.noise(h) > NOISY;
            if !confirmed {
                self.pause();
                return false;
            }
        }
        self.memory.steps = 0;
        self.memory.implicit = !implicit;
        true
    }
}

impl Stepper for Auto {
    fn restart(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        self.explicit.restart(position_tolerance, velocity_tolerance);
        self.implicit.restart(position_tolerance, velocity_tolerance);
        let Memory { implicit, steps, .. } = self.memory;
        self.memory = Memory { implicit, steps, next_pause: PAUSE, ..Memory::default() };
    }

    fn begin(
        &mut self,
        system: &mut dyn HybridSystem,
        t: f64,
        q: &[f64],
        v: &[f64],
        stats: &mut Stats,
    ) -> bool {
        self.active().begin(system, t, q, v, stats)
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        self.active().attempt(system, h, stats)
    }

    fn step(&mut self) -> &mut DenseStep {
        self.active().step()
    }

    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        self.active().estimate_inside(theta, q, v);
    }

    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool {
        self.active().finish_dense(system, stats)
    }

    fn settle(
        &mut self,
        system: &mut dyn HybridSystem,
        t: f64,
        q: &[f64],
        v: &[f64],
        stats: &mut Stats,
    ) -> Settled {
        let (stiffness, largest_growth) = if self.memory.implicit {
            (self.implicit.stiffness(), f64::INFINITY)
        } else {
            let stiffness = self.explicit.stiffness();
            (stiffness, Dop853::largest_growth(stiffness))
        };
        let switched = self.switches(stiffness, system, (t, q, v), stats);
        Settled { largest_growth, switched, order_error: None }
    }
}
