/* SPDX-License-Identifier: Apache-2.0
 *
 * Weights of bidirectional walks. A path of vertices x_0 on the light to x_{n-1} on the sensor
 * can be found in several ways; way i draws x_0 .. x_{i-1} from the light, the rest from the
 * sensor, with the density
 *
 *     p_i = product of L_k over k < i  times  that of Y_k over k >= i
 *     w_i = p_i^2/sum_j p_j^2                                          (Veach 1997, 9.2)
 *
 * Walks compute only ratios of these, from what they note as they go. Here the path that a way
 * found is taken as points and directions, and all L_k and Y_k are evaluated from the kinds'
 * densities; then the weights of all ways add up to 1, and the one that the way had is compared
 * with w_i. Parts: the way, and the number of vertices.
 *
 * Paths with a delta lobe are left out, and scenes where densities differ by wavelength, with a
 * surface as the sensor, or whose sensor is not asked for a point. */
#include "check_sources.h"
#include "kind/bsdf/transport.h"
#include "kind/cleared.h"
#include "math/rng.h"
#include "walk/both/both.h"
#include "walk/core/emitted.h"
#include "walk/core/vertex.h"
#include <math.h>

#define LONGEST 16 /* vertices of a path */
enum { WHOLE, MET, SAMPLED, JOINED, REACHED, LENGTHS };

struct weights {
    imp_context *ctx;
    const struct imp_tracer *tracer;
};

/* A vertex of a path; to_light, to_eye: in its frame. */
struct node {
    imp_v3 p, ng, to_light, to_eye;
    bool far;
    const struct imp_bsdf *bsdf;
    const imp_spec *in;
    uint64_t derivative;
    double L, Y;
};
struct path {
    struct node node[LONGEST];
    int n;
    int light; /* emitter */
    struct imp_emission leaves;
    struct imp_sensor_sample sensor; /* seen from node n - 2 */
};

/* ---- Densities ------------------------------------------------------------------------------ */

static double turned(const struct node *x, bool to_light)
{
    const struct imp_dirs d = {.wo = to_light ? x->to_eye : x->to_light,
                               .wi = to_light ? x->to_light : x->to_eye,
                               .lobe = IMP_SMOOTH,
                               .derivative = x->derivative};
    return x->bsdf->ops->pdf(x->bsdf, x->in, &d);
}

/* |cos| at x of a ray along d; 1 in media. */
static double facing(const struct node *x, imp_v3 d)
{
    return imp__is_zero(x->ng) ? 1 : fabs(imp__dot(x->ng, d));
}

/* Per steradian at `from` becomes per area, or volume, at `to`. */
static double per_area(const struct node *from, const struct node *to, double pdf)
{
    if (to->far) return pdf;
    const imp_v3 d = to->p - from->p;
    const double r = imp__length(d);
    return pdf * facing(to, d * (1 / r)) / (r * r);
}

static double chance_of(const struct imp_scene *scene, int light)
{
    return scene->light_cdf[light] - (light > 0 ? scene->light_cdf[light - 1] : 0);
}

/* The density of x_0 as a light sample of x_1, per area of the light, or for the sky per
 * steradian; without the choice of the light. */
static double sampled_pdf(const struct imp_scene *scene, const struct path *path)
{
    const struct imp_emitter *e = scene->emitters[path->light];
    const struct node *x0 = &path->node[0], *x1 = &path->node[1];
    const imp_v3 wi = x0->far ? x0->p : imp__normalize(x0->p - x1->p);
    if (e->ops->flags & IMP_EMITTER_DELTA) return 1;
    if (x0->far) return e->ops->pdf(e, &x1->p, &wi, NULL, NULL);
    const struct imp_surface at = {.p = x0->p, .ng = x0->ng, .n = x0->ng};
    const struct imp_hit hit = {.shape = e->shape->index,
                                .t = imp__length(x0->p - x1->p)};
    return per_area(x1, x0, e->ops->pdf(e, &x1->p, &wi, &hit, &at));
}

/* All L and Y. A light sample has its own density of x_0: *sampled. */
static void densities_set(const struct weights *w, double pixels, struct path *path,
                          double *sampled)
{
    const struct imp_scene *scene = w->tracer->scene;
    const struct imp_emitter *e = scene->emitters[path->light];
    struct node *x = path->node;
    const int n = path->n;
    const double chance = chance_of(scene, path->light),
                 pdf = e->ops->pdf_emission(e, &path->leaves);
    const bool delta = e->ops->flags & IMP_EMITTER_DELTA;
    const double disk = IMP_INV_PI / imp__sqr(scene->ball.radius);
    x[0].L = chance * (delta ? 1 : x[0].far ? pdf : 1 / e->shape->area);
    x[1].L = x[0].far ? (e->shape ? 1 / e->shape->area : disk) * facing(&x[1], x[0].p)
                      : per_area(&x[0], &x[1], pdf);
    for (int k = 2; k < n - 1; k++)
        x[k].L = per_area(&x[k - 1], &x[k], turned(&x[k - 1], false));
    const imp_v3 seen = imp__normalize(x[n - 2].p - x[n - 1].p);
    x[n - 1].Y = 1;
    x[n - 2].Y = path->sensor.weight * facing(&x[n - 2], seen) /
                 (w->tracer->sensor->scale * pixels);
    for (int k = n - 3; k >= 0; k--)
        x[k].Y = per_area(&x[k + 1], &x[k], turned(&x[k + 1], true));
    *sampled = chance * sampled_pdf(scene, path);
}

/* The weight of way i; the sensor is a point, so that no way has i = n. */
static double weight_of(const struct weights *w, double pixels, struct path *path, int i)
{
    const struct imp_scene *scene = w->tracer->scene;
    const bool met = !(scene->emitters[path->light]->ops->flags & IMP_EMITTER_DELTA);
    struct node *x = path->node;
    double sampled, own = 0, sum = 0;
    densities_set(w, pixels, path, &sampled);
    const double base = x[0].L; /* of logarithms: the products may be large */
    for (int j = met ? 0 : 1; j < path->n; j++) {
        double log_p = 0;
        for (int k = 0; k < path->n; k++) {
            const double p = k >= j ? x[k].Y : k == 0 && j == 1 ? sampled : x[k].L;
            const double scale = k == 0 ? base : x[k].Y > 0 ? x[k].Y : 1;
            log_p += log(p / scale);
        }
        const double p = exp(log_p);
        if (j == i) own = p * p;
        sum += p * p;
    }
    return own / sum;
}

/* ---- Paths ---------------------------------------------------------------------------------- */

/* Vertices that scatter, in order; 0: not all of them are fit. */
static int scatterers(const struct imp_vertex *v, const struct imp_vertex *list[LONGEST])
{
    int n = 0;
    for (; v; v = v->next) {
        if (v->d.scatterer == IMP_AT_SENSOR || v->d.scatterer == IMP_AT_LIGHT) continue;
        if (n == LONGEST) return 0;
        list[n++] = v;
    }
    return n;
}

static void node_set(const struct weights *w, const struct imp_end *end,
                     const struct imp_vertex *v, imp_v3 to_light, imp_v3 to_eye,
                     struct node *x)
{
    const struct imp_active *active = w->tracer->active;
    *x = (struct node){.p = end->p,
                       .ng = end->ng,
                       .far = end->far,
                       .to_light = to_light,
                       .to_eye = to_eye};
    if (!v || !v->bsdf) return;
    x->bsdf = v->bsdf;
    x->in = v->in;
    x->derivative = active && v->bsdf->index >= 0 ? active->inputs[v->bsdf->index] : 0;
}

/* What a sample found. */
struct found {
    const struct weights *w;
    const struct imp_both *both;
    const struct imp_light_walk *walk;
    const struct imp_vertex *eye[LONGEST], *lit[LONGEST];
    int n_eye, n_lit; /* vertices behind the sensor, behind the light */
    struct imp__pair *pair;
};

/* x_{n-1} .. x_{n-t} from the walk from the sensor, of which the last has these directions. */
static bool eye_take(const struct found *f, int t, imp_v3 to_light, struct path *path)
{
    const double lens[4] = {f->both->lens[0], f->both->lens[1], 0, 0};
    const struct imp_end *ends = f->both->from_eye;
    if (path->n > LONGEST || t > f->both->n_eye || t - 1 > f->n_eye) return false;
    node_set(f->w, &ends[0], NULL, (imp_v3){0}, (imp_v3){0}, &path->node[path->n - 1]);
    for (int k = 1; k < t; k++) {
        const struct imp_vertex *v = f->eye[k - 1];
        const bool last = k == t - 1;
        if (!last && ends[k].delta) return false;
        node_set(f->w, &ends[k], v, last ? to_light : imp__decided_v3(v->d.wi),
                 imp__decided_v3(v->d.wo), &path->node[path->n - 1 - k]);
    }
    return t < 2 || imp__sensor_connect(f->w->tracer->sensor, &ends[1].p, ends[1].far,
                                        lens, &path->sensor);
}

/* x_0 .. x_{s-1} from the walk from the light. */
static bool light_take(const struct found *f, int s, imp_v3 to_eye, struct path *path)
{
    const struct imp_end *ends = f->both->light;
    const struct imp_vertex *first = f->walk->walk.first;
    if (path->n > LONGEST || s > f->both->n_light || s - 1 > f->n_lit || !first)
        return false;
    path->light = f->both->emitter;
    path->leaves = imp__vertex_met(first);
    node_set(f->w, &ends[0], NULL, (imp_v3){0}, (imp_v3){0}, &path->node[0]);
    for (int k = 1; k < s; k++) {
        const struct imp_vertex *v = f->lit[k - 1];
        const bool last = k == s - 1;
        if (!last && ends[k].delta) return false;
        node_set(f->w, &ends[k], v, imp__decided_v3(v->d.wi),
                 last ? to_eye : imp__decided_v3(v->d.wo), &path->node[k]);
    }
    return true;
}

static void way_add(const struct found *f, struct path *path, int i, int part,
                    double weight)
{
    const double other = weight_of(f->w, f->both->pixels, path, i);
    if (!(weight >= 0) || !(other >= 0)) return;
    imp__pair_add(f->pair, WHOLE, weight, other);
    imp__pair_add(f->pair, part, weight, other);
    imp__pair_add(f->pair, imp_min(LENGTHS + path->n - 3, IMP_DRAW_PARTS - 1), weight,
                  other);
}

/* Emission that the walk from the sensor met at its vertex k. */
static void met_add(const struct found *f, int k)
{
    const struct imp_vertex *v = f->eye[k];
    const struct imp_met *met = &v->d.met;
    struct path path = {.n = k + 2};
    if (k < 1 || met->emitter < 0 || !(met->weight > 0)) return;
    path.light = met->emitter;
    path.leaves = imp__vertex_met(v);
    if (!eye_take(f, k + 2, (imp_v3){0}, &path)) return;
    if (v->d.scatterer != IMP_AT_SKY) path.node[0].far = false;
    const struct imp_emitter *e = f->w->tracer->scene->emitters[path.light];
    way_add(f, &path, 0, MET, met->weight / imp__emitter_timed(e, f->both->eye.time, 1));
}

/* The light sample of that vertex. */
static void sample_add(const struct found *f, int k)
{
    const struct imp_vertex *v = f->eye[k];
    const struct imp_scene *scene = f->w->tracer->scene;
    const struct imp_light *l = &v->d.light;
    struct path path = {.n = k + 3};
    struct imp_surface at = {.p = imp__decided_v3(l->p)};
    if (v->d.connection != IMP_CONNECTED || l->emitter < 0) return;
    const struct imp_emitter *e = scene->emitters[l->emitter];
    const bool far = e->ops->flags & (IMP_EMITTER_FAR | IMP_EMITTER_ENVIRONMENT);
    if (!e->ops->pdf_emission || (far && e->shape)) return;
    if (!far && e->shape &&
        !imp__decided_light(scene, f->w->tracer->sensor, &v->d, f->both->eye.time, &at))
        return;
    const struct imp_end end = {
        .p = far ? -imp__decided_v3(l->d) : at.p, .ng = at.ng, .far = far};
    path.light = l->emitter;
    path.leaves = imp__light_emission(l);
    if (!eye_take(f, k + 2, imp__decided_v3(l->wi), &path)) return;
    node_set(f->w, &end, NULL, (imp_v3){0}, (imp_v3){0}, &path.node[0]);
    const struct node *x = path.node;
    /* The record has the weight over the density per steradian at the vertex. */
    double pdf = sampled_pdf(scene, &path) * chance_of(scene, path.light);
    if (!far && !(e->ops->flags & IMP_EMITTER_DELTA)) pdf /= per_area(&x[1], &x[0], 1);
    if (e->ops->flags & IMP_EMITTER_DELTA) pdf = chance_of(scene, path.light);
    way_add(f, &path, 1, SAMPLED,
            l->weight * pdf / imp__emitter_timed(e, f->both->eye.time, 1));
}

static void joint_add(const struct found *f, const struct imp_joint *j)
{
    int y = 0, z = 0;
    while (y < f->n_eye && f->eye[y] != j->y) y++;
    while (z < f->n_lit && f->lit[z] != j->z) z++;
    if (y == f->n_eye || z == f->n_lit) return;
    struct path path = {.n = y + z + 4};
    const imp_v3 to_light = imp__decided_v3(j->wi), to_eye = imp__decided_v3(j->wo);
    if (!eye_take(f, y + 2, to_light, &path) || !light_take(f, z + 2, to_eye, &path))
        return;
    const struct node *at_z = &path.node[z + 1], *at_y = at_z + 1;
    const imp_v3 d = at_z->p - at_y->p;
    const struct imp_dirs dirs = {to_eye, at_z->to_light, IMP_SMOOTH, at_z->derivative};
    const imp_v3 before =
        path.node[z].far ? path.node[z].p : imp__normalize(path.node[z].p - at_z->p);
    const double c = j->z->shape
                         ? imp__bsdf_exchange(at_z->bsdf, at_z->in, &dirs,
                                              -imp__dot(imp__normalize(d), at_z->ng),
                                              imp__dot(before, at_z->ng))
                         : 1;
    way_add(f, &path, z + 2, JOINED, j->weight * imp__dot(d, d) / c);
}

/* A vertex of the walk from the light, connected to the sensor. */
static void reach_add(const struct found *f, int z)
{
    const struct imp_vertex *v = f->lit[z];
    const struct imp_light *l = &v->d.light;
    struct path path = {.n = z + 3};
    struct imp_sensor_sample to;
    if (v->d.connection != IMP_CONNECTED) return;
    const imp_v3 to_eye = imp__decided_v3(l->wi);
    if (!light_take(f, z + 2, to_eye, &path)) return;
    struct node *x = &path.node[z + 1];
    const struct imp_key key = f->walk->walk.key;
    double u[4];
    static const int use[4] = {IMP_DIM_LIGHT_U, IMP_DIM_LIGHT_V, IMP_DIM_LIGHT,
                               IMP_DIM_SPARE};
    for (int k = 0; k < 4; k++) u[k] = imp__u01(key, imp__dim(z + 1, use[k]));
    if (!imp__sensor_connect(f->w->tracer->sensor, &x->p, false, u, &to)) return;
    const struct imp_end end = {.p = to.p, .ng = to.ng};
    node_set(f->w, &end, NULL, (imp_v3){0}, (imp_v3){0}, &path.node[z + 2]);
    path.sensor = to;
    const struct imp_dirs dirs = {to_eye, x->to_light, IMP_SMOOTH, x->derivative};
    const imp_v3 before = x[-1].far ? x[-1].p : imp__normalize(x[-1].p - x->p);
    const double c =
        v->shape ? imp__bsdf_exchange(x->bsdf, x->in, &dirs, imp__dot(to.wo, x->ng),
                                      imp__dot(before, x->ng))
                 : 1;
    way_add(f, &path, z + 2, REACHED, l->weight / (to.weight * c));
}

static void pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct weights *w = payload;
    struct imp_tracer tracer = *w->tracer;
    struct imp_arena arena;
    struct imp_light_walk walk;
    tracer.seed = seed;
    imp__arena_init(&arena, w->ctx);
    imp__light_walk_trace(&tracer, &arena, i, &walk);
    struct found f = {.w = w, .both = walk.both, .walk = &walk, .pair = p};
    if (walk.both && !walk.walk.dropped) {
        f.n_eye = scatterers(walk.both->eye.first, f.eye);
        f.n_lit = scatterers(walk.walk.first, f.lit);
        for (int k = 0; k < f.n_eye; k++) {
            met_add(&f, k);
            sample_add(&f, k);
        }
        for (int k = 0; k < f.n_lit; k++) reach_add(&f, k);
        for (const struct imp_joint *j = walk.both->joints; j; j = j->next)
            joint_add(&f, j);
    }
    imp__arena_free(&arena);
}

enum imp_status imp__check_weights(struct imp__draw_list *l,
                                   const struct imp__places *places)
{
    const struct imp_tracer *own = &l->check->tracer;
    const struct imp_scene *scene = own->scene;
    (void)places;
    if (!own->integrator->both || own->sensor->shape || !own->sensor->ops->connect)
        return IMP_OK;
    for (int k = 0; k < scene->n_bsdfs; k++)
        if (scene->bsdfs[k]->shaped) return IMP_OK;
    struct weights *w = imp__arena_array(&l->arena, 1, sizeof *w);
    struct imp_tracer *tracer = imp__arena_array(&l->arena, 1, sizeof *tracer);
    if (!w || !tracer)
        return imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check");
    *tracer = *own;
    tracer->value_only = false;
    tracer->collisions_fixed = true;
    *w = (struct weights){l->check->ctx, tracer};
    return imp__draw_add(l, &(struct imp__draw_row){.method = "weights",
                                                    .name = "bidirectional",
                                                    .pair = pair,
                                                    .payload = w,
                                                    .slack = 1e-3});
}
