/* SPDX-License-Identifier: Apache-2.0
 *
 * blendphase: (1 - w) of the first phase function and w of the second. */
#include "kind/build.h"
#include "math/vec.h"

enum { WEIGHT };

static const struct imp_input_desc inputs[] = {
    {.name = "weight",
     .role = IMP_REFLECTANCE,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_REQUIRED | IMP_INPUT_VOLUME,
     .hi = 1,
     .unit = "1"},
    {0}};

static double weight(const imp_spec *in) { return imp_clamp(in[WEIGHT][0], 0.0, 1.0); }

static void sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const double w = weight(in), v = u[0] < w ? u[0] / w : (u[0] - w) / (1 - w);
    const int k = u[0] < w;
    const double rest[3] = {imp_min(v, 0x1.fffffffffffffp-1), u[1], u[2]};
    p->child[k]->ops->sample(p->child[k], in + p->child_in[k], rest, d);
}
static double pdf(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d)
{
    const double w = weight(in);
    double of[2];
    for (int k = 0; k < 2; k++)
        of[k] = p->child[k]->ops->pdf(p->child[k], in + p->child_in[k], d);
    return (1 - w) * of[0] + w * of[1];
}
static void eval(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    const double w = weight(in);
    imp_spec of[2];
    for (int k = 0; k < 2; k++)
        p->child[k]->ops->eval(p->child[k], in + p->child_in[k], d, &of[k]);
    *f = (1 - w) * of[0] + w * of[1];
}
static void eval_d(const struct imp_phase *p, const imp_spec *in,
                   const struct imp_dirs *d, imp_spec *df)
{
    const double w = weight(in);
    imp_spec of[2];
    for (int k = 0; k < 2; k++) {
        const struct imp_phase *c = p->child[k];
        imp_spec *of_child = df + p->child_in[k];
        c->ops->eval(c, in + p->child_in[k], d, &of[k]);
        c->ops->eval_d(c, in + p->child_in[k], d, of_child);
        for (int j = 0; j < c->n_in; j++) of_child[j] *= k ? w : 1 - w;
    }
    df[WEIGHT] = of[1] - of[0];
}

const struct imp_phase_ops imp__blendphase = {.size = sizeof(struct imp_phase_ops),
                                              .name = "blendphase",
                                              .inputs = inputs,
                                              .min_children = 2,
                                              .max_children = 2,
                                              .sample = sample,
                                              .eval = eval,
                                              .pdf = pdf,
                                              .eval_d = eval_d};
