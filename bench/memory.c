/* SPDX-License-Identifier: Apache-2.0
 *
 * Bytes that a picture, a Jacobian and a fit of a texture take, as JSON: the difference
 * of the resident memory of two processes whose problems differ in size alone.
 *
 *   picture_pixel      a pixel more of a picture, rgb with errors, box filter
 *   jacobian_channel   a channel more of a pixel of derivative pictures
 *   adam_number        a texel's channel more of a fit by Adam, scene and result included
 */
#include "../tests/imp_scene.h"
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { JACOBIAN_CHANNELS = 3 * 4 }; /* the picture, and its derivative by an rgb */

/* A textured wall under an even sky. */
static imp_scene *wall(imp_context *ctx, int side, int texels)
{
    const size_t n = (size_t)texels * (size_t)texels * 3;
    float *pixels = malloc(n * sizeof *pixels);
    imp_scene *s;
    if (!pixels) exit(3);
    for (size_t k = 0; k < n; k++) pixels[k] = .5f;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, side, side);
    test_picture_wall(s, texels, texels, pixels);
    test_must(ctx, imp_scene_commit(s));
    free(pixels);
    return s;
}

static void work(const char *what, int size)
{
    struct imp_run run = IMP_RUN_INIT;
    const int fit = !strcmp(what, "adam");
    imp_context *ctx = test_context(2);
    imp_problem *p;
    imp_film *film = NULL, *films[3];
    imp_scene *s = wall(ctx, fit ? 64 : size, fit ? size : 2);
    test_must(ctx, imp_problem_create(s, &p));
    run.spp = 4;
    if (!strcmp(what, "picture")) {
        test_must(ctx, imp_render(s, &run, &film));
    } else if (!strcmp(what, "jacobian")) {
        test_must(ctx, imp_problem_activate(p, "*radiance*"));
        test_must(ctx, imp_problem_jacobian(p, &run, &film, films));
    } else {
        static float target[64 * 64 * 3];
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_fit_options f = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *result;
        t.width = t.height = 64, t.channels = 3, t.pixels = target;
        test_must(ctx, imp_problem_activate(p, "*data*"));
        test_must(ctx, imp_problem_add_target(p, &t));
        f.max_iterations = 3;
        test_must(ctx, imp_fit(p, &f, &run, &result));
    }
}

/* Peak memory of this program doing it, in bytes. */
static double peak(const char *self, const char *what, int size)
{
    char number[16];
    struct rusage usage;
    int status;
    snprintf(number, sizeof number, "%d", size);
    const pid_t pid = fork();
    if (pid == 0) {
        execl(self, self, what, number, (char *)NULL);
        _exit(127);
    }
    wait4(pid, &status, 0, &usage);
    if (status != 0) exit(3);
    return 1024. * (double)usage.ru_maxrss;
}

static double slope(const char *self, const char *what, int small, int large)
{
    const double n = (double)large * large - (double)small * small;
    return (peak(self, what, large) - peak(self, what, small)) / n;
}

int main(int argc, char **argv)
{
    if (argc == 3) {
        work(argv[1], atoi(argv[2]));
        return 0;
    }
    printf("{\n  \"importon\": \"%s\",\n", imp_version());
    printf("  \"picture_pixel\": %.1f,\n", slope(argv[0], "picture", 256, 1536));
    printf("  \"jacobian_channel\": %.1f,\n",
           slope(argv[0], "jacobian", 256, 1024) / JACOBIAN_CHANNELS);
    printf("  \"adam_number\": %.1f\n}\n", slope(argv[0], "adam", 256, 1536) / 3);
    return 0;
}
