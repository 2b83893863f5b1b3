/* SPDX-License-Identifier: Apache-2.0
 *
 * EULUMDAT files. What is read ascends, is finite and in range. */
#include "format/ldt_file.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct imp_ies_data *d)
{
    if (d->n_vertical < 2 || d->n_horizontal < 1) abort();
    for (int k = 0; k < d->n_vertical; k++)
        if (!(d->vertical[k] >= (k ? d->vertical[k - 1] : 0) && d->vertical[k] <= 180))
            abort();
    for (int k = 0; k < d->n_horizontal; k++)
        if (!(d->horizontal[k] >= (k ? d->horizontal[k - 1] : 0) &&
              d->horizontal[k] <= 360))
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
    if (imp__ldt_parse(ctx, &keep, "fuzz", &text, &table) == IMP_OK) check(&table);
    imp__arena_free(&keep);
    return 0;
}
