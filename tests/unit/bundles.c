/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks in bundles beside the same walks alone (bundle_kit.h): rooms, lights, sensors, shapes. */
#include "bundle_kit.h"
#include "imp_fail_alloc.h"

static void boxes(void)
{
    static const char *const depths[] = {"1", "2", "3", "12", "-1"};
    compare("a room", IMP_RGB, 7, PATH(""), CAMERA,
            ROOM LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9"))
                BALL("-.7", ".4", GOLD(ALPHA("alpha", ".3"))));
    compare("independent walks", IMP_RGB, 7, PATH(""), CAMERA,
            ROOM SKY LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9"))
                BALL("-.7", ".4", GOLD(ALPHA("alpha", ".3"))));
    compare("in grey", IMP_MONO, 6, PATH(""), CAMERA,
            ROOM LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")));
    for (size_t k = 0; k < imp_count(depths); k++) {
        char integrator[256], name[64];
        snprintf(integrator, sizeof integrator,
                 "<integrator type='path'><integer name='max_depth' value='%s'/>" RR(
                     "2") "</integrator>",
                 depths[k]);
        snprintf(name, sizeof name, "a room, depth %s", depths[k]);
        compare(name, IMP_RGB, 6, integrator, CAMERA,
                ROOM SKY LAMP("0", "0", "1.2") CUBE("-.6", "-1.2", DIFFUSE(".9,.2,0")));
    }
}

/* Walks that carry four wavelengths. */
static void spectra(void)
{
    compare("a room in spectra", IMP_SPECTRAL, 7, PATH(""), CAMERA,
            ROOM SKY LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.4,.1"))
                BALL("-.7", ".4", GOLD(ALPHA("alpha", ".3"))));
    compare("independent walks in spectra", IMP_SPECTRAL, 8, PATH(DEPTH("4")), CAMERA,
            ROOM LAMP("0", "0", ".5") LAMP("1", "0", ".2")
                BALL("-.7", ".4", "<bsdf type='dielectric'/>")
                    CUBE("-.6", "-1.2", CHECKERS) BALL(".8", ".8", DIFFUSE(".1,.2,.9")));
    compare("a meter in spectra", IMP_SPECTRAL, 6, PATH(DEPTH("5")), "irradiancemeter'>",
            "");
}

#define LAMP_ROW(z)                                                                      \
    LAMP("-1.8", z, ".05")                                                               \
    LAMP("-1.3", z, ".05")                                                               \
    LAMP("-.9", z, ".05")                                                                \
    LAMP("-.4", z, ".05")                                                                \
    LAMP("0", z, ".05")                                                                  \
    LAMP(".4", z, ".05") LAMP(".9", z, ".05") LAMP("1.3", z, ".05") LAMP("1.8", z, ".05")

static void lights(void)
{
    /* More than are looked at one by one (scene/light_tree.c). */
    compare("72 lamps, by a tree", IMP_RGB, 5,
            PATH(DEPTH("4") "<string name='light_choice' value='tree'/>"), CAMERA,
            ROOM LAMP_ROW("-1.8") LAMP_ROW("-1.3") LAMP_ROW("-.8") LAMP_ROW("-.3")
                LAMP_ROW(".3") LAMP_ROW(".8") LAMP_ROW("1.3") LAMP_ROW("1.8"));
    compare("hidden lights", IMP_RGB, 6,
            PATH(DEPTH("4") "<boolean name='hide_emitters' value='true'/>"), CAMERA,
            ROOM SKY BALL("0", "0", AREA("1,2,3")) LAMP("0", "1", ".5")
                CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")));
    compare("many lamps", IMP_RGB, 6,
            PATH(DEPTH("4") "<string name='light_choice' value='weights'/>"), CAMERA,
            ROOM LAMP("0", "0", ".3") LAMP("1", "0", ".2") LAMP("-1", "0", ".2")
                LAMP("0", "1", ".1") LAMP("0", "-1", ".4")
                    CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")) SKY);
    compare("many lamps, independent walks by a tree", IMP_RGB, 5,
            PATH(DEPTH("4") "<string name='light_choice' value='tree'/>"), CAMERA,
            ROOM LAMP("0", "0", ".3") LAMP("1", "0", ".2") LAMP("-1", "0", ".2"));
    compare("many lamps, by a tree", IMP_RGB, 6,
            PATH(DEPTH("4") "<string name='light_choice' value='tree'/>"), CAMERA,
            ROOM LAMP("0", "0", ".3") LAMP("1", "0", ".2") LAMP("-1", "0", ".2")
                BALL("1", "-1", AREA("2,3,4")) CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9"))
                    SKY "<shape type='cube'>" AT(".3", ".6", "0", "y", "20", ".3")
                        AREA("6,6,9") "</shape>");
    compare(
        "lights without lanes", IMP_RGB, 6, PATH(DEPTH("4")), CAMERA,
        ROOM CUBE(
            "-.6", "-1.2",
            DIFFUSE(
                ".9,.9,.9")) "<emitter type='point'><point name='position' x='.5' y='1' "
                             "z='1'/><rgb "
                             "name='intensity' value='3,4,5'/></emitter>" BALL(
                                 ".8", ".8",
                                 AREA("5,3,2")) "<emitter type='spot'><transform "
                                                "name='to_world'><lookat "
                                                "origin='-1,1,2' target='0,0,0' "
                                                "up='0,1,0'/></transform></emitter>"
                                                "<shape type='rectangle'>" AT(
                                                    "0", "1.9", "0", "x", "90",
                                                    ".6") "<emitter type='area'><texture "
                                                          "type='checkerboard' "
                                                          "name='radiance'/></emitter></"
                                                          "shape>");
    level = (const double[]){.3, NAN, 0};
    compare("lamps at levels", IMP_RGB, 0, PATH(DEPTH("4")), CAMERA,
            ROOM LAMP("0", "0", ".5") LAMP("1", "0", ".3") LAMP("-1", "0", ".3"));
    level = NULL;
    compare("a lamp that is a mesh", IMP_RGB, 5, PATH(DEPTH("4")), CAMERA,
            ROOM "<shape type='cube'>" AT(".3", ".6", "0", "y", "20", ".3")
                AREA("6,6,9") "</shape>");
    compare("no light but the sky", IMP_RGB, 2, PATH(""), CAMERA,
            SKY WALL("0", "-1", "0", "x", "-90", DIFFUSE(".5,.6,.7"))
                CUBE("0", "-.5", DIFFUSE(".9,.9,.9")));
}

#define TREE "<string name='light_choice' value='tree'/>"
#define THINGS                                                                           \
    WALL("0", "-1", "0", "x", "-90", DIFFUSE(".5,.6,.7"))                                \
    CUBE("0", "-.5", DIFFUSE(".9,.9,.9"))                                                \
    BALL(".9", ".3", "<bsdf type='dielectric'/>")                                        \
    BALL("-.9", ".3", GOLD(ALPHA("alpha", ".2")))

/* Skies that differ by direction, and several of them. */
static void skies(void)
{
    static char path[64], rest[8192];
    static const char *const map =
        "<emitter type='envmap'><string name='filename' value='%s'/><float name='scale' "
        "value='1.5'/><float name='rotation' value='40'/><transform "
        "name='to_world'><rotate x='1' angle='70'/></transform>%s</emitter>%s";
    if (!picture_write(path)) {
        tap_ok(false, "a file for a picture");
        return;
    }
    snprintf(rest, sizeof rest, map, path, "", THINGS);
    compare("an environment", IMP_RGB, 4, PATH(""), CAMERA, rest);
    compare("an environment, independent walks", IMP_RGB, 4, PATH(DEPTH("4")), CAMERA,
            rest);
    compare("an environment in spectra", IMP_SPECTRAL, 4, PATH(DEPTH("4")), CAMERA, rest);
    compare("an environment in grey", IMP_MONO, 4, PATH(DEPTH("4")), CAMERA, rest);
    compare("a hidden environment", IMP_RGB, 4,
            PATH("<boolean name='hide_emitters' value='true'/>"), CAMERA, rest);
    snprintf(rest, sizeof rest, map, path,
             "<string name='projection' value='equal_area'/>",
             THINGS LAMP("0", "0", ".5"));
    compare("an environment of equal areas, and a lamp", IMP_RGB, 4, PATH(DEPTH("5")),
            CAMERA, rest);
    compare("an environment and a lamp, by a tree", IMP_RGB, 4, PATH(DEPTH("5") TREE),
            CAMERA, rest);
    snprintf(rest, sizeof rest, map, path, "", SKY THINGS);
    compare("two skies", IMP_RGB, 4, PATH(DEPTH("5")), CAMERA, rest);
    compare("sun and sky", IMP_RGB, 4, PATH(DEPTH("5")), CAMERA,
            "<emitter type='sunsky'/>" THINGS);
    compare("sun and sky and a lamp, by a tree", IMP_RGB, 4, PATH(DEPTH("5") TREE),
            CAMERA, "<emitter type='sunsky'/>" THINGS LAMP("0", "0", ".5"));
    unlink(path);
}

static void sensors(void)
{
    compare("a meter", IMP_RGB, 6, PATH(DEPTH("5")), "irradiancemeter'>", "");
    compare("a meter, independent walks", IMP_RGB, 6, PATH(DEPTH("5")),
            "irradiancemeter'>", "");
    compare("a shutter", IMP_RGB, 6, PATH(DEPTH("4")),
            "perspective'><float name='shutter_open' value='1'/><float "
            "name='shutter_close' value='3'/>" VIEW,
            ROOM LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")));
    compare("a thin lens", IMP_RGB, 5, PATH(DEPTH("4")),
            "thinlens'><float name='aperture_radius' value='.2'/><float "
            "name='focus_distance' value='3'/>" VIEW,
            ROOM LAMP("0", "0", ".5"));
    compare("clipped", IMP_RGB, 5, PATH(DEPTH("4")),
            "perspective'><float name='near_clip' value='1.5'/><float name='far_clip' "
            "value='5'/>" VIEW,
            ROOM LAMP("0", "0", ".5"));
}

/* Many analytic shapes are Embree's, which calls back; instances, too. */
static void scenes(void)
{
    char balls[4096] = "";
    for (int k = 0; k < 12; k++)
        snprintf(
            balls + strlen(balls), sizeof balls - strlen(balls),
            "<shape type='sphere'><point name='center' x='%g' y='%g' "
            "z='0'/><float name='radius' value='.3'/>" DIFFUSE(".6,.5,.4") "</shape>",
            k % 4 * .8 - 1.2, k / 4 * .8 - .8);
    strcat(balls, SKY WALL("0", "-1", "0", "x", "-90", DIFFUSE(".5,.6,.7"))
                      LAMP("0", "0", ".5"));
    compare("twelve balls", IMP_RGB, 13, PATH(DEPTH("5")), CAMERA, balls);
    /* A hundred tiles of three materials: few rays meet each. */
    static char tiles[32768];
    snprintf(
        tiles, sizeof tiles, "%s",
        "<bsdf type='diffuse' id='a'><rgb name='reflectance' value='.9,.5,.2'/></bsdf>"
        "<bsdf type='roughconductor' id='b'><string name='distribution' "
        "value='ggx'/><float name='alpha' value='.3'/></bsdf>"
        "<bsdf type='diffuse' id='c'><texture type='checkerboard' "
        "name='reflectance'/></bsdf>" SKY LAMP("0", "0", ".5"));
    for (int k = 0; k < 100; k++)
        snprintf(
            tiles + strlen(tiles), sizeof tiles - strlen(tiles),
            "<shape type='%s'><transform name='to_world'><scale value='.18'/><rotate "
            "y='1' angle='%d'/><translate x='%g' y='%g'/></transform><ref "
            "id='%c'/></shape>",
            k % 7 == 0 ? "cube" : "rectangle", k % 11 * 5, k % 10 * .4 - 1.8,
            k / 10 * .4 - 1.8, 'a' + k % 3);
    compare("tiles", IMP_RGB, 100, PATH(DEPTH("5")), CAMERA, tiles);
    compare("instances", IMP_RGB, 0, PATH(DEPTH("5")), CAMERA,
            "<shape type='shapegroup' id='g'>" CUBE(
                "0", "0",
                DIFFUSE(".8,.3,.1")) "</shape><shape type='instance'><ref "
                                     "id='g'/>" AT(
                                         ".5", "0", "0", "y", "10",
                                         "1.3") "</shape>" SKY WALL("0", "-1", "0", "x",
                                                                    "-90",
                                                                    DIFFUSE(".5,.6,.7")));
    compare(
        "disks, cylinders and 36 triangles", IMP_RGB, 7, PATH(DEPTH("5")), CAMERA,
        SKY WALL("0", "-1", "0", "x", "-90", DIFFUSE(".5,.6,.7")) CUBE(
            "-.6", "0", DIFFUSE(".8,.3,.1")) CUBE(".6", "0", DIFFUSE(".1,.3,.9"))
            CUBE("0", ".8", CHECKERS) "<shape type='disk'>" AT("-1", "1", "-.5", "y",
                                                               "10", ".6")
                DIFFUSE(".5,.9,.4") "</shape><shape "
                                    "type='cylinder'><float name='radius' "
                                    "value='.2'/>" DIFFUSE(".5,.9,.4") "</shape>" CUBE(
                                        "1.4", "1.2", DIFFUSE(".9,.9,.9")));
}

/* A mesh of a file: bumps of 2,048 triangles with interpolated normals, in Embree. */
static void meshes(void)
{
    char path[] = "/tmp/imp_bundles_XXXXXX", shape[512];
    const int fd = mkstemp(path), n = 32;
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!f) {
        tap_ok(false, "a file for a mesh");
        return;
    }
    for (int j = 0; j <= n; j++)
        for (int i = 0; i <= n; i++)
            fprintf(f, "v %g %g %g\n", 2. * i / n - 1, 2. * j / n - 1,
                    .2 * sin(.7 * i) * cos(.5 * j));
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int a = j * (n + 1) + i + 1;
            fprintf(f, "f %d %d %d\nf %d %d %d\n", a, a + 1, a + n + 2, a, a + n + 2,
                    a + n + 1);
        }
    fclose(f);
    for (int flat = 0; flat < 2; flat++) {
        static char rest[4096];
        snprintf(shape, sizeof shape,
                 "<shape type='obj'><string name='filename' value='%s'/><boolean "
                 "name='face_normals' value='%s'/>" GOLD(ALPHA("alpha", ".2")) "</shape>",
                 path, flat ? "true" : "false");
        snprintf(rest, sizeof rest, "%s%s", shape,
                 SKY WALL("0", "0", "-1", "y", "0", DIFFUSE(".5,.6,.7"))
                     LAMP("0", "1", ".5"));
        compare(flat ? "a flat mesh" : "a smooth mesh", IMP_RGB, 2, PATH(DEPTH("5")),
                CAMERA, rest);
    }
    unlink(path);
}

/* Bundles of swept walks with every allocation failing in turn: each is refused, so that its walks go
 * alone, until none fails. */
static void short_of_memory(const char *name, const char *rest)
{
    struct fail_alloc heap = {.once = true};
    imp_context *fragile = fail_alloc_context(&heap);
    static char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s<sensor type='%s<film type='hdrfilm'><integer "
             "name='width' value='6'/><integer name='height' value='6'/></film></sensor>"
             "%s</scene>",
             PATH(DEPTH("7")), CAMERA, rest);
    imp_scene *scene = test_scene_text(fragile, xml, IMP_RGB);
    struct imp_active active;
    static uint8_t chosen[256];
    for (size_t k = 0; k < scene->n_params; k++)
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(fragile, imp__active_create(scene, chosen, &active));
    const struct imp_tracer tracer = {.scene = scene,
                                      .integrator = imp__walk_integrator(scene),
                                      .sensor = scene->sensors[0],
                                      .seed = 5,
                                      .active = &active,
                                      .swept_only = true};
    int xy[SIDE * SIDE][2], refused = 0, made = 0, wrong = 0;
    int64_t samples[SAMPLES];
    for (int p = 0; p < SIDE * SIDE; p++) xy[p][0] = p % SIDE, xy[p][1] = p / SIDE;
    for (int k = 0; k < SAMPLES; k++) samples[k] = k;
    for (size_t filled = 0; filled < 40; filled++) { /* so that blocks end anywhere */
        bool whole = false;
        for (int n = 1; !whole && n < 100; n++) {
            struct imp_arena arena;
            struct imp_bundle b;
            imp__arena_init(&arena, fragile);
            (void)imp__arena_take(&arena, filled, 9973);
            heap.fail_at = heap.calls + n;
            whole = imp__bundle_trace(&tracer, &arena, SIDE * SIDE, (const int(*)[2])xy,
                                      SAMPLES, samples, &b);
            wrong += whole == (heap.calls >= heap.fail_at) || (whole && arena.failed);
            heap.fail_at = 0;
            if (whole) made++;
            else refused++;
            imp__arena_free(&arena);
        }
    }
    tap_ok(made == 40 && refused > 100 && wrong == 0,
           "%s: %d bundles refused for want of memory, %d made, %d wrongly", name,
           refused, made, wrong);
    imp__active_destroy(fragile, &active);
    imp_scene_destroy(scene);
    imp_context_destroy(fragile);
}

int main(void)
{
    ctx = test_context(1);
    boxes();
    spectra();
    lights();
    skies();
    sensors();
    scenes();
    meshes();
    short_of_memory("vertices in lanes",
                    ROOM LAMP("0", "0", ".5") CUBE("0", "0", CHECKERS));
    short_of_memory("vertices alone",
                    SKY BALL("0", "0", "<bsdf type='thindielectric'/>")
                        BALL(".5", "0", "<bsdf type='null'/>") LAMP("0", "0", ".5"));
    imp_context_destroy(ctx);
    return tap_done();
}
