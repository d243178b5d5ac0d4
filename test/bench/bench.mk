# The benchmark: what it is made of, and its rule. BENCH='cruise error' runs those rows alone and leaves the document as
# it is; BENCH=--strict fails if a target is missed.

BENCH ?=
BENCH_SRCS := $(addprefix test/bench/, bench.c run.c ideal.c image_file.c rows_rate.c rows_time.c rows_load.c \
    rows_error.c)

$(BUILD)/bench: $(BENCH_SRCS) $(BOARD_LIB) $(HOST_HEADERS)
	@mkdir -p $(@D)
	$(HOST_CC) $(HOST_CFLAGS) -O2 -Itest/board -Ifirmware $(BOARD_LDFLAGS) -o $@ $(filter %.c %.a,$^) $(BOARD_LIBS)

.PHONY: bench
bench: $(BUILD)/bench $(BUILD)/sac.elf ## measure the image on the board; writes docs/benchmark.md
	@$(PYTHON) tools/check_stack.py $(BUILD)/sac.elf --su $(BUILD)/firmware --prefix $(AVR) >$(BUILD)/stack.txt || true
	@$(BUILD)/bench --stack $(BUILD)/stack.txt --markdown docs/benchmark.md $(BUILD)/sac.elf $(BENCH)
