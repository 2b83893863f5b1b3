/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangles are parted at the median of their middles, along the longest side of each box
 * (body_tree.h). */
#include "body_tree.h"
#include "base/arguments.h"
#include "base/context.h"

#define LEAF 4

static double middle(const struct imp__body_triangle *f, int axis)
{
    return f->p[0][axis] + f->p[1][axis] + f->p[2][axis];
}

/* Hoare's selection: those before `half` have no larger middles than those from there on. */
static void part(struct imp__body_triangle *f, size_t from, size_t till, size_t half,
                 int axis)
{
    ptrdiff_t lo = (ptrdiff_t)from, hi = (ptrdiff_t)till - 1;
    while (lo < hi) {
        const double pivot = middle(&f[lo + (hi - lo) / 2], axis);
        ptrdiff_t i = lo, j = hi;
        while (i <= j) {
            while (middle(&f[i], axis) < pivot) i++;
            while (middle(&f[j], axis) > pivot) j--;
            if (i > j) break;
            const struct imp__body_triangle other = f[i];
            f[i++] = f[j];
            f[j--] = other;
        }
        if ((ptrdiff_t)half <= j) hi = j;
        else if ((ptrdiff_t)half >= i) lo = i;
        else break;
    }
}

/* Returns the node behind the last. */
static size_t tree_make(struct imp__body_tree *t, size_t k, size_t from, size_t till)
{
    struct imp__body_node *node = &t->node[k];
    imp_v3 lo = t->triangle[from].p[0], hi = lo;
    for (size_t i = from; i < till; i++)
        for (int c = 0; c < 9; c++) {
            const double x = t->triangle[i].p[c / 3][c % 3];
            lo[c % 3] = imp_min(lo[c % 3], x);
            hi[c % 3] = imp_max(hi[c % 3], x);
        }
    *node = (struct imp__body_node){.lo = lo, .hi = hi, .from = from, .till = till};
    if (till - from <= LEAF) return k + 1;
    const imp_v3 size = hi - lo;
    const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0
                     : size[1] >= size[2]                     ? 1
                                                              : 2;
    const size_t half = from + (till - from) / 2;
    part(t->triangle, from, till, half, axis);
    node->second = tree_make(t, k + 1, from, half);
    return tree_make(t, node->second, half, till);
}

enum imp_status imp__body_tree_build(const struct imp_scene *scene,
                                     const struct imp__body *body,
                                     struct imp__body_tree *out)
{
    const size_t n = scene->shapes[body->shape]->triangles.n_triangles;
    struct imp_map map[2];
    *out = (struct imp__body_tree){.n = n};
    if (n == 0) return IMP_OK;
    out->triangle = imp__alloc(scene->ctx, n, sizeof *out->triangle);
    out->node = imp__alloc(scene->ctx, 2 * n, sizeof *out->node);
    if (!out->triangle || !out->node) {
        imp__body_tree_free(scene->ctx, out);
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for edges");
    }
    if (body->place > 0) imp__place_map(scene, body->place, 0, &map[0], &map[1]);
    for (size_t k = 0; k < n; k++) {
        const struct imp__corners f =
            imp__corners_mapped(scene, body->shape, (int)k, body->place > 0 ? map : NULL);
        out->triangle[k] = (struct imp__body_triangle){{f.p[0], f.p[1], f.p[2]}, (int)k};
    }
    tree_make(out, 0, 0, n);
    return IMP_OK;
}

void imp__body_tree_free(imp_context *ctx, struct imp__body_tree *tree)
{
    imp__release(ctx, tree->triangle);
    imp__release(ctx, tree->node);
    *tree = (struct imp__body_tree){0};
}

static bool are_apart(const struct imp__body_node *a, const struct imp__body_node *b)
{
    for (int k = 0; k < 3; k++)
        if (a->lo[k] > b->hi[k] || b->lo[k] > a->hi[k]) return true;
    return false;
}

static double extent(const struct imp__body_node *node)
{
    const imp_v3 size = node->hi - node->lo;
    return imp__dot(size, size);
}

struct pairs {
    const struct imp__body_tree *a, *b;
    double apart;
    imp__body_pair *work;
    void *payload;
};

struct box {
    imp_v3 lo, hi;
};
static struct box box_of(const struct imp__body_triangle *f, double more)
{
    struct box box;
    for (int k = 0; k < 3; k++) {
        box.lo[k] = imp_min(imp_min(f->p[0][k], f->p[1][k]), f->p[2][k]) - more;
        box.hi[k] = imp_max(imp_max(f->p[0][k], f->p[1][k]), f->p[2][k]) + more;
    }
    return box;
}

/* A triangle with those of a leaf, from `from` on. */
static enum imp_status leaf_work(const struct pairs *x,
                                 const struct imp__body_triangle *f, size_t from,
                                 size_t till)
{
    const struct box own = box_of(f, x->apart);
    for (size_t l = from; l < till; l++) {
        const struct imp__body_triangle *g = &x->b->triangle[l];
        const struct box other = box_of(g, 0);
        bool apart = false;
        for (int k = 0; k < 3; k++)
            apart |= own.lo[k] > other.hi[k] || other.lo[k] > own.hi[k];
        if (!apart) IMP_CHECKED(x->work(x->payload, f, g));
    }
    return IMP_OK;
}

static enum imp_status descend(const struct pairs *x, size_t i, size_t j)
{
    const struct imp__body_node *a = &x->a->node[i], *b = &x->b->node[j];
    if (are_apart(a, b)) return IMP_OK;
    if (a->second == 0 && b->second == 0) {
        for (size_t k = a->from; k < a->till; k++)
            IMP_CHECKED(leaf_work(x, &x->a->triangle[k], b->from, b->till));
        return IMP_OK;
    }
    if (b->second == 0 || (a->second > 0 && extent(a) >= extent(b))) {
        IMP_CHECKED(descend(x, i + 1, j));
        return descend(x, a->second, j);
    }
    IMP_CHECKED(descend(x, i, j + 1));
    return descend(x, i, b->second);
}

/* Pairs within a node of one tree. */
static enum imp_status descend_own(const struct pairs *x, size_t i)
{
    const struct imp__body_node *a = &x->a->node[i];
    if (a->second > 0) {
        IMP_CHECKED(descend_own(x, i + 1));
        IMP_CHECKED(descend_own(x, a->second));
        return descend(x, i + 1, a->second);
    }
    for (size_t k = a->from; k < a->till; k++)
        IMP_CHECKED(leaf_work(x, &x->a->triangle[k], k + 1, a->till));
    return IMP_OK;
}

enum imp_status imp__body_pairs(const struct imp__body_tree *a,
                                const struct imp__body_tree *b, double apart,
                                imp__body_pair *work, void *payload)
{
    const struct pairs x = {a, b, apart, work, payload};
    if (a->n == 0 || b->n == 0) return IMP_OK;
    return a == b ? descend_own(&x, 0) : descend(&x, 0, 0);
}
