/* CRC-16-CCITT (polynomial 0x1021, highest bit first): finds every error in one or two neighbouring bytes.
 *
 * What is appended, high byte first, brings the sum of the whole to 0.
 * Context: main loop; pure. Cost: about 30 cycles a byte. Errors: none. Tests: test/host/test_store.c */
#ifndef BASE_CRC16_H
#define BASE_CRC16_H

#include <stdint.h>

uint16_t crc16_add(uint16_t crc, uint8_t byte);

#endif
