//! Frames on ground take a shorter way than others: it must lead to the same place.

use chebclear::dynamics::Dynamics;
use chebclear::numerics::turns::with_turns;
use chebclear::tree::kinematics::{Coordinate, Frame, FrameKind, FrameState, Vec2, frames_at_rest};
use chebclear::tree::motions::FrameMotions;

use crate::support::{Random, compile, slider_crank};

const GROUND_ACCELERATION: Vec2 = Vec2::new(0.3, 9.81);

fn frame(parent: usize, anchor: [f64; 2], kind: FrameKind) -> Frame {
    Frame { parent, anchor: Vec2::from(anchor), kind }
}

fn coordinate(position: f64, velocity: f64, acceleration: f64) -> Coordinate {
    Coordinate { position, velocity, acceleration }
}

/// The second of two frames, the first without motion, and the same frame on ground itself; moved twice, so
/// that nothing of a motion before may stay.
fn on_rest_and_on_ground(kind: FrameKind, motion: Coordinate, then: f64) -> [FrameState; 2] {
    let still = FrameKind::Prismatic { axis: Vec2::x() };
    let upper = [frame(0, [0.0; 2], FrameKind::Revolute), frame(0, [0.0; 2], still)];
    let chain = [upper[0], upper[1], frame(1, [0.2, -0.1], kind)];
    let alone = [upper[0], frame(0, [0.2, -0.1], kind)];
    let rest = Coordinate::default();
    let before = coordinate(0.7, -3.0, 11.0);
    let moved = |frames: &[Frame], before: &[Coordinate], motion: &[Coordinate], then: &[Coordinate]| {
        let mut states = frames_at_rest(frames, GROUND_ACCELERATION);
        let free: Vec<usize> = (0..frames.len() - 1).collect();
        let mut motions = FrameMotions::new(frames, &free, &[]);
        for [motion, accelerations] in [[before, before], [motion, then]] {
            motions.place_driven(0.0.into(), &[], &mut [], &mut [], &mut [], &mut states);
            motions.place_free(true, motion, &mut states);
            motions.accelerate(accelerations, &mut states);
        }
        states[frames.len() - 1]
    };
    let then = Coordinate { acceleration: then, ..motion };
    [
        moved(&chain, &[rest, before], &[rest, motion], &[rest, then]),
        moved(&alone, &[before], &[motion], &[then]),
    ]
}

#[test]
fn a_frame_on_ground_moves_as_on_a_frame_at_rest() {
    let axis = Vec2::new(0.6, 0.8);
    for kind in [FrameKind::Revolute, FrameKind::Prismatic { axis }] {
        let [rest, ground] = on_rest_and_on_ground(kind, coordinate(-2.3, 4.0, 5.0), 6.0);
        assert_eq!(rest, ground, "{kind:?}");
    }
}

#[test]
fn a_crank_at_constant_speed_is_where_its_drive_says_in_any_order() {
    let mechanism = compile(&slider_crank(false));
    let (driven, start) = (&mechanism.driven[0], &mechanism.start);
    let mut dynamics = Dynamics::new(&mechanism);
    let mut random = Random(3);
    // Near each other, as the stages of steps, up to 1e5 s; and the start itself.
    let mut times = vec![0.0];
    for _ in 0..200 {
        let begin = 10.0_f64.powf(random.within(-6.0, 5.0));
        times.extend((0..10).map(|_| begin + random.within(0.0, 1e-3)));
    }
    let mut crank_at = |t: f64| {
        dynamics.move_to(t, &start.q, &start.v);
        let crank = dynamics.frame(driven.column + 1);
        (crank.sine, crank.cosine, dynamics.angle(driven.column + 1))
    };
    let forward: Vec<_> = times.iter().map(|&t| crank_at(t)).collect();
    let backward: Vec<_> = times.iter().rev().map(|&t| crank_at(t)).collect();
    assert!(forward.iter().eq(backward.iter().rev()), "an instant has one pose, to the bit");
    for (&t, (sine, cosine, angle)) in times.iter().zip(forward) {
        let (coordinate, _, turns) = driven.at(t.into());
        let (true_sine, true_cosine) = coordinate.position.sin_cos();
        // The angle within half a turn is rounded to 2.2e-16 rad on either side.
        let off = (sine - true_sine).abs().max((cosine - true_cosine).abs());
        assert!(off < 1e-15, "{t} s: {off:e}");
        let true_angle = with_turns(coordinate.position, turns);
        assert!((angle - true_angle).abs() <= 2.0 * f64::EPSILON * true_angle.abs(), "{t} s: {angle}");
    }
}
