/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks in bundles beside the same walks alone (bundle_kit.h): materials, with a form in lanes and
 * without one. */
#include "bundle_kit.h"

static void materials(void)
{
    compare("rough gold, from both sides", IMP_RGB, 5, PATH(DEPTH("6")), CAMERA,
            SKY LAMP("0", "0", ".6")
                CUBE(".7", "-.6", GOLD(ALPHA("alpha_u", ".05") ALPHA("alpha_v", ".4")))
                    BALL("-.7", ".4",
                         "<bsdf type='twosided'>" GOLD(ALPHA("alpha", ".15")) "</bsdf>")
                        WALL("0", "-1.4", "0", "x", "90",
                             "<bsdf type='twosided'>" DIFFUSE(".3,.6,.9") "</bsdf>")
                            WALL("0", "0", "-1.8", "y", "40",
                                 "<bsdf type='twosided'>" DIFFUSE(".3,.6,.9")
                                     GOLD(ALPHA("alpha", ".2")) "</bsdf>")
                                WALL("0", "0", "-1.9", "y", "0", DIFFUSE("0,0,.5")));
    compare("textures", IMP_RGB, 4, PATH(DEPTH("5")), CAMERA,
            SKY WALL("0", "-1", "0", "x", "-90", CHECKERS)
                WALL("0", "0", "-1.5", "y", "10", CHECKERS) CUBE("-.6", "0", CHECKERS)
                    BALL(".7", ".3", CHECKERS));
}

/* Lobes without a density. */
static void ideal(void)
{
    static const char *const things = BALL(".8", ".3", "<bsdf type='dielectric'/>")
        BALL("-.8", ".3",
             "<bsdf type='dielectric'><rgb name='specular_reflectance' "
             "value='0,.5,1'/><rgb name='specular_transmittance' "
             "value='1,.2,0'/></bsdf>")
            CUBE("0", "-.6",
                 "<bsdf type='conductor'><string name='material' "
                 "value='Au'/></bsdf>")
                BALL("0", "1.2",
                     "<bsdf type='twosided'><bsdf type='conductor'><rgb "
                     "name='specular_reflectance' value='.9,0,.5'/></bsdf>" DIFFUSE(
                         ".2,.9,.4") "</bsdf>")
                    CUBE("1.4", "-1.3",
                         "<bsdf type='twosided'><boolean name='allow_transmission' "
                         "value='true'/><bsdf type='dielectric'><float name='int_ior' "
                         "value='1'/><float name='ext_ior' value='2'/></bsdf></bsdf>");
    static char rest[8192];
    snprintf(rest, sizeof rest, "%s%s", ROOM LAMP("0", "0", ".5"), things);
    compare("glass and mirrors", IMP_RGB, 10, PATH(DEPTH("12") RR("2")), CAMERA, rest);
    compare("glass and mirrors, independent walks", IMP_RGB, 10, PATH(DEPTH("5")), CAMERA,
            rest);
    compare("glass and mirrors in spectra", IMP_SPECTRAL, 10, PATH(DEPTH("8")), CAMERA,
            rest);
    snprintf(rest, sizeof rest, "%s%s",
             ROOM LAMP("0", "0", ".3") LAMP("1", "0", ".2") LAMP("-1", "0", ".2"),
             things);
    compare("glass and mirrors, lamps by a tree", IMP_RGB, 10,
            PATH(DEPTH("6") "<string name='light_choice' value='tree'/>"), CAMERA, rest);
    snprintf(rest, sizeof rest, "%s%s",
             SKY WALL("0", "-1.7", "0", "x", "-90", CHECKERS) LAMP("0", "0", ".5"),
             things);
    compare("glass and mirrors under a sky", IMP_RGB, 6, PATH(DEPTH("9")), CAMERA, rest);
}

#define KIND(type, more) "<bsdf type='" type "'>" more "</bsdf>"
#define RED              "<rgb name='diffuse_reflectance' value='.8,.2,.1'/>"
#define PICTURE(name)                                                                    \
    "<texture type='bitmap' name='" name                                                 \
    "'><string name='filename' value='%s'/><boolean "                                    \
    "name='raw' value='true'/></texture>"
#define GGX    "<string name='distribution' value='ggx'/>"
#define UNSEEN "<boolean name='sample_visible' value='false'/>"

/* Bitmaps by all their wrap modes and filters, as colours and as numbers. */
static void bitmaps(void)
{
    static const char *const wraps[] = {"repeat", "mirror", "clamp"};
    static char path[64], rest[16384], each[1024];
    if (!picture_write(path)) {
        tap_ok(false, "a file for a picture");
        return;
    }
    strcpy(rest, SKY LAMP("0", "0", ".5"));
    for (int k = 0; k < 12; k++) {
        const bool number = k >= 6;
        snprintf(each, sizeof each,
                 "<shape type='rectangle'><transform name='to_world'><scale "
                 "value='.5'/><rotate y='1' angle='%d'/><translate x='%g' y='%g' "
                 "z='%g'/></transform><bsdf type='%s'>%s<texture type='bitmap' "
                 "name='%s'><string name='filename' value='%s'/><string name='wrap_mode' "
                 "value='%s'/><string name='filter_type' value='%s'/>%s</texture></bsdf>"
                 "</shape>",
                 k * 7 - 30, k % 4 * .9 - 1.4, k / 4 * .9 - .9, -.2 * (k % 3),
                 number ? "roughconductor" : "diffuse", number ? GGX : "",
                 number ? "alpha" : "reflectance", path, wraps[k % 3],
                 k % 2 ? "nearest" : "bilinear",
                 k == 4 ? ""
                        : "<transform name='to_uv'><scale value='2.7'/><rotate z='1' "
                          "angle='20'/><translate x='-.9' y='-.8'/></transform>");
        strcat(rest, each);
    }
    compare("bitmaps", IMP_RGB, 12, PATH(DEPTH("5")), CAMERA, rest);
    compare("bitmaps in grey", IMP_MONO, 12, PATH(DEPTH("5")), CAMERA, rest);
    compare("bitmaps in spectra", IMP_SPECTRAL, 12, PATH(DEPTH("4")), CAMERA, rest);
    unlink(path);
}

/* Kinds with a form in lanes and without one, which are called lane by lane; with texels among their
 * inputs. */
static void all_kinds(void)
{
    static const char *const kinds[] = {
        KIND("plastic", RED),
        KIND("plastic", PICTURE("diffuse_reflectance")),
        KIND("roughplastic", RED "<boolean name='nonlinear' value='true'/>"),
        KIND("roughplastic", GGX PICTURE("diffuse_reflectance")),
        KIND("roughdielectric", GGX ALPHA("alpha", ".2")),
        KIND("roughdielectric", GGX ALPHA("alpha_u", ".1") ALPHA("alpha_v", ".5")
                                    ALPHA("int_ior", "1") ALPHA("ext_ior", "1.6")),
        KIND("roughdielectric", ALPHA("alpha", ".2")),
        KIND("roughdielectric", GGX ALPHA("alpha", ".08")),
        KIND("roughdielectric", GGX ALPHA("alpha_u", ".05") ALPHA("alpha_v", ".3")),
        KIND("roughconductor", ALPHA("alpha", ".2")),
        KIND("roughconductor", ALPHA("alpha_u", ".05") ALPHA("alpha_v", ".3")),
        KIND("roughplastic", RED ALPHA("alpha", ".04")),
        KIND("roughdielectric", GGX UNSEEN ALPHA("alpha", ".2")),
        KIND("roughconductor", UNSEEN ALPHA("alpha", ".1")),
        KIND("principled",
             PICTURE("base_color") ALPHA("metallic", ".4") ALPHA("clearcoat", ".5")),
        KIND("principled", PICTURE("clearcoat_gloss") ALPHA("clearcoat", ".9")),
        KIND("principled", ALPHA("spec_trans", ".8") ALPHA("roughness", ".3")),
        KIND("principled", PICTURE("spec_trans") ALPHA("clearcoat", ".6")
                               ALPHA("anisotropic", ".5") ALPHA("specular", ".7")),
        KIND("principled",
             "<rgb name='base_color' value='.8,.3,.1'/>" ALPHA("spec_tint", ".6")
                 ALPHA("sheen", ".7") ALPHA("sheen_tint", ".5") ALPHA("flatness", ".3")
                     ALPHA("anisotropic", ".6") ALPHA("roughness", ".4")
                         ALPHA("metallic", ".3")),
        KIND("principled", PICTURE("base_color") ALPHA("eta", ".7") ALPHA("sheen", ".4")
                               ALPHA("sheen_tint", "1")),
        KIND("principled", PICTURE("roughness") ALPHA("specular", ".9")),
        KIND("thindielectric", ""),
        KIND("mask", ALPHA("opacity", ".5") DIFFUSE(".9,.1,.1")),
        KIND("blendbsdf",
             ALPHA("weight", ".3") DIFFUSE(".1,.9,.1") KIND("conductor", "")),
        KIND("normalmap", PICTURE("normalmap") DIFFUSE(".4,.5,.9")),
        KIND("bumpmap", PICTURE("height") KIND("roughplastic", RED)),
        KIND("twosided", KIND("phong", RED)),
        KIND("null", ""),
    };
    static char path[64], rest[40000], at[16384], with[2048], text[1024];
    if (!picture_write(path)) {
        tap_ok(false, "a file for a picture");
        return;
    }
    at[0] = 0;
    for (size_t k = 0; k < imp_count(kinds); k++) {
        snprintf(text, sizeof text, kinds[k], path);
        snprintf(with, sizeof with,
                 "<shape type='sphere'><point name='center' x='%g' y='%g' z='%g'/><float "
                 "name='radius' value='.29'/>%s</shape>",
                 (double)(k % 7) * .6 - 1.8, (double)(k / 7) * .6 - 1.2, k % 2 * .5 - .5,
                 text);
        strcat(at, with);
    }
    const int n = 6 + (int)imp_count(kinds) - 2; /* without the lamp, and without null */
    snprintf(rest, sizeof rest, "%s%s", ROOM LAMP("0", "0", ".5"), at);
    compare("many kinds", IMP_RGB, n, PATH(DEPTH("8") RR("3")), CAMERA, rest);
    compare("many kinds, independent walks", IMP_RGB, n, PATH(DEPTH("5")), CAMERA, rest);
    snprintf(rest, sizeof rest, "%s%s",
             ROOM LAMP("0", "0", ".3") LAMP("1", "0", ".2") LAMP("-1", "0", ".2"), at);
    compare("many kinds, lamps by a tree", IMP_RGB, n,
            PATH(DEPTH("5") "<string name='light_choice' value='tree'/>"), CAMERA, rest);
    snprintf(rest, sizeof rest, "%s%s", WALL("0", "-1.7", "0", "x", "-90", CHECKERS) SKY,
             at);
    compare("many kinds under a sky", IMP_RGB, n - 4, PATH(DEPTH("6")), CAMERA, rest);
    snprintf(rest, sizeof rest, "%s%s", ROOM LAMP("0", "0", ".5"), at);
    compare("many kinds in spectra", IMP_SPECTRAL, n, PATH(DEPTH("6")), CAMERA, rest);
    unlink(path);
}

/* One material on many shapes, of which one has textures by triangle: a mesh with an attribute. */
static void by_triangle(void)
{
    static char path[64], rest[16384];
    strcpy(path, "/tmp/imp_bundles_XXXXXX");
    const int fd = mkstemp(path), n = 12;
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!f) {
        tap_ok(false, "a file for a mesh");
        return;
    }
    fprintf(
        f, "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
           "property float z\nproperty float u\nproperty float v\nproperty float r\n"
           "property float g\nproperty float b\nelement face 2\n"
           "property list uchar int vertex_indices\nend_header\n");
    for (int k = 0; k < 4; k++)
        fprintf(f, "%g %g 0 %d %d 1 .5 .2\n", k % 2 ? .3 : -.3, k / 2 ? .3 : -.3, k % 2,
                k / 2);
    fprintf(f, "3 0 1 3\n3 0 3 2\n");
    fclose(f);
    size_t at = (size_t)snprintf(
        rest, sizeof rest,
        SKY LAMP("0", "0",
                 ".5") "<bsdf type='diffuse' id='squares'><texture "
                       "type='checkerboard' name='reflectance'><transform "
                       "name='to_uv'><scale value='9'/></transform></texture></bsdf>");
    for (int k = 0; k < n * n; k++) {
        const double x = 3.6 * (k % n + .5) / n - 1.8, y = 3.6 * (k / n + .5) / n - 1.8;
        char file[128];
        snprintf(file, sizeof file,
                 "<shape type='ply'><string name='filename' value='%s'/>", path);
        at += (size_t)snprintf(
            rest + at, sizeof rest - at,
            "%s<transform name='to_world'><scale value='%g'/><rotate x='1' angle='%d'/>"
            "<translate x='%.3g' y='%.3g'/></transform><ref id='squares'/></shape>",
            k % 4 == 1 ? file : "<shape type='rectangle'>", k % 4 == 1 ? .45 : .14,
            (k * 37) % 120 - 60, x, y);
        if (at + 512 > sizeof rest) break;
    }
    compare("one texture on many shapes", IMP_RGB, -1, PATH(DEPTH("6")), CAMERA, rest);
    unlink(path);
}

int main(void)
{
    ctx = test_context(1);
    materials();
    by_triangle();
    ideal();
    bitmaps();
    all_kinds();
    imp_context_destroy(ctx);
    return tap_done();
}
