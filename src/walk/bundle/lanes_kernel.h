/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices in lanes of walks from either end (lanes_vertex.c, lights/light_vertex.c): the place where
 * rays arrive, and the kernel there (kind/kind_lanes.h), or, for materials that have none, their own
 * functions lane by lane (lone_kernel.c). */
#ifndef IMP_WALK_BUNDLE_LANES_KERNEL_H
#define IMP_WALK_BUNDLE_LANES_KERNEL_H

#include "in_media.h"
#include "lanes_record.h"

#define IMP_LANES_INLINE static inline __attribute__((always_inline))

/* All of the colours are 0. */
static inline imp_wide_truth imp__colors_vanish(const imp_wide f[4], int colors)
{
    const imp_wide zero = imp__wide(0);
    imp_wide_truth all = (f[0] == zero) & (f[1] == zero) & (f[2] == zero);
    if (colors > 3) all &= f[3] == zero;
    return all;
}

/* The rays order[n] end in vertices of this material; v->at is the caller's. points NULL: random
 * numbers are those of the walks' keys. any: the material may have no kernel. in [IMP_INPUTS_MAX]: room
 * for its inputs. */
IMP_LANES_INLINE void imp__lanes_arrive(struct imp_depth *d, const struct imp_bin *bin,
                                        const int32_t *order, int n,
                                        const struct imp_point_table *points,
                                        const int colors, const bool any,
                                        const bool media, struct imp_wide_color *in,
                                        struct imp_lanes_vertices *v)
{
    const struct imp_bundle *b = d->bundle;
    const struct imp_wide_hits hits = {.o = d->rays->ray.o,
                                       .d = d->rays->ray.d,
                                       .t = d->hits->t,
                                       .u = d->hits->u,
                                       .v = d->hits->v,
                                       .prim = d->hits->prim,
                                       .at = order};
    v->recorded = b->walks != NULL;
    v->on = imp__bits_first(n);
    v->order = order;
    v->points = points != NULL;
    v->depth = d->depth;
    for (int k = 0; k < IMP_WIDE_LANES; k++) v->walk[k] = d->rays->walk[order[k]];
    v->numbers = imp__wide_block(points, b->set, b->index, v->walk, imp__block(d->depth));
    if (media && bin->medium >= 0) imp__collision_places(d, order, &v->x);
    else if (bin->surface)
        bin->surface->surface(bin->shape, &hits, v->recorded || !bin->plain, &v->x);
    else imp__lanes_surface(d, &hits, &v->x);
    v->wo_drawn = imp__into_wide_frame(
        &v->x.frame, imp__wide3_opposite(imp__wide3_taken(d->rays->ray.d, order)));
    v->wo = imp__wide3_decide(v->wo_drawn);
    v->in = bin->in;
    if (any && !bin->kernel) {
        v->each = bin->each;
        v->stride = 0;
        if (colors > 3 || !bin->plain) {
            imp__lanes_inputs_each(d, bin, &hits, v, d->lone->each);
            v->each = d->lone->each;
            v->stride = bin->bsdf->n_in;
        }
    } else if (colors > 3 || !bin->plain) {
        imp__lanes_inputs(d, bin, &hits, v, in);
        v->in = in;
    }
}

/* `of`: the lanes for which a number is wanted. */
IMP_LANES_INLINE imp_wide imp__kernel_pdf_eval(const struct imp_bin *bin,
                                               const struct imp_lanes_vertices *v,
                                               const imp_wide3 *wo, const imp_wide3 *wi,
                                               const imp_wide_lobe *lobe, unsigned of,
                                               const int colors, const bool any,
                                               struct imp_wide_color *f)
{
    return any && !bin->kernel ? imp__lone_pdf_eval(bin, v, wo, wi, lobe, of & v->on, f)
                               : bin->kernel->pdf_eval(bin->bsdf, bin->derivative, v->in,
                                                       wo, wi, lobe, colors, f);
}
IMP_LANES_INLINE imp_wide_truth imp__kernel_sample(const struct imp_bin *bin,
                                                   const struct imp_lanes_vertices *v,
                                                   const imp_wide u[3], const bool any,
                                                   imp_wide3 *wi, imp_wide_lobe *lobe)
{
    return any && !bin->kernel ? imp__lone_sample(bin, v, u, wi, lobe)
                               : bin->kernel->sample(bin->bsdf, bin->derivative, v->in,
                                                     &v->wo_drawn, u, wi, lobe);
}
IMP_LANES_INLINE imp_wide imp__kernel_index_ratio(const struct imp_bin *bin,
                                                  const struct imp_lanes_vertices *v,
                                                  const imp_wide3 *wo,
                                                  const imp_wide3 *wi,
                                                  const imp_wide_lobe *lobe, unsigned of)
{
    if (!bin->kernel) return imp__lone_index_ratio(bin, v, wo, wi, lobe, of & v->on);
    return bin->kernel->index_ratio
               ? bin->kernel->index_ratio(bin->bsdf, v->in, wo, wi, lobe)
               : imp__wide(1);
}

#endif
