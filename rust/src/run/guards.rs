//! The guards of a clearance joint, whose zeros change its phase.

use crate::contact::clearance::{ClearanceLaw, ContactState, Phase};
use crate::integrators::events::Guard;
use crate::run::recorder::Recorder;

/// Rate at which the bracket of the damping has no sign, as a part of the velocity tolerance. Tuned on
/// overdamped contacts under explicit steps, which clip and unclip by the error of the velocity: with
/// 1e-3 a scene got half as far in 300 000 steps as with 0.1; with 1 a shaken bearing at rtol 1e-3 lost
/// clips that tighter runs have.
const BRACKET_PART: f64 = 0.1;
/// The bracket, of order one, is looked at closely below this value.
const BRACKET_MARGIN: f64 = 0.25;
/// Largest penetration of a landing, as a part of the position tolerance.
const LANDING_PART: f64 = 1e-2;

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
            overshoot: (8.0 * resolution).max(LANDING_PART * self.tolerances.position),
        }
    }

    /// Positive until the damping would pull, or no longer pulls.
    pub(crate) fn bracket_guard(&self, index: usize, state: &ContactState<f64>) -> Guard {
        let Phase::Contact { hysteresis_factor, clipped } = self.dynamics.phases[index] else {
            return Guard::INACTIVE;
        };
        if hysteresis_factor == 0.0 {
            return Guard::INACTIVE;
        }
        let joint = &self.mechanism.clearance_joints[index];
        let bracket = ClearanceLaw::damping_bracket(state.penetration_rate, hysteresis_factor);
        // Rounding of the difference of two velocities, and what the tolerance leaves open: where
        // the damping is strong the bracket stays near zero for long, and its noise is no event.
        let journal = self.dynamics.point(joint.journal).velocity;
        let bearing = self.dynamics.point(joint.bearing).velocity;
        let rounding = 4.0 * f64::EPSILON * (journal.abs().sum() + bearing.abs().sum());
        let resolution = 64.0 * f64::EPSILON
            + hysteresis_factor
                * (rounding + BRACKET_PART * self.tolerances.damped(self.dynamics.phases[index]));
        Guard {
            value: if clipped { -bracket } else { bracket },
            rate: f64::NAN,
            margin: BRACKET_MARGIN,
            resolution,
            // The force at the clip is off by this part of its elastic share at most.
            overshoot: (8.0 * resolution).max(1e-4),
        }
    }
}
