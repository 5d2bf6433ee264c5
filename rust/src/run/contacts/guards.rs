//! Guards of a clearance joint, whose zeros change its phase, and what contacts ask of a step.

use crate::contact::pair::{ContactState, Phase, Surfaces};
use crate::dynamics::Dynamics;
use crate::integrators::events::Guard;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::{ROUNDING, ROUNDING_OF_CHAIN};
use crate::run::contacts::log::ContactLog;
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;
use crate::tree::elements::{ContactSlot, Neighbor};
use crate::tree::kinematics::PointState;

/// Error of the penetration rate, relative to the velocity tolerance, within which the sign of the normal
/// force is undetermined. Tuned on overdamped contacts under explicit steps, which are clipped and released
/// by errors of the velocity: with 1e-3 a scene got half as far in 300 000 steps as with 0.1; with 1 a shaken
/// bearing at rtol 1e-3 missed clippings that runs with a smaller rtol have. Half, twice: work 0, -1 % (5 of 100 runs).
pub(super) const RATIO_PART: f64 = 0.1;
/// Ratio of normal to elastic force, of order one, below which the guard is searched inside a step.
/// Half, twice: work -2, +1 % (5 of 102 runs).
const RATIO_MARGIN: f64 = 0.25;
/// Largest distance beyond its place at which a step may end on an event, as a part of the tolerance.
/// Half, twice: work +1, 0 % (115 of 196 runs).
pub(super) const OVERSHOOT: f64 = 1e-2;

/// Guards of a clearance joint: the gap, and the sign of the normal force.
pub(crate) const GUARDS: usize = 2;

/// What the contacts ask of a step, found where it starts and in the states inside it.
pub(crate) struct StepDemands {
    /// Longest step [s].
    pub(crate) bound: f64,
    /// Instant of the next break of a driven motion or a force [s].
    pub(crate) next_break: f64,
    /// Factor by which the velocity tolerance must be divided, up to the state at which the guards were last
    /// evaluated.
    pub(crate) velocity_refinement: f64,
    /// Factor by which all tolerances of the step must be divided.
    pub(crate) caution: f64,
    /// Penetration [m] and normal force [N] of every clearance joint at the start of the step.
    pub(crate) pressed: Vec<[f64; 2]>,
    /// Whether states inside the present step are corrected.
    pub(crate) is_corrected: bool,
    /// Sliding velocity of every clearance joint with friction at the start of the step [m/s]; `None` where
    /// there is no normal force.
    pub(crate) slides: Vec<Option<f64>>,
    /// Whether a joint that stuck under load at the start of the step slides at the state of the last guards.
    pub(crate) breaks_away: bool,
}

impl StepDemands {
    /// Nothing is asked yet of the first step, with this many clearance joints.
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            bound: f64::INFINITY,
            // Found where the first step starts.
            next_break: f64::NEG_INFINITY,
            velocity_refinement: 1.0,
            caution: 1.0,
            pressed: vec![[0.0; 2]; joints],
            is_corrected: false,
            slides: vec![None; joints],
            breaks_away: false,
        }
    }

    /// The guards of a clearance joint in the state of the frames inside the step or at its end, and what its friction
    /// asks of the step up to there.
    // Not inlined, for the reason given at `watch_joint`.
    #[inline(never)]
    pub(crate) fn joint_guards(
        &mut self,
        motion: &Motion,
        tolerances: &Tolerances,
        is_inside: bool,
        index: usize,
    ) -> [Guard; GUARDS] {
        let joint = &motion.mechanism.slots[index];
        let dynamics = if is_inside { &motion.inside } else { &motion.dynamics };
        let ends = dynamics.slot_ends(joint);
        let is_beyond = matches!(motion.dynamics.phases[index], Phase::Beyond);
        let state = dynamics.contact_without_forces(joint, &ends, is_beyond);
        let steep = joint.law.stick_velocity();
        self.breaks_away |= self.sticks_at_start(motion, index)
            && steep.is_some_and(|steep| state.sliding_velocity.abs() > steep);
        self.refine_velocity(motion, tolerances, index, &state);
        let gap = gap_guard(motion, tolerances, index, &state, &ends);
        [
            match &joint.neighbor {
                Some(neighbor) if !is_beyond => guard_of_ends(dynamics, joint, neighbor, gap),
                _ => gap,
            },
            tension_guard(motion, tolerances, self.is_corrected, index, &state, &ends),
        ]
    }

    /// Whether a clearance joint stuck under load at the start of the step.
    #[inline(always)]
    pub(crate) fn sticks_at_start(&self, motion: &Motion, index: usize) -> bool {
        let steep = motion.mechanism.slots[index].law.stick_velocity();
        self.slides[index].zip(steep).is_some_and(|(sliding, steep)| sliding.abs() < steep)
    }

    /// Raises the velocity refinement to what the friction of a contact needs between the start of the step
    /// and a state.
    #[inline(always)]
    pub(crate) fn refine_velocity(
        &mut self,
        motion: &Motion,
        tolerances: &Tolerances,
        index: usize,
        state: &ContactState<f64>,
    ) {
        if let Some(start) = self.slides[index] {
            let phases = &motion.dynamics.phases;
            let refinement = tolerances.velocity_refinement(motion.mechanism, phases, index, start, state);
            self.velocity_refinement = self.velocity_refinement.max(refinement);
        }
    }

    /// Raises the caution of the step that begins at `t` [s] to what the age of a contact asks for. One that sticks has
    /// no need: there errors arise where friction changes.
    pub(crate) fn begin_with_caution(
        &mut self,
        motion: &Motion,
        log: &ContactLog,
        tolerances: &Tolerances,
        t: f64,
        index: usize,
    ) {
        if let Some(open) = &log.open[index]
            && !self.sticks_at_start(motion, index)
        {
            let caution = tolerances.caution(motion.mechanism, index, t - open.contact.onset);
            self.caution = self.caution.max(caution);
        }
    }
}

/// Rounding error of the penetration in a clearance joint [m], a difference of two positions.
#[inline]
pub(crate) fn gap_resolution(
    mechanism: &Mechanism,
    index: usize,
    [journal, bearing]: &[PointState; 2],
) -> f64 {
    let size = journal.position.abs().sum() + bearing.position.abs().sum();
    ROUNDING * (size + mechanism.scales.of_contact(index).length)
}

/// Guard of the gap: zero where the surfaces touch or separate.
#[inline]
fn gap_guard(
    motion: &Motion,
    tolerances: &Tolerances,
    index: usize,
    state: &ContactState<f64>,
    ends: &[PointState; 2],
) -> Guard {
    let sign = match motion.dynamics.phases[index] {
        Phase::Free => -1.0,
        Phase::Contact { .. } => 1.0,
        // The neighbor watches the end of the face.
        Phase::Beyond => return Guard::INACTIVE,
    };
    let resolution = gap_resolution(motion.mechanism, index, ends);
    Guard {
        value: sign * state.penetration,
        rate: sign * state.penetration_rate,
        margin: 0.0,
        resolution,
        overshoot: (8.0 * resolution).max(OVERSHOOT * tolerances.of_joint(motion.mechanism, index).position),
    }
}

/// The guard of the gap of a corner, or that of an end of its face if it is closer to zero.
#[inline(never)]
fn guard_of_ends(dynamics: &Dynamics, slot: &ContactSlot, neighbor: &Neighbor, gap: Guard) -> Guard {
    let Surfaces::Face(face) = slot.law.surfaces else { return gap };
    dynamics.ends_ahead(slot, &face, neighbor).into_iter().fold(gap, |guard, [value, rate]| {
        if value < guard.value { Guard { value, rate, ..guard } } else { guard }
    })
}

/// Guard of the sign of the normal force: zero where the damping would make it tensile, or no longer
/// does.
#[inline]
fn tension_guard(
    motion: &Motion,
    tolerances: &Tolerances,
    is_corrected: bool,
    index: usize,
    state: &ContactState<f64>,
    [journal, bearing]: &[PointState; 2],
) -> Guard {
    let Phase::Contact { latch, clipped, .. } = motion.dynamics.phases[index] else {
        return Guard::INACTIVE;
    };
    let law = &motion.mechanism.slots[index].law.normal;
    let (penetration, rate) = (state.penetration, state.penetration_rate);
    let of_formula = law.ratio_of_formula([penetration, rate], latch);
    let slope =
        of_formula.map_or_else(|| law.force_ratio_slope(penetration, rate, latch), |[_, slope]| slope);
    if slope == 0.0 {
        return Guard::INACTIVE;
    }
    let ratio = of_formula.map_or_else(|| law.force_ratio(penetration, rate, latch), |[ratio, _]| ratio);
    // Rounding error of the difference of two velocities, and part of the tolerance: with strong damping
    // the ratio stays near zero for long, and its noise must not count as events.
    let rounding = ROUNDING * (journal.velocity.abs().sum() + bearing.velocity.abs().sum());
    // Corrected states balance the forces.
    let damped = || tolerances.of_joint(motion.mechanism, index).damped(law, motion.dynamics.phases[index]);
    let of_velocity = if is_corrected { 0.0 } else { RATIO_PART * damped() };
    let resolution = ROUNDING_OF_CHAIN + slope * (rounding + of_velocity);
    Guard {
        value: if clipped { -ratio } else { ratio },
        rate: f64::NAN,
        margin: RATIO_MARGIN,
        resolution,
        // Largest error of the force at the event, relative to the elastic force.
        overshoot: (8.0 * resolution).max(1e-4),
    }
}
