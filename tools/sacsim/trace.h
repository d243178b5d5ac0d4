/* Recordings of edges: compact binary, CSV, or a value change dump (VCD).
 *
 * Compact file, version 1 (tools/edges.py reads it). Numbers are little-endian; a varint is LEB128, seven bits a byte,
 * the lowest first, bit 7 set in all but the last byte:
 *
 *     8 bytes  "SACEDGE" and the version, 1
 *     u32      CPU clock, Hz: the unit of time is one cycle of it
 *     u64      cycle at which the recording starts
 *     u8       n, number of pins, 1 to 24
 *     u8       b, bits of a pin's index: the smallest b with 2^b > n
 *     n times  u8 level at the start, u8 length of the name, the name in ASCII
 *
 *     records  varint of (cycles since the previous record) << (b + 1) | index << 1 | level
 *              index n: no edge but the end of the recording, always the last record; a file without it was cut short
 *
 * A step of clk at 33 kHz takes four bytes.
 *
 * CSV: a header line, then cycle,time_s,pin,level for each edge.
 * VCD: time unit 100 ps, so that the 62.5 ns of a cycle are exactly 625 of them.
 *
 * Units:   CPU cycles of 62.5 ns.
 * Errors:  trace_open() returns NULL and trace_close() false after printing the reason on stderr.
 * Tests:   test/sim/test_sacsim.py. */
#ifndef SACSIM_TRACE_H
#define SACSIM_TRACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "posts.h"
#include "test/board/board.h"

typedef struct trace trace_t;

typedef enum { TRACE_COMPACT, TRACE_CSV, TRACE_VCD } trace_format_t;

/* levels[i]: level of pins[i] at this cycle. */
trace_t *trace_open(const char *path, trace_format_t format, const post_t *const *pins, const uint8_t *levels,
                    size_t pin_count, uint64_t cycle);

/* In the order of time; edges of pins that are not in the recording are passed over. */
void trace_edge(trace_t *t, board_edge_t edge);

/* True as long as all could be written. */
bool trace_ok(const trace_t *t);

bool trace_close(trace_t *t, uint64_t cycle);

#endif
