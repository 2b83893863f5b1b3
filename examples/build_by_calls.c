/* SPDX-License-Identifier: Apache-2.0
 *
 * build_by_calls: a scene without a file. The calls mirror the file format: begin and end
 * open and close an object, the others give it properties.
 *
 * A point light of intensity I at height h over a diffuse floor of reflectance rho:
 * straight below it the irradiance is I / h^2, so the floor's radiance there is
 *
 *     L = (rho / pi) I / h^2.
 *
 * With I = 1, h = 5, rho = 0.6: 0.6 / (25 pi) = 0.0076394. The camera looks at that point
 * through one pixel, narrow enough to see nothing else.
 *
 *     cc build_by_calls.c $(pkg-config --cflags --libs importon) -lm
 */
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>

static void add_camera(imp_scene *scene)
{
    /* Looks along its local +z; +y is up. From (1, 0, 1) towards the origin: columns are
     * left, up, direction and position. */
    const double s = sqrt(0.5);
    const double to_world[16] = {-s, 0, -s, 1, 0, 1, 0, 0, s, 0, -s, 1, 0, 0, 0, 1};
    imp_scene_begin(scene, "sensor", "perspective", NULL, NULL);
    imp_scene_float(scene, "fov", 0.1);
    imp_scene_transform(scene, "to_world", to_world);
    imp_scene_begin(scene, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(scene, "width", 1);
    imp_scene_integer(scene, "height", 1);
    imp_scene_begin(scene, "rfilter", "box", NULL, NULL);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_end(scene);
}

static void add_floor(imp_scene *scene, double rho)
{
    static const float positions[] = {-4, -4, 0, 4, -4, 0, 4, 4, 0, -4, 4, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    imp_scene_begin(scene, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(scene, 4, 2, positions, NULL, NULL, indices);
    imp_scene_begin(scene, "bsdf", "diffuse", "floor", NULL);
    imp_scene_float(scene, "reflectance", rho);
    imp_scene_end(scene);
    imp_scene_end(scene);
}

static void add_light(imp_scene *scene, double height)
{
    const double position[3] = {0, 0, height};
    imp_scene_begin(scene, "emitter", "point", "lamp", NULL);
    imp_scene_vector(scene, "position", position);
    imp_scene_float(scene, "intensity", 1);
    imp_scene_end(scene);
}

int main(void)
{
    const double rho = 0.6, height = 5;
    const double expected = rho / (M_PI * height * height);
    struct imp_run run = IMP_RUN_INIT;
    imp_context *context = NULL;
    imp_scene *scene = NULL;
    imp_film *film = NULL;
    double radiance = 0;
    enum imp_status st = imp_context_create(NULL, &context);

    if (st == IMP_OK) st = imp_scene_create(context, NULL, &scene);
    if (st == IMP_OK) {
        imp_scene_begin(scene, "integrator", "path", NULL, NULL);
        imp_scene_integer(scene, "max_depth", 2);
        imp_scene_end(scene);
        add_camera(scene);
        add_floor(scene, rho);
        add_light(scene, height);
        st = imp_scene_commit(scene); /* reports the first mistake of all calls above */
    }
    run.spp = 64;
    if (st == IMP_OK) st = imp_render(scene, &run, &film);
    if (st == IMP_OK) {
        radiance = imp_film_mean(film)[0];
        printf("radiance %.7f, expected %.7f\n", radiance, expected);
    } else {
        fprintf(stderr, "%s\n", context ? imp_last_error(context) : imp_status_text(st));
    }

    imp_film_destroy(film);
    imp_scene_destroy(scene);
    imp_context_destroy(context);
    return st == IMP_OK && fabs(radiance - expected) < 1e-5 * expected ? 0 : 1;
}
