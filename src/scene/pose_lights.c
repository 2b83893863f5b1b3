/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights without a shape are put where their parameters say (pose.h). */
#include "base/arguments.h"
#include "base/context.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include "kind/emitter/projector.h"
#include "kind/emitter/sky_sun.h"
#include "pose.h"
#include <string.h>

void imp__pose_aim(struct imp_emitter *e, enum imp_pose_kind kind, double v[3])
{
    if (kind != IMP_POSE_DIRECTION || imp__pose_is_far(e)) {
        e->ops->aim(e, v, false);
        return;
    }
    if (e->ops == &imp__ies_light) {
        const struct imp__ies *x = e->self;
        for (int k = 0; k < 3; k++) v[k] = x->nadir[k];
        return;
    }
    for (int k = 0; k < 3; k++) v[k] = imp__light_frame_of(e)->axis[2][k];
}

static void sky_turn(const struct imp_pose *p)
{
    double by[12];
    memcpy(p->emitter->self, p->rest, p->rest_size);
    if (imp__pose_turn_of(p, by)) p->emitter->ops->move(p->emitter, by);
}

/* A sky from where the file has its sun. */
static enum imp_status sun_apply(const struct imp_pose *p, const struct imp_pose *at,
                                 const struct imp_pose *radius)
{
    struct imp_emitter *e = p->emitter;
    struct imp__sky_sun sun;
    memcpy(e->self, p->rest, p->rest_size);
    imp__sky_sun_read(e, &sun);
    if (at) {
        const imp_v3 to = imp__v3(at->number[0], at->number[1], at->number[2]);
        if (!(imp__length(to) > 0))
            return imp__error(p->scene->ctx, IMP_E_NUMERIC, "%s is no direction",
                              p->scene->params[at->param].info.name);
        sun.towards = imp__normalize(to);
    }
    if (radius) sun.radius = radius->number[0];
    const bool moved = (at && memcmp(at->number, at->start, 3 * sizeof(double)) != 0) ||
                       (radius && radius->number[0] != radius->start[0]);
    const char *wrong = moved || sun.alone ? imp__sky_sun_set(e, &sun) : NULL;
    if (wrong)
        return imp__error(p->scene->ctx, IMP_E_NUMERIC, "%s %s",
                          p->scene->params[at ? at->param : radius->param].info.name,
                          wrong);
    if (e->ops->changed) e->ops->changed(e);
    return IMP_OK;
}

static enum imp_status place_apply(const struct imp_pose *p, const struct imp_pose *world)
{
    const struct imp_pose *sun = imp__pose_beside(p, IMP_POSE_SUN),
                          *radius = imp__pose_beside(p, IMP_POSE_SUN_RADIUS);
    if (sun || radius) IMP_CHECKED(sun_apply(p, sun, radius));
    if (world) return imp__world_apply(world);
    if (imp__pose_beside(p, IMP_POSE_WORLD)) {
        memcpy(p->emitter->self, p->rest, p->rest_size);
        return IMP_OK;
    }
    const struct imp_pose *at = imp__pose_beside(p, IMP_POSE_POSITION),
                          *to = imp__pose_beside(p, IMP_POSE_DIRECTION);
    const bool far = imp__pose_is_far(p->emitter) && to;
    const struct imp_pose *turn = imp__pose_beside(p, IMP_POSE_TURN);
    double v[3];
    if (turn) {
        sky_turn(turn);
        return IMP_OK;
    }
    if (at || far) {
        memcpy(v, far ? to->number : at->number, sizeof v);
        p->emitter->ops->aim(p->emitter, v, true);
    }
    if (!to || far) return IMP_OK;
    const imp_v3 axis = imp__v3(to->number[0], to->number[1], to->number[2]);
    if (p->emitter->ops == &imp__ies_light)
        imp__ies_turn(p->emitter->self, p->rest, axis);
    else imp__light_frame_turn(p->emitter->self, p->rest, axis);
    return IMP_OK;
}

enum imp_status imp__pose_light_apply(const struct imp_pose *p,
                                      const struct imp_pose *world)
{
    const struct imp_pose *picture = imp__pose_beside(p, IMP_POSE_PICTURE);
    if (picture) memcpy(p->emitter->self, p->rest, p->rest_size);
    IMP_CHECKED(place_apply(p, world));
    if (picture && picture->number[0] != picture->start[0])
        imp__projector_fov_set(p->emitter, picture->number[0]);
    return IMP_OK;
}

double imp__pose_turn_large(const struct imp_emitter *e, double large)
{
    struct imp_sky_circle circle[IMP_SKY_CIRCLES];
    const int n = e->ops->jumps ? e->ops->jumps(e, circle) : 0;
    for (int k = 0; k < n; k++)
        large = imp_min(large, 1.5 * acos(imp_clamp(circle[k].cosine, -1.0, 1.0)));
    return large;
}
