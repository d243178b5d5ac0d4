/* Resets of the simulated board: DS40002061 chapter 11.
 *
 * The program starts in the cycle of the reset: start-up delays (SUT fuses, 65 ms after power-on) are left out, time
 * stands still meanwhile. RAM and the working registers hold noise after power-on, as the chip's do; another one each
 * time, the same ones in each run of a test. */
#include "board_internal.h"

#include <stdlib.h>

enum { MCUSR = 0x54 };
enum { PORF = 0x01, EXTRF = 0x02, BORF = 0x04, WDRF = 0x08 };

struct reset {
    uint32_t noise;
};

static uint8_t noise(struct reset *r)
{
    r->noise ^= r->noise << 13;
    r->noise ^= r->noise >> 17;
    r->noise ^= r->noise << 5;
    return (uint8_t)(r->noise >> 24);
}

void board_reset(board_t *b, board_reset_t cause)
{
    uint8_t flags = REG(b, MCUSR);

    switch (cause) {
    case BOARD_RESET_POWER_ON:
        flags = PORF; /* alone clears the others, 11.9.1 */
        eeprom_power_fails(b);
        break;
    case BOARD_RESET_EXTERNAL: flags |= EXTRF; break;
    case BOARD_RESET_BROWN_OUT: /* short: a write to EEPROM ends well */ flags |= BORF; break;
    case BOARD_RESET_WATCHDOG: flags |= WDRF; break;
    }
    cpu_reset(b);
    if (cause == BOARD_RESET_POWER_ON) {
        for (uint16_t i = 0; i < 32; i++)
            REG(b, i) = noise(b->reset);
        for (uint16_t i = BOARD_RAM_START; i <= BOARD_RAMEND; i++)
            REG(b, i) = noise(b->reset);
    }
    REG(b, MCUSR) = flags;
    if (flags & WDRF)
        watchdog_force(b);
}

/* Flags are cleared by writing zero; nothing sets one. */
static void write_flags(board_t *b, uint16_t address, uint8_t value, uint64_t cycle)
{
    (void)cycle;
    REG(b, address) &= value;
}

void reset_init(board_t *b)
{
    b->reset = calloc(1, sizeof *b->reset);
    if (!b->reset)
        abort();
    b->reset->noise = 0x2545F491;
    reg_on_write(b, MCUSR, write_flags);
}

void reset_reset(board_t *b)
{
    (void)b;
}

void reset_free(board_t *b)
{
    free(b->reset);
    b->reset = NULL;
}
