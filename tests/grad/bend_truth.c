/* SPDX-License-Identifier: Apache-2.0
 *
 * The adjoint of bent rays against three independent truths: dual numbers through a
 * tracer written for this test, central differences over seven decades of step (cubic and
 * trilinear: docs/bent-rays.md 3.3), and a plain adjoint written here in which errors can
 * be planted, each of which must be caught. */
#include "bend_kit.h"

/* ---- Dual numbers, a spline by Cox-de Boor, leapfrog, exit --------------------- */

typedef struct {
    double v, d;
} dual;
static dual D(double v) { return (dual){v, 0}; }
static dual add(dual a, dual b) { return (dual){a.v + b.v, a.d + b.d}; }
static dual sub(dual a, dual b) { return (dual){a.v - b.v, a.d - b.d}; }
static dual mul(dual a, dual b) { return (dual){a.v * b.v, a.d * b.v + a.v * b.d}; }
static dual quo(dual a, dual b)
{
    return (dual){a.v / b.v, (a.d - a.v / b.v * b.d) / b.v};
}

/* Cubic B-spline with knots 0..4 at s, by the recursion; order: 4 cubic, 3 quadratic ...
 */
static dual bspline(int order, dual s)
{
    if (order == 1) return D(s.v >= 0 && s.v < 1 ? 1 : 0);
    return add(
        mul(quo(s, D(order - 1)), bspline(order - 1, s)),
        mul(quo(sub(D(order), s), D(order - 1)), bspline(order - 1, sub(s, D(1)))));
}

struct dfield {
    struct imp_field_grid g;
    int m[3];
    const double *theta, *dot;
};

/* Value and gradient as duals in x and theta together. */
static void dfield_eval(const struct dfield *f, const dual x[3], dual *eta, dual g[3])
{
    dual w[3][4], wd[3][4];
    int first[3];
    for (int k = 0; k < 3; k++) {
        const double h = (f->g.hi[k] - f->g.lo[k]) / f->g.cells[k];
        const dual u = quo(sub(x[k], D(f->g.lo[k])), D(h));
        first[k] = (int)floor(u.v);
        for (int a = 0; a < 4;
             a++) { /* node first + a - 1, support (node - 2, node + 2) */
            const dual s = sub(u, D(first[k] + a - 1 - 2));
            w[k][a] = bspline(4, s);
            wd[k][a] = quo(sub(bspline(3, s), bspline(3, sub(s, D(1)))), D(h));
        }
    }
    *eta = g[0] = g[1] = g[2] = D(0);
    for (int c = 0; c < 4; c++)
        for (int b = 0; b < 4; b++)
            for (int a = 0; a < 4; a++) {
                const size_t i =
                    (size_t)(first[0] + a) +
                    (size_t)f->m[0] * ((size_t)(first[1] + b) +
                                       (size_t)f->m[1] * (size_t)(first[2] + c));
                const dual t = {f->theta[i], f->dot[i]};
                *eta = add(*eta, mul(t, mul(w[0][a], mul(w[1][b], w[2][c]))));
                g[0] = add(g[0], mul(t, mul(wd[0][a], mul(w[1][b], w[2][c]))));
                g[1] = add(g[1], mul(t, mul(w[0][a], mul(wd[1][b], w[2][c]))));
                g[2] = add(g[2], mul(t, mul(w[0][a], mul(w[1][b], wd[2][c]))));
            }
}

static void dstep(const struct dfield *f, dual t, dual x[3], dual v[3])
{
    dual eta, g[3];
    for (int k = 0; k < 3; k++) x[k] = add(x[k], mul(mul(D(0.5), t), v[k]));
    dfield_eval(f, x, &eta, g);
    for (int k = 0; k < 3; k++) v[k] = add(v[k], mul(t, mul(eta, g[k])));
    for (int k = 0; k < 3; k++) x[k] = add(x[k], mul(mul(D(0.5), t), v[k]));
}

static dual dplane(const double n[3], double p, const dual x[3])
{
    dual s = D(-p);
    for (int k = 0; k < 3; k++) s = add(s, mul(D(n[k]), x[k]));
    return s;
}

static dual dobjective(const dual x[3], const dual v[3], size_t i)
{
    dual c = D(0);
    for (int k = 0; k < 3; k++) {
        const dual dx = sub(x[k], D(0.3 * kit_pm(200 + k, i)));
        const dual dv = sub(v[k], D(kit_pm(203 + k, i)));
        c = add(c, add(mul(D(0.5), mul(dx, dx)), mul(D(0.25), mul(dv, dv))));
        c = add(c, mul(D(0.2), mul(x[k], v[(k + 1) % 3])));
    }
    return c;
}

static dual dray(const struct dfield *f, const double x0[3], const double d0[3], double t,
                 const double n[3], double p, size_t ray)
{
    dual x[3], v[3], eta, g[3];
    double l = sqrt(d0[0] * d0[0] + d0[1] * d0[1] + d0[2] * d0[2]);
    for (int k = 0; k < 3; k++) x[k] = D(x0[k]);
    dfield_eval(f, x, &eta, g);
    for (int k = 0; k < 3; k++) v[k] = mul(eta, D(d0[k] / l));
    for (;;) {
        dual y[3] = {x[0], x[1], x[2]}, w[3] = {v[0], v[1], v[2]};
        dstep(f, D(t), y, w);
        if (dplane(n, p, y).v > 0) break;
        memcpy(x, y, sizeof y);
        memcpy(v, w, sizeof w);
    }
    /* tau by secants on values, then one Newton step on duals brings its derivative. */
    double a = 0, b = t;
    for (int i = 0; i < 200; i++) {
        const double mid = (a + b) / 2;
        dual y[3] = {x[0], x[1], x[2]}, w[3] = {v[0], v[1], v[2]};
        dstep(f, D(mid), y, w);
        if (dplane(n, p, y).v > 0) b = mid;
        else a = mid;
    }
    dual y[3] = {x[0], x[1], x[2]}, w[3] = {v[0], v[1], v[2]};
    dstep(f, D(a), y, w);
    const double e = 1e-6;
    dual yp[3] = {x[0], x[1], x[2]}, wp[3] = {v[0], v[1], v[2]};
    dual ym[3] = {x[0], x[1], x[2]}, wm[3] = {v[0], v[1], v[2]};
    /* dG/dtau: exact, by a dual that moves tau alone (theta frozen). */
    static double *zero;
    static size_t zero_n;
    const size_t need = (size_t)f->m[0] * f->m[1] * f->m[2];
    if (zero_n < need) zero = realloc(zero, need * sizeof *zero), zero_n = need;
    memset(zero, 0, need * sizeof *zero);
    struct dfield frozen = *f;
    frozen.dot = zero;
    for (int k = 0; k < 3; k++) yp[k].d = wp[k].d = ym[k].d = wm[k].d = 0;
    (void)e, (void)ym, (void)wm;
    dstep(&frozen, (dual){a, 1}, yp, wp);
    const dual tau = {a, -dplane(n, p, y).d / dplane(n, p, yp).d};
    dstep(f, tau, x, v);
    return dobjective(x, v, ray);
}

/* ---- The production adjoint on the same rays ----------------------------------- */

#define N 24

struct problem {
    imp_field *f;
    struct imp_bend_surface s;
    struct imp_bend_options o;
    struct imp_bend_rays rays;
    struct imp_bend_exit exits[N];
    struct imp_bend_cotangent bars[N];
};

static void bars_make(struct problem *p)
{
    KIT_CHECK(imp_bend_trace(p->f, &p->o, &p->rays, p->exits, NULL, NULL));
    for (size_t i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) {
            const struct imp_bend_exit *e = &p->exits[i];
            p->bars[i].path = 0;
            p->bars[i].x[k] =
                e->x[k] - 0.3 * kit_pm(200 + k, i) + 0.2 * e->v[(k + 1) % 3];
            p->bars[i].v[k] =
                0.5 * (e->v[k] - kit_pm(203 + k, i)) + 0.2 * e->x[(k + 2) % 3];
        }
}

static void problem_make(struct problem *p)
{
    p->f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 16, 1, 0);
    struct imp_field_grid g = {.size = sizeof g};
    KIT_CHECK(imp_field_get_grid(p->f, &g));
    const size_t n = imp_field_n_theta(p->f);
    double *t = calloc(n, sizeof *t);
    for (size_t i = 0; i < n; i++)
        t[i] = 1.4 + 0.12 * kit_pm(210, i / 3) * kit_u(211, i / 50);
    KIT_CHECK(imp_field_set_theta(p->f, t));
    free(t);
    p->s = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    p->s.normal[0] = 0.3, p->s.normal[1] = -0.15, p->s.normal[2] = 1;
    p->s.offset = 0.6;
    p->o = (struct imp_bend_options)IMP_BEND_OPTIONS_INIT;
    p->o.surfaces = &p->s, p->o.n_surfaces = 1, p->o.step = 0.033;
    p->rays = kit_beam(N, -0.8, 0.5, 0.2);
    bars_make(p);
}

static void against_duals(struct problem *p)
{
    const size_t n = imp_field_n_theta(p->f);
    double *bar = calloc(n, sizeof *bar), *dot = calloc(n, sizeof *dot),
           *theta = calloc(n, sizeof *theta);
    imp_field_get_theta(p->f, theta);
    for (size_t i = 0; i < n; i++) dot[i] = kit_pm(220, i);
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.theta = bar;
    KIT_CHECK(
        imp_bend_adjoint(p->f, &p->o, &p->rays, p->exits, NULL, p->bars, NULL, &g, NULL));
    double got = 0, want = 0, c = 0, c_prod = 0;
    for (size_t i = 0; i < n; i++) got += bar[i] * dot[i];
    struct dfield f = {.g = {.size = sizeof f.g}, .theta = theta, .dot = dot};
    KIT_CHECK(imp_field_get_grid(p->f, &f.g));
    for (int k = 0; k < 3; k++) f.m[k] = f.g.cells[k] + 3;
    const double l = sqrt(1 + 0.3 * 0.3 + 0.15 * 0.15);
    const double nn[3] = {0.3 / l, -0.15 / l, 1 / l};
    for (size_t i = 0; i < N; i++) {
        const dual d = dray(&f, p->rays.x[i], p->rays.d[i], 0.033, nn, 0.6 / l, i);
        dual x[3], v[3];
        for (int k = 0; k < 3; k++)
            x[k] = D(p->exits[i].x[k]), v[k] = D(p->exits[i].v[k]);
        c += d.v, want += d.d;
        c_prod += dobjective(x, v, i).v;
    }
    tap_near(c_prod, c, 1e-13, 0, "objective equals that of the independent tracer");
    tap_near(got, want, 1e-10, 0, "adjoint equals dual numbers");
    free(bar), free(dot), free(theta);
}

/* K = lam.v + mu.F is zero along the ray of the continuous problem
 * (docs/bent-rays.md 1.2): at the start it is what the discretisation leaves, O(t^p) with
 * p = 1 for Euler's scheme and 2 for leapfrog. How much of it depends on where in its last
 * step a ray leaves, so p is the slope of log K over steps in a geometric sequence, with
 * the standard error of a regression. */
static void energy_of_adjoint(struct problem *p)
{
    enum {
        FIRST = 10,
        LAST = 40
    }; /* t = .033 2^(-k/5); larger ones are not asymptotic */
    static const struct {
        enum imp_bend_scheme s;
        double order;
    } rows[] = {{IMP_BEND_EULER, 1}, {IMP_BEND_LEAPFROG, 2}};
    for (size_t k = 0; k < imp_count(rows); k++) {
        double x[LAST], y[LAST], xx = 0, xy = 0, rest = 0;
        struct tap_stat mean_x = {0}, mean_y = {0};
        for (int i = FIRST; i < LAST; i++) {
            struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
            double energy[N], sum = 0;
            p->o.scheme = rows[k].s;
            p->o.step = 0.033 * exp2(-i / 5.);
            g.energy = energy;
            bars_make(p);
            KIT_CHECK(imp_bend_adjoint(p->f, &p->o, &p->rays, p->exits, NULL, p->bars,
                                       NULL, &g, NULL));
            for (int r = 0; r < N; r++) sum += energy[r] * energy[r] / N;
            x[i] = log(p->o.step);
            y[i] = 0.5 * log(sum);
            tap_add(&mean_x, x[i]);
            tap_add(&mean_y, y[i]);
        }
        for (int i = FIRST; i < LAST; i++) {
            xx += (x[i] - mean_x.mean) * (x[i] - mean_x.mean);
            xy += (x[i] - mean_x.mean) * (y[i] - mean_y.mean);
        }
        const double slope = xy / xx;
        for (int i = FIRST; i < LAST; i++)
            rest += pow(y[i] - mean_y.mean - slope * (x[i] - mean_x.mean), 2);
        const double se = sqrt(rest / (LAST - FIRST - 2) / xx);
        const double z = (slope - rows[k].order) / se;
        tap_ok(fabs(z) < 4 && se < 0.03 * rows[k].order,
               "%s: K falls with the scheme's order # %.3f +- %.3f, z %.1f",
               imp__schemes[rows[k].s].name, slope, se, z);
    }
    p->o.scheme = IMP_BEND_LEAPFROG;
    p->o.step = 0.033;
    bars_make(p);
}

/* ---- Planted errors ------------------------------------------------------------ */

enum plant { NONE, RHO_WITHOUT_V, NO_RHO, NO_START, NO_H, WRONG_SIGN, CONTINUOUS_RHO };

/* The same adjoint once more, in plain code on public calls, with switches. */
static void plain_adjoint(struct problem *p, enum plant plant, double *bar)
{
    const double t = 0.033;
    const double l = sqrt(1 + 0.3 * 0.3 + 0.15 * 0.15);
    const double n[3] = {0.3 / l, -0.15 / l, 1 / l};
    struct imp_field_grid gd = {.size = sizeof gd};
    KIT_CHECK(imp_field_get_grid(p->f, &gd));
    for (int i = 0; i < N; i++) {
        const struct imp_bend_exit *e = &p->exits[i];
        double x[3], v[3], lam[3], mu[3], eta, g[3], H[6];
        memcpy(x, e->x, sizeof x), memcpy(v, e->v, sizeof v);
        /* rho with the discrete rates of the leapfrog's fractional step */
        double a[3], rx[3], rv[3], up = 0, down = 0, gx = 0;
        for (int k = 0; k < 3; k++) a[k] = x[k] - e->tau / 2 * v[k];
        imp_field_eval(p->f, a, &eta, g, H);
        const double M[3][3] = {
            {H[0], H[3], H[4]}, {H[3], H[1], H[5]}, {H[4], H[5], H[2]}};
        double v0[3];
        for (int k = 0; k < 3; k++)
            v0[k] = v[k] - e->tau * eta * g[k], gx += g[k] * v0[k] / 2;
        for (int k = 0; k < 3; k++) {
            double hx = 0;
            for (int m = 0; m < 3; m++) hx += M[k][m] * v0[m] / 2;
            rv[k] = eta * g[k] + e->tau * (gx * g[k] + eta * hx);
            rx[k] = (v0[k] + v[k]) / 2 + e->tau / 2 * rv[k];
            if (plant == CONTINUOUS_RHO) rx[k] = v[k], rv[k] = eta * g[k];
        }
        for (int k = 0; k < 3; k++) {
            up += p->bars[i].x[k] * rx[k];
            if (plant != RHO_WITHOUT_V) up += p->bars[i].v[k] * rv[k];
            down += n[k] * rx[k];
        }
        const double rho = plant == NO_RHO ? 0 : up / down;
        for (int k = 0; k < 3; k++)
            lam[k] = p->bars[i].x[k] - rho * n[k], mu[k] = p->bars[i].v[k];
        for (int s = -1; s < (int)e->steps; s++) {
            const double dt = s < 0 ? e->tau : t;
            for (int k = 0; k < 3; k++) x[k] -= dt / 2 * v[k], mu[k] += dt / 2 * lam[k];
            imp_field_eval(p->f, x, &eta, g, H);
            const double A[3][3] = {
                {H[0], H[3], H[4]}, {H[3], H[1], H[5]}, {H[4], H[5], H[2]}};
            double mg = 0, b[3];
            for (int k = 0; k < 3; k++) {
                v[k] -= dt * eta * g[k];
                mg += mu[k] * g[k];
                b[k] = dt * eta * mu[k];
                if (plant == NO_H) b[k] *= (gd.hi[k] - gd.lo[k]) / gd.cells[k];
                if (plant == WRONG_SIGN) b[k] = -b[k];
            }
            imp_field_splat(p->f, x, dt * mg, b, bar);
            for (int k = 0; k < 3; k++) {
                double hm = 0;
                for (int m = 0; m < 3; m++) hm += A[k][m] * mu[m];
                lam[k] += dt * (mg * g[k] + eta * hm);
            }
            for (int k = 0; k < 3; k++) x[k] -= dt / 2 * v[k], mu[k] += dt / 2 * lam[k];
        }
        if (plant == NO_START) continue;
        imp_field_eval(p->f, x, &eta, g, NULL);
        const double zero[3] = {0};
        imp_field_splat(p->f, x, (mu[0] * v[0] + mu[1] * v[1] + mu[2] * v[2]) / eta, zero,
                        bar);
    }
}

static void planted(struct problem *p)
{
    static const struct {
        enum plant plant;
        const char *name;
        double at_least;
    } rows[] = {{RHO_WITHOUT_V, "rho without C_v.F", 1e-3},
                {NO_RHO, "no rho", 1e-2},
                {NO_START, "no start term", 1e-3},
                {NO_H, "no 1/h in the splat", 1e-2},
                {WRONG_SIGN, "wrong sign", 1e-2},
                {CONTINUOUS_RHO, "rho of the continuous ray", 1e-8}};
    const size_t n = imp_field_n_theta(p->f);
    double *bar = calloc(n, sizeof *bar), *plain = calloc(n, sizeof *plain);
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.theta = bar;
    KIT_CHECK(
        imp_bend_adjoint(p->f, &p->o, &p->rays, p->exits, NULL, p->bars, NULL, &g, NULL));
    plain_adjoint(p, NONE, plain);
    double diff = 0, norm = 0;
    for (size_t i = 0; i < n; i++)
        diff += imp__sqr(bar[i] - plain[i]), norm += imp__sqr(bar[i]);
    tap_ok(sqrt(diff / norm) < 1e-12, "adjoint equals the plain one # %.1e",
           sqrt(diff / norm));
    for (size_t k = 0; k < imp_count(rows); k++) {
        memset(plain, 0, n * sizeof *plain);
        plain_adjoint(p, rows[k].plant, plain);
        diff = 0;
        for (size_t i = 0; i < n; i++) diff += imp__sqr(bar[i] - plain[i]);
        tap_ok(sqrt(diff / norm) > rows[k].at_least, "planted error is seen: %s # %.1e",
               rows[k].name, sqrt(diff / norm));
    }
    free(bar), free(plain);
}

/* ---- Seven decades of step: docs/bent-rays.md 3.3 ------------------------------ */

#define RAYS 1500

static double spot(const imp_field *f, const struct imp_bend_options *o,
                   const struct imp_bend_rays *r, struct imp_bend_exit *e,
                   struct imp_bend_cotangent *bars)
{
    double c = 0;
    KIT_CHECK(imp_bend_trace(f, o, r, e, NULL, NULL));
    for (size_t i = 0; i < r->n; i++) {
        for (int k = 0; k < 2; k++) {
            c += 0.5 * e[i].x[k] * e[i].x[k];
            if (bars) bars[i].x[k] = e[i].x[k];
        }
    }
    return c;
}

static void sweep(enum imp_field_interp interp)
{
    const bool spline = interp == IMP_FIELD_SPLINE;
    struct imp_field_grid d = IMP_FIELD_GRID_INIT;
    imp_field *f;
    d.interp = interp;
    for (int k = 0; k < 3; k++) d.cells[k] = 32, d.lo[k] = -1, d.hi[k] = 1;
    KIT_CHECK(imp_field_grid_create(kit_ctx, &d, 1, &f));
    const int m = spline ? 35 : 33;
    const size_t n = (size_t)m * m * m;
    double *theta = calloc(n, sizeof *theta), *bump = calloc(n, sizeof *bump),
           *moved = calloc(n, sizeof *moved), *bar = calloc(n, sizeof *bar);
    size_t at = 0;
    for (int k = 0; k < m; k++)
        for (int j = 0; j < m; j++)
            for (int i = 0; i < m; i++, at++) {
                const double h = 2.0 / 32, x = -1 + h * (i - spline),
                             y = -1 + h * (j - spline), z = -1 + h * (k - spline),
                             r2 = x * x + y * y + z * z;
                theta[at] = 1 + 0.5 * (r2 < 1 ? sqrt(2 - r2) - 1 : 0);
                bump[at] =
                    exp(-(imp__sqr(x - 0.2) + imp__sqr(y + 0.1) + imp__sqr(z)) / 0.18);
            }
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    s.offset = 1;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    o.scheme = IMP_BEND_EULER, o.surfaces = &s, o.n_surfaces = 1, o.step = 1.0 / 32;
    struct imp_bend_rays r = kit_beam(RAYS, -0.98, 0.8, 0);
    double(*x)[3] = (double(*)[3])(uintptr_t)r.x;
    for (size_t i = 0; i < RAYS; i++) x[i][2] += 0.01 * kit_pm(230, i); /* jitter */
    static struct imp_bend_exit e[RAYS];
    static struct imp_bend_cotangent bars[RAYS];
    KIT_CHECK(imp_field_set_theta(f, theta));
    spot(f, &o, &r, e, bars);
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    g.theta = bar;
    KIT_CHECK(imp_bend_adjoint(f, &o, &r, e, NULL, bars, NULL, &g, NULL));
    double want = 0, first = 0, last = 0, worst = 0;
    for (size_t i = 0; i < n; i++) want += bar[i] * bump[i];
    for (int k = 2; k <= 8; k++) {
        const double eps = pow(10, -k);
        double c[4];
        for (int q = 0; q < 4;
             q++) { /* fourth order: at 1e-2 the objective itself is curved */
            for (size_t i = 0; i < n; i++)
                moved[i] = theta[i] + (q % 2 ? -eps : eps) * (1 + q / 2) * bump[i];
            KIT_CHECK(imp_field_set_theta(f, moved));
            c[q] = spot(f, &o, &r, e, NULL);
        }
        const double fd = (8 * (c[0] - c[1]) - (c[2] - c[3])) / (12 * eps);
        const double err = fabs(fd / want - 1);
        if (k == 2) first = err;
        last = err;
        worst = fmax(worst, err);
        printf("# %s: step 1e-%d: difference %.7g, adjoint %.7g\n", imp_field_kind(f), k,
               fd, want);
    }
    if (spline)
        tap_ok(worst < 1e-4,
               "cubic: adjoint is the difference from 1e-2 to 1e-8 # worst %.1e", worst);
    else
        tap_ok(last < 1e-4 && first > 1e-2,
               "trilinear: adjoint is the difference at 1e-8 only # %.1e; at 1e-2 %.1e",
               last, first);
    free(theta), free(bump), free(moved), free(bar);
    kit_rays_free(&r);
    imp_field_destroy(f);
}

int main(void)
{
    kit_begin(1);
    static struct problem p;
    problem_make(&p);
    against_duals(&p);
    energy_of_adjoint(&p);
    planted(&p);
    kit_rays_free(&p.rays);
    imp_field_destroy(p.f);
    sweep(IMP_FIELD_SPLINE);
    sweep(IMP_FIELD_TRILINEAR);
    imp_context_destroy(kit_ctx);
    return tap_done();
}
