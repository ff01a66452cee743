//! A plot with logarithmic axes.

use std::fmt::Write;

/// A line of a plot.
pub struct Series {
    pub name: String,
    /// Positive coordinates.
    pub points: Vec<(f64, f64)>,
    /// For limits and other values that are not measured.
    pub dashed: bool,
}

const COLORS: [&str; 12] = [
    "#1f6fb4", "#d1495b", "#2e8b57", "#8e5ea2", "#e08e2b", "#3aa6a6", "#7a5c3e", "#c2569b", "#6b7280", "#9aa52c",
    "#12355b", "#f08080",
];
const WIDTH: f64 = 980.0;
const HEIGHT: f64 = 520.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 670.0;
const TOP: f64 = 50.0;
const BOTTOM: f64 = 460.0;

/// One axis: its range in decades and its position in the image.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// An axis over all values, with a margin at both ends.
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        Self {
            low: low.log10() - 0.08,
            high: high.log10() + 0.08,
            from,
            to,
        }
    }

    fn position(&self, value: f64) -> f64 {
        self.from + (self.to - self.from) * (value.log10() - self.low) / (self.high - self.low)
    }

    /// Tick values: 1, 2 and 5 of each decade, or 1 only for many decades.
    fn ticks(&self) -> Vec<f64> {
        let steps: &[f64] = if self.high - self.low > 3.5 {
            &[1.0]
        } else {
            &[1.0, 2.0, 5.0]
        };
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let values = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
        let is_visible = |value: &f64| (self.low..=self.high).contains(&value.log10());
        values.filter(is_visible).collect()
    }
}

/// Draws the plot, with a legend in the order of the lines at their right ends. Series without points are listed below
/// it.
pub fn plot(title: &str, x_label: &str, y_label: &str, series: &[Series]) -> String {
    let (series, missing): (Vec<&Series>, Vec<&Series>) = series.iter().partition(|series| !series.points.is_empty());
    let points = || series.iter().flat_map(|series| &series.points);
    let mut svg = String::new();
    let _ = writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"#222\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"28\" font-size=\"17\" font-weight=\"bold\">{}</text>",
        escaped(title)
    );
    if points().next().is_some() {
        let x = Axis::over(points().map(|point| point.0), LEFT, RIGHT);
        let y = Axis::over(points().map(|point| point.1), BOTTOM, TOP);
        grid(&mut svg, &x, &y);
        let mut order: Vec<usize> = (0..series.len()).collect();
        let end = |index: &usize| series[*index].points.last().map_or(0.0, |point| point.1);
        order.sort_by(|a, b| end(b).total_cmp(&end(a)));
        for (row, &index) in order.iter().enumerate() {
            let legend = TOP + 12.0 + 22.0 * row as f64;
            line(&mut svg, series[index], COLORS[index % COLORS.len()], &x, &y, legend);
        }
    }
    for (row, missing) in (series.len()..).zip(missing) {
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" fill=\"#888\">{}</text>",
            RIGHT + 50.0,
            TOP + 16.5 + 22.0 * row as f64,
            escaped(&missing.name)
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
         <text transform=\"translate(22 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</svg>",
        (LEFT + RIGHT) / 2.0,
        BOTTOM + 44.0,
        escaped(x_label),
        (TOP + BOTTOM) / 2.0,
        escaped(y_label)
    );
    svg
}

fn grid(svg: &mut String, x: &Axis, y: &Axis) {
    for value in x.ticks() {
        let position = x.position(value);
        let _ = writeln!(
            svg,
            "<path d=\"M{position:.1} {TOP}V{BOTTOM}\" stroke=\"#e3e3e3\"/>\
             <text x=\"{position:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            BOTTOM + 20.0,
            tick(value)
        );
    }
    for value in y.ticks() {
        let position = y.position(value);
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {position:.1}H{RIGHT}\" stroke=\"#e3e3e3\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 8.0,
            position + 4.5,
            tick(value)
        );
    }
    let _ = writeln!(
        svg,
        "<path d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\" fill=\"none\" stroke=\"#444\"/>"
    );
}

fn line(svg: &mut String, series: &Series, color: &str, x: &Axis, y: &Axis, legend: f64) {
    let dashes = if series.dashed { " stroke-dasharray=\"7 5\"" } else { "" };
    let points_text: Vec<String> = series
        .points
        .iter()
        .map(|&(nodes, time)| format!("{:.1},{:.1}", x.position(nodes), y.position(time)))
        .collect();
    let _ = writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2.2\"{dashes}/>",
        points_text.join(" ")
    );
    for point in &points_text {
        let (x, y) = point.split_once(',').unwrap_or_default();
        let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"3.2\" fill=\"{color}\"/>");
    }
    let start = RIGHT + 16.0;
    let _ = writeln!(
        svg,
        "<path d=\"M{start} {legend}h26\" stroke=\"{color}\" stroke-width=\"2.6\"{dashes}/>\
         <text x=\"{}\" y=\"{}\">{}</text>",
        start + 34.0,
        legend + 4.5,
        escaped(&series.name)
    );
}

/// A number on an axis, without superfluous digits.
fn tick(value: f64) -> String {
    match value {
        value if value >= 999_999.0 => format!("{:.0}M", value * 1e-6),
        value if value >= 999.0 => format!("{:.0}K", value * 1e-3),
        value if value >= 9.99 => format!("{value:.0}"),
        value if value < 9.99e-4 => format!("{value:.0e}"),
        value => format!("{value:.6}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned(),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
