/* SPDX-License-Identifier: Apache-2.0
 *
 * A material in a frame that is turned over its surface (normalmap, bumpmap): with n' its
 * normal, the value is
 *
 *     g(wi) f(wo', wi')        where wi is on the same side of n as of n', 0 elsewhere
 *
 * f includes the cosine to n', and g is the shadowing of Estevez, Lecocq and Stein (2019),
 *
 *     g = 2/(1 + sqrt(1 + A tan^2 wi)),    A = min(1, tan^2 n'/8)
 *
 * Where wo is behind n', `flip` mirrors n' about n, and `clamp` moves it towards wo until the
 * cosine between them is that of IMP_TURNED_LEAST. With `clamp` the value is continuous in n',
 * and the derivative of the value is the whole derivative of a picture; without it the value
 * jumps where wo passes the plane of n', and the jump moves with n'. */
#ifndef IMP_KIND_BSDF_TURNED_H
#define IMP_KIND_BSDF_TURNED_H

#include "kind/build.h"

/* Inputs of such a kind: a vector and its components. */
enum { IMP_TURNED_VECTOR, IMP_TURNED_X, IMP_TURNED_Y, IMP_TURNED_Z, IMP_TURNED_OWN };
#define IMP_TURNED_COMPONENT(key)                                                        \
    {                                                                                    \
        .name = key, .role = IMP_UNBOUNDED, .flags = IMP_INPUT_COMPONENT                 \
    }

/* With `clamp`: the least cosine of wo to n' over its length before it is unit. */
#define IMP_TURNED_LEAST 0.01

/* What an object of such a kind is. */
struct imp__turning {
    bool
        coded; /* components c are of a picture: n' = normalize(2 c - 1); else of n', not unit */
    bool flip, clamp, shadow;
    bool moves; /* n' has a derivative */
};
/* For imp_bsdf_ops.build: switches of the scene; flags are the nested material's. */
enum imp_status imp__turning_build(const struct imp_build *b, struct imp__turning *self,
                                   bool coded, struct imp_bsdf *bsdf);

/* The functions of a table. */
bool imp__turned_sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                        struct imp_dirs *d);
void imp__turned_eval(const struct imp_bsdf *b, const imp_spec *in,
                      const struct imp_dirs *d, imp_spec *f);
double imp__turned_pdf(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d);
double imp__turned_index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                               const struct imp_dirs *d);
void imp__turned_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *df);
void imp__turned_eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                                   const struct imp_dirs *d, imp_spec d_wo[3],
                                   imp_spec d_wi[3]);
void imp__turned_emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                      imp_spec *e);
void imp__turned_emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                        imp_spec *de);
void imp__turned_albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                        imp_spec *albedo);

/* What the tables of such kinds have in common. */
#define IMP__TURNED_OPS                                                                  \
    .size = sizeof(struct imp_bsdf_ops), .object_size = sizeof(struct imp__turning),     \
    .min_children = 1, .max_children = 1, .sample = imp__turned_sample,                  \
    .eval = imp__turned_eval, .pdf = imp__turned_pdf,                                    \
    .index_ratio = imp__turned_index_ratio, .eval_d = imp__turned_eval_d,                \
    .emit = imp__turned_emit, .emit_d = imp__turned_emit_d,                              \
    .albedo = imp__turned_albedo, .eval_directions_d = imp__turned_eval_directions_d

#endif
