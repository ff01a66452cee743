//! A plot over time with linear axes: measurements as dots, simulations as lines.

use std::fmt::Write;

pub struct Curve {
    pub name: String,
    pub color: &'static str,
    pub points: Vec<(f64, f64)>,
    pub is_dotted: bool,
}

const WIDTH: f64 = 980.0;
const HEIGHT: f64 = 480.0;
/// Left, right, top, bottom.
const FRAME: [f64; 4] = [80.0, 720.0, 50.0, 420.0];

pub fn plot(title: &str, [x_label, y_label]: [&str; 2], curves: &[Curve]) -> String {
    let [left, right, top, bottom] = FRAME;
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let end = points().map(|point| point.0).fold(0.0, f64::max);
    let low = points().map(|point| point.1).fold(0.0, f64::min);
    let high = points().map(|point| point.1).fold(0.0, f64::max) * 1.05;
    let x = |value: f64| left + (right - left) * value / end;
    let y = |value: f64| bottom - (bottom - top) * (value - low) / (high - low);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\" \
         fill=\"#222\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n<text x=\"{left}\" y=\"28\" font-size=\"17\" \
         font-weight=\"bold\">{title}</text>\n"
    );
    // At most about five marks per axis, at whole tenths of the time and whole units of the other axis.
    let step = (high / 5.0).ceil().max(1.0);
    for mark in (0..).map(|index| index as f64 * step).take_while(|&mark| mark <= high) {
        let at = y(mark);
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#e3e3e3\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{mark}</text>",
            left - 8.0,
            at + 4.5
        );
    }
    let step = (end * 2.0).ceil() / 10.0;
    for mark in (0..)
        .map(|index| f64::from(index) * step)
        .take_while(|&mark| mark <= end)
    {
        let at = x(mark);
        let _ = writeln!(
            svg,
            "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#e3e3e3\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{mark:.1}</text>",
            bottom + 20.0
        );
    }
    for (index, curve) in curves.iter().enumerate() {
        let legend = top + 12.0 + 22.0 * index as f64;
        let pixels = curve.points.iter().map(|&(at, value)| (x(at), y(value)));
        if curve.is_dotted {
            for (at, value) in pixels {
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{at:.1}\" cy=\"{value:.1}\" r=\"1.8\" fill=\"{}\"/>",
                    curve.color
                );
            }
            let _ = writeln!(
                svg,
                "<circle cx=\"{}\" cy=\"{legend}\" r=\"3\" fill=\"{}\"/>",
                right + 29.0,
                curve.color
            );
        } else {
            let line: Vec<String> = pixels.map(|(at, value)| format!("{at:.1},{value:.1}")).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/><path d=\"M{} {legend}h26\" stroke=\"{}\" \
                 stroke-width=\"2.4\"/>",
                line.join(" "),
                curve.color,
                right + 16.0,
                curve.color
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\">{}</text>",
            right + 50.0,
            legend + 4.5,
            curve.name
        );
    }
    let _ = writeln!(
        svg,
        "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"#444\"/>\n<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{x_label}</text>\n\
         <text transform=\"translate(22 {}) rotate(-90)\" text-anchor=\"middle\">{y_label}</text>\n</svg>",
        (left + right) / 2.0,
        bottom + 44.0,
        (top + bottom) / 2.0
    );
    svg
}
