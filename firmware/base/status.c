#include "base/status.h"
#include "base/flash.h"

/* One after the other, in the order of their numbers: those of status.def run from 1 without a gap. */
static const char words[] FLASH = "\0"
#define STATUS(name, number, words, remedy) words "\0"
#include "base/status.def"
#undef STATUS
    ;

const char *status_words(status_t status)
{
    return flash_text(words, status);
}
