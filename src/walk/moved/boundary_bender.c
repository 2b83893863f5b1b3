/* SPDX-License-Identifier: Apache-2.0
 *
 * Balls and cylinders that are mirrors, and glass (boundary.h): which there are, directions towards them, and what they let
 * through. */
#include "base/arguments.h"
#include "base/context.h"
#include "bent_chain.h"
#include "math/warp.h"
#include "moved_mirror.h"
#include "walk/core/shaped.h"
#include "walk/core/step.h"

/* The index of a ball of glass, inside over outside; 0: it is a mirror. */
static double ball_index(const struct imp_scene *scene, const struct imp__body *body,
                         const struct imp_round *ball)
{
    const double index = imp__glass_index(scene, body);
    const struct imp__rim_point at = imp__rim(scene, body->shape, body->place, 0, 0);
    const bool outwards = imp__dot(at.n, at.p - ball->centre) > 0;
    return index > 0 && !outwards ? 1 / index : index;
}

/* A ball around a shape. */
static struct imp_round ball_around(const struct imp_scene *scene,
                                    const struct imp__bender *x)
{
    imp_v3 lo = {INFINITY, INFINITY, INFINITY, 0}, hi = -lo;
    for (int k = 0; k < x->n_facets; k++) {
        const struct imp__corners f = imp__corners(scene, x->shape, k, x->place, 0);
        for (int i = 0; i < 3; i++)
            for (int c = 0; c < 3; c++) {
                lo[c] = imp_min(lo[c], f.p[i][c]);
                hi[c] = imp_max(hi[c], f.p[i][c]);
            }
    }
    struct imp_round out = {.centre = (lo + hi) * 0.5,
                            .radius = 0.5 * imp__length(hi - lo)};
    if (x->kind == IMP_BENDER_TUBE) {
        out.centre = x->tube.base + x->tube.axis * (0.5 * x->tube.length);
        out.radius = hypot(0.5 * x->tube.length, x->tube.radius);
    }
    if (x->kind == IMP_BENDER_DISK) {
        const imp_v3 p = imp__rim(scene, x->shape, x->place, 0, 0).p,
                     q = imp__rim(scene, x->shape, x->place, 0, 0.25).p;
        out.centre = (p + imp__rim(scene, x->shape, x->place, 0, 0.5).p) * 0.5;
        /* An oval one is within the sum of two conjugate radii. */
        out.radius = imp__length(p - out.centre) + imp__length(q - out.centre);
    }
    return out;
}

enum imp_status imp__benders_add(struct imp__boundary *b, const struct imp__body *body)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_shape *s = scene->shapes[body->shape];
    struct imp__bender x = {
        .kind = IMP_BENDER_MESH, .shape = body->shape, .place = body->place};
    struct imp__bender *more =
        imp__grow(scene->ctx, b->bender, &b->cap_benders, b->n_benders + 1, sizeof *more);
    if (!more) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for mirrors");
    if (s->geometry == IMP_TRIANGLES) x.n_facets = (int)s->triangles.n_triangles;
    else if (imp__moves_disk(scene, body->shape)) x.kind = IMP_BENDER_DISK;
    else if (imp__moves_sphere(scene, body->shape, body->place, &x.round))
        x.kind = IMP_BENDER_BALL;
    else if (imp__moves_cylinder(scene, body->shape, body->place, &x.tube))
        x.kind = IMP_BENDER_TUBE;
    else
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: shape '%s' is a mirror, or bends "
                          "light, and no sphere or circular cylinder where its instance "
                          "has it",
                          s->name);
    if (x.kind != IMP_BENDER_BALL) x.round = ball_around(scene, &x);
    b->bender = more;
    b->bender[b->n_benders++] = x;
    if (x.kind != IMP_BENDER_BALL) return IMP_OK;
    x.index = ball_index(scene, body, &x.round);
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

#define ANYWHERE 0.1 /* of lines: across the whole scene, over flat mirrors, too */

/* A point of the disk that a ball is across lines, and its density where a line through p meets it. At the limb of a
 * true ball, where what is seen slides fast, as ball_direction:  1/(2 pi R^2 c),  c = sqrt(1 - (r/R)^2).  What is
 * around another shape has no limb: any point. */
static imp_v3 disk_point(const struct imp_round *x, bool limb, const struct imp_frame *f,
                         const double u[2])
{
    const double r = x->radius * sqrt(limb ? 1 - u[0] * u[0] : u[0]);
    return x->centre + f->s * (r * cos(IMP_2PI * u[1])) +
           f->t * (r * sin(IMP_2PI * u[1]));
}
static double disk_density(const struct imp_round *x, bool limb, imp_v3 w, imp_v3 p)
{
    const imp_v3 r = imp__across_axis(w, p - x->centre);
    const double r2 = imp__sqr(x->radius), square = 1 - imp__dot(r, r) / r2;
    if (!(square > 0)) return 0;
    return limb ? 1 / (IMP_2PI * r2 * sqrt(square)) : IMP_INV_PI / r2;
}

imp_v3 imp__bent_line(const struct imp__edge_draw *d, imp_v3 w, const double u[2],
                      double *spread)
{
    const struct imp__boundary *b = d->b;
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_round whole = {.centre = (scene->lo + scene->hi) * 0.5,
                                    .radius = 0.5 * b->size};
    const struct imp_frame f = imp__frame_from_normal(w);
    const size_t n = b->n_benders;
    const double v = imp__u01(d->key, IMP_EDGE_BENT) / (1 - ANYWHERE);
    const size_t drawn = imp_min((size_t)(v * (double)n), n - 1);
    const imp_v3 p = v < 1
                         ? disk_point(&b->bender[drawn].round, drawn < b->n_balls, &f, u)
                         : disk_point(&whole, false, &f, u);
    double density = ANYWHERE * disk_density(&whole, false, w, p);
    for (size_t k = 0; k < n; k++)
        density += (1 - ANYWHERE) *
                   disk_density(&b->bender[k].round, k < b->n_balls, w, p) / (double)n;
    *spread = 1 / density;
    return p + w * (2 * b->size);
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
