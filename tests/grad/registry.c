/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients of every parameter of every kind of the tables: each material, light and
 * texture in a room lit directly and indirectly, through every integrator that has
 * derivatives, in colour, in mono and by wavelengths. For each of its parameters
 *
 *   frozen   sweep against central differences of recorded walks, 1e-6; forward against
 *            reverse per walk, 1e-12; Euler identities, 1e-12 (imp_check)
 *   dot      forward picture against reverse gradient of the same seed
 *   fresh    forward picture against differences of renders with other seeds: z-scores,
 *            at random values, with one number at its lower bound (0) and at its upper
 *            bound (of a material inside another: in the long run)
 *
 * A new kind is tested by existing: its inputs are drawn from what it declares. Of pairs of a
 * material with a texture or with a material inside, every second one waits for the long run.
 *
 *     registry [short|long [CASE]]    long: every number by itself; CASE as printed */
#include "imp_kinds.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/hash.h"
#include "vol_write.h"
#include <unistd.h>

#define SIDE    5
#define BATCHES 12

static const char *const mode_names[] = {"rgb", "mono", "spectral", "single"};
static bool is_long;
static const char *only; /* cases whose name begins so */
static imp_context *ctx;
static char measured[64], rgl[64]; /* files that kinds of tables can read */
static double worst_z, worst_frozen, worst_dot;
static int n_z, n_frozen;

/* Inputs not given, by configuration, with the reason. */
static const struct {
    const char *kind, *input, *prop, *why;
} left_out[] = {
    {"roughconductor", "alpha_u", NULL, "given by alpha"},
    {"roughconductor", "alpha_v", NULL, "given by alpha"},
    {"roughconductor", "alpha", "alpha_u", "given by alpha_u and alpha_v"},
    {"roughconductor", "eta", "material", "given by the preset"},
    {"roughconductor", "k", "material", "given by the preset"},
    {"roughdielectric", "alpha_u", NULL, "given by alpha"},
    {"roughdielectric", "alpha_v", NULL, "given by alpha"},
    {"roughdielectric", "alpha", "alpha_u", "given by alpha_u and alpha_v"},
    {"principled", "eta", NULL, "given by specular"},
    {"principled", "specular", "eta", "given by eta"},
    {"conductor", "eta", "material", "given by the preset"},
    {"conductor", "k", "material", "given by the preset"},
    {"hair", "eumelanin", NULL, "given by sigma_a"},
    {"hair", "pheomelanin", NULL, "given by sigma_a"},
};

static bool config_has(const char *const *props, const char *name)
{
    const size_t n = strlen(name);
    for (int i = 0; props && i < 6 && props[i]; i++)
        if (strncmp(props[i], name, n) == 0 && props[i][n] == '=') return true;
    return false;
}

static bool is_left_out(const char *kind, const char *const *props, const char *input)
{
    if (config_has(props, input)) return false;
    for (size_t i = 0; i < imp_count(left_out); i++)
        if (strcmp(left_out[i].kind, kind) == 0 &&
            strcmp(left_out[i].input, input) == 0 &&
            (!left_out[i].prop ? !config_has(props, input)
                               : config_has(props, left_out[i].prop)))
            return true;
    return false;
}

/* What has no derivative where facets of GGX transmit, and what is not there. */
static bool is_fixed(const struct imp_bsdf_ops *ops, const char *const *props,
                     const char *input)
{
    const bool index = strcmp(input, "eta") == 0 || strcmp(input, "specular") == 0;
    if (strcmp(ops->name, "roughdielectric") == 0)
        return index && config_has(props, "distribution") &&
               strcmp(props[0], "distribution=ggx") == 0;
    if (strcmp(ops->name, "principled") != 0) return false;
    return props && strcmp(props[0], "spec_trans=0") == 0
               ? strcmp(input, "spec_trans") == 0
               : index;
}

/* ---- The subject --------------------------------------------------------------- */

struct subject {
    const struct imp_bsdf_ops *bsdf, *back; /* one of these; back: twosided's second */
    const struct imp_emitter_ops *emitter;
    const char *const *props;              /* configuration of the material */
    const struct imp_texture_ops *texture; /* on all its inputs, or NULL */
    bool nested;                           /* the texture's own inputs are textures too */
};

/* By wavelengths three numbers are lifted to a reflectance, which is cut at 1, those of eta and k too (as
 * in Mitsuba): the slope above is 0, and differences would go across. */
static bool lifted;

static double random_in(const struct imp_input_desc *d, uint64_t seed, uint32_t k)
{
    const double u = imp__u01(imp__key(seed, 4, 4), k);
    double lo = d->lo, hi = d->lo == 0 && d->hi == 0 ? INFINITY : d->hi;
    if (isfinite(hi) && hi <= 1 && lo <= 0.05) { /* reflectances, roughnesses */
        lo = fmax(lo, 0.25);
        hi = 0.75;
        return lo + u * (hi - lo);
    }
    if (lifted && d->role != IMP_EMISSION &&
        !(d->flags & (IMP_INPUT_SCALAR | IMP_INPUT_NUMBER)))
        return 0.4 + 0.3 * u;
    const double typical = d->fallback > 0 ? d->fallback : 1;
    return imp_clamp(typical * (0.6 + 0.8 * u), lo, hi);
}

/* Volumes are files, which are read when a scene is made. */
static char grid_file[64][64];
static int n_grids;
static void grid_make(imp_scene *s, const char *slot, const float cells[24])
{
    const double room[16] = {2, 0, 0, -1, 0, 2, 0, -1, 0, 0, 2, -1, 0, 0, 0, 1};
    char *path = grid_file[n_grids++ % 64];
    vol_write(path, 2, 2, 2, 3, cells);
    imp_scene_begin(s, "volume", "gridvolume", NULL, slot);
    imp_scene_string(s, "filename", path);
    imp_scene_transform(s, "to_world", room);
    imp_scene_end(s);
}
static void grids_remove(void)
{
    while (n_grids > 0) remove(grid_file[--n_grids % 64]);
}
/* Numbers of a mesh are tested by grad/attributes. */
static bool of_meshes(const struct imp_texture_ops *t)
{
    return strcmp(t->name, "attribute") == 0 || strcmp(t->name, "mesh_attribute") == 0;
}
static bool is_volume(const struct imp_texture_ops *t)
{
    return t->inputs && t->inputs[0].flags & IMP_INPUT_VOLUME;
}

static void texture_make(imp_scene *s, const struct subject *q, const char *slot,
                         const struct imp_input_desc *d, uint64_t seed, bool outer)
{
    int first = 0;
    while (of_meshes(imp__texture_kinds[first])) first++;
    const struct imp_texture_ops *t = outer ? q->texture : imp__texture_kinds[first];
    imp_scene_begin(s, "texture", t->name, NULL, slot);
    if (strcmp(t->name, "bitmap") == 0) {
        float pixels[3 * 3 * 3];
        for (uint32_t k = 0; k < 27; k++) pixels[k] = (float)random_in(d, seed, 100 + k);
        imp_scene_image(s, 3, 3, 3, pixels);
        if (d->flags & IMP_INPUT_SCALAR || d->role != IMP_REFLECTANCE)
            imp_scene_bool(s, "raw", 1);
    }
    for (int j = 0; t->inputs && t->inputs[j].name; j++) {
        struct imp_input_desc e = t->inputs[j];
        double v[3];
        const bool volume = e.flags & IMP_INPUT_VOLUME;
        if (d->role != IMP_REFLECTANCE) e.fallback = d->fallback;
        else if (d->flags & IMP_INPUT_SCALAR) e.fallback = fmin(e.fallback, 0.5);
        for (uint32_t k = 0; k < 3; k++)
            v[k] = random_in(&e, seed, 50 + 3 * (uint32_t)j + k);
        if (volume) {
            float cells[3 * 8];
            for (uint32_t k = 0; k < 24; k++)
                cells[k] = (float)random_in(d, seed, 100 + k);
            grid_make(s, t->inputs[j].name, cells);
        } else if (q->nested && outer)
            texture_make(s, q, t->inputs[j].name, &e, seed + 7 + (uint64_t)j, false);
        else if (d->flags & IMP_INPUT_SCALAR) imp_scene_float(s, t->inputs[j].name, v[0]);
        else imp_scene_rgb(s, t->inputs[j].name, v);
    }
    imp_scene_end(s);
}

static void inputs_make(imp_scene *s, const struct subject *q, const char *kind_name,
                        const char *const *props, const struct imp_input_desc *inputs,
                        bool textures, uint64_t seed)
{
    for (int j = 0; inputs && inputs[j].name; j++) {
        const struct imp_input_desc *d = &inputs[j];
        double v[3];
        if (d->flags & IMP_INPUT_FIXED || config_has(props, d->name)) continue;
        if (is_left_out(kind_name, props, d->name)) continue;
        if (d->flags & (IMP_INPUT_LUMINANCE | IMP_INPUT_WAVELENGTH | IMP_INPUT_COMPONENT))
            continue;
        if (d->flags & (IMP_INPUT_VECTOR | IMP_INPUT_BUMP)) continue; /* bsdf_make's */
        for (uint32_t k = 0; k < 3; k++) v[k] = random_in(d, seed, 3 * (uint32_t)j + k);
        if (strcmp(d->name, "eta") == 0 && d->flags & IMP_INPUT_NUMBER &&
            strncmp(kind_name, "principled", 10) != 0) {
            if (config_has(props, "int_ior")) continue; /* that is how it is written */
            imp_scene_float(s, "int_ior", fmax(v[0], 1.1));
            imp_scene_float(s, "ext_ior", 1);
        } else if (textures && q->texture && !(d->flags & IMP_INPUT_NUMBER))
            texture_make(s, q, d->name, d, seed + (uint64_t)j, true);
        else if (d->flags & IMP_INPUT_SCALAR) imp_scene_float(s, d->name, v[0]);
        else imp_scene_rgb(s, d->name, v);
    }
}

static void props_make(imp_scene *s, const char *const *props)
{
    for (int i = 0; props && i < 6 && props[i]; i++) {
        char name[64], *end;
        const char *eq = strchr(props[i], '=');
        snprintf(name, sizeof name, "%.*s", (int)(eq - props[i]), props[i]);
        const double number = strtod(eq + 1, &end);
        if (!*end) imp_scene_float(s, name, number);
        else if (strcmp(eq + 1, "true") == 0 || strcmp(eq + 1, "false") == 0)
            imp_scene_bool(s, name, eq[1] == 't');
        else imp_scene_string(s, name, eq + 1);
    }
}

static const struct imp_bsdf_ops *kind(const char *name)
{
    int k = 0;
    while (strcmp(imp__bsdf_kinds[k]->name, name) != 0) k++;
    return imp__bsdf_kinds[k];
}

static void bsdf_make(imp_scene *s, const struct subject *q,
                      const struct imp_bsdf_ops *ops, const char *id, uint64_t seed)
{
    imp_scene_begin(s, "bsdf", ops->name, id, NULL);
    if (ops->max_children) {
        if (strcmp(ops->name, "twosided") == 0)
            imp_scene_bool(s, "allow_transmission", 1);
        bsdf_make(s, q, q->back, NULL, seed + 1);
        if (ops->max_children > 1) bsdf_make(s, q, kind("conductor"), NULL, seed + 2);
    } else {
        props_make(s, q->props);
    }
    const bool bump = strcmp(ops->name, "bumpmap") == 0;
    if (bump || strcmp(ops->name, "normalmap") == 0) {
        imp_scene_bool(s, "clamp_invalid_normals", 1);
        float pixels[27];
        for (uint32_t k = 0; k < 27; k++)
            pixels[k] =
                (float)(k % 3 == 2 ? 1 : 0.3 + 0.4 * imp__u01(imp__key(9, 9, 9), k));
        imp_scene_begin(s, "texture", "bitmap", NULL, bump ? "height" : "normalmap");
        imp_scene_image(s, 3, 3, 3, pixels);
        imp_scene_bool(s, "raw", 1);
        imp_scene_end(s);
    }
    if (strcmp(ops->name, "merl") == 0) imp_scene_string(s, "filename", measured);
    if (strcmp(ops->name, "measured") == 0) imp_scene_string(s, "filename", rgl);
    inputs_make(s, q, ops->name, ops->max_children ? NULL : q->props, ops->inputs, true,
                seed);
    imp_scene_end(s);
}

static void grey(imp_scene *s, double value)
{
    const double v[3] = {value, 0.9 * value, 0.8 * value};
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_rgb(s, "reflectance", v);
    imp_scene_end(s);
}

/* lifted: colours become spectra, which have no derivative where a number is 0. */
static void emitter_make(imp_scene *s, const struct subject *q, bool lifted)
{
    const bool sky = q->emitter->flags & IMP_EMITTER_ENVIRONMENT;
    const bool texture =
        q->emitter->flags & IMP_EMITTER_AREA || (q->emitter->place && !sky);
    /* Above and beside the ball, towards it. */
    const double x = sqrt(0.8), z = sqrt(0.2);
    const double at[16] = {x, 0.2,   0.4, -0.3, z, -0.4, -0.8, 0.7,
                           0, 2 * z, -z,  0.4,  0, 0,    0,    1};
    imp_scene_begin(s, "emitter", q->emitter->name, "subject", NULL);
    const bool sun = strcmp(q->emitter->name, "sun") == 0;
    if ((q->emitter->flags & IMP_EMITTER_DELTA &&
         !(q->emitter->flags & IMP_EMITTER_AREA)) ||
        sun)
        imp_scene_transform(s, "to_world", at);
    if (sun) imp_scene_float(s, "radius", 1.4); /* that walks meet it by chance */
    if (strcmp(q->emitter->name, "ies") == 0) {
        imp_scene_string(s, "filename", IMP_SCENES "/lamps/wallwash.ies");
        imp_scene_string(s, "units", "radiometric");
    }
    if (strcmp(q->emitter->name, "perezsky") == 0) {
        imp_scene_float(s, "diffuse", 3);
        imp_scene_float(s, "direct", 4);
    }
    if (q->emitter->place && sky) { /* a picture of the sky, some of it dark */
        float pixels[5 * 4 * 3];
        for (uint32_t k = 0; k < 60; k++)
            pixels[k] =
                k % 7 || lifted ? (float)random_in(q->emitter->inputs, 5, 100 + k) : 0;
        imp_scene_image(s, 5, 4, 3, pixels);
        inputs_make(s, q, q->emitter->name, NULL, q->emitter->inputs + 1, false, 5);
        imp_scene_end(s);
        return;
    }
    /* Differences must not cross a whole turbidity, where the model has a corner. */
    static const char *const middle[6] = {"turbidity=3.5"};
    const bool sunsky = strcmp(q->emitter->name, "sunsky") == 0;
    if (sunsky) props_make(s, middle);
    inputs_make(s, q, q->emitter->name, sunsky ? middle : NULL, q->emitter->inputs,
                texture, 5);
    imp_scene_end(s);
}

/* A room with a bright ceiling; the subject covers a ball and a wall, or is the light. */
static imp_scene *scene_make(const struct subject *q, const char *integrator,
                             enum imp_color_mode mode)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s;
    o.mode = mode;
    test_must(ctx, imp_scene_create(ctx, &o, &s));
    imp_scene_begin(s, "integrator", integrator, NULL, NULL);
    if (strcmp(integrator, "direct") != 0) imp_scene_integer(s, "max_depth", 5);
    imp_scene_end(s);

    /* From (0, 0, 0.9) towards -z, in the cube [-1, 1]^3. */
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0.9, 0, 0, 0, 1};
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", 75);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", SIDE);
    imp_scene_integer(s, "height", SIDE);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);

    const bool sky = q->emitter && q->emitter->flags & IMP_EMITTER_ENVIRONMENT;
    const bool open = sky || (q->emitter && !strcmp(q->emitter->name, "directional"));
    if (!open) {
        imp_scene_begin(s, "shape", "cube", "room", NULL);
        imp_scene_bool(s, "flip_normals", 1);
        grey(s, 0.5);
        imp_scene_end(s);
    }
    /* Floor and ceiling, seen from inside. */
    const double floor_at[16] = {0.9, 0,    0, 0, 0, 0, 0.9, -0.95,
                                 0,   -0.9, 0, 0, 0, 0, 0,   1};
    const double ceiling[16] = {0.8, 0, 0, 0, 0, 0, -0.8, 0.95, 0, 0.8, 0, 0, 0, 0, 0, 1};
    imp_scene_begin(s, "shape", "rectangle", "floor", NULL);
    imp_scene_transform(s, "to_world", floor_at);
    if (q->bsdf) imp_scene_ref(s, "subject", NULL);
    else grey(s, 0.6);
    imp_scene_end(s);
    if (!open && (!q->emitter || q->emitter->flags & IMP_EMITTER_AREA)) {
        const double bright[3] = {6, 5, 4};
        imp_scene_begin(s, "shape", "rectangle", "lamp", NULL);
        imp_scene_transform(s, "to_world", ceiling);
        if (q->emitter) {
            emitter_make(s, q, mode >= IMP_SPECTRAL);
        } else {
            imp_scene_begin(s, "emitter", "area", NULL, NULL);
            imp_scene_rgb(s, "radiance", bright);
            imp_scene_end(s);
        }
        imp_scene_end(s);
    } else {
        emitter_make(s, q, mode >= IMP_SPECTRAL);
        if (!sky || q->emitter->place) { /* so that scale 0 is not darkness */
            const double at[3] = {0.2, 0.6, 0.3};
            imp_scene_begin(s, "emitter", "point", NULL, NULL);
            imp_scene_vector(s, "position", at);
            imp_scene_end(s);
        }
    }
    const double ball[16] = {0.5, 0, 0,   0.1,  0, 0.5, 0, -0.2,
                             0,   0, 0.5, -0.2, 0, 0,   0, 1};
    imp_scene_begin(s, "shape", "sphere", "ball", NULL);
    imp_scene_transform(s, "to_world", ball);
    if (q->bsdf) imp_scene_ref(s, "subject", NULL);
    else grey(s, 0.7);
    imp_scene_end(s);
    if (q->bsdf) bsdf_make(s, q, q->bsdf, "subject", 1);
    test_must(ctx, imp_scene_commit(s));
    grids_remove();
    return s;
}

/* ---- Checks -------------------------------------------------------------------- */

static double pattern(int x, int y, int c)
{
    return (1 + 0.5 * cos(0.7 * x + 0.4 * y + c)) / (SIDE * SIDE);
}

/* sum pattern * film and its standard error; channels of a pixel may be fully correlated.
 */
static struct imp_estimate functional(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    struct imp_estimate e = {0};
    double variance = 0;
    imp_film_get_info(film, &info);
    for (int y = 0; y < info.height; y++)
        for (int x = 0; x < info.width; x++) {
            double se = 0;
            for (int c = 0; c < info.channels; c++) {
                const size_t k = (size_t)((y * info.width + x) * info.channels + c);
                e.value += pattern(x, y, c) * imp_film_mean(film)[k];
                se += pattern(x, y, c) * imp_film_se(film)[k];
            }
            variance += se * se;
        }
    e.se = sqrt(variance);
    return e;
}

/* The functional with parameter `param` moved by h v, for n seeds after `seed`. Setting it
 * may cost more than the pictures: a rough coat makes a table. */
static void moved(imp_scene *s, size_t param, size_t count, const double *old,
                  const double *v, double h, int spp, uint64_t seed, int n, double *F)
{
    struct imp_run run = IMP_RUN_INIT;
    double *x = malloc(count * sizeof *x);
    run.spp = spp;
    run.drop_budget = 1e-9;
    for (size_t k = 0; k < count; k++) x[k] = old[k] + h * v[k];
    test_must(ctx, imp_scene_set_values(s, param, count, x));
    for (int b = 0; b < n; b++) {
        imp_film *film;
        run.seed = seed + (uint64_t)b + 1;
        test_must(ctx, imp_render(s, &run, &film));
        F[b] = functional(film).value;
        imp_film_destroy(film);
    }
    test_must(ctx, imp_scene_set_values(s, param, count, old));
    free(x);
}

/* d F / d (parameter along v): the forward picture against differences of pictures of
 * other seeds. The pictures of one difference share their seed: its expectation is the
 * same, and noise that does not follow the parameter cancels. */
static void fresh(imp_scene *s, imp_problem *p, size_t param, const double *v,
                  bool linear, const char *what)
{
    struct imp_param_info info = {.size = sizeof info};
    struct imp_run run = IMP_RUN_INIT;
    const int spp = is_long ? 64 : 4;
    /* Of a case's own name: a new kind does not change the numbers of the others. */
    uint64_t seed = imp__hash_text(imp__hash_text(1000, what), "fresh") >> 16;
    imp_film *film;
    test_must(ctx, imp_scene_get_param(s, param, &info));
    const size_t n = imp_problem_n_variables(p), count = info.count;
    double *old = calloc(count, sizeof *old), *x_dot = calloc(n, sizeof *x_dot),
           *g = calloc(n, sizeof *g);
    test_must(ctx, imp_scene_get_values(s, param, old));

    size_t base = n;
    for (size_t i = n; i-- > 0;) {
        const size_t at = test_param_of(ctx, p, i);
        if (at == param) base = i;
    }
    /* A sky's density changes with its numbers, and with it a few decisions, whose jumps are a
     * part of the mean: small steps see too few of them. */
    const bool jumps = strncmp(what, "sunsky", 6) == 0;
    double below = INFINITY, above = INFINITY, scale = 0;
    for (size_t k = 0; k < count; k++) {
        x_dot[base + k] = v[k];
        if (v[k] == 0) continue;
        const double up = v[k] > 0 ? info.hi - old[k] : old[k] - info.lo;
        const double down = v[k] > 0 ? old[k] - info.lo : info.hi - old[k];
        above = fmin(above, up / fabs(v[k]));
        below = fmin(below, down / fabs(v[k]));
        scale = fmax(scale, fabs(old[k]));
    }
    if (scale == 0) scale = isfinite(info.hi) ? info.hi : 1;
    run.spp = 4 * BATCHES * spp;
    run.points = IMP_POINTS_INDEPENDENT; /* the same walks forward and in reverse */
    run.wavelengths = IMP_WAVELENGTHS_INDEPENDENT; /* as the forward picture has them */
    run.seed = 77;
    test_must(ctx, imp_problem_forward(p, x_dot, &run, &film));
    const struct imp_estimate mine = functional(film);
    double floats = 0; /* rounding of the film, where pixels cancel each other */
    struct imp_film_info pixels = {.size = sizeof pixels};
    imp_film_get_info(film, &pixels);
    for (int k = 0; k < SIDE * SIDE * pixels.channels; k++)
        floats += 0x1p-24 * fabs((double)imp_film_mean(film)[k]);
    imp_film_destroy(film);

    /* The same seed backwards: the same number up to the films' floats. */
    float seed_image[SIDE * SIDE * 3];
    struct imp_scene_info scene = {.size = sizeof scene};
    imp_scene_get_info(s, &scene);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            for (int c = 0; c < scene.channels; c++)
                seed_image[(y * SIDE + x) * scene.channels + c] = (float)pattern(x, y, c);
    test_must(ctx, imp_problem_reverse(p, seed_image, &run, g, NULL));
    double back = 0, size = 0;
    for (size_t i = 0; i < n; i++) back += g[i] * x_dot[i], size += fabs(g[i] * x_dot[i]);
    const double dot = fmax(fabs(back - mine.value) - floats, 0) / fmax(size, 1e-300);
    if (size > 0) worst_dot = fmax(worst_dot, dot);
    if (size > 0 && dot > 1e-5)
        tap_ok(0, "%s: %s: forward %.9g, reverse %.9g", what, info.name, mine.value,
               back);

    struct tap_stat differences = {0};
    double place[4], factor[4], size_F = 0;
    int places;
    const double both = fmin(fmin(below, above), scale);
    if (both > 0.02 * scale) {
        const double h = (linear ? 0.8 : 0.1) * both;
        const double at[4] = {h, -h, h / 2, -h / 2};
        const double by[4] = {-1 / (6 * h), 1 / (6 * h), 4 / (3 * h), -4 / (3 * h)};
        places = linear ? 2 : 4;
        memcpy(place, at, sizeof at);
        memcpy(factor, by, sizeof by);
        if (linear) factor[0] = 0.5 / h, factor[1] = -0.5 / h;
    } else { /* (-11 F0 + 18 F1 - 9 F2 + 2 F3) / 6h */
        const double side = above > below ? 1 : -1;
        const double h =
            side * (linear || jumps ? 0.2 : 0.01) * fmin(fmax(below, above), scale);
        const double at[4] = {0, h, 2 * h, 3 * h};
        const double by[4] = {-11 / (6 * h), 3 / h, -1.5 / h, 1 / (3 * h)};
        places = 4;
        memcpy(place, at, sizeof at);
        memcpy(factor, by, sizeof by);
    }
    /* Thousands of comparisons: what looks wrong is looked at again with new random
     * numbers and four times as many, and must look wrong again; at a bound with smaller
     * steps, since metals with k = 0 have kinks there (total reflection). */
    double z = 0, rounding = 0;
    struct imp_estimate fd = {0};
    for (int look = 0; look < 2; look++) {
        differences = (struct tap_stat){0};
        for (int k = 0; look && !jumps && place[0] == 0 && k < places; k++) {
            place[k] /= 16;
            factor[k] *= 16;
        }
        const int n_batches = (look ? 4 : 1) * BATCHES;
        double d[4 * BATCHES] = {0}, F[4 * BATCHES];
        for (int k = 0; k < places; k++) {
            moved(s, param, count, old, v, place[k], spp, seed, n_batches, F);
            for (int b = 0; b < n_batches; b++) {
                d[b] += factor[k] * F[b];
                size_F = fmax(size_F, fabs(F[b]));
            }
        }
        seed += (uint64_t)n_batches;
        for (int b = 0; b < n_batches; b++) tap_add(&differences, d[b]);
        fd = (struct imp_estimate){.value = differences.mean, .se = tap_se(&differences)};
        /* Pictures are floats: 6e-8 of each of them. */
        rounding = 6e-8 * size_F * (fabs(factor[0]) + fabs(factor[1]));
        const double off = fmax(fabs(mine.value - fd.value) - rounding, 0);
        z = off > 0 ? off / hypot(mine.se, fd.se) : 0;
        if (z <= 4.5) break;
    }
    n_z++;
    worst_z = fmax(worst_z, z);
    if (only)
        printf("# %s: %s: gradient %.6g +- %.2g, differences %.6g +- %.2g, z %.2f\n",
               what, info.name, mine.value, mine.se, fd.value, fd.se, z);
    if (!(z <= 4.5))
        tap_ok(0, "%s: %s: gradient %.6g +- %.2g, differences %.6g +- %.2g, z %.2f", what,
               info.name, mine.value, mine.se, fd.value, fd.se, z);
    free(old);
    free(x_dot);
    free(g);
}

/* imp_check's frozen, dot and Euler rows; in the long run the fresh ones too, but not
 * with a number at its bound: a metal with k = 0 and eta < 1 reflects totally from some
 * angle on, and towards it the derivatives by the other numbers grow beyond all bounds:
 * infinite variance, for which there is no z-score. */
static void frozen(imp_problem *p, const char *what, bool at_bound)
{
    const bool with_fresh = is_long && !at_bound;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_check_row *rows;
    size_t n;
    o.only = is_long ? "frozen,dot,euler,fresh,loss,ends" : "frozen,dot,euler,loss";
    o.draws_s = 0.02;
    o.paths = is_long ? 1000 : 60;
    o.fresh_spp = with_fresh ? 512 : 1;
    run.seed = 5;
    const enum imp_status st = imp_check(p, &o, &run, &rows, &n);
    if (st != IMP_OK) {
        tap_ok(0, "%s: check # %s", what, imp_last_error(ctx));
        return;
    }
    for (size_t k = 0; k < n; k++) {
        const bool is_fresh =
            strcmp(rows[k].method, "fresh") == 0 || strcmp(rows[k].method, "ends") == 0;
        if (is_fresh && !with_fresh) continue;
        if (strcmp(rows[k].method, "frozen") == 0 && rows[k].limit > 0) {
            n_frozen++;
            worst_frozen = fmax(worst_frozen, rows[k].error);
        }
        if (is_fresh ? rows[k].error <= 4.5 : rows[k].ok) continue;
        tap_ok(0, "%s: %s %s step %g: %.9g, reference %.9g, error %.2e", what,
               rows[k].method, rows[k].param, rows[k].step, rows[k].value,
               rows[k].reference, rows[k].error);
    }
}

static bool active_has(imp_problem *p, imp_scene *s, const char *part)
{
    for (size_t i = 0; i < imp_problem_n_variables(p); i++) {
        struct imp_param_info info = {.size = sizeof info};
        const size_t param = test_param_of(ctx, p, i);
        test_must(ctx, imp_scene_get_param(s, param, &info));
        if (strstr(info.name, part)) return true;
    }
    return false;
}

/* Is it a number of the outer material, not of one inside? */
static bool is_own(const struct imp_bsdf_ops *outer, const char *param)
{
    const char *input = strchr(param, '.') + 1;
    for (const struct imp_input_desc *d = outer->inputs; d->name; d++) {
        const size_t n = strlen(d->name);
        if (strncmp(input, d->name, n) == 0 && input[n] == '.') return true;
    }
    return false;
}

static void check_one(const struct subject *q, const char *integrator,
                      enum imp_color_mode mode)
{
    char what[256];
    const struct imp_input_desc *inputs = q->bsdf ? q->bsdf->inputs : q->emitter->inputs;
    int n = snprintf(what, sizeof what, "%s", q->bsdf ? q->bsdf->name : q->emitter->name);
    if (q->back && n < 200)
        n += snprintf(what + n, 256 - (size_t)n, "(%s)", q->back->name);
    for (int i = 0; q->props && i < 6 && q->props[i] && n < 200; i++)
        n += snprintf(what + n, 256 - (size_t)n, " %s", q->props[i]);
    if (q->texture && n < 200)
        n += snprintf(what + n, 256 - (size_t)n, " %s%s", q->nested ? "nested " : "",
                      q->texture->name);
    snprintf(what + n, 256 - (size_t)n, ", %s, %s", integrator, mode_names[mode]);

    if (only && strncmp(what, only, strlen(only)) != 0) return;
    const int failed = tap_failed;
    worst_z = worst_frozen = worst_dot = n_z = n_frozen = 0;
    lifted = mode == IMP_SPECTRAL || mode == IMP_SINGLE;
    imp_scene *s = scene_make(q, integrator, mode);
    imp_problem *all = test_problem(ctx, s, "*"), *p = test_problem(ctx, s, "subject*");
    for (int j = 0; inputs && inputs[j].name; j++) {
        char part[128];
        snprintf(part, sizeof part, "subject.%s", inputs[j].name);
        if (inputs[j].flags &
                (IMP_INPUT_FIXED | IMP_INPUT_WAVELENGTH | IMP_INPUT_COMPONENT) ||
            is_left_out(what, q->props, inputs[j].name))
            continue;
        if (q->bsdf && is_left_out(q->bsdf->name, q->props, inputs[j].name)) continue;
        /* Where the nested material has no derivative with respect to directions. */
        if (inputs[j].flags & (IMP_INPUT_VECTOR | IMP_INPUT_BUMP) &&
            (!q->back || !q->back->eval_directions_d ||
             strcmp(q->back->name, "plastic") ==
                 0 || /* or has ideal lobes, or spec_trans */
             strncmp(q->back->name, "principled", 10) == 0)) {
            tap_ok(!active_has(p, s, part), "%s: %s has no gradient", what, part);
            continue;
        }
        if (q->bsdf && is_fixed(q->bsdf, q->props, inputs[j].name)) {
            tap_ok(!active_has(p, s, part), "%s: %s has no gradient", what, part);
            continue;
        }
        /* Its texture moves, and has no slope there. */
        if (strcmp(part, "subject.cutoff_angle") == 0 && q->texture &&
            strcmp(q->texture->name, "bitmap") != 0) {
            tap_ok(!active_has(p, s, part), "%s: %s has no gradient", what, part);
            continue;
        }
        if (!active_has(p, s, part)) tap_ok(0, "%s: %s is a parameter", what, part);
    }
    frozen(all, what, false);
    for (size_t k = 0; k < imp_scene_n_params(s); k++) {
        struct imp_param_info info = {.size = sizeof info};
        test_must(ctx, imp_scene_get_param(s, k, &info));
        if (strncmp(info.name, "subject", 7) != 0) continue;
        if (!(info.flags & IMP_PARAM_DIFFERENTIABLE)) continue;
        double *v = calloc(info.count, sizeof *v), *x = calloc(info.count, sizeof *x);
        bool linear = q->emitter != NULL;
        for (int j = 0; inputs && inputs[j].name && linear; j++) {
            char part[128];
            snprintf(part, sizeof part, "subject.%s", inputs[j].name);
            if (strncmp(info.name, part, strlen(part)) == 0)
                linear = inputs[j].role == IMP_EMISSION;
        }
        for (size_t e = 0; e < info.count; e++)
            v[e] = 0.5 + imp__u01(imp__key(2, 2, 2), (uint32_t)e);
        fresh(s, p, k, v, linear, what);
        /* One number at a bound, the others as they are. */
        for (int side = 0; side < 2; side++) {
            const double bound = side ? info.hi : info.lo;
            if (!isfinite(bound) || (bound != 0 && bound != 1)) continue;
            /* The colour of what is transmitted is its root: no finite slope at 0. */
            if (strstr(what, "principled") && !side && strstr(info.name, "base_color"))
                continue;
            if (!is_long &&
                (mode != IMP_RGB || q->texture || strcmp(integrator, "path") != 0))
                continue;
            /* Bounds of a material inside another: it meets them by itself too. */
            if (!is_long && q->back && !is_own(q->bsdf, info.name)) continue;
            test_must(ctx, imp_scene_get_values(s, k, x));
            const double old = x[0];
            x[0] = bound;
            memset(v, 0, info.count * sizeof *v);
            v[0] = 1;
            test_must(ctx, imp_scene_set_values(s, k, info.count, x));
            char where[300];
            snprintf(where, sizeof where, "%s, [0] = %g", what, bound);
            if (bound == 0 || is_long) frozen(p, where, true);
            fresh(s, p, k, v, linear, where);
            x[0] = old;
            test_must(ctx, imp_scene_set_values(s, k, info.count, x));
        }
        free(v);
        free(x);
    }
    imp_problem_destroy(p);
    imp_problem_destroy(all);
    imp_scene_destroy(s);
    tap_ok(failed == tap_failed,
           "%s # %d frozen, worst %.1e; forward-reverse %.1e; %d fresh, worst z %.2f",
           what, n_frozen, worst_frozen, worst_dot, n_z, worst_z);
}

static void check(const struct subject *q)
{
    static const char *const integrators[] = {"path", "direct", "stam"};
    for (int i = 0; i < 3; i++)
        for (int mode = IMP_RGB; mode <= IMP_SINGLE; mode++) {
            /* Stam's walks take no light samples and never meet a point. */
            if (i == 2 && q->emitter && q->emitter->flags & IMP_EMITTER_DELTA) continue;
            if (!is_long && mode == IMP_MONO && (i != 0 || q->texture || q->back))
                continue;
            if (!is_long && mode == IMP_SPECTRAL && (i != 0 || q->back || q->texture))
                continue;
            if (!is_long && mode == IMP_SINGLE) continue;
            if (!is_long && i != 0 && (q->texture || q->back)) continue;
            check_one(q, integrators[i], (enum imp_color_mode)mode);
        }
}

int main(int argc, char **argv)
{
    static const char *const opaque[6] = {"spec_trans=0"};
    is_long = argc > 1 && strcmp(argv[1], "long") == 0;
    only = argc > 2 ? argv[2] : NULL;
    ctx = test_context(is_long ? 0 : 1);
    snprintf(measured, sizeof measured, "registry_%d.binary", (int)getpid());
    if (!merl_write(measured, 20, 10, 12,
                    &(struct merl_model){0.4, 0.3, {0.8, 0.6, 0.5}}))
        return 1;
    snprintf(rgl, sizeof rgl, "registry_%d.bsdf", (int)getpid());
    if (!rgl_write(rgl, &(struct rgl_model){{0.4, 0.4}, 0, true, true, true})) return 1;
    for (int k = 0; imp__bsdf_kinds[k]; k++) {
        const struct imp_bsdf_ops *ops = imp__bsdf_kinds[k];
        if (!ops->inputs[0].name && !ops->max_children) continue; /* no parameters */
        if (ops->max_children) {
            for (int i = 0; imp__bsdf_kinds[i]; i++)
                if (!imp__bsdf_kinds[i]->max_children &&
                    imp__bsdf_kinds[i]->inputs[0].name && (is_long || (i + k) % 4 == 1))
                    check(&(struct subject){.bsdf = ops, .back = imp__bsdf_kinds[i]});
            for (int i = 0; imp__texture_kinds[i] && ops->inputs[0].name; i++)
                if (!of_meshes(imp__texture_kinds[i]))
                    check(&(struct subject){.bsdf = ops,
                                            .back = kind("diffuse"),
                                            .texture = imp__texture_kinds[i]});
            continue;
        }
        check(&(struct subject){.bsdf = ops});
        if (strcmp(ops->name, "principled") == 0)
            check(&(struct subject){.bsdf = ops, .props = opaque});
        for (size_t i = 0; i < imp_count(kind_configs); i++)
            if (strcmp(kind_configs[i].kind, ops->name) == 0)
                check(&(struct subject){.bsdf = ops, .props = kind_configs[i].props});
        for (int i = 0; imp__texture_kinds[i]; i++) {
            if (of_meshes(imp__texture_kinds[i]) ||
                (is_volume(imp__texture_kinds[i]) && !is_long &&
                 strcmp(ops->name, "diffuse") != 0))
                continue;
            for (int nested = 0; nested <= (!is_volume(imp__texture_kinds[i]) &&
                                            imp__texture_kinds[i]->inputs &&
                                            imp__texture_kinds[i]->inputs[0].name);
                 nested++)
                if (is_long || (i + k + 2 * nested) % 6 == 1)
                    check(&(struct subject){
                        .bsdf = ops, .texture = imp__texture_kinds[i], .nested = nested});
        }
    }
    for (int k = 0; imp__emitter_kinds[k]; k++) {
        check(&(struct subject){.emitter = imp__emitter_kinds[k]});
        if (!(imp__emitter_kinds[k]->flags & IMP_EMITTER_AREA) &&
            (!imp__emitter_kinds[k]->place ||
             imp__emitter_kinds[k]->flags & IMP_EMITTER_ENVIRONMENT))
            continue;
        for (int i = 0; imp__texture_kinds[i]; i++)
            if (!of_meshes(imp__texture_kinds[i]))
                check(&(struct subject){.emitter = imp__emitter_kinds[k],
                                        .texture = imp__texture_kinds[i]});
    }
    remove(measured);
    remove(rgl);
    imp_context_destroy(ctx);
    return tap_done();
}
