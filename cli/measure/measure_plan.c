/* SPDX-License-Identifier: Apache-2.0
 *
 * Which photograph to take next: the scene's sensors that have none, and those that have one, again. */
#include "measure_answer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The noise of photographs in the linear units of a plan, at their mean values. */
static double linear_noise(const struct photos *photos,
                           const struct imp_measure_result *r)
{
    double sum = 0;
    for (size_t i = 0; i < photos->n; i++) {
        const struct imp_photo *p = &photos->photo[i];
        const struct imp_measure_photo *found = IMP_ROW(imp_measure_photo, r->photos, i);
        struct imp_sensor_info sensor = {.size = sizeof sensor};
        const size_t n = (size_t)p->width * (size_t)p->height * (size_t)p->channels;
        double mean = 0, gamma = 1;
        char name[320];
        size_t index;
        for (size_t k = 0; k < n; k++) mean += (double)p->pixels[k] / (double)n;
        if (imp_scene_get_sensor(cli.scene, p->sensor, &sensor) == IMP_OK &&
            sensor.photograph) {
            snprintf(name, sizeof name, "%.280s.gamma.value", sensor.name);
            if (imp_scene_find_param(cli.scene, name, &index) == IMP_OK)
                (void)!imp_scene_get_values(cli.scene, index, &gamma);
        }
        sum +=
            found->noise * gamma * pow(fmax(mean, 1e-3), gamma - 1) / (double)photos->n;
    }
    return sum;
}

static void add(struct next_photo *next, int sensor, bool have, const char *format)
{
    struct imp_sensor_info info = {.size = sizeof info};
    char text[320] = "";
    if (imp_scene_get_sensor(cli.scene, sensor, &info) == IMP_OK)
        snprintf(text, sizeof text, format, info.name);
    next->name[next->n] = cli_strdup(text);
    struct imp_plan_candidate *c = &next->c[next->n];
    *c = (struct imp_plan_candidate)IMP_PLAN_CANDIDATE_INIT;
    c->sensor = sensor;
    c->have = have;
    c->name = next->name[next->n++];
}

static bool has_photo(const struct photos *photos, int sensor)
{
    for (size_t i = 0; i < photos->n; i++)
        if (photos->photo[i].sensor == sensor) return true;
    return false;
}

int next_photo_find(imp_problem *problem, const struct photos *photos,
                    const struct imp_measure_result *r, struct next_photo *out)
{
    enum { DENSE = 236 }; /* numbers that a plan takes */
    struct imp_scene_info scene = {.size = sizeof scene};
    struct imp_plan_options options = IMP_PLAN_OPTIONS_INIT;
    struct imp_run run = cli_run();
    if (imp_problem_n_variables(problem) > DENSE) return 0;
    imp_scene_get_info(cli.scene, &scene);
    const size_t room = 2 * photos->n + (size_t)scene.n_sensors;
    out->c = cli_alloc(room, sizeof *out->c);
    out->name = cli_alloc(room, sizeof *out->name);
    for (size_t i = 0; i < photos->n; i++) add(out, photos->photo[i].sensor, true, "%s");
    for (int s = 0; s < scene.n_sensors; s++)
        if (!has_photo(photos, s)) add(out, s, false, "%s");
    for (size_t i = 0; i < photos->n; i++)
        add(out, photos->photo[i].sensor, false, "%s again");
    const struct imp_photo *first = &photos->photo[0];
    if (first->read > 0 || first->shot > 0 || first->relative > 0) {
        options.read = first->read;
        options.shot = first->shot;
        options.relative = first->relative;
    } else options.read = linear_noise(photos, r);
    run.time_limit_s = 0;
    if (run.spp == 0) run.spp = 64;
    const enum imp_status st =
        imp_plan(problem, out->c, out->n, &options, &run, &out->result);
    if (st == IMP_OK || st == IMP_CANCELLED) return 0;
    out->result = NULL;
    cli_say("importon: no plan for the next photograph: %s", imp_last_error(cli.context));
    return 0;
}

void next_photo_free(struct next_photo *next)
{
    for (size_t i = 0; i < next->n; i++) free(next->name[i]);
    free(next->name);
    free(next->c);
}
