/* SPDX-License-Identifier: Apache-2.0
 *
 * Volume files. What is read is finite, and there. */
#include "format/vol_file.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    struct imp_arena keep;
    struct imp_grid_data g;
    const struct imp_bytes bytes = {(unsigned char *)data, size, size};
    imp__arena_init(&keep, ctx);
    if (imp__vol_parse(ctx, &keep, "fuzz", &bytes, &g) == IMP_OK) {
        const size_t n = (size_t)g.n[0] * (size_t)g.n[1] * (size_t)g.n[2];
        if (g.n[0] < 1 || g.n[1] < 1 || g.n[2] < 1 || g.channels < 1) abort();
        for (size_t i = 0; i < n * (size_t)g.channels; i++)
            if (!isfinite(g.value[i])) abort();
    }
    imp__arena_free(&keep);
    return 0;
}
