//! The paper's mechanism against reference trajectories of an independent two-coordinate model.

use chebclear::run::trajectory::{Method, Settings, Trajectory, simulate};

use crate::support::{compile, slider_crank};

/// Columns of the reference: time and slider velocity.
pub fn reference_velocity(file: &str) -> Vec<(f64, f64)> {
    let text = match file {
        "as_printed" => include_str!("../../data/slider_crank_as_printed.csv"),
        _ => include_str!("../../data/slider_crank_physical.csv"),
    };
    text.lines()
        .filter(|line| !line.starts_with('#') && !line.starts_with("time"))
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
            (numbers[0], numbers[2])
        })
        .collect()
}

pub fn run(as_printed: bool, method: Method, rtol: f64) -> Trajectory {
    let mechanism = compile(&slider_crank(as_printed));
    let mut settings = Settings::new(0.06, 601);
    settings.rtol = rtol;
    settings.method = method;
    settings.outputs = Some(vec!["slider.vx".to_owned()]);
    simulate(&mechanism, &settings, &|_| true).unwrap()
}

/// Largest velocity error up to `end` [m/s].
pub fn velocity_error(run: &Trajectory, reference: &[(f64, f64)], end: f64) -> f64 {
    run.t
        .iter()
        .zip(&run.values)
        .zip(reference)
        .filter(|((t, _), _)| **t <= end + 1e-12)
        .map(|((t, v), (time, velocity))| {
            assert!((t - time).abs() < 1e-12);
            (v - velocity).abs()
        })
        .fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
}

#[test]
fn both_reference_trajectories_are_met() {
    for (as_printed, file) in [(true, "as_printed"), (false, "physical")] {
        let reference = reference_velocity(file);
        for method in [Method::Auto, Method::Rodas5P, Method::Rodas4, Method::Dop853, Method::Adams] {
            let run = run(as_printed, method, 1e-9);
            assert_eq!(run.status.word(), "done");
            let short = velocity_error(&run, &reference, 0.01);
            let whole = velocity_error(&run, &reference, 0.06);
            assert!(short < 1e-4, "{file} {method:?}: {short:e} m/s over 10 ms");
            assert!(whole < 1e-3, "{file} {method:?}: {whole:e} m/s over 60 ms");
        }
    }
}
