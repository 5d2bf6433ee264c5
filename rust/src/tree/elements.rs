//! The elements of a tree of frames: flat and constant, holding only what the scene uses.
//!
//! The ideal joints span a tree; joints with clearance are not part of it, their contact slots only exert forces. Each moving
//! frame of the tree has one coordinate. Rigidly joined bodies share a frame, driven coordinates are
//! functions of time, and only the remaining, free coordinates are integrated: the paper's slider-crank has
//! 2 coordinates instead of 9 with 7 constraints. `span.rs` builds the tree.

use std::ops::Range;

use crate::contact::pair::ContactLaw;
use crate::numerics::instant::Instant;
use crate::numerics::turns::Turns;
use crate::scene::components::Components;
use crate::scene::time_function::TimeFunction;
use crate::tree::forces::{Ends, ForceElement, ForceLaw, Law, Link};
use crate::tree::friction::{DryJoint, Reacting};
use crate::tree::kinematics::{Coordinate, Frame, Vec2};
use crate::tree::loads::{Load, MotionLoad};

/// A coordinate that is a function of time.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenCoordinate {
    /// Name of the drive.
    pub name: String,
    /// Index of the joint in `ideal_joints`.
    pub joint: usize,
    /// Column of the coordinate (frame index minus one).
    pub column: usize,
    /// Angle [rad] or displacement [m] of body b of the joint relative to body a.
    pub motion: TimeFunction,
    /// Whether the coordinate is an angle.
    pub is_angle: bool,
    /// -1 if the tree passes a revolute joint from body b to body a.
    pub sign: f64,
}

impl DrivenCoordinate {
    /// Value and rates at an instant, the third derivative, and the full turns that were subtracted from the
    /// value if it is an angle.
    #[inline(always)]
    pub fn at(&self, t: Instant) -> (Coordinate, f64, Turns) {
        let (motion, turns) = if self.is_angle { self.motion.angle_at(t) } else { (self.motion.at(t), 0.0) };
        let [position, velocity, acceleration, jerk] = motion.map(|value| self.sign * value);
        (Coordinate { position, velocity, acceleration }, jerk, self.sign * turns)
    }
}

/// A body and its position on its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyPlacement {
    /// Name.
    pub name: String,
    /// Mass [kg].
    pub mass: f64,
    /// Moment of inertia about the center of mass [kg m²].
    pub inertia: f64,
    /// Frame that carries the body.
    pub frame: usize,
    /// Whether the frame was created for this body; other bodies on it are fixed to this one.
    pub owns_frame: bool,
    /// Origin of the body frame in the frame [m].
    pub origin: Vec2,
    /// Angle of the body frame in the frame [rad].
    pub angle: f64,
    /// Center of mass in the frame [m].
    pub center: Vec2,
    /// Named points in the frame [m].
    pub points: Vec<(String, Vec2)>,
}

/// The columns of the velocity transformation that move a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// All columns from the root to the frame, ascending.
    pub columns: Vec<usize>,
    /// The free ones among them, with the index of their degree of freedom.
    pub free: Vec<(usize, usize)>,
}

/// Inertia of all bodies fixed to one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameInertia {
    /// The frame.
    pub frame: usize,
    /// Mass [kg].
    pub mass: f64,
    /// Common center of mass in the frame [m].
    pub center: Vec2,
    /// Moment of inertia about it [kg m²].
    pub inertia: f64,
}

/// A point fixed on a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FramePoint {
    /// The frame.
    pub frame: usize,
    /// Position in the frame [m].
    pub offset: Vec2,
}

/// A place where two bodies may touch: one in a revolute joint with clearance, several in a guide with play.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSlot {
    /// Name: that of the joint, or that of the joint with its place in it.
    pub name: String,
    /// Center of the bearing and of the journal; or a point of the face and the center of the edge that may touch it.
    pub points: [FramePoint; 2],
    /// Indices of the bodies that carry them; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Dimensions and force laws.
    pub law: ContactLaw,
    /// Whether a law is of no common kind: one that can stick, or a formula.
    pub is_aside: bool,
    /// Lower bound of the impact velocity in the damping [m/s], if the scene gives one.
    pub impact_velocity_floor: Option<f64>,
    /// What touches instead where the corner is not over its face, if that has ends.
    pub neighbor: Option<Neighbor>,
    /// Index of the coupling with backlash of which it is a flank: the first component of its motion is then that along
    /// the pitch line, and the other is none.
    pub backlash: Option<usize>,
}

/// The other corner at an end of a guide with ends: one of the block on the face of the guide, and the end of that face on
/// the face of the block. One of the two is over the face of the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor {
    /// Its slot.
    pub slot: usize,
    /// The normal of the face there, in the axes of its body.
    pub normal: [f64; 2],
    /// 1 where the end at which it takes over lies ahead along the tangent of the own face, -1 where behind.
    pub side: f64,
}

/// A guide with play, or a slot with a pin: what its contacts have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// Name.
    pub name: String,
    /// A point in the middle of the guide, and the point of the second body that slides there.
    pub points: [FramePoint; 2],
    /// Indices of the two bodies; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Unit vector along the guide, in the frame of the first point.
    pub axis: Vec2,
    /// Angle of the second body against the first without tilt [rad]; `None` for a pin, which may turn.
    pub angle: Option<f64>,
    /// Its contacts.
    pub slots: Range<usize>,
}

/// A revolute joint at which a loop of ideal joints was cut: its two points must coincide.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Name of the joint.
    pub name: String,
    /// Point on the first body.
    pub a: FramePoint,
    /// Point on the second body.
    pub b: FramePoint,
    /// Indices of the two bodies.
    pub bodies: [Option<usize>; 2],
}

/// A coordinate that a coupling ties: the angle of a body relative to another, or the displacement in a joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoupledCoordinate {
    /// The columns of whose coordinates it is the sum, each with its factor.
    pub columns: Vec<(usize, f64)>,
    /// The free ones among them, by the index of their degree of freedom.
    pub free: Vec<(usize, f64)>,
    /// What is added to the sum [rad]; zero for a displacement.
    pub zero: f64,
    /// The body against which it counts and the one that moves; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Index of the prismatic joint among the ideal ones; `None` for an angle.
    pub slide: Option<usize>,
}

/// Where the teeth of two wheels, or of a rack and its pinion, touch: a place that does not move on the body that holds
/// both.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The pitch point on the frame of that body.
    pub pitch_point: FramePoint,
    /// Bodies of the teeth of the driver and of the driven ones; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Pitch radius of the smaller wheel [m].
    pub radius: f64,
    /// How far the driven teeth move there per unit of the driven coordinate [m/rad or 1].
    pub lever: f64,
    /// Unit vector in which they move, in the frame.
    pub tangent: Vec2,
    /// Force on the driven teeth across it, which separates the wheels, per unit of that along it; in the frame.
    pub separating: Vec2,
    /// The closures that carry the force from a wheel to that body, with its factor in the force of the closure.
    pub cut: Vec<(usize, f64)>,
}

/// A coupling whose teeth have play: it ties nothing, its two flanks are contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct Backlash {
    /// What it would tie without play.
    pub coupling: Coupling,
    /// Its teeth.
    pub mesh: Mesh,
    /// Its contacts: the driven teeth ahead of those of the driver, and behind them.
    pub slots: Range<usize>,
    /// How far the driven teeth move against the driver's along the pitch line per unit of each coordinate [m/rad or 1]:
    /// by column.
    pub columns: Vec<(usize, f64)>,
    /// The same of the free ones among them, by the index of their degree of freedom.
    pub free: Vec<(usize, f64)>,
}

/// A coordinate that is a function of another: driven = ratio driver + law(driver) + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Name.
    pub name: String,
    /// What follows.
    pub driven: CoupledCoordinate,
    /// What it follows.
    pub driver: CoupledCoordinate,
    /// The part in proportion.
    pub ratio: f64,
    /// The rest, as the index of a function of the motion; none in a gear.
    pub law: Option<usize>,
    /// Whether the rest repeats itself with every turn of the driver.
    pub repeats: bool,
    /// What is added [rad or m]; none until the assembly has found it.
    pub offset: Option<f64>,
    /// Its teeth, where a pressure angle places their force; a coupling with backlash has them beside it.
    pub mesh: Option<Mesh>,
    /// Its index in the scene.
    pub index: usize,
}

/// Equations of a closure: both components of the vector between its points.
pub const CLOSURE_ROWS: usize = 2;

/// Relative motion that an ideal joint allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IdealKind {
    /// Rotation.
    Revolute,
    /// Sliding.
    Prismatic,
    /// None.
    Fixed,
}

/// How the tree satisfies an ideal joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Realization {
    /// As an edge of the tree: it carries `child` by the coordinate of a column, or rigidly.
    Tree {
        /// The body it carries.
        child: usize,
        /// Column of its coordinate; `None` in a fixed joint.
        column: Option<usize>,
        /// -1 if the tree passes the joint from body b to body a.
        sign: f64,
    },
    /// Cut: as the loop closure with this index.
    Cut(usize),
}

/// An ideal joint, without clearance.
#[derive(Clone, Debug, PartialEq)]
pub struct IdealJoint {
    /// Name.
    pub name: String,
    /// Relative motion that it allows.
    pub kind: IdealKind,
    /// Indices of the two bodies; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// Its points on them.
    pub points: [FramePoint; 2],
    /// How the tree satisfies it.
    pub realization: Realization,
}

/// Scales for tolerances and error measures; all follow from the scene, none is absolute.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scales {
    /// Scales of every component of the scene.
    pub components: Vec<ComponentScales>,
    /// The component of every degree of freedom.
    pub of_freedoms: Vec<usize>,
    /// Largest displacement [m] of a point per unit of each degree of freedom.
    pub levers: Vec<f64>,
    /// Scales of the contact of every slot.
    pub contacts: Vec<ContactScales>,
}

/// Scales of a component, which what is not connected with it does not change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComponentScales {
    /// Its size [m].
    pub length: f64,
    /// Speed of its points [m/s]; zero if nothing moves at the start and nothing drives it.
    pub speed: f64,
}

impl ComponentScales {
    /// Its acceleration on a circle of its size [m/s²].
    pub fn acceleration(&self) -> f64 {
        self.speed.powi(2) / self.length
    }

    /// Time in which it moves by its size [s]; infinity if nothing moves it.
    pub fn crossing(&self) -> f64 {
        self.length / self.speed
    }
}

impl Scales {
    /// Rates of the coordinates of a component, each times its lever.
    fn moved<'s>(&'s self, component: usize, of: &'s [f64]) -> impl Iterator<Item = f64> + 's {
        let coordinates = of.iter().zip(&self.levers).zip(&self.of_freedoms);
        coordinates.filter(move |(_, own)| **own == component).map(|((x, lever), _)| (x * lever).abs())
    }

    /// Largest of rates of the coordinates of a component times their levers.
    pub fn largest(&self, component: usize, of: &[f64]) -> f64 {
        self.moved(component, of).fold(0.0, f64::max)
    }

    /// Largest acceleration of points of a component [m/s²], of these accelerations of the coordinates or of its scales.
    pub fn largest_acceleration(&self, component: usize, a: &[f64]) -> f64 {
        self.largest(component, a).max(self.components[component].acceleration())
    }

    /// Errors of accelerations relative to the largest of these in the same component: the worst of all components.
    pub fn relative_to_accelerations(&self, errors: &[f64], a: &[f64]) -> f64 {
        let of = |index: usize| self.largest(index, errors) / self.largest_acceleration(index, a);
        // Where nothing moves at all there is no error either.
        (0..self.components.len()).map(of).fold(0.0, f64::max)
    }

    /// Largest of rates of all coordinates times their levers.
    pub fn largest_of_all(&self, of: &[f64]) -> f64 {
        of.iter().zip(&self.levers).map(|(x, lever)| (x * lever).abs()).fold(0.0, f64::max)
    }

    /// The scales of the component of a clearance joint.
    #[inline]
    pub fn of_contact(&self, slot: usize) -> &ComponentScales {
        &self.components[self.contacts[slot].component]
    }

    /// Shortest time in which a component moves by its size [s].
    pub fn shortest_crossing(&self) -> f64 {
        self.components.iter().map(ComponentScales::crossing).fold(f64::INFINITY, f64::min)
    }
}

/// Scales of a contact that rests under the load of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactScales {
    /// The component of its bodies.
    pub component: usize,
    /// Effective mass [kg], the harmonic mean over all directions.
    pub mass: f64,
    /// Penetration at which the elastic force balances the load [m].
    pub resting_penetration: f64,
    /// Velocity amplitude of an oscillation about it whose displacement amplitude equals it [m/s].
    pub resting_speed: f64,
    /// Impact velocity at which the contact is critically damped under the load [m/s]; zero for a law whose
    /// damping does not depend on it.
    pub resting_velocity: f64,
}

/// Position and velocity of the free coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Free coordinates [rad or m].
    pub q: Vec<f64>,
    /// Their velocities [rad/s or m/s].
    pub v: Vec<f64>,
}

/// The bodies of a scene on a spanning tree of frames, with loop closures, clearance joints and forces.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// Frames, ground first, parents before children.
    pub frames: Vec<Frame>,
    /// Name of the coordinate of every column.
    pub coordinate_names: Vec<String>,
    /// Columns of the degrees of freedom, ascending.
    pub free: Vec<usize>,
    /// Coordinates that are functions of time.
    pub driven: Vec<DrivenCoordinate>,
    /// Indices of those whose speed changes.
    pub accelerated: Vec<usize>,
    /// For every frame the columns that move it.
    pub paths: Vec<Path>,
    /// Bodies in the order of the scene.
    pub bodies: Vec<BodyPlacement>,
    /// Which of them affect each other.
    pub components: Components,
    /// Inertias that the degrees of freedom move.
    pub inertias: Vec<FrameInertia>,
    /// Inertias that only drives move. They affect the efforts of the drives and the energies, not the
    /// motion.
    pub driven_inertias: Vec<FrameInertia>,
    /// Places where bodies may touch, in the order of the joints of the scene.
    pub slots: Vec<ContactSlot>,
    /// Guides with play and slots with pins, in the order of the scene.
    pub guides: Vec<Guide>,
    /// Loop closures, in the order of the scene; none in a tree.
    pub closures: Vec<Closure>,
    /// Couplings of coordinates without backlash, in the order of the scene.
    pub couplings: Vec<Coupling>,
    /// Couplings with backlash.
    pub backlashes: Vec<Backlash>,
    /// Columns of coordinates that stay zero, held by multipliers: see [`Reacting`].
    pub locks: Vec<usize>,
    /// Ideal joints with friction, in the order of the scene; none while the mechanism is assembled.
    pub dry_joints: Vec<DryJoint>,
    /// The tree that finds their reactions, if there are any.
    pub reacting: Option<Box<Reacting>>,
    /// Ideal joints, in the order of the scene.
    pub ideal_joints: Vec<IdealJoint>,
    /// The joints of the tree as indices of `ideal_joints`, parents before children.
    pub tree_joints: Vec<usize>,
    /// Springs, bushings, oil films, applied forces and torques, in this order.
    pub forces: Vec<ForceElement>,
    /// Functions of the motion among the applied forces and torques.
    pub motion_loads: Vec<MotionLoad>,
    /// Acceleration of free fall [m/s²].
    pub gravity: Vec2,
    /// Where bodies without mass or moment of inertia may make the mass matrix singular: what every row of the closures,
    /// couplings and locks adds to it, in [kg] or [kg m²] (see `dynamics`).
    pub row_masses: Option<Vec<f64>>,
}

impl Tree {
    /// Whether forces besides contacts and friction may depend on velocities.
    pub fn has_dampers(&self) -> bool {
        self.motion_loads.iter().any(|load| load.law_of.is_none())
            || self.forces.iter().any(|element| element.law.damps())
            || self.links().any(|(element, ..)| element.loads[0].is_some())
    }

    /// Number of coordinates that are not functions of time alone.
    pub fn degrees_of_freedom(&self) -> usize {
        self.free.len()
    }

    /// Degrees of freedom that remain once loops are closed and coordinates coupled; these equations are independent.
    pub fn mobility(&self) -> usize {
        self.free.len().saturating_sub(self.closed_rows().sum())
    }

    /// Mass of all bodies of a component [kg]; of those that only have moments of inertia, the mass with these at its size;
    /// 1 kg where drives prescribe the motion of a linkage without either.
    pub fn total_mass(&self, component: usize) -> f64 {
        let own = || {
            let bodies = self.bodies.iter().zip(&self.components.of_body);
            bodies.filter(|(_, of)| **of == component).map(|(body, _)| body)
        };
        let mass: f64 = own().map(|body| body.mass).sum();
        if mass > 0.0 {
            return mass;
        }
        let (inertia, length): (f64, f64) =
            (own().map(|body| body.inertia).sum(), self.components.lengths[component]);
        if inertia > 0.0 { inertia / (length * length) } else { 1.0 }
    }

    /// The component of every degree of freedom.
    pub(crate) fn components_of_freedoms(&self) -> Vec<usize> {
        let of_columns = self.components_of_columns();
        self.free.iter().map(|&column| of_columns[column]).collect()
    }

    /// The component of every column.
    pub(crate) fn components_of_columns(&self) -> Vec<usize> {
        let mut components = vec![0; self.frames.len() - 1];
        for (body, &component) in self.bodies.iter().zip(&self.components.of_body) {
            for &column in &self.paths[body.frame].columns {
                components[column] = component;
            }
        }
        components
    }

    /// Equations of every closure, coupling and lock, in the order of their rows.
    pub fn closed_rows(&self) -> impl Iterator<Item = usize> {
        let couplings = self.couplings.iter().map(|_| 1);
        let locks = self.locks.iter().map(|_| 1);
        self.closures.iter().map(|_| CLOSURE_ROWS).chain(couplings).chain(locks)
    }

    /// All couplings with their teeth, those without backlash first.
    pub fn all_couplings(&self) -> impl Iterator<Item = (&Coupling, Option<&Mesh>)> {
        let tied = self.couplings.iter().map(|coupling| (coupling, coupling.mesh.as_ref()));
        tied.chain(self.backlashes.iter().map(|backlash| (&backlash.coupling, Some(&backlash.mesh))))
    }

    /// Whether loops or couplings make the free coordinates depend on each other.
    pub fn has_loops(&self) -> bool {
        !(self.closures.is_empty() && self.couplings.is_empty() && self.locks.is_empty())
    }

    /// Whether a spring, a damper, an oil film, friction in an ideal joint or an applied force or torque acts.
    pub fn has_forces(&self) -> bool {
        !(self.forces.is_empty() && self.dry_joints.is_empty())
    }

    /// The next instant after `t` [s] at which a function of time in the scene is not smooth.
    pub fn next_break(&self, t: f64) -> f64 {
        self.time_functions().map(|(_, function)| function.next_break(t)).fold(f64::INFINITY, f64::min)
    }

    /// All functions of time in the scene: motions, forces, torques.
    pub fn time_functions(&self) -> impl Iterator<Item = (&str, &TimeFunction)> {
        let motions = self.driven.iter().map(|driven| (driven.name.as_str(), &driven.motion));
        let loads = self.forces.iter().flat_map(|element| {
            element.loads.iter().flatten().filter_map(|load| match load {
                Load::Time(function) => Some((element.name.as_str(), function)),
                Load::Motion(_) => None,
            })
        });
        motions.chain(loads)
    }

    /// Springs and dampers between points, with these.
    pub fn links(&self) -> impl Iterator<Item = (&ForceElement, [FramePoint; 2], &Link)> {
        self.forces.iter().filter_map(|element| match (&element.law, element.ends) {
            (ForceLaw::Link(link), Ends::Points(points)) => Some((element, points, link)),
            _ => None,
        })
    }

    /// Adds a force element.
    pub fn add_force(
        &mut self,
        name: &str,
        ends: Ends,
        bodies: [Option<usize>; 2],
        loads: [Option<Load>; 2],
        law: ForceLaw,
    ) {
        self.forces.push(ForceElement { name: name.to_owned(), ends, bodies, loads, law });
    }

    /// The factors of all columns in the angle of the second body relative to the first, and its value where all
    /// coordinates are zero.
    pub fn relative_angle(&self, bodies: [Option<usize>; 2]) -> (Vec<f64>, f64) {
        let mut columns = vec![0.0; self.frames.len() - 1];
        let mut zero = 0.0;
        for (body, sign) in bodies.into_iter().zip([-1.0, 1.0]) {
            let Some(placed) = body.map(|body| &self.bodies[body]) else { continue };
            zero += sign * placed.angle;
            for &column in &self.paths[placed.frame].columns {
                columns[column] += sign * self.frames[column + 1].kind.rotation();
            }
        }
        (columns, zero)
    }

    /// The function of the motion to which a switch belongs, and the index of the switch among its own.
    pub fn load_of_switch(&self, switch: usize) -> Option<(&MotionLoad, usize)> {
        let load = self.motion_loads.iter().find(|load| load.switches().contains(&switch))?;
        Some((load, switch - load.first_switch))
    }

    /// Number of switches of all functions of the motion.
    pub fn switch_count(&self) -> usize {
        self.motion_loads.last().map_or(0, |load| load.switches().end)
    }
}
