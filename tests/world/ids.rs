//! Ids of another world are refused. Ids of a saved world are valid in the loaded world.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    AttachmentId, BladeDefinition, BladeId, BodyDefinition, BodyId, EmbeddingDefinition, Error, HapticDefinition,
    Result, Shape, ToolDefinition, ToolId, Values, World, WorldDefinition,
};

/// One object of each kind with an id, identical in every world.
struct Scene {
    world: World,
    body: BodyId,
    tool: ToolId,
    blade: BladeId,
    attachment: AttachmentId,
}

impl Scene {
    fn new() -> Self {
        let mesh = Mesh::cloth([0.1; 2], [4, 4]).expect("a cloth");
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let body = world
            .create_body(&BodyDefinition {
                masses: Values::Uniform(1e-4),
                stiffnesses: Values::Uniform(20.0),
                spare_nodes: 50,
                ..BodyDefinition::of(&mesh)
            })
            .expect("a body");
        let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
        ball.pose.position = Vec3::Y * 0.1;
        let tool = world.create_tool(&ball).expect("a tool");
        let blade = BladeDefinition::new([Vec3::new(0.2, 1.0, 0.0), Vec3::new(0.2, 1.1, 0.0)]);
        let blade = world.create_blade(&blade).expect("a blade");
        let attachment = world.attach_node(body, 0, tool, 0.0).expect("an attachment");
        Self {
            world,
            body,
            tool,
            blade,
            attachment,
        }
    }
}

fn assert_refused<T>(result: Result<T>, noun: &str) {
    let message = match result {
        Err(Error::InvalidArgument(message)) => message,
        Err(other) => panic!("{noun}: {other:?}"),
        Ok(_) => panic!("{noun}: taken"),
    };
    assert!(
        message.starts_with(noun) && message.ends_with("belongs to another world"),
        "{message}"
    );
}

#[test]
fn an_id_of_another_world_is_refused_and_nothing_changes() {
    let (mut one, other) = (Scene::new(), Scene::new());
    let before = one.world.state_hash();
    assert_eq!(before, other.world.state_hash(), "no state has the tag of its world");
    let world = &mut one.world;
    assert_refused(world.body(other.body), "body");
    assert_refused(world.body_mut(other.body), "body");
    assert_refused(world.destroy_body(other.body), "body");
    assert_refused(world.tissue_contacts(other.body), "body");
    assert_refused(world.attach_node(other.body, 1, one.tool, 0.0), "body");
    assert_refused(
        world.create_embedding(
            other.body,
            &EmbeddingDefinition {
                vertices: &[Vec3::ZERO],
                triangles: &[],
                tetrahedra: &[],
            },
        ),
        "body",
    );
    assert_refused(world.pose(other.tool), "tool");
    assert_refused(world.set_pose(other.tool, Vec3::ZERO, None), "tool");
    assert_refused(world.destroy_tool(other.tool), "tool");
    assert_refused(world.contacts(other.tool), "tool");
    assert_refused(world.attach_node(one.body, 1, other.tool, 0.0), "tool");
    assert_refused(world.wrench_about(&[one.tool, other.tool], Vec3::ZERO), "tool");
    assert_refused(world.create_haptic(&HapticDefinition::new(other.tool)), "tool");
    assert_refused(world.set_blade_pose(other.blade, Vec3::ZERO, None), "blade");
    assert_refused(world.blade_report(other.blade), "blade");
    assert_refused(world.destroy_blade(other.blade), "blade");
    assert_refused(world.attachment_force(other.attachment), "attachment");
    assert_refused(world.release(other.attachment), "attachment");
    assert!(!world.has_body(other.body) && !world.has_tool(other.tool));
    assert!(!world.has_blade(other.blade) && !world.has_attachment(other.attachment));
    assert_eq!(world.state_hash(), before);
    world.step(1e-3).expect("a step");
}

#[test]
fn an_id_without_an_object_is_stale_in_every_world() {
    let Scene { mut world, body, .. } = Scene::new();
    for _ in 0..2 {
        assert!(matches!(world.body(BodyId::default()), Err(Error::StaleId(_))));
    }
    world.destroy_body(body).expect("a body");
    assert!(matches!(world.body(body), Err(Error::StaleId(_))));
    let loaded = World::load(&world.save().expect("bytes"), 1, None).expect("a world");
    assert!(matches!(loaded.body(body), Err(Error::StaleId(_))));
}

#[test]
fn a_loaded_world_accepts_and_continues_the_ids_of_the_saved_world() {
    let mut saved = Scene::new();
    let mut loaded = World::load(&saved.world.save().expect("bytes"), 1, None).expect("a world");
    assert!(loaded.has_body(saved.body) && loaded.has_tool(saved.tool));
    assert!(loaded.has_blade(saved.blade) && loaded.has_attachment(saved.attachment));
    let ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
    let tools = [&mut saved.world, &mut loaded].map(|world| world.create_tool(&ball).expect("a tool"));
    assert_eq!(tools[0], tools[1]);
    assert_refused(Scene::new().world.pose(tools[1]), "tool");
}

#[test]
fn the_ids_of_a_thousand_worlds_differ() {
    let first = Scene::new();
    let ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
    for _ in 0..1000 {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let tool = world.create_tool(&ball).expect("a tool");
        assert_refused(first.world.pose(tool), "tool");
        assert_refused(world.pose(first.tool), "tool");
    }
}
