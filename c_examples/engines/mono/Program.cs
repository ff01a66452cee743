// A ball is pressed into a soft block on a floor, frame by frame as a MonoBehaviour's FixedUpdate would: C# calls the library by
// P/Invoke, and the collector runs in between. Leaves the picture that it is given the name of.
using System;
using System.Text;

public sealed unsafe class SoftBlock : IDisposable
{
    const float Edge = 0.01f, Radius = 0.03f, Density = 1000;
    readonly WorldHandle world;
    readonly BodyId block;
    readonly ToolId ball, floor;
    public float Top, Weight;

    public SoftBlock()
    {
        WorldDef worldDef;
        Sinew.Check(Sinew.sinew_world_def_init(&worldDef, (UIntPtr)sizeof(WorldDef)));
        Sinew.Check(Sinew.sinew_world_create(&worldDef, out world));

                MeshHandle mesh;
        Sinew.Check(Sinew.sinew_mesh_create_lattice(Edge, new uint[] { 16, 7, 12 }, out mesh));
        using (mesh)
        {
            var shape = new MeshView { struct_size = (UIntPtr)sizeof(MeshView) };
            Sinew.Check(Sinew.sinew_mesh_get_view(mesh, &shape));
            BodyDef def;
            Sinew.Check(Sinew.sinew_body_def_init(&def, (UIntPtr)sizeof(BodyDef)));
            def.positions = shape.positions;
            def.node_count = shape.node_count;
            def.cells = shape.cells;
            def.cell_count = shape.cell_count;
            def.material = Sinew.MaterialSprings;
            def.young_modulus = 8000;
            def.density = Density;
            def.node_damping = 0.02f;
            Sinew.Check(Sinew.sinew_body_create(world, &def, out block));
        }
        var low = float.PositiveInfinity;
        foreach (var height in Heights()) { Top = Math.Max(Top, height); low = Math.Min(low, height); }
        floor = CreateTool(Sinew.ShapePlane, 0, low);
        ball = CreateTool(Sinew.ShapeSphere, Radius, Top + 1.2f * Radius);
        for (uint node = 0; node < Positions().count.ToUInt32(); node++)
        {
            float mass;
            Sinew.Check(Sinew.sinew_body_get_node_mass(world, block, node, out mass));
            Weight += 9.81f * mass;
        }
    }

    ToolId CreateTool(uint shape, float radius, float height)
    {
        ToolDef def;
        ToolId tool;
        Sinew.Check(Sinew.sinew_tool_def_init(&def, (UIntPtr)sizeof(ToolDef)));
        def.shape = shape;
        def.radius = radius;
        def.position[1] = height;
        def.friction = 0.3f;
        Sinew.Check(Sinew.sinew_tool_create(world, &def, out tool));
        return tool;
    }

    // The library's own memory: valid until the next step.
    public Vec3View Positions()
    {
        Vec3View view;
        Sinew.Check(Sinew.sinew_body_get_positions(world, block, out view));
        return view;
    }

    public float[] Heights()
    {
        var view = Positions();
        var heights = new float[view.count.ToUInt32()];
        for (var i = 0; i < heights.Length; i++) heights[i] = ((float*)((byte*)view.data + (ulong)i * view.stride.ToUInt64()))[1];
        return heights;
    }

    public void MoveBall(float aboveTop)
    {
        float* place = stackalloc float[3];
        place[0] = place[2] = 0;
        place[1] = Top + Radius + aboveTop;
        Sinew.Check(Sinew.sinew_tool_set_pose(world, ball, place, null));
    }

    public void FixedUpdate(float dt) { Sinew.Check(Sinew.sinew_world_step(world, dt, null)); }

    float Force(ToolId tool)
    {
        float* force = stackalloc float[3];
        float* torque = stackalloc float[3];
        Sinew.Check(Sinew.sinew_tool_get_wrench(world, tool, force, torque));
        return force[1];
    }

    public float ForceOnBall { get { return Force(ball); } }
    public float ForceOnFloor { get { return Force(floor); } }

    public void SavePicture(string path)
    {
        PictureDef def;
        Sinew.Check(Sinew.sinew_picture_def_init(&def, (UIntPtr)sizeof(PictureDef)));
        def.show_contacts = 1;
        Sinew.Check(Sinew.sinew_world_save_picture(world, &def, Encoding.UTF8.GetBytes(path + "\0")));
    }

    public void Dispose() { world.Dispose(); }
}

public static class Program
{
    static void Expect(bool holds, string what) { if (!holds) throw new Exception("does not hold: " + what); }

    public static void Main(string[] arguments)
    {
        using (var block = new SoftBlock())
        {
            var watch = System.Diagnostics.Stopwatch.StartNew();
            const int frames = 120;
            for (var frame = 0; frame < frames; frame++)
            {
                block.MoveBall(Math.Max(-0.025f, 0.006f - 0.0005f * frame));
                block.FixedUpdate(1f / 50);
                if (frame % 10 == 0) { GC.Collect(); GC.WaitForPendingFinalizers(); }
            }
            // At rest the floor bears the block and what the ball presses it with.
            float pressed = block.ForceOnBall, borne = -block.ForceOnFloor;
            Console.WriteLine("{0} frames, {1:F1} ms each: ball {2:F2} N, floor {3:F2} N, weight {4:F2} N", frames,
                watch.Elapsed.TotalMilliseconds / frames, pressed, borne, block.Weight);
            Expect(pressed > 0.2, "the ball is pressed back");
            Expect(Math.Abs(borne - pressed - block.Weight) < 0.02 * borne, "the floor bears the block and the ball");
            foreach (var height in block.Heights()) Expect(!float.IsNaN(height), "every node is somewhere");
            try
            {
                block.FixedUpdate(float.NaN);
                Expect(false, "a step of NaN is refused");
            }
            catch (SinewException refused)
            {
                Expect(refused.Status == Sinew.StatusInvalidArgument && refused.Message.Contains("dt"), "it says why: " + refused.Message);
            }
            if (arguments.Length > 0) block.SavePicture(arguments[0]);
        }
    }
}
