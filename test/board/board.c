/* The board's life and its processor loop. */
#include "board_internal.h"

#include <simavr/sim_core.h>

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REG_SMCR 0x53
#define SMCR_SE 0x01
#define OPCODE_RETI 0x9518
#define OPCODE_RJMP_SELF 0xCFFF

/* -- life ------------------------------------------------------------------------------------------------------------ */

static uint16_t opcode_at(const avr_t *avr, uint32_t pc)
{
    return (uint16_t)(avr->flash[pc] | avr->flash[pc + 1] << 8);
}

static void put_opcode(avr_t *avr, uint32_t pc, uint16_t opcode)
{
    avr->flash[pc] = (uint8_t)opcode;
    avr->flash[pc + 1] = (uint8_t)(opcode >> 8);
}

static void hang_ends(board_t *b)
{
    if (b->hangs)
        put_opcode(b->avr, b->hangs_at, b->hangs_instead_of);
    b->hangs = false;
}

void board_hang(board_t *b)
{
    hang_ends(b);
    b->hangs = true;
    b->hangs_at = b->avr->pc;
    b->hangs_instead_of = opcode_at(b->avr, b->hangs_at);
    put_opcode(b->avr, b->hangs_at, OPCODE_RJMP_SELF);
}

void cpu_reset(board_t *b)
{
    avr_t *avr = b->avr;

    hang_ends(b);
    memset(avr->data, 0, BOARD_RAM_START); /* working registers are undefined on the chip; 0 is repeatable */
    memset(avr->sreg, 0, sizeof avr->sreg);
    avr->interrupt_state = 0;
    avr->data[R_SPL] = BOARD_RAMEND & 0xFF;
    avr->data[R_SPH] = BOARD_RAMEND >> 8;
    avr->pc = 0;
    avr->state = cpu_Running;
    b->crash[0] = '\0';
    b->irq_requests = 0;
    b->irq_hold = false;
    b->was_reset = true;
    measures_reset(b);
#define MODEL_RESET(name) name##_reset(b);
    BOARD_MODELS(MODEL_RESET)
#undef MODEL_RESET
}

board_t *board_new(const char *elf_path, const uint8_t *eeprom)
{
    board_t *b = calloc(1, sizeof *b);
    if (b == NULL)
        return NULL;

    if (!simavr_start(b)) {
        free(b);
        return NULL;
    }
    for (int slot = 0; slot < EVENT_SLOTS; slot++)
        b->event_cycle[slot] = NEVER;
    b->next_event = NEVER;
    if (!image_load(b, elf_path)) {
        image_free(b);
        simavr_stop(b);
        free(b);
        return NULL;
    }
#define MODEL_INIT(name) name##_init(b);
    BOARD_MODELS(MODEL_INIT)
#undef MODEL_INIT
    eeprom_load(b, eeprom);
    board_reset(b, BOARD_RESET_POWER_ON);
    board_measures_clear(b);
    return b;
}

void board_free(board_t *b)
{
    if (b == NULL)
        return;
#define MODEL_FREE(name) name##_free(b);
    BOARD_MODELS(MODEL_FREE)
#undef MODEL_FREE
    image_free(b);
    simavr_stop(b);
    free(b);
}

uint64_t board_cycle(const board_t *b)
{
    return board_time(b);
}

/* -- crashes ---------------------------------------------------------------------------------------------------- */

void board_crashed(board_t *b, const char *format, ...)
{
    va_list arguments;
    if (b->crash[0] == '\0') {
        va_start(arguments, format);
        vsnprintf(b->crash, sizeof b->crash, format, arguments);
        va_end(arguments);
    }
    b->avr->state = cpu_Crashed;
}

const char *board_crash(const board_t *b)
{
    return b->crash[0] ? b->crash : NULL;
}

/* -- the processor loop -------------------------------------------------------------------------------------------- */

/* The stack pointer left the range seen so far. While OUT SPH and OUT SPL move it in two steps it may point anywhere:
 * only the second counts. avr-gcc writes SPH first, restores SREG between the two and never takes longer. */
#define HALF_WRITTEN_CYCLES 3
#define IS_OUT_SPH(opcode) (((opcode)&0xFE0F) == 0xBE0E)
#define IS_OUT_SPL(opcode) (((opcode)&0xFE0F) == 0xBE0D)

static void stack_moved(board_t *b, uint16_t sp, uint32_t pc)
{
    uint16_t opcode = opcode_at(b->avr, pc);

    if (IS_OUT_SPH(opcode))
        b->stack_whole_at = b->avr->cycle + HALF_WRITTEN_CYCLES;
    if (b->avr->cycle < b->stack_whole_at && !IS_OUT_SPL(opcode))
        return;
    if (sp > BOARD_RAMEND)
        board_crashed(b, "stack pointer 0x%04x above RAM at 0x%04x", sp, (unsigned)pc);
    else if (sp + 1u < b->stack_limit)
        board_crashed(b, "stack pointer 0x%04x below the end of .bss 0x%04x at 0x%04x", sp, b->stack_limit,
                      (unsigned)pc);
    else if (sp < b->measures.stack_low)
        b->measures.stack_low = sp;
}

/* After SLEEP. Every sleep mode is treated as IDLE: its clocks run on. */
static void fall_asleep(board_t *b)
{
    if (REG(b, REG_SMCR) & SMCR_SE)
        b->sleep_since = b->avr->cycle;
    else
        b->avr->state = cpu_Running; /* 10.11.1: without SE the instruction does nothing */
}

/* One instruction, one interrupt entry, or the sleep up to the next event. */
static inline void step(board_t *b, uint64_t limit)
{
    avr_t *avr = b->avr;
    uint32_t pc;
    uint16_t sp;

    if (b->next_event <= avr->cycle)
        events_run_until(b, avr->cycle);
    if (b->irq_requests != 0 && irq_dispatch(b))
        return;
    if (__builtin_expect(avr->state != cpu_Running, 0)) {
        if (avr->state == cpu_Sleeping)
            avr->cycle = b->next_event < limit ? b->next_event : limit;
        return;
    }

    pc = avr->pc;
    b->was_reset = false;
    avr->pc = avr_run_one(avr);
    if (__builtin_expect(b->was_reset, 0)) {
        avr->pc = 0; /* a reset inside the instruction: simavr has moved on to the next one */
        return;
    }
    b->irq_hold = avr->interrupt_state != 0; /* simavr: I has just been set */
    avr->interrupt_state = 0;

    if (avr->sreg[S_I] != b->i_seen)
        measures_i_changed(b, pc);
    if (b->isr_depth > 0 && opcode_at(avr, pc) == OPCODE_RETI) {
        b->irq_hold = true;
        measures_reti(b);
    }
    sp = (uint16_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
    if (__builtin_expect((uint16_t)(sp - b->measures.stack_low) > BOARD_RAMEND - b->measures.stack_low, 0))
        stack_moved(b, sp, pc);
    if (__builtin_expect(avr->pc >= b->code_end, 0))
        board_crashed(b, "jump out of the program to 0x%04x at 0x%04x", (unsigned)avr->pc, (unsigned)pc);
    if (__builtin_expect(avr->state == cpu_Sleeping, 0))
        fall_asleep(b);
}

static bool crashed(board_t *b)
{
    if (__builtin_expect(b->avr->state == cpu_Running || b->avr->state == cpu_Sleeping, 1))
        return false;
    board_crashed(b, "simavr stopped at 0x%04x", (unsigned)b->avr->pc);
    return true;
}

board_run_t board_run_to(board_t *b, uint64_t cycle)
{
    while (b->avr->cycle < cycle) {
        if (crashed(b))
            return BOARD_CRASHED;
        step(b, cycle);
    }
    events_run(b, b->avr->cycle);
    return crashed(b) ? BOARD_CRASHED : BOARD_RAN;
}

board_run_t board_run_for(board_t *b, uint64_t cycles)
{
    return board_run_to(b, b->avr->cycle + cycles);
}

board_run_t board_run_to_pc(board_t *b, uint16_t byte_address, uint64_t limit_cycles)
{
    uint64_t limit = b->avr->cycle + limit_cycles;
    while (b->avr->cycle < limit) {
        if (crashed(b))
            return BOARD_CRASHED;
        if (b->avr->pc == byte_address && b->avr->state == cpu_Running)
            return BOARD_MATCHED;
        step(b, limit);
    }
    return crashed(b) ? BOARD_CRASHED : BOARD_RAN;
}

board_run_t board_run_past(board_t *b, uint16_t byte_address, uint64_t limit_cycles)
{
    board_run_t how = board_run_to_pc(b, byte_address, limit_cycles);
    if (how != BOARD_MATCHED)
        return how;
    enum { SPL = 0x5D, SPH = 0x5E };
    uint16_t top = (uint16_t)(board_peek8(b, SPL) | board_peek8(b, SPH) << 8);
    uint16_t words = (uint16_t)(board_peek8(b, (uint16_t)(top + 1)) << 8 | board_peek8(b, (uint16_t)(top + 2)));
    return board_run_to_pc(b, (uint16_t)(2 * words), limit_cycles);
}

board_run_t board_run_until(board_t *b, bool (*cond)(board_t *, void *), void *ctx, uint64_t limit_cycles)
{
    uint64_t limit = b->avr->cycle + limit_cycles;
    for (;;) {
        if (crashed(b))
            return BOARD_CRASHED;
        events_run(b, b->avr->cycle);
        if (cond(b, ctx))
            return BOARD_MATCHED;
        if (b->avr->cycle >= limit)
            return BOARD_RAN;
        step(b, limit);
    }
}

/* -- memory ---------------------------------------------------------------------------------------------------------- */

uint8_t board_peek8(const board_t *b, uint16_t address)
{
    return address <= BOARD_RAMEND ? b->avr->data[address] : 0xFF;
}

uint16_t board_peek16(const board_t *b, uint16_t address)
{
    return (uint16_t)(board_peek8(b, address) | board_peek8(b, (uint16_t)(address + 1)) << 8);
}

uint32_t board_peek32(const board_t *b, uint16_t address)
{
    return board_peek16(b, address) | (uint32_t)board_peek16(b, (uint16_t)(address + 2)) << 16;
}

void board_poke8(board_t *b, uint16_t address, uint8_t value)
{
    if (address <= BOARD_RAMEND)
        b->avr->data[address] = value;
}

void board_poke16(board_t *b, uint16_t address, uint16_t value)
{
    board_poke8(b, address, (uint8_t)value);
    board_poke8(b, (uint16_t)(address + 1), (uint8_t)(value >> 8));
}

void board_poke32(board_t *b, uint16_t address, uint32_t value)
{
    board_poke16(b, address, (uint16_t)value);
    board_poke16(b, (uint16_t)(address + 2), (uint16_t)(value >> 16));
}
