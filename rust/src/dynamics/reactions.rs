//! Reactions of ideal joints and drives, by inverse dynamics from the leaves of the tree to its root.
//!
//! The joint that carries a body transmits the inertial forces of the body and of all that it carries, less
//! the forces applied to them. The result equals the multipliers of Eq. (14) of `[Xiang2020]`, without
//! solving for them.

use super::Dynamics;
use crate::tree::elements::Realization;
use crate::tree::kinematics::Vec2;

/// A force and a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force [N].
    pub force: Vec2,
    /// Moment [N m] about the origin unless another point is stated.
    pub moment: f64,
}

/// A force on the second body of a slot, with its reaction on the first.
pub(super) struct PairForce {
    /// Where the two act [m].
    pub(super) positions: [Vec2; 2],
    /// The force in the world frame [N].
    pub(super) force: Vec2,
    /// Moments on the second body and, reversed, on the first [N m]: of the first, then of the second.
    pub(super) moments: [f64; 2],
}

impl Wrench {
    /// The wrench about the origin of a force at a point and a moment.
    pub(super) fn at(point: Vec2, force: Vec2, moment: f64) -> Self {
        Self { force, moment: moment + point.perp(&force) }
    }

    fn add(&mut self, sign: f64, other: Wrench) {
        self.force += sign * other.force;
        self.moment += sign * other.moment;
    }
}

impl Dynamics<'_> {
    /// Computes the reactions of all ideal joints, after [`Dynamics::acceleration_and_contacts`] and
    /// [`Dynamics::accelerate`].
    pub fn find_reactions(&mut self) {
        let tree = self.tree;
        let mut demands = std::mem::take(&mut self.demands);
        for (demand, body) in demands.iter_mut().zip(&tree.bodies) {
            let frame = &self.states[body.frame];
            let center = frame.point(body.center);
            let inertial = body.mass * center.acceleration;
            *demand = Wrench::at(center.position, inertial, body.inertia * frame.angular_acceleration);
        }
        self.each_load(&mut |body, wrench| {
            if let Some(body) = body {
                demands[body].add(-1.0, wrench);
            }
        });
        for &index in tree.tree_joints.iter().rev() {
            let joint = &tree.ideal_joints[index];
            if let Realization::Tree { child, sign, .. } = joint.realization {
                let carried = demands[child];
                let parent = if sign > 0.0 { joint.bodies[0] } else { joint.bodies[1] };
                if let Some(parent) = parent {
                    demands[parent].add(1.0, carried);
                }
                self.reactions[index] = Wrench { force: sign * carried.force, moment: sign * carried.moment };
            }
        }
        self.demands = demands;
    }

    /// Calls `supply` with every force that acts on a body, except those of the joints of the tree.
    fn each_load(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        let tree = self.tree;
        for (index, slot) in tree.slots.iter().enumerate() {
            if !self.phases[index].touches() {
                continue;
            }
            let PairForce { positions, force, moments } = self.pair_force(slot, &self.contacts[index].state);
            let ends = positions.into_iter().zip(moments).zip([-1.0, 1.0]);
            for (((position, moment), sign), body) in ends.zip(slot.bodies) {
                supply(body, Wrench::at(position, sign * force, sign * moment));
            }
        }
        self.each_force(supply);
        for (index, closure) in tree.closures.iter().enumerate() {
            let force = self.closure_reaction(index);
            for ((point, body), sign) in
                [closure.a, closure.b].into_iter().zip(closure.bodies).zip([-1.0, 1.0])
            {
                supply(body, Wrench::at(self.point(point).position, sign * force, 0.0));
            }
        }
        self.each_coupling_load(supply);
        self.each_friction_load(supply);
    }

    /// Force of a loop closure on its second point [N].
    pub(super) fn closure_force(&self, index: usize) -> Vec2 {
        -Vec2::new(self.loops.multipliers[2 * index], self.loops.multipliers[2 * index + 1])
    }

    /// The same with what it carries of the teeth whose wheel it holds.
    fn closure_reaction(&self, index: usize) -> Vec2 {
        self.closure_force(index) + self.teeth_on_closure(index)
    }

    /// Reaction of an ideal joint, with its drive, on its second body: the force and the moment about
    /// the point of the joint on that body; after [`Dynamics::find_reactions`].
    pub fn reaction(&self, index: usize) -> Wrench {
        let joint = &self.tree.ideal_joints[index];
        match joint.realization {
            Realization::Cut(closure) => Wrench { force: self.closure_reaction(closure), moment: 0.0 },
            Realization::Tree { .. } => {
                let Wrench { force, moment } = self.reactions[index];
                let point = self.point(joint.points[1]).position;
                Wrench { force, moment: moment - point.perp(&force) }
            }
        }
    }

    /// Torque [N m] or force [N] that a drive exerts on the second body of its joint, along the
    /// coordinate of the joint; after [`Dynamics::find_reactions`].
    pub fn drive_effort(&self, index: usize) -> f64 {
        let driven = &self.tree.driven[index];
        let Wrench { force, moment } = self.reaction(driven.joint);
        match self.tree.ideal_joints[driven.joint].realization {
            // The axis of the frame is reversed if the tree passes the joint from its second body to its
            // first.
            Realization::Tree { sign, .. } if !driven.is_angle => {
                sign * self.states[driven.column + 1].axis.dot(&force)
            }
            _ => moment,
        }
    }

    /// Sum of the wrenches that bodies without a joint of the tree would still need: zero if the equations of
    /// motion hold.
    pub fn unbalanced(&self) -> Wrench {
        let carried = |body: usize| {
            self.tree
                .ideal_joints
                .iter()
                .any(|joint| matches!(joint.realization, Realization::Tree { child, .. } if child == body))
        };
        let mut sum = Wrench::default();
        for (body, demand) in self.demands.iter().enumerate() {
            if !carried(body) {
                sum.add(1.0, *demand);
            }
        }
        sum
    }
}
