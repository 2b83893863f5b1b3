/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials without a form in lanes at vertices that are made in lanes: called lane by lane, in place
 * of struct imp_bsdf_lanes. All else of the vertex is in lanes. */
#include "kind/build.h"
#include "lanes_record.h"

static const imp_spec *inputs_of(const struct imp_lanes_vertices *v, int k)
{
    return v->each + k * v->stride;
}

imp_wide_truth imp__lone_sample(const struct imp_bin *bin,
                                const struct imp_lanes_vertices *v, const imp_wide u[3],
                                imp_wide3 *wi, imp_wide_lobe *lobe)
{
    const struct imp_bsdf *b = bin->bsdf;
    imp_wide_truth drawn = {0};
    *wi = imp__wide3_of((imp_v3){0});
    for (unsigned left = v->on; left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const double own[3] = {u[0][k], u[1][k], u[2][k]};
        struct imp_dirs d = {.wo = imp__wide3_lane(&v->wo_drawn, k),
                             .lobe = IMP_SMOOTH,
                             .derivative = bin->derivative};
        if (!b->ops->sample(b, inputs_of(v, k), own, &d)) continue;
        drawn[k] = -1;
        (*lobe)[k] = d.lobe;
        imp__wide3_set(wi, k, d.wi);
    }
    return drawn;
}

static struct imp_dirs dirs_of(const struct imp_bin *bin, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int k)
{
    return (struct imp_dirs){.wo = imp__wide3_lane(wo, k),
                             .wi = imp__wide3_lane(wi, k),
                             .lobe = (int)(*lobe)[k],
                             .derivative = bin->derivative};
}

imp_wide imp__lone_pdf_eval(const struct imp_bin *bin, const struct imp_lanes_vertices *v,
                            const imp_wide3 *wo, const imp_wide3 *wi,
                            const imp_wide_lobe *lobe, unsigned bits,
                            struct imp_wide_color *f)
{
    imp_wide pdf = imp__wide(0);
    *f = imp__wide_color((imp_spec){0});
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const struct imp_dirs d = dirs_of(bin, wo, wi, lobe, k);
        imp_spec own;
        pdf[k] = imp__bsdf_pdf_eval(bin->bsdf, inputs_of(v, k), &d, &own);
        for (int c = 0; c < 4 && pdf[k] > 0; c++) f->c[c][k] = own[c];
    }
    return pdf;
}

imp_wide imp__lone_index_ratio(const struct imp_bin *bin,
                               const struct imp_lanes_vertices *v, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe,
                               unsigned bits)
{
    const struct imp_bsdf *b = bin->bsdf;
    imp_wide ratio = imp__wide(1);
    for (; b->ops->index_ratio && bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const struct imp_dirs d = dirs_of(bin, wo, wi, lobe, k);
        ratio[k] = b->ops->index_ratio(b, inputs_of(v, k), &d);
    }
    return ratio;
}
