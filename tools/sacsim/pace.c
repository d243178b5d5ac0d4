#include "pace.h"

#include <time.h>

#include "test/board/board.h"

#define CYCLES_PER_MS (BOARD_CPU_HZ / 1000)
#define NS_PER_MS INT64_C(1000000)
#define NS_PER_CYCLE 62.5

enum {
    SLICE_MS = 4,        /* how long a key may wait for the board */
    CATCH_UP_MS = 20,    /* longest slice, while behind */
    GIVE_UP_MS = 250,    /* further behind than this is not caught up */
    SUSPENDED_MS = 2000, /* this much at once: the process was stopped, the host is not slow */
    WINDOW_MS = 5000,
    WARN_LOST_MS = 750, /* of a window */
};

int64_t pace_now_ns(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 * NS_PER_MS + t.tv_nsec;
}

static int64_t due_ns(const pace_t *p, uint64_t cycle)
{
    return p->base_ns + (int64_t)((double)(cycle - p->base_cycle) * NS_PER_CYCLE / p->speed);
}

void pace_start(pace_t *p, double speed, uint64_t cycle)
{
    int64_t now = pace_now_ns();

    *p = (pace_t){.speed = speed, .base_cycle = cycle, .base_ns = now, .window_ns = now, .window_cycle = cycle};
}

uint64_t pace_target(const pace_t *p, uint64_t cycle)
{
    int64_t slice_ms = SLICE_MS;

    if (p->speed != PACE_FAST) {
        int64_t behind_ms = (pace_now_ns() - due_ns(p, cycle)) / NS_PER_MS;

        if (behind_ms > slice_ms) {
            slice_ms = behind_ms < CATCH_UP_MS ? behind_ms : CATCH_UP_MS;
        }
    }
    return cycle + (uint64_t)((double)slice_ms * CYCLES_PER_MS * (p->speed != PACE_FAST ? p->speed : 1.0));
}

/* Behind by so much that it is given up: time goes on from here. */
static void give_up(pace_t *p, uint64_t cycle, int64_t now, int64_t behind)
{
    p->base_cycle = cycle;
    p->base_ns = now;
    if (behind < SUSPENDED_MS * NS_PER_MS) {
        p->lost_ns += behind;
    }
}

double pace_wait(pace_t *p, uint64_t cycle)
{
    int64_t now, due;
    double speed = 0.0;

    if (p->speed == PACE_FAST) {
        return 0.0;
    }
    now = pace_now_ns();
    due = due_ns(p, cycle);
    if (now - due > GIVE_UP_MS * NS_PER_MS) {
        give_up(p, cycle, now, now - due);
    } else if (due > now) {
        struct timespec until = {.tv_sec = due / (1000 * NS_PER_MS), .tv_nsec = due % (1000 * NS_PER_MS)};

        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
    }
    if (now - p->window_ns > WINDOW_MS * NS_PER_MS) {
        if (p->lost_ns > WARN_LOST_MS * NS_PER_MS && !p->warned) {
            speed = (double)(cycle - p->window_cycle) * NS_PER_CYCLE / (double)(now - p->window_ns);
            p->warned = true;
        }
        p->window_ns = now;
        p->window_cycle = cycle;
        p->lost_ns = 0;
    }
    return speed;
}
