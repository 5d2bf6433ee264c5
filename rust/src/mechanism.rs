//! The compiled mechanism: flat, constant, holding only what the scene uses.
//!
//! The ideal joints span a tree; clearance joints are cut, they only exert forces. Each moving
//! frame of the tree has one coordinate. Rigidly joined bodies share a frame, a driven
//! coordinate is a function of time, and what remains free is all that is integrated: the
//! paper's slider-crank has 2 coordinates instead of 9 and 7 constraints.

use std::collections::VecDeque;

use crate::clearance::ClearanceLaw;
use crate::error::{Problem, SceneError};
use crate::kinematics::{Coordinate, Frame, FrameKind, Vec2, direction, turned};
use crate::scene::{Attachment, Drive, Force, GROUND, Joint, JointKind, Scene};

/// A coordinate that is a function of time.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenCoordinate {
    /// Name of the drive.
    pub name: String,
    /// Column of the coordinate (frame index minus one).
    pub column: usize,
    /// Angle at time zero [rad].
    pub angle: f64,
    /// Constant speed [rad/s].
    pub speed: f64,
    /// -1 where the tree runs through the joint from body b to body a.
    pub sign: f64,
}

impl DrivenCoordinate {
    /// Value and rates at time `t` [s].
    pub fn at(&self, t: f64) -> Coordinate {
        Coordinate {
            position: self.sign * (self.angle + self.speed * t),
            velocity: self.sign * self.speed,
            acceleration: 0.0,
        }
    }
}

/// A body and where it sits on its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyPlacement {
    /// Name.
    pub name: String,
    /// Mass [kg].
    pub mass: f64,
    /// Moment of inertia about the centre of mass [kg m²].
    pub inertia: f64,
    /// Frame that carries the body.
    pub frame: usize,
    /// The frame was made for this body; others are welded to it.
    pub hung: bool,
    /// Origin of the body frame in the frame [m].
    pub origin: Vec2,
    /// Angle of the body frame in the frame [rad].
    pub angle: f64,
    /// Centre of mass in the frame [m].
    pub center: Vec2,
}

/// The columns of the velocity transformation that move a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// All columns from the root to the frame, ascending.
    pub columns: Vec<usize>,
    /// The free ones among them, with the index of their degree of freedom.
    pub free: Vec<(usize, usize)>,
}

/// Mass of all bodies rigidly joined on one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameInertia {
    /// The frame.
    pub frame: usize,
    /// Mass [kg].
    pub mass: f64,
    /// Common centre of mass in the frame [m].
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

/// A revolute joint with clearance.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearanceJoint {
    /// Name.
    pub name: String,
    /// Centre of the bearing.
    pub bearing: FramePoint,
    /// Centre of the journal.
    pub journal: FramePoint,
    /// Sizes and force laws.
    pub law: ClearanceLaw,
    /// Floor of the latched impact velocity [m/s].
    pub impact_velocity_floor: f64,
    /// Mass the contact accelerates, at the start [kg]; an order of magnitude for step sizes.
    pub effective_mass: f64,
    /// Penetration at which the contact carries the load of the start [m].
    pub resting_penetration: f64,
    /// Velocity of an oscillation about it that just stays in contact [m/s].
    pub resting_speed: f64,
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
}

/// Sizes by which errors are judged; all come from the scene, none is absolute.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scales {
    /// Size of the mechanism [m].
    pub length: f64,
    /// Speed of its points [m/s]; zero if nothing moves at the start and nothing drives it.
    pub speed: f64,
    /// Largest displacement [m] of a point per unit of each degree of freedom.
    pub levers: Vec<f64>,
}

/// Position and velocity of the free coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Free coordinates [rad or m].
    pub q: Vec<f64>,
    /// Their velocities [rad/s or m/s].
    pub v: Vec<f64>,
}

/// A compiled scene.
#[derive(Clone, Debug)]
pub struct Mechanism {
    /// Frames, ground first, parents before children.
    pub frames: Vec<Frame>,
    /// Name of the coordinate of every column.
    pub coordinate_names: Vec<String>,
    /// Columns of the degrees of freedom, ascending.
    pub free: Vec<usize>,
    /// Coordinates that are functions of time.
    pub driven: Vec<DrivenCoordinate>,
    /// For every frame the columns that move it.
    pub paths: Vec<Path>,
    /// Bodies in the order of the scene.
    pub bodies: Vec<BodyPlacement>,
    /// Inertias that the degrees of freedom move.
    pub inertias: Vec<FrameInertia>,
    /// Inertias that only drives move: they matter for nothing but the drives' torques.
    pub driven_inertias: Vec<FrameInertia>,
    /// Joints with clearance, in the order of the scene.
    pub clearance_joints: Vec<ClearanceJoint>,
    /// Loop closures, in the order of the scene; none in a tree.
    pub closures: Vec<Closure>,
    /// Acceleration of free fall [m/s²].
    pub gravity: Vec2,
    /// Assembled start: every clearance joint concentric in position and velocity.
    pub start: State,
    /// Scales for error control.
    pub scales: Scales,
}

impl Mechanism {
    /// The tree of a checked scene, not assembled yet: start and scales are empty.
    pub(crate) fn span(scene: &Scene) -> Result<Mechanism, SceneError> {
        let mut builder = Builder::new(scene);
        builder.span()?;
        Ok(builder.finish())
    }

    /// Number of coordinates that are not functions of time alone.
    pub fn degrees_of_freedom(&self) -> usize {
        self.free.len()
    }

    /// Degrees of freedom that remain once the loops are closed; the closures are independent.
    pub fn mobility(&self) -> usize {
        self.free.len().saturating_sub(2 * self.closures.len())
    }
}

/// Where a body ended up while the tree grows.
#[derive(Clone, Copy)]
struct Placement {
    frame: usize,
    hung: bool,
    origin: Vec2,
    angle: f64,
}

impl Placement {
    const GROUND: Placement = Placement { frame: 0, hung: false, origin: Vec2::new(0.0, 0.0), angle: 0.0 };

    /// A point of the body in the coordinates of its frame.
    fn to_frame(self, point: [f64; 2]) -> Vec2 {
        self.origin + rotated(Vec2::from(point), self.angle)
    }
}

fn rotated(vector: Vec2, angle: f64) -> Vec2 {
    let (sine, cosine) = angle.sin_cos();
    turned(vector, cosine, sine)
}

struct Builder<'a> {
    scene: &'a Scene,
    placements: Vec<Option<Placement>>,
    /// For every joint of the scene whether it is cut.
    cut: Vec<bool>,
    frames: Vec<Frame>,
    coordinate_names: Vec<String>,
    driven: Vec<DrivenCoordinate>,
}

impl<'a> Builder<'a> {
    fn new(scene: &'a Scene) -> Self {
        let ground = Frame { parent: 0, anchor: Vec2::zeros(), kind: FrameKind::Revolute };
        Self {
            scene,
            placements: vec![None; scene.bodies.len()],
            cut: Vec::new(),
            frames: vec![ground],
            coordinate_names: Vec::new(),
            driven: Vec::new(),
        }
    }

    /// Ends of a joint; names were checked before.
    fn ends(&self, joint: &Joint) -> [Attachment; 2] {
        let (a, b) = match joint {
            Joint::Ideal { a, b, .. } => (a, b),
            Joint::Clearance { bearing, journal, .. } => (bearing, journal),
        };
        const CHECKED: Attachment = Attachment { body: None, position: [f64::NAN; 2] };
        [self.scene.attachment(a).unwrap_or(CHECKED), self.scene.attachment(b).unwrap_or(CHECKED)]
    }

    fn add_frame(&mut self, parent: usize, anchor: Vec2, kind: FrameKind, name: String) -> usize {
        self.frames.push(Frame { parent, anchor, kind });
        self.coordinate_names.push(name);
        self.frames.len() - 1
    }

    /// Chooses the joints of the tree, grows it from ground, breadth first, then from the first
    /// body of every part that only clearance joints hold.
    fn span(&mut self) -> Result<(), SceneError> {
        self.check_connected()?;
        self.choose_cuts()?;
        self.grow(None);
        for body in 0..self.scene.bodies.len() {
            if self.placements[body].is_none() {
                self.float(body);
                self.grow(Some(body));
            }
        }
        Ok(())
    }

    /// Joins the bodies by prismatic, fixed and driven joints first; a revolute joint that then
    /// closes a loop is cut, and becomes a closure.
    fn choose_cuts(&mut self) -> Result<(), SceneError> {
        let mut group: Vec<usize> = (0..=self.scene.bodies.len()).collect();
        let mut problems = Vec::new();
        let driven = |name: &str| self.scene.drives.iter().any(|Drive::Speed { joint, .. }| joint == name);
        let mut cut = vec![false; self.scene.joints.len()];
        for revolutes in [false, true] {
            for (index, joint) in self.scene.joints.iter().enumerate() {
                let Joint::Ideal { name, kind, .. } = joint else { continue };
                let can_close = *kind == JointKind::Revolute && !driven(name);
                if can_close != revolutes {
                    continue;
                }
                let [a, b] = self.ends(joint).map(|end| group[end.body.unwrap_or(self.scene.bodies.len())]);
                if a != b {
                    group.iter_mut().filter(|g| **g == a).for_each(|g| *g = b);
                } else if can_close {
                    cut[index] = true;
                } else {
                    problems.push(Problem::new(
                        format!("joints[{index}]"),
                        format!(
                            "joint {name:?} closes a loop of prismatic, fixed and driven joints; a loop needs a \
                             revolute joint without a drive, or a joint with clearance"
                        ),
                    ));
                }
            }
        }
        self.cut = cut;
        if problems.is_empty() { Ok(()) } else { Err(SceneError { problems }) }
    }

    fn grow(&mut self, root: Option<usize>) {
        let mut queue = VecDeque::from([root]);
        while let Some(body) = queue.pop_front() {
            for (index, joint) in self.scene.joints.iter().enumerate() {
                let Joint::Ideal { name, kind, .. } = joint else { continue };
                let [a, b] = self.ends(joint);
                if self.cut[index] || (a.body != body && b.body != body) {
                    continue;
                }
                let reversed = a.body != body;
                let (parent_end, child_end) = if reversed { (b, a) } else { (a, b) };
                // Without the cut joints the graph has no loops: a body met again is where we come from.
                if let Some(child) = child_end.body.filter(|&child| self.placements[child].is_none()) {
                    self.hang(name, kind.clone(), parent_end, child_end, child, reversed);
                    queue.push_back(Some(child));
                }
            }
        }
    }

    /// Hangs `child` on the tree through an ideal joint.
    fn hang(
        &mut self,
        name: &str,
        kind: JointKind,
        parent_end: Attachment,
        child_end: Attachment,
        child: usize,
        reversed: bool,
    ) {
        let parent = parent_end.body.and_then(|body| self.placements[body]).unwrap_or(Placement::GROUND);
        let anchor = parent.to_frame(parent_end.position);
        let sign = if reversed { -1.0 } else { 1.0 };
        let (frame, angle, pivot) = match kind {
            JointKind::Revolute => {
                let frame = self.add_frame(parent.frame, anchor, FrameKind::Revolute, name.to_owned());
                for drive in &self.scene.drives {
                    let Drive::Speed { name: drive_name, joint, speed, angle } = drive;
                    if joint == name {
                        self.driven.push(DrivenCoordinate {
                            name: drive_name.clone(),
                            column: frame - 1,
                            angle: *angle,
                            speed: *speed,
                            sign,
                        });
                    }
                }
                (frame, parent.angle, Vec2::zeros())
            }
            JointKind::Prismatic { axis, angle } => {
                // The line is fixed in body a; both bodies turn together, so it is fixed in either frame.
                let child_angle = parent.angle + sign * angle;
                let angle_a = if reversed { child_angle } else { parent.angle };
                let axis = sign * rotated(direction(Vec2::from(axis)), angle_a);
                let kind = FrameKind::Prismatic { axis };
                let frame = self.add_frame(parent.frame, anchor, kind, name.to_owned());
                (frame, child_angle, Vec2::zeros())
            }
            JointKind::Fixed { angle } => (parent.frame, parent.angle + sign * angle, anchor),
        };
        let origin = pivot - rotated(Vec2::from(child_end.position), angle);
        let hung = !matches!(kind, JointKind::Fixed { .. });
        self.placements[child] = Some(Placement { frame, hung, origin, angle });
    }

    /// Gives a body that no ideal joint holds its three coordinates, about its centre of mass.
    fn float(&mut self, body: usize) {
        let name = &self.scene.bodies[body].name;
        let mut frame = 0;
        for (suffix, kind) in [
            ("x", FrameKind::Prismatic { axis: Vec2::x() }),
            ("y", FrameKind::Prismatic { axis: Vec2::y() }),
            ("angle", FrameKind::Revolute),
        ] {
            frame = self.add_frame(frame, Vec2::zeros(), kind, format!("{name}.{suffix}"));
        }
        let origin = -Vec2::from(self.scene.bodies[body].center_of_mass);
        self.placements[body] = Some(Placement { frame, hung: true, origin, angle: 0.0 });
    }

    /// All bodies must hang together; with ground, unless the scene does not use ground at all.
    fn check_connected(&self) -> Result<(), SceneError> {
        let count = self.scene.bodies.len();
        let node = |end: Attachment| end.body.unwrap_or(count);
        let mut group: Vec<usize> = (0..=count).collect();
        for joint in &self.scene.joints {
            let [a, b] = self.ends(joint).map(node);
            let (from, to) = (group[a], group[b]);
            group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
        }
        let grounded = group[..count].contains(&group[count]);
        let main = if grounded { group[count] } else { group[0] };
        let problems: Vec<Problem> = (0..count)
            .filter(|&body| group[body] != main)
            .map(|body| {
                let to = if grounded { GROUND } else { &self.scene.bodies[0].name };
                Problem::new(
                    format!("bodies[{body}]"),
                    format!(
                        "body {:?} is not connected to {to:?} by any joint",
                        self.scene.bodies[body].name
                    ),
                )
            })
            .collect();
        if problems.is_empty() { Ok(()) } else { Err(SceneError { problems }) }
    }

    fn place(&self, end: Attachment) -> FramePoint {
        let placement = end.body.and_then(|body| self.placements[body]).unwrap_or(Placement::GROUND);
        FramePoint { frame: placement.frame, offset: placement.to_frame(end.position) }
    }

    fn finish(self) -> Mechanism {
        let scene = self.scene;
        let columns = self.frames.len() - 1;
        let is_driven = |column: usize| self.driven.iter().any(|driven| driven.column == column);
        let free: Vec<usize> = (0..columns).filter(|&column| !is_driven(column)).collect();
        let mut paths = vec![Path::default()];
        for (index, frame) in self.frames.iter().enumerate().skip(1) {
            let mut path = paths[frame.parent].clone();
            path.columns.push(index - 1);
            if let Ok(freedom) = free.binary_search(&(index - 1)) {
                path.free.push((index - 1, freedom));
            }
            paths.push(path);
        }
        let bodies: Vec<BodyPlacement> = scene
            .bodies
            .iter()
            .zip(&self.placements)
            .map(|(body, placement)| {
                let placement = placement.unwrap_or(Placement::GROUND);
                BodyPlacement {
                    name: body.name.clone(),
                    mass: body.mass,
                    inertia: scene.central_inertia(body),
                    frame: placement.frame,
                    hung: placement.hung,
                    origin: placement.origin,
                    angle: placement.angle,
                    center: placement.to_frame(body.center_of_mass),
                }
            })
            .collect();
        let (inertias, driven_inertias) = frame_inertias(&bodies, &paths);
        let clearance_joints = scene
            .joints
            .iter()
            .filter_map(|joint| {
                let Joint::Clearance {
                    name,
                    journal_radius,
                    clearance,
                    contact,
                    friction,
                    sliding,
                    impact_velocity_floor,
                    ..
                } = joint
                else {
                    return None;
                };
                let [bearing, journal] = self.ends(joint).map(|end| self.place(end));
                Some(ClearanceJoint {
                    name: name.clone(),
                    bearing,
                    journal,
                    law: ClearanceLaw {
                        clearance: *clearance,
                        journal_radius: *journal_radius,
                        bearing_radius: journal_radius + clearance,
                        normal: *contact,
                        friction: *friction,
                        sliding: *sliding,
                    },
                    // NaN asks the assembly for the default from the scales.
                    impact_velocity_floor: impact_velocity_floor.unwrap_or(f64::NAN),
                    effective_mass: f64::NAN,
                    resting_penetration: f64::NAN,
                    resting_speed: f64::NAN,
                })
            })
            .collect();
        let cut_joints = scene.joints.iter().zip(&self.cut).filter(|(_, cut)| **cut);
        let closures = cut_joints
            .map(|(joint, _)| {
                let [a, b] = self.ends(joint).map(|end| self.place(end));
                Closure { name: joint.name().to_owned(), a, b }
            })
            .collect();
        let gravity = scene
            .forces
            .iter()
            .fold(Vec2::zeros(), |sum, Force::Gravity { acceleration }| sum + Vec2::from(*acceleration));
        Mechanism {
            frames: self.frames,
            coordinate_names: self.coordinate_names,
            free,
            driven: self.driven,
            paths,
            bodies,
            inertias,
            driven_inertias,
            clearance_joints,
            closures,
            gravity,
            start: State::default(),
            scales: Scales::default(),
        }
    }
}

/// Sums the bodies of each frame (Steiner's theorem); frames that move freely, then those that
/// only drives move. Bodies fixed to ground move nothing.
fn frame_inertias(bodies: &[BodyPlacement], paths: &[Path]) -> (Vec<FrameInertia>, Vec<FrameInertia>) {
    let (mut free, mut driven) = (Vec::new(), Vec::new());
    for (frame, path) in paths.iter().enumerate().skip(1) {
        let on_frame = || bodies.iter().filter(|body| body.frame == frame);
        let mass: f64 = on_frame().map(|body| body.mass).sum();
        if mass == 0.0 {
            continue;
        }
        let center = match on_frame().collect::<Vec<_>>()[..] {
            // A lone body keeps its centre of mass to the last bit.
            [body] => body.center,
            _ => on_frame().map(|body| body.mass * body.center).sum::<Vec2>() / mass,
        };
        let inertia =
            on_frame().map(|body| body.inertia + body.mass * (body.center - center).norm_squared()).sum();
        let list = if path.free.is_empty() { &mut driven } else { &mut free };
        list.push(FrameInertia { frame, mass, center, inertia });
    }
    (free, driven)
}
