/* SPDX-License-Identifier: Apache-2.0
 *
 * One element at a time: what it is, what arrives there link by link, and the illuminance
 * at points of its polygon. */
#include "elements.h"
#include <stdlib.h>
#include <string.h>

static enum imp_status ready(const imp_elements *e, size_t index)
{
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    if (index >= e->n_elements)
        return imp__error(e->ctx, IMP_E_ARG, "there is no element %zu of %zu", index,
                          e->n_elements);
    return IMP_OK;
}

/* Area of all leaves in an element. Its stored area may differ where solids cover corners. */
static double leaf_area(const imp_elements *e, const struct imp__element *x)
{
    double sum = x->child ? 0 : x->area;
    for (uint32_t k = x->child; k && k < x->child + 4; k++)
        sum += leaf_area(e, &e->elements[k]);
    return sum;
}

/* E = int L cos dw = sqrt(2 pi) c_0, times the area, over the leaves. */
static void flux_add(const imp_elements *e, const struct imp__element *x, int n,
                     double out[3])
{
    for (uint32_t k = x->child; k && k < x->child + 4; k++)
        flux_add(e, &e->elements[k], n, out);
    for (int c = 0; c < e->ch && !x->child && x->area > 0; c++)
        out[c] += x->area * sqrt(IMP_2PI) * imp__el_at(e, e->c, x)[c * n];
}

static double luminance_of(const imp_elements *e, const double v[3])
{
    double sum = 0;
    for (int c = 0; c < e->ch; c++) sum += e->lum[c] * v[c];
    return sum;
}

enum imp_status imp_elements_get_element(const imp_elements *e, size_t index,
                                         struct imp_elements_element *out)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, out, "out");
    IMP_SIZED(e->ctx, out, "out");
    IMP_FLOAT_MODE;
    IMP_TRY(ready(e, index));
    const struct imp__element *x = &e->elements[index];
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const int n = imp__el_n(e, r);
    const double area = leaf_area(e, x);
    struct imp_elements_element i = {
        .size = sizeof i,
        .shape = r->shape >= 0 ? e->scene->shapes[r->shape]->name : NULL,
        .polygon = x->root,
        .parent = x->parent == EL_NONE ? IMP_ELEMENTS_NO_PARENT : x->parent,
        .level = x->level,
        .leaf = !x->child,
        .source = imp__el_source_of(e, x->root),
        .corners = x->corners,
        .area = area};
    for (int k = 0; k < x->corners; k++)
        for (int a = 0; a < 3; a++) i.corner[k][a] = x->v[k][a];
    imp__el_means(e, x, i.radiance, &i.importance);
    if (n) flux_add(e, x, n, i.irradiance);
    for (int c = 0; c < 3; c++)
        i.irradiance[c] = n && area > 0 ? i.irradiance[c] / area : NAN;
    i.illuminance = luminance_of(e, i.irradiance);
    IMP_GIVE(e->ctx, out, i, "out");
out:
    return st;
}

/* ---- Arrivals ------------------------------------------------------------------ */

struct arrivals {
    const imp_elements *e;
    const struct imp__element *to;
    double area;                      /* of its leaves */
    struct imp_elements_arrival *row; /* NULL: they are counted */
    size_t n;
};

static bool is_below(const imp_elements *e, const struct imp__element *x,
                     const struct imp__element *above)
{
    while (x != above && x->parent != EL_NONE) x = &e->elements[x->parent];
    return x == above;
}

/* Importance that the element gives back along w, per channel. */
static void importance_towards(const imp_elements *e, const struct imp__element *x,
                               imp_v3 w, double g[3])
{
    const struct imp__el_root *r = imp__el_root_of(e, x);
    const int n = imp__el_n(e, r);
    double h[EL_N_MAX] = {e->basis.lead[0]};
    if (n > 1) imp__basis_eval(&e->basis, imp__to_local(&r->frame, w), h);
    for (int c = 0; c < e->ch; c++) {
        const double *own = imp__el_at(e, e->g, x) + c * n;
        g[c] = 0;
        for (int q = 0; q < n; q++) g[c] += own[q] * h[q];
    }
}

/* The samples of a link fall on quarters of its receiver; those that reach `to` count by
 * the part of their area that is in it. */
static void link_take(struct arrivals *a, const struct imp__el_link *link)
{
    const imp_elements *e = a->e;
    const struct imp__element *i = &e->elements[link->rcv], *to = a->to;
    struct imp_elements_arrival out = {.size = sizeof out, .from = link->src};
    imp_spec light[3];
    if (!a->row) {
        a->n++;
        return;
    }
    imp__el_ends(e, link, light, NULL);
    for (uint32_t s = 0; s < 4 && a->area > 0; s++) {
        const struct imp__element *part = i->child ? &e->elements[i->child + s] : i;
        const bool above = part != to && i != to && is_below(e, to, part);
        const bool within = part == to || is_below(e, part, to);
        if (!(part->area > 0) || !(above || within)) continue;
        /* Over `part` it is uniform: a larger one gives `to` the same, a smaller one less. */
        const double arrives =
            link->k[s] / part->area * (above ? 1 : leaf_area(e, part) / a->area);
        const imp_v3 w = imp__v3(link->w[0][s], link->w[1][s], link->w[2][s]);
        double g[3];
        importance_towards(e, above ? to : part, w, g);
        for (int c = 0; c < e->ch; c++) {
            out.irradiance[c] += arrives * light[c][s];
            out.measure += a->area * arrives * light[c][s] * g[c];
        }
    }
    out.illuminance = luminance_of(e, out.irradiance);
    a->row[a->n++] = out;
}

static void links_take(struct arrivals *a, uint32_t index)
{
    const imp_elements *e = a->e;
    for (size_t k = e->in_start[index]; k < e->in_start[index + 1]; k++)
        link_take(a, &e->links[k]);
}

static void below_take(struct arrivals *a, uint32_t index)
{
    const uint32_t child = a->e->elements[index].child;
    links_take(a, index);
    for (uint32_t k = 0; k < 4 && child; k++) below_take(a, child + k);
}

static void all_take(struct arrivals *a)
{
    a->n = 0;
    below_take(a, (uint32_t)(a->to - a->e->elements));
    for (uint32_t k = a->to->parent; k != EL_NONE; k = a->e->elements[k].parent)
        links_take(a, k);
}

static int brightest_first(const void *p, const void *q)
{
    const struct imp_elements_arrival *x = p, *y = q;
    if (x->illuminance != y->illuminance) return x->illuminance < y->illuminance ? 1 : -1;
    return (x->from > y->from) - (x->from < y->from);
}

enum imp_status imp_elements_arrivals(const imp_elements *e, size_t index,
                                      struct imp_elements_arrival **arrivals, size_t *n)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, arrivals, "arrivals");
    IMP_REQUIRE(e->ctx, n, "n");
    IMP_FLOAT_MODE;
    IMP_TRY(ready(e, index));
    const struct imp__element *to = &e->elements[index];
    struct arrivals a = {.e = e, .to = to, .area = leaf_area(e, to)};
    if (imp__el_n(e, imp__el_root_of(e, to))) all_take(&a);
    a.row = imp__alloc(e->ctx, a.n + 1, sizeof *a.row);
    if (!a.row) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for links"));
    if (a.n) all_take(&a);
    if (a.n) qsort(a.row, a.n, sizeof *a.row, brightest_first);
    *arrivals = a.row;
    *n = a.n;
out:
    return st;
}

/* ---- Illuminance --------------------------------------------------------------- */

struct cells {
    const imp_elements *e;
    uint32_t root;
    int width, height;
    double *out;
};

static enum imp_status cells_work(size_t row, int worker, int slot, void *payload)
{
    const struct cells *p = payload;
    const bool triangle = p->e->roots[p->root].corners == 3;
    (void)worker, (void)slot;
    for (int k = 0; k < p->width; k++) {
        const double u = (k + 0.5) / p->width, v = ((double)row + 0.5) / p->height;
        double sum[3] = {0};
        if (!triangle || u + v < 1) imp__el_gather(p->e, p->root, u, v, NULL, sum);
        else sum[0] = sum[1] = sum[2] = NAN;
        p->out[row * (size_t)p->width + (size_t)k] = luminance_of(p->e, sum);
    }
    return IMP_OK;
}

enum imp_status imp_elements_illuminance(const imp_elements *e, size_t index, int width,
                                         int height, double *illuminance)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, illuminance, "illuminance");
    IMP_FLOAT_MODE;
    IMP_READS(e->scene);
    IMP_TRY(ready(e, index));
    if (width < 1 || height < 1 || width > 4096 || height > 4096)
        IMP_TRY(imp__error(e->ctx, IMP_E_ARG,
                           "illuminance of %d x %d cells: 1 to 4096 a side", width,
                           height));
    struct cells p = {e, e->elements[index].root, width, height, illuminance};
    const struct imp_loop loop = {
        .n_items = (size_t)height, .work = cells_work, .payload = &p};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
out:
    return st;
}
