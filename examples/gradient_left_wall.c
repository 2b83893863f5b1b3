/* SPDX-License-Identifier: Apache-2.0
 *
 * gradient_left_wall SCENE OUT: how the whole picture of the Cornell box changes with the
 * colour of its left wall. Writes OUT.exr, and OUT.png in blue-white-red.
 *
 * A walk that hits the wall n times carries the factor rho^n, so with rho the reflectance
 *
 *     dI/drho = 1/N sum_i sum_k (w_1 .. w_{k-1}) (dw_k/drho) (w_{k+1} .. w_m Le)
 *
 * over the vertices k of walk i (gradients of the walk's factors, one at a time). It is
 * the forward derivative J v, with v = 1 for the wall's three numbers: red changes red
 * only, so one picture holds all three derivatives.
 *
 *     cc gradient_left_wall.c $(pkg-config --cflags --libs importon)
 */
#include <importon/importon.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    imp_context *context = NULL;
    imp_scene *scene = NULL;
    imp_problem *problem = NULL;
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_write_options write = IMP_WRITE_OPTIONS_INIT;
    const double v[3] = {1, 1, 1};
    char path[4096];
    enum imp_status st;

    if (argc != 3) return fprintf(stderr, "usage: %s SCENE OUT\n", argv[0]), 2;

    st = imp_context_create(NULL, &context);
    if (st == IMP_OK) st = imp_scene_load(context, argv[1], NULL, &scene);
    if (st == IMP_OK) st = imp_problem_create(scene, &problem);
    if (st == IMP_OK) st = imp_problem_activate(problem, "red.reflectance.value");
    if (st == IMP_OK && imp_problem_n_variables(problem) != 3) st = IMP_E_ARG;
    if (st == IMP_OK) st = imp_problem_forward(problem, v, &run, &film);
    write.standard_error = 1;
    write.diverging = 1;
    snprintf(path, sizeof path, "%s.exr", argv[2]);
    if (st == IMP_OK) st = imp_film_write(film, path, &write);
    snprintf(path, sizeof path, "%s.png", argv[2]);
    if (st == IMP_OK) st = imp_film_write(film, path, &write);
    if (st != IMP_OK)
        fprintf(stderr, "%s: %s\n", argv[0],
                context ? imp_last_error(context) : imp_status_text(st));

    imp_film_destroy(film);
    imp_problem_destroy(problem);
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    return st == IMP_OK ? 0 : 1;
}
