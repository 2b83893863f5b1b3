/* SPDX-License-Identifier: Apache-2.0
 *
 * Making the tree of lights, and its strengths anew when parameters have changed.
 *
 * Nodes are split where area of the box times solid angle of the directions that light
 * leaves in is least, summed over both halves by their number of lights (the orientation
 * heuristic of Conty Estevez and Kulla 2018, section 4.1, without energies, which move). */
#include "base/context.h"
#include "light_tree.h"
#include "light_weights.h"
#include "scene_build.h"

#define BINS  12
#define DEPTH 40 /* of splits by bins; below, lights are halved in their order */
#define LEAST                                                                            \
    1e-3 /* strength of a light that is dark, over the mean: it may get brighter,
                       and its derivative is wanted */
#define EVENLY                                                                           \
    0.1 /* part of the strength of a mesh that its triangles have by area alone:
                       their radiance is that of some points */

/* ---- Shape ----------------------------------------------------------------------- */

/* A node, and the half angle of its cone of normals, which sums over bins ask for often. */
struct bound {
    struct imp_light_node node;
    double angle;
};

struct split {
    struct imp_light_tree *t;
    struct bound *bound; /* [n_items] */
    int32_t *order;      /* [n_items] items, of a node next to each other */
    /* The cone that solid angles were last found for: mostly the next one is the same. */
    float cos_normals, cos_reach;
    double directions;
};

static inline double centre(const struct bound *b, int k)
{
    return 0.5 * ((double)b->node.lo[k] + b->node.hi[k]);
}

static void enclose(const struct bound *a, const struct bound *b, struct bound *out)
{
    const float cos_a = a->node.cos_normals, cos_b = b->node.cos_normals;
    const double angle_a = a->angle, angle_b = b->angle;
    imp__light_enclose(&a->node, angle_a, &b->node, angle_b, &out->node);
    out->angle = out->node.cos_normals == cos_a   ? angle_a
                 : out->node.cos_normals == cos_b ? angle_b
                                                  : imp__light_angle(&out->node);
}

/* Solid angle of the normals, and of what leaves around them with its cosine (PBR 4e, Eq.
 * 12.12). */
static double directions(const struct bound *b)
{
    const double o = b->angle, e = acos(imp_clamp((double)b->node.cos_reach, -1.0, 1.0));
    const double w = imp_min(o + e, IMP_PI);
    return IMP_2PI * (1 - cos(o)) +
           IMP_PI / 2 * (2 * w * sin(o) - cos(o - 2 * w) - 2 * o * sin(o) + cos(o));
}

static double cost(struct split *s, const struct bound *b, int count)
{
    const struct imp_light_node *n = &b->node;
    if (n->cos_normals != s->cos_normals || n->cos_reach != s->cos_reach) {
        s->cos_normals = n->cos_normals;
        s->cos_reach = n->cos_reach;
        s->directions = directions(b);
    }
    const double x = (double)n->hi[0] - n->lo[0], y = (double)n->hi[1] - n->lo[1],
                 z = (double)n->hi[2] - n->lo[2];
    return count * s->directions * (x * y + y * z + z * x);
}

/* Where to cut [first, end) of the order: moves items, returns the first of the second
 * half. */
static int cut(struct split *s, int first, int end, int depth)
{
    double lo[3], hi[3], best = INFINITY;
    int axis = -1, bin = 0;
    for (int k = 0; k < 3; k++) {
        lo[k] = INFINITY;
        hi[k] = -INFINITY;
        for (int i = first; i < end; i++) {
            const double c = centre(&s->bound[s->order[i]], k);
            lo[k] = imp_min(lo[k], c);
            hi[k] = imp_max(hi[k], c);
        }
    }
    const double longest = imp_max(hi[0] - lo[0], imp_max(hi[1] - lo[1], hi[2] - lo[2]));
#define BIN_OF(i, k)                                                                     \
    imp_min((int)((centre(&s->bound[i], k) - lo[k]) / (hi[k] - lo[k]) * BINS), BINS - 1)
    for (int k = 0; k < 3 && depth < DEPTH; k++) {
        if (!(hi[k] > lo[k])) continue;
        struct bound in[BINS], below;
        int count[BINS] = {0};
        double before[BINS];
        for (int i = first; i < end; i++) {
            const int b = BIN_OF(s->order[i], k);
            const struct bound *one = &s->bound[s->order[i]];
            if (count[b]++ == 0) in[b] = *one;
            else enclose(&in[b], one, &in[b]);
        }
        int n = 0;
        double own = INFINITY; /* cost of the bins so far */
        for (int b = 0; b < BINS - 1; b++) {
            if (count[b]) {
                if (n == 0) below = in[b];
                else enclose(&below, &in[b], &below);
                n += count[b];
                own = cost(s, &below, n);
            }
            before[b] = own;
        }
        n = 0;
        for (int b = BINS - 1; b > 0; b--) {
            if (count[b]) {
                if (n == 0) below = in[b];
                else enclose(&below, &in[b], &below);
                n += count[b];
                own = cost(s, &below, n);
            }
            if (n == 0) continue;
            const double all = (before[b - 1] + own) * longest / (hi[k] - lo[k]);
            if (all < best) {
                best = all;
                axis = k;
                bin = b;
            }
        }
    }
    if (axis < 0) return first + (end - first) / 2;
    int middle = first;
    for (int i = first; i < end; i++) { /* stable enough: by position alone */
        const int32_t item = s->order[i];
        if (BIN_OF(item, axis) >= bin) continue;
        s->order[i] = s->order[middle];
        s->order[middle++] = item;
    }
#undef BIN_OF
    return middle > first && middle < end ? middle : first + (end - first) / 2;
}

static void node_make(struct split *s, int first, int end, int parent, int depth)
{
    struct imp_light_tree *t = s->t;
    const int at = t->n_nodes++;
    if (end - first == 1) {
        const int item = s->order[first];
        t->node[at] = s->bound[item].node;
        t->node[at].second = -1 - item;
        t->item[item].leaf = at;
    } else {
        const int middle = cut(s, first, end, depth);
        node_make(s, first, middle, at, depth + 1);
        t->node[at].second = t->n_nodes;
        node_make(s, middle, end, at, depth + 1);
    }
    t->node[at].parent = parent;
}

/* ---- Strengths ------------------------------------------------------------------- */

/* By the lights' present parameters; the cones of lights that parameters open. */
static void strengths_set(void *payload)
{
    struct imp_light_tree *t = payload;
    const struct imp_scene *scene = t->scene;
    struct imp_light_turns turns;
    double sum = 0;
    int n = 0;
    imp__light_turns(&turns);
    for (int i = 0; i < t->n_items; n++) {
        const int e = t->item[i].emitter;
        const double all = imp__light_strength(scene, &turns, scene->emitters[e]);
        sum += all;
        for (; i < t->n_items && t->item[i].emitter == e; i++)
            t->node[t->item[i].leaf].strength = (float)all;
    }
    const double least = sum > 0 ? LEAST * sum / n : 1;
    for (int i = 0; i < t->n_items; i++) {
        const struct imp_light_item *item = &t->item[i];
        const struct imp_emitter *e = scene->emitters[item->emitter];
        struct imp_light_node *leaf = &t->node[item->leaf];
        double own = imp_max((double)leaf->strength, least) * item->part;
        if (item->prim >= 0 && e->ops->flags & IMP_EMITTER_UNIFORM)
            own = EVENLY * own + (1 - EVENLY) * 0.25 *
                                     imp__light_triangle_radiance(scene, e, item->prim) *
                                     e->shape->area * item->part;
        own *= e->weight;
        /* What can count has a probability. */
        leaf->strength = own > 0 ? fmaxf((float)own, 1e-30f) : 0;
        imp__light_cone(e, leaf);
    }
    for (int i = t->n_nodes - 1; i >= 0; i--)
        if (t->node[i].second >= 0)
            imp__light_union(&t->node[i + 1], &t->node[t->node[i].second], &t->node[i]);
}

/* ---- Making ---------------------------------------------------------------------- */

static double triangle_area(const struct imp_shape *s, int prim)
{
    const uint32_t *i = s->triangles.indices + 3 * (size_t)prim;
    double p[3][3];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            p[c][k] = (double)s->triangles.positions[3 * (size_t)i[c] + (size_t)k];
    const imp_v3 a = imp__v3(p[1][0] - p[0][0], p[1][1] - p[0][1], p[1][2] - p[0][2]),
                 b = imp__v3(p[2][0] - p[0][0], p[2][1] - p[0][1], p[2][2] - p[0][2]);
    return 0.5 * imp__length(imp__cross(a, b));
}

static bool is_far(const struct imp_emitter *e)
{
    return e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR) ||
           (!e->shape && !(e->ops->flags & IMP_EMITTER_DELTA));
}

static size_t items_of(const struct imp_emitter *e)
{
    return is_far(e)                    ? 0
           : imp__light_in_triangles(e) ? e->shape->triangles.n_triangles
                                        : 1;
}

/* Chances of lights without end, and of all others against them. */
static void far_set(struct imp_light_tree *t)
{
    const struct imp_scene *scene = t->scene;
    double far = 0, near = 0;
    for (int k = 0; k < scene->n_emitters; k++)
        if (!is_far(scene->emitters[k])) near = imp_max(scene->emitters[k]->weight, near);
    for (int k = 0; k < t->n_far; k++) {
        t->far_share[k] = scene->emitters[t->far_light[k]]->weight;
        far += t->far_share[k];
    }
    for (int k = 0; k < t->n_far && far > 0; k++) t->far_share[k] /= far;
    t->near_chance = far + near > 0 ? near / (far + near) : 0;
}

static void items_fill(struct imp_light_tree *t)
{
    struct imp_scene *scene = t->scene;
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        const size_t n = items_of(e);
        t->first[k] = is_far(e) ? -1 : t->n_items;
        if (is_far(e)) t->far_light[t->n_far++] = k;
        for (size_t j = 0; j < n; j++) {
            const bool all = !imp__light_in_triangles(e);
            t->item[t->n_items++] = (struct imp_light_item){
                .emitter = k,
                .prim = all ? -1 : (int32_t)j,
                .part = all ? 1 : triangle_area(e->shape, (int)j) / e->shape->area};
        }
    }
    far_set(t);
}

void imp__light_tree_weigh(struct imp_scene *scene)
{
    if (!scene->light_tree) return;
    far_set(scene->light_tree);
    strengths_set(scene->light_tree);
}

enum imp_status imp__light_tree_build(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    size_t n = 0;
    struct split s = {0};
    for (int k = 0; k < scene->n_emitters; k++) n += items_of(scene->emitters[k]);
    if (n > INT32_MAX / 2) return IMP_OK; /* lights are chosen by their weights */
    struct imp_light_tree *t = imp__arena_array(&scene->arena, 1, sizeof *t);
    if (!t) return imp__build_no_memory(scene);
    *t = (struct imp_light_tree){
        .scene = scene,
        .item = imp__arena_array(&scene->arena, n + 1, sizeof *t->item),
        .node = imp__arena_array(&scene->arena, 2 * n + 1, sizeof *t->node),
        .first = imp__arena_array(&scene->arena, (size_t)scene->n_emitters + 1,
                                  sizeof *t->first),
        .far_light = imp__arena_array(&scene->arena, (size_t)scene->n_emitters + 1,
                                      sizeof *t->far_light),
        .far_share = imp__arena_array(&scene->arena, (size_t)scene->n_emitters + 1,
                                      sizeof *t->far_share)};
    s = (struct split){t,
                       imp__alloc(scene->ctx, n + 1, sizeof *s.bound),
                       imp__alloc(scene->ctx, n + 1, sizeof *s.order),
                       NAN,
                       NAN,
                       0};
    if (!t->item || !t->node || !t->first || !t->far_light || !t->far_share || !s.bound ||
        !s.order)
        IMP_TRY(imp__build_no_memory(scene));
    items_fill(t);
    for (int i = 0; i < t->n_items; i++) {
        s.order[i] = i;
        struct imp_light_node *node = &s.bound[i].node;
        imp__light_bound(scene->emitters[t->item[i].emitter], t->item[i].prim, node);
        if (scene->emitters[t->item[i].emitter]->ops->cone) /* parameters move it */
            node->cos_normals = node->cos_reach = -1;
        node->strength = 0;
        s.bound[i].angle = imp__light_angle(node);
    }
    if (t->n_items > 0) node_make(&s, 0, t->n_items, -1, 0);
    strengths_set(t);
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        if (t->first[k] >= 0)
            IMP_TRY(imp__build_watch(scene, e->input, e->n_in, strengths_set, t));
    }
    scene->light_tree = t;
out:
    imp__release(scene->ctx, s.bound);
    imp__release(scene->ctx, s.order);
    return st;
}
