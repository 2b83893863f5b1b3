/* SPDX-License-Identifier: Apache-2.0
 *
 * JSON of the item "rays": paths, slices of the index, spots and irradiances, thinned to what a
 * page can draw. */
#include "bend_items.h"

#include "cmd_bend.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RAYS = 240, POINTS = 96, SLICE = 96, SPOTS = 4000, SIDE_MAX = 128, UM_MAX = 64 };

static const char *const axes[3] = {"x", "y", "z"};

void bend_box(imp_bend *b, double lo[3], double hi[3])
{
    struct imp_bend_rays r = IMP_BEND_RAYS_INIT;
    imp_field_get_bounds(imp_bend_field(b), lo, hi);
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

/* ---- Wavelengths --------------------------------------------------------------------- */

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Those of the bundles, ascending; 0: none given. */
static int wavelengths(const imp_bend *b, double um[UM_MAX])
{
    int n = 0;
    for (int k = 0; k < imp_bend_n_bundles(b); k++) {
        const double w = imp_bend_wavelength(b, k);
        int at = 0;
        while (at < n && um[at] != w) at++;
        if (at == n && n < UM_MAX) um[n++] = w;
    }
    qsort(um, (size_t)n, sizeof *um, by_size);
    return n;
}

static int wavelength_at(const imp_bend *b, int bundle, int n, const double *um)
{
    int at = 0;
    while (at < n - 1 && um[at] < imp_bend_wavelength(b, bundle)) at++;
    return at;
}

/* ---- Paths ----------------------------------------------------------------------------- */

/* Seven digits are enough to draw by. */
static void put_short(struct json *j, double v)
{
    fprintf(j->file, isfinite(v) ? "%s%.7g" : "%snull", j->started ? "," : "", v);
    j->started = 1;
}

static void put_paths(struct json *j, imp_bend *b, int n_um, const double *um)
{
    struct imp_bend_rays r = IMP_BEND_RAYS_INIT;
    imp_bend_get_rays(b, &r);
    const size_t shown = r.n < RAYS ? r.n : RAYS;
    json_integer(j, "n_rays", (int64_t)r.n);
    json_array(j, "rays");
    for (size_t k = 0; k < shown; k++) {
        const size_t i = k * r.n / shown;
        double(*q)[4];
        size_t n;
        if (imp_bend_ray(b, i, &q, &n) != IMP_OK) continue;
        json_object(j, NULL);
        json_integer(j, "bundle", r.group[i]);
        json_integer(j, "wavelength", wavelength_at(b, r.group[i], n_um, um));
        json_array(j, "points");
        const size_t points = n < POINTS ? n : POINTS;
        for (size_t p = 0; p < points; p++) {
            const size_t at = points > 1 ? p * (n - 1) / (points - 1) : 0;
            for (int c = 0; c < 3; c++) put_short(j, q[at][c]);
        }
        json_end_array(j);
        json_end_object(j);
        imp_free(cli.context, q);
    }
    json_end_array(j);
}

/* ---- Slices ------------------------------------------------------------------------------ */

static void put_index(struct json *j, const char *key, const imp_field *f, int held,
                      const double lo[3], const double hi[3])
{
    const int u = held == 0 ? 1 : 0, v = held == 2 ? 1 : 2;
    json_array(j, key);
    for (int y = 0; y < SLICE; y++)
        for (int x = 0; x < SLICE; x++) {
            double at[3], eta;
            at[held] = (lo[held] + hi[held]) / 2;
            at[u] = lo[u] + (hi[u] - lo[u]) * (x + 0.5) / SLICE;
            at[v] = hi[v] - (hi[v] - lo[v]) * (y + 0.5) / SLICE;
            imp_field_eval(f, at, &eta, NULL, NULL);
            put_short(j, eta);
        }
    json_end_array(j);
}

static void put_slices(struct json *j, const imp_field *f, const imp_field *truth,
                       const double lo[3], const double hi[3])
{
    json_array(j, "slices");
    for (int held = 0; held < 3; held++) {
        const int u = held == 0 ? 1 : 0, v = held == 2 ? 1 : 2;
        json_object(j, NULL);
        json_text(j, "axis", axes[held]);
        json_number(j, "at", (lo[held] + hi[held]) / 2);
        json_array(j, "across");
        json_text(j, NULL, axes[u]);
        json_text(j, NULL, axes[v]);
        json_end_array(j);
        json_numbers(j, "lo", 2, (const double[2]){lo[u], lo[v]});
        json_numbers(j, "hi", 2, (const double[2]){hi[u], hi[v]});
        json_integer(j, "width", SLICE);
        json_integer(j, "height", SLICE);
        put_index(j, "index", f, held, lo, hi);
        if (truth) put_index(j, "truth", truth, held, lo, hi);
        json_end_object(j);
    }
    json_end_array(j);
}

/* ---- Targets ------------------------------------------------------------------------------ */

/* Arrivals about their centroid, on the two axes across the target's plane. */
static int put_spot(struct json *j, imp_bend *b, size_t i,
                    const struct imp_bend_target *t, int n_um, const double *um)
{
    struct imp_bend_arrival *a = cli_alloc(imp_bend_n_rays(b), sizeof *a);
    struct imp_bend_rays rays = IMP_BEND_RAYS_INIT;
    size_t n = 0;
    const enum imp_status st = imp_bend_arrivals(b, i, a, &n);
    imp_bend_get_rays(b, &rays);
    int across = 0; /* the axis nearest to the normal */
    for (int k = 1; k < 3; k++)
        if (fabs(t->normal[k]) > fabs(t->normal[across])) across = k;
    const int u = across == 0 ? 1 : 0, v = across == 2 ? 1 : 2;
    double mid[3] = {0}, w = 0, square = 0;
    for (size_t k = 0; k < n; k++) {
        w += a[k].weight;
        for (int c = 0; c < 3; c++) mid[c] += a[k].weight * a[k].x[c];
    }
    for (int c = 0; c < 3; c++) mid[c] /= w > 0 ? w : 1;
    for (size_t k = 0; k < n; k++)
        square += a[k].weight * (pow(a[k].x[u] - mid[u], 2) + pow(a[k].x[v] - mid[v], 2));
    json_integer(j, "rays", (int64_t)n);
    json_number(j, "rms", n ? sqrt(square / (w > 0 ? w : 1)) : NAN);
    json_array(j, "across");
    json_text(j, NULL, axes[u]);
    json_text(j, NULL, axes[v]);
    json_end_array(j);
    json_numbers(j, "centre", 2, (const double[2]){mid[u], mid[v]});
    json_array(j, "points"); /* u, v, wavelength */
    const size_t shown = n < SPOTS ? n : SPOTS;
    for (size_t k = 0; k < shown; k++) {
        const struct imp_bend_arrival *p = &a[k * n / shown];
        put_short(j, p->x[u] - mid[u]);
        put_short(j, p->x[v] - mid[v]);
        put_short(j, wavelength_at(b, rays.group[p->ray], n_um, um));
    }
    json_end_array(j);
    free(a);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

/* Means of blocks of pixels, at most SIDE_MAX along a side. */
static void put_pixels(struct json *j, const char *key, const float *p, int width,
                       int height, int block)
{
    json_array(j, key);
    for (int y = 0; y + block <= height; y += block)
        for (int x = 0; x + block <= width; x += block) {
            double sum = 0;
            for (int k = 0; k < block * block; k++)
                sum +=
                    p[(size_t)(y + k / block) * (size_t)width + (size_t)(x + k % block)];
            put_short(j, sum / block / block);
        }
    json_end_array(j);
}

static int put_image(struct json *j, imp_bend *b, size_t i,
                     const struct imp_bend_target *t)
{
    const int longest = t->width > t->height ? t->width : t->height;
    const int block = (longest + SIDE_MAX - 1) / SIDE_MAX;
    float *p = cli_alloc((size_t)t->width * (size_t)t->height, sizeof *p);
    const enum imp_status st = imp_bend_image(b, i, p);
    double sum = 0;
    const size_t n = (size_t)t->width * (size_t)t->height;
    float *wanted = cli_alloc(n, sizeof *wanted);
    for (size_t k = 0; k < n; k++) sum += t->pixels[k];
    for (size_t k = 0; k < n; k++)
        wanted[k] = sum > 0 ? (float)(t->pixels[k] * (double)n / sum) : 0;
    json_integer(j, "width", t->width / block);
    json_integer(j, "height", t->height / block);
    put_pixels(j, "found", p, t->width, t->height, block);
    put_pixels(j, "wanted", wanted, t->width, t->height, block);
    free(wanted);
    free(p);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

static int put_targets(struct json *j, imp_bend *b, int n_um, const double *um)
{
    enum { TARGETS = 16 };
    const size_t n = imp_bend_n_targets(b);
    int rc = 0;
    json_integer(j, "n_targets", (int64_t)n);
    json_array(j, "targets");
    for (size_t i = 0; i < n && i < TARGETS && !rc; i++) {
        struct imp_bend_target t = {.size = sizeof t};
        if (imp_bend_get_target(b, i, &t) != IMP_OK) continue;
        json_object(j, NULL);
        json_integer(j, "target", (int64_t)i);
        json_text(j, "type", bend_target_word(t.type));
        rc = t.type == IMP_BEND_IMAGE || t.type == IMP_BEND_FARFIELD
                 ? put_image(j, b, i, &t)
                 : put_spot(j, b, i, &t, n_um, um);
        json_end_object(j);
    }
    json_end_array(j);
    return rc;
}

/* Where rays end, turn or are bent, to be drawn. */
static void put_surfaces(struct json *j, const imp_bend *b)
{
    static const char *const words[] = {"plane", "sphere", "cylinder", "disc",
                                        "box",   "sdf",    "approach", "mesh"};
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    if (imp_bend_get_options(b, &o) != IMP_OK) return;
    json_array(j, "surfaces");
    for (size_t i = 0; i < o.n_surfaces; i++) {
        const struct imp_bend_surface *s = &o.surfaces[i];
        json_object(j, NULL);
        json_text(j, "type", words[s->type]);
        json_numbers(j, "normal", 3, s->normal);
        json_number(j, "offset", s->offset);
        json_numbers(j, "centre", 3, s->centre);
        json_number(j, "radius", s->radius);
        json_numbers(j, "lo", 3, s->lo);
        json_numbers(j, "hi", 3, s->hi);
        json_end_object(j);
    }
    json_end_array(j);
}

int bend_rays_json(struct json *j, imp_bend *b, const imp_field *truth)
{
    double lo[3], hi[3], um[UM_MAX];
    const int n_um = wavelengths(b, um);
    bend_box(b, lo, hi);
    json_array(j, "box");
    json_numbers(j, NULL, 3, lo);
    json_numbers(j, NULL, 3, hi);
    json_end_array(j);
    json_text(j, "field", imp_field_kind(imp_bend_field(b)));
    json_numbers(j, "wavelengths_um", (size_t)n_um, um);
    put_surfaces(j, b);
    put_paths(j, b, n_um, um);
    put_slices(j, imp_bend_field(b), truth, lo, hi);
    return put_targets(j, b, n_um, um);
}

/* ---- The truth ------------------------------------------------------------------------------ */

int bend_truth_open(const char *path, struct bend_truth *out)
{
    *out = (struct bend_truth){NULL, NULL};
    if (!path) return 0;
    const char *dot = strrchr(path, '.');
    const enum imp_status st = dot && !strcasecmp(dot, ".xml")
                                   ? imp_bend_load(cli.context, path, NULL, &out->bend)
                                   : imp_field_read(cli.context, path, NULL, &out->own);
    return st == IMP_OK ? 0 : cli_fail(st, path);
}

const imp_field *bend_truth_field(const struct bend_truth *t)
{
    return t->bend ? imp_bend_field(t->bend) : t->own;
}

void bend_truth_close(struct bend_truth *t)
{
    imp_bend_destroy(t->bend);
    imp_field_destroy(t->own);
    *t = (struct bend_truth){NULL, NULL};
}
