//! A checked world: stepped with one thread and with two, and checked after every step.
//!
//! A third world takes each substep as a step, which makes the substeps observable. Its motion is bitwise identical if
//! no input is divided differently.

use glam::{DVec3, Vec3};
use sinew::{Body, BodyDefinition, BodyId, Error, Solver, StepReport, Values, World, WorldDefinition};

use super::ledger::{ExternalActions, Ledger, State};
use super::setup::{Setup, Stop, fault};
use crate::support::bodies::{FREE, Parts};
use crate::support::reference::Reference;

/// This many steps are taken with two threads as well.
const STEPS_OF_BOTH: usize = 200;

/// The state is hashed before and after each of the first steps, then once in this many.
const STEPS_HASHED: usize = 20;

/// This many nodes, together with the body, are enough to use a second thread.
const DUST: usize = 1024;

struct Scene {
    world: World,
    id: BodyId,
    /// Pinned nodes whose only purpose is to use several threads.
    dust: Option<BodyId>,
}

impl Scene {
    fn new(definition: &BodyDefinition, world: WorldDefinition) -> sinew::Result<Self> {
        let mut world = World::new(world)?;
        let id = world.create_body(definition)?;
        Ok(Self { world, id, dust: None })
    }

    fn with_dust(definition: &BodyDefinition, world: WorldDefinition) -> sinew::Result<Self> {
        let Self { mut world, id, .. } = Self::new(definition, world)?;
        let places: Vec<Vec3> = (0..DUST).map(|i| Vec3::X * (5.0 + 0.01 * i as f32)).collect();
        let dust = world.create_body(&BodyDefinition {
            positions: &places,
            masses: Values::Each(&[0.0; DUST]),
            springs: Some(&[]),
            ..BodyDefinition::default()
        })?;
        Ok(Self {
            world,
            id,
            dust: Some(dust),
        })
    }

    fn body(&self) -> &Body {
        self.world.body(self.id).expect("the body")
    }

    fn body_mut(&mut self) -> &mut Body {
        self.world.body_mut(self.id).expect("the body")
    }
}

/// One body, or two identical ones.
pub struct Watched {
    pub setup: Setup,
    scenes: Vec<Scene>,
    /// With one substep per step; for VERLET.
    fine: Option<Scene>,
    ledger: Option<Ledger>,
    done: ExternalActions,
    pins: Vec<bool>,
    masses: Vec<f64>,
    steps: usize,
}

impl Watched {
    /// A body of springs.
    pub fn new(setup: &Setup, parts: &Parts, gravity: Vec3) -> Result<Self, Stop> {
        Self::of(setup, &parts.definition(), gravity)
    }

    /// A body of this definition, with the storage and the solver of the setup.
    pub fn of(setup: &Setup, definition: &BodyDefinition, gravity: Vec3) -> Result<Self, Stop> {
        let definition = BodyDefinition {
            storage: setup.storage,
            solver: setup.solver,
            ..*definition
        };
        let world = WorldDefinition { gravity, ..FREE };
        let first = match Scene::with_dust(&definition, world) {
            Err(Error::Unsupported(why)) if setup.solver != Solver::Verlet => return Err(Stop::Unsupported(why)),
            Err(error) => return fault(format!("creation: {error}")),
            Ok(scene) => scene,
        };
        // The ids are valid in both worlds.
        let bytes = first.world.save().expect("a snapshot");
        let second = Scene {
            world: World::load(&bytes, 2, None).expect("a world"),
            ..first
        };
        let scenes = vec![first, second];
        let fine = WorldDefinition {
            gravity,
            substeps: 1,
            ..FREE
        };
        let fine = (setup.solver == Solver::Verlet).then(|| Scene::new(&definition, fine).expect("the same body"));
        let body = scenes[0].body();
        let masses: Vec<f64> = (0..body.node_count())
            .map(|node| f64::from(definition.masses.get(node)))
            .collect();
        let mut watched = Self {
            setup: *setup,
            ledger: Some(Ledger::new(
                setup.solver,
                model(&definition, body, gravity),
                State::of(body, gravity),
            )),
            scenes,
            fine,
            done: ExternalActions::default(),
            pins: masses.iter().map(|&mass| mass == 0.0).collect(),
            masses,
            steps: 0,
        };
        watched.begin_ledger();
        Ok(watched)
    }

    /// Disables the ledger: a tool's work cannot be computed from its mean force.
    pub fn without_ledger(mut self) -> Self {
        self.ledger = None;
        self.fine = None;
        self
    }

    pub fn body(&self) -> &Body {
        self.scenes[0].body()
    }

    pub fn world(&self) -> &World {
        &self.scenes[0].world
    }

    pub fn state(&self) -> State {
        State::of(self.body(), self.world().gravity())
    }

    /// Applies a change to both worlds.
    pub fn change_worlds<T>(&mut self, change: impl Fn(&mut World) -> sinew::Result<T>) -> T {
        let mut results: Vec<T> = self
            .scenes
            .iter_mut()
            .map(|scene| change(&mut scene.world).expect("a change"))
            .collect();
        results.swap_remove(0)
    }

    /// Changes the body; its new energy counts as put in.
    pub fn change(&mut self, change: impl Fn(&mut Body) -> sinew::Result<()>) {
        for scene in self.scenes.iter_mut().chain(&mut self.fine) {
            change(scene.body_mut()).expect("a change");
        }
        self.begin_ledger();
    }

    pub fn pin(&mut self, node: usize) {
        self.pins[node] = true;
        self.change(|body| body.pin(node as u32));
    }

    pub fn unpin(&mut self, node: usize) {
        self.pins[node] = false;
        self.change(|body| body.unpin(node as u32));
    }

    pub fn remove_spring(&mut self, [a, b]: [u32; 2]) {
        if let Some(ledger) = &mut self.ledger {
            ledger.model.springs.retain(|&(nodes, ..)| nodes != [a, b]);
        }
        self.change(|body| body.remove_spring(a, b));
    }

    /// Moves a pin in the next step.
    pub fn move_pin(&mut self, node: usize, to: Vec3) {
        self.done.moves.push((node, to));
        for scene in &mut self.scenes {
            scene.body_mut().move_pin(node as u32, to).expect("a pin");
        }
    }

    /// Applies a force to a node in the next step.
    pub fn push(&mut self, node: usize, force: Vec3) {
        self.done.pushes.push((node, force));
        for scene in &mut self.scenes {
            scene.body_mut().apply_force(node as u32, force).expect("a node");
        }
    }

    /// Steps by `dt`, and checks everything that must hold after any step.
    pub fn step(&mut self, dt: f32) -> Result<StepReport, Stop> {
        let before = self.state();
        let mut report = self.advance(dt)?;
        let done = std::mem::take(&mut self.done);
        if !self.follow(&before, &done, dt, report.substeps)? {
            // A world of fixed substeps uses a limit that holds for all positions, until it must compute a new one.
            self.rewind(&before, &done);
            report = self.advance(dt)?;
            if !self.follow(&before, &done, dt, report.substeps)? {
                return fault(format!("step {} of {dt} s: its substeps are refused", self.steps));
            }
        }
        let after = self.state();
        let name = |what: &str| format!("step {} of {dt} s: {what}", self.steps);
        if !after.is_finite() {
            return fault(name("not finite"));
        }
        for node in (0..self.pins.len()).filter(|&node| self.pins[node]) {
            let force = self.body().pin_force(node as u32).expect("a pin");
            if !force.is_finite() {
                return fault(name(&format!("pin {node} holds with {force}")));
            }
        }
        if let Some(ledger) = &mut self.ledger {
            let result = ledger.end_step(self.scenes[0].body(), &before, &after, &done, dt, &report);
            result.map_err(|stop| match stop {
                Stop::Fault(what) => Stop::Fault(format!("step {} of {dt} s: {what}", self.steps)),
                Stop::Exceeds { what, figure, bound } => Stop::Exceeds {
                    what: format!("step {} of {dt} s: {what}", self.steps),
                    figure,
                    bound,
                },
                stop => stop,
            })?;
        }
        Ok(report)
    }

    /// Takes `count` steps.
    pub fn run(&mut self, dt: f32, count: usize) -> Result<(), Stop> {
        (0..count).try_for_each(|_| self.step(dt).map(drop))
    }

    /// Steps an undisturbed body that damping brings to rest within `duration` seconds. Returns true if there was
    /// enough time; in the quick tier short steps do not suffice. The first steps are checked in full, later ones once
    /// in a hundred.
    pub fn settle(&mut self, dt: f32, duration: f64) -> Result<bool, Stop> {
        let needed = self.setup.steps(duration, 10, usize::MAX);
        let count = needed.min(self.setup.pick(8_000, usize::MAX));
        let careful = count.min(self.setup.pick(200, 1000));
        self.run(dt, careful)?;
        for left in (0..count - careful).rev() {
            if left % 100 == 0 {
                self.catch_up();
                self.step(dt)?;
            } else {
                self.advance(dt)?;
            }
        }
        Ok(count == needed)
    }

    pub fn figures(&self) -> String {
        self.ledger.as_ref().map(Ledger::figures).unwrap_or_default()
    }

    /// Takes the substeps of a step one by one and passes them to the ledger. Returns true if the step was taken this
    /// way.
    fn follow(&mut self, before: &State, done: &ExternalActions, dt: f32, substeps: u32) -> Result<bool, Stop> {
        let (Some(fine), Some(ledger)) = (&mut self.fine, &mut self.ledger) else {
            return Ok(true);
        };
        let substep = f64::from(dt) / f64::from(substeps);
        for index in 1..=substeps {
            let left = (1.0 - f64::from(index) / f64::from(substeps)) as f32;
            let body = fine.body_mut();
            for &(node, to) in &done.moves {
                let displacement = to - before.positions[node].as_vec3();
                body.move_pin(node as u32, to - displacement * left).expect("a pin");
            }
            for &(node, force) in &done.pushes {
                body.apply_force(node as u32, force).expect("a node");
            }
            match fine.world.step(substep as f32) {
                Ok(report) if report.bodies_restored == 0 => {}
                Err(Error::Unstable { .. }) if index == 1 => return Ok(false),
                other => {
                    return fault(format!(
                        "substep {index} of {substeps} as a step of {substep:e} s: {other:?}"
                    ));
                }
            }
            if index == 1 {
                ledger.begin_step(before, done, substep);
            }
            ledger.take_substep(fine.body().positions());
        }
        self.catch_up();
        Ok(true)
    }

    /// Copies the state to the world that takes single substeps, unless it has that state.
    fn catch_up(&mut self) {
        if let Some(fine) = &mut self.fine {
            let body = self.scenes[0].body();
            if fine.body().positions() != body.positions() || fine.body().velocities() != body.velocities() {
                put(fine.body_mut(), body.positions(), body.velocities());
            }
        }
    }

    /// Restores a state in all worlds, with the pending actions.
    fn rewind(&mut self, before: &State, done: &ExternalActions) {
        let single = |vectors: &[DVec3]| -> Vec<Vec3> { vectors.iter().map(|v| v.as_vec3()).collect() };
        let (positions, velocities) = (single(&before.positions), single(&before.velocities));
        for scene in self.scenes.iter_mut().chain(&mut self.fine) {
            put(scene.body_mut(), &positions, &velocities);
        }
        // A refused step keeps its forces.
        if let Some(fine) = &mut self.fine {
            for &(node, force) in &done.pushes {
                fine.body_mut().apply_force(node as u32, -force).expect("a node");
            }
        }
        let ExternalActions { moves, pushes } = done.clone();
        moves.into_iter().for_each(|(node, to)| self.move_pin(node, to));
        pushes.into_iter().for_each(|(node, force)| self.push(node, force));
        self.done = ExternalActions::default();
    }

    /// Steps both worlds, which must agree, or refuse without changes.
    fn advance(&mut self, dt: f32) -> Result<StepReport, Stop> {
        if self.steps == STEPS_OF_BOTH {
            self.scenes.truncate(1);
            for scene in &mut self.scenes {
                let dust = scene.dust.take().expect("dust");
                scene.world.destroy_body(dust).expect("dust");
            }
        }
        self.steps += 1;
        let name = format!("step {} of {dt} s", self.steps);
        let is_hashed = self.steps <= STEPS_HASHED || self.steps.is_multiple_of(STEPS_HASHED);
        let mut before = is_hashed.then(|| hashes(&self.scenes));
        let mut outcomes = step_all(&mut self.scenes, dt);
        if matches!(outcomes[0], Err(Error::Unstable { .. })) && before.is_none() {
            // The step is refused again, from a known state.
            before = Some(hashes(&self.scenes));
            outcomes = step_all(&mut self.scenes, dt);
        }
        let after = before.is_some().then(|| hashes(&self.scenes));
        let all_the_same = |hashes: &Vec<u64>| hashes.iter().all(|hash| *hash == hashes[0]);
        let shown = |scene: &Scene| (scene.body().positions().to_vec(), scene.body().velocities().to_vec());
        if outcomes.iter().any(|outcome| *outcome != outcomes[0])
            || !after.as_ref().is_none_or(all_the_same)
            || self.scenes[1..]
                .iter()
                .any(|scene| shown(scene) != shown(&self.scenes[0]))
        {
            return fault(format!("{name}: one thread and two threads differ"));
        }
        match outcomes.swap_remove(0) {
            Ok(report) if report.bodies_restored > 0 => fault(format!("{name}: would not have been finite")),
            Ok(report) => Ok(report),
            Err(Error::Unstable { report, allowed }) => {
                if before != after {
                    return fault(format!("{name}: a refused step changed the state"));
                }
                if self.setup.solver != Solver::Verlet {
                    return fault(format!("{name}: {:?} refuses", self.setup.solver));
                }
                // Substeps are 0.8 of the limit.
                let needed = f64::from(dt) / (0.8 * f64::from(report.stable_substep));
                if needed < 0.999 * f64::from(allowed) {
                    return fault(format!(
                        "{name}: refused where {needed:.1} substeps would do: {report:?}"
                    ));
                }
                Err(Stop::Refused(format!("needs {needed:.2e} substeps")))
            }
            Err(error) => fault(format!("{name}: {error}")),
        }
    }

    fn begin_ledger(&mut self) {
        let state = self.state();
        if let Some(ledger) = &mut self.ledger {
            for ((mass, own), pinned) in ledger.model.masses.iter_mut().zip(&self.masses).zip(&self.pins) {
                *mass = if *pinned { 0.0 } else { *own };
            }
            ledger.restart(state);
        }
    }
}

/// Sets the state of a body without history.
fn put(body: &mut Body, positions: &[Vec3], velocities: &[Vec3]) {
    body.set_positions(positions).expect("positions");
    body.set_velocities(velocities).expect("velocities");
}

fn hashes(scenes: &[Scene]) -> Vec<u64> {
    scenes.iter().map(|scene| scene.world.state_hash()).collect()
}

fn step_all(scenes: &mut [Scene], dt: f32) -> Vec<sinew::Result<StepReport>> {
    scenes.iter_mut().map(|scene| scene.world.step(dt)).collect()
}

/// Returns the body in `f64`.
fn model(definition: &BodyDefinition, body: &Body, gravity: Vec3) -> Reference {
    assert!(matches!(definition.spring_dampings, Values::Uniform(_)));
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let pairs = match definition.springs {
        Some(springs) => springs.to_vec(),
        None => body.spring_pairs().expect("memory"),
    };
    let springs = (0..).zip(&pairs).map(|(index, &[a, b])| {
        let length = match definition.rest_lengths {
            Some(lengths) => f64::from(lengths[index]),
            None => rest[a as usize].as_dvec3().distance(rest[b as usize].as_dvec3()),
        };
        ([a, b], f64::from(definition.stiffnesses.get(index)), length)
    });
    let each = |values: Values| -> Vec<f64> {
        (0..definition.positions.len())
            .map(|node| f64::from(values.get(node)))
            .collect()
    };
    Reference::new(
        definition.positions.iter().map(|p| p.as_dvec3()).collect(),
        each(definition.masses),
        each(definition.node_dampings),
        springs.collect(),
        gravity.as_dvec3(),
    )
}

/// Returns the momentum of the free nodes, and the sum of its magnitudes (N s).
pub fn momentum(state: &State, masses: &[f32]) -> (DVec3, f64) {
    let momenta = state.velocities.iter().zip(masses).map(|(v, &m)| *v * f64::from(m));
    momenta.fold((DVec3::ZERO, 0.0), |(sum, size), p| (sum + p, size + p.length()))
}
