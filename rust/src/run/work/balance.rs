//! The error of the energy balance of a run, an observer of its steps.
//!
//! The gap of a step is the change of the stored energy less the work plus the losses: an error of the
//! integration. It needs the powers at four instants inside the step, half of the work of a run. Unless
//! outputs ask for energies, only a random sample of the steps is therefore checked: each is drawn with
//! a known probability p, and its gap is weighted with 1/p. At tight tolerances nearly all of the error
//! arises in steps in which the friction law of a contact is steep and stiff (docs/decisions.md): there p follows the last
//! gaps. Elsewhere it is in proportion to the error estimate of the step, which gaps follow, and as small as the sampling
//! error of the sum allows.

use crate::contact::friction::FrictionLaw;
use crate::contact::pair::{ContactState, Phase, SlidingVelocity};
use crate::integrators::dense::DenseStep;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::ROUNDING_OF_SOLUTION;
use crate::run::motion::Motion;
use crate::run::settings::Settings;
use crate::run::work::{GAUSS, GAUSS_OF_SHORT};

/// Bounds of the largest error of the balance without a warning, relative to the largest energy: the relative
/// tolerance within them. Runs at 1e-2 are off by 1e-3 to 5e-3 as a rule, less than they ask for; to find that
/// out took nearly all steps, a quarter of the run.
const LARGEST_GAP: [f64; 2] = [1e-3, 1e-2];
/// Least probability with which a step is checked: without and with stiff friction.
/// Of 301 runs with heavy rods and strong friction 49 are off. 45 of these are found and one other is named; half
/// finds 41, twice 45.
const LEAST: [f64; 2] = [1.0 / 64.0, 1.0 / 16.0];
/// Without stiff friction: standard deviation that the sampled sum may have, relative to the largest error without a warning
/// and, once the sum is known to be larger, to the sum itself. Of the runs of [`LEAST`] half and twice find 44.
const ALLOWED_DEVIATION: f64 = 0.3;
/// With stiff friction, where gaps are too uneven for a variance: recent gap, relative to the largest
/// energy, from which every step is checked. Of the runs of [`LEAST`] half and twice find 46.
const ALWAYS_CHECKED_GAP: f64 = 4e-6;
/// Factor by which the recent gap with stiff friction, and the recent squares without, decay from one checked
/// step to the next.
/// Of the runs of [`LEAST`] 28 are found without memory, 45 with an endless one, which names two others.
const MEMORY: f64 = 0.9;
/// Standard deviations of the sampled sum that are subtracted as sampling error.
/// Of the runs of [`LEAST`] half finds 47 and names 4 others, twice finds 36.
const SUBTRACTED_DEVIATIONS: f64 = 1.5;
/// Multiples of the golden ratio modulo 1 fill the unit interval evenly, without resonance with periodic
/// steps.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Error of the energy balance over the steps of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Balance {
    /// Largest error without a warning, relative to the largest energy.
    pub(crate) limit: f64,
    /// Rounding error of the energies at least [J].
    least_rounding: f64,
    /// Steps so far.
    steps: usize,
    /// Instant at which the run begins [s], and how long it lasts [s].
    run: [f64; 2],
    /// Part of the run that has passed.
    passed: f64,
    /// Rates at which steep friction damps the sliding of the contacts there [1/s]; zero where it is not steep.
    damping: Vec<f64>,
    /// Recent gap of a step with stiff friction [J].
    recent_gap: f64,
    /// Without it: energy gaps divided by error estimates, of steps that are short against the oscillations of the
    /// motion, and of others.
    ratios: [Ratio; 2],
    /// The step that was accepted last.
    chance: Chance,
    /// Potential energy before the first checked step [J].
    potential: Option<f64>,
    /// Sums over the steps: of their gaps, and of input and losses.
    gap: Estimate,
    works: [Estimate; 2],
    /// Largest sum of the gaps so far, less its sampling and rounding errors [J].
    least_error: f64,
    /// The same sum without that subtraction [J].
    pub(crate) worst: f64,
    /// Largest energy of any kind so far [J].
    pub(crate) largest: f64,
    /// Sums of the absolute gaps [J]: without and with stiff friction.
    sizes: [f64; 2],
    /// Instant and energies of the end of the last checked step.
    checked: Option<(f64, Stored)>,
}

/// The chance of a step to be checked.
#[derive(Clone, Copy, Debug, Default)]
struct Chance {
    /// Whether friction is stiff in it, and whether it is short against the oscillations of the motion.
    stiff: bool,
    short: bool,
    /// Error of the velocity that its method estimates [m/s].
    error: f64,
    probability: f64,
}

/// Gaps of the last checked steps of a kind, relative to the errors of the velocity that their method estimates.
#[derive(Clone, Copy, Debug, Default)]
struct Ratio {
    /// Sum of the squares of what was not expected from the step before [J²], and of the errors [m²/s²].
    gaps: f64,
    errors: f64,
    /// Gap to expect, per unit of the error [J s/m]; `None` before the first step.
    rate: Option<f64>,
    /// Gap [J] and error [m/s] of the last step.
    last: [f64; 2],
    /// Sum of the errors of all steps of the kind [m/s].
    sum: f64,
}

impl Ratio {
    /// Takes in a step. Neighboring gaps are alike: only what differs from the one before by more than
    /// `rounding` [J] is a variance of the sampled sum, which is returned.
    fn add(&mut self, gap: f64, error: f64, rounding: f64) -> f64 {
        let [last_gap, last_error] = self.last;
        let like_last = if error < last_error { last_gap * (error / last_error) } else { last_gap };
        let square = 0.5 * ((gap - like_last).abs() - rounding).max(0.0).powi(2);
        self.gaps = MEMORY * self.gaps + square;
        self.errors = MEMORY * self.errors + error * error;
        // Without gaps there is nothing to expect, even of steps without errors.
        self.rate = Some(if self.gaps > 0.0 { (self.gaps / self.errors).sqrt() } else { 0.0 });
        self.last = [gap, error];
        square
    }
}

/// Estimate of a sum over all steps from the sampled ones.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    /// The sum [J].
    sum: f64,
    /// Variance of the sampling [J²].
    variance: f64,
}

impl Estimate {
    /// Adds a step that was drawn with a probability; `square` is its variance among its neighbors.
    fn add(&mut self, value: f64, square: f64, probability: f64) {
        let times = 1.0 / probability;
        self.sum += times * value;
        self.variance += times * (times - 1.0) * square;
    }

    /// Absolute value of the sum, less its sampling error.
    fn lower_bound(&self) -> f64 {
        self.sum.abs() - SUBTRACTED_DEVIATIONS * self.variance.sqrt()
    }
}

/// Energies of a state [J].
#[derive(Clone, Copy, Debug)]
struct Stored {
    kinetic: f64,
    potential: f64,
    contact: f64,
}

/// Energies of a state, and work and losses up to it.
struct Account {
    stored: Stored,
    input: f64,
    losses: f64,
}

impl Balance {
    /// The balance at the start of a run of a mechanism, at an instant [s].
    pub(crate) fn new(mechanism: &Mechanism, settings: &Settings, begin: f64) -> Self {
        let [least, most] = LARGEST_GAP;
        Self {
            run: [begin, settings.skip + settings.duration],
            limit: settings.rtol.clamp(least, most),
            least_rounding: ROUNDING_OF_SOLUTION * mechanism.energy_scale(),
            damping: vec![0.0; mechanism.slots.len()],
            ..Self::default()
        }
    }

    /// Judges the chance of an accepted step, from the gaps before it.
    fn judge(&mut self, always: bool, stiff: bool, short: bool, error: f64) {
        let needed = if stiff {
            self.recent_gap / (ALWAYS_CHECKED_GAP * self.largest)
        } else {
            // A sum that is not yet known to be too large may still be within the limit.
            let known = if self.is_off() { self.gap.sum.abs() } else { 0.0 };
            let allowed = ALLOWED_DEVIATION * (self.limit * self.largest).max(known);
            let ratio = &mut self.ratios[usize::from(short)];
            ratio.sum += error;
            let gap = ratio.rate.map_or(f64::NAN, |rate| rate * error);
            // With p = g / θ for steps that expect a gap g, the whole run, if it goes on like this, adds θ Σg to
            // the variance of the sum.
            let [other, short] = self.ratios.map(|ratio| ratio.rate.unwrap_or(0.0) * ratio.sum);
            gap * (other + short) / (self.passed * (allowed * allowed))
        };
        // Not a number before anything is known: then every step.
        let probability = if needed < 1.0 && !always { needed.max(LEAST[usize::from(stiff)]) } else { 1.0 };
        self.chance = Chance { stiff, short, error, probability };
    }

    /// Whether the present step is drawn.
    fn is_drawn(&self) -> bool {
        (self.steps as f64 * GOLDEN).fract() < self.chance.probability
    }

    /// Whether friction is stiff in a step of this length, judged at its start: it damps the sliding in less time.
    fn is_stiff(&self, h: f64) -> bool {
        self.damping.iter().any(|rate| rate * h > 1.0)
    }

    /// Whether the error of the balance is too large.
    pub(crate) fn is_off(&self) -> bool {
        self.least_error > self.limit * self.largest
    }

    /// Whether most of it arises with stiff friction.
    pub(crate) fn is_off_in_friction(&self) -> bool {
        self.sizes[1] > self.sizes[0]
    }

    /// Adds a step that was drawn.
    fn add(&mut self, start: &Account, end: &Account) {
        let Chance { stiff, short, error, probability } = self.chance;
        let stored = |account: &Account| {
            let Stored { kinetic, potential, contact } = account.stored;
            kinetic + potential + contact
        };
        let works = [end.input - start.input, end.losses - start.losses];
        let gap = stored(end) - stored(start) - works[0] + works[1];
        if !gap.is_finite() {
            return;
        }
        let rounding = ROUNDING_OF_SOLUTION * (end.stored.kinetic + end.stored.potential.abs());
        let mut square = gap * gap;
        if stiff {
            self.recent_gap = gap.abs().max(MEMORY * self.recent_gap);
        } else {
            square = self.ratios[usize::from(short)].add(gap, error, rounding);
        }
        self.gap.add(gap, square, probability);
        self.sizes[usize::from(stiff)] += gap.abs() / probability;
        let potential = *self.potential.get_or_insert(start.stored.potential);
        for Stored { kinetic, potential: present, contact } in [start.stored, end.stored] {
            let kinds = [kinetic, present - potential, contact];
            self.largest = kinds.into_iter().map(f64::abs).fold(self.largest, f64::max);
        }
        for (sum, work) in self.works.iter_mut().zip(works) {
            sum.add(work, work * work, probability);
            self.largest = self.largest.max(sum.lower_bound());
        }
        let least_error = self.gap.lower_bound() - rounding - self.least_rounding;
        if least_error > self.least_error {
            (self.least_error, self.worst) = (least_error, self.gap.sum.abs());
        }
    }

    pub(crate) fn begin(&mut self, t: f64) {
        let [begin, duration] = self.run;
        self.passed = (t - begin) / duration;
        self.steps += 1;
    }

    /// Forgets the energies of the state in which a step ended, since its phase has others.
    pub(crate) fn forget_state(&mut self) {
        self.checked = None;
    }

    /// Records how friction damps the sliding of a contact at the start of a step.
    pub(crate) fn watch_slide(&mut self, motion: &Motion, index: usize, state: &ContactState<f64>) {
        let joint = &motion.mechanism.slots[index];
        let presses = matches!(motion.dynamics.phases[index], Phase::Contact { clipped: false, .. });
        let ContactState { penetration, sliding_velocity, normal_force, .. } = *state;
        let steep = |law: &&FrictionLaw| presses && sliding_velocity.abs() < law.steep_until();
        self.damping[index] = joint.law.friction.as_ref().filter(steep).map_or(0.0, |law| {
            // Ratio of the sliding velocity in the friction law to the relative velocity.
            let ratio = match joint.law.sliding {
                SlidingVelocity::Surface => 1.0,
                SlidingVelocity::ContactPoint => penetration / (penetration + joint.law.clearance),
            };
            ratio * law.steepness() * normal_force / motion.mechanism.scales.contacts[index].mass
        });
    }

    /// Whether an accepted step may be checked; comes before [`Balance::accepted`].
    pub(crate) fn may_check(&mut self, step: &DenseStep, motion: &Motion) -> bool {
        // Outputs need the work of every step anyway.
        self.judge(motion.counts_work, self.is_stiff(step.h), step.is_short, velocity_error(step, motion));
        self.is_drawn()
    }

    /// Adds the work and the gap of an accepted step, if it is drawn.
    pub(crate) fn accepted(&mut self, step: &DenseStep, motion: &mut Motion) {
        if self.is_drawn() {
            let known = self.checked.take().filter(|(t, _)| *t == step.t);
            let start = match known {
                Some((_, stored)) => Account::beside(stored, motion),
                None => {
                    let (q, v) = step.start.split_at(step.start.len() / 2);
                    motion.dynamics.move_to(step.t, q, v);
                    Account::of(motion)
                }
            };
            // In a short step two points find the work to a part of 1e-3 of the change of the power.
            let nodes: &[(f64, f64)] =
                if step.is_short && !motion.counts_work { &GAUSS_OF_SHORT } else { &GAUSS };
            motion.visit_inside(|motion| motion.add_work_of(nodes, step, step.end_time()));
            if !motion.mechanism.has_loops() {
                motion.move_to_end(step);
            } else {
                motion.move_inside(step, step.end_time());
                motion.dynamics.move_to(step.end_time(), &motion.q, &motion.v);
            }
            let end = Account::of(motion);
            self.checked = Some((step.end_time(), end.stored));
            self.add(&start, &end);
        }
    }
}

impl Account {
    /// The account in the state that the dynamics was last moved to.
    fn of(motion: &mut Motion) -> Self {
        motion.dynamics.find_contacts();
        let stored = Stored {
            kinetic: motion.dynamics.kinetic_energy(),
            potential: motion.dynamics.potential_energy(),
            // The losses include what a contact carries along.
            contact: motion.dynamics.contact_energies() - motion.dynamics.carried_energies(),
        };
        Self::beside(stored, motion)
    }

    /// The present work and losses beside stored energies.
    fn beside(stored: Stored, motion: &Motion) -> Self {
        Self { stored, input: motion.work.input, losses: motion.work.losses() }
    }
}

/// Error of the velocity of points that a method estimates for its step [m/s].
fn velocity_error(step: &DenseStep, motion: &Motion) -> f64 {
    let errors = &step.error[step.error.len() / 2..];
    errors.iter().zip(&motion.mechanism.scales.levers).map(|(error, lever)| (error * lever).abs()).sum()
}
