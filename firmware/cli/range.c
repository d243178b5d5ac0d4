#include "cli/range.h"
#include "base/flash.h"
#include "base/inline.h"
#include "base/number.h"

/* One after the other, each with its NUL. */
static const char ranges[] FLASH =
#define SETTING_KIND(kind, range) range "\0"
#include "settings.def"
#undef SETTING_KIND
    "1..30\0"
    "0..65535";

static uint8_t refused;

status_t range_refuse(uint8_t range)
{
    refused = range;
    return STATUS_RANGE;
}

uint8_t range_refused(void)
{
    return refused;
}

const char *range_text(uint8_t range)
{
    return flash_text(ranges, range);
}

NOINLINE status_t range_check(motion_syntax_t *number, uint8_t range)
{
    NEAR(number);
    const char *text = range_text(range);
    uint32_t least = 0;
    number->limit = 0;
    for (uint8_t c; (c = flash_u8(text)) != '\0'; text++) {
        c = (uint8_t)(c - '0');
        if (c < 10) {
            number_add_digit(&number->limit, c);
        } else if (number->limit != 0) {
            least = number->limit;
            number->limit = 0;
        }
    }
    if (range == RANGE_OPS && (uint8_t)number->value != 0) {
        least = number->limit; /* there is nothing between its two values */
    }
    if (number->value > number->limit) {
        number->value = number->limit;
    } else if (number->value >= least) {
        return STATUS_OK;
    }
    return range_refuse(range);
}
