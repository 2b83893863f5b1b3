/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of a fit in the live view: its targets, and the renders of their sensors. */
#include "fit/fit_pictures.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "view.h"

#include <stdlib.h>

void view_targets(void)
{
    const size_t n = problem_options.targets.n;
    struct imp_report_item *item = cli_alloc(n, sizeof *item);
    imp_film **film = cli_alloc(n, sizeof *film);
    size_t used = 0;
    for (size_t i = 0; i < n; i++) {
        if (fit_target_film(i, &film[used])) continue;
        item[used] = (struct imp_report_item)IMP_REPORT_ITEM_INIT;
        item[used].kind = "picture";
        item[used].name = item[used].role = "target";
        item[used].view = (int)i;
        item[used].film = film[used];
        used++;
    }
    view_show(VIEW_TARGET, item, used);
    for (size_t i = 0; i < used; i++) imp_film_destroy(film[i]);
    free(film);
    free(item);
}

void view_pictures(enum view_channel channel, const char *name, const char *role, int spp)
{
    const size_t n = problem_options.targets.n;
    struct imp_report_item *item = cli_alloc(n, sizeof *item);
    imp_film **film = cli_alloc(n, sizeof *film);
    size_t used = 0;
    for (size_t i = 0; i < n && !view_asked(); i++) {
        struct imp_run run = cli_run();
        run.sensor = target_sensor(i);
        run.time_limit_s = 0;
        if (spp) run.spp = spp;
        run.progress = spp ? NULL : view_progress;
        if (cli_failed(imp_render(cli.scene, &run, &film[used])) || !film[used]) continue;
        item[used] = (struct imp_report_item)IMP_REPORT_ITEM_INIT;
        item[used].kind = "picture";
        item[used].name = name;
        item[used].role = role;
        item[used].view = (int)i;
        item[used].film = film[used];
        used++;
    }
    if (used) view_show(channel, item, used);
    for (size_t i = 0; i < used; i++) imp_film_destroy(film[i]);
    free(film);
    free(item);
}
