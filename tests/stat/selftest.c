/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_selftest: all that is built in keeps its contracts, and kinds that break one, each
 * registered as a host would, are caught by that row and by no other that need not. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/build.h"
#include "math/warp.h"

/* ---- Broken materials: diffuse, but for one thing -------------------------------- */

static const struct imp_bsdf_ops *diffuse(void)
{
    for (int k = 0; imp__bsdf_kinds[k]; k++)
        if (strcmp(imp__bsdf_kinds[k]->name, "diffuse") == 0) return imp__bsdf_kinds[k];
    return NULL;
}
static double small_pdf(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d)
{
    return 0.97 * diffuse()->pdf(b, in, d);
}
static double tilted_pdf(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d)
{
    return diffuse()->pdf(b, in, d) * (1 + 0.2 * (d->wi[2] - 2.0 / 3));
}
static bool gap_sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                       struct imp_dirs *d)
{
    return diffuse()->sample(b, in, u, d) && d->wi[0] < 0.7;
}
static double gap_pdf(const struct imp_bsdf *b, const imp_spec *in,
                      const struct imp_dirs *d)
{
    return d->wi[0] < 0.7 ? diffuse()->pdf(b, in, d) : 0;
}
static void horizon_eval(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d, imp_spec *f)
{
    diffuse()->eval(b, in, d, f);
    *f /= d->wi[2] / d->wi[2]; /* 0/0 along the surface */
}
static void bright_eval(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *f)
{
    diffuse()->eval(b, in, d, f);
    *f *= 2.5;
}
static void bright_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d, imp_spec *df)
{
    diffuse()->eval_d(b, in, d, df);
    *df *= 2.5;
}
static void wrong_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d, imp_spec *df)
{
    diffuse()->eval_d(b, in, d, df);
    *df *= 1.00001;
}
static void oneway_eval(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *f)
{
    diffuse()->eval(b, in, d, f);
    *f *= 0.5 + 0.5 * d->wo[2] * d->wo[2];
}
static void oneway_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d, imp_spec *df)
{
    diffuse()->eval_d(b, in, d, df);
    *df *= 0.5 + 0.5 * d->wo[2] * d->wo[2];
}

struct broken {
    const char *name, *rows; /* that must not be ok */
};
static const struct broken broken[] = {{"small_pdf", "normalised draws albedo"},
                                       {"tilted_pdf", "draws albedo"},
                                       {"gap", "covers albedo"},
                                       {"horizon", "finite"},
                                       {"bright", "energy"},
                                       {"wrong_d", "derivative"},
                                       {"oneway", "reciprocal"},
                                       {"diffuse", ""}};

static void broken_register(imp_context *ctx)
{
    struct imp_bsdf_ops ops = *diffuse();
    ops.name = "small_pdf", ops.pdf = small_pdf;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
    ops = *diffuse(), ops.name = "tilted_pdf", ops.pdf = tilted_pdf;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
    ops = *diffuse(), ops.name = "gap", ops.pdf = gap_pdf, ops.sample = gap_sample;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
    ops = *diffuse(), ops.name = "horizon", ops.eval = horizon_eval;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
    ops = *diffuse(), ops.name = "bright", ops.eval = bright_eval,
    ops.eval_d = bright_eval_d;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
    ops = *diffuse(), ops.name = "wrong_d", ops.eval_d = wrong_eval_d;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
    ops = *diffuse(), ops.name = "oneway", ops.eval = oneway_eval,
    ops.eval_d = oneway_eval_d;
    test_must(ctx, imp_register_bsdf(ctx, &ops));
}

/* ---- Broken lights and cameras ---------------------------------------------------- */

static const struct imp_emitter_ops *constant(void)
{
    for (int k = 0; imp__emitter_kinds[k]; k++)
        if (strcmp(imp__emitter_kinds[k]->name, "constant") == 0)
            return imp__emitter_kinds[k];
    return NULL;
}
static bool upper_sample(const struct imp_emitter *e, const imp_v3 *ref,
                         const double u[2], struct imp_light_sample *out)
{
    if (!constant()->sample(e, ref, u, out)) return false;
    out->wi[2] = fabs(out->wi[2]);
    return true;
}
static const struct imp_sensor_ops *perspective(void)
{
    for (int k = 0; imp__sensor_kinds[k]; k++)
        if (strcmp(imp__sensor_kinds[k]->name, "perspective") == 0)
            return imp__sensor_kinds[k];
    return NULL;
}
static void long_ray(const struct imp_sensor *s, double px, double py,
                     const double lens[2], struct imp_sensor_ray *out)
{
    perspective()->ray(s, px, py, lens, out);
    out->d *= 1 + 1e-6;
}

static bool listed(const char *list, const char *word)
{
    const char *at = strstr(list, word);
    return at && (at[strlen(word)] == ' ' || at[strlen(word)] == 0);
}

static void caught(const struct imp_selftest_row *rows, size_t n, const char *object,
                   const char *expected)
{
    bool right = true;
    size_t seen = 0;
    char found[200] = "";
    for (size_t k = 0; k < n; k++) {
        if (strcmp(rows[k].object, object) != 0) continue;
        seen++;
        if (rows[k].ok == 1) continue;
        const size_t used = strlen(found);
        snprintf(found + used, sizeof found - used, "%s%s", used ? " " : "",
                 rows[k].contract);
    }
    for (size_t k = 0; k < n; k++)
        if (strcmp(rows[k].object, object) == 0)
            right &= (rows[k].ok == 1) == !listed(expected, rows[k].contract);
    tap_ok(right && seen > 0, "%s: %s # found: %s", object,
           *expected ? expected : "nothing", *found ? found : "nothing");
}

static void planted(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *s;
    const struct imp_selftest_row *rows;
    size_t n;
    broken_register(ctx);
    struct imp_emitter_ops upper = *constant();
    struct imp_sensor_ops longer = *perspective();
    upper.name = "upper", upper.sample = upper_sample;
    longer.name = "longer", longer.ray = long_ray;
    test_must(ctx, imp_register_emitter(ctx, &upper));
    test_must(ctx, imp_register_sensor(ctx, &longer));
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "sensor", "longer", "camera", NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "emitter", "upper", "sky", NULL);
    imp_scene_end(s);
    for (size_t k = 0; k < imp_count(broken); k++) {
        imp_scene_begin(s, "shape", "sphere", NULL, NULL);
        imp_scene_begin(s, "bsdf", broken[k].name, broken[k].name, NULL);
        imp_scene_float(s, "reflectance", 0.6);
        imp_scene_end(s);
        imp_scene_end(s);
    }
    test_must(ctx, imp_scene_commit(s));
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_MATERIAL, NULL, &rows, &n));
    for (size_t k = 0; k < imp_count(broken); k++)
        caught(rows, n, broken[k].name, broken[k].rows);
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_LIGHT, NULL, &rows, &n));
    caught(rows, n, "sky", "draws");
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_CAMERA, NULL, &rows, &n));
    caught(rows, n, "camera", "unit");

    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    o.samples = 1000;
    enum imp_status st = imp_selftest(s, IMP_SELFTEST_LIGHT, &o, &rows, &n);
    tap_ok(st == IMP_E_ARG, "too few samples # %s", imp_last_error(ctx));
    st = imp_selftest(s, (enum imp_selftest_subject)17, NULL, &rows, &n);
    tap_ok(st == IMP_E_ARG, "no such subject # %s", imp_last_error(ctx));
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* ---- Broken media ------------------------------------------------------------------ */

static const struct imp_phase_ops *isotropic(void)
{
    for (int k = 0; imp__phase_kinds[k]; k++)
        if (strcmp(imp__phase_kinds[k]->name, "isotropic") == 0)
            return imp__phase_kinds[k];
    return NULL;
}
static const struct imp_medium_ops *homogeneous(void)
{
    for (int k = 0; imp__medium_kinds[k]; k++)
        if (strcmp(imp__medium_kinds[k]->name, "homogeneous") == 0)
            return imp__medium_kinds[k];
    return NULL;
}
static double half_phase_pdf(const struct imp_phase *p, const imp_spec *in,
                             const struct imp_dirs *d)
{
    return 0.5 * isotropic()->pdf(p, in, d);
}
static void bright_medium_eval(const struct imp_medium *m, const imp_spec *in,
                               struct imp_coefficients *c)
{
    homogeneous()->eval(m, in, c);
    c->scattering = c->extinction * 1.01;
}
static void slanted_eval_d(const struct imp_medium *m, const imp_spec *in,
                           struct imp_coefficients *dc)
{
    homogeneous()->eval_d(m, in, dc);
    dc[0].extinction *= 1.001;
}

static void broken_media(void)
{
    imp_context *ctx = test_context(1);
    struct imp_phase_ops half = *isotropic();
    struct imp_medium_ops bright = *homogeneous(), slanted = *homogeneous();
    half.name = "half";
    half.pdf = half_phase_pdf;
    bright.name = "bright";
    bright.eval = bright_medium_eval;
    slanted.name = "slanted";
    slanted.eval_d = slanted_eval_d;
    test_must(ctx, imp_register_phase(ctx, &half));
    test_must(ctx, imp_register_medium(ctx, &bright));
    test_must(ctx, imp_register_medium(ctx, &slanted));
    static const char *const media[3][2] = {
        {"homogeneous", "half"}, {"bright", "isotropic"}, {"slanted", "isotropic"}};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "volpath", NULL, NULL);
    imp_scene_end(s);
    for (int k = 0; k < 3; k++) {
        const double at[3] = {3. * k, 0, 0};
        imp_scene_begin(s, "shape", "sphere", NULL, NULL);
        imp_scene_vector(s, "center", at);
        imp_scene_begin(s, "medium", media[k][0], media[k][0], "interior");
        imp_scene_begin(s, "phase", media[k][1], NULL, NULL);
        imp_scene_end(s);
        imp_scene_end(s);
        imp_scene_begin(s, "bsdf", "null", NULL, NULL);
        imp_scene_end(s);
        imp_scene_end(s);
    }
    test_must(ctx, imp_scene_commit(s));
    const struct imp_selftest_row *rows;
    size_t n, wrong[2] = {0, 0};
    bool caught[3] = {false, false, false};
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_PHASE, NULL, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        if (strcmp(rows[k].kind, "half") == 0)
            caught[0] |= rows[k].ok == 0 && strcmp(rows[k].contract, "normalised") == 0;
        else wrong[0] += rows[k].ok == 0;
    }
    test_must(ctx, imp_selftest(s, IMP_SELFTEST_MEDIUM, NULL, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        if (rows[k].ok != 0) continue;
        if (strcmp(rows[k].kind, "bright") == 0 && strcmp(rows[k].contract, "part") == 0)
            caught[1] = true;
        else if (strcmp(rows[k].kind, "slanted") == 0 &&
                 strcmp(rows[k].contract, "derivative") == 0)
            caught[2] = true;
        else wrong[1] += strcmp(rows[k].kind, "bright") != 0;
    }
    tap_ok(caught[0] && caught[1] && caught[2] && wrong[0] + wrong[1] == 0,
           "broken phase functions and media are caught # %d %d %d, others %zu %zu",
           caught[0], caught[1], caught[2], wrong[0], wrong[1]);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* ---- Honest scenes ----------------------------------------------------------------- */

static void honest(imp_context *ctx, const char *file, enum imp_color_mode mode)
{
    static const char *const names[] = {"materials", "lights", "cameras",
                                        "phase functions", "media"};
    imp_scene *s = test_scene(ctx, file, mode, NULL);
    struct imp_selftest_options o = IMP_SELFTEST_OPTIONS_INIT;
    o.samples = 60000;
    for (int subject = 0; subject < 5; subject++) {
        const struct imp_selftest_row *rows;
        size_t n, failed = 0;
        test_must(ctx,
                  imp_selftest(s, (enum imp_selftest_subject)subject, &o, &rows, &n));
        for (size_t k = 0; k < n; k++) {
            if (rows[k].ok != 0) continue;
            failed++;
            printf("# %s (%s) %s: %g, %g +- %g, error %g, limit %g\n", rows[k].object,
                   rows[k].kind, rows[k].contract, rows[k].value, rows[k].reference,
                   rows[k].se, rows[k].error, rows[k].limit);
        }
        tap_ok(failed == 0, "%s%s: %s # %zu rows", file,
               mode == IMP_MONO       ? ", mono"
               : mode == IMP_SPECTRAL ? ", spectral"
                                      : "",
               names[subject], n);
    }
    imp_scene_destroy(s);
}

int main(void)
{
    planted();
    broken_media();
    imp_context *ctx = test_context(1);
    honest(ctx, "cornell.xml", IMP_RGB);
    honest(ctx, "stam.xml", IMP_MONO);
    honest(ctx, "lamps.xml", IMP_RGB);
    honest(ctx, "fog.xml", IMP_RGB);
    honest(ctx, "fog.xml", IMP_SPECTRAL);
    static const char *const peers[] = {"lights", "rough",  "glass",    "sensors",
                                        "sky",    "alphas", "textures", "twosided"};
    for (size_t k = 0; k < imp_count(peers); k++) {
        char file[100];
        snprintf(file, sizeof file, "../tests/render/peer/%s.xml", peers[k]);
        honest(ctx, file, k % 3 == 2 ? IMP_MONO : IMP_RGB);
    }
    imp_context_destroy(ctx);
    return tap_done();
}
