/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of squared influences e_i over the samples of a picture, for pixels that share samples
 * (influence.h): tile by tile, with a cross term between neighbouring pixels. */
#include "base/team.h"
#include "influence_pixel.h"
#include <math.h>
#include <string.h>

/* Samples per pixel of the passes: a quarter of the picture's, but not so few that the
 * errors themselves become noisy. Two make a variance. */
#define ERROR_SHARE 4
#define ERROR_SPP   16
#define PART_SPP    64 /* of one item of work, about */

int imp__error_spp(int spp)
{
    return imp_max(2, imp_min(spp, imp_max(ERROR_SPP, spp / ERROR_SHARE)));
}

/* First sample of a part: parts end with sets. */
static int64_t part_begin(const struct imp__influence_pass *p, size_t part)
{
    const int64_t all = p->period / p->set;
    return p->sets * (int64_t)part / p->parts * p->period / all;
}

static enum imp_status tile_work(const struct imp_tile *tile, struct imp_tile_worker *w,
                                 void *result, void *payload)
{
    const struct imp__influence_pass *p = payload;
    const bool cross = !p->positions && p->f->W;
    const int64_t s0 = part_begin(p, tile->part), s1 = part_begin(p, tile->part + 1);
    struct imp__influence_pixel t;
    memset(result, 0, imp__influence_size(p) * sizeof(double));
    if (!imp__influence_pixel_create(p, &w->arena, &t))
        return imp__error(p->tiles.ctx, IMP_E_NOMEM, "no memory for standard errors");
    const size_t area = t.side * t.side;
    for (int y = tile->y0; y < tile->y1; y++)
        for (int x = tile->x0; x < tile->x1; x++) {
            int64_t first = s0, n_set = 0, m = 0;
            memset(t.a, 0, p->n * sizeof *t.a);
            memset(t.sum, 0, p->n * sizeof *t.sum);
            memset(t.square, 0, p->n * sizeof *t.square);
            memset(t.u, 0, area * sizeof *t.u);
            memset(t.sum_u, 0, area * sizeof *t.sum_u);
            if (cross) memset(t.cross, 0, area * p->n * sizeof *t.cross);
            for (int64_t k = s0; k < s1; k++) {
                struct imp_sample s = {.x = x, .y = y, .arena = &w->arena};
                const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
                if (k >= first + n_set) imp__set_at(p->set, p->period, k, &first, &n_set);
                s.index = imp__tracer_sets(&p->f->tracer)
                              ? imp__set_number(p->set, p->period, k)
                              : k;
                const bool good = imp__influence_pixel_add(p, &t, &s);
                imp__arena_rewind(&w->arena, mark);
                if (!good)
                    return imp__error(p->tiles.ctx, IMP_E_NOMEM,
                                      "no memory to record a walk");
                if (k + 1 < first + n_set) continue;
                imp__influence_pixel_set_end(p, &t, cross);
                m++;
            }
            imp__influence_pixel_end(p, tile, x, y, m, &t, result, cross);
            const enum imp_status st = imp__tile_check(w);
            if (st != IMP_OK) return st;
        }
    return IMP_OK;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const size_t n = imp__influence_size(payload);
    const double *b = from;
    double *a = into;
    for (size_t k = 0; k < n; k++) a[k] += b[k];
}

static enum imp_status tile_take(size_t tile, const void *sum, void *payload)
{
    const struct imp__influence_pass *p = payload;
    const size_t n = imp__influence_size(p);
    memcpy(p->store + tile * n, sum, n * sizeof *p->store);
    return IMP_OK;
}

/* All tiles, in their order. */
static void tiles_gather(const struct imp__influence_pass *p, struct imp__influence *out)
{
    const int width = p->f->film->crop_w, height = p->f->film->crop_h;
    const size_t n = imp__influence_size(p), region = imp__influence_side(p);
    for (size_t k = 0; k < imp__tiles_count(&p->tiles); k++) {
        const double *from = p->store + k * n;
        const int across = p->tiles.across, side = p->tiles.side;
        const int x0 = (int)(k % (size_t)across) * side - p->tiles.margin - p->border;
        const int y0 = (int)(k / (size_t)across) * side - p->tiles.margin - p->border;
        for (size_t g = 0; g < p->n; g++) out->variance[g] += from[g];
        if (n == p->n) continue;
        for (size_t j = 0; j < region * region; j++) {
            const int x = x0 + (int)(j % region), y = y0 + (int)(j / region);
            if (x < 0 || y < 0 || x >= width || y >= height) continue;
            double *to = out->cross + ((size_t)y * (size_t)width + (size_t)x) * p->n;
            for (size_t g = 0; g < p->n; g++) to[g] += from[p->n * (1 + j) + g];
        }
    }
}

/* Whole sets of the picture's, two at least: those of fewer points have another variance. */
static void sets_plan(const struct imp__functional *f, struct imp__influence_pass *p)
{
    const int least = imp__error_spp(f->spp);
    p->period = imp_max(f->spp, 2);
    p->set = imp_max(imp__tracer_set(&f->tracer, p->period), 1);
    const int64_t all = imp_max(p->period / p->set, (int64_t)1);
    p->sets = imp_min(imp_max((least - 1) / p->set + 1, (int64_t)2), all);
    p->spp = (int)(p->sets * p->period / all);
    p->parts = imp_max(p->sets / imp_max(PART_SPP / p->set, 2), (int64_t)1);
}

static enum imp_status pass_run(imp_context *ctx, const struct imp__functional *f,
                                const struct imp_run *run, bool positions,
                                struct imp__influence *out)
{
    enum imp_status st = IMP_OK;
    struct imp_run own = *run;
    struct imp__influence_pass p = {.f = f,
                                    .positions = positions,
                                    .n = (size_t)f->n_groups + 1,
                                    .border = f->W ? imp__film_border(f->film) : 0};
    sets_plan(f, &p);
    const int width = f->film->crop_w, height = f->film->crop_h;
    if (f->tracer.kept && (f->tracer.kept->source.set > 0 || f->tracer.kept->n < 2))
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           f->tracer.kept->n < 2
                               ? "one recorded walk of a pixel has no error: record more"
                               : "these walks were kept for losses, in sets of points; "
                                 "means and pictures need walks that are kept for "
                                 "pictures (importon record --pictures)"));
    const double walks =
        (double)p.spp * (width + 2. * f->margin) * (height + 2. * f->margin);
    own.spp = p.spp;
    own.time_limit_s = 0;
    p.tiles = (struct imp_tiles){.ctx = ctx,
                                 .run = &own,
                                 .walks = walks,
                                 .width = width,
                                 .height = height,
                                 .margin = f->margin,
                                 .work = tile_work,
                                 .add = tile_add,
                                 .take = tile_take,
                                 .payload = &p};
    IMP_TRY(imp__tiles_create(&p.tiles));
    p.tiles.size = imp__influence_size(&p) * sizeof(double);
    p.store = imp__alloc(ctx, imp__tiles_count(&p.tiles), p.tiles.size);
    out->variance = imp__alloc(ctx, p.n, sizeof *out->variance);
    if (!positions && f->W)
        out->cross =
            imp__alloc(ctx, (size_t)width * (size_t)height, p.n * sizeof *out->cross);
    if (!p.store || !out->variance || (!positions && f->W && !out->cross))
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for standard errors"));
    const struct imp_tiles_pass pass = {.stage = "errors",
                                        .rate_unit = "samples",
                                        .units = walks,
                                        .fraction_lo = positions ? .95 : 0,
                                        .fraction_hi = positions || !f->W ? 1 : .95,
                                        .start_s = imp__now(),
                                        .parts = (size_t)p.parts,
                                        .per_tile = true};
    IMP_TRY(imp__tiles_run(&p.tiles, &pass));
    if (imp__team_part(ctx) && imp__team_shares(ctx)) IMP_TRY(IMP_PART);
    tiles_gather(&p, out);
out:
    if (p.tiles.ctx) imp__tiles_destroy(&p.tiles);
    imp__release(ctx, p.store);
    return st;
}

enum imp_status imp__influence_sample(imp_context *ctx, const struct imp__functional *f,
                                      const struct imp_run *run,
                                      struct imp__influence *out)
{
    *out = (struct imp__influence){0};
    return pass_run(ctx, f, run, false, out);
}

enum imp_status imp__influence_errors(imp_context *ctx, const struct imp__functional *f,
                                      const struct imp_run *run,
                                      const struct imp__influence *influence, double *se)
{
    enum imp_status st = IMP_OK;
    struct imp__influence known = {0};
    struct imp__influence_pixel t = {0};
    struct imp__influence_pass p = {.f = f, .n = (size_t)f->n_groups + 1};
    sets_plan(f, &p);
    const double samples = (double)f->spp / p.spp;
    t.value = imp__alloc(ctx, p.n, sizeof *t.value);
    if (!t.value) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for standard errors"));
    if (f->W) IMP_TRY(pass_run(ctx, f, run, true, &known));
    for (size_t g = 0; g < p.n; g++)
        se[g] = influence->variance[g] + (f->W ? known.variance[g] : 0);
    for (size_t q = 0; f->W && q < (size_t)f->film->crop_w * (size_t)f->film->crop_h;
         q++) {
        imp__influence_pixel_value(&p, &t, q);
        for (size_t g = 0; g < p.n; g++)
            se[g] -= 2 * t.value[g] * influence->cross[q * p.n + g];
    }
    for (size_t g = 0; g < p.n; g++) se[g] = sqrt(fmax(se[g], 0) * samples) / f->norm;
out:
    imp__influence_free(ctx, &known);
    imp__release(ctx, t.value);
    return st;
}

void imp__influence_free(imp_context *ctx, struct imp__influence *influence)
{
    imp__release(ctx, influence->variance);
    imp__release(ctx, influence->cross);
    *influence = (struct imp__influence){0};
}
