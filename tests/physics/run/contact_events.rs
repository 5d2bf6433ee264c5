//! Events of mechanisms: contacts begin, end and are clipped as the physics says.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::integrators::Status;
use chebclear::run::settings::{Method, Settings};
use chebclear::run::trajectory::{EventKind, Place, Trajectory, simulate, simulate_from};
use chebclear::scene::parts::{Drive, Force, Joint, JointKind, Scene};
use chebclear::tree::elements::State;
use std::f64::consts::PI;

use crate::support::{body, compile, ideal, loose, paper_friction, point, with_floor};

const MASS: f64 = 0.14;
const STIFFNESS: f64 = 1e11;

fn clearance_joint(name: &str, bearing: &str, journal: &str, clearance: f64, damping: Damping) -> Joint {
    let contact = NormalLaw { stiffness: STIFFNESS, exponent: 1.5, damping };
    with_floor(loose(name, [bearing, journal], [0.01, clearance], contact, None), Some(1e-3))
}

/// A free journal in a fixed bearing, no gravity.
fn journal(clearance: f64, damping: Damping) -> Scene {
    Scene {
        bodies: vec![body("journal", MASS, 1e-4, [0.0, 0.0], Vec::new())],
        joints: vec![clearance_joint("bearing", "ground", "journal", clearance, damping)],
        ..Scene::default()
    }
}

fn column(run: &Trajectory, name: &str) -> Vec<f64> {
    let place = run.columns.iter().position(|column| column == name).expect("a column");
    run.values.iter().skip(place).step_by(run.columns.len()).copied().collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, |a, b| if b > a || b.is_nan() { b } else { a })
}

/// Checks that every joint goes through its phases in order, and returns its clips.
fn clips(run: &Trajectory, joint: usize, starts_inside: bool) -> usize {
    let (mut contact, mut clipped, mut count) = (starts_inside, false, 0);
    for event in run.events.iter().filter(|event| event.place == Place::Joint(joint)) {
        let legal = match event.kind {
            EventKind::Onset => !contact,
            EventKind::Separation | EventKind::Transfer => contact,
            EventKind::Clip => contact && !clipped,
            EventKind::Unclip => contact && clipped,
            EventKind::Stick | EventKind::Slip | EventKind::Switch => contact && !clipped,
        };
        assert!(legal, "{event:?} with contact {contact}, clipped {clipped}");
        contact = !matches!(event.kind, EventKind::Separation | EventKind::Transfer);
        clipped = event.kind == EventKind::Clip;
        count += usize::from(clipped);
    }
    for pair in run.events.windows(2) {
        assert!(pair[0].time <= pair[1].time);
    }
    count
}

#[test]
fn a_journal_does_not_tunnel_through_a_clearance_far_smaller_than_its_steps() {
    for (speed, rtol) in [(1e-3, 1e-3), (1e-3, 1e-6), (0.1, 1e-3), (0.1, 1e-6)] {
        let clearance = 1e-7;
        let mechanism = compile(&journal(clearance, Damping::Elastic));
        let start = State { q: vec![0.0; 3], v: vec![0.6 * speed, -0.8 * speed, 0.0] };
        // Hertz: m v²/2 = 2/5 K δ^2.5; the impact lasts 2.9432 δ/v.
        let depth = (1.25 * MASS * speed * speed / STIFFNESS).powf(0.4);
        let period = (2.943_275 * depth + 2.0 * clearance) / speed;
        // Ends in the middle of the last flight.
        let impacts = 40;
        let mut settings = Settings::new(impacts as f64 * period, 4001);
        settings.rtol = rtol;
        let run = simulate_from(&mechanism, &start, &settings, &|_| true).unwrap();
        assert_eq!(run.status, Status::Done);
        let penetration = largest(&column(&run, "bearing.penetration"));
        println!("{speed} {rtol}: {} of {depth:e}, {} events", penetration / depth, run.events.len());
        assert!((0.9..1.1).contains(&(penetration / depth)), "{penetration:e} instead of {depth:e}");
        clips(&run, 0, false);
        if rtol < 1e-4 {
            assert_eq!(run.events.len(), 2 * impacts);
        }
    }
}

#[test]
fn a_bearing_that_moves_to_and_fro_within_a_step_does_not_pass_by_its_journal() {
    // The bearing circles at the end of a crank of twice the clearance; the shaft, half a clearance
    // nearer to the pivot, stays where it is. Every sample of a step of eight turns would find them
    // as they were at the start.
    let (speed, clearance) = (100.0, 1e-5);
    let radius = 2.0 * clearance;
    let scene = Scene {
        bodies: vec![
            body("crank", 0.1, 1e-5, [0.0, 0.0], vec![point("tip", radius, 0.0)]),
            body("shaft", 1.0, 1e-3, [0.0, 0.0], Vec::new()),
        ],
        joints: vec![
            ideal("pivot", "ground", "crank", JointKind::Revolute),
            clearance_joint("bearing", "crank.tip", "shaft", clearance, Damping::Elastic),
        ],
        drives: vec![Drive::Speed { name: "motor".to_owned(), joint: "pivot".to_owned(), speed, angle: 0.0 }],
        ..Scene::default()
    };
    let shaft = radius - 0.5 * clearance;
    let start = State { q: vec![shaft, 0.0, 0.0], v: vec![0.0; 3] };
    let mut settings = Settings::new(40.0 * PI / speed, 2);
    settings.limits.first_step = Some(16.0 * PI / speed);
    let run = simulate_from(&compile(&scene), &start, &settings, &|_| true).unwrap();
    // The law of cosines for the distance of the centers.
    let squares = shaft * shaft + radius * radius - clearance * clearance;
    let touch = (0.5 * squares / (shaft * radius)).acos() / speed;
    assert_eq!(run.status, Status::Done);
    assert!(run.events.first().is_some_and(|event| (event.time - touch).abs() < 1e-6 * touch), "{run:?}");
}

#[test]
fn a_contact_at_the_start_is_damped_as_the_impact_that_would_have_brought_it_there() {
    let (restitution, clearance, depth) = (0.5, 1e-5, 2e-7);
    let mechanism = compile(&journal(clearance, Damping::LankaraniNikravesh { restitution }));
    let start = State { q: vec![clearance + depth, 0.0, 0.0], v: vec![0.0; 3] };
    let mut settings = Settings::new(5e-4, 101);
    settings.rtol = 1e-8;
    let run = simulate_from(&mechanism, &start, &settings, &|_| true).unwrap();
    assert_eq!(run.status, Status::Done);
    assert!(
        run.warnings.iter().any(|notice| notice.code == "starts_in_contact" && notice.about == ["bearing"])
    );
    clips(&run, 0, true);
    // From rest at δ: -χv - ln(1 - χv) = χ² K δ^2.5 / (5/2 m) for the speed v of the separation.
    let arrival = (2.0 * STIFFNESS * depth.powf(2.5) / (2.5 * MASS)).sqrt();
    let chi = 0.75 * (1.0 - restitution * restitution) / arrival;
    let right = chi * chi * STIFFNESS * depth.powf(2.5) / (2.5 * MASS);
    let (mut low, mut high) = (0.0, 1.0 / chi);
    for _ in 0..100 {
        let v: f64 = 0.5 * (low + high);
        if -chi * v - (-chi * v).ln_1p() < right { low = v } else { high = v }
    }
    let first = run.events[0];
    assert_eq!(first.kind, EventKind::Separation);
    assert!((first.normal_velocity + low).abs() < 1e-6 * low, "{} instead of -{low}", first.normal_velocity);
}

#[test]
fn a_start_without_contact_is_not_warned_of() {
    let run =
        simulate(&compile(&journal(1e-5, Damping::Elastic)), &Settings::new(1e-3, 3), &|_| true).unwrap();
    assert!(run.warnings.is_empty() && run.events.is_empty(), "{:?}", run.warnings);
}

/// A shaft that lies in a bearing which shakes: a tiny crank at 3000 rad/s, three times gravity. The
/// contact, at rest in the mean, is pulled and pushed faster than its damping lets it follow.
fn shaken() -> (Scene, State) {
    let (speed, clearance, depth) = (3000.0, 1e-3, 2.1e-5);
    let radius = 3.0 * 9.81 / (speed * speed);
    let damping = Damping::HuntCrossley { hysteresis_factor: 750.0 };
    let mut joint = clearance_joint("bearing", "crank.tip", "shaft", clearance, damping);
    if let Joint::Clearance { contact, .. } = &mut joint {
        contact.stiffness = 1e8;
    }
    let scene = Scene {
        bodies: vec![
            body("crank", 0.1, 1e-5, [0.0, 0.0], vec![point("tip", radius, 0.0)]),
            body("shaft", 1.0, 1e-3, [0.0, 0.0], Vec::new()),
        ],
        joints: vec![ideal("pivot", "ground", "crank", JointKind::Revolute), joint],
        forces: vec![Force::Gravity { acceleration: [0.0, -9.81] }],
        drives: vec![Drive::Speed { name: "motor".to_owned(), joint: "pivot".to_owned(), speed, angle: 0.0 }],
        ..Scene::default()
    };
    (scene, State { q: vec![radius, -clearance - depth, 0.0], v: vec![0.0, radius * speed, 0.0] })
}

#[test]
fn clips_and_unclips_alternate_in_a_strongly_damped_contact() {
    let (scene, start) = shaken();
    let mechanism = compile(&scene);
    let mut counts = Vec::new();
    let methods = [Method::Auto, Method::Rodas5P, Method::Dop853, Method::Adams];
    for (method, rtol) in methods.into_iter().flat_map(|m| [1e-3, 1e-5, 1e-7, 1e-9].map(|rtol| (m, rtol))) {
        let mut settings = Settings::new(0.02, 2001);
        (settings.method, settings.rtol) = (method, rtol);
        let run = simulate_from(&mechanism, &start, &settings, &|_| true).unwrap();
        assert_eq!(run.status, Status::Done, "{}", run.message());
        let clipped = clips(&run, 0, true);
        println!("{method:?}, rtol {rtol:e}: {clipped} clips among {} events", run.events.len());
        counts.push((clipped, run.events.len()));
        assert!(column(&run, "bearing.normal_force").iter().all(|force| *force >= 0.0));
        // The phase that is reported is that of the geometry, to the accuracy of a relocation.
        let slack = 1e-2 * rtol * 5e-4;
        let contact = column(&run, "bearing.contact");
        for (penetration, contact) in column(&run, "bearing.penetration").iter().zip(contact) {
            let inside = if contact > 0.5 { *penetration } else { -penetration };
            assert!(inside >= -slack, "{penetration:e} with contact {contact}");
        }
    }
    // 9.5 turns of the crank, in each of which the bearing pulls once. At 1e-3 the Adams method clips once more.
    let once_more = (counts[3].0 + 1, counts[3].1 + 2);
    let same = |(index, count): (usize, &(usize, usize))| {
        *count == counts[3] || (index == 12 && *count == once_more)
    };
    assert!(counts[3].0 >= 8 && counts.iter().enumerate().all(same), "{counts:?}");
}

/// A bar in two bearings with a bob in a third joint under it, falling from rest; joints and bodies
/// in the order given.
fn bar(joints: [usize; 3], bob_first: bool, off_center: f64, restitution: f64) -> Scene {
    let damping = Damping::LankaraniNikravesh { restitution };
    let mut all = [
        clearance_joint("left", "ground.left", "bar.left", 5e-5, damping.clone()),
        clearance_joint("right", "ground.right", "bar.right", 5e-5, damping.clone()),
        clearance_joint("middle", "bar.middle", "bob", 3e-5, damping),
    ];
    if let Joint::Clearance { friction, .. } = &mut all[1] {
        *friction = Some(paper_friction());
    }
    let points = vec![point("left", -0.1, 0.0), point("right", 0.1, 0.0), point("middle", 0.0, 0.0)];
    let mut bodies = vec![
        body("bar", 0.3, 1e-3, [off_center, 0.0], points),
        body("bob", 0.2, 1e-4, [0.0, 0.0], Vec::new()),
    ];
    if bob_first {
        bodies.reverse();
    }
    Scene {
        ground: vec![point("left", -0.1, 0.0), point("right", 0.1, 0.0)],
        bodies,
        joints: joints.map(|index| all[index].clone()).to_vec(),
        forces: vec![Force::Gravity { acceleration: [0.0, -9.81] }],
        drives: Vec::new(),
        start: Vec::new(),
        couplings: Vec::new(),
    }
}

/// Events as (time, name of the joint, kind), those of one instant in the order of the names.
fn named_events(scene: &Scene, settings: &Settings) -> Vec<(f64, String, EventKind)> {
    let run = simulate(&compile(scene), settings, &|_| true).unwrap();
    assert_eq!(run.status, Status::Done, "{}", run.message());
    (0..scene.joints.len()).for_each(|joint| {
        clips(&run, joint, false);
    });
    let mut events: Vec<(f64, String, EventKind)> = run
        .events
        .iter()
        .map(|event| match event.place {
            Place::Joint(joint) => (event.time, scene.joints[joint].name().to_owned(), event.kind),
            Place::DryJoint(_) | Place::Load(_) => panic!("no such part"),
        })
        .collect();
    for later in 1..events.len() {
        if events[later].0 - events[later - 1].0 < 1e-12 && events[later].1 < events[later - 1].1 {
            events.swap(later - 1, later);
        }
    }
    events
}

#[test]
fn gate_08_the_result_does_not_depend_on_the_numbers_of_joints_and_bodies() {
    // A relocation may end anywhere within its overshoot. In flight the explicit method's error estimate is
    // rounding alone, so the lengths of its steps depend on it, and the ends on them within the tolerance,
    // which impacts multiply. At 1e-8 the events of the first numbering are within 3e-10 s of those of Rodas5P at
    // 1e-12; those of Rodas5P at 1e-8 are within 8e-10 s.
    for (method, rtol, slack) in [
        (Method::Rodas5P, 1e-4, 1e-3),
        (Method::Rodas5P, 1e-8, 1e-3),
        (Method::Auto, 1e-4, 1e-3),
        (Method::Auto, 1e-8, 4e-2),
    ] {
        // Long enough for several impacts of every joint; short enough for rounding errors, which
        // every impact multiplies, to stay small.
        let mut settings = Settings::new(0.01, 2);
        (settings.method, settings.rtol) = (method, rtol);
        let original = named_events(&bar([0, 1, 2], false, 0.013, 0.8), &settings);
        println!("rtol {rtol:e}: {} events", original.len());
        assert!(original.len() >= 12, "{original:?}");
        for (joints, bob_first) in
            [([1, 0, 2], false), ([2, 1, 0], false), ([0, 1, 2], true), ([2, 0, 1], true)]
        {
            let permuted = named_events(&bar(joints, bob_first, 0.013, 0.8), &settings);
            assert_eq!(permuted.len(), original.len());
            for (ours, theirs) in permuted.iter().zip(&original) {
                assert_eq!((&ours.1, ours.2), (&theirs.1, theirs.2), "{permuted:?}\n{original:?}");
                let difference = (ours.0 - theirs.0).abs();
                assert!(difference < slack * rtol, "{difference:e} s at {} s", theirs.0);
            }
        }
    }
}

#[test]
fn both_ends_of_a_symmetric_bar_land_at_the_instant_of_free_fall() {
    for joints in [[0, 1, 2], [1, 0, 2]] {
        let mut settings = Settings::new(0.004, 401);
        settings.rtol = 1e-9;
        let scene = bar(joints, false, 0.0, 0.8);
        let events = named_events(&scene, &settings);
        // 5e-5 m in free fall; the bob falls along, without touching.
        let fall = (2.0 * 5e-5 / 9.81_f64).sqrt();
        for event in &events[..2] {
            assert_eq!(event.2, EventKind::Onset);
            assert!((event.0 - fall).abs() < 1e-9 * fall, "{events:?}");
        }
        assert_ne!(events[0].1, events[1].1);
        assert!(events[..2].iter().all(|event| event.1 != "middle"), "{events:?}");
    }
}

#[test]
fn a_failure_in_painleves_paradox_says_so() {
    // One body, its journal's center at (0.19, 0.1) from its center of mass, presses to the right and slides
    // upwards: a normal force F with its friction moves the journal along the normal by
    // F (-1/m - y²/I + μ y (x + R) / I), which is toward the bearing from μ = 0.55 on.
    for (coefficient, paradox) in [(0.54, false), (0.56, true)] {
        let mut scene = journal(1e-5, Damping::Elastic);
        scene.bodies = vec![body("journal", 1.0, 1e-3, [0.0, 0.0], vec![point("pin", 0.19, 0.1)])];
        let mut joint = clearance_joint("bearing", "ground", "journal.pin", 1e-5, Damping::Elastic);
        if let Joint::Clearance { friction, .. } = &mut joint {
            *friction = Some(FrictionLaw::SmoothedCoulomb { coefficient, velocity: 1e-3 });
        }
        scene.joints = vec![joint];
        let start = State { q: vec![1.1e-5 - 0.19, -0.1, 0.0], v: vec![0.0, 0.1, 0.0] };
        let mut settings = Settings::new(1e-3, 2);
        settings.limits.max_steps = 1;
        settings.limits.first_step = Some(1e-12);
        let run = simulate_from(&compile(&scene), &start, &settings, &|_| true).unwrap();
        assert_eq!(run.status, Status::MaxSteps);
        assert_eq!(run.paradox.as_deref(), paradox.then_some("bearing"));
        assert_eq!(run.message().contains("Painlevé"), paradox, "{}", run.message());
    }
}

#[test]
fn gate_07_a_long_run_may_take_the_steps_that_its_first_impacts_need() {
    // The impacts last 6e-15 of the run: their steps are below the rounding of its end.
    let mechanism = compile(&journal(1e-7, Damping::Elastic));
    let start = State { q: vec![0.0; 3], v: vec![1.0, 0.0, 0.0] };
    let first = |duration: f64| {
        let mut settings = Settings::new(duration, 2);
        (settings.rtol, settings.limits.max_events) = (1e-6, 9);
        // Absolute: that from the scene depends on the duration of a motion without a drive.
        (settings.position_tolerance, settings.velocity_tolerance) = (Some(1e-13), Some(1e-6));
        simulate_from(&mechanism, &start, &settings, &|_| true).unwrap()
    };
    let (short, long) = (first(1.0), first(1e10));
    assert_eq!((short.status, long.status), (Status::MaxEvents, Status::MaxEvents), "{}", long.message());
    for (ours, theirs) in long.events.iter().zip(&short.events) {
        assert!((ours.time - theirs.time).abs() < 1e-5 * theirs.time, "{ours:?} {theirs:?}");
    }
}

/// Length of the first step [s] after the onset of an elastic impact whose force grows as a power of the
/// penetration.
fn first_step(exponent: f64, rtol: f64) -> f64 {
    let mut scene = journal(1e-3, Damping::Elastic);
    let Joint::Clearance { contact, .. } = &mut scene.joints[0] else { unreachable!() };
    *contact = NormalLaw { stiffness: 1e7, exponent, damping: Damping::Elastic };
    let mechanism = compile(&scene);
    // Wide tolerances: the error refuses no step.
    let settings = Settings {
        rtol,
        method: Method::Rodas5P,
        position_tolerance: Some(1e-6),
        velocity_tolerance: Some(0.5),
        ..Settings::new(2e-3, 2)
    };
    let steps = std::cell::RefCell::new(vec![0.0]);
    let start = State { q: vec![0.0; 3], v: vec![1.0, 0.0, 0.0] };
    let monitor = |t: f64| {
        steps.borrow_mut().push(t);
        true
    };
    let run = simulate_from(&mechanism, &start, &settings, &monitor).unwrap();
    assert_eq!((run.status, run.events[0].kind), (Status::Done, EventKind::Onset));
    let onset = run.events[0].time;
    let next = steps.borrow().iter().copied().find(|&t| t > onset).expect("a step after the onset");
    next - onset
}

#[test]
fn the_first_step_after_an_onset_follows_the_order_that_the_contact_law_leaves() {
    // The velocity begins as t^(n + 1): a step of that error is as long as rtol^(1/(n + 1)).
    for exponent in [1.0, 1.5, 2.0, 2.5] {
        let ratio = first_step(exponent, 1e-5) / first_step(exponent, 1e-9);
        let order = 4.0 / ratio.log10();
        assert!((order - (exponent + 1.0)).abs() < 0.01, "{exponent}: {order}");
    }
}

#[test]
fn a_flight_begins_with_steps_as_long_as_its_clearance_allows() {
    // Without gravity a flight across the bearing is two clearances long: four steps of half a clearance. A first step
    // of the length of the last one of the impact, a thousandth of the flight, would take a fifth one or more.
    let (clearance, speed) = (1e-3, 1.0);
    let mechanism = compile(&journal(clearance, Damping::Elastic));
    let start = State { q: vec![0.0; 3], v: vec![speed, 0.0, 0.0] };
    for rtol in [1e-2, 1e-4, 1e-6] {
        let settings = Settings { rtol, ..Settings::new(8.0 * clearance / speed, 2) };
        let ends = std::cell::RefCell::new(Vec::new());
        let monitor = |t: f64| {
            ends.borrow_mut().push(t);
            true
        };
        let run = simulate_from(&mechanism, &start, &settings, &monitor).unwrap();
        assert_eq!(run.status, Status::Done);
        let mut flights = 0;
        for pair in run.events.windows(2) {
            if pair[0].kind == EventKind::Separation {
                let steps = ends.borrow().iter().filter(|&&t| pair[0].time < t && t <= pair[1].time).count();
                assert!(steps <= 4, "{steps} steps in a flight at rtol {rtol}");
                flights += 1;
            }
        }
        assert!(flights >= 2, "{flights} flights");
    }
}
