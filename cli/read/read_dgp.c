/* SPDX-License-Identifier: Apache-2.0
 *
 * read --dgp: the daylight glare probability at the points of a grid. */
#include "read_dgp.h"
#include "shared/command.h"

#include <stdlib.h>

struct dgp_wanted dgp_wanted = {0, 5, 64};

const struct arg_option options_dgp[] = {
    {ARG_FLAG | ARG_REPLAYS, 0, "dgp", NULL,
     "daylight glare probability of the observers of --sensor, a grid with a line of "
     "sight",
     &dgp_wanted.on, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "dgp-threshold", "X",
     "what is a source of glare: from X times the view's mean luminance on (5), above "
     "100 "
     "from X cd/m^2 on",
     &dgp_wanted.threshold, 1e-3, 1e12, NULL},
    {ARG_INT | ARG_REPLAYS, 0, "dgp-cells", "N",
     "the view has N x N cells (64), and at least 16 walks for each", &dgp_wanted.cells,
     8, 512, NULL},
    {0}};

/* The formula was found for these. */
enum { LEAST_LX = 380 };

static void worst_print(const struct imp_sensor_info *info, size_t n, const double *dgp,
                        const double *se, const double *lx, const double *place)
{
    size_t worst = 0, dim = 0;
    for (size_t i = 0; i < n; i++) {
        if (dgp[i] > dgp[worst]) worst = i;
        dim += lx[i] < LEAST_LX;
    }
    const double *p = place + 3 * worst;
    printf("%-20s DGP %-10.3f +- %-8.2g at %g, %g, %g, the largest of %zu point%s\n",
           info->name, dgp[worst], se[worst], p[0], p[1], p[2], n, plural((long long)n));
    if (dim > 0)
        printf("    %zu point%s below %d lx, the least for which DGP holds%s\n", dim,
               plural((long long)dim), LEAST_LX,
               lx[worst] < LEAST_LX ? ", this one among them" : "");
}

int dgp_read(struct json *j, const struct imp_run *run)
{
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_dgp_options options = {.size = sizeof options,
                                      .threshold = dgp_wanted.threshold,
                                      .cells = dgp_wanted.cells};
    enum imp_status st = imp_scene_get_sensor(cli.scene, run->sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    const size_t n = (size_t)info.width * (size_t)info.height;
    double *dgp = cli_alloc(6 * n, sizeof *dgp), *se = dgp + n, *lx = se + n,
           *place = lx + n;
    st = imp_grid_dgp(cli.scene, run, &options, dgp, se, lx);
    if (st == IMP_OK) st = imp_grid_points(cli.scene, run->sensor, place, NULL);
    if (st != IMP_OK) {
        free(dgp);
        return cli_fail(st, cli.scene_path);
    }
    if (cli.json) {
        json_object(j, NULL);
        json_text(j, "sensor", info.name);
        json_integer(j, "width", info.width);
        json_integer(j, "height", info.height);
        json_number(j, "threshold", options.threshold);
        json_integer(j, "cells", options.cells);
        json_array(j, "points");
        for (size_t i = 0; i < n; i++) json_numbers(j, NULL, 3, place + 3 * i);
        json_end_array(j);
        json_numbers(j, "dgp", n, dgp);
        json_numbers(j, "se", n, se);
        json_numbers(j, "illuminance", n, lx);
        json_end_object(j);
    } else {
        worst_print(&info, n, dgp, se, lx, place);
    }
    free(dgp);
    return 0;
}
