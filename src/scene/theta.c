/* SPDX-License-Identifier: Apache-2.0
 *
 * theta: every parameter value of the scene, in document order, as places to read and
 * write. A parameter's values are stored where rendering uses them (an input's lanes, a
 * texture's texels); theta is a list of addresses, so setting it needs no rebuild. */
#include "base/arguments.h"
#include "pose.h"
#include "theta_alias.h"
#include "theta_near.h"
#include <stdio.h>
#include <string.h>

enum imp_status imp__theta_add(struct imp_scene *scene, const struct imp_param *param,
                               int *index)
{
    struct imp_param *p = imp__grow(scene->ctx, scene->params, &scene->cap_params,
                                    scene->n_params + 1, sizeof *p);
    if (!p) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for parameters");
    scene->params = p;
    *index = (int)scene->n_params;
    p[scene->n_params++] = *param;
    return IMP_OK;
}

void imp__theta_finish(struct imp_scene *scene)
{
    scene->n_theta = 0;
    for (size_t i = 0; i < scene->n_params; i++) {
        struct imp_param_info *info = &scene->params[i].info;
        info->size = sizeof *info;
        info->offset = scene->n_theta;
        info->count = 1;
        for (int d = 0; d < info->n_dims; d++) info->count *= info->dims[d];
        scene->n_theta += info->count;
    }
}

double imp__param_get(const struct imp_param *p, size_t k)
{
    switch (p->store) {
    case IMP_STORE_BULK: return (double)p->bulk[k];
    case IMP_STORE_DOUBLES: return p->doubles[k];
    case IMP_STORE_LANES: break;
    }
    return (*p->lanes)[k];
}

static void param_put(const struct imp_param *p, size_t k, double value)
{
    if (p->store == IMP_STORE_BULK) p->bulk[k] = (float)value;
    else if (p->store == IMP_STORE_DOUBLES) p->doubles[k] = value;
    else if (p->info.count == 1) *p->lanes = imp__spec(value);
    else (*p->lanes)[k] = value;
}

void imp__param_set(struct imp_param *p, size_t k, double value)
{
    const double before = p->watches ? imp__param_get(p, k) : 0;
    param_put(p, k, value);
    if (imp_likely(!p->watches) || imp__param_get(p, k) == before) return;
    for (const struct imp_watch *w = p->watches; w; w = w->next) w->listener->due = true;
}

enum imp_status imp__theta_watch(struct imp_scene *scene, int param,
                                 void (*changed)(void *payload), void *payload)
{
    struct imp_param *p = &scene->params[param];
    struct imp_listener **l = &scene->listeners;
    while (*l && ((*l)->changed != changed || (*l)->payload != payload)) l = &(*l)->next;
    for (const struct imp_watch *w = p->watches; *l && w; w = w->next)
        if (w->listener == *l) return IMP_OK;
    struct imp_watch *w = imp__arena_array(&scene->arena, 1, sizeof *w);
    if (!*l) *l = imp__arena_array(&scene->arena, 1, sizeof **l);
    if (!w || !*l) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for parameters");
    (*l)->changed = changed;
    (*l)->payload = payload;
    *w = (struct imp_watch){p->watches, *l};
    p->watches = w;
    return IMP_OK;
}

void imp__theta_announce(const struct imp_scene *scene)
{
    for (struct imp_listener *l = scene->listeners; l; l = l->next) {
        if (!l->due) continue;
        l->due = false;
        l->changed(l->payload);
    }
}

size_t imp_scene_n_params(const imp_scene *scene) { return scene ? scene->n_params : 0; }
size_t imp_scene_n_theta(const imp_scene *scene) { return scene ? scene->n_theta : 0; }

enum imp_status imp_scene_get_param(const imp_scene *scene, size_t index,
                                    struct imp_param_info *info)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, info, "info");
    if (index >= scene->n_params)
        return imp__error(scene->ctx, IMP_E_ARG, "there is no parameter %zu", index);
    IMP_GIVE(scene->ctx, info, scene->params[index].info, "info");
    return IMP_OK;
}

/* Names may leave out the final ".value", and may be written below any parent that
 * reaches the object ("ball.bsdf.red.reflectance"): the longest matching tail wins. */
static bool name_matches(const char *given, const char *name)
{
    const size_t n = strlen(name), g = strlen(given);
    if (strcmp(given, name) == 0) return true;
    const size_t value = strlen(".value");
    return n == g + value && strncmp(given, name, g) == 0 &&
           strcmp(name + g, ".value") == 0;
}

bool imp__theta_exact(const struct imp_scene *scene, const char *name, size_t *index)
{
    for (size_t i = 0; i < scene->n_params; i++)
        if (name_matches(name, scene->params[i].info.name)) {
            *index = i;
            return true;
        }
    return false;
}

/* Is this what Mitsuba's traverse() calls numbers that move things, up to 3.9 or from 3.10
 * on? */
static bool is_geometry(const char *name)
{
    static const char *const keys[] = {
        "vertex_positions", "vertex_normals", "vertex_texcoords", "faces",
        "positions",        "normals",        "texcoords",        "position_index",
        "normal_index",     "bsdf_index",     "to_world",         "x_fov",
        "position",         "control_points"};
    const char *dot = strrchr(name, '.');
    for (size_t k = 0; dot && k < imp_count(keys); k++)
        if (strcmp(dot + 1, keys[k]) == 0) return true;
    return false;
}

/* A number of geometry of this scene, which becomes a parameter where it is asked for. */
static bool is_to_be_added(const struct imp_scene *scene, const char *name)
{
    struct imp_geometry_walk walk = {0};
    while (imp__geometry_next(scene, &walk))
        if (strcmp(walk.name, name) == 0) return true;
    return false;
}

enum imp_status imp_scene_find_param(const imp_scene *scene, const char *name,
                                     size_t *index)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, name, "name");
    IMP_REQUIRE(scene->ctx, index, "index");
    for (const char *tail = name; tail;
         tail = strchr(tail, '.') ? strchr(tail, '.') + 1 : NULL)
        if (imp__theta_exact(scene, tail, index)) return IMP_OK;
    if (imp__theta_alias(scene, name, index)) return IMP_OK;
    if (is_to_be_added(scene, name))
        return imp__error(
            scene->ctx, IMP_E_ARG,
            "'%s' is geometry: it becomes a parameter by "
            "imp_scene_add_geometry (Scene.add_geometry, before traverse; the "
            "command's -p and --set)",
            name);
    const struct imp_near_names near = imp__theta_near(scene, name);
    if (is_geometry(name))
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no parameter '%s': transformations, normals and "
                          "positions are not among them (where it is asked for: "
                          "NAME.pose, scale, vertex_positions, x_fov, position, ...)%s",
                          name, near.text);
    return imp__error(scene->ctx, IMP_E_ARG, "there is no parameter '%s'%s", name,
                      scene->n_params ? near.text : "; the scene has none");
}

enum imp_status imp_scene_get_theta(const imp_scene *scene, double *theta)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, theta, "theta");
    IMP_READS(scene);
    for (size_t i = 0; i < scene->n_params; i++) {
        const struct imp_param *p = &scene->params[i];
        for (size_t k = 0; k < p->info.count; k++)
            theta[p->info.offset + k] = imp__param_get(p, k);
    }
    return IMP_OK;
}

enum imp_status imp__param_check(const struct imp_scene *scene, const struct imp_param *p,
                                 size_t k, double value)
{
    if (isfinite(value) && value >= p->info.lo && value <= p->info.hi) return IMP_OK;
    char element[32] = "";
    if (p->info.count > 1) snprintf(element, sizeof element, "[%zu]", k);
    return imp__error(scene->ctx, IMP_E_ARG, "%s%s = %g is outside [%g, %g]",
                      p->info.name, element, value, p->info.lo, p->info.hi);
}

static void theta_put(struct imp_scene *scene, const double *theta)
{
    for (size_t i = 0; i < scene->n_params; i++) {
        struct imp_param *p = &scene->params[i];
        for (size_t k = 0; k < p->info.count; k++)
            imp__param_set(p, k, theta[p->info.offset + k]);
    }
}

/* Values as they are, [n_theta], to be released. */
static enum imp_status theta_keep(const struct imp_scene *scene, double **out)
{
    const size_t n = imp_scene_n_theta(scene);
    *out = imp__alloc(scene->ctx, n + 1, sizeof **out);
    if (!*out) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for parameters");
    for (size_t i = 0; i < scene->n_params; i++) {
        const struct imp_param *p = &scene->params[i];
        for (size_t k = 0; k < p->info.count; k++)
            (*out)[p->info.offset + k] = imp__param_get(p, k);
    }
    return IMP_OK;
}

/* Moves what the values move. Where they cannot be had, all are as before, in old [n_theta]. */
static enum imp_status moved_or_restored(struct imp_scene *scene, const double *old)
{
    char why[512];
    imp__theta_announce(scene);
    const enum imp_status st = imp__poses_settle(scene);
    if (st == IMP_OK) return st;
    snprintf(why, sizeof why, "%s", imp_last_error(scene->ctx));
    theta_put(scene, old);
    imp__theta_announce(scene);
    const enum imp_status back = imp__poses_settle(scene);
    return back == IMP_OK ? imp__error(scene->ctx, st, "%s", why) : back;
}

enum imp_status imp_scene_set_theta(imp_scene *scene, const double *theta)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, theta, "theta");
    IMP_SETS(scene, st);
    if (st != IMP_OK) return st;
    for (size_t i = 0; i < scene->n_params; i++) {
        const struct imp_param *p = &scene->params[i];
        for (size_t k = 0; k < p->info.count; k++)
            IMP_CHECKED(imp__param_check(scene, p, k, theta[p->info.offset + k]));
    }
    double *old = NULL;
    if (scene->poses) IMP_CHECKED(theta_keep(scene, &old));
    theta_put(scene, theta);
    if (old) {
        st = moved_or_restored(scene, old);
    } else {
        imp__theta_announce(scene);
        st = imp__poses_settle(scene);
    }
    imp__release(scene->ctx, old);
    return st;
}

enum imp_status imp_scene_set_values(imp_scene *scene, size_t index, size_t n,
                                     const double *values)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, values, "values");
    if (index >= scene->n_params)
        return imp__error(scene->ctx, IMP_E_ARG, "there is no parameter %zu", index);
    struct imp_param *p = &scene->params[index];
    if (n != p->info.count && n != 1)
        return imp__error(scene->ctx, IMP_E_ARG, "%s has %zu numbers, not %zu",
                          p->info.name, p->info.count, n);
    IMP_SETS(scene, st);
    if (st != IMP_OK) return st;
    for (size_t k = 0; k < n; k++) IMP_CHECKED(imp__param_check(scene, p, k, values[k]));
    double *old = NULL;
    if (imp__pose_of(scene, index)) IMP_CHECKED(theta_keep(scene, &old));
    for (size_t k = 0; k < p->info.count; k++)
        imp__param_set(p, k, values[n == 1 ? 0 : k]);
    if (old) {
        st = moved_or_restored(scene, old);
    } else {
        imp__theta_announce(scene);
        st = imp__poses_settle(scene);
    }
    imp__release(scene->ctx, old);
    return st;
}

enum imp_status imp_scene_get_values(const imp_scene *scene, size_t index, double *values)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, values, "values");
    if (index >= scene->n_params)
        return imp__error(scene->ctx, IMP_E_ARG, "there is no parameter %zu", index);
    IMP_READS(scene);
    const struct imp_param *p = &scene->params[index];
    for (size_t k = 0; k < p->info.count; k++) values[k] = imp__param_get(p, k);
    return IMP_OK;
}
