/* SPDX-License-Identifier: Apache-2.0
 *
 * The materials of all polygons: each kept once, and projected together in one order that
 * holds the narrowest lobe. */
#include "elements.h"
#include <string.h>

enum imp_status imp__el_material_add(imp_elements *e, const struct imp__el_material *m,
                                     int *index)
{
    for (int i = 0; i < e->n_materials; i++) {
        const struct imp__el_material *k = &e->materials[i];
        if (k->bsdf == m->bsdf && k->flipped == m->flipped && k->phong == m->phong &&
            memcmp(k->kd, m->kd, sizeof m->kd) == 0 &&
            memcmp(k->ks, m->ks, sizeof m->ks) == 0 && k->exponent == m->exponent) {
            *index = i;
            return IMP_OK;
        }
    }
    const size_t n = (size_t)e->n_materials;
    if ((n & (n - 1)) == 0) { /* full */
        struct imp__el_material *grown =
            imp__arena_array(&e->arena, n ? 2 * n : 1, sizeof *grown);
        if (!grown) return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for materials");
        if (n) memcpy(grown, e->materials, n * sizeof *grown);
        e->materials = grown;
    }
    e->materials[n] = *m;
    *index = e->n_materials++;
    return IMP_OK;
}

static const char *user_of(const imp_elements *e, int material)
{
    for (size_t i = 0; i < e->n_roots; i++)
        if (e->roots[i].material == material && e->roots[i].shape >= 0)
            return e->scene->shapes[e->roots[i].shape]->name;
    return "";
}

#define RESIDUAL_GOOD 0.17 /* chooses order 8 for a Phong lobe of exponent 15 */
#define RESIDUAL_BAD  0.6

enum imp_status imp__el_materials(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    double residual = 0;
    int order = e->opt.order ? e->opt.order : 2;
    for (;; order += 2) {
        const struct imp_arena_mark mark = imp__arena_mark(&e->arena);
        imp__basis_init(&e->basis, order);
        residual = 0;
        for (int i = 0; i < e->n_materials; i++) {
            IMP_TRY(
                imp__el_refused_at(e,
                                   imp__el_project(e->ctx, &e->arena, &e->basis, e->ch,
                                                   user_of(e, i), &e->materials[i]),
                                   e->materials[i].bsdf));
            residual = fmax(residual, e->materials[i].residual);
        }
        if (e->opt.order || residual <= RESIDUAL_GOOD || order >= EL_ORDER_MAX) break;
        imp__arena_rewind(&e->arena, mark);
    }
    for (int i = 0; i < e->n_materials; i++) {
        const struct imp__el_material *m = &e->materials[i];
        const char *shape = user_of(e, i);
        if (m->residual > RESIDUAL_BAD)
            IMP_TRY(imp__el_refused_at(
                e,
                imp__error(
                    e->ctx, IMP_E_UNSUPPORTED,
                    "shape '%s': its material is too narrow for directional order %d "
                    "(relative error %.0f %%)",
                    shape, order, 100 * m->residual),
                m->bsdf));
        if (m->residual > RESIDUAL_GOOD && !e->quiet)
            imp__warn(e->ctx,
                      "shape '%s': its lobe in directional order %d has a relative error "
                      "of %.0f %%",
                      shape, order, 100 * m->residual);
        if (m->albedo_max > 1 + 1e-4)
            IMP_TRY(imp__el_refused_at(
                e,
                imp__error(
                    e->ctx, IMP_E_UNSUPPORTED,
                    "shape '%s': its material reflects more than arrives (albedo %.4g)",
                    shape, m->albedo_max),
                m->bsdf));
    }
out:
    return st;
}
