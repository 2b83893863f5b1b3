/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the things that numbers of geometry move are in the pictures: the middle, how far a step
 * along x, y and z shifts it, and the way of a search. docs/report.md has the members. */
#include "places.h"
#include "blocks.h"
#include "command.h"

#include <math.h>
#include <string.h>

/* The step of the differences along the axes, in radii of the thing. */
#define STEP 0.01

/* Which of its numbers shift the thing along x, y, z, and whether the next three turn it. */
struct shifts {
    const char *tail;
    int number[3];
    bool turns;
    bool alone; /* no other of its numbers shifts the middle */
};
static const struct shifts known[] = {{".pose", {0, 1, 2}, true, true},
                                      {".center", {0, 1, 2}, false, true},
                                      {".position", {0, 1, 2}, false, true},
                                      {".to_world", {3, 7, 11}, false, false}};

static const struct shifts *shifts_of(const char *name)
{
    for (size_t k = 0; k < sizeof known / sizeof *known; k++) {
        const size_t n = strlen(name), tail = strlen(known[k].tail);
        if (n > tail && !strcmp(name + n - tail, known[k].tail)) return &known[k];
    }
    return NULL;
}

static bool film_at(int sensor, const double p[3], double film[2])
{
    return imp_scene_film_point(cli.scene, sensor, p, film) == IMP_OK &&
           isfinite(film[0]) && isfinite(film[1]);
}

/* Pixels that the middle moves by for each unit along x, y, z. */
static bool axes_at(int sensor, const double p[3], double step, double axes[3][2])
{
    for (int k = 0; k < 3; k++) {
        double before[3], behind[3], a[2], b[2];
        memcpy(before, p, sizeof before);
        memcpy(behind, p, sizeof behind);
        before[k] -= step;
        behind[k] += step;
        if (!film_at(sensor, before, a) || !film_at(sensor, behind, b)) return false;
        for (int i = 0; i < 2; i++) axes[k][i] = (b[i] - a[i]) / (2 * step);
    }
    return true;
}

static void way_put(struct json *j, int sensor, const double middle[3],
                    const struct shifts *s, const struct places_way *way, size_t first,
                    const double *now)
{
    json_array(j, "way");
    for (size_t i = 0; i < way->n; i++) {
        double p[3], film[2];
        const double *x = way->x + i * way->n_numbers + first;
        for (int k = 0; k < 3; k++)
            p[k] = middle[k] + x[s->number[k]] - now[s->number[k]];
        if (film_at(sensor, p, film)) json_numbers(j, NULL, 2, film);
    }
    json_end_array(j);
}

/* The thing of a parameter in one picture; way NULL: none. Opens the array before the first. */
static void place_put(struct json *j, bool *opened, size_t param, int view, int sensor,
                      const struct places_way *way, size_t first)
{
    struct imp_param_info info = {.size = sizeof info};
    double middle[3], radius, film[2], axes[3][2], now[12] = {0};
    if (imp_scene_get_param(cli.scene, param, &info) != IMP_OK || info.count > 12) return;
    const struct shifts *s = shifts_of(info.name);
    if (!s || imp_scene_place(cli.scene, param, middle, &radius) != IMP_OK ||
        imp_scene_get_values(cli.scene, param, now) != IMP_OK ||
        !film_at(sensor, middle, film) || !axes_at(sensor, middle, STEP * radius, axes))
        return;
    if (!*opened) json_array(j, "places");
    *opened = true;
    json_object(j, NULL);
    json_text(j, "name", info.name);
    json_integer(j, "view", view);
    json_numbers(j, "at", 2, film);
    json_number(j, "radius", radius);
    json_array(j, "axes");
    for (int k = 0; k < 3; k++) json_numbers(j, NULL, 2, axes[k]);
    json_end_array(j);
    json_array(j, "shifts");
    for (int k = 0; k < 3; k++) json_integer(j, NULL, s->number[k]);
    json_end_array(j);
    json_bool(j, "turns", s->turns);
    if (way && way->n && s->alone) way_put(j, sensor, middle, s, way, first, now);
    json_end_object(j);
}

void places_json(struct json *j, const struct block *blocks, size_t n_blocks,
                 const struct places_way *way)
{
    const size_t n_targets = problem_options.targets.n;
    bool opened = false;
    for (size_t t = 0; t < (n_targets ? n_targets : 1); t++)
        for (size_t k = 0; k < n_blocks; k++) {
            size_t param;
            if (blocks[k].tie.log || !shifts_of(blocks[k].info.name) ||
                imp_scene_find_param(cli.scene, blocks[k].info.name, &param) != IMP_OK)
                continue;
            place_put(j, &opened, param, (int)t,
                      n_targets ? target_sensor(t) : cli.sensor, way, blocks[k].first);
        }
    if (opened) json_end_array(j);
}

void places_params_json(struct json *j, const size_t *param, size_t n)
{
    bool opened = false;
    for (size_t i = 0; i < n; i++)
        if (!i || param[i] != param[i - 1])
            place_put(j, &opened, param[i], 0, cli.sensor, NULL, 0);
    if (opened) json_end_array(j);
}
