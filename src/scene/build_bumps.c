/* SPDX-License-Identifier: Apache-2.0
 *
 * Bump maps in instances. Their heights are lengths of the world, as in Mitsuba, but the
 * evaluation of a material has only the shape and uv of a vertex. So where the map M from
 * a group to the world changes lengths or mirrors, the scene's list has copies of the
 * group's shapes for that place, which contain M. In the frame of the surface the raised
 * normal depends on
 *
 *     M^T M and the sign of det M                                                      (1)
 *
 * alone: places that differ by a rotation share their copies. */
#include "instances.h"
#include "scene_build.h"

#define PLACES_MAX 65536 /* in an instance whose bump maps are stretched */
#define SEARCH_MAX                                                                       \
    32 /* copies, the last ones, among which the same stretch is looked for */
#define SAME_WITHIN 1e-6 /* numbers of matrices come with about so many digits */

/* (1): the rows of M^T M, and the sign. */
struct stretch {
    double gram[9];
    bool mirrors;
};

struct imp_raised {
    const struct imp_raised *next;
    const struct imp_group *group;
    const struct imp_covered *covered;
    struct stretch stretch;
    struct imp_map map[2]; /* to the world, and back */
    int first;             /* copy of the group's first shape */
};

static struct stretch stretch_of(const struct imp_map *map)
{
    const double *m = map->m;
    const imp_v3 c[3] = {{m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}};
    struct stretch s;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) s.gram[3 * i + j] = imp__dot(c[i], c[j]);
    s.mirrors = imp__dot(imp__cross(c[0], c[1]), c[2]) < 0;
    return s;
}

static bool is_same(const struct stretch *a, const struct stretch *b, double within)
{
    double off = 0, size = 0;
    for (int k = 0; k < 9; k++) {
        off = imp_max(fabs(a->gram[k] - b->gram[k]), off);
        size = imp_max(fabs(a->gram[k]), size);
    }
    return off <= within * size && a->mirrors == b->mirrors;
}

/* One factor for all directions? */
static bool is_even(const struct stretch *s)
{
    const double f = s->gram[0];
    const struct stretch even = {{f, 0, 0, 0, f, 0, 0, 0, f}, s->mirrors};
    return is_same(&even, s, SAME_WITHIN);
}
static bool is_none(const struct stretch *s)
{
    static const struct stretch none = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, false};
    return is_same(&none, s, SAME_WITHIN);
}

/* Stretches of an instance: when it begins to move, and at its end. */
static void stretches_of(const struct imp_instance *p, struct stretch of[2])
{
    of[0] = of[1] = stretch_of(&p->to_world);
    if (!p->motion) return;
    struct imp_map end, inverse;
    imp__motion_at(p->motion, p->motion->end, &end, &inverse);
    of[1] = stretch_of(&end);
}

bool imp__instance_stretches(const struct imp_instance *p)
{
    struct stretch of[2];
    stretches_of(p, of);
    return !is_none(&of[0]) || !is_none(&of[1]);
}

/* ---- Copies ---------------------------------------------------------------------------- */

/* What a place is in: instances from the outermost to one of them. */
struct chain {
    struct imp_map to_world, to_local;
    const struct imp_covered *covered; /* the outermost */
    bool stretches;
    bool steady; /* at all times in the same way */
};

static struct chain chain_of(const struct imp_instance *p, const struct chain *outer)
{
    struct chain c = {p->to_world, p->to_local, p->covered, imp__instance_stretches(p),
                      true};
    struct stretch of[2];
    if (outer) {
        c.to_world = imp__map_product(&outer->to_world, &p->to_world);
        c.to_local = imp__map_product(&p->to_local, &outer->to_local);
        c.stretches |= outer->stretches;
        c.steady = outer->steady;
        if (outer->covered) c.covered = outer->covered;
    }
    if (!p->motion) return c;
    stretches_of(p, of);
    c.steady &= is_same(&of[0], &of[1], SAME_WITHIN);
    if (outer) {
        of[0] = stretch_of(&outer->to_world);
        c.steady &= is_even(&of[0]);
    }
    return c;
}

/* Shape k of the group, with the material that it has there. */
static const struct imp_shape *shape_there(const struct imp_scene *scene,
                                           const struct imp_group *g,
                                           const struct chain *c, int k)
{
    const int shape = g->first + k;
    return scene->shapes[c->covered ? imp__covered_shape(c->covered, shape) : shape];
}

static enum imp_status copies_make(struct imp_scene *scene, const struct imp_group *g,
                                   const struct chain *c, int *first)
{
    enum imp_status st = IMP_OK;
    const struct stretch stretch = stretch_of(&c->to_world);
    int seen = 0;
    for (const struct imp_raised *r = scene->raised; r && seen < SEARCH_MAX;
         r = r->next, seen++)
        if (r->group == g && r->covered == c->covered &&
            is_same(&r->stretch, &stretch, 1e-9)) {
            *first = r->first;
            return IMP_OK;
        }
    struct imp_raised *made = imp__arena_array(&scene->arena, 1, sizeof *made);
    if (!made) return imp__build_no_memory(scene);
    *made = (struct imp_raised){
        scene->raised,  g, c->covered, stretch, {c->to_world, c->to_local},
        scene->n_shapes};
    for (int k = 0; k < g->n_shapes; k++) {
        struct imp_shape *s = imp__arena_array(&scene->arena, 1, sizeof *s);
        if (!s) return imp__build_no_memory(scene);
        *s = *shape_there(scene, g, c, k);
        s->index = scene->n_shapes;
        s->placed = made->map;
        IMP_TRY(
            imp__build_list_add(scene, (void ***)&scene->shapes, &scene->n_shapes, s));
    }
    scene->raised = made;
    *first = made->first;
out:
    return st;
}

/* first [1 + places in the group of p]: in the order of places, depth first. */
static enum imp_status places_raise(struct imp_scene *scene, const struct imp_node *node,
                                    const struct imp_instance *p,
                                    const struct chain *outer, int *first, bool *any)
{
    enum imp_status st = IMP_OK;
    const struct imp_group *g = p->group;
    const struct chain c = chain_of(p, outer);
    bool bumped = false;
    *first = -1;
    for (int k = 0; k < g->n_shapes && c.stretches && !bumped; k++)
        bumped = imp__is_bumped(scene, shape_there(scene, g, &c, k)->bsdf);
    if (bumped && !c.steady)
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                "it stretches a bumpmap of shapegroup '%s' that moves, "
                                "from one time to another differently: its heights are "
                                "lengths of the world",
                                g->name));
    if (bumped) IMP_TRY(copies_make(scene, g, &c, first));
    *any |= bumped;
    for (int i = 0; i < g->n_instances; i++) {
        const struct imp_instance *in = &g->instance[i];
        IMP_TRY(places_raise(scene, node, in, &c, first + 1 + in->before, any));
    }
out:
    return st;
}

enum imp_status imp__bumps_place(struct imp_scene *scene, const struct imp_node *node,
                                 struct imp_instance *p)
{
    enum imp_status st = IMP_OK;
    const struct imp_group *g = p->group;
    const bool bumped = p->covered ? imp__is_bumped(scene, p->covered->bsdf) : g->bumped;
    bool any = false;
    if (!bumped || !(g->stretched || imp__instance_stretches(p))) return IMP_OK;
    if (g->n_places >= PLACES_MAX)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "it stretches bump maps, and in its group there are %lld "
                               "places; at most %d are possible",
                               (long long)g->n_places, PLACES_MAX - 1);
    int *first = imp__arena_take(&scene->arena, (size_t)g->n_places + 1, sizeof *first);
    if (!first) return imp__build_no_memory(scene);
    IMP_TRY(places_raise(scene, node, p, NULL, first, &any));
    if (any) p->raised = first;
out:
    return st;
}
