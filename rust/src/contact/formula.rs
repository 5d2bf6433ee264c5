//! Laws that the user writes as formulas: a normal force, or a friction coefficient.

use std::array::from_fn;

use crate::contact::friction::FrictionLaw;
use crate::contact::normal::Damping;
use crate::contact::pair::ContactLaw;
use crate::expression::dimension::{Dimension, FORCE};
use crate::expression::tape::Tape;
use crate::numerics::accuracy::{HALVINGS, INTEGRAL_ERROR, SEARCH_STEPS};
use crate::numerics::dual::{Dual, Scalar};

/// The quantities of which a normal force may be a formula, in the order of its variables.
pub const OF_NORMAL_FORCE: [(&str, Dimension); 3] =
    [("penetration", [0, 1, 0]), ("penetration_rate", [0, 1, -1]), ("impact_velocity", [0, 1, -1])];
/// Those of a friction coefficient.
pub const OF_FRICTION: [(&str, Dimension); 2] = [("sliding_velocity", [0, 1, -1]), ("normal_force", FORCE)];

/// Most switches of a formula: each takes a bit of its forms.
pub const MOST_SWITCHES: usize = 16;

/// A formula, compiled.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    /// What the user wrote.
    pub text: String,
    /// The same, compiled.
    pub tape: Tape,
    /// Whether it depends on each of its variables.
    pub depends: [bool; 3],
}

impl Formula {
    /// Its value; bit k of `forms` tells whether switch k is below.
    // Inlined where the number of variables is known.
    #[inline(always)]
    pub fn value<S: Scalar>(&self, variables: &[S], forms: u16) -> S {
        let count = self.tape.switches.len();
        if count == 0 {
            return self.tape.value(variables, &[]);
        }
        let mut states = [0; MOST_SWITCHES];
        for (switch, state) in states.iter_mut().enumerate().take(count) {
            *state = i64::from(forms >> switch & 1);
        }
        self.tape.value(variables, &states[..count])
    }

    /// The form that it has at these values.
    pub fn forms(&self, variables: &[f64]) -> u16 {
        let count = self.tape.switches.len();
        if count == 0 {
            return 0;
        }
        let mut states = [0; MOST_SWITCHES];
        for switch in 0..count {
            states[switch] = self.tape.state(switch, variables, &states[..count]);
        }
        states.iter().rev().fold(0, |forms, state| forms << 1 | *state as u16)
    }

    /// Its value in that form; NaN where a function in it is asked for outside its domain.
    pub fn at(&self, variables: &[f64]) -> f64 {
        let forms = self.forms(variables);
        let states: [i64; MOST_SWITCHES] = from_fn(|switch| i64::from(forms >> switch & 1));
        let has_value = self.tape.has_value(variables, &states[..self.tape.switches.len()]);
        if has_value { self.value(variables, forms) } else { f64::NAN }
    }

    /// A normal force without damping [N], and its derivative [N/m]: at no rate, after an impact of 1 m/s.
    pub(super) fn elastic(&self, penetration: f64) -> [f64; 2] {
        let forms = self.forms(&[penetration, 0.0, 1.0]);
        let variables = [Dual::<1>::input(penetration, 0), Dual::constant(0.0), Dual::constant(1.0)];
        let force = self.value(&variables, forms);
        [force.value, force.gradient[0]]
    }

    /// The same force alone.
    pub(super) fn elastic_force(&self, penetration: f64) -> f64 {
        self.at(&[penetration, 0.0, 1.0])
    }

    /// The integral of that force up to a penetration [J].
    pub(super) fn elastic_energy(&self, penetration: f64) -> f64 {
        if penetration <= 0.0 {
            return 0.0;
        }
        // Over the root of the penetration, in which powers of halves are smooth.
        let along = |root: f64| 2.0 * root * self.elastic_force(root * root);
        let scale = self.elastic_force(penetration).abs() * penetration;
        integral(&along, [0.0, penetration.sqrt()], INTEGRAL_ERROR * scale, HALVINGS)
    }

    /// Penetration [m], up to a largest one, at which the elastic part carries a load [N].
    pub(super) fn penetration_under(&self, load: f64, largest: f64) -> f64 {
        let (mut low, mut high) = ((f64::EPSILON * largest).ln(), largest.ln());
        for _ in 0..SEARCH_STEPS {
            let middle = 0.5 * (low + high);
            if self.elastic_force(middle.exp()) < load { low = middle } else { high = middle }
        }
        (0.5 * (low + high)).exp()
    }

    /// Normal force [N] and its derivative with respect to the penetration rate [N s/m].
    pub(super) fn with_damping(&self, variables: [f64; 3], forms: u16) -> [f64; 2] {
        let [penetration, rate, impact_velocity] = variables;
        let variables =
            [Dual::<1>::constant(penetration), Dual::input(rate, 0), Dual::constant(impact_velocity)];
        let force = self.value(&variables, forms);
        [force.value, force.gradient[0]]
    }
}

/// The integral of a function between two numbers by Lobatto's rule with five points, whose halves are halved until they
/// agree with the whole. A rule without the ends would miss a kink next to one.
fn integral(of: &impl Fn(f64) -> f64, [a, b]: [f64; 2], error: f64, halvings: u32) -> f64 {
    let rule = |a: f64, b: f64| {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let inner = (3.0_f64 / 7.0).sqrt() * half;
        half / 90.0
            * (64.0 * of(middle) + 49.0 * (of(middle - inner) + of(middle + inner)) + 9.0 * (of(a) + of(b)))
    };
    let middle = 0.5 * (a + b);
    let (whole, halves) = (rule(a, b), rule(a, middle) + rule(middle, b));
    if halvings == 0 || (halves - whole).abs() <= error || halves.is_nan() {
        return halves;
    }
    integral(of, [a, middle], 0.5 * error, halvings - 1)
        + integral(of, [middle, b], 0.5 * error, halvings - 1)
}

/// The numbers of a friction formula that tolerances ask for: the sliding speed [m/s] below which it is steep, zero if it
/// is steep nowhere or jumps, and its slope there [s/m].
pub fn steepness(formula: &Formula) -> [f64; 2] {
    let variables = [Dual::<1>::input(0.0, 0), Dual::constant(1.0)];
    let slope = formula.value(&variables, formula.forms(&[0.0, 1.0])).gradient[0];
    // A coefficient is about 1 at most: it is looked at beside the speed at which its slope would lead to 1.
    let at = |part: f64| formula.at(&[part / slope, 1.0]).abs();
    let largest = PARTS.into_iter().map(at).fold(0.0, f64::max);
    let speed = largest / slope;
    if speed > 0.0 && speed.is_finite() { [speed, slope] } else { [0.0, 0.0] }
}

/// Sliding speeds at which a friction formula is looked at, relative to the one at which its slope would lead to a
/// coefficient of 1. Beyond the largest it has what it has at the largest.
const PARTS: [f64; 6] = [1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0];

/// Sliding speeds [m/s] and normal forces [N] at which friction formulas are looked at.
/// Half and twice change two of 30 messages.
pub const SPEEDS: [f64; 6] = [1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0];
/// See there. Half and twice change two of 30 messages.
pub const FORCES: [f64; 3] = [1e-3, 1.0, 1e3];

impl ContactLaw {
    /// Whether it has a law that is a formula.
    pub fn has_formula(&self) -> bool {
        matches!(self.normal.damping, Damping::Formula { .. })
            || matches!(self.friction, Some(FrictionLaw::Formula(_)))
    }
}
