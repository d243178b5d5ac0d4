# The simulator program: its sources, for the Makefile at the top, which compiles them with the board library.
SACSIM_SRCS := \
	tools/sacsim/console.c \
	tools/sacsim/eeprom_file.c \
	tools/sacsim/keys.c \
	tools/sacsim/main.c \
	tools/sacsim/meter.c \
	tools/sacsim/network.c \
	tools/sacsim/numbers.c \
	tools/sacsim/options.c \
	tools/sacsim/pace.c \
	tools/sacsim/posts.c \
	tools/sacsim/pty.c \
	tools/sacsim/session.c \
	tools/sacsim/signals.c \
	tools/sacsim/trace.c
# Includes are written from the top of the repository ("firmware/board.h", "test/board/board.h").
SACSIM_CPPFLAGS := -I. -D_GNU_SOURCE
SACSIM_LDLIBS := -lm
