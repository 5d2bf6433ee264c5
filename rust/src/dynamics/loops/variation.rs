//! How much the closures change along a way: how far Newton's method may go at once.
//!
//! With the rows E of the closures in a state and a right inverse P of them, the part of E that changes to another state is
//! (E' - E) P. As long as it is below one, in a norm, no second way to close the loops lies as near; Newton's method
//! from the one state then ends on the path of the motion that begins there (Kantorovich).

use crate::dynamics::Dynamics;
use crate::numerics::linear::symmetric_solve;
use crate::tree::elements::CLOSURE_ROWS;

/// The closures of a state, to first order.
#[derive(Clone, Debug, Default)]
pub struct FirstOrder {
    /// Rows E of the closures.
    rows: Vec<f64>,
    /// Right inverse of E, transposed: a row for each closure.
    inverse: Vec<f64>,
    /// Gap of each row [its unit] that a coordinate makes at most when it moves a point by a meter.
    units: Vec<f64>,
}

impl FirstOrder {
    /// Largest part by which rows differ from those of the state, each seen in the unit of its closure; infinite where it is
    /// unknown.
    fn part(&self, rows: &[f64], d: usize) -> f64 {
        let mut largest = 0.0_f64;
        for (r, (row, own)) in rows.chunks_exact(d).zip(self.rows.chunks_exact(d)).enumerate() {
            let by = |inverse: &[f64]| -> f64 {
                row.iter().zip(own).zip(inverse).map(|((row, own), inverse)| (row - own) * inverse).sum()
            };
            let columns = self.inverse.chunks_exact(d).zip(&self.units);
            let part: f64 = columns.map(|(inverse, unit)| (by(inverse) * unit).abs()).sum();
            if part.is_nan() {
                return f64::INFINITY;
            }
            largest = largest.max(part / self.units[r]);
        }
        largest
    }

    /// Part of the closures that changes on a way from one state to another, also in its middle; as seen from its start and
    /// from its end.
    pub fn change(&self, middle: &[f64], end: &FirstOrder, d: usize) -> [f64; 2] {
        let seen = |from: &FirstOrder, to: &FirstOrder| from.part(&to.rows, d).max(from.part(middle, d));
        [seen(self, end), seen(end, self)]
    }
}

impl Dynamics<'_> {
    /// Keeps the closures of the state last evaluated by [`Dynamics::acceleration`] or [`Dynamics::project`].
    pub fn keep_closures(&self, levers: &[f64], kept: &mut FirstOrder) {
        let (loops, d) = (&self.loops, self.tree.free.len());
        let count = loops.right.len();
        kept.rows.clone_from(&loops.e);
        kept.inverse.clone_from(&loops.y);
        kept.units.clear();
        // Of those that keep points together the gaps are lengths, in any direction.
        kept.units.resize(CLOSURE_ROWS * self.tree.closures.len(), 1.0);
        let others = loops.e.chunks_exact(d.max(1)).skip(kept.units.len());
        kept.units.extend(others.map(|row| {
            row.iter().zip(levers).map(|(entry, lever)| (entry / lever).abs()).fold(0.0, f64::max)
        }));
        let factor = loops.undamped.as_ref().filter(|_| loops.nearly_dependent).unwrap_or(&loops.s);
        let mut column = vec![0.0; count];
        for i in 0..d {
            for (r, entry) in column.iter_mut().enumerate() {
                *entry = loops.y[r * d + i];
            }
            symmetric_solve(factor, count, &mut column);
            for (r, entry) in column.iter().enumerate() {
                kept.inverse[r * d + i] = *entry;
            }
        }
    }

    /// Rows of the closures in the state last evaluated by [`Dynamics::acceleration`] or [`Dynamics::project`].
    pub fn closure_rows(&self) -> &[f64] {
        &self.loops.e
    }

    /// Writes the rows of the closures in a state, which is not evaluated further.
    pub fn write_closures(&mut self, t: f64, q: &[f64], v: &[f64], rows: &mut Vec<f64>) {
        self.move_to(t, q, v);
        self.write_rows(q.len());
        rows.clone_from(&self.loops.e);
    }
}
