//! A bearing whose surface is worn: a foundation of springs behind a surface whose depth is known in sectors.
//!
//! Seen from the bearing, the journal's center at **e** presses the surface at the angle φ in by
//!
//! ```text
//! δ(φ) = e·u(φ) - c - h(φ),      u = (cos φ, sin φ)
//! ```
//!
//! and every part with δ > 0 pushes back with a pressure in proportion to δ (Winkler). With k, the stiffness per angle,
//!
//! ```text
//! sum of the pressures  S = k ∫ δ dφ      resultant  N = k ∫ δ u dφ      energy  U = k/2 ∫ δ² dφ,  ∇U = N
//! ```
//!
//! Between the middles of two sectors the depth is h = p·u, with p from the depths of both: a part of the round bearing that
//! is displaced by p, where δ = (e - p)·u - c. All integrals are then sums of closed forms. The ends of what touches add
//! nothing to first derivatives, since δ is zero there: the derivatives for fixed ends are exact, and N is continuous with
//! them. The damping multiplies all pressures by the same factor; friction acts on S at the mean sliding velocity of what
//! touches, so that its power is that of the pressures.

use crate::numerics::accuracy::HALF_DIGITS;
use std::f64::consts::{SQRT_2, TAU};

use crate::contact::normal::NormalLaw;
use crate::contact::pair::{ContactLaw, ContactState, Phase, RelativeMotion, Surfaces};
use crate::numerics::dual::Scalar;

/// A bearing with a worn surface.
#[derive(Clone, Debug, PartialEq)]
pub struct WornBearing {
    /// Journal radius [m].
    pub journal_radius: f64,
    /// Clearance before it was worn [m].
    clearance: f64,
    /// Stiffness per angle [N/(m rad)].
    stiffness: f64,
    /// One part of the surface for each sector, from the middle of it to that of the next.
    parts: Vec<Part>,
}

/// A part of the surface: that of a displaced round bearing, between two directions in the axes of the frame.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    from: [f64; 2],
    middle: [f64; 2],
    to: [f64; 2],
    /// Displacement p [m].
    shift: [f64; 2],
}

/// What presses: sums over the part of the surface with δ > 0, for [`WornBearing`].
#[derive(Clone, Copy, Debug)]
struct Patch {
    /// The largest δ [m], negative without contact, its direction, and the place p·u + c of the surface there [m].
    penetration: f64,
    normal: [f64; 2],
    limit: f64,
    /// ∫ u dφ, ∫ u uᵀ dφ (xx, xy, yy), and ∫ g dφ, ∫ g u dφ, ∫ g² dφ with g = c + h.
    spread: [f64; 2],
    second: [f64; 3],
    place: f64,
    places: [f64; 2],
    square: f64,
}

/// Directions between which the journal touches.
#[derive(Clone, Copy)]
struct Arc {
    from: [f64; 2],
    to: [f64; 2],
}

impl Arc {
    /// ∫ dφ.
    fn angle(&self) -> f64 {
        cross(self.from, self.to).atan2(dot(self.from, self.to))
    }

    /// ∫ u dφ.
    fn spread(&self) -> [f64; 2] {
        [self.to[1] - self.from[1], self.from[0] - self.to[0]]
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl Part {
    /// Where the journal at `e` comes nearest: the displaced eccentricity, how far it reaches [m], and in which direction.
    #[inline]
    fn nearest(&self, e: [f64; 2]) -> ([f64; 2], f64, [f64; 2]) {
        let d = [e[0] - self.shift[0], e[1] - self.shift[1]];
        let (at_start, at_end) = (dot(d, self.from), dot(d, self.to));
        if cross(self.from, d) > 0.0 && cross(d, self.to) > 0.0 {
            let length = dot(d, d).sqrt();
            (d, length, [d[0] / length, d[1] / length])
        } else if at_start > at_end {
            (d, at_start, self.from)
        } else {
            (d, at_end, self.to)
        }
    }

    /// Where the journal touches, which reaches in some direction beyond the clearance.
    fn touched(&self, d: [f64; 2], clearance: f64) -> Arc {
        // Ends inside the part are at the angle α from d with cos α = clearance / |d|.
        let length = dot(d, d).sqrt();
        let (cosine, sine) =
            (clearance / length, ((length - clearance) * (length + clearance)).sqrt() / length);
        let [x, y] = d.map(|component| component / length);
        let begins = [x * cosine + y * sine, y * cosine - x * sine];
        let ends = [x * cosine - y * sine, y * cosine + x * sine];
        Arc {
            from: if dot(d, self.from) > clearance { self.from } else { begins },
            to: if dot(d, self.to) > clearance { self.to } else { ends },
        }
    }
}

impl WornBearing {
    /// A bearing worn by `depths` [m] in the middles of equal sectors, of which the first begins at an `angle` [rad]. Without
    /// wear it begins to press as the law K δ^(3/2) of a `stiffness` K: k = 3 K √c / (4 √2).
    pub fn new(journal_radius: f64, (clearance, stiffness): (f64, f64), depths: &[f64], angle: f64) -> Self {
        let width = TAU / depths.len() as f64;
        let direction = |k: f64| {
            let (sine, cosine) = (angle + width * k).sin_cos();
            [cosine, sine]
        };
        let part = |k: usize| {
            let place = k as f64 + 0.5;
            let (from, to) = (direction(place), direction(place + 1.0));
            let [first, last] = [depths[k], depths[(k + 1) % depths.len()]].map(|depth| depth / width.sin());
            let shift = [first * to[1] - last * from[1], last * from[0] - first * to[0]];
            Part { from, middle: direction(place + 0.5), to, shift }
        };
        Self {
            journal_radius,
            clearance,
            stiffness: 0.75 * stiffness * clearance.sqrt() / SQRT_2,
            parts: (0..depths.len()).map(part).collect(),
        }
    }

    /// Number of sectors.
    pub fn sectors(&self) -> usize {
        self.parts.len()
    }

    /// What presses where the journal is at `e`.
    fn patch(&self, e: [f64; 2]) -> Patch {
        let mut patch = Patch {
            penetration: f64::NEG_INFINITY,
            normal: [0.0; 2],
            limit: 0.0,
            spread: [0.0; 2],
            second: [0.0; 3],
            place: 0.0,
            places: [0.0; 2],
            square: 0.0,
        };
        for part in &self.parts {
            let (d, reach, direction) = part.nearest(e);
            if reach - self.clearance > patch.penetration {
                patch.penetration = reach - self.clearance;
                patch.normal = direction;
                patch.limit = dot(part.shift, direction) + self.clearance;
            }
            if reach > self.clearance {
                patch.add(part.shift, self.clearance, part.touched(d, self.clearance));
            }
        }
        patch
    }

    /// Sum of the elastic pressures [N] and their energy [J].
    pub fn elastic(&self, e: [f64; 2]) -> (f64, f64) {
        let Patch { spread, second: [xx, xy, yy], place, places, square, .. } = self.patch(e);
        let [x, y] = e;
        let twice = x * x * xx + 2.0 * x * y * xy + y * y * yy - 2.0 * dot(e, places) + square;
        (self.stiffness * (dot(e, spread) - place), 0.5 * self.stiffness * twice)
    }

    /// Direction in which the journal touches first, or is nearest to it.
    pub fn normal(&self, e: [f64; 2]) -> [f64; 2] {
        self.patch(e).normal
    }

    /// Divides an amount among the sectors in proportion to their pressures.
    pub fn distribute(&self, e: [f64; 2], amount: f64, sectors: &mut [f64]) {
        let count = self.parts.len();
        let each = |share: &mut dyn FnMut(usize, f64)| {
            for (k, part) in self.parts.iter().enumerate() {
                let (d, reach, _) = part.nearest(e);
                if reach <= self.clearance {
                    continue;
                }
                let arc = part.touched(d, self.clearance);
                let pressure = |arc: Arc| (dot(d, arc.spread()) - self.clearance * arc.angle()).max(0.0);
                let whole = pressure(arc);
                let first = if cross(part.middle, arc.from) >= 0.0 {
                    0.0
                } else if cross(arc.to, part.middle) >= 0.0 {
                    whole
                } else {
                    pressure(Arc { to: part.middle, ..arc }).min(whole)
                };
                share(k, first);
                share((k + 1) % count, whole - first);
            }
        };
        let mut sum = 0.0;
        each(&mut |_, pressure| sum += pressure);
        if sum > 0.0 {
            each(&mut |sector, pressure| sectors[sector] += amount * pressure / sum);
        } else {
            // Too little to be divided: where it is nearest.
            let normal = self.patch(e).normal;
            let along = |k: &usize| dot(normal, self.parts[*k].from);
            let nearest = (0..count).max_by(|a, b| along(a).total_cmp(&along(b)));
            sectors[nearest.unwrap_or(0)] += amount;
        }
    }
}

impl Patch {
    /// Adds a part of the surface that is touched, displaced by a `shift`.
    fn add(&mut self, shift: [f64; 2], clearance: f64, arc: Arc) {
        let (Arc { from, to }, angle, spread) = (arc, arc.angle(), arc.spread());
        let (twice, square) = (to[0] * to[1] - from[0] * from[1], to[1] * to[1] - from[1] * from[1]);
        let [xx, xy, yy] = [0.5 * (angle + twice), 0.5 * square, 0.5 * (angle - twice)];
        // g = p·u + c.
        let by_shift = [xx * shift[0] + xy * shift[1], xy * shift[0] + yy * shift[1]];
        let place = dot(shift, spread) + clearance * angle;
        for (sum, part) in self.second.iter_mut().zip([xx, xy, yy]) {
            *sum += part;
        }
        for k in 0..2 {
            self.spread[k] += spread[k];
            self.places[k] += by_shift[k] + clearance * spread[k];
        }
        self.place += place;
        self.square += dot(shift, by_shift) + clearance * (dot(shift, spread) + place);
    }
}

impl ContactLaw {
    /// Elastic part of the normal force [N], and its energy [J].
    #[inline(always)]
    pub fn elastic(&self, motion: &RelativeMotion<f64>, penetration: f64) -> (f64, f64) {
        match &self.surfaces {
            Surfaces::Worn(worn) => worn.elastic(motion.eccentricity),
            _ => (self.normal.elastic_force(penetration), self.normal.elastic_energy(penetration)),
        }
    }

    /// The state of the contact in a worn bearing, seen from it.
    // Not inlined, for the reason given at `at_face`.
    #[inline(never)]
    pub(crate) fn in_worn_bearing<S: Scalar>(
        &self,
        worn: &WornBearing,
        motion: &RelativeMotion<S>,
        phase: Phase,
    ) -> ContactState<S> {
        let zero = S::constant(0.0);
        let ([x, y], [vx, vy]) = (motion.eccentricity, motion.rate);
        let e = [x.value(), y.value()];
        let patch = worn.patch(e);
        let [nx, ny] = patch.normal;
        let mut state = ContactState {
            penetration: x * nx + y * ny - patch.limit,
            penetration_rate: vx * nx + vy * ny,
            sliding_velocity: vy * nx - vx * ny + motion.spin,
            normal_force: zero,
            friction_force: zero,
            force: [zero; 2],
        };
        let sum = (x * patch.spread[0] + y * patch.spread[1] - patch.place) * worn.stiffness;
        if sum.value() <= 0.0 {
            return state;
        }
        let inverse = S::constant(1.0) / sum;
        let [xx, xy, yy] = patch.second;
        let mut resultant = [sum * nx, sum * ny];
        if patch.penetration > HALF_DIGITS * dot(e, e).sqrt() {
            resultant = [
                (x * xx + y * xy - patch.places[0]) * worn.stiffness,
                (x * xy + y * yy - patch.places[1]) * worn.stiffness,
            ];
            let [px, py] = resultant;
            state.penetration_rate = (px * vx + py * vy) * inverse;
            state.sliding_velocity = (px * vy - py * vx) * inverse + motion.spin;
        }
        let Phase::Contact { latch, clipped: false, .. } = phase else { return state };
        let damping = NormalLaw::ratio(state.penetration_rate, latch);
        state.normal_force = sum * damping;
        if let Some(law) = &self.friction {
            state.friction_force = -(law.signed_coefficient(state.sliding_velocity) * state.normal_force);
        }
        let [px, py] = resultant;
        let along = state.friction_force * inverse;
        state.force = [-(px * damping) - along * py, along * px - py * damping];
        state
    }
}
