//! Reads the text of an expression into a syntax tree: numbers, names, `+ - * / **`, parentheses, functions, and
//! `if(a < b, x, y)`. The language is that of the parameters of scene files, with `if`, `sign` and `tanh` besides.

use std::f64::consts::PI;
use std::iter::once;

use crate::error::meant_or_known;

/// Most characters of an expression, and how deep it may be nested: hostile texts should cost neither time nor stack.
const MOST_CHARACTERS: usize = 1000;
/// Half and twice change nothing in the scenes of the tests.
const MOST_DEPTH: usize = 40;

/// A smooth function of one argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Function {
    /// Inverse cosine.
    Acos,
    /// Inverse sine.
    Asin,
    /// Inverse tangent.
    Atan,
    /// Cosine.
    Cos,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Log,
    /// Sine.
    Sin,
    /// Square root.
    Sqrt,
    /// Tangent.
    Tan,
    /// Hyperbolic tangent.
    Tanh,
}

/// An operation on two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Binary {
    /// Sum.
    Add,
    /// Difference.
    Subtract,
    /// Product.
    Multiply,
    /// Quotient.
    Divide,
    /// Power.
    Power,
    /// Angle of the vector (second, first).
    Atan2,
    /// Length of the vector of both.
    Hypot,
}

/// A function that changes its form where two numbers are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Switching {
    /// Absolute value of one argument.
    Abs,
    /// -1 below zero, else 1.
    Sign,
    /// The smallest argument.
    Min,
    /// The largest argument.
    Max,
    /// Of four arguments the third where the first is below the second, else the fourth.
    If,
}

#[derive(Clone, Copy)]
enum Callable {
    Smooth(Function),
    Pair(Binary),
    Switching(Switching),
}

const FUNCTIONS: [(&str, Callable); 17] = [
    ("abs", Callable::Switching(Switching::Abs)),
    ("acos", Callable::Smooth(Function::Acos)),
    ("asin", Callable::Smooth(Function::Asin)),
    ("atan", Callable::Smooth(Function::Atan)),
    ("atan2", Callable::Pair(Binary::Atan2)),
    ("cos", Callable::Smooth(Function::Cos)),
    ("exp", Callable::Smooth(Function::Exp)),
    ("hypot", Callable::Pair(Binary::Hypot)),
    ("if", Callable::Switching(Switching::If)),
    ("log", Callable::Smooth(Function::Log)),
    ("max", Callable::Switching(Switching::Max)),
    ("min", Callable::Switching(Switching::Min)),
    ("sign", Callable::Switching(Switching::Sign)),
    ("sin", Callable::Smooth(Function::Sin)),
    ("sqrt", Callable::Smooth(Function::Sqrt)),
    ("tan", Callable::Smooth(Function::Tan)),
    ("tanh", Callable::Smooth(Function::Tanh)),
];

/// A part of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Syntax {
    /// A number.
    Number(f64),
    /// A name, and how many characters stand before it.
    Name(String, usize),
    /// The negative of a part.
    Negative(Box<Syntax>),
    /// Two parts and what is done with them.
    Binary(Binary, Box<[Syntax; 2]>),
    /// A smooth function of a part.
    Call(Function, Box<Syntax>),
    /// A function that switches.
    Switch(Switching, Vec<Syntax>),
}

/// What is wrong with a text, and how many characters stand before the place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// What is wrong and what would be accepted.
    pub message: String,
    /// Characters before it.
    pub place: usize,
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    /// `+ - * / ( ) , < >`, and `**` as `^`, `<=` and `>=` as `<` and `>`: where two numbers are equal to rounding
    /// decides between them.
    Sign(char),
    End,
}

/// Reads an expression.
///
/// # Errors
/// The first mistake.
pub fn parse(text: &str) -> Result<Syntax, Mistake> {
    let count = text.chars().count();
    if count > MOST_CHARACTERS {
        let message = format!("has {count} characters; at most {MOST_CHARACTERS} are accepted");
        return Err(Mistake { message, place: 0 });
    }
    let mut reader = Reader { tokens: tokens(text)?, next: 0, depth: 0 };
    let syntax = reader.sum()?;
    match reader.peek() {
        Token::End => Ok(syntax),
        Token::Sign('<' | '>') => Err(reader.mistake("compares outside of if(a < b, x, y)")),
        _ => Err(reader.mistake("goes on where an operator or the end is expected")),
    }
}

fn is_of_name(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

fn tokens(text: &str) -> Result<Vec<(Token, usize)>, Mistake> {
    let letters: Vec<char> = text.chars().collect();
    let mut tokens = Vec::new();
    let mut place = 0;
    while let Some(&letter) = letters.get(place) {
        let start = place;
        let following = letters.get(place + 1).copied();
        let token = match letter {
            ' ' | '\t' | '\n' => {
                place += 1;
                continue;
            }
            '*' if following == Some('*') => {
                place += 1;
                Token::Sign('^')
            }
            '<' | '>' if following == Some('=') => {
                place += 1;
                Token::Sign(letter)
            }
            '+' | '-' | '*' | '/' | '(' | ')' | ',' | '<' | '>' => Token::Sign(letter),
            '0'..='9' | '.' => {
                place = end_of_number(&letters, place);
                let number: String = letters[start..place].iter().collect();
                place -= 1;
                match number.parse::<f64>() {
                    Ok(value) if value.is_finite() => Token::Number(value),
                    _ => {
                        return Err(Mistake {
                            message: format!("holds {number:?}, which is no finite number"),
                            place: start,
                        });
                    }
                }
            }
            _ if letter.is_alphabetic() || letter == '_' => {
                // A dot between two names belongs to the name: `coupler.C.x`.
                while letters.get(place + 1).is_some_and(|&next| {
                    is_of_name(next) || next == '.' && letters.get(place + 2).copied().is_some_and(is_of_name)
                }) {
                    place += 1;
                }
                Token::Name(letters[start..=place].iter().collect())
            }
            _ => {
                let power = if letter == '^' { "; a power is written **" } else { "" };
                let message = format!("{letter:?} is not accepted{power}");
                return Err(Mistake { message, place: start });
            }
        };
        tokens.push((token, start));
        place += 1;
    }
    tokens.push((Token::End, letters.len()));
    Ok(tokens)
}

/// Where the digits of a number end, its exponent included.
fn end_of_number(letters: &[char], mut place: usize) -> usize {
    let digit = |place: usize| letters.get(place).is_some_and(char::is_ascii_digit);
    while digit(place) || letters.get(place) == Some(&'.') {
        place += 1;
    }
    if matches!(letters.get(place), Some('e' | 'E')) {
        let signed = usize::from(matches!(letters.get(place + 1), Some('+' | '-')));
        if digit(place + 1 + signed) {
            place += 1 + signed;
            while digit(place) {
                place += 1;
            }
        }
    }
    place
}

struct Reader {
    tokens: Vec<(Token, usize)>,
    next: usize,
    depth: usize,
}

impl Reader {
    fn peek(&self) -> &Token {
        &self.tokens[self.next].0
    }

    fn take(&mut self) -> (Token, usize) {
        let token = self.tokens[self.next].clone();
        // The last one is the end, which is never passed.
        self.next = (self.next + 1).min(self.tokens.len() - 1);
        token
    }

    fn takes(&mut self, sign: char) -> bool {
        let found = *self.peek() == Token::Sign(sign);
        if found {
            self.take();
        }
        found
    }

    fn mistake(&self, message: impl Into<String>) -> Mistake {
        Mistake { message: message.into(), place: self.tokens[self.next].1 }
    }

    fn expect(&mut self, sign: char) -> Result<(), Mistake> {
        if self.takes(sign) { Ok(()) } else { Err(self.mistake(format!("must go on with {sign:?}"))) }
    }

    fn nested(&mut self, read: impl FnOnce(&mut Self) -> Result<Syntax, Mistake>) -> Result<Syntax, Mistake> {
        if self.depth == MOST_DEPTH {
            return Err(self.mistake(format!("is nested more than {MOST_DEPTH} deep")));
        }
        self.depth += 1;
        let syntax = read(self);
        self.depth -= 1;
        syntax
    }

    fn sum(&mut self) -> Result<Syntax, Mistake> {
        self.nested(|this| {
            let signs = [('+', Binary::Add), ('-', Binary::Subtract)];
            this.chain(&signs, |this| {
                this.chain(&[('*', Binary::Multiply), ('/', Binary::Divide)], Self::signed)
            })
        })
    }

    /// Operations of one rank, from the left.
    fn chain(
        &mut self,
        signs: &[(char, Binary)],
        read: impl Fn(&mut Self) -> Result<Syntax, Mistake>,
    ) -> Result<Syntax, Mistake> {
        let mut left = read(self)?;
        while let Some(&(_, operation)) = signs.iter().find(|(sign, _)| *self.peek() == Token::Sign(*sign)) {
            self.take();
            left = Syntax::Binary(operation, Box::new([left, read(self)?]));
        }
        Ok(left)
    }

    /// A sign binds less than a power: -x**2 is -(x**2).
    fn signed(&mut self) -> Result<Syntax, Mistake> {
        self.nested(|this| {
            if this.takes('-') {
                return Ok(Syntax::Negative(Box::new(this.signed()?)));
            }
            if this.takes('+') { this.signed() } else { this.power() }
        })
    }

    fn power(&mut self) -> Result<Syntax, Mistake> {
        let base = self.atom()?;
        if self.takes('^') {
            return Ok(Syntax::Binary(Binary::Power, Box::new([base, self.signed()?])));
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result<Syntax, Mistake> {
        let here = self.next;
        match self.take() {
            (Token::Number(value), _) => Ok(Syntax::Number(value)),
            (Token::Name(name), place) if *self.peek() == Token::Sign('(') => self.call(&name, place),
            (Token::Name(name), _) if name == "pi" => Ok(Syntax::Number(PI)),
            (Token::Name(name), place) => Ok(Syntax::Name(name, place)),
            (Token::Sign('('), _) => {
                let inner = self.sum()?;
                self.expect(')')?;
                Ok(inner)
            }
            (token, _) => {
                self.next = here;
                let ends = if token == Token::End { "ends too early: " } else { "" };
                Err(self.mistake(format!("{ends}a number, a name or a parenthesis is expected")))
            }
        }
    }

    fn call(&mut self, name: &str, place: usize) -> Result<Syntax, Mistake> {
        let Some(&(_, callable)) = FUNCTIONS.iter().find(|(known, _)| *known == name) else {
            let hint = meant_or_known(name, FUNCTIONS.iter().map(|(name, _)| *name));
            return Err(Mistake { message: format!("unknown function {name:?}{hint}"), place });
        };
        self.expect('(')?;
        let mut arguments = Vec::new();
        if let Callable::Switching(Switching::If) = callable {
            arguments.extend(self.comparison()?);
            self.expect(',')?;
        }
        arguments.push(self.sum()?);
        while self.takes(',') {
            arguments.push(self.sum()?);
        }
        self.expect(')')?;
        let count = arguments.len();
        let wrong = |wanted: &str, got: usize| {
            Err(Mistake { message: format!("{name} takes {wanted}, got {got}"), place })
        };
        match callable {
            Callable::Switching(Switching::If) if count != 4 => {
                wrong("a comparison and 2 values, as in if(a < b, x, y)", count - 2)
            }
            Callable::Switching(Switching::Min | Switching::Max) if count < 2 => {
                wrong("2 or more arguments", count)
            }
            Callable::Switching(Switching::Abs | Switching::Sign) | Callable::Smooth(_) if count != 1 => {
                wrong("1 argument", count)
            }
            Callable::Switching(switching) => Ok(Syntax::Switch(switching, arguments)),
            Callable::Smooth(function) => Ok(Syntax::Call(function, Box::new(arguments.remove(0)))),
            Callable::Pair(operation) => match <[Syntax; 2]>::try_from(arguments) {
                Ok(pair) => Ok(Syntax::Binary(operation, Box::new(pair))),
                Err(arguments) => wrong("2 arguments", arguments.len()),
            },
        }
    }

    /// The two sides of a comparison, the one that is to be smaller first.
    fn comparison(&mut self) -> Result<[Syntax; 2], Mistake> {
        let left = self.sum()?;
        let smaller_first = self.takes('<');
        if !smaller_first && !self.takes('>') {
            return Err(self.mistake("if needs a comparison with < or > first, as in if(a < b, x, y)"));
        }
        let right = self.sum()?;
        Ok(if smaller_first { [left, right] } else { [right, left] })
    }
}

impl Syntax {
    /// Its parts.
    pub fn parts(&self) -> &[Syntax] {
        match self {
            Syntax::Number(_) | Syntax::Name(..) => &[],
            Syntax::Negative(inner) | Syntax::Call(_, inner) => std::slice::from_ref(inner),
            Syntax::Binary(_, pair) => &pair[..],
            Syntax::Switch(_, arguments) => arguments,
        }
    }

    /// All names in it, in their order, with their places.
    pub fn names(&self) -> Vec<(&str, usize)> {
        let of_parts = self.parts().iter().flat_map(Syntax::names);
        match self {
            Syntax::Name(name, place) => once((name.as_str(), *place)).chain(of_parts).collect(),
            _ => of_parts.collect(),
        }
    }
}
