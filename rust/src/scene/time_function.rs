//! Functions of time with their first three derivatives: drives, forces and torques.
//!
//! Accelerations depend on the second derivative of a prescribed motion and their time derivative on the
//! third, so all derivatives are exact. Rounding errors of large angles and times are carried along, so that
//! values late in a long run are as accurate as at its start.

use crate::expression::curve::Curve;
use crate::expression::enclosure::Enclosure;
use crate::expression::tape::Tape;
use crate::numerics::instant::{Instant, exact_product, exact_sum};
use crate::numerics::interval::Interval;
use crate::numerics::turns::{Turns, unwind_exactly, unwind_sum};

/// Instants [s] at which the size of a formula of the time is judged, irregular so that no period hides it.
const SOME_INSTANTS: [f64; 12] =
    [0.0, 1e-4, 3.1e-4, 1.1e-3, 2.9e-3, 1.2e-2, 3.3e-2, 0.13, 0.29, 0.71, 1.9, 5.3];

/// A function of time.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeFunction {
    /// Σ c_k t^k.
    Polynomial(Vec<f64>),
    /// mean + amplitude sin(angular_frequency t + phase).
    Harmonic {
        /// Mean value [unit].
        mean: f64,
        /// Amplitude [unit].
        amplitude: f64,
        /// Angular frequency [rad/s].
        angular_frequency: f64,
        /// Phase at time zero [rad].
        phase: f64,
    },
    /// The cubic spline through points, which ends with them.
    Table(Curve),
    /// A formula of the time without switches.
    Formula(Tape),
}

impl TimeFunction {
    /// A constant value.
    pub fn constant(value: f64) -> Self {
        TimeFunction::Polynomial(vec![value])
    }

    /// Value and first three derivatives at an instant.
    #[inline(always)]
    pub fn at(&self, t: impl Into<Instant>) -> [f64; 4] {
        let ([value, first, second, third], rest) = self.with_rest(t.into());
        [value + rest, first, second, third]
    }

    /// The same for an angle [rad], as an angle within half a turn and full turns.
    #[inline(always)]
    pub fn angle_at(&self, t: impl Into<Instant>) -> ([f64; 4], Turns) {
        let ([angle, rates @ ..], rest) = self.with_rest(t.into());
        let (angle, turns) = unwind_sum(angle, rest);
        let [speed, acceleration, jerk] = rates;
        ([angle, speed, acceleration, jerk], turns)
    }

    /// The value where it is an angle [rad], within half a turn with its rounding error, and the full turns that
    /// were subtracted.
    pub fn exact_angle_at(&self, t: impl Into<Instant>) -> ([f64; 2], Turns) {
        let ([angle, ..], rest) = self.with_rest(t.into());
        unwind_exactly(angle, rest)
    }

    /// Value and derivatives, and the rounding error of the value.
    #[inline(always)]
    fn with_rest(&self, t: Instant) -> ([f64; 4], f64) {
        if let TimeFunction::Polynomial(coefficients) = self
            && let [position, speed] = coefficients[..]
        {
            // Constant speed is the usual drive and should be cheap.
            return line(position, speed, t);
        }
        self.with_rest_of_any(t)
    }

    #[inline(never)]
    fn with_rest_of_any(&self, t: Instant) -> ([f64; 4], f64) {
        match self {
            TimeFunction::Polynomial(coefficients) => polynomial(coefficients, t),
            &TimeFunction::Harmonic { mean, amplitude, angular_frequency, phase } => {
                let ([angle, ..], rest) = line(phase, angular_frequency, t);
                let (sine, cosine) = unwind_sum(angle, rest).0.sin_cos();
                let square = angular_frequency * angular_frequency;
                let (value, rest) = exact_sum(mean, amplitude * sine);
                let derivatives = [
                    value,
                    amplitude * angular_frequency * cosine,
                    -amplitude * square * sine,
                    -amplitude * square * angular_frequency * cosine,
                ];
                (derivatives, rest)
            }
            TimeFunction::Table(table) => tabulated(table, t),
            TimeFunction::Formula(tape) => {
                let derivatives = tape.of_time(t.time);
                (derivatives, derivatives[1] * t.rest)
            }
        }
    }

    /// Ranges of the value and of the first N - 1 of three derivatives between two instants [s], of a function that may
    /// change between two instants more than its values there tell; polynomials do not, and a run ends a step at every
    /// point of a table.
    pub fn ranges<const N: usize>(&self, from: f64, to: f64) -> Option<[Interval; N]> {
        let time = Interval { lower: from, upper: to };
        match self {
            TimeFunction::Polynomial(_) | TimeFunction::Table(_) => None,
            &TimeFunction::Harmonic { mean, amplitude, angular_frequency, phase } => {
                let angle = time * angular_frequency + Interval::point(phase);
                let (sine, cosine) = (angle.sin() * amplitude, angle.cos() * amplitude);
                let square = angular_frequency * angular_frequency;
                Some(std::array::from_fn(|order| match order {
                    0 => sine + Interval::point(mean),
                    1 => cosine * angular_frequency,
                    2 => -sine * square,
                    _ => -cosine * square * angular_frequency,
                }))
            }
            TimeFunction::Formula(tape) => {
                let Enclosure(ranges) = tape.enclose(&[Enclosure::quantity(time, Interval::point(1.0))]);
                Some(ranges)
            }
        }
    }

    /// Whether value and derivatives are those of `c_0 + c_1 t`.
    pub fn is_linear(&self) -> bool {
        matches!(self, TimeFunction::Polynomial(coefficients) if coefficients.len() <= 2)
    }

    /// Scales of the value and of its rate for the choice of tolerances: upper bounds where
    /// they exist, the values at time zero for a polynomial.
    pub fn scales(&self) -> [f64; 2] {
        match self {
            TimeFunction::Polynomial(_) => {
                let [value, rate, ..] = self.at(0.0);
                [value.abs(), rate.abs()]
            }
            TimeFunction::Harmonic { mean, amplitude, angular_frequency, .. } => {
                [mean.abs() + amplitude.abs(), (amplitude * angular_frequency).abs()]
            }
            // No bound is known: instants of all orders up to some seconds tell its size.
            TimeFunction::Formula(tape) => largest(&SOME_INSTANTS, |t| tape.of_time(t)),
            TimeFunction::Table(table) => largest(&table.points, |t| tabulated(table, t.into()).0),
        }
    }

    /// Scale of the rate for the choice of tolerances: an upper bound where it exists. A polynomial has none
    /// and may start at rest; its scale is the largest rate until it has moved by about `distance` from time
    /// zero.
    pub fn fastest(&self, distance: f64) -> f64 {
        let [_, mut rate] = self.scales();
        if let TimeFunction::Formula(tape) = self {
            // What a formula does after that may lie far beyond the run, as of a law for a motion of some time.
            let start = tape.of_time(0.0)[0];
            let moved = |t: &&f64| (tape.of_time(**t)[0] - start).abs() <= distance;
            let last = SOME_INSTANTS.iter().take_while(moved).count() + 1;
            [_, rate] = largest(&SOME_INSTANTS[..last.min(SOME_INSTANTS.len())], |t| tape.of_time(t));
        }
        let span = self.time_to_move(distance);
        if matches!(self, TimeFunction::Polynomial(_)) && span.is_finite() && !self.is_linear() {
            for part in [0.25, 0.5, 0.75, 1.0] {
                rate = rate.max(self.at(part * span)[1].abs());
            }
        }
        rate
    }

    /// Speed of a mass after a distance of `length` from rest [m/s] under a force that grows with time from
    /// zero, without its constant part; zero if the function is no polynomial.
    pub fn speed_in_growing(&self, mass: f64, length: f64) -> f64 {
        let TimeFunction::Polynomial(coefficients) = self else { return 0.0 };
        // After t a force c_k t^k has moved the mass by about c_k t^(k+2) / m.
        let growing = coefficients.iter().enumerate().skip(1);
        let times = growing.map(|(k, c)| (mass * length / c.abs()).powf(1.0 / (k as f64 + 2.0)));
        length / power_of_two(times.fold(f64::INFINITY, f64::min))
    }

    /// Time from zero [s] in which the value changes by at most about `distance`, rounded to a power of two
    /// so that it is the same in scaled units; infinity for a constant.
    pub fn time_to_move(&self, distance: f64) -> f64 {
        let time = match self {
            TimeFunction::Polynomial(coefficients) => {
                let powers = coefficients.iter().enumerate().skip(1);
                let times = powers.map(|(k, c)| (distance / c.abs()).powf(1.0 / k as f64));
                times.fold(f64::INFINITY, f64::min)
            }
            _ => distance / self.scales()[1],
        };
        power_of_two(time)
    }

    /// Longest time [s] over which Gauss's quadrature with four points integrates functions of this motion
    /// to rounding; infinity for polynomials.
    pub fn pace(&self) -> f64 {
        match self {
            TimeFunction::Harmonic { angular_frequency, .. } => 0.5 / angular_frequency.abs(),
            // The same, with the angular frequency of a harmonic of as large a rate and third derivative.
            TimeFunction::Formula(tape) => {
                let largest = |order: usize| {
                    let sizes = SOME_INSTANTS.iter().map(|&t| tape.of_time(t)[order].abs());
                    sizes.fold(0.0, f64::max)
                };
                0.5 * (largest(1) / largest(3)).sqrt()
            }
            _ => f64::INFINITY,
        }
    }

    /// Interval on which the function is defined [s]: all times, except for a table.
    pub fn domain(&self) -> [f64; 2] {
        match self {
            TimeFunction::Table(table) => table.ends(),
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// The next instant after `t` [s] at which a derivative jumps; infinity if there is none.
    pub fn next_break(&self, t: f64) -> f64 {
        match self {
            TimeFunction::Table(table) => {
                table.inner_points().get(piece_from(table, t.into())).copied().unwrap_or(f64::INFINITY)
            }
            _ => f64::INFINITY,
        }
    }
}

/// Largest size of a function and of its rate at some instants [s].
fn largest(instants: &[f64], at: impl Fn(f64) -> [f64; 4]) -> [f64; 2] {
    instants.iter().fold([0.0, 0.0], |[value, rate], &t| {
        let [v, r, ..] = at(t);
        [v.abs().max(value), r.abs().max(rate)]
    })
}

/// The largest power of two that is not above a positive value, so that scaled units give the same bits.
pub(crate) fn power_of_two(value: f64) -> f64 {
    f64::from_bits(value.to_bits() & !0xF_FFFF_FFFF_FFFF)
}

/// `start + rate t` and its derivatives, and the rounding error of the value.
#[inline]
fn line(start: f64, rate: f64, t: Instant) -> ([f64; 4], f64) {
    let (product, of_product) = exact_product(rate, t.time);
    let (value, of_sum) = exact_sum(product, start);
    ([value, rate, 0.0, 0.0], of_product + of_sum + rate * t.rest)
}

/// A polynomial and its derivatives by Horner's scheme, and the rounding error of the value by the
/// compensated scheme `[GraillatLangloisLouvet2009]`.
fn polynomial(coefficients: &[f64], t: Instant) -> ([f64; 4], f64) {
    // Taylor coefficients, which are the derivatives over 1, 1, 2, 6.
    let mut value = [0.0; 4];
    let mut rest = 0.0;
    for &coefficient in coefficients.iter().rev() {
        value[3] = value[3] * t.time + value[2];
        value[2] = value[2] * t.time + value[1];
        value[1] = value[1] * t.time + value[0];
        let (product, of_product) = exact_product(value[0], t.time);
        let (sum, of_sum) = exact_sum(product, coefficient);
        value[0] = sum;
        rest = rest * t.time + (of_product + of_sum);
    }
    ([value[0], value[1], 2.0 * value[2], 6.0 * value[3]], rest + value[1] * t.rest)
}

/// A table and its derivatives, and the rounding error of the value.
fn tabulated(table: &Curve, t: Instant) -> ([f64; 4], f64) {
    let piece = piece_from(table, t);
    let (time, rest) = exact_sum(t.time, -table.points[piece]);
    // In a short piece the rest of a long time is no small part.
    polynomial(&table.pieces[piece], Instant::after(time, rest + t.rest))
}

/// The piece that holds from `t` on. The rest of the instant counts: pieces may be as short as it.
fn piece_from(table: &Curve, t: Instant) -> usize {
    table.inner_points().partition_point(|&knot| knot < t.time || knot == t.time && t.rest >= 0.0)
}
