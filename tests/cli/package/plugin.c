/* SPDX-License-Identifier: Apache-2.0
 *
 * Kinds of a host: the material of the example, an environment, textures, a volume, a
 * phase function and a medium, against closed forms; and what is not registered. Compiled
 * against an installed tree. */
#define main example_main
#include "own_material.c"
#undef main
#include <stddef.h>
#include <stdlib.h>

static int n_tests, n_failed;
static void ok(int good, const char *text)
{
    n_tests++;
    n_failed += !good;
    printf("%sok %d - %s\n", good ? "" : "not ", n_tests, text);
}

/* ---- An environment: radiance gain max(0, w_z), w towards the light ------------- */

struct zenith {
    double gain, drawn; /* `drawn` follows the first number of radiance */
    int n_changed;
};
static const struct zenith *seen; /* of the scene made last */

static const struct imp_input_desc zenith_inputs[] = {
    {.name = "radiance", .role = IMP_EMISSION, .fallback = 1, .unit = "W m^-2 sr^-1"},
    {0}};

static enum imp_status zenith_build(const struct imp_build *b, void *self,
                                    struct imp_emitter *e)
{
    static const char *const words[] = {"up", "down"};
    struct zenith *z = self;
    double axis[3], m[16];
    int64_t n;
    int word;
    bool on;
    const char *text;
    enum imp_status st = imp_build_float(b, "gain", 1, &z->gain);
    if (st == IMP_OK) st = imp_build_choice(b, "side", words, 2, 0, &word);
    if (st == IMP_OK) st = imp_build_vector(b, "axis", (double[3]){0, 0, 1}, axis);
    if (st == IMP_OK) st = imp_build_transform(b, "to_world", m);
    if (st == IMP_OK) st = imp_build_int(b, "count", 3, 0, 9, &n);
    if (st == IMP_OK) st = imp_build_bool(b, "on", true, &on);
    if (st == IMP_OK) st = imp_build_string(b, "text", "none", &text);
    if (st != IMP_OK) return st;
    if (word != 0 || axis[2] != 1 || m[0] != 1 || n != 3 || !on ||
        strcmp(text, "none") != 0 || imp_build_color_mode(b) != IMP_RGB)
        return imp_build_error(b, NULL, IMP_E_SCENE, "defaults are wrong");
    if (z->gain < 0)
        return imp_build_error(b, "gain", IMP_E_SCENE, "gain = %g is negative", z->gain);
    double *own = imp_build_alloc(b, 1, sizeof *own);
    if (!own || *own != 0) return imp_build_error(b, NULL, IMP_E_NOMEM, "no memory");
    z->drawn = e->input[0]->value[0];
    seen = z;
    return IMP_OK;
}
static void zenith_changed(const struct imp_emitter *e)
{
    struct zenith *z = e->self;
    z->drawn = e->input[0]->value[0];
    z->n_changed++;
}
static void zenith_eval_d(const struct imp_emitter *e, const imp_spec *in,
                          const struct imp_emission *x, imp_spec *dle)
{
    (void)in;
    const struct zenith *z = e->self;
    imp_spec_fill(dle, x->d[2] < 0 ? z->gain * -x->d[2] : 0);
}
static void zenith_eval(const struct imp_emitter *e, const imp_spec *in,
                        const struct imp_emission *x, imp_spec *le)
{
    zenith_eval_d(e, in, x, le);
    *le *= in[0];
}
static bool zenith_sample(const struct imp_emitter *e, const imp_v3 *ref,
                          const double u[2], struct imp_light_sample *out)
{
    (void)e, (void)ref;
    const double r = sqrt(u[0]), phi = 2 * pi * u[1], z = sqrt(1 - u[0]);
    *out = (struct imp_light_sample){.wi = (imp_v3){r * cos(phi), r * sin(phi), z},
                                     .dist = INFINITY,
                                     .pdf = z / pi,
                                     .cos_light = 1};
    return z > 0;
}
static double zenith_pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                         const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)e, (void)ref, (void)hit, (void)at;
    const imp_v3 up = {0, 0, 1};
    return fmax(0, imp_v3_dot(wi, &up)) / pi;
}
static const struct imp_emitter_ops zenith = {.size = sizeof(struct imp_emitter_ops),
                                              .name = "zenith",
                                              .object_size = sizeof(struct zenith),
                                              .flags = IMP_EMITTER_ENVIRONMENT,
                                              .inputs = zenith_inputs,
                                              .build = zenith_build,
                                              .eval = zenith_eval,
                                              .eval_d = zenith_eval_d,
                                              .sample = zenith_sample,
                                              .pdf = zenith_pdf,
                                              .changed = zenith_changed};

/* ---- A texture: one number a times u ------------------------------------------- */

struct ramp {
    float a;
};
static enum imp_status ramp_build(const struct imp_build *b, void *self,
                                  struct imp_texture *t)
{
    struct ramp *r = self;
    const size_t one = 1;
    double a;
    enum imp_status st = imp_build_float(b, "a", 1, &a);
    r->a = (float)a;
    if (st == IMP_OK)
        st = imp_build_texels(b, "slope", &r->a, 1, &one, IMP_PARAM_DIFFERENTIABLE, 0, 1,
                              &t->param);
    return st;
}
static void ramp_eval(const struct imp_texture *t, const struct imp_texcoord *at,
                      bool scalar, imp_spec *value)
{
    (void)scalar;
    const struct ramp *r = t->self;
    imp_spec_fill(value, (double)r->a * at->uv[0]);
}
static void ramp_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    (void)scalar;
    const imp_spec d = *bar * at->uv[0];
    sink->add(sink, t->param, 0, 1, &d);
}
static void ramp_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                         bool scalar, imp_dot_fn *dot, const void *x_dot,
                         imp_spec *value_dot)
{
    (void)scalar;
    imp_spec_fill(value_dot, dot(x_dot, t->param, 0) * at->uv[0]);
}
static const struct imp_texture_ops ramp = {.size = sizeof(struct imp_texture_ops),
                                            .name = "ramp",
                                            .object_size = sizeof(struct ramp),
                                            .build = ramp_build,
                                            .eval = ramp_eval,
                                            .scatter = ramp_scatter,
                                            .tangent = ramp_tangent};

/* ---- A texture of textures: a/4 + 3 b/4 ------------------------------------------ */

static const struct imp_input_desc blend_inputs[] = {
    {.name = "a", .role = IMP_REFLECTANCE, .fallback = 0.5, .hi = 1, .unit = "1"},
    {.name = "b", .role = IMP_REFLECTANCE, .fallback = 0.5, .hi = 1, .unit = "1"},
    {0}};
static enum imp_status blend_build(const struct imp_build *b, void *self,
                                   struct imp_texture *t)
{
    (void)b, (void)self;
    t->param = -1;
    return IMP_OK;
}
static void blend_eval(const struct imp_texture *t, const struct imp_texcoord *at,
                       bool scalar, imp_spec *value)
{
    imp_spec a, b;
    imp_input_eval(t->input[0], at, scalar, &a);
    imp_input_eval(t->input[1], at, scalar, &b);
    *value = a * 0.25 + b * 0.75;
}
static void blend_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                          bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    const imp_spec a = *bar * 0.25, b = *bar * 0.75;
    imp_input_scatter(t->input[0], at, scalar, &a, sink);
    imp_input_scatter(t->input[1], at, scalar, &b, sink);
}
static void blend_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                          bool scalar, imp_dot_fn *dot, const void *x_dot,
                          imp_spec *value_dot)
{
    imp_spec a, b;
    imp_input_tangent(t->input[0], at, scalar, dot, x_dot, &a);
    imp_input_tangent(t->input[1], at, scalar, dot, x_dot, &b);
    *value_dot = a * 0.25 + b * 0.75;
}
static const struct imp_texture_ops blend = {.size = sizeof(struct imp_texture_ops),
                                             .name = "blend",
                                             .object_size = 1,
                                             .inputs = blend_inputs,
                                             .build = blend_build,
                                             .eval = blend_eval,
                                             .scatter = blend_scatter,
                                             .tangent = blend_tangent};

/* ---- A volume: z times a number, in the unit cube ---------------------------------- */

static enum imp_status layers_build(const struct imp_build *b, void *self,
                                    struct imp_texture *t)
{
    struct ramp *r = self;
    const size_t one = 1;
    double a;
    enum imp_status st = imp_build_float(b, "a", 1, &a);
    r->a = (float)a;
    if (st == IMP_OK)
        st = imp_build_texels(b, "slope", &r->a, 1, &one, IMP_PARAM_DIFFERENTIABLE, 0, 8,
                              &t->param);
    return st;
}
static double height(const struct imp_texcoord *at)
{
    for (int k = 0; k < 3; k++)
        if (at->p[k] < 0 || at->p[k] > 1) return 0;
    return at->p[2];
}
static void layers_eval(const struct imp_texture *t, const struct imp_texcoord *at,
                        bool scalar, imp_spec *value)
{
    (void)scalar;
    const struct ramp *r = t->self;
    imp_spec_fill(value, (double)r->a * height(at));
}
static void layers_scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                           bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    (void)scalar;
    const imp_spec d = *bar * height(at);
    sink->add(sink, t->param, 0, 1, &d);
}
static void layers_tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                           bool scalar, imp_dot_fn *dot, const void *x_dot,
                           imp_spec *value_dot)
{
    (void)scalar;
    imp_spec_fill(value_dot, dot(x_dot, t->param, 0) * height(at));
}
static void layers_bound(const struct imp_texture *t, const imp_v3 *lo, const imp_v3 *hi,
                         bool scalar, imp_spec *most)
{
    (void)lo, (void)scalar;
    const struct ramp *r = t->self;
    imp_spec_fill(most, (double)r->a * fmin(fmax((*hi)[2], 0), 1));
}
static void layers_extent(const struct imp_texture *t, double to_unit[12], int cells[3])
{
    (void)t;
    for (int k = 0; k < 12; k++) to_unit[k] = k % 5 == 0;
    cells[0] = cells[1] = 1;
    cells[2] = 4;
}
static const struct imp_texture_ops layers = {.size = sizeof(struct imp_texture_ops),
                                              .name = "layers",
                                              .object_size = sizeof(struct ramp),
                                              .build = layers_build,
                                              .eval = layers_eval,
                                              .scatter = layers_scatter,
                                              .tangent = layers_tangent,
                                              .bound = layers_bound,
                                              .extent = layers_extent};

/* ---- A phase function: (1 + b c)/(4 pi), c the cosine of the turn ------------------- */

static const struct imp_input_desc tilted_inputs[] = {
    {.name = "b", .role = IMP_UNBOUNDED, .fallback = 0.5, .lo = -1, .hi = 1, .unit = "1"},
    {0}};
static void tilted_eval(const struct imp_phase *p, const imp_spec *in,
                        const struct imp_dirs *d, imp_spec *f)
{
    (void)p;
    *f = (1 + in[0] * imp_phase_cos(d)) * (1 / (4 * pi));
}
static double tilted_pdf(const struct imp_phase *p, const imp_spec *in,
                         const struct imp_dirs *d)
{
    (void)p;
    return (1 + in[0][0] * imp_phase_cos(d)) / (4 * pi);
}
static void tilted_eval_d(const struct imp_phase *p, const imp_spec *in,
                          const struct imp_dirs *d, imp_spec *df)
{
    (void)p, (void)in;
    imp_spec_fill(df, imp_phase_cos(d) / (4 * pi));
}
/* The inverse of the cumulative density (1 + c)/2 - b (1 - c^2)/4. */
static void tilted_sample(const struct imp_phase *p, const imp_spec *in,
                          const double u[3], struct imp_dirs *d)
{
    (void)p;
    const double b = in[0][0], root = sqrt(0.25 - b * (0.5 - b / 4 - u[1]));
    const double c = b == 0 ? 2 * u[1] - 1 : (root - 0.5) / (b / 2);
    const imp_v3 along = -d->wo;
    imp_about(&along, fmin(fmax(c, -1), 1), u[2], &d->wi);
}
static const struct imp_phase_ops tilted = {.size = sizeof(struct imp_phase_ops),
                                            .name = "tilted",
                                            .object_size = 1,
                                            .inputs = tilted_inputs,
                                            .sample = tilted_sample,
                                            .eval = tilted_eval,
                                            .pdf = tilted_pdf,
                                            .eval_d = tilted_eval_d};

/* ---- A medium that scatters the part `white` of what it takes ------------------------ */

static const struct imp_input_desc haze_inputs[] = {
    {.name = "density",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_VOLUME | IMP_INPUT_EXTINCTION,
     .fallback = 1,
     .unit = "1/length"},
    {.name = "white", .role = IMP_REFLECTANCE, .fallback = 1, .hi = 1, .unit = "1"},
    {0}};
static void haze_eval(const struct imp_medium *m, const imp_spec *in,
                      struct imp_coefficients *c)
{
    (void)m;
    c->extinction = in[0];
    c->scattering = in[0] * in[1];
    imp_spec_fill(&c->emission, 0);
}
static void haze_eval_d(const struct imp_medium *m, const imp_spec *in,
                        struct imp_coefficients *dc)
{
    (void)m;
    memset(dc, 0, 2 * sizeof *dc);
    imp_spec_fill(&dc[0].extinction, 1);
    dc[0].scattering = in[1];
    dc[1].scattering = in[0];
}
static const struct imp_medium_ops haze = {.size = sizeof(struct imp_medium_ops),
                                           .name = "haze",
                                           .object_size = 1,
                                           .inputs = haze_inputs,
                                           .eval = haze_eval,
                                           .eval_d = haze_eval_d};

/* ---- A medium whose extinction falls with its input: that of docs/kinds.md --------- */

#include "mist.c"

static const double contrast = 3.912; /* -ln 0.02 */

/* ---- Scenes -------------------------------------------------------------------- */

enum { W = 8, N = W * W };

static const char scene_text[] =
    "<scene version='3.0.0'><integrator type='direct'/>"
    "<sensor type='orthographic'><transform name='to_world'>"
    "<scale value='0.1'/><lookat origin='3.4641016151377544,0,2' target='0,0,0' "
    "up='0,0,1'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/><rfilter type='box'/></film>"
    "<sampler type='independent'><integer name='sample_count' value='1024'/></sampler>"
    "</sensor>"
    "<shape type='rectangle'><bsdf type='minnaert' id='dust'>%s"
    "<float name='darkening' value='2'/></bsdf></shape>"
    "<emitter type='zenith' id='sky'><float name='radiance' value='1'/>%s"
    "</emitter></scene>";

static enum imp_status load(imp_context *ctx, const char *reflectance, const char *light,
                            imp_scene **out)
{
    char text[2048];
    *out = NULL;
    snprintf(text, sizeof text, scene_text, reflectance, light);
    return imp_scene_load_string(ctx, text, strlen(text), "plate.xml", NULL, out);
}

/* A unit cube of haze before a sky of 1, seen along z. */
static const char haze_text[] =
    "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
    "value='%d'/></integrator>"
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.1'/>"
    "<lookat origin='.5,.5,-2' target='.5,.5,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/><rfilter type='box'/></film>"
    "<sampler type='independent'><integer name='sample_count' value='1024'/></sampler>"
    "</sensor><emitter type='constant'/>"
    "<shape type='cube'><transform name='to_world'><scale value='.6'/>"
    "<translate x='.5' y='.5' z='.5'/></transform><bsdf type='null'/>"
    "<medium type='haze' id='fog' name='interior'><volume type='layers' name='density'>"
    "<float name='a' value='1.5'/></volume><float name='white' value='%g'/>"
    "<phase type='tilted' id='turn'><float name='b' value='.6'/></phase></medium>"
    "</shape></scene>";

/* The same of mist with this visibility and density. */
static const char mist_text[] =
    "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "
    "value='%d'/></integrator>"
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.1'/>"
    "<lookat origin='.5,.5,-2' target='.5,.5,0' up='0,1,0'/></transform>"
    "<film type='hdrfilm'><integer name='width' value='8'/>"
    "<integer name='height' value='8'/><rfilter type='box'/></film>"
    "<sampler type='independent'><integer name='sample_count' value='1024'/></sampler>"
    "</sensor><emitter type='constant'/>"
    "<shape type='cube'><transform name='to_world'><scale value='.5'/>"
    "<translate x='.5' y='.5' z='.5'/></transform><bsdf type='null'/>"
    "<medium type='mist' id='fog' name='interior'>%s%s<float name='albedo' value='%g'/>"
    "</medium></shape></scene>";

/* Mean of red and its derivatives by the first number of each parameter, within 4
 * standard errors. */
static void compare(imp_scene *scene, const char *what, double value, size_t n_active,
                    size_t n, const char *const *name, const double *derivative)
{
    char text[200];
    imp_film *film = NULL;
    imp_problem *p = NULL;
    struct imp_run run = IMP_RUN_INIT;
    float seed[3 * N];
    double g[8] = {0}, se[8] = {0}, mean = 0, var = 0;
    enum imp_status st = imp_render(scene, &run, &film);
    for (int i = 0; st == IMP_OK && i < N; i++) {
        mean += (double)imp_film_mean(film)[3 * i] / N;
        var += pow((double)imp_film_se(film)[3 * i] / N, 2);
    }
    snprintf(text, sizeof text, "%s: mean %.5f (se %.1e), closed form %.5f", what, mean,
             sqrt(var), value);
    ok(st == IMP_OK && var < 1e-5 && fabs(mean - value) < 4 * sqrt(var) + 1e-6, text);

    for (int i = 0; i < 3 * N; i++) seed[i] = i % 3 == 0 ? 1.0f / N : 0;
    if (st == IMP_OK) st = imp_problem_create(scene, &p);
    for (size_t k = 0; k < n && st == IMP_OK; k++) st = imp_problem_activate(p, name[k]);
    snprintf(text, sizeof text, "%s: %zu numbers are active", what,
             imp_problem_n_variables(p));
    ok(st == IMP_OK && imp_problem_n_variables(p) == n_active, text);
    if (st == IMP_OK) st = imp_problem_reverse(p, seed, &run, g, se);
    for (size_t k = 0; k < n; k++) {
        snprintf(text, sizeof text, "%s: derivative by %s %.5f (se %.1e), %.5f", what,
                 name[k], g[k], se[k], derivative[k]);
        ok(st == IMP_OK && se[k] < 1e-2 && fabs(g[k] - derivative[k]) < 4 * se[k] + 1e-6,
           text);
    }

    /* Forward along all active numbers: the reverse gradients added up. */
    double x_dot[8], forward = 0, reverse = 0;
    imp_film *tangent = NULL;
    for (size_t k = 0; k < n_active; k++) x_dot[k] = 1, reverse += g[k];
    if (st == IMP_OK) st = imp_problem_forward(p, x_dot, &run, &tangent);
    for (int i = 0; st == IMP_OK && i < N; i++)
        forward += (double)imp_film_mean(tangent)[3 * i] / N;
    snprintf(text, sizeof text, "%s: forward %.9f, reverse %.9f", what, forward, reverse);
    ok(st == IMP_OK && fabs(forward - reverse) <= 1e-6 * fabs(reverse) + 1e-7, text);
    imp_film_destroy(tangent);
    imp_problem_destroy(p);
    imp_film_destroy(film);
}

/* What passes a length of 1: T = exp(-3.912 d/V), dT/dV = 3.912 d T/V^2; and white mist
 * before a sky of 1, which is 1 for every V. */
static void falling(imp_context *ctx, const char *density, double d, const char *what)
{
    static const char *const by[] = {"fog.visibility.value"};
    const double V = 4, T = exp(-contrast * d / V);
    char text[2048];
    imp_scene *scene = NULL;
    for (int white = 0; white < 2; white++) {
        snprintf(text, sizeof text, mist_text, white ? -1 : 1,
                 "<float name='visibility' value='4'/>", density, (double)white);
        enum imp_status st =
            imp_scene_load_string(ctx, text, strlen(text), "mist.xml", NULL, &scene);
        ok(st == IMP_OK, imp_last_error(ctx));
        if (st == IMP_OK)
            compare(scene, what, white ? 1 : T, 1, 1, by,
                    (double[]){white ? 0 : contrast * d * T / (V * V)});
        const struct imp_selftest_row *row;
        size_t n;
        if (st == IMP_OK) st = imp_selftest(scene, IMP_SELFTEST_MEDIUM, NULL, &row, &n);
        ok(st == IMP_OK && n > 0, "selftest of mist");
        for (size_t k = 0; st == IMP_OK && k < n; k++) {
            snprintf(text, sizeof text, "%s: selftest %s, %g", what, row[k].contract,
                     row[k].error);
            ok(row[k].ok == 1, text);
        }
        imp_scene_destroy(scene);
    }
}

/* Mist that does not say that it falls may have a volume for its visibility: its bounds are
 * too low, which selftest sees. */
static void falling_unsaid(imp_context *ctx)
{
    char text[2048];
    imp_scene *scene = NULL;
    const struct imp_selftest_row *row;
    size_t n;
    bool seen_low = false;
    snprintf(
        text, sizeof text, mist_text, 1,
        "<volume type='layers' name='visibility'><float name='a' value='3'/></volume>",
        "", 1.);
    memcpy(strstr(text, "'mist'"), "'blur'", 6);
    enum imp_status st =
        imp_scene_load_string(ctx, text, strlen(text), "blur.xml", NULL, &scene);
    ok(st == IMP_OK, imp_last_error(ctx));
    if (st == IMP_OK) st = imp_selftest(scene, IMP_SELFTEST_MEDIUM, NULL, &row, &n);
    for (size_t k = 0; st == IMP_OK && k < n; k++)
        seen_low |= strcmp(row[k].contract, "bounded") == 0 && row[k].ok == 0;
    ok(seen_low, "an extinction that falls and does not say so is above its bound");
    imp_scene_destroy(scene);
}

static void falling_not(imp_context *ctx)
{
    char text[2048];
    imp_scene *scene = NULL;
    snprintf(
        text, sizeof text, mist_text, 1,
        "<texture type='ramp' name='visibility'><float name='a' value='1'/></texture>",
        "", 1.);
    const enum imp_status st =
        imp_scene_load_string(ctx, text, strlen(text), "mist.xml", NULL, &scene);
    ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "no known lower bound"),
       imp_last_error(ctx));
}

static void refused(imp_context *ctx, enum imp_status st, const char *message)
{
    char text[400];
    snprintf(text, sizeof text, "refused: '%s': %s", message, imp_last_error(ctx));
    ok(st == IMP_E_ARG && strstr(imp_last_error(ctx), message), text);
}

/* The layout of another header: `change` in the size of the struct. */
static enum imp_status of_another(imp_context *ctx, const char *name, int change,
                                  int version)
{
    const struct imp_kinds_layout *here = imp_kinds_of_library();
    struct imp_struct_size sizes[64];
    const struct imp_kinds_layout there = {version, here->n, sizes};
    bool found = false;
    for (int i = 0; i < here->n; i++) {
        sizes[i] = here->structs[i];
        if (strcmp(sizes[i].name, name) != 0) continue;
        sizes[i].size += (size_t)change;
        found = true;
    }
    ok(found || version != IMP_KINDS_VERSION, name);
    return imp_register_kind(ctx, IMP_CONCEPT_BSDF, &minnaert, &there);
}

static void layouts(void)
{
    static const char *const grow[] = {
        "imp_ball",    "imp_bsdf",   "imp_emission",   "imp_emission_sample",
        "imp_emitter", "imp_input",  "imp_medium",     "imp_phase",
        "imp_round",   "imp_sensor", "imp_sensor_ray", "imp_sensor_sample",
        "imp_shape",   "imp_texture"};
    static const char *const stay[] = {
        "imp_attribute", "imp_carried",         "imp_coefficients", "imp_curves",
        "imp_dirs",      "imp_emitter_profile", "imp_film_desc",    "imp_filter",
        "imp_hit",       "imp_input_desc",      "imp_light_sample", "imp_located",
        "imp_sink",      "imp_surface",         "imp_texcoord",     "imp_triangles"};
    const int version = IMP_KINDS_VERSION;
    char text[200];
    imp_context *ctx;
    for (int i = 0; i < 14; i++) {
        if (imp_context_create(NULL, &ctx) != IMP_OK) return;
        snprintf(text, sizeof text, "layout: struct %s has ", grow[i]);
        refused(ctx, of_another(ctx, grow[i], 8, version), text);
        ok(of_another(ctx, grow[i], -8, version) == IMP_OK, grow[i]);
        imp_context_destroy(ctx);
    }
    if (imp_context_create(NULL, &ctx) != IMP_OK) return;
    for (int i = 0; i < 16; i++)
        for (int change = -8; change <= 8; change += 16) {
            snprintf(text, sizeof text, "layout: struct %s has ", stay[i]);
            refused(ctx, of_another(ctx, stay[i], change, version), text);
        }
    snprintf(text, sizeof text, "of version %d, and this library with version %d",
             version + 1, version);
    refused(ctx, of_another(ctx, "", 0, version + 1), text);
    refused(ctx, of_another(ctx, "imp_surface", 8, version + 1), text);
    struct imp_struct_size unknown = {"imp_later", 8};
    struct imp_kinds_layout there = {version, 1, &unknown};
    refused(ctx, imp_register_kind(ctx, IMP_CONCEPT_BSDF, &minnaert, &there),
            "struct imp_later has 8 bytes there and 0 here");
    unknown.name = NULL;
    refused(ctx, imp_register_kind(ctx, IMP_CONCEPT_BSDF, &minnaert, &there),
            "struct 0 has no name");
    there.n = 0;
    refused(ctx, imp_register_kind(ctx, IMP_CONCEPT_BSDF, &minnaert, &there),
            "layout has no sizes");
    refused(ctx,
            imp_register_kind(ctx, (enum imp_concept)99, &minnaert, imp_kinds_here()),
            "concept is 99");
    refused(ctx, imp_register_kind(ctx, IMP_CONCEPT_BSDF, &minnaert, NULL),
            "layout is NULL");
    imp_context_destroy(ctx);
}

int main(void)
{
    imp_context *ctx, *other;
    imp_scene *scene;
    layouts();
    if (imp_context_create(NULL, &ctx) != IMP_OK ||
        imp_context_create(NULL, &other) != IMP_OK)
        return 99;

    struct imp_bsdf_ops b = minnaert;
    b.size = sizeof b + 8;
    refused(ctx, imp_register_bsdf(ctx, &b), "another kinds.h");
    b.size = offsetof(struct imp_bsdf_ops, eval_d);
    refused(ctx, imp_register_bsdf(ctx, &b), "has no eval_d");
    b.size = 3;
    refused(ctx, imp_register_bsdf(ctx, &b), "size 3 of ops");
    b = minnaert, b.pdf = NULL;
    refused(ctx, imp_register_bsdf(ctx, &b), "has no pdf");
    b = minnaert, b.name = "diffuse";
    refused(ctx, imp_register_bsdf(ctx, &b), "built-in");
    b = minnaert, b.name = "two words";
    refused(ctx, imp_register_bsdf(ctx, &b), "a name is");
    b = minnaert, b.emit = (void (*)(const struct imp_bsdf *, const imp_spec *,
                                     const imp_v3 *, imp_spec *))abort;
    refused(ctx, imp_register_bsdf(ctx, &b), "only one of emit and emit_d");
    b = minnaert, b.min_children = 3;
    refused(ctx, imp_register_bsdf(ctx, &b), "children");
    struct imp_emitter_ops e = zenith;
    e.pdf = NULL;
    refused(ctx, imp_register_emitter(ctx, &e), "has no pdf");

    b = minnaert;
    b.size = offsetof(struct imp_bsdf_ops, emit); /* an older header's */
    ok(imp_register_bsdf(ctx, &b) == IMP_OK, "a shorter table with all that is required");
    refused(ctx, imp_register_bsdf(ctx, &minnaert), "registered already");
    ok(imp_register_emitter(ctx, &zenith) == IMP_OK, "an emitter");
    ok(imp_register_texture(ctx, &ramp) == IMP_OK, "a texture");
    ok(imp_register_texture(ctx, &blend) == IMP_OK, "a texture with inputs");
    ok(imp_register_volume(ctx, &layers) == IMP_OK, "a volume");
    ok(imp_register_phase(ctx, &tilted) == IMP_OK, "a phase function");
    ok(imp_register_medium(ctx, &haze) == IMP_OK, "a medium");
    ok(imp_register_medium(ctx, &mist) == IMP_OK, "a medium that thins");
    refused(ctx, imp_register_volume(ctx, &layers), "registered already");
    refused(ctx, imp_register_phase(ctx, &tilted), "registered already");
    refused(ctx, imp_register_medium(ctx, &haze), "registered already");
    struct imp_phase_ops no_pdf = tilted;
    no_pdf.pdf = NULL;
    refused(ctx, imp_register_phase(ctx, &no_pdf), "has no pdf");
    struct imp_medium_ops no_d = haze;
    no_d.eval_d = NULL;
    refused(ctx, imp_register_medium(ctx, &no_d), "has no eval_d");
    struct imp_medium_ops other_way = mist;
    struct imp_input_desc falls[] = {mist_inputs[0], {0}};
    other_way.inputs = falls;
    falls[0].flags = IMP_INPUT_FALLS;
    refused(ctx, imp_register_medium(ctx, &other_way), "IMP_INPUT_FALLS goes with");
    falls[0].flags = IMP_INPUT_FALLS | IMP_INPUT_EXTINCTION | IMP_INPUT_VOLUME;
    refused(ctx, imp_register_medium(ctx, &other_way), "IMP_INPUT_FALLS goes with");
    other_way.name = "blur";
    struct imp_input_desc unsaid[] = {
        mist_inputs[0], mist_inputs[1], mist_inputs[2], {0}};
    other_way.inputs = unsaid;
    unsaid[0].flags = IMP_INPUT_EXTINCTION | IMP_INPUT_VOLUME;
    ok(imp_register_medium(ctx, &other_way) == IMP_OK, "mist that does not say it falls");
    struct imp_texture_ops t = ramp;
    struct imp_input_desc two[] = {blend_inputs[0], blend_inputs[0], {0}};
    t.inputs = two;
    refused(ctx, imp_register_texture(ctx, &t), "two inputs 'a'");
    two[1].flags = IMP_INPUT_LUMINANCE;
    refused(ctx, imp_register_texture(ctx, &t), "IMP_INPUT_LUMINANCE in a texture");
    refused(ctx, imp_register_volume(ctx, &t), "IMP_INPUT_LUMINANCE in a texture");
    two[1].name = "b";
    refused(ctx, imp_register_texture(ctx, &t), "no input 'b' before its luminance");
    t = ramp;
    t.name = "minnaert";
    ok(imp_register_texture(ctx, &t) == IMP_OK, "another concept, the same name");

    const double rho = 0.8, k = 2, base = (k + 1) / (k + 2) * pow(0.5, k - 1);
    const char *const names[] = {"dust.reflectance.value", "dust.darkening.value",
                                 "sky.radiance.value"};
    /* L = rho (k + 1)/(k + 2) cos_o^(k - 1) gain, gain = 2, cos_o = 1/2 */
    enum imp_status st = load(ctx, "<float name='reflectance' value='0.8'/>",
                              "<float name='gain' value='2'/>", &scene);
    ok(st == IMP_OK, imp_last_error(ctx));
    if (st == IMP_OK)
        compare(scene, "own material and light", 2 * rho * base, 5, 3, names,
                (double[]){2 * base,
                           2 * rho * base * (1 / (k + 1) - 1 / (k + 2) + log(0.5)),
                           2 * rho * base});

    size_t at;
    if (st == IMP_OK) st = imp_scene_find_param(scene, names[2], &at);
    if (st == IMP_OK) st = imp_scene_set_values(scene, at, 1, (double[]){3});
    ok(st == IMP_OK && seen->n_changed == 1 && seen->drawn == 3, "changed is called");
    if (st == IMP_OK) st = imp_scene_set_values(scene, at, 1, (double[]){3});
    ok(st == IMP_OK && seen->n_changed == 1, "and not where nothing changed");
    refused(ctx, imp_register_sensor(ctx, NULL), "ops is NULL");
    ok(imp_register_bsdf(NULL, &minnaert) == IMP_E_ARG, "no context");
    b = minnaert, b.name = "late";
    refused(ctx, imp_register_bsdf(ctx, &b), "after a scene");
    imp_scene_destroy(scene);

    /* u is 1/2 in the middle of the picture, and the picture is symmetric about it */
    st = load(ctx,
              "<texture name='reflectance' type='ramp'><float name='a' value='0.5'/>"
              "</texture>",
              "", &scene);
    ok(st == IMP_OK, imp_last_error(ctx));
    const char *const slope[] = {"dust.reflectance.slope"};
    if (st == IMP_OK)
        compare(scene, "own texture", 0.25 * base, 1, 1, slope, (double[]){0.5 * base});
    imp_scene_destroy(scene);

    /* a is s u, of mean s/2: s/8 + 3 b/4 */
    st = load(ctx,
              "<texture name='reflectance' type='blend'>"
              "<texture name='a' type='ramp'><float name='a' value='0.8'/></texture>"
              "<rgb name='b' value='0.6,0.2,0.4'/></texture>",
              "", &scene);
    ok(st == IMP_OK, imp_last_error(ctx));
    const char *const blended[] = {"dust.reflectance.a.slope",
                                   "dust.reflectance.b.value"};
    if (st == IMP_OK)
        compare(scene, "own texture of textures", (0.1 + 0.45) * base, 4, 2, blended,
                (double[]){base / 8, 0.75 * base});
    imp_scene_destroy(scene);

    /* What passes straight through: T = exp(-a/2), a = 1.5. */
    char text[2048];
    const double T = exp(-0.75);
    const char *const numbers[] = {"fog.density.slope", "turn.b.value"};
    snprintf(text, sizeof text, haze_text, 1, 0.5);
    st = imp_scene_load_string(ctx, text, strlen(text), "haze.xml", NULL, &scene);
    ok(st == IMP_OK, imp_last_error(ctx));
    if (st == IMP_OK)
        compare(scene, "own medium and volume", T, 2, 2, numbers, (double[]){-T / 2, 0});
    imp_scene_destroy(scene);

    /* What absorbs nothing under a sky of 1 is 1, whichever way it scatters. */
    snprintf(text, sizeof text, haze_text, -1, 1.);
    st = imp_scene_load_string(ctx, text, strlen(text), "haze.xml", NULL, &scene);
    ok(st == IMP_OK, imp_last_error(ctx));
    if (st == IMP_OK)
        compare(scene, "own phase function", 1, 2, 2, numbers, (double[]){0, 0});
    imp_scene_destroy(scene);

    falling(ctx, "", 1, "mist, the same everywhere");
    falling(ctx,
            "<volume type='layers' name='density'><float name='a' value='3'/></volume>",
            1.5, "mist in layers");
    falling_not(ctx);
    falling_unsaid(ctx);

    st = load(ctx, "", "<float name='gain' value='-1'/>", &scene);
    ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), "plate.xml:1:") &&
           strstr(imp_last_error(ctx), "'sky' (zenith): gain = -1 is negative"),
       imp_last_error(ctx));
    st = load(ctx, "", "<float name='gainn' value='1'/>", &scene);
    ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), "did you mean 'gain'"),
       imp_last_error(ctx));
    st = load(other, "", "", &scene);
    ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(other), "no such bsdf; it has"),
       "another context does not have them");
    imp_context_destroy(other);
    imp_context_destroy(ctx);
    printf("1..%d\n", n_tests);
    return n_failed != 0;
}
