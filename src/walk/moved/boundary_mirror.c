/* SPDX-License-Identifier: Apache-2.0
 *
 * What draws of the boundary see in flat mirrors (boundary.h): which planes are mirrors, chains of them
 * between a place and the camera, and velocities of images; and of what is seen in any. */
#include "base/arguments.h"
#include "base/context.h"
#include "bent_chain.h"
#include "kind/cleared.h"
#include "moved_mirror.h"
#include "walk/core/shaped.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* ---- Planes ------------------------------------------------------------------------ */

struct imp__plane {
    int shape; /* as imp_hit has it */
    int64_t place;
    int64_t facet; /* of the shape's first one: where plane_of has it; -1: it is a disk */
    imp_v3 p, n;   /* a point; unit normal */
    double loose;  /* how far from that the normal may be, in radians */
    size_t first, behind; /* planes of the shape */
    double
        index; /* of glass, behind the normal over in front of it; 0: it bends nothing */
};

#define SAME 1e-6 /* of the scene's size: what is nearer is in the plane */
#define ROUND                                                                            \
    1e-6 /* of corners, which are floats or decimals in a file, per coordinate */
#define LOOSE 1e-3 /* of slivers: what they are in is not known better than this */
#define MOST  4096 /* planes of a shape */

static enum imp_status plane_add(struct imp__boundary *b, const struct imp__plane *x)
{
    const struct imp_scene *scene = b->tracer->scene;
    struct imp__plane *more =
        imp__grow(scene->ctx, b->plane, &b->cap_planes, b->n_planes + 1, sizeof *more);
    if (!more) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for mirrors");
    b->plane = more;
    b->plane[b->n_planes++] = *x;
    return IMP_OK;
}

static double most(imp_v3 p)
{
    return imp_max(imp_max(fabs(p[0]), fabs(p[1])), fabs(p[2]));
}

/* Is a triangle with the normal n, known to `loose`, in the plane, as far as corners that are rounded
 * tell? Of slivers beside each other corners alone would tell too little. */
static bool plane_has(const struct imp__plane *x, const imp_v3 p[3], imp_v3 n,
                      double loose)
{
    if (imp__length(imp__cross(x->n, n)) > x->loose + loose) return false;
    if (x->index > 0 && imp__dot(x->n, n) < 0) return false; /* glass is on one side */
    for (int k = 0; k < 3; k++) {
        const imp_v3 r = p[k] - x->p;
        if (fabs(imp__dot(x->n, r)) > ROUND * most(p[k]) + x->loose * imp__length(r))
            return false;
    }
    return true;
}

/* The plane of a triangle among those of its shape, from `first` on: the largest one tells its normal. */
static enum imp_status facet_add(struct imp__boundary *b, size_t first,
                                 struct imp__plane x, const imp_v3 p[3], double side,
                                 int *plane)
{
    const imp_v3 n = imp__cross(p[1] - p[0], p[2] - p[0]) * side;
    double longest = 0, far = 0;
    *plane = -1;
    if (imp__is_zero(n)) return IMP_OK;
    for (int k = 0; k < 3; k++) {
        longest = imp_max(longest, imp__length(p[k] - p[(k + 1) % 3]));
        far = imp_max(far, most(p[k]));
    }
    x.p = p[0];
    x.n = imp__normalize(n);
    const double loose = ROUND * far * longest / imp__length(n);
    x.loose = imp_min(loose, LOOSE);
    size_t k = first;
    while (k < b->n_planes && !plane_has(&b->plane[k], p, x.n, loose)) k++;
    *plane = (int)k;
    if (k == b->n_planes) return plane_add(b, &x);
    if (x.loose < b->plane[k].loose) b->plane[k] = x;
    return IMP_OK;
}

double imp__glass_index(const struct imp_scene *scene, const struct imp__body *body)
{
    const struct imp_hit hit = {.shape = body->shape, .place = body->place};
    const struct imp_bsdf *b = imp__hit_bsdf(scene, &hit);
    const struct imp_dirs dirs = {{0, 0, 1, 0}, {0}, IMP_GLASS_BENDS, 0};
    const struct imp_texcoord nowhere = {.prim = 0};
    imp_spec in[IMP_INPUTS_MAX];
    if (!imp__is_glass(b)) return 0;
    imp__inputs_eval(b->input, b->n_in, &nowhere, in);
    return b->ops->index_ratio(b, in, &dirs);
}

/* Where normals of hits point, 1: as the order of corners tells. */
static double side_of(const struct imp_scene *scene, const struct imp__body *body, int n)
{
    struct imp_hit hit = {.shape = body->shape, .place = body->place};
    for (; hit.prim < n; hit.prim++) {
        const imp_v3 unused = {0};
        const struct imp__corners f =
            imp__corners(scene, body->shape, hit.prim, body->place);
        struct imp_surface at;
        imp__hit_surface(scene, &hit, &unused, &unused, &at);
        const double side = imp__dot(at.ng, imp__cross(f.p[1] - f.p[0], f.p[2] - f.p[0]));
        if (side != 0) return side > 0 ? 1 : -1;
    }
    return 1;
}

/* Planes from `first` on are all that a shape has. */
static void planes_end(struct imp__boundary *b, size_t first)
{
    for (size_t k = first; k < b->n_planes; k++) {
        b->plane[k].first = first;
        b->plane[k].behind = b->n_planes;
    }
}

static enum imp_status facets_add(struct imp__boundary *b, const struct imp__body *body)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_shape *s = scene->shapes[body->shape];
    const size_t first = b->n_planes, n = s->triangles.n_triangles;
    int *more =
        imp__grow(scene->ctx, b->plane_of, &b->cap_facets, b->n_facets + n, sizeof *more);
    if (!more) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for mirrors");
    b->plane_of = more;
    const struct imp__plane x = {.shape = body->shape,
                                 .place = body->place,
                                 .facet = (int64_t)b->n_facets,
                                 .index = imp__glass_index(scene, body)};
    const double side = x.index > 0 ? side_of(scene, body, (int)n) : 1;
    for (size_t i = 0; i < n; i++) {
        const struct imp__corners f =
            imp__corners(scene, body->shape, (int)i, body->place);
        IMP_CHECKED(facet_add(b, first, x, f.p, side, &b->plane_of[b->n_facets++]));
        if (b->n_planes - first > MOST)
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: shape '%s' is a mirror of more than "
                "%d facets",
                s->name, MOST);
    }
    return IMP_OK;
}

struct imp__plane_range imp__plane_surface(const struct imp__boundary *b, size_t k,
                                           struct imp__bent_surface *out)
{
    const struct imp__plane *x = &b->plane[k];
    *out = (struct imp__bent_surface){
        .p = x->p, .n = x->n, .plane = (int)k + 1, .shape = x->shape, .place = x->place};
    return (struct imp__plane_range){x->first, x->behind - x->first, x->index};
}

/* Is it a hit of this plane's shape? */
static bool is_of_shape(const struct imp__boundary *b, const struct imp__plane *x,
                        const struct imp_hit *hit)
{
    return hit->place == x->place &&
           (hit->shape == x->shape ||
            hit->shape == imp__placed_shape(b->tracer->scene, x->shape, x->place));
}

int imp__plane_number(const struct imp__boundary *b, const struct imp_hit *hit)
{
    size_t k = 0;
    while (k < b->n_planes && !is_of_shape(b, &b->plane[k], hit)) k = b->plane[k].behind;
    if (k == b->n_planes) return 0;
    const int64_t facet = b->plane[k].facet;
    return 1 + (facet < 0 ? (int)k : b->plane_of[facet + hit->prim]);
}

enum imp_status imp__mirrors_find(struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (size_t k = 0; k < b->edges->n_bodies; k++) {
        const struct imp__body *body = &b->edges->body[k];
        const int placed = imp__placed_shape(scene, body->shape, body->place);
        if (!imp__mirror_lobes(imp__shape_bsdf(scene, scene->shapes[placed]))) continue;
        const size_t first = b->n_planes;
        if (scene->shapes[body->shape]->geometry == IMP_TRIANGLES) {
            IMP_CHECKED(facets_add(b, body));
            planes_end(b, first);
            if (imp__is_glass(imp__shape_bsdf(scene, scene->shapes[placed])))
                IMP_CHECKED(imp__benders_add(b, body));
            continue;
        }
        if (!imp__moves_disk(scene, body->shape)) {
            IMP_CHECKED(imp__benders_add(b, body));
            continue;
        }
        const struct imp__rim_point rim = imp__rim(scene, body->shape, body->place, 0, 0);
        const struct imp__plane x = {.shape = body->shape,
                                     .place = body->place,
                                     .facet = -1,
                                     .p = rim.p,
                                     .n = rim.n,
                                     .index = imp__glass_index(scene, body)};
        IMP_CHECKED(plane_add(b, &x));
        planes_end(b, first);
        if (imp__is_glass(imp__shape_bsdf(scene, scene->shapes[placed])))
            IMP_CHECKED(imp__benders_add(b, body));
    }
    return IMP_OK;
}

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
    m->x = imp__glued_at(scene, hit->shape, &located, hit->place, at->ng);
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
    if (!imp__intersect(scene, &o, &w, 0, 2 * near, hit)) return false;
    if (!is_of_shape(d->b, x, hit)) return false;
    if (x->facet >= 0 && d->b->plane_of[x->facet + hit->prim] != x - d->b->plane)
        return false; /* a facet of another plane */
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
