/* SPDX-License-Identifier: Apache-2.0
 *
 * heterogeneous: an extinction that varies in space, in the box of its volume. */
#include "coefficients.h"

const struct imp_medium_ops imp__heterogeneous = {.size = sizeof(struct imp_medium_ops),
                                                  .name = "heterogeneous",
                                                  .object_size =
                                                      sizeof(struct imp_coefficient_form),
                                                  .inputs = imp__coefficient_inputs,
                                                  .build = imp__coefficients_build,
                                                  .eval = imp__coefficients_eval,
                                                  .eval_d = imp__coefficients_eval_d,
                                                  .boxed = true};
