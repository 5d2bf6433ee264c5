//! The elements of a tree that exert forces besides contacts: springs, bushings, oil films, applied forces and torques.

use crate::contact::film::FilmLaw;
use crate::numerics::dual::Scalar;
use crate::tree::elements::FramePoint;
use crate::tree::loads::Load;

/// A spring and a damper between two points.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Name.
    pub name: String,
    /// Its ends.
    pub points: [FramePoint; 2],
    /// Indices of the bodies that carry them; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Unloaded length [m].
    pub length: f64,
    /// Damping [N s/m].
    pub damping: f64,
    /// Distance of its ends up to which rounding errors of their positions decide its direction [m]; zero if
    /// its force needs no direction.
    pub indistinct: f64,
}

impl Link {
    /// Tension [N] at a length [m] that grows at a rate [m/s].
    #[inline]
    pub fn tension<S: Scalar>(&self, length: S, rate: S) -> S {
        (length - self.length) * self.stiffness + rate * self.damping
    }
}

/// A radial spring and damper between two points that may coincide.
///
/// Its force acts on both bodies at the second point, and its damper sees the velocity of that point against the first
/// body: it makes no moment of its own, and turns with the bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Bushing {
    /// Name.
    pub name: String,
    /// Its ends.
    pub points: [FramePoint; 2],
    /// Indices of the bodies that carry them; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Damping [N s/m].
    pub damping: f64,
    /// Indices of functions of the motion in the place of both, which are zero then.
    pub formulas: [Option<usize>; 2],
}

/// The oil film of a clearance joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Name of the joint.
    pub name: String,
    /// Centers of the bearing and of the journal.
    pub points: [FramePoint; 2],
    /// Indices of the bodies that carry them; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Its force.
    pub law: FilmLaw,
}

/// A further tension of a spring or damper.
#[derive(Clone, Debug, PartialEq)]
pub struct Pull {
    /// Index of the spring or damper.
    pub link: usize,
    /// The tension [N].
    pub tension: Load,
}

/// A torsion spring and damper between two bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Torsion {
    /// Name.
    pub name: String,
    /// The frames of the bodies.
    pub frames: [usize; 2],
    /// Indices of the bodies; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Stiffness [N m/rad].
    pub stiffness: f64,
    /// Angle of the second frame relative to the first in the unloaded spring [rad].
    pub angle: f64,
    /// Damping [N m s/rad].
    pub damping: f64,
    /// Indices of functions of the motion in the place of stiffness and damping, which are zero then.
    pub formulas: [Option<usize>; 2],
}

/// An applied force at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedForce {
    /// Name.
    pub name: String,
    /// Point at which it acts.
    pub point: FramePoint,
    /// Index of the body it acts on; `None` is ground.
    pub body: Option<usize>,
    /// Its components [N].
    pub components: [Load; 2],
    /// Cosine and sine of the angle between the axes of the components and those of the frame, if
    /// the force rotates with the frame.
    pub body_axes: Option<[f64; 2]>,
}

/// An applied torque between two bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedTorque {
    /// Name.
    pub name: String,
    /// Frame on which its reaction acts, frame on which it acts.
    pub frames: [usize; 2],
    /// Indices of the bodies likewise; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// The torque [N m].
    pub torque: Load,
}
