/* net/packet: bytes to packets and back, and how many damaged packets get through. In the environment SAC_PACKETS sets how
 * many packets are damaged in all ways (make test-packet-long: 200), SAC_FRAMES how many frames and fragments are heard
 * (make fuzz-packet-long: 10^9), SAC_FRAMES_SEED which. */
#include "net/packet.h"
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "splitmix64.h"
#include "unity.h"

enum { OWN = 85, OTHER = 10, MOST_BYTES = PACKET_BODY_BYTES + 6 };

static packet_t packet;

void setUp(void)
{
    memset(&packet, 0, sizeof packet);
}

void tearDown(void) {}

/* The last event that was not PACKET_NONE; *events: how many there were. */
static packet_event_t take(const void *bytes, size_t count, bool strict, unsigned *events)
{
    packet_event_t last = PACKET_NONE;
    *events = 0;
    for (size_t i = 0; i < count; i++) {
        const packet_event_t event = packet_take(&packet, ((const uint8_t *)bytes)[i], OWN, strict);
        if (event != PACKET_NONE) {
            last = event;
            ++*events;
        }
    }
    return last;
}

/* A string literal of bytes, where a NUL is one of them. */
#define ASSERT_EVENT(expected, bytes, strict)                                                            \
    do {                                                                                                 \
        unsigned its_events;                                                                             \
        TEST_ASSERT_EQUAL((expected), take((bytes), sizeof(bytes) - 1, (strict), &its_events));          \
        TEST_ASSERT_EQUAL_UINT((expected) != PACKET_NONE, its_events);                                   \
    } while (0)

/* Puts a packet together; returns how many bytes it has. */
static uint8_t close_packet(packet_t *made, uint8_t destination, uint8_t origin, const char *body, bool crc, bool strict)
{
    memset(made, 0, sizeof *made);
    made->destination = destination;
    made->origin = origin;
    made->length = (uint8_t)strlen(body);
    memcpy(made->body, body, made->length);
    return packet_close(made, crc, strict);
}

/* Independent of the firmware's: bit by bit, the polynomial x^8 + x^5 + x^4 + 1, least significant bit first. */
static uint8_t reference_crc(const uint8_t *bytes, size_t count)
{
    unsigned crc = 0;
    for (size_t bit = 0; bit < 8 * count; bit++) {
        const unsigned in = (unsigned)bytes[bit / 8] >> bit % 8 & 1u;
        const unsigned feedback = (crc & 1u) ^ in;
        crc >>= 1;
        if (feedback) {
            crc = crc ^ (1u << 7 | 1u << 3 | 1u << 2);
        }
    }
    return (uint8_t)crc;
}

/* NET-007, NET-025: the vectors of the requirements, annex C. */
static void test_the_crc_is_that_of_the_vectors(void)
{
    static const struct {
        const char *body;
        uint8_t crc;
    } vectors[] = {{"m3000a2d1", 0xA7}, {" hello", 0xA5}, {".hello", 0xB6}, {"y", 0x64},         {"S", 0x39},    {"\x06", 0xDD},
                   {"\x15", 0xA2},      {"\x11", 0xC3},   {"\x12", 0x21},   {"123456789", 0xA1}, {"m132", 0x02}, {"m229", 0x02},
                   {"m566", 0x02},      {"m349", 0x03},   {"m406", 0x03},   {"m580", 0x03}};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        packet_t made;
        const char *body = vectors[i].body;
        const size_t length = strlen(body);
        TEST_ASSERT_EQUAL_UINT8(length + 6, close_packet(&made, OWN, OTHER, body, true, false));
        TEST_ASSERT_EQUAL_HEX8_MESSAGE(vectors[i].crc, made.body[length + 1], body);
        TEST_ASSERT_EQUAL_HEX8(vectors[i].crc, reference_crc((const uint8_t *)body, length));
    }
}

/* NET-007, NET-009, NET-025, NET-029 */
static void test_a_packet_is_sent_byte_by_byte_as_the_manual_has_it(void)
{
    packet_t made;
    TEST_ASSERT_EQUAL_UINT8(15, close_packet(&made, 85, 10, "m3000a2d1", true, false));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x02\x55\x0A\x6D\x33\x30\x30\x30\x61\x32\x64\x31\x03\xA7\x00", &made.stx, 15);
    TEST_ASSERT_EQUAL_UINT8(14, close_packet(&made, 85, 10, "m3000a2d1", false, false));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x02\x55\x0A\x6D\x33\x30\x30\x30\x61\x32\x64\x31\x03\x00", &made.stx, 14);
}

/* Decisions 0.4.2: over destination, origin and body, and never missing. */
static void test_the_crc_of_a_strict_packet_covers_the_addresses(void)
{
    packet_t made;
    for (unsigned crc = 0; crc < 2; crc++) {
        TEST_ASSERT_EQUAL_UINT8(11, close_packet(&made, 85, 10, "\x81m200", crc, true));
        TEST_ASSERT_EQUAL_HEX8(reference_crc(&made.destination, 7), made.body[6]);
        TEST_ASSERT_EQUAL_HEX8(0, made.body[7]);
    }
}

/* Decisions 0.4.1: the receiver would read it as no CRC. */
static void test_a_crc_of_0_is_never_sent(void)
{
    static const char *const bodies[] = {"m13", "m274", "m620"};
    packet_t made;
    for (size_t i = 0; i < 3; i++) {
        const uint8_t length = (uint8_t)strlen(bodies[i]);
        TEST_ASSERT_EQUAL_HEX8(0, reference_crc((const uint8_t *)bodies[i], length));
        TEST_ASSERT_EQUAL_UINT8(length + 7, close_packet(&made, OWN, OTHER, bodies[i], true, false));
        TEST_ASSERT_EQUAL_HEX8(' ', made.body[length]);
        TEST_ASSERT_EQUAL_HEX8(3, made.body[length + 1]);
        TEST_ASSERT_EQUAL_HEX8(reference_crc(made.body, length + 1u), made.body[length + 2]);
        /* Without a CRC nothing is added. */
        TEST_ASSERT_EQUAL_UINT8(length + 5, close_packet(&made, OWN, OTHER, bodies[i], false, false));
    }
    char body[12];
    for (unsigned count = 0; count < 20000; count++) {
        snprintf(body, sizeof body, "m%u", count);
        const uint8_t bytes = close_packet(&made, OWN, OTHER, body, true, false);
        TEST_ASSERT_NOT_EQUAL_MESSAGE(0, (&made.stx)[bytes - 2], body);
    }
    /* A strict one has it as it comes. */
    unsigned zeros = 0;
    for (unsigned count = 0; count < 20000; count++) {
        snprintf(body, sizeof body, "\x81m%u", count);
        const uint8_t bytes = close_packet(&made, OWN, OTHER, body, true, true);
        TEST_ASSERT_EQUAL_UINT8(strlen(body) + 6, bytes);
        if ((&made.stx)[bytes - 2] == 0) {
            zeros++;
            unsigned events;
            TEST_ASSERT_EQUAL(PACKET_WHOLE, take(&made.stx, bytes, true, &events));
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, zeros);
}

/* NET-007: what is sent is read again, whatever the addresses; the body has a NUL behind it. */
static void test_what_is_sent_is_read_by_position(void)
{
    static const char *const bodies[] = {"m132", "m229", "m349", "m13", "m200", "y", " hello", "\x06"};
    unsigned events;
    for (unsigned strict = 0; strict < 2; strict++) {
        for (unsigned crc = 0; crc < 2; crc++) {
            for (unsigned origin = 0; origin < 256; origin++) {
                packet_t made;
                const char *body = bodies[origin % 8];
                const unsigned destinations[] = {OWN, PACKET_EVERYBODY};
                const uint8_t destination = (uint8_t)destinations[origin & 1];
                const uint8_t bytes = close_packet(&made, destination, (uint8_t)origin, body, crc, strict);
                TEST_ASSERT_EQUAL(PACKET_WHOLE, take(&made.stx, bytes, strict, &events));
                TEST_ASSERT_EQUAL_UINT(1, events);
                TEST_ASSERT_EQUAL_UINT8(destination, packet.destination);
                TEST_ASSERT_EQUAL_UINT8(origin, packet.origin);
                TEST_ASSERT_EQUAL_STRING_LEN(body, packet.body, strlen(body));
                TEST_ASSERT_EQUAL_UINT8('\0', packet.body[packet.length]);
                TEST_ASSERT_FALSE(packet_under_way(&packet));
            }
        }
    }
}

/* NET-029: the addresses 2, 3 and 0 of other nodes are no STX, no ETX and no NUL. */
static void test_addresses_like_control_characters_are_addresses(void)
{
    for (unsigned own = 1; own < 256; own++) {
        packet_t made;
        const uint8_t bytes = close_packet(&made, (uint8_t)own, 2, "m349", true, false);
        packet_event_t event = PACKET_NONE;
        for (uint8_t i = 0; i < bytes; i++) {
            TEST_ASSERT_EQUAL(PACKET_NONE, event);
            event = packet_take(&packet, (&made.stx)[i], (uint8_t)own, false);
        }
        TEST_ASSERT_EQUAL(PACKET_WHOLE, event);
    }
    ASSERT_EVENT(PACKET_NONE, "\x02\x02\x03y\x03\x64\x00", false);
    ASSERT_EVENT(PACKET_WHOLE, "\x02\x55\x02y\x03\x64\x00", false);
    ASSERT_EVENT(PACKET_WHOLE, "\x02\x55\x03y\x03\x64\x00", false);
    ASSERT_EVENT(PACKET_WHOLE, "\x02\x55\x00y\x03\x64\x00", false);
}

/* NET-022, NET-032 */
static void test_a_packet_without_a_crc_is_whole_but_not_a_strict_one(void)
{
    ASSERT_EVENT(PACKET_WHOLE, "\x02\x55\x0Am200\x03\x00", false);
    TEST_ASSERT_EQUAL_STRING("m200", packet.body);
    ASSERT_EVENT(PACKET_NONE, "\x02\x55\x0A\x81m200\x03\x00", true); /* a CRC of 0, if it is one: the NUL is to come */
    TEST_ASSERT_TRUE(packet_under_way(&packet));
    TEST_ASSERT_EQUAL(PACKET_BROKEN, packet_end(&packet, OWN, true));
}

/* NET-021 */
static void test_a_wrong_crc_is_wrong(void)
{
    for (unsigned crc = 1; crc < 256; crc++) {
        uint8_t bytes[] = {2, OWN, OTHER, 'y', 3, (uint8_t)crc, 0};
        unsigned events;
        TEST_ASSERT_EQUAL(crc == 0x64 ? PACKET_WHOLE : PACKET_WRONG, take(bytes, sizeof bytes, false, &events));
        TEST_ASSERT_EQUAL_UINT(1, events);
    }
}

/* NET-033 */
static void test_an_stx_in_a_body_begins_anew(void)
{
    unsigned events;
    static const char bytes[] = "\x02\x55\x0Am20\x02\x55\x0Ay\x03\x64\x00";
    TEST_ASSERT_EQUAL(PACKET_WHOLE, take(bytes, sizeof bytes - 1, false, &events));
    TEST_ASSERT_EQUAL_UINT(2, events); /* the first one was broken */
    TEST_ASSERT_EQUAL_STRING("y", packet.body);
    /* In place of the NUL too. */
    static const char more[] = "\x02\x55\x0Ay\x03\x64\x02\x55\x0AS\x03\x39\x00";
    TEST_ASSERT_EQUAL(PACKET_WHOLE, take(more, sizeof more - 1, false, &events));
    TEST_ASSERT_EQUAL_UINT(2, events);
    TEST_ASSERT_EQUAL_STRING("S", packet.body);
    /* Broken silently, where it was for another node. */
    static const char other[] = "\x02\x56\x0Am20\x02\x55\x0Ay\x03\x64\x00";
    TEST_ASSERT_EQUAL(PACKET_WHOLE, take(other, sizeof other - 1, false, &events));
    TEST_ASSERT_EQUAL_UINT(1, events);
}

/* NET-033: the packet is given up, and what is left of it read over. */
static void test_a_nul_in_a_body_ends_it_broken(void)
{
    unsigned events;
    static const char bytes[] = "\x02\x55\x0Am2\x00 0\x03\xA7\x00";
    TEST_ASSERT_EQUAL(PACKET_BROKEN, take(bytes, sizeof bytes - 1, false, &events));
    TEST_ASSERT_EQUAL_UINT(1, events);
    TEST_ASSERT_FALSE(packet_under_way(&packet));
    ASSERT_EVENT(PACKET_WHOLE, "\x02\x55\x0Ay\x03\x64\x00", false);
}

static void test_a_packet_with_nothing_in_it_or_without_its_end_is_broken(void)
{
    ASSERT_EVENT(PACKET_BROKEN, "\x02\x55\x0A\x03\x00", false);
    ASSERT_EVENT(PACKET_BROKEN, "\x02\x55\x0A\x03\x00\x00", true);
    ASSERT_EVENT(PACKET_BROKEN, "\x02\x55\x0Ay\x03\x64x", false);
    TEST_ASSERT_FALSE(packet_under_way(&packet));
}

static void test_a_body_that_is_too_long_is_broken_and_the_longest_is_not(void)
{
    for (unsigned length = PACKET_BODY_BYTES - 1; length <= 300; length++) {
        uint8_t bytes[310] = {2, OWN, OTHER};
        memset(bytes + 3, 'm', length);
        bytes[3 + length] = 3;
        bytes[4 + length] = reference_crc(bytes + 3, length);
        unsigned events;
        const packet_event_t event = take(bytes, length + 6, false, &events);
        TEST_ASSERT_EQUAL(length <= PACKET_BODY_BYTES ? PACKET_WHOLE : PACKET_BROKEN, event);
        TEST_ASSERT_EQUAL_UINT(1, events);
    }
}

/* NET-012: of a packet for another node nothing is kept, whatever becomes of it. */
static void test_packets_for_other_nodes_leave_the_body_as_it_is(void)
{
    ASSERT_EVENT(PACKET_WHOLE, "\x02\x55\x0A hello\x03\xA5\x00", false);
    uint8_t body[sizeof packet.body];
    memcpy(body, packet.body, sizeof body);
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0Am3000a2d1\x03\xA7\x00", false);
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0Am3000a2d1\x03\xA6\x00", false);
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0Am3000a2d1\x03\x00", false);
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0Am3\x00", false);
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0A\x03\x00", false);
    for (unsigned i = 0; i < 300; i++) {
        ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0Axxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx\x03", false);
    }
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0Am3", false);
    TEST_ASSERT_EQUAL(PACKET_NONE, packet_end(&packet, OWN, false));
    TEST_ASSERT_EQUAL_MEMORY(body, packet.body, sizeof body);
}

/* NET-031: what is no packet is nothing. */
static void test_text_outside_of_packets_is_ignored(void)
{
    ASSERT_EVENT(PACKET_NONE, "m200\r\nSAC>\x03\x64\x00\x06\x15\xFF", false);
    TEST_ASSERT_FALSE(packet_under_way(&packet));
    TEST_ASSERT_EQUAL(PACKET_NONE, packet_end(&packet, OWN, false));
}

/* A-NET-06, A-NET-14 */
static void test_silence_ends_a_packet_and_a_short_answer_is_whole_by_it(void)
{
    static const char bytes[] = "\x02\x55\x0Am3\x03\xA7";
    for (size_t count = 1; count < sizeof bytes; count++) {
        unsigned events;
        TEST_ASSERT_EQUAL(PACKET_NONE, take(bytes, count, false, &events));
        TEST_ASSERT_TRUE(packet_under_way(&packet));
        TEST_ASSERT_EQUAL(count < 3 ? PACKET_NONE : PACKET_BROKEN, packet_end(&packet, OWN, false));
        TEST_ASSERT_FALSE(packet_under_way(&packet));
    }
    static const char *const answers[] = {"\x02\x55\x0A\x06", "\x02\x55\x0A\x15"};
    for (size_t i = 0; i < 2; i++) {
        for (unsigned strict = 0; strict < 2; strict++) {
            unsigned events;
            (void)take(answers[i], 4, strict, &events);
            TEST_ASSERT_EQUAL(strict ? PACKET_BROKEN : PACKET_WHOLE, packet_end(&packet, OWN, (uint8_t)strict));
        }
        TEST_ASSERT_EQUAL_UINT8('\0', packet.body[1]);
    }
    ASSERT_EVENT(PACKET_NONE, "\x02\x55\x0A\x06x", false);
    TEST_ASSERT_EQUAL(PACKET_BROKEN, packet_end(&packet, OWN, false));
    ASSERT_EVENT(PACKET_NONE, "\x02\x56\x0A\x06", false);
    TEST_ASSERT_EQUAL(PACKET_NONE, packet_end(&packet, OWN, false));
}

/* -- errors on the line ------------------------------------------------------------------------------------------------ */

static uint64_t state;

static uint32_t random_u32(void)
{
    return (uint32_t)(splitmix64(&state) >> 32);
}

static uint32_t below(uint32_t limit)
{
    return (uint32_t)((uint64_t)random_u32() * limit >> 32);
}

typedef struct {
    uint64_t made, accepted, foreign; /* accepted by this node; if not, by the one whose address it has got */
} tally_t;

/* Two wrong bits so far apart look right to this polynomial. */
enum { PERIOD = 127 };
static uint64_t far_apart; /* of those accepted */

enum { SINGLE, DOUBLE, TRIPLE, BURST, KINDS };
static const char *const kinds[KINDS] = {"1 bit", "2 bits", "3 bits", "bursts to 8 bits"};

static uint8_t damaged[MOST_BYTES];
static uint8_t damaged_bytes;

static void flip(unsigned bit)
{
    damaged[bit / 8] ^= (uint8_t)(1u << bit % 8);
}

/* Every node listens: whether one of them takes it for a packet of its own. */
static void judge(tally_t *tally, bool strict)
{
    tally->made++;
    packet.expected = 0;
    const uint8_t heard = damaged[1]; /* the address, where the packet still begins at its first byte */
    for (uint8_t i = 0; i < damaged_bytes; i++) {
        if (packet_take(&packet, damaged[i], OWN, strict) == PACKET_WHOLE) {
            tally->accepted++;
            return;
        }
    }
    if (heard == OWN) {
        return;
    }
    packet.expected = 0;
    for (uint8_t i = 0; i < damaged_bytes; i++) {
        if (packet_take(&packet, damaged[i], heard, strict) == PACKET_WHOLE) {
            tally->foreign++;
            return;
        }
    }
}

/* All errors of these kinds in one packet: bits 0.. of the bytes STX to NUL. (Start and stop bits are the port's.) */
static void damage(tally_t tallies[KINDS], bool strict, bool three_bits)
{
    const unsigned bits = 8u * damaged_bytes;
    for (unsigned a = 0; a < bits; a++) {
        flip(a);
        judge(&tallies[SINGLE], strict);
        for (unsigned b = a + 1; b < bits; b++) {
            flip(b);
            const uint64_t accepted = tallies[DOUBLE].accepted + tallies[DOUBLE].foreign;
            judge(&tallies[DOUBLE], strict);
            const unsigned apart = b / 8 == damaged_bytes - 2u ? b - a - 8 : b - a; /* the ETX before the CRC apart */
            if (apart % PERIOD == 0) {
                far_apart += tallies[DOUBLE].accepted + tallies[DOUBLE].foreign - accepted;
            }
            for (unsigned c = b + 1; three_bits && c < bits; c++) {
                flip(c);
                judge(&tallies[TRIPLE], strict);
                flip(c);
            }
            flip(b);
        }
        flip(a);
        /* Bursts that begin here and are 3 to 8 bits long: both ends, and any bits between them. */
        for (unsigned length = 3; length <= 8 && a + length <= bits; length++) {
            for (unsigned inner = 0; inner < 1u << (length - 2); inner++) {
                const unsigned burst = 1u | inner << 1 | 1u << (length - 1);
                for (unsigned pass = 0; pass < 2; pass++) {
                    for (unsigned i = 0; i < length; i++) {
                        if (burst >> i & 1u) {
                            flip(a + i);
                        }
                    }
                    if (pass == 0) {
                        judge(&tallies[BURST], strict);
                    }
                }
            }
        }
    }
}

/* Packets as they are sent: commands, their bodies of 1 to 40 bytes of text. */
static void damage_packets(tally_t tallies[KINDS], bool strict)
{
    const char *text = getenv("SAC_PACKETS");
    const unsigned packets = text != NULL ? (unsigned)strtoul(text, NULL, 10) : 20;
    const unsigned three_bits = text != NULL ? UINT32_MAX : 8; /* in bodies up to here: there are many */
    memset(tallies, 0, KINDS * sizeof *tallies);
    far_apart = 0;
    state = 1;
    for (unsigned i = 0; i < packets; i++) {
        char body[42] = "";
        const unsigned length = packets < 40 ? 1 + 39 * i / (packets - 1) : 1 + i % 40;
        for (unsigned j = 0; j < length; j++) {
            body[j] = (char)(' ' + below(0x5F));
        }
        if (strict) {
            body[0] = (char)(0x80 + below(0x80));
        }
        packet_t made;
        damaged_bytes = close_packet(&made, OWN, (uint8_t)(4 + below(252)), body, true, strict);
        memcpy(damaged, &made.stx, damaged_bytes);
        damage(tallies, strict, length <= three_bits);
    }
}

static void tell(const tally_t tallies[KINDS], const char *name)
{
    for (unsigned kind = 0; kind < KINDS; kind++) {
        const tally_t *t = &tallies[kind];
        printf("%s packets, %s: %" PRIu64 " of %" PRIu64 " damaged ones accepted (%.4f %%), %" PRIu64
               " more by a node of another address\n",
               name, kinds[kind], t->accepted, t->made, 100.0 * (double)t->accepted / (double)t->made, t->foreign);
    }
    printf("%s packets, 2 bits: %" PRIu64 " of all accepted were %d bits apart, or a multiple\n", name, far_apart, (int)PERIOD);
}

/* Decisions 0.4.2, NET-021: as a wrong address, a wrong command or both, for this node or another. What the CRC cannot see
 * are two wrong bits PERIOD apart, in packets longer than that. */
static void test_of_damaged_strict_packets_none_is_accepted_but_of_two_bits_127_apart(void)
{
    tally_t tallies[KINDS];
    damage_packets(tallies, true);
    tell(tallies, "strict");
    for (unsigned kind = 0; kind < KINDS; kind++) {
        const uint64_t seen = kind == DOUBLE ? far_apart : 0;
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(seen, tallies[kind].accepted + tallies[kind].foreign, kinds[kind]);
    }
}

/* The manual's: addresses are not covered and a CRC of 0 is none, so some get through; no wrong body by one bit does, but
 * by the byte behind it. */
static void test_of_damaged_packets_as_the_manual_has_them_some_are_accepted(void)
{
    tally_t tallies[KINDS];
    damage_packets(tallies, false);
    tell(tallies, "manual");
    TEST_ASSERT_GREATER_THAN_UINT64(0, tallies[SINGLE].accepted + tallies[SINGLE].foreign);
}

/* -- anything at all ------------------------------------------------------------------------------------------------------ */

/* Ten million pieces: bytes, headers, whole packets, silence; the sanitizers watch. */
static void test_no_bytes_whatever_leave_the_buffer_or_stop_the_next_packet(void)
{
    enum { PIECES = 10000000 };
    static const uint8_t likely[] = {0, 2, 3, 6, 0x15, OWN, OTHER, 'm', ' '};
    struct {
        packet_t packet;
        uint8_t behind[8];
    } guarded;
    memset(&guarded, 0, sizeof guarded);
    memset(guarded.behind, 0xA5, sizeof guarded.behind);
    packet_t *p = &guarded.packet;
    uint64_t events[PACKET_BROKEN + 1] = {0};
    state = 2;
    bool strict = false;
    for (uint32_t i = 0; i < PIECES; i++) {
        const uint32_t r = random_u32();
        packet_event_t event = PACKET_NONE;
        if ((r & 0x3FF) == 0) { /* a whole packet, after a silence */
            strict = r >> 12 & 1u;
            (void)packet_end(p, OWN, strict);
            packet_t made;
            const uint8_t bytes = close_packet(&made, OWN, OTHER, "\x81m200", true, strict);
            for (uint8_t j = 0; j < bytes; j++) {
                event = packet_take(p, (&made.stx)[j], OWN, strict);
            }
            TEST_ASSERT_EQUAL(PACKET_WHOLE, event);
            TEST_ASSERT_EQUAL_STRING("\x81m200", p->body);
        } else if ((r & 0xFFF) < 8) {
            event = packet_end(p, OWN, strict);
        } else if ((r & 0xFFF) < 200) { /* the header of one for this node, or everybody */
            (void)packet_end(p, OWN, strict);
            (void)packet_take(p, PACKET_STX, OWN, strict);
            (void)packet_take(p, r >> 12 & 1 ? OWN : PACKET_EVERYBODY, OWN, strict);
            event = packet_take(p, OTHER, OWN, strict);
        } else {
            const unsigned kind = r >> 12 & 15;
            const uint8_t byte = kind < 6 ? likely[below(sizeof likely)] : (uint8_t)(r >> 24);
            event = packet_take(p, byte, OWN, strict);
        }
        events[event]++;
        if (event == PACKET_WHOLE || event == PACKET_WRONG) {
            TEST_ASSERT_TRUE(p->length >= 1 && p->length <= PACKET_BODY_BYTES);
            TEST_ASSERT_EQUAL_size_t(p->length, strlen((const char *)p->body));
            TEST_ASSERT_NULL(memchr(p->body, PACKET_STX, p->length));
            TEST_ASSERT_NULL(memchr(p->body, PACKET_ETX, p->length));
        }
        TEST_ASSERT_TRUE(event == PACKET_NONE || p->expected <= 1); /* nothing, or the next one's destination */
    }
    for (size_t i = 0; i < sizeof guarded.behind; i++) {
        TEST_ASSERT_EQUAL_HEX8(0xA5, guarded.behind[i]);
    }
    printf("%d pieces: %" PRIu64 " packets whole, %" PRIu64 " wrong, %" PRIu64 " broken\n", (int)PIECES, events[PACKET_WHOLE],
           events[PACKET_WRONG], events[PACKET_BROKEN]);
    TEST_ASSERT_GREATER_THAN_UINT64(10000, events[PACKET_WHOLE]);
    TEST_ASSERT_GREATER_THAN_UINT64(1000, events[PACKET_WRONG]);
    TEST_ASSERT_GREATER_THAN_UINT64(10000, events[PACKET_BROKEN]);
}

/* -- frames and fragments ------------------------------------------------------------------------------------------------- */

/* The reference, a byte at a time. */
static uint8_t crc_table[256];

static uint8_t table_crc(const uint8_t *bytes, size_t count)
{
    uint8_t crc = 0;
    while (count-- > 0) {
        crc = crc_table[crc ^ *bytes++];
    }
    return crc;
}

/* What the decoder has been given, so that each of its words can be checked against it. */
enum { HEARD_BYTES = 4096 };
static uint8_t heard[HEARD_BYTES];
static size_t heard_count;

/* Whether the last bytes on the line are this packet, from its STX on. */
static bool was_heard(const packet_t *p, bool strict, bool right)
{
    for (unsigned with_crc = strict ? 1 : 0; with_crc < 2; with_crc++) {
        const size_t bytes = p->length + 5u + with_crc;
        if (bytes > heard_count) {
            continue;
        }
        const uint8_t *at = heard + heard_count - bytes;
        const bool frame = at[0] == PACKET_STX && at[1] == p->destination && at[2] == p->origin &&
                           memcmp(at + 3, p->body, p->length) == 0 && at[3 + p->length] == PACKET_ETX && at[bytes - 1] == '\0';
        const uint8_t sum = strict ? table_crc(at + 1, p->length + 2u) : table_crc(at + 3, p->length);
        if (frame && (with_crc ? (at[bytes - 2] == sum) == right : right)) {
            return true;
        }
    }
    return false;
}

typedef struct {
    packet_t packet;
    uint8_t behind[8];
} guarded_t;

static packet_event_t hear(packet_t *p, uint8_t byte, bool strict)
{
    if (heard_count == HEARD_BYTES) {
        memcpy(heard, heard + HEARD_BYTES - 128, 128);
        heard_count = 128;
    }
    heard[heard_count++] = byte;
    const packet_event_t event = packet_take(p, byte, OWN, strict);
    if (event == PACKET_WHOLE || event == PACKET_WRONG) {
        TEST_ASSERT_TRUE(p->length >= 1 && p->length <= PACKET_BODY_BYTES && p->body[p->length] == '\0');
        TEST_ASSERT_TRUE(p->destination == OWN || p->destination == PACKET_EVERYBODY);
        TEST_ASSERT_TRUE(was_heard(p, strict, event == PACKET_WHOLE));
    }
    return event;
}

/* A frame with an address of this node, of everybody or another one; most bodies are short. Returns its length. */
static size_t make_frame(uint8_t *frame, bool strict, bool crc, bool *mine)
{
    const uint32_t r = random_u32();
    const unsigned length = 1 + ((r & 15) == 0 ? below(PACKET_BODY_BYTES) : below(12));
    *mine = (r >> 4 & 3) != 0;
    frame[0] = PACKET_STX;
    frame[1] = *mine ? (r >> 4 & 3) == 3 ? PACKET_EVERYBODY : OWN : (uint8_t)(r >> 8);
    *mine = frame[1] == OWN || frame[1] == PACKET_EVERYBODY;
    frame[2] = (uint8_t)(r >> 16);
    for (unsigned i = 0; i < length; i += 4) {
        const uint32_t bytes = random_u32();
        for (unsigned j = 0; j < 4 && i + j < length; j++) {
            const uint8_t byte = (uint8_t)(bytes >> 8 * j);
            frame[3 + i + j] = byte <= PACKET_ETX ? 'm' : byte;
        }
    }
    size_t count = 3 + length;
    const uint8_t sum = strict ? table_crc(frame + 1, count - 1) : table_crc(frame + 3, length);
    frame[count++] = PACKET_ETX;
    if (strict || (crc && sum != 0)) {
        frame[count++] = sum;
    }
    frame[count++] = '\0';
    return count;
}

/* The decoder says WHOLE or WRONG for what was on the line and only for that, and WHOLE for each undamaged frame that
 * begins while it expects none. The sanitizers watch. */
static void test_frames_and_fragments_are_taken_for_what_they_are(void)
{
    const char *text = getenv("SAC_FRAMES");
    const uint64_t frames = text != NULL ? strtoull(text, NULL, 10) : 500000;
    const char *seed = getenv("SAC_FRAMES_SEED");
    state = seed != NULL ? strtoull(seed, NULL, 10) : 3;
    for (unsigned i = 0; i < 256; i++) {
        const uint8_t byte = (uint8_t)i;
        crc_table[i] = reference_crc(&byte, 1);
    }
    guarded_t guarded;
    memset(&guarded, 0, sizeof guarded);
    memset(guarded.behind, 0xA5, sizeof guarded.behind);
    packet_t *p = &guarded.packet;
    heard_count = 0;
    uint64_t events[PACKET_BROKEN + 1] = {0}, undamaged = 0;
    bool strict = false;
    for (uint64_t i = 0; i < frames; i++) {
        uint8_t frame[PACKET_BODY_BYTES + 6];
        bool mine;
        if ((i & 0xFFFF) == 0) {
            strict = i >> 16 & 1;
            (void)packet_end(p, OWN, strict);
            if (i % 100000000 < 0x10000 && i != 0) {
                printf("%" PRIu64 " frames so far\n", i);
                fflush(stdout);
            }
        }
        const uint32_t r = random_u32();
        const size_t count = make_frame(frame, strict, (r & 1) != 0, &mine);
        if ((r >> 1 & 3) == 0) {
            events[packet_end(p, OWN, strict)]++; /* a silence in front of it */
            heard_count = 0;
        }
        const bool idle = !packet_under_way(p);
        size_t from = 0, to = count;
        bool damage_it = true;
        switch (r >> 3 & 7) {
        case 0: from = 1 + below((uint32_t)count - 1); break; /* its end */
        case 1: to = 1 + below((uint32_t)count - 1); break;   /* its beginning */
        case 2: frame[below((uint32_t)count)] ^= (uint8_t)(1u << (r >> 8 & 7)); break;
        case 3: frame[below((uint32_t)count)] = (uint8_t)(r >> 8 & 1 ? r >> 16 & 3 : r >> 16); break;
        default: damage_it = false;
        }
        packet_event_t last = PACKET_NONE;
        for (size_t at = from; at < to; at++) {
            last = hear(p, frame[at], strict);
            events[last]++;
        }
        if (!damage_it && idle) {
            TEST_ASSERT_EQUAL(mine ? PACKET_WHOLE : PACKET_NONE, last);
            undamaged++;
        }
    }
    for (size_t i = 0; i < sizeof guarded.behind; i++) {
        TEST_ASSERT_EQUAL_HEX8(0xA5, guarded.behind[i]);
    }
    printf("%" PRIu64 " frames and fragments, %" PRIu64 " of them undamaged and in order: %" PRIu64 " packets whole, %" PRIu64
           " wrong, %" PRIu64 " broken\n",
           frames, undamaged, events[PACKET_WHOLE], events[PACKET_WRONG], events[PACKET_BROKEN]);
    TEST_ASSERT_GREATER_THAN_UINT64(frames / 4, events[PACKET_WHOLE]);
    TEST_ASSERT_GREATER_THAN_UINT64(frames / 100, events[PACKET_WRONG]);
    TEST_ASSERT_GREATER_THAN_UINT64(frames / 100, events[PACKET_BROKEN]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_crc_is_that_of_the_vectors);
    RUN_TEST(test_a_packet_is_sent_byte_by_byte_as_the_manual_has_it);
    RUN_TEST(test_the_crc_of_a_strict_packet_covers_the_addresses);
    RUN_TEST(test_a_crc_of_0_is_never_sent);
    RUN_TEST(test_what_is_sent_is_read_by_position);
    RUN_TEST(test_addresses_like_control_characters_are_addresses);
    RUN_TEST(test_a_packet_without_a_crc_is_whole_but_not_a_strict_one);
    RUN_TEST(test_a_wrong_crc_is_wrong);
    RUN_TEST(test_an_stx_in_a_body_begins_anew);
    RUN_TEST(test_a_nul_in_a_body_ends_it_broken);
    RUN_TEST(test_a_packet_with_nothing_in_it_or_without_its_end_is_broken);
    RUN_TEST(test_a_body_that_is_too_long_is_broken_and_the_longest_is_not);
    RUN_TEST(test_packets_for_other_nodes_leave_the_body_as_it_is);
    RUN_TEST(test_text_outside_of_packets_is_ignored);
    RUN_TEST(test_silence_ends_a_packet_and_a_short_answer_is_whole_by_it);
    RUN_TEST(test_of_damaged_strict_packets_none_is_accepted_but_of_two_bits_127_apart);
    RUN_TEST(test_of_damaged_packets_as_the_manual_has_them_some_are_accepted);
    RUN_TEST(test_no_bytes_whatever_leave_the_buffer_or_stop_the_next_packet);
    RUN_TEST(test_frames_and_fragments_are_taken_for_what_they_are);
    return UNITY_END();
}
