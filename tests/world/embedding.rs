//! Embeddings: fine render surfaces bound to coarse bodies.
#![allow(clippy::unwrap_used)]

use glam::{Affine3A, DMat3, DVec3, Mat3A, Quat, Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, Embedding, EmbeddingDefinition, Error, Material, Model, Pose, Shape, ToolDefinition,
    Values, World, WorldDefinition,
};

use crate::support::solid::ball;

fn world() -> World {
    World::new(WorldDefinition {
        gravity: vec3(0.0, -9.81, 0.0),
        ..WorldDefinition::default()
    })
    .unwrap()
}

/// Creates a soft block of 6 x 4 x 5 cm of springs.
fn block(world: &mut World) -> (BodyId, Mesh) {
    let mesh = Mesh::block([0.06, 0.04, 0.05], [6, 4, 5]).unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            tetrahedra: &mesh.tetrahedra,
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(30.0),
            ..BodyDefinition::default()
        })
        .unwrap();
    (body, mesh)
}

/// Returns a generator of pseudo-random numbers from -1 to 1.
fn numbers() -> impl FnMut() -> f32 {
    let mut seed = 12_u32;
    move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// Returns an affine map with stretch, shear, rotation and translation.
fn motion() -> Affine3A {
    let shape = Mat3A::from_cols(
        vec3(1.3, 0.2, -0.1).into(),
        vec3(-0.3, 0.8, 0.15).into(),
        vec3(0.05, 0.4, 1.1).into(),
    );
    let rotated = Mat3A::from_quat(Quat::from_axis_angle(vec3(0.6, 0.0, 0.8), 1.1)) * shape;
    Affine3A {
        matrix3: rotated,
        translation: vec3(0.2, -0.1, 0.3).into(),
    }
}

#[test]
fn an_affine_motion_of_the_body_moves_the_surface_affinely() {
    let mut world = world();
    let (body, mesh) = block(&mut world);
    // Inside the block and partly outside.
    let mut fine_mesh = ball(0.024, 4);
    let mut number = numbers();
    for position in &mut fine_mesh.positions {
        *position += 0.001 * vec3(number(), number(), number());
    }
    let mut embedding = world
        .create_embedding(
            body,
            &EmbeddingDefinition {
                vertices: &fine_mesh.positions,
                triangles: &fine_mesh.triangles,
                tetrahedra: &mesh.tetrahedra,
            },
        )
        .unwrap();
    assert!(
        fine_mesh.positions.iter().any(|position| position.y.abs() > 0.0205),
        "all are inside"
    );
    let motion = motion();
    let moved: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|&position| motion.transform_point3(position))
        .collect();
    world.body_mut(body).unwrap().set_positions(&moved).unwrap();
    embedding.update(&world).unwrap();
    let exact = |position: Vec3| {
        let shape = DMat3::from_cols_array(&motion.matrix3.to_cols_array().map(f64::from));
        shape * position.as_dvec3() + motion.translation.as_dvec3()
    };
    // The tolerance is relative to 0.4 m, the distance from the origin, because nodes are rounded.
    for (position, &from) in embedding.positions().iter().zip(&fine_mesh.positions) {
        let error = position.as_dvec3().distance(exact(from));
        assert!(error < 1e-6 * 0.4, "{from}: {error} m");
    }
    let positions: Vec<DVec3> = fine_mesh.positions.iter().map(|&position| exact(position)).collect();
    assert_normals(&positions, &fine_mesh.triangles, embedding.normals(), 1e-4);
}

/// Checks that normals are the area-weighted normals of the vertices' triangles, computed in f64.
fn assert_normals(positions: &[DVec3], triangles: &[[u32; 3]], normals: &[Vec3], tolerance: f64) {
    let mut exact = vec![DVec3::ZERO; positions.len()];
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        for vertex in triangle {
            exact[vertex as usize] += (b - a).cross(c - a);
        }
    }
    assert_eq!(exact.len(), normals.len());
    for (normal, exact) in normals.iter().zip(exact) {
        let error = normal.as_dvec3().distance(exact.normalize());
        assert!(error < tolerance, "{normal} is {error} off");
    }
}

#[test]
fn normals_of_a_ball_point_outward() {
    // Normals must neither vanish nor overflow for very small and very large surfaces.
    for radius in [1e-7_f32, 0.01, 1e8] {
        let fine_mesh = ball(radius, 3);
        let mut world = world();
        let host = Mesh::block([2.0 * radius; 3], [2, 2, 2]).unwrap();
        let body = world
            .create_body(&BodyDefinition {
                positions: &host.positions,
                tetrahedra: &host.tetrahedra,
                masses: Values::Uniform(1.0),
                stiffnesses: Values::Uniform(1.0),
                ..BodyDefinition::default()
            })
            .unwrap();
        let mut embedding = world
            .create_embedding(
                body,
                &EmbeddingDefinition {
                    vertices: &fine_mesh.positions,
                    triangles: &fine_mesh.triangles,
                    tetrahedra: &host.tetrahedra,
                },
            )
            .unwrap();
        for (normal, position) in embedding.normals().iter().zip(&fine_mesh.positions) {
            // Triangles around some corners of an icosahedron are larger on one side.
            assert!(
                normal.distance(position.normalize()) < 0.03,
                "{radius} m: {normal} at {position}"
            );
        }
    }
}

#[test]
fn vertices_over_a_sheet_keep_their_height() {
    let mut world = world();
    let mesh = Mesh::cloth([0.1, 0.1], [10, 10]).unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(30.0),
            ..BodyDefinition::default()
        })
        .unwrap();
    let up = {
        let [a, b, c] = mesh.triangles[0].map(|node| mesh.positions[node as usize]);
        (b - a).cross(c - a).normalize()
    };
    let mut number = numbers();
    let vertices: Vec<Vec3> = (0..500)
        .map(|_| {
            let position = 0.049 * vec3(number(), number(), number());
            position - up * position.dot(up) + up * 0.004 * number()
        })
        .collect();
    let mut embedding = world
        .create_embedding(
            body,
            &EmbeddingDefinition {
                vertices: &vertices,
                ..EmbeddingDefinition::default()
            },
        )
        .unwrap();
    assert_eq!(
        embedding.positions(),
        vertices_within(embedding.positions(), &vertices, 1e-7)
    );
    // A rigid motion of the sheet.
    let turn = Quat::from_axis_angle(vec3(0.0, 0.6, 0.8), 2.0);
    let shift = vec3(0.1, 0.2, -0.1);
    let moved: Vec<Vec3> = mesh.positions.iter().map(|&position| turn * position + shift).collect();
    world.body_mut(body).unwrap().set_positions(&moved).unwrap();
    embedding.update(&world).unwrap();
    let expected: Vec<Vec3> = vertices.iter().map(|&position| turn * position + shift).collect();
    vertices_within(embedding.positions(), &expected, 3e-7);
    // When the sheet is stretched in its plane, heights stay constant.
    let stretched: Vec<Vec3> = mesh.positions.iter().map(|&position| 2.0 * position).collect();
    world.body_mut(body).unwrap().set_positions(&stretched).unwrap();
    embedding.update(&world).unwrap();
    let expected: Vec<Vec3> = vertices
        .iter()
        .map(|&position| 2.0 * position - up * position.dot(up))
        .collect();
    vertices_within(embedding.positions(), &expected, 3e-7);
    assert!(embedding.normals().is_empty());
}

fn vertices_within<'a>(actual: &'a [Vec3], expected: &[Vec3], tolerance: f32) -> &'a [Vec3] {
    assert_eq!(actual.len(), expected.len());
    for (actual, expected) in actual.iter().zip(expected) {
        assert!(actual.distance(*expected) < tolerance, "{actual} instead of {expected}");
    }
    actual
}

/// Creates tissue from a render surface in the shape of a ball.
fn tissue_ball(world: &mut World, times: u32) -> (Mesh, BodyId, Embedding) {
    let fine_mesh = ball(0.03, times);
    let (body, embedding) = world
        .create_body_from_surface(
            &BodyDefinition {
                positions: &fine_mesh.positions,
                triangles: &fine_mesh.triangles,
                material: Some(Material {
                    model: Model::Tetrahedra,
                    young_modulus: 2e4,
                    poisson_ratio: 0.3,
                    density: 1000.0,
                    thickness: 0.0,
                }),
                masses: Values::Uniform(0.0),
                ..BodyDefinition::default()
            },
            0.008,
        )
        .unwrap();
    (fine_mesh, body, embedding)
}

#[test]
fn tissue_from_a_ball_surface_falls_and_lands() {
    let mut world = world();
    let (fine_mesh, body, mut embedding) = tissue_ball(&mut world, 4);
    let mass: f32 = (0..world.body(body).unwrap().node_count() as u32)
        .map(|node| world.body(body).unwrap().node_mass(node).unwrap())
        .sum();
    let volume = 4.0 / 3.0 * std::f32::consts::PI * 0.03_f32.powi(3);
    assert!((mass / (1000.0 * volume) - 1.0).abs() < 0.03, "{mass} kg");
    vertices_within(embedding.positions(), &fine_mesh.positions, 1e-7);
    world
        .create_tool(&ToolDefinition {
            pose: Pose {
                position: vec3(0.0, -0.04, 0.0),
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(Shape::Plane)
        })
        .unwrap();
    let mut deepest = f32::INFINITY;
    for step in 0..200 {
        world.step(0.005).unwrap();
        embedding.update(&world).unwrap();
        let lowest = embedding
            .positions()
            .iter()
            .fold(f32::INFINITY, |low, vertex| low.min(vertex.y));
        // The coarse surface stays above the plane. The render surface exceeds it by the sag of the ball's chords.
        assert!(lowest > -0.042, "step {step}: {lowest}");
        deepest = deepest.min(lowest);
    }
    assert!(deepest < -0.039, "{deepest}");
    let positions: Vec<DVec3> = embedding.positions().iter().map(|vertex| vertex.as_dvec3()).collect();
    assert_normals(&positions, &fine_mesh.triangles, embedding.normals(), 1e-4);
}

#[test]
fn updates_of_an_embedding_change_nothing() {
    let run = |reads: bool| {
        let mut world = world();
        let (_, body, mut embedding) = tissue_ball(&mut world, 2);
        let positions = world.body(body).unwrap().positions().to_vec();
        for _ in 0..20 {
            world.step(0.005).unwrap();
            if reads {
                embedding.update(&world).unwrap();
                embedding.normals();
            }
        }
        assert_ne!(world.body(body).unwrap().positions(), positions);
        world.state_hash()
    };
    assert_eq!(run(false), run(true));
}

#[test]
fn positions_of_a_reader_update_an_embedding_like_the_world() {
    let mut world = world();
    let (_, body, mut embedding) = tissue_ball(&mut world, 2);
    let mut reader = world.create_reader(body).unwrap();
    world.step(0.01).unwrap();
    embedding.update(&world).unwrap();
    let expected = embedding.positions().to_vec();
    world.step(0.01).unwrap();
    embedding.update(&world).unwrap();
    let next = embedding.positions().to_vec();
    assert_ne!(expected, next);
    let address = embedding.positions().as_ptr();
    embedding.update_from(reader.read().positions).unwrap();
    assert_eq!(embedding.positions(), next);
    assert_eq!(embedding.positions().as_ptr(), address);
    let few = reader.read().positions[1..].to_vec();
    let refused = embedding.update_from(&few).unwrap_err();
    assert!(matches!(refused, Error::InvalidArgument(_)), "{refused}");
    assert_eq!(embedding.positions(), next);
    world.destroy_body(body).unwrap();
    assert!(matches!(embedding.update(&world), Err(Error::StaleId(_))));
    assert_eq!(embedding.positions(), next);
}

#[test]
fn invalid_embeddings_are_refused() {
    let mut world = world();
    let (body, mesh) = block(&mut world);
    let fine_mesh = ball(0.02, 1);
    let valid = EmbeddingDefinition {
        vertices: &fine_mesh.positions,
        triangles: &fine_mesh.triangles,
        tetrahedra: &mesh.tetrahedra,
    };
    let hash = world.state_hash();
    let refused = |definition: &EmbeddingDefinition, words: &[&str]| {
        let error = world.create_embedding(body, definition).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, Error::InvalidArgument(_)), "{text}");
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    };
    let none = EmbeddingDefinition { vertices: &[], ..valid };
    refused(&none, &["vertices"]);
    for wrong in [f32::NAN, f32::INFINITY, 2e9] {
        let mut vertices = fine_mesh.positions.clone();
        vertices[7].y = wrong;
        let definition = EmbeddingDefinition {
            vertices: &vertices,
            ..valid
        };
        refused(&definition, &["vertices[7]"]);
    }
    let triangles = [[0, 1, 2], [0, 1, 42]];
    let definition = EmbeddingDefinition {
        triangles: &triangles,
        ..valid
    };
    refused(&definition, &["triangles[1]", "42"]);
    let tetrahedra = [[0, 1, 2, 9999]];
    let definition = EmbeddingDefinition {
        tetrahedra: &tetrahedra,
        ..valid
    };
    refused(&definition, &["tetrahedra[0]", "9999"]);
    let tetrahedra = [[0, 1, 2, 2]];
    let definition = EmbeddingDefinition {
        tetrahedra: &tetrahedra,
        ..valid
    };
    refused(&definition, &["volume"]);
    assert_eq!(world.state_hash(), hash);
    world.destroy_body(body).unwrap();
    assert!(matches!(world.create_embedding(body, &valid), Err(Error::StaleId(_))));
}

#[test]
fn invalid_surfaces_make_no_body() {
    let mut world = world();
    let fine_mesh = ball(0.03, 2);
    let valid = BodyDefinition {
        positions: &fine_mesh.positions,
        triangles: &fine_mesh.triangles,
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(20.0),
        ..BodyDefinition::default()
    };
    let hash = world.state_hash();
    let mut refused = |definition: &BodyDefinition, spacing: f32, word: &str| {
        let error = world.create_body_from_surface(definition, spacing).unwrap_err();
        let text = error.to_string();
        assert!(
            matches!(error, Error::InvalidArgument(_)) && text.contains(word),
            "{text}"
        );
        assert_eq!(world.state_hash(), hash, "{word}");
    };
    for spacing in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-30, 1e3] {
        refused(&valid, spacing, "spacing");
    }
    let open = BodyDefinition {
        triangles: &fine_mesh.triangles[1..],
        ..valid
    };
    refused(&open, 0.01, "not closed");
    let flipped: Vec<[u32; 3]> = fine_mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inward = BodyDefinition {
        triangles: &flipped,
        ..valid
    };
    refused(&inward, 0.01, "inward");
    let masses = vec![1e-3; fine_mesh.positions.len()];
    let each = BodyDefinition {
        masses: Values::Each(&masses),
        ..valid
    };
    refused(&each, 0.01, "masses");
    let jointed = BodyDefinition {
        springs: Some(&[[0, 1]]),
        ..valid
    };
    refused(&jointed, 0.01, "springs");
    // The definition of the body is refused after the surface has been filled.
    let wrong = BodyDefinition {
        stiffnesses: Values::Uniform(-1.0),
        ..valid
    };
    refused(&wrong, 0.01, "stiffness");
}

/// Creates cuttable spring tissue from a ball, in free fall.
fn cuttable_ball(world: &mut World, times: u32) -> (Mesh, BodyId, Embedding) {
    let fine_mesh = ball(0.03, times);
    let (body, embedding) = world
        .create_body_from_surface(
            &BodyDefinition {
                positions: &fine_mesh.positions,
                triangles: &fine_mesh.triangles,
                masses: Values::Uniform(1e-3),
                stiffnesses: Values::Uniform(20.0),
                spare_nodes: 4000,
                ..BodyDefinition::default()
            },
            0.01,
        )
        .unwrap();
    (fine_mesh, body, embedding)
}

/// The render triangles are larger than the body's. A triangle that connects two pieces is removed, even if its corners
/// never shared a node.
#[test]
fn no_large_triangle_reaches_across_a_cut() {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .unwrap();
    let mut kept_fractions = Vec::new();
    for cells in [1, 3, 8] {
        let fine_mesh = Mesh::block([0.1; 3], [cells; 3]).unwrap();
        let definition = BodyDefinition {
            positions: &fine_mesh.positions,
            triangles: &fine_mesh.triangles,
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(20.0),
            spare_nodes: 4000,
            ..BodyDefinition::default()
        };
        let (body, mut embedding) = world.create_body_from_surface(&definition, 0.02).unwrap();
        let at = |y: f32, z: f32| vec3(0.0123, y, z);
        let across = Sweep {
            start: [at(0.1, -0.1), at(0.1, 0.1)],
            end: [at(-0.1, -0.1), at(-0.1, 0.1)],
        };
        world.cut(body, &across).unwrap();
        assert_eq!(world.body(body).unwrap().pieces().unwrap().count, 2);
        embedding.update(&world).unwrap();
        let is_beyond = |&vertex: &u32| fine_mesh.positions[vertex as usize].x > 0.0123;
        for triangle in embedding.triangles() {
            let beyond_count = triangle.iter().filter(|vertex| is_beyond(vertex)).count();
            assert!(beyond_count == 0 || beyond_count == 3, "{cells} cells: {triangle:?}");
        }
        kept_fractions.push(embedding.triangles().len() as f32 / fine_mesh.triangles.len() as f32);
    }
    // The end faces remain, and almost nothing else of a single cube.
    assert!(
        kept_fractions[0] >= 4.0 / 12.0 && kept_fractions[2] > 0.8,
        "{kept_fractions:?}"
    );
}

/// Returns the sweep of an edge down along x = 0 to `depth`, rotated about z by `turn`.
fn sweep(turn: f32, depth: f32) -> Sweep {
    let at = |y: f32, z: f32| Quat::from_rotation_z(turn) * vec3(0.0003, y, z);
    Sweep {
        start: [at(0.05, -0.05), at(0.05, 0.05)],
        end: [at(depth, -0.05), at(depth, 0.05)],
    }
}

#[test]
fn each_vertex_follows_its_side_of_a_cut() {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .unwrap();
    let (fine_mesh, body, mut embedding) = cuttable_ball(&mut world, 4);
    // Into quarters.
    let turns = [0.0, 1.2];
    for turn in turns {
        world.cut(body, &sweep(turn, -0.05)).unwrap();
    }
    let pieces = world.body(body).unwrap().pieces().unwrap();
    let drawn_pieces: std::collections::BTreeSet<u32> = world
        .body(body)
        .unwrap()
        .surface()
        .iter()
        .map(|triangle| pieces.of_nodes[triangle[0] as usize])
        .collect();
    assert_eq!(drawn_pieces.len(), 4);
    // An embedding that was not updated is unchanged, and refuses positions of the new node count.
    let positions = world.body(body).unwrap().positions().to_vec();
    assert!(embedding.update_from(&positions).is_err());
    embedding.update(&world).unwrap();
    vertices_within(embedding.positions(), &fine_mesh.positions, 1e-6);
    assert_eq!(embedding.body(), body);
    // Each piece moves to a different position, and each vertex must move with the piece of its quarter.
    let shift = |piece: u32| vec3(0.0, 0.0, 0.2 * (1 + piece) as f32);
    let apart: Vec<Vec3> = positions
        .iter()
        .zip(&pieces.of_nodes)
        .map(|(&position, &piece)| position + shift(piece))
        .collect();
    world.body_mut(body).unwrap().set_positions(&apart).unwrap();
    embedding.update(&world).unwrap();
    let mut piece_of_quarter = [None; 4];
    let mut counted = 0;
    for (&position, &from) in embedding.positions().iter().zip(&fine_mesh.positions) {
        let piece = drawn_pieces
            .iter()
            .find(|&&piece| (position - from).distance(shift(piece)) < 1e-5);
        let piece = *piece.unwrap_or_else(|| panic!("{from} is torn apart: {position}"));
        let sides = turns.map(|turn| (Quat::from_rotation_z(-turn) * from).x - 0.0003);
        // The body snaps cuts to nodes within a twentieth of an edge of the blade's path.
        if sides.iter().all(|side| side.abs() > 0.001) {
            let quarter = usize::from(sides[0] > 0.0) + 2 * usize::from(sides[1] > 0.0);
            assert_eq!(*piece_of_quarter[quarter].get_or_insert(piece), piece, "{from}");
            counted += 1;
        }
    }
    assert!(counted > 2000, "{counted}");
    // No triangle connects two pieces, and only such triangles are removed.
    let longest = |triangle: &[u32; 3], positions: &[Vec3]| {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    };
    let remaining = embedding.triangles().to_vec();
    assert!(
        remaining
            .iter()
            .all(|triangle| longest(triangle, embedding.positions()) < 0.01)
    );
    let remains = |triangle: &[u32; 3]| longest(triangle, embedding.positions()) < 0.01;
    assert_eq!(
        remaining,
        fine_mesh.triangles.iter().copied().filter(remains).collect::<Vec<_>>()
    );
    assert!(remaining.len() < fine_mesh.triangles.len() && 20 * remaining.len() > 17 * fine_mesh.triangles.len());
    // An embedding created after the cut is bound to the remaining surface and follows each piece.
    let late = EmbeddingDefinition {
        vertices: embedding.positions(),
        triangles: &remaining,
        tetrahedra: &[[0, 1, 2, 3]],
    };
    let mut late = world.create_embedding(body, &late).unwrap();
    vertices_within(late.positions(), embedding.positions(), 1e-6);
    let turn = Quat::from_rotation_x(0.3);
    let rotated: Vec<Vec3> = apart
        .iter()
        .zip(&pieces.of_nodes)
        .map(|(&position, &piece)| turn * position - 2.0 * shift(piece))
        .collect();
    world.body_mut(body).unwrap().set_positions(&rotated).unwrap();
    embedding.update(&world).unwrap();
    late.update(&world).unwrap();
    vertices_within(late.positions(), embedding.positions(), 1e-5);
    // Both embeddings follow the next cut.
    world.body_mut(body).unwrap().set_positions(&positions).unwrap();
    world.cut(body, &sweep(0.6, -0.05)).unwrap();
    for embedding in [&mut embedding, &mut late] {
        embedding.update(&world).unwrap();
        vertices_within(embedding.positions(), &fine_mesh.positions, 2e-5);
    }
    let pieces = world.body(body).unwrap().pieces().unwrap();
    let apart: Vec<Vec3> = { world.body(body).unwrap().positions().iter().zip(&pieces.of_nodes) }
        .map(|(&position, &piece)| position + shift(piece))
        .collect();
    world.body_mut(body).unwrap().set_positions(&apart).unwrap();
    for embedding in [&mut embedding, &mut late] {
        embedding.update(&world).unwrap();
        assert!(
            embedding.triangles().len() < remaining.len() && 20 * embedding.triangles().len() > 17 * remaining.len()
        );
        let longest = { embedding.triangles().iter() }.map(|triangle| longest(triangle, embedding.positions()));
        assert!(longest.fold(0.0, f32::max) < 0.01);
    }
    let is_beside = |from: &Vec3| {
        let sides = [0.0, 1.2, 0.6].map(|turn| (Quat::from_rotation_z(-turn) * *from).x - 0.0003);
        sides.iter().all(|side| side.abs() > 0.001)
    };
    let both = embedding.positions().iter().zip(late.positions());
    let beside = both.zip(&fine_mesh.positions).filter(|(_, from)| is_beside(from));
    assert!(beside.clone().count() > 1800);
    assert!({ beside }.all(|((a, b), _)| a.distance(*b) < 1e-4));
}

/// Creates a cuttable sheet in free fall.
fn sheet(world: &mut World) -> (Mesh, BodyId) {
    let mesh = Mesh::cloth([0.1, 0.1], [10, 10]).unwrap();
    let body = world.create_body(&BodyDefinition {
        positions: &mesh.positions,
        triangles: &mesh.triangles,
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(30.0),
        spare_nodes: 1000,
        ..BodyDefinition::default()
    });
    (mesh, body.unwrap())
}

/// Returns a finer sheet over it with triangles, whose height varies by up to `up` (m).
fn cover(up: f32) -> Mesh {
    let mut fine = Mesh::cloth([0.098, 0.098], [40, 40]).unwrap();
    for position in &mut fine.positions {
        position.y = up * (70.0 * position.x).sin();
    }
    fine
}

#[test]
fn each_vertex_over_a_sheet_follows_its_side_of_a_cut() {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .unwrap();
    let (_, body) = sheet(&mut world);
    let fine = cover(0.003);
    let definition = EmbeddingDefinition {
        vertices: &fine.positions,
        triangles: &fine.triangles,
        ..EmbeddingDefinition::default()
    };
    let mut early = world.create_embedding(body, &definition).unwrap();
    // Two cuts across the whole sheet, one through the middles of cells and one oblique.
    let cuts = [0.0_f32, 1.1];
    let blade = |turn: f32| {
        let rotated = |x: f32, y: f32| Quat::from_rotation_y(turn) * vec3(x, y, 0.0043);
        Sweep {
            start: [rotated(-0.09, -0.01), rotated(-0.09, 0.01)],
            end: [rotated(0.09, -0.01), rotated(0.09, 0.01)],
        }
    };
    world.cut(body, &blade(cuts[0])).unwrap();
    // One embedding is created after the first cut, and follows the second.
    let mut late = world.create_embedding(body, &definition).unwrap();
    world.cut(body, &blade(cuts[1])).unwrap();
    let pieces = world.body(body).unwrap().pieces().unwrap();
    let positions = world.body(body).unwrap().positions().to_vec();
    let shift = |piece: u32| vec3(0.0, 0.2 * (1 + piece) as f32, 0.0);
    let apart: Vec<Vec3> = { positions.iter().zip(&pieces.of_nodes) }
        .map(|(&position, &piece)| position + shift(piece))
        .collect();
    let side = |position: Vec3, turn: f32| (Quat::from_rotation_y(-turn) * position).z - 0.0043;
    for embedding in [&mut early, &mut late] {
        embedding.update(&world).unwrap();
        vertices_within(embedding.positions(), &fine.positions, 1e-6);
    }
    world.body_mut(body).unwrap().set_positions(&apart).unwrap();
    for embedding in [&mut early, &mut late] {
        embedding.update(&world).unwrap();
        // The body snaps cuts to nodes within a twentieth of an edge of the blade's path.
        let mut piece_of = std::collections::BTreeMap::new();
        for (&position, &from) in embedding.positions().iter().zip(&fine.positions) {
            let sides = cuts.map(|turn| side(from, turn));
            let piece = ((position - from).y / 0.2).round();
            assert!(
                (position - from).distance(Vec3::Y * 0.2 * piece) < 1e-5,
                "{from} is torn apart: {position}"
            );
            if sides.iter().all(|side| side.abs() > 0.001) {
                let quarter = sides.map(|side| side > 0.0);
                assert_eq!(*piece_of.entry(quarter).or_insert(piece), piece, "{from}");
            }
        }
        assert_eq!(piece_of.len(), 4);
        let mut pieces: Vec<f32> = piece_of.values().copied().collect();
        pieces.dedup();
        assert_eq!(pieces.len(), 4, "{piece_of:?}");
    }
    // Tetrahedra that are not simulated can also carry vertices, but not across the next cut.
    let mut not_simulated = vec![[0; 4]; 1000];
    not_simulated.push([0, 1, 11, 60]);
    let not_simulated = EmbeddingDefinition {
        tetrahedra: &not_simulated,
        ..definition
    };
    let curved: Vec<Vec3> = { positions.iter().zip(0..) }
        .map(|(&position, node)| position + Vec3::Y * 0.01 * ((node % 7) as f32 + position.x))
        .collect();
    world.body_mut(body).unwrap().set_positions(&curved).unwrap();
    let mut stray = world.create_embedding(body, &not_simulated).unwrap();
    world.cut(body, &blade(2.0)).unwrap();
    let error = stray.update(&world).unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    // No triangle of the first embedding connects two pieces, and only such triangles are removed.
    let remains = |triangle: &&[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| early.positions()[vertex as usize]);
        a.distance(b).max(b.distance(c)).max(c.distance(a)) < 0.05
    };
    let remaining: Vec<[u32; 3]> = fine.triangles.iter().filter(remains).copied().collect();
    assert_eq!(early.triangles(), remaining);
    assert!(remaining.len() < fine.triangles.len() && 10 * remaining.len() > 9 * fine.triangles.len());
}

#[test]
fn a_partial_cut_leaves_the_rest_connected() {
    let mut world = world();
    let (fine_mesh, body, mut embedding) = cuttable_ball(&mut world, 4);
    world.cut(body, &sweep(0.0, 0.004)).unwrap();
    for _ in 0..30 {
        world.step(0.002).unwrap();
        embedding.update(&world).unwrap();
    }
    let remaining = embedding.triangles();
    let below = |triangle: &[u32; 3]| {
        triangle
            .iter()
            .all(|&vertex| fine_mesh.positions[vertex as usize].y < -0.008)
    };
    let whole = fine_mesh.triangles.iter().filter(|triangle| below(triangle));
    assert!(whole.clone().count() > 500);
    assert_eq!(
        whole.count(),
        remaining.iter().filter(|triangle| below(triangle)).count()
    );
    assert!(remaining.len() < fine_mesh.triangles.len());
    assert!(embedding.positions().iter().all(|position| position.is_finite()));
    // The normal of a vertex is that of its remaining triangles.
    let remaining = remaining.to_vec();
    let positions: Vec<DVec3> = embedding
        .positions()
        .iter()
        .map(|position| position.as_dvec3())
        .collect();
    let mut has_some = vec![false; positions.len()];
    remaining
        .iter()
        .flatten()
        .for_each(|&vertex| has_some[vertex as usize] = true);
    let normals = embedding.normals();
    for (normal, has_some) in normals.iter().zip(has_some) {
        assert_eq!(normal.length() > 0.5, has_some);
    }
}

#[test]
fn embeddings_over_the_triangles_of_a_solid_report_that_they_cannot_follow_cuts() {
    let mut world = world();
    let (fine_mesh, body, _) = cuttable_ball(&mut world, 2);
    let over = EmbeddingDefinition {
        vertices: &fine_mesh.positions,
        ..EmbeddingDefinition::default()
    };
    let mut embedding = world.create_embedding(body, &over).unwrap();
    let before = embedding.positions().to_vec();
    world.cut(body, &sweep(0.0, -0.05)).unwrap();
    let error = embedding.update(&world).unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    assert_eq!(embedding.positions(), before);
}

#[test]
fn a_world_saved_before_a_cut_accepts_earlier_embeddings_and_refuses_later_ones() {
    let mesh = Mesh::block([0.1; 3], [4; 3]).unwrap();
    let mut world = world();
    let body = world.create_body(&BodyDefinition {
        positions: &mesh.positions,
        tetrahedra: &mesh.tetrahedra,
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(20.0),
        spare_nodes: 1000,
        ..BodyDefinition::default()
    });
    let body = body.unwrap();
    let fine = EmbeddingDefinition {
        vertices: &mesh.positions,
        triangles: &mesh.triangles,
        tetrahedra: &mesh.tetrahedra,
    };
    let bytes = world.save().unwrap();
    let mut early = world.create_embedding(body, &fine).unwrap();
    let at = |y: f32, z: f32| vec3(0.013, y, z);
    let blade = Sweep {
        start: [at(-1.0, -0.2), at(1.0, -0.2)],
        end: [at(-1.0, 0.2), at(1.0, 0.2)],
    };
    world.cut(body, &blade).unwrap();
    early.update(&world).unwrap();
    let mut late = world.create_embedding(body, &fine).unwrap();
    let before = World::load(&bytes, 1, None).unwrap();
    early.update(&before).unwrap();
    assert_eq!(early.triangles(), fine.triangles);
    vertices_within(early.positions(), &mesh.positions, 1e-6);
    let old_positions = late.positions().to_vec();
    let error = late.update(&before).unwrap_err();
    assert!(matches!(error, Error::InvalidArgument(_)), "{error}");
    assert_eq!(late.positions(), old_positions);
    late.update(&world).unwrap();
}
