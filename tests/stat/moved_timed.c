/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by both places of an instance that moves while the shutter is open. A black tile that turns,
 * shifts and leaves the film before a sky: areas of its corners' paths, by quadrature over time. In a lit room,
 * and on a meter, differences of pictures with the same random numbers. Everything that moves as one changes
 * nothing; at one instant it is an instance at rest. What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define BLACK                                                                            \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='0'/></bsdf></bsdf>"
#define GREY "<bsdf type='diffuse'><rgb name='reflectance' value='.6,.5,.4'/></bsdf>"

/* ---- A tile before a sky ---------------------------------------------------------------- */

#define SIDE_X  .8
#define SIDE_Y  .6
#define OFF_X   .3 /* of the tile's middle in its group */
#define OFF_Y   .1
#define FILM    2.0 /* half of it */
#define SKY     5.0
#define NUMBERS 12

/* Where it is at last, away from what the file says. */
static const double end_pose[6] = {.1, -.05, .2, .2, -.1, .3};

static imp_scene *tile_scene(void)
{
    return test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='direct'/><sensor type='orthographic' "
        "id='camera'><float name='shutter_open' value='0'/><float name='shutter_close' "
        "value='1'/><transform name='to_world'><scale value='2'/><lookat origin='0,0,4' "
        "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "
        "name='width' value='16'/><integer name='height' value='16'/><rfilter "
        "type='box'/></film></sensor><emitter type='constant'><rgb name='radiance' "
        "value='5'/></emitter><shape type='shapegroup' id='g'><shape type='rectangle'>"
        "<transform name='to_world'><scale x='.8' y='.6'/><translate x='.3' y='.1'/>"
        "</transform>" BLACK "</shape></shape><shape type='instance' id='tile'><ref "
        "id='g'/><transform name='to_world'><rotate z='1' angle='20'/><rotate x='1' "
        "angle='30'/><translate x='.3' y='-.2'/></transform><transform "
        "name='to_world_end'><rotate z='1' angle='75'/><rotate y='1' angle='40'/>"
        "<translate x='1.9' y='.5' z='.3'/></transform></shape></scene>",
        IMP_MONO);
}

struct rotation {
    double r[3][3];
};
static struct rotation times(struct rotation a, struct rotation b)
{
    struct rotation c = {{{0}}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) c.r[i][j] += a.r[i][k] * b.r[k][j];
    return c;
}
static struct rotation transposed(struct rotation a)
{
    struct rotation c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) c.r[i][j] = a.r[j][i];
    return c;
}
static void turned(struct rotation a, const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a.r[i][0] * x[0] + a.r[i][1] * x[1] + a.r[i][2] * x[2];
}
/* About a vector, by `part` of its length. */
static struct rotation about(const double a[3], double part)
{
    const double n[6] = {0, 0, 0, a[0], a[1], a[2]};
    struct rotation out;
    for (int j = 0; j < 3; j++) {
        real p[3] = {j == 0, j == 1, j == 2};
        pose_apply(n, (imp_v3){0}, part, p);
        for (int i = 0; i < 3; i++) out.r[i][j] = (double)p[i];
    }
    return out;
}
/* The vector of a rotation by less than half a turn. */
static void vector_of(struct rotation a, double out[3])
{
    const double cosine = (a.r[0][0] + a.r[1][1] + a.r[2][2] - 1) / 2,
                 angle = acos(cosine), by = angle / (2 * sin(angle));
    for (int i = 0; i < 3; i++)
        out[i] = by * (a.r[(i + 2) % 3][(i + 1) % 3] - a.r[(i + 1) % 3][(i + 2) % 3]);
}

struct place {
    struct rotation turn;
    double shift[3];
};
/* Place k by its six numbers, about the tile's middle there. */
static struct place place_of(int k, const double n[6])
{
    const double degree = IMP_PI / 180;
    struct place p =
        k ? (struct place){times(about((const double[3]){0, 1, 0}, 40 * degree),
                                 about((const double[3]){0, 0, 1}, 75 * degree)),
                           {1.9, .5, .3}}
          : (struct place){times(about((const double[3]){1, 0, 0}, 30 * degree),
                                 about((const double[3]){0, 0, 1}, 20 * degree)),
                           {.3, -.2, 0}};
    const double middle[3] = {OFF_X, OFF_Y, 0};
    double c[3], r[3], back[3];
    const struct rotation R = about(n + 3, 1);
    turned(p.turn, middle, c);
    for (int i = 0; i < 3; i++) {
        c[i] += p.shift[i];
        r[i] = p.shift[i] - c[i];
    }
    turned(R, r, back);
    for (int i = 0; i < 3; i++) p.shift[i] = c[i] + n[i] + back[i];
    p.turn = times(R, p.turn);
    return p;
}

/* The part of a polygon [n][2] with  side x[axis] <= FILM;  its number of corners. */
static int clipped(double (*p)[2], int n, int axis, double side)
{
    double out[16][2];
    int m = 0;
    for (int k = 0; k < n; k++) {
        const double *a = p[k], *b = p[(k + 1) % n];
        const double u = FILM - side * a[axis], v = FILM - side * b[axis];
        if (u >= 0) memcpy(out[m++], a, sizeof out[0]);
        if ((u < 0) != (v < 0)) {
            for (int i = 0; i < 2; i++) out[m][i] = a[i] + (b[i] - a[i]) * u / (u - v);
            m++;
        }
    }
    memcpy(p, out, (size_t)m * sizeof out[0]);
    return m;
}

/* The mean of the picture, by both places' numbers. */
static double tile_mean(const double n[NUMBERS])
{
    enum { TIMES = 1000 };
    const struct place p[2] = {place_of(0, n), place_of(1, n + 6)};
    double w[3], area = 0;
    vector_of(times(p[1].turn, transposed(p[0].turn)), w);
    for (int k = 0; k < TIMES; k++) {
        const double t = (k + .5) / TIMES;
        const struct rotation R = times(about(w, t), p[0].turn);
        double corner[16][2], own = 0;
        int m = 4;
        for (int c = 0; c < 4; c++) {
            const double q[3] = {OFF_X + (c == 0 || c == 3 ? -SIDE_X : SIDE_X),
                                 OFF_Y + (c < 2 ? -SIDE_Y : SIDE_Y), 0};
            double x[3];
            turned(R, q, x);
            for (int i = 0; i < 2; i++)
                corner[c][i] = x[i] + (1 - t) * p[0].shift[i] + t * p[1].shift[i];
        }
        for (int i = 0; i < 4; i++) m = clipped(corner, m, i / 2, i % 2 ? 1 : -1);
        for (int c = 0; c < m; c++) {
            const double *a = corner[c], *b = corner[(c + 1) % m];
            own += .5 * (a[0] * b[1] - a[1] * b[0]);
        }
        area += fabs(own) / TIMES;
    }
    return SKY * (1 - area / (4 * FILM * FILM));
}

static void tile_test(bool is_long)
{
    const int seeds = is_long ? 96 : 20;
    static const char *const name[2] = {"tile.pose", "tile.pose_end"};
    const double h = 1e-3;
    struct tap_stat g[NUMBERS] = {{0}};
    double ref[NUMBERS], most = 0;
    for (int k = 0; k < NUMBERS; k++) {
        double n[2][NUMBERS] = {{0}};
        for (int s = 0; s < 2; s++) {
            memcpy(n[s] + 6, end_pose, sizeof end_pose);
            n[s][k] += s ? h : -h;
        }
        ref[k] = (tile_mean(n[1]) - tile_mean(n[0])) / (2 * h);
        most = fmax(most, fabs(ref[k]));
    }
    imp_scene *scene = tile_scene();
    size_t index;
    for (int k = 0; k < 2; k++) test_must(ctx, imp_scene_add_geometry(scene, name[k]));
    test_must(ctx, imp_scene_find_param(scene, name[1], &index));
    test_must(ctx, imp_scene_set_values(scene, index, 6, end_pose));
    mean_gradients(ctx, scene, name, 2, 64, seeds, g);
    for (int k = 0; k < NUMBERS; k++) {
        char what[64];
        snprintf(what, sizeof what, "a tile before a sky, %s[%d]", name[k / 6], k % 6);
        tap_z(&g[k], ref[k], (is_long ? 3e-3 : 6e-3) * most, what);
    }
    imp_scene_destroy(scene);
}

/* ---- In a room ---------------------------------------------------------------------------- */

#define SHUTTER                                                                          \
    "<float name='shutter_open' value='.1'/><float name='shutter_close' value='.9'/>"
#define CAMERA(more)                                                                     \
    "<sensor type='perspective' id='camera'><float name='fov' value='50'/>" more         \
    "<transform name='to_world'><lookat origin='.3,-5.5,2.6' target='0,0,.7' "           \
    "up='0,0,1'/></transform>" FRAME "</sensor>"
#define FRAME                                                                            \
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' "     \
    "value='16'/><rfilter type='box'/></film>"
#define BOX(inside)                                                                      \
    "<shape type='shapegroup' id='g'>" inside "</shape><shape type='instance' "          \
    "id='mover'><ref id='g'/><transform name='to_world'><rotate z='1' angle='20'/>"      \
    "<translate x='-1' y='-.3' z='.8'/></transform>"
#define CUBE                                                                             \
    "<shape type='cube' id='cube'><transform name='to_world'><scale x='.5' y='.3' "      \
    "z='.4'/></transform>" GREY "</shape><shape type='rectangle'><transform "            \
    "name='to_world'><scale value='.3'/><rotate y='1' angle='70'/><translate z='.9'/>"   \
    "</transform>" THIN_GREEN "</shape>"
#define END                                                                              \
    "<transform name='to_world_end'><rotate y='1' angle='25'/><rotate z='1' "            \
    "angle='65'/><translate x='.5' y='-.5' z='1.2'/></transform></shape>"
#define REST "</shape>"
#define ROOM                                                                             \
    "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='3'/>"   \
    "</transform>" GREY "</shape><shape type='rectangle' id='wall'><transform "          \
    "name='to_world'><scale x='3' y='1.5'/><rotate x='1' angle='90'/><translate "        \
    "y='3.1' "                                                                           \
    "z='1.5'/></transform>" THIN_PALE "</shape><shape type='cube' id='still'>"           \
    "<transform name='to_world'><scale value='.4'/><translate x='1.7' y='1' z='.6'/>"    \
    "</transform>" GREY "</shape><shape type='rectangle' id='lamp'><transform "          \
    "name='to_world'><scale x='.5' y='.7'/><rotate x='1' angle='170'/><translate "       \
    "x='.9' y='-.2' z='3.2'/></transform><emitter type='area'><rgb name='radiance' "     \
    "value='9,8,7'/></emitter></shape>"

static imp_scene *room(const char *rest)
{
    char xml[16384];
    snprintf(xml, sizeof xml, "<scene version='3.0.0'>" PATH ROOM "%s</scene>", rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void room_test(int more)
{
    static const struct number numbers[] = {
        {"mover.pose", 0, .02},     {"mover.pose", 1, .02},
        {"mover.pose", 5, .02},     {"mover.pose_end", 0, .02},
        {"mover.pose_end", 1, .02}, {"mover.pose_end", 4, .02},
        {"still.pose", 0, .02},     {"lamp.pose", 0, .02},
        {"camera.pose", 5, .01},    {NULL, 0, 0}};
    static const struct number few[] = {{"mover.pose", 1, .02},
                                        {"mover.pose_end", 1, .02},
                                        {"camera.pose", 5, .01},
                                        {NULL, 0, 0}};
    static const struct number read[] = {
        {"mover.pose", 0, .02}, {"mover.pose_end", 2, .02}, {NULL, 0, 0}};
    numbers_compare("while it moves", room(CAMERA(SHUTTER) BOX(CUBE) END), 24 * more,
                    32 * more, .2, more > 1 ? numbers : few);
    numbers_compare("under what moves",
                    room("<shape type='rectangle' id='tile'><transform name='to_world'>"
                         "<scale value='.8'/><translate x='-.3' y='-.3' z='.1'/>"
                         "</transform>" GREY
                         "<sensor type='irradiancemeter' id='meter'>" SHUTTER FRAME
                         "</sensor></shape>" BOX(CUBE) END),
                    12 * more, 16 * more, .2, read);
}

/* Shifts of all that there is, and of the camera, change nothing: not what a single draw brings. */
static void identity_test(void)
{
    static const char *const all[] = {"mover.pose", "mover.pose_end", "floor.pose",
                                      "wall.pose",  "still.pose",     "lamp.pose",
                                      "camera.pose"};
    enum { N = sizeof all / sizeof *all };
    imp_scene *scene = room(CAMERA(SHUTTER) BOX(CUBE) END);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[6 * N], worst = 0, most = 0;
    for (int k = 0; k < N; k++) test_must(ctx, imp_scene_add_geometry(scene, all[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < N; k++) test_must(ctx, imp_problem_activate(p, all[k]));
    run.spp = 16;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
    for (int i = 0; i < 3; i++) {
        double sum = 0;
        for (int k = 0; k < N; k++) sum += g[6 * k + i];
        worst = fmax(worst, fabs(sum));
        most = fmax(most, fabs(g[i]));
    }
    tap_ok(worst < 1e-10 * most && most > 1e-4, "all is shifted # %.1e of %.1e", worst,
           most);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Before its motion begins it is as an instance at rest, and its last place moves nothing. */
static void instant_test(void)
{
    double g[2][12] = {{0}}, se[2][12] = {{0}}, most = 0, worst = 0, last = 0, noise = 0;
    for (int k = 0; k < 2; k++) {
        imp_scene *scene =
            k ? room(CAMERA("") BOX(CUBE) END) : room(CAMERA("") BOX(CUBE) REST);
        imp_problem *p;
        struct imp_run run = IMP_RUN_INIT;
        test_must(ctx, imp_scene_add_geometry(scene, "mover.pose"));
        if (k) test_must(ctx, imp_scene_add_geometry(scene, "mover.pose_end"));
        test_must(ctx, imp_problem_create(scene, &p));
        test_must(ctx, imp_problem_activate(p, "mover.pose"));
        if (k) test_must(ctx, imp_problem_activate(p, "mover.pose_end"));
        run.spp = 128;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g[k], se[k]));
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
    for (int i = 0; i < 6; i++) {
        const double both = hypot(se[0][i], se[1][i]);
        most = fmax(most, fabs(g[0][i]));
        worst = fmax(worst, fabs(g[1][i] - g[0][i]) / both);
        noise = fmax(noise, both);
        last = fmax(last, fabs(g[1][6 + i]));
    }
    tap_ok(noise < .1 * most && worst < 3.5 && last == 0,
           "at its first place as at rest # off %.1f errors of %.1e of %.3f, last %.1e",
           worst, noise, most, last);
}

/* ---- What is refused ------------------------------------------------------------------------ */

static void refused_test(void)
{
    static const struct {
        const char *what, *rest, *name, *word;
    } bad[] = {
        {"a ball that moves in time",
         CAMERA(SHUTTER)
             BOX("<shape type='sphere' id='ball'><float name='radius' value='.3'/>"
                 "</shape>") END,
         "camera.pose", "not made of triangles"},
        {"one that its motion stretches",
         CAMERA(SHUTTER)
             BOX(CUBE) "<transform name='to_world_end'><scale value='1.1'/>"
                       "<translate x='.5' y='-.5' z='1.2'/></transform></shape>",
         "camera.pose", "stretched by its motion"},
        {"a pose of one that its motion stretches",
         CAMERA(SHUTTER)
             BOX(CUBE) "<transform name='to_world_end'><scale value='1.1'/>"
                       "<translate x='.5' y='-.5' z='1.2'/></transform></shape>",
         "mover.pose", "stretches"},
        {"one that makes half a turn",
         CAMERA(SHUTTER)
             BOX(CUBE) "<transform name='to_world_end'><rotate z='1' angle='200'/>"
                       "<translate x='.5' y='-.5' z='1.2'/></transform></shape>",
         "mover.pose", "half a turn"},
        {"one that dips into the floor on its way",
         CAMERA(SHUTTER) BOX(CUBE) "<transform name='to_world_end'><translate x='.5' "
                                   "z='-.6'/></transform></shape>",
         "mover.pose", "may meet shape 'floor'"},
        {"one that sweeps through a block",
         CAMERA(SHUTTER)
             BOX(CUBE) "<transform name='to_world_end'><translate x='4' y='2' "
                       "z='.8'/></transform></shape>",
         "still.pose", "may meet shape 'still'"},
        {"one that passes the camera",
         CAMERA(SHUTTER) BOX(CUBE) "<transform name='to_world_end'><translate x='.7' "
                                   "y='-8' z='3.4'/></transform></shape>",
         "still.pose", "may pass sensor 'camera'"},
        {"one that passes a bulb",
         CAMERA(SHUTTER) BOX(CUBE) END
         "<emitter type='point' id='bulb'><point name='position' "
         "value='-.2,-.4,1'/><rgb name='intensity' value='1'/></emitter>",
         "mover.pose", "may pass light 'bulb'"},
        {"beside a mirror",
         CAMERA(SHUTTER) BOX(CUBE) END
         "<shape type='rectangle'><transform name='to_world'><scale value='.3'/>"
         "<translate x='-2' y='2' z='.5'/></transform><bsdf type='conductor'/></shape>",
         "mover.pose", "there are mirrors"},
        {"along a single ray",
         "<sensor type='radiancemeter' id='camera'>" SHUTTER
         "<transform name='to_world'><lookat origin='.3,-5.5,2.6' target='0,0,.7' "
         "up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' value='1'/>"
         "<integer name='height' value='1'/><rfilter type='box'/></film></sensor>" BOX(
             CUBE) END,
         "mover.pose", "single rays"},
        {"the last place of one at rest", CAMERA(SHUTTER) BOX(CUBE) REST,
         "mover.pose_end", "moves in time"},
        {"the last place of a shape", CAMERA(SHUTTER) BOX(CUBE) END, "still.pose_end",
         "moves in time"},
        {"the size of one that moves", CAMERA(SHUTTER) BOX(CUBE) END, "mover.scale",
         "a pose and a pose_end"},
        {"the map of one that moves", CAMERA(SHUTTER) BOX(CUBE) END, "mover.to_world",
         "a pose and a pose_end"},
        {"its group", CAMERA(SHUTTER) BOX(CUBE) END, "g.pose", "moves in time"},
        {"one that moves within a group",
         CAMERA(SHUTTER) "<shape type='shapegroup' id='h'>" CUBE
                         "</shape><shape type='shapegroup' id='g'><shape type='instance'>"
                         "<ref id='h'/><transform name='to_world_end'><translate x='.1'/>"
                         "</transform></shape></shape><shape type='instance' id='mover'>"
                         "<ref id='g'/><transform name='to_world'><translate z='1'/>"
                         "</transform></shape>",
         "camera.pose", "in a group"}};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++)
        number_refused(bad[k].what, room(bad[k].rest), bad[k].name, bad[k].word);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    ctx = test_context(2);
    adjoint_make();
    tile_test(more > 1);
    room_test(more);
    identity_test();
    instant_test();
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
