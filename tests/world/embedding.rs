//! Fine surfaces that go with coarse bodies.
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

/// A soft block of 6 x 4 x 5 cm of springs.
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

/// Numbers from -1 to 1, the same each time.
fn numbers() -> impl FnMut() -> f32 {
    let mut seed = 12_u32;
    move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

/// An affine motion that stretches, shears, turns and shifts.
fn motion() -> Affine3A {
    let shape = Mat3A::from_cols(
        vec3(1.3, 0.2, -0.1).into(),
        vec3(-0.3, 0.8, 0.15).into(),
        vec3(0.05, 0.4, 1.1).into(),
    );
    let turned = Mat3A::from_quat(Quat::from_axis_angle(vec3(0.6, 0.0, 0.8), 1.1)) * shape;
    Affine3A {
        matrix3: turned,
        translation: vec3(0.2, -0.1, 0.3).into(),
    }
}

#[test]
fn an_affine_motion_of_the_body_is_one_of_the_surface() {
    let mut world = world();
    let (body, mesh) = block(&mut world);
    // Inside of it and, in part, outside.
    let mut drawn = ball(0.024, 4);
    let mut number = numbers();
    for place in &mut drawn.positions {
        *place += 0.001 * vec3(number(), number(), number());
    }
    let mut embedding = world
        .create_embedding(
            body,
            &EmbeddingDefinition {
                vertices: &drawn.positions,
                triangles: &drawn.triangles,
                tetrahedra: &mesh.tetrahedra,
            },
        )
        .unwrap();
    assert!(
        drawn.positions.iter().any(|place| place.y.abs() > 0.0205),
        "all are inside"
    );
    let motion = motion();
    let moved: Vec<Vec3> = mesh
        .positions
        .iter()
        .map(|&place| motion.transform_point3(place))
        .collect();
    world.body_mut(body).unwrap().set_positions(&moved).unwrap();
    embedding.update(&world).unwrap();
    let exact = |place: Vec3| {
        let shape = DMat3::from_cols_array(&motion.matrix3.to_cols_array().map(f64::from));
        shape * place.as_dvec3() + motion.translation.as_dvec3()
    };
    // Beside the size of what moves: 0.4 m from the origin, with rounding of the nodes themselves.
    for (place, &from) in embedding.positions().iter().zip(&drawn.positions) {
        let off = place.as_dvec3().distance(exact(from));
        assert!(off < 1e-6 * 0.4, "{from}: {off} m");
    }
    let places: Vec<DVec3> = drawn.positions.iter().map(|&place| exact(place)).collect();
    assert_normals(&places, &drawn.triangles, embedding.normals(), 1e-4);
}

/// Normals are those of the vertices' triangles by area, worked out in f64.
fn assert_normals(places: &[DVec3], triangles: &[[u32; 3]], normals: &[Vec3], most: f64) {
    let mut exact = vec![DVec3::ZERO; places.len()];
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
        for vertex in triangle {
            exact[vertex as usize] += (b - a).cross(c - a);
        }
    }
    assert_eq!(exact.len(), normals.len());
    for (normal, exact) in normals.iter().zip(exact) {
        let off = normal.as_dvec3().distance(exact.normalize());
        assert!(off < most, "{normal} is {off} off");
    }
}

#[test]
fn normals_of_a_ball_look_outward() {
    // Far from the origin, and small: they neither vanish nor overflow.
    for radius in [1e-7_f32, 0.01, 1e8] {
        let drawn = ball(radius, 3);
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
                    vertices: &drawn.positions,
                    triangles: &drawn.triangles,
                    tetrahedra: &host.tetrahedra,
                },
            )
            .unwrap();
        for (normal, place) in embedding.normals().iter().zip(&drawn.positions) {
            // Triangles about some corners of an icosahedron are larger on one side.
            assert!(
                normal.distance(place.normalize()) < 0.03,
                "{radius} m: {normal} at {place}"
            );
        }
    }
}

#[test]
fn over_a_sheet_vertices_keep_their_height() {
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
            let place = 0.049 * vec3(number(), number(), number());
            place - up * place.dot(up) + up * 0.004 * number()
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
    // It turns as one.
    let turn = Quat::from_axis_angle(vec3(0.0, 0.6, 0.8), 2.0);
    let shift = vec3(0.1, 0.2, -0.1);
    let moved: Vec<Vec3> = mesh.positions.iter().map(|&place| turn * place + shift).collect();
    world.body_mut(body).unwrap().set_positions(&moved).unwrap();
    embedding.update(&world).unwrap();
    let expected: Vec<Vec3> = vertices.iter().map(|&place| turn * place + shift).collect();
    vertices_within(embedding.positions(), &expected, 3e-7);
    // It is stretched in its plane: heights stay.
    let stretched: Vec<Vec3> = mesh.positions.iter().map(|&place| 2.0 * place).collect();
    world.body_mut(body).unwrap().set_positions(&stretched).unwrap();
    embedding.update(&world).unwrap();
    let expected: Vec<Vec3> = vertices.iter().map(|&place| 2.0 * place - up * place.dot(up)).collect();
    vertices_within(embedding.positions(), &expected, 3e-7);
    assert!(embedding.normals().is_empty());
}

fn vertices_within<'a>(found: &'a [Vec3], expected: &[Vec3], most: f32) -> &'a [Vec3] {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.distance(*expected) < most, "{found} instead of {expected}");
    }
    found
}

/// Tissue made of a ball that is drawn, which stands on the ground.
fn made(world: &mut World, times: u32) -> (Mesh, BodyId, Embedding) {
    let drawn = ball(0.03, times);
    let (body, embedding) = world
        .create_body_from_surface(
            &BodyDefinition {
                positions: &drawn.positions,
                triangles: &drawn.triangles,
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
    (drawn, body, embedding)
}

#[test]
fn tissue_of_a_drawn_ball_falls_and_lands() {
    let mut world = world();
    let (drawn, body, mut embedding) = made(&mut world, 4);
    let mass: f32 = (0..world.body(body).unwrap().node_count() as u32)
        .map(|node| world.body(body).unwrap().node_mass(node).unwrap())
        .sum();
    let volume = 4.0 / 3.0 * std::f32::consts::PI * 0.03_f32.powi(3);
    assert!((mass / (1000.0 * volume) - 1.0).abs() < 0.03, "{mass} kg");
    vertices_within(embedding.positions(), &drawn.positions, 1e-7);
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
            .fold(f32::INFINITY, |low, place| low.min(place.y));
        // The coarse surface stays above; what is drawn goes past it by what a ball's chords leave.
        assert!(lowest > -0.042, "step {step}: {lowest}");
        deepest = deepest.min(lowest);
    }
    assert!(deepest < -0.039, "{deepest}");
    let places: Vec<DVec3> = embedding.positions().iter().map(|place| place.as_dvec3()).collect();
    assert_normals(&places, &drawn.triangles, embedding.normals(), 1e-4);
}

#[test]
fn who_reads_changes_nothing() {
    let run = |reads: bool| {
        let mut world = world();
        let (_, body, mut embedding) = made(&mut world, 2);
        let places = world.body(body).unwrap().positions().to_vec();
        for _ in 0..20 {
            world.step(0.005).unwrap();
            if reads {
                embedding.update(&world).unwrap();
                embedding.normals();
            }
        }
        assert_ne!(world.body(body).unwrap().positions(), places);
        world.state_hash()
    };
    assert_eq!(run(false), run(true));
}

#[test]
fn what_a_reader_has_is_as_good_as_the_world() {
    let mut world = world();
    let (_, body, mut embedding) = made(&mut world, 2);
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
fn what_cannot_be_bound_is_refused() {
    let mut world = world();
    let (body, mesh) = block(&mut world);
    let drawn = ball(0.02, 1);
    let sound = EmbeddingDefinition {
        vertices: &drawn.positions,
        triangles: &drawn.triangles,
        tetrahedra: &mesh.tetrahedra,
    };
    let hash = world.state_hash();
    let refused = |definition: &EmbeddingDefinition, words: &[&str]| {
        let error = world.create_embedding(body, definition).unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, Error::InvalidArgument(_)), "{text}");
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    };
    let none = EmbeddingDefinition { vertices: &[], ..sound };
    refused(&none, &["vertices"]);
    for wrong in [f32::NAN, f32::INFINITY, 2e9] {
        let mut vertices = drawn.positions.clone();
        vertices[7].y = wrong;
        let definition = EmbeddingDefinition {
            vertices: &vertices,
            ..sound
        };
        refused(&definition, &["vertices[7]"]);
    }
    let triangles = [[0, 1, 2], [0, 1, 42]];
    let definition = EmbeddingDefinition {
        triangles: &triangles,
        ..sound
    };
    refused(&definition, &["triangles[1]", "42"]);
    let tetrahedra = [[0, 1, 2, 9999]];
    let definition = EmbeddingDefinition {
        tetrahedra: &tetrahedra,
        ..sound
    };
    refused(&definition, &["tetrahedra[0]", "9999"]);
    let tetrahedra = [[0, 1, 2, 2]];
    let definition = EmbeddingDefinition {
        tetrahedra: &tetrahedra,
        ..sound
    };
    refused(&definition, &["volume"]);
    assert_eq!(world.state_hash(), hash);
    world.destroy_body(body).unwrap();
    assert!(matches!(world.create_embedding(body, &sound), Err(Error::StaleId(_))));
}

#[test]
fn what_is_no_surface_makes_no_body() {
    let mut world = world();
    let drawn = ball(0.03, 2);
    let sound = BodyDefinition {
        positions: &drawn.positions,
        triangles: &drawn.triangles,
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
        refused(&sound, spacing, "spacing");
    }
    let open = BodyDefinition {
        triangles: &drawn.triangles[1..],
        ..sound
    };
    refused(&open, 0.01, "not closed");
    let turned: Vec<[u32; 3]> = drawn.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inward = BodyDefinition {
        triangles: &turned,
        ..sound
    };
    refused(&inward, 0.01, "inward");
    let masses = vec![1e-3; drawn.positions.len()];
    let each = BodyDefinition {
        masses: Values::Each(&masses),
        ..sound
    };
    refused(&each, 0.01, "masses");
    let jointed = BodyDefinition {
        springs: Some(&[[0, 1]]),
        ..sound
    };
    refused(&jointed, 0.01, "springs");
    // The definition of the body is refused when the surface has been filled.
    let wrong = BodyDefinition {
        stiffnesses: Values::Uniform(-1.0),
        ..sound
    };
    refused(&wrong, 0.01, "stiffness");
}

/// Tissue of springs made of a ball, that may be cut, in free fall.
fn to_be_cut(world: &mut World, times: u32) -> (Mesh, BodyId, Embedding) {
    let drawn = ball(0.03, times);
    let (body, embedding) = world
        .create_body_from_surface(
            &BodyDefinition {
                positions: &drawn.positions,
                triangles: &drawn.triangles,
                masses: Values::Uniform(1e-3),
                stiffnesses: Values::Uniform(20.0),
                spare_nodes: 4000,
                ..BodyDefinition::default()
            },
            0.01,
        )
        .unwrap();
    (drawn, body, embedding)
}

/// A surface of triangles that are longer than the body's: one that reaches from piece to piece goes, though its corners never had a node in common.
#[test]
fn no_large_triangle_reaches_across_a_cut() {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .unwrap();
    let mut kept = Vec::new();
    for cells in [1, 3, 8] {
        let drawn = Mesh::block([0.1; 3], [cells; 3]).unwrap();
        let definition = BodyDefinition {
            positions: &drawn.positions,
            triangles: &drawn.triangles,
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
        let is_beyond = |&vertex: &u32| drawn.positions[vertex as usize].x > 0.0123;
        for triangle in embedding.triangles() {
            let beyond = triangle.iter().filter(|vertex| is_beyond(vertex)).count();
            assert!(beyond == 0 || beyond == 3, "{cells} cells: {triangle:?}");
        }
        kept.push(embedding.triangles().len() as f32 / drawn.triangles.len() as f32);
    }
    // The ends stay, of a cube alone no more.
    assert!(kept[0] >= 4.0 / 12.0 && kept[2] > 0.8, "{kept:?}");
}

/// An edge that goes down along x = 0, turned about z by this much, as far as `depth`.
fn sweep(turn: f32, depth: f32) -> Sweep {
    let at = |y: f32, z: f32| Quat::from_rotation_z(turn) * vec3(0.0003, y, z);
    Sweep {
        start: [at(0.05, -0.05), at(0.05, 0.05)],
        end: [at(depth, -0.05), at(depth, 0.05)],
    }
}

#[test]
fn each_vertex_goes_with_its_side_of_a_cut() {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .unwrap();
    let (drawn, body, mut embedding) = to_be_cut(&mut world, 4);
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
    // What has not been read yet is as before, and that there are more nodes is not known.
    let places = world.body(body).unwrap().positions().to_vec();
    assert!(embedding.update_from(&places).is_err());
    embedding.update(&world).unwrap();
    vertices_within(embedding.positions(), &drawn.positions, 1e-6);
    assert_eq!(embedding.body(), body);
    // Each piece is put somewhere else: so is each vertex, with the piece that has its quarter.
    let shift = |piece: u32| vec3(0.0, 0.0, 0.2 * (1 + piece) as f32);
    let apart: Vec<Vec3> = places
        .iter()
        .zip(&pieces.of_nodes)
        .map(|(&place, &piece)| place + shift(piece))
        .collect();
    world.body_mut(body).unwrap().set_positions(&apart).unwrap();
    embedding.update(&world).unwrap();
    let mut piece_of_quarter = [None; 4];
    let mut counted = 0;
    for (&place, &from) in embedding.positions().iter().zip(&drawn.positions) {
        let piece = drawn_pieces
            .iter()
            .find(|&&piece| (place - from).distance(shift(piece)) < 1e-5);
        let piece = *piece.unwrap_or_else(|| panic!("{from} is torn apart: {place}"));
        let beyond = turns.map(|turn| (Quat::from_rotation_z(-turn) * from).x - 0.0003);
        // What is snapped to the blade's way lies up to a twentieth of an edge beside it.
        if beyond.iter().all(|beyond| beyond.abs() > 0.001) {
            let quarter = usize::from(beyond[0] > 0.0) + 2 * usize::from(beyond[1] > 0.0);
            assert_eq!(*piece_of_quarter[quarter].get_or_insert(piece), piece, "{from}");
            counted += 1;
        }
    }
    assert!(counted > 2000, "{counted}");
    // No triangle reaches across, and only such are gone.
    let longest = |triangle: &[u32; 3], places: &[Vec3]| {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize]);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    };
    let left = embedding.triangles().to_vec();
    assert!(
        left.iter()
            .all(|triangle| longest(triangle, embedding.positions()) < 0.01)
    );
    let is_left = |triangle: &[u32; 3]| longest(triangle, embedding.positions()) < 0.01;
    assert_eq!(
        left,
        drawn.triangles.iter().copied().filter(is_left).collect::<Vec<_>>()
    );
    assert!(left.len() < drawn.triangles.len() && 20 * left.len() > 17 * drawn.triangles.len());
    // Who comes after the cut is bound to what is left of it, and goes on where each piece does.
    let late = EmbeddingDefinition {
        vertices: embedding.positions(),
        triangles: &left,
        tetrahedra: &[[0, 1, 2, 3]],
    };
    let mut late = world.create_embedding(body, &late).unwrap();
    vertices_within(late.positions(), embedding.positions(), 1e-6);
    let turn = Quat::from_rotation_x(0.3);
    let turned: Vec<Vec3> = apart
        .iter()
        .zip(&pieces.of_nodes)
        .map(|(&place, &piece)| turn * place - 2.0 * shift(piece))
        .collect();
    world.body_mut(body).unwrap().set_positions(&turned).unwrap();
    embedding.update(&world).unwrap();
    late.update(&world).unwrap();
    vertices_within(late.positions(), embedding.positions(), 1e-5);
    // Both follow the next cut.
    world.body_mut(body).unwrap().set_positions(&places).unwrap();
    world.cut(body, &sweep(0.6, -0.05)).unwrap();
    for embedding in [&mut embedding, &mut late] {
        embedding.update(&world).unwrap();
        vertices_within(embedding.positions(), &drawn.positions, 2e-5);
    }
    let pieces = world.body(body).unwrap().pieces().unwrap();
    let apart: Vec<Vec3> = { world.body(body).unwrap().positions().iter().zip(&pieces.of_nodes) }
        .map(|(&place, &piece)| place + shift(piece))
        .collect();
    world.body_mut(body).unwrap().set_positions(&apart).unwrap();
    for embedding in [&mut embedding, &mut late] {
        embedding.update(&world).unwrap();
        assert!(embedding.triangles().len() < left.len() && 20 * embedding.triangles().len() > 17 * left.len());
        let longest = { embedding.triangles().iter() }.map(|triangle| longest(triangle, embedding.positions()));
        assert!(longest.fold(0.0, f32::max) < 0.01);
    }
    let is_beside = |from: &Vec3| {
        let beyond = [0.0, 1.2, 0.6].map(|turn| (Quat::from_rotation_z(-turn) * *from).x - 0.0003);
        beyond.iter().all(|beyond| beyond.abs() > 0.001)
    };
    let both = embedding.positions().iter().zip(late.positions());
    let beside = both.zip(&drawn.positions).filter(|(_, from)| is_beside(from));
    assert!(beside.clone().count() > 1800);
    assert!({ beside }.all(|((a, b), _)| a.distance(*b) < 1e-4));
}

/// A sheet in free fall that may be cut.
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

/// A finer sheet over it, some millimetres up and down, with its triangles.
fn cover(up: f32) -> Mesh {
    let mut fine = Mesh::cloth([0.098, 0.098], [40, 40]).unwrap();
    for place in &mut fine.positions {
        place.y = up * (70.0 * place.x).sin();
    }
    fine
}

#[test]
fn over_a_sheet_each_vertex_goes_with_its_side_of_a_cut() {
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
    // Two cuts across all of it, through the cells' middles and at a slant.
    let cuts = [0.0_f32, 1.1];
    let blade = |turn: f32| {
        let turned = |x: f32, y: f32| Quat::from_rotation_y(turn) * vec3(x, y, 0.0043);
        Sweep {
            start: [turned(-0.09, -0.01), turned(-0.09, 0.01)],
            end: [turned(0.09, -0.01), turned(0.09, 0.01)],
        }
    };
    world.cut(body, &blade(cuts[0])).unwrap();
    // One comes when the first cut is made, and has what is left to follow.
    let mut late = world.create_embedding(body, &definition).unwrap();
    world.cut(body, &blade(cuts[1])).unwrap();
    let pieces = world.body(body).unwrap().pieces().unwrap();
    let places = world.body(body).unwrap().positions().to_vec();
    let shift = |piece: u32| vec3(0.0, 0.2 * (1 + piece) as f32, 0.0);
    let apart: Vec<Vec3> = { places.iter().zip(&pieces.of_nodes) }
        .map(|(&place, &piece)| place + shift(piece))
        .collect();
    let side = |place: Vec3, turn: f32| (Quat::from_rotation_y(-turn) * place).z - 0.0043;
    for embedding in [&mut early, &mut late] {
        embedding.update(&world).unwrap();
        vertices_within(embedding.positions(), &fine.positions, 1e-6);
    }
    world.body_mut(body).unwrap().set_positions(&apart).unwrap();
    for embedding in [&mut early, &mut late] {
        embedding.update(&world).unwrap();
        // What is snapped to the blade's way lies up to a twentieth of an edge beside it.
        let mut piece_of = std::collections::BTreeMap::new();
        for (&place, &from) in embedding.positions().iter().zip(&fine.positions) {
            let sides = cuts.map(|turn| side(from, turn));
            let piece = ((place - from).y / 0.2).round();
            assert!(
                (place - from).distance(Vec3::Y * 0.2 * piece) < 1e-5,
                "{from} is torn apart: {place}"
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
    // Tetrahedra that nobody simulates hold vertices as well, but not across the next cut.
    let mut made_up = vec![[0; 4]; 1000];
    made_up.push([0, 1, 11, 60]);
    let made_up = EmbeddingDefinition {
        tetrahedra: &made_up,
        ..definition
    };
    let curved: Vec<Vec3> = { places.iter().zip(0..) }
        .map(|(&place, node)| place + Vec3::Y * 0.01 * ((node % 7) as f32 + place.x))
        .collect();
    world.body_mut(body).unwrap().set_positions(&curved).unwrap();
    let mut stray = world.create_embedding(body, &made_up).unwrap();
    world.cut(body, &blade(2.0)).unwrap();
    let error = stray.update(&world).unwrap_err();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    // No triangle of the first reaches across, and only such are gone.
    let is_left = |triangle: &&[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| early.positions()[vertex as usize]);
        a.distance(b).max(b.distance(c)).max(c.distance(a)) < 0.05
    };
    let left: Vec<[u32; 3]> = fine.triangles.iter().filter(is_left).copied().collect();
    assert_eq!(early.triangles(), left);
    assert!(left.len() < fine.triangles.len() && 10 * left.len() > 9 * fine.triangles.len());
}

#[test]
fn a_cut_that_ends_within_leaves_the_rest_whole() {
    let mut world = world();
    let (drawn, body, mut embedding) = to_be_cut(&mut world, 4);
    world.cut(body, &sweep(0.0, 0.004)).unwrap();
    for _ in 0..30 {
        world.step(0.002).unwrap();
        embedding.update(&world).unwrap();
    }
    let left = embedding.triangles();
    let below = |triangle: &[u32; 3]| {
        triangle
            .iter()
            .all(|&vertex| drawn.positions[vertex as usize].y < -0.008)
    };
    let whole = drawn.triangles.iter().filter(|triangle| below(triangle));
    assert!(whole.clone().count() > 500);
    assert_eq!(whole.count(), left.iter().filter(|triangle| below(triangle)).count());
    assert!(left.len() < drawn.triangles.len());
    assert!(embedding.positions().iter().all(|place| place.is_finite()));
    // The normal of a vertex is that of the triangles that are left about it.
    let left = left.to_vec();
    let places: Vec<DVec3> = embedding.positions().iter().map(|place| place.as_dvec3()).collect();
    let mut has_some = vec![false; places.len()];
    left.iter()
        .flatten()
        .for_each(|&vertex| has_some[vertex as usize] = true);
    let normals = embedding.normals();
    for (normal, has_some) in normals.iter().zip(has_some) {
        assert_eq!(normal.length() > 0.5, has_some);
    }
}

#[test]
fn over_the_triangles_of_a_solid_cuts_are_not_followed_and_that_is_said() {
    let mut world = world();
    let (drawn, body, _) = to_be_cut(&mut world, 2);
    let over = EmbeddingDefinition {
        vertices: &drawn.positions,
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
fn a_world_of_before_a_cut_takes_surfaces_of_then_and_refuses_those_of_later() {
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
    let places = late.positions().to_vec();
    let error = late.update(&before).unwrap_err();
    assert!(matches!(error, Error::InvalidArgument(_)), "{error}");
    assert_eq!(late.positions(), places);
    late.update(&world).unwrap();
}
