/* Power cuts on the whole image while it writes its EEPROM: what the unit is at the next power-up.
 *
 * A save is run once to its end. Then it is run again and again from the same EEPROM, and power is cut at another moment
 * each time: a tenth of the cuts within the first byte that is written, a tenth within the last one, the others evenly
 * over the save. The byte in which the cut falls is left as it was, erased, as it would have become, or as anything.
 * After each of them the unit is switched on with autorun configured and nobody at the terminal, and
 *   - the configuration, stored and in force, is the old or the new one, whole
 *   - the queue is the old or the new one, whole; or its snapshot is reported as damaged, and it holds system defaults
 *   - autorun makes the pulses, to the tick, that this configuration makes of this queue, or none where it is damaged
 *   - the next save goes well
 * What is right is not worked out here: it is what the unit does with the EEPROM of before and of after the save. The
 * settings and the snapshot are looked at apart, so that a save of both may leave any two of them.
 *
 * SAC_CUTS in the environment multiplies the cuts (make test-powercut: 10). */
#include "image.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "queue/queue.h"

enum {
    QUEUE_CELLS = 200, /* from here on is the snapshot */
    ENTRY_BYTES = 18,
    QUEUE_BYTES = QUEUE_LAST * ENTRY_BYTES,
    MOST_PULSES = 4000,
};
#define WRITE (3400 * US)  /* of a byte */
#define WINDOW (1050 * MS) /* by then autorun has begun */
#define AUTORUN (70 * MS)  /* more than a pass of the loop */
#define MOST_SAVE (5 * SECOND)

typedef uint8_t cells_t[BOARD_EEPROM_BYTES];

/* All that is seen of a unit that has been switched on. */
typedef struct {
    char stored[1000]; /* as $E lists it */
    uint8_t in_force[sizeof(settings_t)];
    uint8_t queue[QUEUE_BYTES];
    bool damaged;
    size_t pulses; /* of autorun */
    struct {
        uint32_t interval; /* to the one before */
        uint8_t dir;
    } pulse[MOST_PULSES];
} unit_t;

enum { OLD, NEW, NONE };
static unit_t unit, expected[2][3]; /* by configuration and queue */
static uint32_t noise;

void setUp(void)
{
    board = NULL;
    noise = 1;
}

void tearDown(void)
{
    image_off();
}

static uint32_t random_below(uint32_t limit)
{
    noise = noise * 1664525u + 1013904223u;
    return (noise >> 8) % limit;
}

static void boot_with(const uint8_t *cells)
{
    image_off();
    image_power_on_with(cells);
    image_prompt();
}

static uint16_t address_of(const char *symbol)
{
    uint16_t address = 0;
    TEST_ASSERT_TRUE_MESSAGE(board_symbol(board, symbol, &address), symbol);
    return address;
}

static bool stored(board_t *b, void *the_store)
{
    return board_peek8(b, *(uint16_t *)the_store) == 0; /* its jobs, which stand first */
}

static bool storing(board_t *b, void *the_store)
{
    return !stored(b, the_store);
}

static void until_stored(void)
{
    uint16_t the_store = address_of("the_store");
    TEST_ASSERT_EQUAL_MESSAGE(BOARD_MATCHED, board_run_until(board, stored, &the_store, MOST_SAVE), "a save has no end");
}

static void do_and_store(const char *line)
{
    image_do(line);
    until_stored();
}

/* From a power-on reset on, nobody at the terminal; then it is asked. */
static void look_at_the_unit(void)
{
    memset(&unit, 0, sizeof unit);
    image_load_settings();
    for (size_t i = 0; i < sizeof unit.in_force; i++)
        unit.in_force[i] = board_peek8(board, (uint16_t)(address_of("settings") + i));
    image_take_text();
    image_train_clear();
    image_run(WINDOW + AUTORUN);
    const char *text = image_take_text();
    const char *version_end = strchr(text, '\n');
    if (version_end == NULL)
        image_fail("no version line: \"%s\"", text);
    unit.damaged = strcmp(version_end + 1, "?16 snapshot damaged\r\nSAC>") == 0;
    if (!unit.damaged && strcmp(version_end + 1, "SAC>") != 0)
        image_fail("at power-on: \"%s\"", text);
    TEST_ASSERT_LESS_THAN_size_t(MOST_PULSES, train.count);
    unit.pulses = train.count;
    for (size_t i = 0; i < train.count; i++) {
        unit.pulse[i].interval = i > 0 ? (uint32_t)image_interval(i - 1) : 0;
        unit.pulse[i].dir = train.pulse[i].dir;
    }
    image_do("S");
    for (size_t i = 0; i < sizeof unit.queue; i++)
        unit.queue[i] = board_peek8(board, (uint16_t)(address_of("entries") + ENTRY_BYTES + i));
    snprintf(unit.stored, sizeof unit.stored, "%s", image_display("$E"));
    if (unit.damaged)
        image_refused("qr", "?16 snapshot damaged");
}

static bool same_pulses(const unit_t *a, const unit_t *b)
{
    const size_t both = a->pulses < b->pulses ? a->pulses : b->pulses;
    if (a->pulses + b->pulses > 2 * both + (both > 0)) /* one may fall to either side of the end */
        return false;
    for (size_t i = 0; i < both; i++)
        if (a->pulse[i].interval != b->pulse[i].interval || a->pulse[i].dir != b->pulse[i].dir)
            return false;
    return true;
}

static bool same_configuration(const unit_t *a, const unit_t *b)
{
    return strcmp(a->stored, b->stored) == 0 && memcmp(a->in_force, b->in_force, sizeof a->in_force) == 0;
}

static bool same_queue(const unit_t *a, const unit_t *b)
{
    return a->damaged == b->damaged && memcmp(a->queue, b->queue, sizeof a->queue) == 0;
}

/* -- the cuts ------------------------------------------------------------------------------------------------------ */

enum { NOT_TORN = 0xFFFF };
typedef enum { TORN_OLD, TORN_ERASED, TORN_NEW, TORN_RANDOM, TORN_KINDS } torn_t;

/* While a byte is written its address and value stay in the registers; a byte that is right already is not written.
 * Returns the address, NOT_TORN between two writes. */
static uint16_t cut_power(torn_t torn)
{
    enum { EEDR = 0x40, EEARL };
    const uint16_t address = board_peek16(board, EEARL) % BOARD_EEPROM_BYTES;
    const uint8_t before = board_eeprom(board)[address], after = board_peek8(board, EEDR);
    const uint8_t values[TORN_KINDS] = {before, 0xFF, after, (uint8_t)random_below(256)};
    board_eeprom_torn_byte(board, values[torn]);
    board_eeprom_cut_at(board, board_cycle(board) + 1);
    image_run(2);
    return before != after ? address : NOT_TORN;
}

/* Cut number i of so many: cycles from the beginning of the save. */
static uint64_t moment(unsigned i, unsigned cuts, uint64_t save)
{
    const unsigned tenth = cuts / 10;
    const uint64_t jitter = random_below(1000);
    if (i < tenth)
        return WRITE * (1000 * i + jitter) / (1000 * tenth);
    if (i < 2 * tenth)
        return save - WRITE * (1000 * (i - tenth) + jitter) / (1000 * tenth);
    return save * (1000 * (uint64_t)(i - 2 * tenth) + jitter) / (1000 * (uint64_t)(cuts - 2 * tenth));
}

typedef struct {
    const char *name;
    void (*prepare)(void); /* what is not saved yet; NULL: nothing */
    const char *line;      /* saves */
    unsigned cuts;
    bool changes_settings, changes_queue;
} save_t;

/* Up to where the save begins. */
static void begin(const save_t *save, const uint8_t *before)
{
    boot_with(before);
    image_do("S"); /* autorun may run */
    if (save->prepare != NULL)
        save->prepare();
    image_send(save->line);
    uint16_t the_store = address_of("the_store");
    TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_until(board, storing, &the_store, SECOND));
}

/* What the unit is with either configuration and either queue, or none. */
static void look_at_all(const uint8_t *before, const uint8_t *after)
{
    for (unsigned c = OLD; c <= NEW; c++) {
        for (unsigned q = OLD; q <= NONE; q++) {
            cells_t cells;
            memset(cells, 0xFF, sizeof cells);
            memcpy(cells, c == NEW ? after : before, QUEUE_CELLS);
            if (q != NONE)
                memcpy(cells + QUEUE_CELLS, (q == NEW ? after : before) + QUEUE_CELLS, sizeof cells - QUEUE_CELLS);
            image_off();
            image_power_on_with(cells);
            board_reset(board, BOARD_RESET_POWER_ON);
            look_at_the_unit();
            TEST_ASSERT_FALSE(unit.damaged);
            expected[c][q] = unit;
        }
    }
}

static void cut_at_all_moments(const save_t *save, const uint8_t *before)
{
    const char *const factor = getenv("SAC_CUTS");
    const unsigned cuts = save->cuts * (factor != NULL ? (unsigned)atoi(factor) : 1);
    static cells_t after, hit;
    begin(save, before);
    const uint64_t from = board_cycle(board);
    until_stored();
    const uint64_t lasts = board_cycle(board) - from;
    memcpy(after, board_eeprom(board), sizeof after);
    look_at_all(before, after);
    TEST_ASSERT_EQUAL(!save->changes_settings, same_configuration(&expected[OLD][OLD], &expected[NEW][NEW]));
    TEST_ASSERT_EQUAL(!save->changes_queue, same_queue(&expected[OLD][OLD], &expected[NEW][NEW]));
    for (unsigned c = OLD; c <= NEW; c++)
        TEST_ASSERT_EQUAL(0, expected[c][NONE].pulses);
    memset(hit, 0, sizeof hit);
    unsigned settings_found[2] = {0}, queue_found[3] = {0}, bytes = 0, between = 0;
    for (unsigned i = 0; i < cuts; i++) {
        begin(save, before);
        const uint64_t at = moment(i, cuts, lasts);
        const torn_t torn = (torn_t)(i % TORN_KINDS);
        image_run(at);
        const uint16_t address = cut_power(torn);
        between += address == NOT_TORN;
        if (address != NOT_TORN && !hit[address]) {
            hit[address] = 1;
            bytes++;
        }
        look_at_the_unit();
        char told[200];
        snprintf(told, sizeof told, "%s, cut %u at %llu us in byte %u, torn %u: ", save->name, i, (unsigned long long)(at / US), address, torn);
        unsigned c, q;
        for (c = OLD; c <= NEW && !same_configuration(&unit, &expected[c][OLD]); c++)
            ;
        if (c > NEW)
            image_fail("%sneither the old nor the new configuration: \"%s\"", told, unit.stored);
        for (q = OLD; q <= NEW && !same_queue(&unit, &expected[c][q]); q++)
            ;
        if (q == NONE && !unit.damaged)
            image_fail("%sneither the old nor the new queue, and no word of it", told);
        if (q == NONE && !save->changes_queue)
            image_fail("%sthe snapshot is damaged, and was not saved", told);
        if (q == NONE && memcmp(unit.queue, expected[c][NONE].queue, sizeof unit.queue) != 0)
            image_fail("%sa damaged snapshot has left something in the queue", told);
        if (!same_pulses(&unit, &expected[c][q]))
            image_fail("%sautorun made %zu pulses that are not those of configuration %u and queue %u", told,
                       unit.pulses, c, q);
        settings_found[c]++;
        queue_found[q]++;
        if (i % 15 == 0) {
            do_and_store("$Cc1234567");
            do_and_store("qs");
            image_assert_holds(image_display("$E"), "c 1234567\r\n");
            image_do("qr");
        }
    }
    printf("%s: %u cuts in %llu ms, in %u bytes, %u between two; settings old %u, new %u; queue old %u, new %u, reported as "
           "damaged %u\n",
           save->name, cuts, (unsigned long long)(lasts / MS), bytes, between, settings_found[OLD], settings_found[NEW],
           queue_found[OLD], queue_found[NEW], queue_found[NONE]);
    for (unsigned c = OLD; save->changes_settings && c <= NEW; c++)
        TEST_ASSERT_GREATER_THAN_UINT(0, settings_found[c]);
    for (unsigned q = OLD; save->changes_queue && q <= NONE; q++)
        TEST_ASSERT_GREATER_THAN_UINT(0, queue_found[q]);
}

/* -- what is saved ------------------------------------------------------------------------------------------------- */

/* A revolution has so few that a pass of 30 is short. */
static void few_steps(void)
{
    do_and_store("$Ca50");
    do_and_store("$CL255");
    image_do("$R");
}

static void old_queue(void)
{
    few_steps();
    image_do("v36000");
    image_do("a999");
    image_do("d999");
    image_do("qc");
    image_do("q2m-40");
    image_do("q30m70u8");
}

/* Other bytes in all entries. */
static void new_queue(void)
{
    image_do("vc31");
    image_do("a900");
    image_do("d999");
    image_do("qc");
    image_do("q2m60t500");
    image_do("q3m-30");
}

static const uint8_t *cells_after(void (*fill)(void))
{
    static cells_t cells;
    image_boot();
    fill();
    memcpy(cells, board_eeprom(board), sizeof cells);
    return cells;
}

/* Both copies of the settings are in use and differ; the next change is written to the one that was blank at first. */
static void second_copy_next(void)
{
    old_queue();
    do_and_store("qs");
    do_and_store("$CA30");
    do_and_store("$Cc1111111");
    do_and_store("$CA2");
    do_and_store("$Cc3333333");
}

static void first_copy_next(void)
{
    second_copy_next();
    do_and_store("$Cc5555555");
}

static void never_saved(void)
{
}

static void autorun_alone(void)
{
    few_steps();
    do_and_store("$CA30");
}

static void queue_and_autorun(void)
{
    old_queue();
    do_and_store("qs");
    do_and_store("$CA30");
    do_and_store("$Cc1111111");
}

/* Autorun of what was expected begins with so many pulses, below 0: counter-clockwise. */
static void assert_autorun(const unit_t *seen, const int *counts, size_t commands)
{
    size_t k = 0;
    for (size_t n = 0; n < commands; n++)
        for (int i = abs(counts[n]); i > 0; i--, k++)
            TEST_ASSERT_TRUE(k < seen->pulses && seen->pulse[k].dir == (counts[n] < 0));
}

static const int old_counts[] = {50, -40, 50}, new_counts[] = {50, 60, -30};
static const int two_old_counts[] = {50, -40, 50, -40, 50}, three_old_counts[] = {50, -40, 50, 50, -40};

/* CFG-007, BOO-008, BOO-010, AUT-004 */
static void test_a_power_cut_while_a_parameter_is_stored_leaves_the_old_or_the_new_configuration(void)
{
    const save_t save = {"parameter, second copy", NULL, "$CA3\r", 100, true, false};
    cut_at_all_moments(&save, cells_after(second_copy_next));
    assert_autorun(&expected[OLD][OLD], two_old_counts, 5);
    assert_autorun(&expected[NEW][OLD], three_old_counts, 5);
}

static void test_so_does_one_while_the_other_copy_is_written(void)
{
    const save_t save = {"parameter, first copy", NULL, "$CA3\r", 100, true, false};
    cut_at_all_moments(&save, cells_after(first_copy_next));
}

/* BOO-010 */
static void test_so_does_one_while_the_first_parameter_ever_is_stored(void)
{
    const save_t save = {"parameter, blank unit", NULL, "$CM99\r", 20, true, false};
    cut_at_all_moments(&save, cells_after(never_saved));
}

/* QUE-014, QUE-017, BOO-008, AUT-004 */
static void test_a_power_cut_while_the_queue_is_saved_leaves_the_old_or_the_new_one_or_is_reported(void)
{
    const save_t save = {"queue", new_queue, "qs\r", 200, false, true};
    cut_at_all_moments(&save, cells_after(queue_and_autorun));
    assert_autorun(&expected[OLD][OLD], old_counts, 3);
    assert_autorun(&expected[OLD][NEW], new_counts, 3);
}

static void test_so_does_one_while_the_first_queue_ever_is_saved(void)
{
    const save_t save = {"queue, none before", new_queue, "qs\r", 20, false, true};
    cut_at_all_moments(&save, cells_after(autorun_alone));
    TEST_ASSERT_EQUAL(0, expected[OLD][OLD].pulses);
    assert_autorun(&expected[OLD][NEW], new_counts, 3);
}

static void test_so_does_one_while_a_parameter_is_stored_in_the_middle_of_a_save(void)
{
    const save_t save = {"queue and parameter", new_queue, "qs\r$CA3\r", 40, true, true};
    cut_at_all_moments(&save, cells_after(queue_and_autorun));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_power_cut_while_a_parameter_is_stored_leaves_the_old_or_the_new_configuration);
    RUN_TEST(test_so_does_one_while_the_other_copy_is_written);
    RUN_TEST(test_so_does_one_while_the_first_parameter_ever_is_stored);
    RUN_TEST(test_a_power_cut_while_the_queue_is_saved_leaves_the_old_or_the_new_one_or_is_reported);
    RUN_TEST(test_so_does_one_while_the_first_queue_ever_is_saved);
    RUN_TEST(test_so_does_one_while_a_parameter_is_stored_in_the_middle_of_a_save);
    return UNITY_END();
}
