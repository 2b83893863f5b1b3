/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks in files. Read without their scene they give the pictures, losses, gradients
 * and errors that they gave before they were written, to the bit: at the parameters of the
 * draw and at others, on any number of threads, in scenes with textures, skies, measured
 * lamps, media, meshes, groups and wavelengths. No ray is traced in what a file holds, and
 * files of other scenes, versions and byte orders, and damaged ones, are refused. */
#include "imp_measured.h"
#include "imp_merl.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include "vol_write.h"
#include <importon/elements.h>
#include <importon/walks.h>
#include <math.h>
#include <stdbool.h>
#include <unistd.h>

static imp_context *ctx, *three;
static char path[64];

/* ---- What is compared ------------------------------------------------------------ */

struct answer {
    imp_film *film;
    struct imp_estimate f;
    struct imp_walks_weight weight;
    double *g, *se;
    size_t n;
};

static const char *active; /* glob of parameters: extinctions have no such derivative */

/* A picture, and an L2 loss with its gradient. */
static struct answer answer_of(imp_scene *scene, const imp_walks *walks)
{
    imp_context *own = scene->ctx;
    struct answer a = {.weight = IMP_WALKS_WEIGHT_INIT};
    struct imp_run run = IMP_RUN_INIT;
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_target t = IMP_TARGET_INIT;
    imp_problem *p;
    run.walks = walks;
    test_must(own, imp_render(scene, &run, &a.film));
    test_must(own, imp_walks_weigh(walks, 0, NULL, &a.weight));
    test_must(own, imp_problem_create(scene, &p));
    test_must(own, imp_problem_activate(p, active));
    test_must(own, imp_scene_get_sensor(scene, 0, &info));
    t.width = info.width;
    t.height = info.height;
    t.channels = scene->channels;
    float *pixels = calloc((size_t)(t.width * t.height * t.channels), sizeof *pixels);
    for (int k = 0; k < t.width * t.height * t.channels; k++)
        pixels[k] = 0.1f + 0.3f * (float)(k % 7) / 7;
    t.pixels = pixels;
    test_must(own, imp_problem_add_target(p, &t));
    free(pixels);
    a.n = imp_problem_n_variables(p);
    a.g = calloc(2 * a.n + 2, sizeof *a.g);
    a.se = a.g + a.n;
    test_must(own, imp_problem_objective(p, NULL, &run, &a.f, a.g, a.se));
    imp_problem_destroy(p);
    return a;
}
static void answer_free(struct answer *a)
{
    imp_film_destroy(a->film);
    free(a->g);
}

static bool same_film(imp_film *a, imp_film *b)
{
    struct imp_film_info i = {.size = sizeof i}, j = {.size = sizeof j};
    imp_film_get_info(a, &i);
    imp_film_get_info(b, &j);
    const size_t n = (size_t)i.width * (size_t)i.height * (size_t)i.channels;
    return i.channels == j.channels && i.width == j.width && i.height == j.height &&
           memcmp(imp_film_mean(a), imp_film_mean(b), n * sizeof(float)) == 0 &&
           memcmp(imp_film_se(a), imp_film_se(b), n * sizeof(float)) == 0;
}
static bool same(const struct answer *a, const struct answer *b)
{
    return same_film(a->film, b->film) && a->n == b->n && a->f.value == b->f.value &&
           a->f.se == b->f.se && a->weight.ess == b->weight.ess &&
           a->weight.growth == b->weight.growth &&
           memcmp(a->g, b->g, 2 * a->n * sizeof *a->g) == 0;
}

/* ---- Scenes ---------------------------------------------------------------------- */

static void set(imp_scene *scene, const char *name, double factor)
{
    size_t k;
    struct imp_param_info info = {.size = sizeof info};
    for (k = 0; k < scene->n_params; k++) /* the first whose name begins so */
        if (strncmp(scene->params[k].info.name, name, strlen(name)) == 0) break;
    test_must(scene->ctx, imp_scene_get_param(scene, k, &info));
    double *x = malloc((info.count + 1) * sizeof *x);
    test_must(scene->ctx, imp_scene_get_values(scene, k, x));
    for (size_t e = 0; e < info.count; e++)
        x[e] = fmin(x[e] * factor * (1 + 0.01 * (double)(e % 3)), info.hi);
    test_must(scene->ctx, imp_scene_set_values(scene, k, info.count, x));
    free(x);
}

static imp_walks *keep(imp_scene *scene, int spp, enum imp_points points)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    imp_walks *walks;
    run.spp = spp;
    run.seed = 5;
    run.points = points;
    o.losses = 1;
    o.ess = 0.01;
    test_must(scene->ctx, imp_walks_keep(scene, &run, &o, &walks));
    return walks;
}

static imp_walks *read_back(imp_context *where)
{
    imp_walks *walks;
    test_must(where, imp_walks_read(where, NULL, path, NULL, &walks));
    return walks;
}

/* `moved` is changed once before the draw, and once more for the answer elsewhere. */
static void to_the_bit(imp_scene *scene, const char *what, const char *moved, int spp,
                       enum imp_points points)
{
    set(scene, moved, 0.95);
    imp_walks *walks = keep(scene, spp, points);
    struct answer here = answer_of(scene, walks);
    test_must(ctx, imp_walks_write(walks, path));
    imp_walks *one = read_back(ctx), *other = read_back(three);
    struct answer a = answer_of(imp_walks_scene(one), one);
    struct answer b = answer_of(imp_walks_scene(other), other);
    double size = 0;
    for (size_t k = 0; k < here.n; k++) size += fabs(here.g[k]);
    tap_ok(same(&here, &a) && size > 0 && here.f.value > 0, "%s: read, to the bit", what);
    tap_ok(same(&here, &b), "%s: and with three threads", what);
    answer_free(&a);
    answer_free(&b);

    set(scene, moved, 0.9);
    set(imp_walks_scene(one), moved, 0.9);
    set(imp_walks_scene(other), moved, 0.9);
    struct answer there = answer_of(scene, walks);
    a = answer_of(imp_walks_scene(one), one);
    b = answer_of(imp_walks_scene(other), other);
    tap_ok(same(&there, &a) && there.f.value != here.f.value,
           "%s: at another %s # ess %.3f", what, moved, there.weight.ess);
    tap_ok(same(&there, &b), "%s: and with three threads", what);
    answer_free(&a);
    answer_free(&b);

    /* In the scene that they were drawn in, at numbers that have changed since. */
    imp_walks *again;
    test_must(ctx, imp_walks_read(ctx, scene, path, NULL, &again));
    a = answer_of(scene, again);
    tap_ok(same(&there, &a), "%s: in its own scene", what);
    answer_free(&a);
    answer_free(&here);
    answer_free(&there);
    imp_walks_destroy(again);
    imp_walks_destroy(walks);
    imp_walks_destroy(one);
    imp_walks_destroy(other);
    imp_scene_destroy(scene);
}

/* ---- Their files ----------------------------------------------------------------- */

/* Meshes, a measured material, a grid, and what else comes from files. */
static char volume[64], mesh[64], measured[64], rgl[64], picture[64];

static const char tray[] =
    "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

static void files_make(void)
{
    float cell[8 * 8 * 8];
    snprintf(mesh, sizeof mesh, "walks_file_%d.obj", (int)getpid());
    snprintf(measured, sizeof measured, "walks_file_%d.binary", (int)getpid());
    snprintf(rgl, sizeof rgl, "walks_file_%d.bsdf", (int)getpid());
    snprintf(picture, sizeof picture, "walks_file_%d.pfm", (int)getpid());
    FILE *f = fopen(picture, "w");
    const float height[4] = {0, 0.4f, 0, 0.8f};
    if (!f || fputs("Pf\n2 2\n-1.0\n", f) < 0 || fwrite(height, 4, 4, f) != 4 ||
        fclose(f) != 0)
        printf("Bail out! no picture\n");
    f = fopen(mesh, "w");
    for (int k = 0; k < 8 * 8 * 8; k++)
        cell[k] = (float)(0.2 + 0.6 * (k % 7) / 7 + 0.2 * (k % 3));
    vol_write(volume, 8, 8, 8, 1, cell);
    if (!f || fputs(tray, f) < 0 || fclose(f) != 0 ||
        !merl_write(measured, 20, 10, 12,
                    &(struct merl_model){0.4, 0.3, {0.8, 0.6, 0.5}}) ||
        !rgl_write(rgl, &(struct rgl_model){{0.3, 0.5}, 2, true, true, true})) {
        printf("Bail out! no files\n");
        exit(99);
    }
}

static const char room[] =
    "<scene version='3.0.0'><integrator type='%s'/>"
    "<sensor type='perspective'><transform name='to_world'><lookat origin='0,-4,3' "
    "target='0,0,0' up='0,0,1'/></transform><float name='fov' value='50'/><film "
    "type='hdrfilm'><integer name='width' value='14'/><integer name='height' "
    "value='10'/>%s</film></sensor>"
    "<bsdf type='blendbsdf' id='mixed'><texture name='weight' type='checkerboard'/>"
    "<bsdf type='roughconductor'><float name='alpha' value='.3'/></bsdf><bsdf "
    "type='roughplastic'/></bsdf>"
    "<shape type='obj' id='tray'><string name='filename' value='%s'/><transform "
    "name='to_world'><scale value='2'/></transform><ref id='mixed'/></shape>"
    "<shape type='obj' id='lamp'><string name='filename' value='%s'/><transform "
    "name='to_world'><rotate x='1' angle='180'/><translate z='3'/></transform><emitter "
    "type='area'><rgb name='radiance' value='4,3,2'/></emitter></shape>"
    "<shape type='shapegroup' id='pair'><shape type='sphere'><float name='radius' "
    "value='.3'/><bsdf type='twosided'><bsdf type='principled'><rgb name='base_color' "
    "value='.5,.3,.2'/></bsdf></bsdf></shape><shape type='sphere' id='glass'><point "
    "name='center' x='.7' y='0' z='0'/><float name='radius' value='.2'/><bsdf "
    "type='dielectric'/></shape></shape>"
    "<shape type='instance'><transform name='to_world'><translate x='-1' "
    "z='.5'/></transform><ref id='pair'/></shape>"
    "<shape type='instance'><transform name='to_world'><translate x='.5' y='.5' "
    "z='.5'/></transform><ref id='pair'/></shape>"
    "<shape type='sphere' id='ball'><point name='center' x='1.2' y='-1' z='.4'/><float "
    "name='radius' value='.4'/><bsdf type='merl'><string name='filename' "
    "value='%s'/></bsdf></shape><shape type='sphere'><point name='center' "
    "x='-1' y='-1' "
    "z='.3'/><float name='radius' value='.3'/><bsdf type='measured'><string "
    "name='filename' value='%s'/></bsdf></shape>%s</scene>";

static const char smoke[] =
    "<shape type='cube'><transform name='to_world'><scale value='.4'/><translate x='-1' "
    "y='-1' z='.5'/></transform><bsdf type='null'/><medium type='heterogeneous' "
    "name='interior' id='smoke'><volume name='sigma_t' type='gridvolume'><string "
    "name='filename' value='%s'/><transform name='to_world'><scale "
    "value='.8'/><translate "
    "x='-1.4' y='-1.4' z='.1'/></transform></volume><float name='albedo' "
    "value='.8'/></medium></shape>";

static imp_scene *room_make(enum imp_color_mode mode, bool media, bool wide)
{
    char text[8192], inside[1024] = "";
    if (media) snprintf(inside, sizeof inside, smoke, volume);
    snprintf(text, sizeof text, room, media ? "volpath" : "path",
             wide ? "<rfilter type='gaussian'/>" : "<rfilter type='box'/>", mesh, mesh,
             measured, rgl, inside);
    return test_scene_text(ctx, text, mode);
}

/* ---- Cases ----------------------------------------------------------------------- */

static const struct scene_case {
    const char *file;
    enum imp_color_mode mode;
    const char *defines, *active, *moved;
    int spp;
    enum imp_points points;
} cases[] = {
    {"cornell.xml", IMP_RGB, "res=12", "*", "white.refl", 8, IMP_POINTS_SCENE},
    {"cornell.xml", IMP_MONO, "res=12 max_depth=-1", "*", "light.radiance", 6,
     IMP_POINTS_INDEPENDENT},
    {"cornell.xml", IMP_SPECTRAL, "res=12", "*", "red.refl", 6, IMP_POINTS_SOBOL},
    {"cornell.xml", IMP_SINGLE, "res=12", "*", "green.refl", 6, IMP_POINTS_SCENE},
    {"textured.xml", IMP_RGB, "width=16 height=12", "*", "floor.refl", 4,
     IMP_POINTS_SCENE},
    {"textured.xml", IMP_SPECTRAL, "width=12 height=9", "*", "floor.refl", 4,
     IMP_POINTS_SCENE},
    {"lamps.xml", IMP_RGB, "res=12", "*", "batwing.scale", 4, IMP_POINTS_SCENE},
    {"stam.xml", IMP_RGB, "res=12", "*", "sphere.exponent", 4, IMP_POINTS_SCENE},
    {"fog.xml", IMP_RGB, "res=12", "*.reflectance*", "fog.albedo", 4, IMP_POINTS_SCENE},
    {"orchard.xml", IMP_RGB, "res=12", "*", "bark.refl", 4, IMP_POINTS_SCENE},
    {"photons/sky.xml", IMP_RGB, "width=16 height=6", "*", "satin.alpha", 4,
     IMP_POINTS_SCENE},
};

/* ---- Refusals -------------------------------------------------------------------- */

static unsigned char *bytes_of(size_t *n)
{
    static unsigned char all[1 << 22];
    FILE *f = fopen(path, "rb");
    *n = f ? fread(all, 1, sizeof all, f) : 0;
    if (f) fclose(f);
    return all;
}
static void bytes_put(const unsigned char *b, size_t n)
{
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(b, 1, n, f) != n || fclose(f) != 0) {
        printf("Bail out! cannot write %s\n", path);
        exit(99);
    }
}
static bool is_read(void)
{
    imp_walks *walks;
    const bool is = imp_walks_read(ctx, NULL, path, NULL, &walks) == IMP_OK;
    if (is) imp_walks_destroy(walks);
    return is;
}

static void damage(void)
{
    imp_scene *scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    imp_walks *walks = keep(scene, 2, IMP_POINTS_SCENE);
    size_t n;
    test_must(ctx, imp_walks_write(walks, path));
    unsigned char *b = bytes_of(&n);
    static const struct {
        size_t at;
        const char *word;
    } parts[] = {{0, "not a file"}, {8, "byte order"}, {12, "version"}};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        unsigned char old[4];
        memcpy(old, b + parts[k].at, 4);
        for (int j = 0; j < 4; j++) b[parts[k].at + (size_t)j] = old[3 - j];
        bytes_put(b, n);
        tap_ok(!is_read() && strstr(imp_last_error(ctx), parts[k].word), "refused # %s",
               imp_last_error(ctx));
        memcpy(b + parts[k].at, old, 4);
    }
    int read = 0, tried = 0;
    for (size_t k = 0; k < n; k += 1 + k / 50, tried++) {
        b[k] ^= (unsigned char)(1u << k % 8);
        bytes_put(b, n);
        read += is_read();
        b[k] ^= (unsigned char)(1u << k % 8);
    }
    tap_ok(read == 0 && tried > 200, "one bit flipped: refused # %d of %d read", read,
           tried);
    for (size_t k = 0; k < n; k += 1 + k / 20) {
        bytes_put(b, k);
        read += is_read();
    }
    tap_ok(read == 0, "cut short: refused # %s", imp_last_error(ctx));
    b[n] = 0;
    bytes_put(b, n + 1);
    tap_ok(!is_read(), "a byte too much: refused # %s", imp_last_error(ctx));
    bytes_put(b, n);
    tap_ok(is_read(), "control: unchanged it is read");

    imp_scene *other = test_scene(ctx, "cornell.xml", IMP_RGB, "res=9");
    imp_walks *again;
    tap_ok(imp_walks_read(ctx, other, path, NULL, &again) == IMP_E_ARG,
           "into another film: refused # %s", imp_last_error(ctx));
    imp_scene_destroy(other);
    other = test_scene(ctx, "lamps.xml", IMP_RGB, NULL);
    tap_ok(imp_walks_read(ctx, other, path, NULL, &again) == IMP_E_ARG,
           "into another scene: refused # %s", imp_last_error(ctx));
    imp_scene_destroy(other);
    struct imp_walks_options little = IMP_WALKS_OPTIONS_INIT;
    little.memory = 1000;
    tap_ok(imp_walks_read(ctx, NULL, path, &little, &again) == IMP_E_NOMEM,
           "no room: refused # %s", imp_last_error(ctx));
    tap_ok(imp_walks_write(walks, "no/such/folder/file") == IMP_E_IO, "unwritable # %s",
           imp_last_error(ctx));
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* What a file holds answers from its walks alone. */
static void rayless(void)
{
    imp_walks *walks = read_back(ctx);
    imp_scene *scene = imp_walks_scene(walks);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    imp_elements *elements;
    imp_walks *again;
    char *text;
    const int refused =
        (imp_render(scene, &run, &film) == IMP_E_UNSUPPORTED) +
        (imp_walks_keep(scene, &run, NULL, &again) == IMP_E_UNSUPPORTED) +
        (imp_walk_describe(scene, &run, 0, 0, 0, 0, &text) == IMP_E_UNSUPPORTED) +
        (imp_elements_create(scene, NULL, &elements) == IMP_E_UNSUPPORTED);
    tap_ok(refused == 4, "no rays: pictures, draws, walks, elements are refused # %s",
           imp_last_error(ctx));
    imp_walks_destroy(walks);
}

static void unwritten_one(const char *what, const char *shapes, const char *reason)
{
    char text[2048];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='path'/><sensor "
             "type='perspective'><transform name='to_world'><lookat origin='0,0,4' "
             "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
             "name='width' value='4'/><integer name='height' value='4'/></film></sensor>"
             "<emitter type='constant'/><bsdf type='bumpmap' id='bumps'><texture "
             "type='bitmap' name='arbitrary'><string name='filename' value='%s'/>"
             "</texture><bsdf type='diffuse'/></bsdf>%s</scene>",
             picture, shapes);
    imp_scene *scene = test_scene_text(ctx, text, IMP_RGB);
    imp_walks *walks = keep(scene, 2, IMP_POINTS_SCENE);
    tap_ok(imp_walks_write(walks, path) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), reason),
           "%s are refused # %s", what, imp_last_error(ctx));
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

static void unwritten(void)
{
    char shapes[512];
    snprintf(shapes, sizeof shapes,
             "<shape type='obj'><string name='filename' value='%s'/><ref id='bumps'/>"
             "</shape>",
             mesh);
    unwritten_one("bumps on triangles", shapes, "triangles count");
    unwritten_one("bumps of an instance",
                  "<shape type='shapegroup' id='g'><shape type='rectangle'/></shape>"
                  "<shape type='instance'><ref id='g'/><ref id='bumps'/></shape>",
                  "brings or stretches");
    unwritten_one("bumps that an instance stretches",
                  "<shape type='shapegroup' id='g'><shape type='rectangle'><ref "
                  "id='bumps'/></shape></shape><shape type='instance'><ref id='g'/>"
                  "<transform name='to_world'><scale x='2'/></transform></shape>",
                  "brings or stretches");
}

int main(void)
{
    ctx = test_context(1);
    three = test_context(3);
    snprintf(path, sizeof path, "walks_file_%d.tmp", (int)getpid());
    files_make();
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const struct scene_case *c = &cases[k];
        active = c->active;
        to_the_bit(test_scene(ctx, c->file, c->mode, c->defines), c->file, c->moved,
                   c->spp, c->points);
    }
    active = "*";
    to_the_bit(room_make(IMP_RGB, false, true), "meshes and groups", "mixed.", 4,
               IMP_POINTS_SCENE);
    to_the_bit(room_make(IMP_SPECTRAL, false, false), "with wavelengths", "lamp.", 4,
               IMP_POINTS_SCENE);
    active = "lamp*";
    to_the_bit(room_make(IMP_RGB, true, false), "with smoke", "smoke.albedo", 4,
               IMP_POINTS_SCENE);
    rayless();
    damage();
    unwritten();
    remove(path);
    remove(volume);
    remove(mesh);
    remove(measured);
    remove(rgl);
    remove(picture);
    imp_context_destroy(ctx);
    imp_context_destroy(three);
    return tap_done();
}
