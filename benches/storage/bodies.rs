//! Worlds with one body for step measurements.

use sinew::{BodyDefinition, BodyId, Error, Kernel, Storage, StorageReport, Values, World, WorldDefinition};

use crate::scenes::{GRAVITY, MASS, STIFFNESS, SUBSTEP, Scene};

/// The settings of a step measurement.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    pub storage: Storage,
    pub springs_per_node: u32,
    pub threads: u32,
    pub substeps: u32,
    pub kernel: Kernel,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            storage: Storage::Packed,
            springs_per_node: 0,
            threads: 1,
            substeps: 1,
            kernel: Kernel::Best,
        }
    }
}

/// A world with one body.
pub struct Stepped {
    world: World,
    body: BodyId,
    substeps: u32,
}

impl Stepped {
    /// Creates the scene's body with `setup`, or returns the reason that this version does not support it.
    pub fn new(scene: &Scene, setup: Setup) -> Result<Self, String> {
        Self::with(scene, setup, |definition| definition)
    }

    /// Creates the body with its definition modified by `change`.
    pub fn with<'a>(
        scene: &'a Scene,
        setup: Setup,
        change: impl FnOnce(BodyDefinition<'a>) -> BodyDefinition<'a>,
    ) -> Result<Self, String> {
        let mut world = offered(World::new(WorldDefinition {
            thread_count: setup.threads,
            substeps: setup.substeps,
            kernel: setup.kernel,
            gravity: glam::Vec3::new(0.0, GRAVITY, 0.0),
            ..WorldDefinition::default()
        }))?;
        let definition = change(BodyDefinition {
            positions: &scene.positions,
            rest_positions: Some(&scene.rest_positions),
            springs: Some(&scene.springs),
            masses: Values::Uniform(MASS),
            stiffnesses: Values::Uniform(STIFFNESS),
            storage: setup.storage,
            springs_per_node: setup.springs_per_node,
            ..BodyDefinition::default()
        });
        let id = offered(world.create_body(&definition))?;
        let body = world.body_mut(id).expect("a body just made");
        for &node in &scene.pinned {
            body.pin(node).expect("a node of the scene");
        }
        Ok(Self {
            world,
            body: id,
            substeps: setup.substeps,
        })
    }

    /// Takes `steps` steps with the number of substeps of the setup.
    pub fn step(&mut self, steps: usize) {
        for _ in 0..steps {
            let report = self.world.step(SUBSTEP * self.substeps as f32).expect("a stable step");
            assert_eq!(report.bodies_restored, 0, "the body became non-finite");
        }
    }

    pub fn body(&self) -> &sinew::Body {
        self.world.body(self.body).expect("the world's body")
    }

    pub fn body_mut(&mut self) -> &mut sinew::Body {
        self.world.body_mut(self.body).expect("the world's body")
    }

    pub fn storage_report(&self) -> StorageReport {
        self.body().storage_report()
    }
}

/// An unsupported feature is a valid result; any other failure is a bug of this bench or of the library.
fn offered<T>(result: sinew::Result<T>) -> Result<T, String> {
    match result {
        Ok(value) => Ok(value),
        Err(Error::Unsupported(message)) => Err(message),
        Err(error) => panic!("{error}"),
    }
}
