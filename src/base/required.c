/* SPDX-License-Identifier: Apache-2.0
 *
 * The error of a property or child that a plugin requires and a node lacks; a name near it that
 * nobody has read is suggested. */
#include "required.h"
#include "nearest.h"

enum imp_status imp__node_missing(imp_context *ctx, const struct imp_node *node,
                                  const char *name)
{
    struct imp_nearest near = imp__nearest(name);
    const struct imp_loc *at = NULL;
    char where[256];
    for (size_t i = 0; i < node->n_props; i++) {
        const struct imp_prop *p = &node->props[i];
        const char *before = near.best;
        if (!p->used) imp__nearest_try(&near, p->name);
        if (near.best != before) at = &p->loc;
    }
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        const char *before = near.best;
        if (!c->used && c->name) imp__nearest_try(&near, c->name);
        if (near.best != before) at = &c->loc;
    }
    if (!at)
        return imp__node_error(ctx, node, IMP_E_SCENE, "property '%s' is missing", name);
    return imp__node_error(ctx, node, IMP_E_SCENE,
                           "property '%s' is missing; did you mean it by '%.50s' (%s)?",
                           name, near.best, imp__loc_text(*at, where, sizeof where));
}
