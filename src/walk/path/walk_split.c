/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices that split: several continuations of one vertex, the first of which is the
 * walk's own. The others are side walks that hang on the vertex. */
#include "walk/core/step.h"

/* The continuation of v counts by a share of 1/n. */
static void share(const struct imp_step *s, struct imp_vertex *v, int n)
{
    const double part = imp__decide1(1. / n);
    imp__step_pass(v, imp__spec(part));
    if (s->recorded) v->d.passes = (imp_decided)part;
}

/* Continuations of a vertex that splits: one from each member of the mixture, with weights
 * of MIS in the densities; or as many as the tracer wants, each with its share. */
static int branches(const struct imp_step *s)
{
    return s->mixed.splits ? s->mixed.members : s->tracer->split;
}
static bool branch_scatter(struct imp_step *s, struct imp_vertex *v, int i,
                           const struct imp_surface *at, const struct imp_frame *frame)
{
    if (s->mixed.splits) { /* the i-th member that has a share */
        int k = 0;
        for (;; k++)
            if (s->mixed.share[k] > 0 && i-- == 0) break;
        s->mixed.only = k;
        return imp__scatter(s, v, at, frame);
    }
    if (!imp__scatter(s, v, at, frame)) return false;
    share(s, v, s->tracer->split);
    return true;
}

/* The point of the same number in another set. */
static struct imp_point point_branch(struct imp_point point, int vertex, int i)
{
    point.set = imp__key_branch((struct imp_key){point.set}, vertex, i).state;
    return point;
}

/* Further continuations of v hang on it as side walks. `before`: the walk before its own
 * continuation was drawn. */
static void split(const struct imp_step *before, struct imp_vertex *v,
                  const struct imp_surface *at, const struct imp_frame *frame)
{
    struct imp_walk *walk = before->walk;
    const int n = branches(before);
    for (int i = 1; i < n && !walk->dropped; i++) {
        struct imp_step s = *before;
        struct imp_side *side = imp__arena_take(s.arena, 1, sizeof *side);
        if (!side) {
            walk->dropped = IMP_DROP_MEMORY;
            return;
        }
        side->next = v->side;
        v->side = side;
        side->walk = (struct imp_walk){.px = walk->px,
                                       .py = walk->py,
                                       .key = imp__key_branch(walk->key, s.depth, i),
                                       .point = point_branch(walk->point, s.depth, i),
                                       .ray = walk->ray,
                                       .time = walk->time,
                                       .waves = walk->waves,
                                       .wave = walk->wave,
                                       .depth = s.depth};
        s.walk = &side->walk;
        imp__step_numbers(&s);
        struct imp_vertex *u = imp__vertex_add(&s, v->bsdf->n_in);
        if (!u) {
            walk->dropped = side->walk.dropped;
            return;
        }
        u->shape = v->shape;
        u->bsdf = v->bsdf;
        u->t = v->t;
        if (s.recorded) {
            u->ng = v->ng;
            u->d.shape = v->d.shape;
            u->d.scatterer = v->d.scatterer;
            u->d.located = v->d.located;
            u->d.place = v->d.place;
            u->d.back = v->d.back;
            u->d.uv[0] = v->d.uv[0];
            u->d.uv[1] = v->d.uv[1];
            imp__store_v3(u->d.p, s.at.p);
            imp__store_v3(u->d.wo, s.wo);
        }
        imp_spec *in = s.recorded ? u->in : s.scratch;
        imp__evaluate_inputs(u->bsdf, u->shape, &s.at, in);
        s.in = in;
        if (branch_scatter(&s, u, i, at, frame)) {
            s.depth++;
            imp__walk_on(&s);
        }
        walk->valid |= side->walk.valid;
        side->walk.valid = true;
        walk->dropped = side->walk.dropped;
    }
}

/* The continuation of v, and its branches where the walk is split. */
bool imp__scatter_split(struct imp_step *s, struct imp_vertex *v,
                        const struct imp_surface *at, const struct imp_frame *frame)
{
    const struct imp_step before = *s;
    const bool continues = branch_scatter(s, v, 0, at, frame);
    split(&before, v, at, frame);
    return continues;
}
