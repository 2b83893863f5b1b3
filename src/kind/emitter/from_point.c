/* SPDX-License-Identifier: Apache-2.0
 *
 * Sampling, density and placement shared by point lights. */
#include "from_point.h"
#include "kind/shape/shape.h"
#include "math/transform.h"
#include "math/vec.h"
#include <math.h>

extern const struct imp_emitter_ops imp__spot_light, imp__projector;

struct imp__light_frame *imp__light_frame_of(const struct imp_emitter *e)
{
    return e->ops == &imp__spot_light || e->ops == &imp__projector ? e->self : NULL;
}

bool imp__point_light_sample(imp_v3 light, imp_v3 ref, struct imp_light_sample *out)
{
    const imp_v3 d = light - ref;
    const double r = imp__length(d);
    if (!(r > 1e-150 && r < INFINITY)) return false;
    *out = (struct imp_light_sample){.wi = d * (1 / r),
                                     .dist = r,
                                     .pdf = 1,
                                     .cos_light = 1,
                                     .p = light,
                                     .ng = d * (-1 / r)};
    return true;
}

double imp__point_light_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                            const imp_v3 *wi, const struct imp_hit *hit,
                            const struct imp_surface *at)
{
    (void)e, (void)ref, (void)wi, (void)hit, (void)at;
    return 0;
}

enum imp_status imp__light_frame_read(const struct imp_build *b,
                                      struct imp__light_frame *out)
{
    struct imp_mat4 m;
    enum imp_status st = imp_build_transform(b, "to_world", m.m);
    if (st != IMP_OK) return st;
    bool fine = imp__mat4_is_finite(&m) && imp__mat4_is_affine(&m);
    for (int k = 0; k < 3; k++) out->axis[k] = imp__mat4_column(&m, k);
    for (int k = 0; fine && k < 3; k++)
        fine = fabs(imp__length(out->axis[k]) - 1) < 1e-3 &&
               fabs(imp__dot(out->axis[k], out->axis[(k + 1) % 3])) < 1e-3;
    if (!fine)
        return imp_build_error(b, "to_world", IMP_E_SCENE,
                               "to_world scales or shears; this light allows rotation "
                               "and translation only");
    for (int k = 0; k < 3; k++) out->axis[k] = imp__normalize(out->axis[k]);
    out->origin = imp__point(&m, imp__v3(0, 0, 0));
    return IMP_OK;
}

imp_v3 imp__light_frame_local(const struct imp__light_frame *f, const imp_v3 *d)
{
    return imp__v3(imp__dot(*d, f->axis[0]), imp__dot(*d, f->axis[1]),
                   imp__dot(*d, f->axis[2]));
}

bool imp__input_jumps(const struct imp_input *input)
{
    const struct imp_texture *t = input->texture;
    const struct imp_texcoord middle = {.uv = {0.5, 0.5}};
    imp_spec d_uv[2];
    return t && (!t->ops->slope || !t->ops->slope(t, &middle, input->scalar, d_uv));
}
