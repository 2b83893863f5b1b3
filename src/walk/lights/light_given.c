/* SPDX-License-Identifier: Apache-2.0
 *
 * Where walks from a scene's only light begin, in lanes (light_start.c, of walks alone). */
#include "kind/kind_lanes.h"
#include "light_step.h"

/* The only light of the scene, if walks can begin there in lanes. */
static const struct imp_emitter_lanes *only_light(const struct imp_tracer *t)
{
    const struct imp_scene *scene = t->scene;
    if (scene->n_emitters != 1 || t->guide || !(scene->light_cdf[0] > 0)) return NULL;
    const struct imp_emitter_lanes *l = imp__emitter_lanes(scene->emitters[0]);
    return l && l->emission && l->emits(scene->emitters[0]) ? l : NULL;
}

bool imp__light_starts(const struct imp_tracer *t, int64_t first, int n,
                       struct imp_light_given *out)
{
    const struct imp_emitter_lanes *lanes = only_light(t);
    if (!lanes) return false;
    const struct imp_emitter *e = t->scene->emitters[0];
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        struct imp_wide_block block;
        struct imp_wide_emission x;
        imp_wide u[4];
        for (int k = 0; k < IMP_WIDE_LANES; k++)
            block.hash[k] = imp__light_key(t, first + i + k).state;
        block.low = block.high = (imp_wide_word){0};
        u[0] = imp__wide_number(&block, IMP_DIM_PIXEL_X);
        u[1] = imp__wide_number(&block, IMP_DIM_PIXEL_Y);
        u[2] = imp__wide_number(&block, IMP_DIM_LENS_U);
        u[3] = imp__wide_number(&block, IMP_DIM_LENS_V);
        lanes->emission(e, u, &x);
        for (int k = 0; k < IMP_WIDE_LANES && i + k < n; k++)
            out[i + k] = (struct imp_light_given){
                .drawn = x.drawn[k],
                .point = {u[0][k], u[1][k]},
                .start = {
                    .p = imp__wide3_lane(&x.p, k),
                    .ng = x.ng,
                    .d = imp__wide3_lane(&x.d, k),
                    .uv = {x.uv[0][k], x.uv[1][k]},
                    .cos_light = x.cos_light[k],
                    .cos_p = x.cos_p[k],
                    .pdf_p = x.pdf_p,
                    .pdf_d = x.pdf_d[k],
                    .located = {0, {(float)x.located[0][k], (float)x.located[1][k]}}}};
    }
    return true;
}
