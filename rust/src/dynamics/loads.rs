//! Forces and torques that depend on the motion: values, exact derivatives, and where they change their form.

use super::Dynamics;
use crate::expression::tape::MOST_VARIABLES;
use crate::tree::kinematics::{PointState, Vec2};
use crate::tree::loads::{Load, MotionLoad, Variable};

/// A switch of an expression in the present state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwitchDistance {
    /// How far its state lasts: positive while it does, in the unit of what it looks at.
    pub value: f64,
    /// Its rate by the velocities [1/s]; NaN where it depends on accelerations.
    pub rate: f64,
    /// Its change with each variable times the size of that variable's errors, summed.
    pub error: f64,
    /// The same for rounding errors.
    pub rounding: f64,
}

/// Sizes of errors of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    /// Size of the mechanism [m] and speed of its points [m/s], of which rounding errors are parts.
    pub length: f64,
    /// See there.
    pub speed: f64,
    /// Tolerance of positions [m].
    pub position: f64,
    /// Tolerance of velocities [m/s].
    pub velocity: f64,
}

impl Dynamics<'_> {
    /// Value of a force or torque [N or N m], after [`Dynamics::move_to`].
    #[inline]
    pub fn load(&self, load: &Load) -> f64 {
        match load {
            Load::Time(function) => function.at(self.t)[0],
            Load::Motion(index) => self.motion_load(&self.tree.motion_loads[*index]),
        }
    }

    /// Rate of a force or torque with the motion kept [N/s or N m/s]; that of a function of the motion comes with its
    /// other derivatives.
    #[inline]
    pub(super) fn load_rate(&self, load: &Load) -> f64 {
        match load {
            Load::Time(function) => function.at(self.t)[1],
            Load::Motion(_) => 0.0,
        }
    }

    /// Value of a function of the motion [N or N m], after [`Dynamics::move_to`].
    pub fn motion_load(&self, load: &MotionLoad) -> f64 {
        let variables = self.variables(load);
        load.tape.value(&variables[..load.variables.len()], &self.switches[load.switches()])
    }

    /// Sets the states of all switches to those of the present motion, after [`Dynamics::move_to`].
    pub fn settle_switches(&mut self) {
        for load in &self.tree.motion_loads {
            let variables = self.variables(load);
            for (own, index) in load.switches().enumerate() {
                let states = &self.switches[load.switches()];
                self.switches[index] = load.tape.state(own, &variables[..load.variables.len()], states);
            }
        }
    }

    /// The first function of the motion with a table that does not cover the present motion, with the number at which
    /// it is asked and its ends; after [`Dynamics::settle_switches`].
    pub fn uncovered_table(&self) -> Option<(&MotionLoad, f64, [f64; 2])> {
        self.tree.motion_loads.iter().find_map(|load| {
            let states = &self.switches[load.switches()];
            let (number, ends) = load.tape.outside(&self.variables(load)[..load.variables.len()], states)?;
            Some((load, number, ends))
        })
    }

    /// What is wrong with a function of the motion in the present motion, after [`Dynamics::settle_switches`].
    pub fn fault_of_loads(&self) -> Option<String> {
        if let Some((load, number, [first, last])) = self.uncovered_table() {
            return Some(format!(
                "the table of {:?} over {:?} goes from {first} to {last} and is asked for at {number:.9}; \
                 beyond=\"hold\" keeps the values at its ends",
                load.name, load.text
            ));
        }
        let is_lost = |load: &&MotionLoad| !self.motion_load(load).is_finite();
        self.tree.motion_loads.iter().find(is_lost).map(|load| {
            format!(
                "{:?} is {}, no finite number: {}",
                load.name,
                self.motion_load(load),
                self.described(load)
            )
        })
    }

    /// A function of the motion with the quantities that it depends on, in words.
    pub fn described(&self, load: &MotionLoad) -> String {
        let variables = load.variables.iter().zip(self.variables(load));
        let values = variables.map(|((name, _), value)| format!("{name} = {value:.6e}"));
        format!("{:?} at {}", load.text, values.collect::<Vec<_>>().join(", "))
    }

    /// How far the state of a switch lasts, after [`Dynamics::move_to`]; `states` are those of the present phase.
    pub fn switch_distance(&self, index: usize, states: &[i64], errors: &Uncertainty) -> SwitchDistance {
        let Some((load, own)) = self.tree.load_of_switch(index) else {
            return SwitchDistance { value: f64::INFINITY, rate: 0.0, error: 0.0, rounding: 0.0 };
        };
        let (values, states) = (self.variables(load), &states[load.switches()]);
        let values = &values[..load.variables.len()];
        let value = load.tape.distance(own, values, states).value;
        let gradient = load.tape.distance_gradient(own, values, states);
        let mut distance = SwitchDistance { value, rate: 0.0, error: 0.0, rounding: 0.0 };
        for (((_, variable), slope), value) in load.variables.iter().zip(gradient).zip(values) {
            if slope == 0.0 {
                continue;
            }
            let (size, error) = self.sizes(*variable, errors);
            distance.rate += slope * if is_velocity(*variable) { f64::NAN } else { self.rate(*variable) };
            distance.error += slope.abs() * error;
            distance.rounding += slope.abs() * 4.0 * f64::EPSILON * (size + value.abs());
        }
        distance
    }

    /// Rate of the distance of a switch [1/s], after [`Dynamics::accelerate`].
    pub fn switch_rate(&self, index: usize) -> f64 {
        let Some((load, own)) = self.tree.load_of_switch(index) else { return 0.0 };
        let (values, states) = (self.variables(load), &self.switches[load.switches()]);
        let gradient = load.tape.distance_gradient(own, &values[..load.variables.len()], states);
        let rates = load.variables.iter().zip(gradient);
        rates
            .filter(|(_, slope)| *slope != 0.0)
            .map(|((_, variable), slope)| slope * self.rate(*variable))
            .sum()
    }

    /// Changes the state of a switch to the one that follows; false if it belongs to a table that ends there.
    pub fn flip_switch(&mut self, index: usize) -> bool {
        let Some((load, own)) = self.tree.load_of_switch(index) else { return true };
        let (values, states) = (self.variables(load), &self.switches[load.switches()]);
        let next = load.tape.next_state(own, &values[..load.variables.len()], states);
        self.switches[index] = next;
        load.tape.covers(own, next)
    }

    /// Values of the quantities that a function depends on.
    pub fn variables(&self, load: &MotionLoad) -> [f64; MOST_VARIABLES] {
        let mut values = [0.0; MOST_VARIABLES];
        for (value, (_, variable)) in values.iter_mut().zip(&load.variables) {
            *value = self.variable(*variable);
        }
        values
    }

    fn variable(&self, variable: Variable) -> f64 {
        match variable {
            Variable::Time => self.t.time,
            Variable::Position(point, axis) => self.point(point).position[axis],
            Variable::Velocity(point, axis) => self.point(point).velocity[axis],
            Variable::Angle([a, b], offset) => self.angle(b) - self.angle(a) + offset,
            Variable::AngularVelocity([a, b]) => {
                self.states[b].angular_velocity - self.states[a].angular_velocity
            }
            Variable::Coordinate(column) => self.coordinate(column).position,
            Variable::Rate(column) => self.coordinates[column].velocity,
            Variable::Length(link) => self.link_motion(&self.tree.links[link])[0],
            Variable::Lengthening(link) => self.link_motion(&self.tree.links[link])[1],
        }
    }

    /// Rate of a variable; that of a velocity after [`Dynamics::accelerate`].
    fn rate(&self, variable: Variable) -> f64 {
        match variable {
            Variable::Time => 1.0,
            Variable::Position(point, axis) => self.variable(Variable::Velocity(point, axis)),
            Variable::Velocity(point, axis) => self.point(point).acceleration[axis] + self.tree.gravity[axis],
            Variable::Angle(frames, _) => self.variable(Variable::AngularVelocity(frames)),
            Variable::AngularVelocity([a, b]) => {
                self.states[b].angular_acceleration - self.states[a].angular_acceleration
            }
            Variable::Coordinate(column) => self.coordinates[column].velocity,
            Variable::Rate(column) => self.coordinates[column].acceleration,
            Variable::Length(link) => self.link_motion(&self.tree.links[link])[1],
            Variable::Lengthening(link) => {
                let [a, b] = self.tree.links[link].points.map(|point| self.point(point));
                let (e, rate) = (b.position - a.position, b.velocity - a.velocity);
                let (length, lengthening) = (e.norm(), rate.dot(&e) / e.norm());
                let along = (b.acceleration - a.acceleration).dot(&e) / length;
                along + (rate.norm_squared() - lengthening * lengthening) / length
            }
        }
    }

    /// Size of a variable and of its errors.
    fn sizes(&self, variable: Variable, errors: &Uncertainty) -> (f64, f64) {
        let Uncertainty { length, speed, position, velocity } = *errors;
        match variable {
            Variable::Time => (self.t.time.abs(), 0.0),
            Variable::Position(..) | Variable::Length(_) => (length, position),
            Variable::Velocity(..) | Variable::Lengthening(_) => (speed, velocity),
            Variable::Angle(..) => (1.0, position / length),
            Variable::AngularVelocity(_) => (speed / length, velocity / length),
            Variable::Coordinate(_) => (length, position),
            Variable::Rate(_) => (speed, velocity),
        }
    }

    /// Derivatives of a function of the motion with respect to the position and the velocity of every column, and
    /// with respect to time.
    pub(super) fn load_derivatives(&self, load: &MotionLoad) -> (Vec<f64>, Vec<f64>, f64) {
        let columns = self.coordinates.len();
        let (mut by_position, mut by_velocity, mut by_time) = (vec![0.0; columns], vec![0.0; columns], 0.0);
        let values = self.variables(load);
        let gradient = load.tape.gradient(&values[..load.variables.len()], &self.switches[load.switches()]);
        for ((_, variable), slope) in load.variables.iter().zip(gradient) {
            let by = (&mut by_position[..], &mut by_velocity[..]);
            match *variable {
                Variable::Time => by_time += slope,
                Variable::Position(point, axis) => {
                    let motion = self.point(point);
                    self.add_point_columns(point.frame, &motion, slope * unit(axis), by.0, &mut []);
                }
                Variable::Velocity(point, axis) => {
                    let motion = self.point(point);
                    self.add_point_columns(point.frame, &motion, slope * unit(axis), by.1, by.0);
                }
                Variable::Angle(frames, _) => self.add_rotation_columns(frames, slope, by.0),
                Variable::AngularVelocity(frames) => self.add_rotation_columns(frames, slope, by.1),
                Variable::Coordinate(column) => by.0[column] += slope,
                Variable::Rate(column) => by.1[column] += slope,
                Variable::Length(link) | Variable::Lengthening(link) => {
                    let points = self.tree.links[link].points;
                    let [a, b] = points.map(|point| self.point(point));
                    let (e, rate) = (b.position - a.position, b.velocity - a.velocity);
                    let length = e.norm();
                    let normal = e / length;
                    // ∂n·ė/∂e = (ė - (n·ė) n) / |e|
                    let turning = (rate - rate.dot(&normal) * normal) / length;
                    for (point, motion, sign) in [(points[1], b, slope), (points[0], a, -slope)] {
                        if let Variable::Length(_) = variable {
                            self.add_point_columns(point.frame, &motion, sign * normal, by.0, &mut []);
                        } else {
                            self.add_point_columns(point.frame, &motion, sign * normal, by.1, by.0);
                            self.add_point_columns(point.frame, &motion, sign * turning, by.0, &mut []);
                        }
                    }
                }
            }
        }
        (by_position, by_velocity, by_time)
    }

    /// Adds, for every column that moves a point, `weight` times the column of its position to `position` and, unless
    /// it is empty, `weight` times that of its velocity to `velocity`.
    fn add_point_columns(
        &self,
        frame: usize,
        point: &PointState,
        weight: Vec2,
        position: &mut [f64],
        velocity: &mut [f64],
    ) {
        for &column in &self.tree.paths[frame].columns {
            let moving = &self.states[column + 1];
            position[column] += weight.dot(&moving.column(point.position));
            if let Some(by) = velocity.get_mut(column) {
                *by += weight.dot(&moving.velocity_column(point.velocity));
            }
        }
    }

    /// The same for the rotation of a frame relative to another.
    fn add_rotation_columns(&self, frames: [usize; 2], weight: f64, by: &mut [f64]) {
        for (frame, sign) in frames.into_iter().zip([-weight, weight]) {
            for &column in &self.tree.paths[frame].columns {
                by[column] += sign * self.states[column + 1].rotation;
            }
        }
    }
}

/// Unit vector along x or y.
fn unit(axis: usize) -> Vec2 {
    let mut unit = Vec2::zeros();
    unit[axis] = 1.0;
    unit
}

/// Whether the rate of a variable depends on accelerations.
fn is_velocity(variable: Variable) -> bool {
    matches!(
        variable,
        Variable::Velocity(..) | Variable::AngularVelocity(_) | Variable::Rate(_) | Variable::Lengthening(_)
    )
}
