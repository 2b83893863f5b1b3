/* SPDX-License-Identifier: Apache-2.0 */
#include "bend.h"
#include <string.h>

bool imp__bend_meet(const struct imp_scene *scene, struct imp_bending *b,
                    const imp_v3 *from, imp_v3 *o, imp_v3 *d, struct imp_hit *hit,
                    double *ratio)
{
    struct imp__ride *r = &b->ride;
    if (!imp__ride(b->medium, scene, *from, b->ng, *d, r, hit)) return false;
    *d = r->end;
    *o = r->at.x - r->end * r->length;
    *ratio = r->j.eta / r->k.eta;
    b->through = b->medium;
    return true;
}

/* Where the index of a boundary stands among its inputs; -1: it has none. */
static int index_input(const struct imp_bsdf *b)
{
    for (int j = 0; j < b->n_own; j++)
        if (strcmp(b->ops->inputs[j].name, "eta") == 0) return j;
    return -1;
}

void imp__bend_inputs(const struct imp_vertex *v, imp_spec *in)
{
    const int j = index_input(v->bsdf);
    if (j >= 0) in[j] = v->in[j];
}

static bool drop(struct imp_walk *walk)
{
    walk->dropped = IMP_DROP_BENT;
    return false;
}

bool imp__bend_arrive(const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk, struct imp_bending *b, struct imp_vertex *v,
                      const struct imp_hit *hit, const struct imp_surface *at, imp_v3 d)
{
    const struct imp_medium *m = v->shape->interior;
    (void)tracer, (void)arena, (void)hit;
    b->through = NULL;
    if (!m) return b->medium && (v->bsdf->flags & IMP_BSDF_TRANSMIT) ? drop(walk) : true;
    const struct imp_medium *before = imp__dot(at->ng, d) < 0 ? NULL : m;
    if (b->medium != before) return drop(walk);
    const int j = index_input(v->bsdf);
    if (j >= 0) v->in[j] = imp__spec(imp__graded_index(m->graded, &at->p) / m->outside);
    return true;
}

void imp__bend_leave(struct imp_bending *b, const struct imp_vertex *v,
                     const struct imp_surface *at, imp_v3 d)
{
    if (v->shape->interior)
        b->medium = imp__dot(at->ng, d) < 0 ? v->shape->interior : NULL;
    b->ng = at->ng;
}
