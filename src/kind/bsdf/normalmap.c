/* SPDX-License-Identifier: Apache-2.0
 *
 * normalmap: a material whose normal is that of a picture, n' = normalize(2 c - 1) in the
 * shading frame (turned.h). */
#include "turned.h"

static const struct imp_input_desc inputs[] = {
    {.name = "normalmap",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_VECTOR | IMP_INPUT_REQUIRED,
     .fallback = 0.5,
     .hi = 1,
     .unit = "1"},
    IMP_TURNED_COMPONENT("normalmap"),
    IMP_TURNED_COMPONENT("normalmap"),
    IMP_TURNED_COMPONENT("normalmap"),
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    return imp__turning_build(b, self, true, bsdf);
}

const struct imp_bsdf_ops imp__normalmap = {IMP__TURNED_OPS, .name = "normalmap",
                                            .inputs = inputs, .build = build};
