#include "net/packet.h"
#include <stdbool.h>
#include "base/inline.h"

enum { NOTHING, DESTINATION, ORIGIN, BODY, CRC, NUL };

static NOINLINE uint8_t crc8_add(uint8_t crc, uint8_t byte)
{
    crc ^= byte;
    for (uint8_t bits = 8; bits > 0; bits--) {
        const uint8_t out = crc & 1;
        crc >>= 1;
        if (out) {
            crc ^= 0x8C;
        }
    }
    return crc;
}

static NOINLINE bool is_for(const packet_t *packet, uint8_t own)
{
    return packet->destination == own || packet->destination == PACKET_EVERYBODY;
}

packet_event_t packet_take(packet_t *packet, uint8_t byte, uint8_t own, uint8_t strict)
{
    NEAR(packet);
    const uint8_t expected = packet->expected;
    if (expected == DESTINATION || expected == ORIGIN) {
        if (expected == ORIGIN) {
            packet->origin = byte;
        } else {
            packet->destination = byte;
            packet->crc = 0;
            packet->length = 0;
        }
        if (strict) {
            packet->crc = crc8_add(packet->crc, byte);
        }
        packet->expected++;
        return PACKET_NONE;
    }
    const bool mine = is_for(packet, own);
    packet_event_t event = expected == NOTHING ? PACKET_NONE : PACKET_BROKEN;
    if (expected == BODY) {
        if (byte == PACKET_ETX && packet->length != 0) {
            packet->expected = CRC;
            return PACKET_NONE;
        }
        if (byte != '\0' && byte != PACKET_STX && byte != PACKET_ETX && packet->length != PACKET_BODY_BYTES) {
            if (mine) {
                packet->body[packet->length] = byte;
            }
            packet->length++;
            packet->crc = crc8_add(packet->crc, byte);
            return PACKET_NONE;
        }
    } else if (expected == CRC) {
        if (byte != '\0' || strict) {
            packet->crc ^= byte;
            packet->expected = NUL;
            return PACKET_NONE;
        }
        event = PACKET_WHOLE; /* it has none */
    } else if (expected == NUL && byte == '\0') {
        event = packet->crc == 0 ? PACKET_WHOLE : PACKET_WRONG;
    }
    packet->expected = NOTHING;
    if (byte == PACKET_STX) {
        packet->expected = DESTINATION; /* in place of what was expected: the next packet */
    }
    if (!mine) {
        return PACKET_NONE;
    }
    packet->body[packet->length] = '\0';
    return event;
}

packet_event_t packet_end(packet_t *packet, uint8_t own, uint8_t strict)
{
    NEAR(packet);
    packet_event_t event = PACKET_BROKEN;
    if (packet->expected <= ORIGIN || !is_for(packet, own)) {
        event = PACKET_NONE;
    } else if (packet->expected == BODY && !strict && packet->length == 1 &&
               (packet->body[0] == PACKET_ACK || packet->body[0] == PACKET_NAK)) {
        packet->body[1] = '\0';
        event = PACKET_WHOLE;
    }
    packet->expected = NOTHING;
    return event;
}

uint8_t packet_under_way(const packet_t *packet)
{
    return packet->expected; /* NOTHING: 0 */
}

uint8_t packet_close(packet_t *packet, uint8_t crc, uint8_t strict)
{
    NEAR(packet);
    packet->stx = PACKET_STX;
    uint8_t *end = packet->body + packet->length;
    uint8_t sum = 0;
    for (const uint8_t *byte = strict ? &packet->destination : packet->body; byte != end; byte++) {
        sum = crc8_add(sum, *byte);
    }
    if (crc && !strict && sum == 0) { /* would read as none */
        sum = crc8_add(sum, ' ');
        *end++ = ' ';
    }
    *end++ = PACKET_ETX;
    if (crc || strict) {
        *end++ = sum;
    }
    *end++ = '\0';
    return (uint8_t)(end - &packet->stx);
}
