/* SPDX-License-Identifier: Apache-2.0
 *
 * Where mixtures of densities pay, and where they do not: a lamp in a parabolic reflector,
 * aimed at by its bulb and by its opening; a lamp behind glass; a diffuse box with a small
 * lamp, against path tracing; directions that split, against one direction. Variances per
 * walk and rays per walk are printed; means agree. */
#include "math/warp.h"
#include "photon_walks.h"

static imp_context *ctx;
static int more = 1; /* times as many walks, with the argument "long" */

static double relative_variance(const struct photon_mean *m)
{
    return photon_variance(m) / (m->L.mean * m->L.mean);
}

/* ---- A paraboloid z = r^2/4f ------------------------------------------------------- */

enum { RINGS = 48, SIDES = 192 };

/* Focal length f, out to radius r, smooth normals towards the axis. */
static void paraboloid(imp_scene *s, double f, double r)
{
    static float position[3 * (RINGS * SIDES + 1)], normal[3 * (RINGS * SIDES + 1)];
    static uint32_t index[3 * (2 * RINGS - 1) * SIDES];
    size_t n = 0, k = 0;
    for (int i = 0; i <= RINGS; i++)
        for (int j = 0; j < (i ? SIDES : 1); j++, n++) {
            const double a = IMP_2PI * j / SIDES, x = r * i / RINGS * cos(a),
                         y = r * i / RINGS * sin(a);
            const double length = sqrt(x * x + y * y + 4 * f * f);
            const double p[3] = {x, y, (x * x + y * y) / (4 * f)};
            const double q[3] = {-x / length, -y / length, 2 * f / length};
            for (int c = 0; c < 3; c++) {
                position[3 * n + (size_t)c] = (float)p[c];
                normal[3 * n + (size_t)c] = (float)q[c];
            }
        }
    for (uint32_t i = 0; i < RINGS; i++)
        for (uint32_t j = 0; j < SIDES; j++) {
            const uint32_t next = (j + 1) % SIDES, out = 1 + i * SIDES;
            const uint32_t in = i ? out - SIDES : 0;
            const uint32_t outer[3] = {i ? in + j : 0, out + j, out + next};
            const uint32_t inner[3] = {in + j, out + next, in + next};
            memcpy(index + 3 * k++, outer, sizeof outer);
            if (i) memcpy(index + 3 * k++, inner, sizeof inner);
        }
    imp_scene_mesh(s, n, k, position, normal, NULL, index);
}

enum aim { NOTHING, BULB, OPENING };

/* Reflectivity 0.9, a bulb of radius 0.01 and radiance 1 in the focus at z = 0.05, an
 * opening of radius 0.1 at the same height; a white spot at z = 5 faces it. */
static imp_scene *reflector_make(enum aim aim)
{
    const double at_spot[16] = {.02, 0, 0, 0, 0, -.02, 0, 0, 0, 0, -.02, 5, 0, 0, 0, 1};
    const double opening[16] = {.1, 0, 0, 0, 0, .1, 0, 0, 0, 0, .1, .05, 0, 0, 0, 1};
    /* From (2, 0, 3) towards the spot. */
    const double h = sqrt(.5),
                 camera[16] = {0, -h, -h, 2, -1, 0, 0, 0, 0, -h, h, 3, 0, 0, 0, 1};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "photons", NULL, NULL);
    imp_scene_float(s, "h", 2); /* the mirror absorbs nothing: weights alone */
    imp_scene_string(s, "weights", aim == NOTHING ? "kernel=1" : "kernel=1,emitters=1");
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", .05);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 1);
    imp_scene_integer(s, "height", 1);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "mesh", NULL, NULL);
    paraboloid(s, .05, .1);
    imp_scene_begin(s, "bsdf", "conductor", NULL, NULL);
    imp_scene_float(s, "specular_reflectance", .9);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_vector(s, "center", (double[3]){0, 0, .05});
    imp_scene_float(s, "radius", .01);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_float(s, "radiance", 1);
    if (aim == OPENING) {
        imp_scene_begin(s, "shape", "disk", NULL, "proxy");
        imp_scene_transform(s, "to_world", opening);
        imp_scene_end(s);
    }
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world", at_spot);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_float(s, "reflectance", 1);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static void reflector(void)
{
    static const char *const name[] = {"cosine", "cosine and bulb", "cosine and opening"};
    /* Variance of one sample over the squared mean: 1/2 cos + 1/2 towards a target of
     * which a share of the light comes. */
    static const double expected[] = {2.45e3, 4.84e3, 1.00};
    const double E = 1.15477e-3;
    struct photon_mean m[3];
    for (int aim = 0; aim < 3; aim++) {
        struct photons p = photons_open(ctx, reflector_make((enum aim)aim), 6);
        struct tap_stat aimed = {0};
        const int64_t n = (aim == OPENING ? 300000 : 600000) * (int64_t)more;
        memset(&m[aim], 0, sizeof m[aim]);
        for (int64_t k = 0; k < n; k++) {
            const struct imp_arena_mark mark = imp__arena_mark(&p.arena);
            const struct imp_walk walk = photons_trace(&p, k);
            const double irradiance = walk.L[0] * IMP_PI;
            tap_add(&m[aim].L, irradiance);
            tap_add(&aimed, walk.first && walk.first->d.drawn == IMP_DENSITY_EMITTERS
                                ? irradiance
                                : 0);
            imp__arena_rewind(&p.arena, mark);
        }
        const double se = tap_se(&m[aim].L), z = (m[aim].L.mean - E) / se;
        tap_ok(fabs(z) <= 4 && (aim != OPENING || se < 2.1e-3 * E / sqrt(more)),
               "irradiance, %s # %.6g se %.2g ref %.6g z %.2f", name[aim], m[aim].L.mean,
               se, E, z);
        tap_near(relative_variance(&m[aim]), expected[aim], aim == OPENING ? .03 : .4, 0,
                 "its relative variance");
        printf("#   towards the %s: %.4f of the energy\n",
               aim == OPENING ? "opening" : "bulb", aimed.mean / m[aim].L.mean);
        if (aim == BULB)
            tap_ok(aimed.mean < .03 * m[aim].L.mean,
                   "the bulb is a bad aim # %.4f of the energy",
                   aimed.mean / m[aim].L.mean);
        photons_close(&p);
    }
    const double ratio = photon_variance(&m[BULB]) / photon_variance(&m[OPENING]);
    tap_ok(ratio >= 1000, "the opening at equal samples: error squared / %.0f", ratio);
}

/* ---- A lamp behind glass ----------------------------------------------------------- */

#define COVERED                                                                          \
    "<scene version='3.0.0'><integrator type='%s'>%s</integrator><sensor "               \
    "type='perspective'><float name='fov' value='4'/><transform name='to_world'>"        \
    "<lookat origin='0,2,6' target='0,0,0' up='0,1,0'/></transform><film "               \
    "type='hdrfilm'><integer name='width' value='4'/><integer name='height' value='4'/>" \
    "<rfilter type='box'/></film></sensor><shape type='rectangle'><transform "           \
    "name='to_world'><rotate x='1' angle='-90'/><scale value='3'/></transform><bsdf "    \
    "type='diffuse' id='floor'><float name='reflectance' value='.8'/></bsdf></shape>"    \
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"      \
    "<scale value='.15'/><translate y='2'/></transform><emitter type='area' id='lamp'>"  \
    "<float name='radiance' value='20'/>%s</emitter></shape><shape type='cube' "         \
    "id='cover'><transform name='to_world'><scale x='.4' y='.02' z='.4'/><translate "    \
    "y='1.9'/></transform><bsdf type='dielectric'/></shape></scene>"

static struct photon_mean covered(const char *type, const char *inside,
                                  const char *in_lamp, int64_t n)
{
    char xml[2048];
    snprintf(xml, sizeof xml, COVERED, type, inside, in_lamp);
    struct photons p = photons_open(ctx, test_scene_text(ctx, xml, IMP_MONO), 8);
    const struct photon_mean m = photons_mean(&p, n * more);
    photons_close(&p);
    return m;
}

static void cover(void)
{
    const char *depth = "<integer name='max_depth' value='7'/>";
    const char *aimed = "<integer name='max_depth' value='7'/><string name='weights' "
                        "value='kernel=1,emitters=3'/>";
    const struct photon_mean brute = covered("path", depth, "", 400000);
    const struct photon_mean lamp = covered("photons", aimed, "", 200000);
    const struct photon_mean proxy =
        covered("photons", aimed, "<ref id='cover' name='proxy'/>", 200000);
    const struct photon_mean next_event =
        covered("direct", "<integer name='bsdf_samples' value='0'/>", "", 10000);
    tap_same(&lamp.L, &brute.L, "a lamp behind glass, aimed at");
    tap_same(&proxy.L, &brute.L, "its cover, aimed at");
    tap_ok(tap_se(&brute.L) < .025 * brute.L.mean && tap_se(&lamp.L) < .01 * lamp.L.mean,
           "and the errors are small # se %.4f, %.4f", tap_se(&brute.L) / brute.L.mean,
           tap_se(&lamp.L) / lamp.L.mean);
    printf("#   relative variance of a walk: kernel alone %.1f, lamp %.2f, cover %.2f\n",
           relative_variance(&brute), relative_variance(&lamp),
           relative_variance(&proxy));
    tap_ok(next_event.L.mean == 0 && lamp.L.mean > .05,
           "connections alone show a shadow # %g", next_event.L.mean);
}

/* ---- A diffuse box ------------------------------------------------------------------ */

static struct photon_mean box(const char *type, double h, const char *weights, int split,
                              int64_t n)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[1024], integrator[64];
    const char *list[] = {"res=16", integrator};
    imp_scene *scene;
    snprintf(path, sizeof path, "%s/cornell.xml", IMP_SCENES);
    snprintf(integrator, sizeof integrator, "integrator=%s", type);
    o.mode = IMP_MONO;
    o.defines = list;
    o.n_defines = 2;
    o.weights = weights;
    test_must(ctx, imp_scene_load(ctx, path, &o, &scene));
    struct imp_walk_integrator *settings = scene->integrator->self;
    settings->h = h;
    settings->split = split;
    struct photons p = photons_open(ctx, scene, 9);
    const int64_t pixels = (int64_t)p.width * p.height;
    /* The mean of the pixels' variances: what a picture's error is made of. */
    struct photon_mean sum = {{0}, 0, 0};
    struct tap_stat mean = {0};
    double variance = 0;
    for (int64_t i = 0; i < pixels; i++) {
        struct tap_stat pixel = {0};
        for (int64_t k = 0; k < n; k++) {
            const struct imp_arena_mark mark = imp__arena_mark(&p.arena);
            const struct imp_walk walk = photons_trace(&p, k * pixels + i);
            const double parts = 1. / (double)(n * pixels);
            double segments = 1, shadows = 0;
            photons_rays(&walk, &segments, &shadows);
            sum.segments += segments * parts;
            sum.shadows += shadows * parts;
            const struct imp_vertex *seen = walk.first;
            if (seen && !seen->shape) seen = seen->next; /* behind the sensor itself */
            if (!seen || seen->d.met.emitter < 0) tap_add(&pixel, walk.L[0]);
            imp__arena_rewind(&p.arena, mark);
        }
        if (pixel.n < 2) continue; /* the lamp itself */
        variance += pixel.m2 / (pixel.n - 1);
        tap_add(&mean, pixel.mean);
    }
    /* n walks a pixel; their mean over the picture has the error of the variances. */
    sum.L = (struct tap_stat){.n = mean.n * (double)n, .mean = mean.mean};
    sum.L.m2 = variance / mean.n * (sum.L.n - 1);
    photons_close(&p);
    return sum;
}

static void cost_print(const char *name, const struct photon_mean *m,
                       const struct photon_mean *to)
{
    const double v = photon_variance(m) / photon_variance(to),
                 rays = (m->segments + m->shadows) / (to->segments + to->shadows);
    printf("#   %-34s %.4f of %.4f, paths x %.2f, rays a path %.2f (%.2f shadow), rays x "
           "%.2f\n",
           name, m->L.mean, to->L.mean, v, m->segments + m->shadows, m->shadows,
           v * rays);
}

static void boxes(void)
{
    const int64_t n = 200 * more;
    const struct photon_mean path = box("path", 1, "kernel=1", 0, n);
    const struct photon_mean photons = box("photons", 1, "kernel=1,emitters=1", 0, 4 * n);
    const struct photon_mean split1 = box("photons", 1, "kernel=1,emitters=1", 1, 2 * n);
    const struct photon_mean split2 = box("photons", 1, "kernel=1,emitters=1", 2, n);
    const struct photon_mean split6 = box("photons", 1, "kernel=1,emitters=1", 6, n / 2);
    const struct photon_mean both = box("path", 1, "kernel=1,emitters=1", 1, n);
    const struct photon_mean all = box("photons", 1e9, "kernel=1,emitters=1", 0, 4 * n);
    tap_same(&photons.L, &path.L, "Cornell box, photons and path");
    tap_same(&all.L, &path.L, "photons that are not absorbed");
    tap_same(&split1.L, &path.L, "split for one bounce");
    tap_same(&split2.L, &path.L, "split for two");
    tap_same(&split6.L, &path.L, "split for six");
    tap_same(&both.L, &path.L, "connections and a split mixture");
    printf("# for the same error as the path tracer:\n");
    cost_print("path", &path, &path);
    cost_print("photons, h 1", &photons, &path);
    cost_print("photons, no absorption", &all, &path);
    cost_print("photons, split 1", &split1, &path);
    cost_print("photons, split 2", &split2, &path);
    cost_print("photons, split 6", &split6, &path);
    cost_print("path and mixture, split 1", &both, &path);
    const double paths = photon_variance(&photons) / photon_variance(&path);
    const double rays = paths * photons.segments / (path.segments + path.shadows);
    tap_ok(paths > 5 && paths < 20 && rays > 2.5 && rays < 10,
           "about ten times the paths, five times the rays # %.1f, %.1f", paths, rays);
    tap_ok(photon_variance(&split1) < photon_variance(&photons),
           "a split path has less variance");
    /* ME8: "the advantage is slight", said of equal time. At equal rays it is not. */
    const double gain = photon_variance(&photons) * photons.segments /
                        (photon_variance(&split6) * split6.segments);
    tap_ok(gain > 1.5, "ME8: of equal rays MIS makes more than a mixture # %.2f times",
           gain);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "long") == 0) more = 40;
    ctx = test_context(1);
    reflector();
    cover();
    boxes();
    imp_context_destroy(ctx);
    return tap_done();
}
