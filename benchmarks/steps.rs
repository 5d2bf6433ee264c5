//! One run of the core without Python, for counting instructions and timing the step loop.
//!
//! `steps SCENE.json SETTINGS.json [REPEATS]` prints the counters and the best time of a run as JSON.
//! `instructions.py` and `chains.py` call it; callgrind counts what happens below `measured`.

use std::time::Instant;

use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::{Settings, read_settings};
use chebclear::run::trajectory::{Trajectory, simulate};
use chebclear::scene::reader::read_scene;

/// The part that is measured, under a name of its own.
#[inline(never)]
fn measured(mechanism: &Mechanism, settings: &Settings) -> Trajectory {
    simulate(mechanism, settings, &|_| true).expect("the settings are good")
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [scene, settings, repeats @ ..] = &arguments[..] else {
        eprintln!("usage: steps SCENE.json SETTINGS.json [REPEATS]");
        std::process::exit(2);
    };
    let read = |path: &str| std::fs::read_to_string(path).expect("the file can be read");
    let scene = read_scene(&read(scene)).expect("the scene is good");
    let settings = read_settings(&read(settings)).expect("the settings are good");
    let mechanism = Mechanism::compile(&scene).expect("the scene can be assembled");
    let repeats = repeats.first().map_or(1, |count| count.parse().expect("a number of repeats"));
    let mut best = f64::INFINITY;
    for repeat in 0..repeats {
        let begin = Instant::now();
        let run = measured(&mechanism, &settings);
        best = best.min(begin.elapsed().as_secs_f64());
        if repeat + 1 < repeats {
            continue;
        }
        let stats = run.stats;
        // All bits of all samples in one number: a change that should not alter results did not.
        let hash = run.values.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, value| {
            (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3)
        });
        let counts: Vec<String> =
            stats.counts().iter().map(|(name, count)| format!("\"{name}\": {count}, ")).collect();
        println!(
            "{{\"status\": \"{}\", \"degrees\": {}, \"columns\": {}, {}\"seconds\": {best:e}, \"hash\": \"{hash:016x}\"}}",
            run.status.word(),
            mechanism.degrees_of_freedom(),
            mechanism.frames.len() - 1,
            counts.concat(),
        );
    }
}
