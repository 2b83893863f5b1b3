/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures from samples. Passes over all tiles come in sweeps of 1, 1, 2, 4, ... passes:
 * the first 2^k passes are a node of the tree over passes, so what is there and the next
 * sweep are its two children, and one set of sums is enough for a picture that can be had
 * at any time. */
#include "film_pass.h"
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

static enum imp_status render_plan(struct imp_passes *r, imp_context *ctx)
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
                           .work = imp__pass_work,
                           .add = imp__pass_add,
                           .take = imp__pass_take,
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

static enum imp_status buffers_create(struct imp_passes *r, imp_context *ctx)
{
    char what[80];
    snprintf(what, sizeof what, "a picture of %d x %d with %d channels", r->sums.width,
             r->sums.height, r->patch.n);
    enum imp_status st = imp__memory_check(ctx, imp__film_sums_bytes(&r->sums), what);
    if (st != IMP_OK) return st;
    r->values = imp__alloc(ctx, (size_t)ctx->threads,
                           imp__row_apart((size_t)r->patch.n) * sizeof(double));
    r->patches = imp__alloc(ctx, (size_t)ctx->threads,
                            imp__row_apart(imp__patch_size(&r->patch)) * sizeof(double));
    if (r->set > 1) {
        r->set_values = imp__alloc(ctx, (size_t)ctx->threads,
                                   imp__row_apart((size_t)r->patch.n) * sizeof(double));
        r->set_patches =
            imp__alloc(ctx, (size_t)ctx->threads,
                       imp__row_apart(imp__patch_size(&r->patch)) * sizeof(double));
    }
    if (!r->values || !r->patches || (r->set > 1 && (!r->set_values || !r->set_patches)))
        return imp__error(ctx, IMP_E_NOMEM, "no memory for samples of %d channels",
                          r->patch.n);
    return imp__film_sums_create(&r->sums);
}

/* Passes of the next sweep, a power of two that divides `done`. With a time limit, when
 * sums cannot be repeated anyway, they are shorter, so that tiles end with nearly equal
 * numbers of samples. */
static int sweep_passes(const struct imp_passes *r, int done)
{
    int n = 1;
    const int most = r->run->time_limit_s > 0 ? done / 4 : done;
    while (2 * n <= most && done % (2 * n) == 0) n *= 2;
    return imp_min(n, r->passes - done);
}

/* The spread of too few sets of points tells too little of a pixel's error. */
static bool has_errors(const struct imp_passes *r)
{
    return r->run->points != IMP_POINTS_WHOLE || !r->picture->points || r->sets > 3;
}
static void errors_drop(imp_film *film)
{
    imp__release(film->ctx, film->se);
    film->se = NULL;
}

/* Were errors of a wide filter taken within strata? */
static bool in_strata(const struct imp_passes *r)
{
    return r->patch.border > 0 &&
           (r->set > 1 && r->sets > 0 ? r->sets > 1
                                      : imp_min(r->spp, r->pass_spp) > r->set);
}

/* Between sweeps, show what is there. */
static enum imp_status show(struct imp_passes *r, imp_film *preview, int64_t spp)
{
    if (!preview) return IMP_OK;
    const enum imp_status st = imp__film_sums_look(&r->sums, in_strata(r), &preview);
    if (st != IMP_OK) return st;
    preview->spp = spp;
    r->run->preview(preview, r->run->preview_payload);
    return IMP_OK;
}

/* Without the margin, which a picture of some pixels alone has not. */
static double pixels_sampled(const struct imp_passes *r)
{
    const size_t all = (size_t)r->sums.width * (size_t)r->sums.height;
    size_t n = 0;
    if (!r->picture->only) return (double)all;
    for (size_t k = 0; k < all; k++) n += r->picture->only[k];
    return (double)n;
}

/* Passes over all tiles; how many samples every pixel got. preview: NULL, or room for
 * what is shown meanwhile. */
static enum imp_status render_run(struct imp_passes *r, imp_film *preview, int64_t *spp)
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
        const int64_t before = imp__pass_begin(r, done),
                      after = imp__pass_begin(r, done + n);
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
    struct imp_passes r = {.picture = picture, .run = run};
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
