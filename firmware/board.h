/* The pin map of the Arduino Nano, nowhere else. One row a post: PIN(post, port letter, bit, Nano pin, use). */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_CPU_HZ 16000000UL

/* POST(name, port, bit, nano, direction, remark) */
#define BOARD_POSTS(POST)                                                       \
    POST(HW_RX, D, 0, "D0", IN, "USART0, shared with USB")                      \
    POST(HW_TX, D, 1, "D1", OUT, "USART0, shared with USB")                     \
    POST(ESTOP, D, 2, "D2", IN, "INT0, the highest-priority interrupt of all")  \
    POST(SYNC, D, 3, "D3", IN, "INT1, next highest")                            \
    POST(SW_RX, D, 4, "D4", IN, "PCINT20, only pin of its pin-change group")    \
    POST(XCLK, D, 5, "D5", IN, "T1, Timer1's clock input")                      \
    POST(SW_TX, D, 6, "D6", OUT, "OC0A, bits timed by Timer0's hardware")       \
    POST(TX_EN, D, 7, "D7", OUT, "RS485 driver enable")                         \
    POST(RST, B, 0, "D8", IN, "factory reset")                                  \
    POST(ENABLE, B, 1, "D9", OUT, "reserved: driver enable, kept low")          \
    POST(CLK, B, 2, "D10", OUT, "OC1B, every edge made by Timer1's hardware")   \
    POST(OUT_1MHZ, B, 3, "D11", OUT, "OC2A, Timer2 alone")                      \
    POST(MS3, B, 4, "D12", OUT, "microstep select")                             \
    POST(DIR, B, 5, "D13", OUT, "the board's LED shows the direction")          \
    POST(EN_A, C, 0, "A0", IN, "encoder")                                       \
    POST(EN_B, C, 1, "A1", IN, "encoder")                                       \
    POST(OPSB, C, 2, "A2", OUT, "inverse of OPSA")                              \
    POST(MS1, C, 3, "A3", OUT, "microstep select")                              \
    POST(MS2, C, 4, "A4", OUT, "microstep select")                              \
    POST(OPSA, C, 5, "A5", OUT, "1 while a command runs")

#endif
