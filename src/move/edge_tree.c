/* SPDX-License-Identifier: Apache-2.0
 *
 * The tree over edges, by which silhouettes are chosen (edge_choice.h). Its leaves are runs of the
 * list, whose order follows a curve through space. */
#include "base/context.h"
#include "edge_choice.h"

#define LEAF  4    /* edges at most; each of them is tested */
#define DOWN  2    /* levels that one choice goes down, */
#define DEEP  5    /* by what is so many levels below */
#define SLACK 1e-6 /* for rounding: where normals are as good as across the line */

struct imp__edge_node {
    imp_v3 centre, axis;         /* of the sphere; of the cone */
    double radius, cosine, sine; /* of the cone's half angle; cosine < 0: any normal */
    size_t lo, hi;               /* edges */
    size_t second; /* its second child, the first is the next node; 0: a leaf */
};

/* Normals of the two faces, turned the same way round. It is a silhouette of a line r where r.a and r.b
 * have different signs. */
struct turned {
    imp_v3 a, b;
    bool two; /* else it is a border, or has more faces */
};

static struct turned normals(const struct imp__edges *edges, const struct imp__edge *e)
{
    const struct imp__edge_face *f = &edges->face[e->first];
    if (e->n_faces != 2) return (struct turned){.two = false};
    const imp_v3 along = imp__normalize(e->b - e->a);
    struct turned t = {imp__cross(along, f[0].in), imp__cross(f[1].in, along), true};
    if (imp__dot(t.a, f[0].n) < 0) {
        t.a = -t.a;
        t.b = -t.b;
    }
    return t;
}

struct making {
    struct imp__edge_tree *tree;
    const struct turned *turned; /* of each edge */
};

/* A cone that has all normals, if any has. */
static void cone_find(const struct making *x, struct imp__edge_node *node)
{
    imp_v3 sum = {0};
    bool all = true;
    node->cosine = -1;
    for (size_t k = node->lo; k < node->hi && all; k++) {
        all = x->turned[k].two;
        sum += x->turned[k].a + x->turned[k].b;
    }
    if (!all || !(imp__length(sum) > 0)) return;
    node->axis = imp__normalize(sum);
    double least = 1;
    for (size_t k = node->lo; k < node->hi && least > 0; k++) {
        least = imp_min(least, imp__dot(node->axis, x->turned[k].a));
        least = imp_min(least, imp__dot(node->axis, x->turned[k].b));
    }
    node->cosine = least;
    node->sine = sqrt(imp_max(1 - least * least, 0.0));
}

struct box {
    imp_v3 lo, hi;
};
static void box_add(struct box *box, imp_v3 lo, imp_v3 hi)
{
    for (int i = 0; i < 3; i++) {
        box->lo[i] = imp_min(box->lo[i], lo[i]);
        box->hi[i] = imp_max(box->hi[i], hi[i]);
    }
}

/* Returns the node behind the last. */
static size_t node_make(const struct making *x, size_t k, size_t lo, size_t hi,
                        struct box *box)
{
    struct imp__edge_node *node = &x->tree->node[k];
    const struct imp__edge *edge = x->tree->edges->edge;
    size_t next = k + 1;
    *node = (struct imp__edge_node){.lo = lo, .hi = hi};
    *box = (struct box){edge[lo].a, edge[lo].a};
    if (hi - lo <= LEAF) {
        for (size_t j = lo; j < hi; j++) {
            box_add(box, edge[j].a, edge[j].a);
            box_add(box, edge[j].b, edge[j].b);
        }
    } else {
        const size_t half = lo + (hi - lo) / 2;
        struct box second;
        node->second = node_make(x, k + 1, lo, half, box);
        next = node_make(x, node->second, half, hi, &second);
        box_add(box, second.lo, second.hi);
    }
    node->centre = (box->lo + box->hi) * 0.5;
    node->radius = 0.5 * imp__length(box->hi - box->lo);
    cone_find(x, node);
    return next;
}

enum imp_status imp__edge_tree_build(const struct imp__edges *edges,
                                     struct imp__edge_tree *out)
{
    *out = (struct imp__edge_tree){.ctx = edges->ctx, .edges = edges};
    if (edges->n == 0) return IMP_OK;
    out->node = imp__alloc_raw(edges->ctx, 2 * edges->n, sizeof *out->node);
    struct turned *turned = imp__alloc_raw(edges->ctx, edges->n, sizeof *turned);
    out->root = imp__alloc(edges->ctx, (size_t)edges->n_runs, sizeof *out->root);
    if (out->node && turned && out->root) {
        struct box box;
        size_t next = 0;
        for (size_t k = 0; k < edges->n; k++) turned[k] = normals(edges, &edges->edge[k]);
        for (int k = 0; k < edges->n_runs; k++) {
            const size_t lo = edges->run[k].first, hi = edges->run[k + 1].first;
            out->root[k] = hi > lo ? next : SIZE_MAX;
            if (hi > lo)
                next = node_make(&(struct making){out, turned}, next, lo, hi, &box);
        }
    }
    imp__release(edges->ctx, turned);
    return out->node && turned && out->root
               ? IMP_OK
               : imp__error(edges->ctx, IMP_E_NOMEM, "no memory for edges");
}

void imp__edge_tree_free(struct imp__edge_tree *tree)
{
    if (tree->ctx) imp__release(tree->ctx, tree->node);
    if (tree->ctx) imp__release(tree->ctx, tree->root);
    *tree = (struct imp__edge_tree){0};
}

/* May a line from there pass a silhouette of this node? With angles c of the cone and s of the
 * sphere as it is seen, sin s = R/d, and g between the axis and a right angle to the line:
 * |g| <= c + s, or  |axis.r| <= sin(c) sqrt(d^2 - R^2) + cos(c) R. */
static bool may_pass(const struct imp__edge_node *node, imp_v3 from, bool parallel)
{
    if (node->cosine <= 0) return true;
    const imp_v3 r = parallel ? from : node->centre - from;
    const double d2 = imp__dot(r, r), R = parallel ? 0 : node->radius;
    if (!(R * R < d2 * (node->cosine * node->cosine)))
        return true; /* c + s: above a right
                                                                      angle */
    const double across = sqrt(d2 - R * R);
    return fabs(imp__dot(node->axis, r)) <=
           node->sine * across + node->cosine * R + SLACK * (across + R);
}

static bool is_silhouette(const struct imp__edge_tree *tree, size_t k, imp_v3 from,
                          bool parallel)
{
    const struct imp__edge *e = &tree->edges->edge[k];
    const imp_v3 m = imp__cross(e->b - e->a, parallel ? from : e->a - from);
    return imp__edge_side(tree->edges, e, m) != 0;
}

/* Nodes DOWN levels below one, and the probabilities of what may be silhouettes in them, as nodes DEEP
 * levels below it say. */
struct below {
    int n;
    const struct imp__edge_node *node[1 << DOWN];
    double part[1 << DOWN], sum;
};

static void below_find(const struct imp__edge_tree *tree,
                       const struct imp__edge_node *node, const double *chance,
                       imp_v3 from, bool parallel, int level, struct below *out)
{
    const int before = out->n;
    double part = 0;
    if (!may_pass(node, from, parallel)) return;
    if (level == DOWN || (node->second == 0 && level < DOWN)) {
        out->node[out->n] = node;
        out->part[out->n++] = 0;
    }
    if (node->second > 0 && level < DEEP) {
        below_find(tree, node + 1, chance, from, parallel, level + 1, out);
        below_find(tree, tree->node + node->second, chance, from, parallel, level + 1,
                   out);
    } else {
        if (node->second > 0) part = chance[node->hi] - chance[node->lo];
        for (size_t k = node->lo; node->second == 0 && k < node->hi; k++)
            if (is_silhouette(tree, k, from, parallel)) part += chance[k + 1] - chance[k];
        out->part[out->n - 1] += part;
        out->sum += part;
    }
    if (out->n > before && !(out->part[out->n - 1] > 0) && level <= DOWN) out->n--;
}

static ptrdiff_t leaf_choose(const struct imp__edge_tree *tree,
                             const struct imp__edge_node *leaf, const double *chance,
                             imp_v3 from, bool parallel, double *u, double *pmf)
{
    double part[LEAF], sum = 0;
    for (size_t k = leaf->lo; k < leaf->hi; k++)
        sum += part[k - leaf->lo] =
            is_silhouette(tree, k, from, parallel) ? chance[k + 1] - chance[k] : 0;
    if (!(sum > 0)) return -1;
    double x = *u * sum;
    size_t last = 0;
    for (size_t k = 0; k < leaf->hi - leaf->lo; k++) {
        if (!(part[k] > 0)) continue;
        last = k;
        if (x < part[k]) break;
        x -= part[k];
    }
    *u = imp_clamp(x / part[last], 0.0, 1 - 0x1p-53);
    *pmf *= part[last] / sum;
    return (ptrdiff_t)(leaf->lo + last);
}

ptrdiff_t imp__edge_tree_choose(const struct imp__edge_tree *tree, int run,
                                const double *chance, imp_v3 from, bool parallel,
                                double *u, double *pmf)
{
    if (imp_unlikely(tree->root[run] == SIZE_MAX)) return -1;
    const struct imp__edge_node *node = tree->node + tree->root[run];
    *pmf = 1;
    while (node->second > 0) {
        struct below below;
        below.n = 0;
        below.sum = 0;
        below_find(tree, node, chance, from, parallel, 0, &below);
        if (below.n == 0) return -1;
        double x = *u * below.sum;
        int k = 0;
        for (; k < below.n - 1 && x >= below.part[k]; k++) x -= below.part[k];
        *u = imp_clamp(x / below.part[k], 0.0, 1 - 0x1p-53);
        *pmf *= below.part[k] / below.sum;
        node = below.node[k];
    }
    return leaf_choose(tree, node, chance, from, parallel, u, pmf);
}
