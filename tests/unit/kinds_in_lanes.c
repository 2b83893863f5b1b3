/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of materials in lanes (kind/kind_lanes.h) beside the materials' own, to the bit: at
 * directions of all of the sphere, at those that the material draws, and at grazing ones; at inputs
 * that lanes do not share, some of them where they are cut. */
#include "bundle_scenes.h"
#include "imp_tap.h"
#include "kind/build.h"
#include "kind/kind_lanes.h"
#include "math/vec.h"
#include "scene/scene.h"

static imp_context *ctx;

/* -0 and 0 are the same where they are added up. */
static bool same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

static double uniform(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 11) * 0x1p-53;
}
static imp_v3 direction(uint64_t *state, int kind)
{
    const double z = kind % 3 == 0   ? 2 * uniform(state) - 1
                     : kind % 3 == 1 ? uniform(state)
                                     : 1e-3 * (2 * uniform(state) - 1);
    const double phi = IMP_2PI * uniform(state), r = sqrt(1 - z * z);
    return imp__v3(r * cos(phi), r * sin(phi), z);
}

struct lanes {
    struct imp_wide_color in[IMP_INPUTS_MAX];
    imp_wide3 wo, wi;
    imp_wide_lobe lobe;
};

/* Colours differ in all lanes. Numbers keep their value, as roughnesses and indices of tables need, or
 * differ, too, where those of kinds are textures: but for indices, some are beyond what counts. */
static void inputs_set(const imp_scene *scene, const struct imp_bsdf *b, bool apart,
                       uint64_t *state, struct lanes *x)
{
    static const double beyond[] = {-.2, 0, 1e-5, 1, 1.3};
    const struct imp_texcoord anywhere = {.prim = -1};
    imp_spec own[IMP_INPUTS_MAX];
    imp__inputs_look_up(b->input, b->n_in, &anywhere, own);
    for (int j = 0; j < b->n_in; j++) {
        x->in[j] = imp__wide_color(own[j]);
        for (int k = 0; k < IMP_WIDE_LANES && !b->input[j]->scalar; k++)
            for (int c = 0; c < 3; c++)
                x->in[j].c[c][k] *= uniform(state) < 0.1 ? 0 : 0.5 + 0.5 * uniform(state);
        const int param = b->input[j]->param;
        const char *name = param < 0 ? "" : scene->params[param].info.name;
        if (!apart || !b->input[j]->scalar || param < 0 || strstr(name, "eta") ||
            strstr(name, "ior"))
            continue;
        for (int k = 0; k < IMP_WIDE_LANES; k++) {
            const double v =
                uniform(state) < 0.3 ? beyond[(int)(5 * uniform(state))] : uniform(state);
            for (int c = 0; c < 3; c++) x->in[j].c[c][k] = v;
        }
    }
}

static struct imp_dirs lane_dirs(const struct lanes *x, int k)
{
    return (struct imp_dirs){imp__wide3_lane(&x->wo, k), imp__wide3_lane(&x->wi, k),
                             (int)x->lobe[k], 0};
}
static int differing(const struct imp_bsdf *b, const struct lanes *x,
                     const struct imp_wide_color *d, int *some)
{
    int wrong = 0;
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        imp_spec in[IMP_INPUTS_MAX], df[IMP_INPUTS_MAX];
        const struct imp_dirs dirs = lane_dirs(x, k);
        for (int j = 0; j < b->n_in; j++) in[j] = imp__color_lane(&x->in[j], 3, k);
        b->ops->eval_d(b, in, &dirs, df);
        for (int j = 0; j < b->n_in; j++) {
            const int param = b->input[j]->param;
            /* of what is not written nobody takes a derivative */
            if (param < 0 && !b->input[j]->luminance) continue;
            for (int c = 0; c < 3; c++) {
                wrong += !same(df[j][c], d[j].c[c][k]);
                *some += df[j][c] != 0;
            }
        }
    }
    return wrong;
}

/* apart: its numbers may be textures. */
static void compare_as(const char *text, bool apart)
{
    static char xml[4096];
    static struct lanes x;
    static struct imp_wide_color d[IMP_INPUTS_MAX];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s<sensor type='perspective'/><shape "
             "type='rectangle'>%s</shape></scene>",
             PATH(""), text);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    const struct imp_bsdf *b = imp__shape_bsdf(scene, scene->shapes[0]);
    const struct imp_bsdf_lanes *kernel = imp__bsdf_lanes(b);
    uint64_t state = 7;
    int wrong = 0, some = 0;
    for (int round = 0; kernel && round < 600; round++) {
        inputs_set(scene, b, apart, &state, &x);
        for (int k = 0; k < IMP_WIDE_LANES; k++) {
            imp__wide3_set(&x.wo, k, direction(&state, round));
            imp__wide3_set(&x.wi, k, direction(&state, round / 3));
        }
        x.lobe = imp__wide_smooth();
        if (round % 2) {
            imp_wide u[3];
            for (int k = 0; k < 3 * IMP_WIDE_LANES; k++)
                u[k % 3][k / 3] = uniform(&state);
            kernel->sample(b, 0, x.in, &x.wo, u, &x.wi, &x.lobe);
        }
        wrong += !kernel->eval_d(b, x.in, &x.wo, &x.wi, &x.lobe, 3, d) ||
                 differing(b, &x, d, &some) > 0;
    }
    tap_ok(kernel && wrong == 0 && some > 100 * IMP_WIDE_LANES,
           "%.60s%s: of %d numbers that are not 0, %d rounds of 600 have others", text,
           apart ? " in textures" : "", some, wrong);
    imp_scene_destroy(scene);
}
static void compare(const char *text) { compare_as(text, false); }

#define KIND(type, more) "<bsdf type='" type "'>" more "</bsdf>"
#define RED              "<rgb name='diffuse_reflectance' value='.8,.2,.1'/>"
#define TINT(name)       "<rgb name='" name "' value='.9,.5,.3'/>"
#define GGX              "<string name='distribution' value='ggx'/>"
#define NONLINEAR        "<boolean name='nonlinear' value='true'/>"

int main(void)
{
    ctx = test_context(1);
    compare(DIFFUSE(".5,.6,.7"));
    compare(KIND("conductor", TINT("specular_reflectance")));
    compare(
        KIND("dielectric", TINT("specular_reflectance") TINT("specular_transmittance")));
    compare(KIND("plastic", RED TINT("specular_reflectance")));
    compare(KIND("plastic", NONLINEAR RED ALPHA("int_ior", "1") ALPHA("ext_ior", "1.4")));
    compare(GOLD(ALPHA("alpha", ".2")));
    compare(GOLD(TINT("specular_reflectance") ALPHA("alpha_u", ".05")
                     ALPHA("alpha_v", ".4")));
    compare(
        KIND("roughplastic", GGX RED TINT("specular_reflectance") ALPHA("alpha", ".2")));
    compare(KIND("roughplastic",
                 GGX NONLINEAR RED ALPHA("alpha", ".05") ALPHA("int_ior", "1.9")));
    compare(KIND("roughdielectric", GGX TINT("specular_reflectance") TINT(
                                        "specular_transmittance") ALPHA("alpha", ".2")));
    compare(KIND("roughdielectric", GGX ALPHA("alpha_u", ".1") ALPHA("alpha_v", ".5")
                                        ALPHA("int_ior", "1") ALPHA("ext_ior", "1.6")));
    compare(KIND("roughconductor", ALPHA("alpha", ".2") TINT("specular_reflectance")));
    compare(KIND("roughplastic", RED TINT("specular_reflectance") ALPHA("alpha", ".3")));
    compare(KIND("roughdielectric", TINT("specular_transmittance") ALPHA("alpha_u", ".3")
                                        ALPHA("alpha_v", ".15")));
    compare(KIND("principled", ""));
    compare(KIND("principled",
                 TINT("base_color") ALPHA("spec_tint", ".6") ALPHA("sheen", ".7")
                     ALPHA("sheen_tint", ".5") ALPHA("flatness", ".3")
                         ALPHA("anisotropic", ".6") ALPHA("roughness", ".4")
                             ALPHA("metallic", ".3") ALPHA("specular", ".4")));
    compare(KIND("principled", TINT("base_color") ALPHA("eta", ".7") ALPHA("sheen", ".4")
                                   ALPHA("metallic", ".2") ALPHA("spec_tint", ".9")));
    compare(KIND("principled", TINT("base_color") ALPHA("clearcoat", ".7")
                                   ALPHA("clearcoat_gloss", ".3") ALPHA("eta", ".8")
                                       ALPHA("metallic", ".4")));
    compare(KIND("principled", ALPHA("clearcoat", "0") ALPHA("specular", ".2")));
    compare(KIND("principled", ALPHA("roughness", "0.01") ALPHA("metallic", "1")
                                   ALPHA("anisotropic", "1")));
    compare(KIND("principled",
                 TINT("base_color") ALPHA("spec_trans", ".6") ALPHA("roughness", ".4")
                     ALPHA("anisotropic", ".5") ALPHA("metallic", ".2")
                         ALPHA("sheen", ".3") ALPHA("spec_tint", ".4")));
    compare(KIND("principled", ALPHA("spec_trans", "1") ALPHA("eta", ".7")
                                   ALPHA("roughness", ".1") ALPHA("clearcoat", ".7")));
    compare_as(GOLD(ALPHA("alpha", ".2")), true);
    compare_as(KIND("roughconductor", ALPHA("alpha_u", ".2") ALPHA("alpha_v", ".4")),
               true);
    compare_as(KIND("roughdielectric", GGX ALPHA("alpha", ".2")), true);
    compare_as(KIND("roughdielectric", ALPHA("alpha_u", ".2") ALPHA("alpha_v", ".4")),
               true);
    compare_as(KIND("principled",
                    TINT("base_color") ALPHA("spec_tint", ".6") ALPHA("sheen", ".7")
                        ALPHA("sheen_tint", ".5") ALPHA("flatness", ".3")
                            ALPHA("anisotropic", ".6") ALPHA("roughness", ".4")
                                ALPHA("metallic", ".3") ALPHA("specular", ".4") ALPHA(
                                    "clearcoat", ".5") ALPHA("clearcoat_gloss", ".5")),
               true);
    compare_as(KIND("principled",
                    TINT("base_color") ALPHA("spec_trans", ".7") ALPHA("roughness", ".4")
                        ALPHA("metallic", ".3") ALPHA("sheen", ".4")
                            ALPHA("specular", ".4") ALPHA("clearcoat", ".5")
                                ALPHA("clearcoat_gloss", ".5")),
               true);
    compare(KIND("twosided", KIND("plastic", RED) GOLD(ALPHA("alpha", ".3"))));
    imp_context_destroy(ctx);
    return tap_done();
}
