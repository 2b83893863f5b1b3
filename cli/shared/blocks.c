/* SPDX-License-Identifier: Apache-2.0
 *
 * Blocks of a problem's numbers: their JSON, and their files. */
#include "blocks.h"

#include "overwrite.h"
#include "picture_files.h"
#include "proof.h"

#include <stdlib.h>

struct block *problem_blocks(const imp_problem *problem, size_t *n_blocks)
{
    const size_t n = imp_problem_n_variables(problem);
    struct block *blocks = cli_alloc(imp_scene_n_params(cli.scene), sizeof *blocks);
    *n_blocks = 0;
    for (size_t i = 0; i < n;) {
        struct block *b = &blocks[*n_blocks];
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        b->info.size = sizeof b->info;
        b->tie.size = sizeof b->tie;
        if (imp_problem_get_variable(problem, i, &v) != IMP_OK ||
            imp_problem_get_tie(problem, i, &b->tie) != IMP_OK ||
            imp_scene_get_param(cli.scene, v.param, &b->info) != IMP_OK || !b->info.count)
            break;
        if (b->tie.factor) {
            b->info.name = b->tie.name;
            b->info.unit = "1";
            b->info.count = 1;
            b->info.n_dims = 0;
            b->info.wavelengths_nm = NULL;
        }
        b->problem = problem;
        b->first = i;
        b->n = b->tie.count; /* parameters are active as a whole */
        i += b->n;
        ++*n_blocks;
    }
    return blocks;
}

int block_held(const struct block *b, size_t i)
{
    struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
    return imp_problem_get_variable(b->problem, b->first + i, &v) == IMP_OK && v.held;
}

/* Spectra are tables of their wavelengths, and lists (vertices) have no picture. */
int block_is_large(const struct block *b)
{
    return b->n > (b->info.wavelengths_nm || b->info.flags & IMP_PARAM_LIST ? 1000 : 12);
}

static void block_held_json(struct json *j, const struct block *b)
{
    int any = 0;
    for (size_t i = 0; i < b->n; i++) {
        if (!block_held(b, i)) continue;
        if (!any++) json_array(j, "held");
        json_integer(j, NULL, (int64_t)i);
    }
    if (any) json_end_array(j);
}

void block_json(struct json *j, const struct block *b)
{
    json_object(j, NULL);
    json_text(j, "name", b->info.name);
    json_text(j, "unit", b->info.unit);
    if (b->info.wavelengths_nm)
        json_numbers(j, "wavelengths_nm", b->info.count, b->info.wavelengths_nm);
    block_ties_json(j, b);
    block_held_json(j, b);
}

void block_ties_json(struct json *j, const struct block *b)
{
    if (b->tie.log) json_bool(j, "log", 1);
    if (!b->tie.factor && b->tie.n_members < 2) return;
    json_array(j, b->tie.factor ? "multiplies" : "same");
    for (size_t i = 0; i < b->tie.n_members; i++) json_text(j, NULL, b->tie.members[i]);
    json_end_array(j);
}

static int is_volume(const struct block *b)
{
    return (b->info.flags & IMP_PARAM_VOLUME) != 0;
}

/* `of`: "", or ".se" of a volume's standard errors. */
static char *block_path(const struct block *b, const char *folder, const char *of)
{
    char name[512];
    snprintf(name, sizeof name, "%s%s.%s", b->info.name, of,
             is_volume(b) ? "vol" : "exr");
    make_file_name(name);
    return join_path(folder, name);
}
int block_writable(const struct block *b, const char *folder, int errors)
{
    char *path = block_path(b, folder, ""), *se = block_path(b, folder, ".se");
    int rc = is_volume(b) ? overwrite_check(path, OUTPUT_VOL) : picture_writable(path, 1);
    if (!rc && is_volume(b) && errors) rc = overwrite_check(se, OUTPUT_VOL);
    free(path);
    free(se);
    return rc;
}

void block_remove(const struct block *b, const char *folder)
{
    char *path = block_path(b, folder, "");
    picture_remove(path);
    free(path);
}

/* A .vol file; standard errors have one of their own. */
static int volume_write(const struct block *b, const double *x, const double *se,
                        const char *folder, char **path)
{
    size_t param;
    enum imp_status st = imp_scene_find_param(cli.scene, b->info.name, &param);
    char *errors = se ? block_path(b, folder, ".se") : NULL;
    *path = block_path(b, folder, "");
    if (st == IMP_OK) st = imp_scene_write_volume(cli.scene, param, x + b->first, *path);
    if (st == IMP_OK) manifest_wrote(*path);
    if (st == IMP_OK && se)
        st = imp_scene_write_volume(cli.scene, param, se + b->first, errors);
    if (st == IMP_OK && se) manifest_wrote(errors);
    free(errors);
    return st == IMP_OK ? 0 : cli_fail(st, *path);
}

int block_write(const struct block *b, const double *x, const double *se,
                const char *folder, char **path)
{
    const struct imp_param_info *p = &b->info;
    const size_t last = p->n_dims > 0 ? p->dims[p->n_dims - 1] : 1;
    const size_t channels = p->n_dims == 3 && (last == 1 || last == 3) ? last
                            : p->n_dims == 2 && last == 3              ? 3
                                                                       : 1;
    const size_t width = p->n_dims == 3 || (p->n_dims == 2 && channels == 1)
                             ? p->dims[1]
                             : b->n / channels;
    const size_t height = b->n / channels / (width ? width : 1);
    const struct picture_options o = {.diverging = se != NULL};
    static const char *const channel_names[2][2] = {{"Y", "Y,se.Y"},
                                                    {"R,G,B", "R,G,B,se.R,se.G,se.B"}};
    const struct imp_run run = cli_run();
    imp_film *film = NULL;
    if (is_volume(b)) return volume_write(b, x, se, folder, path);
    *path = block_path(b, folder, "");
    const enum imp_status st =
        imp_film_create(cli.context, (int)width, (int)height,
                        channel_names[channels == 3][se != NULL], &film);
    if (st != IMP_OK) return cli_fail(st, *path);
    float *out = imp_film_mean(film);
    for (size_t i = 0; i < width * height; i++) {
        const size_t at = b->first + i * channels;
        for (size_t c = 0; c < channels; c++) *out++ = (float)x[at + c];
        for (size_t c = 0; c < channels && se; c++) *out++ = (float)se[at + c];
    }
    picture_stamp(film, &run);
    const int rc = picture_write(film, *path, &o);
    imp_film_destroy(film);
    return rc;
}
