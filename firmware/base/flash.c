#include "base/flash.h"
#include "base/inline.h"

NOINLINE const char *flash_text(const char *texts, uint8_t number)
{
    while (number > 0) {
        if (flash_u8(texts++) == '\0') {
            number--;
        }
    }
    return texts;
}
