/* SPDX-License-Identifier: Apache-2.0
 *
 * The adjoint of bent rays: every scheme with every exit, events and taps, against the
 * forward tangent (dot test, 1e-12), and against central differences of the tracer with
 * the same number of steps on both sides. */
#include "bend_kit.h"

#define N    48
#define TAPS 2

struct setup {
    const char *name;
    struct imp_bend_surface s[4];
    int n;
    bool outside, taps, strong;
    double z0, radius, outside_index;
};

static imp_field *sdf;
static imp_scene *mesh; /* a box of twelve triangles, tilted */

static void mesh_make(void)
{
    float p[24];
    static const uint32_t t[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                   2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    for (int i = 0; i < 8; i++) {
        const double x = i & 1 ? 0.9 : -0.9, y = i & 2 ? 0.9 : -0.9,
                     z = i & 4 ? 0.7 : -0.9;
        p[3 * i] = (float)(x + 0.1 * z), p[3 * i + 1] = (float)(y - 0.1 * z + 0.05 * x);
        p[3 * i + 2] = (float)(z - 0.1 * x + 0.07 * y);
    }
    KIT_CHECK(imp_scene_create(kit_ctx, NULL, &mesh));
    imp_scene_begin(mesh, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(mesh, 8, 12, p, NULL, NULL, t);
    imp_scene_end(mesh);
    KIT_CHECK(imp_scene_commit(mesh));
}

static struct imp_bend_surface surface(enum imp_bend_surface_type type)
{
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    s.type = type;
    return s;
}

static struct setup setups[16];
static int n_setups;

static void setups_make(void)
{
    struct imp_bend_surface box = surface(IMP_BEND_BOX), plane = surface(IMP_BEND_PLANE),
                            sphere = surface(IMP_BEND_SPHERE),
                            disc = surface(IMP_BEND_DISC),
                            cylinder = surface(IMP_BEND_CYLINDER),
                            near = surface(IMP_BEND_APPROACH),
                            dist = surface(IMP_BEND_SDF), facets = surface(IMP_BEND_MESH);
    for (int k = 0; k < 3; k++) box.lo[k] = -1, box.hi[k] = 1;
    plane.normal[0] = 0.2, plane.normal[1] = -0.1, plane.normal[2] = 1,
    plane.offset = 0.5;
    sphere.radius = 0.95, sphere.centre[0] = 0.02;
    disc.normal[1] = 0.2, disc.centre[2] = 0.4, disc.radius = 0.7;
    cylinder.radius = 0.45;
    near.centre[0] = 0.1, near.centre[2] = 0.5;
    dist.sdf = sdf;
    facets.scene = mesh;
    int n = 0;
#define SETUP(...) setups[n++] = (struct setup){__VA_ARGS__}
    SETUP("box", {box}, 1, false, true, false, -0.8, 0.6, 1);
    SETUP("plane", {plane}, 1, false, true, false, -0.8, 0.6, 1);
    SETUP("sphere", {sphere}, 1, false, false, false, -0.5, 0.5, 1);
    SETUP("cylinder and box", {cylinder, box}, 2, false, true, true, -0.8, 0.3, 1);
    SETUP("disc, box stops", {disc, box}, 2, false, false, false, -0.8, 0.6, 1);
    setups[n - 1].s[1].event = IMP_BEND_STOP;
    SETUP("signed distance", {dist}, 1, false, false, false, -0.4, 0.5, 1);
    SETUP("closest approach", {near, box}, 2, false, true, false, -0.8, 0.6, 1);
    SETUP("refracting sphere from outside", {sphere}, 1, true, true, false, -2, 0.6, 1);
    setups[n - 1].s[0].event = IMP_BEND_REFRACT;
    SETUP("refracting distance from outside", {dist}, 1, true, false, false, -2, 0.5, 1);
    setups[n - 1].s[0].event = IMP_BEND_REFRACT;
    SETUP("matched sphere from outside", {sphere}, 1, true, false, false, -2, 0.6, 1.3);
    SETUP("light guide: total reflection", {cylinder, plane}, 2, false, true, true, -0.8,
          0.3, 1);
    setups[n - 1].s[0].event = setups[n - 1].s[1].event = IMP_BEND_REFRACT;
    SETUP("mirror", {cylinder, plane}, 2, false, true, true, -0.8, 0.3, 1);
    setups[n - 1].s[0].event = IMP_BEND_MIRROR;
    SETUP("mesh", {facets}, 1, false, true, false, -0.6, 0.5, 1);
    SETUP("refracting mesh from outside", {facets}, 1, true, false, true, -2, 0.5, 1);
    setups[n - 1].s[0].event = IMP_BEND_REFRACT;
    n_setups = n;
}

static const struct imp_bend_tap taps[TAPS] = {
    {.size = sizeof *taps, .normal = {0.1, 0, 1}, .offset = -0.3, .group = -1},
    {.size = sizeof *taps, .normal = {0, 0.1, 1}, .offset = 0.1, .group = -1}};

static void options_of(const struct setup *s, enum imp_bend_scheme scheme,
                       struct imp_bend_options *o)
{
    *o = (struct imp_bend_options)IMP_BEND_OPTIONS_INIT;
    o->scheme = scheme;
    o->step = 0.05;
    o->surfaces = s->s;
    o->n_surfaces = (size_t)s->n;
    o->outside = s->outside;
    o->outside_index = s->outside_index;
    if (scheme == IMP_BEND_ARC_INDEX) o->way = IMP_BEND_STORED;
    if (s->taps) o->taps = taps, o->n_taps = TAPS;
}

static struct imp_bend_exit exits[N], tap_exits[N * TAPS];
static struct imp_bend_cotangent bars[N], tap_bars[N * TAPS], dots[N], tap_dots[N * TAPS];
static double x_bar[N][3], d_bar[N][3], x_dot[N][3], d_dot[N][3], energy[N];

static double pair(const struct imp_bend_cotangent *a, const struct imp_bend_cotangent *b,
                   double *scale)
{
    double s = a->path * b->path;
    for (int k = 0; k < 3; k++) s += a->x[k] * b->x[k] + a->v[k] * b->v[k];
    *scale += fabs(s);
    return s;
}

static void dot_test(const imp_field *f, const struct setup *s,
                     enum imp_bend_scheme scheme, bool stored)
{
    struct imp_bend_options o = {.size = sizeof o};
    struct imp_bend_stats stats = {.size = sizeof stats};
    options_of(s, scheme, &o);
    if (stored) o.way = IMP_BEND_STORED;
    struct imp_bend_rays rays = kit_beam(N, s->z0, s->radius, s->strong ? 0.9 : 0.1);
    const size_t n = imp_field_n_theta(f);
    double *bar = calloc(n, sizeof *bar), *dot = calloc(n, sizeof *dot);
    for (size_t i = 0; i < n; i++) dot[i] = kit_pm(100, i);
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) {
            bars[i].x[k] = kit_pm(101 + k, i), bars[i].v[k] = kit_pm(104 + k, i);
            x_dot[i][k] = kit_pm(107 + k, i), d_dot[i][k] = kit_pm(110 + k, i);
        }
    for (int i = 0; i < N; i++) bars[i].path = kit_pm(113, i);
    for (int i = 0; i < N * TAPS; i++) {
        tap_bars[i] = bars[(i * 7 + 3) % N];
        tap_bars[i].path = kit_pm(114, i);
    }
    KIT_CHECK(imp_bend_trace(f, &o, &rays, exits, tap_exits, &stats));
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.theta = bar, g.x = x_bar, g.d = d_bar, g.energy = energy;
    KIT_CHECK(
        imp_bend_adjoint(f, &o, &rays, exits, tap_exits, bars, tap_bars, &g, &stats));
    KIT_CHECK(imp_bend_tangent(f, &o, &rays, dot, (const double(*)[3])x_dot,
                               (const double(*)[3])d_dot, dots, tap_dots));
    double left = 0, right = 0, scale = 0;
    for (size_t i = 0; i < n; i++) left += bar[i] * dot[i];
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++)
            left += x_bar[i][k] * x_dot[i][k] + d_bar[i][k] * d_dot[i][k];
        if (exits[i].flags & IMP_BEND_DROPPED) continue;
        right += pair(&bars[i], &dots[i], &scale);
        for (int t = 0; s->taps && t < TAPS; t++)
            if (!(tap_exits[i * TAPS + t].flags & IMP_BEND_TAP_MISSED))
                right += pair(&tap_bars[i * TAPS + t], &tap_dots[i * TAPS + t], &scale);
    }
    const int expected = s->strong ? N / 3 : N / 2;
    tap_ok(fabs(left - right) <= 1e-12 * scale && (int)stats.traced >= expected &&
               stats.reversal == 0,
           "dot test, %s, %s%s # %.1e, %d traced, %d reflected, reversal %.1e", s->name,
           imp__schemes[scheme].name, stored ? ", stored" : "",
           fabs(left - right) / scale, (int)stats.traced, (int)stats.reflected,
           stats.worst_reversal);
    free(bar), free(dot);
    kit_rays_free(&rays);
}

/* A C that knows x, v and the path of exits and taps. */
static double objective(const struct imp_bend_exit *e, size_t i,
                        struct imp_bend_cotangent *bar)
{
    double c = 0.3 * e->path * (1 + 0.1 * e->path);
    struct imp_bend_cotangent b = {.path = 0.3 * (1 + 0.2 * e->path)};
    for (int k = 0; k < 3; k++) {
        const double dx = e->x[k] - 0.1 * kit_pm(120 + k, i),
                     dv = e->v[k] - kit_pm(123 + k, i);
        c += 0.5 * dx * dx + 0.25 * dv * dv + 0.2 * e->x[k] * e->v[(k + 1) % 3];
        b.x[k] += dx + 0.2 * e->v[(k + 1) % 3];
        b.v[k] += 0.5 * dv;
        b.v[(k + 1) % 3] += 0.2 * e->x[k];
    }
    if (bar) *bar = b;
    return c;
}

static double total(const imp_field *f, const struct setup *s,
                    const struct imp_bend_options *o, const struct imp_bend_rays *rays,
                    const uint8_t *use, uint32_t *steps)
{
    struct imp_bend_exit e[N], te[N * TAPS];
    double c = 0;
    KIT_CHECK(imp_bend_trace(f, o, rays, e, te, NULL));
    for (int i = 0; i < N; i++) {
        if (!use[i]) continue;
        steps[i] = e[i].steps + 1000u * e[i].segments;
        c += objective(&e[i], (size_t)i, NULL);
        for (int t = 0; s->taps && t < TAPS; t++)
            if (!(te[i * TAPS + t].flags & IMP_BEND_TAP_MISSED))
                c += 0.5 * objective(&te[i * TAPS + t], (size_t)(i + 7), NULL);
    }
    return c;
}

/* Move the field, the origins or the directions by e along the dots. */
static void move(imp_field *f, const double *theta, const double *dot, int what, double e,
                 const struct imp_bend_rays *rays)
{
    double(*x)[3] = (double(*)[3])(uintptr_t)rays->x;
    double(*d)[3] = (double(*)[3])(uintptr_t)rays->d;
    const size_t n = imp_field_n_theta(f);
    double *moved = calloc(n, sizeof *moved);
    for (size_t i = 0; i < n; i++) moved[i] = theta[i] + (what == 0 ? e * dot[i] : 0);
    KIT_CHECK(imp_field_set_theta(f, moved));
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) {
            x[i][k] += what == 1 ? e * x_dot[i][k] : 0;
            d[i][k] += what == 2 ? e * d_dot[i][k] : 0;
        }
    free(moved);
}

/* Directional derivatives: a bump of the field, the origins, the directions. */
static void difference_test(imp_field *f, const struct setup *s,
                            enum imp_bend_scheme scheme)
{
    struct imp_bend_options o = {.size = sizeof o};
    options_of(s, scheme, &o);
    struct imp_bend_rays rays = kit_beam(N, s->z0, s->radius, s->strong ? 0.9 : 0.1);
    const size_t n = imp_field_n_theta(f);
    double *bar = calloc(n, sizeof *bar), *dot = calloc(n, sizeof *dot);
    double *theta = calloc(n, sizeof *theta);
    uint8_t use[N];
    uint32_t at0[N] = {0}, at1[N] = {0};
    int used = 0;
    const double eps = 1e-5;
    imp_field_get_theta(f, theta);
    for (size_t i = 0; i < n; i++) dot[i] = kit_pm(130, i);
    KIT_CHECK(imp_bend_trace(f, &o, &rays, exits, tap_exits, NULL));
    for (int i = 0; i < N; i++) use[i] = !(exits[i].flags & IMP_BEND_DROPPED);
    total(f, s, &o, &rays, use, at0);
    for (int what = 0; what < 3;
         what++) /* leave out rays whose number of steps changes */
        for (int side = -2; side <= 2; side += 4) {
            move(f, theta, dot, what, side * eps, &rays);
            total(f, s, &o, &rays, use, at1);
            move(f, theta, dot, what, -side * eps, &rays);
            for (int i = 0; i < N; i++) use[i] = use[i] && at0[i] == at1[i];
        }
    for (int i = 0; i < N; i++) {
        used += use[i];
        objective(&exits[i], (size_t)i, &bars[i]);
        for (int t = 0; t < TAPS; t++) {
            struct imp_bend_cotangent *b = &tap_bars[i * TAPS + t];
            objective(&tap_exits[i * TAPS + t], (size_t)(i + 7), b);
            for (int k = 0; k < 3; k++) b->x[k] *= 0.5, b->v[k] *= 0.5;
            b->path *= 0.5;
            if (!use[i]) memset(b, 0, sizeof *b);
        }
        if (!use[i]) memset(&bars[i], 0, sizeof bars[i]);
    }
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.theta = bar, g.x = x_bar, g.d = d_bar;
    KIT_CHECK(imp_bend_adjoint(f, &o, &rays, exits, tap_exits, bars, tap_bars, &g, NULL));
    double want[3] = {0}, scale[3] = {0}, err[3];
    for (size_t i = 0; i < n; i++)
        want[0] += bar[i] * dot[i], scale[0] += imp__sqr(bar[i] * dot[i]);
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) {
            want[1] += x_bar[i][k] * x_dot[i][k], want[2] += d_bar[i][k] * d_dot[i][k];
            scale[1] += imp__sqr(x_bar[i][k] * x_dot[i][k]);
            scale[2] += imp__sqr(d_bar[i][k] * d_dot[i][k]);
        }
    for (int what = 0; what < 3; what++) { /* fourth-order central difference */
        double sum = 0;
        for (int side = -2; side <= 2; side++) {
            static const double weight[5] = {1, -8, 0, 8, -1};
            if (side == 0) continue;
            move(f, theta, dot, what, side * eps, &rays);
            sum += weight[side + 2] * total(f, s, &o, &rays, use, at1);
            move(f, theta, dot, what, -side * eps, &rays);
        }
        err[what] = fabs(sum / (12 * eps) - want[what]) / sqrt(scale[what]);
    }
    KIT_CHECK(imp_field_set_theta(f, theta));
    /* With several segments a step may move from one to the next: a kink of O(t^2). */
    const double limit = s->strong ? 1e-5 : 1e-6;
    tap_ok(err[0] < limit && err[1] < limit && err[2] < limit && used > N / 3,
           "difference, %s, %s # field %.1e origin %.1e direction %.1e, %d rays", s->name,
           imp__schemes[scheme].name, err[0], err[1], err[2], used);
    free(bar), free(dot), free(theta);
    kit_rays_free(&rays);
}

/* The derivative with respect to a direction is the one to the vector as given: rays
 * depend on d/|d|, so with d three times as long it is a third, and none along d. */
static void length_test(const imp_field *f)
{
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    struct imp_bend_rays rays = kit_beam(N, -0.9, 0.5, 0.3);
    double(*d)[3] = (double(*)[3])(uintptr_t)rays.d;
    static double at[2][N][3];
    double third = 0, along = 0, size = 0;
    int used = 0;
    s.offset = 0.8;
    o.surfaces = &s, o.n_surfaces = 1, o.step = 0.05;
    for (int k = 0; k < 2; k++) {
        KIT_CHECK(imp_bend_trace(f, &o, &rays, exits, NULL, NULL));
        for (int i = 0; i < N; i++) objective(&exits[i], (size_t)i, &bars[i]);
        g.d = at[k];
        KIT_CHECK(imp_bend_adjoint(f, &o, &rays, exits, NULL, bars, NULL, &g, NULL));
        for (int i = 0; i < N; i++)
            for (int c = 0; c < 3; c++) d[i][c] *= k == 0 ? 3 : 1;
    }
    for (int i = 0; i < N; i++) {
        double dot = 0;
        used += !(exits[i].flags & IMP_BEND_DROPPED);
        for (int c = 0; c < 3; c++) {
            third = fmax(third, fabs(at[0][i][c] - 3 * at[1][i][c]));
            size = fmax(size, fabs(at[0][i][c]));
            dot += at[1][i][c] * d[i][c];
        }
        along = fmax(along, fabs(dot));
    }
    tap_ok(third < 1e-13 * size && along < 1e-13 * size && size > 0.1 && used > N / 2,
           "direction: derivative to the vector as given # 1/|d| %.1e, along %.1e", third,
           along);
    kit_rays_free(&rays);
}

/* Numbers of the surfaces themselves. */
static void surface_test(const imp_field *f, struct setup s)
{
    struct imp_bend_options o = {.size = sizeof o};
    struct imp_bend_rays rays = kit_beam(N, s.z0, s.radius, 0.1);
    double sb[4][8] = {{0}};
    uint8_t use[N];
    uint32_t steps[N];
    options_of(&s, IMP_BEND_LEAPFROG, &o);
    o.n_taps = 0;
    s.taps = false;
    o.surfaces = s.s;
    KIT_CHECK(imp_bend_trace(f, &o, &rays, exits, NULL, NULL));
    for (int i = 0; i < N; i++) {
        use[i] = !(exits[i].flags & IMP_BEND_DROPPED);
        objective(&exits[i], (size_t)i, &bars[i]);
    }
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.surfaces = sb;
    KIT_CHECK(imp_bend_adjoint(f, &o, &rays, exits, NULL, bars, NULL, &g, NULL));
    const bool plane = s.s[0].type == IMP_BEND_PLANE;
    double *where[5] = {plane ? &s.s[0].normal[0] : &s.s[0].centre[0],
                        plane ? &s.s[0].normal[1] : &s.s[0].centre[1],
                        plane ? &s.s[0].normal[2] : &s.s[0].centre[2],
                        plane ? &s.s[0].offset : &s.s[0].radius, &s.s[0].index};
    double norm = 1; /* the plane's n and offset are normalised: compare at unit length */
    if (plane) {
        norm = sqrt(1.0 + 0.2 * 0.2 + 0.1 * 0.1);
        for (int k = 0; k < 4; k++) *where[k] /= norm;
    }
    double worst = 0;
    for (int k = 0; k < 5; k++) {
        const double v = *where[k], eps = 1e-5;
        double c[2];
        for (int side = 0; side < 2; side++) {
            double n3[3] = {s.s[0].normal[0], s.s[0].normal[1], s.s[0].normal[2]};
            *where[k] = v + (side ? -eps : eps);
            if (plane && k < 3) { /* move n on the unit sphere */
                const double l = sqrt(s.s[0].normal[0] * s.s[0].normal[0] +
                                      s.s[0].normal[1] * s.s[0].normal[1] +
                                      s.s[0].normal[2] * s.s[0].normal[2]);
                for (int m = 0; m < 3; m++) s.s[0].normal[m] /= l;
            }
            c[side] = total(f, &s, &o, &rays, use, steps);
            memcpy(s.s[0].normal, n3, sizeof n3);
            *where[k] = v;
        }
        worst = fmax(worst,
                     fabs((c[0] - c[1]) / (2 * eps) - sb[0][k]) / (1 + fabs(sb[0][k])));
    }
    tap_ok(worst < 1e-6, "numbers of the surface, %s # worst %.1e, d/d offset %.4f",
           s.name, worst, sb[0][3]);
    kit_rays_free(&rays);
}

int main(void)
{
    kit_begin(2);
    sdf = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 12, 1.2, 0);
    struct imp_field_grid d = {.size = sizeof d};
    KIT_CHECK(imp_field_get_grid(sdf, &d));
    double *t = calloc(imp_field_n_theta(sdf), sizeof *t);
    size_t at = 0;
    for (int k = -1; k <= d.cells[2] + 1; k++)
        for (int j = -1; j <= d.cells[1] + 1; j++)
            for (int i = -1; i <= d.cells[0] + 1; i++) {
                const int p[3] = {i, j, k};
                double r2 = 0;
                for (int a = 0; a < 3; a++)
                    r2 += imp__sqr(d.lo[a] + (d.hi[a] - d.lo[a]) * p[a] / d.cells[a]);
                t[at++] = sqrt(r2) - 0.9;
            }
    KIT_CHECK(imp_field_set_theta(sdf, t));
    free(t);
    mesh_make();
    setups_make();
    imp_field *f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 8, 1.2, 0.05);
    imp_field *lin = kit_grid(IMP_FIELD_TRILINEAR, IMP_FIELD_ETA, 8, 1.2, 0.03);
    for (int i = 0; i < n_setups; i++) {
        for (int scheme = 0; scheme < IMP_BEND_N_SCHEMES; scheme++)
            dot_test(f, &setups[i], scheme, false);
        dot_test(f, &setups[i], IMP_BEND_LEAPFROG, true);
        dot_test(lin, &setups[i], IMP_BEND_LEAPFROG, false);
    }
    for (int i = 0; i < n_setups; i++)
        for (int scheme = 0; scheme < IMP_BEND_N_SCHEMES; scheme++)
            difference_test(f, &setups[i], scheme);
    length_test(f);
    surface_test(f, setups[1]);
    surface_test(f, setups[2]);
    surface_test(f, setups[7]);
    setups[1].s[0].event = IMP_BEND_REFRACT;
    surface_test(f, setups[1]);
    imp_field_destroy(f);
    imp_field_destroy(lin);
    imp_field_destroy(sdf);
    imp_scene_destroy(mesh);
    imp_context_destroy(kit_ctx);
    return tap_done();
}
