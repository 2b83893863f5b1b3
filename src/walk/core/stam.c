/* SPDX-License-Identifier: Apache-2.0
 *
 * What only Stam's walk does (Stam 2020): it ends by absorption, and the derivative of a
 * lobe's exponent may follow the direction that was drawn with it. */
#include "step.h"
#include "vertex.h"

bool imp__absorb(struct imp_step *s, const struct imp_bsdf *b, double *weight)
{
    const double a = b->absorb;
    if (!(a > 0)) return false;
    if (imp__step_number(s, IMP_DIM_SURVIVE) < a) {
        s->walk->absorbed = true;
        *weight = imp__decide1(1 / a);
        return true;
    }
    *weight = 0;
    return false;
}

void imp__attached_d(const struct imp_walk *walk, const struct imp_vertex *v, int depth,
                     imp_spec *d)
{
    const struct imp_bsdf *b = v->bsdf;
    if (!b->ops->sample_d) return;
    const struct imp_dirs dirs = imp__vertex_dirs(v);
    const struct imp_key key = walk->key;
    const struct imp_point point = walk->point;
    const double u[3] = {imp__vertex_number(key, point, depth, IMP_DIM_LOBE),
                         imp__vertex_number(key, point, depth, IMP_DIM_DIR_U),
                         imp__vertex_number(key, point, depth, IMP_DIM_DIR_V)};
    for (int j = 0; j < b->n_in; j++) {
        imp_spec dweight;
        imp_v3
            dwi; /* its factor, the slope of what arrives, is 0 where this is allowed */
        if (b->ops->sample_d(b, v->in, u, &dirs, j, &dweight, &dwi))
            d[j] = dweight * (v->scale * (double)v->d.pdf); /* 1/s */
    }
}
