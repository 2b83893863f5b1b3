/* SPDX-License-Identifier: Apache-2.0
 *
 * The movers of parameters, and what adjoints of theirs are to them (moves.h). */
#include "affine.h"
#include "base/arguments.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include <math.h>
#include <string.h>

/* imp__mover.twist of a light's axis a. Opposite to z the frame may turn in any way: 0. */
static imp_v3 twist_of(const struct imp_pose *pose, imp_v3 a)
{
    const void *rest = pose->object->rest;
    const imp_v3 z = pose->emitter->ops == &imp__ies_light
                         ? ((const struct imp__ies *)rest)->nadir
                         : ((const struct imp__light_frame *)rest)->axis[2];
    const double sum = 1 + imp__dot(z, a);
    return sum > 1e-9 ? imp__cross(z, a) * (-1 / sum) : (imp_v3){0};
}

/* A sphere or a cylinder as it is now. */
static enum imp_status round_add(struct imp__moves *moves, const struct imp_pose *pose)
{
    struct imp_round round;
    const bool ball = imp__moves_sphere(moves->scene, pose->shape, 0, &round);
    IMP_CHECKED(imp__moves_add(moves,
                               !ball                           ? IMP_MOVE_AFFINE
                               : pose->kind == IMP_POSE_CENTER ? IMP_MOVE_POSE
                                                               : IMP_MOVE_SCALE,
                               pose->shape));
    if (ball && pose->kind == IMP_POSE_RADIUS)
        moves->mover[moves->n_movers - 1].rate = 1 / pose->number[0];
    return IMP_OK;
}

/* A mover for each instance, about where the group's centre is in it. */
static enum imp_status group_add(struct imp__moves *moves, const struct imp_pose *pose)
{
    const struct imp_pose *rigid = imp__pose_beside(pose, IMP_POSE_RIGID);
    const struct imp_instance *rest = pose->object->rest;
    imp_v3 centre = pose->object->centre;
    for (int i = 0; rigid && i < 3; i++) centre[i] += rigid->number[i];
    for (int k = 0; k < moves->scene->world->n_instances; k++) {
        if (!imp__group_has(pose, k)) continue;
        IMP_CHECKED(imp__moves_add(
            moves, pose->kind == IMP_POSE_SCALE ? IMP_MOVE_SCALE : IMP_MOVE_POSE,
            IMP_MOVE_INSTANCE(k)));
        struct imp__mover *m = &moves->mover[moves->n_movers - 1];
        m->centre = imp__map_point(&rest[k].to_world, centre);
        if (pose->kind == IMP_POSE_SCALE) m->rate = 1 / pose->number[0];
    }
    return IMP_OK;
}

/* An instance that its group moves by e, a moves by  L e  and turns by  det(L) L a/|det L|^(4/3),
 * with L the linear part of its placement, which turns, scales and mirrors alone. */
static void group_bar(const struct imp__mover *mover, const struct imp_pose *pose,
                      double *bar)
{
    const struct imp_instance *rest = pose->object->rest;
    const struct imp_map *L = &rest[mover->shape - IMP_MOVE_INSTANCE(0)].to_world;
    const imp_v3 x = imp__v3(L->m[0], L->m[4], L->m[8]),
                 y = imp__v3(L->m[1], L->m[5], L->m[9]),
                 z = imp__v3(L->m[2], L->m[6], L->m[10]);
    const double det = imp__dot(x, imp__cross(y, z)), turn = det / pow(fabs(det), 4. / 3);
    const imp_v3 e = imp__move_vector(bar), a = imp__move_vector(bar + 3) * turn;
    const double out[6] = {imp__dot(x, e), imp__dot(y, e), imp__dot(z, e),
                           imp__dot(x, a), imp__dot(y, a), imp__dot(z, a)};
    memcpy(bar, out, sizeof out);
}

enum imp_status imp__moves_add_pose(struct imp__moves *moves, const struct imp_pose *pose)
{
    if (imp__pose_is_round(pose->kind)) return round_add(moves, pose);
    if (pose->group >= 0) return group_add(moves, pose);
    static const enum imp__move_kind kind[IMP_POSE_KINDS] = {
        [IMP_POSE_RIGID] = IMP_MOVE_POSE,        [IMP_POSE_RIGID_END] = IMP_MOVE_KEY,
        [IMP_POSE_SCALE] = IMP_MOVE_SCALE,       [IMP_POSE_WORLD] = IMP_MOVE_AFFINE,
        [IMP_POSE_VERTICES] = IMP_MOVE_VERTICES, [IMP_POSE_NORMALS] = IMP_MOVE_NORMALS,
        [IMP_POSE_CONTROL] = IMP_MOVE_CONTROL,   [IMP_POSE_POSITION] = IMP_MOVE_LIGHT,
        [IMP_POSE_DIRECTION] = IMP_MOVE_LIGHT,   [IMP_POSE_TURN] = IMP_MOVE_TURN,
        [IMP_POSE_SUN] = IMP_MOVE_SUN,           [IMP_POSE_SUN_RADIUS] = IMP_MOVE_DISC,
        [IMP_POSE_PICTURE] = IMP_MOVE_SPREAD};
    int shape = pose->sensor          ? IMP_MOVE_CAMERA
                : pose->instance >= 0 ? IMP_MOVE_INSTANCE(pose->instance)
                                      : pose->shape;
    for (int k = 0; pose->emitter && k < moves->scene->n_emitters; k++)
        if (moves->scene->emitters[k] == pose->emitter) shape = IMP_MOVE_EMITTER(k);
    const bool turns = pose->kind == IMP_POSE_DIRECTION &&
                       !(pose->emitter->ops->flags & IMP_EMITTER_FAR);
    const bool key = pose->instance >= 0 &&
                     moves->scene->world->instance[pose->instance].motion != NULL;
    const enum imp_status st = imp__moves_add(
        moves,
        key     ? IMP_MOVE_KEY
        : turns ? IMP_MOVE_AXIS
        : imp__pose_is_view(pose->kind)
            ? (enum imp__move_kind)(IMP_MOVE_VIEW + pose->kind - IMP_POSE_FOV)
            : kind[pose->kind],
        shape);
    if (st != IMP_OK) return st;
    struct imp__mover *m = &moves->mover[moves->n_movers - 1];
    const struct imp_pose *rigid = imp__pose_beside(pose, IMP_POSE_RIGID);
    if (key) {
        m->key = pose->kind == IMP_POSE_RIGID_END;
        m->centre =
            pose->centre + imp__v3(pose->number[0], pose->number[1], pose->number[2]);
        return IMP_OK;
    }
    if (pose->shape >= 0 || pose->instance >= 0 || pose->kind == IMP_POSE_RIGID) {
        m->centre = pose->object->centre;
        for (int i = 0; rigid && i < 3; i++) m->centre[i] += rigid->number[i];
    }
    if (pose->kind == IMP_POSE_WORLD) m->centre = imp__world_centre(pose);
    if (pose->kind == IMP_POSE_SCALE) m->rate = 1 / pose->number[0];
    if (pose->kind == IMP_POSE_DIRECTION || pose->kind == IMP_POSE_SUN)
        m->rate =
            1 / imp__length(imp__v3(pose->number[0], pose->number[1], pose->number[2]));
    if (turns && !imp__pose_is_far(pose->emitter)) m->twist = twist_of(pose, m->axis);
    return IMP_OK;
}

void imp__pose_numbers_bar(const struct imp__moves *moves, const struct imp__mover *mover,
                           const struct imp_pose *pose, double *bar)
{
    if (mover->fans)
        imp__fans_normals_bar(mover->fans, &moves->scene->shapes[mover->shape]->triangles,
                              bar + mover->count / 2, bar);
    struct imp__tube tube;
    if (pose->kind == IMP_POSE_WORLD) {
        imp__world_bar(pose, mover->centre, bar);
        return;
    }
    if (mover->kind == IMP_MOVE_AFFINE &&
        imp__moves_cylinder(pose->scene, pose->shape, 0, &tube))
        imp__ends_bar(&tube, mover->centre, pose->kind, bar);
    if (!imp__pose_is_rigid(pose->kind) && pose->kind != IMP_POSE_TURN) return;
    if (pose->group >= 0) group_bar(mover, pose, bar);
    double *a_bar = bar + (pose->kind == IMP_POSE_TURN ? 0 : 3);
    const double *a = pose->number + (a_bar - bar);
    const imp_v3 turn = imp__move_vector(a_bar);
    for (int i = 0; i < 3; i++) a_bar[i] = 0;
    struct imp_round round;
    if (pose->shape >= 0 && imp__moves_sphere(pose->scene, pose->shape, 0, &round) &&
        !imp__pose_looks_up(pose->scene, pose->scene->shapes[pose->shape]) &&
        !pose->object->table)
        return; /* turned about its centre it is where it was */
    imp__rotation_bar(a, turn, a_bar);
}
