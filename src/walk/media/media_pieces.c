/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of a walk through media with respect to coefficients of the media: at points
 * where they scatter, and along segments, from which a baseline of the arriving light is
 * subtracted (path/baseline.h). */
#include "media_pieces.h"
#include "walk/core/vertex.h"

/* What derivatives of fixed flights take from the light that arrives. */
static imp_spec baseline(const struct imp_tracer *tracer)
{
    return tracer->collisions_fixed ? (imp_spec){0} : tracer->baseline;
}

void imp__extinction_drop(const struct imp_tracer *tracer, const struct imp_vertex *v,
                          imp_spec *x)
{
    const struct imp_medium *m;
    if (v->d.scatterer != IMP_IN_MEDIUM || tracer->collisions_fixed || v->d.fixed) return;
    m = v->bsdf->self;
    for (int j = 0; j < m->n_own; j++)
        if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION) x[j] = (imp_spec){0};
}

void imp__point_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                        const struct imp_texcoord *at, const imp_spec *bar,
                        struct imp_sink *sink)
{
    const struct imp_medium *m = v->bsdf->self;
    for (int j = 0; j < m->n_in; j++)
        if (j >= m->n_own || tracer->collisions_fixed || v->d.fixed ||
            !(m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION))
            imp__inputs_scatter(&m->input[j], 1, at, &bar[j], sink);
}

/* w_k without the value of what the segment crosses. */
static imp_spec weight_before(const struct imp_vertex *v)
{
    const double scale = (double)v->d.passes / ((double)v->d.pdf * (double)v->d.survive);
    imp_spec f = imp__spec(1);
    if (v->bsdf) {
        const struct imp_dirs dirs = imp__vertex_dirs(v);
        imp__bsdf_eval(v->bsdf, v->carried, v->in, &dirs, &f);
    } else if (v->d.scatterer == IMP_AT_LIGHT) {
        f = v->in[0];
    }
    return f * scale;
}

/* Does a term of its own give the derivative of the segment that goes on? */
static bool segment_counts(const struct imp_tracer *tracer, const struct imp_vertex *v)
{
    return v->on && v->d.goes_on && imp__track_counts(tracer, v->on);
}

/* d B_k / d T of the way to the light. */
static imp_spec light_before(const struct imp_vertex *v)
{
    return v->light_f * v->light_e * (double)v->d.light.weight;
}

/* T of the way to the light. */
static imp_spec to_light_value(const struct imp_vertex *v)
{
    return v->light_w * (1 / (double)v->d.light.weight);
}

void imp__media_pieces(const struct imp_pieces_ops *ops, void *taker,
                       const struct imp_tracer *tracer, const struct imp_vertex *v,
                       const struct imp_adjoints *a)
{
    if (v->to_light) {
        const imp_spec T = to_light_value(v);
        ops->track(taker, v->to_light, v->carried, &T, a->lit * light_before(v));
    }
    if (segment_counts(tracer, v))
        ops->track(taker, v->on, v->carried, NULL,
                   a->P * weight_before(v) * (v->beyond - baseline(tracer)));
    if (v->probe) {
        const struct imp_medium *m = v->probe->medium;
        imp_spec d[IMP_INPUTS_MAX];
        imp__probe_d(tracer, v, d);
        for (int j = 0; j < m->n_own; j++) {
            d[j] *= a->P;
            if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)
                ops->input(taker, &m->input[j], &v->probe->at, &d[j]);
        }
    }
}
