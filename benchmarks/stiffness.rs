//! Work for accuracy of every method over ensembles of contacts that slide and stick; see README.md.
//!
//! cargo bench --bench stiffness [-- --all]

#[path = "../tests/physics/integrators/rattle.rs"]
mod rattle;
#[path = "../tests/physics/integrators/rodas6p.rs"]
mod rodas6p;
#[path = "../tests/physics/support.rs"]
#[allow(dead_code)]
mod support;

use chebclear::contact::friction::FrictionLaw;
use chebclear::integrators::rosenbrock::Rosenbrock;
use chebclear::integrators::{Stats, Status};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::{Method, Settings};
use chebclear::run::trajectory::simulate;
use chebclear::scene::parts::Joint;
use rattle::Rattle;
use rodas6p::RODAS6P;
use std::time::Instant;
use support::Random;

const METHODS: [(&str, Method); 4] = [
    ("rodas4", Method::Rodas4),
    ("rodas5p", Method::Rodas5P),
    ("dop853", Method::Dop853),
    ("auto", Method::Auto),
];
const TARGETS: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// References of two methods that are further apart than this are left out: too chaotic.
const LARGEST_GAP: f64 = 1e-6;
/// What a Jacobian and a factorization cost in evaluations, for two or three degrees of freedom.
const JACOBIAN: f64 = 2.0;
const FACTORIZATION: f64 = 0.5;

/// Scenes that are alike, and how one of them is run: error and work by method and tolerance.
trait Ensemble {
    fn count(&self) -> usize;
    fn run(&self, index: usize, method: Method, rtol: f64) -> (f64, Stats);
}

struct Journals(Vec<(Rattle, [f64; 5])>);

impl Journals {
    fn new(count: usize, draw: fn(&mut Random) -> Rattle) -> Self {
        let mut random = Random(7);
        let mut scenes = Vec::new();
        while scenes.len() < count {
            let scene = draw(&mut random);
            let (_, end) = scene.run(&mut Rosenbrock::new(RODAS6P, 3), 1e-11);
            let (_, other) = scene.run(&mut *Method::Rodas5P.stepper(3, 1e-11), 1e-11);
            if rattle::distance(&end, &other) < LARGEST_GAP {
                scenes.push((scene, end));
            }
        }
        Self(scenes)
    }
}

impl Ensemble for Journals {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn run(&self, index: usize, method: Method, rtol: f64) -> (f64, Stats) {
        let (scene, reference) = &self.0[index];
        let (outcome, end) = scene.run(&mut *method.stepper(3, rtol), rtol);
        assert_eq!(outcome.status, Status::Done);
        (rattle::distance(&end, reference), outcome.stats)
    }
}

/// The paper's mechanism with lengths drawn within 10 %; the error is that of the slider's velocity.
struct SliderCranks(Vec<(Mechanism, Vec<f64>)>, f64);

impl SliderCranks {
    fn new(count: usize, as_printed: bool, friction: f64, stick_slip: f64, duration: f64) -> Self {
        let mut random = Random(3);
        let mut scenes = Vec::new();
        for _ in 0..count {
            let mut scene = support::slider_crank(as_printed);
            for (body, length) in scene.bodies.iter_mut().zip([0.05, 0.12]) {
                let length = length * random.within(0.9, 1.1);
                body.center_of_mass[0] = 0.5 * length;
                body.points[1].position[0] = length;
            }
            if let Joint::Clearance { friction: Some(law), .. } = &mut scene.joints[3] {
                let FrictionLaw::ModifiedCoulomb {
                    static_coefficient,
                    sliding_coefficient,
                    stick_slip_velocity,
                    static_sliding_velocity,
                } = law
                else {
                    unreachable!("the paper's friction")
                };
                *static_coefficient *= friction;
                *sliding_coefficient *= friction;
                *stick_slip_velocity *= stick_slip;
                *static_sliding_velocity *= stick_slip;
            }
            let mechanism = support::compile(&scene);
            let (reference, _) = velocity(&mechanism, Method::Rodas5P, 1e-11, duration);
            let (other, _) = velocity(&mechanism, Method::Dop853, 1e-11, duration);
            if largest_difference(&reference, &other) < LARGEST_GAP {
                scenes.push((mechanism, reference));
            }
        }
        Self(scenes, duration)
    }
}

fn velocity(mechanism: &Mechanism, method: Method, rtol: f64, duration: f64) -> (Vec<f64>, Stats) {
    let mut settings = Settings::new(duration, 201);
    (settings.rtol, settings.method) = (rtol, method);
    settings.outputs = Some(vec!["slider.vx".to_owned()]);
    let run = simulate(mechanism, &settings, &|_| true).expect("the settings are good");
    assert_eq!(run.status, Status::Done);
    (run.values, run.stats)
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

impl Ensemble for SliderCranks {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn run(&self, index: usize, method: Method, rtol: f64) -> (f64, Stats) {
        let (mechanism, reference) = &self.0[index];
        let (values, stats) = velocity(mechanism, method, rtol, self.1);
        (largest_difference(&values, reference), stats)
    }
}

/// Geometric means over an ensemble at one tolerance.
#[derive(Clone, Copy)]
struct Row {
    rtol: f64,
    error: f64,
    worst: f64,
    stages: f64,
    work: f64,
    microseconds: f64,
    explicit: f64,
    switches: f64,
}

fn measure(ensemble: &dyn Ensemble, method: Method, rtol: f64) -> Row {
    let (mut logarithms, mut worst) = ([0.0; 3], 0.0_f64);
    let (mut steps, mut explicit, mut switches) = (0, 0, 0);
    let begin = Instant::now();
    for index in 0..ensemble.count() {
        let (error, stats) = ensemble.run(index, method, rtol);
        let work = stats.evaluations as f64
            + JACOBIAN * stats.jacobians as f64
            + FACTORIZATION * stats.factorizations as f64;
        for (sum, value) in logarithms.iter_mut().zip([error.max(1e-15), stats.stages as f64, work]) {
            *sum += value.ln();
        }
        worst = worst.max(error);
        steps += stats.steps;
        explicit += stats.explicit_steps;
        switches += stats.switches;
    }
    let count = ensemble.count() as f64;
    let [error, stages, work] = logarithms.map(|sum| (sum / count).exp());
    Row {
        rtol,
        error,
        worst,
        stages,
        work,
        microseconds: 1e6 * begin.elapsed().as_secs_f64() / count,
        explicit: explicit as f64 / steps as f64,
        switches: switches as f64 / count,
    }
}

/// Stages, work and time at an error, from the loosest tolerance on from which it is kept.
fn at_error(rows: &[Row], target: f64) -> String {
    let of = |row: &Row| [row.stages, row.work, row.microseconds];
    let (kept, [stages, work, time]) = match rows.iter().rposition(|row| row.error > target) {
        None => ("<", of(&rows[0])),
        Some(last) if last + 1 == rows.len() => return format!("{:>27}", "-"),
        Some(last) => {
            let (a, b) = (rows[last], rows[last + 1]);
            let part = (target / a.error).ln() / (b.error / a.error).ln();
            let mut between = of(&a);
            for (value, other) in between.iter_mut().zip(of(&b)) {
                *value *= (other / *value).powf(part);
            }
            ("", between)
        }
    };
    format!("{:>27}", format!("{kept}{stages:.0} / {work:.0} / {time:.0}"))
}

fn table(name: &str, ensemble: &dyn Ensemble, all: bool) {
    println!(
        "\n{name}, {} scenes: stages / work / microseconds for a geometric-mean error of",
        ensemble.count()
    );
    println!("{:8}{}", "", TARGETS.map(|target| format!("{target:>27.0e}")).concat());
    for (name, method) in METHODS {
        let rows: Vec<Row> = (2..=10).map(|k| measure(ensemble, method, 10_f64.powi(-k))).collect();
        println!("{name:8}{}", TARGETS.map(|target| at_error(&rows, target)).concat());
        for row in rows.iter().filter(|_| all) {
            println!(
                "    rtol {:.0e}: error {:.1e}, worst {:.1e}, {:.0} stages, work {:.0}, explicit {:.0} %, \
                 {:.1} switches",
                row.rtol,
                row.error,
                row.worst,
                row.stages,
                row.work,
                100.0 * row.explicit,
                row.switches
            );
        }
    }
}

fn main() {
    let all = std::env::args().any(|argument| argument == "--all");
    table("journals that slide", &Journals::new(40, Rattle::sliding), all);
    table("journals that stick", &Journals::new(24, Rattle::sticking), all);
    for (name, as_printed) in [("as printed", true), ("corrected", false)] {
        for (what, friction, stick_slip, duration) in [
            ("", 1.0, 1.0, 0.02),
            (", friction x 10", 10.0, 1.0, 0.01),
            (", x 10, V_s / 10", 10.0, 0.1, 0.005),
        ] {
            let ensemble = SliderCranks::new(8, as_printed, friction, stick_slip, duration);
            if ensemble.count() > 0 {
                table(&format!("slider-cranks {name}{what}"), &ensemble, all);
            }
        }
    }
}
