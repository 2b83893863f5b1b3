/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of a solution: flat, interpolated without cracks, with a final gather, and of
 * the importance. */
#include "base/film.h"
#include "base/team.h"
#include "elements.h"
#include <string.h>

static void basis_at(const imp_elements *e, const struct imp__el_root *r, imp_v3 w,
                     double *h)
{
    h[0] = e->basis.lead[0];
    if (imp__el_n(e, r) > 1) imp__basis_eval(&e->basis, imp__to_local(&r->frame, w), h);
}

static void reflected(const imp_elements *e, uint32_t element, const double *h,
                      double out[3])
{
    const struct imp__element *x = &e->elements[element];
    const int n = imp__el_n(e, imp__el_root_of(e, x));
    for (int c = 0; c < e->ch; c++) {
        const double *l = imp__el_at(e, e->l, x) + c * n;
        double sum = 0;
        for (int q = 0; q < n; q++) sum += l[q] * h[q];
        out[c] = sum;
    }
}

static void emitted_add(const imp_elements *e, const struct imp__el_root *r, imp_v3 w,
                        double out[3])
{
    const double lobe = imp__el_lobe(r, w);
    for (int c = 0; c < e->ch && lobe > 0; c++) out[c] += r->radiance[c] * lobe;
}

void imp__el_flat(const imp_elements *e, const struct imp__el_hit *hit, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    if (hit->root == EL_NONE) return;
    const struct imp__el_root *r = &e->roots[hit->root];
    double h[EL_N_MAX];
    basis_at(e, r, hit->w, h);
    reflected(e, imp__el_find(e, hit->root, hit->u, hit->v, NULL), h, out);
    emitted_add(e, r, hit->w, out);
}

/* ---- Gouraud ------------------------------------------------------------------- */

struct shade {
    const imp_elements *e;
    uint32_t root;
    int corners;
    const double *h; /* of the direction to the eye, the same for all leaves of a root */
};

/* The value at (u, v), a corner of some leaf. The leaves around it are averaged, unless
 * one has it on an edge (a T-vertex): then it is what that edge's own interpolation
 * gives, so that both sides of the edge agree. Edges get longer each time, so this ends.
 */
static void vertex_value(const struct shade *s, double u, double v, double out[3])
{
    const double tiny = 0x1p-16;
    static const double around[8][2] = {{1, 1},    {-1, 1},   {-1, -1},  {1, -1},
                                        {2.1, -1}, {-1, 2.1}, {-2.1, 1}, {1, -2.1}};
    double sum[3] = {0}, best_uv[4][2] = {{0}};
    int count = 0, hanging = -1;
    double longest = 0;
    uint32_t seen[8];
    for (int k = 0; k < (s->corners == 4 ? 4 : 8); k++) {
        const double uu = u + tiny * around[k][0], vv = v + tiny * around[k][1];
        double uv[4][2];
        if (uu < 0 || vv < 0 || (s->corners == 4 ? uu >= 1 || vv >= 1 : uu + vv >= 1))
            continue;
        const uint32_t leaf = imp__el_find(s->e, s->root, uu, vv, uv);
        bool again = false, corner = false;
        for (int i = 0; i < count; i++) again |= seen[i] == leaf;
        if (again) continue;
        seen[count++] = leaf;
        for (int i = 0; i < s->corners; i++) corner |= uv[i][0] == u && uv[i][1] == v;
        if (!corner) {
            const double size = fabs(uv[0][0] - uv[1][0]) + fabs(uv[0][1] - uv[1][1]);
            if (size > longest) {
                longest = size;
                hanging = 1;
                memcpy(best_uv, uv, sizeof uv);
            }
        }
        double own[3] = {0};
        reflected(s->e, leaf, s->h, own);
        for (int c = 0; c < s->e->ch; c++) sum[c] += own[c];
    }
    if (hanging < 0) {
        for (int c = 0; c < 3; c++) out[c] = count ? sum[c] / count : 0;
        return;
    }
    for (int i = 0; i < s->corners; i++) {
        const double *p = best_uv[i], *q = best_uv[(i + 1) % s->corners];
        const double dx = q[0] - p[0], dy = q[1] - p[1];
        const double t = ((u - p[0]) * dx + (v - p[1]) * dy) / (dx * dx + dy * dy);
        const double off = (u - p[0]) * dy - (v - p[1]) * dx;
        if (off != 0 || t <= 0 || t >= 1) continue;
        double a[3], b[3];
        vertex_value(s, p[0], p[1], a);
        vertex_value(s, q[0], q[1], b);
        for (int c = 0; c < 3; c++) out[c] = (1 - t) * a[c] + t * b[c];
        return;
    }
    for (int c = 0; c < 3; c++) out[c] = sum[c] / count;
}

static void gouraud(const imp_elements *e, const struct imp__el_hit *hit, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    if (hit->root == EL_NONE) return;
    const struct imp__el_root *r = &e->roots[hit->root];
    double h[EL_N_MAX], uv[4][2], value[4][3], weight[4];
    if (imp__el_n(e, r) > 0) {
        const struct shade s = {e, hit->root, r->corners, h};
        basis_at(e, r, hit->w, h);
        imp__el_find(e, hit->root, hit->u, hit->v, uv);
        const double x = (hit->u - uv[0][0]) / (uv[1][0] - uv[0][0]);
        const double y = r->corners == 4 ? (hit->v - uv[0][1]) / (uv[3][1] - uv[0][1])
                                         : (hit->v - uv[0][1]) / (uv[2][1] - uv[0][1]);
        if (r->corners == 4)
            weight[0] = (1 - x) * (1 - y), weight[1] = x * (1 - y), weight[2] = x * y,
            weight[3] = (1 - x) * y;
        else weight[0] = 1 - x - y, weight[1] = x, weight[2] = y;
        for (int k = 0; k < r->corners; k++) {
            vertex_value(&s, uv[k][0], uv[k][1], value[k]);
            for (int c = 0; c < e->ch; c++) out[c] += weight[k] * value[k][c];
        }
    }
    emitted_add(e, r, hit->w, out);
}

/* ---- Final gather -------------------------------------------------------------- */

void imp__el_gather(const imp_elements *e, uint32_t root, double u, double v,
                    const imp_v3 *to, double out[3])
{
    const struct imp__el_root *r = &e->roots[root];
    const struct imp__el_material *m = &e->materials[r->material];
    const imp_v3 x = imp__el_point(r->corners, r->v, u, v);
    const imp_v3 wo = to ? imp__to_local(&r->frame, *to) : imp__v3(0, 0, 1);
    uint32_t at = imp__el_find(e, root, u, v, NULL);
    for (; at != EL_NONE; at = e->elements[at].parent)
        for (size_t k = e->in_start[at]; k < e->in_start[at + 1]; k++) {
            const uint32_t src = e->links[k].src;
            const struct imp__element *j = &e->elements[src];
            const struct imp__el_root *rj = imp__el_root_of(e, j);
            for (int q = 0; q < 4; q++) {
                imp_v3 corner[4], y = imp__v3(0, 0, 0);
                imp__el_quarter(j, q, corner);
                const double factor =
                    imp__polygon_factor(x, r->frame.n, j->corners, corner, rj->frame.n);
                if (factor <= 0) continue;
                for (int i = 0; i < j->corners; i++) y += corner[i] * (1.0 / j->corners);
                const imp_v3 w = imp__normalize(y - x);
                const imp_v3 wi = imp__to_local(&r->frame, w);
                double light[3] = {0}, f[3] = {1, 1, 1}, h[EL_N_MAX];
                if (wi[2] <= 0 || !imp__el_sees(e, r, x, rj, y)) continue;
                if (imp__el_n(e, rj) > 0) {
                    basis_at(e, rj, -w, h);
                    reflected(e, j->child ? j->child + (uint32_t)q : src, h, light);
                }
                emitted_add(e, rj, -w, light);
                if (to) imp__el_brdf(m, wo, wi, f);
                for (int c = 0; c < e->ch; c++) out[c] += f[c] * factor * light[c];
            }
        }
}

static void gather(const imp_elements *e, const struct imp__el_hit *hit, double out[3])
{
    out[0] = out[1] = out[2] = 0;
    if (hit->root == EL_NONE) return;
    const struct imp__el_root *r = &e->roots[hit->root];
    emitted_add(e, r, hit->w, out);
    if (e->materials[r->material].n)
        imp__el_gather(e, hit->root, hit->u, hit->v, &hit->w, out);
}

static void importance(const imp_elements *e, const struct imp__el_hit *hit,
                       double out[3])
{
    out[0] = 0;
    if (hit->root == EL_NONE) return;
    const struct imp__element *x =
        &e->elements[imp__el_find(e, hit->root, hit->u, hit->v, NULL)];
    const int n = imp__el_n(e, imp__el_root_of(e, x));
    for (int c = 0; c < e->ch && n; c++) /* mean over the hemisphere, per solid angle */
        out[0] += imp__el_at(e, e->g, x)[c * n] / sqrt(IMP_2PI);
}

/* ---- Pictures ------------------------------------------------------------------ */

struct picture {
    const imp_elements *e;
    const struct imp_sensor *sensor;
    enum imp_elements_image kind;
    int side;
    imp_film *film;
};

static size_t row_bytes(const struct picture *p)
{
    return (size_t)p->film->width * (size_t)p->film->channels * sizeof(float);
}

static enum imp_status row_work(size_t item, int worker, void *result, void *payload)
{
    const struct picture *p = payload;
    const imp_elements *e = p->e;
    const int n = p->side * p->side, channels = p->film->channels;
    const double reads = p->kind == IMP_ELEMENTS_IMPORTANCE ? 1 : p->sensor->scale;
    (void)worker;
    for (int x = 0; x < p->film->width; x++) {
        double sum[3] = {0};
        for (int k = 0; k < n; k++) {
            struct imp_sensor_ray ray;
            struct imp__el_hit hit = {0};
            double out[3] = {0};
            imp__el_ray(p->sensor, x, (int)item, k, p->side, &ray);
            imp__el_trace(e, &ray, &hit);
            switch (p->kind) {
            case IMP_ELEMENTS_FLAT: imp__el_flat(e, &hit, out); break;
            case IMP_ELEMENTS_GOURAUD: gouraud(e, &hit, out); break;
            case IMP_ELEMENTS_GATHER: gather(e, &hit, out); break;
            case IMP_ELEMENTS_IMPORTANCE: importance(e, &hit, out); break;
            }
            for (int c = 0; c < channels; c++) sum[c] += out[c];
        }
        float *pixel = (float *)result + (size_t)x * (size_t)channels;
        for (int c = 0; c < channels; c++) pixel[c] = (float)(reads * sum[c] / n);
    }
    return IMP_OK;
}

static enum imp_status row_take(size_t row, void *sum, void *payload)
{
    const struct picture *p = payload;
    memcpy(p->film->mean + row * row_bytes(p) / sizeof(float), sum, row_bytes(p));
    return IMP_OK;
}

enum imp_status imp_elements_image(const imp_elements *e, int sensor,
                                   enum imp_elements_image kind, int rays, imp_film **out)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, out, "out");
    IMP_FLOAT_MODE;
    IMP_READS(e->scene);
    IMP_CHECKED(imp__el_sensor_check(e, sensor));
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    if (rays < 0 || rays > 64 || kind < IMP_ELEMENTS_FLAT ||
        kind > IMP_ELEMENTS_IMPORTANCE)
        return imp__error(e->ctx, IMP_E_ARG,
                          "there is no such picture of finite elements");
    struct picture p = {.e = e,
                        .sensor = e->scene->sensors[sensor],
                        .kind = kind,
                        .side = rays ? rays : e->opt.rays};
    const struct imp_film_desc *f = &p.sensor->film;
    IMP_TRY(imp__film_create(e->ctx, f->crop_w, f->crop_h,
                             kind == IMP_ELEMENTS_IMPORTANCE ? "importance"
                             : e->ch == 1                    ? "Y"
                                                             : "R,G,B",
                             false, &p.film));
    p.film->spp = (int64_t)p.side * p.side;
    /* Rows are shared by the ranks of a team; each is a sum of its own. */
    const struct imp_loop loop = {.n_items = (size_t)f->crop_h, .payload = &p};
    const struct imp_sum_desc desc = {.n_items = loop.n_items,
                                      .group = 1,
                                      .size = row_bytes(&p),
                                      .take = row_take,
                                      .payload = &p};
    struct imp_drops none = {0};
    struct imp_shared shared = {.drops = &none};
    const bool apart = imp__team_apart(e->ctx);
    if (apart) e->ctx->team->alone++;
    st = imp__shared_sum(e->ctx, &loop, &desc, row_work, &shared);
    if (apart) e->ctx->team->alone--;
    IMP_TRY(st);
    *out = p.film;
    p.film = NULL;
out:
    imp_film_destroy(p.film);
    return st;
}
