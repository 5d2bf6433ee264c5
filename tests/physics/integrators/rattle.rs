//! A journal that rattles in a swinging bearing under a turning load: impacts that slide and stick.
//!
//! The smallest system with everything that makes a clearance joint hard to integrate, drawn at random
//! so that methods are compared over an ensemble: the error of a single scene scatters by a factor of 4.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::contact::pair::{ContactLaw, Phase, RelativeMotion, SlidingVelocity, Surfaces};
use chebclear::dynamics::Linearization;
use chebclear::integrators::events::Guard;
use chebclear::integrators::{HybridSystem, Limits, Outcome, Status, Stepper, integrate};
use chebclear::numerics::instant::Instant;

use crate::support::Random;

/// 2000 r/min [rad/s].
const SPEED: f64 = 2000.0 * std::f64::consts::PI / 30.0;
/// Radii of the paper's wrist joint [m].
const JOURNAL: f64 = 9.8e-3;
const BEARING: f64 = 9.82e-3;
const MASS: f64 = 0.14;
const INERTIA: f64 = 1e-4;
/// Scales of the tolerance and of the error [m], [m/s], [rad/s].
const SCALES: [f64; 3] = [1e-5, 1.0, 100.0];

/// What is drawn at random, and how the system answers the integrator.
#[derive(Clone, Debug)]
pub struct Rattle {
    pub law: ContactLaw,
    /// Amplitudes of the load, cos along x and sin along y [N].
    pub load: [f64; 2],
    /// Amplitude of the bearing's angular velocity [rad/s].
    pub swing: f64,
    /// Velocity at the start, in the center of the bearing [m/s].
    pub start: [f64; 2],
    pub impact_velocity_floor: f64,
    /// Simulated time [s]: 1.5 ms see about 14 contact changes.
    pub duration: f64,
    /// Velocity tolerance in contact, as a part of the velocity at which friction is steep.
    pub stick_part: f64,
    rtol: f64,
    phase: Phase,
    step_bound: f64,
}

impl Rattle {
    /// The nominal scene: the paper's wrist joint with the friction coefficients given.
    pub fn nominal(friction: [f64; 2], stick_slip_velocity: f64) -> Self {
        Self {
            law: ContactLaw {
                clearance: 2e-5,
                surfaces: Surfaces::Bearing { journal_radius: JOURNAL, bearing_radius: BEARING },
                normal: NormalLaw {
                    stiffness: 3.326530256934e11,
                    exponent: 1.5,
                    damping: Damping::LankaraniNikravesh { restitution: 0.9 },
                },
                friction: Some(FrictionLaw::ModifiedCoulomb {
                    static_coefficient: friction[0],
                    sliding_coefficient: friction[1],
                    stick_slip_velocity,
                    static_sliding_velocity: 1.5 * stick_slip_velocity,
                }),
                sliding: SlidingVelocity::Surface,
            },
            load: [307.0, 60.0],
            swing: 87.0,
            start: [0.0; 2],
            impact_velocity_floor: 2.65e-3,
            duration: 1.5e-3,
            stick_part: 0.1,
            rtol: 1e-6,
            phase: Phase::Free,
            step_bound: f64::INFINITY,
        }
    }

    /// Friction of the paper: the contacts slide.
    pub fn sliding(random: &mut Random) -> Self {
        Self::drawn([0.04, 0.03], random)
    }

    /// Ten times that friction: after a few impacts the contacts stick.
    pub fn sticking(random: &mut Random) -> Self {
        Self::drawn([0.4, 0.3], random)
    }

    fn drawn(friction: [f64; 2], random: &mut Random) -> Self {
        let mut scene = Self::nominal(friction, 10_f64.powf(random.within(-4.0, -3.0)));
        scene.load = [307.0 * random.within(0.5, 1.5), 60.0 * random.within(0.5, 1.5)];
        scene.swing *= random.within(0.5, 1.5);
        scene.law.normal.damping = Damping::LankaraniNikravesh { restitution: random.within(0.85, 0.95) };
        scene.start = [random.within(-0.1, 0.1), random.within(-0.1, 0.1)];
        scene
    }

    /// Integrates the scene; the outcome and the state (x, y, vx, vy, angular velocity) at the end.
    pub fn run(&self, method: &mut dyn Stepper, rtol: f64) -> (Outcome, [f64; 5]) {
        let mut scene = Self { rtol, ..self.clone() };
        let (mut q, mut v) = ([0.0; 3], [self.start[0], self.start[1], 0.0]);
        let limits = Limits { max_steps: 3_000_000, ..Limits::default() };
        let duration = self.duration;
        let outcome = integrate(&mut scene, method, limits, 0.0, duration, &mut q, &mut v);
        (outcome, [q[0], q[1], v[0], v[1], v[2]])
    }

    fn motion(&self, t: f64, q: &[f64], v: &[f64]) -> RelativeMotion<f64> {
        let bearing = self.swing * (SPEED * t).cos();
        RelativeMotion {
            eccentricity: [q[0], q[1]],
            rate: [v[0], v[1]],
            spin: v[2] * JOURNAL - bearing * BEARING,
            roll: 0.0,
        }
    }

    fn bound_step(&mut self, v: &[f64], a: &[f64]) {
        self.step_bound = f64::INFINITY;
        if self.phase == Phase::Free {
            let (rate, acceleration) = (v[0].hypot(v[1]), a[0].hypot(a[1]));
            let clearance = self.law.clearance;
            self.step_bound = clearance / (rate + (rate * rate + acceleration * clearance).sqrt());
        }
    }
}

/// Distance of two ends in the scales of the tolerance.
pub fn distance(a: &[f64; 5], b: &[f64; 5]) -> f64 {
    let scales = [SCALES[0], SCALES[0], SCALES[1], SCALES[1], SCALES[2]];
    a.iter().zip(b).zip(scales).map(|((a, b), scale)| (a - b).abs() / scale).fold(0.0, f64::max)
}

impl HybridSystem for Rattle {
    fn dimension(&self) -> usize {
        3
    }

    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        let state = self.law.evaluate(&self.motion(t.time, q, v), self.phase);
        let (sin, cos) = (SPEED * t.time).sin_cos();
        a[0] = (self.load[0] * cos + state.force[0]) / MASS;
        a[1] = (self.load[1] * sin + state.force[1]) / MASS;
        a[2] = JOURNAL * state.friction_force / INERTIA;
        a.iter().all(|a| a.is_finite())
    }

    fn begin(&mut self, _t: f64, _q: &[f64], v: &[f64], a: &[f64]) {
        self.bound_step(v, a);
    }

    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        let exists = self.acceleration(t.into(), q, v, &mut linear.a);
        let forces = self.law.force_gradient(&self.motion(t, q, v), self.phase);
        let (sin, cos) = (SPEED * t).sin_cos();
        let spin_rate = self.swing * SPEED * sin * BEARING;
        let load_rate = [-self.load[0] * SPEED * sin, self.load[1] * SPEED * cos, 0.0];
        let weights = [1.0 / MASS, 1.0 / MASS, JOURNAL / INERTIA];
        linear.a_q.fill(0.0);
        for (row, (force, weight)) in forces.iter().zip(weights).enumerate() {
            let g = force.gradient;
            linear.a_q[3 * row..3 * row + 2].copy_from_slice(&[g[0] * weight, g[1] * weight]);
            let by_velocity = [g[2], g[3], g[4] * JOURNAL];
            for (k, by) in by_velocity.into_iter().enumerate() {
                linear.a_v[3 * row + k] = by * weight;
            }
            linear.a_t[row] = g[4] * spin_rate * weight + load_rate[row] / MASS;
        }
        exists
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        let stick = self.law.friction.as_ref().map_or(f64::INFINITY, |law| law.stick_velocity());
        let widest = if self.phase == Phase::Free { f64::INFINITY } else { self.stick_part * stick };
        position.copy_from_slice(&[SCALES[0] * self.rtol, SCALES[0] * self.rtol, 1e-3 * self.rtol]);
        let linear = (SCALES[1] * self.rtol).min(widest);
        velocity.copy_from_slice(&[linear, linear, (SCALES[2] * self.rtol).min(widest / JOURNAL)]);
    }

    fn step_bound(&self) -> f64 {
        self.step_bound
    }

    fn guard_count(&self) -> usize {
        2
    }

    fn guards(&mut self, t: Instant, q: &[f64], v: &[f64], guards: &mut [Guard]) {
        let state = self.law.evaluate(&self.motion(t.time, q, v), self.phase);
        let sign = if self.phase == Phase::Free { -1.0 } else { 1.0 };
        let resolution = 4.0 * f64::EPSILON * 4e-5;
        guards[0] = Guard {
            value: sign * state.penetration,
            rate: sign * state.penetration_rate,
            margin: 0.0,
            resolution,
            overshoot: (8.0 * resolution).max(1e-2 * SCALES[0] * self.rtol),
        };
        guards[1] = match self.phase {
            Phase::Contact { latch, clipped, .. } => {
                let law = &self.law.normal;
                let ratio = law.force_ratio(state.penetration, state.penetration_rate, latch);
                let slope = law.force_ratio_slope(state.penetration, state.penetration_rate, latch);
                let resolution = 64.0 * f64::EPSILON + slope * (1e-15 + 1e-3 * SCALES[1] * self.rtol);
                Guard {
                    value: if clipped { -ratio } else { ratio },
                    rate: f64::NAN,
                    margin: 0.25,
                    resolution,
                    overshoot: (8.0 * resolution).max(1e-4),
                }
            }
            Phase::Free | Phase::Beyond => Guard::INACTIVE,
        };
    }

    fn cross(&mut self, guard: usize, t: f64, q: &[f64], v: &mut [f64]) -> Result<f64, Status> {
        let state = self.law.evaluate(&self.motion(t, q, v), self.phase);
        let mut bound = f64::INFINITY;
        self.phase = match (guard, self.phase) {
            (0, Phase::Free) => {
                let impact_velocity = state.penetration_rate.max(self.impact_velocity_floor);
                // Of a free journal: the surfaces meet along the normal, friction does not count.
                let impact_time = self.law.normal.impact_time(MASS, impact_velocity);
                bound = self.rtol.powf(0.4) * impact_time;
                let latch = self.law.normal.latch(impact_velocity);
                Phase::Contact { latch, clipped: false, traction: None }
            }
            (0, Phase::Contact { .. }) => Phase::Free,
            (_, Phase::Contact { latch, clipped, traction }) => {
                Phase::Contact { latch, clipped: !clipped, traction }
            }
            (_, Phase::Free | Phase::Beyond) => Phase::Free,
        };
        Ok(bound)
    }
}
