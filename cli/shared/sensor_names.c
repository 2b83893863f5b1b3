/* SPDX-License-Identifier: Apache-2.0
 *
 * Which sensor an option means. */
#include "sensor_names.h"
#include "command.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBER_DIGITS = 6 };

/* A whole number; -1: another text. */
static int number_of(const char *text)
{
    const size_t n = strlen(text);
    return n && n <= NUMBER_DIGITS && strspn(text, "0123456789") == n ? atoi(text) : -1;
}

int sensor_count(void)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    return imp_scene_get_info(cli.scene, &scene) == IMP_OK ? scene.n_sensors : 0;
}

static const char *name_of(int sensor)
{
    struct imp_sensor_info info = {.size = sizeof info};
    const bool there = imp_scene_get_sensor(cli.scene, sensor, &info) == IMP_OK;
    return there && info.name ? info.name : "";
}

int sensor_named(const char *name, size_t length)
{
    for (int s = 0; s < sensor_count(); s++)
        if (strlen(name_of(s)) == length && !strncmp(name_of(s), name, length)) return s;
    return -1;
}

int sensor_find(const char *text)
{
    const int named = sensor_named(text, strlen(text)), number = number_of(text);
    return named >= 0 ? named : number < sensor_count() ? number : -1;
}

void sensor_names(char *text, size_t size)
{
    size_t used = 0;
    *text = 0;
    for (int s = 0; s < sensor_count() && used < size; s++)
        used +=
            (size_t)snprintf(text + used, size - used, "%s%s", s ? ", " : "", name_of(s));
}

int sensor_set(const char *text)
{
    char names[256];
    const int found = sensor_find(text);
    cli.sensor = found >= 0 ? found : number_of(text);
    if (cli.sensor >= 0) return 0; /* a number that there is not: who uses it says so */
    sensor_names(names, sizeof names);
    return cli_error(EXIT_USAGE, "--sensor %s: the scene has no such sensor; it has: %s",
                     text, names);
}
