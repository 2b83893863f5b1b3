/* SPDX-License-Identifier: Apache-2.0
 *
 * Slabs of a homogeneous medium against adding and doubling: radiance that is reflected
 * and transmitted, straight on and at an angle, and its derivatives with respect to
 * extinction, albedo and the phase function's mean cosine. The lamp is a square so large
 * that the rest of its half space is less than 1e-4 of it. */
#include "adding_doubling.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

static imp_context *ctx;

struct row {
    const char *phase;
    ad_phase *truth;
    double tau, albedo, g;
};

static const char scene_text[] =
    "<scene version='3.0.0'>"
    "%s"
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='%g'/>"
    "<float name='albedo' value='%g'/>%s</medium>"
    "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/>"
    "<transform name='to_world'><scale x='3000' y='3000' z='0.5'/></transform></shape>"
    "<shape type='rectangle' id='lamp'><emitter type='area'>"
    "<float name='radiance' value='1'/></emitter>"
    "<transform name='to_world'><scale value='10000'/>"
    "<rotate x='1' angle='%g'/><translate z='%g'/></transform></shape>"
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.001'/>"
    "<lookat origin='0,0,-0.8' target='%.17g,0,%.17g' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='16'/>"
    "<integer name='height' value='16'/><rfilter type='box'/></film></sensor></scene>";

#define VOLPATH                                                                          \
    "<integrator type='volpath'><integer name='rr_depth' value='30'/></integrator>"
#define PHOTONS                                                                          \
    "<integrator type='photons'><string name='weights' value='kernel=1'/></integrator>"

static imp_scene *slab(const struct row *r, bool reflected, double mu,
                       const char *integrator)
{
    char phase[128], text[sizeof scene_text + 1024];
    snprintf(phase, sizeof phase, "<phase type='%s'/>", r->phase);
    if (strcmp(r->phase, "hg") == 0)
        snprintf(phase, sizeof phase,
                 "<phase type='hg'><float name='g' value='%g'/></phase>", r->g);
    snprintf(text, sizeof text, scene_text, integrator, r->tau, r->albedo, phase,
             reflected ? 0. : 180., reflected ? -1. : 1., sqrt(1 - mu * mu), -.8 + mu);
    return test_scene_text(ctx, text, IMP_MONO);
}

/* Of the truth, by central differences. */
static double truth(const struct row *r, bool reflected, double mu, double tau,
                    double albedo, double g)
{
    static struct ad_slab s;
    ad_make(&s, tau, albedo, r->truth, g, 1, &mu);
    return ad_row(&s, reflected ? s.R : s.T, s.n - 1);
}

static void agrees(struct imp_estimate v, double ref, double tight, const struct row *r,
                   const char *what, bool reflected, double mu)
{
    const double z = (v.value - ref) / hypot(v.se, 2e-5 * fabs(ref));
    tap_ok(fabs(z) <= 4 && v.se <= tight,
           "%s, tau %g, albedo %g: %s, %s at mu %g # value %.6g se %.2g ref %.6g z %.2f",
           r->phase, r->tau, r->albedo, what, reflected ? "reflected" : "transmitted", mu,
           v.value, v.se, ref, z);
}

static void check(const struct row *r, bool reflected, double mu, int spp,
                  const char *integrator)
{
    imp_scene *s = slab(r, reflected, mu, integrator);
    imp_problem *p = test_problem(ctx, s, "fog.*");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    double g[8], se[8];
    /* Of the radiance and its derivatives: standard error of one sample, at most. The thick
     * slab's are a tenth to a quarter above what was measured. */
    const double thick[4] = {.06, .045, 3.4, 2.6};
    const double thin[4] = {.05, .25 / fmax(1, r->tau), .25, .25};
    const double *most = r->tau < 5 ? thin : thick, h = 1e-4;
    run.spp = spp;
    run.seed = 7;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, se));
    agrees(v, truth(r, reflected, mu, r->tau, r->albedo, r->g), most[0] / sqrt(spp), r,
           "radiance", reflected, mu);
    static const char *const names[] = {"fog.sigma_t.value", "fog.albedo.value",
                                        "fog.phase.g.value"};
    for (int k = 0; k < (strcmp(r->phase, "hg") == 0 ? 3 : 2); k++) {
        const size_t i = test_variable(p, s, ctx, names[k]);
        double at[3] = {r->tau, r->albedo, r->g}, below;
        at[k] -= h;
        below = truth(r, reflected, mu, at[0], at[1], at[2]);
        at[k] += 2 * h;
        const double above = truth(r, reflected, mu, at[0], at[1], at[2]);
        agrees((struct imp_estimate){.value = g[i], .se = se[i]},
               (above - below) / (2 * h), most[k + 1] / sqrt(spp), r, names[k], reflected,
               mu);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    static const struct row rows[] = {{"hg", ad_hg, 2, .9, .75},
                                      {"isotropic", ad_hg, .5, 1, 0},
                                      {"isotropic", ad_hg, 1, .9, 0},
                                      {"rayleigh", ad_rayleigh, .1, 1, 0},
                                      {"hg", ad_hg, 10, 1, .85}};
    const bool more = argc > 1 && strcmp(argv[1], "long") == 0;
    const int only = argc > 2 ? atoi(argv[2]) : -1; /* one row, for those in a hurry */
    ctx = test_context(0);
    static struct ad_slab s;
    const double one = 1;
    ad_make(&s, 2, .9, ad_hg, .75, 1, &one);
    tap_near(ad_row(&s, s.R, s.n - 1), .09739, 0, 1e-5,
             "reflectance of van de Hulst's slab");
    tap_near(ad_row(&s, s.T, s.n - 1), .66096, 0, 1e-5, "its transmittance");
    for (int i = 0; i < (more ? 5 : 4); i++) /* the last has walks of hundred vertices */
        for (int k = 0; k < 4; k++)
            if ((more || k < 2 || i == 2) && (only < 0 || only == i))
                check(&rows[i], k & 1, k < 2 ? 1 : .4, more ? 16384 : 384, VOLPATH);
    if (only < 0)
        check(&rows[2], true, 1, more ? 16384 : 384, PHOTONS); /* no connections */
    imp_context_destroy(ctx);
    return tap_done();
}
