/* SPDX-License-Identifier: Apache-2.0
 *
 * Fold: the radiance of a walk from the values of its vertices, the last first. */
#include "walk.h"

imp_spec imp__walk_fold(struct imp_walk *walk)
{
    imp_spec L = {0};
    const struct imp_entry *entry = walk->entry ? walk->entry + walk->n : NULL;
    for (struct imp_vertex *v = walk->last; v; v = v->prev) {
        imp__vertex_fetch(v->prev, IMP_VERTEX_VALUES);
        v->beyond = L;
        if (imp_likely(!entry)) {
            L = v->e + v->w * L + v->b;
        } else {
            entry--;
            L = (entry->e * v->e + entry->b * v->b) + v->w * L + entry->joints;
        }
        for (struct imp_side *s = v->side; s; s = s->next)
            L += s->walk.L = imp__walk_fold(&s->walk);
    }
    return L;
}
