/* SPDX-License-Identifier: Apache-2.0
 *
 * A solution as a guide for walks. The quadtrees are cut at cells; each cell has
 *
 *   lights      what every emitter sends there over the links, seen part only
 *   directions  indirect radiance times cosine by direction: a histogram over the unit
 *               square that the concentric map takes to the cosine-weighted hemisphere
 *   leaving     its exitant radiance by direction, and the part of it that is not light
 *               from emitters, reflected for the first time: for roulette
 *
 * Cells with directions are wider, so that their histograms stay in the cache.
 * A cell's light over its links and those of all above it: of a link above, the quarter
 * that holds the cell. Every part is mixed with what a walk would do without it, so the
 * densities of walks are bounded from below. */
#include "scene/guide.h"
#include "elements.h"
#include "math/rng.h"
#include "math/warp.h"
#include <string.h>

#define SIDE       16 /* of the histogram */
#define BINS       (SIDE * SIDE)
#define CELLS_MAX  ((size_t)1 << 14)
#define LEVEL      5
#define DIR_LEVEL  3 /* of cells with directions: they have to stay in the cache */
#define ROSE       8 /* bins of leaving radiance across the disk of (x, y) */
#define GRID_MAX   ((size_t)1 << 22)
#define LIGHT_BASE 0.1 /* of the lights' choice is as without a guide */
#define SPREAD     16  /* points of a source that stand for it */

struct cells { /* elements at the level, and leaves above it */
    int level;
    size_t n;
    uint32_t *of;    /* [n_elements] or EL_NONE */
    uint32_t *where; /* [n] element */
};
struct finder { /* of a root that is a parallelogram: cells by a grid */
    imp_v3 origin, to_u, to_v;
    int side;
    uint32_t *grid; /* [side side], NULL: by the tree */
};
struct guide {
    struct imp_guide base;
    const imp_elements *e;
    int n_lights;
    double light_base;
    struct cells cells, wide; /* wide: with directions */
    struct finder *finder;    /* [n_roots] */
    uint32_t *grids;
    double *light;       /* [cells][n_lights] cumulative */
    double *pmf;         /* [n_lights] as the scene has them */
    float *cdf;          /* [wide][BINS] cumulative */
    float *share;        /* [wide] of continuations; 0: nothing arrives, or lobes */
    uint32_t *wide_of;   /* [cells] */
    float (*leaving)[2]; /* [cells][rose rose] luminance: all, and beyond the first */
    int rose;
};

/* ---- What walks ask ------------------------------------------------------------ */

static size_t cell_of(const struct guide *g, const struct imp_guide_place *p)
{
    return (size_t)((const uint32_t *)p->cell - g->cells.where);
}
static const float *cdf_of(const struct guide *g, const struct imp_guide_place *p)
{
    return g->cdf + (size_t)g->wide_of[cell_of(g, p)] * BINS;
}

static uint32_t cell_at(const struct guide *g, uint32_t root, imp_v3 p)
{
    const struct finder *f = &g->finder[root];
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

static bool find(const struct imp_guide *base, const struct imp_hit *hit,
                 const struct imp_surface *at, imp_v3 d, struct imp_guide_place *place)
{
    const struct guide *g = (const struct guide *)base;
    const imp_elements *e = g->e;
    int root = e->prim_root[hit->shape][hit->prim];
    if (root < 0) return false;
    if (imp__dot(e->roots[root].frame.n, d) > 0) root = e->roots[root].back;
    if (root < 0) return false;
    const uint32_t cell = cell_at(g, (uint32_t)root, at->p);
    if (cell == EL_NONE) return false;
    place->frame = &e->roots[root].frame;
    place->cell = &g->cells.where[cell];
    place->share = g->share ? (double)g->share[g->wide_of[cell]] : 0;
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
    const float *c = cdf_of(g, p);
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
    const float *c = cdf_of(g, p);
    const int k = bin_of(local);
    return ((double)c[k] - (k ? (double)c[k - 1] : 0)) * BINS * local[2] * IMP_INV_PI;
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
    const struct guide *g = (const struct guide *)base;
    const int bin = g->rose > 1 ? rose_bin(g->rose, imp__to_local(p->frame, w)) : 0;
    const float *l =
        g->leaving[cell_of(g, p) * (size_t)(g->rose * g->rose) + (size_t)bin];
    *beyond = (double)l[1];
    return (double)l[0];
}

static void cells_free(imp_context *ctx, struct cells *c)
{
    imp__release(ctx, c->of);
    imp__release(ctx, c->where);
}
static void destroy(struct imp_guide *base)
{
    struct guide *g = (struct guide *)base;
    imp_context *ctx = g->base.ctx;
    cells_free(ctx, &g->cells);
    cells_free(ctx, &g->wide);
    imp__release(ctx, g->finder);
    imp__release(ctx, g->grids);
    imp__release(ctx, g->light);
    imp__release(ctx, g->pmf);
    imp__release(ctx, g->cdf);
    imp__release(ctx, g->share);
    imp__release(ctx, g->wide_of);
    imp__release(ctx, g->leaving);
    imp__release(ctx, g);
}

/* ---- Filling it ---------------------------------------------------------------- */

struct build {
    struct guide *g;
    double share;
    double *scratch; /* [workers][2 BINS] */
    double *basis;   /* [rose rose][EL_N_MAX] at the middle of bins */
};

/* What is made of the links into a cell; NULL: not wanted. */
struct arriving {
    double *bins, *light; /* [BINS], [n_lights] */
    double *lamps;        /* [ch n] moments of the light of lamps */
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

/* Moments of a lamp's light over a link: what arrives at the samples s of `mask`, times
 * `part`, per area of the cell x. c [ch n]. */
static void lamp_moments(const imp_elements *e, const struct imp__element *x,
                         const struct imp__el_link *k, int mask, double part, double *c)
{
    const struct imp__el_root *r = el_root(e, x);
    const int n = el_n(e, r);
    imp_spec own[3] = {{0}};
    double h[EL_N_MAX];
    if (!(x->area > 0)) return;
    imp__el_emission(e, k, el_root(e, &e->elements[k->src]), own);
    for (int s = 0; s < 4; s++) {
        if (!(mask >> s & 1) || k->k[s] <= 0) continue;
        const imp_v3 w =
            imp__v3((double)k->w[0][s], (double)k->w[1][s], (double)k->w[2][s]);
        h[0] = e->basis.lead[0];
        if (n > 1) imp__basis_eval(&e->basis, imp__to_local(&r->frame, w), h);
        for (int ch = 0; ch < e->ch; ch++)
            for (int q = 0; q < n; q++)
                c[ch * n + q] += part * k->k[s] * own[ch][s] / x->area * h[q];
    }
}

/* Samples s of `mask` of a link, which may belong to an element above the cell: `part` of
 * what they bring is the cell's. */
static void arrive(const imp_elements *e, const struct imp__element *x, size_t at,
                   int mask, double part, struct arriving *to)
{
    const struct imp__el_link *k = &e->links[at];
    imp_spec emitted, l = carried(e, k, &emitted);
    const int em = emitter_of(e, el_root(e, &e->elements[k->src]));
    double power = 0, direct = 0;
    for (int s = 0; s < 4; s++) {
        if (!(mask >> s & 1)) continue;
        power += part * k->k[s] * l[s];
        direct += part * k->k[s] * emitted[s];
    }
    if (em < 0) power += direct;
    else if (to->light) to->light[em] += direct;
    if (em >= 0 && to->lamps) lamp_moments(e, x, k, mask, part, to->lamps);
    if (to->bins) deposit(e, x, k->src, power, (uint32_t)at, to->bins);
}

/* Links into element i and all below it. */
static void below(const imp_elements *e, const struct imp__element *x, uint32_t i,
                  struct arriving *to)
{
    for (size_t at = e->in_start[i]; at < e->in_start[i + 1]; at++)
        arrive(e, x, at, 15, 1, to);
    if (e->elements[i].child)
        for (uint32_t q = 0; q < 4; q++) below(e, x, e->elements[i].child + q, to);
}

/* Links into what is above: of each the quarter that the cell lies in. */
static void above(const imp_elements *e, const struct imp__element *x, uint32_t cell,
                  struct arriving *to)
{
    uint32_t child = cell;
    for (uint32_t i = x->parent; i != EL_NONE; child = i, i = e->elements[i].parent) {
        const uint32_t s = child - e->elements[i].child;
        const double part =
            imp__polygon_area(x->corners, x->v) /
            imp__polygon_area(e->elements[child].corners, e->elements[child].v);
        for (size_t at = e->in_start[i]; at < e->in_start[i + 1]; at++)
            if (e->links[at].k[s] > 0) arrive(e, x, at, 1 << s, part, to);
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

/* l = R c, and without what lamps give: R (c - c of lamps); by direction. */
static void leaving_set(const struct build *b, const struct imp__element *x,
                        const double *lamps, float (*out)[2])
{
    const struct guide *g = b->g;
    const imp_elements *e = g->e;
    const struct imp__el_material *m = el_material(e, x);
    const int n = el_n(e, el_root(e, x)), bins = g->rose * g->rose;
    double direct[EL_N_MAX], all[EL_N_MAX] = {0}, rest[EL_N_MAX] = {0};
    for (int c = 0; c < e->ch; c++) {
        const double *l = el_at(e, e->l, x) + c * n;
        imp__el_apply(&e->basis, n, m->r[c], lamps + c * n, direct);
        for (int q = 0; q < n; q++) {
            all[q] += e->lum[c] * l[q];
            rest[q] += e->lum[c] * (l[q] - direct[q]);
        }
    }
    for (int k = 0; k < bins; k++) {
        const double *h = b->basis + (size_t)k * EL_N_MAX;
        double sum = 0, part = 0;
        for (int q = 0; q < n; q++) {
            sum += all[q] * h[q];
            part += rest[q] * h[q];
        }
        /* Lobes ring below zero: at least a part of the mean over the hemisphere. */
        out[k][0] = (float)fmax(sum, 0.1 * all[0] * h[0]);
        out[k][1] =
            (float)imp_clamp(part, 0.1 * fmax(rest[0] * h[0], 0), (double)out[k][0]);
    }
}

static enum imp_status cell_work(size_t item, int worker, int slot, void *payload)
{
    const struct build *b = payload;
    struct guide *g = b->g;
    const imp_elements *e = g->e;
    const uint32_t index = g->cells.where[item];
    const struct imp__element *x = &e->elements[index];
    double *light = g->light + item * (size_t)g->n_lights, sum = 0, run = 0;
    double lamps[3 * EL_N_MAX] = {0};
    struct arriving to = {.light = light, .lamps = g->leaving ? lamps : NULL};
    (void)worker, (void)slot;
    below(e, x, index, &to);
    above(e, x, index, &to);
    if (g->leaving)
        leaving_set(b, x, lamps, g->leaving + item * (size_t)(g->rose * g->rose));
    for (int k = 0; k < g->n_lights; k++) sum += light[k];
    for (int k = 0; k < g->n_lights; k++) {
        const double p = sum > 0 ? light[k] / sum : g->pmf[k];
        run += g->light_base * g->pmf[k] + (1 - g->light_base) * p;
        light[k] = run;
    }
    if (g->n_lights > 0) light[g->n_lights - 1] = 1;
    return IMP_OK;
}

/* How flat a material's lobes are: of R all is in one number if it is Lambert's. Light
 * that arrives says nothing of lobes: where they are narrow, the BSDF draws better. */
static double flatness(const imp_elements *e, const struct imp__el_material *m)
{
    double one = 0, all = 0;
    for (int c = 0; c < e->ch; c++) {
        const double *r = m->r[c];
        one += e->lum[c] * imp__sqr(r[0]);
        for (int k = 0; k <= e->basis.order && m->n > 1; k++) {
            const int size = e->basis.size[k];
            for (int j = 0; j < size * size; j++)
                all += e->lum[c] * (k ? 2 : 1) * imp__sqr(r[j]);
            r += size * size;
        }
    }
    return m->n == 1 ? 1 : all > 0 ? one / all : 0;
}

static enum imp_status wide_work(size_t item, int worker, int slot, void *payload)
{
    const struct build *b = payload;
    struct guide *g = b->g;
    const imp_elements *e = g->e;
    const uint32_t index = g->wide.where[item];
    const struct imp__element *x = &e->elements[index];
    double *bins = b->scratch + (size_t)worker * 2 * BINS, *soft = bins + BINS;
    double sum = 0, run = 0;
    float *cdf = g->cdf + item * BINS;
    struct arriving to = {.bins = bins};
    (void)slot;
    const double share = b->share * flatness(e, el_material(e, x));
    if (share < 0.5 * b->share) return IMP_OK; /* not worth its densities */
    memset(bins, 0, BINS * sizeof *bins);
    below(e, x, index, &to);
    above(e, x, index, &to);
    smooth(bins, soft);
    for (int k = 0; k < BINS; k++) sum += soft[k];
    if (!(sum > 0)) return IMP_OK;
    for (int k = 0; k < BINS; k++) {
        run += soft[k];
        cdf[k] = (float)fmin(run / sum, 1);
    }
    cdf[BINS - 1] = 1;
    g->share[item] = (float)share;
    return IMP_OK;
}

/* ---- Cells --------------------------------------------------------------------- */

static bool is_cell(const imp_elements *e, const struct imp__element *x, int level)
{
    return (x->level == level || (x->level < level && !x->child)) &&
           el_root(e, x)->shape >= 0 && el_material(e, x)->n > 0;
}

/* The deepest level from `level` up with few enough. */
static enum imp_status cells_make(const imp_elements *e, int level, struct cells *c)
{
    for (;; level--) {
        c->n = 0;
        for (size_t i = 0; i < e->n_elements; i++)
            c->n += is_cell(e, &e->elements[i], level);
        if (c->n <= CELLS_MAX || level == 0) break;
    }
    c->level = level;
    c->of = imp__alloc(e->ctx, e->n_elements + 1, sizeof *c->of);
    c->where = imp__alloc(e->ctx, c->n + 1, sizeof *c->where);
    if (!c->of || !c->where)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    size_t n = 0;
    for (size_t i = 0; i < e->n_elements; i++) {
        const bool cell = is_cell(e, &e->elements[i], level);
        c->of[i] = cell ? (uint32_t)n : EL_NONE;
        if (cell) c->where[n++] = (uint32_t)i;
    }
    return IMP_OK;
}

/* Grids for parallelograms, as fine as their finest cell. */
static enum imp_status finders_make(struct guide *g)
{
    const imp_elements *e = g->e;
    size_t total = 0, at = 0;
    g->finder = imp__alloc(e->ctx, e->n_roots + 1, sizeof *g->finder);
    if (!g->finder) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    for (size_t k = 0; k < g->cells.n; k++) {
        const struct imp__element *x = &e->elements[g->cells.where[k]];
        const struct imp__el_root *r = el_root(e, x);
        struct finder *f = &g->finder[x->root];
        const imp_v3 u = r->v[1] - r->v[0], v = r->v[3] - r->v[0], n = imp__cross(u, v);
        const double size = imp__length(u) + imp__length(v), nn = imp__dot(n, n);
        if (r->corners != 4 || imp__length(r->v[2] - r->v[1] - v) > 1e-6 * size ||
            !(nn > 0))
            continue;
        total -= (size_t)(f->side * f->side);
        f->side = imp_max(f->side, 1 << x->level);
        total += (size_t)(f->side * f->side);
        f->origin = r->v[0];
        f->to_u = imp__cross(v, n) * (f->side / nn);
        f->to_v = imp__cross(n, u) * (f->side / nn);
    }
    if (total > GRID_MAX) return IMP_OK; /* by the tree then */
    g->grids = imp__alloc(e->ctx, total + 1, sizeof *g->grids);
    if (!g->grids) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    for (size_t r = 0; r < e->n_roots; r++) {
        struct finder *f = &g->finder[r];
        if (f->side == 0) continue;
        f->grid = g->grids + at;
        at += (size_t)(f->side * f->side);
        for (int j = 0; j < f->side; j++)
            for (int i = 0; i < f->side; i++)
                f->grid[j * f->side + i] =
                    g->cells.of[imp__el_find_level(e, (uint32_t)r, (i + 0.5) / f->side,
                                                   (j + 0.5) / f->side, g->cells.level)];
    }
    return IMP_OK;
}

static enum imp_status directions_make(struct build *b)
{
    enum imp_status st = IMP_OK;
    struct guide *g = b->g;
    const imp_elements *e = g->e;
    IMP_TRY(cells_make(e, imp_min(DIR_LEVEL, g->cells.level), &g->wide));
    g->cdf = imp__alloc(e->ctx, g->wide.n * BINS + 1, sizeof *g->cdf);
    g->share = imp__alloc(e->ctx, g->wide.n + 1, sizeof *g->share);
    g->wide_of = imp__alloc(e->ctx, g->cells.n + 1, sizeof *g->wide_of);
    b->scratch = imp__alloc(e->ctx, (size_t)imp_context_threads(e->ctx) * 2 * BINS,
                            sizeof *b->scratch);
    if (!g->cdf || !g->share || !g->wide_of || !b->scratch)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide"));
    for (size_t k = 0; k < g->cells.n; k++) {
        uint32_t i = g->cells.where[k];
        while (g->wide.of[i] == EL_NONE) i = e->elements[i].parent;
        g->wide_of[k] = g->wide.of[i];
    }
    const struct imp_loop loop = {.n_items = g->wide.n, .work = wide_work, .payload = b};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
out:
    return st;
}

static enum imp_status leaving_make(struct build *b)
{
    struct guide *g = b->g;
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
    if (!e || !out) return IMP_E_ARG;
    if (options) memcpy(&o, options, imp_min(options->size, sizeof o));
    if (!(o.share >= 0 && o.share < 1))
        return imp__error(e->ctx, IMP_E_ARG, "a share of %g is outside [0, 1)", o.share);
    if (!(o.roulette >= 0) || isinf(o.roulette))
        return imp__error(e->ctx, IMP_E_ARG, "roulette of strength %g", o.roulette);
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    struct build b = {.share = o.share};
    struct guide *g = imp__alloc(e->ctx, 1, sizeof *g);
    if (!g) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide");
    b.g = g;
    g->base = (struct imp_guide){.ctx = e->ctx,
                                 .find = find,
                                 .light = light_choose,
                                 .light_pmf = light_pmf,
                                 .draw = draw,
                                 .pdf = pdf,
                                 .expected = o.roulette > 0 ? expected : NULL,
                                 .roulette = o.roulette,
                                 .destroy = destroy};
    g->e = e;
    g->light_base = o.no_lights ? 1 : LIGHT_BASE;
    g->n_lights = e->scene->n_emitters;
    const size_t lights = (size_t)g->n_lights;
    IMP_TRY(cells_make(e, LEVEL, &g->cells));
    IMP_TRY(finders_make(g));
    if (o.share > 0) IMP_TRY(directions_make(&b));
    if (o.roulette > 0) IMP_TRY(leaving_make(&b));
    g->light = imp__alloc(e->ctx, g->cells.n * lights + 1, sizeof *g->light);
    g->pmf = imp__alloc(e->ctx, lights + 1, sizeof *g->pmf);
    if (!g->light || !g->pmf)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for a guide"));
    for (size_t k = 0; k < lights; k++)
        g->pmf[k] = e->scene->light_cdf[k] - (k ? e->scene->light_cdf[k - 1] : 0);
    const struct imp_loop loop = {
        .n_items = g->cells.n, .work = cell_work, .payload = &b};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    *out = &g->base;
    g = NULL;
out:
    imp__release(e->ctx, b.scratch);
    imp__release(e->ctx, b.basis);
    if (g) destroy(&g->base);
    return st;
}
