/* SPDX-License-Identifier: Apache-2.0
 *
 * Contents of a guide: radiance that arrives at a cell over links, by emitter and by
 * direction, and radiance that leaves it. */
#include "elements_guide.h"
#include "math/rng.h"
#include <string.h>

#define SPREAD 16 /* points that represent a source */

/* Sums over the links into a cell; NULL: not wanted. */
struct arriving {
    double *bins, *light; /* [GUIDE_BINS], [n_lights] */
    double *lamps;        /* [ch n] moments of the light of lamps */
};

/* Reflected radiance that a link carries, as luminance by sample; *emitted: the rest. */
static imp_spec carried(const imp_elements *e, const struct imp__el_link *k,
                        imp_spec *emitted)
{
    const struct imp__el_root *r = imp__el_root_of(e, &e->elements[k->src]);
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

int imp__guide_emitter(const imp_elements *e, const struct imp__el_root *r)
{
    return r->light != EL_DARK && r->shape >= 0 ? e->scene->shapes[r->shape]->emitter
                                                : -1;
}

/* Power `weight` that comes from element j to points of x, spread over directions. */
static void deposit(const imp_elements *e, const struct imp__element *x, uint32_t src,
                    double weight, uint32_t salt, double *bins)
{
    const struct imp__el_root *r = imp__el_root_of(e, x);
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
        const double away = -imp__dot(w, imp__el_root_of(e, j)->frame.n);
        part[i] = square > 0 && local[2] > 0 && away > 0 ? local[2] * away / square : 0;
        bin[i] = part[i] > 0 ? imp__guide_bin(local) : 0;
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
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const int n = imp__el_n(e, r);
    imp_spec own[3] = {{0}};
    double h[EL_N_MAX];
    if (!(x->area > 0)) return;
    imp__el_emission(e, k, imp__el_root_of(e, &e->elements[k->src]), own);
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
    const int em = imp__guide_emitter(e, imp__el_root_of(e, &e->elements[k->src]));
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

/* Links into the ancestors: the quarter of each that contains the cell. */
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

/* ---- Importance, over links the other way ------------------------------------------- */

/* Link `at` from the cell x, or `part` of it from an element above: of each sample the
 * importance that leaves the receiver's quarter. */
static void receive(const imp_elements *e, const struct imp__element *x, size_t at,
                    double part, double *bins)
{
    const struct imp__el_link *k = &e->links[at];
    const struct imp__element *j = &e->elements[k->rcv];
    imp_spec g[3];
    imp__el_ends(e, k, NULL, g);
    for (uint32_t s = 0; s < 4; s++) {
        double power = 0;
        for (int c = 0; c < e->ch; c++) power += part * k->k[s] * g[c][s];
        deposit(e, x, j->child ? j->child + s : k->rcv, power, (uint32_t)(4 * at + s),
                bins);
    }
}

static void receive_below(const imp_elements *e, const struct imp__element *x, uint32_t i,
                          double *bins)
{
    for (size_t at = e->out_start[i]; at < e->out_start[i + 1]; at++)
        receive(e, x, e->out[at], 1, bins);
    if (e->elements[i].child)
        for (uint32_t q = 0; q < 4; q++)
            receive_below(e, x, e->elements[i].child + q, bins);
}

static void receive_above(const imp_elements *e, const struct imp__element *x,
                          double *bins)
{
    for (uint32_t i = x->parent; i != EL_NONE; i = e->elements[i].parent) {
        const struct imp__element *y = &e->elements[i];
        const double part =
            imp__polygon_area(x->corners, x->v) / imp__polygon_area(y->corners, y->v);
        for (size_t at = e->out_start[i]; at < e->out_start[i + 1]; at++)
            receive(e, x, e->out[at], part, bins);
    }
}

/* What the sensor itself sends: the directions of its rays. */
static void receive_eye(const imp_elements *e, const struct imp__element *x, double *bins)
{
    const struct imp__el_root *r = imp__el_root_of(e, x);
    double eye = 0;
    for (int c = 0; c < e->ch; c++) eye += e->eye[c];
    for (uint32_t k = x->hit[0]; k < x->hit[1]; k++)
        bins[imp__guide_bin(imp__to_local(&r->frame, e->hits[k].w))] +=
            eye * e->hits[k].weight;
}

/* The points are few, and a cell is not a point. */
void imp__guide_smooth(int side, const double *in, double *out)
{
    for (int a = 0; a < side; a++)
        for (int b = 0; b < side; b++) {
            double sum = 0, weight = 0;
            for (int i = imp_max(a - 1, 0); i <= imp_min(a + 1, side - 1); i++)
                for (int j = imp_max(b - 1, 0); j <= imp_min(b + 1, side - 1); j++) {
                    const double w = (i == a ? 2 : 1) * (j == b ? 2 : 1);
                    sum += w * in[i * side + j];
                    weight += w;
                }
            out[a * side + b] = sum / weight;
        }
}

/* l = R c, and without what lamps give: R (c - c of lamps); by direction. */
static void leaving_set(const struct imp__guide_build *b, const struct imp__element *x,
                        const double *lamps, float (*out)[2])
{
    const struct imp__guide *g = b->g;
    const imp_elements *e = g->e;
    const struct imp__el_material *m = imp__el_material_of(e, x);
    const int n = imp__el_n(e, imp__el_root_of(e, x)), bins = g->rose * g->rose;
    double direct[EL_N_MAX], all[EL_N_MAX] = {0}, rest[EL_N_MAX] = {0};
    for (int c = 0; c < e->ch; c++) {
        const double *l = imp__el_at(e, e->l, x) + c * n;
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

enum imp_status imp__guide_cell_work(size_t item, int worker, int slot, void *payload)
{
    const struct imp__guide_build *b = payload;
    struct imp__guide *g = b->g;
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

void imp__guide_cumulate(const double *sum, int n, double base, float *cdf)
{
    double all = 0, run = 0;
    for (int k = 0; k < n; k++) all += sum[k];
    for (int k = 0; k < n; k++) {
        run += all > 0 ? base * all / n + (1 - base) * sum[k] : 1;
        cdf[k] = (float)fmin(run / (all > 0 ? all : n), 1);
    }
    cdf[n - 1] = 1;
}

/* How flat a material's lobes are: of R all is in one number if it is Lambert's. Light
 * that arrives does not resolve lobes: where they are narrow, the BSDF draws better. */
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

enum imp_status imp__guide_wide_work(size_t item, int worker, int slot, void *payload)
{
    const struct imp__guide_build *b = payload;
    struct imp__guide *g = b->g;
    const imp_elements *e = g->e;
    const uint32_t index = g->wide.where[item];
    const struct imp__element *x = &e->elements[index];
    double *bins = b->scratch + (size_t)worker * 2 * GUIDE_BINS,
           *soft = bins + GUIDE_BINS;
    double sum = 0;
    const struct imp__guide_directions *d = &g->directions[b->field];
    struct arriving to = {.bins = bins};
    (void)slot;
    const double share = b->share * flatness(e, imp__el_material_of(e, x));
    if (share < 0.5 * b->share) return IMP_OK; /* would cost more than it gains */
    memset(bins, 0, GUIDE_BINS * sizeof *bins);
    if (b->field == IMP_GUIDE_LIGHT) {
        below(e, x, index, &to);
        above(e, x, index, &to);
    } else {
        receive_below(e, x, index, bins);
        receive_above(e, x, bins);
        if (b->field == IMP_GUIDE_MET) receive_eye(e, x, bins);
    }
    imp__guide_smooth(GUIDE_SIDE, bins, soft);
    for (int k = 0; k < GUIDE_BINS; k++) sum += soft[k];
    if (!(sum > 0)) return IMP_OK;
    imp__guide_cumulate(soft, GUIDE_BINS, 0, d->cdf + item * GUIDE_BINS);
    d->share[item] = (float)share;
    return IMP_OK;
}
