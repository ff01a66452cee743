//! Two surfaces that overlap, both of which may change their shape: IMAGE_SPACE in its forms, and EXACT.

use glam::Vec3;
use sinew::detection::exact::{self, Exact};
use sinew::detection::image_space::{Form, ImageSpace, ImageSpaceDefinition, Surface, Views};

use crate::claims::Claims;
use crate::clock;
use crate::errors::{Errors, Found, Samples};
use crate::report::{Report, Table, count, digits, milliseconds};
use crate::rounds::{Contender, Effort, interleave};
use crate::scene::{Pair, SIZE, Scene};
use crate::svg::{Series, plot};
use crate::truth::Truth;
use crate::volume;

/// Pixels along the size; where time is short, every second one.
const PIXELS: [u32; 4] = [64, 128, 256, 512];
const FEW_PIXELS: [u32; 2] = [64, 256];

/// From so many triangles on time is short, and shorter.
const LARGE: usize = 50_000;
const LARGEST: usize = 150_000;

/// Pixels of the size at which the forms of image space are compared over the triangles.
const COMPARED: u32 = 256;

/// Half of a pixel's diagonal: what is deeper is seen; and a little for what `f32` takes.
const SEEN: f64 = 0.71;

/// What `f32` takes of a place, in parts of the size.
const ROUNDING: f64 = 1e-6;

/// In parts of the sum of surfaces and samples that the error may be looked for in: triangles times samples.
const LOOKS: usize = 300_000_000;

/// From so many triangles on the volume is not worked out: its time goes with their square.
const TOO_MANY: usize = 6_000;

/// A direction along which nothing of the scene lies.
const ASKEW: Vec3 = Vec3::new(0.48, 0.64, 0.6);

/// The least time of image space that is not of its pixels begins here.
const MANY: f64 = 4_000.0;

/// The steepest that its time may rise with the triangles.
const LINEAR: f64 = 1.15;

/// One way to detect.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Image {
        form: Form,
        axes: bool,
        pixels: u32,
    },
    Exact,
    /// The part of that which takes the tissue's new shape.
    Refit,
}

impl Way {
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

    /// Without its resolution.
    fn kind(self) -> String {
        match self {
            Self::Image { form, axes, .. } => {
                format!("{form:?}, {}", if axes { "3 axes" } else { "1 view" })
            }
            Self::Exact => "EXACT".into(),
            Self::Refit => "EXACT, refitting alone".into(),
        }
    }

    /// In parts of the size.
    fn pixel(self) -> f64 {
        match self {
            Self::Image { pixels, .. } => 1.0 / f64::from(pixels),
            _ => 0.0,
        }
    }
}

/// A detector of image space with room for a scene.
fn detector(scene: &Scene, form: Form, axes: bool, pixels: u32) -> ImageSpace {
    let definition = ImageSpaceDefinition {
        form,
        views: if axes { Views::Axes } else { Views::Along(ASKEW) },
        // Seen askew what overlaps may be wider than the size.
        pixels: 1 << 20,
        crossings: 1 << 22,
        ..ImageSpaceDefinition::new(SIZE / pixels as f32)
    };
    let rings = scene.pairs.iter().map(|pair| &pair.ring_surface);
    let surfaces: Vec<&Surface> = rings.chain([&scene.tissue_surface]).collect();
    ImageSpace::new(&definition, &surfaces).expect("a detector")
}

/// EXACT for all pairs of a scene.
struct Solids {
    tissue: Exact,
    rings: Vec<Exact>,
}

impl Solids {
    fn new(scene: &Scene) -> Self {
        let ring = |pair: &Pair| Exact::new(&pair.ring.checked()).expect("a solid");
        Self {
            tissue: Exact::changing(&scene.tissue.checked()).expect("a solid"),
            rings: scene.pairs.iter().map(ring).collect(),
        }
    }

    /// The tissue's in the ring, then the ring's in the tissue.
    fn detect(&mut self, scene: &Scene, pair: usize, overlaps: &mut [exact::Overlap; 2]) {
        let Pair {
            positions,
            ring,
            ring_surface,
        } = &scene.pairs[pair];
        self.tissue.refit(positions).expect("positions");
        let [first, second] = overlaps;
        let found = self.rings[pair].find(positions, scene.tissue_surface.edges(), first);
        found
            .and_then(|()| self.tissue.find(&ring.positions, ring_surface.edges(), second))
            .expect("an overlap");
    }
}

/// What was measured of one way at one size.
struct Row {
    triangles: usize,
    way: Way,
    /// Of one detection, s.
    time: f64,
    errors: Errors,
    /// In parts of it; `None` where it is not told or not known.
    volume: Option<f64>,
}

pub fn run(report: &mut Report, claims: &mut Claims, sizes: &[usize], effort: Effort) {
    report.write(&format!(
        "\n## Two surfaces that overlap\n\nTissue, a bumpy ball of {} mm that is bent and squeezed, and a ring 0.4, 0.8 and 1.2 times as \
         wide that reaches into it, each of so many triangles. A detection finds what of each lies in the other: times are means over \
         the three. Missed and false: of points on edges and at nodes, in parts of those inside, with the deepest that was missed \
         and the furthest outside that was found; depths: RMS and worst difference to the shortest way out, of which image space tells that \
         along its views; all lengths in parts of the size.\n",
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
    hold(claims, &rows);
}

fn measure(report: &mut Report, scene: &Scene, effort: Effort, rows: &mut Vec<Row>) {
    let triangles = scene.triangle_count();
    let is_short = effort.quick || triangles > LARGE;
    let ways = Way::with(if is_short { &FEW_PIXELS } else { &PIXELS });
    let rounds = match triangles {
        0..LARGE => effort.rounds,
        LARGE..LARGEST => 2,
        _ => 1,
    };
    let effort = Effort { rounds, ..effort };
    let looks = if effort.quick { LOOKS / 4 } else { LOOKS };
    let samples = Samples::new(scene, (looks / triangles / 6).clamp(100, 2000));
    let mut solids = None;
    let built = clock::time(|| solids = Some(Solids::new(scene)));
    let mut solids = solids.expect("solids");
    report.progress(&format!(
        "EXACT: {} ms to check and build a surface",
        milliseconds(built.processor / 4.0)
    ));
    let mut refitted = Exact::changing(&scene.tissue.checked()).expect("a solid");
    let mut overlaps = [exact::Overlap::default(), exact::Overlap::default()];
    let volumes: Vec<f64> = (0..scene.pairs.len())
        .take_while(|_| triangles < TOO_MANY)
        .map(|pair| true_volume(scene, pair))
        .collect();
    let errors: Vec<(Errors, Option<f64>)> = ways
        .iter()
        .copied()
        .map(|way| match way {
            Way::Image { form, axes, pixels } => image_errors(scene, &samples, &volumes, form, axes, pixels),
            Way::Exact => {
                let found: Vec<_> = (0..scene.pairs.len())
                    .map(|pair| {
                        solids.detect(scene, pair, &mut overlaps);
                        overlaps.each_ref().map(|overlap| Some(found_exactly(overlap)))
                    })
                    .collect();
                (Errors::of(&samples, &found), None)
            }
            Way::Refit => (Errors::default(), None),
        })
        .collect();
    let mut contenders: Vec<Contender> = Vec::new();
    for &way in &ways {
        if let Way::Image { form, axes, pixels } = way {
            let mut detector = detector(scene, form, axes, pixels);
            contenders.push(Contender::new(way.name(), 1, move |units| {
                for pair in std::iter::repeat_n(&scene.pairs, units).flatten() {
                    std::hint::black_box(detector.detect(&scene.placed(pair)).expect("an overlap"));
                }
            }));
        }
    }
    contenders.push(Contender::new(Way::Exact.name(), 1, |units| {
        for pair in (0..scene.pairs.len()).cycle().take(units * scene.pairs.len()) {
            solids.detect(scene, pair, &mut overlaps);
        }
    }));
    contenders.push(Contender::new(Way::Refit.name(), 1, |units| {
        for pair in std::iter::repeat_n(&scene.pairs, units).flatten() {
            refitted.refit(&pair.positions).expect("positions");
        }
    }));
    let results = interleave(contenders, effort);
    report.disturbed(results.waited);
    for (way, (errors, volume)) in ways.into_iter().zip(errors) {
        let time = results.get(&way.name()).map_or(f64::NAN, |samples| samples.minimum());
        rows.push(Row {
            triangles,
            way,
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
            Some(Found {
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

fn found_exactly(overlap: &exact::Overlap) -> Found {
    Found {
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
            row.way.name(),
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

/// The rows of a kind of way, in the order measured.
fn of_kind<'a>(rows: &'a [Row], kind: &'a str) -> impl Iterator<Item = &'a Row> {
    rows.iter().filter(move |row| row.way.kind() == kind)
}

fn kinds() -> Vec<String> {
    let mut kinds: Vec<String> = Way::all().into_iter().map(Way::kind).collect();
    kinds.dedup();
    kinds
}

fn is_compared(row: &Row) -> bool {
    !matches!(row.way, Way::Image { pixels, .. } if pixels != COMPARED)
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
    let title = format!(
        "What is missed against time, {} triangles (EXACT: nothing)",
        count(middle)
    );
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
    let title = format!("The worst error of a place against time, {} triangles", count(middle));
    report.plot(
        "contact_error.svg",
        &title,
        plot(
            &title,
            "ms",
            "deepest missed or furthest false, parts of the size",
            &lines,
        ),
    );
}

/// How steeply times rise with the triangles: 1 is linear, less where pixels count too.
fn write_slopes(report: &mut Report, claims: &mut Claims, rows: &[Row]) {
    report.write(&format!(
        "\nTimes rise with the triangles, from {MANY:.0} on, to the power of this; as a straight line through the first and the last they \
         are so much at no triangles, for the pixels, and so much more for each; between them they are off that line by so much at most:\n"
    ));
    let mut table = Table::new(&["way", "power", "ms", "ns a triangle", "off the line %"]);
    for kind in kinds() {
        let points: Vec<(f64, f64)> = of_kind(rows, &kind)
            .filter(|row| is_compared(row) && row.triangles as f64 >= MANY)
            .map(|row| (row.triangles as f64, row.time))
            .collect();
        let power = slope(&points.iter().map(|(x, y)| (x.ln(), y.ln())).collect::<Vec<_>>());
        if !kind.starts_with("EXACT") {
            let what = format!("{kind}: time rises with the triangles to the power of");
            claims.at_most(what, power, LINEAR);
        }
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            continue;
        };
        let each = (last.1 - first.1) / (last.0 - first.0);
        let start = first.1 - each * first.0;
        let off = points.iter().map(|(x, y)| (y / (start + each * x) - 1.0).abs());
        table.row(vec![
            kind.clone(),
            digits(power),
            milliseconds(start),
            digits(1e9 * each),
            digits(100.0 * off.fold(0.0, f64::max)),
        ]);
    }
    report.table(&table);
}

/// Of the straight line closest to the points.
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

/// What must be so at every size.
fn hold(claims: &mut Claims, rows: &[Row]) {
    let worst = |pick: &dyn Fn(&Row) -> bool, value: &dyn Fn(&Row) -> f64| {
        rows.iter().filter(|row| pick(row)).map(value).fold(0.0, f64::max)
    };
    let intervals = |row: &Row| {
        matches!(
            row.way,
            Way::Image {
                form: Form::Intervals,
                ..
            }
        )
    };
    let off = |row: &Row| (row.errors.deepest_missed.max(row.errors.furthest_false) - ROUNDING) / row.way.pixel();
    let what = "Intervals: the deepest missed and the furthest false, in pixels";
    claims.at_most(what, worst(&intervals, &off), SEEN);
    let fine = |row: &Row| intervals(row) && row.way.pixel() <= 1.0 / 256.0;
    let what = "Intervals: missed at 1/256 of the size and finer";
    claims.at_most(what, worst(&fine, &|row| row.errors.missed()), 0.01);
    let exact = |row: &Row| row.way == Way::Exact;
    let place = |row: &Row| {
        row.errors
            .deepest_missed
            .max(row.errors.furthest_false)
            .max(row.errors.worst_depth)
    };
    let what = "EXACT: the worst error of a place or a depth, in parts of the size";
    claims.at_most(what, worst(&exact, &place), ROUNDING);
    // The volume: an order 1 bound over all that are known.
    let volume = |row: &Row| row.volume.map_or(0.0, |error| error / row.way.pixel());
    let what = "Intervals: the error of the volume, in itself, over pixels in parts of the size";
    claims.at_most(what, worst(&intervals, &volume), 1.0);
    let lost = |form: Form| {
        let same =
            move |row: &&Row| matches!(row.way, Way::Image { form: own, axes: true, pixels: COMPARED } if own == form);
        rows.iter().filter(same).map(|row| row.errors.missed()).sum::<f64>()
    };
    claims.claim(
        format!("Counted misses more than Intervals, 3 axes, 1/{COMPARED}"),
        format!(
            "{:.1} times as much",
            lost(Form::Counted) / lost(Form::Intervals).max(1e-9)
        ),
        lost(Form::Counted) > lost(Form::Intervals),
    );
}
