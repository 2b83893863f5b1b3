/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures from samples. Passes over all tiles come in sweeps of 1, 1, 2, 4, ... passes:
 * the first 2^k passes are a node of the tree over passes, so what is there and the next
 * sweep are its two children, and one set of sums is enough for a picture that can be had
 * at any time. */
#include "film_patch.h"
#include <float.h>
#include <stdio.h>
#include <string.h>

#define PASS_SPP       64
#define PASS_SETS      4 /* at least, through wide filters: errors are taken within a pass */
#define PASS_SPP_TIMED 4

/* Wide filters: tiles of a large picture are larger, so that their borders take less. */
#define MANY_TILES 1024
#define SIDE_MAX   32

/* Pixels of a picture whose means take seconds: who stops it in its first pass does not
 * want to wait for a part of it. */
#define LARGE_PICTURE 16e6

struct render {
    const struct imp_run *run;
    const struct imp_picture *picture;
    struct imp_patch patch;
    struct imp_tiles tiles;
    struct imp_film_sums sums;
    int spp, passes, pass_spp;
    /* Rows of the threads on cache lines of their own. */
    double *values;      /* [threads][n] */
    double *patches;     /* [threads][imp__patch_size] what one pixel sends in a
                        pass through a wide filter */
    int set;             /* samples that depend on each other, about; 1: none do */
    int64_t period;      /* samples of a pixel; 0: not known */
    int sets, pass_sets; /* in all of them, in a pass */
    double *set_values;  /* [threads][n] box: sums of a set */
    double *set_patches; /* [threads] as patches, of a set: sums of w and w v alone */
    int sweep_spp;       /* samples of a pixel in the sweep at work */
};

/* ---- One tile and pass ----------------------------------------------------------- */

/* Doubles from one thread's row of n to the next's: no cache line is written by two. */
static size_t apart(size_t n)
{
    const size_t line = IMP_CACHE_LINE / sizeof(double);
    return (n + line - 1) / line * line;
}

/* A picture holds floats. */
static IMP_COLD enum imp_drop cause_of(const double *value, int n)
{
    for (int c = 0; c < n; c++)
        if (isnan(value[c])) return IMP_DROP_NAN;
    return IMP_DROP_INFINITE;
}
static inline enum imp_drop beyond_float(const double *value, int n)
{
    bool fine = true;
    for (int c = 0; c < n; c++) fine &= fabs(value[c]) <= FLT_MAX;
    return imp_likely(fine) ? IMP_DROP_NONE : cause_of(value, n);
}

/* Sums of n values and of their squares. */
static inline void box_add(const double *restrict value, int n, double *restrict sums)
{
    for (int c = 0; c < n; c++) {
        sums[2 * c] += value[c];
        sums[2 * c + 1] += value[c] * value[c];
    }
}

static void sample_take(const struct render *r, struct imp_tile_worker *w,
                        struct imp_sample *s)
{
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    s->dropped = IMP_DROP_NONE;
    r->picture->sample(r->picture->payload, s);
    imp__arena_rewind(s->arena, mark);
    if (s->dropped == IMP_DROP_NONE) s->dropped = beyond_float(s->value, r->patch.n);
    if (imp_likely(s->dropped == IMP_DROP_NONE)) return;
    memset(s->value, 0, (size_t)r->patch.n * sizeof *s->value);
    imp__tile_drop(w, s->dropped, s->x, s->y, s->index);
}

/* A sample of a set; n > 0: the set's last, of n. With a box filter sets of all sizes
 * count the same: their sums are scaled to the mean size. */
static void set_take(const struct render *r, const struct imp_tile *t, int worker,
                     const struct imp_sample *s, double *own, double *patch, int n)
{
    const size_t width = IMP_WIDE_SUMS(r->patch.n);
    if (r->patch.border > 0) {
        double *set = r->set_patches + (size_t)worker * apart(imp__patch_size(&r->patch));
        const size_t side = (size_t)imp__patch_side(&r->patch);
        imp__patch_splat(&r->patch, t, set, s);
        for (size_t i = 0; n > 0 && i < side * side; i++)
            imp__patch_set(patch + i * width, set + i * width, r->patch.n);
        return;
    }
    double *sum = r->set_values + (size_t)worker * apart((size_t)r->patch.n);
    const double scale = r->sets > 0 && n > 0 ? (double)r->period / r->sets / n : 1;
    for (int c = 0; c < r->patch.n; c++) sum[c] += s->value[c];
    for (int c = 0; n > 0 && c < r->patch.n; c++) {
        const double all = scale * sum[c];
        own[2 * c] += all;
        own[2 * c + 1] += all * all;
        sum[c] = 0;
    }
}

/* First sample of a pass; passes end with sets. */
static int pass_begin(const struct render *r, int pass)
{
    if (r->set > 1 && r->sets > 0)
        return (int)((int64_t)r->sets * pass / r->passes * r->period / r->sets);
    return (int)imp_min((int64_t)pass * r->pass_spp, (int64_t)r->spp);
}

/* Number of sample k of a pixel. */
static inline int64_t sample_number(const struct render *r, int k)
{
    return r->picture->points
               ? imp__set_number(r->set, r->period, k)
               : r->picture->first + (int64_t)k * imp_max(r->picture->step, 1);
}

static bool is_sampled(const void *payload, int x, int y)
{
    const struct render *r = payload;
    return imp_likely(!r->picture->only) ||
           r->picture->only[(size_t)y * (size_t)r->patch.film->crop_w + (size_t)x];
}

/* The walks of a tile in bundles: NULL, where samples are none, or not of such walks. */
static struct imp_supply *supply_begin(const struct render *r, const struct imp_tile *t,
                                       struct imp_arena *arena, int s0, int s1,
                                       struct imp_supply *supply)
{
    const struct imp_supply_pixels pixels = {t->x0, t->y0, t->x1, t->y1, is_sampled, r};
    if (!r->picture->walks) return NULL;
    int64_t *numbers = imp__arena_take(arena, (size_t)(s1 - s0), sizeof *numbers);
    for (int k = s0; numbers && k < s1; k++) numbers[k - s0] = sample_number(r, k);
    return numbers && imp__supply_begin(r->picture->walks, arena, &pixels, numbers,
                                        s1 - s0, 1, supply)
               ? supply
               : NULL;
}

/* Pixel i of a tile, in the order in which its walks are made. False: there are not so many. */
static inline bool place_take(const struct imp_tile *t, int i, struct imp_sample *s)
{
    const int width = t->x1 - t->x0;
    const struct imp_supply *walks = s->supply;
    if (i >= (walks ? walks->n_pixels : width * (t->y1 - t->y0))) return false;
    s->x = walks ? walks->xy[i][0] : t->x0 + i % width;
    s->y = walks ? walks->xy[i][1] : t->y0 + i / width;
    return true;
}

static enum imp_status tile_work(const struct imp_tile *t, struct imp_tile_worker *w,
                                 void *result, void *payload)
{
    struct render *r = payload;
    const int s0 = pass_begin(r, (int)t->part), s1 = pass_begin(r, (int)t->part + 1);
    int n_sets = 0;
    int64_t first = 0, n_set = 0; /* of the set at work */
    const int n = r->patch.n;
    struct imp_supply walks;
    double *tile = result;
    double *patch = r->patches + (size_t)w->index * apart(imp__patch_size(&r->patch));
    struct imp_sample s = {.arena = &w->arena,
                           .value = r->values + (size_t)w->index * apart((size_t)n)};
    memset(tile, 0, imp__film_sums_pixels(&r->sums) * sizeof *tile);
    s.supply = supply_begin(r, t, s.arena, s0, s1, &walks);
    for (int i = 0; place_take(t, i, &s); i++) {
        if (!is_sampled(r, s.x, s.y)) continue;
        double *own = tile + (size_t)((s.y - t->y0) * r->patch.tile_side + s.x - t->x0) *
                                 2 * (size_t)n;
        for (int k = s0; k < s1; k++) {
            s.index = sample_number(r, k);
            if (s.supply) imp__supply_ready(s.supply);
            sample_take(r, w, &s);
            if (imp_unlikely(r->set > 1)) {
                if (k == s0 || k >= first + n_set)
                    imp__set_at(r->set, r->period, k, &first, &n_set);
                const bool last = k + 1 == first + n_set || k + 1 == s1;
                set_take(r, t, w->index, &s, own, patch, last ? (int)n_set : 0);
                n_sets += last;
                continue;
            }
            if (r->patch.border > 0) {
                imp__patch_splat(&r->patch, t, patch, &s);
                continue;
            }
            box_add(s.value, n, own);
        }
        if (r->patch.border > 0)
            imp__patch_add(&r->patch, t, patch, s.x, s.y, r->set > 1 ? n_sets : s1 - s0,
                           tile);
        n_sets = 0;
        const enum imp_status st = imp__tile_check(w);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

static void tile_add(void *into, const void *from, void *payload)
{
    const struct render *r = payload;
    const size_t n = imp__film_sums_pixels(&r->sums);
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < n; k++) a[k] += b[k];
}

static enum imp_status tile_take(size_t tile, const void *sum, void *payload)
{
    struct render *r = payload;
    imp__film_sums_add(&r->sums, tile, sum, r->sweep_spp);
    return IMP_OK;
}

/* ---- All ------------------------------------------------------------------------- */

static enum imp_status render_plan(struct render *r, imp_context *ctx)
{
    const struct imp_picture *p = r->picture;
    const struct imp_run *run = r->run;
    r->patch.film = &p->sensor->film;
    r->patch.n = p->n;
    r->patch.border = imp__film_border(r->patch.film);
    const int width = r->patch.film->crop_w, height = r->patch.film->crop_h;
    r->patch.tile_side = IMP_TILE_SIDE;
    while (r->patch.border > 0 && r->patch.tile_side < SIDE_MAX &&
           (double)width * height >=
               MANY_TILES * 4. * r->patch.tile_side * r->patch.tile_side)
        r->patch.tile_side *= 2;
    /* With a time limit and no count: until the time is up. */
    r->period = imp__walks_of(run, p->sensor);
    r->spp = r->period > 0 ? (int)r->period : 1 << 24;
    r->set = imp_max(p->set, 1);
    r->pass_spp = run->time_limit_s > 0 ? PASS_SPP_TIMED : PASS_SPP;
    r->sets = r->period > 0 ? (int)imp_max(r->period / r->set, (int64_t)1) : 0;
    r->pass_sets =
        imp_max(r->pass_spp / r->set, r->sets > 0 && r->patch.border > 0 ? PASS_SETS : 1);
    if (r->set > 1 && r->sets == 0) r->pass_spp = r->pass_sets * r->set;
    r->passes = r->set > 1 && r->sets > 0 ? imp_max(r->sets / r->pass_sets, 1)
                                          : (r->spp - 1) / r->pass_spp + 1;
    r->tiles =
        (struct imp_tiles){.ctx = ctx,
                           .run = run,
                           .width = width,
                           .height = height,
                           .margin = r->patch.film->sample_border ? r->patch.border : 0,
                           .side = r->patch.tile_side,
                           .work = tile_work,
                           .add = tile_add,
                           .take = tile_take,
                           .payload = r};
    const enum imp_status st = imp__tiles_create(&r->tiles);
    r->sums =
        (struct imp_film_sums){.ctx = ctx,
                               .width = width,
                               .height = height,
                               .n = p->n,
                               .n_films = imp_max(p->n_films, 1),
                               .border = r->patch.border,
                               .margin = r->tiles.margin,
                               .side = r->patch.tile_side,
                               .set = r->sets > 0 ? (double)r->period / r->sets : r->set,
                               .across = r->tiles.across,
                               .down = r->tiles.down};
    r->tiles.size = imp__film_sums_pixels(&r->sums) * sizeof(double);
    return st;
}

static enum imp_status buffers_create(struct render *r, imp_context *ctx)
{
    char what[80];
    snprintf(what, sizeof what, "a picture of %d x %d with %d channels", r->sums.width,
             r->sums.height, r->patch.n);
    enum imp_status st = imp__memory_check(ctx, imp__film_sums_bytes(&r->sums), what);
    if (st != IMP_OK) return st;
    r->values =
        imp__alloc(ctx, (size_t)ctx->threads, apart((size_t)r->patch.n) * sizeof(double));
    r->patches = imp__alloc(ctx, (size_t)ctx->threads,
                            apart(imp__patch_size(&r->patch)) * sizeof(double));
    if (r->set > 1) {
        r->set_values = imp__alloc(ctx, (size_t)ctx->threads,
                                   apart((size_t)r->patch.n) * sizeof(double));
        r->set_patches = imp__alloc(ctx, (size_t)ctx->threads,
                                    apart(imp__patch_size(&r->patch)) * sizeof(double));
    }
    if (!r->values || !r->patches || (r->set > 1 && (!r->set_values || !r->set_patches)))
        return imp__error(ctx, IMP_E_NOMEM, "no memory for samples of %d channels",
                          r->patch.n);
    return imp__film_sums_create(&r->sums);
}

/* Passes of the next sweep, a power of two that divides `done`. With a time limit, when
 * sums cannot be repeated anyway, they are shorter, so that tiles end with nearly equal
 * numbers of samples. */
static int sweep_passes(const struct render *r, int done)
{
    int n = 1;
    const int most = r->run->time_limit_s > 0 ? done / 4 : done;
    while (2 * n <= most && done % (2 * n) == 0) n *= 2;
    return imp_min(n, r->passes - done);
}

/* The spread of too few sets of points tells too little of a pixel's error. */
static bool has_errors(const struct render *r)
{
    return r->run->points != IMP_POINTS_WHOLE || !r->picture->points || r->sets > 3;
}
static void errors_drop(imp_film *film)
{
    imp__release(film->ctx, film->se);
    film->se = NULL;
}

/* Were errors of a wide filter taken within strata? */
static bool in_strata(const struct render *r)
{
    return r->patch.border > 0 &&
           (r->set > 1 && r->sets > 0 ? r->sets > 1
                                      : imp_min(r->spp, r->pass_spp) > r->set);
}

/* Between sweeps, show what is there. */
static enum imp_status show(struct render *r, imp_film *preview, int64_t spp)
{
    if (!preview) return IMP_OK;
    const enum imp_status st = imp__film_sums_look(&r->sums, in_strata(r), &preview);
    if (st != IMP_OK) return st;
    preview->spp = spp;
    r->run->preview(preview, r->run->preview_payload);
    return IMP_OK;
}

/* Passes over all tiles; how many samples every pixel got. preview: NULL, or room for
 * what is shown meanwhile. */
/* Without the margin, which a picture of some pixels alone has not. */
static double pixels_sampled(const struct render *r)
{
    const size_t all = (size_t)r->sums.width * (size_t)r->sums.height;
    size_t n = 0;
    if (!r->picture->only) return (double)all;
    for (size_t k = 0; k < all; k++) n += r->picture->only[k];
    return (double)n;
}

static enum imp_status render_run(struct render *r, imp_film *preview, int64_t *spp)
{
    enum imp_status st = IMP_OK;
    const bool timed = r->run->time_limit_s > 0;
    const double start = imp__now();
    const double pixels = pixels_sampled(r);
    const double sampled =
        pixels +
        2. * r->sums.margin * (r->sums.width + r->sums.height + 2. * r->sums.margin);
    for (int done = 0; done < r->passes && st == IMP_OK;) {
        const int n = sweep_passes(r, done);
        const int64_t before = pass_begin(r, done), after = pass_begin(r, done + n);
        r->sweep_spp = (int)(after - before);
        r->tiles.walks = sampled * (double)(timed ? after : (int64_t)r->spp);
        const struct imp_tiles_pass pass = {
            .stage = r->picture->stage,
            .rate_unit = "samples",
            .units = pixels * r->sweep_spp,
            .fraction_lo = (double)before / r->spp,
            .fraction_hi = (double)after / r->spp,
            .start_s = start,
            /* The first pass reaches every pixel whatever the time limit. */
            .deadline_s = timed && done > 0 ? start + r->run->time_limit_s : 0,
            .first_part = (size_t)done,
            .parts = (size_t)n,
            .per_tile = true};
        st = imp__tiles_run(&r->tiles, &pass);
        if (st == IMP_CANCELLED && r->tiles.late) {
            st = IMP_OK;
            break;
        }
        done += n;
        if (st == IMP_OK) *spp = after;
        if (st == IMP_OK && done < r->passes) st = show(r, preview, after);
    }
    if (st == IMP_OK || st == IMP_CANCELLED) {
        const double walks = pixels * (double)imp_max(*spp, (int64_t)r->pass_spp);
        const enum imp_status dropped =
            imp__drops_budget(r->tiles.ctx, &r->tiles.drops, r->run->drop_budget, walks,
                              imp__points_word(r->run));
        if (dropped != IMP_OK) st = dropped;
    }
    return st;
}

enum imp_status imp__picture_make(imp_context *ctx, const struct imp_picture *picture,
                                  const struct imp_run *run, imp_film **out)
{
    enum imp_status st = IMP_OK, ended;
    struct render r = {.picture = picture, .run = run};
    const int n_films = imp_max(picture->n_films, 1);
    int64_t spp = 0;
    imp_film *preview = NULL;
    imp_film **films = imp__alloc(ctx, (size_t)n_films, sizeof *films);
    if (!films) return imp__error(ctx, IMP_E_NOMEM, "no memory for films");
    IMP_TRY(render_plan(&r, ctx));
    for (int k = 0; k < n_films; k++)
        IMP_TRY(imp__film_describe(ctx, r.sums.width, r.sums.height, picture->names,
                                   &films[k]));
    IMP_TRY(buffers_create(&r, ctx));
    if (run->preview && n_films == 1 && has_errors(&r))
        IMP_TRY(imp__film_create(ctx, r.sums.width, r.sums.height, picture->names, true,
                                 &preview));
    ended = render_run(&r, preview, &spp);
    if (ended != IMP_CANCELLED) IMP_TRY(ended);
    if (imp__team_part(ctx) && imp__team_shares(ctx))
        IMP_TRY(ended == IMP_CANCELLED ? ended : IMP_PART);
    if (ended == IMP_CANCELLED && spp == 0 &&
        (double)r.sums.width * r.sums.height > LARGE_PICTURE) {
        memset(out, 0, (size_t)n_films * sizeof *out);
        IMP_TRY(ended);
    }
    IMP_TRY(imp__film_sums_finish(&r.sums, in_strata(&r), picture->weights, films));
    for (int k = 0; k < n_films; k++) {
        if (!has_errors(&r)) errors_drop(films[k]);
        films[k]->spp = spp;
        films[k]->sets = r.set > 1 ? spp / r.set : 0;
        films[k]->drops = r.tiles.drops;
        films[k]->dropped = imp__drops_total(&r.tiles.drops);
    }
    memcpy(out, films, (size_t)n_films * sizeof *films);
    memset(films, 0, (size_t)n_films * sizeof *films);
    st = ended;
out:
    for (int k = 0; k < n_films; k++) imp_film_destroy(films[k]);
    imp__release(ctx, films);
    imp_film_destroy(preview);
    if (r.sums.ctx) imp__film_sums_destroy(&r.sums);
    if (r.tiles.ctx) imp__tiles_destroy(&r.tiles);
    imp__release(ctx, r.values);
    imp__release(ctx, r.patches);
    imp__release(ctx, r.set_values);
    imp__release(ctx, r.set_patches);
    return st;
}
