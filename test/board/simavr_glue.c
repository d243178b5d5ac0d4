/* Keeps simavr's peripherals out of the link. The constructor of its ATmega328P calls these at start; as the board
 * defines them, the static library's members of the same names are never pulled in, and every register is free for the
 * board's own models. (See the design notes for what simavr's models get wrong.) */
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

#define NO_PERIPHERAL(name, type)             \
    void name(avr_t *avr, type *peripheral) { \
        (void)avr;                            \
        (void)peripheral;                     \
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
