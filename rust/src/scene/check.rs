//! Checks of a scene: all problems at once, each with its path.

use crate::contact::friction::FrictionLaw;
use crate::contact::pair::SlidingVelocity;
use crate::error::{InputError, Problem, Subject, meant_or_known, refused};
use crate::expression::dimension::{FORCE, TORQUE};
use crate::scene::parts::{
    Body, CENTER_OF_MASS, Drive, ENERGY, Ends, Force, GROUND, Joint, JointKind, Point, Scene, Start,
    length_scale, same_points,
};

/// Most entries of a list of the scene, and points of a body. Assembly forms dense matrices of all coordinates: of 500
/// free bodies in 500 bearings it takes seconds, and of ten times as many a thousand times as long.
const MOST_ENTRIES: usize = 500;

impl Scene {
    /// All problems with the numbers and names of the scene, in its order.
    pub fn check(&self) -> Result<(), InputError> {
        let mut checker = Checker { problems: Vec::new() };
        self.check_sizes(&mut checker);
        if !checker.problems.is_empty() {
            return checker.finish();
        }
        checker.points("ground", &self.ground);
        if self.bodies.is_empty() {
            checker.add("bodies", "a scene needs at least one body");
        }
        for (index, body) in self.bodies.iter().enumerate() {
            self.check_body(&mut checker, &format!("bodies[{index}]"), index, body);
        }
        let ends: Vec<Ends> = self.joints.iter().map(|joint| self.ends(joint)).collect();
        for (index, joint) in self.joints.iter().enumerate() {
            self.check_joint(&mut checker, &format!("joints[{index}]"), index, joint, &ends);
            if let Joint::Ideal { friction: Some(law), .. } = joint {
                checker.joint_friction(&format!("joints[{index}].friction"), law);
            }
        }
        for (index, force) in self.forces.iter().enumerate() {
            self.check_force(&mut checker, &format!("forces[{index}]"), index, force);
        }
        for (index, drive) in self.drives.iter().enumerate() {
            self.check_drive(&mut checker, &format!("drives[{index}]"), index, drive);
        }
        for (index, start) in self.start.iter().enumerate() {
            self.check_start(&mut checker, &format!("start[{index}]"), index, start);
        }
        for (index, coupling) in self.couplings.iter().enumerate() {
            let path = format!("couplings[{index}]");
            let earlier = self.couplings[..index].iter().any(|other| other.name == coupling.name)
                || self.forces.iter().any(|force| force.name() == Some(&coupling.name))
                || self.drives.iter().any(|drive| drive.name() == coupling.name);
            self.check_name(&mut checker, &path, &coupling.name, earlier);
            coupling.check(self, &mut checker, &path);
        }
        checker.finish()
    }

    /// Checks that nothing is too large for the other checks and for assembly.
    fn check_sizes(&self, checker: &mut Checker) {
        let bodies = self.bodies.iter().enumerate();
        let points = bodies.map(|(index, body)| (format!("bodies[{index}].points"), body.points.len()));
        let lists = [
            ("ground", self.ground.len()),
            ("bodies", self.bodies.len()),
            ("joints", self.joints.len()),
            ("forces", self.forces.len()),
            ("drives", self.drives.len()),
            ("start", self.start.len()),
            ("couplings", self.couplings.len()),
        ];
        for (path, count) in lists.map(|(path, count)| (path.to_owned(), count)).into_iter().chain(points) {
            if count > MOST_ENTRIES {
                checker.add(path, format!("must have at most {MOST_ENTRIES} entries, got {count}"));
            }
        }
    }

    fn check_body(&self, checker: &mut Checker, path: &str, index: usize, body: &Body) {
        let earlier = self.bodies[..index].iter().any(|other| other.name == body.name);
        checker.owner(&format!("{path}.name"), &body.name, earlier);
        if body.name == GROUND {
            checker.add(format!("{path}.name"), "\"ground\" is the name of the fixed body");
        }
        checker.positive(&format!("{path}.mass"), "kg", body.mass);
        checker.positive(&format!("{path}.inertia"), "kg m^2", body.inertia);
        checker.finite_pair(&format!("{path}.center_of_mass"), "m", &body.center_of_mass);
        checker.finite(&format!("{path}.angle"), "rad", body.angle);
        checker.points(&format!("{path}.points"), &body.points);
        let known = || body.points.iter().map(|point| point.name.as_str()).chain([CENTER_OF_MASS]);
        if !known().any(|name| name == body.inertia_about) {
            let hint = meant_or_known(&body.inertia_about, known());
            checker.add(
                format!("{path}.inertia_about"),
                format!("unknown point {:?} of {:?}{hint}", body.inertia_about, body.name),
            );
        } else if body.inertia > 0.0
            && body.center_of_mass.iter().all(|side| side.is_finite())
            && self.central_inertia(body) <= 0.0
        {
            checker.add(
                format!("{path}.inertia"),
                format!(
                    "must be > mass * distance^2 to the center of mass for a moment about {:?}, got {}: \
                     the moment about the center of mass would be {:.3e} kg m^2",
                    body.inertia_about,
                    body.inertia,
                    self.central_inertia(body)
                ),
            );
        }
    }

    fn check_joint(&self, checker: &mut Checker, path: &str, index: usize, joint: &Joint, ends_of: &[Ends]) {
        let earlier = self.joints[..index].iter().any(|other| other.name() == joint.name());
        checker.owner(&format!("{path}.name"), joint.name(), earlier);
        if self.bodies.iter().any(|body| body.name == joint.name()) {
            checker.add(
                format!("{path}.name"),
                format!("a body is also called {:?}: the names of outputs would be ambiguous", joint.name()),
            );
        }
        let ends = joint.references().map(|(field, reference)| {
            checker.result(&format!("{path}.{field}"), self.attachment(reference)).map(|end| end.body)
        });
        checker.apart(path, ends);
        match joint {
            Joint::Ideal { kind: JointKind::Revolute, .. } => {}
            Joint::Ideal { kind: JointKind::Prismatic { axis, angle }, .. } => {
                checker.finite_pair(&format!("{path}.axis"), "-", axis);
                if *axis == [0.0, 0.0] {
                    checker.add(format!("{path}.axis"), "must not be the zero vector");
                }
                checker.finite(&format!("{path}.angle"), "rad", *angle);
            }
            Joint::Ideal { kind: JointKind::Fixed { angle }, .. } => {
                checker.finite(&format!("{path}.angle"), "rad", *angle);
            }
            Joint::Clearance {
                journal_radius,
                clearance,
                contact,
                friction,
                sliding,
                film,
                impact_velocity_floor,
                ..
            } => {
                self.check_free_to_act(checker, path, joint, &ends_of[index], ends_of);
                checker.positive(&format!("{path}.journal_radius"), "m", *journal_radius);
                checker.positive(&format!("{path}.clearance"), "m", *clearance);
                checker.normal_law(&format!("{path}.contact"), contact, length_scale(self));
                if let Some(law) = friction {
                    checker.friction(&format!("{path}.friction"), law);
                    if let (FrictionLaw::StickSlip(_), SlidingVelocity::ContactPoint) = (law, sliding) {
                        checker.add(
                            format!("{path}.sliding"),
                            "must be \"surface\" with the law stick_slip: surfaces stick, the geometric contact point \
                             moves on while they roll",
                        );
                    }
                }
                checker.profile(path, joint);
                if let Some(lubricant) = film {
                    checker.lubricant(&format!("{path}.film"), lubricant, *journal_radius);
                }
                if let Some(floor) = impact_velocity_floor {
                    checker.positive(&format!("{path}.impact_velocity_floor"), "m/s", *floor);
                }
            }
            Joint::Guide { .. } => checker.guide(path, joint, length_scale(self)),
        }
    }

    /// Checks that no ideal joint holds the two points of a clearance joint together.
    fn check_free_to_act(
        &self,
        checker: &mut Checker,
        path: &str,
        joint: &Joint,
        own: &Ends,
        ends_of: &[Ends],
    ) {
        let holds = |(other, ends): &(&Joint, &Ends)| {
            let rigid =
                matches!(other, Joint::Ideal { kind: JointKind::Revolute | JointKind::Fixed { .. }, .. });
            rigid && same_points(own, ends)
        };
        if let Some((other, _)) = self.joints.iter().zip(ends_of).find(holds) {
            checker.add(
                path,
                format!(
                    "{:?} never acts: {:?} holds the same two points together without clearance; remove one of them",
                    joint.name(),
                    other.name()
                ),
            );
        }
    }

    /// Checks that the name of a force or drive differs from those of bodies and joints, since names of
    /// outputs would be ambiguous, and from `earlier` names.
    fn check_name(&self, checker: &mut Checker, path: &str, name: &str, earlier: bool) {
        let taken = self.bodies.iter().any(|body| body.name == *name)
            || self.joints.iter().any(|other| other.name() == name);
        checker.owner(&format!("{path}.name"), name, earlier || taken);
    }

    // Long because each kind of force is listed.
    fn check_force(&self, checker: &mut Checker, path: &str, index: usize, force: &Force) {
        if let Some(name) = force.name() {
            let earlier = self.forces[..index].iter().any(|other| other.name() == Some(name));
            self.check_name(checker, path, name, earlier);
        }
        match force {
            Force::Gravity { acceleration } => {
                checker.finite_pair(&format!("{path}.acceleration"), "m/s^2", acceleration);
            }
            Force::Spring { a, b, stiffness, length, damping, tension, .. } => {
                let ends = [("a", a), ("b", b)].map(|(field, reference)| {
                    let end = self.attachment(reference);
                    checker.result(&format!("{path}.{field}"), end).map(|end| end.body)
                });
                checker.apart(path, ends);
                checker.at_least(&format!("{path}.stiffness"), "N/m", *stiffness, 0.0);
                checker.at_least(&format!("{path}.length"), "m", *length, 0.0);
                checker.at_least(&format!("{path}.damping"), "N s/m", *damping, 0.0);
                checker.load(self, &format!("{path}.tension"), FORCE, tension);
            }
            Force::Bushing {
                a,
                b,
                stiffness,
                damping,
                torsional_stiffness,
                torsional_damping,
                formulas,
                ..
            } => {
                checker.formulas(self, path, formulas);
                let ends = [("a", a), ("b", b)].map(|(field, reference)| {
                    let end = self.attachment(reference);
                    checker.result(&format!("{path}.{field}"), end).map(|end| end.body)
                });
                checker.apart(path, ends);
                checker.at_least(&format!("{path}.stiffness"), "N/m", *stiffness, 0.0);
                checker.at_least(&format!("{path}.damping"), "N s/m", *damping, 0.0);
                checker.at_least(
                    &format!("{path}.torsional_stiffness"),
                    "N m/rad",
                    *torsional_stiffness,
                    0.0,
                );
                checker.at_least(&format!("{path}.torsional_damping"), "N m s/rad", *torsional_damping, 0.0);
            }
            Force::TorsionSpring { a, b, stiffness, angle, damping, .. } => {
                let ends = [("a", a), ("b", b)]
                    .map(|(field, name)| checker.result(&format!("{path}.{field}"), self.body_index(name)));
                checker.apart(path, ends);
                checker.at_least(&format!("{path}.stiffness"), "N m/rad", *stiffness, 0.0);
                checker.finite(&format!("{path}.angle"), "rad", *angle);
                checker.at_least(&format!("{path}.damping"), "N m s/rad", *damping, 0.0);
            }
            Force::Applied { point, x, y, .. } => {
                checker.result(&format!("{path}.point"), self.attachment(point));
                checker.load(self, &format!("{path}.x"), FORCE, x);
                checker.load(self, &format!("{path}.y"), FORCE, y);
            }
            Force::Torque { body, reaction, torque, .. } => {
                let ends = [("body", body), ("reaction", reaction)]
                    .map(|(field, name)| checker.result(&format!("{path}.{field}"), self.body_index(name)));
                checker.apart(path, ends);
                checker.load(self, &format!("{path}.torque"), TORQUE, torque);
            }
        }
    }

    fn check_drive(&self, checker: &mut Checker, path: &str, index: usize, drive: &Drive) {
        let (name, joint) = (drive.name(), drive.joint());
        let earlier = self.drives[..index].iter().any(|other| other.name() == name)
            || self.forces.iter().any(|force| force.name() == Some(name));
        self.check_name(checker, path, name, earlier);
        let only_revolute = match drive {
            Drive::Speed { speed, angle, .. } => {
                checker.finite(&format!("{path}.speed"), "rad/s", *speed);
                checker.finite(&format!("{path}.angle"), "rad", *angle);
                true
            }
            Drive::Motion { motion, .. } => {
                checker.function(&format!("{path}.motion"), "rad or m", motion);
                false
            }
        };
        let joint_path = format!("{path}.joint");
        match self.find_joint(joint) {
            Ok(Joint::Ideal { kind: JointKind::Revolute, .. }) => {}
            Ok(Joint::Ideal { kind: JointKind::Prismatic { .. }, .. }) if !only_revolute => {}
            Ok(Joint::Ideal { kind: JointKind::Prismatic { .. }, .. }) => {
                let use_motion =
                    "a speed turns a revolute joint; for a prismatic one use a drive of type \"motion\"";
                checker.add(joint_path, format!("joint {joint:?} is prismatic: {use_motion}"));
            }
            Ok(_) => {
                let kinds = if only_revolute { "revolute" } else { "revolute or prismatic" };
                checker.add(joint_path, format!("joint {joint:?} must be a {kinds} joint without clearance"));
            }
            Err(message) => checker.add(joint_path, message),
        }
        if self.drives[..index].iter().any(|other| other.joint() == joint) {
            checker.add(format!("{path}.joint"), format!("joint {joint:?} is driven twice"));
        }
    }

    fn check_start(&self, checker: &mut Checker, path: &str, index: usize, start: &Start) {
        let earlier = &self.start[..index];
        let mut finite = |field: &str, unit: &str, value: Option<f64>| {
            checker.finite(&format!("{path}.{field}"), unit, value.unwrap_or(0.0));
        };
        let (field, name, found) = match start {
            Start::Joint { joint, position, velocity } => {
                finite("position", "rad or m", *position);
                finite("velocity", "rad/s or m/s", *velocity);
                let found = self.find_joint(joint).and_then(|found| match found {
                    Joint::Ideal { kind: JointKind::Revolute | JointKind::Prismatic { .. }, .. } => Ok(()),
                    _ => Err(format!(
                        "joint {joint:?} must be a revolute or prismatic joint without clearance"
                    )),
                });
                let driven = self.drives.iter().find(|drive| drive.joint() == joint);
                let found = found.and(driven.map_or(Ok(()), |drive| {
                    Err(format!("the start of joint {joint:?} is prescribed by its drive {:?}", drive.name()))
                }));
                ("joint", joint, found)
            }
            Start::Body { body, angle, angular_velocity } => {
                finite("angle", "rad", *angle);
                finite("angular_velocity", "rad/s", *angular_velocity);
                let found = self.body_index(body).and_then(|index| match index {
                    Some(_) => Ok(()),
                    None => Err("ground does not move".to_owned()),
                });
                ("body", body, found)
            }
            Start::Clearance { joint, eccentricity, rate } => {
                checker.finite_pair(&format!("{path}.eccentricity"), "m", eccentricity);
                checker.finite_pair(&format!("{path}.rate"), "m/s", rate);
                let found = self.find_joint(joint).and_then(|found| match found {
                    Joint::Clearance { .. } => Ok(()),
                    _ => Err(format!("joint {joint:?} must be a revolute joint with clearance")),
                });
                ("joint", joint, found)
            }
            Start::Guide { joint, .. } => {
                let found = self.find_joint(joint).and_then(|found| checker.guide_start(path, found, start));
                ("joint", joint, found)
            }
        };
        checker.result(&format!("{path}.{field}"), found);
        let twice = earlier.iter().any(|other| match (start, other) {
            (Start::Body { body, .. }, Start::Body { body: other, .. }) => body == other,
            (Start::Joint { joint, .. }, Start::Joint { joint: other, .. })
            | (Start::Clearance { joint, .. }, Start::Clearance { joint: other, .. })
            | (Start::Guide { joint, .. }, Start::Guide { joint: other, .. }) => joint == other,
            _ => false,
        });
        if twice {
            checker.add(format!("{path}.{field}"), format!("the start of {name:?} is given twice"));
        }
    }

    fn find_joint(&self, name: &str) -> Result<&Joint, String> {
        self.joints.iter().find(|joint| joint.name() == name).ok_or_else(|| {
            let hint = meant_or_known(name, self.joints.iter().map(Joint::name));
            format!("unknown joint {name:?}{hint}")
        })
    }
}

/// Whether a letter moves the cursor of a terminal, colors it or ends a line.
fn is_unseen(letter: char) -> bool {
    letter.is_control() || matches!(letter, '\u{2028}' | '\u{2029}')
}

/// Collects problems; each method is one rule.
pub(super) struct Checker {
    pub(super) problems: Vec<Problem>,
}

impl Checker {
    pub(super) fn add(&mut self, path: impl Into<String>, message: impl Into<String>) {
        self.problems.push(Problem::new(path, message));
    }

    fn finish(self) -> Result<(), InputError> {
        Subject::Scene.judge((), self.problems)
    }

    /// The value, or `None` after adding its error.
    fn result<T>(&mut self, path: &str, result: Result<T, String>) -> Option<T> {
        result.map_err(|message| self.add(path, message)).ok()
    }

    /// Checks that two ends are on different bodies.
    fn apart(&mut self, path: &str, ends: [Option<Option<usize>>; 2]) {
        if let [Some(first), Some(second)] = ends
            && first == second
        {
            self.add(path, "connects a body to itself: the two ends must be on different bodies");
        }
    }

    pub(super) fn finite(&mut self, path: &str, unit: &str, value: f64) -> bool {
        if !value.is_finite() {
            self.add(path, format!("must be a finite number [{unit}], got {value}"));
        }
        value.is_finite()
    }

    pub(super) fn finite_pair(&mut self, path: &str, unit: &str, values: &[f64; 2]) {
        for (index, &value) in values.iter().enumerate() {
            self.finite(&format!("{path}[{index}]"), unit, value);
        }
    }

    pub(super) fn positive(&mut self, path: &str, unit: &str, value: f64) {
        if self.finite(path, unit, value) && value <= 0.0 {
            self.add(path, format!("must be > 0 [{unit}], got {}", refused(value, 0.0)));
        }
    }

    pub(super) fn at_least(&mut self, path: &str, unit: &str, value: f64, least: f64) {
        if self.finite(path, unit, value) && value < least {
            self.add(path, format!("must be >= {least} [{unit}], got {}", refused(value, least)));
        }
    }

    pub(super) fn fraction(&mut self, path: &str, value: f64) {
        if self.finite(path, "-", value) && !(value > 0.0 && value <= 1.0) {
            self.add(path, format!("must be > 0 and <= 1 [-], got {}", refused(value, 1.0)));
        }
    }

    fn name(&mut self, path: &str, name: &str, taken: bool) {
        if name.is_empty() || name.contains('.') {
            self.add(path, format!("must be a non-empty name without a dot, got {name:?}"));
        }
        if name.contains(is_unseen) {
            self.add(path, format!("must be a name without control characters, got {name:?}"));
        }
        if taken {
            self.add(path, format!("the name {name:?} is already taken"));
        }
    }

    /// Checks a name that begins names of outputs.
    fn owner(&mut self, path: &str, name: &str, taken: bool) {
        self.name(path, name, taken);
        if name == ENERGY {
            self.add(path, format!("{ENERGY:?} is the name of the outputs of the whole mechanism"));
        }
    }

    fn points(&mut self, path: &str, points: &[Point]) {
        for (index, point) in points.iter().enumerate() {
            let path = format!("{path}.{}", point.name);
            self.name(&path, &point.name, points[..index].iter().any(|other| other.name == point.name));
            self.finite_pair(&path, "m", &point.position);
        }
    }
}
