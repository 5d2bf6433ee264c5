//! Switches of expressions and tables as guards: a step ends where a force changes its form.

use crate::dynamics::{SwitchDistance, Uncertainty};
use crate::integrators::events::Guard;
use crate::integrators::{StateAt, Status};
use crate::run::contacts::guards::OVERSHOOT;
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Event, EventKind, Place};
use crate::run::motion::Motion;
use crate::run::tolerances::{ComponentTolerances, Tolerances};
use crate::tree::elements::ComponentScales;
use crate::tree::loads::{LawOf, MotionLoad};

/// The guard of a switch in the state of the frames inside the step or at its end: zero where the force changes its form.
pub(crate) fn switch_guard(motion: &Motion, tolerances: &Tolerances, is_inside: bool, index: usize) -> Guard {
    let dynamics = if is_inside { &motion.inside } else { &motion.dynamics };
    if motion.mechanism.load_of_switch(index).is_some_and(|(load, _)| !motion.dynamics.acts(load)) {
        return Guard::INACTIVE;
    }
    let component = motion.mechanism.load_of_switch(index).map_or(0, |(load, _)| load.component);
    let ComponentScales { length, speed } = motion.mechanism.scales.components[component];
    let &ComponentTolerances { position, velocity, .. } = tolerances.of(component);
    let errors = Uncertainty { length, speed, position, velocity };
    let SwitchDistance { value, rate, error, rounding, rests } =
        dynamics.switch_distance(index, &motion.dynamics.switches, &errors);
    Guard {
        value,
        rate,
        margin: 0.0,
        resolution: if rests { error.max(rounding) } else { rounding },
        overshoot: (8.0 * rounding).max(OVERSHOOT * error),
    }
}

/// Changes the form of a formula, or the piece of a table.
pub(crate) fn cross_switch(
    motion: &mut Motion,
    log: &mut ContactLog,
    switch: usize,
    at: StateAt,
) -> Result<f64, Status> {
    let mechanism = motion.mechanism;
    let found = mechanism.motion_loads.iter().position(|load| load.switches().contains(&switch));
    let Some((index, load)) = found.map(|index| (index, &mechanism.motion_loads[index])) else {
        return Ok(f64::INFINITY);
    };
    if !motion.dynamics.acts(load) {
        // The contact ended at the same instant.
        return Ok(f64::INFINITY);
    }
    if load.tape.is_end_of_domain(switch - load.first_switch) {
        return leave_domain(motion, log, index, switch, at.t);
    }
    let (place, mut normal_velocity) = (place_of(load, index), f64::NAN);
    if let Some(LawOf { slot, .. }) = load.law_of {
        log.end_phase(motion, slot, at);
        normal_velocity = motion.dynamics.contact_state(slot).penetration_rate;
    }
    if !load.tape.is_of_formula(switch - load.first_switch) {
        // A table never jumps. Beyond its next point, which may be nearer than the step is exact, the step ends again.
        let has_value = motion.dynamics.flip_switch(switch);
        return if has_value { Ok(f64::INFINITY) } else { Err(Status::OutsideTable) };
    }
    let crossed = flip(motion, switch, at);
    log.record(Event { time: at.t, place, kind: EventKind::Switch, normal_velocity });
    crossed
}

/// Ends the run where a function in a formula has no value. Where a switch before it turns at the same instant, as that of
/// an absolute value under a root, only the formula as it was has none.
fn leave_domain(
    motion: &mut Motion,
    log: &mut ContactLog,
    load: usize,
    switch: usize,
    time: f64,
) -> Result<f64, Status> {
    let function = &motion.mechanism.motion_loads[load];
    let own = switch - function.first_switch;
    let mut changes = 0;
    if !motion.dynamics.has_value_at(function, own) {
        changes = motion.dynamics.settle_before(function, own);
    }
    if !motion.dynamics.has_value_at(function, own) {
        return Err(Status::OutsideDomain);
    }
    for _ in 0..changes {
        let (place, kind) = (place_of(function, load), EventKind::Switch);
        log.record(Event { time, place, kind, normal_velocity: f64::NAN });
    }
    Ok(f64::INFINITY)
}

/// Where a function of the motion acts.
fn place_of(function: &MotionLoad, index: usize) -> Place {
    function.law_of.map_or(Place::Load(index), |law| Place::Joint(law.slot))
}

/// Changes the state of a switch of a formula. Only its direction counts for what follows: both forms of the force may push the
/// quantity back, as dry friction does at rest, and then there is no motion that an expression describes. Where the force
/// is continuous, as a drag that vanishes with the velocity, the quantity rests there, and keeps its form within the
/// tolerance: the two forms in turn would change without end.
fn flip(motion: &mut Motion, switch: usize, StateAt { t, q, v }: StateAt) -> Result<f64, Status> {
    let rate = |motion: &mut Motion| {
        if !motion.dynamics.acceleration(t, q, v, &mut motion.a) {
            return Err(Status::NonFinite);
        }
        motion.dynamics.accelerate(&motion.a);
        Ok(motion.dynamics.switch_rate(switch))
    };
    let before = rate(motion)?;
    let (old, state) = (motion.dynamics.load_near_switch(switch), motion.dynamics.switches[switch]);
    motion.dynamics.flip_switch(switch);
    let after = rate(motion)?;
    let new = motion.dynamics.load_near_switch(switch);
    // A continuous force has one value on the switch, whatever it has here.
    let [here, there] = [0, 1].map(|place| (new[place] - old[place]).abs());
    let jumps = there >= 0.5 * here || there.is_nan();
    if jumps && before < 0.0 && after < 0.0 {
        return Err(Status::Held);
    }
    if !jumps && before <= 0.0 && after < 0.0 {
        motion.dynamics.rest_at(switch, state);
    }
    Ok(f64::INFINITY)
}
