//! Experiment C: the cost of optional features of a body's definition.

use sinew::{BodyDefinition, Values};

use crate::bodies::{Setup, Stepped};
use crate::heap;
use crate::random::Random;
use crate::report::{Report, Table, count, digits, megabytes, milliseconds};
use crate::rounds::{Contender, Effort, interleave};
use crate::scenes::{MASS, STIFFNESS, Scene};

const SUBSTEPS: u32 = 4;

const PLAIN: &str = "nothing more";

/// A modification of the plain definition.
type Change<'a> = Box<dyn Fn(BodyDefinition<'a>) -> BodyDefinition<'a> + 'a>;

pub fn run(report: &mut Report, effort: Effort) {
    let nodes = if effort.quick { 100_000 } else { 1_000_000 };
    report.write(&format!(
        "\n## C. Model only what a scene needs\n\nThe sheet of {} nodes in PACKED, one thread, the substep of a step of \
         {SUBSTEPS} substeps. Bytes of the springs as the storage reports them, and of the whole body as the \
         allocator reports them.\n",
        count(nodes)
    ));
    let scene = Scene::grid(nodes);
    let mut random = Random(7);
    let mut vary =
        |value: f32, count: usize| -> Vec<f32> { (0..count).map(|_| value * (1.0 + 0.1 * random.signed())).collect() };
    let masses = vary(MASS, scene.positions.len());
    let stiffnesses = vary(STIFFNESS, scene.springs.len());
    let rest_lengths: Vec<f32> = scene
        .springs
        .iter()
        .zip(vary(1.0, scene.springs.len()))
        .map(|(&pair, factor)| scene.rest_length(pair) * factor)
        .collect();
    let dampings = vary(1e-4, scene.positions.len());
    let variants: Vec<(&str, Change)> = vec![
        (PLAIN, Box::new(|plain| plain)),
        (
            "a mass of its own for each node",
            Box::new(|plain| BodyDefinition {
                masses: Values::Each(&masses),
                ..plain
            }),
        ),
        (
            "node damping",
            Box::new(|plain| BodyDefinition {
                node_dampings: Values::Uniform(1e-4),
                ..plain
            }),
        ),
        (
            "node damping of its own for each node",
            Box::new(|plain| BodyDefinition {
                node_dampings: Values::Each(&dampings),
                ..plain
            }),
        ),
        (
            "spring damping",
            Box::new(|plain| BodyDefinition {
                spring_dampings: Values::Uniform(1e-3),
                ..plain
            }),
        ),
        (
            "a stiffness of its own for each spring",
            Box::new(|plain| BodyDefinition {
                stiffnesses: Values::Each(&stiffnesses),
                ..plain
            }),
        ),
        (
            "a rest length of its own for each spring",
            Box::new(|plain| BodyDefinition {
                rest_lengths: Some(&rest_lengths),
                ..plain
            }),
        ),
        (
            "stiffness and rest length of its own for each spring",
            Box::new(|plain| BodyDefinition {
                stiffnesses: Values::Each(&stiffnesses),
                rest_lengths: Some(&rest_lengths),
                ..plain
            }),
        ),
    ];
    report.progress("C: bodies");
    let setup = Setup {
        substeps: SUBSTEPS,
        ..Setup::default()
    };
    let mut contenders = Vec::new();
    let mut bytes = Vec::new();
    for (name, change) in &variants {
        heap::trim();
        let before = heap::allocated();
        match Stepped::with(&scene, setup, change) {
            Ok(mut body) => {
                let body_bytes = heap::allocated()
                    .zip(before)
                    .map(|(after, before)| after.saturating_sub(before));
                bytes.push((*name, body.storage_report().bytes_used, body_bytes));
                contenders.push(Contender::new(*name, 1, move |steps| body.step(steps)));
            }
            Err(reason) => report.not_offered(name, &reason),
        }
    }
    report.progress("C: steps");
    let results = interleave(contenders, effort);
    report.disturbed(results.waited);
    let mut table = Table::new(&["asked for", "substep, ms", "of plain", "springs, MB", "body, MB"]);
    for (name, springs, body_bytes) in bytes {
        let (Some(samples), Some(plain)) = (results.get(name), results.get(PLAIN)) else {
            continue;
        };
        table.row(vec![
            name.to_owned(),
            milliseconds(samples.minimum() / f64::from(SUBSTEPS)),
            digits(samples.ratio(plain)),
            megabytes(springs),
            body_bytes.map_or("-".into(), megabytes),
        ]);
    }
    report.table(&table);
}
