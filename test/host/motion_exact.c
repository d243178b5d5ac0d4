#include "host/motion_exact.h"
#include <math.h>

#define TICKS_PER_MINUTE 960e6L
#define PI 3.14159265358979323846264338327950288L
#define FLOAT_NOISE 3e-7L

uint32_t exact_rpm(const exact_motor_t *motor, const motion_command_t *command)
{
    if (!(command->flags & MOTION_CYCLE))
        return command->velocity;
    return (uint32_t)(60000000ull / ((uint64_t)motor->steps_per_rev * command->velocity));
}

uint32_t exact_cycle_us(const exact_motor_t *motor, const motion_command_t *command)
{
    if (command->flags & MOTION_CYCLE)
        return command->velocity;
    return (uint32_t)(60000000ull / ((uint64_t)motor->steps_per_rev * command->velocity));
}

long double exact_cruise_ticks(const exact_motor_t *motor, const motion_command_t *command)
{
    return (long double)exact_cycle_us(motor, command) * 16.0L / motor->factor;
}

long double exact_interval_ticks(const exact_motor_t *motor, long double rpm)
{
    return TICKS_PER_MINUTE / ((long double)motor->steps_per_rev * motor->factor * rpm);
}

long double exact_rpm_of(const exact_motor_t *motor, long double ticks)
{
    return exact_interval_ticks(motor, ticks); /* its own inverse */
}

/* V^2 / (2 alpha a): full steps from standstill. */
static long double steps_from_standstill(const exact_motor_t *motor, long double rpm, uint32_t centi)
{
    long double omega = rpm * PI / 30.0L;
    long double alpha = 2.0L * PI / motor->steps_per_rev;
    return omega * omega / (2.0L * alpha * (centi / 100.0L));
}

exact_count_t exact_ramp_steps(const exact_motor_t *motor, long double from_rpm, long double to_rpm, uint32_t centi,
                               bool linear)
{
    exact_count_t count;
    long double low = fminl(from_rpm, to_rpm);
    long double high = fmaxl(from_rpm, to_rpm);
    if (linear) {
        long double n = steps_from_standstill(motor, high, centi);
        long double m = steps_from_standstill(motor, low, centi);
        count.most = (uint64_t)(floorl(n * (1 + FLOAT_NOISE)) - floorl(m * (1 - FLOAT_NOISE)));
        count.least = (uint64_t)(floorl(n * (1 - FLOAT_NOISE)) - floorl(m * (1 + FLOAT_NOISE)));
    } else {
        /* Speeds are whole hundredths of an RPM (per microstep): exact. */
        count.least = count.most = (uint64_t)floorl((high - low) * 100.0L / centi + 1e-9L);
    }
    return count;
}

void exact_accel(exact_ramp_t *ramp, const exact_motor_t *motor, long double from_rpm, bool rest, bool faster,
                 long double cruise_ticks, uint32_t centi, bool linear)
{
    ramp->linear = linear;
    ramp->faster = faster;
    ramp->limit = cruise_ticks;
    ramp->peak = 0;
    if (linear) {
        long double alpha = 2.0L * PI / ((long double)motor->steps_per_rev * motor->factor);
        ramp->c0 = sqrtl(2.0L * alpha / (centi / 100.0L)) * 16e6L;
        ramp->x = rest ? 0.0L : steps_from_standstill(motor, from_rpm, centi) * motor->factor;
    } else {
        ramp->k = exact_interval_ticks(motor, 1.0L);
        ramp->v = from_rpm;
        ramp->dv = (faster ? 1.0L : -1.0L) * centi / 100.0L / motor->factor;
    }
}

void exact_decel(exact_ramp_t *ramp, const exact_motor_t *motor, uint64_t n, long double peak_rpm, uint32_t centi,
                 bool linear)
{
    exact_accel(ramp, motor, 0, true, false, 0, centi, linear);
    if (linear) {
        ramp->x = (long double)n;
        ramp->limit = exact_interval_ticks(motor, motor->slow_rpm);
    } else {
        ramp->v = motor->slow_rpm - ramp->dv * (long double)(n - 1);
        ramp->peak = peak_rpm;
    }
}

/* psi(x + n) - psi(x) = 1/x + 1/(x + 1) + ... + 1/(x + n - 1), x > 0. */
static long double reciprocals(long double x, uint64_t n)
{
    long double sum = 0;
    while (n && x < 40.0L) {
        sum += 1.0L / x;
        x += 1.0L;
        n--;
    }
    if (n == 0)
        return sum;
    long double y = x + (long double)n;
    /* Euler and Maclaurin. */
    sum += logl(y / x) + 0.5L * (1.0L / x - 1.0L / y);
    long double x2 = 1.0L / (x * x);
    long double y2 = 1.0L / (y * y);
    return sum + (x2 - y2) / 12.0L - (x2 * x2 - y2 * y2) / 120.0L + (x2 * x2 * x2 - y2 * y2 * y2) / 252.0L;
}

static long double unlimited(const exact_ramp_t *ramp, uint64_t k)
{
    if (ramp->faster)
        return ramp->c0 / (sqrtl(ramp->x + (long double)(k + 1)) + sqrtl(ramp->x + (long double)k));
    long double from = ramp->x - (long double)k;
    long double to = from - 1.0L;
    return ramp->c0 / (sqrtl(from > 0 ? from : 0) + sqrtl(to > 0 ? to : 0));
}

static bool passes_limit(const exact_ramp_t *ramp, uint64_t k)
{
    return ramp->faster ? unlimited(ramp, k) < ramp->limit : unlimited(ramp, k) > ramp->limit;
}

long double exact_ramp_time(const exact_ramp_t *ramp, uint64_t k)
{
    if (!ramp->linear) {
        if (k == 0 || ramp->dv == 0.0L)
            return (long double)k * ramp->k / ramp->v;
        if (ramp->dv > 0)
            return ramp->k / ramp->dv * reciprocals(ramp->v / ramp->dv, k);
        uint64_t flat = 0;
        if (ramp->peak > 0 && ramp->v > ramp->peak)
            flat = (uint64_t)ceill((ramp->v - ramp->peak) / -ramp->dv - 1e-9L);
        if (flat >= k)
            return (long double)k * ramp->k / ramp->peak;
        /* Backwards: from the slowest on. */
        long double slowest = ramp->v + ramp->dv * (long double)(k - 1);
        long double time = ramp->k / -ramp->dv * reciprocals(slowest / -ramp->dv, k - flat);
        return flat ? time + (long double)flat * ramp->k / ramp->peak : time;
    }
    uint64_t free = k; /* pulses before the limit is reached */
    if (ramp->limit > 0 && k && passes_limit(ramp, k - 1)) {
        uint64_t low = 0;
        while (low < free) {
            uint64_t middle = (low + free) / 2;
            if (passes_limit(ramp, middle))
                free = middle;
            else
                low = middle + 1;
        }
    }
    long double end = ramp->faster ? ramp->x + (long double)free : ramp->x - (long double)free;
    long double time = ramp->c0 * fabsl(sqrtl(end > 0 ? end : 0) - sqrtl(ramp->x));
    return time + (long double)(k - free) * ramp->limit;
}

long double exact_ramp_interval(const exact_ramp_t *ramp, uint64_t k)
{
    if (!ramp->linear) {
        long double v = ramp->v + ramp->dv * (long double)k;
        return ramp->k / (ramp->peak > 0 && v > ramp->peak ? ramp->peak : v);
    }
    long double interval = unlimited(ramp, k);
    return ramp->limit > 0 && passes_limit(ramp, k) ? ramp->limit : interval;
}
