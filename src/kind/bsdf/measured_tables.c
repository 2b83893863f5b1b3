/* SPDX-License-Identifier: Apache-2.0
 *
 * Sizes and numbers of the tables of a measured material, checked before they are used. */
#include "measured.h"
#include <math.h>

#define VALUE_MAX 1e12f

bool imp__measured_counts(const struct imp_measured_data *d,
                          size_t count[IMP_MEASURED_TABLES])
{
    const int side[] = {d->ndf[0],  d->ndf[1], d->sigma[0], d->sigma[1], d->vndf[0],
                        d->vndf[1], d->side,   d->n_theta,  d->n_phi,    d->n_wave};
    for (int k = 0; k < 10; k++)
        if (side[k] < (k < 7 ? 2 : k < 9 ? 1 : 0) || side[k] > IMP_MEASURED_SIDE_MAX)
            return false;
    if (d->rgb < 0 || d->rgb > 1 || (!d->rgb && !d->n_wave)) return false;
    size_t all = 0;
    const size_t directions = (size_t)d->n_phi * (size_t)d->n_theta,
                 square = (size_t)d->side * (size_t)d->side;
    const size_t n[IMP_MEASURED_TABLES][3] = {
        [IMP_MEASURED_THETA] = {(size_t)d->n_theta, 1, 1},
        [IMP_MEASURED_PHI] = {(size_t)d->n_phi, 1, 1},
        [IMP_MEASURED_NDF] = {(size_t)d->ndf[0], (size_t)d->ndf[1], 1},
        [IMP_MEASURED_SIGMA] = {(size_t)d->sigma[0], (size_t)d->sigma[1], 1},
        [IMP_MEASURED_VNDF] = {directions, (size_t)d->vndf[0] * (size_t)d->vndf[1], 1},
        [IMP_MEASURED_LUMINANCE] = {directions, square, 1},
        [IMP_MEASURED_WAVELENGTHS] = {(size_t)d->n_wave, 1, 1},
        [IMP_MEASURED_RGB] = {directions, square, 3 * (size_t)d->rgb},
        [IMP_MEASURED_SPECTRA] = {directions, square, (size_t)d->n_wave}};
    for (int k = 0; k < IMP_MEASURED_TABLES; k++)
        if (__builtin_mul_overflow(n[k][0], n[k][1], &count[k]) ||
            __builtin_mul_overflow(count[k], n[k][2], &count[k]) ||
            __builtin_add_overflow(all, count[k], &all))
            return false;
    return all < SIZE_MAX / 64;
}

const char *imp__measured_mend(enum imp__measured_table k, float *table, size_t n)
{
    const bool axis =
        k == IMP_MEASURED_THETA || k == IMP_MEASURED_PHI || k == IMP_MEASURED_WAVELENGTHS;
    for (size_t i = 0; i < n; i++) {
        if (!(fabsf(table[i]) <= VALUE_MAX)) return "has a number that is not finite";
        if (axis && i && !(table[i] > table[i - 1])) return "does not ascend";
        if (!axis && table[i] < 0) table[i] = 0;
    }
    return NULL;
}
