//! The named columns of a trajectory.

use crate::contact::pair::{Phase, Surfaces};
use crate::dynamics::{Dynamics, SlotContact, Wrench};
use crate::error::{InputError, Problem, Subject, meant_or_known};
use crate::mechanism::compiled::Mechanism;
use crate::run::work::Work;
use crate::scene::parts::ENERGY as ENERGY_OUTPUT;
use crate::tree::elements::{Guide, IdealKind, Realization};
use crate::tree::forces::Ends;
use crate::tree::kinematics::{PointState, Vec2};

/// Quantities of a body; x and y are those of its center of mass.
const BODY: [&str; 9] =
    ["x", "y", "angle", "vx", "vy", "angular_velocity", "ax", "ay", "angular_acceleration"];
/// Quantities of a clearance joint.
const JOINT: [&str; 10] = [
    "eccentricity_x", "eccentricity_y", "eccentricity", "penetration", "penetration_rate",
    "sliding_velocity", "normal_force", "friction_force", "contact", "sticking",
];
/// Those of friction, among them.
const SLIDING: usize = 5;
const FRICTION: usize = 7;
/// First of these that every contact has: those of a bearing's center come before. The last has one that can stick.
const FIRST_OF_CONTACT: usize = 3;
/// Quantities of what slides in a guide, seen from the guide: along its axis, to its left, angle; a pin has no tilt.
const GUIDE: [&str; 7] =
    ["displacement", "velocity", "offset", "reaction_x", "reaction_y", "reaction_torque", "tilt"];
/// Where the surfaces of a contact at a face touch or are closest.
const PLACE: [&str; 2] = ["point_x", "point_y"];
/// Energy dissipated in a clearance joint, and wear, since the start of the run.
const LOSS: [&str; 3] = ["impact_loss", "friction_loss", "wear"];
/// Quantities of a named point of a body.
const POINT: [&str; 6] = ["x", "y", "vx", "vy", "ax", "ay"];
/// Coordinate of a revolute joint.
const ANGLE: [&str; 3] = ["angle", "angular_velocity", "angular_acceleration"];
/// Coordinate of a prismatic joint.
const DISPLACEMENT: [&str; 3] = ["displacement", "velocity", "acceleration"];
/// Reaction of a joint on its second body.
const REACTION: [&str; 3] = ["reaction_x", "reaction_y", "reaction_torque"];
/// What a coupling exerts on an angle or on a displacement: on the driven one, on the driver.
const COUPLING: [[&str; 2]; 2] = [["torque", "driver_torque"], ["force", "driver_force"]];
/// Force on the driven teeth, where a pressure angle is given; with backlash the transmission error too.
const TEETH: [&str; 4] = ["tooth_force", "tooth_force_x", "tooth_force_y", "transmission_error"];
/// Energies, work and losses of the whole mechanism.
const ENERGY: [&str; 9] = [
    "kinetic", "potential", "contact", "total", "input", "impact_loss", "friction_loss", "damping_loss",
    "balance",
];

/// One column: the index of an element, and the index of its quantity in the lists above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// Quantity of a body.
    Body(usize, usize),
    /// Quantity of a contact slot.
    Joint(usize, usize),
    /// Quantity of a guide.
    Guide(usize, usize),
    /// Torque or force of a drive.
    Drive(usize),
    /// Power of a drive.
    DrivePower(usize),
    /// Quantity of a named point: body, point, quantity.
    Point(usize, usize, usize),
    /// Coordinate of an ideal joint.
    Coordinate(usize, usize),
    /// Reaction of an ideal joint.
    Reaction(usize, usize),
    /// Output of a force element.
    Force(usize, usize),
    /// Quantity of the friction of an ideal joint.
    DryJoint(usize, usize),
    /// Torque or force of a coupling.
    Coupling(usize, usize),
    /// Place of a contact at a face.
    Place(usize, usize),
    /// Quantity of the teeth of a coupling.
    Teeth(usize, usize),
    /// Loss of a contact slot.
    Loss(usize, usize),
    /// Wear of a slot in a sector of its bearing.
    SectorWear(usize, usize),
    /// Energy, work or loss of the whole mechanism.
    Energy(usize),
}

/// Names of the default columns of a run: bodies, clearance joints, drives.
pub fn column_names(mechanism: &Mechanism) -> Vec<String> {
    usual_columns(mechanism).into_iter().map(|(name, _)| name).collect()
}

/// Names of the columns that a run has only on request.
pub fn further_column_names(mechanism: &Mechanism) -> Vec<String> {
    further_columns(mechanism).into_iter().map(|(name, _)| name).collect()
}

type Named = (String, Column);

/// `owner.quantity` for a list of quantities.
fn named<'a>(
    owner: &'a str,
    quantities: &'a [&str],
    column: impl Fn(usize) -> Column + 'a,
) -> impl Iterator<Item = Named> + 'a {
    quantities.iter().enumerate().map(move |(k, name)| (format!("{owner}.{name}"), column(k)))
}

fn usual_columns(mechanism: &Mechanism) -> Vec<Named> {
    let mut columns = Vec::new();
    for (index, body) in mechanism.bodies.iter().enumerate() {
        columns.extend(named(&body.name, &BODY, |k| Column::Body(index, k)));
    }
    for (index, guide) in mechanism.guides.iter().enumerate() {
        let quantities = if guide.angle.is_some() { &GUIDE[..] } else { &GUIDE[..GUIDE.len() - 1] };
        columns.extend(named(&guide.name, quantities, |k| Column::Guide(index, k)));
    }
    for (index, slot) in mechanism.slots.iter().enumerate() {
        let first = match slot.law.surfaces {
            Surfaces::Bearing { .. } | Surfaces::Worn(_) => 0,
            Surfaces::Face(_) => FIRST_OF_CONTACT,
        };
        let end = if slot.law.stick_slip().is_some() { JOINT.len() } else { JOINT.len() - 1 };
        let of_slot = named(&slot.name, &JOINT[first..end], |k| Column::Joint(index, first + k));
        // Flanks have no friction.
        columns.extend(of_slot.filter(|(_, column)| {
            slot.backlash.is_none() || !matches!(column, Column::Joint(_, SLIDING | FRICTION))
        }));
    }
    for (index, dry) in mechanism.dry_joints.iter().enumerate() {
        let quantities = &dry.law.outputs()[..3];
        columns.extend(named(mechanism.dry_joint_name(index), quantities, |k| Column::DryJoint(index, k)));
    }
    for (index, driven) in mechanism.driven.iter().enumerate() {
        let effort = if driven.is_angle { "torque" } else { "force" };
        columns.push((format!("{}.{effort}", driven.name), Column::Drive(index)));
    }
    for (index, (coupling, mesh)) in mechanism.all_couplings().enumerate() {
        for (k, end) in [&coupling.driven, &coupling.driver].into_iter().enumerate() {
            let effort = COUPLING[usize::from(end.slide.is_some())][k];
            columns.push((format!("{}.{effort}", coupling.name), Column::Coupling(index, k)));
        }
        let known = if index < mechanism.couplings.len() { TEETH.len() - 1 } else { TEETH.len() };
        let of_teeth = named(&coupling.name, &TEETH[..known], |k| Column::Teeth(index, k));
        columns.extend(of_teeth.filter(|_| mesh.is_some()));
    }
    columns
}

fn further_columns(mechanism: &Mechanism) -> Vec<Named> {
    let mut columns = Vec::new();
    for (index, body) in mechanism.bodies.iter().enumerate() {
        for (place, (point, _)) in body.points.iter().enumerate() {
            let owner = format!("{}.{point}", body.name);
            columns.extend(named(&owner, &POINT, |k| Column::Point(index, place, k)));
        }
    }
    for (index, joint) in mechanism.ideal_joints.iter().enumerate() {
        let coordinate: &[&str] = match joint.kind {
            IdealKind::Revolute => &ANGLE,
            IdealKind::Prismatic => &DISPLACEMENT,
            IdealKind::Fixed => &[],
        };
        columns.extend(named(&joint.name, coordinate, |k| Column::Coordinate(index, k)));
        columns.extend(named(&joint.name, &REACTION, |k| Column::Reaction(index, k)));
    }
    for (index, slot) in mechanism.slots.iter().enumerate() {
        if let Surfaces::Face(_) = slot.law.surfaces {
            columns.extend(named(&slot.name, &PLACE, |k| Column::Place(index, k)));
        }
        let losses = if slot.backlash.is_none() { &LOSS[..] } else { &LOSS[..1] };
        columns.extend(named(&slot.name, losses, |k| Column::Loss(index, k)));
    }
    for (index, dry) in mechanism.dry_joints.iter().enumerate() {
        let loss = format!("{}.{}", mechanism.dry_joint_name(index), dry.law.outputs()[3]);
        columns.push((loss, Column::DryJoint(index, 3)));
    }
    for (index, driven) in mechanism.driven.iter().enumerate() {
        columns.push((format!("{}.power", driven.name), Column::DrivePower(index)));
    }
    for (index, element) in mechanism.forces.iter().enumerate() {
        columns.extend(named(&element.name, element.outputs(), |k| Column::Force(index, k)));
    }
    columns.extend(named(ENERGY_OUTPUT, &ENERGY, Column::Energy));
    columns
}

/// Names of the columns of wear by sector, which a run has only where they are asked for as such.
pub fn sector_column_names(mechanism: &Mechanism) -> Vec<String> {
    sector_columns(mechanism).map(|(name, _)| name).collect()
}

fn sector_columns(mechanism: &Mechanism) -> impl Iterator<Item = Named> {
    mechanism.slots.iter().enumerate().flat_map(|(index, slot)| {
        let wear = LOSS[2];
        (0..slot.law.sectors())
            .map(move |sector| (format!("{}.{wear}_{sector}", slot.name), Column::SectorWear(index, sector)))
    })
}

/// Zeros for the sectors of every slot of which a column asks for one; nothing where none does.
pub(crate) fn asked_sectors(mechanism: &Mechanism, columns: impl Iterator<Item = Column>) -> Vec<Vec<f64>> {
    let mut sectors = Vec::new();
    for column in columns {
        if let Column::SectorWear(slot, _) = column {
            sectors.resize(mechanism.slots.len(), Vec::new());
            sectors[slot].resize(mechanism.slots[slot].law.sectors(), 0.0);
        }
    }
    sectors
}

/// The columns with the given names.
///
/// # Errors
/// Every unknown name, with the nearest known one.
pub fn parse_columns(mechanism: &Mechanism, names: &[String]) -> Result<Vec<Column>, InputError> {
    let mut known = usual_columns(mechanism);
    // Each run of a study does this, and to write a hundred names takes as long as to assemble a mechanism.
    let is_usual = |name: &String| known.iter().any(|(other, _)| other == name);
    if !names.iter().all(is_usual) {
        known.extend(further_columns(mechanism));
        known.extend(sector_columns(mechanism));
    }
    let mut problems = Vec::new();
    let mut columns = Vec::with_capacity(names.len());
    for (index, name) in names.iter().enumerate() {
        match known.iter().find(|(other, _)| other == name) {
            Some(&(_, column)) => columns.push(column),
            None => {
                let hint = meant_or_known(name, known.iter().map(|(name, _)| name.as_str()));
                problems.push(Problem::new(
                    format!("settings.outputs[{index}]"),
                    format!("unknown output {name:?}{hint}"),
                ));
            }
        }
    }
    Subject::Settings.judge(columns, problems)
}

/// What must be computed for every sample, decided once from the columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Accelerations.
    pub acceleration: bool,
    /// Contacts of the clearance joints.
    pub contacts: bool,
    /// Reactions of the ideal joints, and contacts.
    pub reactions: bool,
    /// Integrals of powers over the run.
    pub work: bool,
}

impl Needs {
    /// The needs of some columns.
    pub fn of(columns: &[Column]) -> Self {
        let mut needs = Self::default();
        for column in columns {
            match column {
                Column::Body(_, quantity) => needs.acceleration |= *quantity >= 6,
                Column::Point(_, _, quantity) => needs.acceleration |= *quantity >= 4,
                Column::Coordinate(_, quantity) => needs.acceleration |= *quantity >= 2,
                Column::Drive(_)
                | Column::DrivePower(_)
                | Column::Reaction(..)
                | Column::Coupling(..)
                | Column::Teeth(..) => {
                    needs.reactions = true;
                }
                Column::Loss(..) | Column::SectorWear(..) => needs.work = true,
                Column::DryJoint(_, 3) => needs.work = true,
                Column::DryJoint(..) => needs.acceleration = true,
                Column::Energy(quantity) => {
                    needs.contacts = true;
                    needs.work |= *quantity >= 4;
                }
                Column::Joint(..) => needs.contacts = true,
                Column::Guide(_, quantity) => needs.contacts |= (3..6).contains(quantity),
                Column::Place(..) | Column::Force(..) => {}
            }
        }
        needs.acceleration |= needs.reactions;
        needs
    }
}

impl Column {
    /// Normal force of a clearance joint.
    pub fn normal_force(joint: usize) -> Self {
        Column::Joint(joint, 6)
    }

    /// Value in the state of the dynamics, for which the [`Needs`] of the column have been computed.
    pub fn value(self, dynamics: &Dynamics, work: &Work) -> f64 {
        let tree = dynamics.tree;
        match self {
            Column::Body(index, quantity) => body_value(dynamics, index, quantity),
            Column::Joint(index, quantity) => joint_value(dynamics, index, quantity),
            Column::Guide(index, quantity) => guide_value(dynamics, &tree.guides[index], quantity),
            Column::Drive(index) => dynamics.drive_effort(index),
            Column::DrivePower(index) => dynamics.drive_power(index),
            Column::Point(index, place, quantity) => {
                let body = &tree.bodies[index];
                let point = dynamics.frame(body.frame).point(body.points[place].1);
                point_value(dynamics, &point, quantity)
            }
            Column::Coordinate(index, quantity) => coordinate_value(dynamics, index, quantity),
            Column::Reaction(index, quantity) => {
                let reaction = dynamics.reaction(index);
                [reaction.force.x, reaction.force.y, reaction.moment][quantity]
            }
            Column::Force(index, quantity) => {
                let element = &tree.forces[index];
                match element.ends {
                    // The angle of the bodies, not of their frames.
                    Ends::Frames(..) if quantity == 0 => relative_rotation(dynamics, element.bodies, 0),
                    _ => dynamics.force_output(element, quantity),
                }
            }
            Column::DryJoint(index, 3) => work.dry_joints[index],
            Column::DryJoint(index, quantity) => dynamics.dry_value(index, quantity),
            Column::Coupling(index, quantity) => dynamics.coupling_efforts(index)[quantity],
            Column::Place(index, quantity) => {
                let [_, touching] = dynamics.touching_points(&tree.slots[index]);
                dynamics.point(touching).position[quantity]
            }
            Column::Teeth(index, quantity) => teeth_value(dynamics, index, quantity),
            Column::Loss(index, quantity) => {
                let loss = work.contacts[index];
                [loss.impact, loss.friction - dynamics.carried_energy(index), loss.wear][quantity]
            }
            Column::SectorWear(index, sector) => work.sectors[index][sector],
            Column::Energy(quantity) => energy_value(dynamics, work, quantity),
        }
    }
}

fn teeth_value(dynamics: &Dynamics, index: usize, quantity: usize) -> f64 {
    let tree = dynamics.tree;
    match index.checked_sub(tree.couplings.len()) {
        Some(backlash) if quantity == 3 => dynamics.transmission_error(&tree.backlashes[backlash]),
        _ => {
            let mesh = tree.all_couplings().nth(index).and_then(|(_, mesh)| mesh);
            let force = mesh.map_or(Vec2::zeros(), |mesh| dynamics.force_on_teeth(index, mesh));
            [force.norm(), force.x, force.y][quantity]
        }
    }
}

/// Where something slides in a guide, and the forces of all its contacts on it, with their moment about its point.
fn guide_value(dynamics: &Dynamics, guide: &Guide, quantity: usize) -> f64 {
    let motion = dynamics.guide_motion(guide);
    match quantity {
        0 => motion.displacement,
        1 => motion.velocity,
        2 => motion.offset,
        6 => relative_rotation(dynamics, guide.bodies, 0) - guide.angle.unwrap_or(0.0),
        _ => {
            let Wrench { force, moment } = dynamics.guide_reaction(guide);
            [force.x, force.y, moment][quantity - 3]
        }
    }
}

/// Angle, angular velocity or angular acceleration of the second body relative to the first.
fn relative_rotation(dynamics: &Dynamics, bodies: [Option<usize>; 2], quantity: usize) -> f64 {
    let [a, b] = bodies.map(|body| {
        body.map_or([0.0; 3], |body| {
            let frame = dynamics.frame(dynamics.tree.bodies[body].frame);
            [dynamics.body_angle(body), frame.angular_velocity, frame.angular_acceleration]
        })
    });
    b[quantity] - a[quantity]
}

/// One of x, y, vx, vy, ax, ay. Accelerations of frames are relative to free fall, so gravity is added.
#[inline(always)]
fn point_value(dynamics: &Dynamics, point: &PointState, quantity: usize) -> f64 {
    // Not an array of all six: the compiler computes the one that is asked for.
    match quantity {
        0 => point.position.x,
        1 => point.position.y,
        2 => point.velocity.x,
        3 => point.velocity.y,
        4 => point.acceleration.x + dynamics.tree.gravity.x,
        _ => point.acceleration.y + dynamics.tree.gravity.y,
    }
}

fn body_value(dynamics: &Dynamics, index: usize, quantity: usize) -> f64 {
    let body = &dynamics.tree.bodies[index];
    let frame = dynamics.frame(body.frame);
    match quantity {
        2 => dynamics.body_angle(index),
        5 => frame.angular_velocity,
        8 => frame.angular_acceleration,
        _ => point_value(dynamics, &frame.point(body.center), quantity - quantity / 3),
    }
}

fn coordinate_value(dynamics: &Dynamics, index: usize, quantity: usize) -> f64 {
    let joint = &dynamics.tree.ideal_joints[index];
    match (joint.kind, joint.realization) {
        (IdealKind::Prismatic, Realization::Tree { column: Some(column), .. }) => {
            let coordinate = dynamics.coordinate(column);
            [coordinate.position, coordinate.velocity, coordinate.acceleration][quantity]
        }
        (IdealKind::Revolute | IdealKind::Prismatic | IdealKind::Fixed, _) => {
            relative_rotation(dynamics, joint.bodies, quantity)
        }
    }
}

fn energy_value(dynamics: &Dynamics, work: &Work, quantity: usize) -> f64 {
    match quantity {
        0 => dynamics.kinetic_energy(),
        1 => dynamics.potential_energy(),
        2 => dynamics.contact_energies(),
        3 => dynamics.total_energy(),
        4 => work.input,
        5 => work.contacts.iter().map(|loss| loss.impact).sum(),
        6 => work.friction() - dynamics.carried_energies(),
        7 => work.damping,
        _ => {
            dynamics.total_energy() - work.start_energy - work.input + work.losses()
                - dynamics.carried_energies()
        }
    }
}

fn joint_value(dynamics: &Dynamics, index: usize, quantity: usize) -> f64 {
    let SlotContact { motion, state } = dynamics.contact(index);
    let slot = &dynamics.tree.slots[index];
    let [x, y] = dynamics.slot_to_world(slot, motion.eccentricity.into()).into();
    match quantity {
        0 => x,
        1 => y,
        2 => Vec2::new(x, y).norm(),
        3 => state.penetration,
        4 => state.penetration_rate,
        5 => state.sliding_velocity,
        // Up to the located instant of the clipping the force may be tensile by a rounding error.
        6 => state.normal_force.max(0.0),
        7 => state.friction_force,
        8 => f64::from(dynamics.phases[index].touches()),
        _ => match dynamics.phases[index] {
            Phase::Contact { clipped: false, traction: Some(traction), .. } => f64::from(traction.sticks()),
            _ => 0.0,
        },
    }
}
