/* SPDX-License-Identifier: Apache-2.0
 *
 * Decisions of a vertex as those want them who evaluate it: places, directions, and what was met
 * and sampled of lights. */
#ifndef IMP_WALK_VERTEX_H
#define IMP_WALK_VERTEX_H

#include "walk.h"

static inline struct imp_texcoord imp__vertex_at(const struct imp_vertex *v)
{
    if (imp_unlikely(v->segment->exact != NULL)) return v->segment->exact->at;
    return (struct imp_texcoord){.uv = {v->d.uv[0], v->d.uv[1]},
                                 .p = imp__decided_v3(v->d.p),
                                 .carried = v->carried,
                                 .shape = v->shape,
                                 .prim = v->d.located.prim};
}
static inline imp_v3 imp__vertex_wo(const struct imp_vertex *v)
{
    if (imp_unlikely(v->segment->exact != NULL)) return v->segment->exact->wo;
    return imp__decided_v3(v->d.wo);
}
static inline struct imp_dirs imp__vertex_dirs(const struct imp_vertex *v)
{
    return (struct imp_dirs){imp__vertex_wo(v), imp__decided_v3(v->d.wi), v->d.lobe,
                             false};
}
static inline struct imp_emission imp__vertex_met(const struct imp_vertex *v)
{
    const struct imp_met *m = &v->d.met;
    const struct imp_texcoord at = imp__vertex_at(v);
    return (struct imp_emission){
        {at.uv[0], at.uv[1]}, m->dist, m->cos_light, imp__decided_v3(m->d)};
}
static inline struct imp_texcoord imp__light_at(const struct imp_scene *scene,
                                                const struct imp_vertex *v)
{
    const struct imp_light *l = &v->d.light;
    return (struct imp_texcoord){.uv = {l->uv[0], l->uv[1]},
                                 .p = imp__decided_v3(l->p),
                                 .carried = v->carried,
                                 .shape = scene->emitters[l->emitter]->shape,
                                 .prim = l->located.prim};
}
static inline struct imp_dirs imp__light_dirs(const struct imp_vertex *v)
{
    if (imp_unlikely(v->d.from_light))
        return (struct imp_dirs){imp__decided_v3(v->d.light.wi), imp__decided_v3(v->d.wi),
                                 IMP_SMOOTH, 0};
    return (struct imp_dirs){imp__vertex_wo(v), imp__decided_v3(v->d.light.wi),
                             IMP_SMOOTH, 0};
}

/* Does light go straight on there, along the walk? */
static inline bool imp__goes_straight(const struct imp_vertex *v)
{
    const int lobe = v->d.lobe;
    return v->bsdf && imp_unlikely(v->bsdf->straight) && v->d.goes_on && lobe >= 0 &&
           lobe < 64 && v->bsdf->straight >> lobe & 1;
}

#endif
