/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves among cylinders: imp_problem_reverse against central differences, of a
 * tube that leans, is turned, grows, and shines, of a can with a lid that stands still, by direct
 * light, over bounces and under a sky. A black tube before a sky against the area of its outline.
 * What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define SUN                                                                              \
    "<emitter type='directional' id='sun'><vector name='direction' value='-.4,.5,-1'/>"  \
    "<rgb name='irradiance' value='3,3,2'/></emitter>"
#define TUBE(inside)                                                                     \
    "<shape type='cylinder' id='tube'><float name='radius' value='.45'/><point "         \
    "name='p0' value='0,0,-.6'/><point name='p1' value='0,0,.6'/><transform "            \
    "name='to_world'><rotate x='1' y='.4' angle='50'/><translate x='1.1' y='-.6' "       \
    "z='1.1'/></transform>" inside "</shape>"
#define METAL                                                                            \
    "<bsdf type='twosided'><bsdf type='roughconductor'><string name='material' "         \
    "value='Cu'/><float name='alpha' value='.4'/></bsdf></bsdf>"
#define GLOW "<emitter type='area'><rgb name='radiance' value='3,4,5'/></emitter>"
/* Its wall is open at the floor's side. */
#define CAN                                                                              \
    "<shape type='cylinder' id='side'><float name='radius' value='.5'/><point "          \
    "name='p0' "                                                                         \
    "value='1.2,-.5,.3'/><point name='p1' value='1.2,-.5,1.2'/></shape><shape "          \
    "type='disk' id='lid'><transform name='to_world'><scale value='.5'/><translate "     \
    "x='1.2' y='-.5' z='1.2'/></transform></shape>"

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* ---- A black tube before a sky ---------------------------------------------------------- */

struct place {
    double x, y;
};
static int by_place(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    if (p->x != q->x) return p->x < q->x ? -1 : 1;
    return p->y < q->y ? -1 : p->y > q->y;
}
static double turn(struct place a, struct place b, struct place c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/* Area of the convex hull of n places, which are sorted: chains below and above them. */
static double hull_area(struct place *p, int n, struct place *chain)
{
    double sum = 0;
    int k = 0;
    qsort(p, (size_t)n, sizeof *p, by_place);
    for (int side = 0; side < 2; side++) {
        const int first = k;
        for (int i = 0; i < n; i++) {
            const struct place x = p[side ? n - 1 - i : i];
            while (k >= first + 2 && turn(chain[k - 2], chain[k - 1], x) <= 0) k--;
            chain[k++] = x;
        }
    }
    for (int i = 0; i < k; i++) {
        const struct place a = chain[i], b = chain[(i + 1) % k];
        sum += 0.5 * (a.x * b.y - b.x * a.y);
    }
    return sum;
}

/* On a film at the distance 1 from (0, 0, 4), which looks down: a tube of radius r and half length l
 * about the origin, turned about x by a, shifted by e. Its rims make the outline. */
static double outline(double r, double l, double a, const double e[3])
{
    enum { N = 20000 };
    static struct place p[2 * N], chain[4 * N + 4];
    for (int k = 0; k < 2 * N; k++) {
        const double phi = IMP_2PI * (k / 2) / N, x = r * cos(phi), y = r * sin(phi),
                     z = k % 2 ? l : -l;
        const double v = y * cos(a) - z * sin(a) + e[1],
                     depth = 4 - (y * sin(a) + z * cos(a)) - e[2];
        p[k] = (struct place){(x + e[0]) / depth, v / depth};
    }
    return hull_area(p, 2 * N, chain);
}

static void outline_test(void)
{
    const double h = 1e-4, r = .3, l = .7, a = .9, t = tan(25 * IMP_PI / 180),
                 film = 4 * t * t;
    struct tap_stat pose[6] = {{0, 0, 0}}, scale[1] = {{0, 0, 0}};
    const double at[6] = {.1, -.2, 0, a, 0, 0};
    size_t index;
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective'>"
        "<float name='fov' value='50'/><transform name='to_world'><lookat "
        "origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
        "<integer name='width' value='24'/><integer name='height' value='24'/><rfilter "
        "type='box'/></film></sensor><emitter type='constant'><rgb name='radiance' "
        "value='5'/></emitter><shape type='cylinder' id='tube'><float name='radius' "
        "value='.3'/><point name='p0' value='0,0,-.7'/><point name='p1' value='0,0,.7'/>"
        "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></shape></scene>",
        IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "tube.pose"));
    test_must(ctx, imp_scene_add_geometry(scene, "tube.scale"));
    test_must(ctx, imp_scene_find_param(scene, "tube.pose", &index));
    test_must(ctx, imp_scene_set_values(scene, index, 6, at));
    mean_gradient(ctx, scene, "tube.pose", 64, 16, pose);
    mean_gradient(ctx, scene, "tube.scale", 64, 16, scale);
    double ref[5];
    for (int k = 0; k < 4; k++) {
        double value[2];
        for (int s = 0; s < 2; s++) {
            const double by = s ? h : -h;
            const double e[3] = {at[0] + by * (k == 0), at[1] + by * (k == 1),
                                 at[2] + by * (k == 2)};
            value[s] = outline(r, l, a + by * (k == 3), e);
        }
        ref[k] = -5 * (value[1] - value[0]) / (2 * h * film);
    }
    ref[4] = -5 *
             (outline(r * (1 + h), l * (1 + h), a, at) -
              outline(r * (1 - h), l * (1 - h), a, at)) /
             (2 * h * film);
    static const char *const names[] = {"shifted", "shifted along it", "nearer",
                                        "turned"};
    for (int k = 0; k < 4; k++) {
        char what[64];
        snprintf(what, sizeof what, "a tube before a sky, %s", names[k]);
        tap_z(&pose[k], ref[k], 3e-3 * fabs(ref[4]), what);
    }
    tap_z(&scale[0], ref[4], 3e-3 * fabs(ref[4]), "a tube before a sky that grows");
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number numbers[] = {
        {"tube.pose", 0, .02}, {"tube.pose", 2, .02},   {"tube.pose", 3, .02},
        {"tube.pose", 5, .02}, {"camera.pose", 0, .02}, {"lamp.pose", 0, .04},
        {NULL, 0, 0}};
    static const struct number scale[] = {
        {"tube.scale", 0, .02}, {"sun.direction", 1, .02}, {NULL, 0, 0}};
    static const struct number glow[] = {{"tube.pose", 0, .02},
                                         {"tube.pose", 4, .02},
                                         {"block.pose", 5, .03},
                                         {NULL, 0, 0}};
    static const struct number still[] = {{"camera.pose", 0, .02},
                                          {"lamp.pose", 0, .04},
                                          {"block.pose", 0, .02},
                                          {NULL, 0, 0}};
    const int more = is_long ? 16 : 1;
    ctx = test_context(2);
    adjoint_make();
    outline_test();
    numbers_compare("a tube", room(DIRECT TUBE(THIN_PALE)), 32 * more, 48 * more, .1,
                    numbers);
    numbers_compare("a tube that grows in the sun", room(DIRECT SUN TUBE(THIN_PALE)),
                    32 * more, 48 * more, .1, scale);
    numbers_compare("a tube that shines", room(DIRECT TUBE(GLOW)), 64 * more, 48 * more,
                    .2, glow);
    numbers_compare("a can with a lid", room(DIRECT CAN), 32 * more, 48 * more, .1,
                    still);
    numbers_compare("copper under a sky", room(PATH SKY TUBE(METAL)), 16 * more,
                    16 * more, .4, is_long ? numbers : glow);
    if (is_long)
        numbers_compare("over bounces, under a sky", room(PATH SKY TUBE(THIN_PALE)),
                        32 * more, 64 * more, .1, numbers);
    number_refused("a lid that moves", room(DIRECT CAN), "lid.pose", "'side'");
    number_refused(
        "tubes on each other",
        room(DIRECT CAN
             "<shape type='cylinder' id='upper'><float name='radius' value='.5'/>"
             "<point name='p0' value='1.2,-.5,1.2'/><point name='p1' "
             "value='1.2,-.5,1.4'/></shape>"),
        "block.pose", "rim of shape");
    number_refused("a tube through a ball",
                   room(DIRECT TUBE(
                       THIN_PALE) "<shape type='sphere' id='ball'><float name='radius' "
                                  "value='.3'/><point name='center' value='1.5,-.6,1.1'/>"
                                  "</shape>"),
                   "block.pose", "passes through");
    number_refused(
        "a tube through the wall",
        room(DIRECT
             "<shape type='cylinder' id='pipe'><float name='radius' value='.2'/><point "
             "name='p0' value='2,2.5,2'/><point name='p1' value='2,3.5,2'/></shape>"),
        "block.pose", "passes through");
    number_refused(
        "an oval tube",
        room(DIRECT
             "<shape type='cylinder' id='oval'><transform name='to_world'><scale "
             "x='.2' y='.1' z='.3'/><translate x='1' y='-1' z='2'/></transform></shape>"),
        "block.pose", "'oval'");
    imp_context_destroy(ctx);
    return tap_done();
}
