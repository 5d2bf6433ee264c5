//! Inertia: the mass matrix, the inertial forces, and their derivatives.
//!
//! For the coordinates at and above a frame all that hangs on it moves as one composite body
//! `[Featherstone2008]`: an entry of the mass matrix is one term instead of a sum over the bodies, and
//! the cost of a chain of n bodies grows with n² instead of n³. In the plane a composite body needs
//! its mass centre, the motion of that, its moment of inertia and two scalars more.

use super::Dynamics;
use crate::kinematics::{
    Frame, FrameState, Vec2, acceleration_column, angle_column, position_column, velocity_column,
};
use crate::mechanism::{FrameInertia, Mechanism};

/// All that hangs on a frame, in motion.
#[derive(Clone, Copy, Debug)]
struct Composite {
    /// Mass [kg].
    mass: f64,
    /// Moment of inertia about the mass centre [kg m²].
    inertia: f64,
    /// Mass centre [m].
    center: Vec2,
    /// Its velocity [m/s].
    velocity: Vec2,
    /// Its acceleration [m/s²].
    acceleration: Vec2,
    /// Rate of the angular momentum about the mass centre [N m].
    moment: f64,
    /// Σ m (c - C)·(ċ - Ċ) over the bodies [kg m²/s]: zero for a single one.
    spread: f64,
}

/// A composite body that the degrees of freedom move.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// What sits on the frame itself.
    own: FrameInertia,
    /// The degree of freedom of the frame, if it is not driven.
    freedom: Option<usize>,
}

/// A composite body becomes a part of the one above it.
#[derive(Clone, Copy, Debug)]
struct Merge {
    child: usize,
    parent: usize,
    /// Mass of the child relative to the mass of both.
    fraction: f64,
    /// Product of the masses over their sum [kg].
    reduced_mass: f64,
}

/// The composite bodies of a mechanism.
#[derive(Clone, Debug)]
pub(super) struct Composites {
    parts: Vec<Part>,
    /// From the leaves to the root.
    merges: Vec<Merge>,
    /// One a frame; those that only drives move stay empty.
    bodies: Vec<Composite>,
}

impl Composites {
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        let count = mechanism.frames.len();
        let nothing = |frame| FrameInertia { frame, mass: 0.0, center: Vec2::zeros(), inertia: 0.0 };
        let mut own: Vec<FrameInertia> = (0..count).map(nothing).collect();
        for body in &mechanism.inertias {
            own[body.frame] = *body;
        }
        let mut masses: Vec<f64> = own.iter().map(|body| body.mass).collect();
        let mut merges = Vec::new();
        for child in (1..count).rev() {
            let parent = mechanism.frames[child].parent;
            if masses[child] > 0.0 && !mechanism.paths[parent].free.is_empty() {
                let sum = masses[parent] + masses[child];
                let fraction = masses[child] / sum;
                merges.push(Merge { child, parent, fraction, reduced_mass: masses[parent] * fraction });
                masses[parent] = sum;
            }
        }
        let freedom = |frame: usize| {
            let last = mechanism.paths[frame].free.last();
            last.filter(|&&(column, _)| column + 1 == frame).map(|&(_, freedom)| freedom)
        };
        let parts = (1..count)
            .filter(|&frame| masses[frame] > 0.0)
            .map(|frame| Part { own: own[frame], freedom: freedom(frame) })
            .collect();
        let still = Composite {
            mass: 0.0,
            inertia: 0.0,
            center: Vec2::zeros(),
            velocity: Vec2::zeros(),
            acceleration: Vec2::zeros(),
            moment: 0.0,
            spread: 0.0,
        };
        let bodies = masses.iter().map(|&mass| Composite { mass, ..still }).collect();
        Self { parts, merges, bodies }
    }

    /// Puts the composite bodies together for frames in motion.
    #[inline(always)]
    fn compose(&mut self, states: &[FrameState]) {
        for Part { own, .. } in &self.parts {
            let frame = &states[own.frame];
            let center = frame.point(own.center);
            let body = &mut self.bodies[own.frame];
            body.inertia = own.inertia;
            body.center = center.position;
            body.velocity = center.velocity;
            body.acceleration = center.acceleration;
            body.moment = own.inertia * frame.angular_acceleration;
            body.spread = 0.0;
        }
        for merge in &self.merges {
            let child = self.bodies[merge.child];
            let body = &mut self.bodies[merge.parent];
            let arm = child.center - body.center;
            let (rate, acceleration) =
                (child.velocity - body.velocity, child.acceleration - body.acceleration);
            body.inertia += child.inertia + merge.reduced_mass * arm.norm_squared();
            body.moment += child.moment + merge.reduced_mass * arm.perp(&acceleration);
            body.spread += child.spread + merge.reduced_mass * arm.dot(&rate);
            body.center += merge.fraction * arm;
            body.velocity += merge.fraction * rate;
            body.acceleration += merge.fraction * acceleration;
        }
    }

    /// The lower triangle of the mass matrix, and the inertial forces taken from `forces`.
    #[inline]
    pub(super) fn assemble(
        &mut self,
        mechanism: &Mechanism,
        states: &[FrameState],
        mass: &mut [f64],
        forces: &mut [f64],
    ) {
        self.compose(states);
        let d = forces.len();
        let frames = &mechanism.frames[..];
        mass.fill(0.0);
        for part in &self.parts {
            let Some(i) = part.freedom else { continue };
            let body = &self.bodies[part.own.frame];
            let (by, turn) = column(frames, states, part.own.frame, body.center);
            forces[i] -= body.mass * by.dot(&body.acceleration) + turn * body.moment;
            let row = &mut mass[i * d..(i + 1) * d];
            for &(other, j) in &mechanism.paths[part.own.frame].free {
                let (by_other, turn_other) = column(frames, states, other + 1, body.center);
                row[j] = body.mass * by.dot(&by_other) + turn * turn_other * body.inertia;
            }
        }
    }
}

/// Column of the velocity transformation of a point that hangs on a frame.
#[inline]
fn column(frames: &[Frame], states: &[FrameState], frame: usize, point: Vec2) -> (Vec2, f64) {
    let kind = frames[frame].kind;
    (position_column(kind, &states[frame], point), angle_column(kind))
}

impl Dynamics<'_> {
    /// Adds the derivatives of the inertial forces to those of the residual; frames in motion with
    /// their accelerations.
    pub(super) fn add_inertia_derivatives(&mut self) {
        self.composites.compose(&self.states);
        let mechanism = self.mechanism;
        let columns = self.coordinates.len();
        for place in 0..self.composites.parts.len() {
            let Part { own, freedom } = self.composites.parts[place];
            let body = self.composites.bodies[own.frame];
            let path = &mechanism.paths[own.frame];
            let lower = own.frame - 1;
            // Of two columns the lower one says which composite body both move.
            if let Some(i) = freedom {
                for &column in &path.columns {
                    self.add_inertia_derivative(&body, (lower, i), column, columns);
                }
            }
            for &(other, i) in path.free.iter().filter(|(other, _)| *other != lower) {
                self.add_inertia_derivative(&body, (other, i), lower, columns);
            }
        }
    }

    /// Adds the derivative of the inertial force of a degree of freedom with respect to a column.
    #[inline]
    fn add_inertia_derivative(
        &mut self,
        body: &Composite,
        (other, i): (usize, usize),
        column: usize,
        columns: usize,
    ) {
        let kind = self.mechanism.frames[column + 1].kind;
        let frame = &self.states[column + 1];
        let (by, turn) = self.column(other, body.center);
        // The spread of the accelerations enters twice, with opposite signs.
        let by_position = by.dot(&acceleration_column(kind, frame, body.acceleration))
            + self.second_column(other, column, body.center).dot(&body.acceleration);
        let by_velocity = body.mass * by.dot(&velocity_column(kind, frame, body.velocity))
            + turn * angle_column(kind) * body.spread;
        self.residual_q[i * columns + column] += body.mass * by_position;
        self.residual_v[i * columns + column] += 2.0 * by_velocity;
    }

    /// Adds ∂R/∂z̈ d³z/dt³ of the driven coordinates whose speed changes.
    pub(super) fn add_jerks(&mut self) {
        let mechanism = self.mechanism;
        for &index in &mechanism.accelerated {
            let (driven, jerk) = (mechanism.driven[index].column, self.jerks[index]);
            for part in &self.composites.parts {
                let frame = part.own.frame;
                let body = &self.composites.bodies[frame];
                let path = &mechanism.paths[frame];
                // Of the driven column and a free one, the lower says which composite both move.
                let free = match part.freedom {
                    Some(_) if path.columns.binary_search(&driven).is_ok() => {
                        &path.free[path.free.len() - 1..]
                    }
                    None if frame == driven + 1 => &path.free[..],
                    _ => continue,
                };
                let (by, turn) = self.column(driven, body.center);
                for &(other, i) in free {
                    let (by_other, turn_other) = self.column(other, body.center);
                    self.residual_t[i] +=
                        (body.mass * by.dot(&by_other) + body.inertia * turn * turn_other) * jerk;
                }
            }
            self.add_closure_jerks(driven, jerk);
        }
    }
}
