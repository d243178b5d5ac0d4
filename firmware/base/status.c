#include "base/status.h"
#include "base/flash.h"

static const char words_OK[] FLASH = "";
#define STATUS(name, number, words, remedy) static const char words_##name[] FLASH = words;
#include "base/status.def"
#undef STATUS

/* Indexed by number: the numbers of status.def run from 1 without a gap. */
static const char *const words_by_number[] FLASH = {
    [STATUS_OK] = words_OK,
#define STATUS(name, number, words, remedy) [number] = words_##name,
#include "base/status.def"
#undef STATUS
};

const char *status_words(status_t status)
{
    return flash_pointer(&words_by_number[status]);
}
