/* The ops signals: which says that a command is being executed.
 *
 * OPSA rises with the first pulse of each command (its period, less than 10 us before the edge) and falls at the end of its
 * last interval; OPSB is its inverse. One pair for every command, however short; none for single pulses, nor for a command
 * that is ended in its start wait. Soft ops: at the same moments DC1 and DC2 go to the terminal port as bare bytes; one
 * that finds no room there is left out, nothing waits.
 * Context: main loop. Errors: none.
 * Tests:   test/host/test_ops.c, test/image/test_image_ops.c
 * Source:  manual lines 616-620, 654, 818, 857, 993-995; decisions A-OPS-01, -02, -04. */
#ifndef QUEUE_OPS_H
#define QUEUE_OPS_H

#include <stdbool.h>

#define OPS_BEGIN 0x11u /* DC1 */
#define OPS_END 0x12u   /* DC2 */

void ops_poll(void); /* call often */

#endif
