/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a bundle in lanes: those on one shape, IMP_WIDE_LANES at a time. What the one step does
 * for a walk alone (path/sensor_end.h, core/scatter.c, core/light.c) stands here for walks that
 * have a kernel, light samples and roulette, and nothing more. */
#include "in_media.h"
#include "lanes_kernel.h"
#include "lanes_leave.h"
#include "reuse.h"
#include "swept.h"

/* ---- What leaves it ---------------------------------------------------------------------- */

/* imp__light_place of lane k. */
static inline struct imp_light_place place_of(const struct imp_lanes_vertices *v,
                                              const bool any, const struct imp_bsdf *b,
                                              int k)
{
    return (struct imp_light_place){.p = imp__wide3_lane(&v->x.p, k),
                                    .n = imp__wide3_lane(&v->faced, k),
                                    .faces = !any || imp__is_faced(b)};
}

static inline imp_wide number(const struct imp_lanes_vertices *v, int use)
{
    return imp__wide_number(&v->numbers, v->points ? (uint32_t)imp__slot(use)
                                                   : imp__dim(v->depth, use));
}

/* What lights bring to the vertices if they are seen. */
static inline __attribute__((always_inline)) void
light_weigh(struct imp_depth *d, const struct imp_bin *bin,
            const struct imp_lanes_vertices *v, const int colors, const bool any,
            struct imp_lanes_lit *lit)
{
    const imp_wide zero = imp__wide(0);
    const struct imp_scene *scene = d->bundle->tracer->scene;
    struct imp_lanes_light *l = &lit->light;
    const imp_wide u[2] = {number(v, IMP_DIM_LIGHT_U), number(v, IMP_DIM_LIGHT_V)};
    const imp_wide which =
        v->points || scene->n_emitters == 1 ? u[0] : number(v, IMP_DIM_LIGHT);
    l->at.recorded = v->recorded || d->bundle->tracer->active; /* which light it is */
    if (imp_unlikely(d->next->left != NULL))
        imp__lanes_tree_draw(d->bundle, v,
                             !any || imp__is_faced(bin->bsdf) ? &v->faced : NULL, u,
                             which, l);
    else imp__lanes_light_draw(d->bundle, v, u, which, l);
    lit->wi = imp__wide3_decide(imp__into_wide_frame(&v->x.frame, l->at.wi));
    const imp_wide_lobe smooth = imp__wide_smooth();
    const imp_wide pdf =
        imp__kernel_pdf_eval(bin, v, &v->wo, &lit->wi, &smooth,
                             imp__wide_bits(l->at.drawn), colors, any, &lit->f);
    const imp_wide p = l->at.pdf * l->pmf;
    lit->weight =
        imp__wide_decide(imp__wide_choose(l->delta, 1 / p, imp__wide_power_over(p, pdf)));
    imp_wide fl[4];
    for (int c = 0; c < colors; c++) fl[c] = lit->f.c[c] * l->radiance.c[c];
    const imp_wide_truth none = imp__colors_vanish(fl, colors),
                         drawn = l->at.drawn & (pdf > zero), wanted = drawn & ~none;
    lit->on = imp__wide_bits(wanted) & v->on;
    lit->dark = imp__wide_bits(drawn & none) & v->on;
    for (int c = 0; c < colors; c++)
        lit->brings.c[c] = imp__wide_choose(wanted, fl[c] * lit->weight, zero);
}

/* Their shadow rays; v->record: of these vertices. */
static inline __attribute__((always_inline)) void
light_see(struct imp_depth *d, const struct imp_bin *bin,
          const struct imp_lanes_vertices *v, const bool media,
          const struct imp_lanes_lit *lit)
{
    const struct imp_lanes_light *l = &lit->light;
    struct imp_shadows *to = d->shadows;
    const unsigned bits = lit->on;
    if (!bits) return;
    imp__lanes_shadow_append(&to->ray, bits, v->x.p, v->x.ng, l);
    for (unsigned left = bits; left; left &= left - 1) {
        const int k = __builtin_ctz(left), i = to->ray.n++;
        to->at[i] = v->at + k;
        if (v->recorded) to->of[i] = v->record[k];
        if (to->ray.time) to->ray.time[i] = d->rays->ray.time[v->order[k]];
        if (media) imp__shadow_in_media(d, bin, v, k, i);
    }
}

/* Survival as decided, and who survives. */
static inline imp_wide_truth survives(const struct imp_depth *d,
                                      const struct imp_lanes_vertices *v,
                                      const imp_wide beta[4], int colors, imp_wide eta,
                                      imp_wide *survive)
{
    const struct imp_tracer *t = d->bundle->tracer;
    *survive = imp__wide(1);
    if (d->depth + 1 < t->integrator->rr_depth) return ~(imp_wide_truth){0};
    *survive = imp__lanes_survival(beta, colors, eta, t->survival);
    return number(v, IMP_DIM_SURVIVE) < *survive;
}

/* Factors of throughputs that are zero but have a derivative are left out, as by imp__throughput_part. */
static __attribute__((noinline)) void zeros_leave_out(const struct imp_depth *d,
                                                      const struct imp_bin *bin,
                                                      const struct imp_lanes_vertices *v,
                                                      unsigned on, int colors,
                                                      imp_wide factor[4], uint8_t *zeros)
{
    const struct imp_tracer *t = d->bundle->tracer;
    const int material = bin->bsdf->index;
    imp_wide most = factor[0];
    for (int c = 1; c < colors; c++) most = imp__wide_larger(most, factor[c]);
    for (int k = 0; k < IMP_WIDE_LANES; k++) zeros[k] = d->rays->zeros[v->order[k]];
    if (material < 0 || !t->active->inputs[material]) return;
    for (int c = 0; c < colors; c++) {
        unsigned left = imp__wide_bits(factor[c] == imp__wide(0)) & on;
        for (; left; left &= left - 1) {
            const int k = __builtin_ctz(left);
            if (!(zeros[k] >> c & 1) || t->elsewhere)
                factor[c][k] = imp_max(most[k], 0.5);
            zeros[k] |= (uint8_t)(1 << c);
        }
    }
}

/* Where walks go on, and what a step there weighs. */
static inline __attribute__((always_inline)) void
scatter_weigh(struct imp_depth *d, const struct imp_bin *bin,
              const struct imp_lanes_vertices *v, const int colors, const bool any,
              struct imp_lanes_step *s)
{
    const imp_wide zero = imp__wide(0);
    const imp_wide u[3] = {number(v, IMP_DIM_LOBE), number(v, IMP_DIM_DIR_U),
                           number(v, IMP_DIM_DIR_V)};
    struct imp_wide_color f;
    s->lobe = imp__wide_smooth();
    imp_wide_truth goes = imp__kernel_sample(bin, v, u, any, &s->wi, &s->lobe);
    s->world = imp__out_of_wide_frame(&v->x.frame, s->wi);
    s->wi = imp__wide3_decide(s->wi);
    s->pdf = imp__wide_decide(imp__kernel_pdf_eval(
        bin, v, &v->wo, &s->wi, &s->lobe, imp__wide_bits(goes), colors, any, &f));
    const imp_wide by = 1 / s->pdf;
    imp_wide beta[4];
    s->eta = imp__wide_taken(d->rays->eta, v->order);
    if (any)
        s->eta *= imp__kernel_index_ratio(bin, v, &v->wo, &s->wi, &s->lobe,
                                          imp__wide_bits(goes));
    goes &= s->pdf > zero;
    for (int c = 0; c < colors; c++) beta[c] = f.c[c] * by;
    if (imp_unlikely(d->rays->zeros != NULL))
        zeros_leave_out(d, bin, v, imp__wide_bits(goes) & v->on, colors, beta, s->zeros);
    for (int c = 0; c < colors; c++)
        beta[c] = imp__wide_taken(d->rays->beta[c], v->order) * beta[c];
    goes &= ~imp__colors_vanish(beta, colors);
    goes &= survives(d, v, beta, colors, s->eta, &s->survive);
    const imp_wide again = 1 / s->survive;
    s->scale = 1 / (s->pdf * s->survive);
    for (int c = 0; c < colors; c++) {
        s->w.c[c] = imp__wide_choose(goes, f.c[c] * s->scale, zero);
        s->beta.c[c] = beta[c] * again;
    }
    s->on = imp__wide_bits(goes) & v->on;
}

/* The next rays. */
static inline __attribute__((always_inline)) void
scatter_on(struct imp_depth *d, const struct imp_bin *bin,
           const struct imp_lanes_vertices *v, const int colors, const bool any,
           const bool media, const struct imp_lanes_step *s)
{
    struct imp_flights *to = d->next;
    const unsigned bits = s->on;
    const int n = to->ray.n;
    imp__lanes_ray_append(&to->ray, bits, v->x.p, v->x.ng, s->world);
    imp__wide3_append(to->from, n, bits, v->x.p);
    imp__wide_append(&to->pdf[n], bits,
                     any ? imp__wide_choose(imp__is_smooth(s->lobe), s->pdf, imp__wide(0))
                         : s->pdf);
    for (int c = 0; c < colors; c++)
        imp__wide_append(&to->beta[c][n], bits, s->beta.c[c]);
    imp__wide_append(&to->eta[n], bits, s->eta);
    for (unsigned left = bits; left; left &= left - 1) {
        const int k = __builtin_ctz(left), i = to->ray.n++, from = v->order[k];
        to->walk[i] = d->rays->walk[from];
        to->up[i] = v->at + k;
        if (to->left) to->left[i] = place_of(v, any, bin->bsdf, k);
        if (to->zeros) to->zeros[i] = s->zeros[k];
        if (to->ray.time) to->ray.time[i] = d->rays->ray.time[from];
        if (media) imp__ray_in_media(d, bin, v, k, i);
    }
}

/* ---- All --------------------------------------------------------------------------------- */

static inline void color_store(double *const to[4], int colors, int at,
                               const struct imp_wide_color *x)
{
    for (int c = 0; c < colors; c++) imp__wide_store(&to[c][at], x->c[c]);
}

/* any: their material may be any; else it has a kernel and smooth lobes that send no light through.
 * False: they are to be made one by
 * one, since a value that is zero has a derivative there. */
static inline __attribute__((always_inline)) bool
work(struct imp_depth *d, const struct imp_bin *bin, const int32_t *order, int n, int at,
     const int colors, const bool any, const bool media)
{
    const struct imp_bundle *b = d->bundle;
    struct imp_wide_color in[IMP_INPUTS_MAX];
    struct imp_lanes_lit lit;
    struct imp_lanes_step step;
    struct imp_lanes_vertices v; /* field by field: clearing all of it takes time */
    v.at = at;
    imp__lanes_arrive(d, bin, order, n, b->tracer->points, colors, any, media, in, &v);
    if (imp_unlikely(d->next->left != NULL))
        v.faced = imp__wide3_choose(v.wo.z < imp__wide(0),
                                    imp__wide3_opposite(v.x.frame.n), v.x.frame.n);
    lit.on = lit.dark = step.on = 0;
    if (imp_likely(!d->last)) {
        if (b->tracer->integrator->lights && b->tracer->scene->n_emitters > 0 &&
            (!any || bin->bsdf->flags & IMP_BSDF_SMOOTH) && !(media && bin->sealed))
            light_weigh(d, bin, &v, colors, any, &lit);
        else lit.brings = imp__wide_color(imp__spec(0));
        scatter_weigh(d, bin, &v, colors, any, &step);
    }

    if (b->tracer->active && imp_unlikely(imp__lanes_differ(d, bin, &lit))) return false;
    if (v.recorded) {
        imp__lanes_record(d, bin, &v, &lit, &step);
    } else {
        if (b->swept) imp__lanes_keep(d, bin, &v, &lit, &step);
        const struct imp_wide_color none = imp__wide_color(imp__spec(0));
        color_store(d->values->e, colors, at, &none);
        color_store(d->values->b, colors, at, &lit.brings);
        color_store(d->values->w, colors, at, &step.w);
        color_store(d->values->beyond, colors, at, &none);
        for (int k = 0; k < n; k++) {
            d->values->up[at + k] = d->rays->up[order[k]];
            b->valid[v.walk[k]] = true;
        }
    }
    if (imp_unlikely(d->reuse != NULL) && d->depth == 0) {
        imp__wide3_store(d->reuse->x, at, v.x.p);
        imp__wide3_store(d->reuse->ng, at, v.x.ng);
        imp__wide3_store(d->reuse->n, at, v.x.frame.n);
        for (int k = 0; k < n; k++) d->reuse->even[at + k] = bin->even;
    }
    if (imp_unlikely(d->last)) return true;
    light_see(d, bin, &v, media, &lit);
    scatter_on(d, bin, &v, colors, any, media, &step);
    return true;
}

#define WORK(name, colors, any, media)                                                   \
    static __attribute__((noinline)) bool name(struct imp_depth *d,                      \
                                               const struct imp_bin *bin,                \
                                               const int32_t *order, int n, int at)      \
    {                                                                                    \
        return work(d, bin, order, n, at, colors, any, media);                           \
    }
typedef bool work_fn(struct imp_depth *d, const struct imp_bin *bin, const int32_t *order,
                     int n, int at);
WORK(work_3, 3, false, false)
WORK(work_4, 4, false, false)
WORK(work_any_3, 3, true, false)
WORK(work_any_4, 4, true, false)
WORK(work_in_media, 3, true, true)

void imp__vertices_in_lanes(struct imp_depth *d, const struct imp_bin *bin,
                            const int32_t *order, int n, int at)
{
    static work_fn *const works[2][2] = {{work_3, work_4}, {work_any_3, work_any_4}};
    const bool any = !bin->kernel || bin->bsdf->flags != IMP_BSDF_SMOOTH;
    work_fn *const work_as = d->media ? work_in_media : works[any][d->bundle->colors > 3];
    int32_t rest[IMP_WIDE_LANES];
    if (d->bundle->colors > 3) imp__lanes_spectra_keep(d->bundle, bin, n);
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        const int left = imp_min(n - i, IMP_WIDE_LANES);
        const int32_t *here = imp__lanes_filled(order + i, left, rest);
        const bool made = work_as(d, bin, here, left, at + i);
        for (int k = 0; !made && k < left; k++)
            if (bin->medium >= 0) imp__collision_alone(d, here[k], at + i + k);
            else imp__vertex_alone(d, here[k], at + i + k);
    }
}
