/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures by light walks, and from both ends, against those of walks
 * from the sensor pixel by pixel; the picture along a direction against the sum of all; and
 * sums over pictures, whose errors are those of seeds. */
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/stat.h"
#include <stdbool.h>

static imp_context *ctx;

/* clang-format off */
#define RGB(name, c) "<rgb name='" name "' value='" c "'/>"
static const char room[] =
    "<scene version='3.0.0'><integrator type='bdpt'><integer name='max_depth' value='5'/>"
    "</integrator><shape type='cube'>" AT("<scale value='2'/>")
    "<boolean name='flip_normals' value='true'/><bsdf type='diffuse' id='wall'>"
    RGB("reflectance", ".6,.5,.4") "</bsdf></shape><shape type='rectangle'>"
    AT("<scale value='.6'/><rotate x='1' angle='90'/><translate y='1.95'/>")
    "<emitter type='area' id='lamp'>" RGB("radiance", "5,4,3") "</emitter></shape>"
    BALL("-.8,-.9,-.5", "<bsdf type='roughconductor' id='metal'><float name='alpha' "
                        "value='.3'/></bsdf>") "%s"
    "<sensor type='perspective'><float name='fov' value='80'/>"
    AT("<lookat origin='0,0,1.9' target='0,-.2,0' up='0,1,0'/>")
    "<film type='hdrfilm'><integer name='width' value='5'/><integer name='height' "
    "value='4'/><rfilter type='%s'/></film></sensor></scene>";
static const char meter[] =
    "<scene version='3.0.0'><integrator type='bdpt'><integer name='max_depth' value='4'/>"
    "</integrator><shape type='cube'>" AT("<scale value='2'/>")
    "<boolean name='flip_normals' value='true'/><bsdf type='diffuse' id='wall'>"
    RGB("reflectance", ".6,.5,.4") "</bsdf></shape><shape type='sphere'><point "
    "name='center' value='.5,.9,0'/><float name='radius' value='.3'/><emitter type='area' "
    "id='lamp'>" RGB("radiance", "5,4,3") "</emitter></shape>%s<shape type='rectangle'>"
    AT("<scale value='.8'/><rotate x='1' angle='-90'/><translate y='-1.9'/>")
    "<sensor type='irradiancemeter'><film type='hdrfilm'><integer name='width' value='3'/>"
    "<integer name='height' value='2'/><rfilter type='%s'/></film></sensor></shape></scene>";
/* clang-format on */

#define MANY 48
static const enum imp_from end[] = {IMP_FROM_SENSOR, IMP_FROM_LIGHTS, IMP_FROM_SCENE};
static const char *const end_name[] = {"the sensor", "the lights", "both ends"};

/* Chance alone exceeds each bound in one of 10^5 tests. */
#define CHANCE 1e-5
static double square_sum_limit(double n, double chance)
{
    double lo = 0, hi = 10 * n + 100;
    for (int i = 0; i < 60; i++) {
        const double middle = (lo + hi) / 2;
        *(imp__chi2_tail(middle, n) > chance ? &lo : &hi) = middle;
    }
    return lo;
}

static struct imp_run run_of(int from, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    run.from = end[from];
    run.spp = spp;
    run.seed = seed;
    run.points = IMP_POINTS_INDEPENDENT;
    return run;
}

static size_t values_of(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    return (size_t)info.width * (size_t)info.height * (size_t)info.channels;
}

struct pictures {
    imp_film *film[MANY + 1]; /* the picture, then its derivatives */
    size_t n;
};

static struct pictures pictures_of(imp_problem *p, int from, int spp, uint64_t seed)
{
    struct pictures out = {.n = imp_problem_n_variables(p)};
    const struct imp_run run = run_of(from, spp, seed);
    test_must(ctx, imp_problem_jacobian(p, &run, &out.film[0], out.film + 1));
    return out;
}
static void pictures_free(struct pictures *all)
{
    for (size_t k = 0; k <= all->n; k++) imp_film_destroy(all->film[k]);
}

/* Filters make neighbours depend on each other: z^2 of a film is summed as of one number in
 * 9 pixels then. Channels of a pixel share their walks. */
static void same(const char *what, const struct pictures *a, const struct pictures *b,
                 bool wide, int channels)
{
    double worst = 0, worst_square = 0;
    size_t counted = 0;
    for (size_t k = 0; k <= a->n; k++) {
        const float *x = imp_film_mean(a->film[k]), *y = imp_film_mean(b->film[k]);
        const float *sx = imp_film_se(a->film[k]), *sy = imp_film_se(b->film[k]);
        double square = 0, n = 0;
        for (size_t i = 0; i < values_of(a->film[k]); i++) {
            const double se = hypot((double)sx[i], (double)sy[i]);
            const double d = (double)x[i] - (double)y[i];
            if (se == 0 && d == 0) continue;
            worst = fmax(worst, fabs(d) / se);
            square += d * d / (se * se);
            n++;
        }
        if (n == 0) continue;
        counted += (size_t)n;
        const double apart = fmax(n / channels / (wide ? 9 : 1), 1);
        worst_square =
            fmax(worst_square, square / n / (square_sum_limit(apart, CHANCE) / apart));
    }
    tap_ok(worst < sqrt(square_sum_limit(1, CHANCE / (double)counted)) &&
               worst_square < 1 && counted > 0,
           "%s # %zu values, worst z %.2f, mean z^2 %.2f of its limit", what, counted,
           worst, worst_square);
}

/* A film's sum and its error, as a functional tells them. */
static void sums(const char *what, imp_problem *p, int from, int spp)
{
    const struct imp_run run = run_of(from, spp, 77);
    struct pictures own = pictures_of(p, from, spp, 77);
    struct imp_estimate value, each[MANY], F;
    double g[MANY], se[MANY], worst = 0, worst_se = 0, z = 0;
    test_must(ctx, imp_problem_jacobian_sums(p, NULL, &run, own.film[0], own.film + 1,
                                             NULL, 0, &value, each));
    const struct imp_run other = run_of(from, 4 * spp, 78);
    test_must(ctx, imp_problem_functional(p, NULL, &other, &F, g, se));
    for (size_t k = 0; k < own.n; k++) {
        double sum = 0;
        const size_t n = values_of(own.film[k + 1]);
        for (size_t i = 0; i < n; i++)
            sum += (double)imp_film_mean(own.film[k + 1])[i] / (double)n;
        worst = fmax(worst, fabs(sum - each[k].value) / (1e-12 + fabs(sum)));
        if (!(se[k] > 0)) continue;
        worst_se = fmax(worst_se, fabs(log(each[k].se / (2 * se[k]))));
        z = fmax(z, fabs(each[k].value - g[k]) / hypot(each[k].se, se[k]));
    }
    /* An error from 64 groups of walks and more is known to some 15 %; of one in 10^4, with
     * tails that are not normal: a factor of 2. */
    tap_ok(worst < 1e-6 && worst_se < log(2) && z < 4.5 &&
               fabs(log(value.se / (2 * F.se))) < log(2),
           "%s: %zu sums over pictures, their errors within exp %.2f of the gradient's # "
           "z %.2f",
           what, own.n, worst_se, z);
    pictures_free(&own);
}

/* J x_dot is the sum of the derivative pictures of the same walks. */
static void forward(const char *what, imp_problem *p, int from, int spp)
{
    const struct imp_run run = run_of(from, spp, 5);
    struct pictures all = pictures_of(p, from, spp, 5);
    double x_dot[MANY], worst = 0, size = 0;
    imp_film *film;
    for (size_t k = 0; k < all.n; k++) x_dot[k] = cos(1 + (double)k);
    test_must(ctx, imp_problem_forward(p, x_dot, &run, &film));
    for (size_t i = 0; i < values_of(film); i++) {
        double sum = 0;
        for (size_t k = 0; k < all.n; k++)
            sum += x_dot[k] * (double)imp_film_mean(all.film[k + 1])[i];
        worst = fmax(worst, fabs(sum - (double)imp_film_mean(film)[i]));
        size = fmax(size, fabs(sum));
    }
    /* Films hold floats: eps of each of the n terms. */
    tap_ok(worst < (double)all.n * 1.2e-7 * size && size > 0,
           "%s: the picture along a direction # off by %.1e of %.2g", what, worst, size);
    imp_film_destroy(film);
    pictures_free(&all);
}

static void check(const char *name, const char *xml, const char *more, const char *filter,
                  enum imp_color_mode mode, int spp)
{
    char text[8192], what[160];
    snprintf(text, sizeof text, xml, more, filter);
    imp_scene *scene = test_scene_text(ctx, text, mode);
    imp_problem *p = test_problem(ctx, scene, "*");
    const int channels = mode == IMP_MONO ? 1 : 3;
    if (imp_problem_n_variables(p) > MANY) {
        tap_ok(0, "%s: %zu numbers are too many here", name, imp_problem_n_variables(p));
        return;
    }
    struct pictures eye = pictures_of(p, 0, spp, 1);
    for (int from = 1; from < 3; from++) {
        struct pictures other = pictures_of(p, from, spp, 2);
        snprintf(what, sizeof what, "%s: by walks from %s", name, end_name[from]);
        same(what, &eye, &other, strcmp(filter, "box") != 0, channels);
        forward(what, p, from, 16);
        sums(what, p, from, 256);
        pictures_free(&other);
    }
    pictures_free(&eye);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(2);
    check("a room", room, "", "box", IMP_MONO, 1000);
    check("with fog, through a filter", room, FOG, "gaussian", IMP_RGB, 500);
    check("of four wavelengths", room, "", "tent", IMP_SPECTRAL, 500);
    check("a meter", meter, BALL("0,-.5,0", "<bsdf type='dielectric'/>"), "box", IMP_RGB,
          2000);
    imp_context_destroy(ctx);
    return tap_done();
}
