/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of light walks, and of samples from both ends, walk by walk, with
 * another adjoint wherever they reach the sensor: reverse against forward mode, and both
 * against central differences of frozen walks, which are linear in lamps and smooth in all
 * else. */
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include "walk/lights/light_walk.h"
#include "walk/rules/features.h"
#include <importon/elements.h>

#define WALKS 4000
#define MANY  64

static imp_context *ctx;

struct sum {
    struct imp_sink sink; /* first: the sweep gets a pointer to it */
    const struct imp_active *active;
    double g[MANY];
};
static void sum_add(struct imp_sink *sink, int param, size_t element, int channels,
                    const imp_spec *bar)
{
    struct sum *s = (struct sum *)sink;
    const int64_t base = s->active->base[param];
    if (base < 0) return;
    double *g = s->g + base + element;
    if (channels == 1) *g += ((*bar)[0] + (*bar)[1]) + (*bar)[2];
    else
        for (int c = 0; c < channels; c++) g[c] += (*bar)[c];
}

/* Of number k in x's order. */
static struct imp_param *param_at(const struct imp_scene *scene,
                                  const struct imp_active *active, size_t k, size_t *e)
{
    for (size_t i = 0; i < scene->n_params; i++) {
        const int64_t base = active->base[i];
        if (base < 0 || k < (size_t)base ||
            k >= (size_t)base + scene->params[i].info.count)
            continue;
        *e = k - (size_t)base;
        return &scene->params[i];
    }
    return NULL;
}

static void set(struct imp_scene *scene, struct imp_param *p, size_t e, double value)
{
    imp__param_set(p, e, value);
    imp__theta_announce(scene);
}

#define HEAD                                                                             \
    "<scene version='3.0.0'><integrator type='%s'><integer name='max_depth' "            \
    "value='6'/></integrator>"
#define ROOM                                                                             \
    "<shape type='cube'>" AT(                                                            \
        "<scale value='2'/>") "<boolean name='flip_normals' value='true'/><bsdf "        \
                              "type='diffuse'><rgb "                                     \
                              "name='reflectance' "                                      \
                              "value='.6,.5,.4'/></bsdf></shape><shape "                 \
                              "type='rectangle'>" AT("<scale x='.6' y='.6'/><rotate "    \
                                                     "x='1' angle='90'/><translate "     \
                                                     "y='1.95'/>") "<emitter "           \
                                                                   "type='beam'><rgb "   \
                                                                   "name='radiance' "    \
                                                                   "value='5,4,3'/"      \
                                                                   "><float "            \
                                                                   "name='exponent' "    \
                                                                   "value='2'/></"       \
                                                                   "emitter></shape>"
#define CAMERA                                                                           \
    "<sensor type='perspective'><float name='fov' value='80'/>" AT(                      \
        "<lookat origin='0,0,1.9' target='0,0,0' up='0,1,0'/>") "<film "                 \
                                                                "type='hdrfilm'><"       \
                                                                "integer name='width' "  \
                                                                "value='6'/><integer "   \
                                                                "name='height' "         \
                                                                "value='4'/><rfilter "   \
                                                                "type='box'/></film></"  \
                                                                "sensor></scene>"

/* The sum of adjoint times what reaches the film. */
static double brings(const struct imp_light_walk *w, const imp_spec *P)
{
    double sum = 0;
    for (const struct imp_reach *r = w->reach; r; r = r->next, P++)
        for (int c = 0; c < 3; c++) sum += (*P)[c] * r->values[c];
    return sum;
}

/* guided: by importance that finite elements have solved. */
static void check(const char *integrator_name, const char *what, const char *body,
                  bool guided)
{
    char xml[8192];
    snprintf(xml, sizeof xml, body, integrator_name);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    uint8_t chosen[MANY] = {0};
    struct imp_active active;
    struct imp_arena arena;
    double exact = 0, frozen = 0;
    int reached = 0, compared = 0, same = 0;
    for (size_t i = 0; i < scene->n_params && i < MANY; i++)
        chosen[i] = scene->params[i].info.flags & IMP_PARAM_DIFFERENTIABLE;
    test_must(ctx, imp__active_create(scene, chosen, &active));
    const struct imp_walk_integrator *integrator = imp__walk_integrator(scene);
    const struct imp_job job = imp__job(scene, scene->sensors[0], NULL, &active);
    test_must(ctx, imp__job_allowed(&job));
    imp_elements *elements = NULL;
    imp_guide *guide = NULL;
    if (guided) {
        struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
        o.share = 0.4;
        test_must(ctx, imp_elements_create(scene, NULL, &elements));
        test_must(ctx, imp_elements_solve(elements));
        test_must(ctx, imp_elements_guide(elements, &o, &guide));
    }
    const struct imp_tracer tracer = {.scene = scene,
                                      .integrator = integrator,
                                      .sensor = scene->sensors[0],
                                      .active = &active,
                                      .seed = 5,
                                      .guide = guide,
                                      .collisions_fixed = true};
    imp__arena_init(&arena, ctx);
    for (int i = 0; i < WALKS; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&arena);
        struct imp_light_walk w;
        imp_spec P[256];
        int n = 0;
        imp__light_walk_trace(&tracer, &arena, i, &w);
        for (const struct imp_reach *r = w.reach; r && n < 256; r = r->next)
            P[n++] = (imp_spec){1 + r->px / 7, 2 - r->py / 9, 0.5 + r->number, 0};
        const double value = brings(&w, P);
        if (value == 0) {
            imp__arena_rewind(&arena, mark);
            continue;
        }
        reached++;
        struct sum s = {.sink = {.add = sum_add}, .active = &active};
        if (!imp__light_walk_sweep(&tracer, &arena, &w, P, 1, &s.sink)) break;
        double x_dot[MANY] = {0}, dot = 0, size = 0;
        for (size_t k = 0; k < active.n; k++) {
            x_dot[k] = sin((double)(k + 1) * (i % 97 + 1));
            dot += x_dot[k] * s.g[k];
            size += fabs(x_dot[k] * s.g[k]);
        }
        imp_spec t;
        if (!imp__light_walk_tangent(&tracer, &arena, &w, P, x_dot, &t)) break;
        if (size > 0) exact = fmax(exact, fabs((t[0] + t[1]) + t[2] - dot) / size);
        const size_t k = (size_t)i % active.n;
        size_t e = 0;
        struct imp_param *p = param_at(scene, &active, k, &e);
        const double x = imp__param_get(p, e), h = 1e-5 * fmax(fabs(x), 0.1);
        double at[3];
        for (int j = 0; j < 3; j++) {
            set(scene, p, e, x + (j == 2 ? 0 : j ? -h : h));
            if (!imp__light_walk_evaluate(&tracer, &arena, &w)) break;
            at[j] = brings(&w, P);
        }
        const double d = (at[0] - at[1]) / (2 * h);
        same += at[2] == value;
        frozen = fmax(frozen, fabs(d - s.g[k]) /
                                  (fabs(s.g[k]) + fabs(value) / fmax(fabs(x), 0.1)));
        compared += s.g[k] != 0;
        imp__arena_rewind(&arena, mark);
    }
    tap_ok(exact < 1e-12 && reached > WALKS / 16,
           "%s, %s: forward and reverse, %zu numbers, %d walks # %.1e", integrator_name,
           what, active.n, reached, exact);
    tap_ok(frozen < 1e-6 && compared > WALKS / 64,
           "%s, %s: frozen differences of %d walks # %.1e", integrator_name, what,
           compared, frozen);
    tap_ok(same == reached, "%s, %s: evaluated again to the bit # %d of %d",
           integrator_name, what, same, reached);
    imp_guide_destroy(guide);
    imp_elements_destroy(elements);
    imp__arena_free(&arena);
    imp__active_destroy(ctx, &active);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    static const char *const ends[] = {"ptracer", "bdpt"};
    for (int k = 0; k < 2; k++) {
        check(ends[k], "a room", HEAD ROOM CAMERA, false);
        check(ends[k], "rough metal and plastic",
              HEAD ROOM BALL("-.8,-.9,-.5", "<bsdf type='roughconductor'><float "
                                            "name='alpha' value='.3'/></bsdf>")
                  BALL("1,-1,.3", "<bsdf type='phong'/>") CAMERA,
              false);
        check(ends[k], "fog, with its density", HEAD ROOM FOG CAMERA, false);
        check(ends[k], "point light and sky",
              HEAD
              "<emitter type='point'><point name='position' value='.3,1,1'/></emitter>"
              "<emitter type='constant'/>" BALL("0,0,0", "<bsdf type='diffuse'/>") CAMERA,
              false);
    }
    check("ptracer", "a room, guided", HEAD ROOM CAMERA, true);
    imp_context_destroy(ctx);
    return tap_done();
}
