//! Thousands of worlds at once. They share nothing, on any number of threads or MPI ranks.

use std::process::Command;

use crate::support::{Library, installed, root, skip, succeed};
use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Shape, Solver, ToolDefinition, ToolId, Values, World, WorldDefinition};

const THREADS: u32 = 8;

/// The number of steps of each world.
const STEPS: u32 = 20;

/// A small cloth with a ball that moves towards it. All parameters depend on the index of the world.
struct Small {
    world: World,
    ball: ToolId,
}

impl Small {
    fn new(index: u32) -> Self {
        let mesh = Mesh::cloth([0.1, 0.1], [3 + index % 4, 3]).expect("a cloth");
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let body = world
            .create_body(&BodyDefinition {
                masses: Values::Uniform(1e-3 + 1e-6 * index as f32),
                stiffnesses: Values::Uniform(40.0),
                node_dampings: Values::Uniform(1e-3),
                solver: [Solver::Verlet, Solver::Implicit][(index % 2) as usize],
                spare_nodes: 20 * (index % 3 % 2),
                ..BodyDefinition::of(&mesh)
            })
            .expect("a body");
        world.body_mut(body).and_then(|body| body.pin(0)).expect("a pin");
        let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.02 });
        ball.pose.position = Vec3::Y * -0.025;
        let ball = world.create_tool(&ball).expect("a ball");
        Self { world, ball }
    }

    fn step(&mut self, step: u32) {
        let position = Vec3::Y * (1e-3 * step as f32 - 0.024);
        self.world.set_pose(self.ball, position, None).expect("a pose");
        self.world.step(5e-3).expect("a step");
    }
}

/// Steps all worlds at once, each on changing threads. Returns their state hashes.
fn step_all(count: u32) -> Vec<u64> {
    let mut worlds: Vec<Small> = (0..count).map(Small::new).collect();
    let share = count.div_ceil(THREADS) as usize;
    for step in 0..STEPS {
        // Each thread gets other worlds than in the last step.
        worlds.rotate_left(share / 2 + 1);
        std::thread::scope(|scope| {
            for worlds in worlds.chunks_mut(share) {
                scope.spawn(move || worlds.iter_mut().for_each(|small| small.step(step)));
            }
        });
    }
    worlds.rotate_right((share / 2 + 1) * STEPS as usize % count as usize);
    worlds.iter().map(|small| small.world.state_hash()).collect()
}

#[test]
fn worlds_on_many_threads_equal_those_on_one() {
    assert_worlds_equal_those_on_one(300);
}

/// The largest number of worlds that are all different.
#[test]
#[ignore = "long"]
fn thousands_of_worlds_on_many_threads_equal_those_on_one() {
    assert_worlds_equal_those_on_one(4000);
}

fn assert_worlds_equal_those_on_one(count: u32) {
    let all = step_all(count);
    // Only some worlds are repeated alone, from the first to the last. Each must equal its result among all.
    for index in (0..count).step_by(37) {
        let mut alone = Small::new(index);
        (0..STEPS).for_each(|step| alone.step(step));
        assert_eq!(all[index as usize], alone.world.state_hash(), "world {index}");
    }
    let mut different = all.clone();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), all.len(), "worlds that are different end differently");
}

/// A world can be created on one thread, stepped on another and destroyed on a third, concurrently with others.
#[test]
fn worlds_can_move_between_threads() {
    let (give, take) = std::sync::mpsc::channel();
    let maker = std::thread::spawn(move || {
        for index in 0..100_u32 {
            let positions = [Vec3::ZERO, Vec3::X * (1.0 + index as f32)];
            let mut world = World::new(WorldDefinition::default()).expect("a world");
            let body = world.create_body(&BodyDefinition {
                positions: &positions,
                springs: Some(&[[0, 1]]),
                masses: Values::Uniform(1.0),
                stiffnesses: Values::Uniform(10.0),
                ..BodyDefinition::default()
            });
            give.send((world, body.expect("a body")))
                .expect("somebody who takes it");
        }
    });
    let mut count = 0;
    for (mut world, body) in take {
        let stepped = std::thread::spawn(move || {
            world.step(0.1).expect("a step");
            let ends = world.body(body).expect("the body").positions().to_vec();
            (world, ends)
        });
        let (world, ends) = stepped.join().expect("the thread that steps");
        // In free fall the spring keeps its length.
        assert!((ends[0].distance(ends[1]) - (1.0 + count as f32)).abs() < 1e-4);
        drop(world);
        count += 1;
    }
    maker.join().expect("the thread that makes");
    assert_eq!(count, 100);
}

/// Returns the lines of `fit`'s output about its rounds. They do not depend on which rank computes which candidate.
fn rounds(output: &[u8]) -> Vec<String> {
    let output = String::from_utf8_lossy(output);
    let is_round = |line: &&str| line.ends_with('%') || line.starts_with("known");
    output.lines().filter(is_round).map(str::to_owned).collect()
}

#[test]
#[cfg_attr(target_os = "linux", ignore = "long")]
#[cfg_attr(
    not(target_os = "linux"),
    ignore = "SKIPPED: it builds the program with the library of Linux"
)]
fn a_search_over_ranks_finds_the_same_as_one_process() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("fit");
    std::fs::create_dir_all(&folder).expect("the target directory can be written");
    let library = Library::release();
    let build = |compiler: &str, name: &str, options: &[&str]| {
        let program = folder.join(name);
        let mut command = Command::new(compiler);
        command
            .args(["-std=c99", "-O1"])
            .args(options)
            .arg("-I")
            .arg(root().join("include"));
        command
            .arg(root().join("c_examples/fit.c"))
            .arg("-o")
            .arg(&program)
            .arg(library.shared());
        succeed(
            command
                .arg(format!("-Wl,-rpath,{}", library.folder.display()))
                .args(["-lm", "-lpthread"]),
        );
        program
    };
    let mut alone = Command::new(build("cc", "alone", &[]));
    let alone = rounds(&succeed(alone.arg("-o").arg(&folder)).stdout);
    // Six rounds, and a line that the known values were found. The program fails if they were not.
    assert_eq!(alone.len(), 7, "{alone:?}");
    // Measurements without any force have no solution.
    for (name, force) in [("nothing", "0\n"), ("no_number", "nan\n")] {
        let file = folder.join(name);
        std::fs::write(&file, force.repeat(250)).expect("a file can be written");
        let output = Command::new(folder.join("alone")).arg(&file).output();
        assert!(!output.expect("fit runs").status.success(), "{name}");
    }
    if !(installed("mpicc") && installed("mpirun")) {
        skip("a search over MPI's ranks: no mpicc or no mpirun");
        return;
    }
    let program = build("mpicc", "over_ranks", &["-DWITH_MPI"]);
    let mut ranks = Command::new("mpirun");
    // Open MPI requires these with fewer processors, and in containers.
    for name in [
        "OMPI_ALLOW_RUN_AS_ROOT",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
        "OMPI_MCA_rmaps_base_oversubscribe",
    ] {
        ranks.env(name, "1");
    }
    let ranks = succeed(ranks.args(["-n", "3"]).arg(program).arg("-o").arg(&folder)).stdout;
    assert_eq!(rounds(&ranks), alone);
}
