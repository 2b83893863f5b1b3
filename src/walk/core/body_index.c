/* SPDX-License-Identifier: Apache-2.0
 *
 * The index of refraction at the boundary of a body of graded index: that of the body there,
 * over that of what is around it. */
#include "bend/inside.h"
#include "step.h"

void imp__body_inputs(const struct imp_bsdf *b, const struct imp_shape *shape,
                      const struct imp_texcoord *at, imp_spec *in)
{
    const struct imp_body *m = shape->body;
    const int j = b->index_input;
    if (j >= 0) in[j] = imp__spec(imp__graded_index(m->graded, &at->p) / m->outside);
}
