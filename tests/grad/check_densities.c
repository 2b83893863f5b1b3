/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of imp_check that draw see densities that are 3 % off, whichever function has the
 * mistake, and pass what is right. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include <math.h>

static imp_context *ctx;

static struct {
    int rows, failed, blind;
    double worst_sees;
} n;

/* Rows of `only` at default settings. */
static void check(imp_problem *p, const char *only, uint64_t seed)
{
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    size_t n_rows = 0;
    o.only = only;
    run.seed = seed;
    memset(&n, 0, sizeof n);
    test_must(ctx, imp_check(p, &o, &run, &rows, &n_rows));
    for (size_t i = 0; i < n_rows; i++) {
        n.rows++;
        n.failed += rows[i].ok == 0;
        n.blind += rows[i].ok < 0;
        n.worst_sees = fmax(n.worst_sees, rows[i].sees);
    }
}

/* ---- Lights ------------------------------------------------------------------------ */

static const struct imp_emitter_ops *right;
static double by;
static double wrong_pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    return by * right->pdf(e, ref, wi, hit, at);
}
static bool wrong_sample(const struct imp_emitter *e, const imp_v3 *ref,
                         const double u[2], struct imp_light_sample *out)
{
    const bool drawn = right->sample(e, ref, u, out);
    out->pdf *= by;
    return drawn;
}

static void wrong_light(const char *file, const char *size, int light)
{
    imp_scene *s = test_scene(ctx, file, IMP_RGB, size);
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_emitter *e = s->emitters[light];
    right = e->ops;
    check(p, "choices,points", 3);
    tap_ok(n.failed == 0 && n.blind == 0 && n.rows > 0,
           "%s: the densities of lights are right # %d rows, %d fail, sees %.3g", file,
           n.rows, n.failed, n.worst_sees);
    for (int k = 0; k < 4; k++) {
        struct imp_emitter_ops wrong = *right;
        by = k & 1 ? 1.03 : 0.97;
        if (k < 2) wrong.pdf = wrong_pdf;
        else wrong.sample = wrong_sample;
        e->ops = &wrong;
        check(p, "points", 3);
        e->ops = right;
        tap_ok(n.failed > 0, "%s: its %s times %g is caught", file,
               k < 2 ? "density" : "draw's density", by);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- Media --------------------------------------------------------------------------- */

static const struct imp_bsdf_ops *right_medium;
static double wrong_medium_pdf(const struct imp_bsdf *b, const imp_spec *in,
                               const struct imp_dirs *d)
{
    const double c = -imp__dot(d->wo, d->wi);
    return right_medium->pdf(b, in, d) * (1 + 0.1 * c);
}

static void wrong_phase(void)
{
    imp_scene *s = test_scene(ctx, "fog.xml", IMP_RGB, "res=16");
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_bsdf *b = (struct imp_bsdf *)(uintptr_t)s->media[0]->scatterer;
    right_medium = b->ops;
    check(p, "directions", 3);
    tap_ok(n.failed == 0 && n.blind == 0,
           "fog.xml: densities of directions are right # %d rows, sees %.3g", n.rows,
           n.worst_sees);
    struct imp_bsdf_ops wrong = *right_medium;
    wrong.pdf = wrong_medium_pdf;
    wrong.pdf_eval = NULL;
    b->ops = &wrong;
    check(p, "directions", 3);
    b->ops = right_medium;
    tap_ok(n.failed == 1, "a density of the phase function of another shape is caught");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- What else is drawn ---------------------------------------------------------------- */

/* Rows of a scene, all of them right. */
static void right_rows(const char *file, enum imp_color_mode mode, const char *size,
                       const char *only, int rows)
{
    imp_scene *s = test_scene(ctx, file, mode, size);
    imp_problem *p = test_problem(ctx, s, "*");
    for (uint64_t seed = 1; seed < 4; seed++) {
        check(p, only, seed);
        tap_ok(n.failed == 0 && n.blind == 0 && n.rows == rows,
               "%s, %s: right # %d rows, %d fail, sees %.3g", file, only, n.rows,
               n.failed, n.worst_sees);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static bool wrong_leaves(const struct imp_emitter *e, const struct imp_ball *scene,
                         const double u[4], struct imp_emission_sample *out)
{
    const bool drawn = right->sample_emission(e, scene, u, out);
    out->pdf_p *= 1.03;
    return drawn;
}

static void wrong_areas(void)
{
    imp_scene *s = test_scene(ctx, "headlamp.xml", IMP_RGB, NULL);
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_shape *meter = (struct imp_shape *)(uintptr_t)s->sensors[0]->shape;
    struct imp_emitter *lamp = s->emitters[0];
    meter->area *= 1.05;
    check(p, "areas", 3);
    meter->area /= 1.05;
    tap_ok(n.failed == 1, "a meter's area times 1.05 is caught");
    right = lamp->ops;
    struct imp_emitter_ops wrong = *right;
    wrong.sample_emission = wrong_leaves;
    lamp->ops = &wrong;
    check(p, "leaves", 3);
    lamp->ops = right;
    tap_ok(n.failed == 1, "points of light walks with another density are caught");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A host's shape may draw no points of its area: no walks begin on it, and no row fails. */
static void no_areas(void)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    imp_problem *p = test_problem(ctx, s, "red.*");
    struct imp_shape *lamp = (struct imp_shape *)(uintptr_t)s->emitters[0]->shape;
    const struct imp_shape_ops *ops = lamp->ops;
    struct imp_shape_ops plain = *ops;
    plain.sample_area = NULL;
    lamp->ops = &plain;
    check(p, "areas,leaves,points", 3);
    lamp->ops = ops;
    tap_ok(n.failed == 0 && n.blind == 0 && n.rows == 1,
           "a lamp that draws no points has its row of points alone # %d rows, %d fail",
           n.rows, n.failed);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Weights of wavelengths, by a cumulative distribution that is not what it was. */
static void wrong_waves(void)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_SPECTRAL, "res=16");
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_wavelengths *w = (struct imp_wavelengths *)(uintptr_t)s->wavelengths;
    for (int k = 0; k < 2; k++) w[k].lo += 80; /* drawn evenly, and by importance */
    check(p, "waves", 3);
    for (int k = 0; k < 2; k++) w[k].lo -= 80;
    tap_ok(n.failed == 1, "a spectrum that begins too late is caught");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* ---- Options --------------------------------------------------------------------------- */

static void options(void)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    imp_problem *p = test_problem(ctx, s, "red.*");
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    size_t n_rows = 0;
    o.only = "frozen,direction";
    tap_ok(imp_check(p, &o, NULL, &rows, &n_rows) == IMP_E_ARG,
           "a method that there is not is refused");
    o.only = "directions";
    o.draws_s = 1e-6;
    test_must(ctx, imp_check(p, &o, NULL, &rows, &n_rows));
    int open = 0;
    for (size_t i = 0; i < n_rows; i++)
        open += rows[i].ok == IMP_VERDICT_OPEN && rows[i].sees > 0.02;
    tap_ok(n_rows > 0 && open == (int)n_rows,
           "without time no row decides, and each says what it sees # %d", open);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    test_must(NULL, imp_context_create(NULL, &ctx));
    wrong_light("cornell.xml", "res=16", 0);
    wrong_light("textured.xml", "width=24 height=16", 0);
    wrong_light("textured.xml", "width=24 height=16", 1);
    wrong_phase();
    right_rows("cornell.xml", IMP_SPECTRAL, "res=16", "areas,leaves,film,waves", 4);
    right_rows("fog.xml", IMP_RGB, "res=16", "flights,passes,areas,leaves,film", 5);
    wrong_areas();
    no_areas();
    wrong_waves();
    options();
    imp_context_destroy(ctx);
    return tap_done();
}
