/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures: samples to pixel means with standard errors. Work is cut into tiles and
 * passes, whose results are added in one order (base/pool.h). A box filter gives a sample
 * to its own pixel; wider filters weight it into all pixels within their radius
 * (docs/scene-format.md 10), and the pixel is the ratio  sum w v / sum w.
 *
 * Error of the ratio, with e = w (v - mean):  sum e^2 / (sum w)^2  if the samples were
 * spread over the filter at random. But every pixel sends the same number of them, and
 * what pixels differ by is no noise: beside a lamp the plain formula is too large many
 * times. So e is taken about its mean over the m samples that a pixel of the film sends
 * here in a pass (strata of Cochran, Sampling Techniques, 5.3 and 6.10):
 *     sum over strata  m/(m - 1) [sum e^2 - (sum e)^2/m] / (sum w)^2. */
#include "film_picture.h"
#include "base/pool.h"
#include <string.h>

#define TILE     8
#define PASS_SPP 64

/* Per pixel: sum w, sum w^2, then for each channel sum w v, sum w^2 v, sum w^2 v^2; the
 * squares and products about their strata's means where the filter is wide. */
#define SUMS(channels) (2 + 3 * (channels))

struct tile_result {
    double *sums; /* [(TILE + 2 border)^2][SUMS] */
    uint64_t dropped;
};

struct render {
    imp_context *ctx;
    const struct imp_run *run;
    double walks; /* planned */
    const struct imp_picture *picture;
    const struct imp_film_desc *film;
    int n;           /* channels */
    double *values;  /* [threads][n], rows on cache lines of their own */
    double *patches; /* [threads][stratum_side^2][SUMS] what one pixel sends in a pass;
                        likewise */
    int width, height, border; /* of the picture; reach of the filter in pixels */
    int margin;                /* extra pixels sampled on every side */
    int tiles_x, tiles_y, spp, passes, pass_spp;
    int first_pass;
    struct imp_arena *arenas; /* [threads] */
    struct tile_result *slots;
    double *sums; /* [height][width][SUMS] */
    uint64_t dropped;
};

struct region {
    int x0, y0, x1, y1, s0, s1;
};

static struct region item_region(const struct render *r, size_t item)
{
    const size_t tiles = (size_t)r->tiles_x * (size_t)r->tiles_y;
    const int pass = r->first_pass + (int)(item / tiles), tile = (int)(item % tiles);
    struct region g;
    g.x0 = tile % r->tiles_x * TILE - r->margin;
    g.y0 = tile / r->tiles_x * TILE - r->margin;
    g.x1 = imp_min(g.x0 + TILE, r->width + r->margin);
    g.y1 = imp_min(g.y0 + TILE, r->height + r->margin);
    g.s0 = pass * r->pass_spp;
    g.s1 = r->spp - g.s0 > r->pass_spp ? g.s0 + r->pass_spp : r->spp;
    return g;
}

enum imp_status imp__drops_check(imp_context *ctx, const struct imp_run *run,
                                 uint64_t dropped, double walks)
{
    const double budget = run->drop_budget > 0 ? run->drop_budget : 1e-4;
    if ((double)dropped <= 1 + budget * walks) return IMP_OK;
    return imp__error(
        ctx, IMP_E_PATHS,
        "%llu of %.0f walks were dropped: their values were not finite or "
        "negative, nothing ended them in %d steps, or they bent without end "
        "(render --pixel tells which)",
        (unsigned long long)dropped, walks, IMP_WALK_MAX);
}

static void accumulate(double *sums, double w, const double *value, int n)
{
    sums[0] += w;
    sums[1] += w * w;
    for (int c = 0; c < n; c++) {
        const double wv = w * value[c];
        sums[2 + 3 * c] += wv;
        sums[3 + 3 * c] += w * wv;
        sums[4 + 3 * c] += wv * wv;
    }
}

/* Pixels that samples of one pixel reach: `border` on each side, and one more, for a
 * position may be rounded up to the pixel's end. */
static int stratum_side(const struct render *r) { return 2 * r->border + 2; }
static size_t patch_size(const struct render *r)
{
    return (size_t)(stratum_side(r) * stratum_side(r)) * (size_t)SUMS(r->n);
}
/* Doubles from one thread's row of n to the next's: no cache line is written by two. */
static size_t apart(size_t n)
{
    const size_t line = IMP_CACHE_LINE / sizeof(double);
    return (n + line - 1) / line * line;
}

/* Weight a sample of pixel (x, y) into the pixels that the filter reaches. */
static void splat(const struct render *r, const struct region *g, double *patch, int x,
                  int y, double px, double py, const double *value)
{
    const struct imp_filter *f = &r->film->filter;
    const int n = r->n, b = r->border, side = stratum_side(r);
    struct imp_taps across, down;
    imp__film_taps(f, px - r->film->crop_x, imp_max(x, g->x0) - b,
                   imp_min(x + 1, g->x1 - 1) + b, &across);
    imp__film_taps(f, py - r->film->crop_y, imp_max(y, g->y0) - b,
                   imp_min(y + 1, g->y1 - 1) + b, &down);
    for (int j = 0; j < down.n; j++)
        for (int i = 0; i < across.n; i++) {
            const double w = down.w[j] * across.w[i];
            const int at = (down.first + j - y + b) * side + (across.first + i - x + b);
            if (w != 0) accumulate(patch + (size_t)at * (size_t)SUMS(n), w, value, n);
        }
}

/* Add what pixel (x, y) sent in m samples to the tile, whose corner is (x0, y0) minus the
 * border, and clear the patch. */
static void stratum_add(const struct render *r, const struct region *g, double *patch,
                        int x, int y, int m, double *tile)
{
    const int n = r->n, b = r->border, side = stratum_side(r), stride = TILE + 2 * b;
    const double each = m > 1 ? 1. / m : 0, factor = m > 1 ? m / (m - 1.) : 1;
    for (int j = 0; j < side; j++)
        for (int i = 0; i < side; i++) {
            double *from = patch + (size_t)(j * side + i) * (size_t)SUMS(n);
            if (from[1] == 0) continue;
            double *to = tile + (size_t)((y - g->y0 + j) * stride + x - g->x0 + i) *
                                    (size_t)SUMS(n);
            const double W = from[0];
            to[0] += W;
            to[1] += factor * (from[1] - W * W * each);
            for (int c = 0; c < n; c++) {
                const double wv = from[2 + 3 * c];
                to[2 + 3 * c] += wv;
                to[3 + 3 * c] += factor * (from[3 + 3 * c] - W * wv * each);
                to[4 + 3 * c] += factor * (from[4 + 3 * c] - wv * wv * each);
            }
            memset(from, 0, (size_t)SUMS(n) * sizeof *from);
        }
}

static enum imp_status tile_work(size_t item, int worker, int slot, void *payload)
{
    struct render *r = payload;
    const struct region g = item_region(r, item);
    const int n = r->n, stride = TILE + 2 * r->border;
    double *value = r->values + (size_t)worker * apart((size_t)n);
    double *patch = r->patches + (size_t)worker * apart(patch_size(r));
    struct tile_result *out = &r->slots[slot];
    uint64_t dropped = 0;
    memset(out->sums, 0, (size_t)(stride * stride) * (size_t)SUMS(n) * sizeof *out->sums);
    for (int y = g.y0; y < g.y1; y++)
        for (int x = g.x0; x < g.x1; x++) {
            double *own = out->sums + (size_t)((y - g.y0 + r->border) * stride + x -
                                               g.x0 + r->border) *
                                          (size_t)SUMS(n);
            for (int s = g.s0; s < g.s1; s++) {
                double px, py;
                struct imp_arena *arena = &r->arenas[worker];
                const struct imp_arena_mark mark = imp__arena_mark(arena);
                dropped += !r->picture->sample(r->picture->payload, arena, x, y, s, value,
                                               &px, &py);
                imp__arena_rewind(arena, mark);
                if (r->border == 0) accumulate(own, 1, value, n);
                else splat(r, &g, patch, x, y, px, py, value);
            }
            if (r->border > 0) stratum_add(r, &g, patch, x, y, g.s1 - g.s0, out->sums);
            /* A walk dropped for want of memory is not a walk with a bad value. */
            if (r->arenas[worker].failed)
                return imp__error(r->ctx, IMP_E_NOMEM,
                                  "no memory for the walks of a picture");
            /* Lost already: walks that nothing ends take long. */
            const enum imp_status st =
                imp__drops_check(r->ctx, r->run, dropped, r->walks);
            if (st != IMP_OK) return st;
        }
    out->dropped = dropped;
    return IMP_OK;
}

static enum imp_status tile_commit(size_t item, int slot, void *payload)
{
    struct render *r = payload;
    const struct region g = item_region(r, item);
    const int n_sums = SUMS(r->n), stride = TILE + 2 * r->border;
    const struct tile_result *in = &r->slots[slot];
    for (int y = imp_max(g.y0 - r->border, 0); y < imp_min(g.y1 + r->border, r->height);
         y++)
        for (int x = imp_max(g.x0 - r->border, 0);
             x < imp_min(g.x1 + r->border, r->width); x++) {
            const double *from = in->sums + (size_t)((y - g.y0 + r->border) * stride + x -
                                                     g.x0 + r->border) *
                                                (size_t)n_sums;
            double *to =
                r->sums + ((size_t)y * (size_t)r->width + (size_t)x) * (size_t)n_sums;
            for (int k = 0; k < n_sums; k++) to[k] += from[k];
        }
    r->dropped += in->dropped;
    return imp__drops_check(r->ctx, r->run, r->dropped, r->walks);
}

static void film_finish(const struct render *r, imp_film *film)
{
    const int n = r->n;
    const bool strata = r->border > 0 && imp_min(r->spp, r->pass_spp) > 1;
    for (size_t p = 0; p < (size_t)r->width * (size_t)r->height; p++) {
        const double *s = r->sums + p * (size_t)SUMS(n), W = s[0];
        if (r->picture->weights) r->picture->weights[p] = W;
        /* Without strata: n_eff - 1 degrees of freedom, n_eff = W^2/sum w^2. */
        const double n_eff = s[1] > 0 ? W * W / s[1] : 0;
        const double freedom = strata ? 1 : n_eff > 1 ? n_eff / (n_eff - 1) : INFINITY;
        for (int c = 0; c < n; c++) {
            const double mean = W != 0 ? s[2 + 3 * c] / W : 0;
            const double spread =
                s[4 + 3 * c] - 2 * mean * s[3 + 3 * c] + mean * mean * s[1];
            film->mean[p * (size_t)n + (size_t)c] = (float)mean;
            film->se[p * (size_t)n + (size_t)c] =
                isfinite(freedom) && W != 0
                    ? (float)(sqrt(fmax(0, spread) * freedom) / fabs(W))
                    : INFINITY;
        }
    }
    film->dropped = r->dropped;
}

static enum imp_status buffers_create(struct render *r, imp_context *ctx)
{
    const int slots = imp__pool_slots(ctx), n = r->n;
    r->values = imp__alloc(ctx, (size_t)ctx->threads, apart((size_t)n) * sizeof(double));
    const size_t stride = (size_t)(TILE + 2 * r->border);
    r->patches =
        imp__alloc(ctx, (size_t)ctx->threads, apart(patch_size(r)) * sizeof(double));
    r->arenas = imp__alloc(ctx, (size_t)ctx->threads, sizeof *r->arenas);
    r->slots = imp__alloc(ctx, (size_t)slots, sizeof *r->slots);
    r->sums = imp__alloc(ctx, (size_t)r->width * (size_t)r->height,
                         (size_t)SUMS(n) * sizeof *r->sums);
    bool fine = r->arenas && r->slots && r->sums && r->values && r->patches;
    for (int k = 0; fine && k < ctx->threads; k++) imp__arena_init(&r->arenas[k], ctx);
    for (int k = 0; fine && k < slots; k++) {
        r->slots[k].sums =
            imp__alloc(ctx, stride * stride, (size_t)SUMS(n) * sizeof(double));
        fine = r->slots[k].sums;
    }
    return fine ? IMP_OK
                : imp__error(ctx, IMP_E_NOMEM, "no memory for a picture of %d x %d x %d",
                             r->width, r->height, n);
}

static void buffers_destroy(struct render *r, imp_context *ctx)
{
    for (int k = 0; r->arenas && k < ctx->threads; k++) imp__arena_free(&r->arenas[k]);
    for (int k = 0; r->slots && k < imp__pool_slots(ctx); k++)
        imp__release(ctx, r->slots[k].sums);
    imp__release(ctx, r->arenas);
    imp__release(ctx, r->slots);
    imp__release(ctx, r->sums);
    imp__release(ctx, r->values);
    imp__release(ctx, r->patches);
}

static struct render render_plan(const struct imp_picture *p, const struct imp_run *run)
{
    struct render r = {.picture = p, .film = &p->sensor->film, .n = p->n};
    r.width = r.film->crop_w;
    r.height = r.film->crop_h;
    r.border = imp__film_border(r.film);
    r.margin = r.film->sample_border ? r.border : 0;
    r.tiles_x = (r.width + 2 * r.margin + TILE - 1) / TILE;
    r.tiles_y = (r.height + 2 * r.margin + TILE - 1) / TILE;
    /* With a time limit and no count: until the time is up. */
    r.spp = run->spp > 0 ? run->spp : run->time_limit_s > 0 ? 1 << 24 : p->sensor->spp;
    r.pass_spp = run->time_limit_s > 0 ? 4 : PASS_SPP;
    r.passes = (r.spp - 1) / r.pass_spp + 1;
    r.walks = (double)(r.width + 2 * r.margin) * (r.height + 2 * r.margin) * r.spp;
    return r;
}

enum imp_status imp__picture_make(imp_context *ctx, const struct imp_picture *picture,
                                  const struct imp_run *run, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *film = NULL;
    struct render r = render_plan(picture, run);
    r.ctx = ctx;
    r.run = run;
    IMP_TRY(imp__film_create(ctx, r.width, r.height, picture->names, true, &film));
    IMP_TRY(buffers_create(&r, ctx));

    /* The first pass reaches every pixel whatever the time limit. */
    const size_t tiles = (size_t)r.tiles_x * (size_t)r.tiles_y;
    const double start = imp__now(), pixels = (double)r.width * r.height;
    const bool timed = run->time_limit_s > 0;
    struct imp_loop loop = {.n_items = tiles * (size_t)(timed ? 1 : r.passes),
                            .work = tile_work,
                            .commit = tile_commit,
                            .payload = &r,
                            .progress = run->progress,
                            .progress_payload = run->progress_payload,
                            .stage = picture->stage,
                            .rate_unit = "samples",
                            .start_s = start,
                            .units = pixels * (timed ? r.pass_spp : r.spp)};
    size_t done = 0, passes_done;
    st = imp__parallel(ctx, &loop, &done);
    passes_done = done / tiles;
    if (st == IMP_OK && timed && r.passes > 1) {
        r.first_pass = 1;
        loop.n_items = tiles * (size_t)(r.passes - 1);
        loop.units = pixels * (r.spp - r.pass_spp);
        loop.deadline_s = start + run->time_limit_s;
        st = imp__parallel(ctx, &loop, &done);
        passes_done += done / tiles;
        if (st == IMP_CANCELLED && imp__now() >= loop.deadline_s) st = IMP_OK;
    }
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    const enum imp_status ended = st;

    film_finish(&r, film);
    film->spp = imp_min((int64_t)passes_done * r.pass_spp, (int64_t)r.spp);
    IMP_TRY(imp__drops_check(ctx, run, film->dropped,
                             pixels * (double)imp_max(film->spp, (int64_t)r.pass_spp)));
    st = ended;
    *out = film;
    film = NULL;
out:
    imp_film_destroy(film);
    buffers_destroy(&r, ctx);
    return st;
}
