//! The explicit and a Rosenbrock method in one, switched by the stiffness of the motion.
//!
//! Flights and sliding contacts are not stiff, and there the explicit method reaches an accuracy with
//! the least work. A contact that sticks is: its friction pulls back with a rate of 1e5 to 1e8 1/s,
//! and the steps of the explicit method shrink to the limit of its stability. Both sides are judged by
//! the same number, the length of a step times the fastest rate of the motion.

use crate::integrators::dense::DenseStep;
use crate::integrators::dop853::Dop853;
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, Stats, Stepper};

#[derive(Clone, Copy, Debug)]
pub struct Switching {
    pub on: f64,
    pub off: f64,
    pub on_count: usize,
    pub off_count: usize,
    pub policy: usize,
}

impl Default for Switching {
    fn default() -> Self {
        Self { on: 4.0, off: 4.0, on_count: 2, off_count: 2, policy: 0 }
    }
}

/// DOP853 and a Rosenbrock method, one of them active.
#[derive(Clone, Debug)]
pub struct Auto {
    explicit: Dop853,
    implicit: Rosenbrock,
    stiff: bool,
    streak: usize,
    c: Switching,
}

impl Auto {
    /// DOP853 and the Rosenbrock method of a tableau, for `d` degrees of freedom.
    pub fn new(tableau: Tableau, d: usize, c: Switching) -> Self {
        Self { explicit: Dop853::new(d), implicit: Rosenbrock::new(tableau, d), stiff: false, streak: 0, c }
    }

    fn active(&mut self) -> &mut dyn Stepper {
        if self.stiff { &mut self.implicit } else { &mut self.explicit }
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
        self.active().begin(system, t, q, v, stats)
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        self.active().attempt(system, h, stats)
    }

    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool {
        self.active().finish_dense(system, stats)
    }

    fn dense_is_free(&self) -> bool {
        self.stiff
    }

    fn step(&mut self) -> &mut DenseStep {
        self.active().step()
    }

    fn error(&self) -> &[f64] {
        if self.stiff { &self.implicit.error } else { self.explicit.error() }
    }

    fn embedded_order(&self) -> usize {
        if self.stiff { self.implicit.embedded_order() } else { self.explicit.embedded_order() }
    }

    fn is_explicit(&self) -> bool {
        !self.stiff
    }

    fn weigh(&mut self, velocity_tolerance: &[f64]) {
        self.explicit.weigh(velocity_tolerance);
        self.implicit.weigh(velocity_tolerance);
        self.streak = 0;
        if self.c.policy == 1 {
            self.stiff = false;
        }
    }

    fn settle(&mut self) -> bool {
        let stiffness = if self.stiff { self.implicit.stiffness() } else { self.explicit.stiffness() };
        let (against, count) = if self.stiff {
            (stiffness < self.c.off, self.c.off_count)
        } else {
            (stiffness > self.c.on, self.c.on_count)
        };
        self.streak = if against { self.streak + 1 } else { 0 };
        if self.streak < count {
            return false;
        }
        self.streak = 0;
        self.stiff = !self.stiff;
        true
    }
}
