#include "options.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "numbers.h"

enum {
    KEY_LINGER = 256,
    KEY_WIRE,
    KEY_NO_RESET,
    KEY_VCD,
    KEY_NO_STATUS,
    KEY_STEPS_PER_REV,
    KEY_MICROSTEPS,
    KEY_CW,
    KEY_NODES,
    KEY_BUS_BAUD,
};

const char *argp_program_version = "sacsim 1.0 - SAC's simulated Arduino Nano (ATmega328P, 16 MHz)";

static const char doc[] =
    "Runs SAC's firmware on a simulated Arduino Nano, in real time, with the Nano's serial terminal on this terminal."
    "\vIn the terminal every key goes to the Nano, Ctrl-C too. Ctrl-] q quits; Ctrl-] ? lists the other keys: reset "
    "button, power, Estop, sync.\n"
    "\n"
    "When the input is a pipe or a file, its bytes are typed once the firmware has said hello, and the program ends "
    "when they are used up and the motor stands still:\n"
    "\n"
    "  printf 'm200v150\\r' | sacsim --fast build/sac.elf\n"
    "\n"
    "Exit code: 0 done; 1 a file, a terminal or the image cannot be used; 2 wrong command line; 3 the firmware "
    "crashed. docs/simulator.md tells more.";

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Running:", 1},
    {"fast", 'f', NULL, 0, "As fast as the host can, not in real time", 1},
    {"for", 't', "SECONDS", 0, "End after so many simulated seconds", 1},
    {"linger", KEY_LINGER, "MS", 0,
     "After the end of a piped input: end when nothing has moved and nothing was printed for so many simulated "
     "milliseconds (default 300)",
     1},
    {"wire", KEY_WIRE, "OUT=IN", 0, "Join two posts, e.g. out_1mhz=xclk; may be repeated", 1},
    {"eeprom", 'E', "FILE", 0, "Keep the EEPROM's 1,024 bytes in FILE (made if missing)", 1},
    {NULL, 0, NULL, 0, "The serial port:", 2},
    {"baud", 'b', "BD", 0, "Bits per second of this end of the line (default 38400)", 2},
    {"pty", 'p', NULL, 0, "Offer the port as a pseudo terminal for picocom or any other serial program", 2},
    {"link", 'l', "PATH", 0, "With --pty: a symbolic link to it", 2},
    {"no-reset", KEY_NO_RESET, NULL, 0, "With --pty: opening the port does not reset the Nano, as it would a real one",
     2},
    {NULL, 0, NULL, 0, "The network:", 2},
    {"nodes", KEY_NODES, "N", 0,
     "N Nanos (at most 16) on one RS485 line, with addresses from 10 on, each with a pseudo terminal, and one more for the "
     "line. --link and --eeprom PATH then make PATH.10, PATH.11 and so on, and PATH.bus; no recording, wires or keys",
     2},
    {"bus-baud", KEY_BUS_BAUD, "BD", 0, "Bits per second of the line's pseudo terminal (default 38400)", 2},
    {NULL, 0, NULL, 0, "Recording:", 3},
    {"edges", 'e', "FILE", 0, "Write every edge with its cycle: FILE.csv as text, else compact (tools/edges.py)", 3},
    {"vcd", KEY_VCD, "FILE", 0, "Write a value change dump for GTKWave or sigrok", 3},
    {"pins", 'P', "POST,...", 0, "The posts to record (default clk,dir); 'all', or 'list' to see their names", 3},
    {NULL, 0, NULL, 0, "The status line:", 4},
    {"no-status", KEY_NO_STATUS, NULL, 0, "None", 4},
    {"steps-per-rev", KEY_STEPS_PER_REV, "N", 0, "Full steps per revolution of the motor (default 200)", 4},
    {"microsteps", KEY_MICROSTEPS, "N", 0, "Pulses per full step of the driver (default 1)", 4},
    {"cw", KEY_CW, "LEVEL", 0, "Level of dir that turns clockwise, 0 or 1 (default 0)", 4},
    {NULL, 0, NULL, 0, "Help:", -1},
    {0},
};

static void list_posts(void)
{
    size_t count;
    const post_t *all = posts(&count);

    for (size_t i = 0; i < count; i++) {
        printf("%-9s %-4s %-6s %s\n", all[i].name, all[i].nano, all[i].output ? "output" : "input", all[i].use);
    }
}

static const post_t *named_post(struct argp_state *state, const char *what, const char *name)
{
    const post_t *post = post_find(name);

    if (post == NULL) {
        argp_error(state, "%s: no post is called '%s' (--pins list shows the names)", what, name);
    }
    return post;
}

static void add_pin(options_t *o, const post_t *post)
{
    for (size_t i = 0; i < o->pin_count; i++) {
        if (o->pins[i] == post) {
            return;
        }
    }
    if (o->pin_count < OPTIONS_POSTS_MAX) {
        o->pins[o->pin_count++] = post;
    }
}

static void parse_pins(struct argp_state *state, options_t *o, const char *arg)
{
    size_t count;
    const post_t *all = posts(&count);
    char *names = strdup(arg);
    char *rest = names;

    o->pin_count = 0;
    for (char *name; (name = strsep(&rest, ",")) != NULL;) {
        if (strcmp(name, "list") == 0) {
            list_posts();
            exit(EXIT_SUCCESS);
        }
        if (strcmp(name, "all") == 0) {
            for (size_t i = 0; i < count; i++) {
                add_pin(o, &all[i]);
            }
        } else {
            add_pin(o, named_post(state, "--pins", name));
        }
    }
    free(names);
}

static void parse_wire(struct argp_state *state, options_t *o, const char *arg)
{
    char *names = strdup(arg);
    char *input = strchr(names, '=');

    if (input == NULL) {
        argp_error(state, "--wire: '%s' is not OUT=IN", arg);
        return;
    }
    *input++ = '\0';
    if (o->wire_count == OPTIONS_WIRES_MAX) {
        argp_error(state, "--wire: more than %d wires", OPTIONS_WIRES_MAX);
    }
    o->wires[o->wire_count].output = named_post(state, "--wire", names);
    o->wires[o->wire_count].input = named_post(state, "--wire", input);
    if (!o->wires[o->wire_count].output->output || o->wires[o->wire_count].input->output) {
        argp_error(state, "--wire: '%s' does not lead from an output to an input", arg);
    }
    o->wire_count++;
    free(names);
}

static void check(struct argp_state *state, const options_t *o)
{
    if (o->image == NULL) {
        argp_error(state, "which image? e.g. build/sac.elf");
    }
    if (o->nodes > 0 && (o->edges != NULL || o->vcd != NULL || o->wire_count > 0)) {
        argp_error(state, "--nodes: neither --edges nor --vcd nor --wire");
    }
    if (!o->pty && o->link != NULL) {
        argp_error(state, "--link needs --pty");
    }
    if (!o->pty && !o->reset_on_open) {
        argp_error(state, "--no-reset needs --pty");
    }
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
    options_t *o = state->input;

    switch (key) {
    case 'f': o->fast = true; break;
    case 't': o->for_seconds = numbers_real(state, "--for", arg, 1e-6, 1e9); break;
    case KEY_LINGER: o->linger_ms = numbers_real(state, "--linger", arg, 1, 1e9); break;
    case KEY_WIRE: parse_wire(state, o, arg); break;
    case 'E': o->eeprom = arg; break;
    case 'b': o->baud = numbers_real(state, "--baud", arg, 300, 2e6); break;
    case 'p': o->pty = true; break;
    case 'l': o->link = arg; break;
    case KEY_NO_RESET: o->reset_on_open = false; break;
    case 'e': o->edges = arg; break;
    case KEY_VCD: o->vcd = arg; break;
    case 'P': parse_pins(state, o, arg); break;
    case KEY_NO_STATUS: o->status = false; break;
    case KEY_STEPS_PER_REV: o->steps_per_rev = (unsigned)numbers_whole(state, "--steps-per-rev", arg, 1, 100000); break;
    case KEY_MICROSTEPS: o->microsteps = (unsigned)numbers_whole(state, "--microsteps", arg, 1, 256); break;
    case KEY_CW: o->cw_level = (uint8_t)numbers_whole(state, "--cw", arg, 0, 1); break;
    case KEY_NODES:
        o->nodes = (unsigned)numbers_whole(state, "--nodes", arg, 1, OPTIONS_NODES_MAX);
        o->pty = true;
        break;
    case KEY_BUS_BAUD: o->bus_baud = numbers_real(state, "--bus-baud", arg, 300, 1e6); break;
    case ARGP_KEY_ARG:
        if (o->image != NULL) {
            argp_error(state, "one image at a time: '%s' is one too many", arg);
        }
        o->image = arg;
        break;
    case ARGP_KEY_END: check(state, o); break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

void options_parse(options_t *o, int argc, char **argv)
{
    static const struct argp parser = {options, parse, "IMAGE.elf", doc, NULL, NULL, NULL};

    *o = (options_t){
        .baud = 38400,
        .bus_baud = 38400,
        .linger_ms = 300,
        .reset_on_open = true,
        .pins = {post_find("clk"), post_find("dir")},
        .pin_count = 2,
        .status = true,
        .steps_per_rev = 200,
        .microsteps = 1,
    };
    argp_err_exit_status = EXIT_USAGE;
    argp_parse(&parser, argc, argv, 0, NULL, o);
}
