/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of bent rays: slices of the index through the middle, the rays' ways projected
 * on them, spot diagrams, and what image targets see. */
#include "bend.h"
#include "picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 512, PATHS = 60, TARGETS = 8 };

/* The pictures written, for --json; NULL: not asked for. */
static struct json *list;

static char *picture_path(const char *folder, const char *prefix, const char *name)
{
    char file[128];
    snprintf(file, sizeof file, "%s%s.png", prefix, name);
    return join_path(folder, file);
}

int bend_view_writable(const char *folder, const char *prefix)
{
    static const char *const fixed[] = {"slice-x", "slice-y", "slice-z", "rays-x",
                                        "rays-y"};
    static const char *const numbered[] = {"spot-%d", "image-%d", "target-%d"};
    const int n_fixed = sizeof fixed / sizeof *fixed;
    int rc = 0;
    for (int k = 0; k < n_fixed + 3 * TARGETS && !rc; k++) {
        char name[32];
        if (k < n_fixed) snprintf(name, sizeof name, "%s", fixed[k]);
        else snprintf(name, sizeof name, numbered[(k - n_fixed) % 3], (k - n_fixed) / 3);
        char *path = picture_path(folder, prefix, name);
        rc = overwrite_check(path, OUTPUT_PNG);
        free(path);
    }
    return rc;
}

/* In --json an object is left open, for what is known of the picture. */
static int picture_save(imp_film *film, const char *folder, const char *prefix,
                        const char *name)
{
    struct imp_write_options w = IMP_WRITE_OPTIONS_INIT;
    char *path = picture_path(folder, prefix, name);
    const enum imp_status st = imp_film_write(film, path, &w);
    const int rc = st == IMP_OK ? 0 : cli_fail(st, path);
    if (list && !rc) {
        json_object(list, NULL);
        json_text(list, "file", path);
    }
    free(path);
    return rc;
}
static void list_number(const char *key, double value)
{
    if (list) json_number(list, key, value);
}
static void list_end(int rc)
{
    if (list && !rc) json_end_object(list);
}

static void put(float *p, int x, int y, const float c[3], float a)
{
    if (x < 0 || y < 0 || x >= SIDE || y >= SIDE) return;
    float *q = p + 3 * ((size_t)y * SIDE + (size_t)x);
    for (int k = 0; k < 3; k++) q[k] += a * (c[k] - q[k]);
}

/* A line, a pixel wide with soft edges. */
static void line(float *p, double x0, double y0, double x1, double y1, const float c[3])
{
    const double length = hypot(x1 - x0, y1 - y0);
    if (!(length < 1e5)) return;
    const int n = (int)(2 * length) + 1;
    for (int i = 0; i < n; i++) {
        const double x = x0 + (x1 - x0) * i / n - 0.5, y = y0 + (y1 - y0) * i / n - 0.5;
        const int ix = (int)floor(x), iy = (int)floor(y);
        const float u = (float)(x - ix), v = (float)(y - iy);
        put(p, ix, iy, c, 0.5f * (1 - u) * (1 - v));
        put(p, ix + 1, iy, c, 0.5f * u * (1 - v));
        put(p, ix, iy + 1, c, 0.5f * (1 - u) * v);
        put(p, ix + 1, iy + 1, c, 0.5f * u * v);
    }
}

/* ---- What is seen: the box of the picture -------------------------------------- */

/* The field's box, or that of the rays and their ends; a square per pair of axes. */
static void box_of(imp_bend *b, double lo[3], double hi[3])
{
    struct imp_bend_rays r;
    imp_field_bounds(imp_bend_field(b), lo, hi);
    imp_bend_get_rays(b, &r);
    struct imp_bend_exit *e = cli_alloc(r.n, sizeof *e);
    const int traced = imp_bend_run(b, e, NULL, NULL) == IMP_OK;
    for (int k = 0; k < 3; k++) {
        if (isfinite(lo[k]) && isfinite(hi[k])) continue;
        lo[k] = INFINITY, hi[k] = -INFINITY;
        for (size_t i = 0; i < r.n; i++) {
            lo[k] = fmin(lo[k], r.x[i][k]), hi[k] = fmax(hi[k], r.x[i][k]);
            if (!traced || e[i].flags & IMP_BEND_DROPPED) continue;
            lo[k] = fmin(lo[k], e[i].x[k]), hi[k] = fmax(hi[k], e[i].x[k]);
        }
    }
    double most = 1e-12;
    for (int k = 0; k < 3; k++) most = fmax(most, hi[k] - lo[k]);
    for (int k = 0; k < 3; k++)
        if (hi[k] - lo[k] < 0.02 * most) lo[k] -= 0.5 * most, hi[k] += 0.5 * most;
    free(e);
}

/* Grey from the least index to the greatest, on the plane through the middle. */
static void slice(const imp_field *f, int u, int v, const double lo[3],
                  const double hi[3], float *p, double range[2])
{
    double *eta = cli_alloc((size_t)SIDE * SIDE, sizeof *eta);
    range[0] = INFINITY, range[1] = -INFINITY;
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++) {
            double x[3], *e = &eta[(size_t)j * SIDE + (size_t)i];
            for (int k = 0; k < 3; k++) x[k] = (lo[k] + hi[k]) / 2;
            x[u] = lo[u] + (hi[u] - lo[u]) * (i + 0.5) / SIDE;
            x[v] = hi[v] - (hi[v] - lo[v]) * (j + 0.5) / SIDE;
            imp_field_eval(f, x, e, NULL, NULL);
            if (isfinite(*e))
                range[0] = fmin(range[0], *e), range[1] = fmax(range[1], *e);
        }
    const double span = range[1] - range[0];
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++) {
        const double t = span > 0 ? (eta[i] - range[0]) / span : 0.5;
        const float s =
            (float)pow(0.15 + 0.8 * (isfinite(t) ? t : 0), 2.2); /* sRGB later */
        p[3 * i] = 0.85f * s, p[3 * i + 1] = 0.95f * s, p[3 * i + 2] = s;
    }
    free(eta);
}

static void paths_draw(imp_bend *b, int u, int v, const double lo[3], const double hi[3],
                       float *p)
{
    static const float colours[6][3] = {{.9f, .1f, .05f}, {.05f, .4f, .9f},
                                        {.05f, .6f, .1f}, {.9f, .5f, 0},
                                        {.5f, .1f, .7f},  {0, .6f, .6f}};
    struct imp_bend_rays r;
    imp_bend_get_rays(b, &r);
    const size_t stride = r.n > PATHS ? r.n / PATHS : 1;
    for (size_t i = stride / 2; i < r.n; i += stride) {
        double(*q)[4];
        size_t n;
        if (imp_bend_ray(b, i, &q, &n) != IMP_OK) continue;
        for (size_t k = 1; k < n; k++)
            line(p, (q[k - 1][u] - lo[u]) / (hi[u] - lo[u]) * SIDE,
                 (hi[v] - q[k - 1][v]) / (hi[v] - lo[v]) * SIDE,
                 (q[k][u] - lo[u]) / (hi[u] - lo[u]) * SIDE,
                 (hi[v] - q[k][v]) / (hi[v] - lo[v]) * SIDE, colours[r.group[i] % 6]);
        imp_free(cli.context, q);
    }
}

/* Arrivals of one target about their centroid, on the two axes across the plane. */
static int spots(imp_bend *b, size_t target, const char *folder, const char *prefix)
{
    struct imp_bend_target t;
    imp_film *film;
    size_t n = 0;
    struct imp_bend_arrival *a = cli_alloc(imp_bend_n_rays(b), sizeof *a);
    enum imp_status st = imp_bend_get_target(b, target, &t);
    if (st == IMP_OK) st = imp_bend_arrivals(b, target, a, &n);
    if (st == IMP_OK) st = imp_film_create(cli.context, SIDE, SIDE, "R,G,B", &film);
    if (st != IMP_OK) {
        free(a);
        return cli_fail(st, cli.scene_path);
    }
    float *p = imp_film_mean(film);
    int across = 0; /* the axis nearest to the normal is not shown */
    for (int k = 1; k < 3; k++)
        if (fabs(t.normal[k]) > fabs(t.normal[across])) across = k;
    const int u = across == 0 ? 1 : 0, v = across == 2 ? 1 : 2;
    double mid[3] = {0}, rms = 0, w = 0;
    for (size_t i = 0; i < n; i++) {
        w += a[i].weight;
        for (int k = 0; k < 3; k++) mid[k] += a[i].weight * a[i].x[k];
    }
    for (int k = 0; k < 3; k++) mid[k] /= w > 0 ? w : 1;
    for (size_t i = 0; i < n; i++)
        rms += a[i].weight * (pow(a[i].x[u] - mid[u], 2) + pow(a[i].x[v] - mid[v], 2));
    rms = sqrt(rms / (w > 0 ? w : 1));
    for (size_t i = 0; i < 3 * (size_t)SIDE * SIDE; i++) p[i] = 1;
    static const float ink[3] = {0.02f, 0.05f, 0.2f}, grey[3] = {.6f, .6f, .6f};
    line(p, SIDE / 2, 0, SIDE / 2, SIDE, grey);
    line(p, 0, SIDE / 2, SIDE, SIDE / 2, grey);
    for (size_t i = 0; i < n; i++) {
        const double x = SIDE / 2 + (a[i].x[u] - mid[u]) / (3 * rms + 1e-300) * SIDE / 2;
        const double y = SIDE / 2 - (a[i].x[v] - mid[v]) / (3 * rms + 1e-300) * SIDE / 2;
        if (!(fabs(x) < 1e4 && fabs(y) < 1e4)) continue;
        line(p, x - 1, y, x + 1, y, ink);
        line(p, x, y - 1, x, y + 1, ink);
    }
    char name[64];
    snprintf(name, sizeof name, "spot-%zu", target);
    const int rc = picture_save(film, folder, prefix, name);
    if (list && !rc) {
        json_integer(list, "target", (int64_t)target);
        json_integer(list, "rays", (int64_t)n);
    }
    if (!rc) list_number("rms", rms);
    if (!rc) list_number("width", 6 * rms);
    list_end(rc);
    cli_say("target %zu: %zu rays, rms spot %.4g; the picture is %.4g wide", target, n,
            rms, 6 * rms);
    imp_film_destroy(film);
    free(a);
    return rc;
}

static int image(imp_bend *b, size_t target, const struct imp_bend_target *t,
                 const char *folder, const char *prefix)
{
    imp_film *film;
    enum imp_status st = imp_film_create(cli.context, t->width, t->height, "Y", &film);
    if (st != IMP_OK) return cli_fail(st, NULL);
    float *p = imp_film_mean(film), most = 1e-20f;
    char name[64];
    st = imp_bend_image(b, target, p);
    const size_t n = (size_t)t->width * (size_t)t->height;
    for (size_t i = 0; i < n; i++) most = t->pixels[i] > most ? t->pixels[i] : most;
    for (size_t i = 0; i < n; i++) p[i] = p[i] / most;
    snprintf(name, sizeof name, "image-%zu", target);
    int rc = st == IMP_OK ? picture_save(film, folder, prefix, name) : cli_fail(st, NULL);
    list_end(rc);
    for (size_t i = 0; i < n; i++) p[i] = t->pixels[i] / most;
    snprintf(name, sizeof name, "target-%zu", target);
    if (!rc && !*prefix) {
        rc = picture_save(film, folder, prefix, name);
        list_end(rc);
    }
    imp_film_destroy(film);
    return rc;
}

int bend_view(imp_bend *b, const char *folder, const char *prefix, struct json *j)
{
    static const int axes[3][2] = {{1, 2}, {0, 2}, {0, 1}}; /* x, y, z held */
    double lo[3], hi[3], range[2];
    int rc = 0;
    list = j;
    if (list) json_array(list, "pictures");
    box_of(b, lo, hi);
    for (int k = 0; k < 3 && !rc; k++) {
        imp_film *film;
        char name[32];
        const enum imp_status st =
            imp_film_create(cli.context, SIDE, SIDE, "R,G,B", &film);
        if (st != IMP_OK) return cli_fail(st, NULL);
        slice(imp_bend_field(b), axes[k][0], axes[k][1], lo, hi, imp_film_mean(film),
              range);
        snprintf(name, sizeof name, "slice-%c", "xyz"[k]);
        rc = picture_save(film, folder, prefix, name);
        if (!rc) {
            list_number("at", (lo[k] + hi[k]) / 2);
            list_number("index_min", range[0]);
            list_number("index_max", range[1]);
        }
        list_end(rc);
        cli_say("slice %c = %.4g: index %.6g to %.6g", "xyz"[k], (lo[k] + hi[k]) / 2,
                range[0], range[1]);
        if (!rc && k < 2) {
            paths_draw(b, axes[k][0], axes[k][1], lo, hi, imp_film_mean(film));
            snprintf(name, sizeof name, "rays-%c", "xyz"[k]);
            rc = picture_save(film, folder, prefix, name);
            list_end(rc);
        }
        imp_film_destroy(film);
    }
    for (size_t i = 0; i < imp_bend_n_targets(b) && i < TARGETS && !rc; i++) {
        struct imp_bend_target t;
        if (imp_bend_get_target(b, i, &t) != IMP_OK) continue;
        rc = t.type == IMP_BEND_IMAGE || t.type == IMP_BEND_FARFIELD
                 ? image(b, i, &t, folder, prefix)
                 : spots(b, i, folder, prefix);
    }
    if (list) json_end_array(list);
    return rc;
}
