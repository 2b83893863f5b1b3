/* SPDX-License-Identifier: Apache-2.0
 *
 * What of an object that moves is kept as the file has it, and what a shape carries along (pose.h): the
 * frame of its meter, and the table by which it shines. */
#include "base/context.h"
#include "instances.h"
#include "kind/emitter/ies.h"
#include "kind/sensor/receiver.h"
#include "kind/shape/shape.h"
#include "pose.h"
#include <string.h>

bool imp__pose_is_at_start(const struct imp_pose *p)
{
    const struct imp_pose *rigid = imp__pose_beside(p, IMP_POSE_RIGID);
    bool rests = true;
    for (int k = 0; rigid && k < 6; k++) rests &= rigid->number[k] == 0;
    return rests;
}

/* The light of a shape that shines by a table; NULL: there is none. */
static struct imp_emitter *table_of(const struct imp_pose *p)
{
    const struct imp_scene *scene = p->scene;
    for (int k = 0; k < scene->n_emitters; k++)
        if (scene->emitters[k]->ops == &imp__ies_area &&
            scene->emitters[k]->shape == scene->shapes[p->shape])
            return scene->emitters[k];
    return NULL;
}

/* With facets of its own. */
static enum imp_status table_keep(struct imp_scene *scene, struct imp_pose *p)
{
    const struct imp_emitter *e = table_of(p);
    if (!e) return IMP_OK;
    const struct imp__ies *x = e->self;
    const size_t n = (size_t)x->n_facets;
    struct imp__ies_facet *facet = imp__arena_take(&scene->arena, n + 1, sizeof *facet);
    p->table = imp__arena_take(&scene->arena, 1, sizeof *p->table);
    if (!facet || !p->table)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    *p->table = *x;
    if (n > 0) memcpy(facet, x->facets, n * sizeof *facet);
    p->table->facets = facet;
    return IMP_OK;
}

enum imp_status imp__pose_rest_keep(struct imp_scene *scene, struct imp_pose *p)
{
    const struct imp_shape *s = p->shape >= 0 ? scene->shapes[p->shape] : NULL;
    const struct imp_receiver *r = s && s->sensor ? s->sensor->receiver : NULL;
    const struct imp__mesh *m = s && s->ops->move == imp__mesh_move ? s->self : NULL;
    const void *self = s               ? s->self
                       : p->sensor     ? p->sensor->self
                       : p->emitter    ? p->emitter->self
                       : p->group >= 0 ? (void *)scene->world->instance
                                       : (void *)&scene->world->instance[p->instance];
    const size_t n = m ? 3 * s->triangles.n_vertices : 0;
    const bool curve = s && s->geometry == IMP_CURVES;
    const size_t n_control = curve ? 4 * s->curves.n_points : 0;
    p->rest = imp__arena_take(&scene->arena, 1, p->rest_size + 1);
    if (curve) p->control = imp__arena_take(&scene->arena, n_control, sizeof *p->control);
    if (r) p->receiver = imp__arena_take(&scene->arena, 1, sizeof *r);
    if (m) p->positions = imp__arena_take(&scene->arena, n, sizeof *p->positions);
    if (m && m->normals)
        p->normals = imp__arena_take(&scene->arena, n, sizeof *p->normals);
    if (!p->rest || (r && !p->receiver) || (m && !p->positions) ||
        (curve && !p->control) || (m && m->normals && !p->normals))
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    if (p->rest_size > 0) memcpy(p->rest, self, p->rest_size);
    if (curve) memcpy(p->control, s->curves.points, n_control * sizeof *p->control);
    p->rest_area = s ? s->area : 0;
    if (r) *p->receiver = *r;
    if (m) memcpy(p->positions, s->triangles.positions, n * sizeof *p->positions);
    if (m && m->normals) memcpy(p->normals, m->normals, n * sizeof *p->normals);
    return s ? table_keep(scene, p) : IMP_OK;
}

void imp__pose_carry(const struct imp_pose *p, const struct imp_map *by)
{
    const struct imp_shape *s = p->scene->shapes[p->shape];
    if (p->table) imp__ies_move(table_of(p)->self, p->table, by->m);
    if (!p->receiver) return;
    struct imp_receiver *r = (struct imp_receiver *)(uintptr_t)s->sensor->receiver;
    if (imp__pose_is_at_start(p)) *r = *p->receiver; /* to the bit */
    else imp__receiver_turn(r, p->receiver, s, by->m);
}
