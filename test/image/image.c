#include "image.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LOOK (10 * US) /* how often a condition is looked at */
#define MOST_CHANGES 4096

board_t *board;
bus_t *image_bus;
train_t train;
change_t changes[MOST_CHANGES];
size_t change_count;

static uint8_t dir_level; /* pins cannot be asked for in the middle of an edge */
static bool tracing;
static uint16_t state_address;
static char text[65536]; /* what was printed since the last line was asked */
static char display[65536];

void image_fail(const char *format, ...)
{
    char message[1000];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    TEST_FAIL_MESSAGE(message);
    abort(); /* not reached */
}

/* -- the oscilloscope -------------------------------------------------------------------------------------------- */

static void least(uint64_t *least_so_far, uint64_t value)
{
    if (value < *least_so_far)
        *least_so_far = value;
}

void image_on_edge(void *ctx, board_edge_t edge)
{
    (void)ctx;
    if (edge.pin == DIR) {
        if (train.last_fall)
            least(&train.dir_hold_min, edge.cycle - train.last_fall);
        train.last_dir = edge.cycle;
        dir_level = edge.level;
    } else if (edge.pin == CLK && edge.level) {
        if (train.count)
            least(&train.interval_min, edge.cycle - train.last_rise);
        if (train.last_fall)
            least(&train.low_min, edge.cycle - train.last_fall);
        if (train.last_dir)
            least(&train.dir_setup_min, edge.cycle - train.last_dir);
        if (train.keep) {
            if (train.count == train.capacity) {
                train.capacity = train.capacity ? 2 * train.capacity : 4096;
                train.pulse = realloc(train.pulse, train.capacity * sizeof *train.pulse);
            }
            train.pulse[train.count] = (pulse_t){edge.cycle, dir_level};
        }
        train.count++;
        train.position += dir_level ? -1 : 1;
        train.last_rise = edge.cycle;
    } else if (edge.pin == CLK) {
        uint64_t high = edge.cycle - train.last_rise;
        least(&train.high_min, high);
        if (high > train.high_max)
            train.high_max = high;
        train.last_fall = edge.cycle;
    }
}

void image_train_clear(void)
{
    train.count = 0;
    train.keep = true;
    train.position = 0;
    train.interval_min = train.high_min = train.low_min = train.dir_setup_min = train.dir_hold_min = UINT64_MAX;
    train.high_max = 0;
    train.last_rise = train.last_fall = train.last_dir = 0;
}

uint64_t image_interval(size_t k)
{
    if (k + 1 >= train.count)
        image_fail("interval %zu asked for, %zu pulses seen", k, train.count);
    return train.pulse[k + 1].cycle - train.pulse[k].cycle;
}

void image_assert_pulses(size_t expected)
{
    if (train.count != expected)
        image_fail("expected %zu pulses, saw %zu, the last one at cycle %" PRIu64, expected, train.count,
                   train.last_rise);
}

void image_assert_interval(size_t k, double ticks, double tolerance)
{
    uint64_t seen = image_interval(k);
    if (!(fabs((double)seen - ticks) <= tolerance))
        image_fail("interval %zu: expected %.2f ticks within %.2f, saw %" PRIu64 ", from cycle %" PRIu64, k, ticks,
                   tolerance, seen, train.pulse[k].cycle);
}

void image_assert_intervals(size_t first, size_t count, double ticks, double tolerance)
{
    for (size_t k = first; k < first + count; k++)
        image_assert_interval(k, ticks, tolerance);
}

void image_assert_no_pulse_for(uint64_t cycles)
{
    size_t before = train.count;
    uint64_t from = board_cycle(board);
    image_run(cycles);
    if (train.count != before)
        image_fail("expected no pulse from cycle %" PRIu64 " on, saw %zu, the last one at cycle %" PRIu64, from,
                   train.count - before, train.last_rise);
}

void image_assert_near(const char *what, double expected, double value, double tolerance)
{
    if (!(fabs(value - expected) <= tolerance))
        image_fail("%s: expected %.4f within %.4f, saw %.4f (cycle %" PRIu64 ")", what, expected, tolerance, value,
                   board_cycle(board));
}

/* -- the state byte ---------------------------------------------------------------------------------------------- */

static bool note_state(board_t *b, void *ctx)
{
    (void)ctx;
    uint8_t state = board_peek8(b, state_address);
    if (change_count == 0 || changes[change_count - 1].state != state) {
        if (change_count < MOST_CHANGES)
            changes[change_count++] = (change_t){board_cycle(b), state};
    }
    return false;
}

void image_trace(bool on)
{
    tracing = on;
    change_count = 0;
    if (on)
        note_state(board, NULL);
}

void image_assert_states(const char *expected)
{
    static const char letters[] = "0ACDP";
    char seen[MOST_CHANGES + 1];
    for (size_t i = 0; i < change_count; i++)
        seen[i] = changes[i].state <= STOP ? letters[changes[i].state] : '?';
    seen[change_count] = '\0';
    if (strcmp(seen, expected) == 0)
        return;
    size_t i = 0;
    while (seen[i] != '\0' && seen[i] == expected[i])
        i++;
    image_fail("states (0 STANDBY, ACCEL, CRUISE, DECEL, stoP): expected %s, saw %s; they part at %zu, cycle %" PRIu64,
               expected, seen, i, i < change_count ? changes[i].cycle : board_cycle(board));
}

/* -- time -------------------------------------------------------------------------------------------------------- */

void image_run(uint64_t cycles)
{
    board_run_t how = image_bus ? bus_run_for(image_bus, cycles)
                      : tracing ? board_run_until(board, note_state, NULL, cycles)
                                : board_run_for(board, cycles);
    if (how == BOARD_CRASHED)
        image_fail("crashed at cycle %" PRIu64 ": %s", board_cycle(board), board_crash(board));
}

static bool still(void)
{
    /* The step interrupt is off, or the timer plays silence without it. */
    enum { TIMSK1 = 0x6F, TOIE1 = 1 };
    return (board_peek8(board, TIMSK1) & TOIE1) == 0 && board_peek8(board, state_address) == STANDBY;
}

bool image_idles(uint64_t most_cycles)
{
    uint64_t end = board_cycle(board) + most_cycles;
    unsigned looks = 0;
    while (looks < 10 * MS / LOOK) { /* for 10 ms: a command may be in planning */
        if (board_cycle(board) > end)
            return false;
        image_run(LOOK);
        looks = still() ? looks + 1 : 0;
    }
    return true;
}

void image_idle(uint64_t most_cycles)
{
    uint64_t end = board_cycle(board) + most_cycles;
    if (!image_idles(most_cycles))
        image_fail("expected the motor to stand by cycle %" PRIu64 ", it is in state %u after %zu pulses", end,
                   board_peek8(board, state_address), train.count);
}

void image_until_state(uint8_t state, uint64_t most_cycles)
{
    uint64_t end = board_cycle(board) + most_cycles;
    while (board_peek8(board, state_address) != state) {
        if (board_cycle(board) > end)
            image_fail("expected state %u by cycle %" PRIu64 ", it is %u after %zu pulses", state, end,
                       board_peek8(board, state_address), train.count);
        image_run(LOOK);
    }
}

void image_until_pulses(size_t count, uint64_t most_cycles)
{
    uint64_t end = board_cycle(board) + most_cycles;
    while (train.count < count) {
        if (board_cycle(board) > end)
            image_fail("expected %zu pulses by cycle %" PRIu64 ", saw %zu", count, end, train.count);
        image_run(LOOK);
    }
}

/* -- power ------------------------------------------------------------------------------------------------------- */

static uint16_t address_of(const char *symbol)
{
    uint16_t address = 0;
    if (!board_symbol(board, symbol, &address))
        image_fail("the image has no symbol %s", symbol);
    return address;
}

void image_load_settings(void)
{
    if (board_run_past(board, address_of("store_load_settings"), SECOND) != BOARD_MATCHED)
        image_fail("the settings were not loaded by cycle %" PRIu64, board_cycle(board));
}

void image_power_on(void)
{
    image_power_on_with(NULL);
}

void image_power_on_with(const uint8_t *eeprom)
{
    tracing = false;
    board = board_new(SAC_ELF, eeprom);
    TEST_ASSERT_NOT_NULL_MESSAGE(board, SAC_ELF);
    state_address = address_of("motion_state");
    board_record(board, CLK, true);
    board_record(board, DIR, true);
    board_on_edge(board, image_on_edge, NULL);
    dir_level = 0;
    image_train_clear();
    image_load_settings();
}

void image_boot_again(void)
{
    image_load_settings();
    image_take_text();
    image_prompt();
}

void image_poke_setting(size_t offset, size_t bytes, uint32_t value)
{
    uint16_t address = (uint16_t)(address_of("settings") + offset);
    for (size_t i = 0; i < bytes; i++)
        board_poke8(board, (uint16_t)(address + i), (uint8_t)(value >> (8 * i)));
}

uint8_t image_peek(const char *symbol)
{
    return board_peek8(board, address_of(symbol));
}

static bool ends_with(const char *whole, const char *end)
{
    size_t length = strlen(whole);
    size_t end_length = strlen(end);
    return length >= end_length && strcmp(whole + length - end_length, end) == 0;
}

void image_prompt(void)
{
    uint64_t end = board_cycle(board) + 2 * SECOND;
    while (!ends_with(board_uart_text(board), "SAC>")) {
        if (board_cycle(board) > end)
            image_fail("expected the prompt by cycle %" PRIu64 ", saw \"%s\"", end, board_uart_text(board));
        image_run(MS);
    }
    image_run(MS);
    board_uart_clear(board);
    dir_level = (uint8_t)board_pin_level(board, DIR);
    image_train_clear();
}

void image_boot(void)
{
    image_power_on();
    image_prompt();
}

void image_off(void)
{
    if (board)
        board_free(board);
    board = NULL;
    free(train.pulse);
    train.pulse = NULL;
    train.capacity = 0;
}

/* -- the user ---------------------------------------------------------------------------------------------------- */

void image_send(const char *line)
{
    board_uart_send_text(board, line);
}

void image_sent(void)
{
    while (board_uart_sending(board))
        image_run(LOOK);
    image_run(MS);
}

const char *image_take_text(void)
{
    snprintf(text, sizeof text, "%s", board_uart_text(board));
    board_uart_clear(board);
    return text;
}

const char *image_ask(const char *line)
{
    board_uart_clear(board);
    image_send(line);
    image_send("\r");
    uint64_t end = board_cycle(board) + 5 * SECOND;
    size_t echo = strlen(line);
    for (;;) {
        image_run(20 * LOOK);
        const char *seen = board_uart_text(board);
        if (!board_uart_sending(board) && strlen(seen) > echo && (ends_with(seen, "\nSAC>") || ends_with(seen, "\nQ>") || ends_with(seen, "\nX>")))
            break;
        if (board_cycle(board) > end)
            image_fail("\"%s\": expected a prompt by cycle %" PRIu64 ", saw \"%s\"", line, end, seen);
    }
    image_take_text();
    size_t length = strlen(text);
    if (strncmp(text, line, echo) != 0 || strncmp(text + echo, "\r\n", 2) != 0)
        image_fail("expected the echo \"%s\\r\\n\", saw \"%s\"", line, text);
    text[length] = '\0';
    *(strrchr(text, '\n') + 1) = '\0'; /* the prompt */
    return text + echo + 2;
}

void image_do(const char *line)
{
    const char *answer = image_ask(line);
    if (answer[0] != '\0')
        image_fail("\"%s\": expected no answer, saw \"%s\"", line, answer);
}

void image_refused(const char *line, const char *answer)
{
    char expected[200];
    snprintf(expected, sizeof expected, "%s\r\n", answer);
    const char *seen = image_ask(line);
    if (strcmp(seen, expected) != 0)
        image_fail("\"%s\": expected the answer \"%s\", saw \"%s\"", line, answer, seen);
}

const char *image_display(const char *line)
{
    snprintf(display, sizeof display, "%s", image_ask(line));
    return display;
}

const char *image_row(const char *shown, unsigned n)
{
    static char row[200];
    char begin[16];
    int length = snprintf(begin, sizeof begin, "%u\t", n);
    for (const char *line = shown; line != NULL; line = strchr(line, '\n')) {
        if (*line == '\n')
            line++;
        if (strncmp(line, begin, (size_t)length) == 0) {
            size_t end = strcspn(line, "\r\n");
            snprintf(row, sizeof row, "%.*s", (int)end, line);
            return row;
        }
    }
    image_fail("no row %u in \"%.300s\"", n, shown);
    return NULL;
}

void image_assert_row(unsigned n, const char *expected)
{
    const char *seen = image_row(image_display("q"), n);
    if (strcmp(seen, expected) != 0) {
        size_t i = 0;
        while (seen[i] != '\0' && seen[i] == expected[i])
            i++;
        image_fail("row %u: expected \"%s\", saw \"%s\"; they part at byte %zu", n, expected, seen, i);
    }
}

void image_assert_holds(const char *shown, const char *part)
{
    if (strstr(shown, part) == NULL)
        image_fail("expected \"%s\" in \"%.400s\"", part, shown);
}

int32_t image_position_and_faults(unsigned *faults)
{
    int32_t position = 0;
    char state[16] = "";
    const char *shown = image_ask("p");
    if (sscanf(shown, "position %" SCNd32 " %15s faults %u", &position, state, faults) != 3)
        image_fail("p: expected position, state and faults, saw \"%s\"", shown);
    if (strcmp(state, "STANDBY") != 0)
        image_fail("p: expected STANDBY, saw \"%s\"", shown);
    return position;
}

int32_t image_position(void)
{
    unsigned faults = 99;
    int32_t position = image_position_and_faults(&faults);
    if (faults != 0)
        image_fail("p: expected faults 0, saw %u", faults);
    return position;
}
