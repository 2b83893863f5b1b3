/* SPDX-License-Identifier: Apache-2.0
 *
 * What each density, light and proxy delivers, as the check of sampling tells it: a floor
 * under a white sky, looked at from above, whose two proxies are mirror images. Closed form
 * by quadrature over the floor's hemisphere, at the one point that is seen. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

static imp_context *ctx;

/* Discs of radius .5 at (+-1, 0, 1), which lie flat; weight of the second is `heavy`. */
static const char xml[] =
    "<scene version='3.0.0'><integrator type='photons'><integer name='max_depth' "
    "value='2'/>"
    "<string name='weights' value='kernel=.25,proxies=.75'/></integrator>"
    "<emitter type='constant'/>"
    "<shape type='rectangle'><transform name='to_world'><scale value='.001'/></transform>"
    "<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf></shape>"
    "<shape type='disk' name='proxy' id='left'><transform name='to_world'><scale "
    "value='.5'/>"
    "<translate x='-1' z='1'/></transform></shape>"
    "<shape type='disk' name='proxy2' id='right'><transform name='to_world'>"
    "<scale value='%g'/><translate x='1' z='1'/></transform></shape>"
    "<sensor type='orthographic'><transform name='to_world'><scale value='.0001'/>"
    "<lookat origin='0,0,.5' target='0,0,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "
    "value='4'/>"
    "<rfilter type='box'/></film></sensor></scene>";

/* Energy and draws of a disc of radius r at (1, 0, 1), of two with strengths proportional to
 * area over squared distance: the part of cos/pi over its solid angle that it drew,
 * a p/(k cos/pi + a p), and a = .75 its share. */
static void truth(double r, double other, double *energy, double *draws)
{
    enum { N = 400 };
    const double share = .75 * r * r / (r * r + other * other),
                 area = 3.14159265358979 * r * r;
    *energy = 0;
    *draws = share;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            const double s = r * sqrt((i + .5) / N),
                         a = 2 * 3.14159265358979 * (k + .5) / N;
            const double x = 1 + s * cos(a), y = s * sin(a), d2 = x * x + y * y + 1;
            const double cosine = 1 / sqrt(d2);
            const double p = share * d2 / cosine / area,
                         kernel = cosine / 3.14159265358979;
            const double per_area = cosine / d2; /* solid angle */
            *energy +=
                kernel * p / (.25 * kernel + p) * per_area * area / (N * (double)N);
        }
}

static const struct imp_check_row *row(const struct imp_check_row *rows, size_t n,
                                       const char *name)
{
    for (size_t k = 0; k < n; k++)
        if (!strcmp(rows[k].method, "energy") && rows[k].param &&
            !strcmp(rows[k].param, name))
            return &rows[k];
    return NULL;
}

static void report(double right)
{
    char text[2048];
    imp_problem *p;
    const struct imp_check_row *rows;
    size_t n;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    snprintf(text, sizeof text, xml, right);
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    test_must(ctx, imp_problem_create(s, &p));
    o.sampling = 1;
    run.spp = 20000;
    run.seed = 3;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    const struct imp_check_row *l = row(rows, n, "proxies: left"),
                               *r = row(rows, n, "proxies: right"),
                               *all = row(rows, n, "proxies");
    if (!l || !r || !all) {
        tap_ok(0, "rows of each proxy");
        return;
    }
    double energy[2], draws[2];
    truth(.5, right, &energy[0], &draws[0]);
    truth(right, .5, &energy[1], &draws[1]);
    /* 320,000 draws of which .75 go to proxies: binomial errors. */
    const double se[2] = {sqrt(energy[0] * (1 - energy[0]) / 320e3),
                          sqrt(energy[1] * (1 - energy[1]) / 320e3)};
    tap_ok(fabs(l->value - energy[0]) < 4 * se[0] &&
               fabs(r->value - energy[1]) < 4 * se[1],
           "energy # left %.5f of %.5f, right %.5f of %.5f, se %.5f", l->value, energy[0],
           r->value, energy[1], se[0]);
    tap_ok(fabs(l->reference - draws[0]) < 4e-3 && fabs(r->reference - draws[1]) < 4e-3,
           "draws # left %.5f of %.5f, right %.5f of %.5f", l->reference, draws[0],
           r->reference, draws[1]);
    tap_ok(fabs(l->value + r->value - all->value) < 1e-6 * all->value &&
               fabs(l->reference + r->reference - all->reference) < 1e-6,
           "and their sums are the density's # %.6f, %.6f", l->value + r->value,
           all->value);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    report(.5);
    report(.25);
    imp_context_destroy(ctx);
    return tap_done();
}
