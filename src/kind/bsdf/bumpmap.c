/* SPDX-License-Identifier: Apache-2.0
 *
 * bumpmap: a material whose normal is that of a surface raised by a texture, times
 * `scale` (Blinn 1978; turned.h). The texture may be in any slot. It has no derivative,
 * for the reason given in normalmap. */
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

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    return imp__turning_build(b, self, normal, bsdf);
}

const struct imp_bsdf_ops imp__bumpmap = {IMP__TURNED_OPS, .name = "bumpmap",
                                          .inputs = inputs, .prepare = prepare,
                                          .build = build};
