/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk. The step below is the only place where paths are made: rendering, gradients,
 * replays and frozen checks all start from what it records. Path tracing with light
 * samples, and Stam's walk that collects emission only where it is absorbed, are settings
 * of it.
 *
 * Estimator (gradients.md 8): E_k = w^B Le for emission met by chance, B_k = w^E f Le /
 * p^e for a light sample, power heuristic with exponent 2, w^B = 1 at the first vertex
 * and after a delta lobe. Depth: emission at vertex k counts if k < max_depth, scattering
 * goes on and samples lights if k + 1 < max_depth (scene-format 11). */
#include "bend.h"
#include "dims.h"

struct step {
    const struct imp_tracer *tracer;
    const struct imp_scene *scene;
    struct imp_walk *walk;
    struct imp_arena *arena;
    imp_v3 o, d; /* the ray in flight */
    double t_min, t_max;
    double pdf;    /* of d per steradian; 0: a delta lobe or the sensor chose it */
    imp_v3 from;   /* where the ray left, for light densities */
    imp_spec beta; /* throughput, zero factors left out: for roulette only */
    double eta;    /* product of index ratios */
    int zeros[3];  /* per lane: factors that are zero but have a derivative */
    int depth;
    struct imp_bending *bend; /* NULL: no medium in the scene */
    /* What the guide knows where the walk is, and where the ray in flight left. */
    bool known, left_known;
    struct imp_guide_place place, left;
    double reference; /* radiance that the guide expects of this walk; 0: none */
    imp_spec before;  /* beta on arrival */
    imp_v3 arrived;   /* direction of arrival */
};

static double light_pmf(const struct imp_scene *s, int light)
{
    return s->light_cdf[light] - (light ? s->light_cdf[light - 1] : 0);
}

static double power_heuristic(double a, double b)
{
    const double a2 = a * a, b2 = b * b;
    return a2 > 0 ? a2 / (a2 + b2) : 0;
}

static bool wants_lights(const struct imp_integrator *i)
{
    return i->kind == IMP_INTEGRATOR_PATH ||
           (i->kind == IMP_INTEGRATOR_DIRECT && i->emitter_samples > 0);
}

/* With room behind it for n_in inputs of its BSDF. */
static struct imp_vertex *vertex_add(struct step *s, int n_in)
{
    if (imp_unlikely(s->walk->n == IMP_WALK_MAX)) {
        s->walk->dropped = IMP_DROP_LONG;
        return NULL;
    }
    struct imp_vertex *v =
        imp__arena_take(s->arena, 1, sizeof *v + (size_t)n_in * sizeof *v->in);
    if (imp_unlikely(!v)) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return NULL;
    }
    struct imp_walk *w = s->walk;
    v->prev = w->last;
    v->next = NULL;
    if (w->last) w->last->next = v;
    else w->first = v;
    w->last = v;
    w->n++;
    v->bsdf = NULL;
    v->shape = NULL;
    v->leg = NULL;
    v->in = (imp_spec *)(v + 1);
    v->w = v->e = v->lin = (imp_spec){0};
    v->inv_ps = v->pdf = v->l_weight = 0;
    v->survive = 1;
    v->emitter = v->light = -1;
    v->glows = false;
    v->e_weight = v->g_weight = 1;
    return v;
}

/* Radiance of emitter e at x; inputs are looked up on the light. */
static imp_spec emitter_radiance(const struct imp_emitter *e,
                                 const struct imp_emission *x, imp_v3 p)
{
    imp_spec in[8], le;
    const struct imp_texcoord at = {{x->uv[0], x->uv[1]}, p};
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval(e, in, x, &le);
    return le;
}

/* Emission met by the ray at an area light, or the environment (hit NULL). */
static void emission_meet(struct step *s, struct imp_vertex *v, int emitter,
                          const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct imp_emitter *e = s->scene->emitters[emitter];
    struct imp_emission *x = &v->e_at;
    *x = (struct imp_emission){{0, 0}, INFINITY, 1, -s->d};
    if (at) {
        x->uv[0] = at->uv[0];
        x->uv[1] = at->uv[1];
        x->dist = hit->t;
        x->cos_light = -imp__dot(at->n, s->d);
    }
    v->emitter = emitter;
    if (s->pdf > 0 && wants_lights(s->tracer->integrator)) {
        const struct imp_guide *g = s->tracer->guide;
        const double pmf = imp_unlikely(s->left_known)
                               ? g->light_pmf(g, &s->left, emitter)
                               : light_pmf(s->scene, emitter);
        const double pe = pmf * e->ops->pdf(e, &s->from, &s->d, hit, at);
        v->e_weight *= power_heuristic(s->pdf, pe);
    } else if (s->depth > 0 && s->tracer->integrator->bsdf_samples == 0 && s->pdf > 0) {
        v->e_weight = 0;
    }
    v->e += emitter_radiance(e, x, v->at.p) * v->e_weight;
}

/* Does the guide draw a part of the continuations here? Its directions are on the front,
 * and a delta lobe has no density to mix with. */
static bool mixes(const struct step *s, const struct imp_bsdf *b)
{
    return s->known && s->place.share > 0 &&
           (b->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT |
                        IMP_BSDF_NULL)) == IMP_BSDF_SMOOTH;
}
static double mixture_pdf(const struct step *s, double bsdf, imp_v3 w)
{
    const struct imp_guide *g = s->tracer->guide;
    const double share = s->place.share;
    return (1 - share) * bsdf + share * g->pdf(g, &s->place, w);
}

/* As ops->sample, with the density of the mixture. */
static bool mixture_sample(struct step *s, struct imp_vertex *v,
                           const struct imp_frame *frame, const double u[3],
                           struct imp_bsdf_sample *out)
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_guide *g = s->tracer->guide;
    const double share = s->place.share;
    imp_v3 w;
    if (u[0] < share) {
        w = g->draw(g, &s->place, &u[1]);
        v->dirs.wi = imp__to_local(frame, w);
    } else {
        const double rest[3] = {fmin((u[0] - share) / (1 - share), 0x1.fffffffffffffp-1),
                                u[1], u[2]};
        if (!b->ops->sample(b, v->in, rest, &v->dirs, out)) return false;
        w = imp__to_world(frame, v->dirs.wi);
    }
    const double bsdf = b->ops->pdf(b, v->in, &v->dirs);
    if (!(bsdf > 0)) return false; /* structurally zero */
    b->ops->eval(b, v->in, &v->dirs, &out->f);
    out->pdf = mixture_pdf(s, bsdf, w);
    out->eta = 1;
    return true;
}

/* The shadow ray of a light sample; light -1: there is nothing to see. */
struct shadow {
    imp_v3 o, d;
    double reach;
    int light;
};

/* Light sample at v: choose an emitter and a point on it. Whether it is visible is asked
 * later, after the continuation is drawn: neither waits for the other's arithmetic. */
static void light_sample(struct step *s, struct imp_vertex *v,
                         const struct imp_surface *at, const struct imp_frame *frame,
                         struct shadow *shadow)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_key key = s->walk->key;
    const int n = scene->n_emitters;
    if (n == 0) return;
    const double choice = imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT));
    const struct imp_guide *g = s->tracer->guide;
    int light = 0, above = n - 1; /* the first whose cumulative weight exceeds choice */
    if (imp_unlikely(s->known)) light = above = g->light(g, &s->place, choice);
    while (light < above) {
        const int middle = (light + above) / 2;
        if (choice < scene->light_cdf[middle]) above = middle;
        else light = middle + 1;
    }
    const double pmf = imp_unlikely(s->known) ? g->light_pmf(g, &s->place, light)
                                              : light_pmf(scene, light);
    if (!(pmf > 0)) return;

    const struct imp_emitter *e = scene->emitters[light];
    const double u[2] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_LIGHT_V))};
    struct imp_light_sample ls;
    if (!e->ops->sample(e, &at->p, u, &ls) || !(ls.pdf > 0)) return;

    const struct imp_dirs dirs = {v->dirs.wo, imp__to_local(frame, ls.wi), IMP_SMOOTH};
    double pdf_bsdf = v->bsdf->ops->pdf(v->bsdf, v->in, &dirs);
    if (!(pdf_bsdf > 0)) return; /* structurally zero: nothing to see, no derivative */
    if (imp_unlikely(s->known) && mixes(s, v->bsdf))
        pdf_bsdf = mixture_pdf(s, pdf_bsdf, ls.wi);
    const struct imp_emission x = {{ls.uv[0], ls.uv[1]}, ls.dist, ls.cos_light, -ls.wi};
    const imp_spec le = emitter_radiance(e, &x, ls.p);
    imp_spec f;
    v->bsdf->ops->eval(v->bsdf, v->in, &dirs, &f);
    const struct imp_active *active = s->tracer->active;
    const bool differentiable =
        active &&
        ((v->bsdf->index >= 0 && active->bsdf[v->bsdf->index]) || active->emitter[light]);
    if (imp__is_zero(f * le) && !differentiable) return;

    /* Aimed from the moved origin at the point itself: a ray parallel to wi would meet a
     * concave light before its end. */
    const bool far = !isfinite(ls.dist);
    shadow->o = imp__offset(at->p, at->ng, ls.wi);
    shadow->d = far ? ls.wi : ls.p - shadow->o; /* then t = 1 is the light */
    shadow->reach = far ? INFINITY : 1 - 10 * IMP_RAY_EPSILON;
    shadow->light = light;

    const bool delta = e->ops->flags & IMP_EMITTER_DELTA;
    const bool bsdf_samples = s->tracer->integrator->bsdf_samples > 0;
    const double p = ls.pdf * pmf;
    v->l_at = x;
    v->l_wi = dirs.wi;
    v->l_p = ls.p;
    v->l_f = f;
    v->l_le = le;
    v->l_weight = (delta || !bsdf_samples ? 1 : power_heuristic(p, pdf_bsdf)) / p;
}

/* beta *= f/p, where a lane's first factor that is zero but has a derivative is left out:
 * the walk goes on, because what arrives from beyond is that derivative. A second one
 * ends the lane (gradients.md 9.2). False: all lanes have ended. */
static bool throughput_add(struct step *s, const struct imp_bsdf *b, imp_spec factor)
{
    const struct imp_active *active = s->tracer->active;
    if (imp_likely(factor[0] != 0 && factor[1] != 0 && factor[2] != 0)) {
        s->beta *= factor;
        return !imp__is_zero(s->beta);
    }
    const bool differentiable = active && b->index >= 0 && active->bsdf[b->index];
    const double stand_in = fmax(imp__max3(factor), 0.5);
    for (int c = 0; c < 3; c++) {
        if (factor[c] != 0) continue;
        if (differentiable && s->zeros[c]++ == 0) factor[c] = stand_in;
    }
    s->beta *= factor;
    return !imp__is_zero(s->beta);
}

/* By what is expected to come (adjoint-driven roulette, Vorba and Krivanek 2016): what
 * the rest of this walk should add, over the walk's own expected radiance. */
static double guided_survival(const struct step *s, double q)
{
    const struct imp_guide *g = s->tracer->guide;
    if (!s->known) return s->depth + 1 < s->tracer->integrator->rr_depth ? 1 : q;
    if (s->depth == 0) return 1;
    const double rest = imp__max3(s->before) * g->expected(g, &s->place, -s->arrived);
    return imp_clamp(rest / s->reference, 0.2, 1.0);
}

/* Survival probability. Zero factors that still have a derivative are left out of beta,
 * so roulette sees the walk as if they were not there (gradients.md 9.1, 9.2). */
static bool roulette(struct step *s, struct imp_vertex *v)
{
    const struct imp_integrator *integrator = s->tracer->integrator;
    if (integrator->kind == IMP_INTEGRATOR_STAM) { /* `absorb` has drawn already */
        v->survive = 1 - v->bsdf->absorb;
        return true;
    }
    if (s->depth + 1 < integrator->rr_depth && !(s->reference > 0)) return true;
    double q = fmin(imp__max3(s->beta) * s->eta * s->eta, 0.95);
    if (imp_unlikely(s->reference > 0)) q = guided_survival(s, q);
    v->survive = q;
    return imp__u01(s->walk->key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < q;
}

/* Draw the continuation at v. False: the walk ends here. */
static bool scatter(struct step *s, struct imp_vertex *v, const struct imp_surface *at,
                    const struct imp_frame *frame)
{
    const struct imp_key key = s->walk->key;
    const struct imp_bsdf *b = v->bsdf;
    const double u[3] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LOBE)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_U)),
                         imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_V))};
    struct imp_bsdf_sample sample;
    v->dirs.lobe = IMP_SMOOTH;
    const bool drawn = imp_unlikely(s->known) && mixes(s, b)
                           ? mixture_sample(s, v, frame, u, &sample)
                           : b->ops->sample(b, v->in, u, &v->dirs, &sample);
    if (!drawn || !(sample.pdf > 0)) return false;
    v->pdf = sample.pdf;

    s->before = s->beta;
    if (!throughput_add(s, b, sample.f * (1 / sample.pdf))) return false;
    s->eta *= sample.eta;
    if (!roulette(s, v)) return false;
    s->beta *= imp__spec(1 / v->survive);
    v->inv_ps = 1 / (sample.pdf * v->survive);
    v->w = sample.f * v->inv_ps;

    if (imp_unlikely(s->tracer->guide != NULL)) {
        s->left_known = s->known;
        s->left = s->place;
    }
    s->d = imp__to_world(frame, v->dirs.wi);
    s->o = imp__offset(at->p, at->ng, s->d);
    s->from = at->p;
    s->t_min = 0;
    s->t_max = INFINITY;
    s->pdf = v->dirs.lobe == IMP_SMOOTH ? sample.pdf : 0;
    if (imp_unlikely(s->bend != NULL)) {
        imp__bend_leave(s->tracer, s->bend, v, at, s->d);
        if (s->bend->medium) s->pdf = 0; /* no light sample could have been taken */
    }
    return true;
}

/* The ray in flight, in a medium: to what it meets. The step's weight gets the ratio of
 * the squared indices at its ends: radiance/n^2 is what stays along a ray. */
static __attribute__((noinline)) bool bend_meet(struct step *s, struct imp_hit *hit)
{
    struct imp_vertex *last = s->walk->last;
    double ratio;
    if (!imp__bend_meet(s->scene, s->bend, &s->from, &s->o, &s->d, hit, &ratio)) {
        s->walk->dropped = IMP_DROP_BENT;
        return false;
    }
    const double scale = ratio * ratio;
    last->inv_ps *= scale;
    last->w *= scale;
    s->beta *= scale;
    s->eta /= ratio;
    return true;
}

/* Stam's termination: with probability `absorb` the walk ends and collects what glows
 * here, divided by it; else it goes on, divided by the rest (gradients.md 6, E22-E24). */
static bool absorb(struct step *s, struct imp_vertex *v)
{
    const double a = v->bsdf->absorb;
    if (!(a > 0)) return false;
    if (imp__u01(s->walk->key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < a) {
        s->walk->absorbed = true;
        v->e_weight = v->g_weight = 1 / a;
        return true;
    }
    v->e_weight = v->g_weight = 0;
    return false;
}

/* Area lights that a camera ray passes through (hide_emitters). */
static bool first_hit(struct step *s, struct imp_hit *hit)
{
    const bool hide = s->tracer->integrator->hide_emitters && s->depth == 0;
    while (imp__intersect(s->scene, &s->o, &s->d, s->t_min, s->t_max, hit)) {
        if (!hide || s->scene->shapes[hit->shape]->emitter < 0) return true;
        const imp_v3 p = s->o + s->d * hit->t;
        const double scale = fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2])));
        s->t_min = hit->t + (1 + scale) * IMP_RAY_EPSILON;
    }
    return false;
}

static void guide_find(struct step *s, const struct imp_hit *hit,
                       const struct imp_surface *at)
{
    const struct imp_guide *g = s->tracer->guide;
    s->known = g->find(g, hit, at, s->d, &s->place);
    s->arrived = s->d;
    if (s->depth == 0 && s->known && g->expected)
        s->reference = g->expected(g, &s->place, -s->d);
}

/* From the ray in flight to the next one; false: the walk ends. */
static bool step(struct step *s)
{
    const struct imp_scene *scene = s->scene;
    const struct imp_integrator *integrator = s->tracer->integrator;
    const bool counts = integrator->max_depth < 0 || s->depth < integrator->max_depth;
    const bool goes_on =
        integrator->max_depth < 0 || s->depth + 1 < integrator->max_depth;
    struct imp_hit hit;
    if (imp_unlikely(s->bend != NULL) && s->bend->medium) {
        if (!bend_meet(s, &hit)) return false;
    } else if (!first_hit(s, &hit)) {
        const bool hidden = integrator->hide_emitters && s->depth == 0;
        if (scene->environment < 0 || hidden || !counts) return false;
        struct imp_vertex *v = vertex_add(s, 0);
        if (!v) return false;
        v->t = INFINITY;
        v->at = (struct imp_texcoord){{0, 0}, s->d};
        emission_meet(s, v, scene->environment, NULL, NULL);
        s->walk->valid = true;
        return false;
    }

    const struct imp_shape *shape = scene->shapes[hit.shape];
    struct imp_surface at;
    shape->ops->surface(shape, &hit, &s->o, &s->d, &at);
    const struct imp_bsdf *bsdf = imp__shape_bsdf(scene, shape);
    struct imp_vertex *v = vertex_add(s, bsdf->n_in);
    if (!v) return false;
    struct imp_frame frame = {at.s, at.t, at.n};
    v->shape = shape;
    v->bsdf = bsdf;
    v->t = hit.t;
    v->ng = at.ng;
    v->at = (struct imp_texcoord){{at.uv[0], at.uv[1]}, at.p};
    v->dirs.wo = imp__to_local(&frame, -s->d);
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &v->at, v->in);
    if (imp_unlikely(s->bend != NULL)) {
        if (!imp__bend_arrive(s->tracer, s->arena, s->walk, s->bend, v, &hit, &at, s->d))
            return false;
        frame = (struct imp_frame){at.s, at.t, at.n}; /* it may have moved a little */
    }

    if (imp_unlikely(s->tracer->guide != NULL)) guide_find(s, &hit, &at);
    struct shadow shadow = {.light = -1};
    const bool stam = integrator->kind == IMP_INTEGRATOR_STAM;
    const bool ended = stam && counts && absorb(s, v);
    if (stam) s->walk->valid = true;
    if (counts && v->e_weight > 0) {
        if (v->bsdf->flags & IMP_BSDF_EMIT) {
            imp_spec glow;
            v->bsdf->ops->emit(v->bsdf, v->in, &v->dirs.wo, &glow);
            v->e += glow * v->g_weight;
            v->glows = true;
        }
        if (shape->emitter >= 0) {
            emission_meet(s, v, shape->emitter, &hit, &at);
            if (!integrator->hide_emitters || s->depth > 0) s->walk->valid = true;
        }
    }
    if (ended || !goes_on) return false;
    if ((v->bsdf->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA)) &&
        !(v->bsdf->flags & IMP_BSDF_NULL))
        s->walk->valid = true;
    if ((v->bsdf->flags & IMP_BSDF_SMOOTH) && wants_lights(integrator) &&
        !(s->bend && s->bend->medium))
        light_sample(s, v, &at, &frame, &shadow);
    const bool only_lights =
        integrator->kind == IMP_INTEGRATOR_DIRECT && integrator->bsdf_samples == 0;
    const bool continues = !only_lights && scatter(s, v, &at, &frame);
    if (shadow.light >= 0 && !imp__occluded(scene, &shadow.o, &shadow.d, 0, shadow.reach))
        v->light = shadow.light;
    return continues;
}

/* Keys use full-film pixels: a crop renders the same samples as the whole picture. The
 * border of wide filters may lie outside the film, hence the offset. */
static struct imp_key walk_key(const struct imp_tracer *tracer, int x, int y,
                               int64_t sample)
{
    const struct imp_film_desc *film = &tracer->sensor->film;
    const uint64_t row = (uint64_t)(y + film->crop_y + 0x8000);
    const uint64_t column = (uint64_t)(x + film->crop_x + 0x8000);
    return imp__key(tracer->seed, row << 32 | column, (uint64_t)sample);
}

void imp__walk_position(const struct imp_tracer *tracer, int x, int y, int64_t sample,
                        double *px, double *py)
{
    const struct imp_key key = walk_key(tracer, x, y, sample);
    *px = tracer->sensor->film.crop_x + x + imp__u01(key, IMP_DIM_PIXEL_X);
    *py = tracer->sensor->film.crop_y + y + imp__u01(key, IMP_DIM_PIXEL_Y);
}

void imp__walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk)
{
    const struct imp_sensor *sensor = tracer->sensor;
    const struct imp_key key = walk_key(tracer, x, y, sample);
    *walk = (struct imp_walk){.key = key};
    imp__walk_position(tracer, x, y, sample, &walk->px, &walk->py);
    const double lens[2] = {imp__u01(key, IMP_DIM_LENS_U), imp__u01(key, IMP_DIM_LENS_V)};
    sensor->ops->ray(sensor, walk->px, walk->py, lens, &walk->ray);

    struct step s = {.tracer = tracer,
                     .scene = tracer->scene,
                     .walk = walk,
                     .arena = arena,
                     .o = walk->ray.o,
                     .d = walk->ray.d,
                     .t_min = walk->ray.t_near,
                     .t_max = walk->ray.t_far,
                     .from = walk->ray.o,
                     .beta = {1, 1, 1, 0},
                     .eta = 1};
    struct imp_bending bend; /* large: not touched without need */
    if (imp_unlikely(tracer->scene->n_media > 0)) {
        imp__bend_begin(&bend);
        s.bend = &bend;
    }
    while (step(&s)) s.depth++;

    const imp_spec L = imp__walk_fold(walk);
    if (imp_unlikely(!imp__is_finite(L)))
        walk->dropped = isnan(L[0] + L[1] + L[2]) ? IMP_DROP_NAN : IMP_DROP_INFINITE;
    else if (imp_unlikely(L[0] < 0 || L[1] < 0 || L[2] < 0))
        walk->dropped = IMP_DROP_NEGATIVE;
    walk->L = walk->dropped || !walk->valid ? (imp_spec){0} : L;
}
