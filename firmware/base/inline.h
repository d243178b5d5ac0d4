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

/* The same for a new pointer to that variable; nothing is kept of it across calls, where loading it again is shorter. */
#ifdef __AVR__
#define NEAR_TO(pointer, variable) \
    __asm__ volatile("ldi %A0, lo8(%1)\n\tldi %B0, hi8(%1)" : "=z"(pointer) : "i"(&(variable)))
#else
#define NEAR_TO(pointer, variable) ((void)((pointer) = &(variable)))
#endif

#endif
