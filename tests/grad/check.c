/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_check passes what is right, on scenes with every kind of row, and catches a planted
 * derivative that is 0.1 % off. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse_scenes.h"
#include "scene/scene.h"
#include <math.h>
#include <stdbool.h>

static imp_context *ctx;

struct counts {
    int rows, failed, frozen, dot, euler, fresh, noisy, density, wrong_density, blind,
        loss, ends;
    bool plain; /* z is (value - reference)/se */
    double worst_exact, worst_frozen, worst_z, worst_end;
};

static struct counts check(imp_problem *p, int paths, int spp, uint64_t seed)
{
    struct counts n = {.plain = true};
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    o.paths = paths;
    o.fresh_spp = spp;
    run.seed = seed;
    size_t n_rows = 0;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n_rows));
    for (size_t i = 0; i < n_rows; i++) {
        const struct imp_check_row *r = &rows[i];
        n.rows++;
        n.failed += !r->ok;
        if (!r->ok)
            printf("# %s %s step %g: %.9g against %.9g, error %.3g, limit %g\n",
                   r->method, r->param, r->step, r->value, r->reference, r->error,
                   r->limit);
        if (!strcmp(r->method, "frozen")) {
            n.frozen++;
            if (r->limit > 0) n.worst_frozen = fmax(n.worst_frozen, r->error);
        } else if (!strcmp(r->method, "fresh")) {
            n.fresh++;
            n.noisy += r->ok < 0;
            n.worst_z = fmax(n.worst_z, r->error);
            n.plain &= r->se == 0 || fabs(r->value - r->reference) == r->error * r->se ||
                       fabs(fabs(r->value - r->reference) / r->se / r->error - 1) < 1e-12;
        } else if (r->sees > 0) {
            n.density++;
            n.wrong_density += !r->ok;
            n.blind += r->ok < 0;
        } else if (!strcmp(r->method, "ends")) {
            n.ends++;
            n.worst_end = fmax(n.worst_end, r->error);
        } else if (!strcmp(r->method, "loss")) {
            n.loss++;
        } else {
            if (!strcmp(r->method, "dot")) n.dot++;
            else n.euler++;
            n.worst_exact = fmax(n.worst_exact, r->error);
        }
    }
    return n;
}

static void passes(imp_scene *s, const char *what, int paths, int spp, int frozen,
                   int euler, int fresh, int ends)
{
    imp_problem *p = NULL;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    double before[64], after[64];
    imp_problem_get_x(p, before);
    const struct counts n = check(p, paths, spp, 5);
    imp_problem_get_x(p, after);
    tap_ok(n.failed == 0 && n.frozen == frozen && n.dot == 1 && n.euler == euler &&
               n.fresh == fresh && n.plain && n.loss == 8 && n.ends == ends,
           "%s # frozen %d (worst %.1e), dot, euler %d (worst %.1e), "
           "fresh %d (worst z %.2f), ends %d (%.2f), failed %d, noisy %d",
           what, n.frozen, n.worst_frozen, n.euler, n.worst_exact, n.fresh, n.worst_z,
           n.ends, n.worst_end, n.failed, n.noisy);
    tap_ok(!memcmp(before, after, imp_problem_n_variables(p) * sizeof *before),
           "and leaves the scene alone");
    imp_problem_destroy(p);
}

/* The kind of a material with eval_d replaced. */
static void (*right_eval_d)(const struct imp_bsdf *, const imp_spec *,
                            const struct imp_dirs *, imp_spec *);
static void wrong_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d, imp_spec *df)
{
    right_eval_d(b, in, d, df);
    df[0] *= 1.001;
}

static void planted(void)
{
    imp_scene *s = scene_open(ctx, box_xml, IMP_RGB);
    imp_problem *p = NULL;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "red.*"));
    struct imp_bsdf *b = NULL;
    for (int i = 0; i < s->n_bsdfs; i++)
        if (s->bsdfs[i]->name && !strcmp(s->bsdfs[i]->name, "red")) b = s->bsdfs[i];
    if (!b) return;
    const struct imp_bsdf_ops *ops = b->ops;
    struct imp_bsdf_ops wrong = *ops;
    right_eval_d = ops->eval_d;
    wrong.eval_d = wrong_eval_d;
    b->ops = &wrong;
    const struct counts n = check(p, 100, 4, 5);
    b->ops = ops;
    tap_ok(n.failed >= 1 && fabs(n.worst_frozen - 1e-3) < 1e-4,
           "a derivative 0.1 %% off is caught # worst frozen error %.2e", n.worst_frozen);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* The kind of a material with a density that is not the one it draws with. */
static const struct imp_bsdf_ops *right_ops;
static double wrong_by;
static double wrong_pdf(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d)
{
    return wrong_by * right_ops->pdf(b, in, d);
}

/* Pictures and gradients are wrong alike then, and no difference is far off. */
static void wrong_densities(bool both_signs)
{
    static const char *const kinds[] = {"roughconductor", "diffuse"};
    imp_scene *s = test_scene(ctx, "textured.xml", IMP_RGB, "width=24 height=16");
    imp_problem *p = test_problem(ctx, s, "metal*");
    for (size_t k = 0; k < imp_count(kinds); k++)
        for (int sign = -1; sign <= 1; sign += 2) {
            if (!both_signs && sign == (k ? -1 : 1)) continue;
            struct imp_bsdf_ops wrong;
            for (int i = 0; i < s->n_bsdfs; i++)
                if (!strcmp(s->bsdfs[i]->ops->name, kinds[k]))
                    right_ops = s->bsdfs[i]->ops;
            wrong = *right_ops;
            wrong.pdf = wrong_pdf;
            wrong.pdf_eval = NULL;
            wrong_by = 1 + 0.03 * sign;
            for (int i = 0; i < s->n_bsdfs; i++)
                if (s->bsdfs[i]->ops == right_ops) s->bsdfs[i]->ops = &wrong;
            /* Default settings, but for the pictures of fresh differences. */
            const struct counts n = check(p, 0, 1, 5);
            for (int i = 0; i < s->n_bsdfs; i++)
                if (s->bsdfs[i]->ops == &wrong) s->bsdfs[i]->ops = right_ops;
            tap_ok(n.density >= 3 && n.wrong_density >= 1 && n.blind == 0,
                   "%s: a density times %g is caught # %d of %d", kinds[k], wrong_by,
                   n.wrong_density, n.density);
        }
    const struct counts n = check(p, 0, 1, 5);
    tap_ok(n.density >= 3 && !n.wrong_density, "and the right one is not");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Walks from a light whose density is not the one they are drawn with. */
static const struct imp_emitter_ops *right_light;
static bool wrong_emission(const struct imp_emitter *e, const struct imp_ball *scene,
                           const double u[4], struct imp_emission_sample *out)
{
    const bool drawn = right_light->sample_emission(e, scene, u, out);
    out->pdf_p *= wrong_by;
    return drawn;
}

/* No check of one end alone sees it: pictures and gradients are wrong alike. Walks of the
 * check itself begin at `from`; the texture has one row, of a direction. */
static void wrong_end(const char *file, const char *size, const char *active,
                      enum imp_from from, double by, size_t least)
{
    imp_scene *s = test_scene(ctx, file, IMP_RGB, size);
    imp_problem *p = test_problem(ctx, s, active);
    struct imp_emitter *light = s->emitters[0];
    if (!light->shape) light = s->emitters[1]; /* no sky */
    right_light = light->ops;
    struct imp_emitter_ops wrong = *right_light;
    wrong.sample_emission = wrong_emission;
    wrong_by = by;
    light->ops = &wrong;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows;
    size_t n, caught = 0, other = 0;
    run.from = from;
    o.paths = 20;
    o.fresh_spp = 32;
    o.only = "frozen,dot,euler,fresh,loss,ends"; /* rows that draw see it, too */
    for (int k = 0; k < 2; k++) {
        caught = other = 0;
        test_must(ctx, imp_check(p, &o, &run, &rows, &n));
        for (size_t i = 0; i < n; i++)
            *(strcmp(rows[i].method, "ends") ? &other : &caught) += rows[i].ok == 0;
        tap_ok(
            other == 0 && (k == 0 ? caught >= least : caught == 0),
            k == 0
                ? "%s from the %s: light drawn with another density is caught # %zu rows"
                : "%s from the %s: walks that are right are not # %zu rows",
            file, from == IMP_FROM_LIGHTS ? "lights" : "sensor", caught);
        light->ops = right_light;
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* At 2 samples per pixel most rows of this scene cannot be told from noise; 32 do. */
static void more_samples(void)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    imp_problem *p = test_problem(ctx, s, "*");
    const struct counts n = check(p, 20, 2, 5);
    tap_ok(n.fresh == 15 && n.failed == 0 && n.noisy <= 3,
           "rows that are noisy get more samples # %d of %d stay so", n.noisy, n.fresh);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A texture whose texels are at both bounds (a picture of black and white), which is also
 * the light: every row has its number, and none is held against an identity that is not
 * there. */
static void black_and_white(void)
{
    static const float texels[4] = {0, 1, 1, 0};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "texture", "bitmap", "paint", NULL);
    imp_scene_string(s, "filter_type", "nearest");
    imp_scene_image(s, 2, 2, 1, texels);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "orthographic", NULL, NULL);
    const double behind[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    imp_scene_transform(s, "to_world", behind);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 8);
    imp_scene_integer(s, "height", 8);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 3);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_ref(s, "paint", "reflectance");
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    const double above[16] = {1, 0, 0, 0, 0, 0, -1, 1, 0, 1, 0, 1, 0, 0, 0, 1};
    imp_scene_transform(s, "to_world", above);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_ref(s, "paint", "radiance");
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));

    imp_problem *p = test_problem(ctx, s, "paint.*");
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    size_t n = 0;
    bool fresh = false, identity = false;
    int failed = 0;
    o.paths = 100;
    o.fresh_spp = 256;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        failed += !rows[i].ok;
        if (!strcmp(rows[i].method, "euler")) identity = true;
        if (strcmp(rows[i].method, "fresh") != 0) continue;
        fresh = true;
        tap_ok(isfinite(rows[i].reference) && rows[i].reference != 0 && rows[i].ok == 1,
               "black and white texels have a difference # %g against %g", rows[i].value,
               rows[i].reference);
    }
    tap_ok(fresh && !identity && !failed, "a texture that is light and paint");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static int stop(const struct imp_progress *p, void *payload)
{
    (void)p, (void)payload;
    return 1;
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    ctx = test_context(0);
    imp_scene *s = test_scene(ctx, "stam.xml", IMP_MONO, "res=16");
    /* seven controls; emission, sphere, walls */
    passes(s, "Stam's box", 300, 256, 7 * 4, 3, 7, 0);
    imp_scene_destroy(s);
    if (is_long) {
        s = test_scene(ctx, "stam.xml", IMP_MONO,
                       "res=16 variant=reciprocal sampling=cosine");
        passes(s, "Stam's box, reciprocal, cosine sampling", 300, 64, 7 * 4, 3, 7, 0);
        imp_scene_destroy(s);
    }
    s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    /* white, red, green, lamp, light: three numbers each */
    passes(s, "Cornell box", 300, 32, 5 * 4, 1, 15, 16);
    imp_scene_destroy(s);
    s = scene_open(ctx, ball_xml, IMP_RGB);
    passes(s, "ball under a sky", 300, 64, 2 * 4, 1, 6, 0);

    /* Parameters that are exactly zero, and at an upper bound. */
    size_t k;
    test_must(ctx, imp_scene_find_param(s, "ball.reflectance.value", &k));
    test_must(ctx, imp_scene_set_values(s, k, 3, (double[]){0, 1, 0.5}));
    passes(s, "at the bounds", 300, 64, 2 * 4, 1, 6, 0);

    imp_problem *p = NULL;
    const struct imp_check_row *rows = NULL;
    size_t n_rows = 0;
    struct imp_run run = IMP_RUN_INIT;
    test_must(ctx, imp_problem_create(s, &p));
    tap_ok(imp_check(p, NULL, NULL, &rows, &n_rows) == IMP_E_ARG, "nothing active");
    test_must(ctx, imp_problem_activate(p, "*"));
    run.progress = stop;
    tap_ok(imp_check(p, NULL, &run, &rows, &n_rows) == IMP_CANCELLED && rows,
           "cancelled");
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    o.paths = -1;
    tap_ok(imp_check(p, &o, NULL, &rows, &n_rows) == IMP_E_ARG, "negative count # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    planted();
    more_samples();
    wrong_end("cornell.xml", "res=16", "*", IMP_FROM_LIGHTS, 1.15, 6);
    if (is_long) wrong_end("cornell.xml", "res=16", "*", IMP_FROM_SENSOR, 1.15, 5);
    wrong_end("textured.xml", "width=24 height=18", "floor.*", IMP_FROM_SENSOR, 0.5, 2);
    wrong_densities(is_long);
    black_and_white();
    imp_context_destroy(ctx);
    return tap_done();
}
