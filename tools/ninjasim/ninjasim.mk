# The Ninja's simulator: its sources, for the Makefile at the top, which compiles them with the board library.
NINJASIM_SRCS := $(addprefix tools/ninjasim/, main.c options.c screen.c) \
	$(addprefix tools/sacsim/, keys.c numbers.c pace.c signals.c)
NINJASIM_LDLIBS := -lncurses -lm
