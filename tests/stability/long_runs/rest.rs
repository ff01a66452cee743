//! Static equilibria, each computed once for all rows.

use std::collections::HashMap;
use std::sync::Mutex;

use glam::Vec3;
use sinew::{Error, Solver};

use super::scene::Scene;
use super::subject::Subject;

/// Results by name.
pub type Known<T> = Mutex<Option<HashMap<String, T>>>;

/// The result of `find`, computed once for each name.
pub fn once<T: Clone>(results: &Known<T>, name: &str, find: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let mut results = results.lock().expect("nobody has panicked");
    let results = results.get_or_insert_default();
    if let Some(found) = results.get(name) {
        return Ok(found.clone());
    }
    let found = find()?;
    results.insert(name.into(), found.clone());
    Ok(found)
}

/// The positions in static equilibrium, pinned at one end unless the body is free.
pub fn rest_shape(subject: &Subject, gravity: Vec3, is_free: bool) -> Result<Vec<Vec3>, Error> {
    static SHAPES: Known<Vec<Vec3>> = Mutex::new(None);
    let name = format!("{} {gravity} {is_free}", subject.matter);
    once(&SHAPES, &name, || {
        let mut scene = Scene::new(&subject.definition(Solver::Verlet), gravity);
        if !is_free {
            scene.pin(&subject.ends[0]);
        }
        scene.rest()?;
        Ok(scene.body().positions().to_vec())
    })
}

/// The energy in static equilibrium, J.
pub fn energy_at_rest(subject: &Subject, gravity: Vec3, is_free: bool) -> Result<f64, Error> {
    let mut scene = Scene::new(&subject.definition(Solver::Verlet), gravity);
    let rest = rest_shape(subject, gravity, is_free)?;
    scene.body_mut().set_positions(&rest).expect("positions");
    Ok(scene.energy())
}
