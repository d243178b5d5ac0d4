#include "host/fakes/head_fake.h"
#include <string.h>
#include "ninja/sensor_port.h"
#include "unity.h"

#define WAITS 7

head_event_t head_events[HEAD_EVENTS];
unsigned head_event_count;
uint64_t head_ticks;
int head_counts[AXES], head_edges[AXES], head_stuck[AXES];
unsigned head_moves, head_halts;

static stepper_wait_t waits[WAITS];
static unsigned waiting;
static uint8_t energised;
static bool runs, halted;

void head_fake_forget(void)
{
    head_event_count = head_moves = head_halts = 0;
}

void head_fake_reset(void)
{
    head_fake_forget();
    memset(head_counts, 0, sizeof head_counts);
    memset(head_edges, 0, sizeof head_edges);
    head_stuck[AXIS_X] = head_stuck[AXIS_Y] = -1;
    head_ticks = 0;
    waiting = 0;
    energised = 0;
    runs = halted = false;
}

static void note(bool step)
{
    if (head_event_count < HEAD_EVENTS)
        head_events[head_event_count] =
            (head_event_t){head_ticks, energised, step, {head_counts[AXIS_X], head_counts[AXIS_Y]}};
    head_event_count++;
}

void stepper_port_start(uint8_t axes, const stepper_wait_t *first)
{
    TEST_ASSERT_FALSE_MESSAGE(runs, "a move begins within another");
    TEST_ASSERT_NOT_EQUAL(0, axes);
    runs = true;
    halted = false;
    energised = axes;
    waits[0] = *first;
    waiting = 1;
    head_moves++;
    note(false);
}

bool stepper_port_room(void)
{
    return waiting < WAITS;
}

void stepper_port_put(const stepper_wait_t *wait)
{
    TEST_ASSERT_TRUE(stepper_port_room());
    TEST_ASSERT_TRUE(runs);
    TEST_ASSERT_TRUE(wait->ticks >= 2000 && wait->ticks <= 16000000);
    waits[waiting++] = *wait;
}

void stepper_port_halt(void)
{
    head_halts += runs && !halted;
    halted = true;
}

bool stepper_port_runs(void)
{
    return runs;
}

uint16_t stepper_port_count(uint8_t axis)
{
    TEST_ASSERT_FALSE(runs);
    return (uint16_t)head_counts[axis];
}

bool sensor_port_beyond(uint8_t axis)
{
    return head_stuck[axis] >= 0 ? head_stuck[axis] == 0 : head_counts[axis] >= head_edges[axis];
}

bool head_fake_play(void)
{
    if (!runs)
        return false;
    TEST_ASSERT_NOT_EQUAL_MESSAGE(0, waiting, "the planner is late");
    const uint8_t action = waits[0].action;
    head_ticks += waits[0].ticks;
    memmove(&waits[0], &waits[1], --waiting * sizeof waits[0]);
    if (halted || action == STEPPER_END) {
        runs = false;
        energised = 0;
        note(false);
        return true;
    }
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const uint8_t bits = (uint8_t)(action >> 2 * axis & 3);
        TEST_ASSERT_TRUE_MESSAGE(bits == 0 || (energised >> axis & 1), "a step of an axis without current");
        head_counts[axis] += bits == STEPPER_STEP ? 1 : bits == 0 ? 0 : -1;
    }
    note(true);
    return true;
}
