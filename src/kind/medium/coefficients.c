/* SPDX-License-Identifier: Apache-2.0
 *
 * Inputs, values and derivatives of extinction, scattering and emission, by either of the two
 * descriptions of a medium (coefficients.h). */
#include "coefficients.h"
#include "math/vec.h"

enum {
    SIGMA_T = IMP_COEFFICIENT_SIGMA_T,
    ALBEDO = IMP_COEFFICIENT_ALBEDO,
    SIGMA_S = IMP_COEFFICIENT_SIGMA_S,
    SIGMA_A = IMP_COEFFICIENT_SIGMA_A,
    SCALE = IMP_COEFFICIENT_SCALE,
    EMISSION = IMP_COEFFICIENT_EMISSION
};

#define OF_EXTINCTION                                                                    \
    (IMP_INPUT_EXTINCTION | IMP_INPUT_AFFINE | IMP_INPUT_VOLUME | IMP_INPUT_OPTIONAL)
const struct imp_input_desc imp__coefficient_inputs[] = {
    [SIGMA_T] = {.name = "sigma_t",
                 .role = IMP_UNBOUNDED,
                 .flags = OF_EXTINCTION,
                 .fallback = 1,
                 .unit = "1/length"},
    [ALBEDO] = {.name = "albedo",
                .role = IMP_REFLECTANCE,
                .flags = IMP_INPUT_VOLUME | IMP_INPUT_OPTIONAL,
                .fallback = 0.75,
                .hi = 1,
                .unit = "1"},
    [SIGMA_S] = {.name = "sigma_s",
                 .role = IMP_UNBOUNDED,
                 .flags = OF_EXTINCTION,
                 .unit = "1/length"},
    [SIGMA_A] = {.name = "sigma_a",
                 .role = IMP_UNBOUNDED,
                 .flags = OF_EXTINCTION,
                 .unit = "1/length"},
    [SCALE] = {.name = "scale",
               .role = IMP_UNBOUNDED,
               .flags = IMP_INPUT_EXTINCTION | IMP_INPUT_AFFINE | IMP_INPUT_SCALAR,
               .fallback = 1,
               .unit = "1"},
    [EMISSION] = {.name = "emission",
                  .role = IMP_EMISSION,
                  .flags = IMP_INPUT_VOLUME | IMP_INPUT_OPTIONAL,
                  .unit = "radiance"},
    [IMP_COEFFICIENTS] = {0}};

enum imp_status imp__coefficients_build(const struct imp_build *b, void *self,
                                        struct imp_medium *m)
{
    enum imp_status st = IMP_OK;
    struct imp_coefficient_form *form = self;
    bool sample_emitters, spectral;
    /* Mitsuba's options of its estimators: the mean is the same. */
    IMP_TRY(imp_build_bool(b, "sample_emitters", true, &sample_emitters));
    IMP_TRY(imp_build_bool(b, "has_spectral_extinction", true, &spectral));
    form->apart = imp_build_has(b, "sigma_s") || imp_build_has(b, "sigma_a");
    if (form->apart && (imp_build_has(b, "sigma_t") || imp_build_has(b, "albedo")))
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "has sigma_s or sigma_a together with sigma_t or albedo: "
                                "give the one pair or the other"));
    m->emits = imp_build_has(b, "emission");
out:
    return st;
}

void imp__coefficients_eval(const struct imp_medium *m, const imp_spec *in,
                            struct imp_coefficients *c)
{
    const struct imp_coefficient_form *form = m->self;
    const double scale = in[SCALE][0];
    if (form->apart) {
        c->scattering = in[SIGMA_S] * scale;
        c->extinction = c->scattering + in[SIGMA_A] * scale;
    } else {
        c->extinction = in[SIGMA_T] * scale;
        c->scattering = c->extinction * in[ALBEDO];
    }
    c->emission = in[EMISSION];
}

void imp__coefficients_eval_d(const struct imp_medium *m, const imp_spec *in,
                              struct imp_coefficients *dc)
{
    const struct imp_coefficient_form *form = m->self;
    const imp_spec scale = imp__spec(in[SCALE][0]), none = {0};
    for (int j = 0; j < IMP_COEFFICIENTS; j++)
        dc[j] = (struct imp_coefficients){none, none, none};
    if (form->apart) {
        dc[SIGMA_S].extinction = dc[SIGMA_S].scattering = dc[SIGMA_A].extinction = scale;
        dc[SCALE].extinction = in[SIGMA_S] + in[SIGMA_A];
        dc[SCALE].scattering = in[SIGMA_S];
    } else {
        dc[SIGMA_T].extinction = scale;
        dc[SIGMA_T].scattering = scale * in[ALBEDO];
        dc[ALBEDO].scattering = scale * in[SIGMA_T];
        dc[SCALE].extinction = in[SIGMA_T];
        dc[SCALE].scattering = in[SIGMA_T] * in[ALBEDO];
    }
    dc[EMISSION].emission = imp__spec(1);
}
