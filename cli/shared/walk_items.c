/* SPDX-License-Identifier: Apache-2.0
 *
 * JSON of a pixel's walks, and of the shares of pixel and walk in the gradient of each
 * parameter. */
#include "walk_items.h"

#include <importon/report.h>
#include <math.h>
#include <stdlib.h>

/* ---- Shares --------------------------------------------------------------------------- */

struct shares {
    imp_problem *problem; /* NULL: there are no derivatives, and so no shares */
    size_t n;             /* parameters of the scene */
    double *share, *se, *walk;
    size_t *on, n_on; /* those that have derivatives */
};

/* Shares of all parameters with a gradient. A scene that has none has walks all the same. */
static void shares_open(struct shares *s, int count)
{
    *s = (struct shares){.n = imp_scene_n_params(cli.scene)};
    if (imp_problem_create(cli.scene, &s->problem) != IMP_OK) return;
    if (imp_problem_activate(s->problem, "*") != IMP_OK) {
        imp_problem_destroy(s->problem);
        s->problem = NULL;
        return;
    }
    s->share = cli_alloc(s->n, sizeof *s->share);
    s->se = cli_alloc(s->n, sizeof *s->se);
    s->walk = cli_alloc(s->n * (size_t)count, sizeof *s->walk);
    s->on = cli_alloc(s->n, sizeof *s->on);
    char *active = cli_alloc(s->n, 1);
    for (size_t i = 0; i < imp_problem_n_variables(s->problem); i++) {
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        if (imp_problem_get_variable(s->problem, i, &v) == IMP_OK) active[v.param] = 1;
    }
    for (size_t k = 0; k < s->n; k++)
        if (active[k]) s->on[s->n_on++] = k;
    free(active);
}

static void shares_close(struct shares *s)
{
    if (s->problem) imp_problem_destroy(s->problem);
    free(s->share);
    free(s->se);
    free(s->walk);
    free(s->on);
}

static void put_params(struct json *j, const struct shares *s)
{
    json_array(j, "params");
    for (size_t k = 0; k < s->n_on; k++) {
        struct imp_param_info info = {.size = sizeof info};
        if (imp_scene_get_param(cli.scene, s->on[k], &info) != IMP_OK) continue;
        json_object(j, NULL);
        json_text(j, "name", info.name);
        json_text(j, "unit", info.unit);
        json_end_object(j);
    }
    json_end_array(j);
}

/* Shares of one pixel, and of its first walks. */
static enum imp_status put_shares(struct json *pixels, struct json *walks,
                                  const struct shares *s, const struct imp_run *run,
                                  const int at[2], int count)
{
    struct imp_estimate radiance;
    const enum imp_status st =
        imp_problem_shares(s->problem, run, at[0], at[1], s->share, s->se, &radiance,
                           s->walk, count < cli_spp(run) ? count : cli_spp(run));
    if (st != IMP_OK) return st;
    json_object(pixels, NULL);
    json_array(pixels, "pixel");
    json_integer(pixels, NULL, at[0]);
    json_integer(pixels, NULL, at[1]);
    json_end_array(pixels);
    json_integer(pixels, "walks", cli_spp(run));
    json_number(pixels, "radiance", radiance.value);
    json_number(pixels, "se", radiance.se);
    json_array(pixels, "shares");
    for (size_t k = 0; k < s->n_on; k++)
        json_numbers(pixels, NULL, 2,
                     (const double[2]){s->share[s->on[k]], s->se[s->on[k]]});
    json_end_array(pixels);
    json_end_object(pixels);
    for (int i = 0; i < count; i++) {
        json_array(walks, NULL);
        for (size_t k = 0; k < s->n_on; k++)
            json_number(walks, NULL,
                        i < cli_spp(run) ? s->walk[(size_t)i * s->n + s->on[k]] : NAN);
        json_end_array(walks);
    }
    return IMP_OK;
}

/* Members "params", "pixels" and "walk_shares", or nothing where the scene's walks have no
 * derivatives. */
static enum imp_status put_all_shares(struct json *j, const struct imp_run *run, size_t n,
                                      const int (*pixel)[2], int count)
{
    struct shares s;
    char *text[2] = {NULL, NULL};
    size_t length[2];
    struct json part[2];
    enum imp_status st = IMP_OK;
    for (int k = 0; k < 2; k++) {
        part[k] = (struct json){open_memstream(&text[k], &length[k]), 0};
        if (!part[k].file) exit(cli_error(EXIT_RUN, "out of memory"));
    }
    shares_open(&s, count);
    json_object(&part[0], NULL);
    json_object(&part[1], NULL);
    json_array(&part[0], "pixels");
    json_array(&part[1], "walk_shares");
    for (size_t i = 0; i < n && st == IMP_OK && s.problem; i++)
        st = put_shares(&part[0], &part[1], &s, run, pixel[i], count);
    json_end_array(&part[0]);
    json_end_array(&part[1]);
    fclose(part[0].file);
    fclose(part[1].file);
    if (st == IMP_OK && s.problem) {
        put_params(j, &s);
        fprintf(j->file, ",%s,%s", text[0] + 1, text[1] + 1);
    }
    shares_close(&s);
    free(text[0]);
    free(text[1]);
    return st == IMP_E_NOMEM ? st : IMP_OK;
}

/* ---- Walks ----------------------------------------------------------------------------- */

char *walks_json(const struct imp_run *run, size_t n, const int (*pixel)[2], int count,
                 int *rc)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct imp_run own = *run;
    char *text = NULL;
    size_t length = 0;
    own.points = IMP_POINTS_INDEPENDENT; /* the walks of a pixel are 0, 1, 2, ... */
    enum imp_status st = imp_scene_get_info(cli.scene, &scene);
    FILE *f = st == IMP_OK ? open_memstream(&text, &length) : NULL;
    if (f) {
        struct json j = {f, 0};
        json_object(&j, NULL);
        json_array(&j, "bounds");
        json_numbers(&j, NULL, 3, scene.bounds_min);
        json_numbers(&j, NULL, 3, scene.bounds_max);
        json_end_array(&j);
        st = put_all_shares(&j, &own, n, pixel, count);
        fputs(",\"walks\":[", f);
        for (size_t i = 0; i < n * (size_t)count && st == IMP_OK; i++) {
            const int *at = pixel[i / (size_t)count];
            char *walk = NULL;
            st = imp_walk_describe(cli.scene, &own, at[0], at[1],
                                   (int64_t)(i % (size_t)count), 1, &walk);
            if (st == IMP_OK) fprintf(f, "%s%s", i ? "," : "", walk);
            imp_free(cli.context, walk);
        }
        fputs("]}", f);
        if (fclose(f) != 0 && st == IMP_OK) st = IMP_E_NOMEM;
    }
    *rc = st != IMP_OK ? cli_fail(st, cli.scene_path)
          : !f         ? cli_error(EXIT_RUN, "out of memory")
                       : 0;
    if (!*rc) return text;
    free(text);
    return NULL;
}
