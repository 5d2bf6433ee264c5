//! The explicit and a Rosenbrock method in one, switched by the stiffness of the motion.
//!
//! Flights and sliding contacts are not stiff, and there the explicit method reaches an accuracy with
//! the least work. A contact that sticks is: its friction answers a velocity at a rate of 1e5 to 1e8 1/s,
//! and the steps of the explicit method shrink to the limit of its stability. Both methods are judged by
//! the same number, the length of a step times the fastest rate of the motion.

use crate::integrators::dense::DenseStep;
use crate::integrators::dop853::Dop853;
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, Memory, Stats, Stepper};

/// Length of a step times the fastest rate, by the explicit method's own estimate, from which it gives
/// way; it is stable up to 6. Tuned with the two constants below on 40 sliding and 24 sticking journals
/// (`benchmarks/rattle.rs`) at errors of 1e-3 to 1e-7: 1 costs 5 % more where contacts slide, 4 half as much
/// again where they stick and the tolerance is tight; 1.5 to 3 are alike.
const STIFF: f64 = 2.0;
/// The same product, by the norm of the Jacobian, below which the Rosenbrock method gives way. The norm
/// exceeds the rate by up to twice, and a step of the explicit method is the longer one where both are
/// free: 2 to 8 are alike.
const EASY: f64 = 4.0;
/// Steps in a row that must agree: one alone switches to and fro, 2 to 4 are alike.
const PERSISTENCE: usize = 2;

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
            memory: Memory { implicit: false, contradictions: 0 },
        }
    }

    fn active(&self) -> &dyn Stepper {
        if self.memory.implicit { &self.implicit } else { &self.explicit }
    }

    fn active_mut(&mut self) -> &mut dyn Stepper {
        if self.memory.implicit { &mut self.implicit } else { &mut self.explicit }
    }
}

impl Stepper for Auto {
    fn begin(
        &mut self,
        system: &mut dyn HybridSystem,
        t: f64,
        q: &[f64],
        v: &[f64],
        stats: &mut Stats,
    ) -> bool {
        self.active_mut().begin(system, t, q, v, stats)
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        self.active_mut().attempt(system, h, stats)
    }

    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool {
        self.active_mut().finish_dense(system, stats)
    }

    fn dense_is_free(&self) -> bool {
        self.active().dense_is_free()
    }

    fn step(&mut self) -> &mut DenseStep {
        self.active_mut().step()
    }

    fn error(&self) -> &[f64] {
        self.active().error()
    }

    fn embedded_order(&self) -> usize {
        self.active().embedded_order()
    }

    fn weigh(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        self.explicit.weigh(position_tolerance, velocity_tolerance);
        self.implicit.weigh(position_tolerance, velocity_tolerance);
        self.memory.contradictions = 0;
    }

    fn is_explicit(&self) -> bool {
        !self.memory.implicit
    }

    fn settle(&mut self) -> bool {
        let contradicts = if self.memory.implicit {
            self.implicit.stiffness() < EASY
        } else {
            self.explicit.stiffness() > STIFF
        };
        let Memory { implicit, contradictions } = &mut self.memory;
        *contradictions = if contradicts { *contradictions + 1 } else { 0 };
        let switches = *contradictions == PERSISTENCE;
        if switches {
            *contradictions = 0;
            *implicit = !*implicit;
        }
        switches
    }

    fn memory(&self) -> Memory {
        self.memory
    }

    fn recall(&mut self, memory: Memory) {
        self.memory = memory;
    }
}
