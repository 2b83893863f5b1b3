/* SPDX-License-Identifier: Apache-2.0
 *
 * A measurement's files: those of a fit, masks, and measure.json with stages and decisions. */
#include "measure_answer.h"
#include "shared/blocks.h"

#include "fit/fit_answer.h"
#include "fit/fit_pictures.h"
#include "shared/answer_file.h"
#include "shared/picture_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Masks ----------------------------------------------------------------------------- */

static char *mask_path(const struct photos *photos, size_t i)
{
    char file[64];
    if (photos->n == 1) snprintf(file, sizeof file, "mask.exr");
    else snprintf(file, sizeof file, "mask-%zu.exr", i);
    return join_path(cli.out, file);
}

/* Weights of the pixels, as --mask takes them; none where nothing is masked. */
static int masks_write(const struct measure_answer *a)
{
    const struct picture_options po = {0};
    const struct imp_run run = cli_run();
    int rc = 0;
    for (size_t i = 0; i < a->result->n_photos && !rc; i++) {
        const struct imp_measure_photo *p =
            IMP_ROW(imp_measure_photo, a->result->photos, i);
        const struct imp_photo *photo = &a->photos->photo[i];
        imp_film *film = NULL;
        char *path = mask_path(a->photos, i);
        rc = picture_writable(path, 1);
        if (!rc && !p->n_masked) picture_remove(path);
        if (!rc && p->n_masked) {
            const enum imp_status st =
                imp_film_create(cli.context, photo->width, photo->height, "Y", &film);
            if (st != IMP_OK) rc = cli_fail(st, path);
            else
                memcpy(imp_film_mean(film), p->weights,
                       (size_t)photo->width * (size_t)photo->height * sizeof(float));
            if (!rc) picture_stamp(film, &run);
            if (!rc) rc = picture_write(film, path, &po);
            imp_film_destroy(film);
        }
        free(path);
    }
    return rc;
}

/* ---- Textures -------------------------------------------------------------------------- */

/* As pictures or volumes, named by their parameters: the last fit's table has none. */
static int textures_write(const struct imp_measure_result *r)
{
    int rc = 0;
    for (size_t i = 0; i < r->n_textures && !rc; i++) {
        struct block b = {.info.size = sizeof b.info};
        char *path = NULL;
        if (imp_scene_get_param(cli.scene, r->textures[i], &b.info) != IMP_OK) continue;
        b.n = b.info.count;
        double *values = cli_alloc(b.n, sizeof *values);
        rc = block_writable(&b, cli.out, 0);
        if (!rc && imp_scene_get_values(cli.scene, r->textures[i], values) == IMP_OK)
            rc = block_write(&b, values, NULL, cli.out, &path);
        free(path);
        free(values);
    }
    return rc;
}

/* ---- JSON ------------------------------------------------------------------------------ */

static void put_rows(struct json *j, const struct imp_measure_result *r)
{
    json_array(j, "stages");
    for (size_t i = 0; i < r->n_rows; i++) {
        const struct imp_measure_row *row = IMP_ROW(imp_measure_row, r->rows, i);
        json_object(j, NULL);
        json_integer(j, "round", row->round);
        json_text(j, "stage", imp_measure_stage_name(row->stage));
        json_integer(j, "numbers", (int64_t)row->n);
        json_integer(j, "iterations", row->iterations);
        json_number(j, "residual", row->residual);
        json_number(j, "residual_hi", row->residual_hi);
        json_number(j, "chi2_per_freedom", row->chi2);
        json_number(j, "chi2_se", row->chi2_se);
        json_bool(j, "explained", row->explained);
        json_number(j, "moved", row->moved);
        json_end_object(j);
    }
    json_end_array(j);
}

static void put_photos(struct json *j, const struct measure_answer *a)
{
    json_array(j, "photographs");
    for (size_t i = 0; i < a->result->n_photos; i++) {
        const struct imp_measure_photo *p =
            IMP_ROW(imp_measure_photo, a->result->photos, i);
        const struct imp_photo *photo = &a->photos->photo[i];
        json_object(j, NULL);
        json_text(j, "file", photo->name);
        json_integer(j, "sensor", photo->sensor);
        json_number(j, "noise", p->noise);
        json_number(j, "chi2", p->chi2);
        json_integer(j, "blocks", (int64_t)p->n_blocks);
        json_integer(j, "masked", (int64_t)p->n_masked);
        if (photo->focal_35mm > 0) json_number(j, "focal_35mm", photo->focal_35mm);
        if (photo->exposure_s > 0) json_number(j, "exposure_s", photo->exposure_s);
        if (photo->iso > 0) json_number(j, "iso", photo->iso);
        if (photo->f_number > 0) json_number(j, "f_number", photo->f_number);
        json_end_object(j);
    }
    json_end_array(j);
}

static void put_next(struct json *j, const struct next_photo *next)
{
    if (!next->result) return;
    json_array(j, "next");
    for (size_t k = 0; k < next->result->n_rows; k++) {
        const struct imp_plan_row *row = IMP_ROW(imp_plan_row, next->result->rows, k);
        json_object(j, NULL);
        json_text(j, "photograph", next->name[row->candidate]);
        json_number(j, "gain", row->gain.value);
        json_number(j, "gain_se", row->gain.se);
        json_integer(j, "group", (int64_t)row->group);
        json_end_object(j);
    }
    json_end_array(j);
}

static void put_all(struct json *j, const struct measure_answer *a,
                    const struct fit_answer *fit)
{
    const struct imp_measure_result *r = a->result;
    json_integer(j, "rounds", r->rounds);
    json_bool(j, "explained", r->explained);
    put_rows(j, r);
    put_photos(j, a);
    put_next(j, a->next);
    json_array(j, "decisions");
    for (size_t i = 0; i < r->n_lines; i++) json_text(j, NULL, r->lines[i]);
    json_end_array(j);
    json_object(j, "fit");
    fit_answer_json(j, fit, NULL);
    json_end_object(j);
}

static int json_write(const struct measure_answer *a, const struct fit_answer *fit)
{
    struct answer_file to;
    const int rc = answer_open(&to, cli.out, "measure.json", "measure");
    if (rc) return rc;
    put_all(&to.json, a, fit);
    return answer_close(&to, 0);
}

/* ---- Text ------------------------------------------------------------------------------ */

static void next_print(const struct next_photo *next)
{
    size_t width = 10;
    if (!next->result || next->result->n_rows == 0) return;
    for (size_t k = 0; k < next->result->n_rows; k++) {
        const struct imp_plan_row *row = IMP_ROW(imp_plan_row, next->result->rows, k);
        const size_t n = strlen(next->name[row->candidate]);
        width = n > width ? n : width;
    }
    printf(
        "\nnext photograph ('=': the difference to the row above is within its error)\n");
    printf("%-4s  %-*s  %-8s  %-8s  intervals\n", "rank", (int)width, "photograph",
           "gain", "se");
    for (size_t k = 0; k < next->result->n_rows; k++) {
        const struct imp_plan_row *row = IMP_ROW(imp_plan_row, next->result->rows, k);
        const bool same =
            k > 0 &&
            IMP_ROW(imp_plan_row, next->result->rows, k - 1)->group == row->group;
        char rank[24];
        snprintf(rank, sizeof rank, same ? "=" : "%zu", k + 1);
        printf("%-4s  %-*s  %-8.4g  %-8.2g  x %.3g\n", rank, (int)width,
               next->name[row->candidate], row->gain.value, row->gain.se,
               exp(-0.5 * row->gain.value));
    }
}

int measure_answer_writable(void)
{
    int rc = fit_answer_writable(NULL, 0);
    if (!rc) rc = overwrite_check_in(cli.out, "measure.json", OUTPUT_JSON);
    return rc;
}

int measure_answer_give(const struct measure_answer *a)
{
    size_t n_blocks;
    struct block *blocks = problem_blocks(a->problem, &n_blocks);
    const char **more = cli_alloc(a->result->n_textures, sizeof *more);
    struct fit_answer fit = {.problem = a->problem,
                             .result = a->result->fit,
                             .blocks = blocks,
                             .n_blocks = n_blocks,
                             .optimizer = "lm",
                             .missing = a->result->missing,
                             .n_missing = a->result->n_missing,
                             .looked = !a->result->explained,
                             .more = more};
    int rc = 0;
    for (size_t k = 0; k < a->result->n_textures; k++) {
        struct imp_param_info info = {.size = sizeof info};
        if (imp_scene_get_param(cli.scene, a->result->textures[k], &info) == IMP_OK)
            more[fit.n_more++] = info.name;
    }
    if (cli.json) {
        struct json j = cli_json();
        put_all(&j, a, &fit);
        cli_json_end(&j);
    } else {
        struct fit_answer table = fit;
        table.looked = 0; /* a line has been printed for each */
        printf("\n");
        fit_answer_print(&table);
        next_print(a->next);
    }
    if (cli.out) rc = fit_answer_write(&fit);
    if (!rc && cli.out) rc = textures_write(a->result);
    if (!rc && cli.out) rc = masks_write(a);
    if (!rc && cli.out) rc = json_write(a, &fit);
    if (!rc && cli.out) rc = fit_pictures_write("recovered", 0);
    free(blocks);
    free(more);
    return rc;
}
