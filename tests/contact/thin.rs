//! Tools that are much thinner than the edges of the tissue that they press: they feel what the tissue has stored, no more.

use std::f32::consts::FRAC_PI_2;

use crate::support::solid::cuboid;
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::{BodyId, Detection, Pose, Shape, ToolDefinition, ToolId, World};

/// Of a cloth, m.
const SIZE: f32 = 0.1;
const DT: f32 = 1e-3;

/// Boxes between corners, mm, as one mesh.
fn boxes(parts: &[[Vec3; 2]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for &[low, high] in parts {
        let first = positions.len() as u32;
        let (corners, sides) = cuboid(low * 1e-3, high * 1e-3);
        positions.extend(corners);
        triangles.extend(sides.iter().map(|side| side.map(|corner| corner + first)));
    }
    (positions, triangles)
}

/// A box of this width along x and z, mm, upright on its end.
fn upright(width: f32, length: f32, z: f32) -> [Vec3; 2] {
    let half = Vec3::new(0.5 * width, 0.0, 0.5 * length);
    let middle = Vec3::Z * z;
    [middle - half, middle + half + Vec3::Y * 30.0]
}

/// A cloth pinned all round, and a tool above it.
struct Press {
    world: World,
    cloth: BodyId,
    tool: ToolId,
    pose: Pose,
}

impl Press {
    /// The lowest point of the tool touches the cloth in this pose.
    fn new(tissue: Tissue, cells: u32, shape: Shape, detection: Detection, pose: Pose) -> Self {
        let mut world = world(Vec3::ZERO);
        let cloth = tissue.put(&mut world, &square(SIZE, cells));
        pin_all(&mut world, cloth, &rim(cells));
        let mut press = Self {
            tool: world
                .create_tool(&ToolDefinition {
                    detection,
                    pose: Pose {
                        position: pose.position + Vec3::Y * 0.5e-3,
                        ..pose
                    },
                    ..ToolDefinition::new(shape)
                })
                .expect("a tool"),
            world,
            cloth,
            pose,
        };
        press.step(1);
        press
    }

    fn step(&mut self, steps: u32) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for _ in 0..steps {
            let report = self.world.step(DT).expect("a step");
            assert_eq!(report.bodies_restored, 0);
            sum += self.world.wrench(self.tool).expect("a tool").0.as_dvec3();
        }
        sum / f64::from(steps)
    }

    /// Presses it down to a depth, m, in so many steps; the largest force along y on the way.
    fn press(&mut self, depth: f32, steps: u32) -> f64 {
        let from = self.world.pose(self.tool).expect("a tool").position;
        let to = self.pose.position - Vec3::Y * depth;
        let mut most = 0.0_f64;
        for step in 1..=steps {
            let way = from.lerp(to, step as f32 / steps as f32);
            self.world.set_pose(self.tool, way, None).expect("a pose");
            most = most.max(self.step(1).y);
        }
        most
    }

    /// The force on the tool and the energy within the cloth, at rest.
    fn rest(&mut self) -> (DVec3, f64) {
        self.step(350);
        let force = self.step(50);
        (force, body(&self.world, self.cloth).energy(Vec3::ZERO).elastic)
    }
}

/// At rest and without friction the force is the slope of what the cloth has stored: compared over 2 mm by Simpson's rule.
fn feels_what_is_stored(name: &str, parts: &[[Vec3; 2]], at: [f32; 2], turned: Quat, detection: Detection) {
    let tissue = Tissue {
        mass: 0.02,
        stiffness: 100.0,
        drag: 30.0,
        spring_damping: 0.01,
    };
    let (positions, triangles) = boxes(parts);
    let low = positions
        .iter()
        .map(|&corner| (turned * corner).y)
        .fold(f32::INFINITY, f32::min);
    let shape = Shape::Mesh {
        positions: &positions,
        triangles: &triangles,
    };
    let pose = Pose {
        position: Vec3::new(at[0] * 1e-3, -low, at[1] * 1e-3),
        orientation: turned,
    };
    let mut press = Press::new(tissue, 20, shape, detection, pose);
    let [first, middle, last] = [0.003, 0.004, 0.005].map(|depth| {
        press.press(depth, 40);
        press.rest()
    });
    let work = 2e-3 / 6.0 * (first.0.y + 4.0 * middle.0.y + last.0.y);
    let stored = last.1 - first.1;
    let what = format!("{name} {detection:?} at {at:?}, {turned}");
    assert!(
        (work / stored - 1.0).abs() < 0.02,
        "{what}: work {work} J, stored {stored} J, forces {} {} {}",
        first.0,
        middle.0,
        last.0
    );
    let aside = last.0.with_y(0.0).length();
    assert!(aside < 0.3 * last.0.y, "{what}: {} N", last.0);
}

fn fork() -> [[Vec3; 2]; 3] {
    [-3.0, 0.0, 3.0].map(|z| upright(0.4, 0.4, z))
}

/// A turn about y, x and z.
fn turned(yaw: f32, tilt: f32, roll: f32) -> Quat {
    Quat::from_rotation_y(yaw) * Quat::from_rotation_x(tilt) * Quat::from_rotation_z(roll)
}

#[test]
fn needles_and_forks_feel_what_the_cloth_has_stored() {
    let exact = Detection::Exact;
    feels_what_is_stored("fork", &fork(), [0.8, 1.1], turned(0.2, 0.1, 0.15), exact);
    let needle = [upright(0.4, 0.4, 0.0)];
    feels_what_is_stored("needle", &needle, [1.2, -2.2], turned(-0.4, 0.1, 0.0), exact);
}

#[test]
#[ignore = "long"]
fn blades_and_forks_feel_what_the_cloth_has_stored_in_the_other_cases() {
    let (at, askew) = ([-0.04072666, 2.733_957], turned(1.2197274, 0.0, 0.0));
    for detection in [Detection::Exact, Detection::DistanceField] {
        feels_what_is_stored("fork", &fork(), at, askew, detection);
    }
    let (at, askew) = ([1.2576871, -0.47673368], turned(0.1774326, 0.0, 0.0));
    feels_what_is_stored("fork", &fork(), at, askew, Detection::Exact);
    let blade = [upright(0.5, 10.0, 0.0)];
    feels_what_is_stored("blade", &blade, [0.0, 0.0], Quat::IDENTITY, Detection::Exact);
    feels_what_is_stored("blade", &blade, [0.7, 2.1], turned(0.5, 0.1, 0.1), Detection::Exact);
}

/// Where a tool reaches over what is pinned, tissue there cannot give way, and lets it by; what can be beside or below it is. So a thin
/// blade feels what a tall one does, and a thin rod what a capsule does.
#[test]
fn a_thin_tool_over_pinned_tissue_feels_what_others_do() {
    a_thin_tool_over_pinned_tissue_feels_what_others_do_of(&[Detection::Exact]);
}

#[test]
#[ignore = "long"]
fn a_thin_tool_over_pinned_tissue_feels_what_others_do_found_in_other_ways() {
    a_thin_tool_over_pinned_tissue_feels_what_others_do_of(&[Detection::DistanceField, Detection::ImageSpace]);
}

fn a_thin_tool_over_pinned_tissue_feels_what_others_do_of(detections: &[Detection]) {
    let tissue = Tissue {
        mass: 0.02,
        stiffness: 30.0,
        drag: 20.0,
        spring_damping: 0.01,
    };
    let force = |shape: Shape, orientation: Quat, low: f32, detection: Detection| {
        let position = Vec3::new(1.3e-3, -low, 1.7e-3);
        let mut press = Press::new(tissue, 5, shape, detection, Pose { position, orientation });
        let most = press.press(0.004, 200);
        let (force, _) = press.rest();
        (most, force.y)
    };
    let lying = |height: f32, width: f32, detection: Detection| {
        let half = Vec3::new(100.0, 0.5 * height, 0.5 * width);
        let (positions, triangles) = boxes(&[[-half, half]]);
        let shape = Shape::Mesh {
            positions: &positions,
            triangles: &triangles,
        };
        let (most, force) = force(shape, Quat::IDENTITY, -0.5e-3 * height, detection);
        // Slowly pressed it never feels much more than in the end; a pixel or a cell is a part of a thin one.
        let more = if detection == Detection::Exact { 1.2 } else { 5.0 };
        assert!(
            most < more * force,
            "{height} x {width} mm {detection:?}: {most} N, then {force} N"
        );
        force
    };
    let tall = lying(20.0, 10.0, Detection::Exact);
    let radius = 0.2e-3;
    let rod = Shape::Capsule {
        radius,
        half_length: 0.1,
    };
    let (_, round) = force(rod, Quat::from_rotation_z(FRAC_PI_2), -radius, Detection::Exact);
    for &detection in detections {
        let blade = lying(0.5, 10.0, detection);
        assert!(
            (blade / tall - 1.0).abs() < 0.05,
            "{detection:?}: {blade} N of {tall} N"
        );
        let needle = lying(0.4, 0.4, detection);
        assert!(
            (needle / round - 1.0).abs() < 0.15,
            "needle {detection:?}: {needle} N of {round} N"
        );
    }
}
