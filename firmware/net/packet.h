/* Packets of the network: bytes to packets and back.
 *
 *     STX  destination  origin  body ...  ETX  CRC  NUL
 *
 * Read by position, because an address or the CRC may be any value, those of STX, ETX and NUL included. The body holds 1
 * to PACKET_BODY_BYTES bytes, none of these three.
 * As the manual has it, the CRC covers the body and may be missing (NUL follows ETX), so a CRC of 0 cannot be sent: a
 * space is appended to such a body. Strict packets: the CRC covers destination, origin and body and is never missing.
 * CRC: Dallas/Maxim, 8 bits, reflected polynomial 0x8C, initial 0.
 * Context: main loop; pure. Cost: about 120 cycles a byte.
 * Errors:  PACKET_WRONG, PACKET_BROKEN.
 * Tests:   test/host/test_packet.c
 * Source:  manual lines 191-201, 828-830; decisions 0.4 and A-NET-02 to A-NET-06; docs/wire-format.md. */
#ifndef NET_PACKET_H
#define NET_PACKET_H

#include <stdint.h>

/* A line of 64 characters without the one of its address, a sequence byte, a space for the CRC's sake. */
#define PACKET_BODY_BYTES 65
#define PACKET_EVERYBODY 0 /* the address of a broadcast */

enum { PACKET_STX = 2, PACKET_ETX = 3, PACKET_ACK = 6, PACKET_DC1 = 0x11, PACKET_DC2 = 0x12, PACKET_NAK = 0x15 };

typedef struct {
    uint8_t expected; /* what comes next: packet.c */
    uint8_t length;   /* of the body */
    uint8_t crc;      /* so far */
    uint8_t stx;      /* from here on as they go over the line */
    uint8_t destination;
    uint8_t origin;
    uint8_t body[PACKET_BODY_BYTES + 3]; /* a NUL behind it; ETX, CRC and NUL when it is sent */
} packet_t;

typedef enum {
    PACKET_NONE,   /* still under way, or for another node */
    PACKET_WHOLE,  /* for this node, and not known to be wrong */
    PACKET_WRONG,  /* the CRC differs; destination and origin may be wrong too */
    PACKET_BROKEN, /* it begins anew, is too long or too short, or does not end as it should */
} packet_event_t;

/* Of a packet for another node than `own` and everybody nothing is kept, and its end is PACKET_NONE. */
packet_event_t packet_take(packet_t *packet, uint8_t byte, uint8_t own, uint8_t strict);

/* Nothing has come for so long that nothing will. An ACK or NAK of the short form (STX destination origin ACK) is whole
 * by that. */
packet_event_t packet_end(packet_t *packet, uint8_t own, uint8_t strict);

uint8_t packet_under_way(const packet_t *packet);

/* Body and length are set, addresses too: header and footer are added. Returns how many bytes are to be sent, from
 * packet->stx on. */
uint8_t packet_close(packet_t *packet, uint8_t crc, uint8_t strict);

#endif
