//! The named columns of a trajectory.

use crate::dynamics::Dynamics;
use crate::error::{Problem, SceneError};
use crate::kinematics::{FrameState, PointState};
use crate::mechanism::Mechanism;
use crate::scene::did_you_mean;

/// Quantities of a body; x and y are those of its centre of mass.
const BODY: [&str; 9] =
    ["x", "y", "angle", "vx", "vy", "angular_velocity", "ax", "ay", "angular_acceleration"];
/// Quantities of a clearance joint.
const JOINT: [&str; 9] = [
    "eccentricity_x",
    "eccentricity_y",
    "eccentricity",
    "penetration",
    "penetration_rate",
    "sliding_velocity",
    "normal_force",
    "friction_force",
    "contact",
];
/// Quantities of a drive.
const DRIVE: [&str; 1] = ["torque"];

/// One column: a quantity (index into the lists above) of something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    /// Of a body.
    Body(usize, usize),
    /// Of a clearance joint.
    Joint(usize, usize),
    /// Of a drive.
    Drive(usize),
}

/// Names of all columns a mechanism has: bodies, clearance joints, drives.
pub fn column_names(mechanism: &Mechanism) -> Vec<String> {
    all_columns(mechanism).map(|(name, _)| name).collect()
}

fn all_columns(mechanism: &Mechanism) -> impl Iterator<Item = (String, Column)> {
    let bodies = mechanism.bodies.iter().enumerate().flat_map(|(index, body)| {
        BODY.iter()
            .enumerate()
            .map(move |(k, name)| (format!("{}.{name}", body.name), Column::Body(index, k)))
    });
    let joints = mechanism.clearance_joints.iter().enumerate().flat_map(|(index, joint)| {
        JOINT
            .iter()
            .enumerate()
            .map(move |(k, name)| (format!("{}.{name}", joint.name), Column::Joint(index, k)))
    });
    let drives = mechanism.driven.iter().enumerate().flat_map(|(index, drive)| {
        DRIVE.iter().map(move |name| (format!("{}.{name}", drive.name), Column::Drive(index)))
    });
    bodies.chain(joints).chain(drives)
}

/// The columns with the given names.
///
/// # Errors
/// Every unknown name, with the nearest known one.
pub fn parse_columns(mechanism: &Mechanism, names: &[String]) -> Result<Vec<Column>, SceneError> {
    let known: Vec<(String, Column)> = all_columns(mechanism).collect();
    let mut problems = Vec::new();
    let mut columns = Vec::with_capacity(names.len());
    for (index, name) in names.iter().enumerate() {
        match known.iter().find(|(other, _)| other == name) {
            Some(&(_, column)) => columns.push(column),
            None => {
                let hint = did_you_mean(name, known.iter().map(|(name, _)| name.as_str()));
                problems.push(Problem::new(
                    format!("settings.outputs[{index}]"),
                    format!("unknown output {name:?}{hint}"),
                ));
            }
        }
    }
    if problems.is_empty() { Ok(columns) } else { Err(SceneError { problems }) }
}

/// Whether any of the columns needs the accelerations.
pub fn needs_acceleration(columns: &[Column]) -> bool {
    columns.iter().any(|column| match column {
        Column::Body(_, quantity) => *quantity >= 6,
        Column::Joint(..) => false,
        Column::Drive(_) => true,
    })
}

impl Column {
    /// Value in the state the dynamics was last moved to.
    pub fn value(self, dynamics: &Dynamics) -> f64 {
        match self {
            Column::Body(index, quantity) => body_value(dynamics, index, quantity),
            Column::Joint(index, quantity) => joint_value(dynamics, index, quantity),
            Column::Drive(index) => dynamics.drive_torque(index),
        }
    }
}

fn body_value(dynamics: &Dynamics, index: usize, quantity: usize) -> f64 {
    let body = &dynamics.mechanism.bodies[index];
    let frame: &FrameState = dynamics.frame(body.frame);
    let PointState { position, velocity, acceleration } = frame.point(body.center);
    // The frames accelerate relative to free fall.
    let acceleration = acceleration + dynamics.mechanism.gravity;
    match quantity {
        0 => position.x,
        1 => position.y,
        2 => frame.angle + body.angle,
        3 => velocity.x,
        4 => velocity.y,
        5 => frame.angular_velocity,
        6 => acceleration.x,
        7 => acceleration.y,
        _ => frame.angular_acceleration,
    }
}

fn joint_value(dynamics: &Dynamics, index: usize, quantity: usize) -> f64 {
    let state = dynamics.contact_state(index);
    let eccentricity = dynamics.joint_motion(&dynamics.mechanism.clearance_joints[index]).eccentricity;
    match quantity {
        0 => eccentricity.x,
        1 => eccentricity.y,
        2 => eccentricity.norm(),
        3 => state.penetration,
        4 => state.penetration_rate,
        5 => state.sliding_velocity,
        // Between the clip and its located instant the continued law may pull by a rounding error.
        6 => state.normal_force.max(0.0),
        7 => state.friction_force,
        _ => f64::from(dynamics.phases[index] != crate::clearance::Phase::Free),
    }
}
