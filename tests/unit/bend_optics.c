/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays against closed forms: parabolas, Luneburg, the fish-eye's circles, rods, Snell,
 * plumes; orders of convergence; what is conserved. References: docs/bent-rays.md 6. */
#include "bend_kit.h"

static struct imp_bend_exit trace_one(const imp_field *f, struct imp_bend_options *o,
                                      const double x[3], const double d[3])
{
    struct imp_bend_exit e;
    double xs[1][3] = {{x[0], x[1], x[2]}}, ds[1][3] = {{d[0], d[1], d[2]}};
    const struct imp_bend_rays r = {.size = sizeof(struct imp_bend_rays),
                                    .n = 1,
                                    .x = (const double(*)[3])xs,
                                    .d = (const double(*)[3])ds,
                                    .group = NULL};
    KIT_CHECK(imp_bend_trace(f, o, &r, &e, NULL, NULL));
    return e;
}

static struct imp_bend_surface plane_z(double z)
{
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    s.offset = z;
    return s;
}

static void straight(void)
{
    const double p[4] = {1.7, 0, 0, 0}, x[3] = {0.1, 0.2, -1}, d[3] = {0.3, -0.2, 1};
    imp_field *f = kit_profile("constant", p, NULL);
    struct imp_bend_surface s = plane_z(2);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.surfaces = &s, o.n_surfaces = 1, o.step = 0.0173;
    for (int k = 0; k < IMP_BEND_N_SCHEMES; k++) {
        o.scheme = k;
        const struct imp_bend_exit e = trace_one(f, &o, x, d);
        const double l = 3 * sqrt(1 + 0.13);
        const double off = fmax(fmax(fabs(e.x[0] - 1.0), fabs(e.x[1] + 0.4)),
                                fmax(fabs(e.x[2] - 2), fabs(e.path / (1.7 * l) - 1)));
        tap_ok(off < 2e-14, "constant index, %s: straight, path n l # %.1e",
               imp__schemes[k].name, off);
    }
    imp_field_destroy(f);
}

static void parabola(void)
{
    const double p[5] = {1.5, 0.2, 0, 0, 0}, axis[3] = {1, 0, 0}, x[3] = {0.1, 0.2, 0},
                 d[3] = {0.1, 0.3, 1};
    imp_field *f = kit_profile("linear", p, axis);
    struct imp_bend_surface s = plane_z(2);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.surfaces = &s, o.n_surfaces = 1, o.step = 0.037;
    const enum imp_bend_scheme exact[] = {IMP_BEND_LEAPFROG, IMP_BEND_VERLET,
                                          IMP_BEND_YOSHIDA4};
    for (int k = 0; k < 3; k++) {
        o.scheme = exact[k];
        const struct imp_bend_exit e = trace_one(f, &o, x, d);
        const double l = sqrt(1 + 0.1), eta = sqrt(2.25 + 2 * 0.2 * 0.1);
        const double sigma = 2 / (eta / l);
        const double want = 0.1 + eta * 0.1 / l * sigma + 0.2 * sigma * sigma / 2;
        tap_near(e.x[0], want, 0, 2e-15 * 4,
                 "linear in eta^2: the parabola, to rounding");
    }
    imp_field_destroy(f);
}

/* sigma = pi/2 in 64 steps: no exit surface, so steps by hand. */
static void luneburg(void)
{
    const double p[4] = {1, 0, 0, 0};
    imp_field *f = kit_profile("luneburg", p, NULL);
    static const struct {
        enum imp_bend_scheme s;
        double want;
    } rows[] = {{IMP_BEND_EULER, 1.2e-2},
                {IMP_BEND_LEAPFROG, 7.3e-5},
                {IMP_BEND_YOSHIDA4, 3.6e-8}};
    for (int k = 0; k < 3; k++) {
        double worst = 0, path = 0;
        for (int i = 0; i < 10; i++) {
            const double b = 0.05 + 0.1 * i;
            /* A parallel ray meets the sphere at (b, 0, -sqrt(1 - b^2)), |v| = 1. */
            imp_v3 x = imp__v3(b, 0, -sqrt(1 - b * b)), v = imp__v3(0, 0, 1);
            double s = 1 - sqrt(1 - b * b); /* from the tangent plane */
            for (int n = 0; n < 64; n++)
                imp__step(&imp__schemes[rows[k].s], f, IMP_PI / 2 / 64, 1, &x, &v, &s);
            worst = fmax(worst, imp__length(x - imp__v3(0, 0, 1)));
            path = fmax(path, fabs(s - (1 + IMP_PI / 2)));
        }
        tap_ok(worst > 0.8 * rows[k].want && worst < 1.2 * rows[k].want,
               "Luneburg, %s, 64 steps: miss of the focus # %.2e, published here %.1e",
               imp__schemes[rows[k].s].name, worst, rows[k].want);
        if (rows[k].s == IMP_BEND_YOSHIDA4)
            tap_ok(path < 1e-6, "Luneburg: all optical paths R(1 + pi/2) # worst %.1e",
                   path);
    }
    imp_field_destroy(f);
}

/* From the rim, where the gradient jumps: x = b cos(sigma) of the ray at height b, which
 * is at z = 0 for tan(sigma) = sqrt(1 - b^2). Schemes that begin with a kick keep their
 * order. */
static double rim_error(const imp_field *f, enum imp_bend_scheme scheme, double t)
{
    struct imp_bend_surface s = plane_z(0);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    double sum = 0;
    o.surfaces = &s, o.n_surfaces = 1, o.scheme = scheme, o.step = t, o.grazing = -1;
    for (int i = 0; i < 20; i++) {
        const double b = 0.03 + 0.045 * i, x[3] = {b, 0, -sqrt(1 - b * b)},
                     d[3] = {0, 0, 1};
        const struct imp_bend_exit e = trace_one(f, &o, x, d);
        sum += imp__sqr(e.x[0] - b * cos(atan(sqrt(1 - b * b))));
    }
    return sqrt(sum / 20);
}
static void rim(void)
{
    const double p[4] = {1, 0, 0, 0};
    imp_field *f = kit_profile("luneburg", p, NULL);
    for (int k = 0; k < IMP_BEND_N_SCHEMES; k++) {
        const double t = 0.05, a = rim_error(f, k, t), h = rim_error(f, k, t / 2);
        const double order = log2(a / h);
        tap_ok(fabs(order - imp__schemes[k].order) < 0.1,
               "%s from the rim of a Luneburg lens: order %d # %.2f, error %.1e",
               imp__schemes[k].name, imp__schemes[k].order, order, h);
    }
    imp_field_destroy(f);
}

/* From the pole the ray is a circle; at z = 0 it is known. */
static double fisheye_error(const imp_field *f, enum imp_bend_scheme scheme, double t)
{
    struct imp_bend_surface s = plane_z(0);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.scheme = scheme, o.surfaces = &s, o.n_surfaces = 1, o.step = t, o.grazing = -1;
    double sum = 0;
    for (int i = 0; i < 20; i++) {
        /* Circles of the fish-eye (a = 1) through (0, 0, -1) pass (0, 0, 1): centre (-c,
         * 0, 0), radius sqrt(1 + c^2); start direction at angle phi from +z, tan(phi) =
         * 1/c... */
        const double phi = 0.05 + 0.06 * i, c = -cos(phi) / sin(phi);
        const double x[3] = {0, 0, -1}, d[3] = {sin(phi), 0, cos(phi)};
        const double want = c + sqrt(1 + c * c);
        const struct imp_bend_exit e = trace_one(f, &o, x, d);
        sum += imp__sqr(e.x[0] - want);
    }
    return sqrt(sum / 20);
}

static void fisheye(void)
{
    const double p[5] = {2, 1, 0, 0, 0};
    imp_field *f = kit_profile("maxwell", p, NULL);
    static const struct {
        enum imp_bend_scheme s;
        double order;
    } rows[] = {{IMP_BEND_EULER, 1},    {IMP_BEND_LEAPFROG, 2}, {IMP_BEND_VERLET, 2},
                {IMP_BEND_YOSHIDA4, 4}, {IMP_BEND_ARC, 2},      {IMP_BEND_ARC_INDEX, 1}};
    for (int k = 0; k < 6; k++) {
        const double t =
            rows[k].order == 1 ? 0.0102 : 0.081; /* Euler's order shows late */
        const double e0 = fisheye_error(f, rows[k].s, t),
                     e1 = fisheye_error(f, rows[k].s, t / 8);
        const double order = log(e0 / e1) / log(8);
        tap_ok(fabs(order - rows[k].order) < 0.1,
               "fish-eye, %s: order %g # %.2f (%.1e, %.1e)", imp__schemes[rows[k].s].name,
               rows[k].order, order, e0, e1);
    }
    /* Imaging: x0 goes to -x0 (|x0| = 1), optical path n0 a pi/2. */
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    s.type = IMP_BEND_APPROACH;
    s.centre[2] = 1;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.scheme = IMP_BEND_YOSHIDA4, o.surfaces = &s, o.n_surfaces = 1, o.step = 0.01;
    const double x[3] = {0, 0, -1}, d[3] = {0.5, 0.2, 1};
    const struct imp_bend_exit e = trace_one(f, &o, x, d);
    tap_ok(fabs(e.x[0]) + fabs(e.x[1]) + fabs(e.x[2] - 1) < 2e-8 &&
               fabs(e.path - IMP_PI) < 1e-7,
           "fish-eye: images to the antipode, path n0 a pi/2 # %.1e %.1e",
           hypot(e.x[0], e.x[1]), e.path - IMP_PI);
    imp_field_destroy(f);
}

static void rods(void)
{
    const double n0 = 1.6, g = 0.33, p[5] = {n0, g, 0, 0, 0};
    imp_field *f = kit_profile("rod", p, NULL);
    /* Closed form of the discrete leapfrog: x_N = x_0 cos(N w t), w = (2/t) asin(n0 g
     * t/2). */
    const double t = 0.1, w = 2 / t * asin(n0 * g * t / 2);
    imp_v3 x = imp__v3(0.3, 0, 0), v = imp__v3(0, 0, n0 * sqrt(1 - imp__sqr(g * 0.3)));
    double path = 0, worst = 0;
    for (int i = 1; i <= 300; i++) {
        imp__step(&imp__schemes[IMP_BEND_VERLET], f, t, 1, &x, &v, &path);
        worst = fmax(worst, fabs(x[0] - 0.3 * cos(i * w * t)));
    }
    tap_ok(worst < 1e-13, "rod: the leapfrog's own closed form # %.1e", worst);

    /* Pitch of a meridional ray: back on the axis at 2 pi cos(0.25)/g = 18.448049. */
    struct imp_bend_surface s = plane_z(2 * IMP_PI * cos(0.25) / g);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.scheme = IMP_BEND_YOSHIDA4, o.surfaces = &s, o.n_surfaces = 1, o.step = 0.02;
    const double x0[3] = {0, 0, 0}, d0[3] = {sin(0.25), 0, cos(0.25)};
    struct imp_bend_exit e = trace_one(f, &o, x0, d0);
    tap_near(s.offset, 18.448049, 1e-7, 0, "rod: pitch of a meridional ray");
    tap_near(e.x[0], 0, 0, 2e-8, "rod: the ray is back on the axis there");

    /* Quarter pitch, flat faces in air: object at l1 = 10, a height goes to -0.189394 of
     * it at l2 = 0.358701 behind (ray matrix; docs/bent-rays.md 6). */
    const double L = 4.759989;
    struct imp_bend_surface faces[2] = {plane_z(0), plane_z(L)};
    faces[0].normal[2] = -1;
    faces[0].event = faces[1].event = IMP_BEND_REFRACT;
    o.surfaces = faces, o.n_surfaces = 2, o.outside = 1, o.step = 0.01;
    const double from[3] = {0.001, 0, -10}, slope = 0.00005;
    double height = 0;
    for (int k = 0; k < 2; k++) {
        const double d[3] = {k ? -slope : slope, 0, 1};
        e = trace_one(f, &o, from, d);
        height += 0.5 * (e.x[0] + e.v[0] / e.v[2] * 0.358701);
    }
    tap_near(height, -0.000189394, 1e-5, 0, "rod, quarter pitch in air: image height");
    /* Parallel ray: focal length f = 1/(n0 g sin gL) = 1.893939. */
    const double high[3] = {0.001, 0, -1}, along[3] = {0, 0, 1};
    e = trace_one(f, &o, high, along);
    tap_near(-0.001 * e.v[2] / e.v[0], 1.893939, 1e-6, 0, "rod: focal length");
    imp_field_destroy(f);

    /* sech rod: sinh(g x(z)) = sinh(g x0) cos(g z) + cosh(g x0) tan(th) sin(g z). */
    const double q[5] = {1.5, 0.8, 0, 0, 0};
    f = kit_profile("sech", q, NULL);
    struct imp_bend_surface end = plane_z(3);
    o.surfaces = &end, o.n_surfaces = 1, o.outside = 0, o.step = 0.0025;
    worst = 0;
    for (int k = -4; k <= 4; k++) {
        const double th = 0.05 * k, xs[3] = {0.4, 0, 0}, d[3] = {sin(th), 0, cos(th)};
        e = trace_one(f, &o, xs, d);
        const double want =
            asinh(sinh(0.32) * cos(2.4) + cosh(0.32) * tan(th) * sin(2.4)) / 0.8;
        worst = fmax(worst, fabs(e.x[0] - want));
    }
    tap_ok(worst < 5e-12, "sech rod: closed form # %.1e", worst);
    imp_field_destroy(f);
}

static void snell(void)
{
    imp_v3 n = imp__normalize(imp__v3(0.2, -0.5, 0.8));
    const struct imp_frame fr = imp__frame_from_normal(n);
    double worst = 0;
    int reflected = 0;
    for (int i = 0; i < 100; i++) {
        const double th = 1.55 * i / 100, e1 = i % 2 ? 1.5 : 1.0, e2 = i % 2 ? 1.0 : 1.5;
        const double c = i % 3 ? cos(th) : -cos(th);
        const imp_v3 v = imp__to_world(&fr, imp__v3(e1 * sin(th), 0, e1 * c));
        struct imp__bend_turn t;
        imp__bend_turn(&n, &v, e2, false, &t);
        const imp_v3 local = imp__to_local(&fr, t.v);
        reflected += t.reflected;
        if (t.reflected != (e1 * sin(th) > e2)) worst = 1;
        const double c2 =
            t.reflected ? -e1 * c : copysign(sqrt(e2 * e2 - imp__sqr(e1 * sin(th))), c);
        worst = fmax(worst, fabs(local[0] - e1 * sin(th)) + fabs(local[2] - c2));
    }
    tap_ok(worst < 4e-15 && reflected > 20,
           "Snell, total reflection # %.1e, %d reflected", worst, reflected);
    /* Steep but smooth layer, 1 to 1.5: Snell's limit holds for any profile across z. */
    const double p[8] = {1.25, 0.25 * 1.5, 0, -0.125, 0, 0, 0, 0}, axis[3] = {0, 0, 1};
    imp_field *f = kit_profile("axial", p, axis); /* 1.25 + .375 z - .125 z^3: 1 .. 1.5 */
    struct imp_bend_surface s = plane_z(1);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.scheme = IMP_BEND_YOSHIDA4, o.surfaces = &s, o.n_surfaces = 1, o.step = 0.01;
    const double x[3] = {0, 0, -1}, d[3] = {0.6, 0, 0.8};
    const struct imp_bend_exit e = trace_one(f, &o, x, d);
    tap_near(e.v[0] / 1.5, 0.6 / 1.5, 1e-14, 0, "layered medium: n sin is kept");
    tap_near(e.norm2, 2.25, 1e-9, 0, "layered medium: |v| is the index");
    imp_field_destroy(f);
}

static void plume(void)
{
    /* Deflection at impact p tends to -b (p/s) sqrt(2 pi) exp(-p^2/2s^2)/n0 as b falls.
     */
    double err[2];
    for (int k = 0; k < 2; k++) {
        const double b = k ? 1e-4 : 1e-3, pr[6] = {1, b, 0.2, 0, 0, 0};
        imp_field *f = kit_profile("plume", pr, NULL);
        struct imp_bend_surface s = plane_z(2);
        struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
        o.scheme = IMP_BEND_YOSHIDA4, o.surfaces = &s, o.n_surfaces = 1, o.step = 0.01;
        const double x[3] = {0.15, 0, -2}, d[3] = {0, 0, 1};
        const struct imp_bend_exit e = trace_one(f, &o, x, d);
        const double want = -b * 0.75 * sqrt(2 * IMP_PI) * exp(-0.5 * 0.75 * 0.75);
        err[k] = fabs(e.v[0] / want - 1);
        imp_field_destroy(f);
    }
    tap_ok(err[0] < 5e-3 && err[0] / err[1] > 8 && err[0] / err[1] < 12,
           "plume: weak deflection, error falls with b # %.1e %.1e", err[0], err[1]);
}

static void invariants(void)
{
    const double p[5] = {2, 1, 0, 0, 0};
    imp_field *f = kit_profile("maxwell", p, NULL);
    for (int k = 0; k <= IMP_BEND_ARC; k++) {
        imp_v3 x = imp__v3(0.1, 0.2, -0.9), v, m0;
        struct imp__jet j;
        double path = 0, worst = 0;
        imp__field_eval1(f, &x, 1, &j);
        v = imp__normalize(imp__v3(0.5, -0.1, 0.7)) * j.eta;
        const imp_v3 x0 = x;
        m0 = imp__cross(x, v);
        for (int i = 0; i < 2000; i++) {
            imp__step(&imp__schemes[k], f, 0.01, 1, &x, &v, &path);
            worst = fmax(worst, imp__length(imp__cross(x, v) - m0));
        }
        tap_ok(worst < 1e-12, "%s: x cross v over 2000 steps # %.1e",
               imp__schemes[k].name, worst);
        struct imp__back b = {.x = {x}, .v = {v}};
        for (int i = 0; i < 2000; i++)
            imp__step_adjoint(&imp__schemes[k], f, 0.01, 1, &b, NULL, NULL);
        const double off = imp__length(b.x[0] - x0);
        tap_ok(off < 1e-12, "%s: 2000 steps reversed # %.1e", imp__schemes[k].name, off);
    }
    imp_field_destroy(f);
}

/* Grids whose nodes carry the analytic Luneburg index (docs/bent-rays.md 6). */
static double luneburg_grid(enum imp_field_interp interp, enum imp_bend_scheme scheme,
                            int nodes, double ds, double *drift)
{
    struct imp_field_grid d = IMP_FIELD_GRID_INIT;
    imp_field *f;
    const int M = nodes - 1;
    d.interp = interp;
    for (int k = 0; k < 3; k++) d.cells[k] = M, d.lo[k] = -1, d.hi[k] = 1;
    KIT_CHECK(imp_field_grid_create(kit_ctx, &d, 1, &f));
    const int extra = interp == IMP_FIELD_SPLINE, m = M + 1 + 2 * extra;
    double *t = malloc((size_t)m * m * m * sizeof *t);
    const double h = 2.0 / M;
    for (int k = 0; k < m; k++)
        for (int j = 0; j < m; j++)
            for (int i = 0; i < m; i++) {
                const double x = -1 + h * (i - extra), y = -1 + h * (j - extra),
                             z = -1 + h * (k - extra), r2 = x * x + y * y + z * z;
                t[i + (size_t)m * (j + (size_t)m * k)] = r2 < 1 ? sqrt(2 - r2) : 1;
            }
    KIT_CHECK(imp_field_set_theta(f, t));
    free(t);
    struct imp_bend_surface s = plane_z(1);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.scheme = scheme, o.surfaces = &s, o.n_surfaces = 1, o.grazing = -1;
    /* "ds" is the spatial step in front of the lens, where eta = 1: t = ds */
    o.step = ds * h;
    const size_t n = 3000;
    struct imp_bend_rays r = kit_beam(n, -1, 0.9, 0);
    struct imp_bend_exit *e = calloc(n, sizeof *e);
    KIT_CHECK(imp_bend_trace(f, &o, &r, e, NULL, NULL));
    double sum = 0, worst = 0, used = 0;
    for (size_t i = 0; i < n; i++) {
        if (e[i].flags & IMP_BEND_DROPPED) continue;
        sum += e[i].x[0] * e[i].x[0] + e[i].x[1] * e[i].x[1];
        worst = fmax(worst, fabs(sqrt(e[i].norm2) - 1));
        used++;
    }
    if (drift) *drift = worst;
    free(e);
    kit_rays_free(&r);
    imp_field_destroy(f);
    return sqrt(sum / used);
}

static void grids(void)
{
    double drift;
    const double a = luneburg_grid(IMP_FIELD_TRILINEAR, IMP_BEND_EULER, 65, 0.5, &drift);
    tap_ok(fabs(a / 7.5e-3 - 1) < 0.15,
           "trilinear 65^3, Euler h/2: rms focus 7.5e-3 # %.2e", a);
    tap_ok(drift > 1e-2 && drift < 2.2e-2, "same: |v| off 1 at the exit # %.1e", drift);
    const double c = luneburg_grid(IMP_FIELD_SPLINE, IMP_BEND_LEAPFROG, 65, 0.5, NULL);
    tap_ok(fabs(c / 9.2e-4 - 1) < 0.25,
           "cubic 65^3, leapfrog h/2: rms focus 9.2e-4 # %.2e", c);
    const double l = luneburg_grid(IMP_FIELD_TRILINEAR, IMP_BEND_LEAPFROG, 65, 1, NULL);
    const double e16 =
        luneburg_grid(IMP_FIELD_TRILINEAR, IMP_BEND_EULER, 65, 1.0 / 16, NULL);
    tap_ok(l < 1.06 * e16,
           "trilinear: leapfrog at h is at the floor that Euler reaches at h/16 "
           "# %.2e %.2e",
           l, e16);
}

int main(void)
{
    kit_begin(1);
    straight();
    parabola();
    luneburg();
    rim();
    fisheye();
    rods();
    snell();
    plume();
    invariants();
    grids();
    imp_context_destroy(kit_ctx);
    return tap_done();
}
