# The board's models of the serial port, EEPROM, watchdog and resets, and their tests.

BOARD_SRCS += test/board/usart.c test/board/eeprom.c test/board/watchdog.c test/board/reset.c
BOARD_TESTS += test_board_usart test_board_eeprom test_board_reset
# Programs for the simulated board: test/board/programs/<name>.c or .S
BOARD_PROGRAMS += usart_send usart_buffer usart_receive usart_echo eeprom_sequence eeprom_access eeprom_ready \
    eeprom_libc wdt_modes wdt_sequence reset_flags reset_sleep
