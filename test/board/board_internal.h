/* What the models of the simulated board share. Tests include board.h, never this.
 *
 * simavr gives the instruction core and the memory array, nothing else: every peripheral of its own is kept out of the
 * link (simavr_glue.c), also its ports, external interrupts, EEPROM and watchdog. Each model file here registers its
 * registers' hooks with simavr and owns the behaviour behind them.
 *
 * Time. A cycle stamp names a rising edge of the CPU clock. An instruction of n cycles that starts at c writes an I/O
 * register at the edge that ends it, c + n, and reads one in its last cycle, so it sees what happened up to c + n - 1.
 * Hooks are given that stamp; before a hook runs, all events due until then have run, each with its own stamp, so that
 * a hook finds the board as it is at that cycle.
 * When an event and a write fall on the same edge the event comes first.
 *
 * A model exports (listed below): xxx_init(b) once, after simavr is up: allocate state, register hooks and
 * acknowledgements; xxx_reset(b) at every reset, power-on included: registers are already 0, events are NOT cancelled
 * by the core (cancel your own); xxx_free(b). */
#ifndef BOARD_INTERNAL_H
#define BOARD_INTERNAL_H

#include "board.h"

#include <simavr/sim_avr.h>

#define BOARD_FLASH_BYTES 0x8000u
#define BOARD_RAM_START 0x0100u
#define BOARD_RAMEND 0x08FFu

#define NEVER UINT64_MAX

/* -- interrupt vectors, datasheet 12.4 (numbered from 0 = reset, as avr-libc does) --------------------------------- */

enum {
    VECTOR_INT0 = 1,
    VECTOR_INT1,
    VECTOR_PCINT0,
    VECTOR_PCINT1,
    VECTOR_PCINT2,
    VECTOR_WDT,
    VECTOR_TIMER2_COMPA,
    VECTOR_TIMER2_COMPB,
    VECTOR_TIMER2_OVF,
    VECTOR_TIMER1_CAPT,
    VECTOR_TIMER1_COMPA,
    VECTOR_TIMER1_COMPB,
    VECTOR_TIMER1_OVF,
    VECTOR_TIMER0_COMPA,
    VECTOR_TIMER0_COMPB,
    VECTOR_TIMER0_OVF,
    VECTOR_SPI,
    VECTOR_USART_RX,
    VECTOR_USART_UDRE,
    VECTOR_USART_TX,
    VECTOR_ADC,
    VECTOR_EE_READY,
    VECTOR_ANALOG_COMP,
    VECTOR_TWI,
    VECTOR_SPM_READY,
};

/* A vector's request line: the AND of its flag and its enable bit, as the model sees them. Idempotent. */
void irq_set(board_t *b, int vector, bool requested, uint64_t cycle);
/* Called at vector entry; the model clears the flag there if the hardware does (then irq_set() to false). A level
 * request (USART RXC and UDRE, EE_READY, INT0 low) needs no acknowledgement: it stays until its cause goes. */
typedef void (*irq_ack_t)(board_t *b, int vector, uint64_t cycle);
void irq_on_ack(board_t *b, int vector, irq_ack_t ack);

/* -- events: one slot a cause; at equal cycles the lower slot runs first --------------------------------------------- */

typedef enum {
    EVENT_POWER_CUT, /* eeprom.c */
    EVENT_PIN_DRIVE, /* pins.c: board_pin_drive_at() */
    EVENT_PIN_CLOCK, /* pins.c: board_pin_clock() */
    EVENT_USART_RX,  /* usart.c: the peer's bytes arriving */
    EVENT_USART_TX,  /* usart.c: the shift register */
    EVENT_USART_3,   /* usart.c, as it likes */
    EVENT_EEPROM,    /* eeprom.c: a write ends */
    EVENT_EEPROM_2,  /* eeprom.c: EEMPE falls back */
    EVENT_WATCHDOG,  /* watchdog.c */
    EVENT_RESET,     /* reset.c */
    EVENT_SPARE,
    EVENT_T0_EDGE, /* synchronised edges of the pins T0, T1, ICP1 */
    EVENT_T1_EDGE,
    EVENT_ICP_EDGE,
    EVENT_TIMER2,
    EVENT_TIMER1,
    EVENT_TIMER0,
    EVENT_EXTINT, /* extint.c: synchronised INT0, INT1 and pin changes */
    EVENT_SLOTS
} event_slot_t;

typedef void (*event_fn)(board_t *b, uint64_t cycle); /* cycle: the one that was asked for */

/* Calls fn at that cycle (NEVER: not at all), replacing what the slot held. A cycle in the past runs as soon as
 * possible. The slot is free again when fn is called. */
void event_at(board_t *b, event_slot_t slot, uint64_t cycle, event_fn fn);
void event_cancel(board_t *b, event_slot_t slot);
uint64_t event_due(const board_t *b, event_slot_t slot); /* NEVER: nothing planned */

/* -- registers ------------------------------------------------------------------------------------------------------ */

/* Hooks: addresses are data-space ones (UDR0 is 0xC6, PORTB 0x25), as in simavr. A read hook returns the value; a write
 * hook stores into b->avr->data[address] what must be stored. Read-only and plain registers need no hook. */
typedef uint8_t (*reg_read_fn)(board_t *b, uint16_t address, uint64_t cycle);
typedef void (*reg_write_fn)(board_t *b, uint16_t address, uint8_t value, uint64_t cycle);
void reg_on_read(board_t *b, uint16_t address, reg_read_fn fn);
void reg_on_write(board_t *b, uint16_t address, reg_write_fn fn);

/* Flag registers (TIFRx, EIFR, PCIFR, PINx, UCSR0A): the ones that the running instruction writes. simavr's SBI reads,
 * ORs and writes; the chip's writes its one bit (7.3, 14.2.2). Use this in place of `value`. */
uint8_t reg_written_ones(const board_t *b, uint8_t value);

#define REG(b, address) ((b)->avr->data[address])

/* -- pins ----------------------------------------------------------------------------------------------------------- */

/* What a peripheral does to a port pin, 14.3: */
typedef enum {
    PIN_FREE,   /* PORT and DDR decide */
    PIN_VALUE,  /* the peripheral's level replaces PORT; DDR still decides (OCnx) */
    PIN_OUTPUT, /* level and direction overridden: an output (TXD) */
    PIN_INPUT,  /* direction overridden: an input, the pull-up still follows PORT (RXD) */
} pin_override_t;
void pin_override(board_t *b, board_pin_t pin, pin_override_t how, int level, uint64_t cycle);

int pin_level(const board_t *b, board_pin_t pin);                       /* of the pad, as it is now */
void pin_drive(board_t *b, board_pin_t pin, int level, uint64_t cycle); /* from outside; -1 floats */
/* Is an edge of this pin seen by anybody (recorder, wire, interrupt)? If not, a model may produce its edges late, when
 * its registers or the port are read. */
bool pin_watched(const board_t *b, board_pin_t pin);
/* fn is called at every edge of that pin; a timer and one thing outside (bus.c, head.c) may listen to the same. */
typedef void (*pin_listener_t)(board_t *b, int level, uint64_t cycle);
void pin_listen(board_t *b, board_pin_t pin, pin_listener_t fn);

/* -- crashes -------------------------------------------------------------------------------------------------------- */

void board_crashed(board_t *b, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* -- models: one line each ------------------------------------------------------------------------------------------- */

#define BOARD_MODELS(MODEL) \
    MODEL(pins)             \
    MODEL(extint)           \
    MODEL(timers)           \
    MODEL(usart)            \
    MODEL(eeprom)           \
    MODEL(watchdog)         \
    MODEL(reset)

#define MODEL_PROTOTYPES(name)     \
    void name##_init(board_t *b);  \
    void name##_reset(board_t *b); \
    void name##_free(board_t *b);
BOARD_MODELS(MODEL_PROTOTYPES)
#undef MODEL_PROTOTYPES

/* Restarts the processor and every model: I/O registers 0, SP = RAMEND, PC = 0, xxx_reset() of each. reset.c calls it
 * from board_reset(), after it has decided what MCUSR will be and before it writes MCUSR. Takes effect at once: inside
 * an event or a hook, return right after it. */
void cpu_reset(board_t *b);
/* A peripheral halts the CPU after the instruction being executed (EEPROM access, 8.6.3); from a register hook only. */
static inline void cpu_halt(board_t *b, unsigned cycles);
/* For reset.c: a write to EEPROM is torn (eeprom.c); WDRF holds WDE (watchdog.c). */
void eeprom_power_fails(board_t *b);
void watchdog_force(board_t *b);
/* The instruction WDR was executed (watchdog.c). */
void watchdog_wdr(board_t *b, uint64_t cycle);
/* The initial BOARD_EEPROM_BYTES cells, NULL: erased; called by board_new() after eeprom_init() (eeprom.c). */
void eeprom_load(board_t *b, const uint8_t *cells);

/* -- the board ------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t start;  /* first cycle of the entry */
    uint64_t nested; /* cycles spent in interrupts inside this one */
    uint8_t vector;
} isr_frame_t;

#define ISR_DEPTH_MAX 16

typedef struct {
    char *name;
    uint16_t address;
    bool global;
    bool data; /* in RAM */
} board_symbol_t;

struct board {
    avr_t *avr;
    avr_io_t instructions; /* hears simavr's requests for WDR and SPM */
    char crash[160];
    bool was_reset; /* cpu_reset() ran inside the running instruction */
    bool hangs;     /* board_hang(): at this address, instead of this opcode */
    uint32_t hangs_at;
    uint16_t hangs_instead_of;

    /* time */
    uint64_t event_cycle[EVENT_SLOTS];
    event_fn event_fn[EVENT_SLOTS];
    uint64_t next_event; /* the least of event_cycle[] */
    uint64_t now;        /* stamp of the event or hook being run; otherwise behind avr->cycle */
    bool in_event;

    /* interrupts */
    uint32_t irq_requests; /* bit n: vector n */
    uint64_t irq_since[BOARD_VECTORS];
    irq_ack_t irq_ack[BOARD_VECTORS];
    bool irq_hold; /* the next instruction runs before any interrupt (after SEI and RETI, 7.7.1) */
    isr_frame_t isr_frame[ISR_DEPTH_MAX];
    int isr_depth;

    /* measures */
    board_measures_t measures;
    uint64_t measures_since;
    uint64_t masked_since; /* NEVER: start-up, before the first SEI, is not counted */
    uint64_t sleep_since;
    bool i_seen; /* SREG's I after the last instruction */

    /* image */
    uint32_t code_end;       /* first flash byte after the image */
    uint64_t stack_whole_at; /* until then the stack pointer may be half written */
    uint16_t stack_limit;    /* first RAM byte after .bss and .noinit */
    board_symbol_t *symbols;
    size_t symbol_count;
    uint8_t *image_eeprom; /* the .eeprom section, BOARD_EEPROM_BYTES; NULL: none */

    /* hooks of registers: simavr's own carry one pointer, the board; these carry the models' functions */
    reg_read_fn reg_read[0x100];
    reg_write_fn reg_write[0x100];

    /* each model's own state */
    struct pins *pins;
    struct extint *extint;
    struct timers *timers;
    struct usart *usart;
    struct eeprom *eeprom;
    struct watchdog *watchdog;
    struct reset *reset;

    struct bus_node *bus_node; /* bus.c: the board's place on a line; NULL: on none */
    struct head *head;         /* head.c: NULL: none */
};

/* simavr adds the instruction's own cycles when the hook has returned. */
static inline void cpu_halt(board_t *b, unsigned cycles)
{
    b->avr->cycle += cycles;
}

/* Between models of the core. */
void events_run_until(board_t *b, uint64_t cycle);
static inline void events_run(board_t *b, uint64_t cycle)
{
    if (b->next_event <= cycle)
        events_run_until(b, cycle);
}
void timers_sync(board_t *b, uint64_t cycle); /* brings counters, flags and OC pins up to date */
void timers_replan(board_t *b);               /* after a change of who watches which pin */
void extint_pins_changed(board_t *b, int port, uint8_t levels, uint8_t changed, uint64_t cycle);
uint8_t extint_watched(const board_t *b, int port); /* pins whose edges the interrupt logic looks at */
uint64_t board_time(const board_t *b);              /* stamp of the event being run, or the CPU's cycle */

void simavr_stop(board_t *b);
bool simavr_start(board_t *b); /* simavr_glue.c: makes b->avr; false: simavr does not know the ATmega328P */
bool irq_dispatch(board_t *b); /* enters the most urgent vector, if any is allowed */

bool image_load(board_t *b, const char *elf_path); /* image.c */
void image_free(board_t *b);
/* measures.c, called by the processor loop */
void measures_reset(board_t *b);
void measures_i_changed(board_t *b, uint32_t pc); /* SREG's I is not what it was after the last instruction */
void measures_enter(board_t *b, int vector, uint64_t start);
void measures_reti(board_t *b);

#endif
