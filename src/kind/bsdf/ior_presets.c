/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials with a known index of refraction, by name, and how a BSDF reads its index. */
#include "presets.h"
#include <math.h>
#include <stdio.h>
#include <strings.h>

/* Refractive indices by name (docs/scene-format.md A.2). */
static const struct {
    const char *name;
    double n;
} indices[] = {
    {"vacuum", 1},        {"helium", 1.000036},        {"hydrogen", 1.000132},
    {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.3330},
    {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
    {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
    {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
    {"pyrex", 1.470},     {"acrylic glass", 1.49},     {"polypropylene", 1.49},
    {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
    {"pet", 1.575},       {"diamond", 2.419},
};

enum imp_status imp__ior_read(const struct imp_build *b, const char *name,
                              const char *fallback, double *ior)
{
    enum imp_status st = IMP_OK;
    const struct imp_prop *p = imp__node_prop(b->node, name);
    double n = NAN;

    if (p && p->type != IMP_PROP_STRING) {
        IMP_TRY(imp_build_float(b, name, 1, &n));
        if (!(n > 0) || !isfinite(n))
            IMP_TRY(imp_build_error(b, name, IMP_E_SCENE,
                                    "'%s' = %g: a refractive index is positive", name,
                                    n));
    } else {
        const char *material;
        IMP_TRY(imp_build_string(b, name, fallback, &material));
        for (size_t i = 0; i < imp_count(indices); i++)
            if (strcasecmp(indices[i].name, material) == 0) n = indices[i].n;
        if (isnan(n)) {
            char list[1024] = "";
            size_t len = 0;
            for (size_t i = 0; i < imp_count(indices) && len < sizeof list; i++)
                len += (size_t)snprintf(list + len, sizeof list - len, "%s%s",
                                        i ? ", " : "", indices[i].name);
            IMP_TRY(imp_build_error(b, name, IMP_E_SCENE,
                                    "'%s': unknown material '%s'; known are %s", name,
                                    material, list));
        }
    }
    *ior = n;
out:
    return st;
}

enum imp_status imp__ior_prepare(const struct imp_build *b, const char *inside,
                                 bool may_be_equal)
{
    enum imp_status st = IMP_OK;
    double n_inside, n_outside;
    if (imp_build_has(b, "eta"))
        IMP_TRY(imp_build_error(b, "eta", IMP_E_SCENE,
                                "give 'int_ior' and 'ext_ior' instead of 'eta'"));
    IMP_TRY(imp__ior_read(b, "int_ior", inside, &n_inside));
    IMP_TRY(imp__ior_read(b, "ext_ior", "air", &n_outside));
    if (n_inside == n_outside && !may_be_equal)
        IMP_TRY(imp_build_error(b, "int_ior", IMP_E_SCENE,
                                "int_ior and ext_ior are equal (%g): there is no "
                                "boundary to be rough",
                                n_inside));
    IMP_TRY(imp_build_set(b, "eta", 1, &(double){n_inside / n_outside}));
out:
    return st;
}
