//! Two overlapping deformable surfaces: the variants of IMAGE_SPACE, and EXACT.

use glam::Vec3;
use sinew::detection::exact::{self, Exact};
use sinew::detection::image_space::{Form, ImageSpace, ImageSpaceDefinition, Surface, Views};

use crate::claims::Claims;
use crate::clock;
use crate::errors::{DetectionResult, Errors, Samples};
use crate::report::{Report, Table, count, digits, milliseconds};
use crate::rounds::{Contender, Effort, interleave};
use crate::scene::{Pair, SIZE, Scene};
use crate::svg::{Series, plot};
use crate::truth::Truth;
use crate::volume;

/// Pixels along the size. Large surfaces skip every second resolution.
const PIXELS: [u32; 4] = [64, 128, 256, 512];
const FEW_PIXELS: [u32; 2] = [64, 256];

/// From this number of triangles on, fewer resolutions and samples are measured.
const LARGE: usize = 50_000;
const LARGEST: usize = 150_000;

/// Pixels along the size at which the variants of image space are compared over the number of triangles.
const COMPARED: u32 = 256;

/// Half of a pixel's diagonal with a margin for `f32`: deeper points must be detected.
const HALF_DIAGONAL: f64 = 0.71;

/// Position error of `f32`, relative to the size.
const ROUNDING: f64 = 1e-6;

/// Upper limit of triangles times samples in the reference computation of errors.
const MAX_REFERENCE_TESTS: usize = 300_000_000;

/// From this number of triangles on the volume is not computed, since its time grows with their square.
const MAX_FOR_VOLUME: usize = 6_000;

/// A direction that no edge or face of the scene follows.
const OBLIQUE: Vec3 = Vec3::new(0.48, 0.64, 0.6);

/// From this number of triangles on, the time of image space no longer depends mainly on its pixels.
const FROM_TRIANGLES: f64 = 4_000.0;

/// The largest exponent with which its time may grow with the number of triangles.
const MAX_EXPONENT: f64 = 1.15;

/// A detection method.
#[derive(Clone, Copy, PartialEq)]
enum Method {
    Image {
        form: Form,
        axes: bool,
        pixels: u32,
    },
    Exact,
    /// The part of EXACT that updates the hierarchy for the deformed tissue.
    Refit,
}

impl Method {
    fn all() -> Vec<Self> {
        Self::with(&PIXELS)
    }

    fn with(pixels: &[u32]) -> Vec<Self> {
        let forms = [Form::Counted, Form::Intervals].into_iter();
        let views = forms.flat_map(|form| [false, true].map(|axes| (form, axes)));
        let images =
            views.flat_map(|(form, axes)| pixels.iter().map(move |&pixels| Self::Image { form, axes, pixels }));
        images.chain([Self::Exact, Self::Refit]).collect()
    }

    fn name(self) -> String {
        match self {
            Self::Image { pixels, .. } => format!("{}, 1/{pixels}", self.kind()),
            _ => self.kind(),
        }
    }

    /// The name without the resolution.
    fn kind(self) -> String {
        match self {
            Self::Image { form, axes, .. } => {
                format!("{form:?}, {}", if axes { "3 axes" } else { "1 view" })
            }
            Self::Exact => "EXACT".into(),
            Self::Refit => "EXACT, refitting alone".into(),
        }
    }

    /// The pixel size, relative to the size.
    fn pixel(self) -> f64 {
        match self {
            Self::Image { pixels, .. } => 1.0 / f64::from(pixels),
            _ => 0.0,
        }
    }
}

/// Creates an image-space detector with capacity for a scene.
fn detector(scene: &Scene, form: Form, axes: bool, pixels: u32) -> ImageSpace {
    let definition = ImageSpaceDefinition {
        form,
        views: if axes { Views::Axes } else { Views::Along(OBLIQUE) },
        // Along an oblique view the overlap may be wider than the size.
        pixels: 1 << 20,
        crossings: 1 << 22,
        ..ImageSpaceDefinition::new(SIZE / pixels as f32)
    };
    let rings = scene.pairs.iter().map(|pair| &pair.ring_surface);
    let surfaces: Vec<&Surface> = rings.chain([&scene.tissue_surface]).collect();
    ImageSpace::new(&definition, &surfaces).expect("a detector")
}

/// EXACT solids for all pairs of a scene.
struct ExactPairs {
    tissue: Exact,
    rings: Vec<Exact>,
}

impl ExactPairs {
    fn new(scene: &Scene) -> Self {
        let ring = |pair: &Pair| Exact::new(&pair.ring.checked()).expect("a solid");
        Self {
            tissue: Exact::changing(&scene.tissue.checked()).expect("a solid"),
            rings: scene.pairs.iter().map(ring).collect(),
        }
    }

    /// Detects the tissue in the ring, then the ring in the tissue.
    fn detect(&mut self, scene: &Scene, pair: usize, overlaps: &mut [exact::Overlap; 2]) {
        let Pair {
            positions,
            ring,
            ring_surface,
        } = &scene.pairs[pair];
        self.tissue.refit(positions).expect("positions");
        let [first, second] = overlaps;
        let result = self.rings[pair].find(positions, scene.tissue_surface.edges(), first);
        result
            .and_then(|()| self.tissue.find(&ring.positions, ring_surface.edges(), second))
            .expect("an overlap");
    }
}

/// The measurements of one method at one size.
struct Row {
    triangles: usize,
    method: Method,
    /// Time of one detection [s].
    time: f64,
    errors: Errors,
    /// Relative volume error; `None` if there is no volume or no reference.
    volume: Option<f64>,
}

pub fn run(report: &mut Report, claims: &mut Claims, sizes: &[usize], effort: Effort) {
    report.write(&format!(
        "\n## Two surfaces that overlap\n\nTissue, a bumpy ball of {} mm that is bent and compressed, and a ring 0.4, 0.8 and 1.2 times as \
         wide that reaches into it, all with the stated number of triangles. A detection finds the parts of each surface in the other: times are means over \
         the three. Missed and false: of points on edges and at nodes, relative to those inside, with the deepest missed \
         and the furthest false point. Depths: RMS and worst difference from the shortest distance to the surface; image space reports \
         that along its views. All lengths are relative to the size.\n",
        digits(1e3 * f64::from(SIZE))
    ));
    let mut rows = Vec::new();
    for &triangles in sizes {
        let scene = Scene::new(triangles);
        report.progress(&format!("two surfaces of {} triangles", scene.triangle_count()));
        measure(report, &scene, effort, &mut rows);
    }
    write_table(report, &rows);
    write_plots(report, &rows);
    write_slopes(report, claims, &rows);
    check_claims(claims, &rows);
}

fn measure(report: &mut Report, scene: &Scene, effort: Effort, rows: &mut Vec<Row>) {
    let triangles = scene.triangle_count();
    let is_short = effort.quick || triangles > LARGE;
    let methods = Method::with(if is_short { &FEW_PIXELS } else { &PIXELS });
    let rounds = match triangles {
        0..LARGE => effort.rounds,
        LARGE..LARGEST => 2,
        _ => 1,
    };
    let effort = Effort { rounds, ..effort };
    let tests = if effort.quick {
        MAX_REFERENCE_TESTS / 4
    } else {
        MAX_REFERENCE_TESTS
    };
    let samples = Samples::new(scene, (tests / triangles / 6).clamp(100, 2000));
    let mut solids = None;
    let built = clock::time(|| solids = Some(ExactPairs::new(scene)));
    let mut solids = solids.expect("solids");
    report.progress(&format!(
        "EXACT: {} ms to check and build a surface",
        milliseconds(built.processor / 4.0)
    ));
    let mut refitted = Exact::changing(&scene.tissue.checked()).expect("a solid");
    let mut overlaps = [exact::Overlap::default(), exact::Overlap::default()];
    let volumes: Vec<f64> = (0..scene.pairs.len())
        .take_while(|_| triangles < MAX_FOR_VOLUME)
        .map(|pair| true_volume(scene, pair))
        .collect();
    let errors: Vec<(Errors, Option<f64>)> = methods
        .iter()
        .copied()
        .map(|method| match method {
            Method::Image { form, axes, pixels } => image_errors(scene, &samples, &volumes, form, axes, pixels),
            Method::Exact => {
                let detections: Vec<_> = (0..scene.pairs.len())
                    .map(|pair| {
                        solids.detect(scene, pair, &mut overlaps);
                        overlaps.each_ref().map(|overlap| Some(exact_result(overlap)))
                    })
                    .collect();
                (Errors::of(&samples, &detections), None)
            }
            Method::Refit => (Errors::default(), None),
        })
        .collect();
    let mut contenders: Vec<Contender> = Vec::new();
    for &method in &methods {
        if let Method::Image { form, axes, pixels } = method {
            let mut detector = detector(scene, form, axes, pixels);
            contenders.push(Contender::new(method.name(), 1, move |units| {
                for pair in std::iter::repeat_n(&scene.pairs, units).flatten() {
                    std::hint::black_box(detector.detect(&scene.placed(pair)).expect("an overlap"));
                }
            }));
        }
    }
    contenders.push(Contender::new(Method::Exact.name(), 1, |units| {
        for pair in (0..scene.pairs.len()).cycle().take(units * scene.pairs.len()) {
            solids.detect(scene, pair, &mut overlaps);
        }
    }));
    contenders.push(Contender::new(Method::Refit.name(), 1, |units| {
        for pair in std::iter::repeat_n(&scene.pairs, units).flatten() {
            refitted.refit(&pair.positions).expect("positions");
        }
    }));
    let results = interleave(contenders, effort);
    report.disturbed(results.waited);
    for (method, (errors, volume)) in methods.into_iter().zip(errors) {
        let time = results
            .get(&method.name())
            .map_or(f64::NAN, |samples| samples.minimum());
        rows.push(Row {
            triangles,
            method,
            time: time / scene.pairs.len() as f64,
            errors,
            volume,
        });
    }
}

fn image_errors(
    scene: &Scene,
    samples: &Samples,
    volumes: &[f64],
    form: Form,
    axes: bool,
    pixels: u32,
) -> (Errors, Option<f64>) {
    let mut detector = detector(scene, form, axes, pixels);
    let mut worst: Option<f64> = None;
    let mut all = Vec::new();
    for (index, pair) in scene.pairs.iter().enumerate() {
        let overlap = detector.detect(&scene.placed(pair)).expect("an overlap");
        assert!(overlap.pixel <= 1.001 * SIZE / pixels as f32, "room for all pixels");
        if let (Form::Intervals, Some(exact)) = (form, volumes.get(index)) {
            let error = (overlap.volume / exact - 1.0).abs();
            worst = Some(worst.map_or(error, |worst| worst.max(error)));
        }
        all.push(overlap.inside.each_ref().map(|inside| {
            Some(DetectionResult {
                nodes: inside.points.iter().map(|point| (point.node, point.depth)).collect(),
                edges: inside
                    .edges
                    .iter()
                    .map(|part| (part.edge, [part.entry, part.exit]))
                    .collect(),
            })
        }));
    }
    (Errors::of(samples, &all), worst)
}

fn exact_result(overlap: &exact::Overlap) -> DetectionResult {
    DetectionResult {
        nodes: overlap.points.iter().map(|point| (point.point, point.depth)).collect(),
        edges: overlap
            .edges
            .iter()
            .map(|part| (part.edge, [part.enters, part.leaves]))
            .collect(),
    }
}

fn true_volume(scene: &Scene, pair: usize) -> f64 {
    let bodies = scene.placed(&scene.pairs[pair]);
    let truths = bodies.map(|body| Truth::new(body.positions, body.surface.triangles()));
    let insides = [0, 1].map(|side: usize| -> Vec<bool> {
        let points = bodies[side].positions.iter();
        points
            .map(|point| truths[1 - side].is_inside(point.as_dvec3()))
            .collect()
    });
    volume::common(
        &bodies,
        [&|node| insides[0][node as usize], &|node| insides[1][node as usize]],
    )
}

fn write_table(report: &mut Report, rows: &[Row]) {
    let mut table = Table::new(&[
        "triangles",
        "way",
        "ms",
        "missed %",
        "deepest missed",
        "false %",
        "furthest false",
        "depth RMS",
        "worst",
        "volume %",
    ]);
    let length = |value: f64| {
        if value > 0.0 {
            format!("{value:.1e}")
        } else {
            "0".into()
        }
    };
    for row in rows {
        let errors = &row.errors;
        let known = errors.inside() > 0;
        let cell = |text: String| if known { text } else { "-".into() };
        let depth = errors.depth();
        table.row(vec![
            count(row.triangles),
            row.method.name(),
            milliseconds(row.time),
            cell(digits(100.0 * errors.missed())),
            cell(length(errors.deepest_missed)),
            cell(digits(100.0 * errors.false_ones())),
            cell(length(errors.furthest_false)),
            depth.map_or("-".into(), length),
            depth.map_or("-".into(), |_| length(errors.worst_depth)),
            row.volume.map_or("-".into(), |error| digits(100.0 * error)),
        ]);
    }
    report.table(&table);
}

/// The rows of one kind of method, in order of measurement.
fn of_kind<'a>(rows: &'a [Row], kind: &'a str) -> impl Iterator<Item = &'a Row> {
    rows.iter().filter(move |row| row.method.kind() == kind)
}

fn kinds() -> Vec<String> {
    let mut kinds: Vec<String> = Method::all().into_iter().map(Method::kind).collect();
    kinds.dedup();
    kinds
}

fn is_compared(row: &Row) -> bool {
    !matches!(row.method, Method::Image { pixels, .. } if pixels != COMPARED)
}

fn write_plots(report: &mut Report, rows: &[Row]) {
    let lines: Vec<Series> = kinds()
        .iter()
        .map(|kind| Series {
            name: kind.clone(),
            points: of_kind(rows, kind)
                .filter(|row| is_compared(row))
                .map(|row| (row.triangles as f64, 1e3 * row.time))
                .collect(),
            dashed: kind.starts_with("EXACT"),
        })
        .collect();
    let title = format!("Time of a detection, pixels of 1/{COMPARED} of the size");
    report.plot(
        "contact_time.svg",
        &title,
        plot(&title, "triangles of each surface", "ms", &lines),
    );
    let largest = rows.last().map_or(0, |row| row.triangles);
    let middle = rows
        .iter()
        .map(|row| row.triangles)
        .find(|&n| n > 15_000)
        .unwrap_or(largest);
    let lines: Vec<Series> = kinds()
        .iter()
        .map(|kind| Series {
            name: kind.clone(),
            points: of_kind(rows, kind)
                .filter(|row| row.triangles == middle && row.errors.missed() > 0.0)
                .map(|row| (1e3 * row.time, 100.0 * row.errors.missed()))
                .collect(),
            dashed: false,
        })
        .collect();
    let title = format!("Missed points against time, {} triangles (EXACT: none)", count(middle));
    report.plot(
        "contact_missed.svg",
        &title,
        plot(&title, "ms", "points inside that are missed, %", &lines),
    );
    let lines: Vec<Series> = kinds()
        .iter()
        .map(|kind| Series {
            name: kind.clone(),
            points: of_kind(rows, kind)
                .filter(|row| row.triangles == middle)
                .map(|row| (1e3 * row.time, row.errors.deepest_missed.max(row.errors.furthest_false)))
                .filter(|point| point.1 > 0.0)
                .collect(),
            dashed: false,
        })
        .collect();
    let title = format!("The worst position error against time, {} triangles", count(middle));
    report.plot(
        "contact_error.svg",
        &title,
        plot(
            &title,
            "ms",
            "deepest missed or furthest false, relative to the size",
            &lines,
        ),
    );
}

/// The exponent of time against the number of triangles: 1 is linear, less if pixels dominate.
fn write_slopes(report: &mut Report, claims: &mut Claims, rows: &[Row]) {
    report.write(&format!(
        "\nExponent of time against the number of triangles, from {FROM_TRIANGLES:.0} on; as a straight line through the first and the last they \
         have this time without triangles, for the pixels, and this time per triangle. The last column is the largest deviation from that line:\n"
    ));
    let mut table = Table::new(&["way", "power", "ms", "ns a triangle", "off the line %"]);
    for kind in kinds() {
        let points: Vec<(f64, f64)> = of_kind(rows, &kind)
            .filter(|row| is_compared(row) && row.triangles as f64 >= FROM_TRIANGLES)
            .map(|row| (row.triangles as f64, row.time))
            .collect();
        let power = slope(&points.iter().map(|(x, y)| (x.ln(), y.ln())).collect::<Vec<_>>());
        if !kind.starts_with("EXACT") {
            let claim = format!("{kind}: time rises with the triangles to the power of");
            claims.at_most(claim, power, MAX_EXPONENT);
        }
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            continue;
        };
        let each = (last.1 - first.1) / (last.0 - first.0);
        let start = first.1 - each * first.0;
        let deviation = points.iter().map(|(x, y)| (y / (start + each * x) - 1.0).abs());
        table.row(vec![
            kind.clone(),
            digits(power),
            milliseconds(start),
            digits(1e9 * each),
            digits(100.0 * deviation.fold(0.0, f64::max)),
        ]);
    }
    report.table(&table);
}

/// The slope of the least-squares line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, point| {
        (sum.0 + point.0 / count, sum.1 + point.1 / count)
    });
    let (mut products, mut squares) = (0.0, 0.0);
    for (x, y) in points {
        products += (x - mean.0) * (y - mean.1);
        squares += (x - mean.0) * (x - mean.0);
    }
    products / squares
}

/// Claims that must hold at every size.
fn check_claims(claims: &mut Claims, rows: &[Row]) {
    let worst = |pick: &dyn Fn(&Row) -> bool, value: &dyn Fn(&Row) -> f64| {
        rows.iter().filter(|row| pick(row)).map(value).fold(0.0, f64::max)
    };
    let intervals = |row: &Row| {
        matches!(
            row.method,
            Method::Image {
                form: Form::Intervals,
                ..
            }
        )
    };
    let pixel_error =
        |row: &Row| (row.errors.deepest_missed.max(row.errors.furthest_false) - ROUNDING) / row.method.pixel();
    let claim = "Intervals: the deepest missed and the furthest false, in pixels";
    claims.at_most(claim, worst(&intervals, &pixel_error), HALF_DIAGONAL);
    let fine = |row: &Row| intervals(row) && row.method.pixel() <= 1.0 / 256.0;
    let claim = "Intervals: missed at 1/256 of the size and finer";
    claims.at_most(claim, worst(&fine, &|row| row.errors.missed()), 0.01);
    let exact = |row: &Row| row.method == Method::Exact;
    let worst_error = |row: &Row| {
        row.errors
            .deepest_missed
            .max(row.errors.furthest_false)
            .max(row.errors.worst_depth)
    };
    let claim = "EXACT: the worst error of a position or a depth, relative to the size";
    claims.at_most(claim, worst(&exact, &worst_error), ROUNDING);
    // The volume error is first-order in the pixel size; the bound is the largest over all known values.
    let volume = |row: &Row| row.volume.map_or(0.0, |error| error / row.method.pixel());
    let claim = "Intervals: the error of the volume, in itself, over pixels in parts of the size";
    claims.at_most(claim, worst(&intervals, &volume), 1.0);
    let missed_fraction = |form: Form| {
        let same = move |row: &&Row| matches!(row.method, Method::Image { form: own, axes: true, pixels: COMPARED } if own == form);
        rows.iter().filter(same).map(|row| row.errors.missed()).sum::<f64>()
    };
    claims.claim(
        format!("Counted misses more than Intervals, 3 axes, 1/{COMPARED}"),
        format!(
            "{:.1} times as much",
            missed_fraction(Form::Counted) / missed_fraction(Form::Intervals).max(1e-9)
        ),
        missed_fraction(Form::Counted) > missed_fraction(Form::Intervals),
    );
}
