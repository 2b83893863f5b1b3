/* SPDX-License-Identifier: Apache-2.0
 *
 * A solution as a guide for walks. The quadtrees are cut at cells; each cell has
 *
 *   lights      what every emitter sends there over the links, seen part only
 *   directions  indirect radiance times cosine by direction: a histogram over the unit
 *               square that the concentric map takes to the cosine-weighted hemisphere
 *   leaving     its exitant radiance in the basis, for roulette
 *
 * A cell's light over its links and those of all above it: of a link above, the quarter
 * that holds the cell. Every part is mixed with what a walk would do without it, so the
 * densities of walks are bounded from below. */
#include "scene/guide.h"
#include "elements.h"
#include "math/rng.h"
#include "math/warp.h"
#include <string.h>

#define SIDE       24 /* of the histogram */
#define BINS       (SIDE * SIDE)
#define CELLS_MAX  ((size_t)1 << 14)
#define LIGHT_BASE 0.1 /* of the lights' choice is as without a guide */
#define SPREAD     16  /* points of a source that stand for it */

struct guide {
    struct imp_guide base;
    const imp_elements *e;
    int n_lights, level;
    double share, light_base;
    size_t n_cells;
    uint32_t *cell; /* [n_elements] or EL_NONE */
    uint32_t *of;   /* [n_cells] element */
    double *light;  /* [n_cells][n_lights] cumulative */
    float *cdf;     /* [n_cells][BINS] cumulative; last 0: nothing arrives */
    double *pmf;    /* [n_lights] as the scene has them */
};

/* ---- What walks ask ------------------------------------------------------------ */

static size_t cell_of(const struct guide *g, const struct imp_guide_place *p)
{
    return (size_t)((const uint32_t *)p->cell - g->of);
}

static bool find(const struct imp_guide *base, const struct imp_hit *hit,
                 const struct imp_surface *at, imp_v3 d, struct imp_guide_place *place)
{
    const struct guide *g = (const struct guide *)base;
    const imp_elements *e = g->e;
    int root = e->prim_root[hit->shape][hit->prim];
    if (root < 0) return false;
    if (imp__dot(e->roots[root].frame.n, d) > 0) root = e->roots[root].back;
    if (root < 0) return false;
    const struct imp__el_root *r = &e->roots[root];
    double u, v;
    imp__el_locate(r, at->p, &u, &v);
    const uint32_t element = imp__el_find_level(e, (uint32_t)root, u, v, g->level);
    const uint32_t cell = g->cell[element];
    if (cell == EL_NONE) return false;
    place->frame = &r->frame;
    place->cell = &g->of[cell];
    place->share = g->cdf[(size_t)cell * BINS + BINS - 1] > 0 ? g->share : 0;
    return true;
}

static double light_pmf(const struct imp_guide *base, const struct imp_guide_place *p,
                        int light)
{
    const struct guide *g = (const struct guide *)base;
    const double *c = g->light + cell_of(g, p) * (size_t)g->n_lights;
    return c[light] - (light ? c[light - 1] : 0);
}

static int light_choose(const struct imp_guide *base, const struct imp_guide_place *p,
                        double u)
{
    const struct guide *g = (const struct guide *)base;
    const double *c = g->light + cell_of(g, p) * (size_t)g->n_lights;
    int lo = 0, hi = g->n_lights - 1;
    while (lo < hi) {
        const int middle = (lo + hi) / 2;
        if (u < c[middle]) hi = middle;
        else lo = middle + 1;
    }
    return lo;
}

static imp_v3 draw(const struct imp_guide *base, const struct imp_guide_place *p,
                   const double u[2])
{
    const struct guide *g = (const struct guide *)base;
    const float *c = g->cdf + cell_of(g, p) * BINS;
    int lo = 0, hi = BINS - 1;
    while (lo < hi) {
        const int middle = (lo + hi) / 2;
        if (u[0] < (double)c[middle]) hi = middle;
        else lo = middle + 1;
    }
    const double below = lo ? (double)c[lo - 1] : 0, width = (double)c[lo] - below;
    const double rest =
        width > 0 ? imp_clamp((u[0] - below) / width, 0.0, 1 - 0x1p-30) : 0.5;
    const double square[2] = {(lo / SIDE + rest) / SIDE, (lo % SIDE + u[1]) / SIDE};
    return imp__to_world(p->frame, imp__cosine_hemisphere(square));
}

static int bin_of(imp_v3 w)
{
    double u[2];
    imp__cosine_hemisphere_inverse(w, u);
    const int a = imp_clamp((int)(u[0] * SIDE), 0, SIDE - 1);
    const int b = imp_clamp((int)(u[1] * SIDE), 0, SIDE - 1);
    return a * SIDE + b;
}

static double pdf(const struct imp_guide *base, const struct imp_guide_place *p, imp_v3 w)
{
    const struct guide *g = (const struct guide *)base;
    const imp_v3 local = imp__to_local(p->frame, w);
    if (!(local[2] > 0)) return 0;
    const float *c = g->cdf + cell_of(g, p) * BINS;
    const int k = bin_of(local);
    return ((double)c[k] - (k ? (double)c[k - 1] : 0)) * BINS * local[2] * IMP_INV_PI;
}

static double expected(const struct imp_guide *base, const struct imp_guide_place *p,
                       imp_v3 w)
{
    const struct guide *g = (const struct guide *)base;
    const imp_elements *e = g->e;
    const struct imp__element *x = &e->elements[*(const uint32_t *)p->cell];
    const struct imp__el_root *r = el_root(e, x);
    const int n = el_n(e, r);
    double h[EL_N_MAX], sum = 0, mean = 0;
    h[0] = e->basis.lead[0];
    if (n > 1) imp__basis_eval(&e->basis, imp__to_local(p->frame, w), h);
    for (int c = 0; c < e->ch; c++) {
        const double *l = el_at(e, e->l, x) + c * n;
        for (int q = 0; q < n; q++) sum += e->lum[c] * l[q] * h[q];
        if (n) mean += e->lum[c] * l[0] * h[0];
    }
    return fmax(sum, 0.05 * mean); /* lobes ring below zero */
}

static void destroy(struct imp_guide *base)
{
    struct guide *g = (struct guide *)base;
    imp_context *ctx = g->base.ctx;
    imp__release(ctx, g->cell);
    imp__release(ctx, g->of);
    imp__release(ctx, g->light);
    imp__release(ctx, g->cdf);
    imp__release(ctx, g->pmf);
    imp__release(ctx, g);
}

/* ---- Filling it ---------------------------------------------------------------- */

struct build {
    struct guide *g;
    double *scratch; /* [workers][BINS] */
};

/* What a link carries that is not a light's own: luminance by sample. */
static imp_spec carried(const imp_elements *e, const struct imp__el_link *k,
                        imp_spec *emitted)
{
    const struct imp__el_root *r = el_root(e, &e->elements[k->src]);
    imp_spec all[3], own[3] = {{0}}, sum = imp__spec(0);
    imp__el_ends(e, k, all, NULL);
    imp__el_emission(e, k, r, own);
    *emitted = imp__spec(0);
    for (int c = 0; c < e->ch; c++) {
        sum += e->lum[c] * (all[c] - own[c]);
        *emitted += e->lum[c] * own[c];
    }
    for (int s = 0; s < 4; s++) sum[s] = fmax(sum[s], 0);
    return sum;
}

/* The emitter that a root shines for; -1: none, or an ambient term. */
static int emitter_of(const imp_elements *e, const struct imp__el_root *r)
{
    return r->light != EL_DARK && r->shape >= 0 ? e->scene->shapes[r->shape]->emitter
                                                : -1;
}

/* Power `weight` that comes from element j to points of x, spread over directions. */
static void deposit(const imp_elements *e, const struct imp__element *x, uint32_t src,
                    double weight, uint32_t salt, double *bins)
{
    const struct imp__el_root *r = el_root(e, x);
    const struct imp__element *j = &e->elements[src];
    double part[SPREAD], total = 0;
    int bin[SPREAD];
    if (!(weight > 0)) return;
    for (uint32_t i = 0; i < SPREAD; i++) {
        const struct imp_key key = imp__key(e->opt.seed + 3, salt, i);
        double s[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        double t[2] = {(i / 4 + imp__u01(key, 2)) / 4, (i % 4 + imp__u01(key, 3)) / 4};
        if (x->corners == 3 && s[0] + s[1] > 1) s[0] = 1 - s[0], s[1] = 1 - s[1];
        if (j->corners == 3 && t[0] + t[1] > 1) t[0] = 1 - t[0], t[1] = 1 - t[1];
        const imp_v3 d = imp__el_point(j->corners, j->v, t[0], t[1]) -
                         imp__el_point(x->corners, x->v, s[0], s[1]);
        const double square = imp__dot(d, d);
        const imp_v3 w = square > 0 ? d * (1 / sqrt(square)) : r->frame.n;
        const imp_v3 local = imp__to_local(&r->frame, w);
        const double away = -imp__dot(w, el_root(e, j)->frame.n);
        part[i] = square > 0 && local[2] > 0 && away > 0 ? local[2] * away / square : 0;
        bin[i] = part[i] > 0 ? bin_of(local) : 0;
        total += part[i];
    }
    for (int i = 0; i < SPREAD && total > 0; i++)
        bins[bin[i]] += weight * part[i] / total;
}

/* Links into element i and all below it. */
static void below(struct build *b, const struct imp__element *x, uint32_t i, double *bins,
                  double *light)
{
    const imp_elements *e = b->g->e;
    for (size_t at = e->in_start[i]; at < e->in_start[i + 1]; at++) {
        const struct imp__el_link *k = &e->links[at];
        imp_spec emitted, l = carried(e, k, &emitted);
        const int em = emitter_of(e, el_root(e, &e->elements[k->src]));
        double power = 0, direct = 0;
        for (int s = 0; s < 4; s++) {
            power += k->k[s] * l[s];
            direct += k->k[s] * emitted[s];
        }
        if (em >= 0) light[em] += direct;
        else power += direct;
        deposit(e, &e->elements[i], k->src, power, (uint32_t)at, bins);
    }
    if (e->elements[i].child)
        for (uint32_t q = 0; q < 4; q++)
            below(b, x, e->elements[i].child + q, bins, light);
}

/* Links into what is above: of each the quarter that the cell lies in. */
static void above(struct build *b, const struct imp__element *x, uint32_t cell,
                  double *bins, double *light)
{
    const imp_elements *e = b->g->e;
    uint32_t child = cell;
    for (uint32_t i = x->parent; i != EL_NONE; child = i, i = e->elements[i].parent) {
        const uint32_t s = child - e->elements[i].child;
        const double part =
            imp__polygon_area(x->corners, x->v) /
            imp__polygon_area(e->elements[child].corners, e->elements[child].v);
        for (size_t at = e->in_start[i]; at < e->in_start[i + 1]; at++) {
            const struct imp__el_link *k = &e->links[at];
            if (k->k[s] <= 0) continue;
            imp_spec emitted, l = carried(e, k, &emitted);
            const int em = emitter_of(e, el_root(e, &e->elements[k->src]));
            double power = part * k->k[s] * l[s];
            if (em >= 0) light[em] += part * k->k[s] * emitted[s];
            else power += part * k->k[s] * emitted[s];
            deposit(e, x, k->src, power, (uint32_t)at, bins);
        }
    }
}

/* A bin's neighbours get a part: the points are few, and a cell is not a point. */
static void smooth(const double *in, double *out)
{
    for (int a = 0; a < SIDE; a++)
        for (int b = 0; b < SIDE; b++) {
            double sum = 0, weight = 0;
            for (int i = imp_max(a - 1, 0); i <= imp_min(a + 1, SIDE - 1); i++)
                for (int j = imp_max(b - 1, 0); j <= imp_min(b + 1, SIDE - 1); j++) {
                    const double w = (i == a ? 2 : 1) * (j == b ? 2 : 1);
                    sum += w * in[i * SIDE + j];
                    weight += w;
                }
            out[a * SIDE + b] = sum / weight;
        }
}

static enum imp_status cell_work(size_t item, int worker, int slot, void *payload)
{
    struct build *b = payload;
    struct guide *g = b->g;
    const imp_elements *e = g->e;
    const uint32_t index = g->of[item];
    const struct imp__element *x = &e->elements[index];
    double *bins = b->scratch + (size_t)worker * 2 * BINS, *soft = bins + BINS;
    double *light = g->light + item * (size_t)g->n_lights, sum = 0, run = 0;
    float *cdf = g->cdf + item * BINS;
    (void)slot;
    memset(bins, 0, BINS * sizeof *bins);
    below(b, x, index, bins, light);
    above(b, x, index, bins, light);
    smooth(bins, soft);
    for (int k = 0; k < BINS; k++) sum += soft[k];
    for (int k = 0; k < BINS && sum > 0; k++) {
        run += soft[k];
        cdf[k] = (float)fmin(run / sum, 1);
    }
    if (sum > 0) cdf[BINS - 1] = 1;
    sum = run = 0;
    for (int k = 0; k < g->n_lights; k++) sum += light[k];
    for (int k = 0; k < g->n_lights; k++) {
        const double p = sum > 0 ? light[k] / sum : g->pmf[k];
        run += g->light_base * g->pmf[k] + (1 - g->light_base) * p;
        light[k] = run;
    }
    if (g->n_lights > 0) light[g->n_lights - 1] = 1;
    return IMP_OK;
}

/* The elements at the level, and leaves above it; the deepest level with few enough. */
static void cells_count(const imp_elements *e, struct guide *g)
{
    for (g->level = 5;; g->level--) {
        g->n_cells = 0;
        for (size_t i = 0; i < e->n_elements; i++) {
            const struct imp__element *x = &e->elements[i];
            const bool cell = x->level == g->level || (x->level < g->level && !x->child);
            g->n_cells += cell && el_root(e, x)->shape >= 0 && el_material(e, x)->n > 0;
        }
        if (g->n_cells <= CELLS_MAX || g->level == 0) return;
    }
}

enum imp_status imp_elements_guide(const imp_elements *e,
                                   const struct imp_elements_guide_options *options,
                                   imp_guide **out)
{
    enum imp_status st = IMP_OK;
    struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    if (!e || !out) return IMP_E_ARG;
    if (options) memcpy(&o, options, imp_min(options->size, sizeof o));
    if (!(o.share >= 0 && o.share < 1))
        return imp__error(e->ctx, IMP_E_ARG, "a share of %g is outside [0, 1)", o.share);
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    struct build b = {0};
    struct guide *g = imp__alloc(e->ctx, 1, sizeof *g);
    if (!g) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    b.g = g;
    g->base = (struct imp_guide){.ctx = e->ctx,
                                 .find = find,
                                 .light = light_choose,
                                 .light_pmf = light_pmf,
                                 .draw = draw,
                                 .pdf = pdf,
                                 .expected = o.roulette ? expected : NULL,
                                 .destroy = destroy};
    g->e = e;
    g->share = o.share;
    g->light_base = o.no_lights ? 1 : LIGHT_BASE;
    g->n_lights = e->scene->n_emitters;
    cells_count(e, g);
    const size_t lights = (size_t)g->n_lights;
    g->cell = imp__alloc(e->ctx, e->n_elements + 1, sizeof *g->cell);
    g->of = imp__alloc(e->ctx, g->n_cells + 1, sizeof *g->of);
    g->light = imp__alloc(e->ctx, g->n_cells * lights + 1, sizeof *g->light);
    g->cdf = imp__alloc(e->ctx, g->n_cells * BINS + 1, sizeof *g->cdf);
    g->pmf = imp__alloc(e->ctx, lights + 1, sizeof *g->pmf);
    b.scratch = imp__alloc(e->ctx, (size_t)imp_context_threads(e->ctx) * 2 * BINS,
                           sizeof *b.scratch);
    if (!g->cell || !g->of || !g->light || !g->cdf || !g->pmf || !b.scratch)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide"));
    for (size_t k = 0; k < lights; k++)
        g->pmf[k] = e->scene->light_cdf[k] - (k ? e->scene->light_cdf[k - 1] : 0);
    size_t n = 0;
    for (size_t i = 0; i < e->n_elements; i++) {
        const struct imp__element *x = &e->elements[i];
        const bool cell = x->level == g->level || (x->level < g->level && !x->child);
        g->cell[i] = EL_NONE;
        if (!cell || el_root(e, x)->shape < 0 || el_material(e, x)->n == 0) continue;
        g->cell[i] = (uint32_t)n;
        g->of[n++] = (uint32_t)i;
    }
    const struct imp_loop loop = {
        .n_items = g->n_cells, .work = cell_work, .payload = &b};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    *out = &g->base;
    g = NULL;
out:
    imp__release(e->ctx, b.scratch);
    if (g) destroy(&g->base);
    return st;
}
