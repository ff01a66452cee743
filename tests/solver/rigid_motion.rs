//! A rotated and translated body has the rotated and translated motion: springs from Young's modulus, finite elements,
//! and every term.
//! Rest shapes stay in place; only starting positions, gravity and tools are rotated and translated. The reference body
//! starts at the moved body's rounded positions, transformed back, so that rounding of the start does not count.

use crate::support::bodies::{FREE, Random, largest_difference};
use glam::{DQuat, DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    Body, BodyDefinition, BodyId, Material, Model, Pose, Shape, Solver, SpringLaw, ToolDefinition, ToolId, Values,
    World, WorldDefinition,
};

/// The allowed difference of both motions, relative to the body's size. VERLET is off by up to 6e-7, NEWTON by 9e-8.
/// IMPLICIT does not solve again for the residual that rounded coordinates cause; where one of the bodies solves one
/// equation more they differ by up to 4.4e-6.
const SAME: [(Solver, f64); 3] = [(Solver::Verlet, 1e-6), (Solver::Implicit, 1e-5), (Solver::Newton, 1e-6)];
/// m
const SPACING: f32 = 0.0125;
const DOWN: Vec3 = Vec3::new(1.0, -4.0, 2.0);
const RADIUS: f32 = 0.02;

/// A rotation, then a translation.
#[derive(Clone, Copy, Debug)]
struct Motion {
    turn: DQuat,
    offset: DVec3,
}

impl Motion {
    const NONE: Self = Self {
        turn: DQuat::IDENTITY,
        offset: DVec3::ZERO,
    };

    fn of(&self, position: DVec3) -> DVec3 {
        self.turn * position + self.offset
    }

    fn back(&self, position: DVec3) -> DVec3 {
        self.turn.inverse() * (position - self.offset)
    }

    /// Returns the rounding error of a coordinate of the moved body, for each axis (m).
    fn rounding(&self, size: f64) -> f64 {
        let farthest = (self.offset.length() + size) as f32;
        0.5 * f64::from(farthest.next_up() - farthest) * 3.0_f64.sqrt()
    }
}

/// A body and its starting positions.
struct Case<'a> {
    name: &'static str,
    definition: BodyDefinition<'a>,
    start: &'a [Vec3],
    is_pressed: bool,
}

/// A body in a world of its own, at the origin or moved.
struct Scene {
    world: World,
    body: BodyId,
    ball: Option<ToolId>,
    motion: Motion,
}

impl Scene {
    fn new(case: &Case, solver: Solver, start: &[Vec3], motion: Motion) -> Self {
        let mut world = World::new(WorldDefinition {
            gravity: (motion.turn * DOWN.as_dvec3()).as_vec3(),
            ..FREE
        })
        .expect("a world");
        let definition = BodyDefinition {
            positions: start,
            rest_positions: Some(case.definition.positions),
            solver,
            accuracy: if solver == Solver::Implicit { 1e-6 } else { 0.0 },
            ..case.definition
        };
        let body = world.create_body(&definition).expect("a body");
        let mut scene = Self {
            world,
            body,
            ball: None,
            motion,
        };
        for node in pins(case.definition.positions) {
            let body = scene.world.body_mut(scene.body).expect("the body");
            body.pin(node).expect("a node");
        }
        if case.is_pressed {
            let ball = ToolDefinition {
                pose: Pose {
                    position: scene.ball_position(0.0),
                    orientation: Quat::IDENTITY,
                },
                ..ToolDefinition::new(Shape::Sphere { radius: RADIUS })
            };
            scene.ball = Some(scene.world.create_tool(&ball).expect("a tool"));
        }
        scene
    }

    /// Returns the ball's position, above the center of the upper face and moving into it.
    fn ball_position(&self, down: f64) -> Vec3 {
        let above = 0.025 + f64::from(RADIUS) + 0.002;
        self.motion.of(DVec3::Y * (above - down)).as_vec3()
    }

    fn body(&self) -> &Body {
        self.world.body(self.body).expect("the body")
    }

    fn step(&mut self, dt: f32, part: f64) {
        if let Some(ball) = self.ball {
            let position = self.ball_position(0.01 * part);
            self.world.set_pose(ball, position, None).expect("a pose");
        }
        let report = self.world.step(dt).expect("a step");
        assert_eq!(report.bodies_restored, 0);
    }

    /// Returns the positions transformed back to the origin.
    fn positions(&self) -> Vec<DVec3> {
        let positions = self.body().positions().iter();
        positions.map(|p| self.motion.back(p.as_dvec3())).collect()
    }

    /// Returns the forces on the pins, rotated back (N).
    fn held(&self, pins: &[u32]) -> Vec<DVec3> {
        let force = |&node: &u32| self.body().pin_force(node).expect("a pin").as_dvec3();
        pins.iter()
            .map(|node| self.motion.turn.inverse() * force(node))
            .collect()
    }
}

/// Returns the nodes of the end at low x.
fn pins(rest: &[Vec3]) -> Vec<u32> {
    let low = rest.iter().map(|p| p.x).fold(f32::INFINITY, f32::min);
    let held = (0..).zip(rest).filter(|(_, p)| p.x < low + 0.1 * SPACING);
    held.map(|(node, _)| node).collect()
}

fn motions() -> Vec<Motion> {
    let axis = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    let turns = [10.0_f64, 90.0, 180.0].map(|degrees| DQuat::from_axis_angle(axis, degrees.to_radians()));
    let far = DVec3::new(6.0, -8.0, 0.0);
    let turned = turns.map(|turn| Motion { turn, ..Motion::NONE });
    let moved = Motion {
        offset: far,
        ..Motion::NONE
    };
    let both = Motion {
        turn: turns[0],
        offset: far,
    };
    [turned.as_slice(), &[moved, both]].concat()
}

/// Compares a case with its image under each motion.
fn assert_moves_with_the_scene(case: &Case) {
    assert_moves_by(case, &motions());
}

fn assert_moves_by(case: &Case, motions: &[Motion]) {
    let rest = case.definition.positions;
    let size = f64::from(rest.iter().fold(0.0_f32, |size, p| size.max(p.length()))) * 2.0;
    let pins = pins(rest);
    for (solver, same) in SAME {
        let (dt, steps) = if solver == Solver::Verlet {
            (2e-3, 50)
        } else {
            (1.0 / 60.0, 6)
        };
        for &motion in motions {
            let moved: Vec<Vec3> = case.start.iter().map(|p| motion.of(p.as_dvec3()).as_vec3()).collect();
            let still: Vec<Vec3> = moved.iter().map(|p| motion.back(p.as_dvec3()).as_vec3()).collect();
            let mut still = Scene::new(case, solver, &still, Motion::NONE);
            let mut moved = Scene::new(case, solver, &moved, motion);
            let mut largest_displacement = 0.0;
            for step in 1..=steps {
                for scene in [&mut still, &mut moved] {
                    scene.step(dt, f64::from(step) / f64::from(steps));
                }
                let (expected, found) = (still.positions(), moved.positions());
                let first: Vec<DVec3> = case.start.iter().map(|p| p.as_dvec3()).collect();
                largest_displacement = largest_difference(&expected, &first).max(largest_displacement);
                let error = largest_difference(&found, &expected);
                assert!(
                    error < same * size + motion.rounding(size),
                    "{}, {solver:?}, {motion:?}, step {step}: off by {error:.1e} m of {size} m",
                    case.name
                );
                let (expected, found) = (still.held(&pins), moved.held(&pins));
                let most = expected.iter().map(|force| force.length()).fold(0.0, f64::max);
                let error = largest_difference(&found, &expected) / most;
                assert!(
                    error < 1e-3,
                    "{}, {solver:?}, {motion:?}, step {step}: forces off by {error:.1e}",
                    case.name
                );
            }
            assert!(
                largest_displacement > 0.02 * size,
                "{}, {solver:?}: it hardly moves: {largest_displacement} m",
                case.name
            );
        }
    }
}

const TISSUE: Material = Material {
    model: Model::Tetrahedra,
    young_modulus: 3000.0,
    poisson_ratio: 0.3,
    density: 1000.0,
    thickness: 0.0,
};

/// A block of tetrahedra that starts twisted.
struct Block {
    mesh: Mesh,
    start: Vec<Vec3>,
    fibres: Vec<Vec3>,
}

impl Block {
    fn new() -> Self {
        let mut mesh = Mesh::block([6.0 * SPACING, 4.0 * SPACING, 4.0 * SPACING], [6, 4, 4]).expect("a block");
        let mut random = Random::new(21);
        for position in &mut mesh.positions {
            let inner = position.abs().max_element() < 2.5 * SPACING && position.y.abs() < 1.5 * SPACING;
            let shift = random.vector() * 0.1 * SPACING;
            *position += if inner { shift } else { Vec3::ZERO };
        }
        let twisted = mesh.positions.iter().map(|p| {
            let along = p.x / (3.0 * SPACING) + 1.0;
            Quat::from_rotation_x(0.2 * along) * *p
        });
        let fibres = mesh
            .tetrahedra
            .iter()
            .map(|_| (Vec3::X + 0.3 * random.vector()).normalize());
        Self {
            start: twisted.collect(),
            fibres: fibres.collect(),
            mesh,
        }
    }

    fn case<'a>(&'a self, name: &'static str, definition: BodyDefinition<'a>) -> Case<'a> {
        Case {
            name,
            definition: BodyDefinition {
                positions: &self.mesh.positions,
                tetrahedra: &self.mesh.tetrahedra,
                ..definition
            },
            start: &self.start,
            is_pressed: false,
        }
    }

    /// Springs given by the caller.
    fn springs(&self) -> BodyDefinition<'static> {
        BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(20.0),
            ..BodyDefinition::default()
        }
    }

    fn material(&self, material: Material) -> BodyDefinition<'static> {
        BodyDefinition {
            material: Some(material),
            ..BodyDefinition::default()
        }
    }
}

#[test]
fn springs_move_with_the_scene() {
    let block = Block::new();
    let from_modulus = Material {
        model: Model::Springs,
        poisson_ratio: 0.0,
        ..TISSUE
    };
    assert_moves_with_the_scene(&block.case("springs from Young's modulus", block.material(from_modulus)));
    let volume = BodyDefinition {
        volume_stiffness: 1500.0,
        spring_dampings: Values::Uniform(0.01),
        ..block.springs()
    };
    assert_moves_with_the_scene(&block.case("volume and damping along springs", volume));
    let stiffening = BodyDefinition {
        spring_law: SpringLaw::Exponential {
            steepness: 8.0,
            limit: 0.2,
        },
        ..block.springs()
    };
    assert_moves_with_the_scene(&block.case("springs that stiffen", stiffening));
}

#[test]
fn elements_move_with_the_scene() {
    let block = Block::new();
    assert_moves_with_the_scene(&block.case("tetrahedra", block.material(TISSUE)));
    let rings = Material {
        poisson_ratio: 0.45,
        ..TISSUE
    };
    assert_moves_with_the_scene(&block.case("tetrahedra that keep volume by rings", block.material(rings)));
    let fibres = BodyDefinition {
        fibre_directions: &block.fibres,
        fibre_stiffnesses: Values::Uniform(6000.0),
        ..block.material(TISSUE)
    };
    assert_moves_with_the_scene(&block.case("tetrahedra with fibres", fibres));
}

#[test]
fn pressed_tissue_moves_with_the_scene() {
    pressed_tissue_moves_with_the_scene_of(&motions()[3..]);
}

#[test]
#[ignore = "long"]
fn pressed_tissue_moves_with_the_scene_under_every_rotation() {
    pressed_tissue_moves_with_the_scene_of(&motions()[..3]);
}

fn pressed_tissue_moves_with_the_scene_of(motions: &[Motion]) {
    let block = Block::new();
    let damped = BodyDefinition {
        node_dampings: Values::Uniform(0.005),
        ..block.material(TISSUE)
    };
    let case = Case {
        start: &block.mesh.positions,
        is_pressed: true,
        ..block.case("tetrahedra that a ball is pressed into", damped)
    };
    assert_moves_by(&case, motions);
}

#[test]
fn sheets_that_bend_move_with_the_scene() {
    let mut sheet = Mesh::cloth([6.0 * SPACING, 4.0 * SPACING], [6, 4]).expect("a cloth");
    // Curved at rest.
    for position in &mut sheet.positions {
        position.y = 0.03 * (1.0 - (position.x / 0.06).powi(2)) * (1.0 + 4.0 * position.z);
    }
    let lifted = sheet.positions.iter().map(|p| {
        let along = p.x / (3.0 * SPACING) + 1.0;
        *p + Vec3::Y * 0.004 * along * along
    });
    let start: Vec<Vec3> = lifted.collect();
    assert_moves_with_the_scene(&Case {
        name: "a curved sheet that bends",
        definition: BodyDefinition {
            masses: Values::Uniform(2e-4),
            stiffnesses: Values::Uniform(20.0),
            bending_stiffness: 2e-5,
            ..BodyDefinition::of(&sheet)
        },
        start: &start,
        is_pressed: false,
    });
}
