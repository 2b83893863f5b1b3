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
    const struct imp__el_root *r = el_root(e, x);
    const int n = el_n(e, r);
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
        if (w[2][k] > 0) most = fmax(most, total[k]);
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
    if (r->light == EL_TABLE)
        return dist <= reach
                   ? peak * imp__ies_bound(r->table, r->frame.n, IMP_PI)
                   : peak * imp__ies_bound(r->table, d * (1 / dist), asin(reach / dist));
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
    const struct imp__el_root *ri = el_root(e, i), *rj = el_root(e, j);
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
        q_min = fmin(q_min, q);
        q_max = fmax(q_max, q);
        k_max = fmax(k_max, k->k[s]);
        l_max = fmax(l_max, sum_of(e->ch, l, s));
        g_max = fmax(g_max, sum_of(e->ch, g, s));
    }
    if (k_max == 0) k_max = imp__el_link_bound(e, k);
    const int ni = el_n(e, ri), nj = el_n(e, rj);
    const double dist = imp__length(i->centre - j->centre);
    const bool wide = i->radius + j->radius > 0.1 * dist;
    /* Channels: the bound of a product of sums is over-cautious by up to their number. */
    double bound = beam_bound(e, rj, j, i);
    if (wide && nj > 1) bound += corner_bound(e, j, el_at(e, e->l, j), i);
    else if (nj > 0) {
        double sh = 0;
        for (int s = 0; s < 4; s++) sh = fmax(sh, sum_of(e->ch, l, s));
        bound = fmax(bound, sh);
    }
    l_max = fmax(l_max, bound);
    if (importance && wide && ni > 1)
        g_max = fmax(g_max, corner_bound(e, i, el_at(e, e->g, i), j));
    int hidden = 0;
    for (int s = 0; s < 4; s++) hidden += k->k[s] == 0;
    return (hidden % 4 ? HALF_HIDDEN : 1) *
           fmax(q_max - q_min, 4 * k_max * l_max * g_max / e->ch);
}

/* ---- One wave: look at links [from, n), split, make their children's links ----- */

enum { LINKS_PER_ITEM = 256, KEEP = 0, SPLIT_RECEIVER, SPLIT_SOURCE };

struct wave {
    imp_elements *e;
    bool importance;
    size_t from, n;
    unsigned char *verdict; /* [n - from] */
    double *part;           /* of the total, one a slot */
    double total;
    size_t n_new;
    struct {
        uint32_t src, rcv;
    } * pair;
    struct imp__el_link *made;
    bool *keep;
    int64_t *rays; /* one an item */
};

static enum imp_status judge(size_t item, int worker, int slot, void *payload)
{
    struct wave *v = payload;
    const imp_elements *e = v->e;
    (void)worker, (void)slot;
    const size_t first = v->from + item * LINKS_PER_ITEM;
    const size_t end = imp_min(first + LINKS_PER_ITEM, v->n);
    for (size_t k = first; k < end; k++) {
        const struct imp__el_link *link = &e->links[k];
        const struct imp__element *i = &e->elements[link->rcv],
                                  *j = &e->elements[link->src];
        const bool can_i = refinable(e, i), can_j = refinable(e, j);
        unsigned char what = KEEP;
        if ((can_i || can_j) && error_of(e, link, v->importance) > e->eps)
            what =
                can_i && (!can_j || i->area >= j->area) ? SPLIT_RECEIVER : SPLIT_SOURCE;
        v->verdict[k - v->from] = what;
    }
    return IMP_OK;
}

static enum imp_status make(size_t item, int worker, int slot, void *payload)
{
    struct wave *v = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * LINKS_PER_ITEM, v->n_new);
    for (size_t k = item * LINKS_PER_ITEM; k < end; k++)
        imp__el_link_make(v->e, v->pair[k].src, v->pair[k].rcv, &v->made[k], &v->keep[k],
                          &v->rays[item]);
    return IMP_OK;
}

static size_t items_of(size_t n) { return (n + LINKS_PER_ITEM - 1) / LINKS_PER_ITEM; }

/* Bytes that refinement would hold with so many links and elements more. */
static double bytes_after(const imp_elements *e, double links, double elements)
{
    const double each =
        (double)(2 * sizeof *e->links + 4 * (size_t)e->ch * sizeof(double) + 4);
    const double per = e->n_elements ? (double)e->n_coef / (double)e->n_elements : 0;
    return (double)(e->n_hits + e->n_view) * sizeof *e->hits + links * each +
           elements * (sizeof *e->elements + 16 + per * 8 * (5.0 * e->ch + 1));
}

static enum imp_status wave_run(struct wave *v, bool *full)
{
    enum imp_status st = IMP_OK;
    imp_elements *e = v->e;
    size_t n_split = 0;
    v->verdict = imp__alloc(e->ctx, v->n - v->from + 1, 1);
    if (!v->verdict) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    const struct imp_loop look = {
        .n_items = items_of(v->n - v->from), .work = judge, .payload = v};
    IMP_TRY(imp__parallel(e->ctx, &look, NULL));
    for (size_t k = 0; k < v->n - v->from; k++) n_split += v->verdict[k] != KEEP;
    v->n_new = 0;
    if (n_split == 0) goto out;
    if (e->n_links + 3 * n_split > e->opt.max_links ||
        bytes_after(e, (double)(e->n_links + 4 * n_split), (double)e->n_elements) >
            (double)e->opt.max_bytes) {
        *full = true;
        goto out;
    }
    v->pair = imp__alloc(e->ctx, 4 * n_split, sizeof *v->pair);
    v->made = imp__alloc(e->ctx, 4 * n_split, sizeof *v->made);
    v->keep = imp__alloc(e->ctx, 4 * n_split, sizeof *v->keep);
    v->rays = imp__alloc(e->ctx, items_of(4 * n_split) + 1, sizeof *v->rays);
    if (!v->pair || !v->made || !v->keep || !v->rays)
        IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    e->sorted = false; /* the indices are too short for new elements */
    for (size_t k = v->from; k < v->n; k++) {
        const unsigned char what = v->verdict[k - v->from];
        const struct imp__el_link *link = &e->links[k];
        if (what == KEEP) continue;
        const uint32_t node = what == SPLIT_RECEIVER ? link->rcv : link->src;
        IMP_TRY(imp__el_split(e, node));
        for (uint32_t q = 0; q < 4; q++) {
            const uint32_t child = e->elements[node].child + q;
            v->pair[v->n_new].src = what == SPLIT_RECEIVER ? link->src : child;
            v->pair[v->n_new++].rcv = what == SPLIT_RECEIVER ? child : link->rcv;
        }
    }
    const struct imp_loop build = {
        .n_items = items_of(v->n_new), .work = make, .payload = v};
    IMP_TRY(imp__parallel(e->ctx, &build, NULL));
    struct imp__el_link *grown =
        imp__grow(e->ctx, e->links, &e->cap_links, e->n_links + v->n_new, sizeof *grown);
    if (!grown) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    e->links = grown;
    /* From here nothing fails: the split links go, their children come. */
    size_t out = v->from;
    for (size_t k = v->from; k < v->n; k++)
        if (v->verdict[k - v->from] == KEEP) e->links[out++] = e->links[k];
    for (size_t k = 0; k < items_of(v->n_new); k++) e->rays += v->rays[k];
    v->from = out;
    for (size_t k = 0; k < v->n_new; k++)
        if (v->keep[k]) e->links[out++] = v->made[k];
    e->n_links = v->n = out;
out:
    imp__release(e->ctx, v->verdict);
    imp__release(e->ctx, v->pair);
    imp__release(e->ctx, v->made);
    imp__release(e->ctx, v->keep);
    imp__release(e->ctx, v->rays);
    v->verdict = NULL, v->pair = NULL, v->made = NULL, v->keep = NULL, v->rays = NULL;
    return st;
}

enum imp_status imp__el_refine(imp_elements *e, bool importance, bool *full)
{
    enum imp_status st = IMP_OK;
    struct wave v = {.e = e, .importance = importance, .from = 0, .n = e->n_links};
    *full = false;
    do {
        st = wave_run(&v, full);
        imp__el_tick(e, "refine", -1, NULL);
    } while (st == IMP_OK && v.n_new > 0 && !*full && !e->stop);
    if (!e->sorted) { /* also after a failure: the links are whole */
        const enum imp_status sorted = imp__el_links_sort(e);
        if (st == IMP_OK) st = sorted;
    }
    return st;
}

/* ---- The scale of eps ---------------------------------------------------------- */

static enum imp_status total_work(size_t item, int worker, int slot, void *payload)
{
    struct wave *v = payload;
    const imp_elements *e = v->e;
    double sum = 0;
    (void)worker;
    const size_t end = imp_min((item + 1) * LINKS_PER_ITEM, e->n_links);
    for (size_t k = item * LINKS_PER_ITEM; k < end; k++) {
        const struct imp__el_link *link = &e->links[k];
        const struct imp__el_root *r = el_root(e, &e->elements[link->rcv]);
        imp_spec l[3], g[3];
        imp__el_ends(e, link, l, v->importance ? g : NULL);
        for (int c = 0; c < e->ch; c++) {
            if (!v->importance)
                g[c] = imp__spec(e->lum[c] *
                                 (e->materials[r->material].albedo[c] * IMP_INV_PI +
                                  (r->measured ? IMP_INV_PI : 0)));
            for (int s = 0; s < 4; s++) sum += link->k[s] * fabs(l[c][s] * g[c][s]);
        }
    }
    v->part[slot] = sum;
    return IMP_OK;
}
static enum imp_status total_commit(size_t item, int slot, void *payload)
{
    struct wave *v = payload;
    (void)item;
    v->total += v->part[slot];
    return IMP_OK;
}

double imp__el_total(const imp_elements *e, bool importance)
{
    struct wave v = {.e = (imp_elements *)e, .importance = importance};
    v.part = imp__alloc(e->ctx, (size_t)imp__pool_slots(e->ctx), sizeof *v.part);
    if (!v.part) return 0;
    const struct imp_loop loop = {.n_items = items_of(e->n_links),
                                  .work = total_work,
                                  .commit = total_commit,
                                  .payload = &v};
    const enum imp_status st = imp__parallel(e->ctx, &loop, NULL);
    imp__release(e->ctx, v.part);
    return st == IMP_OK ? v.total : 0;
}
