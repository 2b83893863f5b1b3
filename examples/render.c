/* SPDX-License-Identifier: Apache-2.0
 *
 * render SCENE OUT.exr: the smallest complete program.
 *
 * A pixel is the mean of the radiance L over its area and over the light that arrives
 * from everywhere, estimated by N random walks (Kajiya 1986):
 *
 *     I = 1/N sum_i L_i,    se = sqrt( sum_i (L_i - I)^2 / (N (N - 1)) )
 *
 *     cc render.c $(pkg-config --cflags --libs importon)
 */
#include <importon/importon.h>
#include <stdio.h>

int main(int argc, char **argv)
{
    imp_context *context = NULL; /* owns threads, memory, error messages */
    imp_scene *scene = NULL;
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_write_options write = IMP_WRITE_OPTIONS_INIT;
    enum imp_status st;

    if (argc != 3) return fprintf(stderr, "usage: %s SCENE OUT.exr\n", argv[0]), 2;
    write.standard_error = 1;

    st = imp_context_create(NULL, &context);
    if (st == IMP_OK) st = imp_scene_load(context, argv[1], NULL, &scene);
    if (st == IMP_OK) st = imp_render(scene, &run, &film);
    if (st == IMP_OK) st = imp_film_write(film, argv[2], &write);
    if (st != IMP_OK)
        fprintf(stderr, "%s: %s\n", argv[0],
                context ? imp_last_error(context) : imp_status_text(st));

    imp_film_destroy(film); /* destroying NULL is fine */
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    return st == IMP_OK ? 0 : 1;
}
