#include "cli/network.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/timebase_port.h"
#include "base/zeroed.h"
#include "cli/commands.h"
#include "cli/display.h"
#include "cli/range.h"
#include "cli/terminal.h"
#include "cli/terminal_port.h"
#include "cli/text.h"
#include "cli/trial.h"
#include "net/bus.h"
#include "net/bus_port.h"
#include "queue/session.h"
#include "settings.h"

/* Sequence bytes of strict packets: 0x80..0xFF. */
#define SEQUENCE 0x80u

/* The answer to a command, and in strict mode what is remembered of it. */
typedef struct {
    uint8_t origin; /* of the command; 0: nobody */
    uint8_t sequence;
    status_t status;
    uint8_t range; /* of STATUS_RANGE */
} answer_t;

enum { ORIGINS = 4 };
static answer_t answers[ORIGINS]; /* the last one first */
static uint8_t owed;              /* not 0: answers[0] is to be sent */

static uint8_t last_origin;

/* What has been asked. */
static enum { FREE, GREETING, ASKING, FAILED } asked; /* GREETING: a sequence alone; FAILED: that had no answer */
static uint8_t asked_node, asked_sequence;
static uint8_t sequence; /* of the last packet, a soft op's too */
static uint16_t asked_128us;
static uint8_t greeted; /* the node that the last sequence went to */

/* What is still to be shown, in bus_packet or in brief; 0: nothing. */
static const uint8_t *shown;
static bool begun;
static uint8_t brief[2]; /* an answer that is a single byte need not stay in bus_packet */

void network_init(void)
{
    AT_BOOT_ZERO(answers);
    AT_BOOT_ZERO(owed);
    AT_BOOT_ZERO(last_origin);
    AT_BOOT_ZERO(asked);
    AT_BOOT_ZERO(shown);
    AT_BOOT_ZERO(sequence);
    greeted = settings.device_id; /* nobody yet */
    bus_init();
}

uint8_t network_last_origin(void)
{
    return last_origin;
}

/* -- sending ---------------------------------------------------------------------------------------------------------- */

/* The body begins; what follows goes to text_to. */
static NOINLINE void begin_body(uint8_t its_sequence)
{
    text_to = bus_packet.body;
    if (bus_strict()) {
        text_put_byte(its_sequence);
    }
}

static NOINLINE void send(uint8_t destination)
{
    bus_packet.length = (uint8_t)(text_to - bus_packet.body);
    text_to = 0;
    bus_send(destination, session.options & SESSION_CRC);
}

static NOINLINE void begin_next(void)
{
    sequence = (uint8_t)((uint8_t)(sequence + 1u) | SEQUENCE);
    begin_body(sequence);
}

static void send_answer(void)
{
    owed = 0;
    const answer_t *answer = answers;
    begin_body(answer->sequence);
    text_put_byte(answer->status == STATUS_OK ? PACKET_ACK : PACKET_NAK);
    if (bus_strict() && answer->status != STATUS_OK) {
        terminal_put_error(answer->status, answer->range);
    }
    send(answer->origin);
}

status_t network_send(uint8_t destination, const char *text)
{
    if (asked == FAILED) {
        asked = FREE;
        return STATUS_NO_ANSWER;
    }
    if (asked != FREE || owed || shown != 0 || !bus_free(BUS_PACKET_CHARACTERS)) {
        return STATUS_WAIT;
    }
    begin_next();
    status_t status = STATUS_OK;
    uint8_t what = ASKING;
    /* The receiver must not take a command for a repeat: it hears a sequence first, whenever another one was spoken to. */
    if (bus_strict() && destination != greeted) {
        greeted = destination;
        what = GREETING;
        status = STATUS_WAIT;
    } else {
        while (*text != '\0') {
            text_put_byte((uint8_t)*text++);
        }
    }
    if (destination != PACKET_EVERYBODY) {
        asked = what;
        asked_node = destination;
        asked_sequence = sequence;
        asked_128us = timebase_128us();
    }
    send(destination);
    return status;
}

/* -- receiving -------------------------------------------------------------------------------------------------------- */

static void show(const uint8_t *text)
{
    shown = text;
    begun = false;
    terminal_announce();
}

/* An answer to what has been asked. */
static void take_answer(const uint8_t *body, uint8_t its_sequence)
{
    if (bus_packet.origin != asked_node || (bus_strict() && its_sequence != asked_sequence)) {
        return;
    }
    if (asked == ASKING) {
        asked = FREE;
        if (body[1] == '\0') {
            brief[0] = *body;
            body = brief;
        }
        show(body);
    } else if (asked == GREETING) {
        asked = FREE; /* whatever it is: the sequence has been heard */
    }
}

static status_t execute(const uint8_t *body)
{
    if (*body == ' ' || *body == '.') {
        if (display_active() || shown != 0) {
            return STATUS_BUSY;
        }
        if (bus_packet.destination != PACKET_EVERYBODY) {
            last_origin = bus_packet.origin;
        }
        show(body);
        return STATUS_OK;
    }
    if (*body == '\0') {
        return STATUS_OK; /* a sequence alone */
    }
    const uint8_t tried = trial_on();
    status_t status = commands_execute_remote((const char *)body);
    if (status == STATUS_WAIT) {
        status = STATUS_BUSY;
    }
    if (status == STATUS_OK && tried) {
        trial_confirm();
    }
    return status;
}

/* The answer to what this origin has sent, in the first place; a new one unless it was there with this sequence. */
static NOINLINE bool find_answer(uint8_t its_sequence)
{
    answer_t moved = {.origin = bus_packet.origin, .sequence = its_sequence};
    for (answer_t *at = answers; at != answers + ORIGINS; at++) {
        const answer_t old = *at;
        *at = moved;
        moved = old;
        if (old.origin == bus_packet.origin) {
            if (bus_strict() && old.sequence == its_sequence) {
                answers[0] = old;
                return true;
            }
            break;
        }
    }
    return false;
}

static void refuse(void)
{
    bus_counters.good--;
    bus_counters.discarded++;
}

static void receive(void)
{
    const uint8_t *body = bus_packet.body;
    uint8_t its_sequence = 0;
    if (bus_strict()) {
        its_sequence = *body++;
        if (its_sequence < SEQUENCE) {
            refuse();
            return;
        }
    }
    const uint8_t first = *body;
    if (first == PACKET_ACK || first == PACKET_NAK) {
        take_answer(body, its_sequence);
        return;
    }
    if (first == PACKET_DC1 || first == PACKET_DC2) {
        return;
    }
    const bool everybody = bus_packet.destination == PACKET_EVERYBODY;
    if (everybody && first == '$') {
        refuse();
        return;
    }
    if (find_answer(its_sequence)) {
        bus_counters.resent++;
    } else {
        answers[0].status = execute(body);
        answers[0].range = range_refused();
    }
    owed = everybody ? 0 : session.options & SESSION_ACK;
}

static NOINLINE uint8_t attend(void)
{
    if (shown >= bus_packet.body && shown <= bus_packet.body + PACKET_BODY_BYTES) {
        return 0; /* the packet is still needed */
    }
    const packet_event_t event = bus_poll();
    if (event == PACKET_WHOLE) {
        receive();
    } else if (event == PACKET_WRONG && !bus_strict() && bus_packet.destination != PACKET_EVERYBODY) {
        find_answer(0);
        answers[0].status = STATUS_LINE_DAMAGED;
        owed = session.options & SESSION_ACK;
    } else if (owed) {
        if (bus_free(BUS_ANSWER_CHARACTERS)) {
            send_answer();
        }
    } else if ((bus_ops_wait() || commands_restart_due()) && bus_free(BUS_PACKET_CHARACTERS)) {
        if (bus_ops_wait()) {
            begin_next();
            text_put_byte(bus_ops_next());
            send(PACKET_EVERYBODY);
        } else {
            commands_restart();
        }
    }
    if (asked != FREE && asked != FAILED &&
        (uint16_t)(timebase_128us() - asked_128us) > bus_port_characters_128us(NETWORK_ANSWER_CHARACTERS) + NETWORK_ANSWER_128US) {
        greeted = settings.device_id;
        if (asked == ASKING) {
            asked = FREE;
            terminal_report(STATUS_NO_ANSWER);
        } else {
            asked = FAILED; /* the line that waits for it tells */
        }
    }
    const uint8_t at_work = (uint8_t)(event | owed | bus_sending());
    bus_awake = (uint8_t)(at_work | asked | commands_restart_due() | bus_expects());
    return at_work;
}

NOINLINE uint8_t network_poll(void)
{
    /* In standstill a line's end at the terminal must not wait for all that is not to be done here. */
    return bus_awake || bus_port_waiting() ? attend() : 0;
}

/* -- showing ---------------------------------------------------------------------------------------------------------- */

/* As it is, or a control character in hexadecimal. */
static uint8_t put_safe(uint8_t c)
{
    if (c >= ' ' && c < 0x7F) {
        terminal_port_put(c);
        return 1;
    }
    text_put_flash(FLASH_TEXT("\\x"));
    text_put_hex(c);
    return 4;
}

bool network_show(void)
{
    if (shown == 0) {
        return false;
    }
    if (!begun) {
        begun = true;
        switch (*shown) {
        case PACKET_NAK: text_put_flash(FLASH_TEXT("NA")); /* fall through */
        case PACKET_ACK:
            terminal_port_put('K');
            if (*++shown != '\0') {
                terminal_port_put(' ');
            }
            break;
        default:
            text_put_u32(bus_packet.origin);
            terminal_port_put(':');
            text_put_u32(bus_packet.destination);
            terminal_port_put('>');
        }
        return true;
    }
    uint8_t room = TEXT_PIECE_BYTES - 4;
    while (*shown != '\0') {
        const uint8_t count = put_safe(*shown++);
        if (room < 4 + count) {
            return true;
        }
        room = (uint8_t)(room - count);
    }
    text_new_line();
    shown = 0;
    return true;
}
