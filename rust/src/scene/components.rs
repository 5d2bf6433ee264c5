//! The components of a scene: bodies that joints, forces or couplings connect, and their sizes.
//!
//! Ground connects nothing, since it does not move: what happens to one component changes nothing in another. Every scale
//! of a component is therefore its own.

use crate::scene::couplings::{Coupled, CouplingLaw};
use crate::scene::loads::{Expression, Load};
use crate::scene::parts::{Attachment, Drive, Force, GuideShape, Joint, JointKind, Scene, Start, extent};
use crate::scene::quantities::Coordinate;

/// The components of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Components {
    /// The component of every body.
    pub of_body: Vec<usize>,
    /// Size of every component [m].
    pub lengths: Vec<f64>,
}

/// What connects bodies: these, and where it is attached to them and to ground.
#[derive(Default)]
struct Connection {
    bodies: Vec<usize>,
    ends: Vec<Attachment>,
}

impl Components {
    /// The components of a scene, with a size of zero where the scene gives no length. Names that are not known connect
    /// nothing: the checks of the scene report them.
    pub(crate) fn of_scene(scene: &Scene) -> Self {
        let connections = scene.connections();
        let mut group: Vec<usize> = (0..scene.bodies.len()).collect();
        for connection in &connections {
            for pair in connection.bodies.windows(2) {
                let [from, to] = [group[pair[0]], group[pair[1]]];
                group.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
            }
        }
        let mut roots: Vec<usize> = Vec::new();
        let of_body: Vec<usize> = group
            .iter()
            .map(|root| {
                roots.iter().position(|other| other == root).unwrap_or_else(|| {
                    roots.push(*root);
                    roots.len() - 1
                })
            })
            .collect();
        let mut components = Self { of_body, lengths: vec![0.0; roots.len()] };
        for index in 0..components.lengths.len() {
            let extent = components.extent(scene, index, &connections);
            components.lengths[index] =
                if extent > 0.0 { extent } else { components.given_length(scene, index) };
        }
        components
    }

    /// The component of the first of some bodies that is not ground.
    pub fn of(&self, bodies: [Option<usize>; 2]) -> Option<usize> {
        bodies.into_iter().flatten().next().map(|body| self.of_body[body])
    }

    /// Size of the whole scene [m].
    pub fn largest(&self) -> f64 {
        self.lengths.iter().copied().fold(0.0, f64::max)
    }

    fn of_joint(&self, scene: &Scene, joint: &Joint) -> Option<usize> {
        self.of(scene.ends(joint).map(|end| end.and_then(|end| end.body)))
    }

    /// Largest distance between two points of a body of a component, or of the points of ground to which the component
    /// is attached; the radius or length of what its joints guide, if that is larger [m].
    fn extent(&self, scene: &Scene, component: usize, connections: &[Connection]) -> f64 {
        let own = |body: usize| self.of_body[body] == component;
        let of = |connection: &&Connection| connection.bodies.first().is_some_and(|&body| own(body));
        let ends: Vec<&Attachment> =
            connections.iter().filter(of).flat_map(|connection| &connection.ends).collect();
        let attached = |body: Option<usize>| {
            ends.iter().filter(move |end| end.body == body).map(|end| end.position).collect::<Vec<_>>()
        };
        let bodies = scene.bodies.iter().enumerate().filter(|(index, _)| own(*index));
        let sizes = bodies.map(|(index, body)| {
            let points = body.points.iter().map(|point| point.position);
            extent(points.chain([body.center_of_mass]).chain(attached(Some(index))))
        });
        let length = sizes.fold(extent(attached(None).into_iter()), f64::max);
        let joints = scene.joints.iter().filter(|joint| self.of_joint(scene, joint) == Some(component));
        joints.fold(length, |length, joint| match joint {
            Joint::Ideal { .. } => length,
            Joint::Clearance { journal_radius: size, .. }
            | Joint::Guide { shape: GuideShape::Block { length: size, .. }, .. }
            | Joint::Guide { shape: GuideShape::Pin { radius: size, .. }, .. }
            | Joint::Guide { shape: GuideShape::Stop { radius: size }, .. } => length.max(*size),
        })
    }

    /// Largest length that a scene gives of a component whose points all coincide [m]: radii of gyration of bodies that can
    /// turn, springs, plays, strokes and distances at the start.
    // Long because every part that may give a length has its line.
    fn given_length(&self, scene: &Scene, component: usize) -> f64 {
        let turning = scene.turning_bodies().into_iter().filter(|&body| self.of_body[body] == component);
        let gyrations = turning.map(|index| {
            let body = &scene.bodies[index];
            (scene.central_inertia(body) / body.mass).sqrt()
        });
        let named = |name: &str| scene.joints.iter().find(|joint| joint.name() == name);
        let own = |joint: &Joint| self.of_joint(scene, joint) == Some(component);
        let slides = |joint: &Joint| {
            own(joint) && matches!(joint, Joint::Ideal { kind: JointKind::Prismatic { .. }, .. })
        };
        let joints = scene.joints.iter().filter(|joint| own(joint)).map(|joint| match joint {
            Joint::Ideal { .. } => 0.0,
            Joint::Clearance { clearance, .. } => *clearance,
            Joint::Guide { shape, face_length, .. } => {
                let clearance = match shape {
                    GuideShape::Block { clearance, .. } | GuideShape::Pin { clearance, .. } => *clearance,
                    GuideShape::Stop { .. } => 0.0,
                };
                face_length.unwrap_or(0.0).max(clearance)
            }
        });
        let springs = scene.forces.iter().map(|force| match force {
            Force::Spring { a, b, length, .. }
                if self.of([a, b].map(|end| scene.attachment(end).ok().and_then(|end| end.body)))
                    == Some(component) =>
            {
                *length
            }
            _ => 0.0,
        });
        let strokes = scene.drives.iter().map(|drive| match drive {
            Drive::Motion { joint, motion, .. } if named(joint).is_some_and(slides) => motion.scales()[0],
            _ => 0.0,
        });
        let starts = scene.start.iter().map(|start| match start {
            Start::Joint { joint, position: Some(position), .. } if named(joint).is_some_and(slides) => {
                position.abs()
            }
            Start::Clearance { joint, eccentricity: [x, y], .. } if named(joint).is_some_and(own) => {
                x.abs().max(y.abs())
            }
            Start::Guide { joint, offset, displacement, .. } if named(joint).is_some_and(own) => {
                offset[0].abs().max(displacement[0].unwrap_or(0.0).abs())
            }
            _ => 0.0,
        });
        let couplings =
            scene.couplings.iter().map(|coupling| {
                let ends = coupling.coordinates(scene);
                match (ends, &coupling.law) {
                    ([Ok(Coupled::Displacement(joint)), _], CouplingLaw::Table { values: lengths, .. })
                    | ([_, Ok(Coupled::Displacement(joint))], CouplingLaw::Table { points: lengths, .. })
                        if own(&scene.joints[joint]) =>
                    {
                        lengths.iter().fold(0.0, |largest, length| length.abs().max(largest))
                    }
                    (
                        [Ok(Coupled::Displacement(joint)), Ok(Coupled::Angle(_))],
                        CouplingLaw::Ratio(radius),
                    ) if own(&scene.joints[joint]) => radius.abs(),
                    (
                        [Ok(Coupled::Angle(_)), Ok(Coupled::Displacement(joint))],
                        CouplingLaw::Ratio(ratio),
                    ) if own(&scene.joints[joint]) => 1.0 / ratio.abs(),
                    _ => 0.0,
                }
            });
        let lengths = joints.chain(gyrations).chain(springs).chain(strokes).chain(starts).chain(couplings);
        lengths.filter(|length| length.is_finite()).fold(0.0, f64::max)
    }
}

impl Scene {
    /// What connects bodies, in the order of the scene.
    fn connections(&self) -> Vec<Connection> {
        let at = |references: &[&str]| {
            let ends: Vec<Attachment> =
                references.iter().filter_map(|reference| self.attachment(reference).ok()).collect();
            Connection { bodies: ends.iter().filter_map(|end| end.body).collect(), ends }
        };
        let between = |names: [&str; 2]| {
            let bodies = names.into_iter().filter_map(|name| self.body_index(name).ok().flatten());
            Connection { bodies: bodies.collect(), ends: Vec::new() }
        };
        let joints = self.joints.iter().map(|joint| at(&joint.references().map(|(_, reference)| reference)));
        let forces = self.forces.iter().map(|force| {
            let (mut connection, formulas) = match force {
                Force::Gravity { .. } => (Connection::default(), Vec::new()),
                Force::Spring { a, b, tension, .. } => (at(&[a, b]), vec![formula_of(tension)]),
                Force::Bushing { a, b, formulas, .. } => {
                    (at(&[a, b]), formulas.iter().map(Option::as_deref).collect())
                }
                Force::TorsionSpring { a, b, .. } => (between([a, b]), Vec::new()),
                Force::Applied { point, x, y, .. } => (at(&[point]), [x, y].map(formula_of).into()),
                Force::Torque { body, reaction, torque, .. } => {
                    (between([body, reaction]), vec![formula_of(torque)])
                }
            };
            // A force that follows the motion of another body connects the two.
            for formula in formulas.into_iter().flatten() {
                for (_, quantity) in formula.quantities(self) {
                    connection.bodies.extend(self.bodies_of(quantity.of));
                }
            }
            connection
        });
        let couplings =
            self.couplings.iter().map(|one| Connection { bodies: one.bodies(self), ends: Vec::new() });
        joints.chain(forces).chain(couplings).collect()
    }

    /// The bodies that no prismatic and fixed joints hold to ground.
    fn turning_bodies(&self) -> Vec<usize> {
        let count = self.bodies.len();
        let mut group: Vec<usize> = (0..=count).collect();
        for joint in &self.joints {
            let Joint::Ideal { kind: JointKind::Prismatic { .. } | JointKind::Fixed { .. }, .. } = joint
            else {
                continue;
            };
            let [from, to] = self.ends(joint).map(|end| group[end.and_then(|end| end.body).unwrap_or(count)]);
            group.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
        }
        (0..count).filter(|&body| group[body] != group[count]).collect()
    }

    /// The bodies whose motion a coordinate is.
    pub(crate) fn bodies_of(&self, coordinate: Coordinate) -> Vec<usize> {
        let of = |references: [&str; 2]| {
            let ends = references.into_iter().filter_map(|reference| self.attachment(reference).ok());
            ends.filter_map(|end| end.body).collect()
        };
        match coordinate {
            Coordinate::Time => Vec::new(),
            Coordinate::Position { body, .. } => vec![body],
            Coordinate::Angle(bodies) => bodies.into_iter().flatten().collect(),
            Coordinate::Displacement(joint) => {
                of(self.joints[joint].references().map(|(_, reference)| reference))
            }
            Coordinate::Length(force) => match &self.forces[force] {
                Force::Spring { a, b, .. } | Force::Bushing { a, b, .. } => of([a, b]),
                _ => Vec::new(),
            },
        }
    }
}

fn formula_of(load: &Load) -> Option<&Expression> {
    match load {
        Load::Time(_) => None,
        Load::Motion(expression) => Some(expression),
    }
}
