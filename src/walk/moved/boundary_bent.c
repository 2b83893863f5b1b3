/* SPDX-License-Identifier: Apache-2.0
 *
 * How the camera sees a place over curved mirrors and through clear glass (boundary.h). Such a chain is a
 * root: of all rays that leave the eye, and are reflected and bent by the surfaces of the chain in turn,
 * the one that meets the place. It is found as specular manifold sampling does (Zeltner, Georgiev, Jakob
 * 2020): a ray is drawn, which chooses surfaces and whether they reflect, and Newton's method leads from
 * there to a root, or not. The same root is then looked for again, by draws that are independent, until it
 * is found: K draws, whose mean is one over the probability p of finding it, so that of all roots r
 *
 *     E[K f(r)] = sum over r of p(r) f(r)/p(r). */
#include "base/arguments.h"
#include "base/context.h"
#include "bent_chain.h"
#include "kind/cleared.h"
#include "kind/shape/shape.h"
#include "math/offset.h"
#include "math/warp.h"
#include "moved_mirror.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* ---- Draws of chains ---------------------------------------------------------------------- */

/* Random numbers of a draw: of the ball, two of the point on it, of planes before it; then for each
 * surface. */
enum { WHICH, POINT_U, POINT_V, PLANES, FIRST = PLANES + 2 + 2 * IMP_SIGHT_MAX };
#define LOBE_LEAST 0.1  /* probability of either lobe */
#define STOP       0.3  /* that a chain ends before what it could go on with */
#define STOP_OTHER 0.05 /* the same where the place is hardly: within glass, or outside */
#define PASSES     256  /* surfaces in all */

/* A random point of one of these, with random numbers u in [0, 1). */
static imp_v3 bender_point(const struct imp__edge_draw *d, const struct imp__bender *x,
                           const double u[3])
{
    const struct imp_scene *scene = d->b->tracer->scene;
    double b[2];
    if (x->kind == IMP_BENDER_BALL)
        return x->round.centre + imp__uniform_sphere(&u[1]) * x->round.radius;
    if (x->kind == IMP_BENDER_TUBE)
        return imp__rim(scene, x->shape, x->place, 0, u[1]).p +
               x->tube.axis * (x->tube.length * u[2]);
    if (x->kind == IMP_BENDER_DISK) {
        const imp_v3 p = imp__rim(scene, x->shape, x->place, 0, u[1]).p,
                     q = imp__rim(scene, x->shape, x->place, 0, u[1] + 0.5).p;
        return p + (q - p) * (0.5 * (1 - sqrt(u[2])));
    }
    const int prim = imp_min((int)(u[0] * x->n_facets), x->n_facets - 1);
    const struct imp__corners f = imp__corners(scene, x->shape, prim, x->place);
    imp__uniform_triangle(&u[1], b);
    return f.p[0] + (f.p[1] - f.p[0]) * b[0] + (f.p[2] - f.p[0]) * b[1];
}

/* A ray of the eye to a random point of one of these, or of its image in flat mirrors: where the ray is parallel
 * to others, the place where it begins, else its direction. */
static bool ray_draw(const struct imp__edge_draw *d, struct imp_key key, imp_v3 *from)
{
    const struct imp__boundary *b = d->b;
    const size_t n = b->n_benders;
    const double which = imp__u01(key, WHICH) * (double)n;
    const size_t k = imp_min((size_t)which, n - 1);
    const double u[3] = {which - (double)k, imp__u01(key, POINT_U),
                         imp__u01(key, POINT_V)};
    imp_v3 p = bender_point(d, &b->bender[k], u);
    if (b->n_planes > 0 && imp__u01(key, PLANES) < 0.5) {
        struct imp__edge_draw other = *d;
        struct imp__sight s;
        other.key = key;
        if (!imp__sight_draw(&other, 0, &s)) return false;
        p = imp__sight_image(&s, p);
    }
    if (b->parallel) *from = p - d->eye * (2 * b->size);
    else *from = imp__normalize(p - d->eye);
    return true;
}

/* The surface that a ray along w has hit, which reflects or bends it by chance. False: it ends there. */
static bool surface_draw(const struct imp__edge_draw *d, const struct imp_hit *hit,
                         const struct imp_surface *at, imp_v3 w, double u,
                         struct imp__bent_surface *out)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp_round round;
    struct imp__tube tube;
    double ratio;
    const imp_spec F = imp__edge_reflected(d, hit, at, w),
                   T = imp__edge_refracted(d, hit, at, w, &ratio);
    const double f = imp__max_used(F, d->waves), t = imp__max_used(T, d->waves);
    if (!(f + t > 0)) return false;
    const double chance = !(t > 0)   ? 1
                          : !(f > 0) ? 0
                                     : imp_clamp(f / (f + t), LOBE_LEAST, 1 - LOBE_LEAST);
    const int shape = hit->shape;
    *out = (struct imp__bent_surface){.shape = shape, .place = hit->place};
    /* index of where the ray comes from, over that of where it goes: the eye is on this side */
    out->ratio = u < chance ? 0 : ratio;
    if (imp__moves_sphere(scene, shape, hit->place, &round)) {
        out->p = round.centre;
        out->radius = round.radius;
        out->inside = imp__dot(at->p - round.centre, w) > 0;
    } else if (imp__moves_cylinder(scene, shape, hit->place, &tube)) {
        out->p = tube.base;
        out->axis = tube.axis;
        out->radius = tube.radius;
        out->inside = imp__dot(imp__across_axis(tube.axis, at->p - tube.base), w) > 0;
    } else { /* as imp__flat_draw has it: facets of a face are in one plane */
        const int number = imp__plane_number(d->b, hit);
        if (number == 0) return false;
        const double by = out->ratio;
        imp__plane_surface(d->b, (size_t)number - 1, out);
        out->ratio = by;
    }
    return true;
}

/* The chain of surfaces that a ray meets. False: none, or flat mirrors alone. */
static bool chain_draw(const struct imp__edge_draw *d, struct imp_key key, imp_v3 from,
                       bool on_glass, struct imp__bent_chain *out)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const int depth = d->b->tracer->integrator->max_depth,
              longest = depth < 0 ? IMP_SIGHT_MAX : imp_min(depth - 1, IMP_SIGHT_MAX);
    const struct imp__bent_ray ray = imp__bent_begin(d, from);
    imp_v3 o = ray.o, w = ray.w;
    bool bends = false, glass = false;
    out->n = 0;
    for (unsigned k = 0; k < PASSES; k++) {
        const double u = imp__u01(key, FIRST + 3 * k),
                     v = imp__u01(key, FIRST + 3 * k + 1),
                     stop = imp__u01(key, FIRST + 3 * k + 2);
        struct imp_hit hit;
        struct imp_surface at;
        struct imp__bent_surface s;
        if (!imp__intersect(scene, &o, &w, 0, INFINITY, &hit)) break;
        imp__hit_surface(scene, &hit, &o, &w, &at);
        const struct imp_bsdf *b = imp__hit_bsdf(scene, &hit);
        const bool mirrors = imp__mirror_lobes(b) != 0;
        struct imp_sensor_sample to;
        /* In front of the camera's near clip, or of where its rays begin, nothing is met. */
        const bool clipped =
            out->n == 0 &&
            !imp__sensor_connect(d->b->tracer->sensor, &at.p, false, d->lens, &to);
        if (clipped || (b->straight && (!mirrors || u < 0.5))) {
            o = imp__offset(at.p, at.ng, w);
            continue;
        }
        if (!mirrors || out->n == longest || !surface_draw(d, &hit, &at, w, v, &s) ||
            (bends && stop < (glass == on_glass ? STOP : STOP_OTHER)))
            break;
        const imp_v3 n =
            s.radius > 0 ? imp__normalize(imp__across_axis(s.axis, at.p - s.p)) : s.n;
        imp_v3 next;
        if (!imp__bend(n, w, s.ratio, &next)) break;
        if (s.ratio > 0) glass = imp__dot(next, n) < 0;
        out->at[out->n++] = s;
        bends |= s.radius > 0 || s.ratio > 0;
        w = next;
        o = imp__offset(at.p, at.ng, w);
    }
    return bends;
}

/* Do they go over the same shapes in the same way? */
static bool alike(const struct imp__bent_chain *a, const struct imp__bent_chain *b)
{
    bool same = a->n == b->n;
    for (int k = 0; k < a->n && same; k++) {
        const struct imp__bent_surface *x = &a->at[k], *y = &b->at[k];
        same = x->plane == y->plane && x->shape == y->shape && x->place == y->place &&
               x->inside == y->inside && (x->ratio == 0) == (y->ratio == 0);
    }
    return same;
}

/* of: the root is to be this one; NULL: any. */
static bool root_draw(const struct imp__edge_draw *d, struct imp_key key,
                      const struct imp__bent_goal *goal, const struct imp__bent_root *of,
                      struct imp__bent_root *x)
{
    return ray_draw(d, key, &x->from) &&
           chain_draw(d, key, x->from, goal->on_glass, &x->chain) &&
           (of ? alike(&x->chain, &of->chain)
               : !imp__round_chain(d, goal, &x->chain) &&
                     !imp__flat_chain(goal, &x->chain)) &&
           imp__bent_find(d, goal, x) && (!of || imp__bent_same(d, of, x));
}

/* ---- What is seen ------------------------------------------------------------------------- */

/* The surface at q, looked at from where its normal n points to. */
static bool surface_met(const struct imp__edge_draw *d, const struct imp__bent_surface *s,
                        imp_v3 n, struct imp_hit *hit, struct imp_surface *at)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const imp_v3 o = imp__offset(s->q, n, n), down = -n;
    const double near = imp__dot(n, o - s->q);
    if (!imp__intersect(scene, &o, &down, 0, 2 * near, hit)) return false;
    if (hit->place != s->place ||
        (hit->shape != s->shape &&
         hit->shape != imp__placed_shape(scene, s->shape, s->place)))
        return false;
    if (s->plane > 0 && imp__plane_number(d->b, hit) != s->plane)
        return false; /* of another face, which has roots of its own */
    imp__hit_surface(scene, hit, &o, &down, at);
    at->p = s->q;
    return true;
}

static bool leg_open(const struct imp__edge_draw *d, struct imp__sight *s, imp_v3 o,
                     imp_v3 end)
{
    struct imp__line line;
    if (!imp__edge_line(d, o, end - o, 1, &line)) return false;
    s->T *= line.T;
    s->bounces += line.bounces;
    return true;
}

/* From the root's place to the camera: what is on the way. */
static bool root_seen(struct imp__edge_draw *d, const struct imp__bent_root *x,
                      struct imp__sight *s)
{
    const struct imp__bent_chain *all = &x->chain;
    s->T = imp__spec(1);
    imp_v3 before = {0}; /* on the surface nearer to the place */
    for (int k = all->n - 1; k >= 0; k--) {
        const struct imp__bent_surface *at = &all->at[k];
        const imp_v3 next = k > 0 ? all->at[k - 1].q : d->eye,
                     w = k == 0 && d->b->parallel
                             ? -d->eye
                             : imp__normalize(next - at->q); /* to the camera */
        const imp_v3 n = imp__dot(at->normal, w) < 0 ? -at->normal : at->normal;
        struct imp_hit hit;
        struct imp_surface there;
        double ratio;
        if (!surface_met(d, at, n, &hit, &there)) return false;
        /* As the ray from the camera sees it. */
        const imp_spec f =
            at->ratio == 0
                ? imp__edge_reflected(d, &hit, &there, -w)
                : imp__edge_refracted(d, &hit, &there, -w, &ratio) * imp__sqr(at->ratio);
        if (imp__is_zero_used(f, d->waves)) return false;
        if (k < all->n - 1) {
            const imp_v3 to = all->at[k + 1].q - at->q;
            if (!leg_open(d, s, imp__offset(before, all->at[k + 1].normal, -to),
                          imp__offset(at->q, at->normal, to)))
                return false;
        }
        s->T *= f;
        s->bounces++;
        if (!imp__mirror_add(d, &s->mirrors, &hit, &there)) return false;
        s->mirrors.last->ratio = at->ratio;
        s->mirrors.bends = true;
        before = at->q;
    }
    if (!imp__sight_film(d, s, before)) return false;
    if (!d->b->parallel) s->to.weight *= imp__sqr(imp__length(before - d->eye));
    s->to.weight /= fabs(x->det);
    return isfinite(s->to.weight);
}

#define COUNTS 0.1   /* what a root lets through that is always kept */
#define STAGE  16384 /* draws, after which a draw goes on by chance */
enum { KEEP = FIRST + 3 * PASSES, GO_ON, WHICH_WAY };

/* Roots that let little through are kept by chance: over glass that reflects inside there are many, and each
 * is looked for again as often as those that count. */
static double kept_chance(const struct imp__edge_draw *d, const struct imp__sight *s)
{
    return imp_min(imp__max_used(s->T, d->waves) / COUNTS, 1);
}

/* How often a root is looked for over one ball or within flat glass, where all are known; else by trials. */
struct ways {
    double round, flat, trials;
};
static struct ways ways_of(const struct imp__edge_draw *d,
                           const struct imp__bent_goal *goal)
{
    const bool known = !(goal->radius > 0);
    const double round = known && d->b->n_balls > 0 ? 2 : 0,
                 flat = !known || goal->far || d->b->n_planes == 0 ? 0
                        : goal->on_glass                           ? 2
                                                                   : 0.1,
                 all = 1 / (round + flat + 1);
    return (struct ways){round * all, flat * all, all};
}

/* A root, and x->draws where it is known. */
static bool root_any(const struct imp__edge_draw *d, struct imp_key key,
                     struct imp__bent_found *x)
{
    const struct ways way = ways_of(d, &x->goal);
    const double u = imp__u01(key, WHICH_WAY);
    const bool round = u < way.round, flat = !round && u < way.round + way.flat;
    x->draws = 0;
    if (!round && !flat) return root_draw(d, key, &x->goal, NULL, &x->root);
    if (!(round ? imp__round_draw : imp__flat_draw)(d, key, &x->goal, &x->root,
                                                    &x->draws))
        return false;
    x->draws /= round ? way.round : way.flat;
    return true;
}

/* The number of draws until one leads there. Behind a stage it goes on with probability 1/2, and counts twice as
 * much, up to twice the number: there is no bound, the mean is the same, and few roots that are hardly ever
 * found take long. */
double imp__bent_draws(const struct imp__edge_draw *d, const struct imp__bent_found *x)
{
    double sum = 0, times = 1;
    if (x->draws > 0) return x->draws;
    const double chance = ways_of(d, &x->goal).trials;
    for (uint64_t k = 1, end = STAGE;; k++) {
        const struct imp_key key = imp__key(d->key.state, x->dims, k);
        struct imp__bent_root again;
        sum += times;
        if (root_draw(d, key, &x->goal, &x->root, &again)) return sum / chance;
        if (k < end) continue;
        if (imp__u01(key, GO_ON) < 0.5) return sum / chance;
        times *= 2;
        end += end;
    }
}

/* A root, of the goal that is set. */
static bool root_reach(struct imp__edge_draw *d, struct imp__sight *s,
                       struct imp__bent_found *x)
{
    const int max = d->b->tracer->integrator->max_depth;
    const struct imp_key key = imp__key(d->key.state, x->dims, 0);
    *s = (struct imp__sight){.eye = d->eye};
    if (!d->b->tracer->sensor->ops->connect || (max >= 0 && max < 2) ||
        !root_any(d, key, x) || !root_seen(d, &x->root, s))
        return false;
    s->chance = kept_chance(d, s);
    return imp__u01(key, KEEP) < s->chance;
}

bool imp__bent_reach(struct imp__edge_draw *d, unsigned dims, imp_v3 p,
                     struct imp__sight *s, struct imp__bent_found *x)
{
    x->dims = dims;
    x->goal = (struct imp__bent_goal){.p = p};
    return root_reach(d, s, x);
}

bool imp__bent_reach_far(struct imp__edge_draw *d, imp_v3 w, struct imp__sight *s,
                         struct imp__bent_found *x)
{
    x->dims = 0;
    x->goal = (struct imp__bent_goal){.across = w, .far = true};
    return root_reach(d, s, x);
}

/* Is the draw's point one of an edge of glass? */
static bool is_on_glass(const struct imp__edge_draw *d)
{
    struct imp_hit own = {.shape = -1};
    if (d->edge) {
        const struct imp__edge_face *f = &d->b->edges->face[d->edge->first];
        own.shape = f->shape;
        own.place = f->place;
    } else if (d->rim && d->item->shape >= 0) {
        own.shape = d->item->shape;
        own.place = d->item->place;
    }
    return own.shape >= 0 && imp__is_glass(imp__hit_bsdf(d->b->tracer->scene, &own));
}
static bool edge_reach(struct imp__edge_draw *d, struct imp__sight *s,
                       struct imp__bent_found *x)
{
    x->dims = 0;
    x->goal = (struct imp__bent_goal){.p = d->p, .on_glass = is_on_glass(d)};
    return root_reach(d, s, x);
}

/* A place on the wall of a cylinder that is touched by what the camera sees. */
static bool wall_reach(struct imp__edge_draw *d, const struct imp__tube *c,
                       struct imp__sight *s, struct imp__bent_found *x)
{
    const struct imp_frame f = imp__frame_from_normal(c->axis);
    const double v = d->u < 0.5 ? 2 * d->u : 2 * d->u - 1;
    x->dims = 0;
    x->goal = (struct imp__bent_goal){.p = c->base, .axis = c->axis, .radius = c->radius};
    if (d->u < 0.5) {
        x->goal.across = c->axis;
        x->goal.p += c->axis * (v * c->length);
    } else x->goal.across = f.s * cos(IMP_PI * v) + f.t * sin(IMP_PI * v);
    if (!root_reach(d, s, x)) return false;
    const double up = imp__dot(c->axis, x->root.p - c->base);
    if (!(up > 0) || !(up < c->length)) return false;
    d->p = x->root.p;
    d->out = imp__normalize(imp__across_axis(c->axis, d->p - c->base));
    d->along = imp__normalize(x->root.along);
    const double rises = fabs(imp__dot(d->along, c->axis)),
                 turns = sqrt(imp_max(1 - rises * rises, 0.0));
    d->inv_pdf = 2 / ((rises / c->length + turns / (IMP_PI * c->radius)) * d->chance);
    return true;
}

bool imp__bent_any(struct imp__edge_draw *d, struct imp__sight *s,
                   struct imp__bent_found *x)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp_round round;
    struct imp__tube tube;
    const bool curved = d->item && d->item->kind == IMP_ITEM_ROUND;
    if (curved && imp__moves_cylinder(scene, d->item->shape, d->item->place, &tube)) {
        bool wall;
        return imp__edge_tube_part(d, &tube, &wall) &&
               (wall ? wall_reach(d, &tube, s, x) : edge_reach(d, s, x));
    }
    if (!curved || !imp__moves_sphere(scene, d->item->shape, d->item->place, &round))
        return imp__edge_any(d, d->eye, d->b->parallel) && edge_reach(d, s, x);
    const double u[2] = {d->u, imp__u01(d->key, IMP_EDGE_DIR_U)};
    x->dims = 0;
    x->goal = (struct imp__bent_goal){
        .p = round.centre, .across = imp__uniform_sphere(u), .radius = round.radius};
    if (!root_reach(d, s, x)) return false;
    d->out = (x->root.p - round.centre) * (1 / round.radius);
    d->p = x->root.p;
    d->along = imp__normalize(x->root.along);
    d->inv_pdf = IMP_PI * round.radius / d->chance;
    return true;
}

int imp__edge_limb(const struct imp__edge_draw *d, imp_v3 m, imp_spec *R)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    if (imp_likely(!d->b->bends) || d->edge || d->rim || !d->item ||
        d->item->kind != IMP_ITEM_ROUND)
        return 0;
    struct imp_hit hit = {.shape = d->item->shape, .place = d->item->place};
    struct imp_surface at;
    if (!imp__mirror_lobes(imp__hit_bsdf(scene, &hit))) return 0;
    const struct imp__bent_surface s = {
        .q = d->p, .shape = hit.shape, .place = hit.place};
    *R = imp__spec(0);
    if (surface_met(d, &s, d->out, &hit, &at))
        *R = imp__edge_reflected(d, &hit, &at,
                                 imp__cross(d->along, d->out) - d->out * IMP_GRAZING);
    return imp__dot(m, d->out) > 0 ? -1 : 1;
}
