/* SPDX-License-Identifier: Apache-2.0
 *
 * Textures: texel centres, wrap modes, sRGB, to_uv, luminance, the swapped checkerboard;
 * and for every way of reading one, scatter and tangent as exact transposes of each other
 * and exact derivatives of eval. */
#include "color/rgb.h"
#include "imp_tap.h"
#include "kind/texture/input.h"
#include "math/rng.h"
#include "math/vec.h"
#include <stdlib.h>

static imp_context *ctx;
static struct imp_arena arena;
static double bulk_lo; /* lower bound of the texels registered last */

static enum imp_status add_bulk(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t dims[3], unsigned flags,
                                double lo, double hi, int *param)
{
    (void)b, (void)data;
    tap_ok(strcmp(key, "data") == 0 && n_dims == 3 && dims[0] * dims[1] * dims[2] > 0 &&
               (flags & IMP_PARAM_DIFFERENTIABLE) && lo <= 0 && hi == INFINITY,
           "registered as data %zu x %zu x %zu", dims[0], dims[1], dims[2]);
    *param = 0;
    bulk_lo = lo;
    return IMP_OK;
}

static const struct imp_texture_ops *find(const char *name)
{
    for (int k = 0; imp__texture_kinds[k]; k++)
        if (strcmp(imp__texture_kinds[k]->name, name) == 0) return imp__texture_kinds[k];
    return NULL;
}
static struct imp_node *node_make(const char *type)
{
    return imp__node_create(&arena, "texture", type, NULL, NULL,
                            (struct imp_loc){"a.xml", 3, 5});
}
static void string_add(struct imp_node *n, const char *name, const char *value)
{
    imp__node_add(&arena, n, name, IMP_PROP_STRING, n->loc)->string = value;
}
static void matrix_add(struct imp_node *n, const double m[16])
{
    memcpy(imp__node_add(&arena, n, "to_uv", IMP_PROP_TRANSFORM, n->loc)->number, m,
           16 * sizeof *m);
}
static enum imp_status make(struct imp_node *n, const struct imp_image_data *image,
                            enum imp_color_mode mode, const struct imp_input **input,
                            struct imp_texture *t)
{
    const struct imp_texture_ops *ops = find(n->type);
    const struct imp_build b = {
        .ctx = ctx, .node = n, .arena = &arena, .mode = mode, .add_bulk = add_bulk};
    n->image = image;
    *t = (struct imp_texture){.ops = ops, .param = -1, .input = input, .name = "t"};
    t->self = imp__arena_array(&arena, 1, ops->object_size);
    return ops->build(&b, t->self, t);
}
static double at(const struct imp_texture *t, double u, double v, int lane)
{
    const struct imp_texcoord c = {.uv = {u, v}};
    imp_spec s;
    t->ops->eval(t, &c, false, &s);
    return s[lane];
}

/* 4 x 2, value 10 y + x in red, 100 in green, 0 in blue. */
static const struct imp_image_data *ramp(void)
{
    static float pixels[24];
    static struct imp_image_data im = {4, 2, 3, pixels, false};
    for (int i = 0; i < 8; i++) {
        pixels[3 * i] = (float)(10 * (i / 4) + i % 4);
        pixels[3 * i + 1] = 100;
    }
    return &im;
}

static void lookups(void)
{
    struct imp_texture t;
    struct imp_node *n = node_make("bitmap");
    tap_ok(make(n, ramp(), IMP_RGB, NULL, &t) == IMP_OK && bulk_lo == 0, "bitmap");
    bool centres = true;
    for (int y = 0; y < 2; y++)
        for (int x = 0; x < 4; x++)
            centres &=
                fabs(at(&t, (x + 0.5) / 4, (y + 0.5) / 2, 0) - (10 * y + x)) < 1e-12;
    tap_ok(centres, "texel centres, row 0 at v = 0");
    tap_near(at(&t, 0.375 + 0.1, 0.25, 0), 1.4, 1e-12, 0, "linear between two texels");
    tap_near(at(&t, 0.375, 0.5, 0), 6, 1e-12, 0, "linear between two rows");
    tap_near(at(&t, 0, 0.25, 0), 1.5, 1e-12, 0,
             "repeat: the border blends with the far side");
    tap_near(at(&t, 5.375, -2.75, 0), 1, 1e-12, 0, "repeat: any number of turns");
    tap_near(at(&t, 0.4, 0.4, 1), 100, 1e-12, 0, "green");

    n = node_make("bitmap");
    string_add(n, "wrap_mode", "clamp");
    tap_ok(make(n, ramp(), IMP_RGB, NULL, &t) == IMP_OK, "clamp");
    tap_near(at(&t, 0, 0.25, 0), 0, 0, 1e-12, "clamp: edge texel");
    tap_near(at(&t, 9, 9, 0), 13, 1e-12, 0, "clamp: far outside");
    n = node_make("bitmap");
    string_add(n, "wrap_mode", "mirror");
    tap_ok(make(n, ramp(), IMP_RGB, NULL, &t) == IMP_OK, "mirror");
    tap_near(at(&t, 0, 0.25, 0), 0, 0, 1e-12, "mirror: the edge texel twice");
    tap_near(at(&t, 1.125, 0.25, 0), 3, 1e-12, 0, "mirror: back from the far side");
    tap_near(at(&t, -0.375, 1.25, 0), 11, 1e-12, 0, "mirror: before the near side");
    tap_near(at(&t, 2.375, 4.25, 0), 1, 1e-12, 0, "mirror: period 2");
    n = node_make("bitmap");
    string_add(n, "filter_type", "nearest");
    tap_ok(make(n, ramp(), IMP_RGB, NULL, &t) == IMP_OK, "nearest");
    tap_near(at(&t, 0.499, 0.499, 0), 1, 1e-12, 0, "nearest: inside a texel");
    tap_near(at(&t, 0.5, 0.5, 0), 12, 1e-12, 0, "nearest: on its border");
    tap_near(at(&t, -1e-12, 1.0, 0), 3, 1e-12, 0, "nearest: just outside");

    static const double wild[] = {NAN,    INFINITY, -INFINITY, 1e300,
                                  -1e300, 1e18,     0,         -1e-300};
    static const char *const modes[] = {"repeat", "mirror", "clamp"};
    bool finite = true;
    for (int m = 0; m < 6; m++) {
        n = node_make("bitmap");
        string_add(n, "wrap_mode", modes[m % 3]);
        string_add(n, "filter_type", m < 3 ? "nearest" : "bilinear");
        if (make(n, ramp(), IMP_RGB, NULL, &t) != IMP_OK) finite = false;
        for (size_t i = 0; i < 64; i++) {
            const double x = at(&t, wild[i % 8], wild[i / 8], 0);
            finite &= x >= 0 && x <= 13;
        }
    }
    tap_ok(finite, "wild coordinates stay inside");

    n = node_make("bitmap");
    matrix_add(n, (double[]){0, 2, 0, 0.25, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    tap_ok(make(n, ramp(), IMP_RGB, NULL, &t) == IMP_OK, "to_uv");
    tap_near(at(&t, 0.75, 0.3125, 0), at(&t, 0.75, 0.8125, 0), 1e-12, 0,
             "to_uv: tiled twice");
    /* u' = 2 v + .25 = .875, v' = u = .75: texel (3, 1). */
    tap_near(at(&t, 0.75, 0.3125, 0), 13, 1e-12, 0, "to_uv: rotated and moved");
}

static void conversions(void)
{
    struct imp_texture t;
    float half[6] = {0.5f, 0.5f, 0.5f, 0.2f, 0.4f, 0.6f}, dot = 0.7f,
          bad[3] = {1, NAN, 1};
    const struct imp_image_data coded = {2, 1, 3, half, true},
                                linear = {2, 1, 3, half, false},
                                one = {1, 1, 1, &dot, false}, nan = {1, 1, 3, bad, false};
    struct imp_node *n = node_make("bitmap");
    tap_ok(make(n, &coded, IMP_RGB, NULL, &t) == IMP_OK, "sRGB");
    tap_near(at(&t, 0.25, 0.5, 0), 0.21404114048, 1e-7, 0, "decoded before filtering");
    n = node_make("bitmap");
    imp__node_add(&arena, n, "raw", IMP_PROP_BOOL, n->loc)->integer = 1;
    tap_ok(make(n, &coded, IMP_RGB, NULL, &t) == IMP_OK, "raw");
    tap_near(at(&t, 0.25, 0.5, 0), 0.5, 1e-7, 0, "raw: as stored");
    tap_ok(make(node_make("bitmap"), &linear, IMP_MONO, NULL, &t) == IMP_OK, "mono");
    tap_near(at(&t, 0.75, 0.5, 0), imp__luminance(0.2, 0.4, 0.6), 1e-7, 0,
             "mono: luminance");
    tap_ok(make(node_make("bitmap"), &one, IMP_RGB, NULL, &t) == IMP_OK, "one texel");
    tap_ok(fabs(at(&t, -3.2, 0.1, 0) - 0.7) < 1e-7 &&
               at(&t, 0.9, 7, 2) == at(&t, 0, 0, 0),
           "one texel is a constant in all lanes");
    const float below = -0.25f;
    const struct imp_image_data negative = {1, 1, 1, &below, false};
    tap_ok(make(node_make("bitmap"), &negative, IMP_RGB, NULL, &t) == IMP_OK &&
               bulk_lo == -INFINITY,
           "texels below 0 have no lower bound");
    tap_ok(make(node_make("bitmap"), NULL, IMP_RGB, NULL, &t) == IMP_E_SCENE,
           "no picture # %s", imp_last_error(ctx));
    tap_ok(make(node_make("bitmap"), &nan, IMP_RGB, NULL, &t) == IMP_E_SCENE,
           "NaN texel # %s", imp_last_error(ctx));
    n = node_make("bitmap");
    string_add(n, "wrap_mode", "loop");
    tap_ok(make(n, &one, IMP_RGB, NULL, &t) == IMP_E_SCENE, "unknown wrap mode # %s",
           imp_last_error(ctx));
}

/* ---- Derivatives --------------------------------------------------------------- */

enum { N = 3 * 7 * 5 };
struct gather {
    struct imp_sink sink;
    double g[3][N + 8]; /* by lane: sinks may tell channels apart */
};
static void gather_add(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct gather *g = (struct gather *)sink;
    for (int c = 0; c < 3; c++)
        g->g[c][(size_t)param * 4 + element + (channels == 3 ? (size_t)c : 0)] +=
            (*bar)[c];
}
static double read_dot(const void *x_dot, int param, size_t element)
{
    return ((const double *)x_dot)[(size_t)param * 4 + element];
}

/* <scatter(bar), x> = <bar, tangent(x)>, lane by lane. */
static void transpose_check(const struct imp_input *in, int spots, const char *what)
{
    double worst = 0;
    double x[N + 8];
    const struct imp_key key = imp__key(1, 2, 3);
    for (int i = 0; i < N + 8; i++) x[i] = imp__u01(key, (uint32_t)i) - 0.5;
    for (int i = 0; i < spots; i++) {
        const struct imp_key k = imp__key(5, (uint64_t)i, 0);
        const struct imp_texcoord c = {
            .uv = {4 * imp__u01(k, 0) - 2, 4 * imp__u01(k, 1) - 2}};
        const imp_spec bar = {imp__u01(k, 2), imp__u01(k, 3) - 0.5, -imp__u01(k, 4), NAN};
        struct gather g = {.sink = {gather_add}};
        const struct imp_input *const list[1] = {in};
        imp_spec dot;
        imp__inputs_scatter(list, 1, &c, &bar, &g.sink);
        imp__inputs_tangent(list, 1, &c, read_dot, x, &dot);
        for (int l = 0; l < 3; l++) {
            double sum = 0;
            for (int j = 0; j < N + 8; j++) sum += g.g[l][j] * x[j];
            worst = fmax(worst, fabs(sum - bar[l] * dot[l]));
        }
    }
    tap_ok(worst < 1e-14, "%s: scatter and tangent are transposes # %.1e", what, worst);
}

/* eval is linear in the data: tangent(data) = eval. */
static void linear_check(const struct imp_input *in, const double *data, const char *what)
{
    double worst = 0;
    for (int i = 0; i < 200; i++) {
        const struct imp_key k = imp__key(6, (uint64_t)i, 0);
        const struct imp_texcoord c = {
            .uv = {4 * imp__u01(k, 0) - 2, 4 * imp__u01(k, 1) - 2}};
        const struct imp_input *const list[1] = {in};
        imp_spec dot, value;
        imp__inputs_tangent(list, 1, &c, read_dot, data, &dot);
        imp__inputs_eval(list, 1, &c, &value);
        for (int l = 0; l < 3; l++) worst = fmax(worst, fabs(dot[l] - value[l]));
    }
    tap_ok(worst < 1e-12, "%s: tangent is the derivative of eval # %.1e", what, worst);
}

/* d value / d(u, v) against central differences, which are exact for what is bilinear;
 * spots where the two sides differ lie on the border of a texel. */
static void slope_check(const struct imp_texture *t, bool scalar, const char *what)
{
    const double h = 1e-5;
    double worst = 0;
    int n = 0;
    for (int i = 0; i < 200; i++) {
        const struct imp_key k = imp__key(7, (uint64_t)i, 0);
        const struct imp_texcoord c = {
            .uv = {4 * imp__u01(k, 0) - 2, 4 * imp__u01(k, 1) - 2}};
        imp_spec d[2], mid;
        if (!t->ops->slope(t, &c, scalar, d)) break;
        t->ops->eval(t, &c, scalar, &mid);
        for (int a = 0; a < 2; a++) {
            struct imp_texcoord plus = c, minus = c;
            imp_spec p, m;
            plus.uv[a] += h;
            minus.uv[a] -= h;
            t->ops->eval(t, &plus, scalar, &p);
            t->ops->eval(t, &minus, scalar, &m);
            if (fabs(p[0] - 2 * mid[0] + m[0]) > 1e-7) continue;
            for (int l = 0; l < 3; l++)
                worst = fmax(worst, fabs((p[l] - m[l]) / (2 * h) - d[a][l]));
            n++;
        }
    }
    tap_ok(n > 300 && worst < 1e-8, "%s: slope # %.1e of %d", what, worst, n);
}

static void derivatives(void)
{
    static const char *const modes[] = {"repeat", "mirror", "clamp"};
    float pixels[N];
    double data[N + 8] = {0};
    for (int i = 0; i < N; i++) {
        pixels[i] = (float)imp__u01(imp__key(8, 8, 8), (uint32_t)i);
        data[i] = pixels[i];
    }
    for (int m = 0; m < 24; m++) {
        struct imp_texture t;
        char what[128];
        const bool scalar = m & 1, nearest = m & 2, grey = m & 4;
        struct imp_image_data im = {7, 5, grey ? 1 : 3, pixels, false};
        struct imp_node *n = node_make("bitmap");
        string_add(n, "wrap_mode", modes[m / 8]);
        string_add(n, "filter_type", nearest ? "nearest" : "bilinear");
        matrix_add(n,
                   (double[]){1.3, 0.2, 0, 0.1, -0.4, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
        if (make(n, &im, IMP_RGB, NULL, &t) != IMP_OK)
            tap_ok(0, "%s", imp_last_error(ctx));
        const struct imp_input in = {.texture = &t, .param = -1, .scalar = scalar};
        snprintf(what, sizeof what, "bitmap %s%s%s%s", modes[m / 8],
                 nearest ? " nearest" : "", grey ? " grey" : "",
                 scalar ? " as one number" : "");
        transpose_check(&in, 100, what);
        linear_check(&in, data, what);
        const struct imp_texcoord middle = {.uv = {0.5, 0.5}};
        imp_spec d[2];
        if (!nearest) slope_check(&t, scalar, what);
        else tap_ok(!t.ops->slope(&t, &middle, scalar, d), "%s: jumps, no slope", what);

        struct imp_texture lit;
        const struct imp_input *nested[1] = {
            &(struct imp_input){.texture = &t, .param = -1}};
        struct imp_node *lamp = node_make("d65");
        imp__node_add(&arena, lamp, "scale", IMP_PROP_FLOAT, lamp->loc)->number[0] = 2.5;
        if (make(lamp, NULL, IMP_RGB, nested, &lit) != IMP_OK)
            tap_ok(0, "%s", imp_last_error(ctx));
        const struct imp_input light = {.texture = &lit, .param = -1, .scalar = scalar};
        snprintf(what, sizeof what, "d65 around bitmap %d", m);
        transpose_check(&light, 20, what);
        linear_check(&light, data, what);
        tap_near(at(&lit, 0.3, 0.4, 1), 2.5 * at(&t, 0.3, 0.4, 1), 1e-15, 0,
                 "d65 scales");
    }

    /* Constants: parameter 0 is an rgb, parameter 1 one number. */
    const double x[N + 8] = {0.1, 0.2, 0.3, 0, 0.4};
    struct imp_input rgb = {.value = {0.1, 0.2, 0.3, 0}, .param = 0, .count = 3},
                     one = {.value = imp__spec(0.4), .param = 1, .count = 1};
    transpose_check(&rgb, 20, "rgb constant");
    transpose_check(&one, 20, "number");
    linear_check(&rgb, x, "rgb constant");
    linear_check(&one, x, "number");
    rgb.scalar = true;
    transpose_check(&rgb, 20, "rgb constant as one number");
    linear_check(&rgb, x, "rgb constant as one number");
    rgb.scalar = false;

    struct imp_texture t;
    const struct imp_input *colors[2] = {&rgb, &one};
    struct imp_node *n = node_make("checkerboard");
    matrix_add(n, (double[]){2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    tap_ok(make(n, NULL, IMP_RGB, colors, &t) == IMP_OK, "checkerboard");
    for (int scalar = 0; scalar < 2; scalar++) {
        const struct imp_input in = {.texture = &t, .param = -1, .scalar = scalar};
        transpose_check(&in, 100, scalar ? "checkerboard as one number" : "checkerboard");
        linear_check(&in, x, scalar ? "checkerboard as one number" : "checkerboard");
    }
}

static void checkerboard(void)
{
    struct imp_texture t;
    struct imp_input a = {.value = {0.1, 0.2, 0.3, 0}, .param = -1, .count = 3},
                     b = {.value = imp__spec(0.8), .param = -1, .count = 1};
    const struct imp_input *colors[2] = {&a, &b};
    tap_ok(make(node_make("checkerboard"), NULL, IMP_RGB, colors, &t) == IMP_OK,
           "checkerboard");
    tap_ok(at(&t, 0.2, 0.3, 1) == 0.2 && at(&t, 0.7, 0.9, 1) == 0.2,
           "equal parity: color0");
    tap_ok(at(&t, 0.7, 0.3, 1) == 0.8 && at(&t, -0.8, 0.9, 1) == 0.8,
           "other parity: color1");
    tap_ok(at(&t, 0.5, 0.5, 1) == 0.2 && at(&t, 3.2, -1.7, 1) == 0.2,
           "borders and turns");
    const struct imp_texcoord c = {.uv = {0.2, 0.3}}, d = {.uv = {0.7, 0.3}};
    imp_spec s;
    t.ops->eval(&t, &c, true, &s);
    tap_ok(s[0] == 0.8, "as one number the two are swapped");
    t.ops->eval(&t, &d, true, &s);
    tap_near(s[1], (0.1 + 0.2 + 0.3) / 3, 1e-15, 0, "and a colour is its mean");
}

int main(void)
{
    const struct imp_context_options options = {.size = sizeof options, .threads = 1};
    if (imp_context_create(&options, &ctx) != IMP_OK) return 1;
    imp__arena_init(&arena, ctx);
    lookups();
    conversions();
    checkerboard();
    derivatives();
    imp__arena_free(&arena);
    imp_context_destroy(ctx);
    return tap_done();
}
