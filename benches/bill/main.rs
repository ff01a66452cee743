//! The cost table: the cost of each feature of a body, a check that disabled features cost nothing, and the cost of the
//! library and of an empty world.
//!
//! `cargo bench --bench bill [-- part of a name]` writes `target/report/bill.md`. The bodies are one organ as plain
//! springs, the same with every option set to its neutral value, with each feature alone, and as finite elements. For
//! each it reports the time of a VERLET substep per spring, of an IMPLICIT frame, the memory of the body, the time to
//! create it, and snapshots. Bodies are measured in one run, in turns, as ratios to plain springs. Times are processor
//! times, the least of all turns. It fails if the body with all options off differs in memory or motion from the plain
//! one.
#![allow(clippy::print_stderr)]

mod allocator;
mod alone;
#[path = "../storage/clock.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod clock;

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use allocator::allocated;
use glam::Vec3;
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{
    BodyContact, BodyDefinition, BodyId, BodyReader, DebugCanvas, DebugDrawDefinition, ElementLaw, Embedding,
    EmbeddingDefinition, Material, Model, Rgba, Sleep, Solver, SpringLaw, Tearing, Values, Viscosity, World,
    WorldDefinition, Yielding,
};

const SUBSTEPS: u32 = 16;

/// Stable for every body here [s].
const SUBSTEP: f32 = 1e-5;

/// Duration of a frame [s].
const FRAME: f32 = 1.0 / 60.0;

/// Number of timed steps of each body.
const REPEATS: usize = 25;

/// Number of times that each body is created.
const CREATIONS: usize = 3;

/// Rows that add something beside the body, or a hook, to plain springs.
const READER: &str = "read on another thread";
const PROFILED: &str = "hook: stages of the step timed";
const TAGGED: &str = "hook: user data";
const DEBUG_DRAWN: &str = "hook: drawn for debugging in each step";
const RECORDED: &str = "hook: recorded, with a hash of each step";
const EMBEDDED: &str = "drawn: its surface, bound, with normals";

/// A stomach if its file exists, otherwise a generated organ with about as many nodes.
fn organ() -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes/stomach.msh");
    match load(&path, MeshFormat::Auto, 1e-3) {
        Ok(loaded) => loaded.mesh,
        Err(_) => Mesh::organ(0.2, 0.006).expect("an organ"),
    }
}

/// The boundary triangles of a mesh.
fn surface(mesh: &Mesh) -> Vec<[u32; 3]> {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let body = world.create_body(&BodyDefinition {
        masses: Values::Uniform(1.0),
        ..BodyDefinition::of(mesh)
    });
    let body = world.body(body.expect("a body")).expect("the body");
    body.surface().to_vec()
}

/// A body in its own world.
struct Contender<'a> {
    name: &'a str,
    world: World,
    body: BodyId,
    /// The object beside the body that is read in each turn.
    companion: Companion,
    /// Memory of the body, its world's data for it and the object beside it.
    bytes: usize,
    /// Time to create the body [s].
    creation_time: f64,
    /// Size of a snapshot of the world [bytes], and the times to save and load it [s].
    snapshot: usize,
    saved: f64,
    loaded: f64,
    /// The least time of all turns [s].
    least: f64,
}

/// An object that reads a body without being part of it.
enum Companion {
    Nothing,
    Reader(BodyReader),
    /// A surface with its normals.
    Drawn(Box<Embedding>),
    DebugDrawn,
}

/// A debug canvas that discards all primitives.
struct NullCanvas;

impl DebugCanvas for NullCanvas {
    fn line(&mut self, ends: [Vec3; 2], color: Rgba) {
        std::hint::black_box((ends, color));
    }

    fn point(&mut self, position: Vec3, color: Rgba) {
        std::hint::black_box((position, color));
    }

    fn triangle(&mut self, corners: [Vec3; 3], color: Rgba) {
        std::hint::black_box((corners, color));
    }
}

impl<'a> Contender<'a> {
    fn new(name: &'a str, definition: &BodyDefinition, solver: Solver, drawn: &EmbeddingDefinition) -> Self {
        let mut world = World::new(WorldDefinition {
            substeps: if solver == Solver::Verlet { SUBSTEPS } else { 0 },
            gravity: Vec3::ZERO,
            ..WorldDefinition::default()
        })
        .expect("a world");
        let before = allocated();
        let mut creation_time = f64::INFINITY;
        let mut body = BodyId::default();
        for creation in 0..CREATIONS {
            creation_time = creation_time.min(
                clock::time(|| {
                    let definition = BodyDefinition { solver, ..*definition };
                    body = world.create_body(&definition).expect("a body");
                })
                .processor,
            );
            if creation + 1 < CREATIONS {
                world.destroy_body(body).expect("the body");
            }
        }
        let companion = match name {
            READER => Companion::Reader(world.create_reader(body).expect("a reader")),
            EMBEDDED => Companion::Drawn(Box::new(world.create_embedding(body, drawn).expect("an embedding"))),
            DEBUG_DRAWN => Companion::DebugDrawn,
            _ => Companion::Nothing,
        };
        match name {
            PROFILED => world.set_profiling(true).expect("room"),
            TAGGED => {
                world.set_user_data(1);
                world.body_mut(body).expect("the body").set_user_data(1);
            }
            RECORDED => {
                let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bill.recording");
                world.start_recording(&path).expect("a file");
            }
            _ => (),
        }
        let bytes = allocated() - before;
        // Every node moves a little, so that forces are not zero.
        let jitter =
            (0..definition.positions.len()).map(|node| 1e-3 * Vec3::new((node as f32).sin(), 0.5, (node as f32).cos()));
        let velocities: Vec<Vec3> = jitter.collect();
        world
            .body_mut(body)
            .expect("the body")
            .set_velocities(&velocities)
            .expect("velocities");
        let mut snapshot = Vec::new();
        let [mut saved, mut loaded] = [f64::INFINITY; 2];
        for _ in 0..CREATIONS {
            saved = saved.min(clock::time(|| snapshot = world.save().expect("a snapshot")).processor);
            let load = || drop(std::hint::black_box(World::load(&snapshot, 1, None).expect("a world")));
            loaded = loaded.min(clock::time(load).processor);
        }
        Self {
            name,
            companion,
            bytes,
            creation_time,
            snapshot: snapshot.len(),
            saved,
            loaded,
            world,
            body,
            least: f64::INFINITY,
        }
    }

    /// Steps once and reads the object beside the body.
    fn turn(&mut self, dt: f32) {
        let elapsed = clock::time(|| {
            self.world.step(dt).expect("a step");
            match &mut self.companion {
                Companion::Nothing => (),
                Companion::Reader(reader) => {
                    std::hint::black_box(reader.read());
                }
                Companion::Drawn(drawn) => {
                    drawn.update(&self.world).expect("an update");
                    std::hint::black_box(drawn.normals());
                }
                Companion::DebugDrawn => {
                    let everything = DebugDrawDefinition::default();
                    self.world.debug_draw(&everything, &mut NullCanvas).expect("a drawing");
                }
            }
        });
        self.least = self.least.min(elapsed.processor);
    }
}

fn main() -> ExitCode {
    let filter = std::env::args().skip(1).find(|argument| argument != "--bench");
    let mesh = organ();
    let (node_count, tetrahedron_count) = (mesh.positions.len(), mesh.tetrahedra.len());
    let tissue = |model, poisson_ratio| Material {
        model,
        young_modulus: 5000.0,
        poisson_ratio,
        density: 1060.0,
        ..Material::default()
    };
    let surface = surface(&mesh);
    let plain = BodyDefinition {
        triangles: &surface,
        ..BodyDefinition::of(&mesh)
    };
    let springs = BodyDefinition {
        masses: Values::Uniform(1e-5),
        stiffnesses: Values::Uniform(10.0),
        ..plain
    };
    let solid = Viscosity {
        retardation_time: 0.02,
        relaxation_time: 0.02,
    };
    let directions = vec![Vec3::X; tetrahedron_count];
    let (nowhere, none) = (
        vec![Vec3::ZERO; tetrahedron_count],
        vec![0.0; node_count.max(tetrahedron_count)],
    );
    // One body per row. The first is the baseline of all ratios; the second must not differ from it.
    let bodies: &[(&str, BodyDefinition)] = &[
        ("plain springs", springs),
        (
            "every option given, and off",
            BodyDefinition {
                rest_positions: Some(&mesh.positions),
                material: None,
                node_dampings: Values::Each(&none[..node_count]),
                damping_rate: 0.0,
                spring_dampings: Values::Uniform(0.0),
                volume_stiffness: 0.0,
                home_stiffnesses: Values::Each(&none[..node_count]),
                bending_stiffness: 0.0,
                spring_law: SpringLaw::Linear,
                element_law: ElementLaw::default(),
                fibre_directions: &nowhere,
                fibre_stiffnesses: Values::Each(&none[..tetrahedron_count]),
                viscosity: Viscosity::default(),
                yielding: Yielding::default(),
                strain_limit: 0.0,
                enclosed_stiffness: 0.0,
                pressure: 0.0,
                ..springs
            },
        ),
        (
            "damping of nodes",
            BodyDefinition {
                node_dampings: Values::Uniform(1e-4),
                ..springs
            },
        ),
        (
            "damping along springs",
            BodyDefinition {
                spring_dampings: Values::Uniform(1e-4),
                ..springs
            },
        ),
        (
            "volume of tetrahedra",
            BodyDefinition {
                volume_stiffness: 2000.0,
                ..springs
            },
        ),
        (
            "home springs",
            BodyDefinition {
                home_stiffnesses: Values::Uniform(1.0),
                ..springs
            },
        ),
        (
            "bending of the surface",
            BodyDefinition {
                bending_stiffness: 1e-6,
                ..springs
            },
        ),
        (
            "pressure inside",
            BodyDefinition {
                enclosed_stiffness: 1000.0,
                pressure: 10.0,
                ..springs
            },
        ),
        (
            "springs that stiffen",
            BodyDefinition {
                spring_law: SpringLaw::Exponential {
                    steepness: 10.0,
                    limit: 0.2,
                },
                ..springs
            },
        ),
        (
            "springs that relax",
            BodyDefinition {
                viscosity: solid,
                ..springs
            },
        ),
        (
            "springs that yield",
            BodyDefinition {
                yielding: Yielding {
                    strain: 0.1,
                    ..Yielding::default()
                },
                ..springs
            },
        ),
        (
            "springs with a limit",
            BodyDefinition {
                strain_limit: 0.2,
                ..springs
            },
        ),
        (
            "fibres in all tetrahedra",
            BodyDefinition {
                fibre_directions: &directions,
                fibre_stiffnesses: Values::Uniform(1000.0),
                ..springs
            },
        ),
        (
            "asleep where it rests, and awake",
            BodyDefinition {
                // The smallest speed above 0: the body never sleeps.
                sleep: Sleep {
                    speed: f32::MIN_POSITIVE,
                    time: 0.5,
                },
                ..springs
            },
        ),
        (
            "mass added where it limits the substep",
            BodyDefinition {
                mass_scaling: 1e-2,
                ..springs
            },
        ),
        (
            "may be cut",
            BodyDefinition {
                spare_nodes: 1000,
                ..springs
            },
        ),
        (
            "may tear",
            BodyDefinition {
                spare_nodes: 1000,
                tearing: Tearing {
                    strain: 0.5,
                    most_per_step: 4,
                    ..Tearing::default()
                },
                ..springs
            },
        ),
        (
            "meets other bodies",
            BodyDefinition {
                contact: BodyContact {
                    with_bodies: true,
                    ..BodyContact::default()
                },
                ..springs
            },
        ),
        (
            "meets itself",
            BodyDefinition {
                contact: BodyContact {
                    with_itself: true,
                    ..BodyContact::default()
                },
                ..springs
            },
        ),
        (READER, springs),
        (PROFILED, springs),
        (TAGGED, springs),
        (DEBUG_DRAWN, springs),
        (RECORDED, springs),
        (EMBEDDED, springs),
        (
            "springs from E",
            BodyDefinition {
                material: Some(tissue(Model::Springs, 0.0)),
                ..plain
            },
        ),
        (
            "tetrahedra, nu 0.3",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.3)),
                ..plain
            },
        ),
        (
            "tetrahedra that relax, nu 0.3",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.3)),
                viscosity: solid,
                ..plain
            },
        ),
        (
            "tetrahedra that yield, nu 0.3",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.3)),
                yielding: Yielding {
                    strain: 0.1,
                    ..Yielding::default()
                },
                ..plain
            },
        ),
        (
            "tetrahedra, nu 0.45",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.45)),
                ..plain
            },
        ),
        (
            "tetrahedra, neo-Hookean, nu 0.3",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.3)),
                element_law: ElementLaw::NeoHookean,
                ..plain
            },
        ),
        (
            "tetrahedra, Mooney and Rivlin, nu 0.3",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.3)),
                element_law: ElementLaw::MooneyRivlin { ratio: 0.3 },
                ..plain
            },
        ),
        (
            "tetrahedra, neo-Hookean, nu 0.45",
            BodyDefinition {
                material: Some(tissue(Model::Tetrahedra, 0.45)),
                element_law: ElementLaw::NeoHookean,
                ..plain
            },
        ),
    ];
    let is_selected =
        |index: usize, name: &str| index < 2 || filter.as_ref().is_none_or(|filter| name.contains(filter.as_str()));
    let mut report = String::from("# Cost table\n\n");
    report.push_str(&alone::report(allocated));
    let drawn = EmbeddingDefinition {
        vertices: &mesh.positions,
        triangles: &surface,
        tetrahedra: &mesh.tetrahedra,
    };
    let mut is_free = true;
    for (solver, dt, unit) in [
        (
            Solver::Verlet,
            SUBSTEP * SUBSTEPS as f32,
            "ns a spring and substep of VERLET",
        ),
        (Solver::Implicit, FRAME, "ms a frame of IMPLICIT"),
    ] {
        let contenders = bodies
            .iter()
            .enumerate()
            .filter(|(index, (name, _))| is_selected(*index, name));
        let mut contenders: Vec<Contender> = contenders
            .map(|(_, (name, definition))| Contender::new(name, definition, solver, &drawn))
            .collect();
        let spring_count = {
            let plain = &contenders[0];
            plain
                .world
                .body(plain.body)
                .expect("the body")
                .storage_report()
                .spring_count
        };
        for _ in 0..REPEATS {
            for contender in &mut contenders {
                contender.turn(dt);
            }
        }
        if solver == Solver::Verlet {
            let _ = writeln!(
                report,
                "{node_count} nodes, {spring_count} springs, {tetrahedron_count} tetrahedra, one thread.\n"
            );
        }
        let _ = writeln!(
            report,
            "| | {unit} | of plain springs | bytes a node | of plain springs | made, us a node | snapshot, bytes a node | saved, us a node | loaded, us a node |\n|---|---|---|---|---|---|---|---|---|"
        );
        let scale = match solver {
            Solver::Verlet => 1e9 / (spring_count as f64 * f64::from(SUBSTEPS)),
            _ => 1e3,
        };
        let (least, bytes) = (contenders[0].least, contenders[0].bytes);
        for contender in &contenders {
            let _ = writeln!(
                report,
                "| {} | {:.3} | {:.2} | {:.0} | {:.2} | {:.2} | {:.0} | {:.3} | {:.3} |",
                contender.name,
                contender.least * scale,
                contender.least / least,
                contender.bytes as f64 / node_count as f64,
                contender.bytes as f64 / bytes as f64,
                1e6 * contender.creation_time / node_count as f64,
                contender.snapshot as f64 / node_count as f64,
                1e6 * contender.saved / node_count as f64,
                1e6 * contender.loaded / node_count as f64,
            );
        }
        report.push('\n');
        let hashes = [0, 1].map(|which| contenders[which].world.state_hash());
        if hashes[0] != hashes[1] || contenders[1].bytes != bytes {
            let _ = writeln!(
                report,
                "**Disabled options are not free**: {} bytes instead of {bytes}, {hashes:x?}.\n",
                contenders[1].bytes
            );
            is_free = false;
        }
    }
    eprintln!("{report}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report");
    let path = folder.join("bill.md");
    if let Err(error) = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, report)) {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    if is_free { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
