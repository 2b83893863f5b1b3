/* SPDX-License-Identifier: Apache-2.0
 *
 * The experiments of docs/bend.md, each a table on standard output:
 *
 *     bend_experiments luneburg|maxwell|maxwell-rough|focus|slice|tape|fibre|display|gas|rod ...
 *                      [--full] [--figures DIR]
 *
 * Settings are scaled to minutes on two cores; --full takes the published sizes. How long
 * an experiment will take is said on standard error before it begins, from a first
 * evaluation. With --figures, luneburg and maxwell draw the index found over the true one
 * as DIR/NAME.svg; without it no file is written. */
#include "bend_tape.h"
#include <importon/bend.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static imp_context *ctx;
static int full;
static const char *figures; /* folder; NULL: none */

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "bend_experiments: %s\n", imp_last_error(ctx));
    exit(3);
}
static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static double sqr(double x) { return x * x; }

static void expect(const char *what, double seconds)
{
    if (seconds < 90) fprintf(stderr, "%s: about %.0f s\n", what, fmax(seconds, 1));
    else fprintf(stderr, "%s: about %.0f min\n", what, seconds / 60);
}
/* Seconds of one value and gradient, and of what a search adds to them. */
static double evaluation(imp_bend *b)
{
    double *g = calloc(imp_field_n_theta(imp_bend_field(b)), sizeof *g), value, start;
    must(imp_bend_objective(b, &value, g, NULL, NULL)); /* threads, pages: made once */
    start = now();
    must(imp_bend_objective(b, &value, g, NULL, NULL));
    free(g);
    return 1.2 * (now() - start);
}

static imp_field *grid(int cells, double half, double index, enum imp_field_interp interp)
{
    struct imp_field_grid g = IMP_FIELD_GRID_INIT;
    imp_field *f;
    g.interp = interp;
    for (int k = 0; k < 3; k++) g.cells[k] = cells, g.lo[k] = -half, g.hi[k] = half;
    must(imp_field_grid_create(ctx, &g, index, &f));
    return f;
}

/* ---- Luneburg, Maxwell: files -------------------------------------------------- */

static double luneburg(double r2) { return sqrt(2 - fmin(r2, 1)); }
static double maxwell(double r2) { return 2 / (1 + r2); }

enum { RADII = 51, LEVELS = 3 };

/* Mean of the index over a sphere of each radius 0 .. 1. */
static void shells(const imp_field *f, double eta[RADII])
{
    enum { DIRECTIONS = 200 };
    for (int k = 0; k < RADII; k++) {
        const double r = (double)k / (RADII - 1);
        eta[k] = 0;
        for (int i = 0; i < DIRECTIONS; i++) {
            const double z = 1 - (2 * i + 1.0) / DIRECTIONS, s = sqrt(1 - z * z);
            const double a = 2.399963229728653 * i;
            const double x[3] = {r * s * cos(a), r * s * sin(a), r * z};
            double e;
            imp_field_eval(f, x, &e, NULL, NULL);
            eta[k] += e / DIRECTIONS;
        }
    }
}

/* The index against the radius: the truth as a wide grey line, each level over it. */
static void figure(const char *name, double (*truth)(double), double eta[LEVELS][RADII])
{
    static const char *const colours[LEVELS] = {"#d08020", "#2070c0", "#c02020"};
    double lo = INFINITY, hi = -INFINITY;
    char path[1024];
    if (!figures) return;
    snprintf(path, sizeof path, "%s/%s.svg", figures, name);
    FILE *f = fopen(path, "w");
    if (!f) {
        perror(path);
        exit(3);
    }
    for (int k = 0; k < RADII; k++) {
        const double r = (double)k / (RADII - 1), t = truth(r * r);
        lo = fmin(lo, t), hi = fmax(hi, t);
        for (int l = 0; l < LEVELS; l++)
            lo = fmin(lo, eta[l][k]), hi = fmax(hi, eta[l][k]);
    }
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='640' height='440' "
               "font-family='sans-serif' font-size='13'>\n<rect width='640' height='440' "
               "fill='white'/>\n<rect x='60' y='20' width='560' height='370' fill='none' "
               "stroke='black'/>\n<text x='340' y='428' text-anchor='middle'>r</text>\n"
               "<text x='8' y='14'>index</text>\n");
    for (int k = 0; k <= 5; k++)
        fprintf(f,
                "<text x='%d' y='408' text-anchor='middle'>%.1f</text>\n<text x='54' "
                "y='%d' text-anchor='end'>%.3f</text>\n",
                60 + 112 * k, 0.2 * k, 394 - 74 * k, lo + (hi - lo) * k / 5);
    for (int l = -1; l < LEVELS; l++) {
        fprintf(f, "<polyline fill='none' stroke='%s' stroke-width='%d' points='",
                l < 0 ? "#bbbbbb" : colours[l], l < 0 ? 6 : 2);
        for (int k = 0; k < RADII; k++) {
            const double r = (double)k / (RADII - 1),
                         e = l < 0 ? truth(r * r) : eta[l][k];
            fprintf(f, "%.1f,%.1f ", 60 + 560 * r, 390 - 370 * (e - lo) / (hi - lo));
        }
        fprintf(f, "'/>\n<text x='500' y='%d' fill='%s'>", 62 + 18 * l,
                l < 0 ? "#888888" : colours[l]);
        if (l < 0) fprintf(f, "true</text>\n");
        else fprintf(f, "%d cells</text>\n", 6 << l);
    }
    fprintf(f, "</svg>\n");
    if (fclose(f)) perror(path), exit(3);
}

static void recover(const char *name, const char *file, double (*truth)(double),
                    double smooth_length, const int iterations[3])
{
    double eta[LEVELS][RADII];
    imp_bend *b;
    struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    char define[2][32];
    const char *const defines[2] = {define[0], define[1]};
    struct imp_load_options lo = IMP_LOAD_OPTIONS_INIT;
    printf("%-10s %6s %12s %12s %12s %12s %8s\n", "", "cells", "objective", "rms eta",
           "centre", "rms spot", "s");
    for (int levels = 1; levels <= 3;
         levels++) { /* each from the start: what a level is worth */
        snprintf(define[0], 32, "count=%d", full ? 600 : 150);
        lo.defines = defines, lo.n_defines = 1;
        must(imp_bend_load(ctx, file, &lo, &b));
        fo.levels = levels;
        memcpy(fo.iterations, iterations, 3 * sizeof(int));
        fo.smooth_length = smooth_length;
        if (levels == 1) /* the step halves with the third level's cells */
            expect(file, evaluation(b) *
                             (3 * iterations[0] + 2 * iterations[1] + 2 * iterations[2]));
        const double start = now();
        must(imp_bend_fit(b, &fo, &r));
        const double s = now() - start;
        double sum = 0, n = 0, centre, spot = 0;
        const imp_field *f = imp_bend_field(b);
        const double zero[3] = {0};
        imp_field_eval(f, zero, &centre, NULL, NULL);
        for (int k = -20; k <= 20; k++)
            for (int j = -20; j <= 20; j++)
                for (int i = -20; i <= 20; i++) {
                    const double x[3] = {0.05 * i, 0.05 * j, 0.05 * k};
                    const double r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
                    double eta;
                    if (r2 > 0.81) continue;
                    imp_field_eval(f, x, &eta, NULL, NULL);
                    sum += sqr(eta - truth(r2));
                    n++;
                }
        double *parts = calloc(imp_bend_n_targets(b), sizeof *parts), value;
        must(imp_bend_objective(b, &value, NULL, parts, NULL));
        for (size_t i = 0; i < imp_bend_n_targets(b); i++) spot += 2 * parts[i];
        printf("%-10s %6d %12.3e %12.4f %12.4f %12.2e %8.1f\n",
               levels == 1 ? "from file" : "", 6 << (levels - 1), r.value, sqrt(sum / n),
               centre, sqrt(spot), s);
        fflush(stdout);
        free(parts);
        shells(f, eta[levels - 1]);
        imp_bend_destroy(b);
    }
    figure(name, truth, eta);
}

/* ---- Focusing, canonical and arc length (supplement Fig. 2) -------------------- */

static imp_bend *focus_problem(int cells, enum imp_bend_scheme scheme,
                               enum imp_bend_way way)
{
    imp_bend *b;
    const size_t n = 600;
    double(*x)[3] = calloc(n, sizeof *x), (*d)[3] = calloc(n, sizeof *d);
    for (size_t i = 0; i < n; i++) {
        const double r = 0.8 * sqrt(((double)i + 0.5) / (double)n),
                     a = 2.399963229728653 * (double)i;
        x[i][0] = r * cos(a), x[i][1] = r * sin(a), x[i][2] = -1, d[i][2] = 1;
    }
    must(imp_bend_create(ctx, grid(cells, 1.01, 1, IMP_FIELD_SPLINE), &b));
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    s.offset = 1;
    o.surfaces = &s, o.n_surfaces = 1, o.scheme = scheme, o.way = way,
    o.step = 1.01 / cells;
    must(imp_bend_set_options(b, &o));
    must(imp_bend_add_rays(b, n, (const double(*)[3])x, (const double(*)[3])d, NULL,
                           NULL));
    t.at_plane = 1, t.offset = 1.1, t.point[2] = 1.1;
    must(imp_bend_add_target(b, &t));
    must(imp_bend_hold_rim(b, 3, 1));
    free(x), free(d);
    return b;
}

static void focus(void)
{
    static const struct {
        const char *name;
        enum imp_bend_scheme s;
        enum imp_bend_way w;
    } rows[] = {
        {"canonical leapfrog, reversed", IMP_BEND_LEAPFROG, IMP_BEND_REVERSE},
        {"arc length x' = v/|v|, reversed", IMP_BEND_ARC, IMP_BEND_REVERSE},
        {"arc length (23), stored", IMP_BEND_ARC_INDEX, IMP_BEND_STORED},
        {"arc length (23), pseudo-reversed", IMP_BEND_ARC_INDEX, IMP_BEND_PSEUDO}};
    const int steps[] = {20, 80, full ? 400 : 200};
    printf("%-34s %12s %12s %12s %14s\n", "mean r^2/2 after", "20", "80",
           full ? "400" : "200", "|g' - g|/|g|");
    for (int k = 0; k < 4; k++) {
        printf("%-34s", rows[k].name);
        double bias = 0;
        for (int m = 0; m < 3; m++) {
            imp_bend *b = focus_problem(16, rows[k].s, rows[k].w);
            struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
            struct imp_bend_fit_result r = {.size = sizeof r};
            fo.iterations[0] = steps[m];
            fo.tolerance = 1e-12;
            if (k == 0 && m == 0)
                expect("focus", 4 * evaluation(b) * (steps[0] + steps[1] + steps[2]));
            must(imp_bend_fit(b, &fo, &r));
            printf(" %12.2e", r.value);
            if (m == 1 &&
                k >= 2) { /* this way's gradient against the exact one, same program */
                imp_bend *e = focus_problem(16, IMP_BEND_ARC_INDEX, IMP_BEND_STORED);
                const size_t n = imp_field_n_theta(imp_bend_field(b));
                double *g = calloc(n, 8), *h = calloc(n, 8), *theta = calloc(n, 8), v,
                       dd = 0, gg = 0;
                imp_field_get_theta(imp_bend_field(b), theta);
                must(imp_field_set_theta(imp_bend_field(e), theta));
                must(imp_bend_objective(b, &v, h, NULL, NULL));
                must(imp_bend_objective(e, &v, g, NULL, NULL));
                for (size_t i = 0; i < n; i++) dd += sqr(h[i] - g[i]), gg += sqr(g[i]);
                bias = sqrt(dd / gg);
                free(g), free(h), free(theta);
                imp_bend_destroy(e);
            }
            imp_bend_destroy(b);
            fflush(stdout);
        }
        printf(" %14.2e\n", bias);
    }
}

/* ---- Adjoint, tape and differences: a slice (supplement Fig. 1), memory and time (Table
 * 1) -- */

struct lens {
    imp_field *f;
    size_t n;
    double (*x)[3], (*d)[3];
    double t;
    int nodes;
};

static struct lens lens_make(enum imp_field_interp interp, int cells, size_t n)
{
    struct lens l = {.n = n, .nodes = cells + 1};
    const int extra = interp == IMP_FIELD_SPLINE;
    l.f = grid(cells, 1, 1, interp);
    const size_t m = (size_t)(cells + 1 + 2 * extra);
    double *t = malloc(m * m * m * sizeof *t), h = 2.0 / cells;
    for (size_t k = 0; k < m; k++)
        for (size_t j = 0; j < m; j++)
            for (size_t i = 0; i < m; i++) {
                const double x = -1 + h * ((double)i - extra),
                             y = -1 + h * ((double)j - extra),
                             z = -1 + h * ((double)k - extra), r2 = x * x + y * y + z * z;
                t[i + m * (j + m * k)] = luneburg(r2);
            }
    must(imp_field_set_theta(l.f, t));
    free(t);
    l.x = calloc(n, sizeof *l.x), l.d = calloc(n, sizeof *l.d);
    for (size_t i = 0; i < n; i++) {
        const double r = 0.9 * sqrt(((double)i + 0.5) / (double)n),
                     a = 2.399963229728653 * (double)i;
        l.x[i][0] = r * cos(a), l.x[i][1] = r * sin(a), l.x[i][2] = -0.99, l.d[i][2] = 1;
    }
    l.t = h / 2;
    return l;
}
static void lens_free(struct lens *l)
{
    free(l->x), free(l->d);
    imp_field_destroy(l->f);
}

/* C = sum of the coordinates of the exits at z = 0.95: value, and gradient by the
 * adjoint. */
static double lens_adjoint(const struct lens *l, double *bar, double *forward_s,
                           double *back_s)
{
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_rays r = {.size = sizeof(struct imp_bend_rays),
                              .n = l->n,
                              .x = (const double(*)[3])l->x,
                              .d = (const double(*)[3])l->d,
                              .group = NULL};
    struct imp_bend_exit *e = calloc(l->n, sizeof *e);
    struct imp_bend_cotangent *c = calloc(l->n, sizeof *c);
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    double value = 0, start = now();
    s.offset = 0.95;
    o.surfaces = &s, o.n_surfaces = 1, o.step = l->t, o.grazing = -1;
    must(imp_bend_trace(l->f, &o, &r, e, NULL, NULL));
    *forward_s = now() - start;
    for (size_t i = 0; i < l->n; i++)
        for (int k = 0; k < 3; k++) value += e[i].x[k], c[i].x[k] = 1;
    start = now();
    if (bar) {
        g.theta = bar;
        must(imp_bend_adjoint(l->f, &o, &r, e, NULL, c, NULL, &g, NULL));
    }
    *back_s = now() - start;
    free(e), free(c);
    return value;
}

/* The gradient by tape, batch after batch of rays: one tape of all rays of the published
 * sizes has tens of GB. cost: what it would have. */
#define TAPE_RAYS 250
static double tape_rays(const struct lens *l, size_t n, int kind, const double *theta,
                        double *bar, struct tape_cost *cost)
{
    const double start = now();
    cost->bytes = 0;
    for (size_t i = 0; i < n; i += TAPE_RAYS) {
        struct tape_cost part;
        tape_gradient(theta, l->nodes + 2 * kind, kind, 1,
                      n - i < TAPE_RAYS ? n - i : TAPE_RAYS, l->x + i, l->d + i, l->t,
                      0.95, bar, &part);
        cost->bytes += part.bytes;
    }
    return now() - start;
}
/* Seconds that n rays will take, from the first of them. */
static double tape_expect(enum imp_field_interp interp, int cells, size_t n)
{
    struct lens l = lens_make(interp, cells, n);
    const size_t m = imp_field_n_theta(l.f), few = n < 40 ? n : 40;
    double *bar = calloc(m, 8), *theta = calloc(m, 8);
    struct tape_cost cost;
    imp_field_get_theta(l.f, theta);
    const double s = tape_rays(&l, few, interp == IMP_FIELD_SPLINE, theta, bar, &cost);
    free(bar), free(theta);
    lens_free(&l);
    return s * (double)n / (double)few;
}

static void slice(void)
{
    const int cells = full ? 64 : 24;
    const size_t rays = full ? 20000 : 2000;
    expect("slice", 1.2 * (tape_expect(IMP_FIELD_TRILINEAR, cells, rays) +
                           tape_expect(IMP_FIELD_SPLINE, cells, rays)));
    for (int kind = 0; kind < 2; kind++) {
        struct lens l =
            lens_make(kind ? IMP_FIELD_SPLINE : IMP_FIELD_TRILINEAR, cells, rays);
        const size_t n = imp_field_n_theta(l.f), side = (size_t)(l.nodes + 2 * kind);
        double *adj = calloc(n, 8), *tape = calloc(n, 8), *theta = calloc(n, 8), f, b;
        lens_adjoint(&l, adj, &f, &b);
        imp_field_get_theta(l.f, theta);
        struct tape_cost cost;
        tape_rays(&l, l.n, kind, theta, tape, &cost);
        double dt = 0, norm = 0;
        for (size_t i = 0; i < n; i++) dt += sqr(adj[i] - tape[i]), norm += sqr(adj[i]);
        printf("%s, %d cells: |adjoint - tape|/|adjoint| = %.1e\n",
               kind ? "cubic" : "trilinear", cells, sqrt(dt / norm));
        printf(
            "  middle z slice, central differences against the adjoint, rms relative:");
        for (int p = 2; p <= 8; p += 2) {
            double dd = 0, gg = 0;
            const double eps = pow(10, -p);
            for (size_t q = side / 4; q < 3 * side / 4; q += 2) { /* a row of the slice */
                const size_t i = q + side * (side / 2 + side * (side / 2));
                double v[2];
                for (int s = 0; s < 2; s++) {
                    const double old = theta[i];
                    theta[i] = old + (s ? -eps : eps);
                    must(imp_field_set_theta(l.f, theta));
                    v[s] = lens_adjoint(&l, NULL, &f, &b);
                    theta[i] = old;
                }
                dd += sqr((v[0] - v[1]) / (2 * eps) - adj[i]), gg += sqr(adj[i]);
            }
            printf("  1e-%d: %.1e", p, sqrt(dd / gg));
        }
        printf("\n");
        free(adj), free(tape), free(theta);
        lens_free(&l);
    }
}

static void tape(void)
{
    printf("%-10s %6s %8s %14s %14s %10s %10s %10s\n", "field", "nodes", "rays",
           "tape bytes", "exits, grad", "ratio", "tape s", "adjoint s");
    const int sizes[] = {32, 64, 128};
    double expected = 0;
    for (int k = 0; k < (full ? 6 : 4); k++)
        expected += tape_expect(k % 2 ? IMP_FIELD_SPLINE : IMP_FIELD_TRILINEAR,
                                sizes[k / 2], full ? 20000 : 2000);
    expect("tape", expected);
    for (int kind = 0; kind < 2; kind++)
        for (int s = 0; s < (full ? 3 : 2); s++) {
            const size_t rays = full ? 20000 : 2000;
            struct lens l =
                lens_make(kind ? IMP_FIELD_SPLINE : IMP_FIELD_TRILINEAR, sizes[s], rays);
            const size_t n = imp_field_n_theta(l.f);
            double *bar = calloc(n, 8), *theta = calloc(n, 8), f, b;
            struct tape_cost cost;
            imp_field_get_theta(l.f, theta);
            lens_adjoint(&l, bar, &f, &b);
            memset(bar, 0, n * 8);
            const double ts = tape_rays(&l, rays, kind, theta, bar, &cost);
            const double ours = (double)rays * (sizeof(struct imp_bend_exit) +
                                                sizeof(struct imp_bend_cotangent)) +
                                8.0 * (double)n;
            printf("%-10s %6d %8zu %14.3e %14.3e %10.1f %10.2f %10.2f\n",
                   kind ? "cubic" : "trilinear", l.nodes, rays, cost.bytes, ours,
                   cost.bytes / ours, ts, f + b);
            fflush(stdout);
            free(bar), free(theta);
            lens_free(&l);
        }
}

/* ---- GRIN fibre ---------------------------------------------------------------- */

static void fibre_run(const char *name, double curve, int cells)
{
    struct imp_field_radial rd = IMP_FIELD_RADIAL_INIT;
    imp_field *f;
    imp_bend *b;
    const int n = 60;
    double x[60][3] = {{0}}, d[60][3] = {{0}}, *theta;
    rd.cylinder = 1, rd.radius = sqrt(0.5), rd.cells = cells;
    must(imp_field_radial_create(ctx, &rd, 1.5, &f));
    const size_t m = imp_field_n_theta(f);
    theta = calloc(m, 8);
    for (size_t i = 0; i < m; i++)
        theta[i] = 1.5 * (1 - curve * ((double)i - 1) * 0.5 / cells);
    must(imp_field_set_theta(f, theta));
    for (int i = 0; i < n; i++) {
        const double a = acos(-1) / 6 * (2 * (i + 0.5) / n - 1);
        d[i][0] = sin(a), d[i][2] = cos(a);
    }
    must(imp_bend_create(ctx, f, &b));
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_tap tap = IMP_BEND_TAP_INIT;
    tap.offset = acos(-1);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    s.offset = 2 * acos(-1);
    o.surfaces = &s, o.n_surfaces = 1, o.taps = &tap, o.n_taps = 1, o.step = 0.02;
    must(imp_bend_set_options(b, &o));
    must(imp_bend_add_rays(b, (size_t)n, (const double(*)[3])x, (const double(*)[3])d,
                           NULL, NULL));
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    t.tap = 0, t.point[2] = acos(-1);
    must(imp_bend_add_target(b, &t));
    t.tap = -1, t.weight = 0.1, t.point[2] = 2 * acos(-1);
    must(imp_bend_add_target(b, &t));
    must(imp_bend_hold_number(b, 1, NAN));
    struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    fo.iterations[0] = 2000, fo.tolerance = 1e-13, fo.scale = 0.01;
    double spots[4], v;
    must(imp_bend_objective(b, &v, NULL, spots, NULL));
    must(imp_bend_fit(b, &fo, &r));
    must(imp_bend_objective(b, &v, NULL, spots + 2, NULL));
    double axis, worst = 0;
    const double zero[3] = {0};
    imp_field_eval(imp_bend_field(b), zero, &axis, NULL, NULL);
    for (int i = 0; i <= 53; i++) {
        const double p[3] = {0.01 * i, 0, 0};
        double eta;
        imp_field_eval(imp_bend_field(b), p, &eta, NULL, NULL);
        worst = fmax(worst, fabs(eta / axis * 1.5 - 1.5 / cosh(0.01 * i)));
    }
    printf("%-26s %5d %9.3g %9.3g %10.2e %10.2e %12.1e %6d\n", name, cells,
           sqrt(2 * spots[0]), sqrt(20 * spots[1]), sqrt(2 * spots[2]),
           sqrt(20 * spots[3]), worst, r.iterations);
    free(theta);
    imp_bend_destroy(b);
}

static void fibre(void)
{
    printf("%-26s %5s %9s %9s %10s %10s %12s %6s\n", "start", "cells", "spot pi", "2 pi",
           "after: pi", "2 pi", "off sech", "steps");
    fibre_run("n0 (1 - r^2/2)", 0.5, 8);
    fibre_run("n0 (1 - r^2/2)", 0.5, 16);
    fibre_run("n0 (1 - 0.3 r^2)", 0.3, 16);
}

/* ---- Two pictures from two sides ----------------------------------------------- */

static void letter(const char *const rows[8], int side, float *p)
{
    for (int j = 0; j < side; j++)
        for (int i = 0; i < side; i++)
            p[j * side + i] = rows[j * 8 / side][i * 8 / side] == '#' ? 1 : 0.15f;
}

static imp_bend *display_problem(imp_field *f, int layers, int beam, int side,
                                 const float *const img[2])
{
    imp_bend *b;
    must(imp_bend_create(ctx, f, &b));
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    s.type = IMP_BEND_BOX;
    for (int k = 0; k < 3; k++) s.lo[k] = -1.1, s.hi[k] = 1.1;
    o.surfaces = &s, o.n_surfaces = 1, o.grazing = -1;
    must(imp_bend_set_options(b, &o));
    imp_bend_set_step(b, 0.5, 0.1);
    const size_t n = (size_t)beam * (size_t)beam;
    double(*x)[3] = calloc(n, sizeof *x), (*d)[3] = calloc(n, sizeof *d);
    for (int v = 0; v < 2; v++) {
        const int along = v ? 0 : 2, u = v ? 2 : 0;
        for (size_t i = 0; i < n; i++) {
            x[i][u] = 0.8 * (2 * ((double)(i % (size_t)beam) + 0.5) / beam - 1);
            x[i][1] = 0.8 * (2 * ((double)(i / (size_t)beam) + 0.5) / beam - 1);
            x[i][along] = -1.1;
            d[i][0] = d[i][1] = d[i][2] = 0;
            d[i][along] = 1;
        }
        must(imp_bend_add_rays(b, n, (const double(*)[3])x, (const double(*)[3])d, NULL,
                               NULL));
        struct imp_bend_target t = IMP_BEND_TARGET_INIT;
        t.type = IMP_BEND_IMAGE, t.bundle = v, t.at_plane = 1, t.offset = 2;
        t.normal[2] = 0, t.normal[along] = 1;
        t.width = t.height = side, t.pixels = img[v];
        t.origin[u] = -1, t.origin[1] = 1, t.origin[along] = 2;
        t.u[u] = 2, t.v[1] = -2;
        must(imp_bend_add_target(b, &t));
    }
    free(x), free(d);
    must(imp_bend_add_smoothness(b, 1e-6, 2, 0));
    must(imp_bend_hold_rim(b, layers, 1));
    return b;
}

static void display(void)
{
    static const char *const one[8] = {"........", ".######.", ".#......", ".####...",
                                       ".#......", ".#......", ".######.", "........"};
    static const char *const two[8] = {"........", ".#....#.", ".##..##.", ".#.##.#.",
                                       ".#....#.", ".#....#.", ".#....#.", "........"};
    const int side = full ? 64 : 32, beam = full ? 256 : 64;
    float *img[2] = {malloc(sizeof(float) * 64 * 64), malloc(sizeof(float) * 64 * 64)};
    float *seen = malloc(sizeof(float) * 64 * 64);
    letter(one, side, img[0]);
    letter(two, side, img[1]);
    imp_field *f = grid(6, 1.1, 1, IMP_FIELD_SPLINE);
    printf("%6s %10s %12s %16s %8s\n", "cells", "MSE", "correlation", "index", "s");
    for (int level = 0; level < (full ? 4 : 3); level++) {
        if (level > 0) {
            imp_field *fine;
            must(imp_field_refine(f, &fine));
            imp_field_destroy(f);
            f = fine;
        }
        struct imp_field_grid g = {.size = sizeof g};
        const double start = now();
        must(imp_field_get_grid(f, &g));
        imp_field *copy = grid(g.cells[0], 1.1, 1, IMP_FIELD_SPLINE);
        const size_t n = imp_field_n_theta(f);
        double *theta = calloc(n, 8);
        imp_field_get_theta(f, theta);
        must(imp_field_set_theta(copy, theta));
        const float *const pictures[2] = {img[0], img[1]};
        imp_bend *b = display_problem(copy, level ? 3 : 2, beam, side, pictures);
        struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
        struct imp_bend_fit_result r = {.size = sizeof r};
        fo.iterations[0] = 60, fo.scale = 0.02;
        if (level == 0) /* steps of half a cell, 0.1 at most */
            expect("display", 60 * evaluation(b) * (full ? 8.7 : 4.3));
        must(imp_bend_fit(b, &fo, &r));
        double parts[2], v, lo = 1e9, hi = 0, corr = 0;
        must(imp_bend_objective(b, &v, NULL, parts, NULL));
        for (size_t t = 0; t < 2; t++) {
            struct imp_bend_target desc = {.size = sizeof desc};
            double a = 0, c = 0, aa = 0, cc = 0, ac = 0;
            const int np = side * side;
            must(imp_bend_get_target(b, t, &desc));
            must(imp_bend_image(b, t, seen));
            for (int i = 0; i < np; i++) {
                a += seen[i], c += desc.pixels[i], aa += sqr(seen[i]),
                    cc += sqr(desc.pixels[i]);
                ac += seen[i] * desc.pixels[i];
            }
            corr += 0.5 * (ac - a * c / np) / sqrt((aa - a * a / np) * (cc - c * c / np));
        }
        imp_field_get_theta(imp_bend_field(b), theta);
        must(imp_field_set_theta(f, theta));
        for (size_t i = 0; i < n; i++) lo = fmin(lo, theta[i]), hi = fmax(hi, theta[i]);
        printf("%6d %10.4f %12.3f    %.3f .. %.3f %8.1f\n", g.cells[0],
               parts[0] + parts[1], corr, lo, hi, now() - start);
        fflush(stdout);
        free(theta);
        imp_bend_destroy(b);
    }
    imp_field_destroy(f);
    free(img[0]), free(img[1]), free(seen);
}

/* ---- Gas: tomography from deflections ------------------------------------------ */

#define VIEWS 16
static const double blobs[5][5] = {{0, -.35, 0, .22, .8},
                                   {.12, -.05, .05, .20, .5},
                                   {-.15, .2, -.1, .18, .5},
                                   {.1, .4, .12, .20, .4},
                                   {-.1, .05, .25, .14, .35}};
static double phantom(const double x[3])
{
    double s = 0;
    for (int k = 0; k < 5; k++) {
        double r2 = 0;
        for (int a = 0; a < 3; a++) r2 += sqr(x[a] - blobs[k][a]);
        s += blobs[k][4] * exp(-r2 / (2 * sqr(blobs[k][3])));
    }
    return s;
}

struct gas {
    size_t n;
    double (*x)[3], (*d)[3], (*data)[3];
    struct imp_bend_surface box;
    struct imp_bend_options o;
    int cells;
};

static imp_bend *gas_problem(const struct gas *g, const double *theta, double contrast,
                             double scale_data)
{
    imp_bend *b;
    imp_field *f = grid(g->cells, 1.25, 1, IMP_FIELD_SPLINE);
    double(*data)[3] = calloc(g->n, sizeof *data);
    if (theta) must(imp_field_set_theta(f, theta));
    must(imp_bend_create(ctx, f, &b));
    must(imp_bend_set_options(b, &g->o));
    imp_bend_set_step(b, 1, 0);
    must(imp_bend_add_rays(b, g->n, (const double(*)[3])g->x, (const double(*)[3])g->d,
                           NULL, NULL));
    for (size_t i = 0; i < g->n; i++)
        for (int k = 0; k < 3; k++) data[i][k] = scale_data * g->data[i][k];
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    t.type = IMP_BEND_DEFLECTION, t.data = data[0], t.weight = 1 / sqr(contrast);
    must(imp_bend_add_target(b, &t));
    must(imp_bend_add_smoothness(b, 1e-9 / sqr(contrast), 2, 0));
    must(imp_bend_set_bounds(b, 0.5, 3));
    must(imp_bend_hold_rim(b, 3, 1));
    free(data);
    return b;
}

static double gas_error(const imp_field *f, double c, double gain)
{
    double dd = 0, nn = 0;
    for (int k = -16; k <= 16; k++)
        for (int j = -16; j <= 16; j++)
            for (int i = -16; i <= 16; i++) {
                const double x[3] = {i / 16.0, j / 16.0, k / 16.0};
                double eta;
                imp_field_eval(f, x, &eta, NULL, NULL);
                dd += sqr(gain * (eta - 1) - c * phantom(x));
                nn += sqr(c * phantom(x));
            }
    return sqrt(dd / nn);
}

static void gas(void)
{
    struct gas g = {.cells = full ? 40 : 20};
    const size_t side = full ? 64 : 24;
    g.n = VIEWS * side * side;
    g.x = calloc(g.n, sizeof *g.x), g.d = calloc(g.n, sizeof *g.d),
    g.data = calloc(g.n, sizeof *g.data);
    for (size_t i = 0; i < g.n; i++) {
        const double a = acos(-1) * (double)(i / (side * side)) / VIEWS, s = sin(a),
                     c = cos(a);
        const double u = 1.15 * (2 * ((double)(i % side) + 0.5) / (double)side - 1);
        const double v =
            1.15 * (2 * ((double)(i / side % side) + 0.5) / (double)side - 1);
        g.d[i][0] = s, g.d[i][2] = c;
        g.x[i][0] = u * c - 3 * s, g.x[i][1] = v, g.x[i][2] = -u * s - 3 * c;
    }
    g.box = (struct imp_bend_surface)IMP_BEND_SURFACE_INIT;
    g.box.type = IMP_BEND_BOX;
    for (int k = 0; k < 3; k++) g.box.lo[k] = -1.25, g.box.hi[k] = 1.25;
    g.o = (struct imp_bend_options)IMP_BEND_OPTIONS_INIT;
    g.o.surfaces = &g.box, g.o.n_surfaces = 1, g.o.outside = 1, g.o.grazing = -1;
    printf("%10s %10s %10s %12s %8s\n", "contrast", "linear", "curved", "from empty",
           "s");
    for (double c = 3e-4; c < 1; c *= 10) {
        const double start = now();
        imp_field *parts[6], *truth;
        const double one[4] = {1, 0, 0, 0};
        must(imp_field_profile_create(ctx, "constant", one, NULL, &parts[0]));
        for (int k = 0; k < 5; k++) {
            const double p[6] = {0,           c * blobs[k][4], blobs[k][3],
                                 blobs[k][0], blobs[k][1],     blobs[k][2]};
            must(imp_field_profile_create(ctx, "plume", p, NULL, &parts[k + 1]));
        }
        must(imp_field_sum_create(ctx, 6, parts, &truth));
        struct imp_bend_options o = g.o;
        o.scheme = IMP_BEND_YOSHIDA4, o.step = 0.02;
        struct imp_bend_rays r = {.size = sizeof(struct imp_bend_rays),
                                  .n = g.n,
                                  .x = (const double(*)[3])g.x,
                                  .d = (const double(*)[3])g.d,
                                  .group = NULL};
        struct imp_bend_exit *e = calloc(g.n, sizeof *e);
        must(imp_bend_trace(truth, &o, &r, e, NULL, NULL));
        for (size_t i = 0; i < g.n; i++) {
            const double dv =
                e[i].v[0] * g.d[i][0] + e[i].v[1] * g.d[i][1] + e[i].v[2] * g.d[i][2];
            for (int k = 0; k < 3; k++) g.data[i][k] = e[i].v[k] - dv * g.d[i][k];
        }
        free(e);
        imp_field_destroy(truth);
        /* Straight rays: the same program so close to the empty field that it is linear.
         */
        const double tiny = 1e-6;
        struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
        struct imp_bend_fit_result res = {.size = sizeof res};
        fo.iterations[0] = 100, fo.tolerance = 1e-12;
        imp_bend *lin = gas_problem(&g, NULL, tiny, tiny / c);
        fo.scale = tiny;
        if (c < 1e-3) /* four contrasts, two fits each, and one more */
            expect("gas", 9 * fo.iterations[0] * evaluation(lin));
        must(imp_bend_fit(lin, &fo, &res));
        const size_t n = imp_field_n_theta(imp_bend_field(lin));
        double *theta = calloc(n, 8);
        imp_field_get_theta(imp_bend_field(lin), theta);
        const double e_lin = gas_error(imp_bend_field(lin), c, c / tiny);
        for (size_t i = 0; i < n; i++) theta[i] = 1 + (theta[i] - 1) * c / tiny;
        imp_bend_destroy(lin);
        fo.scale = c;
        double err[2];
        for (int k = 0; k < 2; k++) {
            imp_bend *b = gas_problem(&g, k ? NULL : theta, c, 1);
            if (k && c < 0.1) { /* only worth showing where it matters */
                err[k] = NAN;
            } else {
                must(imp_bend_fit(b, &fo, &res));
                err[k] = gas_error(imp_bend_field(b), c, 1);
            }
            imp_bend_destroy(b);
        }
        printf("%10.0e %10.4f %10.4f %12.4f %8.1f\n", c, e_lin, err[0], err[1],
               now() - start);
        fflush(stdout);
        free(theta);
    }
    free(g.x), free(g.d), free(g.data);
}

/* ---- Rods from vendor data ----------------------------------------------------- */

static void rod(void)
{
    static const struct {
        const char *name;
        double n0, g, L;
    } rods[] = {{"quarter pitch", 1.6, 0.33, 4.759989},
                {"0.23 pitch", 1.6, 0.33, 4.379190},
                {"catalogue 0.29", 1.608, 0.339, 5.37}};
    printf("%-16s %8s %10s %10s %10s %12s %12s\n", "rod", "pitch", "f", "back",
           "M (l1=10)", "f traced", "M traced");
    for (int k = 0; k < 3; k++) {
        const double n0 = rods[k].n0, g = rods[k].g, L = rods[k].L, c = cos(g * L),
                     s = sin(g * L);
        const double p[5] = {n0, g, 0, 0, 0}, M = 1 / (c - n0 * g * 10 * s);
        const double l2 = (n0 * g * 10 * c + s) / (n0 * g * (n0 * g * 10 * s - c));
        imp_field *f;
        must(imp_field_profile_create(ctx, "rod", p, NULL, &f));
        struct imp_bend_surface faces[2] = {IMP_BEND_SURFACE_INIT, IMP_BEND_SURFACE_INIT};
        faces[0].normal[2] = -1, faces[1].offset = L;
        faces[0].event = faces[1].event = IMP_BEND_REFRACT;
        struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
        o.scheme = IMP_BEND_YOSHIDA4, o.surfaces = faces, o.n_surfaces = 2, o.outside = 1,
        o.step = 0.01;
        const double x[3][3] = {{1e-4, 0, -1}, {1e-4, 0, -10}, {1e-4, 0, -10}};
        const double d[3][3] = {{0, 0, 1}, {1e-5, 0, 1}, {-1e-5, 0, 1}};
        struct imp_bend_exit e[3];
        const struct imp_bend_rays r = {
            .size = sizeof(struct imp_bend_rays), .n = 3, .x = x, .d = d, .group = NULL};
        must(imp_bend_trace(f, &o, &r, e, NULL, NULL));
        double h = 0;
        for (int q = 1; q < 3; q++) h += 0.5 * (e[q].x[0] + l2 * e[q].v[0] / e[q].v[2]);
        printf("%-16s %8.4f %10.6f %10.6f %10.6f %12.6f %12.6f\n", rods[k].name,
               g * L / 2 / acos(-1), 1 / (n0 * g * s), c / (n0 * g * s), M,
               -1e-4 * e[0].v[2] / e[0].v[0], h / 1e-4);
        imp_field_destroy(f);
    }
}

int main(int argc, char **argv)
{
    static const int it[3] = {50, 50, 60};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 3;
    int did = 0;
    for (int i = 1; i < argc; i++) {
        full |= !strcmp(argv[i], "--full");
        if (!strcmp(argv[i], "--figures") && i + 1 < argc) figures = argv[i + 1];
    }
    for (int i = 1; i < argc; i++) {
        const char *a = argv[i];
        if (!strcmp(a, "--full")) continue;
        if (!strcmp(a, "--figures")) {
            i++;
            continue;
        }
        did++;
        if (!strcmp(a, "luneburg"))
            recover(a, IMP_SCENES "/bend/luneburg.xml", luneburg, 0, it);
        else if (!strcmp(a, "maxwell"))
            recover(a, IMP_SCENES "/bend/maxwell.xml", maxwell, 0.1, it);
        else if (!strcmp(a, "maxwell-rough"))
            recover(a, IMP_SCENES "/bend/maxwell.xml", maxwell, 0, it);
        else if (!strcmp(a, "focus")) focus();
        else if (!strcmp(a, "slice")) slice();
        else if (!strcmp(a, "tape")) tape();
        else if (!strcmp(a, "fibre")) fibre();
        else if (!strcmp(a, "display")) display();
        else if (!strcmp(a, "gas")) gas();
        else if (!strcmp(a, "rod")) rod();
        else did = -1000;
    }
    imp_context_destroy(ctx);
    if (did > 0) return 0;
    fprintf(stderr,
            "usage: bend_experiments "
            "luneburg|maxwell|maxwell-rough|focus|slice|tape|fibre|display|gas|rod "
            "... [--full] [--figures DIR]\n");
    return 2;
}
