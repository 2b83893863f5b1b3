/* SPDX-License-Identifier: Apache-2.0
 *
 * The normal of a bump map, and its slopes. */
#include "input_parts.h"
#include "kind/shape/shape.h"
#include "math/vec.h"

struct imp__bump imp__bump_at(const struct imp_input *input,
                              const struct imp_texcoord *at)
{
    struct imp_texcoord plain = *at;
    struct imp_surface made;
    const struct imp_surface *x = at->surface;
    imp_spec slope[2];
    int prim;
    struct imp__bump b = {.normal = {0, 0, 1, 0}};
    plain.carried = NULL;
    if (!at->shape || !input->texture->ops->slope(input->texture, &plain, true, slope))
        return b;
    if (!x) {
        at->shape->ops->place(at->shape, at->uv, &made, &prim);
        x = &made;
    }
    if (imp_unlikely(at->shape->placed != NULL)) {
        made = *x;
        imp__surface_move(&made, &at->shape->placed[0], &at->shape->placed[1]);
        x = &made;
    }
    const double scale = input->value[0];
    const imp_v3 u = imp__v3(imp__dot(x->s, x->dp_du), imp__dot(x->t, x->dp_du),
                             scale * slope[0][0]),
                 v = imp__v3(imp__dot(x->s, x->dp_dv), imp__dot(x->t, x->dp_dv),
                             scale * slope[1][0]);
    const imp_v3 n = imp__cross(u, v);
    const imp_v3 world = x->s * n[0] + x->t * n[1] + x->n * n[2];
    const double side = imp__dot(world, x->ng) < 0 ? -1 : 1;
    b.raised = true;
    b.normal = n * side;
    b.d_uv[0] = imp__v3(-v[1], v[0], 0) * (side * scale);
    b.d_uv[1] = imp__v3(u[1], -u[0], 0) * (side * scale);
    return b;
}
