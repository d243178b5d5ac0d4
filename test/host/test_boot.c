/* boot: what follows each cause of a reset, and what restores the factory settings. */
#include "boot.h"
#include "boot_port.h"
#include "cli/terminal_port.h"
#include "host/fakes/terminal_port_fake.h"
#include "host/fakes/timebase_port_fake.h"
#include "unity.h"

enum { POWER_ON = 1, EXTERNAL = 2, BROWN_OUT = 4, WATCHDOG = 8 }; /* MCUSR, datasheet 11.9.1 */

uint8_t boot_port_flags;
static bool rst_low;
static unsigned restored, started;

bool boot_port_rst_low(void)
{
    return rst_low;
}

void boot_restore_factory(void)
{
    TEST_ASSERT_EQUAL_UINT(0, started);
    restored++;
}

void boot_start(void)
{
    TEST_ASSERT_EQUAL_UINT(1, restored);
    started++;
}

void setUp(void)
{
    terminal_port_fake_reset();
    terminal_port_fake_press(1);
    timebase_fake_us = 0;
    timebase_fake_step_us = 0;
    rst_low = false;
    restored = started = 0;
}

void tearDown(void) {}

static void reset(uint8_t flags)
{
    boot_port_flags = flags;
    boot_init();
}

/* When the window is over. */
static uint32_t window_us(void)
{
    while (!boot_over()) {
        TEST_ASSERT_LESS_THAN_UINT32(2000000, timebase_fake_us);
        timebase_fake_us += 1000;
    }
    return timebase_fake_us;
}

static unsigned restored_after(uint8_t flags, const char *typed)
{
    reset(flags);
    terminal_port_fake_type(typed);
    window_us();
    return restored;
}

static void test_power_on_and_external_resets_are_cold_starts(void)
{
    TEST_ASSERT_EQUAL(STATUS_OK, boot_cause_of(POWER_ON));
    TEST_ASSERT_EQUAL(STATUS_OK, boot_cause_of(EXTERNAL));
    TEST_ASSERT_EQUAL(STATUS_OK, boot_cause_of(0)); /* hidden by a bootloader */
    TEST_ASSERT_EQUAL(STATUS_OK, boot_cause_of(POWER_ON | BROWN_OUT | EXTERNAL)); /* a supply that rises slowly */
    TEST_ASSERT_EQUAL(STATUS_WATCHDOG, boot_cause_of(WATCHDOG));
    TEST_ASSERT_EQUAL(STATUS_WATCHDOG, boot_cause_of(WATCHDOG | EXTERNAL | BROWN_OUT));
    TEST_ASSERT_EQUAL(STATUS_BROWN_OUT, boot_cause_of(BROWN_OUT));
    TEST_ASSERT_EQUAL(STATUS_BROWN_OUT, boot_cause_of(BROWN_OUT | EXTERNAL));
}

static void test_only_a_cold_start_allows_autorun(void)
{
    static const struct {
        uint8_t flags;
        bool allowed;
    } rows[] = {{POWER_ON, true}, {EXTERNAL, true}, {BROWN_OUT, false}, {WATCHDOG, false}};
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        reset(rows[i].flags);
        TEST_ASSERT_EQUAL(rows[i].allowed, boot_autorun_allowed());
        window_us();
        TEST_ASSERT_EQUAL(rows[i].allowed, boot_autorun_allowed());
    }
}

/* BOO-002 */
static void test_the_window_lasts_a_second_and_opens_once(void)
{
    reset(POWER_ON);
    TEST_ASSERT_UINT32_WITHIN(50000, 1000000, window_us());
    for (timebase_fake_us = 0; timebase_fake_us < 20000000; timebase_fake_us += 10000) {
        TEST_ASSERT_TRUE(boot_over()); /* the clock wraps */
    }
}

static void test_there_is_no_window_after_watchdog_and_brown_out(void)
{
    reset(WATCHDOG);
    TEST_ASSERT_EQUAL_UINT32(0, window_us());
    reset(BROWN_OUT);
    TEST_ASSERT_EQUAL_UINT32(0, window_us());
}

/* BOO-003 */
static void test_escape_three_times_restores_and_starts_anew(void)
{
    TEST_ASSERT_EQUAL_UINT(1, restored_after(POWER_ON, "\x1B\x1B\x1B"));
    TEST_ASSERT_EQUAL_UINT(1, started);
}

static void test_other_bytes_before_and_behind_do_not_matter(void)
{
    TEST_ASSERT_EQUAL_UINT(1, restored_after(EXTERNAL, "m5\r\x1B\x1Bx\x1B\x1B\x1B\x1Bm6\r"));
}

static void test_less_than_three_escapes_in_a_row_restore_nothing(void)
{
    static const char *const typed[] = {"", "\x1B\x1B", "x", "xxx", "\x1B\x1Bx\x1B", "\x1Bm5\r\x1Bm5\r\x1B", "\x1B[A\x1B[B\x1B[C"};
    for (unsigned i = 0; i < sizeof typed / sizeof typed[0]; i++) {
        setUp();
        TEST_ASSERT_EQUAL_UINT_MESSAGE(0, restored_after(POWER_ON, typed[i]), typed[i]);
        TEST_ASSERT_EQUAL_UINT(0, started);
    }
}

static void test_a_damaged_byte_is_no_escape(void)
{
    TEST_ASSERT_EQUAL_UINT(0, restored_after(POWER_ON, "\x1B\xFF\x1B\xFF"));
    setUp();
    TEST_ASSERT_EQUAL_UINT(0, restored_after(POWER_ON, "\xFF\xFF\xFF\xFF"));
}

static void test_what_was_typed_in_the_window_is_kept(void)
{
    restored_after(POWER_ON, "m5\r\x1B");
    TEST_ASSERT_EQUAL_UINT(4, terminal_port_fake_untaken());
    TEST_ASSERT_EQUAL('m', terminal_port_get());
}

/* BOO-005 */
static void test_escapes_behind_the_window_restore_nothing(void)
{
    reset(POWER_ON);
    window_us();
    terminal_port_fake_type("\x1B\x1B\x1B");
    TEST_ASSERT_TRUE(boot_over());
    TEST_ASSERT_EQUAL_UINT(0, restored);
}

static void test_rst_low_at_a_cold_start_restores_at_once(void)
{
    rst_low = true;
    reset(POWER_ON);
    TEST_ASSERT_EQUAL_UINT(1, restored);
    TEST_ASSERT_EQUAL_UINT(0, started); /* main does, for the first time */
    window_us();
    TEST_ASSERT_EQUAL_UINT(1, restored);
}

/* EST-005 */
static void test_outside_a_cold_start_nothing_restores(void)
{
    rst_low = true;
    TEST_ASSERT_EQUAL_UINT(0, restored_after(WATCHDOG, "\x1B\x1B\x1B"));
    TEST_ASSERT_EQUAL_UINT(0, restored_after(BROWN_OUT, "\x1B\x1B\x1B"));
    TEST_ASSERT_EQUAL_UINT(0, started);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_power_on_and_external_resets_are_cold_starts);
    RUN_TEST(test_only_a_cold_start_allows_autorun);
    RUN_TEST(test_the_window_lasts_a_second_and_opens_once);
    RUN_TEST(test_there_is_no_window_after_watchdog_and_brown_out);
    RUN_TEST(test_escape_three_times_restores_and_starts_anew);
    RUN_TEST(test_other_bytes_before_and_behind_do_not_matter);
    RUN_TEST(test_less_than_three_escapes_in_a_row_restore_nothing);
    RUN_TEST(test_a_damaged_byte_is_no_escape);
    RUN_TEST(test_what_was_typed_in_the_window_is_kept);
    RUN_TEST(test_escapes_behind_the_window_restore_nothing);
    RUN_TEST(test_rst_low_at_a_cold_start_restores_at_once);
    RUN_TEST(test_outside_a_cold_start_nothing_restores);
    return UNITY_END();
}
