/* The Ninja's commands: bytes to registers, moves and macros.
 *
 * A command is a letter, in either case, some with a number behind it; what is none is ignored. Bytes wait in a FIFO
 * of 16 until they are interpreted; where it is full, new ones are lost. A letter with a number takes effect when the
 * first byte arrives that no longer belongs to it. M, S, I, C and P wait until motion is over; P
 * and its pause hold up everything behind them. Backspace and Ctrl-R are never in the FIFO.
 *
 *   X Y  number  where to go: saturates at the limits        (    begins a macro's definition
 *   V    number  velocity 0..63, 63 if outside               )    ends it
 *   M S          go there, at V or at top speed              R    runs the macro from its beginning
 *   I            go by X, Y; they become where it leads      ^H   halt: motion, pause, macro, FIFO; keeps the macro
 *   C            centring                                    ^R   the same, then all as after power-up
 *   P    number  pause: tenths of a second, 16 bits unsigned
 *
 * A macro has 64 bytes: one a letter, two a number, missing ones too. A command that does not fit is left out. What
 * arrives while it runs waits in the FIFO.
 * Units:   steps; tenths of a second. Numbers saturate to -32768..65535.
 * Context: main loop; pure. Errors: none reported: there is nobody to report to.
 * Source:  seed lines N1-99; decisions A-NIN-03 to -12, -16. Tests: test/host/test_ninja_commands.c */
#ifndef NINJA_COMMANDS_H
#define NINJA_COMMANDS_H

#include <stdbool.h>
#include <stdint.h>

/* Registers as after power-up, no macro, nothing waiting; begins centring. */
void commands_init(void);

/* A byte from the line. */
void commands_receive(uint8_t byte);

/* Interprets one byte, or executes one command of the macro; true if it could. */
bool commands_poll(void);

#endif
