//! The mass matrix where bodies without mass or moment of inertia may make it singular: that with the closures.
//!
//! With E a + c = 0 and any positive W, M a + Eᵀ λ = f is
//!
//! ```text
//! (M + Eᵀ W E) a + Eᵀ (λ + W c) = f
//! ```
//!
//! with the same accelerations, and the same nearest state that closes the loops. It is regular where the closures are
//! independent and every motion that they allow moves a mass or turns a moment of inertia.

use crate::numerics::accuracy::HALF_DIGITS;
use nalgebra::DMatrix;

use crate::dynamics::Dynamics;
use crate::numerics::linear::symmetric_factor;

impl Dynamics<'_> {
    /// Factors the mass matrix; false where it is singular.
    #[inline(always)]
    pub(in crate::dynamics) fn factor_mass(&mut self, d: usize) -> bool {
        if self.composites.are_light() {
            return self.factor_mass_with_rows(d);
        }
        self.composites.factor(&mut self.mass, d)
    }

    #[inline(never)]
    fn factor_mass_with_rows(&mut self, d: usize) -> bool {
        self.add_rows(d);
        let (mass, diagonal) = (&mut self.mass, &mut self.composites.diagonal);
        diagonal.iter_mut().enumerate().for_each(|(i, entry)| *entry = mass[i * d + i]);
        // The factor holds inverse pivots.
        let is_strong = |mass: &[f64], i: usize, entry: f64| HALF_DIGITS * entry * mass[i * d + i] <= 1.0;
        let regular = symmetric_factor(mass, d)
            && diagonal.iter().enumerate().all(|(i, entry)| is_strong(mass, i, *entry));
        self.composites.is_singular = !regular;
        regular
    }

    /// Adds Eᵀ W E to the lower triangle of the mass matrix.
    fn add_rows(&mut self, d: usize) {
        self.write_rows(d);
        for (row, mass) in self.loops.e.chunks_exact(d).zip(&self.loops.row_masses) {
            for i in (0..d).filter(|&i| row[i] != 0.0) {
                for j in 0..=i {
                    self.mass[i * d + j] += mass * row[i] * row[j];
                }
            }
        }
    }

    /// Whether bodies without mass or moment of inertia made the mass matrix singular in the state last evaluated.
    pub fn lacks_inertia(&self) -> bool {
        self.composites.is_singular
    }

    /// Bodies without mass or moment of inertia that can move without any mass that moves, in the state last moved to.
    pub fn bodies_without_inertia(&mut self) -> Vec<usize> {
        let d = self.scratch.len();
        self.composites.assemble(&self.states, &mut self.mass, &mut self.scratch);
        self.add_rows(d);
        let entry = |i: usize, j: usize| self.mass[i.max(j) * d + i.min(j)];
        let unit = |i: usize| if entry(i, i) > 0.0 { entry(i, i).sqrt() } else { 1.0 };
        let scaled = DMatrix::from_fn(d, d, |i, j| entry(i, j) / (unit(i) * unit(j)));
        if !scaled.iter().all(|entry| entry.is_finite()) {
            // The decomposition does not end.
            return Vec::new();
        }
        let eigen = scaled.symmetric_eigen();
        let free = (0..d).filter(|&mode| eigen.eigenvalues[mode] <= HALF_DIGITS);
        let moves =
            |i: usize| free.clone().any(|mode| eigen.eigenvectors[(i, mode)].abs() > HALF_DIGITS.sqrt());
        let bodies = self.tree.bodies.iter().enumerate();
        bodies
            .filter(|(_, body)| body.mass == 0.0 || body.inertia == 0.0)
            .filter(|(_, body)| self.tree.paths[body.frame].free.iter().any(|&(_, i)| moves(i)))
            .map(|(index, _)| index)
            .collect()
    }
}
