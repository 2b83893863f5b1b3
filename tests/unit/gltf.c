/* SPDX-License-Identifier: Apache-2.0
 *
 * glTF: the same bits however the same mesh is written, materials and textures as the
 * specification scales them, lights in closed form, cameras, and what is refused. */
#include "base/film.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/importon-gltf-XXXXXX";

static void put_bytes(const char *name, const void *data, size_t n)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(data, 1, n, f) != n || fclose(f) != 0) exit(1);
}
static void put(const char *name, const char *text)
{
    put_bytes(name, text, strlen(text));
}

static enum imp_color_mode mode = IMP_RGB;

static enum imp_status load_in(imp_context *c, const char *name, bool lenient,
                               imp_scene **out)
{
    const char *defines[] = {"width=8", "spp=16"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    o.defines = defines;
    o.n_defines = strstr(name, ".gl") ? 2 : 0;
    o.lenient = lenient ? IMP_LENIENT_QUIET : IMP_LENIENT_OFF;
    o.mode = mode;
    return imp_scene_load(c, path, &o, out);
}
static imp_scene *load(const char *name)
{
    imp_scene *s;
    test_must(ctx, load_in(ctx, name, false, &s));
    return s;
}

/* ---- One square ------------------------------------------------------------------------------ */

/* A square of side 2 about the origin, its front along +z, written in several ways. */
enum {
    P = 0,
    UV = 48,
    UV8 = 80,
    I16 = 96,
    I32 = 108,
    I8 = 132,
    STRIP8 = 138,
    FAN8 = 142,
    APART = 148,
    END = APART + 4 * 20
};

static void square_put(void)
{
    static const float p[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}},
                       uv[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    static const uint8_t list[6] = {0, 1, 2, 0, 2, 3}, strip[4] = {3, 0, 2, 1},
                         fan[4] = {0, 1, 2, 3};
    unsigned char b[END] = {0};
    memcpy(b + P, p, sizeof p);
    memcpy(b + UV, uv, sizeof uv);
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 2; k++) b[UV8 + 4 * i + k] = (unsigned char)(255 * uv[i][k]);
        memcpy(b + APART + 20 * i, p[i], sizeof p[i]);
        memcpy(b + APART + 20 * i + 12, uv[i], sizeof uv[i]);
    }
    for (int i = 0; i < 6; i++) {
        const uint16_t s = list[i];
        const uint32_t u = list[i];
        memcpy(b + I16 + 2 * i, &s, 2);
        memcpy(b + I32 + 4 * i, &u, 4);
        b[I8 + i] = list[i];
    }
    memcpy(b + STRIP8, strip, 4);
    memcpy(b + FAN8, fan, 4);
    put_bytes("my square.bin", b, sizeof b);
}

static const char square_data[] =
    "\"asset\":{\"version\":\"2.0\"},"
    "\"buffers\":[{\"uri\":\"my%20square.bin\",\"byteLength\":228}],"
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},"
    "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":32},"
    "{\"buffer\":0,\"byteOffset\":80,\"byteLength\":16,\"byteStride\":4},"
    "{\"buffer\":0,\"byteOffset\":96,\"byteLength\":50},"
    "{\"buffer\":0,\"byteOffset\":148,\"byteLength\":80,\"byteStride\":20}],"
    "\"accessors\":["
    "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}," /* 0: P */
    "{\"bufferView\":1,\"componentType\":5126,\"count\":4,\"type\":\"VEC2\"}," /* 1: UV */
    "{\"bufferView\":2,\"componentType\":5121,\"normalized\":true,\"count\":4,"
    "\"type\":\"VEC2\"},"                                                        /* 2 */
    "{\"bufferView\":3,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}," /* 3 */
    "{\"bufferView\":3,\"byteOffset\":12,\"componentType\":5125,\"count\":6,"
    "\"type\":\"SCALAR\"}," /* 4 */
    "{\"bufferView\":3,\"byteOffset\":36,\"componentType\":5121,\"count\":6,"
    "\"type\":\"SCALAR\"}," /* 5 */
    "{\"bufferView\":3,\"byteOffset\":42,\"componentType\":5121,\"count\":4,"
    "\"type\":\"SCALAR\"}," /* 6: strip */
    "{\"bufferView\":3,\"byteOffset\":46,\"componentType\":5121,\"count\":4,"
    "\"type\":\"SCALAR\"}," /* 7: fan */
    "{\"bufferView\":4,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}," /* 8 */
    "{\"bufferView\":4,\"byteOffset\":12,\"componentType\":5126,\"count\":4,"
    "\"type\":\"VEC2\"}]," /* 9 */
    ;

/* A file "a.gltf" of the square: the primitive, the materials, nodes, and what else. */
static void square(const char *primitive, const char *materials, const char *nodes,
                   const char *more)
{
    char text[8192];
    snprintf(text, sizeof text,
             "{%s\"meshes\":[{\"name\":\"plate\",\"primitives\":[{%s}]}],"
             "\"materials\":[%s],\"nodes\":[%s]%s}",
             square_data, primitive, materials, nodes, more);
    put("a.gltf", text);
}
#define PLAIN                                                                            \
    "\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},\"indices\":3,\"material\":0"
#define PLATE  "{\"mesh\":0}"
#define VIEWER ",{\"camera\":0,\"translation\":[0,0,3]}"
#define CAMERA                                                                           \
    ",\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0.8,"             \
    "\"aspectRatio\":1.3333333}}]"

static imp_film *picture(imp_scene *s, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f;
    run.spp = spp;
    test_must(ctx, imp_render(s, &run, &f));
    return f;
}
static bool equal(const imp_film *a, const imp_film *b)
{
    return a->width == b->width && a->height == b->height && a->channels == b->channels &&
           memcmp(a->mean, b->mean, imp__film_values(a) * sizeof *a->mean) == 0;
}
static double value_of(const imp_scene *s, const char *name, int k)
{
    static double v[4096];
    size_t index;
    if (imp_scene_find_param(s, name, &index) != IMP_OK ||
        imp_scene_get_values(s, index, v) != IMP_OK)
        return -1;
    return v[k];
}

#define GREY                                                                             \
    "{\"name\":\"grey\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.4,0.3,1],"  \
    "\"metallicFactor\":0,\"roughnessFactor\":0.7}}"

static void same_bits(void)
{
    static const char *const ways[] = {
        PLAIN,
        "\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":2},\"indices\":4,\"material\":0",
        "\"attributes\":{\"POSITION\":8,\"TEXCOORD_0\":9},\"indices\":5,\"material\":0,"
        "\"mode\":4",
        "\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},\"indices\":7,\"mode\":6,"
        "\"material\":0"};
    put("m.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 1\nvt 1 1\n"
                 "vt 1 0\nvt 0 0\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
    put("m.xml",
        "<scene version='3.0.0'><integrator type='path'/><bsdf type='twosided' id='grey'>"
        "<bsdf type='principled'><rgb name='base_color' value='.5 .4 .3'/><float "
        "name='roughness' value='.7'/></bsdf></bsdf><shape type='obj'><string "
        "name='filename' value='m.obj'/><boolean name='flip_tex_coords' value='false'/>"
        "<boolean name='face_normals' value='true'/><ref "
        "id='grey'/></shape><emitter type='constant'/><sensor type='perspective'><float "
        "name='fov' value='45.836623610465857'/><string name='fov_axis' value='y'/>"
        "<transform name='to_world'><lookat origin='0 0 3' target='0 0 0' up='0 1 0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='8'/><integer "
        "name='height' value='6'/></film></sensor></scene>");
    imp_scene *s = load("m.xml");
    imp_film *want = picture(s, 16);
    imp_scene_destroy(s);
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        square(ways[i], GREY, PLATE VIEWER, CAMERA);
        s = load("a.gltf");
        imp_film *f = picture(s, 16);
        tap_ok(equal(f, want), "way %zu to write a square: the bits of it in XML", i);
        imp_film_destroy(f);
        imp_scene_destroy(s);
    }
    /* Its diagonal is the other one, and so are the frames that directions are drawn in. */
    square("\"attributes\":{\"POSITION\":0},\"indices\":6,\"mode\":5,\"material\":0",
           GREY, PLATE VIEWER, CAMERA);
    s = load("a.gltf");
    imp_film *f = picture(s, 16);
    double worst = 0;
    for (size_t i = 0; i < imp__film_values(f); i++)
        worst = fmax(worst, fabs((double)f->mean[i] - (double)want->mean[i]));
    tap_ok(worst > 0 && worst < 1e-2, "a strip: within %.1e", worst);
    imp_film_destroy(f);
    imp_film_destroy(want);
    imp_scene_destroy(s);
}

/* The same bytes in a .glb. */
static void binary(void)
{
    unsigned char b[8192], bin[END];
    char json[6000], path[256];
    snprintf(path, sizeof path, "%s/my square.bin", folder);
    FILE *f = fopen(path, "rb");
    if (!f || fread(bin, 1, sizeof bin, f) != sizeof bin) exit(1);
    fclose(f);
    const char *uri = strstr(square_data, "\"uri\"");
    snprintf(json, sizeof json,
             "{%.*s%s\"meshes\":[{\"primitives\":[{%s}]}],\"materials\":[%s],"
             "\"nodes\":[%s]%s}",
             (int)(uri - square_data), square_data, strchr(uri, ',') + 1, PLAIN, GREY,
             PLATE VIEWER, CAMERA);
    while (strlen(json) % 4) strcat(json, " ");
    const uint32_t n = (uint32_t)strlen(json),
                   head[5] = {0x46546c67, 2, 20 + n + 8 + END, n, 0x4e4f534a},
                   chunk[2] = {END, 0x004e4942};
    memcpy(b, head, 20);
    memcpy(b + 20, json, n);
    memcpy(b + 20 + n, chunk, 8);
    memcpy(b + 28 + n, bin, END);
    put_bytes("a.glb", b, 28 + n + END);
    square(PLAIN, GREY, PLATE VIEWER, CAMERA);
    imp_scene *s = load("a.gltf"), *t = load("a.glb");
    imp_film *x = picture(s, 16), *y = picture(t, 16);
    tap_ok(equal(x, y), ".glb and .gltf: the same bits");
    imp_film_destroy(x);
    imp_film_destroy(y);
    imp_scene_destroy(s);
    imp_scene_destroy(t);
    put_bytes("a.glb", b, 24 + n);
    tap_ok(load_in(ctx, "a.glb", false, &s) == IMP_E_SCENE, "cut in a chunk: %s",
           imp_last_error(ctx));
}

/* ---- Materials and textures -------------------------------------------------------------------- */

/* 2 x 2, sRGB bytes; alpha .2, .4, .6, 1. */
static void texture_put(void)
{
    imp_film *f;
    test_must(ctx, imp_film_create(ctx, 2, 2, "R,G,B,A", &f));
    float *p = imp_film_mean(f);
    static const float texel[4][4] = {
        {1, .5f, .25f, .2f}, {0, 1, .5f, .4f}, {.1f, .2f, .3f, .6f}, {1, 1, 1, 1}};
    memcpy(p, texel, sizeof texel);
    char path[256];
    snprintf(path, sizeof path, "%s/t.exr", folder); /* linear: texels are exact halves */
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    test_must(ctx, imp_film_write(f, path, &o));
    imp_film_destroy(f);
}
#define FLAT                                                                             \
    ",\"cameras\":[{\"type\":\"orthographic\",\"orthographic\":{\"xmag\":1,"             \
    "\"ymag\":1,\"zfar\":9,\"znear\":0.1}}]"
#define TEXTURES                                                                         \
    ",\"images\":[{\"uri\":\"t.exr\"}],\"samplers\":[{\"magFilter\":9728,"               \
    "\"wrapS\":33071,\"wrapT\":33071}],\"textures\":[{\"source\":0,\"sampler\":0}]"

static void textures(void)
{
    square(PLAIN,
           "{\"name\":\"tile.1\",\"alphaMode\":\"MASK\",\"alphaCutoff\":0.3,"
           "\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,1,1,0.6],"
           "\"baseColorTexture\":{\"index\":0},\"roughnessFactor\":0.5,"
           "\"metallicFactor\":0.8,\"metallicRoughnessTexture\":{\"index\":0}}}",
           PLATE, TEXTURES);
    imp_scene *s = load("a.gltf");
    tap_near(value_of(s, "texture_0_color.data", 0), .5, 0, 2e-3, "red times .5");
    tap_near(value_of(s, "texture_0_color.data", 1), .5, 0, 2e-3, "green times 1");
    tap_near(value_of(s, "texture_0_green.data", 0), .25, 0, 2e-3,
             "roughness: green times .5");
    tap_near(value_of(s, "texture_0_blue.data", 0), .2, 0, 2e-3,
             "metallic: blue times .8");
    /* alpha times .6 is .12, .24, .36, .6: cut at .3 */
    tap_ok(value_of(s, "texture_0_cut.data", 0) == 0 &&
               value_of(s, "texture_0_cut.data", 1) == 0 &&
               value_of(s, "texture_0_cut.data", 2) == 1 &&
               value_of(s, "texture_0_cut.data", 3) == 1,
           "alpha is cut where its product with the factor is below the cutoff");
    tap_ok(value_of(s, "tile_1.nested_bsdf.brdf_0.specular.value", 0) == .5,
           "an index of 1.5, and an id without points");
    imp_scene_destroy(s);
    square(
        PLAIN,
        "{\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,"
        "0.5],\"baseColorTexture\":{\"index\":0}},\"extensions\":{"
        "\"KHR_materials_ior\":{\"ior\":1.8},\"KHR_materials_clearcoat\":{"
        "\"clearcoatFactor\":0.7,\"clearcoatRoughnessFactor\":0.1}}}",
        PLATE, TEXTURES);
    s = load("a.gltf");
    tap_near(value_of(s, "texture_0_opacity.data", 2), .3, 0, 2e-3,
             "opacity: alpha times .5");
    tap_near(value_of(s, "material_0.nested_bsdf.brdf_0.eta.value", 0), 1.8, 0, 0, "ior");
    tap_near(value_of(s, "material_0.nested_bsdf.brdf_0.clearcoat.value", 0), .7, 0, 0,
             "clear coat");
    tap_near(value_of(s, "material_0.nested_bsdf.brdf_0.metallic.value", 0), 1, 0, 0,
             "metallic is 1 by default");
    imp_scene_destroy(s);
    square(PLAIN,
           "{\"pbrMetallicRoughness\":{\"metallicFactor\":0},\"normalTexture\":{"
           "\"index\":0,\"scale\":2}}",
           PLATE, TEXTURES);
    s = load("a.gltf");
    /* 2 c - 1 = (-1, 1, 0) of texel 1 with x, y times 2, made unit */
    tap_near(value_of(s, "texture_0_normal.data", 3), .5 - .5 / sqrt(2), 0, 1e-3,
             "a normal's scale");
    imp_scene_destroy(s);
}

/* A texture may stand behind the material that uses it. */
static void spectra(void)
{
    mode = IMP_SPECTRAL;
    square(PLAIN,
           "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0},"
           "\"metallicFactor\":0}"
           "}",
           PLATE VIEWER, CAMERA TEXTURES);
    imp_scene *s = load("a.gltf");
    imp_film *f = picture(s, 4);
    tap_ok(value_of(s, "texture_0_color.data", 0) == 1 && f->mean[0] > 0,
           "textures in spectra");
    imp_film_destroy(f);
    imp_scene_destroy(s);
    mode = IMP_RGB;
}

/* A square seen from +z, lit by what it emits: the colour at its upper left corner. */
static double upper_left(const char *material, const char *more)
{
    square(PLAIN, material, PLATE VIEWER, more);
    imp_scene *s = load("a.gltf");
    imp_film *f = picture(s, 4);
    const double v = f->mean[(1 * f->width + 1) * f->channels];
    imp_film_destroy(f);
    imp_scene_destroy(s);
    return v;
}

#define SHINES(info)                                                                     \
    "{\"emissiveFactor\":[1,1,1],\"emissiveTexture\":{\"index\":0" info "},"             \
    "\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":3}}}"
#define TURN(text) ",\"extensions\":{\"KHR_texture_transform\":{" text "}}"

static void pictures(void)
{
    /* red of the four texels: 1, 0; .1, 1 */
    tap_near(upper_left(SHINES(""), TEXTURES FLAT), 3, 0, 1e-2,
             "the first texel is on the upper left, times the emissive strength");
    tap_near(upper_left(SHINES(TURN("\"offset\":[0.5,0]")), TEXTURES FLAT), 0, 0, 1e-3,
             "an offset of uvs to the right");
    tap_near(upper_left(SHINES(TURN("\"offset\":[0,0.5]")), TEXTURES FLAT), .3, 0, 1e-3,
             "and down");
    /* (u, v) -> (v, -u) + offset: near (0, 0) comes from the texel at the offset */
    tap_near(upper_left(SHINES(TURN("\"rotation\":1.5707963,\"offset\":[0,1]")),
                        TEXTURES FLAT),
             .3, 0, 1e-3, "uvs turned counter-clockwise: the picture clockwise");
}

/* ---- Lights, in closed form --------------------------------------------------------------------- */

/* Illuminance at the origin of a horizontal meter under what a file has. */
static void lux(const char *nodes, const char *lights, double truth, const char *what)
{
    char text[4096];
    snprintf(text, sizeof text,
             "{%s\"meshes\":[{\"primitives\":[{%s}]}],\"materials\":[{\"emissiveFactor\":"
             "[1,1,1],\"pbrMetallicRoughness\":{\"baseColorFactor\":[0,0,0,1],"
             "\"metallicFactor\":1}}],\"nodes\":[%s],\"extensions\":{"
             "\"KHR_lights_punctual\":{\"lights\":[%s]}}}",
             square_data, PLAIN, nodes, lights);
    put("l.gltf", text);
    put("l.xml",
        "<scene version='3.0.0'><default name='efficacy' value='10'/><integrator "
        "type='path'/><include filename='l.gltf'/><shape type='rectangle'><transform "
        "name='to_world'><scale value='.001'/></transform><sensor type='irradiancemeter'>"
        "<boolean name='virtual' value='true'/><string name='units' value='photometric'/>"
        "<string name='at' value='points'/><film type='hdrfilm'><integer name='width' "
        "value='1'/><integer name='height' value='1'/></film></sensor></shape></scene>");
    imp_scene *s = load("l.xml");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate mean;
    double value, se;
    run.spp = 4096;
    test_must(ctx, imp_grid_read(s, &run, &value, &se, &mean, NULL));
    tap_ok(fabs(value - truth) <= 4.5 * se + 1e-6 * truth && se <= 5e-3 * truth,
           "%s: %.5g +- %.2g lx, in closed form %.5g", what, value, se, truth);
    imp_scene_destroy(s);
}

static void lights(void)
{
    const char *down = "\"translation\":[0,0,2],\"extensions\":{\"KHR_lights_punctual\":{"
                       "\"light\":0}}";
    char node[512];
    snprintf(node, sizeof node, "{%s}", down);
    lux(node, "{\"type\":\"point\",\"intensity\":60,\"color\":[0.5,0.5,0.5]}",
        10 * 30 / 4., "a point light of 30 cd, times the efficacy");
    lux(node, "{\"type\":\"directional\",\"intensity\":7}", 70, "a directional light");
    lux(node, "{\"type\":\"spot\",\"intensity\":8,\"spot\":{\"outerConeAngle\":0.5}}", 20,
        "a spot");
    /* Turned away by 60 degrees about x: outside of the cone; a parallel light has cos 60. */
    snprintf(node, sizeof node, "{\"rotation\":[0.5,0,0,0.8660254],%s}", down);
    lux(node, "{\"type\":\"directional\",\"intensity\":7}", 35, "turned by 60 degrees");
    lux(node, "{\"type\":\"spot\",\"intensity\":8,\"spot\":{\"outerConeAngle\":0.5}}", 0,
        "a spot beside its cone");
    /* A square of half side 1/2 at height 1 (Howell, B-3), facing down or up. */
    const double a = .5, p = sqrt(1 + a * a),
                 form = 4 * (2 * a / p * atan(a / p)) / (2 * M_PI);
    lux("{\"mesh\":0,\"rotation\":[1,0,0,0],\"scale\":[0.5,0.5,0.5],\"translation\":[0,0,"
        "1]}",
        "", 10 * M_PI * form, "a square that shines down");
    lux("{\"mesh\":0,\"matrix\":[0.5,0,0,0, 0,-0.5,0,0, 0,0,-0.5,0, 0,0,1,1]}", "",
        10 * M_PI * form, "the same as a matrix");
    lux("{\"translation\":[0,0,1],\"children\":[1]},{\"mesh\":0,\"scale\":[0.5,0.5,-0.5]"
        "}",
        "", 10 * M_PI * form, "mirrored in its plane: its front is down, too");
    lux("{\"mesh\":0,\"scale\":[0.5,0.5,0.5],\"translation\":[0,0,1]}", "", 0,
        "one that shines up");
}

/* ---- What is refused --------------------------------------------------------------------------------- */

static void refused(const char *name, enum imp_status status, const char *message)
{
    imp_scene *s = NULL;
    const enum imp_status st = load_in(ctx, name, false, &s);
    const bool ok = st == status && strstr(imp_last_error(ctx), message);
    tap_ok(ok, "%s", message);
    if (!ok) printf("# status %d: %s\n", (int)st, imp_last_error(ctx));
    imp_scene_destroy(s);
}
static void text_refused(const char *text, enum imp_status status, const char *message)
{
    put("a.gltf", text);
    refused("a.gltf", status, message);
}
static void plate_refused(const char *primitive, const char *material, const char *nodes,
                          const char *more, enum imp_status status, const char *message)
{
    square(primitive, material, nodes, more);
    refused("a.gltf", status, message);
}

static void refusals(void)
{
    imp_scene *s;
    text_refused("{\"asset\":{\"version\":\"2.0\"},\n x}", IMP_E_SCENE, "a.gltf:2:");
    text_refused("[]", IMP_E_SCENE, "no object of JSON");
    text_refused("{\"asset\":{\"version\":\"1.0\"}}", IMP_E_SCENE, "'1.0'; 2.0 is read");
    text_refused("{\"asset\":{\"version\":\"2.0\"}}", IMP_E_SCENE, "no mesh to look at");
    text_refused("{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":["
                 "\"KHR_draco_mesh_compression\"]}",
                 IMP_E_UNSUPPORTED, "needs the extension KHR_draco_mesh_compression");
    plate_refused(PLAIN, GREY, "{\"mesh\":1}", "", IMP_E_SCENE,
                  "nodes[0]: mesh is not an integer in [0, 1)");
    plate_refused(PLAIN, GREY, "{\"mesh\":0,\"scale\":[1,2]}", "", IMP_E_SCENE,
                  "scale is not a list of 3 numbers");
    plate_refused(PLAIN, GREY, "{\"children\":[1]},{\"children\":[0]}",
                  ",\"scenes\":[{\"nodes\":[0]}]", IMP_E_SCENE, "is in the tree twice");
    plate_refused("\"attributes\":{\"POSITION\":0},\"indices\":0", GREY, PLATE, "",
                  IMP_E_SCENE, "its indices are not unsigned integers");
    plate_refused("\"attributes\":{\"POSITION\":0,\"NORMAL\":1}", GREY, PLATE, "",
                  IMP_E_SCENE, "NORMAL has 2 numbers, not 3");
    plate_refused("\"attributes\":{\"POSITION\":99}", GREY, PLATE, "", IMP_E_SCENE,
                  "POSITION is not an integer in [0, 10)");
    plate_refused(PLAIN, "{\"pbrMetallicRoughness\":{\"roughnessFactor\":2}}", PLATE, "",
                  IMP_E_SCENE, "materials[0]: roughnessFactor is 2");
    plate_refused(
        PLAIN, "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}", PLATE,
        ",\"images\":[{\"uri\":\"http://example.org/a.png\"}],\"textures\":[{"
        "\"source\":0}]",
        IMP_E_SCENE, "nothing is fetched from elsewhere");
    plate_refused(
        PLAIN, "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}", PLATE,
        ",\"images\":[{\"uri\":\"gone.png\"}],\"textures\":[{\"source\":0}]", IMP_E_IO,
        "gone.png");
    plate_refused(PLAIN,
                  "{\"name\":\"silk\",\"extensions\":{\"KHR_materials_sheen\":{},"
                  "\"KHR_materials_transmission\":{\"transmissionTexture\":{}}}}",
                  "{\"mesh\":0,\"skin\":0}", "", IMP_E_UNSUPPORTED,
                  "materials[0] 'silk': KHR_materials_sheen, materials[0] 'silk': "
                  "transmissionTexture (line 1), nodes[0]: skin (line 1): not supported");
    struct imp_scene_info info = {.size = sizeof info};
    test_must(ctx, load_in(ctx, "a.gltf", true, &s));
    test_must(ctx, imp_scene_get_info(s, &info));
    tap_ok(info.n_missing == 3 && info.n_shapes == 1, "a lenient scene goes on without");
    imp_scene_destroy(s);
}

static void memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
    const long at_rest = heap.live;
    long n = 0, leaks = 0, wrong = 0;
    square(PLAIN,
           "{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{"
           "\"index\":0},\"metallicRoughnessTexture\":{\"index\":0}},\"normalTexture\":{"
           "\"index\":0}}",
           PLATE VIEWER, CAMERA TEXTURES);
    for (;; n++) {
        imp_scene *s = NULL;
        heap.calls = 0;
        heap.fail_at = n + 1;
        const enum imp_status st = load_in(fragile, "a.gltf", false, &s);
        heap.fail_at = 0;
        imp_scene_destroy(s);
        if (st == IMP_OK || n > 5000) break;
        wrong += st != IMP_E_NOMEM;
        leaks += heap.live != at_rest;
    }
    tap_ok(n > 20 && n < 5000 && leaks == 0 && wrong == 0,
           "%ld failures of memory: %ld leaks, %ld with another status", n, leaks, wrong);
    imp_context_destroy(fragile);
}

int main(void)
{
    if (!mkdtemp(folder)) return 1;
    ctx = test_context(1);
    square_put();
    texture_put();
    same_bits();
    binary();
    textures();
    spectra();
    pictures();
    lights();
    refusals();
    memory();
    imp_context_destroy(ctx);
    static const char *const files[] = {"a.gltf", "a.glb", "l.gltf", "l.xml",
                                        "m.obj",  "m.xml", "t.exr",  "my square.bin"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        unlink(path);
    }
    rmdir(folder);
    return tap_done();
}
