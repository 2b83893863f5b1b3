/* SPDX-License-Identifier: Apache-2.0
 *
 * The baseline that derivatives by extinction take from the light that arrives: it changes
 * no mean, also of walks that leave the scene and bring nothing; where all light is alike
 * it leaves no noise at all, and where fog only absorbs, the noise that theory says. */
#include "media_kit.h"

static imp_context *ctx;

static void derivative(const char *text, const char *name, int spp, uint64_t seed,
                       double *g, double *se)
{
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    imp_problem *p = test_problem(ctx, s, name);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, se));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

#define CAMERA                                                                           \
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.5'/>"        \
    "<translate z='-3'/></transform><film type='hdrfilm'><integer name='width' "         \
    "value='64'/><integer name='height' value='64'/><rfilter type='box'/></film>"        \
    "</sensor>"
#define FOG(albedo)                                                                      \
    "<shape type='cube'><bsdf type='null'/><medium type='homogeneous' id='fog' "         \
    "name='interior'><float name='sigma_t' value='1.5'/><float name='albedo' "           \
    "value='" albedo "'/></medium></shape>"
#define SKY "<emitter type='constant'/></scene>"

/* The cube has a side of 2, and the camera sees its middle. */
static void lamp_behind(void)
{
    double g, se;
    derivative(
        "<scene version='3.0.0'><integrator type='volpath'/>" CAMERA FOG(
            "0") "<shape type='rectangle'><transform name='to_world'><rotate y='1' "
                 "angle='180'/><scale x='0.5'/><translate x='0.5' z='4'/></transform>"
                 "<emitter type='area'><float name='radiance' value='8'/></emitter>"
                 "</shape></scene>",
        "fog.sigma_t.value", 64, 5, &g, &se);
    media_near(g, se, -.5 * 8 * 2 * exp(-3), .02,
               "a lamp behind half of what absorbs, nothing behind the other half");
}

/* Without connections every walk brings 1, and so does b: no derivative of a walk is left
 * but the rounding of decisions, which are floats. */
static void furnace(void)
{
    const char *white =
        "<scene version='3.0.0'><integrator type='photons'>"
        "<string name='weights' value='kernel=1'/></integrator>" CAMERA FOG("1") SKY;
    double g, se;
    derivative(white, "fog.sigma_t.value", 4, 7, &g, &se);
    tap_ok(fabs(g) <= 1e-6 && se <= 1e-6,
           "what absorbs nothing under a uniform sky has no noise # %.2g se %.2g", g, se);
}

/* Fog that absorbs under a sky of 1. With s = -D where light passes, of probability T =
 * exp(-sigma D), and 1/sigma - t where it collides at t, a walk's derivative is (L - b) s, L
 * = 1 or 0, and
 *
 *     E[s^2] = (1 - T)/sigma^2,    V(b) = D^2 T (1 - 2 b) + b^2 E[s^2] - (D T)^2
 *
 * b = E[s^2 L]/E[s^2] is estimated from 256 walks, with which V rises by V_b E[s^2] in the mean,
 * V_b = E[s^4 (L - b)^2]/(256 E[s^2]^2) < .006. The squared error told is a mean of squares of n
 * = 16,384 walks, whose relative error is sqrt((k - 1)/n), k = E[(L - b)^4 s^4]/V^2 < 8:
 * .021. */
static void absorbs(void)
{
    const double D = 2, sigma = 1.5, T = exp(-sigma * D), s2 = (1 - T) / (sigma * sigma),
                 b = D * D * T / s2, none = D * D * T - D * D * T * T,
                 V = none - 2 * b * D * D * T + b * b * s2;
    const int n = 64 * 64 * 4;
    double g, se;
    derivative("<scene version='3.0.0'><integrator type='volpath'/>" CAMERA FOG("0") SKY,
               "fog.sigma_t.value", 4, 7, &g, &se);
    media_near(g, se, -D * T, .01, "what only absorbs, its derivative");
    const double seen = se * se * n;
    tap_ok(seen > V * (1 - 4 * .021) && seen < V * (1 + 4 * .021) + 4 * .006 * s2 &&
               seen < .7 * none,
           "its variance # %.4f, theory %.4f, without a baseline %.4f", seen, V, none);
}

int main(void)
{
    ctx = test_context(0);
    lamp_behind();
    furnace();
    absorbs();
    imp_context_destroy(ctx);
    return tap_done();
}
