/* SPDX-License-Identifier: Apache-2.0
 *
 * How the camera sees a place over curved mirrors and through clear glass (boundary.h). Such a chain is a
 * root: of all rays that leave the eye, and are reflected and bent by the surfaces of the chain in turn,
 * the one that meets the place. It is found as specular manifold sampling does (Zeltner, Georgiev, Jakob
 * 2020): a ray is drawn, which chooses surfaces and whether they reflect, and Newton's method leads from
 * there to a root, or not. The same root is then looked for again, by draws that are independent, until it
 * is found: K draws, whose mean is one over the probability p of finding it, so that of all roots r
 *
 *     E[K f(r)] = sum over r of p(r) f(r)/p(r).
 *
 * A ray depends on the two numbers of its direction at the eye (or, of parallel rays, of where it begins),
 * and so do its place and direction behind each surface: with q' where it meets one of normal n, and
 * n' = q'/R on a ball of radius R,
 *
 *     q' = o' + t w' - w n.(o' + t w')/(n.w),   w_o' as moved_mirror.h has it.
 *
 * These are Newton's matrix, and the film's area over the area across the rays at the place p is that over
 * the solid angle at the eye, times 1/|det dp/dw|. The line that touches a ball B on the way is a root of
 * two other numbers: the distance of the ray from its centre, less the radius, and that of the point there
 * from a plane through the centre, which is drawn. Circles of such planes, on a ball of radius R, meet a
 * curve on it (Crofton) as
 *
 *     int F dl = pi R E[sum over crossings of F]. */
#include "base/arguments.h"
#include "base/context.h"
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "kind/shape/shape.h"
#include "math/offset.h"
#include "math/warp.h"
#include "moved_mirror.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* ---- What bends -------------------------------------------------------------------------- */

/* A ball that is a mirror or of glass, or a mesh of glass. */
struct imp__bender {
    int shape;
    int64_t place;
    struct imp_round round; /* of a ball */
    int n_facets;           /* 0: it is a ball */
};

enum imp_status imp__benders_add(struct imp__boundary *b, const struct imp__body *body)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_shape *s = scene->shapes[body->shape];
    const bool mesh = s->geometry == IMP_TRIANGLES;
    struct imp__bender x = {.shape = body->shape, .place = body->place};
    struct imp__bender *more =
        imp__grow(scene->ctx, b->bender, &b->cap_benders, b->n_benders + 1, sizeof *more);
    if (!more) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for mirrors");
    if (mesh) x.n_facets = (int)s->triangles.n_triangles;
    if (!mesh && !imp__moves_sphere(scene, body->shape, body->place, &x.round))
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: shape '%s' is a mirror, or bends "
                          "light, and no sphere where its instance has it",
                          s->name);
    b->bender = more;
    b->bender[b->n_benders++] = x;
    if (mesh) return IMP_OK;
    b->bender[b->n_benders - 1] = b->bender[b->n_balls]; /* balls come first */
    b->bender[b->n_balls++] = x;
    return IMP_OK;
}

/* A direction from p towards a ball, by the cosine of the angle at which it is met, which is even: near the limb,
 * which few directions meet, what is seen moves fast. From inside: any. */
static imp_v3 ball_direction(const struct imp__bender *x, imp_v3 p, const double u[2])
{
    const imp_v3 r = x->round.centre - p;
    const double D = imp__length(r), sine = sqrt(1 - u[0] * u[0]) * x->round.radius / D;
    if (!(x->round.radius < D)) return imp__uniform_sphere(u);
    const struct imp_frame f = imp__frame_from_normal(r * (1 / D));
    return f.s * (sine * cos(IMP_2PI * u[1])) + f.t * (sine * sin(IMP_2PI * u[1])) +
           f.n * sqrt(1 - sine * sine);
}
/* Its density: with w off the middle by the angle a, and c that cosine,  cos(a)/(2 pi (r/D)^2 c). */
static double ball_density(const struct imp__bender *x, imp_v3 p, imp_v3 w)
{
    const imp_v3 r = x->round.centre - p;
    const double d2 = imp__dot(r, r), r2 = imp__sqr(x->round.radius),
                 along = imp__dot(r, w);
    const double square = 1 - (d2 - along * along) / r2;
    if (!(r2 < d2)) return 1 / (4 * IMP_PI);
    if (!(along > 0) || !(square > 0)) return 0;
    return along * sqrt(d2) / (IMP_2PI * r2 * sqrt(square));
}

imp_v3 imp__bent_direction(const struct imp__edge_draw *d, imp_v3 p, const double u[2],
                           double *spread)
{
    const struct imp__boundary *b = d->b;
    const size_t n = b->n_balls;
    imp_v3 w = imp__uniform_sphere(u);
    *spread = 4 * IMP_PI;
    if (imp_likely(n == 0)) return w;
    const double v = imp__u01(d->key, IMP_EDGE_BENT);
    if (v < 0.5) {
        const size_t k = imp_min((size_t)(2 * v * (double)n), n - 1);
        w = ball_direction(&b->bender[k], p, u);
    }
    double density = 0.5 / (4 * IMP_PI);
    for (size_t k = 0; k < n; k++)
        density += 0.5 * ball_density(&b->bender[k], p, w) / (double)n;
    *spread = 1 / density;
    return w;
}

imp_spec imp__edge_refracted(const struct imp__edge_draw *d, const struct imp_hit *hit,
                             const struct imp_surface *at, imp_v3 w, double *ratio)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_bsdf *b = imp__hit_bsdf(scene, hit);
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)];
    const struct imp_frame frame = {at->s, at->t, at->n};
    const struct imp_texcoord place = {.uv = {at->uv[0], at->uv[1]},
                                       .p = at->p,
                                       .shape = shape,
                                       .prim = hit->prim,
                                       .carried = imp__edge_waves(d)};
    const struct imp_dirs dirs = {imp__to_local(&frame, -w), {0}, IMP_GLASS_BENDS, 0};
    imp_spec in[IMP_INPUTS_MAX], f;
    *ratio = 0;
    if (!imp__is_glass(b)) return imp__spec(0);
    imp__evaluate_inputs(b, shape, &place, in);
    imp__bsdf_eval(b, place.carried, in, &dirs, &f);
    const double index = b->ops->index_ratio(b, in, &dirs);
    *ratio = 1 / index;
    return f * (index * index);
}

/* ---- Chains ------------------------------------------------------------------------------ */

struct surface {
    imp_v3 p, n;   /* of a plane a point and its normal; of a ball its centre */
    double radius; /* 0: a plane */
    bool inside;   /* the ray meets the ball from inside */
    double ratio;  /* as imp__bend has it */
    int shape;
    int64_t place;
    imp_v3 q, normal; /* where it is met; the normal there */
};
struct chain {
    int n;
    struct surface at[IMP_SIGHT_MAX];
};
/* A ray and its derivatives by two numbers. */
struct pencil {
    imp_v3 o, w, o_d[2], w_d[2];
};

static struct pencil pencil_begin(const struct imp__edge_draw *d, imp_v3 from)
{
    struct pencil x = {.o = {0}};
    const imp_v3 w = d->b->parallel ? d->eye : from;
    const struct imp_frame f = imp__frame_from_normal(w);
    imp_v3 *by = d->b->parallel ? x.o_d : x.w_d;
    x.o = d->b->parallel ? from : d->eye;
    x.w = w;
    by[0] = f.s;
    by[1] = f.t;
    return x;
}

/* On to a surface of the chain, and beyond it. False: it is not met, or reflects all. */
static bool pencil_pass(struct pencil *x, struct surface *s)
{
    const imp_v3 r = x->o - s->p;
    double t;
    if (s->radius > 0) {
        const double b = imp__dot(r, x->w),
                     square = b * b - (imp__dot(r, r) - imp__sqr(s->radius));
        if (!(square > 0)) return false;
        t = s->inside ? -b + sqrt(square) : -b - sqrt(square);
    } else t = -imp__dot(s->n, r) / imp__dot(s->n, x->w);
    if (!(t > 0)) return false;
    s->q = x->o + x->w * t;
    s->normal = s->radius > 0 ? (s->q - s->p) * (1 / s->radius) : s->n;
    const double along = imp__dot(s->normal, x->w), side = along > 0 ? -1 : 1,
                 c = fabs(along);
    const imp_v3 n = s->normal * side;
    imp_v3 out;
    if (c == 0 || !imp__bend(n, x->w, s->ratio, &out)) return false;
    const double r_i = s->ratio, c_t = r_i == 0 ? -c : sqrt(1 - r_i * r_i * (1 - c * c)),
                 by_n = r_i == 0 ? 2 * c : r_i * c - c_t,
                 by_c = r_i == 0 ? 2 : r_i - r_i * r_i * c / c_t;
    for (int k = 0; k < 2; k++) {
        imp_v3 shift = x->o_d[k] + x->w_d[k] * t;
        shift += x->w * (imp__dot(n, shift) / c);
        const imp_v3 turn = s->radius > 0 ? shift * (side / s->radius) : (imp_v3){0};
        const double c_d = -(imp__dot(turn, x->w) + imp__dot(n, x->w_d[k]));
        x->o_d[k] = shift;
        x->w_d[k] = x->w_d[k] * (r_i == 0 ? 1 : r_i) + turn * by_n + n * (by_c * c_d);
    }
    x->o = s->q;
    x->w = out;
    return true;
}

/* ---- Roots ------------------------------------------------------------------------------- */

/* What the ray is to meet: a place, or, where radius > 0, a ball that it touches, at the plane across
 * `across` through its centre. */
struct goal {
    imp_v3 p, across;
    double radius;
};
struct root {
    imp_v3 from; /* the direction at the eye, or where a parallel ray begins */
    struct chain chain;
    imp_v3 p, w;  /* where the goal is met, along w */
    double det;   /* of dp/dw across w */
    imp_v3 along; /* of lines that touch: the direction of the curve of all these */
};

/* How far the ray of these numbers is from the goal, and the step to it. False: it does not go over the
 * chain, or away from the goal. */
static bool aim(const struct imp__edge_draw *d, const struct goal *goal, struct root *x,
                double *miss, double step[2])
{
    struct pencil ray = pencil_begin(d, x->from);
    double F[2], J[2][2];
    imp_v3 at[2];
    for (int k = 0; k < x->chain.n; k++)
        if (!pencil_pass(&ray, &x->chain.at[k])) return false;
    const imp_v3 to = goal->p - ray.o;
    const double t = imp__dot(to, ray.w);
    if (!(t > 0)) return false;
    const struct imp_frame f = imp__frame_from_normal(ray.w);
    x->w = ray.w;
    x->p = ray.o + ray.w * t;
    for (int k = 0; k < 2; k++) at[k] = ray.o_d[k] + ray.w_d[k] * t;
    x->det = imp__dot(f.s, at[0]) * imp__dot(f.t, at[1]) -
             imp__dot(f.s, at[1]) * imp__dot(f.t, at[0]);
    if (goal->radius > 0) {
        const imp_v3 e = x->p - goal->p;
        const double length = imp__length(e);
        F[0] = length - goal->radius;
        F[1] = imp__dot(e, goal->across);
        for (int k = 0; k < 2; k++) {
            const double t_d = imp__dot(to, ray.w_d[k]) - imp__dot(ray.o_d[k], ray.w);
            at[k] += ray.w * t_d;
            J[0][k] = imp__dot(e, at[k]) / length;
            J[1][k] = imp__dot(goal->across, at[k]);
        }
        x->along = at[1] * J[0][0] - at[0] * J[0][1];
    } else {
        const imp_v3 r = x->p - goal->p;
        F[0] = imp__dot(f.s, r);
        F[1] = imp__dot(f.t, r);
        for (int k = 0; k < 2; k++) {
            J[0][k] = imp__dot(f.s, at[k]);
            J[1][k] = imp__dot(f.t, at[k]);
        }
    }
    const double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    *miss = sqrt(F[0] * F[0] + F[1] * F[1]);
    step[0] = -(J[1][1] * F[0] - J[0][1] * F[1]) / det;
    step[1] = -(J[0][0] * F[1] - J[1][0] * F[0]) / det;
    return isfinite(*miss) && isfinite(step[0]) && isfinite(step[1]);
}

#define STEPS 40 /* of Newton's method */
#define EXACT                                                                            \
    1e-9 /* of the scene's size: so near, one step more is as near as doubles are */
#define WIDEST 0.5  /* a step, in radians, or in parts of the scene's size */
#define LEAST  1e-4 /* of a step that is not made in full */

static imp_v3 stepped(const struct imp__edge_draw *d, imp_v3 from, const double step[2],
                      double part)
{
    const struct imp_frame f = imp__frame_from_normal(d->b->parallel ? d->eye : from);
    const imp_v3 by = f.s * (step[0] * part) + f.t * (step[1] * part);
    return d->b->parallel ? from + by : imp__normalize(from + by);
}

/* Newton's method, by steps that bring the ray nearer. False: it ends nowhere. */
static bool root_find(const struct imp__edge_draw *d, const struct goal *goal,
                      struct root *x)
{
    double miss, step[2];
    if (!aim(d, goal, x, &miss, step)) return false;
    for (int k = 0; k < STEPS; k++) {
        const bool last = miss <= EXACT * d->b->size;
        const double length = sqrt(step[0] * step[0] + step[1] * step[1]),
                     most = WIDEST * (d->b->parallel ? d->b->size : 1);
        double part = length > most ? most / length : 1;
        const imp_v3 from = x->from;
        double next, on[2];
        for (;; part *= 0.5) {
            if (part < LEAST) return false;
            x->from = stepped(d, from, step, part);
            if (aim(d, goal, x, &next, on) && (last || next < miss)) break;
            if (last) return false;
        }
        if (last) return true;
        miss = next;
        step[0] = on[0];
        step[1] = on[1];
    }
    return false;
}

#define SAME 1e-6 /* of the scene's size: places of one root */

static bool is_same(const struct imp__edge_draw *d, const struct root *a,
                    const struct root *b)
{
    if (a->chain.n != b->chain.n) return false;
    for (int k = 0; k < a->chain.n; k++)
        if (imp__length(a->chain.at[k].q - b->chain.at[k].q) > SAME * d->b->size)
            return false;
    return imp__length(a->p - b->p) <= SAME * d->b->size;
}

/* ---- Draws of chains ---------------------------------------------------------------------- */

/* Random numbers of a draw: of the ball, two of the point on it, of planes before it; then for each
 * surface. */
enum { WHICH, POINT_U, POINT_V, PLANES, FIRST = PLANES + 2 + 2 * IMP_SIGHT_MAX };
#define LOBE_LEAST 0.1  /* probability of either lobe */
#define STOP       0.3  /* that a chain ends before what it could go on with */
#define STOP_GLASS 0.05 /* the same within glass */
#define PASSES     256  /* surfaces in all */

/* A random point of a ball, or of a facet. */
static imp_v3 bender_point(const struct imp__edge_draw *d, const struct imp__bender *x,
                           const double u[3])
{
    double b[2];
    if (x->n_facets == 0)
        return x->round.centre + imp__uniform_sphere(&u[1]) * x->round.radius;
    const int prim = imp_min((int)(u[0] * x->n_facets), x->n_facets - 1);
    const struct imp__corners f =
        imp__corners(d->b->tracer->scene, x->shape, prim, x->place);
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
                         struct surface *out)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp_round round;
    double ratio;
    const imp_spec F = imp__edge_reflected(d, hit, at, w),
                   T = imp__edge_refracted(d, hit, at, w, &ratio);
    const double f = imp__max_used(F, d->waves), t = imp__max_used(T, d->waves);
    if (!(f + t > 0)) return false;
    const double chance = !(t > 0)   ? 1
                          : !(f > 0) ? 0
                                     : imp_clamp(f / (f + t), LOBE_LEAST, 1 - LOBE_LEAST);
    const int shape = hit->shape;
    *out = (struct surface){.shape = shape, .place = hit->place};
    /* index of where the ray comes from, over that of where it goes: the eye is on this side */
    out->ratio = u < chance ? 0 : ratio;
    if (imp__moves_sphere(scene, shape, hit->place, &round)) {
        out->p = round.centre;
        out->radius = round.radius;
        out->inside = imp__dot(at->p - round.centre, w) > 0;
    } else {
        out->p = at->p;
        out->n = at->ng;
    }
    return true;
}

/* The chain of surfaces that a ray meets. False: none, or flat mirrors alone. */
static bool chain_draw(const struct imp__edge_draw *d, struct imp_key key, imp_v3 from,
                       struct chain *out)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const int depth = d->b->tracer->integrator->max_depth,
              longest = depth < 0 ? IMP_SIGHT_MAX : imp_min(depth - 1, IMP_SIGHT_MAX);
    const struct pencil ray = pencil_begin(d, from);
    imp_v3 o = ray.o, w = ray.w;
    bool bends = false, glass = false;
    out->n = 0;
    for (unsigned k = 0; k < PASSES; k++) {
        const double u = imp__u01(key, FIRST + 3 * k),
                     v = imp__u01(key, FIRST + 3 * k + 1),
                     stop = imp__u01(key, FIRST + 3 * k + 2);
        struct imp_hit hit;
        struct imp_surface at;
        struct surface s;
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
            (bends && stop < (glass ? STOP_GLASS : STOP)))
            break;
        const imp_v3 n = s.radius > 0 ? imp__normalize(at.p - s.p) : s.n;
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

static bool root_draw(const struct imp__edge_draw *d, unsigned dims,
                      const struct goal *goal, uint64_t number, struct root *x)
{
    const struct imp_key key = imp__key(d->key.state, dims, number);
    return ray_draw(d, key, &x->from) && chain_draw(d, key, x->from, &x->chain) &&
           root_find(d, goal, x);
}

/* ---- What is seen ------------------------------------------------------------------------- */

/* The surface at q, looked at from where its normal n points to. */
static bool surface_met(const struct imp__edge_draw *d, const struct surface *s, imp_v3 n,
                        struct imp_hit *hit, struct imp_surface *at)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const imp_v3 o = imp__offset(s->q, n, n), down = -n;
    const double near = imp__dot(n, o - s->q);
    if (!imp__intersect(scene, &o, &down, 0, 2 * near, hit)) return false;
    if (hit->place != s->place ||
        (hit->shape != s->shape &&
         hit->shape != imp__placed_shape(scene, s->shape, s->place)))
        return false;
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
static bool root_seen(struct imp__edge_draw *d, const struct root *x,
                      struct imp__sight *s)
{
    const struct chain *all = &x->chain;
    s->T = imp__spec(1);
    imp_v3 before = {0}; /* on the surface nearer to the place */
    for (int k = all->n - 1; k >= 0; k--) {
        const struct surface *at = &all->at[k];
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

#define DRAWS_MOST (1u << 22)

/* A root, and one over the probability with which it is found. */
static bool root_reach(struct imp__edge_draw *d, unsigned dims, const struct goal *goal,
                       struct imp__sight *s, struct root *x)
{
    const int max = d->b->tracer->integrator->max_depth;
    *s = (struct imp__sight){.eye = d->eye};
    if (!d->b->tracer->sensor->ops->connect || (max >= 0 && max < 2) ||
        !root_draw(d, dims, goal, 0, x) || !root_seen(d, x, s))
        return false;
    /* More draws than that are needed of roots that are found once in as many; what is lost of these is
     * their chance to have been found at all. */
    for (uint64_t k = 1; k < DRAWS_MOST; k++) {
        struct root again;
        if (!root_draw(d, dims, goal, k, &again) || !is_same(d, x, &again)) continue;
        s->chance = 1 / (double)k;
        return true;
    }
    return false;
}

bool imp__bent_reach(struct imp__edge_draw *d, unsigned dims, imp_v3 p,
                     struct imp__sight *s)
{
    const struct goal goal = {.p = p};
    struct root x;
    return root_reach(d, dims, &goal, s, &x);
}

bool imp__bent_any(struct imp__edge_draw *d, struct imp__sight *s)
{
    struct imp_round round;
    struct root x;
    if (!d->item || d->item->kind != IMP_ITEM_ROUND ||
        !imp__moves_sphere(d->b->tracer->scene, d->item->shape, d->item->place, &round))
        return imp__edge_any(d, d->eye, d->b->parallel) && imp__bent_reach(d, 0, d->p, s);
    const double u[2] = {d->u, imp__u01(d->key, IMP_EDGE_DIR_U)};
    const struct goal goal = {
        .p = round.centre, .across = imp__uniform_sphere(u), .radius = round.radius};
    if (!root_reach(d, 0, &goal, s, &x)) return false;
    d->out = (x.p - round.centre) * (1 / round.radius);
    d->p = x.p;
    d->along = imp__normalize(x.along);
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
    const struct surface s = {.q = d->p, .shape = hit.shape, .place = hit.place};
    *R = imp__spec(0);
    if (surface_met(d, &s, d->out, &hit, &at))
        *R = imp__edge_reflected(d, &hit, &at,
                                 imp__cross(d->along, d->out) - d->out * IMP_GRAZING);
    return imp__dot(m, d->out) > 0 ? -1 : 1;
}
