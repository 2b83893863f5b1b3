/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks behind the sliders of a picture: when a value is moved, walks that were
 * recorded at other values are evaluated, without a ray, in a fraction of the time in
 * which as many are traced. Fresh ones follow. */
#include "view.h"

#include <importon/walks.h>

#include <stdbool.h>

/* Walks of a pixel, least effective sample size without a new draw, and bytes: what can be
 * evaluated in a tenth of a second or so, which no wish cuts short. */
enum { SPP = 16, LEAST_SPP = 1, BYTES = 256 << 20 };
#define WORTH .8

static struct {
    imp_walks *walks; /* NULL: none */
    int spp;
    bool stale; /* at the present values, less useful than a new draw */
    bool never; /* this scene's walks are not kept */
} k;

static struct imp_run run_of(int spp)
{
    struct imp_run run = cli_run();
    run.spp = spp;
    return run;
}

void view_kept_draw(int64_t most)
{
    const struct imp_walks_options options = {.size = sizeof options, .memory = BYTES};
    if (k.never || (k.walks && !k.stale)) return;
    for (int spp = SPP; spp >= LEAST_SPP; spp /= 4) {
        struct imp_run run = run_of(spp);
        imp_walks *walks;
        if (spp > most) continue;
        run.progress = view_progress;
        const enum imp_status st = imp_walks_keep(cli.scene, &run, &options, &walks);
        if (st == IMP_OK) {
            imp_walks_destroy(k.walks);
            k.walks = walks;
            k.spp = spp;
            k.stale = false;
            return;
        }
        k.never = st != IMP_CANCELLED && st != IMP_E_NOMEM;
        if (st != IMP_E_NOMEM) return;
    }
}

imp_film *view_kept_picture(int64_t most, double *ess)
{
    struct imp_walks_weight weight = IMP_WALKS_WEIGHT_INIT;
    struct imp_run run = run_of(k.spp);
    imp_film *film;
    if (!k.walks || k.spp > most) return NULL;
    k.stale = true;
    if (imp_walks_weigh(k.walks, run.sensor, NULL, &weight) != IMP_OK || weight.refused)
        return NULL;
    run.walks = k.walks;
    if (imp_render(cli.scene, &run, &film) != IMP_OK) return NULL;
    k.stale = weight.ess < WORTH;
    *ess = weight.ess;
    return film;
}

void view_kept_close(void)
{
    imp_walks_destroy(k.walks);
    k.walks = NULL;
}
