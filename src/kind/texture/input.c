/* SPDX-License-Identifier: Apache-2.0
 *
 * What an input is at a point, and the two derivatives of that. A map leads from
 * the numbers of a parameter to the lanes of a walk: with colours lane c is number c, or
 * all lanes are one number; with wavelengths a lane is a weighted sum of neighbouring
 * samples of a spectrum. */
#include "input.h"
#include "base/arguments.h"
#include "color/rgb.h"
#include "color/spectrum.h"
#include "input_parts.h"
#include "kind/shape/shape.h"
#include "math/vec.h"
#include "placed.h"

static void weighted_scatter(struct imp_sink *sink, int param, size_t element,
                             imp_spec bar, const double weight[3])
{
    for (size_t c = 0; c < 3; c++) {
        const imp_spec part = bar * weight[c];
        sink->add(sink, param, element + c, 1, &part);
    }
}

void imp__luminance_scatter(struct imp_sink *sink, int param, size_t element,
                            imp_spec bar)
{
    static const double weight[3] = {IMP_LUM_R, IMP_LUM_G, IMP_LUM_B};
    weighted_scatter(sink, param, element, bar, weight);
}

/* A constant colour read as one number is the mean of its three, as in Mitsuba. */
static const double third[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
static imp_spec mean(double r, double g, double b) { return imp__spec((r + g + b) / 3); }

/* ---- Wavelengths ----------------------------------------------------------------- */

/* Is a colour read as one number? Then it is the number of the mode rgb, whatever
 * walks carry; a scalar input that is a spectrum has a number at each wavelength. */
static bool as_number(const struct imp_input *input, bool scalar)
{
    return scalar && !input->scalar;
}
/* Is it looked up by wavelength? */
static bool by_wavelength(const struct imp_input *input, const struct imp_texcoord *at,
                          bool scalar)
{
    return imp_unlikely(at->carried != NULL) && input->spectrum &&
           !as_number(input, scalar);
}

/* As a colour, though the mode has spectra: luminances are read so, and numbers
 * made of colours. The colour is that of imp__color_preview. */
static bool by_colour(const struct imp_input *input, const struct imp_texcoord *at,
                      bool scalar)
{
    return input->spectrum && input->spectrum->color_d &&
           (!at->carried || as_number(input, scalar));
}

/* ---- Surfaces ---------------------------------------------------------------------- */

/* A shape that is looked up by triangle: uv, triangle and surface from what is known. */
struct site {
    struct imp_texcoord at;
    struct imp_surface surface;
};
static const struct imp_texcoord *site_of(const struct imp_texcoord *at,
                                          struct site *site)
{
    if (imp_likely(!at->shape || !at->shape->by_triangle) || at->surface) return at;
    site->at = *at;
    at->shape->ops->place(at->shape, at->uv, &site->surface, &site->at.prim);
    for (int k = 0; k < 2; k++) site->at.uv[k] = site->surface.uv[k];
    site->at.surface = &site->surface;
    return &site->at;
}

/* ---- One input ------------------------------------------------------------------- */

static void input_eval(const struct imp_input *input, const struct imp_texcoord *at,
                       bool scalar, imp_spec *value)
{
    if (imp_unlikely(input->bump)) {
        *value = imp__bump_at(input, at).normal;
    } else if (imp_unlikely(input->vector) &&
               input->texture) { /* no colour: whatever the walk carries */
        struct imp_texcoord plain = *at;
        plain.carried = NULL;
        input->texture->ops->eval(input->texture, &plain, false, value);
    } else if (input->texture)
        input->texture->ops->eval(input->texture, at, scalar, value);
    else if (by_wavelength(input, at, scalar))
        imp__spectrum_lanes(input->spectrum, at->carried->nm, value);
    else if (scalar && (input->count == 3 || by_colour(input, at, scalar)))
        *value = mean(input->value[0], input->value[1], input->value[2]);
    else *value = input->value;
}

static void input_scatter(const struct imp_input *input, const struct imp_texcoord *at,
                          bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    if (input->bump) return;
    if (input->texture) {
        input->texture->ops->scatter(input->texture, at, scalar, bar, sink);
        if (imp_unlikely(input->texture->placed))
            imp__placed_scatter(input->texture, at, scalar, bar, sink);
    } else if (input->param < 0) return;
    else if (by_wavelength(input, at, scalar))
        imp__input_spectrum_scatter(input, at->carried, bar, sink);
    else if (by_colour(input, at, scalar))
        imp__input_colour_scatter(input, scalar, bar, sink);
    else if (scalar && input->count == 3)
        weighted_scatter(sink, input->param, 0, *bar, third);
    else sink->add(sink, input->param, 0, input->count == 3 ? 3 : 1, bar);
}

static void input_tangent(const struct imp_input *input, const struct imp_texcoord *at,
                          bool scalar, imp_dot_fn *dot, const void *x_dot,
                          imp_spec *value_dot)
{
    if (input->bump) {
        *value_dot = imp__spec(0);
    } else if (input->texture) {
        input->texture->ops->tangent(input->texture, at, scalar, dot, x_dot, value_dot);
        if (imp_unlikely(input->texture->placed))
            imp__placed_tangent(input->texture, at, scalar, dot, x_dot, value_dot);
    } else if (input->param < 0) {
        *value_dot = imp__spec(0);
    } else if (by_wavelength(input, at, scalar)) {
        imp__input_spectrum_tangent(input, at->carried, dot, x_dot, value_dot);
    } else if (by_colour(input, at, scalar)) {
        imp__input_colour_tangent(input, scalar, dot, x_dot, value_dot);
    } else if (input->count != 3) {
        *value_dot = imp__spec(dot(x_dot, input->param, 0));
    } else {
        const double r = dot(x_dot, input->param, 0), g = dot(x_dot, input->param, 1),
                     b = dot(x_dot, input->param, 2);
        *value_dot = scalar ? mean(r, g, b) : (imp_spec){r, g, b, 0};
    }
}

void imp__input_most(const struct imp_input *input, const imp_v3 *lo, const imp_v3 *hi,
                     imp_spec *most)
{
    const struct imp_texcoord at = {.p = (*lo + *hi) * 0.5};
    const struct imp_texture *t = input->texture;
    if (t) t->ops->bound(t, lo, hi, input->scalar, most);
    else if (input->spectrum) *most = imp__spec(imp__spectrum_most(input->spectrum));
    else input_eval(input, &at, input->scalar, most);
}

/* For textures with inputs. */
void imp_input_eval(const struct imp_input *input, const struct imp_texcoord *at,
                    bool scalar, imp_spec *value)
{
    IMP_REQUIRE_OR(NULL, input, "input", );
    IMP_REQUIRE_OR(NULL, at, "at", );
    IMP_REQUIRE_OR(NULL, value, "value", );
    input_eval(input, at, scalar, value);
}

void imp_input_scatter(const struct imp_input *input, const struct imp_texcoord *at,
                       bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    IMP_REQUIRE_OR(NULL, input, "input", );
    IMP_REQUIRE_OR(NULL, at, "at", );
    IMP_REQUIRE_OR(NULL, bar, "bar", );
    IMP_REQUIRE_OR(NULL, sink, "sink", );
    input_scatter(input, at, scalar, bar, sink);
}

void imp_input_tangent(const struct imp_input *input, const struct imp_texcoord *at,
                       bool scalar, imp_dot_fn *dot, const void *x_dot,
                       imp_spec *value_dot)
{
    IMP_REQUIRE_OR(NULL, input, "input", );
    IMP_REQUIRE_OR(NULL, at, "at", );
    IMP_REQUIRE_OR(NULL, dot, "dot", );
    IMP_REQUIRE_OR(NULL, value_dot, "value_dot", );
    input_tangent(input, at, scalar, dot, x_dot, value_dot);
}

/* ---- Luminances of other inputs -------------------------------------------------- */

/* Lanes without a weight do not count, whatever is in them. */
static double weighted(imp_spec weight, imp_spec value)
{
    double sum = 0;
    for (int c = 0; c < 4; c++)
        if (weight[c] != 0) sum += weight[c] * value[c];
    return sum;
}

/* Walks that carry wavelengths look the colour up once more, as a colour. */
static struct imp_texcoord as_colour(const struct imp_texcoord *at)
{
    struct imp_texcoord colour = *at;
    colour.carried = NULL;
    return colour;
}
static double luminance_of(const struct imp_input *colour, imp_spec weight,
                           const struct imp_texcoord *at, imp_spec value)
{
    if (at->carried) {
        const struct imp_texcoord plain = as_colour(at);
        input_eval(colour, &plain, colour->scalar, &value);
    }
    return weighted(weight, value);
}

/* Takes what a colour's numbers get through a luminance: all of it belongs to the lane of
 * the picture whose derivative it is, whichever number it goes to. */
struct one_lane {
    struct imp_sink sink; /* first */
    struct imp_sink *to;
    int lane;
};
static void one_lane_add(struct imp_sink *sink, int param, size_t element, int channels,
                         const imp_spec *bar)
{
    const struct one_lane *o = (const struct one_lane *)sink;
    for (int c = 0; c < channels; c++) {
        imp_spec part = {0};
        part[o->lane] = channels == 3 ? (*bar)[c] : imp__sum3(*bar);
        o->to->add(o->to, param, element + (size_t)c, 1, &part);
    }
}

/* value = weight . colour in every lane, so colour_bar = weight (sum of value_bar). */
static void luminance_scatter(const struct imp_input *colour, imp_spec weight,
                              const struct imp_texcoord *at, const imp_spec *bar,
                              struct imp_sink *sink)
{
    const struct imp_texcoord plain = as_colour(at);
    const int lanes = at->carried ? at->carried->n : 3;
    for (int lane = 0; lane < lanes; lane++) {
        struct one_lane one = {{one_lane_add, sink->apart}, sink, lane};
        if (!at->carried && weight[lane] == 0) continue; /* a lane that is not used */
        const imp_spec part = weight * (*bar)[lane];
        if (part[0] != 0 || part[1] != 0 || part[2] != 0)
            input_scatter(colour, &plain, colour->scalar, &part, &one.sink);
    }
}

/* ---- Components of vectors ------------------------------------------------------- */

/* A component is a number of all lanes, and no lane of a colour: what a texel gets is the sum
 * over the lanes, each of which belongs to its lane of the picture. bar [3]. */
static void vector_scatter(const struct imp_input *vector, imp_spec used,
                           const struct imp_texcoord *at, const imp_spec *bar,
                           struct imp_sink *sink)
{
    const struct imp_texcoord plain = as_colour(at);
    const int lanes = at->carried ? at->carried->n : 4;
    /* As a colour, whose lane c is number c: where lanes are those of three colours. */
    const bool together = !sink->apart && !at->carried && used[1] != 0;
    imp_spec sum = {0};
    for (int lane = 0; lane < lanes; lane++) {
        struct one_lane one = {{one_lane_add, sink->apart}, sink, lane};
        const imp_spec part = {bar[0][lane], bar[1][lane], bar[2][lane], 0};
        if (!at->carried && used[lane] == 0) continue;
        if (together) sum += part;
        else if (part[0] != 0 || part[1] != 0 || part[2] != 0)
            input_scatter(vector, &plain, false, &part, &one.sink);
    }
    if (sum[0] != 0 || sum[1] != 0 || sum[2] != 0)
        input_scatter(vector, &plain, false, &sum, sink);
}

/* Slopes are numbers of one channel, so that lanes stay apart. */
static void bump_scatter(const struct imp_input *bumped, const struct imp_texcoord *at,
                         const imp_spec *bar, struct imp_sink *sink)
{
    const struct imp_texture *t = bumped->texture;
    const struct imp_texcoord plain = as_colour(at);
    const struct imp__bump b = imp__bump_at(bumped, at);
    imp_spec slope_bar[2] = {{0}, {0}};
    if (!b.raised || !t->ops->slope_scatter) return;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++) slope_bar[i] += bar[k] * b.d_uv[i][k];
    t->ops->slope_scatter(t, &plain, true, slope_bar, sink);
}

/* bar [3]: of the components of the vector before them. */
static void components_scatter(const struct imp_input *vector, imp_spec used,
                               const struct imp_texcoord *at, const imp_spec *bar,
                               struct imp_sink *sink)
{
    bool none = true;
    for (int k = 0; k < 3; k++) none &= imp__is_zero_used(bar[k], at->carried);
    if (none) return;
    if (vector->bump) bump_scatter(vector, at, bar, sink);
    else vector_scatter(vector, used, at, bar, sink);
}

static imp_spec vector_tangent(const struct imp_input *vector,
                               const struct imp_texcoord *at, imp_dot_fn *dot,
                               const void *x_dot)
{
    const struct imp_texcoord plain = as_colour(at);
    imp_spec value_dot = {0}, slope_dot[2];
    if (!vector->bump) {
        input_tangent(vector, &plain, false, dot, x_dot, &value_dot);
        return value_dot;
    }
    const struct imp_texture *t = vector->texture;
    const struct imp__bump b = imp__bump_at(vector, at);
    if (!b.raised || !t->ops->slope_tangent) return value_dot;
    t->ops->slope_tangent(t, &plain, true, dot, x_dot, slope_dot);
    return b.d_uv[0] * slope_dot[0][0] + b.d_uv[1] * slope_dot[1][0];
}

/* ---- All inputs of an object ----------------------------------------------------- */

void imp__inputs_look_up(const struct imp_input *const *input, int n,
                         const struct imp_texcoord *at, imp_spec *in)
{
    struct site site;
    at = site_of(at, &site);
    const bool colours = imp_likely(!at->carried);
    for (int j = 0; j < n; j++) {
        const struct imp_input *i = input[j];
        if (imp_likely(i->plain && colours)) in[j] = i->value;
        else if (i->plain && i->spectrum)
            imp__spectrum_lanes(i->spectrum, at->carried->nm, &in[j]);
        else if (i->luminance)
            in[j] = imp__spec(luminance_of(input[j - i->luminance], i->weight, at,
                                           in[j - i->luminance]));
        else if (i->component) in[j] = imp__spec(in[j - i->component][i->component - 1]);
        else input_eval(i, at, i->scalar, &in[j]);
    }
}

void imp__inputs_give_back(const struct imp_input *const *input, int n,
                           const struct imp_texcoord *at, const imp_spec *in_bar,
                           struct imp_sink *sink)
{
    struct site site;
    at = site_of(at, &site);
    const bool colours = imp_likely(!at->carried);
    for (int j = 0; j < n; j++) {
        const struct imp_input *i = input[j];
        if (imp_likely(i->plain && colours)) {
            imp__plain_scatter(i, &in_bar[j], sink);
        } else if (i->luminance) {
            luminance_scatter(input[j - i->luminance], i->weight, at, &in_bar[j], sink);
        } else if (i->component) { /* the three at once */
            if (i->component == 3)
                components_scatter(input[j - 3], i->weight, at, &in_bar[j - 2], sink);
        } else {
            input_scatter(i, at, i->scalar, &in_bar[j], sink);
        }
    }
}

void imp__inputs_tangent(const struct imp_input *const *input, int n,
                         const struct imp_texcoord *at, imp_dot_fn *dot,
                         const void *x_dot, imp_spec *in_dot)
{
    struct site site;
    at = site_of(at, &site);
    for (int j = 0; j < n; j++) {
        const struct imp_input *i = input[j];
        if (imp_unlikely(i->luminance)) {
            imp_spec colour_dot = in_dot[j - i->luminance];
            if (at->carried) {
                const struct imp_texcoord plain = as_colour(at);
                input_tangent(input[j - i->luminance], &plain, false, dot, x_dot,
                              &colour_dot);
            }
            in_dot[j] = imp__spec(weighted(i->weight, colour_dot));
        } else if (imp_unlikely(i->component)) { /* the three at once */
            if (i->component != 1) continue;
            const imp_spec v_dot = vector_tangent(input[j - 1], at, dot, x_dot);
            for (int k = 0; k < 3; k++) in_dot[j + k] = imp__spec(v_dot[k]);
        } else input_tangent(i, at, i->scalar, dot, x_dot, &in_dot[j]);
    }
}
