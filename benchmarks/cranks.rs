#[path = "../tests/physics/support.rs"]
#[allow(dead_code)]
mod support;
use chebclear::scene::*;
use chebclear::settings::{Method, Settings};
use chebclear::trajectory::{Trajectory, simulate};
use support::*;
fn env(name: &str, default: f64) -> f64 { std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default) }
fn run(m: &chebclear::mechanism::Mechanism, method: Method, rtol: f64, end: f64) -> Trajectory {
    let mut s = Settings::new(end, 401); s.rtol = rtol; s.method = method; s.outputs = Some(vec!["slider.vx".into()]);
    simulate(m, &s, &|_| true).unwrap()
}
fn main() {
    let end = env("END", 0.02);
    for printed in [true, false] {
        let mut random = Random(3);
        let mut all = vec![];
        while all.len() < env("N", 16.0) as usize {
            let mut scene = slider_crank(printed);
            let (crank, rod) = (0.05 * random.within(0.9, 1.1), 0.12 * random.within(0.9, 1.1));
            for (b, l) in [(0, crank), (1, rod)] {
                let body = &mut scene.bodies[b];
                body.center_of_mass[0] = 0.5 * l; body.points[1].position[0] = l;
            }
            if let Joint::Clearance { friction: Some(chebclear::friction::FrictionLaw::ModifiedCoulomb { static_coefficient, sliding_coefficient, stick_slip_velocity, static_sliding_velocity }), impact_velocity_floor, .. } = &mut scene.joints[3] {
                *static_coefficient *= env("MU", 1.0); *sliding_coefficient *= env("MU", 1.0);
                *stick_slip_velocity *= env("VS", 1.0); *static_sliding_velocity *= env("VS", 1.0);
                if env("FLOOR", 0.0) > 0.0 { *impact_velocity_floor = None; }
            }
            let m = compile(&scene);
            let a = run(&m, Method::Rodas5P, env("RT", 1e-12), end); let b = run(&m, Method::Dop853, env("RT", 1e-12), end);
            let gap = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if std::env::var("V").is_ok() { println!("gap {gap:.1e} events {}", a.events.len()); }
            all.push((scene, b, gap));
        }
        let mut gaps: Vec<f64> = all.iter().map(|x| x.2).collect(); gaps.sort_by(f64::total_cmp);
        println!("printed {printed}: gaps median {:.1e} worst {:.1e}", gaps[gaps.len() / 2], gaps[gaps.len() - 1]);
        for (name, method) in [("rodas4", Method::Rodas4), ("rodas5p", Method::Rodas5P), ("dop853", Method::Dop853), ("auto", Method::Auto)] {
            for k in 8..=18 {
                let tol = 10_f64.powf(-0.5 * k as f64);
                let (mut le, mut w, mut n, mut ev, mut ex, mut st, mut sw, mut us) = (0.0, 0.0_f64, 0.0, 0.0, 0, 0, 0, 0.0);
                for (scene, r, gap) in &all {
                    if *gap > env("GAP", 1e-5) { continue; }
                    let m = compile(scene);
                    let t0 = std::time::Instant::now();
                    let t = run(&m, method, tol, end);
                    us += (t0.elapsed().as_secs_f64() * 1e6_f64).ln();
                    let e = t.values.iter().zip(&r.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    le += e.ln(); w = w.max(e); n += 1.0;
                    ev += (t.stats.evaluations as f64 + 2.0 * t.stats.jacobians as f64 + 0.5 * t.stats.factorisations as f64).ln();
                    ex += t.stats.explicit_steps; st += t.stats.steps; sw += t.stats.switches;
                }
                println!("  {name:8} {tol:7.0e} err {:.1e} worst {w:.1e} work {:.0} us {:.0} expl {:.2} switches {:.1} n {n}", (le / n).exp(), (ev / n).exp(), (us / n).exp(), ex as f64 / st as f64, sw as f64 / n);
            }
        }
    }
}
