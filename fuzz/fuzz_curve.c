/* SPDX-License-Identifier: Apache-2.0
 *
 * Curves in files. Control points that are read are finite, their radii not negative, and
 * curves follow each other. */
#include "format/curve_file.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct imp_curve_data *c)
{
    if (c->n_points < 1 || c->n_curves < 1 || c->first[0] != 0) abort();
    if (c->first[c->n_curves] != c->n_points) abort();
    for (size_t k = 0; k < c->n_curves; k++)
        if (c->first[k + 1] <= c->first[k]) abort();
    for (size_t k = 0; k < 4 * c->n_points; k++)
        if (!isfinite(c->points[k]) || (k % 4 == 3 && c->points[k] < 0)) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    struct imp_arena keep;
    struct imp_curve_data curves;
    const struct imp_bytes text = {(unsigned char *)data, size, size};
    imp__arena_init(&keep, ctx);
    if (imp__curve_parse(ctx, &keep, "fuzz", &text, &curves) == IMP_OK) check(&curves);
    imp__arena_free(&keep);
    return 0;
}
