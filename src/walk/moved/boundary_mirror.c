/* SPDX-License-Identifier: Apache-2.0
 *
 * What draws of the boundary see in flat mirrors (boundary.h): chains of them between a place and the
 * camera, and velocities of images; and of what is seen in any. */
#include "base/context.h"
#include "bent_chain.h"
#include "kind/cleared.h"
#include "moved_mirror.h"
#include "walk/lights/light_step.h"

#define SAME 1e-6 /* of the scene's size: what is nearer is in the plane */

/* ---- Lines ------------------------------------------------------------------------- */

imp_spec imp__edge_reflected(const struct imp__edge_draw *d, const struct imp_hit *hit,
                             const struct imp_surface *at, imp_v3 w)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_bsdf *b = imp__hit_bsdf(scene, hit);
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)];
    const struct imp_frame frame = {at->s, at->t, at->n};
    const imp_v3 back = imp__to_local(&frame, -w);
    const struct imp_texcoord place = {.uv = {at->uv[0], at->uv[1]},
                                       .p = at->p,
                                       .shape = shape,
                                       .prim = hit->prim,
                                       .carried = imp__edge_waves(d)};
    imp_spec in[IMP_INPUTS_MAX], f, sum = {0};
    imp__evaluate_inputs(b, shape, &place, in);
    const uint64_t bends = imp__is_glass(b) ? UINT64_C(1) << IMP_GLASS_BENDS : 0;
    for (uint64_t left = imp__mirror_lobes(b) & ~bends; left; left &= left - 1) {
        const struct imp_dirs dirs = {imp__v3(-back[0], -back[1], back[2]), back,
                                      __builtin_ctzll(left), 0};
        imp__bsdf_eval(b, place.carried, in, &dirs, &f);
        sum += f;
    }
    return sum;
}

bool imp__mirror_add(struct imp__edge_draw *d, struct imp__mirrors *all,
                     const struct imp_hit *hit, const struct imp_surface *at)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp__mirror *m = imp__arena_take(d->arena, 1, sizeof *m);
    if (!m) {
        d->no_memory = true;
        return false;
    }
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)];
    const struct imp_located located = imp__located_hit(scene, shape, hit, at);
    *m = (struct imp__mirror){.on = NULL, .at = *at};
    m->x = imp__glued_at(scene, hit->shape, &located, hit->place, d->time, at->ng);
    if (all->last) all->last->on = m;
    else all->first = m;
    all->last = m;
    all->n++;
    return true;
}

imp_v3 imp__mirrors_bar(const struct imp__mirrors *all, imp_v3 *p, imp_v3 bar,
                        struct imp__flux_end *end, int *n_ends)
{
    for (const struct imp__mirror *m = all->first; m; m = m->on) {
        struct imp__flux_end *e = &end[(*n_ends)++];
        *e = imp__flux_glued(&m->x, (imp_v3){0});
        /* p is the image of y. */
        const imp_v3 y = imp__mirror_image(m->x.p, m->x.n, *p);
        bar = imp__mirror_image_bar(m->x.p, m->x.n, y, bar, &e->bar);
        *p = y;
    }
    return bar;
}

/* From what is to the ray behind the first mirror, at the place out.p. */
static struct imp__seen seen_through(const struct imp__mirrors *all, imp_v3 from,
                                     struct imp__seen out, struct imp__flux_end *end,
                                     int *n_ends)
{
    for (const struct imp__mirror *m = all->first; m; m = m->on) {
        /* The ray from q along w is at p = q + t w: p' = q' + t w'. */
        struct imp__link_point x = {.x = m->x, .moved_bar = out.bar};
        const imp_v3 turn = out.turn + out.bar * imp__length(out.p - m->x.p),
                     viewer = m->on ? m->on->x.p : from;
        imp__bend_turn_bar(viewer, turn, m->ratio, &x);
        out.bar = imp__slide_bar(&x, imp__normalize(m->x.p - viewer), NULL);
        out.turn = -x.wo_bar;
        out.p = m->x.p;
        end[*n_ends] = imp__flux_glued(&x.x, (imp_v3){0});
        end[(*n_ends)++].bar = x.bar;
    }
    return out;
}

struct imp__seen imp__mirrors_seen(const struct imp__mirrors *all, imp_v3 from, imp_v3 p,
                                   imp_v3 bar, struct imp__flux_end *end, int *n_ends)
{
    struct imp__seen out = {p, bar, {0}};
    if (imp_unlikely(all->bends)) return seen_through(all, from, out, end, n_ends);
    out.bar = imp__mirrors_bar(all, &out.p, bar, end, n_ends);
    return out;
}

struct imp__seen imp__mirrors_seen_far(const struct imp__mirrors *all, imp_v3 from,
                                       imp_v3 turn, struct imp__flux_end *end,
                                       int *n_ends)
{
    const struct imp__seen begin = {all->first->x.p, {0}, turn};
    return seen_through(all, from, begin, end, n_ends);
}

void imp__seen_camera(const struct imp__edge_draw *d, const struct imp__seen *x,
                      struct imp__flux *f)
{
    const struct imp__glued at = {.p = x->p};
    f->end[f->n_ends++] = imp__flux_camera(d, &at, x->bar);
    if (imp_likely(imp__is_zero(x->turn))) return;
    /* The ray turns by (u(p) - u(o))/t, o another point of it. */
    const struct imp__glued o = {.p = d->b->parallel ? x->p - d->eye : d->eye};
    const double t = imp__length(x->p - o.p);
    f->end[f->n_ends - 1].bar.v += x->turn * (1 / t);
    f->end[f->n_ends] = imp__flux_camera(d, &o, x->turn * (-1 / t));
    f->end[f->n_ends++].eye = x->p;
}

/* ---- To the camera ------------------------------------------------------------------- */

bool imp__sight_draw(const struct imp__edge_draw *d, unsigned dims, struct imp__sight *s)
{
    const struct imp__boundary *b = d->b;
    const size_t n = b->n_planes;
    const unsigned first = IMP_EDGE_MIRROR + dims * 2 * IMP_SIGHT_MAX;
    const int depth = d->b->tracer->integrator->max_depth,
              longest = depth < 0 ? IMP_SIGHT_MAX : imp_min(depth - 1, IMP_SIGHT_MAX);
    *s = (struct imp__sight){.chance = 1, .eye = d->eye};
    if (n == 0 || longest < 1) return false;
    do {
        const double u = imp__u01(d->key, first + 2 * (unsigned)s->n);
        size_t k;
        if (s->n == 0) {
            k = imp_min((size_t)(u * (double)n), n - 1);
            s->chance /= (double)n;
        } else { /* one after the other is not in the same plane */
            k = imp_min((size_t)(u * (double)(n - 1)), n - 2);
            k += &b->plane[k] >= s->plane[s->n - 1];
            s->chance /= (double)(n - 1);
        }
        const struct imp__plane *x = &b->plane[k];
        s->plane[s->n++] = x;
        s->eye = b->parallel ? imp__mirror_turn(x->n, s->eye)
                             : imp__mirror_image(x->p, x->n, s->eye);
        if (n == 1) return true;
        /* k of them have the chance 1/(k (k + 1)), whose inverse grows less than F^2k falls. */
    } while (s->n < longest &&
             imp__u01(d->key, first + 2 * (unsigned)s->n - 1) * (s->n + 1) < s->n);
    s->chance /= s->n < longest ? s->n * (s->n + 1.0) : s->n;
    return true;
}

/* The mirror of a plane at q, where a line along the unit vector w meets it. False: it is not there. */
static bool mirror_met(struct imp__edge_draw *d, const struct imp__plane *x, imp_v3 q,
                       imp_v3 w, struct imp_hit *hit, struct imp_surface *at)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const imp_v3 o = imp__offset(q, x->n, -w);
    const double near = imp__dot(x->n, q - o) / imp__dot(x->n, w);
    if (!imp__intersect_at(scene, d->time, &o, &w, 0, 2 * near, hit)) return false;
    if (imp__plane_number(d->b, hit) != x - d->b->plane + 1) return false;
    imp__hit_surface(scene, hit, &o, &w, at);
    at->p = q;
    return true;
}

/* Light on the line between two mirrors, or from the last one to the camera. */
static bool leg_add(const struct imp__edge_draw *d, struct imp__sight *s, imp_v3 o,
                    imp_v3 r, double till)
{
    struct imp__line line;
    if (!imp__edge_line(d, o, r, till, &line)) return false;
    s->T *= line.T;
    s->bounces += line.bounces;
    return true;
}

imp_v3 imp__sight_image(const struct imp__sight *s, imp_v3 p)
{
    for (int k = s->n - 1; k >= 0; k--)
        p = imp__mirror_image(s->plane[k]->p, s->plane[k]->n, p);
    return p;
}

bool imp__sight_film(const struct imp__edge_draw *d, struct imp__sight *s, imp_v3 mirror)
{
    struct imp_shadow shadow;
    if (!imp__sensor_connect(d->b->tracer->sensor, &mirror, false, d->lens, &s->to) ||
        !imp__light_on_film(d->b->tracer->sensor, &s->to))
        return false;
    imp__light_shadow_aim(&s->mirrors.last->at, &s->to, &shadow);
    return leg_add(d, s, shadow.o, shadow.d, shadow.reach);
}

/* The film position is that of the mirror next to the camera: a connection of the image itself would be
 * clipped, though only the way to that mirror is. path: from there to the place; 0: to a direction. */
static bool film_set(const struct imp__edge_draw *d, struct imp__sight *s, imp_v3 mirror,
                     double path)
{
    const double r = imp__length(mirror - d->eye);
    if (!imp__sight_film(d, s, mirror)) return false;
    if (!d->b->parallel) s->to.weight *= imp__sqr(path > 0 ? r / (r + path) : r);
    s->to.dist = path > 0 ? s->to.dist + path : INFINITY;
    return true;
}

/* far: `at` is a direction. */
static bool sight_go(struct imp__edge_draw *d, struct imp__sight *s, imp_v3 at, bool far)
{
    imp_v3 behind[IMP_SIGHT_MAX + 1];
    double path = 0;
    const imp_v3 w = at;
    s->T = imp__spec(1);
    behind[0] = d->eye;
    for (int k = 0; k < s->n; k++)
        behind[k + 1] =
            d->b->parallel ? imp__mirror_turn(s->plane[k]->n, behind[k])
                           : imp__mirror_image(s->plane[k]->p, s->plane[k]->n, behind[k]);
    if (far) at = behind[s->n];
    for (int k = s->n - 1; k >= 0; k--) {
        const struct imp__plane *x = s->plane[k];
        const bool first = k == s->n - 1, comes = far && first;
        const imp_v3 r = comes            ? -w
                         : d->b->parallel ? -behind[k + 1]
                                          : behind[k + 1] - at;
        const double apart = imp__dot(x->n, x->p - at), till = apart / imp__dot(x->n, r);
        if (!(comes ? till < 0 : till > 0) || fabs(apart) < SAME * d->b->size ||
            !(comes || d->b->parallel || till < 1))
            return false;
        const imp_v3 q = at + r * till, to = imp__normalize(r);
        struct imp_hit hit;
        struct imp_surface there;
        if (!mirror_met(d, x, q, to, &hit, &there)) return false;
        const imp_spec F = imp__edge_reflected(d, &hit, &there, to);
        if (imp__is_zero_used(F, d->waves)) return false;
        if (!first) {
            const imp_v3 o = imp__offset(at, s->plane[k + 1]->n, r),
                         end = imp__offset(q, x->n, -r);
            if (!leg_add(d, s, o, end - o, 1)) return false;
        }
        path += imp__length(q - at);
        s->T *= F;
        s->bounces++;
        if (!imp__mirror_add(d, &s->mirrors, &hit, &there)) return false;
        at = q;
    }
    return film_set(d, s, at, far ? 0 : path);
}

bool imp__sight_reach(struct imp__edge_draw *d, struct imp__sight *s, imp_v3 p)
{
    return sight_go(d, s, p, false);
}

bool imp__sight_reach_far(struct imp__edge_draw *d, struct imp__sight *s, imp_v3 w)
{
    return !d->b->parallel && sight_go(d, s, w, true);
}
