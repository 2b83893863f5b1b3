/* SPDX-License-Identifier: Apache-2.0
 *
 * One limit for inputs: kinds of a host with 25, 64 and 65 of them. Up to IMP_INPUTS_MAX
 * every value arrives and every derivative is that of a closed form; more are refused. A
 * material, a light and a medium are weighted sums of their inputs, sum c_j x_j. */
#include "imp_kinds.h"
#include "imp_scene.h"
#include "imp_tap.h"

#define MOST   (IMP_INPUTS_MAX + 1)
#define ALBEDO 8  /* of the medium, and no part of its sum */
#define HIGH   40 /* above the bits of an int */

static char names[MOST][8];
static struct imp_input_desc inputs[MOST + 1], of_medium[MOST + 1];
static int n; /* inputs at present */

static double share(int j) { return (1.0 + j % 7) / (4.0 * n); }

static void declare(int count)
{
    n = count;
    memset(inputs, 0, sizeof inputs);
    for (int j = 0; j < n; j++) {
        snprintf(names[j], sizeof names[j], "x%d", j);
        inputs[j] = (struct imp_input_desc){.name = names[j],
                                            .role = IMP_UNBOUNDED,
                                            .flags = IMP_INPUT_SCALAR,
                                            .fallback = 0.5,
                                            .unit = "1"};
    }
    memcpy(of_medium, inputs, sizeof inputs);
    for (int j = 0; j < n; j++)
        if (j != ALBEDO) of_medium[j].flags |= IMP_INPUT_EXTINCTION | IMP_INPUT_AFFINE;
    of_medium[ALBEDO].role = IMP_REFLECTANCE;
    of_medium[ALBEDO].hi = 1;
}

static double sum(const imp_spec *in)
{
    double s = 0;
    for (int j = 0; j < n; j++) s += share(j) * in[j][0];
    return s;
}

/* ---- A material: Lambert's with the sum for a reflectance ------------------------- */

static double cosine(const struct imp_dirs *d)
{
    return d->wo[2] > 0 && d->wi[2] > 0 ? d->wi[2] * IMP_INV_PI : 0;
}
static bool bsdf_sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                        struct imp_dirs *d)
{
    (void)b, (void)in;
    d->wi = imp__cosine_hemisphere(u + 1);
    d->lobe = IMP_SMOOTH;
    return cosine(d) > 0;
}
static void bsdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                      const struct imp_dirs *d, imp_spec *f)
{
    (void)b;
    *f = imp__spec(sum(in) * cosine(d));
}
static double bsdf_pdf(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d)
{
    (void)b, (void)in;
    return cosine(d);
}
static void bsdf_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *df)
{
    (void)b, (void)in;
    for (int j = 0; j < n; j++) df[j] = imp__spec(share(j) * cosine(d));
}
static const struct imp_bsdf_ops material = {.size = sizeof material,
                                             .name = "many",
                                             .inputs = inputs,
                                             .sample = bsdf_sample,
                                             .eval = bsdf_eval,
                                             .pdf = bsdf_pdf,
                                             .eval_d = bsdf_eval_d};

/* ---- A light: the same from everywhere --------------------------------------------- */

static enum imp_status light_build(const struct imp_build *b, void *self,
                                   struct imp_emitter *e)
{
    (void)b, (void)self;
    if (n > HIGH) e->fixed = UINT64_C(1) << HIGH;
    return IMP_OK;
}
static void light_eval(const struct imp_emitter *e, const imp_spec *in,
                       const struct imp_emission *x, imp_spec *le)
{
    (void)e, (void)x;
    *le = imp__spec(sum(in));
}
static void light_eval_d(const struct imp_emitter *e, const imp_spec *in,
                         const struct imp_emission *x, imp_spec *dle)
{
    (void)e, (void)in, (void)x;
    for (int j = 0; j < n; j++) dle[j] = imp__spec(share(j));
}
static bool light_sample(const struct imp_emitter *e, const imp_v3 *ref,
                         const double u[2], struct imp_light_sample *out)
{
    (void)e, (void)ref;
    *out = (struct imp_light_sample){.wi = imp__uniform_sphere(u),
                                     .dist = INFINITY,
                                     .pdf = IMP_INV_PI / 4,
                                     .cos_light = 1};
    return true;
}
static double light_pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                        const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)e, (void)ref, (void)wi, (void)hit, (void)at;
    return IMP_INV_PI / 4;
}
static const struct imp_emitter_ops light = {.size = sizeof light,
                                             .name = "many",
                                             .object_size = 1,
                                             .flags = IMP_EMITTER_ENVIRONMENT,
                                             .inputs = inputs,
                                             .build = light_build,
                                             .eval = light_eval,
                                             .eval_d = light_eval_d,
                                             .sample = light_sample,
                                             .pdf = light_pdf};

/* ---- A medium: the sum without x_8 for an extinction, x_8 for an albedo --------------- */

static void medium_eval(const struct imp_medium *m, const imp_spec *in,
                        struct imp_coefficients *c)
{
    (void)m;
    c->extinction = imp__spec(sum(in) - share(ALBEDO) * in[ALBEDO][0]);
    c->scattering = c->extinction * in[ALBEDO];
    c->emission = imp__spec(0);
}
static void medium_eval_d(const struct imp_medium *m, const imp_spec *in,
                          struct imp_coefficients *dc)
{
    struct imp_coefficients c;
    medium_eval(m, in, &c);
    for (int j = 0; j < n; j++) {
        dc[j] = (struct imp_coefficients){{0}, {0}, {0}};
        dc[j].extinction = imp__spec(j == ALBEDO ? 0 : share(j));
        dc[j].scattering = j == ALBEDO ? c.extinction : dc[j].extinction * in[ALBEDO];
    }
}
static const struct imp_medium_ops medium = {.size = sizeof medium,
                                             .name = "many",
                                             .object_size = 1,
                                             .inputs = of_medium,
                                             .eval = medium_eval,
                                             .eval_d = medium_eval_d};

/* ---- Scenes -------------------------------------------------------------------------- */

#define SEEN(height)                                                                     \
    "<sensor type='orthographic'><transform name='to_world'><scale value='.1'/>"         \
    "<lookat origin='0,0," height "' target='0,0,0' up='0,1,0'/></transform>"            \
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "      \
    "value='4'/><rfilter type='box'/></film></sensor>"

/* Value of the picture, and its derivative by every input of object `id`. */
static void compare(imp_context *ctx, imp_scene *s, const char *id, double value,
                    double (*derivative)(int j), const char *what)
{
    enum { PIXELS = 16 };
    struct imp_run run = IMP_RUN_INIT;
    float seed[PIXELS];
    double g[MOST] = {0}, se[MOST] = {0}, worst = 0, mean = 0, error = 0;
    imp_problem *p = NULL;
    imp_film *film = NULL;
    char name[64];
    bool right = true;
    run.spp = 256;
    test_must(ctx, imp_render(s, &run, &film));
    for (int i = 0; i < PIXELS; i++) {
        mean += (double)imp_film_mean(film)[i] / PIXELS;
        error += pow((double)imp_film_se(film)[i] / PIXELS, 2);
        seed[i] = 1.0f / PIXELS;
    }
    tap_ok(fabs(mean - value) < 4 * sqrt(error) + 1e-6, "%d inputs, %s # %.6f, %.6f", n,
           what, mean, value);
    for (int j = 0; j < n; j++) { /* each alone: what is not derived by is left out */
        size_t at;
        struct imp_param_info info = {.size = sizeof info};
        snprintf(name, sizeof name, "%s.x%d.value", id, j);
        test_must(ctx, imp_scene_find_param(s, name, &at));
        test_must(ctx, imp_scene_get_param(s, at, &info));
        const bool fixed = j == HIGH && strcmp(id, "sky") == 0;
        right &= fixed == !(info.flags & IMP_PARAM_DIFFERENTIABLE);
        if (fixed) continue;
        test_must(ctx, imp_problem_create(s, &p));
        test_must(ctx, imp_problem_activate(p, name));
        test_must(ctx, imp_problem_reverse(p, seed, &run, &g[j], &se[j]));
        imp_problem_destroy(p);
        worst = fmax(worst, fabs(g[j] - derivative(j)) / (4.5 * se[j] + 1e-6));
    }
    tap_ok(right, "%d inputs, %s: fixed where its build says so", n, what);
    tap_ok(worst < 1, "%d inputs, %s: all derivatives # worst %.3g of its limit", n, what,
           worst);
    imp_film_destroy(film);
}

static double of_sum(int j) { return share(j); }
static double through; /* exp(-extinction) */
static double of_through(int j) { return j == ALBEDO ? 0 : -share(j) * through; }
static double of_nothing(int j) { return j == ALBEDO ? NAN : 0; } /* NAN: not compared */

static void scenes(int count)
{
    static const char plate[] = "<scene version='3.0.0'><integrator type='direct'/>" SEEN(
        "2") "<shape type='rectangle'><bsdf type='many' id='dust'/></shape>"
             "<emitter type='constant'><float name='radiance' "
             "value='1'/></emitter></scene>";
    static const char sky[] = "<scene version='3.0.0'><integrator type='direct'/>" SEEN(
        "2") "<emitter type='many' id='sky'/></scene>";
    /* A length of 1 along the rays. What it scatters comes back from the sky of 1: with
     * albedo 1 the picture is 1. */
    static const char cube[] =
        "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
        "value='%d'/></integrator>" SEEN(
            "4") "<emitter type='constant'/><shape type='cube'><transform "
                 "name='to_world'>"
                 "<scale value='.5'/></transform><bsdf type='null'/><medium type='many' "
                 "id='fog' "
                 "name='interior'><float name='x8' value='%d'/></medium></shape></scene>";
    imp_context *ctx = test_context(1);
    imp_spec in[MOST];
    char text[2048];
    declare(count);
    test_must(ctx, imp_register_bsdf(ctx, &material));
    test_must(ctx, imp_register_emitter(ctx, &light));
    test_must(ctx, imp_register_medium(ctx, &medium));
    for (int j = 0; j < n; j++) in[j] = imp__spec(inputs[j].fallback);
    imp_scene *s = test_scene_text(ctx, plate, IMP_MONO);
    compare(ctx, s, "dust", sum(in), of_sum, "material");
    imp_scene_destroy(s);
    s = test_scene_text(ctx, sky, IMP_MONO);
    compare(ctx, s, "sky", sum(in), of_sum, "light");
    imp_scene_destroy(s);
    for (int albedo = 0; albedo < 2; albedo++) {
        snprintf(text, sizeof text, cube, albedo ? -1 : 1, albedo);
        through = exp(-(sum(in) - share(ALBEDO) * in[ALBEDO][0]));
        s = test_scene_text(ctx, text, IMP_MONO);
        if (albedo) compare(ctx, s, "fog", 1, of_nothing, "white medium");
        else compare(ctx, s, "fog", through, of_through, "black medium");
        imp_scene_destroy(s);
    }
    imp_context_destroy(ctx);
}

/* What every test of materials does with a kind. */
static void visited(int count)
{
    struct kind_factory f;
    struct imp_bsdf b;
    imp_spec in[IMP_INPUTS_MAX], df[IMP_INPUTS_MAX], value;
    declare(count);
    if (!kinds_open(&f)) return;
    const bool made = kind_make(&f, &material, NULL, 0, NULL, 0, &b);
    if (count > IMP_INPUTS_MAX)
        tap_ok(!made, "a kind of %d inputs is not visited", count);
    if (made) {
        const struct imp_dirs d = {.wo = {0, 0, 1}, .wi = {0, 0, 1}, .lobe = IMP_SMOOTH};
        kind_inputs(&b, KIND_RANDOM, 3, in);
        b.ops->eval(&b, in, &d, &value);
        b.ops->eval_d(&b, in, &d, df);
        for (int j = 0; j < b.n_in; j++) value -= df[j] * in[j];
        tap_ok(b.n_in == count && fabs(value[0]) < 1e-12,
               "a kind of %d inputs is visited", count);
    }
    kinds_close(&f);
}

static void refused(imp_context *ctx, enum imp_status st, const char *what)
{
    char sentence[64];
    snprintf(sentence, sizeof sentence, "65 inputs; at most %d", IMP_INPUTS_MAX);
    tap_ok(st == IMP_E_ARG && strstr(imp_last_error(ctx), sentence), "%s # %s", what,
           imp_last_error(ctx));
}
static void too_many(void)
{
    imp_context *ctx = test_context(1);
    struct imp_phase_ops phase = {.size = sizeof phase, .name = "many", .inputs = inputs};
    struct imp_texture_ops t = {.size = sizeof t, .name = "many", .inputs = inputs};
    declare(MOST);
    refused(ctx, imp_register_bsdf(ctx, &material), "a material");
    refused(ctx, imp_register_emitter(ctx, &light), "a light");
    refused(ctx, imp_register_medium(ctx, &medium), "a medium");
    /* Functions are not called before the inputs are counted. */
    phase.sample = (void (*)(const struct imp_phase *, const imp_spec *, const double *,
                             struct imp_dirs *))abort;
    phase.eval = (void (*)(const struct imp_phase *, const imp_spec *,
                           const struct imp_dirs *, imp_spec *))abort;
    phase.eval_d = phase.eval;
    phase.pdf = (double (*)(const struct imp_phase *, const imp_spec *,
                            const struct imp_dirs *))abort;
    refused(ctx, imp_register_phase(ctx, &phase), "a phase function");
    t.eval = (void (*)(const struct imp_texture *, const struct imp_texcoord *, bool,
                       imp_spec *))abort;
    t.scatter = (void (*)(const struct imp_texture *, const struct imp_texcoord *, bool,
                          const imp_spec *, struct imp_sink *))abort;
    t.tangent = (void (*)(const struct imp_texture *, const struct imp_texcoord *, bool,
                          imp_dot_fn *, const void *, imp_spec *))abort;
    refused(ctx, imp_register_texture(ctx, &t), "a texture");
    refused(ctx, imp_register_volume(ctx, &t), "a volume");
    t.inputs = NULL;
    t.place = (void (*)(const struct imp_texture *, double *, bool))abort;
    tap_ok(imp_register_volume(ctx, &t) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "'many' has place, but no gradient"),
           "a place without a gradient # %s", imp_last_error(ctx));
    t.gradient = (bool (*)(const struct imp_texture *, const struct imp_texcoord *, bool,
                           imp_spec *))abort;
    tap_ok(imp_register_volume(ctx, &t) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "'many' has place, but no extent"),
           "a place without an extent # %s", imp_last_error(ctx));
    imp_context_destroy(ctx);
}

int main(void)
{
    visited(25);
    visited(IMP_INPUTS_MAX);
    visited(MOST);
    scenes(25);
    scenes(IMP_INPUTS_MAX);
    too_many();
    return tap_done();
}
