/* SPDX-License-Identifier: Apache-2.0
 *
 * Which edge, or which line that touches a sphere, a draw of the boundary looks at (boundary.h). */
#include "boundary_parts.h"
#include "math/warp.h"

static bool point_set(struct imp__edge_draw *d, const struct imp__edge_point *p,
                      double chance)
{
    d->edge = p->edge;
    d->ball = -1;
    d->p = p->p;
    d->along = imp__normalize(p->edge->b - p->edge->a);
    d->inv_pdf = p->inv_pdf / chance;
    d->cell = p->cell;
    return true;
}

/* Which sphere, or n_balls: an edge. d->u is uniform again. *chance: of it. */
static int item_choose(struct imp__edge_draw *d, double *chance)
{
    int k = 0;
    while (k < d->b->n_balls && !(d->u < d->part[k + 1])) k++;
    *chance = d->part[k + 1] - d->part[k];
    if (*chance > 0) d->u = imp_clamp((d->u - d->part[k]) / *chance, 0.0, 1 - 0x1p-53);
    return k;
}

/* False: it is a disk. */
static bool ball_set(struct imp__edge_draw *d, int k, struct imp_round *round)
{
    d->edge = NULL;
    d->ball = d->b->ball[k];
    d->cell = d->choice->n_cells + k;
    return imp__moves_sphere(d->b->tracer->scene, d->ball, round);
}

/* A point of the rim of a disk. */
static bool rim_set(struct imp__edge_draw *d, double chance)
{
    const struct imp__rim_point rim = imp__disk_rim(d->b->tracer->scene, d->ball, d->u);
    d->p = rim.p;
    d->along = rim.along;
    d->out = rim.out;
    d->inv_pdf = rim.rate / chance;
    return true;
}

/* The circle on which lines from there touch the sphere, or the rim of a disk. */
static bool ball_silhouette(struct imp__edge_draw *d, int k, imp_v3 from, bool parallel,
                            double chance)
{
    struct imp_round round;
    if (!ball_set(d, k, &round)) return rim_set(d, chance);
    const imp_v3 way = parallel ? from : round.centre - from;
    const double D = imp__length(way), sine = parallel ? 0 : round.radius / D;
    if (!(sine < 1)) return false;
    const struct imp_frame f = imp__frame_from_normal(way * (1 / D));
    const double psi = IMP_2PI * d->u, cosine = sqrt(1 - sine * sine);
    const imp_v3 across = f.s * cos(psi) + f.t * sin(psi);
    d->out = across * cosine - f.n * sine;
    d->p = round.centre + d->out * round.radius;
    d->along = f.t * cos(psi) - f.s * sin(psi);
    d->inv_pdf = IMP_2PI * round.radius * cosine / chance;
    return true;
}

bool imp__edge_any(struct imp__edge_draw *d, imp_v3 from)
{
    struct imp__edge_point p;
    double chance;
    const int k = item_choose(d, &chance);
    if (!(chance > 0)) return false;
    if (k < d->b->n_balls) return ball_silhouette(d, k, from, false, chance);
    imp__edge_choice_draw(d->choice, d->u, &p);
    return point_set(d, &p, chance);
}

bool imp__edge_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp__edge_point p;
    double chance;
    const int k = item_choose(d, &chance);
    if (!(chance > 0)) return false;
    if (k < d->b->n_balls) return ball_silhouette(d, k, from, parallel, chance);
    return imp__edge_choice_silhouette(d->choice, from, parallel, d->u, &p) &&
           point_set(d, &p, chance);
}

bool imp__edge_touched(struct imp__edge_draw *d, imp_v3 *w)
{
    struct imp__edge_point p;
    struct imp_round round;
    double chance;
    const int k = item_choose(d, &chance);
    const double u[2] = {imp__u01(d->key, IMP_EDGE_DIR_U),
                         imp__u01(d->key, IMP_EDGE_DIR_V)};
    if (!(chance > 0)) return false;
    *w = imp__uniform_sphere(u);
    if (k == d->b->n_balls) {
        imp__edge_choice_draw(d->choice, d->u, &p);
        return point_set(d, &p, chance);
    }
    const double at[2] = {d->u, u[0]};
    if (!ball_set(d, k, &round)) return rim_set(d, chance);
    d->touches = true;
    d->out = imp__uniform_sphere(at);
    const struct imp_frame f = imp__frame_from_normal(d->out);
    *w = f.s * cos(IMP_2PI * u[1]) + f.t * sin(IMP_2PI * u[1]);
    d->p = round.centre + d->out * round.radius;
    d->along = imp__cross(d->out, *w);
    d->inv_pdf = 2 * IMP_2PI * IMP_2PI * round.radius / chance; /* 4 pi r^2 2 pi/r */
    return true;
}

struct imp__glued imp__edge_carried(const struct imp__edge_draw *d)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    return d->edge ? imp__edge_glued(d->b->edges, scene, d->edge, d->p)
                   : imp__glued_near(scene, d->ball, 0, d->p, d->out);
}

imp_v3 imp__edge_clear(const struct imp__edge_draw *d)
{
    if (d->edge || imp__moves_disk(d->b->tracer->scene, d->ball)) return d->p;
    return d->p + d->out * (IMP_BESIDE * (d->b->size + imp__length(d->p)));
}
