/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges as the camera sees them (boundary.h). */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* Film velocity of a point at distance 1 whose velocity is W: (x.W, y.W). Of the direction of a
 * ray by film position it is the inverse: differences over a pixel are exact to 1e-9 of a smooth
 * film. */
static void film_slopes(const struct imp_sensor *s, double px, double py,
                        const double *lens, imp_v3 *x, imp_v3 *y)
{
    const double h = 1e-3;
    struct imp_sensor_ray at, lo, hi;
    s->ops->ray(s, px, py, lens, &at);
    s->ops->ray(s, px - h, py, lens, &lo);
    s->ops->ray(s, px + h, py, lens, &hi);
    const imp_v3 a = (hi.d - lo.d) * (0.5 / h);
    s->ops->ray(s, px, py - h, lens, &lo);
    s->ops->ray(s, px, py + h, lens, &hi);
    const imp_v3 b = (hi.d - lo.d) * (0.5 / h);
    const imp_v3 across_b = imp__cross(b, at.d), across_a = imp__cross(at.d, a);
    *x = across_b * (1 / imp__dot(a, across_b));
    *y = across_a * (1 / imp__dot(b, across_a));
}

imp_spec imp__look_through(const struct imp__edge_draw *d, double px, double py)
{
    const struct imp_tracer *t = d->b->tracer;
    struct imp_sensor_ray ray;
    struct imp_walk walk;
    t->sensor->ops->ray(t->sensor, px, py, d->lens, &ray);
    imp__walk_along(t, d->arena, imp__key_branch(d->key, 0, 1), &ray, d->waves, 0, NULL,
                    &walk);
    return walk.values;
}

/* What is seen past the draw's point on the side of the film that `shift` points to, or (sign -1) away
 * from; bar: the same direction in space, of any length. */
static imp_spec look_beside(struct imp__edge_draw *d, const struct imp_sensor_sample *to,
                            imp_v3 bar, double sign, const double shift[2])
{
    const struct imp_sensor *sensor = d->b->tracer->sensor;
    const imp_v3 r = d->p - to->p, m = imp__normalize(bar) * sign;
    const double apart = IMP_BESIDE * imp__length(r);
    const imp_v3 past = d->p + m * apart, q = imp__edge_beside(d, r, m, apart);
    struct imp_sensor_sample at;
    struct imp_walk walk;
    if (imp__edge_face_look(d, to->p, m, apart, 0, &walk)) return walk.values;
    if (!imp__is_zero(q - past) && imp__sensor_connect(sensor, &q, false, d->lens, &at))
        return imp__look_through(d, at.px, at.py);
    return imp__look_through(d, to->px + sign * shift[0], to->py + sign * shift[1]);
}

void imp__film_jump(struct imp__edge_draw *d, const struct imp_sensor_sample *to)
{
    const imp_v3 camera = d->eye;
    const double inverse = 1 / imp__length(d->p - camera);
    imp_v3 x, y;
    film_slopes(d->b->tracer->sensor, to->px, to->py, d->lens, &x, &y);
    x *= inverse;
    y *= inverse;
    const double tangent[2] = {imp__dot(x, d->along), imp__dot(y, d->along)};
    const double normal[2] = {-tangent[1], tangent[0]};
    const double length = sqrt(imp__sqr(normal[0]) + imp__sqr(normal[1]));
    if (!(length > 0)) return; /* it is seen end on */
    const imp_v3 bar = x * normal[0] + y * normal[1];

    /* A pixel is so wide at the distance 1. */
    const double pixel = sqrt(1 / (imp__length(x) * imp__length(y))) * inverse;
    const double beside = IMP_BESIDE / pixel / length;
    const double shift[2] = {normal[0] * beside, normal[1] * beside};
    const imp_spec jump =
        look_beside(d, to, bar, -1, shift) - look_beside(d, to, bar, 1, shift);
    if (imp__is_zero_used(jump, d->waves)) return;
    struct imp__flux *f = imp__flux_add(d, 2);
    if (!f) return;
    f->px = to->px;
    f->py = to->py;
    f->L = jump * d->inv_pdf;
    f->n_ends = 2;
    const bool sky = d->item && d->item->kind == IMP_ITEM_SKY;
    const struct imp__glued at = sky ? (struct imp__glued){.p = d->p}
                                     : imp__edge_carried(d),
                            eye = {.p = camera};
    f->end[0] = sky ? imp__flux_camera(d, &eye, bar) : imp__flux_glued(&at, bar);
    f->end[1] = imp__flux_camera(d, &at, -bar);
    if (sky) f->end[0].eye = d->p; /* another point of the ray through the eye */
}

bool imp__edge_is_hidden(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    if (!d->edge) return imp__occluded_at(scene, 0, &o, &r, 0, 1 - IMP_BESIDE);
    struct imp_hit hit;
    double from = 0;
    while (imp__intersect(scene, &o, &r, from, 1 - IMP_BESIDE, &hit)) {
        bool own = false;
        for (int k = 0; k < d->edge->n_faces; k++)
            own |= imp__edge_face_hit(d, &d->b->edges->face[d->edge->first + (size_t)k],
                                      &hit);
        if (!own) return true;
        from = hit.t + 0.1 * IMP_BESIDE;
    }
    return false;
}

void imp__draw_film(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const struct imp_sensor *sensor = b->tracer->sensor;
    struct imp_sensor_sample to;
    if (!imp__edge_any(d, d->eye) || !sensor->ops->connect ||
        !imp__sensor_connect(sensor, &d->p, false, d->lens, &to) ||
        !imp__light_on_film(sensor, &to))
        return;
    const imp_v3 r = imp__edge_clear(d) - to.p;
    if (imp__edge_merges(d, r, IMP_BESIDE * imp__length(r))) return;
    if (imp__edge_is_hidden(d, to.p, r)) return;
    imp__film_jump(d, &to);
}
