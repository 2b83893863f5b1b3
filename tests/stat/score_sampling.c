/* SPDX-License-Identifier: Apache-2.0
 *
 * Normals that are drawn where D changes with the roughness: chi-square against their
 * density, which integrates to 1 and is |dD/d alpha| cos(theta) up to a factor; the same of
 * materials with them; derivatives with respect to small roughnesses under a sky against
 * quadrature of eval_d, their errors against their spread, forward and reverse. */
#include "../imp_scene.h"
#include "imp_kinds.h"
#include "imp_tap.h"
#include "kind/bsdf/microfacet.h"
#include "math/draws.h"
#include "math/stat.h"
#include "scene/scene.h"

static double level; /* of one chi-square, so that all together fail 1 % (Sidak) */
static struct imp__sphere_tree tree;

/* ---- Normals --------------------------------------------------------------------- */

static double normal_density(imp_v3 m, void *payload)
{
    const struct imp__microfacet *f = payload;
    return imp__score_pdf(f, &m, imp__microfacet_d(f, &m, NULL));
}
static bool normal_draw(void *payload, const double u[3], imp_v3 *m, int *lobe)
{
    *m = imp__score_sample(payload, u + 1);
    *lobe = IMP_SMOOTH;
    return true;
}

/* |d ln D| by the wanted combination, from the function that values are made with. */
static double change(const struct imp__microfacet *f, const imp_v3 *m)
{
    double d[2];
    const double D = imp__microfacet_d(f, m, d), u = d[0] * f->au, v = d[1] * f->av;
    return D * (*m)[2] *
           fabs(f->wanted == IMP_SCORE_SCALE ? u + v
                : f->wanted == IMP_SCORE_U   ? u
                : f->wanted == IMP_SCORE_V   ? v
                                             : u - v);
}

static void normals(void)
{
    static const unsigned wanted[] = {IMP_SCORE_SCALE,
                                      IMP_SCORE_U,
                                      IMP_SCORE_V,
                                      IMP_SCORE_ASPECT,
                                      IMP_SCORE_U | IMP_SCORE_V,
                                      IMP_SCORE_SCALE | IMP_SCORE_ASPECT};
    for (int i = 0; i < 12; i++) {
        struct imp__microfacet f = {i % 2 ? IMP_GGX : IMP_BECKMANN, true, 0.6, 0.35,
                                    wanted[i / 2]};
        const struct imp__drawn d = {
            .draw = normal_draw, .density = normal_density, .payload = &f};
        const struct imp__draws r =
            imp__draws_test(&d, 60000, 40 + (uint64_t)i, IMP_SPHERE_STEPS + 3, &tree);
        tap_ok(r.chance > level && fabs(r.total - 1) < 1e-4 && r.none == 0 &&
                   r.cells > 40,
               "%s, %u: draws follow the density # p %.2g, total %.6f, %d cells",
               i % 2 ? "ggx" : "beckmann", f.wanted, r.chance, r.total, r.cells);
        if (f.wanted & (f.wanted - 1)) continue;
        double least = 1e300, most = 0;
        for (int k = 0; k < 200; k++) {
            const imp_v3 m = kind_direction(2 * k, 21);
            const double c = change(&f, &m), p = normal_density(m, &f);
            if (!(m[2] > 0.05) || !(c > 1e-12)) continue;
            least = fmin(least, p / c);
            most = fmax(most, p / c);
        }
        tap_ok(most < least * (1 + 1e-9), "%s, %u: it is |dD| cos(theta) # %.12g, %.12g",
               i % 2 ? "ggx" : "beckmann", f.wanted, least, most);
    }
}

/* ---- Materials ------------------------------------------------------------------- */

struct point {
    const struct imp_bsdf *b;
    imp_spec in[IMP_INPUTS_MAX];
    imp_v3 wo;
};
static double density(imp_v3 wi, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {p->wo, wi, IMP_SMOOTH, ~UINT64_C(0)};
    return p->b->ops->pdf(p->b, p->in, &d);
}
static bool draw(void *payload, const double u[3], imp_v3 *w, int *lobe)
{
    const struct point *p = payload;
    struct imp_dirs d = {p->wo, {0}, IMP_SMOOTH, ~UINT64_C(0)};
    if (!p->b->ops->sample(p->b, p->in, u, &d)) return false;
    *w = d.wi;
    *lobe = d.lobe;
    return true;
}
static void visit(const struct kind_case *c, void *payload)
{
    int *n = payload;
    double worst = 1;
    bool rough = false;
    if (c->bsdf.flags & IMP_BSDF_DELTA || (c->bsdf.n_child && *n > 24)) return;
    for (int i = 0; i < 3; i++) {
        struct point p = {.b = &c->bsdf};
        kind_inputs(p.b, KIND_RANDOM, 70 + (uint64_t)i, p.in);
        for (int j = 0; j < p.b->n_in; j++) {
            const char *name = kind_input(p.b, j)->name;
            const bool alpha = strncmp(name, "alpha", 5) == 0;
            if (!alpha && strcmp(name, "roughness") != 0) continue;
            p.in[j] = imp__spec(alpha ? 0.06 + 0.03 * i : 0.3);
            rough = true;
        }
        if (!rough) return;
        p.wo = kind_direction(2 * i, 21);
        const struct imp__drawn d = {
            .draw = draw, .density = density, .payload = &p, .pilot = 6000};
        const struct imp__draws r =
            imp__draws_test(&d, 20000, 80 + (uint64_t)i, IMP_SPHERE_SMOOTH, &tree);
        if (r.chance < level)
            printf("# wo %.3f %.3f %.3f: p %.2g, total %.6f, none %.6f\n", p.wo[0],
                   p.wo[1], p.wo[2], r.chance, r.total, r.none);
        worst = fmin(worst, r.chance);
    }
    (*n)++;
    tap_ok(worst > level, "%s: draws follow the density # least p %.2g", c->label, worst);
}

/* ---- Derivatives ------------------------------------------------------------------ */

/* A plate seen at 45 degrees under a sky of radiance 1: the integral of f. */
static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='path'>"
    "<integer name='max_depth' value='2'/></integrator>"
    "<sensor type='perspective'><float name='fov' value='.01'/><transform "
    "name='to_world'><lookat origin='5,0,5' target='0,0,0' up='0,0,1'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='1'/><integer name='height' "
    "value='1'/><rfilter type='box'/></film></sensor>"
    "<shape type='rectangle'><bsdf type='%s' id='m'><string name='distribution' "
    "value='%s'/>%s</bsdf></shape>"
    "<emitter type='constant'><float name='radiance' value='1'/></emitter></scene>";

struct slope {
    const struct imp_bsdf *b;
    imp_spec in[IMP_INPUTS_MAX];
    imp_v3 wo;
    int input;
};
static double slope_at(imp_v3 wi, void *payload)
{
    const struct slope *s = payload;
    const struct imp_dirs d = {s->wo, wi, IMP_SMOOTH, 0};
    imp_spec df[IMP_INPUTS_MAX];
    s->b->ops->eval_d(s->b, s->in, &d, df);
    return df[s->input][0];
}

static void derivative(imp_context *ctx, const char *kind, const char *distribution,
                       const char *numbers, const char *name)
{
    enum { SEEDS = 40 };
    char text[2048], glob[64];
    snprintf(text, sizeof text, scene_text, kind, distribution, numbers);
    snprintf(glob, sizeof glob, "m.%s", name);
    imp_scene *scene = test_scene_text(ctx, text, IMP_MONO);
    imp_problem *p = test_problem(ctx, scene, glob);

    /* By quadrature. */
    struct slope s = {.wo = imp__v3(sqrt(0.5), 0, sqrt(0.5)), .input = -1};
    size_t param;
    test_must(ctx, imp_scene_find_param(scene, glob, &param));
    for (int b = 0; b < scene->n_bsdfs; b++)
        for (int j = 0; j < scene->bsdfs[b]->n_in; j++)
            if (scene->bsdfs[b]->input[j]->param == (int)param) {
                s.b = scene->bsdfs[b];
                s.input = j;
            }
    for (int j = 0; j < s.b->n_in; j++) s.in[j] = s.b->input[j]->value;
    const double truth =
        imp__sphere_integral(slope_at, &s, 0, 1, 1e-6, IMP_SPHERE_SMOOTH);

    double sum = 0, squares = 0, told = 0;
    for (int k = 0; k < SEEDS; k++) {
        struct imp_run run = IMP_RUN_INIT;
        double g, se;
        run.seed = (uint64_t)k + 1;
        run.spp = 2048;
        test_must(ctx, imp_problem_functional(p, NULL, &run, NULL, &g, &se));
        sum += g / SEEDS;
        squares += g * g / SEEDS;
        told += se * se / SEEDS;
    }
    const double seen = (squares - sum * sum) * SEEDS / (SEEDS - 1);
    tap_ok(fabs(sum - truth) < 4 * sqrt(seen / SEEDS),
           "%s %s, %s: the derivative # %.5g, by quadrature %.5g, z %.1f", kind,
           distribution, name, sum, truth, (sum - truth) / sqrt(seen / SEEDS));
    /* Of 39 degrees of freedom chi^2/39 is above 1.85 once in 1,000 times, and below .44:
     * ten such checks fail once in a hundred. */
    tap_ok(seen < 1.85 * told && told < 2.2 * seen,
           "%s %s, %s: its error # seen/told %.2f", kind, distribution, name,
           sqrt(seen / told));

    /* The picture along x, and the gradient. */
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    double one = 1, g;
    run.spp = 256;
    run.points = IMP_POINTS_INDEPENDENT; /* the same walks forward and in reverse */
    test_must(ctx, imp_problem_forward(p, &one, &run, &film));
    test_must(ctx, imp_problem_reverse(p, (float[]){1}, &run, &g, NULL));
    tap_near(imp_film_mean(film)[0], g, 0, 1e-6 * (fabs(g) + 1), "forward is reverse");
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    struct kind_factory f;
    int n = 0;
    level = imp__sidak(0.01, 200);
    normals();
    if (!kinds_open(&f)) return 1;
    kinds_visit(&f, visit, &n);
    kinds_close(&f);
    tap_ok(n >= 8, "kinds with a roughness # %d", n);
    imp_context *ctx = test_context(1);
#define ALPHA "<float name='alpha' value='0.07'/>"
#define TWO   "<float name='alpha_u' value='0.05'/><float name='alpha_v' value='0.12'/>"
    derivative(ctx, "roughconductor", "ggx", ALPHA, "alpha");
    derivative(ctx, "roughconductor", "beckmann", ALPHA, "alpha");
    derivative(ctx, "roughconductor", "ggx", TWO, "alpha_u");
    derivative(ctx, "roughconductor", "beckmann", TWO, "alpha_v");
    derivative(ctx, "roughplastic", "ggx", ALPHA, "alpha");
    imp_context_destroy(ctx);
    return tap_done();
}
