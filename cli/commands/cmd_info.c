/* SPDX-License-Identifier: Apache-2.0
 *
 * importon info: what is in a scene, and every parameter it has. */
#include "shared/command.h"
#include "shared/ugr_tables.h"
#include <importon/rooms.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void print_sensor_json(struct json *j, int i)
{
    struct imp_sensor_info s = {.size = sizeof s};
    if (imp_scene_get_sensor(cli.scene, i, &s) != IMP_OK) return;
    json_object(j, NULL);
    json_text(j, "name", s.name);
    json_text(j, "type", s.type);
    json_integer(j, "width", s.width);
    json_integer(j, "height", s.height);
    json_integer(j, "spp", s.spp);
    json_text(j, "filter", s.filter);
    json_number(j, "filter_radius", s.filter_radius);
    json_text(j, "file_format", s.file_format);
    json_end_object(j);
}

static void print_param_json(struct json *j, const struct imp_param_info *p,
                             const double *values)
{
    json_object(j, NULL);
    json_text(j, "name", p->name);
    json_array(j, "shape");
    for (int k = 0; k < p->n_dims; k++) json_integer(j, NULL, (int64_t)p->dims[k]);
    json_end_array(j);
    json_integer(j, "count", (int64_t)p->count);
    if (p->count <= 64) json_numbers(j, "value", p->count, values);
    if (p->wavelengths_nm) json_numbers(j, "wavelengths_nm", p->count, p->wavelengths_nm);
    json_text(j, "unit", p->unit);
    json_number(j, "min", p->lo);
    json_number(j, "max", p->hi);
    json_bool(j, "differentiable", p->flags & IMP_PARAM_DIFFERENTIABLE);
    json_bool(j, "discontinuous", p->flags & IMP_PARAM_DISCONTINUOUS);
    if (p->why) json_text(j, "why", p->why);
    json_bool(j, "integer", p->flags & IMP_PARAM_INTEGER);
    json_bool(j, "color", p->flags & IMP_PARAM_COLOR);
    json_end_object(j);
}

/* Values in one column: all of a few, or the extremes of many. */
static void value_text(const struct imp_param_info *p, const double *values, char *text,
                       size_t size)
{
    size_t used = 0;
    if (p->count > 4) {
        double lo = INFINITY, hi = -INFINITY;
        for (size_t k = 0; k < p->count; k++) {
            lo = fmin(lo, values[k]);
            hi = fmax(hi, values[k]);
        }
        snprintf(text, size, "%zu numbers in %.4g .. %.4g", p->count, lo, hi);
        return;
    }
    for (size_t k = 0; k < p->count && used < size; k++)
        used += (size_t)snprintf(text + used, size - used, "%s%.6g", k ? ", " : "",
                                 values[k]);
}

static int print_params(struct json *j)
{
    const size_t n = imp_scene_n_params(cli.scene);
    int width = 4;
    for (size_t i = 0; i < n; i++) {
        struct imp_param_info p = {.size = sizeof p};
        if (imp_scene_get_param(cli.scene, i, &p) == IMP_OK &&
            (int)strlen(p.name) > width)
            width = (int)strlen(p.name);
    }
    if (!j)
        printf("\n%-*s  %-32s %-16s %-14s %s\n", width, "name", "value", "bounds", "unit",
               "gradient");
    for (size_t i = 0; i < n; i++) {
        struct imp_param_info p = {.size = sizeof p};
        char value[96] = "", bounds[48];
        enum imp_status st = imp_scene_get_param(cli.scene, i, &p);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
        double *values = cli_alloc(p.count, sizeof *values);
        st = imp_scene_get_values(cli.scene, i, values);
        if (st != IMP_OK) {
            free(values);
            return cli_fail(st, cli.scene_path);
        }
        if (j) {
            print_param_json(j, &p, values);
        } else {
            value_text(&p, values, value, sizeof value);
            snprintf(bounds, sizeof bounds, "[%g, %g]", p.lo, p.hi);
            printf("%-*s  %-32s %-16s %-14s %s%s%s%s\n", width, p.name, value, bounds,
                   p.unit, p.flags & IMP_PARAM_DIFFERENTIABLE ? "yes" : "no",
                   p.flags & IMP_PARAM_DISCONTINUOUS ? ", moves edges" : "",
                   p.why ? ": " : "", p.why ? p.why : "");
        }
        free(values);
    }
    return 0;
}

/* Numbers of geometry, which are parameters where they are named; a line for each object. */
static void print_geometry(struct json *j)
{
    char name[256], object[256] = "";
    if (j) json_array(j, "geometry");
    for (size_t i = 0; imp_scene_geometry_name(cli.scene, i, sizeof name, name) == IMP_OK;
         i++) {
        const char *dot = strrchr(name, '.');
        const size_t length = dot ? (size_t)(dot - name) : 0;
        if (j) {
            json_text(j, NULL, name);
            continue;
        }
        if (i == 0) printf("\ngeometry (parameters where -p or --set name them)\n");
        if (strncmp(name, object, length) == 0 && !object[length]) {
            printf(", %s", dot + 1);
            continue;
        }
        printf("%s%s", *object ? "\n" : "", name);
        snprintf(object, sizeof object, "%.*s", (int)length, name);
    }
    if (j) json_end_array(j);
    else if (*object) printf("\n");
}

static void print_luminaires(struct json *j)
{
    const int n = imp_scene_n_luminaires(cli.scene);
    for (int i = 0; i < n; i++) {
        struct imp_luminaire_info l = {.size = sizeof l};
        if (imp_scene_get_luminaire(cli.scene, i, &l) != IMP_OK) continue;
        if (j) {
            json_object(j, NULL);
            json_text(j, "name", l.name);
            if (l.file) json_text(j, "file", l.file);
            json_number(j, "flux", l.flux);
            if (l.lamp_flux > 0) json_number(j, "lamp_flux", l.lamp_flux);
            if (l.watts > 0) json_number(j, "watts", l.watts);
            if (l.watts > 0) json_number(j, "power", l.power);
            if (l.watts > 0) json_number(j, "efficacy", l.efficacy);
            json_number(j, "level", l.level);
            json_number(j, "dimming", l.dimming);
            json_number(j, "maintenance", l.maintenance);
            json_bool(j, "point", l.is_point);
            json_numbers(j, "position", 3, l.position);
            json_numbers(j, "opening", 3, l.opening);
            json_end_object(j);
            continue;
        }
        printf("luminaire: %s, %.5g lm", l.name, l.flux);
        if (l.watts > 0) printf(", %.4g W", l.power);
        if (l.efficacy > 0) printf(", %.4g lm/W as measured", l.efficacy);
        if (l.level != 1) printf(", dimmed to %.3g", l.level);
        if (l.maintenance != 1) printf(", maintenance factor %.3g", l.maintenance);
        printf(", %s at (%g, %g, %g)\n", l.is_point ? "a point" : "a shape",
               l.position[0], l.position[1], l.position[2]);
    }
}

/* A scene that other commands refuse is not fine. */
static int verdict(const struct imp_scene_info *s)
{
    if (s->n_missing == 0) return 0;
    return cli_error(EXIT_USAGE, "%s: %d %s not supported; --lenient goes on without",
                     cli.scene_path, s->n_missing,
                     s->n_missing == 1 ? "thing is" : "things are");
}

static int run_info(int n, char **operand)
{
    struct imp_scene_info s = {.size = sizeof s};
    (void)n;
    cli.lenient = IMP_LENIENT_QUIET; /* listed, without warnings */
    int rc = cli_load(operand[0]);
    if (rc) return rc;
    imp_scene_get_info(cli.scene, &s);
    rc = glare_table_check();
    if (rc) return rc;
    if (cli.json) {
        struct json j = cli_json();
        json_text(&j, "scene", cli.scene_path);
        json_text(&j, "mode", cli_mode_word(s.mode));
        json_integer(&j, "shapes", s.n_shapes);
        json_integer(&j, "triangles", s.n_triangles);
        if (s.n_instances) {
            json_integer(&j, "instances", s.n_instances);
            json_number(&j, "triangles_met", s.triangles_met);
        }
        json_integer(&j, "emitters", s.n_emitters);
        json_integer(&j, "bsdfs", s.n_bsdfs);
        json_integer(&j, "textures", s.n_textures);
        json_numbers(&j, "bounds_min", 3, s.bounds_min);
        json_numbers(&j, "bounds_max", 3, s.bounds_max);
        json_text(&j, "integrator", s.integrator);
        json_integer(&j, "max_depth", s.max_depth);
        json_integer(&j, "memory_bytes", (int64_t)s.memory_bytes);
        json_array(&j, "not_supported");
        for (int i = 0; i < s.n_missing; i++) json_text(&j, NULL, s.missing[i]);
        json_end_array(&j);
        json_array(&j, "sensors");
        for (int i = 0; i < s.n_sensors; i++) print_sensor_json(&j, i);
        json_end_array(&j);
        json_array(&j, "luminaires");
        print_luminaires(&j);
        json_end_array(&j);
        if (glare_table_wanted.on) rc = glare_tables_print(&j);
        if (rc) return rc;
        json_array(&j, "params");
        rc = print_params(&j);
        json_end_array(&j);
        print_geometry(&j);
        cli_json_end(&j);
        return rc ? rc : verdict(&s);
    }
    printf(
        "%s: %s, %d shape%s (%lld triangle%s), %d emitter%s, %d bsdf%s, %d texture%s\n",
        cli.scene_path, cli_mode_word(s.mode), s.n_shapes, plural(s.n_shapes),
        (long long)s.n_triangles, plural(s.n_triangles), s.n_emitters,
        plural(s.n_emitters), s.n_bsdfs, plural(s.n_bsdfs), s.n_textures,
        plural(s.n_textures));
    if (s.n_instances)
        printf("instances: %d, by which rays can meet %.9g triangles\n", s.n_instances,
               s.triangles_met);
    if (s.bounds_min[0] <= s.bounds_max[0])
        printf("bounds: (%g, %g, %g) to (%g, %g, %g)\n", s.bounds_min[0], s.bounds_min[1],
               s.bounds_min[2], s.bounds_max[0], s.bounds_max[1], s.bounds_max[2]);
    for (int i = 0; i < s.n_missing; i++) printf("without: %s\n", s.missing[i]);
    printf("integrator: %s", s.integrator ? s.integrator : "none");
    if (s.max_depth >= 0) printf(", max_depth %d", s.max_depth);
    printf("\n");
    for (int i = 0; i < s.n_sensors; i++) {
        struct imp_sensor_info c = {.size = sizeof c};
        if (imp_scene_get_sensor(cli.scene, i, &c) != IMP_OK) continue;
        printf("sensor %d: %s (%s), %d x %d, %d sample%s per pixel, %s filter of radius "
               "%g\n",
               i, c.name, c.type, c.width, c.height, c.spp, plural(c.spp), c.filter,
               c.filter_radius);
    }
    print_luminaires(NULL);
    if (glare_table_wanted.on) {
        rc = glare_tables_print(NULL);
    } else {
        rc = print_params(NULL);
        print_geometry(NULL);
    }
    return rc ? rc : verdict(&s);
}

const struct command command_info = {
    {"info",
     "SCENE",
     "list a scene's objects and parameters",
     {options_glare_table, options_scene, options_file, options_general},
     1,
     1},
    run_info,
    1,
    0,
    REPLAYS_NEVER};
