//! Tables over a quantity of the motion: forces over a stroke, torques over a speed or an angle.

use crate::numerics::dual::Scalar;
use crate::numerics::spline::{monotone, not_a_knot, periodic_cubic};

/// How a table is followed between its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines: the work over the table is that of the trapezoids.
    Linear,
    /// Cubic pieces without overshoot, once continuously differentiable `[FritschButland1984]`.
    Monotone,
    /// The cubic spline, twice continuously differentiable.
    Cubic,
}

/// What a table is beyond its ends; it is never extrapolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// The run ends there.
    End,
    /// The values at the ends hold on.
    Hold,
    /// The table repeats itself.
    Repeat,
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    pub(crate) points: Vec<f64>,
    /// Coefficients of every piece in powers of the distance from its start.
    pub(crate) pieces: Vec<[f64; 4]>,
    /// Pieces at whose start a run ends a step, in their order; the first one always.
    stretches: Vec<usize>,
    /// Whether a table that repeats itself does so smoothly: no step ends there.
    closes: bool,
    beyond: Beyond,
    /// Value at the last point.
    last: f64,
}

impl Curve {
    /// The table through `values` at `points`.
    ///
    /// # Errors
    /// What is wrong with the points: at least two are needed, all finite, increasing; a table that repeats itself
    /// ends with its first value.
    pub fn new(
        points: &[f64],
        values: &[f64],
        interpolation: Interpolation,
        beyond: Beyond,
    ) -> Result<Self, String> {
        if points.len() != values.len() || points.len() < 2 {
            let counts = format!("got {} points and {} values", points.len(), values.len());
            return Err(format!("a table needs as many points as values, at least two; {counts}"));
        }
        if let Some(k) = (0..points.len()).find(|&k| !(points[k].is_finite() && values[k].is_finite())) {
            return Err(format!("point {k} of a table must be finite, got ({}, {})", points[k], values[k]));
        }
        if let Some(k) = (1..points.len()).find(|&k| points[k] <= points[k - 1]) {
            return Err(format!("points must increase, got {} after {}", points[k], points[k - 1]));
        }
        let (first, last) = (values[0], values[values.len() - 1]);
        if beyond == Beyond::Repeat && first != last {
            return Err(format!("a periodic table ends with its first value, {first}, got {last}"));
        }
        let pieces = match (interpolation, beyond) {
            (Interpolation::Linear, _) => linear(points, values),
            (Interpolation::Monotone, _) => monotone(points, values, beyond == Beyond::Repeat),
            (Interpolation::Cubic, Beyond::Repeat) => periodic_cubic(points, values),
            (Interpolation::Cubic, _) => not_a_knot(points, values),
        };
        if let Some(k) = pieces.iter().position(|piece| !piece.iter().all(|c| c.is_finite())) {
            return Err(format!(
                "the curve through the points must be finite, it is not between {:e} and {:e}: they are too close, or \
                 the values too large",
                points[k],
                points[k + 1]
            ));
        }
        let is_smooth = interpolation == Interpolation::Cubic;
        let stretches = if is_smooth { vec![0] } else { (0..pieces.len()).collect() };
        let closes = is_smooth && beyond == Beyond::Repeat;
        Ok(Self { points: points.to_vec(), pieces, stretches, closes, beyond, last })
    }

    /// The same table for runs of a relative tolerance: they step over the points at which it is smooth enough. `None` if
    /// they must end a step at all of them.
    pub fn for_tolerance(&self, rtol: f64) -> Option<Curve> {
        let is_smooth = |&piece: &usize| {
            let before = (piece + self.pieces.len() - 1) % self.pieces.len();
            self.roughness(before, piece) <= rtol
        };
        let inner = self.stretches[1..].iter().copied().filter(|piece| !is_smooth(piece));
        let stretches: Vec<usize> = std::iter::once(0).chain(inner).collect();
        let closes = self.closes || self.repeats() && stretches.len() == 1 && is_smooth(&0);
        let is_other = stretches.len() < self.stretches.len() || closes != self.closes;
        is_other.then(|| Curve { stretches, closes, ..self.clone() })
    }

    /// By how much its values would change if it were rounded between two pieces, over the larger of these, relative to the
    /// largest of their values at the points [-]. A kink changes by an eighth of its jump of slope times that width, a jump
    /// of the second derivative by its 24th part times the square. What a step over the point does not see is not more.
    fn roughness(&self, before: usize, after: usize) -> f64 {
        let [width, next] = [before, after].map(|piece| self.points[piece + 1] - self.points[piece]);
        let ([c0, c1, c2, c3], [d0, d1, d2, _]) = (self.pieces[before], self.pieces[after]);
        let kink = d1 - ((3.0 * c3 * width + 2.0 * c2) * width + c1);
        let bend = 2.0 * d2 - (6.0 * c3 * width + 2.0 * c2);
        let widest = width.max(next);
        let end = self.pieces.get(after + 1).map_or(self.last, |piece| piece[0]);
        let size = c0.abs().max(d0.abs()).max(end.abs());
        let change = (kink.abs() / 8.0 + bend.abs() * widest / 24.0) * widest;
        if change > 0.0 { change / size } else { 0.0 }
    }

    /// The cubic spline through `values` at `points`, which ends with them.
    ///
    /// # Errors
    /// What is wrong with the points.
    pub fn spline(points: &[f64], values: &[f64]) -> Result<Self, String> {
        Self::new(points, values, Interpolation::Cubic, Beyond::End)
    }

    /// The points between two pieces.
    pub(crate) fn inner_points(&self) -> &[f64] {
        &self.points[1..self.points.len() - 1]
    }

    /// Its first and its last point.
    pub fn ends(&self) -> [f64; 2] {
        [self.points[0], self.points[self.points.len() - 1]]
    }

    /// Length of the part of the axis that the table covers.
    pub fn span(&self) -> f64 {
        let [first, last] = self.ends();
        last - first
    }

    /// Largest absolute value at its points.
    pub fn largest(&self) -> f64 {
        self.pieces.iter().map(|piece| piece[0].abs()).fold(self.last.abs(), f64::max)
    }

    /// Stretches between two points at which a run ends a step: a spline has a single one.
    fn count(&self) -> i64 {
        self.stretches.len() as i64
    }

    /// The pieces of a stretch.
    fn pieces_of(&self, stretch: usize) -> [usize; 2] {
        let end = self.stretches.get(stretch + 1).map_or(self.pieces.len(), |&next| next);
        [self.stretches[stretch], end]
    }

    /// Turns of a table that repeats itself up to a number, and what is left of it.
    fn wrapped(&self, x: f64) -> (i64, f64) {
        if self.beyond != Beyond::Repeat {
            return (0, x);
        }
        let turns = ((x - self.points[0]) / self.span()).floor();
        (turns as i64, x - turns * self.span())
    }

    /// Whether it repeats itself.
    pub(super) fn repeats(&self) -> bool {
        self.beyond == Beyond::Repeat
    }

    /// The piece in which a number between its ends lies.
    pub(super) fn piece_of(&self, x: f64) -> usize {
        self.inner_points().partition_point(|&point| point <= x)
    }

    /// The stretch in which a number lies: -1 before the first one, `count` behind the last one, and over
    /// all turns of a table that repeats itself.
    pub fn stretch(&self, x: f64) -> i64 {
        let [first, last] = self.ends();
        let (turns, rest) = self.wrapped(x);
        let count = self.count();
        if self.beyond != Beyond::Repeat && (x < first || x > last) {
            return if x < first { -1 } else { count };
        }
        let starts = self.stretches.partition_point(|&piece| self.points[piece] <= rest);
        turns * count + (starts.max(1) - 1) as i64
    }

    /// Where a stretch ends; infinite where it has no end, or no end at which the table is not smooth.
    pub fn bounds(&self, stretch: i64) -> [f64; 2] {
        let [first, last] = self.ends();
        let count = self.count();
        if self.closes {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        if self.beyond != Beyond::Repeat && stretch < 0 {
            return [f64::NEG_INFINITY, first];
        }
        if self.beyond != Beyond::Repeat && stretch >= count {
            return [last, f64::INFINITY];
        }
        let shift = stretch.div_euclid(count) as f64 * self.span();
        self.pieces_of(stretch.rem_euclid(count) as usize).map(|point| self.points[point] + shift)
    }

    /// Whether the table has a value in a stretch.
    pub fn covers(&self, stretch: i64) -> bool {
        self.beyond != Beyond::End || (0..self.count()).contains(&stretch)
    }

    /// Value where a number lies in a stretch or, by an error of a step, a little beyond it.
    pub fn value<S: Scalar>(&self, x: S, stretch: i64) -> S {
        if self.beyond != Beyond::Repeat && (stretch < 0 || stretch >= self.count()) {
            return match self.beyond {
                Beyond::Hold => S::constant(if stretch < 0 { self.pieces[0][0] } else { self.last }),
                _ => S::constant(f64::NAN),
            };
        }
        let turns = if self.closes { self.wrapped(x.value()).0 } else { stretch.div_euclid(self.count()) };
        let shift = turns as f64 * self.span();
        let [start, end] = self.pieces_of(stretch.rem_euclid(self.count()) as usize);
        let inner = &self.points[start + 1..end];
        let within = start + inner.partition_point(|&point| point <= x.value() - shift);
        let from = self.points[within] + shift;
        let [c0, c1, c2, c3] = self.pieces[within];
        let distance = x - from;
        ((distance * c3 + c2) * distance + c1) * distance + c0
    }
}

fn linear(points: &[f64], values: &[f64]) -> Vec<[f64; 4]> {
    let pairs = points.windows(2).zip(values.windows(2));
    pairs.map(|(x, y)| [y[0], (y[1] - y[0]) / (x[1] - x[0]), 0.0, 0.0]).collect()
}
