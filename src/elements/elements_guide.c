/* SPDX-License-Identifier: Apache-2.0
 *
 * Path guiding by a finite-element solution. The cells of the guide are the elements of
 * one level of the quadtrees, and the leaves above it. Each cell stores
 *
 *   lights      the irradiance that each emitter sends it over visible links: a discrete
 *               distribution for choosing a light
 *   directions  incident indirect radiance times cosine: a histogram over the unit square
 *               that the concentric map takes to the cosine-weighted hemisphere
 *   importance  the same histogram of the importance that arrives, for walks from the
 *               lights
 *   leaving     exitant radiance by direction, and the part of it that was reflected at
 *               least twice: for Russian roulette
 *
 * Where light walks begin is in guide_send.c. Histograms of directions are kept for a
 * coarser level, so that they fit into the cache. A cell receives over its own links and
 * over those of its ancestors; from an ancestor's link it receives the sample whose
 * quarter contains the cell. Every distribution is mixed with the one that is used
 * without a guide, which bounds the density from below.
 */
#include "elements_guide.h"
#include "math/rng.h"
#include "math/warp.h"
#include <string.h>

#define LEVEL      5
#define DIR_LEVEL  3 /* of cells with directions, so that all histograms fit the cache */
#define ROSE       8 /* bins of leaving radiance across the disk of (x, y) */
#define LIGHT_BASE 0.1 /* weight of the unguided distribution of lights */

/* ---- Functions that walks call ------------------------------------------------- */

static size_t cell_of(const struct imp__guide *g, const struct imp_guide_place *p)
{
    return (size_t)((const uint32_t *)p->cell - g->cells.where);
}
static const float *cdf_of(const struct imp__guide *g, const struct imp_guide_place *p)
{
    return g->directions[p->field].cdf + (size_t)g->wide_of[cell_of(g, p)] * GUIDE_BINS;
}

static uint32_t cell_at(const struct imp__guide *g, uint32_t root, imp_v3 p)
{
    const struct imp__guide_finder *f = &g->finder[root];
    double u, v;
    if (!f->grid) {
        imp__el_locate(&g->e->roots[root], p, &u, &v);
        return g->cells.of[imp__el_find_level(g->e, root, u, v, g->cells.level)];
    }
    const imp_v3 d = p - f->origin;
    const int i = (int)imp_clamp(imp__dot(d, f->to_u), 0.0, f->side - 1.0);
    const int j = (int)imp_clamp(imp__dot(d, f->to_v), 0.0, f->side - 1.0);
    return f->grid[j * f->side + i];
}

static bool find(const struct imp_guide *base, enum imp_guide_field field,
                 const struct imp_hit *hit, const struct imp_surface *at, imp_v3 d,
                 struct imp_guide_place *place)
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const imp_elements *e = g->e;
    int root = e->prim_root[hit->shape][hit->prim];
    if (root < 0) return false;
    if (imp__dot(e->roots[root].frame.n, d) > 0) root = e->roots[root].back;
    if (root < 0) return false;
    const uint32_t cell = cell_at(g, (uint32_t)root, at->p);
    if (cell == EL_NONE) return false;
    place->frame = &e->roots[root].frame;
    place->cell = &g->cells.where[cell];
    place->field = field;
    const float *share = g->directions[field].share;
    place->share = share ? (double)share[g->wide_of[cell]] : 0;
    return true;
}

static double light_pmf(const struct imp_guide *base, const struct imp_guide_place *p,
                        int light)
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const double *c = g->light + cell_of(g, p) * (size_t)g->n_lights;
    return c[light] - (light ? c[light - 1] : 0);
}

static int light_choose(const struct imp_guide *base, const struct imp_guide_place *p,
                        double u)
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const double *c = g->light + cell_of(g, p) * (size_t)g->n_lights;
    int lo = 0, hi = g->n_lights - 1;
    while (lo < hi) {
        const int middle = (lo + hi) / 2;
        if (u < c[middle]) hi = middle;
        else lo = middle + 1;
    }
    return lo;
}

double imp__guide_pick(const float *cdf, int n, double u, int *bin, double *rest)
{
    int lo = 0, hi = n - 1;
    while (lo < hi) {
        const int middle = (lo + hi) / 2;
        if (u < (double)cdf[middle]) hi = middle;
        else lo = middle + 1;
    }
    const double below = lo ? (double)cdf[lo - 1] : 0, width = (double)cdf[lo] - below;
    *bin = lo;
    *rest = width > 0 ? imp_clamp((u - below) / width, 0.0, 1 - 0x1p-30) : 0.5;
    return width;
}

static imp_v3 draw(const struct imp_guide *base, const struct imp_guide_place *p,
                   const double u[2])
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    int bin;
    double rest;
    imp__guide_pick(cdf_of(g, p), GUIDE_BINS, u[0], &bin, &rest);
    const double square[2] = {(bin / GUIDE_SIDE + rest) / GUIDE_SIDE,
                              (bin % GUIDE_SIDE + u[1]) / GUIDE_SIDE};
    return imp__to_world(p->frame, imp__cosine_hemisphere(square));
}

int imp__guide_bin(imp_v3 w)
{
    double u[2];
    imp__cosine_hemisphere_inverse(w, u);
    const int a = imp_clamp((int)(u[0] * GUIDE_SIDE), 0, GUIDE_SIDE - 1);
    const int b = imp_clamp((int)(u[1] * GUIDE_SIDE), 0, GUIDE_SIDE - 1);
    return a * GUIDE_SIDE + b;
}

static double pdf(const struct imp_guide *base, const struct imp_guide_place *p, imp_v3 w)
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const imp_v3 local = imp__to_local(p->frame, w);
    if (!(local[2] > 0)) return 0;
    const float *c = cdf_of(g, p);
    const int k = imp__guide_bin(local);
    return ((double)c[k] - (k ? (double)c[k - 1] : 0)) * GUIDE_BINS * local[2] *
           IMP_INV_PI;
}

static int rose_bin(int side, imp_v3 w)
{
    const int i = imp_clamp((int)((w[0] + 1) * (0.5 * side)), 0, side - 1);
    const int j = imp_clamp((int)((w[1] + 1) * (0.5 * side)), 0, side - 1);
    return j * side + i;
}
static double expected(const struct imp_guide *base, const struct imp_guide_place *p,
                       imp_v3 w, double *beyond)
{
    const struct imp__guide *g = (const struct imp__guide *)base;
    const int bin = g->rose > 1 ? rose_bin(g->rose, imp__to_local(p->frame, w)) : 0;
    const float *l =
        g->leaving[cell_of(g, p) * (size_t)(g->rose * g->rose) + (size_t)bin];
    *beyond = (double)l[1];
    return (double)l[0];
}

static void cells_free(imp_context *ctx, struct imp__guide_cells *c)
{
    imp__release(ctx, c->of);
    imp__release(ctx, c->where);
}
static void destroy(struct imp_guide *base)
{
    struct imp__guide *g = (struct imp__guide *)base;
    imp_context *ctx = g->base.ctx;
    cells_free(ctx, &g->cells);
    cells_free(ctx, &g->wide);
    imp__release(ctx, g->finder);
    imp__release(ctx, g->grids);
    imp__release(ctx, g->light);
    imp__release(ctx, g->pmf);
    for (int k = 0; k < IMP_GUIDE_FIELDS; k++) {
        imp__release(ctx, g->directions[k].cdf);
        imp__release(ctx, g->directions[k].share);
        imp__release(ctx, g->emission[k].point);
        imp__release(ctx, g->emission[k].direction);
    }
    imp__release(ctx, g->send);
    imp__release(ctx, g->wide_of);
    imp__release(ctx, g->leaving);
    imp__release(ctx, g);
    imp__context_drop(ctx);
}

/* ---- Making it ----------------------------------------------------------------- */

static enum imp_status field_make(struct imp__guide_build *b, enum imp_guide_field field)
{
    struct imp__guide *g = b->g;
    imp_context *ctx = g->e->ctx;
    struct imp__guide_directions *d = &g->directions[field];
    d->cdf = imp__alloc(ctx, g->wide.n * GUIDE_BINS + 1, sizeof *d->cdf);
    d->share = imp__alloc(ctx, g->wide.n + 1, sizeof *d->share);
    if (!d->cdf || !d->share)
        return imp__error(ctx, IMP_E_NOMEM, "out of memory for a guide");
    b->field = field;
    const struct imp_loop loop = {
        .n_items = g->wide.n, .work = imp__guide_wide_work, .payload = b};
    return imp__parallel(ctx, &loop, NULL);
}

static enum imp_status directions_make(struct imp__guide_build *b)
{
    enum imp_status st = IMP_OK;
    struct imp__guide *g = b->g;
    const imp_elements *e = g->e;
    IMP_TRY(imp__guide_cells(e, imp_min(DIR_LEVEL, g->cells.level), &g->wide));
    g->wide_of = imp__alloc(e->ctx, g->cells.n + 1, sizeof *g->wide_of);
    b->scratch = imp__alloc(e->ctx, (size_t)imp_context_threads(e->ctx) * 2 * GUIDE_BINS,
                            sizeof *b->scratch);
    if (!g->wide_of || !b->scratch)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide"));
    for (size_t k = 0; k < g->cells.n; k++) {
        uint32_t i = g->cells.where[k];
        while (g->wide.of[i] == EL_NONE) i = e->elements[i].parent;
        g->wide_of[k] = g->wide.of[i];
    }
    IMP_TRY(field_make(b, IMP_GUIDE_LIGHT));
    if (e->has_importance) IMP_TRY(field_make(b, IMP_GUIDE_CONNECTED));
    if (imp__guide_meter(e)) IMP_TRY(field_make(b, IMP_GUIDE_MET));
out:
    return st;
}

static enum imp_status leaving_make(struct imp__guide_build *b)
{
    struct imp__guide *g = b->g;
    const imp_elements *e = g->e;
    g->rose = 1; /* enough for Lambert */
    for (int k = 0; k < e->n_materials; k++)
        if (e->materials[k].n > 1) g->rose = ROSE;
    const size_t bins = (size_t)(g->rose * g->rose);
    g->leaving = imp__alloc(e->ctx, g->cells.n * bins + 1, sizeof *g->leaving);
    b->basis = imp__alloc(e->ctx, bins * EL_N_MAX, sizeof *b->basis);
    if (!g->leaving || !b->basis)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    for (int k = 0; k < (int)bins; k++) {
        double x = (2 * (k % g->rose) + 1.0) / g->rose - 1,
               y = (2 * (k / g->rose) + 1.0) / g->rose - 1;
        const double r = sqrt(x * x + y * y), in = r > 0.98 ? 0.98 / r : 1;
        x *= in, y *= in;
        imp__basis_eval(&e->basis, imp__v3(x, y, sqrt(fmax(0, 1 - x * x - y * y))),
                        b->basis + (size_t)k * EL_N_MAX);
    }
    return IMP_OK;
}

enum imp_status imp_elements_guide(const imp_elements *e,
                                   const struct imp_elements_guide_options *options,
                                   imp_guide **out)
{
    enum imp_status st = IMP_OK;
    struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, out, "out");
    IMP_OPTIONS(e->ctx, o, options, "options");
    IMP_FLOAT_MODE;
    IMP_READS(e->scene);
    if (!(o.share >= 0 && o.share < 1))
        return imp__error(e->ctx, IMP_E_ARG, "share %g is outside [0, 1)", o.share);
    if (!(o.roulette >= 0) || isinf(o.roulette))
        return imp__error(e->ctx, IMP_E_ARG, "roulette %g is not a number >= 0",
                          o.roulette);
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    struct imp__guide_build b = {.share = o.share};
    struct imp__guide *g = imp__alloc(e->ctx, 1, sizeof *g);
    if (!g) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    b.g = g;
    imp__context_hold(e->ctx);
    g->base = (struct imp_guide){.ctx = e->ctx,
                                 .find = find,
                                 .light = light_choose,
                                 .light_pmf = light_pmf,
                                 .draw = draw,
                                 .pdf = pdf,
                                 .expected = o.roulette > 0 ? expected : NULL,
                                 .roulette = o.roulette,
                                 .importance = e->has_importance,
                                 .destroy = destroy};
    g->e = e;
    g->light_base = o.no_lights ? 1 : LIGHT_BASE;
    g->n_lights = e->scene->n_emitters;
    const size_t lights = (size_t)g->n_lights;
    IMP_TRY(imp__guide_cells(e, LEVEL, &g->cells));
    IMP_TRY(imp__guide_finders(g));
    if (o.share > 0) IMP_TRY(directions_make(&b));
    if (o.roulette > 0) IMP_TRY(leaving_make(&b));
    g->light = imp__alloc(e->ctx, g->cells.n * lights + 1, sizeof *g->light);
    g->pmf = imp__alloc(e->ctx, lights + 1, sizeof *g->pmf);
    if (!g->light || !g->pmf)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide"));
    for (size_t k = 0; k < lights; k++)
        g->pmf[k] = e->scene->light_cdf[k] - (k ? e->scene->light_cdf[k - 1] : 0);
    const struct imp_loop loop = {
        .n_items = g->cells.n, .work = imp__guide_cell_work, .payload = &b};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    if (e->has_importance && !o.no_lights) IMP_TRY(imp__guide_send(g));
    *out = &g->base;
    g = NULL;
out:
    imp__release(e->ctx, b.scratch);
    imp__release(e->ctx, b.basis);
    if (g) destroy(&g->base);
    return st;
}
