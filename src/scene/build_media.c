/* SPDX-License-Identifier: Apache-2.0
 *
 * Builds media that scatter, and phase functions. A medium is built once, where a shape
 * or a sensor first names it. */
#include "in_medium.h"
#include "majorants.h"
#include "scene_build.h"

static void phase_changed(void *payload)
{
    const struct imp_phase *p = payload;
    p->ops->changed(p);
}

/* slot: what the object is called below its parent if it has no id. */
static enum imp_status phase_build(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   const struct imp_phase **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const void *found;
    if (node->object) {
        *out = node->object;
        return IMP_OK;
    }
    if (node->visiting)
        return imp__node_error(ctx, node, IMP_E_SCENE, "the object contains itself");
    node->visiting = 1;
    IMP_TRY(imp__kind_find(ctx, IMP_CONCEPT_PHASE, node, &found));
    const struct imp_phase_ops *ops = found;
    struct imp_phase *p = imp__arena_array(&scene->arena, 1, sizeof *p);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!p || !self) IMP_TRY(imp__build_no_memory(scene));
    *p = (struct imp_phase){.ops = ops,
                            .self = self,
                            .name = imp__build_object_name(scene, node, parent, slot)};
    if (!p->name) IMP_TRY(imp__build_no_memory(scene));

    const struct imp_build build = imp__build_make(scene, node);
    if (ops->prepare) IMP_TRY(ops->prepare(&build));
    const struct imp_input *in[IMP_INPUTS_MAX];
    IMP_TRY(imp__build_inputs(scene, node, p->name, ops->inputs, in, &p->n_own));
    p->n_in = p->n_own;
    for (size_t i = 0; i < node->n_children && ops->max_children > 0; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "phase") != 0) continue;
        c->used = true;
        if (p->n_child == ops->max_children)
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_SCENE,
                                    "'%s' takes at most %d phase functions", ops->name,
                                    ops->max_children));
        char child_slot[32];
        snprintf(child_slot, sizeof child_slot, "phase_%d", p->n_child);
        const struct imp_phase *child;
        IMP_TRY(phase_build(scene, c->node, p->name, child_slot, &child));
        if (p->n_in + child->n_in > IMP_INPUTS_MAX)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "has more than %d inputs with all that is in it",
                                    IMP_INPUTS_MAX));
        p->child_in[p->n_child] = p->n_in;
        p->child[p->n_child++] = child;
        for (int j = 0; j < child->n_in; j++) in[p->n_in++] = child->input[j];
    }
    if (p->n_child < ops->min_children)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "a nested phase function is missing"));
    p->input = imp__arena_array(&scene->arena, (size_t)p->n_in + 1, sizeof *p->input);
    if (!p->input) IMP_TRY(imp__build_no_memory(scene));
    if (p->n_in) memcpy(p->input, in, (size_t)p->n_in * sizeof *p->input);

    if (ops->build) IMP_TRY(ops->build(&build, self, p));
    IMP_TRY(imp__props_finish(ctx, node));
    if (ops->changed)
        IMP_TRY(imp__build_watch(scene, p->input, p->n_in, phase_changed, p));
    node->object = p;
    *out = p;
out:
    node->visiting = 0;
    return st;
}

/* The phase function of a medium: its child, or isotropic. */
static enum imp_status phase_of(struct imp_scene *scene, struct imp_node *node,
                                struct imp_medium *m)
{
    struct imp_node *phase = NULL;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "phase") != 0) continue;
        if (phase)
            return imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                   "has two phase functions; blendphase makes one of "
                                   "them");
        c->used = true;
        phase = c->node;
    }
    if (!phase)
        phase =
            imp__node_create(&scene->arena, "phase", "isotropic", NULL, NULL, node->loc);
    if (!phase) return imp__build_no_memory(scene);
    return phase_build(scene, phase, m->name, "phase", &m->phase);
}

/* Its points as what walks scatter at. */
static enum imp_status scatterers_make(struct imp_scene *scene, struct imp_medium *m,
                                       struct imp_mixing *mixing)
{
    enum imp_status st = IMP_OK;
    struct imp_bsdf *b = imp__arena_array(&scene->arena, 2, sizeof *b);
    if (!b) return imp__build_no_memory(scene);
    for (int k = 0; k < 2; k++)
        b[k] = (struct imp_bsdf){.ops = k ? &imp__in_pure_medium : &imp__in_medium,
                                 .self = m,
                                 .flags = IMP_BSDF_SMOOTH | IMP_BSDF_TRANSMIT |
                                          (k == 0 && m->emits ? IMP_BSDF_EMIT : 0u),
                                 .n_in = m->n_in,
                                 .input = m->input,
                                 .shaped = imp__build_shaped(scene, m->input, m->n_in),
                                 .index_input = -1,
                                 .index = k ? -1 : scene->n_bsdfs,
                                 .name = m->name};
    m->scatterer = &b[0];
    m->pure = &b[1];
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->bsdfs, &scene->n_bsdfs, b));
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->bsdf_mixing,
                                &scene->n_bsdf_mixing, mixing));
out:
    return st;
}

/* Derivatives with respect to these values are not those of a walk whose collisions stay
 * where they are. */
static void probed(struct imp_scene *scene, const struct imp_input *in)
{
    const int param = in->texture ? in->texture->param : in->param;
    if (param >= 0) scene->params[param].probed = true;
    for (int j = 0; in->texture && j < in->texture->n_in; j++)
        probed(scene, in->texture->input[j]);
}

static void medium_changed(void *payload)
{
    const struct imp_medium *m = payload;
    m->ops->changed(m);
}

enum imp_status imp__build_medium(struct imp_scene *scene, struct imp_node *node,
                                  const char *parent, const char *slot,
                                  const struct imp_medium **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const void *found;
    if (node->object) {
        *out = node->object;
        return IMP_OK;
    }
    IMP_TRY(imp__kind_find(ctx, IMP_CONCEPT_MEDIUM, node, &found));
    const struct imp_medium_ops *ops = found;
    struct imp_medium *m = imp__arena_array(&scene->arena, 1, sizeof *m);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!m || !self) IMP_TRY(imp__build_no_memory(scene));
    *m = (struct imp_medium){.ops = ops,
                             .self = self,
                             .name = imp__build_object_name(scene, node, parent, slot),
                             .index = scene->n_media};
    if (!m->name) IMP_TRY(imp__build_no_memory(scene));

    const struct imp_input *in[IMP_INPUTS_MAX];
    IMP_TRY(imp__build_inputs(scene, node, m->name, ops->inputs, in, &m->n_own));
    IMP_TRY(phase_of(scene, node, m));
    m->n_in = m->n_own + m->phase->n_in;
    if (m->n_in > IMP_INPUTS_MAX)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "has %d inputs with its phase function's; at most %d are "
                                "possible",
                                m->n_in, IMP_INPUTS_MAX));
    for (int j = 0; j < m->phase->n_in; j++) in[m->n_own + j] = m->phase->input[j];
    m->input = imp__arena_array(&scene->arena, (size_t)m->n_in + 1, sizeof *m->input);
    if (!m->input) IMP_TRY(imp__build_no_memory(scene));
    if (m->n_in) memcpy(m->input, in, (size_t)m->n_in * sizeof *m->input);

    const struct imp_build build = imp__build_make(scene, node);
    struct imp_mixing *mixing;
    if (ops->build) IMP_TRY(ops->build(&build, self, m));
    IMP_TRY(imp__mixing_read(&build, &mixing));
    IMP_TRY(imp__props_finish(ctx, node));
    if (ops->changed)
        IMP_TRY(imp__build_watch(scene, m->input, m->n_own, medium_changed, m));
    IMP_TRY(imp__majorants_create(scene, node, m));
    IMP_TRY(scatterers_make(scene, m, mixing));
    for (int j = 0; j < m->n_own; j++)
        if (ops->inputs[j].flags & IMP_INPUT_EXTINCTION) probed(scene, m->input[j]);
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->media, &scene->n_media, m));
    node->object = m;
    *out = m;
out:
    return st;
}

/* Does the integrator, or one that it contains, support media? */
static bool knows_media(const struct imp_integrator *i)
{
    if (i && i->ops->flags & IMP_INTEGRATOR_MEDIA) return true;
    for (int k = 0; i && k < i->n_inner; k++)
        if (knows_media(&i->inner[k])) return true;
    return false;
}

/* The first object with a priority. */
static const struct imp_node *priority_of(const struct imp_node *node)
{
    if (imp__node_prop(node, "priority")) return node;
    const struct imp_node *found = NULL;
    for (size_t i = 0; i < node->n_children && !found; i++)
        found = priority_of(node->children[i].node);
    return found;
}

enum imp_status imp__media_check(struct imp_scene *scene)
{
    const bool knows = knows_media(scene->integrator);
    bool used = false;
    for (int i = 0; i < scene->n_all_shapes; i++) {
        const struct imp_shape *s = scene->shapes[i];
        const bool bounds = s->interior || s->exterior;
        used |= bounds;
        if (s->body && (bounds || scene->n_media > 0))
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "shape '%s': light goes on bent lines in its graded "
                              "index, and is scattered by media on straight ones only",
                              s->name);
        if (knows && s->emitter >= 0 && imp__shape_bsdf(scene, s)->flags & IMP_BSDF_NULL)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "shape '%s': a surface that light passes cannot emit: "
                              "give the emitter a shape of its own",
                              s->name);
    }
    for (int i = 0; i < scene->n_sensors; i++) used |= scene->sensors[i]->medium != NULL;
    if (scene->priorities && !knows) {
        const struct imp_node *found = priority_of(scene->root);
        const struct imp_node *node = found ? found : scene->root;
        return imp__prop_error(
            scene->ctx, node, imp__node_prop(node, "priority"), IMP_E_UNSUPPORTED,
            "has a priority, which the integrator, %s, does not support: "
            "volpath, photons, ptracer and bdpt do",
            scene->integrator ? scene->integrator->ops->name : "path by default");
    }
    if (used && !knows)
        imp__warn(scene->ctx,
                  "the scene has media, and its integrator, %s, does not see them: "
                  "volpath does",
                  scene->integrator ? scene->integrator->ops->name : "path by default");
    return IMP_OK;
}
