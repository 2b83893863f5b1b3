/* SPDX-License-Identifier: Apache-2.0
 *
 * Which numbers are measured, and in which stage. */
#include "base/arguments.h"
#include "inverse/problem/match.h"
#include "measuring.h"
#include "scene/pose.h"
#include <stdio.h>
#include <string.h>

#define FIELD 12 /* a parameter of more numbers, but no spectrum, is a texture */
#define FEW                                                                              \
    236 /* numbers, textures included, that imp_plan and imp_problem_missing take */

/* ---- Poses ----------------------------------------------------------------------------- */

static bool is_geometry(const char *name)
{
    const char *tail = strrchr(name, '.');
    for (int kind = 0; tail && kind < IMP_POSE_KINDS; kind++)
        if (!strcmp(tail + 1, imp__pose_tail((enum imp_pose_kind)kind))) return true;
    return false;
}

/* Do the patterns mean this number of geometry? As imp_problem_activate: those do that end in
 * its last part. */
static bool is_meant(const char *const *list, size_t n, const char *name)
{
    const char *tail = strrchr(name, '.');
    for (size_t i = 0; i < n; i++) {
        const char *own = strrchr(list[i], '.');
        if (!strcmp(list[i], name) ||
            (own && tail && !strcmp(own, tail) && imp__glob(list[i], name)))
            return true;
    }
    return false;
}

/* Is there geometry in the scene that a name or pattern means, parameter or not? */
static bool is_there(const struct imp__measure *m, const char *glob)
{
    struct imp_geometry_walk at = {0};
    while (imp__geometry_next(m->scene, &at))
        if (is_meant(&glob, 1, at.name)) return true;
    return false;
}

/* A number of a photograph's camera becomes a parameter, or there is a line that says why not. */
static enum imp_status camera_add(struct imp__measure *m, const struct imp__photo *p,
                                  const char *number, bool wanted_anyway)
{
    char name[320];
    snprintf(name, sizeof name, "%.300s.%s", p->sensor->name, number);
    const bool named = is_meant(m->o.params, m->o.n_params, name);
    if (m->o.params ? !named : !wanted_anyway) return IMP_OK;
    for (size_t i = 0; i < m->n_holds; i++) {
        const char *glob = m->holds[i].glob;
        if (m->holds[i].last == SIZE_MAX && is_meant(&glob, 1, name)) return IMP_OK;
    }
    const enum imp_status st = imp_scene_add_geometry(m->scene, name);
    if (st != IMP_E_UNSUPPORTED || named) return st;
    return imp__measure_say(m, "%s stays: %s", name, imp_last_error(m->ctx));
}

/* What the stage of lenses measures where no numbers are named. One photograph of a camera hardly
 * determines more: a principal point looks like a rotation, k2 like k1. */
static bool is_usual(enum imp_pose_kind kind)
{
    return kind == IMP_POSE_FOV || kind == IMP_POSE_K1;
}

static enum imp_status cameras_add(struct imp__measure *m, const struct imp__photo *p,
                                   bool focal)
{
    const bool asked = m->o.stages && m->wanted[IMP_MEASURE_LENS];
    if (m->wanted[IMP_MEASURE_CAMERAS]) {
        IMP_CHECKED(camera_add(m, p, "pose", true));
        IMP_CHECKED(camera_add(m, p, "x_fov", focal || asked));
    }
    for (int k = IMP_POSE_FOV; k < IMP_POSE_FOV + IMP_VIEW_NUMBERS; k++) {
        const enum imp_pose_kind kind = (enum imp_pose_kind)k;
        if (!m->wanted[IMP_MEASURE_LENS]) break;
        if (kind >= IMP_POSE_APERTURE && !p->sensor->ops->lens_velocity) continue;
        IMP_CHECKED(camera_add(m, p, imp__pose_tail(kind), asked && is_usual(kind)));
    }
    return IMP_OK;
}

static enum imp_status poses_add(struct imp__measure *m)
{
    bool focal = true;
    for (size_t i = 0; i < m->n_photos; i++) focal &= m->photos[i].desc.focal_35mm > 0;
    if (!m->wanted[IMP_MEASURE_CAMERAS] && !m->wanted[IMP_MEASURE_LENS]) return IMP_OK;
    for (size_t i = 0; i < m->n_photos; i++)
        IMP_CHECKED(cameras_add(m, &m->photos[i], focal));
    for (size_t k = 0; k < m->o.n_params; k++) {
        size_t index;
        if (imp__has_wildcards(m->o.params[k]) || !is_geometry(m->o.params[k]) ||
            imp_scene_find_param(m->scene, m->o.params[k], &index) == IMP_OK)
            continue;
        IMP_CHECKED(imp_scene_add_geometry(m->scene, m->o.params[k]));
    }
    return IMP_OK;
}

/* ---- Stages ---------------------------------------------------------------------------- */

static bool is_below(const char *name, const char *object)
{
    const size_t n = object ? strlen(object) : 0;
    return n > 0 && !strncmp(name, object, n) && name[n] == '.';
}

/* The stage of a parameter by what it belongs to; IMP_MEASURE_STAGES: no photograph is of the
 * sensor that has it. */
static enum imp_measure_stage stage_of(const struct imp__measure *m, size_t k)
{
    const struct imp_scene *s = m->scene;
    const struct imp_param_info *info = &s->params[k].info;
    const struct imp_pose *pose = imp__pose_of(s, k);
    const bool lens = pose && imp__pose_is_view(pose->kind) &&
                      (pose->kind != IMP_POSE_FOV || !m->wanted[IMP_MEASURE_CAMERAS]);
    if (pose && !pose->sensor)
        return pose->emitter ? IMP_MEASURE_LIGHTS : IMP_MEASURE_CAMERAS;
    for (int c = 0; c < s->n_sensors; c++) {
        if (!is_below(info->name, s->sensors[c]->name)) continue;
        for (size_t i = 0; i < m->n_photos; i++)
            if (m->photos[i].sensor == s->sensors[c])
                return lens   ? IMP_MEASURE_LENS
                       : pose ? IMP_MEASURE_CAMERAS
                              : IMP_MEASURE_EXPOSURE;
        return IMP_MEASURE_STAGES;
    }
    if (info->count > FIELD && !info->wavelengths_nm) return IMP_MEASURE_TEXTURES;
    for (int e = 0; e < s->n_emitters; e++)
        if (is_below(info->name, s->emitters[e]->name)) return IMP_MEASURE_LIGHTS;
    return IMP_MEASURE_MATERIALS;
}

/* Does a name or pattern mean parameter k? */
static bool names(const struct imp__measure *m, const char *glob, size_t k)
{
    const char *name = m->scene->params[k].info.name;
    size_t index;
    if (imp__pose_of(m->scene, k)) return is_meant(&glob, 1, name);
    if (imp__has_wildcards(glob)) return imp__glob(glob, name);
    return imp_scene_find_param(m->scene, glob, &index) == IMP_OK && index == k;
}

static enum imp_status params_mean_something(const struct imp__measure *m)
{
    for (size_t i = 0; i < m->o.n_params; i++) {
        bool met = false;
        for (size_t k = 0; k < m->scene->n_params && !met; k++)
            met = names(m, m->o.params[i], k);
        if (!met && !is_geometry(m->o.params[i]))
            return imp__error(m->ctx, IMP_E_ARG,
                              "params '%s': there is no such parameter", m->o.params[i]);
    }
    return IMP_OK;
}

/* What `hold` means: parameters that are in no stage, and single numbers. Each item must mean
 * something. */
static enum imp_status holds_apply(struct imp__measure *m)
{
    const struct imp_scene *s = m->scene;
    for (size_t i = 0; i < m->n_holds; i++) {
        const struct imp__held *item = &m->holds[i];
        bool met = false;
        for (size_t k = 0; k < s->n_params; k++) {
            if (!names(m, item->glob, k)) continue;
            met = true;
            if (item->last == SIZE_MAX) {
                m->stage[k] = IMP_MEASURE_STAGES;
                continue;
            }
            if (!m->held) m->held = imp__alloc(m->ctx, s->n_theta + 1, 1);
            if (!m->held)
                return imp__error(m->ctx, IMP_E_NOMEM, "no memory for held numbers");
            IMP_CHECKED(imp__held_mark(m->ctx, item, &s->params[k].info, m->held));
        }
        if (!met && !is_there(m, item->glob))
            return imp__error(m->ctx, IMP_E_ARG, "hold '%s': there is no such parameter",
                              item->glob);
    }
    return IMP_OK;
}

/* Is a number of parameter k held by itself? */
bool imp__measure_holds(const struct imp__measure *m, size_t k)
{
    const struct imp_param_info *info = &m->scene->params[k].info;
    return m->held && memchr(m->held + info->offset, 1, info->count) != NULL;
}

static bool is_named(const struct imp__measure *m, size_t k)
{
    for (size_t i = 0; i < m->o.n_params; i++)
        if (names(m, m->o.params[i], k)) return true;
    return false;
}

/* ---- What only a product determines ---------------------------------------------------- */

struct imp_param *imp__measure_film_number(const struct imp__measure *m,
                                           const struct imp__photo *photo,
                                           const char *number, size_t *index)
{
    char name[320];
    snprintf(name, sizeof name, "%.280s.%s.value", photo->sensor->name, number);
    for (size_t k = 0; k < m->scene->n_params; k++)
        if (!strcmp(m->scene->params[k].info.name, name)) {
            *index = k;
            return &m->scene->params[k];
        }
    return NULL;
}

/* Textures of lights have no unit: their inputs' names tell. */
bool imp__measure_shines(const struct imp__measure *m, size_t k)
{
    static const char *const part[] = {"scale.", ".data", "radiance.", "emission.",
                                       "intensity."};
    const struct imp_param_info *info = &m->scene->params[k].info;
    if (imp__pose_of(m->scene, k)) return false;
    if (info->unit && info->unit[0] == 'W') return true;
    for (size_t i = 0; i < sizeof part / sizeof *part; i++)
        if (strstr(info->name, part[i])) return true;
    return false;
}

/* Has each light a measured number, of `lanes` values at least? */
static bool lights_free(const struct imp__measure *m, size_t lanes)
{
    const struct imp_scene *s = m->scene;
    for (int e = 0; e < s->n_emitters; e++) {
        bool met = false;
        for (size_t k = 0; k < s->n_params && !met; k++)
            met = (m->stage[k] == IMP_MEASURE_LIGHTS ||
                   m->stage[k] == IMP_MEASURE_TEXTURES) &&
                  imp__measure_shines(m, k) && s->params[k].info.count >= lanes &&
                  is_below(s->params[k].info.name, s->emitters[e]->name);
        if (!met) return false;
    }
    return s->n_emitters > 0;
}

/* Where all photographs have a free factor of this kind, and all lights are free, too: the
 * first one's stays, and is the unit. */
static enum imp_status unit_hold(struct imp__measure *m, const char *number,
                                 const char *why)
{
    size_t first = 0, index;
    for (size_t i = m->n_photos; i-- > 0; first = index) {
        if (!imp__measure_film_number(m, &m->photos[i], number, &index)) return IMP_OK;
        if (m->stage[index] != IMP_MEASURE_EXPOSURE) return IMP_OK;
    }
    m->stage[first] = IMP_MEASURE_STAGES;
    return imp__measure_say(m, "%s stays at %g: %s", m->scene->params[first].info.name,
                            imp__param_get(&m->scene->params[first], 0), why);
}

/* ---- All of it ------------------------------------------------------------------------- */

bool imp__measure_has(const struct imp__measure *m, enum imp_measure_stage stage,
                      size_t k)
{
    return stage == IMP_MEASURE_TOGETHER
               ? m->stage[k] < IMP_MEASURE_TEXTURES + (m->joined ? 1 : 0)
               : m->stage[k] == stage;
}

size_t imp__measure_count(const struct imp__measure *m, enum imp_measure_stage stage)
{
    size_t n = 0;
    for (size_t k = 0; k < m->scene->n_params; k++)
        n += imp__measure_has(m, stage, k) ? m->scene->params[k].info.count : 0;
    return n;
}

enum imp_status imp__measure_numbers(struct imp__measure *m)
{
    IMP_CHECKED(poses_add(m));
    const struct imp_scene *s = m->scene;
    m->stage = imp__alloc(m->ctx, s->n_params + 1, 1);
    m->at = imp__alloc(m->ctx, s->n_theta + 1, sizeof *m->at);
    m->at_se = imp__alloc(m->ctx, s->n_theta + 1, sizeof *m->at_se);
    if (!m->stage || !m->at || !m->at_se)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %zu parameters",
                          s->n_params);
    IMP_CHECKED(params_mean_something(m));
    for (size_t k = 0; k < s->n_params; k++) {
        const enum imp_measure_stage stage = stage_of(m, k);
        const bool meant = m->o.params ? is_named(m, k)
                                       : !imp__pose_of(s, k) || stage <= IMP_MEASURE_LENS;
        m->stage[k] = IMP_MEASURE_STAGES;
        if (stage == IMP_MEASURE_STAGES || !m->wanted[stage] || !meant) continue;
        if (!(s->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE)) continue;
        m->stage[k] = (uint8_t)stage;
    }
    IMP_CHECKED(holds_apply(m));
    if (lights_free(m, 1))
        IMP_CHECKED(unit_hold(m, "exposure",
                              "photographs determine its product with the lights alone"));
    if (lights_free(m, 3)) {
        const char *why =
            "photographs determine its product with the lights' colour alone";
        IMP_CHECKED(unit_hold(m, "white_balance_red", why));
        IMP_CHECKED(unit_hold(m, "white_balance_blue", why));
    }
    const size_t all = imp__measure_count(m, IMP_MEASURE_TOGETHER) +
                       imp__measure_count(m, IMP_MEASURE_TEXTURES);
    m->joined = all <= FEW;
    if (all == 0)
        return imp__error(m->ctx, IMP_E_ARG,
                          "no number of the scene is to be measured: stages, params and "
                          "hold leave none that has a gradient");
    return IMP_OK;
}
