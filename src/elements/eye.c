/* SPDX-License-Identifier: Apache-2.0
 *
 * The rays of the eye inside the hierarchy. They are ordered once, by root and by the
 * path down its tree, so that at every refinement the rays of an element are a range of
 * one array: importance from the eye and the radiance that rays see are loops over
 * ranges, leaf by leaf, without a search for the leaf of a ray. */
#include "elements.h"
#include <string.h>

enum { ELEMENTS_PER_ITEM = 32, RAYS_PER_ITEM = 1024, DIGIT = 10 };

/* ---- Order --------------------------------------------------------------------- */

/* Stable counting sort of the hits by a digit of their keys; start[b] becomes the end of
 * bucket b. */
static void order_by(size_t n, const uint32_t *key, int shift, uint32_t buckets,
                     size_t *start, const uint32_t *from, uint32_t *to)
{
    const uint32_t last = buckets - 1, mask = shift < 0 ? UINT32_MAX : last;
    shift = imp_max(shift, 0);
    memset(start, 0, ((size_t)buckets + 1) * sizeof *start);
    for (size_t k = 0; k < n; k++) start[imp_min(key[k] >> shift & mask, last) + 1]++;
    for (size_t b = 0; b < buckets; b++) start[b + 1] += start[b];
    for (size_t k = 0; k < n; k++)
        to[start[imp_min(key[from[k]] >> shift & mask, last)]++] = from[k];
}

struct moved {
    const struct imp__el_hit *from;
    const uint32_t *order;
    struct imp__el_hit *to;
    size_t n;
};
static enum imp_status move_work(size_t item, int worker, int slot, void *payload)
{
    const struct moved *m = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * RAYS_PER_ITEM, m->n);
    for (size_t k = item * RAYS_PER_ITEM; k < end; k++) m->to[k] = m->from[m->order[k]];
    return IMP_OK;
}

/* First of the hits [first, end) of an element at `level` whose digit there is >= q. */
static uint32_t digit_at(const imp_elements *e, uint32_t first, uint32_t end, int level,
                         uint32_t q)
{
    const int shift = 2 * (EL_LEVEL_MAX - 1 - level);
    while (first < end) {
        const uint32_t mid = first + (end - first) / 2;
        if ((e->hits[mid].path >> shift & 3) < q) first = mid + 1;
        else end = mid;
    }
    return first;
}

void imp__el_hits_share(const imp_elements *e, const struct imp__element *parent, int k,
                        struct imp__element *child)
{
    for (int side = 0; side < 2; side++)
        child->hit[side] = digit_at(e, parent->hit[0], parent->hit[1], parent->level,
                                    (uint32_t)(k + side));
}

enum imp_status imp__el_hits_sort(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    const size_t n = e->n_hits, roots = e->n_roots;
    uint32_t *order = imp__alloc_raw(e->ctx, 3 * n + 1, sizeof *order);
    size_t *start =
        imp__alloc_raw(e->ctx, imp_max(roots + 1, (size_t)1 << DIGIT) + 1, sizeof *start);
    struct imp__el_hit *sorted = imp__alloc_raw(e->ctx, n + 1, sizeof *sorted);
    imp__release(e->ctx, e->seen);
    e->seen = imp__alloc(e->ctx, n + 1, sizeof *e->seen);
    if (!order || !start || !sorted || !e->seen)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the picture's rays"));
    uint32_t *const key = order + 2 * n;
    for (size_t k = 0; k < n; k++) {
        order[k] = (uint32_t)k;
        key[k] = e->hits[k].path;
    }
    _Static_assert(2 * EL_LEVEL_MAX == 2 * DIGIT, "a path has two digits");
    order_by(n, key, 0, 1u << DIGIT, start, order, order + n);
    order_by(n, key, DIGIT, 1u << DIGIT, start, order + n, order);
    for (size_t k = 0; k < n; k++) key[k] = e->hits[k].root;
    order_by(n, key, -1, (uint32_t)roots + 1, start, order, order + n);
    struct moved m = {e->hits, order + n, sorted, n};
    const struct imp_loop loop = {.n_items = (n + RAYS_PER_ITEM - 1) / RAYS_PER_ITEM,
                                  .work = move_work,
                                  .payload = &m};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    imp__release(e->ctx, e->hits);
    e->hits = sorted;
    sorted = NULL;
    for (size_t r = 0; r < roots; r++) { /* start[r]: now the end of root r */
        struct imp__element *x = &e->elements[e->roots[r].element];
        x->hit[0] = (uint32_t)(r ? start[r - 1] : 0);
        x->hit[1] = (uint32_t)start[r];
    }
    for (size_t k = 0; k < e->n_elements; k++) /* children come after their parents */
        for (uint32_t q = 0; q < 4 && e->elements[k].child; q++)
            imp__el_hits_share(e, &e->elements[k], (int)q,
                               &e->elements[e->elements[k].child + q]);
out:
    imp__release(e->ctx, order);
    imp__release(e->ctx, start);
    imp__release(e->ctx, sorted);
    return st;
}

/* ---- Leaf by leaf -------------------------------------------------------------- */

/* The basis towards the eye for four hits from `first`, the last ones over again. */
static void basis_at(const imp_elements *e, const struct imp__element *x, uint32_t first,
                     int n, imp_spec *h)
{
    const struct imp_frame *f = &imp__el_root_of(e, x)->frame;
    imp_spec w[3];
    h[0] = imp__spec(e->basis.lead[0]);
    if (n <= 1) return;
    for (uint32_t s = 0; s < 4; s++) {
        const imp_v3 local =
            imp__to_local(f, e->hits[imp_min(first + s, x->hit[1] - 1)].w);
        for (int a = 0; a < 3; a++) w[a][s] = local[a];
    }
    imp__basis_eval4(&e->basis, w[0], w[1], w[2], h);
}

static void bin_leaf(imp_elements *e, const struct imp__element *x)
{
    const int n = imp__el_n(e, imp__el_root_of(e, x));
    imp_spec sum[EL_N_MAX], h[EL_N_MAX];
    if (n == 0 || x->hit[0] == x->hit[1]) return;
    memset(sum, 0, (size_t)n * sizeof *sum);
    for (uint32_t k = x->hit[0]; k < x->hit[1]; k += 4) {
        imp_spec weight = imp__spec(0);
        for (uint32_t s = 0; s < 4 && k + s < x->hit[1]; s++)
            weight[s] = e->hits[k + s].weight;
        basis_at(e, x, k, n, h);
        for (int q = 0; q < n; q++) sum[q] += weight * h[q];
    }
    for (int q = 0; q < n; q++) {
        const imp_spec s = sum[q];
        e->a[x->coef + (size_t)q] = (s[0] + s[1]) + (s[2] + s[3]);
    }
}

/* Mean over the channels of the radiance along the rays that end in a leaf. */
static void see_leaf(imp_elements *e, const struct imp__element *x)
{
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const int n = imp__el_n(e, r);
    const double *l = imp__el_at(e, e->l, x);
    imp_spec h[EL_N_MAX];
    for (uint32_t k = x->hit[0]; k < x->hit[1]; k += 4) {
        imp_spec sum = imp__spec(0);
        basis_at(e, x, k, n, h);
        for (int c = 0; c < e->ch; c++) {
            imp_spec value = imp__spec(0);
            for (int q = 0; q < n; q++) value += l[c * n + q] * h[q];
            sum += e->eye[c] * value;
        }
        for (uint32_t s = 0; s < 4 && k + s < x->hit[1]; s++) {
            const struct imp__el_hit *hit = &e->hits[k + s];
            const double lobe = imp__el_lobe(r, hit->w);
            double out = sum[s];
            for (int c = 0; c < e->ch && lobe > 0; c++)
                out += e->eye[c] * r->radiance[c] * lobe;
            e->seen[hit->ray] = out;
        }
    }
}

static enum imp_status bin_work(size_t item, int worker, int slot, void *payload)
{
    imp_elements *e = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * ELEMENTS_PER_ITEM, e->n_elements);
    for (size_t k = item * ELEMENTS_PER_ITEM; k < end; k++) {
        const struct imp__element *x = &e->elements[k];
        const size_t n = (size_t)imp__el_n(e, imp__el_root_of(e, x));
        memset(e->a + x->coef, 0, n * sizeof *e->a);
        if (!x->child) bin_leaf(e, x);
    }
    return IMP_OK;
}
static enum imp_status see_work(size_t item, int worker, int slot, void *payload)
{
    imp_elements *e = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * ELEMENTS_PER_ITEM, e->n_elements);
    for (size_t k = item * ELEMENTS_PER_ITEM; k < end; k++)
        if (!e->elements[k].child) see_leaf(e, &e->elements[k]);
    return IMP_OK;
}

static struct imp_loop by_element(imp_elements *e)
{
    return (struct imp_loop){.n_items = (e->n_elements + ELEMENTS_PER_ITEM - 1) /
                                        ELEMENTS_PER_ITEM,
                             .payload = e};
}

enum imp_status imp__el_bin(imp_elements *e)
{
    struct imp_loop loop = by_element(e);
    loop.work = bin_work;
    return imp__parallel(e->ctx, &loop, NULL);
}

enum imp_status imp__el_see(imp_elements *e)
{
    struct imp_loop loop = by_element(e);
    loop.work = see_work;
    return imp__parallel(e->ctx, &loop, NULL);
}

/* ---- Measurements -------------------------------------------------------------- */

/* Relative RMS change of the view's pixels, which are kept for the next time. */
static enum imp_status view_change(imp_elements *e, bool first, double *change)
{
    const size_t per = (size_t)(e->opt.rays * e->opt.rays), n = e->n_view / per;
    const double *seen = e->seen + e->first_view;
    double apart = 0, sum = 0;
    if (!e->picture) e->picture = imp__alloc(e->ctx, n + 1, sizeof *e->picture);
    if (!e->picture)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the picture");
    for (size_t p = 0; p < n; p++) {
        double mean = 0;
        for (size_t k = 0; k < per; k++) mean += seen[p * per + k];
        mean /= (double)per;
        sum += mean * mean;
        apart += imp__sqr(mean - e->picture[p]);
        e->picture[p] = mean;
    }
    if (!first) *change = fmax(*change, sum > 0 ? sqrt(apart / sum) : 0);
    return IMP_OK;
}

enum imp_status imp__el_look(imp_elements *e, double *change)
{
    enum imp_status st = IMP_OK;
    const bool first = e->n_log == 0;
    double *now = imp__alloc(e->ctx, e->n_sources, sizeof *now), apart = 0, sum = 0;
    if (!now) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for measurements"));
    *change = first ? NAN : 0;
    IMP_TRY(imp__el_measure_each(e, now));
    if (e->n_view) IMP_TRY(view_change(e, first, change));
    for (size_t k = 0; k < e->n_sources; k++) {
        const double w = fabs(e->weight[k]);
        sum += w * fabs(now[k]);
        apart += w * fabs(now[k] - e->each[k]);
        e->each[k] = now[k];
    }
    if (!first && e->opt.n_sources) *change = fmax(*change, sum > 0 ? apart / sum : 0);
out:
    imp__release(e->ctx, now);
    return st;
}
