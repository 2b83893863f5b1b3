/* SPDX-License-Identifier: Apache-2.0
 *
 * Photometric files. What is read ascends, is finite and in range. */
#include "format/ies_file.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct imp_ies_data *d)
{
    if (d->n_vertical < 2 || d->n_horizontal < 1) abort();
    const double lo = d->type == IMP_PHOTOMETRY_C ? 0 : -90;
    for (int k = 0; k < d->n_vertical; k++)
        if (!(d->vertical[k] >= (k ? d->vertical[k - 1] : lo) && d->vertical[k] <= 180))
            abort();
    for (int k = 0; k < d->n_horizontal; k++)
        if (!(d->horizontal[k] >= (k ? d->horizontal[k - 1] : lo) &&
              d->horizontal[k] <= 360))
            abort();
    for (int k = 0; k < d->n_tilts; k++)
        if (!(d->tilt[k] >= (k ? d->tilt[k - 1] : 0) && d->tilt[k] <= 180 &&
              d->tilt_factor[k] >= 0 && d->tilt_factor[k] <= 100))
            abort();
    for (int k = 0; k < d->n_vertical * d->n_horizontal; k++)
        if (!(d->candela[k] >= 0 && isfinite(d->candela[k]))) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    struct imp_arena keep;
    struct imp_ies_data table;
    const struct imp_bytes text = {(unsigned char *)data, size, size};
    imp__arena_init(&keep, ctx);
    if (imp__ies_parse(ctx, &keep, "fuzz", &text, &table) == IMP_OK) check(&table);
    struct imp_ies_data tilts = {.n_vertical = 2,
                                 .n_horizontal = 1,
                                 .vertical = (const double[]){0, 90},
                                 .horizontal = (const double[]){0},
                                 .candela = (const double[]){1, 1}};
    if (imp__ies_tilt_parse(ctx, &keep, "fuzz", &text, &tilts) == IMP_OK) check(&tilts);
    imp__arena_free(&keep);
    return 0;
}
