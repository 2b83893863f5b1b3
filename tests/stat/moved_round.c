/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by a sphere's center and radius and a cylinder's p0, p1 and radius: of black ones before a
 * sky, whose pictures have areas in closed form; the same numbers as by pose and scale; differences of
 * pictures with the same random numbers. What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define TUBE                                                                             \
    "<shape type='cylinder' id='tube'><float name='radius' value='.35'/><point "         \
    "name='p0' value='.8,-.9,.5'/><point name='p1' value='1.3,-.4,1.4'/>" THIN_PALE      \
    "</shape>"
#define BALL(MORE)                                                                       \
    "<shape type='sphere' id='ball'><float name='radius' value='.4'/><point "            \
    "name='center' value='1.1,-.8,.7'/>" MORE "</shape>"
#define GREY "<ref id='grey'/>"
#define GLOW "<emitter type='area'><rgb name='radiance' value='3,4,5'/></emitter>"

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* Seen by parallel rays along z on a film of 4 x 4, before a sky of radiance 5: what is black hides
 * pi r^2 of it, or 2 r l. */
static imp_scene *before_sky(const char *shape)
{
    char black[2048];
    snprintf(black, sizeof black,
             "%s<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></shape>",
             shape);
    return before_sky_build(ctx, black);
}

static void areas_test(void)
{
    const double sky = 5. / 16;
    struct tap_stat r[1] = {{0}}, t[1] = {{0}}, end[2][3] = {{{0}}};
    imp_scene *ball = before_sky("<shape type='sphere' id='it'><point name='center' "
                                 "value='.1,.2,.3'/><float name='radius' value='.7'/>");
    test_must(ctx, imp_scene_add_geometry(ball, "it.radius"));
    mean_gradient(ctx, ball, "it.radius", 64, 16, r);
    tap_z(&r[0], -sky * IMP_2PI * .7, 3e-3 * sky * IMP_2PI * .7,
          "a ball before a sky, by its radius");
    imp_scene_destroy(ball);
    /* The outline of a tube is 2 r s + pi r^2 z/l, of the length l, s across the rays and z along them. */
    imp_scene *tube = before_sky("<shape type='cylinder' id='it'><float name='radius' "
                                 "value='.3'/><point name='p0' value='.2,-.3,.1'/><point "
                                 "name='p1' value='.95,.7,.6'/>");
    static const char *const names[] = {"it.p0", "it.p1"};
    const double x = .75, y = 1, z = .5, radius = .3, across = hypot(x, y),
                 l = hypot(across, z), ring = IMP_PI * radius * radius;
    const double by_across = 2 * radius - ring * z * across / (l * l * l),
                 by_z = ring * across * across / (l * l * l);
    const double ref[3] = {by_across * x / across, by_across * y / across, by_z};
    for (int k = 0; k < 2; k++) test_must(ctx, imp_scene_add_geometry(tube, names[k]));
    test_must(ctx, imp_scene_add_geometry(tube, "it.radius"));
    mean_gradient(ctx, tube, "it.radius", 64, 16, t);
    const double by_radius = 2 * across + IMP_2PI * radius * z / l;
    /* .02 % too much, by what is looked at beside rims next to where they meet the outline. */
    const double off = t[0].mean / (-sky * by_radius) - 1,
                 error = tap_se(&t[0]) / (sky * by_radius);
    tap_ok(fabs(off) < 5e-4 && error < 1.5e-4, "a tube's radius # off %.2g se %.2g", off,
           error);
    for (int k = 0; k < 2; k++) {
        mean_gradient(ctx, tube, names[k], 64, 16, end[k]);
        for (int i = 0; i < 3; i++) {
            char what[64];
            snprintf(what, sizeof what, "a tube's p%d along %c", k, "xyz"[i]);
            tap_z(&end[k][i], (k ? -1 : 1) * sky * ref[i], 3e-3 * sky * by_across, what);
        }
    }
    imp_scene_destroy(tube);
}

/* The gradient by all numbers of these names. */
static size_t gradient(imp_scene *scene, const char *const *names, int n, double *g,
                       double *se)
{
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    for (int k = 0; k < n; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < n; k++) test_must(ctx, imp_problem_activate(p, names[k]));
    run.spp = 16;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
    const size_t numbers = imp_problem_n_variables(p);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    return numbers;
}

static void same_test(void)
{
    static const char *const ball[2][2] = {{"ball.center", "ball.radius"},
                                           {"ball.pose", "ball.scale"}};
    static const char *const tube[2][3] = {{"tube.p0", "tube.p1", "tube.radius"},
                                           {"tube.pose", "tube.scale", ""}};
    double g[2][12], se[12], worst = 0, most = 0;
    gradient(room(PATH BALL(GREY)), ball[0], 2, g[0], se);
    gradient(room(PATH BALL(GREY)), ball[1], 2, g[1], se);
    for (int k = 0; k < 4; k++) {
        const double other = k < 3 ? g[1][k] : g[1][6] / .4;
        most = fmax(most, fabs(g[0][k]));
        worst = fmax(worst, fabs(g[0][k] - other));
    }
    tap_ok(worst < 1e-6 * most && most > 1e-3,
           "center and radius are pose and scale # off %.1e of %.3g", worst, most);

    gradient(room(PATH TUBE), tube[0], 3, g[0], se);
    gradient(room(PATH TUBE), tube[1], 2, g[1], se);
    const imp_v3 e0 = imp__v3(g[0][0], g[0][1], g[0][2]),
                 e1 = imp__v3(g[0][3], g[0][4], g[0][5]), half = imp__v3(.25, .25, .45),
                 d = e1 - e0;
    worst = most = 0;
    for (int k = 0; k < 3; k++) {
        most = fmax(most, fabs(g[1][k]));
        worst = fmax(worst, fabs(e0[k] + e1[k] - g[1][k]) - 0.2 * se[k]);
        /* A turn a moves the ends by -a x half and a x half: a.(half x d), but for what is along it. */
        const imp_v3 axis = imp__normalize(half), turn = imp__cross(half, d),
                     pose = imp__v3(g[1][3], g[1][4], g[1][5]),
                     across = pose - axis * imp__dot(axis, pose);
        worst = fmax(worst, fabs(turn[k] - across[k]) - 0.2 * se[3 + k]);
    }
    worst = fmax(worst, fabs(imp__dot(half, d) + .35 * g[0][6] - g[1][6]) - 0.2 * se[6]);
    tap_ok(worst < 1e-5 * most && most > 1e-3,
           "ends and radius together are pose and scale # off %.1e of %.3g", worst, most);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number tube[] = {{"tube.p0", 0, .02},     {"tube.p0", 2, .02},
                                         {"tube.p1", 1, .02},     {"tube.p1", 2, .02},
                                         {"tube.radius", 0, .02}, {NULL, 0, 0}};
    static const struct number ball[] = {{"ball.center", 0, .02}, {"ball.center", 2, .02},
                                         {"ball.radius", 0, .02}, {"block.pose", 0, .02},
                                         {"camera.pose", 0, .02}, {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    areas_test();
    same_test();
    numbers_compare("a tube by its ends", room(PATH TUBE), 32 * more, 48 * more, .2,
                    tube);
    numbers_compare("a ball", room(DIRECT BALL(GREY)), 32 * more, 48 * more, .2, ball);
    number_refused("the radius of a light", room(DIRECT BALL(GLOW)), "ball.radius",
                   "it is a light");
    number_refused("the centre of a light moves", room(DIRECT BALL(GLOW)), "ball.center",
                   NULL);
    number_refused("a block has no centre", room(DIRECT), "block.center", "sphere");
    number_refused("a tube has no centre", room(DIRECT TUBE), "tube.center", "sphere");
    imp_scene *scene = room(DIRECT BALL(GREY));
    test_must(ctx, imp_scene_add_geometry(scene, "ball.pose"));
    number_refused("center beside pose", scene, "ball.center", "say where it is");
    imp_context_destroy(ctx);
    return tap_done();
}
