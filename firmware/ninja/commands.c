/* See commands.h. */
#include "ninja/commands.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"
#include "ninja/centre.h"
#include "ninja/drive.h"
#include "ninja/path.h"
#include "ninja/pause.h"
#include "ninja/receive_port.h"

#define FIFO_BYTES 16
#define MACRO_BYTES 64
#define V_MAX 63

/* Cycle of each V in microseconds, to the nearest: from creep to top speed in equal ratios. */
#define V(n)                                                                                                       \
    (uint32_t)(1e6 / (NINJA_CREEP_STEPS_PER_S *                                                                     \
                      __builtin_pow((double)NINJA_TOP_STEPS_PER_S / NINJA_CREEP_STEPS_PER_S, (n) / (double)V_MAX)) + \
               0.5)
#define V_8(n) V(n), V(n + 1), V(n + 2), V(n + 3), V(n + 4), V(n + 5), V(n + 6), V(n + 7)
static const uint32_t cycles_us[V_MAX + 1] FLASH = {
    V_8(0), V_8(8), V_8(16), V_8(24), V_8(32), V_8(40), V_8(48), V_8(56),
};

/* -- registers, and what is under way ------------------------------------------------------------------------------ */

static int16_t target[AXES]; /* X and Y */
static uint8_t velocity;     /* V */

static struct {
    uint8_t byte[FIFO_BYTES];
    uint8_t first, count;
} fifo;

static char pending; /* the letter whose number is being read, or 0 */
static struct {
    uint32_t magnitude; /* up to 65,535: what is more makes no difference */
    bool negative;
    bool begun; /* no sign may follow */
} number;

static struct {
    uint8_t byte[MACRO_BYTES];
    uint8_t length;
    uint8_t next;  /* to be executed, while it runs */
    bool defining; /* letters are kept, not executed */
    bool runs;
} macro;

/* -- the commands -------------------------------------------------------------------------------------------------- */

static void do_x(uint16_t value)
{
    target[AXIS_X] = (int16_t)value;
}

static void do_y(uint16_t value)
{
    target[AXIS_Y] = (int16_t)value;
}

static void do_v(uint16_t value)
{
    velocity = (uint8_t)value;
}

static void go(uint8_t v)
{
    drive_to(target, flash_u32(&cycles_us[v]));
}

static void do_move(uint16_t unused)
{
    (void)unused;
    go(velocity);
}

static void do_slew(uint16_t unused)
{
    (void)unused;
    go(V_MAX);
}

static void do_increment(uint16_t unused)
{
    for (uint8_t axis = 0; axis < AXES; axis++) {
        const path_limits_t *limits = &path_limits[axis];
        const int16_t sum = (int16_t)(path_position(axis) + target[axis]);
        target[axis] = sum < limits->min ? limits->min : sum > limits->max ? limits->max : sum;
    }
    do_move(unused);
}

static void do_centre(uint16_t unused)
{
    (void)unused;
    centre_begin();
}

static void do_pause(uint16_t tenths)
{
    pause_begin(tenths);
}

static void do_open(uint16_t unused)
{
    (void)unused;
    if (!macro.defining) {
        macro.defining = true;
        macro.length = 0;
    }
}

static bool keep(uint8_t byte, uint8_t room)
{
    if (macro.length > MACRO_BYTES - room) {
        return false;
    }
    macro.byte[macro.length++] = byte;
    return true;
}

/* In a macro that runs it is the end. */
static void do_close(uint16_t unused)
{
    (void)unused;
    if (macro.defining) {
        (void)keep(')', 1);
    }
    macro.defining = false;
    macro.runs = false;
}

static void do_run(uint16_t unused)
{
    (void)unused;
    macro.runs = macro.length != 0;
    macro.next = 0;
}

enum {
    NUMBER = 1 << 0, /* a number follows the letter */
    WAITS = 1 << 1,  /* until motion is over */
    AT_ONCE = 1 << 2 /* in a definition, too */
};

typedef struct {
    char letter;
    uint8_t flags;
    void (*execute)(uint16_t number);
    int32_t min, max;      /* of the number */
    uint16_t below, above; /* taken instead of what is outside */
} command_t;

#define AXIS_RANGE(min, max) min, max, (uint16_t)(min), (uint16_t)(max)
static const command_t commands[] FLASH = {
    {'X', NUMBER, do_x, AXIS_RANGE(NINJA_X_MIN, NINJA_X_MAX)},
    {'Y', NUMBER, do_y, AXIS_RANGE(NINJA_Y_MIN, NINJA_Y_MAX)},
    {'V', NUMBER, do_v, 0, V_MAX, V_MAX, V_MAX},
    {'P', NUMBER | WAITS, do_pause, INT16_MIN, UINT16_MAX, 0, 0},
    {'M', WAITS, do_move, 0, 0, 0, 0},
    {'S', WAITS, do_slew, 0, 0, 0, 0},
    {'I', WAITS, do_increment, 0, 0, 0, 0},
    {'C', WAITS, do_centre, 0, 0, 0, 0},
    {'R', 0, do_run, 0, 0, 0, 0},
    {'(', AT_ONCE, do_open, 0, 0, 0, 0},
    {')', AT_ONCE, do_close, 0, 0, 0, 0},
};
#define COMMANDS (sizeof commands / sizeof commands[0])

/* The row of a letter; false if there is none. */
static bool find(command_t *command, uint8_t letter)
{
    if (letter >= 'a' && letter <= 'z') {
        letter = (uint8_t)(letter - 'a' + 'A');
    }
    for (uint8_t i = 0; i < COMMANDS; i++) {
        if (flash_u8(&commands[i].letter) == letter) {
            FLASH_COPY(command, &commands[i], sizeof *command);
            return true;
        }
    }
    return false;
}

static bool must_wait(const command_t *command)
{
    return (command->flags & WAITS) != 0 && (drive_runs() || centre_runs());
}

/* Keeps a command for the macro, or executes it; false if it must wait. */
static NOINLINE bool obey(const command_t *command, uint16_t value)
{
    if (macro.defining && (command->flags & AT_ONCE) == 0) {
        const bool numbered = (command->flags & NUMBER) != 0;
        if (keep((uint8_t)command->letter, numbered ? 3 : 1) && numbered) {
            (void)keep((uint8_t)value, 1);
            (void)keep((uint8_t)(value >> 8), 1);
        }
        return true;
    }
    if (must_wait(command)) {
        return false;
    }
    command->execute(value);
    return true;
}

/* -- numbers ------------------------------------------------------------------------------------------------------- */

static void begin_number(char letter)
{
    pending = letter;
    number.magnitude = 0;
    number.negative = false;
    number.begun = false;
}

/* False if the byte no longer belongs to it. */
static bool add_to_number(uint8_t byte)
{
    const uint8_t digit = (uint8_t)(byte - '0');
    if (digit <= 9) {
        (void)number_add_digit(&number.magnitude, digit);
        if (number.magnitude > UINT16_MAX) {
            number.magnitude = UINT16_MAX;
        }
    } else if (!number.begun && (byte == '+' || byte == '-')) {
        number.negative = byte == '-';
    } else {
        return false;
    }
    number.begun = true;
    return true;
}

/* As the command takes it. */
static uint16_t number_for(const command_t *command)
{
    int32_t value = (int32_t)number.magnitude;
    if (number.negative) {
        value = value > -(int32_t)INT16_MIN ? INT16_MIN : -value;
    }
    if (value < command->min) {
        return command->below;
    }
    return value > command->max ? command->above : (uint16_t)value;
}

/* -- one byte after the other -------------------------------------------------------------------------------------- */

static bool interpret(uint8_t byte)
{
    command_t command;
    if (pending != 0) {
        if (add_to_number(byte)) {
            return true;
        }
        if (!find(&command, (uint8_t)pending) || !obey(&command, number_for(&command))) {
            return false;
        }
        pending = 0;
        /* It may have begun a pause: the byte is next then. */
        if (pause_runs()) {
            return false;
        }
    }
    if (!find(&command, byte)) {
        return true;
    }
    if ((command.flags & NUMBER) != 0) {
        begin_number(command.letter);
        return true;
    }
    return obey(&command, 0);
}

static bool replay(void)
{
    const uint8_t *byte = &macro.byte[macro.next];
    command_t command;
    if (macro.next == macro.length || !find(&command, *byte)) {
        macro.runs = false;
        return true;
    }
    if (must_wait(&command)) {
        return false;
    }
    uint16_t value = 0;
    macro.next++;
    if ((command.flags & NUMBER) != 0) {
        value = (uint16_t)(byte[1] | byte[2] << 8);
        macro.next = (uint8_t)(macro.next + 2);
    }
    return obey(&command, value);
}

bool commands_poll(void)
{
    if (pause_runs()) {
        return false;
    }
    if (macro.runs) {
        return replay();
    }
    if (fifo.count == 0 || !interpret(fifo.byte[fifo.first])) {
        return false;
    }
    fifo.first = (uint8_t)((fifo.first + 1) % FIFO_BYTES);
    fifo.count--;
    return true;
}

/* -- at once ------------------------------------------------------------------------------------------------------- */

static void halt(void)
{
    drive_halt();
    centre_stop();
    pause_stop();
    fifo.count = 0;
    pending = 0;
    macro.runs = false;
    if (macro.defining) {
        macro.defining = false;
        macro.length = 0;
    }
}

void commands_init(void)
{
    halt();
    target[AXIS_X] = target[AXIS_Y] = 0;
    velocity = NINJA_POWER_UP_V;
    macro.length = 0;
    centre_begin();
}

void commands_receive(uint8_t byte)
{
    if (byte == RECEIVE_CTRL_R) {
        commands_init();
    } else if (byte == RECEIVE_BACKSPACE) {
        halt();
    } else if (fifo.count < FIFO_BYTES) {
        fifo.byte[(fifo.first + fifo.count) % FIFO_BYTES] = byte;
        fifo.count++;
    }
}
