/* Registers of a board that runs programs/remote.S, one access a call. Each returns after the access, and the cycle at
 * which it took effect. */
#ifndef BOARD_REMOTE_H
#define BOARD_REMOTE_H

#include "program.h"

enum {
    CMD_WRITE = 1,
    CMD_READ,
    CMD_SEI,
    CMD_CLI,
    CMD_NOPS,
    CMD_SLEEP,
    CMD_SBI_TIFR1,
    CMD_SBI_PINB,
    CMD_OUT_IN,
    CMD_CBI_TIFR1
};

#define COMMAND_CYCLES 100000 /* longer than any command takes to be taken up, also under a storm of interrupts */

static inline void start_remote(void)
{
    start(PROGRAM("remote"));
    run(1000);
}

static inline void command(uint8_t which)
{
    set("command", 0, which);
    run_until("command", 0, COMMAND_CYCLES);
}

static inline uint64_t write(uint16_t address, uint8_t value)
{
    set16("address", address);
    set("value", 0, value);
    command(CMD_WRITE);
    return run_to_label("write_done", COMMAND_CYCLES);
}

/* A pair of 8-bit registers, the high one first. */
static inline uint64_t write16(uint16_t low_address, uint16_t value)
{
    write((uint16_t)(low_address + 1), (uint8_t)(value >> 8));
    return write(low_address, (uint8_t)value);
}

static inline uint8_t read(uint16_t address)
{
    set16("address", address);
    command(CMD_READ);
    run_to_label("read_done", COMMAND_CYCLES);
    run(2);
    return get("value", 0);
}

static inline uint16_t read16(uint16_t low_address)
{
    uint8_t low = read(low_address);
    return (uint16_t)(low | read((uint16_t)(low_address + 1)) << 8);
}

static inline void allow_interrupts(void)
{
    command(CMD_SEI);
    run(20);
}

/* The cycle at which a vector's flag was set: the main program does nothing but one-cycle instructions meanwhile, so
 * the entry (4 cycles) starts there. */
static inline uint64_t flag_cycle(int vector)
{
    command(CMD_NOPS);
    TEST_ASSERT_EQUAL(BOARD_MATCHED, board_run_to_pc(board, (uint16_t)(vector * 4), 4000));
    return board_cycle(board) - 4;
}

typedef struct {
    uint64_t after; /* cycles since `origin` */
    int level;
} step_t;

/* All edges of a recorded pin. */
static inline void assert_edges(board_pin_t pin, uint64_t origin, const step_t *step, size_t steps)
{
    size_t count;
    size_t seen = 0;
    const board_edge_t *edge = board_edges(board, &count);
    for (size_t i = 0; i < count; i++) {
        if (edge[i].pin != pin)
            continue;
        if (seen < steps) {
            TEST_ASSERT_EQUAL_UINT64(step[seen].after, edge[i].cycle - origin);
            TEST_ASSERT_EQUAL(step[seen].level, edge[i].level);
        }
        seen++;
    }
    TEST_ASSERT_EQUAL_MESSAGE(steps, seen, "number of edges");
}
#define ASSERT_EDGES(pin, origin, ...)                                    \
    do {                                                                  \
        const step_t step_[] = {__VA_ARGS__};                             \
        assert_edges(pin, origin, step_, sizeof step_ / sizeof step_[0]); \
    } while (0)

static inline void assert_no_edges(board_pin_t pin)
{
    assert_edges(pin, 0, NULL, 0);
}

/* DDR and recorder of a pin, with its PORT bit low. */
static inline void watch_output(board_pin_t pin)
{
    uint16_t ddr = (uint16_t)(0x24 + 3 * (pin >> 3));
    write(ddr, (uint8_t)(read(ddr) | 1u << (pin & 7)));
    board_record(board, pin, true);
}

/* Runs to a cycle since `origin`. */
static inline void run_until_after(uint64_t origin, uint64_t cycles)
{
    TEST_ASSERT_EQUAL(BOARD_RAN, board_run_to(board, origin + cycles));
}

#endif
