//! Clearance joints: relative motion of journal and bearing, and the contact forces.

use super::Dynamics;
use crate::contact::clearance::{ContactState, Phase, RelativeMotion};
use crate::contact::normal::Latch;
use crate::tree::elements::ClearanceJoint;
use crate::tree::kinematics::{PointState, Vec2};

/// Journal center seen from the bearing center.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion {
    /// Eccentricity e [m].
    pub eccentricity: Vec2,
    /// ė [m/s].
    pub rate: Vec2,
    /// ë [m/s²].
    pub acceleration: Vec2,
    /// Rolling velocity ω_J R_J - ω_B R_B [m/s].
    pub spin: f64,
}

/// The contact of a clearance joint in a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointContact {
    /// Relative motion of journal and bearing.
    pub motion: RelativeMotion<f64>,
    /// Penetration, velocities and forces.
    pub state: ContactState<f64>,
}

impl JointContact {
    /// The value before the first evaluation.
    pub(super) const UNKNOWN: JointContact = JointContact {
        motion: RelativeMotion { eccentricity: [f64::NAN; 2], rate: [f64::NAN; 2], spin: f64::NAN },
        state: ContactState {
            penetration: f64::NAN,
            penetration_rate: f64::NAN,
            sliding_velocity: f64::NAN,
            normal_force: f64::NAN,
            friction_force: f64::NAN,
            force: [f64::NAN; 2],
        },
    };
}

impl Dynamics<'_> {
    /// Centers of journal and bearing of a clearance joint, after [`Dynamics::move_to`].
    #[inline(always)]
    pub fn joint_ends(&self, joint: &ClearanceJoint) -> [PointState; 2] {
        [self.point(joint.journal), self.point(joint.bearing)]
    }

    /// Relative motion in a clearance joint after [`Dynamics::move_to`].
    #[inline(always)]
    pub fn joint_motion(&self, joint: &ClearanceJoint) -> JointMotion {
        let [journal, bearing] = self.joint_ends(joint);
        JointMotion {
            eccentricity: journal.position - bearing.position,
            rate: journal.velocity - bearing.velocity,
            acceleration: journal.acceleration - bearing.acceleration,
            spin: self.spin(joint),
        }
    }

    /// The same without accelerations, as the contact law needs it.
    #[inline(always)]
    pub(super) fn contact_motion(&self, joint: &ClearanceJoint) -> RelativeMotion<f64> {
        self.motion_between(joint, &self.joint_ends(joint))
    }

    #[inline(always)]
    fn motion_between(
        &self,
        joint: &ClearanceJoint,
        [journal, bearing]: &[PointState; 2],
    ) -> RelativeMotion<f64> {
        RelativeMotion {
            eccentricity: (journal.position - bearing.position).into(),
            rate: (journal.velocity - bearing.velocity).into(),
            spin: self.spin(joint),
        }
    }

    #[inline]
    fn spin(&self, joint: &ClearanceJoint) -> f64 {
        self.states[joint.journal.frame].angular_velocity * joint.law.journal_radius
            - self.states[joint.bearing.frame].angular_velocity * joint.law.bearing_radius
    }

    /// Evaluates the contact of every clearance joint, once for all outputs, after [`Dynamics::move_to`].
    pub fn find_contacts(&mut self) {
        for (index, joint) in self.tree.clearance_joints.iter().enumerate() {
            self.contacts[index] = self.contact_of(joint, self.phases[index]);
        }
    }

    #[inline(always)]
    pub(super) fn contact_of(&self, joint: &ClearanceJoint, phase: Phase) -> JointContact {
        let motion = self.contact_motion(joint);
        JointContact { motion, state: joint.law.evaluate(&motion, phase) }
    }

    /// The contact of a clearance joint, after [`Dynamics::find_contacts`].
    pub fn contact(&self, index: usize) -> &JointContact {
        &self.contacts[index]
    }

    /// State of the contact of one clearance joint, after [`Dynamics::move_to`].
    pub fn contact_state(&self, index: usize) -> ContactState<f64> {
        let joint = &self.tree.clearance_joints[index];
        joint.law.evaluate(&self.contact_motion(joint), self.phases[index])
    }

    /// The same without its forces, for those who ask only how the surfaces move between the ends of the joint.
    #[inline(always)]
    pub fn contact_without_forces(
        &self,
        joint: &ClearanceJoint,
        ends: &[PointState; 2],
    ) -> ContactState<f64> {
        joint.law.without_forces(&self.motion_between(joint, ends))
    }

    /// Adds the generalized force of a contact, which it returns.
    // Inlined for the reason given at `add_pair`.
    #[inline(always)]
    pub(super) fn add_contact(
        &self,
        joint: &ClearanceJoint,
        phase: Phase,
        forces: &mut [f64],
    ) -> JointContact {
        let contact = self.contact_of(joint, phase);
        let JointContact { state, .. } = &contact;
        let moments = [
            joint.law.bearing_radius * state.friction_force,
            joint.law.journal_radius * state.friction_force,
        ];
        let positions = [self.point(joint.bearing).position, self.point(joint.journal).position];
        self.add_pair([joint.bearing, joint.journal], positions, state.force.into(), moments, forces);
        contact
    }

    /// The first contact whose normal force, together with the friction it causes, accelerates the surfaces
    /// toward each other: Painlevé's paradox. The friction coefficient is that of the present sliding
    /// velocity.
    pub fn paradoxical_contact(&mut self, t: f64, q: &[f64], v: &[f64]) -> Option<usize> {
        let phases = self.phases.clone();
        let mut a = vec![0.0; q.len()];
        let found = (0..phases.len()).find(|&index| {
            // Accelerations are linear in the normal force, so two values of it suffice: zero and the elastic
            // force.
            let mut response = |clipped| {
                self.phases[index] = match phases[index] {
                    Phase::Contact { .. } => Phase::Contact { latch: Latch::ELASTIC, clipped },
                    Phase::Free => return f64::NAN,
                };
                if !self.acceleration(t, q, v, &mut a) {
                    return f64::NAN;
                }
                self.accelerate(&a);
                let motion = self.joint_motion(&self.tree.clearance_joints[index]);
                motion.acceleration.dot(&motion.eccentricity.normalize())
            };
            let (without, with) = (response(true), response(false));
            self.phases[index] = phases[index];
            with > without
        });
        self.phases = phases;
        found
    }
}

/// The motion without accelerations, as the contact law needs it.
pub fn relative_motion(motion: &JointMotion) -> RelativeMotion<f64> {
    RelativeMotion { eccentricity: motion.eccentricity.into(), rate: motion.rate.into(), spin: motion.spin }
}
