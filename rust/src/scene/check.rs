//! Checks of a scene: all problems at once, each with its path.

use crate::contact::friction::FrictionLaw;
use crate::contact::pair::SlidingVelocity;
use crate::error::{InputError, Problem, Subject, meant_or_known};
use crate::expression::dimension::{Dimension, FORCE, TORQUE};
use crate::scene::check_laws::start_of_guide;
use crate::scene::loads::Expression;
use crate::scene::parts::{
    Attachment, Body, CENTER_OF_MASS, Drive, ENERGY, Ends, Force, GROUND, Joint, JointKind, Point, Scene,
    Start, same_points,
};

/// Most entries of a list of the scene, and points of a body. Assembly forms dense matrices of all coordinates: of 500
/// free bodies in 500 bearings it takes seconds, and of ten times as many a thousand times as long.
const MOST_ENTRIES: usize = 500;

impl Scene {
    /// All problems with names, and with numbers that contradict each other, in the order of the scene. Each number alone is
    /// judged where it is read.
    pub fn check(&self) -> Result<(), InputError> {
        let mut problems = Vec::new();
        let mut checker = Checker { path: String::new(), problems: &mut problems };
        if self.check_sizes(&mut checker) {
            self.check_parts(&mut checker);
        }
        Subject::Scene.judge((), problems)
    }

    /// Checks that nothing is too large for the other checks and for assembly.
    fn check_sizes(&self, checker: &mut Checker) -> bool {
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
                checker.add(&path, format!("must have at most {MOST_ENTRIES} entries, got {count}"));
            }
        }
        checker.problems.is_empty()
    }

    fn check_parts(&self, checker: &mut Checker) {
        checker.points("ground", &self.ground);
        if self.bodies.is_empty() {
            checker.add("bodies", "a scene needs at least one body");
        }
        for (index, body) in self.bodies.iter().enumerate() {
            self.check_body(&mut checker.at("bodies", index), index, body);
        }
        let ends: Vec<Ends> = self.joints.iter().map(|joint| self.ends(joint)).collect();
        for (index, joint) in self.joints.iter().enumerate() {
            self.check_joint(&mut checker.at("joints", index), index, joint, &ends);
        }
        for (index, force) in self.forces.iter().enumerate() {
            self.check_force(&mut checker.at("forces", index), index, force);
        }
        for (index, drive) in self.drives.iter().enumerate() {
            self.check_drive(&mut checker.at("drives", index), index, drive);
        }
        for (index, start) in self.start.iter().enumerate() {
            self.check_start(&mut checker.at("start", index), index, start);
        }
        for (index, coupling) in self.couplings.iter().enumerate() {
            let mut checker = checker.at("couplings", index);
            let earlier = self.couplings[..index].iter().any(|other| other.name == coupling.name)
                || self.forces.iter().any(|force| force.name() == Some(&coupling.name))
                || self.drives.iter().any(|drive| drive.name() == coupling.name);
            self.check_name(&mut checker, &coupling.name, earlier);
            coupling.check(self, &mut checker);
        }
    }

    fn check_body(&self, checker: &mut Checker, index: usize, body: &Body) {
        let earlier = self.bodies[..index].iter().any(|other| other.name == body.name);
        checker.owner(&body.name, earlier);
        if body.name == GROUND {
            checker.add("name", "\"ground\" is the name of the fixed body");
        }
        checker.points("points", &body.points);
        let known = || body.points.iter().map(|point| point.name.as_str()).chain([CENTER_OF_MASS]);
        if !known().any(|name| name == body.inertia_about) {
            let hint = meant_or_known(&body.inertia_about, known());
            let message = format!("unknown point {:?} of {:?}{hint}", body.inertia_about, body.name);
            checker.add("inertia_about", message);
        } else if self.central_inertia(body) < 0.0 {
            let message = format!(
                "must be >= mass * distance^2 to the center of mass for a moment about {:?}, got {}: the moment about the \
                 center of mass, zero for a point mass, would be {:.3e} kg m^2",
                body.inertia_about,
                body.inertia,
                self.central_inertia(body)
            );
            checker.add("inertia", message);
        }
    }

    fn check_joint(&self, checker: &mut Checker, index: usize, joint: &Joint, ends_of: &[Ends]) {
        let earlier = self.joints[..index].iter().any(|other| other.name() == joint.name());
        checker.owner(joint.name(), earlier);
        if self.bodies.iter().any(|body| body.name == joint.name()) {
            let name = joint.name();
            let message = format!("a body is also called {name:?}: the names of outputs would be ambiguous");
            checker.add("name", message);
        }
        checker.ends(joint.references().map(|(field, reference)| (field, self.body_of(reference))));
        let body = |end: Option<Attachment>| end.and_then(|end| end.body);
        match joint {
            Joint::Ideal { .. } => {}
            Joint::Clearance { journal_radius, contact, friction, sliding, film, .. } => {
                self.check_free_to_act(checker, joint, &ends_of[index], ends_of);
                checker.inside("contact").normal_law(contact, self, ends_of[index].map(body));
                if let Some(law) = friction {
                    checker.inside("friction").friction(law);
                    if let (FrictionLaw::StickSlip(_), SlidingVelocity::ContactPoint) = (law, sliding) {
                        checker.add(
                            "sliding",
                            "must be \"surface\" with the law stick_slip: surfaces stick, the geometric contact point \
                             moves on while they roll",
                        );
                    }
                }
                checker.profile(joint);
                if let Some(lubricant) = film {
                    checker.inside("film").lubricant(lubricant, *journal_radius);
                }
            }
            Joint::Guide { .. } => checker.guide(joint, self, ends_of[index].map(body)),
        }
    }

    /// Checks that no ideal joint holds the two points of a clearance joint together.
    fn check_free_to_act(&self, checker: &mut Checker, joint: &Joint, own: &Ends, ends_of: &[Ends]) {
        let holds = |(other, ends): &(&Joint, &Ends)| {
            let rigid =
                matches!(other, Joint::Ideal { kind: JointKind::Revolute | JointKind::Fixed { .. }, .. });
            rigid && same_points(own, ends)
        };
        if let Some((other, _)) = self.joints.iter().zip(ends_of).find(holds) {
            let message = format!(
                "{:?} never acts: {:?} holds the same two points together without clearance; remove one of them",
                joint.name(),
                other.name()
            );
            checker.add("", message);
        }
    }

    /// Checks that the name of a force or drive differs from those of bodies and joints, since names of
    /// outputs would be ambiguous, and from `earlier` names.
    fn check_name(&self, checker: &mut Checker, name: &str, earlier: bool) {
        let taken = self.bodies.iter().any(|body| body.name == *name)
            || self.joints.iter().any(|other| other.name() == name);
        checker.owner(name, earlier || taken);
    }

    fn check_force(&self, checker: &mut Checker, index: usize, force: &Force) {
        if let Some(name) = force.name() {
            let earlier = self.forces[..index].iter().any(|other| other.name() == Some(name));
            self.check_name(checker, name, earlier);
        }
        match force {
            Force::Gravity { .. } => {}
            Force::Spring { a, b, tension, .. } => {
                checker.ends([("a", self.body_of(a)), ("b", self.body_of(b))]);
                checker.load(self, "tension", FORCE, tension);
            }
            Force::Bushing { a, b, formulas, .. } => {
                checker.formulas(self, formulas);
                checker.ends([("a", self.body_of(a)), ("b", self.body_of(b))]);
            }
            Force::TorsionSpring { a, b, .. } => {
                checker.ends([("a", self.body_index(a)), ("b", self.body_index(b))]);
            }
            Force::Applied { point, x, y, .. } => {
                checker.result("point", self.attachment(point));
                checker.load(self, "x", FORCE, x);
                checker.load(self, "y", FORCE, y);
            }
            Force::Torque { body, reaction, torque, .. } => {
                checker.ends([("body", self.body_index(body)), ("reaction", self.body_index(reaction))]);
                checker.load(self, "torque", TORQUE, torque);
            }
        }
    }

    fn check_drive(&self, checker: &mut Checker, index: usize, drive: &Drive) {
        let (name, joint) = (drive.name(), drive.joint());
        let earlier = self.drives[..index].iter().any(|other| other.name() == name)
            || self.forces.iter().any(|force| force.name() == Some(name));
        self.check_name(checker, name, earlier);
        let only_revolute = matches!(drive, Drive::Speed { .. });
        match self.find_joint(joint) {
            Ok(Joint::Ideal { kind: JointKind::Revolute, .. }) => {}
            Ok(Joint::Ideal { kind: JointKind::Prismatic { .. }, .. }) if !only_revolute => {}
            Ok(Joint::Ideal { kind: JointKind::Prismatic { .. }, .. }) => {
                let use_motion =
                    "a speed turns a revolute joint; for a prismatic one use a drive of type \"motion\"";
                checker.add("joint", format!("joint {joint:?} is prismatic: {use_motion}"));
            }
            Ok(_) => {
                let kinds = if only_revolute { "revolute" } else { "revolute or prismatic" };
                checker.add("joint", format!("joint {joint:?} must be a {kinds} joint without clearance"));
            }
            Err(message) => checker.add("joint", message),
        }
        if self.drives[..index].iter().any(|other| other.joint() == joint) {
            checker.add("joint", format!("joint {joint:?} is driven twice"));
        }
    }

    fn check_start(&self, checker: &mut Checker, index: usize, start: &Start) {
        let earlier = &self.start[..index];
        let (field, name, found) = match start {
            Start::Joint { joint, .. } => {
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
            Start::Body { body, .. } => {
                let found = self.body_index(body).and_then(|index| match index {
                    Some(_) => Ok(()),
                    None => Err("ground does not move".to_owned()),
                });
                ("body", body, found)
            }
            Start::Clearance { joint, .. } => {
                let found = self.find_joint(joint).and_then(|found| match found {
                    Joint::Clearance { .. } => Ok(()),
                    _ => Err(format!("joint {joint:?} must be a revolute joint with clearance")),
                });
                ("joint", joint, found)
            }
            Start::Guide { joint, tilt, .. } => {
                let found = self.find_joint(joint).and_then(|found| start_of_guide(found, tilt));
                ("joint", joint, found)
            }
        };
        checker.result(field, found);
        let twice = earlier.iter().any(|other| match (start, other) {
            (Start::Body { body, .. }, Start::Body { body: other, .. }) => body == other,
            (Start::Joint { joint, .. }, Start::Joint { joint: other, .. })
            | (Start::Clearance { joint, .. }, Start::Clearance { joint: other, .. })
            | (Start::Guide { joint, .. }, Start::Guide { joint: other, .. }) => joint == other,
            _ => false,
        });
        if twice {
            checker.add(field, format!("the start of {name:?} is given twice"));
        }
    }

    fn body_of(&self, reference: &str) -> Result<Option<usize>, String> {
        self.attachment(reference).map(|end| end.body)
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

/// Collects the problems of a part of the scene; each method is one rule. Fields are those of the part, and "" is the part
/// itself.
pub(super) struct Checker<'p> {
    path: String,
    problems: &'p mut Vec<Problem>,
}

impl Checker<'_> {
    /// The checker of an entry of a list.
    fn at(&mut self, list: &str, index: usize) -> Checker<'_> {
        Checker { path: self.path_of(&format!("{list}[{index}]")), problems: self.problems }
    }

    /// The checker of a field with fields of its own.
    pub(super) fn inside(&mut self, field: &str) -> Checker<'_> {
        Checker { path: self.path_of(field), problems: self.problems }
    }

    fn path_of(&self, field: &str) -> String {
        let dot = if self.path.is_empty() || field.is_empty() { "" } else { "." };
        format!("{}{dot}{field}", self.path)
    }

    pub(super) fn add(&mut self, field: &str, message: impl Into<String>) {
        self.problems.push(Problem::new(self.path_of(field), message));
    }

    /// The value, or `None` after adding its error.
    pub(super) fn result<T>(&mut self, field: &str, result: Result<T, String>) -> Option<T> {
        result.map_err(|message| self.add(field, message)).ok()
    }

    /// Checks a function of the motion.
    pub(super) fn expression(&mut self, scene: &Scene, field: &str, wanted: Dimension, load: &Expression) {
        self.problems.extend(load.problems(scene, &self.path_of(field), wanted));
    }

    /// Checks that two ends are known, and on different bodies.
    fn ends(&mut self, ends: [(&str, Result<Option<usize>, String>); 2]) {
        if let [Some(first), Some(second)] = ends.map(|(field, end)| self.result(field, end))
            && first == second
        {
            self.add("", "connects a body to itself: the two ends must be on different bodies");
        }
    }

    fn name(&mut self, field: &str, name: &str, taken: bool) {
        if name.is_empty() || name.contains('.') {
            self.add(field, format!("must be a non-empty name without a dot, got {name:?}"));
        }
        if name.contains(is_unseen) {
            self.add(field, format!("must be a name without control characters, got {name:?}"));
        }
        if taken {
            self.add(field, format!("the name {name:?} is already taken"));
        }
    }

    /// Checks a name that begins names of outputs.
    fn owner(&mut self, name: &str, taken: bool) {
        self.name("name", name, taken);
        if name == ENERGY {
            self.add("name", format!("{ENERGY:?} is the name of the outputs of the whole mechanism"));
        }
    }

    fn points(&mut self, field: &str, points: &[Point]) {
        for (index, point) in points.iter().enumerate() {
            let path = format!("{field}.{}", point.name);
            self.name(&path, &point.name, points[..index].iter().any(|other| other.name == point.name));
        }
    }
}
