//! Diagrams of error against time, as SVG.

use std::fmt::Write;

use crate::precision::tables::is_timed;
use crate::precision::{EngineOutcome, Outcome, Point};

/// Ranges of both axes, as powers of ten.
const SECONDS: [i32; 2] = [-3, 2];
const ERRORS: [i32; 2] = [-5, 0];

/// The position of a diagram in an image.
struct Panel {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Panel {
    fn x(&self, seconds: f64) -> f64 {
        let [low, high] = SECONDS.map(f64::from);
        self.left + self.width * (seconds.log10().clamp(low, high) - low) / (high - low)
    }

    fn y(&self, error: f64) -> f64 {
        let [low, high] = ERRORS.map(f64::from);
        self.top + self.height * (1.0 - (error.log10().clamp(low, high) - low) / (high - low))
    }

    fn frame(&self, title: &str) -> String {
        let Self {
            left,
            top,
            width,
            height,
        } = *self;
        let mut text = format!(
            "<text x='{}' y='{}' font-weight='bold'>{title}</text>\n\
             <rect x='{left}' y='{top}' width='{width}' height='{height}' fill='none' stroke='#888'/>\n",
            left,
            top - 8.0
        );
        for power in SECONDS[0]..=SECONDS[1] {
            let x = self.x(10f64.powi(power));
            let _ = writeln!(
                text,
                "<line x1='{x:.1}' x2='{x:.1}' y1='{top}' y2='{0}' stroke='#ddd'/><text x='{x:.1}' y='{1}' \
                 text-anchor='middle'>{2}</text>",
                top + height,
                top + height + 14.0,
                plain(power)
            );
        }
        for power in ERRORS[0]..=ERRORS[1] {
            let y = self.y(10f64.powi(power));
            let _ = writeln!(
                text,
                "<line x1='{left}' x2='{0}' y1='{y:.1}' y2='{y:.1}' stroke='#ddd'/><text x='{1}' y='{2:.1}' \
                 text-anchor='end'>{3} %</text>",
                left + width,
                left - 4.0,
                y + 4.0,
                plain(power + 2)
            );
        }
        text
    }

    fn line<'a>(&self, points: impl Iterator<Item = &'a Point> + Clone, color: &str, dashes: &str) -> String {
        let mut text =
            format!("<polyline fill='none' stroke='{color}' stroke-width='1.5' stroke-dasharray='{dashes}' points='");
        for point in points.clone() {
            let _ = write!(text, "{:.1},{:.1} ", self.x(point.seconds), self.y(point.error));
        }
        text += "'/>\n";
        for point in points {
            let (x, y) = (self.x(point.seconds), self.y(point.error));
            let _ = writeln!(text, "<circle cx='{x:.1}' cy='{y:.1}' r='2.2' fill='{color}'/>");
        }
        text
    }
}

fn plain(power: i32) -> String {
    match power {
        0.. => format!("{}", 10f64.powi(power)),
        _ => format!("{:.*}", power.unsigned_abs() as usize, 10f64.powi(power)),
    }
}

fn picture(width: f64, height: f64, body: &str) -> String {
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' width='{width}' height='{height}' \
         font-family='sans-serif' font-size='11' fill='#222'>\n<rect width='100%' height='100%' fill='white' stroke='none'/>\n\
         {body}</svg>\n"
    )
}

/// True if a point is in the image; the error of others exceeds the motion of the body.
fn is_shown(point: &Point) -> bool {
    point.error <= 10f64.powi(ERRORS[1])
}

/// The points of an engine that are Pareto-optimal in time and error, by time.
fn best(engine: &EngineOutcome) -> Vec<&Point> {
    let points = engine.lines.iter().flatten().flat_map(|line| &line.points);
    let mut points: Vec<&Point> = points.filter(|point| is_shown(point)).collect();
    points.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut least = f64::INFINITY;
    points.retain(|point| {
        let is_better = point.error < least;
        least = least.min(point.error);
        is_better
    });
    points
}

/// The best points of every engine in every scene.
pub fn overview(outcomes: &[Outcome]) -> String {
    let timed: Vec<&Outcome> = outcomes.iter().filter(|outcome| is_timed(outcome)).collect();
    let rows = timed.len().div_ceil(3).max(1) as f64;
    let mut body = String::new();
    for (index, outcome) in timed.iter().enumerate() {
        let panel = Panel {
            left: 58.0 + 300.0 * (index % 3) as f64,
            top: 30.0 + 240.0 * (index / 3) as f64,
            width: 230.0,
            height: 180.0,
        };
        body += &panel.frame(outcome.scene.name);
        // sinew is drawn last, on top.
        for engine in outcome.engines.iter().rev() {
            body += &panel.line(best(engine).into_iter(), engine.color, "");
        }
    }
    let bottom = 240.0 * rows + 22.0;
    let mut left = 58.0;
    for engine in timed.first().iter().flat_map(|outcome| &outcome.engines) {
        let _ = writeln!(
            body,
            "<rect x='{left}' y='{}' width='12' height='12' fill='{}'/><text x='{}' y='{}'>{}</text>",
            bottom - 10.0,
            engine.color,
            left + 17.0,
            bottom,
            engine.name
        );
        left += 40.0 + 7.0 * engine.name.len() as f64;
    }
    let _ = writeln!(
        body,
        "<text x='58' y='{}'>Across: seconds of one thread for a simulated second. Up: error, of the motion.</text>",
        bottom + 20.0
    );
    picture(910.0, bottom + 34.0, &body)
}

/// Every line in one scene.
pub fn scene(outcome: &Outcome) -> String {
    const DASHES: [&str; 5] = ["", "6 3", "2 3", "8 3 2 3", "1 5"];
    let panel = Panel {
        left: 60.0,
        top: 30.0,
        width: 520.0,
        height: 420.0,
    };
    let mut body = panel.frame(outcome.scene.name);
    let mut y = 40.0;
    for engine in &outcome.engines {
        for (number, line) in engine.lines.iter().flatten().enumerate() {
            let dashes = DASHES[number % DASHES.len()];
            body += &panel.line(line.points.iter().filter(|point| is_shown(point)), engine.color, dashes);
            let _ = writeln!(
                body,
                "<line x1='600' x2='630' y1='{0}' y2='{0}' stroke='{1}' stroke-width='2' stroke-dasharray='{dashes}'/>\
                 <text x='636' y='{2}'>{3}: {4}</text>",
                y - 4.0,
                engine.color,
                y,
                engine.name,
                line.name.replace('`', "")
            );
            y += 16.0;
        }
    }
    let _ = writeln!(
        body,
        "<text x='60' y='490'>Across: seconds of one thread for a simulated second. Up: error, of the motion.</text>"
    );
    picture(940.0, f64::max(500.0, y), &body)
}
