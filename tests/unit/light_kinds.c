/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights that are made some at a time, beside the same walks alone (light_kit.h):
 * materials with a form in lanes and without one, textures, meshes. */
#include "bundle_scenes.h"
#include "light_kit.h"

#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "      \
    "value='6'/><rfilter type='tent'/></film>"
#define SEEN             "<sensor type='" CAMERA FILM "</sensor>"
#define KIND(type, more) "<bsdf type='" type "'>" more "</bsdf>"
#define TWOSIDED(more)   "<bsdf type='twosided'>" more "</bsdf>"
#define RED              "<rgb name='diffuse_reflectance' value='.8,.2,.1'/>"
#define PICTURE(name)                                                                    \
    "<texture type='bitmap' name='" name                                                 \
    "'><string name='filename' value='%s'/><boolean "                                    \
    "name='raw' value='true'/></texture>"
#define GGX "<string name='distribution' value='ggx'/>"

/* On balls, and on bumps with interpolated normals. */
static const struct {
    const char *name, *bsdf;
} kinds[] = {
    {"diffuse", DIFFUSE(".7,0,.4")},
    {"a texture", KIND("diffuse", PICTURE("reflectance"))},
    {"checkers, two-sided", TWOSIDED(CHECKERS)},
    {"a conductor", KIND("conductor", "<string name='material' value='Au'/>")},
    {"a coloured dielectric",
     KIND("dielectric", "<rgb name='specular_reflectance' value='0,.5,1'/><rgb "
                        "name='specular_transmittance' value='1,.2,0'/>")},
    {"rough gold", GOLD(ALPHA("alpha_u", ".1") ALPHA("alpha_v", ".4"))},
    {"rough gold, two-sided", TWOSIDED(GOLD(ALPHA("alpha", ".15")))},
    {"Beckmann's facets", KIND("roughconductor", ALPHA("alpha", ".2"))},
    {"plastic", KIND("plastic", RED)},
    {"plastic with a texture", KIND("plastic", PICTURE("diffuse_reflectance"))},
    {"rough plastic",
     KIND("roughplastic", RED "<boolean name='nonlinear' value='true'/>")},
    {"rough plastic of GGX", KIND("roughplastic", GGX PICTURE("diffuse_reflectance"))},
    {"rough glass", KIND("roughdielectric", GGX ALPHA("alpha", ".2"))},
    {"rough glass of Beckmann", KIND("roughdielectric", ALPHA("alpha", ".2"))},
    {"principled", KIND("principled", PICTURE("base_color") ALPHA("metallic", ".4") ALPHA(
                                          "sheen", ".7") ALPHA("anisotropic", ".6"))},
    {"principled with a coat", KIND("principled", ALPHA("clearcoat", ".5"))},
    {"principled that transmits",
     KIND("principled", ALPHA("spec_trans", ".8") ALPHA("roughness", ".3"))},
    {"a mixture",
     KIND("blendbsdf", ALPHA("weight", ".3") DIFFUSE(".1,.9,.1") KIND("conductor", ""))},
    {"a map of normals", KIND("normalmap", PICTURE("normalmap") DIFFUSE(".4,.5,.9"))},
    {"phong", TWOSIDED(KIND("phong", RED))},
};

/* Bumps of 2 n^2 triangles. */
static bool bumps_write(char path[64], int n, double height)
{
    strcpy(path, "/tmp/imp_bundles_XXXXXX.obj");
    const int fd = mkstemps(path, 4);
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!f) return false;
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++)
            fprintf(f, "v %g %g %g\n", 2. * i / n - 1, 2. * j / n - 1,
                    height * sin(1.4 * i) * cos(j));
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int a = j * (n + 1) + i + 1;
            fprintf(f, "f %d %d %d\nf %d %d %d\n", a, a + 1, a + n + 2, a, a + n + 2,
                    a + n + 1);
        }
    return fclose(f) == 0;
}

static void all_kinds(void)
{
    static char body[32768], bsdf[1024];
    char picture[64], bumps[64];
    if (!picture_write(picture) || !bumps_write(bumps, 16, .15)) {
        tap_ok(false, "files for a picture and a mesh");
        return;
    }
    for (size_t k = 0; k < imp_count(kinds); k++) {
        snprintf(bsdf, sizeof bsdf, kinds[k].bsdf, picture);
        snprintf(body, sizeof body,
                 "%s<shape type='obj'><string name='filename' value='%s'/>"
                 "<transform name='to_world'><rotate x='1' angle='-60'/></transform>"
                 "%s</shape><shape type='sphere'><point name='center' x='-.9' y='.4' "
                 "z='.6'/><float name='radius' value='.6'/>%s</shape>",
                 SEEN ROOM LAMP("0", "0", ".5"), bumps, bsdf, bsdf);
        compare(kinds[k].name, k % 4 == 3 ? IMP_SPECTRAL : IMP_RGB, true,
                DEPTH("8") RR("3"), body);
    }
    unlink(picture);
    unlink(bumps);
}

/* A lamp of triangles: flat, with interpolated normals, and of more than have a form in lanes. */
static void lamps(void)
{
    static const struct {
        const char *name;
        int n;
        double height;
        const char *flat;
    } made[] = {{"a lamp of two triangles", 1, 0, "true"},
                {"a lamp of a flat mesh", 3, 0, "false"},
                {"a lamp of facets", 4, .3, "true"},
                {"a lamp with interpolated normals", 4, .3, "false"},
                {"a lamp of many triangles", 12, .1, "false"}};
    static char body[16384];
    for (size_t k = 0; k < imp_count(made); k++) {
        char path[64];
        if (!bumps_write(path, made[k].n, made[k].height)) {
            tap_ok(false, "a file for a mesh");
            return;
        }
        snprintf(body, sizeof body,
                 "%s<shape type='obj'><string name='filename' value='%s'/>"
                 "<boolean name='face_normals' value='%s'/>%s</shape>",
                 SEEN ROOM BALL("0", "-1.3", "<bsdf type='dielectric'/>"), path,
                 made[k].flat, AT("0", "1.8", "0", "x", "80", ".4") AREA("9,8,7"));
        compare(made[k].name, k == 3 ? IMP_SPECTRAL : IMP_RGB, true, DEPTH("6"), body);
        unlink(path);
    }
}

int main(void)
{
    ctx = test_context(1);
    all_kinds();
    lamps();
    imp_context_destroy(ctx);
    return tap_done();
}
