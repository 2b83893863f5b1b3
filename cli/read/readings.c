/* SPDX-License-Identifier: Apache-2.0
 *
 * Readings of sensors as lines or JSON. */
#include "readings.h"
#include "shared/command.h"
#include "shared/picture_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct reading {
    struct imp_estimate value;
    double *grad, *se; /* NULL: no derivatives are wanted */
};

/* Adjoint of the mean over the film of one channel, or of the luminance (channel -1). */
static float *adjoint_of(const struct imp_sensor_info *sensor, int channels, int channel)
{
    const size_t pixels = (size_t)sensor->width * (size_t)sensor->height;
    float *a = cli_alloc(pixels * (size_t)channels, sizeof *a);
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < channels; c++)
            a[p * (size_t)channels + (size_t)c] =
                (float)((channel == c                   ? 1
                         : channel < 0 && channels == 1 ? 1
                         : channel < 0                  ? picture_luminance[c]
                                                        : 0) /
                        (double)pixels);
    return a;
}

static void print_number(struct json *j, const char *key, double value, double se)
{
    json_object(j, key);
    json_number(j, "value", value);
    json_number(j, "se", se);
    json_end_object(j);
}

static void print_derivatives(const struct block *blocks, size_t n_blocks,
                              const struct reading *r, const char *unit)
{
    for (size_t b = 0; b < n_blocks; b++)
        for (size_t k = 0; k < blocks[b].n && !block_is_large(&blocks[b]); k++) {
            char name[256];
            const size_t at = blocks[b].first + k;
            cli_number_row(&blocks[b].info, k, name, sizeof name);
            if (block_held(&blocks[b], k)) {
                printf("    d/d %-28s held\n", name);
                continue;
            }
            printf("    d/d %-28s %-12.6g +- %-8.2g %s / (%s)\n", name, r->grad[at],
                   r->se[at], unit, blocks[b].info.unit);
        }
}

static void json_derivatives(struct json *j, const struct block *blocks, size_t n_blocks,
                             const struct reading *r)
{
    json_array(j, "derivatives");
    for (size_t b = 0; b < n_blocks; b++) {
        block_json(j, &blocks[b]);
        json_numbers(j, "grad", blocks[b].n, r->grad + blocks[b].first);
        json_numbers(j, "se", blocks[b].n, r->se + blocks[b].first);
        json_end_object(j);
    }
    json_end_array(j);
}

/* A number as JSON or as a line; the object stays open for derivatives. */
static void number_print(struct json *j, const struct imp_sensor_info *info,
                         const char *channel, struct imp_estimate value,
                         struct imp_estimate other, struct findings *found)
{
    const double both = hypot(value.se, other.se);
    const double z = both > 0                     ? (other.value - value.value) / both
                     : other.value == value.value ? 0
                                                  : INFINITY;
    if (found->ends) found->apart |= !(fabs(z) <= ENDS_APART);
    found->lit |= value.value != 0 || value.se > 0 || other.value != 0 || other.se > 0;
    if (cli.json) {
        json_object(j, NULL);
        json_text(j, "sensor", info->name);
        json_text(j, "channel", channel);
        json_text(j, "unit", info->unit);
        json_number(j, "value", value.value);
        json_number(j, "se", value.se);
        if (found->ends) {
            print_number(j, "from_lights", other.value, other.se);
            json_number(j, "z", z);
        }
        return;
    }
    printf("%-20s %-3s %-12.6g +- %-8.2g %s", info->name, channel, value.value, value.se,
           info->unit);
    if (found->ends)
        printf("   from the lights %-12.6g +- %-8.2g z %.1f", other.value, other.se, z);
    printf("\n");
}

/* One number of one sensor. */
static int number_read(imp_problem *problem, struct json *j, struct imp_run run,
                       const struct imp_sensor_info *info, const char *channel,
                       const float *adjoint, const struct block *blocks, size_t n_blocks,
                       struct findings *found)
{
    const size_t n = n_blocks ? imp_problem_n_variables(problem) : 0;
    struct reading r = {.grad = n ? cli_alloc(n, sizeof(double)) : NULL,
                        .se = n ? cli_alloc(n, sizeof(double)) : NULL};
    struct imp_estimate other = {0};
    int rc = 0;
    if (found->ends) run.from = IMP_FROM_SENSOR;
    enum imp_status st =
        imp_problem_functional(problem, adjoint, &run, &r.value, r.grad, r.se);
    if (st == IMP_OK && found->ends) {
        run.from = IMP_FROM_LIGHTS;
        st = imp_problem_functional(problem, adjoint, &run, &other, NULL, NULL);
    }
    if (st != IMP_OK) {
        rc = cli_fail(st, cli.scene_path);
        goto out;
    }
    number_print(j, info, channel, r.value, other, found);
    if (n && cli.json) json_derivatives(j, blocks, n_blocks, &r);
    if (n && !cli.json) print_derivatives(blocks, n_blocks, &r, info->unit);
    if (cli.json) json_end_object(j);
out:
    free(r.grad);
    free(r.se);
    return rc;
}

/* The film of one pixel of a sensor: mean and standard error of its channels. */
static int pixel_read(struct imp_run run, int n, struct imp_estimate *out)
{
    imp_film *film = NULL;
    const enum imp_status st = imp_render(cli.scene, &run, &film);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    for (int c = 0; c < n; c++)
        out[c] = (struct imp_estimate){.value = imp_film_mean(film)[c],
                                       .se = imp_film_se(film)[c]};
    imp_film_destroy(film);
    return 0;
}

/* A specfilm's numbers, one for each response curve. */
static int curves_read(struct json *j, struct imp_run run,
                       const struct imp_sensor_info *info, struct findings *found)
{
    const int n = info->n_responses;
    if (info->width != 1 || info->height != 1)
        return cli_error(EXIT_USAGE,
                         "%s: sensor '%s' has %d x %d pixels; of a film with response "
                         "curves one pixel is read (render makes pictures)",
                         cli.scene_path, info->name, info->width, info->height);
    struct imp_estimate *value = cli_alloc(2 * (size_t)n, sizeof *value);
    struct imp_estimate *other = value + n;
    if (found->ends) run.from = IMP_FROM_SENSOR;
    int rc = pixel_read(run, n, value);
    if (!rc && found->ends) {
        run.from = IMP_FROM_LIGHTS;
        rc = pixel_read(run, n, other);
    }
    for (int c = 0; c < n && !rc; c++) {
        number_print(j, info, info->response_names[c], value[c], other[c], found);
        if (cli.json) json_end_object(j);
    }
    free(value);
    return rc;
}

int sensor_read(imp_problem *problem, struct json *j, struct imp_run run,
                const struct block *blocks, size_t n_blocks, struct findings *found)
{
    static const char *const names[] = {"R", "G", "B"};
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_scene_info scene = {.size = sizeof scene};
    imp_scene_get_info(cli.scene, &scene);
    const enum imp_status st = imp_scene_get_sensor(cli.scene, run.sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    if (info.n_responses > 0 && n_blocks == 0) return curves_read(j, run, &info, found);
    const int luminous = strchr("lc", info.unit[0]) != NULL; /* lx, cd m^-2 */
    const int one = luminous || scene.channels == 1;
    int rc = 0;
    for (int c = 0; c < (one ? 1 : scene.channels) && !rc; c++) {
        float *adjoint = adjoint_of(&info, scene.channels, one ? -1 : c);
        rc = number_read(problem, j, run, &info, one ? "Y" : names[c], adjoint, blocks,
                         n_blocks, found);
        free(adjoint);
    }
    return rc;
}

int shares_read(struct json *j, const struct imp_run *run, struct findings *found)
{
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_estimate reading;
    struct imp_share *share = NULL;
    size_t n;
    enum imp_status st = imp_scene_get_sensor(cli.scene, run->sensor, &info);
    if (st == IMP_OK) st = imp_reading_shares(cli.scene, run, NULL, 0, &n, NULL);
    if (st == IMP_OK) {
        share = cli_alloc(n + 1, sizeof *share);
        st = imp_reading_shares(cli.scene, run, share, n + 1, &n, &reading);
    }
    if (st != IMP_OK) {
        free(share);
        return cli_fail(st, cli.scene_path);
    }
    number_print(j, &info, "Y", reading, (struct imp_estimate){0}, found);
    if (cli.json) json_array(j, "shares");
    for (size_t k = 0; k < n; k++) {
        const struct imp_share *s = &share[k];
        const char *of = s->of == IMP_SHARE_LIGHT ? "light" : "material";
        const double part = reading.value > 0 ? s->value / reading.value : 0;
        if (s->of == IMP_SHARE_SURFACE && s->value == 0 && s->se == 0) continue;
        if (cli.json) {
            json_object(j, NULL);
            json_text(j, "of", of);
            json_text(j, "name", s->name);
            json_number(j, "value", s->value);
            json_number(j, "se", s->se);
            json_number(j, "part", part);
            json_end_object(j);
        } else {
            printf("    %-8s %-23s %-12.6g +- %-8.2g %s %7.1f %%\n", of, s->name,
                   s->value, s->se, info.unit, 100 * part);
        }
    }
    if (cli.json) json_end_array(j), json_end_object(j);
    free(share);
    return 0;
}

void unlit_tell(struct json *j, const int *sensor, int n)
{
    if (cli.json) json_array(j, "unlit");
    for (int k = 0; k < n; k++) {
        struct imp_sensor_info info = {.size = sizeof info};
        if (imp_scene_get_sensor(cli.scene, sensor[k], &info) != IMP_OK) continue;
        if (cli.json) json_text(j, NULL, info.name);
        cli_say(
            "importon: warning: sensor '%s' (%s): no walk brought light to it, and its "
            "error of 0 means nothing: is it in the dark, or do walks of the other end "
            "find it?",
            info.name, info.type);
    }
    if (cli.json) json_end_array(j);
}
