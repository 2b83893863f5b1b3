/* SPDX-License-Identifier: Apache-2.0
 *
 * The floating-point mode: rounding to nearest, no traps, subnormal numbers kept (of
 * MXCSR: neither FTZ nor DAZ). A host may have another one. Every public function that
 * computes sets this one and gives the host's back:
 *
 *     IMP_FLOAT_MODE;
 *
 * in its block; the workers of the pool set it when they begin. */
#ifndef IMP_BASE_FLOAT_MODE_H
#define IMP_BASE_FLOAT_MODE_H

#include <fenv.h>
#include <stdbool.h>

struct imp__float_mode {
    bool changed;
    fenv_t host;
};

/* A few cycles where it can be seen that there is nothing to change. */
static inline bool imp__float_mode_is_ours(void)
{
#if defined(__x86_64__)
    const unsigned mxcsr = __builtin_ia32_stmxcsr();
    unsigned short x87;
    __asm__ volatile("fnstcw %0" : "=m"(x87));
    /* Without the sticky flags of MXCSR and the reserved bits of the x87 word. */
    return (mxcsr & 0xffc0) == 0x1f80 && (x87 & 0x0f3f) == 0x033f;
#else
    return false;
#endif
}

static inline struct imp__float_mode imp__float_mode_enter(void)
{
    struct imp__float_mode m = {.changed = !imp__float_mode_is_ours()};
    if (m.changed) {
        fegetenv(&m.host);
        fesetenv(FE_DFL_ENV);
    }
    return m;
}

static inline void imp__float_mode_leave(const struct imp__float_mode *m)
{
    if (m->changed) fesetenv(&m->host);
}

#define IMP_FLOAT_MODE                                                                   \
    const struct imp__float_mode float_mode_                                             \
        __attribute__((cleanup(imp__float_mode_leave), unused)) =                        \
            imp__float_mode_enter()

#endif
