/* SPDX-License-Identifier: Apache-2.0
 *
 * bumpmap: a material whose normal is that of a surface raised by a texture, times `scale`
 * (Blinn 1978; turned.h). The texture may stand in any slot. It has no derivative, as that
 * of normalmap. */
#include "math/vec.h"
#include "turned.h"
#include <string.h>

enum { HEIGHT };

static const struct imp_input_desc inputs[] = {
    {.name = "nested_texture",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_BUMP | IMP_INPUT_FIXED | IMP_INPUT_REQUIRED,
     .unit = "1"},
    {0}};

static enum imp_status prepare(const struct imp_build *b)
{
    struct imp_child *texture = NULL;
    for (size_t i = 0; i < b->node->n_children; i++) {
        struct imp_child *c = &b->node->children[i];
        if (strcmp(c->node->tag, "texture") != 0) continue;
        if (texture)
            return imp__node_error(b->ctx, c->node, IMP_E_SCENE,
                                   "is a second texture; a bumpmap has one");
        texture = c;
    }
    if (texture) texture->name = inputs[HEIGHT].name;
    return IMP_OK;
}

static imp_v3 normal(const imp_spec *in)
{
    return imp__v3(in[HEIGHT][0], in[HEIGHT][1], in[HEIGHT][2]);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    return imp__turned_sample(b, in, u, d, normal);
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    imp__turned_eval(b, in, d, normal, f);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    return imp__turned_pdf(b, in, d, normal);
}
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    return imp__turned_index_ratio(b, in, d, normal);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    imp__turned_eval_d(b, in, d, normal, df);
}
static void emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e)
{
    imp__turned_emit(b, in, wo, normal, e);
}
static void emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de)
{
    imp__turned_emit_d(b, in, wo, normal, de);
}

const struct imp_bsdf_ops imp__bumpmap = {.size = sizeof(struct imp_bsdf_ops),
                                          .name = "bumpmap",
                                          .object_size = sizeof(struct imp__turning),
                                          .inputs = inputs,
                                          .min_children = 1,
                                          .max_children = 1,
                                          .prepare = prepare,
                                          .build = imp__turning_build,
                                          .sample = sample,
                                          .eval = eval,
                                          .pdf = pdf,
                                          .index_ratio = index_ratio,
                                          .eval_d = eval_d,
                                          .emit = emit,
                                          .emit_d = emit_d,
                                          .albedo = imp__turned_albedo};
