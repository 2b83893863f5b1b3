/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges as the camera sees them (boundary.h). */
#include "bent_chain.h"
#include "kind/cleared.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

static imp_spec look_through(struct imp__edge_draw *d, double px, double py, int before)
{
    const struct imp_tracer *t = d->b->tracer;
    struct imp_sensor_ray ray;
    struct imp_walk walk;
    t->sensor->ops->ray(t->sensor, px, py, d->lens, &ray);
    if (imp_unlikely(d->near > 0)) ray.t_near = d->near;
    imp__edge_walk(d, &ray, before, NULL, &walk);
    return walk.values;
}

imp_spec imp__look_through(struct imp__edge_draw *d, double px, double py)
{
    return look_through(d, px, py, 0);
}

struct imp__flux *imp__jump_add(struct imp__edge_draw *d,
                                const struct imp_sensor_sample *to, imp_spec L, int n)
{
    if (imp__is_zero_used(L, d->waves)) return NULL;
    struct imp__flux *f = imp__flux_add(d, n);
    if (!f) return NULL;
    f->px = to->px;
    f->py = to->py;
    f->L = L;
    return f;
}

static bool is_sky(const struct imp__edge_draw *d)
{
    return d->item && d->item->kind == IMP_ITEM_SKY;
}

/* What is seen past the draw's point, so far apart, on the side that m points to; w: the unit direction
 * of the ray. */
static imp_spec look_beside(struct imp__edge_draw *d, const struct imp_sensor_sample *to,
                            imp_v3 w, imp_v3 m, double apart)
{
    struct imp_sensor_sample at;
    struct imp_walk walk;
    imp_spec R = imp__spec(1);
    const int before = imp__edge_limb(d, m, &R) > 0;
    if (imp_unlikely(before)) m = -m;
    if (imp__edge_face_look(d, to->p, d->b->parallel, m, apart, 0, &walk))
        return walk.values;
    const imp_v3 q = imp__edge_beside(d, w, m, apart);
    if (!imp__sensor_connect(d->b->tracer->sensor, &q, false, d->lens, &at))
        return imp__spec(0);
    return look_through(d, at.px, at.py, before) * R;
}

void imp__film_jump(struct imp__edge_draw *d, const struct imp_sensor_sample *to,
                    imp_spec T)
{
    const imp_v3 w = -to->wo, turned = imp__cross(d->along, w);
    const double sine = imp__length(turned);
    if (!(sine > 0)) return; /* it is seen end on */
    const imp_v3 m = turned * (1 / sine);
    const bool sky = is_sky(d);
    /* Parallel rays may begin next to what they meet. */
    const double apart = IMP_BESIDE * (d->b->parallel ? to->dist + imp__length(d->p)
                                                      : imp__length(d->p - to->p));
    if (!sky) T = imp__edge_near(d, w, to->dist, apart, T);
    d->values = true;
    const imp_spec jump =
        T * (sky ? imp__sky_jump(d, w, m)
                 : look_beside(d, to, w, -m, apart) - look_beside(d, to, w, m, apart));
    struct imp__flux *f =
        imp__jump_add(d, to, jump * (to->weight * sine * d->inv_pdf), 1 + IMP_EDGE_ENDS);
    if (!f) return;
    const struct imp__glued at = {.p = d->p}, eye = {.p = d->eye};
    if (sky) {
        f->end[f->n_ends] = imp__flux_camera(d, &eye, m);
        f->end[f->n_ends++].eye = d->p; /* another point of the ray through the eye */
        if (d->item->glued)
            f->end[f->n_ends++] =
                (struct imp__flux_end){{.p = w}, {.v = m}, false, d->item->sky + 1, {0}};
    } else f->n_ends = imp__edge_ends(d, m, f->end);
    f->end[f->n_ends++] = imp__flux_camera(d, &at, -m);
}

bool imp__edge_is_hidden(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, imp_spec *T)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp__line line;
    struct imp_hit hit;
    if (!d->edge) {
        const bool open = imp__edge_line(d, o, r, 1 - IMP_BESIDE, &line);
        *T = line.T;
        return !open;
    }
    const double length = imp__length(r);
    *T = imp__edge_cleared(d, o, r * (1 / length), length);
    double from = 0;
    while (imp__intersect_at(scene, d->time, &o, &r, from, 1 - IMP_BESIDE, &hit)) {
        bool own = false;
        for (int k = 0; k < d->edge->n_faces && !own; k++)
            own |=
                imp__edge_face_hit(d, &d->edges->face[d->edge->first + (size_t)k], &hit);
        if (!own && !imp__edge_hit_passes(d, &hit, o, r, T)) return true;
        from = hit.t + 0.1 * IMP_BESIDE;
    }
    return false;
}

/* Past the edge's point, as the mirror next to it sees it. */
static imp_spec look_mirrored(struct imp__edge_draw *d, const struct imp__sight *s,
                              imp_v3 m, double apart)
{
    struct imp_walk walk;
    imp_spec R = imp__spec(1);
    const int limb = imp__edge_limb(d, m, &R) > 0;
    imp__look_past(d, &s->mirrors.first->at, limb ? -m : m, apart, s->bounces + limb,
                   &walk);
    return walk.values * R;
}

void imp__draw_mirrored(struct imp__edge_draw *d, bool bent)
{
    const bool meter = d->b->tracer->sensor->shape != NULL;
    struct imp__sight s;
    struct imp__bent_found found;
    imp_spec hidden;
    if (bent ? !imp__bent_any(d, &s, &found)
             : !imp__sight_draw(d, 0, &s) || !imp__edge_any(d, s.eye, d->b->parallel) ||
                   !imp__sight_reach(d, &s, d->p))
        return;
    const struct imp_surface *at = &s.mirrors.first->at;
    const imp_v3 r = d->p - at->p, o = imp__offset(at->p, at->ng, r),
                 w = imp__normalize(r), turned = imp__cross(d->along, w);
    const double far = imp__length(r), apart = IMP_BESIDE * (far + imp__length(d->p)),
                 sine = imp__length(turned);
    if (!(sine > 0) || far < IMP_SHORT_OF * apart || imp__edge_merges(d, r, apart) ||
        imp__edge_is_hidden(d, o, imp__edge_clear(d) - o, &hidden))
        return;
    const imp_v3 m = turned * (1 / sine);
    const imp_spec jump =
        look_mirrored(d, &s, -m, apart) - look_mirrored(d, &s, m, apart);
    if (bent && imp__is_zero_used(jump, d->waves)) return;
    if (bent) s.chance /= imp__bent_draws(d, &found);
    struct imp__flux *f =
        imp__jump_add(d, &s.to, s.T * jump * (s.to.weight * sine * d->inv_pdf / s.chance),
                      2 + IMP_EDGE_ENDS + s.mirrors.n);
    if (!f) return;
    f->n_ends = imp__edge_ends(d, m, f->end);
    const struct imp__seen seen =
        imp__mirrors_seen(&s.mirrors, s.to.p, d->p, -m, f->end, &f->n_ends);
    if (meter) f->end[f->n_ends++] = imp__meter_end(d, &s.to, seen.bar);
    else imp__seen_camera(d, &seen, f);
}

void imp__draw_film(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const struct imp_sensor *sensor = b->tracer->sensor;
    struct imp_sensor_sample to;
    if (!imp__edge_any(d, d->eye, b->parallel) || !sensor->ops->connect ||
        !imp__sensor_connect(sensor, &d->p, false, d->lens, &to) ||
        !imp__light_on_film(sensor, &to))
        return;
    const imp_v3 r = imp__edge_clear(d) - to.p;
    imp_spec T;
    if (imp__edge_merges(d, r, IMP_BESIDE * imp__length(r))) return;
    if (imp__edge_is_hidden(d, to.p, r, &T)) return;
    if (imp_unlikely(imp__edge_fades(d))) T *= imp__edge_unclipped(d, &to);
    imp__film_jump(d, &to, T);
}
