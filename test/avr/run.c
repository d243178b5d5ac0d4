/* Runs a Unity test that was compiled for the AVR on the simulated board and passes on what it reports.
 *
 * Usage: run IMAGE.elf. Exit code 0 when main() has returned; Unity's own lines tell what passed. */
#include <stdio.h>
#include "board.h"

#define BAUD 1000000
#define LIMIT_CYCLES (3600 * BOARD_CPU_HZ)
#define LAST_BYTES_CYCLES 1000 /* two bytes are still in the transmitter when main() returns */

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: %s IMAGE.elf\n", argv[0]);
        return 2;
    }
    board_t *board = board_new(argv[1], NULL);
    if (!board)
        return 2;
    board_uart_baud(board, BAUD);

    uint16_t end;
    if (!board_symbol(board, "__stop_program", &end)) {
        fprintf(stderr, "%s: no __stop_program\n", argv[1]);
        return 2;
    }
    board_run_t ended = board_run_to_pc(board, end, LIMIT_CYCLES);
    board_run_for(board, LAST_BYTES_CYCLES);
    fputs(board_uart_text(board), stdout);
    if (ended == BOARD_CRASHED)
        printf("crashed: %s\n", board_crash(board));
    else if (ended != BOARD_MATCHED)
        printf("main() did not return\n");
    board_free(board);
    return ended == BOARD_MATCHED ? 0 : 1;
}
