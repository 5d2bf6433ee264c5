//! The contact slots of joints with clearance: one of a revolute joint, four of a block in a guide, two of a pin in a slot,
//! one of a stop.

use crate::contact::face::Face;
use crate::contact::formula::{Formula, OF_FRICTION, OF_NORMAL_FORCE};
use crate::contact::friction::FrictionLaw;
use crate::contact::pair::{ContactLaw, SlidingVelocity, Surfaces};
use crate::contact::worn::WornBearing;
use crate::expression::dimension::Dimension;
use crate::scene::parts::{GuideShape, Joint};
use crate::tree::elements::{ContactSlot, FramePoint, Guide, Neighbor, Tree};
use crate::tree::kinematics::{Vec2, direction, perp};
use crate::tree::loads::{ContactQuantity, LawOf, Measure, MotionLoad, Variable};
use crate::tree::span::{Builder, rotated_by};

/// The corners of a block, seen along the axis of its guide: name, that of the end of the guide there, side along the
/// axis, side to its left.
const CORNERS: [(&str, &str, f64, f64); 4] = [
    ("front_left", "front_left_end", 1.0, 1.0),
    ("front_right", "front_right_end", 1.0, -1.0),
    ("rear_left", "rear_left_end", -1.0, 1.0),
    ("rear_right", "rear_right_end", -1.0, -1.0),
];
/// The sides of a slot for a pin.
const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];

impl Tree {
    /// Adds a slot, and its laws that are formulas to the functions of the motion, for their switches.
    pub(super) fn add_slot(&mut self, slot: ContactSlot) {
        use ContactQuantity::{ImpactVelocity, NormalForce, Penetration, PenetrationRate, SlidingVelocity};
        let index = self.slots.len();
        let variables = |names: &[(&str, Dimension)], quantities: &[ContactQuantity]| {
            let variables = names.iter().zip(quantities);
            let variable = |of| Variable { of: Measure::Contact(index, of), is_rate: false };
            variables.map(|((name, _), &of)| (String::from(*name), variable(of))).collect()
        };
        let of_force = variables(&OF_NORMAL_FORCE, &[Penetration, PenetrationRate, ImpactVelocity]);
        let of_friction = variables(&OF_FRICTION, &[SlidingVelocity, NormalForce]);
        let laws = [
            (false, slot.law.normal.formula(), of_force),
            (true, slot.law.friction.as_ref().and_then(FrictionLaw::formula), of_friction),
        ];
        for (is_friction, formula, variables) in laws {
            let Some(Formula { text, tape, .. }) = formula else { continue };
            self.motion_loads.push(MotionLoad {
                name: slot.name.clone(),
                text: text.clone(),
                tape: tape.clone(),
                variables,
                component: self.components.of(slot.bodies).unwrap_or_default(),
                first_switch: self.switch_count(),
                law_of: Some(LawOf { slot: index, is_friction }),
            });
        }
        self.slots.push(slot);
    }
}

impl Builder<'_> {
    /// Adds the slots of all joints with clearance, and the guides.
    pub(super) fn add_slots(&self, tree: &mut Tree) {
        for joint in &self.scene.joints {
            match joint {
                Joint::Ideal { .. } => {}
                Joint::Clearance {
                    name,
                    journal_radius,
                    clearance,
                    contact,
                    friction,
                    sliding,
                    profile,
                    impact_velocity_floor,
                    ..
                } => {
                    let (points, bodies) = self.placed(self.ends(joint));
                    let surfaces = if profile.is_empty() {
                        let bearing_radius = journal_radius + clearance;
                        Surfaces::Bearing { journal_radius: *journal_radius, bearing_radius }
                    } else {
                        let law = (*clearance, contact.stiffness);
                        let angle = self.placement(bodies[0]).angle;
                        Surfaces::Worn(Box::new(WornBearing::new(*journal_radius, law, profile, angle)))
                    };
                    let law = ContactLaw {
                        surfaces,
                        clearance: *clearance,
                        normal: contact.clone(),
                        friction: friction.clone(),
                        sliding: *sliding,
                    };
                    tree.add_slot(ContactSlot {
                        name: name.clone(),
                        points,
                        bodies,
                        is_aside: law.stick_slip().is_some() || law.has_formula(),
                        law,
                        impact_velocity_floor: *impact_velocity_floor,
                        neighbor: None,
                        backlash: None,
                    });
                }
                Joint::Guide { .. } => self.add_guide(tree, joint),
            }
        }
    }

    /// Adds a guide with its slots; a stop is a slot alone.
    fn add_guide(&self, tree: &mut Tree, joint: &Joint) {
        let Joint::Guide { name, axis, shape, face_length, contact, friction, impact_velocity_floor, .. } =
            joint
        else {
            return;
        };
        let (points, bodies) = self.placed(self.ends(joint));
        let [first, second] = bodies.map(|body| self.placement(body));
        let axis = rotated_by(direction(Vec2::from(*axis)), first.angle);
        let angle = match *shape {
            GuideShape::Block { angle, .. } => Some(angle),
            GuideShape::Pin { .. } | GuideShape::Stop { .. } => None,
        };
        // The axis in the frame of the second body, where it does not tilt.
        let on_b = rotated_by(axis, second.angle - first.angle - angle.unwrap_or(0.0));
        let before = tree.slots.len();
        let half_length = face_length.map_or(f64::INFINITY, |length| 0.5 * length);
        let touches = touches(shape, [axis, on_b], half_length, self.size(bodies));
        for (index, touch) in touches.iter().enumerate() {
            let Touch { place, corner, face, clearance, is_face_on_b, side } = *touch;
            let [a, b] = if is_face_on_b { [points[1], points[0]] } else { points };
            let [body_a, body_b] = bodies;
            // Corners come first, then in the same order the ends of the faces.
            let other = (index + touches.len() / 2) % touches.len();
            let is_neighbor = angle.is_some() && face_length.is_some();
            let neighbor = Neighbor { slot: before + other, normal: touches[other].face.normal, side };
            let law = ContactLaw {
                surfaces: Surfaces::Face(face),
                clearance,
                normal: contact.clone(),
                friction: friction.clone(),
                sliding: SlidingVelocity::Surface,
            };
            tree.add_slot(ContactSlot {
                name: if place.is_empty() { name.clone() } else { format!("{name}.{place}") },
                points: [a, FramePoint { offset: b.offset + corner, ..b }],
                bodies: if is_face_on_b { [body_b, body_a] } else { bodies },
                is_aside: law.stick_slip().is_some() || law.has_formula(),
                law,
                impact_velocity_floor: *impact_velocity_floor,
                neighbor: is_neighbor.then_some(neighbor),
                backlash: None,
            });
        }
        if let GuideShape::Stop { .. } = shape {
            return;
        }
        let slots = before..tree.slots.len();
        tree.guides.push(Guide { name: name.clone(), points, bodies, axis, angle, slots });
    }
}

/// A contact of a guide: its place in it, the vector from the point of its body to the corner, and the face that it may
/// touch.
#[derive(Clone, Copy)]
struct Touch {
    place: &'static str,
    corner: Vec2,
    face: Face,
    clearance: f64,
    /// Whether the face belongs to the second body of the joint.
    is_face_on_b: bool,
    /// See [`Neighbor::side`].
    side: f64,
}

/// The contacts of a guide whose axis is given in the frame of the first body and in that of the second, with faces of half
/// a length [m], in a component of a size [m].
fn touches(shape: &GuideShape, [axis, on_b]: [Vec2; 2], half_length: f64, component_size: f64) -> Vec<Touch> {
    let round = |place, normal: Vec2, limit, radius, clearance, size| Touch {
        place,
        corner: Vec2::zeros(),
        face: Face { normal: normal.into(), limit, radius, size, half_length },
        clearance,
        is_face_on_b: false,
        side: 0.0,
    };
    match *shape {
        GuideShape::Block { length, height, clearance, is_sleeve, .. } => {
            let (half, wide) = (0.5 * height, 0.5 * height + clearance);
            let (face_axis, corner_axis) = if is_sleeve { (on_b, axis) } else { (axis, on_b) };
            // A rod is touched from outside.
            let (reach, outward, limit) = if is_sleeve { (wide, -1.0, -half) } else { (half, 1.0, wide) };
            let corner_of = |(place, _, along, left): (&'static str, &str, f64, f64)| Touch {
                place,
                corner: along * 0.5 * length * corner_axis + left * reach * perp(corner_axis),
                face: Face {
                    normal: (outward * left * perp(face_axis)).into(),
                    limit,
                    radius: 0.0,
                    size: half,
                    half_length,
                },
                clearance,
                is_face_on_b: is_sleeve,
                side: -along * outward * left,
            };
            // The end of the face against the side of what has the corners.
            let end_of = |(_, place, along, left): (&str, &'static str, f64, f64)| Touch {
                place,
                corner: along * half_length * face_axis + outward * left * limit * perp(face_axis),
                face: Face {
                    normal: (-outward * left * perp(corner_axis)).into(),
                    limit: -outward * reach,
                    radius: 0.0,
                    size: half,
                    half_length: 0.5 * length,
                },
                clearance,
                is_face_on_b: !is_sleeve,
                side: along * outward * left,
            };
            let corners = CORNERS.iter().copied().map(corner_of);
            if half_length.is_finite() {
                corners.chain(CORNERS.iter().copied().map(end_of)).collect()
            } else {
                corners.collect()
            }
        }
        GuideShape::Pin { radius, clearance } => SIDES
            .map(|(place, left)| round(place, left * perp(axis), clearance, radius, clearance, radius))
            .into(),
        GuideShape::Stop { radius } => {
            vec![round("", -axis, -radius, radius, component_size, component_size)]
        }
    }
}
