# SAC: firmware, simulator, tests. `make help` lists the targets; `./sac <target>` installs first what is missing.

# -- what may be set on the command line -----------------------------------------------------------------------------

BUILD ?= build
# More macros for the firmware, e.g. DEFS='-DSETTINGS_USTEP=3'. A change rebuilds what it touches.
DEFS ?=
# Budgets in bytes; what exceeds one fails the build. Flash: what the half-kilobyte bootloader of today's Nanos leaves. (The
# design aims at 26 KB and 1,400 bytes: docs/design.md, "Targets and their price".) RAM is what is taken before the first
# call; that the stack fits beside it is proven (tools/check_stack.py).
FLASH_BUDGET := 32256
RAM_BUDGET := 1780
# The Ninja's: it has room.
NINJA_FLASH_BUDGET := 12288
NINJA_RAM_BUDGET := 768
# V=1 shows the commands.
V ?=
# How many jobs build and test side by side.
JOBS ?= $(shell nproc)
# Flashing: the serial port; its speed is found out unless given; the programmer for flash-isp.
PORT ?= /dev/ttyUSB0
BAUD ?= 115200 57600
PROGRAMMER ?= usbasp
# Which image is flashed: sac or ninja.
IMAGE ?= sac

Q := $(if $(V),,@)
say = $(if $(V)$(findstring s,$(firstword -$(MAKEFLAGS))),,@echo '  $(1)')

# avr-gcc 5.4 is the reference: unpacked by tools/setup.sh where the system's own is another one.
AVR ?= $(if $(wildcard .tools/avr-5.4/ready),.tools/avr-5.4/usr/bin/avr-,avr-)
NEWER_AVR ?= $(if $(wildcard .tools/avr-14.2/ready),.tools/avr-14.2/usr/bin/avr-,$(if \
    $(wildcard /usr/lib/gcc/avr/14.*),avr-))
HOST_CC ?= gcc
PYTHON ?= python3
UNITY ?= $(firstword $(wildcard .tools/unity /usr/share/cmock/vendor/unity/src) .tools/unity)

# -- the firmware's sources ------------------------------------------------------------------------------------------

# (In which order their functions are linked is decided by firmware/link_order.ld.)
FIRMWARE_SRCS := \
    firmware/hal/step_isr.S \
    firmware/hal/step_snapshot.S \
    firmware/hal/step_hurry.S \
    firmware/hal/encoder_isr.S \
    firmware/hal/start.S \
    firmware/hal/timebase_isr.S \
    firmware/hal/usart_receive.S \
    firmware/hal/usart_transmit.S \
    firmware/hal/soft_uart_isr.S \
    firmware/motion/ramp.c \
    firmware/motion/ramp.S \
    firmware/motion/group.c \
    firmware/motion/group.S \
    firmware/motion/block.c \
    firmware/motion/block.S \
    firmware/motion/profile.c \
    firmware/motion/engine.c \
    firmware/base/wide.S \
    firmware/hal/step_timer.c \
    firmware/main.c \
    firmware/boot.c \
    firmware/drivers.c \
    firmware/settings.c \
    firmware/queue/encoder.c \
    firmware/queue/ops.c \
    firmware/queue/queue.c \
    firmware/queue/session.c \
    firmware/eeprom/store.c \
    firmware/base/crc16.c \
    firmware/hal/eeprom.c \
    firmware/hal/encoder.c \
    firmware/hal/sleep.c \
    firmware/hal/pins.c \
    firmware/hal/reset.c \
    firmware/hal/timebase.c \
    firmware/hal/ports.c \
    firmware/net/packet.c firmware/net/bus.c firmware/cli/network.c \
    firmware/cli/line.c \
    firmware/cli/terminal.c \
    firmware/cli/trial.c \
    firmware/cli/commands.c \
    firmware/cli/motion_syntax.c \
    firmware/cli/configure.c \
    firmware/cli/display.c \
    firmware/cli/range.c \
    firmware/cli/text.c \
    firmware/base/flash.c \
    firmware/base/number.c \
    firmware/base/status.c

# The Ninja's, a pan and tilt head on the same board: a second image. What is not in its folder is SAC's.
NINJA_SRCS := \
    firmware/hal/usart_receive.S \
    firmware/hal/timebase_isr.S \
    firmware/hal/timebase.c \
    firmware/hal/sleep.c \
    firmware/base/number.c \
    firmware/base/wide.S \
    firmware/motion/ramp.c \
    firmware/motion/ramp.S \
    firmware/motion/group.c \
    firmware/motion/group.S \
    firmware/motion/profile.c \
    firmware/ninja/main.c \
    firmware/ninja/commands.c \
    firmware/ninja/pause.c \
    firmware/ninja/centre.c \
    firmware/ninja/drive.c \
    firmware/ninja/path.c \
    firmware/ninja/hal/stepper.c \
    firmware/ninja/hal/receive.c \
    firmware/ninja/hal/sensors.c \
    firmware/ninja/hal/watchdog.c

# -- the tests -------------------------------------------------------------------------------------------------------
# Host tests: test/host/<name>.c, one binary a module, with the sources that <name>_SRCS lists; <name>_HOST_SRCS are
# needed on the host alone, and assembler on the AVR alone.

HOST_TESTS := test_number test_status test_baud test_line test_settings test_store test_session test_queue \
    test_encoder test_ops test_motion_syntax test_commands test_configure test_display test_trial test_terminal test_packet test_network \
    test_bus_nodes test_fuzz test_boot test_drivers test_wide test_block test_group test_ramp test_ramp_next test_profile test_engine \
    test_property_planner test_processor_model test_ninja_commands test_ninja_path test_ninja_centre test_ninja_constants
FAKE_SRCS := test/host/fakes/engine_fake.c test/host/fakes/terminal_port_fake.c test/host/fakes/timebase_port_fake.c
STORE_SRCS := firmware/eeprom/store.c firmware/base/crc16.c firmware/settings.c test/host/fakes/eeprom_port_fake.c
NET_SRCS := firmware/net/packet.c firmware/net/bus.c test/host/fakes/bus_port_fake.c
CLI_SRCS := firmware/cli/commands.c firmware/cli/trial.c firmware/cli/configure.c firmware/cli/display.c firmware/cli/text.c firmware/cli/motion_syntax.c \
    firmware/cli/range.c firmware/base/flash.c firmware/base/number.c firmware/queue/encoder.c firmware/queue/ops.c firmware/queue/queue.c firmware/queue/session.c $(STORE_SRCS) \
    test/host/fakes/encoder_port_fake.c firmware/cli/network.c firmware/cli/terminal.c firmware/cli/line.c firmware/base/status.c \
    $(NET_SRCS) $(FAKE_SRCS)
test_number_SRCS := firmware/base/number.c
test_status_SRCS := firmware/base/status.c firmware/base/flash.c
test_line_SRCS := firmware/cli/line.c
test_settings_SRCS := firmware/settings.c
test_store_SRCS := $(STORE_SRCS)
test_session_SRCS := firmware/queue/session.c firmware/settings.c
test_queue_SRCS := firmware/queue/queue.c firmware/queue/session.c $(STORE_SRCS) $(FAKE_SRCS)
test_ops_SRCS := firmware/queue/ops.c firmware/queue/session.c firmware/settings.c $(NET_SRCS) $(FAKE_SRCS)
test_encoder_SRCS := firmware/queue/encoder.c test/host/fakes/encoder_port_fake.c test/host/fakes/engine_fake.c \
    test/host/fakes/terminal_port_fake.c firmware/settings.c
test_motion_syntax_SRCS := firmware/cli/motion_syntax.c firmware/cli/range.c firmware/base/flash.c firmware/base/number.c firmware/queue/session.c \
    firmware/settings.c $(FAKE_SRCS)
test_commands_SRCS := $(CLI_SRCS)
test_configure_SRCS := $(CLI_SRCS)
test_display_SRCS := $(CLI_SRCS)
test_trial_SRCS := firmware/cli/trial.c $(STORE_SRCS) test/host/fakes/terminal_port_fake.c test/host/fakes/timebase_port_fake.c
test_terminal_SRCS := $(CLI_SRCS)
test_packet_SRCS := firmware/net/packet.c
test_network_SRCS := $(CLI_SRCS)
BUS_NODE_SRCS := test/host/bus_node.c $(CLI_SRCS)
test_fuzz_SRCS := $(test_terminal_SRCS)
test_fuzz_HOST_SRCS := test/fuzz/grammar.c test/fuzz/reference.c
test_boot_SRCS := firmware/boot.c test/host/fakes/terminal_port_fake.c test/host/fakes/timebase_port_fake.c
test_drivers_SRCS := firmware/drivers.c
test_wide_SRCS := firmware/base/wide.S
test_block_SRCS := firmware/motion/block.c firmware/motion/block.S firmware/hal/step_hurry.S
test_group_SRCS := firmware/motion/group.c firmware/motion/group.S firmware/base/wide.S
RAMP_SRCS := firmware/motion/ramp.c firmware/motion/ramp.S firmware/motion/group.c firmware/motion/group.S firmware/base/wide.S
test_ramp_SRCS := $(RAMP_SRCS)
test_ramp_next_SRCS := $(RAMP_SRCS)
test_ramp_HOST_SRCS := test/host/motion_exact.c
test_profile_SRCS := firmware/motion/profile.c $(RAMP_SRCS)
ENGINE_SRCS := firmware/drivers.c firmware/motion/engine.c firmware/motion/block.c firmware/motion/profile.c $(RAMP_SRCS) firmware/settings.c \
    test/host/fakes/step_player.c
test_engine_SRCS := $(ENGINE_SRCS)
test_processor_model_SRCS := test/image/processor_model.c
test_property_planner_SRCS := $(ENGINE_SRCS) test/host/motion_exact.c
NINJA_PATH_SRCS := firmware/ninja/path.c firmware/ninja/drive.c firmware/motion/profile.c $(RAMP_SRCS)
NINJA_HEAD_SRCS := $(NINJA_PATH_SRCS) firmware/ninja/commands.c firmware/ninja/centre.c firmware/ninja/pause.c firmware/base/number.c
NINJA_HEAD_HOST_SRCS := test/host/fakes/head_fake.c test/host/fakes/head_firmware.c test/host/fakes/timebase_port_fake.c
test_ninja_path_SRCS := $(NINJA_PATH_SRCS)
test_ninja_path_HOST_SRCS := test/host/fakes/head_fake.c
test_ninja_centre_SRCS := $(NINJA_PATH_SRCS) firmware/ninja/centre.c
test_ninja_centre_HOST_SRCS := test/host/fakes/head_fake.c
test_ninja_commands_SRCS := $(NINJA_HEAD_SRCS)
test_ninja_commands_HOST_SRCS := $(NINJA_HEAD_HOST_SRCS)
test_ninja_constants_SRCS := $(filter-out %/drive.c,$(NINJA_PATH_SRCS))

# Arithmetic that is tested on the AVR as well: the same source, compiled by avr-gcc, run on the simulated board.
AVR_TESTS := test_number test_line test_session test_wide test_block test_group test_ramp test_ramp_next test_profile

# Whole-image tests: test/image/<name>.c with the board; they load build/sac.elf, those of test_ninja_... build/ninja.elf.
IMAGE_TESTS := test_image_boot test_image_pins test_image_encoder test_image_motion test_image_queue \
    test_image_sequence test_image_terminal test_image_stop test_image_configure test_image_powercut test_image_system test_image_timing test_image_clock test_image_stress \
    test_image_estop test_image_ops test_image_processor test_image_fuzz test_image_automicro test_image_manual test_image_bus \
    test_image_network test_image_line test_image_nodes \
    test_ninja_image test_ninja_programs test_ninja_motion test_ninja_halt test_ninja_centring \
    test_ninja_language test_ninja_manual
NINJA_TEST_SRCS := test/image/ninja.c test/image/ninja_model.c test/image/ninja_play.c
test_ninja_programs_SRCS := $(NINJA_TEST_SRCS)
test_ninja_motion_SRCS := $(NINJA_TEST_SRCS)
test_ninja_halt_SRCS := $(NINJA_TEST_SRCS)
test_ninja_centring_SRCS := $(NINJA_TEST_SRCS)
test_ninja_language_SRCS := $(NINJA_TEST_SRCS)
test_ninja_manual_SRCS := $(NINJA_TEST_SRCS)
test_image_bus_SRCS := test/image/soft_peer.c
test_image_network_SRCS := test/image/soft_peer.c test/image/master.c
test_image_line_SRCS := test/image/soft_peer.c test/image/master.c test/fuzz/grammar.c
test_image_nodes_SRCS := test/image/nodes.c
test_image_processor_SRCS := test/image/processor_model.c
# What every whole-image test is linked with.
IMAGE_COMMON_SRCS := test/image/image.c test/image/model.c
test_image_fuzz_SRCS := test/fuzz/grammar.c test/fuzz/reference.c firmware/settings.c

# Tests written in Python.
SCRIPT_TESTS := test/tools/test_tools.py test/sim/test_sacsim.py test/sim/test_ninjasim.py

# Checks that count as one test each.
CHECKS := \
    --check includes='$(PYTHON) tools/check_includes.py' \
    --check pins='$(PYTHON) tools/check_pins.py' \
    --check manual='$(PYTHON) tools/manual.py' \
    --check budgets='$(MAKE) -s --no-print-directory budgets'

# The board, its models, the simulator program and the benchmark list their own sources.
-include test/board/board.mk
-include test/board/models.mk
-include test/board/head.mk
-include tools/sacsim/sacsim.mk
-include tools/ninjasim/ninjasim.mk
-include test/bench/bench.mk

# -- firmware --------------------------------------------------------------------------------------------------------

AVR_MCU := -mmcu=atmega328p
AVR_WARNINGS := -Wall -Wextra -Wconversion -Wshadow -Wlogical-op -Wstrict-prototypes -Wstack-usage=128 -Werror
# What makes this image smaller, measured with avr-gcc 5.4 and tools/outline.py; the last ones are none for 14.2.
# (Not := : `make setup firmware` installs the compiler first.)
AVR_VERSION = $(shell $(AVR)gcc -dumpversion 2>/dev/null)
AVR_SMALLER = -Os -mcall-prologues -mstrict-X -fno-gcse -fno-move-loop-invariants -fno-ipa-sra \
    -flto -fno-tree-forwprop -fno-tree-dominator-opts -fno-inline-small-functions -fira-algorithm=priority -fira-region=all \
    -fno-tree-copy-prop -fno-tree-coalesce-vars -fno-tree-scev-cprop -fno-tree-reassoc -fno-tree-pta -flto-partition=none \
    $(if $(filter 5.%,$(AVR_VERSION)),-fno-tree-sink -fweb -fno-toplevel-reorder)
# What suits single files, found by trying. (Arithmetic of 32 bits nearly throughout is smaller if the registers of a value
# stay together.)
SMALLER_firmware/motion/profile.c := -fno-split-wide-types
SMALLER_firmware/motion/engine.c := -ftree-dominator-opts -ftree-sink -fno-tree-fre -fno-tree-loop-optimize
SMALLER_firmware/queue/queue.c := -fno-cprop-registers
SMALLER_firmware/cli/network.c := -ftree-forwprop
SMALLER_firmware/cli/display.c := -ftree-forwprop
SMALLER_firmware/cli/commands.c := -ftree-sink
SMALLER_firmware/cli/configure.c := -fno-forward-propagate
SMALLER_firmware/cli/terminal.c := -fno-split-wide-types
SMALLER_firmware/cli/motion_syntax.c := -ftree-dominator-opts
AVR_CFLAGS = $(AVR_MCU) -DF_CPU=16000000UL -std=gnu11 $(AVR_SMALLER) -g -ffunction-sections -fdata-sections -fshort-enums \
    -fstack-usage -I$(BUILD)/packed -Ifirmware $(AVR_WARNINGS)
AVR_LDFLAGS := $(AVR_MCU) -Wl,--gc-sections -mrelax -nostartfiles -T firmware/image.ld -Lfirmware
LINK_SCRIPTS := firmware/image.ld firmware/link_order.ld

FIRMWARE_OBJS := $(FIRMWARE_SRCS:firmware/%=$(BUILD)/firmware/%.o)
NINJA_OBJS := $(NINJA_SRCS:firmware/%=$(BUILD)/firmware/%.o)

.PHONY: firmware
firmware: $(BUILD)/sac.hex $(BUILD)/ninja.hex budgets ## both images, build/sac.hex and build/ninja.hex; budgets of flash, RAM, stack

.PHONY: ninja-firmware
ninja-firmware: $(BUILD)/ninja.hex ninja-budgets ## build/ninja.elf and build/ninja.hex alone, and which objects they share with SAC
	@echo 'shared: $(notdir $(basename $(filter $(FIRMWARE_OBJS),$(NINJA_OBJS))))'

# Rewritten only when it changes; every object depends on it. Several makes may look at it at the same time.
$(BUILD)/firmware/flags: FORCE
	@mkdir -p $(@D)
	@echo '$(AVR) $(AVR_CFLAGS) $(AVR_LDFLAGS) $(DEFS) $(FIRMWARE_SRCS) $(NINJA_SRCS) $(foreach s,$(FIRMWARE_SRCS),$(SMALLER_$s)) $(TIMED)' >$@.$$$$ && \
	    if cmp -s $@.$$$$ $@; then rm $@.$$$$; else mv $@.$$$$ $@; fi

# The tables with texts, packed: the compiler finds them before those in firmware/.
PACKED := $(BUILD)/packed/done
$(PACKED): tools/pack_texts.py firmware/cli/pairs.def firmware/cli/commands.def firmware/cli/display.def firmware/base/status.def \
    firmware/settings.def
	@mkdir -p $(@D)
	$(Q)$(PYTHON) $< $(@D)
	@touch $@

$(BUILD)/firmware/%.o: firmware/% $(BUILD)/firmware/flags $(PACKED)
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(AVR)gcc $(AVR_CFLAGS) $(SMALLER_$<) $(DEFS) -MMD -MP -c -o $@ $<

# Link time optimisation ends in one file for the assembler, which is tools/outline.py here.
OUTLINE := $(BUILD)/outline/as
# Where the terminal at 250 kBd and the planner spend most of their time (docs/design.md, "How it fits").
TIMED := main terminal_poll terminal_port_get terminal_port_put line_take commands_read_ahead commands_execute \
    queue_poll take take_next choose offer start_next ramp_steps engine_poll engine_single_pulse play_on look_for_end \
    note_begun pulses_left pulses_in_gear pulses_of_phase add_pulses ops_poll \
    set_interval cruise_next append append_run block_append push \
    get begin_ring drop_emission direction_flags signed_pulses make_ready profile_interval engine_check \
    execute_read fill set_silence emit_phase emit next_group choose_phase \
    put free_places terminal_port_waiting motion_syntax_take motion_syntax_number motion_syntax_end close_parameter range_check \
    session_template pay attend bus_poll network_poll
$(OUTLINE): tools/outline.py $(BUILD)/firmware/flags
	@mkdir -p $(@D)
	@echo '#!/bin/sh' >$@
	@echo 'exec $(PYTHON) $< --order firmware/link_order.ld --timed "$(TIMED)" --as $(AVR)as -- "$$@"' >>$@
	@chmod +x $@

$(BUILD)/sac.elf: $(FIRMWARE_OBJS) $(LINK_SCRIPTS) $(BUILD)/firmware/flags $(OUTLINE)
	$(call say,LD  $@)
	$(Q)$(AVR)gcc -B$(dir $(OUTLINE)) $(AVR_CFLAGS) $(AVR_LDFLAGS) -Wl,-Map=$(BUILD)/sac.map -o $@ $(FIRMWARE_OBJS)

# With the C library's start-up code and the linker's own script: there is room for both.
$(BUILD)/ninja.elf: $(NINJA_OBJS) $(BUILD)/firmware/flags
	$(call say,LD  $@)
	$(Q)$(AVR)gcc $(AVR_CFLAGS) -Wl,--gc-sections -mrelax -Wl,-Map=$(BUILD)/ninja.map -o $@ $(NINJA_OBJS)

$(BUILD)/%.hex: $(BUILD)/%.elf
	$(call say,HEX $@)
	$(Q)$(AVR)objcopy -O ihex -j .text -j .data $< $@

.PHONY: link-order
link-order: $(BUILD)/sac.elf ## find the order of the functions with the most short calls: after larger changes
	@$(PYTHON) tools/link_order.py $< --map $(BUILD)/sac.map --objdump $(AVR)objdump --pinned .text.step_isr
	@$(MAKE) -s --no-print-directory firmware

.PHONY: budgets
budgets: $(BUILD)/sac.elf ninja-budgets
	@$(PYTHON) tools/check_size.py $< --size $(AVR)size --flash-budget $(FLASH_BUDGET) --ram-budget $(RAM_BUDGET)
	@$(PYTHON) tools/check_stack.py $< --su $(BUILD)/firmware --prefix $(AVR)

.PHONY: ninja-budgets
ninja-budgets: $(BUILD)/ninja.elf
	@$(PYTHON) tools/check_size.py $< --size $(AVR)size --flash-budget $(NINJA_FLASH_BUDGET) --ram-budget $(NINJA_RAM_BUDGET)
	@$(PYTHON) tools/check_stack.py $< --su $(BUILD)/firmware/ninja --prefix $(AVR)

-include $(sort $(FIRMWARE_OBJS:.o=.d) $(NINJA_OBJS:.o=.d))

.PHONY: newer
newer: ## the same sources with the newer avr-gcc (14.2): no warning, and what it makes fits the chip, without a bootloader
ifeq ($(NEWER_AVR),)
	@echo 'newer: skipped, avr-gcc 14 is not here; ./sac newer fetches it'
else
	@$(MAKE) -s --no-print-directory AVR=$(NEWER_AVR) BUILD=$(BUILD)/newer FLASH_BUDGET=32768 TIMED= firmware
	@echo "newer: $$($(NEWER_AVR)gcc -dumpversion) builds all sources without a warning"
endif

# -- the board and what runs on it -----------------------------------------------------------------------------------

HOST_WARNINGS := -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Werror
HOST_CFLAGS := -std=gnu11 -g $(HOST_WARNINGS)
HOST_HEADERS := $(wildcard firmware/*.h firmware/*/*.h firmware/*/*/*.h firmware/*/*.def test/*.h test/*/*.h test/*/*/*.h tools/*/*.h)
SANITIZE := -fsanitize=address,undefined -fno-sanitize-recover=all
UNITY_FLAGS := -DUNITY_INCLUDE_DOUBLE -DUNITY_SUPPORT_64
BOARD_OBJS := $(BOARD_SRCS:%.c=$(BUILD)/%.o)
BOARD_LIB := $(BUILD)/libboard.a

$(BOARD_OBJS): $(BUILD)/%.o: %.c $(HOST_HEADERS) Makefile
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 $(BOARD_CFLAGS) -Itest/board -c -o $@ $<

$(BOARD_LIB): $(BOARD_OBJS)
	@rm -f $@
	$(call say,AR  $@)
	$(Q)ar rcs $@ $^

SACSIM_OBJS := $(SACSIM_SRCS:%.c=$(BUILD)/%.o)
NINJASIM_OBJS := $(NINJASIM_SRCS:%.c=$(BUILD)/%.o)

$(sort $(SACSIM_OBJS) $(NINJASIM_OBJS)): $(BUILD)/%.o: %.c $(HOST_HEADERS) Makefile
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 $(SACSIM_CPPFLAGS) -c -o $@ $<

$(BUILD)/sacsim: $(SACSIM_OBJS) $(BOARD_LIB)
	$(call say,LD  $@)
	$(Q)$(HOST_CC) $(BOARD_LDFLAGS) -o $@ $^ $(BOARD_LIBS) $(SACSIM_LDLIBS)

.PHONY: sim
sim: $(BUILD)/sacsim $(BUILD)/sac.elf ## type at a simulated Nano; SIM='--help' lists its options
	@$(BUILD)/sacsim $(SIM) $(BUILD)/sac.elf

$(BUILD)/ninjasim: $(NINJASIM_OBJS) $(BOARD_LIB)
	$(call say,LD  $@)
	$(Q)$(HOST_CC) $(BOARD_LDFLAGS) -o $@ $^ $(BOARD_LIBS) $(NINJASIM_LDLIBS)

.PHONY: ninja
ninja: $(BUILD)/ninjasim $(BUILD)/ninja.elf ## steer a simulated pan and tilt head; SIM='--help' lists its options
	@$(BUILD)/ninjasim $(SIM) $(BUILD)/ninja.elf

$(BUILD)/bench: $(BENCH_SRCS) $(BOARD_LIB) $(HOST_HEADERS)
	$(call say,LD  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 -Itest -Itest/board -Ifirmware $(BOARD_LDFLAGS) -o $@ $(filter %.c %.a,$^) $(BOARD_LIBS) -lm

.PHONY: bench
bench: $(BUILD)/bench $(BUILD)/sac.elf ## measure the image on the board; writes docs/benchmark.md
	@$(PYTHON) tools/check_stack.py $(BUILD)/sac.elf --su $(BUILD)/firmware --prefix $(AVR) >$(BUILD)/stack.txt || true
	@$(BUILD)/bench --stack $(BUILD)/stack.txt --markdown docs/benchmark.md $(BUILD)/sac.elf $(BENCH)

# -- tests -----------------------------------------------------------------------------------------------------------

TEST_INCLUDES := -isystem $(UNITY) -Itest -Ifirmware -Itest/host -Itest/host/fakes

# Where the tests find what they load.
TEST_PATHS := -DBOARD_PROGRAMS_DIR='"$(BUILD)/board/programs"' -DSAC_ELF='"$(BUILD)/sac.elf"' -DNINJA_ELF='"$(BUILD)/ninja.elf"'

HOST_BINS := $(HOST_TESTS:%=$(BUILD)/host/%)
AVR_IMAGES := $(AVR_TESTS:%=$(BUILD)/avr/%.elf)
BOARD_BINS := $(BOARD_TESTS:%=$(BUILD)/board/%)
BOARD_IMAGES := $(BOARD_PROGRAMS:%=$(BUILD)/board/programs/%.elf)
IMAGE_BINS := $(IMAGE_TESTS:%=$(BUILD)/image/%)

$(BUILD)/unity.o: $(UNITY)/unity.c
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(HOST_CC) -O2 -g $(UNITY_FLAGS) -c -o $@ $<

$(BUILD)/unity-sanitized.o: $(UNITY)/unity.c
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(HOST_CC) -O1 -g $(UNITY_FLAGS) $(SANITIZE) -c -o $@ $<

.SECONDEXPANSION:
$(HOST_BINS): $(BUILD)/host/%: test/host/%.c $$($$*_SRCS) $$($$*_HOST_SRCS) $(BUILD)/unity-sanitized.o $(HOST_HEADERS) Makefile
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O1 $(UNITY_FLAGS) $(SANITIZE) $(TEST_INCLUDES) -o $@ $(filter %.c %.o,$^) -lm

$(BUILD)/host/test_ninja_constants: HOST_CFLAGS += -DNINJA_BACKLASH_X=0 -DNINJA_BACKLASH_Y=0 -DNINJA_ACCELERATION=400 \
    -DNINJA_START_STEPS_PER_S=20 -DNINJA_TOP_STEPS_PER_S=300

# The nodes of test_bus_nodes.
BUS_NODE_FLAGS := -fPIC -shared -fvisibility=hidden
$(BUILD)/host/test_bus_nodes: HOST_CFLAGS += -DBUS_NODE_SO='"$(BUILD)/host/bus_node.so"'
$(BUILD)/host/bus_node.so: $(BUS_NODE_SRCS) $(HOST_HEADERS) Makefile
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O1 $(SANITIZE) $(BUS_NODE_FLAGS) $(TEST_INCLUDES) -o $@ $(filter %.c,$^)

# Unity reports over the serial port; the runner passes on what it says. -UAVR: Unity 2.5 would put its words into flash
# and read them from RAM.
$(AVR_IMAGES): $(BUILD)/avr/%.elf: test/host/%.c $$($$*_SRCS) test/avr/report.c $(HOST_HEADERS) Makefile
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(AVR)gcc $(AVR_MCU) -DF_CPU=16000000UL -std=gnu11 -Os -g -fshort-enums -ffunction-sections -fdata-sections \
	    -Wl,--gc-sections -UAVR -include test/avr/report.h -DUNITY_EXCLUDE_FLOAT $(TEST_INCLUDES) -o $@ \
	    $(filter %.c %.S,$^) $(UNITY)/unity.c -lm

$(BUILD)/avr/run: test/avr/run.c $(BOARD_LIB) $(HOST_HEADERS)
	@mkdir -p $(@D)
	$(call say,LD  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 -Itest/board $(BOARD_LDFLAGS) -o $@ $(filter %.c %.a,$^) $(BOARD_LIBS)

$(BOARD_IMAGES): $(BUILD)/board/programs/%.elf: $$(wildcard test/board/programs/$$*.[cS])
	@mkdir -p $(@D)
	$(call say,CC  $@)
	$(Q)$(AVR)gcc $(AVR_MCU) -DF_CPU=16000000UL -std=gnu11 -Os -g -Wall -Wextra -Werror -o $@ $<

$(BOARD_BINS): $(BUILD)/board/%: test/board/%.c $(BUILD)/unity.o $(BOARD_LIB) $(HOST_HEADERS)
	@mkdir -p $(@D)
	$(call say,LD  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 $(UNITY_FLAGS) $(TEST_INCLUDES) $(TEST_PATHS) -Itest/board $(BOARD_LDFLAGS) -o $@ \
	    $(filter %.c %.o %.a,$^) $(BOARD_LIBS) -lm

$(IMAGE_BINS): $(BUILD)/image/%: test/image/%.c $(IMAGE_COMMON_SRCS) $$($$*_SRCS) $(BUILD)/unity.o $(BOARD_LIB) \
    $(HOST_HEADERS)
	@mkdir -p $(@D)
	$(call say,LD  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 $(UNITY_FLAGS) $(TEST_INCLUDES) $(TEST_PATHS) -Itest/board $(BOARD_LDFLAGS) -o $@ \
	    $(filter %.c %.o %.a,$^) $(BOARD_LIBS) -lm

HOST_PARTS := $(HOST_BINS) $(BUILD)/host/bus_node.so
BOARD_PARTS := $(BOARD_BINS) $(BOARD_IMAGES)
IMAGE_PARTS := $(IMAGE_BINS) $(BUILD)/sac.hex $(BUILD)/ninja.hex
SIM_PARTS := $(BUILD)/sacsim $(BUILD)/sac.elf $(BUILD)/ninjasim $(BUILD)/ninja.elf
AVR_PARTS := $(if $(AVR_TESTS),$(AVR_IMAGES) $(BUILD)/avr/run)

.PHONY: test-parts
test-parts: $(HOST_PARTS) $(BOARD_PARTS) $(IMAGE_PARTS) $(AVR_PARTS) $(SIM_PARTS)

# Building goes on after an error; that it failed counts as a failed check, and the runner has the last word.
build_then_run = echo 'building'; built=true; $(MAKE) -s -k -j$(JOBS) --no-print-directory $(1) || built=false; \
    $(PYTHON) tools/run_tests.py --jobs $(JOBS) --check build=$$built --results $(BUILD)/$(2)
test_runs = $(foreach run,$(1),--tests $(run))
AVR_RUNS = $(foreach run,$(AVR_TESTS),--tests '$(BUILD)/avr/run $(BUILD)/avr/$(run).elf')
# For scripts that may run in another folder.
AVR_PATH := $(if $(findstring /,$(AVR)),$(abspath $(AVR)),$(AVR))
TEST_ENV := env BUILD=$(BUILD) SACSIM=$(BUILD)/sacsim NINJASIM=$(BUILD)/ninjasim SAC_ELF=$(BUILD)/sac.elf NINJA_ELF=$(BUILD)/ninja.elf AVR=$(AVR_PATH)
SCRIPT_RUNS = $(foreach run,$(SCRIPT_TESTS),--tests '$(TEST_ENV) $(PYTHON) $(run)')

.PHONY: test
test: ## builds, runs and sums up all tests and checks but the known failures
	@$(call build_then_run,test-parts,test-results) $(call test_runs,$(IMAGE_BINS) $(BOARD_BINS) $(HOST_BINS)) \
	    $(AVR_RUNS) $(SCRIPT_RUNS) $(CHECKS) --check newer='$(MAKE) -s --no-print-directory newer' \
	    $(if $(CI),--check crosscheck='$(TEST_ENV) tools/crosscheck/run.sh') \
	    --last trace='$(PYTHON) tools/trace.py --results $(BUILD)/test-results --quiet'

.PHONY: test-host
test-host: ## the pure modules on this machine, with the sanitizers, and their arithmetic on the AVR
	@$(call build_then_run,$(HOST_PARTS) $(AVR_PARTS),test-host) $(call test_runs,$(HOST_BINS)) $(AVR_RUNS)

.PHONY: test-board
test-board: ## the simulated board against the datasheet
	@$(call build_then_run,$(BOARD_PARTS),test-board) $(call test_runs,$(BOARD_BINS))

.PHONY: test-image
test-image: ## the whole image on the simulated board
	@$(call build_then_run,$(IMAGE_PARTS),test-image) $(call test_runs,$(IMAGE_BINS))

.PHONY: test-known-failures
test-known-failures: ## the tests that this version is known to fail, left out of `make test` (docs/design.md)
	@SAC_KNOWN_FAILURES=1 $(MAKE) --no-print-directory test-host test-image

# The same lines without the sanitizers, several times as fast.
$(BUILD)/fuzz: test/host/test_fuzz.c $(test_fuzz_SRCS) $(test_fuzz_HOST_SRCS) $(BUILD)/unity.o $(HOST_HEADERS) Makefile
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 -flto $(UNITY_FLAGS) $(TEST_INCLUDES) -o $@ $(filter %.c %.o,$^) -lm

.PHONY: fuzz-long
fuzz-long: ## 10^8 damaged lines into the terminal on this machine; SAC_FUZZ_SEED=n makes others, SAC_FUZZ_LINES=n fewer
	@$(MAKE) -s --no-print-directory $(BUILD)/fuzz
	@SAC_FUZZ_LINES=$${SAC_FUZZ_LINES:-100000000} $(BUILD)/fuzz

.PHONY: fuzz-ninja-long
fuzz-ninja-long: ## 10^7 bytes into the Ninja's commands and macros, sanitized (minutes); NINJA_BYTES=n makes fewer, NINJA_SEED=n others
	@$(MAKE) -s --no-print-directory $(BUILD)/host/test_ninja_commands
	@NINJA_BYTES=$${NINJA_BYTES:-10000000} $(BUILD)/host/test_ninja_commands

$(BUILD)/packets: test/host/test_packet.c $(test_packet_SRCS) $(BUILD)/unity.o $(HOST_HEADERS) Makefile
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 -flto $(UNITY_FLAGS) $(TEST_INCLUDES) -o $@ $(filter %.c %.o,$^) -lm

.PHONY: test-packet-long
test-packet-long: ## all errors of 1, 2 and 3 bits in 200 packets of the network (some minutes); SAC_PACKETS=n makes others
	@$(MAKE) -s --no-print-directory $(BUILD)/packets
	@SAC_PACKETS=$${SAC_PACKETS:-200} $(BUILD)/packets

.PHONY: test-phases-long
test-phases-long: ## the software port with 25 peers' clocks, at each of the 480 phases of the step interrupt at 33 kHz
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_bus $(BUILD)/sac.hex
	@SAC_PHASES=$${SAC_PHASES:-480} $(BUILD)/image/test_image_bus

.PHONY: fuzz-packet-long
fuzz-packet-long: ## 10^9 frames and fragments into the network's decoder, sanitized (6 minutes); SAC_FRAMES=n makes fewer
	@$(MAKE) -s --no-print-directory $(BUILD)/host/test_packet
	@SAC_FRAMES=$${SAC_FRAMES:-1000000000} $(BUILD)/host/test_packet

# As in make test, without the sanitizers.
$(BUILD)/bus_node.so: $(BUS_NODE_SRCS) $(HOST_HEADERS) Makefile
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 $(BUS_NODE_FLAGS) $(TEST_INCLUDES) -o $@ $(filter %.c,$^)

$(BUILD)/bus_nodes: test/host/test_bus_nodes.c $(BUILD)/bus_node.so $(BUILD)/unity.o $(HOST_HEADERS) Makefile
	$(call say,CC  $@)
	$(Q)$(HOST_CC) $(HOST_CFLAGS) -O2 $(UNITY_FLAGS) $(TEST_INCLUDES) -DBUS_NODE_SO='"$(BUILD)/bus_node.so"' -o $@ $(filter %.c %.o,$^) -lm

.PHONY: test-bus-long
test-bus-long: ## 10^6 commands to 200 nodes on a line that loses 1 packet of 1,000; SAC_BUS_COMMANDS=n, SAC_BUS_LOSS=n, SAC_BUS_SEED=n
	@$(MAKE) -s --no-print-directory $(BUILD)/bus_nodes
	@SAC_BUS_COMMANDS=$${SAC_BUS_COMMANDS:-1000000} SAC_BUS_LOSS=$${SAC_BUS_LOSS:-1000} $(BUILD)/bus_nodes

.PHONY: test-network-long
test-network-long: ## 10^5 packets on the image at 33 kHz, 10^4 at 100 kHz, the terminal busy; SAC_PACKETS=n makes others
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_line $(BUILD)/sac.hex
	@SAC_PACKETS=$${SAC_PACKETS:-100000} $(BUILD)/image/test_image_line

.PHONY: fuzz-image-long
fuzz-image-long: ## 10^5 damaged lines at the image on the board; SAC_FUZZ_SEED=n makes others, SAC_FUZZ_LINES=n fewer
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_fuzz $(BUILD)/sac.hex
	@SAC_FUZZ_LINES=$${SAC_FUZZ_LINES:-100000} $(BUILD)/image/test_image_fuzz

.PHONY: test-ninja-long
test-ninja-long: ## the Ninja: 1,000 random programs, 500 moves, centring from 100 places, 10^5 random bytes (some minutes)
	@$(MAKE) -s --no-print-directory $(filter %/test_ninja_programs %/test_ninja_motion %/test_ninja_centring %/test_ninja_language,$(IMAGE_BINS)) $(BUILD)/ninja.hex
	@SAC_NINJA_PROGRAMS=$${SAC_NINJA_PROGRAMS:-1000} $(BUILD)/image/test_ninja_programs
	@SAC_NINJA_MOVES=$${SAC_NINJA_MOVES:-500} $(BUILD)/image/test_ninja_motion
	@SAC_NINJA_STARTS=$${SAC_NINJA_STARTS:-100} $(BUILD)/image/test_ninja_centring
	@SAC_NINJA_BYTES=$${SAC_NINJA_BYTES:-50000} $(BUILD)/image/test_ninja_language

.PHONY: test-nodes-long
test-nodes-long: ## 10^4 commands to three images on a line that loses packets (a minute); SAC_NODE_COMMANDS=n, SAC_NODE_LOSS=n
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_nodes $(BUILD)/sac.hex
	@SAC_NODE_COMMANDS=$${SAC_NODE_COMMANDS:-10000} $(BUILD)/image/test_image_nodes

.PHONY: test-processor
test-processor: ## 2,000 random scripts on the image and on the model of the command processor
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_processor $(BUILD)/sac.hex
	@SAC_SCRIPTS=$${SAC_SCRIPTS:-2000} $(BUILD)/image/test_image_processor

.PHONY: test-powercut
test-powercut: ## power cuts on the image while it saves, ten times as many as `make test` makes (some minutes)
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_powercut $(BUILD)/sac.hex
	@SAC_CUTS=$${SAC_CUTS:-10} $(BUILD)/image/test_image_powercut

.PHONY: test-long
test-long: ## ten million mixed steps with the terminal busy (some minutes); `make test` makes a million
	@$(MAKE) -s --no-print-directory $(BUILD)/image/test_image_stress $(BUILD)/sac.hex
	@SAC_STEPS=10000000 $(BUILD)/image/test_image_stress

.PHONY: test-scripts
test-scripts: ## the simulator program as its user sees it, and the scripts that check the build
	@$(call build_then_run,$(SIM_PARTS),test-scripts) $(SCRIPT_RUNS)

.PHONY: trace
trace: ## which requirement which passing test shows (of the last `make test`); raises docs/trace-count
	@$(PYTHON) tools/trace.py --results $(BUILD)/test-results --raise

.PHONY: crosscheck
crosscheck: ## the image in avr8js: the edges of clk compared with the board's (needs Node 20)
	@tools/crosscheck/run.sh

# -- hardware --------------------------------------------------------------------------------------------------------

# A Nano's bootloader listens at 115200 bits/s, older ones at 57600: whichever answers.
.PHONY: flash
flash: $(BUILD)/$(IMAGE).hex ## flash a Nano: PORT=/dev/ttyUSB0, if need be BAUD=57600 or 115200; IMAGE=ninja: the Ninja
	@for baud in $(BAUD); do \
	    echo "avrdude at $$baud bits/s"; \
	    avrdude -p atmega328p -c arduino -P $(PORT) -b $$baud -D -U flash:w:$<:i && exit 0; \
	done; echo "no bootloader answered on $(PORT)" >&2; exit 1

# The fuses (datasheet DS40002061, tables 27-5 to 27-7; 0 is programmed):
#   low  0xF7  CKDIV8 1: undivided; CKOUT 1: off; SUT 11 and CKSEL 0111: full-swing crystal oscillator, 16K clocks and
#              65 ms of start-up (table 9-5): the safest for a crystal, with brown-out detection or without
#   high 0xD1  RSTDISBL 1: reset pin works; DWEN 1: off; SPIEN 0: ISP works; WDTON 1: the firmware starts the watchdog;
#              EESAVE 0: a chip erase keeps the EEPROM; BOOTSZ 00, BOOTRST 1: no bootloader, start at 0
#   ext  0xFC  BODLEVEL 100: brown-out detection at 4.3 V, the only level above the 3.8 V that 16 MHz need (figure 28-1)
# They are written first: the chip erase that comes with the flash would take the EEPROM along without EESAVE.
FUSES := -U lfuse:w:0xF7:m -U hfuse:w:0xD1:m -U efuse:w:0xFC:m

.PHONY: flash-isp
flash-isp: $(BUILD)/$(IMAGE).hex ## flash and set the fuses with an ISP programmer: PROGRAMMER=usbasp
	avrdude -p atmega328p -c $(PROGRAMMER) $(FUSES)
	avrdude -p atmega328p -c $(PROGRAMMER) -U flash:w:$<:i

# -- housekeeping ----------------------------------------------------------------------------------------------------

.PHONY: manual
manual: ## bring the manual's tables up to date with the firmware's
	@$(PYTHON) tools/manual.py --write

C_FILES = $(shell git ls-files '*.c' '*.h')

.PHONY: format
format: ## clang-format on all C files that git knows
	clang-format -i $(C_FILES)

.PHONY: lint
lint: ## the checks alone: includes, pin table, manual, budgets; shell scripts where shellcheck is installed
	@$(call build_then_run,$(BUILD)/sac.elf,lint) $(CHECKS)
	@if command -v shellcheck >/dev/null; then shellcheck sac tools/setup.sh .ci/run; fi

.PHONY: setup
setup: ## install what is missing
	@sh tools/setup.sh build

.PHONY: clean
clean: ## remove what was built; what setup fetched stays in .tools/
	rm -rf $(BUILD)

.PHONY: help
help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | awk -F '\t' '{ printf "  %-12s %s\n", $$1, $$2 }'

.PHONY: FORCE
FORCE:
.DEFAULT_GOAL := help
