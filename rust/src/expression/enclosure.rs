//! Expressions over a stretch of time: ranges of the value and of its derivatives. What changes between two instants at
//! which a method looks at it is seen by these.

use std::array;

use super::curve::Curve;
use super::grammar::{Binary, Function};
use super::tape::{MOST_VARIABLES, Operation, Stack, SwitchAt, Tape};
use crate::numerics::interval::Interval;

/// Ranges of a function and of its first derivatives over a stretch of its one argument, such as the time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure<const N: usize>(pub [Interval; N]);

impl<const N: usize> Enclosure<N> {
    /// A constant.
    pub fn constant(value: f64) -> Self {
        Self::in_range(Interval::point(value))
    }

    /// Some constant in an interval.
    fn in_range(value: Interval) -> Self {
        Self(array::from_fn(|order| if order == 0 { value } else { Interval::point(0.0) }))
    }

    /// A number of which nothing is known.
    fn unknown() -> Self {
        Self([Interval::WHOLE; N])
    }

    /// A quantity with a range of values and one of rates, whose further derivatives do not count.
    pub fn quantity(value: Interval, rate: Interval) -> Self {
        Self(array::from_fn(|order| match order {
            0 => value,
            1 => rate,
            _ => Interval::point(0.0),
        }))
    }

    /// A function f of it, by the ranges of f and of its first derivatives (Faà di Bruno).
    fn compose(self, f: [Interval; 4]) -> Self {
        let x = |order: usize| self.0[order];
        Self(array::from_fn(|order| match order {
            0 => f[0],
            1 => f[1] * x(1),
            2 => f[2] * x(1).square() + f[1] * x(2),
            _ => f[3] * x(1).power(3.0) + f[2] * x(1) * x(2) * 3.0 + f[1] * x(3),
        }))
    }

    fn plus(self, other: Self) -> Self {
        Self(array::from_fn(|order| self.0[order] + other.0[order]))
    }

    fn minus(self, other: Self) -> Self {
        Self(array::from_fn(|order| self.0[order] - other.0[order]))
    }

    fn negative(self) -> Self {
        Self(self.0.map(|range| -range))
    }

    /// The rule of Leibniz.
    fn times(self, other: Self) -> Self {
        let (a, b) = (&self.0, &other.0);
        Self(array::from_fn(|order| match order {
            0 => a[0] * b[0],
            1 => a[1] * b[0] + a[0] * b[1],
            2 => a[2] * b[0] + a[1] * b[1] * 2.0 + a[0] * b[2],
            _ => a[3] * b[0] + (a[2] * b[1] + a[1] * b[2]) * 3.0 + a[0] * b[3],
        }))
    }

    fn squared(self) -> Self {
        let x = self.0[0];
        let [two, none] = [2.0, 0.0].map(Interval::point);
        self.compose([x.square(), x * 2.0, two, none])
    }

    fn over(self, other: Self) -> Self {
        self.times(other.to_power(-1.0))
    }

    fn to_power(self, exponent: f64) -> Self {
        let mut factor = 1.0;
        self.compose([0.0, 1.0, 2.0, 3.0].map(|order| {
            let range =
                if factor == 0.0 { Interval::point(0.0) } else { self.0[0].power(exponent - order) * factor };
            factor *= exponent - order;
            range
        }))
    }

    fn of(self, function: Function) -> Self {
        let x = self.0[0];
        let one = Interval::point(1.0);
        let f = match function {
            Function::Exp => [x.exp(); 4],
            Function::Sin => [x.sin(), x.cos(), -x.sin(), -x.cos()],
            Function::Cos => [x.cos(), -x.sin(), -x.cos(), x.sin()],
            Function::Sqrt => return self.to_power(0.5),
            Function::Log => {
                let positive = if x.lower < 0.0 { Interval::between(0.0, x.upper.max(0.0)) } else { x };
                let inverse = positive.power(-1.0);
                [x.ln(), inverse, -inverse.square(), inverse.power(3.0) * 2.0]
            }
            Function::Tan => {
                let tangent = x.tan();
                let square = one + tangent.square();
                [tangent, square, tangent * square * 2.0, square * (square * 2.0 + tangent.square() * 4.0)]
            }
            Function::Tanh => {
                let tangent = x.tanh();
                let rest = one - tangent.square();
                [tangent, rest, -tangent * rest * 2.0, rest * (tangent.square() * 6.0 - Interval::point(2.0))]
            }
            Function::Atan => {
                let inverse = (one + x.square()).power(-1.0);
                let third = (x.square() * 6.0 - Interval::point(2.0)) * inverse.power(3.0);
                [x.atan(), inverse, -x * inverse.square() * 2.0, third]
            }
            Function::Asin | Function::Acos => {
                let inverse = (one - x.square()).power(-0.5);
                let cube = inverse.power(3.0);
                let third = (one + x.square() * 2.0) * cube * inverse.square();
                let [sine, slope, bend] = [x.asin(), inverse, x * cube];
                if function == Function::Asin {
                    [sine, slope, bend, third]
                } else {
                    [Interval::point(std::f64::consts::FRAC_PI_2) - sine, -slope, -bend, -third]
                }
            }
        };
        self.compose(f)
    }

    fn pair(binary: Binary, left: Self, right: Self) -> Self {
        match binary {
            Binary::Add => left.plus(right),
            Binary::Subtract => left.minus(right),
            Binary::Multiply => left.times(right),
            Binary::Divide => left.over(right),
            Binary::Power => right.times(left.of(Function::Log)).of(Function::Exp),
            Binary::Hypot => left.squared().plus(right.squared()).to_power(0.5),
            Binary::Atan2 => {
                // (x y' - y x') / (x² + y²), whatever the branch.
                let (y, x) = (left.0[0], right.0[0]);
                let whole = Interval { lower: -std::f64::consts::PI, upper: std::f64::consts::PI };
                let quarter = Interval::point(std::f64::consts::FRAC_PI_2);
                let value = if x.lower > 0.0 {
                    (y / x).atan()
                } else if y.lower > 0.0 {
                    quarter - (x / y).atan()
                } else if y.upper < 0.0 {
                    -quarter - (x / y).atan()
                } else {
                    whole
                };
                if N < 2 {
                    return Self::in_range(value);
                }
                let rate = (x * left.0[1] - y * right.0[1]) / (x.square() + y.square());
                Self(array::from_fn(|order| match order {
                    0 => value,
                    1 => rate,
                    _ => Interval::WHOLE,
                }))
            }
        }
    }

    /// Its absolute value where its sign changes.
    fn absolute(self) -> Self {
        let reach = self.0.map(Interval::magnitude);
        Self(array::from_fn(|order| match order {
            0 => Interval { lower: 0.0, upper: reach[0] },
            1 => Interval { lower: -reach[1], upper: reach[1] },
            _ => Interval::WHOLE,
        }))
    }

    /// One of two, nobody knows which.
    fn either(self, other: Self) -> Self {
        if self == other {
            return self;
        }
        // Where it changes from one to the other, it may jump.
        Self(array::from_fn(|order| if order == 0 { self.0[0].join(other.0[0]) } else { Interval::WHOLE }))
    }
}

impl Tape {
    /// Ranges over a stretch of the motion in which its variables have these.
    pub fn enclose<const N: usize>(&self, variables: &[Enclosure<N>]) -> Enclosure<N> {
        self.enclose_part(&self.operations, variables)
    }

    /// Its largest absolute value, whatever its variables are; infinite where it has no bound.
    pub fn bound(&self) -> f64 {
        let Enclosure([value]) = self.enclose(&[Enclosure([Interval::WHOLE]); MOST_VARIABLES]);
        value.magnitude()
    }

    /// Whether a switch is below; `None` where it may change.
    fn is_below<const N: usize>(&self, switch: usize, variables: &[Enclosure<N>]) -> Option<bool> {
        let number = self.enclose_part(&self.switches[switch].operations, variables).0[0];
        if number.upper < 0.0 {
            Some(true)
        } else if number.lower >= 0.0 {
            Some(false)
        } else {
            None
        }
    }

    // Long because every operation has its line.
    fn enclose_part<const N: usize>(
        &self,
        operations: &[Operation],
        variables: &[Enclosure<N>],
    ) -> Enclosure<N> {
        let (mut waiting, mut top) = (Stack::new(Enclosure::constant(0.0)), Enclosure::constant(0.0));
        for &operation in operations {
            match operation {
                Operation::Constant(value) => {
                    waiting.push(top);
                    top = Enclosure::constant(value);
                }
                Operation::Variable(index) => {
                    waiting.push(top);
                    top = variables[index];
                }
                Operation::AddConstant(value) => top = top.plus(Enclosure::constant(value)),
                Operation::MultiplyByConstant(value) => top = Enclosure(top.0.map(|range| range * value)),
                Operation::DivideByConstant(value) => {
                    top = Enclosure(top.0.map(|range| range / Interval::point(value)));
                }
                Operation::AddVariable(index) => top = top.plus(variables[index]),
                Operation::SubtractVariable(index) => top = top.minus(variables[index]),
                Operation::MultiplyByVariable(index) => top = top.times(variables[index]),
                Operation::DivideByVariable(index) => top = top.over(variables[index]),
                Operation::Sum => top = waiting.pop().plus(top),
                Operation::Difference => top = waiting.pop().minus(top),
                Operation::Product => top = waiting.pop().times(top),
                Operation::Quotient => top = waiting.pop().over(top),
                Operation::Pair(binary) => top = Enclosure::pair(binary, waiting.pop(), top),
                Operation::Negative => top = top.negative(),
                Operation::Root => top = top.to_power(0.5),
                Operation::ThreeHalves => top = top.to_power(1.5),
                Operation::Square => top = top.squared(),
                Operation::Cube => top = top.to_power(3.0),
                Operation::PowerBy(exponent) => top = top.to_power(exponent),
                Operation::Function(function) => top = top.of(function),
                Operation::Choose(switch) => {
                    let below = waiting.pop();
                    top = match self.is_below(switch, variables) {
                        Some(true) => below,
                        Some(false) => top,
                        None => below.either(top),
                    };
                }
                Operation::Mirror(switch) => {
                    top = match self.is_below(switch, variables) {
                        Some(true) => top.negative(),
                        Some(false) => top,
                        None => top.absolute(),
                    };
                }
                Operation::Sign(switch) => {
                    waiting.push(top);
                    let signs = [-1.0, 1.0].map(Enclosure::constant);
                    top = match self.is_below(switch, variables) {
                        Some(below) => signs[usize::from(!below)],
                        None => signs[0].either(signs[1]),
                    };
                }
                Operation::Curve(switch) => {
                    top = match &self.switches[switch].at {
                        SwitchAt::Points(curve) => top.compose(curve.ranges(top.0[0])),
                        _ => Enclosure::unknown(),
                    };
                }
            }
        }
        top
    }
}

impl Curve {
    /// Ranges of the value and of its first three derivatives over an interval. Where it jumps they do not know.
    pub fn ranges(&self, x: Interval) -> [Interval; 4] {
        let [first, last] = self.ends();
        if self.repeats() {
            let width = x.upper - x.lower;
            if width.is_nan() || width >= self.span() {
                return self.ranges_within(Interval { lower: first, upper: last });
            }
            let shift = ((x.lower - first) / self.span()).floor() * self.span();
            let [lower, upper] = [x.lower - shift, x.upper - shift];
            let own = self.ranges_within(Interval { lower: lower.max(first), upper: upper.min(last) });
            if upper <= last {
                return own;
            }
            let next = self.ranges_within(Interval { lower: first, upper: upper - self.span() });
            return array::from_fn(|order| own[order].join(next[order]));
        }
        // Beyond its ends it holds its values, or the run has ended.
        let inside = Interval { lower: x.lower.clamp(first, last), upper: x.upper.clamp(first, last) };
        let own = self.ranges_within(inside);
        let is_beyond = x.lower < first || x.upper > last;
        array::from_fn(|order| {
            if order > 0 && is_beyond { own[order].join(Interval::point(0.0)) } else { own[order] }
        })
    }

    /// The same over an interval between its ends.
    fn ranges_within(&self, x: Interval) -> [Interval; 4] {
        let from = self.piece_of(x.lower);
        let to = self.piece_of(x.upper);
        let mut found: Option<[Interval; 4]> = None;
        for piece in from..=to {
            let [start, end] = [self.points[piece], self.points[piece + 1]];
            let over =
                Interval::between(x.lower.clamp(start, end) - start, x.upper.clamp(start, end) - start);
            let [_, c1, c2, c3] = self.pieces[piece];
            let at = |distance: f64| {
                let [c0, ..] = self.pieces[piece];
                ((c3 * distance + c2) * distance + c1) * distance + c0
            };
            let slope_at = |distance: f64| (3.0 * c3 * distance + 2.0 * c2) * distance + c1;
            let bend = Interval::between(2.0 * c2 + 6.0 * c3 * over.lower, 2.0 * c2 + 6.0 * c3 * over.upper);
            let turn = -c2 / (3.0 * c3);
            let mut slope = Interval::between(slope_at(over.lower), slope_at(over.upper));
            if over.holds(turn) {
                slope = slope.join(Interval::point(slope_at(turn)));
            }
            // Of a piece whose slope has one sign the ends are the extremes.
            let mut value = Interval::between(at(over.lower), at(over.upper));
            if slope.lower < 0.0 && slope.upper > 0.0 {
                let root = (c2 * c2 - 3.0 * c3 * c1).max(0.0).sqrt();
                let extremes = [(-c2 + root) / (3.0 * c3), (-c2 - root) / (3.0 * c3), -c1 / (2.0 * c2)];
                for place in extremes.into_iter().filter(|&place| over.holds(place)) {
                    value = value.join(Interval::point(at(place)));
                }
            }
            let own = [value, slope, bend, Interval::point(6.0 * c3)];
            found = Some(found.map_or(own, |known| array::from_fn(|order| known[order].join(own[order]))));
        }
        found.unwrap_or([Interval::WHOLE; 4])
    }
}
