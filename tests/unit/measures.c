/* SPDX-License-Identifier: Apache-2.0
 *
 * What one sample contributes to each channel: first-hit quantities of a tilted
 * parallelogram against its own plane geometry, moments, pixel formats, alpha. */
#include "color/rgb.h"
#include "film/film_measure.h"
#include "imp_scene.h"
#include "imp_tap.h"

static imp_context *ctx;

enum { W = 12, H = 8, SPP = 4 };
#define CHANNELS 64

/* A camera at (0, 0, 4) that looks along -z, 40 degrees across. */
static imp_scene *scene(const char *integrator, const char *format, const char *rest)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s<sensor type='perspective'>"
             "<float name='fov' value='40'/><transform name='to_world'>"
             "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
             "<film type='hdrfilm'><integer name='width' value='12'/>"
             "<integer name='height' value='8'/><string name='pixel_format' value='%s'/>"
             "<rfilter type='box'/></film></sensor>%s</scene>",
             integrator, format, rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}
#define TILTED                                                                           \
    "<shape type='sphere'><point name='center' x='0' y='0' z='-50'/>"                    \
    "<float name='radius' value='0.01'/></shape>"                                        \
    "<shape type='rectangle'><transform name='to_world'><matrix value='"                 \
    "0.69282032302755092 0.17320508075688773 0.5 0 0 0.5 0 0 "                           \
    "-0.4 -0.1 0.86602540378443865 0 0 0 0 1'/></transform><bsdf type='diffuse'><rgb "   \
    "name='reflectance' "                                                                \
    "value='.2,.4,.6'/></bsdf></shape>"

/* The same parallelogram, by hand: 0.8 across, 0.5 up and sheared by 0.2, turned by 30
 * degrees; where the ray through a film position meets its plane. */
struct meeting {
    imp_v3 d, p;
    double t, uv[2];
    bool inside;
};
static const imp_v3 across = {0.86602540378443865, 0, -0.5, 0}, up = {0, 1, 0, 0},
                    normal = {0.5, 0, 0.86602540378443865, 0};

static struct meeting meet(double px, double py)
{
    const double half = tan(20 * IMP_PI / 180);
    const imp_v3 o = imp__v3(0, 0, 4);
    struct meeting m;
    m.d = imp__normalize(
        imp__v3(-half * (1 - 2 * px / W), half * H / W * (1 - 2 * py / H), -1));
    m.t = -imp__dot(o, normal) / imp__dot(m.d, normal);
    m.p = o + m.d * m.t;
    m.uv[1] = imp__dot(m.p, up) + 0.5;
    m.uv[0] = (imp__dot(m.p, across) - 0.2 * (2 * m.uv[1] - 1)) / 1.6 + 0.5;
    m.inside = m.uv[0] > 0 && m.uv[0] < 1 && m.uv[1] > 0 && m.uv[1] < 1;
    return m;
}

static double off3(const double *value, imp_v3 ref)
{
    return imp__length(imp__v3(value[0], value[1], value[2]) - ref);
}

static void first_hits(void)
{
    static const char types[] =
        "<integrator type='aov'><string name='aovs' value='a:albedo,d:depth,p:position,"
        "u:uv,g:geo_normal,s:sh_normal,du:dp_du,dv:dp_dv,x:duv_dx,y:duv_dy,"
        "t:prim_index,o:shape_index'/></integrator>";
    static const char *const names[] = {"albedo", "depth",  "position", "uv",
                                        "normal", "normal", "dp_du",    "dp_dv",
                                        "duv_dx", "duv_dy", "shape",    "miss"};
    imp_scene *s = scene(types, "rgb", TILTED);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_measure m;
    struct imp_arena arena;
    double worst[12] = {0};
    int hits = 0, misses = 0;
    run.spp = SPP;
    test_must(ctx, imp__measure_create(s, &run, &m));
    tap_ok(m.n == 3 + 3 + 1 + 3 + 2 + 3 + 3 + 3 + 3 + 2 + 2 + 1 + 1 &&
               strncmp(m.names, "R,G,B,a.R,a.G,a.B,d.T,p.X,p.Y,p.Z,u.U,u.V,g.X", 44) == 0,
           "channels # %d: %s", m.n, m.names);
    imp__arena_init(&arena, ctx);
    for (int i = 0; i < W * H * SPP; i++) {
        double v[CHANNELS];
        struct imp_sample sample = {.x = i / SPP % W,
                                    .y = i / SPP / W,
                                    .index = i % SPP,
                                    .arena = &arena,
                                    .value = v};
        imp__measure_sample(&m, &sample);
        const double px = sample.px, py = sample.py;
        const double h = 1 / sqrt(SPP);
        const struct meeting at = meet(px, py), dx = meet(px + h, py),
                             dy = meet(px, py + h);
        if (!at.inside) {
            for (int c = 0; c < m.n; c++) worst[11] = fmax(worst[11], fabs(v[c]));
            misses++;
            continue;
        }
        const double *a = v + 3;
        double e[11] = {
            off3(a, imp__v3(.2, .4, .6)),
            fabs(a[3] - (at.t - 0.01 / -at.d[2])), /* from the near plane */
            off3(a + 4, at.p),
            hypot(a[7] - at.uv[0], a[8] - at.uv[1]),
            off3(a + 9, normal),
            off3(a + 12, normal),
            off3(a + 15, across * 1.6),
            off3(a + 18, up + across * 0.4),
            hypot(a[21] - (dx.uv[0] - at.uv[0]), a[22] - (dx.uv[1] - at.uv[1])),
            hypot(a[23] - (dy.uv[0] - at.uv[0]), a[24] - (dy.uv[1] - at.uv[1])),
            fabs(a[26] - 1) + (a[25] != 0 && a[25] != 1)};
        for (int k = 0; k < 11; k++) worst[k] = fmax(worst[k], e[k]);
        hits++;
    }
    tap_ok(hits > 50 && misses > 50, "the rectangle is met # %d of %d", hits,
           hits + misses);
    /* Hits on triangles come from Embree, in float. */
    for (int k = 0; k < 12; k++) tap_ok(worst[k] < 5e-6, "%s # %.1e", names[k], worst[k]);
    imp__arena_free(&arena);
    imp__measure_destroy(&m);
    imp_scene_destroy(s);
}

/* The value of the film's middle and of a corner, in a format. */
static void two_samples(const char *integrator, const char *format, const char *rest,
                        double middle[CHANNELS], double corner[CHANNELS], int *n)
{
    imp_scene *s = scene(integrator, format, rest);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_measure m;
    struct imp_arena arena;
    run.spp = 1;
    test_must(ctx, imp__measure_create(s, &run, &m));
    imp__arena_init(&arena, ctx);
    struct imp_sample in_middle = {
        .x = W / 2, .y = H / 2, .arena = &arena, .value = middle};
    struct imp_sample in_corner = {.arena = &arena, .value = corner};
    imp__measure_sample(&m, &in_middle);
    imp__measure_sample(&m, &in_corner);
    *n = m.n;
    imp__arena_free(&arena);
    imp__measure_destroy(&m);
    imp_scene_destroy(s);
}

#define GLOWING                                                                          \
    "<shape type='sphere'><emitter type='area'><rgb name='radiance' value='1,2,4'/>"     \
    "</emitter></shape>"
static const double glow[3] = {1, 2, 4};

static void formats(void)
{
    double v[CHANNELS], w[CHANNELS], xyz[3];
    int n;
    imp__rgb_to_xyz(glow, xyz);
    two_samples("<integrator type='path'/>", "rgba", GLOWING, v, w, &n);
    tap_ok(n == 4 && v[0] == 1 && v[1] == 2 && v[2] == 4 && v[3] == 1 && w[0] == 0 &&
               w[3] == 0,
           "rgba # %g %g %g %g", v[0], v[1], v[2], v[3]);
    two_samples("<integrator type='path'/>", "xyza", GLOWING, v, w, &n);
    tap_ok(n == 4 && fabs(v[0] - xyz[0]) < 1e-12 && fabs(v[1] - xyz[1]) < 1e-12 &&
               fabs(v[2] - xyz[2]) < 1e-12 && v[3] == 1 && w[3] == 0,
           "xyza # %g %g %g %g", v[0], v[1], v[2], v[3]);
    two_samples("<integrator type='path'/>", "luminance_alpha", GLOWING, v, w, &n);
    tap_ok(n == 2 && fabs(v[0] - imp__luminance(1, 2, 4)) < 1e-12 && v[1] == 1 &&
               w[1] == 0,
           "luminance_alpha # %g %g", v[0], v[1]);
    two_samples("<integrator type='depth'/>", "luminance_alpha", GLOWING, v, w, &n);
    tap_ok(n == 2 && fabs(v[0] - 3) < 0.05 && v[1] == 1 && w[0] == 0 && w[1] == 0,
           "depth # %g %g", v[0], v[1]);

    /* First and second moments of X, Y, Z, beside the picture. */
    two_samples(
        "<integrator type='moment'><integrator type='path' name='p'/></integrator>",
        "rgb", GLOWING, v, w, &n);
    bool right = n == 3 + 6;
    for (int c = 0; c < 3; c++)
        right &= v[c] == glow[c] && fabs(v[3 + c] - xyz[c]) < 1e-12 &&
                 fabs(v[6 + c] - xyz[c] * xyz[c]) < 1e-12 && w[6 + c] == 0;
    tap_ok(right, "moments # %g, %g", v[3], v[6]);
}

/* Alpha is 1 where a path found something; a sky makes all of them valid, unless walks
 * are not allowed to see anything; what is hidden is not there. */
static void alphas(void)
{
    static const struct {
        const char *integrator, *rest;
        double middle, corner;
    } cases[] = {
        {"<integrator type='path'/>", GLOWING, 1, 0},
        {"<integrator type='path'/>", GLOWING "<emitter type='constant'/>", 1, 1},
        {"<integrator type='path'><integer name='max_depth' value='0'/></integrator>",
         "<emitter type='constant'/>", 0, 0},
        {"<integrator type='path'><boolean name='hide_emitters' value='true'/>"
         "</integrator>",
         GLOWING "<emitter type='constant'/>", 0, 0},
        {"<integrator type='direct'/>", GLOWING "<emitter type='constant'/>", 1, 0},
        {"<integrator type='path'/>", "<shape type='sphere'/>", 1, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double v[CHANNELS], w[CHANNELS];
        int n;
        two_samples(cases[k].integrator, "rgba", cases[k].rest, v, w, &n);
        tap_ok(v[3] == cases[k].middle && w[3] == cases[k].corner, "alpha %zu # %g %g", k,
               v[3], w[3]);
    }
}

int main(void)
{
    ctx = test_context(1);
    first_hits();
    formats();
    alphas();
    imp_context_destroy(ctx);
    return tap_done();
}
