/* SPDX-License-Identifier: Apache-2.0
 *
 * homogeneous: the same extinction everywhere. Its albedo and emission may vary. */
#include "coefficients.h"

static enum imp_status build(const struct imp_build *b, void *self, struct imp_medium *m)
{
    for (int j = 0; j < m->n_own; j++)
        if (imp__coefficient_inputs[j].flags & IMP_INPUT_EXTINCTION &&
            m->input[j]->texture)
            return imp_build_error(b, imp__coefficient_inputs[j].name, IMP_E_SCENE,
                                   "'%s' varies in space: that is a medium of type "
                                   "heterogeneous",
                                   imp__coefficient_inputs[j].name);
    return imp__coefficients_build(b, self, m);
}

const struct imp_medium_ops imp__homogeneous = {.size = sizeof(struct imp_medium_ops),
                                                .name = "homogeneous",
                                                .object_size =
                                                    sizeof(struct imp_coefficient_form),
                                                .inputs = imp__coefficient_inputs,
                                                .build = build,
                                                .eval = imp__coefficients_eval,
                                                .eval_d = imp__coefficients_eval_d};
