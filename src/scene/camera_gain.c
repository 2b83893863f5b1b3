/* SPDX-License-Identifier: Apache-2.0
 *
 * The factors g_c and T^(1 - gamma) of camera_gain.h, with derivatives with respect to exposure,
 * white balance, vignetting and gamma; their inputs in a film. */
#include "camera_gain.h"
#include "base/arguments.h"
#include "scene_build.h"
#include <math.h>
#include <string.h>

static const struct imp_input_desc inputs[IMP_GAIN_INPUTS + 1] = {
    {"exposure", IMP_REFLECTANCE,
     IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL, 1, 0, 0, "1"},
    {"white_balance_red", IMP_REFLECTANCE,
     IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL, 1, 0, 0, "1"},
    {"white_balance_blue", IMP_REFLECTANCE,
     IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL, 1, 0, 0, "1"},
    {"vignetting_2", IMP_REFLECTANCE,
     IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL, 0, -1, 1, "1"},
    {"vignetting_4", IMP_REFLECTANCE,
     IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL, 0, -1, 1, "1"},
    {"gamma", IMP_REFLECTANCE, IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_OPTIONAL,
     1, 0.2, 5, "1"},
    {0}};

bool imp__gain_written(const struct imp_node *film)
{
    for (int k = 0; k < IMP_GAIN_INPUTS; k++)
        if (imp__node_prop(film, inputs[k].name)) return true;
    return false;
}

enum imp_status imp__build_gain(struct imp_scene *scene, struct imp_node *film,
                                const char *name, struct imp_camera_gain **out)
{
    bool written[IMP_GAIN_INPUTS], any = false;
    const struct imp_input *in[IMP_INPUTS_MAX];
    int n = 0;
    for (int k = 0; k < IMP_GAIN_INPUTS; k++) {
        imp__node_ask(film,
                      inputs[k].name); /* also where none is written: for messages */
        any |= written[k] = imp__node_prop(film, inputs[k].name) != NULL;
    }
    if (!any) return IMP_OK;
    struct imp_camera_gain *g = imp__arena_array(&scene->arena, 1, sizeof *g);
    if (!g) return imp__build_no_memory(scene);
    IMP_CHECKED(imp__build_inputs(scene, film, name, inputs, in, &n));
    memcpy(g->input, in, sizeof g->input);
    g->fitted_gamma = written[IMP_GAIN_GAMMA];
    *out = g;
    return IMP_OK;
}

enum imp_status imp__gain_fit(struct imp_scene *scene, struct imp_node *film,
                              const struct imp_film_desc *desc, struct imp_camera_gain *g)
{
    if (!g) return IMP_OK;
    const struct imp_prop *red = imp__node_prop(film, "white_balance_red");
    const struct imp_prop *balance =
        red ? red : imp__node_prop(film, "white_balance_blue");
    if (balance && (scene->channels != 3 || desc->n_responses > 0))
        return imp__prop_error(scene->ctx, film, balance, IMP_E_UNSUPPORTED,
                               "%s needs a film with red, green and blue", balance->name);
    if (g->fitted_gamma && desc->filter.radius > 0.5)
        return imp__prop_error(scene->ctx, film, imp__node_prop(film, "gamma"),
                               IMP_E_UNSUPPORTED,
                               "gamma needs a box filter of one pixel: a wider one mixes "
                               "pixels before the power law");
    g->middle[0] = 0.5 * desc->width;
    g->middle[1] = 0.5 * desc->height;
    g->per_half_diagonal = 1 / hypot(g->middle[0], g->middle[1]);
    return IMP_OK;
}

/* The channels of a pixel; NULL outside, and without a photograph. */
static const float *pixel_of(const struct imp_photograph *photo, double px, double py)
{
    if (!photo) return NULL;
    const int x = (int)floor(px) - photo->x, y = (int)floor(py) - photo->y;
    if (x < 0 || y < 0 || x >= photo->width || y >= photo->height) return NULL;
    return photo->pixels +
           ((size_t)y * (size_t)photo->width + (size_t)x) * (size_t)photo->channels;
}

/* T^(1 - gamma), of one that belongs to a gamma `at` times at/gamma, and its derivative with
 * respect to gamma. */
static imp_spec developed(const struct imp_photograph *photo, double gamma, double px,
                          double py, imp_spec *d)
{
    imp_spec factor = imp__spec(1);
    *d = imp__spec(0);
    const float *T = pixel_of(photo, px, py);
    if (!T) return factor;
    const double scale = photo->at > 0 ? photo->at / gamma : 1;
    const double slope = photo->at > 0 ? -1 / gamma : 0; /* of log scale */
    for (int c = 0; c < 4; c++) {
        const double t = T[imp_min(c, photo->channels - 1)];
        factor[c] = t >= IMP_PHOTOGRAPH_LEAST ? scale * pow(t, 1 - gamma) : 0;
        (*d)[c] = t >= IMP_PHOTOGRAPH_LEAST ? (slope - log(t)) * factor[c] : 0;
    }
    return factor;
}

imp_spec imp__gain_offset(const struct imp_camera_gain *g,
                          const struct imp_photograph *photo, double px, double py,
                          imp_spec *d)
{
    const double gamma = g->input[IMP_GAIN_GAMMA]->value[0];
    const float *V = photo && photo->at > 0 ? pixel_of(photo, px, py) : NULL;
    imp_spec offset = {0};
    if (d) *d = (imp_spec){0};
    for (int c = 0; V && c < 3; c++) {
        const double v = V[imp_min(c, photo->channels - 1)];
        if (v < IMP_PHOTOGRAPH_LEAST) continue;
        offset[c] = v * (1 - photo->at / gamma);
        if (d) (*d)[c] = v * photo->at / (gamma * gamma);
    }
    return offset;
}

imp_spec imp__gain_at(const struct imp_camera_gain *g, const struct imp_photograph *photo,
                      double px, double py, imp_spec *d)
{
    double v[IMP_GAIN_INPUTS];
    for (int k = 0; k < IMP_GAIN_INPUTS; k++) v[k] = g->input[k]->value[0];
    const double x = (px - g->middle[0]) * g->per_half_diagonal,
                 y = (py - g->middle[1]) * g->per_half_diagonal, r2 = x * x + y * y;
    /* Where the polynomial is below 0 no light arrives. */
    const double fall =
        1 + v[IMP_GAIN_VIGNETTING_2] * r2 + v[IMP_GAIN_VIGNETTING_4] * r2 * r2;
    const bool dark = fall < 0;
    const double lens = dark ? 0 : fall;
    const double exposure = v[IMP_GAIN_EXPOSURE];
    const imp_spec balance = {v[IMP_GAIN_RED], 1, v[IMP_GAIN_BLUE], 1};
    imp_spec by_gamma;
    const imp_spec power =
        developed(g->fitted_gamma ? photo : NULL, v[IMP_GAIN_GAMMA], px, py, &by_gamma);
    const imp_spec rest = balance * power;
    if (d) {
        d[IMP_GAIN_EXPOSURE] = rest * lens;
        d[IMP_GAIN_RED] = (imp_spec){power[0] * exposure * lens};
        d[IMP_GAIN_BLUE] = (imp_spec){0, 0, power[2] * exposure * lens};
        d[IMP_GAIN_VIGNETTING_2] = rest * (dark ? 0 : exposure * r2);
        d[IMP_GAIN_VIGNETTING_4] = rest * (dark ? 0 : exposure * r2 * r2);
        d[IMP_GAIN_GAMMA] = balance * by_gamma * (exposure * lens);
    }
    return rest * (exposure * lens);
}
