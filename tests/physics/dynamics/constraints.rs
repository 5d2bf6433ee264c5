//! Constraints of the ideal joints in Cartesian coordinates, Eq. (12) and (13) of `[Xiang2020]`.
//!
//! Body i has the coordinates (x, y, θ) of its center of mass. Each constraint gives φ, its
//! Jacobian φ_q, φ_t and the right-hand side γ:
//!
//! ```text
//! φ(q, t) = 0
//! φ_q q̇ = -φ_t
//! φ_q q̈ = -(φ_q q̇)_q q̇ - 2 φ_qt q̇ - φ_tt = γ
//! ```
//!
//! The tree of joint coordinates satisfies them identically; they are the independent
//! statement of the same mechanism against which the tree and its joint reactions are tested.

use chebclear::scene::parts::{Attachment, Joint, JointKind, Scene};
use chebclear::scene::time_function::TimeFunction;
use chebclear::tree::kinematics::{Vec2, direction, perp, rotated};

/// Position and velocity of a body: center of mass and angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianState {
    /// Center of mass [m].
    pub position: Vec2,
    /// Angle [rad].
    pub angle: f64,
    /// Velocity of the center of mass [m/s].
    pub velocity: Vec2,
    /// Angular velocity [rad/s].
    pub angular_velocity: f64,
}

impl CartesianState {
    /// The fixed body.
    pub const GROUND: CartesianState = CartesianState {
        position: Vec2::new(0.0, 0.0),
        angle: 0.0,
        velocity: Vec2::new(0.0, 0.0),
        angular_velocity: 0.0,
    };

    fn to_world(self, vector: Vec2) -> Vec2 {
        let (sine, cosine) = self.angle.sin_cos();
        rotated(vector, cosine, sine)
    }
}

/// What a constraint forbids.
#[derive(Clone, Debug, PartialEq)]
pub enum ConstraintKind {
    /// The points coincide: `r_b + A_b s_b - r_a - A_a s_a = 0`.
    Revolute,
    /// Point b stays on the line through point a along `axis`, and the bodies do not turn:
    /// `(A_a perp(u)) · (p_b - p_a) = 0`, `θ_b - θ_a - angle = 0`.
    Prismatic {
        /// Unit vector u in the frame of body a [-].
        axis: Vec2,
        /// Angle of b relative to a [rad].
        angle: f64,
    },
    /// The points coincide and `θ_b - θ_a - angle = 0`.
    Fixed {
        /// Angle of b relative to a [rad].
        angle: f64,
    },
    /// The angle of a driven revolute joint: `θ_b - θ_a - motion(t) = 0`.
    Angle {
        /// Angle of b relative to a [rad].
        motion: TimeFunction,
    },
    /// The displacement of a driven prismatic joint: `(A_a u) · (p_b - p_a) - motion(t) = 0`.
    Displacement {
        /// Unit vector u in the frame of body a [-].
        axis: Vec2,
        /// Displacement of b [m].
        motion: TimeFunction,
    },
}

/// A constraint between two bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct CartesianConstraint {
    /// Name of the joint or drive.
    pub name: String,
    /// First body; `None` is ground.
    pub body_a: Option<usize>,
    /// Second body; `None` is ground.
    pub body_b: Option<usize>,
    /// Point on a, seen from its center of mass (ground: from the origin), in its frame [m].
    pub point_a: Vec2,
    /// Point on b likewise [m].
    pub point_b: Vec2,
    /// What is constrained.
    pub kind: ConstraintKind,
}

/// The ideal joints and drives of a scene as constraints, in the order of its joints, each drive
/// behind its joint.
///
/// # Errors
/// What is unknown in the reference of a joint.
pub fn cartesian_constraints(scene: &Scene) -> Result<Vec<CartesianConstraint>, String> {
    let seen_from_center = |end: Attachment| {
        let center = end.body.map_or([0.0; 2], |body| scene.bodies[body].center_of_mass);
        (end.body, Vec2::from(end.position) - Vec2::from(center))
    };
    let mut constraints = Vec::new();
    for joint in &scene.joints {
        let Joint::Ideal { name, a, b, kind, .. } = joint else { continue };
        let (body_a, point_a) = seen_from_center(scene.attachment(a)?);
        let (body_b, point_b) = seen_from_center(scene.attachment(b)?);
        let constraint = |name: &str, kind| CartesianConstraint {
            name: name.to_owned(),
            body_a,
            body_b,
            point_a,
            point_b,
            kind,
        };
        let ideal = match *kind {
            JointKind::Revolute => ConstraintKind::Revolute,
            JointKind::Prismatic { axis, angle } => {
                ConstraintKind::Prismatic { axis: direction(Vec2::from(axis)), angle }
            }
            JointKind::Fixed { angle } => ConstraintKind::Fixed { angle },
        };
        constraints.push(constraint(name, ideal));
        for drive in scene.drives.iter().filter(|drive| drive.joint() == name) {
            let motion = drive.motion();
            let driven = match *kind {
                JointKind::Prismatic { axis, .. } => {
                    ConstraintKind::Displacement { axis: direction(Vec2::from(axis)), motion }
                }
                JointKind::Revolute | JointKind::Fixed { .. } => ConstraintKind::Angle { motion },
            };
            constraints.push(constraint(drive.name(), driven));
        }
    }
    Ok(constraints)
}

/// One scalar equation of a constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equation {
    /// Residual φ [m or rad].
    pub phi: f64,
    /// ∂φ/∂(x, y, θ) of body a.
    pub phi_q_a: [f64; 3],
    /// ∂φ/∂(x, y, θ) of body b.
    pub phi_q_b: [f64; 3],
    /// ∂φ/∂t.
    pub phi_t: f64,
    /// Right-hand side γ of the acceleration equation.
    pub gamma: f64,
}

impl CartesianConstraint {
    /// The scalar equations of the constraint at time `t` [s], for the states of the two bodies.
    pub fn equations(&self, t: f64, a: &CartesianState, b: &CartesianState) -> Vec<Equation> {
        match &self.kind {
            ConstraintKind::Revolute => self.coincidence(a, b).to_vec(),
            ConstraintKind::Prismatic { axis, angle } => {
                vec![self.along(perp(*axis), [0.0; 4], a, b), relative_angle([*angle, 0.0, 0.0, 0.0], a, b)]
            }
            ConstraintKind::Fixed { angle } => {
                let mut equations = self.coincidence(a, b).to_vec();
                equations.push(relative_angle([*angle, 0.0, 0.0, 0.0], a, b));
                equations
            }
            ConstraintKind::Angle { motion } => vec![relative_angle(motion.at(t), a, b)],
            ConstraintKind::Displacement { axis, motion } => vec![self.along(*axis, motion.at(t), a, b)],
        }
    }

    /// x and y of `p_b - p_a = 0`.
    fn coincidence(&self, a: &CartesianState, b: &CartesianState) -> [Equation; 2] {
        let (arm_a, arm_b) = (a.to_world(self.point_a), b.to_world(self.point_b));
        let phi = b.position + arm_b - a.position - arm_a;
        // d/dt of -ω² arm is what remains of the acceleration when q̈ = 0.
        let gamma = b.angular_velocity.powi(2) * arm_b - a.angular_velocity.powi(2) * arm_a;
        let (turn_a, turn_b) = (perp(arm_a), perp(arm_b));
        [0, 1].map(|row| {
            let (mut phi_q_a, mut phi_q_b) = ([0.0; 3], [0.0; 3]);
            (phi_q_a[row], phi_q_b[row]) = (-1.0, 1.0);
            (phi_q_a[2], phi_q_b[2]) = (-turn_a[row], turn_b[row]);
            Equation { phi: phi[row], phi_q_a, phi_q_b, phi_t: 0.0, gamma: gamma[row] }
        })
    }

    /// `n · d = s(t)` with n = A_a `direction`, d = p_b - p_a; `motion` is s with its derivatives.
    fn along(&self, direction: Vec2, motion: [f64; 4], a: &CartesianState, b: &CartesianState) -> Equation {
        let (arm_a, arm_b) = (a.to_world(self.point_a), b.to_world(self.point_b));
        let normal = a.to_world(direction);
        let distance = b.position + arm_b - a.position - arm_a;
        let rate =
            b.velocity + b.angular_velocity * perp(arm_b) - a.velocity - a.angular_velocity * perp(arm_a);
        let turning = a.angular_velocity;
        // d̈ without q̈, and n̈ = -ω² n, ṅ = ω perp(n).
        let bias = turning * turning * arm_a - b.angular_velocity.powi(2) * arm_b;
        let gamma = turning * turning * normal.dot(&distance)
            - 2.0 * turning * perp(normal).dot(&rate)
            - normal.dot(&bias);
        Equation {
            phi: normal.dot(&distance) - motion[0],
            phi_q_a: [-normal.x, -normal.y, perp(normal).dot(&distance) - normal.dot(&perp(arm_a))],
            phi_q_b: [normal.x, normal.y, normal.dot(&perp(arm_b))],
            phi_t: -motion[1],
            gamma: gamma + motion[2],
        }
    }
}

/// `θ_b - θ_a = f(t)`; `motion` is f with its derivatives.
fn relative_angle(motion: [f64; 4], a: &CartesianState, b: &CartesianState) -> Equation {
    Equation {
        phi: b.angle - a.angle - motion[0],
        phi_q_a: [0.0, 0.0, -1.0],
        phi_q_b: [0.0, 0.0, 1.0],
        phi_t: -motion[1],
        gamma: motion[2],
    }
}
