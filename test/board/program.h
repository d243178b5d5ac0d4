/* For the tests of the board's models: a board that runs one of test/board/programs/, and its variables by name.
 * One board at a time; a missing program or name fails the test. */
#ifndef BOARD_PROGRAM_H
#define BOARD_PROGRAM_H

#include "board.h"

#include <stdlib.h>
#include <unity.h>

#ifndef BOARD_PROGRAMS_DIR
#define BOARD_PROGRAMS_DIR "build/board/programs"
#endif
#define PROGRAM(name) BOARD_PROGRAMS_DIR "/" name ".elf"

static board_t *board;

static inline void start(const char *elf_path)
{
    board = board_new(elf_path, NULL);
    TEST_ASSERT_NOT_NULL_MESSAGE(board, elf_path);
}

static inline uint16_t address_of(const char *name)
{
    uint16_t address = 0;
    TEST_ASSERT_TRUE_MESSAGE(board_symbol(board, name, &address), name);
    return address;
}

/* Element i of an array of bytes; i = 0: a variable. */
static inline uint8_t get(const char *name, unsigned i)
{
    return board_peek8(board, (uint16_t)(address_of(name) + i));
}

static inline uint16_t get16(const char *name)
{
    return board_peek16(board, address_of(name));
}

static inline void set(const char *name, unsigned i, uint8_t value)
{
    board_poke8(board, (uint16_t)(address_of(name) + i), value);
}

static inline void set16(const char *name, uint16_t value)
{
    board_poke16(board, address_of(name), value);
}

static inline void run(uint64_t cycles)
{
    TEST_ASSERT_EQUAL_MESSAGE(BOARD_RAN, board_run_for(board, cycles), board_crash(board));
}

typedef struct {
    uint16_t address;
    uint8_t value;
} wanted_t;

static inline bool is_wanted(board_t *b, void *ctx)
{
    const wanted_t *wanted = ctx;
    return board_peek8(b, wanted->address) == wanted->value;
}

/* Until a variable has that value. */
static inline void run_until(const char *name, uint8_t value, uint64_t limit_cycles)
{
    wanted_t wanted = {address_of(name), value};
    TEST_ASSERT_EQUAL_MESSAGE(BOARD_MATCHED, board_run_until(board, is_wanted, &wanted, limit_cycles), name);
}

/* The cycle at which a code label is reached. */
static inline uint64_t run_to_label(const char *name, uint64_t limit_cycles)
{
    TEST_ASSERT_EQUAL_MESSAGE(BOARD_MATCHED, board_run_to_pc(board, address_of(name), limit_cycles), name);
    return board_cycle(board);
}

#endif
