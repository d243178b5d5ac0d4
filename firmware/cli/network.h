/* What packets mean: commands from the network and their answers, messages, and what the operator sends.
 *
 * From the network. A body is a command line, or with a space or a dot in front a message. A command is executed as one
 * typed at the terminal, with nothing displayed, and answered with ACK or, refused, with NAK; a broadcast is never
 * answered, and $ not accepted from one. In strict mode (k = 2) a command that comes again, from one of the four origins
 * heard last, gets the same answer and is not executed again; a NAK carries the error.
 * From the terminal. `85m200` sends a command to node 85, `85 text` a message, `/...` to where the last message came
 * from, `0...` to everybody. One at a time: the next line waits until the answer has come, or none within
 * NETWORK_ANSWER_128US and NETWORK_ANSWER_CHARACTERS. The answer is shown as `K` or `NAK`, a message as `10:85> text`.
 * Context: main loop.
 * Errors:  STATUS_NO_ANSWER, STATUS_NOBODY, and those of the command.
 * Tests:   test/host/test_network.c; test_image_network.c, test_image_line.c and test_image_nodes.c in test/image
 * Source:  manual lines 171-215, 797-799, 823-835; decisions 0.4 and section 8. */
#ifndef CLI_NETWORK_H
#define CLI_NETWORK_H

#include <stdbool.h>
#include <stdint.h>
#include "base/status.h"

#define NETWORK_ANSWER_128US 400u /* 51 ms */
#define NETWORK_ANSWER_CHARACTERS 128

void network_init(void);
uint8_t network_poll(void); /* not 0: it did something, or there is more to do */

/* A line for another node. STATUS_WAIT: not yet, ask again. */
status_t network_send(uint8_t destination, const char *text);

uint8_t network_last_origin(void); /* of a message; 0: none so far */

/* Prints a piece of what has arrived; false: there is nothing. At most TEXT_PIECE_BYTES. */
bool network_show(void);

#endif
