/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of squared influences e_i over the samples of a picture, for pixels that share samples
 * (influence.h): tile by tile, with a cross term between neighbouring pixels. */
#include "influence.h"
#include "base/team.h"
#include "film/film_tiles.h"
#include "moved_pictures.h"
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

struct pass {
    const struct imp__functional *f;
    bool positions; /* the second pass: B in the place of A */
    size_t n;       /* numbers F */
    int border, spp;
    int set;             /* samples that depend on each other, about */
    int64_t period;      /* samples that are cut into such sets, of which spp are taken */
    int64_t sets, parts; /* sets of a pixel that are taken; items of a tile */
    struct imp_tiles tiles;
    double *store; /* [tiles][doubles of a result] */
};

/* A tile's result: variance [n], then cross [region^2][n]. */
static size_t region_side(const struct pass *p)
{
    /* One more than the filter reaches: a position may be rounded up to a pixel's end. */
    return (size_t)(p->tiles.side + 2 * p->border + 1);
}
static size_t result_size(const struct pass *p)
{
    const size_t side = p->positions || !p->f->W ? 0 : region_side(p);
    return p->n * (1 + side * side);
}

/* ---- One pixel -------------------------------------------------------------------- */

/* What the samples of a pixel send, and room for one sample. */
struct stratum {
    size_t side; /* pixels that its samples reach, along an axis */
    double *lane, *S;
    double *a, *u;                /* [n], [side^2] of the set of samples at work */
    double *sum, *square;         /* [n] of a over the sets */
    double *sum_u, *cross;        /* [side^2] of u, [side^2][n] of u a */
    double *value;                /* [n] s_p L_i of a pixel p, or s_p I_p */
    struct imp_taps across, down; /* of the sample */
};

static bool stratum_create(const struct pass *p, struct imp_arena *arena,
                           struct stratum *s)
{
    const struct imp__functional *f = p->f;
    const size_t C = (size_t)f->channels, K = f->derivatives ? f->tracer.active->n : 0;
    s->side = (size_t)(2 * p->border + 2);
    const size_t area = s->side * s->side;
    s->lane = imp__arena_take(arena, (K + 1) * C, sizeof(double));
    s->S = imp__arena_take(arena, p->n * C, sizeof(double));
    s->value = imp__arena_take(arena, p->n, sizeof(double));
    s->a = imp__arena_take(arena, p->n, sizeof(double));
    s->sum = imp__arena_take(arena, p->n, sizeof(double));
    s->square = imp__arena_take(arena, p->n, sizeof(double));
    s->u = imp__arena_take(arena, area, sizeof(double));
    s->sum_u = imp__arena_take(arena, area, sizeof(double));
    s->cross = imp__arena_take(arena, area * p->n, sizeof(double));
    return s->lane && s->S && s->value && s->a && s->sum && s->square && s->u &&
           s->sum_u && s->cross;
}

/* S [n][channels]: the sample's radiance, and the sums of its derivatives in groups; 0 if
 * its walk is dropped, which the picture has counted. */
static bool sample_walk(const struct imp__functional *f, struct stratum *t,
                        struct imp_sample *s, size_t n)
{
    const size_t C = (size_t)f->channels, K = f->derivatives ? f->tracer.active->n : 0;
    bool finite = true;
    s->value = t->lane;
    if (f->derivatives) {
        imp__moved_sample(f->moved, &f->tracer, s);
    } else {
        struct imp_walk walk;
        imp__sample_walk(s, &f->tracer, &walk);
        for (size_t c = 0; c < C; c++) t->lane[c] = walk.L[c];
    }
    if (s->dropped == IMP_DROP_MEMORY) return false;
    for (size_t k = 0; k < (K + 1) * C; k++) finite &= isfinite(t->lane[k]);
    memset(t->S, 0, n * C * sizeof *t->S);
    if (s->dropped != IMP_DROP_NONE || !finite) return true;
    memcpy(t->S, t->lane, C * sizeof *t->S);
    for (size_t k = 0; k < K; k++)
        for (size_t c = 0; c < C; c++)
            t->S[(size_t)(1 + f->group[k]) * C + c] += t->lane[(k + 1) * C + c];
    return true;
}

/* value [n] = sum over channels of s_p times the sample's, or the pictures' at p. */
static void pixel_value(const struct pass *p, struct stratum *t, size_t pixel)
{
    const struct imp__functional *f = p->f;
    const size_t C = (size_t)f->channels, stride = (size_t)f->picture->channels;
    const float *s = f->adjoint + pixel * C;
    memset(t->value, 0, p->n * sizeof *t->value);
    for (size_t c = 0; c < C; c++)
        t->value[0] += (double)s[c] * f->picture->mean[pixel * stride + c];
    for (size_t k = 0; f->derivatives && k < f->tracer.active->n; k++)
        for (size_t c = 0; c < C; c++)
            t->value[1 + f->group[k]] += (double)s[c] * f->films[k]->mean[pixel * C + c];
}
static void sample_value(const struct pass *p, struct stratum *t, size_t pixel)
{
    const size_t C = (size_t)p->f->channels;
    const float *s = p->f->adjoint + pixel * C;
    for (size_t g = 0; g < p->n; g++) {
        t->value[g] = 0;
        for (size_t c = 0; c < C; c++) t->value[g] += s[c] * t->S[g * C + c];
    }
}

static void sample_taps(const struct imp__functional *f, const struct imp_sample *s,
                        struct stratum *t)
{
    const struct imp_film_desc *film = f->film;
    if (!f->W) {
        t->across = (struct imp_taps){.first = s->x, .n = 1, .w = {1}};
        t->down = (struct imp_taps){.first = s->y, .n = 1, .w = {1}};
        return;
    }
    const int b = imp__film_border(film);
    imp__film_taps(&film->filter, s->px - film->crop_x, imp_max(s->x - b, 0),
                   imp_min(s->x + b + 1, film->crop_w - 1), &t->across);
    imp__film_taps(&film->filter, s->py - film->crop_y, imp_max(s->y - b, 0),
                   imp_min(s->y + b + 1, film->crop_h - 1), &t->down);
}

/* a += A_i or B_i, u += u_i. */
static bool sample_add(const struct pass *p, struct stratum *t, struct imp_sample *s)
{
    const struct imp__functional *f = p->f;
    if (p->positions)
        imp__walk_position(&f->tracer, s->x, s->y, s->index, &s->px, &s->py);
    else if (!sample_walk(f, t, s, p->n)) return false;
    sample_taps(f, s, t);
    for (int j = 0; j < t->down.n; j++)
        for (int i = 0; i < t->across.n; i++) {
            const int x = t->across.first + i, y = t->down.first + j;
            const size_t pixel = (size_t)y * (size_t)f->film->crop_w + (size_t)x;
            const double W = f->W ? f->W[pixel] : f->spp;
            if (W == 0) continue;
            const double u = t->down.w[j] * t->across.w[i] / W;
            t->u[(size_t)(y - s->y + p->border) * t->side +
                 (size_t)(x - s->x + p->border)] += u;
            if (p->positions) pixel_value(p, t, pixel);
            else sample_value(p, t, pixel);
            for (size_t g = 0; g < p->n; g++) t->a[g] += u * t->value[g];
        }
    return true;
}

/* The set of samples is complete. */
static void set_end(const struct pass *p, struct stratum *t, bool cross)
{
    for (size_t g = 0; g < p->n; g++) {
        t->sum[g] += t->a[g];
        t->square[g] += t->a[g] * t->a[g];
    }
    for (size_t k = 0; cross && k < t->side * t->side; k++) {
        if (t->u[k] == 0) continue;
        t->sum_u[k] += t->u[k];
        for (size_t g = 0; g < p->n; g++) t->cross[k * p->n + g] += t->u[k] * t->a[g];
        t->u[k] = 0;
    }
    memset(t->a, 0, p->n * sizeof *t->a);
}

/* Add a pixel's sums over m sets to the tile's. */
static void stratum_end(const struct pass *p, const struct imp_tile *tile, int x, int y,
                        int64_t m, struct stratum *t, double *result, bool cross)
{
    const double factor = m > 1 ? (double)m / (double)(m - 1) : INFINITY;
    const double each = 1. / (double)m;
    for (size_t g = 0; g < p->n; g++)
        result[g] += factor * fmax(t->square[g] - t->sum[g] * t->sum[g] * each, 0);
    for (size_t k = 0; cross && m > 1 && k < t->side * t->side; k++) {
        const size_t row = (size_t)(y - tile->y0) + k / t->side,
                     column = (size_t)(x - tile->x0) + k % t->side;
        double *to = result + p->n * (1 + row * region_side(p) + column);
        for (size_t g = 0; g < p->n; g++)
            to[g] += factor * (t->cross[k * p->n + g] - t->sum_u[k] * t->sum[g] * each);
    }
}

/* ---- A pass ------------------------------------------------------------------------- */

/* First sample of a part: parts end with sets. */
static int64_t part_begin(const struct pass *p, size_t part)
{
    const int64_t all = p->period / p->set;
    return p->sets * (int64_t)part / p->parts * p->period / all;
}

static enum imp_status tile_work(const struct imp_tile *tile, struct imp_tile_worker *w,
                                 void *result, void *payload)
{
    const struct pass *p = payload;
    const bool cross = !p->positions && p->f->W;
    const int64_t s0 = part_begin(p, tile->part), s1 = part_begin(p, tile->part + 1);
    struct stratum t;
    memset(result, 0, result_size(p) * sizeof(double));
    if (!stratum_create(p, &w->arena, &t))
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
                const bool good = sample_add(p, &t, &s);
                imp__arena_rewind(&w->arena, mark);
                if (!good)
                    return imp__error(p->tiles.ctx, IMP_E_NOMEM,
                                      "no memory to record a walk");
                if (k + 1 < first + n_set) continue;
                set_end(p, &t, cross);
                m++;
            }
            stratum_end(p, tile, x, y, m, &t, result, cross);
            const enum imp_status st = imp__tile_check(w);
            if (st != IMP_OK) return st;
        }
    return IMP_OK;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const size_t n = result_size(payload);
    const double *b = from;
    double *a = into;
    for (size_t k = 0; k < n; k++) a[k] += b[k];
}

static enum imp_status tile_take(size_t tile, const void *sum, void *payload)
{
    const struct pass *p = payload;
    const size_t n = result_size(p);
    memcpy(p->store + tile * n, sum, n * sizeof *p->store);
    return IMP_OK;
}

/* All tiles, in their order. */
static void tiles_gather(const struct pass *p, struct imp__influence *out)
{
    const int width = p->f->film->crop_w, height = p->f->film->crop_h;
    const size_t n = result_size(p), region = region_side(p);
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
static void sets_plan(const struct imp__functional *f, struct pass *p)
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
    struct pass p = {.f = f,
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
    p.tiles.size = result_size(&p) * sizeof(double);
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
    struct stratum t = {0};
    struct pass p = {.f = f, .n = (size_t)f->n_groups + 1};
    sets_plan(f, &p);
    const double samples = (double)f->spp / p.spp;
    t.value = imp__alloc(ctx, p.n, sizeof *t.value);
    if (!t.value) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for standard errors"));
    if (f->W) IMP_TRY(pass_run(ctx, f, run, true, &known));
    for (size_t g = 0; g < p.n; g++)
        se[g] = influence->variance[g] + (f->W ? known.variance[g] : 0);
    for (size_t q = 0; f->W && q < (size_t)f->film->crop_w * (size_t)f->film->crop_h;
         q++) {
        pixel_value(&p, &t, q);
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
