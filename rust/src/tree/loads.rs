//! Forces and torques of the tree: functions of time, or of quantities of the motion of its frames.

use crate::expression::tape::Tape;
use crate::scene::time_function::TimeFunction;
use crate::tree::elements::FramePoint;

/// A component of a force, or a torque.
#[derive(Clone, Debug, PartialEq)]
pub enum Load {
    /// A function of time.
    Time(TimeFunction),
    /// The function of the motion with this index in the tree.
    Motion(usize),
}

/// A quantity of the motion of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// What it is, or the rate of what.
    pub of: Measure,
    /// Whether it is the rate.
    pub is_rate: bool,
}

/// What a function of the motion may depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// Time [s].
    Time,
    /// Coordinate of a point, 0 for x and 1 for y [m].
    Position(FramePoint, usize),
    /// Angle of the second frame relative to the first, and what is added to it [rad].
    Angle([usize; 2], f64),
    /// Coordinate of a column.
    Coordinate(usize),
    /// Distance of two points, and up to where its rate is zero [m].
    Length([FramePoint; 2], f64),
    /// A quantity of a contact, by the index of its slot.
    Contact(usize, ContactQuantity),
}

/// A quantity of a contact on which its laws may depend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactQuantity {
    /// Penetration [m].
    Penetration,
    /// Its rate [m/s].
    PenetrationRate,
    /// Its rate at the onset of the contact [m/s].
    ImpactVelocity,
    /// Sliding velocity [m/s].
    SlidingVelocity,
    /// Normal force [N].
    NormalForce,
}

/// Whose law of contact a function is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LawOf {
    /// Index of the slot.
    pub slot: usize,
    /// Whether it is that of friction.
    pub is_friction: bool,
}

/// A function of the motion.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLoad {
    /// Name of the force or torque, or of the contact.
    pub name: String,
    /// What the user wrote.
    pub text: String,
    /// The same, compiled.
    pub tape: Tape,
    /// The quantities it depends on, with their names.
    pub variables: Vec<(String, Variable)>,
    /// The component of the bodies on whose motion it depends.
    pub component: usize,
    /// Index of its first switch among those of all functions.
    pub first_switch: usize,
    /// The contact whose law it is. It is evaluated with the contact; here are its switches, which act while that presses.
    pub law_of: Option<LawOf>,
}

impl MotionLoad {
    /// Indices of its switches.
    pub fn switches(&self) -> std::ops::Range<usize> {
        self.first_switch..self.first_switch + self.tape.switches.len()
    }
}
