/* What the board takes from simavr, and what it keeps out.
 *
 * The constructor of simavr's ATmega328P calls the functions below that create peripherals. As the board defines them,
 * the static library's members of the same names are never pulled in, and every register is free for the board's own
 * models. (See the design notes for what simavr's models get wrong.) board.c needs simavr_start(), so that the linker
 * takes this file before it looks into simavr's library. */
#include "board_internal.h"

#include <simavr/avr_acomp.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_flash.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_spi.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/avr_watchdog.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MCU "atmega328p"

#define NO_PERIPHERAL(name, type)           \
    void name(avr_t *avr, type *peripheral) \
    {                                       \
        (void)avr;                          \
        (void)peripheral;                   \
    }

NO_PERIPHERAL(avr_acomp_init, avr_acomp_t)
NO_PERIPHERAL(avr_adc_init, avr_adc_t)
NO_PERIPHERAL(avr_eeprom_init, avr_eeprom_t)
NO_PERIPHERAL(avr_extint_init, avr_extint_t)
NO_PERIPHERAL(avr_flash_init, avr_flash_t)
NO_PERIPHERAL(avr_ioport_init, avr_ioport_t)
NO_PERIPHERAL(avr_spi_init, avr_spi_t)
NO_PERIPHERAL(avr_timer_init, avr_timer_t)
NO_PERIPHERAL(avr_twi_init, avr_twi_t)
NO_PERIPHERAL(avr_uart_init, avr_uart_t)
NO_PERIPHERAL(avr_watchdog_init, avr_watchdog_t)

/* simavr reports an illegal opcode or an access outside memory only through its log. Everything else it says is about
 * its own life and is dropped. */
static void listen_to_simavr(avr_t *avr, const int level, const char *format, va_list arguments)
{
    board_t *b = avr ? avr->custom.data : NULL;
    (void)arguments;
    if (b == NULL || level != LOG_ERROR)
        return;
    if (strstr(format, "nvalid Opcode") != NULL)
        board_crashed(b, "illegal opcode at 0x%04x", (unsigned)avr->pc);
    else if (strstr(format, "nvalid") != NULL)
        board_crashed(b, "access outside memory at 0x%04x", (unsigned)avr->pc);
}

/* simavr passes WDR on as a request to its peripherals. */
static int instruction_request(avr_io_t *io, uint32_t request, void *param)
{
    board_t *b = io->avr->custom.data;
    (void)param;
    if (request != AVR_IOCTL_WATCHDOG_RESET)
        return -1;
    watchdog_wdr(b, b->avr->cycle + 1);
    return 0;
}

bool simavr_start(board_t *b)
{
    avr_global_logger_set(listen_to_simavr);
    b->avr = avr_make_mcu_by_name(MCU);
    if (b->avr == NULL) {
        fprintf(stderr, "simavr does not know " MCU "\n");
        return false;
    }
    avr_init(b->avr);
    b->avr->frequency = (uint32_t)BOARD_CPU_HZ;
    b->avr->custom.data = b;
    b->avr->run_cycle_count = 0; /* one instruction a call of avr_run_one() */
    b->instructions.kind = "instructions";
    b->instructions.ioctl = instruction_request;
    avr_register_io(b->avr, &b->instructions);
    return true;
}

/* simavr's own farewell forgets the names of its interrupt lines and the list that they stand in. */
void simavr_stop(board_t *b)
{
    avr_t *avr = b->avr;
    avr_terminate(avr);
    for (int i = 0; i < AVR_INT_IRQ_COUNT; i++)
        free((char *)avr->interrupts.irq[i].name);
    free(avr->irq_pool.irq);
    free(avr);
    b->avr = NULL;
}
