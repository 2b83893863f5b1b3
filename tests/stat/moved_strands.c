/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by points of control, place and size of a bsplinecurve: of a black one before a sky, whose
 * picture has an area by quadrature, also seen end on, and where it hides itself; the same numbers as
 * by pose and scale; differences of pictures with the same random numbers. What is refused. */
#include "moves_kit.h"
#include "moves_numbers.h"

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define RED    "<bsdf type='diffuse'><rgb name='reflectance' value='.8,.3,.2'/></bsdf>"
enum { POINTS = 6 };
typedef double curve_points[POINTS][4];

static const curve_points bent = {{-1.4, -.9, .2, .30}, {-.8, -.2, 0, .25},
                                  {-.1, .3, .4, .32},   {.6, .1, .1, .28},
                                  {1.1, .8, -.2, .2},   {1.5, 1.3, .3, .3}};

/* Seen along it: from the narrow end, and through the open end of a knee, whose wall lines that come in there
 * touch from inside; none of what faces the camera hides another part of that. */
static const curve_points cone = {{.1, 0, -2.6, 1.85}, {0, .05, -1.6, 1.45},
                                  {0, 0, -.7, 1.1},    {.05, 0, .2, .75},
                                  {0, .05, 1, .45},    {.05, 0, 1.9, .2}},
                          knee = {{.2, 0, 1.9, .4},   {.05, 0, 1, .4},
                                  {-.1, 0, .1, .4},   {.15, .02, -.8, .4},
                                  {1, .03, -1.2, .4}, {1.9, .1, -1.3, .4}};

static void file_write(const char *name, const curve_points p, int from, int n)
{
    FILE *f = fopen(name, "w");
    if (!f) exit(99);
    for (int k = from; k < from + n; k++)
        fprintf(f, "%.9g %.9g %.9g %.9g\n", p[k][0], p[k][1], p[k][2], p[k][3]);
    fclose(f);
}

/* A shape of this file, which is removed. */
static imp_scene *with_file(imp_scene *(*make)(const char *), const char *shape,
                            const curve_points p)
{
    file_write("moved_strands.txt", p, 0, POINTS);
    imp_scene *scene = make(shape);
    remove("moved_strands.txt");
    return scene;
}
#define CURVE(ID, MORE)                                                                  \
    "<shape type='bsplinecurve' id='" ID "'><string name='filename' "                    \
    "value='moved_strands.txt'/>" MORE "</shape>"
#define BLACK "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"

static imp_scene *before_sky(const char *shape) { return before_sky_build(ctx, shape); }

/* ---- The area of a picture by quadrature ---------------------------------------------- */

/* max(0, N_z) r/|c'| of the normal N at a turn about the line. */
static double facing(const double d[3][4], double t)
{
    const imp_v3 d1 = imp__v3(d[1][0], d[1][1], d[1][2]),
                 d2 = imp__v3(d[2][0], d[2][1], d[2][2]);
    const double length = imp__length(d1);
    const imp_v3 a = d1 * (1 / length),
                 s = imp__normalize(imp__cross(a, imp__v3(.3, .5, .8))),
                 e = s * cos(t) + imp__cross(a, s) * sin(t);
    const imp_v3 N = e * (length * length - d[0][3] * imp__dot(e, d2)) - d1 * d[1][3];
    return fmax(N[2], 0) * d[0][3] / length;
}

/* What faces +z, projected: the area of the picture where none of that hides another part of it. */
static double area_of(const curve_points p)
{
    enum { PLACES = 48, TURNS = 600 };
    double sum = 0;
    for (int k = 0; k + 3 < POINTS; k++)
        for (int i = 0; i < PLACES; i++) {
            const double v = (i + .5) / PLACES, u = 1 - v;
            const double b[3][4] = {{u * u * u / 6, (4 - 6 * v * v + 3 * v * v * v) / 6,
                                     (1 + 3 * v + 3 * v * v - 3 * v * v * v) / 6,
                                     v * v * v / 6},
                                    {-u * u / 2, (3 * v * v - 4 * v) / 2,
                                     (1 + 2 * v - 3 * v * v) / 2, v * v / 2},
                                    {u, 3 * v - 2, 1 - 3 * v, v}};
            double d[3][4] = {{0}};
            for (int j = 0; j < 3; j++)
                for (int m = 0; m < 4; m++)
                    for (int c = 0; c < 4; c++) d[j][c] += b[j][m] * p[k + m][c];
            for (int j = 0; j < TURNS; j++) sum += facing(d, IMP_2PI * (j + .5) / TURNS);
        }
    return sum * IMP_2PI / (PLACES * TURNS);
}

static double area_slope(const curve_points p, int k)
{
    const double h = 1e-3;
    double area[2];
    for (int s = 0; s < 2; s++) {
        curve_points moved;
        memcpy(moved, p, sizeof moved);
        moved[k / 4][k % 4] += s ? h : -h;
        area[s] = area_of((const double(*)[4])moved);
    }
    return (area[1] - area[0]) / (2 * h);
}

/* 1e-4: at open ends turned to the camera what lies between a rim and the outline next to it is thinner
 * than looks are apart from them, more of it where they go into the end: 1e-3, .3 % of the largest. */
static void area_test(const char *what, const curve_points points, int spp, double least,
                      double part)
{
    imp_scene *scene = with_file(before_sky, CURVE("it", BLACK), points);
    static const char name[] = "it.control_points";
    double g[4 * POINTS], se[4 * POINTS], most = 0, off = 0, worst = 0, largest = 0;
    static float adjoint_of_mean[256];
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    test_must(ctx, imp_scene_add_geometry(scene, name));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, name));
    for (int k = 0; k < 256; k++) adjoint_of_mean[k] = 1.f / 256;
    run.spp = spp;
    test_must(ctx, imp_problem_reverse(p, adjoint_of_mean, &run, g, se));
    for (int k = 0; k < 4 * POINTS; k++) {
        const double ref = -5. / 16 * area_slope(points, k),
                     z = (g[k] - ref) / hypot(se[k], least);
        most = fmax(most, fabs(ref));
        worst = fmax(worst, fabs(z));
        largest = fmax(largest, se[k]);
        off = fmax(off, fabs(g[k] - ref));
    }
    tap_ok(worst < 3.5 && largest < part * most,
           "%s before a sky, by its points # off %.2g of %.3g, se %.2g, worst z %.2f",
           what, off, most, largest, worst);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* Above the floor, beside the block. */
static const curve_points over = {{1.9, -1.9, 1.3, .25}, {1.6, -1.2, .7, .2},
                                  {1.0, -.9, .6, .22},   {.6, -.8, 1.1, .2},
                                  {.2, -.9, 1.7, .16},   {-.1, -1.2, 2, .1}};

static void rooms_test(int more)
{
    static const struct number points[] = {{"it.control_points", 7, .02},
                                           {"it.control_points", 9, .03},
                                           {"it.control_points", 10, .02},
                                           {"it.control_points", 11, .02},
                                           {"it.control_points", 14, .02},
                                           {"it.control_points", 16, .03},
                                           {NULL, 0, 0}};
    static const struct number whole[] = {{"it.pose", 0, .02},     {"it.pose", 4, .03},
                                          {"it.scale", 0, .03},    {"lamp.pose", 0, .03},
                                          {"camera.pose", 0, .02}, {NULL, 0, 0}};
    numbers_compare("a curve by its points", with_file(room, PATH CURVE("it", RED), over),
                    24 * more, 48 * more, .2, points);
    numbers_compare("a curve as a whole", with_file(room, DIRECT CURVE("it", RED), over),
                    16 * more, 32 * more, .3, whole);
}

/* A meter below a curve, whose ends light enters. */
static imp_scene *above_meter(const char *shape)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>" DIRECT
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><sensor type='irradiancemeter'><film type='hdrfilm'>"
             "<integer name='width' value='4'/><integer name='height' value='4'/>"
             "<rfilter type='box'/></film></sensor></shape>"
             "%s</scene>",
             shape);
    return test_scene_text(ctx, xml, IMP_MONO);
}

#define LAMP                                                                             \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "        \
    "y='.7'/>"                                                                           \
    "<rotate x='1' angle='170'/><translate x='.9' y='-.2' z='3.2'/></transform>"         \
    "<emitter type='area'><rgb name='radiance' value='9'/></emitter></shape>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='1'/></emitter>"

static void shadow_test(int more)
{
    static const struct number numbers[] = {{"it.control_points", 9, .03},
                                            {"it.control_points", 10, .03},
                                            {"it.control_points", 11, .03},
                                            {"it.control_points", 14, .03},
                                            {NULL, 0, 0}};
    numbers_compare("the shadow of a curve",
                    with_file(above_meter, LAMP CURVE("it", BLACK), over), 256 * more,
                    1024 * more, .05, numbers);
    numbers_compare("a curve below a sky",
                    with_file(above_meter, SKY CURVE("it", BLACK), over), 128 * more,
                    1024 * more, .05, numbers);
}

/* Points that move and swell as the whole does; the gradient by all numbers of some parameters. */
static void gradient(imp_scene *scene, const char *const *names, int n, double *g)
{
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double se[4 * POINTS];
    for (int k = 0; k < n; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < n; k++) test_must(ctx, imp_problem_activate(p, names[k]));
    run.spp = 8;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void same_test(void)
{
    static const char *const points[] = {"it.control_points"}, *const whole[] = {
                                                                   "it.pose", "it.scale"};
    imp_scene *scene = with_file(room, PATH CURVE("it", RED), over);
    const imp_v3 middle = (scene->shapes[0]->lo + scene->shapes[0]->hi) * 0.5;
    double g[4 * POINTS], own[7], sum[7] = {0}, worst = 0, most = 0;
    gradient(scene, points, 1, g);
    gradient(with_file(room, PATH CURVE("it", RED), over), whole, 2, own);
    for (int k = 0; k < POINTS; k++) {
        const imp_v3 r = imp__v3(over[k][0], over[k][1], over[k][2]) - middle,
                     d = imp__v3(g[4 * k], g[4 * k + 1], g[4 * k + 2]),
                     turn = imp__cross(r, d);
        for (int i = 0; i < 3; i++) {
            sum[i] += d[i];
            sum[3 + i] += turn[i];
        }
        sum[6] += imp__dot(r, d) + over[k][3] * g[4 * k + 3];
    }
    for (int k = 0; k < 7; k++) {
        most = fmax(most, fabs(own[k]));
        worst = fmax(worst, fabs(own[k] - sum[k]));
    }
    tap_ok(worst < 1e-5 * most && most > 1e-3,
           "points together are pose and scale # off %.1e of %.3g", worst, most);
}

static void refused_test(void)
{
#define REFUSED(WHAT, SHAPE, POINTS_, NAME, WORD)                                        \
    number_refused(WHAT, with_file(room, DIRECT SHAPE, POINTS_), NAME, WORD)
    static const curve_points sharp = {{1, -1, 1, .3},     {1.2, -1, 1, .3},
                                       {1.3, -1, 1.3, .3}, {1.1, -1, 1.5, .3},
                                       {.9, -1, 1.4, .3},  {.8, -1, 1.2, .3}},
                              low = {{1.9, -1.9, 1.3, .25}, {1.6, -1.2, .1, .2},
                                     {1.0, -.9, -.3, .22},  {.6, -.8, .1, .2},
                                     {.2, -.9, 1.7, .16},   {-.1, -1.2, 2, .1}},
                              knot = {{-2, -2, .8, .1},    {0, -2, .8, .1},
                                      {2.4, -1.2, .8, .1}, {1, .4, .8, .1},
                                      {.9, -2.2, .8, .1},  {.8, -4.5, .8, .1}};
    REFUSED("a curve that bends sharply", CURVE("it", RED), sharp, "it.pose", "sharply");
    REFUSED("a curve in the floor", CURVE("it", RED), low, "block.pose", "a curve");
    REFUSED(
        "a cylinder that begins in a curve",
        CURVE("it", RED) "<shape type='cylinder' id='c'><point name='p0' x='1.03' "
                         "y='-.93' z='.7'/><point name='p1' x='1.03' y='-.3' z='1.6'/>"
                         "<float name='radius' value='.03'/></shape>",
        over, "block.pose", "a curve");
    REFUSED("a curve in itself", CURVE("it", RED), knot, "it.pose",
            "'it' passes through shape 'it'");
    REFUSED("a curve of glass", CURVE("it", "<bsdf type='dielectric'/>"), over, "it.pose",
            "bends light");
    REFUSED("a curve of metal", CURVE("it", "<bsdf type='conductor'/>"), over, "it.pose",
            "curved shape");
    REFUSED("a curve of hair", CURVE("it", "<bsdf type='hair'/>"), over, "camera.pose",
            "directions");
    REFUSED("a curve with a texture",
            CURVE("it", "<bsdf type='diffuse'><texture type='checkerboard' "
                        "name='reflectance'/></bsdf>"),
            over, "it.control_points", "texture");
    REFUSED("points of a block", CURVE("it", RED), over, "block.control_points",
            "bsplinecurve");
    REFUSED("a curve's matrix", CURVE("it", RED), over, "it.to_world", "none of mesh");
    REFUSED("a curve and a mirror",
            CURVE("it", RED) "<shape type='disk' id='d'><transform name='to_world'>"
                             "<translate x='-2' y='-1' z='1'/></transform><bsdf "
                             "type='conductor'/></shape>",
            over, "it.pose", "outside alone");
    REFUSED("cones",
            "<shape type='linearcurve' id='it'><string name='filename' "
            "value='moved_strands.txt'/></shape>",
            over, "block.pose", "linearcurve");
    REFUSED("a curve that its instance stretches",
            "<shape type='shapegroup' id='g'>" CURVE(
                "it", RED) "</shape><shape type='instance' id='i'><transform "
                           "name='to_world'><scale "
                           "x='1.2'/></transform><ref id='g'/></shape>",
            over, "i.pose", "stretched");
    imp_scene *scene = with_file(room, DIRECT CURVE("it", RED), over);
    test_must(ctx, imp_scene_add_geometry(scene, "it.pose"));
    number_refused("points beside a pose", scene, "it.control_points", "single points");
    scene = with_file(room, DIRECT CURVE("it", RED), over);
    size_t n, index;
    double v[4 * POINTS];
    test_must(ctx, imp_scene_add_geometry(scene, "it.control_points"));
    values_get(scene, "it.control_points", v, &n, &index);
    v[7] = -.1;
    const enum imp_status st = imp_scene_set_values(scene, index, n, v);
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(ctx), "radius of point 1"),
           "a radius below 0 # %s", imp_last_error(ctx));
    imp_scene_destroy(scene);
}

/* A turned and scaled instance of one curve is that curve. */
static void instance_test(void)
{
    static const char *const own[] = {"it.pose"}, *const placed[] = {"i.pose"};
    double g[2][6], worst = 0, most = 0;
    gradient(with_file(room, DIRECT CURVE("it", RED), over), own, 1, g[0]);
    gradient(
        with_file(
            room,
            DIRECT "<shape type='shapegroup' id='g'>" CURVE(
                "it", RED) "</shape><shape type='instance' id='i'><ref id='g'/></shape>",
            over),
        placed, 1, g[1]);
    for (int k = 0; k < 6; k++) {
        most = fmax(most, fabs(g[0][k]));
        worst = fmax(worst, fabs(g[0][k] - g[1][k]));
    }
    tap_ok(worst < 1e-4 * most, "an instance of it # off %.1e of %.3g", worst, most);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    ctx = test_context(2);
    adjoint_make();
    area_test("a black curve", bent, 512 * more, 1e-4, 5e-3);
    area_test("a cone from its tip", cone, 512 * more, 1e-4, 5e-3);
    area_test("a knee through its end", knee, 512 * more, 1e-3, .05);
    shadow_test(more);
    rooms_test(more);
    same_test();
    instance_test();
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
