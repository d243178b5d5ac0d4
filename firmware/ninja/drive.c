/* See drive.h. */
#include "ninja/drive.h"
#include "ninja/path.h"

static bool runs;
static bool planned;          /* waits of its path are left */
static uint16_t begun[AXES];  /* motor counts where the move began */

void drive_init(void)
{
    path_init();
    runs = false;
}

static void start(uint8_t mask)
{
    if (mask == 0) {
        return;
    }
    for (uint8_t axis = 0; axis < AXES; axis++) {
        begun[axis] = stepper_port_count(axis);
    }
    stepper_wait_t first;
    planned = path_next(&first);
    stepper_port_start(mask, &first);
    runs = true;
}

void drive_to(const int16_t target[AXES], uint32_t step_us)
{
    start(path_to(target, step_us));
}

void drive_by(uint8_t axis, int16_t steps, uint32_t step_us)
{
    start(path_by(axis, steps, step_us));
}

void drive_halt(void)
{
    stepper_port_halt();
}

bool drive_runs(void)
{
    return runs;
}

bool drive_poll(void)
{
    if (!runs) {
        return false;
    }
    if (!stepper_port_runs()) { /* at its end, or halted */
        for (uint8_t axis = 0; axis < AXES; axis++) {
            path_made(axis, (int16_t)(stepper_port_count(axis) - begun[axis]));
        }
        runs = false;
        return true;
    }
    stepper_wait_t wait;
    if (!planned || !stepper_port_room()) {
        return false;
    }
    planned = path_next(&wait); /* one at a time: what arrives meanwhile is attended to */
    if (planned) {
        stepper_port_put(&wait);
    }
    return true;
}
