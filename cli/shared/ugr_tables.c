/* SPDX-License-Identifier: Apache-2.0
 *
 * Tables of glare ratings as text and JSON. */
#include "ugr_tables.h"
#include "command.h"
#include <importon/rooms.h>

#include <string.h>

struct glare_table_wanted glare_table_wanted = {0, 0.25, 0};

const struct arg_option options_glare_table[] = {
    {ARG_FLAG, 0, "ugr-table", NULL,
     "the glare ratings (CIE 117, CIE 190) of each luminaire in standard rooms",
     &glare_table_wanted.on, 0, 0, NULL},
    {ARG_NUMBER, 0, "spacing", "S",
     "of its luminaires in parts of their height above the eyes (0.25)",
     &glare_table_wanted.spacing, 0.01, 2, NULL},
    {ARG_NUMBER, 0, "flux", "LM", "of a luminaire in it, in place of the scene's",
     &glare_table_wanted.flux, 1e-6, 1e12, NULL},
    {0}};

int glare_table_check(void)
{
    if (glare_table_wanted.on && imp_scene_n_luminaires(cli.scene) == 0)
        return cli_error(EXIT_USAGE, "%s: there is no luminaire (emitter ies) in it",
                         cli.scene_path);
    if (glare_table_wanted.on || (!cli_typed("spacing") && !cli_typed("flux"))) return 0;
    return cli_error(EXIT_USAGE,
                     "--spacing and --flux are of glare ratings: they go with "
                     "--ugr-table");
}

static void text_print(const char *name, const struct imp_glare_table *t)
{
    static const char *const what[] = {"ceiling", "walls", "floor"};
    printf("\n%s: UGR with %.5g lm each, %g heights apart\n", name, t->flux, t->spacing);
    printf("%-12s%-32s%s\n", "", "seen across the lamps", "seen along the lamps");
    for (int k = 0; k < 3; k++) {
        printf("%-10s", what[k]);
        for (int turned = 0; turned < 2; turned++) {
            for (int s = 0; s < IMP_GLARE_SETS; s++)
                printf("%6.1f", t->reflectance[s][k]);
            printf(turned ? "\n" : "  ");
        }
    }
    for (int k = 0; k < IMP_GLARE_ROOMS; k++) {
        char room[40];
        snprintf(room, sizeof room, "%gH x %gH", t->room[k][0], t->room[k][1]);
        printf("%-10s", room);
        for (int turned = 0; turned < 2; turned++) {
            for (int s = 0; s < IMP_GLARE_SETS; s++)
                printf("%6.1f", t->ugr[k][turned][s]);
            printf(turned ? "\n" : "  ");
        }
    }
}

static void json_print(struct json *j, const char *name, const struct imp_glare_table *t)
{
    static const char *const seen[] = {"across", "along"};
    json_object(j, NULL);
    json_text(j, "luminaire", name);
    json_number(j, "flux", t->flux);
    json_number(j, "spacing", t->spacing);
    json_array(j, "rooms");
    for (int k = 0; k < IMP_GLARE_ROOMS; k++) json_numbers(j, NULL, 2, t->room[k]);
    json_end_array(j);
    json_array(j, "reflectances");
    for (int s = 0; s < IMP_GLARE_SETS; s++) json_numbers(j, NULL, 3, t->reflectance[s]);
    json_end_array(j);
    for (int turned = 0; turned < 2; turned++) {
        json_array(j, seen[turned]);
        for (int k = 0; k < IMP_GLARE_ROOMS; k++)
            json_numbers(j, NULL, IMP_GLARE_SETS, t->ugr[k][turned]);
        json_end_array(j);
    }
    json_end_object(j);
}

int glare_tables_print(struct json *j)
{
    const struct imp_glare_table_options o = {.size = sizeof o,
                                              .spacing = glare_table_wanted.spacing,
                                              .flux = glare_table_wanted.flux};
    const int n = imp_scene_n_luminaires(cli.scene);
    struct imp_glare_table last = {.size = 0};
    if (j) json_array(j, "glare_tables");
    for (int i = 0; i < n; i++) {
        struct imp_luminaire_info l = {.size = sizeof l};
        struct imp_glare_table t = {.size = sizeof t};
        enum imp_status st = imp_scene_get_luminaire(cli.scene, i, &l);
        if (st == IMP_OK) st = imp_luminaire_glare_table(cli.scene, i, &o, &t);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
        /* Rows of the same luminaires have one table. */
        if (memcmp(&t, &last, sizeof t) == 0) continue;
        last = t;
        if (j) json_print(j, l.name, &t);
        else text_print(l.name, &t);
    }
    if (j) json_end_array(j);
    return 0;
}
