/* THROWAWAY: pictures' values by walks in eight double lanes (AVX-512), to be measured. */
#include "spike.h"
#include "kind/bsdf/roughness.h"
#include "kind/sensor/projection.h"
#include "kind/shape/shape.h"
#include "kind/texture/bitmap.h"
#include "kind/texture/input.h"
#include "kind/texture/uv.h"
#include "math/offset.h"
#include "scene/facets_lanes.h"
#include "scene/intersector.h"
#include "walk/core/dims.h"
#include "walk/core/step.h"
#include <immintrin.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

extern const struct imp_shape_ops imp__rectangle, imp__sphere;
extern const struct imp_bsdf_ops imp__diffuse, imp__roughconductor;
extern const struct imp_texture_ops imp__bitmap, imp__checkerboard;
extern const struct imp_emitter_ops imp__area, imp__constant;
extern const struct imp_sensor_ops imp__perspective;

/* ---- copies of private structs ---- */
struct rectangle {
    imp_v3 corner, eu, ev;
    imp_v3 s, t, n;
    double inv_area;
};
struct sphere {
    imp_v3 center;
    struct imp_frame axes;
    double radius, side;
};
struct perspective {
    struct imp_projection projection;
    struct imp_film_plane film;
};
struct checkerboard {
    struct imp__to_uv to_uv;
};

/* ---- lanes ---- */
typedef __m512d V;
typedef __m512i I;
typedef __mmask8 M;
typedef struct {
    V x, y, z;
} V3;
#define NO do { if (getenv("SPIKE_WHY")) fprintf(stderr, "line %d\n", __LINE__); return false; } while (0)
#define INL       static inline __attribute__((always_inline))
#define S(c)      _mm512_set1_pd(c)
#define SEL(m, a, b) _mm512_mask_blend_pd(m, b, a)
#define LT(a, b)  _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ)
#define LE(a, b)  _mm512_cmp_pd_mask(a, b, _CMP_LE_OQ)
#define GT(a, b)  _mm512_cmp_pd_mask(a, b, _CMP_GT_OQ)
#define GE(a, b)  _mm512_cmp_pd_mask(a, b, _CMP_GE_OQ)
#define EQ(a, b)  _mm512_cmp_pd_mask(a, b, _CMP_EQ_OQ)
#define MINV(a, b) _mm512_min_pd(a, b)
#define MAXV(a, b) _mm512_max_pd(a, b)
#define SQRT(a)   _mm512_sqrt_pd(a)
#define ABS(a)    _mm512_abs_pd(a)
INL V copysignv(V a, V b)
{
    const I m = _mm512_set1_epi64(INT64_MIN);
    return (V)_mm512_ternarylogic_epi64(m, (I)b, (I)a, 0xca);
}
INL V decide(V a) { return _mm512_cvtps_pd(_mm512_cvtpd_ps(a)); }
INL V dot(V3 a, V3 b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
INL V3 v3(V x, V y, V z) { return (V3){x, y, z}; }
INL V3 bc(imp_v3 a) { return (V3){S(a[0]), S(a[1]), S(a[2])}; }
INL V3 add(V3 a, V3 b) { return (V3){a.x + b.x, a.y + b.y, a.z + b.z}; }
INL V3 sub(V3 a, V3 b) { return (V3){a.x - b.x, a.y - b.y, a.z - b.z}; }
INL V3 mul(V3 a, V3 b) { return (V3){a.x * b.x, a.y * b.y, a.z * b.z}; }
INL V3 scale(V3 a, V b) { return (V3){a.x * b, a.y * b, a.z * b}; }
INL V3 neg(V3 a) { return (V3){-a.x, -a.y, -a.z}; }
INL V3 cross(V3 a, V3 b)
{
    return (V3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
INL V3 sel3(M m, V3 a, V3 b)
{
    return (V3){SEL(m, a.x, b.x), SEL(m, a.y, b.y), SEL(m, a.z, b.z)};
}
INL V3 decide3(V3 a) { return (V3){decide(a.x), decide(a.y), decide(a.z)}; }
INL V length(V3 a) { return SQRT(dot(a, a)); }
INL V3 normalize(V3 a) { return scale(a, 1 / length(a)); }
INL I mix64(I z)
{
    z = _mm512_mullo_epi64(z ^ _mm512_srli_epi64(z, 30), _mm512_set1_epi64((int64_t)0xbf58476d1ce4e5b9u));
    z = _mm512_mullo_epi64(z ^ _mm512_srli_epi64(z, 27), _mm512_set1_epi64((int64_t)0x94d049bb133111ebu));
    return z ^ _mm512_srli_epi64(z, 31);
}
#define GOLD 0x9e3779b97f4a7c15u
struct block {
    I hash, lo, hi;
};
INL struct block block_of(const struct imp_point_table *t, I set, I index, uint32_t block)
{
    const I h = mix64(set + _mm512_set1_epi64((int64_t)((uint64_t)(block + 1) * GOLD)));
    const I at = ((index ^ h) & _mm512_set1_epi64(IMP_SET_POINTS - 1)) +
                 _mm512_slli_epi64(_mm512_srli_epi64(h, 58), 6);
    const I byte = _mm512_slli_epi64(at, 4);
    return (struct block){h, _mm512_i64gather_epi64(byte, t, 1),
                          _mm512_i64gather_epi64(byte, (const char *)t + 8, 1)};
}
INL V number(struct block b, int k)
{
    const I shift = mix64(b.hash + _mm512_set1_epi64((int64_t)((uint64_t)(k + 1) * GOLD)));
    const I lead = _mm512_slli_epi64(_mm512_srli_epi64(k < 4 ? b.lo : b.hi, 16 * (k & 3)), 48);
    return _mm512_cvtepi64_pd(_mm512_srli_epi64(shift ^ lead, 11)) * S(0x1p-53);
}

/* ---- what the scene holds ---- */
enum surf { RECT, SPHERE, MESH_A, MESH_F, MESH_FN };
enum mat { CONST, BITMAP, CHECKER, GGX };
struct item {
    enum surf surf;
    enum mat mat;
    int bin, emitter;
    bool black;
    const struct imp_shape *shape;
    const struct imp__mesh *mesh;
    double rho[3], check[2][3], eta[3], k[3], tint[3], alpha;
    struct imp__texels texels;
    struct imp__to_uv to_uv;
};
enum { MAX_SHAPES = 32, CAP = 4096, MAX_DEPTH = 8 };
struct plan {
    const struct imp_tracer *tracer;
    const struct imp_scene *scene;
    const struct imp_intersector *x;
    int n_items, n_bins, n_emitters, max_depth, rr_depth, rows;
    bool ok;
    struct item item[MAX_SHAPES];
    int bin_of[MAX_SHAPES], first_of_bin[MAX_SHAPES];
    double rho_of[MAX_SHAPES][4];
    const void *facets_of[MAX_SHAPES];
    int lamp; /* emitter with a shape; -1 */
    int sky;
    double le[2][3];
};

/* ---- columns ---- */
#define COL(name) double name[CAP + 64] __attribute__((aligned(64)))
struct wave {
    int n;
    COL(ox); COL(oy); COL(oz); COL(dx); COL(dy); COL(dz); COL(tmax);
    COL(fx); COL(fy); COL(fz); COL(pdf); COL(bx); COL(by); COL(bz);
    int64_t walk[CAP + 64] __attribute__((aligned(64))), parent[CAP + 64] __attribute__((aligned(64)));
    /* hits */
    COL(t); COL(u); COL(v);
    int shape[CAP + 64] __attribute__((aligned(64))), prim[CAP + 64] __attribute__((aligned(64)));
};
struct values { /* of a depth, by position */
    COL(ex); COL(ey); COL(ez); COL(wx); COL(wy); COL(wz); COL(lx); COL(ly); COL(lz);
    COL(bx); COL(by); COL(bz);
    int64_t parent[CAP + 64] __attribute__((aligned(64)));
    int n;
};
struct shadows {
    int n;
    COL(ox); COL(oy); COL(oz); COL(dx); COL(dy); COL(dz); COL(reach);
    int64_t at[CAP + 64] __attribute__((aligned(64)));
};
struct engine {
    struct wave wave[2];
    struct values values[MAX_DEPTH];
    struct shadows shadows;
    int order[CAP + 64 * MAX_SHAPES] __attribute__((aligned(64)));
    uint64_t set[CAP] __attribute__((aligned(64)));
    uint64_t index[CAP] __attribute__((aligned(64)));
    double L[3][CAP + 64] __attribute__((aligned(64)));
    double px[CAP], py[CAP];
    bool valid[CAP];
    struct plan plan;
    int64_t sample[64];
    int x0, y0, x1, y1, next;
    const struct imp_tracer *last;
    uint64_t seed;
};
static __thread struct engine *E;

/* ---- plan ---- */
static bool plan_make(struct plan *p, const struct imp_tracer *t)
{
    const struct imp_scene *s = t->scene;
    *p = (struct plan){.tracer = t, .scene = s, .x = s->intersector, .lamp = -1, .sky = -1};
    const struct imp_walk_integrator *w = t->integrator;
    if (!t->value_only || t->active || t->kept || t->guide || t->wavelengths || !t->points || t->mixing || w->mixes ||
        w->hide_emitters || w->light_tree || !w->lights || w->only_points || !w->directions || w->ends_by != IMP_ENDS_BY_ROULETTE ||
        w->both || s->n_media || s->n_bodies || s->priorities || s->n_groups || s->mode != IMP_RGB || t->sensor->shape ||
        t->sensor->ops != &imp__perspective || s->n_shapes > MAX_SHAPES || s->n_emitters < 1 || s->n_emitters > 2 ||
        t->survival > 0 || w->max_depth < 2 || w->max_depth > MAX_DEPTH || p->x->calls_back || t->split || t->sensor->gain || t->photograph)
        NO;
    const struct perspective *cam = t->sensor->self;
    if (cam->film.lens) NO;
    p->n_items = s->n_shapes;
    p->n_emitters = s->n_emitters;
    p->max_depth = w->max_depth;
    p->rr_depth = w->rr_depth;
    for (int k = 0; k < s->n_emitters; k++) {
        const struct imp_emitter *e = s->emitters[k];
        if (e->course || !e->input[0]->plain) NO;
        if (e->ops == &imp__area) p->lamp = k;
        else if (e->ops == &imp__constant) p->sky = k;
        else NO;
        for (int c = 0; c < 3; c++) p->le[k][c] = e->input[0]->value[c];
    }
    if (s->n_environments > 1) NO;
    if (p->n_emitters == 2 && (p->lamp < 0 || p->sky < 0)) NO;
    int shared = -1;
    for (int i = 0; i < s->n_shapes; i++) {
        struct item *m = &p->item[i];
        const struct imp_shape *h = s->shapes[i];
        const struct imp_bsdf *b = imp__shape_bsdf(s, h);
        m->shape = h;
        m->emitter = h->emitter;
        if (h->ops == &imp__rectangle) m->surf = RECT;
        else if (h->ops == &imp__sphere) m->surf = SPHERE;
        else if (h->geometry == IMP_TRIANGLES && h->ops->surface == imp__mesh_surface && !h->by_triangle) {
            m->mesh = h->self;
            if (!m->mesh->facets) m->surf = MESH_A;
            else if (!m->mesh->normals && m->mesh->face_tangents) m->surf = MESH_F;
            else if (m->mesh->normals && !m->mesh->face_tangents) m->surf = MESH_FN;
            else NO;
            if (m->surf == MESH_A && (!m->mesh->normals || m->mesh->face_tangents || m->mesh->uvs)) NO;
        } else NO;
        if (b == s->black_bsdf) {
            m->mat = CONST;
            m->black = true;
        } else if (b->ops == &imp__diffuse) {
            const struct imp_input *in = b->input[0];
            if (in->plain) {
                m->mat = CONST;
                for (int c = 0; c < 3; c++) m->rho[c] = in->value[c];
            } else if (in->texture && in->texture->ops == &imp__bitmap) {
                m->mat = BITMAP;
                if (!imp__bitmap_texels(in->texture, &m->texels) || !m->texels.plain || m->texels.channels != 3) NO;
            } else if (in->texture && in->texture->ops == &imp__checkerboard) {
                m->mat = CHECKER;
                m->to_uv = ((const struct checkerboard *)in->texture->self)->to_uv;
                for (int k = 0; k < 2; k++) {
                    if (!in->texture->input[k]->plain) NO;
                    for (int c = 0; c < 3; c++) m->check[k][c] = in->texture->input[k]->value[c];
                }
            } else NO;
            if (m->mat != CONST && m->surf != RECT) NO;
        } else if (b->ops == &imp__roughconductor) {
            const struct imp__roughness *r = b->self;
            m->mat = GGX;
            if (r->type != IMP_GGX || !r->visible || r->anisotropic) NO;
            for (int k = 0; k < 4; k++)
                if (!b->input[k]->plain) NO;
            for (int c = 0; c < 3; c++) {
                m->eta[c] = b->input[0]->value[c];
                m->k[c] = b->input[1]->value[c];
                m->tint[c] = b->input[2]->value[c];
            }
            m->alpha = imp_max(b->input[3]->value[0], IMP_ALPHA_MIN);
        } else NO;
        p->rho_of[i][0] = m->rho[0];
        p->rho_of[i][1] = m->rho[1];
        p->rho_of[i][2] = m->rho[2];
        p->facets_of[i] = m->mesh ? m->mesh->facets : NULL;
        if (m->surf == MESH_F && m->mat == CONST && m->emitter < 0 && !m->black) {
            if (shared < 0) shared = p->n_bins++;
            m->bin = shared;
        } else m->bin = p->n_bins++;
        p->bin_of[i] = m->bin;
        p->first_of_bin[m->bin] = i;
    }
    return true;
}

/* ---- camera ---- */
INL void cols_store(struct wave *w, int i, V3 o, V3 d, V tmax, V3 f, V pdf, V3 beta, I walk, I parent)
{
#define ST(c, v) _mm512_storeu_pd(&w->c[i], v)
    ST(ox, o.x); ST(oy, o.y); ST(oz, o.z); ST(dx, d.x); ST(dy, d.y); ST(dz, d.z); ST(tmax, tmax);
    ST(fx, f.x); ST(fy, f.y); ST(fz, f.z); ST(pdf, pdf); ST(bx, beta.x); ST(by, beta.y); ST(bz, beta.z);
    _mm512_storeu_si512(&w->walk[i], walk);
    _mm512_storeu_si512(&w->parent[i], parent);
#undef ST
}

static void camera(struct engine *e, int n)
{
    const struct plan *p = &e->plan;
    const struct imp_tracer *t = p->tracer;
    const struct perspective *c = t->sensor->self;
    const double *m = c->projection.to_world.m;
    const struct imp_film_desc *film = &t->sensor->film;
    struct wave *w = &e->wave[0];
    const double near = c->projection.near_clip, far = c->projection.far_clip;
    w->n = n;
    for (int i = 0; i < n; i += 8) {
        const int pixel = i / 64, wide = e->x1 - e->x0;
        const int x = e->x0 + pixel % wide, y = e->y0 + pixel / wide;
        const struct block b = block_of(t->points, _mm512_load_si512(&e->set[i]), _mm512_load_si512(&e->index[i]), 0);
        const V px = S(film->crop_x + x) + number(b, IMP_DIM_PIXEL_X), py = S(film->crop_y + y) + number(b, IMP_DIM_PIXEL_Y);
        _mm512_storeu_pd(&e->px[i], px);
        _mm512_storeu_pd(&e->py[i], py);
        const V vx = S(c->film.x0) + px * S(c->film.dx), vy = S(c->film.y0) + py * S(c->film.dy), vz = S(1);
        const double inv_z = 1 / 1.0;
        const V3 d = {S(m[0]) * vx + S(m[1]) * vy + S(m[2]) * vz, S(m[4]) * vx + S(m[5]) * vy + S(m[6]) * vz,
                      S(m[8]) * vx + S(m[9]) * vy + S(m[10]) * vz};
        const V len = length(d);
        const V s = S(near * inv_z);
        const V qx = S(0) + vx * s, qy = S(0) + vy * s, qz = S(0) + vz * s;
        const V3 o = {S(m[0]) * qx + S(m[1]) * qy + S(m[2]) * qz + S(m[3]), S(m[4]) * qx + S(m[5]) * qy + S(m[6]) * qz + S(m[7]),
                      S(m[8]) * qx + S(m[9]) * qy + S(m[10]) * qz + S(m[11])};
        const I id = _mm512_set_epi64(i + 7, i + 6, i + 5, i + 4, i + 3, i + 2, i + 1, i);
        cols_store(w, i, o, scale(d, 1 / len), S((far - near) * inv_z) * len, o, S(0), v3(S(1), S(1), S(1)), id, id);
    }
}

/* ---- rays ---- */
#define LD(w, c, i) _mm512_loadu_pd(&(w)->c[i])
#define TIE (4 * 0x1p-24)

/* Spheres: all of x->balls. Returns who is met nearer than *tmax. */
INL M balls_met(const struct plan *p, V3 o, V3 d, V *tmax, M on, int shape[8], bool any)
{
    const struct imp_shape_balls *f = &p->x->balls;
    M met = 0;
    for (int j = 0; j < f->n; j++) {
        const int g = j / 4, k = j % 4;
        const V x = S(f->x[g][k]) - o.x, y = S(f->y[g][k]) - o.y, z = S(f->z[g][k]) - o.z;
        const V b0 = x * d.x + y * d.y + z * d.z, a = dot(d, d);
        const V out = (x * x + y * y + z * z) * S(1 - 1e-14) - S(f->r2[g][k]);
        const M near = GE(b0 * b0, out * a) & (GE(b0, S(0)) | LE(out, S(0))) & on;
        if (!near) continue;
        const struct sphere *s = f->shape[j]->self;
        const V3 oc = sub(o, bc(s->center));
        const V b = -dot(oc, d);
        const V3 l = add(oc, scale(d, b / a));
        const V r2 = S(s->radius * s->radius), e = r2 - dot(l, l);
        const M in = GE(e, S(0)) & near;
        if (!in) continue;
        const V cc = dot(oc, oc) - r2;
        const V q = b + copysignv(SQRT(a * e), b);
        const V ta = q / a, tb = SEL(_mm512_cmp_pd_mask(q, S(0), _CMP_NEQ_UQ), cc / q, ta);
        const V t0 = MINV(ta, tb), t1 = MAXV(ta, tb);
        const V t = SEL(GT(t0, S(0)), t0, t1);
        const M hit = GT(t, S(0)) & LT(t, *tmax) & in;
        met |= hit;
        if (any) continue;
        *tmax = SEL(hit, t, *tmax);
        for (M left = hit; left; left &= (M)(left - 1)) shape[__builtin_ctz(left)] = f->shape[j]->index;
    }
    return met;
}

typedef __m256 F;
#define FS(c) _mm256_set1_ps(c)
/* Eight rays in float about the facets' centre. comes: those that may meet something; far: those
 * that start far away, one by one. */
struct rays8 {
    F o[3], d[3], lo, hi, stretch, least;
    M comes, far;
    V3 from;
};
INL struct rays8 rays8_of(const struct imp_facets *f, V3 o, V3 d, V tmax, M on)
{
    struct rays8 r;
    r.from = sub(o, bc(f->centre));
    const V3 half = bc(f->half), near = bc(f->near);
    const V ax = ABS(r.from.x) - half.x, ay = ABS(r.from.y) - half.y, az = ABS(r.from.z) - half.z;
    const V len = (ABS(d.x) + ABS(d.y)) + ABS(d.z);
    const V zero = S(0);
    const M away = (GT(ax, zero) & GT(r.from.x * d.x, zero)) | (GT(ay, zero) & GT(r.from.y * d.y, zero)) |
                   (GT(az, zero) & GT(r.from.z * d.z, zero));
    r.far = (GT(ax, near.x) | GT(ay, near.y) | GT(az, near.z)) & ~away & on;
    r.comes = on & ~away & ~r.far;
    r.o[0] = _mm512_cvtpd_ps(r.from.x);
    r.o[1] = _mm512_cvtpd_ps(r.from.y);
    r.o[2] = _mm512_cvtpd_ps(r.from.z);
    r.d[0] = _mm512_cvtpd_ps(d.x);
    r.d[1] = _mm512_cvtpd_ps(d.y);
    r.d[2] = _mm512_cvtpd_ps(d.z);
    r.lo = FS(0);
    r.hi = _mm512_cvtpd_ps(tmax);
    r.stretch = _mm512_cvtpd_ps(len);
    r.least = _mm512_cvtpd_ps(len * S(0x1p-23));
    return r;
}
#define FABS(a) _mm256_andnot_ps(FS(-0.0f), a)
INL M facet8(const struct group *g, int k, const struct rays8 *r, F slack, F *t, F *sum)
{
#define B(c) FS(g->c[k])
    const F nd = B(n[0]) * r->d[0] + B(n[1]) * r->d[1] + B(n[2]) * r->d[2];
    const M small = _mm256_cmp_ps_mask(FABS(nd), r->least, _CMP_LT_OQ);
    const F inv = FS(-1) / _mm256_mask_blend_ps(small, nd, r->least);
    const F size = FABS(inv), aside = r->stretch * size * B(slack);
    const F far = size * slack, side = 1 + aside;
    *t = (B(n[0]) * r->o[0] + B(n[1]) * r->o[1] + B(n[2]) * r->o[2] + B(n[3])) * inv;
    const F x = r->o[0] + *t * r->d[0], y = r->o[1] + *t * r->d[1], z = r->o[2] + *t * r->d[2];
    const F u = B(u[0]) * x + B(u[1]) * y + B(u[2]) * z + B(u[3]);
    const F v = B(v[0]) * x + B(v[1]) * y + B(v[2]) * z + B(v[3]);
    *sum = u + v;
    return _mm256_cmp_ps_mask(FABS(u), side, _CMP_LE_OQ) & _mm256_cmp_ps_mask(FABS(v), side, _CMP_LE_OQ) &
           _mm256_cmp_ps_mask(*sum, B(sum) + aside, _CMP_LE_OQ) & _mm256_cmp_ps_mask(*t, r->lo - far, _CMP_GT_OQ) &
           _mm256_cmp_ps_mask(*t, r->hi + 4 * far, _CMP_LT_OQ);
#undef B
}
#define OVERLAP 1e-10
INL M tri_test(V3 off, V3 step, V tmin, V tmax, M on, V *t, V *u, V *v)
{
    const V tt = -off.x / step.x;
    const V pu = off.y + tt * step.y, pv = off.z + tt * step.z;
    const M m = GT(tt, tmin) & LT(tt, tmax) & GE(pu, S(-OVERLAP)) & GE(pv, S(-OVERLAP)) & LE(pu + pv, S(1 + OVERLAP)) & on;
    *t = tt;
    const V uu = MAXV(MINV(pu, S(1)), S(0));
    *u = uu;
    *v = MAXV(MINV(pv, 1 - uu), S(0));
    return m;
}
INL M tri_gather(I addr, const struct rays8 *r, V3 d, V tmax, M on, V *t, V *u, V *v)
{
    const V3 from = r->from;
#define G(col, k) _mm512_mask_i64gather_pd(S(0), on, addr, (const char *)0 + offsetof(struct triangle, col) + 8 * (k), 1)
    const V xn = G(x, 0), xu = G(x, 1), xv = G(x, 2), yn = G(y, 0), yu = G(y, 1), yv = G(y, 2), zn = G(z, 0), zu = G(z, 1),
            zv = G(z, 2), on_ = G(one, 0), ou = G(one, 1), ov = G(one, 2);
#undef G
    const V3 off = {(xn * from.x + yn * from.y) + (zn * from.z + on_), (xu * from.x + yu * from.y) + (zu * from.z + ou),
                    (xv * from.x + yv * from.y) + (zv * from.z + ov)};
    const V3 step = {(xn * d.x + yn * d.y) + zn * d.z, (xu * d.x + yu * d.y) + zu * d.z, (xv * d.x + yv * d.y) + zv * d.z};
    return tri_test(off, step, S(0), tmax, on, t, u, v);
}
INL M tri_one(const struct triangle *s, const struct rays8 *r, V3 d, V tmax, M on)
{
    const V3 from = r->from;
    V t, u, v;
#define O(k) (S(s->x[k]) * from.x + S(s->y[k]) * from.y) + (S(s->z[k]) * from.z + S(s->one[k]))
#define D(k) (S(s->x[k]) * d.x + S(s->y[k]) * d.y) + S(s->z[k]) * d.z
    return tri_test(v3(O(0), O(1), O(2)), v3(D(0), D(1), D(2)), S(0), tmax, on, &t, &u, &v);
#undef O
#undef D
}

INL M on_of(int left) { return left >= 8 ? 0xff : (M)((1u << left) - 1); }

static void facets_nearest8(const struct imp_facets *f, struct wave *w, int i, M on, V3 o, V3 d, V *tmax)
{
    struct rays8 r = rays8_of(f, o, d, *tmax, on);
    F best = FS(INFINITY), half = FS(0);
    __m256i in = _mm256_setzero_si256();
    const F slack = FS(f->slack);
    for (int g = 0; g < f->n_groups; g++)
        for (int k = 0; k < LANES; k++) {
            F t, sum;
            if (!(f->group[g].slack[k] > 0)) break; /* empty places come last */
            const M m = facet8(&f->group[g], k, &r, slack, &t, &sum) & _mm256_cmp_ps_mask(t, best, _CMP_LT_OQ);
            best = _mm256_mask_blend_ps(m, best, t);
            in = _mm256_mask_blend_epi32(m, in, _mm256_set1_epi32(LANES * g + k));
            half = _mm256_mask_blend_ps(m, half, sum);
        }
    const M some = _mm256_cmp_ps_mask(best, FS(INFINITY), _CMP_LT_OQ) & r.comes;
    const M second = _mm256_cmp_ps_mask(half, FS(0), _CMP_GT_OQ);
    I addr = _mm512_cvtepi32_epi64(in) * (long long)sizeof(struct triangle[2]) + (long long)(intptr_t)f->facet;
    const I one = _mm512_set1_epi64(sizeof(struct triangle));
    I first = _mm512_mask_add_epi64(addr, second, addr, one);
    V t, u, v;
    M met = tri_gather(first, &r, d, *tmax, some, &t, &u, &v);
    I which = first;
    if (some & ~met) {
        V t2, u2, v2;
        const I other = _mm512_mask_add_epi64(addr, (M)~second, addr, one);
        const M m2 = tri_gather(other, &r, d, *tmax, some & ~met, &t2, &u2, &v2);
        t = SEL(m2, t2, t);
        u = SEL(m2, u2, u);
        v = SEL(m2, v2, v);
        which = _mm512_mask_blend_epi64(m2, which, other);
        met |= m2;
    }
    _mm512_mask_storeu_pd(&w->t[i], met, t);
    _mm512_mask_storeu_pd(&w->u[i], met, u);
    _mm512_mask_storeu_pd(&w->v[i], met, v);
    _mm256_mask_storeu_epi32(&w->shape[i], met, _mm512_mask_i64gather_epi32(_mm256_setzero_si256(), met, which, (const char *)0 + offsetof(struct triangle, shape), 1));
    _mm256_mask_storeu_epi32(&w->prim[i], met, _mm512_mask_i64gather_epi32(_mm256_setzero_si256(), met, which, (const char *)0 + offsetof(struct triangle, prim), 1));
    double tm[8];
    _mm512_storeu_pd(tm, *tmax);
    for (M left = (M)((some & ~met) | r.far); left; left &= (M)(left - 1)) {
        const int k = __builtin_ctz(left);
        struct imp_hit hit;
        const imp_v3 oo = {w->ox[i + k], w->oy[i + k], w->oz[i + k], 0}, dd = {w->dx[i + k], w->dy[i + k], w->dz[i + k], 0};
        if (!imp__facets_nearest(f, &oo, &dd, 0, tm[k], &hit)) continue;
        w->t[i + k] = hit.t;
        w->u[i + k] = hit.u;
        w->v[i + k] = hit.v;
        w->shape[i + k] = hit.shape;
        w->prim[i + k] = hit.prim;
        met |= (M)(1u << k);
    }
}

INL V triangle_far(V3 o, V3 d, V t)
{
    const V a = (ABS(o.x) + ABS(o.y)) + ABS(o.z), b = (ABS(d.x) + ABS(d.y)) + ABS(d.z);
    return _mm512_cvtps_pd(_mm512_cvtpd_ps(t - S(TIE) * (t + a / b)));
}

static void intersect(const struct plan *p, struct wave *w)
{
    const struct imp_intersector *x = p->x;
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (int i = 0; i < w->n; i += 8) {
        const M all = on_of(w->n - i);
        const V3 o = {LD(w, ox, i), LD(w, oy, i), LD(w, oz, i)}, d = {LD(w, dx, i), LD(w, dy, i), LD(w, dz, i)};
        V tmax = LD(w, tmax, i);
        const V size = ((ABS(o.x) + ABS(d.x)) + (ABS(o.y) + ABS(d.y))) + (ABS(o.z) + ABS(d.z));
        const M on = LT(size, S(IMP_REACH_MAX)) & GT(tmax, S(0)) & all;
        _mm256_storeu_si256((void *)&w->shape[i], _mm256_set1_epi32(-1));
        M met = 0;
        if (x->balls.n) {
            met = balls_met(p, o, d, &tmax, on, &w->shape[i], false);
            if (met) {
                _mm512_mask_storeu_pd(&w->t[i], met, tmax);
                tmax = SEL(met, triangle_far(o, d, tmax), tmax);
            }
        }
        if (x->facets) facets_nearest8(x->facets, w, i, on, o, d, &tmax);
        if (!x->holds) continue;
        struct RTCRayHit8 r;
        int valid[8] __attribute__((aligned(32)));
        _mm256_store_si256((void *)valid, _mm256_maskz_set1_epi32(on, -1));
#define PS(c, v) _mm256_store_ps(r.c, v)
        PS(ray.org_x, _mm512_cvtpd_ps(o.x)); PS(ray.org_y, _mm512_cvtpd_ps(o.y)); PS(ray.org_z, _mm512_cvtpd_ps(o.z));
        PS(ray.dir_x, _mm512_cvtpd_ps(d.x)); PS(ray.dir_y, _mm512_cvtpd_ps(d.y)); PS(ray.dir_z, _mm512_cvtpd_ps(d.z));
        PS(ray.tnear, FS(0)); PS(ray.time, FS(0)); PS(ray.tfar, _mm512_cvtpd_ps(tmax));
        memset(r.ray.mask, 0xff, sizeof r.ray.mask);
        memset(r.ray.id, 0, sizeof r.ray.id);
        memset(r.ray.flags, 0, sizeof r.ray.flags);
        memset(r.hit.geomID, 0xff, sizeof r.hit.geomID);
        memset(r.hit.instID, 0xff, sizeof r.hit.instID);
        rtcIntersect8(valid, x->rtc, &context, &r);
        const __m256i geom = _mm256_load_si256((const void *)r.hit.geomID);
        const M tri = _mm256_cmpneq_epi32_mask(geom, _mm256_set1_epi32(-1)) & on;
        _mm256_mask_storeu_epi32(&w->shape[i], tri, _mm256_add_epi32(geom, _mm256_set1_epi32(x->first)));
        _mm256_mask_storeu_epi32(&w->prim[i], tri, _mm256_load_si256((const void *)r.hit.primID));
        _mm512_mask_storeu_pd(&w->t[i], tri, _mm512_cvtps_pd(_mm256_load_ps(r.ray.tfar)));
        _mm512_mask_storeu_pd(&w->u[i], tri, _mm512_cvtps_pd(_mm256_load_ps(r.hit.u)));
        _mm512_mask_storeu_pd(&w->v[i], tri, _mm512_cvtps_pd(_mm256_load_ps(r.hit.v)));
    }
}

static void occlude(const struct plan *p, struct shadows *w, struct values *val)
{
    const struct imp_intersector *x = p->x;
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (int i = 0; i < w->n; i += 8) {
        const M all = on_of(w->n - i);
        const V3 o = {LD(w, ox, i), LD(w, oy, i), LD(w, oz, i)}, d = {LD(w, dx, i), LD(w, dy, i), LD(w, dz, i)};
        V tmax = LD(w, reach, i);
        const V size = ((ABS(o.x) + ABS(d.x)) + (ABS(o.y) + ABS(d.y))) + (ABS(o.z) + ABS(d.z));
        M on = LT(size, S(IMP_REACH_MAX)) & all;
        M hidden = x->balls.n ? balls_met(p, o, d, &tmax, on, NULL, true) : 0;
        if (x->facets) {
            const struct imp_facets *f = x->facets;
            const struct rays8 r = rays8_of(f, o, d, tmax, on & ~hidden);
            const F slack = FS(f->slack);
            M left = r.comes;
            for (int g = 0; g < f->n_groups && left; g++)
                for (int k = 0; k < LANES && left; k++) {
                    F t, sum;
                    if (!(f->group[g].slack[k] > 0)) break;
                    const M m = facet8(&f->group[g], k, &r, slack, &t, &sum) & left;
                    if (!m) continue;
                    const struct triangle *tri = f->facet[LANES * g + k];
                    M met = tri_one(&tri[0], &r, d, tmax, m);
                    if (m & ~met) met |= tri_one(&tri[1], &r, d, tmax, m & ~met);
                    hidden |= met;
                    left &= ~met;
                }
            for (M far = r.far; far; far &= (M)(far - 1)) {
                const int k = __builtin_ctz(far);
                const imp_v3 oo = {w->ox[i + k], w->oy[i + k], w->oz[i + k], 0}, dd = {w->dx[i + k], w->dy[i + k], w->dz[i + k], 0};
                if (imp__facets_occluded(f, &oo, &dd, 0, w->reach[i + k])) hidden |= (M)(1u << k);
            }
        }
        if (x->holds && (on & ~hidden)) {
            struct RTCRay8 r;
            int valid[8] __attribute__((aligned(32)));
            _mm256_store_si256((void *)valid, _mm256_maskz_set1_epi32(on & ~hidden, -1));
            PS(org_x, _mm512_cvtpd_ps(o.x)); PS(org_y, _mm512_cvtpd_ps(o.y)); PS(org_z, _mm512_cvtpd_ps(o.z));
            PS(dir_x, _mm512_cvtpd_ps(d.x)); PS(dir_y, _mm512_cvtpd_ps(d.y)); PS(dir_z, _mm512_cvtpd_ps(d.z));
            PS(tnear, FS(0)); PS(time, FS(0)); PS(tfar, _mm512_cvtpd_ps(tmax));
            memset(r.mask, 0xff, sizeof r.mask);
            memset(r.id, 0, sizeof r.id);
            memset(r.flags, 0, sizeof r.flags);
            rtcOccluded8(valid, x->rtc, &context, &r);
            hidden |= _mm256_cmp_ps_mask(_mm256_load_ps(r.tfar), FS(0), _CMP_LT_OQ) & on & ~hidden;
        }
        for (M h = hidden & all; h; h &= (M)(h - 1)) {
            const int64_t at = w->at[i + __builtin_ctz(h)];
            val->bx[at] = val->by[at] = val->bz[at] = 0;
        }
    }
}

/* ---- a vertex ---- */
struct surface8 {
    V3 p, ng, n, s, t;
    V u, v; /* as decided */
};
INL void frame_of(struct surface8 *x, V3 dp_du)
{
    const V dn = dot(x->n, dp_du);
    const V3 s = sub(dp_du, scale(x->n, dn));
    const V l2 = dot(s, s);
    const M good = GT(l2, S(1e-20) * dot(dp_du, dp_du));
    x->s = scale(s, 1 / SQRT(l2));
    x->t = cross(x->n, x->s);
    if (imp_likely(good == 0xff)) return;
    const V sign = copysignv(S(1), x->n.z), a = S(-1) / (sign + x->n.z), b = x->n.x * x->n.y * a;
    const V3 fs = {S(1) + sign * x->n.x * x->n.x * a, sign * b, -sign * x->n.x},
             ft = {b, sign + x->n.y * x->n.y * a, -x->n.y};
    x->s = sel3(good, x->s, fs);
    x->t = sel3(good, x->t, ft);
}
#define GF(base, idx, off) _mm512_cvtps_pd(_mm256_i32gather_ps((base) + (off), idx, 4))
INL V3 load3(const float *a, __m256i i3) { return (V3){GF(a, i3, 0), GF(a, i3, 1), GF(a, i3, 2)}; }

INL V3 facet_v3(I addr, size_t off)
{
    return (V3){_mm512_i64gather_pd(addr, (const char *)0 + off, 1), _mm512_i64gather_pd(addr, (const char *)0 + off + 8, 1),
                _mm512_i64gather_pd(addr, (const char *)0 + off + 16, 1)};
}

INL void surface_of(const struct plan *p, const struct item *m, const enum surf surf, V3 o, V3 d, V t, V hu, V hv, __m256i prim,
                    __m256i shape, struct surface8 *x)
{
    if (surf == RECT) {
        const struct rectangle *r = m->shape->self;
        const V sum = hu + hv;
        const M zero = _mm256_cmpeq_epi32_mask(prim, _mm256_setzero_si256());
        const V u = SEL(zero, sum, hu), v = SEL(zero, hv, sum);
        x->p = add(add(bc(r->corner), scale(bc(r->eu), u)), scale(bc(r->ev), v));
        x->ng = x->n = bc(r->n);
        x->s = bc(r->s);
        x->t = bc(r->t);
        x->u = decide(u);
        x->v = decide(v);
    } else if (surf == SPHERE) {
        const struct sphere *s = m->shape->self;
        const V3 out = normalize(sub(add(o, scale(d, t)), bc(s->center)));
        const V3 q = {dot(out, bc(s->axes.s)), dot(out, bc(s->axes.t)), dot(out, bc(s->axes.n))};
        x->p = add(bc(s->center), scale(out, S(s->radius)));
        x->ng = x->n = scale(out, S(s->side));
        const V3 w = add(add(scale(bc(s->axes.s), -q.y), scale(bc(s->axes.t), q.x)), scale(bc(s->axes.n), S(0)));
        frame_of(x, scale(w, S(IMP_2PI * s->radius)));
    } else if (surf == MESH_A) {
        const struct imp__mesh *h = m->mesh;
        const __m256i three = _mm256_set1_epi32(3), p3 = _mm256_mullo_epi32(prim, three);
        const __m256i i0 = _mm256_mullo_epi32(_mm256_i32gather_epi32((const int *)h->indices, p3, 4), three),
                      i1 = _mm256_mullo_epi32(_mm256_i32gather_epi32((const int *)h->indices + 1, p3, 4), three),
                      i2 = _mm256_mullo_epi32(_mm256_i32gather_epi32((const int *)h->indices + 2, p3, 4), three);
        const V3 p0 = load3(h->positions, i0), e1 = sub(load3(h->positions, i1), p0), e2 = sub(load3(h->positions, i2), p0);
        const V3 c = cross(e1, e2);
        const V len = length(c);
        x->ng = sel3(GT(len, S(0)), scale(c, 1 / len), v3(S(0), S(0), S(1)));
        const V b0 = 1 - hu - hv;
        x->p = add(add(p0, scale(e1, hu)), scale(e2, hv));
        const V3 n = add(add(scale(load3(h->normals, i0), b0), scale(load3(h->normals, i1), hu)), scale(load3(h->normals, i2), hv));
        const V l = length(n);
        x->n = sel3(GT(l, S(1e-6)), scale(n, 1 / l), x->ng);
        frame_of(x, h->reversed ? e2 : e1);
    } else {
        I base;
        if (surf == MESH_F)
            base = _mm512_i32gather_epi64(shape, p->facets_of, 8);
        else base = _mm512_set1_epi64((int64_t)(intptr_t)m->mesh->facets);
        const I addr = base + _mm512_cvtepi32_epi64(prim) * (long long)sizeof(struct imp__facet);
#define FC(c) facet_v3(addr, offsetof(struct imp__facet, c))
        x->p = add(add(FC(p0), scale(FC(e1), hu)), scale(FC(e2), hv));
        x->ng = FC(ng);
        if (surf == MESH_F) {
            x->n = x->ng;
            x->s = FC(s);
            x->t = FC(t);
        } else {
            const struct imp__mesh *h = m->mesh;
            const __m256i three = _mm256_set1_epi32(3), p3 = _mm256_mullo_epi32(prim, three);
            const __m256i i0 = _mm256_mullo_epi32(_mm256_i32gather_epi32((const int *)h->indices, p3, 4), three),
                          i1 = _mm256_mullo_epi32(_mm256_i32gather_epi32((const int *)h->indices + 1, p3, 4), three),
                          i2 = _mm256_mullo_epi32(_mm256_i32gather_epi32((const int *)h->indices + 2, p3, 4), three);
            const V b0 = 1 - hu - hv;
            const V3 n = add(add(scale(load3(h->normals, i0), b0), scale(load3(h->normals, i1), hu)), scale(load3(h->normals, i2), hv));
            const V l = length(n);
            x->n = sel3(GT(l, S(1e-6)), scale(n, 1 / l), x->ng);
            frame_of(x, FC(dp_du));
        }
    }
}

INL V area_to_angle(V3 ref, V3 p, V3 ng, V inv_area)
{
    const V3 d = sub(p, ref);
    const V r2 = dot(d, d), c = ABS(dot(d, ng)), r = SQRT(r2);
    return SEL(GT(c, S(IMP_GRAZING) * r), r2 * r * inv_area / c, S(0));
}
INL double inv_area_of(const struct imp_shape *s)
{
    return s->ops == &imp__rectangle ? ((const struct rectangle *)s->self)->inv_area : ((const struct imp__mesh *)s->self)->inv_area;
}

struct light8 {
    V3 wi, p;
    V pdf, cos_light, pmf;
    M ok, far;
};
INL V light_pmf_of(const struct imp_scene *s, int k) { return S(s->light_cdf[k] - (k ? s->light_cdf[k - 1] : 0)); }

INL V3 sphere_uniform(V u0, V u1)
{
    const V z = 1 - 2 * u0, r = SQRT(MAXV(S(0), 1 - z * z));
    const V four = 4 * u1, quarter = _mm512_cvtepi64_pd(_mm512_cvttpd_epi64(four + SEL(LT(four, S(0)), S(-0.5), S(0.5))));
    const V x = (four - quarter) * S(1.57079632679489661923);
    const V zz = x * x, z2 = zz * zz, z4 = z2 * z2;
    const V ps = (-1. / 6 + zz * (1. / 120)) + z2 * (-1. / 5040 + zz * (1. / 362880));
    const V qs = (-1. / 39916800 + zz * (1. / 6227020800)) - z2 * (1. / 1307674368000);
    const V a = x + x * (zz * (ps + z4 * qs));
    const V pc = (1. / 24 + zz * (-1. / 720)) + z2 * (1. / 40320 + zz * (-1. / 3628800));
    const V qc = (1. / 479001600 + zz * (-1. / 87178291200)) + z2 * (1. / 20922789888000);
    const V b = 1 + (zz * -0.5 + z2 * (pc + z4 * qc));
    const I quad = _mm512_cvttpd_epi64(quarter) & _mm512_set1_epi64(3);
    const M odd = _mm512_test_epi64_mask(quad, _mm512_set1_epi64(1)), high = _mm512_test_epi64_mask(quad, _mm512_set1_epi64(2));
    const V sn = SEL(odd, b, a), cs = SEL(odd, a, b);
    /* 0: a, b; 1: b, -a; 2: -a, -b; 3: -b, a */
    const V s = SEL(high, -sn, sn), c = SEL((M)(odd ^ high), -cs, cs);
    return (V3){r * c, r * s, z};
}
INL V sin8(V x)
{
    const V z = x * x, z2 = z * z, z4 = z2 * z2;
    const V p = (-1. / 6 + z * (1. / 120)) + z2 * (-1. / 5040 + z * (1. / 362880));
    const V q = (-1. / 39916800 + z * (1. / 6227020800)) - z2 * (1. / 1307674368000);
    return x + x * (z * (p + z4 * q));
}
INL V cos8(V x)
{
    const V z = x * x, z2 = z * z, z4 = z2 * z2;
    const V p = (1. / 24 + z * (-1. / 720)) + z2 * (1. / 40320 + z * (-1. / 3628800));
    const V q = (1. / 479001600 + z * (-1. / 87178291200)) + z2 * (1. / 20922789888000);
    return 1 + (z * -0.5 + z2 * (p + z4 * q));
}

INL struct light8 light_of(const struct plan *p, V3 ref, V u0, V u1)
{
    struct light8 l = {.ok = 0xff, .far = 0};
    const struct imp_scene *sc = p->scene;
    M sky;
    if (p->n_emitters == 1) {
        sky = p->sky == 0 ? 0xff : 0;
        l.pmf = S(sc->light_cdf[0]);
    } else {
        const M first = LT(u0, S(sc->light_cdf[0]));
        l.pmf = SEL(first, light_pmf_of(sc, 0), light_pmf_of(sc, 1));
        const V below = SEL(first, S(0), S(sc->light_cdf[0]));
        u0 = MAXV(MINV((u0 - below) / l.pmf, S(0x1.fffffffffffffp-1)), S(0));
        sky = p->sky == 0 ? first : (M)~first;
        l.ok = GT(l.pmf, S(0));
    }
    if (p->lamp >= 0) {
        const struct imp_shape *h = sc->emitters[p->lamp]->shape;
        V3 q, ng, n;
        double inv;
        if (h->ops == &imp__rectangle) {
            const struct rectangle *r = h->self;
            q = add(add(bc(r->corner), scale(bc(r->eu), u0)), scale(bc(r->ev), u1));
            ng = n = bc(r->n);
            inv = r->inv_area;
        } else { /* a mesh of two triangles, with facets */
            const struct imp__mesh *m = h->self;
            const double *c = m->cumulative;
            const V xx = u0 * S(h->area);
            const M first = GT(S(c[1]), xx);
            const V within0 = SEL(first, xx, xx - S(c[1])) / SEL(first, S(c[1]), S(c[2] - c[1]));
            const V within = MINV(MAXV(within0, S(0)), S(0x1.fffffffffffffp-1));
            const V half = S(0.5) * MINV(within, u1);
            const V b1 = within - half, b2 = u1 - half;
            const struct imp__facet *f = m->facets;
#define PICK(fld) sel3(first, bc(f[0].fld), bc(f[1].fld))
            q = add(add(PICK(p0), scale(PICK(e1), b1)), scale(PICK(e2), b2));
            ng = n = PICK(ng);
            inv = m->inv_area;
            if (m->normals) {
                const V b0 = 1 - b1 - b2;
                V3 nn[3];
                for (int k = 0; k < 3; k++) {
                    const float *a = m->normals + 3 * m->indices[k], *b = m->normals + 3 * m->indices[3 + k];
                    nn[k] = v3(SEL(first, S(a[0]), S(b[0])), SEL(first, S(a[1]), S(b[1])), SEL(first, S(a[2]), S(b[2])));
                }
                const V3 s = add(add(scale(nn[0], b0), scale(nn[1], b1)), scale(nn[2], b2));
                const V len = length(s);
                n = sel3(GT(len, S(1e-6)), scale(s, 1 / len), ng);
            }
        }
        const V3 d = sub(q, ref);
        const V r2 = dot(d, d), r = SQRT(r2), c = ABS(dot(d, ng));
        const V pdf = SEL(GT(c, S(IMP_GRAZING) * r), r2 * r * S(inv) / c, S(0));
        l.ok &= sky | (GT(pdf, S(0)) & LT(r, S(INFINITY)));
        l.wi = scale(d, 1 / r);
        l.cos_light = -dot(l.wi, n);
        l.ok &= sky | GT(l.cos_light, S(0));
        l.p = q;
        l.pdf = pdf;
    }
    if (sky) {
        const V3 w = sphere_uniform(u0, u1);
        l.wi = p->lamp >= 0 ? sel3(sky, w, l.wi) : w;
        l.pdf = p->lamp >= 0 ? SEL(sky, S(IMP_INV_PI / 4), l.pdf) : S(IMP_INV_PI / 4);
        l.cos_light = p->lamp >= 0 ? SEL(sky, S(1), l.cos_light) : S(1);
        if (p->lamp < 0) l.p = w;
    }
    l.far = sky;
    l.ok &= GT(l.pdf, S(0));
    return l;
}

/* density and value; 0 where structurally zero */
INL V ggx_g1(double au, V3 v)
{
    const V z2 = v.z * v.z, x2 = v.x * v.x / z2, y2 = v.y * v.y / z2;
    const V t2 = S(au * au) * x2 + S(au * au) * y2;
    return 2 / (1 + SQRT(1 + t2));
}
INL V fresnel(V c, V c2, V s2, double eta, double k)
{
    const double ek = eta * k;
    const V t = S(eta * eta - k * k) - s2;
    const V A = SQRT(t * t + S(4 * ek * ek));
    const M turned = LT(t, S(0));
    const V root = SQRT(SEL(turned, 2 / (A - t), S(0.5) * (A + t)));
    const V a = SEL(turned, S(ek) * root, root);
    const V P = A + c2, Q = 2 * a * c, U = A * c2 + s2 * s2, W = Q * s2;
    const V ss = P + Q, ps = U + W, rest = P - Q;
    const V Rs = SEL(GT(ss, S(0)), SEL(GT(rest, S(0)), rest, S(0)) / ss, S(1));
    const V ratio = SEL(GT(ps, S(0)), (U - W) / ps, S(1));
    return S(0.5) * Rs * (1 + ratio);
}
INL V pdf_eval(const struct item *m, const enum mat mat, V3 rho, V3 wo, V3 wi, V3 *f)
{
    const M front = GT(wo.z, S(0)) & GT(wi.z, S(0));
    if (mat != GGX) {
        const V p = SEL(front, wi.z * S(IMP_INV_PI), S(0));
        *f = scale(rho, p);
        return p;
    }
    const double au = m->alpha;
    const V3 h = normalize(add(wo, wi));
    const V x = h.x / S(au), y = h.y / S(au);
    const V z2 = h.z * h.z, s = (x * x + y * y) + z2;
    const V D = SEL(GT(h.z, S(0)), 1 / (S(IMP_PI * au * au) * s * s), S(0));
    const V Go = ggx_g1(au, wo), G = ggx_g1(au, wi) * Go;
    const V vm = dot(wo, h), c = MINV(vm, S(1)), c2 = c * c, s2 = MAXV(1 - c2, S(0));
    const V by = D * G / (4 * wo.z);
    const V3 F = {fresnel(c, c2, s2, m->eta[0], m->k[0]), fresnel(c, c2, s2, m->eta[1], m->k[1]), fresnel(c, c2, s2, m->eta[2], m->k[2])};
    *f = v3(F.x * (S(m->tint[0]) * by), F.y * (S(m->tint[1]) * by), F.z * (S(m->tint[2]) * by));
    const V pdf = SEL(GT(vm, S(0)), D * Go * vm / wo.z, S(0)) / (4 * vm);
    return SEL(front, pdf, S(0));
}
INL M sample_dir(const struct item *m, const enum mat mat, V3 wo, V u0, V u1, V3 *wi)
{
    const M up = GT(wo.z, S(0));
    if (mat != GGX) {
        const V a = 2 * u0 - 1, b = 2 * u1 - 1;
        const M wide = GT(ABS(a), ABS(b));
        const V r = SEL(wide, a, b), o = SEL(wide, b, a);
        const V x = S(IMP_PI / 4) * (o / r);
        const V s = sin8(x), c = cos8(x);
        const M origin = EQ(a, S(0)) & EQ(b, S(0));
        const V dx = SEL(origin, S(0), r * SEL(wide, c, s)), dy = SEL(origin, S(0), r * SEL(wide, s, c));
        *wi = v3(dx, dy, SQRT(MAXV(S(0), 1 - dx * dx - dy * dy)));
        return up & GT(wi->z, S(0));
    }
    const double au = m->alpha;
    const V3 w = normalize(v3(S(au) * wo.x, S(au) * wo.y, wo.z));
    const V phi = S(IMP_2PI) * u0, z = (1 - u1) * (1 + w.z) - w.z;
    const V r = SQRT(MAXV((1 - z) * (1 + z), S(0)));
    double ph[8], sn[8], cs[8];
    _mm512_storeu_pd(ph, phi);
    for (int k = 0; k < 8; k++) sincos(ph[k], &sn[k], &cs[k]);
    const V3 hh = add(v3(r * _mm512_loadu_pd(cs), r * _mm512_loadu_pd(sn), z), w);
    const V3 h = normalize(v3(S(au) * hh.x, S(au) * hh.y, MAXV(hh.z, S(0))));
    const V c = dot(wo, h);
    *wi = normalize(sub(scale(h, 2 * c), wo));
    return up & GT(c, S(0)) & GT(wi->z, S(0));
}
INL V3 to_local(const struct surface8 *x, V3 v) { return (V3){dot(v, x->s), dot(v, x->t), dot(v, x->n)}; }
INL V3 to_world(const struct surface8 *x, V3 v)
{
    return add(add(scale(x->s, v.x), scale(x->t, v.y)), scale(x->n, v.z));
}
INL V3 offset(V3 p, V3 ng, V3 d)
{
    const V sc = MAXV(ABS(p.x), MAXV(ABS(p.y), ABS(p.z)));
    return add(p, scale(ng, copysignv((1 + sc) * S(IMP_RAY_EPSILON), dot(ng, d))));
}
INL V3 rho_of(const struct plan *p, const struct item *m, const enum surf surf, const enum mat mat, const struct surface8 *x, __m256i shape)
{
    if (mat == GGX) return v3(S(0), S(0), S(0));
    if (mat == CONST && surf == MESH_F) {
        const __m256i four = _mm256_slli_epi32(shape, 2);
        return v3(_mm512_i32gather_pd(four, &p->rho_of[0][0], 8), _mm512_i32gather_pd(four, &p->rho_of[0][1], 8),
                  _mm512_i32gather_pd(four, &p->rho_of[0][2], 8));
    }
    if (mat == CONST) return v3(S(m->rho[0]), S(m->rho[1]), S(m->rho[2]));
    if (mat == CHECKER) {
        const struct imp__to_uv *t = &m->to_uv;
        const V u = S(t->m[0][0]) * x->u + S(t->m[0][1]) * x->v + S(t->m[0][2]);
        const V v = S(t->m[1][0]) * x->u + S(t->m[1][1]) * x->v + S(t->m[1][2]);
        const M bx = GT(u - _mm512_floor_pd(u), S(0.5)), by = GT(v - _mm512_floor_pd(v), S(0.5));
        const M second = (M) ~(bx ^ by) == 0 ? 0 : (M) ~(bx ^ by); /* input[(bx == by) == false] */
        return v3(SEL(second, S(m->check[0][0]), S(m->check[1][0])), SEL(second, S(m->check[0][1]), S(m->check[1][1])),
                  SEL(second, S(m->check[0][2]), S(m->check[1][2])));
    }
    const struct imp__texels *t = &m->texels;
    V u = x->u - _mm512_floor_pd(x->u), v = x->v - _mm512_floor_pd(x->v);
    u = SEL(GE(u, S(-1)) & LE(u, S(2)), u, S(0));
    v = SEL(GE(v, S(-1)) & LE(v, S(2)), v, S(0));
    const V xx = u * S(t->width) - S(0.5), yy = v * S(t->height) - S(0.5);
    const V fx = _mm512_floor_pd(xx), fy = _mm512_floor_pd(yy);
    const V a = xx - fx, b = yy - fy;
    const __m256i W = _mm256_set1_epi32(t->width), H = _mm256_set1_epi32(t->height);
#define WRAP(i, n) ({ __m256i i_ = (i); i_ = _mm256_mask_add_epi32(i_, _mm256_cmplt_epi32_mask(i_, _mm256_setzero_si256()), i_, n); \
        _mm256_mask_sub_epi32(i_, _mm256_cmpge_epi32_mask(i_, n), i_, n); })
    const __m256i x0 = _mm512_cvttpd_epi32(fx), y0 = _mm512_cvttpd_epi32(fy), one = _mm256_set1_epi32(1);
    const __m256i xs[2] = {WRAP(x0, W), WRAP(_mm256_add_epi32(x0, one), W)};
    const __m256i ys[2] = {_mm256_mullo_epi32(W, WRAP(y0, H)), _mm256_mullo_epi32(W, WRAP(_mm256_add_epi32(y0, one), H))};
    const V weight[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
    V3 sum = v3(S(0), S(0), S(0));
    for (int k = 0; k < 4; k++) {
        const __m256i i3 = _mm256_mullo_epi32(_mm256_add_epi32(ys[k / 2], xs[k % 2]), _mm256_set1_epi32(3));
        sum = add(sum, scale(load3(t->data, i3), weight[k]));
    }
    return sum;
}

#define COMP(dst, m, v) _mm512_storeu_pd(dst, _mm512_maskz_compress_pd(m, v))
#define COMPI(dst, m, v) _mm512_storeu_si512(dst, _mm512_maskz_compress_epi64(m, v))

/* Eight vertices at positions pos.. of this depth. */
INL void shade(struct engine *e, const struct item *m, const enum surf surf, const enum mat mat, const struct wave *w,
               struct wave *next, struct values *val, const int *order, int pos, M on, int depth)
{
    const struct plan *p = &e->plan;
    const __m256i at = _mm256_loadu_si256((const void *)order);
#define GD(c) _mm512_i32gather_pd(at, w->c, 8)
    const V3 o = surf == SPHERE ? v3(GD(ox), GD(oy), GD(oz)) : v3(S(0), S(0), S(0)), d = {GD(dx), GD(dy), GD(dz)};
    const V t = surf == SPHERE ? GD(t) : S(0), hu = surf == SPHERE ? S(0) : GD(u), hv = surf == SPHERE ? S(0) : GD(v);
    const __m256i prim = surf == SPHERE ? _mm256_setzero_si256() : _mm256_i32gather_epi32(w->prim, at, 4);
    const __m256i shape = surf == MESH_F ? _mm256_i32gather_epi32(w->shape, at, 4) : at;
    const I walk = _mm512_i32gather_epi64(at, w->walk, 8), parent = _mm512_i32gather_epi64(at, w->parent, 8);
    _mm512_storeu_si512(&val->parent[pos], parent);
    struct surface8 x;
    surface_of(p, m, surf, o, d, t, hu, hv, prim, shape, &x);

    /* emission */
    V3 em = v3(S(0), S(0), S(0));
    if (m->emitter >= 0) {
        const V cos_light = decide(-dot(x.n, d)), pdf = GD(pdf);
        const V3 from = {GD(fx), GD(fy), GD(fz)};
        const double factor = p->scene->light_cdf[m->emitter] - (m->emitter ? p->scene->light_cdf[m->emitter - 1] : 0);
        const V pe = S(factor) * area_to_angle(from, x.p, x.ng, S(inv_area_of(m->shape)));
        const V a2 = pdf * pdf, b2 = pe * pe;
        const V weight = SEL(GT(pdf, S(0)), decide(1 * SEL(GT(a2, S(0)), a2 / (a2 + b2), S(0))), S(1));
        const M lit = GT(cos_light, S(0));
        const double *le = p->le[m->emitter];
        em = v3(SEL(lit, S(le[0]), S(0)) * weight, SEL(lit, S(le[1]), S(0)) * weight, SEL(lit, S(le[2]), S(0)) * weight);
    }
#define STV(c, v) _mm512_storeu_pd(&val->c[pos], v)
    STV(ex, em.x); STV(ey, em.y); STV(ez, em.z);
    STV(lx, S(0)); STV(ly, S(0)); STV(lz, S(0));
    if (depth + 1 >= p->max_depth || m->black) {
        STV(wx, S(0)); STV(wy, S(0)); STV(wz, S(0)); STV(bx, S(0)); STV(by, S(0)); STV(bz, S(0));
        return;
    }

    /* numbers */
    const struct block b = block_of(p->tracer->points, _mm512_i64gather_epi64(walk, e->set, 8), _mm512_i64gather_epi64(walk, e->index, 8),
                                    imp__block(depth));
    const V3 rho = rho_of(p, m, surf, mat, &x, shape);
    const V3 wo_drawn = to_local(&x, neg(d)), wo = decide3(wo_drawn);

    /* the light */
    const struct light8 l = light_of(p, x.p, number(b, 4), number(b, 5));
    V3 f;
    const V3 wl = decide3(to_local(&x, l.wi));
    const V pdf_l = pdf_eval(m, mat, rho, wo, wl, &f);
    M want = l.ok & GT(pdf_l, S(0)) & on;
    {
        const V pp = l.pdf * l.pmf, a2 = pp * pp, b2 = pdf_l * pdf_l;
        const V weight = decide(SEL(GT(a2, S(0)), pp / (a2 + b2), S(0)));
        const M lit = GT(decide(l.cos_light), S(0));
        V3 le;
        if (p->lamp >= 0 && p->sky >= 0)
            le = v3(SEL(l.far, S(p->le[p->sky][0]), S(p->le[p->lamp][0])), SEL(l.far, S(p->le[p->sky][1]), S(p->le[p->lamp][1])),
                    SEL(l.far, S(p->le[p->sky][2]), S(p->le[p->lamp][2])));
        else le = v3(S(p->le[0][0]), S(p->le[0][1]), S(p->le[0][2]));
        le = v3(SEL(lit, le.x, S(0)), SEL(lit, le.y, S(0)), SEL(lit, le.z, S(0)));
        const V3 fl = mul(f, le);
        want &= (M) ~(EQ(fl.x, S(0)) & EQ(fl.y, S(0)) & EQ(fl.z, S(0)));
        const V3 brings = scale(fl, weight);
        STV(bx, SEL(want, brings.x, S(0))); STV(by, SEL(want, brings.y, S(0))); STV(bz, SEL(want, brings.z, S(0)));
        struct shadows *sh = &e->shadows;
        const V3 so = offset(x.p, x.ng, l.wi);
        const V3 sd = sel3(l.far, l.wi, sub(l.p, so));
        const V reach = SEL(l.far, S(INFINITY), S(1 - 10 * IMP_RAY_EPSILON));
        const I ids = _mm512_set_epi64(pos + 7, pos + 6, pos + 5, pos + 4, pos + 3, pos + 2, pos + 1, pos);
        const int n = sh->n;
        COMP(&sh->ox[n], want, so.x); COMP(&sh->oy[n], want, so.y); COMP(&sh->oz[n], want, so.z);
        COMP(&sh->dx[n], want, sd.x); COMP(&sh->dy[n], want, sd.y); COMP(&sh->dz[n], want, sd.z);
        COMP(&sh->reach[n], want, reach);
        COMPI(&sh->at[n], want, ids);
        sh->n += __builtin_popcount(want);
    }

    /* the direction */
    V3 wi;
    M goes = sample_dir(m, mat, wo_drawn, number(b, 0), number(b, 1), &wi) & on;
    const V3 w_world = to_world(&x, wi);
    const V pdf_d = decide(pdf_eval(m, mat, rho, wo, decide3(wi), &f));
    goes &= GT(pdf_d, S(0));
    V3 beta = {GD(bx), GD(by), GD(bz)};
    beta = mul(beta, scale(f, 1 / pdf_d));
    goes &= (M) ~(EQ(beta.x, S(0)) & EQ(beta.y, S(0)) & EQ(beta.z, S(0)));
    V survive = S(1);
    if (depth + 1 >= p->rr_depth) {
        const V most = MAXV(beta.x, MAXV(beta.y, beta.z));
        V q = MINV(most * 1 * 1, S(0.95));
        q = MAXV(q, S(p->tracer->survival));
        survive = decide(q);
        goes &= LT(number(b, 3), survive);
        beta = scale(beta, 1 / survive);
    }
    const V sc = 1 / (pdf_d * survive);
    STV(wx, SEL(goes, f.x * sc, S(0))); STV(wy, SEL(goes, f.y * sc, S(0))); STV(wz, SEL(goes, f.z * sc, S(0)));
    const V3 no = offset(x.p, x.ng, w_world);
    const int n = next->n;
#define CN(c, v) COMP(&next->c[n], goes, v)
    CN(ox, no.x); CN(oy, no.y); CN(oz, no.z); CN(dx, w_world.x); CN(dy, w_world.y); CN(dz, w_world.z); CN(tmax, S(INFINITY));
    CN(fx, x.p.x); CN(fy, x.p.y); CN(fz, x.p.z); CN(pdf, pdf_d); CN(bx, beta.x); CN(by, beta.y); CN(bz, beta.z);
    COMPI(&next->walk[n], goes, walk);
    const I ids = _mm512_set_epi64(pos + 7, pos + 6, pos + 5, pos + 4, pos + 3, pos + 2, pos + 1, pos);
    COMPI(&next->parent[n], goes, ids);
    next->n += __builtin_popcount(goes);
}

#define SHADER(SU, MA)                                                                                                              \
    static __attribute__((noinline)) void shade_##SU##_##MA(struct engine *e, const struct item *m, const struct wave *w,           \
                                                            struct wave *next, struct values *val, const int *order, int n, int pos, int depth) \
    {                                                                                                                               \
        for (int i = 0; i < n; i += 8) shade(e, m, SU, MA, w, next, val, order + i, pos + i, on_of(n - i), depth);                   \
    }
SHADER(RECT, CONST)
SHADER(RECT, BITMAP)
SHADER(RECT, CHECKER)
SHADER(SPHERE, CONST)
SHADER(SPHERE, GGX)
SHADER(MESH_A, CONST)
SHADER(MESH_A, GGX)
SHADER(MESH_F, CONST)
SHADER(MESH_FN, CONST)
static void shade_bin(struct engine *e, const struct item *m, const struct wave *w, struct wave *next, struct values *val,
                      const int *order, int n, int pos, int depth)
{
#define CASE(SU, MA) if (m->surf == SU && m->mat == MA) { shade_##SU##_##MA(e, m, w, next, val, order, n, pos, depth); return; }
    CASE(RECT, CONST) CASE(RECT, BITMAP) CASE(RECT, CHECKER) CASE(SPHERE, CONST) CASE(SPHERE, GGX) CASE(MESH_A, CONST)
    CASE(MESH_A, GGX) CASE(MESH_F, CONST) CASE(MESH_FN, CONST)
    fprintf(stderr, "no shader\n");
    abort();
}

/* What leaves the scene: the sky, to its parent. */
static void misses(struct engine *e, const struct wave *w, double *L[3], int depth)
{
    const struct plan *p = &e->plan;
    if (p->sky < 0) return;
    const double factor = p->scene->light_cdf[p->sky] - (p->sky ? p->scene->light_cdf[p->sky - 1] : 0);
    const V pe = S(factor * (IMP_INV_PI / 4)), b2 = pe * pe;
    (void)depth;
    for (int i = 0; i < w->n; i += 8) {
        const __m256i shape = _mm256_loadu_si256((const void *)&w->shape[i]);
        const M out = _mm256_cmplt_epi32_mask(shape, _mm256_setzero_si256()) & on_of(w->n - i);
        if (!out) continue;
        const V pdf = LD(w, pdf, i), a2 = pdf * pdf;
        const V weight = SEL(GT(pdf, S(0)), decide(1 * SEL(GT(a2, S(0)), a2 / (a2 + b2), S(0))), S(1));
        const I parent = _mm512_loadu_si512(&w->parent[i]);
        for (int c = 0; c < 3; c++) _mm512_mask_i64scatter_pd(L[c], out, parent, S(p->le[p->sky][c]) * weight, 8);
    }
}

static void trace(struct engine *e, int n)
{
    const struct plan *p = &e->plan;
    camera(e, n);
    int depth = 0;
    for (int c = 0; c < 3; c++) memset(e->L[c], 0, (size_t)n * sizeof(double));
    for (;; depth++) {
        struct wave *w = &e->wave[depth & 1], *next = &e->wave[1 - (depth & 1)];
        struct values *val = &e->values[depth];
        intersect(p, w);
        double *up[3] = {e->L[0], e->L[1], e->L[2]};
        if (depth) up[0] = e->values[depth - 1].lx, up[1] = e->values[depth - 1].ly, up[2] = e->values[depth - 1].lz;
        if (depth == 0)
            for (int i = 0; i < n; i++) e->valid[i] = p->sky >= 0 || w->shape[i] >= 0;
        misses(e, w, up, depth);
        /* bins */
        int count[MAX_SHAPES + 1] = {0}, start[MAX_SHAPES + 1];
        const bool last = depth + 1 >= p->max_depth;
        for (int i = 0; i < w->n; i++) count[w->shape[i] < 0 ? p->n_bins : p->bin_of[w->shape[i]]]++;
        int total = 0;
        for (int b = 0; b < p->n_bins; b++) {
            start[b] = total;
            total += (count[b] + 7) & ~7;
        }
        start[p->n_bins] = total;
        int fill[MAX_SHAPES + 1];
        memcpy(fill, start, sizeof fill);
        for (int b = 0; b < p->n_bins; b++)
            for (int k = start[b] + count[b]; k < ((start[b] + count[b] + 7) & ~7); k++) e->order[k] = 0;
        for (int i = 0; i < w->n; i++) {
            const int b = w->shape[i] < 0 ? p->n_bins : p->bin_of[w->shape[i]];
            e->order[fill[b]++] = i;
        }
        next->n = 0;
        e->shadows.n = 0;
        int pos = 0;
        val->n = 0;
        for (int b = 0; b < p->n_bins; b++) {
            const struct item *m = &p->item[p->first_of_bin[b]];
            if (count[b] == 0 || (last && m->emitter < 0)) continue;
            for (int k = start[b] + count[b]; k < ((start[b] + count[b] + 7) & ~7); k++) e->order[k] = e->order[start[b]];
            shade_bin(e, m, w, next, val, &e->order[start[b]], count[b], pos, depth);
            /* what lies beyond a bin's end belongs to nobody */
            for (int k = count[b]; k & 7; k++) val->parent[pos + k] = CAP + 8;
            pos += (count[b] + 7) & ~7;
        }
        val->n = pos;
        occlude(p, &e->shadows, val);
        if (last || next->n == 0) break;
    }
    /* fold */
    for (; depth >= 0; depth--) {
        struct values *v = &e->values[depth];
        double *up[3] = {e->L[0], e->L[1], e->L[2]};
        if (depth) up[0] = e->values[depth - 1].lx, up[1] = e->values[depth - 1].ly, up[2] = e->values[depth - 1].lz;
        for (int i = 0; i < v->n; i += 8) {
            const I parent = _mm512_loadu_si512(&v->parent[i]);
            _mm512_i64scatter_pd(up[0], parent, LD(v, ex, i) + LD(v, wx, i) * LD(v, lx, i) + LD(v, bx, i), 8);
            _mm512_i64scatter_pd(up[1], parent, LD(v, ey, i) + LD(v, wy, i) * LD(v, ly, i) + LD(v, by, i), 8);
            _mm512_i64scatter_pd(up[2], parent, LD(v, ez, i) + LD(v, wz, i) * LD(v, lz, i) + LD(v, bz, i), 8);
        }
    }
}

static __attribute__((noinline)) void fill(const struct imp_tracer *t, int x, int y)
{
    struct engine *e = E;
    if (!e) {
        e = E = aligned_alloc(64, (sizeof *e + 63) & ~(size_t)63);
        memset(e, 0, sizeof *e);
        const char *r = getenv("SPIKE_ROWS");
        e->plan.rows = r ? atoi(r) : 1;
    }
    const int rows = e->plan.rows ? e->plan.rows : 1;
    if (e->last != t || e->plan.scene != t->scene || e->seed != t->seed) {
        e->plan.ok = plan_make(&e->plan, t);
        e->plan.rows = rows;
        e->last = t;
        e->seed = t->seed;
        if (!e->plan.ok) fprintf(stderr, "spike: not in lanes\n");
        const int set = imp__tracer_set(t, 64);
        for (int k = 0; k < 64; k++) e->sample[k] = imp__set_number(set, 64, k);
    }
    if (!e->plan.ok) return;
    const struct imp_film_desc *film = &t->sensor->film;
    e->x0 = x;
    e->y0 = y;
    e->x1 = x + 8;
    e->y1 = y + rows;
    e->next = 0;
    const int n = 64 * 8 * rows;
    for (int i = 0; i < n; i++) {
        const int px = x + i / 64 % 8, py = y + i / 512;
        const int64_t sample = e->sample[i % 64];
        if (i % 64 == 0 || e->sample[i % 64] / IMP_SET_POINTS != e->sample[i % 64 - 1] / IMP_SET_POINTS) {
            const uint64_t row = (uint64_t)(py + film->crop_y + 0x8000), column = (uint64_t)(px + film->crop_x + 0x8000);
            const uint64_t set = (uint64_t)sample / IMP_SET_POINTS | 1ull << 63;
            e->set[i] = imp__key(t->seed, row << 32 | column, set).state;
        } else e->set[i] = e->set[i - 1];
        e->index[i] = (uint32_t)sample % IMP_SET_POINTS;
    }
    trace(e, n);
}

bool imp__spike_walk(const struct imp_tracer *t, int x, int y, int64_t sample, struct imp_walk *walk)
{
    struct engine *e = E;
    if (imp_unlikely(!e || e->last != t || e->next >= 512 * e->plan.rows || x < e->x0 || x >= e->x1 || y < e->y0 || y >= e->y1)) {
        if (e && e->last == t && !e->plan.ok) NO;
        fill(t, x, y);
        e = E;
        if (!e->plan.ok) NO;
    }
    const int i = e->next++;
    if (imp_unlikely(i / 64 % 8 != x - e->x0 || i / 512 != y - e->y0 || e->sample[i % 64] != sample)) {
        fprintf(stderr, "spike: out of order at %d %d %ld\n", x, y, (long)sample);
        abort();
    }
    imp__walk_clear(walk);
    walk->px = e->px[i];
    walk->py = e->py[i];
    walk->valid = e->valid[i];
    walk->time = t->sensor->open;
    imp__walk_value(t, walk, (imp_spec){e->L[0][i], e->L[1][i], e->L[2][i], 0});
    return true;
}
