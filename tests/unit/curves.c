/* SPDX-License-Identifier: Apache-2.0
 *
 * bsplinecurve and linearcurve: points, normals and uv of hits against the tube's own
 * definition, a straight tube against a cylinder, instances, and what is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/shape/curve.h"
#include "math/rng.h"
#include "scene/instances.h"
#include "scene/scene.h"
#include <unistd.h>

static imp_context *ctx;
static char folder[] = "/tmp/imp_curves_XXXXXX";

static void file_write(const char *name, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}
static void file_remove(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    remove(path);
}

static const char bent[] = "-1 0 0 .2\n-.3 .2 .1 .25\n.4 -.1 0 .2\n1 .1 .2 .1\n"
                           "1.5 .5 .3 .1\n\n-1 1 0 .1\r\n-.3 1.2 .1 .1\n.4 1.1 0 .1\n"
                           "1 1.1 .2 .1\n";
static const char straight[] = "-3 0 .5 .5\n-1 0 .5 .5\n1 0 .5 .5\n3 0 .5 .5\n";

#define TUBES(kind, file, more)                                                          \
    "<shape type='" kind "' id='tubes'><string name='filename' value='" file "'/>" more  \
    "</shape>"
#define CAMERA "<integrator type='path'/>" LOOK
/* Its samples of a diffuse surface in a white sky are exact. */
#define BARE                                                                             \
    "<integrator type='direct'><integer name='emitter_samples' value='0'/><integer "     \
    "name='bsdf_samples' value='1'/></integrator>" LOOK
#define LOOK                                                                             \
    "<sensor type='perspective'><float name='fov' value='40'/>"                          \
    "<transform name='to_world'><lookat origin='0,-4,1' target='0,0,.5' up='0,0,1'/>"    \
    "</transform><film type='hdrfilm'><integer name='width' value='12'/><integer "       \
    "name='height' value='8'/><rfilter type='box'/></film></sensor>"

static enum imp_status scene_try(const char *body, imp_scene **out)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    const char *folders[1] = {folder};
    char xml[8192];
    o.search = folders;
    o.n_search = 1;
    snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", body);
    return imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, out);
}
static imp_scene *scene_of(const char *body)
{
    imp_scene *s;
    test_must(ctx, scene_try(body, &s));
    return s;
}

/* A ray towards the middle from all around. */
static void ray_draw(uint32_t i, double size, imp_v3 *o, imp_v3 *d)
{
    const struct imp_key key = imp__key(5, 0, i);
    const imp_v3 to = imp__v3(imp__u01(key, 0) * 2.4 - 1.1, imp__u01(key, 1) * 1.6 - .2,
                              imp__u01(key, 2) * .6 - .2);
    const double z = 2 * imp__u01(key, 3) - 1, a = IMP_2PI * imp__u01(key, 4),
                 r = sqrt(1 - z * z);
    const imp_v3 from = imp__v3(r * cos(a), r * sin(a), z) * 6;
    *o = (to + from) * size;
    *d = imp__normalize(-from);
}

/* The point of the surface at uv, by its definition. */
static imp_v3 place(const struct imp_curves *k, const double uv[2])
{
    struct imp__curve_at at;
    const double x = uv[1] * (double)k->n_segments;
    const int segment = imp_min((int)x, (int)k->n_segments - 1);
    imp__curve_at(k, segment, x - segment, &at);
    const imp_v3 axis = imp__normalize(at.d1);
    const imp_v3 turned = imp__normalize(imp__v3(0, 0, 1) - axis * axis[2]);
    const imp_v3 out =
        imp__cross(turned, axis) * cos(IMP_2PI * uv[0]) + turned * sin(IMP_2PI * uv[0]);
    if (k->degree == 3) return at.c + out * at.r;
    /* The ball of the envelope touches behind the circle: q c' = -r r'. */
    const double l = imp__length(at.d1), sine = -at.r1 / l;
    return at.c + (out * sqrt(1 - sine * sine) + axis * sine) * at.r;
}

static void surfaces(const char *kind)
{
    char body[1024];
    snprintf(body, sizeof body,
             "<shape type='%s' id='tubes'><string name='filename' value='bent.txt'/>"
             "</shape>",
             kind);
    imp_scene *scene = scene_of(body);
    const struct imp_shape *s = scene->shapes[0];
    const struct imp_curves *k = &s->curves;
    double off = 0, slanted = 0, moved = 0, normal = 0, inside = 0, slope = 0, again = 0;
    int hits = 0, compared = 0;
    for (uint32_t i = 0; i < 20000; i++) {
        imp_v3 o, d;
        struct imp_hit hit;
        struct imp_surface at;
        struct imp__curve_at c;
        ray_draw(i, 1, &o, &d);
        if (!imp__intersect(scene, &o, &d, 0, INFINITY, &hit)) continue;
        imp__hit_surface(scene, &hit, &o, &d, &at);
        hits++;
        /* On the ray, but where it grazes the tube. */
        const imp_v3 on = at.p - o;
        const double cosine = -imp__dot(at.ng, d);
        inside = fmax(inside, -cosine);
        if (cosine < 0.05) continue;
        off = fmax(off, imp__length(on - d * imp__dot(on, d)));
        moved = fmax(moved, fabs(imp__dot(on, d) - hit.t));
        const double x = at.uv[1] * (double)k->n_segments;
        const double v = x - hit.prim;
        imp__curve_at(k, hit.prim, v, &c);
        slanted = fmax(slanted, fabs(imp__length(at.p - c.c) - c.r));
        if (k->degree == 1 && (v <= 0 || v >= 1)) continue; /* a ball at an end */
        if (v < 1e-3 || v > 1 - 1e-3) continue; /* differences stay in the segment */
        /* The normal is across both derivatives of the point by uv. */
        const double h = 1e-5;
        imp_v3 by[2];
        for (int j = 0; j < 2; j++) {
            double up[2] = {at.uv[0], at.uv[1]}, down[2] = {at.uv[0], at.uv[1]};
            up[j] += h;
            down[j] -= h;
            by[j] = place(k, up) - place(k, down);
        }
        const imp_v3 n = imp__normalize(imp__cross(by[0], by[1]));
        off = fmax(off, imp__length(place(k, at.uv) - at.p));
        slope = fmax(slope, imp__length(by[0] * (0.5 / h) - at.dp_du));
        slope = fmax(slope, imp__length(by[1] * (0.5 / h) - at.dp_dv));
        struct imp_surface there;
        int prim;
        if (s->ops->place) {
            s->ops->place(s, at.uv, &there, &prim);
            again =
                fmax(again, imp__length(there.p - at.p) + imp__length(there.n - at.n));
            again = fmax(again, imp__length(there.dp_du - at.dp_du) +
                                    imp__length(there.dp_dv - at.dp_dv));
        }
        normal = fmax(normal, imp__length(n - at.n));
        compared++;
    }
    tap_ok(
        hits > 4000 && compared > 3000 && off < 1e-9 && slanted < 1e-12 &&
            normal < 2e-7 && moved < 2e-4 && inside <= 1e-4,
        "%s: %d hits lie on the ray and on the tube, with its normal and uv # off %.1e "
        "radius %.1e normal %.1e t %.1e inside %.1e",
        kind, hits, off, slanted, normal, moved, inside);
    tap_ok(slope < 1e-6, "%s: dp_du and dp_dv are its derivatives # off %.1e", kind,
           slope);
    tap_ok(again < 1e-9 && (k->degree == 1) == !s->ops->place,
           "%s: its place by uv # off %.1e", kind, again);

    /* From inside nothing is met. */
    int met = 0;
    for (uint32_t i = 0; i < 2000; i++) {
        struct imp__curve_at c;
        struct imp_hit hit;
        const struct imp_key key = imp__key(6, 0, i);
        imp__curve_at(k, (int)(i % k->n_segments), 0.1 + 0.8 * imp__u01(key, 0), &c);
        const double z = 2 * imp__u01(key, 1) - 1, a = IMP_2PI * imp__u01(key, 2);
        const imp_v3 d = imp__v3(sqrt(1 - z * z) * cos(a), sqrt(1 - z * z) * sin(a), z);
        if (!imp__intersect(scene, &c.c, &d, 0, INFINITY, &hit)) continue;
        met += hit.t < 1.01 * c.r;
    }
    tap_ok(met == 0, "%s: rays leave its inside # %d are stopped", kind, met);
    imp_scene_destroy(scene);
}

/* In a group, turned, moved and made larger: the same hits. */
static void instances(const char *kind)
{
    char body[2048];
    snprintf(body, sizeof body,
             "<shape type='%s' id='tubes'><string name='filename' value='bent.txt'/>"
             "</shape>",
             kind);
    imp_scene *plain = scene_of(body);
    snprintf(
        body, sizeof body,
        "<shape type='shapegroup' id='group'><shape type='%s' id='tubes'><string "
        "name='filename' value='bent.txt'/></shape></shape><shape type='instance'>"
        "<ref id='group'/><transform name='to_world'><scale value='3'/><rotate z='1' "
        "angle='90'/></transform></shape>",
        kind);
    imp_scene *placed = scene_of(body);
    double off = 0, turned = 0;
    int hits = 0, one = 0;
    for (uint32_t i = 0; i < 3000; i++) {
        imp_v3 o, d;
        struct imp_hit hit[2];
        struct imp_surface at[2];
        ray_draw(i, 1, &o, &d);
        const imp_v3 o2 = imp__v3(-o[1], o[0], o[2]) * 3, d2 = imp__v3(-d[1], d[0], d[2]);
        const bool a = imp__intersect(plain, &o, &d, 0, INFINITY, &hit[0]),
                   b = imp__intersect(placed, &o2, &d2, 0, INFINITY, &hit[1]);
        one += a != b;
        if (!a || !b) continue;
        imp__hit_surface(plain, &hit[0], &o, &d, &at[0]);
        imp__hit_surface(placed, &hit[1], &o2, &d2, &at[1]);
        if (-imp__dot(at[0].n, d) < 0.05) continue;
        hits++;
        const imp_v3 p = imp__v3(-at[0].p[1], at[0].p[0], at[0].p[2]) * 3,
                     n = imp__v3(-at[0].n[1], at[0].n[0], at[0].n[2]);
        off = fmax(off, imp__length(p - at[1].p));
        turned = fmax(turned, imp__length(n - at[1].n));
    }
    tap_ok(hits > 500 && one < 5 && off < 1e-9 && turned < 1e-8,
           "%s in an instance # %d hits, off %.1e turned %.1e, %d of one alone", kind,
           hits, off, turned, one);
    imp_scene_destroy(plain);
    imp_scene_destroy(placed);
}

static void pixels(const char *body, imp_film **film)
{
    imp_scene *s = scene_of(body);
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 4;
    test_must(ctx, imp_render(s, &run, film));
    imp_scene_destroy(s);
}

/* A straight tube is a cylinder: in a white furnace both are invisible, and under one light
 * they look the same, sample by sample but for roundings of the hit. */
static void cylinder(const char *kind, double low, double high)
{
    char body[4096];
    const char *look = CAMERA "<emitter type='directional'><vector name='direction' "
                              "value='.2,1,-.7'/></emitter>";
    imp_film *a, *b;
    snprintf(body, sizeof body,
             "%s<shape type='%s'><string name='filename' value='straight.txt'/><bsdf "
             "type='diffuse'/></shape>",
             look, kind);
    pixels(body, &a);
    snprintf(
        body, sizeof body,
        "%s<shape type='cylinder'><point name='p0' value='%g,0,.5'/><point name='p1' "
        "value='%g,0,.5'/><float name='radius' value='.5'/><bsdf type='diffuse'/>"
        "</shape>",
        look, low, high);
    pixels(body, &b);
    const float *x = imp_film_mean(a), *y = imp_film_mean(b);
    double worst = 0, sum = 0;
    for (int i = 0; i < 12 * 8 * 3; i++) {
        worst = fmax(worst, fabs((double)x[i] - (double)y[i]));
        sum += (double)y[i];
    }
    tap_ok(worst < 1e-4 && sum > 5, "%s: straight, as a cylinder # off %.1e of %.3g",
           kind, worst, sum);
    imp_film_destroy(a);
    imp_film_destroy(b);
    snprintf(body, sizeof body,
             "%s<emitter type='constant'/><shape type='%s'><string name='filename' "
             "value='straight.txt'/><bsdf type='diffuse'><float name='reflectance' "
             "value='1'/></bsdf></shape>",
             BARE, kind);
    pixels(body, &a);
    x = imp_film_mean(a);
    worst = 0;
    for (int i = 0; i < 12 * 8 * 3; i++) worst = fmax(worst, fabs((double)x[i] - 1));
    tap_ok(worst < 1e-5, "%s: a white one in a white furnace is not seen # %.1e", kind,
           worst);
    imp_film_destroy(a);
}

/* Heights of 8 x 6 texels, bilinear, moved along u. */
#define BUMPS(u)                                                                         \
    "<bsdf type='bumpmap'><texture type='bitmap' name='h'><string name='filename' "      \
    "value='heights.pfm'/><boolean name='raw' value='true'/><transform name='to_uv'>"    \
    "<translate x='" u "'/></transform></texture><float name='scale' value='.3'/><bsdf " \
    "type='diffuse' id='paint'><float name='reflectance' value='.5'/></bsdf></bsdf>"

static void heights_write(void)
{
    char path[128];
    snprintf(path, sizeof path, "%s/heights.pfm", folder);
    FILE *f = fopen(path, "wb");
    fprintf(f, "Pf\n8 6\n-1\n");
    for (int k = 0; k < 48; k++)
        fwrite(&(float){(float)(k * 29 % 13) / 13}, sizeof(float), 1, f);
    fclose(f);
}

/* A straight tube with a bump map is a cylinder with one, whose turn is counted from -z: a
 * quarter further. The light that it reflects once is proportional to its reflectance, so that the
 * derivative, from walks that were kept, is the value by it. */
static void bumped(void)
{
    const char *look = CAMERA "<emitter type='directional'><vector name='direction' "
                              "value='.2,1,-.7'/></emitter>";
    char body[3][2048];
    imp_film *film[3];
    snprintf(body[0], sizeof body[0],
             "%s<shape type='bsplinecurve'><string name='filename' value='straight.txt'/>"
             "%s</shape>",
             look, BUMPS(".25"));
    snprintf(
        body[1], sizeof body[1],
        "%s<shape type='cylinder'><point name='p0' value='-1,0,.5'/><point name='p1' "
        "value='1,0,.5'/><float name='radius' value='.5'/>%s</shape>",
        look, BUMPS("0"));
    snprintf(body[2], sizeof body[2],
             "%s<shape type='bsplinecurve'><string name='filename' value='straight.txt'/>"
             "<bsdf type='diffuse'/></shape>",
             look);
    for (int k = 0; k < 3; k++) pixels(body[k], &film[k]);
    const float *x = imp_film_mean(film[0]), *y = imp_film_mean(film[1]),
                *flat = imp_film_mean(film[2]);
    double worst = 0, raised = 0;
    for (int i = 0; i < 12 * 8 * 3; i++) {
        worst = fmax(worst, fabs((double)x[i] - (double)y[i]));
        raised = fmax(raised, fabs((double)x[i] - (double)flat[i]));
    }
    tap_ok(worst < 1e-4 && raised > 0.05,
           "a straight tube with bumps, as a cylinder # off %.1e; without bumps by %.2g",
           worst, raised);
    for (int k = 0; k < 3; k++) imp_film_destroy(film[k]);

    snprintf(
        body[0], sizeof body[0],
        "<integrator type='path'><integer name='max_depth' value='2'/></integrator>" LOOK
        "<emitter type='directional'><vector name='direction' value='.2,1,-.7'/>"
        "</emitter><shape type='bsplinecurve'><string name='filename' "
        "value='bent.txt'/>%s</shape>",
        BUMPS("0"));
    imp_scene *s = scene_of(body[0]);
    imp_problem *p = test_problem(ctx, s, "paint.reflectance");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    double g, se;
    run.spp = 16;
    run.points = IMP_POINTS_INDEPENDENT; /* value and gradient are of the same walks */
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, &g, &se));
    tap_ok(e.value > 0.005 && fabs(0.5 * g / e.value - 1) < 1e-6,
           "bumps on a bent tube: value %.6g, derivative times .5 %.6g # off %.1e",
           e.value, 0.5 * g, fabs(0.5 * g / e.value - 1));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void refused(const char *what, const char *body, const char *reason)
{
    imp_scene *s = NULL;
    const enum imp_status st = scene_try(body, &s);
    tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), reason), "%s # %s", what,
           st == IMP_OK ? "accepted" : imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* One more segment than uv can tell apart. */
static void many_segments(void)
{
    char path[128];
    snprintf(path, sizeof path, "%s/many.txt", folder);
    FILE *f = fopen(path, "w");
    for (int k = 0; k < (1 << 20) + 4; k++) fprintf(f, "%d 0 0 1\n", k);
    fclose(f);
    refused("bumps on more segments than uv tells apart",
            TUBES("bsplinecurve", "many.txt", BUMPS("0")), "at most 1048576");
    file_remove("many.txt");
}

int main(void)
{
    ctx = test_context(1);
    if (!mkdtemp(folder)) return 99;
    file_write("bent.txt", bent);
    file_write("straight.txt", straight);
    file_write("short.txt", "0 0 0 1\n1 0 0 1\n\n2 0 0 1\n");
    file_write("five.txt", "0 0 0 1\n1 0 0 1 2\n");
    file_write("thin.txt", "0 0 0 1\n1 0 0 -1\n");
    file_write("empty.txt", "\n \n");
    file_write("far.txt", "0 0 0 1\n1e30 0 0 1\n1 0 0 1\n1 1 0 1\n");
    surfaces("bsplinecurve");
    surfaces("linearcurve");
    instances("bsplinecurve");
    instances("linearcurve");
    cylinder("bsplinecurve", -1, 1);
    cylinder("linearcurve", -3, 3);
    heights_write();
    bumped();
    refused("bumps on cones", TUBES("linearcurve", "bent.txt", BUMPS("0")),
            "a linearcurve cannot have a bumpmap: one uv belongs to");
    many_segments();
    refused("a light on curves",
            TUBES("linearcurve", "bent.txt", "<emitter type='area'/>"),
            "points of its shape (linearcurve) cannot be drawn");
    refused("light along the normals of curves",
            TUBES("linearcurve", "bent.txt", "<emitter type='directionalarea'/>"),
            "is not flat");
    refused("a meter on curves",
            TUBES("bsplinecurve", "bent.txt", "<sensor type='irradiancemeter'/>"),
            "cannot be drawn");
    refused(
        "a medium in curves",
        TUBES("bsplinecurve", "bent.txt", "<medium name='interior' type='homogeneous'/>"),
        "met from outside alone");
    refused(
        "normals that point inwards",
        TUBES("bsplinecurve", "bent.txt", "<boolean name='flip_normals' value='true'/>"),
        "met from outside alone");
    refused("too few control points", TUBES("linearcurve", "short.txt", ""),
            "curve 1 has 1 control points; it needs 2");
    refused("five numbers", TUBES("linearcurve", "five.txt", ""),
            "five.txt:2: a control point is four numbers");
    refused("a negative radius", TUBES("linearcurve", "thin.txt", ""),
            "thin.txt:2: radius -1 is negative");
    refused("nothing in the file", TUBES("linearcurve", "empty.txt", ""),
            "has no control points");
    refused("beyond Embree's numbers", TUBES("bsplinecurve", "far.txt", ""),
            "control point 1 lies further out");
    refused("no such file", TUBES("bsplinecurve", "none.txt", ""), "none.txt");
    static const char *const files[] = {"bent.txt", "straight.txt", "short.txt",
                                        "five.txt", "thin.txt",     "empty.txt",
                                        "far.txt",  "heights.pfm"};
    for (size_t i = 0; i < imp_count(files); i++) file_remove(files[i]);
    rmdir(folder);
    imp_context_destroy(ctx);
    return tap_done();
}
