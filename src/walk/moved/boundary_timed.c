/* SPDX-License-Identifier: Apache-2.0
 *
 * What scenes must not hold in which instances move in time (boundary.h): refused by name. */
#include "boundary_allowed.h"
#include "kind/sensor/receiver.h"

static const char *scene_why(const struct imp__boundary *b)
{
    return b->fog || b->media ? "there are media"
           : b->mirrors       ? "there are mirrors, or glass"
           : b->passes        ? "a material lets light go straight on"
           : b->one_sided     ? "there are curves"
           : b->rays          ? "the sensor measures along single rays, which edges cross"
           : imp__meter_is_points(b->tracer->sensor)
               ? "the sensor is a meter at points, over which shadows pass"
               : NULL;
}

static void box_add(imp_v3 box[2], imp_v3 p)
{
    for (int i = 0; i < 3; i++) {
        box[0][i] = imp_min(box[0][i], p[i]);
        box[1][i] = imp_max(box[1][i], p[i]);
    }
}

#define LENS 64 /* points of it that are looked at */

/* What looks or shines from within what moves in time would see its surface pass. */
static enum imp_status points_allowed(const struct imp__boundary *b, const double time[2])
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_sensor *s = b->tracer->sensor;
    int other, met = -1;
    for (int k = -1; k < scene->n_emitters; k++) {
        struct imp_emitter *e = k < 0 ? NULL : scene->emitters[k];
        imp_v3 box[2] = {imp__v3(INFINITY, INFINITY, INFINITY),
                         imp__v3(-INFINITY, -INFINITY, -INFINITY)};
        if (!e && s->shape && imp__shape_is_absent(s->shape)) {
            box[0] = s->shape->lo;
            box[1] = s->shape->hi;
        }
        imp_v3 near[4]; /* the near plane cuts what passes it */
        for (int i = 0; !e && !s->shape && i < 4 && imp__near_plane(s, near); i++)
            box_add(box, near[i]);
        if (!e && !s->shape && !b->parallel)
            for (uint32_t i = 0; i < LENS; i++) {
                const struct imp_key key = imp__key(5, 4, i);
                const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
                imp_v3 p;
                if (imp__lens_point(s, u, &p)) box_add(box, p);
            }
        if (e && e->ops->flags & IMP_EMITTER_DELTA &&
            !(e->ops->flags & IMP_EMITTER_FAR)) {
            double at[3];
            e->ops->aim(e, at, false);
            box_add(box, imp__v3(at[0], at[1], at[2]));
        }
        if (box[0][0] <= box[1][0])
            met = imp__clocks_meet(b->edges, scene, time, box, &other);
        if (met >= 0)
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: shape '%s', in an instance that "
                "moves in time, may pass %s '%s'",
                scene->shapes[met]->name, e ? "light" : "sensor",
                e         ? (e->name ? e->name : "")
                : s->name ? s->name
                          : "");
    }
    return IMP_OK;
}

enum imp_status imp__timed_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_sensor *s = b->tracer->sensor;
    const double time[2] = {s->open, s->close};
    int timed = -1, other;
    for (size_t k = 0; k < b->edges->n_bodies && timed < 0; k++)
        if (imp__place_clock(scene, b->edges->body[k].place) >= 0)
            timed = b->edges->body[k].shape;
    if (timed < 0) return IMP_OK;
    const char *why = scene_why(b);
    if (why)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: shape '%s' is in an instance that "
                          "moves in time, and %s",
                          scene->shapes[timed]->name, why);
    const int met = imp__clocks_meet(b->edges, scene, time, NULL, &other);
    if (met >= 0)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: shape '%s', in an instance that "
                          "moves in time, may meet shape '%s' on its way",
                          scene->shapes[met]->name, scene->shapes[other]->name);
    return points_allowed(b, time);
}
