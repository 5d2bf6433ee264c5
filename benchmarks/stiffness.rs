//! Work for accuracy of every method over random rattling journals; see README.md.

#[path = "../tests/physics/rattle.rs"]
mod rattle;
#[path = "../tests/physics/rodas6p.rs"]
mod rodas6p;
#[path = "../tests/physics/support.rs"]
#[allow(dead_code)]
mod support;

use chebclear::settings::Method;
use chebclear::integrators::dop853::Dop853;
use chebclear::integrators::rosenbrock::Rosenbrock;
use chebclear::integrators::tableaus::{RODAS4, RODAS5P};
use chebclear::integrators::{Stats, Status, Stepper};
use rattle::{Rattle, distance};
use support::Random;

fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

fn stepper(name: &str, rtol: f64) -> Box<dyn Stepper> {
    match name {
        "rodas4" => Box::new(Rosenbrock::new(RODAS4, 3)),
        "rodas5p" => Box::new(Rosenbrock::new(RODAS5P, 3)),
        "rodas6p" => Box::new(Rosenbrock::new(rodas6p::RODAS6P, 3)),
        "auto" => Method::Auto.stepper(3, rtol),
        "dop853" => Box::new(Dop853::new(3)),
        _ => panic!("{name}"),
    }
}

/// Equivalent evaluations: Jacobian worth 2 (n=3, dual), each Rosenbrock stage adds solve.
fn work(stats: &Stats) -> f64 {
    stats.evaluations as f64 + JAC * stats.jacobians as f64 + LU * stats.factorisations as f64
}
const JAC: f64 = 2.0;
const LU: f64 = 1.0;

fn main() {
    let methods: Vec<String> = std::env::var("METHODS").unwrap_or("rodas4,rodas5p,dop853".into()).split(',').map(String::from).collect();
    for (class, count) in [("slide", env("NS", 40.0) as usize), ("stick", env("NK", 24.0) as usize)] {
        let mut random = Random(7);
        let mut scenes = Vec::new();
        let mut dropped = 0;
        while scenes.len() < count {
            let scene = if class == "slide" { Rattle::sliding(&mut random) } else { Rattle::sticking(&mut random) };
            let (o1, a) = scene.run(&mut *stepper("rodas6p", 1e-11), 1e-11);
            let (o2, b) = scene.run(&mut *stepper("rodas5p", 1e-11), 1e-11);
            let gap = distance(&a, &b);
            if std::env::var("V").is_ok() { println!("{class} ref gap {gap:.1e} {:?} {:?} events {} steps {} {}", o1.status, o2.status, o1.stats.events, o1.stats.steps, o2.stats.steps); }
            if gap < env("REF", 1e-7) { scenes.push((scene, a)); } else { dropped += 1; if dropped > 30 { break } }
        }
        println!("{class}: {} scenes, {dropped} dropped", scenes.len());
        let fine = env("FINE", 0.0) > 0.0;
        let tols: Vec<f64> = if fine { (4..=20).map(|k| 10_f64.powf(-0.5 * k as f64)).collect() } else { (2..=10).map(|k| 10_f64.powi(-k)).collect() };
        for method in &methods {
            let mut curve = Vec::new();
            for &tol in &tols {
                let (mut ex, mut sw) = (0usize, 0usize);
                let (mut le, mut ls, mut lw, mut lev, mut worst, mut rej, mut acc) = (0.0, 0.0, 0.0, 0.0, 0.0_f64, 0usize, 0usize);
                let begin = std::time::Instant::now();
                for (scene, reference) in &scenes {
                    let mut scene = *scene;
                    scene.stick_part = env("STICK", scene.stick_part);
                    scene.onset_step = env("ONSET", scene.onset_step);
                    let (outcome, end) = scene.run(&mut *stepper(method, tol), tol);
                    assert_eq!(outcome.status, Status::Done);
                    let error = distance(&end, reference).max(1e-12);
                    worst = worst.max(error);
                    le += error.ln(); ls += (outcome.stats.stages as f64).ln(); lw += work(&outcome.stats).ln(); lev += (outcome.stats.evaluations as f64).ln();
                    ex += outcome.stats.explicit_steps; sw += outcome.stats.switches; rej += outcome.stats.rejected; acc += outcome.stats.steps;
                }
                let n = scenes.len() as f64;
                let row = ((le / n).exp(), (ls / n).exp(), (lw / n).exp(), begin.elapsed().as_secs_f64() * 1e6 / n, (lev / n).exp());
                println!("  {method:8} {tol:7.0e}: err {:.1e} worst {worst:.1e} stages {:.0} evals {:.0} work {:.0} rej/acc {:.2} us {:.0} expl {:.2} switches {:.1}", row.0, row.1, row.4, row.2, rej as f64 / acc as f64, row.3, ex as f64 / acc as f64, sw as f64 / n);
                curve.push(row);
            }
            let mut line = format!("  {method:8} stages|work|us for error");
            for target in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
                // loosest tolerance after which all tighter are below target; log interpolation
                let last_bad = curve.iter().rposition(|r| r.0 > target);
                line += &match last_bad {
                    None => format!("  {target:.0e}: <{:.0}", curve[0].1),
                    Some(k) if k + 1 == curve.len() => format!("  {target:.0e}: -"),
                    Some(k) => {
                        let (a, b) = (curve[k], curve[k + 1]);
                        let s = (target / a.0).ln() / (b.0 / a.0).ln();
                        let i = |x: f64, y: f64| (x.ln() + s * (y / x).ln()).exp();
                        format!("  {target:.0e}: {:.0}|{:.0}|{:.0}", i(a.1, b.1), i(a.2, b.2), i(a.3, b.3))
                    }
                };
            }
            println!("{line}");
        }
    }
}
