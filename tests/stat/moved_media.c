/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where media end within the scene, at borders of type null: balls and slabs
 * of a medium before a wall that glows, and one that scatters the light of a sun once, against
 * quadrature; imp_problem_reverse against central differences in a room. What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define MEDIUM(SIGMA, ALBEDO, PHASE)                                                     \
    "<medium type='homogeneous' name='interior'><rgb name='sigma_t' value='" SIGMA       \
    "'/><rgb name='albedo' value='" ALBEDO "'/>" PHASE "</medium>"
#define NULL_BALL(PLACE, RADIUS, MEDIUM)                                                 \
    "<shape type='sphere' id='fog'><point name='center' value='" PLACE                   \
    "'/><float name='radius' value='" RADIUS "'/><bsdf type='null'/>" MEDIUM "</shape>"
#define CAMERA                                                                           \
    "<sensor type='perspective' id='camera'><float name='fov' value='60'/><float "       \
    "name='near_clip' value='1e-6'/><transform name='to_world'><lookat "                 \
    "origin='0,0,3' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"        \
    "<integer name='width' value='16'/><integer name='height' value='16'/><rfilter "     \
    "type='box'/></film></sensor>"
#define GLOWING                                                                          \
    "<shape type='rectangle' id='wall'><transform name='to_world'><scale value='50'/>"   \
    "<translate z='-2'/></transform><emitter type='area'><rgb name='radiance' "          \
    "value='3'/></emitter></shape>"

/* The mean of the picture through a ball of radius r at the distance D before a wall of radiance 3: the
 * film holds 4 tan^2(30 deg) of the plane at the distance 1, where the ball is a disk; a ray beside the
 * axis by the angle a has the chord 2 sqrt(r^2 - D^2 sin^2(a)). */
static double ball_seen(double D, double r, double sigma)
{
    enum { STEPS = 20000 };
    double sum = 0;
    for (int k = 0; k < STEPS; k++) {
        const double v = (k + .5) / STEPS, s = sqrt(1 - v * v) * r / D; /* of v dv */
        const double chord = 2 * r * v, c = sqrt(1 - s * s);
        /* d(tan^2 a)/2 = s ds/c^4, s ds = (r/D)^2 v dv */
        sum += 2 * IMP_PI * (exp(-sigma * chord) - 1) * imp__sqr(r / D) * v /
               imp__sqr(c * c) / STEPS;
    }
    return 3 * (1 + sum / (4 * imp__sqr(tan(IMP_PI / 6))));
}

/* A slab of the thickness 1.4 and of a width that no pixel sees, in a sun that shines straight down, as
 * parallel rays from above see it: of single scattering in all directions alike
 *
 *     L = sigma_s/(4 pi) E int_0^h exp(-2 sigma t) dt,  dL/dh = sigma_s/(4 pi) E exp(-2 sigma h)
 */
#define SLAB                                                                             \
    "<sensor type='orthographic' id='camera'><transform name='to_world'><lookat "        \
    "origin='0,0,3' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"        \
    "<integer name='width' value='8'/><integer name='height' value='8'/><rfilter "       \
    "type='box'/></film></sensor><emitter type='directional'><vector name='direction' "  \
    "value='0,0,-1'/><rgb name='irradiance' value='5'/></emitter>"                       \
    "<shape type='cube' id='fog'><transform name='to_world'><scale x='1.5' y='1.5' "     \
    "z='.7'/></transform><bsdf type='null'/>" MEDIUM(".8", ".75", "") "</shape>"

static void closed_test(int more)
{
    static const char ball[] =
        VOLPATH("2") CAMERA GLOWING NULL_BALL("0,0,0", "1", MEDIUM("1.2", "0", ""));
    static const char slab[] = VOLPATH("2") SLAB;
    const double h = 1e-4, sigma = .8, thick = 1.4;
    const double by_radius =
                     (ball_seen(3, 1 + h, 1.2) - ball_seen(3, 1 - h, 1.2)) / (2 * h),
                 nearer = (ball_seen(3 - h, 1, 1.2) - ball_seen(3 + h, 1, 1.2)) / (2 * h),
                 by_depth = .75 * sigma / (4 * IMP_PI) * 5 * exp(-2 * sigma * thick);
    const int spp = 64 * more;
    mean_gradient_test(ctx, "a ball that absorbs becomes larger", ball, "fog.radius", 0,
                       spp, by_radius, .005);
    mean_gradient_test(ctx, "it comes nearer", ball, "fog.pose", 2, spp, nearer, .005);
    mean_gradient_test(ctx, "the camera comes nearer", ball, "camera.pose", 2, spp,
                       -nearer, .005);
    mean_gradient_test(ctx, "a slab that scatters becomes thicker", slab, "fog.scale", 0,
                       4 * spp, by_depth * thick, .025 * by_depth * thick);
    mean_gradient_test(ctx, "it is farther away", slab, "fog.pose", 2, 8 * spp, 0,
                       .025 * by_depth * thick);
}

/* The room of moves_kit.h; with its camera in medium 'a'. */
static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}
static imp_scene *filled(const char *rest)
{
    char xml[16384], filled[16384];
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    const char *film = strstr(xml, "<film");
    snprintf(filled, sizeof filled, "%.*s<ref name='medium' id='a'/>%s",
             (int)(film - xml), xml, film);
    return test_scene_text(ctx, filled, IMP_RGB);
}

#define BOX(MEDIUM)                                                                      \
    "<shape type='cube' id='fog'><transform name='to_world'><scale x='1.1' y='.9' "      \
    "z='.7'/><rotate z='1' angle='20'/><translate x='.2' y='-.3' z='1.1'/></transform>"  \
    "<bsdf type='null'/>" MEDIUM "</shape>"
#define IN_BOX                                                                           \
    "<shape type='sphere' id='ball'><point name='center' value='0,-.5,1.2'/><float "     \
    "name='radius' value='.4'/><bsdf type='null'/><medium name='interior' "              \
    "type='homogeneous'><rgb name='sigma_t' value='1.5,1,.4'/><rgb name='albedo' "       \
    "value='.4,.9,.8'/></medium><ref name='exterior' id='a'/></shape>"
#define HOLE                                                                             \
    "<shape type='sphere' id='ball'><point name='center' value='0,-.8,1.2'/><float "     \
    "name='radius' value='.7'/><bsdf type='null'/><ref name='exterior' id='a'/></shape>"
#define NAMED(SIGMA, ALBEDO)                                                             \
    "<medium type='homogeneous' id='a'><rgb name='sigma_t' value='" SIGMA                \
    "'/><rgb name='albedo' value='" ALBEDO                                               \
    "'/><phase type='hg'><float name='g' value='.5'/></phase></medium>"
/* A camera outside of a medium with a block in it: of what moves, its walks may meet nothing. */
#define SMOKE                                                                            \
    "<scene version='3.0.0'>" VOLPATH(                                                   \
        "3") "<sensor type='perspective' id='camera'>"                                   \
             "<float name='fov' value='40'/><transform name='to_world'><lookat "         \
             "origin='0,-5,0' target='0,0,0' up='0,0,1'/></transform><film "             \
             "type='hdrfilm'>"                                                           \
             "<integer name='width' value='24'/><integer name='height' "                 \
             "value='16'/><rfilter "                                                     \
             "type='box'/></film></sensor><shape type='cube' id='fog'><bsdf "            \
             "type='null'/>" MEDIUM(                                                     \
                 "1", ".9",                                                              \
                 "") "</shape><shape type='cube' id='block'><transform "                 \
                     "name='to_world'><scale value='.4'/></transform></shape><shape "    \
                     "type='rectangle' "                                                 \
                     "id='lamp'><transform name='to_world'><rotate x='1' "               \
                     "angle='180'/><translate "                                          \
                     "z='2.6'/></transform><emitter type='area'><rgb name='radiance' "   \
                     "value='10'/>"                                                      \
                     "</emitter></shape></scene>"
#define BULB                                                                             \
    "<emitter type='point' id='bulb'><point name='position' value='.2,-1,2.5'/><rgb "    \
    "name='intensity' value='4'/></emitter>"

static void refused_test(void)
{
    static const char fog[] = BOX(MEDIUM(".5", ".5", "")) VOLPATH("2");
    char xml[4096];
    number_refused("a border that is open",
                   room("<shape type='rectangle' id='fog'><bsdf type='null'/>" MEDIUM(
                       ".5", "0", "") "</shape>" VOLPATH("2")),
                   "block.pose", "closed");
    snprintf(xml, sizeof xml, "%s" BULB, fog);
    number_refused("a lamp without a size", room(xml), "fog.pose", "no size");
    snprintf(xml, sizeof xml,
             "%s<shape type='rectangle' id='veil'><bsdf type='mask'><float "
             "name='opacity' value='.5'/><bsdf type='diffuse'/></bsdf></shape>",
             fog);
    number_refused("a mask", room(xml), "fog.pose", "straight on");
    number_refused("glass around a medium",
                   room("<shape type='sphere' id='ball'><bsdf type='dielectric'/>" MEDIUM(
                       ".5", "0", "") "</shape>" VOLPATH("2")),
                   "ball.pose", "not null");
}

/* A lamp at the top of the box, which is at the height 1.8. */
#define SHINES "<emitter type='area'><rgb name='radiance' value='2'/></emitter></shape>"
#define PANEL(Z)                                                                         \
    "<shape type='rectangle' id='panel'><transform name='to_world'><scale value='.2'/>"  \
    "<rotate x='1' angle='90'/><translate x='.2' y='-.3' z='" Z "'/></transform>" SHINES

static void lamps_test(void)
{
    static const char fog[] = BOX(MEDIUM(".5", ".5", "")) VOLPATH("2");
    static const struct {
        const char *what, *lamp, *word;
    } at[] = {
        {"a lamp that crosses a border", PANEL("1.75"), "'panel' meets shape 'fog'"},
        {"one that stands on it", PANEL("2"), "'panel' meets shape 'fog'"},
        {"one beside it", PANEL("2.01"), NULL},
        {"one behind it", PANEL("1.59"), NULL},
        {"a ball",
         "<shape type='sphere' id='panel'><point name='center' value='.2,-.3,1.9'/>"
         "<float name='radius' value='.15'/>" SHINES,
         "'panel' meets shape 'fog'"},
        {"a disk",
         "<shape type='disk' id='panel'><transform name='to_world'><scale value='.2'/>"
         "<rotate x='1' angle='60'/><translate x='.2' y='-.3' "
         "z='1.85'/></transform>" SHINES,
         "meets shape"}};
    char xml[4096];
    for (size_t k = 0; k < sizeof at / sizeof *at; k++) {
        snprintf(xml, sizeof xml, "%s%s", fog, at[k].lamp);
        number_refused(at[k].what, room(xml), "block.pose", at[k].word);
    }
    number_refused(
        "a ball of a medium that a lamp crosses",
        room(NULL_BALL("0,-.6,3.2", "1.2", MEDIUM(".5", ".5", "")) VOLPATH("2")),
        "block.pose", "'lamp' meets shape 'fog'");
}

/* A cube has four vertices for each side: it opens where one of them moves, and where one has. */
static void opened_test(void)
{
    static const char fog[] = BOX(MEDIUM(".5", ".5", "")) VOLPATH("2");
    double there[NUMBERS_MAX];
    size_t n, index;
    number_refused("a border that repeats vertices", room(fog), "fog.vertex_positions",
                   "opens where one of them moves");
    imp_scene *scene = room(fog);
    test_must(ctx, imp_scene_add_geometry(scene, "fog.vertex_positions"));
    values_get(scene, "fog.vertex_positions", there, &n, &index);
    for (int k = 0; k < 2; k++) {
        imp_problem *p;
        struct imp_run run = IMP_RUN_INIT;
        double g[6];
        run.spp = 2;
        if (k == 0) test_must(ctx, imp_scene_add_geometry(scene, "block.pose"));
        there[0] += k ? -.1 : .1;
        test_must(ctx, imp_scene_set_values(scene, index, n, there));
        test_must(ctx, imp_problem_create(scene, &p));
        test_must(ctx, imp_problem_activate(p, "block.pose"));
        const enum imp_status st = imp_problem_reverse(p, adjoint, &run, g, NULL);
        tap_ok(k ? st == IMP_OK
                 : st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "closed"),
               "a border whose vertex %s # %s", k ? "is back" : "has moved",
               st == IMP_OK ? "" : imp_last_error(ctx));
        imp_problem_destroy(p);
    }
    imp_scene_destroy(scene);
}

/* For walks that go through no media a border is a surface like others, which light samples do not
 * pass: the same numbers as without its medium. */
static void unseen_test(void)
{
    static const char *const name[] = {"lamp.pose", "block.pose", "fog.pose"};
    double g[2][18];
    for (int k = 0; k < 2; k++) {
        imp_scene *scene =
            room(k ? BOX(MEDIUM(".5", ".5", "")) "<integrator type='path'/>"
                   : BOX("") "<integrator type='path'/>");
        struct imp_run run = IMP_RUN_INIT;
        imp_problem *p;
        for (int i = 0; i < 3; i++)
            test_must(ctx, imp_scene_add_geometry(scene, name[i]));
        test_must(ctx, imp_problem_create(scene, &p));
        for (int i = 0; i < 3; i++) test_must(ctx, imp_problem_activate(p, name[i]));
        run.spp = 8;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g[k], NULL));
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
    double most = 0;
    for (int i = 12; i < 18; i++) most = fmax(most, fabs(g[0][i]));
    tap_ok(memcmp(g[0], g[1], sizeof g[0]) == 0 && most > 1e-3,
           "media that path does not see # fog.pose up to %.3g", most);
}

/* What takes more than a moment. */
static void long_test(int more)
{
    static const struct number box[] = {{"fog.pose", 0, .02},
                                        {"fog.pose", 5, .03},
                                        {"block.pose", 3, .02},
                                        {"lamp.pose", 0, .03},
                                        {NULL, 0, 0}},
                               nest[] = {{"fog.pose", 0, .02},    {"ball.center", 0, .02},
                                         {"ball.radius", 0, .02}, {"lamp.pose", 0, .03},
                                         {"camera.pose", 0, .02}, {NULL, 0, 0}},
                               hole[] = {{"ball.center", 0, .02},
                                         {"lamp.pose", 2, .03},
                                         {"camera.pose", 2, .02},
                                         {NULL, 0, 0}};
    numbers_compare("more of the box",
                    room(NAMED(".5,.7,.9", ".9,.8,.7")
                             BOX("<ref name='interior' id='a'/>") VOLPATH("4")),
                    8 * more, 8 * more, .05, box);
    numbers_compare("a ball in the box",
                    room(NAMED(".5,.6,.7", ".8,.7,.6")
                             BOX("<ref name='interior' id='a'/>") IN_BOX VOLPATH("4")),
                    8 * more, 8 * more, .05, nest);
    numbers_compare("a hole in what fills the room",
                    filled(NAMED(".2,.25,.3", ".8,.7,.6") HOLE VOLPATH("3")), 8 * more,
                    8 * more, .05, hole);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    static const struct number box[] = {{"fog.pose", 2, .02},
                                        {"fog.scale", 0, .02},
                                        {"camera.pose", 0, .02},
                                        {NULL, 0, 0}},
                               smoke[] = {{"block.pose", 1, .05},
                                          {"block.pose", 2, .05},
                                          {NULL, 0, 0}},
                               bulb[] = {{"fog.pose", 2, .02},
                                         {"bulb.position", 2, .02},
                                         {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    closed_test(more);
    numbers_compare("a box that scatters",
                    room(NAMED(".5,.7,.9", ".9,.8,.7")
                             BOX("<ref name='interior' id='a'/>") VOLPATH("4")),
                    64 * more, 32 * more, .05, box);
    numbers_compare("a bulb beside a box that absorbs",
                    room(BOX(MEDIUM(".5,.7,.9", "0", "")) BULB VOLPATH("3")), 32 * more,
                    32 * more, .05, bulb);
    numbers_compare("a block in smoke", test_scene_text(ctx, SMOKE, IMP_RGB), 32 * more,
                    48 * more, .04, smoke);
    unseen_test();
    if (more > 1) long_test(more);
    refused_test();
    lamps_test();
    opened_test();
    imp_context_destroy(ctx);
    return tap_done();
}
