/* SPDX-License-Identifier: Apache-2.0
 *
 * Random scenes with media through rendering and gradients. Bytes choose media, phase
 * functions, grids, boundaries that overlap, and cameras and lights inside them, with
 * numbers that are hostile now and then. Whatever happens must be a status, and what
 * succeeds must be finite. */
#include <importon/importon.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

struct bytes {
    const uint8_t *data;
    size_t left;
};

static unsigned byte(struct bytes *b)
{
    if (b->left == 0) return 0;
    b->left--;
    return *b->data++;
}

/* Mostly ordinary numbers in [0, 1.6]. */
static double number(struct bytes *b)
{
    static const double odd[] = {0, -1, 1e-12, 1e2, NAN, INFINITY, 1e12, 1};
    const unsigned k = byte(b);
    return k < 8 ? odd[k] : k / 160.0;
}

/* The scene's text. */
struct text {
    char at[1 << 14];
    size_t n;
};
static void __attribute__((format(printf, 2, 3)))
put(struct text *t, const char *form, ...)
{
    va_list list;
    va_start(list, form);
    const int n = vsnprintf(t->at + t->n, sizeof t->at - t->n, form, list);
    va_end(list);
    if (n > 0) t->n += (size_t)n < sizeof t->at - t->n ? (size_t)n : 0;
}

static void color(struct bytes *b, struct text *t, const char *name, double scale)
{
    const double x = scale * number(b);
    if (byte(b) & 1) put(t, "<float name='%s' value='%g'/>", name, x);
    else
        put(t, "<rgb name='%s' value='%g, %g, %g'/>", name, x, scale * number(b),
            scale * number(b));
}

static void phase(struct bytes *b, struct text *t, int depth)
{
    static const char *const types[] = {"isotropic", "hg", "rayleigh", "tabphase",
                                        "blendphase"};
    const unsigned k = byte(b) % (depth > 2 ? 4 : 5);
    put(t, "<phase type='%s'>", types[k]);
    if (k == 1) color(b, t, "g", 1);
    if (k == 3)
        put(t, "<string name='values' value='%g, %g, %g'/>", number(b), number(b),
            number(b));
    if (k == 4) {
        put(t, "<float name='weight' value='%g'/>", number(b));
        phase(b, t, depth + 1);
        phase(b, t, depth + 1);
    }
    put(t, "</phase>");
}

/* A .vol file without a name. 1e4 stands for 1e12 there: a bound of 1e12 ends each walk by the
 * limit of tentative collisions, a million, which takes eight seconds under the sanitizers. */
static int grid(struct bytes *b, const char *name, struct text *t)
{
    const unsigned channels = byte(b) % 8 ? 1 + 2 * (byte(b) & 1) : byte(b);
    const int32_t head[5] = {1, 1 + (int)(byte(b) % 3), 1 + (int)(byte(b) % 3),
                             1 + (int)(byte(b) % 3), (int32_t)channels};
    const float box[6] = {0, 0, 0, 1, 1, 1};
    const int fd = memfd_create("vol", 0);
    if (fd < 0) return -1;
    int ok = write(fd, "VOL\3", 4) == 4 && write(fd, head, 20) == 20 &&
             write(fd, box, 24) == 24;
    for (int i = 0; ok && i < head[1] * head[2] * head[3] * 3 && i < 81; i++) {
        const double x = number(b);
        const float v = (float)(x == 1e12 ? 1e4 : x);
        if (i < head[1] * head[2] * head[3] * (channels == 3 ? 3 : 1))
            ok = write(fd, &v, 4) == 4;
    }
    put(t,
        "<volume name='%s' type='gridvolume'><string name='filename' "
        "value='/proc/self/fd/%d'/><string name='filter_type' value='%s'/>"
        "<string name='wrap_mode' value='%s'/></volume>",
        name, fd, byte(b) & 1 ? "nearest" : "trilinear",
        byte(b) & 1 ? "mirror" : "clamp");
    return fd;
}

static void medium(struct bytes *b, struct text *t, int k, int fd[3])
{
    const unsigned how = byte(b);
    const int heterogeneous = how & 1;
    put(t, "<medium type='%s' id='m%d'>", heterogeneous ? "heterogeneous" : "homogeneous",
        k);
    if (heterogeneous) fd[0] = grid(b, how & 2 ? "sigma_s" : "sigma_t", t);
    else color(b, t, how & 2 ? "sigma_s" : "sigma_t", 4);
    if (how & 2) color(b, t, "sigma_a", 2);
    else if (how & 4) fd[1] = grid(b, "albedo", t);
    else color(b, t, "albedo", .625);
    if (how & 8) put(t, "<float name='scale' value='%g'/>", 4 * number(b));
    if (how & 16) color(b, t, "emission", 2);
    else if (how & 32) fd[2] = grid(b, "emission", t);
    if (how & 64) phase(b, t, 0);
    put(t, "</medium>");
}

static void shape(struct bytes *b, struct text *t, int media)
{
    static const char *const types[] = {"sphere", "cube", "rectangle", "disk"};
    static const char *const bsdfs[] = {"null",    "null",           "dielectric",
                                        "diffuse", "thindielectric", "roughdielectric"};
    const unsigned how = byte(b);
    put(t, "<shape type='%s'>", types[how % 4]);
    if (how & 64) put(t, "<bsdf type='%s'/>", bsdfs[byte(b) % 6]);
    else put(t, "<bsdf type='null'/>");
    if (media && how & 8) put(t, "<ref id='m%d' name='interior'/>", byte(b) % media);
    if (media && how & 16) put(t, "<ref id='m%d' name='exterior'/>", byte(b) % media);
    if (how & 32) put(t, "<emitter type='area'/>");
    put(t,
        "<transform name='to_world'><scale x='%g' y='%g' z='%g'/><translate x='%g' "
        "y='%g' z='%g'/></transform></shape>",
        .3 + number(b), .3 + number(b), .3 + number(b), number(b) - .5, number(b) - .5,
        number(b) - .5);
}

static void scene(struct bytes *b, struct text *t, int fd[3][3])
{
    static const char *const integrators[] = {"volpath", "volpath",    "photons",
                                              "path",    "volpathmis", "ptracer"};
    const int media = 1 + (int)(byte(b) % 3);
    put(t,
        "<scene version='3.0.0'><integrator type='%s'><integer name='max_depth' "
        "value='%d'/></integrator>",
        integrators[byte(b) % 6], (int)(byte(b) % 12) - 1);
    for (int k = 0; k < media; k++) medium(b, t, k, fd[k]);
    const unsigned how = byte(b);
    put(t,
        "<sensor type='%s'><transform name='to_world'><lookat origin='0.1,0.2,%g' "
        "target='0,0,0' up='0,1,0'/></transform>",
        how & 1 ? "orthographic" : "perspective", how & 2 ? 3. : number(b) - .5);
    if (how & 4) put(t, "<ref id='m%d'/>", byte(b) % media);
    put(t, "<film type='hdrfilm'><integer name='width' value='2'/><integer "
           "name='height' value='1'/><rfilter type='box'/></film></sensor>");
    if (how & 8) put(t, "<emitter type='constant'/>");
    if (how & 16)
        put(t,
            "<emitter type='point'><point name='position' x='%g' y='%g' z='%g'/>"
            "</emitter>",
            number(b), number(b), number(b) - .5);
    for (unsigned n = 1 + byte(b) % 4; n > 0; n--) shape(b, t, media);
    put(t, "</scene>");
}

static void use(imp_scene *s)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    imp_film *film = NULL;
    imp_problem *p = NULL;
    run.spp = 2;
    run.drop_budget = 1; /* absurd scenes drop walks; that is not what is looked for */
    if (imp_render(s, &run, &film) != IMP_OK) return;
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    for (int k = 0; k < info.width * info.height * info.channels; k++)
        if (!isfinite(imp_film_mean(film)[k])) __builtin_trap();
    if (imp_problem_create(s, &p) == IMP_OK && imp_problem_activate(p, "*") == IMP_OK) {
        const size_t n = imp_problem_n_variables(p);
        double *g = malloc(2 * n * sizeof *g);
        if (g && imp_problem_functional(p, NULL, &run, &v, g, g + n) == IMP_OK)
            for (size_t k = 0; k < n && fabs(v.value) < 1e100; k++)
                if (isnan(g[k])) __builtin_trap();
        free(g);
    }
    imp_problem_destroy(p);
    imp_film_destroy(film);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static imp_context *ctx;
    static struct text t;
    struct bytes b = {data, size};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    int fd[3][3] = {{-1, -1, -1}, {-1, -1, -1}, {-1, -1, -1}};
    imp_scene *s;
    if (!ctx) {
        struct imp_context_options c = IMP_CONTEXT_OPTIONS_INIT;
        c.threads = 1;
        if (imp_context_create(&c, &ctx) != IMP_OK) return 0;
    }
    t.n = 0;
    o.mode = byte(&b) & 3 ? IMP_RGB : IMP_MONO;
    scene(&b, &t, fd);
    if (imp_scene_load_string(ctx, t.at, t.n, "fuzz", &o, &s) == IMP_OK) {
        use(s);
        imp_scene_destroy(s);
    } else if (getenv("FUZZ_MEDIA_SAY")) {
        fprintf(stderr, "%s\n", imp_last_error(ctx));
    }
    for (int k = 0; k < 9; k++)
        if (fd[k / 3][k % 3] >= 0) close(fd[k / 3][k % 3]);
    return 0;
}
