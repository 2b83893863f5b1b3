/* SPDX-License-Identifier: Apache-2.0
 *
 * The analytical cases 5.2 to 5.14 of CIE 171:2006, "Test cases to assess the accuracy of lighting
 * computer programs", with geometry of our own and the formulas derived here:
 *
 *     5.2   point light:                E = I cos/r^2
 *     5.3   area light:                 Lambert's polygon formula (below) times pi L
 *     5.4   flux through an opening:    what enters, pi L A, arrives on the inner surfaces
 *     5.5   pane under parallel light:  E0 cos (1 - R'), R' of both faces by Fresnel
 *     5.6   a lit diffuse surface:      its L = rho E0/pi over the polygon
 *     5.7   ... partly hidden:          less the polygon of what hides it
 *     5.8   closed diffuse sphere:      E = F/(S (1 - rho)), as each point lights all alike
 *     5.9 to 5.14  an opening to the sky: E = Int L(w) T(w) cos dw over what is seen through it
 *
 * Polygon formula: Int cos dw = 1/2 sum_i G_i . n, with G_i across the edge i and as long as the angle
 * under which it is seen (Lambert 1760). */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <stdarg.h>

static imp_context *ctx;
static bool is_long;
static char xml[1 << 15];
static size_t used;

static void put(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    used += (size_t)vsnprintf(xml + used, sizeof xml - used, format, args);
    va_end(args);
}
static void begin(const char *integrator)
{
    used = 0;
    put("<scene version='3.0.0'><integrator type='%s'/>", integrator);
}

/* Rectangles about (x, y, z) with half sides a and b: level, and across x (a upright, b along y). */
#define LEVEL   ""
#define UPRIGHT "<rotate y='1' angle='90'/>"
static void rectangle(const char *turn, double a, double b, double x, double y, double z,
                      const char *inside)
{
    put("<shape type='rectangle'><transform name='to_world'><scale x='%.12g' "
        "y='%.12g'/>%s"
        "<translate x='%.12g' y='%.12g' z='%.12g'/></transform>%s</shape>",
        a, b, turn, x, y, z, inside);
}
#define DIFFUSE(rho)                                                                     \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='" rho     \
    "'/></bsdf></bsdf>"
#define BLACK DIFFUSE("0")
#define PANE                                                                             \
    "<bsdf type='thindielectric'><float name='int_ior' value='1.5'/><float "             \
    "name='ext_ior' value='1'/></bsdf>"

/* A virtual point meter whose receiver looks along (fx, fy, fz). */
static void meter(double x, double y, double z, double fx, double fy, double fz)
{
    char inside[512];
    snprintf(inside, sizeof inside,
             "<sensor type='irradiancemeter'><boolean name='virtual' value='true'/>"
             "<string name='at' value='points'/><vector name='facing' x='%g' y='%g' "
             "z='%g'/><string name='units' value='photometric'/><film type='hdrfilm'>"
             "<integer name='width' value='1'/><integer name='height' value='1'/>"
             "<rfilter type='box'/></film></sensor>",
             fx, fy, fz);
    rectangle(LEVEL, .01, .01, x, y, z, inside);
}

static int openings(void) { return is_long ? 1 << 20 : 1 << 15; }

static struct imp_estimate read_mean(int sensor, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate mean;
    static double value[64], se[64];
    static char whole[sizeof xml + 16];
    snprintf(whole, sizeof whole, "%s</scene>", xml);
    imp_scene *s = test_scene_text(ctx, whole, IMP_MONO);
    run.spp = spp;
    run.sensor = sensor;
    test_must(ctx, imp_grid_read(s, &run, value, se, &mean, NULL));
    imp_scene_destroy(s);
    return mean;
}

/* 4.5 standard errors, as there are many cases, and of `long`, with thirty times the samples through
 * openings, half a percent. */
static void hold(const char *what, struct imp_estimate e, double truth)
{
    tap_ok(fabs(e.value - truth) <= 4.5 * e.se + 1e-6 * truth &&
               (!is_long || fabs(e.value - truth) <= .005 * truth) &&
               e.se < (is_long ? .005 : .03) * truth,
           "%s: %.5g +- %.2g of %.5g, z %.2f", what, e.value, e.se, truth,
           (e.value - truth) / (e.se + 1e-6 * truth));
}

/* ---- Configuration factors ----------------------------------------------------------- */

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}
static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Int cos dw / pi of a polygon before the plane of n at p. */
static double polygon(int corners, const double (*corner)[3], const double p[3],
                      const double n[3])
{
    double sum = 0;
    for (int i = 0; i < corners; i++) {
        double a[3], b[3], g[3];
        for (int k = 0; k < 3; k++) {
            a[k] = corner[i][k] - p[k];
            b[k] = corner[(i + 1) % corners][k] - p[k];
        }
        cross(a, b, g);
        const double length = sqrt(dot(g, g));
        sum += dot(g, n) / length * atan2(length, dot(a, b));
    }
    return fabs(sum) / (2 * M_PI);
}
/* A level square of half side a about (x, y, z). */
static double level_factor(double a, double x, double y, double z, const double p[3],
                           const double n[3])
{
    const double c[4][3] = {
        {x - a, y - a, z}, {x + a, y - a, z}, {x + a, y + a, z}, {x - a, y + a, z}};
    return polygon(4, c, p, n);
}

static double fresnel_pass(double c)
{
    const double t = sqrt(1 - (1 - c * c) / 2.25), rs = (c - 1.5 * t) / (c + 1.5 * t),
                 rp = (1.5 * c - t) / (1.5 * c + t), R = (rs * rs + rp * rp) / 2;
    return 1 - 2 * R / (1 + R);
}

/* ---- 5.2 to 5.8 ------------------------------------------------------------------------ */

static void lamps(void)
{
    for (int k = 0; k < 3; k++) {
        const double x = .7 * k, y = -.4 * k, r2 = x * x + y * y + 9;
        begin("path");
        put("<emitter type='point'><point name='position' x='0' y='0' z='3'/><rgb "
            "name='intensity' value='1000'/></emitter>");
        meter(x, y, 0, 0, 0, 1);
        hold("5.2 point light", read_mean(0, 64), 1000 * 3 / pow(r2, 1.5));
        begin("path");
        rectangle("<rotate x='1' angle='180'/>", 1, 1, 0, 0, 3,
                  "<emitter type='area'><rgb name='radiance' value='100'/></emitter>");
        meter(x, y, 0, 0, 0, 1);
        meter(-4, y, .5 * k, 1, 0, 0);
        const double up[3] = {0, 0, 1}, side[3] = {1, 0, 0}, p[3] = {x, y, 0},
                     q[3] = {-4, y, .5 * k};
        hold("5.3 area light, level", read_mean(0, 16384),
             100 * M_PI * level_factor(1, 0, 0, 3, p, up));
        hold("5.3 area light, upright", read_mean(1, 16384),
             100 * M_PI * level_factor(1, 0, 0, 3, q, side));
    }
}

static void flux(void)
{
    /* A box without a roof, 4 x 4 x 3, below a sky of radiance 10; two of its four walls. */
    double sum = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        char inside[512];
        begin("path");
        put("<emitter type='constant'><rgb name='radiance' value='10'/></emitter>");
        snprintf(
            inside, sizeof inside,
            "%s<sensor type='irradiancemeter'><string name='units' "
            "value='photometric'/><film type='hdrfilm'><integer name='width' "
            "value='4'/><integer name='height' value='4'/><rfilter type='box'/></film>"
            "</sensor>",
            BLACK);
        rectangle(LEVEL, 2, 2, 0, 0, 0, k == 0 ? inside : BLACK);
        rectangle("<rotate y='1' angle='90'/>", 1.5, 2, -2, 0, 1.5,
                  k == 1 ? inside : BLACK);
        rectangle("<rotate y='1' angle='-90'/>", 1.5, 2, 2, 0, 1.5,
                  k == 2 ? inside : BLACK);
        rectangle("<rotate x='1' angle='90'/>", 2, 1.5, 0, 2, 1.5, BLACK);
        rectangle("<rotate x='1' angle='90'/>", 2, 1.5, 0, -2, 1.5, BLACK);
        const struct imp_estimate e = read_mean(0, 16384);
        const double area = k ? 2 * 12 : 16; /* a wall counts for its neighbour, too */
        sum += area * e.value;
        square += area * area * e.se * e.se;
    }
    hold("5.4 flux", (struct imp_estimate){.value = sum, .se = sqrt(square)},
         10 * M_PI * 16);
}

static void pane_and_surfaces(void)
{
    for (int k = 0; k < 4; k++) {
        const double angle = 20. * k * M_PI / 180;
        begin("volpath");
        put("<emitter type='directional'><vector name='direction' x='%.12g' y='0' "
            "z='%.12g'/><rgb name='irradiance' value='100'/></emitter>",
            sin(angle), -cos(angle));
        rectangle(LEVEL, 100, 100, 0, 0, 1, PANE);
        meter(0, 0, 0, 0, 0, 1);
        hold("5.5 clear glass", read_mean(0, 64),
             100 * cos(angle) * fresnel_pass(cos(angle)));
    }
    const double down[3] = {0, 0, -1}, side[3] = {1, 0, 0};
    for (int hidden = 0; hidden < 2; hidden++) {
        const double p[3] = {.2, .1, 3}, q[3] = {-2.5, .3, 1};
        begin("path");
        put("<emitter type='directional'><vector name='direction' x='0' y='0' z='-1'/>"
            "<rgb name='irradiance' value='100'/></emitter>");
        rectangle(LEVEL, 2, 2, 0, 0, 0, DIFFUSE(".3"));
        /* Seen from p it hides [-.85, .65] x [-.8, .7] of the surface, and its shadow. */
        if (hidden) rectangle(LEVEL, .5, .5, 0, 0, 1, BLACK);
        meter(p[0], p[1], p[2], 0, 0, -1);
        meter(q[0], q[1], q[2], 1, 0, 0);
        double F = level_factor(2, 0, 0, 0, p, down);
        if (hidden) F -= level_factor(.5, 0, 0, 1, p, down);
        hold(hidden ? "5.7 hidden in part" : "5.6 diffuse reflection, level",
             read_mean(0, is_long ? 1 << 19 : 1 << 16), 30 * F);
        if (!hidden)
            hold("5.6 diffuse reflection, upright",
                 read_mean(1, is_long ? 1 << 19 : 1 << 16),
                 30 * level_factor(2, 0, 0, 0, q, side));
    }
}

static void sphere(void)
{
    for (int k = 1; k < 9; k += 3) {
        const double rho = .1 * k;
        begin("path");
        put("<emitter type='point'><rgb name='intensity' value='100'/></emitter>"
            "<shape type='sphere'><float name='radius' value='2'/><boolean "
            "name='flip_normals' value='true'/><bsdf type='diffuse'><rgb "
            "name='reflectance' value='%g'/></bsdf><sensor "
            "type='irradiancemeter'><string "
            "name='units' value='photometric'/><film type='hdrfilm'><integer "
            "name='width' "
            "value='1'/><integer name='height' value='1'/><rfilter "
            "type='box'/></film></sensor></shape>",
            rho);
        hold("5.8 a closed sphere", read_mean(0, 1 << 16), 100. / 4 / (1 - rho));
    }
}

/* ---- 5.9 to 5.14: openings ------------------------------------------------------------- */

/* Skies of CIE S 011: a to e, and 16: the old overcast sky, (1 + 2 cos Z)/3. */
struct sky {
    int type;
    double n[5];
};
static const struct sky skies[] = {{5, {0, -1, 0, -1, 0}},
                                   {1, {4, -.7, 0, -1, 0}},
                                   {12, {-1, -.32, 10, -3, .45}},
                                   {16, {0}}};
static const double sun[3] = {.6, .48, .64};
enum { LUX = 10000, GROUND = 800 };

static double relative(const struct sky *s, const double w[3])
{
    if (s->type == 16) return (1 + 2 * w[2]) / 3;
    const double x = acos(fmin(fmax(dot(w, sun), -1), 1));
    return (1 + s->n[0] * exp(s->n[1] / w[2])) *
           (1 + s->n[2] * (exp(s->n[3] * x) - exp(s->n[3] * M_PI / 2)) +
            s->n[4] * cos(x) * cos(x));
}
static double level_light(const struct sky *s)
{
    enum { UP = 200, AROUND = 400 };
    double sum = 0;
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double z2 = (i + .5) / UP, a = 2 * M_PI * (j + .5) / AROUND;
            const double w[3] = {sqrt(1 - z2) * cos(a), sqrt(1 - z2) * sin(a), sqrt(z2)};
            sum += relative(s, w);
        }
    return sum * M_PI / (UP * AROUND);
}

/* Through [a0, a1] x [b0, b1]: of the roof z = at (over x, y), or of the facade x = at (over y, z),
 * from p with receiver n; below the horizon is ground of radiance GROUND. */
static double through(const struct sky *s, bool roof, double at, const double a[2],
                      const double b[2], const double p[3], const double n[3], bool glass)
{
    enum { N = 400 };
    const double scale = LUX / level_light(s);
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double u = a[0] + (a[1] - a[0]) * (i + .5) / N,
                         v = b[0] + (b[1] - b[0]) * (j + .5) / N;
            double d[3] = {roof ? u : at, roof ? v : u, roof ? at : v};
            for (int k = 0; k < 3; k++) d[k] -= p[k];
            const double r = sqrt(dot(d, d));
            for (int k = 0; k < 3; k++) d[k] /= r;
            const double across = roof ? d[2] : d[0];
            const double L = d[2] > 0 ? scale * relative(s, d) : GROUND;
            sum += L * fmax(dot(d, n), 0) * across / (r * r) *
                   (glass ? fresnel_pass(across) : 1);
        }
    return sum * (a[1] - a[0]) * (b[1] - b[0]) / (N * N);
}

static void sky_put(const struct sky *s)
{
    put("<emitter type='ciesky'><integer name='sky' value='%d'/><float "
        "name='illuminance' value='%d'/><vector name='sun_direction' x='%g' y='%g' "
        "z='%g'/></emitter>",
        s->type, LUX, sun[0], sun[1], sun[2]);
}

/* A black plane with an opening: four rectangles about it. */
static void screen(bool roof, double at, const double a[2], const double b[2])
{
    enum { FAR = 4000 };
    const double lo[4][2] = {{-FAR, -FAR}, {a[1], -FAR}, {a[0], -FAR}, {a[0], b[1]}};
    const double hi[4][2] = {{a[0], FAR}, {FAR, FAR}, {a[1], b[0]}, {a[1], FAR}};
    for (int k = 0; k < 4; k++) {
        const double ha = (hi[k][0] - lo[k][0]) / 2, hb = (hi[k][1] - lo[k][1]) / 2;
        const double ca = lo[k][0] + ha, cb = lo[k][1] + hb;
        if (roof) rectangle(LEVEL, ha, hb, ca, cb, at, BLACK);
        else rectangle(UPRIGHT, hb, ha, at, ca, cb, BLACK);
    }
}

static void roofs(void)
{
    const double a[2] = {-.5, .7}, b[2] = {-.6, .5}, p[3] = {.9, -.4, 0},
                 up[3] = {0, 0, 1};
    for (int glass = 0; glass < 2; glass++)
        for (int k = 0; k < 4; k++) {
            begin("volpath");
            sky_put(&skies[k]);
            screen(true, 2, a, b);
            if (glass)
                rectangle(LEVEL, (a[1] - a[0]) / 2, (b[1] - b[0]) / 2, (a[0] + a[1]) / 2,
                          (b[0] + b[1]) / 2, 2, PANE);
            meter(p[0], p[1], p[2], 0, 0, 1);
            char what[64];
            snprintf(what, sizeof what, "%s roof opening, sky %d",
                     glass ? "5.10 glazed" : "5.9", skies[k].type);
            hold(what, read_mean(0, openings()),
                 through(&skies[k], true, 2, a, b, p, up, glass));
        }
}

/* A facade at x = 3 with an opening from sill to head; masks beyond it, without end along y: an
 * overhang of depth 1 at height 2.5, a building 6 away and 3.5 high. */
static void facades(void)
{
    enum { OPEN, GLAZED, OVERHANG, OPPOSITE };
    static const char *const name[] = {
        "5.11 facade opening", "5.12 glazed facade opening", "5.13 below an overhang",
        "5.14 opposite a building"};
    const double D = 3, a[2] = {-1, 1.2}, p[3] = {0, .3, 1.1}, n[3] = {1, 0, 0};
    for (int c = OPEN; c <= OPPOSITE; c++)
        for (int k = 1; k < 4; k += 2) {
            double b[2] = {.9, 2.4};
            begin("volpath");
            sky_put(&skies[k]);
            screen(false, D, a, b);
            rectangle(LEVEL, 20000, 20000, 20000 + D, 0, -1e-3,
                      "<emitter type='area'><rgb name='radiance' "
                      "value='800'/></emitter>" BLACK);
            rectangle(UPRIGHT, 4000, 4000, -1, 0, 0, BLACK); /* what a pane mirrors */
            if (c == GLAZED) rectangle(UPRIGHT, .75, 1.1, D, .1, 1.65, PANE);
            if (c == OVERHANG) rectangle(LEVEL, .5, 4000, D + .5, 0, 2.5, BLACK);
            if (c == OPPOSITE) rectangle(UPRIGHT, 1.75, 2000, D + 6, 0, 1.75, BLACK);
            meter(p[0], p[1], p[2], n[0], n[1], n[2]);
            /* Lines on the facade beyond which the mask is seen; below the building is
             * ground as far as its foot. */
            const double over = p[2] + (2.5 - p[2]) * D / (D + 1);
            const double foot = p[2] - p[2] * D / (D + 6);
            const double top = p[2] + (3.5 - p[2]) * D / (D + 6);
            double truth = 0;
            if (c == OVERHANG) b[1] = fmin(b[1], over);
            if (c == OPPOSITE) {
                const double low[2] = {b[0], fmax(b[0], foot)};
                truth = through(&skies[k], false, D, a, low, p, n, false);
                b[0] = fmax(b[0], fmin(top, b[1]));
            }
            truth += through(&skies[k], false, D, a, b, p, n, c == GLAZED);
            char what[64];
            snprintf(what, sizeof what, "%s, sky %d", name[c], skies[k].type);
            hold(what, read_mean(0, openings()), truth);
        }
}

int main(int argc, char **argv)
{
    is_long = tap_is_long(argc, argv);
    ctx = test_context(0);
    lamps();
    flux();
    pane_and_surfaces();
    sphere();
    roofs();
    facades();
    imp_context_destroy(ctx);
    return tap_done();
}
