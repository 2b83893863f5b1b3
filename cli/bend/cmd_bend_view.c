/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of bent rays: slices of the index through the middle, ray paths projected onto
 * them, spot diagrams, and irradiance beside its target. */
#include "bend_chart.h"
#include "bend_items.h"
#include "cmd_bend.h"
#include "shared/answer_file.h"
#include "shared/picture_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 512, PATHS = 60, TARGETS = 8 };

const char *bend_truth_path;

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
        char file[128];
        snprintf(file, sizeof file, "%s%s.png", prefix, name);
        rc = overwrite_check_in(folder, file, OUTPUT_PNG);
    }
    char file[64];
    snprintf(file, sizeof file, "%srays.json", prefix);
    return rc ? rc : overwrite_check_in(folder, file, OUTPUT_JSON);
}

/* ---- Colours ------------------------------------------------------------------- */

/* The index: dark is the least of the slice, light the greatest. The exponent is about
 * that of sRGB, so that equal steps look equal. */
static void index_colour(double t, chart_colour c)
{
    const float s = (float)pow(0.15 + 0.8 * t, 2.2);
    c[0] = 0.85f * s, c[1] = 0.95f * s, c[2] = s;
}
static void grey(double t, chart_colour c) { c[0] = c[1] = c[2] = (float)t; }

/* Rays have the colour of their wavelength, from blue (the shortest of the problem) over
 * green to red (the longest); rays of one wavelength that of their bundle. */
static void wavelength_colour(double t, chart_colour c)
{
    static const chart_colour stop[4] = {
        {.10f, .05f, .85f}, {0, .45f, .45f}, {.25f, .45f, 0}, {.85f, .05f, .02f}};
    const int k = (int)fmin(3 * t, 2);
    const float u = (float)(3 * t - k);
    for (int i = 0; i < 3; i++) c[i] = stop[k][i] + u * (stop[k + 1][i] - stop[k][i]);
}

struct palette {
    int n; /* different wavelengths */
    double um[64];
};

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void palette_of(const imp_bend *b, struct palette *p)
{
    p->n = 0;
    for (int k = 0; k < imp_bend_n_bundles(b); k++) {
        const double um = imp_bend_wavelength(b, k);
        int at = 0;
        while (at < p->n && p->um[at] != um) at++;
        if (at == p->n && p->n < 64) p->um[p->n++] = um;
    }
    qsort(p->um, (size_t)p->n, sizeof *p->um, by_size);
}

static void ray_colour(const imp_bend *b, const struct palette *p, int bundle,
                       chart_colour c)
{
    static const chart_colour bundles[6] = {{.9f, .1f, .05f}, {.05f, .4f, .9f},
                                            {.05f, .6f, .1f}, {.9f, .5f, 0},
                                            {.5f, .1f, .7f},  {0, .6f, .6f}};
    int at = 0;
    if (p->n < 2) {
        memcpy(c, bundles[bundle % 6], sizeof(chart_colour));
        return;
    }
    while (at < p->n - 1 && p->um[at] < imp_bend_wavelength(b, bundle)) at++;
    wavelength_colour((double)at / (p->n - 1), c);
}

static void legend(struct chart *c, const struct palette *p)
{
    for (int k = 0; p->n > 1 && k < p->n; k++) {
        char name[32];
        chart_colour colour;
        if (p->um[k] > 0) snprintf(name, sizeof name, "%.4g um", p->um[k]);
        else snprintf(name, sizeof name, "not given");
        wavelength_colour((double)k / (p->n - 1), colour);
        chart_legend(c, k, name, colour);
    }
}

/* ---- Slices and paths ---------------------------------------------------------- */

/* The index on the plane through the middle, across axis `held`. */
static void slice(const imp_field *f, struct chart *c, int u, int v, const double lo[3],
                  const double hi[3], double range[2])
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
    /* Where all values are one, rounding is no picture. */
    if (range[1] - range[0] < 1e-12 * fabs(range[1])) range[1] = range[0];
    const double span = range[1] - range[0];
    for (int j = 0; j < SIDE; j++)
        for (int i = 0; i < SIDE; i++) {
            const double e = eta[(size_t)j * SIDE + (size_t)i];
            chart_colour colour;
            index_colour(span > 0 && isfinite(e) ? (e - range[0]) / span : 0.5, colour);
            chart_pixel(c, i, j, colour);
        }
    free(eta);
}

static void paths_draw(imp_bend *b, const struct palette *palette, struct chart *c, int u,
                       int v)
{
    struct imp_bend_rays r = IMP_BEND_RAYS_INIT;
    imp_bend_get_rays(b, &r);
    const size_t stride = r.n > PATHS ? r.n / PATHS : 1;
    for (size_t i = stride / 2; i < r.n; i += stride) {
        double(*q)[4];
        size_t n;
        chart_colour colour;
        if (imp_bend_ray(b, i, &q, &n) != IMP_OK) continue;
        ray_colour(b, palette, r.group[i], colour);
        for (size_t k = 1; k < n; k++)
            chart_line(c, q[k - 1][u], q[k - 1][v], q[k][u], q[k][v], colour);
        imp_free(cli.context, q);
    }
}

static int slices(imp_bend *b, const struct palette *palette, const char *folder,
                  const char *prefix, struct json *j)
{
    static const char *const names[3] = {"x", "y", "z"};
    double lo[3], hi[3];
    int rc = 0;
    bend_box(b, lo, hi);
    if (j) json_array(j, "slices");
    for (int held = 0; held < 3 && !rc; held++) {
        const int u = held == 0 ? 1 : 0, v = held == 2 ? 1 : 2;
        const double x[2] = {lo[u], hi[u]}, y[2] = {lo[v], hi[v]};
        const double at = (lo[held] + hi[held]) / 2;
        double range[2] = {NAN, NAN};
        char name[32];
        for (int paths = 0; paths < (held < 2 ? 2 : 1) && !rc; paths++) {
            struct chart c;
            if ((rc = chart_open(&c, SIDE, SIDE, x, y))) break;
            slice(imp_bend_field(b), &c, u, v, lo, hi, range);
            if (paths) paths_draw(b, palette, &c, u, v);
            chart_axes(&c, names[u], names[v]);
            if (paths && palette->n > 1) legend(&c, palette);
            else chart_bar(&c, "index", range[0], range[1], index_colour);
            snprintf(name, sizeof name, "%s-%s", paths ? "rays" : "slice", names[held]);
            rc = chart_save(&c, folder, prefix, name);
        }
        cli_say("slice %s = %.4g: index %.6g to %.6g", names[held], at, range[0],
                range[1]);
        if (!j) continue;
        json_object(j, NULL);
        json_text(j, "axis", names[held]);
        json_number(j, "at", at);
        json_number(j, "index_min", range[0]);
        json_number(j, "index_max", range[1]);
        json_end_object(j);
    }
    if (j) json_end_array(j);
    return rc;
}

/* ---- Targets ------------------------------------------------------------------- */

struct seen { /* of one target */
    size_t rays;
    double rms, wide;
};

/* Arrivals of one target about their centroid, on the two axes across the plane. */
static int spots(imp_bend *b, const struct palette *palette, size_t target,
                 const struct imp_bend_target *t, const char *folder, const char *prefix,
                 struct seen *seen)
{
    static const char *const names[3] = {"x", "y", "z"};
    static const chart_colour ink = {0.02f, 0.05f, 0.2f}, light = {.6f, .6f, .6f};
    size_t n = 0;
    struct chart c;
    struct imp_bend_rays rays = IMP_BEND_RAYS_INIT;
    struct imp_bend_arrival *a = cli_alloc(imp_bend_n_rays(b), sizeof *a);
    const enum imp_status st = imp_bend_arrivals(b, target, a, &n);
    imp_bend_get_rays(b, &rays);
    int across = 0; /* the axis nearest to the normal is not shown */
    for (int k = 1; k < 3; k++)
        if (fabs(t->normal[k]) > fabs(t->normal[across])) across = k;
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
    const double half = rms > 0 && isfinite(rms) ? 3 * rms : 1;
    const double side[2] = {-half, half};
    *seen = (struct seen){n, rms, 2 * half};
    int rc = st == IMP_OK ? chart_open(&c, SIDE, SIDE, side, side)
                          : cli_fail(st, cli.scene_path);
    if (rc) {
        free(a);
        return rc;
    }
    chart_line(&c, 0, -half, 0, half, light);
    chart_line(&c, -half, 0, half, 0, light);
    for (size_t i = 0; i < n; i++) {
        chart_colour colour;
        memcpy(colour, ink, sizeof ink);
        if (palette->n > 1) ray_colour(b, palette, rays.group[a[i].ray], colour);
        chart_cross(&c, a[i].x[u] - mid[u], a[i].x[v] - mid[v], colour);
    }
    char name[64], x_name[48], y_name[48];
    snprintf(x_name, sizeof x_name, "%s %c %.6g", names[u], mid[u] < 0 ? '+' : '-',
             fabs(mid[u]));
    snprintf(y_name, sizeof y_name, "%s %c %.6g", names[v], mid[v] < 0 ? '+' : '-',
             fabs(mid[v]));
    chart_axes(&c, x_name, y_name);
    legend(&c, palette);
    snprintf(name, sizeof name, "spot-%zu", target);
    rc = chart_save(&c, folder, prefix, name);
    if (n > 0)
        cli_say("target %zu: %zu ray%s, rms spot %.4g; the picture is %.4g wide", target,
                n, plural((long long)n), rms, 2 * half);
    else cli_say("target %zu: no ray arrives, the picture is empty", target);
    free(a);
    return rc;
}

/* One irradiance, in units of its mean over the target's picture. */
static int irradiance(const struct imp_bend_target *t, const float *pixels, double most,
                      const char *folder, const char *prefix, const char *name)
{
    struct chart c;
    const int longest = t->width > t->height ? t->width : t->height;
    const int zoom = longest < SIDE ? SIDE / longest : 1;
    const double x[2] = {0,
                         sqrt(t->u[0] * t->u[0] + t->u[1] * t->u[1] + t->u[2] * t->u[2])};
    const double y[2] = {/* v runs down, from the corner at the top */
                         sqrt(t->v[0] * t->v[0] + t->v[1] * t->v[1] + t->v[2] * t->v[2]),
                         0};
    const int rc = chart_open(&c, t->width * zoom, t->height * zoom, x, y);
    if (rc) return rc;
    for (int j = 0; j < c.rows; j++)
        for (int i = 0; i < c.columns; i++) {
            const double e =
                pixels[(size_t)(j / zoom) * (size_t)t->width + (size_t)(i / zoom)] / most;
            chart_colour colour;
            grey(fmin(fmax(e, 0), 1), colour);
            chart_pixel(&c, i, j, colour);
        }
    chart_axes(&c, "u", "v");
    chart_bar(&c, "e / mean", 0, most, grey);
    return chart_save(&c, folder, prefix, name);
}

static int image(imp_bend *b, size_t target, const struct imp_bend_target *t,
                 const char *folder, const char *prefix)
{
    const size_t n = (size_t)t->width * (size_t)t->height;
    float *p = cli_alloc(n, sizeof *p), most = 1e-20f;
    char name[64];
    const enum imp_status st = imp_bend_image(b, target, p);
    for (size_t i = 0; i < n; i++) most = t->pixels[i] > most ? t->pixels[i] : most;
    snprintf(name, sizeof name, "image-%zu", target);
    int rc = st == IMP_OK ? irradiance(t, p, most, folder, prefix, name)
                          : cli_fail(st, cli.scene_path);
    snprintf(name, sizeof name, "target-%zu", target);
    if (!rc && !*prefix) rc = irradiance(t, t->pixels, most, folder, prefix, name);
    free(p);
    return rc;
}

static int targets(imp_bend *b, const struct palette *palette, const char *folder,
                   const char *prefix, struct json *j)
{
    int rc = 0;
    const size_t n = imp_bend_n_targets(b);
    if (j) json_array(j, "targets");
    for (size_t i = 0; i < n && i < TARGETS && !rc; i++) {
        struct imp_bend_target t = {.size = sizeof t};
        struct seen seen = {0, NAN, NAN};
        if (imp_bend_get_target(b, i, &t) != IMP_OK) continue;
        const int picture = t.type == IMP_BEND_IMAGE || t.type == IMP_BEND_FARFIELD;
        rc = picture ? image(b, i, &t, folder, prefix)
                     : spots(b, palette, i, &t, folder, prefix, &seen);
        if (!j) continue;
        json_object(j, NULL);
        json_integer(j, "target", (int64_t)i);
        json_text(j, "type", bend_target_word(t.type));
        if (!picture) {
            json_integer(j, "rays", (int64_t)seen.rays);
            json_number(j, "rms_spot", seen.rms);
            json_number(j, "picture_width", seen.wide);
        }
        json_end_object(j);
    }
    if (j) json_end_array(j);
    if (n > TARGETS && !rc)
        cli_say("%zu targets: the first %d are drawn", n, (int)TARGETS);
    return rc;
}

/* The same for reports, as numbers. */
static int rays_write(imp_bend *b, const char *folder, const char *prefix)
{
    struct bend_truth truth;
    struct answer_file to;
    char name[64];
    snprintf(name, sizeof name, "%srays.json", prefix);
    int rc = bend_truth_open(bend_truth_path, &truth);
    if (!rc) rc = answer_open(&to, folder, name, "rays");
    if (!rc)
        rc = answer_close(&to, bend_rays_json(&to.json, b, bend_truth_field(&truth)));
    bend_truth_close(&truth);
    return rc;
}

int bend_view(imp_bend *b, const char *folder, const char *prefix, struct json *j)
{
    struct palette palette;
    palette_of(b, &palette);
    int rc = slices(b, &palette, folder, prefix, j);
    if (!rc) rc = targets(b, &palette, folder, prefix, j);
    if (!rc) rc = rays_write(b, folder, prefix);
    return rc;
}
