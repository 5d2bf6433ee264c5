//! What a force does at once: the accelerations that masses and closed loops leave it.

use nalgebra::Matrix2;

use super::Dynamics;
use crate::numerics::linear::symmetric_solve;
use crate::tree::elements::FramePoint;
use crate::tree::kinematics::Vec2;

/// Part of a compliance below which another is rounding: what closed loops leave of it where they hold the
/// two points together, and one of its directions beside the other. Likewise for their columns.
const HELD: f64 = 1e-12;

/// Acceleration of a point seen from another for a unit of force between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliance(Matrix2<f64>);

impl Compliance {
    /// Mass that a force in a direction (a unit vector) accelerates [kg]: infinite where drives or closed
    /// loops prescribe the relative motion.
    pub fn mass_along(&self, direction: Vec2) -> f64 {
        let compliance = direction.dot(&(self.0 * direction));
        if compliance > HELD * self.0.trace() { 1.0 / compliance } else { f64::INFINITY }
    }

    /// Harmonic mean of that mass over all directions [kg].
    pub fn mean_mass(&self) -> f64 {
        2.0 / self.0.trace()
    }
}

impl Dynamics<'_> {
    /// Compliance of a pair of points after [`Dynamics::acceleration`]: of the second seen from the first,
    /// with all loops closed and without what contacts answer.
    pub fn compliance(&mut self, points: [FramePoint; 2]) -> Compliance {
        let rows = self.relative_rows(points);
        let seen = |response: &[f64]| {
            Vec2::from(rows.each_ref().map(|row| row.iter().zip(response).map(|(e, a)| e * a).sum()))
        };
        let (mut compliance, mut without_loops) = (Matrix2::zeros(), 0.0);
        for (axis, row) in rows.iter().enumerate() {
            let mut response = row.clone();
            symmetric_solve(&self.mass, response.len(), &mut response);
            without_loops += seen(&response)[axis];
            if !self.loops.right.is_empty() {
                self.loops.right.fill(0.0);
                self.loops.correct(&mut response);
            }
            compliance.set_column(axis, &seen(&response));
        }
        let held = compliance.trace() <= HELD * without_loops;
        Compliance(if held { Matrix2::zeros() } else { compliance })
    }

    /// Rows x and y of the Jacobian of a point seen from another, for the free coordinates. What moves both
    /// points alike has entries of zero, not of rounding.
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
            if by.amax() <= HELD * size {
                *by = Vec2::zeros();
            }
        }
        [0, 1].map(|axis| relative.iter().map(|by| by[axis]).collect())
    }
}
