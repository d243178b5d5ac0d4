# The simulated board's core: processor, interrupts, pins, timers, measures, and their tests. The serial port, EEPROM,
# watchdog and resets: models.mk. The Makefile builds BOARD_SRCS into build/libboard.a, BOARD_TESTS from test/board/<name>.c
# and BOARD_PROGRAMS from test/board/programs/<name>.c or .S.

BOARD_SRCS += $(addprefix test/board/, board.c bus.c events.c extint.c image.c irq.c measures.c pins.c registers.c \
    simavr_glue.c timer.c timer16.c timer8.c timers.c)
BOARD_TESTS += test_board_core test_board_timers test_board_bus
BOARD_PROGRAMS += bus_node remote irq_order masked crash segments
BOARD_CFLAGS += -Itest -Itest/board
# simavr's static library; whatever the board defines itself stays out of the link (simavr_glue.c).
BOARD_LIBS += -l:libsimavr.a -lelf -lm -lpthread

# Linked as the firmware is, with the segment ring alone in front of .data.
$(BUILD)/board/programs/segments.elf: AVR_MCU += -Wl,--section-start=.segments=0x800100 -Wl,-Tdata=0x800200
