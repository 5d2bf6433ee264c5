//! Expressions as straight lists of operations on a small stack, evaluated on numbers and on dual numbers.
//!
//! Where an expression changes its form, at the equality of two numbers or at a point of a table, stands a *switch*. Its
//! state is given from outside, as the phase of a contact is: between two events the expression is smooth.

use super::curve::Curve;
use super::functions::power_by;
use super::grammar::{Binary, Function, Switching, Syntax};
use crate::numerics::dual::{Dual, Scalar};
use crate::numerics::jet::{Jet, derivatives};

/// Numbers that wait during an evaluation. The nesting of an expression is limited, and its parts of one rank are
/// evaluated from the left, so that few wait. A power of two, so that an index needs no check.
const STACK: usize = 32;
/// Derivatives that one evaluation yields.
const LANES: usize = 4;
/// Most variables of an expression, so that their values need no memory of their own.
pub const MOST_VARIABLES: usize = 16;

/// A number that an operation takes: the one that waited last, or a leaf of the expression.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operand {
    Waiting,
    Constant(f64),
    Variable(usize),
}

/// An operation on the number on top. What is done with which number is one choice, since choices are what evaluation costs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operation {
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
    fn with(binary: Binary, operand: Operand) -> Option<Operation> {
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
    fn of_both(binary: Binary) -> Operation {
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
    operations: Vec<Operation>,
    /// The table whose pieces it tells apart; without one, whether the number is below zero.
    curve: Option<Curve>,
}

/// State of a switch that is below; otherwise it is 0. Of a table it is the piece.
const BELOW: i64 = 1;

/// How far the state of a switch lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Positive while it lasts.
    pub value: f64,
    /// Sign with which it grows with the number that the switch looks at.
    sign: f64,
}

/// A compiled expression.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tape {
    operations: Vec<Operation>,
    /// Where it changes its form.
    pub switches: Vec<Switch>,
}

impl Tape {
    /// Compiles an expression.
    ///
    /// # Errors
    /// If too many numbers must wait.
    pub fn new(
        syntax: &Syntax,
        constants: &[(String, f64)],
        variable: &mut dyn FnMut(&str) -> usize,
    ) -> Result<Tape, String> {
        let mut compiler = Compiler { tape: Tape::default(), constants, variable };
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
        self.switches.push(Switch { operations: self.operations.clone(), curve: Some(curve) });
        self.operations.push(Operation::Curve(switch));
        self
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
        let Switch { operations, curve } = &self.switches[switch];
        let number = self.run(operations, variables, states);
        match curve {
            Some(curve) => curve.piece(number),
            None => i64::from(number < 0.0) * BELOW,
        }
    }

    /// The state that follows where that of a switch ends.
    pub fn next_state(&self, switch: usize, variables: &[f64], states: &[i64]) -> i64 {
        let Switch { operations, curve } = &self.switches[switch];
        let state = states[switch];
        let Some(curve) = curve else { return BELOW - state };
        let [lower, upper] = curve.bounds(state);
        let x: f64 = self.run(operations, variables, states);
        if x - lower < upper - x { state - 1 } else { state + 1 }
    }

    /// Whether a switch is one of the formula, not the points of a table over it.
    pub fn is_of_formula(&self, switch: usize) -> bool {
        self.switches[switch].curve.is_none()
    }

    /// Whether a table has a value in the state of a switch.
    pub fn covers(&self, switch: usize, state: i64) -> bool {
        self.switches[switch].curve.as_ref().is_none_or(|curve| curve.covers(state))
    }

    /// The first table without a value in its state: the number it is looked up at, and its ends.
    pub fn outside(&self, variables: &[f64], states: &[i64]) -> Option<(f64, [f64; 2])> {
        let switches = self.switches.iter().zip(states);
        let tables = switches.filter_map(|(switch, &state)| Some((switch, switch.curve.as_ref()?, state)));
        let (switch, curve, _) = tables.into_iter().find(|(_, curve, state)| !curve.covers(*state))?;
        let number = self.run(&switch.operations, variables, states);
        Some((number, curve.ends()))
    }

    /// How far the state of a switch lasts.
    pub fn distance(&self, switch: usize, variables: &[f64], states: &[i64]) -> Distance {
        let Switch { operations, curve } = &self.switches[switch];
        let number: f64 = self.run(operations, variables, states);
        let Some(curve) = curve else {
            let sign = if states[switch] == BELOW { -1.0 } else { 1.0 };
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
        self.switches
            .iter()
            .filter_map(|switch| switch.curve.as_ref())
            .map(Curve::largest)
            .fold(0.0, f64::max)
    }

    /// The number on top after the operations.
    // Inlined for the two number types: a call of its own would hide the length of the stack.
    #[inline(always)]
    fn run<S: Scalar>(&self, operations: &[Operation], variables: &[S], states: &[i64]) -> S {
        let mut waiting = Stack { numbers: [S::constant(0.0); STACK], count: 0 };
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
                    top = S::constant(if states[switch] == BELOW { -1.0 } else { 1.0 });
                }
                Operation::Root => top = top.sqrt(),
                Operation::ThreeHalves => top = top.compose(derivatives::three_halves(top.value())),
                Operation::Square => top = top * top,
                Operation::Cube => top = top * top * top,
                Operation::Negative => top = -top,
                Operation::PowerBy(exponent) => top = power_by(top, exponent),
                Operation::Function(function) => top = function.of(top),
                Operation::Mirror(switch) => {
                    if states[switch] == BELOW {
                        top = -top;
                    }
                }
                Operation::Curve(switch) => {
                    if let Some(curve) = &self.switches[switch].curve {
                        top = curve.value(top, states[switch]);
                    }
                }
                Operation::Choose(switch) => {
                    let below = waiting.pop();
                    if states[switch] == BELOW {
                        top = below;
                    }
                }
            }
        }
        top
    }
}

/// The numbers that wait.
struct Stack<S> {
    numbers: [S; STACK],
    count: usize,
}

impl<S: Scalar> Stack<S> {
    #[inline(always)]
    fn push(&mut self, number: S) {
        self.numbers[self.count % STACK] = number;
        self.count += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> S {
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

struct Compiler<'a> {
    tape: Tape,
    constants: &'a [(String, f64)],
    variable: &'a mut dyn FnMut(&str) -> usize,
}

impl Compiler<'_> {
    fn add(&mut self, syntax: &Syntax) {
        match (self.operand(syntax), syntax) {
            (Operand::Waiting, Syntax::Negative(inner)) => {
                self.add(inner);
                self.push(Operation::Negative);
            }
            (Operand::Waiting, Syntax::Call(function, inner)) => {
                self.add(inner);
                self.push(Operation::Function(*function));
            }
            (Operand::Waiting, Syntax::Binary(operation, pair)) => {
                self.add(&pair[0]);
                let operand = self.operand(&pair[1]);
                if let Some(operation) = Operation::with(*operation, operand) {
                    return self.push(operation);
                }
                self.add(&pair[1]);
                self.push(Operation::of_both(*operation));
            }
            (Operand::Waiting, Syntax::Switch(switching, arguments)) => {
                self.add_switch(*switching, arguments)
            }
            (Operand::Constant(value), _) => self.push(Operation::Constant(value)),
            (Operand::Variable(index), _) => self.push(Operation::Variable(index)),
            (Operand::Waiting, Syntax::Number(_) | Syntax::Name(..)) => {}
        }
    }

    fn push(&mut self, operation: Operation) {
        self.tape.operations.push(operation);
    }

    /// A part as an operand: a leaf, or what its operations leave.
    fn operand(&mut self, syntax: &Syntax) -> Operand {
        if let Some(value) = self.constant(syntax) {
            return Operand::Constant(value);
        }
        match syntax {
            Syntax::Name(name, _) => Operand::Variable((self.variable)(name)),
            _ => Operand::Waiting,
        }
    }

    /// The operations of a part, which are not left on the tape.
    fn apart(&mut self, syntax: &Syntax) -> Vec<Operation> {
        let start = self.tape.operations.len();
        self.add(syntax);
        self.tape.operations.split_off(start)
    }

    /// A switch that is below where a number is below zero.
    fn switch(&mut self, operations: Vec<Operation>) -> usize {
        self.tape.switches.push(Switch { operations, curve: None });
        self.tape.switches.len() - 1
    }

    /// A switch that is below where the first number is below the second.
    fn comparison(&mut self, first: &[Operation], second: &[Operation]) -> usize {
        let difference = [Operation::Difference];
        self.switch([first, second, &difference].concat())
    }

    fn add_switch(&mut self, switching: Switching, arguments: &[Syntax]) {
        let mut parts: Vec<Vec<Operation>> = arguments.iter().map(|argument| self.apart(argument)).collect();
        let first = parts.remove(0);
        match switching {
            Switching::Sign => {
                let switch = self.switch(first);
                self.push(Operation::Sign(switch));
            }
            Switching::Abs => {
                let switch = self.switch(first.clone());
                self.tape.operations.extend(first);
                self.push(Operation::Mirror(switch));
            }
            Switching::If => {
                let switch = self.comparison(&first, &parts[0]);
                self.tape.operations.extend(parts.drain(1..).flatten());
                self.push(Operation::Choose(switch));
            }
            Switching::Min | Switching::Max => {
                let chosen = parts.into_iter().fold(first, |chosen, other| {
                    let switch = match switching {
                        Switching::Min => self.comparison(&chosen, &other),
                        _ => self.comparison(&other, &chosen),
                    };
                    [chosen, other, vec![Operation::Choose(switch)]].concat()
                });
                self.tape.operations.extend(chosen);
            }
        }
    }

    /// The value of a part without variables. What switches is left to the switches.
    fn constant(&self, syntax: &Syntax) -> Option<f64> {
        Some(match syntax {
            Syntax::Number(value) => *value,
            Syntax::Name(name, _) => {
                return self.constants.iter().find(|(known, _)| known == name).map(|&(_, value)| value);
            }
            Syntax::Negative(inner) => -self.constant(inner)?,
            Syntax::Call(function, inner) => function.of(self.constant(inner)?),
            Syntax::Binary(operation, pair) => {
                let (left, right) = (self.constant(&pair[0])?, self.constant(&pair[1])?);
                match operation {
                    Binary::Power => left.powf(right),
                    _ => operation.of(left, right),
                }
            }
            Syntax::Switch(..) => return None,
        })
    }
}
