//! Every call on a world succeeds or changes nothing, and leaks nothing, with any amount of memory. A separate program.
#![allow(unsafe_code)]
#![allow(clippy::expect_used)]

#[path = "../snapshots/acts.rs"]
mod acts;

use super::allocator::{allow, held, with};
use acts::Caller;
use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, BodyId, EmbeddingDefinition, Error, Material, Model, Result, Solver, SpringLaw,
    Storage, TearReport, Tearing, Values, World, WorldDefinition,
};

/// The result of a call that was repeated until memory sufficed.
struct Outcome<T> {
    done: T,
    /// The number of calls that ran out of memory.
    failed: usize,
    /// The memory that the result holds [bytes].
    held: isize,
}

/// Calls `act` with memory for 0, 1, 2 ... requests until it succeeds. Calls `look` after each failure.
fn retry_until_done<T>(mut act: impl FnMut() -> Result<T>, mut after_failure: impl FnMut()) -> Outcome<T> {
    let before = held();
    let mut failed = 0;
    loop {
        match with(failed, &mut act) {
            Ok(done) => {
                let held = held() - before;
                return Outcome { done, failed, held };
            }
            Err(error) => assert!(matches!(error, Error::OutOfMemory), "request {failed}: {error}"),
        }
        after_failure();
        failed += 1;
    }
}

/// Calls `act` with unlimited memory. A repeated call that holds no more than this has leaked nothing.
fn call_once<T>(act: impl FnOnce() -> Result<T>) -> Outcome<T> {
    let before = held();
    let done = act().expect("memory for it");
    let held = held() - before;
    Outcome { done, failed: 0, held }
}

#[test]
fn leaks_are_detected() {
    fn two_buffers(is_careless: bool) -> Result<[Vec<u8>; 2]> {
        let mut buffers = [Vec::new(), Vec::new()];
        for number in 0..2 {
            if buffers[number].try_reserve_exact(100).is_err() {
                if is_careless {
                    std::mem::forget(buffers);
                }
                return Err(Error::OutOfMemory);
            }
        }
        Ok(buffers)
    }
    for is_careless in [false, true] {
        let outcome = retry_until_done(|| two_buffers(is_careless), || ());
        let at_once = call_once(|| two_buffers(is_careless));
        assert_eq!(outcome.failed, 2);
        assert_eq!(outcome.held != at_once.held, is_careless);
    }
}

fn plain_world() -> World {
    World::new(WorldDefinition::default()).expect("a world")
}

#[test]
fn a_world_is_loaded_completely_or_not_at_all() {
    let mut failed = 0;
    for seed in [1, 4, 9] {
        let mut caller = Caller::new(seed);
        let mut worlds = [World::new(WorldDefinition {
            max_substeps: 40,
            ..WorldDefinition::default()
        })
        .expect("a world")];
        for _ in 0..6 {
            for _ in 0..4 {
                caller.act(&mut worlds);
            }
            caller.step(&mut worlds);
        }
        let world = &worlds[0];
        assert!(matches!(with(0, || world.save()), Err(Error::OutOfMemory)));
        let bytes = world.save().expect("bytes");
        let mut requests = 0;
        let loaded = loop {
            let before = held();
            match with(requests, || World::load(&bytes, 1, None)) {
                Ok(world) => break world,
                Err(error) => assert!(matches!(error, Error::OutOfMemory), "request {requests}: {error}"),
            }
            assert_eq!(held(), before, "a failed load must free everything");
            requests += 1;
            failed += 1;
        };
        assert!(loaded.save().expect("bytes") == bytes);
    }
    assert!(failed > 100, "{failed} requests failed");
}

#[test]
fn calls_without_memory_change_nothing() {
    let mut failed = 0;
    let mut done = std::collections::BTreeMap::<&str, usize>::new();
    for seed in 10..18 {
        let mut caller = Caller::new(seed);
        caller.scarce = Some(allow);
        let mut worlds = [World::new(WorldDefinition {
            max_substeps: 40,
            ..WorldDefinition::default()
        })
        .expect("a world")];
        for _ in 0..12 {
            for _ in 0..3 {
                caller.act(&mut worlds);
            }
            caller.step(&mut worlds);
        }
        failed += caller.failed;
        for (act, count) in caller.done {
            *done.entry(act).or_default() += count;
        }
    }
    for act in [
        "a plainer body",
        "a tool",
        "a cut",
        "a blade",
        "a spring added",
        "a suture",
        "an attachment",
        "springs set",
    ] {
        assert!(done.get(act).is_some_and(|&count| count > 0), "{act}: never");
    }
    assert!(failed > 1000, "{failed}");
}

#[test]
fn a_world_is_created_completely_or_not_at_all() {
    use sinew::capi::status::{SINEW_STATUS_OK, SINEW_STATUS_OUT_OF_MEMORY};
    use sinew::capi::world::{sinew_world_create, sinew_world_def, sinew_world_def_init, sinew_world_destroy};
    let mut definition = std::mem::MaybeUninit::<sinew_world_def>::zeroed();
    // SAFETY: the definition has this size.
    let status = unsafe { sinew_world_def_init(definition.as_mut_ptr(), size_of::<sinew_world_def>()) };
    assert_eq!(status, SINEW_STATUS_OK);
    let before = held();
    let mut failed = 0;
    loop {
        let mut world = std::ptr::null_mut();
        // SAFETY: the definition was initialized above, and `world` can be written.
        let status = with(failed, || unsafe {
            sinew_world_create(definition.as_ptr(), &raw mut world)
        });
        if status == SINEW_STATUS_OK {
            // SAFETY: the world was created above.
            unsafe { sinew_world_destroy(world) };
            break;
        }
        assert!(status == SINEW_STATUS_OUT_OF_MEMORY && world.is_null());
        failed += 1;
    }
    assert!(failed > 0, "a world that needs no memory");
    assert_eq!(held(), before);
}

/// A name, and its change of a definition.
type Kind = (&'static str, fn(&mut BodyDefinition));

/// Optional features of a block besides springs.
const KINDS: [Kind; 5] = [
    ("springs", |_| ()),
    ("damped springs that may be cut", |body| {
        (body.spring_dampings, body.spare_nodes) = (Values::Uniform(1e-2), 60);
    }),
    ("elements", |body| {
        (body.masses, body.stiffnesses) = (Values::Uniform(0.0), Values::Uniform(0.0));
        body.material = Some(Material {
            model: Model::Tetrahedra,
            young_modulus: 3e3,
            poisson_ratio: 0.45,
            density: 1000.0,
            thickness: 0.0,
        });
    }),
    ("terms", |body| {
        (body.volume_stiffness, body.bending_stiffness) = (1e4, 1e-6);
        (body.home_stiffnesses, body.enclosed_stiffness) = (Values::Uniform(0.1), 100.0);
        body.spring_law = SpringLaw::Cubic {
            quadratic: 0.5,
            cubic: 1.0,
            limit: 0.5,
        };
    }),
    ("contact", |body| {
        body.contact = BodyContact {
            with_bodies: true,
            with_itself: true,
            thickness: 1e-3,
            ..BodyContact::default()
        };
    }),
];

#[test]
fn a_body_of_any_kind_is_created_completely_or_not_at_all() {
    let mesh = Mesh::block([0.1; 3], [2, 1, 2]).expect("a block");
    let mut all = 0;
    for storage in [
        Storage::Packed,
        Storage::Efficient,
        Storage::FastLink,
        Storage::DynamicBulk,
    ] {
        for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
            for (kind, change) in KINDS {
                let mut definition = BodyDefinition {
                    positions: &mesh.positions,
                    triangles: &mesh.triangles,
                    tetrahedra: &mesh.tetrahedra,
                    masses: Values::Uniform(1e-3),
                    stiffnesses: Values::Uniform(20.0),
                    storage,
                    springs_per_node: 60,
                    solver,
                    ..BodyDefinition::default()
                };
                change(&mut definition);
                // The world has a body of the same kind. Afterwards it continues like a world that never ran out of
                // memory.
                let world = || {
                    let mut world = plain_world();
                    world.create_body(&definition).expect("a body");
                    world.step(1e-3).expect("a step");
                    world
                };
                let [scarce, plenty] = [(); 2].map(|()| std::cell::RefCell::new(world()));
                let hash = plenty.borrow().state_hash();
                // A world that was called before keeps spare capacity and requests less, so a new world is also tried
                // each time.
                let mut other = world();
                let mut requests = 0;
                while let Err(error) = with(requests, || other.create_body(&definition)) {
                    assert!(matches!(error, Error::OutOfMemory), "request {requests}: {error}");
                    assert_eq!(other.state_hash(), hash, "{storage:?}, {solver:?}, {kind}");
                    other = world();
                    requests += 1;
                }
                all += requests;
                let outcome = retry_until_done(
                    || scarce.borrow_mut().create_body(&definition),
                    || assert_eq!(scarce.borrow().state_hash(), hash, "{storage:?}, {solver:?}, {kind}"),
                );
                all += outcome.failed;
                let at_once = call_once(|| plenty.borrow_mut().create_body(&definition));
                assert_eq!(outcome.held, at_once.held, "{storage:?}, {solver:?}, {kind}");
                for world in [&scarce, &plenty] {
                    world.borrow_mut().step(1e-3).expect("a step");
                }
                assert_eq!(scarce.borrow().state_hash(), plenty.borrow().state_hash());
            }
        }
    }
    assert!(all > 60 * 20, "{all} requests failed");
}

#[test]
fn an_embedding_is_created_completely_or_not_at_all() {
    let block = Mesh::block([0.1; 3], [2, 2, 2]).expect("a block");
    let sheet = Mesh::cloth([0.1; 2], [4, 4]).expect("a sheet");
    let fine = Mesh::block([0.09; 3], [4, 4, 4]).expect("a fine block");
    let blade = Sweep {
        start: [vec3(0.01, -0.1, -0.1), vec3(0.01, 0.1, -0.1)],
        end: [vec3(0.01, -0.1, 0.0), vec3(0.01, 0.1, 0.0)],
    };
    for (mesh, is_cut) in [(&block, false), (&block, true), (&sheet, false), (&sheet, true)] {
        let mut world = plain_world();
        let body = world.create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            tetrahedra: &mesh.tetrahedra,
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(20.0),
            spare_nodes: 300,
            ..BodyDefinition::default()
        });
        let body = body.expect("a body");
        if is_cut {
            world.cut(body, &blade).expect("a cut");
        }
        let definition = EmbeddingDefinition {
            vertices: &fine.positions,
            triangles: &fine.triangles,
            tetrahedra: &mesh.tetrahedra,
        };
        let bound = retry_until_done(|| world.create_embedding(body, &definition), || ());
        let at_once = call_once(|| world.create_embedding(body, &definition));
        assert_eq!(bound.held, at_once.held);
        let (mut embedding, mut other) = (bound.done, at_once.done);
        let back = Sweep {
            start: blade.end,
            end: blade.end.map(|corner| corner + Vec3::Z * 0.1),
        };
        world.cut(body, &back).expect("a cut");
        world.step(1e-3).expect("a step");
        // The embedding follows the cut, or stays unchanged until memory suffices.
        let followed = retry_until_done(|| embedding.update(&world), || ());
        call_once(|| other.update(&world));
        assert_eq!(embedding.positions(), other.positions());
        assert_eq!(embedding.triangles(), other.triangles());
        assert!(
            bound.failed > 3 && followed.failed > 3,
            "{} and {} requests failed",
            bound.failed,
            followed.failed
        );
    }
}

#[test]
fn a_body_is_created_from_a_surface_completely_or_not_at_all() {
    let surface = Mesh::block([0.1; 3], [2, 2, 2]).expect("a block");
    let definition = BodyDefinition {
        positions: &surface.positions,
        triangles: &surface.triangles,
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(20.0),
        ..BodyDefinition::default()
    };
    let mut world = plain_world();
    let empty = world.state_hash();
    let mut requests = 0;
    while let Err(error) = with(requests, || world.create_body_from_surface(&definition, 0.03)) {
        assert!(matches!(error, Error::OutOfMemory), "request {requests}: {error}");
        assert_eq!(world.state_hash(), empty, "request {requests}");
        requests += 1;
    }
    assert!(requests > 50, "{requests} requests failed");
    let mut other = plain_world();
    { other.create_body_from_surface(&definition, 0.03) }.expect("tissue");
    assert_eq!(world.state_hash(), other.state_hash());
}

#[test]
fn a_body_is_created_from_a_surface_in_c_completely_or_not_at_all() {
    use sinew::capi::body::sinew_body_id;
    use sinew::capi::definition::{sinew_body_def, sinew_body_def_init};
    use sinew::capi::embedding::{sinew_body_create_from_surface, sinew_embedding_destroy};
    use sinew::capi::status::{SINEW_STATUS_OK, SINEW_STATUS_OUT_OF_MEMORY};
    use sinew::capi::world::{
        sinew_world_create, sinew_world_def, sinew_world_def_init, sinew_world_destroy, sinew_world_get_state_hash,
    };
    let surface = Mesh::block([0.1; 3], [2, 2, 2]).expect("a block");
    let mut requests = 0;
    // SAFETY: pointers are to live variables and lists of the lengths given, and the world is used only before its end.
    let mut attempt = || unsafe {
        let mut world_def = std::mem::zeroed::<sinew_world_def>();
        let done = sinew_world_def_init(&mut world_def, size_of_val(&world_def));
        assert_eq!(done, SINEW_STATUS_OK);
        let mut world = std::ptr::null_mut();
        assert_eq!(sinew_world_create(&world_def, &mut world), SINEW_STATUS_OK);
        let hash = || {
            let mut hash = 0;
            assert_eq!(sinew_world_get_state_hash(world, &mut hash), SINEW_STATUS_OK);
            hash
        };
        let before = hash();
        let mut def = std::mem::zeroed::<sinew_body_def>();
        let done = sinew_body_def_init(&mut def, size_of_val(&def));
        assert_eq!(done, SINEW_STATUS_OK);
        (def.positions, def.node_count) = (surface.positions.as_ptr().cast(), surface.positions.len());
        (def.triangles, def.triangle_count) = (surface.triangles.as_ptr().cast(), surface.triangles.len());
        (def.node_mass, def.stiffness) = (1e-3, 20.0);
        let mut body = sinew_body_id {
            index1: 0,
            generation: 0,
        };
        let mut new_embedding = std::ptr::null_mut();
        let status = with(requests, || {
            sinew_body_create_from_surface(world, &def, 0.03, &mut body, &mut new_embedding)
        });
        let is_made = status == SINEW_STATUS_OK;
        if !is_made {
            assert_eq!(status, SINEW_STATUS_OUT_OF_MEMORY, "request {requests}");
            assert_eq!(hash(), before, "request {requests}");
        }
        assert_eq!(body.index1 == 1, is_made, "request {requests}");
        assert_eq!(!new_embedding.is_null(), is_made, "request {requests}");
        sinew_embedding_destroy(new_embedding);
        sinew_world_destroy(world);
        requests += 1;
        is_made
    };
    // In a new world each time, because a world keeps its capacity.
    while !attempt() {}
    assert!(requests > 50, "{requests} requests failed");
}

/// Creates a sheet that is pulled apart and tears.
fn pulled_sheet() -> (World, BodyId) {
    let mesh = Mesh::cloth([0.1; 2], [8, 4]).expect("a sheet");
    let stretched: Vec<Vec3> = mesh.positions.iter().map(|node| *node * vec3(1.5, 1.0, 1.0)).collect();
    let mut world = plain_world();
    let body = world.create_body(&BodyDefinition {
        positions: &stretched,
        rest_positions: Some(&mesh.positions),
        triangles: &mesh.triangles,
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(20.0),
        spare_nodes: 200,
        tearing: Tearing {
            strain: 0.3,
            most_per_step: 3,
            ..Tearing::default()
        },
        ..BodyDefinition::default()
    });
    (world, body.expect("a sheet"))
}

#[test]
fn a_step_without_memory_postpones_tears() {
    let mass = |world: &World, body| {
        let body = world.body(body).expect("a sheet");
        (0..body.node_count() as u32)
            .map(|node| f64::from(body.node_mass(node).expect("a mass")))
            .sum::<f64>()
    };
    let report = |world: &World, body| world.body(body).expect("a sheet").tear_report();
    let (mut plenty, body) = pulled_sheet();
    let before = mass(&plenty, body);
    plenty.step(1e-3).expect("a step");
    let expected = report(&plenty, body);
    assert!(expected.tears > 0 && expected.no_room == 0, "{expected:?}");
    let mut failed = 0;
    loop {
        let (mut world, body) = pulled_sheet();
        with(failed, || world.step(1e-3)).expect("a step");
        let first = report(&world, body);
        for _ in 0..3 {
            assert!((mass(&world, body) - before).abs() < 1e-6 * before);
            world.step(1e-3).expect("a step with memory");
        }
        assert!(
            world.body(body).expect("a sheet").topology_version() > 0,
            "request {failed}: nothing tore"
        );
        if first == expected {
            break;
        }
        let processed = |report: TearReport| report.tears + report.waiting + report.no_room + report.small_pieces;
        assert!(
            processed(first) >= processed(expected),
            "request {failed}: {first:?} and {expected:?}"
        );
        failed += 1;
    }
    assert!(failed > 5, "{failed} requests failed");
}
