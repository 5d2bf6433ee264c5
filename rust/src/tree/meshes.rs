//! Teeth: where the wheels of a coupling touch, and which joints hold them there.

use crate::numerics::accuracy::EQUAL;
use crate::tree::elements::{CoupledCoordinate, Coupling, FramePoint, IdealKind, Mesh, Realization, Tree};
use crate::tree::kinematics::{FrameKind, Vec2, perp};

/// The center of a wheel on the frame that holds it, and the closures on the way there, with the factor of a force on the
/// wheel in theirs.
struct Axle {
    center: Vec2,
    cut: Vec<(usize, f64)>,
}

impl Tree {
    /// The teeth of a coupling by a ratio in a mechanism of a size [m].
    ///
    /// # Errors
    /// Why there is no pitch point at rest on one body.
    pub(super) fn mesh(&self, coupling: &Coupling, pressure_angle: f64, size: f64) -> Result<Mesh, String> {
        match (coupling.driver.slide, coupling.driven.slide) {
            (None, None) => self.mesh_of_wheels(coupling, pressure_angle, EQUAL * size),
            (None, Some(slide)) => self.mesh_of_rack(coupling, slide, pressure_angle, EQUAL * size),
            (Some(slide), None) => self.mesh_of_rack(coupling, slide, pressure_angle, EQUAL * size),
            (Some(_), Some(_)) => Err("must be left out: two displacements have no teeth".to_owned()),
        }
    }

    fn mesh_of_wheels(&self, coupling: &Coupling, pressure_angle: f64, near: f64) -> Result<Mesh, String> {
        let Coupling { driven, driver, ratio, .. } = coupling;
        let ends = [driver, driven];
        let [carrier, other] = ends.map(|end| self.frame_of(end.bodies[0]));
        if carrier != other {
            return Err(
                "needs two angles against the same body, which holds both wheels: those of bodies, with \
                        carrier= if it turns"
                    .to_owned(),
            );
        }
        let [first, second] = ends.map(|end| self.axle(end, carrier, near));
        let (first, second) = (first?, second?);
        let (a, b) = (first.center, second.center);
        if (b - a).norm() <= near || (ratio - 1.0).abs() <= EQUAL {
            return Err("needs two wheels with different centers, and a ratio other than 1".to_owned());
        }
        // Both wheels move alike there.
        let pitch_point = (*ratio * b - a) / (ratio - 1.0);
        let arm = pitch_point - b;
        let radius = arm.norm();
        let radial = arm / radius;
        // Teeth are pushed towards the center of their wheel, but those of a ring outwards.
        let outward = if *ratio > 0.0 && *ratio < 1.0 { 1.0 } else { -1.0 };
        // The force on the driver is that on the driven wheel, reversed.
        let of_driver = first.cut.into_iter().map(|(closure, factor)| (closure, -factor));
        let cut = of_driver.chain(second.cut).collect();
        Ok(Mesh {
            pitch_point: FramePoint { frame: carrier, offset: pitch_point },
            bodies: [driver.bodies[1], driven.bodies[1]],
            radius: radius.min((pitch_point - a).norm()),
            lever: radius,
            tangent: perp(radial),
            separating: outward * pressure_angle.tan() * radial,
            cut,
        })
    }

    /// The same of a rack, which slides in a joint, and its pinion, which turns on the other body of this joint.
    fn mesh_of_rack(
        &self,
        coupling: &Coupling,
        slide: usize,
        pressure_angle: f64,
        near: f64,
    ) -> Result<Mesh, String> {
        let Coupling { driven, driver, ratio, .. } = coupling;
        let rack_is_driven = driven.slide.is_some();
        let pinion = if rack_is_driven { driver } else { driven };
        let joint = &self.ideal_joints[slide];
        let frames = joint.bodies.map(|body| self.frame_of(body));
        let Realization::Tree { column: Some(column), sign, .. } = joint.realization else {
            return Err(NO_AXLE.to_owned());
        };
        let FrameKind::Prismatic { axis } = self.frames[column + 1].kind else {
            return Err(NO_AXLE.to_owned());
        };
        if !frames.contains(&self.frame_of(pinion.bodies[0])) {
            return Err("needs the angle of the pinion against the guide of the rack".to_owned());
        }
        let held = |end: usize| self.axle(pinion, frames[end], near).map(|axle| (end, axle));
        let (end, axle) = held(0).or_else(|_| held(1))?;
        let rack = joint.bodies[1 - end];
        // How the rack moves against the body that holds the pinion, per unit of the displacement and per angle.
        let along = sign * axis * if end == 0 { 1.0 } else { -1.0 };
        let arm = -perp(along) * if rack_is_driven { *ratio } else { 1.0 / ratio };
        let radius = arm.norm();
        let (bodies, lever, tangent, outward) = if rack_is_driven {
            ([pinion.bodies[1], rack], 1.0, along, 1.0)
        } else {
            ([rack, pinion.bodies[1]], radius, perp(arm) / radius, -1.0)
        };
        let mut mesh = Mesh {
            pitch_point: FramePoint { frame: frames[end], offset: axle.center + arm },
            bodies,
            radius,
            lever,
            tangent,
            separating: outward * pressure_angle.tan() * arm / radius,
            cut: axle.cut,
        };
        if rack_is_driven {
            mesh.cut.iter_mut().for_each(|(_, factor)| *factor = -*factor);
        }
        Ok(mesh)
    }

    fn frame_of(&self, body: Option<usize>) -> usize {
        body.map_or(0, |body| self.bodies[body].frame)
    }

    /// Where revolute joints hold a wheel to a frame: directly, or to bodies in between by the same point of each.
    fn axle(&self, wheel: &CoupledCoordinate, carrier: usize, near: f64) -> Result<Axle, String> {
        let wheel = self.frame_of(wheel.bodies[1]);
        // Points that coincide with the center, and the joints on the way there, each with the end that was passed first.
        let mut open: Vec<(FramePoint, Vec<(usize, usize)>)> = Vec::new();
        let revolutes = || {
            let joints = self.ideal_joints.iter().enumerate();
            let revolutes = joints.filter(|(_, joint)| joint.kind == IdealKind::Revolute);
            revolutes.flat_map(|(index, joint)| [0, 1].map(|end| (index, end, joint.points)))
        };
        for (index, end, points) in revolutes().filter(|(_, end, points)| points[*end].frame == wheel) {
            open.push((points[1 - end], vec![(index, end)]));
        }
        while let Some((at, way)) = open.pop() {
            if at.frame == carrier {
                let cut = way.iter().filter_map(|&(index, end)| match self.ideal_joints[index].realization {
                    // A closure exerts its force on its second point.
                    Realization::Cut(closure) => Some((closure, if end == 1 { -1.0 } else { 1.0 })),
                    Realization::Tree { .. } => None,
                });
                return Ok(Axle { center: at.offset, cut: cut.collect() });
            }
            for (index, end, points) in revolutes() {
                let meets = points[end].frame == at.frame && (points[end].offset - at.offset).norm() <= near;
                if meets && way.iter().all(|(passed, _)| *passed != index) {
                    open.push((points[1 - end], [&way[..], &[(index, end)]].concat()));
                }
            }
        }
        Err(NO_AXLE.to_owned())
    }
}

const NO_AXLE: &str = "needs wheels whose centers keep their distance: revolute joints must hold both to the body against \
                       which their angles count (a joint with clearance lets them move; leave it out then, and torques act \
                       alone)";
