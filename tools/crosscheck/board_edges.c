/* The board's half of the cross-check: types lines into the simulated Nano at given cycles and lists the rising edges
 * of clk with the level of dir.
 *
 * Usage:   board_edges image.elf script edges
 * Script:  one order a line, cycles in rising order:
 *            type <cycle> <bytes in hex>   sent back to back at 38,400 Bd, the first start bit at that cycle
 *            end <cycle>                   the run ends there
 * Edges:   `<cycle> <level of dir>` for each rising edge; then `text <bytes in hex>`, all that the board has sent.
 * Units:   CPU cycles since power-on.
 * Errors:  exit status 1 and a line on stderr. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"

#define LINE_BYTES 1024

static const board_pin_t clk = BOARD_PIN('B', 2);
static const board_pin_t dir = BOARD_PIN('B', 5);

typedef struct {
    FILE *edges;
    int dir_level;
} run_t;

static void on_edge(void *ctx, board_edge_t edge)
{
    run_t *run = ctx;
    if (edge.pin == dir)
        run->dir_level = edge.level;
    else if (edge.level)
        fprintf(run->edges, "%" PRIu64 " %d\n", edge.cycle, run->dir_level);
}

static bool run_to(board_t *board, uint64_t cycle)
{
    if (board_run_to(board, cycle) != BOARD_CRASHED)
        return true;
    fprintf(stderr, "board_edges: %s\n", board_crash(board));
    return false;
}

static bool type_bytes(board_t *board, const char *hex)
{
    unsigned byte;
    for (; sscanf(hex, "%2x", &byte) == 1; hex += 2) {
        uint8_t sent = (uint8_t)byte;
        board_uart_send(board, &sent, 1);
    }
    return *hex == '\0' || *hex == '\n';
}

static bool obey(board_t *board, const char *line)
{
    uint64_t cycle;
    int used = 0;
    if (sscanf(line, "type %" SCNu64 " %n", &cycle, &used) == 1 && used)
        return run_to(board, cycle) && type_bytes(board, line + used);
    if (sscanf(line, "end %" SCNu64, &cycle) == 1)
        return run_to(board, cycle);
    fprintf(stderr, "board_edges: not an order: %s", line);
    return false;
}

static bool play(const char *image, FILE *script, FILE *edges)
{
    board_t *board = board_new(image, NULL);
    if (!board)
        return false;
    run_t run = {.edges = edges, .dir_level = board_pin_level(board, dir) > 0};
    board_record(board, clk, true);
    board_record(board, dir, true);
    board_on_edge(board, on_edge, &run);
    bool ok = true;
    char line[LINE_BYTES];
    while (ok && fgets(line, sizeof line, script))
        ok = obey(board, line);
    fputs("text ", edges);
    for (const char *sent = board_uart_text(board); *sent; sent++)
        fprintf(edges, "%02x", (unsigned char)*sent);
    fputc('\n', edges);
    board_free(board);
    return ok;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fputs("usage: board_edges image.elf script edges\n", stderr);
        return EXIT_FAILURE;
    }
    FILE *script = fopen(argv[2], "r");
    if (!script) {
        perror(argv[2]);
        return EXIT_FAILURE;
    }
    FILE *edges = fopen(argv[3], "w");
    if (!edges) {
        perror(argv[3]);
        fclose(script);
        return EXIT_FAILURE;
    }
    bool ok = play(argv[1], script, edges);
    fclose(script);
    ok = fclose(edges) == 0 && ok;
    return ok ? EXIT_SUCCESS : EXIT_FAILURE;
}
