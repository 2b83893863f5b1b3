/* SPDX-License-Identifier: Apache-2.0
 *
 * How scenes describe a medium: by extinction and albedo, or by scattering and
 * absorption, times one scale,
 *
 *     sigma_t, albedo:    extinction = scale sigma_t,  scattering = extinction albedo
 *     sigma_s, sigma_a:   extinction = scale (sigma_s + sigma_a),
 *                         scattering = scale sigma_s
 *
 * and by the radiance that it emits. */
#ifndef IMP_KIND_MEDIUM_COEFFICIENTS_H
#define IMP_KIND_MEDIUM_COEFFICIENTS_H

#include "kind/build.h"

enum {
    IMP_COEFFICIENT_SIGMA_T,
    IMP_COEFFICIENT_ALBEDO,
    IMP_COEFFICIENT_SIGMA_S,
    IMP_COEFFICIENT_SIGMA_A,
    IMP_COEFFICIENT_SCALE,
    IMP_COEFFICIENT_EMISSION,
    IMP_COEFFICIENTS
};
extern const struct imp_input_desc imp__coefficient_inputs[];

struct imp_coefficient_form {
    bool apart; /* sigma_s and sigma_a */
};

enum imp_status imp__coefficients_build(const struct imp_build *b, void *self,
                                        struct imp_medium *m);
void imp__coefficients_eval(const struct imp_medium *m, const imp_spec *in,
                            struct imp_coefficients *c);
void imp__coefficients_eval_d(const struct imp_medium *m, const imp_spec *in,
                              struct imp_coefficients *dc);

#endif
