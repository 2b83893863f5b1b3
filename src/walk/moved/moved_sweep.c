/* SPDX-License-Identifier: Apache-2.0
 *
 * The interior derivative of a walk by what moves (moved.h): adjoints of its values from the first
 * vertex to the last, then adjoints of its places from the last to the first. */
#include "moved_chain.h"
#include "walk/core/vertex.h"

/* What the values of vertex k depend on, as adjoints of their logarithms. */
struct pieces {
    double light; /* its light sample */
    double step;  /* the step, of all light but what is emitted at its end */
    double met;   /* emission at its end */
};

struct sweep {
    const struct imp_tracer *tracer;
    const struct imp__moves *moves;
    const struct imp_walk *walk;
    struct imp__link_point *at; /* [n] */
    struct pieces *piece;       /* [n] */
    double *theta_bar;
};

static bool is_emitted(const struct imp_vertex *v)
{
    return v->d.scatterer != IMP_AT_SKY && v->d.met.emitter >= 0;
}

/* Places and adjoints of all vertices; their number. */
static int read_walk(struct sweep *s, imp_spec adjoint)
{
    const struct imp_scene *scene = s->tracer->scene;
    imp_spec P = adjoint;
    int n = 0;
    for (const struct imp_vertex *v = s->walk->first; v; v = v->next, n++) {
        const bool sky = v->d.scatterer == IMP_AT_SKY;
        s->at[n] = sky ? imp__sky_point(imp__decided_v3(v->d.p))
                       : imp__surface_point(scene, v->d.shape, &v->d.located, v->ng);
        struct pieces *piece = &s->piece[n];
        *piece = (struct pieces){0, 0, 0};
        if (v->d.connection == IMP_CONNECTED)
            piece->light = imp__sum_used(P * v->b, scene->lanes);
        P *= v->w;
        if (!v->d.goes_on || !v->next) continue;
        const imp_spec met = is_emitted(v->next) ? v->next->e : (imp_spec){0};
        piece->met = imp__sum_used(P * met, scene->lanes);
        piece->step = imp__sum_used(P * (v->beyond - met), scene->lanes);
    }
    return n;
}

/* Derivative of the logarithm of what a light at a point sends along d, by d across itself: by
 * differences, whose kinks at the borders of a spot's beam are so wide. */
#define TURN 1e-6
static imp_v3 sent_slope(const struct imp_emitter *e, imp_v3 d, int lanes)
{
    const struct imp_frame f = imp__frame_from_normal(d);
    const struct imp_texcoord nowhere = {.shape = NULL};
    const imp_v3 across[2] = {f.s, f.t};
    imp_spec in[IMP_INPUTS_MAX];
    imp_v3 slope = {0};
    imp__inputs_eval(e->input, e->n_in, &nowhere, in);
    for (int k = 0; k < 2; k++) {
        double value[2];
        for (int j = 0; j < 2; j++) {
            const struct imp_emission x = {
                .dist = 1,
                .cos_light = 1,
                .d = imp__normalize(d + across[k] * (j ? TURN : -TURN))};
            imp_spec le;
            e->ops->eval(e, in, &x, &le);
            value[j] = imp__sum_used(le, lanes);
        }
        const double middle = 0.5 * (value[0] + value[1]);
        if (middle > 0)
            slope += across[k] * ((value[1] - value[0]) / (2 * TURN * middle));
    }
    return slope;
}

/* A light sample of a point, or of parallel light. */
static void delta_bar(struct sweep *s, int k, const struct imp_vertex *v)
{
    const int light = v->d.light.emitter;
    struct imp_emitter *e = s->tracer->scene->emitters[light];
    const double weight = s->piece[k].light;
    double aim[3];
    e->ops->aim(e, aim, false);
    const imp_v3 at = imp__v3(aim[0], aim[1], aim[2]);
    if (e->ops->flags & IMP_EMITTER_FAR) {
        imp__direction_bar(&s->at[k], -at, weight);
        const imp_v3 n = s->at[k].x.n;
        imp__light_velocity_bar(s->moves, light, n * (weight / imp__dot(n, at)),
                                s->theta_bar);
        return;
    }
    const imp_v3 r = s->at[k].x.p - at;
    const double distance = imp__length(r);
    const imp_v3 turn =
        sent_slope(e, r * (1 / distance), s->tracer->scene->lanes) * (weight / distance);
    const imp_v3 bar = imp__point_bar(&s->at[k], at, weight) - turn;
    s->at[k].moved_bar += turn;
    imp__light_velocity_bar(s->moves, light, bar, s->theta_bar);
}

/* The light sample of vertex k. */
static void light_bar(struct sweep *s, int k, const struct imp_vertex *v)
{
    const struct imp_scene *scene = s->tracer->scene;
    const struct imp_emitter *e = scene->emitters[v->d.light.emitter];
    const double weight = s->piece[k].light;
    if (e->ops->flags & IMP_EMITTER_DELTA) {
        delta_bar(s, k, v);
        return;
    }
    if (e->ops->flags & IMP_EMITTER_ENVIRONMENT) {
        const imp_v3 w = -imp__decided_v3(v->d.light.d);
        imp__direction_bar(&s->at[k], w, weight);
        return;
    }
    struct imp__link_point y = imp__surface_point(
        scene, e->shape->index, &v->d.light.located, imp__decided_v3(v->d.light.d));
    imp__connection_bar(&s->at[k], &y, weight);
    imp__velocity_bar(s->moves, &y.x, &y.bar, s->theta_bar);
}

bool imp__moved_sweep(const struct imp_tracer *tracer, struct imp_arena *arena,
                      const struct imp__moves *moves, const struct imp_walk *walk,
                      imp_spec adjoint, double *theta_bar)
{
    struct sweep s = {tracer, moves, walk, NULL, NULL, theta_bar};
    if (walk->dropped || !walk->valid || !walk->first) return true;
    s.at = imp__arena_take(arena, (size_t)walk->n, sizeof *s.at);
    s.piece = imp__arena_take(arena, (size_t)walk->n, sizeof *s.piece);
    if (!s.at || !s.piece) return false;
    int k = read_walk(&s, adjoint) - 1;
    for (const struct imp_vertex *v = walk->last; v; v = v->prev, k--) {
        struct imp__link_point *x = &s.at[k];
        if (x->sky) continue;
        if (v->d.connection == IMP_CONNECTED) light_bar(&s, k, v);
        if (v->d.goes_on && v->next) {
            struct imp__link_point *next = x + 1;
            const imp_v3 w = imp__link_direction(x, next);
            imp__direction_bar(x, w, s.piece[k].step);
            if (!next->sky) {
                x->moved_bar += imp__slide_bar(next, w);
                imp__connection_bar(x, next, s.piece[k].met);
                imp__velocity_bar(moves, &next->x, &next->bar, theta_bar);
            }
        }
    }
    if (s.at[0].sky) return true;
    imp__camera_bar(moves, walk->ray.o, &s.at[0], theta_bar);
    return true;
}
