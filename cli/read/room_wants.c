/* SPDX-License-Identifier: Apache-2.0
 *
 * --want: what a grid shall have. */
#include "room_wants.h"
#include "shared/command.h"
#include "shared/sensor_names.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct arg_list wants;

const struct arg_option options_wants[] = {
    {ARG_LIST, 'w', "want", "GRID.WHAT=V",
     "of a grid (an irradiancemeter, by name or number): average, minimum or uniformity "
     "at least V, maximum or ugr at most V",
     &wants, 0, 0, NULL},
    {0}};

const char *const want_words[] = {"average",    "minimum", "maximum",
                                  "uniformity", "ugr",     NULL};

static struct imp_sensor_info sensor_of(const struct imp_design_want *w)
{
    struct imp_sensor_info info = {.size = sizeof info};
    if (imp_scene_get_sensor(cli.scene, w->sensor, &info) != IMP_OK)
        info.name = info.unit = "";
    return info;
}
const char *want_sensor(const struct imp_design_want *w) { return sensor_of(w).name; }
const char *want_unit(const struct imp_design_want *w)
{
    const bool bare = w->of == IMP_WANT_UNIFORMITY || w->of == IMP_WANT_UGR;
    return bare ? "" : sensor_of(w).unit;
}
bool wants_given(void) { return wants.n > 0; }

/* "GRID.WHAT=V" */
static int want_read(const char *text, struct imp_design_want *out)
{
    char *copy = cli_strdup(text), *equal = strrchr(copy, '='), *dot, *end = NULL;
    int rc = 0, of = -1;
    if (equal) *equal = 0;
    dot = strrchr(copy, '.');
    const double value = equal ? strtod(equal + 1, &end) : NAN;
    if (dot) {
        *dot = 0;
        for (int k = 0; want_words[k]; k++)
            if (!strcmp(dot + 1, want_words[k])) of = k;
    }
    *out = (struct imp_design_want)IMP_DESIGN_WANT_INIT;
    if (of >= 0 && equal && end > equal + 1 && *end && isfinite(value))
        rc = cli_error(
            EXIT_USAGE,
            "--want %s: '%s' behind the number: V is in the grid's unit, which is "
            "not written",
            text, end);
    else if (of < 0 || !equal || end == equal + 1 || !isfinite(value))
        rc = cli_error(EXIT_USAGE,
                       "--want %s: expected GRID.WHAT=V, WHAT one of average, minimum, "
                       "maximum, uniformity, ugr",
                       text);
    else if ((out->sensor = sensor_find(copy)) < 0)
        rc = cli_error(EXIT_USAGE, "--want %s: the scene has no sensor '%s'", text, copy);
    out->of = (enum imp_design_want_of)(of < 0 ? 0 : of);
    out->value = value;
    free(copy);
    return rc;
}

/* Without blanks around it. */
static char *trimmed(char *text)
{
    text += strspn(text, " \t\n");
    size_t n = strlen(text);
    while (n > 0 && strchr(" \t\n", text[n - 1])) text[--n] = 0;
    return text;
}

int wants_read(struct imp_design_want *want, size_t *n)
{
    int rc = 0;
    for (size_t k = 0; k < wants.n && !rc; k++) {
        char *copy = cli_strdup(wants.item[k]), *save = NULL;
        for (char *w = strtok_r(copy, ",", &save); w && !rc;
             w = strtok_r(NULL, ",", &save)) {
            w = trimmed(w);
            rc = *n < WANTS_MAX ? want_read(w, &want[(*n)++])
                                : cli_error(EXIT_USAGE, "more than %d wants", WANTS_MAX);
        }
        free(copy);
    }
    return rc;
}
