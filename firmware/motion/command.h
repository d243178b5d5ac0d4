/* One motion command, as the queue stores it and the engine executes it.
 *
 * Units:   counts in full steps (or pulses with MOTION_PULSES), velocity in RPM (or microseconds per full step with
 *          MOTION_CYCLE), start wait in microseconds, ramp values as accel_code_t.
 * Context: plain data, main loop only.
 * Source:  manual lines 464-487 (parameters), 499-537 (ramp values), 541-549 (velocity), 636-638 (start wait). */
#ifndef MOTION_COMMAND_H
#define MOTION_COMMAND_H

#include <stdint.h>

/* A ramp value in 16 bits: 1..9999 = hundredths (0.01..99.99); 10000..10899 = whole numbers 100..999.
 * Harmonic: RPM per full step. Linear: rad/s^2. 999 means "no ramp". (manual lines 501, 809) */
typedef uint16_t accel_code_t;
#define ACCEL_CODE_WHOLE 10000u /* code of 100 */
#define ACCEL_NONE 10899u       /* code of 999: no ramp */

/* The value in hundredths: 1..99900. */
static inline uint32_t accel_centi(accel_code_t code)
{
    return code < ACCEL_CODE_WHOLE ? code : (uint32_t)(code - ACCEL_CODE_WHOLE + 100u) * 100u;
}

enum {
    MOTION_CCW = 1 << 0,    /* direction: counter-clockwise */
    MOTION_PULSES = 1 << 1, /* count is in pulses, not full steps (shown as +) */
    MOTION_LINEAR = 1 << 2, /* linear ramp, otherwise harmonic (shown as *) */
    MOTION_SYNC = 1 << 3,   /* held until a sync release (shown as s) */
    MOTION_CYCLE = 1 << 4,  /* velocity is a cycle in microseconds per full step, otherwise RPM */
};

typedef struct
#ifndef __AVR__
    __attribute__((packed)) /* as on the AVR: 18 bytes */
#endif
{
    uint32_t count;         /* full steps, or pulses: 1..2^32-1; 0: until it is ended */
    uint32_t velocity;      /* RPM, or cycle in us with MOTION_CYCLE: 1..2^32-1 */
    uint32_t start_wait_us; /* 0..2^32-1 */
    accel_code_t accel;
    accel_code_t decel;
    uint8_t extra_pulses; /* added to cruise: 0..255 */
    uint8_t flags;        /* MOTION_... */
} motion_command_t;

#endif
