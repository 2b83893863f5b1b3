/* SPDX-License-Identifier: Apache-2.0
 *
 * Media of draws of the boundary (boundary.h): what they let pass on a line, and the borders at which
 * they end within the scene.
 *
 * A border of type null that moves leaves points of the media, and rays, where they are: on the side
 * that its normal n points away from more is of the one medium, by n.(V - x') for each area of it,
 * where x is what sees it along a fixed direction. With D the difference of coefficients, inside less
 * outside, light that passes changes by -D sigma_t L, what is scattered there is
 * D sigma_s p(w, w') L, and what is emitted D(sigma_a Le) (boundary.h). Neither has a pole where the border is seen at a flat angle,
 * as lengths of chords would have; and edges of a border have no part of their own. */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "math/warp.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"
#include "walk/media/media_along.h"
#include "walk/media/tracking.h"

/* ---- Lines ------------------------------------------------------------------------------ */

const struct imp_medium *imp__edge_medium(const struct imp__edge_draw *d, imp_v3 o,
                                          imp_v3 w)
{
    if (imp_likely(!d->b->media)) return d->b->fog;
    return imp__borders_at(&d->b->moves->borders, o, w);
}

imp_spec imp__edge_extinction(const struct imp__edge_draw *d, const struct imp_medium *m,
                              imp_v3 p)
{
    if (!d->b->media) return d->extinction;
    return m ? imp__extinction_in(d->b->tracer->scene, m, p, imp__edge_waves(d))
             : imp__spec(0);
}

imp_spec imp__edge_fading(const struct imp__edge_draw *d, const struct imp_medium *m,
                          imp_v3 o, imp_v3 w, double near, double far)
{
    struct imp__along a = {.depth = {0}};
    if (!m || !m->majorants)
        return imp__attenuation(imp__edge_extinction(d, m, o), imp_max(far - near, 0.0));
    imp__along_add(d->b->tracer->scene, m, o, w, near, far, imp__edge_waves(d), false,
                   &a);
    return imp__attenuation(a.depth, 1);
}

imp_spec imp__edge_cleared(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                           double length)
{
    imp_spec T = imp__spec(1);
    if (imp_likely(!d->b->media))
        return d->b->fog ? imp__attenuation(d->extinction, length) : T;
    struct imp__media_line line = imp__media_line(&d->b->moves->borders, o, w, length);
    struct imp__stretch s;
    while (imp__media_next(&line, &s))
        T *= imp__edge_fading(d, s.medium, o, w, s.near, s.far);
    return line.from < length ? imp__spec(0) : T; /* too many borders */
}

imp_spec imp__edge_uncleared(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                             double length)
{
    if (imp_likely(!d->b->media))
        return d->b->fog ? imp__attenuation(d->extinction, -length) : imp__spec(1);
    imp_spec T = imp__edge_cleared(d, o, w, length);
    for (int c = 0; c < 4; c++) T[c] = T[c] > 0 ? 1 / T[c] : 0;
    return T;
}

imp_spec imp__edge_unclipped(const struct imp__edge_draw *d,
                             const struct imp_sensor_sample *to)
{
    return imp__edge_uncleared(d, to->p, -to->wo, imp__edge_clip(d, to));
}

/* The two sides of a crease scatter with the same random numbers. Where the frames of both have the
 * edge for an axis, the directions that they draw differ by the crease's angle alone. */
static imp_v3 frame_along(const struct imp__edge_draw *d, const struct imp_hit *hit)
{
    const bool turns =
        d->edge && imp__is_lambertian(imp__hit_bsdf(d->b->tracer->scene, hit));
    return turns ? d->along : (imp_v3){0};
}

void imp__edge_walk(struct imp__edge_draw *d, const struct imp_sensor_ray *ray,
                    int before, struct imp_hit *hit, struct imp_walk *walk)
{
    const imp_v3 o = ray->o + ray->d * (hit ? hit->t * (1 - IMP_BESIDE) : ray->t_near);
    imp__walk_along(imp__edge_tracer(d), d->arena, imp__key_branch(d->key, 0, 1), d->time,
                    ray, d->waves, before, hit, hit ? frame_along(d, hit) : (imp_v3){0},
                    imp__edge_medium(d, o, ray->d), walk);
}

/* ---- Borders ---------------------------------------------------------------------------- */

/* What a medium emits per length. NULL: nothing. */
static imp_spec glow_of(const struct imp__edge_draw *d, const struct imp_medium *m)
{
    const struct imp_texcoord at = {.p = d->p, .prim = -1, .carried = imp__edge_waves(d)};
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    if (!m || !m->emits || imp__is_zero(imp__edge_extinction(d, m, d->p)))
        return imp__spec(0);
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    return (c.extinction - c.scattering) * c.emission;
}

bool imp__border_point(struct imp__edge_draw *d, struct imp__border_point *x)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_shape *s = scene->shapes[d->item->shape];
    struct imp_round round;
    struct imp_surface at;
    if (imp__moves_sphere(scene, d->item->shape, 0, &round)) {
        const double u[2] = {d->u, imp__u01(d->key, IMP_EDGE_MEDIUM)};
        d->out = imp__uniform_sphere(u);
        d->p = round.centre + d->out * round.radius;
        d->inv_pdf = 4 * IMP_PI * imp__sqr(round.radius) / d->chance;
        d->prim = 0;
    } else {
        struct imp_hit hit;
        if (!imp__edge_item_point(d, IMP_EDGE_MEDIUM, &hit, &at)) return false;
        d->out = at.ng;
        d->prim = hit.prim;
    }
    x->inside = s->interior;
    x->outside = s->exterior;
    x->more = imp__edge_extinction(d, s->interior, d->p) -
              imp__edge_extinction(d, s->exterior, d->p);
    x->glow = glow_of(d, s->interior) - glow_of(d, s->exterior);
    return true;
}

/* Is anything scattered in this medium, at the point of the draw? */
static bool scatters_there(const struct imp__edge_draw *d, const struct imp_medium *m)
{
    const struct imp_texcoord at = {.p = d->p};
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    return !imp__is_zero(c.scattering);
}

void imp__border_scatter(struct imp__edge_draw *d, const struct imp__border_point *x,
                         struct imp__edge_light light)
{
    const struct imp_surface at = {.p = d->p};
    const struct imp_medium *medium[2] = {x->inside, x->outside};
    light.border = true;
    imp_spec *by_depth =
        light.by_depth
            ? imp__arena_take(d->arena, (size_t)light.n_depths, sizeof *by_depth)
            : NULL;
    if (light.by_depth && !by_depth) {
        d->no_memory = true;
        return;
    }
    for (int k = 0; k < light.n_depths; k++) by_depth[k] = -light.by_depth[k];
    for (int side = 0; side < 2; side++) {
        const struct imp_medium *m = medium[side];
        if (m && scatters_there(d, m)) {
            const struct imp_hit hit = {.shape = -1, .prim = m->index};
            imp__edge_reach(d, &hit, &at, &light);
        }
        light.light = -light.light;
        if (by_depth) light.by_depth = by_depth;
    }
}

/* Does it matter where it is to what passes through it, or is emitted there? */
static bool is_seen(const struct imp__edge_draw *d, const struct imp__border_point *x)
{
    return !imp__is_zero_used(x->more, d->waves) || !imp__is_zero_used(x->glow, d->waves);
}

/* As the camera sees it: what lies beyond, and what is emitted. */
void imp__draw_border_film(struct imp__edge_draw *d)
{
    const struct imp_sensor *sensor = d->b->tracer->sensor;
    struct imp__border_point x;
    struct imp_sensor_sample to;
    struct imp__line line;
    struct imp_walk walk;
    if (!imp__border_point(d, &x) || !sensor->ops->connect || !is_seen(d, &x) ||
        !imp__sensor_connect(sensor, &d->p, false, d->lens, &to) ||
        !imp__light_on_film(sensor, &to) || !(to.dist > imp__edge_clip(d, &to)))
        return;
    const imp_v3 w = -to.wo;
    if (!imp__edge_line(d, to.p, d->p - to.p, 1 - IMP_BESIDE, &line)) return;
    const struct imp_sensor_ray ray = {
        .o = imp__offset(d->p, d->out, w), .d = w, .t_near = 0, .t_far = INFINITY};
    imp__edge_walk(d, &ray, 0, NULL, &walk);
    const bool emits = d->b->tracer->integrator->max_depth != 0;
    const imp_spec L = (walk.values * x.more - (emits ? x.glow : imp__spec(0))) * line.T *
                       imp__edge_unclipped(d, &to);
    struct imp__flux *f = imp__jump_add(d, &to, L * (-to.weight * d->inv_pdf), 2);
    if (!f) return;
    const struct imp__glued at = {.p = d->p};
    f->n_ends = imp__edge_ends(d, d->out, f->end);
    f->end[f->n_ends++] = imp__flux_camera(d, &at, -d->out);
}

/* Between what scatters light and what receives it, a sky of one radiance among that; and what is
 * scattered at the border. */
void imp__draw_border_scatter(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const int max = b->tracer->integrator->max_depth;
    const double u[2] = {imp__u01(d->key, IMP_EDGE_DIR_U),
                         imp__u01(d->key, IMP_EDGE_DIR_V)};
    const imp_v3 w = imp__uniform_sphere(u);
    struct imp__border_point x;
    struct imp_walk walk, none;
    if ((max >= 0 && max < 2) || !imp__border_point(d, &x)) return;
    const struct imp_sensor_ray ray = {
        .o = imp__offset(d->p, d->out, -w), .d = -w, .t_near = 0, .t_far = INFINITY};
    imp__edge_walk(d, &ray, 1, NULL, &walk);
    imp__walk_clear(&none);

    int depths;
    const double times = 4 * IMP_PI * d->inv_pdf;
    struct imp__seen_from from = {.drawn = b->drawn};
    struct imp__edge_light light = {.w = w, .slide = -d->out};
    light.n_ends = imp__edge_ends(d, d->out, light.end);
    imp_spec *jump =
        imp__jumps(d, &walk, &none, imp__spec(times), imp__spec(0), from, &depths);
    if (jump) {
        light.light = jump[0];
        light.by_depth = max >= 0 ? jump : NULL;
        light.n_depths = max >= 0 ? depths : 0;
        imp__border_scatter(d, &x, light);
    }

    struct imp_hit hit;
    struct imp_surface at;
    struct imp__line line;
    const imp_v3 o = imp__offset(d->p, d->out, w);
    if (!is_seen(d, &x) || !imp__edge_follow(d, o, w, 0, 0, &hit, &at, &line)) return;
    from.floats = hit.shape < 0;
    from.farther = hit.t;
    const imp_spec passes = line.T * (times * line.times);
    jump = imp__jumps(d, &walk, &none, -passes * x.more, passes * x.glow, from, &depths);
    if (!jump) return;
    light.light = jump[0];
    light.by_depth = max >= 0 ? jump : NULL;
    light.n_depths = max >= 0 ? depths : 0;
    imp__edge_reach(d, &hit, &at, &light);
}
