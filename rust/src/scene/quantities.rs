//! The quantities of the motion that loads may depend on, by the names of outputs.

use crate::error::meant_or_known;
use crate::expression::dimension::{Dimension, PLAIN};
use crate::scene::parts::{CENTER_OF_MASS, Force, Joint, JointKind, Scene};

/// A quantity of the motion: a coordinate, or its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The coordinate.
    pub of: Coordinate,
    /// Whether it is the rate of that.
    pub is_rate: bool,
}

/// A coordinate of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coordinate {
    /// Time [s].
    Time,
    /// Coordinate x or y of a point of a body, given in the body frame [m].
    Position {
        /// The body.
        body: usize,
        /// The point in the body frame [m].
        point: [f64; 2],
        /// 0 for x, 1 for y.
        axis: usize,
    },
    /// Angle of the second body relative to the first, with full turns [rad]; `None` is ground.
    Angle([Option<usize>; 2]),
    /// Displacement in a prismatic joint, by the index of the joint [m].
    Displacement(usize),
    /// Length of a spring or damper, or deflection of a bushing, by the index of the force [m].
    Length(usize),
}

impl Quantity {
    /// Its dimension.
    pub fn dimension(self) -> Dimension {
        let [mass, length, time] = match self.of {
            Coordinate::Time => [0, 0, 1],
            Coordinate::Position { .. } | Coordinate::Displacement(_) | Coordinate::Length(_) => [0, 1, 0],
            Coordinate::Angle(_) => PLAIN,
        };
        [mass, length, time - i8::from(self.is_rate)]
    }
}

/// The name of time in expressions.
pub const TIME: &str = "time";

/// Ends of the names of outputs that follow from the forces.
const OF_FORCES: [&str; 18] = [
    "ax", "ay", "angular_acceleration", "acceleration", "reaction_x", "reaction_y", "reaction_torque",
    "force", "torque", "driver_force", "driver_torque", "power", "normal_force", "friction_force",
    "penetration", "impact_loss", "friction_loss", "wear",
];

impl Scene {
    /// The quantity with the name of an output.
    ///
    /// # Errors
    /// What is wrong with the name, and what may be meant.
    pub fn quantity(&self, name: &str) -> Result<Quantity, String> {
        let known = self.quantities();
        if let Some(&(_, quantity)) = known.iter().find(|(other, _)| other == name) {
            return Ok(quantity);
        }
        let (owner, last) = name.rsplit_once('.').unwrap_or(("", name));
        if OF_FORCES.contains(&last) && self.owns(owner) {
            return Err(format!(
                "{name:?} follows from the forces themselves, so that a force cannot depend on it; positions, angles, \
                 their velocities, lengths of springs and {TIME:?} are accepted"
            ));
        }
        // Where a part of the scene is named, its own quantities say more than the nearest name of all.
        let parts = known.iter().filter_map(|(name, _)| name.rsplit_once('.'));
        let own = parts.filter(|(other, _)| *other == owner).map(|(_, quantity)| quantity);
        if own.clone().next().is_some() {
            return Err(format!("{owner:?} has no quantity {last:?}{}", meant_or_known(last, own)));
        }
        let hint = meant_or_known(name, known.iter().map(|(name, _)| name.as_str()));
        Err(format!("unknown quantity {name:?}{hint}"))
    }

    /// Whether a name is that of a body, a point, a joint, a force or a drive.
    fn owns(&self, name: &str) -> bool {
        self.attachment(name).is_ok()
            || self.joints.iter().any(|joint| joint.name() == name)
            || self.forces.iter().any(|force| force.name() == Some(name))
            || self.drives.iter().any(|drive| drive.name() == name)
            || self.couplings.iter().any(|coupling| coupling.name == name)
    }

    /// All quantities with their names.
    fn quantities(&self) -> Vec<(String, Quantity)> {
        let mut known = vec![(TIME.to_owned(), Quantity { of: Coordinate::Time, is_rate: false })];
        // A coordinate and, if it has a name, its rate.
        let mut add = |owner: &str, names: &[&str], of: Coordinate| {
            let quantities = names.iter().zip([false, true]);
            known.extend(
                quantities.map(|(name, is_rate)| (format!("{owner}.{name}"), Quantity { of, is_rate })),
            );
        };
        const ANGLE: [&str; 2] = ["angle", "angular_velocity"];
        for (index, body) in self.bodies.iter().enumerate() {
            let named =
                body.points.iter().map(|point| (format!("{}.{}", body.name, point.name), point.position));
            let center = [body.name.clone(), format!("{}.{CENTER_OF_MASS}", body.name)];
            let centers = center.into_iter().map(|owner| (owner, body.center_of_mass));
            for (owner, point) in centers.chain(named) {
                for (axis, names) in [["x", "vx"], ["y", "vy"]].into_iter().enumerate() {
                    add(&owner, &names, Coordinate::Position { body: index, point, axis });
                }
            }
            add(&body.name, &ANGLE, Coordinate::Angle([None, Some(index)]));
        }
        for (index, joint) in self.joints.iter().enumerate() {
            let Joint::Ideal { name, kind, .. } = joint else { continue };
            match kind {
                JointKind::Revolute => {
                    let bodies = self.ends(joint).map(|end| end.and_then(|end| end.body));
                    add(name, &ANGLE, Coordinate::Angle(bodies));
                }
                JointKind::Prismatic { .. } => {
                    add(name, &["displacement", "velocity"], Coordinate::Displacement(index));
                }
                JointKind::Fixed { .. } => {}
            }
        }
        for (index, force) in self.forces.iter().enumerate() {
            match force {
                Force::Spring { name, .. } => {
                    add(name, &["length", "lengthening"], Coordinate::Length(index))
                }
                Force::TorsionSpring { name, a, b, .. } => {
                    let bodies = [a, b].map(|name| self.body_index(name).unwrap_or_default());
                    add(name, &ANGLE[..1], Coordinate::Angle(bodies));
                }
                Force::Bushing { name, a, b, .. } => {
                    let bodies = [a, b].map(|end| self.attachment(end).ok().and_then(|end| end.body));
                    add(name, &ANGLE[..1], Coordinate::Angle(bodies));
                    add(name, &["deflection"], Coordinate::Length(index));
                }
                Force::Gravity { .. } | Force::Applied { .. } | Force::Torque { .. } => {}
            }
        }
        known
    }
}
