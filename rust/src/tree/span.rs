//! Spanning tree of frames for a scene.
//!
//! Joints enter the tree in an order that leaves only revolute joints to be cut; clearance joints
//! never enter it. A group of bodies without ideal joints to the rest gets three coordinates of its own.

use std::collections::VecDeque;

use crate::error::{InputError, Problem, Subject};
use crate::scene::components::Components;
use crate::scene::parts::{Attachment, Force, GROUND, Joint, JointKind, Scene};
use crate::tree::elements::{CLOSURE_ROWS, DrivenCoordinate, FramePoint, Realization, Tree};
use crate::tree::kinematics::{Frame, FrameKind, Vec2, direction, perp, rotated};

impl Tree {
    /// The tree of a checked scene with these components, without the friction in its joints.
    pub(crate) fn span(scene: &Scene, components: &Components) -> Result<Tree, InputError> {
        Self::span_with(scene, components, None)
    }

    /// The same; with a list for `locks`, ideal joints with friction are held by multipliers.
    pub(super) fn span_with(
        scene: &Scene,
        components: &Components,
        locks: Option<Vec<usize>>,
    ) -> Result<Tree, InputError> {
        let mut builder = Builder { locks, ..Builder::new(scene, components) };
        builder.span()?;
        builder.check_clearances()?;
        let mut tree = builder.finish();
        tree.add_couplings(scene)?;
        tree.row_masses = tree.has_light_frame().then(|| tree.masses_of_rows());
        Ok(tree)
    }

    /// Whether degrees of freedom move a frame whose bodies have no mass, or turn one whose bodies have no moment of
    /// inertia.
    fn has_light_frame(&self) -> bool {
        let turns = |&(column, _): &(usize, usize)| self.frames[column + 1].kind == FrameKind::Revolute;
        self.bodies.iter().any(|body| {
            let free = &self.paths[body.frame].free;
            let own = self.inertias.iter().find(|inertia| inertia.frame == body.frame);
            let [mass, inertia] = own.map_or([0.0; 2], |own| [own.mass, own.inertia]);
            !free.is_empty() && (mass == 0.0 || inertia == 0.0 && free.iter().any(turns))
        })
    }

    /// The mass of all bodies of its component for every row in [m], at the size of that for one in [rad]. Were it much
    /// larger or smaller, digits would be lost; else the accelerations do not depend on it.
    fn masses_of_rows(&self) -> Vec<f64> {
        let of_row = |(component, is_angle): (usize, bool)| {
            let (length, mass) = (self.components.lengths[component], self.total_mass(component));
            if is_angle { mass * length * length } else { mass }
        };
        let of = |bodies| self.components.of(bodies).unwrap_or_default();
        let closures = self.closures.iter().flat_map(|closure| [(of(closure.bodies), false); CLOSURE_ROWS]);
        let couplings = self
            .couplings
            .iter()
            .map(|coupling| (of(coupling.driven.bodies), coupling.driven.slide.is_none()));
        let of_columns = self.components_of_columns();
        let locks = self
            .locks
            .iter()
            .map(|&column| (of_columns[column], self.frames[column + 1].kind == FrameKind::Revolute));
        closures.chain(couplings).chain(locks).map(of_row).collect()
    }
}

/// Position of a body on its frame while the tree is built.
#[derive(Clone, Copy)]
pub(super) struct Placement {
    pub(super) frame: usize,
    pub(super) owns_frame: bool,
    pub(super) origin: Vec2,
    pub(super) angle: f64,
}

impl Placement {
    pub(super) const GROUND: Placement =
        Placement { frame: 0, owns_frame: false, origin: Vec2::new(0.0, 0.0), angle: 0.0 };

    /// A point of the body in the coordinates of its frame.
    pub(super) fn to_frame(self, point: [f64; 2]) -> Vec2 {
        self.origin + rotated_by(Vec2::from(point), self.angle)
    }
}

/// `vector` turned by an angle [rad].
pub(super) fn rotated_by(vector: Vec2, angle: f64) -> Vec2 {
    let (sine, cosine) = angle.sin_cos();
    rotated(vector, cosine, sine)
}

/// A tree while it is built.
pub(super) struct Builder<'a> {
    pub(super) scene: &'a Scene,
    pub(super) components: &'a Components,
    pub(super) placements: Vec<Option<Placement>>,
    /// For every joint of the scene whether it is cut.
    cut: Vec<bool>,
    pub(super) frames: Vec<Frame>,
    pub(super) coordinate_names: Vec<String>,
    pub(super) driven: Vec<DrivenCoordinate>,
    /// How the tree satisfies each joint of the scene, and the joints in the order in which they entered it.
    pub(super) realizations: Vec<Option<Realization>>,
    pub(super) order: Vec<usize>,
    /// Columns of the coordinates that take the place of ideal joints with friction, if they do.
    pub(super) locks: Option<Vec<usize>>,
}

impl<'a> Builder<'a> {
    fn new(scene: &'a Scene, components: &'a Components) -> Self {
        let ground = Frame { parent: 0, anchor: Vec2::zeros(), kind: FrameKind::Revolute };
        Self {
            scene,
            components,
            placements: vec![None; scene.bodies.len()],
            cut: Vec::new(),
            frames: vec![ground],
            coordinate_names: Vec::new(),
            driven: Vec::new(),
            realizations: vec![None; scene.joints.len()],
            order: Vec::new(),
            locks: None,
        }
    }

    /// Ends of a joint, whose names have been checked before.
    pub(super) fn ends(&self, joint: &Joint) -> [Attachment; 2] {
        joint.references().map(|(_, reference)| self.end(reference))
    }

    /// Size [m] of the component of the first of two bodies that is not ground.
    pub(super) fn size(&self, bodies: [Option<usize>; 2]) -> f64 {
        self.components.of(bodies).map_or(0.0, |component| self.components.lengths[component])
    }

    pub(super) fn end(&self, reference: &str) -> Attachment {
        const CHECKED: Attachment = Attachment { body: None, position: [f64::NAN; 2] };
        self.scene.attachment(reference).unwrap_or(CHECKED)
    }

    /// Where a body, or ground, is on its frame.
    pub(super) fn placement(&self, body: Option<usize>) -> Placement {
        body.and_then(|body| self.placements[body]).unwrap_or(Placement::GROUND)
    }

    /// Two points on their frames, and the bodies that carry them.
    pub(super) fn placed(&self, ends: [Attachment; 2]) -> ([FramePoint; 2], [Option<usize>; 2]) {
        (ends.map(|end| self.place(end)), ends.map(|end| end.body))
    }

    fn add_frame(&mut self, parent: usize, anchor: Vec2, kind: FrameKind, name: String) -> usize {
        self.frames.push(Frame { parent, anchor, kind });
        self.coordinate_names.push(name);
        self.frames.len() - 1
    }

    /// Chooses the joints of the tree and builds it breadth first from ground, then from the first
    /// body of every group without ideal joints to the rest.
    fn span(&mut self) -> Result<(), InputError> {
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

    /// Connects the bodies by prismatic, fixed and driven joints first. A revolute joint that then
    /// closes a loop is cut and becomes a closure.
    fn choose_cuts(&mut self) -> Result<(), InputError> {
        let mut group: Vec<usize> = (0..=self.scene.bodies.len()).collect();
        let mut problems = Vec::new();
        let driven = |name: &str| self.scene.drives.iter().any(|drive| drive.joint() == name);
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
        Subject::Scene.judge((), problems)
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
                // Without the cut joints the graph has no loops, so a body with a placement is the parent.
                if let Some(child) = child_end.body.filter(|&child| self.placements[child].is_none()) {
                    self.hang(index, name, kind, [parent_end, child_end], child, reversed);
                    queue.push_back(Some(child));
                }
            }
        }
    }

    /// Adds `child` to the tree by an ideal joint.
    fn hang(
        &mut self,
        joint: usize,
        name: &str,
        kind: &JointKind,
        [parent_end, child_end]: [Attachment; 2],
        child: usize,
        reversed: bool,
    ) {
        let parent = self.placement(parent_end.body);
        let anchor = parent.to_frame(parent_end.position);
        let sign = if reversed { -1.0 } else { 1.0 };
        // The frame of its coordinate, and the frame that carries the child.
        let (frame, carrier, angle, pivot) = match *kind {
            JointKind::Revolute => {
                let frame = self.add_frame(parent.frame, anchor, FrameKind::Revolute, name.to_owned());
                let slides = [Vec2::x(), Vec2::y()].map(|axis| FrameKind::Prismatic { axis });
                (frame, self.lock(joint, frame, Vec2::zeros(), slides), parent.angle, Vec2::zeros())
            }
            JointKind::Prismatic { axis, angle } => {
                // The sliding axis is fixed in body a; both bodies turn together, so it is fixed in either
                // frame.
                let child_angle = parent.angle + sign * angle;
                let angle_a = if reversed { child_angle } else { parent.angle };
                let axis = sign * rotated_by(direction(Vec2::from(axis)), angle_a);
                let kind = FrameKind::Prismatic { axis };
                // The moment of the reaction is that about point b: the block turns about it, before or behind its slide.
                let aside = [FrameKind::Prismatic { axis: perp(axis) }, FrameKind::Revolute];
                if reversed {
                    let [across, turn] = aside;
                    let before = self.lock(joint, parent.frame, anchor, [turn, across]);
                    let anchor = if before == parent.frame { anchor } else { Vec2::zeros() };
                    let frame = self.add_frame(before, anchor, kind, name.to_owned());
                    (frame, frame, child_angle, Vec2::zeros())
                } else {
                    let frame = self.add_frame(parent.frame, anchor, kind, name.to_owned());
                    (frame, self.lock(joint, frame, Vec2::zeros(), aside), child_angle, Vec2::zeros())
                }
            }
            JointKind::Fixed { angle } => (parent.frame, parent.frame, parent.angle + sign * angle, anchor),
        };
        let origin = pivot - rotated_by(Vec2::from(child_end.position), angle);
        let owns_frame = !matches!(kind, JointKind::Fixed { .. });
        self.placements[child] = Some(Placement { frame: carrier, owns_frame, origin, angle });
        let column = owns_frame.then(|| frame - 1);
        self.realizations[joint] = Some(Realization::Tree { child, column, sign });
        self.order.push(joint);
        for drive in self.scene.drives.iter().filter(|drive| drive.joint() == name) {
            self.driven.push(DrivenCoordinate {
                name: drive.name().to_owned(),
                joint,
                column: frame - 1,
                motion: drive.motion(),
                is_angle: *kind == JointKind::Revolute,
                // The axis of a prismatic frame already includes the sign.
                sign: if *kind == JointKind::Revolute { sign } else { 1.0 },
            });
        }
    }

    /// Adds the two frames by which a joint with friction would come apart; returns the last one, or `parent` where
    /// nothing is held by multipliers.
    fn lock(&mut self, joint: usize, parent: usize, anchor: Vec2, kinds: [FrameKind; 2]) -> usize {
        let has_friction = matches!(self.scene.joints[joint], Joint::Ideal { friction: Some(_), .. });
        let Some(mut locks) = self.locks.take_if(|_| has_friction) else { return parent };
        let [first, second] = kinds;
        let between = self.add_frame(parent, anchor, first, String::new());
        let last = self.add_frame(between, Vec2::zeros(), second, String::new());
        locks.extend([between - 1, last - 1]);
        self.locks = Some(locks);
        last
    }

    /// Gives a body without ideal joints its three coordinates: its center of mass and its angle.
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
        self.placements[body] = Some(Placement { frame, owns_frame: true, origin, angle: 0.0 });
    }

    /// Checks that all bodies are connected, also to ground unless the scene does not use it.
    fn check_connected(&self) -> Result<(), InputError> {
        let count = self.scene.bodies.len();
        let node = |end: Attachment| end.body.unwrap_or(count);
        let mut group: Vec<usize> = (0..=count).collect();
        let joined = self.scene.joints.iter().map(|joint| self.ends(joint).map(node));
        let sprung = self.scene.forces.iter().filter_map(|force| match force {
            Force::Spring { a, b, .. } | Force::Bushing { a, b, .. } => {
                Some([a, b].map(|reference| node(self.end(reference))))
            }
            _ => None,
        });
        for [a, b] in joined.chain(sprung) {
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
                        "body {:?} is not connected to {to:?} by any joint or spring",
                        self.scene.bodies[body].name
                    ),
                )
            })
            .collect();
        Subject::Scene.judge((), problems)
    }

    /// Checks that the bodies of a joint with clearance can move relative to each other.
    fn check_clearances(&self) -> Result<(), InputError> {
        let joints = self.scene.joints.iter().enumerate();
        let problems: Vec<Problem> = joints
            .filter(|(_, joint)| !matches!(joint, Joint::Ideal { .. }))
            .filter(|(_, joint)| {
                let [bearing, journal] = self.ends(joint).map(|end| self.place(end));
                bearing.frame == journal.frame
            })
            .map(|(index, joint)| {
                Problem::new(
                    format!("joints[{index}]"),
                    format!(
                        "{:?} never acts: fixed joints connect its two bodies rigidly; remove it",
                        joint.name()
                    ),
                )
            })
            .collect();
        Subject::Scene.judge((), problems)
    }

    pub(super) fn place(&self, end: Attachment) -> FramePoint {
        let placement = self.placement(end.body);
        FramePoint { frame: placement.frame, offset: placement.to_frame(end.position) }
    }
}
