/* SPDX-License-Identifier: Apache-2.0
 *
 * Reads to_world and flip_normals of analytic shapes. */
#include "shape.h"

enum imp_status imp__shape_placement(const struct imp_build *b, struct imp_shape *s,
                                     struct imp_placement *out)
{
    enum imp_status st = IMP_OK;
    struct imp_placement p;
    double weight;

    IMP_TRY(imp_build_transform(b, "to_world", p.to_world.m));
    IMP_TRY(imp_build_bool(b, "flip_normals", false, &s->flip_normals));
    IMP_TRY(imp_build_float(b, "silhouette_sampling_weight", 1, &weight));
    if (!imp__mat4_is_finite(&p.to_world))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE, "to_world is not finite"));
    if (!imp__mat4_is_affine(&p.to_world))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is not affine: its last row must be 0 0 0 1"));
    if (!imp__mat4_inverse(&p.to_world, &p.to_local))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is singular: it flattens the shape"));
    p.mirrored = imp__mat4_det3(&p.to_world) < 0;
    *out = p;
out:
    return st;
}

/* Gram and Schmidt, x first: for a rotation and scales it is the exact decomposition. */
bool imp__placement_frame(const struct imp_mat4 *to_world, int equal,
                          struct imp_frame *frame, double length[3])
{
    imp_v3 e[3];
    bool exact = true;
    for (int i = 0; i < 3; i++) {
        e[i] = imp__mat4_column(to_world, i);
        length[i] = imp__length(e[i]);
        e[i] = e[i] * (1 / length[i]);
        for (int j = 0; j < i; j++) {
            exact &= fabs(imp__dot(e[i], e[j])) < 1e-6;
            e[i] = e[i] - e[j] * imp__dot(e[i], e[j]);
        }
        e[i] = imp__normalize(e[i]);
        /* Nearly parallel columns cancel: once more. */
        for (int j = 0; j < i && !exact; j++) e[i] -= e[j] * imp__dot(e[i], e[j]);
        if (!exact) e[i] = imp__normalize(e[i]);
    }
    for (int i = 1; i < equal; i++)
        exact &= fabs(length[i] - length[0]) < 1e-6 * length[0];
    *frame = (struct imp_frame){e[0], e[1], e[2]};
    return exact;
}
