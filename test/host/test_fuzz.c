/* The terminal, from bytes to queue entries, under lines of all kinds: typed byte by byte, in chunks, with the output
 * stalled, in floods. After each line:
 *   - the prompt is back, and what stands on the screen is what was executed
 *   - every value of settings, session and queue lies in its range
 *   - a line that was refused has changed nothing, its error is one of the table, and there is only one
 *   - a line that was taken has changed only what such a command may change; motion commands exactly what was typed
 *   - a pulse was asked for only by + or -, the engine only by a motion command that was taken
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
#include "cli/terminal.h"
#include "cli/terminal_port.h"
#include "fuzz/grammar.h"
#include "fuzz/reference.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "settings.h"
#include "unity.h"

enum { BLOCK_LINES = 1000, DEFAULT_LINES = 200000, FLOOD_LINES = 12, MOST_ROUNDS = 100000, HANG_SECONDS = 120 };

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

static bool is_possible(uint32_t velocity, uint8_t flags)
{
    const motion_command_t command = {.count = 1, .velocity = velocity, .flags = flags};
    return velocity >= 1 && engine_check(&command) == STATUS_OK;
}

static void check_ranges(void)
{
    require(settings.cycle_us >= 1 && settings.hw_baud >= 300 && settings.hw_baud <= 2000000 &&
                settings.steps_per_rev >= 1 && settings.ramp <= 1 && settings.cw_level <= 1 &&
                settings.direction <= 1 && settings.ustep <= 7 && settings.pulse_us >= 1 && settings.slow_rpm >= 1 &&
                settings.full_step <= 1 && is_ramp(settings.accel[0]) && is_ramp(settings.accel[1]) &&
                is_ramp(settings.decel[0]) && is_ramp(settings.decel[1]),
            "a setting is out of its range");
    require((session.flags & ~SESSION_FLAGS) == 0 && is_ramp(session.accel) && is_ramp(session.decel) &&
                is_possible(session.velocity, session.flags),
            "a session value is out of its range");
    require(queue_next_position() >= QUEUE_FIRST && queue_next_position() <= QUEUE_LAST &&
                queue_pending() <= QUEUE_LAST && queue_executing_position() <= QUEUE_LAST,
            "a position of the queue is out of its range");
    const uint8_t flags = MOTION_CCW | MOTION_PULSES | MOTION_LINEAR | MOTION_SYNC | MOTION_CYCLE;
    for (uint8_t i = 0; i < QUEUE_POSITIONS; i++) {
        const motion_command_t *entry = queue_entry(i);
        require((entry->flags & ~flags) == 0 && entry->count >= 1 && is_ramp(entry->accel) && is_ramp(entry->decel) &&
                    is_possible(entry->velocity, entry->flags),
                "an entry of the queue is out of its range");
    }
}

/* -- everything that a line may change --------------------------------------------------------------------------------- */

typedef struct {
    settings_t settings;
    session_t session;
    motion_command_t entries[QUEUE_POSITIONS];
    uint8_t next, pending;
    bool debugging, gap, clock;
    unsigned submitted, stops, graceful, nexts, pulses_cw, pulses_ccw;
} look_t;

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
    all->debugging = commands_debugging();
    all->gap = engine_fake.gap;
    all->clock = timebase_fake_running;
    all->submitted = engine_fake.submitted_count;
    all->stops = engine_fake.stops;
    all->graceful = engine_fake.stops_graceful;
    all->nexts = engine_fake.nexts + engine_fake.nexts_graceful;
    all->pulses_cw = engine_fake.pulses_cw;
    all->pulses_ccw = engine_fake.pulses_ccw;
}

/* What a command may change, by its first letter. */
enum {
    SESSION = 1 << 0,
    ENTRIES = 1 << 1,
    PENDING = 1 << 2, /* and the next position, and what the engine is given */
    STOPS = 1 << 3,
    NEXTS = 1 << 4,
    DEBUG = 1 << 5,
    GAP = 1 << 6,
    SETTINGS = 1 << 7,
};

static unsigned may_change(const char *text)
{
    switch (text[0]) {
    case 'm':
    case 'M': return SESSION | ENTRIES | PENDING;
    case 'v':
    case 'V':
    case 'a':
    case 'A':
    case 'd':
    case 'D': return SESSION;
    case 'S':
    case 's': return PENDING | STOPS;
    case 'N':
    case 'n': return NEXTS;
    case 'g':
    case 'G': return GAP;
    case 'b':
    case 'B': return DEBUG;
    case '$': return SESSION | PENDING | STOPS | SETTINGS | (text[1] == 'R' ? DEBUG | GAP : 0u);
    case 'q':
    case 'Q': return text[1] == '\0' || text[1] == ' ' ? 0 : ENTRIES | PENDING;
    case 'z':
    case 'Z': return ENTRIES | PENDING;
    case 'l':
    case 'L':
    case 'x':
    case 'X':
    case 'y': return ENTRIES | PENDING | STOPS | NEXTS;
    default: return 0; /* displays, messages, blank lines, what is unknown */
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
        REQUIRE_SAME(submitted);
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
        REQUIRE_SAME(clock);
    }
    if (!(allowed & GAP)) {
        REQUIRE_SAME(gap);
    }
    REQUIRE_SAME(pulses_cw);
    REQUIRE_SAME(pulses_ccw);
}

/* -- the machine: terminal, queue, and an engine that has two commands at most ------------------------------------------ */

static fuzz_t fuzz;
static editor_t editor;
static unsigned over; /* commands that the engine has ended, or that a stop has dropped */
static unsigned stops_seen;
static bool engine_busy; /* it ends nothing for the present */
static unsigned pulses_cw, pulses_ccw;

static unsigned in_engine(void)
{
    const unsigned stops = engine_fake.stops + engine_fake.stops_graceful;
    if (stops != stops_seen) {
        stops_seen = stops;
        over = engine_fake.submitted_count;
    }
    return engine_fake.submitted_count - over;
}

static bool poll_once(void)
{
    engine_fake.accepts = in_engine() < 2;
    bool worked = terminal_poll();
    engine_fake.accepts = in_engine() < 2;
    worked |= queue_poll();
    return worked;
}

/* Until all has been said and done. */
static void rest(void)
{
    unsigned rounds = 0;
    const uint8_t places = 31;
    terminal_port_fake_drain(places);
    while (poll_once() || terminal_port_free() < places) {
        terminal_port_fake_drain(places);
        require(++rounds < MOST_ROUNDS, "no rest after so many rounds of the main loop");
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

/* The motor goes on between two lines. */
static void let_time_pass(void)
{
    if (fuzz_chance(&fuzz, 2)) {
        engine_busy = fuzz_chance(&fuzz, 50);
        fuzz.motions = engine_busy ? 96 : 40; /* the queue fills */
    }
    while (!engine_busy && in_engine() > 0 && fuzz_chance(&fuzz, 70)) {
        over++;
        engine_fake.ended++;
        rest();
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

static void power_on(uint64_t seed)
{
    fuzz_begin(&fuzz, seed);
    choose_settings();
    terminal_port_fake_reset();
    engine_fake_reset();
    stops_seen = over = pulses_cw = pulses_ccw = 0;
    engine_busy = false;
    timebase_fake_running = false;
    commands_init();
    queue_init();
    terminal_init();
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
            require(range >= 4 && range == strspn(text + 1, "0123456789.-"), "a range that is none");
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

static bool prompt_is_back(void)
{
    const size_t length = terminal_port_fake_sent();
    return length >= 4 && memcmp(terminal_port_fake_text() + length - 4, "SAC>", 4) == 0;
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
        require(strncmp(text, "SAC>", 4) == 0, "a line is echoed without its prompt");
        text += 4;
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
}

/* The line in the editor has been ended and answered. */
static void check_line(void)
{
    unsigned error;
    const unsigned count = count_errors(&error);
    require(prompt_is_back(), "no prompt after a line");
    require(count <= 1, "more than one error for one line");
    look(&after);
    check_ranges();
    lines_done++;
    const char *text = editor.text;
    const bool dollar = text[0] == '$' && !editor.damaged && !editor.too_long;
    if (editor.damaged || editor.too_long) {
        require(error == (editor.damaged ? STATUS_LINE_DAMAGED : STATUS_LINE_TOO_LONG),
                "a broken line was not refused as such");
    }
    if (count > 0) {
        check_changes(dollar ? PENDING | STOPS : 0, "a refused line has changed ");
        require(!dollar || after.submitted == before.submitted, "a refused line has started a motion");
    } else {
        check_changes(may_change(text), "a line has changed ");
        lines_taken++;
    }
    if (dollar) {
        require(after.stops == before.stops + 1 && after.pending == 0, "a $ line has not stopped all");
    }
    if (editor.damaged || editor.too_long) {
        return;
    }
    reading_t reading;
    read_t kind = reference_read(text, &before.session, &reading);
    if ((kind == READ_MOTION || kind == READ_VALUE) && engine_check(&reading.command) != STATUS_OK) {
        kind = READ_REFUSED;
    }
    if (kind == READ_MOTION && before.pending == QUEUE_LAST) {
        require(error == STATUS_QUEUE_FULL, "a full queue has taken a command");
        return;
    }
    if (kind == READ_REFUSED) {
        require(count == 1, "a wrong line was taken");
    } else if (kind == READ_MOTION || kind == READ_VALUE || kind == READ_RAMP) {
        require(count == 0, "a right line was refused");
        require(session.velocity == reading.session.velocity && session.accel == reading.session.accel &&
                    session.decel == reading.session.decel && session.flags == reading.session.flags,
                "the session is not what was typed");
    }
    if (kind == READ_MOTION) {
        const motion_command_t *entry = queue_entry(before.next);
        const motion_command_t *typed = &reading.command;
        require(entry->count == typed->count && entry->velocity == typed->velocity &&
                    entry->start_wait_us == typed->start_wait_us && entry->accel == typed->accel &&
                    entry->decel == typed->decel && entry->extra_pulses == typed->extra_pulses &&
                    entry->flags == typed->flags,
                "the entry is not what was typed");
        require(after.next == before.next % QUEUE_LAST + 1, "the next position is not the next one");
        require(after.submitted - before.submitted + after.pending == before.pending + 1u,
                "a command was lost or doubled");
        for (uint8_t i = 0; i < QUEUE_POSITIONS; i++) {
            require(i == before.next || memcmp(&before.entries[i], &after.entries[i], sizeof after.entries[i]) == 0,
                    "another entry has changed");
        }
    }
}

/* What the editor's model says of the next byte; pulses are counted. */
static edit_t next_byte(void)
{
    const edit_t edit = editor_take(&editor, here.bytes[here.taken]);
    terminal_port_fake_type_byte(here.bytes[here.taken]);
    pulses_cw += edit == EDIT_PULSE_CW;
    pulses_ccw += edit == EDIT_PULSE_CCW;
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
    static const char *const lines[] = {"", "vd", "q", "cf", "p", "?", "g", "b", "N", "n"};
    for (unsigned i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        if (strcmp(text, lines[i]) == 0) {
            return true;
        }
    }
    return false;
}

/* Many lines without a pause: all are executed, in their order, whatever becomes of their echo. */
static void flood(void)
{
    forget_what_was_said();
    terminal_port_fake_hold(1);
    terminal_port_fake_press(fuzz_chance(&fuzz, 70));
    look(&before);
    session_t expected = session;
    unsigned motions = 0;
    bool known = true; /* all that was typed is such that the outcome is known */
    while (here.taken < here.length) {
        if (next_byte() == EDIT_ENDED) {
            reading_t reading;
            read_t kind = reference_read(editor.text, &expected, &reading);
            if ((kind == READ_MOTION || kind == READ_VALUE) && engine_check(&reading.command) != STATUS_OK) {
                kind = READ_REFUSED;
            }
            if (editor.damaged || editor.too_long || kind == READ_REFUSED) {
                /* nothing comes of it */
            } else if (kind == READ_OPEN || (kind == READ_OTHER && !is_harmless(editor.text))) {
                known = false;
            } else if (kind != READ_OTHER) {
                expected = reading.session;
                motions += kind == READ_MOTION;
            }
            editor_next(&editor);
            lines_done++;
        }
        if (fuzz_chance(&fuzz, 10)) {
            work_a_little();
        }
    }
    rest();
    unsigned error;
    (void)count_errors(&error);
    require(prompt_is_back(), "no prompt after a flood");
    check_pulses();
    check_ranges();
    look(&after);
    if (known && before.pending + motions <= QUEUE_LAST) {
        require(after.submitted - before.submitted + after.pending == before.pending + motions,
                "of a flood a command was lost or doubled");
        require(session.velocity == expected.velocity && session.accel == expected.accel &&
                    session.decel == expected.decel && session.flags == expected.flags,
                "a flood has not left the session that was typed");
    }
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
            printf("%" PRIu64 " lines, %" PRIu64 " ended, %" PRIu64 " taken without an error; seeds %" PRIu64
                   "..%" PRIu64 "; %.1f s, %.0f lines/s\n",
                   made, lines_done, lines_taken, first, here.seed, now - start, (double)made / (now - start));
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
