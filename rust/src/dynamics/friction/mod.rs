//! Friction in ideal joints, from the reactions that it changes, with exact derivatives.
//! In: a state of the mechanism, joints that stick or slide; out: friction in every joint and its derivatives, which joints at
//! rest can be held. Uses `contact`, `numerics`, `tree`.

mod solution;

use crate::contact::friction::JointPhase;
use crate::dynamics::Dynamics;
use crate::dynamics::reactions::Wrench;
use crate::numerics::accuracy::ROUNDING_OF_SOLUTION;
use crate::numerics::turns::{Turns, with_turns};
use crate::tree::elements::Tree;
use crate::tree::friction::{DryJoint, Reacting};

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
    /// Whether each joint sticks or slides.
    phases: Vec<JointPhase>,
    joints: &'m [DryJoint],
    other: &'m Reacting,
    /// The same mechanism with reactions.
    reacting: Box<Dynamics<'m>>,
    q: Vec<f64>,
    v: Vec<f64>,
    /// Accelerations and multipliers without friction, and what that of each joint adds.
    kept: Response,
    responses: Vec<Response>,
    /// What friction of size one in a joint (columns) adds to the acceleration and to the reaction of another (rows).
    accelerances: Vec<f64>,
    influences: Vec<[f64; 2]>,
    /// Accelerations of the joints by drives.
    driven: Vec<f64>,
    /// Whether the responses exist in the state that was last followed.
    follows: bool,
    /// Whether friction was found there; `None` before, and after a change of phase.
    found: Option<bool>,
    /// Part of its largest friction that each joint transmits against its direction or load.
    fractions: Vec<f64>,
    /// Torque or force on the second body of each joint along its coordinate [N m or N].
    efforts: Vec<f64>,
    /// Joints that stick, and those of them on whose motions those of the others depend, with what they transmit.
    held: Vec<usize>,
    pulling: Vec<usize>,
    pulls: Vec<f64>,
    equations: Equations,
    /// Derivatives of all efforts, then of the pulls, with respect to every degree of freedom, then to their velocities,
    /// then to time.
    gradients: Vec<Vec<f64>>,
    /// Accelerations and multipliers with friction.
    whole: Response,
    /// The joint at which two solutions or none were found in the last state, with the bound.
    fault: Option<(usize, f64)>,
}

/// Memory of equations, of which there are at most two for every joint.
#[derive(Clone, Debug)]
struct Equations {
    matrix: Vec<f64>,
    weights: Vec<f64>,
    pivots: Vec<usize>,
    /// What is left of each, and the size of its terms.
    left: Vec<f64>,
    sizes: Vec<f64>,
}

impl<'m> Friction<'m> {
    /// That of a tree, if it has any: nothing acts until the joints stick or slide.
    pub(super) fn of(tree: &'m Tree) -> Option<Box<Self>> {
        let other = tree.reacting.as_ref()?;
        let (d, count) = (other.tree.degrees_of_freedom(), tree.dry_joints.len());
        let most = 2 * count;
        let reacting = Box::new(Dynamics::new(&other.tree));
        let response = Response {
            accelerations: vec![0.0; d],
            multipliers: vec![0.0; reacting.loops.multipliers.len()],
            without_loops: 0.0,
        };
        Some(Box::new(Self {
            phases: vec![JointPhase::default(); count],
            joints: &tree.dry_joints,
            other,
            reacting,
            q: vec![0.0; d],
            v: vec![0.0; d],
            kept: response.clone(),
            responses: vec![response.clone(); count],
            accelerances: vec![0.0; count * count],
            influences: vec![[0.0; 2]; count * count],
            driven: vec![0.0; count],
            follows: false,
            found: None,
            fractions: vec![0.0; count],
            efforts: vec![0.0; count],
            held: Vec::with_capacity(count),
            pulling: Vec::with_capacity(count),
            pulls: Vec::with_capacity(count),
            equations: Equations {
                matrix: vec![0.0; most * most],
                weights: vec![1.0; most],
                pivots: vec![0; most],
                left: vec![0.0; most],
                sizes: vec![0.0; most],
            },
            gradients: vec![vec![0.0; most]; 2 * tree.degrees_of_freedom() + 1],
            whole: response,
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
    pub fn joint_phases(&self) -> &[JointPhase] {
        self.friction.as_ref().map_or(&[], |friction| &friction.phases)
    }

    /// Lets the joint with friction of this index stick or slide.
    pub fn set_joint_phase(&mut self, index: usize, phase: JointPhase) {
        if let Some(friction) = &mut self.friction
            && friction.phases[index] != phase
        {
            friction.phases[index] = phase;
            friction.found = None;
        }
    }

    /// The same for all joints with friction.
    pub fn set_joint_phases(&mut self, phases: &[JointPhase]) {
        phases.iter().enumerate().for_each(|(index, &phase)| self.set_joint_phase(index, phase));
    }

    /// Takes over the phases of all contacts and joints and the states of the switches.
    pub fn copy_phases(&mut self, other: &Self) {
        self.phases.copy_from_slice(&other.phases);
        self.switches.copy_from_slice(&other.switches);
        if let (Some(own), Some(other)) = (&mut self.friction, &other.friction)
            && own.phases != other.phases
        {
            own.phases.copy_from_slice(&other.phases);
            own.found = None;
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

    /// Position of a joint with friction [rad or m] and its full turns, after [`Dynamics::move_to`].
    fn dry_position(&self, index: usize) -> (f64, Turns) {
        let columns = &self.tree.dry_joints[index].columns;
        let position = along(columns, |column| self.coordinates[column].position);
        (position, along(columns, |column| self.turns[column]))
    }

    /// Lets a joint stick in the state last moved to.
    pub fn stick_joint(&mut self, index: usize) {
        let (position, turns) = self.dry_position(index);
        self.set_joint_phase(index, JointPhase::Sticks { position, turns });
    }

    /// How far a joint is from where it sticks [rad or m], after [`Dynamics::move_to`]; zero where it slides.
    pub fn dry_offset(&self, index: usize) -> f64 {
        self.offset_from(index, self.joint_phases()[index])
    }

    fn offset_from(&self, index: usize, phase: JointPhase) -> f64 {
        let JointPhase::Sticks { position, turns } = phase else { return 0.0 };
        let (here, turns_here) = self.dry_position(index);
        with_turns(here - position, turns_here - turns)
    }

    /// Takes back how far a state is from where joints stick, and their velocities, by the smallest change in the metric of
    /// the mass matrix; after [`Dynamics::find_friction`] there.
    pub fn hold_still(&mut self, q: &mut [f64], v: &mut [f64]) {
        let Some(mut friction) = self.friction.take() else { return };
        friction.take_back(|joint, _| self.dry_velocity(joint), v);
        let phases = std::mem::take(&mut friction.phases);
        friction.take_back(|joint, _| self.offset_from(joint, phases[joint]), q);
        friction.phases = phases;
        self.friction = Some(friction);
    }

    /// The accelerations of all degrees of freedom that joints which stick hold back, after [`Dynamics::find_friction`].
    pub fn held_accelerations(&self, held: &mut [f64]) {
        held.fill(0.0);
        let Some(friction) = &self.friction else { return };
        for &joint in &friction.held {
            let (effort, by) = (friction.efforts[joint], &friction.responses[joint].accelerations);
            for (held, &freedom) in held.iter_mut().zip(&friction.other.freedoms) {
                *held -= effort * by[freedom];
            }
        }
    }

    /// Stops some joints by the smallest change of the velocities in the metric of the mass matrix, after
    /// [`Dynamics::find_friction`] in their state.
    pub fn stop_joints(&mut self, joints: &[usize], v: &mut [f64]) {
        let Some(mut friction) = self.friction.take() else { return };
        friction.select(|joint, _| joints.contains(&joint));
        friction.take_back(|joint, _| self.dry_velocity(joint), v);
        friction.found = None;
        self.friction = Some(friction);
    }

    /// Takes the rounding errors of the solutions back from accelerations: what sticks must not creep, however long.
    #[inline(never)]
    pub(super) fn hold_accelerations(&mut self, a: &mut [f64]) {
        let Some(mut friction) = self.friction.take() else { return };
        let off = |joint: usize, a: &[f64]| {
            let joint = &self.tree.dry_joints[joint];
            let driven = along(&joint.driven, |column| self.coordinates[column].acceleration);
            driven + along(&joint.free, |freedom| a[freedom])
        };
        friction.take_back(off, a);
        self.friction = Some(friction);
    }

    /// Mass [kg] or moment of inertia [kg m²] that friction in a joint moves, after [`Dynamics::find_friction`]; infinite
    /// where drives prescribe its motion.
    pub fn dry_inertia(&self, index: usize) -> f64 {
        let Some(friction) = &self.friction else { return f64::NAN };
        if friction.moves(index) { 1.0 / friction.accelerance(index, index) } else { f64::INFINITY }
    }

    /// Correlation of the motions of two joints: exactly 1 or -1 where neither moves without the other.
    pub fn dry_correlation(&self, index: usize, other: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.correlation(index, other))
    }

    /// Finds the friction in the state last moved to; false where it has two solutions or none.
    #[inline(never)]
    pub fn find_friction(&mut self) -> bool {
        let Some(mut friction) = self.friction.take() else { return true };
        let found = friction.find(self);
        self.friction = Some(friction);
        found
    }

    /// The fraction of its largest friction that a joint transmits, as its friction was last found; infinite where a joint
    /// that sticks cannot be held.
    pub fn dry_fraction(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.fractions[index])
    }

    /// Where a joint must go from a state of rest, as its friction was last found, if it cannot stay there: one that is held
    /// slides where it would need more than its largest friction, one that slides is held (0) where it would turn back.
    pub fn dry_departure(&self, index: usize) -> Option<f64> {
        let friction = self.friction.as_ref()?;
        let fraction = friction.fractions[index];
        match friction.phases[index] {
            JointPhase::Sticks { .. } => {
                (fraction.abs() > 1.0 + ROUNDING_OF_SOLUTION).then(|| fraction.signum())
            }
            JointPhase::Slides(direction) => (direction * friction.accelerates(index) < 0.0).then_some(0.0),
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
        let Some(mut friction) = self.friction.take() else { return };
        friction.differentiate(self);
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
            _ => f64::from(self.joint_phases()[index].sticks()),
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
