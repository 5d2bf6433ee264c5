//! Projection of a state onto the closures, and what gaps are rounding errors.

use super::{DAMPING, NEARLY_DEPENDENT};
use crate::dynamics::Dynamics;
use crate::numerics::accuracy::{NEWTON_STEPS, ROUNDING_OF_CHAIN};
use crate::tree::elements::{CLOSURE_ROWS, Scales};

/// What a projection onto the loop closures corrected; [`Dynamics::corrections`] are its sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// Whether the gaps were rounding errors alone. Near a dead center these may still move a coordinate far.
    pub rounded_position: bool,
    /// Whether the gap rates were rounding errors alone.
    pub rounded_velocity: bool,
    /// Whether the closures are nearly dependent: a correction of the velocities across the closures changes the motion
    /// along them in second order only.
    pub nearly_dependent: bool,
}

/// Positions or velocities.
#[derive(Clone, Copy, Debug)]
enum Level {
    Position,
    Velocity,
}

/// What gaps and gap rates may be.
#[derive(Clone, Copy, Debug)]
struct Gaps {
    /// The closures are nearly dependent, and the motion passes: where they are pulled apart instead, velocities grow as
    /// the inverse of the angle between them.
    passes: bool,
    /// All gaps are rounding errors.
    closed: bool,
    /// All gaps are about one rounding error.
    unknown: bool,
    /// All gap rates are rounding errors, also of what one rounding error of a gap makes of them near a change point.
    unknown_rates: bool,
    /// All gap rates are what rounding errors of the gaps may have left of a passage over a change point.
    rounded_rates: bool,
}

impl Dynamics<'_> {
    /// Projects a state that nearly closes the loops onto the closures, in the metric of the mass matrix:
    /// positions by Newton's method, then velocities. Returns what was corrected, or `None` in
    /// a singular configuration or where Newton's method does not converge.
    pub fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64], scales: &Scales) -> Option<Correction> {
        let mut correction =
            Correction { rounded_position: true, rounded_velocity: true, ..Correction::default() };
        let mut closed = !self.tree.has_loops();
        self.corrections.iter_mut().for_each(|of| of.fill(0.0));
        let mut a = std::mem::take(&mut self.scratch);
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON_STEPS {
            if closed || !self.acceleration(t, q, v, &mut a) {
                break;
            }
            let gaps = self.gaps(q, v, scales);
            closed = gaps.closed;
            correction.rounded_position &= closed;
            // Near a change point the rounding errors of gaps move the state far: they are left alone there, and
            // nothing is known of the velocities within the reach of the damping.
            let near = gaps.passes;
            let lost = near && self.loops.weakest_pivot < DAMPING;
            correction.nearly_dependent |= near;
            if !(near && closed && (lost || gaps.unknown)) {
                self.close(q, &mut a, !closed, Level::Position);
                let moved = scales.largest_of_all(&a);
                if !closed && moved > last {
                    // What Newton's method might find from there on is any way to close the loops.
                    break;
                }
                last = moved;
                if near {
                    // What moved the positions changes the gap rates.
                    closed = false;
                    continue;
                }
            }
            if closed {
                correction.rounded_velocity = gaps.rounded_rates;
                if !(near && (lost || gaps.unknown_rates)) {
                    // The positions changed by rounding alone since the gap rates were found.
                    self.close(v, &mut a, false, Level::Velocity);
                }
            }
        }
        self.scratch = a;
        closed.then_some(correction)
    }

    /// Largest changes of all coordinates in the last projection, and of their velocities.
    pub fn corrections(&self) -> [&[f64]; 2] {
        self.corrections.each_ref().map(Vec::as_slice)
    }

    /// The component of a closure, coupling or lock, by the order of their rows.
    fn component_of_rows(&self, index: usize) -> usize {
        let tree = self.tree;
        let closures = tree.closures.iter().map(|closure| closure.bodies);
        let couplings = tree.couplings.iter().map(|coupling| coupling.driven.bodies);
        let bodies = closures.chain(couplings).nth(index).unwrap_or([None; 2]);
        tree.components.of(bodies).unwrap_or_default()
    }

    /// What the gaps and gap rates are, after [`Dynamics::acceleration`].
    fn gaps(&self, q: &[f64], v: &[f64], scales: &Scales) -> Gaps {
        let loops = &self.loops;
        let passes = self.passes(v, scales);
        // The rounding error of a large angle counts at the size of the component. The velocity of a point
        // may be a sum of much larger terms, whose rounding errors count.
        let of = |index: usize| {
            let component = self.component_of_rows(index);
            let scale = &scales.components[component];
            let (size, speed) =
                (scale.length + scales.largest(component, q), scale.speed + scales.largest(component, v));
            // Gap rates per gap.
            let at = |pivot: f64| speed / scale.length / pivot.sqrt();
            let rates = if passes {
                [at(loops.weakest_pivot.max(DAMPING)), at(DAMPING)]
            } else if loops.nearly_dependent {
                [0.0, 0.0]
            } else {
                [0.0, at(NEARLY_DEPENDENT)]
            };
            ([size, speed, scale.length], rates)
        };
        let all = Gaps { passes, closed: true, unknown: true, unknown_rates: true, rounded_rates: true };
        let judge =
            |all: Gaps, [here, left]: [f64; 2], [gap, reach]: [f64; 2], [rate, rounded]: [f64; 2]| Gaps {
                passes,
                closed: all.closed && gap <= ROUNDING_OF_CHAIN * reach,
                unknown: all.unknown && gap <= f64::EPSILON * reach,
                unknown_rates: all.unknown_rates && rate <= rounded + f64::EPSILON * reach * here,
                rounded_rates: all.rounded_rates && rate <= rounded + ROUNDING_OF_CHAIN * reach * left,
            };
        let closures = self.tree.closures.iter().enumerate();
        let closed = closures.fold(all, |all, (index, closure)| {
            let ([size, speed, _], rates) = of(index);
            let (a, b) = (self.point(closure.a), self.point(closure.b));
            let (gap, rate) = ((b.position - a.position).amax(), (b.velocity - a.velocity).amax());
            let reach = a.position.amax() + b.position.amax() + size;
            let rounded = ROUNDING_OF_CHAIN * (a.velocity.amax() + b.velocity.amax() + speed);
            judge(all, rates, [gap, reach], [rate, rounded])
        });
        self.tree.couplings.iter().zip(self.tree.closures.len()..).fold(closed, |all, (coupling, index)| {
            let (sizes, rates) = of(index);
            let motion = self.coupling_motion(coupling);
            let [reach, of_rate] = motion.reach(coupling, sizes);
            judge(all, rates, [motion.gap.abs(), reach], [motion.rate.abs(), ROUNDING_OF_CHAIN * of_rate])
        })
    }

    /// Whether the closures are nearly dependent after [`Dynamics::acceleration`], so that the forces in them are not
    /// known: near a change point.
    pub fn is_near_change_point(&self) -> bool {
        self.loops.nearly_dependent
    }

    /// Whether nothing is known of velocities and accelerations across the closures: at a change point.
    pub fn is_at_change_point(&self) -> bool {
        self.loops.nearly_dependent && self.loops.weakest_pivot < DAMPING
    }

    /// Whether the motion passes over a change point within whose reach the state last evaluated is.
    pub fn passes_change_point(&self, v: &[f64], scales: &Scales) -> bool {
        self.is_at_change_point() && self.passes(v, scales)
    }

    /// Whether the closures are nearly dependent, but do not act upon a motion of these velocities as where they are pulled
    /// apart.
    fn passes(&self, v: &[f64], scales: &Scales) -> bool {
        self.loops.nearly_dependent && {
            let weakest = self.component_of_rows(self.loops.weakest);
            let scale = scales.components[weakest].speed;
            scales.largest(weakest, v).powi(2) * self.loops.weakest_pivot
                <= NEARLY_DEPENDENT.sqrt() * scale * scale
        }
    }

    /// One correction of `x`, positions or velocities, toward closed loops.
    fn close(&mut self, x: &mut [f64], change: &mut [f64], undamped: bool, level: Level) {
        let tree = self.tree;
        for (index, closure) in tree.closures.iter().enumerate() {
            let (a, b) = (self.point(closure.a), self.point(closure.b));
            let gap = match level {
                Level::Position => b.position - a.position,
                Level::Velocity => b.velocity - a.velocity,
            };
            self.loops.right[2 * index] = gap.x;
            self.loops.right[2 * index + 1] = gap.y;
        }
        for (row, coupling) in (CLOSURE_ROWS * tree.closures.len()..).zip(&tree.couplings) {
            self.loops.right[row] = match level {
                Level::Position => self.coupling_motion(coupling).gap,
                Level::Velocity => self.coupling_motion(coupling).rate,
            };
        }
        change.fill(0.0);
        if undamped {
            self.loops.correct_undamped(change);
        } else {
            self.loops.correct(change);
        }
        let largest = match level {
            Level::Position => &mut self.corrections[0],
            Level::Velocity => &mut self.corrections[1],
        };
        for ((x, change), largest) in x.iter_mut().zip(change).zip(largest) {
            *x += *change;
            *largest = match level {
                Level::Position => largest.max(change.abs()),
                Level::Velocity => change.abs(),
            };
        }
    }
}
