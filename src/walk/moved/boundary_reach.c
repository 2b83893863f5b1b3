/* SPDX-License-Identifier: Apache-2.0
 *
 * From a vertex behind an edge to the sensor: W(x) of boundary.h, by connections from that vertex
 * and from those that a walk by transposed kernels meets on. The vertex slides along the chain from
 * the camera, which is another one for each connection. */
#include "bent_chain.h"
#include "boundary_one_sided.h"
#include "kind/bsdf/transport.h"
#include "kind/cleared.h"
#include "math/warp.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

extern const struct imp_bsdf_ops imp__mask;

/* A vertex of the chain, on the way to the camera. */
struct link {
    struct link *before;         /* nearer to the edge; NULL: none */
    struct imp__mirrors mirrors; /* from there on */
    int n_mirrors;               /* of all links so far */
    struct imp__link_point x;
    const struct imp_bsdf *bsdf;
    struct imp_surface at;
    struct imp_frame frame;
    imp_v3 wi; /* local: where the light comes from */
    double
        cos_i; /* of shading normals: |n.wi| of the geometric one, by which the light counts */
    imp_spec in[IMP_INPUTS_MAX];
    imp_spec extinction; /* of a point of a medium */
};

/* A point of a medium. */
static void link_float(const struct imp__edge_draw *d, struct link *k,
                       const struct imp_medium *m, const struct imp_surface *at, imp_v3 w)
{
    const struct imp_texcoord place = {.p = at->p, .carried = imp__edge_waves(d)};
    k->x = imp__medium_point(at->p);
    k->bsdf = m->scatterer;
    k->at = *at;
    k->frame = (struct imp_frame){{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    k->wi = -w;
    k->cos_i = 1;
    k->extinction = imp__edge_extinction(d, m, at->p);
    imp__evaluate_inputs(k->bsdf, NULL, &place, k->in);
}

/* hit->shape -1: in medium hit->prim. */
static struct link *link_make(struct imp__edge_draw *d, struct link *before,
                              const struct imp__mirrors *mirrors,
                              const struct imp_hit *hit, const struct imp_surface *at,
                              imp_v3 w, bool horizon)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct link *k = imp__arena_take(d->arena, 1, sizeof *k);
    if (!k) {
        d->no_memory = true;
        return NULL;
    }
    /* The chain comes from the camera. */
    if (before && imp_unlikely(before->x.floats))
        imp__float_aim(&d->b->moves->borders, &before->x, at->p);
    k->before = before;
    k->mirrors = *mirrors;
    k->n_mirrors = mirrors->n + (before ? before->n_mirrors : 0);
    if (imp_unlikely(hit->shape < 0)) {
        link_float(d, k, scene->media[hit->prim], at, w);
        return k;
    }
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)];
    const struct imp_texcoord place = {.uv = {at->uv[0], at->uv[1]},
                                       .p = at->p,
                                       .shape = shape,
                                       .prim = hit->prim,
                                       .carried = imp__edge_waves(d)};
    const struct imp_located located = imp__located_hit(scene, shape, hit, at);
    k->x = imp__surface_point(scene, hit->shape, &located, hit->place, d->time, at->ng);
    k->bsdf = imp__shape_bsdf(scene, shape);
    k->at = *at;
    k->frame = (struct imp_frame){at->s, at->t, at->n};
    k->wi = imp__to_local(&k->frame, -w);
    k->cos_i = horizon ? 1 : fabs(imp__dot(at->ng, w));
    imp__evaluate_inputs(k->bsdf, shape, &place, k->in);
    return k;
}

/* The transposed kernel towards wo, local: of a point of a medium per length; f cos_o; with vertex normals f cos_i^s |cos_o/cos_i|,
 * where ^s is of the shading normal (kind/bsdf/transport.h). */
static imp_spec kernel(const struct link *k, imp_v3 wo)
{
    const struct imp_dirs dirs = {wo, k->wi, IMP_SMOOTH, 0};
    imp_spec f;
    if (imp_unlikely(k->x.floats)) {
        k->bsdf->ops->eval(k->bsdf, k->in, &dirs, &f);
        return f * k->extinction;
    }
    if (k->x.x.smooth) {
        const double cos_o = fabs(imp__dot(k->at.ng, imp__to_world(&k->frame, wo)));
        k->bsdf->ops->eval(k->bsdf, k->in, &dirs, &f);
        return k->cos_i > 0 ? f * (cos_o / k->cos_i) : imp__spec(0);
    }
    imp__bsdf_transposed(k->bsdf, k->in, &dirs, &f);
    return f;
}

/* All ends of a flux whose chain has `last` next to the camera, which sees it over these mirrors. */
static void ends_set(const struct imp__edge_draw *d, const struct imp__edge_light *light,
                     const struct imp_sensor_sample *to,
                     const struct imp__mirrors *mirrors, struct link *last, int depth,
                     struct imp__flux *f)
{
    struct imp__seen seen = {last->x.x.p, {0}, {0}}; /* by the camera */
    for (int k = 0; k < light->n_ends; k++) f->end[f->n_ends++] = light->end[k];
    for (int k = 0; k < light->n_mirror_ends; k++)
        f->end[f->n_ends++] = light->mirror_end[k];
    imp_v3 shift = light->slide, far;
    /* From the edge to the camera; links lead the other way. */
    for (int j = 0; j <= depth; j++) {
        struct link *k = last, *after = NULL;
        for (int i = j; i < depth; i++) {
            after = k;
            k = k->before;
        }
        struct imp__link_point x = k->x;
        const struct imp__mirrors *between = after ? &after->mirrors : mirrors;
        const imp_v3 from = between->n > 0 ? between->first->x.p
                            : after        ? after->x.x.p
                                           : to->p;
        if (imp_unlikely(x.floats) && !after) {
            const imp_v3 near = to->wo * -imp__edge_clip(d, to);
            imp__float_aim(&d->b->moves->borders, &x, from + near);
        }
        x.moved_bar = shift;
        shift = imp__slide_bar(&x, imp__normalize(x.x.p - from), after ? NULL : &far);
        const struct imp__glued on = imp__link_glued(&x);
        if (!x.open) f->end[f->n_ends++] = imp__flux_glued(&on, x.bar.v);
        if (!after && x.floats && !x.open)
            f->end[f->n_ends++] = imp__flux_camera(d, &on, far);
        if (imp_likely(between->n == 0)) continue;
        const struct imp__seen over = imp__mirrors_seen(
            between, after ? after->x.x.p : to->p, x.x.p, shift, f->end, &f->n_ends);
        shift = over.bar;
        if (!after) seen = over;
    }
    seen.bar = shift;
    if (d->b->tracer->sensor->shape) f->end[f->n_ends++] = imp__meter_end(d, to, shift);
    else imp__seen_camera(d, &seen, f);
}

/* Light for a path with so many vertices from the camera to where the light arrives. False: it would
 * be too long. */
static bool light_at(const struct imp_tracer *t, const struct imp__edge_light *light,
                     int vertices, imp_spec *L)
{
    const int max = t->integrator->max_depth;
    if (light->by_depth) {
        if (vertices > light->n_depths) return false;
        *L = light->by_depth[vertices - 1];
        return true;
    }
    *L = light->light;
    return max < 0 || vertices + light->behind <= max;
}

static void flux_make(struct imp__edge_draw *d, const struct imp__edge_light *light,
                      const struct imp_sensor_sample *to,
                      const struct imp__mirrors *mirrors, struct link *k, int depth,
                      imp_spec L)
{
    struct imp__flux *f = imp__flux_add(d, light->n_ends + light->n_mirror_ends + depth +
                                               4 + k->n_mirrors + mirrors->n);
    if (!f) return;
    f->px = to->px;
    f->py = to->py;
    f->L = L;
    ends_set(d, light, to, mirrors, k, depth, f);
}

/* A line to the camera. */
static bool line_open(const struct imp__edge_draw *d, const struct imp_shadow *shadow,
                      struct imp__line *line)
{
    if (imp_likely(!d->b->one_sided))
        return imp__edge_line(d, shadow->o, shadow->d, shadow->reach, line);
    *line = (struct imp__line){.T = imp__spec(1), .times = 1};
    return imp__one_sided_line(d, shadow->o, shadow->d, shadow->reach);
}

/* To the point that a single ray looks at, and from there to the sensor: radiance times area that leaves
 * k brings  f cos_i/r^2  of its own there. */
static void ray_connect(struct imp__edge_draw *d, const struct imp__edge_light *light,
                        struct link *k, int depth, imp_spec T)
{
    const struct imp_tracer *t = d->b->tracer;
    const struct imp__edge_ray *ray = &d->ray;
    const imp_v3 r = ray->at.p - k->at.p;
    const double distance = imp__length(r);
    const struct imp_sensor_sample to = {
        .p = ray->o, .wo = -ray->d, .px = ray->px, .py = ray->py};
    struct imp_sensor_sample there = {.p = ray->at.p, .dist = distance};
    static const struct imp__mirrors none = {0};
    struct imp_shadow shadow;
    struct imp__line line;
    imp_spec L, f;
    if (!ray->meets || !(distance > 0) || !light_at(t, light, depth + 2, &L)) return;
    there.wo = r * (1 / distance);
    struct link *end = link_make(d, k, &none, &ray->hit, &ray->at, there.wo, false);
    if (!end) return;
    const struct imp_dirs dirs = {imp__to_local(&end->frame, to.wo), end->wi, IMP_SMOOTH,
                                  0};
    end->bsdf->ops->eval(end->bsdf, end->in, &dirs, &f);
    L *= T * f * kernel(k, imp__to_local(&k->frame, there.wo)) *
         (t->sensor->film.width * t->sensor->film.height / imp__sqr(distance));
    if (imp__is_zero_used(L, d->waves)) return;
    there.p = imp__offset(ray->at.p, ray->at.ng, -there.wo);
    imp__light_shadow_aim(&k->at, &there, &shadow);
    if (!line_open(d, &shadow, &line)) return;
    flux_make(d, light, &to, &none, end, depth + 1, L);
}

/* passed: vertices between the links that are mirrors, or where it went straight on. */
static void connect(struct imp__edge_draw *d, const struct imp__edge_light *light,
                    struct link *k, int depth, int passed, imp_spec T)
{
    const struct imp_tracer *t = d->b->tracer;
    struct imp_sensor_sample to;
    struct imp_shadow shadow;
    struct imp__line line;
    imp_spec brings;
    if (imp_unlikely(d->b->rays)) {
        ray_connect(d, light, k, depth, T);
        return;
    }
    if (!t->sensor->ops->connect ||
        !imp__sensor_connect(t->sensor, &k->at.p, false, d->lens, &to) ||
        !imp__light_on_film(t->sensor, &to))
        return;
    if (!light_at(t, light, depth + 1 + passed, &brings)) return;
    imp_spec L = brings * T * kernel(k, imp__to_local(&k->frame, to.wo)) * to.weight;
    if (imp__is_zero_used(L, d->waves)) return;
    imp__light_shadow_aim(&k->at, &to, &shadow);
    if (!line_open(d, &shadow, &line)) return;
    if (imp_unlikely(line.bounces > 0)) {
        if (!light_at(t, light, depth + 1 + passed + line.bounces, &brings)) return;
        L = brings * T * kernel(k, imp__to_local(&k->frame, to.wo)) * to.weight;
    }
    if (imp_unlikely(imp__edge_fades(d))) {
        if (!(to.dist > imp__edge_clip(d, &to))) return;
        L *= line.T * imp__edge_unclipped(d, &to);
    } else {
        L *= line.T;
    }
    static const struct imp__mirrors none = {0};
    flux_make(d, light, &to, &none, k, depth, L);
}

/* The same over mirrors. bent: over curved ones and through glass. */
static void connect_mirrored(struct imp__edge_draw *d,
                             const struct imp__edge_light *light, struct link *k,
                             int depth, int passed, imp_spec T, bool bent)
{
    struct imp__sight s;
    struct imp__bent_found found;
    struct imp__line line;
    imp_spec brings;
    if (!d->b->tracer->sensor->ops->connect ||
        !light_at(d->b->tracer, light, depth + 2 + passed, &brings))
        return;
    const unsigned number = 1 + (unsigned)depth;
    if (bent ? !imp__bent_reach(d, number, k->at.p, &s, &found)
             : !imp__sight_draw(d, number, &s) || !imp__sight_reach(d, &s, k->at.p))
        return;
    const struct imp_surface *mirror = &s.mirrors.first->at;
    const imp_v3 r = mirror->p - k->at.p;
    const imp_spec K = kernel(k, imp__to_local(&k->frame, imp__normalize(r)));
    if (imp__is_zero_used(K * T, d->waves)) return;
    const imp_v3 o = imp__offset(k->at.p, k->at.ng, r),
                 end = imp__offset(mirror->p, mirror->ng, -r);
    if (!imp__edge_line(d, o, end - o, 1, &line) ||
        !light_at(d->b->tracer, light, depth + 1 + passed + line.bounces + s.bounces,
                  &brings))
        return;
    if (bent) s.chance /= imp__bent_draws(d, &found);
    flux_make(d, light, &s.to, &s.mirrors, k, depth,
              brings * T * K * line.T * s.T * (s.to.weight / s.chance));
}

/* With normals of its own a material scatters light into directions from which `sample` does not draw:
 * half of all are drawn by the cosine, on both sides where it lets light through. 0: nowhere. */
static double turned_draw(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                          struct imp_dirs *dirs)
{
    const bool through = b->flags & IMP_BSDF_TRANSMIT, even = u[0] < 0.5;
    const double own = imp_min(even ? 2 * u[0] : 2 * u[0] - 1, 1 - 0x1p-53),
                 by_lobe[3] = {own, u[1], u[2]};
    const bool behind = through ? own < 0.5 : dirs->wi[2] < 0;
    dirs->lobe = IMP_SMOOTH;
    if (even) dirs->wo = imp__cosine_hemisphere(&u[1]);
    if (even && behind) dirs->wo[2] = -dirs->wo[2];
    if (!even && !imp__bsdf_transposed_sample(b, in, by_lobe, dirs)) return 0;
    const bool lit = through || dirs->wo[2] * dirs->wi[2] > 0;
    const imp_v3 up = imp__v3(dirs->wo[0], dirs->wo[1], fabs(dirs->wo[2]));
    return 0.5 * imp__bsdf_transposed_pdf(b, in, dirs) +
           (lit ? imp__cosine_hemisphere_pdf(up) * (through ? 0.25 : 0.5) : 0);
}

/* Where the walk goes on, local, and its density: of Lambertian materials by the cosine on the side
 * it came from, of others as light that arrives is scattered. 0: nowhere. */
static double direction_draw(const struct imp__edge_draw *d, const struct link *k,
                             unsigned dims, imp_v3 *wo)
{
    const double u[3] = {imp__u01(d->key, dims + IMP_EDGE_WALK_U),
                         imp__u01(d->key, dims + IMP_EDGE_WALK_V),
                         imp__u01(d->key, dims + IMP_EDGE_LOBE)};
    const struct imp_bsdf *b = k->bsdf;
    const imp_spec *in = k->in;
    for (; b->ops == &imp__mask; b = b->child[0]) in += b->child_in[0]; /* it scatters */
    if (imp__is_lambertian(b)) {
        *wo = imp__cosine_hemisphere(u);
        const double pdf = imp__cosine_hemisphere_pdf(*wo);
        if (k->wi[2] < 0) (*wo)[2] = -(*wo)[2];
        return pdf;
    }
    struct imp_dirs dirs = {{0}, k->wi, IMP_SMOOTH, 0};
    const double by_lobe[3] = {u[2], u[0], u[1]};
    if (b->flags & IMP_BSDF_TURNED) {
        const double pdf = turned_draw(b, in, by_lobe, &dirs);
        *wo = dirs.wo;
        return pdf;
    }
    if (!imp__bsdf_transposed_sample(b, in, by_lobe, &dirs)) return 0;
    *wo = dirs.wo;
    /* What is reflected was followed to another vertex. */
    return dirs.lobe == IMP_SMOOTH ? imp__bsdf_transposed_pdf(b, in, &dirs) : 0;
}

void imp__edge_reach(struct imp__edge_draw *d, const struct imp_hit *hit,
                     const struct imp_surface *at, const struct imp__edge_light *light)
{
    const struct imp_tracer *t = d->b->tracer;
    static const struct imp__mirrors none = {0};
    struct link *k = link_make(d, NULL, &none, hit, at, light->w, light->horizon);
    if (k) k->x.stays = light->border;
    imp_spec T = imp__spec(1), L;
    int passed = 0;
    for (int depth = 0; k && light_at(t, light, depth + 1 + passed, &L); depth++) {
        connect(d, light, k, depth, passed, T);
        if (imp_unlikely(d->b->n_planes > 0))
            connect_mirrored(d, light, k, depth, passed, T, false);
        if (imp_unlikely(d->b->n_benders > 0))
            connect_mirrored(d, light, k, depth, passed, T, true);
        const unsigned dims = IMP_EDGE_WALK + (unsigned)depth * IMP_EDGE_WALK_DIMS;
        imp_v3 wo, w;
        const double pdf = direction_draw(d, k, dims, &wo);
        if (!(pdf > 0)) return;
        T *= kernel(k, wo) * (1 / pdf);
        const double most = imp__max_used(T, d->waves),
                     survive = depth < 2 ? 1 : imp_min(most, 0.95);
        if (!(imp__u01(d->key, dims + IMP_EDGE_SURVIVE) < survive) || !(most > 0)) return;
        T *= 1 / survive;
        struct imp_hit next;
        struct imp_surface there;
        w = imp__to_world(&k->frame, wo);
        const imp_v3 o = imp__offset(k->at.p, k->at.ng, w);
        struct imp__line line;
        const unsigned number = 1 + (unsigned)depth;
        if (!imp__edge_follow(d, o, w, 0, number, &next, &there, &line)) return;
        T *= line.T * line.times;
        passed += line.bounces;
        k = link_make(d, k, &line.mirrors, &next, &there, line.w, false);
    }
}
