/* The image under damaged lines of all commands. After each of them:
 *   - the prompt is back, and nothing was reset
 *   - every value of settings, session and queue in RAM lies in its range; a refused line has changed none of them
 *   - the motor made the pulses of what was accepted: of a motion that was played to its end exactly its count, and in any
 *     case as many as `p` shows; what was accepted is stopped: continuous motion, loops, and what takes long
 * A restart with other settings, or with the same, ends the block.
 *
 * SAC_FUZZ_LINES in the environment sets how many lines (make fuzz-image-long: 10^5), SAC_FUZZ_SEED where they begin: each
 * block of lines starts at a power-on with the next seed, so a failure is repeated by the seed that it prints. */
#include "image.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/status.h"
#include "fuzz/grammar.h"
#include "fuzz/reference.h"
#include "queue/queue.h"
#include "version.h"

enum { BLOCK_LINES = 100, DEFAULT_LINES = 1000, MOST_LINES = 3 };

#define PATIENCE (150 * MS)  /* so long a motion may take before it is stopped */
#define ANSWER (10 * SECOND) /* the longest answer: five displays at 38,400 Bd */

static fuzz_t fuzz;
static editor_t editor;
static uint64_t seed;                                   /* of the block */
static unsigned line_number;                            /* in the block */
static uint8_t bytes[MOST_LINES * FUZZ_LINE_BYTES + 8]; /* the line or lines that are typed */
static unsigned length;
static unsigned motions_seen, motions_stopped, refused_lines, restarts;
static bool restarted; /* the block ends */

void setUp(void)
{
    board = NULL;
}

void tearDown(void)
{
    if (Unity.CurrentTestFailed) /* also where image.c found it */
        printf("\nline %u of the block: \"%s\"; again: SAC_FUZZ_SEED=%" PRIu64 " SAC_FUZZ_LINES=%u\n", line_number,
               fuzz_printable(bytes, length), seed, line_number);
    image_off();
}

static void fail(const char *format, ...) __attribute__((format(printf, 1, 2), __noreturn__));
static void fail(const char *format, ...)
{
    char what[300];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    image_fail("%s (SAC_FUZZ_SEED=%" PRIu64 " SAC_FUZZ_LINES=%u)", what, seed, line_number);
}

/* -- what stands in RAM ------------------------------------------------------------------------------------------------ */

typedef struct {
    session_t session;
    motion_command_t entries[QUEUE_POSITIONS];
    uint8_t array[QUEUE_ARRAY];
    uint8_t next, pending, mode;
    uint8_t eeprom[BOARD_EEPROM_BYTES]; /* where nothing is being written */
    bool idle;
} look_t;

static uint16_t address_of(const char *symbol)
{
    uint16_t address = 0;
    if (!board_symbol(board, symbol, &address))
        fail("the image has no symbol %s", symbol);
    return address;
}

/* The AVR's structs have no padding; their members stand in the same order. */
static motion_command_t peek_entry(uint16_t at)
{
    return (motion_command_t){.count = board_peek32(board, at),
                              .velocity = board_peek32(board, (uint16_t)(at + 4)),
                              .start_wait_us = board_peek32(board, (uint16_t)(at + 8)),
                              .accel = board_peek16(board, (uint16_t)(at + 12)),
                              .decel = board_peek16(board, (uint16_t)(at + 14)),
                              .extra_pulses = board_peek8(board, (uint16_t)(at + 16)),
                              .flags = board_peek8(board, (uint16_t)(at + 17))};
}

static look_t look(void)
{
    _Static_assert(sizeof(motion_command_t) == 18, "as on the AVR");
    enum { ENTRY_BYTES = 18 };
    look_t all;
    memset(&all, 0, sizeof all);
    const uint16_t entries = address_of("entries"), session_at = address_of("session");
    for (unsigned i = 0; i < QUEUE_POSITIONS; i++)
        all.entries[i] = peek_entry((uint16_t)(entries + i * ENTRY_BYTES));
    all.session.velocity = board_peek32(board, session_at);
    all.session.accel = board_peek16(board, (uint16_t)(session_at + 4));
    all.session.decel = board_peek16(board, (uint16_t)(session_at + 6));
    all.session.flags = board_peek8(board, (uint16_t)(session_at + 8));
    all.session.options = board_peek8(board, (uint16_t)(session_at + 9));
    enum { ARRAY_AT = 33 }; /* in struct queue, after two bytes that are looked at as well */
    const uint16_t queue = address_of("the_queue");
    for (unsigned i = 0; i < QUEUE_ARRAY; i++)
        all.array[i] = board_peek8(board, (uint16_t)(queue + ARRAY_AT + i));
    all.mode = image_peek("mode");
    all.idle = image_peek("the_store") == 0; /* its jobs, which stand first */
    if (all.idle)
        memcpy(all.eeprom, board_eeprom(board), sizeof all.eeprom);
    all.next = board_peek8(board, queue);
    all.pending = board_peek8(board, (uint16_t)(queue + 1));
    return all;
}

/* Period and pulse width fit, by the manual's arithmetic. */
static bool is_possible(uint32_t velocity, uint8_t flags)
{
    if (velocity == 0)
        return false;
    const uint32_t cycle_us = flags & MOTION_CYCLE ? velocity : 60000000u / settings.steps_per_rev / velocity;
    const uint32_t least_us = settings.pulse_us + 1u > 2 ? settings.pulse_us + 1u : 2;
    return cycle_us >= least_us << settings.ustep;
}

static bool is_ramp(accel_code_t code)
{
    return code >= 1 && code <= ACCEL_NONE;
}

static uint32_t peek_setting(size_t offset, size_t size)
{
    const uint16_t at = (uint16_t)(address_of("settings") + offset);
    return size == 4 ? board_peek32(board, at) : size == 2 ? board_peek16(board, at) : board_peek8(board, at);
}

#define SETTING(member) peek_setting(offsetof(settings_t, member), sizeof(((settings_t *)0)->member))

static void check_range(bool holds, const char *what)
{
    if (!holds)
        fail("out of its range: %s", what);
}

static void check_ranges(const look_t *all)
{
    check_range(SETTING(cycle_us) >= 1 && SETTING(hw_baud) >= 300 && SETTING(hw_baud) <= 2000000 &&
                    SETTING(steps_per_rev) >= 1 && SETTING(ramp) <= 1 && SETTING(cw_level) <= 1 &&
                    SETTING(direction) <= 1 && SETTING(ustep) <= 7 && SETTING(pulse_us) >= 1 &&
                    SETTING(slow_rpm) >= 1 && SETTING(full_step) <= 1,
                "a setting");
    check_range((all->session.flags & ~SESSION_FLAGS) == 0 && all->session.options <= 7 && is_ramp(all->session.accel) &&
                    is_ramp(all->session.decel) && is_possible(all->session.velocity, all->session.flags),
                "the session");
    check_range(all->mode <= MODE_CONFIGURE, "the mode");
    for (unsigned i = 0; i < QUEUE_ARRAY; i++)
        check_range(all->array[i] <= QUEUE_LAST, "an entry of the array");
    check_range(all->next >= QUEUE_FIRST && all->next <= QUEUE_LAST && all->pending <= QUEUE_LAST, "a position");
    for (unsigned i = 0; i < QUEUE_POSITIONS; i++) {
        const motion_command_t *entry = &all->entries[i];
        check_range(entry->flags < 1u << 5 && (entry->count >= 1 || i == QUEUE_CONTINUOUS) && is_ramp(entry->accel) && is_ramp(entry->decel) &&
                        is_possible(entry->velocity, entry->flags),
                    "an entry of the queue");
    }
}

/* -- the user ---------------------------------------------------------------------------------------------------------- */

/* Soft ops put their bytes anywhere. */
static bool ends_with_prompt(const char *text)
{
    enum { LAST = 6, OPS_BEGIN_BYTE = 0x11, OPS_END_BYTE = 0x12 };
    char last[LAST + 1] = "      ";
    unsigned count = 0;
    for (size_t at = strlen(text); at > 0 && count < LAST; at--)
        if (text[at - 1] != OPS_BEGIN_BYTE && text[at - 1] != OPS_END_BYTE)
            last[LAST - ++count] = text[at - 1];
    return strcmp(last, "\r\nSAC>") == 0 || strcmp(last + 2, "\r\nQ>") == 0 ||
                             strcmp(last + 2, "\r\nX>") == 0;
}

/* $R has brought other settings into force, or the same ones. */
static bool has_restarted(void)
{
    for (size_t i = 0; i < sizeof settings; i++)
        if (peek_setting(i, 1) != ((const uint8_t *)&settings)[i])
            return true;
    return false;
}

/* Until the prompt is back and nothing more is said for 3 ms. */
static const char *answer(void)
{
    const uint64_t end = board_cycle(board) + ANSWER;
    static const char version[] = "SAC " VERSION_NUMBER " ";
    size_t said = 0, said_before = 0;
    unsigned quiet = 0;
    while (quiet < 6) {
        image_run(MS / 2);
        (void)board_uart_received(board, &said);
        quiet = !board_uart_sending(board) && said == said_before && ends_with_prompt(board_uart_text(board))
                    ? quiet + 1
                    : 0;
        said_before = said;
        if (has_restarted()) { /* perhaps with another rate: what is said cannot be read */
            restarted = true;
            image_run(100 * MS);
            if (image_peek("cause") != STATUS_OK) /* it has loaded its settings as well */
                fail("the board was reset by its watchdog");
            return image_take_text();
        }
        if (board_cycle(board) <= end)
            continue;
        if (strstr(board_uart_text(board), version))
            fail("the board was reset, and no prompt");
        fail("no prompt; the last that was said: \"%.100s\"", board_uart_text(board) + (said > 100 ? said - 100 : 0));
    }
    const char *text = image_take_text();
    if (strstr(text, version))
        fail("the board was reset");
    return text;
}

/* How many errors are told, and whether each looks like one. */
static unsigned errors_in(const char *text)
{
    unsigned count = 0;
    for (; (text = strstr(text, "\n?")) != NULL; text++) {
        unsigned number = 0;
        char letter = 0;
        if (text[2] == '\t')
            continue; /* the help's own row */
        if (strncmp(text + 2, "9 no answer", 11) == 0)
            continue; /* to a line for another node, which may be some lines back */
        if (strncmp(text + 2, "12 range 0 or 36", 16) == 0) {
            count++;
            continue;
        }
        if (sscanf(text + 2, "%u %c", &number, &letter) != 2 || number == 0 || letter < 'a' || letter > 'z')
            fail("an answer that is no error: \"%.40s\"", text + 1);
        count++;
    }
    return count;
}

/* Types all of it. Returns how many lines it ended; pulses: how many + and - there were before the first end. */
static unsigned type_all(unsigned *pulses)
{
    unsigned ended = 0;
    *pulses = 0;
    board_uart_clear(board);
    for (unsigned i = 0; i < length; i++) {
        if (fuzz_chance(&fuzz, 3))
            board_uart_gap(board, fuzz_below(&fuzz, 3 * MS));
        if (bytes[i] == 0xFF)
            board_uart_send_bad(board, (uint8_t)fuzz_u32(&fuzz));
        else
            board_uart_send(board, &bytes[i], 1);
        if (ended > 0 && i + 1 < length)
            continue; /* several lines: only the first one is followed */
        const edit_t edit = editor_take(&editor, bytes[i]);
        ended += edit == EDIT_ENDED;
        *pulses += edit == EDIT_PULSE_CW || edit == EDIT_PULSE_CCW;
    }
    return ended;
}

/* The pulses of a command, its extra ones apart. */
static uint64_t pulses_of(const motion_command_t *command)
{
    return command->flags & MOTION_PULSES ? command->count : (uint64_t)command->count << settings.ustep;
}

static void check_position(void)
{
    unsigned faults;
    const int32_t shown = image_position_and_faults(&faults);
    if (shown != train.position)
        fail("%" PRIi64 " pulses were seen, p shows %" PRIi32 " (faults %u)", train.position, shown, faults);
}

/* -- one line ---------------------------------------------------------------------------------------------------------- */

static void make_lines(void)
{
    const unsigned lines = fuzz_chance(&fuzz, 20) ? 2 + fuzz_below(&fuzz, MOST_LINES - 1) : 1;
    length = 0;
    for (unsigned i = 0; i < lines; i++) {
        fuzz_line_t line;
        fuzz.mode = image_peek("mode");
        fuzz_line(&fuzz, &line);
        memcpy(bytes + length, line.bytes, line.length);
        length += line.length;
        bytes[length++] = '\r';
    }
}

static bool is_single(void)
{
    for (unsigned i = 0; i + 1 < length; i++)
        if (bytes[i] == '\r' || bytes[i] == '\n')
            return false;
    return true;
}

/* A line with the unit's own address is executed here. */
static const char *behind_own_address(const char *line)
{
    char *behind;
    if (line[0] < '0' || line[0] > '9')
        return line;
    return strtoul(line, &behind, 10) == settings.device_id ? behind : line;
}

static bool same_look(const look_t *a, const look_t *b)
{
    return memcmp(&a->session, &b->session, sizeof a->session) == 0 &&
           memcmp(a->entries, b->entries, sizeof a->entries) == 0 && memcmp(a->array, b->array, sizeof a->array) == 0 &&
           a->next == b->next && a->pending == b->pending && a->mode == b->mode &&
           (!a->idle || !b->idle || memcmp(a->eeprom, b->eeprom, sizeof a->eeprom) == 0);
}

static void one_turn(void)
{
    line_number++;
    make_lines();
    if (getenv("SAC_FUZZ_TELL") != NULL)
        printf("%u \"%s\" at %" PRIu64 " us\n", line_number, fuzz_printable(bytes, length), board_cycle(board) / 16);
    const bool single = is_single();
    const look_t before = look();
    const size_t made_before = train.count;
    unsigned typed_pulses;
    memset(&editor, 0, sizeof editor);
    editor.in_mode = before.mode != MODE_COMMANDS;
    (void)type_all(&typed_pulses);
    const unsigned errors = errors_in(answer());
    if (restarted) {
        restarts++;
        return;
    }
    bool stopped = !image_idles(PATIENCE);
    const look_t played = look();
    if (stopped || errors == 0 || !single) { /* also what is held, and a loop */
        image_send(stopped || played.mode != MODE_COMMANDS ? "S\r" : "S\rl\r");
        (void)answer();
        if (!image_idles(100 * MS))
            fail("the motor does not stop");
    }
    look_t after = look();
    check_ranges(&after);
    const size_t made = train.count - made_before;
    if (single) {
        reading_t reading;
        const bool broken = editor.damaged || editor.too_long;
        const char *const text = before.mode == MODE_COMMANDS ? behind_own_address(editor.text) : editor.text;
        read_t kind = broken ? READ_REFUSED
                      : before.mode != MODE_COMMANDS ? READ_OTHER
                                                     : reference_read(text, &before.session, &reading);
        if ((kind == READ_MOTION || kind == READ_VALUE || kind == READ_OPEN) &&
            !is_possible(reading.command.velocity, reading.command.flags))
            kind = READ_REFUSED;
        if (errors > 1)
            fail("%u errors for one line", errors);
        if (kind == READ_MOTION && pulses_of(&reading.command) >> 31)
            kind = READ_OPEN; /* more pulses than there are numbers: refused or not */
        if (errors == 0 && kind == READ_REFUSED)
            fail("a wrong line was taken");
        if (errors > 0 && kind >= READ_MOTION)
            fail("a right line was refused");
        if (errors > 0 && !same_look(&before, &after))
            fail("a refused line has changed session, queue, array, mode or what is stored");
        refused_lines += errors;
        uint64_t least = 0, most = 0;
        if (errors == 0 && kind == READ_MOTION) {
            least = pulses_of(&reading.command);
            most = least + reading.command.extra_pulses; /* dropped where it is truncated */
            motions_seen++;
            motions_stopped += stopped;
            least = stopped || (reading.command.flags & MOTION_SYNC) ? 0 : least;
            if (memcmp(&after.entries[before.next], &reading.command, sizeof reading.command) != 0)
                fail("the entry is not what was typed");
        } else if (kind == READ_OPEN || (before.mode == MODE_COMMANDS && strchr("xXlL", text[0]) != NULL)) {
            most = errors ? 0 : UINT32_MAX;
        }
        /* The first + or - comes while the motor stands. */
        least += typed_pulses > 0;
        most += typed_pulses + (text != editor.text && (text[0] == '+' || text[0] == '-'));
        if (made < least || made > most)
            fail("%zu pulses, expected %" PRIu64 " to %" PRIu64, made, least, most);
    }
    if ((made > 0 || !single) && after.mode == MODE_COMMANDS)
        check_position();
}

static uint64_t asked_for(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text != NULL && *text != '\0' ? strtoull(text, NULL, 10) : otherwise;
}

static void boot(void)
{
    static settings_t factory;
    static bool known;
    if (!known) {
        factory = settings;
        known = true;
    }
    settings = factory;
    image_off();
    image_power_on();
    settings.ustep = (uint8_t)fuzz_below(&fuzz, 3);
    settings.hw_baud = fuzz_chance(&fuzz, 50) ? 38400 : 115200;
    settings.ramp = (uint8_t)fuzz_below(&fuzz, 2);
    IMAGE_SET(ustep, settings.ustep);
    IMAGE_SET(hw_baud, settings.hw_baud);
    IMAGE_SET(ramp, settings.ramp);
    board_uart_baud(board, settings.hw_baud);
    image_prompt();
    train.keep = false;
    restarted = false;
    for (size_t i = 0; i < sizeof settings; i++)
        ((uint8_t *)&settings)[i] = (uint8_t)peek_setting(i, 1);
}

/* All seeds of this run, one block after the other. */
static void test_no_damaged_line_loses_the_prompt_resets_or_makes_a_pulse_of_its_own(void)
{
    const uint64_t lines = asked_for("SAC_FUZZ_LINES", DEFAULT_LINES);
    const uint64_t first = asked_for("SAC_FUZZ_SEED", 1);
    const time_t start = time(NULL);
    time_t told = start;
    uint64_t made = 0;
    for (seed = first; made < lines; seed++) {
        fuzz_begin(&fuzz, seed);
        fuzz.brisk = true;
        line_number = 0;
        boot();
        while (line_number < BLOCK_LINES && made + line_number < lines && !restarted)
            one_turn();
        if (!restarted) {
            image_send("x\r"); /* leaves the mode, if any */
            (void)answer();
            check_position();
        }
        if (board_uart_overruns(board) != 0)
            fail("%u bytes were lost", board_uart_overruns(board));
        made += line_number;
        if (time(NULL) - told > 10 || made >= lines) {
            told = time(NULL);
            printf("%" PRIu64 " lines, %u motions (%u of them stopped), %u refused, %u restarts; seeds %" PRIu64 "..%" PRIu64
                   "; %ld s\n",
                   made, motions_seen, motions_stopped, refused_lines, restarts, first, seed, (long)(told - start));
            fflush(stdout);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_damaged_line_loses_the_prompt_resets_or_makes_a_pulse_of_its_own);
    return UNITY_END();
}
