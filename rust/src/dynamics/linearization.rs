//! Exact derivatives of the accelerations with respect to positions, velocities and time.

use crate::contact::pair::{Phase, RelativeMotion, Surfaces};
use crate::dynamics::Dynamics;
use crate::dynamics::forces::inputs;
use crate::numerics::dual::{Dual, Scalar};
use crate::numerics::linear::symmetric_solve;
use crate::tree::elements::{ContactSlot, FramePoint};
use crate::tree::kinematics::{Coordinate, Vec2, perp};

/// Derivatives of the accelerations a(t, q, v): row-major d x d matrices and a vector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Linearization {
    /// The accelerations themselves.
    pub a: Vec<f64>,
    /// ∂a/∂q.
    pub a_q: Vec<f64>,
    /// ∂a/∂v.
    pub a_v: Vec<f64>,
    /// ∂a/∂t.
    pub a_t: Vec<f64>,
}

impl Linearization {
    /// Zeros for `d` degrees of freedom.
    pub fn new(d: usize) -> Self {
        Self { a: vec![0.0; d], a_q: vec![0.0; d * d], a_v: vec![0.0; d * d], a_t: vec![0.0; d] }
    }
}

/// Derivatives of the relative motion of two points with respect to the coordinate of a column: of the vector between
/// them, of its rate, and of the angular velocities on which their force depends, each times its radii.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PairColumn {
    eccentricity: Vec2,
    rate: Vec2,
    spins: [f64; 2],
}

impl Dynamics<'_> {
    /// Accelerations and their exact derivatives. Returns false as [`Dynamics::acceleration`].
    ///
    /// With the residual `R(z, ż, z̈) = Bᵀ(M q̈ - Q) = 0` the derivatives are
    /// `M a_q = -∂R/∂q` and `M a_v = -∂R/∂v`. Driven coordinates and applied forces depend on time,
    /// so `M a_t = -∂R/∂t - Σ_driven (∂R/∂z ż + ∂R/∂ż z̈ + ∂R/∂z̈ d³z/dt³)`.
    pub fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], out: &mut Linearization) -> bool {
        if !self.acceleration(t, q, v, &mut out.a) {
            return false;
        }
        self.accelerate(&out.a);
        self.find_residual_derivatives();
        let d = out.a.len();
        // Computed transposed, so that every derivative is solved for as a contiguous row.
        for (freedom, &column) in self.tree.free.iter().enumerate() {
            let row = freedom * d..(freedom + 1) * d;
            self.accelerations_by(&mut out.a_q[row.clone()], |this, r| this.residual_by_position(r, column));
            self.accelerations_by(&mut out.a_v[row], |this, r| this.residual_by_velocity(r, column));
        }
        transpose(&mut out.a_q, d);
        transpose(&mut out.a_v, d);
        self.accelerations_by(&mut out.a_t, Self::residual_by_time);
        true
    }

    /// Finds the derivatives of the residuals, after [`Dynamics::accelerate`].
    pub(super) fn find_residual_derivatives(&mut self) {
        self.residual_q.fill(0.0);
        self.residual_v.fill(0.0);
        self.residual_t.fill(0.0);
        self.add_inertia_derivatives();
        for index in 0..self.phases.len() {
            if let Phase::Contact { clipped: false, .. } = self.phases[index] {
                self.add_contact_derivatives(index);
            }
        }
        self.add_force_derivatives();
        self.add_closure_derivatives();
        self.add_jerks();
    }

    /// Derivative of a residual with respect to time, by which drives move.
    pub(super) fn residual_by_time(&self, row: usize) -> f64 {
        self.tree.driven.iter().fold(self.residual_t[row], |sum, driven| {
            let Coordinate { velocity, acceleration, .. } = self.coordinates[driven.column];
            sum + self.residual_by_position(row, driven.column) * velocity
                + self.residual_by_velocity(row, driven.column) * acceleration
        })
    }

    /// Derivative of residual `row` with respect to the position of a column. Rows below d are force
    /// residuals, the others relative accelerations of the closures.
    #[inline]
    pub(super) fn residual_by_position(&self, row: usize, column: usize) -> f64 {
        self.entry(&self.residual_q, &self.loops.acceleration_q, row, column)
    }

    /// The same with respect to the velocity.
    #[inline]
    pub(super) fn residual_by_velocity(&self, row: usize, column: usize) -> f64 {
        self.entry(&self.residual_v, &self.loops.acceleration_v, row, column)
    }

    #[inline]
    fn entry(&self, force: &[f64], closure: &[f64], row: usize, column: usize) -> f64 {
        let (d, columns) = (self.tree.free.len(), self.coordinates.len());
        if row < d { force[row * columns + column] } else { closure[(row - d) * columns + column] }
    }

    /// Change of the accelerations that compensates a change of the residuals: of the force residual
    /// (rows below d) and of the relative accelerations of the closures (other rows).
    pub(super) fn accelerations_by(&mut self, out: &mut [f64], residual: impl Fn(&Self, usize) -> f64) {
        let d = out.len();
        for (i, value) in out.iter_mut().enumerate() {
            *value = -residual(self, i);
        }
        symmetric_solve(&self.mass, d, out);
        let rows = self.loops.right.len();
        for r in 0..rows {
            self.loops.right[r] = residual(self, d + r);
        }
        if rows > 0 {
            self.loops.correct(out);
        }
    }

    /// ∂²r/∂z_j∂z_k of a point that both frames move.
    #[inline]
    pub(super) fn second_column(&self, j: usize, k: usize, point: Vec2) -> Vec2 {
        let (upper, lower) = (j.min(k), j.max(k));
        self.states[upper + 1].rotation * perp(self.states[lower + 1].column(point))
    }

    fn add_contact_derivatives(&mut self, index: usize) {
        let slot = &self.tree.slots[index];
        // δ ≤ 0 by rounding in the contact phase: the derivatives vanish with the force.
        let vanishes = |x: f64, y: f64| x == 0.0 && y == 0.0;
        let phase = self.phases[index];
        match slot.law.surfaces {
            _ if slot.law.stick_slip().is_some() => self.add_stick_slip_derivatives(slot, phase),
            Surfaces::Bearing { bearing_radius, journal_radius } => {
                let [x, y, friction] = slot.law.force_gradient(&self.contact_motion(slot), phase);
                if !vanishes(x.value, y.value) {
                    self.add_pair_derivatives(
                        slot.points,
                        [[bearing_radius, journal_radius]],
                        [x, y],
                        [friction],
                    );
                }
            }
            Surfaces::Face(_) | Surfaces::Worn(_) => {
                if let Some(index) = slot.backlash {
                    let backlash = &self.tree.backlashes[index];
                    return self.add_flank_derivatives(slot, backlash, phase);
                }
                let (force, moments) = self.gradient_seen_from_first::<7>(slot, phase);
                if !vanishes(force[0].value, force[1].value) {
                    self.add_pair_derivatives(slot.points, [[1.0, 0.0], [0.0, 1.0]], force, moments);
                }
            }
        }
    }

    /// The same with friction that can stick, which depends on the angles of both bodies too.
    #[inline(never)]
    fn add_stick_slip_derivatives(&mut self, slot: &ContactSlot, phase: Phase) {
        let (force, moments) = match slot.law.surfaces {
            Surfaces::Bearing { journal_radius, .. } => {
                self.stick_slip_gradient_in_bearing(slot, journal_radius, phase)
            }
            Surfaces::Face(_) | Surfaces::Worn(_) => self.gradient_seen_from_first::<8>(slot, phase),
        };
        self.add_pair_derivatives(slot.points, [[1.0, 0.0], [0.0, 1.0]], force, moments);
    }

    /// That in a bearing, in the form and with the derivatives of [`Dynamics::gradient_seen_from_first`].
    fn stick_slip_gradient_in_bearing(
        &self,
        slot: &ContactSlot,
        journal_radius: f64,
        phase: Phase,
    ) -> ([Dual<8>; 2], [Dual<8>; 2]) {
        let at = self.rolled(slot, phase, self.contact_motion(slot));
        let [[x, y], rate] = inputs([at.eccentricity.into(), at.rate.into()]);
        let arm = match phase {
            Phase::Contact { traction: Some(traction), .. } if traction.sticks() => {
                Dual::constant(traction.arm)
            }
            _ => (x * x + y * y).sqrt(),
        };
        let [first, second] = slot.points.map(|point| self.states[point.frame].angular_velocity);
        let turning = [-Dual::input(-first, 4), Dual::input(second, 5)];
        let turned = [-Dual::input(0.0, 6), Dual::input(0.0, 7)];
        let motion = RelativeMotion {
            eccentricity: [x, y],
            rate,
            spin: slot.law.rolling(arm, turning),
            roll: slot.law.rolling(arm, turned) + at.roll,
        };
        let state = slot.law.evaluate(&motion, phase);
        let on_journal = state.friction_force * journal_radius;
        (state.force, [on_journal + x * state.force[1] - y * state.force[0], on_journal])
    }

    /// Force at a face or in a worn bearing on the second body, in the world frame, with the moment of its reaction about the first point and
    /// that of the force about the second. Derivatives with respect to e and ė in the world frame, minus the angular
    /// velocity of the first body, the angular velocity of the second, and minus the angle of the first; with eight also to
    /// the angle of the second.
    fn gradient_seen_from_first<const N: usize>(
        &self,
        slot: &ContactSlot,
        phase: Phase,
    ) -> ([Dual<N>; 2], [Dual<N>; 2]) {
        let [_, radius] = slot.law.radii();
        let [e, rate] = inputs(self.between(slot.points));
        let [first, second] = slot.points.map(|point| &self.states[point.frame]);
        let back = Dual::input(-first.angular_velocity, 4);
        let spin = (Dual::input(second.angular_velocity, 5) + back) * radius;
        let turned = |value, rate| {
            let mut gradient = [0.0; N];
            gradient[6] = rate;
            Dual { value, gradient }
        };
        let (cosine, sine) = (turned(first.cosine, first.sine), turned(first.sine, -first.cosine));
        let in_face = |[x, y]: [Dual<N>; 2]| [cosine * x + sine * y, cosine * y - sine * x];
        let against = [rate[0] - back * e[1], rate[1] + back * e[0]];
        let roll = if N == 8 {
            let RelativeMotion { roll, .. } = self.rolled(slot, phase, self.contact_motion(slot));
            turned(roll, radius) + (Dual::input(0.0, 7) * radius)
        } else {
            Dual::constant(0.0)
        };
        let motion = RelativeMotion { eccentricity: in_face(e), rate: in_face(against), spin, roll };
        let state = if N == 8 {
            slot.law.evaluate(&motion, phase)
        } else {
            slot.law.without_sticking(&motion, phase)
        };
        let [x, y] = state.force;
        let force = [cosine * x - sine * y, sine * x + cosine * y];
        let own = state.friction_force * radius;
        (force, [e[0] * force[1] - e[1] * force[0] + own, own])
    }

    // Long because force and moments share the columns of the pair.
    /// Adds the derivatives of a force on point b, its reaction on point a, and their moments. Each moment belongs to an
    /// angular velocity: the sum of those of both bodies, each times its radius, b less a. Force and moments depend on the
    /// vector from a to b, its rate and these angular velocities; with more lanes also on the angles whose rates these are.
    pub(super) fn add_pair_derivatives<const N: usize, const M: usize>(
        &mut self,
        [a, b]: [FramePoint; 2],
        radii: [[f64; 2]; M],
        [force_x, force_y]: [Dual<N>; 2],
        moments: [Dual<N>; M],
    ) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        let force = Vec2::new(force_x.value, force_y.value);
        let ends = [(b, 1, 1.0), (a, 0, -1.0)];
        // Later columns move neither point.
        let last = ends.iter().filter_map(|(point, ..)| tree.paths[point.frame].columns.last()).max();
        let Some(moving) = last.map(|last| last + 1) else { return };
        self.pair_columns[..moving].fill(PairColumn::default());
        for (point, end, sign) in ends {
            let state = self.point(point);
            for &column in &tree.paths[point.frame].columns {
                let frame = &self.states[column + 1];
                let entry = &mut self.pair_columns[column];
                entry.eccentricity += sign * frame.column(state.position);
                entry.rate += sign * frame.velocity_column(state.velocity);
                for (spin, radii) in entry.spins.iter_mut().zip(&radii) {
                    *spin += sign * frame.rotation * radii[end];
                }
            }
        }
        // -∂/∂z_k of E_iᵀ F + S_iᵀ M, first through the force, then through E_i.
        for k in 0..moving {
            let by = self.pair_columns[k];
            if by == PairColumn::default() {
                // On another branch of the tree.
                continue;
            }
            let (fx_q, fx_v) = directional(&force_x, &by);
            let (fy_q, fy_v) = directional(&force_y, &by);
            let turning = moments.each_ref().map(|moment| directional(moment, &by));
            for (i, &column) in tree.free.iter().enumerate() {
                if column >= moving {
                    break;
                }
                let of = &self.pair_columns[column];
                let place = i * columns + k;
                let mut by_position = of.eccentricity.x * fx_q + of.eccentricity.y * fy_q;
                let mut by_velocity = of.eccentricity.x * fx_v + of.eccentricity.y * fy_v;
                for (spin, (m_q, m_v)) in of.spins.iter().zip(turning) {
                    by_position += spin * m_q;
                    by_velocity += spin * m_v;
                }
                self.residual_q[place] -= by_position;
                self.residual_v[place] -= by_velocity;
            }
        }
        for (point, _, sign) in ends {
            let position = self.point(point).position;
            let path = &tree.paths[point.frame];
            for &k in &path.columns {
                for &(column, i) in &path.free {
                    self.residual_q[i * columns + k] -=
                        sign * self.second_column(column, k, position).dot(&force);
                }
            }
        }
    }
}

/// Derivative of a force component with respect to the position and the velocity of a column.
#[inline]
fn directional<const N: usize>(component: &Dual<N>, by: &PairColumn) -> (f64, f64) {
    let g = &component.gradient;
    let mut by_position =
        g[0] * by.eccentricity.x + g[1] * by.eccentricity.y + g[2] * by.rate.x + g[3] * by.rate.y;
    let mut by_velocity = g[2] * by.eccentricity.x + g[3] * by.eccentricity.y + g[4] * by.spins[0];
    if N >= 7 {
        by_velocity += g[5] * by.spins[1];
        by_position += g[6] * by.spins[0];
    }
    if N == 8 {
        by_position += g[7] * by.spins[1];
    }
    (by_position, by_velocity)
}

fn transpose(matrix: &mut [f64], n: usize) {
    for i in 0..n {
        for j in i + 1..n {
            matrix.swap(i * n + j, j * n + i);
        }
    }
}
