/* SPDX-License-Identifier: Apache-2.0
 *
 * bumpmap: a material whose normal is that of a surface raised by a texture, times
 * `scale` (Blinn 1978; turned.h). The texture may be in any slot. */
#include "turned.h"
#include <string.h>

static const struct imp_input_desc inputs[] = {
    {.name = "nested_texture",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_BUMP | IMP_INPUT_REQUIRED,
     .unit = "1"},
    IMP_TURNED_COMPONENT("nested_texture"),
    IMP_TURNED_COMPONENT("nested_texture"),
    IMP_TURNED_COMPONENT("nested_texture"),
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
    if (texture) texture->name = inputs[IMP_TURNED_VECTOR].name;
    return IMP_OK;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    return imp__turning_build(b, self, false, bsdf);
}

const struct imp_bsdf_ops imp__bumpmap = {IMP__TURNED_OPS, .name = "bumpmap",
                                          .inputs = inputs, .prepare = prepare,
                                          .build = build};
