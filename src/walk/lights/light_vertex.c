/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of walks from lights in lanes (light_walk.c and light_reach.c, of walks alone): light is
 * scattered by transposed kernels (kind/bsdf/transport.h) and is connected to the sensor. */
#include "light_bundle.h"
#include "walk/bundle/lanes_kernel.h"
#include "walk/bundle/lanes_leave.h"

static inline imp_wide number(const struct imp_lanes_vertices *v, int use)
{
    return imp__wide_number(&v->numbers, imp__dim(v->depth, use));
}

/* Where the density against light, by which kernels in lanes decide, is 0, their values are anything:
 * the kind's own for the lanes with bits. */
static void eval_alone(const struct imp_bin *bin, const struct imp_lanes_vertices *v,
                       const imp_wide3 *wo, const imp_wide3 *wi,
                       const imp_wide_lobe *lobe, unsigned bits, int colors,
                       struct imp_wide_color *f)
{
    const struct imp_bsdf *b = bin->bsdf;
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const struct imp_dirs d = {.wo = imp__wide3_lane(wo, k),
                                   .wi = imp__wide3_lane(wi, k),
                                   .lobe = (int)(*lobe)[k],
                                   .derivative = bin->derivative};
        imp_spec own[IMP_INPUTS_MAX], value;
        for (int j = 0; j < b->n_in; j++)
            own[j] = bin->kernel ? imp__color_lane(&v->in[j], 4, k)
                                 : v->each[k * v->stride + j];
        b->ops->eval(b, own, &d, &value);
        for (int c = 0; c < colors; c++) f->c[c][k] = value[c];
    }
}

/* The value for light that comes along wi = v->wo and leaves along wo. */
IMP_LANES_INLINE void eval(const struct imp_bin *bin, const struct imp_lanes_vertices *v,
                           const imp_wide3 *wo, const imp_wide_lobe *lobe, unsigned bits,
                           const int colors, const bool any, struct imp_wide_color *f)
{
    const imp_wide pdf =
        imp__kernel_pdf_eval(bin, v, wo, &v->wo, lobe, bits, colors, any, f);
    const unsigned zero = bits & ~imp__wide_bits(pdf > imp__wide(0));
    if (imp_unlikely(zero)) eval_alone(bin, v, wo, &v->wo, lobe, zero, colors, f);
}

/* ---- To the sensor ----------------------------------------------------------------------- */

IMP_LANES_INLINE void connect(struct imp_light_bundle *l, const struct imp_bin *bin,
                              const struct imp_lanes_vertices *v, imp_wide cos_i,
                              const int colors, const bool any)
{
    const imp_wide zero = imp__wide(0);
    struct imp_light_seen seen;
    struct imp_wide_color f;
    unsigned bits = imp__light_bundle_see(l->bundle.tracer->sensor, &v->numbers, v->depth,
                                          &v->x.p, v->on, &seen);
    if (!bits) return;
    const imp_wide3 w = seen.at.wo,
                    wo = imp__wide3_decide(imp__into_wide_frame(&v->x.frame, w));
    const imp_wide_lobe smooth = imp__wide_smooth();
    const imp_wide exchange = imp__wide_choose(
        cos_i > zero, imp__wide_magnitude(imp__wide3_inner(w, v->x.ng)) / cos_i, zero);
    eval(bin, v, &wo, &smooth, bits, colors, any, &f);
    const imp_wide weight = imp__wide_decide(seen.at.weight * exchange);
    bits &= imp__wide_bits((weight > zero) & ~imp__colors_vanish(f.c, colors));
    if (!bits) return;

    struct imp_light_views *to = &l->views;
    const struct imp_light_flights *from = &l->flights[l->at.depth & 1];
    const int n = to->ray.n;
    imp__lanes_sight_append(&to->ray, bits, v->x.p, v->x.ng, w, seen.at.p, seen.reach);
    imp__wide_append(&to->px[n], bits, seen.at.px);
    imp__wide_append(&to->py[n], bits, seen.at.py);
    for (int c = 0; c < colors; c++)
        imp__wide_append(&to->brings[c][n], bits,
                         imp__wide_taken(from->carries[c], v->order) * (f.c[c] * weight));
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits), i = to->ray.n++;
        to->walk[i] = v->walk[k];
        if (to->ray.time) to->ray.time[i] = from->rays.ray.time[v->order[k]];
    }
}

/* ---- On ---------------------------------------------------------------------------------- */

/* Survival as decided, and who survives. */
static inline imp_wide_truth survives(const struct imp_light_bundle *l,
                                      const struct imp_lanes_vertices *v,
                                      const imp_wide beta[4], int colors,
                                      imp_wide *survive)
{
    *survive = imp__wide(1);
    if (v->depth < l->bundle.tracer->integrator->rr_depth) return ~(imp_wide_truth){0};
    *survive = imp__lanes_survival(beta, colors, imp__wide(1), 0);
    return number(v, IMP_DIM_SURVIVE) < *survive;
}

/* K* over K (imp__bsdf_exchange) of the directions that are drawn. */
IMP_LANES_INLINE imp_wide exchange_of(const struct imp_bin *bin,
                                      const struct imp_lanes_vertices *v,
                                      const imp_wide3 *wo, const imp_wide_lobe *lobe,
                                      imp_wide cos_o, imp_wide cos_i, const bool any)
{
    const imp_wide zero = imp__wide(0), cosines = cos_o / cos_i;
    if (!any) return imp__wide_choose(cos_i > zero, cosines, zero);
    const imp_wide_truth delta = ~imp__is_smooth(*lobe);
    const imp_wide ratio = imp__kernel_index_ratio(bin, v, wo, &v->wo, lobe,
                                                   imp__wide_bits(delta)),
                   shading = imp__wide_magnitude(v->wo.z) / imp__wide_magnitude(wo->z);
    const imp_wide of_delta = imp__wide_choose(shading < imp__wide(INFINITY),
                                               ratio * ratio * cosines * shading, zero);
    return imp__wide_choose(cos_i > zero, imp__wide_choose(delta, of_delta, cosines),
                            zero);
}

IMP_LANES_INLINE void scatter(struct imp_light_bundle *l, const struct imp_bin *bin,
                              const struct imp_lanes_vertices *v, imp_wide cos_i,
                              const int colors, const bool any)
{
    const imp_wide zero = imp__wide(0);
    const imp_wide u[3] = {number(v, IMP_DIM_LOBE), number(v, IMP_DIM_DIR_U),
                           number(v, IMP_DIM_DIR_V)};
    const struct imp_light_flights *from = &l->flights[l->at.depth & 1];
    imp_wide_lobe lobe = imp__wide_smooth();
    imp_wide3 wo;
    struct imp_wide_color f;
    imp_wide_truth goes = imp__kernel_sample(bin, v, u, any, &wo, &lobe);
    const imp_wide3 w = imp__out_of_wide_frame(&v->x.frame, wo);
    wo = imp__wide3_decide(wo);
    const imp_wide drawn = imp__kernel_pdf_eval(bin, v, &v->wo, &wo, &lobe,
                                                imp__wide_bits(goes), colors, any, &f);
    goes &= drawn > zero;
    const imp_wide exchange =
        exchange_of(bin, v, &wo, &lobe, imp__wide_magnitude(imp__wide3_inner(w, v->x.ng)),
                    cos_i, any);
    const imp_wide pdf = imp__wide_decide(drawn / exchange);
    goes &= (exchange > zero) & (pdf > zero);
    eval(bin, v, &wo, &lobe, imp__wide_bits(goes) & v->on, colors, any, &f);

    const imp_wide by = 1 / pdf;
    imp_wide beta[4], survive;
    for (int c = 0; c < colors; c++)
        beta[c] = imp__wide_taken(from->rays.beta[c], v->order) * (f.c[c] * by);
    goes &= ~imp__colors_vanish(beta, colors);
    goes &= survives(l, v, beta, colors, &survive);
    unsigned bits = imp__wide_bits(goes) & v->on;
    if (!bits) return;
    struct imp_light_flights *to = &l->flights[~l->at.depth & 1];
    const int n = to->rays.ray.n;
    const imp_wide again = 1 / survive, scale = 1 / (pdf * survive);
    imp__lanes_ray_append(&to->rays.ray, bits, v->x.p, v->x.ng, w);
    for (int c = 0; c < colors; c++) {
        imp__wide_append(&to->rays.beta[c][n], bits, beta[c] * again);
        imp__wide_append(&to->carries[c][n], bits,
                         imp__wide_taken(from->carries[c], v->order) * (f.c[c] * scale));
    }
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits), i = to->rays.ray.n++;
        to->rays.walk[i] = v->walk[k];
        if (to->rays.ray.time) to->rays.ray.time[i] = from->rays.ray.time[v->order[k]];
    }
}

/* ---- Both -------------------------------------------------------------------------------- */

/* any: their material may be any; else it has a kernel and smooth lobes that send no light through. */
IMP_LANES_INLINE void work(struct imp_light_bundle *l, const struct imp_bin *bin,
                           const int32_t *order, int n, const int colors, const bool any)
{
    struct imp_wide_color in[IMP_INPUTS_MAX];
    struct imp_lanes_vertices v;
    imp__lanes_arrive(&l->at, bin, order, n, NULL, colors, any, false, in, &v);
    const imp_wide cos_i = imp__wide_magnitude(
        imp__wide3_inner(imp__wide3_taken(l->at.rays->ray.d, order), v.x.ng));
    if (l->links && (!any || bin->bsdf->flags & IMP_BSDF_SMOOTH))
        connect(l, bin, &v, cos_i, colors, any);
    if (l->goes_on) scatter(l, bin, &v, cos_i, colors, any);
}

#define WORK(name, colors, any)                                                          \
    static __attribute__((noinline)) void name(struct imp_light_bundle *l,               \
                                               const struct imp_bin *bin,                \
                                               const int32_t *order, int n)              \
    {                                                                                    \
        work(l, bin, order, n, colors, any);                                             \
    }
typedef void work_fn(struct imp_light_bundle *l, const struct imp_bin *bin,
                     const int32_t *order, int n);
WORK(work_3, 3, false)
WORK(work_4, 4, false)
WORK(work_any_3, 3, true)
WORK(work_any_4, 4, true)

void imp__light_vertices(struct imp_light_bundle *l, const struct imp_bin *bin,
                         const int32_t *order, int n)
{
    static work_fn *const works[2][2] = {{work_3, work_4}, {work_any_3, work_any_4}};
    const bool any = !bin->kernel || bin->bsdf->flags != IMP_BSDF_SMOOTH;
    work_fn *const work_as = works[any][l->bundle.colors > 3];
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        int32_t rest[IMP_WIDE_LANES];
        const int left = imp_min(n - i, IMP_WIDE_LANES);
        work_as(l, bin, imp__lanes_filled(order + i, left, rest), left);
    }
}
