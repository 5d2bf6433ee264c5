//! The Adams method and a Rosenbrock method, of which the one is kept whose progress costs less.
//!
//! What a method costs is not known before it is tried: stability limits the steps of the Adams method where forces
//! damp, accuracy those of both, and contact changes, kinks and rejected attempts add what no estimate tells. So work is
//! counted, in evaluations, against the time that it covers. Now and then the other method takes over for a small part of
//! the work done so far. If it covers the stretch that the present method would have covered for as much, it is kept; if
//! it does not, the present one goes on, and the next trial comes after twice the work. What trials may lose is a fixed
//! part of the run, so their number needs no rule that knows the scene.

use crate::integrators::adams::Adams;
use crate::integrators::dense::DenseStep;
use crate::integrators::rosenbrock::{FACTORIZATION, JACOBIAN, Rosenbrock};
use crate::integrators::tableaus::Tableau;
use crate::integrators::{HybridSystem, NextLimits, StateAt, Stats, Stepper};

/// Part of the work that trials may lose: the regret of not knowing the better method.
const REGRET: f64 = 0.05;
/// Steps of Rodas4 or Rodas5P whose work a trial of the Adams and of that method may need at least: a stretch that shows
/// what steps cost. The Adams method begins with short steps of a low order. A trial ends sooner where its steps
/// neither pay nor grow.
const LEAST_STEPS: [f64; 2] = [10.0, 3.0];
/// Growth of the price after a lost trial from which that says nothing any more.
const CLEARLY: f64 = 2.0;
/// Weight of a step in the recent price, relative to its successor: that of the last twenty steps.
const MEMORY: f64 = 0.95;

/// Work of a part of the run [evaluations] and the time that it covers [s].
#[derive(Clone, Copy, Debug, Default)]
struct Stretch {
    work: f64,
    time: f64,
}

impl Stretch {
    fn add(&mut self, other: Stretch) {
        self.work += other.work;
        self.time += other.time;
    }

    /// Work per time.
    fn price(self) -> f64 {
        if self.time > 0.0 { self.work / self.time } else { f64::INFINITY }
    }
}

/// A trial of the method that is now active.
#[derive(Clone, Copy, Debug)]
struct Trial {
    /// What it has done.
    stretch: Stretch,
    /// Work after which it is lost.
    budget: f64,
    /// Price of the other method that it must not exceed.
    price: f64,
    /// Length of the step with which the other method would go on.
    resumed: f64,
}

/// The Adams method and a Rosenbrock method, one of them active.
#[derive(Clone, Debug)]
pub struct Auto {
    explicit: Adams,
    implicit: Rosenbrock,
    /// Whether the next step is implicit.
    is_implicit: bool,
    /// Whether the active method must begin in the state from which the other one has failed.
    takes_over: bool,
    /// Memory for that state.
    start: Vec<f64>,
    /// Work and time up to which all is accounted for.
    known: Option<Stretch>,
    /// Since the last trial or change, of the last step, and of the last steps, which fade.
    standing: Stretch,
    last: Stretch,
    recent: Stretch,
    /// Price of the other method, as far as its last trial tells; above it, another trial may be won.
    refused: f64,
    trial: Option<Trial>,
    /// Work from the last trial to the next.
    interval: f64,
    /// What trials have lost.
    lost: f64,
}

impl Auto {
    /// The Adams method and the Rosenbrock method of a tableau, for `d` degrees of freedom; the first step is
    /// explicit.
    pub fn new(tableau: Tableau, d: usize) -> Self {
        let implicit = Rosenbrock::new(tableau, d);
        let interval = implicit.work() / REGRET;
        Self {
            explicit: Adams::new(d),
            implicit,
            is_implicit: false,
            takes_over: false,
            start: vec![0.0; 2 * d],
            known: None,
            standing: Stretch::default(),
            last: Stretch::default(),
            recent: Stretch::default(),
            refused: f64::INFINITY,
            trial: None,
            interval,
            lost: 0.0,
        }
    }
}

/// Work of a run so far [evaluations].
fn work(stats: &Stats) -> f64 {
    stats.evaluations as f64 + JACOBIAN * stats.jacobians as f64 + FACTORIZATION * stats.factorizations as f64
}

impl Auto {
    fn active(&mut self) -> &mut dyn Stepper {
        if self.is_implicit { &mut self.implicit } else { &mut self.explicit }
    }

    /// Work of a step of the active method.
    fn step_work(&self) -> f64 {
        if self.is_implicit { self.implicit.work() } else { Adams::WORK }
    }

    /// Takes what was done up to an instant into the accounts.
    fn account(&mut self, t: f64, stats: &Stats) {
        let now = Stretch { work: work(stats), time: t };
        let known = self.known.replace(now).unwrap_or(now);
        let done = Stretch { work: now.work - known.work, time: now.time - known.time };
        self.account_of().add(done);
        if self.trial.is_none() && done.time > 0.0 {
            self.last = done;
            self.recent.work *= MEMORY;
            self.recent.time *= MEMORY;
            self.recent.add(done);
        }
    }

    fn account_of(&mut self) -> &mut Stretch {
        match &mut self.trial {
            Some(trial) => &mut trial.stretch,
            None => &mut self.standing,
        }
    }

    /// Whether the other method is tried now, where the next step of the active one is of length `next`.
    fn is_due(&mut self, next: f64) -> bool {
        if self.standing.work >= self.interval {
            return true;
        }
        let total = self.known.map_or(0.0, |known| known.work);
        if self.lost > REGRET * total {
            return false;
        }
        let ratio = self.implicit.work() / Adams::WORK;
        let is_likely = if self.is_implicit {
            // Adams steps of the same price are stable.
            self.implicit.step.h * self.implicit.rate() < ratio
        } else {
            // Their error would allow steps that pay for a Rosenbrock method.
            let step = self.explicit.step();
            next <= step.h && step.h * self.explicit.possible_growth > ratio * next
        };
        is_likely || self.recent.price() > self.refused
    }

    /// Begins a trial of the other method; returns the length of its first step.
    fn begin_trial(&mut self, next: f64) -> f64 {
        let price = self.standing.price().min(self.last.price());
        self.is_implicit = !self.is_implicit;
        // The step of the same price; a Rosenbrock method may take one as long as that of the Adams method anyway.
        let first = if self.is_implicit {
            (self.implicit.work() / price).max(next)
        } else {
            Adams::STARTING_WORK / price
        };
        let least = LEAST_STEPS[usize::from(self.is_implicit)];
        let budget = (least * self.implicit.work()).max(REGRET * self.standing.work);
        self.trial = Some(Trial { stretch: Stretch::default(), budget, price, resumed: next });
        first
    }

    /// Judges a trial of which the next attempt is of length `next`; returns the length of the step of the other
    /// method, if that goes on.
    fn judge(&mut self, trial: Trial, next: f64, grows: bool) -> Option<f64> {
        let Trial { stretch, budget, price, resumed } = trial;
        if stretch.time * price >= budget {
            // It has covered what the other one would have for as much, or more.
            self.trial = None;
            (self.standing, self.recent) = (stretch, stretch);
            self.refused = price;
            self.interval = self.implicit.work() / REGRET;
            return None;
        }
        let pays = self.step_work() <= price * next;
        if stretch.work < budget && (pays || grows) {
            return None;
        }
        self.lost += (stretch.work - stretch.time * price).max(0.0);
        self.trial = None;
        self.refused = CLEARLY * self.recent.price();
        self.standing = Stretch::default();
        self.interval *= 2.0;
        self.is_implicit = !self.is_implicit;
        Some(resumed)
    }
}

impl Stepper for Auto {
    fn restart(&mut self, position_tolerance: &[f64], velocity_tolerance: &[f64]) {
        self.explicit.restart(position_tolerance, velocity_tolerance);
        self.implicit.restart(position_tolerance, velocity_tolerance);
    }

    fn begin(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> bool {
        self.account(at.t, stats);
        self.active().begin(system, at, stats)
    }

    fn attempt(&mut self, system: &mut dyn HybridSystem, h: f64, stats: &mut Stats) -> bool {
        if std::mem::take(&mut self.takes_over) {
            let other = if self.is_implicit { self.explicit.step() } else { self.implicit.step() };
            let t = other.t;
            self.start.copy_from_slice(&other.start);
            let Self { explicit, implicit, start, is_implicit, .. } = self;
            let active: &mut dyn Stepper = if *is_implicit { implicit } else { explicit };
            let (q, v) = start.split_at(start.len() / 2);
            if !active.begin(system, StateAt { t, q, v }, stats) {
                return false;
            }
        }
        self.active().attempt(system, h, stats)
    }

    fn reject(&mut self, next: f64, stats: &Stats) -> Option<f64> {
        self.active().reject(next, stats);
        if let Some(known) = self.known {
            self.account(known.time, stats);
        }
        let resumed = self.judge(self.trial?, next, false);
        self.takes_over = resumed.is_some();
        resumed
    }

    fn step(&mut self) -> &mut DenseStep {
        // Not through `active`: every step asks several times.
        if self.is_implicit { self.implicit.step() } else { self.explicit.step() }
    }

    fn estimate_inside(&mut self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        self.active().estimate_inside(theta, q, v);
    }

    fn nodes(&self) -> &'static [f64] {
        if self.is_implicit { self.implicit.nodes() } else { self.explicit.nodes() }
    }

    fn finish_dense(&mut self, system: &mut dyn HybridSystem, stats: &mut Stats) -> bool {
        self.active().finish_dense(system, stats)
    }

    fn next_limits(&mut self, system: &mut dyn HybridSystem, at: StateAt, stats: &mut Stats) -> NextLimits {
        let limits = self.active().next_limits(system, at, stats);
        self.account(at.t, stats);
        limits
    }

    fn hand_over(&mut self, next: f64) -> Option<f64> {
        if let Some(trial) = self.trial {
            let grows = next > self.step().h;
            return self.judge(trial, next, grows);
        }
        self.is_due(next).then(|| self.begin_trial(next))
    }
}
