/* SPDX-License-Identifier: Apache-2.0
 *
 * nlopt_fit: an optimiser of somebody else's. imp_problem_nlopt has the callback shape of
 * NLopt, so any of its algorithms fits a scene. The picture of a ball (reflectance rho)
 * under a sky (radiance E) has
 *
 *     I_ball = rho E,    I_sky = E,    J = 1/2 sum (I - T)^2,
 *
 * and both numbers follow from one picture that shows ball and sky. The seed is the same
 * in every call: with common random numbers J is an ordinary smooth function, which is
 * what L-BFGS expects.
 *
 *     cc nlopt_fit.c $(pkg-config --cflags --libs importon nlopt) -lm
 */
#include <importon/importon.h>
#include <math.h>
#include <nlopt.h>
#include <stdio.h>
#include <string.h>

static const char scene_xml[] =
    "<scene version='3.0.0'>"
    "  <integrator type='path'><integer name='max_depth' value='4'/></integrator>"
    "  <sensor type='orthographic'>"
    "    <transform name='to_world'>"
    "      <scale value='2'/>"
    "      <lookat origin='0,0,3' target='0,0,0' up='0,1,0'/>"
    "    </transform>"
    "    <film type='hdrfilm'>"
    "      <integer name='width' value='24'/><integer name='height' value='24'/>"
    "      <rfilter type='box'/>"
    "    </film>"
    "  </sensor>"
    "  <emitter type='constant' id='sky'><float name='radiance' value='1'/></emitter>"
    "  <shape type='sphere'>"
    "    <bsdf type='diffuse' id='ball'><float name='reflectance' value='.5'/></bsdf>"
    "  </shape>"
    "</scene>";

/* The picture of (rho, E) = (0.25, 2). */
static enum imp_status make_target(imp_scene *scene, imp_film **film)
{
    const double rho = 0.25, radiance = 2;
    struct imp_run run = IMP_RUN_INIT;
    size_t ball, sky;
    enum imp_status st = imp_scene_find_param(scene, "ball.reflectance.value", &ball);
    if (st == IMP_OK) st = imp_scene_find_param(scene, "sky.radiance.value", &sky);
    if (st == IMP_OK) st = imp_scene_set_values(scene, ball, 1, &rho);
    if (st == IMP_OK) st = imp_scene_set_values(scene, sky, 1, &radiance);
    run.spp = 256;
    run.seed = 99;
    return st == IMP_OK ? imp_render(scene, &run, film) : st;
}

/* x[0] is the sky or the ball: active numbers keep the scene's order. */
static enum imp_status minimise(imp_problem *problem, double x[2])
{
    struct imp_run run = IMP_RUN_INIT;
    double lo[2], hi[2], least;
    for (size_t i = 0; i < 2; i++) {
        struct imp_variable_info variable = IMP_VARIABLE_INFO_INIT;
        const enum imp_status st = imp_problem_get_variable(problem, i, &variable);
        if (st != IMP_OK) return st;
        lo[i] = variable.lo, hi[i] = variable.hi;
    }
    run.spp = 64;
    imp_problem_set_run(problem, &run);
    nlopt_opt opt = nlopt_create(NLOPT_LD_LBFGS, 2);
    if (!opt) return IMP_E_NOMEM;
    nlopt_set_lower_bounds(opt, lo);
    nlopt_set_upper_bounds(opt, hi);
    nlopt_set_min_objective(opt, imp_problem_nlopt, problem);
    nlopt_set_xtol_rel(opt, 1e-5);
    nlopt_set_maxeval(opt, 60);
    const nlopt_result result = nlopt_optimize(opt, x, &least);
    printf("%s after %d evaluations: J = %.4g\n", nlopt_result_to_string(result),
           nlopt_get_numevals(opt), least);
    nlopt_destroy(opt);
    /* At the noise floor a line search may find nothing better: that is an end, too. */
    return result > 0 || result == NLOPT_FAILURE || result == NLOPT_ROUNDOFF_LIMITED
               ? IMP_OK
               : IMP_E_NUMERIC;
}

int main(void)
{
    struct imp_load_options options = IMP_LOAD_OPTIONS_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_context *context = NULL;
    imp_scene *scene = NULL;
    imp_problem *problem = NULL;
    imp_film *film = NULL;
    double x[2] = {1, 0.5};
    struct imp_variable_info first = IMP_VARIABLE_INFO_INIT;
    size_t ball = 0;
    enum imp_status st = imp_context_create(NULL, &context);

    options.mode = IMP_MONO; /* one number each */
    if (st == IMP_OK)
        st = imp_scene_load_string(context, scene_xml, strlen(scene_xml), "ball",
                                   &options, &scene);
    if (st == IMP_OK) st = make_target(scene, &film);
    if (st == IMP_OK) st = imp_problem_create(scene, &problem);
    if (st == IMP_OK) st = imp_problem_activate(problem, "ball.reflectance.value");
    if (st == IMP_OK) st = imp_problem_activate(problem, "sky.radiance.value");
    if (st == IMP_OK) {
        imp_film_get_info(film, &info);
        target.width = info.width;
        target.height = info.height;
        target.channels = info.channels;
        target.pixels = imp_film_mean(film);
        st = imp_problem_add_target(problem, &target);
    }
    if (st == IMP_OK) st = imp_scene_find_param(scene, "ball.reflectance.value", &ball);
    if (st == IMP_OK) st = imp_problem_get_variable(problem, 0, &first);
    const int at_ball = first.param == ball ? 0 : 1;
    x[at_ball] = 0.7;
    x[1 - at_ball] = 1;
    if (st == IMP_OK) st = minimise(problem, x);
    if (st == IMP_OK)
        printf("rho = %.4f (0.25), E = %.4f (2)\n", x[at_ball], x[1 - at_ball]);
    else fprintf(stderr, "%s\n", context ? imp_last_error(context) : imp_status_text(st));

    imp_film_destroy(film);
    imp_problem_destroy(problem);
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    return st == IMP_OK && fabs(x[at_ball] - 0.25) < 0.01 &&
                   fabs(x[1 - at_ball] - 2) < 0.02
               ? 0
               : 1;
}
