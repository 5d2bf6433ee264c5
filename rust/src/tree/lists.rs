//! The flat lists of a spanning tree: everything a run needs of the scene, relative to frames instead of
//! bodies.

use crate::contact::film::FilmLaw;
use crate::numerics::accuracy::ROUNDING_OF_CHAIN;
use crate::scene::loads::{Expression, Load as SceneLoad};
use crate::scene::parts::{Attachment, Force, ForceFrame, Joint, JointKind};
use crate::scene::quantities::{Coordinate, Quantity};
use crate::tree::elements::{
    BodyPlacement, Closure, DrivenCoordinate, FrameInertia, FramePoint, IdealJoint, IdealKind, Path,
    Realization, Tree,
};
use crate::tree::forces::{Applied, Elastic, Ends, ForceElement, ForceLaw, Link};
use crate::tree::kinematics::{Frame, Vec2};
use crate::tree::loads::{Load, Measure, MotionLoad, Variable};
use crate::tree::span::{Builder, Placement};

/// The ideal joints of a scene, in a tree or cut.
struct IdealJoints {
    joints: Vec<IdealJoint>,
    closures: Vec<Closure>,
    /// Index among them of each joint of the scene.
    index_of: Vec<usize>,
}

impl Builder<'_> {
    pub(super) fn finish(mut self) -> Tree {
        let columns = self.frames.len() - 1;
        let is_driven = |column: usize| self.driven.iter().any(|driven| driven.column == column);
        let free: Vec<usize> = (0..columns).filter(|&column| !is_driven(column)).collect();
        let paths = paths(&self.frames, &free);
        let bodies = self.bodies();
        let (inertias, driven_inertias) = frame_inertias(&bodies, &paths);
        let IdealJoints { joints: ideal_joints, closures, index_of } = self.ideal_joints();
        let tree_joints = self.order.iter().map(|&joint| index_of[joint]).collect();
        for driven in &mut self.driven {
            driven.joint = index_of[driven.joint];
        }
        let speeds_up =
            |(index, driven): (usize, &DrivenCoordinate)| (!driven.motion.is_linear()).then_some(index);
        let accelerated = self.driven.iter().enumerate().filter_map(speeds_up).collect();
        let locks = self.locks.take().unwrap_or_default();
        let mut tree = Tree {
            free,
            accelerated,
            paths,
            bodies,
            inertias,
            driven_inertias,
            closures,
            locks,
            ideal_joints,
            tree_joints,
            components: self.components.clone(),
            ..Tree::default()
        };
        self.add_slots(&mut tree);
        self.add_films(&mut tree);
        self.add_forces(&mut tree);
        let Self { frames, coordinate_names, driven, .. } = self;
        Tree { frames, coordinate_names, driven, ..tree }
    }

    fn bodies(&self) -> Vec<BodyPlacement> {
        let placed = self.scene.bodies.iter().zip(&self.placements);
        placed
            .map(|(body, placement)| {
                let placement = placement.unwrap_or(Placement::GROUND);
                let points = body.points.iter();
                BodyPlacement {
                    name: body.name.clone(),
                    mass: body.mass,
                    inertia: self.scene.central_inertia(body),
                    frame: placement.frame,
                    owns_frame: placement.owns_frame,
                    origin: placement.origin,
                    angle: placement.angle,
                    center: placement.to_frame(body.center_of_mass),
                    points: points
                        .map(|point| (point.name.clone(), placement.to_frame(point.position)))
                        .collect(),
                }
            })
            .collect()
    }

    fn ideal_joints(&self) -> IdealJoints {
        let mut closures = Vec::new();
        let mut joints = Vec::new();
        let mut index_of = vec![usize::MAX; self.scene.joints.len()];
        for (index, joint) in self.scene.joints.iter().enumerate() {
            let Joint::Ideal { name, kind, .. } = joint else { continue };
            let (points, bodies) = self.placed(self.ends(joint));
            let realization = self.realizations[index].unwrap_or(Realization::Cut(closures.len()));
            if let Realization::Cut(_) = realization {
                let [a, b] = points;
                closures.push(Closure { name: name.clone(), a, b, bodies });
            }
            let kind = match kind {
                JointKind::Revolute => IdealKind::Revolute,
                JointKind::Prismatic { .. } => IdealKind::Prismatic,
                JointKind::Fixed { .. } => IdealKind::Fixed,
            };
            index_of[index] = joints.len();
            joints.push(IdealJoint { name: name.clone(), kind, bodies, points, realization });
        }
        IdealJoints { joints, closures, index_of }
    }

    /// Adds a bushing, and its torsion spring if it has one.
    fn add_bushing(&self, tree: &mut Tree, force: &Force) {
        let Force::Bushing { name, a, b, coefficients, formulas } = force else { return };
        let [stiffness, damping, torsional_stiffness, torsional_damping] = *coefficients;
        let [radial, radial_damping, torsional, twist_damping] = formulas
            .each_ref()
            .map(|of| of.as_ref().map(|of| Load::Motion(self.motion_load(tree, name, of))));
        let (points, bodies) = self.placed([a, b].map(|reference| self.end(reference)));
        let law = ForceLaw::Elastic(Elastic { stiffness, damping });
        tree.add_force(name, Ends::Points(points), bodies, [radial, radial_damping], law);
        let twists = [torsional, twist_damping];
        if torsional_stiffness != 0.0 || torsional_damping != 0.0 || twists != [None, None] {
            let law = Elastic { stiffness: torsional_stiffness, damping: torsional_damping };
            tree.add_force(name, self.frames(bodies, 0.0), bodies, twists, ForceLaw::Elastic(law));
        }
    }

    /// The frames of two bodies, with the angle of the second relative to the first without deflection [rad].
    fn frames(&self, bodies: [Option<usize>; 2], unloaded: f64) -> Ends {
        let [first, second] = bodies.map(|body| self.placement(body));
        Ends::Frames([first.frame, second.frame], unloaded + first.angle - second.angle)
    }

    /// Distance of the ends of a spring or damper up to which its direction is lost; zero where it needs none.
    fn indistinct(&self, force: &Force, bodies: [Option<usize>; 2]) -> f64 {
        match force {
            Force::Spring { length, damping, tension, .. }
                if *length != 0.0 || *damping != 0.0 || !tension.is_none() =>
            {
                ROUNDING_OF_CHAIN * self.size(bodies)
            }
            _ => 0.0,
        }
    }

    /// Adds a spring or damper.
    fn add_link(&self, tree: &mut Tree, force: &Force) {
        let Force::Spring { name, a, b, stiffness, length, damping, tension } = force else { return };
        let (points, bodies) = self.placed([a, b].map(|reference| self.end(reference)));
        let further = (!tension.is_none()).then(|| self.load(tree, name, tension));
        let law = ForceLaw::Link(Link {
            stiffness: *stiffness,
            length: *length,
            damping: *damping,
            indistinct: self.indistinct(force, bodies),
        });
        tree.add_force(name, Ends::Points(points), bodies, [further, None], law);
    }

    /// Adds the oil films of clearance joints.
    fn add_films(&self, tree: &mut Tree) {
        for joint in &self.scene.joints {
            let Joint::Clearance { name, journal_radius, clearance, film: Some(lubricant), .. } = joint
            else {
                continue;
            };
            let (points, bodies) = self.placed(self.ends(joint));
            let law = ForceLaw::Film(FilmLaw::new(lubricant, *journal_radius, *clearance));
            tree.add_force(name, Ends::Points(points), bodies, [None, None], law);
        }
    }

    fn add_forces(&self, tree: &mut Tree) {
        let body_of = |name: &str| self.scene.body_index(name).unwrap_or_default();
        for force in &self.scene.forces {
            match force {
                Force::Gravity { acceleration } => tree.gravity += Vec2::from(*acceleration),
                Force::Spring { .. } => self.add_link(tree, force),
                Force::Bushing { .. } => self.add_bushing(tree, force),
                Force::TorsionSpring { name, a, b, stiffness, angle, damping } => {
                    let bodies = [a, b].map(|name| body_of(name));
                    let law = ForceLaw::Elastic(Elastic { stiffness: *stiffness, damping: *damping });
                    tree.add_force(name, self.frames(bodies, *angle), bodies, [None, None], law);
                }
                Force::Applied { name, point, x, y, frame } => {
                    let end = self.end(point);
                    let angle = self.placement(end.body).angle;
                    let components = [x, y].map(|component| Some(self.load(tree, name, component)));
                    let origin = FramePoint { frame: 0, offset: Vec2::zeros() };
                    let ends = Ends::Points([origin, self.place(end)]);
                    let body_axes = (*frame == ForceFrame::Body).then(|| [angle.cos(), angle.sin()]);
                    let law = ForceLaw::Applied(Applied { body_axes });
                    tree.add_force(name, ends, [None, end.body], components, law);
                }
                Force::Torque { name, body, reaction, torque } => {
                    let bodies = [reaction, body].map(|name| body_of(name));
                    let loads = [Some(self.load(tree, name, torque)), None];
                    let law = ForceLaw::Applied(Applied { body_axes: None });
                    tree.add_force(name, self.frames(bodies, 0.0), bodies, loads, law);
                }
            }
        }
        tree.forces.sort_by_key(ForceElement::rank);
    }
}

impl Builder<'_> {
    /// A component of the force or torque `name`; a function of the motion is added to the tree.
    fn load(&self, tree: &mut Tree, name: &str, load: &SceneLoad) -> Load {
        match load {
            SceneLoad::Time(function) => Load::Time(function.clone()),
            SceneLoad::Motion(expression) => Load::Motion(self.motion_load(tree, name, expression)),
        }
    }

    /// Adds a function of the motion to the tree; its index.
    fn motion_load(&self, tree: &mut Tree, name: &str, expression: &Expression) -> usize {
        let quantities = expression.quantities(self.scene);
        let names: Vec<&str> = quantities.iter().map(|(name, _)| name.as_str()).collect();
        let variables = quantities.iter().map(|(name, quantity)| (name.clone(), self.variable(*quantity)));
        let bodies: Vec<usize> =
            quantities.iter().flat_map(|(_, quantity)| self.scene.bodies_of(quantity.of)).collect();
        tree.motion_loads.push(MotionLoad {
            name: name.to_owned(),
            text: expression.text.clone(),
            // Checked with the scene.
            tape: expression.tape(&names).unwrap_or_default(),
            variables: variables.collect(),
            component: bodies.first().map_or(0, |&body| self.components.of_body[body]),
            first_switch: tree.switch_count(),
            law_of: None,
        });
        tree.motion_loads.len() - 1
    }

    /// A quantity of the scene as one of the frames.
    fn variable(&self, quantity: Quantity) -> Variable {
        let on_frame = |body: usize, position| self.place(Attachment { body: Some(body), position });
        let column_of = |joint: usize| match self.realizations[joint] {
            Some(Realization::Tree { column: Some(column), .. }) => column,
            // A prismatic joint is never cut.
            _ => 0,
        };
        let of = match quantity.of {
            Coordinate::Time => Measure::Time,
            Coordinate::Position { body, point, axis } => Measure::Position(on_frame(body, point), axis),
            Coordinate::Angle(bodies) => {
                let [a, b] = bodies.map(|body| self.placement(body));
                Measure::Angle([a.frame, b.frame], b.angle - a.angle)
            }
            Coordinate::Displacement(joint) => Measure::Coordinate(column_of(joint)),
            Coordinate::Length(force) => match &self.scene.forces[force] {
                force @ (Force::Spring { a, b, .. } | Force::Bushing { a, b, .. }) => {
                    let (points, bodies) = self.placed([a, b].map(|end| self.end(end)));
                    Measure::Length(points, self.indistinct(force, bodies))
                }
                // Nothing else has a length.
                _ => Measure::Time,
            },
        };
        Variable { of, is_rate: quantity.is_rate }
    }
}

/// For every frame the columns that move it; `free` are those of the degrees of freedom.
fn paths(frames: &[Frame], free: &[usize]) -> Vec<Path> {
    let mut paths = vec![Path::default()];
    for (index, frame) in frames.iter().enumerate().skip(1) {
        let mut path = paths[frame.parent].clone();
        path.columns.push(index - 1);
        if let Ok(freedom) = free.binary_search(&(index - 1)) {
            path.free.push((index - 1, freedom));
        }
        paths.push(path);
    }
    paths
}

/// Inertias of the frames, summed over their bodies (parallel axis theorem): first of frames that degrees of
/// freedom move, then of frames that only drives move. Bodies fixed to ground are left out.
fn frame_inertias(bodies: &[BodyPlacement], paths: &[Path]) -> (Vec<FrameInertia>, Vec<FrameInertia>) {
    let (mut free, mut driven) = (Vec::new(), Vec::new());
    for (frame, path) in paths.iter().enumerate().skip(1) {
        let on_frame = || bodies.iter().filter(|body| body.frame == frame);
        let mass: f64 = on_frame().map(|body| body.mass).sum();
        if on_frame().all(|body| body.mass == 0.0 && body.inertia == 0.0) {
            continue;
        }
        let center = match on_frame().collect::<Vec<_>>()[..] {
            // The center of mass of a single body is kept to the last bit.
            [body] => body.center,
            _ if mass == 0.0 => Vec2::zeros(),
            _ => on_frame().map(|body| body.mass * body.center).sum::<Vec2>() / mass,
        };
        let inertia =
            on_frame().map(|body| body.inertia + body.mass * (body.center - center).norm_squared()).sum();
        let list = if path.free.is_empty() { &mut driven } else { &mut free };
        list.push(FrameInertia { frame, mass, center, inertia });
    }
    (free, driven)
}
