//! Responses with closed forms, and random coefficients, for the ranges of polynomials.

use crate::support::Random;
use std::f64::consts::{PI, TAU};

/// A response of normalized parameters at an instant.
pub struct Case {
    pub name: &'static str,
    pub parameters: usize,
    pub degree: usize,
    pub samples: usize,
    pub response: fn(&[f64], f64) -> f64,
}

/// Time from 0 to 1. The first is the paper's mechanism without clearance over a revolution, the others range
/// from monotone to oscillating in the parameters.
pub const CASES: [Case; 7] = [
    Case { name: "crank position", parameters: 2, degree: 3, samples: 1440, response: crank_position },
    Case { name: "crank velocity", parameters: 2, degree: 3, samples: 1440, response: crank_velocity },
    Case {
        name: "crank acceleration",
        parameters: 2,
        degree: 3,
        samples: 1440,
        response: crank_acceleration,
    },
    Case { name: "decaying cosine", parameters: 2, degree: 8, samples: 1000, response: decaying_cosine },
    Case { name: "oscillator", parameters: 3, degree: 5, samples: 1000, response: oscillator },
    Case { name: "coupled, four", parameters: 4, degree: 3, samples: 500, response: four_parameters },
    Case { name: "coupled, six", parameters: 6, degree: 3, samples: 100, response: six_parameters },
];

/// Lengths of 50 and 120 mm, both ±10 %, at 2000 r/min [m].
fn crank_position(x: &[f64], t: f64) -> f64 {
    let (crank, rod, angle) = (0.05 * (1.0 + 0.1 * x[0]), 0.12 * (1.0 + 0.1 * x[1]), TAU * t);
    crank * angle.cos() + (rod.powi(2) - (crank * angle.sin()).powi(2)).sqrt()
}

fn crank_velocity(x: &[f64], t: f64) -> f64 {
    let (crank, rod, angle) = (0.05 * (1.0 + 0.1 * x[0]), 0.12 * (1.0 + 0.1 * x[1]), TAU * t);
    let (sin, cos) = angle.sin_cos();
    let root = (rod.powi(2) - (crank * sin).powi(2)).sqrt();
    -2000.0 * TAU / 60.0 * crank * sin * (1.0 + crank * cos / root)
}

fn crank_acceleration(x: &[f64], t: f64) -> f64 {
    let (crank, rod, angle) = (0.05 * (1.0 + 0.1 * x[0]), 0.12 * (1.0 + 0.1 * x[1]), TAU * t);
    let (sin, cos) = angle.sin_cos();
    let root = (rod.powi(2) - (crank * sin).powi(2)).sqrt();
    let bend = crank * ((2.0 * angle).cos() / root + (crank * sin * cos).powi(2) / root.powi(3));
    -(2000.0f64 * TAU / 60.0).powi(2) * crank * (cos + bend)
}

/// Eight periods with a frequency known to 5 % and a damping to 20 %.
fn decaying_cosine(x: &[f64], t: f64) -> f64 {
    let phase = 8.0 * TAU * t * (1.0 + 0.05 * x[0]);
    (-0.02 * (1.0 + 0.2 * x[1]) * phase).exp() * phase.cos()
}

/// Four periods of mass, spring and damper, known to 5, 5 and 20 %.
fn oscillator(x: &[f64], t: f64) -> f64 {
    let (mass, stiffness) = (1.0 + 0.05 * x[0], 1.0 + 0.05 * x[1]);
    let damping = 0.05 * (1.0 + 0.2 * x[2]) / mass;
    let frequency = (stiffness / mass - damping.powi(2)).sqrt();
    let phase = 4.0 * TAU * t;
    (-damping * phase).exp() * (frequency * phase).cos()
}

fn four_parameters(x: &[f64], t: f64) -> f64 {
    coupled(&[x[0], x[1], x[2], x[3], 0.0, 0.0], t)
}

fn six_parameters(x: &[f64], t: f64) -> f64 {
    coupled(x, t)
}

/// First of two masses between three springs, two periods; masses and springs known to 5 %, first start to 10
/// %.
fn coupled(x: &[f64], t: f64) -> f64 {
    let known = |x: f64| 1.0 + 0.05 * x;
    let (m1, m2, k1, k2, k3) = (known(x[0]), known(x[1]), known(x[2]), known(x[3]), known(x[4]));
    // Modes of the symmetric matrix [[a, b], [b, d]] in coordinates scaled by the roots of the masses.
    let (a, b, d) = ((k1 + k2) / m1, -k2 / (m1 * m2).sqrt(), (k2 + k3) / m2);
    let (middle, half) = (0.5 * (a + d), (0.25 * (a - d).powi(2) + b * b).sqrt());
    let angle = 0.5 * (2.0 * b).atan2(a - d);
    let phase = 2.0 * TAU * t;
    let (sin, cos) = angle.sin_cos();
    let start = 1.0 + 0.1 * x[5];
    start
        * (cos * cos * ((middle + half).sqrt() * phase).cos()
            + sin * sin * ((middle - half).sqrt() * phase).cos())
}

/// The values of a case at points of the cube, points x `samples`.
pub fn values(case: &Case, samples: usize, points: &[f64]) -> Vec<f64> {
    let instants: Vec<f64> = (0..samples).map(|i| i as f64 / samples as f64).collect();
    points.chunks(case.parameters).flat_map(|x| instants.iter().map(|&t| (case.response)(x, t))).collect()
}

/// All points of the tensor grid of the given axes, the first slowest.
pub fn tensor(axes: &[Vec<f64>]) -> Vec<f64> {
    let mut points = vec![vec![]];
    for axis in axes {
        points = points
            .iter()
            .flat_map(|point: &Vec<f64>| axis.iter().map(|&x| [point.as_slice(), &[x]].concat()))
            .collect();
    }
    points.concat()
}

/// The `count` + 1 extreme points of T_count, from 1 to -1.
pub fn extreme_points(count: usize) -> Vec<f64> {
    (0..=count).map(|j| (PI * j as f64 / count as f64).cos()).collect()
}

/// Random coefficients, terms x `columns`, that fall by `decay` per total degree.
pub fn random_coefficients(random: &mut Random, degrees: &[usize], columns: usize, decay: f64) -> Vec<f64> {
    let totals = degrees.iter().fold(vec![0], |totals, &n| {
        totals.iter().flat_map(|total| (0..=n).map(move |i| total + i as i32)).collect()
    });
    totals
        .iter()
        .flat_map(|&total| {
            (0..columns).map(|_| decay.powi(total) * random.within(-1.0, 1.0)).collect::<Vec<f64>>()
        })
        .collect()
}

/// The functions of polynomials with the parts of these as loose arguments.
pub mod loose {
    use chebclear::study::bounds;
    use chebclear::study::chebyshev::{self, GridError, Polynomials};
    use chebclear::study::range::{self, Ranges};

    type Numbers = Result<Vec<f64>, GridError>;

    pub fn evaluate(coefficients: &[f64], columns: usize, degrees: &[usize], points: &[f64]) -> Numbers {
        chebyshev::evaluate(&Polynomials::new(coefficients, columns, degrees)?, points)
    }

    pub fn derivative(coefficients: &[f64], columns: usize, degrees: &[usize], axis: usize) -> Numbers {
        chebyshev::derivative(&Polynomials::new(coefficients, columns, degrees)?, axis)
    }

    pub fn interval_bounds(
        coefficients: &[f64],
        columns: usize,
        degrees: &[usize],
    ) -> Result<(Vec<f64>, Vec<f64>), GridError> {
        bounds::interval_bounds(&Polynomials::new(coefficients, columns, degrees)?)
    }

    pub fn polynomial_ranges(
        coefficients: &[f64],
        columns: usize,
        degrees: &[usize],
        threads: Option<usize>,
    ) -> Result<Ranges, GridError> {
        range::polynomial_ranges(&Polynomials::new(coefficients, columns, degrees)?, threads)
    }
}
