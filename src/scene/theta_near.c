/* SPDX-License-Identifier: Apache-2.0
 *
 * Names of parameters nearest to one that does not exist, by edit distance. */
#include "theta_near.h"
#include "base/nearest.h"
#include "pose.h"
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

/* The nearest so far, next first. */
struct nearest {
    char name[3][256];
    size_t distance[3];
};

static void offer(struct nearest *n, const char *given, const char *name)
{
    const size_t d = distance_of(given, name);
    int k = 3;
    while (k > 0 && d < n->distance[k - 1]) k--;
    for (int j = 2; j > k; j--) {
        memcpy(n->name[j], n->name[j - 1], sizeof n->name[j]);
        n->distance[j] = n->distance[j - 1];
    }
    if (k == 3) return;
    snprintf(n->name[k], sizeof n->name[k], "%s", name);
    n->distance[k] = d;
}

/* Is a number of geometry meant? Its own object, or nearly its own kind. */
static bool is_meant(const char *given, const char *name)
{
    const char *dot = strrchr(given, '.'), *own = strrchr(name, '.');
    const size_t n = dot ? (size_t)(dot - given) : 0;
    if (!dot) return false;
    return (n == (size_t)(own - name) && strncasecmp(given, name, n) == 0) ||
           imp__edit_distance(dot + 1, own + 1) <= 2;
}

struct imp_near_names imp__theta_near(const struct imp_scene *scene, const char *name)
{
    struct imp_near_names out = {""};
    struct nearest near = {.distance = {SIZE_MAX, SIZE_MAX, SIZE_MAX}};
    struct imp_geometry_walk walk = {0};
    char given[LONGEST];
    snprintf(given, sizeof given, "%.*s", (int)strcspn(name, "*?["), name);
    const size_t length = strlen(given);
    if (length && given[length - 1] == '.') given[length - 1] = 0;
    if (!*given) return out;
    for (size_t i = 0; i < scene->n_params; i++) {
        const struct imp_pose *pose = imp__pose_of(scene, i);
        if (!pose) offer(&near, given, scene->params[i].info.name);
    }
    while (imp__geometry_next(scene, &walk))
        if (is_meant(given, walk.name)) offer(&near, given, walk.name);
    size_t used = 0;
    for (int k = 0; k < 3 && near.distance[k] < SIZE_MAX && used < sizeof out.text; k++)
        used += (size_t)snprintf(out.text + used, sizeof out.text - used, "%s%s",
                                 k ? ", " : "; the nearest are ", near.name[k]);
    return out;
}
