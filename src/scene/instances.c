/* SPDX-License-Identifier: Apache-2.0
 *
 * Places of instances by number (instances.h), the surface at a hit in one, and the shape with the
 * material that an instance covers it with. */
#include "instances.h"
#include "kind/shape/shape.h"

void imp__instance_box(const struct imp_instance *p, imp_v3 *lo, imp_v3 *hi)
{
    *lo = p->group->lo;
    *hi = p->group->hi;
    if (p->motion) imp__motion_box(p->motion, lo, hi);
    else imp__map_box(&p->to_world, lo, hi);
}

/* The instance of a group that a place begins with; *place becomes the rest. */
static const struct imp_instance *descend(const struct imp_group *g, int64_t *place)
{
    int at = 0, above = g->n_instances - 1; /* the last with before < place */
    while (at < above) {
        const int middle = at + (above - at + 1) / 2;
        if (g->instance[middle].before < *place) at = middle;
        else above = middle - 1;
    }
    *place -= g->instance[at].before + 1;
    return &g->instance[at];
}

void imp__placed_surface(const struct imp_scene *scene, const struct imp_hit *hit,
                         const imp_v3 *o, const imp_v3 *d, struct imp_surface *out)
{
    const struct imp_shape *s = scene->shapes[hit->shape];
    const struct imp_group *g = scene->world;
    struct imp_map to_world, to_local;
    imp_v3 from = *o, along = *d;
    bool first = true;
    for (int64_t place = hit->place; place > 0; first = false) {
        const struct imp_instance *p = descend(g, &place);
        struct imp_map at[2] = {p->to_world, p->to_local};
        if (p->motion) imp__motion_at(p->motion, hit->time, &at[0], &at[1]);
        from = imp__map_point(&at[1], from);
        along = imp__map_vector(&at[1], along);
        to_world = first ? at[0] : imp__map_product(&to_world, &at[0]);
        to_local = first ? at[1] : imp__map_product(&at[1], &to_local);
        g = p->group;
    }
    s->ops->surface(s, hit, &from, &along, out);
    imp__surface_move(out, &to_world, &to_local);
}

const struct imp_group *imp__place_group(const struct imp_scene *scene, int64_t place)
{
    const struct imp_group *g = scene->world;
    bool moves = false;
    while (place > 0) {
        const struct imp_instance *p = descend(g, &place);
        moves |= p->motion && g != scene->world;
        g = p->group;
    }
    return moves ? NULL : g;
}

int imp__place_clock(const struct imp_scene *scene, int64_t place)
{
    if (place == 0) return -1;
    const int k = imp__place_instance(scene, place);
    return scene->world->instance[k].motion ? k : -1;
}

int imp__place_instance(const struct imp_scene *scene, int64_t place)
{
    return (int)(descend(scene->world, &place) - scene->world->instance);
}

void imp__place_map(const struct imp_scene *scene, int64_t place, double time,
                    struct imp_map *to_world, struct imp_map *to_local)
{
    const struct imp_group *g = scene->world;
    for (bool first = true; place > 0; first = false) {
        const struct imp_instance *p = descend(g, &place);
        struct imp_map at[2] = {p->to_world, p->to_local};
        if (p->motion) imp__motion_at(p->motion, time, &at[0], &at[1]);
        *to_world = first ? at[0] : imp__map_product(to_world, &at[0]);
        *to_local = first ? at[1] : imp__map_product(&at[1], to_local);
        g = p->group;
    }
}

int imp__covered_shape(const struct imp_covered *c, int shape)
{
    const struct imp_group *g = c->group;
    int at = 0; /* of the shape in g->within */
    for (int n = g->n_within; n > 1;) {
        const int half = n / 2;
        if (g->within[at + half] <= shape) at += half;
        n -= half;
    }
    return c->first + at;
}

int imp__placed_shape(const struct imp_scene *scene, int shape, int64_t place)
{
    const struct imp_group *g = scene->world;
    const struct imp_covered *covered = NULL;
    int raised = -1;
    for (bool outermost = true; place > 0; outermost = false) {
        const struct imp_instance *p = descend(g, &place);
        if (outermost && p->raised) raised = p->raised[place];
        if (!covered) covered = p->covered;
        g = p->group;
    }
    if (raised >= 0) return raised + (shape - g->first);
    return covered ? imp__covered_shape(covered, shape) : shape;
}
