/* SPDX-License-Identifier: Apache-2.0
 *
 * own_optimizer: a host with its own optimiser. A grey ball of unknown reflectance rho
 * under a white sky; the target is the picture of rho = 0.3. Plain gradient descent,
 *
 *     J(rho) = 1/2 sum_pixels (I(rho) - T)^2,    rho <- rho - a dJ/drho,
 *
 * with loss and gradient from one call (imp_problem_objective), fresh random numbers in
 * each step, and the standard error of the gradient as the rule to stop: |dJ/drho| < 2
 * se.
 *
 * The ball fills the picture of P pixels and a convex body under a sky of 1 has radiance
 * rho, so J'' = 3 P and a = 1 / (6 P) halves the error in every step.
 *
 *     cc own_optimizer.c $(pkg-config --cflags --libs importon) -lm
 */
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 16, PIXELS = SIDE * SIDE };

static const char scene_xml[] =
    "<scene version='3.0.0'>"
    "  <integrator type='path'><integer name='max_depth' value='4'/></integrator>"
    "  <sensor type='orthographic'>"
    "    <transform name='to_world'>"
    "      <scale value='.5'/>"
    "      <lookat origin='0,0,3' target='0,0,0' up='0,1,0'/>"
    "    </transform>"
    "    <film type='hdrfilm'>"
    "      <integer name='width' value='16'/><integer name='height' value='16'/>"
    "      <rfilter type='box'/>"
    "    </film>"
    "  </sensor>"
    "  <emitter type='constant'><rgb name='radiance' value='1'/></emitter>"
    "  <shape type='sphere'>"
    "    <bsdf type='diffuse' id='ball'><float name='reflectance' value='.8'/></bsdf>"
    "  </shape>"
    "</scene>";

static enum imp_status descend(imp_problem *problem, double *rho)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 16;
    for (int i = 0; i < 60; i++) {
        struct imp_estimate loss;
        double gradient, se;
        run.seed = (uint64_t)i;
        const enum imp_status st =
            imp_problem_objective(problem, rho, &run, &loss, &gradient, &se);
        if (st != IMP_OK) return st;
        printf("%2d  rho %.6f  loss %9.3e +- %.1e  gradient %9.2e +- %.1e\n", i, *rho,
               loss.value, loss.se, gradient, se);
        if (fabs(gradient) <= 2 * se || fabs(gradient) < 1e-6) break;
        *rho = fmin(fmax(*rho - gradient / (6 * PIXELS), 0), 1);
    }
    return IMP_OK;
}

int main(void)
{
    imp_context *context = NULL;
    imp_scene *scene = NULL;
    imp_problem *problem = NULL;
    struct imp_target target = IMP_TARGET_INIT;
    float *pixels = malloc(3 * PIXELS * sizeof *pixels);
    double rho = 0;
    enum imp_status st = pixels ? IMP_OK : IMP_E_NOMEM;

    for (int i = 0; pixels && i < 3 * PIXELS; i++) pixels[i] = 0.3f;
    if (st == IMP_OK) st = imp_context_create(NULL, &context);
    if (st == IMP_OK)
        st = imp_scene_load_string(context, scene_xml, strlen(scene_xml), "ball", NULL,
                                   &scene);
    if (st == IMP_OK) st = imp_problem_create(scene, &problem);
    if (st == IMP_OK) st = imp_problem_activate(problem, "ball.reflectance.value");
    target.width = target.height = SIDE;
    target.channels = 3;
    target.pixels = pixels;
    if (st == IMP_OK) st = imp_problem_add_target(problem, &target);
    if (st == IMP_OK) {
        imp_problem_get_x(problem, &rho);
        st = descend(problem, &rho);
    }
    if (st == IMP_OK) printf("recovered rho = %.4f, the target has 0.3\n", rho);
    else fprintf(stderr, "%s\n", context ? imp_last_error(context) : imp_status_text(st));

    imp_problem_destroy(problem);
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    free(pixels);
    return st == IMP_OK && fabs(rho - 0.3) < 0.01 ? 0 : 1;
}
