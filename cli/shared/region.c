/* SPDX-License-Identifier: Apache-2.0
 *
 * --region X0,Y0,X1,Y1 as the adjoint image of a mean over it, and as a mask. */
#include "region.h"

#include "command.h"

#include <stdio.h>

static int region_read(const char *text, const struct imp_sensor_info *sensor, int at[4])
{
    char end;
    at[0] = at[1] = 0;
    at[2] = sensor->width;
    at[3] = sensor->height;
    if (!text) return 0;
    if (sscanf(text, "%d,%d,%d,%d%c", &at[0], &at[1], &at[2], &at[3], &end) != 4)
        return cli_error(EXIT_USAGE, "--region %s: expected X0,Y0,X1,Y1", text);
    if (at[0] < 0 || at[1] < 0 || at[2] <= at[0] || at[3] <= at[1] ||
        at[2] > sensor->width || at[3] > sensor->height)
        return cli_error(EXIT_USAGE,
                         "--region %s does not lie in the picture, which has %d x %d "
                         "pixels",
                         text, sensor->width, sensor->height);
    return 0;
}

int region_take(const char *text, int number, float **adjoint, float **mask)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    int at[4];
    imp_scene_get_info(cli.scene, &scene);
    const enum imp_status st = imp_scene_get_sensor(cli.scene, number, &sensor);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    const int rc = region_read(text, &sensor, at);
    if (rc) return rc;
    const size_t pixels = (size_t)sensor.width * (size_t)sensor.height,
                 C = (size_t)scene.channels;
    const float one =
        (float)(1 / ((double)(at[2] - at[0]) * (at[3] - at[1]) * scene.channels));
    *adjoint = cli_alloc(pixels * C, sizeof **adjoint);
    if (text) *mask = cli_alloc(pixels, sizeof **mask);
    for (int y = at[1]; y < at[3]; y++)
        for (int x = at[0]; x < at[2]; x++) {
            const size_t p = (size_t)y * (size_t)sensor.width + (size_t)x;
            if (text) (*mask)[p] = 1;
            for (size_t c = 0; c < C; c++) (*adjoint)[p * C + c] = one;
        }
    return 0;
}
