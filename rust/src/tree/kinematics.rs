//! Kinematics of a tree of frames: joint coordinates to positions, velocities and accelerations.
//!
//! Every frame k ≥ 1 is connected to its parent by one coordinate z_k: it turns about its origin (the
//! pivot) or slides along an axis fixed in the parent. Frame 0 is ground. In the plane the
//! columns of the velocity transformation `B = ∂r/∂z` and their derivatives have closed forms:
//!
//! ```text
//! r_k  = ∂r/∂z_k         = perp(r - p_k) for a revolute k,   u_k for a prismatic k
//! r_jk = ∂²r/∂z_j∂z_k    = perp(r_k) if j is revolute, 0 if j is prismatic  (j at or above k)
//! ∂ṙ/∂z_k                = perp(ṙ - ṗ_k) or perp(u_k) ω_parent
//! ∂r̈/∂z_k (ż, z̈ fixed)   = perp(r̈ - p̈_k) or perp(u_k) α_parent - u_k ω_parent²
//! ∂r̈/∂ż_k               = 2 ∂ṙ/∂z_k
//! ```
//!
//! because z_k rotates all bodies behind a revolute joint, with their velocities and accelerations relative
//! to the pivot, as one rigid configuration. They give the exact Jacobian of the dynamics without finite
//! differences.

use nalgebra::Vector2;

use crate::numerics::rotation::Anchor;

/// A vector in the plane.
pub type Vec2 = Vector2<f64>;

/// `vector` rotated by +90°.
#[inline(always)]
pub fn perp(vector: Vec2) -> Vec2 {
    Vec2::new(-vector.y, vector.x)
}

/// Unit vector along `vector`, whose length may be any positive number, even one whose square underflows.
pub fn direction(vector: Vec2) -> Vec2 {
    (vector / vector.amax()).normalize()
}

/// `vector` rotated by the angle with the given cosine and sine.
#[inline(always)]
pub fn rotated(vector: Vec2, cosine: f64, sine: f64) -> Vec2 {
    Vec2::new(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y)
}

/// Kind of the coordinate of a frame.
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

impl FrameKind {
    /// ∂θ/∂z: 1 for a revolute, 0 for a prismatic coordinate.
    pub fn rotation(self) -> f64 {
        match self {
            FrameKind::Revolute => 1.0,
            FrameKind::Prismatic { .. } => 0.0,
        }
    }
}

/// A frame of the tree and its connection to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Index of the parent frame; parents come before their children.
    pub parent: usize,
    /// Origin at z = 0 in the parent frame [m].
    pub anchor: Vec2,
    /// Kind of the coordinate.
    pub kind: FrameKind,
}

/// Motion of a frame: position, velocity and acceleration of its origin, and its rotation.
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
    /// ∂θ/∂z: 1 for a revolute, 0 for a prismatic frame.
    pub rotation: f64,
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
    /// A frame on a parent, with a coordinate of zero at rest.
    fn at_rest(frame: &Frame, parent: &FrameState) -> Self {
        let origin = parent.point(frame.anchor);
        let axis = match frame.kind {
            FrameKind::Revolute => Vec2::zeros(),
            FrameKind::Prismatic { axis } => parent.to_world(axis),
        };
        Self {
            position: origin.position,
            velocity: origin.velocity,
            acceleration: origin.acceleration,
            axis,
            rotation: frame.kind.rotation(),
            ..*parent
        }
    }

    /// Turns the frame against its parent.
    #[inline(always)]
    pub(super) fn turn(
        &mut self,
        parent: &FrameState,
        Coordinate { position, velocity, acceleration }: Coordinate,
        near: &mut Anchor,
    ) {
        self.angle = parent.angle + position;
        (self.sine, self.cosine) = near.sin_cos(self.angle);
        self.angular_velocity = parent.angular_velocity + velocity;
        self.angular_acceleration = parent.angular_acceleration + acceleration;
    }

    /// Moves the origin.
    #[inline(always)]
    pub(super) fn hang(&mut self, origin: PointState) {
        self.position = origin.position;
        self.velocity = origin.velocity;
        self.acceleration = origin.acceleration;
    }

    /// `vector`, given in this frame, in the world frame.
    #[inline]
    pub fn to_world(&self, vector: Vec2) -> Vec2 {
        rotated(vector, self.cosine, self.sine)
    }

    /// Motion of the origin.
    #[inline]
    pub fn origin(&self) -> PointState {
        PointState { position: self.position, velocity: self.velocity, acceleration: self.acceleration }
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

    /// Column ∂r/∂z of the velocity transformation, for a point on the frame or on a frame that it carries.
    #[inline(always)]
    pub fn column(&self, point: Vec2) -> Vec2 {
        // One of the two terms is zero; a branch would be slower.
        self.axis + self.rotation * perp(point - self.position)
    }

    /// ∂ṙ/∂z with ż fixed.
    #[inline]
    pub fn velocity_column(&self, velocity: Vec2) -> Vec2 {
        // The frame of a prismatic joint turns with its parent.
        self.angular_velocity * perp(self.axis) + self.rotation * perp(velocity - self.velocity)
    }

    /// ∂r̈/∂z with ż and z̈ fixed.
    #[inline]
    pub fn acceleration_column(&self, acceleration: Vec2) -> Vec2 {
        self.angular_acceleration * perp(self.axis)
            - self.angular_velocity * self.angular_velocity * self.axis
            + self.rotation * perp(acceleration - self.acceleration)
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

/// All frames at rest with their coordinates zero, on ground that accelerates [m/s²].
pub fn frames_at_rest(frames: &[Frame], ground_acceleration: Vec2) -> Vec<FrameState> {
    let ground = FrameState {
        position: Vec2::zeros(),
        velocity: Vec2::zeros(),
        acceleration: ground_acceleration,
        axis: Vec2::zeros(),
        rotation: 0.0,
        angle: 0.0,
        cosine: 1.0,
        sine: 0.0,
        angular_velocity: 0.0,
        angular_acceleration: 0.0,
    };
    let mut states = vec![ground];
    for frame in frames.iter().skip(1) {
        states.push(FrameState::at_rest(frame, &states[frame.parent]));
    }
    states
}
