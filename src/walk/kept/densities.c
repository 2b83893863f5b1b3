/* SPDX-License-Identifier: Apache-2.0
 *
 * What the densities that recorded walks were drawn with depend on: inputs of materials, by
 * trial, and extinctions of media. */
#include "kind_trials.h"
#include "store.h"
#include "walk/core/step.h"

_Static_assert(IMP_INPUTS_MAX <= 64, "masks of inputs have 64 bits");

/* Does the density differ where input j does? Found by trying: kinds do not declare it. */
static bool depends(const struct imp_bsdf *b, int j, uint64_t wanted)
{
    const struct imp_input_desc *own = imp__trial_desc(b, j);
    imp_spec in[IMP_INPUTS_MAX];
    if (!own || imp__trial_derives(b)) return true;
    for (uint64_t k = 0; k < IMP_TRIALS; k++) {
        const uint64_t state = 0x9e3779b97f4a7c15u * (k + 1);
        struct imp_dirs dirs = imp__trial_dirs(k);
        dirs.derivative = wanted;
        for (int i = 0; i < b->n_in; i++)
            in[i] = imp__trial_input(imp__trial_desc(b, i), state + 64 * (uint64_t)i);
        const int lobes = imp__trial_lobes(b);
        for (int lobe = IMP_SMOOTH; lobe < lobes; lobe++) {
            dirs.lobe = lobe;
            const imp_spec before = in[j];
            const double p = b->ops->pdf(b, in, &dirs);
            in[j] = imp__trial_input(own, state + 7777 + (uint64_t)j);
            const double q = b->ops->pdf(b, in, &dirs);
            in[j] = before;
            if (p != q) return true;
        }
    }
    return false;
}

enum imp_status imp__densities_create(const struct imp_scene *scene,
                                      const struct imp_walk_integrator *integrator,
                                      const uint8_t *chosen, double survival,
                                      struct imp_densities *out)
{
    struct imp_densities d = {
        .scene = scene, .integrator = integrator, .survival = survival};
    const size_t n = (size_t)scene->n_bsdfs + 1;
    d.wanted = imp__alloc(scene->ctx, n, sizeof *d.wanted);
    d.inputs = imp__alloc(scene->ctx, n, sizeof *d.inputs);
    d.moved = imp__alloc(scene->ctx, n, sizeof *d.moved);
    if (!d.wanted || !d.inputs || !d.moved) {
        imp__densities_destroy(scene->ctx, &d);
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for recorded walks");
    }
    for (int b = 0; b < scene->n_bsdfs; b++) {
        const struct imp_bsdf *bsdf = scene->bsdfs[b];
        d.wanted[b] = imp__inputs_depend(bsdf, chosen);
        const bool medium = bsdf->ops->inputs == NULL && bsdf->n_in > 0;
        for (int j = 0; j < bsdf->n_in; j++)
            if (medium || bsdf->shaped || depends(bsdf, j, d.wanted[b]))
                d.inputs[b] |= UINT64_C(1) << j;
    }
    *out = d;
    return IMP_OK;
}

void imp__densities_destroy(imp_context *ctx, struct imp_densities *d)
{
    imp__release(ctx, d->wanted);
    imp__release(ctx, d->inputs);
    imp__release(ctx, d->moved);
    d->wanted = d->inputs = NULL;
    d->moved = NULL;
}

void imp__densities_move(struct imp_densities *d, const uint8_t *changed)
{
    d->any = d->weights = d->flights = false;
    d->matters = d->rolled = 0;
    for (int b = 0; b < d->scene->n_bsdfs; b++) {
        const struct imp_bsdf *bsdf = d->scene->bsdfs[b];
        d->moved[b] = 0;
        for (int j = 0; j < bsdf->n_in; j++) {
            if (!imp__input_depends(bsdf->input[j], changed)) continue;
            d->weights = true;
            d->rolled |= UINT64_C(1) << imp__store_class(bsdf);
            d->moved[b] |= d->inputs[b] >> j & 1;
        }
        d->any |= d->moved[b];
        d->matters |= (uint64_t)d->moved[b] << imp__store_class(bsdf);
    }
    /* The second moment grows from class to class: all steps matter. */
    if (d->weights) d->rolled |= ~UINT64_C(0) << IMP_STORE_CLASSES;
    for (int k = 0; k < d->scene->n_media; k++) {
        const struct imp_medium *m = d->scene->media[k];
        for (int j = 0; j < m->n_own; j++)
            d->flights |= (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION) &&
                          imp__input_depends(m->input[j], changed);
    }
}
