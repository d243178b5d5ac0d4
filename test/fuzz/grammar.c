#include "fuzz/grammar.h"
#include <stdio.h>
#include <string.h>
#include "cli/terminal_port.h"
#include "fuzz/reference.h"

/* -- chance ----------------------------------------------------------------------------------------------------------- */

void fuzz_begin(fuzz_t *fuzz, uint64_t seed)
{
    memset(fuzz, 0, sizeof *fuzz);
    /* splitmix64: seeds that follow each other begin far apart */
    uint64_t z = seed + 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    fuzz->state = (z ^ (z >> 31)) | 1;
    fuzz->motions = 40;
}

uint32_t fuzz_u32(fuzz_t *fuzz)
{
    /* xorshift64* */
    fuzz->state ^= fuzz->state >> 12;
    fuzz->state ^= fuzz->state << 25;
    fuzz->state ^= fuzz->state >> 27;
    return (uint32_t)((fuzz->state * 0x2545F4914F6CDD1Du) >> 32);
}

uint32_t fuzz_below(fuzz_t *fuzz, uint32_t limit)
{
    return (uint32_t)(((uint64_t)fuzz_u32(fuzz) * limit) >> 32);
}

bool fuzz_chance(fuzz_t *fuzz, uint32_t percent)
{
    return fuzz_below(fuzz, 100) < percent;
}

/* -- the grammar ------------------------------------------------------------------------------------------------------ */

/* %n number  %r ramp value  %m count of a motion  %P motion parameters  %e position of the queue  %a network address
 * %l letter of the configuration  %w words  %d one digit  %c f or p; each letter of a template may change its case. */
/* clang-format off */
static const char *const templates[] = {
    /* motion, session, displays */
    "v%n", "v%n", "vc%n", "vc%n", "v", "vc", "vd", "a%r", "a%r", "d%r", "d%r", "a", "d", "S", "S", "s", "s", "N", "n",
    "g", "b", "q", "cf", "p", "?", "", "$L0", "$L1", "$L", "$L%n", "$F", "$P", "$U", "+", "-", "++-+", "+m%m", "-%n",
    /* the queue and its program mode */
    "qp", "qc", "qc%e", "qr", "qs", "qr", "qs", "q%em%m%P", "q%em%m%P", "q%e%P", "q%e%P", "q%e%P%cm%m", "q%e", "%em%m%P", "%e%P",
    /* loops, one-shots, cross references */
    "l", "l", "l%e", "la", "lf", "lf%e", "ls", "ls%e", "ln%n", "l%n", "x", "x%e", "x%e", "x%n", "xm%m%P", "xm%m%P", "xl", "xd", "xp",
    "x%e %e",
    /* sync, undo */
    "y", "z", "z", "z",
    /* configuration and system */
    "cc", "c", "$C", "$C%l%n", "$C%l%d", "$C%l%d", "$C%l%r", "$CU%d%d", "$R", "$CC%d", "$Cc%n", "$CA%e", "$Ca%n", "$CU%n", "$E", "$H%d", "$H",
    "$K%d", "$K", "$n", "$O%d", "$O", "$R", "$", "$%l", "%l%n", "%l%n",
    /* the network */
    "%am%m%P", "%a %w", "%a.%w", "%aS", "%a", "/%w", "/m%m", "\\%w", "0m%m%P", "%a$R", "/",
    /* nothing of these */
    "R", "%w", "k%n", "%n", " m%m%P", ".%n",
};
enum { TEMPLATES = sizeof templates / sizeof templates[0] };

/* What the modes read, by fuzz_mode_t. */
static const char *const in_mode[][8] = {
    [MODE_QUEUE] = {"%em%m%P", "%e%P", "%e%P%cm%m", "%e", "q", "x", "?", "s"},
    [MODE_ARRAY] = {"%e,%e", "%e,%e", "%e,0", "%d,%d", "%n,%n", "x", "q", "S"},
    [MODE_CONFIGURE] = {"%l%n", "%l%n", "%l%d", "%l%r", "U%d%d", "x", "S", "%l"},
};

static const char *const edges[] = {
    "0", "1", "2", "3", "9", "10", "29", "30", "31", "99", "100",
    "127", "128", "255", "256", "257", "998", "999", "1000", "9999", "10000", "10899",
    "10900", "32767", "32768", "65535", "65536", "16777215", "16777216", "99999999", "2147483647", "2147483648",
    "4294967295", "4294967296", "4294967297", "4294967305", "42949672950", "429496729600", "8589934593",
    "18446744073709551616",
    "18446744073709551617", "99999999999999999999", "00000000000000000001", "000", "007",
};
/* clang-format on */
enum { EDGES = sizeof edges / sizeof edges[0] };

static void put(fuzz_line_t *line, uint8_t byte)
{
    if (line->length < FUZZ_LINE_BYTES) {
        line->bytes[line->length++] = byte;
    }
}

static void put_text(fuzz_line_t *line, const char *text)
{
    while (*text != '\0') {
        put(line, (uint8_t)*text++);
    }
}

static void put_u32(fuzz_line_t *line, uint32_t number)
{
    char digits[10];
    unsigned count = 0;
    do {
        digits[count++] = (char)('0' + number % 10);
        number /= 10;
    } while (number != 0);
    while (count > 0) {
        put(line, (uint8_t)digits[--count]);
    }
}

static uint32_t magnitude(fuzz_t *fuzz)
{
    return fuzz_u32(fuzz) >> fuzz_below(fuzz, 32);
}

static void put_number(fuzz_t *fuzz, fuzz_line_t *line)
{
    switch (fuzz_below(fuzz, 8)) {
    case 0:
    case 1: put_text(line, edges[fuzz_below(fuzz, EDGES)]); break;
    case 2: put_u32(line, magnitude(fuzz)); break;
    case 3: break; /* left out */
    default: put_u32(line, fuzz_below(fuzz, 4000)); break;
    }
}

static void put_ramp(fuzz_t *fuzz, fuzz_line_t *line)
{
    if (fuzz_chance(fuzz, 20)) {
        put_number(fuzz, line);
    } else {
        put_u32(line, fuzz_below(fuzz, fuzz_chance(fuzz, 50) ? 100 : 1000));
    }
    if (fuzz_chance(fuzz, 50)) {
        put(line, '.');
        for (uint32_t digits = fuzz_below(fuzz, 5); digits > 0; digits--) {
            put(line, (uint8_t)('0' + (fuzz_chance(fuzz, 40) ? 0 : fuzz_below(fuzz, 10))));
        }
    }
}

static void put_count(fuzz_t *fuzz, fuzz_line_t *line)
{
    if (fuzz_chance(fuzz, 40)) {
        put(line, '-');
    }
    if (fuzz->brisk && fuzz_chance(fuzz, 90)) {
        put_u32(line, 1 + fuzz_below(fuzz, 200));
    } else {
        put_number(fuzz, line);
    }
}

static void put_parameters(fuzz_t *fuzz, fuzz_line_t *line)
{
    if (fuzz->brisk && fuzz_chance(fuzz, 80)) {
        put_text(line, "vc");
        put_u32(line, fuzz_chance(fuzz, 15) ? 1 + fuzz_below(fuzz, 14) : 15 + fuzz_below(fuzz, 200)); /* the fastest too */
        if (fuzz_chance(fuzz, 70)) {
            put_text(line, "a999d999");
        }
        if (fuzz_chance(fuzz, 60)) {
            return;
        }
    }
    for (uint32_t parameters = fuzz_below(fuzz, 7); parameters > 0; parameters--) {
        static const char letters[] = "vvcaaddlustfp";
        const char letter = letters[fuzz_below(fuzz, sizeof letters - 1)];
        put(line, (uint8_t)letter);
        switch (letter) {
        case 'v':
            if (fuzz_chance(fuzz, 50)) {
                put(line, 'c');
            }
            put_number(fuzz, line);
            break;
        case 'a':
        case 'd': put_ramp(fuzz, line); break;
        case 'l':
        case 's':
            if (fuzz_chance(fuzz, 80)) {
                put(line, (uint8_t)('0' + fuzz_below(fuzz, fuzz_chance(fuzz, 80) ? 2 : 10)));
            }
            break;
        case 'u': put_u32(line, fuzz_below(fuzz, 260)); break;
        case 't': put_number(fuzz, line); break;
        default: break; /* c, f, p */
        }
    }
}

static void put_words(fuzz_t *fuzz, fuzz_line_t *line)
{
    static const char *const words[] = {
        "hello", "is anyone there?", "stop", "m200", "R", "Steps 3000", "x", " ", "SAC>", "?1"};
    put_text(line, words[fuzz_below(fuzz, sizeof words / sizeof words[0])]);
}

static void put_template(fuzz_t *fuzz, fuzz_line_t *line, const char *text)
{
    for (; *text != '\0'; text++) {
        if (*text != '%') {
            put(line, (uint8_t)*text);
            continue;
        }
        switch (*++text) {
        case 'n': put_number(fuzz, line); break;
        case 'r': put_ramp(fuzz, line); break;
        case 'm': put_count(fuzz, line); break;
        case 'P': put_parameters(fuzz, line); break;
        case 'e': put_u32(line, fuzz_below(fuzz, 33)); break;
        case 'a': put_u32(line, fuzz_chance(fuzz, 30) ? 85 : fuzz_below(fuzz, 260)); break;
        case 'l': put(line, (uint8_t)((fuzz_chance(fuzz, 50) ? 'A' : 'a') + (int)fuzz_below(fuzz, 26))); break;
        case 'w': put_words(fuzz, line); break;
        case 'c': put(line, fuzz_chance(fuzz, 50) ? 'f' : 'p'); break;
        default: put(line, (uint8_t)('0' + fuzz_below(fuzz, 10))); break;
        }
    }
}

static bool is_letter(uint8_t byte)
{
    return (byte | 0x20) >= 'a' && (byte | 0x20) <= 'z';
}

static void put_command(fuzz_t *fuzz, fuzz_line_t *line)
{
    line->length = 0;
    if (fuzz->mode != MODE_COMMANDS && fuzz_chance(fuzz, 80)) {
        put_template(fuzz, line, in_mode[fuzz->mode][fuzz_below(fuzz, 8)]);
    } else if (fuzz_chance(fuzz, fuzz->motions)) {
        put_template(fuzz, line, "m%m%P");
    } else {
        put_template(fuzz, line, templates[fuzz_below(fuzz, TEMPLATES)]);
    }
    if (fuzz_chance(fuzz, 15)) {
        for (unsigned i = 0; i < line->length; i++) {
            if (is_letter(line->bytes[i]) && fuzz_chance(fuzz, 50)) {
                line->bytes[i] ^= 0x20;
            }
        }
    }
    if (fuzz_chance(fuzz, 5)) {
        put(line, ' ');
        put_words(fuzz, line);
    }
}

/* -- damage ----------------------------------------------------------------------------------------------------------- */

static void insert(fuzz_line_t *line, unsigned at, uint8_t byte)
{
    if (line->length < FUZZ_LINE_BYTES) {
        memmove(&line->bytes[at + 1], &line->bytes[at], line->length - at);
        line->bytes[at] = byte;
        line->length++;
    }
}

static uint8_t any_byte(fuzz_t *fuzz)
{
    static const uint8_t likely[] = "0123456789.-+ $?/mvcadlustfpqxyzbgnSNRLMP\b\b\b\x7F\x1B\r\n\t";
    static const uint8_t rare[] = {0, 1, 3, 7, 0x11, 0x13, 0x1A, 0x80, 0xC1, 0xFE, TERMINAL_PORT_DAMAGED};
    if (fuzz_chance(fuzz, 80)) {
        return likely[fuzz_below(fuzz, sizeof likely - 1)];
    }
    return fuzz_chance(fuzz, 50) ? rare[fuzz_below(fuzz, sizeof rare)] : (uint8_t)fuzz_u32(fuzz);
}

static void damage(fuzz_t *fuzz, fuzz_line_t *line)
{
    const unsigned at = fuzz_below(fuzz, line->length + 1);        /* a place to insert at */
    const unsigned some = fuzz_below(fuzz, line->length - at + 1); /* bytes behind it */
    switch (fuzz_below(fuzz, 12)) {
    case 0: /* a bit flips */
        if (at < line->length) {
            line->bytes[at] ^= (uint8_t)(1u << fuzz_below(fuzz, 8));
        }
        break;
    case 1: /* another byte */
        if (at < line->length) {
            line->bytes[at] = any_byte(fuzz);
        }
        break;
    case 2:
    case 3: insert(line, at, any_byte(fuzz)); break;
    case 4: /* lost without a trace */
        memmove(&line->bytes[at], &line->bytes[at + some], line->length - at - some);
        line->length -= some;
        break;
    case 5: /* doubled */
        for (unsigned i = 0; i < some; i++) {
            insert(line, at + some + i, line->bytes[at + i]);
        }
        break;
    case 6: line->length = at; break;
    case 7: { /* its end is another line's */
        const fuzz_line_t *other = &fuzz->kept[fuzz_below(fuzz, FUZZ_KEPT)];
        line->length = at;
        for (unsigned i = fuzz_below(fuzz, other->length + 1); i < other->length; i++) {
            put(line, other->bytes[i]);
        }
        break;
    }
    case 8: { /* far too long */
        const uint8_t byte = fuzz_chance(fuzz, 50) ? (uint8_t)'0' : any_byte(fuzz);
        for (uint32_t more = fuzz_below(fuzz, fuzz_chance(fuzz, 80) ? 70 : 250); more > 0; more--) {
            insert(line, at, byte);
        }
        break;
    }
    case 9: /* corrected while it is typed */
        for (unsigned i = 0; i < some && i < 5; i++) {
            insert(line, at + some, fuzz_chance(fuzz, 50) ? 0x08 : 0x7F);
        }
        break;
    case 10: insert(line, at, TERMINAL_PORT_DAMAGED); break;
    default: /* a digit more, which may make a number too large */
        for (uint32_t more = 1 + fuzz_below(fuzz, 11); more > 0; more--) {
            insert(line, at, (uint8_t)('0' + fuzz_below(fuzz, 10)));
        }
        break;
    }
}

void fuzz_line(fuzz_t *fuzz, fuzz_line_t *line)
{
    put_command(fuzz, line);
    if (fuzz_chance(fuzz, fuzz->brisk ? 35 : 55)) {
        uint32_t times = 1;
        while (times < 6 && fuzz_chance(fuzz, 40)) {
            times++;
        }
        for (; times > 0; times--) {
            damage(fuzz, line);
        }
    }
    if (fuzz_chance(fuzz, 10)) {
        fuzz->kept[fuzz_below(fuzz, FUZZ_KEPT)] = *line;
    }
}

const char *fuzz_printable(const uint8_t *bytes, unsigned length)
{
    static char text[4 * FUZZ_LINE_BYTES + 1];
    char *end = text;
    for (unsigned i = 0; i < length && end < text + sizeof text - 5; i++) {
        if (bytes[i] >= 0x20 && bytes[i] < 0x7F && bytes[i] != '\\') {
            *end++ = (char)bytes[i];
        } else {
            end += snprintf(end, 5, "\\x%02X", bytes[i]);
        }
    }
    *end = '\0';
    return text;
}
