//! Instantaneous response to forces: relative acceleration and effective mass of a pair, and what a load makes of velocities.

use crate::numerics::accuracy::ROUNDING_OF_SOLUTION;
use nalgebra::Matrix2;

use super::Dynamics;
use crate::numerics::linear::symmetric_solve;
use crate::tree::elements::{FramePoint, Scales};
use crate::tree::kinematics::Vec2;

/// Accelerance of a pair of points: relative acceleration per unit force between them [1/kg], the inverse of
/// the effective mass matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accelerance(Matrix2<f64>);

impl Accelerance {
    /// Effective mass in a direction (a unit vector) [kg]: infinite where drives or closed
    /// loops prescribe the relative motion.
    pub fn mass_along(&self, direction: Vec2) -> f64 {
        let accelerance = direction.dot(&(self.0 * direction));
        if accelerance > ROUNDING_OF_SOLUTION * self.0.trace() { 1.0 / accelerance } else { f64::INFINITY }
    }

    /// Inverse of the mean of its inverse over all directions [kg].
    pub fn mean_mass(&self) -> f64 {
        2.0 / self.0.trace()
    }
}

/// A load of a force element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acting {
    /// Index of the force element.
    pub force: usize,
    /// Place among its loads.
    pub place: usize,
}

impl Dynamics<'_> {
    /// Acceleration of points per unit of a load, over the velocity tolerance of their component [1/s], where it is
    /// largest, after [`Dynamics::acceleration`].
    pub fn response_to(&mut self, acting: Acting, scales: &Scales, tolerance: &dyn Fn(usize) -> f64) -> f64 {
        let mut response = std::mem::take(&mut self.scratch);
        response.fill(0.0);
        self.add_per_unit(&self.tree.forces[acting.force], acting.place, &mut response);
        symmetric_solve(&self.mass, response.len(), &mut response);
        if !self.loops.right.is_empty() {
            self.loops.right.fill(0.0);
            self.loops.correct(&mut response);
        }
        let of = |component: usize| scales.largest(component, &response) / tolerance(component);
        let largest = (0..scales.components.len()).map(of).fold(0.0, f64::max);
        self.scratch = response;
        largest
    }

    /// Accelerance of the second point relative to the first, after [`Dynamics::acceleration`]: with all
    /// loops closed and unchanged contact forces.
    pub fn accelerance(&mut self, points: [FramePoint; 2]) -> Accelerance {
        let rows = self.relative_rows(points);
        let relative = |response: &[f64]| {
            Vec2::from(rows.each_ref().map(|row| row.iter().zip(response).map(|(e, a)| e * a).sum()))
        };
        let (mut accelerance, mut without_loops) = (Matrix2::zeros(), 0.0);
        for (axis, row) in rows.iter().enumerate() {
            let mut response = row.clone();
            symmetric_solve(&self.mass, response.len(), &mut response);
            without_loops += relative(&response)[axis];
            if !self.loops.right.is_empty() {
                self.loops.right.fill(0.0);
                self.loops.correct(&mut response);
            }
            accelerance.set_column(axis, &relative(&response));
        }
        let prevented = accelerance.trace() <= ROUNDING_OF_SOLUTION * without_loops;
        Accelerance(if prevented { Matrix2::zeros() } else { accelerance })
    }

    /// Rows x and y of the Jacobian of a point relative to another, for the free coordinates. Entries of
    /// coordinates that move both points alike are exactly zero.
    fn relative_rows(&self, [a, b]: [FramePoint; 2]) -> [Vec<f64>; 2] {
        let d = self.tree.free.len();
        let (mut relative, mut sizes) = (vec![Vec2::zeros(); d], vec![0.0_f64; d]);
        for (point, sign) in [(b, 1.0), (a, -1.0)] {
            let position = self.point(point).position;
            for &(column, freedom) in &self.tree.paths[point.frame].free {
                let (by, _) = self.column(column, position);
                relative[freedom] += sign * by;
                sizes[freedom] = sizes[freedom].max(by.amax());
            }
        }
        for (by, size) in relative.iter_mut().zip(sizes) {
            if by.amax() <= ROUNDING_OF_SOLUTION * size {
                *by = Vec2::zeros();
            }
        }
        [0, 1].map(|axis| relative.iter().map(|by| by[axis]).collect())
    }
}
