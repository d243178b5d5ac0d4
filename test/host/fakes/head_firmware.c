/* head_fake.h: the firmware above its ports. */
#include "host/fakes/head_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "ninja/centre.h"
#include "ninja/commands.h"
#include "ninja/drive.h"
#include "ninja/pause.h"

#define MOST_ROUNDS 200 /* an endless macro without a move */

void head_boot(void)
{
    head_fake_reset();
    timebase_fake_us = 0;
    timebase_fake_step_us = 0;
    drive_init();
    commands_init();
}

void head_settle(void)
{
    bool worked = true;
    for (unsigned round = 0; worked && round < MOST_ROUNDS; round++) {
        worked = drive_poll();
        worked |= centre_poll();
        worked |= commands_poll();
    }
}

void head_say(const char *bytes)
{
    for (; *bytes != '\0'; bytes++) {
        commands_receive((uint8_t)*bytes);
        head_settle();
    }
}

bool head_rest(unsigned most_waits)
{
    for (; most_waits != 0; most_waits--) {
        head_settle();
        if (head_fake_play())
            continue;
        if (pause_runs()) {
            timebase_fake_us += 100000;
            head_ticks += STEPPER_HZ / 10;
            pause_poll();
        } else if (!drive_runs() && !centre_runs() && !commands_poll()) {
            return true;
        }
    }
    return false;
}
