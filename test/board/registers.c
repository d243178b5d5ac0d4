/* Register hooks, and the exact cycle at which the running instruction touches a register. */
#include "board_internal.h"

static uint16_t running_opcode(const board_t *b)
{
    const uint8_t *at = b->avr->flash + b->avr->pc; /* simavr moves the PC on after the instruction */
    return (uint16_t)(at[0] | at[1] << 8);
}

static bool is_sbi(uint16_t opcode)
{
    return (opcode & 0xFF00) == 0x9A00;
}

static bool is_cbi(uint16_t opcode)
{
    return (opcode & 0xFF00) == 0x9800;
}

/* OUT takes one cycle; STS, ST, STD, SBI and CBI two. The register changes at the edge that ends the instruction. */
static uint64_t write_cycle(const board_t *b)
{
    return b->avr->cycle + ((running_opcode(b) & 0xF800) == 0xB800 ? 1 : 2);
}

/* IN and the bit instructions read in their first cycle, LDS, LD and LDD in their second. */
static uint64_t read_cycle(const board_t *b)
{
    uint16_t opcode = running_opcode(b);
    bool first = (opcode & 0xF800) == 0xB000 || (opcode & 0xFC00) == 0x9800;
    return b->avr->cycle + (first ? 0 : 1);
}

uint8_t reg_written_ones(const board_t *b, uint8_t value)
{
    uint16_t opcode = running_opcode(b);
    if (is_sbi(opcode))
        return (uint8_t)(1u << (opcode & 7));
    if (is_cbi(opcode))
        return 0;
    return value;
}

static uint8_t read_hook(avr_t *avr, avr_io_addr_t address, void *param)
{
    board_t *b = param;
    uint64_t cycle = read_cycle(b);
    (void)avr;
    events_run(b, cycle);
    return b->reg_read[address](b, address, cycle);
}

static void write_hook(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param)
{
    board_t *b = param;
    uint64_t cycle = write_cycle(b);
    bool nested = b->in_event;
    uint64_t outer = b->now;
    (void)avr;

    events_run(b, cycle);
    b->in_event = true; /* an edge that this write makes carries its cycle */
    b->now = cycle;
    b->reg_write[address](b, address, value, cycle);
    b->in_event = nested;
    b->now = outer;
}

void reg_on_read(board_t *b, uint16_t address, reg_read_fn fn)
{
    if (b->reg_read[address] == NULL)
        avr_register_io_read(b->avr, address, read_hook, b);
    b->reg_read[address] = fn;
}

void reg_on_write(board_t *b, uint16_t address, reg_write_fn fn)
{
    if (b->reg_write[address] == NULL)
        avr_register_io_write(b->avr, address, write_hook, b);
    b->reg_write[address] = fn;
}
