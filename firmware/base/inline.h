/* NOINLINE keeps rare code out of a frequent function, which would otherwise save registers for it at every call. */
#ifndef BASE_INLINE_H
#define BASE_INLINE_H

#define NOINLINE __attribute__((noinline))

#endif
