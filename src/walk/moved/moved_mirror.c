/* SPDX-License-Identifier: Apache-2.0
 *
 * Mirrors of the chain from the camera, transposed (moved_mirror.h), and what is one. */
#include "moved_mirror.h"
#include "kind/bsdf/fresnel.h"
#include "math/rng.h"
#include "math/warp.h"
#include "walk/core/vertex.h"

extern const struct imp_bsdf_ops imp__dielectric;

bool imp__is_glass(const struct imp_bsdf *b) { return b->ops == &imp__dielectric; }

#define STEP 1e-5

/* The same of glass, where differences do not know how near the angle is at which it reflects all. */
static double glass_slope(const struct imp_vertex *v, double c)
{
    const struct imp_dirs inwards = {imp__v3(0, 0, c), {0}, IMP_GLASS_BENDS, 0};
    double d_c, d_e;
    const double F = imp__fresnel_dielectric_d(
        fabs(c), v->bsdf->ops->index_ratio(v->bsdf, v->in, &inwards), &d_c, &d_e);
    const double part = v->d.lobe == IMP_GLASS_BENDS ? F - 1 : F;
    return part != 0 ? copysign(1, c) * d_c / part : 0;
}

/* d ln F/dc of a delta lobe, by lanes, at the cosine c of wo; 0 where F is. */
static imp_spec slope(const struct imp_vertex *v, double c)
{
    if (imp__is_glass(v->bsdf)) return imp__spec(glass_slope(v, c));
    const bool straight = v->bsdf->straight >> v->d.lobe & 1;
    imp_spec F[2];
    for (int k = 0; k < 2; k++) {
        const double z = c + (k ? STEP : -STEP) * fabs(c),
                     s = sqrt(imp_max(1 - z * z, 0.0));
        const struct imp_dirs d = {imp__v3(s, 0, z), imp__v3(-s, 0, straight ? -z : z),
                                   v->d.lobe, 0};
        v->bsdf->ops->eval(v->bsdf, v->in, &d, &F[k]);
    }
    imp_spec out = F[1] - F[0];
    for (int l = 0; l < 4; l++) {
        const double all = (F[0][l] + F[1][l]) * (STEP * fabs(c));
        out[l] = all != 0 ? out[l] / all : 0;
    }
    return out;
}

void imp__lobe_bar(const struct imp_scene *scene, const struct imp_vertex *v, double time,
                   imp_v3 from, imp_spec bar, struct imp__link_point *x)
{
    struct imp_surface at;
    if (!imp__decided_surface(scene, &v->d, time, &at)) return;
    const imp_v3 wo = imp__normalize(from - x->x.p), n = imp__dot(at.n, x->x.n) < 0
                                                             ? -imp__shading_normal(&x->x)
                                                             : imp__shading_normal(&x->x);
    const double by = imp__sum_used(bar * slope(v, imp__dot(n, wo)), scene->lanes);
    const imp_v3 by_n = (wo - n * imp__dot(n, wo)) * by;
    x->bar.n += imp__dot(n, x->x.n) < 0 ? -by_n : by_n;
    x->wo_bar += (n - wo * imp__dot(n, wo)) * by;
    if (!imp__is_textured(v->bsdf)) return;
    const struct imp_frame frame = {at.s, at.t, at.n};
    const imp_v3 local = imp__to_local(&frame, wo);
    const bool straight = v->bsdf->straight >> v->d.lobe & 1;
    const struct imp_dirs dirs = {
        local, imp__v3(-local[0], -local[1], straight ? -local[2] : local[2]), v->d.lobe,
        0};
    struct imp__kernel_d d;
    imp__kernel_derive(v, &at, &dirs, &d);
    const struct imp__kernel_bar slides = imp__kernel_times(&d, bar, scene->lanes);
    x->moved_bar += slides.slide;
    x->bar.v -= slides.slide;
}

extern const struct imp_bsdf_ops imp__mask;

void imp__bend_turn_bar(imp_v3 from, imp_v3 turn, double ratio, struct imp__link_point *x)
{
    const imp_v3 w = imp__normalize(x->x.p - from);
    x->wo_bar -= imp__bend_bar(x->x.n, w, ratio, turn, &x->bar.n);
}

double imp__vertex_ratio(const struct imp_vertex *v)
{
    const struct imp_dirs dirs = {imp__vertex_wo(v), {0}, v->d.lobe, 0};
    if (!imp__is_glass(v->bsdf) || v->d.lobe != IMP_GLASS_BENDS) return 0;
    return 1 / v->bsdf->ops->index_ratio(v->bsdf, v->in, &dirs);
}

bool imp__passes_by_angle(const struct imp_bsdf *b)
{
    return b->straight && b->ops != &imp__mask && !(b->flags & IMP_BSDF_NULL);
}

#define PROBES 256

bool imp__bends_nothing(const struct imp_bsdf *b)
{
    for (uint32_t k = 0; k < PROBES; k++) {
        const struct imp_key key = imp__key(7, 3, k);
        const double v[2] = {imp__u01(key, 0), imp__u01(key, 1)},
                     u[3] = {imp__u01(key, 2), imp__u01(key, 3), imp__u01(key, 4)};
        const struct imp_texcoord at = {.uv = {imp__u01(key, 5), imp__u01(key, 6)}};
        struct imp_dirs d = {.wo = imp__uniform_sphere(v)};
        imp_spec in[IMP_INPUTS_MAX];
        imp__inputs_eval(b->input, b->n_in, &at, in);
        if (!b->ops->sample(b, in, u, &d) || d.lobe == IMP_SMOOTH) continue;
        if (b->ops->index_ratio && b->ops->index_ratio(b, in, &d) != 1) return false;
        const bool straight = b->straight >> d.lobe & 1;
        const imp_v3 back = imp__v3(-d.wo[0], -d.wo[1], straight ? -d.wo[2] : d.wo[2]);
        if (imp__length(d.wi - back) > 1e-9) return false;
    }
    return true;
}
