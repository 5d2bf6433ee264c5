//! The scene, as the user describes it.
//!
//! A [`Scene`] holds names and numbers only. The reader judges each number, [`Scene::check`] names and numbers together;
//! whether the parts form a mechanism that can be assembled is found out when
//! it is compiled, in [`crate::mechanism::compiled`].

use crate::contact::film::Lubricant;
use crate::contact::friction::{FrictionLaw, JointFriction};
use crate::contact::normal::NormalLaw;
use crate::contact::pair::SlidingVelocity;
use crate::error::meant_or_known;
use crate::scene::couplings::Coupling;
use crate::scene::loads::{Expression, Load};
use crate::scene::time_function::TimeFunction;

/// The name of the fixed body every scene has.
pub const GROUND: &str = "ground";
/// The point that every body has besides those of the user: its center of mass.
pub const CENTER_OF_MASS: &str = "center_of_mass";
/// First part of the names of the energies of the whole mechanism.
pub const ENERGY: &str = "energy";

/// A point with a name, in the frame of its body [m].
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Name, unique in its body.
    pub name: String,
    /// Position in the body frame [m].
    pub position: [f64; 2],
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name, unique in the scene.
    pub name: String,
    /// Mass [kg].
    pub mass: f64,
    /// Moment of inertia [kg m²] about the point `inertia_about`.
    pub inertia: f64,
    /// Center of mass in the body frame [m].
    pub center_of_mass: [f64; 2],
    /// Name of the point the moment of inertia refers to.
    pub inertia_about: String,
    /// Named points of the body.
    pub points: Vec<Point>,
    /// Initial guess of the angle of the body frame [rad], from which the assembly starts.
    pub angle: f64,
}

impl Body {
    /// Largest distance between two of its points, its center of mass included [m].
    pub(crate) fn extent(&self) -> f64 {
        extent(self.points.iter().map(|point| point.position).chain([self.center_of_mass]))
    }
}

/// Kind of an ideal joint.
#[derive(Clone, Debug, PartialEq)]
pub enum JointKind {
    /// The points coincide; the bodies turn.
    Revolute,
    /// Point b slides along the line through point a; the bodies do not turn.
    Prismatic {
        /// Direction of the line in the frame of body a; any length.
        axis: [f64; 2],
        /// Angle of body b relative to body a [rad].
        angle: f64,
    },
    /// The points coincide and the bodies do not turn.
    Fixed {
        /// Angle of body b relative to body a [rad].
        angle: f64,
    },
}

/// Largest distance between two of the points [m].
pub(crate) fn extent(points: impl Iterator<Item = [f64; 2]>) -> f64 {
    let points: Vec<[f64; 2]> = points.collect();
    let distance = |a: &[f64; 2], b: &[f64; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
    let from = |(index, a)| points[..index].iter().map(|b| distance(a, b)).fold(0.0, f64::max);
    points.iter().enumerate().map(from).fold(0.0, f64::max)
}

/// What slides in a guide with play.
#[derive(Clone, Debug, PartialEq)]
pub enum GuideShape {
    /// A block between two parallel faces: four corners may touch them.
    Block {
        /// Length along the axis [m].
        length: f64,
        /// Height across the axis [m]: of the block, or of the rod in a sleeve.
        height: f64,
        /// Distance of the block in the middle to each face [m].
        clearance: f64,
        /// Angle of body b relative to body a without tilt [rad].
        angle: f64,
        /// Whether the corners are those of body a: a sleeve of that length on a longer rod.
        is_sleeve: bool,
    },
    /// A pin between two parallel faces.
    Pin {
        /// Radius [m].
        radius: f64,
        /// Distance of the pin in the middle to each face [m].
        clearance: f64,
    },
    /// A corner or a round edge before one face; the axis is the normal out of the face.
    Stop {
        /// Radius of the edge [m].
        radius: f64,
    },
}

/// A joint between two points.
#[derive(Clone, Debug, PartialEq)]
pub enum Joint {
    /// An ideal joint, without clearance: a constraint.
    Ideal {
        /// Name, unique in the scene.
        name: String,
        /// Point on the first body, as `body.point`.
        a: String,
        /// Point on the second body.
        b: String,
        /// Relative motion that the joint allows.
        kind: JointKind,
        /// Friction of a revolute or prismatic joint, if any.
        friction: Option<JointFriction>,
    },
    /// A revolute joint with clearance: a contact force.
    Clearance {
        /// Name, unique in the scene.
        name: String,
        /// Center of the bearing, as `body.point`.
        bearing: String,
        /// Center of the journal, as `body.point`.
        journal: String,
        /// Journal radius [m].
        journal_radius: f64,
        /// Radial clearance [m].
        clearance: f64,
        /// Normal-force law.
        contact: NormalLaw,
        /// Friction law, if any.
        friction: Option<FrictionLaw>,
        /// Convention of the sliding velocity.
        sliding: SlidingVelocity,
        /// Lubricant between the surfaces, if any.
        film: Option<Lubricant>,
        /// Depth by which each sector of the bearing is worn [m]; none for a point contact.
        profile: Vec<f64>,
        /// Lower bound of the impact velocity in the damping [m/s]; `None`: chosen from the tolerance.
        impact_velocity_floor: Option<f64>,
    },
    /// A guide with play, a pin in a slot with play, or a stop: contact forces at straight faces.
    Guide {
        /// Name, unique in the scene.
        name: String,
        /// Point of the body that has the faces, in the middle of the guide, as `body.point`.
        a: String,
        /// Point of the body that slides, in its middle.
        b: String,
        /// Direction of the guide in the frame of body a; any length.
        axis: [f64; 2],
        /// What slides in it.
        shape: GuideShape,
        /// Length of the faces along the guide, in whose middle their point lies [m]; `None`: as long as needed.
        face_length: Option<f64>,
        /// Normal-force law of each contact.
        contact: NormalLaw,
        /// Friction law, if any.
        friction: Option<FrictionLaw>,
        /// Lower bound of the impact velocity in the damping [m/s]; `None`: chosen from the tolerance.
        impact_velocity_floor: Option<f64>,
    },
}

impl Joint {
    /// Name of the joint.
    pub fn name(&self) -> &str {
        match self {
            Joint::Ideal { name, .. } | Joint::Clearance { name, .. } | Joint::Guide { name, .. } => name,
        }
    }

    /// The two references with the names of their fields.
    pub(crate) fn references(&self) -> [(&'static str, &str); 2] {
        match self {
            Joint::Ideal { a, b, .. } | Joint::Guide { a, b, .. } => [("a", a), ("b", b)],
            Joint::Clearance { bearing, journal, .. } => [("bearing", bearing), ("journal", journal)],
        }
    }
}

/// The axes along which the components of a force are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceFrame {
    /// The axes of ground.
    Ground,
    /// The axes of the body the force acts on: it turns with the body.
    Body,
}

/// A force on the bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Force {
    /// Uniform gravity.
    Gravity {
        /// Acceleration of free fall [m/s²].
        acceleration: [f64; 2],
    },
    /// A spring and a damper in parallel between two points.
    Spring {
        /// Name, unique in the scene.
        name: String,
        /// Point on the first body, as `body.point`.
        a: String,
        /// Point on the second body.
        b: String,
        /// Stiffness [N/m]; zero for a damper alone.
        stiffness: f64,
        /// Unloaded length [m].
        length: f64,
        /// Damping along the line between the points [N s/m].
        damping: f64,
        /// Further tension [N].
        tension: Load,
    },
    /// A radial spring and damper between two points that may coincide, with a torsion spring and damper.
    Bushing {
        /// Name, unique in the scene.
        name: String,
        /// Point on the first body, as `body.point`.
        a: String,
        /// Point on the second body.
        b: String,
        /// Stiffness [N/m] and damping [N s/m] in all directions, torsional stiffness [N m/rad] and damping [N m s/rad].
        coefficients: [f64; 4],
        /// Formulas in the place of these numbers, which are zero then.
        formulas: [Option<Box<Expression>>; 4],
    },
    /// A torsion spring and a damper in parallel between two bodies.
    TorsionSpring {
        /// Name, unique in the scene.
        name: String,
        /// The first body.
        a: String,
        /// The second body.
        b: String,
        /// Stiffness [N m/rad]; zero for a damper alone.
        stiffness: f64,
        /// Angle of body b relative to body a in the unloaded spring [rad].
        angle: f64,
        /// Damping [N m s/rad].
        damping: f64,
    },
    /// A force at a point.
    Applied {
        /// Name, unique in the scene.
        name: String,
        /// Point at which it acts, as `body.point`.
        point: String,
        /// First component [N].
        x: Load,
        /// Second component [N].
        y: Load,
        /// Axes of the components.
        frame: ForceFrame,
    },
    /// A torque.
    Torque {
        /// Name, unique in the scene.
        name: String,
        /// The body on which it acts.
        body: String,
        /// The body on which its reaction acts.
        reaction: String,
        /// The torque [N m].
        torque: Load,
    },
}

impl Force {
    /// Name of the force; gravity has none.
    pub fn name(&self) -> Option<&str> {
        match self {
            Force::Gravity { .. } => None,
            Force::Spring { name, .. }
            | Force::Bushing { name, .. }
            | Force::TorsionSpring { name, .. }
            | Force::Applied { name, .. }
            | Force::Torque { name, .. } => Some(name),
        }
    }
}

/// A prescribed motion of a joint.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// A revolute joint turning at constant speed.
    Speed {
        /// Name, unique in the scene.
        name: String,
        /// Name of the revolute joint.
        joint: String,
        /// Angular velocity of body b relative to body a [rad/s].
        speed: f64,
        /// Angle of body b relative to body a at time zero [rad].
        angle: f64,
    },
    /// A revolute or prismatic joint whose coordinate is a given function of time.
    Motion {
        /// Name, unique in the scene.
        name: String,
        /// Name of the joint.
        joint: String,
        /// Angle [rad] or displacement [m] of body b relative to body a.
        motion: TimeFunction,
    },
}

impl Drive {
    /// Name of the drive.
    pub fn name(&self) -> &str {
        match self {
            Drive::Speed { name, .. } | Drive::Motion { name, .. } => name,
        }
    }

    /// The motion of the joint.
    pub fn motion(&self) -> TimeFunction {
        match self {
            Drive::Speed { speed, angle, .. } => TimeFunction::Polynomial(vec![*angle, *speed]),
            Drive::Motion { motion, .. } => motion.clone(),
        }
    }

    /// Name of the joint it moves.
    pub fn joint(&self) -> &str {
        match self {
            Drive::Speed { joint, .. } | Drive::Motion { joint, .. } => joint,
        }
    }
}

/// Initial conditions of a part of the mechanism. What is not given follows from the joints, the drives and
/// the initial guesses of the angles of the bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// Coordinate of an ideal joint.
    Joint {
        /// Name of the revolute or prismatic joint.
        joint: String,
        /// Angle [rad] or displacement [m] of body b relative to body a.
        position: Option<f64>,
        /// Its rate [rad/s or m/s].
        velocity: Option<f64>,
    },
    /// Angle and angular velocity of a body.
    Body {
        /// Name of the body.
        body: String,
        /// Angle of the body frame [rad].
        angle: Option<f64>,
        /// Angular velocity [rad/s].
        angular_velocity: Option<f64>,
    },
    /// Journal relative to its bearing; by default concentric and at relative rest.
    Clearance {
        /// Name of the clearance joint.
        joint: String,
        /// Vector from the bearing center to the journal center, in the axes of ground [m].
        eccentricity: [f64; 2],
        /// Its rate [m/s].
        rate: [f64; 2],
    },
    /// What slides in a guide with play; by default in the middle, without tilt, at relative rest. Values are followed
    /// by their rates.
    Guide {
        /// Name of the guide or slot.
        joint: String,
        /// Distance from the axis, to its left [m], and its rate [m/s].
        offset: [f64; 2],
        /// Angle from the axis [rad], and its rate [rad/s]; a pin has none.
        tilt: [f64; 2],
        /// Displacement along the axis [m], and its rate [m/s].
        displacement: [Option<f64>; 2],
    },
}

/// The user's description of a mechanism.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Named points fixed to ground [m]; `ground` alone is the origin.
    pub ground: Vec<Point>,
    /// The moving bodies.
    pub bodies: Vec<Body>,
    /// The joints.
    pub joints: Vec<Joint>,
    /// The forces.
    pub forces: Vec<Force>,
    /// The prescribed motions.
    pub drives: Vec<Drive>,
    /// Initial conditions.
    pub start: Vec<Start>,
    /// Coordinates that follow others.
    pub couplings: Vec<Coupling>,
}

/// A reference `body.point`, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// Index of the body; `None` is ground.
    pub body: Option<usize>,
    /// Position in the body frame [m].
    pub position: [f64; 2],
}

/// The two points of a joint, as far as they are known.
pub(crate) type Ends = [Option<Attachment>; 2];

/// Whether two joints join the same points of the same bodies.
pub(crate) fn same_points([a, b]: &Ends, others: &Ends) -> bool {
    a.is_some() && b.is_some() && (*others == [*a, *b] || *others == [*b, *a])
}

impl Scene {
    /// The two points of a joint.
    pub(crate) fn ends(&self, joint: &Joint) -> Ends {
        joint.references().map(|(_, reference)| self.attachment(reference).ok())
    }

    /// Resolves a reference such as `"rod.B"`, `"rod"` (origin of the body frame) or
    /// `"ground.O"`; the error says what is unknown and names the nearest known name.
    pub fn attachment(&self, reference: &str) -> Result<Attachment, String> {
        let (body_name, point_name) = match reference.split_once('.') {
            Some((body, point)) => (body, Some(point)),
            None => (reference, None),
        };
        let body = self.body_index(body_name)?;
        let points = body.map_or(&self.ground, |index| &self.bodies[index].points);
        let Some(point_name) = point_name else {
            return Ok(Attachment { body, position: [0.0, 0.0] });
        };
        if let Some(point) = points.iter().find(|point| point.name == point_name) {
            return Ok(Attachment { body, position: point.position });
        }
        if let (CENTER_OF_MASS, Some(index)) = (point_name, body) {
            return Ok(Attachment { body, position: self.bodies[index].center_of_mass });
        }
        let known = points.iter().map(|point| point.name.as_str()).chain(body.map(|_| CENTER_OF_MASS));
        Err(format!("unknown point {point_name:?} of {body_name:?}{}", meant_or_known(point_name, known)))
    }

    /// Index of a body by its name, `None` for ground; the error says what is unknown.
    pub fn body_index(&self, name: &str) -> Result<Option<usize>, String> {
        if name == GROUND {
            return Ok(None);
        }
        self.bodies.iter().position(|body| body.name == name).map(Some).ok_or_else(|| {
            let known = self.bodies.iter().map(|body| body.name.as_str()).chain([GROUND]);
            format!("unknown body {name:?}{}", meant_or_known(name, known))
        })
    }

    /// Moment of inertia of a body about its center of mass [kg m²] (parallel axis theorem).
    pub fn central_inertia(&self, body: &Body) -> f64 {
        match body.points.iter().find(|point| point.name == body.inertia_about) {
            Some(point) if body.inertia_about != CENTER_OF_MASS => {
                let arm =
                    [point.position[0] - body.center_of_mass[0], point.position[1] - body.center_of_mass[1]];
                body.inertia - body.mass * (arm[0] * arm[0] + arm[1] * arm[1])
            }
            _ => body.inertia,
        }
    }
}
