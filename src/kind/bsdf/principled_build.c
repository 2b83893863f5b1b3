/* SPDX-License-Identifier: Apache-2.0
 *
 * principled: its inputs, and how it is made of them. */
#include "burley.h"
#include "principled.h"

#define OPTIONAL(key) IMP_BURLEY_NUMBER(key, IMP_INPUT_OPTIONAL, 0)
const struct imp_input_desc imp__principled_inputs[] = {
    IMP_BURLEY_COLOR("base_color"),
    {.name = "base_color", .flags = IMP_INPUT_LUMINANCE, .fallback = 0.5, .hi = 1},
    IMP_BURLEY_NUMBER("roughness", 0, 0.5),
    OPTIONAL("anisotropic"),
    OPTIONAL("metallic"),
    OPTIONAL("spec_trans"),
    {.name = "eta",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_OPTIONAL | IMP_INPUT_NUMBER,
     .fallback = 1.5,
     .lo = 0.1,
     .hi = 10,
     .unit = "1"},
    IMP_BURLEY_NUMBER("specular", IMP_INPUT_OPTIONAL | IMP_INPUT_NUMBER, 0.5),
    OPTIONAL("spec_tint"),
    OPTIONAL("sheen"),
    OPTIONAL("sheen_tint"),
    OPTIONAL("flatness"),
    OPTIONAL("clearcoat"),
    OPTIONAL("clearcoat_gloss"),
    {0}};

/* The number that a property is written as; NaN: it is absent, or no number. */
static double number(const struct imp_node *node, const char *name)
{
    const struct imp_prop *p = imp__node_prop(node, name);
    if (p && p->type == IMP_PROP_FLOAT) return p->number[0];
    return p && p->type == IMP_PROP_INTEGER ? (double)p->integer : NAN;
}
static void number_set(struct imp_node *node, const char *name, double value)
{
    struct imp_prop *p = imp__node_prop(node, name);
    p->type = IMP_PROP_FLOAT;
    p->number[0] = value;
}

enum imp_status imp__principled_prepare(const struct imp_build *b)
{
    enum imp_status st = IMP_OK;
    struct imp_node *node = b->node;
    if (imp_build_has(b, "eta") && imp_build_has(b, "specular"))
        IMP_TRY(imp_build_error(b, "specular", IMP_E_SCENE,
                                "give either 'eta' or 'specular'"));
    if (number(node, "spec_trans") == 0) imp__node_remove(node, "spec_trans");
    if (!imp_build_has(b, "eta") && !imp_build_has(b, "specular"))
        IMP_TRY(imp_build_set(b, "specular", 1, &(double){0.5}));
    if (imp_build_has(b, "spec_trans")) { /* glass has an index */
        if (number(node, "eta") == 1) number_set(node, "eta", 1.001);
        if (number(node, "specular") == 0) number_set(node, "specular", 1e-3);
    }
out:
    return st;
}

enum imp_status imp__principled_build(const struct imp_build *b, void *self,
                                      struct imp_bsdf *bsdf)
{
    /* How Mitsuba shares out its draws: they change no mean. */
    static const char *const rates[] = {"main_specular_sampling_rate",
                                        "clearcoat_sampling_rate",
                                        "diffuse_reflectance_sampling_rate"};
    enum imp_status st = IMP_OK;
    struct imp__principled_self *p = self;
    double rate;
    for (size_t k = 0; k < imp_count(rates); k++)
        IMP_TRY(imp_build_float(b, rates[k], 1, &rate));
    p->transmits = imp_build_has(b, "spec_trans");
    p->coated = imp_build_has(b, "clearcoat");
    p->by_eta = imp_build_has(b, "eta");
    bsdf->flags = IMP_BSDF_SMOOTH | (p->transmits ? IMP_BSDF_TRANSMIT : 0);
    if (p->transmits) imp__ggx_glass_jumps(bsdf, p->by_eta ? ETA : SPECULAR);
out:
    return st;
}
