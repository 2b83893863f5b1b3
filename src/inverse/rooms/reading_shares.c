/* SPDX-License-Identifier: Apache-2.0
 *
 * Shares of lights and materials in a reading: derivatives by a common factor of each one's
 * numbers (ties, inverse/problem), so that errors contain the covariances of the numbers. */
#include "base/arguments.h"
#include "base/text.h"
#include "inverse/problem/match.h"
#include "inverse/problem/problem.h"
#include "room_average.h"
#include "walk/run/run.h"
#include <importon/rooms.h>
#include <string.h>

struct groups {
    const struct imp_scene *scene;
    int *of;               /* [n_params] row of a parameter, -1: none */
    struct imp_share *row; /* [n] */
    bool *lit;             /* [n] some of its numbers are not 0 */
    size_t n;
};

/* The parameters of an input, textures' included, become part of the row; *row >= 0: one of
 * them belongs to that row already. */
static void take(struct groups *g, const struct imp_input *in, bool marks, int *row)
{
    const struct imp_texture *t = in->texture;
    const int param = t ? t->param : in->param;
    if (param >= 0 && g->of[param] >= 0) *row = g->of[param];
    if (param >= 0 && marks && g->of[param] < 0) {
        const struct imp_param *p = &g->scene->params[param];
        g->of[param] = *row;
        for (size_t e = 0; e < p->info.count && !g->lit[*row]; e++)
            g->lit[*row] = imp__param_get(p, e) != 0;
    }
    for (int k = 0; t && k < t->n_in; k++) take(g, t->input[k], marks, row);
}

static void object_take(struct groups *g, enum imp_share_of of, const char *name,
                        const struct imp_input *const *input,
                        const struct imp_input_desc *desc, int n_own)
{
    const enum imp_role role = of == IMP_SHARE_LIGHT ? IMP_EMISSION : IMP_REFLECTANCE;
    int row = -1, inputs = 0;
    for (int j = 0; j < n_own; j++) {
        if (desc[j].role != role || desc[j].flags & IMP_INPUT_SCALAR) continue;
        inputs++;
        take(g, input[j], false, &row);
    }
    if (inputs == 0 || row >= 0) return;
    row = (int)g->n++;
    g->row[row] = (struct imp_share){of, name, 0, 0};
    for (int j = 0; j < n_own; j++)
        if (desc[j].role == role && !(desc[j].flags & IMP_INPUT_SCALAR))
            take(g, input[j], true, &row);
}

static void groups_find(struct groups *g)
{
    const struct imp_scene *s = g->scene;
    for (size_t k = 0; k < s->n_params; k++) g->of[k] = -1;
    for (int i = 0; i < s->n_emitters; i++)
        object_take(g, IMP_SHARE_LIGHT, s->emitters[i]->name, s->emitters[i]->input,
                    s->emitters[i]->ops->inputs, s->emitters[i]->n_in);
    for (int i = 0; i < s->n_bsdfs; i++)
        object_take(g, IMP_SHARE_SURFACE, s->bsdfs[i]->name, s->bsdfs[i]->input,
                    s->bsdfs[i]->ops->inputs, s->bsdfs[i]->n_own);
}

/* One variable for the row: the common factor of its parameters. Rows of zeros have none. */
static enum imp_status row_tie(struct groups *g, imp_problem *problem, size_t row)
{
    const struct imp_scene *s = g->scene;
    struct imp_text names = {.ctx = s->ctx};
    enum imp_status st = IMP_OK;
    int n = 0;
    for (size_t k = 0; k < s->n_params; k++) {
        const struct imp_param_info *info = &s->params[k].info;
        if (g->of[k] != (int)row) continue;
        if (imp__has_wildcards(info->name) || strchr(info->name, ','))
            IMP_TRY(
                imp__error(s->ctx, IMP_E_ARG,
                           "the name %s has signs that choose several: give the object "
                           "another id for shares",
                           info->name));
        if (!(info->flags & IMP_PARAM_DIFFERENTIABLE) &&
            g->row[row].of == IMP_SHARE_SURFACE)
            continue;
        IMP_TRY(imp_problem_activate(problem, info->name));
        imp__put(&names, "%s%s", n++ ? "," : "", info->name);
    }
    if (names.failed) IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for shares"));
    if (n > 0)
        IMP_TRY(imp_problem_tie(problem, (const char *)names.bytes.data, IMP_TIE_FACTOR));
out:
    imp__bytes_free(s->ctx, &names.bytes);
    return st;
}

static enum imp_status shares_take(struct groups *g, imp_problem *problem,
                                   const struct imp_run *run,
                                   struct imp_estimate *reading)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *s = g->scene;
    const size_t n = imp_problem_n_variables(problem);
    double *gradient = imp__alloc(s->ctx, 2 * n + 1, sizeof *gradient),
           *se = gradient + n;
    if (!gradient) IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for shares"));
    IMP_TRY(imp__room_average(problem, run, reading, n ? gradient : NULL, n ? se : NULL));
    for (size_t i = 0; i < n; i++) {
        struct imp_tie_info tie = {.size = sizeof tie};
        size_t param;
        IMP_TRY(imp_problem_get_tie(problem, i, &tie));
        IMP_TRY(imp_scene_find_param(s, tie.members[0], &param));
        g->row[g->of[param]].value = gradient[i];
        g->row[g->of[param]].se = se[i];
    }
out:
    imp__release(s->ctx, gradient);
    return st;
}

enum imp_status imp_reading_shares(imp_scene *scene, const struct imp_run *run,
                                   struct imp_share *share, size_t room, size_t *n,
                                   struct imp_estimate *reading)
{
    enum imp_status st = IMP_OK;
    imp_problem *problem = NULL;
    struct imp_run own;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, n, "n");
    if (room > 0) {
        IMP_REQUIRE(scene->ctx, share, "share");
        IMP_REQUIRE(scene->ctx, reading, "reading");
    }
    IMP_RUN(scene->ctx, own, run);
    if (!scene->committed)
        return imp__error(scene->ctx, IMP_E_ARG, "the scene has not been committed");
    const size_t most = (size_t)scene->n_emitters + (size_t)scene->n_bsdfs + 1;
    struct groups g = {.scene = scene};
    g.of = imp__alloc(scene->ctx, scene->n_params + 1, sizeof *g.of);
    g.row = imp__alloc(scene->ctx, most, sizeof *g.row);
    g.lit = imp__alloc(scene->ctx, most, sizeof *g.lit);
    if (!g.of || !g.row || !g.lit)
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory for shares"));
    groups_find(&g);
    if (g.n <= room) {
        struct imp_estimate value;
        IMP_TRY(imp_problem_create(scene, &problem));
        for (size_t row = 0; row < g.n; row++)
            if (g.lit[row]) IMP_TRY(row_tie(&g, problem, row));
        IMP_TRY(shares_take(&g, problem, &own, &value));
        if (g.n > 0) memcpy(share, g.row, g.n * sizeof *share);
        if (reading) *reading = value;
    }
    *n = g.n;
out:
    imp_problem_destroy(problem);
    imp__release(scene->ctx, g.of);
    imp__release(scene->ctx, g.row);
    imp__release(scene->ctx, g.lit);
    return st;
}
