//! Expressions as straight lists of operations on a small stack, evaluated on numbers and on dual numbers.
//!
//! Where an expression changes its form, at the equality of two numbers or at a point of a table, stands a *switch*. Its
//! state is given from outside, as the phase of a contact is: between two events the expression is smooth. So it is
//! evaluated a little beyond a switch, where the number under a root may be negative: functions are continued beyond their
//! domains. Where the motion itself leaves a domain stands a switch too, unless the number cannot leave it.

use super::compiler::Compiler;
use super::curve::Curve;
use super::functions::{power_by, root, three_halves};
use super::grammar::{Binary, Function, Syntax};
use crate::numerics::accuracy::ROUNDING;
use crate::numerics::dual::{Dual, Scalar};
use crate::numerics::jet::Jet;

/// Numbers that wait during an evaluation. The nesting of an expression is limited, and its parts of one rank are
/// evaluated from the left, so that few wait. A power of two, so that an index needs no check.
const STACK: usize = 32;
/// Derivatives that one evaluation yields.
const LANES: usize = 4;
/// Most variables of an expression, so that their values need no memory of their own.
pub const MOST_VARIABLES: usize = 16;

/// A number that an operation takes: the one that waited last, or a leaf of the expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operand {
    Waiting,
    Constant(f64),
    Variable(usize),
}

/// An operation on the number on top. What is done with which number is one choice, since choices are what evaluation costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operation {
    /// Lets the number on top wait, and puts a leaf in its place.
    Constant(f64),
    Variable(usize),
    /// With a leaf.
    AddConstant(f64),
    MultiplyByConstant(f64),
    DivideByConstant(f64),
    AddVariable(usize),
    SubtractVariable(usize),
    MultiplyByVariable(usize),
    DivideByVariable(usize),
    /// Of the number that waited and that on top.
    Sum,
    Difference,
    Product,
    Quotient,
    Pair(Binary),
    Negative,
    Root,
    /// The number times its root.
    ThreeHalves,
    Square,
    Cube,
    /// Power with a constant exponent.
    PowerBy(f64),
    Function(Function),
    /// The number that waited where the switch is below, else the one on top.
    Choose(usize),
    /// The negative of the number on top where the switch is below.
    Mirror(usize),
    /// Lets the number on top wait, and puts -1 in its place where the switch is below, else 1.
    Sign(usize),
    /// The table of the switch at the number on top.
    Curve(usize),
}

impl Operation {
    /// What is done with an operand, if there is an operation for it.
    pub(super) fn with(binary: Binary, operand: Operand) -> Option<Operation> {
        Some(match (binary, operand) {
            (Binary::Add, Operand::Constant(value)) => Operation::AddConstant(value),
            (Binary::Subtract, Operand::Constant(value)) => Operation::AddConstant(-value),
            (Binary::Multiply, Operand::Constant(value)) => Operation::MultiplyByConstant(value),
            (Binary::Divide, Operand::Constant(value)) => Operation::DivideByConstant(value),
            (Binary::Add, Operand::Variable(index)) => Operation::AddVariable(index),
            (Binary::Subtract, Operand::Variable(index)) => Operation::SubtractVariable(index),
            (Binary::Multiply, Operand::Variable(index)) => Operation::MultiplyByVariable(index),
            (Binary::Divide, Operand::Variable(index)) => Operation::DivideByVariable(index),
            (Binary::Power, Operand::Constant(0.5)) => Operation::Root,
            (Binary::Power, Operand::Constant(1.5)) => Operation::ThreeHalves,
            (Binary::Power, Operand::Constant(2.0)) => Operation::Square,
            (Binary::Power, Operand::Constant(3.0)) => Operation::Cube,
            (Binary::Power, Operand::Constant(exponent)) => Operation::PowerBy(exponent),
            (Binary::Power | Binary::Atan2 | Binary::Hypot, _) | (_, Operand::Waiting) => return None,
        })
    }

    /// What is done with the number that waited and that on top.
    pub(super) fn of_both(binary: Binary) -> Operation {
        match binary {
            Binary::Add => Operation::Sum,
            Binary::Subtract => Operation::Difference,
            Binary::Multiply => Operation::Product,
            Binary::Divide => Operation::Quotient,
            Binary::Power | Binary::Atan2 | Binary::Hypot => Operation::Pair(binary),
        }
    }
}

/// Where an expression changes its form.
#[derive(Clone, Debug, PartialEq)]
pub struct Switch {
    pub(super) operations: Vec<Operation>,
    pub(super) at: SwitchAt,
    /// The choices that lead to the end of a domain, as switches and whether they are below: it acts where all of them hold.
    pub(super) choices: Vec<(usize, bool)>,
}

/// Where a switch changes its state.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SwitchAt {
    /// Where the number is zero.
    Zero,
    /// At the points of a table.
    Points(Curve),
    /// Nowhere: where the number is below zero the expression leaves the domain of a function.
    EndOfDomain,
}

impl Switch {
    fn curve(&self) -> Option<&Curve> {
        match &self.at {
            SwitchAt::Points(curve) => Some(curve),
            _ => None,
        }
    }

    fn acts(&self, states: &[i64]) -> bool {
        self.choices.iter().all(|&(switch, below)| is_below(states[switch]) == below)
    }
}

/// State of a switch that is below; otherwise it is 0. Of a table it is the piece.
const BELOW: i64 = 1;
/// Added to the state where the number rests at zero: then a form holds until the number is clearly beyond.
const RESTS: i64 = 2;

fn is_below(state: i64) -> bool {
    state & BELOW != 0
}

/// How far the state of a switch lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Positive while it lasts.
    pub value: f64,
    /// Sign with which it grows with the number that the switch looks at.
    sign: f64,
}

/// Least and largest values of variables by their names.
pub type Ranges<'a> = &'a dyn Fn(&str) -> [f64; 2];

/// A compiled expression.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tape {
    pub(super) operations: Vec<Operation>,
    /// Where it changes its form.
    pub switches: Vec<Switch>,
}

impl Tape {
    /// Compiles an expression; `range` gives the least and the largest value of a variable where domains are watched.
    ///
    /// # Errors
    /// If too many numbers must wait.
    pub fn new(
        syntax: &Syntax,
        constants: &[(String, f64)],
        variable: &mut dyn FnMut(&str) -> usize,
        range: Option<Ranges<'_>>,
    ) -> Result<Tape, String> {
        let mut compiler =
            Compiler { tape: Tape::default(), constants, variable, range, choices: Vec::new() };
        compiler.add(syntax);
        let Compiler { tape, .. } = compiler;
        let deepest = tape.switches.iter().map(|switch| depth(&switch.operations)).max();
        if depth(&tape.operations).max(deepest.unwrap_or(0)) > STACK {
            return Err(format!("keeps more than {STACK} numbers waiting: name parts of it as parameters"));
        }
        Ok(tape)
    }

    /// A table over an expression.
    #[must_use]
    pub fn of_curve(mut self, curve: Curve) -> Tape {
        let switch = self.switches.len();
        let (operations, at) = (self.operations.clone(), SwitchAt::Points(curve));
        self.switches.push(Switch { operations, at, choices: Vec::new() });
        self.operations.push(Operation::Curve(switch));
        self
    }

    /// The same for runs of a relative tolerance, see [`Curve::for_tolerance`]; `None` if it does not change.
    pub(crate) fn for_tolerance(&self, rtol: f64) -> Option<Tape> {
        let mut other = None;
        for (index, switch) in self.switches.iter().enumerate() {
            if let Some(curve) = switch.curve().and_then(|curve| curve.for_tolerance(rtol)) {
                other.get_or_insert_with(|| self.clone()).switches[index].at = SwitchAt::Points(curve);
            }
        }
        other
    }

    /// Its value.
    #[inline(always)]
    pub fn value<S: Scalar>(&self, variables: &[S], states: &[i64]) -> S {
        self.run(&self.operations, variables, states)
    }

    /// Its derivative with respect to every variable.
    pub fn gradient(&self, variables: &[f64], states: &[i64]) -> [f64; MOST_VARIABLES] {
        gradient_of(variables, |variables| self.value(variables, states))
    }

    /// Its value and first three derivatives, where its only variable is the time and it has no switches.
    pub fn of_time(&self, t: f64) -> [f64; 4] {
        self.value(&[Jet::variable(t)], &[]).0
    }

    /// The state of a switch.
    pub fn state(&self, switch: usize, variables: &[f64], states: &[i64]) -> i64 {
        let number = self.number(switch, variables, states);
        match &self.switches[switch].at {
            SwitchAt::Points(curve) => curve.stretch(number),
            SwitchAt::Zero => i64::from(number < 0.0) * BELOW,
            SwitchAt::EndOfDomain => 0,
        }
    }

    /// The number that a switch looks at.
    fn number(&self, switch: usize, variables: &[f64], states: &[i64]) -> f64 {
        self.run(&self.switches[switch].operations, variables, states)
    }

    /// The state that follows where that of a switch ends.
    pub fn next_state(&self, switch: usize, variables: &[f64], states: &[i64]) -> i64 {
        let state = states[switch];
        let Some(curve) = self.switches[switch].curve() else { return i64::from(!is_below(state)) };
        let [lower, upper] = curve.bounds(state);
        let x = self.number(switch, variables, states);
        if x - lower < upper - x { state - 1 } else { state + 1 }
    }

    /// A state of a switch as the one whose number rests at zero; `None` where it did already, or of a table.
    pub fn resting(&self, switch: usize, state: i64) -> Option<i64> {
        (self.is_of_formula(switch) && state & RESTS == 0).then_some(state | RESTS)
    }

    /// Whether the number of a switch rests at zero.
    pub fn rests(&self, switch: usize, states: &[i64]) -> bool {
        self.is_of_formula(switch) && states[switch] & RESTS != 0
    }

    /// Whether a switch is one of the formula, not the points of a table over it.
    pub fn is_of_formula(&self, switch: usize) -> bool {
        self.switches[switch].curve().is_none()
    }

    /// Whether a switch is the end of the domain of a function.
    pub fn is_end_of_domain(&self, switch: usize) -> bool {
        self.switches[switch].at == SwitchAt::EndOfDomain
    }

    /// Whether it has a value at these variables: no function in it is asked for outside its domain, but for rounding
    /// errors.
    pub fn has_value(&self, variables: &[f64], states: &[i64]) -> bool {
        (0..self.switches.len()).filter(|&switch| self.is_end_of_domain(switch)).all(|switch| {
            let gradient = self.distance_gradient(switch, variables, states);
            let size: f64 = variables.iter().zip(gradient).map(|(value, slope)| (value * slope).abs()).sum();
            self.distance(switch, variables, states).value >= -ROUNDING * size
        })
    }

    /// Whether a table has a value in the state of a switch.
    pub fn covers(&self, switch: usize, state: i64) -> bool {
        self.switches[switch].curve().is_none_or(|curve| curve.covers(state))
    }

    /// The first table without a value in its state: the number it is looked up at, and its ends.
    pub fn outside(&self, variables: &[f64], states: &[i64]) -> Option<(f64, [f64; 2])> {
        let switches = self.switches.iter().zip(states);
        let tables = switches.filter_map(|(switch, &state)| Some((switch, switch.curve()?, state)));
        let (switch, curve, _) = tables.into_iter().find(|(_, curve, state)| !curve.covers(*state))?;
        let number = self.run(&switch.operations, variables, states);
        Some((number, curve.ends()))
    }

    /// How far the state of a switch lasts.
    pub fn distance(&self, switch: usize, variables: &[f64], states: &[i64]) -> Distance {
        if !self.switches[switch].acts(states) {
            return Distance { value: f64::INFINITY, sign: 0.0 };
        }
        let number = self.number(switch, variables, states);
        let Some(curve) = self.switches[switch].curve() else {
            let sign = if is_below(states[switch]) { -1.0 } else { 1.0 };
            return Distance { value: sign * number, sign };
        };
        let [lower, upper] = curve.bounds(states[switch]);
        let (below, above) = (number - lower, upper - number);
        if below < above {
            Distance { value: below, sign: 1.0 }
        } else {
            Distance { value: above, sign: -1.0 }
        }
    }

    /// Derivatives of the distance of a switch with respect to every variable.
    pub fn distance_gradient(
        &self,
        switch: usize,
        variables: &[f64],
        states: &[i64],
    ) -> [f64; MOST_VARIABLES] {
        let Distance { sign, .. } = self.distance(switch, variables, states);
        let operations = &self.switches[switch].operations;
        let gradient = gradient_of(variables, |variables| self.run(operations, variables, states));
        gradient.map(|derivative| sign * derivative)
    }

    /// Largest absolute value of its tables.
    pub fn largest(&self) -> f64 {
        self.switches.iter().filter_map(Switch::curve).map(Curve::largest).fold(0.0, f64::max)
    }

    /// The number on top after the operations.
    // Inlined for the two number types: a call of its own would hide the length of the stack.
    #[inline(always)]
    fn run<S: Scalar>(&self, operations: &[Operation], variables: &[S], states: &[i64]) -> S {
        let mut waiting = Stack::new(S::constant(0.0));
        let mut top = S::constant(0.0);
        for &operation in operations {
            match operation {
                Operation::Constant(value) => {
                    waiting.push(top);
                    top = S::constant(value);
                }
                Operation::Variable(index) => {
                    waiting.push(top);
                    top = variables[index];
                }
                Operation::AddConstant(value) => top = top + value,
                Operation::MultiplyByConstant(value) => top = top * value,
                Operation::DivideByConstant(value) => top = top / S::constant(value),
                Operation::AddVariable(index) => top = top + variables[index],
                Operation::SubtractVariable(index) => top = top - variables[index],
                Operation::MultiplyByVariable(index) => top = top * variables[index],
                Operation::DivideByVariable(index) => top = top / variables[index],
                Operation::Sum => top = waiting.pop() + top,
                Operation::Difference => top = waiting.pop() - top,
                Operation::Product => top = waiting.pop() * top,
                Operation::Quotient => top = waiting.pop() / top,
                Operation::Pair(binary) => top = binary.of(waiting.pop(), top),
                Operation::Sign(switch) => {
                    waiting.push(top);
                    top = S::constant(if is_below(states[switch]) { -1.0 } else { 1.0 });
                }
                Operation::Root => top = root(top),
                Operation::ThreeHalves => top = three_halves(top),
                Operation::Square => top = top * top,
                Operation::Cube => top = top * top * top,
                Operation::Negative => top = -top,
                Operation::PowerBy(exponent) => top = power_by(top, exponent),
                Operation::Function(function) => top = function.of(top),
                Operation::Mirror(switch) => {
                    if is_below(states[switch]) {
                        top = -top;
                    }
                }
                Operation::Curve(switch) => {
                    if let Some(curve) = self.switches[switch].curve() {
                        top = curve.value(top, states[switch]);
                    }
                }
                Operation::Choose(switch) => {
                    let below = waiting.pop();
                    if is_below(states[switch]) {
                        top = below;
                    }
                }
            }
        }
        top
    }
}

/// The numbers that wait.
pub(super) struct Stack<S> {
    numbers: [S; STACK],
    count: usize,
}

impl<S: Copy> Stack<S> {
    #[inline(always)]
    pub(super) fn new(number: S) -> Self {
        Self { numbers: [number; STACK], count: 0 }
    }

    #[inline(always)]
    pub(super) fn push(&mut self, number: S) {
        self.numbers[self.count % STACK] = number;
        self.count += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> S {
        self.count -= 1;
        self.numbers[self.count % STACK]
    }
}

/// Derivatives of a function of the variables, a few at a time.
fn gradient_of(variables: &[f64], function: impl Fn(&[Dual<LANES>]) -> Dual<LANES>) -> [f64; MOST_VARIABLES] {
    let mut gradient = [0.0; MOST_VARIABLES];
    let mut inputs = [Dual::constant(0.0); MOST_VARIABLES];
    let count = variables.len();
    for (input, &value) in inputs.iter_mut().zip(variables) {
        *input = Dual::constant(value);
    }
    for first in (0..count).step_by(LANES) {
        let last = (first + LANES).min(count);
        for place in first..last {
            inputs[place] = Dual::input(variables[place], place - first);
        }
        gradient[first..last].copy_from_slice(&function(&inputs[..count]).gradient[..last - first]);
        for place in first..last {
            inputs[place] = Dual::constant(variables[place]);
        }
    }
    gradient
}

/// Most numbers that wait at once.
fn depth(operations: &[Operation]) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    for operation in operations {
        match operation {
            Operation::Constant(_) | Operation::Variable(_) | Operation::Sign(_) => depth += 1,
            Operation::Sum
            | Operation::Difference
            | Operation::Product
            | Operation::Quotient
            | Operation::Pair(_)
            | Operation::Choose(_) => depth -= 1,
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    deepest
}
