//! The bill: what a body pays for what it asks for, and that it pays nothing for what it does not; what the library and a world cost by themselves.
//!
//! `cargo bench --bench bill [-- part of a name]` writes `target/report/bill.md`. One organ as plain springs, the same with every option given and off, with
//! each feature alone, and as finite elements: the time of a substep of VERLET by spring, that of a frame of IMPLICIT, the memory of the whole
//! body, the time to make it, and snapshots of it, in one run, in turns, and as ratios to plain springs. Times are the processor's, the least of all turns. It fails
//! where the body with every option off has other bytes or moves otherwise than the plain one.
#![allow(clippy::print_stderr)]

mod alone;
#[path = "../storage/clock.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod clock;
mod held;

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use glam::Vec3;
use held::held;
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{
    BodyContact, BodyDefinition, BodyId, BodyReader, DebugCanvas, DebugDrawDefinition, ElementLaw, Embedding,
    EmbeddingDefinition, Material, Model, Rgba, Sleep, Solver, SpringLaw, Tearing, Values, Viscosity, World,
    WorldDefinition, Yielding,
};

const SUBSTEPS: u32 = 16;

/// Short enough for every body here, s.
const SUBSTEP: f32 = 1e-5;

/// s
const FRAME: f32 = 1.0 / 60.0;

/// How often each body has its turn.
const TURNS: usize = 25;

/// How often each body is made.
const MAKES: usize = 3;

/// What goes with a body rather than in it.
const READER: &str = "read on another thread";
const PROFILED: &str = "hook: stages of the step timed";
const TAGGED: &str = "hook: user data";
const SKETCHED: &str = "hook: drawn for debugging in each step";
const RECORDED: &str = "hook: recorded, with a hash of each step";
const DRAWN: &str = "drawn: its surface, bound, with normals";

/// A stomach where there is one, else a filled organ of as many nodes.
fn organ() -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes/stomach.msh");
    match load(&path, MeshFormat::Auto, 1e-3) {
        Ok(loaded) => loaded.mesh,
        Err(_) => Mesh::organ(0.2, 0.006).expect("an organ"),
    }
}

/// Its boundary.
fn surface(mesh: &Mesh) -> Vec<[u32; 3]> {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let body = world.create_body(&BodyDefinition {
        masses: Values::Uniform(1.0),
        ..BodyDefinition::of(mesh)
    });
    let body = world.body(body.expect("a body")).expect("the body");
    body.surface().to_vec()
}

/// A body in a world of its own.
struct Contender<'a> {
    name: &'a str,
    world: World,
    body: BodyId,
    /// What goes with the body, and is read in each turn.
    beside: Beside,
    /// Of the body, what its world holds for it and what goes with it.
    bytes: usize,
    /// What it took to make the body, s.
    made: f64,
    /// Bytes of a snapshot of its world, and what it took to save and to load it, s.
    snapshot: usize,
    saved: f64,
    loaded: f64,
    /// The least of all turns, s.
    least: f64,
}

/// What reads a body, and is not a part of it.
enum Beside {
    Nothing,
    Reader(BodyReader),
    /// A surface with its normals.
    Drawn(Box<Embedding>),
    Sketched,
}

/// Looks at what is drawn for debugging.
struct Sketch;

impl DebugCanvas for Sketch {
    fn line(&mut self, ends: [Vec3; 2], color: Rgba) {
        std::hint::black_box((ends, color));
    }

    fn point(&mut self, place: Vec3, color: Rgba) {
        std::hint::black_box((place, color));
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
        let before = held();
        let mut made = f64::INFINITY;
        let mut body = BodyId::default();
        for time in 0..MAKES {
            made = made.min(
                clock::time(|| {
                    let definition = BodyDefinition { solver, ..*definition };
                    body = world.create_body(&definition).expect("a body");
                })
                .processor,
            );
            if time + 1 < MAKES {
                world.destroy_body(body).expect("the body");
            }
        }
        let beside = match name {
            READER => Beside::Reader(world.create_reader(body).expect("a reader")),
            DRAWN => Beside::Drawn(Box::new(world.create_embedding(body, drawn).expect("an embedding"))),
            SKETCHED => Beside::Sketched,
            _ => Beside::Nothing,
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
        let bytes = held() - before;
        // Every node trembles a little, so that something is worked out.
        let trembling =
            (0..definition.positions.len()).map(|node| 1e-3 * Vec3::new((node as f32).sin(), 0.5, (node as f32).cos()));
        let velocities: Vec<Vec3> = trembling.collect();
        world
            .body_mut(body)
            .expect("the body")
            .set_velocities(&velocities)
            .expect("velocities");
        let mut snapshot = Vec::new();
        let [mut saved, mut loaded] = [f64::INFINITY; 2];
        for _ in 0..MAKES {
            saved = saved.min(clock::time(|| snapshot = world.save().expect("a snapshot")).processor);
            let load = || drop(std::hint::black_box(World::load(&snapshot, 1, None).expect("a world")));
            loaded = loaded.min(clock::time(load).processor);
        }
        Self {
            name,
            beside,
            bytes,
            made,
            snapshot: snapshot.len(),
            saved,
            loaded,
            world,
            body,
            least: f64::INFINITY,
        }
    }

    /// Steps once.
    fn turn(&mut self, dt: f32) {
        let elapsed = clock::time(|| {
            self.world.step(dt).expect("a step");
            match &mut self.beside {
                Beside::Nothing => (),
                Beside::Reader(reader) => {
                    std::hint::black_box(reader.read());
                }
                Beside::Drawn(drawn) => {
                    drawn.update(&self.world).expect("an update");
                    std::hint::black_box(drawn.normals());
                }
                Beside::Sketched => {
                    let everything = DebugDrawDefinition::default();
                    self.world.debug_draw(&everything, &mut Sketch).expect("a drawing");
                }
            }
        });
        self.least = self.least.min(elapsed.processor);
    }
}

fn main() -> ExitCode {
    let asked = std::env::args().skip(1).find(|argument| argument != "--bench");
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
    // What is asked for, one a line; the first is what all are compared with, the second must not differ from it.
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
                // The smallest speed above 0: it never rests.
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
        (SKETCHED, springs),
        (RECORDED, springs),
        (DRAWN, springs),
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
    let is_asked =
        |place: usize, name: &str| place < 2 || asked.as_ref().is_none_or(|asked| name.contains(asked.as_str()));
    let mut report = String::from("# The bill\n\n");
    report.push_str(&alone::report(held));
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
            .filter(|(place, (name, _))| is_asked(*place, name));
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
        for _ in 0..TURNS {
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
                1e6 * contender.made / node_count as f64,
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
                "**What is off is not free**: {} bytes instead of {bytes}, {hashes:x?}.\n",
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
