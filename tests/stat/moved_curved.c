/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves, seen in mirrors that are balls or tubes, and through clear glass: a glowing disk
 * on the axis of a ball, or a strip along a tube, as parallel rays across it see it; recorded walks (check's frozen rows);
 * imp_problem_reverse against central differences. What is refused. */
#include "imp_check_rows.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH    "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define DEEP    "<integrator type='path'><integer name='max_depth' value='6'/></integrator>"
#define SKY     "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define METAL   "<bsdf type='conductor'><string name='material' value='Cu'/></bsdf>"
#define PERFECT "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
#define INDEX   1.5
#define GLASS                                                                            \
    "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' "  \
    "value='1'/></bsdf>"
#define WIDE_SUN                                                                         \
    "<emitter type='sun'><vector name='direction' value='-.9,.1,-.5'/><float "           \
    "name='radius' value='.5'/><rgb name='radiance' value='3'/></emitter>"
#define DARK  "<bsdf type='diffuse' id='grey'><rgb name='reflectance' value='0'/></bsdf>"
#define BLACK "<bsdf type='diffuse'><spectrum name='reflectance' value='0'/></bsdf>"

#define BALL(BSDF)                                                                       \
    "<shape type='sphere' id='ball'><float name='radius' value='.6'/><point "            \
    "name='center' x='.95' y='-.8' z='.8'/>" BSDF "</shape>"
#define BEHIND                                                                           \
    "<shape type='sphere' id='behind'><float name='radius' value='.35'/><point "         \
    "name='center' x='.9' y='1.2' z='.7'/><ref id='grey'/></shape>"
#define FLAT                                                                             \
    "<shape type='rectangle' id='mirror'><transform name='to_world'><scale x='1.1' "     \
    "y='.9'/><rotate x='1' angle='90'/><rotate z='1' angle='-20'/><translate x='.9' "    \
    "y='1.6' z='1.2'/></transform>" PERFECT "</shape>"
#define THICK                                                                            \
    "<shape type='cube' id='pane'><transform name='to_world'><scale x='.7' y='.25' "     \
    "z='.5'/><rotate x='1' y='.3' z='1' angle='25'/><translate x='.3' y='-1.4' "         \
    "z='1.1'/></transform>" GLASS "</shape>"
#define TUBE(BSDF)                                                                       \
    "<shape type='cylinder' id='tube'><float name='radius' value='.45'/><point "         \
    "name='p0' value='0,0,-.6'/><point name='p1' value='0,0,.6'/><transform "            \
    "name='to_world'><rotate x='1' y='.4' angle='50'/><translate x='.9' y='-.7' "        \
    "z='1'/></transform>" BSDF "</shape>"
#define POLE                                                                             \
    "<shape type='cylinder' id='pole'><float name='radius' value='.2'/><point "          \
    "name='p0' x='1.9' y='-.2' z='.3'/><point name='p1' x='1.7' y='.3' z='1.3'/>"        \
    "<ref id='grey'/></shape>"

static imp_scene *room_of(const char *rest, const char *grey)
{
    return room_build(ctx, &(struct room_parts){.rest = rest, .grey = grey});
}
static imp_scene *room(const char *rest) { return room_of(rest, NULL); }

/* ---- On an axis ---------------------------------------------------------------------------- */

/* A ball of radius R at z; a disk of radius a at h, which glows towards the ball. Or, across the film, a tube,
 * and a strip as wide as 2 a. Or a black ball, or tube, of radius a in its place, before a sky. */
struct axis {
    double R, z, a, h;
    bool tube, round;
};

/* Where parallel rays along -z, s from the axis, meet the plane of the disk, s again, over a mirror; through
 * glass, on the other side of it, by the angles i and t with sin i = s/R = INDEX sin t. */
static double mirror_meets(const struct axis *x, double s)
{
    const double i = asin(s / x->R);
    return s + (x->h - x->z - x->R * cos(i)) * tan(2 * i);
}
/* How far they are from the middle of what is there, over a mirror. */
static double mirror_passes(const struct axis *x, double s)
{
    const double i = asin(s / x->R);
    return s * cos(2 * i) + (x->h - x->z - x->R * cos(i)) * sin(2 * i);
}
static double glass_meets(const struct axis *x, double s)
{
    const double i = asin(s / x->R), t = asin(s / x->R / INDEX), turn = 2 * (i - t);
    /* It leaves the ball at the angle 2 t - i from the axis, on the other side of the middle. */
    const double out = 2 * t - i, p = x->R * sin(out), q = x->z - x->R * cos(out);
    return (q - x->h) * tan(turn) - p;
}

/* What is let through twice of unpolarised light. */
static double passes(const struct axis *x, double s)
{
    const double i = asin(s / x->R), t = asin(s / x->R / INDEX), c = cos(i), d = cos(t),
                 r = (c - INDEX * d) / (c + INDEX * d),
                 p = (d - INDEX * c) / (d + INDEX * c);
    return imp__sqr(1 - (r * r + p * p) / 2);
}

/* The root of meets(s) = to between lo and hi. */
static double root(double (*meets)(const struct axis *, double), const struct axis *x,
                   double to, double lo, double hi)
{
    const bool rises = meets(x, hi) > meets(x, lo);
    for (int k = 0; k < 100; k++) {
        const double middle = (lo + hi) / 2;
        if ((meets(x, middle) < to) == rises) lo = middle;
        else hi = middle;
    }
    return lo;
}

/* The mean of a picture of 2 x 2, the radiance being 1. */
static double mirror_mean(const struct axis *x)
{
    const double s = root(mirror_meets, x, x->a, 0, 0.7 * x->R);
    return x->tube ? s : IMP_PI * s * s / 4;
}
static double shade_mean(const struct axis *x)
{
    const double s = root(mirror_passes, x, x->a, 0, 0.7 * x->R);
    return 1 - (x->tube ? s : IMP_PI * s * s / 4);
}
static double glass_mean(const struct axis *x)
{
    enum { N = 2000 };
    const double end = root(glass_meets, x, x->a, 0.5 * x->R, 0.95 * x->R);
    double sum = 0;
    for (int k = 0; k < N; k++) { /* Gauss-Legendre of two points */
        const double h = end / N, m = (k + 0.5) * h, g = h / sqrt(12), lo = m - g,
                     hi = m + g;
        sum += h / 2 *
               ((x->tube ? 1 : IMP_PI * lo / 2) * passes(x, lo) +
                (x->tube ? 1 : IMP_PI * hi / 2) * passes(x, hi));
    }
    return sum;
}

/* By number k of R, z, a, h. */
static double slope(double (*mean)(const struct axis *), struct axis x, int k)
{
    double *number[4] = {&x.R, &x.z, &x.a, &x.h};
    const double at = *number[k], h = 1e-5;
    *number[k] = at + h;
    const double hi = mean(&x);
    *number[k] = at - h;
    return (hi - mean(&x)) / (2 * h);
}

/* It covers the film. */
#define LONG(ID)                                                                         \
    "<shape type='cylinder' id='" ID "'><point name='p0' value='0,-1.1,0'/>"             \
    "<point name='p1' value='0,1.1,0'/>"
static imp_scene *axis_scene(const struct axis *x, const char *bsdf, int depth,
                             const char *faces)
{
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='%d'/></integrator><sensor type='orthographic' id='camera'>"
        "<transform name='to_world'><lookat origin='0,0,2' target='0,0,0' "
        "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
        "value='8'/><integer name='height' value='8'/><rfilter type='box'/></film>"
        "</sensor>%s<float name='radius' value='%g'/><transform "
        "name='to_world'><translate z='%g'/></transform>%s</shape>"
        "%s<transform name='to_world'><scale x='%g' y='%g' z='%g'/>%s"
        "<translate z='%g'/></transform>" BLACK "%s</scene>",
        depth, x->tube ? LONG("ball") : "<shape type='sphere' id='ball'>", x->R, x->z,
        bsdf,
        x->round && x->tube ? LONG("disk")
        : x->round          ? "<shape type='sphere' id='disk'>"
        : x->tube           ? "<shape type='rectangle' id='disk'>"
                            : "<shape type='disk' id='disk'>",
        x->a, x->tube && !x->round ? 9 : x->a, x->a, faces, x->h,
        x->round
            ? "</shape><emitter type='constant'><spectrum name='radiance' value='1'/>"
              "</emitter>"
            : "<emitter type='area'><spectrum name='radiance' value='1'/></emitter>"
              "</shape>");
    return test_scene_text(ctx, xml, IMP_MONO);
}

static void axis_test(const char *what, const struct axis *x, imp_scene *scene,
                      double (*mean)(const struct axis *), int spp)
{
    const struct {
        const char *name;
        int k, number;
    } of[] = {{x->tube ? "ball.scale" : "ball.radius", 0, 0},
              {x->tube ? "ball.pose" : "ball.center", 2, 1},
              {"disk.pose", 2, 3}};
    for (int j = 0; j < 3; j++) test_must(ctx, imp_scene_add_geometry(scene, of[j].name));
    for (int j = 0; j < 3; j++) {
        struct tap_stat g[6] = {{0, 0, 0}};
        char name[128];
        mean_gradient(ctx, scene, of[j].name, spp, 16, g);
        snprintf(name, sizeof name, "%s, by %s[%d]", what, of[j].name, of[j].k);
        const double by = x->tube && j == 0 ? x->R : 1,
                     right = by * slope(mean, *x, of[j].number);
        tap_z(&g[of[j].k], right, 0.02 * fabs(right), name);
    }
    imp_scene_destroy(scene);
}

static void axes_test(int spp_axis)
{
    const struct axis mirror = {.8, 0, 1, 3, false, false},
                      glass = {.8, 0, .2, -1, false, false},
                      pipe = {.8, 0, 1, 3, true, false},
                      rod = {.8, 0, .2, -1, true, false},
                      ball = {.8, 0, .9, 3, false, true},
                      pole = {.8, 0, .9, 3, true, true};
    axis_test("a disk in a ball", &mirror,
              axis_scene(&mirror, PERFECT, 2, "<rotate x='1' angle='180'/>"), mirror_mean,
              spp_axis);
    axis_test("a disk through a ball", &glass, axis_scene(&glass, GLASS, 3, ""),
              glass_mean, spp_axis);
    axis_test("a strip in a tube", &pipe,
              axis_scene(&pipe, PERFECT, 2, "<rotate x='1' angle='180'/>"), mirror_mean,
              spp_axis);
    axis_test("a strip through a rod", &rod, axis_scene(&rod, GLASS, 3, ""), glass_mean,
              spp_axis);
    axis_test("a ball in a ball", &ball, axis_scene(&ball, PERFECT, 2, ""), shade_mean,
              spp_axis);
    axis_test("a pole in a tube", &pole, axis_scene(&pole, PERFECT, 2, ""), shade_mean,
              2 * spp_axis);
}

/* ---- Skies --------------------------------------------------------------------------------- */

/* Parallel rays from above see a sky in a ball of radius R: with i the angle to its normal, overcast, from the
 * horizon on (i = pi/4) as bright as (1 + 2 cos 2i)/3; a sun of radius a (i = a/2). */
static void sky_test(const char *what, const char *sky, double right, int spp)
{
    enum { ROOM = 2048 };
    char xml[ROOM];
    struct tap_stat g[1] = {{0, 0, 0}};
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='3'/></integrator><sensor type='orthographic' id='camera'><transform "
             "name='to_world'><lookat origin='0,0,2' target='0,0,0' up='0,1,0'/>"
             "</transform><film type='hdrfilm'><integer name='width' value='8'/><integer "
             "name='height' value='8'/><rfilter type='box'/></film></sensor>"
             "<shape type='sphere' id='ball'><float name='radius' value='.8'/>" PERFECT
             "</shape>%s</scene>",
             sky);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "ball.radius"));
    mean_gradient(ctx, scene, "ball.radius", spp, 16, g);
    tap_z(&g[0], right, 0.01 * fabs(right), what);
    imp_scene_destroy(scene);
}

static void skies_test(int spp)
{
    sky_test("a horizon in a ball that grows",
             "<emitter type='ciesky'><float name='zenith' value='1'/></emitter>",
             .8 * IMP_PI / 6, spp);
    sky_test("a sun in a ball that grows",
             "<emitter type='sun'><vector name='direction' value='0,0,-1'/><float "
             "name='radius' value='.3'/><rgb name='radiance' value='10'/></emitter>",
             5 * IMP_PI * .8 * imp__sqr(sin(.15)), spp);
}

/* ---- Walks --------------------------------------------------------------------------------- */

static void frozen_test(const char *what, imp_scene *scene)
{
    static const char *const names[] = {"block.pose", "camera.pose", "lamp.pose"};
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    imp_problem *p;
    o.paths = 250;
    o.only = "frozen";
    for (int k = 0; k < 3; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 3; k++) test_must(ctx, imp_problem_activate(p, names[k]));
    test_check(ctx, p, &o, what);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* A block of glass before a black strip. A corner is off by so much: the two facets of a face that has it are of two
 * planes, and each facet has the roots of its own. */
static imp_scene *block_off(double off)
{
    static const char faces[] = "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\n"
                                "f 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";
    char path[] = "/tmp/moved_curved_XXXXXX.obj", xml[2048];
    FILE *f = fdopen(mkstemps(path, 4), "w");
    for (int k = 0; k < 8; k++)
        fprintf(f, "v %g %g %.9g\n", k % 4 == 1 || k % 4 == 2 ? .5 : -.5,
                k % 4 >= 2 ? .5 : -.5, (k < 4 ? -.2 : .2) + (k == 2 ? off : 0));
    fprintf(f, "%s", faces);
    fclose(f);
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator><sensor type='perspective'><float name='fov' "
        "value='30'/><transform name='to_world'><lookat origin='.13,.21,-2.5' "
        "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
        "name='width' value='24'/><integer name='height' value='16'/></film></sensor>" SKY
        "<shape type='rectangle' id='strip'><transform name='to_world'><scale "
        "x='.05' y='3'/><translate x='.11' z='1'/></transform>" BLACK
        "</shape><shape type='obj' id='block'><string name='filename' value='%s'/>"
        "<boolean name='face_normals' value='true'/>" GLASS "</shape></scene>",
        path);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    remove(path);
    return scene;
}

static void refused_test(void)
{
    number_refused("a cube of glass in the floor",
                   room(PATH "<shape type='cube' id='glass'><transform name='to_world'>"
                             "<scale value='.3'/><translate x='-2'/></transform>" GLASS
                             "</shape>"),
                   "block.pose", "passes through");
    number_refused("an oval tube that is a mirror",
                   room(PATH "<shape type='cylinder' id='tube'><transform "
                             "name='to_world'><scale x='.3' y='.2' z='.5'/><translate "
                             "x='-2' z='1'/></transform>" PERFECT "</shape>"),
                   "block.pose", "no sphere or circular cylinder");
    number_refused("a thin tube of glass",
                   room(PATH TUBE("<bsdf type='thindielectric'/>")), "block.pose",
                   "none of conductor");
    number_refused(
        "a horizon in a ball, to a meter",
        test_scene_text(ctx,
                        "<scene version='3.0.0'>" PATH "<emitter type='ciesky'/>" BALL(
                            PERFECT) "<shape type='rectangle'><sensor "
                                     "type='irradiancemeter'><film type='hdrfilm'>"
                                     "<integer name='width' value='24'/><integer "
                                     "name='height' value='16'/></film></sensor></shape>"
                                     "</scene>",
                        IMP_RGB),
        "ball.center", "the sensor is a surface");
    number_refused("a ball in the floor",
                   room(PATH "<shape type='sphere' id='ball'>" GLASS "</shape>"),
                   "block.pose", "passes through");
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number images[] = {{"block.pose", 0, .02},
                                           {"block.pose", 5, .02},
                                           {"behind.center", 0, .01},
                                           {"lamp.pose", 3, .02},
                                           {NULL, 0, 0}},
                               block[] = {{"block.pose", 0, .02},
                                          {"block.pose", 2, .02},
                                          {"block.pose", 5, .02},
                                          {NULL, 0, 0}},
                               nearer[] = {{"block.pose", 2, .02},
                                           {"strip.scale", 0, .05},
                                           {NULL, 0, 0}},
                               balls[] = {{"ball.center", 0, .01},
                                          {"ball.center", 1, .01},
                                          {"ball.center", 2, .01},
                                          {"ball.radius", 0, .01},
                                          {"camera.pose", 0, .01},
                                          {"camera.pose", 4, .01},
                                          {NULL, 0, 0}},
                               pane[] = {{"pane.pose", 1, .015},
                                         {"pane.pose", 3, .015},
                                         {"pane.pose", 5, .015},
                                         {NULL, 0, 0}},
                               tube[] = {{"tube.pose", 0, .01},
                                         {"tube.pose", 2, .01},
                                         {"tube.pose", 3, .01},
                                         {"tube.scale", 0, .02},
                                         {"behind.center", 0, .01},
                                         {"lamp.pose", 3, .02},
                                         {NULL, 0, 0}},
                               pole[] = {{"pole.pose", 0, .02},
                                         {"pole.pose", 1, .02},
                                         {"pole.pose", 4, .02},
                                         {"pole.scale", 0, .04},
                                         {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    axes_test(is_long ? 768 : 48);
    skies_test(is_long ? 1024 : 64);
    frozen_test("walks over a ball", room(DEEP BALL(METAL)));
    frozen_test("walks through glass", room(DEEP BALL(GLASS)));
    frozen_test("walks through glass, under a sky", room(SKY DEEP BALL(GLASS)));
    numbers_compare("images in a ball",
                    room_of("<integrator type='direct'/>" SKY BALL(PERFECT) BEHIND, DARK),
                    is_long ? 512 : 64, is_long ? 1024 : 128, .1, images);
    numbers_compare("a pole in a tube",
                    room_of("<integrator type='direct'/>" SKY TUBE(PERFECT) POLE, DARK),
                    is_long ? 512 : 48, is_long ? 1024 : 48, .1, pole);
    numbers_compare("a block with a corner off by 4e-6", block_off(4e-6), 64, 64, .05,
                    nearer);
    numbers_compare("a block with a corner off by 2e-5", block_off(2e-5), 64, 64, .05,
                    nearer);
    if (is_long) {
        numbers_compare(
            "a tube that moves",
            room_of("<integrator type='direct'/>" SKY TUBE(PERFECT) BEHIND, DARK), 192,
            640, .15, tube);
        numbers_compare("a rod of glass", room_of(DEEP SKY TUBE(GLASS) POLE BEHIND, DARK),
                        384, 640, .15, tube);
        numbers_compare(
            "a pole in a ball",
            room_of("<integrator type='direct'/>" SKY BALL(PERFECT) POLE, DARK), 256, 640,
            .1, pole);
        numbers_compare("images in a ball in a flat mirror",
                        room_of(DEEP SKY BALL(PERFECT) FLAT BEHIND, DARK), 256, 512, .1,
                        images);
        numbers_compare("images in glass", room_of(DEEP SKY BALL(GLASS) BEHIND, DARK),
                        192, 512, .1, images);
        numbers_compare(
            "a ball that moves",
            room_of("<integrator type='direct'/>" SKY BALL(PERFECT) BEHIND, DARK), 192,
            640, .15, balls);
        numbers_compare("through a block of glass", room_of(DEEP SKY THICK, DARK), 192,
                        512, .1, block);
        numbers_compare("a block of glass that moves", room_of(DEEP SKY THICK, DARK), 512,
                        640, .25, pane);
        numbers_compare("a wide sun over a ball", room(PATH WIDE_SUN BALL(PERFECT)), 192,
                        512, .2, balls);
        numbers_compare("an overcast sky over a rod of glass",
                        room_of(DEEP "<emitter type='ciesky'/>" TUBE(GLASS) BEHIND, DARK),
                        192, 512, .2, images);
        numbers_compare("a ball in a lit room", room(PATH BALL(METAL) BEHIND), 192, 512,
                        .2, images);
    }
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
