/* SPDX-License-Identifier: Apache-2.0
 *
 * The hierarchy: quadtrees on quadrilaterals, one-to-four subdivision of triangles.
 * Children have larger indices than their parents, so a loop over the array is a walk of
 * the tree. */
#include "elements.h"
#include "math/rng.h"
#include "math/warp.h"
#include <string.h>

imp_v3 imp__el_point(int corners, const imp_v3 *v, double s, double t)
{
    if (corners == 3) return v[0] + (v[1] - v[0]) * s + (v[2] - v[0]) * t;
    return v[0] * ((1 - s) * (1 - t)) + v[1] * (s * (1 - t)) + v[2] * (s * t) +
           v[3] * ((1 - s) * t);
}

/* Triangles: three corner pieces and the middle, which is turned over: its corners run
 * opposite, so that piece k of a piece keeps a similar shape. */
static void quarter(int corners, const imp_v3 *p, int q, imp_v3 v[4])
{
    if (corners == 3) {
        const imp_v3 ab = (p[0] + p[1]) * 0.5, bc = (p[1] + p[2]) * 0.5,
                     ca = (p[2] + p[0]) * 0.5;
        const imp_v3 piece[4][3] = {
            {p[0], ab, ca}, {ab, p[1], bc}, {ca, bc, p[2]}, {bc, ca, ab}};
        memcpy(v, piece[q], sizeof piece[q]);
        v[3] = v[2];
        return;
    }
    const double s = 0.5 * (q & 1), t = 0.5 * (q >> 1);
    v[0] = imp__el_point(4, p, s, t);
    v[1] = imp__el_point(4, p, s + 0.5, t);
    v[2] = imp__el_point(4, p, s + 0.5, t + 0.5);
    v[3] = imp__el_point(4, p, s, t + 0.5);
}

void imp__el_quarter(const struct imp__element *x, int q, imp_v3 v[4])
{
    quarter(x->corners, x->v, q, v);
}

/* ---- What is exposed ----------------------------------------------------------- */

/* Does light reach the point at all? Inside a solid on the surface, every ray
 * meets the wrong side of something. Flat directions come last: they settle the doubt. */
static bool is_exposed(const imp_elements *e, const struct imp__el_root *r, imp_v3 p,
                       struct imp_key key)
{
    for (uint32_t k = 0; k < 8; k++) {
        const double u[2] = {imp__u01(key, 2 * k), imp__u01(key, 2 * k + 1)};
        imp_v3 w = imp__cosine_hemisphere(u);
        if (k >= 4) {
            const double phi = IMP_2PI * (u[0] + k) / 4;
            w = imp__v3(0.995 * cos(phi), 0.995 * sin(phi), 0.1);
        }
        const imp_v3 d = imp__to_world(&r->frame, w), o = imp__offset(p, r->frame.n, d);
        struct imp_hit hit;
        if (!imp__intersect(e->scene, &o, &d, 0, INFINITY, &hit)) return true;
        const int root = e->prim_root[hit.shape][hit.prim];
        if (root < 0) continue;
        if (imp__dot(e->roots[root].frame.n, d) < 0 || e->roots[root].back >= 0)
            return true;
    }
    return false;
}

/* The part of an element that is not covered by solids. Radiance and moments are means
 * over that part: a mean over all of it would darken what is next to a block twice,
 * as receiver and as source. */
static double exposure_of(const imp_elements *e, const struct imp__element *x,
                          uint32_t index)
{
    const struct imp__el_root *r = &e->roots[x->root];
    if (r->shape < 0) return 1;
    if (x->parent != EL_NONE) {
        const double above = e->elements[x->parent].exposed;
        if (above == 1 || above == 0) return above;
    }
    const int n = x->parent == EL_NONE ? (e->n_roots > 500 ? 4 : 16) : 6;
    int count = 0, all = 0;
    for (int a = 0; a < n; a++)
        for (int b = 0; b < n; b++) {
            double s = (a + 0.5) / n, t = (b + 0.5) / n;
            if (x->corners == 3 && s + t > 1) continue;
            all++;
            count += is_exposed(e, r, imp__el_point(x->corners, x->v, s, t),
                                imp__key(e->opt.seed + 2, index, (uint64_t)(a * n + b)));
        }
    return all ? (double)count / all : 1;
}

/* l and g are kept, the next sweeps and imp__el_bin fill the others anew. */
static enum imp_status coefficients_grow(imp_elements *e, size_t n)
{
    const size_t ch = (size_t)e->ch;
    struct {
        double **array;
        size_t *cap;
        size_t n;
        bool keep;
    } const all[] = {{&e->l, &e->cap_l, ch * n, true},
                     {&e->g, &e->cap_g, ch * n, true},
                     {&e->c, &e->cap_c, ch * n, false},
                     {&e->b, &e->cap_b, ch * n, false},
                     {&e->from_above, &e->cap_above, ch * n, false},
                     {&e->a, &e->cap_a, n, false}};
    for (size_t k = 0; k < imp_count(all); k++) {
        const size_t cap = *all[k].cap, more = imp_max(all[k].n, cap + cap / 2);
        if (all[k].n <= cap) continue;
        double *grown = imp__alloc_raw(e->ctx, more, sizeof *grown);
        if (!grown) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for elements");
        if (cap && all[k].keep) memcpy(grown, *all[k].array, cap * sizeof *grown);
        imp__release(e->ctx, *all[k].array);
        *all[k].array = grown;
        *all[k].cap = more;
    }
    return IMP_OK;
}

/* Room for so many elements more, of a root with n basis functions each. */
static enum imp_status room_make(imp_elements *e, size_t elements, size_t coefficients)
{
    if (e->n_elements + elements >= EL_NONE)
        return imp__error(e->ctx, IMP_E_NOMEM, "more than 2^32 elements");
    struct imp__element *grown = imp__grow(e->ctx, e->elements, &e->cap_elements,
                                           e->n_elements + elements, sizeof *grown);
    if (!grown) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for elements");
    e->elements = grown;
    return coefficients_grow(e, e->n_coef + coefficients + 1);
}

/* Shape, exposure and first coefficients of an element whose place in the tree is set. */
static void fill(imp_elements *e, uint32_t index, int k)
{
    struct imp__element *x = &e->elements[index];
    const struct imp__el_root *r = &e->roots[x->root];
    const size_t bytes = (size_t)(e->ch * imp__el_n(e, r)) * sizeof(double);
    x->corners = (uint8_t)r->corners;
    if (x->parent == EL_NONE) {
        memcpy(x->v, r->v, sizeof x->v);
        memset(imp__el_at(e, e->l, x), 0, bytes);
        memset(imp__el_at(e, e->g, x), 0, bytes);
    } else {
        const struct imp__element *p = &e->elements[x->parent];
        x->level = p->level + 1;
        imp__el_quarter(p, k, x->v);
        imp__el_hits_share(e, p, k, x);
        memcpy(imp__el_at(e, e->l, x), imp__el_at(e, e->l, p), bytes);
        memcpy(imp__el_at(e, e->g, x), imp__el_at(e, e->g, p), bytes);
    }
    x->exposed = exposure_of(e, x, index);
    x->area = imp__polygon_area(r->corners, x->v) * x->exposed;
    x->centre = imp__v3(0, 0, 0);
    for (int i = 0; i < r->corners; i++) x->centre += x->v[i] * (1.0 / r->corners);
    for (int i = 0; i < r->corners; i++)
        x->radius = fmax(x->radius, imp__length(x->v[i] - x->centre));
}

static uint32_t place(imp_elements *e, uint32_t root, uint32_t parent)
{
    e->elements[e->n_elements] =
        (struct imp__element){.root = root, .parent = parent, .coef = e->n_coef};
    e->n_coef += (size_t)imp__el_n(e, &e->roots[root]);
    return (uint32_t)e->n_elements++;
}

enum imp_status imp__el_element_root(imp_elements *e, uint32_t root)
{
    const enum imp_status st = room_make(e, 1, (size_t)imp__el_n(e, &e->roots[root]));
    if (st != IMP_OK) return st;
    e->roots[root].element = place(e, root, EL_NONE);
    fill(e, e->roots[root].element, 0);
    return IMP_OK;
}

struct splits {
    imp_elements *e;
    const uint32_t *element;
    size_t n;
};
enum { SPLITS_PER_ITEM = 16 };

static enum imp_status split_work(size_t item, int worker, int slot, void *payload)
{
    const struct splits *s = payload;
    (void)worker, (void)slot;
    const size_t end = imp_min((item + 1) * SPLITS_PER_ITEM, s->n);
    for (size_t i = item * SPLITS_PER_ITEM; i < end; i++) {
        struct imp__element *x = &s->e->elements[s->element[i]];
        double area = 0; /* the children's exposed areas are more accurate */
        for (uint32_t k = 0; k < 4; k++) {
            fill(s->e, x->child + k, (int)k);
            area += s->e->elements[x->child + k].area;
        }
        x->area = area;
    }
    return IMP_OK;
}

enum imp_status imp__el_split(imp_elements *e, const uint32_t *element, size_t n)
{
    size_t coefficients = 0;
    for (size_t i = 0; i < n; i++)
        coefficients +=
            4 * (size_t)imp__el_n(e, imp__el_root_of(e, &e->elements[element[i]]));
    enum imp_status st = room_make(e, 4 * n, coefficients);
    if (st != IMP_OK) return st;
    const size_t elements = e->n_elements, coef = e->n_coef;
    for (size_t i = 0; i < n; i++) {
        e->elements[element[i]].child = (uint32_t)e->n_elements;
        for (int k = 0; k < 4; k++) place(e, e->elements[element[i]].root, element[i]);
    }
    struct splits s = {e, element, n};
    const struct imp_loop loop = {.n_items = (n + SPLITS_PER_ITEM - 1) / SPLITS_PER_ITEM,
                                  .work = split_work,
                                  .payload = &s};
    st = imp__parallel(e->ctx, &loop, NULL);
    if (st == IMP_OK) return st;
    for (size_t i = 0; i < n; i++) e->elements[element[i]].child = 0; /* as it was */
    e->n_elements = elements;
    e->n_coef = coef;
    return st;
}

/* Which piece of the triangle or square p of the root's coordinates holds (u, v). */
static int piece_at(int corners, const imp_v3 *p, double u, double v)
{
    if (corners == 4) {
        const imp_v3 mid = (p[0] + p[2]) * 0.5;
        return (u >= mid[0]) + 2 * (v >= mid[1]);
    }
    /* Weights of the three corners; half or more belongs to that corner. Pieces are the
     * root's (u, v) triangle scaled, some turned by 180 degrees. */
    const double b1 = (u - p[0][0]) / (p[1][0] - p[0][0]);
    const double b2 = (v - p[0][1]) / (p[2][1] - p[0][1]);
    return 1 - b1 - b2 > 0.5 ? 0 : b1 > 0.5 ? 1 : b2 > 0.5 ? 2 : 3;
}

static void whole(int corners, imp_v3 p[4])
{
    const imp_v3 square[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    memcpy(p, square, sizeof square);
    if (corners == 3) p[2] = imp__v3(0, 1, 0);
}

uint32_t imp__el_path(int corners, double u, double v)
{
    imp_v3 p[4], sub[4];
    uint32_t path = 0;
    whole(corners, p);
    for (int level = 0; level < EL_LEVEL_MAX; level++) {
        const int q = piece_at(corners, p, u, v);
        path = 4 * path + (uint32_t)q;
        quarter(corners, p, q, sub);
        memcpy(p, sub, sizeof p);
    }
    return path;
}

/* Coordinates stay dyadic, so the corners of neighbours compare equal to the bit. */
uint32_t imp__el_find(const imp_elements *e, uint32_t root, double u, double v,
                      double uv[4][2])
{
    const int corners = e->roots[root].corners;
    imp_v3 p[4], sub[4];
    uint32_t i = e->roots[root].element;
    whole(corners, p);
    while (e->elements[i].child) {
        const int q = piece_at(corners, p, u, v);
        quarter(corners, p, q, sub);
        memcpy(p, sub, sizeof p);
        i = e->elements[i].child + (uint32_t)q;
    }
    for (int k = 0; k < corners && uv; k++) uv[k][0] = p[k][0], uv[k][1] = p[k][1];
    return i;
}

uint32_t imp__el_find_level(const imp_elements *e, uint32_t root, double u, double v,
                            int level)
{
    uint32_t i = e->roots[root].element;
    if (e->roots[root].corners == 4) {
        for (; level > 0 && e->elements[i].child; level--) {
            const int q = (u >= 0.5) + 2 * (v >= 0.5);
            u = 2 * u - (u >= 0.5);
            v = 2 * v - (v >= 0.5);
            i = e->elements[i].child + (uint32_t)q;
        }
        return i;
    }
    i = imp__el_find(e, root, u, v, NULL);
    while (e->elements[i].level > level) i = e->elements[i].parent;
    return i;
}
