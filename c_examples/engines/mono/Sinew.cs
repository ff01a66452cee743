// As much of sinew.h as Program.cs uses, for P/Invoke: put this file and libsinew.so (sinew.dll) into Assets/Plugins of a Unity
// project that allows unsafe code, and it is called in the same way. Every struct is blittable: nothing is copied or converted, and
// what the library lends is read through its pointer. A struct of the wrong size is refused by its ..._init.
using System;
using System.Runtime.InteropServices;
using System.Text;

[StructLayout(LayoutKind.Sequential)]
public unsafe struct WorldDef
{
    public UIntPtr struct_size;
    public fixed float gravity[3];
    public uint thread_count, substeps, max_substeps;
    public float tolerance;
    public uint reserved;
    public IntPtr run_tasks;
    public void* tasks_context;
    public uint kernel, reserved2;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct StepReport
{
    public UIntPtr struct_size;
    public uint substeps;
    public float stable_substep;
    public uint bodies_restored;
    public float error_estimate;
    public uint crossings, reserved;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct BodyDef
{
    public UIntPtr struct_size;
    public float* positions, rest_positions;
    public UIntPtr node_count;
    public float* masses, node_dampings;
    public float node_mass, node_damping;
    public uint* springs;
    public UIntPtr spring_count;
    public float* stiffnesses, rest_lengths, spring_dampings;
    public float stiffness, spring_damping;
    public uint* triangles;
    public UIntPtr triangle_count;
    public uint* tetrahedra;
    public UIntPtr tetrahedron_count;
    public uint storage, springs_per_node, solver, reserved, order, iterations;
    public float accuracy;
    public uint reserved1;
    public float mass_scaling;
    public uint reserved2;
    public uint* cells;
    public UIntPtr cell_count;
    public uint material;
    public float young_modulus, poisson_ratio, density, thickness, volume_stiffness;
    public float* home_stiffnesses;
    public float home_stiffness, bending_stiffness;
    public uint spring_law;
    public float spring_steepness, spring_quadratic, spring_cubic, spring_limit, fibre_stiffness;
    public float* fibre_directions, fibre_stiffnesses;
    public float retardation_time, relaxation_time, yield_strain, largest_set, strain_limit, limit_stiffening, enclosed_stiffness,
        pressure, contact_thickness, contact_friction;
    public uint meets_bodies, meets_itself, contact_detection;
    public float contact_resolution;
    public uint collision_category, collision_mask, spare_nodes;
    public float toughness, tear_strain, tear_force;
    public uint most_tears;
    public float smallest_piece, sleep_speed, sleep_time;
    public uint element_law;
    public float mooney_ratio;
    public float position_x, position_y, position_z;
    public float orientation_x, orientation_y, orientation_z, orientation_w;
    public float gravity_scale;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct BodyId
{
    public uint index1, generation;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct ToolDef
{
    public UIntPtr struct_size;
    public uint shape;
    public float radius, half_length;
    public uint reserved0;
    public float* positions;
    public UIntPtr node_count;
    public uint* triangles;
    public UIntPtr triangle_count;
    public uint detection;
    public float friction;
    public fixed float position[3];
    public fixed float orientation[4];
    public uint reserved;
    public float resolution, force_limit;
    public uint collision_category, collision_mask;
    public fixed float half_extents[3];
    public uint reserved1;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct ToolId
{
    public uint index1, generation;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct Vec3View
{
    public float* data;
    public UIntPtr count, stride;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct MeshView
{
    public UIntPtr struct_size;
    public float* positions;
    public UIntPtr node_count;
    public uint* triangles;
    public UIntPtr triangle_count;
    public uint* tetrahedra;
    public UIntPtr tetrahedron_count;
    public uint* surface;
    public UIntPtr surface_triangle_count;
    public uint* node_of_vertex;
    public UIntPtr vertex_count, welded_vertices, dropped_vertices, dropped_triangles, dropped_tetrahedra, flipped_tetrahedra;
    public uint closed, reserved;
    public uint* cells;
    public UIntPtr cell_count;
}

[StructLayout(LayoutKind.Sequential)]
public unsafe struct PictureDef
{
    public UIntPtr struct_size;
    public uint width, height;
    public fixed float eye[3];
    public fixed float target[3];
    public fixed float up[3];
    public fixed float direction[3];
    public float field_of_view;
    public uint show_contacts;
}


// A world; ended by Dispose, or by the collector. (A SafeHandle is not freed while a call that has it is under way.)
public sealed class WorldHandle : SafeHandle
{
    WorldHandle() : base(IntPtr.Zero, true) {}
    public override bool IsInvalid { get { return handle == IntPtr.Zero; } }
    protected override bool ReleaseHandle() { Sinew.sinew_world_destroy(handle); return true; }
}

public sealed class MeshHandle : SafeHandle
{
    MeshHandle() : base(IntPtr.Zero, true) {}
    public override bool IsInvalid { get { return handle == IntPtr.Zero; } }
    protected override bool ReleaseHandle() { Sinew.sinew_mesh_destroy(handle); return true; }
}

public class SinewException : Exception
{
    public readonly int Status;
    public SinewException(int status, string message) : base(message) { Status = status; }
}

public static unsafe class Sinew
{
    const string Library = "sinew";
    public const int StatusInvalidArgument = 1;
    public const uint ShapeSphere = 0, ShapePlane = 2, MaterialSprings = 1;

    [DllImport(Library)] static extern UIntPtr sinew_last_error(byte[] buffer, UIntPtr capacity);
    [DllImport(Library)] internal static extern void sinew_world_destroy(IntPtr world);
    [DllImport(Library)] internal static extern void sinew_mesh_destroy(IntPtr mesh);
    [DllImport(Library)] public static extern int sinew_world_def_init(WorldDef* def, UIntPtr size);
    [DllImport(Library)] public static extern int sinew_world_create(WorldDef* def, out WorldHandle world);
    [DllImport(Library)] public static extern int sinew_world_step(WorldHandle world, float dt, StepReport* report);
    [DllImport(Library)] public static extern int sinew_world_save_picture(WorldHandle world, PictureDef* def, byte[] path);
    [DllImport(Library)] public static extern int sinew_body_def_init(BodyDef* def, UIntPtr size);
    [DllImport(Library)] public static extern int sinew_body_create(WorldHandle world, BodyDef* def, out BodyId body);
    [DllImport(Library)] public static extern int sinew_body_get_positions(WorldHandle world, BodyId body, out Vec3View view);
    [DllImport(Library)] public static extern int sinew_body_get_node_mass(WorldHandle world, BodyId body, uint node, out float mass);
    [DllImport(Library)] public static extern int sinew_tool_def_init(ToolDef* def, UIntPtr size);
    [DllImport(Library)] public static extern int sinew_tool_create(WorldHandle world, ToolDef* def, out ToolId tool);
    [DllImport(Library)] public static extern int sinew_tool_set_pose(WorldHandle world, ToolId tool, float* position, float* orientation);
    [DllImport(Library)] public static extern int sinew_tool_get_wrench(WorldHandle world, ToolId tool, float* force, float* torque);
    [DllImport(Library)] public static extern int sinew_mesh_create_lattice(float edge, uint[] cells, out MeshHandle mesh);
    [DllImport(Library)] public static extern int sinew_mesh_get_view(MeshHandle mesh, MeshView* view);
    [DllImport(Library)] public static extern int sinew_picture_def_init(PictureDef* def, UIntPtr size);

    // Throws what a call that was refused says.
    public static void Check(int status)
    {
        if (status == 0) return;
        var buffer = new byte[512];
        sinew_last_error(buffer, (UIntPtr)buffer.Length);
        throw new SinewException(status, Encoding.UTF8.GetString(buffer, 0, Array.IndexOf(buffer, (byte)0)));
    }
}
