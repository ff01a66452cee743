//! Distance queries of a rigid tool that is built, rendered or sampled once.

use glam::Vec3;
use sinew::detection::distance_field::DistanceField;
use sinew::detection::exact::Exact;
use sinew::detection::image_space::LayeredImage;

use crate::claims::Claims;
use crate::clock;
use crate::errors::{Errors, exact, near};
use crate::report::{Report, Table, count, digits, milliseconds};
use crate::rounds::{Contender, Effort, interleave};
use crate::scene::{SIZE, Scene};
use crate::svg::{Series, plot};
use crate::truth::Truth;

/// The largest distance outside a tool that a query reports [m].
const WITHIN: f32 = 0.05 * SIZE;

/// Number of query points per pair, and of those that are checked. Large tools check fewer.
const QUERIES: usize = 20_000;
const CHECKED: usize = 150_000_000;

/// Pixels or cells along the ring.
const PIXELS: [u32; 3] = [64, 128, 256];
const CELLS: [u32; 3] = [32, 64, 128];

/// Larger tools skip the finest field, which takes long to sample.
const LARGE: usize = 50_000;

/// The index of the ring that is the tool: the one of 0.8 times the size.
const TOOL: usize = 1;

/// Tolerances near the surface: the range in which contact queries distances [m], and errors in pixels or cells.
const NEAR: f64 = 1e-3;
const IMAGE_TOLERANCE: f64 = 0.5;
const FIELD_TOLERANCE: f64 = 0.5;

/// A tool in one of its representations.
enum Tool {
    Exact(Box<Exact>),
    Image(Box<LayeredImage>),
    Field(DistanceField),
}

impl Tool {
    /// Signed distance [m], negative inside; `None` if the point is outside and further than `WITHIN`.
    fn distance(&self, point: Vec3) -> Option<f32> {
        match self {
            Self::Exact(solid) => solid.distance(point, WITHIN).map(|nearest| nearest.0),
            Self::Image(image) => image.distance(point, WITHIN).map(|nearest| nearest.0),
            Self::Field(field) => Some(field.distance(point)).filter(|distance| *distance <= WITHIN),
        }
    }
}

struct BuiltTool {
    name: String,
    kind: &'static str,
    tool: Tool,
    /// Time to build it [s].
    time: f64,
    /// Size of a pixel or cell, relative to the size.
    cell: f64,
    /// Allowed distance error, in pixels or cells.
    tolerance: f64,
}

struct Row {
    triangles: usize,
    name: String,
    kind: &'static str,
    making: f64,
    /// Time of one query [s].
    query: f64,
    /// Errors close to the surface, and further from it.
    errors: Errors,
    far: Errors,
    allowed: f64,
}

pub fn run(report: &mut Report, claims: &mut Claims, sizes: &[usize], effort: Effort) {
    report.write(&format!(
        "\n## A rigid tool\n\nThe ring {} mm wide, built once and then queried for the signed distance of the tissue's nodes and of points \
         around its surface, up to {} mm away outside and at any depth: pixels and cells relative to its width, errors relative to {} mm, within {} mm of \
         the surface and further from it. These are the queries of contact with a mesh tool.\n",
        digits(800.0 * f64::from(SIZE)),
        digits(1e3 * f64::from(WITHIN)),
        digits(1e3 * f64::from(SIZE)),
        digits(1e3 * NEAR),
    ));
    let mut rows = Vec::new();
    for &triangles in sizes {
        let scene = Scene::new(triangles);
        report.progress(&format!("a tool of {} triangles", scene.triangle_count()));
        measure(report, &scene, effort, &mut rows);
    }
    write(report, &rows);
    for row in &rows {
        let worst = row
            .errors
            .worst_depth
            .max(row.errors.deepest_missed)
            .max(row.errors.furthest_false);
        claims.at_most(
            format!(
                "a tool of {} triangles, {}: the worst error of a distance close by, or of a side",
                count(row.triangles),
                row.name
            ),
            worst,
            row.allowed,
        );
    }
}

fn measure(report: &mut Report, scene: &Scene, effort: Effort, rows: &mut Vec<Row>) {
    let pair = &scene.pairs[TOOL];
    let points = points(scene);
    let truth = Truth::new(&pair.ring.positions, &pair.ring.triangles);
    let checked = (CHECKED / pair.ring.triangles.len()).clamp(300, 3000).min(points.len());
    // Evenly spaced among all points.
    let checked: Vec<usize> = (0..checked).map(|index| index * points.len() / checked).collect();
    let queries: Vec<Vec3> = checked.iter().map(|&index| points[index]).collect();
    let distances: Vec<f64> = exact(&queries).map(|point| truth.signed_distance(point)).collect();
    let built = make(scene);
    let contenders = built.iter().map(|built| {
        Contender::new(built.name.clone(), 1, |units| {
            for point in points.iter().cycle().take(units * points.len()) {
                std::hint::black_box(built.tool.distance(*point));
            }
        })
    });
    let results = interleave(contenders.collect(), effort);
    report.disturbed(results.waited);
    for built in &built {
        let (mut errors, mut far) = (Errors::default(), Errors::default());
        for (point, &distance) in queries.iter().zip(&distances) {
            let reported = built.tool.distance(*point);
            errors.record(distance, reported.is_some_and(|reported| reported < 0.0));
            if let Some(reported) = reported {
                let errors = if distance.abs() < NEAR { &mut errors } else { &mut far };
                errors.record_depth(f64::from(reported) - distance);
            }
        }
        let time = results.get(&built.name).map_or(f64::NAN, |samples| samples.minimum());
        rows.push(Row {
            triangles: pair.ring.triangles.len(),
            name: built.name.clone(),
            kind: built.kind,
            making: built.time,
            query: time / points.len() as f64,
            errors,
            far,
            // With a margin for `f32`.
            allowed: built.tolerance * built.cell + 2e-6,
        });
    }
}

/// The tissue's nodes near the ring and as many points near the ring's own surface, inside and outside.
fn points(scene: &Scene) -> Vec<Vec3> {
    let pair = &scene.pairs[TOOL];
    let thinned = |points: Vec<Vec3>| -> Vec<Vec3> {
        let step = points.len().div_ceil(QUERIES / 2);
        points.into_iter().step_by(step).collect()
    };
    let mut points = thinned(near(&pair.positions, &pair.ring.positions, WITHIN));
    let mut random = crate::random::Random(8);
    let mut random_offset = || Vec3::new(random.signed(), random.signed(), random.signed()) * WITHIN;
    points.extend(
        thinned(pair.ring.positions.clone())
            .into_iter()
            .map(|point| point + random_offset()),
    );
    points
}

fn make(scene: &Scene) -> Vec<BuiltTool> {
    let ring = &scene.pairs[TOOL].ring;
    let width = 0.8 * SIZE;
    let surface = ring.checked();
    let mut all = Vec::new();
    let mut add = |name: String, kind, cell: f64, tolerance, make: &dyn Fn() -> Tool| {
        let mut tool = None;
        let time = clock::time(|| tool = Some(make())).processor;
        let tool = tool.expect("a tool");
        all.push(BuiltTool {
            name,
            kind,
            tool,
            time,
            cell: 0.8 * cell,
            tolerance,
        });
    };
    add("EXACT".into(), "EXACT", 0.0, 0.0, &|| {
        Tool::Exact(Box::new(Exact::new(&surface).expect("a solid")))
    });
    for pixels in PIXELS {
        let name = format!("IMAGE_SPACE, 1/{pixels}");
        add(name, "IMAGE_SPACE", 1.0 / f64::from(pixels), IMAGE_TOLERANCE, &|| {
            let pixel = width / pixels as f32;
            Tool::Image(Box::new(
                LayeredImage::new(&ring.positions, &ring.triangles, pixel).expect("an image"),
            ))
        });
    }
    let few = if ring.triangles.len() > LARGE { 2 } else { CELLS.len() };
    for &cells in &CELLS[..few] {
        let name = format!("DISTANCE_FIELD, 1/{cells}");
        add(name, "DISTANCE_FIELD", 1.0 / f64::from(cells), FIELD_TOLERANCE, &|| {
            Tool::Field(DistanceField::new(&surface, width / cells as f32).expect("a field"))
        });
    }
    all
}

fn write(report: &mut Report, rows: &[Row]) {
    let mut table = Table::new(&[
        "triangles",
        "way",
        "made in ms",
        "ns a query",
        "missed %",
        "false %",
        "RMS close by",
        "worst",
        "RMS further off",
        "worst",
    ]);
    for row in rows {
        let errors = &row.errors;
        table.row(vec![
            count(row.triangles),
            row.name.clone(),
            milliseconds(row.making),
            digits(1e9 * row.query),
            digits(100.0 * errors.missed()),
            digits(100.0 * errors.false_ones()),
            format!("{:.1e}", errors.depth().unwrap_or(f64::NAN)),
            format!("{:.1e}", errors.worst_depth),
            format!("{:.1e}", row.far.depth().unwrap_or(f64::NAN)),
            format!("{:.1e}", row.far.worst_depth),
        ]);
    }
    report.table(&table);
    let largest = rows.last().map_or(0, |row| row.triangles);
    let lines = ["EXACT", "IMAGE_SPACE", "DISTANCE_FIELD"].map(|kind| Series {
        name: kind.into(),
        points: rows
            .iter()
            .filter(|row| row.kind == kind && row.triangles == largest)
            .filter_map(|row| Some((1e9 * row.query, row.errors.depth()?)))
            .filter(|point| point.1 > 0.0)
            .collect(),
        dashed: false,
    });
    let title = format!(
        "A tool of {} triangles: error of a distance against time",
        count(largest)
    );
    report.plot(
        "contact_tool.svg",
        &title,
        plot(&title, "ns a query", "RMS, parts of the size", &lines),
    );
    let mut lines = Vec::new();
    for name in ["EXACT", "IMAGE_SPACE, 1/256", "DISTANCE_FIELD, 1/64"] {
        let of_name = || rows.iter().filter(|row| row.name == name);
        let series = |suffix: &str, value: &dyn Fn(&Row) -> f64| Series {
            name: format!("{name}, {suffix}"),
            points: of_name().map(|row| (row.triangles as f64, value(row))).collect(),
            dashed: suffix == "made",
        };
        lines.push(series("1000 queries", &|row| 1e6 * row.query));
        lines.push(series("made", &|row| 1e3 * row.making));
    }
    let title = "A tool: time over its triangles";
    report.plot("contact_tool_time.svg", title, plot(title, "triangles", "ms", &lines));
}
