/* SPDX-License-Identifier: Apache-2.0
 *
 * read --ugr: the unified glare rating at the points of a grid. */
#include "read_glare.h"
#include "shared/command.h"

#include <math.h>
#include <stdlib.h>

int glare_read(struct json *j, const struct imp_run *run)
{
    struct imp_sensor_info info = {.size = sizeof info};
    enum imp_status st = imp_scene_get_sensor(cli.scene, run->sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    const size_t n = (size_t)info.width * (size_t)info.height;
    double *ugr = cli_alloc(5 * n, sizeof *ugr), *se = ugr + n, *place = se + n;
    st = imp_grid_glare(cli.scene, run, ugr, se);
    if (st == IMP_OK) st = imp_grid_points(cli.scene, run->sensor, place, NULL);
    if (st != IMP_OK) {
        free(ugr);
        return cli_fail(st, cli.scene_path);
    }
    size_t worst = 0;
    for (size_t i = 1; i < n; i++)
        if (ugr[i] > ugr[worst]) worst = i;
    if (cli.json) {
        json_object(j, NULL);
        json_text(j, "sensor", info.name);
        json_integer(j, "width", info.width);
        json_integer(j, "height", info.height);
        json_array(j, "points");
        for (size_t i = 0; i < n; i++) json_numbers(j, NULL, 3, place + 3 * i);
        json_end_array(j);
        json_numbers(j, "ugr", n, ugr);
        json_numbers(j, "se", n, se);
        json_end_object(j);
    } else if (isinf(ugr[worst])) {
        printf("%-20s UGR none: no luminaire is seen from its %zu point%s\n", info.name,
               n, plural((long long)n));
    } else {
        const double *p = place + 3 * worst;
        printf("%-20s UGR %-10.1f +- %-8.2g at %g, %g, %g, the largest of %zu point%s\n",
               info.name, ugr[worst], se[worst], p[0], p[1], p[2], n,
               plural((long long)n));
    }
    free(ugr);
    return 0;
}
