/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of a volume that is placed by numbers, differentiated by these (placed.h). */
#include "placed.h"
#include "math/vec.h"

int imp__placed_velocities(const struct imp_placed *placed, enum imp_placed_how how,
                           imp_v3 p, imp_v3 velocity[12])
{
    const imp_v3 r = p - placed->middle;
    switch (how) {
    case IMP_PLACED_POSE:
        for (int k = 0; k < 3; k++) {
            velocity[k] = imp__v3(k == 0, k == 1, k == 2);
            velocity[3 + k] = imp__cross(placed->turn[k], r);
        }
        return 6;
    case IMP_PLACED_SCALE: velocity[0] = r * (1 / placed->scale); return 1;
    case IMP_PLACED_MAP: break;
    }
    const imp_v3 x = imp__point(&placed->from_world, p);
    for (int k = 0; k < 12; k++)
        velocity[k] =
            imp__v3(k / 4 == 0, k / 4 == 1, k / 4 == 2) * (k % 4 == 3 ? 1 : x[k % 4]);
    return 12;
}

static imp_spec against(const imp_spec gradient[3], imp_v3 velocity)
{
    return -(gradient[0] * velocity[0] + gradient[1] * velocity[1] +
             gradient[2] * velocity[2]);
}

void imp__placed_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    imp_spec gradient[3];
    imp_v3 velocity[12];
    if (!t->ops->gradient(t, at, scalar, gradient)) return;
    for (int i = 0; i < t->placed->n; i++) {
        const struct imp_placed_by *by = &t->placed->by[i];
        const int n = imp__placed_velocities(t->placed, by->how, at->p, velocity);
        for (int k = 0; k < n; k++) {
            const imp_spec part = *bar * against(gradient, velocity[k]);
            sink->add(sink, by->param, (size_t)k, 1, &part);
        }
    }
}

void imp__placed_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, imp_dot_fn *dot, const void *x_dot,
                         imp_spec *value_dot)
{
    imp_spec gradient[3];
    imp_v3 velocity[12];
    if (!t->ops->gradient(t, at, scalar, gradient)) return;
    for (int i = 0; i < t->placed->n; i++) {
        const struct imp_placed_by *by = &t->placed->by[i];
        const int n = imp__placed_velocities(t->placed, by->how, at->p, velocity);
        imp_v3 sum = {0};
        for (int k = 0; k < n; k++) sum += velocity[k] * dot(x_dot, by->param, (size_t)k);
        *value_dot += against(gradient, sum);
    }
}
