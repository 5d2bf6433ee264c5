//! Loads and drives that change in a step by more than its method sees.
//!
//! A method asks for the accelerations at a few instants of a step, and its error estimate knows no others: a pulse between
//! them is stepped over. What a load does there is known, though: its formula gives the range of its values over any stretch
//! of the motion. Over a step it may leave the straight line between its values at both ends by twice as much as it does at
//! the instants that the method sees, or by what the tolerance of the velocity cannot notice. Stretches over which the range
//! is wider are halved; a value that is too far off asks for a shorter step.

use std::array::from_fn;

use crate::dynamics::{Acting, Dynamics};
use crate::error::Notice;
use crate::expression::enclosure::Enclosure;
use crate::expression::tape::MOST_VARIABLES;
use crate::integrators::StateInside;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::ROUNDING_OF_CHAIN;
use crate::numerics::instant::Instant;
use crate::numerics::interval::Interval;
use crate::run::motion::Motion;
use crate::run::tolerances::Tolerances;
use crate::scene::time_function::TimeFunction;
use crate::tree::elements::DrivenCoordinate;
use crate::tree::kinematics::FrameKind;
use crate::tree::loads::{Load, Measure, MotionLoad};

/// Most stretches of a step that are looked at for one load: two for each halving down to the rounding of the time, at both
/// ends of a pulse.
const MOST_STRETCHES: usize = 256;
/// Most of them that wait: one for each halving besides one for each piece.
const MOST_WAITING: usize = 96;
/// Part of a step whose share of what may pass unseen a shorter stretch has too, so that a jump is none: it is at most so
/// many stretches that share it.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Rotation [rad] over which a quadratic polynomial follows the position of a point.
const FOLLOWED_ROTATION: f64 = 0.5;
/// Most pieces of that rotation in one step.
const MOST_PIECES: usize = 32;

/// What changes with time or with the motion.
#[derive(Clone, Copy, Debug)]
enum Function<'a> {
    /// A load that depends on time.
    Time(&'a TimeFunction),
    /// A load that depends on the motion.
    Motion(&'a MotionLoad),
    /// The acceleration of a drive.
    Drive(&'a DrivenCoordinate),
}

/// A load or a drive that is watched.
#[derive(Clone, Debug)]
struct Watched<'a> {
    name: &'a str,
    function: Function<'a>,
    /// How it acts; `None` for a drive.
    acts: Option<Acting>,
    /// Whether its quantities follow from rotations.
    turns: bool,
    /// Instants [s] and values at the starts of the last two steps, the later one first.
    history: [(f64, f64); 2],
    /// Its quantities at equal parts of the step, two for each piece, and at its end.
    quantities: Vec<[f64; MOST_VARIABLES]>,
    /// States of its switches inside a step.
    states: Vec<i64>,
    /// Those just behind an event at its end.
    end_states: Vec<i64>,
    /// Whether its ranges could not tell what it does in a step.
    is_unknown: bool,
}

/// All that is watched.
#[derive(Clone, Debug)]
pub(crate) struct Inputs<'a> {
    watched: Vec<Watched<'a>>,
    of_motion: bool,
    q: Vec<f64>,
    v: Vec<f64>,
}

/// A step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch<'n> {
    /// Its start and its length [s].
    pub(crate) t: f64,
    /// See there.
    pub(crate) h: f64,
    /// Parts of it at which the method asks for accelerations.
    pub(crate) nodes: &'n [f64],
}

impl<'a> Inputs<'a> {
    /// Those of a mechanism.
    pub(crate) fn of(mechanism: &'a Mechanism) -> Self {
        let tree = &mechanism.tree;
        let mut watched: Vec<Watched> = Vec::new();
        for (force, element) in tree.forces.iter().enumerate() {
            for (place, load) in element.loads.iter().enumerate() {
                let function = match load {
                    Some(Load::Time(function)) if function.ranges::<1>(0.0, 0.0).is_some() => {
                        Function::Time(function)
                    }
                    Some(Load::Motion(index)) => Function::Motion(&tree.motion_loads[*index]),
                    Some(Load::Time(_)) | None => continue,
                };
                watched.push(Watched::new(&element.name, function, Some(Acting { force, place })));
            }
        }
        for driven in &tree.driven {
            if driven.motion.ranges::<1>(0.0, 0.0).is_some() {
                watched.push(Watched::new(&driven.name, Function::Drive(driven), None));
            }
        }
        let d = mechanism.degrees_of_freedom();
        let of_motion = watched.iter().any(|one| matches!(one.function, Function::Motion(_)));
        Self { watched, of_motion, q: vec![0.0; d], v: vec![0.0; d] }
    }

    /// Forgets the steps before: forces may have jumped.
    pub(crate) fn forget(&mut self) {
        self.watched.iter_mut().for_each(|one| one.history = [(f64::NAN, f64::NAN); 2]);
    }

    /// The part of a step that a shorter one may take, where the step is too long.
    pub(crate) fn unseen(
        &mut self,
        motion: &mut Motion,
        step: Stretch,
        tolerances: &Tolerances,
        state: &mut StateInside,
    ) -> Option<f64> {
        if self.watched.is_empty() || step.h <= 0.0 {
            return None;
        }
        let pieces = if self.of_motion { self.follow(motion, step, state) } else { 1 };
        if pieces > MOST_PIECES {
            return Some(MOST_PIECES as f64 / pieces as f64);
        }
        let velocity = |component: usize| tolerances.of(component).velocity;
        let mut shortest: Option<f64> = None;
        for one in &mut self.watched {
            let response = match one.acts {
                Some(acts) => motion.dynamics.response_to(acts, &motion.mechanism.scales, &velocity),
                None => one.response_to_drive(motion.mechanism, &velocity),
            };
            // A load on what no freedom moves.
            if response > 0.0 {
                let allowed = 1.0 / (response * step.h);
                let part = one.unseen(&motion.dynamics, step, pieces, allowed);
                shortest = part.map(|part| shortest.map_or(part, |least| least.min(part))).or(shortest);
            }
        }
        if shortest.is_none() {
            for one in &mut self.watched {
                let value = one.value(&motion.dynamics, step, pieces, 0.0, false);
                one.history = [(step.t, value), one.history[0]];
            }
        }
        shortest
    }

    /// Writes the quantities of all loads at parts of a step; returns in how many pieces these divide it.
    fn follow(
        &mut self,
        motion: &mut Motion,
        Stretch { t, h, .. }: Stretch,
        state: &mut StateInside,
    ) -> usize {
        let Self { watched, q, v, .. } = self;
        let mut pieces = 1;
        if watched.iter().any(|one| one.turns) {
            let mechanism = motion.mechanism;
            let mut rotation = 0.0_f64;
            for part in [0.0, 1.0] {
                state(part, q, v);
                let columns = mechanism.free.iter().zip(v.iter());
                let turning = columns
                    .filter(|(column, _)| matches!(mechanism.frames[**column + 1].kind, FrameKind::Revolute));
                rotation = turning.map(|(_, v)| v.abs() * h).fold(rotation, f64::max);
            }
            let drives = mechanism.driven.iter().filter(|driven| driven.is_angle);
            let rotation = drives.map(|driven| driven.motion.at(t)[1].abs() * h).fold(rotation, f64::max);
            pieces = (rotation / FOLLOWED_ROTATION).ceil().max(1.0) as usize;
            if pieces > MOST_PIECES {
                return pieces;
            }
        }
        motion.visit_inside(|motion| {
            for place in 0..=2 * pieces {
                let part = place as f64 / (2 * pieces) as f64;
                state(part, q, v);
                motion.dynamics.move_to(Instant::after(t, part * h), q, v);
                for one in watched.iter_mut() {
                    if let Function::Motion(load) = one.function {
                        one.quantities[place] = motion.dynamics.variables(load);
                    }
                }
            }
        });
        pieces
    }

    /// What should be checked of loads whose ranges did not tell what they do between the instants at which they were
    /// evaluated.
    pub(crate) fn notices(&self) -> impl Iterator<Item = Notice> {
        self.watched.iter().filter(|one| one.is_unknown).map(|one| Notice {
            code: "unseen_load",
            about: vec![one.name.to_owned()],
            numbers: Vec::new(),
            text: format!(
                "{:?}: what its formula does between the instants at which it was evaluated could not be bounded: a short \
                 pulse may have been stepped over; max_step bounds the steps",
                one.name
            ),
        })
    }
}

impl<'a> Watched<'a> {
    fn new(name: &'a str, function: Function<'a>, acts: Option<Acting>) -> Self {
        let (places, switches, turns) = match function {
            Function::Motion(load) => {
                let turns =
                    |of: &Measure| !matches!(of, Measure::Time | Measure::Angle(..) | Measure::Coordinate(_));
                let turns = load.variables.iter().any(|(_, variable)| turns(&variable.of));
                (2 * MOST_PIECES + 1, load.tape.switches.len(), turns)
            }
            Function::Time(_) | Function::Drive(_) => (0, 0, false),
        };
        Self {
            name,
            function,
            acts,
            turns,
            history: [(f64::NAN, f64::NAN); 2],
            quantities: vec![[0.0; MOST_VARIABLES]; places],
            states: vec![0; switches],
            end_states: vec![0; switches],
            is_unknown: false,
        }
    }

    /// Acceleration of points per unit of that of a drive, over the velocity tolerance of its component [1/s].
    fn response_to_drive(&self, mechanism: &Mechanism, tolerance: &dyn Fn(usize) -> f64) -> f64 {
        let Function::Drive(driven) = self.function else { return 0.0 };
        let tree = &mechanism.tree;
        let component = tree.components.of(tree.ideal_joints[driven.joint].bodies).unwrap_or_default();
        let lever = if driven.is_angle { mechanism.scales.components[component].length } else { 1.0 };
        lever / tolerance(component)
    }

    /// Its value at a part of a step, in the form that it has in this phase or, `anew`, in that of its quantities there.
    fn value(&mut self, dynamics: &Dynamics, step: Stretch, pieces: usize, part: f64, anew: bool) -> f64 {
        let at = || Instant::after(step.t, part * step.h);
        match self.function {
            Function::Time(function) => function.at(at())[0],
            Function::Drive(driven) => driven.motion.at(at())[2],
            Function::Motion(load) => {
                let count = load.variables.len();
                let piece = ((part * pieces as f64) as usize).min(pieces - 1);
                let x = part * pieces as f64 - piece as f64;
                let values: [f64; MOST_VARIABLES] =
                    from_fn(|k| if k < count { self.parabola(piece, k).at(x) } else { 0.0 });
                let states = &dynamics.switches[load.switches()];
                self.states.copy_from_slice(states);
                if anew {
                    for own in 0..self.states.len() {
                        self.states[own] = load.tape.state(own, &values[..count], &self.states);
                    }
                }
                load.tape.value(&values[..count], &self.states)
            }
        }
    }

    /// How a quantity changes in a piece of a step.
    fn parabola(&self, piece: usize, quantity: usize) -> Parabola {
        Parabola(from_fn(|place| self.quantities[2 * piece + place][quantity]))
    }

    /// Ranges of its value and of its change with the part of the step, over a stretch of it.
    fn ranges(&self, step: Stretch, pieces: usize, [from, to]: [f64; 2]) -> [Interval; 2] {
        let Stretch { t, h, .. } = step;
        let whole = [Interval::WHOLE; 2];
        let (value, rate) = match self.function {
            Function::Time(function) => {
                let [value, rate] = function.ranges::<2>(t + from * h, t + to * h).unwrap_or(whole);
                (value, rate * h)
            }
            Function::Drive(driven) => {
                let known = driven.motion.ranges::<4>(t + from * h, t + to * h);
                known.map_or((whole[0], whole[1]), |[_, _, value, rate]| (value, rate * h))
            }
            Function::Motion(load) => {
                // The least pieces that cover the stretch.
                let first = ((from * pieces as f64) as usize).min(pieces - 1);
                let scale = pieces as f64;
                let ends = [from, to].map(|part| (part * scale - first as f64).clamp(0.0, 1.0));
                let variables: [Enclosure<2>; MOST_VARIABLES] = from_fn(|k| {
                    if k < load.variables.len() {
                        let [value, rate] = self.parabola(first, k).ranges(ends);
                        Enclosure::quantity(value, rate * scale)
                    } else {
                        Enclosure::constant(0.0)
                    }
                });
                let Enclosure([value, rate]) = load.tape.enclose(&variables[..load.variables.len()]);
                (value, rate)
            }
        };
        [value, rate]
    }

    /// How far the values that the method sees leave the straight line between those at both ends of the step.
    fn seen(&mut self, dynamics: &Dynamics, step: Stretch, pieces: usize, [first, last]: [f64; 2]) -> f64 {
        let mut seen = 0.0_f64;
        for &part in step.nodes {
            let value = self.value(dynamics, step, pieces, part, false);
            seen = seen.max((value - first - part * (last - first)).abs());
        }
        if step.nodes.is_empty() {
            // A parabola through three values leaves the line over a step by a quarter of its second divided difference
            // times the square of the step.
            let [one, two] = self.history;
            let points = [two, one, (step.t, first), (step.t + step.h, last)];
            for three in points.windows(3) {
                let slope = |k: usize| (three[k + 1].1 - three[k].1) / (three[k + 1].0 - three[k].0);
                let bend = (slope(1) - slope(0)) / (three[2].0 - three[0].0);
                // Not a number before there are steps.
                seen = seen.max(0.25 * bend.abs() * step.h * step.h);
            }
        }
        seen
    }

    /// Whether a switch has changed at the end of a step.
    fn ends_on_event(&mut self, dynamics: &Dynamics, step: Stretch, pieces: usize) -> bool {
        if self.states.is_empty() {
            return false;
        }
        self.value(dynamics, step, pieces, 1.0, true);
        self.end_states.copy_from_slice(&self.states);
        self.value(dynamics, step, pieces, 1.0, false);
        self.end_states != self.states
    }

    /// The part of a step that a shorter one may take, where the load leaves what the method sees by more than is `allowed`.
    // Long because the stretches that wait and what is known at their ends belong together.
    fn unseen(&mut self, dynamics: &Dynamics, step: Stretch, pieces: usize, allowed: f64) -> Option<f64> {
        let value =
            |one: &mut Self, part: f64| one.value(dynamics, step, pieces, part, part > 0.0 && part < 1.0);
        let [first, last] = [0.0, 1.0].map(|part| value(self, part));
        let slope = last - first;
        // A step on an event ends a little behind it, by what the tolerance allows: up to there nothing has changed.
        let mut before_event = if self.ends_on_event(dynamics, step, pieces) { 1.0 } else { f64::INFINITY };
        let mut seen = f64::NAN;
        // The stretches that wait, the first one last, with how far the load is off the line at their ends.
        let mut waiting = [([0.0; 2], [0.0; 2]); MOST_WAITING];
        let mut count = 0;
        for piece in (0..pieces).rev() {
            let ends = [piece, piece + 1].map(|end| end as f64 / pieces as f64);
            let off = ends.map(|end| {
                if end > 0.0 && end < 1.0 { (value(self, end) - first - end * slope).abs() } else { 0.0 }
            });
            waiting[count] = (ends, off);
            count += 1;
        }
        let shortest = ROUNDING_OF_CHAIN * (step.t.abs() + step.h) / step.h;
        for _ in 0..MOST_STRETCHES {
            let next = count.checked_sub(1)?;
            count = next;
            let ([from, to], off) = waiting[next];
            let length = to - from;
            let [range, rate] = self.ranges(step, pieces, [from, to]);
            let steepest = (rate + Interval::point(-slope)).magnitude();
            let by_rate = 0.5 * (off[0] + off[1] + length * steepest);
            let line = Interval::between(first + from * slope, first + to * slope);
            let reach = by_rate.min((range - line).magnitude());
            let share = allowed * (LEAST_SHARE / length).max(1.0);
            if reach <= share || length <= shortest {
                continue;
            }
            if seen.is_nan() {
                seen = self.seen(dynamics, step, pieces, [first, last]);
            }
            if reach <= 2.0 * seen + share {
                continue;
            }
            let middle = 0.5 * (from + to);
            let mut off_middle = (value(self, middle) - first - middle * slope).abs();
            if to == before_event && self.states == self.end_states {
                before_event = middle;
                let value = self.value(dynamics, step, pieces, middle, false);
                off_middle = (value - first - middle * slope).abs();
            }
            // Also where it is not a number.
            if off_middle > 2.0 * seen + allowed {
                return Some(if from > 0.0 { from.min(0.5) } else { middle });
            }
            if next + 2 > MOST_WAITING {
                break;
            }
            if before_event > middle {
                waiting[next] = ([middle, to], [off_middle, off[1]]);
                count = next + 1;
            }
            waiting[count] = ([from, middle], [off[0], off_middle]);
            count += 1;
        }
        self.is_unknown = true;
        None
    }
}

/// A quantity over a stretch from 0 to 1, by its values at both ends and in the middle.
#[derive(Clone, Copy, Debug)]
struct Parabola([f64; 3]);

impl Parabola {
    /// Its coefficients.
    fn coefficients(self) -> [f64; 3] {
        let Self([start, middle, end]) = self;
        [start, 4.0 * middle - 3.0 * start - end, 2.0 * (start - 2.0 * middle + end)]
    }

    fn at(self, x: f64) -> f64 {
        let [c0, c1, c2] = self.coefficients();
        (c2 * x + c1) * x + c0
    }

    /// Ranges of its value and of its rate.
    fn ranges(self, [from, to]: [f64; 2]) -> [Interval; 2] {
        let [_, c1, c2] = self.coefficients();
        let top = -0.5 * c1 / c2;
        let mut value = Interval::between(self.at(from), self.at(to));
        if from < top && top < to {
            value = value.join(Interval::point(self.at(top)));
        }
        [value, Interval::between(c1 + 2.0 * c2 * from, c1 + 2.0 * c2 * to)]
    }
}
