/* SPDX-License-Identifier: Apache-2.0
 *
 * Maps of the best candidate: information of each pixel on each number, and its share in the
 * criterion. */
#include "plan_maps.h"

#include "shared/picture_files.h"

#include <stdlib.h>
#include <string.h>

enum { MAPS_MAX = 64 };

/* The file of number i; from n on that of the criterion. */
static char *map_path(const char *prefix, const struct plan_numbers *p, size_t i)
{
    char number[600] = "criterion", *path = cli_alloc(strlen(prefix) + 700, 1);
    if (i < p->n) {
        plan_number_name(p, i, number, sizeof number);
        make_file_name(number);
    }
    snprintf(path, strlen(prefix) + 700, "%s-%s.exr", prefix, number);
    return path;
}

int plan_map_writable(const char *prefix, const struct plan_numbers *p)
{
    if (p->n > MAPS_MAX)
        return cli_error(EXIT_USAGE, "--map: %zu numbers are active; maps are made of %d",
                         p->n, MAPS_MAX);
    int rc = 0;
    for (size_t i = 0; i <= p->n && !rc; i++) {
        char *path = map_path(prefix, p, i);
        rc = picture_writable(path, 1);
        free(path);
    }
    return rc;
}

int plan_map_write(const char *prefix, imp_problem *problem, const struct plan_answer *a)
{
    const struct plan_numbers *p = a->numbers;
    const struct imp_plan_row *best = a->result->rows;
    const struct picture_options po = {.diverging = 1};
    imp_film **films = cli_alloc(p->n + 1, sizeof *films);
    struct imp_run run = *a->run;
    int rc = 0;
    const enum imp_status st = imp_plan_map(problem, &a->candidates->c[best->candidate],
                                            a->options, &run, best->pull, films);
    if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    for (size_t i = 0; i <= p->n && !rc; i++) {
        char *path = map_path(prefix, p, i);
        picture_stamp(films[i], &run);
        rc = picture_write(films[i], path, &po);
        if (!rc) cli_say("importon: %s", path);
        free(path);
    }
    for (size_t i = 0; i <= p->n && st == IMP_OK; i++) imp_film_destroy(films[i]);
    free(films);
    return rc;
}
