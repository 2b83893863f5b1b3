/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertex 0 of a walk from a light: which light sends it, from where, and whither. The
 * point itself may be seen by the sensor, too. */
#include "kind/cleared.h"
#include "scene/located.h"
#include "scene/media_around.h"
#include "walk/both/both.h"

static bool is_far(const struct imp_emitter *e)
{
    return e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR);
}

/* As decisions keep it. */
static struct imp_emission emission_of(const struct imp_emission_sample *e, double dist,
                                       double cos_light, imp_v3 d)
{
    return (struct imp_emission){{imp__decide1(e->uv[0]), imp__decide1(e->uv[1])},
                                 dist,
                                 imp__decide1(cos_light),
                                 imp__decide(d)};
}

/* A ray along d begins at o; around: there, without the shapes that have a priority. False:
 * the walk is dropped. */
static bool flight_begin(struct imp_step *s, const struct imp_medium *around, imp_v3 o,
                         imp_v3 d)
{
    s->flight.medium = s->flight.here = around;
    return imp_likely(s->scene->priorities == NULL) || imp__nest_begin(s, around, o, d);
}

/* The light itself, seen by the sensor. per: the density of the point, with the choice of
 * the light; of the sky that of the direction. */
static void light_itself_connect(struct imp_light_step *w, struct imp_vertex *v,
                                 int light, const struct imp_emission_sample *start,
                                 imp_v3 n, double per)
{
    struct imp_step *s = &w->s;
    const struct imp_emitter *e = s->scene->emitters[light];
    const struct imp_sensor *sensor = s->tracer->sensor;
    const struct imp_walk_integrator *i = s->tracer->integrator;
    const bool far = is_far(e);
    const bool point = e->ops->flags & IMP_EMITTER_DELTA;
    if (w->both && sensor->shape) return; /* which has it as its light sample */
    if (!i->lights || i->hide_emitters || !imp__light_depth_allows(s, 1) ||
        !sensor->ops->connect || (point && !sensor->shape))
        return;
    struct imp_sensor_sample to;
    double u[4], c = 1;
    const imp_v3 ref = far ? -start->d : start->p;
    imp__light_sensor_numbers(s, u);
    if (!imp__sensor_connect(sensor, &ref, far, u, &to) ||
        !imp__light_on_film(sensor, &to))
        return;
    const imp_v3 d = far ? start->d : to.wo;
    const bool surface = !far && imp__dot(start->ng, start->ng) > 0;
    if (surface) c = fabs(imp__dot(start->ng, d));
    struct imp_emission x =
        emission_of(start, far ? INFINITY : 1, surface ? imp__dot(n, d) : 1, d);
    imp_v3 p = s->at.p;
    struct imp_light_sample beam; /* parallel light from a surface: its point before the
                                     sensor's */
    const bool in_beam = far && e->shape;
    if (in_beam) {
        beam.located.prim = -1;
        if (!e->ops->sample(e, &to.p, u, &beam)) return;
        p = imp__decide(beam.p);
        for (int k = 0; k < 2; k++) x.uv[k] = imp__decide1(beam.uv[k]);
    }
    double pdf = far ? 0 : e->ops->pdf_emission(e, &x);
    if (!far && !(pdf > 0)) return; /* this way nothing is emitted */
    if (imp_unlikely(s->guided.guide && s->guided.guide->emit) && surface)
        pdf *= imp__guided_emit_pdf(s, light, w->point, n, d);
    const double mis =
        w->both ? imp__both_light_weight(w, light, start, &x, &to)
                : imp__light_connect_weight(s, &to, pdf, far ? start->pdf_p : 0);
    const double weight =
        imp__decide1(imp__emitter_timed(e, s->walk->time, to.weight * c) * mis / per);
    const imp_spec le = imp__emitter_radiance(s->scene, light, &x, p, s->at.carried);
    const struct imp_active *active = s->tracer->active;
    if (!(weight > 0) ||
        (imp__is_zero_used(le, s->at.carried) && !(active && active->emitter[light])))
        return;
    struct imp_shadow shadow;
    struct imp_surface from = {.p = start->p, .ng = start->ng};
    if (far) { /* from the sensor to the sky */
        from = (struct imp_surface){.p = to.p, .ng = to.ng};
        shadow = (struct imp_shadow){.o = sensor->shape ? imp__offset(to.p, to.ng, -to.wo)
                                                        : to.p,
                                     .d = -to.wo,
                                     .reach = INFINITY,
                                     .wanted = true};
        if (in_beam) {
            shadow.d = beam.p - shadow.o;
            shadow.reach = 1 - 10 * IMP_RAY_EPSILON;
        }
    } else {
        imp__light_shadow_aim(&from, &to, &shadow);
    }
    if (s->recorded) {
        struct imp_light *l = &v->d.light;
        l->emitter = light;
        l->uv[0] = (imp_decided)x.uv[0];
        l->uv[1] = (imp_decided)x.uv[1];
        l->dist = (imp_decided)x.dist;
        l->cos_light = (imp_decided)x.cos_light;
        imp__store_v3(l->d, x.d);
        imp__store_v3(l->p, p);
        imp__store_v3(l->wi, (imp_v3){0});
        l->located =
            imp__located_drawn(e->shape, in_beam ? &beam.located : &start->located,
                               in_beam ? beam.uv : start->uv);
    }
    const struct imp_link link = {
        .shadow = shadow, .sensor = to, .f = imp__spec(1), .le = le, .weight = weight};
    if (!far) {
        imp__light_link_see(s, v, &from, &link);
        return;
    }
    const struct imp_flight of_light = s->flight;
    if (flight_begin(s, sensor->medium, shadow.o, shadow.d))
        imp__light_link_see(s, v, &from, &link);
    s->flight = of_light;
}

/* The medium that light enters from a point of its light. */
static const struct imp_medium *medium_at(const struct imp_step *s,
                                          const struct imp_emitter *e,
                                          const struct imp_emission_sample *start)
{
    if (s->scene->n_media == 0) return NULL;
    if (e->shape && (e->shape->interior || e->shape->exterior))
        return imp__dot(start->ng, start->d) < 0 ? e->shape->interior
                                                 : e->shape->exterior;
    const bool endless = is_far(e) && !e->shape;
    return imp__medium_around(s->scene, start->p, start->d,
                              endless ? NULL : s->tracer->sensor->medium);
}

bool imp__light_start(struct imp_light_step *w)
{
    struct imp_step *s = &w->s;
    const struct imp_scene *scene = s->scene;
    const struct imp_key key = s->walk->key;
    struct imp_emission_sample start;
    double pmf;

    /* Choose a light, and draw a point of it and a direction. */
    if (scene->n_emitters == 0) return false;
    const struct imp_guide *guide =
        s->guided.guide && s->guided.guide->send ? s->guided.guide : NULL;
    const int light = imp__light_pick_by(
        scene, imp_unlikely(guide != NULL) ? guide->send : scene->light_cdf,
        imp__u01(key, imp__dim_start(IMP_DIM_EMITTER)), &pmf);
    const struct imp_emitter *e = scene->emitters[light];
    double u[4] = {imp__u01(key, IMP_DIM_PIXEL_X), imp__u01(key, IMP_DIM_PIXEL_Y),
                   imp__u01(key, IMP_DIM_LENS_U), imp__u01(key, IMP_DIM_LENS_V)};
    double on_point = 1, on_direction = 1;
    if (imp_unlikely(guide != NULL))
        on_direction = imp__guided_emit(s, light, u, &on_point);
    if (!(pmf > 0) || !imp__emission_sample(e, &scene->ball, u, &start)) return false;
    start.pdf_p *= on_point;
    start.pdf_d *= on_direction;
    w->point[0] = u[0];
    w->point[1] = u[1];
    const bool far = is_far(e);
    const double per = pmf * start.pdf_p * start.pdf_d;
    if (!(per > 0)) return false;

    /* Vertex 0 stands there, rounded as the record keeps it. */
    struct imp_vertex *v = imp__vertex_add(s, 1);
    if (!v) return false;
    v->t = 0;
    s->at.uv[0] = imp__decide1(start.uv[0]);
    s->at.uv[1] = imp__decide1(start.uv[1]);
    s->at.p = imp__decide(start.p);
    const bool surface = imp__dot(start.ng, start.ng) > 0;
    /* The shading normal is not in the sample: a shape that is smooth gives it again. */
    imp_v3 n = start.ng;
    if (surface && e->shape->smooth) {
        struct imp_surface at;
        e->shape->ops->sample_area(e->shape, u, &at);
        n = at.n;
    }
    const struct imp_emission x =
        emission_of(&start, far ? INFINITY : 1, start.cos_light, start.d);
    const imp_v3 o = surface ? imp__offset(start.p, start.ng, start.d) : start.p;
    if (!flight_begin(s, medium_at(s, e, &start), o, start.d)) return false;
    if (s->recorded) {
        v->ng = start.ng;
        v->d.scatterer = IMP_AT_LIGHT;
        v->d.from_light = true;
        v->d.uv[0] = (imp_decided)s->at.uv[0];
        v->d.uv[1] = (imp_decided)s->at.uv[1];
        imp__store_v3(v->d.p, s->at.p);
        v->d.located = imp__located_drawn(e->shape, &start.located, start.uv);
        imp__store_v3(v->d.wo, (imp_v3){0});
        imp__store_v3(v->d.wi, (imp_v3){0});
        v->d.lobe = IMP_SMOOTH;
        struct imp_met *m = &v->d.met;
        m->emitter = light;
        m->weight = 0;
        m->dist = (imp_decided)x.dist;
        m->cos_light = (imp_decided)x.cos_light;
        imp__store_v3(m->d, x.d);
    }

    /* The sensor may see the point itself. */
    light_itself_connect(w, v, light, &start, n, pmf * (far ? start.pdf_d : start.pdf_p));
    if (s->walk->dropped || !s->tracer->integrator->directions) return false;
    if (!imp__light_depth_allows(s, s->tracer->sensor->shape ? 1 : 2) ||
        !(start.cos_p > 0))
        return false;

    /* The weight of the ray: Le cos/p. */
    const double shines = imp__emitter_timed(e, s->walk->time, 1);
    if (!(shines > 0)) return false;
    const double pdf = imp__decide1(per / (start.cos_p * shines));
    const imp_spec le = imp__emitter_radiance(scene, light, &x, s->at.p, s->at.carried);
    const struct imp_active *active = s->tracer->active;
    if (imp__is_zero_used(le, s->at.carried) && !(active && active->emitter[light]))
        return false;
    imp__step_weigh(v, le, pdf, 1);
    if (s->recorded) {
        v->in[0] = le;
        v->d.pdf = (imp_decided)pdf;
        v->d.goes_on = true;
    }

    /* The ray in flight. */
    s->d = start.d;
    s->o = o;
    s->from = start.p;
    s->t_min = 0;
    s->t_max = INFINITY;
    s->pdf = far ? 0 : start.pdf_d;
    w->pdf_across = far ? start.pdf_p : 0;
    s->depth = 1;
    if (!w->both || imp__both_light_begins(w, light, &start)) return true;
    s->walk->dropped = IMP_DROP_MEMORY;
    return false;
}
