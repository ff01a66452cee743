// sinew.hpp without exceptions: errors go to the program's handler.
#include <cstdio>
#include <cstdlib>
#include <cstring>

[[noreturn]] static void give_up(int status, const char *message) {
  const bool as_expected = status == 1 && std::strstr(message, "dt") != nullptr;
  std::printf("%d: %s\n", status, message);
  std::exit(as_expected ? 0 : 1);
}
#define SINEW_ON_ERROR(status, message) give_up(status, message)
#include <sinew.hpp>

int main() {
  static_assert(SINEW_STATUS_INVALID_ARGUMENT == 1, "as above");
  sinew::world world;
  world.step(0.01f);
  world.step(-1);
  return 1;
}
