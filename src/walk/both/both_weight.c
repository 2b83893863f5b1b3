/* SPDX-License-Identifier: Apache-2.0
 *
 * Weights of the ways in which bidirectional walks find a path. With L_k the density of
 * vertex k, counted from the light, drawn by a walk from there, and Y_k drawn by one from
 * the sensor,
 *
 *     p_i/p_s = product of Y_k/L_k over i <= k < s,    of L_k/Y_k over s <= k < i
 *
 * The density of a light sample differs from that with which a walk begins at the same
 * point: `sampled` is their ratio, and p_1 has this factor more. */
#include "both_density.h"

/* One way to find a path: s vertices of the walk from the light, t of the other. */
struct way {
    const struct imp_both *both;
    const struct imp_end *light, *eye; /* [s], [t] */
    int s, t;
    /* `other` of light[s - 1], light[s - 2], eye[t - 1], eye[t - 2], where the two walks
     * join. */
    double other[4];
    double sampled;
    bool light_met; /* a walk from the sensor can meet the light */
};

/* Can one walk of i vertices from the light and one of n - i from the sensor be joined? At
 * the vertices where this way joins them no delta lobe scatters. */
static bool possible(const struct way *w, int i)
{
    const int n = w->s + w->t, j = n - i;
    const bool meter = w->both->sensor->shape != NULL;
    if (i == 0) return w->light_met;
    if (j == 0) return meter;
    if (j == 1 && w->t > 1 && !w->both->sees) return false;
    for (int side = 0; side < 2; side++) {
        const int k = i - 1 + side; /* from the light */
        const bool joins = k == w->s - 1 || k == w->s;
        const struct imp_end *end = k < w->s ? &w->light[k] : &w->eye[n - 1 - k];
        if (!joins && end->delta) return false;
    }
    return true;
}

static double weight(const struct way *w)
{
    const int n = w->s + w->t;
    const double own = w->s == 1 ? w->sampled : 1;
    double sum = own * own, ratio = 1;
    for (int i = w->s - 1; i >= 0; i--) {
        const double other = i == w->s - 1   ? w->other[0]
                             : i == w->s - 2 ? w->other[1]
                                             : w->light[i].other;
        ratio *= other / w->light[i].own;
        if (possible(w, i)) sum += imp__sqr(i == 1 ? ratio * w->sampled : ratio);
    }
    ratio = 1;
    for (int j = w->t - 1; j >= 0; j--) {
        const double other = j == w->t - 1   ? w->other[2]
                             : j == w->t - 2 ? w->other[3]
                                             : w->eye[j].other;
        ratio *= other / w->eye[j].own;
        if (possible(w, n - j)) sum += imp__sqr(n - j == 1 ? ratio * w->sampled : ratio);
    }
    const double x = own * own / sum;
    return x >= 0 ? x : 0; /* also of 0/0 */
}

/* `other` at y, the last vertex of the walk from the sensor, where two walks are joined. */
static void other_eye(struct way *w, double arriving, const struct imp_step *s,
                      const struct imp_bsdf *b, const struct imp_dirs *dirs)
{
    const struct imp_end *y = &w->eye[w->t - 1];
    w->other[2] = arriving;
    if (w->t > 1)
        w->other[3] = imp__end_arrives(
            y, y - 1,
            imp__end_pdf(b, s->at.carried, s->in, dirs->wi, dirs->wo, dirs->derivative));
}

double imp__both_met_weight(const struct imp_step *s, int emitter,
                            const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct imp_both *b = s->both;
    const struct imp_emitter *e = s->scene->emitters[emitter];
    const int t = b->n_eye;
    const struct imp_end *x0 = &b->from_eye[t - 1], *x1 = x0 - 1;
    const struct imp_emission x = {{at ? at->uv[0] : 0, at ? at->uv[1] : 0},
                                   at ? hit->t : INFINITY,
                                   at ? -imp__dot(at->n, s->d) : 1,
                                   -s->d};
    struct way w = {.both = b, .eye = b->from_eye, .t = t, .sampled = 1};
    w.other[2] = imp__end_begins(s->scene, emitter, &x);
    w.other[3] = at ? imp__end_arrives(x0, x1, e->ops->pdf_emission(e, &x))
                    : imp__end_arrives_across(s->scene, emitter, x1, s->d);
    if (at && (t > 2 || b->sensor->shape))
        w.sampled = imp__end_arrives(x1, x0, e->ops->pdf(e, &x1->p, &s->d, hit, at)) *
                    e->shape->area;
    return weight(&w);
}

double imp__both_sample_weight(const struct imp_step *s, int light,
                               const struct imp_light_sample *to,
                               const struct imp_bsdf *bsdf, const struct imp_dirs *dirs)
{
    const struct imp_both *b = s->both;
    const struct imp_emitter *e = s->scene->emitters[light];
    const bool far = imp__end_is_far(e), area = imp__end_is_area(e);
    const struct imp_end *y = &b->from_eye[b->n_eye - 1];
    const struct imp_emission x = {
        {to->uv[0], to->uv[1]}, to->dist, to->cos_light, -to->wi};
    struct imp_end end = {.p = far ? to->wi : to->p, .own = 1, .other = 1, .far = far};
    if (area) end.ng = to->ng;
    end.own = imp__end_begins(s->scene, light, &x);
    struct way w = {.both = b,
                    .light = &end,
                    .s = 1,
                    .eye = b->from_eye,
                    .t = b->n_eye,
                    .sampled = 1,
                    .light_met = !(e->ops->flags & IMP_EMITTER_DELTA)};
    w.other[0] = imp__end_arrives(
        y, &end,
        imp__end_pdf(bsdf, s->at.carried, s->in, dirs->wo, dirs->wi, dirs->derivative));
    if (area) w.sampled = imp__end_arrives(y, &end, to->pdf) * e->shape->area;
    if (!(end.own > 0)) return 1; /* the light begins no walk here */
    other_eye(&w,
              far ? imp__end_arrives_across(s->scene, light, y, to->wi)
                  : imp__end_arrives(&end, y, e->ops->pdf_emission(e, &x)),
              s, bsdf, dirs);
    return weight(&w);
}

/* `other` and what else depends on the walk from the light, joined at its vertex k along
 * dirs. `arriving`: at it. */
static void other_light(struct way *w, const struct imp_step *s, int k, double arriving,
                        const struct imp_bsdf *bsdf, const imp_spec *in,
                        const struct imp_dirs *dirs)
{
    const struct imp_both *b = w->both;
    const struct imp_emitter *e = s->scene->emitters[b->emitter];
    w->light = b->light;
    w->s = k + 1;
    w->light_met = !(e->ops->flags & IMP_EMITTER_DELTA);
    w->sampled = 1;
    w->other[0] = arriving;
    w->other[1] = imp__end_arrives(
        &b->light[k], &b->light[k - 1],
        imp__end_pdf(bsdf, s->at.carried, in, dirs->wo, dirs->wi, dirs->derivative));
}

/* Density of a light sample at the first vertex behind the light, over that of beginning
 * there. */
static double sampled(const struct imp_both *b, const struct imp_scene *scene)
{
    const struct imp_emitter *e = scene->emitters[b->emitter];
    const struct imp_end *x0 = &b->light[0], *x1 = &b->light[1];
    if (!imp__end_is_area(e)) return 1;
    const struct imp_surface at = {.p = x0->p, .ng = x0->ng, .n = x0->ng};
    const imp_v3 d = x0->p - x1->p, wi = imp__normalize(d);
    const struct imp_hit hit = {.shape = e->shape->index, .t = imp__length(d)};
    return imp__end_arrives(x1, x0, e->ops->pdf(e, &x1->p, &wi, &hit, &at)) *
           e->shape->area;
}

double imp__both_joint_weight(const struct imp_step *s, int k,
                              const struct imp_bsdf *bsdf, const struct imp_dirs *at_y,
                              const struct imp_dirs *at_z)
{
    const struct imp_both *b = s->both;
    const struct imp_both_place *place = &b->place[k];
    const struct imp_end *y = &b->from_eye[b->n_eye - 1], *z = &b->light[k];
    struct way w = {.both = b, .eye = b->from_eye, .t = b->n_eye};
    other_light(&w, s, k,
                imp__end_arrives(y, z,
                                 imp__end_pdf(bsdf, s->at.carried, s->in, at_y->wo,
                                              at_y->wi, at_y->derivative)),
                place->vertex->bsdf, place->in, at_z);
    w.sampled = sampled(b, s->scene);
    other_eye(&w,
              imp__end_arrives(z, y,
                               imp__end_pdf(place->vertex->bsdf, s->at.carried, place->in,
                                            at_z->wi, at_z->wo, at_z->derivative)),
              s, bsdf, at_y);
    return weight(&w);
}

double imp__both_light_weight(const struct imp_light_step *light, int emitter,
                              const struct imp_emission_sample *start,
                              const struct imp_emission *x,
                              const struct imp_sensor_sample *to)
{
    const struct imp_both *b = light->both;
    const struct imp_scene *scene = light->s.scene;
    const bool far = !isfinite(x->dist);
    const struct imp_end end = {.p = far ? -start->d : start->p,
                                .ng = start->ng,
                                .own = imp__end_begins(scene, emitter, x),
                                .far = far};
    const struct imp_end sensor = {.p = to->p, .own = 1, .other = 1};
    struct way w = {.both = b,
                    .light = &end,
                    .s = 1,
                    .eye = &sensor,
                    .t = 1,
                    .sampled = 1,
                    .light_met = true};
    w.other[0] = imp__end_arrives_from_sensor(b, to->weight, &end, x->d);
    return weight(&w);
}

double imp__both_reach_weight(const struct imp_light_step *light,
                              const struct imp_sensor_sample *to,
                              const struct imp_bsdf *bsdf, const struct imp_dirs *dirs)
{
    const struct imp_both *b = light->both;
    const struct imp_step *s = &light->s;
    const int k = b->n_light - 1;
    const struct imp_end *z = &b->light[k];
    const struct imp_end sensor = {
        .p = to->p, .ng = to->ng, .own = b->from_eye[0].own, .other = 1};
    struct way w = {.both = b, .eye = &sensor, .t = 1};
    other_light(&w, s, k, imp__end_arrives_from_sensor(b, to->weight, z, to->wo), bsdf,
                s->in, dirs);
    w.sampled = sampled(b, s->scene);
    w.other[2] = imp__end_arrives(
        z, &sensor,
        imp__end_pdf(bsdf, s->at.carried, s->in, dirs->wi, dirs->wo, dirs->derivative));
    return weight(&w);
}

double imp__both_sensor_weight(const struct imp_light_step *light, double cosine)
{
    const struct imp_both *b = light->both;
    const struct imp_step *s = &light->s;
    const struct imp_film_desc *film = &b->sensor->film;
    const struct imp_emitter *e = s->scene->emitters[b->emitter];
    const int k = b->n_light - 1;
    const struct imp_end *x = &b->light[k];
    const double share = (double)film->width * film->height / b->pixels;
    struct way w = {.both = b,
                    .light = b->light,
                    .s = k + 1,
                    .light_met = !(e->ops->flags & IMP_EMITTER_DELTA)};
    w.other[0] = b->from_eye[0].own;
    w.other[1] = imp__end_arrives(x, x - 1, cosine * IMP_INV_PI) * share;
    w.sampled = sampled(b, s->scene);
    return weight(&w);
}
