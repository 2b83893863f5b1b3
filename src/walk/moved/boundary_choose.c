/* SPDX-License-Identifier: Apache-2.0
 *
 * Which edge, or which line that touches a sphere, a draw of the boundary looks at (boundary.h). */
#include "boundary_parts.h"
#include "math/warp.h"

static bool point_set(struct imp__edge_draw *d, const struct imp__edge_point *p)
{
    d->edge = p->edge;
    d->p = p->p;
    d->along = imp__normalize(p->edge->b - p->edge->a);
    d->inv_pdf = p->inv_pdf / d->chance;
    d->cell = p->cell;
    return true;
}

bool imp__edge_item_choose(struct imp__edge_draw *d)
{
    int k = 0;
    while (k < d->b->n_items && !(d->u < d->part[k + 1])) k++;
    d->chance = d->part[k + 1] - d->part[k];
    if (!(d->chance > 0)) return false;
    d->u = imp_clamp((d->u - d->part[k]) / d->chance, 0.0, 1 - 0x1p-53);
    if (k == d->b->n_items) return true;
    d->item = &d->b->item[k];
    d->cell = d->choice->n_cells + k;
    return true;
}

/* False: it is a disk. */
static bool is_ball(const struct imp__edge_draw *d, struct imp_round *round)
{
    return imp__moves_sphere(d->b->tracer->scene, d->item->shape, round);
}

/* A point of the rim of a disk. */
static bool rim_set(struct imp__edge_draw *d)
{
    const struct imp__rim_point rim =
        imp__disk_rim(d->b->tracer->scene, d->item->shape, d->u);
    d->p = rim.p;
    d->along = rim.along;
    d->out = rim.out;
    d->inv_pdf = rim.rate / d->chance;
    return true;
}

/* The circle on which lines from there touch the sphere, or the rim of a disk. */
static bool ball_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp_round round;
    if (!is_ball(d, &round)) return rim_set(d);
    const imp_v3 way = parallel ? from : round.centre - from;
    const double D = imp__length(way), sine = parallel ? 0 : round.radius / D;
    if (!(sine < 1)) return false;
    const struct imp_frame f = imp__frame_from_normal(way * (1 / D));
    const double psi = IMP_2PI * d->u, cosine = sqrt(1 - sine * sine);
    const imp_v3 across = f.s * cos(psi) + f.t * sin(psi);
    d->out = across * cosine - f.n * sine;
    d->p = round.centre + d->out * round.radius;
    d->along = f.t * cos(psi) - f.s * sin(psi);
    d->inv_pdf = IMP_2PI * round.radius * cosine / d->chance;
    return true;
}

bool imp__edge_any(struct imp__edge_draw *d, imp_v3 from)
{
    struct imp__edge_point p;
    if (d->item) return ball_silhouette(d, from, false);
    imp__edge_choice_draw(d->choice, d->u, &p);
    return point_set(d, &p);
}

bool imp__edge_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp__edge_point p;
    if (d->item) return ball_silhouette(d, from, parallel);
    return imp__edge_choice_silhouette(d->choice, from, parallel, d->u, &p) &&
           point_set(d, &p);
}

bool imp__edge_touched(struct imp__edge_draw *d, imp_v3 *w)
{
    struct imp__edge_point p;
    struct imp_round round;
    const double u[2] = {imp__u01(d->key, IMP_EDGE_DIR_U),
                         imp__u01(d->key, IMP_EDGE_DIR_V)};
    *w = imp__uniform_sphere(u);
    if (!d->item) {
        imp__edge_choice_draw(d->choice, d->u, &p);
        return point_set(d, &p);
    }
    const double at[2] = {d->u, u[0]};
    if (!is_ball(d, &round)) return rim_set(d);
    d->touches = true;
    d->out = imp__uniform_sphere(at);
    const struct imp_frame f = imp__frame_from_normal(d->out);
    *w = f.s * cos(IMP_2PI * u[1]) + f.t * sin(IMP_2PI * u[1]);
    d->p = round.centre + d->out * round.radius;
    d->along = imp__cross(d->out, *w);
    d->inv_pdf = 2 * IMP_2PI * IMP_2PI * round.radius / d->chance; /* 4 pi r^2 2 pi/r */
    return true;
}

struct imp__glued imp__edge_carried(const struct imp__edge_draw *d)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    return d->edge ? imp__edge_glued(d->b->edges, scene, d->edge, d->p)
                   : imp__glued_near(scene, d->item->shape, 0, d->p, d->out);
}

imp_v3 imp__edge_clear(const struct imp__edge_draw *d)
{
    if (d->edge || imp__moves_disk(d->b->tracer->scene, d->item->shape)) return d->p;
    return d->p + d->out * (IMP_BESIDE * (d->b->size + imp__length(d->p)));
}
