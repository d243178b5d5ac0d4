/* The Ninja's head without hardware: the stepper plays its waits when told to, each sensor is low from one motor
 * count on. And the whole firmware above its ports, polled until it has nothing left to do. */
#ifndef HEAD_FAKE_H
#define HEAD_FAKE_H

#include <stdbool.h>
#include <stdint.h>
#include "ninja/stepper_port.h"

typedef struct {
    uint64_t ticks; /* since head_fake_reset() */
    uint8_t axes;   /* energised from then on; 0: the end */
    bool step;
    int counts[AXES];
} head_event_t;

#define HEAD_EVENTS 20000
extern head_event_t head_events[HEAD_EVENTS]; /* the first ones since head_fake_forget() */
extern unsigned head_event_count;             /* of all */
extern uint64_t head_ticks;
extern int head_counts[AXES]; /* of the motors */
extern int head_edges[AXES];  /* a sensor is low from this count on ... */
extern int head_stuck[AXES];  /* ... unless 0 or 1, its level, stands here; else -1 */
extern unsigned head_moves;   /* begun */
extern unsigned head_halts;   /* asked for while a move was under way */

void head_fake_reset(void); /* counts and edges 0, the time too; no move is under way */
void head_fake_forget(void);

/* The next wait is over: false if no move is under way. */
bool head_fake_play(void);

/* -- the firmware (not in tests of single modules) ----------------------------------------------------------------- */

void head_boot(void); /* fakes and firmware, centring begun */
void head_settle(void); /* polls while somebody has something to do, but for an endless macro */
void head_say(const char *bytes); /* each as the line brings it, with polls in between */
bool head_rest(unsigned most_waits); /* plays and pauses until nothing is under way; false if that does not come */

#endif
