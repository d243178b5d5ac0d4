/* EEPROM of the simulated board: DS40002061 section 8.4 and 8.6 (registers).
 *
 * A cell changes when its write ends. Resets do not stop a write, a loss of power does (8.4.2): the cell is left as the
 * test wants it torn. Figures are table 8-2's: 3.4 ms for erase and write, 1.8 ms for one of them. */
#include "board_internal.h"

#include <stdlib.h>
#include <string.h>

enum { EECR = 0x3F, EEDR = 0x40, EEARL = 0x41, EEARH = 0x42 };
enum { EERE = 0x01, EEPE = 0x02, EEMPE = 0x04, EERIE = 0x08, EEPM0 = 0x10, EEPM1 = 0x20 };

#define ERASE_WRITE_CYCLES 54400u
#define HALF_CYCLES 28800u
#define MASTER_ENABLE_CYCLES 4u

struct eeprom {
    uint8_t cells[BOARD_EEPROM_BYTES];
    uint32_t writes[BOARD_EEPROM_BYTES];
    uint8_t torn;
    uint64_t enabled_until; /* EEMPE falls at this edge; a write to EECR at the same edge still finds it set */
    bool busy;              /* EEPE */
    uint16_t address;       /* of the cell being written */
    uint8_t value;          /* that it will have */
};

static void request(board_t *b, uint64_t cycle)
{
    irq_set(b, VECTOR_EE_READY, !b->eeprom->busy && REG(b, EECR) & EERIE, cycle);
}

static void ended(board_t *b, uint64_t cycle)
{
    struct eeprom *e = b->eeprom;
    e->cells[e->address] = e->value;
    e->busy = false;
    request(b, cycle);
}

static uint16_t addressed(const board_t *b)
{
    return (uint16_t)((REG(b, EEARH) << 8 | REG(b, EEARL)) % BOARD_EEPROM_BYTES);
}

static void start_write(board_t *b, uint64_t cycle)
{
    struct eeprom *e = b->eeprom;
    uint8_t mode = REG(b, EECR) & (EEPM1 | EEPM0);
    uint8_t data = REG(b, EEDR);

    e->busy = true;
    e->address = addressed(b);
    e->writes[e->address]++;
    if (mode == EEPM0)
        e->value = 0xFF;
    else if (mode == EEPM1)
        e->value = e->cells[e->address] & data; /* programming only clears bits */
    else
        e->value = data;
    event_at(b, EVENT_EEPROM, cycle + (mode == EEPM0 || mode == EEPM1 ? HALF_CYCLES : ERASE_WRITE_CYCLES), ended);
    cpu_halt(b, 2);
}

static uint8_t read_control(board_t *b, uint16_t address, uint64_t cycle)
{
    const struct eeprom *e = b->eeprom;
    uint8_t kept = REG(b, address) & (EEPM1 | EEPM0 | EERIE); /* simavr stores what a hook returns */
    return (uint8_t)(kept | (e->busy ? EEPE : 0) | (cycle < e->enabled_until ? EEMPE : 0));
}

static void write_control(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    struct eeprom *e = b->eeprom;
    uint8_t strobes = reg_written_ones(b, value);
    bool enabled = cycle <= e->enabled_until;

    uint8_t mode = e->busy ? REG(b, address) : value; /* EEPM1:0 cannot be changed during a write */
    REG(b, address) = (uint8_t)((mode & (EEPM1 | EEPM0)) | (value & EERIE));

    if (strobes & EEPE && enabled && !e->busy)
        start_write(b, cycle);
    else if (strobes & EERE && !e->busy) {
        REG(b, EEDR) = e->cells[addressed(b)];
        cpu_halt(b, 4);
    }
    if (strobes & EEMPE)
        e->enabled_until = cycle + MASTER_ENABLE_CYCLES;
    else if (!(value & EEMPE))
        e->enabled_until = 0;
    request(b, cycle);
}

static void write_address(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    (void)cycle;
    if (!b->eeprom->busy)
        REG(b, address) = address == EEARH ? value & 0x03 : value;
}

void eeprom_init(board_t *b)
{
    struct eeprom *e = b->eeprom = calloc(1, sizeof *e);
    if (!e)
        abort();
    memset(e->cells, 0xFF, sizeof e->cells);
    e->torn = 0xFF;
    reg_on_read(b, EECR, read_control);
    reg_on_write(b, EECR, write_control);
    reg_on_write(b, EEARL, write_address);
    reg_on_write(b, EEARH, write_address);
}

void eeprom_load(board_t *b, const uint8_t *cells)
{
    if (cells == NULL)
        cells = b->image_eeprom;
    if (cells != NULL)
        memcpy(b->eeprom->cells, cells, sizeof b->eeprom->cells);
}

void eeprom_reset(board_t *b)
{
    struct eeprom *e = b->eeprom;

    e->enabled_until = 0;
    REG(b, EECR) = 0; /* EEPE reads 1 while a write goes on */
    request(b, board_time(b));
}

void eeprom_power_fails(board_t *b)
{
    struct eeprom *e = b->eeprom;

    if (e->busy) {
        e->cells[e->address] = e->torn;
        e->busy = false;
        event_cancel(b, EVENT_EEPROM);
    }
}

void eeprom_free(board_t *b)
{
    free(b->eeprom);
    b->eeprom = NULL;
}

/* -- board.h --------------------------------------------------------------------------------------------------------- */

static void power_cut(board_t *b, uint64_t cycle)
{
    (void)cycle;
    board_reset(b, BOARD_RESET_POWER_ON);
}

uint8_t *board_eeprom(board_t *b)
{
    return b->eeprom->cells;
}

void board_eeprom_cut_at(board_t *b, uint64_t cycle)
{
    event_at(b, EVENT_POWER_CUT, cycle, power_cut);
}

void board_eeprom_torn_byte(board_t *b, uint8_t value)
{
    b->eeprom->torn = value;
}

uint32_t board_eeprom_writes(const board_t *b, uint16_t address)
{
    return address < BOARD_EEPROM_BYTES ? b->eeprom->writes[address] : 0;
}
