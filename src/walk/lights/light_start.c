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

/* Has light that is 0 a derivative? */
static bool derives(const struct imp_step *s, int light)
{
    const struct imp_active *active = s->tracer->active;
    return active && active->emitter[light];
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

/* What is sent: drawn from all lights. */
struct sent {
    int light;
    const struct imp_emitter *e;
    struct imp_emission_sample start;
    double pmf; /* of the light */
    double per; /* density of the point, the direction and the light */
    bool far, surface;
    imp_v3 n; /* shading normal of a surface */
};

/* ---- The light itself, seen by the sensor ------------------------------------------ */

/* How the sensor sees the point that was drawn; of the sky, its direction. */
struct itself {
    struct imp_sensor_sample to;
    imp_v3 d;              /* of the light that it sees */
    struct imp_emission x; /* that light */
    imp_v3 p;              /* point of the light, as it is kept */
    double cos;            /* at the light */
    bool in_beam; /* parallel light from a surface: its point before the sensor's */
    struct imp_light_sample beam;
};

static bool itself_counts(struct imp_light_step *w, const struct sent *l)
{
    const struct imp_step *s = &w->s;
    const struct imp_sensor *sensor = s->tracer->sensor;
    const struct imp_walk_integrator *i = s->tracer->integrator;
    const bool point = l->e->ops->flags & IMP_EMITTER_DELTA;
    if (w->both && sensor->shape) return false; /* which has it as its light sample */
    return i->lights && !i->hide_emitters && imp__light_depth_allows(s, 1) &&
           sensor->ops->connect && (!point || sensor->shape);
}

/* False: it is not on the film. */
static bool itself_draw(const struct imp_step *s, const struct sent *l, struct itself *x)
{
    const struct imp_sensor *sensor = s->tracer->sensor;
    const struct imp_emission_sample *start = &l->start;
    const imp_v3 ref = l->far ? -start->d : start->p;
    double u[4] = {0};
    if (!(sensor->ops->flags & IMP_SENSOR_PINHOLE) || l->far)
        imp__light_sensor_numbers(s, u);
    if (!imp__sensor_connect(sensor, &ref, l->far, u, &x->to) ||
        !imp__light_on_film(sensor, &x->to))
        return false;
    const bool surface = !l->far && l->surface;
    x->d = l->far ? start->d : x->to.wo;
    x->cos = surface ? fabs(imp__dot(start->ng, x->d)) : 1;
    x->x = emission_of(start, l->far ? INFINITY : 1, surface ? imp__dot(l->n, x->d) : 1,
                       x->d);
    x->p = s->at.p;
    x->in_beam = l->far && l->e->shape;
    if (!x->in_beam) return true;
    x->beam.located.prim = -1;
    if (!l->e->ops->sample(l->e, &x->to.p, u, &x->beam)) return false;
    x->p = imp__decide(x->beam.p);
    for (int k = 0; k < 2; k++) x->x.uv[k] = imp__decide1(x->beam.uv[k]);
    return true;
}

/* MIS weight over the density of the point, with the choice of the light; of the sky that of
 * the direction. 0: this way nothing is emitted. */
static double itself_weigh(struct imp_light_step *w, const struct sent *l,
                           const struct itself *x)
{
    const struct imp_step *s = &w->s;
    const struct imp_emission_sample *start = &l->start;
    const double per = l->pmf * (l->far ? start->pdf_d : start->pdf_p);
    double pdf = l->far ? 0 : l->e->ops->pdf_emission(l->e, &x->x);
    if (!l->far && !(pdf > 0)) return 0;
    if (imp_unlikely(s->guided.guide && s->guided.guide->emit) && !l->far && l->surface)
        pdf *= imp__guided_emit_pdf(s, l->light, w->point, l->n, x->d);
    const double mis =
        w->both ? imp__both_light_weight(w, l->light, start, &x->x, &x->to)
                : imp__light_connect_weight(s, &x->to, pdf, l->far ? start->pdf_p : 0);
    return imp__decide1(imp__emitter_timed(l->e, s->walk->time, x->to.weight * x->cos) *
                        mis / per);
}

/* The shadow ray; from: where it begins, on the light, or for the sky on the sensor. */
static void itself_aim(const struct imp_step *s, const struct sent *l,
                       const struct itself *x, struct imp_surface *from,
                       struct imp_shadow *shadow)
{
    const struct imp_sensor_sample *to = &x->to;
    *from = (struct imp_surface){.p = l->start.p, .ng = l->start.ng};
    if (!l->far) {
        imp__light_shadow_aim(from, to, shadow);
        return;
    }
    *from = (struct imp_surface){.p = to->p, .ng = to->ng};
    *shadow = (struct imp_shadow){
        .o = s->tracer->sensor->shape ? imp__offset(to->p, to->ng, -to->wo) : to->p,
        .d = -to->wo,
        .reach = INFINITY,
        .wanted = true};
    if (x->in_beam) {
        shadow->d = x->beam.p - shadow->o;
        shadow->reach = 1 - 10 * IMP_RAY_EPSILON;
    }
}

static void itself_record(struct imp_vertex *v, const struct sent *sent,
                          const struct itself *x)
{
    struct imp_light *l = &v->d.light;
    l->emitter = sent->light;
    l->uv[0] = (imp_decided)x->x.uv[0];
    l->uv[1] = (imp_decided)x->x.uv[1];
    l->dist = (imp_decided)x->x.dist;
    l->cos_light = (imp_decided)x->x.cos_light;
    imp__store_v3(l->d, x->x.d);
    imp__store_v3(l->p, x->p);
    imp__store_v3(l->wi, (imp_v3){0});
    l->located = imp__located_drawn(sent->e->shape,
                                    x->in_beam ? &x->beam.located : &sent->start.located,
                                    x->in_beam ? x->beam.uv : sent->start.uv);
}

static void itself_connect(struct imp_light_step *w, struct imp_vertex *v,
                           const struct sent *l)
{
    struct imp_step *s = &w->s;
    struct itself x;
    if (!itself_counts(w, l) || !itself_draw(s, l, &x)) return;
    const double weight = itself_weigh(w, l, &x);
    if (!(weight > 0)) return;
    const imp_spec le =
        imp__emitter_radiance(s->scene, l->light, &x.x, x.p, s->at.carried);
    if (imp__is_zero_used(le, s->at.carried) && !derives(s, l->light)) return;

    struct imp_link link = {
        .sensor = x.to, .f = imp__spec(1), .le = le, .weight = weight};
    struct imp_surface from;
    itself_aim(s, l, &x, &from, &link.shadow);
    if (s->recorded) itself_record(v, l, &x);
    if (!l->far) {
        imp__light_link_see(s, v, &from, &link);
        return;
    }
    const struct imp_flight of_light = s->flight;
    if (flight_begin(s, s->tracer->sensor->medium, link.shadow.o, link.shadow.d))
        imp__light_link_see(s, v, &from, &link);
    s->flight = of_light;
}

/* ---- The walk ---------------------------------------------------------------------- */

/* What follows from light and start. False: nothing is sent. */
static bool sent_set(struct imp_light_step *w, struct sent *l)
{
    const struct imp_emission_sample *start = &l->start;
    l->e = w->s.scene->emitters[l->light];
    l->per = l->pmf * start->pdf_p * start->pdf_d;
    l->far = is_far(l->e);
    l->surface = imp__dot(start->ng, start->ng) > 0;
    /* The shading normal is not in the sample: a shape that is smooth gives it again. */
    l->n = start->ng;
    if (l->per > 0 && l->surface && l->e->shape->smooth) {
        struct imp_surface at;
        l->e->shape->ops->sample_area(l->e->shape, w->point, &at);
        l->n = at.n;
    }
    return l->per > 0;
}

/* Choose a light, and draw a point of it and a direction. False: nothing is sent. */
static bool light_draw(struct imp_light_step *w, struct sent *l)
{
    struct imp_step *s = &w->s;
    const struct imp_scene *scene = s->scene;
    const struct imp_key key = s->walk->key;
    struct imp_emission_sample *start = &l->start;
    if (scene->n_emitters == 0) return false;
    if (w->given) {
        l->light = 0;
        l->pmf = scene->light_cdf[0];
        *start = w->given->start;
        w->point[0] = w->given->point[0];
        w->point[1] = w->given->point[1];
        if (!w->given->drawn) return false;
        return sent_set(w, l);
    }
    const struct imp_guide *guide =
        s->guided.guide && s->guided.guide->send ? s->guided.guide : NULL;
    l->light = imp__light_pick_by(
        scene, imp_unlikely(guide != NULL) ? guide->send : scene->light_cdf,
        imp__u01(key, imp__dim_start(IMP_DIM_EMITTER)), &l->pmf);
    l->e = scene->emitters[l->light];
    double u[4] = {imp__u01(key, IMP_DIM_PIXEL_X), imp__u01(key, IMP_DIM_PIXEL_Y),
                   imp__u01(key, IMP_DIM_LENS_U), imp__u01(key, IMP_DIM_LENS_V)};
    double on_point = 1, on_direction = 1;
    if (imp_unlikely(guide != NULL))
        on_direction = imp__guided_emit(s, l->light, u, &on_point);
    if (!(l->pmf > 0) || !imp__emission_sample(l->e, &scene->ball, u, start))
        return false;
    start->pdf_p *= on_point;
    start->pdf_d *= on_direction;
    w->point[0] = u[0];
    w->point[1] = u[1];
    return sent_set(w, l);
}

static void vertex_record(struct imp_vertex *v, const struct imp_step *s,
                          const struct sent *l, const struct imp_emission *x)
{
    struct imp_met *m = &v->d.met;
    v->ng = l->start.ng;
    v->d.scatterer = IMP_AT_LIGHT;
    v->d.from_light = true;
    v->d.uv[0] = (imp_decided)s->at.uv[0];
    v->d.uv[1] = (imp_decided)s->at.uv[1];
    imp__store_v3(v->d.p, s->at.p);
    v->d.located = imp__located_drawn(l->e->shape, &l->start.located, l->start.uv);
    imp__store_v3(v->d.wo, (imp_v3){0});
    imp__store_v3(v->d.wi, (imp_v3){0});
    v->d.lobe = IMP_SMOOTH;
    m->emitter = l->light;
    m->weight = 0;
    m->dist = (imp_decided)x->dist;
    m->cos_light = (imp_decided)x->cos_light;
    imp__store_v3(m->d, x->d);
}

/* The weight of the ray: Le cos/p. False: it carries nothing. */
static bool ray_weigh(struct imp_step *s, struct imp_vertex *v, const struct sent *l,
                      const struct imp_emission *x)
{
    const double shines = imp__emitter_timed(l->e, s->walk->time, 1);
    if (!(shines > 0)) return false;
    const double pdf = imp__decide1(l->per / (l->start.cos_p * shines));
    const imp_spec le =
        imp__emitter_radiance(s->scene, l->light, x, s->at.p, s->at.carried);
    if (imp__is_zero_used(le, s->at.carried) && !derives(s, l->light)) return false;
    imp__step_weigh(v, le, pdf, 1);
    if (s->recorded) {
        v->in[0] = le;
        v->d.pdf = (imp_decided)pdf;
        v->d.goes_on = true;
    }
    return true;
}

static void ray_send(struct imp_light_step *w, const struct sent *l, imp_v3 o)
{
    struct imp_step *s = &w->s;
    s->d = l->start.d;
    s->o = o;
    s->from = l->start.p;
    s->t_min = 0;
    s->t_max = INFINITY;
    s->pdf = l->far ? 0 : l->start.pdf_d;
    w->pdf_across = l->far ? l->start.pdf_p : 0;
    s->depth = 1;
}

bool imp__light_start(struct imp_light_step *w)
{
    struct imp_step *s = &w->s;
    struct sent l;
    const struct imp_emission_sample *start = &l.start;
    if (!light_draw(w, &l)) return false;

    /* Vertex 0 is there, rounded as the record keeps it. */
    struct imp_vertex *v = imp__vertex_add(s, 1);
    if (!v) return false;
    v->t = 0;
    s->at.uv[0] = imp__decide1(start->uv[0]);
    s->at.uv[1] = imp__decide1(start->uv[1]);
    s->at.p = imp__decide(start->p);
    const struct imp_emission x =
        emission_of(start, l.far ? INFINITY : 1, start->cos_light, start->d);
    const imp_v3 o = l.surface ? imp__offset(start->p, start->ng, start->d) : start->p;
    if (!flight_begin(s, medium_at(s, l.e, start), o, start->d)) return false;
    if (s->recorded) vertex_record(v, s, &l, &x);

    /* The sensor may see the point itself. */
    itself_connect(w, v, &l);
    if (s->walk->dropped || !s->tracer->integrator->directions) return false;
    if (!imp__light_depth_allows(s, s->tracer->sensor->shape ? 1 : 2) ||
        !(start->cos_p > 0))
        return false;

    if (!ray_weigh(s, v, &l, &x)) return false;
    ray_send(w, &l, o);
    if (!w->both || imp__both_light_begins(w, l.light, start)) return true;
    s->walk->dropped = IMP_DROP_MEMORY;
    return false;
}
