/* sinew_last_error: the bytes it needs, what fits into a small buffer, and a message for every thread of its own. */
#include "check.h"

#include <pthread.h>

static void a_message_is_copied_as_far_as_it_fits(void)
{
    char whole[512], part[512];
    size_t needed, capacity, i;
    memset(whole, '#', sizeof whole);
    CHECK(sinew_world_create(NULL, NULL) == SINEW_STATUS_INVALID_ARGUMENT);
    needed = sinew_last_error(whole, sizeof whole);
    CHECK(needed > 1 && needed <= sizeof whole);
    if (needed < 2 || needed > sizeof whole)
        return;
    CHECK(strlen(whole) + 1 == needed);
    CHECK(whole[needed] == '#');

    CHECK(sinew_last_error(NULL, 0) == needed);
    CHECK(sinew_last_error(NULL, 10) == needed);
    memset(part, '#', sizeof part);
    CHECK(sinew_last_error(part, 0) == needed);
    CHECK(part[0] == '#');
    for (capacity = 1; capacity <= needed; capacity++) {
        memset(part, '#', sizeof part);
        CHECK(sinew_last_error(part, capacity) == needed);
        CHECK(strlen(part) == capacity - 1 && memcmp(part, whole, capacity - 1) == 0);
        for (i = capacity; i < sizeof part; i++)
            if (part[i] != '#')
                break;
        CHECK(i == sizeof part);
    }
}

/* Another thread's failure, and what it finds before: no failure of its own yet. */
static void *fails_otherwise(void *message)
{
    char before[512];
    sinew_last_error(before, sizeof before);
    CHECK(before[0] == '\0');
    CHECK(sinew_world_get_state_hash(NULL, NULL) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_last_error((char *)message, 512);
    return NULL;
}

static void every_thread_has_its_own(void)
{
    char before[512], after[512], other[512] = "";
    pthread_t thread;
    CHECK(sinew_world_create(NULL, NULL) == SINEW_STATUS_INVALID_ARGUMENT);
    sinew_last_error(before, sizeof before);
    if (pthread_create(&thread, NULL, fails_otherwise, other) != 0 || pthread_join(thread, NULL) != 0) {
        CHECK(!"a thread");
        return;
    }
    sinew_last_error(after, sizeof after);
    CHECK(strcmp(before, after) == 0);
    CHECK(other[0] != '\0' && strcmp(other, before) != 0);
}

int main(void)
{
    char nothing[8] = "#";
    CHECK(sinew_last_error(nothing, sizeof nothing) == 1);
    CHECK(nothing[0] == '\0');
    a_message_is_copied_as_far_as_it_fits();
    every_thread_has_its_own();
    return checked("messages are cut, measured and kept per thread");
}
