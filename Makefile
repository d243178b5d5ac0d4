# SAC: firmware, simulator, tests. `make help` lists the targets; `./sac <target>` installs first what is missing.

# -- what may be set on the command line -----------------------------------------------------------------------------

BUILD ?= build
# More macros for the firmware, e.g. DEFS='-DSETTINGS_USTEP=3'. A change rebuilds what it touches.
DEFS ?=
# Budgets in bytes; what exceeds one fails the build. RAM is .data, .bss and the segment ring, without the stack.
FLASH_BUDGET := 26624
RAM_BUDGET := 1400

# avr-gcc 5.4 is the reference: unpacked by tools/setup.sh where the system's own is another one.
AVR ?= $(if $(wildcard .tools/avr-5.4/ready),.tools/avr-5.4/usr/bin/avr-,avr-)
HOST_CC ?= gcc
PYTHON ?= python3
UNITY ?= $(firstword $(wildcard .tools/unity /usr/share/cmock/vendor/unity/src))

# -- the firmware's sources ------------------------------------------------------------------------------------------

FIRMWARE_SRCS :=

# -- the tests -------------------------------------------------------------------------------------------------------
# Host tests: one binary a module, test/host/<name>.c with the sources that <name>_SRCS lists.

HOST_TESTS :=

# Whole-image tests: test/image/<name>.c with the board library; they load build/sac.elf.

IMAGE_TESTS :=
# Helpers that every whole-image test is linked with.
IMAGE_COMMON_SRCS :=

# The board lists its sources (BOARD_SRCS) and its own tests (BOARD_TESTS, test/board/<name>.c) itself.
-include test/board/board.mk test/board/models.mk

# -- firmware --------------------------------------------------------------------------------------------------------

AVR_MCU := -mmcu=atmega328p
AVR_WARNINGS := -Wall -Wextra -Wconversion -Wshadow -Wlogical-op -Wstrict-prototypes -Werror
AVR_CFLAGS := $(AVR_MCU) -DF_CPU=16000000UL -std=gnu11 -Os -g -ffunction-sections -fdata-sections -fshort-enums \
    -Ifirmware $(AVR_WARNINGS) -Wstack-usage=128 -fstack-usage
# The segment ring stands alone at the start of RAM, page-aligned, so that the step interrupt addresses it by one byte.
AVR_LDFLAGS := $(AVR_MCU) -Wl,--gc-sections -Wl,--section-start=.segments=0x800100 -Wl,-Tdata=0x800200

FIRMWARE_OBJS := $(FIRMWARE_SRCS:firmware/%=$(BUILD)/firmware/%.o)

.PHONY: firmware
firmware: $(BUILD)/sac.hex ## build/sac.elf and build/sac.hex, budgets checked

# Rewritten only when the flags change; every object depends on it.
$(BUILD)/firmware/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(AVR) $(AVR_CFLAGS) $(AVR_LDFLAGS) $(DEFS)' | cmp -s - $@ || \
	    echo '$(AVR) $(AVR_CFLAGS) $(AVR_LDFLAGS) $(DEFS)' >$@

$(BUILD)/firmware/%.o: firmware/% $(BUILD)/firmware/flags
	@mkdir -p $(@D)
	$(AVR)gcc $(AVR_CFLAGS) $(DEFS) -MMD -MP -c -o $@ $<

$(BUILD)/sac.elf: $(FIRMWARE_OBJS)
	$(AVR)gcc $(AVR_LDFLAGS) -Wl,-Map=$(BUILD)/sac.map -o $@ $^

$(BUILD)/sac.hex: $(BUILD)/sac.elf
	$(AVR)objcopy -O ihex -R .eeprom -R .segments $< $@

-include $(FIRMWARE_OBJS:.o=.d)

# -- tests -----------------------------------------------------------------------------------------------------------

HOST_WARNINGS := -Wall -Wextra -Wconversion -Wshadow -Werror
HOST_CFLAGS := -std=gnu11 -O1 -g $(HOST_WARNINGS)
SANITIZE := -fsanitize=address,undefined -fno-sanitize-recover=all
TEST_INCLUDES := -Ifirmware -Itest -I$(UNITY)
TEST_HEADERS := $(wildcard firmware/*.h firmware/*/*.h firmware/*/*.def test/*/*.h)

.PHONY: test-host
test-host: $(HOST_TESTS:%=$(BUILD)/host/%) ## the pure modules on this machine, with the sanitizers
	@for t in $^; do echo $$t; $$t || exit 1; done

$(BUILD)/unity.o $(BUILD)/unity-sanitized.o: $(UNITY)/unity.c
	@mkdir -p $(@D)
	$(HOST_CC) -O1 -g $(if $(findstring sanitized,$@),$(SANITIZE)) -c -o $@ $<

.SECONDEXPANSION:
$(BUILD)/host/%: test/host/%.c $$($$*_SRCS) $(BUILD)/unity-sanitized.o $(TEST_HEADERS)
	@mkdir -p $(@D)
	$(HOST_CC) $(HOST_CFLAGS) $(SANITIZE) $(TEST_INCLUDES) -o $@ $(filter %.c %.o,$^) -lm

# -- the rest --------------------------------------------------------------------------------------------------------

.PHONY: setup
setup: ## install what is missing
	@sh tools/setup.sh build

.PHONY: clean
clean: ## remove what was built
	rm -rf $(BUILD)

.PHONY: help
help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | awk -F '\t' '{ printf "  %-12s %s\n", $$1, $$2 }'

.PHONY: FORCE
FORCE:
.DEFAULT_GOAL := help
