/* SPDX-License-Identifier: Apache-2.0
 *
 * Which edge, or which line that touches a sphere, a draw of the boundary looks at (boundary.h). */
#include "boundary_parts.h"
#include "math/warp.h"

/* An edge that moves in time, where it is then. False: no memory. */
static bool timed_set(struct imp__edge_draw *d, int clock)
{
    const struct imp__edge *at = d->edge;
    struct imp__edge *edge = imp__arena_take(d->arena, 1, sizeof *edge);
    struct imp__edges *edges = imp__arena_take(d->arena, 1, sizeof *edges);
    struct imp__edge_face *face =
        imp__arena_take(d->arena, (size_t)at->n_faces, sizeof *face);
    struct imp_map there, back;
    if (!edge || !edges || !face) {
        d->no_memory = true;
        return false;
    }
    imp__clock_map(d->b->tracer->scene, clock, d->time, &there, &back);
    imp__edge_timed(d->b->edges, &there, at, edge, face);
    *edges = (struct imp__edges){
        .n = 1, .edge = edge, .n_faces = (size_t)at->n_faces, .face = face};
    d->edge = edge;
    d->edges = edges;
    d->p = imp__map_point(&there, d->p);
    d->along = imp__normalize(edge->b - edge->a);
    return true;
}

static bool point_set(struct imp__edge_draw *d, const struct imp__edge_point *p)
{
    d->edges = d->b->edges;
    d->edge = p->edge;
    d->p = p->p;
    d->along = imp__normalize(p->edge->b - p->edge->a);
    d->inv_pdf = p->inv_pdf / d->chance;
    d->cell = p->cell;
    if (imp_likely(d->b->edges->n_runs == 1)) return true;
    const int clock =
        imp__place_clock(d->b->tracer->scene, d->b->edges->face[d->edge->first].place);
    return clock < 0 || timed_set(d, clock);
}

bool imp__edge_item_choose(struct imp__edge_draw *d)
{
    int k = 0,
        last = d->b->n_items; /* the first that part[k + 1] is above u, or all edges */
    while (k < last) {
        const int half = k + (last - k) / 2;
        if (d->u < d->part[half + 1]) last = half;
        else k = half + 1;
    }
    d->chance = d->part[k + 1] - d->part[k];
    if (!(d->chance > 0)) return false;
    d->u = imp_clamp((d->u - d->part[k]) / d->chance, 0.0, 1 - 0x1p-53);
    if (k == d->b->n_items) return true;
    d->item = &d->b->item[k];
    d->cell = d->choice->n_cells + k;
    return true;
}

static bool is_ball(const struct imp__edge_draw *d, struct imp_round *round)
{
    return imp__moves_sphere(d->b->tracer->scene, d->item->shape, d->item->place, round);
}
static bool is_tube(const struct imp__edge_draw *d, struct imp__tube *tube)
{
    return imp__moves_cylinder(d->b->tracer->scene, d->item->shape, d->item->place, tube);
}

static bool is_curve(const struct imp__edge_draw *d)
{
    return d->b->tracer->scene->shapes[d->item->shape]->geometry == IMP_CURVES;
}

/* A point of rim k. */
static bool rim_set(struct imp__edge_draw *d, int k)
{
    const struct imp__rim_point rim =
        imp__rim(d->b->tracer->scene, d->item->shape, d->item->place, k, d->u);
    d->rim = true;
    d->p = rim.p;
    d->along = rim.along;
    d->out = rim.out;
    d->inv_pdf = rim.rate / d->chance;
    return true;
}

bool imp__edge_tube_part(struct imp__edge_draw *d, const struct imp__tube *c, bool *wall)
{
    const double all = 2 * IMP_2PI * c->radius + 2 * c->length;
    const double rim = IMP_2PI * c->radius / all, part[3] = {rim, rim, 1 - 2 * rim};
    int k = 0;
    for (; k < 2 && d->u >= part[k]; k++) d->u -= part[k];
    d->u = imp_clamp(d->u / part[k], 0.0, 1 - 0x1p-53);
    d->chance *= part[k];
    *wall = k == 2;
    return *wall || (!d->item->closed[k] && rim_set(d, k));
}

/* The lines on which lines from there touch the cylinder, or a rim. */
static bool tube_silhouette(struct imp__edge_draw *d, const struct imp__tube *c,
                            imp_v3 from, bool parallel)
{
    bool wall;
    if (!imp__edge_tube_part(d, c, &wall)) return false;
    if (!wall) return true;
    imp_v3 way = parallel ? from : c->base - from;
    way -= c->axis * imp__dot(c->axis, way);
    const double D = imp__length(way), sine = parallel ? 0 : c->radius / D;
    if (!(D > 0) || !(sine < 1)) return false;
    const double side = d->u < 0.5 ? -1 : 1, z = 2 * d->u - (d->u < 0.5 ? 0 : 1);
    way *= 1 / D;
    d->out = imp__cross(c->axis, way) * (side * sqrt(1 - sine * sine)) - way * sine;
    d->p = c->base + d->out * c->radius + c->axis * (z * c->length);
    d->along = c->axis;
    d->inv_pdf = 2 * c->length / d->chance;
    return true;
}

/* The circle on which lines from there touch the sphere; of what is no sphere its own edges. */
static bool ball_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp_round round;
    struct imp__tube tube;
    if (is_tube(d, &tube)) return tube_silhouette(d, &tube, from, parallel);
    if (is_curve(d)) return imp__strand_silhouette(d, from, parallel);
    if (!is_ball(d, &round)) return rim_set(d, 0);
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

static bool arc_set(struct imp__edge_draw *d)
{
    imp__arc_point(d->item->arc, d->u, &d->p, &d->along);
    d->rim = true;
    d->inv_pdf = imp__arc_length(d->item->arc) / d->chance;
    return true;
}

bool imp__edge_any(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp__edge_point p;
    if (d->item && d->item->arc) return arc_set(d);
    if (d->item) return ball_silhouette(d, from, parallel);
    imp__edge_choice_draw(d->choice, d->u, &p);
    return point_set(d, &p);
}

bool imp__edge_silhouette(struct imp__edge_draw *d, imp_v3 from, bool parallel)
{
    struct imp__edge_point p;
    if (d->item) return ball_silhouette(d, from, parallel);
    double u = d->u, chance;
    const int run = imp__edge_choice_run(d->choice, &u, &chance),
              clock = d->b->edges->run[run].instance;
    if (imp_unlikely(clock >= 0)) {
        struct imp_map there, back;
        imp__clock_map(d->b->tracer->scene, clock, d->time, &there, &back);
        from = parallel ? imp__map_vector(&back, from) : imp__map_point(&back, from);
    }
    if (!imp__edge_choice_silhouette(d->choice, run, from, parallel, u, &p)) return false;
    p.inv_pdf /= chance;
    return point_set(d, &p);
}

/* A line that touches the cylinder at a place, or the rims, along w. */
static bool tube_touched(struct imp__edge_draw *d, const struct imp__tube *c,
                         const double u[2], imp_v3 *w)
{
    bool wall;
    if (!imp__edge_tube_part(d, c, &wall)) return false;
    if (!wall) return true;
    const struct imp_frame f = imp__frame_from_normal(c->axis);
    const double phi = IMP_2PI * d->u, psi = IMP_2PI * u[1];
    d->touches = true;
    d->out = f.s * cos(phi) + f.t * sin(phi);
    *w = c->axis * cos(psi) + imp__cross(d->out, c->axis) * sin(psi);
    d->p = c->base + d->out * c->radius + c->axis * (u[0] * c->length);
    d->along = imp__cross(d->out, *w);
    d->inv_pdf = IMP_2PI * IMP_2PI * c->length * imp__sqr(sin(psi)) / d->chance;
    return true;
}

bool imp__edge_touched(struct imp__edge_draw *d, imp_v3 *w)
{
    struct imp__edge_point p;
    struct imp_round round;
    struct imp__tube tube;
    const double u[2] = {imp__u01(d->key, IMP_EDGE_DIR_U),
                         imp__u01(d->key, IMP_EDGE_DIR_V)};
    if (!d->item) {
        imp__edge_choice_draw(d->choice, d->u, &p);
        if (!point_set(d, &p)) return false;
        *w = imp__bent_direction(d, d->p, u, &d->spread);
        return true;
    }
    *w = imp__uniform_sphere(u);
    d->spread = 4 * IMP_PI;
    if (d->item->arc) return arc_set(d);
    const double at[2] = {d->u, u[0]};
    if (is_tube(d, &tube)) return tube_touched(d, &tube, u, w);
    if (is_curve(d)) return imp__strand_touched(d, u, w);
    if (!is_ball(d, &round)) return rim_set(d, 0);
    d->touches = true;
    d->out = imp__uniform_sphere(at);
    const struct imp_frame f = imp__frame_from_normal(d->out);
    *w = f.s * cos(IMP_2PI * u[1]) + f.t * sin(IMP_2PI * u[1]);
    d->p = round.centre + d->out * round.radius;
    d->along = imp__cross(d->out, *w);
    d->inv_pdf = 2 * IMP_2PI * IMP_2PI * round.radius / d->chance; /* 4 pi r^2 2 pi/r */
    return true;
}

/* Face k of the edge carries its point. */
static struct imp__glued carried_by(const struct imp__edge_draw *d, int k)
{
    return imp__edge_glued(d->edges, d->b->tracer->scene, d->edge, k, d->time, d->p);
}

int imp__edge_ends(const struct imp__edge_draw *d, imp_v3 m, struct imp__flux_end *end)
{
    imp_v3 bar[2];
    if (d->item && d->item->arc) {
        struct imp__glued x[2];
        imp__arc_bar(d->b->tracer->scene, d->item->arc, d->p, d->along, m, x, bar);
        for (int k = 0; k < 2; k++) end[k] = imp__flux_glued(&x[k], bar[k]);
        return 2;
    }
    if (!d->edge) {
        const struct imp__glued at =
            imp__glued_near(d->b->tracer->scene, d->item->shape, d->prim, d->item->place,
                            d->time, d->p, d->out);
        *end = imp__flux_glued(&at, m);
        return 1;
    }
    const struct imp__glued first = carried_by(d, 0);
    *end = imp__flux_glued(&first, m);
    if (!d->edge->seam) return 1;
    const struct imp__glued second = carried_by(d, 2);
    imp__seam_bar(d->edges, d->edge, m, bar);
    end[0].bar.v = bar[0];
    end[1] = imp__flux_glued(&second, bar[1]);
    return 2;
}

imp_v3 imp__edge_clear(const struct imp__edge_draw *d)
{
    if (d->edge || d->rim) return d->p;
    return d->p + d->out * (IMP_BESIDE * (d->b->size + imp__length(d->p)));
}

bool imp__edge_merges(const struct imp__edge_draw *d, imp_v3 w, double beside)
{
    struct imp__tube c;
    if (d->rim && !d->item->arc && is_curve(d)) return imp__strand_merges(d, w, beside);
    if (!d->rim || d->item->arc || !is_tube(d, &c) || imp__dot(w, d->out) >= 0)
        return false;
    const imp_v3 r = d->p - c.base, n = imp__normalize(r - c.axis * imp__dot(c.axis, r));
    const double cosine = imp__dot(n, imp__normalize(w - c.axis * imp__dot(c.axis, w)));
    return cosine < 0 && 0.5 * c.radius * cosine * cosine < beside;
}
