/* SPDX-License-Identifier: Apache-2.0
 *
 * OBJ files with the materials of their MTL files: the bits of the same room in XML, names,
 * materials by number, and what is refused. */
#include "base/film.h"
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdbool.h>
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/importon-obj-XXXXXX";

static void put(const char *name, const char *text)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fputs(text, f) < 0 || fclose(f) != 0) exit(1);
}

static enum imp_status load_in(imp_context *c, const char *name, bool lenient,
                               imp_scene **out)
{
    const char *defines[] = {"width=8", "spp=16"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    o.defines = defines;
    o.n_defines = strstr(name, ".obj") ? 2 : 0;
    o.lenient = lenient ? IMP_LENIENT_QUIET : IMP_LENIENT_OFF;
    o.mode = IMP_RGB;
    return imp_scene_load(c, path, &o, out);
}

static double value_of(const imp_scene *s, const char *name)
{
    double v[3];
    size_t index;
    if (imp_scene_find_param(s, name, &index) != IMP_OK ||
        imp_scene_get_values(s, index, v) != IMP_OK)
        return -1;
    return v[0];
}

/* ---- The same room twice ------------------------------------------------------------------ */

#define CORNERS "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 3\nv 0 4 3\nv 4 4 3\nv 4 0 3\n"
#define LAMP    "v 1 1 2.9\nv 1 3 2.9\nv 3 3 2.9\nv 3 1 2.9\n"
#define OBJ(name, file)                                                                  \
    "<shape type='obj' id='" name "'><string name='filename' value='" file "'/>"         \
    "<boolean name='face_normals' value='true'/>"

static void same_bits(void)
{
    const char *around = "<sensor type='perspective'><float name='fov' value='90'/>"
                         "<transform name='to_world'><lookat origin='2 .5 1' target='2 "
                         "1.5 1' up='0 0 1'/></transform><film type='hdrfilm'><integer "
                         "name='width' value='8'/><integer name='height' value='6'/>"
                         "</film></sensor></scene>";
    char text[4096];
    put("w.obj", CORNERS "f 1 2 3 4\nf 5 6 7 8\n");
    put("l.obj", LAMP "f 1 2 3 4\n");
    put("m.mtl", "# two\nnewmtl white paint\nKd .7 .6 .5\nKs 0 0 0\nillum 1\n\n"
                 "newmtl glow\nKd 0\nKe 5 4 3\n");
    /* Materials change twice; the second face counts back from the last row. */
    put("a.obj", "mtllib m.mtl\no room\n" CORNERS "usemtl white paint\nf 1 2 3 4\n"
                 "o lamp\n" LAMP "usemtl glow\nf -4 -3 -2 -1\n"
                 "o room\nusemtl white paint\nf 5 6 7 8\n");
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='path'/><include "
             "filename='a.obj'/>%s",
             around);
    put("a.xml", text);
    snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='path'/><bsdf type='twosided' "
        "id='white'><bsdf type='diffuse'><rgb name='reflectance' value='.7 .6 "
        ".5'/></bsdf></bsdf><bsdf type='twosided' id='black'><bsdf type='diffuse'>"
        "<rgb name='reflectance' value='0'/></bsdf></bsdf>" OBJ(
            "room",
            "w.obj") "<ref id='white'/></shape>" OBJ("lamp",
                                                     "l.obj") "<ref id='black'/><emitter "
                                                              "type='area'><rgb "
                                                              "name='radiance' value='5 "
                                                              "4 "
                                                              "3'/></emitter></shape>%s",
        around);
    put("b.xml", text);
    imp_scene *a, *b;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *f, *g;
    run.spp = 16;
    test_must(ctx, load_in(ctx, "a.xml", false, &a));
    test_must(ctx, load_in(ctx, "b.xml", false, &b));
    test_must(ctx, imp_render(a, &run, &f));
    test_must(ctx, imp_render(b, &run, &g));
    double sum = 0;
    for (size_t i = 0; i < imp__film_values(f); i++) sum += (double)f->mean[i];
    tap_ok(sum > 1 &&
               memcmp(f->mean, g->mean, imp__film_values(f) * sizeof *f->mean) == 0,
           "a room with its MTL and as XML: the same bits");
    tap_ok(value_of(a, "white_paint.brdf_0.reflectance.value") == .7 &&
               value_of(a, "lamp.emitter.radiance.value") == 5,
           "materials and objects by their names");
    imp_film_destroy(f);
    imp_film_destroy(g);
    imp_scene_destroy(a);
    imp_scene_destroy(b);
}

/* ---- Materials ------------------------------------------------------------------------------ */

#define TRIANGLE "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"

/* A number of the scene that a material makes. */
static void makes(const char *material, const char *name, double value)
{
    char text[1024];
    imp_scene *s;
    snprintf(text, sizeof text, "newmtl m\n%s", material);
    put("m.mtl", text);
    put("a.obj", TRIANGLE);
    test_must(ctx, load_in(ctx, "a.obj", false, &s));
    tap_near(value_of(s, name), value, 0, 1e-12, name);
    imp_scene_destroy(s);
}

static void materials(void)
{
    imp_film *f;
    makes("Kd .1 .2 .3\nKs .4\nNs 20\n", "m.brdf_0.diffuse_reflectance.value", .1);
    makes("Kd .1 .2 .3\nKs .4\nNs 20\n", "m.brdf_0.specular_reflectance.value", .4);
    makes("Kd .1 .2 .3\nKs .4\nNs 20\n", "m.brdf_0.exponent.value", 20);
    /* .9 + .6 is more than all: both over 1.5 */
    makes("Kd .9\nKs .6\nNs 20\n", "m.brdf_0.diffuse_reflectance.value", .6);
    makes("Kd .9\nKs .6\nNs 20\n", "m.brdf_0.specular_reflectance.value", .4);
    makes("Kd .2\nPr .3\nPm .25\n", "m.brdf_0.roughness.value", .3);
    makes("Kd .2\nPr .3\nPm .25\n", "m.brdf_0.metallic.value", .25);
    makes("Kd .2\nTr .75\n", "m.opacity.value", .25);
    makes("Kd .2\nd .75\n", "m.opacity.value", .75);
    makes("Kd 0\nKs .9\nillum 3\n", "m.brdf_0.specular_reflectance.value", .9);
    test_must(ctx, imp_film_create(ctx, 1, 1, "R,G,B", &f));
    for (int k = 0; k < 3; k++) imp_film_mean(f)[k] = .25f;
    char path[256];
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    snprintf(path, sizeof path, "%s/my t.exr", folder);
    test_must(ctx, imp_film_write(f, path, &o));
    imp_film_destroy(f);
    makes("Kd 1\nmap_Kd my t.exr\n", "m.brdf_0.reflectance.data", .25);
    /* Ns 6: the width of a roughness (2/8)^(1/4) */
    makes("Kd 1\nKs .5\nNs 6\nmap_Kd my t.exr\n", "m.brdf_0.roughness.value", sqrt(.5));
}

/* ---- What is refused -------------------------------------------------------------------------- */

static void refused(const char *obj, const char *mtl, enum imp_status status,
                    const char *message)
{
    imp_scene *s = NULL;
    put("a.obj", obj);
    put("m.mtl", mtl);
    const enum imp_status st = load_in(ctx, "a.obj", false, &s);
    const bool ok = st == status && strstr(imp_last_error(ctx), message);
    tap_ok(ok, "%s", message);
    if (!ok) printf("# status %d: %s\n", (int)st, imp_last_error(ctx));
    imp_scene_destroy(s);
}

static void refusals(void)
{
    imp_scene *s;
    refused("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl whte\nf 1 2 3\n",
            "newmtl red\nnewmtl white\n", IMP_E_SCENE,
            "material 'whte' is in none of its libraries; did you mean 'white'?");
    test_must(ctx, load_in(ctx, "a.obj", true, &s));
    imp_scene_destroy(s);
    refused("mtllib gone.mtl\nv 0 0 0\nf 1 1 1\n", "", IMP_E_IO, "gone.mtl");
    refused(TRIANGLE, "Kd 1\n", IMP_E_SCENE, "m.mtl:1:1: 'Kd' before the first newmtl");
    refused(TRIANGLE, "newmtl m\nKd 1 x 2\n", IMP_E_SCENE,
            "m.mtl:2:1: Kd needs 3 numbers");
    refused(TRIANGLE, "newmtl m\nKd 1 2 1\n", IMP_E_SCENE, "reflects more than all");
    refused(TRIANGLE, "newmtl m\nTr 2\n", IMP_E_SCENE, "d, Tr, Pr and Pm are in [0, 1]");
    refused(TRIANGLE, "newmtl m\nmap_Kd gone.png\n", IMP_E_IO, "gone.png");
    refused("v 0 0 0\nv 1 0 0\nf 1 2 -4\n", "", IMP_E_SCENE,
            "a.obj:3: index -4 of a vertex: there are 2 so far");
    refused("v 0 0 0\n", "", IMP_E_SCENE, "has no faces");
}

static void memory(void)
{
    struct fail_alloc heap = {0};
    imp_context *fragile = fail_alloc_context(&heap);
    const long at_rest = heap.live;
    long n = 0, leaks = 0, wrong = 0;
    put("a.obj", TRIANGLE "o b\nusemtl k\nf 3 2 1\n");
    put("m.mtl", "newmtl m\nKd .5\nmap_Kd my t.exr\nnewmtl k\nKs .3\nNs 4\nd .5\nKe 1\n");
    for (;; n++) {
        imp_scene *s = NULL;
        heap.calls = 0;
        heap.fail_at = n + 1;
        const enum imp_status st = load_in(fragile, "a.obj", false, &s);
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
    same_bits();
    materials();
    refusals();
    memory();
    imp_context_destroy(ctx);
    static const char *const files[] = {"a.obj", "m.mtl", "w.obj",   "l.obj",
                                        "a.xml", "b.xml", "my t.exr"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char path[256];
        snprintf(path, sizeof path, "%s/%s", folder, files[i]);
        unlink(path);
    }
    rmdir(folder);
    return tap_done();
}
