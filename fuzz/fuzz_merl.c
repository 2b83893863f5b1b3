/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured materials. What is read is finite and not negative, and its lobes can be
 * drawn. */
#include "format/merl_file.h"
#include "kind/bsdf/merl.h"
#include <math.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const struct imp_merl_data *t, struct imp_arena *keep)
{
    const size_t n = (size_t)t->n_half * (size_t)t->n_difference * (size_t)t->n_azimuth;
    for (size_t k = 0; k < 3 * n; k++)
        if (!(t->rho[k] >= 0 && isfinite(t->rho[k]))) abort();
    if (n > 4096) return;
    const size_t rows = imp__merl_lobes_rows(t);
    struct imp__merl_lobes l;
    l.row = imp__arena_take(keep, rows, sizeof *l.row);
    l.column = imp__arena_take(keep, rows * IMP_MERL_TURNS, sizeof *l.column);
    if (!l.row || !l.column) return;
    imp__merl_lobes_fill(t, &l);
    for (int k = 0; k < 32; k++) {
        const double a = k / 31.0 * 1.57079, u[2] = {k / 32.0, 1 - (k + 1) / 32.0};
        const imp_v3 wo = imp__v3(sin(a) * cos(k), sin(a) * sin(k), cos(a));
        const imp_v3 h = imp__merl_half_draw(t, &l, wo, u);
        const double p = imp__merl_half_pdf(t, &l, wo, h);
        double rho[3];
        if (!(fabs(imp__length(h) - 1) < 1e-9) || !(p >= 0 && isfinite(p))) abort();
        imp__merl_rho(t, wo, imp__v3(0, sin(u[0]), cos(u[0])), rho);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    struct imp_arena keep;
    struct imp_merl_data table;
    const struct imp_bytes file = {(unsigned char *)data, size, size};
    imp__arena_init(&keep, ctx);
    if (imp__merl_parse(ctx, &keep, "fuzz", &file, &table) == IMP_OK)
        check(&table, &keep);
    imp__arena_free(&keep);
    return 0;
}
