/* SPDX-License-Identifier: Apache-2.0 */
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

static struct imp_map product(const struct imp_map *a, const struct imp_map *b)
{
    struct imp_map c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            c.m[4 * i + j] = (a->m[4 * i] * b->m[j] + a->m[4 * i + 1] * b->m[4 + j]) +
                             (a->m[4 * i + 2] * b->m[8 + j] + (j == 3) * a->m[4 * i + 3]);
    return c;
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
        to_world = first ? at[0] : product(&to_world, &at[0]);
        to_local = first ? at[1] : product(&at[1], &to_local);
        g = p->group;
    }
    s->ops->surface(s, hit, &from, &along, out);
    out->p = imp__map_point(&to_world, out->p);
    out->ng = imp__normalize(imp__map_normal(&to_local, out->ng));
    out->n = imp__normalize(imp__map_normal(&to_local, out->n));
    out->dp_du = imp__map_vector(&to_world, out->dp_du);
    out->dp_dv = imp__map_vector(&to_world, out->dp_dv);
    imp__surface_frame(out);
}

int imp__placed_shape(const struct imp_scene *scene, int shape, int64_t place)
{
    const struct imp_group *g = scene->world;
    while (place > 0) {
        const struct imp_instance *p = descend(g, &place);
        g = p->group;
        if (!p->covered) continue;
        int at = 0; /* of the shape in g->within */
        for (int n = g->n_within; n > 1;) {
            const int half = n / 2;
            if (g->within[at + half] <= shape) at += half;
            n -= half;
        }
        return p->covered->first + at;
    }
    return shape;
}
