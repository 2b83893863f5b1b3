/* SPDX-License-Identifier: Apache-2.0 */
#include "spectrum.h"
#include <string.h>

bool imp__spectrum_at(const struct imp_spectrum *s, double nm, size_t *first,
                      double weight[2])
{
    if (s->n < 2 || !(nm >= s->nm[0]) || !(nm <= s->nm[s->n - 1])) return false;
    size_t lo = 0, hi = s->n - 1; /* nm[lo] <= nm <= nm[hi] */
    while (hi - lo > 1) {
        const size_t middle = (lo + hi) / 2;
        if (s->nm[middle] <= nm) lo = middle;
        else hi = middle;
    }
    const double t = (nm - s->nm[lo]) / (s->nm[hi] - s->nm[lo]);
    *first = lo;
    weight[0] = 1 - t;
    weight[1] = t;
    return true;
}

struct imp_spectrum *imp__spectrum_keep(struct imp_arena *arena, size_t n,
                                        const double *nm, const double *value)
{
    struct imp_spectrum *s = imp__arena_take(arena, 1, sizeof *s);
    double *numbers = imp__arena_take(arena, 2 * n, sizeof *numbers);
    if (!s || !numbers) return NULL;
    memcpy(numbers, nm, n * sizeof *nm);
    memcpy(numbers + n, value, n * sizeof *value);
    *s = (struct imp_spectrum){n, numbers, numbers + n};
    return s;
}
