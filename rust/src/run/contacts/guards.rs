//! What a step is watched for at a clearance joint: the guards, whose zeros change its phase, and its sliding.

use crate::contact::clearance::{ContactState, Phase};
use crate::integrators::events::Guard;
use crate::run::recorder::Recorder;

/// Rate at which the ratio of normal and elastic force has no sign, as a part of the velocity tolerance. Tuned on
/// overdamped contacts under explicit steps, which clip and unclip by the error of the velocity: with
/// 1e-3 a scene got half as far in 300 000 steps as with 0.1; with 1 a shaken bearing at rtol 1e-3 lost
/// clips that tighter runs have.
const RATIO_PART: f64 = 0.1;
/// That ratio, of order one, is looked at closely below this value.
const RATIO_MARGIN: f64 = 0.25;
/// Largest penetration at a located onset, as a part of the position tolerance.
const ONSET_PART: f64 = 1e-2;

impl Recorder<'_> {
    /// Rounding of the penetration [m]: of the difference of two positions.
    pub(crate) fn gap_resolution(&self, index: usize) -> f64 {
        let mechanism = self.mechanism;
        let joint = &mechanism.clearance_joints[index];
        let [journal, bearing] =
            [joint.journal, joint.bearing].map(|point| self.dynamics.point(point).position);
        4.0 * f64::EPSILON * (journal.abs().sum() + bearing.abs().sum() + mechanism.scales.length)
    }

    /// Positive until the surfaces touch, or part.
    pub(crate) fn gap_guard(&self, index: usize, state: &ContactState<f64>) -> Guard {
        let sign = match self.dynamics.phases[index] {
            Phase::Free => -1.0,
            Phase::Contact { .. } => 1.0,
        };
        let resolution = self.gap_resolution(index);
        Guard {
            value: sign * state.penetration,
            rate: sign * state.penetration_rate,
            margin: 0.0,
            resolution,
            overshoot: (8.0 * resolution).max(ONSET_PART * self.tolerances.position),
        }
    }

    /// Positive until the damping would pull, or no longer pulls.
    pub(crate) fn pull_guard(&self, index: usize, state: &ContactState<f64>) -> Guard {
        let Phase::Contact { latch, clipped } = self.dynamics.phases[index] else {
            return Guard::INACTIVE;
        };
        let joint = &self.mechanism.clearance_joints[index];
        let law = &joint.law.normal;
        let slope = law.force_ratio_slope(state.penetration, latch);
        if slope == 0.0 {
            return Guard::INACTIVE;
        }
        let ratio = law.force_ratio(state.penetration, state.penetration_rate, latch);
        // Rounding of the difference of two velocities, and what the tolerance leaves open: where
        // the damping is strong the ratio stays near zero for long, and its noise is no event.
        let journal = self.dynamics.point(joint.journal).velocity;
        let bearing = self.dynamics.point(joint.bearing).velocity;
        let rounding = 4.0 * f64::EPSILON * (journal.abs().sum() + bearing.abs().sum());
        let resolution = 64.0 * f64::EPSILON
            + slope * (rounding + RATIO_PART * self.tolerances.damped(law, self.dynamics.phases[index]));
        Guard {
            value: if clipped { -ratio } else { ratio },
            rate: f64::NAN,
            margin: RATIO_MARGIN,
            resolution,
            // The force at the clip is off by this part of its elastic share at most.
            overshoot: (8.0 * resolution).max(1e-4),
        }
    }

    /// Whether a clearance joint stuck under load at the start of the step.
    pub(crate) fn sticks_at_start(&self, index: usize) -> bool {
        let steep = self.mechanism.clearance_joints[index].law.stick_velocity();
        self.slides[index].zip(steep).is_some_and(|(sliding, steep)| sliding.abs() < steep)
    }

    /// Raises the velocity_refinement to what the friction of a contact needs from the start of the step to a state.
    pub(crate) fn sharpen(&mut self, index: usize, state: &ContactState<f64>) {
        if let Some(start) = self.slides[index] {
            let phases = &self.dynamics.phases;
            let velocity_refinement =
                self.tolerances.velocity_refinement(self.mechanism, phases, index, start, state);
            self.velocity_refinement = self.velocity_refinement.max(velocity_refinement);
        }
    }
}
