//! The start is the assembly nearest to the given angles: random loops of dyads, of which all assemblies are known.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::scene::parts::{Drive, JointKind, Scene, Start};
use chebclear::scene::time_function::TimeFunction;
use nalgebra::Vector2;

use crate::support::{Random, body, compile, ideal, point};

type Vec2 = Vector2<f64>;

/// Assemblies whose distances differ by less are about equally near.
const EQUALLY_NEAR: f64 = 1.05;

fn turned(length: f64, angle: f64) -> Vec2 {
    length * Vec2::new(angle.cos(), angle.sin())
}

fn angle_of(arm: Vec2) -> f64 {
    arm.y.atan2(arm.x)
}

fn wrapped(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}

/// A mechanism under construction, in one of its assemblies, with all of them as angles of the bodies.
struct Built {
    scene: Scene,
    /// Angles of all bodies in every assembly; the first is the one in which the mechanism is built.
    assemblies: Vec<Vec<f64>>,
    /// Whether a body's angle is the same in all of them.
    fixed: Vec<bool>,
    /// Where the end of each bar is in each assembly.
    ends: Vec<Vec<Vec2>>,
}

impl Built {
    fn new() -> Self {
        Self {
            scene: Scene::default(),
            assemblies: vec![Vec::new()],
            fixed: Vec::new(),
            ends: vec![Vec::new()],
        }
    }

    fn bar(&mut self, length: f64) -> String {
        let name = format!("bar{}", self.scene.bodies.len());
        let points = vec![point("P", 0.0, 0.0), point("Q", length, 0.0)];
        self.scene.bodies.push(body(&name, 1.0, 0.1, [0.5 * length, 0.0], points));
        name
    }

    fn ground(&mut self, at: Vec2) -> String {
        let name = format!("G{}", self.scene.ground.len());
        self.scene.ground.push(point(&name, at.x, at.y));
        format!("ground.{name}")
    }

    fn pin(&mut self, a: &str, b: &str) -> String {
        let name = format!("pin{}", self.scene.joints.len());
        self.scene.joints.push(ideal(&name, a, b, JointKind::Revolute));
        name
    }

    /// Bars of a chain whose joints are driven, or start at angles that are given; returns where it ends.
    fn chain(&mut self, random: &mut Random, count: usize) -> (String, Vec2) {
        let mut at = Vec2::new(random.within(-0.2, 0.2), random.within(-0.2, 0.2));
        let mut from = self.ground(at);
        let mut angle = 0.0;
        for _ in 0..count {
            let length = random.within(0.1, 0.5);
            let name = self.bar(length);
            let turn = random.within(-PI, PI);
            let pin = self.pin(&from, &format!("{name}.P"));
            angle += turn;
            if random.unit() < 0.5 {
                let motion = TimeFunction::Polynomial(vec![turn, 1.0]);
                self.scene.drives.push(Drive::Motion { name: format!("drive_{pin}"), joint: pin, motion });
            } else if random.unit() < 0.5 {
                self.scene.start.push(Start::Joint { joint: pin, position: Some(turn), velocity: Some(0.0) });
            } else {
                let (angle, angular_velocity) = (Some(angle), Some(0.0));
                self.scene.start.push(Start::Body { body: name.clone(), angle, angular_velocity });
            }
            at += turned(length, angle);
            self.assemblies[0].push(angle);
            self.ends[0].push(at);
            self.fixed.push(true);
            from = format!("{name}.Q");
        }
        (from, at)
    }

    /// Adds two bodies (and whether each keeps its angle) in every assembly, in all ways that `ways` gives for the point where they hang.
    fn extend(
        &mut self,
        hangs: Option<usize>,
        tip: Vec2,
        keeps: [bool; 2],
        ways: impl Fn(Vec2) -> Vec<([f64; 2], Vec2)>,
    ) {
        let old = std::mem::take(&mut self.assemblies).into_iter().zip(std::mem::take(&mut self.ends));
        for (angles, ends) in old {
            for (more, end) in ways(hangs.map_or(tip, |bar| ends[bar])) {
                self.assemblies.push(angles.iter().copied().chain(more).collect());
                self.ends.push(ends.iter().copied().chain([end, end]).collect());
            }
        }
        self.fixed.extend(keeps);
    }

    /// A dyad between a point and ground, or a bar that slides. Its first assembly is the one that is built.
    fn dyad(&mut self, random: &mut Random, from: &str, hangs: Option<usize>, tip: Vec2) {
        let length = random.within(0.2, 0.6);
        let angle = random.within(-PI, PI);
        let elbow = tip + turned(length, angle);
        let name = self.bar(length);
        // Joints in an order that changes where the loop is cut.
        let late = (random.unit() < 0.5).then(|| (from.to_owned(), format!("{name}.P")));
        if late.is_none() {
            self.pin(from, &format!("{name}.P"));
        }
        match random.index(3) {
            0 => {
                let (other, second) = (random.within(0.2, 0.6), random.within(-PI, PI));
                let pivot = elbow + turned(other, second + PI);
                let rocker = self.bar(other);
                let ground = self.ground(pivot);
                self.pin(&ground, &format!("{rocker}.P"));
                self.pin(&format!("{name}.Q"), &format!("{rocker}.Q"));
                let circles = |tip: Vec2| {
                    let base = pivot - tip;
                    let along = (length * length - other * other + base.norm_squared()) / (2.0 * base.norm());
                    let square = length * length - along * along;
                    let across = if square < 0.0 { f64::NAN } else { square.sqrt() };
                    let unit = base.normalize();
                    let ways = [1.0, -1.0].map(|side| {
                        let end = tip + along * unit + side * across * Vec2::new(-unit.y, unit.x);
                        ([angle_of(end - tip), angle_of(end - pivot)], end)
                    });
                    ways.into_iter().filter(|(angles, _)| angles[0].is_finite()).collect()
                };
                self.extend(hangs, tip, [false, false], circles);
            }
            1 => {
                // A block on a guide.
                let lean = random.within(-PI, PI);
                let foot = elbow + turned(random.within(-0.5, 0.5), lean);
                let block = format!("bar{}", self.scene.bodies.len());
                self.scene.bodies.push(body(&block, 1.0, 0.1, [0.0, 0.0], vec![point("P", 0.0, 0.0)]));
                let ground = self.ground(foot);
                let axis = turned(1.0, lean).into();
                let kind = JointKind::Prismatic { axis, angle: 0.0 };
                self.scene.joints.push(ideal(&format!("guide{block}"), &ground, &format!("{block}.P"), kind));
                self.pin(&format!("{name}.Q"), &format!("{block}.P"));
                let line = |tip: Vec2| {
                    let axis = turned(1.0, lean);
                    let along = (tip - foot).dot(&axis);
                    let off = (tip - foot - along * axis).norm();
                    let half = (length * length - off * off).max(-0.0).sqrt();
                    let ways = [1.0, -1.0].map(|side| {
                        let end = foot + (along + side * half) * axis;
                        ([angle_of(end - tip), 0.0], end)
                    });
                    if off > length { Vec::new() } else { ways.to_vec() }
                };
                self.extend(hangs, tip, [false, true], line);
            }
            _ => {
                // The bar slides in a block that turns about a pivot, off the line of its points.
                let (off, slid) = (random.within(0.05, 0.3), random.within(-0.6, 0.6));
                let reach = |angle: f64, slid: f64| turned(slid, angle) + turned(off, angle + FRAC_PI_2);
                let pivot = tip + reach(angle, slid);
                let block = format!("bar{}", self.scene.bodies.len());
                self.scene.bodies.push(body(&block, 1.0, 0.1, [0.0, 0.0], vec![point("P", 0.0, -off)]));
                let ground = self.ground(pivot);
                self.pin(&ground, &block);
                let kind = JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 };
                let ends = [format!("{block}.P"), format!("{name}.P")];
                self.scene.joints.push(ideal(&format!("slot{block}"), &ends[0], &ends[1], kind));
                let slots = |tip: Vec2| {
                    let arm = pivot - tip;
                    let square = arm.norm_squared() - off * off;
                    let ways = [1.0, -1.0].map(|side| {
                        let slid = side * square.sqrt();
                        let angle = angle_of(arm) - angle_of(Vec2::new(slid, off));
                        ([angle, angle], tip + turned(length, angle))
                    });
                    if square < 0.0 { Vec::new() } else { ways.to_vec() }
                };
                self.extend(hangs, tip, [false, false], slots);
            }
        }
        if let Some((from, to)) = late {
            self.pin(&from, &to);
        }
    }

    /// A mechanism of one loop of 4 to 8 links, or of two or three loops.
    fn random(random: &mut Random) -> Self {
        let mut built = Self::new();
        let loops = 1 + random.index(3);
        let count = 1 + random.index(if loops == 1 { 5 } else { 2 });
        let (from, tip) = built.chain(random, count);
        built.dyad(random, &from, None, tip);
        for _ in 1..loops {
            // On a bar of what is there; blocks have no end.
            let bars: Vec<usize> = (0..built.scene.bodies.len())
                .filter(|&bar| built.scene.bodies[bar].points.iter().any(|point| point.name == "Q"))
                .collect();
            let bar = bars[random.index(bars.len())];
            // The next dyad is built on the first assembly; it need not be within reach of the others.
            let tip = built.ends[0][bar];
            let from = format!("{}.Q", built.scene.bodies[bar].name);
            built.dyad(random, &from, Some(bar), tip);
        }
        built
    }

    fn with_guesses(&self, angles: &[f64]) -> Scene {
        let mut scene = self.scene.clone();
        for (body, angle) in scene.bodies.iter_mut().zip(angles) {
            body.angle = *angle;
        }
        scene
    }

    /// Whether two bodies turn together.
    fn together(&self, one: usize, other: usize) -> bool {
        self.assemblies.iter().all(|angles| angles[one] == angles[other]) && !self.fixed[other]
    }

    /// Distances of all assemblies from some angles, the nearest first, with their places.
    fn distances(&self, angles: &[f64]) -> Vec<(f64, usize)> {
        let square = |assembly: &Vec<f64>| -> f64 {
            let bodies = (0..angles.len()).filter(|&body| !self.fixed[body]);
            bodies.map(|body| wrapped(assembly[body] - angles[body]).powi(2)).sum()
        };
        let mut distances: Vec<(f64, usize)> =
            self.assemblies.iter().map(square).map(f64::sqrt).enumerate().map(|(k, d)| (d, k)).collect();
        distances.sort_by(|a, b| a.0.total_cmp(&b.0));
        distances
    }
}

fn angles_at_start(mechanism: &Mechanism) -> Vec<f64> {
    let mut dynamics = Dynamics::new(mechanism);
    dynamics.move_to(0.0, &mechanism.start.q, &mechanism.start.v);
    mechanism.bodies.iter().map(|body| dynamics.frame(body.frame).angle + body.angle).collect()
}

/// What became of starts from guesses.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    guesses: usize,
    /// Not assembled.
    refused: usize,
    /// Guesses to which two assemblies are about equally near, and those of them without a warning.
    ambiguous: usize,
    unwarned: usize,
    /// Others with a warning.
    needless: usize,
    /// Others that start from an assembly that is not the nearest.
    farther: usize,
    /// Starts with an angle more than half a turn from its guess.
    turned: usize,
}

/// Starts of random mechanisms from guesses within an angle of one of their assemblies; from zero if it is none.
fn tally(count: usize, seed: u64, within: Option<f64>) -> Tally {
    let mut random = Random(seed);
    let mut tally = Tally::default();
    while tally.guesses < count {
        let built = Built::random(&mut random);
        let truth = &built.assemblies[random.index(built.assemblies.len())];
        let guess: Vec<f64> = truth
            .iter()
            .map(|angle| within.map_or(0.0, |within| angle + random.within(-within, within)))
            .collect();
        tally.guesses += 1;
        let Ok(mechanism) = Mechanism::compile(&built.with_guesses(&guess)) else {
            tally.refused += 1;
            continue;
        };
        let start = angles_at_start(&mechanism);
        let distances = built.distances(&guess);
        let warned = mechanism.warnings.iter().any(|warning| warning.code == "two_assemblies");
        let second = distances.get(1).map_or(f64::INFINITY, |second| second.0);
        // Bodies that a slot holds together may be given angles a turn apart.
        let alone = |body: usize| {
            !built.fixed[body] && (0..start.len()).all(|other| other == body || !built.together(body, other))
        };
        let away = (0..start.len()).filter(|&body| alone(body)).map(|body| (start[body] - guess[body]).abs());
        tally.turned += usize::from(away.fold(0.0, f64::max) > PI + 1e-9);
        if second <= EQUALLY_NEAR * distances[0].0 {
            tally.ambiguous += 1;
            tally.unwarned += usize::from(!warned);
            continue;
        }
        tally.needless += usize::from(warned);
        let nearest = &built.assemblies[distances[0].1];
        let off = start.iter().zip(nearest).map(|(start, nearest)| wrapped(start - nearest).abs());
        tally.farther += usize::from(off.fold(0.0, f64::max) > 1e-6);
    }
    tally
}

/// How many mechanisms of each kind are tried.
const MECHANISMS: usize = 3_000;

#[test]
fn guesses_within_45_degrees_start_at_the_nearest_assembly_within_half_a_turn() {
    let tally = tally(MECHANISMS, 1, Some(FRAC_PI_4));
    assert_eq!((tally.refused, tally.farther, tally.needless, tally.turned), (0, 0, 0, 0), "{tally:?}");
    assert!(tally.ambiguous < MECHANISMS / 5, "{tally:?}");
    // Two that differ by less than a hundredth of a radian are one to whoever looks.
    assert!(tally.unwarned <= tally.ambiguous / 10, "{tally:?}");
}

#[test]
fn so_do_guesses_anywhere() {
    let tally = tally(MECHANISMS, 2, Some(PI));
    assert_eq!((tally.farther, tally.needless, tally.turned), (0, 0, 0), "{tally:?}");
    // A pose beside a change point may have no velocity.
    assert!(tally.refused <= MECHANISMS / 1000, "{tally:?}");
}

#[test]
fn the_default_guess_assembles_every_mechanism_that_exists() {
    let tally = tally(MECHANISMS, 3, None);
    assert_eq!((tally.farther, tally.needless, tally.turned), (0, 0, 0), "{tally:?}");
    assert!(tally.refused <= MECHANISMS / 1000, "{tally:?}");
}

/// A closed chain of bars between two points of ground, all of whose joints are free, with guessed angles.
fn free_chain(lengths: &[f64], base: Vec2, guess: &[f64]) -> Scene {
    let mut built = Built::new();
    let mut from = built.ground(Vec2::zeros());
    for length in lengths {
        let name = built.bar(*length);
        built.pin(&from, &format!("{name}.P"));
        from = format!("{name}.Q");
    }
    let to = built.ground(base);
    built.pin(&from, &to);
    built.with_guesses(guess)
}

/// Smallest root of the sum of squares of the changes of the angles of a closed chain, by all angles of its first bars in
/// steps of a degree.
fn least_distance(lengths: &[f64], base: Vec2, guess: &[f64]) -> f64 {
    let &[first, ref rest @ ..] = lengths else { unreachable!() };
    let steps = (0..360).map(|degree| f64::from(degree).to_radians());
    let squares = |angle: f64| wrapped(angle - guess[0]).powi(2);
    let leasts = steps.map(|angle| {
        let base = base - turned(first, angle);
        let others = match *rest {
            [a, b] => {
                let along = (a * a - b * b + base.norm_squared()) / (2.0 * base.norm());
                let half = (along / a).acos();
                let ways = [half, -half].map(|half| {
                    let angle = angle_of(base) + half;
                    let other = angle_of(base - turned(a, angle));
                    wrapped(angle - guess[1]).powi(2) + wrapped(other - guess[2]).powi(2)
                });
                ways.into_iter().filter(|squares| squares.is_finite()).fold(f64::INFINITY, f64::min)
            }
            _ => least_distance(rest, base, &guess[1..]).powi(2),
        };
        squares(angle) + others
    });
    leasts.fold(f64::INFINITY, f64::min).sqrt()
}

#[test]
fn a_loop_that_can_move_starts_about_as_near_as_any_of_its_poses() {
    let mut random = Random(4);
    for (bars, count) in [(3, 100), (4, 3)] {
        for (within, around) in [(FRAC_PI_4, 1.0), (PI, 1.0), (0.0, 0.0)] {
            for _ in 0..count {
                let lengths: Vec<f64> = (0..bars).map(|_| random.within(0.2, 0.6)).collect();
                let truth: Vec<f64> = (0..bars).map(|_| random.within(-PI, PI)).collect();
                let base = lengths.iter().zip(&truth).map(|(length, angle)| turned(*length, *angle)).sum();
                let guess: Vec<f64> =
                    truth.iter().map(|angle| around * angle + random.within(-within, within)).collect();
                let mechanism = compile(&free_chain(&lengths, base, &guess));
                let away =
                    angles_at_start(&mechanism).into_iter().zip(&guess).map(|(start, guess)| start - guess);
                let distance = away.map(|away| away * away).sum::<f64>().sqrt();
                let least = least_distance(&lengths, base, &guess);
                // A step of the angles that were tried.
                let step = TAU / 360.0;
                assert!(distance < EQUALLY_NEAR * least + step, "{distance} {least}: {lengths:?} {guess:?}");
            }
        }
    }
}

/// A plate on three bars, of which a crank carries the first: a group of four bodies that are no dyads.
struct Plate {
    pivots: [Vec2; 3],
    corners: [Vec2; 3],
    legs: [f64; 3],
}

impl Plate {
    fn random(random: &mut Random) -> (Self, [f64; 4]) {
        let mut point = |size: f64| Vec2::new(random.within(-size, size), random.within(-size, size));
        let corners = [point(0.4), point(0.4), point(0.4)];
        let (pivots, origin) = ([point(0.6), point(0.6), point(0.6)], point(0.4));
        let angle = random.within(-PI, PI);
        let arms = [0, 1, 2].map(|k| origin + rotated(corners[k], angle) - pivots[k]);
        let [a, b, c] = arms.map(angle_of);
        (Self { pivots, corners, legs: arms.map(|arm| arm.norm()) }, [angle, a, b, c])
    }

    /// How far the third leg misses, with the plate at an angle and the other legs closed on a side; the angles.
    fn miss(&self, angle: f64, side: f64) -> (f64, [f64; 4]) {
        // Circles around where the origin of the plate would be if each leg had no length.
        let centers = [0, 1, 2].map(|k| self.pivots[k] - rotated(self.corners[k], angle));
        let base = centers[1] - centers[0];
        let along = (self.legs[0].powi(2) - self.legs[1].powi(2) + base.norm_squared()) / (2.0 * base.norm());
        let across = side * (self.legs[0].powi(2) - along * along).sqrt();
        let unit = base.normalize();
        let origin = centers[0] + along * unit + across * Vec2::new(-unit.y, unit.x);
        let [a, b, c] = centers.map(|center| angle_of(origin - center));
        ((origin - centers[2]).norm() - self.legs[2], [angle, a, b, c])
    }

    /// All assemblies: roots of the miss over the angle of the plate.
    fn assemblies(&self) -> Vec<[f64; 4]> {
        let mut found = Vec::new();
        let steps = 7200;
        for side in [1.0, -1.0] {
            for step in 0..steps {
                let [mut low, mut high] =
                    [step, step + 1].map(|step| -PI + TAU * f64::from(step) / f64::from(steps));
                let product = self.miss(low, side).0 * self.miss(high, side).0;
                if product.is_nan() || product > 0.0 {
                    continue;
                }
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    let same = self.miss(middle, side).0 * self.miss(low, side).0 > 0.0;
                    if same { low = middle } else { high = middle }
                }
                found.push(self.miss(low, side).1);
            }
        }
        found
    }

    fn scene(&self, guess: &[f64; 4]) -> Scene {
        let mut built = Built::new();
        let corners = ["A", "B", "C"].iter().zip(self.corners).map(|(name, at)| point(name, at.x, at.y));
        built.scene.bodies.push(body("plate", 1.0, 0.1, [0.0, 0.0], corners.collect()));
        for (k, leg) in self.legs.into_iter().enumerate() {
            let bar = built.bar(leg);
            let pivot = if k == 0 {
                let crank = built.ground(self.pivots[0] - Vec2::new(0.3, 0.0));
                built.scene.bodies.push(body("crank", 1.0, 0.1, [0.0, 0.0], vec![point("Q", 0.3, 0.0)]));
                let pin = built.pin(&crank, "crank");
                let motion = TimeFunction::Polynomial(vec![0.0, 1.0]);
                built.scene.drives.push(Drive::Motion { name: "drive".into(), joint: pin, motion });
                "crank.Q".to_owned()
            } else {
                built.ground(self.pivots[k])
            };
            built.pin(&pivot, &format!("{bar}.P"));
            built.pin(&format!("{bar}.Q"), &format!("plate.{}", ["A", "B", "C"][k]));
        }
        let [plate, a, b, c] = *guess;
        built.with_guesses(&[plate, a, 0.0, b, c])
    }
}

fn rotated(vector: Vec2, angle: f64) -> Vec2 {
    nalgebra::Rotation2::new(angle) * vector
}

/// How many of the starts of random plates with guesses within an angle (zeros if it is none) are not at the nearest
/// assembly, those that are not assembled included, of which number.
fn plates_elsewhere(count: usize, within: Option<f64>) -> (usize, usize) {
    let mut random = Random(5);
    let (mut elsewhere, mut judged) = (0, 0);
    while judged < count {
        let (plate, truth) = Plate::random(&mut random);
        let guess = truth.map(|angle| within.map_or(0.0, |within| angle + random.within(-within, within)));
        let distance = |angles: &[f64; 4]| -> f64 {
            let squares = (0..4).map(|k| wrapped(angles[k] - guess[k]).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let mut distances: Vec<f64> = plate.assemblies().iter().map(distance).collect();
        distances.sort_by(f64::total_cmp);
        if distances.get(1).is_some_and(|second| *second <= EQUALLY_NEAR * distances[0]) {
            continue;
        }
        judged += 1;
        let is_nearest = Mechanism::compile(&plate.scene(&guess)).is_ok_and(|mechanism| {
            let start = angles_at_start(&mechanism);
            (distance(&[start[0], start[1], start[3], start[4]]) - distances[0]).abs() < 1e-6
        });
        elsewhere += usize::from(!is_nearest);
    }
    (elsewhere, judged)
}

#[test]
fn a_plate_on_three_legs_starts_at_the_nearest_of_its_assemblies() {
    // The starts of Newton's method need not reach all six assemblies from everywhere.
    for (within, part) in [(Some(FRAC_PI_4), 50), (None, 50), (Some(PI), 20)] {
        let (elsewhere, judged) = plates_elsewhere(100, within);
        assert!(elsewhere <= judged / part, "{elsewhere} of {judged} within {within:?}");
    }
}
