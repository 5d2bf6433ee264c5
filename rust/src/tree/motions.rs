//! How the frames of a tree are moved, planned once: what drives alone move once an instant, the rest in every state.

use crate::numerics::instant::Instant;
use crate::numerics::turns::Turns;
use crate::scene::time_function::power_of_two;
use crate::tree::elements::DrivenCoordinate;
use crate::tree::kinematics::{Coordinate, Frame, FrameKind, FrameState, Vec2, perp};

/// Largest rotation [rad] from one anchor of a steady rotation to the next: half of it needs four terms of the sine.
const LARGEST_ROTATION: f64 = 0.125;

/// How a frame is moved, decided once: the less its parent moves, the less is left to do.
#[derive(Clone, Copy, Debug)]
enum Move {
    /// It turns about a point that is in place already: on ground, or moved by drives alone.
    Turn,
    /// It slides on ground.
    Slide(Vec2),
    /// It turns about a point of a moving frame.
    TurnOn,
    /// It slides on a moving frame.
    SlideOn(Vec2),
}

/// A frame, where it hangs, and how it is moved.
#[derive(Clone, Copy, Debug)]
struct MovedFrame {
    index: usize,
    parent: usize,
    anchor: Vec2,
    how: Move,
}

impl MovedFrame {
    /// Moves the frame to its coordinate. Constant entries keep the values of [`frames_at_rest`].
    #[inline(always)]
    fn place(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        let Coordinate { position: z, velocity, acceleration } = coordinates[self.index - 1];
        let (placed, rest) = states.split_at_mut(self.index);
        let (parent, state) = (&placed[self.parent], &mut rest[0]);
        match self.how {
            Move::Turn => state.turn(parent, z, velocity, acceleration),
            Move::Slide(axis) => {
                state.position = self.anchor + z * axis;
                state.velocity = velocity * axis;
                state.acceleration = parent.acceleration + acceleration * axis;
            }
            Move::TurnOn => {
                state.hang(parent.point(self.anchor));
                state.turn(parent, z, velocity, acceleration);
            }
            Move::SlideOn(axis) => {
                let origin = parent.point(self.anchor + z * axis);
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
        let carried = || {
            let arm = state.position - parent.position;
            parent.acceleration + alpha * perp(arm) - omega * omega * arm
        };
        match self.how {
            Move::Turn => state.angular_acceleration = alpha + acceleration,
            Move::Slide(axis) => state.acceleration = parent.acceleration + acceleration * axis,
            Move::TurnOn => {
                state.acceleration = carried();
                state.angular_acceleration = alpha + acceleration;
            }
            Move::SlideOn(_) => {
                state.acceleration =
                    carried() + 2.0 * omega * velocity * perp(state.axis) + acceleration * state.axis;
                state.angular_acceleration = alpha;
            }
        }
    }
}

/// A frame on ground that a drive turns at constant speed. From anchors at fixed instants on it is turned by the sine
/// and cosine of a small angle, a fifth of the arithmetic of large ones and as accurate.
#[derive(Clone, Debug)]
struct SteadyRotation {
    /// Place of its drive.
    drive: usize,
    /// Angular velocity [rad/s].
    speed: f64,
    /// Time from one anchor to the next [s], a power of two: instants of anchors are exact.
    interval: f64,
    /// The anchor nearest to the last instant [s].
    anchor: f64,
    /// Angle there [rad] within half a turn, and what rounding took from it.
    angle: [f64; 2],
    turns: Turns,
    sine: f64,
    cosine: f64,
}

impl SteadyRotation {
    /// The rotation that a drive gives to a frame, if it is one.
    fn of(drive: usize, driven: &DrivenCoordinate, frame: &Frame) -> Option<Self> {
        let speed = driven.sign * driven.motion.at(0.0)[1];
        let interval = power_of_two(LARGEST_ROTATION / speed.abs());
        let is_steady = driven.is_angle && driven.motion.is_linear() && frame.parent == 0;
        (is_steady && interval.is_normal()).then_some(Self {
            drive,
            speed,
            interval,
            anchor: f64::NAN,
            angle: [f64::NAN; 2],
            turns: f64::NAN,
            sine: f64::NAN,
            cosine: f64::NAN,
        })
    }

    /// Turns the frame to an instant.
    #[inline(always)]
    fn place(
        &mut self,
        t: Instant,
        driven: &DrivenCoordinate,
        coordinates: &mut [Coordinate],
        turns: &mut [Turns],
        states: &mut [FrameState],
    ) {
        let anchor = (t.time / self.interval).round_ties_even() * self.interval;
        if anchor != self.anchor {
            self.move_anchor(anchor, driven);
        }
        let [angle, rest] = self.angle;
        let by = self.speed * ((t.time - anchor) + t.rest) + rest;
        // Taylor's series: the terms left out are below 1e-19 of 1 up to half of the largest rotation.
        let square = by * by;
        let sine = by - by * square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0)));
        let change = -square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square / 40320.0)));
        let state = &mut states[driven.column + 1];
        state.angle = angle + by;
        state.sine = self.sine + (self.cosine * sine + self.sine * change);
        state.cosine = self.cosine + (self.cosine * change - self.sine * sine);
        state.angular_velocity = self.speed;
        coordinates[driven.column] =
            Coordinate { position: state.angle, velocity: self.speed, acceleration: 0.0 };
        turns[driven.column] = self.turns;
    }

    /// Takes another instant for the anchor.
    #[inline(never)]
    fn move_anchor(&mut self, anchor: f64, driven: &DrivenCoordinate) {
        let ([angle, rest], turns) = driven.motion.exact_angle_at(anchor);
        self.anchor = anchor;
        self.angle = [driven.sign * angle, driven.sign * rest];
        self.turns = driven.sign * turns;
        (self.sine, self.cosine) = self.angle[0].sin_cos();
    }
}

/// The frames of a tree in the order in which they are moved.
#[derive(Clone, Debug)]
pub struct FrameMotions {
    /// Frames on ground that drives turn at constant speed.
    rotations: Vec<SteadyRotation>,
    /// The other drives.
    drives: Vec<usize>,
    /// Other frames that drives alone move.
    driven: Vec<MovedFrame>,
    /// Pivots on them of frames that move freely.
    pivots: Vec<MovedFrame>,
    /// Frames that free coordinates move.
    free: Vec<MovedFrame>,
}

impl FrameMotions {
    /// The plan for frames whose `free` columns (ascending) are not driven.
    pub fn new(frames: &[Frame], free: &[usize], driven: &[DrivenCoordinate]) -> Self {
        let drives = driven.iter().enumerate();
        let rotations: Vec<SteadyRotation> = drives
            .filter_map(|(drive, driven)| SteadyRotation::of(drive, driven, &frames[driven.column + 1]))
            .collect();
        let is_steady = |drive: usize| rotations.iter().any(|rotation| rotation.drive == drive);
        let drives: Vec<usize> = (0..driven.len()).filter(|&drive| !is_steady(drive)).collect();
        let turns_steadily: Vec<usize> =
            rotations.iter().map(|rotation| driven[rotation.drive].column + 1).collect();
        let mut plan = Self { rotations, drives, driven: Vec::new(), pivots: Vec::new(), free: Vec::new() };
        let mut moves_freely = vec![false; frames.len()];
        for (index, &Frame { parent, anchor, kind }) in frames.iter().enumerate().skip(1) {
            moves_freely[index] = moves_freely[parent] || free.binary_search(&(index - 1)).is_ok();
            let pivot_is_placed = parent == 0 || (moves_freely[index] && !moves_freely[parent]);
            let how = match kind {
                FrameKind::Revolute if pivot_is_placed => Move::Turn,
                FrameKind::Revolute => Move::TurnOn,
                FrameKind::Prismatic { axis } if parent == 0 => Move::Slide(axis),
                FrameKind::Prismatic { axis } => Move::SlideOn(axis),
            };
            let frame = MovedFrame { index, parent, anchor, how };
            if matches!(how, Move::Turn) && parent != 0 {
                plan.pivots.push(frame);
            }
            if moves_freely[index] {
                plan.free.push(frame);
            } else if !turns_steadily.contains(&index) {
                plan.driven.push(frame);
            }
        }
        plan
    }

    /// Moves what drives alone move, and writes their coordinates: `coordinates[k - 1]` belongs to frame k.
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
            rotation.place(t, &driven[rotation.drive], coordinates, turns, states);
        }
        for &drive in &self.drives {
            let driven = &driven[drive];
            (coordinates[driven.column], jerks[drive], turns[driven.column]) = driven.at(t);
        }
        for frame in &self.driven {
            frame.place(coordinates, states);
        }
        for frame in &self.pivots {
            let pivot = states[frame.parent].point(frame.anchor);
            states[frame.index].hang(pivot);
        }
    }

    /// Moves the rest, after [`FrameMotions::place_driven`].
    #[inline]
    pub fn place_free(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        for frame in &self.free {
            frame.place(coordinates, states);
        }
    }

    /// Recomputes the accelerations of frames in place from those of the free coordinates.
    pub fn accelerate(&self, coordinates: &[Coordinate], states: &mut [FrameState]) {
        for frame in &self.free {
            frame.accelerate(coordinates, states);
        }
    }
}
