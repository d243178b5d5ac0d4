#include "host/fakes/terminal_port_fake.h"
#include <assert.h>
#include <string.h>
#include "cli/terminal_port.h"

enum { PLACES = 31 };

static unsigned char typed[100000];
static size_t typed_count, taken_count;
static char sent[200000];
static size_t sent_count;
static size_t unsent; /* of these, how many still stand in the ring */
static int holding;
static int arriving_slowly;

void terminal_port_fake_reset(void)
{
    typed_count = taken_count = sent_count = unsent = 0;
    holding = 0;
    arriving_slowly = 1;
    sent[0] = '\0';
}

void terminal_port_fake_type_byte(unsigned char byte)
{
    assert(typed_count < sizeof typed);
    typed[typed_count++] = byte;
}

void terminal_port_fake_type(const char *text)
{
    while (*text != '\0') {
        terminal_port_fake_type_byte((unsigned char)*text++);
    }
}

size_t terminal_port_fake_untaken(void)
{
    return typed_count - taken_count;
}

void terminal_port_fake_hold(int hold)
{
    holding = hold;
}

void terminal_port_fake_press(int press)
{
    arriving_slowly = !press;
}

void terminal_port_fake_drain(size_t bytes)
{
    unsent = bytes < unsent ? unsent - bytes : 0;
}

const char *terminal_port_fake_text(void)
{
    return sent;
}

unsigned terminal_port_fake_sent(void)
{
    return (unsigned)sent_count;
}

void terminal_port_fake_clear(void)
{
    sent_count = 0;
    sent[0] = '\0';
}

int16_t terminal_port_get(void)
{
    return taken_count == typed_count ? -1 : typed[taken_count++];
}

uint8_t terminal_port_waiting(void)
{
    return arriving_slowly ? 0 : typed_count - taken_count > 111 ? 111 : (uint8_t)(typed_count - taken_count);
}

uint8_t terminal_port_free(void)
{
    return (uint8_t)(PLACES - unsent);
}

void terminal_port_put(uint8_t byte)
{
    assert(unsent < PLACES); /* whoever puts has asked for room */
    assert(sent_count + 1 < sizeof sent);
    if (holding) {
        unsent++;
    }
    sent[sent_count++] = (char)byte;
    sent[sent_count] = '\0';
}

uint8_t terminal_port_peek(uint8_t others)
{
    assert(taken_count == 0 && others < typed_count);
    return typed[others];
}

bool terminal_port_idle(void)
{
    return terminal_port_free() == PLACES;
}
