//! The explicit and a Rosenbrock method in one, switched by the stiffness of the motion.
//!
//! Flights and sliding contacts are not stiff, and there the explicit method reaches an accuracy with
//! the least work. A contact that sticks is: its friction answers a velocity at a rate of 1e5 to 1e8 1/s,
//! and the steps of the explicit method shrink to the limit of its stability. Both methods are judged by
//! the same number, the length of a step times the fastest rate of the motion.
//!
//! Nor does the explicit method gain by its order where the tolerance lets it follow a contact's oscillation with
//! steps of several radians: the Rosenbrock method, whose step costs less, may take steps nearly as long. So it
//! is tried, and stays while they are long enough. At a tight tolerance steps are shorter, and the question does not arise.
//!
//! Under the light load of a slow mechanism neither holds. A contact there rests at a depth not far above
//! the rounding of the positions, and what its stiffness makes of that rounding fills the error estimate of
//! the explicit method, whose weights of up to 6 magnify it, at steps of 1 or 2 divided by the frequency. The
//! Rosenbrock method takes twice to five times as long ones, so it takes over there as well, if the Jacobian confirms it.

use crate::integrators::dense::DenseStep;
use crate::integrators::dop853::Dop853;
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, Settled, Stats, Stepper};

/// Length of a step times the fastest rate of the motion from which the Rosenbrock method is tried, and below which it
/// gives way again. Its step takes two thirds of the evaluations, Jacobian included, so it may be two thirds as
/// long; the explicit method is stable up to about 6. Over slider-cranks, four-bar, six-bar, quick return, pendulum and journals at rtol
/// 1e-2 to 1e-8: 5 and 4 cost up to 46 % more at 1e-2 and 26 % at 1e-3, 2 and 1.4 up to 5 % more at 1e-5.
const STIFF: f64 = 2.5;
const EASY: f64 = STIFF * 2.0 / 3.0;
/// What the rounding of the positions may do to the velocities within a step, in tolerances, by the
/// Jacobian. Tuned on the paper's slider-crank at 0.003 to 3 r/min in both conventions: from 0.001 on auto takes
/// the Rosenbrock method where that is cheaper, 0.005 hesitates at 0.1 r/min at a loss of a quarter.
const NOISY: f64 = 0.002;
/// Steps in a row that must agree on a switch: one alone switches to and fro, 2 to 4 are alike.
const PERSISTENCE: u32 = 2;
/// Steps during which no switch to the Rosenbrock method is considered after one that did not last as long,
/// or that the Jacobian refused; doubled with every repetition in a phase. Without it methods that are
/// level change places every few steps, at a loss of up to 80 %.
const PAUSE: u32 = 10;
const LONGEST_PAUSE: u32 = 80;

/// What is known of the steps before the present one.
#[derive(Clone, Copy, Debug, Default)]
struct Memory {
    /// The next step is an implicit one.
    implicit: bool,
    /// Accepted steps since the last switch.
    steps: u32,
    /// Last steps in a row whose stiffness spoke for the other method.
    contradictions: u32,
    /// Steps before which no switch is considered.
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

    /// Considers no switch to the Rosenbrock method for a while, the longer the more often in this phase.
    fn pause(&mut self) {
        self.memory.pause = self.memory.next_pause;
        self.memory.next_pause = (2 * self.memory.next_pause).min(LONGEST_PAUSE);
    }

    /// Whether the other method takes the next step, after one of a stiffness that led to (q, v) at `t`.
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
        // The states differ by rounding alone, so no rate is known, and yet the error estimate is no rounding error.
        let unmeasurable = !implicit && stiffness == 0.0 && self.explicit.error_in_tolerances() > NOISY;
        let contradicts = if implicit {
            let h = self.implicit.step().h;
            stiffness < EASY && self.implicit.noise(h) < NOISY
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
        Settled { largest_growth, switched: self.switches(stiffness, system, (t, q, v), stats) }
    }
}
