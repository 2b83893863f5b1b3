/* SPDX-License-Identifier: Apache-2.0
 *
 * Proxies of a scene file made into aims, strengths that follow the lights' parameters, and the
 * density p(w) of aimed_directions.h with its draws. */
#include "aimed_directions.h"
#include "color/rgb.h"
#include "kind/shape/shape.h"
#include "math/rng.h"
#include "math/warp.h"
#include "scene_build.h"

/* ---- Proxies as they are written ------------------------------------------------- */

bool imp__is_proxy(const struct imp_child *c)
{
    return c->name && strncmp(c->name, "proxy", 5) == 0 &&
           c->name[5 + strspn(c->name + 5, "_0123456789")] == 0 && c->node &&
           strcmp(c->node->tag, "shape") == 0;
}

enum imp_status imp__proxies_take(struct imp_scene *scene, struct imp_node *node,
                                  const char *parent)
{
    enum imp_status st = IMP_OK;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (!imp__is_proxy(c)) continue;
        c->used = true;
        struct imp_proxy *p = imp__arena_array(&scene->arena, 1, sizeof *p);
        if (!p) return imp__build_no_memory(scene);
        *p = (struct imp_proxy){c->node, parent, c->name,
                                strcmp(node->tag, "emitter") == 0 ? node : NULL};
        IMP_TRY(
            imp__build_list_add(scene, (void ***)&scene->proxies, &scene->n_proxies, p));
    }
out:
    return st;
}

/* ---- Making ---------------------------------------------------------------------- */

/* The shape of a proxy: that of the scene that it refers to, or one made for it alone,
 * which no ray meets. */
static enum imp_status proxy_shape(struct imp_scene *scene, const struct imp_proxy *p,
                                   const struct imp_shape **out, double *weight)
{
    enum imp_status st = IMP_OK;
    struct imp_node *node = p->node;
    struct imp_shape *made = node->object;
    *weight = 1;
    if (!made) {
        const char *name = *p->parent
                               ? imp__build_object_name(scene, node, p->parent, p->slot)
                           : node->id ? node->id
                                      : p->slot;
        if (!name) return imp__build_no_memory(scene);
        for (size_t i = 0; i < node->n_children; i++)
            IMP_TRY(imp__node_error(scene->ctx, node->children[i].node, IMP_E_SCENE,
                                    "a proxy is a bare shape: light passes it"));
        IMP_TRY(imp__props_float_in(scene->ctx, node, "sampling_weight", 1,
                                    IMP_NOT_NEGATIVE, weight));
        IMP_TRY(imp__build_shape_bare(scene, node, name, &made));
        IMP_TRY(imp__props_finish(scene->ctx, node));
    }
    *out = made;
    IMP_TRY(imp__shape_measure(scene->ctx, &scene->arena, made));
    if (!made->ops->sample_toward)
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                "points of this shape cannot be drawn"));
    if (!(made->area > 0))
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                "a proxy without area: no direction meets it"));
out:
    return st;
}

static void aim_place(struct imp_aim *t, const struct imp_shape *shape)
{
    t->shape = shape;
    t->centre = (shape->lo + shape->hi) * 0.5;
    t->near2 = imp__sqr(0.5 * imp__length(shape->hi - shape->lo));
}

/* Intensity of a light, averaged over directions: the integral of its radiance over the
 * solid angle under which it is seen, times the squared distance. */
#define DIRECTIONS 64
static double intensity(const struct imp_scene *scene, const struct imp_emitter *e)
{
    const struct imp_key key = imp__key(0x1e47, (uint64_t)e->index, 0);
    struct imp_aim t;
    double sum = 0;
    aim_place(&t, e->shape);
    const double r = 2 * sqrt(t.near2);
    for (int k = 0; k < DIRECTIONS; k++) {
        double u[4];
        struct imp_light_sample ls;
        imp_spec in[IMP_INPUTS_MAX], le;
        for (int j = 0; j < 4; j++) u[j] = imp__u01(key, (uint32_t)(4 * k + j));
        u[0] = (k + u[0]) / DIRECTIONS;
        const imp_v3 from = t.centre + imp__uniform_sphere(u) * r;
        if (!e->ops->sample(e, &from, u + 2, &ls) || !(ls.pdf > 0)) continue;
        const struct imp_emission x = {
            {ls.uv[0], ls.uv[1]}, ls.dist, ls.cos_light, -ls.wi};
        const struct imp_texcoord at = {
            .uv = {ls.uv[0], ls.uv[1]}, .p = ls.p, .shape = e->shape};
        imp__inputs_eval(e->input, e->n_in, &at, in);
        e->ops->eval(e, in, &x, &le);
        sum +=
            (scene->channels == 1 ? le[0] : imp__luminance(le[0], le[1], le[2])) / ls.pdf;
    }
    const double mean = sum / DIRECTIONS * r * r;
    return mean > 0 && mean < INFINITY ? mean : 0;
}

/* A light's values have changed: its strength follows, so that densities never aim at
 * what a light once was. */
struct strength {
    struct imp_scene *scene;
    const struct imp_emitter *light;
};
static void strength_set(void *payload)
{
    const struct strength *s = payload;
    const double all = intensity(s->scene, s->light) * s->light->weight;
    for (int k = 0; k < s->scene->aims.n_lights; k++) {
        struct imp_aim *t = &s->scene->aims.list[k];
        if (t->light == s->light) t->strength = t->part * all;
    }
}

static enum imp_status light_watch(struct imp_scene *scene, const struct imp_emitter *e)
{
    struct strength *s = imp__arena_array(&scene->arena, 1, sizeof *s);
    if (!s) return imp__build_no_memory(scene);
    *s = (struct strength){scene, e};
    strength_set(s);
    return imp__build_watch(scene, e->input, e->n_in, strength_set, s);
}

/* Proxies of one light (NULL: of none) as aims; *area: of all, weighted. */
static enum imp_status proxies_add(struct imp_scene *scene,
                                   const struct imp_emitter *light, int *n, double *area)
{
    enum imp_status st = IMP_OK;
    *area = 0;
    for (int k = 0; k < scene->n_proxies; k++) {
        const struct imp_proxy *p = scene->proxies[k];
        const struct imp_shape *shape = NULL;
        double weight;
        if ((p->owner ? p->owner->object : NULL) != light) continue;
        if (light && !light->shape)
            IMP_TRY(imp__node_error(scene->ctx, p->node, IMP_E_SCENE,
                                    "only lights with a surface have proxies; give the "
                                    "scene this one"));
        IMP_TRY(proxy_shape(scene, p, &shape, &weight));
        struct imp_aim *t = &scene->aims.list[(*n)++];
        aim_place(t, shape);
        t->light = light;
        t->part = t->strength = weight * shape->area;
        *area += t->part;
    }
out:
    return st;
}

enum imp_status imp__aims_build(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    struct imp_aims *t = &scene->aims;
    double area;
    int n = 0;
    t->list = imp__arena_array(&scene->arena,
                               (size_t)scene->n_emitters + (size_t)scene->n_proxies + 1,
                               sizeof *t->list);
    if (!t->list) return imp__build_no_memory(scene);
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        const int first = n;
        IMP_TRY(proxies_add(scene, e, &n, &area));
        if (!e->shape) continue;
        if (n == first) {
            aim_place(&t->list[n], e->shape);
            t->list[n].light = e;
            t->list[n++].part = area = 1;
        }
        for (int j = first; j < n; j++) t->list[j].part /= area > 0 ? area : 1;
    }
    t->n_lights = n;
    IMP_TRY(proxies_add(scene, NULL, &n, &area));
    t->n = n;
    if (n > t->n_lights && !(area > 0))
        IMP_TRY(imp__node_error(scene->ctx, scene->proxies[0]->node, IMP_E_SCENE,
                                "the sampling_weight of every proxy is 0"));
out:
    return st;
}

enum imp_status imp__aims_aim(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    const struct imp_aims *t = &scene->aims;
    for (int k = 0; k < t->n_lights; k++) /* once a light */
        if (k == 0 || t->list[k].light != t->list[k - 1].light)
            IMP_TRY(light_watch(scene, t->list[k].light));
    IMP_TRY(imp__aims_commit(scene));
out:
    return st;
}

/* ---- Densities ------------------------------------------------------------------- */

static inline double strength_at(const struct imp_aim *t, imp_v3 from)
{
    const imp_v3 d = t->centre - from;
    return t->strength / fmax(imp__dot(d, d), t->near2);
}

double imp__aims_sum(const struct imp_aims *t, int first, int end, imp_v3 from)
{
    double sum = 0;
    for (int k = first; k < end; k++) sum += strength_at(&t->list[k], from);
    return sum;
}

int imp__aim_choose(const struct imp_aims *t, int first, int end, double sum, imp_v3 from,
                    double u, double *chance)
{
    int chosen = -1;
    double below = 0;
    *chance = 0;
    for (int k = first; k < end; k++) {
        const double part = strength_at(&t->list[k], from) / sum;
        if (!(part > 0)) continue;
        chosen = k;
        *chance = part;
        below += part;
        if (u < below) break;
    }
    return chosen;
}

/* Called for each aim that lies along w. */
#define HITS 32
typedef void met_fn(void *payload, int aim, double p);
static void along(const struct imp_aims *t, const double sum[2], imp_v3 from, imp_v3 w,
                  met_fn *met, void *payload)
{
    struct imp_hit hit[HITS], last;
    const double scale = fmax(fabs(from[0]), fmax(fabs(from[1]), fabs(from[2])));
    for (int n = HITS, all = 0; n == HITS; last = hit[HITS - 1], all += n) {
        n = imp__aims_hit(t, &from, &w, (1 + scale) * IMP_RAY_EPSILON, all ? &last : NULL,
                          HITS, hit);
        for (int k = 0; k < n; k++) {
            const struct imp_aim *aim = &t->list[hit[k].shape];
            const struct imp_shape *shape = aim->shape;
            const int group = hit[k].shape >= t->n_lights;
            struct imp_surface at;
            if (!(sum[group] > 0)) continue;
            shape->ops->surface(shape, &hit[k], &from, &w, &at);
            met(payload, hit[k].shape,
                strength_at(aim, from) / sum[group] *
                    shape->ops->pdf_toward(shape, &from, &hit[k], &at));
        }
    }
}

struct grouped {
    int n_lights;
    double *p;
};
static void add_grouped(void *payload, int aim, double p)
{
    const struct grouped *g = payload;
    g->p[aim >= g->n_lights] += p;
}
void imp__aims_pdf(const struct imp_aims *t, const double sum[2], imp_v3 from, imp_v3 w,
                   double p[2])
{
    p[0] = p[1] = 0;
    along(t, sum, from, w, add_grouped, &(struct grouped){t->n_lights, p});
}

static void add_apart(void *payload, int aim, double p) { ((double *)payload)[aim] += p; }
void imp__aims_apart(const struct imp_aims *t, imp_v3 from, const imp_v3 *w, double *part)
{
    for (int k = 0; k < t->n; k++) part[k] = w ? 0 : strength_at(&t->list[k], from);
    if (w) along(t, (const double[]){1, 1}, from, *w, add_apart, part);
}
