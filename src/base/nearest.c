/* SPDX-License-Identifier: Apache-2.0
 *
 * Spelling suggestions by edit distance. */
#include "nearest.h"
#include "compiler.h"
#include <stdint.h>
#include <string.h>

size_t imp__edit_distance(const char *a, const char *b)
{
    enum { LONGEST = 96 };
    const size_t n = strlen(a), m = strlen(b);
    if (n > LONGEST || m > LONGEST) return SIZE_MAX;
    size_t row[LONGEST + 1];
    for (size_t j = 0; j <= m; j++) row[j] = j;
    for (size_t i = 1; i <= n; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= m; j++) {
            const size_t above = row[j];
            const size_t swap = diagonal + (a[i - 1] != b[j - 1]);
            row[j] = imp_min(swap, imp_min(above, row[j - 1]) + 1);
            diagonal = above;
        }
    }
    return row[m];
}

/* One character in three may be wrong; two in five, as a swap is two. */
struct imp_nearest imp__nearest(const char *given)
{
    return (struct imp_nearest){given, NULL, (strlen(given) + 1) / 3 + 1};
}

void imp__nearest_try(struct imp_nearest *n, const char *candidate)
{
    const size_t d = imp__edit_distance(n->given, candidate);
    if (d >= n->distance) return;
    n->distance = d;
    n->best = candidate;
}
