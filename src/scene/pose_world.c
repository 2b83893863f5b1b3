/* SPDX-License-Identifier: Apache-2.0
 *
 * NAME.to_world: objects by the map that puts them where they are (pose.h). Its determinant keeps its
 * sign, so that no surface turns inside out on the way. */
#include "base/context.h"
#include "instances.h"
#include "kind/emitter/from_point.h"
#include "kind/shape/shape.h"
#include "math/transform.h"
#include "pose.h"
#include <string.h>

extern const struct imp_emitter_ops imp__area;
extern const struct imp_shape_ops imp__rectangle, imp__disk, imp__cylinder;

/* Points of lights and meters are drawn by areas. Those of a rectangle or disk are evenly spread
 * wherever it is, and its own area follows. */
static const char *areas_why(const struct imp_scene *scene, const struct imp_shape *s)
{
    const bool follows = s->ops == &imp__rectangle || s->ops == &imp__disk;
    for (int k = 0; k < scene->n_emitters; k++)
        if (scene->emitters[k]->shape == s &&
            (!follows || scene->emitters[k]->ops != &imp__area))
            return "it is a light, and no area light on a rectangle or disk: it has a "
                   "pose";
    for (int k = 0; k < scene->n_sensors; k++)
        if (scene->sensors[k]->shape == s) return "it is a sensor: it has a pose";
    return NULL;
}

const char *imp__world_shape_why(const struct imp_scene *scene, const struct imp_shape *s)
{
    double to_world[12];
    if (!s->ops->placed ||
        !s->ops->placed((struct imp_shape *)(uintptr_t)s, to_world, false))
        return "it is none of mesh, cube, rectangle, disk, sphere and circular cylinder";
    return areas_why(scene, s);
}

/* Shapes in it that a map which stretches makes others. */
const char *imp__world_instance_why(const struct imp_scene *scene, int k)
{
    const struct imp_group *group = scene->world->instance[k].group;
    for (int i = 0; i < group->n_within; i++) {
        const struct imp_shape *s = scene->shapes[group->within[i]];
        struct imp_round round;
        if (imp__shape_round(s, &round) ||
            s->ops == &imp__cylinder || /* an oval one, too */
            s->geometry == IMP_CURVES)
            return "a sphere, cylinder or curve in it would be stretched: it has a pose "
                   "and a scale";
    }
    return NULL;
}

bool imp__world_is_free(const struct imp_pose *p)
{
    struct imp_round round;
    if (p->sensor) return p->sensor->ops->flags & IMP_SENSOR_PARALLEL;
    if (p->emitter) return false;
    return p->texture || p->shape < 0 ||
           !imp__shape_round(p->scene->shapes[p->shape], &round);
}

bool imp__world_is_moved(const struct imp_pose *p)
{
    return memcmp(p->number, p->start, sizeof p->start) != 0;
}

imp_v3 imp__world_centre(const struct imp_pose *p)
{
    const struct imp_mat4 from = imp__mat4_of_rows(p->start),
                          to = imp__mat4_of_rows(p->number);
    struct imp_mat4 back;
    if (!imp__world_is_moved(p) || !imp__mat4_inverse(&from, &back)) return p->centre;
    return imp__point(&to, imp__point(&back, p->centre));
}

void imp__world_read(const struct imp_pose *p, double to_world[12])
{
    if (p->shape >= 0) {
        struct imp_shape *s = p->scene->shapes[p->shape];
        s->ops->placed(s, to_world, false);
    } else if (p->instance >= 0) {
        memcpy(to_world, p->scene->world->instance[p->instance].to_world.m,
               12 * sizeof *to_world);
    } else if (p->sensor) {
        p->sensor->ops->placed(p->sensor, to_world, false);
    } else if (p->texture) {
        p->texture->ops->place(p->texture, to_world, false);
    } else {
        const struct imp__light_frame *f = p->emitter->self;
        imp__rows_of_columns(f->axis[0], f->axis[1], f->axis[2], f->origin, to_world);
    }
}

/* ---- Placing ------------------------------------------------------------------------- */

/* False: the first three columns are not those of a rotation (tolerance 1e-6). */
static bool frame_place(struct imp__light_frame *f, const double to_world[12])
{
    const struct imp_mat4 m = imp__mat4_of_rows(to_world);
    struct imp_frame axes;
    double length[3];
    const bool turned = imp__placement_frame(&m, 3, &axes, length);
    *f = (struct imp__light_frame){{axes.s, axes.t, axes.n}, imp__mat4_column(&m, 3)};
    return turned && fabs(length[0] - 1) < 1e-6;
}

/* What the object is no more; NULL: it is there. */
static const char *placed(const struct imp_pose *p)
{
    double to_world[12];
    memcpy(to_world, p->number, sizeof to_world);
    if (p->shape >= 0) {
        struct imp_shape *s = p->scene->shapes[p->shape];
        return s->ops->placed(s, to_world, true)
                   ? NULL
                   : "stretches or shears it, and it would be no sphere or circular "
                     "cylinder";
    }
    if (p->sensor)
        return p->sensor->ops->placed(p->sensor, to_world, true)
                   ? NULL
                   : "does more than turn and shift the camera";
    if (p->emitter)
        return frame_place(p->emitter->self, to_world)
                   ? NULL
                   : "does more than turn and shift the light";
    return NULL;
}

static enum imp_status instance_place(const struct imp_pose *p, const struct imp_mat4 *to)
{
    const struct imp_map map = imp__map_of(to);
    return imp__instance_place(p, p->instance, &map);
}

enum imp_status imp__world_apply(const struct imp_pose *p)
{
    const struct imp_mat4 from = imp__mat4_of_rows(p->start),
                          to = imp__mat4_of_rows(p->number);
    struct imp_mat4 back;
    const char *wrong = NULL;
    if (!imp__mat4_is_finite(&to)) wrong = "is not finite";
    else if (!imp__mat4_inverse(&to, &back))
        wrong = "is singular: it flattens the object";
    else if (!(imp__mat4_det3(&to) * imp__mat4_det3(&from) > 0))
        wrong = "turns the object inside out: its determinant has another sign";
    else if (p->instance >= 0) return instance_place(p, &to);
    else wrong = placed(p);
    return wrong ? imp__error(p->scene->ctx, IMP_E_NUMERIC, "%s %s",
                              p->scene->params[p->param].info.name, wrong)
                 : IMP_OK;
}
