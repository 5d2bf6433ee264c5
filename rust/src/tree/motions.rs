//! How the frames of a tree are moved, planned once: what drives alone move once an instant, the rest in every state.

use crate::numerics::instant::Instant;
use crate::numerics::rotation::{Anchor, LARGEST_ROTATION};
use crate::numerics::turns::Turns;
use crate::scene::time_function::power_of_two;
use crate::tree::elements::DrivenCoordinate;
use crate::tree::kinematics::{Coordinate, Frame, FrameKind, FrameState, PointState, Vec2, perp};

/// How a frame on a moving frame is moved.
#[derive(Clone, Copy, Debug)]
enum Move {
    /// It turns about a point of the other frame.
    Turn,
    /// It slides along an axis of the other frame.
    Slide(Vec2),
}

/// A frame on a moving frame.
#[derive(Clone, Copy, Debug)]
struct CarriedFrame {
    index: usize,
    parent: usize,
    anchor: Vec2,
    how: Move,
    /// Where its sine and cosine were last computed from.
    near: Anchor,
}

impl CarriedFrame {
    /// Moves the frame to its coordinate.
    #[inline(always)]
    fn place(&mut self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        let coordinate = coordinates[self.index - 1];
        let (placed, rest) = states.split_at_mut(self.index);
        let (parent, state) = (&placed[self.parent], &mut rest[0]);
        match self.how {
            Move::Turn => {
                state.hang(parent.point(self.anchor));
                state.turn(parent, coordinate, &mut self.near);
            }
            Move::Slide(axis) => {
                let Coordinate { position, velocity, acceleration } = coordinate;
                let origin = parent.point(self.anchor + position * axis);
                let (omega, axis) = (parent.angular_velocity, parent.to_world(axis));
                *state = FrameState {
                    position: origin.position,
                    velocity: origin.velocity + velocity * axis,
                    // Coriolis acceleration, and acceleration along the axis.
                    acceleration: origin.acceleration
                        + 2.0 * omega * velocity * perp(axis)
                        + acceleration * axis,
                    axis,
                    rotation: 0.0,
                    ..*parent
                };
            }
        }
    }

    /// Gives the frame, in place, another acceleration of its coordinate.
    #[inline(always)]
    fn accelerate(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        let Coordinate { velocity, acceleration, .. } = coordinates[self.index - 1];
        let (placed, rest) = states.split_at_mut(self.index);
        let (parent, state) = (&placed[self.parent], &mut rest[0]);
        let (omega, alpha) = (parent.angular_velocity, parent.angular_acceleration);
        let arm = state.position - parent.position;
        state.acceleration = parent.acceleration + alpha * perp(arm) - omega * omega * arm;
        match self.how {
            Move::Turn => state.angular_acceleration = alpha + acceleration,
            Move::Slide(_) => {
                state.acceleration += 2.0 * omega * velocity * perp(state.axis) + acceleration * state.axis;
                state.angular_acceleration = alpha;
            }
        }
    }
}

/// A frame that turns freely about a point which is in place already: on ground, or moved by drives alone.
#[derive(Clone, Copy, Debug)]
struct Hinge {
    index: usize,
    parent: usize,
    /// The point in the parent frame.
    pivot: Vec2,
    near: Anchor,
}

/// A frame that slides on ground, maybe on another one that slides there. It never turns.
#[derive(Clone, Copy, Debug)]
struct Slider {
    index: usize,
    parent: usize,
    anchor: Vec2,
    axis: Vec2,
}

impl Slider {
    /// Gives the frame, in place, another acceleration of its coordinate.
    #[inline(always)]
    fn accelerate(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        let acceleration = states[self.parent].acceleration;
        states[self.index].acceleration = acceleration + coordinates[self.index - 1].acceleration * self.axis;
    }

    /// Moves the frame to its coordinate.
    #[inline(always)]
    fn place(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        let Coordinate { position, velocity, acceleration } = coordinates[self.index - 1];
        let parent = states[self.parent].origin();
        states[self.index].hang(PointState {
            position: parent.position + self.anchor + position * self.axis,
            velocity: parent.velocity + velocity * self.axis,
            acceleration: parent.acceleration + acceleration * self.axis,
        });
    }
}

/// A frame on ground that a drive turns at constant speed: from anchors at fixed instants on.
#[derive(Clone, Debug)]
struct SteadyRotation {
    /// Place of its drive.
    drive: usize,
    frame: usize,
    /// Angular velocity [rad/s].
    speed: f64,
    /// Time from one anchor to the next [s], a power of two: instants of anchors are exact.
    interval: f64,
    /// Instant of the anchor, the one nearest to the last instant [s].
    start: f64,
    /// The anchor, its angle within half a turn, and what rounding took from that [rad].
    near: Anchor,
    rest: f64,
    turns: Turns,
}

impl SteadyRotation {
    /// The rotation that a drive gives to a frame, if it is one.
    fn of(drive: usize, driven: &DrivenCoordinate, frames: &[Frame]) -> Option<Self> {
        let frame = driven.column + 1;
        let speed = driven.sign * driven.motion.at(0.0)[1];
        let interval = power_of_two(2.0 * LARGEST_ROTATION / speed.abs());
        let is_steady = driven.is_angle && driven.motion.is_linear() && frames[frame].parent == 0;
        (is_steady && interval.is_normal()).then_some(Self {
            drive,
            frame,
            speed,
            interval,
            start: f64::NAN,
            near: Anchor::NONE,
            rest: f64::NAN,
            turns: f64::NAN,
        })
    }

    /// Turns the frame to an instant.
    #[inline(always)]
    fn place(
        &mut self,
        t: Instant,
        driven: &[DrivenCoordinate],
        coordinates: &mut [Coordinate],
        turns: &mut [Turns],
        states: &mut [FrameState],
    ) {
        let start = (t.time / self.interval).round_ties_even() * self.interval;
        if start != self.start {
            self.move_anchor(start, &driven[self.drive]);
        }
        let by = self.speed * ((t.time - start) + t.rest) + self.rest;
        let state = &mut states[self.frame];
        state.angle = self.near.angle + by;
        (state.sine, state.cosine) = self.near.turned(by);
        state.angular_velocity = self.speed;
        coordinates[self.frame - 1] =
            Coordinate { position: state.angle, velocity: self.speed, acceleration: 0.0 };
        turns[self.frame - 1] = self.turns;
    }

    /// Takes another instant for the anchor.
    #[inline(never)]
    fn move_anchor(&mut self, start: f64, driven: &DrivenCoordinate) {
        let ([angle, rest], turns) = driven.motion.exact_angle_at(start);
        self.start = start;
        self.near = Anchor::at(driven.sign * angle);
        self.rest = driven.sign * rest;
        self.turns = driven.sign * turns;
    }
}

/// The frames of a tree by what moves them: the less that is, the less is left to do in every state.
#[derive(Clone, Debug, Default)]
pub struct FrameMotions {
    /// Frames on ground that drives turn at constant speed.
    rotations: Vec<SteadyRotation>,
    /// The other drives.
    drives: Vec<usize>,
    /// Other frames that drives alone move.
    driven: Vec<CarriedFrame>,
    /// Frames that turn freely about points of those or of ground.
    hinges: Vec<Hinge>,
    /// Frames that slide freely on ground, parents before children.
    sliders: Vec<Slider>,
    /// Other frames that free coordinates move, parents before children.
    carried: Vec<CarriedFrame>,
}

impl FrameMotions {
    /// The plan for frames whose `free` columns (ascending) are not driven.
    pub fn new(frames: &[Frame], free: &[usize], driven: &[DrivenCoordinate]) -> Self {
        let mut plan = Self::default();
        for (drive, driven) in driven.iter().enumerate() {
            match SteadyRotation::of(drive, driven, frames) {
                Some(rotation) => plan.rotations.push(rotation),
                None => plan.drives.push(drive),
            }
        }
        let mut moves_freely = vec![false; frames.len()];
        // Ground, and what slides there.
        let mut never_turns = vec![true; frames.len()];
        for (index, &Frame { parent, anchor, kind }) in frames.iter().enumerate().skip(1) {
            let is_free = free.binary_search(&(index - 1)).is_ok();
            moves_freely[index] = moves_freely[parent] || is_free;
            let how = match kind {
                FrameKind::Revolute => Move::Turn,
                FrameKind::Prismatic { axis } => Move::Slide(axis),
            };
            never_turns[index] = is_free && never_turns[parent] && matches!(how, Move::Slide(_));
            let near = Anchor::NONE;
            match how {
                Move::Slide(axis) if never_turns[index] => {
                    plan.sliders.push(Slider { index, parent, anchor, axis });
                }
                Move::Turn if is_free && !moves_freely[parent] => {
                    plan.hinges.push(Hinge { index, parent, pivot: anchor, near });
                }
                _ if moves_freely[index] => {
                    plan.carried.push(CarriedFrame { index, parent, anchor, how, near });
                }
                _ if plan.rotations.iter().any(|rotation| rotation.frame == index) => {}
                _ => plan.driven.push(CarriedFrame { index, parent, anchor, how, near }),
            }
        }
        plan
    }

    /// Moves what drives alone move, and writes their coordinates: `coordinates[k - 1]` belongs to frame k.
    #[inline(always)]
    pub fn place_driven(
        &mut self,
        t: Instant,
        driven: &[DrivenCoordinate],
        coordinates: &mut [Coordinate],
        jerks: &mut [f64],
        turns: &mut [Turns],
        states: &mut [FrameState],
    ) {
        for rotation in &mut self.rotations {
            rotation.place(t, driven, coordinates, turns, states);
        }
        // Few mechanisms have other drives.
        if !self.drives.is_empty() {
            self.place_other_drives(t, driven, coordinates, jerks, turns);
        }
        for frame in &mut self.driven {
            frame.place(coordinates, states);
        }
    }

    #[inline(never)]
    fn place_other_drives(
        &self,
        t: Instant,
        driven: &[DrivenCoordinate],
        coordinates: &mut [Coordinate],
        jerks: &mut [f64],
        turns: &mut [Turns],
    ) {
        for &drive in &self.drives {
            let driven = &driven[drive];
            (coordinates[driven.column], jerks[drive], turns[driven.column]) = driven.at(t);
        }
    }

    /// Moves the rest, after [`FrameMotions::place_driven`]; `time_passed` tells whether that has moved pivots.
    #[inline(always)]
    pub fn place_free(&mut self, time_passed: bool, coordinates: &[Coordinate], states: &mut [FrameState]) {
        for hinge in &mut self.hinges {
            let (placed, rest) = states.split_at_mut(hinge.index);
            let (parent, state) = (&placed[hinge.parent], &mut rest[0]);
            if time_passed {
                state.hang(parent.point(hinge.pivot));
            }
            state.turn(parent, coordinates[hinge.index - 1], &mut hinge.near);
        }
        for slider in &self.sliders {
            slider.place(coordinates, states);
        }
        for frame in &mut self.carried {
            frame.place(coordinates, states);
        }
    }

    /// Recomputes the accelerations of frames in place from those of the free coordinates.
    pub fn accelerate(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        for &Hinge { index, parent, .. } in &self.hinges {
            states[index].angular_acceleration =
                states[parent].angular_acceleration + coordinates[index - 1].acceleration;
        }
        for slider in &self.sliders {
            slider.accelerate(coordinates, states);
        }
        for frame in &self.carried {
            frame.accelerate(coordinates, states);
        }
    }
}
