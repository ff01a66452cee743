//! The accuracy of default settings for a user who only provides a mesh and material data.
//!
//! Each body sags from rest under its weight and is compared with the converged motion. NEWTON with the same steps is
//! no reference: with long steps its error is larger than that of the default.

use std::path::Path;

use glam::Vec3;
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{BodyDefinition, BodyId, ElementLaw, Material, Model, Solver, World, WorldDefinition};

use crate::clock::time;
use crate::hyperelastic::name;
use crate::lines::Lines;
use crate::report::{Report, Table, milliseconds};

/// Durations of steps [s].
const STEPS: [f32; 4] = [1.0 / 30.0, 1.0 / 60.0, 1.0 / 120.0, 1e-3];

const REFERENCE_STEP: f32 = 5e-5;
/// The time at which states are compared, and the total simulated time [s].
const COMPARED: f32 = 0.1;
const TIMED: f32 = 0.5;

struct Subject {
    name: String,
    mesh: Mesh,
    pinned: Vec<u32>,
    materials: Vec<(String, Material, ElementLaw)>,
}

/// Liver (PMC6925591), and a cloth with the weight of cotton.
const TISSUE: Material = Material {
    model: Model::Springs,
    young_modulus: 5400.0,
    poisson_ratio: 0.0,
    density: 1060.0,
    thickness: 0.0,
};
const CLOTH: Material = Material {
    model: Model::Springs,
    young_modulus: 1e5,
    poisson_ratio: 0.0,
    density: 300.0,
    thickness: 1e-3,
};

impl Subject {
    /// A solid fixed at its upper end: the last tenth along its longest axis.
    fn solid(name: &str, mesh: Mesh) -> Self {
        let low = mesh.positions.iter().fold(Vec3::INFINITY, |low, p| low.min(*p));
        let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
        let extent = high - low;
        let long = (0..3).fold(0, |long, axis| if extent[axis] > extent[long] { axis } else { long });
        let is_pinned = |p: &Vec3| p[long] > high[long] - 0.1 * extent[long];
        let mut materials = vec![("springs".to_owned(), TISSUE, ElementLaw::default())];
        if !mesh.tetrahedra.is_empty() {
            let elements = Material {
                model: Model::Tetrahedra,
                poisson_ratio: 0.3,
                ..TISSUE
            };
            let laws = [
                ElementLaw::default(),
                ElementLaw::NeoHookean,
                ElementLaw::MooneyRivlin { ratio: 0.3 },
            ];
            materials.extend(laws.map(|law| (self::name(law), elements, law)));
        }
        Self {
            name: name.into(),
            pinned: nodes(&mesh, is_pinned),
            mesh,
            materials,
        }
    }

    /// Creates the body with defaults, or for the reference with VERLET without mass scaling.
    fn create(&self, index: usize, is_reference: bool) -> Result<(World, BodyId), sinew::Error> {
        let (_, material, element_law) = self.materials[index];
        let mut world = World::new(WorldDefinition::default())?;
        let is_solid = !self.mesh.tetrahedra.is_empty() || !self.mesh.cells.is_empty();
        let mut definition = BodyDefinition {
            triangles: if is_solid { &[] } else { &self.mesh.triangles },
            material: Some(material),
            element_law,
            ..BodyDefinition::of(&self.mesh)
        };
        if is_reference {
            definition.solver = Solver::Verlet;
            definition.mass_scaling = 0.0;
        }
        let id = world.create_body(&definition)?;
        world.body_mut(id)?.pin_nodes(&self.pinned)?;
        Ok((world, id))
    }

    /// The positions of nodes after a time [s], and the time of a step.
    fn run(&self, index: usize, is_reference: bool, step: f32, span: f32) -> Result<Run, sinew::Error> {
        let (mut world, id) = self.create(index, is_reference)?;
        let choice = world.body(id)?.solver_choice();
        let count = (span / step).round() as u32;
        let mut stepped = Ok(());
        let elapsed = time(|| stepped = (0..count).try_for_each(|_| world.step(step).map(|_| ())));
        stepped?;
        Ok(Run {
            positions: world.body(id)?.positions().to_vec(),
            solver: format!("{:?} ({})", choice.solver, choice.substeps),
            step: elapsed.processor / f64::from(count),
        })
    }
}

struct Run {
    positions: Vec<Vec3>,
    solver: String,
    step: f64,
}

fn nodes(mesh: &Mesh, is_pinned: impl Fn(&Vec3) -> bool) -> Vec<u32> {
    (0..mesh.positions.len() as u32)
        .filter(|&node| is_pinned(&mesh.positions[node as usize]))
        .collect()
}

fn subjects(report: &mut Report, is_quick: bool) -> Vec<Subject> {
    let mut subjects = Vec::new();
    let above = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let folder = above()
        .map(|above| above.join("shared/meshes"))
        .find(|path| path.exists());
    match folder {
        None => report.not_offered("real organs", "SKIPPED: ../shared/meshes is missing"),
        Some(folder) => {
            for (file, scale) in [
                ("liver_volumetric.vtk", 0.0),
                ("gallbladder_volumetric.vtk", 0.0),
                ("tissue_volume.msh", 0.0),
                ("stomach.msh", 1e-3),
            ] {
                let result = load(
                    folder.join(file),
                    MeshFormat::Auto,
                    if scale > 0.0 { scale } else { 1.0 },
                );
                match result {
                    Ok(loaded) => {
                        let mut mesh = loaded.mesh;
                        mesh.triangles.clear();
                        if scale == 0.0 {
                            fit(&mut mesh, 0.12);
                        }
                        subjects.push(Subject::solid(file, mesh));
                    }
                    Err(error) => report.not_offered(file, &error.to_string()),
                }
            }
        }
    }
    let spacing = if is_quick { 0.012 } else { 0.006 };
    subjects.push(Subject::solid(
        "generated organ",
        Mesh::organ(0.18, spacing).expect("an organ"),
    ));
    subjects.push(Subject::solid(
        "lattice",
        Mesh::lattice(0.01, [20, 8, 8]).expect("a lattice"),
    ));
    let mesh = Mesh::cloth([0.5; 2], [40; 2]).expect("a cloth");
    let pinned = vec![0, 40];
    let materials = vec![("springs".to_owned(), CLOTH, ElementLaw::default())];
    subjects.push(Subject {
        name: "cloth".into(),
        mesh,
        pinned,
        materials,
    });
    subjects
}

/// Scales a mesh, whose file has unknown units, to this longest extent [m].
fn fit(mesh: &mut Mesh, length: f32) {
    let low = mesh.positions.iter().fold(Vec3::INFINITY, |low, p| low.min(*p));
    let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
    let scale = length / (high - low).max_element();
    mesh.positions.iter_mut().for_each(|p| *p = (*p - low) * scale);
}

/// RMS difference of two states over the RMS displacement of the reference.
fn error(positions: &[Vec3], reference: &[Vec3], rest: &[Vec3]) -> f64 {
    let sum = |a: &[Vec3], b: &[Vec3]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| f64::from(a.distance_squared(*b)))
            .sum::<f64>()
    };
    (sum(positions, reference) / sum(reference, rest)).sqrt()
}

pub fn run(report: &mut Report, lines: &mut Lines, is_quick: bool) {
    report.write(
        "\n## Defaults\n\nA mesh and a material (E = 5.4 kPa, 1060 kg/m³, elements nu = 0.3; cloth 100 kPa, 1 mm), everything else at its default; fixed at one \
         end, released under gravity. *Chosen*: the solver, and the number of substeps of VERLET in 1/60 s. *Time*: processor time of a step, mean over half a second. \
         *Error*: after 0.1 s against VERLET without mass scaling in steps of 50 us, RMS over the RMS displacement of nodes.\n",
    );
    let mut table = Table::new(&[
        "body", "nodes", "material", "step, ms", "chosen", "time, ms", "error, %",
    ]);
    let (mut refused, mut count) = (Vec::new(), 0);
    for subject in subjects(report, is_quick) {
        for index in 0..subject.materials.len() {
            let material = &subject.materials[index].0;
            report.progress(&format!("defaults: {}, {material}", subject.name));
            let reference = subject.run(index, true, REFERENCE_STEP, COMPARED);
            for step in STEPS {
                count += 1;
                let result = subject.run(index, false, step, COMPARED);
                let long = if is_quick {
                    Ok(None)
                } else {
                    subject.run(index, false, step, TIMED).map(Some)
                };
                let cells = match (result, long) {
                    (Ok(result), Ok(long)) => {
                        let error_text = match &reference {
                            Ok(reference) => {
                                let ratio = error(&result.positions, &reference.positions, &subject.mesh.positions);
                                format!("{:.2}", 100.0 * ratio)
                            }
                            Err(error) => format!("no reference: {error}"),
                        };
                        let time = long.map_or(result.step, |long| long.step);
                        [result.solver, milliseconds(time), error_text]
                    }
                    (Err(error), _) | (_, Err(error)) => {
                        refused.push(format!("{}, {material}, {:.2} ms", subject.name, 1e3 * step));
                        ["**refused**".into(), "-".into(), error.to_string()]
                    }
                };
                let nodes = subject.mesh.positions.len().to_string();
                let head = [
                    subject.name.clone(),
                    nodes,
                    material.clone(),
                    format!("{:.2}", 1e3 * step),
                ];
                table.row(head.into_iter().chain(cells).collect());
            }
        }
    }
    report.table(&table);
    let result = if refused.is_empty() {
        "none".to_owned()
    } else {
        refused.join("; ")
    };
    let share = refused.len() as f64 / f64::from(count);
    lines.error(
        "defaults that are refused",
        ["none".into(), format!("{result} of {count}")],
        share,
        0.0,
        "",
    );
}
