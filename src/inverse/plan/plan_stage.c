/* SPDX-License-Identifier: Apache-2.0
 *
 * A candidate put into the scene: its camera moved, its lamps on and the others off, and the scene
 * as it was afterwards. */
#include "base/arguments.h"
#include "inverse/problem/match.h"
#include "math/motion.h"
#include "planning.h"
#include "scene/pose.h"
#include "scene/unlit.h"
#include <math.h>
#include <string.h>

const char *imp__plan_name(const struct imp_scene *scene,
                           const struct imp_plan_candidate *c)
{
    return c->name ? c->name : scene->sensors[c->sensor]->name;
}

/* ---- Cameras ------------------------------------------------------------------------- */

/* The sensor's to_world as the file has it. */
static struct imp_mat4 placement_of(const struct imp_scene *scene,
                                    const struct imp_sensor *s)
{
    struct imp_mat4 m = imp__mat4_identity();
    const struct imp_node *node = imp__node_of(scene->root, s);
    for (size_t k = 0; node && k < node->n_props; k++)
        if (!strcmp(node->props[k].name, "to_world") &&
            node->props[k].type == IMP_PROP_TRANSFORM)
            memcpy(m.m, node->props[k].number, sizeof m.m);
    return m;
}

static enum imp_status cannot_move(const struct imp_scene *scene,
                                   const struct imp_plan_candidate *c, const char *why)
{
    return imp__error(scene->ctx, IMP_E_UNSUPPORTED, "sensor '%s' cannot be placed: %s",
                      scene->sensors[c->sensor]->name, why);
}

/* The rigid map from where the camera stands and looks to where it shall. */
static enum imp_status sensor_move(struct imp_scene *scene,
                                   const struct imp_plan_candidate *c,
                                   struct imp__plan_stage *stage)
{
    struct imp_sensor *s = scene->sensors[c->sensor];
    const struct imp_mat4 at = placement_of(scene, s);
    const imp_v3 o = imp__point(&at, imp__v3(0, 0, 0));
    const imp_v3 z = imp__normalize(imp__vector(&at, imp__v3(0, 0, 1)));
    struct imp_mat4 from, back, to;
    if (!s->ops->move) return cannot_move(scene, c, "it is no perspective camera");
    if (s->medium) return cannot_move(scene, c, "it is in a medium");
    for (const struct imp_pose *p = scene->poses; p; p = p->next)
        if (p->sensor == s)
            return cannot_move(scene, c, "its place is a parameter of the scene");
    if (!imp__lookat(o, o + z, imp__vector(&at, imp__v3(0, 1, 0)), &from) ||
        !imp__mat4_inverse(&from, &back))
        return cannot_move(scene, c, "its to_world is singular");
    if (!imp__lookat(imp__v3(c->origin[0], c->origin[1], c->origin[2]),
                     imp__v3(c->target[0], c->target[1], c->target[2]),
                     imp__v3(c->up[0], c->up[1], c->up[2]), &to))
        return imp__error(scene->ctx, IMP_E_ARG,
                          "origin and target are equal, or up is parallel to the view");
    stage->rest = imp__alloc_raw(scene->ctx, 1, s->ops->object_size);
    if (!stage->rest) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a plan");
    memcpy(stage->rest, s->self, s->ops->object_size);
    stage->sensor = s;
    const struct imp_mat4 map = imp__mat4_multiply(&to, &back);
    s->ops->move(s, imp__map_of(&map).m);
    return IMP_OK;
}

/* ---- Lamps --------------------------------------------------------------------------- */

/* Does one of the patterns, with commas between them, match? */
static bool is_named(const char *globs, const char *name)
{
    char glob[256];
    for (const char *from = globs; *from;) {
        const size_t n = strcspn(from, ",");
        if (n < sizeof glob) {
            memcpy(glob, from, n);
            glob[n] = 0;
            if (imp__glob(glob, name)) return true;
        }
        from += n + (from[n] == ',');
    }
    return false;
}

static enum imp_status lamps_switch(struct imp_scene *scene,
                                    const struct imp_plan_candidate *c,
                                    struct imp__plan_stage *stage)
{
    const size_t n = (size_t)scene->n_emitters;
    size_t on = 0;
    double *level = imp__alloc(scene->ctx, n + 1, sizeof *level);
    if (!level) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a plan");
    for (size_t k = 0; k < n; k++) {
        const bool shines =
            is_named(c->lamps, scene->emitters[k]->name ? scene->emitters[k]->name : "");
        level[k] = shines ? NAN : 0;
        on += shines;
    }
    const enum imp_status st =
        on ? imp__lamp_levels_begin(scene, level, &stage->lamps)
           : imp__error(scene->ctx, IMP_E_ARG, "there is no lamp '%s'", c->lamps);
    imp__release(scene->ctx, level);
    return st;
}

const char *imp_plan_lamp(const imp_scene *scene, int lamp)
{
    IMP_REQUIRE_OR(NULL, scene, "scene", NULL);
    if (!scene->committed || lamp < 0 || lamp >= scene->n_emitters) return NULL;
    return scene->emitters[lamp]->name;
}

enum imp_status imp__plan_stage_begin(struct imp_scene *scene,
                                      const struct imp_plan_candidate *c,
                                      struct imp__plan_stage *stage)
{
    enum imp_status st = IMP_OK;
    *stage = (struct imp__plan_stage){.scene = scene};
    if (c->placed) st = sensor_move(scene, c, stage);
    if (st == IMP_OK && c->lamps) st = lamps_switch(scene, c, stage);
    return st;
}

void imp__plan_stage_end(struct imp__plan_stage *stage)
{
    struct imp_scene *scene = stage->scene;
    if (stage->sensor)
        memcpy(stage->sensor->self, stage->rest, stage->sensor->ops->object_size);
    imp__lamp_levels_end(&stage->lamps);
    if (scene) imp__release(scene->ctx, stage->rest);
    *stage = (struct imp__plan_stage){0};
}
