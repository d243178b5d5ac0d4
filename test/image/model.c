#include "model.h"

#include <math.h>
#include <stdio.h>

#define TICKS_PER_US 16.0
#define PI 3.14159265358979323846

static double factor(const plan_t *plan)
{
    return (double)(1u << plan->machine.ustep);
}

/* Interval of a pulse at a velocity in hundredths of RPM. */
static double interval_at(const plan_t *plan, double v)
{
    return TICKS_PER_US * 60e8 / (plan->machine.steps_per_rev * v * factor(plan));
}

uint32_t model_rpm(machine_t machine, request_t request)
{
    return request.cycle ? 60000000u / machine.steps_per_rev / request.velocity : request.velocity;
}

double model_cruise(const plan_t *plan)
{
    uint32_t cycle =
        plan->request.cycle ? plan->request.velocity : 60000000u / plan->machine.steps_per_rev / plan->request.velocity;
    return TICKS_PER_US * cycle / factor(plan);
}

double model_slow(const plan_t *plan)
{
    return interval_at(plan, plan->machine.slow_rpm * 100.0);
}

/* Constant acceleration: ticks^2 for a pulse, t(k) = sqrt(k * C). */
static double linear_c(const plan_t *plan, uint32_t centi)
{
    double alpha = 2 * PI / (plan->machine.steps_per_rev * factor(plan));
    double ticks_per_s = TICKS_PER_US * 1e6;
    return 2 * alpha / (centi / 100.0) * ticks_per_s * ticks_per_s;
}

/* Time from standstill to a velocity. */
static double linear_time(double v, uint32_t centi)
{
    return v / 100.0 * 2 * PI / 60 / (centi / 100.0) * TICKS_PER_US * 1e6;
}

static double whole(plan_t *plan, double exact)
{
    if (exact > 1 && fabs(exact - round(exact)) < 2e-6 * exact && exact != round(exact))
        plan->uncertain = true;
    return floor(exact);
}

static double ramp_steps(plan_t *plan, double from, double to, uint32_t centi)
{
    if (!plan->request.linear)
        return whole(plan, fabs(to - from) / centi);
    double alpha = 2 * PI / plan->machine.steps_per_rev;
    double speed_from = from / 100 * 2 * PI / 60;
    double speed_to = to / 100 * 2 * PI / 60;
    double a = centi / 100.0;
    return fabs(whole(plan, speed_to * speed_to / (2 * alpha * a)) -
                whole(plan, speed_from * speed_from / (2 * alpha * a)));
}

plan_t model_plan(machine_t machine, request_t request)
{
    plan_t plan = {.machine = machine, .request = request};
    double slow = machine.slow_rpm * 100.0;
    double f = factor(&plan);
    plan.target = model_rpm(machine, request) * 100.0;
    plan.start = request.from > slow ? request.from : slow;
    double accel = 0;
    double decel = 0;
    bool ramps = plan.target > slow;
    bool from_zero = request.linear && plan.start == slow && plan.target > plan.start;
    if (ramps && request.accel != NO_RAMP && plan.start != plan.target)
        accel = ramp_steps(&plan, from_zero ? 0 : plan.start, plan.target, request.accel);
    if (ramps && request.decel != NO_RAMP)
        decel = ramp_steps(&plan, request.linear ? 0 : slow, plan.target, request.decel);

    /* Full steps are truncated as full steps. */
    double total = request.count;
    double after = f;
    if (request.pulses) {
        accel *= f;
        decel *= f;
        after = 1;
    }
    double cruise = total - accel - decel;
    plan.truncated = cruise < 0;
    if (plan.truncated) {
        double scaled = floor(decel * total / (accel + decel));
        if (scaled > 1)
            scaled = total - floor(accel * total / (accel + decel));
        decel = scaled;
        accel = total - decel;
        cruise = 0;
    }
    plan.accel = (uint32_t)(accel * after);
    plan.decel = (uint32_t)(decel * after);
    plan.cruise = (uint32_t)(cruise * after) + (plan.truncated ? 0 : request.extra);
    plan.total = plan.accel + plan.cruise + plan.decel;

    double sign = plan.target > plan.start ? 1 : -1;
    plan.peak = plan.target;
    double last = plan.target;
    if (plan.accel && plan.cruise == 0) {
        if (request.linear) {
            double c = linear_c(&plan, request.accel);
            double t0 = from_zero ? 0 : linear_time(plan.start, request.accel);
            double peak = sqrt(fmax(0, t0 * t0 + sign * plan.accel * c));
            plan.peak = plan.target / linear_time(plan.target, request.accel) * peak;
            last = interval_at(&plan, 1) / model_interval(&plan, plan.accel - 1);
        } else {
            plan.peak = plan.start + sign * plan.accel * request.accel / f;
            last = plan.peak - sign * request.accel / f;
        }
        if (sign * plan.peak > sign * plan.target)
            plan.peak = plan.target;
        if (sign * last > sign * plan.target)
            last = plan.target;
    } else if (plan.truncated && plan.accel == 0) {
        plan.peak = plan.start;
    }
    plan.exit = plan.decel ? slow : plan.cruise ? plan.target : last;
    return plan;
}

static double accel_interval(const plan_t *plan, uint32_t k)
{
    const request_t *r = &plan->request;
    double sign = plan->target > plan->start ? 1 : -1;
    if (!r->linear)
        return interval_at(plan, plan->start + sign * k * r->accel / factor(plan));
    double c = linear_c(plan, r->accel);
    bool from_zero = plan->start == plan->machine.slow_rpm * 100.0 && sign > 0;
    double t0 = from_zero ? 0 : linear_time(plan->start, r->accel);
    double before = fmax(0, t0 * t0 + sign * k * c);
    double behind = fmax(0, t0 * t0 + sign * (k + 1.0) * c);
    return fabs(sqrt(behind) - sqrt(before));
}

/* j intervals before the last one of the deceleration. */
static double decel_interval(const plan_t *plan, uint32_t j)
{
    const request_t *r = &plan->request;
    double f = factor(plan);
    double slow = plan->machine.slow_rpm * 100.0;
    if (!r->linear) {
        double step = r->decel / f;
        if (plan->peak - slow > step * (plan->decel + f))
            step = floor((plan->peak - slow) * f / plan->decel) / f; /* too few for it: steeper */
        return interval_at(plan, fmin(plan->peak, slow + j * step));
    }
    double c = linear_c(plan, r->decel);
    double t_peak = linear_time(plan->peak, r->decel);
    if (t_peak * t_peak > plan->decel * c * 1.02 + 4 * f * c) {
        double t = 2.0 * plan->decel * interval_at(plan, plan->peak);
        c = t * t / plan->decel;
    }
    return fmin(model_slow(plan), sqrt((j + 1.0) * c) - sqrt(j * c));
}

double model_interval(const plan_t *plan, uint32_t k)
{
    if (k < plan->accel)
        return accel_interval(plan, k);
    if (k < plan->accel + plan->cruise)
        return model_cruise(plan);
    return decel_interval(plan, plan->total - 1 - k);
}

double model_sum(const plan_t *plan, uint32_t first, uint32_t count)
{
    double sum = 0;
    for (uint32_t k = first; k < first + count; k++) {
        uint32_t cruise_end = plan->accel + plan->cruise;
        if (k >= plan->accel && k < cruise_end) {
            uint32_t run = (first + count < cruise_end ? first + count : cruise_end) - k;
            sum += run * model_cruise(plan);
            k += run - 1;
        } else {
            sum += model_interval(plan, k);
        }
    }
    return sum;
}

static int ramp_value(char *out, size_t size, char letter, uint32_t centi)
{
    return centi >= 10000 ? snprintf(out, size, "%c%u", letter, centi / 100)
                          : snprintf(out, size, "%c%u.%02u", letter, centi / 100, centi % 100);
}

void model_line(char *line, size_t size, const request_t *r, bool ccw)
{
    size_t n = (size_t)snprintf(line, size, "m%s%uv%s%ul%d", ccw ? "-" : "", r->count, r->cycle ? "c" : "", r->velocity,
                                r->linear);
    n += (size_t)ramp_value(line + n, size - n, 'a', r->accel);
    n += (size_t)ramp_value(line + n, size - n, 'd', r->decel);
    if (r->extra)
        n += (size_t)snprintf(line + n, size - n, "u%u", r->extra);
    snprintf(line + n, size - n, "%c", r->pulses ? 'p' : 'f');
}
