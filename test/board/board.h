/* A simulated Arduino Nano: simavr's instruction core with datasheet models of what the firmware relies on.
 *
 * Used by the tests, the benchmark and the simulator program alike. One board is one ATmega328P at 16 MHz; several can
 * live in one process.
 * Units:   cycles of the CPU clock (62.5 ns) since the board was made, unless the name says otherwise. Time never goes
 *          back: a reset does not clear it.
 * Errors:  functions that can fail return NULL or false and print the reason on stderr.
 * Source:  ATmega48A/PA/88A/PA/168A/PA/328/P datasheet, DS40002061; simavr's known differences: docs/design.md. */
#ifndef BOARD_SIM_H
#define BOARD_SIM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BOARD_CPU_HZ 16000000ull
#define BOARD_EEPROM_BYTES 1024

typedef struct board board_t;

/* Pins by port and bit: BOARD_PIN('B', 2) is clk. */
typedef uint8_t board_pin_t;
#define BOARD_PIN(port, bit) ((board_pin_t)(((port) - 'B') * 8 + (bit))) /* B 0-7, C 8-15, D 16-23 */

/* -- life ------------------------------------------------------------------------------------------------------ */

/* Loads an ELF image; the CPU is held at a power-on reset. eeprom: BOARD_EEPROM_BYTES bytes, or NULL for erased. */
board_t *board_new(const char *elf_path, const uint8_t *eeprom);
void board_free(board_t *b);

typedef enum { BOARD_RESET_POWER_ON, BOARD_RESET_EXTERNAL, BOARD_RESET_BROWN_OUT, BOARD_RESET_WATCHDOG } board_reset_t;
void board_reset(board_t *b, board_reset_t cause); /* sets MCUSR as the datasheet says; RAM survives all but power-on */

uint64_t board_cycle(const board_t *b);

/* Why the run functions returned. */
typedef enum {
    BOARD_RAN,     /* the asked-for cycle was reached */
    BOARD_MATCHED, /* the asked-for condition came true */
    BOARD_CRASHED, /* illegal opcode, jump out of flash, stack below .bss: board_crash() tells */
} board_run_t;
board_run_t board_run_to(board_t *b, uint64_t cycle);
board_run_t board_run_for(board_t *b, uint64_t cycles);
board_run_t board_run_to_pc(board_t *b, uint16_t byte_address, uint64_t limit_cycles); /* before that instruction */
board_run_t board_run_past(board_t *b, uint16_t byte_address, uint64_t limit_cycles); /* that function has returned */
/* Until cond(b, ctx) is true, asked after every instruction; keep it cheap. */
board_run_t board_run_until(board_t *b, bool (*cond)(board_t *, void *), void *ctx, uint64_t limit_cycles);
const char *board_crash(const board_t *b);
/* The program hangs: the instruction that is due next jumps to itself, until the next reset. Interrupts are served if
 * they are enabled there. */
void board_hang(board_t *b);

/* -- pins ------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint64_t cycle;
    board_pin_t pin;
    uint8_t level;
} board_edge_t;

void board_pin_drive(board_t *b, board_pin_t pin, int level); /* 0, 1, or -1: not driven (pull-up decides) */
int board_pin_level(const board_t *b, board_pin_t pin);
/* Drive an input at an exact cycle in the future. */
void board_pin_drive_at(board_t *b, board_pin_t pin, int level, uint64_t cycle);
/* A square wave of so many Hz on an input, e.g. T1; 0 stops it. */
void board_pin_clock(board_t *b, board_pin_t pin, double hz);
/* Joins an output to an input (e.g. 1 MHz to xclk), without delay. */
void board_pin_wire(board_t *b, board_pin_t output, board_pin_t input);

void board_record(board_t *b, board_pin_t pin, bool on);
const board_edge_t *board_edges(const board_t *b, size_t *count); /* of all recorded pins, in order */
void board_edges_clear(board_t *b);
/* Called at every edge of the recorded pins, at its exact cycle, instead of storing it. NULL: store again. */
void board_on_edge(board_t *b, void (*fn)(void *ctx, board_edge_t edge), void *ctx);

/* -- timers ---------------------------------------------------------------------------------------------------- */

/* When fast PWM sets TOVn. The datasheet says "each time the counter reaches TOP" (15.7.3, 16.9.3), its figures 15-9 and
 * 16-12 draw it where the counter leaves TOP for BOTTOM, one timer clock later. Firmware must bear both. */
typedef enum { BOARD_TOV_REACHING_TOP, BOARD_TOV_LEAVING_TOP } board_tov_t;
void board_fast_pwm_tov(board_t *b, board_tov_t when); /* until board_free(); at first BOARD_TOV_REACHING_TOP */

/* -- hardware serial port (USART0) ------------------------------------------------------------------------------ */

void board_uart_baud(board_t *b, double baud); /* of the peer; also decodes what the board sends. Default 38400 */
/* Appends bytes to what the peer sends, back to back, 10 bits a byte. */
void board_uart_send(board_t *b, const void *bytes, size_t count);
void board_uart_send_text(board_t *b, const char *text);
void board_uart_gap(board_t *b, uint64_t cycles); /* idle line between what was and what will be appended */
/* With a low stop bit (a framing error) and one idle bit after it. */
void board_uart_send_bad(board_t *b, uint8_t byte);
bool board_uart_sending(const board_t *b);
uint64_t board_uart_last_sent(const board_t *b); /* cycle at which the last appended byte's stop bit ended */
typedef struct {
    uint64_t start_cycle; /* falling edge of the start bit */
    uint64_t end_cycle;   /* end of the stop bit */
    uint8_t byte;
} board_uart_byte_t;
/* All that the board has sent since board_uart_clear(). */
const board_uart_byte_t *board_uart_received(const board_t *b, size_t *count);
const char *board_uart_text(const board_t *b); /* the same as a NUL-terminated string, valid until the next run */
void board_uart_clear(board_t *b);
/* Called for every byte that the board has sent, when its stop bit ends, instead of storing it. NULL: store again. */
void board_on_uart(board_t *b, void (*fn)(void *ctx, board_uart_byte_t byte), void *ctx);
uint32_t board_uart_overruns(const board_t *b); /* bytes lost by the board's receiver (DOR) */

/* -- memory ---------------------------------------------------------------------------------------------------- */

bool board_symbol(const board_t *b, const char *name, uint16_t *address); /* data: RAM address; code: byte address */
/* The data symbol that begins at this RAM address or nearest below it; "" if there is none. */
const char *board_symbol_at(const board_t *b, uint16_t address, uint16_t *offset);
uint8_t board_peek8(const board_t *b, uint16_t address);
uint16_t board_peek16(const board_t *b, uint16_t address);
uint32_t board_peek32(const board_t *b, uint16_t address);
void board_poke8(board_t *b, uint16_t address, uint8_t value);
void board_poke16(board_t *b, uint16_t address, uint16_t value);
void board_poke32(board_t *b, uint16_t address, uint32_t value);
uint8_t *board_eeprom(board_t *b);                    /* the cells; BOARD_EEPROM_BYTES */
void board_eeprom_cut_at(board_t *b, uint64_t cycle); /* power fails at that cycle: a write in progress leaves its
                                                         cell as torn_byte; the board then stands at a power-on reset */
void board_eeprom_torn_byte(board_t *b, uint8_t value);
uint32_t board_eeprom_writes(const board_t *b, uint16_t address); /* wear of one cell */

/* -- measures, since board_measures_clear() ---------------------------------------------------------------------- */

#define BOARD_VECTORS 26
typedef struct {
    uint64_t count;
    uint64_t cycles;      /* sum, entry (4) and RETI included; time in interrupts nested inside is not counted */
    uint32_t cycles_max;  /* longest single run, likewise */
    uint32_t latency_max; /* flag and enable set -> first cycle of the entry */
} board_isr_t;
typedef struct {
    board_isr_t isr[BOARD_VECTORS];
    uint32_t masked_max;       /* longest time with I = 0 outside interrupts, cycles; start-up before SEI left out */
    uint16_t masked_max_pc;    /* byte address at which it ended */
    uint32_t isr_masked_max;   /* longest time with I = 0 inside an interrupt, entry included */
    uint8_t isr_masked_vector; /* and in which */
    uint16_t stack_low;        /* lowest stack pointer seen */
    uint64_t sleep_cycles;
    uint64_t cycles; /* since the clear */
} board_measures_t;
const board_measures_t *board_measures(const board_t *b);
void board_measures_clear(board_t *b);

#endif
