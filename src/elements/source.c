/* SPDX-License-Identifier: Apache-2.0
 *
 * Where importance comes from. The eye is never an element: its rays are binned into the
 * elements that they hit, a_i,m += weight H_m(to the eye), which is the projected area
 * that the paper speaks of. Measuring patches emit a constant importance (elements.h: s).
 */
#include "elements.h"
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

void imp__el_ray(const struct imp_sensor *s, int x, int y, int k, int side,
                 struct imp_sensor_ray *ray)
{
    const double px = s->film.crop_x + x + (k % side + 0.5) / side;
    const double py = s->film.crop_y + y + (k / side + 0.5) / side;
    s->ops->ray(s, px, py, (double[2]){0.5, 0.5}, ray);
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

struct rows {
    const imp_elements *e;
    const struct imp_sensor *sensor;
    int x0, y0, width, side;
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
        imp__el_trace(r->e, &ray, &r->out[item * n + k]);
    }
    return IMP_OK;
}

static enum imp_status hits_take(imp_elements *e, int sensor, const int region[4],
                                 struct imp__el_hit **array, size_t *cap, size_t *count)
{
    enum imp_status st = IMP_OK;
    struct rows r = {.e = e,
                     .sensor = e->scene->sensors[sensor],
                     .x0 = region[0],
                     .y0 = region[1],
                     .width = region[2] - region[0],
                     .side = e->opt.rays};
    const int height = region[3] - region[1];
    const size_t n = (size_t)r.width * (size_t)height * (size_t)(r.side * r.side);
    if ((double)n * sizeof **array > (double)e->opt.max_bytes)
        return imp__error(e->ctx, IMP_E_NOMEM,
                          "%d x %d pixels with %d rays each are over the "
                          "memory budget",
                          r.width, height, r.side * r.side);
    struct imp__el_hit *grown =
        imp__grow(e->ctx, *array, cap, *count + n + 1, sizeof *grown);
    if (!grown)
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the picture's rays");
    *array = grown;
    r.out = grown + *count;
    const struct imp_loop loop = {
        .n_items = (size_t)height, .work = row_work, .payload = &r};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
    *count += n;
    e->rays += (int64_t)n;
out:
    return st;
}

enum imp_status imp__el_sources(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *src = &e->sources[k];
        if (src->kind != IMP_ELEMENTS_CAMERA) continue;
        const size_t first = e->n_hits;
        IMP_TRY(
            hits_take(e, src->sensor, src->region, &e->hits, &e->cap_hits, &e->n_hits));
        for (size_t i = first; i < e->n_hits; i++) {
            e->hits[i].source = (uint32_t)k;
            e->hits[i].weight = src->weight / (double)(e->n_hits - first);
        }
    }
    if (e->scene->n_sensors > 0) {
        const struct imp_film_desc *film = &e->scene->sensors[e->opt.sensor]->film;
        const int all[4] = {0, 0, film->crop_w, film->crop_h};
        IMP_TRY(hits_take(e, e->opt.sensor, all, &e->view, &e->cap_view, &e->n_view));
    }
out:
    return st;
}

/* Hits by root, in their order: each root is then one worker's, whatever the threads. */
static enum imp_status hits_sort(imp_elements *e)
{
    e->hit_start = imp__alloc(e->ctx, e->n_roots + 2, sizeof *e->hit_start);
    e->hit_order = imp__alloc(e->ctx, e->n_hits + 1, sizeof *e->hit_order);
    if (!e->hit_start || !e->hit_order) {
        imp__release(e->ctx, e->hit_start);
        imp__release(e->ctx, e->hit_order);
        e->hit_start = e->hit_order = NULL;
        return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the picture's rays");
    }
    size_t *next = e->hit_start + 1; /* counts, then where the next of a root goes */
    for (size_t k = 0; k < e->n_hits; k++)
        if (e->hits[k].root != EL_NONE && e->hits[k].root + 1 < e->n_roots)
            next[e->hits[k].root + 1]++;
    for (size_t r = 1; r < e->n_roots; r++) next[r] += next[r - 1];
    for (size_t k = 0; k < e->n_hits; k++)
        if (e->hits[k].root != EL_NONE) e->hit_order[next[e->hits[k].root]++] = k;
    return IMP_OK;
}

static enum imp_status bin_work(size_t item, int worker, int slot, void *payload)
{
    imp_elements *e = payload;
    const struct imp__el_root *r = &e->roots[item];
    const int n = el_n(e, r);
    (void)worker, (void)slot;
    for (size_t i = e->hit_start[item]; i < e->hit_start[item + 1] && n; i++) {
        const struct imp__el_hit *hit = &e->hits[e->hit_order[i]];
        const struct imp__element *x =
            &e->elements[imp__el_find(e, hit->root, hit->u, hit->v, NULL)];
        double h[EL_N_MAX];
        h[0] = e->basis.lead[0];
        if (n > 1) imp__basis_eval(&e->basis, imp__to_local(&r->frame, hit->w), h);
        for (int q = 0; q < n; q++) e->a[x->coef + (size_t)q] += hit->weight * h[q];
    }
    return IMP_OK;
}

enum imp_status imp__el_bin(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    memset(e->a, 0, e->n_coef * sizeof *e->a);
    if (!e->hit_order) IMP_TRY(hits_sort(e));
    const struct imp_loop loop = {.n_items = e->n_roots, .work = bin_work, .payload = e};
    IMP_TRY(imp__parallel(e->ctx, &loop, NULL));
out:
    return st;
}

/* ---- The measurement, from both sides ------------------------------------------ */

static double direct_of(const imp_elements *e)
{
    double sum = 0;
    for (size_t k = 0; k < e->n_hits; k++) {
        const struct imp__el_hit *hit = &e->hits[k];
        if (hit->root == EL_NONE) continue;
        const struct imp__el_root *r = &e->roots[hit->root];
        const double lobe = el_lobe(r, hit->w) * hit->weight;
        for (int c = 0; c < e->ch && lobe > 0; c++)
            sum += e->lum[c] * r->radiance[c] * lobe;
    }
    return sum;
}

double imp__el_measure(const imp_elements *e, double *direct)
{
    const double seen = direct_of(e);
    double sum = 0;
    for (size_t k = 0; k < e->n_elements; k++) {
        const struct imp__element *x = &e->elements[k];
        if (x->child) continue;
        const struct imp__el_root *r = el_root(e, x);
        const int n = el_n(e, r);
        for (int c = 0; c < e->ch && n; c++) {
            const double *l = el_at(e, e->l, x) + c * n, *in = el_at(e, e->c, x) + c * n;
            double eye = 0;
            for (int q = 0; q < n; q++) eye += e->a[x->coef + (size_t)q] * l[q];
            sum += e->lum[c] * (eye + x->area * r->measure * sqrt(IMP_2PI) * in[0]);
        }
    }
    if (direct) *direct = seen;
    return sum + seen;
}

double imp__el_measure_adjoint(const imp_elements *e)
{
    double sum = direct_of(e);
    for (size_t j = 0; j < e->n_elements; j++) {
        const struct imp__el_root *r = el_root(e, &e->elements[j]);
        if (r->light == EL_DARK) continue;
        for (size_t at = e->out_start[j]; at < e->out_start[j + 1]; at++) {
            const struct imp__el_link *k = &e->links[e->out[at]];
            imp_spec emitted[3] = {{0}}, g[3];
            imp__el_emission(e, k, r, emitted);
            imp__el_ends(e, k, NULL, g);
            for (int c = 0; c < e->ch; c++)
                for (int s = 0; s < 4; s++) sum += k->k[s] * emitted[c][s] * g[c][s];
        }
    }
    return sum;
}
