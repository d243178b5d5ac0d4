# The benchmark's sources. BENCH='cruise error' on make's command line runs those rows alone and leaves the document as it
# is; BENCH=--strict fails if a target is missed.

BENCH ?=
BENCH_SRCS := $(addprefix test/bench/, bench.c run.c ideal.c image_file.c rows_rate.c rows_time.c rows_load.c \
    rows_error.c rows_bus.c)
