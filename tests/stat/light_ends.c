/* SPDX-License-Identifier: Apache-2.0
 *
 * Light walks against walks from the sensor, and both against what is known: a
 * reading is the same number from either end, R = R_A (Veach 1997, 3.7; Morley et al.
 * 2006, section 1). No factor stands between them but those of the scattering functions;
 * each of these, left out of a walk, must be missed (planted). */
#include "end_reading.h"
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/bsdf/transport.h"
#include "scene/scene.h"
#include "walk/core/vertex.h"
#include "walk/lights/light_walk.h"

static imp_context *ctx;

#define HEAD                                                                             \
    "<scene version='3.0.0'><integrator type='ptracer'><integer name='max_depth' "       \
    "value='%d'/></integrator>"
#define FILM(w, h, filter)                                                               \
    "<film type='hdrfilm'><integer name='width' value='" #w                              \
    "'/><integer name='height' value='" #h "'/><rfilter type='" filter "'/></film>"
#define METER "<sensor type='irradiancemeter'>" FILM(1, 1, "box") "</sensor>"
#define CAMERA(z)                                                                        \
    "<sensor type='perspective'><float name='fov' value='50'/><transform "               \
    "name='to_world'><lookat origin='0,0," #z "' target='0,0,0' up='0,1,0'/>"            \
    "</transform>" FILM(6, 4, "box") "</sensor>"
#define LAMP(e)    "<emitter type='area'><rgb name='radiance' value='" e "'/></emitter>"
#define DIFFUSE(r) "<bsdf type='diffuse'><rgb name='reflectance' value='" r "'/></bsdf>"

static imp_scene *scene_of(int max_depth, const char *body, enum imp_color_mode mode)
{
    char xml[16384];
    const int n = snprintf(xml, sizeof xml, HEAD, max_depth);
    snprintf(xml + n, sizeof xml - (size_t)n, "%s</scene>", body);
    return test_scene_text(ctx, xml, mode);
}

/* Both ends, and the truth if it is known (not NAN). relative: largest standard error.
 * The reading from the sensor. */
static double ends(const char *what, int max_depth, const char *body,
                   enum imp_color_mode mode, int from_sensor, int from_lights,
                   double truth, double relative)
{
    imp_scene *scene = scene_of(max_depth, body, mode);
    const struct imp_estimate a =
        end_reading(ctx, scene, IMP_FROM_SENSOR, from_sensor, 11);
    const struct imp_estimate b =
        end_reading(ctx, scene, IMP_FROM_LIGHTS, from_lights, 12);
    const double se = hypot(a.se, b.se), z = (a.value - b.value) / se;
    tap_ok(fabs(z) < 4 && se < relative * fabs(a.value),
           "%s: sensor %.6g +- %.1g, lights %.6g +- %.1g # z %.2f", what, a.value, a.se,
           b.value, b.se, z);
    if (!isnan(truth)) {
        const double za = (a.value - truth) / a.se, zb = (b.value - truth) / b.se;
        const bool exact = a.se < 1e-6 * truth && fabs(a.value - truth) < 1e-6 * truth;
        tap_ok((exact || fabs(za) < 4) && fabs(zb) < 4,
               "%s: truth %.6g # z %.2f from the sensor, %.2f from the lights", what,
               truth, exact ? 0 : za, zb);
    }
    imp_scene_destroy(scene);
    return a.value;
}

/* ---- Closed forms ----------------------------------------------------------------- */

/* Coaxial discs of radius .5 and 1 at distance 1: R = pi A1 F12 = 1.1568931 (F2a). */
/* clang-format off: literals are broken where the markup is */
#define DISC(place, r, inside)                                                           \
    "<shape type='disk'>" AT(place) DIFFUSE(r) inside "</shape>"
#define DISCS_OF(r, z0, a, z1, b)                                                        \
    DISC("<scale value='.5'/><translate z='" z0 "'/>", r, a)                             \
    DISC("<rotate y='1' angle='180'/><translate z='" z1 "'/>", r, b)
#define DISCS(z0, a, z1, b) DISCS_OF("0", z0, a, z1, b)
/* clang-format on */

/* Thin glass between the discs, in a scene with a medium, where connections pass it: light
 * that meets the sensor behind the glass has been connected to it, too. */
static void behind_glass(void)
{
    /* clang-format off */
    const char *const glass =
        "<shape type='rectangle'>" AT("<scale value='3'/><translate z='.5'/>")
        "<bsdf type='thindielectric'/></shape><shape type='sphere'><point name='center' "
        "value='0,0,-9'/><bsdf type='null'/><medium name='interior' type='homogeneous'/>"
        "</shape>";
    /* clang-format on */
    char body[8192];
    /* Black discs send direct light alone; between others light goes to and fro, and
     * max_depth matters. */
    snprintf(body, sizeof body, DISCS("0", METER, "1", LAMP("1")) "%s", glass);
    ends("black discs with thin glass between them", 6, body, IMP_MONO, 100000, 100000,
         NAN, 1e-2);
    snprintf(body, sizeof body, DISCS_OF(".8", "0", METER, "1", LAMP("1")) "%s", glass);
    const double all = ends("discs that reflect .8, with thin glass between them", 6,
                            body, IMP_MONO, 100000, 100000, NAN, 1e-2);
    const double cut =
        ends("the same, max_depth 2", 2, body, IMP_MONO, 100000, 100000, NAN, 1e-2);
    tap_ok(all > 1.05 * cut, "max_depth matters # %.5g, %.5g", all, cut);
}

static void discs(void)
{
    const double R = 1.1568931, pi = acos(-1);
    ends("discs, the smaller one a lamp", -1, DISCS("0", LAMP("1"), "1", METER), IMP_MONO,
         200000, 200000, R / pi, 3e-3);
    ends("discs, roles exchanged", -1, DISCS("0", METER, "1", LAMP("1")), IMP_MONO,
         200000, 200000, R / (pi / 4), 3e-3);
}

/* Light of irradiance 3 along -z, from a shape about (0, 0, 4) of half size 1. */
#define BEAM(kind)                                                                       \
    "<shape type='" kind "'>" AT("<rotate x='1' angle='180'/><translate z='4'/>")        \
        DIFFUSE("0") "<emitter type='directionalarea'><float name='radiance' "           \
                     "value='3'/></emitter></shape>"

/* A meter in a block of index 1.5 under a flat surface, below a sky of radiance 1: pi (1 -
 * r_ext) = 2.85326 (F2d). The block has black walls. */
#define BLOCK                                                                            \
    "<emitter type='constant'><rgb name='radiance' value='1'/></emitter>"                \
    "<shape type='disk'>" AT(                                                            \
        "<scale value='5'/>") "<bsdf type='dielectric' id='glass'><float "               \
                              "name='int_ior' value='1.5'/><float "                      \
                              "name='ext_ior' value='1'/></bsdf></shape>"                \
                              "<shape type='cylinder'><point name='p0' "                 \
                              "value='0,0,-.3'/><point name='p1' "                       \
                              "value='0,0,0'/><float name='radius' value='5'/>" DIFFUSE( \
                                  "0") "</shape>"                                        \
                                       "<shape type='disk'>" AT(                         \
                                           "<scale value='5'/><translate z='-.3'/>")     \
                                           DIFFUSE("0") "</shape><shape "                \
                                                        "type='rectangle'>" AT(          \
                                                            "<scale x='2' "              \
                                                            "y='2'/><translate "         \
                                                            "z='-.2'/>") DIFFUSE("0")    \
                                                            METER "</shape>"

/* ---- Walks of this test, with one factor left out --------------------------------- */

typedef double factor_fn(const struct imp_vertex *v);

/* Product of a factor over the vertices that a walk went on from. */
static double product(const struct imp_walk *walk, const struct imp_vertex *end,
                      factor_fn *factor)
{
    double x = 1;
    for (const struct imp_vertex *v = walk->first; v && v != end; v = v->next)
        if (v->bsdf && v->d.goes_on) x *= factor(v);
    return x;
}

/* (n_o/n_i)^2 of a refraction: what radiance carries, and power does not. */
static double radiance_factor(const struct imp_vertex *v)
{
    const struct imp_dirs d = imp__vertex_dirs(v);
    if (!v->bsdf->ops->index_ratio || d.lobe == IMP_SMOOTH) return 1;
    const double r = v->bsdf->ops->index_ratio(v->bsdf, v->in, &d);
    return 1 / (r * r);
}

/* At a connection to the sensor: |cos_o^g/cos_i^g| over |cos_o^s/cos_i^s|, the cosines of
 * shading normals. */
static const struct imp_sensor *connected_to;
static double connection_shading(const struct imp_vertex *v)
{
    if (!v->bsdf || v->d.connection != IMP_CONNECTED) return 1;
    const struct imp_dirs d = imp__light_dirs(v);
    const imp_v3 p = imp__decided_v3(v->d.p);
    const double u[4] = {0};
    struct imp_sensor_sample to;
    connected_to->ops->connect(connected_to, &p, false, u, &to);
    return v->d.light.weight / to.weight / fabs(d.wo[2] / d.wi[2]);
}

/* At a connection: f(wo, wi) over f with its sides exchanged. */
static double connection_sides(const struct imp_vertex *v)
{
    if (!v->bsdf || v->d.connection != IMP_CONNECTED) return 1;
    const struct imp_dirs d = imp__light_dirs(v), e = {d.wi, d.wo, d.lobe, false};
    imp_spec f, g;
    imp__bsdf_value(v->bsdf, v->in, &d, &f);
    imp__bsdf_value(v->bsdf, v->in, &e, &g);
    return g[0] > 0 ? f[0] / g[0] : 1;
}

static struct imp_tracer tracer_of(imp_scene *scene, enum imp_from from)
{
    const struct imp_walk_integrator *i =
        imp__walks_from(imp__walk_integrator(scene), from);
    return (struct imp_tracer){
        .scene = scene, .integrator = i, .sensor = scene->sensors[0], .seed = 21};
}

/* The mean reading of a film of n pixels, with a factor divided out of each walk. */
static struct tap_stat planted(imp_scene *scene, enum imp_from from, int walks,
                               factor_fn *factor)
{
    connected_to = scene->sensors[0];
    const bool at_end = factor == connection_shading || factor == connection_sides;
    struct imp_tracer tracer = tracer_of(scene, from);
    const struct imp_film_desc *film = &tracer.sensor->film;
    struct tap_stat s = {0};
    struct imp_arena arena;
    imp__arena_init(&arena, ctx);
    for (int i = 0; i < walks; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        double sum = 0;
        if (from == IMP_FROM_LIGHTS) {
            struct imp_light_walk w;
            imp__light_walk_trace(&tracer, &arena, i, &w);
            for (const struct imp_reach *r = w.reach; r; r = r->next)
                if (r->px >= 0 && r->px < film->width && r->py >= 0 &&
                    r->py < film->height)
                    sum += r->L[0] /
                           (at_end ? factor(r->vertex)
                                   : product(&w.walk, r->vertex, factor)) /
                           (film->width * film->height);
        } else {
            struct imp_walk w;
            imp__walk_trace(&tracer, &arena, i % film->width,
                            i / film->width % film->height, i, &w);
            double P = 1;
            for (const struct imp_vertex *v = w.first; v; v = v->next) {
                sum += P * (v->e[0] + v->b[0]) / product(&w, v, factor);
                P *= v->w[0];
            }
        }
        tap_add(&s, sum);
        imp__arena_rewind(&arena, mark);
    }
    imp__arena_free(&arena);
    return s;
}

/* With the factor left out the reading is another number: `wrong` if that is known. */
static void caught(const char *what, imp_scene *scene, enum imp_from from, int walks,
                   factor_fn *factor, double right, double wrong)
{
    const struct tap_stat s = planted(scene, from, walks, factor);
    const double z = (s.mean - right) / tap_se(&s);
    tap_ok(fabs(z) > 8, "%s: caught, %.5g where the truth is %.5g # z %.1f", what, s.mean,
           right, z);
    if (!isnan(wrong)) tap_z(&s, wrong, 1e-2 * wrong, "and is what it must be");
}

static double nothing(const struct imp_vertex *v)
{
    (void)v;
    return 1;
}

static void block(void)
{
    const double truth = 2.85326;
    ends("meter in a block of index 1.5", 12, BLOCK, IMP_MONO, 80000, 400000, truth,
         1.5e-2);
    imp_scene *scene = scene_of(12, BLOCK, IMP_MONO);
    const struct tap_stat s = planted(scene, IMP_FROM_SENSOR, 40000, nothing);
    tap_z(&s, truth, .02, "the walks of this test");
    caught("radiance without (n_o/n_i)^2", scene, IMP_FROM_SENSOR, 40000, radiance_factor,
           truth, 1.26812);
    imp_scene_destroy(scene);
}

/* ---- Kernels that are not reciprocal ---------------------------------------------- */

#define PAIR(bsdf)                                                                       \
    "<shape type='rectangle'>" AT("<scale x='2' y='2'/>") bsdf                           \
        "</shape>"                                                                       \
        "<shape type='rectangle'>" AT(                                                   \
            "<scale x='.3' y='.3'/><rotate x='1' angle='120'/>"                          \
            "<translate x='.2' y='1.4' z='.8'/>") LAMP("3") "</shape>" CAMERA(3)

static void kernels(void)
{
    char body[4096];
    snprintf(body, sizeof body, PAIR("%s"),
             "<bsdf type='stam_m2'><string name='variant' value='paper'/></bsdf>");
    ends("M2, not reciprocal", 3, body, IMP_MONO, 20000, 20000, NAN, 1e-2);
    imp_scene *scene = scene_of(3, body, IMP_MONO);
    const struct imp_estimate right = end_reading(ctx, scene, IMP_FROM_SENSOR, 20000, 5);
    caught("M2 with its sides exchanged", scene, IMP_FROM_LIGHTS, 200000,
           connection_sides, right.value, NAN);
    imp_scene_destroy(scene);
}

/* ---- Shading normals -------------------------------------------------------------- */

/* A lens-like bump: a fan of triangles whose vertex normals lean outwards. */
static void smooth_mesh(imp_scene *s)
{
    enum { SIDES = 8 };
    float p[3 * (SIDES + 1)] = {0, 0, 0.5f}, n[3 * (SIDES + 1)] = {0, 0, 1};
    uint32_t index[3 * SIDES];
    for (int k = 0; k < SIDES; k++) {
        const double a = 2 * acos(-1) * k / SIDES;
        const double v[6] = {cos(a), sin(a), 0, 0.8 * cos(a), 0.8 * sin(a), 0.6};
        for (int j = 0; j < 3; j++) {
            p[3 * (k + 1) + j] = (float)v[j];
            n[3 * (k + 1) + j] = (float)v[3 + j];
        }
        index[3 * k] = 0;
        index[3 * k + 1] = (uint32_t)k + 1;
        index[3 * k + 2] = (uint32_t)(k + 1) % SIDES + 1;
    }
    imp_scene_begin(s, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(s, SIDES + 1, SIDES, p, n, NULL, index);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
}

static void shading_normals(void)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *scene;
    o.mode = IMP_MONO;
    test_must(ctx, imp_scene_create(ctx, &o, &scene));
    imp_scene_begin(scene, "integrator", "ptracer", NULL, NULL);
    imp_scene_integer(scene, "max_depth", 3);
    imp_scene_end(scene);
    smooth_mesh(scene);
    imp_scene_begin(scene, "shape", "sphere", NULL, NULL);
    imp_scene_float(scene, "radius", 0.3);
    imp_scene_vector(scene, "center", (double[3]){1.5, 0.5, 1.2});
    imp_scene_begin(scene, "emitter", "area", NULL, NULL);
    imp_scene_end(scene);
    imp_scene_end(scene);
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    imp_scene_begin(scene, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(scene, "to_world", camera);
    imp_scene_float(scene, "fov", 40);
    imp_scene_begin(scene, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(scene, "width", 4);
    imp_scene_integer(scene, "height", 4);
    imp_scene_begin(scene, "rfilter", "box", NULL, NULL);
    imp_scene_end(scene);
    imp_scene_end(scene);
    imp_scene_end(scene);
    test_must(ctx, imp_scene_commit(scene));
    const struct imp_estimate a = end_reading(ctx, scene, IMP_FROM_SENSOR, 20000, 3);
    const struct imp_estimate b = end_reading(ctx, scene, IMP_FROM_LIGHTS, 40000, 4);
    const double z = (a.value - b.value) / hypot(a.se, b.se);
    tap_ok(fabs(z) < 4 && hypot(a.se, b.se) < 1e-2 * a.value,
           "shading normals: sensor %.6g +- %.1g, lights %.6g +- %.1g # z %.2f", a.value,
           a.se, b.value, b.se, z);
    caught("shading normals without their cosines", scene, IMP_FROM_LIGHTS, 400000,
           connection_shading, a.value, NAN);
    imp_scene_destroy(scene);
}

/* ---- Everything at once ----------------------------------------------------------- */

#define ROOM                                                                             \
    "<shape type='cube'>" AT(                                                            \
        "<scale value='2'/>") "<boolean name='flip_normals' "                            \
                              "value='true'/>" DIFFUSE(                                  \
                                  ".6,.5,.4") "</shape>"                                 \
                                              "<shape "                                  \
                                              "type='rectangle'"                         \
                                              ">" AT("<scale x='.6' "                    \
                                                     "y='.6'/"                           \
                                                     "><rotate x='1' "                   \
                                                     "angle='90'/>"                      \
                                                     "<translate "                       \
                                                     "y='1.95'/>") LAMP("5,4,3") "</"    \
                                                                                 "sh"    \
                                                                                 "ap"    \
                                                                                 "e>"
#define GLASS                                                                            \
    "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' "  \
    "value='1'/></bsdf>"

static void rooms(bool slow)
{
    const int k = slow ? 16 : 1;
    ends("diffuse room", 5, ROOM CAMERA(1.9), IMP_RGB, 2000 * k, 3000 * k, NAN, .01);
    ends("glass and a mirror, seen by a camera", 5,
         ROOM BALL("-.8,-.9,-.5", "<bsdf type='roughdielectric'><float name='alpha' "
                                  "value='.4'/></bsdf>")
             BALL("1,-1,.3", "<bsdf type='roughconductor'><float name='alpha' "
                             "value='.3'/></bsdf>") CAMERA(1.9),
         IMP_RGB, 3000 * k, 4000 * k, NAN, .02);
    ends("fog in a room", 6, ROOM FOG CAMERA(1.9), IMP_RGB, 3000 * k, 3000 * k, NAN, .02);
    ends(
        "thin lens", 4,
        ROOM
        "<sensor type='thinlens'><float name='fov' value='50'/><float "
        "name='aperture_radius' value='.2'/><float name='focus_distance' "
        "value='3'/>" AT(
            "<lookat origin='0,0,1.7' target='0,0,0' up='0,1,0'/>") "<film "
                                                                    "type='hdrfilm'><"
                                                                    "integer "
                                                                    "name='width' "
                                                                    "value='6'/><integer "
                                                                    "name='height' "
                                                                    "value='4'/><rfilter "
                                                                    "type='gaussian'/></"
                                                                    "film></sensor>",
        IMP_RGB, 2000 * k, 3000 * k, NAN, .02);
    ends("orthographic", 4,
         ROOM "<sensor type='orthographic'>" AT(
             "<scale x='.7' y='.7'/><lookat origin='0,0,1.7' target='0,0,0' up='0,1,0'/>")
             FILM(4, 4, "tent") "</sensor>",
         IMP_RGB, 2000 * k, 3000 * k, NAN, .02);
    ends("meter behind clear glass", 8,
         ROOM BALL("0,-.4,0", GLASS) "<shape type='rectangle'>" AT(
             "<scale x='.5' y='.5'/><rotate x='1' angle='-90'/><translate y='-1.6'/>")
             DIFFUSE(".3") METER "</shape>",
         IMP_RGB, 100000 * k, 100000 * k, NAN, .02);
    ends("wall of lux, a film over a rectangle", 4,
         ROOM "<shape type='rectangle'>" AT(
             "<scale x='.5' y='.5'/><rotate x='1' angle='-90'/><translate y='-1.6'/>")
             DIFFUSE(".3") "<sensor type='irradiancemeter'>" FILM(
                 4, 2, "box") "</sensor></shape>",
         IMP_RGB, 10000 * k, 10000 * k, NAN, .02);
    ends("a point light and a meter", 3,
         "<emitter type='point'><point name='position' value='.3,0,1'/></emitter>"
         "<shape type='disk'>" DIFFUSE(".5") METER
         "</shape>"
         "<shape type='rectangle'>" AT("<rotate y='1' angle='90'/><translate x='-1.5'/>")
             DIFFUSE(".7") "</shape>",
         IMP_MONO, 40000 * k, 40000 * k, NAN, .01);
    ends("a spot and a meter", 3,
         "<emitter type='spot'><transform name='to_world'><lookat origin='.3,0,1.2' "
         "target='0,0,0' up='0,1,0'/></transform><float name='cutoff_angle' "
         "value='40'/></emitter>"
         "<shape type='disk'>" DIFFUSE(".5") METER
         "</shape>"
         "<shape type='rectangle'>" AT("<rotate y='1' angle='90'/><translate x='-.5'/>")
             DIFFUSE(".7") "</shape>",
         IMP_MONO, 40000 * k, 80000 * k, NAN, .01);
    ends("a projector, seen by a camera", 3,
         "<emitter type='projector'><transform name='to_world'><lookat origin='.5,0,2' "
         "target='0,0,0' up='0,1,0'/></transform><float name='fov' value='50'/><texture "
         "type='checkerboard' name='irradiance'/></emitter>"
         "<shape type='rectangle'>" DIFFUSE(".5") "</shape>" BALL("0,0,.2", DIFFUSE(".7"))
             CAMERA(3),
         IMP_RGB, 4000 * k, 20000 * k, NAN, .015);
    ends("parallel light and a meter", 3,
         "<emitter type='directional'><vector name='direction' value='.3,.1,-1'/>"
         "</emitter><shape type='disk'>" DIFFUSE(".5") METER
         "</shape>"
         "<shape type='rectangle'>" AT("<rotate y='1' angle='90'/><translate x='-1.5'/>")
             DIFFUSE(".7") "</shape>",
         IMP_MONO, 40000 * k, 80000 * k, NAN, .01);
    ends(
        "a batch of cameras", 4,
        ROOM "<sensor type='batch'>" FILM(8, 4, "box") "<sensor type='perspective'>" AT(
            "<lookat origin='0,0,1.9' target='0,0,0' up='0,1,0'/>") "</sensor><sensor "
                                                                    "type='thinlens'><"
                                                                    "float name='fov' "
                                                                    "value='50'/><float "
                                                                    "name='aperture_"
                                                                    "radius' "
                                                                    "value='.1'/><float "
                                                                    "name='focus_"
                                                                    "distance' "
                                                                    "value='2'/>" AT(
                                                                        "<lookat "
                                                                        "origin='0,0,-1."
                                                                        "5' "
                                                                        "target='0,0,0' "
                                                                        "up='0,1,0'/>") "</sensor>"
                                                                                        "</sensor>",
        IMP_RGB, 2000 * k, 4000 * k, NAN, .01);
    ends("a beam and a meter", 3,
         BEAM("disk") "<shape type='disk'>" AT(
             "<scale value='.5'/><rotate x='1' angle='30'/>") DIFFUSE(".5") METER
         "</shape>"
         "<shape type='rectangle'>" AT("<rotate y='1' angle='90'/><translate x='-1.5'/>")
             DIFFUSE(".7") "</shape>",
         IMP_MONO, 20000 * k, 40000 * k, NAN, .01);
    ends("a beam across a black meter: E cos 30", 3,
         BEAM("rectangle") "<shape type='disk'>" AT(
             "<scale value='.5'/><rotate x='1' angle='30'/>") DIFFUSE("0") METER
         "</shape>",
         IMP_MONO, 2000 * k, 20000 * k, 3 * sqrt(3) / 2, .01);
    ends("a beam that covers a quarter of a meter", 3,
         BEAM("rectangle") "<shape type='rectangle'>" AT("<scale value='2'/>")
             DIFFUSE("0") METER "</shape>",
         IMP_MONO, 60000 * k, 2000 * k, 3. / 4, .01);
    ends("a beam, seen by a camera", 3,
         BEAM("rectangle") "<shape type='rectangle'>" DIFFUSE(".5") "</shape>" BALL(
             "0,0,.2", DIFFUSE(".7")) CAMERA(3),
         IMP_RGB, 2000 * k, 16000 * k, NAN, .015);
    ends("a beam through fog", 4,
         BEAM("disk") "<shape type='rectangle'>" DIFFUSE(".5") "</shape>" FOG CAMERA(1.9),
         IMP_RGB, 4000 * k, 16000 * k, NAN, .03);
    ends("parallel light, seen by a camera", 3,
         "<emitter type='directional'><vector name='direction' value='.3,.1,-1'/>"
         "</emitter><shape type='rectangle'>" DIFFUSE(".5") "</shape>" BALL(
             "0,0,.2", DIFFUSE(".7")) CAMERA(3),
         IMP_RGB, 2000 * k, 16000 * k, NAN, .015);
    ends("distant sensor", 4,
         BALL("0,0,0", DIFFUSE(".5")) "<shape type='rectangle'>" AT(
             "<rotate x='1' angle='90'/><translate y='1.5'/>")
             LAMP("5,4,3") "</shape><sensor type='distant'><vector name='direction' "
                           "value='.9,.1,.2'/>" FILM(3, 3, "box") "</sensor>",
         IMP_RGB, 10000 * k, 10000 * k, NAN, .02);
    ends(
        "sky over a ball, seen by a camera", 4,
        "<emitter type='constant'><rgb name='radiance' value='.5,.6,.7'/></emitter>" BALL(
            "0,0,0",
            DIFFUSE(
                ".5")) "<shape type='rectangle'>" AT("<scale value='2'/><rotate x='1' "
                                                     "angle='-90'/><translate y='-.7'/>")
            DIFFUSE(".4,.5,.6") "</shape>" CAMERA(3),
        IMP_RGB, 3000 * k, 16000 * k, NAN, .015);
    ends("spectral room", 4, ROOM CAMERA(1.9), IMP_SPECTRAL, 2000 * k, 3000 * k, NAN,
         .02);
    ends(
        "spectral dispersion to a meter", 8,
        ROOM BALL(
            "0,-.4,0",
            "<bsdf type='roughdielectric'><float name='alpha' "
            "value='.2'/></bsdf>") "<shape type='rectangle'>" AT("<scale x='.5' "
                                                                 "y='.5'/><rotate x='1' "
                                                                 "angle='-90'/"
                                                                 "><translate y='-1.6'/>")
            DIFFUSE(".3") METER "</shape>",
        IMP_SPECTRAL, 60000 * k, 60000 * k, NAN, .03);
}

/* ---- Gradients -------------------------------------------------------------------- */

static void gradients(const char *what, const char *body, const char *glob, int a_spp,
                      int b_spp)
{
    imp_scene *scene = scene_of(5, body, IMP_RGB);
    imp_problem *p = test_problem(ctx, scene, glob);
    const size_t n = imp_problem_n_variables(p);
    struct imp_run run = IMP_RUN_INIT;
    double g[2][128], se[2][128], worst = 0, loudest = 0;
    for (int k = 0; k < 2; k++) {
        run.from = k ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
        run.spp = k ? b_spp : a_spp;
        run.seed = 31 + (uint64_t)k;
        test_must(ctx, imp_problem_functional(p, NULL, &run, NULL, g[k], se[k]));
    }
    for (size_t j = 0; j < n; j++) {
        const double both = hypot(se[0][j], se[1][j]);
        worst = fmax(worst, both > 0 ? fabs(g[0][j] - g[1][j]) / both : 0);
        loudest = fmax(loudest, both / fmax(fabs(g[0][j]), fabs(g[1][j])));
    }
    tap_ok(worst < 4.2, "%s: %zu derivatives from both ends # worst z %.2f, error %.3f",
           what, n, worst, loudest);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void derivatives(void)
{
    gradients("diffuse room", ROOM CAMERA(1.9), "*", 2000, 3000);
    gradients("rough metal",
              ROOM BALL("1,-1,.3", "<bsdf type='roughconductor' id='metal'><float "
                                   "name='alpha' value='.3'/></bsdf>") CAMERA(1.9),
              "*", 3000, 6000);
    gradients("fog", ROOM FOG CAMERA(1.9), "*", 4000, 6000);
}

/* ---- Pictures --------------------------------------------------------------------- */

#define SEEDS 64

static imp_film *picture(imp_context *of, const char *xml, uint64_t seed)
{
    imp_scene *scene = test_scene_text(of, xml, IMP_RGB);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 64;
    run.seed = seed;
    test_must(of, imp_render(scene, &run, &film));
    imp_scene_destroy(scene);
    return film;
}

static size_t values_of(const imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    return (size_t)info.width * (size_t)info.height * (size_t)info.channels;
}

/* Same bits on any number of threads; errors that are the spread of fresh seeds. */
static void pictures(const char *filter)
{
    static float sum[128], square[128], variance[128];
    char xml[8192];
    int n = snprintf(xml, sizeof xml, HEAD, 4);
    n += snprintf(
        xml + n, sizeof xml - (size_t)n,
        ROOM "<sensor type='perspective'><float name='fov' value='70'/>" AT(
            "<lookat origin='0,0,1.9' target='0,0,0' up='0,1,0'/>") "<film "
                                                                    "type='hdrfilm'><"
                                                                    "integer "
                                                                    "name='width' "
                                                                    "value='6'/><integer "
                                                                    "name='height' "
                                                                    "value='4'/><rfilter "
                                                                    "type='%s'/></film></"
                                                                    "sensor></scene>",
        filter);
    imp_context *alone = test_context(1), *three = test_context(3);
    imp_film *a = picture(alone, xml, 7), *b = picture(three, xml, 7);
    const size_t values = values_of(a);
    tap_ok(memcmp(imp_film_mean(a), imp_film_mean(b), values * sizeof(float)) == 0 &&
               memcmp(imp_film_se(a), imp_film_se(b), values * sizeof(float)) == 0,
           "%s filter: one thread and three give the same bits", filter);
    imp_film_destroy(a);
    imp_film_destroy(b);
    memset(sum, 0, sizeof sum);
    memset(square, 0, sizeof square);
    memset(variance, 0, sizeof variance);
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        imp_film *film = picture(three, xml, 100 + seed);
        for (size_t k = 0; k < values; k++) {
            const float x = imp_film_mean(film)[k], e = imp_film_se(film)[k];
            sum[k] += x;
            square[k] += x * x;
            variance[k] += e * e;
        }
        imp_film_destroy(film);
    }
    double ratio = 0;
    for (size_t k = 0; k < values; k++) {
        const double spread = (square[k] - sum[k] * sum[k] / SEEDS) / (SEEDS - 1);
        ratio += spread / (variance[k] / SEEDS) / (double)values;
    }
    tap_ok(fabs(ratio - 1) < .12,
           "%s filter: variance of %d seeds over the reported # %.3f", filter, SEEDS,
           ratio);
    imp_context_destroy(alone);
    imp_context_destroy(three);
}

int main(int argc, char **argv)
{
    const bool slow = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(2);
    discs();
    behind_glass();
    block();
    kernels();
    shading_normals();
    rooms(slow);
    derivatives();
    pictures("box");
    pictures("gaussian");
    imp_context_destroy(ctx);
    return tap_done();
}
