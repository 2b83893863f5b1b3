/* SPDX-License-Identifier: Apache-2.0
 *
 * Names of parameters nearest to one that does not exist, by edit distance. */
#include "theta_near.h"
#include "base/nearest.h"
#include <stdio.h>
#include <string.h>

#define LONGEST 128

/* The beginning of a name with as many parts as `as`, which points separate. */
static void beginning(const char *name, const char *as, char out[LONGEST])
{
    size_t n = strcspn(name, ".");
    for (; *as; as++)
        if (*as == '.' && name[n]) n += 1 + strcspn(name + n + 1, ".");
    snprintf(out, LONGEST, "%.*s", (int)n, name);
}

/* How far a parameter is from what was written, whose later parts may be left out; its own
 * object in other letters is next. */
static size_t distance_of(const char *given, const char *name)
{
    char begins[LONGEST];
    beginning(name, given, begins);
    if (strcasecmp(given, begins) == 0) return 0;
    const size_t whole = imp__edit_distance(given, name),
                 part = imp__edit_distance(given, begins);
    const size_t least = imp_min(whole, part);
    return least < SIZE_MAX ? 1 + least : SIZE_MAX; /* too long for a distance */
}

struct imp_near_names imp__theta_near(const struct imp_scene *scene, const char *name)
{
    struct imp_near_names out = {""};
    const char *near[3] = {0};
    size_t distance[3] = {SIZE_MAX, SIZE_MAX, SIZE_MAX};
    char given[LONGEST];
    snprintf(given, sizeof given, "%.*s", (int)strcspn(name, "*?["), name);
    const size_t length = strlen(given);
    if (length && given[length - 1] == '.') given[length - 1] = 0;
    if (!*given) return out;
    for (size_t i = 0; i < scene->n_params; i++) {
        const char *candidate = scene->params[i].info.name;
        size_t d = distance_of(given, candidate);
        for (int k = 0; k < 3; k++)
            if (d < distance[k]) {
                const size_t old = distance[k];
                const char *other = near[k];
                distance[k] = d, near[k] = candidate;
                d = old, candidate = other;
            }
    }
    size_t used = 0;
    for (int k = 0; k < 3 && near[k] && used < sizeof out.text; k++)
        used += (size_t)snprintf(out.text + used, sizeof out.text - used, "%s%s",
                                 k ? ", " : "; the nearest are ", near[k]);
    return out;
}
