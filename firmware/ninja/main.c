/* The Ninja, a pan and tilt head: boot, then the polled loop. */
#include "base/atomic.h"
#include "base/timebase_port.h"
#include "base/wake.h"
#include "ninja/centre.h"
#include "ninja/commands.h"
#include "ninja/drive.h"
#include "ninja/pause.h"
#include "ninja/receive_port.h"
#include "ninja/sensor_port.h"
#include "ninja/stepper_port.h"
#include "ninja/watchdog_port.h"

int main(void)
{
    watchdog_port_init();
    sensor_port_init();
    stepper_port_init();
    drive_init();
    receive_port_init();
    timebase_start();
    commands_init();
    atomic_enable();

    for (;;) {
        /* Cleared before the polls: what an interrupt leaves to do meanwhile is seen in this round or the next. */
        wake_flag = 0;
        watchdog_port_alive();
        bool worked = drive_poll();
        /* After it: a halt character that has ended a move is attended to before anything else is begun. */
        int16_t byte;
        while ((byte = receive_port_get()) >= 0) {
            commands_receive((uint8_t)byte);
        }
        worked |= centre_poll();
        worked |= pause_poll();
        worked |= commands_poll();
        if (!worked) {
            wake_sleep();
        }
    }
}
