/* SPDX-License-Identifier: Apache-2.0
 *
 * twosided: seen from behind, the second child (or the only one) is turned over: the
 * mirror z -> -z is applied to both directions. */
#include "blending.h"
#include "bsdf_lanes.h"
#include "kind/build.h"

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    enum imp_status st = IMP_OK;
    bool allow;
    (void)self;
    IMP_TRY(imp_build_bool(build, "allow_transmission", false, &allow));
    b->flags = 0;
    b->absorb = 0;
    b->straight = ~UINT64_C(0);
    for (int k = 0; k < b->n_child; k++) {
        b->flags |= b->child[k]->flags;
        b->straight &= b->child[k]->straight;
        b->n_lobes = imp_max(b->n_lobes, imp__lobes_of(b->child[k]));
        b->absorb = imp_max(b->absorb, b->child[k]->absorb);
    }
    if ((b->flags & IMP_BSDF_TRANSMIT) && !allow)
        IMP_TRY(imp_build_error(build, NULL, IMP_E_SCENE,
                                "the nested material transmits light; set "
                                "'allow_transmission' if that is meant"));
out:
    return st;
}

static imp_v3 flip(imp_v3 w, bool back) { return back ? imp__v3(w[0], w[1], -w[2]) : w; }

/* The child that answers, where its inputs are, and the directions as it sees them. */
static const struct imp_bsdf *side(const struct imp_bsdf *b, const imp_v3 *wo, bool *back,
                                   int *first)
{
    *back = (*wo)[2] < 0;
    const int k = *back ? b->n_child - 1 : 0;
    *first = b->child_in[k];
    return b->child[k];
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    struct imp_dirs e = {flip(d->wo, back), d->wi, d->lobe,
                         imp_wanted_of_child(d->derivative, first)};
    if (!c->ops->sample(c, in + first, u, &e)) return false;
    d->wi = flip(e.wi, back);
    d->lobe = e.lobe;
    return true;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    const struct imp_dirs e = {flip(d->wo, back), flip(d->wi, back), d->lobe, 0};
    c->ops->eval(c, in + first, &e, f);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    const struct imp_dirs e = {flip(d->wo, back), flip(d->wi, back), d->lobe,
                               imp_wanted_of_child(d->derivative, first)};
    return c->ops->pdf(c, in + first, &e);
}
static double pdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    const struct imp_dirs e = {flip(d->wo, back), flip(d->wi, back), d->lobe,
                               imp_wanted_of_child(d->derivative, first)};
    return imp__bsdf_pdf_eval(c, in + first, &e, f);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    const struct imp_dirs e = {flip(d->wo, back), flip(d->wi, back), d->lobe, 0};
    for (int j = 0; j < b->n_in; j++) df[j] = imp__spec(0);
    c->ops->eval_d(c, in + first, &e, df + first);
}
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    const struct imp_dirs e = {flip(d->wo, back), flip(d->wi, back), d->lobe, 0};
    c->ops->eval_directions_d(c, in + first, &e, d_wo, d_wi);
    if (!back) return;
    d_wo[2] = -d_wo[2];
    d_wi[2] = -d_wi[2];
}
static void emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, wo, &back, &first);
    const imp_v3 w = flip(*wo, back);
    *e = imp__spec(0);
    if (c->flags & IMP_BSDF_EMIT) c->ops->emit(c, in + first, &w, e);
}
static void emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, wo, &back, &first);
    const imp_v3 w = flip(*wo, back);
    for (int j = 0; j < b->n_in; j++) de[j] = imp__spec(0);
    if (c->flags & IMP_BSDF_EMIT) c->ops->emit_d(c, in + first, &w, de + first);
}
static bool sample_d(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                     const struct imp_dirs *d, int j, imp_spec *dweight, imp_v3 *dwi)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, &d->wo, &back, &first);
    const struct imp_dirs e = {flip(d->wo, back), flip(d->wi, back), d->lobe, 0};
    if (!c->ops->sample_d || j < first || j >= first + c->n_in) return false;
    if (!c->ops->sample_d(c, in + first, u, &e, j - first, dweight, dwi)) return false;
    *dwi = flip(*dwi, back);
    return true;
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, wo, &back, &first);
    const imp_v3 w = flip(*wo, back);
    imp__bsdf_albedo(c, in + first, &w, rho);
}

static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *rho)
{
    bool back;
    int first;
    const struct imp_bsdf *c = side(b, wo, &back, &first);
    const imp_v3 w = flip(*wo, back);
    return c->ops->directional_albedo &&
           c->ops->directional_albedo(c, in + first, &w, rho);
}

static const struct imp_input_desc inputs[] = {{0}};

const struct imp_bsdf_ops imp__twosided = {.size = sizeof(struct imp_bsdf_ops),
                                           .name = "twosided",
                                           .inputs = inputs,
                                           .min_children = 1,
                                           .max_children = 2,
                                           .child_name = "brdf",
                                           .build = build,
                                           .sample = sample,
                                           .eval = eval,
                                           .pdf = pdf,
                                           .eval_d = eval_d,
                                           .emit = emit,
                                           .emit_d = emit_d,
                                           .sample_d = sample_d,
                                           .albedo = albedo,
                                           .directional_albedo = directional_albedo,
                                           .pdf_eval = pdf_eval,
                                           .eval_directions_d = eval_directions_d};

/* ---- In lanes ---------------------------------------------------------------------------- */

static bool covers(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_child; k++)
        if (!imp__bsdf_lanes(b->child[k])) return false;
    return true;
}

static imp_wide3 flips(const imp_wide3 *w, imp_wide_truth back)
{
    return (imp_wide3){w->x, w->y, imp__wide_choose(back, -w->z, w->z)};
}

/* Child k answers in some lane: the last one from behind, the first in front; an only child in
 * all. */
static bool is_asked(const struct imp_bsdf *b, int k, imp_wide_truth back)
{
    const unsigned bits = imp__wide_bits(back);
    return b->n_child == 1 ||
           (k > 0 ? bits != 0 : bits != imp__bits_first(IMP_WIDE_LANES));
}

static imp_wide_truth sample_lanes(const struct imp_bsdf *b, uint64_t derivative,
                                   const struct imp_wide_color *in, const imp_wide3 *wo,
                                   const imp_wide u[3], imp_wide3 *wi,
                                   imp_wide_lobe *lobe)
{
    const imp_wide_truth back = wo->z < imp__wide(0);
    const imp_wide3 seen = flips(wo, back);
    imp_wide_truth drawn = {0};
    for (int k = 0; k < b->n_child; k++) {
        const struct imp_bsdf *c = b->child[k];
        imp_wide3 own;
        imp_wide_lobe way = imp__wide_smooth();
        if (!is_asked(b, k, back)) continue;
        const imp_wide_truth some = imp__bsdf_lanes(c)->sample(
                                 c, imp_wanted_of_child(derivative, b->child_in[k]),
                                 in + b->child_in[k], &seen, u, &own, &way),
                             here = k > 0 ? back : ~(imp_wide_truth){0};
        own = flips(&own, back);
        *lobe = (*lobe & ~here) | (way & here);
        *wi = imp__wide3_choose(here, own, *wi);
        drawn = (drawn & ~here) | (some & here);
    }
    return drawn;
}

static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,
                               const struct imp_wide_color *in, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                               struct imp_wide_color *f)
{
    const imp_wide_truth back = wo->z < imp__wide(0);
    const imp_wide3 o = flips(wo, back), i = flips(wi, back);
    imp_wide pdf = imp__wide(0);
    for (int k = 0; k < b->n_child; k++) {
        const struct imp_bsdf *c = b->child[k];
        struct imp_wide_color own;
        if (!is_asked(b, k, back)) continue;
        const imp_wide p = imp__bsdf_lanes(c)->pdf_eval(
            c, imp_wanted_of_child(derivative, b->child_in[k]), in + b->child_in[k], &o,
            &i, lobe, colors, &own);
        const imp_wide_truth here = k > 0 ? back : ~(imp_wide_truth){0};
        pdf = imp__wide_choose(here, p, pdf);
        for (int j = 0; j < colors; j++)
            f->c[j] = imp__wide_choose(here, own.c[j], f->c[j]);
    }
    return pdf;
}

static bool eval_d_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in,
                         const imp_wide3 *wo, const imp_wide3 *wi,
                         const imp_wide_lobe *lobe, int colors, struct imp_wide_color *d)
{
    const imp_wide zero = imp__wide(0);
    const imp_wide_truth back = wo->z < zero;
    const imp_wide3 o = flips(wo, back), i = flips(wi, back);
    for (int k = 0; k < b->n_child; k++) {
        const struct imp_bsdf *c = b->child[k];
        const struct imp_bsdf_lanes *lanes = imp__bsdf_lanes(c);
        struct imp_wide_color *own = d + b->child_in[k];
        const imp_wide_truth all = ~(imp_wide_truth){0}, here = b->n_child == 1 ? all
                                                                : k > 0         ? back
                                                                                : ~back;
        if (!lanes->eval_d ||
            !lanes->eval_d(c, in + b->child_in[k], &o, &i, lobe, colors, own))
            return false;
        for (int j = 0; b->n_child > 1 && j < c->n_in; j++)
            for (int m = 0; m < colors; m++)
                own[j].c[m] = imp__wide_choose(here, own[j].c[m], zero);
    }
    return true;
}

static bool even(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_child; k++) {
        const struct imp_bsdf_lanes *child = imp__bsdf_lanes(b->child[k]);
        if (!child || !child->even || !child->even(b->child[k])) return false;
    }
    return true;
}

const struct imp_bsdf_lanes imp__twosided_lanes = {.covers = covers,
                                                   .sample = sample_lanes,
                                                   .pdf_eval = pdf_eval_lanes,
                                                   .eval_d = eval_d_lanes,
                                                   .even = even};
