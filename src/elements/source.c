/* SPDX-License-Identifier: Apache-2.0
 *
 * Where importance comes from. The eye is never an element: its rays are binned into the
 * elements that they hit, a_i,m += weight H_m(to the eye), which is the projected area
 * that the paper speaks of. Measuring patches emit a constant importance (elements.h: s).
 */
#include "elements.h"
#include "kind/cleared.h"
#include <string.h>

/* (u, v) of a point of a root: Newton's method on the bilinear map, exact after one step
 * for triangles and parallelograms. */
void imp__el_locate(const struct imp__el_root *r, imp_v3 p, double *u, double *v)
{
    const imp_v3 a = r->v[0], eu = r->v[1] - a;
    const imp_v3 ev = r->v[r->corners == 3 ? 2 : 3] - a;
    const imp_v3 bend = r->corners == 3 ? imp__v3(0, 0, 0) : r->v[2] - r->v[1] - ev;
    double s = 0.5, t = 0.5;
    for (int k = 0; k < 12; k++) {
        const imp_v3 d = p - (a + eu * s + ev * t + bend * (s * t));
        const imp_v3 du = eu + bend * t, dv = ev + bend * s;
        const double uu = imp__dot(du, du), uv = imp__dot(du, dv), vv = imp__dot(dv, dv);
        const double det = uu * vv - uv * uv;
        if (!(det > 0)) break;
        const double pu = imp__dot(d, du), pv = imp__dot(d, dv);
        const double ds = (pu * vv - pv * uv) / det, dt = (pv * uu - pu * uv) / det;
        s += ds;
        t += dt;
        if (fabs(ds) + fabs(dt) < 1e-13) break;
    }
    *u = imp_clamp(s, 0.0, 0x1.fffffffffffffp-1);
    *v = imp_clamp(t, 0.0, 0x1.fffffffffffffp-1);
}

/* Point and direction of a meter on a shape: Roberts' sequence in four dimensions (2018),
 * whose ratio solves g^5 = g + 1. */
static void meter_ray(const struct imp_sensor *s, double px, double py, int k, int side,
                      struct imp_sensor_ray *ray)
{
    static const double step[4] = {0.8566748838545029, 0.733891856627126,
                                   0.6287067210378087, 0.5385972572236101};
    const double index = (py * s->film.width + px) * side * side + k;
    double u[4];
    for (int i = 0; i < 4; i++) {
        u[i] = 0.5 + index * step[i];
        u[i] -= floor(u[i]);
    }
    imp__sensor_ray(s, px + u[0], py + u[1], &u[2], ray);
}

/* Ray k of a pixel's side x side. A plain grid aliases with what is upright in the
 * picture: an edge along a row takes or loses the whole row, and a lamp that covers 1 %
 * of scene a came out 1.8 % too small. So rows are shifted inside their cells by the
 * golden ratio from column to column, and columns from row to row: along any edge the
 * rays then cut it at evenly spread places (0.03 %). Through a lens they take its middle. */
void imp__el_ray(const struct imp_sensor *s, int x, int y, int k, int side,
                 struct imp_sensor_ray *ray)
{
    const double golden = 0.61803398874989485;
    if (s->shape) {
        meter_ray(s, s->film.crop_x + x, s->film.crop_y + y, k, side, ray);
        return;
    }
    const int column = k % side, row = k / side;
    const double px = s->film.crop_x + x, py = s->film.crop_y + y;
    double u = (py * side + row) * golden + 0.5, v = (px * side + column) * golden + 0.5;
    u -= floor(u);
    v -= floor(v);
    imp__sensor_ray(s, px + (column + u) / side, py + (row + v) / side,
                    (double[2]){0.5, 0.5}, ray);
}

bool imp__el_trace(const imp_elements *e, const struct imp_sensor_ray *ray,
                   struct imp__el_hit *hit)
{
    struct imp_hit at;
    struct imp_surface surface;
    hit->root = EL_NONE;
    hit->w = -ray->d;
    if (!imp__intersect(e->scene, &ray->o, &ray->d, ray->t_near, ray->t_far, &at))
        return false;
    int root = e->prim_root[at.shape][at.prim];
    if (root < 0) return false;
    if (imp__dot(e->roots[root].frame.n, ray->d) > 0) root = e->roots[root].back;
    if (root < 0) return false;
    const struct imp_shape *s = e->scene->shapes[at.shape];
    s->ops->surface(s, &at, &ray->o, &ray->d, &surface);
    hit->root = (uint32_t)root;
    imp__el_locate(&e->roots[root], surface.p, &hit->u, &hit->v);
    return true;
}

/* ---- Hits of a picture, row by row --------------------------------------------- */

static size_t rays_of(const imp_elements *e, const int region[4])
{
    return (size_t)(region[2] - region[0]) * (size_t)(region[3] - region[1]) *
           (size_t)(e->opt.rays * e->opt.rays);
}

struct rows {
    const imp_elements *e;
    const struct imp_sensor *sensor;
    int x0, y0, width, side;
    uint32_t source;
    size_t first_ray;
    double weight;
    struct imp__el_hit *out;
};
static enum imp_status row_work(size_t item, int worker, int slot, void *payload)
{
    const struct rows *r = payload;
    (void)worker, (void)slot;
    const size_t n = (size_t)r->width * (size_t)(r->side * r->side);
    for (size_t k = 0; k < n; k++) {
        const int per = r->side * r->side;
        struct imp_sensor_ray ray;
        imp__el_ray(r->sensor, r->x0 + (int)(k / (size_t)per), r->y0 + (int)item,
                    (int)(k % (size_t)per), r->side, &ray);
        struct imp__el_hit *hit = &r->out[item * n + k];
        *hit = (struct imp__el_hit){.source = r->source,
                                    .ray = (uint32_t)(r->first_ray + item * n + k),
                                    .weight = r->weight};
        if (imp__el_trace(r->e, &ray, hit))
            hit->path = imp__el_path(r->e->roots[hit->root].corners, hit->u, hit->v);
    }
    return IMP_OK;
}

/* `weight`: of all these rays together. */
static enum imp_status hits_take(imp_elements *e, int sensor, const int region[4],
                                 uint32_t source, double weight)
{
    enum imp_status st = IMP_OK;
    const int height = region[3] - region[1], width = region[2] - region[0];
    const size_t n = rays_of(e, region);
    struct rows r = {.e = e,
                     .sensor = e->scene->sensors[sensor],
                     .x0 = region[0],
                     .y0 = region[1],
                     .width = width,
                     .side = e->opt.rays,
                     .source = source,
                     .first_ray = e->n_hits,
                     .weight = e->scene->sensors[sensor]->scale * weight / (double)n,
                     .out = e->hits + e->n_hits};
    const struct imp_loop loop = {
        .n_items = (size_t)height, .work = row_work, .payload = &r};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    e->n_hits += n;
    e->rays += (int64_t)n;
out:
    return st;
}

/* The view and the first source that is all of it, -1: none. There is no view without a
 * sensor, or where only measurements are made. */
static int view_of(const imp_elements *e, int view[4])
{
    memset(view, 0, 4 * sizeof *view);
    if (e->scene->n_sensors == 0 || (e->opt.n_sources && !e->opt.picture)) return -1;
    const struct imp_film_desc *film = &e->scene->sensors[e->opt.sensor]->film;
    view[2] = film->crop_w, view[3] = film->crop_h;
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *s = &e->sources[k];
        if (s->kind == IMP_ELEMENTS_CAMERA && s->sensor == e->opt.sensor &&
            memcmp(s->region, view, 4 * sizeof *view) == 0)
            return (int)k;
    }
    return -1;
}

enum imp_status imp__el_sources(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    int view[4];
    const int seen = view_of(e, view);
    const size_t n_view = rays_of(e, view);
    size_t n = seen < 0 ? n_view : 0;
    for (size_t k = 0; k < e->n_sources; k++)
        if (e->sources[k].kind == IMP_ELEMENTS_CAMERA)
            n += rays_of(e, e->sources[k].region);
    if ((double)n * (sizeof *e->hits + sizeof *e->seen) > (double)e->opt.max_bytes ||
        n >= EL_NONE)
        return imp__error(e->ctx, IMP_E_NOMEM,
                          "%zu rays of the eye (%d a pixel) are over the memory budget",
                          n, e->opt.rays * e->opt.rays);
    imp__release(e->ctx, e->hits);
    e->hits = imp__alloc_raw(e->ctx, n + 1, sizeof *e->hits);
    e->n_hits = 0;
    e->n_view = n_view;
    if (!e->hits)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the picture's rays");
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *src = &e->sources[k];
        e->first_ray[k] = e->n_hits;
        if ((int)k == seen) e->first_view = e->n_hits;
        if (src->kind == IMP_ELEMENTS_CAMERA)
            IMP_TRY(hits_take(e, src->sensor, src->region, (uint32_t)k, src->weight));
    }
    if (seen < 0 && n_view) {
        e->first_view = e->n_hits;
        IMP_TRY(hits_take(e, e->opt.sensor, view, EL_NONE, 0));
    }
    IMP_TRY(imp__el_hits_sort(e));
out:
    return st;
}
