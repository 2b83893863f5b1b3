/* SPDX-License-Identifier: Apache-2.0
 *
 * Starts of walks from lights, and their densities: on a surface with the cosine of its shading
 * normal, at a point in any direction, on a disk before the scene for the sky. */
#include "emission.h"
#include "kind/shape/shape.h"
#include "math/transform.h"
#include "math/vec.h"
#include "math/warp.h"
#include <math.h>

void imp__even_eval(const struct imp_emitter *e, const imp_spec *in,
                    const struct imp_emission *x, imp_spec *le)
{
    (void)e, (void)x;
    *le = in[0];
}
void imp__even_eval_d(const struct imp_emitter *e, const imp_spec *in,
                      const struct imp_emission *x, imp_spec *dle)
{
    (void)e, (void)in, (void)x;
    dle[0] = imp__spec(1);
}

/* Light leaves where the cosine at the shading normal is positive; power goes by that at
 * the geometric normal. */
bool imp__surface_emission_sample(const struct imp_emitter *e,
                                  const struct imp_ball *scene, const double u[4],
                                  struct imp_emission_sample *out)
{
    (void)scene;
    const struct imp_shape *s = e->shape;
    struct imp_surface at;
    if (!s->ops->sample_area) return false;
    at.located.prim = -1;
    s->ops->sample_area(s, u, &at);
    const imp_v3 local = imp__cosine_hemisphere(u + 2);
    const struct imp_frame frame = imp__frame_from_normal(at.n);
    const imp_v3 d = imp__normalize(imp__to_world(&frame, local));
    *out = (struct imp_emission_sample){.p = at.p,
                                        .ng = at.ng,
                                        .d = d,
                                        .uv = {at.uv[0], at.uv[1]},
                                        .cos_light = imp__dot(at.n, d),
                                        .cos_p = fabs(imp__dot(at.ng, d)),
                                        .pdf_p = 1 / s->area,
                                        .pdf_d = local[2] * IMP_INV_PI,
                                        .located = at.located};
    return local[2] > 0;
}

double imp__surface_emission_pdf(const struct imp_emitter *e,
                                 const struct imp_emission *x)
{
    (void)e;
    return imp_max(x->cos_light, 0.0) * IMP_INV_PI;
}

void imp__point_emission_sample(imp_v3 position, const double u[4],
                                struct imp_emission_sample *out)
{
    *out = (struct imp_emission_sample){.p = position,
                                        .d = imp__uniform_sphere(u + 2),
                                        .cos_light = 1,
                                        .cos_p = 1,
                                        .pdf_p = 1,
                                        .pdf_d = IMP_INV_PI / 4};
}

double imp__point_emission_pdf(const struct imp_emitter *e, const struct imp_emission *x)
{
    (void)e, (void)x;
    return IMP_INV_PI / 4;
}

double imp__along_emission_pdf(const struct imp_emitter *e, const struct imp_emission *x)
{
    (void)e, (void)x;
    return 1;
}

bool imp__sky_emission_sample(const struct imp_emitter *e, const struct imp_ball *scene,
                              const double u[4], struct imp_emission_sample *out)
{
    struct imp_light_sample sky;
    double xy[2];
    if (!e->ops->sample(e, &scene->centre, u + 2, &sky) || !(sky.pdf > 0)) return false;
    const struct imp_frame f = imp__frame_from_normal(sky.wi);
    const double r = scene->radius;
    imp__concentric_disk(u, xy);
    *out = (struct imp_emission_sample){.p = scene->centre +
                                             (f.s * xy[0] + f.t * xy[1] + sky.wi) * r,
                                        .d = -sky.wi,
                                        .cos_light = 1,
                                        .cos_p = 1,
                                        .pdf_p = IMP_INV_PI / (r * r),
                                        .pdf_d = sky.pdf};
    return true;
}

double imp__sky_emission_pdf(const struct imp_emitter *e, const struct imp_emission *x)
{
    const imp_v3 wi = -x->d;
    return e->ops->pdf(e, &wi, &wi, NULL, NULL);
}

int imp__sky_without_jumps(const struct imp_emitter *e,
                           struct imp_sky_circle out[IMP_SKY_CIRCLES])
{
    (void)e, (void)out;
    return 0;
}

enum imp_status imp__sky_axes(const struct imp_build *b, imp_v3 axis[3])
{
    struct imp_mat4 m;
    enum imp_status st = imp_build_transform(b, "to_world", m.m);
    if (st != IMP_OK) return st;
    const double scale = imp__length(imp__mat4_column(&m, 0));
    bool fine = imp__mat4_is_finite(&m) && imp__mat4_is_affine(&m) && scale > 0;
    for (int k = 0; k < 3; k++) axis[k] = imp__mat4_column(&m, k) * (1 / scale);
    for (int k = 0; fine && k < 3; k++)
        fine = fabs(imp__length(axis[k]) - 1) < 1e-6 &&
               fabs(imp__dot(axis[k], axis[(k + 1) % 3])) < 1e-6;
    if (!fine)
        return imp_build_error(b, "to_world", IMP_E_SCENE,
                               "to_world of an environment can turn and mirror it only");
    for (int k = 0; k < 3; k++) axis[k] = imp__normalize(axis[k]);
    return IMP_OK;
}

void imp__sky_axes_turn(imp_v3 axis[3], const double to_world[12])
{
    for (int k = 0; k < 3; k++)
        axis[k] = imp__normalize(imp__rows_vector(to_world, axis[k]));
}

enum imp_status imp__travel_read(const struct imp_build *b, imp_v3 *along)
{
    enum imp_status st = IMP_OK;
    struct imp_mat4 to_world;
    double d[3];
    if (imp_build_has(b, "direction") && imp_build_has(b, "to_world"))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "give direction or to_world, not both"));
    IMP_TRY(imp_build_vector(b, "direction", (double[3]){0, 0, 1}, d));
    IMP_TRY(imp_build_transform(b, "to_world", to_world.m));
    *along = imp__vector(&to_world, imp__v3(d[0], d[1], d[2]));
    const double length = imp__length(*along);
    if (!(length > 0 && length < INFINITY))
        IMP_TRY(imp_build_error(b, imp_build_has(b, "direction") ? "direction" : NULL,
                                IMP_E_SCENE, "its direction has length %g", length));
    *along *= imp__spec(1 / length);
out:
    return st;
}
