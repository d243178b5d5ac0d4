/* The Ninja as its seed and the decisions describe it, apart from the firmware: FIFO, numbers, macros, moves with
 * backlash, pauses, centring, halts.
 *
 * It is told what went in (bytes) and what came out (coils on and off, steps), in order of time, and complains of the
 * first thing that it cannot explain: it knows what each axis does next, and when, to some microseconds. Only a halt is a
 * matter of what has been seen: up to it so many steps of the path as were made, none behind it, and the coils off where
 * the next one would have been. What begins takes up to NINJA_LATENCY.
 *
 * Where two things come so close together that either may have been first (a byte for a full FIFO at the end of a move; a
 * halt right behind one), the model goes on as it is and counts one unclear case more: what it says from then on is worth
 * nothing.
 *
 * How it reads what the decisions leave open: a waiting M, S, I or C stays in the FIFO; P has left it, but not the byte
 * behind its number, and nothing behind it is interpreted until the pause is over. A sign counts right behind the letter,
 * once. ) in a macro that runs ends it.
 * Time:    the major axis has constant acceleration from a standstill, with sqrt(2/a) (sqrt(k+1) - sqrt(k)) behind step
 *          k (from 0); it ends likewise, but with no interval longer than that of the start speed; none is shorter than
 *          that of V. A velocity of as many whole steps a second as the start speed, or fewer, has no ramps.
 * Units:   cycles of 62.5 ns; steps; tenths of a second.
 * Source:  seed lines N1-128; decisions 0.5, A-NIN-02 to -16. */
#ifndef TEST_IMAGE_NINJA_MODEL_H
#define TEST_IMAGE_NINJA_MODEL_H

#include "ninja.h"

#define NINJA_FIFO 16
#define NINJA_MACRO 64
#define NINJA_LATENCY (MS + 500 * US)

/* Motor to platform. */
typedef struct {
    int position, slack;
} ninja_linkage_t;

typedef struct {
    char letter;
    int value;
} ninja_command_t;

typedef struct {
    uint64_t now;
    char complaint[200]; /* "": none */
    unsigned unclear;

    int target[AXES], v;
    ninja_linkage_t own[AXES];  /* as the firmware believes */
    ninja_linkage_t real[AXES]; /* the head's */
    bool aligned[AXES];         /* the rotor stands where the coils have pulled it */
    head_sensor_t sensor[AXES];

    uint8_t fifo[NINJA_FIFO];
    unsigned fifo_count;
    char pending; /* letter whose number is being read, or 0 */
    bool begun, negative;
    long magnitude;

    struct {
        ninja_command_t command[NINJA_MACRO];
        unsigned commands, bytes, next;
        bool defining, runs;
    } macro;

    bool pauses;
    uint64_t pause_end;

    struct {
        bool runs;
        uint8_t axis;
        unsigned leg;
    } centre;

    struct {
        bool runs;
        bool begins; /* its coils have not been seen on yet */
        bool halted;
        uint64_t halt_cycle;
        unsigned steps[AXES]; /* to make */
        int direction[AXES];
        unsigned most, made;
        double cruise; /* interval of the major axis at V */
        uint64_t on;   /* or, while it begins, when it may begin at the earliest */
        double due_at; /* since then */
        ninja_what_t what[AXES];
        bool due[AXES];
    } move;

    uint64_t started;   /* a move, last */
    uint64_t settled;   /* when something ended by itself last */
    bool was_full;      /* the FIFO, then */
    uint64_t dropped;   /* when a byte was lost last */
    unsigned drops, halts, moves, pauses_made; /* how many there have been */
} ninja_model_t;

/* Switched on: centring begins. */
void ninja_model_power_on(ninja_model_t *m, uint64_t cycle, const head_options_t *head);

/* Each is false once there is a complaint. cycle: of a byte, when the receiver has it. */
bool ninja_model_byte(ninja_model_t *m, uint64_t cycle, uint8_t byte);
bool ninja_model_event(ninja_model_t *m, const ninja_event_t *event);
bool ninja_model_until(ninja_model_t *m, uint64_t cycle); /* nothing else has come out until then */

/* Nothing is under way, and nothing waits. */
bool ninja_model_rests(const ninja_model_t *m);

/* Cycle of a step of the major axis at V. */
uint32_t ninja_v_us(int v);

#endif
