/* SPDX-License-Identifier: Apache-2.0
 *
 * Refinement. The image contribution of a link sample is the bilinear form itself,
 * q_s = 4 K_s |g_i(w_s)| |L_j(-w_s)|; a link is refined while
 *     max( max_s q_s - min_s q_s, 4 max_s K_s L_bound g_bound ) > eps.
 * Without importance g_i is replaced by albedo/pi (Hanrahan's BF criterion) and
 * everything else stays. The bounds are what keeps narrow lobes and half-hidden links
 * honest: four samples may miss a beam altogether. */
#include "elements.h"
#include <string.h>

static bool refinable(const imp_elements *e, const struct imp__element *x)
{
    return x->child || (x->level < e->opt.max_level && x->radius > 1e-7 * e->size);
}

/* The largest sum over channels of |field| along directions to the corners of `to`. */
static double corner_bound(const imp_elements *e, const struct imp__element *x,
                           const double *field, const struct imp__element *to)
{
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const int n = imp__el_n(e, r);
    imp_spec w[3] = {{0}}, h[EL_N_MAX];
    double most = 0;
    for (int k = 0; k < 4; k++) {
        imp_v3 d = to->v[k < to->corners ? k : 0] - x->centre;
        const double length = imp__length(d);
        d = length > 0 ? imp__to_local(&r->frame, d * (1 / length)) : imp__v3(0, 0, 1);
        for (int a = 0; a < 3; a++) w[a][k] = d[a];
    }
    imp__basis_eval4(&e->basis, w[0], w[1], w[2], h);
    imp_spec total = imp__spec(0);
    for (int c = 0; c < e->ch; c++) {
        imp_spec sum = imp__spec(0);
        for (int q = 0; q < n; q++) sum += field[c * n + q] * h[q];
        for (int k = 0; k < 4; k++) total[k] += fabs(sum[k]);
    }
    for (int k = 0; k < 4; k++)
        if (w[2][k] > 0) most = imp_max(total[k], most);
    return most;
}

/* The largest value of the source's beam over the directions that the receiver fills. */
static double beam_bound(const imp_elements *e, const struct imp__el_root *r,
                         const struct imp__element *j, const struct imp__element *i)
{
    double peak = 0;
    for (int c = 0; c < e->ch; c++) peak += r->radiance[c];
    if (r->light == EL_DARK || r->light == EL_UNIFORM) return r->light ? peak : 0;
    const imp_v3 d = i->centre - j->centre;
    const double dist = imp__length(d), reach = i->radius + j->radius;
    if (r->light == EL_PROFILE) {
        const bool inside = dist <= reach;
        const imp_v3 to = inside ? r->frame.n : d * (1 / dist);
        return peak * r->profiled->ops->profile->bound(
                          r->profiled, &to, inside ? IMP_PI : asin(reach / dist));
    }
    if (dist <= reach) return peak;
    const double angle =
        acos(imp_clamp(imp__dot(d, r->axis) / dist, -1.0, 1.0)) - asin(reach / dist);
    return angle <= 0 ? peak : angle >= IMP_PI / 2 ? 0 : peak * pow(cos(angle), r->power);
}

static double sum_of(int ch, const imp_spec *x, int s)
{
    double sum = 0;
    for (int c = 0; c < ch; c++) sum += fabs(x[c][s]);
    return sum;
}

/* Links across a shadow's edge count more: an element that is half in shadow is too dark
 * twice, as a receiver for its lit part and as a source. With 4 instead of 1, scene a
 * comes to the same mean with a third of the links (docs/elements.md). */
#define HALF_HIDDEN 4

static double error_of(const imp_elements *e, const struct imp__el_link *k,
                       bool importance)
{
    const struct imp__element *i = &e->elements[k->rcv], *j = &e->elements[k->src];
    const struct imp__el_root *ri = imp__el_root_of(e, i), *rj = imp__el_root_of(e, j);
    imp_spec l[3], g[3];
    imp__el_ends(e, k, l, importance ? g : NULL);
    if (!importance)
        for (int c = 0; c < e->ch; c++)
            g[c] =
                imp__spec(e->lum[c] * (e->materials[ri->material].albedo[c] * IMP_INV_PI +
                                       (ri->measured ? IMP_INV_PI : 0)));
    double q_min = INFINITY, q_max = 0, k_max = 0, l_max = 0, g_max = 0;
    for (int s = 0; s < 4; s++) {
        double q = 0;
        for (int c = 0; c < e->ch; c++) q += fabs(l[c][s]) * fabs(g[c][s]);
        q *= 4 * k->k[s];
        q_min = imp_min(q, q_min);
        q_max = imp_max(q, q_max);
        k_max = imp_max(k->k[s], k_max);
        l_max = imp_max(sum_of(e->ch, l, s), l_max);
        g_max = imp_max(sum_of(e->ch, g, s), g_max);
    }
    if (k_max == 0) k_max = imp__el_link_bound(e, k);
    const int ni = imp__el_n(e, ri), nj = imp__el_n(e, rj);
    const double dist = imp__length(i->centre - j->centre);
    const bool wide = i->radius + j->radius > 0.1 * dist;
    /* Channels: the bound of a product of sums is over-cautious by up to their number. */
    double bound = beam_bound(e, rj, j, i);
    if (wide && nj > 1) bound += corner_bound(e, j, imp__el_at(e, e->l, j), i);
    else if (nj > 0) {
        double sh = 0;
        for (int s = 0; s < 4; s++) sh = imp_max(sum_of(e->ch, l, s), sh);
        bound = imp_max(sh, bound);
    }
    l_max = imp_max(bound, l_max);
    if (importance && wide && ni > 1)
        g_max = imp_max(corner_bound(e, i, imp__el_at(e, e->g, i), j), g_max);
    int hidden = 0;
    for (int s = 0; s < 4; s++) hidden += k->k[s] == 0;
    return (hidden % 4 ? HALF_HIDDEN : 1) *
           imp_max(q_max - q_min, 4 * k_max * l_max * g_max / e->ch);
}

/* The part of the source's radiance that finer sources would resolve. The kernel is
 * integrated over the source exactly, so a uniform lamp that the receiver sees whole
 * gives the same irradiance from its parts: only the light that it reflects may differ
 * from part to part. A glossy receiver depends on direction, a beam has a lobe, and
 * behind an edge more samples mean more rays: there all of it counts. */
static double resolved_by_source(const imp_elements *e, const struct imp__el_link *k)
{
    const struct imp__element *j = &e->elements[k->src];
    const struct imp__el_root *r = imp__el_root_of(e, j);
    double emitted = 0, reflected = 0;
    if (r->light != EL_UNIFORM || imp__el_n(e, r) > 1 ||
        imp__el_n(e, imp__el_root_of(e, &e->elements[k->rcv])) > 1)
        return 1;
    for (int s = 0; s < 4; s++)
        if (k->k[s] == 0) return 1;
    for (int c = 0; c < e->ch; c++) {
        emitted += fabs(r->radiance[c]);
        if (imp__el_n(e, r))
            reflected += fabs(imp__el_at(e, e->l, j)[c]) * e->basis.lead[0];
    }
    return emitted > 0 ? reflected / (emitted + reflected) : 1;
}

/* ---- One wave: test links [from, n), split, make their children's links -------- */

/* What becomes of a link: it stays, its receiver is to be split, its source is, or it goes.
 * FRESH: the element still needs to be split itself. */
enum { KEEP = 0, SPLIT_RECEIVER, SPLIT_SOURCE, GONE, FRESH = 4 };
enum { LINKS_PER_ITEM = 256 };

struct wave {
    imp_elements *e;
    bool importance;
    unsigned char *fate; /* [cap_fate] of every link */
    size_t cap_fate;
    size_t from, n; /* links [0, from) are settled */
    size_t alive;   /* links that stay */
    size_t *before; /* [items + 1] splits before an item's links */
    int64_t *rays;  /* [items] */
};

static size_t items_of(size_t n) { return (n + LINKS_PER_ITEM - 1) / LINKS_PER_ITEM; }

static enum imp_status judge(size_t item, int worker, int slot, void *payload)
{
    struct wave *v = payload;
    const imp_elements *e = v->e;
    (void)worker, (void)slot;
    const size_t first = v->from + item * LINKS_PER_ITEM;
    const size_t end = imp_min(first + LINKS_PER_ITEM, v->n);
    size_t splits = 0;
    for (size_t k = first; k < end; k++) {
        const struct imp__el_link *link = &e->links[k];
        const struct imp__element *i = &e->elements[link->rcv],
                                  *j = &e->elements[link->src];
        const bool can_i = refinable(e, i), can_j = refinable(e, j);
        if (v->fate[k] == GONE || !(can_i || can_j) ||
            !(error_of(e, link, v->importance) > e->eps))
            continue;
        const bool receiver =
            can_i && (!can_j || i->area >= j->area * resolved_by_source(e, link));
        v->fate[k] = receiver ? SPLIT_RECEIVER : SPLIT_SOURCE;
        if (!(receiver ? i : j)->child) v->fate[k] |= FRESH;
        splits++;
    }
    v->before[item + 1] = splits;
    return IMP_OK;
}

/* Split the elements that links of this wave need split, in the order of the links. */
static enum imp_status elements_split(struct wave *v)
{
    enum imp_status st = IMP_OK;
    imp_elements *e = v->e;
    uint32_t *list = NULL;
    size_t n = 0, cap = 0;
    for (size_t k = v->from; k < v->n; k++) {
        if (!(v->fate[k] & FRESH)) continue;
        v->fate[k] &= (unsigned char)~FRESH;
        const uint32_t node =
            v->fate[k] == SPLIT_RECEIVER ? e->links[k].rcv : e->links[k].src;
        if (e->elements[node].child) continue; /* it is in the list */
        uint32_t *grown = imp__grow(e->ctx, list, &cap, n + 1, sizeof *grown);
        if (!grown) {
            st = imp__error(e->ctx, IMP_E_NOMEM, "out of memory for elements");
            break;
        }
        list = grown;
        list[n++] = node;
        e->elements[node].child = EL_NONE;
    }
    for (size_t k = 0; k < n; k++) e->elements[list[k]].child = 0;
    if (st == IMP_OK) st = imp__el_split(e, list, n);
    imp__release(e->ctx, list);
    return st;
}

static enum imp_status make(size_t item, int worker, int slot, void *payload)
{
    struct wave *v = payload;
    imp_elements *e = v->e;
    (void)worker, (void)slot;
    const size_t first = v->from + item * LINKS_PER_ITEM;
    const size_t end = imp_min(first + LINKS_PER_ITEM, v->n);
    size_t to = v->n + 4 * v->before[item];
    v->rays[item] = 0;
    for (size_t k = first; k < end; k++) {
        const struct imp__el_link *link = &e->links[k];
        if (v->fate[k] != SPLIT_RECEIVER && v->fate[k] != SPLIT_SOURCE) continue;
        const bool receiver = v->fate[k] == SPLIT_RECEIVER;
        const uint32_t child = e->elements[receiver ? link->rcv : link->src].child;
        for (uint32_t q = 0; q < 4; q++, to++) {
            bool keep;
            imp__el_link_make(e, receiver ? link->src : child + q,
                              receiver ? child + q : link->rcv, &e->links[to], &keep,
                              &v->rays[item]);
            v->fate[to] = keep ? KEEP : GONE;
        }
    }
    return IMP_OK;
}

/* Bytes that refinement would hold with so many links and elements more. */
static double bytes_after(const imp_elements *e, double links, double elements)
{
    const double each =
        (double)(2 * sizeof *e->links + 4 * (size_t)e->ch * sizeof(double) + 5);
    const double per = e->n_elements ? (double)e->n_coef / (double)e->n_elements : 0;
    return (double)e->n_hits * (sizeof *e->hits + sizeof *e->seen) + links * each +
           elements * (sizeof *e->elements + 16 + per * 8 * (5.0 * e->ch + 1));
}

/* Room for n links, with their fates. */
static enum imp_status room_make(struct wave *v, size_t n)
{
    imp_elements *e = v->e;
    if (n > e->cap_links) {
        const size_t cap = imp_max(n, e->cap_links + e->cap_links / 2);
        struct imp__el_link *links = imp__alloc_raw(e->ctx, cap, sizeof *links);
        if (!links) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links");
        if (v->n) memcpy(links, e->links, v->n * sizeof *links);
        imp__release(e->ctx, e->links);
        e->links = links;
        e->cap_links = cap;
    }
    unsigned char *fate = imp__grow(e->ctx, v->fate, &v->cap_fate, n, 1);
    if (!fate) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links");
    v->fate = fate;
    return IMP_OK;
}

/* *more: links were split, and their children's links are the next wave. */
static enum imp_status wave_run(struct wave *v, bool *full, bool *more)
{
    enum imp_status st = IMP_OK;
    imp_elements *e = v->e;
    const size_t items = items_of(v->n - v->from);
    size_t splits = 0;
    *more = false;
    v->before = imp__alloc(e->ctx, items + 1, sizeof *v->before);
    v->rays = imp__alloc(e->ctx, items + 1, sizeof *v->rays);
    if (!v->before || !v->rays)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    struct imp_loop loop = {.n_items = items, .work = judge, .payload = v};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    for (size_t k = 0; k < items; k++) v->before[k + 1] += v->before[k];
    splits = v->before[items];
    if (splits == 0) goto out;
    if (v->alive + 3 * splits > e->opt.max_links || v->n + 4 * splits >= UINT32_MAX ||
        bytes_after(e, (double)(v->n + 4 * splits), (double)e->n_elements) >
            (double)e->opt.max_bytes) {
        *full = true;
        goto out;
    }
    IMP_TRY(room_make(v, v->n + 4 * splits));
    e->sorted = false; /* the indices are too short for new elements */
    IMP_TRY(elements_split(v));
    loop.work = make;
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    /* From here nothing fails: the split links go, their children stay. */
    for (size_t k = v->from; k < v->n; k++)
        if (v->fate[k] != KEEP) v->fate[k] = GONE;
    for (size_t k = 0; k < items; k++) e->rays += v->rays[k];
    v->from = v->n;
    v->n += 4 * splits;
    v->alive -= splits;
    for (size_t k = v->from; k < v->n; k++) v->alive += v->fate[k] == KEEP;
    *more = true;
out:
    if (!*more) /* who was to be split stays */
        for (size_t k = v->from; k < v->n; k++)
            if (v->fate[k] != GONE) v->fate[k] = KEEP;
    imp__release(e->ctx, v->before);
    imp__release(e->ctx, v->rays);
    v->before = NULL, v->rays = NULL;
    return st;
}

enum imp_status imp__el_refine(imp_elements *e, bool importance, bool *full)
{
    enum imp_status st = IMP_OK;
    struct wave v = {
        .e = e, .importance = importance, .n = e->n_links, .alive = e->n_links};
    bool more = false;
    *full = false;
    st = room_make(&v, e->n_links + 1);
    if (st != IMP_OK) return st;
    do {
        st = wave_run(&v, full, &more);
        imp__el_tick(e, "refine", -1, NULL);
    } while (more && !e->stop);
    if (!e->sorted) { /* also after a failure: the links are whole */
        const enum imp_status sorted = imp__el_links_sort(e, v.fate, v.n);
        if (sorted != IMP_OK) e->solved = false; /* until the old ones are sorted again */
        if (st == IMP_OK) st = sorted;
    }
    imp__release(e->ctx, v.fate);
    return st;
}

/* ---- The scale of eps ---------------------------------------------------------- */

static double total_of(const imp_elements *e, size_t first, size_t end, const void *how)
{
    const bool importance = *(const bool *)how;
    double sum = 0;
    for (size_t k = first; k < end; k++) {
        const struct imp__el_link *link = &e->links[k];
        const struct imp__el_root *r = imp__el_root_of(e, &e->elements[link->rcv]);
        imp_spec l[3], g[3];
        imp__el_ends(e, link, l, importance ? g : NULL);
        for (int c = 0; c < e->ch; c++) {
            if (!importance)
                g[c] = imp__spec(e->lum[c] *
                                 (e->materials[r->material].albedo[c] * IMP_INV_PI +
                                  (r->measured ? IMP_INV_PI : 0)));
            for (int s = 0; s < 4; s++) sum += link->k[s] * fabs(l[c][s] * g[c][s]);
        }
    }
    return sum;
}

double imp__el_total(const imp_elements *e, bool importance)
{
    return imp__el_sum(e, e->n_links, total_of, &importance);
}
