//! Sheets and blocks in flight under random actions in random order: cuts in any position (along faces, through nodes,
//! of zero length, back and forth), blades, sutures, tears, snapshots. The invariants hold after each action.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::ops::Range;

use glam::{DVec3, Quat, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    Anchor, AttachmentId, BladeDefinition, BladeId, Body, BodyContact, BodyDefinition, BodyId, Error, Material, Model,
    Solver, Storage, SurfacePoint, SutureDefinition, Tearing, Values, World, WorldDefinition,
};

use crate::support::kept::kept;
use crate::support::random::Random;

impl Random {
    fn random_vector(&mut self, size: f32) -> Vec3 {
        let mut one = || (self.next() as f32 * 2.0 - 1.0) * size;
        vec3(one(), one(), one())
    }
}

/// A renderer's own mesh, which reads the body once and then change lists only.
struct RenderMesh {
    rest: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    version: u64,
    is_solid: bool,
    whole: f64,
}

impl RenderMesh {
    fn new(body: &Body, rest: &[Vec3], is_solid: bool) -> Self {
        let mut drawn = Self {
            rest: rest.iter().map(|position| position.as_dvec3()).collect(),
            triangles: body.surface().to_vec(),
            version: 0,
            is_solid,
            whole: 0.0,
        };
        drawn.whole = drawn.size();
        drawn
    }

    /// Returns the area or volume at rest.
    fn size(&self) -> f64 {
        let of = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|node| self.rest[node as usize]);
            if self.is_solid {
                a.dot(b.cross(c)) / 6.0
            } else {
                0.5 * (b - a).cross(c - a).length()
            }
        };
        self.triangles.iter().map(of).sum()
    }

    fn follow(&mut self, body: &Body, what: &str) {
        let changes = body.changes_since(self.version).unwrap();
        assert_eq!(changes.version, body.topology_version());
        self.version = changes.version;
        for new in changes.nodes {
            assert_eq!(new.node as usize, self.rest.len(), "{what}");
            assert!(new.sources.iter().all(|&source| source < new.node), "{what}");
            assert!(new.weights.iter().all(|&weight| weight >= 0.0), "{what}: {new:?}");
            let position = (0..3).map(|k| f64::from(new.weights[k]) * self.rest[new.sources[k] as usize]);
            self.rest.push(position.sum());
        }
        assert!(body.node_count() <= body.max_nodes(), "{what}");
        assert!(body.surface().len() <= body.max_triangles(), "{what}");
        self.triangles.resize(body.surface().len(), [u32::MAX; 3]);
        for &triangle in changes.triangles {
            self.triangles[triangle as usize] = body.surface()[triangle as usize];
        }
        assert_eq!(self.triangles, body.surface(), "{what}");
        assert_eq!(self.rest.len(), body.node_count(), "{what}");
        for edge in changes.rim {
            assert!((edge.triangle as usize) < self.triangles.len(), "{what}");
        }
        let now = self.size();
        assert!(
            (now / self.whole - 1.0).abs() < 2e-6,
            "{what}: {now} of {} at rest",
            self.whole
        );
        self.check_manifold(what);
    }

    /// Each side has one triangle, and in solids one triangle across it; the triangles around each point are fans.
    fn check_manifold(&self, what: &str) {
        let mut sides = BTreeSet::new();
        for (number, corners) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let side = (corners[k], corners[(k + 1) % 3]);
                assert!(side.0 != side.1, "{what}: triangle {number} has no area");
                assert!(
                    sides.insert(side),
                    "{what}: two triangles share the directed side {side:?}"
                );
            }
        }
        if self.is_solid {
            for &(a, b) in &sides {
                assert!(sides.contains(&(b, a)), "{what}: no triangle across {a} and {b}");
            }
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Kind {
    is_solid: bool,
    has_elements: bool,
    solver: Solver,
    storage: Storage,
    has_self_contact: bool,
    tears: bool,
    toughness: f32,
}

fn made(kind: Kind, random: &mut Random) -> (World, BodyId, Vec<Vec3>) {
    let mut mesh = if kind.is_solid {
        Mesh::block([0.05, 0.04, 0.03], [5, 4, 3]).unwrap()
    } else {
        Mesh::cloth([0.08; 2], [8; 2]).unwrap()
    };
    if random.next() < 0.7 {
        for position in &mut mesh.positions {
            *position += if kind.is_solid {
                random.random_vector(0.001)
            } else {
                random.random_vector(0.0015) * vec3(1.0, 0.0, 1.0)
            };
        }
    }
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .unwrap();
    let elements = Material {
        model: Model::Tetrahedra,
        young_modulus: 3000.0,
        poisson_ratio: random.of(&[0.3, 0.49]),
        ..Default::default()
    };
    let tearing = Tearing {
        strain: 0.25,
        most_per_step: 4,
        ..Default::default()
    };
    let body = world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(2e-4),
            node_dampings: Values::Uniform(0.0),
            stiffnesses: Values::Uniform(if kind.has_elements { 0.0 } else { 20.0 }),
            material: kind.has_elements.then_some(elements),
            springs_per_node: if kind.storage == Storage::FastLink { 48 } else { 0 },
            spare_nodes: 6000,
            mass_scaling: 0.0,
            toughness: kind.toughness,
            tearing: if kind.tears { tearing } else { Tearing::default() },
            contact: BodyContact {
                with_itself: kind.has_self_contact,
                ..BodyContact::NOTHING
            },
            solver: kind.solver,
            storage: kind.storage,
            ..BodyDefinition::of(&mesh)
        })
        .unwrap();
    let (push, turn) = (random.random_vector(0.3), random.random_vector(6.0));
    let velocities: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|&position| push + turn.cross(position) + random.random_vector(0.1))
        .collect();
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    (world, body, mesh.positions)
}

/// Returns a sweep in some position, often a degenerate one.
fn sweep(body: &Body, random: &mut Random) -> (&'static str, Sweep) {
    let (positions, surface) = (body.positions(), body.surface());
    let node = |random: &mut Random| {
        let triangle = surface[random.below(surface.len())];
        positions[triangle[random.below(3)] as usize]
    };
    let triangle = surface[random.below(surface.len())].map(|node| positions[node as usize]);
    let normal = (triangle[1] - triangle[0])
        .cross(triangle[2] - triangle[0])
        .normalize_or_zero();
    match random.below(10) {
        0 | 1 => {
            let (at, edge, displacement) = (node(random), random.random_vector(0.08), random.random_vector(0.08));
            let turned = random.random_vector(0.03);
            let (start, end) = (at - 0.5 * displacement, at + 0.5 * displacement);
            let sweep = Sweep {
                start: [start - edge, start + edge],
                end: [end - edge - turned, end + edge + turned],
            };
            ("anywhere", sweep)
        }
        2 => {
            let (from, to, edge) = (node(random), node(random), 0.06 * normal);
            let over = 0.3 * (to - from);
            let sweep = Sweep {
                start: [from - over - edge, from - over + edge],
                end: [to + over - edge, to + over + edge],
            };
            ("through nodes", sweep)
        }
        3 => {
            let [a, b, c] = triangle;
            let over = b - a;
            let sweep = Sweep {
                start: [a - over, b + over],
                end: [c - over, c + (b - a) + over],
            };
            ("in a face", sweep)
        }
        4 => {
            let [a, b, _] = triangle;
            let edge = 0.05 * normal;
            let sweep = Sweep {
                start: [a - edge, a + edge],
                end: [b - edge, b + edge],
            };
            ("along an edge", sweep)
        }
        5 => {
            let at = node(random);
            let edge = random.random_vector(0.05);
            let sweep = Sweep {
                start: [at - edge, at + edge],
                end: [at - edge, at + edge],
            };
            ("of no length", sweep)
        }
        6 => {
            let (at, displacement) = (node(random), random.random_vector(0.06));
            let sweep = Sweep {
                start: [at - displacement; 2],
                end: [at + displacement; 2],
            };
            ("of no edge", sweep)
        }
        7 => {
            // The edge rotates about a node.
            let (at, one, other) = (node(random), random.random_vector(0.06), random.random_vector(0.06));
            let sweep = Sweep {
                start: [at, at + one],
                end: [at, at + other],
            };
            ("about a node", sweep)
        }
        8 => {
            // Exactly through nodes of one triangle and of another.
            let other = surface[random.below(surface.len())].map(|node| positions[node as usize]);
            let sweep = Sweep {
                start: [triangle[0], triangle[1]],
                end: [other[0], other[1]],
            };
            ("from an edge to an edge", sweep)
        }
        _ => {
            let (from, to) = (node(random), node(random));
            let edge = 0.1 * Quat::from_scaled_axis(random.random_vector(1.0)).mul_vec3(normal);
            let sweep = Sweep {
                start: [from - edge, from + edge],
                end: [to - edge, to + edge],
            };
            ("between points", sweep)
        }
    }
}

fn point(body: &Body, random: &mut Random) -> SurfacePoint {
    let (a, b) = (random.next() as f32, random.next() as f32);
    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
    SurfacePoint {
        triangle: random.below(body.surface().len()) as u32,
        weights: [a, b, 1.0 - a - b],
    }
}

struct Wild {
    world: World,
    body: BodyId,
    drawn: RenderMesh,
    random: Random,
    sutures: Vec<AttachmentId>,
    blades: Vec<BladeId>,
    what: String,
    separated: Option<u32>,
}

impl Wild {
    fn cut(&mut self, sweep: &Sweep) {
        let it = self.world.body(self.body).unwrap();
        let (before, hash) = (kept(&self.world, self.body), self.world.state_hash());
        let sutures: Vec<f32> = self
            .sutures
            .iter()
            .filter_map(|&it| Some(self.world.suture_report(it).ok()?.distance))
            .collect();
        let version = it.topology_version();
        let what = self.what.clone();
        match self.world.cut(self.body, sweep) {
            Ok(report) => {
                if let Some(separated) = &mut self.separated {
                    *separated += report.pieces_parted;
                }
                assert!(report.length.is_finite() && report.area.is_finite(), "{what}");
            }
            Err(error) => {
                assert!(matches!(error, Error::Capacity(_)), "{what}: {error}");
                assert_eq!(hash, self.world.state_hash(), "{what}: {error}");
            }
        }
        let it = self.world.body(self.body).unwrap();
        let after = kept(&self.world, self.body);
        assert!((after.mass / before.mass - 1.0).abs() < 1e-6, "{what}: mass");
        let off = [
            before.momentum.distance(after.momentum),
            before.spin.distance(after.spin),
        ];
        assert!(
            off[0] < 1e-6 * before.sizes[0] && off[1] < 1e-6 * before.sizes[1],
            "{what}: momentum {off:?} of {:?}",
            before.sizes
        );
        assert!(
            (after.energy - before.energy).abs() < 2e-6 * before.energy,
            "{what}: energy {} {}",
            before.energy,
            after.energy
        );
        let now: Vec<f32> = self
            .sutures
            .iter()
            .filter_map(|&it| Some(self.world.suture_report(it).ok()?.distance))
            .collect();
        assert_eq!(sutures.len(), now.len(), "{what}: a suture ended");
        for (a, b) in sutures.iter().zip(&now) {
            assert!((a - b).abs() < 2e-5, "{what}: a suture was {a} and is {b} m long");
        }
        // Removed springs are refused.
        let removed = it.changes_since(version).unwrap().removed_springs.to_vec();
        let pairs = it.spring_pairs().unwrap();
        for pair in removed {
            let ordered = [pair[0].min(pair[1]), pair[0].max(pair[1])];
            assert!(pairs.binary_search(&ordered).is_err(), "{what}: {pair:?} is not gone");
            assert!(it.springs(&[pair]).is_err(), "{what}");
        }
        let count = it.node_count() as u32;
        assert!(it.node_mass(count).is_err());
    }

    fn steps(&mut self, count: usize) {
        for _ in 0..count {
            let report = self.world.step(1e-3).unwrap();
            // Bodies with non-finite values are rolled back: that does not happen here.
            assert_eq!(report.bodies_restored, 0, "{}", self.what);
            let it = self.world.body(self.body).unwrap();
            if let Some(separated) = &mut self.separated {
                *separated += it.tear_report().pieces_parted;
            }
        }
    }

    fn act(&mut self) {
        let it = self.world.body(self.body).unwrap();
        match self.random.below(14) {
            0..=5 => {
                let (name, sweep) = sweep(it, &mut self.random);
                self.what += &format!(" {name};");
                self.cut(&sweep);
                if self.random.next() < 0.3 {
                    // And back.
                    self.what += " back;";
                    self.cut(&Sweep {
                        start: sweep.end,
                        end: sweep.start,
                    });
                }
            }
            6 | 7 => {
                let points = [point(it, &mut self.random), point(it, &mut self.random)];
                let [one, other] = points.map(Anchor::Point);
                let length = self.random.of(&[None, Some(0.005)]);
                let definition = SutureDefinition {
                    length,
                    stiffness: self.random.of(&[20.0, f32::INFINITY]),
                    ..Default::default()
                };
                if let Ok(id) = self.world.suture(self.body, &one, self.body, &other, &definition) {
                    self.what += " sutured;";
                    self.sutures.push(id);
                }
            }
            8 => {
                // Through the triangle of the last suture.
                self.what += " through a suture;";
                let at = point(it, &mut self.random);
                if self.sutures.is_empty() {
                    return;
                }
                let other = point(it, &mut self.random);
                let [one, other_anchor] = [at, other].map(Anchor::Point);
                if let Ok(id) =
                    self.world
                        .suture(self.body, &one, self.body, &other_anchor, &SutureDefinition::default())
                {
                    self.sutures.push(id);
                }
                let it = self.world.body(self.body).unwrap();
                let corners = it.surface()[at.triangle as usize].map(|node| it.positions()[node as usize]);
                let position: Vec3 = (0..3).map(|k| at.weights[k] * corners[k]).sum();
                let normal = (corners[1] - corners[0])
                    .cross(corners[2] - corners[0])
                    .normalize_or_zero();
                let displacement = 2.0 * (corners[1] - corners[0]);
                let sweep = Sweep {
                    start: [-0.02, 0.02].map(|along| position - displacement + along * normal),
                    end: [-0.02, 0.02].map(|along| position + displacement + along * normal),
                };
                self.cut(&sweep);
            }
            9 => {
                if let Some(id) = self.sutures.pop() {
                    self.what += " released;";
                    let _ = self.world.release(id);
                    assert!(
                        self.world.suture_report(id).is_err(),
                        "{}: a removed suture still reports",
                        self.what
                    );
                    assert!(self.world.release(id).is_err());
                }
            }
            10 => {
                self.what += " blade;";
                let positions = it.positions();
                let middle = positions.iter().sum::<Vec3>() / positions.len() as f32;
                let axis = self.random.random_vector(0.06);
                let mut definition = BladeDefinition::new([-axis, axis + Vec3::X * 1e-3]);
                definition.pose.position = middle + self.random.random_vector(0.08);
                definition.stiffness = self.random.of(&[10.0, 1000.0]);
                self.blades.push(self.world.create_blade(&definition).unwrap());
                self.separated = None;
            }
            11 => {
                if let Some(&blade) = self.blades.last() {
                    let positions = it.positions();
                    let middle = positions.iter().sum::<Vec3>() / positions.len() as f32;
                    let to = middle + self.random.random_vector(0.05);
                    let turn = Quat::from_scaled_axis(self.random.random_vector(1.0));
                    self.what += " blade moves;";
                    for part in 1..=4 {
                        let position = middle.lerp(to, part as f32 / 4.0);
                        self.world.set_blade_pose(blade, position, Some(turn)).unwrap();
                        self.steps(1);
                        let report = self.world.blade_report(blade).unwrap();
                        assert!(report.work.is_finite() && report.force.is_finite());
                    }
                    if self.random.next() < 0.5 {
                        self.world.destroy_blade(blade).unwrap();
                        self.blades.pop();
                        assert!(self.world.blade_report(blade).is_err());
                    }
                }
            }
            12 => {
                self.what += " saved;";
                let bytes = self.world.save().unwrap();
                let world = World::load(&bytes, 1, None).unwrap();
                assert_eq!(world.state_hash(), self.world.state_hash(), "{}", self.what);
                self.world = world;
            }
            _ => {
                let (quiet, before) = (self.blades.is_empty(), kept(&self.world, self.body));
                self.what += " steps;";
                self.steps(5);
                let after = kept(&self.world, self.body);
                if quiet {
                    let off = before.momentum.distance(after.momentum);
                    assert!(
                        off < 3e-5 * before.sizes[0],
                        "{}: momentum {off} of {}",
                        self.what,
                        before.sizes[0]
                    );
                }
            }
        }
    }

    fn check(&mut self) {
        let it = self.world.body(self.body).unwrap();
        self.drawn.follow(it, &self.what);
        assert!(
            it.positions().iter().all(|position| position.is_finite()),
            "{}",
            self.what
        );
        assert!(
            it.velocities().iter().all(|velocity| velocity.is_finite()),
            "{}",
            self.what
        );
        if let Some(separated) = self.separated {
            assert_eq!(it.pieces().unwrap().count, 1 + separated, "{}: pieces", self.what);
        }
    }
}

#[test]
fn random_actions_break_nothing() {
    break_nothing(0..4);
}

#[test]
#[ignore = "long"]
fn many_random_actions_break_nothing() {
    let env_number = |name, otherwise| std::env::var(name).map_or(otherwise, |number| number.parse().unwrap());
    let from = env_number("WILD_FROM", 4);
    break_nothing(from..from + env_number("WILD_ROUNDS", 56));
}

fn break_nothing(rounds: Range<u64>) {
    let mut failed = Vec::new();
    for round in rounds {
        let mut random = Random(70_000 + round);
        let is_solid = random.next() < 0.5;
        let kind = Kind {
            is_solid,
            has_elements: is_solid && random.next() < 0.5,
            solver: random.of(&[Solver::Verlet, Solver::Implicit, Solver::Newton]),
            storage: random.of(&[
                Storage::Packed,
                Storage::Efficient,
                Storage::FastLink,
                Storage::DynamicBulk,
            ]),
            has_self_contact: random.next() < 0.3,
            tears: random.next() < 0.3,
            toughness: random.of(&[0.0, 0.0, 0.5]),
        };
        let run = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let (world, body, rest) = made(kind, &mut random);
            let drawn = RenderMesh::new(world.body(body).unwrap(), &rest, is_solid);
            let mut wild = Wild {
                world,
                body,
                drawn,
                random: Random(90_000 + round),
                sutures: Vec::new(),
                blades: Vec::new(),
                what: format!("round {round}, {kind:?}:"),
                separated: Some(0),
            };
            // A step takes seconds for a solid with self-contact after many cuts.
            let acts = if is_solid && kind.has_self_contact { 16 } else { 40 };
            for _ in 0..acts {
                wild.act();
                wild.check();
            }
        }));
        if run.is_err() {
            failed.push(round);
        }
    }
    assert!(failed.is_empty(), "rounds {failed:?}");
}
