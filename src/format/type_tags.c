/* SPDX-License-Identifier: Apache-2.0
 *
 * From the type of an object to its tag. Dictionaries of Mitsuba name types alone; a type
 * belongs to one tag there. Types that this version cannot make are in the table too:
 * messages then name what they are. */
#include "base/nearest.h"
#include "kind/registry.h"
#include "tree.h"
#include <string.h>

/* Objects that have no table of functions of their own, and kinds of Mitsuba 3.9. */
static const struct {
    const char *tag, *types; /* separated by blanks */
} others[] = {
    {"integrator",
     "path direct depth aov moment stam elements prb prb_basic "
     "direct_projective prb_projective prbvolpath volpath volpathmis ptracer "
     "photons light bdpt stokes"},
    {"film", "hdrfilm specfilm ldrfilm tiledhdrfilm mfilm"},
    {"sampler", "independent stratified multijitter orthogonal ldsampler"},
    {"medium", "graded homogeneous heterogeneous"},
    {"phase", "isotropic hg rayleigh tabphase sggx blendphase"},
    {"volume", "gridvolume constvolume expvolume grid profile"},
    {"spectrum", "uniform srgb rawconstant d65 regular irregular blackbody "
                 "illuminant rayleigh"},
    {"rfilter", "box tent gaussian mitchell catmullrom lanczos"},
    {"bsdf", "plastic roughplastic roughdielectric thindielectric principled "
             "principledthin bumpmap normalmap blendbsdf mask measured hair polarizer "
             "retarder circular pplastic"},
    {"emitter", "envmap directional directionalarea spot projector sunsky ciesky "
                "perezsky"},
    {"shape",
     "obj ply serialized cube sphere cylinder disk rectangle shapegroup instance "
     "sdfgrid bsplinecurve linearcurve ellipsoids heightfield merge"},
    {"sensor", "radiancemeter irradiancemeter distant batch thinlens"},
};

enum imp_status imp__tag_of_type(imp_context *ctx, const char *type, const char **tag)
{
    struct imp_nearest near = imp__nearest(type);
    static _Thread_local char words[64]; /* of the nearest word in `others` */
    *tag = imp__kind_tag(ctx, type, &near);
    for (size_t i = 0; !*tag && i < imp_count(others); i++)
        for (const char *w = others[i].types; *w; w += strspn(w, " ")) {
            const size_t n = strcspn(w, " ");
            char word[sizeof words] = "";
            memcpy(word, w, imp_min(n, sizeof word - 1));
            if (strcmp(word, type) == 0) *tag = others[i].tag;
            const size_t before = near.distance;
            imp__nearest_try(&near, word);
            if (near.distance < before) near.best = strcpy(words, word);
            w += n;
        }
    if (*tag) return IMP_OK;
    return imp__error(ctx, IMP_E_UNSUPPORTED, "there is no plugin '%s'%s%s%s", type,
                      near.best ? "; did you mean '" : "", near.best ? near.best : "",
                      near.best ? "'?" : "");
}
