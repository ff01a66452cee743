// A ball is pressed into a soft block on a floor, frame by frame as a MonoBehaviour's FixedUpdate would: C# calls the library by
// P/Invoke, and the collector runs in between. Leaves the picture that it is given the name of.
//
// For Unity put bindings/csharp/Sinew.cs and libsinew.so (sinew.dll) into Assets/Plugins of a project that allows unsafe code. Every
// struct is blittable: nothing is copied or converted, and what the library lends is read through its pointer.
using System;
using System.Text;
using static Sinew;

public class SinewException : Exception
{
    public readonly sinew_status_code Status;
    public SinewException(sinew_status_code status, string message) : base(message) { Status = status; }
}

public sealed unsafe class SoftBlock : IDisposable
{
    const float Edge = 0.01f, Radius = 0.03f, Density = 1000;
    readonly IntPtr world;
    readonly sinew_body_id block;
    readonly sinew_tool_id ball, floor;
    public float Top, Weight;

    // Throws what a call that was refused says.
    static void Check(int status)
    {
        if (status == (int)sinew_status_code.SINEW_STATUS_OK) return;
        var buffer = new byte[512];
        fixed (byte* start = buffer) sinew_last_error(start, (UIntPtr)buffer.Length);
        var message = Encoding.UTF8.GetString(buffer, 0, Array.IndexOf(buffer, (byte)0));
        throw new SinewException((sinew_status_code)status, message);
    }

    public SoftBlock()
    {
        sinew_world_def worldDef;
        Check(sinew_world_def_init(&worldDef, (UIntPtr)sizeof(sinew_world_def)));
        fixed (IntPtr* made = &world) Check(sinew_world_create(&worldDef, made));

        IntPtr mesh;
        uint* cells = stackalloc uint[3];
        cells[0] = 16;
        cells[1] = 7;
        cells[2] = 12;
        Check(sinew_mesh_create_lattice(Edge, cells, &mesh));
        sinew_body_def def;
        Check(sinew_body_def_init(&def, (UIntPtr)sizeof(sinew_body_def)));
        Check(sinew_body_def_set_mesh(&def, mesh));
        def.material = (uint)sinew_material.SINEW_MATERIAL_SPRINGS;
        def.young_modulus = 8000;
        def.density = Density;
        def.node_damping = 0.02f;
        fixed (sinew_body_id* made = &block) Check(sinew_body_create(world, &def, made));
        sinew_mesh_destroy(mesh);
        var low = float.PositiveInfinity;
        foreach (var height in Heights()) { Top = Math.Max(Top, height); low = Math.Min(low, height); }
        floor = CreateTool(sinew_shape.SINEW_SHAPE_PLANE, 0, low);
        ball = CreateTool(sinew_shape.SINEW_SHAPE_SPHERE, Radius, Top + 1.2f * Radius);
        for (uint node = 0; node < Positions().count.ToUInt32(); node++)
        {
            float mass;
            Check(sinew_body_get_node_mass(world, block, node, &mass));
            Weight += 9.81f * mass;
        }
    }

    sinew_tool_id CreateTool(sinew_shape shape, float radius, float height)
    {
        sinew_tool_def def;
        sinew_tool_id tool;
        Check(sinew_tool_def_init(&def, (UIntPtr)sizeof(sinew_tool_def)));
        def.shape = (uint)shape;
        def.radius = radius;
        def.position[1] = height;
        def.friction = 0.3f;
        Check(sinew_tool_create(world, &def, &tool));
        return tool;
    }

    // The library's own memory: valid until the next step.
    public sinew_vec3_view Positions()
    {
        sinew_vec3_view view;
        Check(sinew_body_get_positions(world, block, &view));
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
        Check(sinew_tool_set_pose(world, ball, place, null));
    }

    public void FixedUpdate(float dt) { Check(sinew_world_step(world, dt, null)); }

    float Force(sinew_tool_id tool)
    {
        float* force = stackalloc float[3];
        Check(sinew_tool_get_wrench(world, tool, force, null));
        return force[1];
    }

    public float ForceOnBall { get { return Force(ball); } }
    public float ForceOnFloor { get { return Force(floor); } }

    public void SavePicture(string path)
    {
        sinew_picture_def def;
        Check(sinew_picture_def_init(&def, (UIntPtr)sizeof(sinew_picture_def)));
        def.show_contacts = 1;
        fixed (byte* name = Encoding.UTF8.GetBytes(path + "\0")) Check(sinew_world_save_picture(world, &def, name));
    }

    public void Dispose() { sinew_world_destroy(world); }
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
                Expect(refused.Status == sinew_status_code.SINEW_STATUS_INVALID_ARGUMENT && refused.Message.Contains("dt"), "it says why: " + refused.Message);
            }
            if (arguments.Length > 0) block.SavePicture(arguments[0]);
        }
    }
}
