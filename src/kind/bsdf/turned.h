/* SPDX-License-Identifier: Apache-2.0
 *
 * A material in a frame that is turned over its surface (normalmap, bumpmap): with n' its
 * normal, the value is
 *
 *     g(wi) f(wo', wi')        where wi is on the same side of n as of n', 0 elsewhere
 *
 * f includes the cosine to n'. `flip` mirrors n' about n where wo would be behind it, and
 * g is the shadowing of Estevez, Lecocq and Stein (2019),
 *
 *     g = 2/(1 + sqrt(1 + A tan^2 wi)),    A = min(1, tan^2 n'/8) */
#ifndef IMP_KIND_BSDF_TURNED_H
#define IMP_KIND_BSDF_TURNED_H

#include "kind/build.h"

/* Normal of the nested material, in the frame of the surface, from the inputs: the only
 * thing in which kinds differ. It need not be unit. */
typedef imp_v3 imp__turned_normal(const imp_spec *in);

/* What an object of such a kind begins with. */
struct imp__turning {
    imp__turned_normal *normal;
    bool flip, shadow;
};
/* For imp_bsdf_ops.build: `normal`, flip_invalid_normals and use_shadowing_function; flags
 * are the nested material's. */
enum imp_status imp__turning_build(const struct imp_build *b, struct imp__turning *self,
                                   imp__turned_normal *normal, struct imp_bsdf *bsdf);

/* The functions of a table. The inputs that turn have no derivative: 0. */
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
    .emit = imp__turned_emit, .emit_d = imp__turned_emit_d, .albedo = imp__turned_albedo

#endif
