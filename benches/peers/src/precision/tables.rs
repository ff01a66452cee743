//! The report in Markdown, and every point in CSV.

use std::fmt::Write;

use crate::precision::summary::{Need, TARGETS, need, number};
use crate::precision::{End, LineOutcome, Outcome, Point, sofa};
use crate::report::machine;
use crate::scenes::Measure;

/// Conditions that are the same for all engines.
const METHOD: &str = "\
Every engine gets the same nodes, masses, tetrahedra or springs, material and gravity, and simulates frames of 1/60 s. Each
run is a separate process on one thread. Time is the processor time of stepping only. The reference is independent of the
engines: leapfrog in double precision, with its step halved until the motion converges. Each law of elasticity has its own
reference, so that an engine is compared with its own law. Error is the RMS distance of the nodes from the reference over
all frames, divided by the RMS displacement; at rest it is that of the last frame. A line ends at an error of 0.03 %, if two
halvings of the step change little, or if a point would exceed the time limit.
";

/// True if a scene has errors against time: it is neither a check nor a contact scene.
pub fn is_timed(outcome: &Outcome) -> bool {
    matches!(outcome.scene.measure, Measure::Motion | Measure::Rest)
}

/// The complete report.
pub fn markdown(outcomes: &[Outcome], notes: &[(&str, &str)], beams: &[sofa::Row]) -> String {
    let mut text = format!("# Engines: error against time\n\nMachine: {}.\n\n{METHOD}\n", machine());
    text +=
        "## Summary\n\nSeconds of one thread for a simulated second, for an error of at most 10 % / 1 % / 0.1 %.\n\n";
    text += &summary(outcomes);
    text += &checked(outcomes);
    for outcome in outcomes.iter().filter(|outcome| is_timed(outcome)) {
        text += &scene(outcome);
    }
    for outcome in outcomes
        .iter()
        .filter(|outcome| matches!(outcome.scene.measure, Measure::Contact { .. }))
    {
        text += &contact(outcome);
    }
    text += &sofa::markdown(beams);
    text += "## Engines\n\n";
    for (name, note) in notes {
        let _ = writeln!(text, "- **{name}**: {note}");
    }
    text
}

/// The time of each engine in each scene; the smallest is bold.
fn summary(outcomes: &[Outcome]) -> String {
    let timed: Vec<&Outcome> = outcomes.iter().filter(|outcome| is_timed(outcome)).collect();
    let Some(first) = timed.first() else {
        return String::new();
    };
    let mut text = String::from("| |");
    for outcome in &timed {
        let _ = write!(text, " {} |", outcome.scene.name);
    }
    text += "\n|---|";
    text += &"---|".repeat(timed.len());
    text.push('\n');
    for (row, engine) in first.engines.iter().enumerate() {
        let _ = write!(text, "| {} |", engine.name);
        for outcome in &timed {
            let cells = TARGETS.map(|target| cell(outcome, row, target));
            let alike = cells.iter().all(|cell| *cell == cells[0]);
            let cell = if alike { cells[0].clone() } else { cells.join(" / ") };
            let _ = write!(text, " {cell} |");
        }
        text.push('\n');
    }
    text.push('\n');
    text
}

fn cell(outcome: &Outcome, row: usize, target: f64) -> String {
    let needs: Vec<Need> = outcome.engines.iter().map(|engine| need(engine, target)).collect();
    let seconds = |need: &Need| match need {
        Need::Seconds(seconds) => *seconds,
        _ => f64::INFINITY,
    };
    let best = needs.iter().map(seconds).fold(f64::INFINITY, f64::min);
    match needs[row] {
        Need::Seconds(seconds) if seconds == best => format!("**{}**", number(seconds)),
        ref other => other.text(),
    }
}

/// Free fall, a check that players pass before their times are meaningful.
fn checked(outcomes: &[Outcome]) -> String {
    let mut text = String::from("## Checks\n\nThe least error of each engine in free fall.\n\n");
    for outcome in outcomes
        .iter()
        .filter(|outcome| outcome.scene.measure == Measure::Check)
    {
        let least = outcome.engines.iter().map(|engine| {
            let points = engine.lines.iter().flatten().flat_map(|line| &line.points);
            match points.map(|point| point.error).min_by(f64::total_cmp) {
                Some(error) => format!("{} {error:.1e}", engine.name),
                None => format!("{} -", engine.name),
            }
        });
        let _ = writeln!(
            text,
            "- {}: {}",
            outcome.scene.about,
            least.collect::<Vec<_>>().join(", ")
        );
    }
    text.push('\n');
    text
}

fn scene(outcome: &Outcome) -> String {
    let mut text = format!("## {}\n\n{}.\n\n", outcome.scene.name, outcome.scene.about);
    let model = &outcome.scene.model;
    let _ = writeln!(
        text,
        "{} nodes, {} tetrahedra, {} springs, {} frames{}.\n",
        model.positions.len(),
        model.tetrahedra.len(),
        model.springs.len(),
        model.frames,
        if outcome.scene.measure == Measure::Rest {
            ", error of the last"
        } else {
            ""
        }
    );
    for (law, doubt, substeps) in &outcome.references {
        let _ = writeln!(
            text,
            "- reference, {}: {substeps} substeps a frame; half as many change it by {doubt:.0e} of the motion",
            law.name()
        );
    }
    if let Some(ratio) = outcome.theory {
        let _ = writeln!(
            text,
            "- the end of the reference at rest sinks {ratio:.3} times as far as a Timoshenko beam: linear tetrahedra, four cells \
             thick, are too stiff in bending by this factor"
        );
    }
    text += "\n| engine | line | law | points: s / error | end |\n|---|---|---|---|---|\n";
    for engine in &outcome.engines {
        match &engine.lines {
            Err(reason) => {
                let _ = writeln!(text, "| {} | | | | not simulated: {reason} |", engine.name);
            }
            Ok(lines) => {
                for line in lines {
                    let name = match &engine.version {
                        Some(version) => format!("{} ({version})", engine.name),
                        None => engine.name.into(),
                    };
                    let _ = writeln!(
                        text,
                        "| {name} | {} | {} | {} | {} |",
                        line.name,
                        line.law.name(),
                        points(line),
                        end(&line.end)
                    );
                }
            }
        }
    }
    text.push('\n');
    for engine in &outcome.engines {
        for note in engine.notes.iter().take(12) {
            let _ = writeln!(text, "- {}: {note}", engine.name);
        }
    }
    text.push('\n');
    text
}

/// Time and penetration.
fn contact(outcome: &Outcome) -> String {
    let Measure::Contact { size } = outcome.scene.measure else {
        return String::new();
    };
    let mut text = format!(
        "## {}\n\n{}. A line ends when no node is in an obstacle at the end of any frame. Energy: a lower bound of the increase since the start, \
         relative to the loss of potential energy. Speed: of the last ten frames. The mean height at the end shows whether all \
         fell equally far.\n\n| engine | line | settings | s | deepest, mm | energy, % | speed, mm/s | height, mm |\n|---|---|---|---|---|---|---|---|\n",
        outcome.scene.name, outcome.scene.about
    );
    for engine in &outcome.engines {
        if let Err(reason) = &engine.lines {
            let _ = writeln!(text, "| {} | | not simulated: {reason} | | | | | |", engine.name);
        }
        for line in engine.lines.iter().flatten() {
            if line.points.is_empty() {
                let _ = writeln!(
                    text,
                    "| {} | {} | {} | | | | | |",
                    engine.name,
                    line.name,
                    end(&line.end)
                );
            }
            for point in &line.points {
                let _ = writeln!(
                    text,
                    "| {} | {} | {} | {} | {:.3} | {:.1} | {:.1} | {:.1} |",
                    engine.name,
                    line.name,
                    point.settings,
                    number(point.seconds),
                    1e3 * size * point.error,
                    1e2 * point.gain,
                    1e3 * point.speed,
                    1e3 * point.height
                );
            }
        }
    }
    text.push('\n');
    text
}

fn points(line: &LineOutcome) -> String {
    let point = |point: &Point| format!("{} / {:.1e}", number(point.seconds), point.error);
    line.points.iter().map(point).collect::<Vec<_>>().join(", ")
}

fn end(end: &End) -> String {
    match end {
        End::Reached => "within 0.03 %".into(),
        End::Flat => "flat".into(),
        End::Limit(seconds) => format!("limit: the next takes {} s", number(*seconds)),
        End::Tried => "all tried".into(),
        End::Failed(reason) => format!("failed: {reason}"),
    }
}

/// Every point.
pub fn csv(outcomes: &[Outcome]) -> String {
    let mut text = String::from("scene,engine,line,law,settings,seconds,error\n");
    for outcome in outcomes {
        for engine in &outcome.engines {
            for line in engine.lines.iter().flatten() {
                for point in &line.points {
                    let _ = writeln!(
                        text,
                        "{},{},\"{}\",{},{},{},{}",
                        outcome.scene.name,
                        engine.name,
                        line.name,
                        line.law.name(),
                        point.settings,
                        point.seconds,
                        point.error
                    );
                }
            }
        }
    }
    text
}
