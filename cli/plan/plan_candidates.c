/* SPDX-License-Identifier: Apache-2.0
 *
 * Options of candidates, and the list that they make. */
#include "plan_candidates.h"

#include "shared/sensor_names.h"

#include <fnmatch.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static struct {
    const char *sensors, *have, *sphere, *path, *up, *exposures;
    struct arg_list lamps, costs;
} o;

const struct arg_option options_candidates[] = {
    {ARG_TEXT | ARG_REPLAYS, 0, "sensors", "SENSOR[,..]",
     "candidates: these sensors (default: all that --have does not name)", &o.sensors, 0,
     0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "have", "SENSOR[,..]",
     "pictures of these sensors have been taken already", &o.have, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "sphere", "X,Y,Z,R,N[,A,B]",
     "candidates: the camera of --sensor at N places, R from X,Y,Z, which it looks at, "
     "between the elevations A and B (default 0,90 degrees)",
     &o.sphere, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "path", "FILE",
     "candidates: the camera of --sensor at places: lines X Y Z, a point that it looks "
     "at, and a name, which may be left out",
     &o.path, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "up", "X,Y,Z",
     "upwards, of --sphere and --path (default 0,1,0)", &o.up, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "lamps", "GLOB[,GLOB..]",
     "each candidate with these lamps on and the others off; several: with each; "
     "'each': every lamp alone",
     &o.lamps, 0, 0, NULL},
    {ARG_TEXT | ARG_REPLAYS, 0, "exposures", "T[,T..]",
     "each candidate with these times of exposure (default 1)", &o.exposures, 0, 0, NULL},
    {ARG_LIST | ARG_REPLAYS, 0, "cost", "C|C+C1*t|GLOB=C",
     "cost of a picture, with its time of exposure t, or of the candidates of these "
     "names "
     "(default 1)",
     &o.costs, 0, 0, NULL},
    {0}};

int numbers_read(const char *text, double *out, int most)
{
    int n = 0;
    for (const char *p = text; n < most;) {
        char *end;
        out[n] = strtod(p, &end);
        if (end == p || !isfinite(out[n])) return -1;
        n++;
        if (!*end) return n;
        if (*end != ',') return -1;
        p = end + 1;
    }
    return -1;
}

/* ---- Sensors --------------------------------------------------------------------------- */

enum { LIST_MAX = 4096 };

/* Sensors by name or number, separated by commas; *n of them. */
static int sensors_read(const char *option, const char *text, int *out, int *n)
{
    char *list = cli_strdup(text), *rest = list, names[256];
    int rc = 0;
    *n = 0;
    for (char *item; !rc && (item = strsep(&rest, ",")) != NULL;) {
        const int found = sensor_find(item);
        if (found < 0) {
            sensor_names(names, sizeof names);
            rc = cli_error(EXIT_USAGE,
                           "--%s %s: there is no sensor '%s'; the scene has: %s", option,
                           text, item, names);
        } else if (*n == LIST_MAX) {
            rc = cli_error(EXIT_USAGE, "--%s: more than %d sensors", option, LIST_MAX);
        }
        for (int i = 0; i < *n && !rc; i++)
            if (out[i] == found)
                rc = cli_error(EXIT_USAGE, "--%s %s: sensor '%s' is there twice", option,
                               text, item);
        if (!rc) out[(*n)++] = found;
    }
    free(list);
    return rc;
}

/* ---- The list ---------------------------------------------------------------------------- */

static char *text_keep(struct candidates *out, char *text)
{
    out->text = realloc(out->text, (out->n_text + 1) * sizeof *out->text);
    if (!out->text) abort();
    return out->text[out->n_text++] = text;
}

static struct imp_plan_candidate *add(struct candidates *out)
{
    out->c = realloc(out->c, (out->n + 1) * sizeof *out->c);
    if (!out->c) abort();
    out->c[out->n] = (struct imp_plan_candidate)IMP_PLAN_CANDIDATE_INIT;
    return &out->c[out->n++];
}

static const char *sensor_name(int sensor)
{
    struct imp_sensor_info info = {.size = sizeof info};
    return imp_scene_get_sensor(cli.scene, sensor, &info) == IMP_OK && info.name
               ? info.name
               : "sensor";
}

static int have_add(struct candidates *out, int *have, int *n_have)
{
    if (!o.have) return 0;
    const int rc = sensors_read("have", o.have, have, n_have);
    for (int k = 0; k < *n_have && !rc; k++) {
        struct imp_plan_candidate *c = add(out);
        c->sensor = have[k];
        c->have = true;
        c->name = sensor_name(have[k]);
    }
    out->n_have = out->n;
    return rc;
}

static int sensors_add(struct candidates *out, const int *have, int n_have)
{
    int *list = cli_alloc(LIST_MAX, sizeof *list), n = 0;
    int rc = o.sensors ? sensors_read("sensors", o.sensors, list, &n) : 0;
    for (int s = 0; s < sensor_count() && n < LIST_MAX && !o.sensors; s++) {
        bool taken = false;
        for (int k = 0; k < n_have; k++) taken |= have[k] == s;
        if (!taken) list[n++] = s;
    }
    for (int k = 0; k < n && !rc; k++) {
        struct imp_plan_candidate *c = add(out);
        c->sensor = list[k];
        c->name = sensor_name(list[k]);
    }
    free(list);
    return rc;
}

/* ---- Places ------------------------------------------------------------------------------ */

static int up_read(double up[3])
{
    up[0] = up[2] = 0;
    up[1] = 1;
    if (!o.up || numbers_read(o.up, up, 3) == 3) return 0;
    return cli_error(EXIT_USAGE, "--up %s: expected X,Y,Z", o.up);
}

static void place_add(struct candidates *out, const double origin[3],
                      const double target[3], const double up[3], const char *name)
{
    struct imp_plan_candidate *c = add(out);
    char number[64];
    snprintf(number, sizeof number, "place %zu", out->n - 1 - out->n_have);
    c->sensor = cli.sensor;
    c->placed = true;
    memcpy(c->origin, origin, sizeof c->origin);
    memcpy(c->target, target, sizeof c->target);
    memcpy(c->up, up, sizeof c->up);
    c->name = text_keep(out, cli_strdup(name && *name ? name : number));
}

/* Evenly over the zone between two elevations: equal steps of their sine, turned on by the golden
 * angle each. */
static int sphere_add(struct candidates *out)
{
    double v[7] = {0, 0, 0, 0, 0, 0, 90}, up[3], x[3], y[3];
    const int n = numbers_read(o.sphere, v, 7);
    int rc = up_read(up);
    const double length = sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
    if (!rc && ((n != 5 && n != 7) || !(v[3] > 0) || v[4] < 1 || v[4] > LIST_MAX ||
                v[4] != floor(v[4]) || !(v[5] < v[6]) || v[5] < -90 || v[6] > 90))
        rc = cli_error(EXIT_USAGE,
                       "--sphere %s: expected X,Y,Z,R,N, with R > 0, N from 1 to %d, and "
                       "elevations A < B within -90 and 90",
                       o.sphere, LIST_MAX);
    if (!rc && !(length > 0)) rc = cli_error(EXIT_USAGE, "--up %s: has no length", o.up);
    if (rc) return rc;
    for (int k = 0; k < 3; k++) up[k] /= length;
    /* x, y: across, at right angles. */
    const int least = fabs(up[0]) < fabs(up[1]) ? (fabs(up[0]) < fabs(up[2]) ? 0 : 2)
                                                : (fabs(up[1]) < fabs(up[2]) ? 1 : 2);
    double square = 0;
    for (int k = 0; k < 3; k++) x[k] = (k == least) - up[least] * up[k];
    for (int k = 0; k < 3; k++) square += x[k] * x[k];
    for (int k = 0; k < 3; k++) x[k] /= sqrt(square);
    for (int k = 0; k < 3; k++)
        y[k] = up[(k + 1) % 3] * x[(k + 2) % 3] - up[(k + 2) % 3] * x[(k + 1) % 3];
    const double degree = M_PI / 180, golden = M_PI * (3 - sqrt(5));
    const double s0 = sin(v[5] * degree), s1 = sin(v[6] * degree);
    for (int i = 0; i < (int)v[4]; i++) {
        const double s = s0 + (s1 - s0) * (i + 0.5) / v[4], c = sqrt(1 - s * s);
        double at[3];
        for (int k = 0; k < 3; k++)
            at[k] = v[k] + v[3] * (s * up[k] +
                                   c * (cos(golden * i) * x[k] + sin(golden * i) * y[k]));
        place_add(out, at, v, up, NULL);
    }
    return 0;
}

static int path_add(struct candidates *out)
{
    char line[512], name[256];
    double v[6], up[3];
    int number = 0, rc = up_read(up);
    FILE *f = rc ? NULL : fopen(o.path, "r");
    if (!rc && !f) return cli_error(EXIT_USAGE, "--path %s: cannot be read", o.path);
    while (!rc && fgets(line, sizeof line, f)) {
        const char *at = line + strspn(line, " \t\r\n");
        number++;
        if (!*at || *at == '#') continue;
        *name = 0;
        const int n = sscanf(at, "%lf %lf %lf %lf %lf %lf %255[^\r\n]", &v[0], &v[1],
                             &v[2], &v[3], &v[4], &v[5], name);
        bool fine = n >= 6;
        for (int k = 0; k < 6 && fine; k++) fine = isfinite(v[k]);
        if (!fine)
            rc = cli_error(
                EXIT_USAGE,
                "%s:%d: expected a place X Y Z, a point to look at X Y Z, and a "
                "name or none",
                o.path, number);
        else if (out->n - out->n_have >= LIST_MAX)
            rc = cli_error(EXIT_USAGE, "%s: more than %d places", o.path, LIST_MAX);
        else place_add(out, v, v + 3, up, name);
    }
    if (f) fclose(f);
    return rc;
}

/* ---- Lightings, exposures, costs ---------------------------------------------------------- */

/* Every candidate once for each of `count`, changed by `change`. */
static void multiply(struct candidates *out, size_t count,
                     void (*change)(struct candidates *, struct imp_plan_candidate *,
                                    size_t, const void *),
                     const void *payload)
{
    const size_t first = out->n_have, n = out->n - first;
    struct imp_plan_candidate *from = cli_alloc(n + 1, sizeof *from);
    memcpy(from, out->c + first, n * sizeof *from);
    out->n = first;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++) {
            struct imp_plan_candidate *c = add(out);
            *c = from[i];
            change(out, c, k, payload);
        }
    free(from);
}

static void name_add(struct candidates *out, struct imp_plan_candidate *c,
                     const char *what)
{
    char name[600];
    snprintf(name, sizeof name, "%.400s, %.180s", c->name, what);
    c->name = text_keep(out, cli_strdup(name));
}

static void lamps_set(struct candidates *out, struct imp_plan_candidate *c, size_t k,
                      const void *payload)
{
    c->lamps = ((const char *const *)payload)[k];
    name_add(out, c, c->lamps);
}

static int lamps_multiply(struct candidates *out)
{
    if (o.lamps.n == 0) return 0;
    struct imp_scene_info info = {.size = sizeof info};
    imp_scene_get_info(cli.scene, &info);
    const char **lamps =
        cli_alloc(o.lamps.n + (size_t)info.n_emitters + 1, sizeof *lamps);
    size_t n = 0;
    for (size_t i = 0; i < o.lamps.n; i++)
        if (strcmp(o.lamps.item[i], "each") != 0) lamps[n++] = o.lamps.item[i];
        else
            for (int k = 0; k < info.n_emitters; k++)
                lamps[n++] = imp_plan_lamp(cli.scene, k);
    const int rc = n ? 0 : cli_error(EXIT_USAGE, "--lamps each: the scene has no lamp");
    if (!rc) multiply(out, n, lamps_set, lamps);
    free(lamps);
    return rc;
}

static void time_set(struct candidates *out, struct imp_plan_candidate *c, size_t k,
                     const void *payload)
{
    char text[32];
    c->time = ((const double *)payload)[k];
    snprintf(text, sizeof text, "time %g", c->time);
    name_add(out, c, text);
}

static int exposures_multiply(struct candidates *out)
{
    double t[64];
    if (!o.exposures) return 0;
    const int n = numbers_read(o.exposures, t, 64);
    bool fine = n > 0;
    for (int k = 0; k < n; k++) fine &= t[k] > 0;
    if (!fine)
        return cli_error(EXIT_USAGE, "--exposures %s: expected up to 64 times above 0",
                         o.exposures);
    multiply(out, (size_t)n, time_set, t);
    return 0;
}

static int cost_set(struct candidates *out, const char *text)
{
    const char *equal = strrchr(text, '=');
    double fixed = 0, per = 0;
    char glob[256] = "*", end = 0;
    const char *number = equal ? equal + 1 : text;
    const bool fine = sscanf(number, "%lf+%lf*t%c", &fixed, &per, &end) == 2 ||
                      (per = 0, sscanf(number, "%lf%c", &fixed, &end) == 1);
    size_t met = 0;
    if (!fine || !isfinite(fixed) || !isfinite(per) || fixed < 0 || per < 0 ||
        !(fixed + per > 0))
        return cli_error(EXIT_USAGE,
                         "--cost %s: expected a number above 0, C+C1*t of a time of "
                         "exposure t, or NAME= before either",
                         text);
    if (equal && (size_t)(equal - text) < sizeof glob)
        snprintf(glob, sizeof glob, "%.*s", (int)(equal - text), text);
    for (size_t k = out->n_have; k < out->n; k++) {
        if (fnmatch(glob, out->c[k].name, 0) != 0) continue;
        out->c[k].cost = fixed + per * (out->c[k].time > 0 ? out->c[k].time : 1);
        met++;
    }
    return met ? 0 : cli_error(EXIT_USAGE, "--cost %s: no candidate has this name", text);
}

int candidates_make(struct candidates *out)
{
    int *have = cli_alloc(LIST_MAX, sizeof *have), n_have = 0;
    *out = (struct candidates){0};
    int rc = have_add(out, have, &n_have);
    const int places = (o.sphere != NULL) + (o.path != NULL);
    if (!rc && places > 0 && (cli.sensor < 0 || cli.sensor >= sensor_count()))
        rc = cli_error(EXIT_USAGE, "--sensor %d: the scene has %d", cli.sensor,
                       sensor_count());
    if (!rc && places == 0 && o.up)
        rc = cli_error(EXIT_USAGE, "--up is of --sphere and --path");
    if (!rc && (places == 0 || o.sensors)) rc = sensors_add(out, have, n_have);
    if (!rc && o.sphere) rc = sphere_add(out);
    if (!rc && o.path) rc = path_add(out);
    if (!rc && out->n == out->n_have)
        rc = cli_error(EXIT_USAGE,
                       "plan: there are no candidates: the scene has %d sensor%s%s; see "
                       "--sphere and --path",
                       sensor_count(), plural(sensor_count()),
                       o.have ? ", all of --have" : "");
    if (!rc) rc = lamps_multiply(out);
    if (!rc) rc = exposures_multiply(out);
    for (size_t i = 0; i < o.costs.n && !rc; i++) rc = cost_set(out, o.costs.item[i]);
    free(have);
    return rc;
}

void candidates_free(struct candidates *c)
{
    for (size_t k = 0; k < c->n_text; k++) free(c->text[k]);
    free(c->text);
    free(c->c);
    args_list_free(&o.lamps);
    args_list_free(&o.costs);
}
