/* What makes the compiler's code smaller.
 *
 * NOINLINE keeps rare code out of a frequent function, which would otherwise save registers for it at every call. */
#ifndef BASE_INLINE_H
#define BASE_INLINE_H

#define NOINLINE __attribute__((noinline))


/* NEAR(pointer): the compiler forgets that it points to a variable of a known address. What it points to is then
 * reached by a displacement, in instructions half as long. */
#ifdef __AVR__
#define NEAR(pointer) __asm__("" : "+b"(pointer))
#else
#define NEAR(pointer) ((void)(pointer))
#endif

#endif
