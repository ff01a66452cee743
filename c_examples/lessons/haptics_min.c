/* Feel tissue at 1 kHz.
 *
 * The device's thread calls sinew_haptic_tick every millisecond, while another thread steps the world. To stay short,
 * this example does both on one thread: 16 ticks, then one step at about 60 Hz. A simulated hand presses down.
 * In your program read the device and write its force where the comments say so. Next: ../haptics.c uses two threads.
 *
 * Output:
 *   force before contact: 0.0 N
 *   the tissue pushes back: yes
 *   the force never jumped by more than 0.1 N: yes
 *   contacts: yes, led to within 1 mm of the hand: yes
 */
#include "../example.h"

int main(void) {
  sinew_world *world = create_world(0.0f);
  const float size[3] = {0.08f, 0.04f, 0.08f};
  const uint32_t cells[3] = {8, 4, 8};
  sinew_mesh *mesh;
  CHECK(sinew_mesh_create_block(size, cells, &mesh));
  sinew_body_def def = body_from_mesh(mesh);
  def.material = SINEW_MATERIAL_SPRINGS;
  def.young_modulus = 5400.0f;
  def.density = 1060.0f;
  def.damping_rate = 20.0f; /* 1/s: the tissue comes to rest in half a second, with any solver */
  sinew_body_id tissue;
  CHECK(sinew_body_create(world, &def, &tissue));
  sinew_mesh_destroy(mesh);
  pin_below(world, tissue, 1, -0.019f);

  float hand[3] = {0, 0.035f, 0}; /* m: the device's position */
  sinew_tool_def tool_def;
  CHECK(sinew_tool_def_init(&tool_def, sizeof tool_def));
  tool_def.radius = 0.01f;
  memcpy(tool_def.position, hand, sizeof hand); /* the tool starts where the device is */
  sinew_haptic_def haptic_def;
  CHECK(sinew_haptic_def_init(&haptic_def, sizeof haptic_def));
  CHECK(sinew_tool_create(world, &tool_def, &haptic_def.tool));
  haptic_def.force_limit = 3.0f; /* N: what the device can exert */
  sinew_haptic *haptic;
  CHECK(sinew_haptic_create(world, &haptic_def, &haptic));

  sinew_haptic_report felt;
  felt.struct_size = sizeof felt;
  double last = 0, largest_jump = 0, before_contact = 0;
  for (int tick = 0; tick < 1000; tick++) {
    hand[1] -= 1.5e-5f; /* yours: read the device's position */
    CHECK(sinew_haptic_tick(haptic, hand, NULL, NULL, NULL, 1e-3f, &felt));
    largest_jump = fmax(largest_jump, fabs(felt.force[1] - last)); /* yours: write felt.force to the device */
    last = felt.force[1];
    if (tick == 200) before_contact = last; /* the ball is still 2 mm above the tissue */
    if (tick % 16 == 15) CHECK(sinew_world_step(world, 0.016f, NULL));
  }
  printf("force before contact: %.1f N\n", fabs(before_contact));
  printf("the tissue pushes back: %s\n", last > 0.05 ? "yes" : "no");
  printf("the force never jumped by more than 0.1 N: %s\n", largest_jump <= 0.1 ? "yes" : "no");

  /* What is felt, for a display: the contacts of the last tick, and where the device led the tool. */
  size_t contacts;
  float led[3];
  CHECK(sinew_haptic_get_contacts(haptic, NULL, 0, &contacts));
  CHECK(sinew_tool_get_target(world, haptic_def.tool, led, NULL));
  printf("contacts: %s, led to within 1 mm of the hand: %s\n", contacts > 0 ? "yes" : "no",
         distance(led, hand) < 1e-3 ? "yes" : "no");
  sinew_haptic_destroy(haptic);
  sinew_world_destroy(world);
  return 0;
}
