/* SPDX-License-Identifier: Apache-2.0
 *
 * A batch of sensors: its rays and connections are those of its sensors, moved by their places
 * in the film, and what it refuses. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "scene/scene.h"

static imp_context *ctx;

#define LOOK(x)                                                                          \
    "<transform name='to_world'><lookat origin='" x                                      \
    ",-4,3' target='0,0,0' up='0,0,1'/></transform>"
#define PINHOLE "<float name='fov' value='40'/>" LOOK("0")
#define LENS                                                                             \
    "<float name='fov' value='30'/><float name='aperture_radius' value='.2'/><float "    \
    "name='focus_distance' value='5'/>" LOOK("2")
#define FLAT LOOK("-2")
#define FILM(w)                                                                          \
    "<film type='hdrfilm'><integer name='width' value='" #w "'/><integer name='height' " \
    "value='6'/><rfilter type='box'/></film>"
#define LIT "<emitter type='constant'/><shape type='sphere'/>"

static enum imp_status scene_try(const char *body, imp_scene **out)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/>%s" LIT "</scene>", body);
    return imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, out);
}
static imp_scene *scene_of(const char *body)
{
    imp_scene *s;
    test_must(ctx, scene_try(body, &s));
    return s;
}

/* The sensors one by one, with films of 8 x 6, and together. */
static void sensors(const char *name, const char *const child[3])
{
    char body[4096];
    int at = snprintf(body, sizeof body, "<sensor type='batch'>" FILM(24));
    for (int k = 0; k < 3; k++)
        at += snprintf(body + at, sizeof body - (size_t)at, "<sensor type=%s</sensor>",
                       child[k]);
    snprintf(body + at, sizeof body - (size_t)at, "</sensor>");
    imp_scene *all = scene_of(body), *one[3];
    const struct imp_sensor *batch = all->sensors[0];
    for (int k = 0; k < 3; k++) {
        snprintf(body, sizeof body, "<sensor type=%s" FILM(8) "</sensor>", child[k]);
        one[k] = scene_of(body);
    }
    double off = 0, back = 0, weight = 0;
    int lost = 0;
    for (uint32_t i = 0; i < 3000; i++) {
        const struct imp_key key = imp__key(9, 0, i);
        const int k = (int)(i % 3);
        const struct imp_sensor *s = one[k]->sensors[0];
        const double x = 8 * imp__u01(key, 0), y = 6 * imp__u01(key, 1),
                     lens[2] = {imp__u01(key, 2), imp__u01(key, 3)};
        struct imp_sensor_ray a, b;
        s->ops->ray(s, x, y, lens, &a);
        batch->ops->ray(batch, 8 * k + x, y, lens, &b);
        off = fmax(off, imp__length(a.o - b.o) + imp__length(a.d - b.d));
        /* A point on that ray, connected by the same point of the lens. */
        const imp_v3 p = a.o + a.d * 3;
        const double u[4] = {(lens[0] + k) / 3, lens[1], 0, 0}, v[4] = {lens[0], lens[1]};
        struct imp_sensor_sample to, own;
        if (!s->ops->connect(s, &p, false, v, &own) ||
            !batch->ops->connect(batch, &p, false, u, &to)) {
            lost++;
            continue;
        }
        back = fmax(back, fabs(to.px - 8 * k - x) + fabs(to.py - y));
        weight = fmax(weight, fabs(to.weight / (3 * own.weight) - 1));
    }
    tap_ok(
        off < 1e-13 && back < 1e-9 && weight < 1e-9 && lost < 5,
        "%s: rays and connections of its sensors # ray %.1e place %.1e weight %.1e, %d "
        "at a border",
        name, off, back, weight, lost);
    tap_ok(all->n_sensors == 1 && batch->n_child == 3 &&
               strcmp(batch->child[1]->name, "second") == 0,
           "%s: one sensor of the scene, whose sensors have names", name);
    imp_scene_destroy(all);
    for (int k = 0; k < 3; k++) imp_scene_destroy(one[k]);
}

/* Its picture has the pictures of its sensors: seen in three colours of one sky. */
static void picture(void)
{
    imp_scene *s = scene_of(
        "<sensor type='batch'><film type='hdrfilm'><integer name='width' value='8'/>"
        "<integer name='height' value='4'/><rfilter type='box'/></film><sensor "
        "type='perspective'><transform name='to_world'><lookat origin='0,0,9' "
        "target='0,0,20' up='0,1,0'/></transform></sensor><sensor type='perspective'>"
        "<float name='fov' value='2'/><transform name='to_world'><lookat origin='0,0,9' "
        "target='0,0,0' up='0,1,0'/></transform></sensor></sensor>");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 64;
    test_must(ctx, imp_render(s, &run, &film));
    const float *mean = imp_film_mean(film);
    double sky = 0, ball = 0;
    for (int i = 0; i < 8 * 4; i++) {
        const double v = (double)mean[3 * i];
        if (i % 8 < 4) sky = fmax(sky, fabs(v - 1));
        else ball += v / 16;
    }
    tap_ok(sky < 1e-6 && fabs(ball - 0.5) < 0.02,
           "the sky in the left half, the ball in the right one # %.1e, %.4f", sky, ball);
    imp_film_destroy(film);
    imp_scene_destroy(s);
}

/* Sensors of the scene that a batch refers to are its sensors, too: before and behind it. */
static void referred(void)
{
    imp_scene *s = scene_of("<sensor type='perspective' id='a'>" PINHOLE FILM(
        8) "</sensor>"
           "<sensor type='batch' id='both'><ref id='a'/><ref id='b'/>" FILM(
               16) "</sensor>"
                   "<sensor type='thinlens' id='b'>" LENS FILM(8) "</sensor>");
    double off = 0;
    tap_ok(s->n_sensors == 3 && strcmp(s->sensors[0]->name, "a") == 0 &&
               strcmp(s->sensors[1]->name, "both") == 0 &&
               strcmp(s->sensors[2]->name, "b") == 0,
           "sensors by reference stay sensors of the scene");
    const struct imp_sensor *batch = s->sensors[1];
    for (uint32_t i = 0; i < 1000; i++) {
        const struct imp_key key = imp__key(9, 0, i);
        const int k = (int)(i % 2);
        const struct imp_sensor *own = s->sensors[2 * k];
        const double x = 8 * imp__u01(key, 0), y = 6 * imp__u01(key, 1),
                     lens[2] = {imp__u01(key, 2), imp__u01(key, 3)};
        struct imp_sensor_ray a, b;
        own->ops->ray(own, x, y, lens, &a);
        batch->ops->ray(batch, 8 * k + x, y, lens, &b);
        off = fmax(off, imp__length(a.o - b.o) + imp__length(a.d - b.d));
    }
    tap_ok(off < 1e-13, "and make the rays of the batch # %.1e", off);
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

int main(void)
{
    ctx = test_context(1);
    static const char *const perspectives[3] = {
        "'perspective'>" PINHOLE, "'perspective' id='second'>" FLAT, "'thinlens'>" LENS};
    static const char *const parallel[3] = {
        "'perspective'>" PINHOLE, "'orthographic' id='second'>" FLAT, "'thinlens'>" LENS};
    sensors("cameras", perspectives);
    sensors("with parallel rays", parallel);
    picture();
    referred();
    refused("an exposure of one of them",
            "<sensor type='batch'>" FILM(
                8) "<sensor type='perspective'><film type='hdrfilm'><float "
                   "name='exposure' value='2'/></film></sensor></sensor>",
            "are those of its film");
    refused("no sensors", "<sensor type='batch'>" FILM(8) "</sensor>", "has no sensors");
    refused("a width that cannot be shared",
            "<sensor type='batch'>" FILM(8) "<sensor type='perspective'/><sensor "
                                            "type='perspective'/><sensor "
                                            "type='perspective'/></sensor>",
            "8 pixels, is no multiple of its 3 sensors");
    refused("a batch in a batch",
            "<sensor type='batch'>" FILM(8) "<sensor type='batch'><sensor "
                                            "type='perspective'/></sensor></sensor>",
            "is nested in a batch, and is one");
    refused("a surface in a batch",
            "<sensor type='batch'>" FILM(8) "<sensor type='irradiancemeter'/></sensor>",
            "is nested in a batch, and is a surface");
    refused("sensors in two media",
            "<medium type='homogeneous' id='fog'/><sensor type='batch'>" FILM(
                8) "<sensor type='perspective'/><sensor type='perspective'><ref "
                   "id='fog'/></sensor></sensor>",
            "in another medium than the sensors before it");
    refused("a shutter of one of them",
            "<sensor type='batch'>" FILM(
                8) "<sensor type='perspective'><float "
                   "name='shutter_close' value='2'/></sensor></sensor>",
            "has a shutter or times, which are those of its batch");
    refused("a film with a border",
            "<sensor type='batch'><film type='hdrfilm'><boolean name='sample_border' "
            "value='true'/></film><sensor type='perspective'/></sensor>",
            "sample_border");
    imp_context_destroy(ctx);
    return tap_done();
}
