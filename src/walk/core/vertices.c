/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a walk, as functions (vertices.h), and those where no surface is: points of
 * media, the sky, and the sensor that a walk through media begins at. */
#include "vertices.h"

struct imp_vertex *imp__vertex_add(struct imp_step *s, int n_in)
{
    return imp__vertex_add_here(s, n_in);
}

void imp__vertex_place(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       imp_v3 d, double t)
{
    imp__vertex_place_here(s, v, at, frame, d, t);
}

struct imp_vertex *imp__medium_meet(struct imp_step *s, const struct imp_bsdf *scatterer,
                                    int medium, imp_v3 p, double t,
                                    struct imp_surface *at, struct imp_frame *frame)
{
    struct imp_vertex *v = imp__vertex_add_here(s, scatterer->n_in);
    if (!v) return NULL;
    v->bsdf = scatterer;
    if (s->recorded) {
        v->d.shape = medium;
        v->d.scatterer = IMP_IN_MEDIUM;
        v->d.fixed = s->flight.fixed;
    }
    *at = (struct imp_surface){.p = p};
    s->at.prim = 0;
    *frame = (struct imp_frame){{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    imp__vertex_place_here(s, v, at, frame, s->d, t);
    s->walk->valid = true;
    return v;
}

/* A vertex that scatters nothing, passed along d. */
static void straight_on(struct imp_decision *v, imp_v3 d)
{
    v->goes_on = true;
    v->pdf = 1;
    v->lobe = IMP_SMOOTH;
    imp__store_v3(v->wi, d);
}

void imp__sky_meet(struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    const bool counts = max_depth < 0 || imp__bounces(s) < max_depth;
    const bool hidden = s->tracer->integrator->hide_emitters && imp__bounces(s) == 0;
    const int n = s->scene->n_environments;
    if (n == 0 || hidden || !counts) return;
    s->at.p = imp__decide(s->d);
    s->at.uv[0] = s->at.uv[1] = 0;
    s->at.shape = NULL;
    s->at.prim = 0;
    /* A vertex to each: past all but the last the walk goes straight on. */
    for (int k = 0; k < n; k++) {
        struct imp_vertex *v = imp__vertex_add_here(s, 0);
        if (!v) return;
        v->t = INFINITY;
        if (k + 1 < n) imp__step_weigh(v, imp__spec(1), 1, 1);
        if (s->recorded) {
            v->d.scatterer = IMP_AT_SKY;
            v->d.uv[0] = v->d.uv[1] = 0;
            imp__store_v3(v->d.p, s->at.p);
            if (k + 1 < n) straight_on(&v->d, s->d);
        }
        imp__emission_meet(s, v, s->scene->environments[k], 1, NULL, NULL);
    }
    s->walk->valid |= imp__met_is_seen(s);
}

bool imp__sensor_vertex(struct imp_step *s)
{
    struct imp_vertex *v = imp__vertex_add_here(s, 0);
    if (!v) return false;
    s->walk->depth = -1;
    v->t = 0;
    imp__step_weigh(v, imp__spec(1), 1, 1);
    if (!s->recorded) return true;
    v->d.scatterer = IMP_AT_SENSOR;
    v->d.uv[0] = v->d.uv[1] = 0;
    imp__store_v3(v->d.p, s->o);
    imp__store_v3(v->d.wo, (imp_v3){0});
    straight_on(&v->d, s->d);
    return true;
}
