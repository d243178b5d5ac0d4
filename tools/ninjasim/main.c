/* ninjasim: the Ninja's firmware on a simulated Arduino Nano with a simulated head. docs/simulator.md is its manual. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "options.h"
#include "screen.h"
#include "tools/sacsim/exit_codes.h"
#include "tools/sacsim/keys.h"
#include "tools/sacsim/pace.h"
#include "tools/sacsim/signals.h"

#define CYCLES_PER_MS (BOARD_CPU_HZ / 1000)
#define NS_PER_MS INT64_C(1000000)

enum {
    SHOW_MS = 50,     /* host's time between two pictures */
    SPEED_MS = 1000,  /* host's time over which the speed of the simulation is taken */
    NOTICE_MS = 5000, /* how long a notice stays */
    TYPED_MAX = 512,
};

static struct {
    options_t o;
    board_t *board;
    head_t *head;
    pace_t pace;
    bool screen;
    keys_t keys;
    bool help;

    int input; /* file descriptor, where there is no screen */
    bool input_ended;
    bool line_ended; /* and with --wait the next one waits */

    char typed[TYPED_MAX];
    char notice[160];
    int64_t notice_until_ns, next_show_ns, speed_since_ns;
    uint64_t speed_since_cycle;
    double speed;
    size_t bytes_noticed; /* that the board has sent */

    bool done;
    int code;
} sim;

/* -- the end --------------------------------------------------------------------------------------------------------- */

static volatile sig_atomic_t end_signal;

static void on_end(int number)
{
    end_signal = number;
}

static void end(int code)
{
    if (!sim.done) {
        sim.done = true;
        sim.code = code;
    }
}

/* -- what is said ---------------------------------------------------------------------------------------------------- */

static void __attribute__((format(printf, 1, 2))) notice(const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(sim.notice, sizeof sim.notice, format, arguments);
    va_end(arguments);
    if (sim.screen) {
        sim.notice_until_ns = pace_now_ns() + NOTICE_MS * NS_PER_MS;
    } else {
        fprintf(stderr, "ninjasim: %s\n", sim.notice);
    }
}

static double seconds(void)
{
    return (double)board_cycle(sim.board) / (double)BOARD_CPU_HZ;
}

static size_t bytes_sent_by_the_board(void)
{
    size_t count;

    board_uart_received(sim.board, &count);
    return count;
}

/* How the head stands, in one line. */
static void print_state(void)
{
    const head_state_t *x = head_state(sim.head, HEAD_X), *y = head_state(sim.head, HEAD_Y);

    printf("x=%d y=%d x_steps=%llu y_steps=%llu x_lost=%llu y_lost=%llu x_wrong=%llu y_wrong=%llu x_coils=%d y_coils=%d "
           "sent=%zu seconds=%.3f\n",
           x->platform, y->platform, (unsigned long long)x->steps, (unsigned long long)y->steps,
           (unsigned long long)x->lost_steps, (unsigned long long)y->lost_steps, (unsigned long long)x->wrong_patterns,
           (unsigned long long)y->wrong_patterns, x->coils, y->coils, bytes_sent_by_the_board(), seconds());
}

static const char *help_line(unsigned line)
{
    return keys_help(&sim.keys, line);
}

static void show(int64_t now)
{
    screen_view_t view = {.seconds = seconds(), .typed = sim.typed, .notice = "", .help = sim.help ? help_line : NULL};

    if (now - sim.speed_since_ns >= SPEED_MS * NS_PER_MS) {
        sim.speed = (double)(board_cycle(sim.board) - sim.speed_since_cycle) * 1e9 / (double)BOARD_CPU_HZ /
                    (double)(now - sim.speed_since_ns);
        sim.speed_since_ns = now;
        sim.speed_since_cycle = board_cycle(sim.board);
    }
    view.speed = sim.speed;
    if (bytes_sent_by_the_board() != sim.bytes_noticed) {
        sim.bytes_noticed = bytes_sent_by_the_board();
        notice("the Nano has sent %zu bytes: it should be silent", sim.bytes_noticed);
    }
    if (now < sim.notice_until_ns) {
        view.notice = sim.notice;
    }
    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        view.axis[axis] = head_state(sim.head, axis);
        view.rate[axis] = head_rate(sim.head, axis);
    }
    screen_show(&view);
}

/* -- the user's side ------------------------------------------------------------------------------------------------- */

static void send_byte(uint8_t byte)
{
    size_t length = strlen(sim.typed);
    bool control = byte < 0x20;

    board_uart_send(sim.board, &byte, 1);
    if (length + 3 > TYPED_MAX) {
        memmove(sim.typed, sim.typed + TYPED_MAX / 2, length + 1 - TYPED_MAX / 2);
        length -= TYPED_MAX / 2;
    }
    if (byte < 0x7f) {
        snprintf(sim.typed + length, TYPED_MAX - length, "%s%c", control ? "^" : "", control ? byte + 0x40 : byte);
    }
}

enum { KEYS_QUIT = KEYS_OWN, KEYS_RESET, KEYS_POWER, KEYS_SENSOR_X, KEYS_SENSOR_Y, KEYS_HELP };

static const keys_own_t own_keys[] = {
    {'q', KEYS_QUIT, "quit, as Ctrl-C"},
    {'r', KEYS_RESET, "press the Nano's reset button"},
    {'p', KEYS_POWER, "power off and on"},
    {'x', KEYS_SENSOR_X, "azimuth sensor stuck high; again: low; again: works"},
    {'y', KEYS_SENSOR_Y, "altitude sensor, likewise"},
    {'?', KEYS_HELP, "this list; again: the head"},
    {0},
};

static void next_sensor(head_axis_t axis)
{
    static const char *const names[] = {
        [HEAD_SENSOR_WORKS] = "works", [HEAD_SENSOR_STUCK_HIGH] = "stuck high", [HEAD_SENSOR_STUCK_LOW] = "stuck low"};
    head_sensor_t *how = &sim.o.head.axis[axis].sensor;

    *how = (*how + 1) % (sizeof names / sizeof names[0]);
    head_break_sensor(sim.head, axis, *how);
    notice("%s sensor: %s", axis == HEAD_X ? "azimuth" : "altitude", names[*how]);
}

static void reset(board_reset_t cause, const char *what)
{
    board_reset(sim.board, cause);
    notice("%s", what);
}

static void take_key(uint8_t key)
{
    switch (keys_feed(&sim.keys, key)) {
    case KEYS_NOTHING: break;
    case KEYS_BYTE:
        if (key == KEYS_CTRL_C) {
            end(EXIT_SUCCESS);
        } else {
            send_byte(key);
        }
        break;
    case KEYS_QUIT: end(EXIT_SUCCESS); break;
    case KEYS_RESET: reset(BOARD_RESET_EXTERNAL, "reset"); break;
    case KEYS_POWER: reset(BOARD_RESET_POWER_ON, "power off and on"); break;
    case KEYS_SENSOR_X: next_sensor(HEAD_X); break;
    case KEYS_SENSOR_Y: next_sensor(HEAD_Y); break;
    case KEYS_HELP: sim.help = !sim.help; break;
    default: notice("Ctrl-] ? lists the keys"); break;
    }
}

/* The head stands, and has done so for long enough that nothing is to be expected. */
static bool resting(void)
{
    uint64_t last = board_uart_last_sent(sim.board);

    for (head_axis_t axis = 0; axis < HEAD_AXES; axis++) {
        const head_state_t *s = head_state(sim.head, axis);

        if (s->coils != 0) {
            return false;
        }
        last = s->last_step > last ? s->last_step : last;
    }
    return board_cycle(sim.board) > last + (uint64_t)(sim.o.linger_ms * (double)CYCLES_PER_MS);
}

/* The next byte that was piped in, -1: none yet. */
static int piped_byte(void)
{
    struct pollfd ask = {.fd = sim.input, .events = POLLIN};
    uint8_t byte;

    if (sim.input_ended || (sim.line_ended && !resting()) || poll(&ask, 1, 0) == 0) {
        return -1;
    }
    switch (read(sim.input, &byte, 1)) {
    case 1: sim.line_ended = sim.o.wait && byte == '\n'; return byte;
    case 0: sim.input_ended = true; return -1;
    default: sim.input_ended = errno != EINTR && errno != EAGAIN; return -1;
    }
}

/* As many bytes as the line can begin to carry until then; the others stay where they come from, so that a halt finds
 * nothing before it. */
static void read_input(uint64_t until)
{
    int byte = 0;

    while (byte >= 0 && board_uart_last_sent(sim.board) < until) {
        byte = sim.screen ? screen_key() : piped_byte();
        if (byte >= 0 && sim.screen) {
            take_key((uint8_t)byte);
        } else if (byte >= 0) {
            send_byte((uint8_t)byte);
        }
    }
}

/* -- the run --------------------------------------------------------------------------------------------------------- */

static bool open_all(void)
{
    if (access(sim.o.image, R_OK) != 0) {
        fprintf(stderr, "ninjasim: cannot read %s: %s\n", sim.o.image, strerror(errno));
        return false;
    }
    if (sim.o.script != NULL) {
        sim.input = open(sim.o.script, O_RDONLY);
        if (sim.input < 0) {
            fprintf(stderr, "ninjasim: cannot read %s: %s\n", sim.o.script, strerror(errno));
            return false;
        }
    }
    sim.board = board_new(sim.o.image, NULL);
    if (sim.board == NULL) {
        return false;
    }
    board_uart_baud(sim.board, sim.o.baud);
    sim.head = head_new(sim.board, &sim.o.head);
    sim.screen = sim.o.script == NULL && isatty(STDIN_FILENO) && isatty(STDOUT_FILENO);
    sim.line_ended = true; /* power-up: the head is to rest first */
    return !sim.screen || screen_open();
}

static void run(void)
{
    uint64_t limit = sim.o.for_seconds > 0 ? (uint64_t)(sim.o.for_seconds * (double)BOARD_CPU_HZ) : UINT64_MAX;

    sim.speed_since_ns = pace_now_ns();
    pace_start(&sim.pace, sim.o.speed, board_cycle(sim.board));
    while (!sim.done) {
        uint64_t target = pace_target(&sim.pace, board_cycle(sim.board));
        double speed;

        target = target < limit ? target : limit;
        read_input(target);
        if (board_run_to(sim.board, target) == BOARD_CRASHED) {
            if (sim.screen) {
                screen_close();
            }
            fprintf(stderr, "ninjasim: the firmware crashed at %.7f s: %s\n", seconds(), board_crash(sim.board));
            end(EXIT_CRASHED);
            break;
        }
        if (sim.screen && pace_now_ns() >= sim.next_show_ns) {
            show(pace_now_ns());
            sim.next_show_ns = pace_now_ns() + SHOW_MS * NS_PER_MS;
        }
        speed = pace_wait(&sim.pace, board_cycle(sim.board));
        if (speed > 0) {
            notice("this host is too slow for this speed: it reaches %.2fx", speed);
        }
        if (end_signal != 0) {
            end(-end_signal);
        }
        if (board_cycle(sim.board) >= limit || (sim.input_ended && resting())) {
            end(EXIT_SUCCESS);
        }
    }
}

int main(int argc, char **argv)
{
    options_parse(&sim.o, argc, argv);
    sim.keys.own = own_keys;
    signals_handle_ends(on_end);
    if (open_all()) {
        run();
        if (sim.screen) {
            screen_close();
        }
        print_state();
    } else {
        sim.code = EXIT_TROUBLE;
    }
    head_free(sim.head);
    board_free(sim.board);
    if (sim.code < 0) {
        signals_end_by(-sim.code);
    }
    return sim.code;
}
