//! Sines and cosines from anchors nearby, against those of the standard library.

use chebclear::numerics::rotation::{Anchor, LARGEST_ROTATION};

use crate::support::Random;

#[test]
fn sines_and_cosines_from_anchors_are_those_of_the_angle_in_any_order() {
    let mut random = Random(5);
    let mut angles = vec![0.0, -0.0, 1e-300, LARGEST_ROTATION, -LARGEST_ROTATION];
    for _ in 0..500 {
        let near = random.within(-1.0, 1.0) * 10.0_f64.powf(random.within(-3.0, 4.0));
        angles.extend((0..20).map(|_| near + random.within(-0.1, 0.1)));
    }
    let mut anchor = Anchor::NONE;
    let forward: Vec<_> = angles.iter().map(|&angle| anchor.sin_cos(angle)).collect();
    let backward: Vec<_> = angles.iter().rev().map(|&angle| anchor.sin_cos(angle)).collect();
    assert!(forward.iter().eq(backward.iter().rev()), "an angle has one sine and cosine, to the bit");
    for (&angle, (sine, cosine)) in angles.iter().zip(forward) {
        let off = (sine - angle.sin()).abs().max((cosine - angle.cos()).abs());
        assert!(off <= 2.0 * f64::EPSILON, "{angle}: {off:e}");
        // Small angles keep their relative accuracy.
        if angle.abs() < LARGEST_ROTATION {
            assert!((sine - angle.sin()).abs() <= f64::EPSILON * angle.abs(), "{angle}: {sine:e}");
        }
    }
    assert!(anchor.sin_cos(f64::NAN).0.is_nan() && anchor.sin_cos(f64::INFINITY).1.is_nan());
    assert_eq!(anchor.sin_cos(1.0), forward_of(1.0), "nothing stays of what is not a number");
}

fn forward_of(angle: f64) -> (f64, f64) {
    Anchor::NONE.clone().sin_cos(angle)
}
