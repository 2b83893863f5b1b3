/* SPDX-License-Identifier: Apache-2.0
 *
 * read --ugr and --dgp: the unified glare rating and the daylight glare probability at the
 * points of a grid, as text, JSON, a table, and a plan. */
#include "read_ratings.h"
#include "read_grid.h"
#include "shared/command.h"

#include <math.h>
#include <stdlib.h>

enum { LEAST_LX = 380 }; /* the formula of DGP was found for these */

struct ratings_wanted ratings_wanted = {0, 0, 5, 64};

const struct arg_option options_ratings[] = {
    {ARG_FLAG | ARG_REPLAYS, 0, "ugr", NULL,
     "glare ratings of the observers of --sensor, a grid with a line of sight",
     &ratings_wanted.ugr, 0, 0, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "dgp", NULL,
     "daylight glare probability of the observers of --sensor, a grid with a line of "
     "sight",
     &ratings_wanted.dgp, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "dgp-threshold", "X",
     "what is a source of glare: from X times the view's mean luminance on (5), above "
     "100 "
     "from X cd/m^2 on",
     &ratings_wanted.threshold, 1e-3, 1e12, NULL},
    {ARG_INT | ARG_REPLAYS, 0, "dgp-cells", "N",
     "the view has N x N cells (64), and at least 16 walks for each",
     &ratings_wanted.cells, 8, 512, NULL},
    {0}};

struct ratings {
    bool daylight;
    struct imp_dgp_options options;
    struct grid grid; /* the ratings are its values; -INFINITY: no luminaire is seen */
    double *lx;       /* [grid.n] with daylight: at the eyes */
    size_t worst;
};

static int compute(struct ratings *r, const struct imp_run *run)
{
    struct grid *g = &r->grid;
    const int rc = grid_open(run->sensor, g);
    if (rc) return rc;
    enum imp_status st;
    if (r->daylight) {
        g->unit = "DGP";
        r->lx = cli_alloc(g->n, sizeof *r->lx);
        st = imp_grid_dgp(cli.scene, run, &r->options, g->value, g->se, r->lx);
    } else {
        g->unit = "UGR";
        st = imp_grid_glare(cli.scene, run, g->value, g->se);
    }
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    for (size_t i = 1; i < g->n; i++)
        if (g->value[i] > g->value[r->worst]) r->worst = i;
    return 0;
}

static void text_print(const struct ratings *r)
{
    const struct grid *g = &r->grid;
    const double *p = g->points + 3 * r->worst, most = g->value[r->worst];
    size_t dim = 0;
    if (isinf(most)) {
        printf("%-20s UGR none: no luminaire is seen from its %zu point%s\n", g->name,
               g->n, plural((long long)g->n));
        return;
    }
    printf("%-20s %s %-10.*f +- %-8.2g at %g, %g, %g, the largest of %zu point%s\n",
           g->name, g->unit, r->daylight ? 3 : 1, most, g->se[r->worst], p[0], p[1], p[2],
           g->n, plural((long long)g->n));
    for (size_t i = 0; r->lx && i < g->n; i++) dim += r->lx[i] < LEAST_LX;
    if (dim > 0)
        printf("    %zu point%s below %d lx, the least for which DGP holds%s\n", dim,
               plural((long long)dim), LEAST_LX,
               r->lx[r->worst] < LEAST_LX ? ", this one among them" : "");
}

static void json_print(struct json *j, const struct ratings *r)
{
    const struct grid *g = &r->grid;
    json_object(j, NULL);
    json_text(j, "sensor", g->name);
    grid_places_json(j, g);
    if (r->daylight) {
        json_number(j, "threshold", r->options.threshold);
        json_integer(j, "view_cells", r->options.cells);
        json_numbers(j, "illuminance", g->n, r->lx);
    }
    json_numbers(j, r->daylight ? "dgp" : "ugr", g->n, g->value);
    json_numbers(j, "se", g->n, g->se);
    json_end_object(j);
}

int ratings_read(struct json *j, const struct imp_run *run, const char *csv,
                 const char *svg)
{
    struct ratings r = {.daylight = ratings_wanted.dgp,
                        .options = {.size = sizeof r.options,
                                    .threshold = ratings_wanted.threshold,
                                    .cells = ratings_wanted.cells}};
    int rc = compute(&r, run);
    if (!rc && cli.json) json_print(j, &r);
    if (!rc && !cli.json) text_print(&r);
    if (!rc && csv) rc = grid_csv(csv, &r.grid);
    if (!rc && svg) {
        char heading[128];
        snprintf(heading, sizeof heading, "%s at most %.*f", r.grid.unit,
                 r.daylight ? 3 : 1, r.grid.value[r.worst]);
        r.grid.heading = heading;
        rc = grid_svg(svg, &r.grid);
    }
    free(r.lx);
    grid_free(&r.grid);
    return rc;
}
