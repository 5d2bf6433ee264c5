//! A straight face and the edge that may touch it.
//!
//! A face is fixed to the first body. Seen from that body, the point **e** of the second body touches it where its
//! distance n·e reaches a limit: everything is as in a bearing, but the normal keeps its direction. A face with ends is a
//! thin plate for round edges: beyond its ends the normal points to the end.

use crate::contact::pair::{CONCENTRIC, Geometry, Phase, RelativeMotion};
use crate::numerics::dual::Scalar;

/// A straight face and the edge that may touch it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Unit vector into the face, in the axes of the first body.
    pub normal: [f64; 2],
    /// Distance of the center of the edge along the normal at which the surfaces touch [m].
    pub limit: f64,
    /// Radius of the edge [m].
    pub radius: f64,
    /// Size of the part that touches [m].
    pub size: f64,
    /// Half of the length of the face [m]; infinite without ends.
    pub half_length: f64,
}

impl Face {
    /// Whether a round edge at a place lies beyond the ends of the face.
    pub fn is_past_end(&self, [ex, ey]: [f64; 2]) -> bool {
        let [nx, ny] = self.normal;
        self.radius > 0.0 && (ey * nx - ex * ny).abs() > self.half_length
    }

    /// The unit vector along which the surfaces approach where the edge is at a place.
    pub fn normal_at(&self, eccentricity: [f64; 2]) -> [f64; 2] {
        let rest = [0.0; 2];
        let motion = RelativeMotion { eccentricity, rate: rest, spin: 0.0, roll: 0.0 };
        self.geometry(&motion, Phase::Free).normal
    }

    /// The geometry at the face.
    #[inline(always)]
    pub(super) fn geometry<S: Scalar>(&self, motion: &RelativeMotion<S>, phase: Phase) -> Geometry<S> {
        if self.half_length.is_finite()
            && let Some(geometry) = self.geometry_at_plate(motion, phase)
        {
            return geometry;
        }
        let [ex, ey] = motion.eccentricity;
        let [vx, vy] = motion.rate;
        let [nx, ny] = self.normal;
        Geometry {
            // Asked for by the printed sliding velocity, which is that of a bearing.
            inverse: S::constant(f64::NAN),
            normal: self.normal.map(S::constant),
            penetration: ex * nx + ey * ny - self.limit,
            penetration_rate: vx * nx + vy * ny,
            tangential_velocity: vy * nx - vx * ny,
        }
    }

    /// That of a round edge which does not touch a face with ends from the front, and of a corner that is not over it: by
    /// the nearest point of the face.
    #[inline(never)]
    fn geometry_at_plate<S: Scalar>(&self, motion: &RelativeMotion<S>, phase: Phase) -> Option<Geometry<S>> {
        let [ex, ey] = motion.eccentricity;
        let [vx, vy] = motion.rate;
        let [nx, ny] = self.normal;
        let (depth, place) = (ex * nx + ey * ny - (self.limit + self.radius), ey * nx - ex * ny);
        let is_beside = place.value().abs() > self.half_length;
        let is_aside = phase == Phase::Beyond || self.radius > 0.0 && (is_beside || depth.value() >= 0.0);
        let over =
            if is_beside { place - self.half_length.copysign(place.value()) } else { S::constant(0.0) };
        let square = depth * depth + over * over;
        if !is_aside || square.value() < CONCENTRIC {
            return None;
        }
        let distance = square.sqrt();
        let (across, along) = (-depth / distance, -over / distance);
        let (nx, ny) = (across * nx - along * ny, across * ny + along * nx);
        Some(Geometry {
            inverse: S::constant(f64::NAN),
            normal: [nx, ny],
            penetration: -distance + self.radius,
            penetration_rate: vx * nx + vy * ny,
            tangential_velocity: vy * nx - vx * ny,
        })
    }
}
