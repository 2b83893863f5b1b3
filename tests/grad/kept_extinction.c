/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks at another extinction. Their collisions are weighed anew: pictures agree with
 * fresh ones within their errors, in uniform media and grids, with and without a colour;
 * so do derivatives with respect to what is no extinction. At the extinction of the draw
 * they are those of tracing, to the bit. Where no collision was drawn, or none could be
 * at the bound, they are refused. */
#include "kept_media.h"

static char grey[64], coloured[64], full[64];

/* ---- Scenes ---------------------------------------------------------------------- */

/* The camera in a ball of fog. */
static imp_scene *ball(const char *sigma, const char *rr_depth, enum imp_color_mode mode)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='volpath'><integer name='rr_depth' "
             "value='%s'/></integrator><medium type='homogeneous' id='fog'>%s<rgb "
             "name='albedo' value='.9,.8,.6'/></medium>" CAMERA(
                 "<ref id='fog'/>") "<shape type='sphere'><boolean name='flip_normals' "
                                    "value='true'/><float "
                                    "name='radius' value='3'/><bsdf type='diffuse' "
                                    "id='wall'><rgb "
                                    "name='reflectance' value='.7,.6,.5'/></bsdf><ref "
                                    "name='exterior' "
                                    "id='fog'/></shape><shape type='sphere'><point "
                                    "name='center' x='.6' y='.8' "
                                    "z='0'/><float name='radius' value='.4'/><emitter "
                                    "type='area'/><ref "
                                    "name='exterior' id='fog'/></shape></scene>",
             rr_depth, sigma);
    return test_scene_text(ctx, xml, mode);
}

/* ---- Tools ----------------------------------------------------------------------- */

/* Times a factor; only: those below it. */
static void scale(imp_scene *scene, const char *name, double factor, double only)
{
    double x[3 * CELLS];
    size_t n, k = param(scene, name, x, &n);
    for (size_t e = 0; e < n; e++)
        if (x[e] < only) x[e] *= factor;
    test_must(ctx, imp_scene_set_values(scene, k, n, x));
}

static bool same(imp_film *a, imp_film *b)
{
    struct imp_film_info i = {.size = sizeof i};
    imp_film_get_info(a, &i);
    const size_t n = (size_t)i.width * (size_t)i.height * (size_t)i.channels;
    return memcmp(imp_film_mean(a), imp_film_mean(b), n * sizeof(float)) == 0 &&
           memcmp(imp_film_se(a), imp_film_se(b), n * sizeof(float)) == 0;
}

/* ---- Values ---------------------------------------------------------------------- */

/* Recorded walks against fresh ones. */
static void elsewhere(imp_scene *scene, const char *name, double factor, double only,
                      const char *what)
{
    double square, moved;
    imp_walks *walks = keep(scene, 96, false, 0);
    imp_film *traced = render(scene, NULL, 96, 21);
    imp_film *before = render(scene, walks, 0, 0);
    tap_ok(same(traced, before), "%s: at the draw, to the bit", what);
    scale(scene, name, factor, only);
    const struct imp_walks_weight w = weigh(walks);
    imp_film *kept = render(scene, walks, 0, 0);
    imp_film *fresh = render(scene, NULL, 192, 22);
    const double worst = worst_of(kept, fresh, &square);
    worst_of(before, fresh, &moved);
    tap_ok(worst < FAIL_Z && square < 1.6 && moved > 2 && w.ess < 1 && !w.refused,
           "%s: times %g # worst z %.2f, mean square %.2f, without weights %.0f, ess "
           "%.3f",
           what, factor, worst, square, moved, w.ess);
    imp_film_destroy(traced);
    imp_film_destroy(before);
    imp_film_destroy(kept);
    imp_film_destroy(fresh);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* A ball of vacuum or of fog that absorbs: 0 where it was not. */
static void to_nothing(void)
{
    imp_scene *scene = ball("<float name='sigma_t' value='.01'/>", "5", IMP_RGB);
    double square;
    imp_walks *walks = keep(scene, 96, false, 0);
    scale(scene, "fog.sigma_t.value", 0, INFINITY);
    imp_film *kept = render(scene, walks, 0, 0);
    imp_film *fresh = render(scene, NULL, 256, 22);
    const double worst = worst_of(kept, fresh, &square);
    tap_ok(worst < FAIL_Z && square < 1.6, "fog that has gone # worst z %.2f, %.2f",
           worst, square);
    imp_film_destroy(kept);
    imp_film_destroy(fresh);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* ---- Derivatives ------------------------------------------------------------------- */

struct answer {
    struct imp_estimate f;
    double g[8], se[8];
};
static struct answer loss(imp_problem *p, const imp_walks *walks, int spp, uint64_t seed)
{
    struct answer a = {.f = {0}};
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = seed;
    run.points = IMP_POINTS_INDEPENDENT;
    run.walks = walks;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &a.f, a.g, a.se));
    return a;
}

/* A loss and its derivatives with respect to the wall and the albedo. */
static void derivatives(imp_scene *scene, const char *name, const char *active,
                        double factor, const char *what)
{
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    float pixels[16 * 16 * 3];
    imp_walks *walks = keep(scene, 128, true, 0);
    for (int k = 0; k < 16 * 16 * 3; k++) pixels[k] = 0.1f + 0.3f * (float)(k % 7) / 7;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, active));
    t.width = t.height = 16;
    t.channels = 3;
    t.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &t));
    const size_t n = imp_problem_n_variables(p);
    const struct answer before = loss(p, walks, 0, 0);
    scale(scene, name, factor, INFINITY);
    const struct answer kept = loss(p, walks, 0, 0);
    const struct answer fresh = loss(p, NULL, 256, 22);
    double worst = fabs(kept.f.value - fresh.f.value) / hypot(kept.f.se, fresh.f.se);
    double moved = fabs(before.f.value - fresh.f.value) / hypot(before.f.se, fresh.f.se);
    for (size_t k = 0; k < n; k++)
        worst =
            fmax(worst, fabs(kept.g[k] - fresh.g[k]) / hypot(kept.se[k], fresh.se[k]));
    tap_ok(n == 3 && worst < FAIL_Z && moved > 3,
           "%s: loss and its derivatives # worst z %.2f, without weights %.1f", what,
           worst, moved);

    /* Of an extinction itself there is none. */
    struct imp_estimate f;
    double g[3 * CELLS + 8], se[3 * CELLS + 8];
    test_must(ctx, imp_problem_activate(p, name));
    run.walks = walks;
    run.points = IMP_POINTS_INDEPENDENT;
    tap_ok(imp_problem_objective(p, NULL, &run, &f, g, se) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "no derivative with respect to"),
           "%s: of its extinction there is none # %s", what, imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* ---- How many count ---------------------------------------------------------------- */

/* Fewer and fewer, on both sides, and all of them at the draw. */
static void distance(void)
{
    enum { FACTORS = 8 };
    static const double factor[FACTORS] = {1, 1.1, 1.3, 1.6, 1, 0.9, 0.7, 0.4};
    double ess[FACTORS], x[3];
    size_t n;
    imp_scene *scene = ball("<rgb name='sigma_t' value='.2,.3,.5'/>", "100", IMP_RGB);
    imp_walks *walks = keep(scene, 32, false, 0);
    const size_t k = param(scene, "fog.sigma_t.value", x, &n);
    for (int i = 0; i < FACTORS; i++) {
        double y[3];
        for (size_t e = 0; e < n; e++) y[e] = x[e] * factor[i];
        test_must(ctx, imp_scene_set_values(scene, k, n, y));
        ess[i] = weigh(walks).ess;
    }
    tap_ok(ess[0] == 1 && ess[1] < 1 && ess[2] < ess[1] && ess[3] < ess[2] &&
               ess[4] == 1 && ess[5] < 1 && ess[6] < ess[5] && ess[7] < ess[6],
           "fewer count the farther away # 1.1: %.4f 1.3: %.4f 1.6: %.4f .9: %.4f .7: "
           "%.4f .4: %.4f",
           ess[1], ess[2], ess[3], ess[5], ess[6], ess[7]);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* One flight of length D in a fog that absorbs, before a wall of radiance 1: in the mean
 * over walks, with sigma' = r sigma,
 *
 *     n/ESS = int_0^D r^2 sigma exp(-(2r - 1) sigma t) dt + exp(-(2r - 1) sigma D) */
static void closed_form(double r)
{
    const double sigma = 0.8, D = 2, a = (2 * r - 1) * sigma;
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='volpath'><integer "
             "name='max_depth' value='1'/></integrator><medium type='homogeneous' "
             "id='fog'><float name='sigma_t' value='%g'/><float name='albedo' "
             "value='0'/></medium><sensor type='orthographic'><transform "
             "name='to_world'><lookat origin='0,0,%g' target='0,0,0' up='0,1,0'/>"
             "</transform><float name='near_clip' value='1e-4'/><ref id='fog'/><film "
             "type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
             "value='16'/><rfilter type='box'/></film></sensor><shape type='rectangle'>"
             "<transform name='to_world'><scale value='4'/></transform><emitter "
             "type='area'/><ref name='exterior' id='fog'/></shape></scene>",
             sigma, D);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    imp_walks *walks = keep(scene, 1024, false, 0);
    scale(scene, "fog.sigma_t.value", r, INFINITY);
    tap_near(weigh(walks).ess, 1 / (r * r * sigma * (1 - exp(-a * D)) / a + exp(-a * D)),
             0.004, 0, "one flight: effective sample size in closed form");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* Two flights in a fog without an end, with a collision between them, as all lanes together
 * draw them: with p_j(t) = sigma_j exp(-sigma_j t), and p' that of r sigma,
 *
 *     n/ESS = int int (mean_j p_j'(t) p_j'(u))^2/(mean_j p_j(t) p_j(u)) dt du
 *
 * by the rule of midpoints in x = 1 - exp(-t sigma_0). */
static double two_flights(const double sigma[3], double r)
{
    enum { POINTS = 400 };
    double sum = 0;
    for (int a = 0; a < POINTS; a++)
        for (int b = 0; b < POINTS; b++) {
            const double rate = sigma[0] < sigma[2] ? sigma[0] : sigma[2];
            const double x = 1 - (a + 0.5) / POINTS, y = 1 - (b + 0.5) / POINTS;
            const double t = -log(x) / rate, u = -log(y) / rate;
            double before = 0, now = 0;
            for (int j = 0; j < 3; j++) {
                before += pow(sigma[j], 2) * exp(-sigma[j] * (t + u)) / 3;
                now += pow(r * sigma[j], 2) * exp(-r * sigma[j] * (t + u)) / 3;
            }
            sum += now * now / before / (rate * x * rate * y) / (POINTS * POINTS);
        }
    return sum;
}

/* Roulette survives by the albedo a alone where extinction has no colour, at any
 * extinction; a walk that ends has one flight: with e = r^2/(2 r - 1), that of one,
 *
 *     n/ESS = e (1 - a + a e)                                                         */
static void closed_form_of_two(const double sigma[3], double r, bool roulette)
{
    const double albedo = 0.6, one = r * r / (2 * r - 1);
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='volpath'><integer "
             "name='max_depth' value='2'/><integer name='rr_depth' value='%d'/>"
             "</integrator><medium type='homogeneous' id='fog'><rgb name='sigma_t' "
             "value='%g,%g,%g'/><float name='albedo' value='%g'/></medium><sensor "
             "type='orthographic'><float name='near_clip' value='1e-4'/><ref "
             "id='fog'/><film type='hdrfilm'><integer name='width' value='16'/><integer "
             "name='height' value='16'/><rfilter type='box'/></film></sensor><shape "
             "type='sphere'><point name='center' x='0' y='0' z='-9'/><emitter "
             "type='area'/><ref name='exterior' id='fog'/></shape></scene>",
             roulette ? 1 : 100, sigma[0], sigma[1], sigma[2], albedo);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    imp_walks *walks = keep(scene, 512, false, 0);
    scale(scene, "fog.sigma_t.value", r, INFINITY);
    tap_near(weigh(walks).ess,
             1 / (roulette ? one * (1 - albedo + albedo * one) : two_flights(sigma, r)),
             0.01, 0,
             roulette ? "two flights and roulette: effective sample size in closed form"
                      : "two coloured flights: effective sample size in closed form");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* ---- Refused --------------------------------------------------------------------- */

static void refused(imp_scene *scene, const imp_walks *walks, const char *word,
                    const char *name, const char *what)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.walks = walks;
    const enum imp_status st = imp_render(scene, &run, &film);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word) &&
               strstr(imp_last_error(ctx), name),
           "%s # %s", what, st == IMP_OK ? "not refused" : imp_last_error(ctx));
    if (st == IMP_OK) imp_film_destroy(film);
    const struct imp_walks_weight w = weigh(walks);
    tap_ok(w.refused && w.ess == 0, "%s: none of them counts", what);
}

static void refusals(void)
{
    double x[3 * CELLS];
    size_t n, k;
    imp_scene *scene = ball("<rgb name='sigma_t' value='.3,0,.5'/>", "5", IMP_RGB);
    imp_walks *walks = keep(scene, 4, false, 0);
    k = param(scene, "fog.sigma_t.value", x, &n);
    x[1] = 0.1;
    test_must(ctx, imp_scene_set_values(scene, k, n, x));
    refused(scene, walks, "was 0 when they were drawn", "number 1 of fog.sigma_t",
            "an extinction that was 0");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);

    scene = cloud(grey, "trilinear", "", IMP_RGB);
    walks = keep(scene, 16, false, 0);
    scale(scene, "cloud.sigma_t.data", 1.2, INFINITY);
    refused(scene, walks, "above the bound", "'cloud'", "a grid above its bounds");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);

    scene = cloud(full, "trilinear", "", IMP_RGB);
    walks = keep(scene, 16, false, 0);
    scale(scene, "cloud.sigma_t.data", 0.7, INFINITY);
    refused(scene, walks, "had reached its bound", "'cloud'",
            "a grid without null collisions");
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    float value[3 * CELLS];
    ctx = test_context(2);
    clouds_write(2.3f, grey, coloured, value);
    for (int k = 0; k < CELLS; k++) value[k] = 1;
    vol_write(full, 4, 4, 4, 1, value);

    static const char one[] = "<float name='sigma_t' value='.3'/>",
                      three[] = "<rgb name='sigma_t' value='.2,.3,.5'/>";
    static const double factor[] = {1.2, 0.7};
    for (int k = 0; k < 2; k++) {
        if (is_long || k == 0)
            elsewhere(ball(one, "5", IMP_MONO), "fog.sigma_t.value", factor[k], INFINITY,
                      "fog, mono");
        if (is_long)
            elsewhere(ball(one, "5", IMP_RGB), "fog.sigma_t.value", factor[k], INFINITY,
                      "fog");
        elsewhere(ball(three, "5", IMP_RGB), "fog.sigma_t.value", factor[k], INFINITY,
                  "coloured fog");
        /* Above their bounds grids are refused: only what is far below rises. */
        const double only = k == 0 ? 1.2 : INFINITY;
        if (is_long || k == 1)
            elsewhere(cloud(grey, "trilinear", "", IMP_MONO), "cloud.sigma_t.data",
                      factor[k], only, "a cloud, mono");
        elsewhere(cloud(coloured, "trilinear", "", IMP_RGB), "cloud.sigma_t.data",
                  factor[k], only, "a coloured cloud");
    }
    elsewhere(cloud(grey, "trilinear", "<string name='transmittance' value='residual'/>",
                    IMP_RGB),
              "cloud.sigma_t.data", 0.7, INFINITY, "a cloud, by residuals");
    elsewhere(ball(three, "5", IMP_SPECTRAL), "fog.sigma_t.value", 0.7, INFINITY,
              "coloured fog, spectral");
    to_nothing();
    derivatives(ball(three, "5", IMP_RGB), "fog.sigma_t.value", "wall.*", 0.7, "fog");
    derivatives(cloud(coloured, "trilinear", "", IMP_RGB), "cloud.sigma_t.data",
                "cloud.albedo*", 0.8, "a cloud");
    distance();
    closed_form(1.4);
    closed_form(0.7);
    closed_form_of_two((const double[]){1, 2, 4}, 1.3, false);
    closed_form_of_two((const double[]){4, 2, 1}, 0.75, false);
    closed_form_of_two((const double[]){2, 2, 2}, 1.4, true);
    closed_form_of_two((const double[]){2, 2, 2}, 0.8, true);
    refusals();
    remove(grey);
    remove(coloured);
    remove(full);
    imp_context_destroy(ctx);
    return tap_done();
}
