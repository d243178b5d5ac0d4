#include "options.h"

#include <argp.h>
#include <stdlib.h>
#include <string.h>

#include "tools/sacsim/exit_codes.h"
#include "tools/sacsim/numbers.h"
#include "tools/sacsim/pace.h"

enum { KEY_BACKLASH = 256, KEY_STUCK, KEY_SPEED, KEY_LINGER, KEY_SCRIPT, KEY_WAIT };

const char *argp_program_version = "ninjasim 1.0 - a simulated pan and tilt head on an Arduino Nano (ATmega328P, 16 MHz)";

static const char doc[] =
    "Runs the Ninja's firmware on a simulated Arduino Nano with a simulated pan and tilt head, in real time: what is "
    "typed goes to its serial port, the head is drawn.\v"
    "Backspace halts, Ctrl-R resets. Ctrl-C or Ctrl-] q quits; Ctrl-] ? lists the other keys: reset button, power, sensors.\n"
    "\n"
    "With --script, or where the input is a pipe or a file, nothing is drawn: the bytes are typed once the head rests after "
    "power-up, and when they are used up and it rests again one line tells how it stands:\n"
    "\n"
    "  printf 'X100Y50S' | ninjasim --fast build/ninja.elf\n"
    "\n"
    "Exit code: 0 done; 1 a file, a terminal or the image cannot be used; 2 wrong command line; 3 the firmware crashed. "
    "docs/simulator.md tells more.";

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "The head:", 1},
    {"start", 's', "X,Y", 0, "Where it stands at power-up, in steps (default 300,-200)", 1},
    {"backlash", KEY_BACKLASH, "X,Y", 0, "Of its linkage, in steps (default 12,6: what the firmware expects)", 1},
    {"stuck", KEY_STUCK, "AXIS=LEVEL", 0, "A centre sensor that does not work, e.g. x=high; may be repeated", 1},
    {NULL, 0, NULL, 0, "Running:", 2},
    {"speed", KEY_SPEED, "FACTOR", 0, "So many times real time, 0.01 to 100", 2},
    {"fast", 'f', NULL, 0, "As fast as the host can", 2},
    {"for", 't', "SECONDS", 0, "End after so many simulated seconds", 2},
    {"baud", 'b', "BD", 0, "Bits per second of this end of the line (default 4800)", 2},
    {NULL, 0, NULL, 0, "Without the screen:", 3},
    {"script", KEY_SCRIPT, "FILE", 0, "Type the bytes of this file", 3},
    {"wait", KEY_WAIT, NULL, 0, "Wait before each line until the head rests: the Ninja keeps no more than 16 bytes", 3},
    {"linger", KEY_LINGER, "MS", 0,
     "The head rests when its coils have been off for so many simulated milliseconds (default 300): make it longer than "
     "the longest pause",
     3},
    {NULL, 0, NULL, 0, "Help:", -1},
    {0},
};

static head_axis_t axis_named(struct argp_state *state, const char *what, const char *name)
{
    if (strcmp(name, "x") != 0 && strcmp(name, "y") != 0) {
        argp_error(state, "%s: '%s' is no axis, x or y", what, name);
    }
    return name[0] == 'x' ? HEAD_X : HEAD_Y;
}

/* Splits "a,b" or "a=b"; argp_error() does not return. */
static char *split(struct argp_state *state, const char *what, char *text, char at, const char *form)
{
    char *second = strchr(text, at);

    if (second == NULL) {
        argp_error(state, "%s: '%s' is not %s", what, text, form);
        exit(EXIT_USAGE);
    }
    *second = '\0';
    return second + 1;
}

static void parse_start(struct argp_state *state, options_t *o, char *arg)
{
    char *y = split(state, "--start", arg, ',', "X,Y");

    o->head.axis[HEAD_X].start = numbers_whole(state, "--start", arg, -1800, 1800);
    o->head.axis[HEAD_Y].start = numbers_whole(state, "--start", y, -1200, 550);
}

static void parse_backlash(struct argp_state *state, options_t *o, char *arg)
{
    char *y = split(state, "--backlash", arg, ',', "X,Y");

    o->head.axis[HEAD_X].backlash = numbers_whole(state, "--backlash", arg, 0, 200);
    o->head.axis[HEAD_Y].backlash = numbers_whole(state, "--backlash", y, 0, 200);
}

static void parse_stuck(struct argp_state *state, options_t *o, char *arg)
{
    char *level = split(state, "--stuck", arg, '=', "AXIS=LEVEL");
    head_axis_t axis = axis_named(state, "--stuck", arg);

    if (strcmp(level, "high") != 0 && strcmp(level, "low") != 0) {
        argp_error(state, "--stuck: '%s' is no level, high or low", level);
    }
    o->head.axis[axis].sensor = level[0] == 'h' ? HEAD_SENSOR_STUCK_HIGH : HEAD_SENSOR_STUCK_LOW;
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
    options_t *o = state->input;

    switch (key) {
    case 's': parse_start(state, o, arg); break;
    case KEY_BACKLASH: parse_backlash(state, o, arg); break;
    case KEY_STUCK: parse_stuck(state, o, arg); break;
    case KEY_SPEED: o->speed = numbers_real(state, "--speed", arg, 0.01, 100); break;
    case 'f': o->speed = PACE_FAST; break;
    case 't': o->for_seconds = numbers_real(state, "--for", arg, 1e-6, 1e9); break;
    case 'b': o->baud = numbers_real(state, "--baud", arg, 300, 2e6); break;
    case KEY_SCRIPT: o->script = arg; break;
    case KEY_WAIT: o->wait = true; break;
    case KEY_LINGER: o->linger_ms = numbers_real(state, "--linger", arg, 1, 1e9); break;
    case ARGP_KEY_ARG:
        if (o->image != NULL) {
            argp_error(state, "one image at a time: '%s' is one too many", arg);
        }
        o->image = arg;
        break;
    case ARGP_KEY_END:
        if (o->image == NULL) {
            argp_error(state, "which image? e.g. build/ninja.elf");
        }
        break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

void options_parse(options_t *o, int argc, char **argv)
{
    static const struct argp parser = {options, parse, "IMAGE.elf", doc, NULL, NULL, NULL};

    *o = (options_t){.head = head_defaults, .speed = 1.0, .linger_ms = 300, .baud = 4800};
    o->head.axis[HEAD_X].start = 300;
    o->head.axis[HEAD_Y].start = -200;
    argp_err_exit_status = EXIT_USAGE;
    argp_parse(&parser, argc, argv, 0, NULL, o);
}
