/* SPDX-License-Identifier: Apache-2.0
 *
 * What a walk records, vertex by vertex, against the rules it is made by: weights of the
 * power heuristic from densities worked out here, survival from the throughput and the
 * indices passed, factors that are zero, the depth at which walks end. Wrong weights that
 * still add up to 1, or roulette that is merely unwise, leave every picture right. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/core/walk.h"
#include <math.h>

static imp_context *ctx;

#define SENSOR                                                                           \
    "<sensor type='perspective'><transform name='to_world'><lookat origin='0,0,4' "      \
    "target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' " \
    "value='8'/><integer name='height' value='8'/><rfilter type='box'/></film></sensor>"

struct traced {
    imp_scene *scene;
    uint8_t *chosen;
    struct imp_active active;
    struct imp_tracer tracer;
    struct imp_arena arena;
};

static void begin(struct traced *t, const char *integrator, const char *rest)
{
    char xml[4096];
    snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s" SENSOR "%s</scene>", integrator,
             rest);
    *t = (struct traced){.scene = test_scene_text(ctx, xml, IMP_RGB)};
    t->chosen = calloc(t->scene->n_params + 1, 1);
    for (size_t k = 0; k < t->scene->n_params; k++)
        t->chosen[k] = (t->scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(ctx, imp__active_create(t->scene, t->chosen, &t->active));
    t->tracer = (struct imp_tracer){.scene = t->scene,
                                    .integrator = imp__walk_integrator(t->scene),
                                    .sensor = t->scene->sensors[0],
                                    .active = &t->active,
                                    .seed = 3};
    imp__arena_init(&t->arena, ctx);
}
static void end(struct traced *t)
{
    imp__arena_free(&t->arena);
    imp__active_destroy(ctx, &t->active);
    free(t->chosen);
    imp_scene_destroy(t->scene);
}

/* Decisions are stored as floats: each is off by half a unit of 2^-24, and some are
 * compared with products of a few others. */
#define STORED 0x1p-24
static double relative(double a, double b) { return fabs(a - b) / fabs(b); }

/* ---- Weights of the power heuristic -------------------------------------------- */

/* Chance of a light times density of its points per steradian: two rectangles, one with
 * three times the other's sampling_weight. */
static double light_density(const struct traced *t, int emitter, double r, double cosine)
{
    const double area = t->scene->emitters[emitter]->shape->area;
    return (emitter == 0 ? 0.25 : 0.75) * r * r / (area * fabs(cosine));
}

#define LAMP(x, size, weight)                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale value='" size "'/>"       \
    "<rotate x='1' angle='180'/><translate x='" x "' z='1.5'/></transform>"              \
    "<emitter type='area'><float name='sampling_weight' value='" weight "'/></emitter>"  \
    "</shape>"

static void weights(void)
{
    struct traced t;
    double met = 0, sampled = 0, first = 0;
    int n_met = 0, n_sampled = 0;
    begin(&t, "<integrator type='path'/>",
          "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"
          "</transform><bsdf type='diffuse'/></shape>" LAMP("-1", "0.7", "1")
              LAMP("1", "0.4", "3"));
    for (int i = 0; i < 6000; i++) {
        struct imp_walk w;
        const struct imp_arena_mark mark = imp__arena_mark(&t.arena);
        imp__walk_trace(&t.tracer, &t.arena, i % 8, i / 8 % 8, i, &w);
        for (const struct imp_vertex *v = w.first; v; v = v->next) {
            if (v->d.met.emitter >= 0 && !v->prev)
                first = fmax(first, fabs(v->d.met.weight - 1));
            if (v->d.met.emitter >= 0 && v->prev && v->d.met.cos_light > 0) {
                const imp_v3 way =
                    imp__decided_v3(v->d.p) - imp__decided_v3(v->prev->d.p);
                const double r = imp__length(way), b = v->prev->d.wi[2] / IMP_PI;
                const double e = light_density(&t, v->d.met.emitter, r, way[2] / r);
                met = fmax(met, relative(v->d.met.weight, b * b / (b * b + e * e)));
                n_met++;
            }
            if (v->d.connection == IMP_CONNECTED) {
                const double b = v->d.light.wi[2] / IMP_PI;
                const double e = light_density(&t, v->d.light.emitter, v->d.light.dist,
                                               v->d.light.cos_light);
                sampled = fmax(sampled, relative(v->d.light.weight, e / (b * b + e * e)));
                n_sampled++;
            }
        }
        imp__arena_rewind(&t.arena, mark);
    }
    tap_ok(first == 0, "light that the camera sees counts fully");
    tap_ok(n_met > 300 && met < 10 * STORED,
           "light met by chance: w = b^2/(b^2 + e^2) # %.1e, %d", met, n_met);
    tap_ok(n_sampled > 3000 && sampled < 10 * STORED,
           "light samples: w/e = e/(b^2 + e^2) # %.1e, %d", sampled, n_sampled);
    end(&t);
}

/* ---- Roulette ------------------------------------------------------------------ */

static double largest(imp_spec s) { return fmax(s[0], fmax(s[1], s[2])); }

/* n_wi/n_wo of a step; glass is the only thing that lets light through here. */
static double index_ratio(const struct imp_vertex *v)
{
    if (!(v->bsdf->flags & IMP_BSDF_TRANSMIT) || v->d.wi[2] * v->d.wo[2] > 0) return 1;
    return v->d.wo[2] > 0 ? 1.5 : 1 / 1.5;
}

static void roulette(void)
{
    struct traced t;
    double worst = 0;
    int n = 0, early = 0, inside = 0, capped = 0;
    begin(
        &t, "<integrator type='path'><integer name='rr_depth' value='2'/></integrator>",
        "<shape type='sphere'><bsdf type='dielectric'><float name='int_ior' value='1.5'/>"
        "<float name='ext_ior' value='1'/><rgb name='specular_reflectance' "
        "value='.9,.8,.7'/></bsdf></shape>"
        "<shape type='sphere'><float name='radius' value='6'/><boolean "
        "name='flip_normals' value='true'/><bsdf type='diffuse'><rgb name='reflectance' "
        "value='.5,.7,.97'/></bsdf></shape><emitter type='constant'/>");
    for (int i = 0; i < 3000; i++) {
        struct imp_walk w;
        const struct imp_arena_mark mark = imp__arena_mark(&t.arena);
        imp__walk_trace(&t.tracer, &t.arena, i % 8, i / 8 % 8, i, &w);
        imp_spec beta = imp__spec(1);
        double eta = 1;
        int depth = 0;
        for (const struct imp_vertex *v = w.first; v && v->d.goes_on;
             v = v->next, depth++) {
            eta *= index_ratio(v);
            const double q = fmin(largest(beta * v->w * v->d.survive) * eta * eta, 0.95);
            if (depth + 1 < 2) early += v->d.survive != 1;
            else worst = fmax(worst, relative(v->d.survive, q));
            n += depth + 1 >= 2;
            inside += depth + 1 >= 2 && eta != 1;
            capped += depth + 1 >= 2 && q == 0.95;
            beta *= v->w;
        }
        imp__arena_rewind(&t.arena, mark);
    }
    tap_ok(early == 0, "no roulette before rr_depth");
    tap_ok(n > 3000 && inside > 300 && capped > 300 && worst < 4 * STORED,
           "survival is max(beta) eta^2, at most 0.95 # %.1e, %d, inside glass %d, "
           "capped %d",
           worst, n, inside, capped);
    end(&t);
}

/* ---- Factors that are zero ----------------------------------------------------- */

/* A channel whose reflectance is 0 goes on once, for its derivative, and ends at the
 * second: of a white room with black green, walks of many vertices have gradients of
 * green where one factor is zero, and none where two are. */
static void zeros(void)
{
    struct traced t;
    double first = 0, second = 0;
    begin(&t,
          "<integrator type='path'><integer name='max_depth' value='4'/></integrator>",
          "<shape type='sphere'><float name='radius' value='6'/><boolean "
          "name='flip_normals' value='true'/><bsdf type='diffuse' id='wall'><rgb "
          "name='reflectance' value='0,0,0'/></bsdf></shape>"
          "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='180'/>"
          "<translate z='5'/></transform><emitter type='area'/></shape>");
    int longest = 0;
    for (int i = 0; i < 500; i++) {
        struct imp_walk w;
        const struct imp_arena_mark mark = imp__arena_mark(&t.arena);
        imp__walk_trace(&t.tracer, &t.arena, i % 8, i / 8 % 8, i, &w);
        int k = 0;
        for (const struct imp_vertex *v = w.first; v; v = v->next, k++) {
            if (k == 0) first += largest(v->beyond);
            if (k == 1) second += largest(v->beyond);
        }
        if (w.n > longest) longest = w.n;
        imp__arena_rewind(&t.arena, mark);
    }
    tap_ok(first > 0, "a black wall hears what arrives # %g", first);
    tap_ok(second == 0 && longest == 2, "beyond a second black wall nobody asks # %g, %d",
           second, longest);
    end(&t);
}

/* A lamp of radiance 0 has the derivative of a bright one: light samples are not skipped
 * because nothing comes from it yet. */
static void dark_lamp(void)
{
    double g[2][3] = {{0}};
    for (int k = 0; k < 2; k++) {
        struct traced t;
        char rest[1024];
        snprintf(rest, sizeof rest,
                 "<shape type='rectangle'><bsdf type='diffuse'/></shape>"
                 "<emitter type='point' id='lamp'><point name='position' x='0' y='0' "
                 "z='2'/><rgb name='intensity' value='%d'/></emitter>",
                 k);
        begin(&t, "<integrator type='path'/>", rest);
        imp_problem *p = test_problem(ctx, t.scene, "lamp.*");
        struct imp_run run = IMP_RUN_INIT;
        static float seed[8 * 8 * 3];
        for (int i = 0; i < 8 * 8 * 3; i++) seed[i] = 1;
        run.spp = 16;
        test_must(ctx, imp_problem_reverse(p, seed, &run, g[k], NULL));
        imp_problem_destroy(p);
        end(&t);
    }
    tap_ok(g[0][0] > 0 && g[0][0] == g[1][0] && g[0][2] == g[1][2],
           "a dark lamp's derivative # %g %g", g[0][0], g[1][0]);
}

/* ---- Where walks end, and where they are counted from --------------------------- */

static void depths(void)
{
    for (int depth = 0; depth < 5; depth++) {
        struct traced t;
        char integrator[128];
        int longest = 0, lights = 0;
        snprintf(integrator, sizeof integrator,
                 "<integrator type='path'><integer name='max_depth' value='%d'/>"
                 "<integer name='rr_depth' value='100'/></integrator>",
                 depth);
        begin(&t, integrator,
              "<shape type='sphere'><float name='radius' value='6'/><boolean "
              "name='flip_normals' value='true'/><bsdf type='diffuse'/></shape>"
              "<emitter type='point'/>");
        for (int i = 0; i < 64; i++) {
            struct imp_walk w;
            int k = 0;
            imp__walk_trace(&t.tracer, &t.arena, i % 8, i / 8, i, &w);
            if (w.n > longest) longest = w.n;
            for (const struct imp_vertex *v = w.first; v; v = v->next, k++)
                if (v->d.connection == IMP_CONNECTED && k > lights) lights = k;
        }
        /* k bounces end at vertex k + 1; a light sample is a bounce too. */
        tap_ok(longest == (depth > 1 ? depth : 1) &&
                   lights == (depth > 2 ? depth - 2 : 0),
               "max_depth %d # %d vertices, light sampled at vertex %d", depth, longest,
               lights);
        end(&t);
    }
}

/* Depth 0 sees nothing, depth 1 what glows (docs/scene-format.md 11). */
static void seen_directly(void)
{
    for (int depth = 0; depth < 2; depth++) {
        struct traced t;
        struct imp_walk ball, sky;
        char integrator[128];
        snprintf(integrator, sizeof integrator,
                 "<integrator type='path'><integer name='max_depth' value='%d'/>"
                 "</integrator>",
                 depth);
        begin(&t, integrator,
              "<shape type='sphere'><emitter type='area'/></shape>"
              "<emitter type='constant'/>");
        imp__walk_trace(&t.tracer, &t.arena, 4, 4, 0, &ball);
        imp__walk_trace(&t.tracer, &t.arena, 0, 0, 0, &sky);
        tap_ok(ball.L[1] == depth && sky.L[1] == depth,
               "max_depth %d: light in sight # %g", depth, ball.L[1]);
        end(&t);
    }
}

/* ---- Pictures ------------------------------------------------------------------ */

/* A pixel's mean and standard error, from its walks one by one: sum w v / sum w, and with
 * e = w (v - mean), over the pixels that send m samples each (a stratum), the sum of
 * m/(m - 1) [sum e^2 - (sum e)^2/m] / (sum w)^2. A box of one pixel is w = 1 for its own
 * samples: the usual error of a mean. */
static void pixels(const char *filter, double radius)
{
    enum { SPP = 3, SIDE = 8 };
    struct traced t;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    char xml[4096];
    double mean_off = 0, se_off = 0;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/>"
             "<sensor type='perspective'><transform name='to_world'><lookat "
             "origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
             "<integer name='width' value='8'/><integer name='height' value='8'/>"
             "<rfilter type='%s'/></film></sensor><shape type='sphere'/>"
             "<emitter type='constant'/><emitter type='point'><point name='position' "
             "x='0' y='2' z='3'/></emitter></scene>",
             filter);
    t = (struct traced){.scene = test_scene_text(ctx, xml, IMP_RGB)};
    t.tracer = (struct imp_tracer){.scene = t.scene,
                                   .integrator = imp__walk_integrator(t.scene),
                                   .sensor = t.scene->sensors[0]};
    imp__arena_init(&t.arena, ctx);
    run.spp = SPP;
    run.points = IMP_POINTS_INDEPENDENT;
    t.tracer.seed = run.seed;
    test_must(ctx, imp_render(t.scene, &run, &film));

    static double v[SIDE * SIDE * SPP], at[SIDE * SIDE * SPP][2];
    for (int i = 0; i < SIDE * SIDE * SPP; i++) {
        struct imp_walk w;
        const struct imp_arena_mark mark = imp__arena_mark(&t.arena);
        imp__walk_trace(&t.tracer, &t.arena, i / SPP % SIDE, i / SPP / SIDE, i % SPP, &w);
        v[i] = w.L[1];
        at[i][0] = w.px, at[i][1] = w.py;
        imp__arena_rewind(&t.arena, mark);
    }
    for (int p = 0; p < SIDE * SIDE; p++) {
        double W = 0, sum = 0, variance = 0, w[SIDE * SIDE * SPP];
        for (int i = 0; i < SIDE * SIDE * SPP; i++) {
            const double x = at[i][0] - (p % SIDE + 0.5), y = at[i][1] - (p / SIDE + 0.5);
            w[i] = radius == 0.5
                       ? i / SPP == p
                       : fmax(0, 1 - fabs(x) / radius) * fmax(0, 1 - fabs(y) / radius);
            W += w[i];
            sum += w[i] * v[i];
        }
        for (int q = 0; q < SIDE * SIDE; q++) {
            double e = 0, e2 = 0;
            for (int i = q * SPP; i < (q + 1) * SPP; i++) {
                const double one = w[i] * (v[i] - sum / W);
                e += one;
                e2 += one * one;
            }
            variance += (e2 - e * e / SPP) * SPP / (SPP - 1);
        }
        const double se = sqrt(variance) / W;
        mean_off = fmax(mean_off, relative(imp_film_mean(film)[3 * p + 1], sum / W));
        if (se > 1e-3) se_off = fmax(se_off, relative(imp_film_se(film)[3 * p + 1], se));
    }
    tap_ok(mean_off < 1e-6 && se_off < 1e-6, "%s: means %.1e and errors %.1e of pixels",
           filter, mean_off, se_off);
    imp_film_destroy(film);
    imp__arena_free(&t.arena);
    imp_scene_destroy(t.scene);
}

int main(void)
{
    ctx = test_context(1);
    weights();
    roulette();
    zeros();
    dark_lamp();
    depths();
    seen_directly();
    pixels("box", 0.5);
    pixels("tent", 1);
    imp_context_destroy(ctx);
    return tap_done();
}
