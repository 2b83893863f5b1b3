/* SPDX-License-Identifier: Apache-2.0
 *
 * Collisions in lanes: a phase function times an albedo, as the kernel of a vertex whose frame has the
 * axes of the world (scene/in_medium.h, of points alone). */
#include "in_media.h"
#include "scene/sealed.h"

static const struct imp_phase *phase_of(const struct imp_bsdf *b)
{
    const struct imp_medium *m = b->self;
    return m->phase;
}

static imp_wide_truth sample(const struct imp_bsdf *b, const struct imp_wide_color *in,
                             const imp_wide3 *wo, const imp_wide u[3], imp_wide3 *wi,
                             imp_wide_lobe *lobe)
{
    (void)in, (void)lobe;
    *wi = imp__phase_lanes(phase_of(b))->sample(phase_of(b), wo, u);
    return ~(imp_wide_truth){0};
}

/* in[0]: the albedo */
static imp_wide pdf_eval(const struct imp_bsdf *b, const struct imp_wide_color *in,
                         const imp_wide3 *wo, const imp_wide3 *wi,
                         const imp_wide_lobe *lobe, int colors, struct imp_wide_color *f)
{
    (void)lobe;
    const imp_wide p = imp__phase_lanes(phase_of(b))->value(phase_of(b), wo, wi);
    for (int c = 0; c < colors; c++) f->c[c] = p * in[0].c[c];
    return p;
}

bool imp__collision_bin(const struct imp_tracer *tracer, int medium, struct imp_bin *bin)
{
    static const struct imp_bsdf_lanes kernel = {.sample = sample, .pdf_eval = pdf_eval};
    const struct imp_medium *m = tracer->scene->media[medium];
    const bool tree = tracer->integrator->light_tree && tracer->scene->light_tree;
    imp_spec in[IMP_INPUTS_MAX], albedo;
    struct imp_coefficients c;
    if (tree || !imp__phase_lanes(m->phase)) return false;
    for (int j = 0; j < m->n_in; j++) in[j] = m->input[j]->value;
    m->ops->eval(m, in, &c);
    for (int k = 0; k < 4; k++)
        albedo[k] = c.extinction[k] > 0 ? c.scattering[k] / c.extinction[k] : 0;
    *bin = (struct imp_bin){.medium = medium,
                            .sealed = imp__is_sealed(tracer->scene, m),
                            .bsdf = m->scatterer,
                            .kernel = &kernel,
                            .plain = true};
    bin->in[0] = imp__wide_color(albedo);
    return true;
}
