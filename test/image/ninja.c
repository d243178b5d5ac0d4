/* See ninja.h. */
#include "ninja.h"

#include <inttypes.h>
#include <stdlib.h>

#define COILS 4
enum { DDRD = 0x2A, UCSR0B = 0xC1, TXEN0 = 1 << 3 };
#define TXD BOARD_PIN('D', 1)
#define REST (350 * MS)

head_t *ninja_head;
const char *const ninja_names[] = {"on", "off", "up", "down"};

static struct {
    ninja_event_t *event;
    size_t count, capacity;
} seen;

static struct {
    uint8_t coils;    /* as they are */
    uint8_t reported; /* as they were when the last event was noted */
    int n;            /* steps since power-up */
} motors[AXES];
static uint64_t edge_cycle; /* of the last edge; what lies between the edges of one cycle is no pattern */
static bool driven;         /* the transmitter's pin has been seen low after it was high */
static char wrong[200];     /* what was noted in the middle of an edge, where no test can fail */

/* -- the oscilloscope ---------------------------------------------------------------------------------------------- */

static void note(uint64_t cycle, uint8_t axis, ninja_what_t what)
{
    if (seen.count == seen.capacity) {
        seen.capacity = seen.capacity ? 2 * seen.capacity : 4096;
        seen.event = realloc(seen.event, seen.capacity * sizeof *seen.event);
    }
    seen.event[seen.count++] = (ninja_event_t){cycle, axis, what};
}

/* The coils that are on at a motor count. */
static uint8_t pattern(int n)
{
    static const uint8_t patterns[] = {0x3, 0x6, 0xC, 0x9}; /* A+B, B+C, C+D, D+A */
    return patterns[n & 3];
}

/* What the edges of the last cycle have come to. */
static void settle(void)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const uint8_t before = motors[axis].reported;
        const uint8_t now = motors[axis].coils;
        if (now == before)
            continue;
        motors[axis].reported = now;
        if (now == 0) {
            note(edge_cycle, axis, NINJA_OFF);
        } else if (before == 0 && now == pattern(motors[axis].n)) {
            note(edge_cycle, axis, NINJA_ON);
        } else if (before != 0 && now == pattern(motors[axis].n + 1)) {
            motors[axis].n++;
            note(edge_cycle, axis, NINJA_UP);
        } else if (before != 0 && now == pattern(motors[axis].n - 1)) {
            motors[axis].n--;
            note(edge_cycle, axis, NINJA_DOWN);
        } else if (wrong[0] == '\0') {
            snprintf(wrong, sizeof wrong, "%c: coils 0x%X after 0x%X, motor count %d, at cycle %" PRIu64, "XY"[axis],
                     now, before, motors[axis].n, edge_cycle);
        }
    }
}

static void on_edge(void *ctx, board_edge_t edge)
{
    (void)ctx;
    if (edge.pin == TXD) {
        driven |= !edge.level;
        return;
    }
    if (edge.cycle != edge_cycle)
        settle();
    edge_cycle = edge.cycle;
    const uint8_t axis = edge.pin >= BOARD_PIN('D', 0) ? AXIS_X : AXIS_Y;
    const int coil = edge.pin - (axis == AXIS_X ? BOARD_PIN('D', 4) : BOARD_PIN('C', 0));
    const uint8_t bit = (uint8_t)(1 << coil);
    motors[axis].coils = (uint8_t)(edge.level ? motors[axis].coils | bit : motors[axis].coils & ~bit);
}

const ninja_event_t *ninja_events(size_t *count)
{
    settle();
    if (wrong[0] != '\0')
        image_fail("%s", wrong);
    *count = seen.count;
    return seen.event;
}

void ninja_forget(void)
{
    size_t count;
    ninja_events(&count);
    seen.count = 0;
}

size_t ninja_count(uint8_t axis, ninja_what_t what)
{
    size_t count;
    size_t found = 0;
    const ninja_event_t *event = ninja_events(&count);
    for (size_t i = 0; i < count; i++)
        found += event[i].axis == axis && event[i].what == what;
    return found;
}

uint64_t ninja_cycle(uint8_t axis, ninja_what_t what, size_t which)
{
    size_t count;
    const ninja_event_t *event = ninja_events(&count);
    size_t found = 0;
    for (size_t i = 0; i < count; i++)
        if (event[i].axis == axis && event[i].what == what && found++ == which)
            return event[i].cycle;
    image_fail("%c %s: number %zu asked for, %zu seen", "XY"[axis], ninja_names[what], which, found);
    return 0;
}

uint64_t ninja_last(uint8_t axis, ninja_what_t what)
{
    return ninja_cycle(axis, what, ninja_count(axis, what) - 1);
}

void ninja_await(uint8_t axis, ninja_what_t what, size_t count, uint64_t most)
{
    for (const uint64_t end = board_cycle(board) + most; ninja_count(axis, what) < count; image_run(MS))
        if (board_cycle(board) > end)
            image_fail("%c %s: expected %zu by cycle %" PRIu64 ", saw %zu", "XY"[axis], ninja_names[what], count, end,
                       ninja_count(axis, what));
}

int ninja_made(uint8_t axis)
{
    return (int)ninja_count(axis, NINJA_UP) - (int)ninja_count(axis, NINJA_DOWN);
}

/* -- power --------------------------------------------------------------------------------------------------------- */

void ninja_power_on(const head_options_t *options)
{
    image_train_clear();
    board = board_new(NINJA_ELF, NULL);
    TEST_ASSERT_NOT_NULL_MESSAGE(board, NINJA_ELF);
    board_uart_baud(board, NINJA_BAUD);
    ninja_head = head_new(board, options);
    for (uint8_t axis = 0; axis < AXES; axis++) {
        motors[axis].coils = motors[axis].reported = 0;
        motors[axis].n = 0;
        for (uint8_t coil = 0; coil < COILS; coil++)
            board_record(board, axis == AXIS_X ? BOARD_PIN('D', 4 + coil) : BOARD_PIN('C', coil), true);
    }
    board_record(board, TXD, true);
    driven = false;
    wrong[0] = '\0';
    seen.count = 0;
    board_on_edge(board, on_edge, NULL);
}

void ninja_home(void)
{
    ninja_power_on(&head_defaults);
    ninja_rest(10 * SECOND);
    ninja_assert_at(0, 0);
    ninja_forget();
}

void ninja_reset(void)
{
    const bool before = driven;
    board_reset(board, BOARD_RESET_EXTERNAL);
    ninja_forget();
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const head_axis_t which = axis == AXIS_X ? HEAD_X : HEAD_Y;
        const head_state_t *state = head_state(ninja_head, which);
        head_place(ninja_head, which, state->platform, state->slack);
        motors[axis].n = 0;
    }
    image_run(MS);
    driven = before; /* the pull-up was off */
}

void ninja_off(void)
{
    if (board == NULL)
        return;
    size_t bytes;
    board_uart_received(board, &bytes);
    driven |= (board_peek8(board, DDRD) & 1 << 1) != 0 || (board_peek8(board, UCSR0B) & TXEN0) != 0;
    settle();
    head_free(ninja_head);
    ninja_head = NULL;
    image_off();
    free(seen.event);
    seen.event = NULL;
    seen.count = seen.capacity = 0;
    TEST_ASSERT_EQUAL_MESSAGE(0, bytes, "bytes were transmitted");
    TEST_ASSERT_FALSE_MESSAGE(driven, "the transmitter's pin was driven");
    TEST_ASSERT_EQUAL_STRING_MESSAGE("", wrong, "coils");
}

/* -- typing -------------------------------------------------------------------------------------------------------- */

uint64_t ninja_send(uint8_t byte)
{
    board_uart_send(board, &byte, 1);
    return board_uart_last_sent(board);
}

void ninja_type(const char *text)
{
    image_send(text);
    image_sent();
    image_run(2 * MS);
}

/* -- the head ------------------------------------------------------------------------------------------------------ */

bool ninja_current(void)
{
    return (motors[AXIS_X].coils | motors[AXIS_Y].coils) != 0;
}

void ninja_rest(uint64_t most)
{
    const uint64_t end = board_cycle(board) + most;
    for (uint64_t still = 0; still < REST; still = ninja_current() ? 0 : still + MS) {
        if (board_cycle(board) > end)
            image_fail("expected the head to rest by cycle %" PRIu64, end);
        image_run(MS);
    }
}

int ninja_platform(uint8_t axis)
{
    const head_state_t *state = head_state(ninja_head, axis == AXIS_X ? HEAD_X : HEAD_Y);
    if (state->lost_steps != 0 || state->wrong_patterns != 0)
        image_fail("%c: %" PRIu64 " steps lost, %" PRIu64 " wrong patterns", "XY"[axis], state->lost_steps,
                   state->wrong_patterns);
    return state->platform;
}

void ninja_assert_at(int x, int y)
{
    const int seen_x = ninja_platform(AXIS_X);
    const int seen_y = ninja_platform(AXIS_Y);
    if (seen_x != x || seen_y != y)
        image_fail("expected the platform at %d,%d, saw %d,%d", x, y, seen_x, seen_y);
}
