/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of kernels by turns of the frame and of the directions (moved_kernel.h). */
#include "moved_kernel.h"
#include "kind/build.h"
#include "kind/shape/shape.h"
#include "math/rng.h"
#include "math/warp.h"
#include "moved_mirror.h"
#include "walk/core/vertex.h"
#include <float.h>

extern const struct imp_bsdf_ops imp__diffuse, imp__twosided, imp__black, imp__mask;

bool imp__is_lambertian(const struct imp_bsdf *b)
{
    if (b->ops == &imp__twosided) {
        for (int k = 0; k < b->n_child; k++)
            if (!imp__is_lambertian(b->child[k])) return false;
        return true;
    }
    return b->ops == &imp__diffuse || b->ops == &imp__black;
}

bool imp__is_textured(const struct imp_bsdf *b)
{
    for (int k = 0; k < b->n_in; k++)
        if (b->input[k]->texture) return true;
    return false;
}

void imp__surface_grad(const struct imp_surface *at, imp_v3 grad[2])
{
    const imp_v3 a = at->dp_du, b = at->dp_dv;
    const double aa = imp__dot(a, a), ab = imp__dot(a, b), bb = imp__dot(b, b);
    const double det = aa * bb - ab * ab;
    grad[0] = grad[1] = (imp_v3){0};
    if (!(det > 0)) return;
    grad[0] = (a * bb - b * ab) * (1 / det);
    grad[1] = (b * aa - a * ab) * (1 / det);
}

/* Slope of the luminance of a colour, also where walks carry wavelengths. */
static void luminance_slope(const struct imp_input *colour, imp_spec weight,
                            const struct imp_texcoord *at, imp_spec d_uv[2])
{
    const struct imp_texture *t = colour->texture;
    struct imp_texcoord plain = *at;
    plain.carried = NULL;
    if (!t) return;
    t->ops->slope(t, &plain, colour->scalar, d_uv);
    for (int k = 0; k < 2; k++) d_uv[k] = imp__spec(imp__sum_used(weight * d_uv[k], 3));
}

/* Slope of a number of a vector, whatever the walk carries. */
static void component_slope(const struct imp_input *vector, int component,
                            const struct imp_texcoord *at, imp_spec d_uv[2])
{
    const struct imp_texture *t = vector->texture;
    struct imp_texcoord plain = *at;
    plain.carried = NULL;
    if (!t) return;
    t->ops->slope(t, &plain, false, d_uv);
    for (int k = 0; k < 2; k++) d_uv[k] = imp__spec(d_uv[k][component]);
}

/* d K/du and d K/dv. */
static void textures_derive(const struct imp_vertex *v, const struct imp_dirs *dirs,
                            imp_spec d_uv[2])
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_texcoord at = imp__vertex_at(v);
    imp_spec df[IMP_INPUTS_MAX], d_in[IMP_INPUTS_MAX][2];
    b->ops->eval_d(b, v->in, dirs, df);
    for (int j = 0; j < b->n_in; j++) {
        const struct imp_input *i = b->input[j];
        const struct imp_texture *t = i->texture;
        d_in[j][0] = d_in[j][1] = imp__spec(0);
        if (i->luminance)
            luminance_slope(b->input[j - i->luminance], i->weight, &at, d_in[j]);
        else if (i->component)
            component_slope(b->input[j - i->component], i->component - 1, &at, d_in[j]);
        else if (t && !i->vector) t->ops->slope(t, &at, i->scalar, d_in[j]);
        for (int k = 0; k < 2; k++) d_uv[k] += df[j] * d_in[j][k];
    }
}

void imp__kernel_derive(const struct imp_vertex *v, const struct imp_surface *at,
                        const struct imp_dirs *dirs, struct imp__kernel_d *out)
{
    const struct imp_frame frame = {at->s, at->t, at->n};
    *out = (struct imp__kernel_d){.frame = frame};
    out->wo = imp__to_world(&frame, dirs->wo);
    out->wi = imp__to_world(&frame, dirs->wi);
    imp_spec K;
    v->bsdf->ops->eval(v->bsdf, v->in, dirs, &K);
    if (imp_likely(dirs->lobe == IMP_SMOOTH))
        v->bsdf->ops->eval_directions_d(v->bsdf, v->in, dirs, out->d_wo, out->d_wi);
    if (v->shape && imp__is_textured(v->bsdf)) {
        imp__surface_grad(at, out->grad);
        textures_derive(v, dirs, out->d_uv);
    }
    /* Far away from a narrow lobe values are subnormal, and have no finite inverse. */
    for (int c = 0; c < 4; c++) K[c] = K[c] >= DBL_MIN ? 1 / K[c] : 0;
    for (int k = 0; k < 3; k++) {
        out->d_wo[k] *= K;
        out->d_wi[k] *= K;
    }
    for (int k = 0; k < 2; k++) out->d_uv[k] *= K;
}

static imp_v3 contracted(const struct imp_frame *f, const imp_spec d[3], imp_spec bar,
                         int lanes)
{
    return f->s * imp__sum_used(bar * d[0], lanes) +
           f->t * imp__sum_used(bar * d[1], lanes) +
           f->n * imp__sum_used(bar * d[2], lanes);
}

struct imp__kernel_bar imp__kernel_times(const struct imp__kernel_d *d, imp_spec bar,
                                         int lanes)
{
    const imp_v3 by_wo = contracted(&d->frame, d->d_wo, bar, lanes);
    const imp_v3 by_wi = contracted(&d->frame, d->d_wi, bar, lanes);
    const imp_v3 by_frame = imp__cross(by_wo, d->wo) + imp__cross(by_wi, d->wi);
    return (struct imp__kernel_bar){
        .n = imp__cross(by_frame, d->frame.n),
        .turn = imp__dot(by_frame, d->frame.n),
        .wo = by_wo - d->wo * imp__dot(by_wo, d->wo),
        .wi = by_wi - d->wi * imp__dot(by_wi, d->wi),
        .slide = d->grad[0] * imp__sum_used(bar * d->d_uv[0], lanes) +
                 d->grad[1] * imp__sum_used(bar * d->d_uv[1], lanes)};
}

/* ---- What has them ------------------------------------------------------------------- */

/* Does the kernel know a direction in the surface, at some place of its textures? */
#define TURN_PROBES 16
static bool has_grain(const struct imp_bsdf *b)
{
    const struct imp_surface local = {
        .s = imp__v3(1, 0, 0), .t = imp__v3(0, 1, 0), .n = imp__v3(0, 0, 1)};
    for (uint32_t k = 0; k < TURN_PROBES; k++) {
        const struct imp_key key = imp__key(7, 1, k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)},
                     v[2] = {imp__u01(key, 2), imp__u01(key, 3)};
        const struct imp_texcoord at = {.uv = {imp__u01(key, 4), imp__u01(key, 5)}};
        const struct imp_dirs dirs = {imp__cosine_hemisphere(u),
                                      imp__cosine_hemisphere(v), IMP_SMOOTH, 0};
        imp_spec in[IMP_INPUTS_MAX];
        const struct imp_vertex vertex = {.bsdf = b, .in = in};
        struct imp__kernel_d d;
        imp__inputs_eval(b->input, b->n_in, &at, in);
        imp__kernel_derive(&vertex, &local, &dirs, &d);
        const struct imp__kernel_bar bar = imp__kernel_times(&d, imp__spec(1), 3);
        if (fabs(bar.turn) > 1e-9 * (imp__length(bar.n) + imp__length(bar.wi)))
            return true;
    }
    return false;
}

/* Why its value jumps where directions turn. */
static const char *steps_why(const struct imp_bsdf *b)
{
    return b->flags & IMP_BSDF_TURNED
               ? "has normals of its own, and jumps where they turn away "
                 "(clamp_invalid_normals, with the shadowing function, makes it "
                 "continuous)"
           : b->flags & IMP_BSDF_TRANSMIT
               ? "lets light through its facets up to an angle, and jumps there "
                 "(roughdielectric with the distribution beckmann does not)"
               : "has a value that jumps where directions turn";
}

const char *imp__kernel_without_d(const struct imp_bsdf *b, bool round)
{
    if (imp__is_lambertian(b) || b->flags & IMP_BSDF_NULL) return NULL;
    const struct imp_bsdf *without = imp__bsdf_without_directions_d(b);
    if (b->ops == &imp__mask && !(b->child[0]->flags & IMP_BSDF_DELTA))
        return imp__kernel_without_d(b->child[0], round);
    if (b->flags & IMP_BSDF_DELTA && b->ops == &imp__mask)
        return "reflects or lets pass in single directions under a mask: edges that are "
               "seen in it have no draws";
    if (b->flags & IMP_BSDF_DELTA && b->flags & IMP_BSDF_TURNED)
        return "has normals of its own, with which single directions turn";
    if (b->flags & IMP_BSDF_DELTA && !imp__is_glass(b) && !imp__bends_nothing(b))
        return "bends light: edges that are seen through it have no draws";
    if (b->flags & IMP_BSDF_DELTA && !(b->flags & IMP_BSDF_SMOOTH)) return NULL;
    if (b->flags & IMP_BSDF_EMIT) return "emits light by itself";
    if (without)
        return without->ops->eval_directions_d ? steps_why(without)
                                               : "has no derivative by directions";
    if (round && has_grain(b))
        return "has a grain, whose direction turns over this shape";
    return NULL;
}

/* Does a texture jump where u begins again, all round a shape? */
static bool has_seam(const struct imp_bsdf *b)
{
    for (uint32_t k = 0; k < TURN_PROBES; k++) {
        const double v = imp__u01(imp__key(7, 2, k), 0);
        imp_spec in[2][IMP_INPUTS_MAX];
        for (int side = 0; side < 2; side++) {
            const struct imp_texcoord at = {.uv = {side ? 1 - 1e-12 : 0, v}};
            imp__inputs_eval(b->input, b->n_in, &at, in[side]);
        }
        for (int j = 0; j < b->n_in; j++)
            for (int c = 0; c < 3; c++)
                if (fabs(in[0][j][c] - in[1][j][c]) > 1e-6 * (1 + fabs(in[0][j][c])))
                    return true;
    }
    return false;
}

const char *imp__textures_without_d(const struct imp_bsdf *b, const struct imp_shape *s)
{
    const struct imp_texcoord middle = {.uv = {0.5, 0.5}};
    if (!imp__is_textured(b)) return NULL;
    if (s->placed || s->by_triangle) return "has a texture that needs more than uv";
    if (s->geometry != IMP_TRIANGLES && s->ops->flags & IMP_SHAPE_FLAT)
        return "has a texture, on a disk, whose uv turn about its middle";
    for (int k = 0; k < b->n_in; k++) {
        const struct imp_texture *t = b->input[k]->texture;
        imp_spec d_uv[2];
        if (!t) continue;
        if (b->input[k]->bump)
            return "has a bump map, whose normals jump from texel to texel (those of a "
                   "normalmap do not)";
        if (!t->ops->slope || !t->ops->slope(t, &middle, b->input[k]->scalar, d_uv))
            return "has a texture whose values jump (bilinear bitmaps do not)";
    }
    if (s->geometry != IMP_TRIANGLES && has_seam(b))
        return "has a texture that jumps where u begins again (wrap_mode repeat, and an "
               "image that closes)";
    return NULL;
}
