//! The tables and the settings of each engine, in Markdown.

use std::fmt::Write;

use crate::cloth::Cloth;
use crate::protocol::Report;
use crate::{Measured, Row};

/// Common and different settings.
const SETTINGS: &str = "\
All engines simulate the same cloth in single precision, from the same start, without damping, collisions or sleep. Each
runs in a separate process, in turns. A step's time is that of the engine's own step call, as the median over the steps
(and the 10th percentile, for a machine that also runs other programs).

- **sinew**: VERLET, automatic substeps (one, checked at every step); stability is monitored and every step can be
  refused or rolled back.
- **Taichi**: symplectic Euler over the grid's 8 neighbors, as in its mass-spring example, one kernel launch from Python per
  step; topology is compiled in, stability is not monitored.
- **Warp**: the same, two kernels recorded once and launched from Python; its kernels use one thread on a processor.
- **Rapier**: soft body of edges, one substep, its default of 4 sweeps over the constraints, frequency set from the same
  stiffness and masses, damping ratio 0; collisions off, thread pool of as many threads.
- **Bullet**: btSoftBody of links, 4 position iterations, which together move a single spring like an implicit step of the
  same stiffness; no collisions. One thread, as Debian builds it.

Stretch: length / rest length - 1 over the springs after one simulated second. The explicit engines solve the same
equations and should agree; Rapier and Bullet stop before a step has converged, which stretches the cloth or damps its
motion. Height: mean over the nodes, to check that all fell equally far. Body: resident memory beyond that before the cloth
was built, after some steps, including code that Taichi compiles. Process: peak memory of the whole process, including
Python and the cloth's input.
";

/// The complete report.
pub fn markdown(tables: &[(Cloth, Vec<Row>)], skipped: &[String]) -> String {
    let mut text = String::from("# The same cloth in sinew and its peers\n\n");
    let _ = writeln!(text, "Machine: {}\n", machine());
    if let Some((cloth, _)) = tables.first() {
        let _ = writeln!(
            text,
            "Cloth: a square grid with springs to all 8 neighbors, {} mm apart, {} g a node, {} N/m a spring, one edge \
             pinned, falling from the horizontal at {} m/s², {} ms a step.\n",
            cloth.spacing * 1e3,
            cloth.node_mass * 1e3,
            cloth.stiffness,
            cloth.gravity,
            cloth.step * 1e3
        );
    }
    for (cloth, rows) in tables {
        text += &table(cloth, rows);
    }
    if !skipped.is_empty() {
        text += "## Skipped\n\n";
        for reason in skipped {
            let _ = writeln!(text, "- {reason}");
        }
        text.push('\n');
    }
    text += "## Settings\n\n";
    text += SETTINGS;
    text
}

fn table(cloth: &Cloth, rows: &[Row]) -> String {
    let nodes = cloth.side * cloth.side;
    let mut text = format!(
        "## {0} x {0}, {nodes} nodes\n\n\
         | engine | threads | ms per step | a tenth below | steps timed | body, MB | process, MB | mean stretch | max stretch | height, m | finite |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
        cloth.side
    );
    for row in rows {
        let (name, threads) = (row.contender.name, row.contender.threads);
        match &row.result {
            Err(_) => {
                let why = if name == "sinew" { "not offered" } else { "skipped" };
                let _ = writeln!(text, "| {name} | {threads} | {why} | - | - | - | - | - | - | - | - |");
            }
            Ok(measured) => {
                let _ = writeln!(
                    text,
                    "| {name}, {} | {threads} | {} |",
                    measured.version,
                    cells(measured)
                );
            }
        }
    }
    text.push('\n');
    for (threads, peers) in [(1, "one thread"), (2, "one or two threads")] {
        let _ = writeln!(
            text,
            "Fastest peer on {peers} / sinew on {threads}: {}\n",
            ratio(rows, threads).unwrap_or_else(|| "-".into())
        );
    }
    text
}

fn cells(measured: &Measured) -> String {
    let Measured {
        milliseconds,
        fast_milliseconds,
        steps,
        whole_second,
        ..
    } = measured;
    let Report {
        body_bytes,
        peak_bytes,
        mean_stretch,
        max_stretch,
        mean_height,
    } = measured.report;
    let finite = if mean_stretch.is_some() { "yes" } else { "NO" };
    let megabytes = |bytes: Option<u64>| bytes.map_or("-".into(), |bytes| format!("{:.1}", bytes as f64 / 1e6));
    let at_one_second = |number: Option<f64>| match number {
        Some(number) if *whole_second => format!("{number:.3}"),
        _ => "-".into(),
    };
    [
        format!("{milliseconds:.3}"),
        format!("{fast_milliseconds:.3}"),
        steps.to_string(),
        megabytes(body_bytes),
        megabytes(peak_bytes),
        at_one_second(mean_stretch),
        at_one_second(max_stretch),
        at_one_second(mean_height),
        finite.into(),
    ]
    .join(" | ")
}

/// The time of the fastest other engine over sinew's, on at most `threads` threads.
fn ratio(rows: &[Row], threads: usize) -> Option<String> {
    let measured = |row: &Row| row.result.as_ref().ok().map(|measured| measured.milliseconds);
    let ours = rows
        .iter()
        .find(|row| row.contender.name == "sinew" && row.contender.threads == threads)
        .and_then(measured)?;
    let (name, theirs) = rows
        .iter()
        .filter(|row| row.contender.name != "sinew" && row.contender.threads <= threads)
        .filter_map(|row| Some((row.contender.name, measured(row)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(format!("**{:.2}** ({name})", theirs / ours))
}

/// The processor and the system, as Linux names them.
pub fn machine() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find_map(|line| line.strip_prefix("model name"));
    let model = model.map_or("unknown processor", |line| line.trim_start_matches([' ', '\t', ':']));
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    format!(
        "{model}, {cores} cores, {} {}",
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}
