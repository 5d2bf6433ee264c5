//! The loops of a mechanism as sums of vectors that turn with the bodies.
//!
//! In the angles of the bodies every loop is `c + Σ l e^{iφ} + Σ s a e^{iφ} = 0`, with the displacements s of the sliding
//! joints. Nothing else of the mechanism matters for how its loops can be closed.

use crate::numerics::accuracy::{HALF_DIGITS, ROUNDING_OF_SOLUTION};
use std::f64::consts::PI;

use nalgebra::{Complex, DMatrix, DVector};

use crate::numerics::turns::wrap;

/// Two assemblies are about equally near if their distances differ by less than this part.
/// Half and twice change nothing.
pub(super) const EQUALLY_NEAR: f64 = 0.05;
/// The loops of a mechanism in the unknowns that remain: changes of angles from the initial guess, then displacements.
/// Lengths are relative to the size of the mechanism.
#[derive(Clone, Debug, Default)]
pub(super) struct VectorLoops {
    /// What does not change in each loop.
    pub(super) constants: Vec<Complex<f64>>,
    /// Vector of each loop that turns with each angle, in the pose of the initial guess.
    pub(super) links: Vec<Vec<Complex<f64>>>,
    /// The direction of each displacement in each loop, likewise.
    pub(super) axes: Vec<Vec<Complex<f64>>>,
    /// The angle with which each displacement turns; none if it keeps its direction.
    pub(super) carriers: Vec<Option<usize>>,
    /// The changes of each angle that the given angles of the bodies ask for.
    pub(super) wanted: Vec<Wanted>,
}

/// The changes of an angle that the given angles of the bodies which turn with it ask for.
#[derive(Clone, Debug, Default)]
pub(super) struct Wanted {
    /// One for each body [rad].
    changes: Vec<f64>,
    /// Their mean [rad].
    pub(super) mean: f64,
}

impl Wanted {
    pub(super) fn new(mut changes: Vec<f64>) -> Self {
        // Each within half a turn of the first.
        let first = changes.first().copied().unwrap_or(0.0);
        changes.iter_mut().for_each(|change| *change = first + wrap(*change - first).0);
        let mean =
            first + changes.iter().map(|change| change - first).sum::<f64>() / changes.len().max(1) as f64;
        Self { changes, mean }
    }

    /// Root of the number of the bodies; 1 without any.
    pub(super) fn scale(&self) -> f64 {
        (self.changes.len().max(1) as f64).sqrt()
    }

    /// Sum of the squared differences from a change, each within half a turn [rad²].
    pub(super) fn squares(&self, change: f64) -> f64 {
        self.changes.iter().map(|wanted| wrap(change - wanted).0.powi(2)).sum()
    }

    /// Whether a body asks for anything.
    pub(super) fn matters(&self) -> bool {
        !self.changes.is_empty()
    }
}

impl VectorLoops {
    pub(super) fn turns(&self) -> usize {
        self.wanted.len()
    }

    pub(super) fn count(&self) -> usize {
        self.turns() + self.carriers.len()
    }

    /// Replaces loops by sums and differences that have fewer unknowns: the shortest way around.
    pub(super) fn shorten(&mut self) {
        let loops = self.constants.len();
        let mut shortened = true;
        while shortened {
            shortened = false;
            for (one, other) in (0..loops).flat_map(|one| (0..loops).map(move |other| (one, other))) {
                for sign in [-1.0, 1.0] {
                    if one == other {
                        continue;
                    }
                    let add = |a: &[Complex<f64>], b: &[Complex<f64>]| -> Vec<Complex<f64>> {
                        a.iter().zip(b).map(|(a, b)| tidy(a + b * sign)).collect()
                    };
                    let links = add(&self.links[one], &self.links[other]);
                    let axes = add(&self.axes[one], &self.axes[other]);
                    let size = |links: &[Complex<f64>], axes: &[Complex<f64>]| {
                        links.iter().chain(axes).filter(|vector| vector.norm() > 0.0).count()
                    };
                    // A loop that has no unknowns left says nothing.
                    let less = size(&links, &axes);
                    if less > 0 && less < size(&self.links[one], &self.axes[one]) {
                        self.constants[one] = tidy(self.constants[one] + self.constants[other] * sign);
                        (self.links[one], self.axes[one]) = (links, axes);
                        shortened = true;
                    }
                }
            }
        }
        let says_nothing = |one: &usize| {
            let mut vectors = self.links[*one].iter().chain(&self.axes[*one]);
            vectors.all(|vector| vector.norm() == 0.0) && self.constants[*one].norm() <= HALF_DIGITS
        };
        let silent: Vec<usize> = (0..loops).filter(says_nothing).collect();
        for one in silent.into_iter().rev() {
            self.constants.remove(one);
            self.links.remove(one);
            self.axes.remove(one);
        }
        let loops = self.constants.len();
        // Angles in no loop keep their guess.
        for turn in 0..self.turns() {
            if !(0..loops).any(|one| self.depends(one, turn)) {
                self.wanted[turn] = Wanted::default();
            }
        }
    }

    /// Whether a loop changes with an unknown.
    pub(super) fn depends(&self, one: usize, unknown: usize) -> bool {
        match unknown.checked_sub(self.turns()) {
            Some(slide) => self.axes[one][slide].norm() > 0.0,
            None => {
                self.links[one][unknown].norm() > 0.0
                    || self.carried(unknown).any(|slide| self.axes[one][slide].norm() > 0.0)
            }
        }
    }

    /// The displacements that turn with an angle.
    pub(super) fn carried(&self, turn: usize) -> impl Iterator<Item = usize> {
        self.carriers
            .iter()
            .enumerate()
            .filter(move |(_, carrier)| **carrier == Some(turn))
            .map(|(slide, _)| slide)
    }

    /// Root of the sum of the squared changes of the angles of the bodies, each within half a turn [rad].
    pub(super) fn distance(&self, unknowns: &[f64]) -> f64 {
        self.wanted.iter().zip(unknowns).map(|(wanted, change)| wanted.squares(*change)).sum::<f64>().sqrt()
    }

    /// The same changes within half a turn of what is wanted.
    pub(super) fn wrapped(&self, unknowns: &[f64]) -> Vec<f64> {
        let turns = self.wanted.iter().zip(unknowns).map(|(wanted, change)| {
            let (near, full) = wrap(change - wanted.mean);
            // The bits remain where nothing changes.
            if full == 0.0 { *change } else { wanted.mean + near }
        });
        turns.chain(unknowns[self.turns()..].iter().copied()).collect()
    }

    /// Whether the loops leave unknowns free.
    pub(super) fn can_move(&self) -> bool {
        self.in_loops().len() > 2 * self.constants.len()
    }

    /// The unknowns that change a loop.
    fn in_loops(&self) -> Vec<usize> {
        let changes = |unknown: &usize| (0..self.constants.len()).any(|one| self.depends(one, *unknown));
        (0..self.count()).filter(changes).collect()
    }

    /// Whether no other assembly can be nearer than this one, nor about as near.
    ///
    /// Let J be the derivative where the angles are those that are wanted. In a ball around these of radius ρ, the
    /// derivative between two solutions differs from J by less than `ρ L` with the largest vector L that turns, so that
    /// the solutions coincide if `ρ L` is less than the smallest singular value of J. Displacements enter linearly
    /// and may be any. (With more unknowns than equations they lie on one sheet.)
    pub(super) fn is_certainly_nearest(&self, unknowns: &[f64]) -> bool {
        let part = (1.0 + EQUALLY_NEAR).powi(2);
        let mut squares = 0.0;
        let mut spread: f64 = 0.0;
        let mut at = unknowns.to_vec();
        for (change, wanted) in at.iter_mut().zip(&self.wanted) {
            let away = wanted.changes.iter().map(|wanted| wanted - *change);
            let apart = wanted.changes.iter().map(|other| other - wanted.mean);
            squares += part * away.map(|away| away * away).sum::<f64>();
            squares -= apart.clone().map(|apart| apart * apart).sum::<f64>();
            spread = apart.map(f64::abs).fold(spread, f64::max);
            *change = wanted.mean;
        }
        let radius = squares.max(0.0).sqrt();
        // Beyond half a turn an angle comes near again.
        if radius + spread >= PI {
            return false;
        }
        let jacobian = self.jacobian(&at);
        let unsettled = jacobian.select_columns(&self.in_loops());
        if unsettled.is_empty() {
            return true;
        }
        let longest = (0..self.turns())
            .map(|turn| {
                let axes = self.carried(turn).flat_map(|slide| self.axes.iter().map(move |axes| axes[slide]));
                let scale = self.wanted[turn].scale();
                // The column holds the vector over the scale, and so does the change of the angle.
                let own = jacobian.column(turn).norm_squared() * scale * scale;
                (own + axes.map(|axis| axis.norm_sqr()).sum::<f64>()).sqrt() / (scale * scale)
            })
            .fold(0.0, f64::max);
        let smallest = unsettled.singular_values().min();
        radius * longest < smallest && smallest > 0.0
    }

    /// The gap of every loop.
    pub(super) fn gaps(&self, unknowns: &[f64]) -> DVector<f64> {
        let known = vec![true; self.count()];
        let gaps = (0..self.constants.len()).map(|one| self.rest(one, unknowns, &known));
        DVector::from_vec(gaps.flat_map(|gap| [gap.re, gap.im]).collect())
    }

    /// Their derivatives, with each angle times the root of its number of bodies.
    pub(super) fn jacobian(&self, unknowns: &[f64]) -> DMatrix<f64> {
        let known = vec![true; self.count()];
        let mut jacobian = DMatrix::zeros(2 * self.constants.len(), self.count());
        for one in 0..self.constants.len() {
            for turn in 0..self.turns() {
                let arm = self.link(one, turn, unknowns, &known) * turned(unknowns[turn]);
                let column = arm * Complex::i() / self.wanted[turn].scale();
                (jacobian[(2 * one, turn)], jacobian[(2 * one + 1, turn)]) = (column.re, column.im);
            }
            for slide in 0..self.carriers.len() {
                let axis = self.axis(one, slide, unknowns);
                let column = self.turns() + slide;
                (jacobian[(2 * one, column)], jacobian[(2 * one + 1, column)]) = (axis.re, axis.im);
            }
        }
        jacobian
    }

    pub(super) fn only(&self, loops: &[usize]) -> VectorLoops {
        VectorLoops {
            constants: loops.iter().map(|&one| self.constants[one]).collect(),
            links: loops.iter().map(|&one| self.links[one].clone()).collect(),
            axes: loops.iter().map(|&one| self.axes[one].clone()).collect(),
            ..self.clone()
        }
    }

    /// The vector that turns with an angle, with the displacements known.
    pub(super) fn link(&self, one: usize, turn: usize, unknowns: &[f64], known: &[bool]) -> Complex<f64> {
        let first = self.turns();
        let slid = self.carried(turn).filter(|slide| known[first + slide]);
        self.links[one][turn]
            + slid.map(|slide| self.axes[one][slide] * unknowns[first + slide]).sum::<Complex<f64>>()
    }

    /// The direction of a displacement, with the angle with which it turns.
    pub(super) fn axis(&self, one: usize, slide: usize, unknowns: &[f64]) -> Complex<f64> {
        self.axes[one][slide]
            * self.carriers[slide].map_or(Complex::new(1.0, 0.0), |turn| turned(unknowns[turn]))
    }

    /// What the known angles and displacements leave of a loop.
    pub(super) fn rest(&self, one: usize, unknowns: &[f64], known: &[bool]) -> Complex<f64> {
        let turns = (0..self.turns()).filter(|&turn| known[turn]);
        let links = turns.map(|turn| self.link(one, turn, unknowns, known) * turned(unknowns[turn]));
        let fixed = (0..self.carriers.len())
            .filter(|&slide| self.carriers[slide].is_none() && known[self.turns() + slide])
            .map(|slide| self.axes[one][slide] * unknowns[self.turns() + slide]);
        self.constants[one] + links.sum::<Complex<f64>>() + fixed.sum::<Complex<f64>>()
    }
}

/// Zero where only rounding errors are left.
pub(super) fn tidy(vector: Complex<f64>) -> Complex<f64> {
    if vector.norm() <= ROUNDING_OF_SOLUTION { Complex::new(0.0, 0.0) } else { vector }
}

pub(super) fn turned(angle: f64) -> Complex<f64> {
    Complex::from_polar(1.0, angle)
}

/// How many times `axis` lies along a vector.
pub(super) fn along(vector: Complex<f64>, axis: Complex<f64>) -> f64 {
    (vector.re * axis.re + vector.im * axis.im) / axis.norm_sqr()
}
