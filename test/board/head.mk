# The simulated pan and tilt head on the board, and its tests.

BOARD_SRCS += test/board/head.c
BOARD_TESTS += test_board_head
