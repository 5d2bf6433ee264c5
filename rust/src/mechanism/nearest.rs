//! The ways to close the loops of a mechanism that are nearest to the given angles.
//!
//! In the angles of the bodies every loop is a sum of vectors, each of which turns with one angle: `c + Σ l e^{iφ} + Σ
//! s a e^{iφ} = 0` with the displacements s of the sliding joints. A loop with two unknowns (a dyad) is a triangle and
//! has two solutions in closed form; dyads are settled one after the other, and a sum of squares that has grown beyond
//! the best one is given up. So all assemblies that matter are found where the mechanism consists of dyads; for the rest
//! Newton's method from many starts finds what it can.

use crate::numerics::accuracy::{EQUAL, HALF_DIGITS, NEWTON_STEPS, ROUNDING_OF_SOLUTION};
use std::f64::consts::PI;

use nalgebra::{Complex, DVector};

use crate::mechanism::assembly::least_squares;
use crate::mechanism::vector_loops::{EQUALLY_NEAR, VectorLoops, Wanted, along, turned};
use crate::numerics::turns::wrap;

/// Most dyads that a search solves, and starts of Newton's method for each group that consists of none.
/// Half and twice change nothing.
const DYADS: usize = 10_000;
/// No scene of the tests needs a start.
const STARTS: usize = 32;
/// Angle [rad] by which assemblies must differ to be two. Half and twice change nothing.
const APART: f64 = 0.01;

/// A way to close the loops.
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    /// Changes of the angles [rad] and displacements in units of the size of the mechanism.
    pub(super) unknowns: Vec<f64>,
    /// Root of the sum of the squared changes of the angles of the bodies [rad].
    pub(super) distance: f64,
}

impl Assembly {
    /// Whether it is as near as another one or nearer, to a small part of the distance.
    pub(super) fn is_about_as_near_as(&self, other: &Assembly) -> bool {
        self.distance <= (1.0 + EQUALLY_NEAR) * other.distance
    }
}

impl VectorLoops {
    /// The values of at most two unknowns that close a loop.
    fn close(&self, one: usize, open: &[usize], unknowns: &[f64], known: &[bool]) -> Vec<Vec<f64>> {
        let rest = self.rest(one, unknowns, known);
        let link = |turn: usize| self.link(one, turn, unknowns, known);
        let slide_of = |unknown: usize| unknown.checked_sub(self.turns());
        match *open {
            [unknown] => {
                let value = match slide_of(unknown) {
                    None => (-rest / link(unknown)).arg(),
                    Some(slide) => -along(rest, self.axis(one, slide, unknowns)),
                };
                vec![vec![value]]
            }
            [a, b] => match (slide_of(a), slide_of(b)) {
                (None, None) => triangle(rest, link(a), link(b)),
                (None, Some(slide)) if self.carriers[slide] == Some(a) => {
                    let (arm, axis) = (link(a), self.axes[one][slide]);
                    let slid = on_line(arm, axis, rest.norm());
                    slid.into_iter().map(|s| vec![(-rest / (arm + axis * s)).arg(), s]).collect()
                }
                (None, Some(slide)) => {
                    let (arm, axis) = (link(a), self.axis(one, slide, unknowns));
                    let slid = on_line(rest, axis, arm.norm());
                    slid.into_iter().map(|s| vec![(-(rest + axis * s) / arm).arg(), s]).collect()
                }
                (Some(first), Some(second)) => {
                    let (u, v) = (self.axis(one, first, unknowns), self.axis(one, second, unknowns));
                    let area = cross(u, v);
                    vec![vec![-cross(rest, v) / area, -cross(u, rest) / area]]
                }
                (Some(_), None) => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    /// The nearest assembly and those that are about as near.
    pub(super) fn search(&self, from: &[f64]) -> Vec<Assembly> {
        let mut search = Search { loops: self, from, found: Vec::new(), left: DYADS };
        let open = (0..self.constants.len()).collect();
        search.solve_dyads(&mut vec![0.0; self.count()], &mut vec![false; self.count()], open, 0.0);
        let mut found = search.found;
        let Some(nearest) = found.iter().min_by(|a, b| a.distance.total_cmp(&b.distance)).cloned() else {
            return found;
        };
        found.retain(|other| other.is_about_as_near_as(&nearest));
        // Equal ones remain in their order, which rounding does not change.
        found.sort_by_key(|other| other.distance > (1.0 + EQUAL) * nearest.distance);
        found
    }

    /// The nearest point that unknowns which close the loops can move to.
    pub(super) fn settled(&self, unknowns: &[f64]) -> Option<Assembly> {
        self.relax(unknowns).map(|at| self.assembly(&at))
    }

    /// Unknowns that close the loops, with their distance.
    pub(super) fn assembly(&self, unknowns: &[f64]) -> Assembly {
        Assembly { unknowns: self.wrapped(unknowns), distance: self.distance(unknowns) }
    }

    /// Whether two assemblies are apart, and not one that two ways of computing found.
    pub(super) fn differ(&self, one: &Assembly, other: &Assembly) -> bool {
        let angles = one.unknowns.iter().zip(&other.unknowns).take(self.turns());
        angles.into_iter().any(|(a, b)| wrap(a - b).0.abs() > APART)
    }

    /// A point near a start where the loops are closed, and nearest to the wanted angles where they can move; none if
    /// Newton's method finds none.
    fn relax(&self, start: &[f64]) -> Option<Vec<f64>> {
        let mut at = self.wrapped(&self.newton(start)?);
        let mut part = 1.0;
        for _ in 0..NEWTON_STEPS {
            let pull = DVector::from_fn(self.count(), |unknown, _| match self.wanted.get(unknown) {
                Some(wanted) if wanted.matters() => (wanted.mean - at[unknown]) * wanted.scale(),
                _ => 0.0,
            });
            let jacobian = self.jacobian(&at);
            let held = least_squares(jacobian.clone(), &(&jacobian * &pull), ROUNDING_OF_SOLUTION);
            let free = pull - held;
            if part * free.amax() < HALF_DIGITS {
                break;
            }
            match self.newton(&self.moved(&at, &free, part)) {
                Some(next) if self.distance(&next) < self.distance(&at) => {
                    at = self.wrapped(&next);
                    part = (2.0 * part).min(1.0);
                }
                _ => part *= 0.5,
            }
        }
        Some(at)
    }

    /// Newton's method with steps of at most a radian, beyond which a rotation is far from its tangent.
    fn newton(&self, start: &[f64]) -> Option<Vec<f64>> {
        let mut at = start.to_vec();
        for _ in 0..NEWTON_STEPS {
            let gaps = self.gaps(&at);
            if gaps.amax() <= (ROUNDING_OF_SOLUTION * HALF_DIGITS).sqrt() {
                return Some(at);
            }
            let step = least_squares(self.jacobian(&at), &gaps, ROUNDING_OF_SOLUTION);
            let largest = step.rows(0, self.turns()).amax();
            let fraction = if largest > 1.0 { 1.0 / largest } else { 1.0 };
            at = self.moved(&at, &step, -fraction);
        }
        None
    }

    /// Unknowns after a part of a step, which has each angle times its scale.
    fn moved(&self, unknowns: &[f64], step: &DVector<f64>, part: f64) -> Vec<f64> {
        let scales = self.wanted.iter().map(Wanted::scale).chain(std::iter::repeat(1.0));
        unknowns
            .iter()
            .zip(step)
            .zip(scales)
            .map(|((value, step), scale)| value + part * step / scale)
            .collect()
    }
}

/// A search over the ways to close dyads.
struct Search<'l> {
    loops: &'l VectorLoops,
    /// A further start of Newton's method.
    from: &'l [f64],
    found: Vec<Assembly>,
    /// Dyads that may still be solved.
    left: usize,
}

impl Search<'_> {
    /// Largest sum of squares that still matters.
    fn limit(&self) -> f64 {
        let nearest = self.found.iter().map(|one| one.distance).fold(f64::INFINITY, f64::min);
        ((1.0 + EQUALLY_NEAR) * nearest).powi(2)
    }

    fn solve_dyads(
        &mut self,
        unknowns: &mut Vec<f64>,
        known: &mut Vec<bool>,
        mut open: Vec<usize>,
        squares: f64,
    ) {
        if self.left == 0 || squares > self.limit() {
            return;
        }
        self.left -= 1;
        let lacking = |one: usize, known: &[bool]| -> Vec<usize> {
            (0..known.len()).filter(|&unknown| !known[unknown] && self.loops.depends(one, unknown)).collect()
        };
        let Some(place) = (0..open.len()).min_by_key(|&place| lacking(open[place], known).len()) else {
            self.found.push(self.loops.assembly(unknowns));
            return;
        };
        let unsettled = lacking(open[place], known);
        if unsettled.len() > 2 {
            self.relax(unknowns, known);
            return;
        }
        let one = open.remove(place);
        let loops = self.loops;
        let mut ways: Vec<(f64, Vec<f64>)> = if unsettled.is_empty() {
            vec![(0.0, Vec::new())]
        } else {
            let squares = |values: &Vec<f64>| -> f64 {
                let turns = unsettled.iter().zip(values).filter(|(unknown, _)| **unknown < loops.turns());
                turns.map(|(&turn, &change)| loops.wanted[turn].squares(change)).sum()
            };
            loops
                .close(one, &unsettled, unknowns, known)
                .into_iter()
                .map(|way| (squares(&way), way))
                .collect()
        };
        // Equal ones remain in their order.
        if let [(first, _), (second, _)] = ways[..]
            && second < first * (1.0 - EQUAL)
        {
            ways.swap(0, 1);
        }
        for &unknown in &unsettled {
            known[unknown] = true;
        }
        for (more, way) in ways {
            for (&unknown, value) in unsettled.iter().zip(way) {
                unknowns[unknown] = value;
            }
            let closed = loops.rest(one, unknowns, known).norm() <= HALF_DIGITS;
            if closed {
                self.solve_dyads(unknowns, known, open.clone(), squares + more);
            }
        }
        for unknown in unsettled {
            known[unknown] = false;
        }
    }

    /// Newton's method for what is not known, from the wanted angles and all around them.
    fn relax(&mut self, unknowns: &[f64], known: &[bool]) {
        for start in 0..=STARTS {
            let reach = PI * start as f64 / STARTS as f64;
            let value = |unknown: usize| match self.loops.wanted.get(unknown) {
                _ if known[unknown] => unknowns[unknown],
                _ if start == STARTS => self.from[unknown],
                // Multiples of the roots of primes fill a cube evenly.
                Some(wanted) => {
                    wanted.mean + reach * (2.0 * (start as f64 * prime(unknown).sqrt()).fract() - 1.0)
                }
                None => self.from[unknown],
            };
            let from: Vec<f64> = (0..known.len()).map(value).collect();
            if let Some(at) = self.loops.relax(&from) {
                self.keep(&at);
            }
        }
    }

    /// Keeps an assembly that Newton's method found, unless it is known.
    fn keep(&mut self, unknowns: &[f64]) {
        let new = self.loops.assembly(unknowns);
        match self.found.iter().position(|other| !self.loops.differ(other, &new)) {
            Some(known) if new.distance < self.found[known].distance => self.found[known] = new,
            Some(_) => {}
            None => self.found.push(new),
        }
    }
}

fn prime(index: usize) -> f64 {
    let is_prime =
        |number: &u32| (2..*number).take_while(|d| d * d <= *number).all(|d| !number.is_multiple_of(d));
    (2..).filter(is_prime).nth(index).map_or(2.0, f64::from)
}

fn cross(a: Complex<f64>, b: Complex<f64>) -> f64 {
    a.re * b.im - a.im * b.re
}

/// Angles that close a triangle: `c + a e^{iα} + b e^{iβ} = 0`.
fn triangle(c: Complex<f64>, a: Complex<f64>, b: Complex<f64>) -> Vec<Vec<f64>> {
    let (d, ra, rb) = (c.norm(), a.norm(), b.norm());
    let cosine = (rb * rb - d * d - ra * ra) / (2.0 * d * ra);
    if cosine.is_nan() || cosine.abs() > 1.0 + HALF_DIGITS {
        return Vec::new();
    }
    let half = cosine.clamp(-1.0, 1.0).acos();
    let way = |side: f64| {
        let alpha = side * half + c.arg() - a.arg();
        vec![alpha, (-(c + a * turned(alpha)) / b).arg()]
    };
    if half == 0.0 || half == PI { vec![way(1.0)] } else { vec![way(-1.0), way(1.0)] }
}

/// Where `start + s axis` has a length.
fn on_line(start: Complex<f64>, axis: Complex<f64>, length: f64) -> Vec<f64> {
    let foot = -along(start, axis);
    let off = (start + axis * foot).norm();
    let square = length * length - off * off;
    if square.is_nan() || square < -HALF_DIGITS * length.max(off) {
        return Vec::new();
    }
    let half = square.max(0.0).sqrt() / axis.norm();
    if half == 0.0 { vec![foot] } else { vec![foot + half, foot - half] }
}
