/* SPDX-License-Identifier: Apache-2.0
 *
 * Sensors against the formulas of docs/scene-format.md 9 (written out again here), fields
 * of view, films, samplers, filters, and every error rule. */
#include "film/film_picture.h"
#include "imp_tap.h"
#include "kind/filter/filter.h"
#include "kind/sensor/sensor_film.h"
#include "math/rng.h"
#include "shape_nodes.h"

static imp_context *ctx;
static int warnings;
static void count_warning(enum imp_log_level level, const char *message, void *payload)
{
    (void)message, (void)payload;
    warnings += level == IMP_LOG_WARNING;
}

static enum imp_status sensor_status;
static struct imp_sensor *sensor_build(struct imp_node *n, int w, int h)
{
    const struct imp_build b = {.ctx = ctx, .node = n, .arena = &world.arena};
    const struct imp_sensor_ops *ops = NULL;
    for (int i = 0; imp__sensor_kinds[i]; i++)
        if (strcmp(imp__sensor_kinds[i]->name, n->type) == 0) ops = imp__sensor_kinds[i];
    struct imp_sensor *s = imp__arena_array(&world.arena, 1, sizeof *s);
    s->ops = ops;
    s->self = imp__arena_array(&world.arena, 1, ops->object_size);
    s->film.width = w;
    s->film.height = h;
    sensor_status = ops->build(&b, s->self, s);
    if (sensor_status == IMP_OK) sensor_status = imp__props_finish(ctx, n);
    return sensor_status == IMP_OK ? s : NULL;
}
static struct imp_node *sensor_node(const char *type)
{
    struct imp_node *n = node_new("sensor", type);
    if (strcmp(type, "thinlens") == 0) node_float(n, "aperture_radius", 0.3);
    return n;
}
static struct imp_sensor_ray ray_at(const struct imp_sensor *s, double px, double py,
                                    double a, double b)
{
    struct imp_sensor_ray r = {.t_near = NAN};
    const double lens[2] = {a, b};
    if (s) s->ops->ray(s, px, py, lens, &r);
    return r;
}

/* Width of the picture at z = 1: 2 tan(fov_x / 2), from the rays at both borders. */
static double picture_width(const struct imp_sensor *s, int w, int h)
{
    const struct imp_sensor_ray l = ray_at(s, 0, h / 2.0, 0.5, 0.5);
    const struct imp_sensor_ray r = ray_at(s, w, h / 2.0, 0.5, 0.5);
    return l.d[0] / l.d[2] - r.d[0] / r.d[2];
}

static void fields_of_view(void)
{
    struct imp_sensor *s = sensor_build(sensor_node("perspective"), 100, 100);
    const double w = picture_width(s, 100, 100);
    tap_near(w, 0.6118823, 1e-7, 0, "default: 50mm, aspect 1: picture width at z = 1");
    tap_near(2 * atan(w / 2) * 180 / IMP_PI, 34.022, 2e-5, 0, "its horizontal fov");
    static const struct {
        const char *axis;
        double fov;
        int w, h;
        double expected;
    } rows[] = {{NULL, 40, 300, 200, 40},           {"x", 40, 300, 200, 40},
                {"y", 40, 300, 200, 57.264},        {"Y", 40, 200, 300, 27.27808},
                {"smaller", 40, 300, 200, 57.264},  {"smaller", 40, 200, 300, 40},
                {"larger", 40, 300, 200, 40},       {"larger", 40, 200, 300, 27.27808},
                {"Diagonal", 40, 300, 200, 33.697}, {"diagonal", 90, 100, 100, 70.5288}};
    for (size_t k = 0; k < imp_count(rows); k++) {
        struct imp_node *n = sensor_node("perspective");
        node_float(n, "fov", rows[k].fov);
        if (rows[k].axis) node_string(n, "fov_axis", rows[k].axis);
        s = sensor_build(n, rows[k].w, rows[k].h);
        const double got =
            2 * atan(picture_width(s, rows[k].w, rows[k].h) / 2) * 180 / IMP_PI;
        tap_near(got, rows[k].expected, 2e-5, 0,
                 rows[k].axis ? rows[k].axis : "fov alone");
    }
    static const struct {
        const char *text;
        double mm;
    } lengths[] = {
        {"50mm", 50}, {"35.5mm", 35.5}, {" 85 mm", 85}, {"20", 20}, {"0.5MM", 0.5}};
    for (size_t k = 0; k < imp_count(lengths); k++) {
        struct imp_node *n = sensor_node("thinlens");
        node_string(n, "focal_length", lengths[k].text);
        s = sensor_build(n, 36, 24);
        /* On a 3:2 film the diagonal rule gives the 36 mm wide picture itself. */
        tap_near(picture_width(s, 36, 24), 36 / lengths[k].mm, 1e-12, 0, lengths[k].text);
    }
}

/* Section 9 in numbers: direction or origin in local coordinates, then to_world. */
/* Sensors on surfaces and of far light are none. */
static bool is_camera(const struct imp_sensor_ops *ops)
{
    return !strcmp(ops->name, "perspective") || !strcmp(ops->name, "thinlens") ||
           !strcmp(ops->name, "orthographic");
}

static void rays(void)
{
    const int w = 640, h = 360;
    const double a = (double)w / h, t = tan(30 * IMP_PI / 180), near = 0.5, far = 20;
    struct imp_mat4 look;
    if (!imp__lookat(imp__v3(1, 2, 3), imp__v3(-1, 0.5, 7), imp__v3(0.1, 1, 0), &look))
        return;
    for (int kind = 0; imp__sensor_kinds[kind]; kind++) {
        const char *type = imp__sensor_kinds[kind]->name;
        if (!is_camera(imp__sensor_kinds[kind])) continue;
        const int perspective = strcmp(type, "perspective") == 0;
        const int ortho = strcmp(type, "orthographic") == 0;
        struct imp_mat4 m = look;
        if (ortho) {
            const struct imp_mat4 scale = imp__scale(imp__v3(3, 3, 1));
            m = imp__mat4_multiply(&look, &scale);
        }
        struct imp_node *n = sensor_node(type);
        node_transform(n, m);
        node_float(n, "near_clip", near);
        node_float(n, "far_clip", far);
        if (!ortho) node_float(n, "fov", 60);
        if (perspective) {
            node_float(n, "principal_point_offset_x", 0.1);
            node_float(n, "principal_point_offset_y", -0.2);
        }
        node_float(n, "focus_distance", 4);
        struct imp_sensor *s = sensor_build(n, w, h);
        double worst = 0, lens_radius = 0;
        for (uint32_t i = 0; s && i < 1000; i++) {
            const struct imp_key key = imp__key(9, 0, i);
            const double px = imp__u01(key, 0) * w, py = imp__u01(key, 1) * h;
            const struct imp_sensor_ray r =
                ray_at(s, px, py, imp__u01(key, 2), imp__u01(key, 3));
            const double X = px / w + (perspective ? 0.1 : 0);
            const double Y = py / h - (perspective ? 0.2 : 0);
            const imp_v3 v = imp__v3(t * (1 - 2 * X), t / a * (1 - 2 * Y), 1);
            worst = fmax(worst, fabs(imp__length(r.d) - 1) + fabs(r.t_near));
            struct imp_mat4 inverse;
            imp__mat4_inverse(&m, &inverse);
            const imp_v3 o = imp__point(&inverse, r.o),
                         end = imp__point(&inverse, r.o + r.d * r.t_far);
            /* It begins on the near plane and ends on the far one. */
            worst = fmax(worst, fabs(o[2] - near) + fabs(end[2] - far) / far);
            if (perspective) {
                worst = fmax(worst, imp__length(o - v * near) +
                                        imp__length(end - v * far) / far);
            } else if (ortho) {
                const imp_v3 at = imp__v3(1 - 2 * px / w, (1 - 2 * py / h) / a, near);
                worst = fmax(worst, imp__length(o - at));
                worst = fmax(worst, fabs(end[0] - o[0]) + fabs(end[1] - o[1]));
            } else {
                const imp_v3 step = (end - o) * (1 / (far - near));
                const imp_v3 lens = o - step * near, focus = o + step * (4 - near);
                worst = fmax(worst, imp__length(focus - v * 4));
                lens_radius = fmax(lens_radius, hypot(lens[0], lens[1]));
                worst = fmax(worst, hypot(lens[0], lens[1]) - 0.3);
            }
        }
        tap_ok(s && worst < 1e-12 &&
                   (perspective || ortho ||
                    (lens_radius > 0.29 && lens_radius <= 0.3 + 1e-12)),
               "%s: rays of section 9 # worst %.1e", type, worst);
    }
    /* +x of the sensor is the left of the picture: of a sensor at the origin looking
     * along +z with +y up, world +x. */
    struct imp_sensor *s = sensor_build(sensor_node("perspective"), 10, 10);
    tap_ok(ray_at(s, 0, 5, 0, 0).d[0] > 0 && ray_at(s, 5, 0, 0, 0).d[1] > 0,
           "left of the picture is +x, its top +y");
    struct imp_node *n = node_new("sensor", "thinlens");
    node_float(n, "aperture_radius", 0);
    s = sensor_build(n, 10, 10);
    const struct imp_sensor_ray r = ray_at(s, 2, 7, 0.9, 0.8);
    const struct imp_sensor_ray q =
        ray_at(sensor_build(sensor_node("perspective"), 10, 10), 2, 7, 0, 0);
    tap_ok(s && imp__length(r.d - q.d) < 1e-15 && imp__length(r.o - q.o) < 1e-12,
           "an aperture of 0 is a pinhole");
}

static void refused_at(struct imp_node *n, int w, int h, const char *words)
{
    sensor_build(n, w, h);
    tap_ok(sensor_status == IMP_E_SCENE && strstr(imp_last_error(ctx), words),
           "sensor error: %s # %s", words, imp_last_error(ctx));
}

static void refused(struct imp_node *n, const char *words)
{
    refused_at(n, 30, 20, words);
}

static void sensor_errors(void)
{
    struct imp_node *n;
    static const char *const meters[] = {"distant", "radiancemeter"};
    for (size_t k = 0; k < imp_count(meters); k++) {
        n = sensor_node(meters[k]);
        node_transform(n, imp__scale(imp__v3(1, 0, 1)));
        refused_at(n, 1, 1, "singular");
        n = sensor_node(meters[k]);
        node_transform(n, imp__scale(imp__v3(1, NAN, 1)));
        refused_at(n, 1, 1, "not finite");
    }
    for (int kind = 0; imp__sensor_kinds[kind]; kind++) {
        const char *type = imp__sensor_kinds[kind]->name;
        if (!is_camera(imp__sensor_kinds[kind])) continue;
        const int ortho = strcmp(type, "orthographic") == 0;
        static const struct {
            const char *name, *words;
            double v;
        } numbers[] = {
            {"near_clip", "near_clip = 0 is outside (0, inf]", 0},
            {"near_clip", "near_clip = -1 is outside (0, inf]", -1},
            {"near_clip", "near_clip = 20000 is outside (0, far_clip = 10000)", 20000},
            {"far_clip", "far_clip = 0.01 is outside (near_clip = 0.01, inf]", 0.01},
            {"near_clip", "not finite", NAN},
            {"focus_distance", "focus_distance = 0 is outside (0, inf]", 0},
            {"x_fov", "'x_fov'", 3}};
        for (size_t k = 0; k < imp_count(numbers); k++) {
            n = sensor_node(type);
            node_float(n, numbers[k].name, numbers[k].v);
            refused(n, numbers[k].words);
        }
        n = sensor_node(type);
        node_transform(n, imp__scale(imp__v3(1, 0, 1)));
        refused(n, "singular");
        n = sensor_node(type);
        node_transform(n, imp__scale(imp__v3(1, INFINITY, 1)));
        refused(n, "not finite");
        n = sensor_node(type);
        node_transform(n, imp__scale(imp__v3(2, 2, 2)));
        if (!ortho) refused(n, "scales");
        if (ortho) {
            tap_ok(sensor_build(n, 3, 2) != NULL, "orthographic may be scaled");
            n = sensor_node(type);
            node_float(n, "fov", 40);
            refused(n, "'fov'");
            continue;
        }
        n = sensor_node(type);
        node_transform(n, imp__scale(imp__v3(1.0004, 1, 1)));
        tap_ok(sensor_build(n, 3, 2) != NULL, "%s: a scale of 1.0004 is rounding", type);
        n = sensor_node(type);
        node_transform(n, imp__scale(imp__v3(-1, 1, 1)));
        tap_ok(sensor_build(n, 3, 2) != NULL, "%s: mirroring is no scale", type);
        n = sensor_node(type);
        node_float(n, "fov", 40);
        node_string(n, "focal_length", "50mm");
        refused(n, "not both");
        n = sensor_node(type);
        node_string(n, "fov_axis", "x");
        refused(n, "'fov_axis'");
        n = sensor_node(type);
        node_float(n, "fov", 40);
        node_string(n, "fov_axis", "z");
        refused(n, "fov_axis = 'z'");
        static const double fovs[] = {0, -10, 180, 400};
        for (size_t k = 0; k < imp_count(fovs); k++) {
            n = sensor_node(type);
            node_float(n, "fov", fovs[k]);
            refused(n, "outside (0, 180)");
        }
        static const char *const lengths[] = {"",      "mm",    "-50mm", "0mm",  "50cm",
                                              "5e1mm", "5.0.1", "nan",   "50mm "};
        for (size_t k = 0; k < imp_count(lengths); k++) {
            n = sensor_node(type);
            node_string(n, "focal_length", lengths[k]);
            refused(n, "must be like '50mm'");
        }
    }
    refused(node_new("sensor", "thinlens"), "property 'aperture_radius' is missing");
    n = node_new("sensor", "thinlens");
    node_float(n, "aperture_radius", -1);
    refused(n, "aperture_radius = -1 is outside [0, inf]");
}

static enum imp_status film_status;
static struct imp_film_desc film(struct imp_node *n, enum imp_color_mode mode)
{
    const struct imp_build b = {
        .ctx = ctx, .node = n, .arena = &world.arena, .mode = mode};
    struct imp_film_desc f = {.width = -1};
    film_status = imp__film_desc_build(&b, &f);
    return f;
}
static void film_refused(struct imp_node *n, enum imp_status st, const char *words)
{
    const struct imp_film_desc f = film(n, IMP_RGB);
    tap_ok(film_status == st && f.width == -1 && strstr(imp_last_error(ctx), words),
           "film error: %s # %s", words, imp_last_error(ctx));
}

static void films(void)
{
    struct imp_film_desc f = film(NULL, IMP_RGB);
    tap_ok(film_status == IMP_OK && f.width == 768 && f.height == 576 &&
               f.crop_w == 768 && f.crop_h == 576 && f.crop_x == 0 && f.crop_y == 0 &&
               f.half && !f.sample_border && f.pixel_format == IMP_PIXEL_RGB &&
               strcmp(f.file_format, "openexr") == 0 &&
               strcmp(f.filter.ops->name, "gaussian") == 0 && f.filter.radius == 2,
           "the default film");
    struct imp_node *n = node_new("film", "hdrfilm"), *box = node_new("rfilter", "box");
    node_int(n, "width", 40);
    node_int(n, "height", 30);
    node_int(n, "crop_offset_x", 8);
    node_int(n, "crop_offset_y", 10);
    node_int(n, "crop_width", 32);
    node_int(n, "crop_height", 20);
    node_string(n, "file_format", "EXR");
    node_string(n, "pixel_format", "RGBA");
    node_string(n, "component_format", "Float32");
    node_bool(n, "sample_border", true);
    node_bool(n, "banner", false);
    node_bool(n, "compensate", true);
    imp__node_add_child(&world.arena, n, box, NULL, n->loc);
    f = film(n, IMP_RGB);
    tap_ok(film_status == IMP_OK && f.width == 40 && f.height == 30 && f.crop_x == 8 &&
               f.crop_y == 10 && f.crop_w == 32 && f.crop_h == 20 && !f.half &&
               f.sample_border && f.pixel_format == IMP_PIXEL_RGBA &&
               strcmp(f.file_format, "openexr") == 0 &&
               strcmp(f.filter.ops->name, "box") == 0,
           "every property of the film");
    f = film(n, IMP_MONO);
    tap_ok(f.pixel_format == IMP_PIXEL_LUMINANCE, "mono mode forces luminance");
    n = node_new("film", "hdrfilm");
    node_string(n, "pixel_format", "luminance_alpha");
    f = film(n, IMP_MONO);
    tap_ok(f.pixel_format == IMP_PIXEL_LUMINANCE_ALPHA, "and keeps its alpha");
    static const char *const others[] = {"rgbe", "pfm"};
    for (int k = 0; k < 2; k++) {
        n = node_new("film", "hdrfilm");
        node_string(n, "file_format", others[k]);
        node_string(n, "pixel_format", "xyza");
        f = film(n, IMP_RGB);
        tap_ok(film_status == IMP_OK && f.pixel_format == IMP_PIXEL_RGB && !f.half &&
                   strcmp(f.file_format, others[k]) == 0,
               "%s forces rgb and floats", others[k]);
    }
    static const struct {
        const char *name, *words;
        int64_t v;
    } numbers[] = {{"width", "width = 0", 0},
                   {"height", "height = -3", -3},
                   {"width", "width = 2000000", 2000000},
                   {"crop_width",
                    "crop_offset_x + crop_width = 769 is outside [1, width = 768]", 769},
                   {"crop_offset_x",
                    "crop_offset_x + crop_width = 769 is outside [1, width = 768]", 1},
                   {"crop_offset_y", "crop_offset_y = -1", -1},
                   {"crop_height", "crop_height = 0", 0},
                   {"bit_depth", "'bit_depth'", 8}};
    for (size_t k = 0; k < imp_count(numbers); k++) {
        n = node_new("film", "hdrfilm");
        node_int(n, numbers[k].name, numbers[k].v);
        film_refused(n, IMP_E_SCENE, numbers[k].words);
    }
    n = node_new("film", "hdrfilm");
    node_int(n, "width", 1000000);
    node_int(n, "height", 1000000);
    film_refused(n, IMP_E_SCENE, "too many");
    n = node_new("film", "hdrfilm");
    node_float(n, "width", 10);
    film_refused(n, IMP_E_SCENE, "must be an integer, not a float");
    static const struct {
        const char *name, *value, *words;
    } strings[] = {
        {"file_format", "png", "must be one of openexr, exr, rgbe, pfm"},
        {"pixel_format", "cmyk", "must be one of luminance, luminance_alpha"},
        {"component_format", "double", "must be one of float16, float32, uint32"}};
    for (size_t k = 0; k < imp_count(strings); k++) {
        n = node_new("film", "hdrfilm");
        node_string(n, strings[k].name, strings[k].value);
        film_refused(n, IMP_E_SCENE, strings[k].words);
    }
    film_refused(node_new("film", "tapefilm"), IMP_E_UNSUPPORTED,
                 "it has hdrfilm, specfilm");
    n = node_new("film", "hdrfilm");
    imp__node_add_child(&world.arena, n, node_new("rfilter", "sinc"), NULL, n->loc);
    film_refused(n, IMP_E_UNSUPPORTED, "it has box, tent, gaussian");
    n = node_new("film", "hdrfilm");
    imp__node_add_child(&world.arena, n, node_new("rfilter", "box"), NULL, n->loc);
    imp__node_add_child(&world.arena, n, node_new("rfilter", "tent"), NULL, n->loc);
    film_refused(n, IMP_E_SCENE, "two filters");
    n = node_new("film", "hdrfilm");
    imp__node_add_child(&world.arena, n, node_new("bsdf", "diffuse"), NULL, n->loc);
    film_refused(n, IMP_E_SCENE, "bsdf");
    n = node_new("film", "hdrfilm");
    struct imp_node *wrong = node_new("rfilter", "box");
    node_float(wrong, "radius", 2);
    imp__node_add_child(&world.arena, n, wrong, NULL, n->loc);
    film_refused(n, IMP_E_SCENE, "'radius'");

    n = node_new("film", "hdrfilm");
    node_string(n, "component_format", "uint32");
    warnings = 0;
    f = film(n, IMP_RGB);
    tap_ok(film_status == IMP_OK && !f.half && warnings == 1,
           "uint32 becomes float, aloud");
}

/* The taps of a sample are the pixels that the filter reaches, each with its value there,
 * and no others. */
static void taps(void)
{
    const double radius[] = {0.3, 0.5, 1, 1.3, 2, 5.7};
    const struct imp_filter_ops *tent = NULL;
    double worst = 0;
    int n = 0;
    for (int k = 0; imp__filter_kinds[k]; k++)
        if (strcmp(imp__filter_kinds[k]->name, "tent") == 0) tent = imp__filter_kinds[k];
    for (int i = 0; tent && i < 6000; i++) {
        const struct imp_filter f = {.ops = tent, .radius = radius[i % 6]};
        const double x = -3 + 26 * imp__u01(imp__key(5, 0, 0), (uint32_t)i);
        const int lo = i & 8 ? 0 : -2, hi = i & 8 ? 19 : 21;
        struct imp_taps t;
        double sum = 0;
        imp__film_taps(&f, x, lo, hi, &t);
        for (int p = lo; p <= hi; p++) {
            const double w = fmax(0, 1 - fabs(x - (p + 0.5)) / f.radius);
            const bool in = p >= t.first && p < t.first + t.n;
            worst = fmax(worst, fabs((in ? t.w[p - t.first] : 0) - w));
            sum += w;
        }
        n += sum > 0;
    }
    tap_ok(n > 4000 && worst < 1e-13, "taps of a filter # %.1e", worst);
}

/* Filters with negative lobes, against numbers of Mitsuba 3.9.1 (floats): at 0, .3, .7,
 * 1.25 and 1.8. */
static void lobes(void)
{
    const struct imp_build b = {.ctx = ctx, .arena = &world.arena};
    static const double x[5] = {0, 0.3, 0.7, 1.25, 1.8};
    static const struct {
        const char *type, *name[2];
        double value[2], ref[5];
    } cases[] = {
        {"mitchell",
         {0},
         {0},
         {0.888888955, 0.740388989, 0.309055626, -0.0234374218, -0.0102221202}},
        {"mitchell",
         {"B", "C"},
         {0.2, 0.6},
         {0.933333337, 0.783033311, 0.330633342, -0.0703124031, -0.018933339}},
        {"catmullrom", {0}, {0}, {1, 0.815500021, 0.289499998, -0.0703125, -0.015999794}},
        {"lanczos", {0}, {0}, {1, 0.844343126, 0.335810274, -0.132871017, -0.0524446964}},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct imp_node *n = node_new("rfilter", cases[c].type);
        struct imp_filter f;
        double worst = 0, one = 0;
        for (int k = 0; k < 2 && cases[c].name[k]; k++)
            node_float(n, cases[c].name[k], cases[c].value[k]);
        if (imp__filter_build(&b, n, &f) != IMP_OK) {
            tap_ok(0, "%s: %s", cases[c].type, imp_last_error(ctx));
            continue;
        }
        for (int k = 0; k < 5; k++)
            worst = fmax(worst, fabs(f.ops->eval(&f, x[k]) - cases[c].ref[k]));
        for (int k = -3; k <= 3; k++) one += f.ops->eval(&f, 0.37 + k);
        tap_ok(worst < 3e-7 && fabs(one - 1) < (cases[c].type[0] == 'l' ? 0.02 : 1e-14),
               "%s, %g %g: Mitsuba's values, and their sum # %.1e, %.6f", cases[c].type,
               cases[c].value[0], cases[c].value[1], worst, one);
    }
}

/* Of sinc(x) sinc(x/3) on [-3, 3], by quadrature. */
#define LANCZOS_3 0.9970553460

static void filters(void)
{
    const struct imp_build b = {.ctx = ctx, .arena = &world.arena};
    for (int k = 0; imp__filter_kinds[k]; k++) {
        struct imp_filter f = {0};
        const int st =
            imp__filter_build(&b, node_new("rfilter", imp__filter_kinds[k]->name), &f);
        int bad = st != IMP_OK || !(f.radius > 0);
        double sum = 0;
        for (int i = -1000; !bad && i < 1000; i++) {
            const double x = (i + 0.5) / 1000 * f.radius, w = f.ops->eval(&f, x);
            bad += !(w >= -0.25 && w <= 1) || fabs(w - f.ops->eval(&f, -x)) > 1e-15;
            sum += w * f.radius / 1000;
        }
        /* Integrals: 1; r; sigma sqrt(2 pi) erf(4/sqrt 2) - 8 sigma e^-8; cubics 1. */
        const double ref[] = {1, 1, 0.5 * sqrt(IMP_2PI) * erf(4 / sqrt(2)) - 4 * exp(-8),
                              1, 1, LANCZOS_3};
        tap_ok(!bad && k < 6 && fabs(sum - ref[k]) < 2e-6,
               "%s is even, at most 1, integral # %.8f", imp__filter_kinds[k]->name, sum);
    }
    struct imp_node *n = node_new("rfilter", "gaussian");
    struct imp_filter f;
    node_float(n, "stddev", 0.25);
    tap_ok(imp__filter_build(&b, n, &f) == IMP_OK && f.radius == 1 &&
               fabs(f.ops->eval(&f, 0.25) - (exp(-0.5) - exp(-8))) < 1e-16 &&
               f.ops->eval(&f, 1) == 0,
           "gaussian of 0.25");
    n = node_new("rfilter", "tent");
    node_float(n, "radius", 3);
    tap_ok(imp__filter_build(&b, n, &f) == IMP_OK && f.radius == 3 &&
               f.ops->eval(&f, -1.5) == 0.5,
           "tent of 3");
    static const double bad[] = {0, -1, 1e-9, 1000};
    for (int k = 0; k < 4; k++) {
        n = node_new("rfilter", k % 2 ? "tent" : "gaussian");
        node_float(n, k % 2 ? "radius" : "stddev", bad[k]);
        tap_ok(imp__filter_build(&b, n, &f) == IMP_E_SCENE, "filter of %g is refused",
               bad[k]);
    }
}

static void samplers(void)
{
    static const struct {
        const char *type;
        int asked, expected;
    } rows[] = {{"independent", 7, 7}, {"stratified", 7, 9},    {"stratified", 9, 9},
                {"multijitter", 7, 8}, {"multijitter", 16, 16}, {"multijitter", 17, 20},
                {"orthogonal", 1, 4},  {"orthogonal", 10, 25},  {"orthogonal", 26, 49},
                {"ldsampler", 1, 4},   {"ldsampler", 5, 16},    {"ldsampler", 64, 64}};
    int spp = 0, bad = 0, misread = 0;
    enum imp_points points = IMP_POINTS_SCENE;
    struct imp_build b = {.ctx = ctx, .arena = &world.arena};
    for (size_t k = 0; k < imp_count(rows); k++) {
        b.node = node_new("sampler", rows[k].type);
        node_int(b.node, "sample_count", rows[k].asked);
        node_int(b.node, "seed", 3);
        if (imp__sampler_build(&b, &spp, &points) != IMP_OK || spp != rows[k].expected)
            bad++;
        misread += points != (k == 0 ? IMP_POINTS_SCENE : IMP_POINTS_SOBOL);
    }
    tap_ok(bad == 0, "sample counts are rounded as section 10 says");
    tap_ok(misread == 0,
           "all but independent, which chooses nothing, ask for points in sets");
    b.node = NULL;
    tap_ok(imp__sampler_build(&b, &spp, &points) == IMP_OK && spp == 4 &&
               points == IMP_POINTS_SCENE,
           "no sampler: 4 samples, of no kind");
    static const int counts[] = {0, -1};
    for (int k = 0; k < 2; k++) {
        b.node = node_new("sampler", "independent");
        node_int(b.node, "sample_count", counts[k]);
        tap_ok(imp__sampler_build(&b, &spp, &points) == IMP_E_SCENE && spp == 4,
               "sample_count %d is refused", counts[k]);
    }
    b.node = node_new("sampler", "independent");
    node_bool(b.node, "jitter", true);
    tap_ok(imp__sampler_build(&b, &spp, &points) == IMP_E_SCENE,
           "jitter is not of independent");
    b.node = node_new("sampler", "sobol");
    tap_ok(imp__sampler_build(&b, &spp, &points) == IMP_E_UNSUPPORTED,
           "an unknown sampler");
    warnings = 0;
    b.node = node_new("sampler", "orthogonal");
    node_bool(b.node, "jitter", false);
    node_int(b.node, "strength", 3);
    node_int(b.node, "sample_count", 1 << 30);
    tap_ok(imp__sampler_build(&b, &spp, &points) == IMP_OK && spp == 1 << 30 &&
               warnings == 1,
           "jitter=false warns; the count stays bounded");
}

int main(void)
{
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    options.log = count_warning;
    if (imp_context_create(&options, &ctx) != IMP_OK) return 1;
    world_begin(ctx);
    fields_of_view();
    rays();
    sensor_errors();
    films();
    taps();
    filters();
    lobes();
    samplers();
    world_end();
    imp_context_destroy(ctx);
    return tap_done();
}
