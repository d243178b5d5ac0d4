/* NOINLINE keeps rare code out of a frequent function, which would otherwise save registers for it at every call. */
#ifndef BASE_INLINE_H
#define BASE_INLINE_H

#define NOINLINE __attribute__((noinline))

/* A pointer of which the compiler does not know where it points: on the AVR a member is then reached from a register, in
 * one word, where an address that is known takes two at each access. */
#define HIDDEN(pointer) \
    ({ \
        __typeof__(pointer) hidden = (pointer); \
        __asm__("" : "+r"(hidden)); \
        hidden; \
    })

#endif
