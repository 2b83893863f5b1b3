/* SPDX-License-Identifier: Apache-2.0
 *
 * Kinds evaluated once a lane, with the scalar inputs of that lane (shaped.h). */
#include "shaped.h"
#include "math/vec.h"

static void lane_inputs(const struct imp_input *const *input, int n, const imp_spec *in,
                        int lane, imp_spec *in_lane)
{
    for (int i = 0; i < n; i++)
        in_lane[i] = input[i]->scalar ? imp__spec(in[i][lane]) : in[i];
}

void imp__shaped_inputs(const struct imp_bsdf *b, const imp_spec *in, int lane,
                        imp_spec *in_lane)
{
    lane_inputs(b->input, b->n_in, in, lane, in_lane);
}

static double ratio_of(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d)
{
    return b->ops->index_ratio ? b->ops->index_ratio(b, in, d) : 1;
}

/* Is the lane led along d, as the lane that drew it? in: its inputs. */
static bool goes_along(const struct imp_bsdf *b, const imp_spec *in, double drawn_ratio,
                       const struct imp_dirs *d)
{
    return d->lobe == IMP_SMOOTH || ratio_of(b, in, d) == drawn_ratio;
}

static double drawn_ratio(const struct imp_bsdf *b, const struct imp_carried *carried,
                          const imp_spec *in, const struct imp_dirs *d)
{
    imp_spec own[IMP_INPUTS_MAX];
    if (d->lobe == IMP_SMOOTH) return 1;
    imp__shaped_inputs(b, in, imp__waves_drew(carried), own);
    return ratio_of(b, own, d);
}

void imp__shaped_eval(const struct imp_bsdf *b, const struct imp_carried *carried,
                      const imp_spec *in, const struct imp_dirs *d, imp_spec *f)
{
    const double ratio = drawn_ratio(b, carried, in, d);
    *f = (imp_spec){0};
    for (int j = 0; j < carried->n; j++) {
        imp_spec own[IMP_INPUTS_MAX], value;
        imp__shaped_inputs(b, in, j, own);
        if (!goes_along(b, own, ratio, d)) continue;
        b->ops->eval(b, own, d, &value);
        (*f)[j] = value[j];
    }
}

void imp__shaped_eval_d(const struct imp_bsdf *b, const struct imp_carried *carried,
                        const imp_spec *in, const struct imp_dirs *d, imp_spec *df)
{
    const double ratio = drawn_ratio(b, carried, in, d);
    for (int i = 0; i < b->n_in; i++) df[i] = (imp_spec){0};
    for (int j = 0; j < carried->n; j++) {
        imp_spec own[IMP_INPUTS_MAX], value[IMP_INPUTS_MAX];
        imp__shaped_inputs(b, in, j, own);
        if (!goes_along(b, own, ratio, d)) continue;
        b->ops->eval_d(b, own, d, value);
        for (int i = 0; i < b->n_in; i++) df[i][j] = value[i][j];
    }
}

void imp__shaped_pdf(const struct imp_bsdf *b, const struct imp_carried *carried,
                     const imp_spec *in, const struct imp_dirs *d, imp_spec *p)
{
    const double ratio = drawn_ratio(b, carried, in, d);
    *p = (imp_spec){0};
    for (int j = 0; j < carried->n; j++) {
        imp_spec own[IMP_INPUTS_MAX];
        imp__shaped_inputs(b, in, j, own);
        if (goes_along(b, own, ratio, d)) (*p)[j] = b->ops->pdf(b, own, d);
    }
}

double imp__shaped_index_ratio(const struct imp_bsdf *b,
                               const struct imp_carried *carried, const imp_spec *in,
                               const struct imp_dirs *d)
{
    double sum = 0;
    if (d->lobe != IMP_SMOOTH) return drawn_ratio(b, carried, in, d);
    for (int j = 0; j < carried->n; j++) {
        imp_spec own[IMP_INPUTS_MAX];
        imp__shaped_inputs(b, in, j, own);
        sum += ratio_of(b, own, d);
    }
    return sum / carried->n;
}

void imp__shaped_light(const struct imp_emitter *e, const struct imp_carried *carried,
                       const imp_spec *in, const struct imp_emission *x, imp_spec *le)
{
    *le = (imp_spec){0};
    for (int j = 0; j < carried->n; j++) {
        imp_spec own[IMP_INPUTS_MAX], value;
        lane_inputs(e->input, e->n_in, in, j, own);
        e->ops->eval(e, own, x, &value);
        (*le)[j] = value[j];
    }
}

void imp__shaped_light_d(const struct imp_emitter *e, const struct imp_carried *carried,
                         const imp_spec *in, const struct imp_emission *x, imp_spec *dle)
{
    for (int i = 0; i < e->n_in; i++) dle[i] = (imp_spec){0};
    for (int j = 0; j < carried->n; j++) {
        imp_spec own[IMP_INPUTS_MAX], value[IMP_INPUTS_MAX];
        lane_inputs(e->input, e->n_in, in, j, own);
        e->ops->eval_d(e, own, x, value);
        for (int i = 0; i < e->n_in; i++) dle[i][j] = value[i][j];
    }
}
