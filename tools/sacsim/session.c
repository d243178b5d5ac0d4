#include "session.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "console.h"
#include "eeprom_file.h"
#include "keys.h"
#include "meter.h"
#include "pace.h"
#include "pty.h"
#include "signals.h"
#include "trace.h"

#define CYCLES_PER_MS (BOARD_CPU_HZ / 1000)
#define NS_PER_MS INT64_C(1000000)

enum {
    STATUS_MS = 100,       /* host's time between two status lines */
    SPEED_WINDOW = 10,     /* status lines over which the speed of the simulation is taken */
    NOTICE_MS = 5000,      /* how long a notice stays in the status line */
    SAVE_MS = 2000,        /* host's time between two looks at the EEPROM */
    OPEN_RESET_MS = 50,    /* host's time from the opening of the port to the reset: programs flush first */
    HELLO_QUIET_MS = 20,   /* simulated: the firmware has said hello when it then is quiet for so long behind a prompt, */
    WINDOW_QUIET_MS = 1200, /* or so long: a second passes before the prompt, in which it takes no more than its ring */
    HELLO_LIMIT_MS = 3000, /* simulated: and if it says nothing at all, piped input starts anyway */
    SYNC_MS = 1,           /* simulated: width of the pulse of Ctrl-] y */
    BITS_PER_BYTE = 10,
};

enum { TRACES_MAX = 2 };

typedef struct {
    const options_t *o;
    board_t *board;
    pty_t *pty; /* NULL: the board's terminal is stdin and stdout */
    trace_t *traces[TRACES_MAX];
    size_t trace_count;
    eeprom_file_t eeprom;
    keys_t keys;
    meter_t meter;
    pace_t pace;
    board_pin_t clk, dir, opsa, estop, sync, factory;
    bool has_state;
    uint16_t state_address;

    double cycles_per_byte;
    uint64_t line_free_cycle;   /* when all bytes sent to the board will have gone out */
    uint64_t last_output_cycle; /* of the board's serial port; 0: none yet */
    uint8_t last_output;
    bool input_started, input_ended;
    bool estop_held, factory_held;

    int64_t next_status_ns, next_save_ns, notice_until_ns;
    int64_t reset_at_ns; /* the port has been opened: reset then; 0: nothing due */
    char notice[160];
    struct {
        int64_t ns;
        uint64_t cycle;
    } speed[SPEED_WINDOW];
    unsigned speed_next;

    bool done;
    int code;
} session_t;

/* -- signals ----------------------------------------------------------------------------------------------------- */

static volatile sig_atomic_t end_signal, window_changed, stop_asked;

static void on_end(int number)
{
    end_signal = number;
    console_abandon();
}

static void on_window(int number)
{
    (void)number;
    window_changed = 1;
}

static void on_stop(int number)
{
    (void)number;
    stop_asked = 1;
}

static void catch_signals(void)
{
    signals_handle_ends(on_end);
    signals_handle(SIGWINCH, on_window);
    signals_handle(SIGTSTP, on_stop);
    signal(SIGPIPE, SIG_IGN);
}

/* -- what is said ------------------------------------------------------------------------------------------------ */

/* A short message: in the status line if there is one, else on stderr. */
static void __attribute__((format(printf, 2, 3))) notice(session_t *s, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(s->notice, sizeof s->notice, format, arguments);
    va_end(arguments);
    if (console_has_status()) {
        s->notice_until_ns = pace_now_ns() + NOTICE_MS * NS_PER_MS;
        s->next_status_ns = 0;
    } else {
        console_say("%s", s->notice);
    }
}

static const char *state_name(const session_t *s)
{
    /* the order of motion_state_t in firmware/motion/engine.h */
    static const char *const names[] = {"STANDBY", "ACCEL", "CRUISE", "DECEL", "STOP"};
    uint8_t state;

    if (!s->has_state) {
        return "-";
    }
    state = board_peek8(s->board, s->state_address);
    return state < sizeof names / sizeof names[0] ? names[state] : "?";
}

static bool standing(const session_t *s)
{
    return s->has_state && board_peek8(s->board, s->state_address) == 0;
}

/* Simulated over real time, during the last second. */
static double relative_speed(session_t *s, int64_t now, uint64_t cycle)
{
    unsigned i = s->speed_next % SPEED_WINDOW;
    int64_t ns = s->speed[i].ns;
    double speed = 0.0;

    if (s->speed_next < SPEED_WINDOW) {
        ns = s->speed[0].ns;
        if (s->speed_next > 0 && now > ns) {
            speed = (double)(cycle - s->speed[0].cycle) * 62.5 / (double)(now - ns);
        }
    } else if (now > ns) {
        speed = (double)(cycle - s->speed[i].cycle) * 62.5 / (double)(now - ns);
    }
    s->speed[i].ns = now;
    s->speed[i].cycle = cycle;
    s->speed_next++;
    return speed;
}

typedef struct {
    char text[640];
    size_t length;
    bool full;
} status_line_t;

/* Appends a field; from the first on that does not fit, all are left out: the ones that come first matter most. */
static void __attribute__((format(printf, 2, 3))) field(status_line_t *line, const char *format, ...)
{
    size_t room = console_columns() - line->length;
    va_list arguments;
    int length;

    va_start(arguments, format);
    length = vsnprintf(line->text + line->length, sizeof line->text - line->length, format, arguments);
    va_end(arguments);
    line->full = line->full || (size_t)length > room || (size_t)length >= sizeof line->text - line->length;
    if (line->full) {
        line->text[line->length] = '\0';
    } else {
        line->length += (size_t)length;
    }
}

static void show_status(session_t *s, int64_t now)
{
    uint64_t cycle = board_cycle(s->board);
    double rate = meter_read(&s->meter, cycle, standing(s));
    double speed = relative_speed(s, now, cycle);
    double full_steps = rate / s->o->microsteps;
    unsigned long long tenths = cycle / (BOARD_CPU_HZ / 10);
    status_line_t line = {.length = 0};

    if (now < s->notice_until_ns) {
        field(&line, " %.*s", (int)console_columns() - 1, s->notice);
        console_status(line.text);
        return;
    }
    field(&line, " %-7s", state_name(s));
    field(&line, " pos %-11lld", (long long)s->meter.position_pulses);
    field(&line, "%9.1f steps/s", rate);
    field(&line, "%9.2f RPM", full_steps * 60.0 / s->o->steps_per_rev);
    if (full_steps > 0.0) {
        field(&line, " %10.*f us", full_steps > 100.0 ? 2 : 0, 1e6 / full_steps);
    } else {
        field(&line, " %10s us", "-");
    }
    field(&line, "  %llu.%llu s", tenths / 10, tenths % 10);
    if (s->estop_held) {
        field(&line, "  ESTOP");
    }
    if (s->factory_held) {
        field(&line, "  RST");
    }
    field(&line, " %.2fx", speed);
    field(&line, "  Ctrl-] ?");
    console_status(line.text);
}

static void show_help(const session_t *s)
{
    const char *line;

    console_print("");
    for (unsigned i = 0; (line = keys_help(&s->keys, i)) != NULL; i++) {
        console_print(line);
    }
}

static void banner(const session_t *s)
{
    char line[256];

    if (s->pty != NULL) {
        snprintf(line, sizeof line, "sacsim: serial port %s%s%s", s->pty->name, s->o->link != NULL ? " = " : "",
                 s->o->link != NULL ? s->o->link : "");
        console_print(line);
    }
    if (console_screen() && console_keys()) {
        snprintf(line, sizeof line, "sacsim: %s on a simulated Nano, %.0f Bd. %s quits, Ctrl-] ? lists the keys.",
                 s->o->image, s->o->baud, s->pty != NULL ? "Ctrl-C" : "Ctrl-] q");
        console_print(line);
    }
}

/* -- the board's side -------------------------------------------------------------------------------------------- */

static void on_edge(void *context, board_edge_t edge)
{
    session_t *s = context;

    if (edge.pin == s->clk) {
        if (edge.level) {
            meter_clk_rise(&s->meter, edge.cycle);
        }
    } else if (edge.pin == s->dir) {
        meter_dir(&s->meter, edge.level);
    }
    for (size_t i = 0; i < s->trace_count; i++) {
        trace_edge(s->traces[i], edge);
    }
}

static uint8_t level_of(const session_t *s, board_pin_t pin)
{
    return board_pin_level(s->board, pin) > 0;
}

static bool open_trace(session_t *s, const char *path, trace_format_t format)
{
    uint8_t levels[OPTIONS_POSTS_MAX];

    for (size_t i = 0; i < s->o->pin_count; i++) {
        levels[i] = level_of(s, s->o->pins[i]->pin);
    }
    s->traces[s->trace_count] = trace_open(path, format, s->o->pins, levels, s->o->pin_count, board_cycle(s->board));
    if (s->traces[s->trace_count] == NULL) {
        return false;
    }
    s->trace_count++;
    return true;
}

static bool ends_in(const char *text, const char *end)
{
    size_t length = strlen(text), tail = strlen(end);

    return length >= tail && strcmp(text + length - tail, end) == 0;
}

static bool open_traces(session_t *s)
{
    const options_t *o = s->o;

    if (o->edges != NULL && !open_trace(s, o->edges, ends_in(o->edges, ".csv") ? TRACE_CSV : TRACE_COMPACT)) {
        return false;
    }
    if (o->vcd != NULL && !open_trace(s, o->vcd, TRACE_VCD)) {
        return false;
    }
    if (s->trace_count > 0) {
        for (size_t i = 0; i < o->pin_count; i++) {
            board_record(s->board, o->pins[i]->pin, true);
        }
    }
    return true;
}

static bool open_board(session_t *s)
{
    const options_t *o = s->o;

    if (access(o->image, R_OK) != 0) {
        console_say("cannot read %s: %s", o->image, strerror(errno));
        return false;
    }
    if (o->eeprom != NULL && !eeprom_file_open(&s->eeprom, o->eeprom)) {
        return false;
    }
    s->board = board_new(o->image, o->eeprom != NULL ? s->eeprom.saved : NULL);
    if (s->board == NULL) {
        return false;
    }
    s->clk = post_find("clk")->pin;
    s->dir = post_find("dir")->pin;
    s->opsa = post_find("opsa")->pin;
    s->estop = post_find("estop")->pin;
    s->sync = post_find("sync")->pin;
    s->factory = post_find("rst")->pin;
    s->has_state = board_symbol(s->board, "motion_state", &s->state_address);
    board_uart_baud(s->board, o->baud);
    s->cycles_per_byte = BITS_PER_BYTE * (double)BOARD_CPU_HZ / o->baud;
    for (size_t i = 0; i < o->wire_count; i++) {
        board_pin_wire(s->board, o->wires[i].output->pin, o->wires[i].input->pin);
    }
    meter_init(&s->meter, o->cw_level, level_of(s, s->dir));
    board_on_edge(s->board, on_edge, s);
    board_record(s->board, s->clk, true);
    board_record(s->board, s->dir, true);
    return open_traces(s);
}

/* Passes on what the board has sent since the last call. */
static void take_output(session_t *s)
{
    size_t count;
    const board_uart_byte_t *received = board_uart_received(s->board, &count);
    uint8_t bytes[256];

    if (count > 0) {
        s->last_output_cycle = received[count - 1].end_cycle;
        s->last_output = received[count - 1].byte;
    }
    for (size_t i = 0; i < count;) {
        size_t n = 0;

        while (n < sizeof bytes && i < count) {
            bytes[n++] = received[i++].byte;
        }
        if (s->pty == NULL) {
            console_write(bytes, n);
        } else if (s->reset_at_ns == 0) {
            pty_write(s->pty, bytes, n, s->o->fast);
        }
    }
    if (count > 0) {
        board_uart_clear(s->board);
    } else if (s->pty != NULL && s->pty->backlog_count > 0) {
        pty_write(s->pty, bytes, 0, s->o->fast);
    }
}

static void send_byte(session_t *s, uint8_t byte)
{
    uint64_t now = board_cycle(s->board);

    board_uart_send(s->board, &byte, 1);
    if (s->line_free_cycle < now) {
        s->line_free_cycle = now;
    }
    s->line_free_cycle += (uint64_t)s->cycles_per_byte;
}

/* How many bytes the line can still take until that cycle: more than these stay where they come from, so that a reset
 * or the end of the program finds nothing stale in between. */
static size_t room_on_line(const session_t *s, uint64_t until)
{
    uint64_t now = board_cycle(s->board);
    uint64_t from = s->line_free_cycle > now ? s->line_free_cycle : now;

    return from >= until ? 0 : 1 + (size_t)((double)(until - from) / s->cycles_per_byte);
}

/* -- the user's side ---------------------------------------------------------------------------------------------- */

static void end(session_t *s, int code)
{
    if (!s->done) {
        s->done = true;
        s->code = code;
    }
}

enum {
    KEYS_QUIT = KEYS_OWN,
    KEYS_RESET,
    KEYS_POWER,
    KEYS_ESTOP,
    KEYS_SYNC,
    KEYS_FACTORY,
    KEYS_STATUS,
    KEYS_HELP,
};

static const keys_own_t own_keys[] = {
    {'q', KEYS_QUIT, "quit"},
    {'r', KEYS_RESET, "press the Nano's reset button"},
    {'p', KEYS_POWER, "power off and on"},
    {'e', KEYS_ESTOP, "ground Estop; again: release it"},
    {'y', KEYS_SYNC, "ground sync for 1 ms"},
    {'f', KEYS_FACTORY, "ground RST (factory reset at a power-on); again: release it"},
    {'s', KEYS_STATUS, "status line off; again: on"},
    {'?', KEYS_HELP, "this list"},
    {0},
};

static void hold(session_t *s, board_pin_t pin, bool *held, const char *what)
{
    *held = !*held;
    board_pin_drive(s->board, pin, *held ? 0 : -1);
    notice(s, "%s %s", what, *held ? "grounded" : "released");
}

static void own_key(session_t *s, int action, uint8_t key)
{
    switch (action) {
    case KEYS_NOTHING: break;
    case KEYS_BYTE:
        if (s->pty == NULL) {
            send_byte(s, key);
            if (key == KEYS_CTRL_C) {
                notice(s, "Ctrl-C went to the Nano; Ctrl-] q quits");
            }
        } else if (key == KEYS_CTRL_C) {
            end(s, -SIGINT);
        } else {
            notice(s, "the Nano's terminal is at %s; Ctrl-C quits, Ctrl-] ? lists the keys", s->pty->name);
        }
        break;
    case KEYS_QUIT: end(s, EXIT_SUCCESS); break;
    case KEYS_RESET:
        board_reset(s->board, BOARD_RESET_EXTERNAL);
        notice(s, "reset");
        break;
    case KEYS_POWER:
        board_reset(s->board, BOARD_RESET_POWER_ON);
        notice(s, "power off and on");
        break;
    case KEYS_ESTOP: hold(s, s->estop, &s->estop_held, "Estop"); break;
    case KEYS_FACTORY: hold(s, s->factory, &s->factory_held, "RST"); break;
    case KEYS_SYNC:
        board_pin_drive(s->board, s->sync, 0);
        board_pin_drive_at(s->board, s->sync, -1, board_cycle(s->board) + SYNC_MS * CYCLES_PER_MS);
        notice(s, "sync grounded for %d ms", SYNC_MS);
        break;
    case KEYS_STATUS: console_set_status(!console_has_status()); break;
    case KEYS_HELP: show_help(s); break;
    case KEYS_UNKNOWN: notice(s, "Ctrl-] ? lists the keys"); break;
    }
}

static void read_keys(session_t *s, uint64_t until)
{
    uint8_t keys[64];
    size_t max = s->pty == NULL ? room_on_line(s, until) : sizeof keys;
    ssize_t got;

    max = max < sizeof keys ? max : sizeof keys;
    if (max == 0) {
        return;
    }
    got = read(STDIN_FILENO, keys, max);
    if (got < 0 && errno != EINTR && errno != EAGAIN) {
        end(s, -SIGHUP); /* the terminal is gone */
    }
    for (ssize_t i = 0; i < got; i++) {
        own_key(s, keys_feed(&s->keys, keys[i]), keys[i]);
    }
}

/* Piped input begins when the firmware has said hello: a port that has just been opened loses what comes earlier. */
static bool said_hello(const session_t *s)
{
    uint64_t cycle = board_cycle(s->board);
    uint64_t quiet_ms = s->last_output == '>' ? HELLO_QUIET_MS : WINDOW_QUIET_MS;

    return (s->last_output_cycle > 0 && cycle - s->last_output_cycle > quiet_ms * CYCLES_PER_MS) ||
           cycle > HELLO_LIMIT_MS * CYCLES_PER_MS;
}

static void read_pipe(session_t *s, uint64_t until)
{
    struct pollfd ask = {.fd = STDIN_FILENO, .events = POLLIN};
    uint8_t bytes[256];
    size_t max;

    s->input_started = s->input_started || said_hello(s);
    if (!s->input_started || s->input_ended) {
        return;
    }
    max = room_on_line(s, until);
    max = max < sizeof bytes ? max : sizeof bytes;
    if (max > 0 && poll(&ask, 1, 0) != 0) {
        ssize_t got = read(STDIN_FILENO, bytes, max);

        if (got > 0) {
            for (ssize_t i = 0; i < got; i++) {
                send_byte(s, bytes[i]);
            }
        } else if (got == 0 || (errno != EINTR && errno != EAGAIN)) {
            s->input_ended = true;
        }
    }
}

static void read_pty(session_t *s, uint64_t until)
{
    uint8_t bytes[256];
    size_t max;

    if (pty_opened(s->pty) && s->o->reset_on_open) {
        s->reset_at_ns = pace_now_ns() + OPEN_RESET_MS * NS_PER_MS;
    }
    if (s->reset_at_ns != 0 && pace_now_ns() >= s->reset_at_ns) {
        s->reset_at_ns = 0;
        board_reset(s->board, BOARD_RESET_EXTERNAL);
        notice(s, "%s opened: reset", s->pty->name);
    }
    max = room_on_line(s, until);
    max = max < sizeof bytes ? max : sizeof bytes;
    if (max > 0 && s->pty->open) {
        size_t got = pty_read(s->pty, bytes, max);

        for (size_t i = 0; i < got && s->reset_at_ns == 0; i++) { /* in reset the board hears nothing */
            send_byte(s, bytes[i]);
        }
    }
}

static void read_input(session_t *s, uint64_t until)
{
    if (console_keys()) {
        read_keys(s, until);
    } else if (s->pty == NULL) {
        read_pipe(s, until);
    }
    if (s->pty != NULL) {
        read_pty(s, until);
    }
}

/* -- the run ------------------------------------------------------------------------------------------------------ */

/* After the end of a piped input: whether nothing has happened on the board for long enough. */
static bool idle(const session_t *s)
{
    uint64_t last = s->line_free_cycle;

    if (!s->input_ended || level_of(s, s->opsa) || (s->has_state && !standing(s))) {
        return false;
    }
    last = s->last_output_cycle > last ? s->last_output_cycle : last;
    last = s->meter.last_rise_cycle > last ? s->meter.last_rise_cycle : last;
    return board_cycle(s->board) > last + (uint64_t)(s->o->linger_ms * (double)CYCLES_PER_MS);
}

static void look_at_signals(session_t *s)
{
    if (end_signal != 0) {
        end(s, -end_signal);
    }
    if (window_changed) {
        window_changed = 0;
        console_resized();
        s->next_status_ns = 0;
    }
    if (stop_asked) {
        stop_asked = 0;
        console_restore();
        raise(SIGSTOP);
        console_reopen();
        pace_start(&s->pace, s->o->fast ? PACE_FAST : 1.0, board_cycle(s->board));
    }
}

static void look_at_clock(session_t *s)
{
    int64_t now = pace_now_ns();

    if (now >= s->next_status_ns) {
        if (console_has_status()) {
            show_status(s, now);
        }
        s->next_status_ns = now + STATUS_MS * NS_PER_MS;
        for (size_t i = 0; i < s->trace_count; i++) {
            if (!trace_ok(s->traces[i])) {
                end(s, EXIT_TROUBLE); /* closing it says why */
            }
        }
    }
    if (now >= s->next_save_ns) {
        if (s->o->eeprom != NULL && !eeprom_file_save(&s->eeprom, board_eeprom(s->board))) {
            end(s, EXIT_TROUBLE);
        }
        s->next_save_ns = now + SAVE_MS * NS_PER_MS;
    }
}

static void run(session_t *s)
{
    uint64_t limit = s->o->for_seconds > 0.0 ? (uint64_t)(s->o->for_seconds * (double)BOARD_CPU_HZ) : UINT64_MAX;

    pace_start(&s->pace, s->o->fast ? PACE_FAST : 1.0, board_cycle(s->board));
    while (!s->done) {
        uint64_t target = pace_target(&s->pace, board_cycle(s->board));
        double speed;

        target = target < limit ? target : limit;
        read_input(s, target);
        if (board_run_to(s->board, target) == BOARD_CRASHED) {
            take_output(s);
            console_restore();
            console_say("the firmware crashed at %.7f s: %s", (double)board_cycle(s->board) / (double)BOARD_CPU_HZ,
                        board_crash(s->board));
            end(s, EXIT_CRASHED);
            break;
        }
        take_output(s);
        look_at_clock(s);
        speed = pace_wait(&s->pace, board_cycle(s->board));
        if (speed > 0.0) {
            notice(s, "this host is too slow for real time: it reaches %.2fx", speed);
        }
        look_at_signals(s);
        if (console_hung_up()) {
            end(s, -SIGPIPE);
        }
        if (board_cycle(s->board) >= limit || idle(s)) {
            end(s, EXIT_SUCCESS);
        }
    }
}

static void finish(session_t *s)
{
    console_restore();
    if (console_screen()) {
        console_print("");
    }
    for (size_t i = 0; i < s->trace_count; i++) {
        if (!trace_close(s->traces[i], board_cycle(s->board)) && s->code == EXIT_SUCCESS) {
            s->code = EXIT_TROUBLE;
        }
    }
    if (s->o->eeprom != NULL && s->board != NULL) {
        if (!eeprom_file_save(&s->eeprom, board_eeprom(s->board)) && s->code == EXIT_SUCCESS) {
            s->code = EXIT_TROUBLE;
        }
        eeprom_file_close(&s->eeprom);
    }
    if (s->pty != NULL) {
        pty_close(s->pty);
    }
    if (s->board != NULL) {
        board_free(s->board);
    }
}

int session_run(const options_t *o)
{
    static session_t s; /* large, and one is enough */
    static pty_t pty;

    s = (session_t){.o = o, .keys = {.own = own_keys}};
    catch_signals();
    if (o->pty) {
        if (!pty_open(&pty, o->link)) {
            return EXIT_TROUBLE;
        }
        s.pty = &pty;
    }
    if (!open_board(&s)) {
        s.code = EXIT_TROUBLE;
    } else {
        console_open(o->status);
        banner(&s);
        run(&s);
    }
    finish(&s);
    return s.code;
}
