/* SPDX-License-Identifier: Apache-2.0
 *
 * Velocities of cameras and lights, and the transposes (moves.h). */
#include "moves.h"

/* At r from the camera's centre, by the one number of a mover that is no pose. */
static imp_v3 view_velocity(const struct imp__moves *moves, const struct imp__mover *m,
                            imp_v3 r)
{
    const struct imp_sensor *s = moves->sensor;
    imp_v3 v = {0};
    if (imp__is_zero(r)) return v; /* what is there moves along no film */
    s->ops->view_velocity(s, (int)m->kind - IMP_MOVE_VIEW, &r, &v);
    return v;
}

imp_v3 imp__camera_velocity(const struct imp__moves *moves, imp_v3 p,
                            const double *theta_dot)
{
    imp_v3 u = {0};
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != IMP_MOVE_CAMERA) continue;
        const double *theta = theta_dot + m->first;
        const imp_v3 r = p - m->centre;
        if (m->kind == IMP_MOVE_POSE)
            u += imp__move_vector(theta) + imp__cross(imp__move_vector(theta + 3), r);
        else u += view_velocity(moves, m, r) * theta[0];
    }
    return u;
}

void imp__camera_velocity_bar(const struct imp__moves *moves, imp_v3 p, imp_v3 bar,
                              double *theta_bar)
{
    for (int k = 0; k < moves->n_movers; k++) {
        const struct imp__mover *m = &moves->mover[k];
        if (m->shape != IMP_MOVE_CAMERA) continue;
        const imp_v3 r = p - m->centre;
        if (m->kind == IMP_MOVE_POSE) {
            imp__move_vector_bar(theta_bar + m->first, bar);
            imp__move_vector_bar(theta_bar + m->first + 3, imp__cross(r, bar));
        } else {
            theta_bar[m->first] += imp__dot(view_velocity(moves, m, r), bar);
        }
    }
}

/* Across the direction of parallel light, or a spot's axis; a place in full. */
static imp_v3 light_part(const struct imp__moves *moves, const struct imp__mover *m,
                         imp_v3 v)
{
    const struct imp_emitter *e = moves->scene->emitters[IMP_MOVE_EMITTER(m->shape)];
    if (m->kind != IMP_MOVE_AXIS && !(e->ops->flags & IMP_EMITTER_FAR)) return v;
    return (v - m->axis * imp__dot(m->axis, v)) * m->rate;
}

imp_v3 imp__light_velocity(const struct imp__moves *moves, int k, const double *theta_dot)
{
    imp_v3 out = {0};
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape == IMP_MOVE_EMITTER(k) && m->kind == IMP_MOVE_LIGHT)
            out += light_part(moves, m, imp__move_vector(theta_dot + m->first));
    }
    return out;
}

void imp__light_velocity_bar(const struct imp__moves *moves, int k, imp_v3 bar,
                             double *theta_bar)
{
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape == IMP_MOVE_EMITTER(k) && m->kind == IMP_MOVE_LIGHT)
            imp__move_vector_bar(theta_bar + m->first, light_part(moves, m, bar));
    }
}

/* An axis a that is turned on the shortest way from r to b turns the light about a line across both;
 * where b then goes by db, the light turns by
 *
 *     b x db - b (r x b) . db/(1 + r . b),
 *
 * as triangles on the sphere turn what is carried around them by their area. */
void imp__light_axis_bar(const struct imp__moves *moves, int k, imp_v3 turn_bar,
                         double *theta_bar)
{
    for (int j = 0; j < moves->n_movers; j++) {
        const struct imp__mover *m = &moves->mover[j];
        if (m->shape != IMP_MOVE_EMITTER(k) || m->kind != IMP_MOVE_AXIS) continue;
        const double cosine = imp__dot(m->rest, m->axis);
        imp_v3 bar = imp__cross(turn_bar, m->axis);
        if (1 + cosine > 1e-12)
            bar -= imp__cross(m->rest, m->axis) *
                   (imp__dot(turn_bar, m->axis) / (1 + cosine));
        imp__move_vector_bar(theta_bar + m->first, light_part(moves, m, bar));
    }
}
