/* The terminal, from bytes to queue entries, under lines of all kinds: typed byte by byte, in chunks, with the output
 * stalled, in floods. After each line:
 *   - the prompt is back, and what stands on the screen is what was executed
 *   - every value of settings, session and queue lies in its range
 *   - a line that was refused has changed nothing, its error is one of the table, and there is only one
 *   - a line that was taken has changed only what such a command may change; motion commands exactly what was typed
 *   - a pulse was asked for only by + or -, the engine only by a motion command that was taken
 *   - a line with an address is sent, and answered by nobody; with the unit's own it is executed here
 *   - a line that waits for what is being stored is executed when that is written
 *   - the settings as they are stored are those that were typed, the snapshot of the queue is the queue
 *
 * SAC_FUZZ_LINES in the environment sets how many lines, SAC_FUZZ_SEED where they begin: each block of lines starts from a
 * fresh firmware with the next seed, so a failure is repeated by the seed that it prints. */
#include <inttypes.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "base/status.h"
#include "cli/commands.h"
#include "cli/network.h"
#include "cli/terminal.h"
#include "cli/terminal_port.h"
#include "eeprom/store.h"
#include "fuzz/grammar.h"
#include "fuzz/reference.h"
#include "host/fakes/bus_port_fake.h"
#include "host/fakes/eeprom_port_fake.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "queue/encoder.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "settings.h"
#include "unity.h"

enum { BLOCK_LINES = 1000, DEFAULT_LINES = 200000, FLOOD_LINES = 12, MOST_ROUNDS = 100000, HANG_SECONDS = 120, WAITING_ROUNDS = 1000 };

/* -- where we are, for whoever reads the failure ---------------------------------------------------------------------- */

static struct {
    uint64_t seed; /* of the block */
    unsigned line; /* in the block */
    uint8_t bytes[FLOOD_LINES * FUZZ_LINE_BYTES];
    unsigned length;
    unsigned taken; /* how many of these have been typed */
} here;

static void tell(const char *what, const char *more)
{
    const unsigned shown = here.taken > FUZZ_LINE_BYTES ? here.taken - FUZZ_LINE_BYTES : 0;
    printf("FUZZ: %s%s\n  line %u of the block, at byte %u of %u: \"%s\"", what, more, here.line, here.taken,
           here.length, fuzz_printable(here.bytes + shown, here.taken - shown));
    printf(" | \"%s\"\n", fuzz_printable(here.bytes + here.taken, here.length - here.taken));
    printf("  the last answer: \"%.2000s\"\n", terminal_port_fake_text());
    printf("  again: SAC_FUZZ_SEED=%" PRIu64 " SAC_FUZZ_LINES=%u\n", here.seed, here.line);
    fflush(stdout);
}

static void fail(const char *what, const char *more)
{
    static char message[100];
    tell(what, more);
    snprintf(message, sizeof message, "%.60s (SAC_FUZZ_SEED=%" PRIu64 ")", what, here.seed);
    TEST_FAIL_MESSAGE(message);
}

static void require(bool holds, const char *what)
{
    if (!holds) {
        fail(what, "");
    }
}

/* An assertion of a fake, or no end of a loop in the firmware. */
static void on_signal(int number)
{
    tell(number == SIGALRM ? "no end" : "aborted", "");
    _exit(1);
}

#ifdef __SANITIZE_ADDRESS__
void __sanitizer_set_death_callback(void (*callback)(void));

static void on_death(void)
{
    tell("the sanitizer's report stands above", "");
}
#endif

void setUp(void) {}

void tearDown(void) {}

/* -- the ranges: one place for all of them ----------------------------------------------------------------------------- */

static bool is_ramp(accel_code_t code)
{
    return code >= 1 && code <= ACCEL_NONE;
}

/* Settings that were stored and came into force by $R may make impossible what was in RAM before: the queue, and with an
 * unfit cycle the session. */
static bool settings_changed;

static bool is_possible_now(uint32_t velocity, uint8_t flags)
{
    const motion_command_t command = {.count = 1, .velocity = velocity, .flags = flags};
    return engine_check(&command) == STATUS_OK;
}

static bool is_possible(uint32_t velocity, uint8_t flags)
{
    if (velocity == 0 || is_possible_now(velocity, flags)) {
        return velocity > 0;
    }
    return settings_changed; /* x, loops and the array refuse it then */
}

static void check_ranges(void)
{
    require(settings.cycle_us >= 1 && settings.hw_baud >= 300 && settings.hw_baud <= 2000000 &&
                settings.steps_per_rev >= 1 && settings.ramp <= 1 && settings.cw_level <= 1 &&
                settings.direction <= 1 && settings.ustep <= 7 && settings.pulse_us >= 1 && settings.slow_rpm >= 1 &&
                settings.full_step <= 1 && is_ramp(settings.accel[0]) && is_ramp(settings.accel[1]) &&
                is_ramp(settings.decel[0]) && is_ramp(settings.decel[1]),
            "a setting is out of its range");
    require((session.flags & ~SESSION_FLAGS) == 0 && session.options <= 7 && is_ramp(session.accel) && is_ramp(session.decel) &&
                is_possible(session.velocity, session.flags),
            "a session value is out of its range");
    require(queue_next_position() >= QUEUE_FIRST && queue_next_position() <= QUEUE_LAST &&
                queue_pending() <= QUEUE_LAST && queue_executing_position() <= QUEUE_ONE_SHOT,
            "a position of the queue is out of its range");
    const uint8_t flags = MOTION_CCW | MOTION_PULSES | MOTION_LINEAR | MOTION_SYNC | MOTION_CYCLE;
    for (uint8_t i = 0; i < QUEUE_POSITIONS; i++) {
        const motion_command_t *entry = queue_entry(i);
        require((entry->flags & ~flags) == 0 &&
                    (entry->count >= 1 || i == QUEUE_CONTINUOUS) &&
                    is_ramp(entry->accel) && is_ramp(entry->decel) && is_possible(entry->velocity, entry->flags),
                "an entry of the queue is out of its range");
    }
    for (uint8_t i = 0; i < QUEUE_ARRAY; i++) {
        require(queue_array(i) <= QUEUE_LAST, "an entry of the array is out of its range");
    }
}

/* -- everything that a line may change --------------------------------------------------------------------------------- */

typedef struct {
    settings_t settings;
    session_t session;
    motion_command_t entries[QUEUE_POSITIONS];
    uint8_t next, pending, executing;
    uint8_t array[QUEUE_ARRAY];
    int offered; /* position, -1 none */
    bool debugging, gap, throttle, idle;
    unsigned submitted, stops, graceful, nexts, releases, restarts, pulses_cw, pulses_ccw;
    uint8_t stored[sizeof(settings_t)], snapshot[STORE_QUEUE_BYTES]; /* where idle */
    uint8_t snapshot_mark;
    const char *prompt;
} look_t;

enum { SNAPSHOT = 200 }; /* its mark, then its entries */

static look_t before, after;

static void look(look_t *all)
{
    all->settings = settings;
    all->session = session;
    for (uint8_t i = 0; i < QUEUE_POSITIONS; i++) {
        all->entries[i] = *queue_entry(i);
    }
    all->next = queue_next_position();
    all->pending = queue_pending();
    all->executing = queue_executing_position();
    all->debugging = commands_debugging();
    all->gap = engine_fake.gap;
    for (uint8_t i = 0; i < QUEUE_ARRAY; i++) {
        all->array[i] = queue_array(i);
    }
    all->offered = engine_fake.offered == NULL ? -1 : (int)(engine_fake.offered - queue_entry(0));
    all->throttle = encoder_throttles();
    all->idle = !store_busy();
    if (all->idle) {
        for (uint8_t i = 0; i < sizeof all->stored; i++) {
            all->stored[i] = store_setting(i);
        }
        memcpy(all->snapshot, &eeprom_fake.cells[SNAPSHOT + 1], sizeof all->snapshot);
        all->snapshot_mark = eeprom_fake.cells[SNAPSHOT];
    }
    all->releases = engine_fake.releases;
    all->restarts = engine_fake.restarts;
    all->prompt = commands_prompt();
    all->submitted = engine_fake.submitted_count;
    all->stops = engine_fake.stops;
    all->graceful = engine_fake.stops_graceful;
    all->nexts = engine_fake.nexts + engine_fake.nexts_graceful;
    all->pulses_cw = engine_fake.pulses_cw;
    all->pulses_ccw = engine_fake.pulses_ccw;
}

/* What a command may change. */
enum {
    SESSION = 1 << 0,
    ENTRIES = 1 << 1,
    PENDING = 1 << 2, /* and the next position, and what the engine is given */
    STOPS = 1 << 3,
    NEXTS = 1 << 4,
    DEBUG = 1 << 5,
    GAP = 1 << 6,
    SETTINGS = 1 << 7,
    STORED = 1 << 8,
    SNAP = 1 << 9,
    ARRAY = 1 << 10,
    OFFERED = 1 << 11, /* what comes next */
    BEGINS = 1 << 12,  /* and it may begin */
    RELEASES = 1 << 13,
    RESTARTS = 1 << 14,
    MODE = 1 << 15,
    THROTTLE = 1 << 16,
    ENDS = PENDING | STOPS | OFFERED,
};

static fuzz_mode_t mode; /* what lines are read as */

static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c | 0x20) : c;
}

static bool is_end(char c)
{
    return c == '\0' || c == ' ';
}

static unsigned may_change(const char *text)
{
    const char first = lower(text[0]), second = is_end(text[0]) ? '\0' : lower(text[1]);
    const bool alone = is_end(second);
    if (mode != MODE_COMMANDS) {
        if (alone && first == 'x') {
            return MODE;
        }
        if (alone && first == 's') {
            return ENDS;
        }
        return mode == MODE_QUEUE ? ENTRIES : mode == MODE_ARRAY ? ARRAY | OFFERED : STORED;
    }
    switch (first) {
    case 'm': return SESSION | ENTRIES | PENDING | OFFERED | BEGINS | NEXTS;
    case 'v':
    case 'a':
    case 'd': return SESSION | ENTRIES | OFFERED | BEGINS | NEXTS; /* continuous motion follows */
    case 's': return ENDS;
    case 'n': return NEXTS | OFFERED | BEGINS | PENDING;
    case 'g': return GAP;
    case 'b': return DEBUG;
    case 'q':
        switch (second) {
        case 'p': return MODE;
        case 's': return SNAP;
        default: return alone ? 0 : ENTRIES;
        }
    case 'z': return ENTRIES | PENDING | OFFERED;
    case 'l': return second == 'n' ? 0 : OFFERED | BEGINS | NEXTS | (alone ? PENDING : 0u);
    case 'x':
        switch (second) {
        case 'm': return ENTRIES | OFFERED | BEGINS | NEXTS;
        case 'p': return MODE;
        case 'd': return 0;
        default: return alone ? 0 : OFFERED | BEGINS | NEXTS;
        }
    case 'y': return RELEASES;
    case '$':
        switch (text[1]) {
        case 'c':
        case 'C': return ENDS | (is_end(text[2]) ? MODE : STORED);
        case 'L':
        case 'F':
        case 'P':
        case 'U':
        case 'H':
        case 'K':
        case 'O': return ENDS | SESSION;
        case 'n': return ENDS | THROTTLE;
        case 'R': return ENDS | SESSION | SETTINGS | RESTARTS | DEBUG; /* as boot_restart() leaves them */
        default: return ENDS;
        }
    default: return 0; /* displays, blank lines */
    }
}

/* A member of look_t; its name says what is wrong. */
#define REQUIRE_SAME(member)                                                    \
    do {                                                                        \
        if (memcmp(&before.member, &after.member, sizeof before.member) != 0) { \
            fail(what, #member);                                                \
        }                                                                       \
    } while (0)

static void check_changes(unsigned allowed, const char *what)
{
    if (!(allowed & SETTINGS)) {
        REQUIRE_SAME(settings);
    }
    if (!(allowed & SESSION)) {
        REQUIRE_SAME(session);
    }
    if (!(allowed & ENTRIES)) {
        REQUIRE_SAME(entries);
    }
    if (!(allowed & PENDING)) {
        REQUIRE_SAME(next);
        REQUIRE_SAME(pending);
    }
    if (!(allowed & OFFERED)) {
        REQUIRE_SAME(offered);
    }
    if (!(allowed & BEGINS)) {
        REQUIRE_SAME(submitted);
    }
    if (!(allowed & ARRAY)) {
        REQUIRE_SAME(array);
    }
    if (!(allowed & RELEASES)) {
        REQUIRE_SAME(releases);
    }
    if (!(allowed & RESTARTS)) {
        REQUIRE_SAME(restarts);
    }
    if (!(allowed & MODE)) {
        REQUIRE_SAME(prompt);
    }
    if (!(allowed & THROTTLE)) {
        REQUIRE_SAME(throttle);
    }
    if (before.idle && after.idle && !(allowed & STORED)) {
        REQUIRE_SAME(stored);
    }
    if (before.idle && after.idle && !(allowed & SNAP)) {
        REQUIRE_SAME(snapshot);
        REQUIRE_SAME(snapshot_mark);
    }
    if (!(allowed & STOPS)) {
        REQUIRE_SAME(stops);
        REQUIRE_SAME(graceful);
    }
    if (!(allowed & NEXTS)) {
        REQUIRE_SAME(nexts);
    }
    if (!(allowed & DEBUG)) {
        REQUIRE_SAME(debugging);
    }
    if (!(allowed & GAP)) {
        REQUIRE_SAME(gap);
    }
    REQUIRE_SAME(pulses_cw);
    REQUIRE_SAME(pulses_ccw);
}

/* -- the machine: terminal, queue, store, and an engine that begins a command when the one before it has ended ---------- */

static fuzz_t fuzz;
static editor_t editor;
static unsigned ends_seen, restarts_seen;
static bool engine_busy; /* it ends nothing for the present */
static uint64_t lines_waited;
static bool store_rests; /* nothing is written for the present */
static unsigned pulses_cw, pulses_ccw;

static bool in_engine(void)
{
    return engine_fake.begun != engine_fake.ended;
}

/* What was asked to end has ended. */
static bool end_what_was_asked(void)
{
    const unsigned ends = engine_fake.stops_graceful + engine_fake.nexts + engine_fake.nexts_graceful;
    const bool news = ends != ends_seen;
    if (news) {
        ends_seen = ends;
        engine_fake.ended = engine_fake.begun;
    }
    engine_fake.accepts = !in_engine();
    return news;
}

static bool poll_once(void)
{
    bool worked = end_what_was_asked();
    worked |= terminal_poll();
    if (restarts_seen != engine_fake.restarts) {
        restarts_seen = engine_fake.restarts;
        settings_changed = true;
        commands_init(); /* as boot_restart() does */
    }
    worked |= network_poll();
    worked |= end_what_was_asked();
    worked |= encoder_poll();
    worked |= queue_poll();
    worked |= end_what_was_asked();
    for (unsigned i = 0; i < 32 && !store_rests && store_poll(); i++) {
        worked = true;
    }
    return worked;
}

/* In these rounds the bus becomes free, and the answer of another node is given up. */
enum { ROUND_US = 2000, SILENCE_ROUNDS = 2, NO_ANSWER_ROUNDS = 60 };

/* Until all has been said and done. */
static void rest(void)
{
    unsigned rounds = 0;
    const uint8_t places = 31;
    unsigned quiet = SILENCE_ROUNDS; /* so many more with nothing to do */
    static unsigned begins;
    terminal_port_fake_drain(places);
    while (poll_once() || terminal_port_free() < places || quiet-- > 0) {
        terminal_port_fake_drain(places);
        timebase_fake_us += ROUND_US;
        if (begins != bus_port_fake.begins) {
            begins = bus_port_fake.begins;
            quiet = NO_ANSWER_ROUNDS;
        }
        if (++rounds > WAITING_ROUNDS && store_rests && store_busy()) {
            store_rests = false; /* a line waits for it */
            lines_waited++;
        }
        require(rounds < MOST_ROUNDS, "no rest after so many rounds of the main loop");
    }
    require(terminal_port_fake_untaken() == 0, "a byte was left behind");
}

/* Some rounds while the port sends a little, or nothing. */
static void work_a_little(void)
{
    for (uint32_t rounds = fuzz_below(&fuzz, 4); rounds > 0; rounds--) {
        (void)poll_once();
        terminal_port_fake_drain(fuzz_chance(&fuzz, 50) ? 0 : fuzz_below(&fuzz, 32));
    }
}

static uint32_t magnitude(void)
{
    return fuzz_u32(&fuzz) >> fuzz_below(&fuzz, 32);
}

static settings_t stored;    /* what is typed into them */
static bool snapshot_broken; /* by the test */

/* The motor goes on between two lines. */
static void let_time_pass(void)
{
    if (fuzz_chance(&fuzz, 2)) {
        engine_busy = fuzz_chance(&fuzz, 50);
        fuzz.motions = engine_busy ? 96 : 40; /* the queue fills */
    }
    while (!engine_busy && in_engine() && fuzz_chance(&fuzz, 70)) {
        engine_fake.ended = engine_fake.begun;
        rest();
    }
    if (fuzz_chance(&fuzz, engine_fake.estop ? 20 : 1)) {
        engine_fake.estop = !engine_fake.estop;
        if (engine_fake.estop) {
            queue_stop(); /* as main() does */
        }
    }
    if (fuzz_chance(&fuzz, 10)) {
        store_rests = fuzz_chance(&fuzz, 30);
        eeprom_fake.slow = fuzz_below(&fuzz, 4);
        rest();
    }
    if (!snapshot_broken && !store_busy() && eeprom_fake.cells[SNAPSHOT] == 1 && fuzz_chance(&fuzz, 1)) {
        eeprom_fake.cells[SNAPSHOT + 1 + fuzz_below(&fuzz, STORE_QUEUE_BYTES)] ^= (uint8_t)(1u << fuzz_below(&fuzz, 8));
        snapshot_broken = true;
    }
    engine_fake.state = (motion_state_t)fuzz_below(&fuzz, 5);
    engine_fake.position = (int32_t)(fuzz_chance(&fuzz, 50) ? magnitude() : 0u - magnitude());
    engine_fake.rpm = magnitude();
    engine_fake.cycle_us = magnitude();
    engine_fake.faults = (uint8_t)fuzz_below(&fuzz, 4);
    timebase_fake_step_us = magnitude();
}

static void choose_settings(void)
{
    static settings_t factory;
    static bool known;
    if (!known) {
        factory = settings;
        known = true;
    }
    settings = factory;
    if (fuzz_chance(&fuzz, 50)) {
        return;
    }
    for (unsigned i = 0; i < 2; i++) {
        settings.accel[i] = (accel_code_t)(1 + fuzz_below(&fuzz, ACCEL_NONE));
        settings.decel[i] = (accel_code_t)(1 + fuzz_below(&fuzz, ACCEL_NONE));
    }
    settings.steps_per_rev = fuzz_chance(&fuzz, 50) ? 200 : (uint16_t)(1 + fuzz_below(&fuzz, 1000));
    settings.ramp = (uint8_t)fuzz_below(&fuzz, 2);
    settings.direction = (uint8_t)fuzz_below(&fuzz, 2);
    settings.full_step = (uint8_t)fuzz_below(&fuzz, 2);
    settings.ustep = (uint8_t)fuzz_below(&fuzz, 8);
    settings.pulse_us = (uint8_t)(1 + fuzz_below(&fuzz, fuzz_chance(&fuzz, 50) ? 3 : 255));
    settings.cycle_us = (((uint32_t)settings.pulse_us + 1) << settings.ustep) + magnitude();
}

static struct {
    uint8_t position; /* 0: nothing to be taken back */
    bool added, executing, known;
    motion_command_t entry;
} undo;

static void power_on(uint64_t seed)
{
    fuzz_begin(&fuzz, seed);
    choose_settings();
    terminal_port_fake_reset();
    engine_fake_reset();
    ends_seen = restarts_seen = pulses_cw = pulses_ccw = 0;
    engine_busy = store_rests = snapshot_broken = settings_changed = false;
    undo.position = 0;
    undo.known = true;
    mode = MODE_COMMANDS;
    const settings_t chosen = settings;
    eeprom_fake_reset();
    (void)store_load_settings();
    stored = settings;
    settings = chosen;
    bus_port_fake_reset();
    commands_init();
    queue_init();
    terminal_init(STATUS_OK);
    network_init();
    terminal_port_fake_type_byte(0); /* the line end before, if any, is forgotten */
    memset(&editor, 0, sizeof editor);
    rest();
}

/* -- what is said ------------------------------------------------------------------------------------------------------ */

static const struct {
    unsigned number;
    const char *words;
} errors[] = {
#define STATUS(name, number, words, remedy) {(number), (words)},
#include "base/status.def"
#undef STATUS
};
enum { ERRORS = sizeof errors / sizeof errors[0] };

/* The number of the error that this line of text tells; it must tell one exactly. */
static unsigned error_in(const char *text)
{
    for (unsigned i = 0; i < ERRORS; i++) {
        char expected[60];
        const int length = snprintf(expected, sizeof expected, "?%u %s", errors[i].number, errors[i].words);
        if (strncmp(text, expected, (size_t)length) != 0) {
            continue;
        }
        text += length;
        if (errors[i].number == STATUS_RANGE && *text == ' ') {
            const size_t range = strcspn(text + 1, "\r\n");
            require(range >= 4 && range == strspn(text + 1, "0123456789.or "), "a range that is none");
            text += 1 + range;
        }
        if (strncmp(text, "\r\n", 2) == 0) {
            return errors[i].number;
        }
        break;
    }
    fail("an error that is not in the table", "");
    return 0;
}

/* All errors in what was said; *number is the last one's. What was typed begins behind a prompt, an error a line. */
static unsigned count_errors(unsigned *number)
{
    unsigned count = 0;
    *number = STATUS_OK;
    for (const char *text = terminal_port_fake_text(); (text = strstr(text, "\n?")) != NULL; text++) {
        if (text[2] != '\t') { /* the help's own row */
            *number = error_in(text + 1);
            count++;
        }
    }
    return count;
}

static const char *const prompts[] = {
    [MODE_COMMANDS] = "SAC>", [MODE_QUEUE] = "Q>", [MODE_ARRAY] = "X>", [MODE_CONFIGURE] = "SAC>"};

/* Whether the line was answered, or held because something is being written. */
static bool is_answered(void)
{
    const char *text = strrchr(terminal_port_fake_text(), '\n');
    return text != NULL && (strcmp(text, "\nSAC>") == 0 || strcmp(text, "\nQ>") == 0 || strcmp(text, "\nX>") == 0);
}

static bool prompt_is_back(void)
{
    const size_t length = terminal_port_fake_sent();
    const char *prompt = prompts[mode];
    const size_t bytes = strlen(prompt);
    return length >= bytes && memcmp(terminal_port_fake_text() + length - bytes, prompt, bytes) == 0;
}

/* The last line of the screen, its prompt apart, is what the editor holds. */
static void check_screen(void)
{
    char shown[400] = "";
    unsigned cursor = 0;
    const char *text = terminal_port_fake_text();
    const char *last = strrchr(text, '\n');
    if (last != NULL) {
        text = last + 1;
        require(strncmp(text, prompts[mode], strlen(prompts[mode])) == 0, "a line is echoed without its prompt");
        text += strlen(prompts[mode]);
    }
    unsigned length = 0;
    for (; *text != '\0'; text++) {
        if (*text == '\b') {
            require(cursor > 0, "a character before the line was taken back");
            cursor--;
        } else if (cursor < sizeof shown - 1) {
            shown[cursor++] = *text;
            length = cursor > length ? cursor : length;
        }
    }
    while (length > cursor && shown[length - 1] == ' ') {
        length--; /* taken back */
    }
    shown[length] = '\0';
    require(strcmp(shown, editor.text) == 0, "what is on the screen is not what was typed");
}

/* -- lines ------------------------------------------------------------------------------------------------------------- */

static uint64_t lines_done, lines_taken;

static void forget_what_was_said(void)
{
    terminal_port_fake_reset();
    bus_port_fake_clear();
}

/* What the engine is offered, or has begun, is this entry. */
static bool comes_next(uint8_t position)
{
    return after.offered == position ||
           (after.submitted > before.submitted &&
            memcmp(&engine_fake.submitted[(after.submitted - 1) % ENGINE_FAKE_COMMANDS], &after.entries[position],
                   sizeof after.entries[position]) == 0);
}

typedef enum { MUST_BE_TAKEN, MUST_BE_REFUSED, EITHER } verdict_t;

static verdict_t verdict(bool right)
{
    return right ? MUST_BE_TAKEN : MUST_BE_REFUSED;
}

static verdict_t judge_number(const char *text, double least, double most)
{
    uint32_t number;
    return verdict(reference_number(&text, least, most, &number) && is_end(*text));
}

/* What the line must leave where it is taken. */
static struct {
    uint8_t entry; /* this one, or NO_ENTRY */
    motion_command_t command;
    uint8_t next; /* position that comes next, or NO_ENTRY */
    bool seeded;  /* entries 1..30 are seeds */
    bool restored, saved, undone, edited;
    fuzz_mode_t mode;
    settings_t stored;
    uint8_t array[QUEUE_ARRAY];
} expected;
enum { NO_ENTRY = 0xFF };

static verdict_t judge_preemption(const char *text)
{
    reading_t reading;
    const read_t kind = reference_read(text, &before.session, &reading);
    if ((kind != READ_MOTION && kind != READ_OPEN) || engine_check(&reading.command) != STATUS_OK || engine_fake.estop) {
        return MUST_BE_REFUSED;
    }
    expected.entry = expected.next = kind == READ_OPEN ? QUEUE_CONTINUOUS : QUEUE_ONE_SHOT;
    expected.command = reading.command;
    return MUST_BE_TAKEN;
}

static verdict_t judge_edit(const char *text)
{
    uint32_t position;
    if (!reference_number(&text, QUEUE_FIRST, QUEUE_LAST, &position)) {
        return MUST_BE_REFUSED;
    }
    if (is_end(*text)) {
        return MUST_BE_TAKEN;
    }
    const read_t kind = reference_edit(text, &before.entries[position], &expected.command);
    if (kind == READ_REFUSED || engine_check(&expected.command) != STATUS_OK) {
        return MUST_BE_REFUSED;
    }
    expected.entry = (uint8_t)position;
    expected.edited = true;
    return verdict(kind != READ_OPEN);
}

/* Not what settings in force since a warm boot have made impossible. */
static bool can_run(uint8_t position)
{
    return is_possible_now(before.entries[position].velocity, before.entries[position].flags);
}

static bool array_can_run(void)
{
    bool all = before.array[0] != 0 && !engine_fake.estop;
    for (uint8_t i = 0; i < QUEUE_ARRAY && before.array[i] != 0; i++) {
        all = all && can_run(before.array[i]);
    }
    return all;
}

static verdict_t judge_array(const char *text)
{
    uint32_t entry, position;
    if (!reference_number(&text, 0, 30, &entry) || *text++ != ',' || !reference_number(&text, 0, 30, &position) ||
        !is_end(*text) || (position != 0 && !can_run((uint8_t)position))) {
        return MUST_BE_REFUSED;
    }
    expected.array[entry] = (uint8_t)position;
    return MUST_BE_TAKEN;
}

static verdict_t judge_dollar(const char *text)
{
    const char *rest = text + 2;
    if (text[1] == 'c' || text[1] == 'C') {
        if (is_end(*rest)) {
            expected.mode = MODE_CONFIGURE;
            return MUST_BE_TAKEN;
        }
        return verdict(reference_setting(rest, &expected.stored));
    }
    switch (text[1]) {
    case 'L':
    case 'O': return is_end(*rest) ? MUST_BE_TAKEN : judge_number(rest, 0, 1);
    case 'H':
    case 'K': return is_end(*rest) ? MUST_BE_TAKEN : judge_number(rest, 0, 65535);
    case 'F':
    case 'P':
    case 'U':
    case 'E':
    case 'R':
    case 'n': return verdict(is_end(*rest));
    default: return MUST_BE_REFUSED;
    }
}

typedef enum { HERE, TO_EVERYBODY, TO_A_NODE, NOWHERE } address_t;

/* Which node a line is for; its own address is taken off. Nobody has sent a message that / could answer. */
static address_t read_address(const char **line)
{
    const char *text = *line;
    if (mode != MODE_COMMANDS || *text < '0' || *text > '9') {
        return HERE;
    }
    unsigned node = 0;
    for (; *text >= '0' && *text <= '9'; text++) {
        node = node > 255 ? node : node * 10 + (unsigned)(*text - '0');
    }
    if (node > 255 || *text == '\0') {
        return NOWHERE;
    }
    if (node == before.settings.device_id) {
        *line = text;
        return HERE;
    }
    return node == 0 ? TO_EVERYBODY : TO_A_NODE;
}

/* All commands but m, v, vc, a, d. */
static verdict_t judge(const char *text)
{
    const char first = lower(text[0]), second = is_end(text[0]) ? '\0' : lower(text[1]);
    const bool alone = is_end(second);
    if (is_end(first)) {
        return MUST_BE_TAKEN;
    }
    if (mode != MODE_COMMANDS) {
        if (alone && first == 'x') {
            expected.mode = MODE_COMMANDS;
            return MUST_BE_TAKEN;
        }
        if (mode == MODE_CONFIGURE) {
            return alone && text[0] == 'S' ? MUST_BE_TAKEN : verdict(reference_setting(text, &expected.stored));
        }
        if (alone && (first == 's' || first == 'q' || first == '?')) {
            return MUST_BE_TAKEN;
        }
        return mode == MODE_QUEUE ? judge_edit(text) : judge_array(text);
    }
    const bool two = !alone && is_end(text[2]); /* letters */
    switch (first) {
    case 'v': return verdict(second == 'd' && two);
    case '+': /* behind the own address */
    case '-':
    case 's':
    case 'n':
    case 'g':
    case 'b':
    case 'p':
    case '?': return verdict(alone);
    case 'y': return verdict(alone && text[0] == 'y');
    case 'c': return verdict(two && (second == 'f' || second == 'c' || second == 'n' || second == 'z'));
    case 'q':
        if (two && second == 'p') {
            expected.mode = MODE_QUEUE;
        } else if (two && second == 'c') {
            expected.seeded = true;
            return store_busy() ? EITHER : MUST_BE_TAKEN; /* it may have been saved by the end of the line */
        } else if (two && second == 's') {
            expected.saved = true;
        } else if (two && second == 'r') {
            expected.restored = true;
            return store_busy() ? EITHER : verdict(!snapshot_broken);
        } else if (!alone) {
            return judge_edit(text + 1);
        }
        return MUST_BE_TAKEN;
    case 'l':
        switch (second) {
        case 'a': {
            bool all = two && !engine_fake.estop;
            for (uint8_t i = QUEUE_FIRST; i <= QUEUE_LAST; i++) {
                all = all && can_run(i);
            }
            return verdict(all);
        }
        case 's':
        case 'f':
            if (judge_number(text + 2, QUEUE_FIRST, QUEUE_LAST) == MUST_BE_REFUSED) {
                return MUST_BE_REFUSED;
            }
            return EITHER; /* start is finish, or Estop */
        case 'n': return two ? MUST_BE_TAKEN : judge_number(text + 2, 0, 65535);
        default:
            if (alone) {
                return MUST_BE_TAKEN;
            }
            if (judge_number(text + 1, 0, 65535) == MUST_BE_REFUSED || !array_can_run()) {
                return MUST_BE_REFUSED;
            }
            expected.next = before.array[0];
            return before.offered < 0 ? MUST_BE_TAKEN : EITHER;
        }
    case 'x':
        if (second == 'm') {
            return judge_preemption(text + 1);
        }
        if (two && second == 'p') {
            expected.mode = MODE_ARRAY;
            return MUST_BE_TAKEN;
        }
        if (two && second == 'l') {
            return verdict(array_can_run());
        }
        if (alone || (two && second == 'd')) {
            return MUST_BE_TAKEN;
        } else {
            const char *rest = text + 1;
            uint32_t position;
            if (!reference_number(&rest, QUEUE_FIRST, QUEUE_LAST, &position) || !is_end(*rest) || engine_fake.estop ||
                !can_run((uint8_t)position)) {
                return MUST_BE_REFUSED;
            }
            expected.next = (uint8_t)position;
            return MUST_BE_TAKEN;
        }
    case 'z':
        if (!alone) {
            return MUST_BE_REFUSED;
        }
        expected.undone = true;
        expected.entry = undo.position;
        expected.command = undo.entry;
        if (!undo.known) { /* after a flood */
            expected.entry = NO_ENTRY;
            return EITHER;
        }
        return verdict(undo.position != 0 && !undo.executing);
    case '$': return judge_dollar(text);
    default: return MUST_BE_REFUSED;
    }
}

static bool same_command(const motion_command_t *a, const motion_command_t *b)
{
    return memcmp(a, b, sizeof *a) == 0;
}

/* 1..30 hold one revolution each, with these defaults. */
static void check_seeds(const session_t *from)
{
    motion_command_t seed = {.count = settings.steps_per_rev, .velocity = from->velocity, .accel = from->accel,
                             .decel = from->decel};
    seed.flags = (uint8_t)((from->flags & (MOTION_CYCLE | MOTION_LINEAR)) | (settings.direction ? MOTION_CCW : 0));
    for (uint8_t i = QUEUE_FIRST; i <= QUEUE_LAST; i++) {
        require(same_command(&after.entries[i], &seed), "a cleared entry is not the seed");
    }
}

static void check_taken(const char *text, unsigned allowed)
{
    if (!(allowed & ENTRIES)) {
        expected.entry = NO_ENTRY;
    }
    if (expected.seeded) {
        check_seeds(&before.session);
    } else if (expected.restored && eeprom_fake.cells[SNAPSHOT] != 1) {
        session_t factory = {.velocity = settings.cycle_us, .accel = settings.accel[settings.ramp],
                             .decel = settings.decel[settings.ramp]};
        factory.flags = MOTION_CYCLE | (settings.ramp ? MOTION_LINEAR : 0);
        check_seeds(&factory);
    } else if (expected.restored) {
        require(memcmp(&after.entries[QUEUE_FIRST], &eeprom_fake.cells[SNAPSHOT + 1], STORE_QUEUE_BYTES) == 0,
                "the queue is not what was saved");
    } else if ((allowed & ENTRIES) && !(expected.undone && !undo.known)) {
        for (uint8_t i = 0; i < QUEUE_POSITIONS; i++) {
            require(i == expected.entry || same_command(&before.entries[i], &after.entries[i]),
                    "another entry has changed");
        }
        require(expected.entry == NO_ENTRY || same_command(&after.entries[expected.entry], &expected.command),
                "the entry is not what was typed");
    }
    if (expected.seeded || expected.restored || expected.undone) {
        undo.position = 0;
        undo.known = true;
    }
    if (expected.edited) {
        undo.known = true;
        undo.position = expected.entry;
        undo.added = false;
        undo.entry = before.entries[expected.entry];
    }
    if (expected.saved && after.idle) {
        require(after.snapshot_mark == 1 &&
                    memcmp(after.snapshot, &after.entries[QUEUE_FIRST], STORE_QUEUE_BYTES) == 0,
                "the snapshot is not the queue");
    }
    if (expected.saved) {
        snapshot_broken = false;
    }
    require(expected.next == NO_ENTRY || comes_next(expected.next), "what was asked for does not come next");
    require(memcmp(after.array, expected.array, sizeof after.array) == 0, "the array is not what was typed");
    require(mode != MODE_COMMANDS || lower(text[0]) != 's' || (after.pending == 0 && after.offered < 0),
            "a stop leaves something to come");
    if (after.restarts != before.restarts) {
        require(after.restarts == before.restarts + 1 && memcmp(&settings, &stored, sizeof stored) == 0,
                "a restart has not brought the stored settings into force");
    }
}

/* The line in the editor has been ended and answered. */
static void check_line(void)
{
    const char *text = editor.text;
    const bool broken = editor.damaged || editor.too_long;
    expected.entry = expected.next = NO_ENTRY;
    expected.seeded = expected.restored = expected.saved = expected.undone = expected.edited = false;
    expected.mode = mode;
    expected.stored = stored;
    memcpy(expected.array, before.array, sizeof expected.array);
    const fuzz_mode_t mode_before = mode;
    undo.executing = before.executing == undo.position && undo.position != 0;

    const address_t address = broken ? HERE : read_address(&text);
    reading_t reading;
    read_t kind = broken || mode != MODE_COMMANDS || address != HERE ? READ_OTHER : reference_read(text, &before.session, &reading);
    if ((kind == READ_MOTION || kind == READ_VALUE || kind == READ_OPEN) &&
        engine_check(&reading.command) != STATUS_OK) {
        kind = READ_REFUSED;
    }
    const bool full = kind == READ_MOTION && before.pending == QUEUE_LAST;
    if (full || ((kind == READ_MOTION || kind == READ_OPEN) && engine_fake.estop)) {
        kind = READ_REFUSED;
    }
    const verdict_t must = broken ? MUST_BE_REFUSED
                           : address != HERE   ? verdict(address == TO_EVERYBODY) /* nobody else answers */
                           : kind == READ_OTHER ? judge(text)
                                                : verdict(kind != READ_REFUSED);
    if (kind == READ_OPEN) {
        (void)judge_preemption(text);
    }

    if (store_rests && store_busy() && !is_answered()) {
        look(&after);
        check_changes(text[0] == '$' ? ENDS : 0, "a line that waits has changed ");
        store_rests = false;
        lines_waited++;
        rest();
    }
    unsigned error;
    const unsigned count = count_errors(&error);
    mode = count == 0 && !broken ? expected.mode : mode_before;
    require(prompt_is_back(), "no prompt after a line");
    require(count <= 1, "more than one error for one line");
    const fuzz_mode_t mode_after = mode;
    mode = mode_before; /* which the line was read in */
    look(&after);
    check_ranges();
    lines_done++;
    const bool dollar = text[0] == '$' && !broken && mode == MODE_COMMANDS;
    if (broken) {
        require(error == (editor.damaged ? STATUS_LINE_DAMAGED : STATUS_LINE_TOO_LONG),
                "a broken line was not refused as such");
    }
    require(count == 0 || must != MUST_BE_TAKEN, "a right line was refused");
    require(count > 0 || must != MUST_BE_REFUSED, "a wrong line was taken");
    require(!full || engine_fake.estop || error == STATUS_QUEUE_FULL, "a full queue has taken a command");
    const unsigned allowed = count > 0 ? (dollar ? ENDS : 0) : may_change(text);
    check_changes(allowed, count > 0 ? "a refused line has changed " : "a line has changed ");
    if (dollar) {
        require(after.stops > before.stops && after.pending == 0 && after.offered < 0, /* again each time it waits */
                "a $ line has not stopped all");
    }
    if (count == 0) {
        lines_taken++;
        stored = expected.stored;
        if (kind == READ_MOTION) {
            expected.entry = before.next;
            expected.command = reading.command;
        } else if ((kind == READ_VALUE || kind == READ_RAMP) &&
                   memcmp(&before.entries[0], &after.entries[0], sizeof after.entries[0]) != 0) {
            motion_command_t follows = before.entries[0];
            follows.velocity = reading.session.velocity;
            follows.accel = reading.session.accel;
            follows.flags = (uint8_t)((follows.flags & ~SESSION_FLAGS) | reading.session.flags);
            expected.entry = expected.next = QUEUE_CONTINUOUS;
            expected.command = follows;
        }
        check_taken(text, allowed);
        mode = mode_after;
    }
    if (after.idle) {
        require(memcmp(after.stored, &stored, sizeof stored) == 0, "what is stored is not what was typed");
    }
    if (count > 0 || kind == READ_OTHER) {
        if (expected.undone && expected.entry != NO_ENTRY && count == 0 && undo.added) {
            require(after.next == expected.entry && after.pending == before.pending - (before.pending != 0),
                    "what was taken back is not the newest command");
        }
        return;
    }
    const session_t *wanted = kind == READ_OPEN ? &before.session : &reading.session;
    require(session.velocity == wanted->velocity && session.accel == wanted->accel && session.decel == wanted->decel &&
                session.flags == wanted->flags && session.options == before.session.options,
            "the session is not what was typed");
    if (kind == READ_MOTION) {
        undo.known = true;
        undo.position = before.next;
        undo.added = true;
        undo.entry = before.entries[before.next];
        require(after.next == before.next % QUEUE_LAST + 1, "the next position is not the next one");
        require(after.submitted - before.submitted + after.pending == before.pending + 1u,
                "a command was lost or doubled");
    }
}

/* What the editor's model says of the next byte; pulses are counted. */
static edit_t next_byte(void)
{
    const edit_t edit = editor_take(&editor, here.bytes[here.taken]);
    terminal_port_fake_type_byte(here.bytes[here.taken]);
    pulses_cw += edit == EDIT_PULSE_CW;
    pulses_ccw += edit == EDIT_PULSE_CCW;
    if (edit == EDIT_ENDED && !editor.damaged && !editor.too_long) { /* with the own address they are lines */
        const char *text = editor.text;
        const bool addressed = read_address(&text) == HERE && text != editor.text && is_end(text[1]);
        pulses_cw += addressed && *text == '+';
        pulses_ccw += addressed && *text == '-';
    }
    here.taken++;
    return edit;
}

static void check_pulses(void)
{
    require(engine_fake.pulses_cw == pulses_cw && engine_fake.pulses_ccw == pulses_ccw,
            "pulses that nobody typed, or too few");
    before.pulses_cw = pulses_cw;
    before.pulses_ccw = pulses_ccw;
}

/* All up to the end of the line has been typed and has come to rest: nothing but pulses may have come of it. */
static void check_typing(void)
{
    check_pulses();
    look(&after);
    check_changes(0, "before its end a line has changed ");
    check_screen();
}

/* Byte by byte, everything at rest in between, or in chunks with the output stalled; each line is checked. */
static void type_lines(bool in_chunks)
{
    forget_what_was_said();
    look(&before);
    while (here.taken < here.length) {
        if (in_chunks) {
            terminal_port_fake_hold(1);
            terminal_port_fake_press(fuzz_chance(&fuzz, 50));
        }
        unsigned chunk = in_chunks ? 1 + fuzz_below(&fuzz, 50) : 1;
        edit_t edit = EDIT_NOTHING;
        while (chunk-- > 0 && here.taken < here.length && edit != EDIT_ENDED) {
            const uint8_t byte = here.bytes[here.taken];
            const bool ends = byte == '\r' || byte == '\n';
            if (ends && (!in_chunks || fuzz_chance(&fuzz, 50))) {
                rest();
                check_typing();
            }
            edit = next_byte();
        }
        if (in_chunks) {
            work_a_little();
        } else {
            rest();
            check_pulses();
        }
        if (edit == EDIT_ENDED) {
            rest();
            check_pulses();
            check_line();
            editor_next(&editor);
            editor.in_mode = mode != MODE_COMMANDS;
            let_time_pass();
            forget_what_was_said();
            look(&before);
        }
    }
    rest(); /* what stands behind the last line's end */
    check_pulses();
}

/* Commands that leave session and motions alone. */
static bool is_harmless(const char *text)
{
    static const char *const lines[] = {"", "vd", "q", "cf", "p", "?", "g", "b", "y", "cc", "xd"};
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        if (strcmp(text, lines[i]) == 0) {
            return true;
        }
    }
    return false;
}

/* Lines after which another mode may be in force. */
static bool changes_mode(const char *text)
{
    (void)read_address(&text);
    const char first = lower(text[0]), second = lower(text[0] == '\0' ? '\0' : text[1]);
    return ((first == 'q' || first == 'x') && second == 'p') || (first == '$' && (second == 'c' || text[1] == 'R')) ||
           (mode != MODE_COMMANDS && first == 'x');
}

/* Many lines without a pause: all are executed, in their order, whatever becomes of their echo. */
static void flood(void)
{
    forget_what_was_said();
    terminal_port_fake_hold(1);
    terminal_port_fake_press(fuzz_chance(&fuzz, 70));
    look(&before);
    session_t wanted = session;
    unsigned motions = 0;
    bool known = mode == MODE_COMMANDS; /* all that was typed is such that the outcome is known */
    bool modes = false;
    while (here.taken < here.length) {
        if (next_byte() == EDIT_ENDED) {
            reading_t reading;
            read_t kind = reference_read(editor.text, &wanted, &reading);
            if ((kind == READ_MOTION || kind == READ_VALUE) && engine_check(&reading.command) != STATUS_OK) {
                kind = READ_REFUSED;
            }
            if (editor.damaged || editor.too_long || kind == READ_REFUSED) {
                /* nothing comes of it */
            } else if (kind == READ_OPEN || (kind == READ_OTHER && !is_harmless(editor.text))) {
                known = false;
                modes |= changes_mode(editor.text);
            } else if (kind == READ_MOTION && engine_fake.estop) {
                /* refused */
            } else if (kind != READ_OTHER) {
                known &= kind == READ_MOTION || before.entries[0].count != 0; /* nothing continuous that follows */
                wanted = reading.session;
                motions += kind == READ_MOTION;
            }
            editor_next(&editor);
            lines_done++;
        }
        if (fuzz_chance(&fuzz, 10)) {
            work_a_little();
        }
    }
    store_rests = false;
    rest();
    unsigned error;
    (void)count_errors(&error);
    if (!modes) {
        require(prompt_is_back(), "no prompt after a flood");
        check_pulses();
    }
    check_ranges();
    look(&after);
    if (known && before.pending + motions <= QUEUE_LAST) {
        require(after.submitted - before.submitted + after.pending == before.pending + motions,
                "of a flood a command was lost or doubled");
        require(session.velocity == wanted.velocity && session.accel == wanted.accel &&
                    session.decel == wanted.decel && session.flags == wanted.flags,
                "a flood has not left the session that was typed");
    }
    /* Whatever mode it has led to is left; what it has stored and written is known from here on. */
    forget_what_was_said();
    terminal_port_fake_type("x\r");
    rest();
    mode = MODE_COMMANDS;
    editor_next(&editor);
    editor.in_mode = false;
    editor.after_return = true;
    require(prompt_is_back(), "no prompt after a flood");
    pulses_cw = engine_fake.pulses_cw;
    pulses_ccw = engine_fake.pulses_ccw;
    for (uint8_t i = 0; i < sizeof stored; i++) {
        ((uint8_t *)&stored)[i] = store_setting(i);
    }
    undo.known = false;
    motion_command_t loaded[QUEUE_LAST];
    snapshot_broken = store_load_queue(loaded) == STORE_QUEUE_BROKEN;
    let_time_pass();
}

static void append(const fuzz_line_t *line)
{
    memcpy(here.bytes + here.length, line->bytes, line->length);
    here.length += line->length;
    const uint32_t end = fuzz_below(&fuzz, 10);
    here.bytes[here.length++] = end == 0 ? '\n' : '\r';
    if (end == 1) {
        here.bytes[here.length++] = '\n';
    }
}

static void one_turn(void)
{
    fuzz_line_t line;
    const uint32_t way = fuzz_below(&fuzz, 100);
    here.length = here.taken = 0;
    const bool displays = way == 0; /* more of them than can wait */
    for (uint32_t lines = way < 4 ? 2 + fuzz_below(&fuzz, FLOOD_LINES - 2) : 1; lines > 0; lines--) {
        fuzz.mode = (uint8_t)mode;
        fuzz_line(&fuzz, &line);
        if (displays && fuzz_chance(&fuzz, 80)) {
            line.bytes[0] = (uint8_t) "qp?"[fuzz_below(&fuzz, 3)];
            line.length = 1;
        }
        line.length = line.length < FUZZ_LINE_BYTES - 2 ? line.length : FUZZ_LINE_BYTES - 2;
        append(&line);
        here.line++;
    }
    if (way < 4) {
        flood();
    } else {
        type_lines(way < 30);
    }
}

/* -- the test ---------------------------------------------------------------------------------------------------------- */

static uint64_t asked_for(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text != NULL && *text != '\0' ? strtoull(text, NULL, 10) : otherwise;
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

/* What is typed is lines of the generator, counted with the line ends that damage has put into them. */
static void test_no_line_whatever_its_bytes_changes_more_than_it_may(void)
{
    const uint64_t lines = asked_for("SAC_FUZZ_LINES", DEFAULT_LINES);
    const uint64_t first = asked_for("SAC_FUZZ_SEED", 1);
    const double start = seconds();
    double told = start;
    uint64_t made = 0;
    for (here.seed = first; made < lines; here.seed++) {
        alarm(HANG_SECONDS);
        here.length = here.taken = here.line = 0;
        power_on(here.seed);
        while (here.line < BLOCK_LINES && made + here.line < lines) {
            one_turn();
        }
        made += here.line;
        const double now = seconds();
        if (now - told > 10 || made >= lines) {
            told = now;
            printf("%" PRIu64 " lines, %" PRIu64 " ended, %" PRIu64 " taken without an error, %" PRIu64 " waited; seeds %" PRIu64
                   "..%" PRIu64 "; %.1f s, %.0f lines/s\n",
                   made, lines_done, lines_taken, lines_waited, first, here.seed, now - start, (double)made / (now - start));
            fflush(stdout);
        }
    }
    alarm(0);
}

int main(void)
{
    signal(SIGABRT, on_signal);
    signal(SIGALRM, on_signal);
#ifdef __SANITIZE_ADDRESS__
    __sanitizer_set_death_callback(on_death);
#endif
    UNITY_BEGIN();
    RUN_TEST(test_no_line_whatever_its_bytes_changes_more_than_it_may);
    return UNITY_END();
}
