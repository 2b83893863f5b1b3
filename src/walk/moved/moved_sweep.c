/* SPDX-License-Identifier: Apache-2.0
 *
 * The interior derivative of a walk by what moves (moved.h): adjoints of its values from the first
 * vertex to the last, then adjoints of its places from the last to the first. */
#include "moved_sweep.h"
#include "moved_mirror.h"
#include "moved_sky.h"
#include "walk/path/first_segment.h"

/* Emission that the step from v meets, and that is glued to its light where a light sample could
 * have brought it, from behind passes only if these let samples through. */
static void met_read(const struct imp__sweep *s, const struct imp_vertex *v, imp_spec P,
                     int k, struct imp__pieces *piece)
{
    const struct imp_vertex *y = v->next;
    for (k++; s->through && y && imp__goes_straight(y); k++) {
        P *= y->w;
        y = y->next;
    }
    if (!y || !imp__sweep_emitted(y)) return;
    piece->met = P * y->e;
    piece->lit = k;
}

/* Where it is a point of a medium that varies, its place is one to what scatters and glows there: of
 * light that reaches it with P. */
static void place_read(struct imp__sweep *s, int k, const struct imp_vertex *v,
                       imp_spec P)
{
    const struct imp_medium *m = s->tracer->scene->media[v->d.shape];
    const int lanes = s->tracer->scene->lanes;
    struct imp__point_slopes slope;
    if (!imp__point_slopes(m, s->at[k].x.p, v->carried, &slope)) return;
    const imp_spec scattered = P * (v->b + v->w * v->beyond), all = scattered + P * v->e;
    for (int i = 0; i < 3; i++)
        s->at[k].moved_bar[i] = imp__sum_used(
            all * slope.extinction[i] + scattered * slope.albedo[i] + P * slope.glow[i],
            lanes);
}

/* What vertex k is in, or lies behind. */
static void media_read(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    struct imp__link_point *x = &s->at[k];
    imp_spec in[IMP_INPUTS_MAX];
    if (x->floats)
        x->extinction = imp__extinction_at(s->tracer->scene->media[v->d.shape], x->x.p,
                                           v->carried, in);
    else if (!x->sky)
        x->extinction = imp__sweep_before(s, x->x.p, x->x.n,
                                          x->x.p - imp__sweep_begin(s, k), v->carried);
}

/* Does what is seen from this vertex turn with a mirror? */
static bool turns_on(const struct imp__link_point *x, const struct imp_vertex *v)
{
    return imp__is_mirrored(v) || (x->turns && imp__goes_straight(v));
}

/* Places and adjoints of all vertices; their number. */
static int read_walk(struct imp__sweep *s, imp_spec adjoint)
{
    const struct imp_scene *scene = s->tracer->scene;
    imp_spec P = adjoint;
    int n = 0;
    for (const struct imp_vertex *v = s->walk->first; v; v = v->next, n++) {
        const bool sky = v->d.scatterer == IMP_AT_SKY;
        s->piece[n] = (struct imp__pieces){.lit = 0};
        if (n < s->first) {
            P *= v->w;
            continue;
        }
        struct imp__pieces *piece = &s->piece[n];
        if (imp_unlikely(v->d.scatterer == IMP_IN_MEDIUM)) {
            s->at[n] = imp__medium_point(imp__decided_v3(v->d.p));
            imp__float_aim(&s->moves->borders, &s->at[n], imp__sweep_begin(s, n));
        } else {
            s->at[n] = sky ? imp__sky_point(imp__normalize(imp__decided_v3(v->d.p)))
                           : imp__surface_point(scene, v->d.shape, &v->d.located,
                                                v->d.place, s->walk->time, v->ng);
        }
        if (imp_unlikely(s->fog || s->media)) media_read(s, n, v);
        if (imp_unlikely(s->at[n].floats)) place_read(s, n, v, P);
        s->at[n].turns = n > s->first && imp_unlikely(turns_on(&s->at[n - 1], v->prev));
        if (n == s->front) {
            s->seen = P;
            piece->all = P * (v->e + v->b + v->w * v->beyond);
            if (imp_unlikely(imp__goes_straight(v))) s->front++;
        }
        if (v->d.connection == IMP_CONNECTED) piece->light = P * v->b;
        P *= v->w;
        if (!v->d.goes_on || !v->next) continue;
        piece->on = P;
        if (imp_likely(!imp__is_mirrored(v))) met_read(s, v, P, n, piece);
        piece->step = P * v->beyond - piece->met;
    }
    return n;
}

/* Emission that the step from vertex k meets: a light sample could have brought it. */
static void met_bar(struct imp__sweep *s, int k, const struct imp_vertex *v, imp_v3 w,
                    const struct imp__kernel_d *d)
{
    const struct imp_scene *scene = s->tracer->scene;
    const struct imp__pieces *piece = &s->piece[k];
    struct imp__link_point *y = &s->at[piece->lit];
    const struct imp_vertex *lit = v->next;
    for (int i = k + 1; i < piece->lit; i++) lit = lit->next;
    const double bar = imp__sum_used(piece->met, scene->lanes);
    struct imp__kernel_d behind;
    if (imp_unlikely(piece->lit > k + 1)) { /* places of passes are not exact */
        w = imp__link_direction(&s->at[k], y);
        d = imp__sweep_kernel(s, k, v, w, v->d.lobe, &behind) ? &behind : NULL;
    }
    struct imp__kernel_bar met = imp__sweep_kernel_bar(s, k, d, w, piece->met);
    const struct imp_emitter *e = scene->emitters[lit->d.met.emitter];
    met.wi -= imp__sweep_table_bar(s, e, &y->x, -w, bar, lit->carried);
    imp__sweep_lamp_bar(s, k, y, w, &met, e, piece->met, v->on, v->carried);
    if (piece->lit == k + 1) return;
    imp__velocity_bar(s->moves, &y->x, &y->bar, s->theta_bar);
    y->bar = (struct imp__velocity){.area = 0};
}

/* The skies that the step from vertex k along w meets, each a vertex: a light sample could have brought
 * what they send. */
static void skies_met_bar(const struct imp__sweep *s, int k, const struct imp_vertex *v,
                          imp_v3 w, const struct imp__kernel_d *d)
{
    for (const struct imp_vertex *y = v->next; y; y = y->next) {
        if (imp__is_zero(y->e)) continue;
        imp__sweep_sky_bar(s, k, y->d.met.emitter, w, d, s->piece[k].on * y->e,
                           v->carried);
    }
}

/* The step from vertex k to the next one, which slides along it. */
static void step_bar(struct imp__sweep *s, int k, const struct imp_vertex *v)
{
    struct imp__link_point *x = &s->at[k], *next = x + 1;
    const struct imp__pieces *piece = &s->piece[k];
    const imp_v3 w = imp__link_direction(x, next);
    struct imp__kernel_d derived;
    const struct imp__kernel_d *d =
        imp__sweep_kernel(s, k, v, w, v->d.lobe, &derived) ? &derived : NULL;
    const struct imp__kernel_bar on = imp__sweep_kernel_bar(s, k, d, w, piece->step);
    imp__scatter_bar(x, &on);
    imp_v3 turn;
    x->moved_bar += imp__sweep_shift_bar(
        s, piece->step, v->carried, x->x.p, w,
        next->sky ? INFINITY : imp__length(next->x.p - x->x.p), &turn);
    if (next->sky) {
        if (imp_unlikely(s->moves->skies)) skies_met_bar(s, k, v, w, d);
        return;
    }
    next->along += imp__sweep_reach_bar(s, k + 1, piece->step);
    x->moved_bar += imp__slide_bar(next, w, NULL);
    if (!imp__is_zero(piece->met)) met_bar(s, k, v, w, d);
    imp__link_velocity_bar(s->moves, next, s->theta_bar);
}

/* The camera's ray fades on its way to vertex k, and turns with it: light of this adjoint. */
static void seen_fades_bar(struct imp__sweep *s, int k, imp_spec bar)
{
    const struct imp_sensor_ray *ray = &s->walk->ray;
    const imp_v3 begin = imp__sweep_begin(s, k),
                 r = s->at[k].sky ? ray->d : s->at[k].x.p - begin;
    const double length = imp__length(r), before = imp__length(begin - ray->o);
    const imp_v3 w = r * (1 / length);
    imp_v3 turn;
    if (imp_likely(!s->varies)) return;
    const imp_v3 shift = imp__sweep_shift_bar(s, bar, s->walk->first->carried, begin, w,
                                              s->at[k].sky ? INFINITY : length, &turn);
    turn += shift * before;
    imp__camera_velocity_bar(s->moves, ray->o + w, ray->o, shift - turn, s->theta_bar);
    imp__camera_velocity_bar(s->moves, ray->o, ray->o + w, turn, s->theta_bar);
}

/* What the camera's ray meets: its vertices up to `front`. */
static void front_bar(struct imp__sweep *s)
{
    const struct imp_vertex *v = s->walk->first;
    for (int k = 0; k < s->front; k++) v = v ? v->next : NULL;
    if (v && s->at[s->front].sky) {
        imp_spec sent = {0};
        for (const struct imp_vertex *y = v; y; y = y->next) sent += y->e;
        seen_fades_bar(s, s->front, s->seen * sent);
        imp__skies_seen_bar(s->moves, &s->walk->ray, s->seen, s->walk->first->carried,
                            s->theta_bar);
        v = NULL;
    }
    if (v && imp__sweep_emitted(v))
        s->at[s->front].wo_bar += imp__sweep_table_bar(
            s, s->tracer->scene->emitters[v->d.met.emitter], &s->at[s->front].x,
            imp__normalize(s->walk->ray.o - s->at[s->front].x.p),
            imp__sum_used(s->seen * v->e, s->tracer->scene->lanes), v->carried);
    for (int k = v ? s->front : s->front - 1; k >= s->first; k--) {
        /* From the surface before it, which moves along the ray itself, or from the camera. */
        struct imp__link_point *x = &s->at[k];
        const double along = imp__sweep_reach_bar(s, k, s->piece[k].all);
        seen_fades_bar(s, k, s->piece[k].all);
        x->along += along;
        if (imp_unlikely(s->fog && k > s->first))
            x[-1].along +=
                (x->floats ? 1 - x->part : 0) *
                    imp__dot(x->moved_bar, imp__normalize(x->x.p - x[-1].x.p)) -
                along;
        imp__camera_bar(s->moves, s->walk->ray.o, x, s->theta_bar);
    }
}

/* Shapes are all that moves, and the sensor's is not among them. */
static bool shapes_alone(const struct imp_tracer *tracer, const struct imp__moves *moves)
{
    const struct imp_shape *meter = tracer->sensor->shape;
    for (int k = 0; k < moves->n_movers; k++) {
        const int shape = moves->mover[k].shape;
        if (shape < 0 && !imp__is_moved_instance(shape)) return false;
    }
    return !meter || !imp__moves_shape(moves, meter->index, NULL);
}

bool imp__moved_touches(const struct imp_tracer *tracer, const struct imp__moves *moves,
                        const struct imp_walk *walk)
{
    const struct imp_scene *scene = tracer->scene;
    imp_spec extinction;
    /* A point of a medium moves with what lies beyond it, which is no vertex. */
    if (moves->borders.any || imp__fog(tracer, NULL, &extinction) ||
        !shapes_alone(tracer, moves))
        return true;
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        const struct imp_decision *d = &v->d;
        if (v->shape &&
            imp__moves_shape(moves, imp__carrier(scene, d->shape, d->place), NULL))
            return true;
        if (d->connection != IMP_CONNECTED || d->light.emitter < 0) continue;
        const struct imp_shape *lamp = scene->emitters[d->light.emitter]->shape;
        if (lamp && imp__moves_shape(moves, lamp->index, NULL)) return true;
    }
    return false;
}

bool imp__moved_sweep(const struct imp_tracer *tracer, struct imp_arena *arena,
                      const struct imp__moves *moves, const struct imp_walk *walk,
                      imp_spec adjoint, double *theta_bar)
{
    if (walk->dropped || !walk->valid || !walk->first) return true;
    struct imp__sweep s = {.tracer = tracer,
                           .moves = moves,
                           .walk = walk,
                           .theta_bar = theta_bar,
                           .first = walk->first->d.scatterer == IMP_AT_SENSOR,
                           .meter = tracer->sensor->shape != NULL,
                           .through = imp__segment_first(tracer)->through};
    s.front = s.first;
    s.media = moves->borders.any;
    s.varies = s.media && moves->borders.varies;
    s.fog = !s.media && imp__fog(tracer, walk->first->carried, &s.extinction);
    s.at = imp__arena_take(arena, (size_t)walk->n, sizeof *s.at);
    s.piece = imp__arena_take(arena, (size_t)walk->n, sizeof *s.piece);
    if (!s.at || !s.piece) return false;
    int k = read_walk(&s, adjoint) - 1;
    for (const struct imp_vertex *v = walk->last; v; v = v->prev, k--) {
        if (k < s.first || s.at[k].sky) continue;
        if (v->d.connection == IMP_CONNECTED) imp__light_sample_bar(&s, k, v);
        if (!v->d.goes_on || !v->next) continue;
        if (imp_unlikely(imp__goes_straight(v))) imp__pass_bar(&s, k, v);
        else if (imp_unlikely(imp__is_mirrored(v))) imp__mirror_bar(&s, k, v);
        else step_bar(&s, k, v);
    }
    if (walk->n <= s.first) return true;
    if (!s.meter) {
        front_bar(&s);
        return true;
    }
    s.at[1].bar.v += s.at[1].moved_bar;
    imp__velocity_bar(moves, &s.at[1].x, &s.at[1].bar, theta_bar);
    return true;
}
