/* SPDX-License-Identifier: Apache-2.0
 *
 * How a walk from a light reaches the sensor: its vertices are connected to a point of
 * the sensor, or meet its surface. Of both ways, weights of MIS (Veach 1997, 9.2). */
#include "kind/bsdf/transport.h"
#include "kind/cleared.h"
#include "kind/sensor/receiver.h"
#include "walk/both/both.h"

static void reach_add(struct imp_light_step *w, struct imp_vertex *v, bool met, double px,
                      double py)
{
    struct imp_reach *r = imp__arena_take(w->s.arena, 1, sizeof *r);
    if (!r) {
        w->s.walk->dropped = IMP_DROP_MEMORY;
        return;
    }
    *r = (struct imp_reach){
        .vertex = v, .number = w->s.walk->n - 1, .met = met, .px = px, .py = py};
    *w->end = r;
    w->end = &r->next;
    w->out->n_reach++;
}

static double power_heuristic(double a, double b)
{
    return a > 0 ? a * a / (a * a + b * b) : 0;
}

/* Film area over area of a sensor that is a surface. */
static double film_per_area(const struct imp_sensor *s)
{
    return (double)s->film.width * s->film.height / s->shape->area;
}

/* ---- The sensor is met ------------------------------------------------------------ */

/* Weight of meeting the sensor's surface against a connection to it, both per area of the
 * surface; t: from where a connection could have been made. */
static double met_weight(const struct imp_light_step *w, double cosine, double t)
{
    const struct imp_step *s = &w->s;
    const double connects = 1 / s->tracer->sensor->shape->area;
    const double meets =
        w->pdf_across > 0 ? w->pdf_across * cosine : s->pdf * cosine / (t * t);
    if (!s->tracer->integrator->lights || !(meets > 0)) return 1;
    return power_heuristic(meets, connects);
}

void imp__light_meet_sensor(struct imp_light_step *w, struct imp_vertex *v,
                            const struct imp_surface *at)
{
    struct imp_step *s = &w->s;
    const struct imp_sensor *sensor = s->tracer->sensor;
    const double cosine = -imp__dot(at->ng, s->d);
    if (!(cosine > 0) || imp__is_unmet(sensor) || !imp__light_depth_allows(s, s->depth))
        return;
    if (s->tracer->integrator->hide_emitters && s->depth - s->straight == 1) return;
    const double mis = w->both ? imp__both_sensor_weight(w, cosine)
                               : met_weight(w, cosine, w->passed + v->t);
    const double weight = imp__decide1(film_per_area(sensor) * mis);
    const bool square = sensor->shape->ops->flags & IMP_SHAPE_SQUARE;
    const struct imp_key key = s->walk->key;
    const double u =
        square ? at->uv[0] : imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT));
    const double t =
        square ? at->uv[1] : imp__u01(key, imp__dim(s->depth, IMP_DIM_SPARE));
    v->e = imp__spec(weight);
    if (s->recorded) v->d.met.weight = (imp_decided)weight;
    reach_add(w, v, true, u * sensor->film.width, t * sensor->film.height);
}

/* ---- Connections ------------------------------------------------------------------ */

bool imp__light_on_film(const struct imp_sensor *s, const struct imp_sensor_sample *to)
{
    const struct imp_film_bounds f = imp__light_film(s);
    const double x = to->px - f.x, y = to->py - f.y;
    return x >= -f.margin && x < f.width + f.margin && y >= -f.margin &&
           y < f.height + f.margin;
}

/* With hide_emitters the sensor looks past area lights on the first segment of its rays. */
static bool seen_past_lights(const struct imp_step *s, imp_v3 o, imp_v3 d, double reach)
{
    struct imp_hit hit;
    double from = 0;
    while (imp__intersect_at(s->scene, s->walk->time, &o, &d, from, reach, &hit)) {
        if (s->scene->shapes[hit.shape]->emitter < 0) return false;
        from = hit.t + (1 + fabs(hit.t)) * IMP_RAY_EPSILON;
    }
    return true;
}

/* Is the ray free, and what does it let pass? */
static bool sees(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *from,
                 const struct imp_shadow *shadow, imp_spec *T)
{
    *T = imp__spec(1);
    if (s->segment->sees) return s->segment->sees(s, v, from, shadow, T);
    if (imp_unlikely(s->tracer->integrator->hide_emitters))
        return seen_past_lights(s, shadow->o, shadow->d, shadow->reach);
    return !imp__occluded_at(s->scene, s->walk->time, &shadow->o, &shadow->d, 0,
                             shadow->reach);
}

void imp__light_sensor_numbers(const struct imp_step *s, double u[4])
{
    const struct imp_key key = s->walk->key;
    u[0] = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_U));
    u[1] = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_V));
    u[2] = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT));
    u[3] = imp__u01(key, imp__dim(s->depth, IMP_DIM_SPARE));
}

/* Weight of a connection against a walk that meets the sensor, which has density `pdf` per
 * steradian, or `across` per area across the ray. */
double imp__light_connect_weight(const struct imp_step *s,
                                 const struct imp_sensor_sample *to, double pdf,
                                 double across)
{
    const struct imp_sensor *sensor = s->tracer->sensor;
    if (!sensor->shape || imp__is_unmet(sensor) || !s->tracer->integrator->directions)
        return 1;
    const double c = to->cos_sensor;
    const double meets = across > 0 ? across * c : pdf * c / (to->dist * to->dist);
    return power_heuristic(1 / sensor->shape->area, meets);
}

/* The shadow ray from `from` to the sample. */
void imp__light_shadow_aim(const struct imp_surface *from,
                           const struct imp_sensor_sample *to, struct imp_shadow *shadow)
{
    const bool surface = imp__dot(from->ng, from->ng) > 0;
    shadow->o = surface ? imp__offset(from->p, from->ng, to->wo) : from->p;
    shadow->d = to->p - shadow->o;
    shadow->reach = imp__light_shadow_reach(to);
    shadow->wanted = true;
}

void imp__light_link_see(struct imp_step *s, struct imp_vertex *v,
                         const struct imp_surface *from, const struct imp_link *link)
{
    struct imp_light_step *w = (struct imp_light_step *)s;
    imp_spec T;
    if (s->recorded) v->d.connection = IMP_OCCLUDED;
    if (!sees(s, v, from, &link->shadow, &T)) return;
    v->b = link->f * link->le * link->weight * T;
    if (s->recorded) {
        v->d.connection = IMP_CONNECTED;
        v->d.light.weight = (imp_decided)link->weight;
        v->light_f = link->f;
        v->light_e = link->le;
        v->light_w = T * link->weight;
    }
    reach_add(w, v, false, link->sensor.px, link->sensor.py);
}

/* Density with which the walk would go on that way. */
static double continues_pdf(const struct imp_step *s, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs, imp_v3 d)
{
    if (imp_likely(!b->shaped)) {
        const double kernel = imp__bsdf_transposed_pdf(b, s->in, dirs);
        return imp_unlikely(s->guided.here) ? imp__guided_light_pdf(s, kernel, d)
                                            : kernel;
    }
    const struct imp_dirs exchanged = {dirs->wi, dirs->wo, IMP_SMOOTH, dirs->derivative};
    imp_spec p;
    imp__shaped_pdf(b, s->at.carried, s->in, &exchanged, &p);
    return imp__lane_mis_density(s, p);
}

bool imp__light_link_draw(struct imp_step *s, const struct imp_vertex *v,
                          const struct imp_surface *at, struct imp_link *link)
{
    const struct imp_sensor *sensor = s->tracer->sensor;
    const struct imp_walk_integrator *i = s->tracer->integrator;
    double u[4] = {0};
    if (!i->lights || !imp__light_depth_allows(s, s->depth + 1)) return false;
    if (!sensor->ops->connect || (i->hide_emitters && v->shape && v->shape->emitter >= 0))
        return false;
    if (!(sensor->ops->flags & IMP_SENSOR_PINHOLE)) imp__light_sensor_numbers(s, u);
    return imp__sensor_connect(sensor, &at->p, false, u, &link->sensor) &&
           imp__light_on_film(sensor, &link->sensor);
}

void imp__light_link_weigh(struct imp_step *s, struct imp_vertex *v,
                           const struct imp_surface *at, const struct imp_frame *frame,
                           struct imp_link *link)
{
    struct imp_light_step *w = (struct imp_light_step *)s;
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_sensor_sample *to = &link->sensor;
    const struct imp_dirs dirs = {imp__decide(imp__to_local(frame, to->wo)), s->wo,
                                  IMP_SMOOTH, imp__derivative_wanted(s, b)};
    const double c = v->shape
                         ? imp__bsdf_exchange(b, s->in, &dirs, imp__dot(to->wo, at->ng),
                                              imp__dot(-s->d, at->ng))
                         : 1;
    imp__bsdf_eval(b, s->at.carried, s->in, &dirs, &link->f);
    link->le = imp__spec(1);
    const double mis =
        w->both ? imp__both_reach_weight(w, to, b, &dirs)
        : s->tracer->sensor->shape
            ? imp__light_connect_weight(s, to, continues_pdf(s, b, &dirs, to->wo), 0)
            : 1;
    link->weight = imp__decide1(to->weight * c * mis);
    if (!(link->weight > 0)) return;
    if (imp__is_zero_used(link->f, s->at.carried) && !imp__wants_derivative(s, b)) return;
    imp__light_shadow_aim(at, to, &link->shadow);
    if (!s->recorded) return;
    struct imp_light *l = &v->d.light;
    l->emitter = -1;
    imp__store_v3(l->wi, dirs.wo);
    imp__store_v3(l->p, to->p);
    l->located =
        s->tracer->sensor->shape ? to->located : (struct imp_located){.prim = -1};
}
