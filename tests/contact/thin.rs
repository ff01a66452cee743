//! Tools much thinner than the edges of the tissue that they press: their force matches the energy that the tissue
//! stores.

use std::f32::consts::FRAC_PI_2;

use crate::support::solid::cuboid;
use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::{BodyId, Detection, Pose, Shape, ToolDefinition, ToolId, World};

/// The side of a cloth (m).
const SIZE: f32 = 0.1;
const DT: f32 = 1e-3;

/// Returns boxes between corners (mm) as one mesh.
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

/// Returns an upright box with these widths along x and z (mm).
fn upright(width: f32, length: f32, z: f32) -> [Vec3; 2] {
    let half = Vec3::new(0.5 * width, 0.0, 0.5 * length);
    let middle = Vec3::Z * z;
    [middle - half, middle + half + Vec3::Y * 30.0]
}

/// A cloth with a pinned border, and a tool above it.
struct Press {
    world: World,
    cloth: BodyId,
    tool: ToolId,
    pose: Pose,
}

impl Press {
    /// Creates the scene. At `pose` the lowest point of the tool touches the cloth.
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

    /// Presses the tool down to a depth (m) in `steps` steps. Returns the largest force along y.
    fn press(&mut self, depth: f32, steps: u32) -> f64 {
        let from = self.world.pose(self.tool).expect("a tool").position;
        let to = self.pose.position - Vec3::Y * depth;
        let mut largest = 0.0_f64;
        for step in 1..=steps {
            let target = from.lerp(to, step as f32 / steps as f32);
            self.world.set_pose(self.tool, target, None).expect("a pose");
            largest = largest.max(self.step(1).y);
        }
        largest
    }

    /// Returns the force on the tool and the energy of the cloth, at rest.
    fn rest(&mut self) -> (DVec3, f64) {
        self.step(350);
        let force = self.step(50);
        (force, body(&self.world, self.cloth).energy(Vec3::ZERO).elastic)
    }
}

/// Checks that the force is the derivative of the stored energy: at rest and without friction, over 2 mm by Simpson's
/// rule.
fn assert_force_matches_stored_energy(
    name: &str,
    parts: &[[Vec3; 2]],
    at: [f32; 2],
    turned: Quat,
    detection: Detection,
) {
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
    let case = format!("{name} {detection:?} at {at:?}, {turned}");
    assert!(
        (work / stored - 1.0).abs() < 0.02,
        "{case}: work {work} J, stored {stored} J, forces {} {} {}",
        first.0,
        middle.0,
        last.0
    );
    let lateral = last.0.with_y(0.0).length();
    assert!(lateral < 0.3 * last.0.y, "{case}: {} N", last.0);
}

fn fork() -> [[Vec3; 2]; 3] {
    [-3.0, 0.0, 3.0].map(|z| upright(0.4, 0.4, z))
}

/// Returns a rotation about y, x and z.
fn turned(yaw: f32, tilt: f32, roll: f32) -> Quat {
    Quat::from_rotation_y(yaw) * Quat::from_rotation_x(tilt) * Quat::from_rotation_z(roll)
}

#[test]
fn the_force_on_needles_and_forks_matches_the_stored_energy() {
    let exact = Detection::Exact;
    assert_force_matches_stored_energy("fork", &fork(), [0.8, 1.1], turned(0.2, 0.1, 0.15), exact);
    let needle = [upright(0.4, 0.4, 0.0)];
    assert_force_matches_stored_energy("needle", &needle, [1.2, -2.2], turned(-0.4, 0.1, 0.0), exact);
}

#[test]
#[ignore = "long"]
fn the_force_on_blades_and_forks_matches_the_stored_energy_in_the_other_cases() {
    let (at, askew) = ([-0.04072666, 2.733_957], turned(1.2197274, 0.0, 0.0));
    for detection in [Detection::Exact, Detection::DistanceField] {
        assert_force_matches_stored_energy("fork", &fork(), at, askew, detection);
    }
    let (at, askew) = ([1.2576871, -0.47673368], turned(0.1774326, 0.0, 0.0));
    assert_force_matches_stored_energy("fork", &fork(), at, askew, Detection::Exact);
    let blade = [upright(0.5, 10.0, 0.0)];
    assert_force_matches_stored_energy("blade", &blade, [0.0, 0.0], Quat::IDENTITY, Detection::Exact);
    assert_force_matches_stored_energy("blade", &blade, [0.7, 2.1], turned(0.5, 0.1, 0.1), Detection::Exact);
}

/// Tissue below a tool that reaches over pinned nodes cannot yield and lets the tool pass, but free tissue beside or
/// below it yields. So a thin blade has the force of a tall one, and a thin rod that of a capsule.
#[test]
fn a_thin_tool_over_pinned_tissue_has_the_force_of_a_thick_one() {
    check_a_thin_tool_over_pinned_tissue_has_the_force_of_a_thick_one(&[Detection::Exact]);
}

#[test]
#[ignore = "long"]
fn a_thin_tool_over_pinned_tissue_has_the_force_of_a_thick_one_with_other_detections() {
    check_a_thin_tool_over_pinned_tissue_has_the_force_of_a_thick_one(&[
        Detection::DistanceField,
        Detection::ImageSpace,
    ]);
}

fn check_a_thin_tool_over_pinned_tissue_has_the_force_of_a_thick_one(detections: &[Detection]) {
    let tissue = Tissue {
        mass: 0.02,
        stiffness: 30.0,
        drag: 20.0,
        spring_damping: 0.01,
    };
    let force = |shape: Shape, orientation: Quat, low: f32, detection: Detection| {
        let position = Vec3::new(1.3e-3, -low, 1.7e-3);
        let mut press = Press::new(tissue, 5, shape, detection, Pose { position, orientation });
        let largest = press.press(0.004, 200);
        let (force, _) = press.rest();
        (largest, force.y)
    };
    let lying = |height: f32, width: f32, detection: Detection| {
        let half = Vec3::new(100.0, 0.5 * height, 0.5 * width);
        let (positions, triangles) = boxes(&[[-half, half]]);
        let shape = Shape::Mesh {
            positions: &positions,
            triangles: &triangles,
        };
        let (largest, force) = force(shape, Quat::IDENTITY, -0.5e-3 * height, detection);
        // During slow pressing the force never exceeds the final force by much. A pixel or a cell is a large fraction
        // of a thin tool.
        let more = if detection == Detection::Exact { 1.2 } else { 5.0 };
        assert!(
            largest < more * force,
            "{height} x {width} mm {detection:?}: {largest} N, then {force} N"
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
