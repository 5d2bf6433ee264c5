//! Inertia: the mass matrix, the inertial forces, and their derivatives.
//!
//! For the coordinates at and above a frame all that hangs on it moves as one composite body
//! `[Featherstone2008]`: an entry of the mass matrix is one term instead of a sum over the bodies, and
//! the cost of a chain of n bodies grows with n² instead of n³. In the plane a composite body needs
//! its mass center, the motion of that, its moment of inertia and two scalars more.

use super::Dynamics;
use crate::tree::elements::{FrameInertia, Tree};
use crate::tree::kinematics::{FrameState, Vec2};

/// All that hangs on a frame, in motion.
#[derive(Clone, Copy, Debug)]
struct Composite {
    /// Mass [kg].
    mass: f64,
    /// Moment of inertia about the mass center [kg m²].
    inertia: f64,
    /// Mass center [m].
    center: Vec2,
    /// Its velocity [m/s].
    velocity: Vec2,
    /// Its acceleration [m/s²].
    acceleration: Vec2,
    /// Rate of the angular momentum about the mass center [N m].
    moment: f64,
    /// Σ m (c - C)·(ċ - Ċ) over the bodies [kg m²/s]: zero for a single one.
    spread: f64,
}

/// A composite body that the degrees of freedom move.
#[derive(Clone, Debug)]
struct Part {
    /// What sits on the frame itself.
    own: FrameInertia,
    /// Its mass center is the origin of the frame.
    centered: bool,
    /// The parts that hang on the frame.
    merges: Vec<Merge>,
    /// Mass of all [kg].
    mass: f64,
    /// The degree of freedom of the frame, if it is not driven.
    freedom: Option<usize>,
    /// The degrees of freedom above it: their frames and indices.
    above: Vec<(usize, usize)>,
}

impl Part {
    /// The composite body on its frame in motion; `bodies` are those of the parts before, which hold
    /// what hangs on it.
    #[inline(always)]
    fn compose(&self, frame: &FrameState, bodies: &[Composite]) -> Composite {
        // Sliders and what floats: their mass center is the origin.
        let center = if self.centered { frame.origin() } else { frame.point(self.own.center) };
        let mut body = Composite {
            mass: self.mass,
            inertia: self.own.inertia,
            center: center.position,
            velocity: center.velocity,
            acceleration: center.acceleration,
            moment: self.own.inertia * frame.angular_acceleration,
            spread: 0.0,
        };
        for merge in &self.merges {
            let child = &bodies[merge.child];
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
        body
    }
}

/// A composite body becomes a part of the one above it.
#[derive(Clone, Copy, Debug)]
struct Merge {
    /// Place of the child among the parts.
    child: usize,
    /// Mass of the child relative to the mass of both.
    fraction: f64,
    /// Product of the masses over their sum [kg].
    reduced_mass: f64,
}

/// The composite bodies of a mechanism.
#[derive(Clone, Debug)]
pub(super) struct Composites {
    /// From the leaves to the root.
    parts: Vec<Part>,
    /// One a part.
    bodies: Vec<Composite>,
    /// Entries of the lower triangle of the mass matrix, row-major, that no body couples.
    uncoupled: Vec<usize>,
}

impl Composites {
    pub(super) fn new(tree: &Tree) -> Self {
        let (count, d) = (tree.frames.len(), tree.free.len());
        let nothing = |frame| FrameInertia { frame, mass: 0.0, center: Vec2::zeros(), inertia: 0.0 };
        let mut own: Vec<FrameInertia> = (0..count).map(nothing).collect();
        for body in &tree.inertias {
            own[body.frame] = *body;
        }
        let mut masses: Vec<f64> = own.iter().map(|body| body.mass).collect();
        let mut merges = vec![Vec::new(); count];
        let mut parts: Vec<Part> = Vec::new();
        let mut coupled = vec![false; d * d];
        // Children come after their parents: what hangs on a frame is known when its turn comes.
        for frame in (1..count).rev().filter(|&frame| !tree.paths[frame].free.is_empty()) {
            if masses[frame] == 0.0 {
                continue;
            }
            let parent = tree.frames[frame].parent;
            let sum = masses[parent] + masses[frame];
            let fraction = masses[frame] / sum;
            let reduced_mass = masses[parent] * fraction;
            merges[parent].push(Merge { child: parts.len(), fraction, reduced_mass });
            masses[parent] = sum;
            let mut above = tree.paths[frame].free.clone();
            let freedom = above.pop_if(|(column, _)| *column + 1 == frame).map(|(_, freedom)| freedom);
            if let Some(i) = freedom {
                coupled[i * d + i] = true;
                above.iter().for_each(|&(_, j)| coupled[i * d + j] = true);
            }
            parts.push(Part {
                own: own[frame],
                centered: own[frame].center == Vec2::zeros(),
                merges: std::mem::take(&mut merges[frame]),
                mass: masses[frame],
                freedom,
                above: above.into_iter().map(|(column, j)| (column + 1, j)).collect(),
            });
        }
        let still = Composite {
            mass: 0.0,
            inertia: 0.0,
            center: Vec2::zeros(),
            velocity: Vec2::zeros(),
            acceleration: Vec2::zeros(),
            moment: 0.0,
            spread: 0.0,
        };
        let lower = (0..d).flat_map(|i| (0..=i).map(move |j| i * d + j));
        let uncoupled = lower.filter(|&entry| !coupled[entry]).collect();
        Self { bodies: vec![still; parts.len()], parts, uncoupled }
    }

    /// The lower triangle of the mass matrix, and the inertial forces with opposite sign.
    #[inline]
    pub(super) fn assemble(&mut self, states: &[FrameState], mass: &mut [f64], forces: &mut [f64]) {
        let d = forces.len();
        for (place, part) in self.parts.iter().enumerate() {
            let frame = &states[part.own.frame];
            let body = part.compose(frame, &self.bodies);
            self.bodies[place] = body;
            let Some(i) = part.freedom else { continue };
            let by = frame.column(body.center);
            forces[i] = -(body.mass * by.dot(&body.acceleration) + frame.rotation * body.moment);
            mass[i * d + i] = body.mass * by.norm_squared() + frame.rotation * body.inertia;
            for &(other, j) in &part.above {
                let other = &states[other];
                mass[i * d + j] = body.mass * by.dot(&other.column(body.center))
                    + frame.rotation * other.rotation * body.inertia;
            }
        }
        for &entry in &self.uncoupled {
            mass[entry] = 0.0;
        }
    }
}

impl Dynamics<'_> {
    /// Adds the derivatives of the inertial forces to those of the residual; frames in motion with
    /// their accelerations.
    pub(super) fn add_inertia_derivatives(&mut self) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        for place in 0..self.composites.parts.len() {
            let part = &self.composites.parts[place];
            let Part { own, freedom, .. } = *part;
            let body = part.compose(&self.states[own.frame], &self.composites.bodies);
            self.composites.bodies[place] = body;
            let path = &tree.paths[own.frame];
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
        let frame = &self.states[column + 1];
        let (by, rotation) = self.column(other, body.center);
        // Σ m B_other · a over the bodies of the composite, derived by the position of a column. With a body's center at
        // r = C + s, Σ m s = 0, and acceleration A + α, Σ m α = 0, the column of a revolute coordinate is perp(C + s - p):
        //
        //   Σ m [∂B·a + B·∂a] = m [∂B(C)·A + B(C)·∂a(C)] + Σ m [perp(perp s)·α + perp(s)·perp(α)]
        //
        // and the last sum vanishes, since perp(perp s)·α = -s·α and perp(s)·perp(α) = s·α: only the center counts.
        let by_position = by.dot(&frame.acceleration_column(body.acceleration))
            + self.second_column(other, column, body.center).dot(&body.acceleration);
        let by_velocity = body.mass * by.dot(&frame.velocity_column(body.velocity))
            + rotation * frame.rotation * body.spread;
        self.residual_q[i * columns + column] += body.mass * by_position;
        self.residual_v[i * columns + column] += 2.0 * by_velocity;
    }

    /// Adds ∂R/∂z̈ d³z/dt³ of the driven coordinates whose speed changes.
    pub(super) fn add_jerks(&mut self) {
        let tree = self.tree;
        for &index in &tree.accelerated {
            let (driven, jerk) = (tree.driven[index].column, self.jerks[index]);
            for (part, body) in self.composites.parts.iter().zip(&self.composites.bodies) {
                let frame = part.own.frame;
                let path = &tree.paths[frame];
                // Of the driven column and a free one, the lower says which composite both move.
                let free = match part.freedom {
                    Some(_) if path.columns.binary_search(&driven).is_ok() => {
                        &path.free[path.free.len() - 1..]
                    }
                    None if frame == driven + 1 => &path.free[..],
                    _ => continue,
                };
                let (by, rotation) = self.column(driven, body.center);
                for &(other, i) in free {
                    let (by_other, rotation_other) = self.column(other, body.center);
                    self.residual_t[i] +=
                        (body.mass * by.dot(&by_other) + body.inertia * rotation * rotation_other) * jerk;
                }
            }
            self.add_closure_jerks(driven, jerk);
        }
    }
}
