//! Joint coordinates to poses, velocities and accelerations of a tree of frames.
//!
//! Every frame k ≥ 1 hangs on its parent by one coordinate z_k: it turns about its origin (the
//! pivot) or slides along an axis fixed in the parent. Frame 0 is ground. In the plane the
//! columns of the velocity transformation `B = ∂r/∂z` and their derivatives are closed forms:
//!
//! ```text
//! r_k  = ∂r/∂z_k         = perp(r - p_k) for a revolute k,   u_k for a prismatic k
//! r_jk = ∂²r/∂z_j∂z_k    = perp(r_k) if j is revolute, 0 if j is prismatic  (j at or above k)
//! ∂ṙ/∂z_k                = perp(ṙ - ṗ_k) or perp(u_k) ω_parent
//! ∂r̈/∂z_k (ż, z̈ fixed)   = perp(r̈ - p̈_k) or perp(u_k) α_parent - u_k ω_parent²
//! ∂r̈/∂ż_k               = 2 ∂ṙ/∂z_k
//! ```
//!
//! because all that hangs on a revolute joint is one rigid picture turned by z_k. They make the
//! Jacobian of the dynamics exact without differences.

use nalgebra::Vector2;

/// A vector in the plane.
pub type Vec2 = Vector2<f64>;

/// `vector` turned by +90°.
#[inline(always)]
pub fn perp(vector: Vec2) -> Vec2 {
    Vec2::new(-vector.y, vector.x)
}

/// The direction of `vector`, whose length may be any number above zero, even one whose square is not.
pub fn direction(vector: Vec2) -> Vec2 {
    (vector / vector.amax()).normalize()
}

/// `vector` turned by the angle with the given cosine and sine.
#[inline(always)]
pub fn turned(vector: Vec2, cosine: f64, sine: f64) -> Vec2 {
    Vec2::new(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y)
}

/// What the coordinate of a frame does to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameKind {
    /// The frame turns about its origin by z [rad].
    Revolute,
    /// The frame slides by z [m] along `axis`, a unit vector in the parent frame.
    Prismatic {
        /// Direction of sliding in the parent frame [-].
        axis: Vec2,
    },
}

/// A frame of the tree and how it hangs on its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Index of the parent frame; parents come before their children.
    pub parent: usize,
    /// Origin at z = 0 in the parent frame [m].
    pub anchor: Vec2,
    /// What the coordinate does.
    pub kind: FrameKind,
}

/// Motion of a frame: position, velocity and acceleration of its origin and its turning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameState {
    /// Origin [m].
    pub position: Vec2,
    /// Velocity of the origin [m/s].
    pub velocity: Vec2,
    /// Acceleration of the origin [m/s²].
    pub acceleration: Vec2,
    /// Sliding axis in the world frame [-]; zero for a revolute frame.
    pub axis: Vec2,
    /// Angle [rad].
    pub angle: f64,
    /// Cosine of the angle.
    pub cosine: f64,
    /// Sine of the angle.
    pub sine: f64,
    /// Angular velocity [rad/s].
    pub angular_velocity: f64,
    /// Angular acceleration [rad/s²].
    pub angular_acceleration: f64,
}

impl FrameState {
    /// Ground, and the value of frames not computed yet.
    pub const GROUND: FrameState = FrameState {
        position: Vec2::new(0.0, 0.0),
        velocity: Vec2::new(0.0, 0.0),
        acceleration: Vec2::new(0.0, 0.0),
        axis: Vec2::new(0.0, 0.0),
        angle: 0.0,
        cosine: 1.0,
        sine: 0.0,
        angular_velocity: 0.0,
        angular_acceleration: 0.0,
    };

    /// `vector`, given in this frame, in the world frame.
    #[inline]
    pub fn to_world(&self, vector: Vec2) -> Vec2 {
        turned(vector, self.cosine, self.sine)
    }

    /// Motion of a point fixed in this frame at `offset` [m].
    #[inline(always)]
    pub fn point(&self, offset: Vec2) -> PointState {
        let arm = self.to_world(offset);
        PointState {
            position: self.position + arm,
            velocity: self.velocity + self.angular_velocity * perp(arm),
            acceleration: self.acceleration + self.angular_acceleration * perp(arm)
                - self.angular_velocity * self.angular_velocity * arm,
        }
    }
}

/// Motion of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointState {
    /// Position [m].
    pub position: Vec2,
    /// Velocity [m/s].
    pub velocity: Vec2,
    /// Acceleration [m/s²].
    pub acceleration: Vec2,
}

/// Value and rates of one coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordinate {
    /// z [rad or m].
    pub position: f64,
    /// ż.
    pub velocity: f64,
    /// z̈.
    pub acceleration: f64,
}

/// Moves all frames to the coordinates: `coordinates[k - 1]` belongs to frame k.
pub fn move_frames(frames: &[Frame], coordinates: &[Coordinate], states: &mut [FrameState]) {
    for index in 1..frames.len().min(coordinates.len() + 1) {
        let frame = &frames[index];
        let Coordinate { position: z, velocity, acceleration } = coordinates[index - 1];
        let parent = &states[frame.parent];
        let (omega, alpha) = (parent.angular_velocity, parent.angular_acceleration);
        states[index] = match frame.kind {
            FrameKind::Revolute => {
                let origin = parent.point(frame.anchor);
                let angle = parent.angle + z;
                let (sine, cosine) = angle.sin_cos();
                FrameState {
                    position: origin.position,
                    velocity: origin.velocity,
                    acceleration: origin.acceleration,
                    axis: Vec2::zeros(),
                    angle,
                    cosine,
                    sine,
                    angular_velocity: omega + velocity,
                    angular_acceleration: alpha + acceleration,
                }
            }
            FrameKind::Prismatic { axis } => {
                let origin = parent.point(frame.anchor + z * axis);
                let axis = parent.to_world(axis);
                FrameState {
                    position: origin.position,
                    velocity: origin.velocity + velocity * axis,
                    // Coriolis term of the sliding, and the sliding itself.
                    acceleration: origin.acceleration
                        + 2.0 * omega * velocity * perp(axis)
                        + acceleration * axis,
                    axis,
                    ..*parent
                }
            }
        };
    }
}

/// Gives frames that have been moved other accelerations: those of the coordinates.
pub fn accelerate_frames(frames: &[Frame], coordinates: &[Coordinate], states: &mut [FrameState]) {
    for (index, (frame, coordinate)) in frames.iter().skip(1).zip(coordinates).enumerate() {
        let Coordinate { velocity, acceleration, .. } = *coordinate;
        let (placed, rest) = states.split_at_mut(index + 1);
        let (parent, state) = (&placed[frame.parent], &mut rest[0]);
        let arm = state.position - parent.position;
        let (omega, alpha) = (parent.angular_velocity, parent.angular_acceleration);
        state.acceleration = parent.acceleration + alpha * perp(arm) - omega * omega * arm;
        match frame.kind {
            FrameKind::Revolute => state.angular_acceleration = alpha + acceleration,
            FrameKind::Prismatic { .. } => {
                state.acceleration += 2.0 * omega * velocity * perp(state.axis) + acceleration * state.axis;
                state.angular_acceleration = alpha;
            }
        }
    }
}

/// Column of the velocity transformation of a point: ∂r/∂z_k, frame k at or above the point.
#[inline(always)]
pub fn position_column(kind: FrameKind, frame: &FrameState, point: Vec2) -> Vec2 {
    match kind {
        FrameKind::Revolute => perp(point - frame.position),
        FrameKind::Prismatic { .. } => frame.axis,
    }
}

/// ∂ṙ/∂z_k with ż fixed.
#[inline]
pub fn velocity_column(kind: FrameKind, frame: &FrameState, velocity: Vec2) -> Vec2 {
    match kind {
        FrameKind::Revolute => perp(velocity - frame.velocity),
        // The frame of a prismatic joint turns with its parent.
        FrameKind::Prismatic { .. } => frame.angular_velocity * perp(frame.axis),
    }
}

/// ∂r̈/∂z_k with ż and z̈ fixed.
#[inline]
pub fn acceleration_column(kind: FrameKind, frame: &FrameState, acceleration: Vec2) -> Vec2 {
    match kind {
        FrameKind::Revolute => perp(acceleration - frame.acceleration),
        FrameKind::Prismatic { .. } => {
            frame.angular_acceleration * perp(frame.axis)
                - frame.angular_velocity * frame.angular_velocity * frame.axis
        }
    }
}

/// ∂θ/∂z_k: 1 for a revolute, 0 for a prismatic coordinate.
#[inline]
pub fn angle_column(kind: FrameKind) -> f64 {
    match kind {
        FrameKind::Revolute => 1.0,
        FrameKind::Prismatic { .. } => 0.0,
    }
}
