/* SPDX-License-Identifier: Apache-2.0
 *
 * Silhouettes between a light and what it lights (boundary.h). */
#include "boundary_parts.h"

static const struct imp_emitter *light_choose(const struct imp__boundary *b, double u,
                                              double *pmf)
{
    const struct imp_scene *scene = b->tracer->scene;
    int k = 0;
    while (k < scene->n_emitters - 1 && !(u < b->light_cdf[k])) k++;
    *pmf = b->light_cdf[k] - (k > 0 ? b->light_cdf[k - 1] : 0);
    return scene->emitters[k];
}

void imp__draw_light(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const struct imp_scene *scene = b->tracer->scene;
    if (b->n_lights == 0) return;
    double pmf;
    const struct imp_emitter *e = light_choose(b, imp__u01(d->key, IMP_EDGE_LIGHT), &pmf);
    const double u[2] = {imp__u01(d->key, IMP_EDGE_LIGHT_U),
                         imp__u01(d->key, IMP_EDGE_LIGHT_V)};
    struct imp_surface y, at;
    if (!(pmf > 0)) return;
    e->shape->ops->sample_area(e->shape, u, &y);
    if (!imp__edge_silhouette(d, y.p, false)) return;

    const imp_v3 r = d->p - y.p, turned = imp__cross(d->along, r);
    const double t_y = imp__length(r), sine = imp__length(turned) / t_y;
    const double cosine = imp__dot(y.n, r) / t_y;
    if (!(sine > 0) || !(cosine > IMP_GRAZING)) return;
    imp_v3 m = turned * (1 / (sine * t_y));
    const int side = imp__edge_side(b->edges, d->edge, m);
    if (side == 0) return;
    m *= (double)side;

    /* One ray past the edge; parts of its length to there. */
    const imp_v3 o = imp__offset(y.p, y.ng, r);
    const imp_v3 to = d->p + m * (IMP_BESIDE * (t_y + imp__length(d->p))) - o;
    struct imp_hit hit;
    if (!imp__intersect(scene, &o, &to, 0, INFINITY, &hit)) return;
    if (hit.t < 1 + IMP_CONTACT * b->size / t_y) return;
    imp__hit_surface(scene, &hit, &o, &to, &at);

    const struct imp_texcoord there = {.shape = e->shape};
    imp_spec in[IMP_INPUTS_MAX];
    imp__inputs_eval(e->input, e->n_in, &there, in);
    const double t_x = imp__length(at.p - d->p), inverse = 1 / (t_x + t_y);
    const double density = pmf / (e->shape->area * d->inv_pdf);
    struct imp__edge_light light = {.w = imp__normalize(to), .behind = 1, .n_ends = 2};
    light.light = in[0] * (-cosine * sine / (t_y * t_y * density));
    light.slide = m * (-t_y * inverse);
    const struct imp__glued edge = imp__edge_glued(b->edges, scene, d->edge, d->p);
    const struct imp_located located = imp__located_drawn(e->shape, &y.located, y.uv);
    const struct imp__glued lit = imp__glued_at(scene, e->shape->index, &located, y.ng);
    light.end[0] = imp__flux_glued(&edge, m);
    light.end[1] = imp__flux_glued(&lit, m * (-t_x * inverse));
    imp__edge_reach(d, &hit, &at, &light);
}
