# What the cross-check needs besides the firmware: the board's half and the probe. Read by tools/crosscheck/run.sh after
# the Makefile, whose variables it uses.

CROSSCHECK := $(BUILD)/crosscheck

.PHONY: crosscheck-parts
crosscheck-parts: $(BUILD)/sac.hex $(CROSSCHECK)/board_edges $(CROSSCHECK)/probe.hex

$(CROSSCHECK)/board_edges: tools/crosscheck/board_edges.c $(BOARD_LIB) test/board/board.h
	@mkdir -p $(@D)
	$(HOST_CC) $(HOST_CFLAGS) -O2 -Itest/board $(BOARD_LDFLAGS) -o $@ $(filter %.c %.a,$^) $(BOARD_LIBS)

$(CROSSCHECK)/probe.elf: tools/crosscheck/probe.S tools/crosscheck/probe_periods.def
	@mkdir -p $(@D)
	$(AVR)gcc -mmcu=atmega328p -o $@ $<

$(CROSSCHECK)/probe.hex: $(CROSSCHECK)/probe.elf
	$(AVR)objcopy -O ihex $< $@
