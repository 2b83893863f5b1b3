/* SPDX-License-Identifier: Apache-2.0
 *
 * GNU extensions used by the library, in one place. */
#ifndef IMP_BASE_COMPILER_H
#define IMP_BASE_COMPILER_H

#define imp_likely(x)    __builtin_expect(!!(x), 1)
#define imp_unlikely(x)  __builtin_expect(!!(x), 0)
#define IMP_PRINTF(f, a) __attribute__((format(printf, f, a)))
/* Called when something goes wrong: what leads to such a call is laid out apart from code that
 * runs, so that it is not loaded. */
#define IMP_COLD __attribute__((cold))

#define IMP_CACHE_LINE 64 /* bytes; what two threads write should not share one */

#define imp_min(a, b)                                                                    \
    ({                                                                                   \
        __typeof__(a) a_ = (a);                                                          \
        __typeof__(b) b_ = (b);                                                          \
        a_ < b_ ? a_ : b_;                                                               \
    })
#define imp_max(a, b)                                                                    \
    ({                                                                                   \
        __typeof__(a) a_ = (a);                                                          \
        __typeof__(b) b_ = (b);                                                          \
        a_ > b_ ? a_ : b_;                                                               \
    })
#define imp_clamp(x, lo, hi) imp_max(imp_min((x), (hi)), (lo))
#define imp_count(array)     (sizeof(array) / sizeof((array)[0]))

/* The compiler may not look through this value of a floating-point register. GCC 12 takes
 * (double)(float)x for x where it vectorises several of them. */
#if defined(__x86_64__)
#define IMP_OPAQUE(x) __asm__("" : "+x"(x))
#elif defined(__aarch64__)
#define IMP_OPAQUE(x) __asm__("" : "+w"(x))
#else
#define IMP_OPAQUE(x) __asm__("" : "+m"(x))
#endif

#endif
