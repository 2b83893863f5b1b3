/* SPDX-License-Identifier: Apache-2.0
 *
 * What a kind's build function gets, and the concepts' tables. Inputs (imp_input_desc)
 * are read by the engine before build is called; build reads the remaining properties
 * with imp_build_* (kinds.h, properties.c). Unread properties are an error afterwards. */
#ifndef IMP_KIND_BUILD_H
#define IMP_KIND_BUILD_H

#include "base/compiler.h"
#include "base/props.h"
#include <importon/kinds.h>

/* Embree takes larger numbers, and NaN, for a mistake of the caller: shapes that reach so
 * far vanish without a word, and rays end the process where it was built with assertions.
 */
#define IMP_REACH_MAX 1e18

struct imp_build {
    imp_context *ctx;
    struct imp_node *node;
    struct imp_arena *arena; /* lives as long as the scene */
    enum imp_color_mode mode;
    bool linear_colors; /* colours become spectra by the linear basis */
    /* Register the bulk data of a texture as a parameter: `data` [count] in place, shape
     * `dims`. Sets *param. */
    enum imp_status (*add_bulk)(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t *dims, unsigned flags, double lo,
                                double hi, int *param);
    void *scene;
};

/* Tables; each ends with NULL. */
extern const struct imp_bsdf_ops *const imp__bsdf_kinds[];
extern const struct imp_texture_ops *const imp__texture_kinds[];
extern const struct imp_texture_ops *const imp__volume_kinds[];
extern const struct imp_phase_ops *const imp__phase_kinds[];
extern const struct imp_medium_ops *const imp__medium_kinds[];
extern const struct imp_shape_ops *const imp__shape_kinds[];
extern const struct imp_emitter_ops *const imp__emitter_kinds[];
extern const struct imp_sensor_ops *const imp__sensor_kinds[];
extern const struct imp_filter_ops *const imp__filter_kinds[];

/* Reflects nothing, and has no inputs. No scene can name it. */
extern const struct imp_bsdf_ops imp__black;

/* The material's albedo, or its stand-in (imp_bsdf_ops.albedo). */
void imp__bsdf_albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                      imp_spec *albedo);

/* Does the material have the derivative of its smooth lobes with respect to directions, as a
 * whole? NULL: yes; else what lacks it, the material or one that is nested in it. */
const struct imp_bsdf *imp__bsdf_without_directions_d(const struct imp_bsdf *b);

/* Density and value of a direction; *f is anything where the density is not positive. */
static inline double imp__bsdf_pdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                                        const struct imp_dirs *d, imp_spec *f)
{
    if (imp_likely(b->ops->pdf_eval != NULL)) return b->ops->pdf_eval(b, in, d, f);
    const double p = b->ops->pdf(b, in, d);
    if (p > 0) b->ops->eval(b, in, d, f);
    return p;
}

/* Inputs at a point (src/kind/texture/input.c). in [n]. */
void imp__inputs_look_up(const struct imp_input *const *input, int n,
                         const struct imp_texcoord *at, imp_spec *in);
static inline void imp__inputs_eval(const struct imp_input *const *input, int n,
                                    const struct imp_texcoord *at, imp_spec *in)
{
    if (imp_likely(n == 1 && input[0]->plain && !at->carried)) in[0] = input[0]->value;
    else if (n > 0) imp__inputs_look_up(input, n, at, in);
}
/* Transpose: in_bar [n] goes to the parameters behind the inputs. */
void imp__inputs_give_back(const struct imp_input *const *input, int n,
                           const struct imp_texcoord *at, const imp_spec *in_bar,
                           struct imp_sink *sink);
static inline void imp__plain_scatter(const struct imp_input *input, const imp_spec *bar,
                                      struct imp_sink *sink)
{
    if (input->param >= 0)
        sink->add(sink, input->param, 0, input->count == 3 ? 3 : 1, bar);
}
static inline void imp__inputs_scatter(const struct imp_input *const *input, int n,
                                       const struct imp_texcoord *at,
                                       const imp_spec *in_bar, struct imp_sink *sink)
{
    if (imp_likely(n == 1 && input[0]->plain && !at->carried))
        imp__plain_scatter(input[0], in_bar, sink);
    else if (n > 0) imp__inputs_give_back(input, n, at, in_bar, sink);
}
/* Lane by lane, no less than the input anywhere in the box, at any wavelength. A texture
 * has a bound. */
void imp__input_most(const struct imp_input *input, const imp_v3 *lo, const imp_v3 *hi,
                     imp_spec *most);
/* Derivative in a direction: in_dot [n]. */
void imp__inputs_tangent(const struct imp_input *const *input, int n,
                         const struct imp_texcoord *at, imp_dot_fn *dot,
                         const void *x_dot, imp_spec *in_dot);

#endif
