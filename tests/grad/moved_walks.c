/* SPDX-License-Identifier: Apache-2.0
 *
 * The interior of derivatives by what moves: walks of a room whose vertices slide, against
 * differences of the same walks with their triangles, lamp and camera moved in long double; what
 * has no such derivative is refused by name. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "moves_kit.h"
#include "walk/core/vertex.h"
#include "walk/moved/moved.h"
#include "walk/moved/moved_kernel.h"

static imp_context *ctx;

struct room {
    imp_scene *scene;
    struct imp_tracer tracer;
    struct imp_arena arena;
    struct imp__moves moves;
};

static struct room room_of(const char *rest, const char *grey)
{
    struct room r;
    r.scene = room_build(ctx, &(struct room_parts){.rest = rest, .grey = grey});
    r.tracer = (struct imp_tracer){.scene = r.scene,
                                   .integrator = imp__walk_integrator(r.scene),
                                   .sensor = r.scene->sensors[0],
                                   .seed = 3};
    imp__arena_init(&r.arena, ctx);
    r.moves = imp__moves_begin(r.scene, r.tracer.sensor);
    return r;
}
static void room_free(struct room *r)
{
    imp__moves_free(&r->moves);
    imp__arena_free(&r->arena);
    imp_scene_destroy(r->scene);
}

/* ---- The same walk at moved places ------------------------------------------------------ */

struct moved {
    const struct room *room;
    const double *theta;
    real h;
};
struct place {
    real p[3], n[3], area;
    struct triangle t;
};

static struct place place_of(const struct moved *m, int shape,
                             const struct imp_located *at)
{
    struct place out;
    out.t = triangle_moved(&m->room->moves, shape, at->prim, m->theta, m->h);
    const double b[3] = {1 - (double)at->at[0] - (double)at->at[1], at->at[0], at->at[1]};
    triangle_point(&out.t, b, out.p);
    out.area = triangle_normal(&out.t, out.n);
    return out;
}

/* The frame of a vertex: s in the edges of its triangle, as at rest. */
static void frame_of(const struct imp_surface *at, const struct place *rest,
                     const struct place *x, real f[3][3])
{
    const struct triangle *t0 = &rest->t, *t = &x->t;
    real e0[2][3], gram[3] = {0}, by[2] = {0}, length = 0;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++) e0[k][i] = t0->p[k + 1][i] - t0->p[0][i];
    for (int i = 0; i < 3; i++) {
        gram[0] += e0[0][i] * e0[0][i];
        gram[1] += e0[0][i] * e0[1][i];
        gram[2] += e0[1][i] * e0[1][i];
        for (int k = 0; k < 2; k++) by[k] += e0[k][i] * (real)at->s[i];
    }
    const real det = gram[0] * gram[2] - gram[1] * gram[1],
               a = (by[0] * gram[2] - by[1] * gram[1]) / det,
               b = (by[1] * gram[0] - by[0] * gram[1]) / det;
    const real n0[3] = {rest->n[0], rest->n[1], rest->n[2]};
    const real side =
        n0[0] * (real)at->n[0] + n0[1] * (real)at->n[1] + n0[2] * (real)at->n[2];
    for (int i = 0; i < 3; i++) {
        f[0][i] = a * (t->p[1][i] - t->p[0][i]) + b * (t->p[2][i] - t->p[0][i]);
        f[2][i] = side < 0 ? -x->n[i] : x->n[i];
        length += f[0][i] * f[0][i];
    }
    for (int i = 0; i < 3; i++) f[0][i] /= sqrtl(length);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        f[1][i] = f[2][j] * f[0][l] - f[2][l] * f[0][j];
    }
}

/* Coordinates of p - origin in two edges of a triangle. */
static void in_edges(const struct triangle *t, const real p[3], real b[2])
{
    real e[2][3], gram[3] = {0}, by[2] = {0};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 2; k++) e[k][i] = t->p[k + 1][i] - t->p[0][i];
        gram[0] += e[0][i] * e[0][i];
        gram[1] += e[0][i] * e[1][i];
        gram[2] += e[1][i] * e[1][i];
        for (int k = 0; k < 2; k++) by[k] += e[k][i] * (p[i] - t->p[0][i]);
    }
    const real det = gram[0] * gram[2] - gram[1] * gram[1];
    b[0] = (by[0] * gram[2] - by[1] * gram[1]) / det;
    b[1] = (by[1] * gram[0] - by[0] * gram[1]) / det;
}

/* Inputs at p: uv are those of the same weights at rest. */
static void look_up(const struct imp_vertex *v, const struct imp_surface *at,
                    const struct place *rest, const struct place *x, const real p[3],
                    imp_spec *in)
{
    struct imp_texcoord there = imp__vertex_at(v);
    real b[2], b0[2];
    in_edges(&x->t, p, b);
    in_edges(&rest->t, rest->p, b0);
    imp_v3 d = {0}, grad[2];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++)
            d[i] += (double)((b[k] - b0[k]) * (rest->t.p[k + 1][i] - rest->t.p[0][i]));
    imp__surface_grad(at, grad);
    for (int k = 0; k < 2; k++) there.uv[k] += imp__dot(grad[k], d);
    imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &there, in);
}

/* The kernel of a vertex, from the world's directions, of any length. */
static imp_spec kernel_of(const struct imp_vertex *v, const imp_spec *in, real f[3][3],
                          const real wo[3], const real wi[3], int lobe)
{
    struct imp_dirs d = {{0}, {0}, lobe, 0};
    imp_spec K;
    for (int i = 0; i < 3; i++) {
        d.wo[i] = (double)(dot_real(f[i], wo) / sqrtl(dot_real(wo, wo)));
        d.wi[i] = (double)(dot_real(f[i], wi) / sqrtl(dot_real(wi, wi)));
    }
    v->bsdf->ops->eval(v->bsdf, in, &d, &K);
    return K;
}

static void ray_meets(const real o[3], const real w[3], const struct place *x, real p[3])
{
    real r[3];
    for (int i = 0; i < 3; i++) r[i] = x->p[i] - o[i];
    const real t = dot_real(x->n, r) / dot_real(x->n, w);
    for (int i = 0; i < 3; i++) p[i] = o[i] + t * w[i];
}

/* cos_y dA_y/d^2: a connection without its kernel. */
static real receives(const real p[3], const struct place *y, real w[3])
{
    for (int i = 0; i < 3; i++) w[i] = y->p[i] - p[i];
    const real d2 = dot_real(w, w);
    return dot_real(y->n, w) * y->area / (d2 * sqrtl(d2));
}

/* The camera's ray, through its centre and a point that it sees at rest. */
static void camera_ray(const struct moved *m, const struct imp_walk *walk,
                       const real p[3], real from[3], real w[3], real w0[3])
{
    real aim[3];
    for (int i = 0; i < 3; i++) {
        aim[i] = p[i];
        from[i] = walk->ray.o[i];
        w0[i] = aim[i] - from[i];
    }
    for (int k = 0; k < m->room->moves.n_movers; k++) {
        const struct imp__mover *x = &m->room->moves.mover[k];
        if (x->shape != IMP_MOVE_CAMERA) continue;
        pose_apply(m->theta + x->first, x->centre, m->h, aim);
        pose_apply(m->theta + x->first, x->centre, m->h, from);
    }
    for (int i = 0; i < 3; i++) w[i] = aim[i] - from[i];
}

/* Radiance of the recorded walk, sum of channels by `adjoint`: recorded values times what their
 * geometry and kernels are at h over what they are at 0. */
static real walk_moved(const struct moved *m, const struct imp_walk *walk,
                       const double adjoint[3])
{
    const struct moved rest = {m->room, m->theta, 0};
    const struct imp_scene *scene = m->room->scene;
    real from[3], from0[3], w[3], w0[3], T[3] = {1, 1, 1}, L = 0;
    const struct imp_vertex *first = walk->first;
    for (int c = 0; c < 3; c++) L += adjoint[c] * (real)first->e[c];
    if (first->d.scatterer == IMP_AT_SKY) return L;
    const struct place seen = place_of(&rest, first->d.shape, &first->d.located);
    camera_ray(m, walk, seen.p, from, w, w0);
    bool seen_through = true;
    for (const struct imp_vertex *v = first; v; v = v->next) {
        const struct place x = place_of(m, v->d.shape, &v->d.located);
        const struct place x0 = place_of(&rest, v->d.shape, &v->d.located);
        struct imp_surface at;
        real p[3], *p0 = from0, f[3][3], f0[3][3], wo[3], wo0[3];
        ray_meets(from, w, &x, p);
        imp__decided_surface(scene, &v->d, 0, &at);
        frame_of(&at, &x0, &x, f);
        frame_of(&at, &x0, &x0, f0);
        imp_spec in[IMP_INPUTS_MAX];
        look_up(v, &at, &x0, &x, p, in);
        for (int i = 0; i < 3; i++) {
            p0[i] = x0.p[i];
            wo[i] = -w[i];
            wo0[i] = -w0[i];
        }
        if (v->d.connection == IMP_CONNECTED) {
            const struct imp_light *l = &v->d.light;
            const struct imp_emitter *e = scene->emitters[l->emitter];
            real ratio = 1, d[3] = {l->d[0], l->d[1], l->d[2]}, d0[3];
            for (int i = 0; i < 3; i++) d0[i] = d[i] = -d[i];
            if (e->shape) {
                const struct place y = place_of(m, e->shape->index, &l->located);
                const struct place y0 = place_of(&rest, e->shape->index, &l->located);
                ratio = receives(p, &y, d) / receives(p0, &y0, d0);
            }
            const imp_spec K = kernel_of(v, in, f, wo, d, IMP_SMOOTH),
                           K0 = kernel_of(v, v->in, f0, wo0, d0, IMP_SMOOTH);
            for (int c = 0; c < 3; c++)
                L += K0[c] != 0 ? adjoint[c] * T[c] * (real)v->b[c] * ratio *
                                      ((real)K[c] / (real)K0[c])
                                : 0;
        }
        const struct imp_vertex *next = v->next;
        if (!next || !v->d.goes_on) break;
        const bool sky = next->d.scatterer == IMP_AT_SKY;
        struct place y0 = {0};
        if (!sky) y0 = place_of(&rest, next->d.shape, &next->d.located);
        const bool pass = imp__goes_straight(v);
        seen_through &= pass;
        for (int i = 0; i < 3 && !seen_through; i++)
            w[i] = w0[i] = sky ? (real)next->d.p[i] : y0.p[i] - p0[i];
        /* A mask does not turn the camera's ray. */
        if (seen_through && !sky) camera_ray(m, walk, y0.p, p, w, w0);
        const imp_spec K0 = kernel_of(v, v->in, f0, wo0, w0, v->d.lobe),
                       step = kernel_of(v, in, f, wo, w, v->d.lobe);
        imp_spec met = step;
        real ratio = 1;
        if (!sky && next->d.met.emitter >= 0 && !pass) {
            const struct place y = place_of(m, next->d.shape, &next->d.located);
            real to[3], to0[3];
            ratio = receives(p, &y, to) / receives(p0, &y0, to0);
            met = kernel_of(v, in, f, wo, to, v->d.lobe);
        }
        for (int c = 0; c < 3; c++) {
            if (!(K0[c] > 0)) {
                T[c] = 0;
                continue;
            }
            L += adjoint[c] * T[c] * (real)v->w[c] * (real)next->e[c] * ratio *
                 ((real)met[c] / (real)K0[c]);
            T[c] *= (real)v->w[c] * ((real)step[c] / (real)K0[c]);
        }
        if (sky) break;
        for (int i = 0; i < 3; i++) from[i] = p[i];
    }
    return L;
}

/* ---- Tests --------------------------------------------------------------------------------- */

static void walks_test(const char *rest, const char *grey, const char *name,
                       void (*add)(struct imp__moves *moves))
{
    /* The albedo of rough plastic is a table, which has kinks. */
    const bool textured = grey && strstr(grey, "bitmap");
    const double limit = grey && strstr(grey, "roughplastic") ? 1e-4 : 1e-6;
    struct room r = room_of(rest, grey);
    test_must(ctx, imp__moved_allowed(&r.tracer));
    add(&r.moves);
    double *theta = calloc(r.moves.n, sizeof *theta),
           *bar = calloc(r.moves.n, sizeof *bar);
    double error2 = 0, size2 = 0;
    int n = 0, long_ones = 0;
    for (int i = 0; i < 24 * 16 * 4; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&r.arena);
        struct imp_walk walk;
        imp__walk_trace(&r.tracer, &r.arena, i % 24, i / 24 % 16, i / 384, &walk);
        if (!walk.first || walk.dropped) continue;
        const struct imp_key key = imp__key(1, 2, (uint64_t)i);
        double adjoint[3];
        for (uint32_t c = 0; c < 3; c++) adjoint[c] = imp__u01(key, c) - 0.3;
        for (size_t k = 0; k < r.moves.n; k++) {
            theta[k] = imp__u01(key, (uint32_t)(10 + k)) - 0.5;
            bar[k] = 0;
        }
        imp__moved_sweep(&r.tracer, &r.arena, &r.moves, &walk,
                         (imp_spec){adjoint[0], adjoint[1], adjoint[2], 0}, bar);
        double derivative = 0;
        for (size_t k = 0; k < r.moves.n; k++) derivative += bar[k] * theta[k];
        real f[4];
        /* So small that no vertex slides over the border of a texel. */
        const real h = textured ? 1e-7L : 2e-5L;
        for (int k = 0; k < 4; k++)
            f[k] = walk_moved(&(struct moved){&r, theta, difference_at[k] * h}, &walk,
                              adjoint);
        const double ref = (double)difference(f, h);
        error2 += imp__sqr(derivative - ref);
        size2 += imp__sqr(ref);
        n += ref != 0;
        long_ones += walk.n > 3;
        imp__arena_rewind(&r.arena, mark);
    }
    const double relative = sqrt(error2 / size2);
    tap_ok(n > 60 && relative < limit, "%s: %d walks, %d of more than 3 vertices # %.1e",
           name, n, long_ones, relative);
    free(theta);
    free(bar);
    room_free(&r);
}

static void add_block(struct imp__moves *m)
{
    test_must(ctx, imp__moves_add(m, IMP_MOVE_POSE, 2));
    test_must(ctx, imp__moves_add(m, IMP_MOVE_SCALE, 2));
}
static void add_vertices(struct imp__moves *m)
{
    test_must(ctx, imp__moves_add(m, IMP_MOVE_VERTICES, 2));
}
static void add_lamp(struct imp__moves *m)
{
    test_must(ctx, imp__moves_add(m, IMP_MOVE_POSE, 3));
    test_must(ctx, imp__moves_add(m, IMP_MOVE_SCALE, 3));
}
static void add_camera(struct imp__moves *m)
{
    test_must(ctx, imp__moves_add(m, IMP_MOVE_POSE, IMP_MOVE_CAMERA));
}
static void add_all(struct imp__moves *m)
{
    add_camera(m);
    add_lamp(m);
    add_block(m);
    test_must(ctx, imp__moves_add(m, IMP_MOVE_POSE, 0));
}

static void refused(const char *rest, const char *word)
{
    struct room r = room_of(rest, NULL);
    const enum imp_status st = imp__moved_allowed(&r.tracer);
    const char *why = imp_last_error(ctx);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(why, word), "refused # %s", why);
    room_free(&r);
}

#define PATH   "<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"

#define METAL                                                                            \
    "<bsdf type='twosided' id='grey'><bsdf type='roughconductor'><string "               \
    "name='material' value='Cu'/><float name='alpha' value='.3'/></bsdf></bsdf>"
#define GRAIN                                                                            \
    "<bsdf type='roughconductor' id='grey'><string name='material' value='Al'/><float "  \
    "name='alpha_u' value='.2'/><float name='alpha_v' value='.6'/></bsdf>"
#define WAX                                                                              \
    "<bsdf type='roughplastic' id='grey'><float name='alpha' value='.3'/><rgb "          \
    "name='diffuse_reflectance' value='.6,.3,.2'/></bsdf>"
#define CAR                                                                              \
    "<bsdf type='principled' id='grey'><rgb name='base_color' value='.6,.3,.2'/><float " \
    "name='roughness' value='.5'/><float name='metallic' value='.4'/><float "            \
    "name='clearcoat' value='.5'/><float name='sheen' value='.5'/></bsdf>"
#define MIX                                                                              \
    "<bsdf type='blendbsdf' id='grey'><float name='weight' value='.4'/><bsdf "           \
    "type='diffuse'/><bsdf type='roughconductor'><float name='alpha' value='.4'/>"       \
    "</bsdf></bsdf>"
#define SHINE "<bsdf type='phong' id='grey'><float name='exponent' value='12'/></bsdf>"

#define WAVES "<string name='filename' value='" IMP_SCENES "/textured/waves.png'/>"
#define PAINT                                                                            \
    "<bsdf type='diffuse' id='grey'><texture type='bitmap' name='reflectance'>" WAVES    \
    "</texture></bsdf>"
#define WORN                                                                             \
    "<bsdf type='twosided' id='grey'><bsdf type='roughconductor'><texture "              \
    "type='bitmap' name='alpha'>" WAVES "<boolean name='raw' value='true'/></texture>"   \
    "<texture type='bitmap' name='specular_reflectance'>" WAVES                          \
    "</texture></bsdf></bsdf>"

#define HOLES                                                                            \
    "<bsdf type='mask' id='grey'><texture type='bitmap' name='opacity'>" WAVES           \
    "<boolean name='raw' value='true'/></texture><bsdf type='twosided'><bsdf "           \
    "type='roughconductor'><float name='alpha' value='.4'/></bsdf></bsdf></bsdf>"
#define GAUZE                                                                            \
    "<bsdf type='mask' id='grey'><float name='opacity' value='.4'/><bsdf "               \
    "type='twosided'><bsdf type='diffuse'/></bsdf></bsdf>"

int main(void)
{
    ctx = test_context(1);
    walks_test(DIRECT, NULL, "direct, a block", add_block);
    walks_test(DIRECT, NULL, "direct, the lamp", add_lamp);
    walks_test(DIRECT, NULL, "direct, the camera", add_camera);
    walks_test(DIRECT SKY, NULL, "direct and a sky, all", add_all);
    walks_test(PATH, NULL, "path, a block", add_block);
    walks_test(PATH, NULL, "path, its vertices", add_vertices);
    walks_test(PATH, NULL, "path, the lamp", add_lamp);
    walks_test(PATH SKY, NULL, "path and a sky, all", add_all);
    walks_test(DIRECT SKY, METAL, "rough metal, all", add_all);
    walks_test(PATH SKY, METAL, "path, rough metal, all", add_all);
    walks_test(PATH, GRAIN, "path, metal with a grain, vertices", add_vertices);
    walks_test(PATH, GRAIN, "path, metal with a grain, all", add_all);
    walks_test(PATH SKY, WAX, "path, rough plastic, all", add_all);
    walks_test(PATH, CAR, "path, principled, all", add_all);
    walks_test(PATH, MIX, "path, a blend, all", add_all);
    walks_test(PATH, SHINE, "path, phong, all", add_all);
    walks_test(DIRECT, PAINT, "a texture, all", add_all);
    walks_test(PATH, PAINT, "path, a texture, vertices", add_vertices);
    walks_test(PATH SKY, WORN, "path, textured metal, all", add_all);
    walks_test(PATH SKY, HOLES, "path, a mask with a texture, all", add_all);
    walks_test(PATH, GAUZE, "path, a mask, vertices", add_vertices);
    refused(PATH
            "<shape type='rectangle'><emitter type='directionalarea' id='bulb'/></shape>",
            "'bulb'");
    refused(PATH "<bsdf type='thindielectric' id='wax'/><shape type='sphere'><ref "
                 "id='wax'/></shape>",
            "'wax'");
    refused(PATH "<shape type='cube'><bsdf type='diffuse' id='tiles'><texture "
                 "type='checkerboard' name='reflectance'/></bsdf></shape>",
            "values jump");
    refused("<integrator type='ptracer'/>", "begin at the lights");
    refused("<integrator type='path'><boolean name='hide_emitters' value='true'/>"
            "</integrator>",
            "hidden");
    imp_context_destroy(ctx);
    return tap_done();
}
