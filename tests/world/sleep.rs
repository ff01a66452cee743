//! Sleeping tissue: results match those of awake tissue, and only the cost differs.

use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, CollisionFilter, Error, Material, Pose, Shape, Sleep, Solver, Storage, ToolDefinition,
    ToolId, Values, World, WorldDefinition,
};

const SLEEP: Sleep = Sleep { speed: 1e-3, time: 0.1 };
const AWAKE: Sleep = Sleep { speed: 0.0, time: 0.1 };

/// The largest position error that the sleep definition allows (m).
const FAR: f32 = SLEEP.speed * SLEEP.time;

const DT: f32 = 2e-3;
const RADIUS: f32 = 0.012;

/// A slab of tissue that is pinned to the ground, and a ball above its middle.
struct Slab {
    world: World,
    body: BodyId,
    ball: ToolId,
    pins: Vec<u32>,
}

fn slab(sleep: Sleep, threads: u32, change: impl FnOnce(&mut BodyDefinition)) -> Slab {
    slab_with_cells(40, sleep, threads, change)
}

/// Creates a slab with `cells` cells per side.
fn slab_with_cells(cells: u32, sleep: Sleep, threads: u32, change: impl FnOnce(&mut BodyDefinition)) -> Slab {
    let (wide, high) = (0.2, 0.015);
    let mesh = Mesh::block([wide, high, wide], [cells, 3, cells]).expect("a block");
    let world = WorldDefinition {
        thread_count: threads,
        ..WorldDefinition::default()
    };
    let mut world = World::new(world).expect("a world");
    let mut definition = BodyDefinition {
        material: Some(Material {
            young_modulus: 5000.0,
            poisson_ratio: 0.25,
            density: 1000.0,
            ..Material::default()
        }),
        node_dampings: Values::Uniform(5e-3),
        sleep,
        ..BodyDefinition::of(&mesh)
    };
    change(&mut definition);
    let body = world.create_body(&definition).expect("a body");
    let low = mesh
        .positions
        .iter()
        .fold(f32::INFINITY, |low, position| low.min(position.y));
    let pins: Vec<u32> = (0..mesh.positions.len() as u32)
        .filter(|&node| mesh.positions[node as usize].y < low + 1e-4)
        .collect();
    for &pin in &pins {
        world.body_mut(body).expect("a body").pin(pin).expect("a node");
    }
    let mut ball = ToolDefinition::new(Shape::Sphere { radius: RADIUS });
    ball.pose = above(low + high + 0.05);
    let ball = world.create_tool(&ball).expect("a tool");
    Slab {
        world,
        body,
        ball,
        pins,
    }
}

fn above(height: f32) -> Pose {
    Pose {
        position: Vec3::new(0.0, height, 0.0),
        orientation: Quat::IDENTITY,
    }
}

impl Slab {
    fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds / DT) as usize {
            self.world.step(DT).expect("a step");
        }
    }

    fn awake(&self) -> f32 {
        self.world.body(self.body).expect("a body").awake_share()
    }

    fn top(&self) -> f32 {
        let positions = self.positions();
        positions
            .iter()
            .fold(f32::NEG_INFINITY, |top, position| top.max(position.y))
    }

    fn positions(&self) -> &[Vec3] {
        self.world.body(self.body).expect("a body").positions()
    }

    /// Creates another ball with its center at this height.
    fn make_ball(&mut self, height: f32) -> ToolId {
        let mut ball = ToolDefinition::new(Shape::Sphere { radius: RADIUS });
        ball.pose = above(height);
        self.world.create_tool(&ball).expect("a tool")
    }

    /// Moves the ball until its lowest point is at `height`, in `seconds`.
    fn move_ball(&mut self, height: f32, seconds: f32) {
        let start = self.world.pose(self.ball).expect("a tool").position.y;
        let steps = (seconds / DT) as usize;
        for step in 1..=steps {
            let displacement = (height + RADIUS - start) * step as f32 / steps as f32;
            let position = Vec3::new(0.0, start + displacement, 0.0);
            self.world.set_pose(self.ball, position, None).expect("a pose");
            self.world.step(DT).expect("a step");
        }
    }

    fn force(&self) -> DVec3 {
        self.world.wrench(self.ball).expect("a tool").0.as_dvec3()
    }

    fn distance(&self, other: &Self) -> f32 {
        let pairs = self.positions().iter().zip(other.positions());
        pairs.fold(0.0, |distance, (a, b)| distance.max(a.distance(*b)))
    }
}

/// The slab falls asleep, and a step then leaves it bitwise identical. It sleeps within tolerance of its awake
/// equilibrium.
#[test]
fn tissue_at_rest_falls_asleep_at_its_equilibrium() {
    let mut slab_asleep = slab(SLEEP, 1, |_| ());
    let mut slab_awake = slab(AWAKE, 1, |_| ());
    assert_eq!(slab_asleep.awake(), 1.0);
    for slab in [&mut slab_asleep, &mut slab_awake] {
        slab.run(1.5);
    }
    assert_eq!((slab_asleep.awake(), slab_awake.awake()), (0.0, 1.0));
    let distance = slab_asleep.distance(&slab_awake);
    assert!(distance <= FAR, "{distance} m apart");
    let before = slab_asleep.positions().to_vec();
    let report = slab_asleep.world.step(DT).expect("a step");
    assert_eq!(report.substeps, 0);
    assert_eq!(slab_asleep.positions(), before);
    assert!(
        slab_asleep
            .world
            .body(slab_asleep.body)
            .expect("a body")
            .velocities()
            .iter()
            .all(|&v| v == Vec3::ZERO)
    );
}

/// A ball that presses wakes only the part that moves. Forces and positions match those of awake tissue.
#[test]
#[ignore = "long"]
fn a_tool_wakes_only_the_tissue_it_moves() {
    let mut asleep = slab(SLEEP, 1, |_| ());
    let mut awake = slab(AWAKE, 1, |_| ());
    let mut shares = Vec::new();
    for slab in [&mut asleep, &mut awake] {
        slab.run(1.5);
    }
    let top = awake.top();
    assert_eq!(asleep.awake(), 0.0);
    for depth in [0.001, 0.002, 0.003, 0.004] {
        for slab in [&mut asleep, &mut awake] {
            slab.move_ball(top - depth, 0.2);
        }
        let (force, expected) = (asleep.force(), awake.force());
        assert!(expected.y > 0.005, "{expected} is no force");
        assert!(
            force.distance(expected) <= 0.02 * expected.length(),
            "{force} N asleep, {expected} N awake at {depth} m"
        );
        let distance = asleep.distance(&awake);
        assert!(distance <= 3.0 * FAR, "{distance} m apart at {depth} m");
        shares.push(asleep.awake());
    }
    assert!(
        shares.iter().all(|&share| share > 0.0 && share < 0.7),
        "{shares:?} awake"
    );
    // The ball and the tissue around it come to rest. The force stays the same.
    for slab in [&mut asleep, &mut awake] {
        slab.run(1.5);
    }
    assert_eq!(asleep.awake(), 0.0);
    let (force, expected) = (asleep.force(), awake.force());
    assert!(
        force.distance(expected) <= 0.02 * expected.length(),
        "{force} N asleep, {expected} N awake"
    );
    // The ball leaves.
    for slab in [&mut asleep, &mut awake] {
        slab.move_ball(top + 0.02, 0.2);
    }
    assert!(asleep.awake() > 0.0);
    assert_eq!(asleep.force(), DVec3::ZERO);
    for slab in [&mut asleep, &mut awake] {
        slab.run(2.0);
    }
    assert_eq!(asleep.awake(), 0.0);
    let distance = asleep.distance(&awake);
    assert!(distance <= 3.0 * FAR, "{distance} m apart in the end");
}

/// Every kind of change wakes the body.
#[test]
fn every_change_wakes_sleeping_tissue() {
    let mut slab = slab_with_cells(20, SLEEP, 1, |_| ());
    let middle = slab.positions().len() as u32 - 1;
    let pin = slab.pins[0];
    type Change = (&'static str, fn(&mut Slab, u32, u32));
    let changes: [Change; 12] = [
        ("a force", |slab, node, _| {
            let body = slab.world.body_mut(slab.body).expect("a body");
            body.apply_force(node, Vec3::new(0.0, -0.05, 0.0)).expect("a force");
        }),
        ("a pin", |slab, node, _| {
            slab.world
                .body_mut(slab.body)
                .expect("a body")
                .pin(node)
                .expect("a node")
        }),
        ("a released pin", |slab, node, _| {
            slab.world
                .body_mut(slab.body)
                .expect("a body")
                .unpin(node)
                .expect("a node");
        }),
        ("a moved pin", |slab, _, pin| {
            let position = slab.positions()[pin as usize];
            let body = slab.world.body_mut(slab.body).expect("a body");
            body.move_pin(pin, position + Vec3::X * 1e-3).expect("a pin");
        }),
        ("gravity", |slab, _, _| {
            let gravity = slab.world.gravity();
            slab.world.set_gravity(gravity * 1.01).expect("gravity");
        }),
        ("a region made stiffer", |slab, node, _| {
            let body = slab.world.body_mut(slab.body).expect("a body");
            let all: Vec<u32> = (0..=node).collect();
            body.scale_region(&all, 1.1, 1.0).expect("a region");
        }),
        ("velocities", |slab, _, _| {
            let body = slab.world.body_mut(slab.body).expect("a body");
            let velocities = vec![Vec3::X; body.node_count()];
            body.set_velocities(&velocities).expect("velocities");
        }),
        ("a tool created beside it", |slab, _, _| {
            slab.ball = slab.make_ball(slab.top() + RADIUS + 1e-3);
        }),
        ("its friction", |slab, _, _| {
            slab.world.set_friction(slab.ball, 0.5).expect("a tool")
        }),
        ("its collision filter", |slab, _, _| {
            let filter = CollisionFilter {
                category: 3,
                mask: u32::MAX,
            };
            slab.world.set_collision_filter(slab.ball, filter).expect("a tool")
        }),
        ("a destroyed tool", |slab, _, _| {
            slab.world.destroy_tool(slab.ball).expect("a tool")
        }),
        ("a call", |slab, _, _| {
            slab.world.body_mut(slab.body).expect("a body").wake()
        }),
    ];
    for (name, change) in changes {
        slab.run(1.5);
        assert_eq!(slab.awake(), 0.0, "before {name}");
        change(&mut slab, middle, pin);
        assert!(slab.awake() > 0.0, "{name} does not wake the body");
        slab.run(2.0 * DT);
        assert!(slab.awake() > 0.0, "the body sleeps again right after {name}");
    }
}

/// Distant tools are created, changed and destroyed while the body sleeps on. The force on the pressing tool stays the
/// same.
#[test]
fn tissue_far_from_a_tool_stays_asleep() {
    let mut slab = slab_with_cells(20, SLEEP, 1, |_| ());
    // In this order: two distant tools, and one that presses.
    let first = slab.ball;
    slab.make_ball(50.0);
    let pressing = slab.make_ball(slab.top() + RADIUS - 1e-3);
    slab.run(2.0);
    let force = slab.world.wrench(pressing).expect("a tool").0;
    assert!(slab.awake() == 0.0 && force.y > 1e-3, "{force} N");
    let assert_sleeps_on = |slab: &mut Slab, event: &str| {
        slab.world.step(DT).expect("a step");
        assert_eq!(slab.awake(), 0.0, "{event} wakes the body");
        assert_eq!(slab.world.wrench(pressing).expect("a tool").0, force, "after {event}");
    };
    slab.world.destroy_tool(first).expect("a tool");
    assert_sleeps_on(&mut slab, "destroying a tool before others");
    let replaced = slab.make_ball(50.0);
    assert_sleeps_on(&mut slab, "creating a tool in its slot");
    let last = slab.make_ball(20.0);
    assert_sleeps_on(&mut slab, "creating a tool after others");
    slab.world.set_friction(replaced, 0.5).expect("a tool");
    assert_sleeps_on(&mut slab, "friction of a distant tool");
    let filter = CollisionFilter { category: 0, mask: 0 };
    slab.world.set_collision_filter(replaced, filter).expect("a tool");
    assert_sleeps_on(&mut slab, "the filter of a distant tool");
    slab.world.destroy_tool(last).expect("a tool");
    assert_sleeps_on(&mut slab, "destroying the last tool");
    // A tool that is filtered out releases the tissue, which rises again.
    let pressed_height = slab.top();
    slab.world.set_collision_filter(pressing, filter).expect("a tool");
    assert!(slab.awake() > 0.0);
    slab.run(1.0);
    let middle = |slab: &Slab| {
        let above = |position: &&Vec3| position.x.abs() < 1e-3 && position.z.abs() < 1e-3;
        slab.positions()
            .iter()
            .filter(above)
            .map(|position| position.y)
            .fold(f32::MIN, f32::max)
    };
    assert!(
        (middle(&slab) - pressed_height).abs() < 1e-4,
        "{} of {pressed_height} m",
        middle(&slab)
    );
}

/// The state is independent of the number of threads.
#[test]
fn any_number_of_threads_gives_the_same_state() {
    let run = |threads: u32| {
        let mut slab = slab(SLEEP, threads, |_| ());
        slab.run(0.6);
        let top = slab.top();
        slab.move_ball(top - 0.003, 0.2);
        slab.run(0.1);
        (slab.world.state_hash(), slab.awake())
    };
    let alone = run(1);
    assert!(alone.1 < 1.0 && alone.1 > 0.0, "{} awake", alone.1);
    assert_eq!(run(2), alone);
    assert_eq!(run(3), alone);
}

#[test]
fn every_solver_storage_and_model_sleeps() {
    check_every_solver_storage_and_model_sleeps(|change| change != 0 && change != 3);
}

#[test]
#[ignore = "long"]
fn every_solver_storage_and_model_sleeps_in_the_other_cases() {
    check_every_solver_storage_and_model_sleeps(|change| change == 0 || change == 3);
}

fn check_every_solver_storage_and_model_sleeps(is_selected: fn(usize) -> bool) {
    type Change = fn(&mut BodyDefinition);
    let changes: [(&str, Change); 5] = [
        ("implicit", |definition| definition.solver = Solver::Implicit),
        ("by rows", |definition| definition.storage = Storage::Efficient),
        ("elements", |definition| {
            if let Some(material) = &mut definition.material {
                material.model = sinew::Model::Tetrahedra;
            }
        }),
        ("damped springs", |definition| {
            definition.spring_dampings = Values::Uniform(0.01)
        }),
        ("volume", |definition| definition.volume_stiffness = 1000.0),
    ];
    for (_, (name, change)) in (0..).zip(changes).filter(|change| is_selected(change.0)) {
        let mut asleep = slab_with_cells(20, SLEEP, 1, change);
        let mut awake = slab_with_cells(20, AWAKE, 1, change);
        for slab in [&mut asleep, &mut awake] {
            slab.run(1.2);
        }
        assert_eq!(asleep.awake(), 0.0, "{name}");
        let top = awake.top();
        for slab in [&mut asleep, &mut awake] {
            slab.move_ball(top - 0.002, 0.2);
        }
        let (force, expected) = (asleep.force(), awake.force());
        assert!(expected.length() > 0.0, "{name}: no force");
        assert!(
            force.distance(expected) <= 0.02 * expected.length(),
            "{name}: {force} N asleep, {expected} N awake"
        );
        let distance = asleep.distance(&awake);
        assert!(distance <= 3.0 * FAR, "{name}: {distance} m apart");
    }
}

/// Anchor springs and cavity pressure balance gravity and springs. The forces that decide about sleep include them.
#[test]
fn tissue_held_by_anchor_springs_and_pressure_sleeps() {
    type Change = fn(&mut BodyDefinition);
    let changes: [(&str, Change); 2] = [
        ("home springs", |definition| {
            definition.home_stiffnesses = Values::Uniform(5.0)
        }),
        ("pressure", |definition| definition.pressure = 200.0),
    ];
    for (name, change) in changes {
        let [mut asleep, mut awake, plain] =
            [(SLEEP, change), (AWAKE, change), (AWAKE, |_| ())].map(|(sleep, change)| {
                let mut slab = slab_with_cells(8, sleep, 1, |definition| {
                    definition.node_dampings = Values::Uniform(0.05);
                    change(definition);
                });
                slab.run(2.0);
                slab
            });
        assert_eq!(asleep.awake(), 0.0, "{name}");
        assert!(awake.distance(&plain) > 10.0 * FAR, "{name} does nothing");
        for slab in [&mut asleep, &mut awake] {
            slab.run(0.5);
        }
        let distance = asleep.distance(&awake);
        assert!(distance <= FAR, "{name}: {distance} m apart");
    }
}

/// Falling asleep and waking a thousand times changes neither the position nor the energy.
#[test]
fn a_thousand_sleeps_change_nothing() {
    let cells = 4;
    let mesh = Mesh::block([0.03, 0.03, 0.03], [cells; 3]).expect("a block");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let definition = BodyDefinition {
        material: Some(Material {
            young_modulus: 5000.0,
            poisson_ratio: 0.25,
            density: 1000.0,
            ..Material::default()
        }),
        node_dampings: Values::Uniform(5e-3),
        sleep: Sleep {
            speed: 1e-3,
            time: 0.02,
        },
        ..BodyDefinition::of(&mesh)
    };
    let body = world.create_body(&definition).expect("a body");
    for node in 0..mesh.positions.len() as u32 {
        if mesh.positions[node as usize].y < -0.0149 {
            world.body_mut(body).expect("a body").pin(node).expect("a node");
        }
    }
    let to_rest = |world: &mut World| {
        for _ in 0..400 {
            world.step(DT).expect("a step");
            if world.body(body).expect("a body").awake_share() == 0.0 {
                return;
            }
        }
        panic!("the body does not fall asleep");
    };
    to_rest(&mut world);
    let start = world.body(body).expect("a body").positions().to_vec();
    let gravity = world.gravity();
    let energy = |world: &World| {
        let energy = world.body(body).expect("a body").energy(gravity);
        energy.kinetic + energy.elastic + energy.gravitational
    };
    let first = energy(&world);
    for round in 0..1000 {
        world.body_mut(body).expect("a body").wake();
        if round % 4 == 0 {
            let push = Vec3::new(0.002, 0.0, 0.001);
            world
                .body_mut(body)
                .expect("a body")
                .apply_force(mesh.positions.len() as u32 - 1, push)
                .expect("a force");
        }
        to_rest(&mut world);
    }
    let end = world.body(body).expect("a body").positions();
    let distance = start
        .iter()
        .zip(end)
        .fold(0.0_f32, |distance, (a, b)| distance.max(a.distance(*b)));
    assert!(distance <= 1e-3 * 0.02, "{distance} m off after a thousand sleeps");
    let scale = 0.03_f64.powi(3) * 1000.0 * 9.81 * f64::from(1e-3_f32 * 0.02);
    assert!(
        (energy(&world) - first).abs() <= scale,
        "{} J, {first} J at first",
        energy(&world)
    );
}

#[test]
fn a_refused_step_wakes_nothing() {
    for damping in [0.0, 1e-3] {
        let change = |definition: &mut BodyDefinition| {
            definition.material = None;
            definition.masses = Values::Uniform(1e-4);
            definition.stiffnesses = Values::Uniform(50.0);
            definition.spring_dampings = Values::Uniform(damping);
        };
        let [mut refusing, mut other] = [(); 2].map(|()| {
            let mut slab = slab_with_cells(20, SLEEP, 1, change);
            slab.run(1.5);
            slab
        });
        assert_eq!(refusing.awake(), 0.0);
        let to_touch = Vec3::new(0.0, refusing.top() + 0.9 * RADIUS, 0.0);
        for slab in [&mut refusing, &mut other] {
            slab.world.set_pose(slab.ball, to_touch, None).expect("a pose");
        }
        let hash = refusing.world.state_hash();
        for _ in 0..2 {
            let refused = refusing.world.step(100.0);
            assert!(matches!(refused, Err(Error::Unstable { .. })), "{refused:?}");
            assert_eq!(refusing.awake(), 0.0);
            assert_eq!(refusing.world.state_hash(), hash);
        }
        for _ in 0..3 {
            for slab in [&mut refusing, &mut other] {
                slab.world.step(DT).expect("a step");
                assert!(slab.awake() > 0.0);
            }
            assert_eq!(refusing.world.state_hash(), other.world.state_hash());
        }
    }
}
