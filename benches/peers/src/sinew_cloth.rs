//! The cloth in sinew: VERLET, with as many substeps as stability requires, which is one.

use glam::Vec3;
use sinew::{BodyDefinition, BodyId, Values, World, WorldDefinition};

use crate::child::Contender;
use crate::cloth::Cloth;

pub struct SinewCloth {
    world: World,
    body: BodyId,
    step: f32,
}

impl Contender for SinewCloth {
    fn build(cloth: &Cloth, threads: usize) -> Result<Self, String> {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::new(0.0, -cloth.gravity, 0.0),
            thread_count: threads as u32,
            ..WorldDefinition::default()
        })
        .map_err(|error| error.to_string())?;
        let positions: Vec<Vec3> = cloth.positions().map(Vec3::from).collect();
        let springs: Vec<[u32; 2]> = cloth.springs().collect();
        let definition = BodyDefinition {
            positions: &positions,
            springs: Some(&springs),
            masses: Values::Uniform(cloth.node_mass),
            stiffnesses: Values::Uniform(cloth.stiffness),
            ..BodyDefinition::default()
        };
        let body = world.create_body(&definition).map_err(|error| error.to_string())?;
        let pinned = world.body_mut(body).expect("just made");
        for node in cloth.pinned() {
            pinned.pin(node).expect("a node of it");
        }
        Ok(Self {
            world,
            body,
            step: cloth.step,
        })
    }

    fn version() -> String {
        "this one".into()
    }

    fn step(&mut self) {
        let report = self.world.step(self.step).expect("a stable step");
        assert_eq!(report.substeps, 1, "the cloth is to be soft enough for one substep");
    }

    fn position(&self, node: u32) -> [f32; 3] {
        self.world.body(self.body).expect("still there").positions()[node as usize].to_array()
    }
}
