/* SPDX-License-Identifier: Apache-2.0
 *
 * Velocities of cameras and lights, and the transposes (moves.h). */
#include "affine.h"

/* At p, by the one number of a mover that is no pose. */
static imp_v3 view_velocity(const struct imp__moves *moves, const struct imp__mover *m,
                            imp_v3 eye, imp_v3 p)
{
    const struct imp_sensor *s = moves->sensor;
    const int k = (int)m->kind - IMP_MOVE_VIEW;
    const imp_v3 r = p - m->centre, from = eye - m->centre;
    imp_v3 v = {0};
    if (imp__is_zero(r)) return v; /* what is there moves along no film */
    if (s->ops->lens_velocity) s->ops->lens_velocity(s, k, &r, &from, &v);
    else s->ops->view_velocity(s, k, &r, &v);
    return v;
}

imp_v3 imp__camera_velocity(const struct imp__moves *moves, imp_v3 eye, imp_v3 p,
                            const double *theta_dot)
{
    imp_v3 u = {0};
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != IMP_MOVE_CAMERA) continue;
        const double *theta = theta_dot + m->first;
        if (m->kind == IMP_MOVE_POSE)
            u += imp__move_vector(theta) +
                 imp__cross(imp__move_vector(theta + 3), p - m->centre);
        else if (m->kind == IMP_MOVE_TURN)
            u += imp__cross(imp__move_vector(theta), p - m->centre);
        else if (m->kind == IMP_MOVE_AFFINE) u += imp__affine_place(p - m->centre, theta);
        else u += view_velocity(moves, m, eye, p) * theta[0];
    }
    return u;
}

void imp__camera_velocity_bar(const struct imp__moves *moves, imp_v3 eye, imp_v3 p,
                              imp_v3 bar, double *theta_bar)
{
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != IMP_MOVE_CAMERA) continue;
        if (m->kind == IMP_MOVE_POSE) {
            imp__move_vector_bar(theta_bar + m->first, bar);
            imp__move_vector_bar(theta_bar + m->first + 3,
                                 imp__cross(p - m->centre, bar));
        } else if (m->kind == IMP_MOVE_TURN) {
            imp__move_vector_bar(theta_bar + m->first, imp__cross(p - m->centre, bar));
        } else if (m->kind == IMP_MOVE_AFFINE) {
            imp__affine_place_bar(p - m->centre, bar, theta_bar + m->first);
        } else {
            theta_bar[m->first] += imp__dot(view_velocity(moves, m, eye, p), bar);
        }
    }
}

/* Across the direction of parallel light, or a spot's axis; a place in full. */
static imp_v3 light_part(const struct imp__moves *moves, const struct imp__mover *m,
                         imp_v3 v)
{
    const struct imp_emitter *e = moves->scene->emitters[IMP_MOVE_EMITTER(m->shape)];
    if (m->kind != IMP_MOVE_AXIS && m->kind != IMP_MOVE_SUN &&
        !(e->ops->flags & IMP_EMITTER_FAR))
        return v;
    return (v - m->axis * imp__dot(m->axis, v)) * m->rate;
}

/* The velocity of the direction p to a disc about the axis, or from it, at the angle g to that:
 * (p cos g - axis)/sin g points away from the middle, and tan(g/2)/sin g = 1/(1 + cos g). */
static imp_v3 disc_velocity(const struct imp__mover *m, imp_v3 p)
{
    const double c = imp__dot(m->axis, p), side = c < 0 ? -1 : 1;
    return (p * c - m->axis) * (side * m->rate / (1 + fabs(c)));
}

imp_v3 imp__light_velocity(const struct imp__moves *moves, int k, imp_v3 p,
                           const double *theta_dot)
{
    const bool sky = moves->scene->emitters[k]->ops->flags & IMP_EMITTER_ENVIRONMENT;
    imp_v3 out = {0};
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape != IMP_MOVE_EMITTER(k) || m->kind == IMP_MOVE_SPREAD) continue;
        const imp_v3 e = imp__move_vector(theta_dot + m->first);
        if (m->kind == IMP_MOVE_AFFINE) out += e; /* a light at a point, the middle */
        if (m->kind == IMP_MOVE_LIGHT) out += light_part(moves, m, e);
        if (m->kind == IMP_MOVE_TURN) out += imp__cross(e, p);
        if (m->kind == IMP_MOVE_DISC) out += disc_velocity(m, p) * theta_dot[m->first];
        if (m->kind == IMP_MOVE_SUN || (m->kind == IMP_MOVE_AXIS && sky))
            out += imp__cross(imp__cross(m->axis, light_part(moves, m, e)), p);
    }
    return out;
}

void imp__light_velocity_bar(const struct imp__moves *moves, int k, imp_v3 p, imp_v3 bar,
                             double *theta_bar)
{
    if (moves->scene->emitters[k]->ops->flags & IMP_EMITTER_ENVIRONMENT) {
        imp__light_turn_bar(moves, k, imp__cross(p, bar), theta_bar);
        for (int j = 0; j < moves->n_movers; j++) {
            const struct imp__mover *m = &moves->mover[j];
            if (m->shape == IMP_MOVE_EMITTER(k) && m->kind == IMP_MOVE_DISC)
                theta_bar[m->first] += imp__dot(disc_velocity(m, p), bar);
        }
        return;
    }
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape != IMP_MOVE_EMITTER(k)) continue;
        if (m->kind == IMP_MOVE_AFFINE) imp__move_vector_bar(theta_bar + m->first, bar);
        if (m->kind == IMP_MOVE_LIGHT)
            imp__move_vector_bar(theta_bar + m->first, light_part(moves, m, bar));
    }
}

imp_v3 imp__light_turn(const struct imp__moves *moves, int k, const double *theta_dot)
{
    imp_v3 out = {0};
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape != IMP_MOVE_EMITTER(k)) continue;
        const double *theta = theta_dot + m->first;
        if (m->kind == IMP_MOVE_AFFINE) out += imp__affine_turn(theta);
        if (m->kind == IMP_MOVE_TURN) out += imp__move_vector(theta);
        if (m->kind == IMP_MOVE_AXIS || m->kind == IMP_MOVE_SUN) {
            const imp_v3 e = light_part(moves, m, imp__move_vector(theta));
            out += imp__cross(m->axis, e) + m->axis * imp__dot(m->twist, e);
        }
    }
    return out;
}

void imp__light_turn_bar(const struct imp__moves *moves, int k, imp_v3 turn_bar,
                         double *theta_bar)
{
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape != IMP_MOVE_EMITTER(k)) continue;
        if (m->kind == IMP_MOVE_AFFINE)
            imp__affine_turn_bar(turn_bar, theta_bar + m->first);
        if (m->kind == IMP_MOVE_TURN)
            imp__move_vector_bar(theta_bar + m->first, turn_bar);
        if (m->kind == IMP_MOVE_AXIS || m->kind == IMP_MOVE_SUN)
            imp__move_vector_bar(theta_bar + m->first,
                                 light_part(moves, m,
                                            imp__cross(turn_bar, m->axis) +
                                                m->twist * imp__dot(turn_bar, m->axis)));
    }
}

/* By the logarithm of the screen's width. */
static imp_v3 spread_velocity(const struct imp__mover *m, imp_v3 r)
{
    return (r - m->axis * imp__dot(m->axis, r)) * m->rate;
}

imp_v3 imp__light_spread(const struct imp__moves *moves, int k, imp_v3 r,
                         const double *theta_dot)
{
    imp_v3 out = {0};
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape == IMP_MOVE_EMITTER(k) && m->kind == IMP_MOVE_SPREAD)
            out += spread_velocity(m, r) * theta_dot[m->first];
    }
    return out;
}

void imp__light_spread_bar(const struct imp__moves *moves, int k, imp_v3 r, imp_v3 bar,
                           double *theta_bar)
{
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape == IMP_MOVE_EMITTER(k) && m->kind == IMP_MOVE_SPREAD)
            theta_bar[m->first] += imp__dot(spread_velocity(m, r), bar);
    }
}
