/* SPDX-License-Identifier: Apache-2.0
 *
 * Densities of the vertices of both walks, drawn from either end, and the weights of the
 * ways in which a path is found. With L_k the density of vertex k, counted from the light,
 * drawn by a walk from there, and Y_k drawn by one from the sensor,
 *
 *     p_i/p_s = product of Y_k/L_k over i <= k < s,    of L_k/Y_k over s <= k < i
 *
 * Densities per steradian become densities per area with |cos|/r^2 at the geometric
 * normal. Where the wavelengths of a walk have densities of their own the mean over them
 * is taken, which does not depend on the one that drew. The density of a light sample
 * differs from that with which a walk begins at the same point: `sampled` is their ratio,
 * and p_1 has this factor more. */
#include "both.h"
#include <string.h>

/* ---- Densities ------------------------------------------------------------------- */

static double pdf_of(const struct imp_bsdf *b, const struct imp_carried *carried,
                     const imp_spec *in, imp_v3 wo, imp_v3 wi, bool derivative)
{
    const struct imp_dirs dirs = {wo, wi, IMP_SMOOTH, derivative};
    if (imp_likely(!b->shaped)) return b->ops->pdf(b, in, &dirs);
    imp_spec p;
    double sum = 0;
    imp__shaped_pdf(b, carried, in, &dirs, &p);
    for (int j = 0; j < carried->n; j++) sum += p[j];
    return sum / carried->n;
}

/* Of `to`, where `from` draws it with pdf per steradian. */
static double arrives(const struct imp_end *from, const struct imp_end *to, double pdf)
{
    if (to->far) return pdf;
    const imp_v3 d = to->p - from->p;
    const double r2 = imp__dot(d, d);
    if (!(r2 > 0)) return 0;
    if (imp__is_zero(to->ng)) return pdf / r2;
    return pdf * fabs(imp__dot(to->ng, d)) / (r2 * sqrt(r2));
}

/* Of a vertex that light without end meets along d. */
static double arrives_across(const struct imp_scene *scene, const struct imp_end *to,
                             imp_v3 d)
{
    const double r = scene->ball.radius;
    const double c = imp__is_zero(to->ng) ? 1 : fabs(imp__dot(to->ng, d));
    return IMP_INV_PI / (r * r) * c;
}

/* Of a vertex that the sensor's walks meet first: film area per area across the ray, as
 * `weight` of a connection has it. */
static double arrives_from_sensor(const struct imp_both *b, double weight,
                                  const struct imp_end *to, imp_v3 d)
{
    const double c = imp__is_zero(to->ng) ? 1 : fabs(imp__dot(to->ng, d));
    return weight * c / (b->sensor->scale * b->pixels);
}

static double light_pmf(const struct imp_scene *s, int light)
{
    return s->light_cdf[light] - (light ? s->light_cdf[light - 1] : 0);
}

/* With which walks begin at this point of a light; of the sky, in this direction. */
static double begins(const struct imp_scene *scene, int light,
                     const struct imp_emission *x)
{
    const struct imp_emitter *e = scene->emitters[light];
    const double pmf = light_pmf(scene, light);
    if (e->ops->flags & IMP_EMITTER_DELTA) return pmf;
    return e->shape ? pmf / e->shape->area : pmf * e->ops->pdf_emission(e, x);
}

/* ---- Ends ------------------------------------------------------------------------ */

static bool grow(struct imp_arena *arena, void **items, int n, int *cap, size_t size)
{
    if (n < *cap) return true;
    const int more = *cap ? 2 * *cap : 16;
    void *room = imp__arena_take(arena, (size_t)more, size);
    if (!room) return false;
    if (n) memcpy(room, *items, (size_t)n * size);
    *items = room;
    *cap = more;
    return true;
}

struct imp_end *imp__both_light_end(struct imp_both *b)
{
    int cap = b->cap_light;
    void *ends = b->light, *places = b->place;
    if (!grow(b->arena, &ends, b->n_light, &cap, sizeof *b->light)) return NULL;
    cap = b->cap_light;
    if (!grow(b->arena, &places, b->n_light, &cap, sizeof *b->place)) return NULL;
    b->light = ends;
    b->place = places;
    b->cap_light = cap;
    b->place[b->n_light].vertex = NULL;
    struct imp_end *e = &b->light[b->n_light++];
    *e = (struct imp_end){.own = 1, .other = 1};
    return e;
}

struct imp_end *imp__both_eye_end(struct imp_both *b)
{
    void *ends = b->from_eye;
    if (!grow(b->arena, &ends, b->n_eye, &b->cap_eye, sizeof *b->from_eye)) return NULL;
    b->from_eye = ends;
    struct imp_end *e = &b->from_eye[b->n_eye++];
    *e = (struct imp_end){.own = 1, .other = 1};
    return e;
}

/* ---- The walk from the light ------------------------------------------------------- */

bool imp__both_light_begins(struct imp_light_step *w, int light,
                            const struct imp_emission_sample *start)
{
    struct imp_both *b = w->both;
    const struct imp_scene *scene = w->s.scene;
    const struct imp_emitter *e = scene->emitters[light];
    const struct imp_emission x = {
        {start->uv[0], start->uv[1]}, 1, start->cos_light, start->d};
    struct imp_end *end = imp__both_light_end(b);
    if (!end) return false;
    end->far = e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR);
    end->p = end->far ? -start->d : start->p;
    end->ng = start->ng;
    end->own = begins(scene, light, &x);
    b->emitter = light;
    b->pdf_light = start->pdf_d;
    return true;
}

bool imp__both_light_arrives(struct imp_light_step *w, struct imp_vertex *v,
                             const struct imp_surface *at, const struct imp_frame *frame)
{
    struct imp_both *b = w->both;
    const struct imp_step *s = &w->s;
    struct imp_end *end = imp__both_light_end(b);
    imp_spec *in = NULL;
    if (!end) return false;
    const int k = b->n_light - 1;
    const struct imp_end *before = end - 1;
    struct imp_both_place *place = &b->place[k];
    end->p = at->p;
    end->ng = at->ng;
    if (k == 1 && before->far) end->own = arrives_across(s->scene, end, s->d);
    else if (b->pdf_light > 0) end->own = arrives(before, end, b->pdf_light);
    place->P = k == 1 ? v->prev->w : b->place[k - 1].P * v->prev->w;
    if (!(v->bsdf->flags & IMP_BSDF_SMOOTH) || !(end->own > 0)) return true;
    if (s->recorded) {
        in = v->in;
    } else {
        in = imp__arena_take(b->arena, (size_t)imp_max(v->bsdf->n_in, 1), sizeof *in);
        if (!in) return false;
        for (int j = 0; j < v->bsdf->n_in; j++) in[j] = s->in[j];
    }
    place->vertex = v;
    place->number = s->walk->n - 1;
    place->in = in;
    place->frame = *frame;
    place->wi = s->wo;
    place->d = -s->d;
    place->lanes = s->lanes;
    return true;
}

void imp__both_light_leaves(struct imp_light_step *w, const struct imp_bsdf *bsdf,
                            const struct imp_dirs *dirs)
{
    struct imp_both *b = w->both;
    const struct imp_step *s = &w->s;
    struct imp_end *end = &b->light[b->n_light - 1];
    end->delta = dirs->lobe != IMP_SMOOTH;
    b->pdf_light = 0;
    if (end->delta) return;
    b->pdf_light =
        pdf_of(bsdf, s->at.carried, s->in, dirs->wi, dirs->wo, dirs->derivative);
    end[-1].other =
        arrives(end, &end[-1],
                pdf_of(bsdf, s->at.carried, s->in, dirs->wo, dirs->wi, dirs->derivative));
}

/* ---- The walk from the sensor ------------------------------------------------------ */

bool imp__both_eye_arrives(struct imp_step *s, const struct imp_surface *at)
{
    struct imp_both *b = s->both;
    const struct imp_sensor *sensor = b->sensor;
    struct imp_end *end = imp__both_eye_end(b);
    if (!end) return false;
    const int k = b->n_eye - 1;
    end->far = !at;
    end->p = at ? at->p : s->d;
    if (at) end->ng = at->ng;
    if (k > 1 || sensor->shape) {
        if (b->pdf_eye > 0) end->own = arrives(end - 1, end, b->pdf_eye);
        if (k == 1)
            end->own *= (double)sensor->film.width * sensor->film.height / b->pixels;
        return true;
    }
    const double u[4] = {b->lens[0], b->lens[1], 0, 0};
    struct imp_sensor_sample to;
    b->sees = sensor->ops->connect(sensor, &end->p, end->far, u, &to);
    if (b->sees) end->own = arrives_from_sensor(b, to.weight, end, s->d);
    return true;
}

void imp__both_eye_leaves(struct imp_step *s, const struct imp_bsdf *bsdf,
                          const struct imp_frame *frame)
{
    struct imp_both *b = s->both;
    struct imp_end *end = &b->from_eye[b->n_eye - 1];
    const bool derivative = imp__wants_derivative(s, bsdf);
    end->delta = !(s->pdf > 0);
    b->pdf_eye = 0;
    if (end->delta) return;
    const imp_v3 wi = imp__decide(imp__to_local(frame, s->d));
    b->pdf_eye = imp_likely(!bsdf->shaped)
                     ? s->pdf
                     : pdf_of(bsdf, s->at.carried, s->in, s->wo, wi, derivative);
    if (b->n_eye < 2) return;
    end[-1].other =
        arrives(end, &end[-1], pdf_of(bsdf, s->at.carried, s->in, wi, s->wo, derivative));
}

/* ---- Weights ----------------------------------------------------------------------- */

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

/* Of two walks joined at y, the last of the walk from the sensor: `other` there. */
static void other_eye(struct way *w, double arriving, const struct imp_step *s,
                      const struct imp_bsdf *b, const struct imp_dirs *dirs)
{
    const struct imp_end *y = &w->eye[w->t - 1];
    w->other[2] = arriving;
    if (w->t > 1)
        w->other[3] = arrives(
            y, y - 1,
            pdf_of(b, s->at.carried, s->in, dirs->wi, dirs->wo, dirs->derivative));
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
    w.other[2] = begins(s->scene, emitter, &x);
    w.other[3] = at ? arrives(x0, x1, e->ops->pdf_emission(e, &x))
                    : arrives_across(s->scene, x1, s->d);
    if (at && (t > 2 || b->sensor->shape))
        w.sampled =
            arrives(x1, x0, e->ops->pdf(e, &x1->p, &s->d, hit, at)) * e->shape->area;
    return weight(&w);
}

double imp__both_sample_weight(const struct imp_step *s, int light,
                               const struct imp_light_sample *to,
                               const struct imp_bsdf *bsdf, const struct imp_dirs *dirs)
{
    const struct imp_both *b = s->both;
    const struct imp_emitter *e = s->scene->emitters[light];
    const bool far = !isfinite(to->dist), area = e->ops->flags & IMP_EMITTER_AREA;
    const struct imp_end *y = &b->from_eye[b->n_eye - 1];
    const struct imp_emission x = {
        {to->uv[0], to->uv[1]}, to->dist, to->cos_light, -to->wi};
    struct imp_end end = {.p = far ? to->wi : to->p, .own = 1, .other = 1, .far = far};
    if (area) end.ng = to->ng;
    end.own = begins(s->scene, light, &x);
    struct way w = {.both = b,
                    .light = &end,
                    .s = 1,
                    .eye = b->from_eye,
                    .t = b->n_eye,
                    .sampled = 1,
                    .light_met = !(e->ops->flags & IMP_EMITTER_DELTA)};
    w.other[0] =
        arrives(y, &end,
                pdf_of(bsdf, s->at.carried, s->in, dirs->wo, dirs->wi, dirs->derivative));
    if (area) w.sampled = arrives(y, &end, to->pdf) * e->shape->area;
    if (!(end.own > 0)) return 1; /* the light begins no walk here */
    other_eye(&w,
              far ? arrives_across(s->scene, y, to->wi)
                  : arrives(&end, y, e->ops->pdf_emission(e, &x)),
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
    w->other[1] =
        arrives(&b->light[k], &b->light[k - 1],
                pdf_of(bsdf, s->at.carried, in, dirs->wo, dirs->wi, dirs->derivative));
}

/* Density of a light sample at the first vertex behind the light, over that of beginning
 * there. */
static double sampled(const struct imp_both *b, const struct imp_scene *scene)
{
    const struct imp_emitter *e = scene->emitters[b->emitter];
    const struct imp_end *x0 = &b->light[0], *x1 = &b->light[1];
    if (!(e->ops->flags & IMP_EMITTER_AREA)) return 1;
    const struct imp_surface at = {.p = x0->p, .ng = x0->ng, .n = x0->ng};
    const imp_v3 d = x0->p - x1->p, wi = imp__normalize(d);
    const struct imp_hit hit = {.shape = e->shape->index, .t = imp__length(d)};
    return arrives(x1, x0, e->ops->pdf(e, &x1->p, &wi, &hit, &at)) * e->shape->area;
}

double imp__both_joint_weight(const struct imp_step *s, int k,
                              const struct imp_bsdf *bsdf, const struct imp_dirs *at_y,
                              const struct imp_dirs *at_z)
{
    const struct imp_both *b = s->both;
    const struct imp_both_place *place = &b->place[k];
    const struct imp_end *y = &b->from_eye[b->n_eye - 1], *z = &b->light[k];
    struct way w = {.both = b, .eye = b->from_eye, .t = b->n_eye};
    other_light(
        &w, s, k,
        arrives(y, z,
                pdf_of(bsdf, s->at.carried, s->in, at_y->wo, at_y->wi, at_y->derivative)),
        place->vertex->bsdf, place->in, at_z);
    w.sampled = sampled(b, s->scene);
    other_eye(&w,
              arrives(z, y,
                      pdf_of(place->vertex->bsdf, s->at.carried, place->in, at_z->wi,
                             at_z->wo, at_z->derivative)),
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
                                .own = begins(scene, emitter, x),
                                .far = far};
    const struct imp_end sensor = {.p = to->p, .own = 1, .other = 1};
    struct way w = {.both = b,
                    .light = &end,
                    .s = 1,
                    .eye = &sensor,
                    .t = 1,
                    .sampled = 1,
                    .light_met = true};
    w.other[0] = arrives_from_sensor(b, to->weight, &end, x->d);
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
    other_light(&w, s, k, arrives_from_sensor(b, to->weight, z, to->wo), bsdf, s->in,
                dirs);
    w.sampled = sampled(b, s->scene);
    w.other[2] =
        arrives(z, &sensor,
                pdf_of(bsdf, s->at.carried, s->in, dirs->wi, dirs->wo, dirs->derivative));
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
    w.other[1] = arrives(x, x - 1, cosine * IMP_INV_PI) * share;
    w.sampled = sampled(b, s->scene);
    return weight(&w);
}
