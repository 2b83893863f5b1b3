/* SPDX-License-Identifier: Apache-2.0
 *
 * Glare ratings over a grid of observers (importon/rooms.h has what counts as a source). */
#include "base/arguments.h"
#include "color/rgb.h"
#include "film/film_measure.h"
#include "glare_sources.h"
#include "kind/emitter/ies.h"
#include "kind/sensor/receiver.h"
#include "walk/run/run.h"
#include <math.h>

#define DEGREE (IMP_PI / 180)

static double scale_of(const struct imp_scene *scene, const struct imp_emitter *e)
{
    if (e->input[0]->texture) return 1;
    const imp_spec c = e->input[0]->value;
    return scene->channels == 1 ? c[0] : imp__luminance(c[0], c[1], c[2]);
}

/* Does nothing else stand between the eye and the middle of the luminaire at eye + d? A solid one hides its
 * middle itself. */
static bool is_free(const struct imp_scene *scene, const struct imp_emitter *e,
                    imp_v3 eye, imp_v3 d)
{
    const double just_before = 1 - 1e-3;
    struct imp_hit hit;
    if (!e->shape) return !imp__occluded_at(scene, 0, &eye, &d, 0, just_before);
    return !imp__intersect(scene, &eye, &d, 0, just_before, &hit) ||
           (hit.place == 0 && scene->shapes[hit.shape] == e->shape);
}

bool imp__glare_look(const struct imp_scene *scene, const struct imp_emitter *e,
                     imp_v3 eye, imp_v3 sight, imp_v3 up, struct imp__glare_seen *out)
{
    const struct imp__ies *x = e->self;
    if (e->ops != &imp__ies_light && e->ops != &imp__ies_area) return false;
    const imp_v3 at = e->shape ? (e->shape->lo + e->shape->hi) * 0.5 : x->position;
    const imp_v3 d = at - eye;
    const double r = imp__length(d);
    if (!(r > 0)) return false;
    const imp_v3 w = d * (1 / r), back = -w;
    const double ahead = imp__dot(w, sight);
    if (!(ahead > 0) || !is_free(scene, e, eye, d)) return false;
    const double intensity = imp__ies_intensity(x, back) * scale_of(scene, e);
    const double area =
        e->shape ? imp__ies_projected(x, back) : imp__ies_opening(x, back);
    if (!(intensity > 0)) return false;
    const imp_v3 across = w - sight * ahead;
    const double side = imp__length(across);
    const double a =
        side > 1e-12 ? acos(imp_clamp(fabs(imp__dot(across, up)) / side, 0.0, 1.0)) : 0;
    const double b = acos(imp_clamp(ahead, 0.0, 1.0));
    out->direct = intensity * ahead / (r * r);
    out->source = (struct imp_glare_source){
        area > 0 ? intensity / area : INFINITY, area / (r * r),
        imp_guth_position(fmin(a / DEGREE, 90), fmin(b / DEGREE, 90))};
    return true;
}

enum imp_status imp__glare_area_check(const struct imp_scene *scene,
                                      const struct imp_emitter *e,
                                      const struct imp__glare_seen *s)
{
    if (s->source.solid_angle > 0) return IMP_OK;
    return imp__error(scene->ctx, IMP_E_ARG,
                      "luminaire '%s' has no luminous area: its file names no opening, "
                      "so give it a shape",
                      e->name);
}

static enum imp_status point_rate(const struct imp_scene *scene, imp_v3 eye, imp_v3 sight,
                                  imp_v3 up, double reading,
                                  struct imp_glare_source *source, double *background,
                                  double *ugr)
{
    size_t n = 0;
    double direct = 0;
    for (int i = 0; i < scene->n_emitters; i++) {
        const struct imp_emitter *e = scene->emitters[i];
        struct imp__glare_seen s;
        if (!imp__glare_look(scene, e, eye, sight, up, &s)) continue;
        IMP_CHECKED(imp__glare_area_check(scene, e, &s));
        source[n++] = s.source;
        direct += s.direct;
    }
    *background = (reading - direct) * IMP_INV_PI;
    if (!(*background > 0))
        return imp__error(scene->ctx, IMP_E_NUMERIC,
                          "at (%g, %g, %g) luminaires alone give %g lx of %g lx: no "
                          "background is left to rate glare by",
                          eye[0], eye[1], eye[2], direct, reading);
    return imp_ugr(scene->ctx, *background, n, source, ugr);
}

enum imp_status imp__glare_sight_check(const struct imp_scene *scene,
                                       const struct imp_sensor *s)
{
    const struct imp_receiver *r = s->receiver;
    if (r && r->absent && r->kind == IMP_PLANAR && fabs(r->facing[2]) < 1e-6)
        return IMP_OK;
    return imp__error(scene->ctx, IMP_E_ARG,
                      "sensor '%s' (%s) has no line of sight: glare is rated at an "
                      "irradiancemeter with a virtual, horizontal rectangle and a "
                      "horizontal 'facing'",
                      s->name, s->ops->name);
}

enum imp_status imp_grid_glare(imp_scene *scene, const struct imp_run *run, double *ugr,
                               double *se)
{
    enum imp_status st = IMP_OK;
    const struct imp_sensor *s;
    struct imp_run own;
    struct imp_estimate mean;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, ugr, "ugr");
    IMP_RUN(scene->ctx, own, run);
    IMP_CHECKED(imp__run_sensor(scene, &own, &s));
    const struct imp_receiver *r = s->receiver;
    IMP_CHECKED(imp__glare_sight_check(scene, s));
    const size_t n = (size_t)s->film.crop_w * (size_t)s->film.crop_h;
    double *value = imp__alloc(scene->ctx, 5 * n, sizeof *value);
    double *error = value + n, *place = error + n;
    struct imp_glare_source *source =
        imp__alloc(scene->ctx, (size_t)scene->n_emitters + 1, sizeof *source);
    if (!value || !source)
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory for glare"));
    IMP_TRY(imp_grid_points(scene, own.sensor, place, NULL));
    IMP_TRY(imp_grid_read(scene, &own, value, error, &mean, NULL));
    const imp_v3 sight = imp__to_world(&r->frame, r->facing);
    for (size_t i = 0; i < n; i++) {
        const imp_v3 eye = imp__v3(place[3 * i], place[3 * i + 1], place[3 * i + 2]);
        double background = 0, rating = 0;
        IMP_TRY(point_rate(scene, eye, sight, r->frame.n, value[i], source, &background,
                           &rating));
        value[i] = rating;
        /* dUGR = 8/ln 10 dLb/Lb. */
        error[i] = 8 / log(10) * error[i] * IMP_INV_PI / background;
    }
    for (size_t i = 0; i < n; i++) {
        ugr[i] = value[i];
        if (se) se[i] = error[i];
    }
out:
    imp__release(scene->ctx, value);
    imp__release(scene->ctx, source);
    return st;
}
