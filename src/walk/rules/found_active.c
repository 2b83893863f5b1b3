/* SPDX-License-Identifier: Apache-2.0
 *
 * Features of active parameters: what moves, and extinctions. */
#include "found.h"

#include "scene/pose.h"
#include "walk/media/tracking.h"

/* Where collisions are drawn depends on the extinction. With fixed collisions the
 * derivative is complete only where every collision had a chance to be drawn. */
static const struct imp_medium *extinction_active(const struct imp_job *j, bool field)
{
    for (int m = 0; j->active && j->active->medium && m < j->scene->n_media; m++) {
        const struct imp_medium *medium = j->scene->media[m];
        imp_spec in[IMP_INPUTS_MAX];
        if (!j->active->medium[m]) continue;
        if (field ? medium->majorants != NULL
                  : !medium->majorants &&
                        imp__is_zero(imp__extinction_at(medium, (imp_v3){0}, NULL, in)))
            return medium;
    }
    return NULL;
}
IMP_FOUND(EXTINCTION_FIELD_ACTIVE)
{
    const struct imp_medium *m = extinction_active(j, true);
    if (m) *by = (struct imp_bearer){.name = m->name};
    return m != NULL;
}
IMP_FOUND(EXTINCTION_ZERO_ACTIVE)
{
    const struct imp_medium *m = extinction_active(j, false);
    if (m) *by = (struct imp_bearer){.name = m->name};
    return m != NULL;
}
IMP_FOUND(POSE_ACTIVE)
{
    for (const struct imp_pose *p = j->active ? j->scene->poses : NULL; p; p = p->next) {
        if (j->active->base[p->param] < 0 || !imp__pose_moves(p)) continue;
        *by = (struct imp_bearer){.name = j->scene->params[p->param].info.name};
        return true;
    }
    return false;
}
IMP_FOUND(VOLUME_JUMPS)
{
    for (const struct imp_pose *p = j->active ? j->scene->poses : NULL; p; p = p->next) {
        if (j->active->base[p->param] < 0 || imp__pose_moves(p)) continue;
        const struct imp_medium *m = imp__volume_jumps(j->scene, p);
        if (!m) continue;
        *by = (struct imp_bearer){.name = j->scene->params[p->param].info.name,
                                  .more = m->name};
        return true;
    }
    return false;
}
IMP_FOUND(RAYS_ACTIVE)
{
    (void)by;
    return j->active && j->active->body;
}
IMP_FOUND(COLLISIONS_ACTIVE)
{
    for (size_t k = 0; j->active && k < j->scene->n_params; k++) {
        const struct imp_param *p = &j->scene->params[k];
        if (j->active->base[k] < 0 || !p->probed) continue;
        *by = (struct imp_bearer){.name = p->info.name};
        return true;
    }
    return false;
}
