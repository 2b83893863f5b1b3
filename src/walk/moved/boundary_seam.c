/* SPDX-License-Identifier: Apache-2.0
 *
 * Seams of lights (boundary.h). What a light emits is glued to it, and where it passes through another
 * surface a part of it appears or disappears: on the line from a vertex x to a seam of the light
 * the light's point is the edge's own, and x does not count:
 *
 *     dI = int dl dw sin(phi) f W(x) Le m.(V - V_light),
 *
 * with the side of the light's half of the seam that is seen. */
#include "boundary_parts.h"

int imp__seam_side(const struct imp__edge_draw *d, const struct imp_walk *walk)
{
    const struct imp_vertex *v = walk->first;
    if (!d->edge || !d->edge->seam || walk->dropped || !v ||
        v->d.scatterer == IMP_AT_SKY || v->d.scatterer == IMP_IN_MEDIUM ||
        imp__is_zero_used(v->e, d->waves))
        return -1;
    for (int k = 0; k < 4; k += 2) {
        const struct imp__edge_face *f = &d->edges->face[d->edge->first + (size_t)k];
        if (f->shape == v->d.shape && f->prim == v->d.located.prim && f->place == 0)
            return k / 2;
    }
    return -1;
}

void imp__seam_emission(struct imp__edge_draw *d, const struct imp_hit *hit,
                        const struct imp_surface *at, const struct imp_walk *walk,
                        imp_v3 m, imp_v3 w, imp_spec times)
{
    const int side = imp__seam_side(d, walk);
    struct imp__edge_light light = {.w = w, .behind = 1, .n_ends = 2};
    if (side < 0) return;
    light.light = walk->first->e * times;
    imp__edge_ends(d, m, light.end);
    /* m.V less m.V_light: what the other surface's velocity counts, against the light's. */
    light.end[side].bar.v = -light.end[1 - side].bar.v;
    imp__edge_reach(d, hit, at, &light);
}
