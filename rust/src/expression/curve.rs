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
    interpolation: Interpolation,
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
        Ok(Self { points: points.to_vec(), pieces, interpolation, beyond, last })
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

    /// Pieces between two instants at which a run must end a step: a spline has a single one.
    fn count(&self) -> i64 {
        if self.interpolation == Interpolation::Cubic { 1 } else { self.pieces.len() as i64 }
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

    /// The piece of coefficients in which a number between its ends lies.
    pub(super) fn piece_of(&self, x: f64) -> usize {
        self.search(x)
    }

    fn search(&self, x: f64) -> usize {
        self.inner_points().partition_point(|&point| point <= x)
    }

    /// The piece in which a number lies: -1 before the first one, `count` behind the last one, and over
    /// all turns of a table that repeats itself.
    pub fn piece(&self, x: f64) -> i64 {
        let [first, last] = self.ends();
        let (turns, rest) = self.wrapped(x);
        let count = self.count();
        if self.beyond != Beyond::Repeat && (x < first || x > last) {
            return if x < first { -1 } else { count };
        }
        let within = if self.interpolation == Interpolation::Cubic { 0 } else { self.search(rest) as i64 };
        turns * count + within
    }

    /// Where a piece ends; infinite where it has no end, or no end at which the table is not smooth.
    pub fn bounds(&self, piece: i64) -> [f64; 2] {
        let [first, last] = self.ends();
        let count = self.count();
        if self.beyond == Beyond::Repeat {
            if self.interpolation == Interpolation::Cubic {
                return [f64::NEG_INFINITY, f64::INFINITY];
            }
            let start = piece.div_euclid(count) as f64 * self.span();
            let within = piece.rem_euclid(count) as usize;
            return [self.points[within] + start, self.points[within + 1] + start];
        }
        match piece {
            -1 => [f64::NEG_INFINITY, first],
            _ if piece == count => [last, f64::INFINITY],
            _ if self.interpolation == Interpolation::Cubic => [first, last],
            _ => [self.points[piece as usize], self.points[piece as usize + 1]],
        }
    }

    /// Whether the table has a value in a piece.
    pub fn covers(&self, piece: i64) -> bool {
        self.beyond != Beyond::End || (0..self.count()).contains(&piece)
    }

    /// Value where a number lies in a piece or, by an error of a step, a little beyond it.
    pub fn value<S: Scalar>(&self, x: S, piece: i64) -> S {
        let [first, last] = self.ends();
        if self.beyond != Beyond::Repeat && (piece < 0 || piece >= self.count()) {
            return match self.beyond {
                Beyond::Hold => S::constant(if piece < 0 { self.pieces[0][0] } else { self.last }),
                _ => S::constant(f64::NAN),
            };
        }
        let (within, turns) = if self.interpolation == Interpolation::Cubic {
            let (turns, rest) = self.wrapped(x.value());
            (self.search(rest.clamp(first, last)), turns)
        } else {
            (piece.rem_euclid(self.count()) as usize, piece.div_euclid(self.count()))
        };
        let from = self.points[within] + turns as f64 * self.span();
        let [c0, c1, c2, c3] = self.pieces[within];
        let distance = x - from;
        ((distance * c3 + c2) * distance + c1) * distance + c0
    }
}

fn linear(points: &[f64], values: &[f64]) -> Vec<[f64; 4]> {
    let pairs = points.windows(2).zip(values.windows(2));
    pairs.map(|(x, y)| [y[0], (y[1] - y[0]) / (x[1] - x[0]), 0.0, 0.0]).collect()
}
