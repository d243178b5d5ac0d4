# What the cross-check needs: the firmware, the board's half, the probe and the image `fine`. Read by
# tools/crosscheck/run.sh after the Makefile, whose variables it uses.

CROSSCHECK := $(BUILD)/crosscheck

.PHONY: crosscheck-parts
crosscheck-parts: $(BUILD)/sac.hex $(CROSSCHECK)/board_edges $(CROSSCHECK)/probe.hex crosscheck-fine

# The same sources with 8 microsteps and pulses of 1 us, for periods of 2 us.
.PHONY: crosscheck-fine
crosscheck-fine:
	@$(MAKE) -s --no-print-directory -f Makefile BUILD=$(CROSSCHECK)/fine \
	    DEFS='-DSETTINGS_USTEP=3 -DSETTINGS_PULSE_US=1' $(CROSSCHECK)/fine/sac.hex

$(CROSSCHECK)/board_edges: tools/crosscheck/board_edges.c $(BOARD_LIB) test/board/board.h
	@mkdir -p $(@D)
	$(HOST_CC) $(HOST_CFLAGS) -O2 -Itest/board $(BOARD_LDFLAGS) -o $@ $(filter %.c %.a,$^) $(BOARD_LIBS)

$(CROSSCHECK)/probe.elf: tools/crosscheck/probe.S tools/crosscheck/probe_periods.def
	@mkdir -p $(@D)
	$(AVR)gcc -mmcu=atmega328p -o $@ $<

$(CROSSCHECK)/probe.hex: $(CROSSCHECK)/probe.elf
	$(AVR)objcopy -O ihex $< $@
