/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks in bundles (walk/bundle/) beside the same walks alone: radiance, film position, alpha and
 * the cause of a drop, to the bit, of scenes whose vertices are made in lanes and of others. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/lamp_levels.h"
#include "walk/bundle/depth.h"
#include <stdio.h>
#include <unistd.h>

enum { SIDE = 6, SAMPLES = 21 }; /* neither is a multiple of lanes */

static imp_context *ctx;
static const double *level; /* of emitters; NULL: as they are */

/* ---- Scenes ------------------------------------------------------------------------------ */

#define PATH(rest) "<integrator type='path'>" rest "</integrator>"
#define DEPTH(n)   "<integer name='max_depth' value='" n "'/>"
#define RR(n)      "<integer name='rr_depth' value='" n "'/>"
#define VIEW                                                                             \
    "<transform name='to_world'><lookat origin='0.3,0.2,3.4' target='0,0,0' "            \
    "up='0,1,0'/></transform><float name='fov' value='55'/>"
#define CAMERA "perspective'>" VIEW

#define AT(x, y, z, axis, angle, size)                                                   \
    "<transform name='to_world'><scale value='" size "'/><rotate " axis                  \
    "='1' angle='" angle "'/><translate x='" x "' y='" y "' z='" z "'/></transform>"
#define DIFFUSE(rgb)                                                                     \
    "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
#define WALL(x, y, z, axis, angle, bsdf)                                                 \
    "<shape type='rectangle'>" AT(x, y, z, axis, angle, "2") bsdf "</shape>"
#define ROOM                                                                             \
    WALL("0", "-2", "0", "x", "-90", DIFFUSE(".7,.6,.5"))                                \
    WALL("0", "2", "0", "x", "90", DIFFUSE(".6,.7,.8"))                                  \
    WALL("-2", "0", "0", "y", "90", DIFFUSE(".8,.1,.1"))                                 \
    WALL("2", "0", "0", "y", "-90", DIFFUSE(".1,.8,.2"))                                 \
    WALL("0", "0", "-2", "y", "0", DIFFUSE(".5,.5,.5"))
#define AREA(rgb) "<emitter type='area'><rgb name='radiance' value='" rgb "'/></emitter>"
#define LAMP(x, z, size)                                                                 \
    "<shape type='rectangle'>" AT(x, "1.9", z, "x", "90", size) AREA("9,8,7") "</shape>"
#define GOLD(more)                                                                       \
    "<bsdf type='roughconductor'><string name='material' value='Au'/><string "           \
    "name='distribution' value='ggx'/>" more "</bsdf>"
#define ALPHA(name, v) "<float name='" name "' value='" v "'/>"
#define BALL(x, y, bsdf)                                                                 \
    "<shape type='sphere'><point name='center' x='" x "' y='" y                          \
    "' z='0'/><float name='radius' value='.5'/>" bsdf "</shape>"
#define CUBE(x, y, bsdf)                                                                 \
    "<shape type='cube'>" AT(x, y, ".3", "y", "30", ".4") bsdf "</shape>"
#define CHECKERS                                                                         \
    "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'><transform "   \
    "name='to_uv'><scale value='7'/></transform></texture></bsdf>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.6,.8,1'/></emitter>"

/* What a meter lies on. */
#define WITHIN "<shape type='rectangle'>" AT("0", "-1", "0", "x", "-90", ".5")

static bool same(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}
static bool same_color(imp_spec a, imp_spec b, const struct imp_carried *carried)
{
    bool all = true;
    for (int c = 0; c < (carried ? 4 : 3); c++) all &= same(a[c], b[c]);
    return all;
}
static bool same_decided(const imp_decided *a, const imp_decided *b, int n)
{
    bool all = true;
    for (int k = 0; k < n; k++) all &= same(a[k], b[k]);
    return all;
}

/* ---- Records ----------------------------------------------------------------------------- */

static bool same_located(const struct imp_located *a, const struct imp_located *b)
{
    return a->prim == b->prim && same(a->at[0], b->at[0]) && same(a->at[1], b->at[1]);
}

static bool same_step(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_decision *x = &a->d, *y = &b->d;
    if (x->goes_on != y->goes_on) return false;
    return !x->goes_on ||
           (same_decided(x->wi, y->wi, 3) && same(x->pdf, y->pdf) && x->lobe == y->lobe &&
            same(x->survive, y->survive) && same(x->share, y->share) &&
            same(x->rest, y->rest) && x->drawn == y->drawn && x->alone == y->alone);
}

static bool same_light(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_light *x = &a->d.light, *y = &b->d.light;
    if (a->d.connection != b->d.connection) return false;
    return a->d.connection == IMP_NOT_CONNECTED ||
           (x->emitter == y->emitter && same(x->weight, y->weight) &&
            same_decided(x->uv, y->uv, 2) && same(x->dist, y->dist) &&
            same(x->cos_light, y->cos_light) && same_decided(x->d, y->d, 3) &&
            same_decided(x->p, y->p, 3) && same_decided(x->wi, y->wi, 3) &&
            same_located(&x->located, &y->located) &&
            same_color(a->light_f, b->light_f, a->carried) &&
            same_color(a->light_e, b->light_e, a->carried) &&
            same_color(a->light_w, b->light_w, a->carried));
}

static bool same_met(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_met *x = &a->d.met, *y = &b->d.met;
    if (x->emitter != y->emitter) return false;
    return x->emitter < 0 ||
           (same(x->weight, y->weight) && same(x->dist, y->dist) &&
            same(x->cos_light, y->cos_light) && same_decided(x->d, y->d, 3));
}

static bool same_vertex(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_decision *x = &a->d, *y = &b->d;
    bool all = a->bsdf == b->bsdf && a->shape == b->shape && same(a->t, b->t) &&
               same_color(a->scale, b->scale, a->carried) &&
               same_color(a->e, b->e, a->carried) && same_color(a->b, b->b, a->carried) &&
               same_color(a->w, b->w, a->carried) &&
               same_color(a->beyond, b->beyond, a->carried) && !a->carried == !b->carried;
    all &= x->shape == y->shape && x->scatterer == y->scatterer &&
           same_decided(x->uv, y->uv, 2) && same_decided(x->p, y->p, 3);
    for (int j = 0; a->bsdf && j < a->bsdf->n_in; j++)
        all &= same_color(a->in[j], b->in[j], a->carried);
    if (a->shape)
        all &= same_decided(x->wo, y->wo, 3) && x->back == y->back &&
               x->place == y->place && same_located(&x->located, &y->located) &&
               x->glows == y->glows && same(a->ng[0], b->ng[0]) &&
               same(a->ng[1], b->ng[1]) && same(a->ng[2], b->ng[2]);
    return all && same_step(a, b) && same_light(a, b) && same_met(a, b);
}

/* Vertices that differ, of two records of a walk. */
static int differing(const struct imp_walk *a, const struct imp_walk *b)
{
    const struct imp_vertex *v = a->first, *w = b->first;
    int wrong = a->n != b->n || a->depth != b->depth || a->key.state != b->key.state ||
                (a->point.points &&
                 (a->point.set != b->point.set || a->point.index != b->point.index));
    for (; v && w; v = v->next, w = w->next) wrong += !same_vertex(v, w);
    return wrong + (v != w);
}

/* Walks of a bundle that differ from the same alone; *lit: those with light. */
static int compared(const struct imp_tracer *tracer, int *lit)
{
    struct imp_arena arena, alone;
    struct imp_bundle b;
    int xy[SIDE * SIDE][2], wrong = 0;
    int64_t samples[SAMPLES];
    *lit = 0;
    imp__arena_init(&arena, ctx);
    imp__arena_init(&alone, ctx);
    for (int p = 0; p < SIDE * SIDE; p++) xy[p][0] = p % SIDE, xy[p][1] = p / SIDE;
    for (int k = 0; k < SAMPLES; k++) samples[k] = imp__set_number(4, SAMPLES, k);
    if (!imp__bundle_fits(tracer) ||
        !imp__bundle_trace(tracer, &arena, SIDE * SIDE, (const int(*)[2])xy, SAMPLES,
                           samples, &b))
        return -1;
    for (int k = 0; k < b.n; k++) {
        struct imp_walk one, other;
        const int *at = xy[k / SAMPLES];
        imp__walk_trace(tracer, &alone, at[0], at[1], samples[k % SAMPLES], &one);
        imp__bundle_walk(&b, k, &other);
        bool all = same(one.px, other.px) && same(one.py, other.py) &&
                   one.valid == other.valid && one.dropped == other.dropped &&
                   same(one.time, other.time);
        for (int c = 0; c < 3; c++) all &= same(one.L[c], other.L[c]);
        for (int c = 0; one.waves && c < 4; c++)
            all &= same(one.values[c], other.values[c]);
        if (!tracer->value_only) all &= differing(&one, &other) == 0;
        wrong += !all;
        *lit += one.L[0] > 0;
        imp__arena_rewind(&alone, (struct imp_arena_mark){0});
    }
    imp__arena_free(&arena);
    imp__arena_free(&alone);
    return wrong;
}

/* lanes: so many shapes have vertices in lanes. */
static void compare(const char *name, enum imp_color_mode mode, int lanes,
                    const char *integrator, const char *sensor, const char *rest)
{
    static char xml[40000];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s%s<sensor type='%s<film type='hdrfilm'><integer "
             "name='width' value='6'/><integer name='height' value='6'/><rfilter "
             "type='box'/></film></sensor>%s</scene>",
             integrator, strstr(sensor, "meter") ? WITHIN : "", sensor,
             strstr(sensor, "meter") ? "</shape>" ROOM LAMP("0", "0", ".5") : rest);
    imp_scene *scene = test_scene_text(ctx, xml, mode);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = imp__walk_integrator(scene),
                                .sensor = scene->sensors[0],
                                .value_only = true,
                                .seed = 5};
    struct imp_active active;
    struct imp__lamp_levels levels = {0};
    static uint8_t chosen[1024];
    int lit, binned = 0;
    if (strstr(name, "independent")) run.points = IMP_POINTS_INDEPENDENT;
    imp__tracer_numbers(&tracer, &run, SAMPLES);
    if (level) test_must(ctx, imp__lamp_levels_begin(scene, level, &levels));
    for (int k = 0; k < scene->n_shapes; k++)
        binned += imp__lanes_fit(&tracer) && imp__shape_in_lanes(&tracer, k);
    const int wrong = compared(&tracer, &lit);
    tap_ok(wrong == 0 && lit > SIDE * SIDE / 2 && binned == lanes,
           "%s: of %d walks, %d lit, %d differ; %d shapes in lanes, %d expected", name,
           SIDE * SIDE * SAMPLES, lit, wrong, binned, lanes);

    /* Recorded, with derivatives by all parameters. */
    for (size_t k = 0; k < scene->n_params; k++)
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(ctx, imp__active_create(scene, chosen, &active));
    tracer.active = &active;
    const int values = compared(&tracer, &lit);
    tracer.value_only = false;
    const int records = compared(&tracer, &lit);
    /* Those that cross media are recorded alone. */
    tap_ok(values == 0 && records == (strstr(integrator, "volpath") ? -1 : 0),
           "... with derivatives: %d differ, and of those that are recorded %d", values,
           records);
    imp__active_destroy(ctx, &active);
    imp__lamp_levels_end(&levels);
    imp_scene_destroy(scene);
}

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
    compare("kinds without lanes", IMP_RGB, 2, PATH(DEPTH("8")), CAMERA,
            SKY WALL("0", "-1", "0", "x", "-90", DIFFUSE(".5,.6,.7"))
                BALL(".7", ".3", "<bsdf type='thindielectric'/>")
                    BALL("-.7", ".3", "<bsdf type='plastic'/>")
                        CUBE("0", "-.5", "<bsdf type='roughplastic'/>")
                            BALL("0", "1",
                                 "<bsdf type='mask'><float name='opacity' "
                                 "value='.5'/>" DIFFUSE(".9,.1,.1") "</bsdf>")
                                CUBE("1.6", ".9", DIFFUSE(".4,.4,.4")));
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

#define VOLPATH(rest) "<integrator type='volpath'>" rest "</integrator>"
#define MEDIUM(id, sigma, albedo, phase)                                                 \
    "<medium type='homogeneous' id='" id "'><rgb name='sigma_t' value='" sigma           \
    "'/><rgb name='albedo' value='" albedo "'/>" phase "</medium>"
#define HG(g)           "<phase type='hg'><float name='g' value='" g "'/></phase>"
#define HOLDS(id, bsdf) "<bsdf type='" bsdf "'/><ref name='interior' id='" id "'/>"

/* Walks through media of uniform extinction. */
static void media(void)
{
    static char rest[8192];
    compare("a slab of three colours", IMP_RGB, 1, VOLPATH(DEPTH("40") RR("8")), CAMERA,
            MEDIUM("m", "1,2,4", ".98,.9,.8", HG(".6")) SKY LAMP("0", "0", ".5")
                CUBE("0", "0", HOLDS("m", "null"))
                    CUBE("-.6", "-1.2", DIFFUSE(".9,.5,.1")));
    compare("independent walks in a slab", IMP_RGB, 0, VOLPATH(DEPTH("9")), CAMERA,
            MEDIUM("m", "1,2,4", ".98,0,.8", "") LAMP("0", "0", ".5")
                CUBE("0", "0", HOLDS("m", "null")) SKY);
    compare("a slab in grey", IMP_MONO, 1, VOLPATH(DEPTH("12")), CAMERA,
            MEDIUM("m", "3,3,3", ".9,.9,.9", HG("-.3")) LAMP("0", "0", ".5")
                CUBE("0", "0", HOLDS("m", "null"))
                    CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")) SKY);
    /* Boundaries that bend, a medium within a medium, one that only absorbs, and phase functions
     * without a form in lanes. */
    snprintf(rest, sizeof rest, "%s%s",
             MEDIUM("wax", "6,7,9", ".99,.96,.85", HG(".5"))
                 MEDIUM("tea", "2,0,3", "0,0,0", "")
                     MEDIUM("air", "1,1,1", ".9,.8,.7", "<phase type='rayleigh'/>"),
             ROOM LAMP("0", "0", ".5") BALL("-.7", ".4", HOLDS("wax", "dielectric")) BALL(
                 "1", ".4", HOLDS("tea", "roughdielectric"))
                 CUBE(".2", "-.9", HOLDS("air", "null")) "<shape type='cube'>" AT(
                     ".2", "-.9", ".3", "y", "30", ".2")
                     HOLDS("wax", "null") "<ref name='exterior' id='air'/></shape>" CUBE(
                         "-.9", "-1.2", DIFFUSE(".9,.2,0")));
    compare("wax, tea and air", IMP_RGB, 7, VOLPATH(DEPTH("30") RR("6")), CAMERA, rest);
    strcat(rest, SKY);
    compare("wax, tea and air, and a sky", IMP_RGB, 7, VOLPATH(DEPTH("7")), CAMERA, rest);
    compare("a fog that fills the room", IMP_RGB, 6, VOLPATH(DEPTH("8")),
            CAMERA "<ref id='fog'/>",
            MEDIUM("fog", ".2,.3,.4", ".9,.9,.9", HG(".7")) "<shape type='rectangle'>" AT(
                "0", "-2", "0", "x", "-90", "2")
                DIFFUSE(".7,.6,.5") "<ref name='exterior' id='fog'/></shape>" WALL(
                    "0", "2", "0", "x", "90", DIFFUSE(".6,.7,.8"))
                    WALL("-2", "0", "0", "y", "90", DIFFUSE(".8,.1,.1"))
                        WALL("2", "0", "0", "y", "-90", DIFFUSE(".1,.8,.2"))
                            WALL("0", "0", "-2", "y", "0", DIFFUSE(".5,.5,.5"))
                                LAMP("0", "0", ".5")
                                    CUBE("-.6", "-1.2", DIFFUSE(".9,.9,.9")));
    compare("no medium", IMP_RGB, 6, VOLPATH(DEPTH("5")), CAMERA,
            ROOM LAMP("0", "0", ".5") CUBE("-.6", "-1.2", DIFFUSE(".9,.2,0")));
    compare("clipped, in fog", IMP_RGB, 1, VOLPATH(DEPTH("5")),
            "perspective'><float name='near_clip' value='1.5'/><float name='far_clip' "
            "value='5'/><ref id='fog'/>" VIEW,
            MEDIUM("fog", ".2,.3,.4", ".9,.9,.9", HG(".7")) SKY LAMP("0", "0", ".5")
                CUBE("-.6", "-.2", DIFFUSE(".9,.9,.9")));
    compare("lamps by a tree, in fog", IMP_RGB, 1,
            VOLPATH(DEPTH("5") "<string name='light_choice' value='tree'/>"),
            CAMERA "<ref id='fog'/>",
            MEDIUM("fog", ".2,.3,.4", ".9,.9,.9", HG(".7")) LAMP("0", "0", ".5")
                LAMP("1", "0", ".2") LAMP("-1", "0", ".2")
                    CUBE("-.6", "-.2", DIFFUSE(".9,.9,.9")));
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

int main(void)
{
    ctx = test_context(1);
    boxes();
    spectra();
    materials();
    ideal();
    media();
    lights();
    sensors();
    scenes();
    meshes();
    imp_context_destroy(ctx);
    return tap_done();
}
