/* SPDX-License-Identifier: Apache-2.0
 *
 * From nodes to objects, in document order. Parameters get their names on the way
 * (docs/scene-format.md 12.2): by an object's own id, else below its parent's name; at the
 * top by its name. */
#include "scene_build.h"
#include "instances.h"
#include "kind/sensor/receiver.h"
#include "light_tree.h"
#include "priorities.h"
#include "sealed.h"

/* Top-level objects without id: <tag><n>, counted per tag. */
struct tag_counts {
    int n_tags;
    struct {
        const char *tag;
        size_t n;
    } tags[16]; /* there are not as many */
};

/* Is `name` the id of the node or of something in it? */
static bool is_id(const struct imp_node *node, const char *name)
{
    if (node->id && strcmp(node->id, name) == 0) return true;
    for (size_t i = 0; i < node->n_children; i++)
        if (!node->children[i].ref && is_id(node->children[i].node, name)) return true;
    return false;
}

/* Exporters write `name` in place of an id. */
static const char *top_name(struct imp_scene *scene, const struct imp_child *child,
                            struct tag_counts *counts)
{
    const struct imp_node *node = child->node;
    if (node->id) return node->id;
    if (child->name && !is_id(scene->root, child->name)) return child->name;
    int k = 0;
    while (k < counts->n_tags && strcmp(counts->tags[k].tag, node->tag) != 0) k++;
    if (k == counts->n_tags && k < (int)imp_count(counts->tags))
        counts->tags[counts->n_tags++].tag = node->tag;
    char text[64];
    snprintf(text, sizeof text, "%.40s%zu", node->tag,
             k < counts->n_tags ? counts->tags[k].n++ : 0);
    return imp__arena_strdup(&scene->arena, text);
}

static enum imp_status top_build(struct imp_scene *scene, struct imp_child *child,
                                 const struct imp_integrator_ops *const *integrators,
                                 struct tag_counts *counts)
{
    enum imp_status st = IMP_OK;
    struct imp_node *node = child->node;
    const char *tag = node->tag, *name = top_name(scene, child, counts);
    if (!name) return imp__build_no_memory(scene);
    child->used = true;
    if (strcmp(tag, "shape") == 0) {
        if (imp__is_group(node) || imp__is_instance(node)) return IMP_OK; /* later */
        if (!node->object) IMP_TRY(imp__build_shape(scene, node, name));
    } else if (strcmp(tag, "sensor") == 0) {
        if (!node->object) IMP_TRY(imp__build_sensor(scene, node, name, NULL));
        if (!node->object && !node->id)
            IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                    "it must be inside a shape"));
    } else if (strcmp(tag, "bsdf") == 0) {
        struct imp_bsdf *b;
        node->id = name;
        IMP_TRY(imp__build_bsdf(scene, node, "", "", &b));
    } else if (strcmp(tag, "texture") == 0 || strcmp(tag, "spectrum") == 0) {
        struct imp_texture *t;
        if (strcmp(tag, "texture") == 0 && !imp__color_is_object(node)) {
            node->id = name;
            IMP_TRY(imp__build_texture(scene, node, "", "", NULL, &t));
        }
    } else if (strcmp(tag, "emitter") == 0) {
        const bool had_id = node->id;
        node->id = name;
        if (!node->object) IMP_TRY(imp__build_emitter(scene, node, "", "", NULL));
        if (!had_id && !node->object)
            IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                    "an area emitter must be inside a shape"));
    } else if (strcmp(tag, "medium") == 0) {
        if (!node->id) node->id = name; /* declared; made where a shape refers to it */
        const struct imp_medium *m;
        if (strcmp(node->type, "graded") != 0)
            IMP_TRY(imp__build_medium(scene, node, "", "", &m));
    } else if (strcmp(tag, "integrator") == 0) {
        if (scene->integrator)
            IMP_TRY(
                imp__node_error(scene->ctx, node, IMP_E_SCENE, "a second integrator"));
        struct imp_integrator *i = imp__arena_array(&scene->arena, 1, sizeof *i);
        if (!i) IMP_TRY(imp__build_no_memory(scene));
        IMP_TRY(imp__integrator_build(scene, node, integrators, i));
        scene->integrator = i;
    } else if (strcmp(tag, "film") != 0 && strcmp(tag, "sampler") != 0 &&
               strcmp(tag, "rfilter") != 0 && strcmp(tag, "phase") != 0 &&
               strcmp(tag, "volume") != 0) { /* those are declared for others */
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                "this version has no <%s>", tag));
    }
out:
    return st;
}

/* Emitters are chosen by sampling_weight; all zero is as good as none. */
static enum imp_status lights_build(struct imp_scene *scene)
{
    double total = 0;
    for (int i = 0; i < scene->n_emitters; i++) total += scene->emitters[i]->weight;
    scene->light_cdf = imp__arena_array(&scene->arena, (size_t)scene->n_emitters + 1,
                                        sizeof *scene->light_cdf);
    if (!scene->light_cdf) return imp__build_no_memory(scene);
    double sum = 0;
    for (int i = 0; i < scene->n_emitters; i++) {
        sum += scene->emitters[i]->weight;
        scene->light_cdf[i] = total > 0 ? sum / total : 0;
    }
    if (scene->n_emitters && total > 0) scene->light_cdf[scene->n_emitters - 1] = 1;
    scene->environments = imp__arena_array(&scene->arena, (size_t)scene->n_emitters + 1,
                                           sizeof *scene->environments);
    if (!scene->environments) return imp__build_no_memory(scene);
    for (int i = 0; i < scene->n_emitters; i++)
        if (scene->emitters[i]->ops->flags & IMP_EMITTER_ENVIRONMENT)
            scene->environments[scene->n_environments++] = i;
    if (scene->n_environments > 0) scene->environment = scene->environments[0];
    return IMP_OK;
}

/* Are there grids of illuminances, which choose among several lights by the tree? */
static bool grids_need_tree(const struct imp_scene *scene)
{
    bool grids = false;
    if (!scene->grids_by_tree || scene->n_emitters < 2) return false;
    for (int i = 0; i < scene->n_sensors; i++)
        grids |= !scene->sensors[i]->gain && imp__has_grid(scene->sensors[i]);
    return grids;
}

struct imp_ball imp__ball_around(const struct imp_scene *scene)
{
    if (!(scene->lo[0] <= scene->hi[0])) return (struct imp_ball){{0}, 1};
    const imp_v3 size = scene->hi - scene->lo;
    return (struct imp_ball){(scene->lo + scene->hi) * 0.5,
                             0.5 * imp__length(size) * (1 + 1e-3)};
}

enum imp_status imp__scene_build(struct imp_scene *scene,
                                 const struct imp_integrator_ops *const *integrators)
{
    enum imp_status st = IMP_OK;
    struct tag_counts counts = {0};
    scene->channels = scene->mode == IMP_MONO ? 1 : 3;
    scene->lanes = imp__is_spectral(scene->mode) ? 4 : scene->channels;
    scene->environment = -1;
    scene->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    scene->hi = -scene->lo;
    IMP_TRY(imp__build_black(scene, &scene->black_bsdf));
    scene->default_bsdf = scene->black_bsdf;
    IMP_TRY(imp__proxies_take(scene, scene->root, ""));
    for (size_t i = 0; i < scene->root->n_children; i++)
        if (!imp__is_proxy(&scene->root->children[i]))
            IMP_TRY(top_build(scene, &scene->root->children[i], integrators, &counts));
    IMP_TRY(imp__instances_build(scene));
    IMP_TRY(imp__props_finish(scene->ctx, scene->root));
    IMP_TRY(imp__build_attributes(scene));
    scene->ball = imp__ball_around(scene);
    IMP_TRY(lights_build(scene));
    IMP_TRY(imp__aims_build(scene));
    IMP_TRY(imp__mixing_materials(scene));
    IMP_TRY(imp__priorities_build(scene)); /* integrators need them */
    if (scene->integrator) IMP_TRY(imp__integrator_ready(scene, scene->integrator));
    IMP_TRY(imp__waves_build(scene));
    IMP_TRY(imp__bodies_check(scene));
    IMP_TRY(imp__media_check(scene));
    imp__theta_finish(scene);
    if (!scene->rayless) {
        imp__scene_release_files(scene); /* before a tree is built beside them */
        IMP_TRY(imp__intersector_create(scene));
        if (scene->aims.aimed) IMP_TRY(imp__aims_aim(scene));
        if (scene->lights_in_tree || grids_need_tree(scene))
            IMP_TRY(imp__light_tree_build(scene));
        IMP_TRY(imp__media_survey(scene));
        IMP_TRY(imp__sealed_create(scene));
    }
    scene->committed = true;
out:
    return st;
}
