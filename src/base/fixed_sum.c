/* SPDX-License-Identifier: Apache-2.0
 *
 * Fixed-point sums: the choice of the unit. */
#include "fixed_sum.h"

void imp__fixed_begin(struct imp_fixed_sum *f, double largest, int spare_bits,
                      double n_terms)
{
    int size, terms;
    frexp(largest, &size); /* |largest| < 2^size */
    frexp(n_terms, &terms);
    /* 2^size 2^spare = 2^(62 - terms) units; a unit and its inverse are normal numbers.
     */
    const int unit = imp_clamp(size + spare_bits + terms - 62, -1000, 1000);
    f->unit = ldexp(1, unit);
    f->per_unit = ldexp(1, -unit);
    f->limit = ldexp(1, imp_min(unit + 62 - terms, 1023));
    f->too_large = f->bits = 0;
    if (f->clear) {
        f->clear = false;
        return;
    }
    for (size_t k = 0; k < f->n; k++) {
        if (f->sum) *imp__fixed_at(f, f->sum, k) = 0;
        if (f->fine) *imp__fixed_at(f, f->fine, k) = 0;
    }
}
