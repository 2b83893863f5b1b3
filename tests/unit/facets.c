/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes of few triangles, which the library asks itself: nearest hits and shadows beside those
 * of all triangles in long double; rays that graze, start near triangles or far away; and no ray
 * that slips between two triangles. */
#include "scene/facets.h"
#include "imp_tap.h"
#include "math/offset.h"
#include "math/rng.h"
#include "math/warp.h"
#include "shape_nodes.h"

enum { TRIANGLES = IMP_FACETS, RAYS = 6000 };
static float corner[3 * TRIANGLES][3];
static uint32_t indices[3 * TRIANGLES];
static int n_triangles;

static double u01(struct imp_key key, uint32_t *dim) { return imp__u01(key, (*dim)++); }
static imp_v3 somewhere(struct imp_key key, uint32_t *dim)
{
    const double x = u01(key, dim), y = u01(key, dim), z = u01(key, dim);
    return imp__v3(2 * x - 1, 2 * y - 1, 2 * z - 1);
}
static imp_v3 direction(struct imp_key key, uint32_t *dim)
{
    const double u = u01(key, dim), v = u01(key, dim);
    return imp__uniform_sphere((double[2]){u, v});
}

static void triangle_add(imp_v3 a, imp_v3 b, imp_v3 c)
{
    const imp_v3 p[3] = {a, b, c};
    if (n_triangles == TRIANGLES) return;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) corner[3 * n_triangles + k][i] = (float)p[k][i];
    n_triangles++;
}
/* Two triangles that share an edge; the numbers of the corners differ from one to the next. */
static void quad_add(imp_v3 a, imp_v3 b, imp_v3 c, imp_v3 d, int turn)
{
    if (n_triangles + 2 > TRIANGLES) return;
    triangle_add(a, b, c);
    if (turn % 3 == 0) triangle_add(a, c, d);
    else if (turn % 3 == 1) triangle_add(d, a, c);
    else triangle_add(c, d, a);
}

/* Any triangles, thin ones, points; parallelograms, trapezia, pairs that are not flat; all about
 * a centre and of one size. */
static void soup_make(uint64_t seed, double size, imp_v3 centre)
{
    const struct imp_key key = imp__key(31, 0, seed);
    uint32_t dim = 0;
    const int wanted = 1 + (int)(u01(key, &dim) * TRIANGLES);
    n_triangles = 0;
    while (n_triangles < wanted) {
        const imp_v3 a = centre + size * somewhere(key, &dim);
        const imp_v3 e = size * somewhere(key, &dim), f = size * somewhere(key, &dim);
        const int turn = (int)(6 * u01(key, &dim));
        switch ((int)(7 * u01(key, &dim))) {
        case 0: quad_add(a, a + e, a + e + f, a + f, turn); break;
        case 1: quad_add(a, a + e, a + 1.3 * e + .8 * f, a + f, turn); break;
        case 2: quad_add(a, a + e, a + e + f * 1.01, a + f, turn); break;
        case 3: quad_add(a, a + e, a + e + f + 1e-3 * centre, a + f, turn); break;
        case 4: triangle_add(a, a + e, a + e + 1e-2 * f); break;
        case 5: triangle_add(a, a, a + (turn % 2 ? e : a - a)); break;
        default: triangle_add(a, a + e, a + f);
        }
    }
}

static bool soup_build(imp_context *ctx)
{
    static struct imp_mesh_data mesh[2];
    world_begin(ctx);
    for (int i = 0; i < 3 * n_triangles; i++)
        indices[i] = (uint32_t)(i % (3 * TRIANGLES));
    /* In two meshes, cut at an even triangle. */
    const int cut = n_triangles / 4 * 2, of[3] = {0, cut, n_triangles};
    for (int k = 0; k < 2; k++) {
        if (of[k] == of[k + 1]) continue;
        mesh[k] = (struct imp_mesh_data){.n_vertices = (size_t)(3 * (of[k + 1] - of[k])),
                                         .n_triangles = (size_t)(of[k + 1] - of[k]),
                                         .positions = corner[3 * of[k]],
                                         .indices = indices};
        struct imp_node *n = node_new("shape", "mesh");
        n->mesh = &mesh[k];
        if (!shape_build(n, NULL)) return false;
    }
    return imp__intersector_create(&world) == IMP_OK;
}

/* ---- reference ---------------------------------------------------------------------------------- */

typedef long double real;
struct meeting {
    real t, inside; /* inside: the least of u, v and 1 - u - v */
    real slant;     /* way along the ray for a way along the normal, in units of d */
    real grow;      /* of u and v for a way along the normal */
};
static struct meeting meet(int triangle, imp_v3 o, imp_v3 d)
{
    real a[3], e[3], f[3], n[3], num = 0, den = 0, nn = 0, u = 0, v = 0;
    for (int i = 0; i < 3; i++) {
        a[i] = corner[3 * triangle][i];
        e[i] = corner[3 * triangle + 1][i] - a[i];
        f[i] = corner[3 * triangle + 2][i] - a[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = e[j] * f[k] - e[k] * f[j];
        num += n[i] * (a[i] - o[i]);
        den += n[i] * d[i];
        nn += n[i] * n[i];
    }
    const real t = num / den;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const real p = o[i] + t * d[i] - a[i];
        u += p * (f[j] * n[k] - f[k] * n[j]) / nn;
        v += p * (n[j] * e[k] - n[k] * e[j]) / nn;
    }
    const real slant = sqrtl(nn) / fabsl(den);
    real ee = 0, ff = 0, dd = 0;
    for (int i = 0; i < 3; i++) ee += e[i] * e[i], ff += f[i] * f[i], dd += d[i] * d[i];
    const real grow = slant * sqrtl(dd * fmaxl(ee, ff) / nn);
    return (struct meeting){t, fminl(fminl(u, v), 1 - u - v), slant, grow};
}

/* Nearest hit in (tmin, tmax); false: rounding decides. */
static bool reference(imp_v3 o, imp_v3 d, double tmin, double tmax, struct meeting *first)
{
    const real length = (real)imp__length(d), reach = (real)imp__length(o) + 1;
    const real room = 1e-12L * reach / length;
    real sure = INFINITY, perhaps = INFINITY;
    for (int k = 0; k < n_triangles; k++) {
        const struct meeting m = meet(k, o, d);
        const real near = 1e-9L + 1e-15L * reach * m.grow;
        if (m.inside >= -near && m.t > (real)tmin - room && m.t < (real)tmax + room)
            perhaps = fminl(perhaps, m.t);
        if (m.inside >= near && m.t > (real)tmin + room && m.t < (real)tmax - room &&
            m.t < sure) {
            *first = m;
            sure = m.t;
        }
    }
    if (!(sure < INFINITY)) first->t = INFINITY;
    return !(perhaps < sure);
}

/* ---- tests -------------------------------------------------------------------------------------- */

enum from { ANYWHERE, SURFACE, GRAZING, FAR, CLOSE, KINDS };
static const char *const names[] = {"from anywhere", "from triangles", "that graze",
                                    "from far away", "from close by, in any units"};

static void ray_make(enum from kind, struct imp_key key, double size, imp_v3 centre,
                     imp_v3 *o, imp_v3 *d)
{
    uint32_t dim = 0;
    const int k = (int)(u01(key, &dim) * n_triangles);
    imp_v3 p[3];
    for (int i = 0; i < 3; i++)
        p[i] = imp__v3((double)corner[3 * k + i][0], (double)corner[3 * k + i][1],
                       (double)corner[3 * k + i][2]);
    double b[2];
    const double u = u01(key, &dim), v = u01(key, &dim), w = u01(key, &dim);
    imp__uniform_triangle((const double[2]){u, v}, b);
    const imp_v3 on = p[0] + b[0] * (p[1] - p[0]) + b[1] * (p[2] - p[0]);
    imp_v3 n = imp__cross(p[1] - p[0], p[2] - p[0]);
    n = imp__dot(n, n) > 0 ? imp__normalize(n) : imp__v3(1, 0, 0);
    *d = direction(key, &dim);
    *o = centre + 2 * size * somewhere(key, &dim);
    if (kind == SURFACE) *o = imp__offset(on, n, *d);
    if (kind == GRAZING) { /* angles from .1 to 1e-6 */
        const imp_v3 along = *d - n * imp__dot(n, *d);
        *d = imp__normalize(along) + n * pow(10, -1 - 5 * w);
        *o = on - *d * (size * (.1 + u));
    }
    if (kind == FAR) {
        *o = centre + *o * pow(10, 1 + 3 * w);
        *d = imp__normalize(on - *o);
    }
    if (kind ==
        CLOSE) { /* 1e-9 to 1e-3 in front of it, directions of lengths 1e-4 to 1e4 */
        const double length = pow(10, 8 * u - 4);
        *o = on - *d * (size * pow(10, -9 + 6 * w));
        *d *= length;
    }
    if (kind == ANYWHERE && u < .5) *d = on - *o; /* not a unit vector */
}

static void beside_reference(imp_context *ctx, enum from kind)
{
    static const struct {
        double size;
        imp_v3 centre;
    } places[] = {{1, {0, 0, 0}}, {500, {300, 200, -900}}, {.01, {.1, 0, .02}}};
    int met = 0, asked = 0, wrong = 0, dark = 0, other = 0, built = 0;
    double worst = 0;
    for (uint64_t seed = 0; seed < 30; seed++) {
        const double size = places[seed % 3].size;
        const imp_v3 centre = places[seed % 3].centre;
        soup_make(seed, size, centre);
        built += soup_build(ctx);
        for (uint32_t i = 0; world.intersector && i < RAYS; i++) {
            const struct imp_key key = imp__key(32, seed, i);
            const double tmin = i % 5 ? 0 : .2 * size, tmax = i % 7 ? INFINITY : size;
            imp_v3 o, d;
            struct meeting first = {0};
            ray_make(kind, key, size, centre, &o, &d);
            if (!reference(o, d, tmin, tmax, &first)) continue;
            const double t = (double)first.t;
            asked++;
            struct imp_hit hit = {.t = INFINITY};
            const bool is = imp__intersect(&world, &o, &d, tmin, tmax, &hit);
            dark += imp__occluded(&world, &o, &d, tmin, tmax) != (t < INFINITY);
            met += is;
            if (is != (t < INFINITY)) {
                wrong++;
                continue;
            }
            if (!is) continue;
            const bool second = world.n_shapes > 1 && hit.shape == 1;
            const struct meeting own =
                meet(hit.prim + (second ? n_triangles / 4 * 2 : 0), o, d);
            /* Nearest, as far as floats about the centre can tell; normals of thin triangles
             * are known to a part of 1e-12. */
            const double blur = 2e-6 * size * (double)fmaxl(own.slant, first.slant);
            const double reach = imp__length(o) + imp__length(centre) + size;
            const double off = fabs(hit.t - (double)own.t);
            worst = fmax(worst, off / ((double)own.slant * reach));
            wrong +=
                own.inside < -2e-10L || hit.t < t - off - 1e-12 * t || hit.t > t + blur;
            other += hit.t > t + 1e-3 * blur;
        }
        world_end();
    }
    tap_ok(built == 30 && asked > 30 * RAYS * 3 / 4 && met > 30 * RAYS / 10 &&
               wrong == 0 && dark == 0 && other < 200 && worst < 1e-12,
           "rays %s: as in long double # %d of %d meet, %d wrong, %d shadows wrong, %d "
           "not the nearest by float rounding, distance off by %.1e at most",
           names[kind], met, asked, wrong, dark, other, worst);
}

/* A closed room of 6 quadrilaterals, turned, and its 12 triangles: rays from inside at points of
 * edges and corners, and of diagonals. */
static void closed(imp_context *ctx)
{
    enum { AIMED = 400000 };
    const struct imp_mat4 turn = imp__rotate(imp__normalize(imp__v3(1, 2, -.5)), 37);
    world_begin(ctx);
    struct imp_node *n = node_new("shape", "cube");
    node_transform(n, turn);
    shape_build(n, NULL);
    int lost = 0, shadows = 0;
    const bool made = imp__intersector_create(&world) == IMP_OK;
    for (uint32_t i = 0; made && i < AIMED; i++) {
        const struct imp_key key = imp__key(33, 0, i);
        uint32_t dim = 0;
        imp_v3 from = .9 * somewhere(key, &dim), to = somewhere(key, &dim);
        const int axis = (int)(i % 3), next = (int)((i + 1) % 3);
        to[axis] = to[axis] < 0 ? -1 : 1;
        if (i % 4 == 0)
            to[next] = to[(axis + 2) % 3]; /* a diagonal, or its mirror image */
        else to[next] = to[next] < 0 ? -1 : 1;
        if (i % 4 == 3) to[(axis + 2) % 3] = to[next]; /* a corner */
        from = imp__vector(&turn, from);
        to = imp__vector(&turn, to);
        const imp_v3 d = imp__normalize(to - from);
        struct imp_hit hit;
        lost += !imp__intersect(&world, &from, &d, 0, INFINITY, &hit);
        shadows += !imp__occluded(&world, &from, &d, 0, INFINITY);
    }
    tap_ok(made && lost == 0 && shadows == 0,
           "no ray slips through the edges of a cube # %d of %d, shadow rays %d", lost,
           AIMED, shadows);
    world_end();
}

/* Two meshes of 13 triangles at one place: the first is met, from both sides. */
static void same_place(imp_context *ctx)
{
    enum { N = 13 };
    static float at[3 * N][3];
    static uint32_t index[3 * N];
    const struct imp_mesh_data fan = {
        .n_vertices = 3 * N, .n_triangles = N, .positions = at[0], .indices = index};
    int wrong = 0, met = 0;
    for (int k = 0; k < 3 * N; k++) {
        const double phi = IMP_2PI * (k / 3 + k % 3 / 2) / N;
        index[k] = (uint32_t)k;
        at[k][0] = k % 3 ? (float)cos(phi) : 0;
        at[k][1] = k % 3 ? (float)sin(phi) : 0;
    }
    world_begin(ctx);
    for (int k = 0; k < 2; k++) {
        struct imp_node *n = node_new("shape", "mesh");
        n->mesh = &fan;
        shape_build(n, NULL);
    }
    const bool made = imp__intersector_create(&world) == IMP_OK;
    for (uint32_t i = 0; made && i < 10000; i++) {
        const struct imp_key key = imp__key(34, 0, i);
        uint32_t dim = 0;
        const imp_v3 o = somewhere(key, &dim);
        imp_v3 to = .6 * somewhere(key, &dim);
        to[2] = 0;
        const imp_v3 d = to - o;
        struct imp_hit hit = {.shape = -1};
        met += imp__intersect(&world, &o, &d, 0, INFINITY, &hit);
        wrong += hit.shape != 0;
    }
    tap_ok(made && met == 10000 && wrong == 0,
           "of two meshes at one place the first is met # %d wrong of %d", wrong, met);
    world_end();
}

int main(void)
{
    imp_context *ctx = NULL;
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    for (int kind = 0; kind < KINDS; kind++) beside_reference(ctx, (enum from)kind);
    closed(ctx);
    same_place(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
