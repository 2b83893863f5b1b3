/* SPDX-License-Identifier: Apache-2.0
 *
 * Memory of pictures, counted by the allocator hooks: bytes a pixel, bytes a channel of a
 * Jacobian, and a picture that no machine can hold is refused before it begins. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <unistd.h>

struct heap {
    size_t live, peak;
};
enum { HEAD = 64 }; /* keeps the alignment of what follows */

static void *allocate(size_t bytes, void *payload)
{
    struct heap *h = payload;
    void *p = NULL;
    if (posix_memalign(&p, HEAD, bytes + HEAD) != 0) return NULL;
    memcpy(p, &bytes, sizeof bytes);
    h->live += bytes;
    if (h->live > h->peak) h->peak = h->live;
    return (char *)p + HEAD;
}
static void release(void *memory, void *payload)
{
    struct heap *h = payload;
    size_t bytes;
    memcpy(&bytes, (char *)memory - HEAD, sizeof bytes);
    h->live -= bytes;
    free((char *)memory - HEAD);
}

static const char *const box =
    "<scene version='3.0.0'><integrator type='direct'/>"
    "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='%d'/>"
    "<integer name='height' value='%d'/><string name='pixel_format' value='rgb'/>"
    "<rfilter type='%s'/></film></sensor>"
    "<shape type='sphere'><point name='center' x='0' y='0' z='4'/><bsdf type='diffuse'>"
    "<rgb name='reflectance' value='.2 .5 .8'/></bsdf></shape>"
    "<emitter type='constant'><rgb name='radiance' value='1 2 3'/></emitter></scene>";

enum job { PICTURE, JACOBIAN };

/* Most bytes at once beyond what the scene takes; *channels: of all films together. */
static double peak(enum job job, int side, const char *filter, int spp, int *channels)
{
    struct heap heap = {0};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    imp_film *film = NULL, *films[64] = {0};
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p;
    char xml[2048];
    size_t n = 0;
    o.threads = 2;
    o.allocator = (struct imp_allocator){allocate, release, &heap};
    if (imp_context_create(&o, &ctx) != IMP_OK) exit(99);
    snprintf(xml, sizeof xml, box, side, side, filter);
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    n = imp_problem_n_variables(p);
    run.spp = spp;
    heap.peak = heap.live;
    const size_t before = heap.live;
    if (job == PICTURE) test_must(ctx, imp_render(s, &run, &film));
    else test_must(ctx, imp_problem_jacobian(p, &run, &film, films));
    const double most = (double)(heap.peak - before);
    *channels = job == PICTURE ? 3 : 3 * (int)(n + 1);
    imp_film_destroy(film);
    for (size_t k = 0; k < n; k++) imp_film_destroy(films[k]);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return most;
}

/* Bytes that one pixel more costs. Many samples: of fewer pixels. */
static double per_pixel(enum job job, const char *filter, int spp, int *channels)
{
    const int small = 64, large = spp > 1 ? 160 : 320;
    const double a = peak(job, small, filter, spp, channels);
    const double b = peak(job, large, filter, spp, channels);
    return (b - a) / (large * large - small * small);
}

static void beyond_machine(void)
{
    if ((double)sysconf(_SC_PHYS_PAGES) * (double)sysconf(_SC_PAGE_SIZE) > 5e10) {
        tap_ok(1, "30000 x 30000 # SKIP this machine may hold it");
        return;
    }
    imp_context *ctx = test_context(1);
    imp_film *film = NULL;
    char xml[2048];
    snprintf(xml, sizeof xml, box, 30000, 30000, "box");
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    const enum imp_status st = imp_render(s, NULL, &film);
    const char *message = imp_last_error(ctx);
    tap_ok(st == IMP_E_NOMEM && strstr(message, "30000 x 30000") &&
               strstr(message, "takes 43.3"),
           "30000 x 30000: refused with its size # %s", message);
    imp_film_destroy(film);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

int main(void)
{
    int channels;
    double bytes = per_pixel(PICTURE, "box", 1, &channels);
    tap_ok(bytes <= 64, "picture in rgb with errors, box: %.1f bytes a pixel", bytes);
    bytes = per_pixel(PICTURE, "box", 200, &channels);
    tap_ok(bytes <= 64, "the same after several passes: %.1f", bytes);
    bytes = per_pixel(JACOBIAN, "box", 1, &channels) / channels;
    /* 16, and the means or errors of one of the films */
    tap_ok(bytes <= 17, "Jacobian of %d channels, box: %.1f bytes a channel and pixel",
           channels, bytes);
    beyond_machine();
    return tap_done();
}
