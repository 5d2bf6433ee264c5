//! The free coordinates of a mechanism in the unknowns of its loops.

use nalgebra::Complex;

use crate::dynamics::Dynamics;
use crate::mechanism::conditions::{Conditions, Pair, Place};
use crate::mechanism::vector_loops::{VectorLoops, Wanted, along, tidy, turned};
use crate::numerics::turns::wrap;
use crate::scene::parts::{Body, Scene, Start};
use crate::tree::kinematics::{FrameKind, Vec2, perp};

/// The free coordinates of a mechanism in the unknowns of its loops.
pub(super) struct Closing {
    pub(super) loops: VectorLoops,
    /// The loops of the guides whose displacement is open: one more unknown each, in their order.
    guided: VectorLoops,
    freedoms: Vec<Freedom>,
    /// Coordinates of the initial guess; displacements are zero.
    guess: Vec<f64>,
    /// Size of the mechanism [m].
    unit: f64,
}

struct Freedom {
    /// The freedom of the nearest body above it that turns freely.
    parent: Option<usize>,
    value: Value,
}

enum Value {
    /// The angle of the body changes with an unknown, if it is not given, and by a constant.
    Turn(Option<usize>, f64),
    Slide(usize),
    /// A displacement that the scene gives.
    Given(f64),
}

impl Closing {
    // Long because each kind of joint in a loop is listed.
    /// The loops of the conditions, of a mechanism whose bodies have the guessed angles.
    pub(super) fn new(
        dynamics: &mut Dynamics,
        scene: &Scene,
        conditions: &Conditions,
        guess: &[f64],
    ) -> Self {
        let tree = dynamics.tree;
        let unit = conditions.unit;
        let d = guess.len();
        let slides = |k: usize| tree.frames[tree.free[k] + 1].kind != FrameKind::Revolute;
        let guess: Vec<f64> = (0..d).map(|k| if slides(k) { 0.0 } else { guess[k] }).collect();
        dynamics.move_to(0.0, &guess, &vec![0.0; d]);
        let (residual, jacobian) = conditions.positions(dynamics);
        let carrier = |frame: usize, below: usize| {
            let mut above = tree.paths[frame].free.iter().map(|&(_, k)| k);
            above.rfind(|&k| !slides(k) && k != below)
        };
        let parents: Vec<Option<usize>> = (0..d).map(|k| carrier(tree.free[k] + 1, k)).collect();
        // By the angle of a body instead of that of a joint: what the bodies hanging on it do not follow.
        let by_angle = |of: &dyn Fn(usize) -> f64, k: usize| {
            let hanging = (0..d).filter(|&other| parents[other] == Some(k) && !slides(other));
            of(k) - hanging.map(of).sum::<f64>()
        };
        let first_coordinate = conditions.first_coordinate();
        let mut ties: Vec<(usize, f64)> = (0..d).map(|k| (k, 0.0)).collect();
        ties.push((d, 0.0));
        let mut given = vec![None; d];
        for (row, one) in conditions.coordinates.iter().filter(|one| one.position.is_some()).enumerate() {
            let row = first_coordinate + row;
            if one.is_angle {
                let moving: Vec<(usize, f64)> = (0..d)
                    .filter(|&k| !slides(k))
                    .map(|k| (k, by_angle(&|k| jacobian[(row, k)], k)))
                    .filter(|(_, by)| *by != 0.0)
                    .collect();
                match moving[..] {
                    [(k, by)] => tie(&mut ties, k, d, -residual[row] / by),
                    [(k, by), (other, _)] => tie(&mut ties, k, other, -residual[row] / by),
                    _ => {}
                }
            } else if let Some(k) = (0..d).find(|&k| slides(k) && jacobian[(row, k)] != 0.0) {
                given[k] = Some(-residual[row] / jacobian[(row, k)]);
            }
        }
        let roots: Vec<usize> = (0..d).filter(|&k| !slides(k) && ties[k].0 == k).collect();
        let sliding: Vec<usize> = (0..d).filter(|&k| slides(k) && given[k].is_none()).collect();
        let turn = |k: usize| (roots.iter().position(|&root| root == ties[k].0), ties[k].1);
        // A guide leaves the displacement along its axis open, where the start does not give it.
        let open: Vec<usize> = (0..conditions.pairs.len())
            .filter(|&pair| matches!(conditions.pairs[pair].place, Place::Guided { along: [None, _], .. }))
            .collect();
        let turns_with = |pair: usize| {
            let frame = conditions.pairs[pair].points[0].frame;
            carrier(frame, usize::MAX).map_or((None, 0.0), &turn)
        };
        let carriers = sliding.iter().map(|&k| parents[k].and_then(|parent| turn(parent).0));
        let mut loops = VectorLoops {
            wanted: wanted(dynamics, scene, &carrier, &turn, roots.len()),
            carriers: carriers.chain(open.iter().map(|&pair| turns_with(pair).0)).collect(),
            ..VectorLoops::default()
        };
        for (pair, Pair { points, place, .. }) in conditions.pairs.iter().enumerate() {
            let (vector, columns) = conditions.vector(dynamics, pair);
            let complex = |vector: Vec2| Complex::new(vector.x, vector.y);
            let mut constant = complex(vector);
            let mut links = vec![Complex::new(0.0, 0.0); roots.len()];
            let mut axes = vec![Complex::new(0.0, 0.0); loops.carriers.len()];
            for k in 0..d {
                if slides(k) {
                    let (carrier, offset) = parents[k].map_or((None, 0.0), &turn);
                    let axis = complex(columns[k]) * turned(offset);
                    match (given[k], sliding.iter().position(|&other| other == k), carrier) {
                        (Some(value), _, None) => constant += axis * value,
                        (Some(value), _, Some(turn)) => links[turn] += axis * value,
                        (None, Some(slide), _) => axes[slide] = axis,
                        (None, None, _) => {}
                    }
                } else {
                    let (turn, offset) = turn(k);
                    // The derivative of a vector that turns is the vector times i.
                    let [x, y] = [0, 1].map(|axis| by_angle(&|k| columns[k][axis], k));
                    let link = Complex::new(x, y) / Complex::i();
                    constant -= link;
                    match turn {
                        None => constant += link * turned(offset),
                        Some(turn) => links[turn] += link * turned(offset),
                    }
                }
            }
            if let Place::Guided { axis, across, along: known } = place {
                let (turn, offset) = turns_with(pair);
                let axis = dynamics.frame(points[0].frame).to_world(*axis);
                let away = across[0] * perp(axis) + known[0].unwrap_or(0.0) * axis;
                let away = -complex(away) / unit * turned(offset);
                match turn {
                    None => constant += away,
                    Some(turn) => links[turn] += away,
                }
                if let Some(place) = open.iter().position(|&other| other == pair) {
                    axes[sliding.len() + place] = -complex(axis) * turned(offset);
                }
            }
            loops.constants.push(constant);
            loops.links.push(links.into_iter().map(tidy).collect());
            loops.axes.push(axes);
        }
        let guided = loops.only(&open);
        loops.shorten();
        let freedoms = (0..d).map(|k| Freedom {
            parent: parents[k],
            value: match (given[k], sliding.iter().position(|&other| other == k)) {
                (Some(value), _) => Value::Given(value),
                (None, Some(slide)) => Value::Slide(slide),
                (None, None) => Value::Turn(turn(k).0, turn(k).1),
            },
        });
        Self { freedoms: freedoms.collect(), loops, guided, guess, unit }
    }

    /// The unknowns of coordinates.
    pub(super) fn unknowns(&self, q: &[f64]) -> Vec<f64> {
        let turns = self.loops.wanted.len();
        let mut unknowns = vec![0.0; turns + self.loops.carriers.len()];
        let mut changes = vec![0.0; q.len()];
        // Parents stand before their children.
        for (k, freedom) in self.freedoms.iter().enumerate() {
            match freedom.value {
                Value::Turn(turn, offset) => {
                    changes[k] = q[k] - self.guess[k] + freedom.parent.map_or(0.0, |parent| changes[parent]);
                    if let Some(turn) = turn {
                        unknowns[turn] = changes[k] - offset;
                    }
                }
                Value::Slide(slide) => unknowns[turns + slide] = q[k] / self.unit,
                Value::Given(_) => {}
            }
        }
        let first = unknowns.len() - self.guided.constants.len();
        for one in 0..self.guided.constants.len() {
            let known = vec![true; unknowns.len()];
            let axis = self.guided.axis(one, first - turns + one, &unknowns);
            unknowns[first + one] = -along(self.guided.rest(one, &unknowns, &known), axis);
        }
        unknowns
    }

    /// The coordinates that unknowns give.
    pub(super) fn coordinates(&self, unknowns: &[f64]) -> Vec<f64> {
        let change = |k: usize| match self.freedoms[k].value {
            Value::Turn(turn, offset) => offset + turn.map_or(0.0, |turn| unknowns[turn]),
            Value::Slide(_) | Value::Given(_) => 0.0,
        };
        let coordinate = |(k, freedom): (usize, &Freedom)| match freedom.value {
            Value::Turn(..) => self.guess[k] + change(k) - freedom.parent.map_or(0.0, change),
            Value::Slide(slide) => unknowns[self.loops.wanted.len() + slide] * self.unit,
            Value::Given(value) => value * self.unit,
        };
        self.freedoms.iter().enumerate().map(coordinate).collect()
    }
}

/// Notes that the angle `one` changes by `apart` more than the angle `other`.
fn tie(ties: &mut [(usize, f64)], one: usize, other: usize, apart: f64) {
    let (mut from, mut to) = (ties[one], ties[other]);
    let mut apart = apart;
    if from.0 == ties.len() - 1 {
        (from, to, apart) = (to, from, -apart);
    }
    if from.0 == to.0 {
        return;
    }
    let by = to.1 + apart - from.1;
    for (root, offset) in ties.iter_mut().filter(|(root, _)| *root == from.0) {
        (*root, *offset) = (to.0, *offset + by);
    }
}

/// The changes that the given angles of the bodies ask of each unknown.
fn wanted(
    dynamics: &Dynamics,
    scene: &Scene,
    carrier: &dyn Fn(usize, usize) -> Option<usize>,
    turn: &dyn Fn(usize) -> (Option<usize>, f64),
    turns: usize,
) -> Vec<Wanted> {
    let mut asked = vec![Vec::new(); turns];
    for (placed, body) in dynamics.tree.bodies.iter().zip(&scene.bodies) {
        if let Some((Some(turn), offset)) = carrier(placed.frame, usize::MAX).map(turn) {
            let angle = dynamics.frame(placed.frame).angle + placed.angle;
            asked[turn].push(wrap(given_angle(scene, body) - angle).0 - offset);
        }
    }
    asked.into_iter().map(Wanted::new).collect()
}

/// The angle of a body that its start gives, or its initial guess [rad].
pub(super) fn given_angle(scene: &Scene, body: &Body) -> f64 {
    let given = scene.start.iter().find_map(|start| match start {
        Start::Body { body: name, angle, .. } if *name == body.name => *angle,
        _ => None,
    });
    given.unwrap_or(body.angle)
}
