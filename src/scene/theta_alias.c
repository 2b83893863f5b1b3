/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters by the paths of Mitsuba's traverse(): from an object down through the slots of
 * what is nested in it, whatever ids those objects have. Here an object with an id is called
 * by it, so each step is one in the tree that the scene was made from. */
#include "theta_alias.h"
#include <stdio.h>
#include <string.h>

#define PATH_MAX_CHARS 512
#define PATH_MAX_STEPS 24

/* `rest` behind "slot.", or NULL. */
static const char *behind(const char *rest, const char *slot)
{
    const size_t n = strlen(slot);
    return strncmp(rest, slot, n) == 0 && rest[n] == '.' ? rest + n + 1 : NULL;
}

/* "stem_0." to "stem_9.": the child of that number. */
static const char *numbered(const char *rest, const char *stem, int k)
{
    char slot[32];
    snprintf(slot, sizeof slot, "%s_%d", stem, k);
    return behind(rest, slot);
}

/* Does `rest` begin with a slot in which Mitsuba has child c, number k of its tag? What is
 * behind it, or NULL; *own: the slot's name here, if it differs. */
static const char *step(const struct imp_node *node, const struct imp_child *c, int k,
                        const char *rest, const char **own)
{
    const char *tag = c->node->tag, *tail = NULL;
    *own = NULL;
    if (strcmp(tag, "bsdf") == 0) {
        if (strcmp(node->tag, "shape") == 0) return behind(rest, "bsdf");
        if (k == 0) tail = behind(rest, "nested_bsdf");
        if (!tail) tail = numbered(rest, "brdf", k);
        return tail ? tail : numbered(rest, "bsdf", k);
    }
    if (strcmp(tag, "phase") == 0) {
        *own = "phase";
        if ((tail = behind(rest, "phase_function")) || (tail = behind(rest, "phase")))
            return tail;
        *own = NULL;
        return numbered(rest, "phase", k);
    }
    if (strcmp(tag, "medium") == 0) {
        char slot[64];
        *own = c->name ? c->name : "medium";
        snprintf(slot, sizeof slot, "%.50s_medium", c->name ? c->name : "");
        if ((tail = behind(rest, slot))) return tail;
        return behind(rest, *own);
    }
    if (strcmp(tag, "emitter") == 0 || strcmp(tag, "sensor") == 0)
        return behind(rest, tag);
    if (strcmp(node->type, "bumpmap") == 0 && (tail = behind(rest, "nested_texture")))
        return tail;
    return c->name ? behind(rest, c->name) : NULL;
}

/* The parameter `rest` of an object, whose values may be a level deeper there. */
static bool param_of(const struct imp_scene *scene, const char *object, const char *rest,
                     size_t *index)
{
    char name[PATH_MAX_CHARS];
    const size_t n = (size_t)snprintf(name, sizeof name, "%s.%s", object, rest);
    const size_t twice = strlen(".value.value"), once = strlen(".value");
    if (n >= sizeof name) return false;
    if (imp__theta_exact(scene, name, index)) return true;
    if (n <= twice || strcmp(name + n - twice, ".value.value") != 0) return false;
    name[n - once] = 0;
    return imp__theta_exact(scene, name, index);
}

static bool follow(const struct imp_scene *scene, const struct imp_node *node,
                   const char *object, const char *rest, int steps, size_t *index)
{
    static const char *const counted[] = {"bsdf", "phase"};
    int k[2] = {0, 0};
    if (param_of(scene, object, rest, index)) return true;
    if (steps == 0) return false;
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        char deeper[PATH_MAX_CHARS];
        const char *own, *tail;
        int number = 0;
        if (!c->node) continue;
        for (int t = 0; t < 2; t++)
            if (strcmp(c->node->tag, counted[t]) == 0) number = k[t]++;
        if (!(tail = step(node, c, number, rest, &own))) continue;
        const int slot = (int)(tail - rest) - 1; /* its characters */
        if (c->node->id) snprintf(deeper, sizeof deeper, "%s", c->node->id);
        else if (own) snprintf(deeper, sizeof deeper, "%s.%s", object, own);
        else snprintf(deeper, sizeof deeper, "%s.%.*s", object, slot, rest);
        if (strlen(deeper) + 1 < sizeof deeper &&
            follow(scene, c->node, deeper, tail, steps - 1, index))
            return true;
    }
    return false;
}

/* From the object that the path begins with, at any depth. */
static bool begin(const struct imp_scene *scene, const struct imp_node *node,
                  const char *path, int steps, size_t *index)
{
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        if (!c->node || c->ref) continue;
        const char *name = c->node->id                      ? c->node->id
                           : node == scene->root && c->name ? c->name
                                                            : NULL;
        const char *rest = name ? behind(path, name) : NULL;
        if (rest && follow(scene, c->node, name, rest, PATH_MAX_STEPS, index))
            return true;
        if (steps > 0 && begin(scene, c->node, path, steps - 1, index)) return true;
    }
    return false;
}

bool imp__theta_alias(const struct imp_scene *scene, const char *path, size_t *index)
{
    if (!scene->root || strlen(path) >= PATH_MAX_CHARS) return false;
    for (const char *tail = path; tail;
         tail = strchr(tail, '.') ? strchr(tail, '.') + 1 : NULL)
        if (begin(scene, scene->root, tail, PATH_MAX_STEPS, index)) return true;
    return false;
}
