/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves in a medium that fills the scene: a disk that glows and comes nearer
 * through a medium that absorbs, and one that scatters light once, against quadrature; a lamp without
 * a size above a floor; imp_problem_reverse against central differences in a room. What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define FOG(SIGMA, ALBEDO, PHASE)                                                        \
    "<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='" SIGMA              \
    "'/><rgb name='albedo' value='" ALBEDO "'/>" PHASE "</medium>"
#define FORWARD "<phase type='hg'><float name='g' value='.5'/></phase>"
/* A camera that sees next to nothing but the middle. */
#define NARROW                                                                           \
    "<sensor type='perspective'><float name='fov' value='.02'/><float "                  \
    "name='near_clip' value='1e-6'/><transform "                                         \
    "name='to_world'><lookat origin='0,0,3' target='0,0,0' up='0,1,0'/></transform>"     \
    "<ref name='medium' id='fog'/><film type='hdrfilm'><integer name='width' "           \
    "value='1'/><integer name='height' value='1'/><rfilter type='box'/></film></sensor>"
#define WIDE                                                                             \
    "<sensor type='perspective'><float name='fov' value='60'/><float name='near_clip' "  \
    "value='1e-6'/><transform name='to_world'><lookat origin='0,0,3' target='0,0,0' "    \
    "up='0,1,0'/></transform><ref name='medium' id='fog'/><film type='hdrfilm'>"         \
    "<integer name='width' value='16'/><integer name='height' value='16'/><rfilter "     \
    "type='box'/></film></sensor>"
#define DISK                                                                             \
    "<shape type='disk' id='disk'><emitter type='area'><rgb name='radiance' value='3'/>" \
    "</emitter></shape>"
#define SUNK                                                                             \
    "<shape type='sphere' id='ball'><float name='radius' value='.6'/><point "            \
    "name='center' x='1.1' y='-.7' z='.25'/><ref id='grey'/></shape>"
#define FLOOR                                                                            \
    "<shape type='rectangle' id='floor'><bsdf type='diffuse'><rgb name='reflectance' "   \
    "value='.5'/></bsdf></shape><emitter type='point' id='bulb'><point name='position' " \
    "value='0,0,2'/><rgb name='intensity' value='4'/></emitter>"

/* Light that a point at the height h above the plane of the disk, r beside its middle, scatters in
 * any direction if it scatters all: with directions (c, phi) to the disk, c their cosine,
 *
 *     3/(4 pi) int dphi int dc exp(-sigma h/c)
 */
static double disk_scattered(double h, double r, double sigma)
{
    enum { TURNS = 64, STEPS = 12 };
    double sum = 0;
    for (int i = 0; i < TURNS; i++) {
        const double phi = IMP_PI * (i + .5) / TURNS; /* and its mirror image */
        const double middle = -r * cos(phi), half2 = 1 - imp__sqr(r * sin(phi));
        if (half2 <= 0) continue;
        const double near = fmax(middle - sqrt(half2), 0), far = middle + sqrt(half2);
        if (far <= 0) continue;
        const double c0 = h / hypot(h, near), c1 = h / hypot(h, far);
        for (int k = 0; k < STEPS; k++)
            sum +=
                exp(-sigma * h / (c1 + (c0 - c1) * (k + .5) / STEPS)) * (c0 - c1) / STEPS;
    }
    return 3 / (4 * IMP_PI) * sum * 2 * IMP_PI / TURNS;
}

/* The mean of a picture of 60 degrees of the disk of radius 1 and radiance 3 at the distance D, in a
 * medium of which the part `albedo` scatters, once, and everywhere alike: what comes straight, and
 * what is scattered on the way to the disk's plane. */
static double disk_seen(double D, double sigma, double albedo)
{
    enum { RINGS = 400, ACROSS = 16, STEPS = 40 };
    const double wide = tan(IMP_PI / 6), edge = 1 / (D * wide);
    double straight = 0, scattered = 0;
    for (int k = 0; k < RINGS; k++) {
        const double x = edge * (k + .5) / RINGS;
        straight +=
            3 * exp(-sigma * D * hypot(1, x * wide)) * IMP_PI / 2 * x * edge / RINGS;
    }
    for (int i = 0; i < ACROSS * ACROSS; i++) {
        const double x =
            hypot((i % ACROSS + .5) / ACROSS, (i / ACROSS + .5) / ACROSS) * wide;
        const double length = D * hypot(1, x);
        for (int k = 0; k < STEPS; k++) {
            const double s = (k + .5) / STEPS; /* points near the plane vary fast */
            const double h = D * s * s, t = length * (1 - s * s);
            scattered += exp(-sigma * t) * disk_scattered(h, x * (D - h), sigma) * 2 * s *
                         length / STEPS / (ACROSS * ACROSS);
        }
    }
    return straight + albedo * sigma * scattered;
}

static void mean_test(const char *what, const char *objects, const char *name, int number,
                      int spp, double ref, double tolerance)
{
    mean_gradient_test(ctx, what, objects, name, number, spp, ref, tolerance * fabs(ref));
}

static void closed_test(int more)
{
    const double h = 1e-3;
    mean_test("a disk behind a medium that absorbs",
              FOG(".1", "0", "") VOLPATH("2") NARROW DISK, "disk.pose", 2, 4096,
              3 * .1 * exp(-.1 * 3), 5e-3);
    mean_test("a disk in a medium that scatters once",
              FOG(".4", ".9", "") VOLPATH("2") WIDE DISK, "disk.pose", 2, 16 * more,
              (disk_seen(3 - h, .4, .9) - disk_seen(3 + h, .4, .9)) / (2 * h), 1e-2);
    /* .5/pi 4/z^2 exp(-sigma (z + 3)). */
    mean_test("a lamp above a floor", FOG(".1", "0", "") VOLPATH("2") NARROW FLOOR,
              "bulb.position", 2, 4096,
              -(2 / 2. + .1) * .5 / IMP_PI * 4 / 4 * exp(-.1 * 5), 5e-3);
}

/* The room of moves_kit.h, with its camera in the medium. */
static imp_scene *room(const char *rest)
{
    char xml[16384], filled[16384];
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    const char *film = strstr(xml, "<film");
    snprintf(filled, sizeof filled, "%.*s<ref name='medium' id='fog'/>%s",
             (int)(film - xml), xml, film);
    return test_scene_text(ctx, filled, IMP_RGB);
}

static void refused_test(void)
{
    number_refused(
        "a lamp without a size",
        room(FOG(".2", ".5", "") VOLPATH("2") "<emitter type='point' id='bulb'/>"),
        "block.pose", "no size");
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    static const struct number few[] = {{"lamp.pose", 2, .03},
                                        {"camera.pose", 4, .01},
                                        {NULL, 0, 0}},
                               numbers[] = {{"block.pose", 3, .02},
                                            {"lamp.pose", 2, .03},
                                            {"camera.pose", 0, .02},
                                            {NULL, 0, 0}},
                               balls[] = {{"ball.pose", 2, .02},
                                          {"camera.pose", 0, .02},
                                          {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    closed_test(more);
    numbers_compare("absorbs", room(FOG(".12,.15,.2", "0", "") VOLPATH("3")), 32 * more,
                    64 * more, .03, few);
    numbers_compare("scatters", room(FOG(".12,.15,.2", ".8,.7,.6", FORWARD) VOLPATH("3")),
                    192 * more, 64 * more, .04, numbers);
    numbers_compare("a ball in the floor",
                    room(FOG(".12,.15,.2", "0", "") VOLPATH("3") SUNK), 32 * more,
                    64 * more, .1, balls);
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
