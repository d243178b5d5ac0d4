/* INT0, INT1 and the three pin-change groups, datasheet 13. */
#include "board_internal.h"

#include <stdlib.h>

#define REG_PCIFR 0x3B
#define REG_EIFR 0x3C
#define REG_EIMSK 0x3D
#define REG_PCICR 0x68
#define REG_EICRA 0x69
#define REG_PCMSK0 0x6B

/* From a change of the pad to the flag. 13.1, figure 13-1: pin_sync, pcint_syn, pcint_setflag and PCIF follow each other
 * at clock edges. INT0 and INT1 are sampled (13.2.1) and have no further stages. */
#define PCINT_DELAY_CYCLES 4
#define INT_DELAY_CYCLES 2

#define PORT_D 2
#define INT0_BIT 2 /* PD2, PD3 */
#define PENDING_MAX 16

enum { SENSE_LOW_LEVEL, SENSE_ANY_EDGE, SENSE_FALLING, SENSE_RISING };

/* A flag on its way through the synchroniser. The delays differ by little, so a short list in order of arrival. */
typedef struct {
    uint64_t due;
    uint8_t port_d; /* INT: levels of port D */
    uint8_t pcifr;  /* PCINT: flags to set */
    uint8_t changed;
} pending_t;

struct extint {
    pending_t pending[PENDING_MAX];
    int count;
    uint8_t port_d; /* behind the synchroniser */
};

static void update_lines(board_t *b, uint64_t cycle)
{
    uint8_t pcint = REG(b, REG_PCIFR) & REG(b, REG_PCICR);
    for (int group = 0; group < 3; group++)
        irq_set(b, VECTOR_PCINT0 + group, pcint >> group & 1, cycle);
    for (int n = 0; n < 2; n++) {
        int sense = REG(b, REG_EICRA) >> (2 * n) & 3;
        bool low = !(b->extint->port_d >> (INT0_BIT + n) & 1);
        bool flag = sense == SENSE_LOW_LEVEL ? low : REG(b, REG_EIFR) >> n & 1;
        irq_set(b, VECTOR_INT0 + n, flag && (REG(b, REG_EIMSK) >> n & 1), cycle);
    }
}

static void apply(board_t *b, const pending_t *p)
{
    struct extint *e = b->extint;

    REG(b, REG_PCIFR) |= p->pcifr;
    if (p->pcifr == 0)
        e->port_d = p->port_d;
    for (int n = 0; n < 2; n++) {
        int sense = REG(b, REG_EICRA) >> (2 * n) & 3;
        int level = p->port_d >> (INT0_BIT + n) & 1;
        if (!(p->changed >> (INT0_BIT + n) & 1))
            continue;
        if (sense == SENSE_ANY_EDGE || (sense == SENSE_FALLING && !level) || (sense == SENSE_RISING && level))
            REG(b, REG_EIFR) |= (uint8_t)(1u << n);
    }
    update_lines(b, p->due);
}

static void plan(board_t *b);

static void pending_due(board_t *b, uint64_t cycle)
{
    struct extint *e = b->extint;
    for (int i = 0; i < e->count;) {
        if (e->pending[i].due > cycle) {
            i++;
            continue;
        }
        apply(b, &e->pending[i]);
        e->count--;
        for (int j = i; j < e->count; j++)
            e->pending[j] = e->pending[j + 1];
    }
    plan(b);
}

static void plan(board_t *b)
{
    uint64_t due = NEVER;
    for (int i = 0; i < b->extint->count; i++)
        if (b->extint->pending[i].due < due)
            due = b->extint->pending[i].due;
    event_at(b, EVENT_EXTINT, due, pending_due);
}

static void add(board_t *b, pending_t p)
{
    struct extint *e = b->extint;
    if (e->count == PENDING_MAX)
        pending_due(b, e->pending[0].due); /* cannot be: each stage holds one change a cycle */
    e->pending[e->count++] = p;
    plan(b);
}

void extint_pins_changed(board_t *b, int port, uint8_t levels, uint8_t changed, uint64_t cycle)
{
    const uint8_t ints = (uint8_t)(3u << INT0_BIT);

    if (port == PORT_D && (changed & ints))
        add(b, (pending_t){cycle + INT_DELAY_CYCLES, levels, 0, changed & ints});
    if (changed & REG(b, REG_PCMSK0 + port))
        add(b, (pending_t){cycle + PCINT_DELAY_CYCLES, 0, (uint8_t)(1u << port), 0});
}

uint8_t extint_watched(const board_t *b, int port)
{
    uint8_t ints = port == PORT_D ? (uint8_t)(3u << INT0_BIT) : 0;
    return REG(b, REG_PCMSK0 + port) | ints;
}

/* -- registers ------------------------------------------------------------------------------------------------------ */

static void write_flags(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    REG(b, address) &= (uint8_t)~reg_written_ones(b, value);
    update_lines(b, cycle);
}

static void write_control(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    REG(b, address) = value;
    update_lines(b, cycle);
}

static void write_pcmsk(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    timers_sync(b, cycle);
    REG(b, address) = value;
    timers_replan(b);
}

static void ack(board_t *b, int vector, uint64_t cycle)
{
    if (vector >= VECTOR_PCINT0)
        REG(b, REG_PCIFR) &= (uint8_t) ~(1u << (vector - VECTOR_PCINT0));
    else
        REG(b, REG_EIFR) &= (uint8_t) ~(1u << (vector - VECTOR_INT0));
    update_lines(b, cycle);
}

/* -- life ------------------------------------------------------------------------------------------------------------ */

void extint_init(board_t *b)
{
    b->extint = calloc(1, sizeof *b->extint);
    if (b->extint == NULL)
        abort();
    reg_on_write(b, REG_PCIFR, write_flags);
    reg_on_write(b, REG_EIFR, write_flags);
    reg_on_write(b, REG_EIMSK, write_control);
    reg_on_write(b, REG_EICRA, write_control);
    reg_on_write(b, REG_PCICR, write_control);
    for (int port = 0; port < 3; port++)
        reg_on_write(b, (uint16_t)(REG_PCMSK0 + port), write_pcmsk);
    for (int vector = VECTOR_INT0; vector <= VECTOR_PCINT2; vector++)
        irq_on_ack(b, vector, ack);
}

void extint_reset(board_t *b)
{
    struct extint *e = b->extint;
    e->count = 0;
    event_cancel(b, EVENT_EXTINT);
    e->port_d = 0;
    for (int n = 0; n < 2; n++)
        if (pin_level(b, BOARD_PIN('D', INT0_BIT + n)))
            e->port_d |= (uint8_t)(1u << (INT0_BIT + n));
}

void extint_free(board_t *b)
{
    free(b->extint);
}
