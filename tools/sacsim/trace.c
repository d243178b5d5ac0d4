#include "trace.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console.h"

enum { VERSION = 1, VCD_UNITS_PER_CYCLE = 625, PIN_NUMBERS = 24, BUFFER_BYTES = 1 << 18 };

struct trace {
    char *path;
    FILE *file;
    trace_format_t format;
    size_t pin_count;
    unsigned index_bits;
    uint64_t last_cycle;       /* of the previous record */
    int8_t index[PIN_NUMBERS]; /* by pin number; -1: not recorded */
    char name[PIN_NUMBERS][16];
};

static void put_le(FILE *f, uint64_t value, unsigned bytes)
{
    for (unsigned i = 0; i < bytes; i++) {
        putc((int)(value >> (8 * i) & 0xff), f);
    }
}

static void put_varint(FILE *f, uint64_t value)
{
    while (value >= 0x80) {
        putc_unlocked((int)(value & 0x7f) | 0x80, f);
        value >>= 7;
    }
    putc_unlocked((int)value, f);
}

static void compact_header(const trace_t *t, const uint8_t *levels, uint64_t cycle)
{
    fputs("SACEDGE", t->file);
    putc(VERSION, t->file);
    put_le(t->file, BOARD_CPU_HZ, 4);
    put_le(t->file, cycle, 8);
    putc((int)t->pin_count, t->file);
    putc((int)t->index_bits, t->file);
    for (size_t i = 0; i < t->pin_count; i++) {
        putc(levels[i], t->file);
        putc((int)strlen(t->name[i]), t->file);
        fputs(t->name[i], t->file);
    }
}

/* The identifier of a VCD variable: one printable character each. */
static char vcd_id(size_t index)
{
    return (char)('!' + index);
}

static void vcd_header(const trace_t *t, const uint8_t *levels, uint64_t cycle)
{
    fputs("$comment SAC's simulated Arduino Nano: 625 units of time are one cycle of its 16 MHz clock $end\n"
          "$timescale 100 ps $end\n"
          "$scope module nano $end\n",
          t->file);
    for (size_t i = 0; i < t->pin_count; i++) {
        fprintf(t->file, "$var wire 1 %c %s $end\n", vcd_id(i), t->name[i]);
    }
    fprintf(t->file, "$upscope $end\n$enddefinitions $end\n#%" PRIu64 "\n$dumpvars\n", cycle * VCD_UNITS_PER_CYCLE);
    for (size_t i = 0; i < t->pin_count; i++) {
        fprintf(t->file, "%u%c\n", levels[i] & 1u, vcd_id(i));
    }
    fputs("$end\n", t->file);
}

static void vcd_time(trace_t *t, uint64_t cycle)
{
    if (cycle != t->last_cycle) {
        fprintf(t->file, "#%" PRIu64 "\n", cycle * VCD_UNITS_PER_CYCLE);
        t->last_cycle = cycle;
    }
}

trace_t *trace_open(const char *path, trace_format_t format, const post_t *const *pins, const uint8_t *levels,
                    size_t pin_count, uint64_t cycle)
{
    trace_t *t = calloc(1, sizeof *t);

    if (t == NULL || (t->path = strdup(path)) == NULL || (t->file = fopen(path, "wbe")) == NULL) {
        console_say("cannot write %s: %s", path, strerror(errno));
        if (t != NULL) {
            free(t->path);
        }
        free(t);
        return NULL;
    }
    setvbuf(t->file, NULL, _IOFBF, BUFFER_BYTES);
    t->format = format;
    t->pin_count = pin_count;
    t->last_cycle = cycle;
    while (1u << t->index_bits <= pin_count) {
        t->index_bits++;
    }
    memset(t->index, -1, sizeof t->index);
    for (size_t i = 0; i < pin_count; i++) {
        t->index[pins[i]->pin] = (int8_t)i;
        memcpy(t->name[i], pins[i]->name, sizeof t->name[i]);
    }
    switch (format) {
    case TRACE_COMPACT: compact_header(t, levels, cycle); break;
    case TRACE_CSV: fputs("cycle,time_s,pin,level\n", t->file); break;
    case TRACE_VCD: vcd_header(t, levels, cycle); break;
    }
    return t;
}

static void compact_record(trace_t *t, uint64_t cycle, unsigned index, unsigned level)
{
    put_varint(t->file, (cycle - t->last_cycle) << (t->index_bits + 1) | index << 1 | level);
    t->last_cycle = cycle;
}

void trace_edge(trace_t *t, board_edge_t edge)
{
    int index = edge.pin < PIN_NUMBERS ? t->index[edge.pin] : -1;

    if (index < 0) {
        return;
    }
    switch (t->format) {
    case TRACE_COMPACT: compact_record(t, edge.cycle, (unsigned)index, edge.level & 1u); break;
    case TRACE_CSV:
        /* seconds with the ten decimals of 62.5 ns: nothing is rounded */
        fprintf(t->file, "%" PRIu64 ",%" PRIu64 ".%010" PRIu64 ",%s,%u\n", edge.cycle,
                (uint64_t)(edge.cycle / BOARD_CPU_HZ), (uint64_t)(edge.cycle % BOARD_CPU_HZ * 625), t->name[index],
                edge.level & 1u);
        break;
    case TRACE_VCD:
        vcd_time(t, edge.cycle);
        fprintf(t->file, "%u%c\n", edge.level & 1u, vcd_id((size_t)index));
        break;
    }
}

bool trace_ok(const trace_t *t)
{
    return !ferror(t->file);
}

bool trace_close(trace_t *t, uint64_t cycle)
{
    bool ok;

    switch (t->format) {
    case TRACE_COMPACT: compact_record(t, cycle, (unsigned)t->pin_count, 0); break;
    case TRACE_CSV: break;
    case TRACE_VCD: vcd_time(t, cycle); break; /* how long the last levels lasted */
    }
    ok = !ferror(t->file);
    ok = fclose(t->file) == 0 && ok;
    if (!ok) {
        console_say("%s is incomplete: %s", t->path, errno != 0 ? strerror(errno) : "it could not be written");
    }
    free(t->path);
    free(t);
    return ok;
}
