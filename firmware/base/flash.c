#include "base/flash.h"
#include "base/inline.h"

NOINLINE const char *flash_text(const char *texts, uint8_t number)
{
    for (; number > 0; number--) {
        while (flash_u8(texts++) != '\0') {
        }
    }
    return texts;
}
