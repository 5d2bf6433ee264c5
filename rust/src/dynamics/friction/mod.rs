//! Friction in ideal joints, from the reactions that it changes, with exact derivatives.
//! In: a state of the mechanism, joints that stick or slide; out: friction in every joint and its derivatives, which joints at
//! rest can be held. Uses `contact`, `numerics`, `tree`.

mod solution;

use crate::contact::sticking::Traction;
use crate::dynamics::Dynamics;
use crate::dynamics::reactions::Wrench;
use crate::numerics::accuracy::{HALF_DIGITS, ROUNDING_OF_SOLUTION};
use crate::numerics::turns::with_turns;
use crate::tree::elements::Tree;
use crate::tree::friction::{DryJoint, Reacting};
use crate::tree::kinematics::Coordinate;

/// What friction of size one in a joint adds to the accelerations and multipliers.
#[derive(Clone, Debug, Default)]
struct Response {
    accelerations: Vec<f64>,
    multipliers: Vec<f64>,
    /// The acceleration of the joint without closures.
    without_loops: f64,
}

/// Friction in the ideal joints of a mechanism in one state.
#[derive(Clone, Debug)]
pub(super) struct Friction<'m> {
    /// Whether each joint sticks or slides. Springs give fractions: stiffness is in 1/rad or 1/m, damping in s/rad or s/m.
    /// Without stiffness the motion is prescribed by drives: it has a direction only.
    tractions: Vec<Traction>,
    joints: &'m [DryJoint],
    other: &'m Reacting,
    /// The same mechanism with reactions.
    reacting: Box<Dynamics<'m>>,
    q: Vec<f64>,
    v: Vec<f64>,
    /// Accelerations and multipliers without friction, and what that of each joint adds.
    kept: Response,
    responses: Vec<Response>,
    /// Accelerations of the joints by drives.
    driven: Vec<f64>,
    /// Part of its largest friction that each joint transmits against its direction or stretch.
    fractions: Vec<f64>,
    /// Torque or force on the second body of each joint along its coordinate [N m or N].
    efforts: Vec<f64>,
    /// Derivatives of all efforts with respect to every degree of freedom, then to their velocities, then to time.
    gradients: Vec<Vec<f64>>,
    /// The joint at which two solutions or none were found in the last state, with the bound.
    fault: Option<(usize, f64)>,
}

impl<'m> Friction<'m> {
    /// That of a tree, if it has any: nothing acts until the joints stick or slide.
    pub(super) fn of(tree: &'m Tree) -> Option<Box<Self>> {
        let other = tree.reacting.as_ref()?;
        let (d, count) = (other.tree.degrees_of_freedom(), tree.dry_joints.len());
        Some(Box::new(Self {
            tractions: vec![Traction::default(); count],
            joints: &tree.dry_joints,
            other,
            reacting: Box::new(Dynamics::new(&other.tree)),
            q: vec![0.0; d],
            v: vec![0.0; d],
            kept: Response { accelerations: vec![0.0; d], ..Response::default() },
            responses: vec![Response::default(); count],
            driven: vec![0.0; count],
            fractions: vec![0.0; count],
            efforts: vec![0.0; count],
            gradients: vec![vec![0.0; count]; 2 * tree.degrees_of_freedom() + 1],
            fault: None,
        }))
    }
}

/// Sum of the entries times their factors.
fn along(columns: &[(usize, f64)], of: impl Fn(usize) -> f64) -> f64 {
    columns.iter().map(|&(index, factor)| factor * of(index)).sum()
}

impl Dynamics<'_> {
    /// Whether each ideal joint with friction sticks or slides.
    pub fn tractions(&self) -> &[Traction] {
        self.friction.as_ref().map_or(&[], |friction| &friction.tractions)
    }

    /// Sets what the joint with friction of this index does.
    pub fn set_traction(&mut self, index: usize, traction: Traction) {
        if let Some(friction) = &mut self.friction {
            friction.tractions[index] = traction;
        }
    }

    /// Lets the joint with friction of this index slide in a direction, or stick (0).
    pub fn direct_joint(&mut self, index: usize, direction: f64) {
        if let Some(friction) = &mut self.friction {
            friction.tractions[index].direction = direction;
        }
    }

    /// Sets what all joints with friction do.
    pub fn set_tractions(&mut self, tractions: &[Traction]) {
        if let Some(friction) = &mut self.friction {
            friction.tractions.copy_from_slice(tractions);
        }
    }

    /// Takes over the phases of all contacts and joints and the states of the switches.
    pub fn copy_phases(&mut self, other: &Self) {
        self.phases.copy_from_slice(&other.phases);
        self.switches.copy_from_slice(&other.switches);
        if let (Some(own), Some(other)) = (&mut self.friction, &other.friction) {
            own.tractions.copy_from_slice(&other.tractions);
        }
    }

    /// Velocity [rad/s or m/s] in a joint with friction, after [`Dynamics::move_to`].
    pub fn dry_velocity(&self, index: usize) -> f64 {
        along(&self.tree.dry_joints[index].columns, |column| self.coordinates[column].velocity)
    }

    /// Acceleration [rad/s² or m/s²] in a joint with friction, after [`Dynamics::accelerate`].
    pub fn dry_acceleration(&self, index: usize) -> f64 {
        along(&self.tree.dry_joints[index].columns, |column| self.coordinates[column].acceleration)
    }

    /// The fraction of its largest friction that a joint transmits in a traction, after [`Dynamics::move_to`].
    pub fn dry_fraction(&self, index: usize, traction: &Traction) -> f64 {
        if !traction.sticks() {
            return traction.direction;
        }
        let columns = &self.tree.dry_joints[index].columns;
        let near = along(columns, |column| self.coordinates[column].position) - traction.anchor;
        let stretch = with_turns(near, along(columns, |column| self.turns[column]) - traction.turns[0]);
        traction.stiffness * stretch + traction.damping * self.dry_velocity(index)
    }

    /// The traction of a joint that begins to stick with a fraction of its largest friction, in the state last moved to.
    pub fn anchored_joint(&self, index: usize, fraction: f64, traction: Traction) -> Traction {
        let columns = &self.tree.dry_joints[index].columns;
        let turns = [along(columns, |column| self.turns[column]), 0.0];
        let stretch = (fraction - traction.damping * self.dry_velocity(index)) / traction.stiffness;
        let anchor = along(columns, |column| self.coordinates[column].position) - stretch;
        Traction { direction: 0.0, anchor, turns, ..traction }
    }

    /// Mass [kg] or moment of inertia [kg m²] that friction in a joint moves, after [`Dynamics::find_friction`]; infinite
    /// where drives prescribe its motion.
    pub fn dry_inertia(&self, index: usize) -> f64 {
        let Some(friction) = &self.friction else { return f64::NAN };
        let accelerance = friction.accelerance(index, index);
        let moves = accelerance > ROUNDING_OF_SOLUTION * friction.responses[index].without_loops;
        if moves { 1.0 / accelerance } else { f64::INFINITY }
    }

    /// Correlation of the motions of two joints that friction can move: exactly 1 or -1 where neither moves without the
    /// other.
    pub fn dry_correlation(&self, index: usize, other: usize) -> f64 {
        let correlation =
            self.friction.as_ref().map_or(f64::NAN, |friction| friction.correlation(index, other));
        if 1.0 - correlation * correlation <= HALF_DIGITS { correlation.signum() } else { correlation }
    }

    /// Finds the friction in the state last moved to; false where it has two solutions or none.
    #[inline(never)]
    pub fn find_friction(&mut self) -> bool {
        self.hold_joints(&[])
    }

    /// The same, where some joints hold each other without acceleration; after [`Dynamics::acceleration`] there.
    pub fn hold_joints(&mut self, held: &[usize]) -> bool {
        let Some(mut friction) = self.friction.take() else { return true };
        // It is found anew, whatever was evaluated before.
        friction.efforts.fill(0.0);
        for (index, traction) in friction.tractions.iter().enumerate() {
            let is_held = held.contains(&index);
            friction.fractions[index] = if is_held { 0.0 } else { self.dry_fraction(index, traction) };
        }
        let found = friction.follow(self) && friction.hold(held);
        self.friction = Some(friction);
        found
    }

    /// The fraction of its largest friction that a joint transmits, as its friction was last found.
    pub fn held_fraction(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.fractions[index])
    }

    /// Whether a joint accelerates with its friction as last found.
    pub fn dry_accelerates(&self, index: usize) -> bool {
        self.friction.as_ref().is_some_and(|friction| friction.accelerates(index) != 0.0)
    }

    /// Where a joint must go from a state of rest, as its friction was last found, if it cannot stay there: one that is held
    /// slides where it would need more than its largest friction, one that slides is held (0) where it would turn back.
    pub fn dry_departure(&self, index: usize) -> Option<f64> {
        let friction = self.friction.as_ref()?;
        let (direction, fraction) = (friction.tractions[index].direction, friction.fractions[index]);
        if direction == 0.0 {
            (fraction.abs() > 1.0).then(|| fraction.signum())
        } else {
            (direction * friction.accelerates(index) < 0.0).then_some(0.0)
        }
    }

    /// The joint at which friction has two solutions or none in the state last evaluated, and how much friction there
    /// changes itself: by one or more of its own size.
    pub fn friction_fault(&self) -> Option<(usize, f64)> {
        self.friction.as_ref()?.fault
    }

    /// Adds the generalized forces of friction.
    pub(super) fn add_friction(&self, forces: &mut [f64]) {
        let Some(friction) = &self.friction else { return };
        for (joint, effort) in friction.joints.iter().zip(&friction.efforts) {
            joint.free.iter().for_each(|&(freedom, factor)| forces[freedom] += factor * effort);
        }
    }

    /// Finds the derivatives of friction, after [`Dynamics::acceleration`] and [`Dynamics::accelerate`] in the same state.
    pub fn differentiate_friction(&mut self) {
        let tree = self.tree;
        let Some(mut friction) = self.friction.take() else { return };
        let d = tree.free.len();
        for (index, (joint, traction)) in tree.dry_joints.iter().zip(&friction.tractions).enumerate() {
            friction.gradients.iter_mut().for_each(|gradient| gradient[index] = 0.0);
            if !traction.sticks() {
                continue;
            }
            for &(freedom, factor) in &joint.free {
                friction.gradients[freedom][index] = traction.stiffness * factor;
                friction.gradients[d + freedom][index] = traction.damping * factor;
            }
            friction.gradients[2 * d][index] = along(&joint.driven, |column| {
                let Coordinate { velocity, acceleration, .. } = self.coordinates[column];
                traction.stiffness * velocity + traction.damping * acceleration
            });
        }
        friction.differentiate(&tree.free);
        self.friction = Some(friction);
    }

    /// Adds the derivatives of friction to those of the force residual.
    pub(super) fn add_friction_derivatives(&mut self) {
        let (tree, columns) = (self.tree, self.coordinates.len());
        self.differentiate_friction();
        let Some(friction) = &self.friction else { return };
        for (index, joint) in tree.dry_joints.iter().enumerate() {
            let (by_position, others) = friction.gradients.split_at(tree.free.len());
            for &(row, factor) in &joint.free {
                for ((&column, by_position), by_velocity) in tree.free.iter().zip(by_position).zip(others) {
                    self.residual_q[row * columns + column] -= factor * by_position[index];
                    self.residual_v[row * columns + column] -= factor * by_velocity[index];
                }
                self.residual_t[row] -= factor * friction.gradients[2 * tree.free.len()][index];
            }
        }
    }

    /// Friction in a joint on its second body, along its coordinate [N m or N], after [`Dynamics::acceleration`].
    pub fn dry_effort(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.efforts[index])
    }

    /// The largest friction that its reaction allows [N m or N], after [`Dynamics::find_friction`].
    pub fn dry_limit(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.limit(index).0)
    }

    /// Friction, power or whether it sticks, by its place in [`crate::contact::friction::JointFriction::outputs`].
    pub fn dry_value(&self, index: usize, quantity: usize) -> f64 {
        match quantity {
            0 => self.dry_effort(index),
            1 => self.dry_loss(index),
            _ => f64::from(self.tractions()[index].sticks()),
        }
    }

    /// Power dissipated in a joint [W], after [`Dynamics::acceleration`].
    pub fn dry_loss(&self, index: usize) -> f64 {
        -self.dry_effort(index) * self.dry_velocity(index)
    }

    /// Calls `supply` with what friction exerts on bodies.
    pub(super) fn each_friction_load(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        for (index, dry) in self.tree.dry_joints.iter().enumerate() {
            let joint = &self.tree.ideal_joints[dry.joint];
            self.supply_effort(Some(joint), joint.bodies, self.dry_effort(index), supply);
        }
    }
}
