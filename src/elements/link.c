/* SPDX-License-Identifier: Apache-2.0
 *
 * Links: four samples each, one for every quarter of the receiver. The kernel is
 * integrated exactly over the source (so that it stays bounded where patches touch) and
 * sampled at the fixed centres of the quarters (so that a closed furnace is exact); the
 * visibility ray ends at a random point of a quarter of the source, the quarters
 * permuted. */
#include "elements.h"
#include "math/rng.h"
#include <string.h>

/* Corners of `x` in front of the plane of `at`. */
static int in_front(const imp_elements *e, const struct imp__element *at,
                    const struct imp__element *x)
{
    const imp_v3 n = imp__el_root_of(e, at)->frame.n;
    const double least = 1e-9 * (at->radius + imp__length(x->centre - at->centre));
    int count = 0;
    for (int k = 0; k < x->corners; k++) count += imp__dot(x->v[k] - at->v[0], n) > least;
    return count;
}

bool imp__el_back_facing(const imp_elements *e, const struct imp__element *a,
                         const struct imp__element *b)
{
    return in_front(e, a, b) == 0 || in_front(e, b, a) == 0;
}

bool imp__el_sees(const imp_elements *e, const struct imp__el_root *rcv, imp_v3 x,
                  const struct imp__el_root *src, imp_v3 y)
{
    const imp_v3 d = y - x;
    const imp_v3 from = imp__offset(x, rcv->frame.n, d);
    const imp_v3 to = imp__offset(y, src->frame.n, -d);
    const imp_v3 ray = to - from;
    const double dist = imp__length(ray);
    if (!(dist > 0)) return true;
    if (imp__dot(ray, d) <= 0) return true; /* they all but touch */
    const imp_v3 unit = ray * (1 / dist);
    return !imp__occluded(e->scene, &from, &unit, 0, dist);
}

static imp_v3 mean_of(int n, const imp_v3 *v)
{
    imp_v3 sum = imp__v3(0, 0, 0);
    for (int k = 0; k < n; k++) sum += v[k];
    return sum * (1.0 / n);
}

/* A random point of polygon v, by area up to the distortion of a quadrilateral. */
static imp_v3 random_point(int corners, const imp_v3 *v, struct imp_key key, uint32_t dim)
{
    double s = imp__u01(key, dim), t = imp__u01(key, dim + 1);
    if (corners == 3 && s + t > 1) s = 1 - s, t = 1 - t;
    return imp__el_point(corners, v, s, t);
}

static imp_v3 source_point(const imp_elements *e, const struct imp__element *rcv,
                           imp_v3 x, const struct imp__element *src, int q,
                           struct imp_key key, int s)
{
    const imp_v3 n = imp__el_root_of(e, rcv)->frame.n;
    imp_v3 v[4];
    imp__el_quarter(src, q, v);
    imp_v3 y = random_point(src->corners, v, key, 16 * (uint32_t)s + 8);
    for (uint32_t k = 0; k < 3 && imp__dot(y - x, n) <= 0; k++)
        y = random_point(src->corners, src->v, key, 16 * (uint32_t)s + 10 + 2 * k);
    if (imp__dot(y - x, n) > 0) return y;
    int best = 0; /* only a corner sticks out in front of the receiver's plane */
    for (int k = 1; k < src->corners; k++)
        if (imp__dot(src->v[k] - src->v[best], n) > 0) best = k;
    for (double t = 0.5; t > 1e-3; t *= 0.5) {
        y = src->v[best] + (src->centre - src->v[best]) * t;
        if (imp__dot(y - x, n) > 0) break;
    }
    return y;
}

void imp__el_link_make(const imp_elements *e, uint32_t src, uint32_t rcv,
                       struct imp__el_link *out, bool *keep, int64_t *rays)
{
    const struct imp__element *i = &e->elements[rcv], *j = &e->elements[src];
    const struct imp__el_root *ri = imp__el_root_of(e, i), *rj = imp__el_root_of(e, j);
    const struct imp_key key = imp__key(e->opt.seed, rcv, src);
    int order[4] = {0, 1, 2, 3};
    *keep = false;
    *out = (struct imp__el_link){.src = src, .rcv = rcv};
    const int front_i = in_front(e, i, j), front_j = in_front(e, j, i);
    if (front_i == 0 || front_j == 0 || i->area == 0 || j->area == 0) return;
    for (int s = 3; s > 0; s--) {
        const int other = (int)(imp__u01(key, (uint32_t)s) * (s + 1));
        const int t = order[s];
        order[s] = order[other];
        order[other] = t;
    }
    for (int s = 0; s < 4; s++) {
        imp_v3 v[4];
        imp__el_quarter(i, s, v);
        const imp_v3 x = mean_of(i->corners, v);
        const double q =
            imp__polygon_factor(x, ri->frame.n, j->corners, j->v, rj->frame.n);
        const imp_v3 y = source_point(e, i, x, j, order[s], key, s);
        const imp_v3 d = y - x;
        const double length = imp__length(d);
        const imp_v3 w = length > 0 ? d * (1 / length) : ri->frame.n;
        for (int a = 0; a < 3; a++) out->w[a][s] = (float)w[a];
        if (q <= 0) continue;
        ++*rays;
        if (imp__el_sees(e, ri, x, rj, y))
            out->k[s] = q * imp__polygon_area(i->corners, v);
    }
    /* Kept even if no ray arrives: dropping those loses energy (about 0.3 % of the
     * picture here), and the oracle uses their unoccluded kernel. */
    *keep = true;
}

double imp__el_link_bound(const imp_elements *e, const struct imp__el_link *link)
{
    const struct imp__element *i = &e->elements[link->rcv], *j = &e->elements[link->src];
    const imp_v3 n = imp__el_root_of(e, i)->frame.n,
                 facing = imp__el_root_of(e, j)->frame.n;
    double most = 0;
    for (int k = 0; k < 4 + i->corners; k++) {
        imp_v3 v[4], x;
        if (k < 4) {
            imp__el_quarter(i, k, v);
            x = mean_of(i->corners, v);
        } else {
            x = i->v[k - 4] + (i->centre - i->v[k - 4]) * 1e-3;
        }
        most = imp_max(imp__polygon_factor(x, n, j->corners, j->v, facing), most);
    }
    return most * i->area / 4;
}

size_t imp__el_bytes(const imp_elements *e)
{
    return e->cap_links * sizeof *e->links + e->cap_out * sizeof *e->out +
           (e->cap_in + e->cap_out_start) * sizeof *e->in_start +
           e->cap_elements * sizeof *e->elements +
           (e->cap_l + e->cap_g + e->cap_c + e->cap_b + e->cap_above + e->cap_a +
            e->cap_value) *
               sizeof(double) +
           e->n_hits * (sizeof *e->hits + sizeof *e->seen) + e->arena.total;
}

/* ---- The first links: all pairs of polygons that may see each other ------------ */

static bool is_source(const imp_elements *e, const struct imp__el_root *r)
{
    return r->shape >= 0 && (e->materials[r->material].n > 0 || r->light != EL_DARK);
}

struct first {
    imp_elements *e;
    struct {
        struct imp__el_link *links;
        size_t n;
        int64_t rays;
    } * slot;
    size_t total;
    bool count_only;
};

static enum imp_status first_work(size_t item, int worker, int slot, void *payload)
{
    struct first *f = payload;
    imp_elements *e = f->e;
    const struct imp__el_root *r = &e->roots[item];
    (void)worker;
    f->slot[slot].n = 0;
    f->slot[slot].rays = 0;
    if (imp__el_n(e, r) == 0) return IMP_OK;
    for (size_t j = 0; j < e->n_roots; j++) {
        const uint32_t src = e->roots[j].element;
        bool keep =
            !(j == item || e->elements[src].area == 0 ||
              e->elements[r->element].area == 0 || !is_source(e, &e->roots[j]) ||
              imp__el_back_facing(e, &e->elements[src], &e->elements[r->element]));
        if (!keep) continue;
        if (!f->count_only)
            imp__el_link_make(e, src, r->element, &f->slot[slot].links[f->slot[slot].n],
                              &keep, &f->slot[slot].rays);
        f->slot[slot].n += keep;
    }
    return IMP_OK;
}

static enum imp_status first_commit(size_t item, int slot, void *payload)
{
    struct first *f = payload;
    imp_elements *e = f->e;
    (void)item;
    e->rays += f->slot[slot].rays;
    if (!f->count_only && f->slot[slot].n)
        memcpy(e->links + f->total, f->slot[slot].links,
               f->slot[slot].n * sizeof *e->links);
    f->total += f->slot[slot].n;
    return IMP_OK;
}

enum imp_status imp__el_links_first(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    const size_t slots = (size_t)imp__pool_slots(e->ctx);
    struct first f = {.e = e, .count_only = true};
    struct imp_loop loop = {
        .n_items = e->n_roots, .work = first_work, .commit = first_commit, .payload = &f};
    f.slot = imp__alloc(e->ctx, slots, sizeof *f.slot);
    if (!f.slot) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));

    const double each =
        (double)(sizeof *e->links + 4 * (size_t)e->ch * sizeof(double) + sizeof *e->out);
    if (f.total > e->opt.max_links || (double)f.total * each > (double)e->opt.max_bytes)
        IMP_TRY(
            imp__error(e->ctx, IMP_E_NOMEM,
                       "%zu polygons need %zu first links, about %.0f MB; the budget is "
                       "%zu links and %.0f MB",
                       e->n_roots, f.total, (double)f.total * each / 1e6,
                       e->opt.max_links, (double)e->opt.max_bytes / 1e6));
    for (size_t k = 0; k < slots; k++) {
        f.slot[k].links = imp__alloc(e->ctx, e->n_roots, sizeof *f.slot[k].links);
        if (!f.slot[k].links)
            IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    }
    struct imp__el_link *grown =
        imp__grow(e->ctx, e->links, &e->cap_links, f.total + 1, sizeof *grown);
    if (!grown) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    e->links = grown;
    f.total = 0;
    f.count_only = false;
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    e->n_links = f.total;
    IMP_TRY(imp__el_links_sort(e, NULL, e->n_links));
out:
    for (size_t k = 0; f.slot && k < slots; k++) imp__release(e->ctx, f.slot[k].links);
    imp__release(e->ctx, f.slot);
    return st;
}

/* ---- Order --------------------------------------------------------------------- */

#define EL_GROW(array, cap, n)                                                           \
    do {                                                                                 \
        void *grown_ = imp__grow(e->ctx, array, &(cap), n, sizeof *(array));             \
        if (!grown_)                                                                     \
            IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));         \
        (array) = grown_;                                                                \
    } while (0)

struct moved {
    const struct imp__el_link *from;
    const unsigned char *gone;
    const uint32_t *place;
    struct imp__el_link *to;
    size_t n;
};
enum { MOVES_PER_ITEM = 2048 };

static enum imp_status move_work(size_t item, int worker, int slot, void *payload)
{
    const struct moved *m = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * MOVES_PER_ITEM, m->n);
    for (size_t k = item * MOVES_PER_ITEM; k < end; k++)
        if (!m->gone || !m->gone[k]) m->to[m->place[k]] = m->from[k];
    return IMP_OK;
}

enum imp_status imp__el_links_sort(imp_elements *e, const unsigned char *gone, size_t all)
{
    enum imp_status st = IMP_OK;
    const size_t m = e->n_elements;
    struct imp__el_link *sorted = NULL;
    uint32_t *place = imp__alloc_raw(e->ctx, all + 1, sizeof *place);
    size_t n = 0;
    for (size_t k = 0; k < all; k++) n += !gone || !gone[k];
    EL_GROW(e->in_start, e->cap_in, m + 2);
    EL_GROW(e->out_start, e->cap_out_start, m + 2);
    EL_GROW(e->out, e->cap_out, n + 1);
    if (4 * (size_t)e->ch * (n + 1) > e->cap_value) { /* sweeps fill it anew */
        imp__release(e->ctx, e->value);
        e->cap_value = 4 * (size_t)e->ch * (n + n / 2 + 1);
        e->value = imp__alloc_raw(e->ctx, e->cap_value, sizeof *e->value);
        if (!e->value) {
            e->cap_value = 0;
            IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
        }
    }
    sorted = imp__alloc_raw(e->ctx, e->cap_links, sizeof *sorted);
    if (!sorted || !place)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));

    /* Counting sorts, stable: start[k + 1] counts, then becomes the place to write. */
    memset(e->in_start, 0, (m + 2) * sizeof *e->in_start);
    for (size_t k = 0; k < all; k++)
        if (!gone || !gone[k]) e->in_start[e->links[k].rcv + 2]++;
    for (size_t k = 1; k < m + 2; k++) e->in_start[k] += e->in_start[k - 1];
    for (size_t k = 0; k < all; k++)
        if (!gone || !gone[k]) place[k] = (uint32_t)e->in_start[e->links[k].rcv + 1]++;
    struct moved move = {e->links, gone, place, sorted, all};
    const struct imp_loop loop = {.n_items = (all + MOVES_PER_ITEM - 1) / MOVES_PER_ITEM,
                                  .work = move_work,
                                  .payload = &move};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    imp__release(e->ctx, e->links);
    e->links = sorted;
    e->n_links = n;
    sorted = NULL;
    memset(e->out_start, 0, (m + 2) * sizeof *e->out_start);
    for (size_t k = 0; k < n; k++) e->out_start[e->links[k].src + 2]++;
    for (size_t k = 1; k < m + 2; k++) e->out_start[k] += e->out_start[k - 1];
    for (size_t k = 0; k < n; k++)
        e->out[e->out_start[e->links[k].src + 1]++] = (uint32_t)k;
    e->sorted = true;
out:
    imp__release(e->ctx, place);
    imp__release(e->ctx, sorted);
    return st;
}
