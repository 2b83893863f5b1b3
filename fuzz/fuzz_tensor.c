/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured materials of the RGL format. What is read is finite and not negative, its axes
 * ascend, and its densities can be drawn and inverted. */
#include "format/measured_file.h"
#include "kind/bsdf/measured.h"
#include "math/bilinear_warp.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void warp_check(struct imp_arena *keep, const struct imp_measured_data *d)
{
    const size_t grids = (size_t)d->n_phi * (size_t)d->n_theta;
    const size_t rows = (size_t)d->vndf[0], columns = (size_t)d->vndf[1];
    struct imp__bilinear_warp w = {.rows = d->vndf[0],
                                   .columns = d->vndf[1],
                                   .density = d->table[IMP_MEASURED_VNDF]};
    const struct imp__bilinear_mix mix = {2, {0, grids - 1}, {0.25, 0.75}};
    struct imp__bilinear_mix of_warp;
    w.row = imp__arena_take(keep, grids * rows, sizeof *w.row);
    w.column = imp__arena_take(keep, grids * rows * columns, sizeof *w.column);
    if (!w.row || !w.column) return;
    imp__bilinear_warp_fill(&w, grids);
    if (!imp__bilinear_warp_mix(&w, &mix, &of_warp)) return;
    for (int k = 0; k < 32; k++) {
        const double u[2] = {k / 32.0, 1 - (k + 1) / 32.0};
        double x[2], back[2];
        imp__bilinear_warp_draw(&w, &of_warp, u, x);
        const double p = imp__bilinear_warp_invert(&w, &of_warp, x, back);
        for (int c = 0; c < 2; c++)
            if (!(x[c] >= 0 && x[c] <= 1 && back[c] >= 0 && back[c] <= 1)) abort();
        if (!(p >= 0 && isfinite(p))) abort();
    }
}

static void check(struct imp_arena *keep, const struct imp_measured_data *d)
{
    size_t count[IMP_MEASURED_TABLES], all = 0;
    if (!imp__measured_counts(d, count)) abort();
    for (int k = 0; k < IMP_MEASURED_TABLES; k++) {
        if (!count[k] != !d->table[k]) abort();
        for (size_t i = 0; i < count[k]; i++) {
            const bool angle = k == IMP_MEASURED_PHI || k == IMP_MEASURED_THETA;
            const float x = d->table[k][i];
            if (!isfinite(x) || (x < 0 && !angle && k != IMP_MEASURED_WAVELENGTHS))
                abort();
        }
        all += count[k];
    }
    if (all < 1 << 14) warp_check(keep, d);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    struct imp_arena keep;
    struct imp_measured_data table;
    const struct imp_bytes file = {(unsigned char *)data, size, size};
    imp__arena_init(&keep, ctx);
    if (imp__measured_parse(ctx, &keep, "fuzz", &file, &table) == IMP_OK)
        check(&keep, &table);
    imp__arena_free(&keep);
    return 0;
}
