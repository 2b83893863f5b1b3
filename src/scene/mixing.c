/* SPDX-License-Identifier: Apache-2.0
 *
 * Weights of the densities of directions as text, checked, and settled for a scene: densities that
 * it has no use for get weight 0. */
#include "mixing.h"
#include "base/nearest.h"
#include "base/number.h"
#include "scene.h"
#include <stdio.h>
#include <string.h>

const char *const imp__density_name[IMP_DENSITIES] = {[IMP_DENSITY_KERNEL] = "kernel",
                                                      [IMP_DENSITY_EMITTERS] = "emitters",
                                                      [IMP_DENSITY_ENVIRONMENT] =
                                                          "environment",
                                                      [IMP_DENSITY_PROXIES] = "proxies",
                                                      [IMP_DENSITY_GUIDE] = "guide",
                                                      [IMP_DENSITY_UNIFORM] = "uniform"};

/* ---- As written ------------------------------------------------------------------ */

static enum imp_status word_error(imp_context *ctx, const struct imp_node *node,
                                  const struct imp_prop *p, const char *word)
{
    struct imp_nearest near = imp__nearest(word);
    for (int k = 0; k < IMP_DENSITIES; k++) imp__nearest_try(&near, imp__density_name[k]);
    return imp__prop_error(ctx, node, p, IMP_E_SCENE,
                           "weights: '%.40s' is no density (kernel, emitters, "
                           "environment, proxies, guide, uniform)%s%s%s",
                           word, near.best ? "; did you mean '" : "",
                           near.best ? near.best : "", near.best ? "'?" : "");
}

/* "name=number", anything that is no letter, digit or sign between them. */
static enum imp_status weights_parse(imp_context *ctx, const struct imp_node *node,
                                     const struct imp_prop *p, const char *text,
                                     struct imp_mixing *out)
{
    static const char blank[] = " \t\r\n,";
    double sum = 0;
    for (int k = 0; k < IMP_DENSITIES; k++) out->weight[k] = 0;
    out->weight[IMP_DENSITY_GUIDE] = -1;
    for (const char *s = text + strspn(text, blank); *s; s += strspn(s, blank)) {
        char word[48];
        const size_t length = strcspn(s, "= \t\r\n,");
        snprintf(word, sizeof word, "%.*s", (int)imp_min(length, sizeof word - 1), s);
        int k = 0;
        while (k < IMP_DENSITIES && strcmp(imp__density_name[k], word) != 0) k++;
        if (k == IMP_DENSITIES) return word_error(ctx, node, p, word);
        s += length;
        s += strspn(s, blank);
        double value;
        bool good = *s == '=';
        if (good) {
            s += 1 + strspn(s + 1, blank);
            const char *end = s + strcspn(s, blank);
            good = imp__number(&s, end, &value) && s == end;
        }
        if (!good)
            return imp__prop_error(ctx, node, p, IMP_E_SCENE,
                                   "weights: expected '%s=NUMBER'", word);
        if (!(value >= 0 && value < INFINITY))
            return imp__prop_error(ctx, node, p, IMP_E_SCENE,
                                   "weights: %s = %g is negative or not finite", word,
                                   value);
        out->weight[k] = value;
        sum += value;
    }
    if (!(sum > 0 && sum < INFINITY))
        return imp__prop_error(ctx, node, p, IMP_E_SCENE, "weights: all are 0");
    return IMP_OK;
}

enum imp_status imp__mixing_read(const struct imp_build *build, struct imp_mixing **out)
{
    imp_context *ctx = build->ctx;
    struct imp_node *node = build->node;
    const char *text;
    *out = NULL;
    const enum imp_status st = imp__props_string(ctx, node, "weights", NULL, &text);
    if (st != IMP_OK || !text) return st;
    *out = imp__arena_array(build->arena, 1, sizeof **out);
    if (!*out) return imp__error(ctx, IMP_E_NOMEM, "no memory for the scene");
    (*out)->node = node;
    return weights_parse(ctx, node, imp__node_prop(node, "weights"), text, *out);
}

/* ---- As used --------------------------------------------------------------------- */

bool imp__mixing_possible(const struct imp_scene *scene, enum imp_density density)
{
    switch (density) {
    case IMP_DENSITY_EMITTERS: return scene->aims.n_lights > 0;
    case IMP_DENSITY_ENVIRONMENT: return scene->environment >= 0;
    case IMP_DENSITY_PROXIES: return scene->aims.n > scene->aims.n_lights;
    case IMP_DENSITY_KERNEL:
    case IMP_DENSITY_GUIDE:
    case IMP_DENSITY_UNIFORM:
    case IMP_DENSITIES: break;
    }
    return true;
}

enum imp_status imp__mixing_settle(struct imp_scene *scene, struct imp_mixing *m)
{
    const struct imp_prop *p = m->node ? imp__node_prop(m->node, "weights") : NULL;
    double sum = 0;
    for (int k = 0; k < IMP_DENSITIES; k++) {
        if (m->weight[k] > 0 && !imp__mixing_possible(scene, (enum imp_density)k)) {
            imp__warn(scene->ctx, "weights: the scene has no %s; the others share its %g",
                      k == IMP_DENSITY_EMITTERS ? "lights with a surface"
                                                : imp__density_name[k],
                      m->weight[k]);
            m->weight[k] = 0;
        }
        sum += imp_max(m->weight[k], 0.0);
    }
    if (m->node && !(m->weight[IMP_DENSITY_KERNEL] + m->weight[IMP_DENSITY_UNIFORM] > 0))
        return imp__prop_error(scene->ctx, m->node, p, IMP_E_SCENE,
                               "weights: kernel and uniform are both 0, and directions "
                               "that no other density draws would bring no light");
    for (int k = 0; k < IMP_DENSITIES; k++)
        if (m->weight[k] > 0) m->weight[k] /= sum;
    scene->aims.aimed |=
        m->weight[IMP_DENSITY_EMITTERS] > 0 || m->weight[IMP_DENSITY_PROXIES] > 0;
    return IMP_OK;
}

bool imp__mixing_mixes(const struct imp_mixing *m)
{
    for (int k = 0; k < IMP_DENSITIES; k++)
        if (k != IMP_DENSITY_KERNEL && m->weight[k] > 0) return true;
    return m->weight[IMP_DENSITY_GUIDE] == 0; /* the guide draws nothing */
}

static struct imp_mixing *inherited(const struct imp_scene *scene,
                                    const struct imp_bsdf *b)
{
    struct imp_mixing *m = scene->bsdf_mixing[b->index];
    for (int k = 0; !m && k < b->n_child; k++) m = inherited(scene, b->child[k]);
    return m;
}

enum imp_status imp__mixing_materials(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    for (int b = 0; b < scene->n_bsdfs; b++) {
        struct imp_mixing *m = scene->bsdf_mixing[b];
        if (!m) continue;
        IMP_TRY(imp__mixing_settle(scene, m));
        scene->materials_mix = true;
    }
    /* Children precede their parents in the list, so they are finished when a parent uses
     * them. */
    for (int b = 0; b < scene->n_bsdfs; b++)
        scene->bsdf_mixing[b] = inherited(scene, scene->bsdfs[b]);
out:
    return st;
}
