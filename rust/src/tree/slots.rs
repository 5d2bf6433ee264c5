//! The contact slots of joints with clearance: one of a revolute joint, four of a block in a guide, two of a pin in a slot,
//! one of a stop.

use crate::contact::pair::{ContactLaw, Face, SlidingVelocity, Surfaces};
use crate::scene::parts::{GuideShape, Joint, length_scale};
use crate::tree::elements::{ContactSlot, FramePoint, Guide, Tree};
use crate::tree::kinematics::{Vec2, direction, perp, rotated};
use crate::tree::span::{Builder, Placement};

/// The corners of a block, seen along the axis of its guide: name, side along the axis, side to its left.
const CORNERS: [(&str, f64, f64); 4] = [
    ("front_left", 1.0, 1.0),
    ("front_right", 1.0, -1.0),
    ("rear_left", -1.0, 1.0),
    ("rear_right", -1.0, -1.0),
];
/// The sides of a slot for a pin.
const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];

/// `vector` turned by an angle [rad].
fn turned(vector: Vec2, angle: f64) -> Vec2 {
    let (sine, cosine) = angle.sin_cos();
    rotated(vector, cosine, sine)
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
                    impact_velocity_floor,
                    ..
                } => tree.slots.push(ContactSlot {
                    name: name.clone(),
                    points: self.ends(joint).map(|end| self.place(end)),
                    bodies: self.ends(joint).map(|end| end.body),
                    law: ContactLaw {
                        surfaces: Surfaces::Bearing {
                            journal_radius: *journal_radius,
                            bearing_radius: journal_radius + clearance,
                        },
                        clearance: *clearance,
                        normal: *contact,
                        friction: *friction,
                        sliding: *sliding,
                    },
                    impact_velocity_floor: *impact_velocity_floor,
                }),
                Joint::Guide { .. } => self.add_guide(tree, joint),
            }
        }
    }

    /// Adds a guide with its slots; a stop is a slot alone.
    fn add_guide(&self, tree: &mut Tree, joint: &Joint) {
        let Joint::Guide { name, axis, shape, contact, friction, impact_velocity_floor, .. } = joint else {
            return;
        };
        let ends = self.ends(joint);
        let (points, bodies) = (ends.map(|end| self.place(end)), ends.map(|end| end.body));
        let [first, second] =
            bodies.map(|body| body.and_then(|body| self.placements[body]).unwrap_or(Placement::GROUND));
        let axis = turned(direction(Vec2::from(*axis)), first.angle);
        let (angle, is_sleeve) = match *shape {
            GuideShape::Block { angle, is_sleeve, .. } => (Some(angle), is_sleeve),
            GuideShape::Pin { .. } | GuideShape::Stop { .. } => (None, false),
        };
        // The axis in the frame of the second body, where it does not tilt.
        let on_b = turned(axis, second.angle - first.angle - angle.unwrap_or(0.0));
        let before = tree.slots.len();
        for Touch { place, corner, face, clearance } in touches(shape, axis, on_b, length_scale(self.scene)) {
            let [a, b] = if is_sleeve { [points[1], points[0]] } else { points };
            let [body_a, body_b] = bodies;
            tree.slots.push(ContactSlot {
                name: if place.is_empty() { name.clone() } else { format!("{name}.{place}") },
                points: [a, FramePoint { offset: b.offset + corner, ..b }],
                bodies: if is_sleeve { [body_b, body_a] } else { bodies },
                law: ContactLaw {
                    surfaces: Surfaces::Face(face),
                    clearance,
                    normal: *contact,
                    friction: *friction,
                    sliding: SlidingVelocity::Surface,
                },
                impact_velocity_floor: *impact_velocity_floor,
            });
        }
        if let GuideShape::Stop { .. } = shape {
            return;
        }
        let slots = before..tree.slots.len();
        let sign = if is_sleeve { -1.0 } else { 1.0 };
        tree.guides.push(Guide { name: name.clone(), points, bodies, axis, angle, slots, sign });
    }
}

/// A contact of a guide: its place in it, the vector from the point of its body to the corner, and the face that it may
/// touch.
struct Touch {
    place: &'static str,
    corner: Vec2,
    face: Face,
    clearance: f64,
}

/// The contacts of a guide whose axis is given in the frame of the first body and in that of the second, in a mechanism
/// of a size [m].
fn touches(shape: &GuideShape, axis: Vec2, on_b: Vec2, scene_size: f64) -> Vec<Touch> {
    match *shape {
        GuideShape::Block { length, height, clearance, is_sleeve, .. } => {
            let (half, wide) = (0.5 * height, 0.5 * height + clearance);
            let (face_axis, corner_axis) = if is_sleeve { (on_b, axis) } else { (axis, on_b) };
            let corner_of = |(place, along, left): (&'static str, f64, f64)| {
                // A rod is touched from outside.
                let (reach, limit, into) = if is_sleeve { (wide, -half, -left) } else { (half, wide, left) };
                Touch {
                    place,
                    corner: along * 0.5 * length * corner_axis + left * reach * perp(corner_axis),
                    face: Face { normal: (into * perp(face_axis)).into(), limit, radius: 0.0, size: half },
                    clearance,
                }
            };
            CORNERS.map(corner_of).into()
        }
        GuideShape::Pin { radius, clearance } => {
            let side_of = |(place, left): (&'static str, f64)| {
                let normal = (left * perp(axis)).into();
                let face = Face { normal, limit: clearance, radius, size: radius };
                Touch { place, corner: Vec2::zeros(), face, clearance }
            };
            SIDES.map(side_of).into()
        }
        GuideShape::Stop { radius } => {
            let face = Face { normal: (-axis).into(), limit: -radius, radius, size: scene_size };
            vec![Touch { place: "", corner: Vec2::zeros(), face, clearance: scene_size }]
        }
    }
}
