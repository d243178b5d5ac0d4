#include "numbers.h"

#include <math.h>
#include <stdlib.h>

double numbers_real(struct argp_state *state, const char *what, const char *text, double low, double high)
{
    char *end;
    double value = strtod(text, &end);

    if (end == text || *end != '\0' || !(value >= low && value <= high)) {
        argp_error(state, "%s: '%s' is not a number from %.15g to %.15g", what, text, low, high);
    }
    return value;
}

int numbers_whole(struct argp_state *state, const char *what, const char *text, int low, int high)
{
    double value = numbers_real(state, what, text, low, high);

    if (value != floor(value)) {
        argp_error(state, "%s: '%s' is not a whole number", what, text);
    }
    return (int)value;
}
