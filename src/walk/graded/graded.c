/* SPDX-License-Identifier: Apache-2.0
 *
 * Segments outside and inside bodies of graded index, while a walk is decided. */
#include "graded.h"

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

const char *imp__graded_obstacle(const struct imp_scene *scene, const struct imp_shape *s,
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

/* Vertices that move are not rounded. */
static void keep_exact(struct imp_step *s, struct imp_vertex *v,
                       struct imp_graded_segment *kept, const struct imp_surface *at)
{
    s->at.uv[0] = at->uv[0];
    s->at.uv[1] = at->uv[1];
    s->at.p = at->p;
    s->wo = s->wo_drawn;
    kept->end = (struct imp_exact){s->at, s->wo};
    kept->base.exact = &kept->end;
    imp__evaluate_inputs(v->bsdf, v->shape, &s->at, v->in);
}

/* Keep the segment to v if a derivative will need it. */
static bool segment_keep(struct imp_step *s, struct imp_vertex *v,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    struct imp_graded_state *b = s->graded;
    const uint8_t *active = s->tracer->active ? s->tracer->active->body : NULL;
    const struct imp_body *m = v->shape->body;
    if (!active) return true;
    b->chain |= m && active[m->index];
    if (!b->chain) return true;
    if (b->moved && imp__graded_obstacle(s->scene, v->shape, &s->at)) {
        s->walk->dropped = IMP_DROP_MOVED;
        return false;
    }
    struct imp_graded_segment *kept = imp__arena_take(s->arena, 1, sizeof *kept);
    if (!kept) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return false;
    }
    *kept = (struct imp_graded_segment){.base = {&imp__graded_outside, NULL},
                                        .medium = b->through,
                                        .moved = b->moved,
                                        .d = s->d,
                                        .hit = *hit,
                                        .dp_du = at->dp_du,
                                        .dp_dv = at->dp_dv};
    if (b->through) kept->ride = b->ride;
    v->segment = &kept->base;
    keep_exact(s, v, kept, at);
    s->walk->moving = &imp__graded_outside;
    return true;
}

double imp__graded_straight(imp_v3 p, const struct imp__surface *level, imp_v3 x,
                            imp_v3 d)
{
    double far = imp__dot(p - x, d);
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

/* What moves is differentiated where it is: the segment begins at the last vertex itself,
 * not beside it, and ends in double precision. */
static void meet_exactly(struct imp_step *s, struct imp_vertex *v, struct imp_hit *hit,
                         struct imp_surface *at)
{
    struct imp__surface level;
    const imp_v3 d = s->d, from = imp__graded_kept(v->prev)->end.at.p;
    imp__level(v->shape, at->p, at->ng, &level);
    const double far = imp__graded_straight(at->p, &level, from, d);
    if (!(far > 0) || !isfinite(far)) return;
    imp__hit_at(v->shape, from + far * d, d, far, hit);
    v->shape->ops->surface(v->shape, hit, &from, &d, at);
    const struct imp_frame frame = {at->s, at->t, at->n};
    imp__vertex_place(s, v, at, &frame, d, far);
}

/* At a surface: is the walk on the side of it that it should be on? */
static bool arrive(struct imp_step *s, struct imp_vertex *v, struct imp_hit *hit,
                   struct imp_surface *at)
{
    struct imp_graded_state *b = s->graded;
    const struct imp_body *m = v->shape->body;
    if (b->moved && !b->through) meet_exactly(s, v, hit, at);
    if (m) {
        const struct imp_body *before = imp__dot(at->ng, s->d) < 0 ? NULL : m;
        if (b->medium != before) return drop(s->walk);
    } else if (b->medium && (v->bsdf->flags & IMP_BSDF_TRANSMIT)) {
        return drop(s->walk);
    }
    const bool kept = segment_keep(s, v, hit, at);
    b->through = NULL;
    return kept;
}

/* Into a medium, out of it, or as before. */
static void leave(struct imp_step *s, const struct imp_vertex *v,
                  const struct imp_surface *at)
{
    struct imp_graded_state *b = s->graded;
    const uint8_t *active = s->tracer->active ? s->tracer->active->body : NULL;
    if (v->shape->body) b->medium = imp__dot(at->ng, s->d) < 0 ? v->shape->body : NULL;
    b->ng = at->ng;
    b->moved |= b->medium && active && active[b->medium->index];
    s->segment = b->medium ? &imp__graded_inside : &imp__graded_outside;
}

static bool begin(struct imp_step *s)
{
    struct imp_graded_state *b = imp__arena_take(s->arena, 1, sizeof *b);
    if (!b) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return false;
    }
    b->medium = b->through = NULL;
    b->chain = b->moved = false;
    s->graded = b;
    return true;
}

/* Along the bent ray. T is the ratio of the squared indices at its ends: radiance/n^2 is
 * what stays along a ray. */
static enum imp_meeting meet_inside(struct imp_step *s, struct imp_hit *hit)
{
    struct imp_graded_state *b = s->graded;
    struct imp__ride *r = &b->ride;
    struct imp_vertex *last = s->walk->last;
    if (!imp__ride(b->medium, s->scene, s->from, b->ng, s->d, r, hit)) {
        s->walk->dropped = IMP_DROP_BENT;
        return IMP_MEETS_DROP;
    }
    s->d = r->end;
    s->o = r->at.x - r->end * r->length;
    b->through = b->medium;
    const double ratio = r->j.eta / r->k.eta;
    const double passes = imp__decide1(ratio * ratio);
    if (s->recorded) last->d.passes = (imp_decided)passes;
    imp__step_pass(last, imp__spec(passes));
    s->beta *= passes;
    s->eta /= ratio;
    return IMP_MEETS_SURFACE;
}

const struct imp_segment_ops imp__graded_outside = {.name = "outside",
                                                    .connects = true,
                                                    .begin = begin,
                                                    .meet = imp__straight_meet,
                                                    .arrive = arrive,
                                                    .leave = leave,
                                                    .place = imp__graded_place,
                                                    .sweep = imp__graded_sweep,
                                                    .tangent = imp__graded_chain_tangent};

const struct imp_segment_ops imp__graded_inside = {
    .name = "graded", .meet = meet_inside, .arrive = arrive, .leave = leave};
