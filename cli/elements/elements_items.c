/* SPDX-License-Identifier: Apache-2.0
 *
 * JSON of a finite-element solution for a page: elements.json with the answer, mesh.json with
 * elements, links, illuminances and ranked lamps. */
#include "elements_items.h"

#include "elements_mesh.h"
#include "shared/answer_file.h"
#include "shared/picture_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINKS = 12, MAPS = 8, MAP_SIDE = 32 };

static const char *const files[] = {"elements.json", "mesh.json", "picture.exr",
                                    "importance.exr"};

int elements_report_writable(const char *folder)
{
    int rc = 0;
    for (int k = 0; k < 4 && !rc; k++)
        rc = overwrite_check_in(folder, files[k], k < 2 ? OUTPUT_JSON : OUTPUT_EXR);
    return rc;
}

/* Seven digits are enough to draw by. */
static void put_short(struct json *j, double v)
{
    fprintf(j->file, isfinite(v) ? "%s%.7g" : "%snull", j->started ? "," : "", v);
    j->started = 1;
}
static void put_shorts(struct json *j, const char *key, int n, const double *v)
{
    json_array(j, key);
    for (int k = 0; k < n; k++) put_short(j, v[k]);
    json_end_array(j);
}

/* ---- Links ------------------------------------------------------------------------- */

struct sums { /* by id of the sender */
    double *illuminance, *measure;
    size_t *met, n;
};

static int brightest(const void *p, const void *q, void *payload)
{
    const struct sums *s = payload;
    const size_t a = *(const size_t *)p, b = *(const size_t *)q;
    if (s->illuminance[a] != s->illuminance[b])
        return s->illuminance[a] < s->illuminance[b] ? 1 : -1;
    return (a > b) - (a < b);
}

/* [[from, illuminance, measure], ...], brightest first, how many there are, and what all
 * others bring. */
static int put_links(struct json *j, struct elements_mesh *m, size_t index,
                     struct sums *s)
{
    struct imp_elements_arrival *a;
    size_t n;
    const enum imp_status st = imp_elements_arrivals(m->e, index, &a, &n);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    s->n = 0;
    for (size_t k = 0; k < n; k++) {
        const size_t from = elements_mesh_id(m, a[k].from);
        if (!(a[k].illuminance > 0)) continue;
        if (s->illuminance[from] == 0) s->met[s->n++] = from;
        s->illuminance[from] += a[k].illuminance;
        s->measure[from] += a[k].measure;
    }
    qsort_r(s->met, s->n, sizeof *s->met, brightest, s);
    json_integer(j, "n_links", (int64_t)s->n);
    double rest = 0;
    json_array(j, "links");
    for (size_t k = 0; k < s->n; k++) {
        if (k >= LINKS) rest += s->illuminance[s->met[k]];
        if (k < LINKS) {
            json_array(j, NULL);
            json_integer(j, NULL, (int64_t)s->met[k]);
            put_short(j, s->illuminance[s->met[k]]);
            put_short(j, s->measure[s->met[k]]);
            json_end_array(j);
        }
        s->illuminance[s->met[k]] = s->measure[s->met[k]] = 0;
    }
    json_end_array(j);
    json_number(j, "rest", rest);
    imp_free(cli.context, a);
    return 0;
}

static int put_elements(struct json *j, struct elements_mesh *m)
{
    struct sums s = {cli_alloc(m->n, sizeof *s.illuminance),
                     cli_alloc(m->n, sizeof *s.measure), cli_alloc(m->n, sizeof *s.met),
                     0};
    int rc = 0;
    json_array(j, "elements");
    for (size_t k = 0; k < m->shown && !rc; k++) {
        const struct imp_elements_element *x = &m->all[m->index[k]];
        json_object(j, NULL);
        json_integer(j, "shape", (int64_t)elements_mesh_name(m, x->shape));
        json_integer(j, "polygon", (int64_t)x->polygon);
        json_integer(j, "level", x->level);
        json_integer(j, "leaves", (int64_t)m->leaves[m->index[k]]);
        put_shorts(j, "corners", 3 * x->corners, *x->corner);
        put_shorts(j, "radiance", m->channels, x->radiance);
        json_number(j, "importance", x->importance);
        json_number(j, "illuminance", x->illuminance);
        rc = put_links(j, m, m->index[k], &s);
        json_end_object(j);
    }
    json_end_array(j);
    json_array(j, "others");
    for (size_t k = m->shown; k < m->shown + m->others; k++) {
        const struct imp_elements_element *x = &m->all[m->index[k]];
        json_array(j, NULL);
        json_integer(j, NULL, (int64_t)elements_mesh_name(m, x->shape));
        for (int c = 0; c < 3; c++) {
            double sum = 0;
            for (int i = 0; i < x->corners; i++) sum += x->corner[i][c];
            put_short(j, sum / x->corners);
        }
        json_end_array(j);
    }
    json_end_array(j);
    json_array(j, "shapes");
    for (size_t k = 0; k < m->n_names; k++) json_text(j, NULL, m->name[k]);
    json_end_array(j);
    free(s.illuminance);
    free(s.measure);
    free(s.met);
    return rc;
}

/* ---- Illuminance ------------------------------------------------------------------- */

static double length_of(const double a[3], const double b[3])
{
    return sqrt(pow(b[0] - a[0], 2) + pow(b[1] - a[1], 2) + pow(b[2] - a[2], 2));
}

static int put_map(struct json *j, const struct elements_mesh *m, size_t index,
                   const struct elements_answer *a)
{
    const struct imp_elements_element *x = &m->all[index];
    const double u = length_of(x->corner[0], x->corner[1]),
                 v = length_of(x->corner[0], x->corner[x->corners - 1]);
    const int width = (int)fmax(4, fmin(MAP_SIDE, round(MAP_SIDE * u / v)));
    const int height = (int)fmax(4, fmin(MAP_SIDE, round(MAP_SIDE * v / u)));
    const size_t n = (size_t)width * (size_t)height;
    double *lux = cli_alloc(n, sizeof *lux);
    const enum imp_status st = imp_elements_illuminance(m->e, index, width, height, lux);
    if (st == IMP_OK) {
        json_object(j, NULL);
        json_text(j, "name", elements_source_name(a->typed, (size_t)x->source));
        json_bool(j, "plane", !x->shape);
        json_number(j, "measured", a->info->measures[x->source]);
        json_number(j, "target", a->targets[x->source]);
        json_numbers(j, "size", 2, (const double[2]){u, v});
        put_shorts(j, "corners", 3 * x->corners, *x->corner);
        json_integer(j, "width", width);
        json_integer(j, "height", height);
        json_array(j, "illuminance");
        for (size_t k = 0; k < n; k++) put_short(j, lux[k]);
        json_end_array(j);
        json_end_object(j);
    }
    free(lux);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

/* Maps of the largest polygons that are measured. */
static int put_maps(struct json *j, const struct elements_mesh *m,
                    const struct elements_answer *a)
{
    char *done = cli_alloc(m->n, 1);
    size_t n = 0;
    int rc = 0;
    for (size_t k = 0; k < m->n; k++) n += m->all[k].level == 0 && m->all[k].source >= 0;
    json_integer(j, "n_maps", (int64_t)n);
    json_array(j, "maps");
    for (int i = 0; i < MAPS && !rc; i++) {
        size_t best = ELEMENTS_NONE;
        for (size_t k = 0; k < m->n; k++)
            if (m->all[k].level == 0 && m->all[k].source >= 0 && m->all[k].area > 0 &&
                !done[k] && (best == ELEMENTS_NONE || m->all[k].area > m->all[best].area))
                best = k;
        if (best == ELEMENTS_NONE) break;
        done[best] = 1;
        rc = put_map(j, m, best, a);
    }
    json_end_array(j);
    free(done);
    return rc;
}

/* ---- Lamps and reflectances, ranked --------------------------------------------------- */

struct rank {
    const struct imp_elements_row *row; /* its first number */
    double share, error;
};

static int by_share(const void *p, const void *q)
{
    const struct rank *a = p, *b = q;
    if (fabs(a->share) != fabs(b->share)) return fabs(a->share) < fabs(b->share) ? 1 : -1;
    return (a->row > b->row) - (a->row < b->row);
}

/* The numbers of one parameter together. Their errors may go the same way, so they add. */
static void put_ranks(struct json *j, const struct elements_answer *a)
{
    struct rank *r = cli_alloc(a->n_rows, sizeof *r);
    size_t n = 0;
    for (size_t k = 0; k < a->n_rows; k++) {
        const struct imp_elements_row *row = IMP_ROW(imp_elements_row, a->rows, k);
        size_t at = 0;
        while (at < n &&
               (r[at].row->emission != row->emission || r[at].row->param != row->param ||
                strcmp(r[at].row->name, row->name) != 0))
            at++;
        if (at == n) r[n++].row = row;
        r[at].share += row->share;
        r[at].error += row->share_error;
    }
    qsort(r, n, sizeof *r, by_share);
    for (int emission = 1; emission >= 0; emission--) {
        json_array(j, emission ? "lamps" : "reflectances");
        for (size_t k = 0; k < n; k++) {
            if (r[k].row->emission != emission) continue;
            json_object(j, NULL);
            json_text(j, "name", r[k].row->name);
            json_number(j, "share", r[k].share);
            json_number(j, "share_error", r[k].error);
            json_end_object(j);
        }
        json_end_array(j);
    }
    free(r);
}

/* ---- Files ---------------------------------------------------------------------------- */

static int put_mesh(struct json *j, const imp_elements *e,
                    const struct elements_answer *a)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    struct elements_mesh m = {0};
    enum imp_status st = imp_scene_get_info(cli.scene, &scene);
    if (st == IMP_OK) st = imp_scene_get_sensor(cli.scene, cli.sensor, &sensor);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    m.channels = scene.channels;
    int rc = elements_mesh_read(&m, e, a->info->elements);
    if (!rc) {
        elements_mesh_choose(&m);
        json_array(j, "bounds");
        json_numbers(j, NULL, 3, scene.bounds_min);
        json_numbers(j, NULL, 3, scene.bounds_max);
        json_end_array(j);
        json_text(j, "unit", sensor.unit);
        json_integer(j, "n_leaves", (int64_t)m.n_leaves);
        json_integer(j, "most_leaves", (int64_t)m.most);
        json_bool(j, "all_polygons", m.least_area == 0);
        rc = put_elements(j, &m);
    }
    if (!rc) rc = put_maps(j, &m, a);
    if (!rc) put_ranks(j, a);
    elements_mesh_free(&m);
    return rc;
}

static int write_file(const imp_elements *e, const struct elements_answer *a,
                      const char *folder, int which)
{
    struct answer_file to;
    int rc = answer_open(&to, folder, files[which], which ? "mesh" : "elements");
    if (rc) return rc;
    if (which) {
        rc = put_mesh(&to.json, e, a);
    } else {
        elements_answer_info(a, &to.json);
        if (elements_fit_wanted()) elements_fit_json(&to.json, a->typed);
        elements_answer_sensitivity(a, &to.json);
    }
    return answer_close(&to, rc);
}

int elements_report_write(const imp_elements *e, const struct elements_answer *a,
                          const char *folder)
{
    const int rc = write_file(e, a, folder, 0);
    return rc ? rc : write_file(e, a, folder, 1);
}
