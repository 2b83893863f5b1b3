/* SPDX-License-Identifier: Apache-2.0
 *
 * What the densities that kept walks were drawn with depend on: inputs of materials, by
 * trial, and extinctions of media. */
#include "step.h"
#include "store.h"

_Static_assert(IMP_INPUTS_MAX <= 64, "masks of inputs have 64 bits");

#define TRIES 24 /* pairs of directions */

/* A value of an input inside its bounds. */
static imp_spec drawn_input(const struct imp_input_desc *d, uint64_t k)
{
    const double hi = d->hi > d->lo && isfinite(d->hi) ? d->hi : d->lo + 2;
    const double lo = isfinite(d->lo) ? d->lo : 0;
    imp_spec v = {0};
    for (int c = 0; c < 4; c++)
        v[c] = lo + (hi - lo) * (0.1 + 0.8 * imp__u01((struct imp_key){k}, (uint32_t)c));
    return d->flags & IMP_INPUT_SCALAR ? imp__spec(v[0]) : v;
}

/* Declaration of input j of b, its children's included. */
static const struct imp_input_desc *desc_of(const struct imp_bsdf *b, int j)
{
    if (j < b->n_own) {
        for (int k = 0, n = 0; b->ops->inputs && b->ops->inputs[k].name; k++)
            if (n++ == j) return &b->ops->inputs[k];
        return NULL;
    }
    for (int k = b->n_child - 1; k >= 0; k--)
        if (j >= b->child_in[k]) return desc_of(b->child[k], j - b->child_in[k]);
    return NULL;
}

/* Does it derive something from its inputs once for all directions? */
static bool derives(const struct imp_bsdf *b)
{
    if (b->ops->changed) return true;
    for (int k = 0; k < b->n_child; k++)
        if (derives(b->child[k])) return true;
    return false;
}

/* Does the density differ where input j does? Found by trying: kinds do not declare it. */
static bool depends(const struct imp_bsdf *b, int j, uint64_t wanted)
{
    const struct imp_input_desc *own = desc_of(b, j);
    imp_spec in[IMP_INPUTS_MAX];
    if (!own || derives(b)) return true;
    for (uint64_t k = 0; k < TRIES; k++) {
        const struct imp_key key = {0x9e3779b97f4a7c15u * (k + 1)};
        for (int i = 0; i < b->n_in; i++) {
            const struct imp_input_desc *d = desc_of(b, i);
            in[i] = d ? drawn_input(d, key.state + 64 * (uint64_t)i) : imp__spec(0.5);
        }
        double z[2], phi[2];
        for (int i = 0; i < 2; i++) {
            z[i] = 1 - 2 * imp__u01(key, 100 + (uint32_t)i);
            phi[i] = 6.28 * imp__u01(key, 200 + (uint32_t)i);
        }
        if (k % 2) z[1] = copysign(z[1], z[0]); /* reflection too */
        struct imp_dirs dirs = {.lobe = IMP_SMOOTH, .derivative = wanted};
        const double r0 = sqrt(1 - z[0] * z[0]), r1 = sqrt(1 - z[1] * z[1]);
        dirs.wo = imp__v3(r0 * cos(phi[0]), r0 * sin(phi[0]), z[0]);
        dirs.wi = k % 3 ? imp__v3(r1 * cos(phi[1]), r1 * sin(phi[1]), z[1])
                        : imp__v3(-dirs.wo[0], -dirs.wo[1], dirs.wo[2]);
        const int lobes = b->flags & IMP_BSDF_DELTA ? imp_max(b->n_lobes, 2) : 0;
        for (int lobe = IMP_SMOOTH; lobe < lobes; lobe++) {
            dirs.lobe = lobe;
            const imp_spec before = in[j];
            const double p = b->ops->pdf(b, in, &dirs);
            in[j] = drawn_input(own, key.state + 7777 + (uint64_t)j);
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
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for kept walks");
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
    for (int b = 0; b < d->scene->n_bsdfs; b++) {
        const struct imp_bsdf *bsdf = d->scene->bsdfs[b];
        d->moved[b] = 0;
        for (int j = 0; j < bsdf->n_in; j++) {
            if (!imp__input_depends(bsdf->input[j], changed)) continue;
            d->weights = true;
            d->moved[b] |= d->inputs[b] >> j & 1;
        }
        d->any |= d->moved[b];
    }
    for (int k = 0; k < d->scene->n_media; k++) {
        const struct imp_medium *m = d->scene->media[k];
        for (int j = 0; j < m->n_own; j++)
            d->flights |= (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION) &&
                          imp__input_depends(m->input[j], changed);
    }
}
