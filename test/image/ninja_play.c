/* See ninja_play.h. */
#include "ninja_play.h"

#include <string.h>

#define SLICE (20 * MS)
#define MOST_BYTES 65536
#define AT_REST (2 * NINJA_LATENCY) /* nothing is going to begin any more */

ninja_model_t play_model;

static struct {
    uint64_t cycle; /* when the receiver has it: 10/16 of its stop bit are over */
    uint8_t byte;
} typed[MOST_BYTES];
static size_t typed_count;
static size_t bytes_told, events_told;

static void complain(void)
{
    char text[400] = "";
    size_t n = 0;
    for (size_t i = typed_count < 90 ? 0 : typed_count - 90; i < typed_count && n < sizeof text - 8; i++) {
        const uint8_t c = typed[i].byte;
        if (i == bytes_told)
            n += (size_t)snprintf(text + n, sizeof text - n, "<now>");
        n += (size_t)snprintf(text + n, sizeof text - n, c >= ' ' && c < 0x7F ? "%c" : "\\%o", c);
    }
    image_fail("%s; typed: ...%s", play_model.complaint, text);
}

/* The model is told what has gone in and come out up to now. */
static void tell(void)
{
    size_t count;
    const ninja_event_t *event = ninja_events(&count);
    const uint64_t now = board_cycle(board);
    bool fits = true;
    while (fits) {
        const bool byte = bytes_told < typed_count && typed[bytes_told].cycle <= now;
        if (byte && (events_told == count || typed[bytes_told].cycle <= event[events_told].cycle)) {
            fits = ninja_model_byte(&play_model, typed[bytes_told].cycle, typed[bytes_told].byte);
            bytes_told++;
        } else if (events_told < count) {
            fits = ninja_model_event(&play_model, &event[events_told++]);
        } else {
            fits = ninja_model_until(&play_model, now);
            break;
        }
    }
    if (!fits)
        complain();
}

void play_power_on(const head_options_t *head)
{
    ninja_power_on(head);
    typed_count = bytes_told = events_told = 0;
    ninja_model_power_on(&play_model, 0, head);
    play_run(2 * MS); /* the receiver is at work */
}

void play_home(void)
{
    play_power_on(&head_defaults);
    play_rest(10 * SECOND);
}

void play_type(const char *text)
{
    for (; *text != '\0'; text++) {
        if (typed_count == MOST_BYTES)
            image_fail("too much was typed");
        typed[typed_count].cycle = ninja_send((uint8_t)*text) - NINJA_BIT * 3 / 8;
        typed[typed_count++].byte = (uint8_t)*text;
    }
}

void play_run(uint64_t cycles)
{
    for (const uint64_t end = board_cycle(board) + cycles; board_cycle(board) < end; tell())
        image_run(end - board_cycle(board) < SLICE ? end - board_cycle(board) : SLICE);
}

void play_sent(void)
{
    while (board_uart_sending(board))
        play_run(MS);
    play_run(NINJA_LATENCY);
}

bool play_rests(uint64_t most)
{
    const uint64_t end = board_cycle(board) + most;
    while (!ninja_model_rests(&play_model) || board_uart_sending(board)) {
        if (board_cycle(board) > end)
            return false;
        play_run(MS);
    }
    play_run(AT_REST);
    return ninja_model_rests(&play_model);
}

void play_rest(uint64_t most)
{
    if (!play_rests(most))
        image_fail("expected the head to rest by cycle %llu", (unsigned long long)board_cycle(board));
    TEST_ASSERT_FALSE_MESSAGE(ninja_current(), "coils are on at rest");
    ninja_assert_at(play_model.real[AXIS_X].position, play_model.real[AXIS_Y].position);
}
