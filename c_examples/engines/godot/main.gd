# A cloth falls over a ball: GDScript leads the ball, sinew moves the cloth behind a GDNative library (soft.c), Godot draws it.
#
#   SINEW_SHIM=/path/to/libsoft.so godot3-runner --path c_examples/engines/godot
#
# SINEW_SHIM is soft.c as a shared library. With SINEW_PICTURE=FILE it runs by itself, leaves a picture and ends with 1 where something
# does not hold. godot3-server does that without a display; then it is sinew that draws.
extends Spatial

const FRAMES = 120
const RADIUS = 0.09
const HOME = Vector3(0, 0.2, 0)

var native = GDNative.new()
var cloth = MeshInstance.new()
var ball = MeshInstance.new()
var arrays = []
var frame = 0
var force = 0.0
var picture = OS.get_environment("SINEW_PICTURE")

func soft(name, arguments = []):
	return native.call_native("standard_varcall", "soft_" + name, arguments)

func checker():
	var image = Image.new()
	image.create(256, 256, false, Image.FORMAT_RGB8)
	image.lock()
	for y in 256:
		for x in 256:
			var dark = (x / 32 + y / 32) % 2 == 0
			image.set_pixel(x, y, Color(0.80, 0.22, 0.24) if dark else Color(0.95, 0.88, 0.80))
	image.unlock()
	image.generate_mipmaps()
	var texture = ImageTexture.new()
	texture.create_from_image(image)
	return texture

func coloured(colour):
	var material = SpatialMaterial.new()
	material.albedo_color = colour
	material.roughness = 0.5
	return material

func build_scene():
	var camera = Camera.new()
	camera.fov = 38
	add_child(camera)
	camera.look_at_from_position(Vector3(0.32, 0.4, 0.56), Vector3(0, 0.17, 0), Vector3.UP)
	var environment = Environment.new()
	environment.background_mode = Environment.BG_COLOR
	environment.background_color = Color(0.13, 0.15, 0.19)
	environment.ambient_light_color = Color(0.7, 0.75, 0.9)
	environment.ambient_light_energy = 0.35
	camera.environment = environment
	var sun = DirectionalLight.new()
	sun.rotation_degrees = Vector3(-50, 40, 0)
	sun.light_energy = 0.8
	sun.shadow_enabled = true
	sun.directional_shadow_max_distance = 3
	add_child(sun)
	var floor_mesh = PlaneMesh.new()
	floor_mesh.size = Vector2(4, 4)
	var ground = MeshInstance.new()
	ground.mesh = floor_mesh
	ground.material_override = coloured(Color(0.45, 0.48, 0.55))
	add_child(ground)
	var sphere = SphereMesh.new()
	sphere.radius = RADIUS
	sphere.height = 2 * RADIUS
	ball.mesh = sphere
	ball.material_override = coloured(Color(0.75, 0.8, 0.9))
	add_child(ball)
	var fabric = coloured(Color.white)
	fabric.albedo_texture = checker()
	fabric.params_cull_mode = SpatialMaterial.CULL_DISABLED
	cloth.material_override = fabric
	cloth.mesh = ArrayMesh.new()
	add_child(cloth)

func _ready():
	var config = ConfigFile.new()
	for system in ["X11.64", "Server.64", "OSX.64", "Windows.64"]:
		config.set_value("entry", system, OS.get_environment("SINEW_SHIM"))
		config.set_value("dependencies", system, [])
	var library = GDNativeLibrary.new()
	library.config_file = config
	native.library = library
	if not native.initialize() or soft("create", [HOME, RADIUS]) != 0:
		printerr("the library could not be used")
		get_tree().quit(1)
		return
	build_scene()
	arrays.resize(Mesh.ARRAY_MAX)
	arrays[Mesh.ARRAY_INDEX] = soft("triangles")
	# The texture lies on the cloth as it was at first.
	var uv = PoolVector2Array()
	for place in soft("positions"):
		uv.push_back(Vector2(place.x, place.z) * 4)
	arrays[Mesh.ARRAY_TEX_UV] = uv

func _process(_dt):
	if arrays.empty():
		return
	frame += 1
	VisualServer.render_loop_enabled = picture == "" or frame >= FRAMES
	ball.translation = HOME + Vector3(0.04 * sin(0.04 * frame), 0, 0) if picture == "" else HOME
	force = soft("step", [1.0 / 60, ball.translation])
	arrays[Mesh.ARRAY_VERTEX] = soft("positions")
	arrays[Mesh.ARRAY_NORMAL] = soft("normals")
	if not OS.has_feature("Server"):
		while cloth.mesh.get_surface_count() > 0:
			cloth.mesh.surface_remove(0)
		cloth.mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	if picture != "" and frame == FRAMES:
		finish()

# At rest the ball bears the cloth, and no node is within it.
func finish():
	var weight = soft("weight")
	var right = abs(-force / weight - 1) < 0.02
	for place in arrays[Mesh.ARRAY_VERTEX]:
		right = right and (place - HOME).length() > RADIUS - 1e-4
	print("%d nodes, %d frames: the ball bears %.4f N of %.4f N" % [arrays[Mesh.ARRAY_VERTEX].size(), frame, -force, weight])
	if OS.has_feature("Server"):
		right = right and soft("save_picture") == 0
	else:
		yield(VisualServer, "frame_post_draw")
		var image = get_viewport().get_texture().get_data()
		image.flip_y()
		right = right and image.save_png(picture) == OK
	if not right:
		printerr("something does not hold")
	get_tree().quit(0 if right else 1)

func _exit_tree():
	if native.library:
		soft("destroy")
		native.terminate()
