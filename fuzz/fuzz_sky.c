/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of the sky: width, height, channels and projection, rotation, then texels as
 * floats. A map that is taken has a density that is finite and positive where draws go. */
#include "math/rng.h"
#include "scene/scene.h"
#include "walk/core/walk.h"
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(const imp_scene *s)
{
    const struct imp_emitter *e = s->emitters[0];
    const imp_v3 origin = {0};
    for (uint64_t k = 0; k < 64; k++) {
        const struct imp_key key = imp__key(1, 2, k);
        const double u[2] = {k == 0   ? 0
                             : k == 1 ? 0x1.fffffffffffffp-1
                                      : imp__u01(key, 0),
                             k == 2   ? 0
                             : k == 3 ? 0x1.fffffffffffffp-1
                                      : imp__u01(key, 1)};
        struct imp_light_sample l;
        if (!e->ops->sample(e, &origin, u, &l)) continue;
        const struct imp_emission x = {.dist = INFINITY, .cos_light = 1, .d = -l.wi};
        const imp_spec le = imp__emitter_radiance(s, 0, &x, origin, NULL);
        if (!(fabs(imp__length(l.wi) - 1) < 1e-9) || !(l.pdf >= 0 && isfinite(l.pdf)))
            abort();
        if (!(le[0] >= 0 && isfinite(le[0])) || (le[0] > 0 && !(l.pdf > 0))) abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    if (size < 8) return 0;
    const int w = data[0] % 40, h = data[1] % 40, channels = data[2] & 1 ? 3 : 1;
    const size_t n = (size_t)w * (size_t)h * (size_t)channels;
    float *texels = calloc(n + 1, sizeof *texels), rotation;
    imp_scene *s = NULL;
    if (!texels) return 0;
    memcpy(&rotation, data + 4, sizeof rotation);
    for (size_t at = 8, k = 0; k < n && size > 8; k++, at += 4) /* over again */
        for (size_t b = 0; b < 4; b++)
            ((uint8_t *)&texels[k])[b] = data[8 + (at - 8 + b) % (size - 8)];
    if (imp_scene_create(ctx, NULL, &s) != IMP_OK) abort();
    imp_scene_begin(s, "emitter", "envmap", "sky", NULL);
    imp_scene_string(s, "projection", data[2] & 2 ? "equal_area" : "latlong");
    imp_scene_float(s, "rotation", (double)rotation);
    imp_scene_image(s, w, h, channels, texels);
    imp_scene_end(s);
    if (imp_scene_commit(s) == IMP_OK) check(s);
    imp_scene_destroy(s);
    free(texels);
    return 0;
}
