//! Equations of motion in joint coordinates. In: a tree, an instant, a state; out: accelerations with their
//! exact derivatives, what contacts and joints do, energies. Uses `tree`, `contact`, `expression`, `numerics`.
//!
//! With `q̇ = B ż + b` (Cartesian velocities from joint rates) the ideal joints drop out of
//! Eq. (14) to (16) of `[Xiang2020]`:
//!
//! ```text
//! Bᵀ M B z̈ = Bᵀ (Q - M (Ḃ ż + ḃ))
//! ```
//!
//! Gravity enters as an acceleration -g of ground, at no cost per body: accelerations of frames and points
//! are therefore relative to free fall. A clearance joint between journal and bearing with `E = ∂e/∂z` and `S
//! = ∂spin/∂ż` contributes the generalized force `Eᵀ F + S F_t`, whatever the two bodies are.

mod contacts;
mod couplings;
mod energy;
mod forces;
mod friction;
mod inertia;
mod linearization;
mod loads;
mod loops;
mod reactions;
mod response;

pub use contacts::{SlotContact, SlotMotion, relative_motion};
pub use energy::ContactLoss;
use friction::Friction;
use inertia::Composites;
pub use linearization::Linearization;
use linearization::PairColumn;
pub use loads::{SwitchDistance, Uncertainty};
use loops::Loops;
pub use loops::{Correction, FirstOrder};
pub use reactions::Wrench;
pub use response::{Accelerance, Acting};

use crate::contact::pair::Phase;
use crate::numerics::instant::Instant;
use crate::numerics::turns::{Turns, with_turns};
use crate::tree::elements::{BodyPlacement, FramePoint, Tree};
use crate::tree::kinematics::{Coordinate, FrameState, PointState, Vec2, frames_at_rest};
use crate::tree::motions::FrameMotions;

/// Kinematics and dynamics of a mechanism in one state: scratch memory and the contact phase of every
/// slot.
#[derive(Clone, Debug)]
pub struct Dynamics<'m> {
    /// The mechanism as a tree of frames.
    pub tree: &'m Tree,
    /// Contact phase of every slot.
    pub phases: Vec<Phase>,
    /// State of every switch of the functions of the motion.
    pub switches: Vec<i64>,
    /// Full turns that were subtracted from the coordinate of every column.
    pub turns: Vec<Turns>,
    t: Instant,
    coordinates: Vec<Coordinate>,
    /// Third derivatives of the driven coordinates.
    jerks: Vec<f64>,
    motions: FrameMotions,
    states: Vec<FrameState>,
    /// Whether they have the accelerations of the free coordinates.
    accelerated: bool,
    composites: Composites,
    mass: Vec<f64>,
    /// Whether anything but contacts and inertia acts.
    has_forces: bool,
    /// Derivative of the force residual with respect to (q, v) of every column, d x columns.
    residual_q: Vec<f64>,
    residual_v: Vec<f64>,
    /// Its derivative with respect to time, followed by that of the relative accelerations of the closures.
    residual_t: Vec<f64>,
    /// ∂e/∂z, ∂ė/∂z and ∂spin/∂ż of one pair of points, for every column.
    pair_columns: Vec<PairColumn>,
    loops: Loops,
    /// Friction in ideal joints, if there is any.
    friction: Option<Box<Friction<'m>>>,
    scratch: Vec<f64>,
    /// See [`Dynamics::corrections`].
    corrections: [Vec<f64>; 2],
    /// The contact of every slot, after [`Dynamics::find_contacts`] or
    /// [`Dynamics::acceleration_and_contacts`].
    contacts: Vec<SlotContact>,
    /// Force and moment in every ideal joint, after [`Dynamics::find_reactions`].
    reactions: Vec<Wrench>,
    /// Inertial less applied forces of every body, with those of the bodies it carries: what its joint must
    /// supply.
    demands: Vec<Wrench>,
}

impl<'m> Dynamics<'m> {
    /// The mechanism with every contact in free flight.
    pub fn new(tree: &'m Tree) -> Self {
        let d = tree.degrees_of_freedom();
        let columns = tree.frames.len() - 1;
        let composites = Composites::new(tree);
        let row_masses = tree.row_masses.clone().filter(|_| composites.are_light()).unwrap_or_default();
        Self {
            tree,
            phases: vec![Phase::Free; tree.slots.len()],
            switches: vec![0; tree.switch_count()],
            turns: vec![0.0; columns],
            // NaN equals no instant: the frames have not been moved yet.
            t: f64::NAN.into(),
            jerks: vec![0.0; tree.driven.len()],
            coordinates: vec![Coordinate::default(); columns],
            motions: FrameMotions::new(&tree.frames, &tree.free, &tree.driven),
            states: frames_at_rest(&tree.frames, -tree.gravity),
            accelerated: false,
            mass: composites.matrix(d),
            has_forces: tree.has_forces(),
            composites,
            residual_q: vec![0.0; d * columns],
            residual_v: vec![0.0; d * columns],
            residual_t: vec![0.0; d + tree.closed_rows().sum::<usize>()],
            pair_columns: vec![PairColumn::default(); columns],
            loops: Loops::new(tree.closed_rows(), row_masses, d, columns),
            friction: Friction::of(tree),
            scratch: vec![0.0; d],
            corrections: [vec![0.0; d], vec![0.0; d]],
            contacts: vec![SlotContact::UNKNOWN; tree.slots.len()],
            reactions: vec![Wrench::default(); tree.ideal_joints.len()],
            demands: vec![Wrench::default(); tree.bodies.len()],
        }
    }

    /// Moves all frames to a state, with zero accelerations of the free coordinates.
    pub fn move_to(&mut self, t: impl Into<Instant>, q: &[f64], v: &[f64]) {
        self.move_to_instant(t.into(), q, v);
    }

    #[inline(never)]
    fn move_to_instant(&mut self, t: Instant, q: &[f64], v: &[f64]) {
        self.place_frames(t, q, v);
    }

    // Inlined because every evaluation begins with it.
    #[inline(always)]
    fn place_frames(&mut self, t: Instant, q: &[f64], v: &[f64]) {
        let Self { tree, motions, coordinates, jerks, turns, states, .. } = self;
        for (&column, (&position, &velocity)) in tree.free.iter().zip(q.iter().zip(v)) {
            coordinates[column] = Coordinate { position, velocity, acceleration: 0.0 };
        }
        let time_passed = self.t != t;
        if time_passed {
            self.t = t;
            motions.place_driven(t, &tree.driven, coordinates, jerks, turns, states);
        }
        motions.place_free(time_passed, coordinates, states);
        self.accelerated = false;
    }

    /// The instant of the state that the frames have.
    pub fn instant(&self) -> Instant {
        self.t
    }

    /// Whether the frames have the positions and velocities of this state.
    #[inline]
    pub fn is_at(&self, t: Instant, q: &[f64], v: &[f64]) -> bool {
        self.t == t
            && self.tree.free.iter().zip(q.iter().zip(v)).all(|(&column, (&position, &velocity))| {
                let coordinate = &self.coordinates[column];
                coordinate.position == position && coordinate.velocity == velocity
            })
    }

    /// Adds the accelerations of the free coordinates to the frames, after [`Dynamics::move_to`].
    pub fn accelerate(&mut self, a: &[f64]) {
        for (&column, &acceleration) in self.tree.free.iter().zip(a) {
            self.coordinates[column].acceleration = acceleration;
        }
        self.motions.accelerate(&self.coordinates, &mut self.states);
        self.accelerated = true;
    }

    /// Motion of a frame after [`Dynamics::move_to`]; accelerations are relative to free fall.
    pub fn frame(&self, frame: usize) -> &FrameState {
        &self.states[frame]
    }

    /// Angle of a frame [rad] including full turns.
    pub fn angle(&self, frame: usize) -> f64 {
        with_turns(self.states[frame].angle, self.frame_turns(frame))
    }

    /// Full turns that were subtracted from the angle of a frame.
    fn frame_turns(&self, frame: usize) -> Turns {
        self.tree.paths[frame].columns.iter().map(|&column| self.turns[column]).sum()
    }

    /// Angle of a body [rad] including full turns.
    pub fn body_angle(&self, body: usize) -> f64 {
        let body = &self.tree.bodies[body];
        self.angle(body.frame) + body.angle
    }

    /// Origin of a body frame [m] and its angle [rad] without full turns, after [`Dynamics::move_to`].
    pub fn body_pose(&self, body: &BodyPlacement) -> [f64; 3] {
        let frame = self.frame(body.frame);
        let origin = frame.point(body.origin).position;
        [origin.x, origin.y, frame.angle + body.angle]
    }

    /// Value and rates of the coordinate of a column; angles include full turns.
    pub fn coordinate(&self, column: usize) -> Coordinate {
        let coordinate = self.coordinates[column];
        Coordinate { position: with_turns(coordinate.position, self.turns[column]), ..coordinate }
    }

    /// Motion of a point after [`Dynamics::move_to`]; accelerations are relative to free fall.
    #[inline]
    pub fn point(&self, point: FramePoint) -> PointState {
        self.states[point.frame].point(point.offset)
    }

    /// Vector from one point to another [m] and its rate [m/s], after [`Dynamics::move_to`].
    #[inline]
    fn between(&self, points: [FramePoint; 2]) -> [Vec2; 2] {
        let [a, b] = points.map(|point| self.point(point));
        [b.position - a.position, b.velocity - a.velocity]
    }

    /// Accelerations of the degrees of freedom. Returns false where the mass matrix is singular, the loop
    /// closures are dependent, friction in ideal joints has two solutions or none, or a result is not finite.
    #[inline]
    pub fn acceleration(&mut self, t: impl Into<Instant>, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.evaluate::<false>(t.into(), q, v, a)
    }

    /// The same, and what [`Dynamics::find_contacts`] finds.
    pub fn acceleration_and_contacts(
        &mut self,
        t: impl Into<Instant>,
        q: &[f64],
        v: &[f64],
        a: &mut [f64],
    ) -> bool {
        self.evaluate::<true>(t.into(), q, v, a)
    }

    #[inline(always)]
    fn evaluate<const CONTACTS: bool>(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        // The guards may have moved the frames there.
        if self.accelerated || !self.is_at(t, q, v) {
            self.place_frames(t, q, v);
        }
        let d = a.len();
        self.composites.assemble(&self.states, &mut self.mass, a);
        for (index, slot) in self.tree.slots.iter().enumerate() {
            let phase = &self.phases[index];
            if let Phase::Contact { clipped: false, .. } = phase {
                let contact = self.add_contact(slot, phase, a);
                if CONTACTS {
                    self.contacts[index] = contact;
                }
            } else if CONTACTS {
                self.contacts[index] = self.contact_of(slot, *phase);
            }
        }
        if self.has_forces {
            if self.friction.is_some() && !self.find_friction() {
                return false;
            }
            self.add_forces(a);
        }
        if !self.factor_mass(d) {
            return false;
        }
        self.composites.solve(&self.mass, a);
        let closed = self.loops.right.is_empty() || self.close_accelerations(a);
        if self.friction.is_some() {
            self.hold_accelerations(a);
        }
        closed && a.iter().all(|a| a.is_finite())
    }

    /// Column of the velocity transformation B (displacement and rotation per unit of a coordinate) for a
    /// point on the frame of the column or on a frame that it carries.
    #[inline]
    fn column(&self, column: usize, point: Vec2) -> (Vec2, f64) {
        let frame = &self.states[column + 1];
        (frame.column(point), frame.rotation)
    }

    /// Adds the generalized force of a force on point b and its reaction on point a, with moments.
    // Inlined because every evaluation of a contact uses it: 1 % of a run.
    #[inline(always)]
    fn add_pair(
        &self,
        [a, b]: [FramePoint; 2],
        [position_a, position_b]: [Vec2; 2],
        force: Vec2,
        [moment_a, moment_b]: [f64; 2],
        forces: &mut [f64],
    ) {
        for &(column, i) in &self.tree.paths[b.frame].free {
            let (by, rotation) = self.column(column, position_b);
            forces[i] += by.dot(&force) + rotation * moment_b;
        }
        for &(column, i) in &self.tree.paths[a.frame].free {
            let (by, rotation) = self.column(column, position_a);
            forces[i] -= by.dot(&force) + rotation * moment_a;
        }
    }

    /// Jacobian ∂(p_b - p_a)/∂z of two points for every column, after [`Dynamics::move_to`].
    pub fn gap_columns(&self, [a, b]: [FramePoint; 2]) -> Vec<Vec2> {
        let mut columns = vec![Vec2::zeros(); self.coordinates.len()];
        for (point, sign) in [(b, 1.0), (a, -1.0)] {
            let position = self.point(point).position;
            for &column in &self.tree.paths[point.frame].columns {
                columns[column] += sign * self.column(column, position).0;
            }
        }
        columns
    }

    /// Whether the mass matrix is regular, after [`Dynamics::move_to`].
    pub fn is_regular(&mut self) -> bool {
        let d = self.scratch.len();
        self.composites.assemble(&self.states, &mut self.mass, &mut self.scratch);
        self.factor_mass(d)
    }
}
