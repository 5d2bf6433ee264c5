//! Contact slots: relative motion of the two surfaces, and the contact forces.

use super::Dynamics;
use super::reactions::{PairForce, Wrench};
use crate::contact::face::Face;
use crate::contact::pair::{ContactState, Phase, RelativeMotion, Surfaces};
use crate::contact::sticking::Traction;
use crate::numerics::turns::with_turns;
use crate::tree::elements::{Backlash, ContactSlot, FramePoint, Guide, Neighbor};
use crate::tree::kinematics::{PointState, Vec2, perp, rotated};

/// Second point of a slot seen from the first: in a bearing in the axes of the world, at a face from the first body, in
/// its axes; at a flank along the pitch line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlotMotion {
    /// Vector e from the first point to the second [m].
    pub eccentricity: Vec2,
    /// ė [m/s].
    pub rate: Vec2,
    /// ë [m/s²].
    pub acceleration: Vec2,
    /// Rolling velocity [m/s], see [`RelativeMotion`].
    pub spin: f64,
}

/// The contact of a slot in a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlotContact {
    /// Relative motion of the two surfaces.
    pub motion: RelativeMotion<f64>,
    /// Penetration, velocities and forces.
    pub state: ContactState<f64>,
}

/// Place of what slides in a guide, seen from the body that has the faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideMotion {
    /// Displacement along the axis [m].
    pub displacement: f64,
    /// Its rate [m/s].
    pub velocity: f64,
    /// Distance from the axis, to its left [m].
    pub offset: f64,
}

impl SlotContact {
    /// The value before the first evaluation.
    pub(super) const UNKNOWN: SlotContact = SlotContact {
        motion: RelativeMotion {
            eccentricity: [f64::NAN; 2],
            rate: [f64::NAN; 2],
            spin: f64::NAN,
            roll: f64::NAN,
        },
        state: ContactState {
            penetration: f64::NAN,
            penetration_rate: f64::NAN,
            sliding_velocity: f64::NAN,
            normal_force: f64::NAN,
            friction_force: f64::NAN,
            force: [f64::NAN; 2],
        },
    };
}

impl Dynamics<'_> {
    /// The two points of a slot, after [`Dynamics::move_to`].
    #[inline(always)]
    pub fn slot_ends(&self, slot: &ContactSlot) -> [PointState; 2] {
        // Written out, since `map` is not inlined here.
        let [a, b] = slot.points;
        [self.point(a), self.point(b)]
    }

    /// Relative motion in a slot after [`Dynamics::move_to`].
    #[inline(always)]
    pub fn slot_motion(&self, slot: &ContactSlot) -> SlotMotion {
        match slot.law.surfaces {
            Surfaces::Bearing { .. } => {
                let [a, b] = self.slot_ends(slot);
                SlotMotion {
                    eccentricity: b.position - a.position,
                    rate: b.velocity - a.velocity,
                    acceleration: b.acceleration - a.acceleration,
                    spin: self.spin(slot),
                }
            }
            Surfaces::Face(_) | Surfaces::Worn(_) => self.motion_seen_from_first(slot),
        }
    }

    /// The same without accelerations, as the contact law needs it.
    #[inline(always)]
    pub(super) fn contact_motion(&self, slot: &ContactSlot) -> RelativeMotion<f64> {
        match slot.law.surfaces {
            Surfaces::Bearing { .. } => self.motion_in_bearing(slot, &self.slot_ends(slot)),
            Surfaces::Face(_) | Surfaces::Worn(_) => relative_motion(&self.motion_seen_from_first(slot)),
        }
    }

    #[inline(always)]
    fn motion_in_bearing(&self, slot: &ContactSlot, [a, b]: &[PointState; 2]) -> RelativeMotion<f64> {
        RelativeMotion {
            eccentricity: (b.position - a.position).into(),
            rate: (b.velocity - a.velocity).into(),
            spin: self.spin(slot),
            roll: 0.0,
        }
    }

    /// The coupling with backlash of which a slot is a flank.
    pub(super) fn backlash_of(&self, slot: &ContactSlot) -> Option<&Backlash> {
        slot.backlash.map(|index| &self.tree.backlashes[index])
    }

    /// Relative motion at a face or in a worn bearing.
    #[inline(never)]
    fn motion_seen_from_first(&self, slot: &ContactSlot) -> SlotMotion {
        if let Some(backlash) = self.backlash_of(slot) {
            return self.motion_of_flank(backlash);
        }
        let [a, b] = self.slot_ends(slot);
        let frame = &self.states[slot.points[0].frame];
        let turning = frame.angular_velocity;
        let e = b.position - a.position;
        let rate = b.velocity - a.velocity - turning * perp(e);
        // Less what a point at rest in the turning body has, and Coriolis's part.
        let acceleration = b.acceleration - a.acceleration - frame.angular_acceleration * perp(e)
            + turning * turning * e
            - 2.0 * turning * perp(rate);
        let [eccentricity, rate, acceleration] =
            [e, rate, acceleration].map(|vector| rotated(vector, frame.cosine, -frame.sine));
        SlotMotion { eccentricity, rate, acceleration, spin: self.spin(slot) }
    }

    #[inline(always)]
    fn spin(&self, slot: &ContactSlot) -> f64 {
        let [radius_a, radius_b] = slot.law.radii();
        self.states[slot.points[1].frame].angular_velocity * radius_b
            - self.states[slot.points[0].frame].angular_velocity * radius_a
    }

    /// Angles of the frames of the two bodies [rad] from full turns on.
    fn angles_from(&self, slot: &ContactSlot, turns: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|end| {
            let frame = slot.points[end].frame;
            with_turns(self.states[frame].angle, self.frame_turns(frame) - turns[end])
        })
    }

    /// A relative motion with the rolling velocity and the roll of a contact that can stick, in its phase.
    pub(super) fn rolled(
        &self,
        slot: &ContactSlot,
        phase: Phase,
        motion: RelativeMotion<f64>,
    ) -> RelativeMotion<f64> {
        let Phase::Contact { traction: Some(traction), .. } = phase else { return motion };
        let turning = slot.points.map(|point| self.states[point.frame].angular_velocity);
        if traction.sticks() {
            let spin = slot.law.rolling(traction.arm, turning);
            let roll = slot.law.rolling(traction.arm, self.angles_from(slot, traction.turns));
            return RelativeMotion { spin, roll, ..motion };
        }
        let [x, y] = motion.eccentricity;
        RelativeMotion { spin: slot.law.rolling((x * x + y * y).sqrt(), turning), ..motion }
    }

    /// A vector in the axes of the relative motion of a slot, in the world frame.
    #[inline(always)]
    pub fn slot_to_world(&self, slot: &ContactSlot, vector: Vec2) -> Vec2 {
        match slot.law.surfaces {
            Surfaces::Bearing { .. } => vector,
            Surfaces::Face(_) | Surfaces::Worn(_) => match self.backlash_of(slot) {
                Some(Backlash { mesh, .. }) => {
                    self.states[mesh.pitch_point.frame].to_world(vector.x * mesh.tangent)
                }
                None => self.states[slot.points[0].frame].to_world(vector),
            },
        }
    }

    /// The force of a contact as it acts on the two bodies: that of a bearing at the two centers, that of a face on both
    /// where the surfaces touch, so that it makes no moment of its own.
    #[inline(always)]
    pub(super) fn pair_force(&self, slot: &ContactSlot, state: &ContactState<f64>) -> PairForce {
        match slot.law.surfaces {
            Surfaces::Bearing { bearing_radius, journal_radius } => {
                let positions = slot.points.map(|point| self.point(point).position);
                let force = Vec2::from(state.force);
                let on_journal = journal_radius * state.friction_force;
                let on_bearing = match slot.law.stick_slip() {
                    // No moment of its own, see `ContactLaw::rolling`.
                    Some(_) => on_journal + (positions[1] - positions[0]).perp(&force),
                    None => bearing_radius * state.friction_force,
                };
                PairForce { positions, force, moments: [on_bearing, on_journal] }
            }
            // Both forces at the center of the journal, with the moment of the friction that acts around it.
            Surfaces::Worn(_) => PairForce {
                positions: [self.point(slot.points[1]).position; 2],
                force: self.slot_to_world(slot, state.force.into()),
                moments: [slot.law.size() * state.friction_force; 2],
            },
            Surfaces::Face(face) => {
                if let Some(backlash) = self.backlash_of(slot) {
                    return self.tooth_force(&backlash.mesh, state.force[0]);
                }
                let touching =
                    self.point(slot.points[1]).position + face.radius * self.normal_at(slot, &face);
                let force = self.slot_to_world(slot, state.force.into());
                PairForce { positions: [touching; 2], force, moments: [0.0; 2] }
            }
        }
    }

    /// The points of the two bodies that touch, or would touch, in a slot: between them the effective mass is asked for.
    pub fn touching_points(&self, slot: &ContactSlot) -> [FramePoint; 2] {
        let [a, b] = slot.points;
        match slot.law.surfaces {
            Surfaces::Bearing { .. } | Surfaces::Worn(_) => [a, b],
            Surfaces::Face(face) => {
                if let Some(backlash) = self.backlash_of(slot) {
                    return self.flank_points(slot, &backlash.mesh);
                }
                let place = self.point(b).position + face.radius * self.normal_at(slot, &face);
                [a, b].map(|point| self.at_place(point, place))
            }
        }
    }

    /// The point of the frame of another one at a place in the world.
    pub(super) fn at_place(&self, point: FramePoint, place: Vec2) -> FramePoint {
        let frame = &self.states[point.frame];
        FramePoint { frame: point.frame, offset: rotated(place - frame.position, frame.cosine, -frame.sine) }
    }

    /// Unit vector in the world frame along which the surfaces of a slot approach, after [`Dynamics::move_to`]; NaN in a
    /// concentric joint.
    pub fn slot_normal(&self, slot: &ContactSlot) -> Vec2 {
        match &slot.law.surfaces {
            Surfaces::Worn(worn) => {
                self.slot_to_world(slot, worn.normal(self.contact_motion(slot).eccentricity).into())
            }
            Surfaces::Bearing { .. } => Vec2::from(self.contact_motion(slot).eccentricity).normalize(),
            Surfaces::Face(face) => self.normal_at(slot, face),
        }
    }

    /// The same at a face.
    fn normal_at(&self, slot: &ContactSlot, face: &Face) -> Vec2 {
        let normal = if face.half_length.is_finite() {
            face.normal_at(self.contact_motion(slot).eccentricity)
        } else {
            face.normal
        };
        self.slot_to_world(slot, normal.into())
    }

    /// How far a corner is from the two ends of its face, with the rates: from that where its neighbor takes over [m],
    /// and from the other one; both are positive over the face. After [`Dynamics::move_to`].
    ///
    /// The neighbor takes over where the two corners lie on the bisector of their faces: there both penetrate alike, so
    /// that no energy is made or lost.
    pub fn ends_ahead(&self, slot: &ContactSlot, face: &Face, neighbor: &Neighbor) -> [[f64; 2]; 2] {
        let other = &self.tree.slots[neighbor.slot];
        let tangent_of = |slot: &ContactSlot, normal: [f64; 2]| {
            let tangent = perp(self.slot_to_world(slot, normal.into()));
            (tangent, self.states[slot.points[0].frame].angular_velocity * perp(tangent))
        };
        let (own, own_rate) = tangent_of(slot, face.normal);
        let (others, others_rate) = tangent_of(other, neighbor.normal);
        let [from, to] = [slot, other].map(|slot| self.point(slot.points[1]));
        let (apart, rate) = (to.position - from.position, to.velocity - from.velocity);
        let (along, along_rate) = (own - others, own_rate - others_rate);
        let (side, motion) = (neighbor.side, self.motion_seen_from_first(slot));
        let on_face = perp(Vec2::from(face.normal));
        [
            [0.5 * side * apart.dot(&along), 0.5 * side * (rate.dot(&along) + apart.dot(&along_rate))],
            [face.half_length + side * on_face.dot(&motion.eccentricity), side * on_face.dot(&motion.rate)],
        ]
    }

    /// Evaluates the contact of every slot, once for all outputs, after [`Dynamics::move_to`].
    pub fn find_contacts(&mut self) {
        for (index, slot) in self.tree.slots.iter().enumerate() {
            self.contacts[index] = self.contact_of(slot, self.phases[index]);
        }
    }

    /// The contact of a slot in a phase, after [`Dynamics::move_to`].
    #[inline(always)]
    pub fn contact_of(&self, slot: &ContactSlot, phase: Phase) -> SlotContact {
        match slot.law.surfaces {
            _ if slot.is_aside => self.contact_aside(slot, phase),
            Surfaces::Bearing { .. } => {
                let motion = self.motion_in_bearing(slot, &self.slot_ends(slot));
                SlotContact { motion, state: slot.law.in_bearing::<f64, true, false>(&motion, phase) }
            }
            Surfaces::Face(_) | Surfaces::Worn(_) => self.contact_seen_from_first(slot, phase),
        }
    }

    #[inline(never)]
    fn contact_seen_from_first(&self, slot: &ContactSlot, phase: Phase) -> SlotContact {
        let motion = relative_motion(&self.motion_seen_from_first(slot));
        SlotContact { motion, state: slot.law.without_sticking(&motion, phase) }
    }

    #[inline(never)]
    fn contact_aside(&self, slot: &ContactSlot, phase: Phase) -> SlotContact {
        let motion = self.rolled(slot, phase, self.contact_motion(slot));
        SlotContact { motion, state: slot.law.evaluate(&motion, phase) }
    }

    /// The contact of a slot, after [`Dynamics::find_contacts`].
    pub fn contact(&self, index: usize) -> &SlotContact {
        &self.contacts[index]
    }

    /// State of the contact of one slot, after [`Dynamics::move_to`].
    pub fn contact_state(&self, index: usize) -> ContactState<f64> {
        self.contact_of(&self.tree.slots[index], self.phases[index]).state
    }

    /// The same without its forces, for those who ask only how the surfaces move, with the ends of the slot.
    #[inline(always)]
    pub fn contact_without_forces(
        &self,
        slot: &ContactSlot,
        ends: &[PointState; 2],
        is_beyond: bool,
    ) -> ContactState<f64> {
        match slot.law.surfaces {
            Surfaces::Bearing { .. } => {
                slot.law.in_bearing_without_forces(&self.motion_in_bearing(slot, ends))
            }
            Surfaces::Face(_) | Surfaces::Worn(_) => {
                let unloaded = if is_beyond { Phase::Beyond } else { Phase::Free };
                self.contact_seen_from_first(slot, unloaded).state
            }
        }
    }

    /// The traction of a contact whose spring exerts a force [N] on the second body and sticks from now on, after
    /// [`Dynamics::move_to`].
    pub fn anchored(&self, slot: &ContactSlot, force: f64, traction: Traction) -> Traction {
        let motion = self.contact_motion(slot);
        let turns = slot.points.map(|point| self.frame_turns(point.frame));
        let arm = match slot.law.surfaces {
            Surfaces::Bearing { .. } => Vec2::from(motion.eccentricity).norm(),
            Surfaces::Face(_) | Surfaces::Worn(_) => 0.0,
        };
        let unloaded = Traction { direction: 0.0, anchor: 0.0, arm, turns, ..traction };
        let roll = slot.law.rolling(arm, self.angles_from(slot, turns));
        let slip_distance = slot.law.slip_distance(&RelativeMotion { roll, ..motion }, arm);
        Traction { anchor: slip_distance + force / traction.stiffness, ..unloaded }
    }

    /// Velocity u̇ + Ḟ_t / k of the slider of a contact that slides [m/s], after [`Dynamics::accelerate`]: the sliding
    /// velocity less the rate at which the spring stretches.
    pub fn slider_velocity(&self, slot: &ContactSlot, phase: Phase, traction: &Traction) -> f64 {
        let state = self.contact_in_time(slot, phase);
        state.sliding_velocity.value + state.friction_force.gradient[0] / traction.stiffness
    }

    /// The points of the two surfaces that touch in a slot, where the roll of both counts.
    pub fn surface_points(&self, slot: &ContactSlot) -> [FramePoint; 2] {
        let place = match slot.law.surfaces {
            Surfaces::Bearing { journal_radius, .. } => {
                self.point(slot.points[1]).position + journal_radius * self.slot_normal(slot)
            }
            Surfaces::Face(_) | Surfaces::Worn(_) => return self.touching_points(slot),
        };
        slot.points.map(|point| self.at_place(point, place))
    }

    /// Where something slides in a guide, after [`Dynamics::move_to`].
    pub fn guide_motion(&self, guide: &Guide) -> GuideMotion {
        let [a, b] = guide.points.map(|point| self.point(point));
        let frame = &self.states[guide.points[0].frame];
        let axis = frame.to_world(guide.axis);
        let e = b.position - a.position;
        let rate = b.velocity - a.velocity - frame.angular_velocity * perp(e);
        GuideMotion { displacement: axis.dot(&e), velocity: axis.dot(&rate), offset: perp(axis).dot(&e) }
    }

    /// The forces of all contacts of a guide on its second body, with their moment about its point; after
    /// [`Dynamics::find_contacts`].
    pub fn guide_reaction(&self, guide: &Guide) -> Wrench {
        let center = self.point(guide.points[1]).position;
        let mut sum = Wrench::default();
        for index in guide.slots.clone() {
            let slot = &self.tree.slots[index];
            let PairForce { positions, force, .. } = self.pair_force(slot, &self.contacts[index].state);
            let sign = if slot.bodies == guide.bodies { 1.0 } else { -1.0 };
            sum.force += sign * force;
            sum.moment += sign * (positions[1] - center).perp(&force);
        }
        sum
    }

    /// Adds the generalized force of a contact, which it returns.
    // Inlined for the reason given at `add_pair`.
    #[inline(always)]
    pub(super) fn add_contact(&self, slot: &ContactSlot, phase: &Phase, forces: &mut [f64]) -> SlotContact {
        let Surfaces::Bearing { bearing_radius, journal_radius } = slot.law.surfaces else {
            return self.add_contact_aside(slot, phase, forces);
        };
        if slot.is_aside {
            return self.add_contact_aside(slot, phase, forces);
        }
        self.add_bearing::<false>(slot, [bearing_radius, journal_radius], phase, forces)
    }

    /// The same in a bearing, with or without formulas, of a law that does not stick.
    #[inline(always)]
    fn add_bearing<const FORMULA: bool>(
        &self,
        slot: &ContactSlot,
        radii: [f64; 2],
        phase: &Phase,
        forces: &mut [f64],
    ) -> SlotContact {
        let ends = self.slot_ends(slot);
        let motion = self.motion_in_bearing(slot, &ends);
        let state = slot.law.in_bearing::<f64, true, FORMULA>(&motion, *phase);
        let moments = [radii[0] * state.friction_force, radii[1] * state.friction_force];
        let positions = [ends[0].position, ends[1].position];
        self.add_pair(slot.points, positions, state.force.into(), moments, forces);
        SlotContact { motion, state }
    }

    /// The same of less common kinds.
    #[inline(never)]
    fn add_contact_aside(&self, slot: &ContactSlot, phase: &Phase, forces: &mut [f64]) -> SlotContact {
        if let (&Surfaces::Bearing { bearing_radius, journal_radius }, None) =
            (&slot.law.surfaces, slot.law.stick_slip())
        {
            return self.add_bearing::<true>(slot, [bearing_radius, journal_radius], phase, forces);
        }
        let contact = self.contact_of(slot, *phase);
        if let Some(backlash) = self.backlash_of(slot) {
            self.add_flank(backlash, &contact.state, forces);
            return contact;
        }
        let PairForce { positions, force, moments } = self.pair_force(slot, &contact.state);
        self.add_pair(slot.points, positions, force, moments, forces);
        contact
    }

    /// The first contact whose normal force, together with the friction it causes, accelerates the surfaces
    /// toward each other: Painlevé's paradox. The friction coefficient is that of the present sliding
    /// velocity.
    pub fn paradoxical_contact(&mut self, t: f64, q: &[f64], v: &[f64]) -> Option<usize> {
        let phases = self.phases.clone();
        let mut a = vec![0.0; q.len()];
        let found = (0..phases.len()).find(|&index| {
            let tree = self.tree;
            let slot = &tree.slots[index];
            if slot.law.friction.is_none() {
                return false;
            }
            // Accelerations are linear in the normal force: two values suffice, zero and that of the law, which may pull.
            let mut response = |clipped| {
                self.phases[index] = match phases[index] {
                    Phase::Contact { latch, traction, .. } => Phase::Contact { latch, clipped, traction },
                    Phase::Free | Phase::Beyond => return [f64::NAN; 2],
                };
                if !self.acceleration(t, q, v, &mut a) {
                    return [f64::NAN; 2];
                }
                self.accelerate(&a);
                let force = self.contact_state(index).normal_force;
                let SlotMotion { eccentricity, acceleration, .. } = self.slot_motion(slot);
                let normal = match &slot.law.surfaces {
                    Surfaces::Bearing { .. } => eccentricity.normalize(),
                    Surfaces::Worn(worn) => Vec2::from(worn.normal(eccentricity.into())),
                    Surfaces::Face(face) => Vec2::from(face.normal_at(eccentricity.into())),
                };
                [acceleration.dot(&normal), force]
            };
            let ([without, _], [with, force]) = (response(true), response(false));
            self.phases[index] = phases[index];
            (with - without) * force > 0.0
        });
        self.phases = phases;
        found
    }
}

/// The motion without accelerations, as the contact law needs it.
pub fn relative_motion(motion: &SlotMotion) -> RelativeMotion<f64> {
    RelativeMotion {
        eccentricity: motion.eccentricity.into(),
        rate: motion.rate.into(),
        spin: motion.spin,
        roll: 0.0,
    }
}
