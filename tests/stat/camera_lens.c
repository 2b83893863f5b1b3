/* SPDX-License-Identifier: Apache-2.0
 *
 * Distortion of a camera's lens: rays against numbers of OpenCV 5.0 (projectPoints and
 * undistortPointsIter), light walks as the inverse of rays, a picture of a grid
 * beside the warped one of a pinhole, and light from all three ends. */
#include "film/film_picture.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <stdbool.h>
#include <unistd.h>

static imp_context *ctx;

#define NUMBER(name, value) "<float name='" name "' value='" value "'/>"
#define FILM(w, h, more)                                                                 \
    "<film type='hdrfilm'><integer name='width' value='" w "'/><integer name='height' "  \
    "value='" h "'/><rfilter type='box'/>" more "</film>"
#define CALIBRATED                                                                       \
    NUMBER("opencv_fx", "812.5")                                                         \
    NUMBER("opencv_fy", "798.75")                                                        \
    NUMBER("opencv_cx", "655.25") NUMBER("opencv_cy", "341.5")
#define BARREL                                                                           \
    NUMBER("opencv_k1", "-.28")                                                          \
    NUMBER("opencv_k2", ".09")                                                           \
    NUMBER("opencv_k3", "-.011")                                                         \
    NUMBER("opencv_p1", ".0012") NUMBER("opencv_p2", "-.0008")
#define PINCUSHION                                                                       \
    NUMBER("opencv_k1", ".11")                                                           \
    NUMBER("opencv_k2", "-.02")                                                          \
    NUMBER("opencv_k3", ".004") NUMBER("opencv_p1", "-.002") NUMBER("opencv_p2", ".003")
#define SCENE(sensors)                                                                   \
    "<scene version='3.0.0'><integrator type='path'/><shape type='sphere'/>" sensors     \
    "</scene>"
#define CAMERA(type, inside) "<sensor type='" type "'>" inside "</sensor>"

/* The ray through OpenCV's pixel (u, v), whose first pixel has its middle at 0. */
static imp_v3 direction(const struct imp_sensor *s, double u, double v)
{
    struct imp_sensor_ray ray;
    s->ops->ray(s, u + 0.5, v + 0.5, (double[2]){0.5, 0.5}, &ray);
    return ray.d * (1 / ray.d[2]);
}

static void calibrations(void)
{
    /* x and y of a ray (x, y, 1), and its pixel. */
    static const double barrel[][4] = {
        {0, 0, 655.25, 341.5},
        {.1, .05, 736.20539083251958, 381.30866326306153},
        {-.75, .4, 141.26498757348634, 611.4325839960859},
        {.7, -.4, 1138.7905960937501, 70.25276706249997},
        {-.3, -.35, 424.9878632446289, 77.769141613647491},
        {.75, .42, 1165.1919486970498, 623.20745427484974},
        {.4, 0, 966.11215679999998, 341.65336000000002},
        {0, -.4, 655.14599999999996, 36.051947392000045},
        {-1.0793930276023258, -0.57549421072234586, 0, 0},
        {1.0251458424309408, 0.62784805709626523, 1279, 719},
        {1.0182440051211659, -0.56843920194185549, 1279, 0},
        {-1.0848611964827433, 0.63420932121538165, 0, 719},
        {-0.47772539989292623, 0.35421010432879907, 300.5, 600.25},
        {0.31886297807192249, -0.32013074405750291, 900, 100}};
    static const double pincushion[][4] = {
        {.1, .05, 736.67443422851557, 381.4882958198242},
        {-.75, .4, 8.3658523525390365, 680.43549589346878},
        {.7, -.4, 1265.3675843749998, -1.3869207499999447},
        {-.3, -.35, 406.62859340820319, 55.416832300293038},
        {.4, 0, 986.97892479999996, 341.24439999999998},
        {0, -.4, 655.63999999999999, 15.768349311999941},
        {-0.75687399260067267, -0.39879480362062653, 0, 0},
        {0.71440815481371467, 0.44234476231257225, 1279, 719},
        {0.714471893774421, -0.39769811761134977, 1279, 0},
        {-0.75702467106935312, 0.44381615784859907, 0, 719},
        {-0.4265025430584522, 0.31637842325435939, 300.5, 600.25},
        {0.29437637115912019, -0.29563990086615255, 900, 100}};
    imp_scene *s = test_scene_text(
        ctx,
        SCENE(CAMERA("perspective", CALIBRATED BARREL FILM("1280", "720", ""))
                  CAMERA("perspective", CALIBRATED PINCUSHION FILM("1280", "720", ""))
                      CAMERA("thinlens", NUMBER("aperture_radius", "0")
                                             CALIBRATED BARREL FILM("1280", "720", ""))
                          CAMERA("perspective",
                                 CALIBRATED BARREL FILM(
                                     "320", "180",
                                     "") "<integer name='opencv_width' value='1280'/>"
                                         "<integer name='opencv_height' value='720'/>")),
        IMP_RGB);
    double worst[4] = {0};
    for (int k = 0; k < 4; k++) {
        const double(*rows)[4] = k == 1 ? pincushion : barrel;
        const int n = k == 1 ? 12 : 14;
        for (int i = 0; i < n; i++) { /* a film of a quarter: its pixels are 4 wide */
            const double *row = rows[i], u = row[2], v = row[3];
            const imp_v3 d = k < 3 ? direction(s->sensors[k], u, v)
                                   : direction(s->sensors[k], (u + 0.5) / 4 - 0.5,
                                               (v + 0.5) / 4 - 0.5);
            const double off = hypot(-d[0] - row[0], -d[1] - row[1]);
            if (!(off <= worst[k])) worst[k] = isnan(off) ? INFINITY : off;
        }
    }
    tap_ok(worst[0] < 1e-12, "barrel: rays of OpenCV's pixels # %.1e", worst[0]);
    tap_ok(worst[1] < 1e-12, "pincushion # %.1e", worst[1]);
    tap_ok(worst[2] < 1e-12, "a thin lens # %.1e", worst[2]);
    tap_ok(worst[3] < 1e-12, "a smaller picture than the calibrated one # %.1e",
           worst[3]);
    imp_scene_destroy(s);
}

/* What is connected to a point of a ray is that ray, and its weight is film area over the
 * solid angle that the rays of a small square have, at the point drawn on the lens. What
 * the polynomials fold back onto the film is not seen. */
static void inverses(const char *name, imp_scene *s)
{
    const struct imp_sensor *camera = s->sensors[0];
    double off = 0, weight = 0, unseen = 0, folded = 0;
    for (uint32_t i = 0; i < 4000; i++) {
        const struct imp_key key = imp__key(3, 0, i);
        const double h = 1e-3, px = imp__u01(key, 0) * camera->film.width,
                     py = imp__u01(key, 1) * camera->film.height;
        const double lens[4] = {imp__u01(key, 2), imp__u01(key, 3), 0.5, 0.5};
        struct imp_sensor_ray ray[5];
        struct imp_sensor_sample to = {.px = NAN};
        for (int k = 0; k < 5; k++)
            camera->ops->ray(camera,
                             px + (k == 1   ? h
                                   : k == 2 ? -h
                                            : 0),
                             py + (k == 3   ? h
                                   : k == 4 ? -h
                                            : 0),
                             lens, &ray[k]);
        const double far = 1 + 3 * imp__u01(key, 4);
        const imp_v3 ref = ray[0].o + ray[0].d * far;
        if (!camera->ops->connect(camera, &ref, false, lens, &to)) {
            unseen++;
            continue;
        }
        off = fmax(off, hypot(to.px - px, to.py - py));
        const imp_v3 a = ray[1].d - ray[2].d, b = ray[3].d - ray[4].d;
        const double angle = imp__length(imp__cross(a, b)) / (4 * h * h);
        /* From the lens point, a little before the near plane. */
        const double r = far + 1e-2 / ray[0].d[2];
        weight = fmax(weight, fabs(to.weight * angle * r * r - 1));
    }
    for (uint32_t i = 0; i < 4000; i++) { /* and beyond the fold, nothing */
        const struct imp_key key = imp__key(4, 0, i);
        const double angle = 2 * IMP_PI * imp__u01(key, 0), r = 2 + 8 * imp__u01(key, 1);
        const imp_v3 ref = imp__v3(r * cos(angle), r * sin(angle), 1);
        struct imp_sensor_sample to;
        folded +=
            camera->ops->connect(camera, &ref, false, (double[4]){.5, .5, .5, .5}, &to) &&
            to.px >= 0 && to.px <= camera->film.width && to.py >= 0 &&
            to.py <= camera->film.height;
    }
    tap_ok(unseen == 0 && off < 1e-9 && weight < 1e-6 && folded == 0,
           "%s: connected where its rays go # off %.1e px, weight %.1e", name, off,
           weight);
    imp_scene_destroy(s);
}

/* ---- Pictures ------------------------------------------------------------------- */

#define GRID   64
#define WIDTH  24
#define HEIGHT 18

/* A wall of light, a soft grid, seen at distance 1 from -1.2 to 1.2. */
static imp_scene *wall(const char *camera)
{
    static float pixels[3 * GRID * GRID];
    char xml[4096];
    for (int i = 0; i < GRID * GRID; i++)
        for (int c = 0; c < 3; c++)
            pixels[3 * i + c] = (float)(1 + 0.9 * sin(0.5 * (i % GRID) + c) *
                                                sin(0.5 * (i / GRID) + 2 * c));
    char path[] = "/tmp/importon-lens-XXXXXX.pfm";
    const int fd = mkstemps(path, 4);
    FILE *f = fd < 0 ? NULL : fdopen(fd, "wb");
    if (!f) exit(99);
    fprintf(f, "PF\n%d %d\n-1\n", GRID, GRID);
    fwrite(pixels, sizeof pixels, 1, f);
    fclose(f);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><shape type='rectangle'>"
             "<transform name='to_world'><scale value='1.2'/><rotate y='1' angle='180'/>"
             "<translate z='1'/></transform><emitter type='area'><texture type='bitmap' "
             "name='radiance'><string name='filename' value='%s'/><boolean name='raw' "
             "value='true'/></texture></emitter></shape>%s</scene>",
             path, camera);
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    unlink(path);
    return s;
}

static imp_film *render(imp_scene *s, int spp, enum imp_from from, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.points = IMP_POINTS_INDEPENDENT; /* z-scores are normal */
    run.seed = seed;
    run.from = from;
    test_must(ctx, imp_render(s, &run, &film));
    return film;
}

#define SHORT                                                                            \
    NUMBER("opencv_fx", "20") NUMBER("opencv_cx", "12.3") NUMBER("opencv_cy", "7.9")

/* The model once more, written for itself, and inverted by the fixed-point iteration of
 * OpenCV's documentation: x = (x'' - tangential(x)) / radial(x). */
static void undistort(const double seen[2], double at[2])
{
    at[0] = seen[0], at[1] = seen[1];
    for (int i = 0; i < 400; i++) {
        const double x = at[0], y = at[1], r2 = x * x + y * y;
        const double radial = 1 - 0.28 * r2 + 0.09 * r2 * r2 - 0.011 * r2 * r2 * r2;
        at[0] = (seen[0] - 2 * 0.0012 * x * y + 0.0008 * (r2 + 2 * x * x)) / radial;
        at[1] = (seen[1] - 0.0012 * (r2 + 2 * y * y) + 2 * 0.0008 * x * y) / radial;
    }
}

/* The pinhole's picture, sixteen times as fine, looked up where the lens puts each pixel. */
static void warped(void)
{
    enum { FINE = 16, PART = 12 };
    imp_scene *lens = wall(CAMERA("perspective", SHORT BARREL FILM("24", "18", "")));
    imp_scene *pinhole = wall(
        CAMERA("perspective", NUMBER("opencv_fx", "320") NUMBER("opencv_cx", "383.5")
                                  NUMBER("opencv_cy", "287.5") FILM("768", "576", "")));
    imp_film *a = render(lens, 256, IMP_FROM_SCENE, 1),
             *b = render(pinhole, 4, IMP_FROM_SCENE, 2);
    const float *A = imp_film_mean(a), *B = imp_film_mean(b), *se = imp_film_se(a);
    double z2 = 0, plain = 0, n = 0;
    for (int p = 0; p < WIDTH * HEIGHT; p++) {
        double mean[3] = {0}, still = 0;
        for (int k = 0; k < PART * PART; k++) {
            const double seen[2] = {(p % WIDTH + (k % PART + 0.5) / PART - 12.8) / 20,
                                    (p / WIDTH + (k / PART + 0.5) / PART - 8.4) / 20};
            double at[2];
            undistort(seen, at);
            const int x = (int)floor(320 * at[0] + 384),
                      y = (int)floor(320 * at[1] + 288);
            const int u = (int)floor(320 * seen[0] + 384),
                      v = (int)floor(320 * seen[1] + 288);
            if (x < 0 || y < 0 || x >= 768 || y >= 576) continue;
            for (int c = 0; c < 3; c++)
                mean[c] += (double)B[3 * (y * 768 + x) + c] / (PART * PART);
            still += (double)B[3 * (v * 768 + u)] / (PART * PART);
        }
        for (int c = 0; c < 3; c++, n++)
            z2 += pow(((double)A[3 * p + c] - mean[c]) /
                          hypot((double)se[3 * p + c], 0.004),
                      2);
        plain += pow((double)A[3 * p] - still, 2);
    }
    tap_ok(z2 / n < 1.3 && sqrt(plain / (WIDTH * HEIGHT)) > 0.1,
           "a grid is the pinhole's picture, warped # mean z^2 %.2f, rms without %.2f",
           z2 / n, sqrt(plain / (WIDTH * HEIGHT)));
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_scene_destroy(lens);
    imp_scene_destroy(pinhole);
}

#define ROOM(integrator, camera)                                                         \
    "<scene version='3.0.0'><integrator type='" integrator                               \
    "'><integer name='max_depth' value='4'/></integrator><shape type='cube'><transform " \
    "name='to_world'><scale value='2'/></transform><boolean name='flip_normals' "        \
    "value='true'/><bsdf type='diffuse'><rgb name='reflectance' value='.6,.5,.4'/>"      \
    "</bsdf></shape><shape type='rectangle'><transform name='to_world'><scale "          \
    "value='.6'/><rotate x='1' angle='90'/><translate y='1.95'/></transform><emitter "   \
    "type='area'><rgb name='radiance' value='5,4,3'/></emitter></shape><sensor "         \
    "type='" camera "<transform name='to_world'><lookat origin='0,0,-1.8' "              \
    "target='0,-.2,0' up='0,1,0'/></transform>"

#define SHORT_ROOM NUMBER("opencv_fx", "8") BARREL

static double values(imp_film *film, imp_film *other, double n)
{
    double z2 = 0;
    for (int i = 0; i < n; i++) {
        const double se =
            hypot((double)imp_film_se(film)[i], (double)imp_film_se(other)[i]);
        z2 += pow(((double)imp_film_mean(film)[i] - (double)imp_film_mean(other)[i]) / se,
                  2);
    }
    return z2 / n;
}

static void ends(const char *name, const char *xml)
{
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    imp_film *eye = render(s, 512, IMP_FROM_SENSOR, 1),
             *light = render(s, 2048, IMP_FROM_LIGHTS, 2),
             *both = render(s, 256, IMP_FROM_SCENE, 3);
    const double a = values(eye, light, 3 * 9 * 6), b = values(eye, both, 3 * 9 * 6);
    double sum[2] = {0}, variance = 0;
    for (int i = 0; i < 3 * 9 * 6; i++) {
        sum[0] += (double)imp_film_mean(eye)[i];
        sum[1] += (double)imp_film_mean(light)[i];
        variance +=
            pow((double)imp_film_se(eye)[i], 2) + pow((double)imp_film_se(light)[i], 2);
    }
    /* Channels share walks: three times the variance, at most. */
    const double z = (sum[1] - sum[0]) / sqrt(3 * variance);
    tap_ok(a < 1.6 && b < 1.6 && fabs(z) < 4,
           "%s: sensor, lights, both ends # mean z^2 %.2f, %.2f, sum %.3f z %.1f", name,
           a, b, sum[1] / sum[0], z);
    imp_film_destroy(eye);
    imp_film_destroy(light);
    imp_film_destroy(both);
    imp_scene_destroy(s);
}

/* A crop's pixels are the whole film's. */
static void crop(void)
{
    imp_scene *whole = wall(CAMERA("perspective", SHORT BARREL FILM("24", "18", "")));
    imp_scene *part = wall(CAMERA(
        "perspective",
        SHORT BARREL FILM("24", "18",
                          "<integer name='crop_offset_x' value='17'/><integer "
                          "name='crop_offset_y' value='1'/><integer name='crop_width' "
                          "value='6'/><integer name='crop_height' value='5'/>")));
    imp_film *a = render(whole, 64, IMP_FROM_SCENE, 1),
             *b = render(part, 64, IMP_FROM_SCENE, 2);
    double z2 = 0;
    for (int i = 0; i < 3 * 30; i++) {
        const int p = i / 3, at = 3 * ((1 + p / 6) * 24 + 17 + p % 6) + i % 3;
        z2 += pow(((double)imp_film_mean(a)[at] - (double)imp_film_mean(b)[i]) /
                      hypot((double)imp_film_se(a)[at], (double)imp_film_se(b)[i]),
                  2) /
              90;
    }
    tap_ok(z2 > 0.4 && z2 < 1.8, "a crop is part of the picture # mean z^2 %.2f", z2);
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_scene_destroy(whole);
    imp_scene_destroy(part);
}

static void refused(const char *camera, const char *words)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char xml[2048];
    imp_scene *s = NULL;
    snprintf(xml, sizeof xml, SCENE("%s"), camera);
    o.mode = IMP_RGB;
    const enum imp_status st =
        imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &s);
    tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), words), "refused: %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

#define FEW FILM("9", "6", "")
int main(void)
{
    ctx = test_context(2);
    calibrations();
    inverses("perspective, barrel",
             test_scene_text(
                 ctx,
                 SCENE(CAMERA("perspective", CALIBRATED BARREL FILM("1280", "720", ""))),
                 IMP_RGB));
    inverses("perspective, pincushion",
             test_scene_text(ctx,
                             SCENE(CAMERA("perspective",
                                          CALIBRATED PINCUSHION FILM("1280", "720", ""))),
                             IMP_RGB));
    inverses("thinlens, barrel",
             test_scene_text(
                 ctx,
                 SCENE(CAMERA("thinlens", NUMBER("aperture_radius",
                                                 ".2") NUMBER("focus_distance", "2")
                                              CALIBRATED BARREL FILM("1280", "720", ""))),
                 IMP_RGB));
    warped();
    crop();
    ends("perspective", ROOM("bdpt", "perspective'>") SHORT_ROOM FEW "</sensor></scene>");
    ends("thinlens", ROOM("bdpt", "thinlens'>") NUMBER("aperture_radius", ".1") NUMBER(
                         "focus_distance", "2") SHORT_ROOM FEW "</sensor></scene>");
    refused(CAMERA("perspective",
                   NUMBER("fov", "90") NUMBER("opencv_k1", "-.5") FILM("32", "32", "")),
            "opencv_k1 = -0.5 has no inverse in the picture");
    refused(CAMERA("perspective", NUMBER("opencv_cx", "3") FEW), "needs opencv_fx");
    refused(CAMERA("perspective", NUMBER("opencv_fx", "3") NUMBER("fov", "3") FEW),
            "give fov or opencv_fx");
    refused(
        CAMERA("thinlens", NUMBER("aperture_radius", "0") NUMBER("opencv_fx", "-3") FEW),
        "opencv_fx = -3 is outside (0, inf]");
    refused(CAMERA("perspective", NUMBER("opencv_k4", ".1") FEW), "opencv_k4");
    imp_context_destroy(ctx);
    return tap_done();
}
