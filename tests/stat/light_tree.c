/* SPDX-License-Identifier: Apache-2.0
 *
 * The tree of lights: probabilities that add up, picks against them, no light without a
 * probability where it counts, and what it is worth. */
#include "scene/light_tree.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "lamps.h"
#include "math/warp.h"

static imp_context *ctx;

static imp_scene *lamps_scene(const struct lamps *l)
{
    char *text = lamps_text(l);
    imp_scene *s = test_scene_text(ctx, text, IMP_RGB);
    free(text);
    return s;
}

/* Irradiance that a point of a light brings to a place, luminance, nothing in between. */
static double brings(const struct imp_scene *s, int light,
                     const struct imp_light_place *q, const double u[2])
{
    const struct imp_emitter *e = s->emitters[light];
    struct imp_light_sample ls;
    if (!e->ops->sample(e, &q->p, u, &ls) || !(ls.pdf > 0)) return 0;
    if ((e->ops->flags & IMP_EMITTER_AREA) && !(ls.cos_light > 0)) return 0;
    const struct imp_emission x = {{ls.uv[0], ls.uv[1]}, ls.dist, ls.cos_light, -ls.wi};
    const struct imp_texcoord at = {
        .uv = {ls.uv[0], ls.uv[1]}, .p = ls.p, .shape = e->shape};
    imp_spec in[IMP_INPUTS_MAX], le;
    imp__inputs_eval(e->input, e->n_in, &at, in);
    e->ops->eval(e, in, &x, &le);
    const double cosine = q->faces ? fmax(0, imp__dot(ls.wi, q->n)) : 1;
    return (le[0] + le[1] + le[2]) / 3 * cosine / ls.pdf;
}

/* ---- Lights of every kind -------------------------------------------------------- */

/* A room with them all: flat, round and meshed surfaces, points, cones, measured ones, a sky,
 * parallel light; ground, glass and fog to stand on. `far`: with the lights without end. */
static char *mixed_text(const char *choice, int far, int res, int depth)
{
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (!f) abort();
    fprintf(
        f,
        "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
        "value='%d'/><string name='light_choice' value='%s'/></integrator>"
        "<sensor type='perspective' id='eye'><float name='fov' value='70'/><transform "
        "name='to_world'><lookat origin='0,3,-7' target='0,.8,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='%d'/><integer name='height' "
        "value='%d'/><rfilter type='box'/></film></sensor>"
        "<bsdf type='twosided' id='ground'><bsdf type='diffuse' id='grey'><rgb "
        "name='reflectance' value='.5,.4,.3'/></bsdf></bsdf>"
        "<shape type='rectangle'><transform name='to_world'><scale value='6'/><rotate "
        "x='1' angle='-90'/></transform><ref id='ground'/></shape>"
        "<shape type='sphere'><point name='center' x='-1.2' y='.6' z='.4'/><float "
        "name='radius' value='.6'/><bsdf type='roughdielectric'><float name='alpha' "
        "value='.4'/></bsdf></shape>"
        "<shape type='sphere'><point name='center' x='1.4' y='.7' z='.2'/><float "
        "name='radius' value='.7'/><bsdf type='null'/><medium name='interior' "
        "type='homogeneous'><float name='sigma_t' value='1.5'/><rgb name='albedo' "
        "value='.8,.6,.4'/></medium></shape>"
        "<shape type='obj'><string name='filename' value='%s/cornell/short_block.obj'/>"
        "<transform name='to_world'><scale value='.004'/><translate x='-3' y='.5' "
        "z='.5'/></transform><emitter type='area' id='block'><rgb name='radiance' "
        "value='2,1,.5'/></emitter></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='.3'/><rotate "
        "x='1' angle='60'/><translate x='.3' y='2' z='1.5'/></transform><emitter "
        "type='area' "
        "id='flat'><texture type='checkerboard' name='radiance'><rgb name='color0' "
        "value='0,.1,.2'/><rgb name='color1' "
        "value='1,.7,.4'/></texture></emitter></shape>"
        "<shape type='disk'><transform name='to_world'><scale value='.2'/><rotate x='1' "
        "angle='90'/><translate x='2' y='2' z='-1'/></transform><emitter type='beam' "
        "id='beam'><rgb name='radiance' value='20,20,20'/><float name='exponent' "
        "value='6'/></emitter></shape>"
        "<shape type='sphere'><point name='center' x='-1' y='2' z='-1'/><float "
        "name='radius' value='.15'/><emitter type='area' id='ball'><rgb name='radiance' "
        "value='4,6,9'/></emitter></shape>"
        "<shape type='cylinder'><point name='p0' x='0' y='1.4' z='-1'/><point name='p1' "
        "x='.8' y='1.4' z='-1.2'/><float name='radius' value='.05'/><emitter type='area' "
        "id='tube'><rgb name='radiance' value='6,2,6'/></emitter></shape>"
        "<shape type='cube'><transform name='to_world'><scale value='.1'/><translate "
        "x='2.5' y='.5' z='1.5'/></transform><emitter type='area' id='box'><rgb "
        "name='radiance' value='0,0,0'/></emitter></shape>"
        "<emitter type='point' id='point'><point name='position' x='-2' y='1.5' "
        "z='1'/><rgb name='intensity' value='1,2,1'/></emitter>"
        "<emitter type='spot' id='spot'><transform name='to_world'><lookat "
        "origin='1,3,-2' target='.4,0,.4' up='0,0,1'/></transform><float "
        "name='cutoff_angle' value='18'/><rgb name='intensity' "
        "value='20,10,10'/></emitter>"
        "<emitter type='ies' id='ies'><string name='filename' "
        "value='%s/lamps/downlight.ies'/><transform name='to_world'><rotate x='1' "
        "angle='90'/><translate x='-2' y='2.5' z='-2'/></transform><float "
        "name='scale' value='.002'/></emitter>",
        depth, choice, res, res, IMP_SCENES, IMP_SCENES);
    if (far)
        fprintf(
            f,
            "<emitter type='constant' id='sky'><rgb name='radiance' "
            "value='.1,.15,.2'/></emitter><emitter type='directional' id='sun'><vector "
            "name='direction' x='.5' y='-1' z='.4'/><rgb name='irradiance' "
            "value='.6,.5,.4'/></emitter>");
    fprintf(f, "</scene>");
    fclose(f);
    return text;
}

static imp_scene *mixed_scene(const char *choice, int far, int res, int depth)
{
    char *text = mixed_text(choice, far, res, depth);
    imp_scene *s = test_scene_text(ctx, text, IMP_RGB);
    free(text);
    return s;
}

/* The k-th of many places: on the ground, on a wall, in the air, in a corner. */
static struct imp_light_place place_at(uint32_t k)
{
    const struct imp_key key = imp__key(5, 0, k);
    double u[5];
    for (uint32_t j = 0; j < 5; j++) u[j] = imp__u01(key, j);
    struct imp_light_place q = {imp__v3(8 * u[0] - 4, 3 * u[1], 8 * u[2] - 4),
                                imp__v3(0, 1, 0), true};
    if (k % 4 == 0) q.p[1] = 0;
    if (k % 4 == 1) q.faces = false;
    if (k % 4 == 2) q.n = imp__uniform_sphere(&u[3]);
    if (k % 4 == 3) q.n = imp__v3(0, -1, 0);
    return q;
}

/* Probabilities of all lights and triangles, what is never chosen, and picks against them;
 * a light that brings something has a probability. */
static void picks(const imp_scene *s, const char *what, uint32_t places)
{
    enum { DRAWS = 4000 };
    const struct imp_light_tree *t = s->light_tree;
    const int n = t->n_items + t->n_far;
    double *p = calloc((size_t)n, sizeof *p), *count = calloc((size_t)n, sizeof *count);
    double worst = 0, chi2 = 0, dof = 0, reached = 0;
    int unseen = 0, wrong = 0;
    if (!p || !count) abort();
    for (uint32_t k = 0; k < places; k++) {
        const struct imp_light_place q = place_at(k);
        double sum = 0, none = 0;
        for (int i = 0; i < n; i++) {
            const bool far = i >= t->n_items;
            const int e = far ? t->far_light[i - t->n_items] : t->item[i].emitter;
            const int prim = far ? -1 : t->item[i].prim;
            sum += p[i] = imp__light_tree_chance(t, &q, e, prim);
            count[i] = 0;
            for (uint32_t j = 0; j < 8; j++) { /* points all over it */
                const struct imp_key key = imp__key(6, (uint64_t)i, j);
                const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
                struct imp_light_sample ls;
                if (prim >= 0) {
                    const struct imp_shape *shape = s->emitters[e]->shape;
                    if (!shape->ops->sample_triangle(shape, prim, &q.p, u, &ls)) continue;
                    /* The density of the triangle, by way of the whole light's. */
                    const double whole = imp__light_tree_factor(t, &q, e, prim);
                    const struct imp_hit hit = {.prim = prim};
                    const struct imp_surface at = {.p = ls.p, .ng = ls.ng, .n = ls.ng};
                    const double pe = shape->ops->pdf_toward(shape, &q.p, &hit, &at);
                    wrong += !(fabs(whole * pe - p[i] * ls.pdf) <= 1e-9 * p[i] * ls.pdf);
                    if (!(ls.cos_light > 0) ||
                        (q.faces && !(imp__dot(ls.wi, q.n) > 1e-9)))
                        continue;
                    unseen += !(p[i] > 0);
                } else if (s->emitters[e]->weight > 0 && brings(s, e, &q, u) > 1e-12) {
                    unseen += !(p[i] > 0);
                    reached++;
                }
            }
        }
        for (uint32_t d = 0; d < DRAWS; d++) {
            double u = imp__u01(imp__key(7, k, d), 0), chance = 0;
            int prim;
            const int e = imp__light_tree_choose(t, &q, NULL, &u, &prim, &chance);
            wrong += !(u >= 0 && u < 1);
            if (e < 0) {
                none++;
                continue;
            }
            int i = t->first[e] < 0 ? -1 : t->first[e] + (prim > 0 ? prim : 0);
            for (int f = 0; i < 0; f++)
                if (t->far_light[f] == e) i = t->n_items + f;
            wrong += !(fabs(chance - p[i]) <= 1e-12 * p[i]);
            count[i]++;
        }
        worst = fmax(worst, sum - 1);
        double rest = 1 - sum, rest_count = none;
        for (int i = 0; i < n; i++) {
            if (p[i] * DRAWS < 5) {
                rest += p[i];
                rest_count += count[i];
                continue;
            }
            chi2 += imp__sqr(count[i] - p[i] * DRAWS) / (p[i] * DRAWS);
            dof++;
        }
        if (rest * DRAWS >= 5)
            chi2 += imp__sqr(rest_count - rest * DRAWS) / (rest * DRAWS);
        else dof--;
    }
    const double z = (chi2 - dof) / sqrt(2 * dof);
    tap_ok(worst < 1e-9, "%s: probabilities add up to no more than 1 # %.2g", what,
           worst);
    tap_ok(fabs(z) < 4.5 && wrong == 0,
           "%s: picks have their probabilities # z %.2f of %g, %d wrong", what, z, dof,
           wrong);
    tap_ok(unseen == 0 && reached > 100, "%s: what counts can be chosen # %d of %g not",
           what, unseen, reached);
    free(p);
    free(count);
}

/* ---- What it is worth ------------------------------------------------------------ */

/* Sampling one of n lights where f is what each brings has the second moment sum f^2/p. */
static void worth(int points)
{
    enum { N = 10000, PLACES = 40 };
    const struct lamps l = {N, "tree", points, 16, 2, ""};
    imp_scene *s = lamps_scene(&l);
    const struct imp_light_tree *t = s->light_tree;
    double even = 0, tree = 0;
    for (uint32_t k = 0; k < PLACES; k++) {
        const struct imp_key key = imp__key(5, 0, k);
        const struct imp_light_place q = {
            imp__v3(100 * imp__u01(key, 0) - 50, 0, 100 * imp__u01(key, 1) - 50),
            imp__v3(0, 1, 0), true};
        double second = 0, f1 = 0, f2 = 0;
        for (int i = 0; i < N; i++) {
            const double p = imp__light_tree_chance(t, &q, i, -1);
            const double f = brings(s, i, &q, (double[]){.5, .5});
            f1 += f;
            f2 += f * f;
            second += p > 0 ? f * f / p : f > 0 ? INFINITY : 0;
        }
        even += (N * f2 - f1 * f1) / (f1 * f1);
        tree += (second - f1 * f1) / (f1 * f1);
    }
    tap_ok(tree < even / 300 && tree < 0.8 * PLACES,
           "10000 %s: variance of the choice against even choice # 1/%.0f, relative %.2f",
           points ? "points" : "squares", even / tree, tree / PLACES);
    tap_ok(imp__light_tree_bytes(t) <= 160 * (size_t)N, "its memory # %.0f bytes a lamp",
           (double)imp__light_tree_bytes(t) / N);
    imp_scene_destroy(s);
}

/* ---- Pictures and gradients ------------------------------------------------------ */

static void compare(imp_scene *a, imp_scene *b, int spp_a, int spp_b, const char *what)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *const s[2] = {a, b};
    const int spp[2] = {spp_a, spp_b};
    struct imp_film_info info = {.size = sizeof info};
    double mean[2] = {0}, variance[2] = {0}, z2 = 0;
    imp_film *film[2];
    for (int k = 0; k < 2; k++) {
        run.seed = (uint64_t)(90 + k);
        run.spp = spp[k];
        test_must(ctx, imp_render(s[k], &run, &film[k]));
    }
    imp_film_get_info(film[0], &info);
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    for (size_t i = 0; i < n; i++) {
        double e2 = 0;
        for (int k = 0; k < 2; k++) {
            mean[k] += imp_film_mean(film[k])[i];
            variance[k] += imp__sqr((double)imp_film_se(film[k])[i]);
            e2 += imp__sqr((double)imp_film_se(film[k])[i]);
        }
        if (e2 > 0)
            z2 +=
                imp__sqr((double)imp_film_mean(film[0])[i] - imp_film_mean(film[1])[i]) /
                e2;
    }
    const double z = (mean[0] - mean[1]) / sqrt(variance[0] + variance[1]);
    tap_ok(fabs(z) < 4.5 && z2 / (double)n < 1.3 && sqrt(variance[1]) < 0.02 * mean[1],
           "%s: mean %.5g and %.5g # z %.2f, mean z^2 %.2f, variance of a sample 1/%.1f",
           what, mean[0] / (double)n, mean[1] / (double)n, z, z2 / (double)n,
           variance[0] * spp_a / (variance[1] * spp_b));
    for (int k = 0; k < 2; k++) imp_film_destroy(film[k]);
}

/* Of the mean of the picture, by all numbers, of lights that are dark too. */
static void gradients(imp_scene *a, imp_scene *b, int spp, const char *what)
{
    enum { MOST = 256 };
    static double value[2][MOST], se[2][MOST];
    imp_scene *const s[2] = {a, b};
    size_t n = 0, far = 0, dark = 0;
    double worst = 0;
    for (int k = 0; k < 2; k++) {
        imp_problem *p = test_problem(ctx, s[k], "*");
        struct imp_run run = IMP_RUN_INIT;
        n = imp_problem_n_variables(p);
        if (n > MOST) abort();
        run.spp = spp;
        run.seed = (uint64_t)(40 + k);
        test_must(ctx, imp_problem_functional(p, NULL, &run, NULL, value[k], se[k]));
        const size_t box = test_variable(p, s[k], ctx, "box.radiance.value");
        dark += value[k][box] > 4 * se[k][box];
        imp_problem_destroy(p);
    }
    for (size_t i = 0; i < n; i++) {
        const double e = hypot(se[0][i], se[1][i]);
        const double z = e > 0 ? (value[0][i] - value[1][i]) / e : 0;
        worst = fmax(worst, fabs(z));
        far += fabs(z) > 2;
    }
    tap_ok(worst < 4.8 && far <= 3 + n / 10 && dark == 2,
           "%s: gradients of %zu numbers # worst z %.2f, %zu beyond 2", what, n, worst,
           far);
}

/* Strengths follow the lights; the tree of the same numbers is the same. */
static void follows(void)
{
    imp_scene *s = mixed_scene("tree", 1, 4, 3);
    const struct imp_light_tree *t = s->light_tree;
    const struct imp_light_place q = place_at(0);
    size_t param;
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_find_param(s, "ball.radiance.value", &param));
    test_must(ctx, imp_scene_get_param(s, param, &info));
    int ball = 0;
    while (strcmp(s->emitters[ball]->name, "ball") != 0) ball++;
    const double before = imp__light_tree_chance(t, &q, ball, -1);
    double old[3];
    for (size_t k = 0; k < 3; k++) {
        old[k] = imp__param_get(&s->params[param], k);
        imp__param_set(&s->params[param], k, 0);
    }
    imp__theta_announce(s);
    const double off = imp__light_tree_chance(t, &q, ball, -1);
    for (size_t k = 0; k < 3; k++) imp__param_set(&s->params[param], k, 1000 * old[k]);
    imp__theta_announce(s);
    const double bright = imp__light_tree_chance(t, &q, ball, -1);
    for (size_t k = 0; k < 3; k++) imp__param_set(&s->params[param], k, old[k]);
    imp__theta_announce(s);
    const double again = imp__light_tree_chance(t, &q, ball, -1);
    tap_ok(off > 0 && off < 0.1 * before && bright > 1.2 * before && again == before,
           "strengths follow parameters # %.3g, dark %.3g, bright %.3g", before, off,
           bright);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(1);
    for (int far = 0; far < 2; far++) {
        imp_scene *tree = mixed_scene("tree", far, 8, 5);
        imp_scene *even = mixed_scene("weights", far, 8, 5);
        picks(tree, far ? "all kinds" : "lights that end", 200);
        compare(even, tree, 2000, 2000, far ? "all kinds" : "lights that end");
        if (far) gradients(even, tree, 1000, "all kinds");
        imp_scene_destroy(tree);
        imp_scene_destroy(even);
    }
    follows();
    const struct lamps few = {300, "tree", 0, 8, 3, ""},
                       same = {300, "weights", 0, 8, 3, ""};
    imp_scene *tree = lamps_scene(&few), *even = lamps_scene(&same);
    picks(tree, "300 lamps", 20);
    compare(even, tree, 4000, 1000, "300 lamps");
    imp_scene_destroy(tree);
    imp_scene_destroy(even);
    worth(0);
    worth(1);
    imp_context_destroy(ctx);
    return tap_done();
}
