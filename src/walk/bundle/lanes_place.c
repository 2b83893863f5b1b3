/* SPDX-License-Identifier: Apache-2.0
 *
 * Which vertices are made in lanes (lanes_vertex.c), and where they are if their shape or their inputs
 * have no form in lanes. */
#include "lanes_record.h"

/* ---- What is in lanes -------------------------------------------------------------------- */

bool imp__lanes_fit(const struct imp_tracer *t)
{
    const struct imp_walk_integrator *w = t->integrator;
    return !t->scene->timed_lights && w->ends_by == IMP_ENDS_BY_ROULETTE &&
           w->directions && !w->only_points && t->scene->n_groups == 0;
}

bool imp__shape_in_lanes(const struct imp_tracer *tracer, int shape)
{
    const struct imp_shape *s = tracer->scene->shapes[shape];
    const struct imp_bsdf *b = imp__shape_bsdf(tracer->scene, s);
    return s->emitter < 0 && !s->body && !b->shaped &&
           !(b->flags & (IMP_BSDF_EMIT | IMP_BSDF_NULL)) && b->n_in <= IMP_INPUTS_MAX &&
           (tracer->value_only || s->geometry == IMP_TRIANGLES ||
            s->geometry ==
                IMP_ANALYTIC); /* else points are located by what is not in lanes */
}

static bool is_even(const struct imp_bsdf *b, const struct imp_bsdf_lanes *kernel)
{
    return kernel && kernel->even && kernel->even(b);
}
bool imp__shape_is_even(const struct imp_tracer *tracer, int shape)
{
    const struct imp_scene *scene = tracer->scene;
    const struct imp_bsdf *b = imp__shape_bsdf(scene, scene->shapes[shape]);
    return imp__shape_in_lanes(tracer, shape) && is_even(b, imp__bsdf_lanes(b));
}

/* The input, or that of which it is the luminance. */
static const struct imp_input *colour_of(const struct imp_input *const *i)
{
    return i[-(*i)->luminance];
}

/* A texture that is looked up in lanes. */
static bool has_lanes(const struct imp_input *i)
{
    return i->texture && !i->bump && !i->vector && !i->luminance && !i->component &&
           imp__texture_lanes(i->texture);
}

void imp__shape_bin(const struct imp_tracer *tracer, int shape, struct imp_bin *bin)
{
    const struct imp_shape *s = tracer->scene->shapes[shape];
    const struct imp_bsdf *b = imp__shape_bsdf(tracer->scene, s);
    const struct imp_active *active = tracer->active;
    bin->medium = -1;
    bin->sealed = false;
    bin->shape = s;
    bin->bsdf = b;
    bin->surface = imp__shape_lanes(s);
    bin->derivative = active && b->index >= 0 ? active->inputs[b->index] : 0;
    bin->kernel = imp__bsdf_lanes(b);
    bin->even = is_even(b, bin->kernel);
    bin->plain = bin->spectra = true;
    for (int j = 0; j < b->n_in; j++) {
        bin->plain &= colour_of(&b->input[j])->plain;
        bin->spectra &= b->input[j]->plain && b->input[j]->spectrum;
    }
    bin->texels = !bin->plain && bin->surface && !s->by_triangle;
    for (int j = 0; bin->texels && j < b->n_in; j++)
        bin->texels =
            colour_of(&b->input[j])->plain || has_lanes(colour_of(&b->input[j]));
    if (!bin->plain) return;
    const struct imp_texcoord anywhere = {.prim = -1};
    imp_spec own[IMP_INPUTS_MAX];
    imp__inputs_eval(b->input, b->n_in, &anywhere, own);
    for (int j = 0; j < b->n_in; j++)
        if (bin->kernel) bin->in[j] = imp__wide_color(own[j]);
        else bin->each[j] = own[j];
}

/* ---- Where it is ------------------------------------------------------------------------- */

static const struct imp_shape *shape_of(const struct imp_depth *d, int ray)
{
    return d->bundle->tracer->scene->shapes[d->hits->shape[ray]];
}

void imp__lanes_surface(const struct imp_depth *d, const struct imp_wide_hits *h,
                        struct imp_wide_surface *out)
{
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const int i = h->at[k];
        const struct imp_shape *s = shape_of(d, i);
        const struct imp_hit hit = {.shape = s->index,
                                    .prim = h->prim[i],
                                    .t = h->t[i],
                                    .u = h->u[i],
                                    .v = h->v[i]};
        const imp_v3 o = imp__column_v3(h->o, i), d = imp__column_v3(h->d, i);
        struct imp_surface x;
        s->ops->surface(s, &hit, &o, &d, &x);
        imp__wide3_set(&out->p, k, x.p);
        imp__wide3_set(&out->ng, k, x.ng);
        imp__wide3_set(&out->frame.s, k, x.s);
        imp__wide3_set(&out->frame.t, k, x.t);
        imp__wide3_set(&out->frame.n, k, x.n);
        out->uv[0][k] = x.uv[0];
        out->uv[1][k] = x.uv[1];
    }
}

static inline void inputs_of_lane(const struct imp_depth *d, const struct imp_bsdf *b,
                                  const struct imp_wide_hits *h,
                                  const struct imp_lanes_vertices *v, int k,
                                  imp_spec *own)
{
    const struct imp_wide_surface *x = &v->x;
    const struct imp_texcoord at = {
        .uv = {imp__decide1(x->uv[0][k]), imp__decide1(x->uv[1][k])},
        .p = imp__decide(imp__wide3_lane(&x->p, k)),
        .carried = imp__lanes_carried(d->bundle, v, k),
        .shape = shape_of(d, h->at[k]),
        .prim = h->prim[h->at[k]]};
    imp__inputs_eval(b->input, b->n_in, &at, own);
}

/* Inputs that are textures, point by point. */
static void inputs_alone(const struct imp_depth *d, const struct imp_bsdf *b,
                         const struct imp_wide_hits *h,
                         const struct imp_lanes_vertices *v, struct imp_wide_color *in)
{
    imp_spec rows[IMP_INPUTS_MAX][IMP_WIDE_LANES];
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        imp_spec own[IMP_INPUTS_MAX];
        inputs_of_lane(d, b, h, v, k, own);
        for (int j = 0; j < b->n_in; j++) rows[j][k] = own[j];
    }
    for (int j = 0; j < b->n_in; j++) in[j] = imp__color_of_rows(rows[j]);
}

/* weighted of input.c. */
static void luminances(const struct imp_wide_color *colour, imp_spec weight,
                       struct imp_wide_color *out)
{
    imp_wide sum = imp__wide(0);
    for (int c = 0; c < 4; c++)
        if (weight[c] != 0) sum += weight[c] * colour->c[c];
    for (int c = 0; c < 4; c++) out->c[c] = sum;
}

/* Inputs that are constants, textures with a form in lanes, or luminances of such. */
static void inputs_in_lanes(const struct imp_bsdf *b, const struct imp_wide_surface *x,
                            struct imp_wide_color *in)
{
    const imp_wide uv[2] = {imp__wide_decide(x->uv[0]), imp__wide_decide(x->uv[1])};
    for (int j = 0; j < b->n_in; j++) {
        const struct imp_input *i = b->input[j];
        if (i->plain) in[j] = imp__wide_color(i->value);
        else if (i->luminance) luminances(&in[j - i->luminance], i->weight, &in[j]);
        else imp__texture_lanes(i->texture)->eval(i->texture, uv, i->scalar, &in[j]);
    }
}

void imp__lanes_inputs(const struct imp_depth *d, const struct imp_bin *bin,
                       const struct imp_wide_hits *h, const struct imp_lanes_vertices *v,
                       struct imp_wide_color *in)
{
    const struct imp_bsdf *b = bin->bsdf;
    const bool spectral = d->bundle->colors > 3;
    if (!spectral && bin->texels) inputs_in_lanes(b, &v->x, in);
    else if (!spectral || !bin->spectra) inputs_alone(d, b, h, v, in);
    else
        for (int j = 0; j < b->n_in; j++)
            imp__lanes_spectrum(d->bundle, b->input[j]->spectrum, v,
                                imp__bits_first(IMP_WIDE_LANES), &in[j]);
}

void imp__lanes_inputs_each(const struct imp_depth *d, const struct imp_bin *bin,
                            const struct imp_wide_hits *h,
                            const struct imp_lanes_vertices *v, imp_spec *each)
{
    const int n = bin->bsdf->n_in;
    unsigned bits = v->on;
    if (d->bundle->colors == 3 && bin->texels) {
        struct imp_wide_color in[IMP_INPUTS_MAX];
        inputs_in_lanes(bin->bsdf, &v->x, in);
        for (; bits; bits &= bits - 1) {
            const int k = __builtin_ctz(bits);
            for (int j = 0; j < n; j++) each[k * n + j] = imp__color_lane(&in[j], 4, k);
        }
        return;
    }
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        inputs_of_lane(d, bin->bsdf, h, v, k, each + k * n);
    }
}
