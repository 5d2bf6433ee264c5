//! Forces and torques that depend on the motion: values, exact derivatives, and where they change their form.

use super::{Dynamics, SlotMotion};
use crate::contact::pair::{ContactState, Phase, RelativeMotion};
use crate::expression::tape::MOST_VARIABLES;
use crate::numerics::accuracy::ROUNDING;
use crate::numerics::dual::{Dual, Scalar};
use crate::tree::elements::ContactSlot;
use crate::tree::kinematics::{PointState, Vec2};
use crate::tree::loads::{ContactQuantity, LawOf, Load, Measure, MotionLoad, Variable};

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
    /// Whether what it looks at rests at zero.
    pub rests: bool,
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

    /// Value of a function of the motion [N or N m], after [`Dynamics::move_to`].
    pub fn motion_load(&self, load: &MotionLoad) -> f64 {
        let variables = self.variables(load);
        load.tape.value(&variables[..load.variables.len()], &self.switches[load.switches()])
    }

    /// Sets the states of all switches to those of the present motion, after [`Dynamics::move_to`].
    pub fn settle_switches(&mut self) {
        for load in &self.tree.motion_loads {
            self.settle(load);
        }
    }

    /// The same for the laws of one contact, where it begins to press.
    pub fn settle_contact(&mut self, slot: usize) {
        for load in &self.tree.motion_loads {
            if load.law_of.is_some_and(|law| law.slot == slot) {
                self.settle(load);
            }
        }
    }

    fn settle(&mut self, load: &MotionLoad) {
        self.settle_before(load, load.tape.switches.len());
    }

    /// The same for the switches of a function before one of them; how many changed.
    pub fn settle_before(&mut self, load: &MotionLoad, end: usize) -> usize {
        if !self.acts(load) {
            return 0;
        }
        let (variables, mut changes) = (self.variables(load), 0);
        for (own, index) in load.switches().enumerate().take(end) {
            let states = &self.switches[load.switches()];
            let state = load.tape.state(own, &variables[..load.variables.len()], states);
            changes += usize::from(state != self.switches[index]);
            self.switches[index] = state;
        }
        self.hand_on(load);
        changes
    }

    /// Whether a function acts in the present phases: the law of a contact does while that presses.
    pub fn acts(&self, load: &MotionLoad) -> bool {
        let phase = load.law_of.map(|law| self.phases[law.slot]);
        matches!(phase, None | Some(Phase::Contact { clipped: false, .. }))
    }

    /// Gives a contact the states of the switches of its law.
    fn hand_on(&mut self, load: &MotionLoad) {
        let Some(LawOf { slot, is_friction }) = load.law_of else { return };
        if let Phase::Contact { latch, .. } = &mut self.phases[slot] {
            let states = self.switches[load.switches()].iter().rev();
            latch.forms[usize::from(is_friction)] =
                states.fold(0, |forms, state| forms << 1 | (*state & 1) as u16);
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

    /// Whether a function of the motion is inside the domain that one of its switches watches.
    pub fn has_value_at(&self, load: &MotionLoad, own: usize) -> bool {
        let (variables, states) = (self.variables(load), &self.switches[load.switches()]);
        load.tape.distance(own, &variables[..load.variables.len()], states).value >= 0.0
    }

    /// The first function of the motion that asks for a function outside its domain; after
    /// [`Dynamics::settle_switches`].
    pub fn load_without_value(&self) -> Option<&MotionLoad> {
        self.tree.motion_loads.iter().find(|load| {
            let (variables, states) = (self.variables(load), &self.switches[load.switches()]);
            self.acts(load) && !load.tape.has_value(&variables[..load.variables.len()], states)
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
        if let Some(load) = self.load_without_value() {
            let described = self.described(load);
            return Some(format!(
                "{:?} has no value, a function in it is outside its domain: {described}",
                load.name
            ));
        }
        let is_lost = |load: &&MotionLoad| self.acts(load) && !self.motion_load(load).is_finite();
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
            return SwitchDistance {
                value: f64::INFINITY,
                rate: 0.0,
                error: 0.0,
                rounding: 0.0,
                rests: false,
            };
        };
        let (values, states) = (self.variables(load), &states[load.switches()]);
        let values = &values[..load.variables.len()];
        let value = load.tape.distance(own, values, states).value;
        let gradient = load.tape.distance_gradient(own, values, states);
        let rests = load.tape.rests(own, states);
        let mut distance = SwitchDistance { value, rate: 0.0, error: 0.0, rounding: 0.0, rests };
        for (((_, variable), slope), value) in load.variables.iter().zip(gradient).zip(values) {
            if slope == 0.0 {
                continue;
            }
            let (size, error) = self.sizes(*variable, errors);
            distance.rate += slope * if is_velocity(*variable) { f64::NAN } else { self.rate(*variable) };
            distance.error += slope.abs() * error;
            distance.rounding += slope.abs() * ROUNDING * (size + value.abs());
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

    /// Gives a switch the state that it had before its number came to rest, unless it rested there already.
    pub fn rest_at(&mut self, index: usize, before: i64) {
        let Some((load, own)) = self.tree.load_of_switch(index) else { return };
        if let Some(state) = load.tape.resting(own, before) {
            self.switches[index] = state;
            self.hand_on(load);
        }
    }

    /// The function of the motion to which a switch belongs, in its present form: here, and on the switch.
    pub fn load_near_switch(&self, index: usize) -> [f64; 2] {
        let Some((load, own)) = self.tree.load_of_switch(index) else { return [0.0; 2] };
        let (all, states) = (self.variables(load), &self.switches[load.switches()]);
        let values = &all[..load.variables.len()];
        // Each variable is changed in proportion to what it contributes.
        let gradient = load.tape.distance_gradient(own, values, states);
        let contributes = |(value, slope): (&f64, &f64)| (value * slope) * (value * slope);
        let square: f64 = values.iter().zip(&gradient).map(contributes).sum();
        let part = load.tape.distance(own, values, states).value / square;
        let mut on_switch = all;
        for (value, slope) in on_switch.iter_mut().zip(gradient) {
            *value -= part * slope * *value * *value;
        }
        [values, &on_switch[..values.len()]].map(|values| load.tape.value(values, states))
    }

    /// Changes the state of a switch to the one that follows; false if it belongs to a table that ends there.
    pub fn flip_switch(&mut self, index: usize) -> bool {
        let Some((load, own)) = self.tree.load_of_switch(index) else { return true };
        let (values, states) = (self.variables(load), &self.switches[load.switches()]);
        let next = load.tape.next_state(own, &values[..load.variables.len()], states);
        self.switches[index] = next;
        self.hand_on(load);
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

    fn variable(&self, Variable { of, is_rate }: Variable) -> f64 {
        match of {
            Measure::Time => self.t.time,
            Measure::Position(point, axis) if is_rate => self.point(point).velocity[axis],
            Measure::Position(point, axis) => self.point(point).position[axis],
            Measure::Angle([a, b], _) if is_rate => {
                self.states[b].angular_velocity - self.states[a].angular_velocity
            }
            Measure::Angle([a, b], offset) => self.angle(b) - self.angle(a) + offset,
            Measure::Coordinate(column) if is_rate => self.coordinates[column].velocity,
            Measure::Coordinate(column) => self.coordinate(column).position,
            Measure::Length(points, indistinct) => {
                let [e, rate] = self.between(points);
                let length = e.norm();
                match is_rate {
                    false => length,
                    true if length > indistinct => rate.dot(&e) / length,
                    true => 0.0,
                }
            }
            Measure::Contact(slot, quantity) => {
                let state = self.contact_of(&self.tree.slots[slot], self.phases[slot]).state;
                match (quantity, self.phases[slot]) {
                    (ContactQuantity::Penetration, _) => state.penetration,
                    (ContactQuantity::PenetrationRate, _) => state.penetration_rate,
                    (ContactQuantity::SlidingVelocity, _) => state.sliding_velocity,
                    (ContactQuantity::NormalForce, _) => state.normal_force,
                    (ContactQuantity::ImpactVelocity, Phase::Contact { latch, .. }) => latch.impact_velocity,
                    (ContactQuantity::ImpactVelocity, Phase::Free | Phase::Beyond) => f64::NAN,
                }
            }
        }
    }

    /// Rate of a variable; that of a velocity after [`Dynamics::accelerate`].
    fn rate(&self, Variable { of, is_rate }: Variable) -> f64 {
        match of {
            Measure::Time => 1.0,
            Measure::Contact(slot, ContactQuantity::Penetration) => {
                let of = Measure::Contact(slot, ContactQuantity::PenetrationRate);
                self.variable(Variable { of, is_rate })
            }
            Measure::Contact(slot, quantity) => {
                let state = self.contact_in_time(&self.tree.slots[slot], self.phases[slot]);
                match quantity {
                    ContactQuantity::SlidingVelocity => state.sliding_velocity.gradient[0],
                    ContactQuantity::NormalForce => state.normal_force.gradient[0],
                    ContactQuantity::ImpactVelocity => 0.0,
                    _ => state.penetration_rate.gradient[0],
                }
            }
            of if !is_rate => self.variable(Variable { of, is_rate: true }),
            Measure::Position(point, axis) => self.point(point).acceleration[axis] + self.tree.gravity[axis],
            Measure::Angle([a, b], _) => {
                self.states[b].angular_acceleration - self.states[a].angular_acceleration
            }
            Measure::Coordinate(column) => self.coordinates[column].acceleration,
            Measure::Length(points, _) => {
                let [a, b] = points.map(|point| self.point(point));
                let (e, rate) = (b.position - a.position, b.velocity - a.velocity);
                let (length, lengthening) = (e.norm(), rate.dot(&e) / e.norm());
                let along = (b.acceleration - a.acceleration).dot(&e) / length;
                along + (rate.norm_squared() - lengthening * lengthening) / length
            }
        }
    }

    /// The contact of a slot in a phase with its rates, after [`Dynamics::accelerate`]; of one that sticks without friction.
    pub(super) fn contact_in_time(&self, slot: &ContactSlot, phase: Phase) -> ContactState<Dual<1>> {
        let SlotMotion { eccentricity, rate, acceleration, .. } = self.slot_motion(slot);
        let in_time = |value, rate| Dual { value, gradient: [rate] };
        let along = |value: Vec2, rate: Vec2| [0, 1].map(|k| in_time(value[k], rate[k]));
        let turning = slot.points.map(|point| {
            let frame = &self.states[point.frame];
            in_time(frame.angular_velocity, frame.angular_acceleration)
        });
        let [x, y] = along(eccentricity, rate);
        let spin = match slot.law.stick_slip() {
            Some(_) => slot.law.rolling((x * x + y * y).sqrt(), turning),
            None => {
                let [radius_a, radius_b] = slot.law.radii();
                turning[1] * radius_b - turning[0] * radius_a
            }
        };
        // The force of a contact that slides does not depend on the roll.
        let motion = RelativeMotion {
            eccentricity: [x, y],
            rate: along(rate, acceleration),
            spin,
            roll: in_time(0.0, 0.0),
        };
        slot.law.evaluate(&motion, phase)
    }

    /// Size of a variable and of its errors.
    fn sizes(&self, Variable { of, is_rate }: Variable, errors: &Uncertainty) -> (f64, f64) {
        let Uncertainty { length, speed, position, velocity } = *errors;
        match of {
            Measure::Time => (self.t.time.abs(), 0.0),
            Measure::Angle(..) if is_rate => (speed / length, velocity / length),
            Measure::Angle(..) => (1.0, position / length),
            Measure::Contact(_, ContactQuantity::Penetration) => (length, position),
            Measure::Contact(_, ContactQuantity::ImpactVelocity) => (speed, 0.0),
            Measure::Contact(slot, ContactQuantity::NormalForce) => {
                let of = Measure::Contact(slot, ContactQuantity::Penetration);
                let penetration = self.variable(Variable { of, is_rate });
                let stiffness = self.tree.slots[slot].law.normal.stiffness_at(penetration.max(0.0));
                (stiffness * length, stiffness * position)
            }
            Measure::Contact(..) => (speed, velocity),
            Measure::Position(..) | Measure::Coordinate(_) | Measure::Length(..) => {
                if is_rate {
                    (speed, velocity)
                } else {
                    (length, position)
                }
            }
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
            let Variable { of, is_rate } = *variable;
            // The column of the quantity itself, and for a rate that of its change with the position.
            let (own, other) = if is_rate {
                (&mut by_velocity[..], &mut by_position[..])
            } else {
                (&mut by_position[..], &mut [][..])
            };
            match of {
                Measure::Time => by_time += slope,
                Measure::Position(point, axis) => {
                    let motion = self.point(point);
                    self.add_point_columns(point.frame, &motion, slope * unit(axis), own, other);
                }
                Measure::Angle(frames, _) => self.add_rotation_columns(frames, slope, own),
                // The derivatives of a law come with those of its contact.
                Measure::Contact(..) => {}
                Measure::Coordinate(column) => own[column] += slope,
                Measure::Length(points, _) => {
                    let [a, b] = points.map(|point| self.point(point));
                    let (e, rate) = (b.position - a.position, b.velocity - a.velocity);
                    let length = e.norm();
                    // A bushing may have no deflection: its force has no direction to change there.
                    let normal = if length > 0.0 { e / length } else { Vec2::zeros() };
                    // ∂n·ė/∂e = (ė - (n·ė) n) / |e|
                    let turning = (rate - rate.dot(&normal) * normal) / length;
                    for (point, motion, sign) in [(points[1], b, slope), (points[0], a, -slope)] {
                        self.add_point_columns(point.frame, &motion, sign * normal, own, other);
                        if is_rate {
                            self.add_point_columns(point.frame, &motion, sign * turning, other, &mut []);
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
    use ContactQuantity::{NormalForce, PenetrationRate, SlidingVelocity};
    variable.is_rate
        || matches!(variable.of, Measure::Contact(_, PenetrationRate | SlidingVelocity | NormalForce))
}
