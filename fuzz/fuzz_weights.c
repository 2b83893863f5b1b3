/* SPDX-License-Identifier: Apache-2.0
 *
 * Weights of densities. The input is two texts, split at the first byte 0: one stands for
 * the weights of the integrator, the other for those of a material. What loads has shares
 * that are not negative and sum to 1, and a picture. */
#include "base/text.h"
#include "scene/scene.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void look(const struct imp_mixing *m)
{
    double sum = 0;
    for (int k = 0; m && k < IMP_DENSITIES; k++) {
        if (k != IMP_DENSITY_GUIDE && !(m->weight[k] >= 0)) abort();
        sum += fmax(m->weight[k], 0);
    }
    if (m && !(fabs(sum - 1) < 1e-9)) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const integrators[] = {"photons", "path"};
    static imp_context *ctx;
    char text[2][4097];
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    if (size < 2) return 0;
    const uint8_t *zero = memchr(data + 1, 0, size - 1);
    const size_t n[2] = {zero ? (size_t)(zero - data) - 1 : size - 1,
                         zero ? size - (size_t)(zero - data) - 1 : 0};
    for (int k = 0; k < 2; k++) {
        const size_t most = n[k] < 4096 ? n[k] : 4096;
        if (most) memcpy(text[k], k ? zero + 1 : data + 1, most);
        text[k][most] = 0;
    }
    imp_scene *s;
    if (imp_scene_create(ctx, NULL, &s) != IMP_OK) abort();
    imp_scene_begin(s, "integrator", integrators[data[0] & 1], NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_integer(s, "split", data[0] >> 1 & 3);
    imp_scene_string(s, "weights", text[0]);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 2);
    imp_scene_integer(s, "height", 2);
    imp_scene_end(s);
    imp_scene_end(s);
    if (data[0] & 8) {
        imp_scene_begin(s, "emitter", "constant", NULL, NULL);
        imp_scene_end(s);
    }
    if (data[0] & 16) {
        const double away[3] = {0, 4, 6};
        imp_scene_begin(s, "shape", "sphere", NULL, NULL);
        imp_scene_vector(s, "center", away);
        imp_scene_begin(s, "emitter", "area", NULL, NULL);
        imp_scene_end(s);
        imp_scene_end(s);
    }
    if (data[0] & 32) {
        imp_scene_begin(s, "shape", "disk", NULL, "proxy");
        imp_scene_end(s);
    }
    const double ahead[3] = {0, 0, 5};
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_vector(s, "center", ahead);
    imp_scene_begin(s, "bsdf", data[0] & 64 ? "dielectric" : "diffuse", NULL, NULL);
    if (n[1]) imp_scene_string(s, "weights", text[1]);
    imp_scene_end(s);
    imp_scene_end(s);
    if (imp_scene_commit(s) == IMP_OK) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f = NULL;
        run.spp = 2;
        run.drop_budget = 1;
        for (int b = 0; b < s->n_bsdf_mixing; b++) look(s->bsdf_mixing[b]);
        if (imp_render(s, &run, &f) == IMP_OK) {
            for (int k = 0; k < 12; k++)
                if (!isfinite(imp_film_mean(f)[k])) abort();
            imp_film_destroy(f);
        }
    }
    imp_scene_destroy(s);
    return 0;
}
