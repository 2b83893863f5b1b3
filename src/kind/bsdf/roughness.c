/* SPDX-License-Identifier: Apache-2.0
 *
 * The properties `alpha`, `alpha_u`, `alpha_v`, `distribution` and `sample_visible`, read and
 * checked for all microfacet kinds. */
#include "roughness.h"
#include "kind/build.h"

static void raise_to_least(struct imp_prop *p)
{
    if (p && p->type == IMP_PROP_FLOAT && p->number[0] >= 0)
        p->number[0] = imp_max(p->number[0], IMP_ALPHA_MIN);
    if (p && p->type == IMP_PROP_INTEGER && p->integer == 0) {
        p->type = IMP_PROP_FLOAT;
        p->number[0] = IMP_ALPHA_MIN;
    }
}

enum imp_status imp__roughness_prepare(const struct imp_build *b)
{
    static const char *const names[] = {"alpha", "alpha_u", "alpha_v"};
    enum imp_status st = IMP_OK;
    const bool iso = imp_build_has(b, "alpha"), u = imp_build_has(b, "alpha_u"),
               v = imp_build_has(b, "alpha_v");
    if (u != v || (iso && u))
        IMP_TRY(imp_build_error(b,
                                iso ? "alpha"
                                : u ? "alpha_u"
                                    : "alpha_v",
                                IMP_E_SCENE,
                                "give either 'alpha', or both 'alpha_u' and 'alpha_v'"));
    if (!iso && !u) IMP_TRY(imp_build_set(b, "alpha", 1, &(double){0.1}));
    for (int i = 0; i < 3; i++) raise_to_least(imp__node_prop(b->node, names[i]));
out:
    return st;
}

enum imp_status imp__roughness_build(const struct imp_build *b, struct imp__roughness *r)
{
    static const char *const types[] = {"beckmann", "ggx"};
    enum imp_status st = IMP_OK;
    int type;
    IMP_TRY(imp_build_choice(b, "distribution", types, 2, IMP_BECKMANN, &type));
    IMP_TRY(imp_build_bool(b, "sample_visible", true, &r->visible));
    r->type = (enum imp__distribution)type;
    r->anisotropic = imp_build_has(b, "alpha_u");
out:
    return st;
}
