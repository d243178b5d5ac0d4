/* cli/configure: the screen, the values that are typed, the list of $E. */
#include "cli/configure.h"
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include "cli/commands.h"
#include "cli/range.h"
#include "cli/display.h"
#include "eeprom/store.h"
#include "host/fakes/eeprom_port_fake.h"
#include "host/fakes/engine_fake.h"
#include "host/fakes/terminal_port_fake.h"
#include "queue/queue.h"
#include "queue/session.h"
#include "settings.h"
#include "unity.h"

void setUp(void)
{
    terminal_port_fake_reset();
    engine_fake_reset();
    eeprom_fake_reset();
    store_load_settings();
    commands_init();
    queue_init();
    display_init();
}

void tearDown(void)
{
    settings_to_factory();
}

/* There a line is an entry of the screen: a number alone is no parameter; elsewhere it is an address. */
static bool in_configure_mode(void)
{
    return commands_execute("9", 1) == STATUS_UNKNOWN_COMMAND;
}

static void finish(void)
{
    while (store_poll()) {
    }
}

static status_t execute(const char *line)
{
    finish();
    const status_t status = commands_execute(line, (uint8_t)strlen(line));
    finish();
    return status;
}

static void assert_done(const char *line)
{
    TEST_ASSERT_EQUAL_MESSAGE(STATUS_OK, execute(line), line);
}

static const char *finish_displays(void)
{
    terminal_port_fake_clear();
    while (display_poll()) {
    }
    TEST_ASSERT_FALSE(display_active());
    return terminal_port_fake_text();
}

/* What the command prints. */
static const char *shown(const char *line)
{
    assert_done(line);
    return finish_displays();
}

/* The settings as the next reset finds them. */
static const settings_t *stored(void)
{
    finish();
    store_load_settings();
    return &settings;
}

/* The line is refused and leaves the EEPROM as it is. */
static void assert_refused(status_t expected, const char *range, const char *line)
{
    finish();
    const unsigned written = eeprom_fake.written;
    TEST_ASSERT_EQUAL_MESSAGE(expected, execute(line), line);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(written, eeprom_fake.written, line);
    if (expected == STATUS_RANGE) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE(range, range_text(range_refused()), line);
    }
}

/* -- the screen ------------------------------------------------------------------------------------------------------- */

static const char factory_screen[] = "Config:\r\n"
                                     "A autorun\t0\ta sprf\t\t200\r\n"
                                     "B ramp\t\t0\tb cycle\t\t3000\r\n"
                                     "C clock\t\t1\tc xfreq\t\t1000000\r\n"
                                     "D\t\t\td acc\t\t1.00\r\n"
                                     "E network\t0\te dec\t\t1.00\r\n"
                                     "F cw\t\t0\tf l_acc\t\t10.47\r\n"
                                     "G dir\t\tCW\tg l_dec\t\t10.47\r\n"
                                     "H ihd\t\t0\th ops\t\t100100\r\n"
                                     "I xclk\t\t0\ti soft_ops\t0\r\n"
                                     "J ustep\t\t0\tj ACK\t\t1\r\n"
                                     "K pulse\t\t2\tk CRC\t\t1\r\n"
                                     "L slow\t\t10\r\n"
                                     "M d_id\t\t85\tm hw\t\t38400\r\n"
                                     "N r_id\t\t0\tn sw\t\t38400\r\n";

/* CFG-001, CFG-016, CFG-018, CFG-019, CFG-032, CFG-040, OPS-002 */
static void test_the_screen_is_that_of_the_annex(void)
{
    TEST_ASSERT_EQUAL_STRING(factory_screen, shown("$C"));
}

static void test_small_c_opens_it_as_well_and_cc_shows_it_without_entering_the_mode(void)
{
    TEST_ASSERT_EQUAL_STRING(factory_screen, shown("cc"));
    TEST_ASSERT_FALSE(in_configure_mode());
    TEST_ASSERT_EQUAL_STRING(factory_screen, shown("CC"));
    TEST_ASSERT_EQUAL_STRING(factory_screen, shown("$c"));
    TEST_ASSERT_TRUE(in_configure_mode());
}

/* CFG-001, CFG-002: the manual's own screen, its columns at 0, 16, 24 and 40 */
static void test_the_manuals_screen_has_its_columns(void)
{
    static const char *const lines[] = {"$CA14", "$CH8", "$CJ1", "$CK30"};
    for (unsigned i = 0; i < 4; i++) {
        assert_done(lines[i]);
    }
    static const char *const manual[] = {
        "Config:",
        "A autorun       14      a sprf          200",
        "B ramp          0       b cycle         3000",
        "C clock         1       c xfreq         1000000",
        "D                       d acc           1.00",
        "E network       0       e dec           1.00",
        "F cw            0       f l_acc         10.47",
        "G dir           CW      g l_dec         10.47",
        "H ihd           8       h ops           100100",
        "I xclk          0       i soft_ops      0",
        "J ustep         1       j ACK           1",
        "K pulse         30      k CRC           1",
        "L slow          10",
        "M d_id          85      m hw            38400",
        "N r_id          0       n sw            38400",
    };
    const char *text = shown("cc");
    for (unsigned i = 0; i < 15; i++) {
        char row[100];
        int column = 0;
        for (; *text != '\r'; text++) {
            do {
                row[column++] = *text == '\t' ? ' ' : *text;
            } while (*text == '\t' && column % 8 != 0);
        }
        row[column] = '\0';
        text += 2;
        TEST_ASSERT_EQUAL_STRING(manual[i], row);
    }
    TEST_ASSERT_EQUAL_STRING("", text);
}

/* CFG-016, CFG-019, CFG-032 */
static void test_the_rarer_values_are_shown_as_they_are(void)
{
    static const char *const lines[] = {"$CD1", "$CG1",  "$Ch0", "$Cd.01", "$Ce99.99", "$Cf100",
                                        "$Cg999", "$Cb4294967295", "$Cc6400000", "$Cm2000000", "$CA30"};
    for (unsigned i = 0; i < sizeof lines / sizeof *lines; i++) {
        assert_done(lines[i]);
    }
    const char *text = shown("cc");
    static const char *const parts[] = {"\nD\t\t1\td acc\t\t0.01\r",  "e dec\t\t99.99\r", "f l_acc\t\t100\r",
                                        "\nG dir\t\tCCW\tg l_dec\t\t999\r", "h ops\t\t0\r",     "A autorun\t30\ta",
                                        "b cycle\t\t4294967295\r",    "c xfreq\t\t6400000\r", "m hw\t\t2000000\r"};
    for (unsigned i = 0; i < sizeof parts / sizeof *parts; i++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, parts[i]), parts[i]);
    }
}

/* Piece by piece: with little room nothing is put (the fake port asserts it), and nothing is lost. */
static void test_the_screen_waits_for_the_port_and_for_what_is_being_stored(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, commands_execute("$CK30", 5));
    TEST_ASSERT_EQUAL(STATUS_OK, commands_execute("cc", 2));
    terminal_port_fake_clear();
    TEST_ASSERT_TRUE(display_poll()); /* no prompt meanwhile */
    TEST_ASSERT_EQUAL_STRING("", terminal_port_fake_text());
    finish();
    terminal_port_fake_hold(1);
    for (int i = 0; display_active(); i++) {
        TEST_ASSERT_LESS_THAN_INT(2000, i);
        display_poll();
        terminal_port_fake_drain(1);
    }
    char expected[sizeof factory_screen + 10];
    const size_t before = (size_t)(strstr(factory_screen, "K pulse\t\t2") - factory_screen) + 9;
    sprintf(expected, "%.*s30%s", (int)before, factory_screen, factory_screen + before + 1);
    TEST_ASSERT_EQUAL_STRING(expected, terminal_port_fake_text());
}

/* -- $C<letter><value> ------------------------------------------------------------------------------------------------ */

/* CFG-006, CFG-007, CFG-008, CFG-012, AUT-005 */
static void test_a_value_is_stored_at_once_and_effective_at_the_next_reset(void)
{
    assert_done("$CA8");
    TEST_ASSERT_FALSE(in_configure_mode());
    TEST_ASSERT_FALSE(display_active()); /* no screen */
    assert_done("$Cd1.25");
    assert_done("$Cc2000000 and a remark");
    TEST_ASSERT_EQUAL_UINT8(0, settings.autorun);
    TEST_ASSERT_EQUAL_UINT8(8, stored()->autorun);
    TEST_ASSERT_EQUAL_UINT16(125, settings.accel[0]);
    TEST_ASSERT_EQUAL_UINT32(2000000, settings.xclk_hz);
}

/* CFG-003: letters of either case, each its own parameter */
static void test_each_letter_sets_its_parameter_and_no_other(void)
{
    static const struct {
        const char *line;
        size_t offset, bytes;
        uint32_t value;
    } cases[] = {
#define CASE(line, member, value) {line, offsetof(settings_t, member), sizeof settings.member, value}
        CASE("$CA8", autorun, 8),          CASE("$CB1", ramp, 1),
        CASE("$CC0", internal_clock, 0),   CASE("$CD1", auto_microstep, 1),
        CASE("$CE1", network, 1),          CASE("$CF1", cw_level, 1),
        CASE("$CG1", direction, 1),        CASE("$CH255", ihd_counts, 255),
        CASE("$CI7", xclk_counts, 7),      CASE("$CJ7", ustep, 7),
        CASE("$CK30", pulse_us, 30),       CASE("$CL12", slow_rpm, 12),
        CASE("$CM86", device_id, 86),      CASE("$CN2", driver_id, 2),
        CASE("$Ca400", steps_per_rev, 400), CASE("$Cb123456789", cycle_us, 123456789),
        CASE("$Cc2000000", xclk_hz, 2000000), CASE("$Cd2.5", accel[0], 250),
        CASE("$Ce3", decel[0], 300),       CASE("$Cf12.34", accel[1], 1234),
        CASE("$Cg999", decel[1], ACCEL_NONE), CASE("$Ch0", ops_mask, 0),
        CASE("$Ci1", soft_ops, 1),         CASE("$Cj0", acknowledge, 0),
        CASE("$Ck2", crc_mode, 2),         CASE("$Cm250000", hw_baud, 250000),
        CASE("$Cn9600", sw_baud, 9600),    CASE("$Cu0", full_step, 0),
        CASE("$CU21", driver_map[2], 1),   CASE("$CU70", driver_map[7], 0),
    };
    for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
        eeprom_fake_reset();
        store_load_settings();
        settings_t expected = settings;
        memcpy((char *)&expected + cases[i].offset, &cases[i].value, cases[i].bytes);
        assert_done(cases[i].line);
        stored();
        TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(&expected, &settings, sizeof settings, cases[i].line);
    }
}

/* CFG-009 */
static void test_flags_store_anything_but_zero_as_one(void)
{
    static const char letters[] = "BCDEFGiju";
    for (const char *letter = letters; *letter != '\0'; letter++) {
        char line[20];
        sprintf(line, "$C%c0", *letter);
        assert_done(line);
        const settings_t clear = *stored();
        sprintf(line, "$C%c5", *letter);
        assert_done(line);
        const settings_t five = *stored();
        sprintf(line, "$C%c1", *letter);
        assert_done(line);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(&five, stored(), sizeof settings);
        TEST_ASSERT_TRUE(memcmp(&clear, &five, sizeof five) != 0);
        sprintf(line, "$C%c4294967295", *letter);
        assert_done(line);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(&five, stored(), sizeof settings);
    }
    assert_done("$CE5");
    TEST_ASSERT_EQUAL_UINT8(1, stored()->network);
}

/* AUT-003, CFG-013 */
static void test_autorun_is_pared_back_to_the_length_of_the_queue(void)
{
    assert_done("$CA99");
    TEST_ASSERT_EQUAL_UINT8(30, stored()->autorun);
    assert_done("$CA31");
    TEST_ASSERT_EQUAL_UINT8(30, stored()->autorun);
    assert_done("$CA29");
    TEST_ASSERT_EQUAL_UINT8(29, stored()->autorun);
}

/* CFG-020..CFG-030, CFG-035..CFG-037: what replaces CFG-010 (nothing is taken modulo) */
static void test_what_is_out_of_range_is_refused_and_its_range_told(void)
{
    static const struct {
        char letter;
        const char *range, *taken[6], *refused[6];
    } cases[] = {
        {'H', "0..255", {"0", "255"}, {"256", "300", "4294967295"}},
        {'I', "0..255", {"0", "255"}, {"256"}},
        {'J', "0..7", {"0", "7"}, {"8", "16", "256"}},
        {'K', "1..255", {"1", "255"}, {"0", "256", "300"}},
        {'L', "1..255", {"1", "255"}, {"0", "256"}},
        {'M', "4..255", {"4", "255", "004"}, {"0", "1", "2", "3", "256"}},
        {'N', "0..2", {"0", "2"}, {"3", "256"}},
        {'k', "0..2", {"0", "1", "2"}, {"3", "257"}},
        {'a', "1..65535", {"1", "65535"}, {"0", "65536"}},
        {'b', "2..4294967295", {"2", "4294967295"}, {"0", "1"}},
        {'c', "400000..6400000", {"400000", "6400000"}, {"0", "1", "6784", "399999", "6400001", "4294967295"}},
        {'d', "0.01..999", {".01", "99.99", "100", "999", "0.5", "5."}, {"0", "0.00", "1000", "100.5", "4294967295", "."}},
        {'g', "0.01..999", {"00.01", "10.47", "999"}, {"999.01", "100.00", "4294957396", "42949672.95", "4294967295.", "."}},
        {'h', "0 or 36", {"0", "36"}, {"1", "35", "37", "4", "32", "292"}},
        {'m', "300..2000000", {"300", "57600", "2000000"}, {"0", "299", "2000001"}},
        {'n', "300..38400", {"300", "38400"}, {"0", "299", "38401", "65536"}},
    };
    for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
        for (unsigned k = 0; k < 6; k++) {
            char line[40];
            if (cases[i].taken[k] != NULL) {
                sprintf(line, "$C%c%s", cases[i].letter, cases[i].taken[k]);
                assert_done(line);
            }
            if (cases[i].refused[k] != NULL) {
                sprintf(line, "$C%c%s", cases[i].letter, cases[i].refused[k]);
                assert_refused(STATUS_RANGE, cases[i].range, line);
            }
        }
    }
}

static void test_what_is_no_entry_is_refused(void)
{
    assert_refused(STATUS_UNKNOWN_COMMAND, NULL, "$Cl5");
    assert_refused(STATUS_UNKNOWN_COMMAND, NULL, "$CO5");
    assert_refused(STATUS_UNKNOWN_COMMAND, NULL, "$C5");
    assert_refused(STATUS_UNKNOWN_COMMAND, NULL, "$C?");
    assert_refused(STATUS_NUMBER_MISSING, NULL, "$CA");
    assert_refused(STATUS_NUMBER_MISSING, NULL, "$CA 8");
    assert_refused(STATUS_NUMBER_MISSING, NULL, "$Cd");
    assert_refused(STATUS_SYNTAX, NULL, "$CA8x");
    assert_refused(STATUS_SYNTAX, NULL, "$CA-8");
    assert_refused(STATUS_SYNTAX, NULL, "$CA8.0");
    assert_refused(STATUS_SYNTAX, NULL, "$Cd1.2.5");
    assert_refused(STATUS_SYNTAX, NULL, "$Cd1.255"); /* two places, all that is kept */
    assert_refused(STATUS_SYNTAX, NULL, "$Cd-1");
    assert_refused(STATUS_SYNTAX, NULL, "$CGCCW");
    assert_refused(STATUS_NUMBER_TOO_LARGE, NULL, "$CE4294967296");
    assert_refused(STATUS_NUMBER_TOO_LARGE, NULL, "$CA99999999999");
    assert_refused(STATUS_RANGE, "0..7", "$CU81");
    assert_refused(STATUS_RANGE, "0..7", "$CU28");
    assert_refused(STATUS_RANGE, "0..7", "$CU211");
    assert_refused(STATUS_RANGE, "0..7", "$CU");
    assert_refused(STATUS_NUMBER_MISSING, NULL, "$CU2");
}

/* CFG-039, MIC-007 */
static void test_the_drivers_map_is_set_entry_by_entry(void)
{
    assert_done("$CU21");
    assert_done("$CU57");
    const uint8_t expected[] = {0, 1, 1, 3, 4, 7, 6, 7};
    TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, stored()->driver_map, 8);
}

static void test_a_value_waits_for_the_one_before_it(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, commands_execute("$CA8", 4));
    TEST_ASSERT_EQUAL(STATUS_WAIT, commands_execute("$CB1", 4));
    TEST_ASSERT_EQUAL(STATUS_RANGE, commands_execute("$CJ8", 4)); /* what is wrong is said at once */
    finish();
    TEST_ASSERT_EQUAL(STATUS_OK, commands_execute("$CB1", 4));
    TEST_ASSERT_EQUAL_UINT8(1, stored()->ramp);
    TEST_ASSERT_EQUAL_UINT8(8, settings.autorun);
}

/* SYS-002 */
static void test_configuring_ends_all_activity(void)
{
    engine_fake.stops = 0;
    assert_done("$CA8");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops);
    assert_done("$E");
    TEST_ASSERT_EQUAL_UINT(2, engine_fake.stops);
    assert_done("cc");
    TEST_ASSERT_EQUAL_UINT(2, engine_fake.stops);
}

/* -- configure mode --------------------------------------------------------------------------------------------------- */

/* CFG-003, CFG-004, CFG-005 */
static void test_in_the_screen_a_letter_and_a_value_set_a_parameter_and_show_it_anew_until_x(void)
{
    shown("$C");
    const char *text = shown("A8");
    TEST_ASSERT_EQUAL_STRING_LEN("Config:\r\nA autorun\t8\ta sprf", text, 26);
    TEST_ASSERT_NOT_NULL(strstr(shown("a400"), "a sprf\t\t400\r\n"));
    TEST_ASSERT_NOT_NULL(strstr(shown("m250000"), "m hw\t\t250000\r\n"));
    TEST_ASSERT_NOT_NULL(strstr(shown("d2.5"), "d acc\t\t2.50\r\n"));
    TEST_ASSERT_NOT_NULL(strstr(shown("U21"), "n sw\t\t38400\r\n"));
    TEST_ASSERT_TRUE(in_configure_mode());
    TEST_ASSERT_EQUAL_STRING("", shown("x"));
    TEST_ASSERT_FALSE(in_configure_mode());
    assert_done("m25");
    TEST_ASSERT_EQUAL_UINT32(25, queue_entry(1)->count);
    assert_done("$C");
    assert_done("X");
    TEST_ASSERT_FALSE(in_configure_mode());
    TEST_ASSERT_EQUAL_UINT16(400, stored()->steps_per_rev);
    TEST_ASSERT_EQUAL_UINT32(250000, settings.hw_baud);
    TEST_ASSERT_EQUAL_UINT16(250, settings.accel[0]);
    TEST_ASSERT_EQUAL_UINT8(1, settings.driver_map[2]);
}

static void test_in_the_screen_nothing_else_acts_but_s(void)
{
    static const char *const lines[] = {"m200z", "v", "q", "s", "$R", "$CA8", "n", "g", "cc", "?", "xx", "SS", "x1"};
    shown("$C");
    const session_t before = session;
    engine_fake.stops = 0;
    for (unsigned i = 0; i < sizeof lines / sizeof *lines; i++) {
        commands_read_ahead(lines[i], (uint8_t)strlen(lines[i]));
        TEST_ASSERT_TRUE_MESSAGE(execute(lines[i]) != STATUS_OK, lines[i]);
    }
    TEST_ASSERT_FALSE(commands_at_once('+'));
    TEST_ASSERT_FALSE(commands_at_once('-'));
    assert_done(" ");
    TEST_ASSERT_EQUAL_MEMORY(&before, &session, sizeof session);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.submitted_count);
    TEST_ASSERT_EQUAL_UINT(0, engine_fake.stops);
    TEST_ASSERT_EQUAL_UINT(0, eeprom_fake.written);
    TEST_ASSERT_FALSE(display_active());
    assert_done("S");
    TEST_ASSERT_EQUAL_UINT(1, engine_fake.stops);
    TEST_ASSERT_TRUE(in_configure_mode());
    commands_init();
    TEST_ASSERT_FALSE(in_configure_mode());
}

/* -- $E --------------------------------------------------------------------------------------------------------------- */

static const char factory_list[] =
    "A 0\r\nB 0\r\nC 1\r\nD 0\r\nE 0\r\nF 0\r\nG CW\r\nH 0\r\nI 0\r\nJ 0\r\nK 2\r\nL 10\r\nM 85\r\nN 0\r\n"
    "U 01234567\r\n"
    "a 200\r\nb 3000\r\nc 1000000\r\nd 1.00\r\ne 1.00\r\nf 10.47\r\ng 10.47\r\nh 100100\r\ni 0\r\nj 1\r\nk 1\r\n"
    "m 38400\r\nn 38400\r\nu 1\r\n";

/* SYS-004, CFG-038 */
static void test_the_list_has_every_parameter_with_its_letter(void)
{
    TEST_ASSERT_EQUAL_STRING(factory_list, shown("$E"));
    assert_done("$CU21");
    assert_done("$Cu0");
    const char *text = shown("$E");
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\nU 01134567\r\n"));
    TEST_ASSERT_NOT_NULL(strstr(text, "\r\nu 0\r\n"));
}

/* SYS-004, TRM-010 */
static void test_in_debug_mode_the_list_is_followed_by_all_bytes(void)
{
    static char expected[8000];
    strcpy(expected, factory_list);
    char *end = expected + strlen(expected);
    for (unsigned i = 0; i < EEPROM_BYTES; i++) {
        eeprom_fake.cells[i] = (unsigned char)(i * 7 + i / 256);
        end += sprintf(end, i % 16 == 15 ? "%02X\r\n" : "%02X ", eeprom_fake.cells[i]);
    }
    assert_done("b");
    TEST_ASSERT_EQUAL_STRING(expected, shown("$E"));
    TEST_ASSERT_EQUAL_STRING(factory_screen, shown("cc"));
    assert_done("b");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_screen_is_that_of_the_annex);
    RUN_TEST(test_small_c_opens_it_as_well_and_cc_shows_it_without_entering_the_mode);
    RUN_TEST(test_the_manuals_screen_has_its_columns);
    RUN_TEST(test_the_rarer_values_are_shown_as_they_are);
    RUN_TEST(test_the_screen_waits_for_the_port_and_for_what_is_being_stored);
    RUN_TEST(test_a_value_is_stored_at_once_and_effective_at_the_next_reset);
    RUN_TEST(test_each_letter_sets_its_parameter_and_no_other);
    RUN_TEST(test_flags_store_anything_but_zero_as_one);
    RUN_TEST(test_autorun_is_pared_back_to_the_length_of_the_queue);
    RUN_TEST(test_what_is_out_of_range_is_refused_and_its_range_told);
    RUN_TEST(test_what_is_no_entry_is_refused);
    RUN_TEST(test_the_drivers_map_is_set_entry_by_entry);
    RUN_TEST(test_a_value_waits_for_the_one_before_it);
    RUN_TEST(test_configuring_ends_all_activity);
    RUN_TEST(test_in_the_screen_a_letter_and_a_value_set_a_parameter_and_show_it_anew_until_x);
    RUN_TEST(test_in_the_screen_nothing_else_acts_but_s);
    RUN_TEST(test_the_list_has_every_parameter_with_its_letter);
    RUN_TEST(test_in_debug_mode_the_list_is_followed_by_all_bytes);
    return UNITY_END();
}
