/* SPDX-License-Identifier: Apache-2.0
 *
 * Where walks from a scene's only light begin, in lanes (light_start.c, of walks alone). */
#include "light_step.h"

const struct imp_emitter_lanes *imp__light_only(const struct imp_tracer *t)
{
    const struct imp_scene *scene = t->scene;
    if (scene->n_emitters != 1 || t->guide || !(scene->light_cdf[0] > 0)) return NULL;
    const struct imp_emitter_lanes *l = imp__emitter_lanes(scene->emitters[0]);
    return l && l->emission && l->emits(scene->emitters[0]) ? l : NULL;
}

void imp__light_starts_draw(const struct imp_tracer *t,
                            const struct imp_emitter_lanes *lanes,
                            const struct imp_wide_block *keys, imp_wide point[2],
                            struct imp_wide_emission *out)
{
    imp_wide u[4];
    u[0] = point[0] = imp__wide_number(keys, IMP_DIM_PIXEL_X);
    u[1] = point[1] = imp__wide_number(keys, IMP_DIM_PIXEL_Y);
    u[2] = imp__wide_number(keys, IMP_DIM_LENS_U);
    u[3] = imp__wide_number(keys, IMP_DIM_LENS_V);
    lanes->emission(t->scene->emitters[0], u, out);
}

struct imp_light_given imp__light_given(const struct imp_wide_emission *x,
                                        const imp_wide point[2], int k)
{
    return (struct imp_light_given){
        .drawn = x->drawn[k],
        .point = {point[0][k], point[1][k]},
        .start = {
            .p = imp__wide3_lane(&x->p, k),
            .ng = imp__wide3_lane(&x->ng, k),
            .d = imp__wide3_lane(&x->d, k),
            .uv = {x->uv[0][k], x->uv[1][k]},
            .cos_light = x->cos_light[k],
            .cos_p = x->cos_p[k],
            .pdf_p = x->pdf_p,
            .pdf_d = x->pdf_d[k],
            .located = {x->prim[k], {(float)x->located[0][k], (float)x->located[1][k]}}}};
}

bool imp__light_starts(const struct imp_tracer *t, int64_t first, int n,
                       struct imp_light_given *out)
{
    const struct imp_emitter_lanes *lanes = imp__light_only(t);
    if (!lanes) return false;
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        struct imp_wide_block keys;
        struct imp_wide_emission x;
        imp_wide point[2];
        for (int k = 0; k < IMP_WIDE_LANES; k++)
            keys.hash[k] = imp__light_key(t, first + i + k).state;
        keys.low = keys.high = (imp_wide_word){0};
        imp__light_starts_draw(t, lanes, &keys, point, &x);
        for (int k = 0; k < IMP_WIDE_LANES && i + k < n; k++)
            out[i + k] = imp__light_given(&x, point, k);
    }
    return true;
}
