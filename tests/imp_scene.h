/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes for tests: from scenes/, or written in the test. A scene that does not load ends
 * the test program. */
#ifndef IMP_TEST_SCENE_H
#define IMP_TEST_SCENE_H

#include <importon/importon.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline imp_context *test_context(int threads)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    o.threads = threads;
    if (imp_context_create(&o, &ctx) != IMP_OK) {
        printf("Bail out! no context\n");
        exit(99);
    }
    return ctx;
}

static inline void test_must(imp_context *ctx, enum imp_status st)
{
    if (st == IMP_OK) return;
    printf("Bail out! %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(99);
}

/* `defines` is "a=1 b=2", or NULL. */
static inline imp_scene *test_scene(imp_context *ctx, const char *file,
                                    enum imp_color_mode mode, const char *defines)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[1024], copy[512], *save = NULL;
    const char *list[16];
    imp_scene *scene;
    snprintf(path, sizeof path, "%s/%s", IMP_SCENES, file);
    snprintf(copy, sizeof copy, "%s", defines ? defines : "");
    o.mode = mode;
    o.defines = list;
    for (char *d = strtok_r(copy, " ", &save); d && o.n_defines < 16;
         d = strtok_r(NULL, " ", &save))
        list[o.n_defines++] = d;
    test_must(ctx, imp_scene_load(ctx, path, &o, &scene));
    return scene;
}

static inline imp_scene *test_scene_text(imp_context *ctx, const char *xml,
                                         enum imp_color_mode mode)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *scene;
    o.mode = mode;
    test_must(ctx, imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &scene));
    return scene;
}

/* By calls: a path integrator, and a camera that looks at the origin from (0, 0, z), with
 * a box filter. */
static inline void test_camera(imp_scene *s, double z, double fov, int width, int height)
{
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, z, 0, 0, 0, 1};
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", fov);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", width);
    imp_scene_integer(s, "height", height);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
}
/* By calls: a square whose reflectance is a picture of three channels, under a white sky.
 */
static inline void test_picture_wall(imp_scene *s, int width, int height,
                                     const float *pixels)
{
    imp_scene_begin(s, "emitter", "constant", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_begin(s, "texture", "bitmap", NULL, "reflectance");
    imp_scene_image(s, width, height, 3, pixels);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
}

static inline imp_problem *test_problem(imp_context *ctx, imp_scene *scene,
                                        const char *glob)
{
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, glob));
    return p;
}

/* A target of three channels; pixels are copied. */
static inline void test_target(imp_context *ctx, imp_problem *p, int sensor, int width,
                               int height, const float *pixels)
{
    struct imp_target t = IMP_TARGET_INIT;
    t.sensor = sensor;
    t.width = width;
    t.height = height;
    t.channels = 3;
    t.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &t));
}

/* Index in x of the first number of a parameter. */
/* The index of the parameter that variable i is of. */
static inline size_t test_param_of(imp_context *ctx, const imp_problem *p, size_t i)
{
    struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
    test_must(ctx, imp_problem_get_variable(p, i, &v));
    return v.param;
}

static inline size_t test_variable(imp_problem *p, imp_scene *scene, imp_context *ctx,
                                   const char *name)
{
    size_t index;
    test_must(ctx, imp_scene_find_param(scene, name, &index));
    for (size_t i = 0; i < imp_problem_n_variables(p); i++) {
        if (test_param_of(ctx, p, i) == index) return i;
    }
    printf("Bail out! %s is not active\n", name);
    exit(99);
}

#endif
