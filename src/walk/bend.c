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

/* Slope of a radiance over uv: false where it jumps. */
static bool has_slope(const struct imp_emitter *e, const struct imp_texcoord *at)
{
    imp_spec d[2];
    for (int j = 0; j < e->n_in; j++) {
        const struct imp_texture *t = e->input[j]->texture;
        if (t && (!t->ops->slope || !t->ops->slope(t, at, e->input[j]->scalar, d)))
            return false;
    }
    return true;
}

const char *imp__bend_obstacle(const struct imp_scene *scene, const struct imp_shape *s,
                               const struct imp_texcoord *at)
{
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    if (b->flags & IMP_BSDF_SMOOTH) return "scatters light, which depends on the place";
    if (b->flags & IMP_BSDF_EMIT) return "glows by its material";
    if (s->emitter >= 0 && !has_slope(scene->emitters[s->emitter], at))
        return "has a texture that jumps, or none whose slope is known";
    if (!(b->flags & IMP_BSDF_DELTA)) return NULL;
    if (!(b->flags & IMP_BSDF_TRANSMIT)) return "is a mirror";
    if (s->smooth) return "is smooth by vertex normals only";
    for (int j = 0; j < b->n_in; j++)
        if (b->input[j]->texture) return "has a textured tint";
    return NULL;
}

/* Keep the way here if a derivative will need it. */
static bool leg_keep(const struct imp_tracer *tracer, struct imp_arena *arena,
                     struct imp_walk *walk, struct imp_bending *b, struct imp_vertex *v,
                     const struct imp_hit *hit, const struct imp_surface *at, imp_v3 d)
{
    const uint8_t *active = tracer->active ? tracer->active->medium : NULL;
    const struct imp_medium *m = v->shape->interior;
    if (!active) return true;
    b->chain |= m && active[m->index];
    if (!b->chain) return true;
    if (b->moved && imp__bend_obstacle(tracer->scene, v->shape, &v->at)) {
        walk->dropped = IMP_DROP_MOVED;
        return false;
    }
    v->leg = imp__arena_take(arena, 1, sizeof *v->leg);
    if (!v->leg) {
        walk->dropped = IMP_DROP_MEMORY;
        return false;
    }
    *v->leg = (struct imp_leg){.medium = b->through,
                               .moved = b->moved,
                               .d = d,
                               .hit = *hit,
                               .dp_du = at->dp_du,
                               .dp_dv = at->dp_dv};
    if (b->through) v->leg->ride = b->ride;
    return true;
}

double imp__bend_straight(const struct imp_vertex *v, const struct imp__surface *level,
                          imp_v3 x, imp_v3 d)
{
    double far = imp__dot(v->at.p - x, d);
    for (int i = 0; i < 20; i++) {
        struct imp__surface_at sa;
        const imp_v3 y = x + far * d;
        imp__surface_eval(level, &y, &d, &sa);
        const double move = sa.g / imp__dot(sa.gx, d);
        far -= move;
        if (fabs(move) <= 1e-9 * far) break; /* the next would be its square */
    }
    return far;
}

/* What moves is differentiated where it is: the way begins at the last vertex itself, not
 * beside it, and ends in double precision. */
static void meet_exactly(struct imp_vertex *v, struct imp_hit *hit,
                         struct imp_surface *at, imp_v3 d)
{
    struct imp__surface level;
    const imp_v3 from = v->prev->at.p;
    imp__level(v->shape, at->p, at->ng, &level);
    const double far = imp__bend_straight(v, &level, from, d);
    if (!(far > 0) || !isfinite(far)) return;
    imp__hit_at(v->shape, from + far * d, d, far, hit);
    v->shape->ops->surface(v->shape, hit, &from, &d, at);
    const struct imp_frame frame = {at->s, at->t, at->n};
    v->t = far;
    v->ng = at->ng;
    v->at = (struct imp_texcoord){{at->uv[0], at->uv[1]}, at->p};
    v->dirs.wo = imp__to_local(&frame, -d);
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &v->at, v->in);
}

bool imp__bend_arrive(const struct imp_tracer *tracer, struct imp_arena *arena,
                      struct imp_walk *walk, struct imp_bending *b, struct imp_vertex *v,
                      struct imp_hit *hit, struct imp_surface *at, imp_v3 d)
{
    const struct imp_medium *m = v->shape->interior;
    if (b->moved && !b->through) meet_exactly(v, hit, at, d);
    if (m) {
        const struct imp_medium *before = imp__dot(at->ng, d) < 0 ? NULL : m;
        if (b->medium != before) return drop(walk);
        const int j = index_input(v->bsdf);
        if (j >= 0)
            v->in[j] = imp__spec(imp__graded_index(m->graded, &at->p) / m->outside);
    } else if (b->medium && (v->bsdf->flags & IMP_BSDF_TRANSMIT)) {
        return drop(walk);
    }
    const bool kept = leg_keep(tracer, arena, walk, b, v, hit, at, d);
    b->through = NULL;
    return kept;
}

void imp__bend_leave(const struct imp_tracer *tracer, struct imp_bending *b,
                     const struct imp_vertex *v, const struct imp_surface *at, imp_v3 d)
{
    const uint8_t *active = tracer->active ? tracer->active->medium : NULL;
    if (v->shape->interior)
        b->medium = imp__dot(at->ng, d) < 0 ? v->shape->interior : NULL;
    b->ng = at->ng;
    b->moved |= b->medium && active && active[b->medium->index];
}
