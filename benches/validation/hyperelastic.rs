//! Bars and sheared blocks of each hyperelastic law, compared with the derivative of its energy in `f64`.

use glam::{DMat3, DVec3, Vec3};
use sinew::{ElementLaw, Solver};

use crate::laws::{LAWS, block, free_stretch, pull, scene, stress, stretched};
use crate::lines::Lines;
use crate::report::{Report, Table};
use crate::support::bodies::FREE;

/// The tolerance of the curves in the tests.
const TARGET: f64 = 1e-4;

pub fn name(law: ElementLaw) -> String {
    match law {
        ElementLaw::StVenantKirchhoff => "St Venant-Kirchhoff".into(),
        ElementLaw::NeoHookean => "neo-Hookean".into(),
        ElementLaw::MooneyRivlin { ratio } => format!("Mooney-Rivlin {ratio}"),
    }
}

pub fn run(report: &mut Report, lines: &mut Lines, _is_quick: bool) {
    report.write(
        "\n## Bar and shear of each law\n\nE = 5 kPa, nu = 0.49, Pa of the area at rest, NEWTON; theory / found.\n",
    );
    let mesh = block();
    let nu = 0.49_f32;
    let mut table = Table::new(&[
        "law",
        "bar at 0.7",
        "1.3",
        "1.8",
        "both axes 1.3",
        "shear 0.5",
        "across it",
    ]);
    for law in LAWS {
        let mut cells = vec![name(law)];
        let mut worst = 0.0_f64;
        let mut compare = |[expected, result]: [f64; 2], size: f64| {
            worst = worst.max((result - expected).abs() / size.abs());
            cells.push(format!("{expected:.1} / {result:.1}"));
        };
        for (stretch, is_biaxial) in [(0.7_f32, false), (1.3, false), (1.8, false), (1.3, true)] {
            let x = f64::from(stretch);
            let shape = |free: f64| DMat3::from_diagonal(DVec3::new(x, if is_biaxial { x } else { free }, free));
            let free = free_stretch(|free| stress(law, f64::from(nu), shape(free), 2, 2));
            let expected = stress(law, f64::from(nu), shape(free), 0, 0);
            let second = is_biaxial.then_some(stretch);
            let result = pull(&mesh, &stretched(&mesh, law, nu, [Some(stretch), second, None]), 0, 0);
            compare([expected, result], expected);
        }
        let shear = 0.5_f32;
        let mut scene = scene(&mesh, FREE, law, nu, Solver::Newton);
        let positions: Vec<Vec3> = mesh.positions.iter().map(|p| *p + Vec3::X * p.y * shear).collect();
        let body = scene.body_mut();
        (0..positions.len() as u32).for_each(|node| body.pin(node).expect("a node"));
        body.set_positions(&positions).expect("positions");
        scene.step(1e-3);
        let gradient = DMat3::from_cols(DVec3::X, DVec3::new(f64::from(shear), 1.0, 0.0), DVec3::Z);
        let along = stress(law, f64::from(nu), gradient, 1, 0);
        for axis in [0, 1] {
            compare(
                [
                    stress(law, f64::from(nu), gradient, 1, axis),
                    pull(&mesh, &scene, 1, axis),
                ],
                along,
            );
        }
        table.row(cells);
        let label = format!("bar and shear, {}", name(law));
        lines.error(&label, ["theory".into(), "the worst of six".into()], worst, TARGET, "");
    }
    report.table(&table);
}
