/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes of old versions: camelCase names become snake_case, and the four numbers of a
 * texture's placement become the transform to_uv (docs/scene-format.md 1.3). */
#include "xml.h"
#include <string.h>

static bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
static bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }

const char *imp__upgrade_name(struct imp_arena *scratch, const char *type,
                              const char *name)
{
    char *to = imp__arena_array(scratch, strlen(name) + 1, 2);
    if (!to) return NULL;
    size_t n = 0;
    for (const char *s = name; *s; s++) {
        if (s > name && is_lower(s[-1]) && is_upper(*s)) to[n++] = '_';
        to[n++] = is_upper(*s) ? (char)(*s - 'A' + 'a') : *s;
    }
    if (strcmp(type, "diffuse") == 0 && strcmp(to, "diffuse_reflectance") == 0)
        return "reflectance";
    return to;
}

enum imp_status imp__upgrade_texture(struct imp_tree *tree, struct imp_node *node)
{
    static const char *const names[] = {"uoffset", "voffset", "uscale", "vscale"};
    double value[4] = {0, 0, 1, 1};
    struct imp_loc loc = {0};
    bool any = false;
    for (int i = 0; i < 4; i++) {
        struct imp_prop *p = imp__node_prop(node, names[i]);
        if (!p) continue;
        if (p->type != IMP_PROP_FLOAT && p->type != IMP_PROP_INTEGER)
            return imp__prop_error(tree->ctx, node, p, IMP_E_SCENE, "%s must be a float",
                                   names[i]);
        value[i] = p->type == IMP_PROP_FLOAT ? p->number[0] : (double)p->integer;
        if (!any) loc = p->loc;
        any = true;
        memmove(p, p + 1, (size_t)(node->props + node->n_props - (p + 1)) * sizeof *p);
        node->n_props--;
    }
    if (!any) return IMP_OK;
    struct imp_prop *p;
    const enum imp_status st =
        imp__tree_prop(tree, node, "to_uv", IMP_PROP_TRANSFORM, loc, &p);
    if (st != IMP_OK) return st;
    const struct imp_mat4 scale = imp__scale(imp__v3(value[2], value[3], 1)),
                          move = imp__translate(imp__v3(value[0], value[1], 0)),
                          both = imp__mat4_multiply(&scale, &move);
    memcpy(p->number, both.m, sizeof both.m);
    return IMP_OK;
}
