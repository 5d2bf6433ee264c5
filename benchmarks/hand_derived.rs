//! What a general program costs beside codes written by hand for one mechanism; see README.md.
//!
//! cargo bench --bench hand_derived [-- [--all] [SCENES]]

#[path = "../tests/physics/support.rs"]
#[allow(dead_code)]
mod support;

use std::f64::consts::{FRAC_PI_2, PI};

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::Damping;
use chebclear::contact::pair::SlidingVelocity;
use chebclear::integrators::Status;
use chebclear::integrators::tableaus::{RODAS4, RODAS5P, Tableau};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::{Method, Settings};
use chebclear::run::trajectory::simulate;
use chebclear::scene::parts::{Drive, Joint, Scene};
use cpu_time::ThreadTime;
use support::Random;

const DURATION: f64 = 0.06;
const SAMPLES: usize = 1441;
const COLUMNS: [&str; 4] = ["slider.x", "slider.vx", "slider.ax", "wrist.normal_force"];
/// The column whose error counts.
const VELOCITY: usize = 1;
/// Relative tolerances: two a decade from here on.
const LOOSEST: f64 = 1e-1;
const SETTINGS: i32 = 15;
const TARGETS: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
const REPEATS: usize = 4;
/// Scenes of a convention, unless the command line tells.
const COUNT: usize = 12;
/// References of two methods that are further apart than this part of the range are left out: too chaotic.
const LARGEST_GAP: f64 = 2e-6;
/// Steps after which a code by hand gives up: one at a loose tolerance may never get out of a contact.
const MOST_STEPS: usize = 100_000;
/// What a Jacobian costs in evaluations.
const JACOBIAN: usize = 2;

const OURS: [(&str, Method); 4] = [
    ("auto", Method::Auto),
    ("rodas4", Method::Rodas4),
    ("dop853", Method::Dop853),
    ("adams", Method::Adams),
];
const BY_HAND: [&str; 3] = ["Dormand-Prince 5", "Rodas4", "Rodas5P"];

/// (rod angle, slider position, their rates).
type State = [f64; 4];

/// The paper's slider-crank, its equations of motion derived by hand for two coordinates.
#[derive(Clone, Copy)]
struct SliderCrank {
    crank: f64,
    speed: f64,
    rod: f64,
    /// Mass of the rod times the distance of its center.
    rod_moment: f64,
    /// Moment of inertia of the rod about the crank pin.
    rod_inertia: f64,
    slider_mass: f64,
    clearance: f64,
    bearing_radius: f64,
    stiffness: f64,
    /// Hysteresis factor times impact velocity.
    hysteresis: f64,
    impact_velocity_floor: f64,
    friction: [f64; 4],
    surface: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Free,
    /// With the hysteresis factor.
    Contact(f64),
    Clipped(f64),
}

/// A function of the state that is positive while a phase lasts.
#[derive(Clone, Copy)]
struct Guard {
    value: f64,
    rate: f64,
    /// Nearer to zero it has no sign.
    noise: f64,
}

/// The contact and what its force and derivatives need.
struct Contact {
    /// Crank pin: position and velocity.
    pin: [f64; 2],
    pin_rate: [f64; 2],
    /// Along and across the rod.
    along: [f64; 2],
    across: [f64; 2],
    distance: f64,
    normal: [f64; 2],
    penetration: f64,
    penetration_rate: f64,
    tangential: f64,
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl SliderCrank {
    /// The mechanism of a scene made by `support::slider_crank`.
    fn of(scene: &Scene) -> Self {
        let [crank, rod, slider] = &scene.bodies[..] else { unreachable!("three bodies") };
        let Drive::Speed { speed, .. } = scene.drives[0] else { unreachable!("a speed") };
        let Joint::Clearance { journal_radius, clearance, contact, friction, sliding, .. } = &scene.joints[3]
        else {
            unreachable!("a clearance joint")
        };
        let Some(FrictionLaw::ModifiedCoulomb {
            static_coefficient,
            sliding_coefficient,
            stick_slip_velocity,
            static_sliding_velocity,
        }) = *friction
        else {
            unreachable!("the paper's friction")
        };
        let Damping::LankaraniNikravesh { restitution } = contact.damping else { unreachable!() };
        let center = rod.center_of_mass[0];
        Self {
            crank: crank.points[1].position[0],
            speed,
            rod: rod.points[1].position[0],
            rod_moment: rod.mass * center,
            rod_inertia: rod.inertia + rod.mass * center * center,
            slider_mass: slider.mass,
            clearance: *clearance,
            bearing_radius: journal_radius + clearance,
            stiffness: contact.stiffness,
            hysteresis: 0.75 * (1.0 - restitution * restitution),
            impact_velocity_floor: 1e-6,
            friction: [static_coefficient, sliding_coefficient, stick_slip_velocity, static_sliding_velocity],
            surface: *sliding == SlidingVelocity::Surface,
        }
    }

    #[inline]
    fn contact(&self, t: f64, y: &State) -> Contact {
        let [angle, x, turn, speed] = *y;
        let (sine, cosine) = (self.speed * t).sin_cos();
        let pin = [self.crank * cosine, self.crank * sine];
        let pin_rate = [-self.speed * pin[1], self.speed * pin[0]];
        let (sine, cosine) = angle.sin_cos();
        let (along, across) = ([cosine, sine], [-sine, cosine]);
        let tip_rate = self.rod * turn;
        let e = [x - pin[0] - self.rod * along[0], -pin[1] - self.rod * along[1]];
        let rate = [speed - pin_rate[0] - tip_rate * across[0], -pin_rate[1] - tip_rate * across[1]];
        let distance = dot(e, e).sqrt();
        let inverse = if distance > 0.0 { 1.0 / distance } else { 0.0 };
        let normal = [e[0] * inverse, e[1] * inverse];
        Contact {
            pin,
            pin_rate,
            along,
            across,
            distance,
            normal,
            penetration: distance - self.clearance,
            penetration_rate: dot(rate, normal),
            tangential: rate[1] * normal[0] - rate[0] * normal[1],
        }
    }

    /// Friction coefficient with its derivative.
    #[inline]
    fn friction(&self, v: f64) -> [f64; 2] {
        let [fixed, sliding, slow, fast] = self.friction;
        let speed = v.abs();
        if speed < slow {
            let (sine, cosine) = (FRAC_PI_2 * v / slow).sin_cos();
            return [fixed * sine, fixed * cosine * FRAC_PI_2 / slow];
        }
        if speed > fast {
            return [sliding * v.signum(), 0.0];
        }
        let (sine, cosine) = (PI * (speed - slow) / (fast - slow)).sin_cos();
        let half = 0.5 * (fixed - sliding);
        [(0.5 * (fixed + sliding) + half * cosine) * v.signum(), -half * sine * PI / (fast - slow)]
    }

    #[inline]
    fn sliding(&self, contact: &Contact, turn: f64) -> f64 {
        if self.surface {
            contact.tangential - turn * self.bearing_radius
        } else {
            contact.tangential * contact.penetration / contact.distance
        }
    }

    #[inline]
    fn normal_force(&self, contact: &Contact, phase: Phase) -> f64 {
        match phase {
            Phase::Contact(factor) if contact.penetration > 0.0 => {
                let elastic = self.stiffness * contact.penetration * contact.penetration.sqrt();
                elastic * (1.0 + factor * contact.penetration_rate)
            }
            _ => 0.0,
        }
    }

    /// Accelerations of both coordinates.
    #[inline]
    fn accelerations(&self, contact: &Contact, turn: f64, phase: Phase) -> [f64; 2] {
        let pull = self.speed * self.speed * dot(contact.across, contact.pin);
        let free = self.rod_moment * pull / self.rod_inertia;
        let pressing = self.normal_force(contact, phase);
        if pressing == 0.0 {
            return [free, 0.0];
        }
        let [nx, ny] = contact.normal;
        let coefficient = self.friction(self.sliding(contact, turn))[0];
        let force = [-pressing * (nx - coefficient * ny), -pressing * (ny + coefficient * nx)];
        let moment = self.bearing_radius * coefficient * pressing - self.rod * dot(contact.across, force);
        [free + moment / self.rod_inertia, force[0] / self.slider_mass]
    }

    #[inline]
    fn slopes(&self, t: f64, y: &State, phase: Phase) -> State {
        let [angle, x] = self.accelerations(&self.contact(t, y), y[2], phase);
        [y[2], y[3], angle, x]
    }

    /// Accelerations, and their derivatives with respect to the state and the time: [angle, x].
    fn linear(&self, t: f64, y: &State, phase: Phase) -> ([f64; 2], [[f64; 5]; 2]) {
        let contact = self.contact(t, y);
        let accelerations = self.accelerations(&contact, y[2], phase);
        let square = self.speed * self.speed;
        let mut derivatives = [[0.0; 5]; 2];
        let scale = self.rod_moment * square / self.rod_inertia;
        derivatives[0][0] = -scale * dot(contact.along, contact.pin);
        derivatives[0][4] = scale * dot(contact.across, contact.pin_rate);
        let pressing = self.normal_force(&contact, phase);
        let Phase::Contact(factor) = phase else { return (accelerations, derivatives) };
        if pressing == 0.0 {
            return (accelerations, derivatives);
        }
        let (normal, tangent) = (contact.normal, [-contact.normal[1], contact.normal[0]]);
        let [coefficient, slope] = self.friction(self.sliding(&contact, y[2]));
        let elastic = self.stiffness * contact.penetration * contact.penetration.sqrt();
        let direction = [normal[0] + coefficient * tangent[0], normal[1] + coefficient * tangent[1]];
        derivatives[0][0] -= self.rod * pressing * dot(contact.along, direction) / self.rod_inertia;
        let tip_rate = self.rod * y[2];
        // Eccentricity, its rate and the rolling velocity by each of (angle, x, their rates, time).
        let inputs = [
            (
                [-self.rod * contact.across[0], -self.rod * contact.across[1]],
                [tip_rate * contact.along[0], tip_rate * contact.along[1]],
                0.0,
            ),
            ([1.0, 0.0], [0.0, 0.0], 0.0),
            (
                [0.0, 0.0],
                [-self.rod * contact.across[0], -self.rod * contact.across[1]],
                -self.bearing_radius,
            ),
            ([0.0, 0.0], [1.0, 0.0], 0.0),
            (
                [-contact.pin_rate[0], -contact.pin_rate[1]],
                [square * contact.pin[0], square * contact.pin[1]],
                0.0,
            ),
        ];
        for (lane, (e, rate, spin)) in inputs.into_iter().enumerate() {
            let turned = dot(tangent, e) / contact.distance;
            let deeper = dot(normal, e);
            let faster = dot(normal, rate) + contact.tangential * turned;
            let across = dot(tangent, rate) - contact.penetration_rate * turned;
            let sliding = if self.surface {
                across + spin
            } else {
                (across * contact.penetration
                    + contact.tangential * deeper * self.clearance / contact.distance)
                    / contact.distance
            };
            let presses = 1.5 * pressing * deeper / contact.penetration + elastic * factor * faster;
            let force = [0, 1].map(|k| {
                let turning = turned * (tangent[k] - coefficient * normal[k]) + slope * sliding * tangent[k];
                -presses * direction[k] - pressing * turning
            });
            let friction = coefficient * presses + slope * sliding * pressing;
            let moment = self.bearing_radius * friction - self.rod * dot(contact.across, force);
            derivatives[0][lane] += moment / self.rod_inertia;
            derivatives[1][lane] += force[0] / self.slider_mass;
        }
        (accelerations, derivatives)
    }

    /// Guards of a phase, positive while it lasts: of the gap with its rate, and of the damping.
    fn guards(&self, t: f64, y: &State, phase: Phase, tolerance: f64) -> [Guard; 2] {
        let contact = self.contact(t, y);
        let Contact { penetration, penetration_rate, .. } = contact;
        let gap =
            |sign: f64| Guard { value: sign * penetration, rate: sign * penetration_rate, noise: 1e-17 };
        match phase {
            Phase::Free => [gap(-1.0), Guard { value: 1.0, rate: 0.0, noise: 0.0 }],
            Phase::Contact(factor) | Phase::Clipped(factor) => {
                let bracket = 1.0 + factor * penetration_rate;
                let value = if let Phase::Clipped(_) = phase { -bracket } else { bracket };
                [gap(1.0), Guard { value, rate: f64::NAN, noise: 0.1 * factor * tolerance }]
            }
        }
    }

    /// Ends a phase; the next one, and a first step.
    fn cross(&self, guard: usize, t: f64, y: &State, phase: Phase, rtol: f64) -> (Phase, f64) {
        match (guard, phase) {
            (0, Phase::Free) => {
                let contact = self.contact(t, y);
                let speed = contact.penetration_rate.max(self.impact_velocity_floor);
                // The time of the impact, of a mass of the order of the bodies'.
                let time = (0.5 * self.slider_mass / (self.stiffness * speed.sqrt())).powf(0.4);
                (Phase::Contact(self.hysteresis / speed), rtol.powf(0.4) * time)
            }
            (0, _) => (Phase::Free, f64::INFINITY),
            (_, Phase::Contact(factor)) => (Phase::Clipped(factor), f64::INFINITY),
            (_, Phase::Clipped(factor)) => (Phase::Contact(factor), f64::INFINITY),
            (_, Phase::Free) => (Phase::Free, f64::INFINITY),
        }
    }
}

/// A step with its error and its dense output, `y + h Σ b_i(θ) k_i` in powers of θ.
struct Step {
    end: State,
    error: State,
    /// Coefficients of (θ, θ², θ³, θ⁴, θ⁵).
    rows: [State; 5],
}

impl Step {
    fn at(&self, start: &State, theta: f64) -> State {
        let mut y = *start;
        for k in 0..4 {
            let sum = self.rows.iter().rev().fold(0.0, |sum, row| (sum + row[k]) * theta);
            y[k] += sum;
        }
        y
    }
}

trait OneStep {
    /// Order by which the error falls.
    const ORDER: f64;
    fn begin(&mut self, model: &SliderCrank, t: f64, y: &State, phase: Phase, known: bool) -> usize;
    fn take(
        &mut self,
        model: &SliderCrank,
        t: f64,
        h: f64,
        y: &State,
        phase: Phase,
        step: &mut Step,
    ) -> usize;
    /// Completes the dense output.
    fn finish(&mut self, y: &State, h: f64, step: &mut Step);
}

#[derive(Default)]
struct DormandPrince {
    k: [State; 7],
}

const DP_C: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
const DP_A: [[f64; 6]; 7] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
const DP_E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
const DP_D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

impl OneStep for DormandPrince {
    const ORDER: f64 = 5.0;

    fn begin(&mut self, model: &SliderCrank, t: f64, y: &State, phase: Phase, known: bool) -> usize {
        if known {
            self.k[0] = self.k[6];
            return 0;
        }
        self.k[0] = model.slopes(t, y, phase);
        1
    }

    #[inline]
    fn take(
        &mut self,
        model: &SliderCrank,
        t: f64,
        h: f64,
        y: &State,
        phase: Phase,
        step: &mut Step,
    ) -> usize {
        for stage in 1..7 {
            let mut argument = [0.0; 4];
            for (weight, slope) in DP_A[stage][..stage].iter().zip(&self.k) {
                for (sum, slope) in argument.iter_mut().zip(slope) {
                    *sum += weight * slope;
                }
            }
            let argument = [0, 1, 2, 3].map(|k| y[k] + h * argument[k]);
            self.k[stage] = model.slopes(t + DP_C[stage] * h, &argument, phase);
            step.end = argument;
        }
        step.error = [0, 1, 2, 3].map(|k| h * DP_E.iter().zip(&self.k).map(|(e, s)| e * s[k]).sum::<f64>());
        6
    }

    fn finish(&mut self, y: &State, h: f64, step: &mut Step) {
        for k in 0..4 {
            let change = step.end[k] - y[k];
            let first = h * self.k[0][k] - change;
            let second = change - h * self.k[6][k] - first;
            let third = h * DP_D.iter().zip(&self.k).map(|(d, s)| d * s[k]).sum::<f64>();
            // Hairer's nested form y + θ (change + (1-θ) (first + θ (second + (1-θ) third))).
            step.rows[0][k] = change + first;
            step.rows[1][k] = second + third - first;
            step.rows[2][k] = -second - 2.0 * third;
            step.rows[3][k] = third;
            step.rows[4][k] = 0.0;
        }
    }
}

/// A Rosenbrock method of S stages.
struct Rosenbrock<const S: usize> {
    tableau: Tableau,
    linear: ([f64; 2], [[f64; 5]; 2]),
    u: [State; S],
}

impl<const S: usize> Rosenbrock<S> {
    fn new(tableau: Tableau) -> Self {
        assert_eq!(tableau.stages, S);
        Self { tableau, linear: Default::default(), u: [[0.0; 4]; S] }
    }

    fn combine(&self, weights: &[f64]) -> State {
        let mut sum = [0.0; 4];
        for (weight, u) in weights.iter().zip(&self.u) {
            for (sum, u) in sum.iter_mut().zip(u) {
                *sum += weight * u;
            }
        }
        sum
    }
}

impl<const S: usize> OneStep for Rosenbrock<S> {
    const ORDER: f64 = if S == 6 { 4.0 } else { 5.0 };

    fn begin(&mut self, model: &SliderCrank, t: f64, y: &State, phase: Phase, _known: bool) -> usize {
        self.linear = model.linear(t, y, phase);
        1 + JACOBIAN
    }

    #[inline]
    fn take(
        &mut self,
        model: &SliderCrank,
        t: f64,
        h: f64,
        y: &State,
        phase: Phase,
        step: &mut Step,
    ) -> usize {
        let (first, jacobian) = self.linear;
        let diagonal = h * self.tableau.gamma;
        let entry = |i: usize, j: usize| -jacobian[i][2 + j] - diagonal * jacobian[i][j];
        let (w00, w11) = (1.0 / diagonal + entry(0, 0), 1.0 / diagonal + entry(1, 1));
        let (w01, w10) = (entry(0, 1), entry(1, 0));
        let inverse = 1.0 / (w00 * w11 - w01 * w10);
        for stage in 0..S {
            let sum = self.combine(self.tableau.a[stage]);
            let argument = [0, 1, 2, 3].map(|k| y[k] + sum[k]);
            let residual = self.combine(self.tableau.c[stage]).map(|sum| sum / h);
            let accelerations = if stage == 0 {
                first
            } else {
                let contact = model.contact(t + self.tableau.alpha[stage] * h, &argument);
                model.accelerations(&contact, argument[2], phase)
            };
            let by_time = h * self.tableau.d[stage];
            let r_q = [residual[0] + argument[2], residual[1] + argument[3]];
            let r_v = [0, 1].map(|i| {
                let coupling = jacobian[i][0] * r_q[0] + jacobian[i][1] * r_q[1];
                residual[2 + i] + accelerations[i] + by_time * jacobian[i][4] + diagonal * coupling
            });
            let u_v = [(w11 * r_v[0] - w01 * r_v[1]) * inverse, (w00 * r_v[1] - w10 * r_v[0]) * inverse];
            self.u[stage] = [diagonal * (u_v[0] + r_q[0]), diagonal * (u_v[1] + r_q[1]), u_v[0], u_v[1]];
        }
        let sum = self.combine(self.tableau.m);
        step.end = [0, 1, 2, 3].map(|k| y[k] + sum[k]);
        step.error = self.combine(self.tableau.e);
        S - 1
    }

    fn finish(&mut self, y: &State, _h: f64, step: &mut Step) {
        let mut bends = [[0.0; 4]; 3];
        for (bend, row) in bends.iter_mut().zip(self.tableau.h) {
            *bend = self.combine(row);
        }
        // (1-θ) y + θ (end + (1-θ) (K₁ + θ K₂ + θ² K₃)).
        for k in 0..4 {
            let [k1, k2, k3] = [bends[0][k], bends[1][k], bends[2][k]];
            step.rows[0][k] = step.end[k] - y[k] + k1;
            step.rows[1][k] = k2 - k1;
            step.rows[2][k] = k3 - k2;
            step.rows[3][k] = -k3;
            step.rows[4][k] = 0.0;
        }
    }
}

/// What a run did.
#[derive(Clone, Copy, Default)]
struct Work {
    steps: usize,
    evaluations: usize,
}

/// Tolerances of the state, and the parts of a run that do not depend on the method.
struct Integration<'a> {
    model: &'a SliderCrank,
    rtol: f64,
    tolerances: State,
    samples: Vec<[f64; 4]>,
}

impl Integration<'_> {
    /// The tolerances of `chebclear` without its caps.
    fn new(model: &SliderCrank, rtol: f64) -> Integration<'_> {
        let position = rtol * 0.5 * model.clearance;
        let velocity = rtol * 0.1 * model.speed * (model.crank + model.rod);
        let tolerances = [position / model.rod, position, velocity / model.rod, velocity];
        Integration { model, rtol, tolerances, samples: Vec::with_capacity(SAMPLES) }
    }

    fn guards(&self, t: f64, y: &State, phase: Phase) -> [Guard; 2] {
        self.model.guards(t, y, phase, self.tolerances[3])
    }

    /// Simulates with one of the methods.
    fn run<M: OneStep>(&mut self, method: &mut M) -> Work {
        let model = self.model;
        let mut work = Work::default();
        // Concentric: the slider moves with the tip of the rod.
        let mut y = [0.0, model.crank + model.rod, -model.speed * model.crank / model.rod, 0.0];
        let (mut t, mut h, mut phase, mut known) = (0.0, 1e-6, Phase::Free, false);
        let mut step = Step { end: y, error: [0.0; 4], rows: [[0.0; 4]; 5] };
        let mut start_guards = self.guards(t, &y, phase);
        self.sample(t, &y, phase);
        while self.samples.len() < SAMPLES && work.steps < MOST_STEPS {
            work.evaluations += method.begin(model, t, &y, phase, known);
            let mut refused = false;
            let factor = loop {
                let last = t + h >= DURATION;
                h = if last { DURATION - t } else { h };
                work.evaluations += method.take(model, t, h, &y, phase, &mut step);
                let scaled = step.error.iter().zip(self.tolerances).map(|(error, by)| error.abs() / by);
                let error = scaled.fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a });
                let factor = (0.9 * error.powf(-1.0 / M::ORDER)).clamp(0.2, 5.0);
                if error <= 1.0 {
                    break if refused { factor.min(1.0) } else { factor };
                }
                refused = true;
                h *= if error.is_finite() { factor } else { 0.1 };
            };
            work.steps += 1;
            let end = if t + h >= DURATION * (1.0 - 1e-15) { DURATION } else { t + h };
            let end_guards = self.guards(end, &step.end, phase);
            let suspects = [0, 1].map(|k| suspicious(start_guards[k], end_guards[k]));
            let due = self.samples.len() as f64 * DURATION / (SAMPLES - 1) as f64;
            if suspects != [false; 2] || due <= end {
                method.finish(&y, h, &mut step);
            }
            let event = [0, 1]
                .into_iter()
                .filter(|&guard| suspects[guard])
                .filter_map(|guard| self.locate(guard, t, h, &y, phase, &step).map(|theta| (theta, guard)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let (end, state) = match event {
                Some((theta, _)) => (t + theta * h, step.at(&y, theta)),
                None => (end, step.end),
            };
            self.sample_step(t, h, end, &y, phase, &step);
            (t, y) = (end, state);
            known = event.is_none();
            match event {
                Some((_, guard)) => {
                    let (next, bound) = model.cross(guard, t, &y, phase, self.rtol);
                    (phase, h) = (next, h.min(bound));
                    start_guards = self.guards(t, &y, phase);
                }
                None => {
                    h *= factor;
                    start_guards = end_guards;
                }
            }
        }
        work
    }

    /// Where on the finished step a guard falls through zero first, as a part of the step.
    fn locate(&self, guard: usize, t: f64, h: f64, y: &State, phase: Phase, step: &Step) -> Option<f64> {
        let value = |theta: f64| self.guards(t + theta * h, &step.at(y, theta), phase)[guard];
        let (mut low, mut high) = (0.0, f64::NAN);
        let mut positive = value(0.0).value > 0.0;
        // In steps that begin on a guard the first parts are short.
        for theta in [1e-6, 1e-4, 1e-2, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0] {
            let Guard { value, noise, .. } = value(theta);
            if value < -noise {
                high = theta;
                break;
            }
            if value > 0.0 {
                (low, positive) = (theta, true);
            }
        }
        if high.is_nan() {
            return None;
        }
        if !positive {
            return Some(low);
        }
        let (mut below, mut above) = (value(high).value, value(low).value);
        let mut side = 0;
        for _ in 0..60 {
            if high - low <= 1e-13 {
                break;
            }
            let secant = high - below * (high - low) / (below - above);
            let theta = if secant > low && secant < high { secant } else { 0.5 * (low + high) };
            let here = value(theta).value;
            if here > 0.0 {
                (low, above) = (theta, here);
                below *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (high, below) = (theta, here);
                above *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
                if here > -1e-18 {
                    break;
                }
            }
        }
        Some(high)
    }

    fn sample_step(&mut self, t: f64, h: f64, end: f64, y: &State, phase: Phase, step: &Step) {
        while self.samples.len() < SAMPLES {
            let due = self.samples.len() as f64 * DURATION / (SAMPLES - 1) as f64;
            if due > end && end < DURATION {
                break;
            }
            self.sample(due, &step.at(y, ((due - t) / h).min(1.0)), phase);
        }
    }

    fn sample(&mut self, t: f64, y: &State, phase: Phase) {
        let contact = self.model.contact(t, y);
        let acceleration = self.model.accelerations(&contact, y[2], phase)[1];
        self.samples.push([y[1], y[3], acceleration, self.model.normal_force(&contact, phase)]);
    }
}

/// Whether a guard that started and ended a step like this may have been below zero.
fn suspicious(start: Guard, end: Guard) -> bool {
    end.value < -end.noise || start.rate < 0.0 && end.rate > 0.0
}

/// One code at one tolerance: error, seconds, evaluations and steps.
#[derive(Clone, Copy)]
struct Row {
    error: f64,
    seconds: f64,
    evaluations: f64,
    steps: f64,
}

struct Problem {
    mechanism: Mechanism,
    model: SliderCrank,
    reference: Vec<f64>,
    range: f64,
}

fn ours(mechanism: &Mechanism, method: Method, rtol: f64) -> (Vec<f64>, Work) {
    let mut settings = Settings::new(DURATION, SAMPLES);
    (settings.rtol, settings.method) = (rtol, method);
    settings.outputs = Some(COLUMNS.map(str::to_owned).to_vec());
    let run = simulate(mechanism, &settings, &|_| true).expect("the settings are good");
    assert_eq!(run.status, Status::Done);
    let evaluations = run.stats.evaluations + JACOBIAN * run.stats.jacobians;
    (run.values, Work { steps: run.stats.steps, evaluations })
}

fn by_hand(model: &SliderCrank, method: usize, rtol: f64) -> (Vec<[f64; 4]>, Work) {
    let mut integration = Integration::new(model, rtol);
    let work = match method {
        0 => integration.run(&mut DormandPrince::default()),
        1 => integration.run(&mut Rosenbrock::<6>::new(RODAS4)),
        _ => integration.run(&mut Rosenbrock::<8>::new(RODAS5P)),
    };
    (integration.samples, work)
}

impl Problem {
    /// Random slider-cranks whose motion two methods agree on.
    fn draw(count: usize, as_printed: bool) -> Vec<Self> {
        let mut random = Random(12);
        let mut problems = Vec::new();
        while problems.len() < count {
            let mut scene = support::slider_crank(as_printed);
            let moment = if as_printed { 3.0 } else { 12.0 };
            for (body, length) in scene.bodies.iter_mut().zip([0.05, 0.12]) {
                let length = length * random.within(0.9, 1.1);
                body.center_of_mass[0] = 0.5 * length;
                body.points[1].position[0] = length;
            }
            scene.bodies[1].inertia = 0.21 * scene.bodies[1].points[1].position[0].powi(2) / moment;
            if let Joint::Clearance { clearance, .. } = &mut scene.joints[3] {
                *clearance = 10_f64.powf(random.within(-5.0, -4.0));
            }
            if let Drive::Speed { speed, .. } = &mut scene.drives[0] {
                *speed = random.within(1000.0, 3000.0) * PI / 30.0;
            }
            let mechanism = support::compile(&scene);
            let column =
                |values: Vec<f64>| values.chunks_exact(4).map(|row| row[VELOCITY]).collect::<Vec<f64>>();
            let reference = column(ours(&mechanism, Method::Rodas5P, 1e-11).0);
            let other = column(ours(&mechanism, Method::Dop853, 1e-11).0);
            let range = reference.iter().copied().fold(f64::MIN, f64::max)
                - reference.iter().copied().fold(f64::MAX, f64::min);
            let gap = largest_difference(other.into_iter(), &reference) / range;
            if gap < LARGEST_GAP {
                problems.push(Self { mechanism, model: SliderCrank::of(&scene), reference, range });
            }
        }
        problems
    }

    /// All codes at all tolerances, taking turns.
    fn measure(&self) -> Vec<Vec<Row>> {
        let mut rows = Vec::new();
        for setting in 0..SETTINGS {
            let rtol = LOOSEST * 10_f64.powf(-0.5 * f64::from(setting));
            let codes = OURS.len() + BY_HAND.len();
            let mut at_setting: Vec<Option<Row>> = vec![None; codes];
            for _ in 0..REPEATS {
                for (code, row) in at_setting.iter_mut().enumerate() {
                    let begin = ThreadTime::now();
                    let (error, work, seconds) = if let Some((_, method)) = OURS.get(code) {
                        let (values, work) = ours(&self.mechanism, *method, rtol);
                        let seconds = begin.elapsed().as_secs_f64();
                        let velocities = values.chunks_exact(4).map(|row| row[VELOCITY]);
                        (largest_difference(velocities, &self.reference), work, seconds)
                    } else {
                        let (samples, work) = by_hand(&self.model, code - OURS.len(), rtol);
                        let seconds = begin.elapsed().as_secs_f64();
                        let velocities = samples.iter().map(|row| row[VELOCITY]);
                        (largest_difference(velocities, &self.reference), work, seconds)
                    };
                    let seconds = row.map_or(seconds, |row| row.seconds.min(seconds));
                    *row = Some(Row {
                        error: error / self.range,
                        seconds,
                        evaluations: work.evaluations as f64,
                        steps: work.steps as f64,
                    });
                }
            }
            rows.push(at_setting.into_iter().flatten().collect());
        }
        rows
    }
}

fn largest_difference(values: impl Iterator<Item = f64>, reference: &[f64]) -> f64 {
    let (mut largest, mut count) = (0.0_f64, 0);
    for (a, b) in values.zip(reference) {
        (largest, count) = (largest.max((a - b).abs()), count + 1);
    }
    if count == reference.len() { largest } else { f64::INFINITY }
}

fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value.ln(), count + 1.0));
    (sum / count).exp()
}

/// The cheapest run of every code whose tighter tolerances are as good: seconds and evaluations.
fn cheapest(rows: &[Vec<Row>], target: f64) -> Vec<Option<[f64; 2]>> {
    let of_code = |code: usize| {
        let kept = rows.iter().rev().map(|row| row[code]).take_while(|row| row.error <= target);
        let costs = kept.map(|row| [row.seconds, row.evaluations]);
        costs.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])])
    };
    (0..rows[0].len()).map(of_code).collect()
}

fn table(name: &str, scenes: &[Vec<Vec<Row>>], all: bool) {
    let names: Vec<&str> = OURS.iter().map(|(name, _)| *name).chain(BY_HAND).collect();
    println!("\n{name}: milliseconds / evaluations at an error of");
    println!("{:20}{}", "", TARGETS.map(|target| format!("{target:>17.0e}")).concat());
    // Scenes in which every code reaches the error; by target, scene and code.
    let reached = TARGETS.map(|target| {
        let costs = scenes.iter().map(|rows| cheapest(rows, target).into_iter().collect::<Option<Vec<_>>>());
        costs.flatten().collect::<Vec<_>>()
    });
    let mean = |costs: &[Vec<[f64; 2]>], code: usize, kind: usize| {
        geometric_mean(costs.iter().map(|scene| scene[code][kind]))
    };
    let counts = reached.iter().map(|costs| format!("{:>17}", costs.len()));
    println!("{:20}{}", format!("of {} scenes", scenes.len()), counts.collect::<String>());
    for (code, name) in names.iter().enumerate() {
        let cells = reached.iter().map(|costs| {
            format!("{:>17}", format!("{:.2} / {:.0}", 1e3 * mean(costs, code, 0), mean(costs, code, 1)))
        });
        println!("{name:20}{}", cells.collect::<String>());
    }
    for (code, name) in names.iter().enumerate().take(OURS.len()) {
        let cells = reached.iter().map(|costs| {
            let best =
                |kind| (OURS.len()..names.len()).map(|code| mean(costs, code, kind)).fold(f64::NAN, f64::min);
            let ratios = [0, 1].map(|kind| mean(costs, code, kind) / best(kind));
            format!("{:>17}", format!("{:.2} / {:.2}", ratios[0], ratios[1]))
        });
        println!("{:20}{}", format!("{name} : best by hand"), cells.collect::<String>());
    }
    for (setting, _) in scenes[0].iter().enumerate().filter(|_| all) {
        let rtol = LOOSEST * 10_f64.powf(-0.5 * setting as f64);
        for (code, name) in names.iter().enumerate() {
            let mean =
                |of: fn(&Row) -> f64| geometric_mean(scenes.iter().map(|rows| of(&rows[setting][code])));
            println!(
                "    {name:18} rtol {rtol:.1e}: error {:.1e}, {:.0} steps, {:.0} evaluations, {:.2} ms",
                mean(|row| row.error),
                mean(|row| row.steps),
                mean(|row| row.evaluations),
                1e3 * mean(|row| row.seconds)
            );
        }
    }
}

fn main() {
    let all = std::env::args().any(|argument| argument == "--all");
    let count = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(COUNT);
    let printed: Vec<_> = Problem::draw(count, true).iter().map(Problem::measure).collect();
    let corrected: Vec<_> = Problem::draw(count, false).iter().map(Problem::measure).collect();
    table("as printed", &printed, all);
    table("corrected", &corrected, all);
    table("both", &[printed, corrected].concat(), false);
}
