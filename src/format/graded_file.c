/* SPDX-License-Identifier: Apache-2.0
 *
 * <medium type="graded"> of a scene: the field and its steps, read as in files of bent
 * rays (bend_load_medium.c), attached to its node until the scene is built. */
#include "bend/inside.h"
#include "format/bend/bend_load.h"
#include "load.h"
#include "scene/scene_build.h"
#include <stdio.h>
#include <string.h>

struct numbers_job {
    struct imp_scene *scene;
    struct imp_body *medium;
    const double *lo, *hi;
    int n_leaves, leaf;
    bool failed, single, large, tied;
};

static void leaf_count(imp_field *f, size_t offset, void *payload)
{
    struct numbers_job *j = payload;
    const bool grid = imp__field_is_grid(f);
    const uint32_t *number;
    (void)offset;
    j->tied |= imp__field_nodes(f, &number) && number;
    j->n_leaves++;
    j->medium->n_numbers += grid || !imp_field_param_name(f, 0) ? 1 : (int)f->n_theta;
    if (grid) j->single |= ((const struct imp__grid *)f)->single != NULL;
    else j->large |= f->n_theta > 4096;
}

/* "field.coefficients", or "field.n0", ...; of sums "field_0.coefficients". */
static void leaf_name(imp_field *f, size_t offset, void *payload)
{
    struct numbers_job *j = payload;
    struct imp_body *m = j->medium;
    const bool grid = imp__field_is_grid(f), one = grid || !imp_field_param_name(f, 0);
    char stem[32] = "field";
    if (j->n_leaves > 1) snprintf(stem, sizeof stem, "field_%d", j->leaf);
    j->leaf++;
    for (size_t k = 0; k < (one ? 1 : f->n_theta); k++) {
        char key[96];
        const char *name = one ? "coefficients" : imp_field_param_name(f, k);
        struct imp_body_numbers *n = &m->numbers[m->n_numbers++];
        snprintf(key, sizeof key, "%s.%s", stem, name ? name : "value");
        *n = (struct imp_body_numbers){.key = imp__arena_strdup(&j->scene->arena, key),
                                       .first = offset + k,
                                       .count = one ? f->n_theta : 1,
                                       .n_dims = grid ? 3 : one,
                                       .number = f->theta + k,
                                       .lo = j->lo[offset + k],
                                       .hi = j->hi[offset + k],
                                       .why = f->ops->jumps,
                                       .param = -1};
        n->dims[0] = f->n_theta;
        if (grid)
            for (int d = 0; d < 3; d++)
                n->dims[d] = (size_t)((const struct imp__grid *)f)->nodes[2 - d];
        j->failed |= !n->key;
    }
}

static enum imp_status numbers_make(struct imp_scene *scene, struct imp_node *node,
                                    struct imp_body *m)
{
    enum imp_status st = IMP_OK;
    imp_bend *b = m->graded->bend;
    const size_t n = b->field->n_theta;
    struct numbers_job j = {.scene = scene, .medium = m};
    double *bounds = imp__alloc(scene->ctx, 2 * imp_max(n, (size_t)1), sizeof *bounds);
    if (!bounds) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a medium");
    imp__bend_bounds(b, bounds, bounds + n);
    j.lo = bounds, j.hi = bounds + n;
    imp__field_leaves(b->field, 0, leaf_count, &j);
    if (j.single)
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                "'single' samples are for files of bent rays only"));
    if (j.tied)
        IMP_TRY(
            imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                            "grids with a 'symmetry' are for files of bent rays only; "
                            "there is 'rz'"));
    if (j.large)
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                "a profile of more than 4096 numbers"));
    m->numbers =
        imp__arena_array(&scene->arena, (size_t)m->n_numbers, sizeof *m->numbers);
    if (!m->numbers) IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory"));
    m->n_numbers = 0;
    imp__field_leaves(b->field, 0, leaf_name, &j);
    if (j.failed) IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a medium"));
out:
    imp__release(scene->ctx, bounds);
    return st;
}

/* Refuse what is valid in files of `importon bend` only. */
static enum imp_status only_for_rays(struct imp_scene *scene, struct imp_node *node,
                                     const struct imp__bendfile *l)
{
    static const char *const words[] = {
        "outside", "way", "grazing", "cauchy", "reference", "sellmeier_b", "sellmeier_c"};
    for (size_t i = 0; i < imp_count(words); i++)
        if (imp__props_has(node, words[i]))
            return imp__prop_error(scene->ctx, node, imp__node_prop(node, words[i]),
                                   IMP_E_UNSUPPORTED,
                                   "'%s' is for files of bent rays only", words[i]);
    if (l->truth)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "a volume 'truth' is for files of bent rays only");
    if (l->options.scheme == IMP_BEND_ARC_INDEX)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "rays of scheme arc-index cannot be run backwards: there "
                               "is 'arc'");
    return IMP_OK;
}

static void graded_destroy(void *graded) { imp__graded_destroy(graded); }

enum imp_status imp__graded_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    struct imp__bendfile l = {.ctx = scene->ctx, .scene = scene};
    struct imp_body *m = imp__arena_array(&scene->arena, 1, sizeof *m);
    double lo, hi;
    if (!m) IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a medium"));
    IMP_TRY(imp__bendfile_medium(&l, node));
    IMP_TRY(only_for_rays(scene, node, &l));
    IMP_TRY(imp__bendfile_number(&l, node, "index_min", 1, 1e-3, 1e3, &lo));
    IMP_TRY(imp__bendfile_number(&l, node, "index_max", 1e300, 1e-3, 1e300, &hi));
    if (imp__props_has(node, "index_min") || imp__props_has(node, "index_max"))
        IMP_TRY(imp_bend_set_bounds(l.bend, lo, hi));
    IMP_TRY(imp_bend_set_options(l.bend, &l.options));
    m->outside = l.options.outside_index > 0 ? l.options.outside_index : 1;
    m->index = -1;
    m->node = node;
    imp_bend *given = l.bend;
    l.bend = NULL;
    IMP_TRY(imp__graded_create(given, &m->graded));
    IMP_TRY(imp__scene_own(scene, m->graded, graded_destroy));
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->bodies, &scene->n_bodies, m));
    node->body = m;
    IMP_TRY(numbers_make(scene, node, m));
out:
    imp_bend_destroy(l.bend);
    imp_field_destroy(l.truth);
    return st;
}

static void field_changed(void *payload)
{
    imp_field *f = payload;
    f->ops->changed(f);
}

enum imp_status imp__graded_finish(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    for (int i = 0; i < scene->n_bodies; i++) {
        struct imp_body *m = scene->bodies[i];
        if (m->index < 0) continue; /* declared, and used by no shape */
        st = imp__graded_ready(m->graded, m->lo, m->hi);
        if (st == IMP_E_ARG || st == IMP_E_SCENE) {
            char message[900];
            snprintf(message, sizeof message, "%s", imp_last_error(scene->ctx));
            st = imp__node_error(scene->ctx, m->node, IMP_E_SCENE, "%s", message);
        }
        imp_field *f = m->graded->bend->field;
        for (int k = 0; st == IMP_OK && f->ops->changed && k < m->n_numbers; k++)
            st = imp__theta_watch(scene, m->numbers[k].param, field_changed, f);
        if (st != IMP_OK) break;
    }
    return st;
}
