//! The oil film: closed forms, quadrature of its pressure, balance of moments, dissipation.

use std::f64::consts::{FRAC_PI_2, PI};

use chebclear::contact::film::{FilmForce, FilmLaw, Lubricant};

use crate::support::Random;

const RADIUS: f64 = 0.02;
const CLEARANCE: f64 = 4e-5;
const ROUGHNESS: f64 = 1e-6;
const THICKNESS: f64 = CLEARANCE + ROUGHNESS;
const LUBRICANT: Lubricant =
    Lubricant { viscosity: 0.02, length: 0.01, roughness: ROUGHNESS, has_finite_width: false };

/// η R L³ / c³.
fn resistance() -> f64 {
    LUBRICANT.viscosity * RADIUS * (LUBRICANT.length / THICKNESS).powi(3)
}

/// Pressure integrated by the midpoint rule over the half in which it is positive, for a velocity in turning axes.
fn by_quadrature(e: [f64; 2], velocity: [f64; 2]) -> [f64; 2] {
    let middle = velocity[1].atan2(velocity[0]);
    // Gauss's two points in each of many parts.
    let parts = 4000;
    let width = PI / f64::from(parts);
    let mut force = [0.0; 2];
    for part in 0..parts {
        for side in [-1.0, 1.0] {
            let place = f64::from(part) + 0.5 + side * 0.5 / 3.0_f64.sqrt();
            let (sine, cosine) = (middle - FRAC_PI_2 + place * width).sin_cos();
            let gap = 1.0 - (e[0] * cosine + e[1] * sine) / THICKNESS;
            let pressure = (velocity[0] * cosine + velocity[1] * sine) / gap.powi(3) * 0.5 * width;
            force[0] -= resistance() * pressure * cosine;
            force[1] -= resistance() * pressure * sine;
        }
    }
    force
}

#[test]
fn the_force_is_the_integral_of_the_pressure() {
    let law = FilmLaw::new(&LUBRICANT, RADIUS, CLEARANCE);
    let mut random = Random(5);
    for _ in 0..200 {
        let angle = random.within(-4.0, 4.0);
        let ratio = if random.unit() < 0.2 { random.within(0.0, 2e-5) } else { random.within(0.0, 0.9) };
        let e = [ratio * THICKNESS * angle.cos(), ratio * THICKNESS * angle.sin()];
        let rate = [random.within(-1e-3, 1e-3), random.within(-1e-3, 1e-3)];
        let spins = [random.within(-50.0, 50.0), random.within(-50.0, 50.0)];
        let turning = 0.5 * (spins[0] + spins[1]);
        let velocity = [rate[0] + turning * e[1], rate[1] - turning * e[0]];
        let FilmForce { force, torques } = law.evaluate(e, rate, spins);
        let expected = by_quadrature(e, velocity);
        let size = expected[0].hypot(expected[1]);
        let error = (force[0] - expected[0]).hypot(force[1] - expected[1]);
        assert!(error <= 2e-9 * size, "{ratio}: {error} of {size}");
        // Without inertia the torques and the couple of the forces balance.
        let couple = e[0] * force[1] - e[1] * force[0];
        let rest = (torques[0] + torques[1] + couple).abs();
        assert!(rest <= 1e-12 * torques[0].abs().max(couple.abs()), "{rest}");
        let power = force[0] * rate[0] + force[1] * rate[1] + torques[0] * spins[0] + torques[1] * spins[1];
        assert!(power < 0.0, "{power}");
    }
}

/// Ocvirk's load and attitude angle of a journal that turns steadily.
#[test]
fn a_steady_journal_lies_on_ocvirks_locus() {
    let law = FilmLaw::new(&LUBRICANT, RADIUS, CLEARANCE);
    for ratio in [0.05_f64, 0.3, 0.6, 0.9, 0.97] {
        let (square, speed) = (1.0 - ratio * ratio, 120.0);
        let FilmForce { force: [radial, tangential], .. } =
            law.evaluate([ratio * THICKNESS, 0.0], [0.0, 0.0], [speed, 0.0]);
        let load =
            resistance() * speed * THICKNESS / 4.0 * ratio * (PI * PI * square + 16.0 * ratio * ratio).sqrt()
                / (square * square);
        assert!((radial.hypot(tangential) / load - 1.0).abs() <= 1e-12, "{ratio}");
        let attitude = tangential / -radial * (4.0 * ratio) / (PI * square.sqrt());
        assert!((attitude - 1.0).abs() <= 1e-12, "{ratio}: {attitude}");
    }
}

#[test]
fn friction_of_a_concentric_journal_is_petroffs() {
    let law = FilmLaw::new(&LUBRICANT, RADIUS, CLEARANCE);
    let FilmForce { force, torques } = law.evaluate([0.0; 2], [0.0; 2], [100.0, 40.0]);
    let expected = 2.0 * PI * LUBRICANT.viscosity * RADIUS.powi(3) * LUBRICANT.length * 60.0 / THICKNESS;
    assert_eq!(force, [-0.0, -0.0]);
    assert!((torques[0] / -expected - 1.0).abs() <= 1e-14 && (torques[1] / expected - 1.0).abs() <= 1e-14);
}

/// A standing journal does not feel the film; the force is continuous in the velocity and where the surfaces touch.
#[test]
fn the_force_is_continuous() {
    for has_finite_width in [false, true] {
        let law = FilmLaw::new(&Lubricant { has_finite_width, ..LUBRICANT }, RADIUS, CLEARANCE);
        assert_eq!(law.evaluate([1e-5, 0.0], [0.0; 2], [0.0; 2]).force, [0.0, 0.0]);
        for place in [1e-5 * THICKNESS, CLEARANCE] {
            let [inside, outside] = [-1.0, 1.0].map(|side: f64| {
                let e = [place * (1.0 + 1e-9 * side), 0.0];
                law.evaluate(e, [1e-3, 2e-4], [0.0; 2]).force
            });
            for (a, b) in inside.iter().zip(outside) {
                assert!((a - b).abs() <= 1e-5 * a.abs(), "{inside:?} {outside:?}");
            }
        }
    }
}

/// At a quarter of the diameter Ocvirk's load is 1.03 times that of Reynolds' equation at an eccentricity ratio of 0.3, at half
/// 1.12 and at the whole 1.42; at 0.9 it is 1.39, 2.36 and 5.7 times (finite differences).
#[test]
fn a_finite_bearing_is_within_a_tenth_of_reynolds_equation() {
    for (length, ratio, times) in [
        (0.01, 0.3, 1.03),
        (0.02, 0.3, 1.12),
        (0.04, 0.3, 1.42),
        (0.01, 0.9, 1.39),
        (0.02, 0.9, 2.36),
        (0.04, 0.9, 5.7),
    ] {
        let [short, finite] = [false, true].map(|has_finite_width| {
            let law = FilmLaw::new(&Lubricant { length, has_finite_width, ..LUBRICANT }, RADIUS, CLEARANCE);
            let FilmForce { force: [x, y], .. } =
                law.evaluate([ratio * THICKNESS, 0.0], [0.0, 0.0], [100.0, 0.0]);
            x.hypot(y)
        });
        assert!((short / finite / times - 1.0).abs() < 0.1, "{length} {ratio}: {}", short / finite);
    }
}

/// Force of a journal that is squeezed against its bearing, and of one that leaves it, over that of the short bearing, by
/// finite differences of Reynolds' equation with its negative pressures cut off.
#[test]
fn a_squeezed_finite_bearing_is_as_far_off_as_the_page_of_laws_says() {
    for (length, ratio, near, away) in [
        (0.01, 0.3, 0.961, 0.980),
        (0.02, 0.3, 0.865, 0.920),
        (0.04, 0.3, 0.633, 0.720),
        (0.01, 0.9, 0.712, 0.974),
        (0.02, 0.9, 0.401, 0.857),
        (0.04, 0.9, 0.153, 0.535),
    ] {
        for (velocity, true_factor, least, most) in [(1e-3, near, 0.96, 1.21), (-1e-3, away, 0.33, 1.0)] {
            let [short, finite] = [false, true].map(|has_finite_width| {
                let law =
                    FilmLaw::new(&Lubricant { length, has_finite_width, ..LUBRICANT }, RADIUS, CLEARANCE);
                law.evaluate([ratio * THICKNESS, 0.0], [velocity, 0.0], [0.0; 2]).force[0]
            });
            let off = finite / short / true_factor;
            assert!((least..most).contains(&off), "{length} {ratio} {velocity}: {off}");
        }
    }
}
