#include "net/packet.h"
#include "base/inline.h"

enum { NOTHING, DESTINATION, ORIGIN, BODY, CRC, NUL };

enum { HEADER_BYTES = 3 };

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

static bool is_for(const packet_t *packet, uint8_t own)
{
    return packet->destination == own || packet->destination == PACKET_EVERYBODY;
}

/* What became of it, if it is this node's business. */
static NOINLINE packet_event_t leave(packet_t *packet, uint8_t own, packet_event_t event)
{
    packet->expected = NOTHING;
    return is_for(packet, own) ? event : PACKET_NONE;
}

packet_event_t packet_take(packet_t *packet, uint8_t byte, uint8_t own, bool strict)
{
    NEAR(packet);
    packet_event_t event = PACKET_BROKEN;
    switch (packet->expected) {
    case DESTINATION:
        packet->destination = byte;
        packet->crc = 0;
        packet->length = 0;
        break;
    case ORIGIN: packet->origin = byte; break;
    case BODY:
        if (byte == PACKET_ETX) {
            packet->expected = CRC;
            return PACKET_NONE;
        }
        if (byte == PACKET_STX || byte == '\0' || packet->length == PACKET_BODY_BYTES) {
            event = leave(packet, own, PACKET_BROKEN);
            if (byte == PACKET_STX) {
                packet->expected = DESTINATION;
            }
            return event;
        }
        if (is_for(packet, own)) {
            packet->body[packet->length] = byte;
        }
        packet->length++;
        packet->crc = crc8_add(packet->crc, byte);
        return PACKET_NONE;
    case CRC:
        if (byte == '\0' && !strict) {
            event = PACKET_WHOLE; /* it has none */
            break;
        }
        packet->crc ^= byte;
        packet->expected = NUL;
        return PACKET_NONE;
    case NUL:
        if (byte == '\0') {
            event = packet->crc == 0 ? PACKET_WHOLE : PACKET_WRONG;
        }
        break;
    default:
        if (byte == PACKET_STX) {
            packet->expected = DESTINATION;
        }
        return PACKET_NONE;
    }
    if (packet->expected <= ORIGIN) {
        if (strict) {
            packet->crc = crc8_add(packet->crc, byte);
        }
        packet->expected++;
        return PACKET_NONE;
    }
    if (packet->length == 0) {
        event = PACKET_BROKEN;
    } else if (is_for(packet, own)) {
        packet->body[packet->length] = '\0';
    }
    event = leave(packet, own, event);
    if (byte == PACKET_STX) {
        packet->expected = DESTINATION; /* in place of the NUL: the next packet */
    }
    return event;
}

packet_event_t packet_end(packet_t *packet, uint8_t own, bool strict)
{
    if (packet->expected == BODY && !strict && packet->length == 1 && is_for(packet, own) &&
        (packet->body[0] == PACKET_ACK || packet->body[0] == PACKET_NAK)) {
        packet->body[1] = '\0';
        return leave(packet, own, PACKET_WHOLE);
    }
    return leave(packet, own, packet->expected > ORIGIN ? PACKET_BROKEN : PACKET_NONE);
}

bool packet_under_way(const packet_t *packet)
{
    return packet->expected != NOTHING;
}

uint8_t packet_close(packet_t *packet, bool crc, bool strict)
{
    NEAR(packet);
    packet->stx = PACKET_STX;
    uint8_t *end;
    uint8_t sum;
    do {
        end = packet->body + packet->length;
        sum = 0;
        for (const uint8_t *byte = strict ? &packet->destination : packet->body; byte != end; byte++) {
            sum = crc8_add(sum, *byte);
        }
        *end = ' '; /* a CRC of 0 would read as none, and a space changes it */
        packet->length++;
    } while (sum == 0 && crc && !strict);
    packet->length--;
    *end++ = PACKET_ETX;
    if (crc || strict) {
        *end++ = sum;
    }
    *end++ = '\0';
    return (uint8_t)(end - &packet->stx);
}
