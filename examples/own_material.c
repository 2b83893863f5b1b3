/* SPDX-License-Identifier: Apache-2.0
 *
 * own_material: a material that the library does not have, written in the host program.
 *
 * Minnaert's law for dusty surfaces (Minnaert 1941), front only:
 *
 *     f cos_i = rho (k + 1)/(2 pi) (cos_i cos_o)^(k-1) cos_i
 *
 * Under the same light from everywhere, a plate of it reflects rho cos_o^(k-1) times
 * that light: the program prints the mean of a picture and this number.
 *
 *     cc own_material.c $(pkg-config --cflags --libs importon) -lm
 */
#include <importon/lobes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { RHO, K }; /* places in `in` */

static const struct imp_input_desc inputs[] = {{.name = "reflectance",
                                                .role = IMP_REFLECTANCE,
                                                .fallback = 0.5,
                                                .hi = 1,
                                                .unit = "1"},
                                               {.name = "darkening",
                                                .role = IMP_UNBOUNDED,
                                                .flags = IMP_INPUT_SCALAR,
                                                .fallback = 1.2,
                                                .lo = 1,
                                                .hi = 4,
                                                .unit = "1"},
                                               {0}};

static const double pi = 3.14159265358979323846;

/* All of the value but rho. */
static double lobe(const imp_spec *in, const struct imp_dirs *d)
{
    const double k = in[K][0], cos_i = d->wi[2], cos_o = d->wo[2];
    if (!(cos_i > 0 && cos_o > 0)) return 0;
    return (k + 1) / (2 * pi) * pow(cos_i * cos_o, k - 1) * cos_i;
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = in[RHO] * lobe(in, d);
}

/* Directions are drawn by the cosine, a lobe of exponent 1 about the normal. */
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b, (void)in;
    return d->wo[2] > 0 ? imp_lobe_pdf(1, d->wi[2]) : 0;
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b, (void)in;
    const imp_v3 normal = {0, 0, 1};
    imp_lobe_sample(&normal, 1, u + 1, &d->wi);
    d->lobe = IMP_SMOOTH;
    return d->wo[2] > 0 && d->wi[2] > 0;
}

/* d ln lobe/dk = 1/(k + 1) + ln(cos_i cos_o). */
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b;
    const double l = lobe(in, d);
    imp_spec_fill(&df[RHO], l);
    imp_spec_fill(&df[K], 0);
    if (l > 0) df[K] = in[RHO] * (l * (1 / (in[K][0] + 1) + log(d->wi[2] * d->wo[2])));
}

static const struct imp_bsdf_ops minnaert = {.size = sizeof(struct imp_bsdf_ops),
                                             .name = "minnaert",
                                             .inputs = inputs,
                                             .sample = sample,
                                             .eval = eval,
                                             .pdf = pdf,
                                             .eval_d = eval_d};

/* The camera looks down at 60 degrees from the normal. */
static const char plate[] =
    "<scene version='3.0.0'><integrator type='direct'/>"
    "<sensor type='orthographic'><transform name='to_world'>"
    "<scale value='0.1'/><lookat origin='3.4641016151377544,0,2' target='0,0,0' "
    "up='0,0,1'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='4'/>"
    "<integer name='height' value='4'/><rfilter type='box'/></film>"
    "<sampler type='independent'><integer name='sample_count' value='1024'/></sampler>"
    "</sensor>"
    "<shape type='rectangle'><bsdf type='minnaert' id='dust'>"
    "<float name='reflectance' value='0.8'/><float name='darkening' value='2'/>"
    "</bsdf></shape>"
    "<emitter type='constant'><float name='radiance' value='1'/></emitter></scene>";

int main(void)
{
    imp_context *context = NULL;
    imp_scene *scene = NULL;
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    double mean = 0;

    enum imp_status st = imp_context_create(NULL, &context);
    if (st == IMP_OK) st = imp_register_bsdf(context, &minnaert);
    if (st == IMP_OK)
        st = imp_scene_load_string(context, plate, strlen(plate), "plate", NULL, &scene);
    if (st == IMP_OK) st = imp_render(scene, &run, &film);
    if (st == IMP_OK) {
        const float *pixel = imp_film_mean(film);
        for (int i = 0; i < 16; i++) mean += (double)pixel[3 * i] / 16;
        printf("mean %.4f, closed form %.4f\n", mean, 0.8 * pow(0.5, 2 - 1));
    } else {
        fprintf(stderr, "%s\n", imp_last_error(context));
    }
    imp_film_destroy(film);
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    return st != IMP_OK || fabs(mean - 0.4) > 0.01;
}
