//! Tolerances of the local error: the meaning of `rtol` for a mechanism with clearance.

use crate::contact::normal::NormalLaw;
use crate::contact::pair::{ContactState, Phase};
use crate::dynamics::Correction;
use crate::error::{InputError, Problem, Subject};
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::ROUNDING;
use crate::numerics::logarithm::power;
use crate::run::settings::{DEFAULT_RTOL, Settings};
use crate::tree::elements::{ContactScales, Scales, State};

/// Position tolerance of a scene with clearance: `rtol` times this part of the smallest
/// clearance. 0.5 gives the scale with which the methods were compared, 1e-5 m for a clearance of 0.02 mm.
/// Half, twice: work +1, -5 %, errors times 0.8, 1.4 (57 of 137 runs).
const CLEARANCE_PART: f64 = 0.5;
/// Limits the tolerances in mechanisms with resting contacts. A contact that rests under the load of the
/// start has a resting penetration and, with the contact frequency, a resting speed. Tolerances are at most a
/// part of these: RESTING_RADIANS divided by the phase angle of the contact oscillation while the mechanism
/// moves by its own size, within RESTING_PARTS. With larger tolerances a resting contact cannot be
/// distinguished from free flight and chatters, the more often the longer it rests. Tuned on the paper's
/// mechanism at 0.1 to 300 r/min, rtol 1e-2 and 1e-4, in both conventions with Rodas4, Rodas5P and auto: 60
/// gives as many contact changes as the smallest part (at worst 97 instead of 93, apart from scatter in one
/// scene), 120 up to 8 % more, 360 up to 60 % more. Half, twice: work +4, -10 % (9 of 150 runs).
const RESTING_RADIANS: f64 = 60.0;
/// Bounds of that part. In one revolution of the paper's mechanism at 0.1 r/min, a part of 0.1 gives 4807
/// contact changes, 0.01 407, 0.003 189, tight tolerances 161. At 1000 to 3000 r/min 0.1 gives no spurious
/// ones, 0.3 up to twice as many. With the lower bound in all mechanisms, a run at 2000 r/min and rtol 1e-2
/// took twice the steps. Half, twice: work -2, +1 % (11 of 150 runs).
const RESTING_PARTS: [f64; 2] = [0.003, 0.1];
/// Velocity tolerance: `rtol` times this part of the speed of the mechanism. For the paper's
/// crank (10.5 m/s) this gives the scale with which the methods were compared, 1 m/s.
/// Half, twice: work +5, -3 %, errors times 0.47, 1.5 (95 of 150 runs).
const SPEED_PART: f64 = 0.1;
/// Velocity tolerance in a contact with friction, relative to the larger of its sliding velocity and the
/// stick velocity of the friction law. With a larger tolerance a linearly implicit step crosses the kink of
/// the law unnoticed: a sticking contact took 15 times more steps at rtol 1e-4 than at 1e-5. Over the
/// ensembles of `benchmarks/stiffness.rs` 0.3 is as good; with 1 a loose tolerance costs more than a tight
/// one. Half, twice: work +4, +5 %, errors times 0.21, 29 (10 of 150 runs).
const STICK_PART: f64 = 0.1;
/// Tolerances are divided by this from the onset of a contact on, for as long as an impact takes: its error is multiplied
/// by every impact that follows. Tuned on slider-cranks of `benchmarks/hand_derived.rs` (four sets of 40): 6, 8 and 9 %
/// fewer evaluations for an error of 1e-3, 1e-4 and 1e-5 of the range; 10, 50 and 100 are within 3 % of that.
/// Half, twice: work -3, +4 %, errors times 0.94, 0.52 (44 of 150 runs).
const ONSET_CAUTION: f64 = 30.0;
/// Radians of the oscillation about rest after which that fades, and after which it ends. An impact is half a period. [5,
/// 10] is 2 % worse on those mechanisms; [75, 150] is no better and costs contacts with strong friction, which begin again
/// and again, up to a third. Half, twice: work -3, -3 %, errors times 1, 0.71 (46 of 76 runs).
const CAREFUL_RADIANS: [f64; 2] = [10.0, 20.0];
/// From rtol 1e-3 to this one tolerances are divided by less, as (this / rtol)^(3/4): stability limits steps there, not
/// their error. Half, twice: work 0, -1 %, errors times 1.8, 1.2 (7 of 150 runs).
const UNCAREFUL_RTOL: f64 = 0.1;
/// Smallest velocity tolerance: this part of the size of the mechanism, a rounding error of the positions,
/// times the frequency of a contact that rests under the load of the start. With a smaller tolerance the
/// error estimate consists of rounding errors. Tuned on the paper's mechanism at 100 and 2000 r/min: up to
/// 1.2 machine epsilons the results of two methods differ as much as without this bound (3e-9 m/s), beyond by
/// more; without it DOP853 took eight times the steps at `rtol` 1e-13 and 100 r/min.
/// Half, twice: work +16, -11 % (7 of 150 runs).
const FINEST_PART: f64 = f64::EPSILON;

/// Largest correction of a projection relative to the tolerance of a step. Half, twice: work -14, +51 % (3 of 78 runs).
const LARGEST_PROJECTION: f64 = 10.0;

/// Floor of the impact velocity of every clearance joint [m/s] in a run with the default settings.
pub fn default_impact_velocity_floors(mechanism: &Mechanism) -> Vec<f64> {
    // The duration matters only if nothing moves.
    let tolerances = Tolerances::new(mechanism, &mechanism.start, &Settings::new(1.0, 2));
    (0..mechanism.slots.len()).map(|joint| tolerances.impact_velocity_floor(mechanism, joint)).collect()
}

/// Absolute tolerances of a run: each component of the scene has its own.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tolerances {
    components: Vec<ComponentTolerances>,
    /// Velocity tolerance in a contact relative to its sliding velocity or the stick velocity of its friction
    /// law.
    stick_part: f64,
}

/// Absolute tolerances of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ComponentTolerances {
    /// Tolerance of the positions of points [m].
    pub(crate) position: f64,
    /// Tolerance of their velocities [m/s], except where the damping of a contact or friction needs a smaller
    /// one.
    pub(crate) velocity: f64,
    /// Smallest velocity tolerance [m/s].
    finest_velocity: f64,
    /// Factor by which the tolerances are divided at the onset of a contact.
    onset_caution: f64,
}

/// The scales by which tolerances of a component are judged.
struct Judged<'m> {
    mechanism: &'m Mechanism,
    component: usize,
}

impl<'m> Judged<'m> {
    /// Of every component.
    fn all(mechanism: &'m Mechanism) -> impl Iterator<Item = Self> {
        (0..mechanism.scales.components.len()).map(move |component| Self { mechanism, component })
    }

    fn contacts(&self) -> impl Iterator<Item = (usize, &'m ContactScales)> {
        let contacts = self.mechanism.scales.contacts.iter().enumerate();
        let component = self.component;
        contacts.filter(move |(_, contact)| contact.component == component)
    }

    fn length(&self) -> f64 {
        self.mechanism.scales.components[self.component].length
    }

    /// Length scale of the position tolerance [m]: CLEARANCE_PART of the smallest clearance, or the size of the component.
    fn position_scale(&self) -> f64 {
        let clearances = self.contacts().map(|(slot, _)| self.mechanism.slots[slot].law.clearance);
        clearances.reduce(f64::min).map_or(self.length(), |clearance| CLEARANCE_PART * clearance)
    }

    /// Speed of the component from `start` [m/s].
    fn speed(&self, start: &State) -> f64 {
        let scales = &self.mechanism.scales;
        scales.components[self.component].speed.max(scales.largest(self.component, &start.v))
    }

    /// The tolerances of a run from `start`; those where contacts and friction limit them are `tighter` by that factor.
    fn tolerances(&self, start: &State, settings: &Settings, tighter: f64) -> ComponentTolerances {
        let (length, position_scale, speed) = (self.length(), self.position_scale(), self.speed(start));
        // The oscillation of a resting contact must be resolved, however slow the mechanism.
        let resting = |of: fn(&ContactScales) -> f64| {
            let largest = |contact: &ContactScales| {
                let radians = length / speed * contact.resting_speed / contact.resting_penetration;
                let [least, most] = RESTING_PARTS;
                (RESTING_RADIANS / radians).clamp(least, most) * of(contact)
            };
            tighter * self.contacts().map(|(_, contact)| largest(contact)).fold(f64::INFINITY, f64::min)
        };
        let finest = ROUNDING * length;
        let position =
            (settings.rtol * position_scale).min(resting(|contact| contact.resting_penetration)).max(finest);
        // If nothing moves, falls or is driven, the speed scale is the position scale over the duration.
        // Otherwise the duration must not change the steps, since a run may be continued.
        let speed_scale = if speed > 0.0 { SPEED_PART * speed } else { position_scale / settings.duration };
        let frequencies =
            self.contacts().map(|(_, contact)| contact.resting_speed / contact.resting_penetration);
        let finest_velocity = FINEST_PART * length * frequencies.fold(0.0, f64::max);
        let velocity =
            (settings.rtol * speed_scale).min(resting(|contact| contact.resting_speed)).max(finest_velocity);
        let position = settings.position_tolerance.unwrap_or(position);
        let velocity = settings.velocity_tolerance.unwrap_or(velocity);
        // Square roots, so that steps do not depend on a mathematical library.
        let root = (UNCAREFUL_RTOL / settings.rtol).sqrt();
        let onset_caution = (root * root.sqrt()).min(ONSET_CAUTION);
        let rounding = (position / finest).min(velocity / finest_velocity);
        ComponentTolerances {
            position,
            velocity,
            finest_velocity,
            onset_caution: onset_caution.min(rounding).max(1.0),
        }
    }
}

/// Checks the absolute tolerances of the settings against the scales of the mechanism: each must be small for every component
/// of the scene.
pub(crate) fn check_tolerances(
    mechanism: &Mechanism,
    start: &State,
    settings: &Settings,
) -> Result<(), InputError> {
    let smallest = |of: &dyn Fn(&Judged) -> f64| {
        // Without a speed scale the velocity tolerance has no limit.
        Judged::all(mechanism).map(|judged| of(&judged)).filter(|scale| *scale > 0.0).reduce(f64::min)
    };
    let length = smallest(&|judged| judged.position_scale());
    let speed = smallest(&|judged| judged.speed(start));
    let of_what =
        if mechanism.slots.is_empty() { "the size of the mechanism" } else { "half the smallest clearance" };
    let limits = [
        ("position_tolerance", settings.position_tolerance, "m", length, of_what),
        ("velocity_tolerance", settings.velocity_tolerance, "m/s", speed, "the speed of the mechanism"),
    ];
    let problems: Vec<Problem> = limits
        .into_iter()
        .filter_map(|(field, given, unit, limit, of_what)| {
            let (given, limit) = (given?, limit?);
            let message = || format!("must be <= {limit:.3e} [{unit}], {of_what}, got {given:e}");
            (given > limit).then(|| Problem::new(format!("settings.{field}"), message()))
        })
        .collect();
    Subject::Settings.judge((), problems)
}

impl Tolerances {
    /// The tolerances of a run from `start`.
    pub(crate) fn new(mechanism: &Mechanism, start: &State, settings: &Settings) -> Self {
        // Where contacts and friction limit the tolerances, a smaller `rtol` must still reduce them.
        let of_run = settings.companion_of.unwrap_or(settings.rtol);
        let tighter = (of_run / DEFAULT_RTOL).min(1.0) * (settings.rtol / of_run);
        let components = Judged::all(mechanism).map(|judged| judged.tolerances(start, settings, tighter));
        Self { components: components.collect(), stick_part: STICK_PART * tighter }
    }

    /// Those of a component of the scene.
    pub(crate) fn of(&self, component: usize) -> &ComponentTolerances {
        &self.components[component]
    }

    /// Those of the component of a clearance joint.
    #[inline]
    pub(crate) fn of_joint(&self, mechanism: &Mechanism, joint: usize) -> &ComponentTolerances {
        &self.components[mechanism.scales.contacts[joint].component]
    }

    /// Factor, at least 1, by which the tolerances are divided in a step that begins so long [s] after the onset of a
    /// contact of a joint.
    pub(crate) fn caution(&self, mechanism: &Mechanism, joint: usize, age: f64) -> f64 {
        let scales = &mechanism.scales.contacts[joint];
        let radians = age * scales.resting_speed / scales.resting_penetration;
        let [careful, end] = CAREFUL_RADIANS;
        if radians < end {
            power(self.of_joint(mechanism, joint).onset_caution, ((end - radians) / (end - careful)).min(1.0))
        } else {
            1.0
        }
    }

    /// Floor of the impact velocity of a joint [m/s], a lower bound for the damping: slower impacts are
    /// damped as if at it. The scene may give it; the default is the velocity tolerance, multiplied by χ v₀
    /// of the law where that is below 1. An impact velocity is not known more accurately, so the floor
    /// changes the run no more than the tolerance does. It never exceeds the velocity at which the contact is
    /// critically damped.
    pub(crate) fn impact_velocity_floor(&self, mechanism: &Mechanism, joint: usize) -> f64 {
        let default = || {
            let law = &mechanism.slots[joint].law.normal;
            let of = self.of_joint(mechanism, joint);
            let resolved = law.onset_damping().min(1.0) * of.velocity.max(of.finest_velocity);
            resolved.min(mechanism.scales.contacts[joint].resting_velocity)
        };
        mechanism.slots[joint].impact_velocity_floor.unwrap_or_else(default)
    }

    /// Factor, at least 1, by which the velocity tolerance in the present phases must be divided for the
    /// friction of a loaded `joint` that slides at `start` [m/s] at the start of a step and is in `state`
    /// later.
    #[inline(always)]
    pub(crate) fn velocity_refinement(
        &self,
        mechanism: &Mechanism,
        phases: &[Phase],
        joint: usize,
        start: f64,
        state: &ContactState<f64>,
    ) -> f64 {
        let law = &mechanism.slots[joint].law;
        let Some(friction) = &law.friction else { return 1.0 };
        let here = state.sliding_velocity;
        // If the direction of sliding has changed, the velocity has passed zero.
        let slowest = if start * here > 0.0 { start.abs().min(here.abs()) } else { 0.0 };
        let sliding = self.stick_part * friction.stick_velocity().max(slowest);
        let of = self.of_joint(mechanism, joint);
        // The common case; the ratio below is at least 1.
        if sliding >= of.velocity {
            return 1.0;
        }
        let tolerance = (sliding * law.sliding_ratio(state)).max(of.finest_velocity);
        if tolerance < of.velocity {
            let component = mechanism.scales.contacts[joint].component;
            (self.velocity_in(mechanism, phases, component) / tolerance).max(1.0)
        } else {
            1.0
        }
    }

    /// Correction of a projection relative to the largest that does not reject its step.
    pub(crate) fn excess(&self, scales: &Scales, correction: &Correction, [q, v]: [&[f64]; 2]) -> f64 {
        let of_component = |(index, of): (usize, &ComponentTolerances)| {
            let of_velocity = if correction.nearly_dependent {
                // Its square relative to that of the speed is the relative change of the energy.
                (of.velocity * scales.components[index].speed).sqrt().max(of.velocity)
            } else {
                of.velocity
            };
            let position = scales.largest(index, q) / (LARGEST_PROJECTION * of.position);
            let velocity = scales.largest(index, v) / (LARGEST_PROJECTION * of_velocity);
            // Rounding errors do not reject the step: they are not smaller in a shorter one.
            if correction.rounded_position { 0.0 } else { position }.max(if correction.rounded_velocity {
                0.0
            } else {
                velocity
            })
        };
        self.components.iter().enumerate().map(of_component).fold(0.0, f64::max)
    }

    /// Velocity tolerance of a component in the given phases of the contacts [m/s].
    fn velocity_in(&self, mechanism: &Mechanism, phases: &[Phase], component: usize) -> f64 {
        let of = &self.components[component];
        let contacts = mechanism.scales.contacts.iter().zip(&mechanism.slots).zip(phases);
        let own = contacts.filter(|((contact, _), _)| contact.component == component);
        own.map(|((_, joint), phase)| of.damped(&joint.law.normal, *phase)).fold(of.velocity, f64::min)
    }

    /// Tolerances of all coordinates and their velocities in the given phases of the contacts.
    pub(crate) fn in_phases(
        &self,
        mechanism: &Mechanism,
        phases: &[Phase],
        position: &mut [f64],
        velocity: &mut [f64],
    ) {
        let scales = &mechanism.scales;
        for (index, of) in self.components.iter().enumerate() {
            let of_velocities = self.velocity_in(mechanism, phases, index);
            for (k, lever) in scales.levers.iter().enumerate() {
                if scales.of_freedoms[k] == index {
                    position[k] = of.position / lever;
                    velocity[k] = of_velocities / lever;
                }
            }
        }
    }
}

impl ComponentTolerances {
    /// Velocity tolerance in a phase of a contact [m/s]. At most [`NormalLaw::damping_rate`]: an error of
    /// this size in the penetration rate changes the force by the elastic force. That is below the tolerance
    /// of free flight only after a slow impact with a small restitution.
    pub(crate) fn damped(&self, law: &NormalLaw, phase: Phase) -> f64 {
        match phase {
            Phase::Contact { latch, .. } => {
                self.velocity.min(law.damping_rate(latch).max(self.finest_velocity))
            }
            Phase::Free | Phase::Beyond => self.velocity,
        }
    }
}
