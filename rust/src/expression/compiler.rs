//! Compiles the syntax of an expression to the operations and switches of a tape.

use super::domain::{Domain, domain_left};
use super::grammar::{Binary, Switching, Syntax};
use super::tape::{Operand, Operation, Ranges, Switch, SwitchAt, Tape};
use crate::numerics::dual::Scalar;
use crate::numerics::jet::Jet;

/// A compilation in progress.
pub(super) struct Compiler<'a> {
    pub(super) tape: Tape,
    pub(super) constants: &'a [(String, f64)],
    pub(super) variable: &'a mut dyn FnMut(&str) -> usize,
    /// Least and largest value of a variable, if the ends of domains are watched.
    pub(super) range: Option<Ranges<'a>>,
    /// The choices that lead to what is compiled.
    pub(super) choices: Vec<(usize, bool)>,
}

impl Compiler<'_> {
    /// Adds the operations of a part.
    pub(super) fn add(&mut self, syntax: &Syntax) {
        match (self.operand(syntax), syntax) {
            (Operand::Waiting, Syntax::Negative(inner)) => {
                self.add(inner);
                self.push(Operation::Negative);
            }
            (Operand::Waiting, Syntax::Call(function, inner)) => {
                let start = self.tape.operations.len();
                self.add(inner);
                self.watch_domain(syntax, start);
                self.push(Operation::Function(*function));
            }
            (Operand::Waiting, Syntax::Binary(operation, pair)) => {
                let start = self.tape.operations.len();
                self.add(&pair[0]);
                self.watch_domain(syntax, start);
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

    /// Watches the domain of the outermost function of a part, whose argument the operations from `start` on leave,
    /// unless that cannot leave it.
    fn watch_domain(&mut self, syntax: &Syntax, start: usize) {
        let Some(range) = self.range else { return };
        let Some(domain) = domain_left(syntax, &|name| {
            let constant = self.constants.iter().find(|(known, _)| known == name);
            constant.map_or_else(|| range(name), |&(_, value)| [value; 2])
        }) else {
            return;
        };
        let mut operations = self.tape.operations[start..].to_vec();
        if domain == Domain::WithinOne {
            operations.extend([Operation::Square, Operation::Negative, Operation::AddConstant(1.0)]);
        }
        self.switch(operations, SwitchAt::EndOfDomain);
    }

    /// A switch over the number that operations leave: the one that is there, if there is one.
    fn switch(&mut self, operations: Vec<Operation>, at: SwitchAt) -> usize {
        // The others keep their states up to date wherever the motion is.
        let choices = if at == SwitchAt::EndOfDomain { self.choices.clone() } else { Vec::new() };
        let switch = Switch { operations, at, choices };
        let known = self.tape.switches.iter().position(|other| *other == switch);
        known.unwrap_or_else(|| {
            self.tape.switches.push(switch);
            self.tape.switches.len() - 1
        })
    }

    /// A choice of one of two parts where the first number is below the second, else of the other.
    fn choose(&mut self, [first, second]: [&[Operation]; 2], [below, otherwise]: [Vec<Operation>; 2]) {
        let (switch, is_swapped) = self.comparison(first, second);
        let parts = if is_swapped { [otherwise, below] } else { [below, otherwise] };
        self.tape.operations.extend(parts.concat());
        self.push(Operation::Choose(switch));
    }

    /// A switch that is below where the first number is below the second, or, as the other value then says, where it is
    /// above: that of a number and zero is the same however it is written.
    fn comparison(&mut self, first: &[Operation], second: &[Operation]) -> (usize, bool) {
        const ZERO: [Operation; 1] = [Operation::Constant(0.0)];
        let (number, is_swapped) = match (first, second) {
            (number, second) if *second == ZERO => (number.to_vec(), false),
            (first, number) if *first == ZERO => (number.to_vec(), true),
            _ => ([first, second, &[Operation::Difference]].concat(), false),
        };
        (self.switch(number, SwitchAt::Zero), is_swapped)
    }

    /// The operations of a part that is evaluated where a switch is below, or is not.
    fn chosen(&mut self, syntax: &Syntax, switch: usize, is_below: bool) -> Vec<Operation> {
        self.choices.push((switch, is_below));
        let operations = self.apart(syntax);
        self.choices.pop();
        operations
    }

    fn add_switch(&mut self, switching: Switching, arguments: &[Syntax]) {
        if let (Switching::If, [first, second, below, otherwise]) = (switching, arguments) {
            let [first, second] = [first, second].map(|argument| self.apart(argument));
            let (switch, is_swapped) = self.comparison(&first, &second);
            let below = self.chosen(below, switch, !is_swapped);
            let otherwise = self.chosen(otherwise, switch, is_swapped);
            return self.choose([&first, &second], [below, otherwise]);
        }
        let mut parts: Vec<Vec<Operation>> = arguments.iter().map(|argument| self.apart(argument)).collect();
        let first = parts.remove(0);
        match switching {
            Switching::Sign => {
                let switch = self.switch(first, SwitchAt::Zero);
                self.push(Operation::Sign(switch));
            }
            Switching::Abs => {
                let switch = self.switch(first.clone(), SwitchAt::Zero);
                self.tape.operations.extend(first);
                self.push(Operation::Mirror(switch));
            }
            Switching::Min | Switching::Max | Switching::If => {
                let chosen = parts.into_iter().fold(first, |chosen, other| {
                    let start = self.tape.operations.len();
                    let [first, second] = match switching {
                        Switching::Min => [&chosen, &other],
                        _ => [&other, &chosen],
                    };
                    self.choose([first, second], [chosen.clone(), other.clone()]);
                    self.tape.operations.split_off(start)
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
            // On a number whose functions end with their domains.
            Syntax::Call(function, inner) => function.of(Jet::constant(self.constant(inner)?)).value(),
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
