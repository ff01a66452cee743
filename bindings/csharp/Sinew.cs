// Generated from include/sinew; do not edit. Names, units and rules are those of the C headers.
// Compile with -unsafe. sinew_status is int, size_t UIntPtr, an opaque handle or callback IntPtr.
using System;
using System.Runtime.InteropServices;

public static unsafe class Sinew
{
    const string Library = "sinew";
    public const uint SINEW_VERSION_MAJOR = 0;
    public const uint SINEW_VERSION_MINOR = 2;
    public const uint SINEW_VERSION_PATCH = 0;
    public const uint SINEW_NO_NODE = 4294967295;
    public const uint SINEW_AXIS_X = 1;
    public const uint SINEW_AXIS_Y = 2;
    public const uint SINEW_AXIS_Z = 4;
    public const uint SINEW_NO_TRIANGLE = 4294967295;

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint sinew_version();

    public enum sinew_status_code { SINEW_STATUS_OK = 0, SINEW_STATUS_INVALID_ARGUMENT = 1, SINEW_STATUS_STALE_ID = 2, SINEW_STATUS_CAPACITY = 3, SINEW_STATUS_OUT_OF_MEMORY = 4, SINEW_STATUS_UNSTABLE = 5, SINEW_STATUS_UNSUPPORTED = 6, SINEW_STATUS_IO = 7, SINEW_STATUS_INTERNAL = 8 }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern byte* sinew_status_name(int status);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern UIntPtr sinew_last_error(byte* buffer, UIntPtr capacity);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_body_id
    {
        public uint index1;
        public uint generation;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_tool_id
    {
        public uint index1;
        public uint generation;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_blade_id
    {
        public uint index1;
        public uint generation;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_attachment_id
    {
        public uint index1;
        public uint generation;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_vec3_view
    {
        public float* data;
        public UIntPtr count;
        public UIntPtr stride;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_dvec3_view
    {
        public double* data;
        public UIntPtr count;
        public UIntPtr stride;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_triangle_view
    {
        public uint* data;
        public UIntPtr count;
    }

    public enum sinew_detection { SINEW_DETECTION_EXACT = 0, SINEW_DETECTION_IMAGE_SPACE = 1, SINEW_DETECTION_DISTANCE_FIELD = 2 }

    public enum sinew_kernel { SINEW_KERNEL_BEST = 0, SINEW_KERNEL_PORTABLE = 1, SINEW_KERNEL_AVX2 = 2, SINEW_KERNEL_AVX512 = 3, SINEW_KERNEL_NEON = 4 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_world_def
    {
        public UIntPtr struct_size;
        public fixed float gravity[3];
        public uint thread_count;
        public uint substeps;
        public uint max_substeps;
        public float tolerance;
        public uint reserved;
        public IntPtr run_tasks;
        public void* tasks_context;
        public uint kernel;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_def_init(sinew_world_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_create(sinew_world_def* def, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void sinew_world_destroy(IntPtr world);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_step_report
    {
        public UIntPtr struct_size;
        public uint substeps;
        public float stable_substep;
        public uint bodies_restored;
        public float error_estimate;
        public uint crossings;
        public uint limit;
        public sinew_body_id limit_body;
        public fixed uint limit_nodes[4];
        public uint limit_substeps;
        public uint work;
        public uint work_done;
        public float residual;
        public double lag;
        public sinew_body_id substeps_body;
        public sinew_body_id restored_body;
        public sinew_body_id crossing_body;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_step(IntPtr world, float dt, sinew_step_report* report);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_set_gravity(IntPtr world, float* gravity);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_gravity(IntPtr world, float* out_gravity);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_set_substeps(IntPtr world, uint substeps, uint max_substeps);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_substeps(IntPtr world, uint* out_substeps, uint* out_max_substeps);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_time(IntPtr world, double* out_time, ulong* out_steps);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_state_hash(IntPtr world, ulong* @out);

    public enum sinew_mesh_format { SINEW_MESH_FORMAT_AUTO = 0, SINEW_MESH_FORMAT_OBJ = 1, SINEW_MESH_FORMAT_STL = 2, SINEW_MESH_FORMAT_VTK = 3, SINEW_MESH_FORMAT_GMSH = 4, SINEW_MESH_FORMAT_TETGEN = 5 }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_load(byte* path, uint format, float scale, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_create_cloth(float* size, uint* cells, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_create_block(float* size, uint* cells, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_create_lattice(float edge, uint* cells, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_create_organ(float length, float spacing, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_create(float* positions, UIntPtr node_count, uint* triangles, UIntPtr triangle_count, uint* tetrahedra, UIntPtr tetrahedron_count, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_create_filled(IntPtr surface, float spacing, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void sinew_mesh_destroy(IntPtr mesh);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_mesh_view
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
        public UIntPtr vertex_count;
        public UIntPtr welded_vertices;
        public UIntPtr dropped_vertices;
        public UIntPtr dropped_triangles;
        public UIntPtr dropped_tetrahedra;
        public UIntPtr flipped_tetrahedra;
        public uint is_closed;
        public uint* cells;
        public UIntPtr cell_count;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_mesh_get_view(IntPtr mesh, sinew_mesh_view* @out);

    public enum sinew_storage { SINEW_STORAGE_PACKED = 0, SINEW_STORAGE_EFFICIENT = 1, SINEW_STORAGE_FAST_LINK = 2, SINEW_STORAGE_DYNAMIC_BULK = 3 }

    public enum sinew_solver { SINEW_SOLVER_VERLET = 0, SINEW_SOLVER_IMPLICIT = 1, SINEW_SOLVER_NEWTON = 2, SINEW_SOLVER_AUTO = 3 }

    public enum sinew_material { SINEW_MATERIAL_NONE = 0, SINEW_MATERIAL_SPRINGS = 1, SINEW_MATERIAL_TETRAHEDRA = 2 }

    public enum sinew_spring_law { SINEW_SPRING_LAW_LINEAR = 0, SINEW_SPRING_LAW_EXPONENTIAL = 1, SINEW_SPRING_LAW_CUBIC = 2 }

    public enum sinew_element_law { SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF = 0, SINEW_ELEMENT_LAW_NEO_HOOKEAN = 1, SINEW_ELEMENT_LAW_MOONEY_RIVLIN = 2 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_body_def
    {
        public UIntPtr struct_size;
        public float* positions;
        public float* rest_positions;
        public UIntPtr node_count;
        public float* masses;
        public float* node_dampings;
        public float node_mass;
        public float node_damping;
        public uint* springs;
        public UIntPtr spring_count;
        public float* stiffnesses;
        public float* rest_lengths;
        public float* spring_dampings;
        public float stiffness;
        public float spring_damping;
        public uint* triangles;
        public UIntPtr triangle_count;
        public uint* tetrahedra;
        public UIntPtr tetrahedron_count;
        public uint storage;
        public uint springs_per_node;
        public uint solver;
        public uint reserved;
        public uint order;
        public uint iterations;
        public float accuracy;
        public float mass_scaling;
        public uint* cells;
        public UIntPtr cell_count;
        public uint material;
        public float young_modulus;
        public float poisson_ratio;
        public float density;
        public float thickness;
        public float volume_stiffness;
        public float* home_stiffnesses;
        public float home_stiffness;
        public float bending_stiffness;
        public uint spring_law;
        public float spring_steepness;
        public float spring_quadratic;
        public float spring_cubic;
        public float spring_limit;
        public float fibre_stiffness;
        public float* fibre_directions;
        public float* fibre_stiffnesses;
        public float retardation_time;
        public float relaxation_time;
        public float yield_strain;
        public float largest_set;
        public float strain_limit;
        public float limit_stiffening;
        public float enclosed_stiffness;
        public float pressure;
        public float contact_thickness;
        public float contact_friction;
        public uint meets_bodies;
        public uint meets_itself;
        public uint contact_detection;
        public float contact_resolution;
        public uint collision_category;
        public uint collision_mask;
        public uint spare_nodes;
        public float toughness;
        public float tear_strain;
        public float tear_force;
        public uint most_tears;
        public float smallest_piece;
        public float sleep_speed;
        public float sleep_time;
        public uint element_law;
        public float mooney_ratio;
        public fixed float position[3];
        public fixed float orientation[4];
        public float gravity_scale;
        public float damping_rate;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_def_init(sinew_body_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_create(IntPtr world, sinew_body_def* def, sinew_body_id* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_destroy(IntPtr world, sinew_body_id body);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_positions(IntPtr world, sinew_body_id body, sinew_vec3_view* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_velocities(IntPtr world, sinew_body_id body, sinew_vec3_view* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_positions(IntPtr world, sinew_body_id body, float* positions, UIntPtr node_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_velocities(IntPtr world, sinew_body_id body, float* velocities, UIntPtr node_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_triangles(IntPtr world, sinew_body_id body, sinew_triangle_view* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_is_closed(IntPtr world, sinew_body_id body, uint* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_node_mass(IntPtr world, sinew_body_id body, uint node, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_apply_force(IntPtr world, sinew_body_id body, uint node, float* force);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_apply_forces(IntPtr world, sinew_body_id body, uint* nodes, float* forces, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_pin(IntPtr world, sinew_body_id body, uint node);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_pin_axes(IntPtr world, sinew_body_id body, uint node, uint axes);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_unpin(IntPtr world, sinew_body_id body, uint node);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_move_pin(IntPtr world, sinew_body_id body, uint node, float* position);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_pin_force(IntPtr world, sinew_body_id body, uint node, float* force);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_collision(IntPtr world, sinew_body_id body, uint category, uint mask);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_collision(IntPtr world, sinew_body_id body, uint* out_category, uint* out_mask);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_wake(IntPtr world, sinew_body_id body);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_awake_share(IntPtr world, sinew_body_id body, float* @out);

    public enum sinew_shape { SINEW_SHAPE_SPHERE = 0, SINEW_SHAPE_CAPSULE = 1, SINEW_SHAPE_PLANE = 2, SINEW_SHAPE_MESH = 3, SINEW_SHAPE_BOX = 4 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_tool_def
    {
        public UIntPtr struct_size;
        public uint shape;
        public float radius;
        public float half_length;
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
        public float resolution;
        public float force_limit;
        public uint collision_category;
        public uint collision_mask;
        public fixed float half_extents[3];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_def_init(sinew_tool_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_create(IntPtr world, sinew_tool_def* def, sinew_tool_id* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_destroy(IntPtr world, sinew_tool_id tool);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_pose(IntPtr world, sinew_tool_id tool, float* position, float* orientation);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_pose(IntPtr world, sinew_tool_id tool, float* out_position, float* out_orientation);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_friction(IntPtr world, sinew_tool_id tool, float friction);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_friction(IntPtr world, sinew_tool_id tool, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_force_limit(IntPtr world, sinew_tool_id tool, float force_limit);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_force_limit(IntPtr world, sinew_tool_id tool, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_collision(IntPtr world, sinew_tool_id tool, uint category, uint mask);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_collision(IntPtr world, sinew_tool_id tool, uint* out_category, uint* out_mask);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_wrench(IntPtr world, sinew_tool_id tool, float* force, float* torque);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_contact
    {
        public sinew_body_id body;
        public void* body_user_data;
        public fixed uint nodes[3];
        public fixed float weights[3];
        public fixed float point[3];
        public fixed float normal[3];
        public fixed float force[3];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_contacts(IntPtr world, sinew_tool_id tool, sinew_contact* out_contacts, UIntPtr capacity, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_material_preset
    {
        public UIntPtr struct_size;
        public byte* name;
        public byte* source;
        public float shear_modulus;
        public float young_modulus;
        public float density;
    }

    public enum sinew_preset { SINEW_PRESET_LIVER = 0, SINEW_PRESET_FIBROTIC_LIVER = 1, SINEW_PRESET_LIVER_TUMOUR = 2, SINEW_PRESET_STOMACH = 3, SINEW_PRESET_GALLBLADDER = 4, SINEW_PRESET_BILE_DUCT = 5, SINEW_PRESET_HEPATIC_ARTERY = 6 }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_material_get_preset(uint preset, sinew_material_preset* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_add_spring(IntPtr world, sinew_body_id body, uint a, uint b, float stiffness, float rest_length);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_remove_spring(IntPtr world, sinew_body_id body, uint a, uint b);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_spring_pairs(IntPtr world, sinew_body_id body, uint* out_pairs, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_springs(IntPtr world, sinew_body_id body, uint* pairs, UIntPtr count, float* out_stiffnesses, float* out_rest_lengths);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_springs(IntPtr world, sinew_body_id body, uint* pairs, float* stiffnesses, float* rest_lengths, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_scale_region(IntPtr world, sinew_body_id body, uint* nodes, UIntPtr node_count, float stiffness_factor, float length_factor);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_pressure(IntPtr world, sinew_body_id body, float pressure);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_pressure(IntPtr world, sinew_body_id body, float* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_enclosed_report
    {
        public UIntPtr struct_size;
        public UIntPtr cavity_count;
        public double volume;
        public double rest_volume;
        public double pressure;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_enclosed_report(IntPtr world, sinew_body_id body, sinew_enclosed_report* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_equilibrium_def
    {
        public UIntPtr struct_size;
        public float tolerance;
        public uint iterations;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_equilibrium_def_init(sinew_equilibrium_def* def, UIntPtr struct_size);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_equilibrium_report
    {
        public UIntPtr struct_size;
        public uint iterations;
        public uint products;
        public double residual;
        public double error;
        public double energy_before;
        public double energy_after;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_solve_equilibrium(IntPtr world, sinew_body_id body, sinew_equilibrium_def* def, sinew_equilibrium_report* out_report);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_surface_point
    {
        public UIntPtr struct_size;
        public sinew_body_id body;
        public uint triangle;
        public fixed float weights[3];
        public fixed float position[3];
        public fixed float normal[3];
        public float distance;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_cast_ray(IntPtr world, float* origin, float* direction, float max_distance, sinew_surface_point* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_find_nearest(IntPtr world, float* point, float max_distance, sinew_surface_point* @out);

    public enum sinew_image_form { SINEW_IMAGE_FORM_INTERVALS = 0, SINEW_IMAGE_FORM_COUNTED = 1 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_detector_def
    {
        public UIntPtr struct_size;
        public sinew_body_id bodies_0, bodies_1;
        public uint detection;
        public uint form;
        public float pixel;
        public fixed float direction[3];
        public uint pixels;
        public uint crossings;
        public fixed float thickness[2];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_detector_def_init(sinew_detector_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_detector_create(IntPtr world, sinew_detector_def* def, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void sinew_detector_destroy(IntPtr detector);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_detector_report
    {
        public UIntPtr struct_size;
        public double volume;
        public fixed float normal[3];
        public float depth;
        public float pixel;
        public fixed uint point_counts[2];
        public fixed uint edge_counts[2];
        public fixed uint unlisted[2];
        public fixed uint is_closed[2];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_detector_find(IntPtr detector, IntPtr world, sinew_detector_report* out_report);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_point_inside
    {
        public uint node;
        public uint triangle;
        public float depth;
        public fixed float normal[3];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_detector_get_points(IntPtr detector, uint side, sinew_point_inside** out_points, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_edge_inside
    {
        public fixed uint nodes[2];
        public float entry;
        public float exit;
        public float depth;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_detector_get_edges(IntPtr detector, uint side, sinew_edge_inside** out_edges, UIntPtr* out_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_detector_get_gradient(IntPtr detector, uint side, sinew_dvec3_view* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_attachment_def
    {
        public UIntPtr struct_size;
        public sinew_body_id body;
        public sinew_tool_id tool;
        public sinew_body_id other;
        public UIntPtr count;
        public uint* nodes;
        public uint* triangles;
        public float* weights;
        public uint* other_nodes;
        public uint* other_triangles;
        public float* other_weights;
        public float force_limit;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_attachment_def_init(sinew_attachment_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_attachment_create(IntPtr world, sinew_attachment_def* def, sinew_attachment_id* out_attachments);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_suture_def
    {
        public UIntPtr struct_size;
        public float length;
        public float stiffness;
        public float force_limit;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_suture_def_init(sinew_suture_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_suture_create(IntPtr world, sinew_surface_point* point, sinew_surface_point* other_point, sinew_suture_def* def, sinew_attachment_id* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_suture_set_length(IntPtr world, sinew_attachment_id suture, float length);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_suture_report
    {
        public UIntPtr struct_size;
        public float length;
        public float distance;
        public double energy;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_suture_get_report(IntPtr world, sinew_attachment_id suture, sinew_suture_report* out_report);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_attachment_release(IntPtr world, sinew_attachment_id attachment);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_attachment_get_force(IntPtr world, sinew_attachment_id attachment, float* out_force);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_broken_attachments(IntPtr world, sinew_attachment_id* out_attachments, UIntPtr capacity, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_cut_report
    {
        public UIntPtr struct_size;
        public uint new_nodes;
        public uint new_triangles;
        public uint springs_removed;
        public uint pieces_parted;
        public double length;
        public double area;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_cut(IntPtr world, sinew_body_id body, float* start, float* end, sinew_cut_report* out_report);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_new_node
    {
        public uint node;
        public fixed uint sources[3];
        public fixed float weights[3];
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_rim_edge
    {
        public fixed uint nodes[2];
        public uint triangle;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_topology_changes
    {
        public UIntPtr struct_size;
        public ulong version;
        public sinew_new_node* nodes;
        public UIntPtr node_count;
        public uint* triangles;
        public UIntPtr triangle_count;
        public uint* removed_springs;
        public UIntPtr removed_spring_count;
        public sinew_rim_edge* rim;
        public UIntPtr rim_count;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_topology_changes(IntPtr world, sinew_body_id body, ulong since_version, sinew_topology_changes* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_pieces(IntPtr world, sinew_body_id body, uint* out_pieces, UIntPtr node_count, uint* out_piece_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_max_counts(IntPtr world, sinew_body_id body, uint* out_max_nodes, uint* out_max_triangles);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_blade_def
    {
        public UIntPtr struct_size;
        public fixed float edge[6];
        public float stiffness;
        public uint collision_category;
        public uint collision_mask;
        public fixed float position[3];
        public fixed float orientation[4];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_def_init(sinew_blade_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_create(IntPtr world, sinew_blade_def* def, sinew_blade_id* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_destroy(IntPtr world, sinew_blade_id blade);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_set_pose(IntPtr world, sinew_blade_id blade, float* position, float* orientation);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_get_pose(IntPtr world, sinew_blade_id blade, float* out_position, float* out_orientation);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_set_collision(IntPtr world, sinew_blade_id blade, uint category, uint mask);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_get_collision(IntPtr world, sinew_blade_id blade, uint* out_category, uint* out_mask);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_blade_report
    {
        public UIntPtr struct_size;
        public fixed float force[3];
        public fixed float torque[3];
        public double work;
        public double length;
        public double lag;
        public int status;
        public double area;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_get_report(IntPtr world, sinew_blade_id blade, sinew_blade_report* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_tear_limits(IntPtr world, sinew_body_id body, uint* pairs, float* strains, float* forces, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_tear_limits(IntPtr world, sinew_body_id body, uint* pairs, UIntPtr count, float* out_strains, float* out_forces);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_tear_report
    {
        public UIntPtr struct_size;
        public uint tears;
        public uint pieces_parted;
        public uint waiting;
        public uint small_pieces;
        public uint no_room;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_tear_report(IntPtr world, sinew_body_id body, sinew_tear_report* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_haptic_def
    {
        public UIntPtr struct_size;
        public sinew_tool_id tool;
        public float stiffness;
        public float angular_stiffness;
        public float damping_ratio;
        public float device_mass;
        public float force_limit;
        public float torque_limit;
        public float force_rate_limit;
        public float torque_rate_limit;
        public float stale_after;
        public float ramp;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_haptic_def_init(sinew_haptic_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_haptic_create(IntPtr world, sinew_haptic_def* def, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void sinew_haptic_destroy(IntPtr haptic);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_haptic_report
    {
        public UIntPtr struct_size;
        public fixed float force[3];
        public fixed float torque[3];
        public fixed float proxy_position[3];
        public fixed float proxy_orientation[4];
        public uint contact_count;
        public float age;
        public ulong version;
        public float gain;
        public uint is_over;
        public double lost;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_haptic_tick(IntPtr haptic, float* position, float* orientation, float* velocity, float* angular_velocity, float dt, sinew_haptic_report* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_haptic_contact
    {
        public sinew_body_id body;
        public fixed float point[3];
        public fixed float normal[3];
        public fixed float velocity[3];
        public fixed float force[3];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_haptic_get_contacts(IntPtr haptic, sinew_haptic_contact* out_contacts, UIntPtr capacity, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_mass_properties
    {
        public UIntPtr struct_size;
        public float mass;
        public fixed float center_of_mass[3];
        public fixed float inertia[6];
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_mass_of_density(IntPtr world, sinew_tool_id tool, float density, sinew_mass_properties* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_mass(IntPtr world, sinew_tool_id tool, sinew_mass_properties* mass);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_mass(IntPtr world, sinew_tool_id tool, sinew_mass_properties* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_velocity(IntPtr world, sinew_tool_id tool, float* velocity, float* angular_velocity);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_velocity(IntPtr world, sinew_tool_id tool, float* out_velocity, float* out_angular_velocity);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_apply_wrench(IntPtr world, sinew_tool_id tool, float* force, float* torque);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_teleport(IntPtr world, sinew_tool_id tool, float* position, float* orientation);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_embedding_def
    {
        public UIntPtr struct_size;
        public float* vertices;
        public UIntPtr vertex_count;
        public uint* triangles;
        public UIntPtr triangle_count;
        public uint* tetrahedra;
        public UIntPtr tetrahedron_count;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_def_init(sinew_embedding_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_create(IntPtr world, sinew_body_id body, sinew_embedding_def* def, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void sinew_embedding_destroy(IntPtr embedding);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_update(IntPtr embedding, IntPtr world);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_update_from(IntPtr embedding, float* positions, UIntPtr node_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_get_positions(IntPtr embedding, sinew_vec3_view* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_get_triangles(IntPtr embedding, sinew_triangle_view* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_embedding_get_normals(IntPtr embedding, sinew_vec3_view* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_create_from_surface(IntPtr world, sinew_body_def* def, float spacing, sinew_body_id* out_body, IntPtr* out_embedding);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_reader_create(IntPtr world, sinew_body_id body, IntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern void sinew_reader_destroy(IntPtr reader);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_frame
    {
        public UIntPtr struct_size;
        public sinew_vec3_view positions;
        public sinew_triangle_view triangles;
        public ulong version;
        public ulong topology_version;
        public ulong step;
        public double time;
        public uint is_new;
        public uint is_over;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_reader_read(IntPtr reader, sinew_frame* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_def_set_mesh(sinew_body_def* def, IntPtr mesh);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_transform(IntPtr world, sinew_body_id body, float* translation, float* rotation, float* pivot);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_bounds(IntPtr world, sinew_body_id body, float* out_min, float* out_max);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_normals(IntPtr world, sinew_body_id body, float* out_normals, UIntPtr node_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_masses(IntPtr world, sinew_body_id body, float* out_masses, UIntPtr node_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_apply_impulses(IntPtr world, sinew_body_id body, uint* nodes, float* impulses, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_gravity_scale(IntPtr world, sinew_body_id body, float scale);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_gravity_scale(IntPtr world, sinew_body_id body, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_acceleration(IntPtr world, sinew_body_id body, float* acceleration);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_acceleration(IntPtr world, sinew_body_id body, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_pin_nodes(IntPtr world, sinew_body_id body, uint* nodes, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_unpin_nodes(IntPtr world, sinew_body_id body, uint* nodes, UIntPtr count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_pin_box(IntPtr world, sinew_body_id body, float* min, float* max, UIntPtr* out_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_unpin_box(IntPtr world, sinew_body_id body, float* min, float* max, UIntPtr* out_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_pin_forces(IntPtr world, sinew_body_id body, float* out_forces, UIntPtr node_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_target(IntPtr world, sinew_tool_id tool, float* out_position, float* out_orientation);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_total_wrench(IntPtr world, sinew_tool_id* tools, UIntPtr count, float* point, float* out_force, float* out_torque);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_contacts(IntPtr world, sinew_body_id body, sinew_contact* out_contacts, UIntPtr capacity, UIntPtr* out_count);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_blade_get_contacts(IntPtr world, sinew_blade_id blade, sinew_contact* out_contacts, UIntPtr capacity, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_contact_change
    {
        public sinew_tool_id tool;
        public sinew_body_id body;
        public void* tool_user_data;
        public void* body_user_data;
        public uint has_begun;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_contact_changes(IntPtr world, sinew_contact_change* out_changes, UIntPtr capacity, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_body_contact_change
    {
        public sinew_body_id body;
        public sinew_body_id other;
        public sinew_blade_id blade;
        public void* body_user_data;
        public void* other_user_data;
        public uint has_begun;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_body_contact_changes(IntPtr world, sinew_body_contact_change* out_changes, UIntPtr capacity, UIntPtr* out_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_ray_hit
    {
        public UIntPtr struct_size;
        public sinew_body_id body;
        public sinew_tool_id tool;
        public uint triangle;
        public fixed float weights[3];
        public fixed float position[3];
        public fixed float normal[3];
        public float distance;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_cast_ray_filtered(IntPtr world, float* origin, float* direction, float max_distance, uint category, uint mask, sinew_ray_hit* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_body_settings
    {
        public UIntPtr struct_size;
        public float contact_thickness;
        public float contact_friction;
        public uint meets_bodies;
        public uint meets_itself;
        public float sleep_speed;
        public float sleep_time;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_settings(IntPtr world, sinew_body_id body, sinew_body_settings* settings);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_settings(IntPtr world, sinew_body_id body, sinew_body_settings* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_node_damping(IntPtr world, sinew_body_id body, float node_damping);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_node_damping(IntPtr world, sinew_body_id body, uint node, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_step_with_budget(IntPtr world, float dt, uint work, sinew_step_report* report);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_step_within(IntPtr world, float dt, double seconds, sinew_step_report* report);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_drop_lag(IntPtr world);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_force_error(IntPtr world, sinew_tool_id tool, float* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint sinew_body_is_valid(IntPtr world, sinew_body_id body);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint sinew_tool_is_valid(IntPtr world, sinew_tool_id tool);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint sinew_blade_is_valid(IntPtr world, sinew_blade_id blade);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern uint sinew_attachment_is_valid(IntPtr world, sinew_attachment_id attachment);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_set_user_data(IntPtr world, void* user_data);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_user_data(IntPtr world, void** @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_set_user_data(IntPtr world, sinew_body_id body, void* user_data);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_user_data(IntPtr world, sinew_body_id body, void** @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_set_user_data(IntPtr world, sinew_tool_id tool, void* user_data);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_tool_get_user_data(IntPtr world, sinew_tool_id tool, void** @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_snapshot_size(IntPtr world, UIntPtr* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_save_snapshot(IntPtr world, byte* out_bytes, UIntPtr size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_load_snapshot(byte* bytes, UIntPtr size, sinew_world_def* def, IntPtr* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_energy
    {
        public UIntPtr struct_size;
        public double kinetic;
        public double elastic;
        public double gravitational;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_energy(IntPtr world, sinew_body_id body, sinew_energy* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_solver_report
    {
        public UIntPtr struct_size;
        public uint iterations;
        public float error;
        public double added_mass;
        public uint solves;
        public uint has_converged;
        public uint solver;
        public uint auto_substeps;
        public float auto_step;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_solver_report(IntPtr world, sinew_body_id body, sinew_solver_report* @out);

    public enum sinew_limit { SINEW_LIMIT_NONE = 0, SINEW_LIMIT_SPRING = 1, SINEW_LIMIT_ELEMENT = 2, SINEW_LIMIT_TERM = 3, SINEW_LIMIT_CAVITY = 4, SINEW_LIMIT_PARTS = 5, SINEW_LIMIT_TOLERANCE = 6 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_storage_report
    {
        public UIntPtr struct_size;
        public UIntPtr node_count;
        public UIntPtr spring_count;
        public UIntPtr bytes_used;
        public UIntPtr bytes_reserved;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_storage_report(IntPtr world, sinew_body_id body, sinew_storage_report* @out);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_spring_strains(IntPtr world, sinew_body_id body, uint* pairs, float* rest_lengths, UIntPtr count, float* out_strains);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_strain
    {
        public float largest;
        public float smallest;
        public float growth;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_triangle_strains(IntPtr world, sinew_body_id body, float* rest_positions, UIntPtr node_count, uint* triangles, UIntPtr triangle_count, sinew_strain* out_strains);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_body_get_tetrahedron_strains(IntPtr world, sinew_body_id body, float* rest_positions, UIntPtr node_count, uint* tetrahedra, UIntPtr tetrahedron_count, sinew_strain* out_strains);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_util_average_to_nodes(uint* elements, uint corners, float* values, UIntPtr element_count, float* out_means, UIntPtr node_count);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_picture_def
    {
        public UIntPtr struct_size;
        public uint width;
        public uint height;
        public fixed float eye[3];
        public fixed float target[3];
        public fixed float up[3];
        public fixed float direction[3];
        public float field_of_view;
        public uint show_contacts;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_picture_def_init(sinew_picture_def* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_save_picture(IntPtr world, sinew_picture_def* def, byte* path);

    public enum sinew_colours { SINEW_COLOURS_DIVERGING = 0, SINEW_COLOURS_SEQUENTIAL = 1 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_body_values
    {
        public sinew_body_id body;
        public float* values;
        public UIntPtr node_count;
        public float low;
        public float high;
        public uint colours;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_save_picture_of_values(IntPtr world, sinew_picture_def* def, sinew_body_values* coloured, UIntPtr count, byte* path);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_set_profiling(IntPtr world, uint enabled);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_profiling(IntPtr world, uint* @out);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_profile
    {
        public UIntPtr struct_size;
        public double step;
        public double plan;
        public double forces;
        public double solver;
        public double broad_phase;
        public double narrow_phase;
        public double contact_solver;
        public double publish;
        public double cutting;
        public ulong bodies;
        public ulong sleeping_bodies;
        public ulong tries;
        public ulong substeps;
        public ulong iterations;
        public ulong candidates;
        public ulong tool_contacts;
        public ulong tissue_contacts;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_get_profile(IntPtr world, sinew_profile* @out);

    public enum sinew_draw_flags { SINEW_DRAW_CONTACTS = 1, SINEW_DRAW_NORMALS = 2, SINEW_DRAW_PINS = 4, SINEW_DRAW_ATTACHMENTS = 8, SINEW_DRAW_SPRINGS = 16, SINEW_DRAW_SLEEPING = 32, SINEW_DRAW_BOUNDS = 64 }

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_debug_draw
    {
        public UIntPtr struct_size;
        public uint flags;
        public float normal_length;
        public float force_scale;
        public float full_strain;
        public void* context;
        public IntPtr draw_line;
        public IntPtr draw_point;
        public IntPtr draw_triangle;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_debug_draw_init(sinew_debug_draw* def, UIntPtr struct_size);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_debug_draw(IntPtr world, sinew_debug_draw* def);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_start_recording(IntPtr world, byte* path);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_world_stop_recording(IntPtr world, ulong* out_steps);

    [StructLayout(LayoutKind.Sequential)]
    public struct sinew_replay_report
    {
        public UIntPtr struct_size;
        public ulong steps;
        public ulong first_difference;
        public ulong recorded_hash;
        public ulong replayed_hash;
        public uint is_cut_short;
    }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_replay(byte* path, uint thread_count, sinew_replay_report* @out);

    public enum sinew_log_level { SINEW_LOG_OFF = 0, SINEW_LOG_FAULT = 1, SINEW_LOG_ERROR = 2, SINEW_LOG_WARNING = 3 }

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_set_log_callback(uint level, IntPtr callback, void* context);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_get_log_callback(uint* out_level, IntPtr* out_callback, void** out_context);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_set_allocator(IntPtr alloc, IntPtr dealloc, void* context);

    [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
    public static extern int sinew_get_allocator(IntPtr* out_alloc, IntPtr* out_dealloc, void** out_context);
}
