/* SPDX-License-Identifier: Apache-2.0 */
#include "walk_items.h"

#include <stdlib.h>

char *walks_json(const struct imp_run *run, size_t n, const int (*pixel)[2], int count,
                 int *rc)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    char *text = NULL;
    size_t length = 0;
    enum imp_status st = imp_scene_get_info(cli.scene, &scene);
    FILE *f = st == IMP_OK ? open_memstream(&text, &length) : NULL;
    if (f) {
        struct json j = {f, 0};
        json_object(&j, NULL);
        json_array(&j, "bounds");
        json_numbers(&j, NULL, 3, scene.bounds_min);
        json_numbers(&j, NULL, 3, scene.bounds_max);
        json_end_array(&j);
        fputs(",\"walks\":[", f);
        for (size_t i = 0; i < n * (size_t)count && st == IMP_OK; i++) {
            const int *at = pixel[i / (size_t)count];
            char *walk = NULL;
            st = imp_walk_describe(cli.scene, run, at[0], at[1],
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
