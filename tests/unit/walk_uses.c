/* SPDX-License-Identifier: Apache-2.0
 *
 * What the record of a walk offers to transports that are not there yet, against closed
 * forms: adjoints that enter at any vertex, side walks, wavelengths, luminances.
 *
 * The room is a sphere that glows with E and reflects rho. Its light is never sampled
 * (another lamp, which is dark, takes all samples), so every walk has the same value:
 *
 *     L = sum over k < D of a_k rho^k E,    a_k the adjoint that enters at vertex k */
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/build.h"
#include "walk/core/walk.h"
#include <math.h>

enum { D = 5, WALKS = 200 };
/* A step is made of two floats, each half a unit of 2^-24 off. */
#define STORED (2 * D * 0x1p-24)

static imp_context *ctx;
static const double rho[3] = {0.5, 0.3, 0.8}, glow[3] = {1, 2, 0.25};

#define ROOM(reflectance, radiance)                                                      \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='5'/><integer name='rr_depth' value='99'/></integrator>"                      \
    "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='8'/>"  \
    "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"            \
    "<shape type='sphere'><boolean name='flip_normals' value='true'/>"                   \
    "<bsdf type='diffuse' id='wall'>" reflectance "</bsdf><emitter type='area' "         \
    "id='glow'><float name='sampling_weight' value='0'/>" radiance "</emitter></shape>"  \
    "<emitter type='point'><rgb name='intensity' value='0'/></emitter></scene>"

struct room {
    imp_scene *scene;
    uint8_t *chosen;
    struct imp_active active;
    struct imp_tracer tracer;
    struct imp_arena arena;
};
static void choose(struct room *r)
{
    r->chosen = calloc(r->scene->n_params + 1, 1);
    for (size_t k = 0; k < r->scene->n_params; k++)
        r->chosen[k] = (r->scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(ctx, imp__active_create(r->scene, r->chosen, &r->active));
    r->tracer = (struct imp_tracer){.scene = r->scene,
                                    .integrator = imp__walk_integrator(r->scene),
                                    .sensor = r->scene->sensors[0],
                                    .active = &r->active,
                                    .seed = 5};
    imp__arena_init(&r->arena, ctx);
}
static void leave(struct room *r)
{
    imp__arena_free(&r->arena);
    imp__active_destroy(ctx, &r->active);
    free(r->chosen);
    imp_scene_destroy(r->scene);
}
static void colours(struct room *r)
{
    r->scene = test_scene_text(ctx,
                               ROOM("<rgb name='reflectance' value='.5,.3,.8'/>",
                                    "<rgb name='radiance' value='1,2,.25'/>"),
                               IMP_RGB);
    choose(r);
}

struct gather {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    double g[64];
};
static void gather_add(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct gather *g = (struct gather *)sink;
    const int64_t base = g->active->base[param];
    if (base < 0) return;
    for (int c = 0; c < 3 + (channels == 1); c++)
        g->g[(size_t)base + element + (channels == 3 ? (size_t)c : 0)] += (*bar)[c];
}
static struct gather swept(const struct room *r, const struct imp_walk *w, imp_spec one)
{
    struct gather g = {.sink = {.add = gather_add}, .active = &r->active};
    imp__walk_sweep_values(&r->tracer, w, one, &g.sink);
    return g;
}

/* sum a_k x^k and its derivative by x. */
static double poly(const double *a, double x, double *slope)
{
    double sum = 0;
    *slope = 0;
    for (int k = D - 1; k >= 0; k--) {
        *slope = *slope * x + sum;
        sum = sum * x + a[k];
    }
    return sum;
}

static size_t index_of(const struct room *r, const char *name)
{
    size_t k;
    test_must(ctx, imp_scene_find_param(r->scene, name, &k));
    return (size_t)r->active.base[k];
}

/* Value, gradient, tangent and frozen value of one walk against the closed form. */
static double walk_error(const struct room *r, struct imp_walk *w, const double *a)
{
    const size_t wall = index_of(r, "wall.reflectance.value"),
                 lamp = index_of(r, "glow.radiance.value");
    const imp_spec L = imp__walk_fold(w), frozen = imp__walk_frozen(&r->tracer, w);
    const struct gather g = swept(r, w, (imp_spec){1, 1, 1, 0});
    double worst = 0, x_dot[64] = {0};
    for (size_t c = 0; c < 3; c++) /* the dark lamp stays dark */
        x_dot[wall + c] = 0.3 + (double)c, x_dot[lamp + c] = 1.1 - (double)c;
    const imp_spec dot = imp__walk_tangent(&r->tracer, w, x_dot);
    for (size_t c = 0; c < 3; c++) {
        double slope;
        const double p = poly(a, rho[c], &slope), size = p + slope;
        const double want = x_dot[wall + c] * glow[c] * slope + x_dot[lamp + c] * p;
        worst = fmax(worst, fabs(L[c] - glow[c] * p) / size);
        worst = fmax(worst, fabs(frozen[c] - glow[c] * p) / size);
        worst = fmax(worst, fabs(g.g[wall + c] - glow[c] * slope) / size);
        worst = fmax(worst, fabs(g.g[lamp + c] - p) / size);
        worst = fmax(worst, fabs(dot[c] - want) / (1 + fabs(want)));
    }
    return worst;
}

/* ---- Adjoints at inner vertices --------------------------------------------------- */

static void entries(void)
{
    struct room r;
    double whole = 0, inner = 0, mixed = 0, parts = 0;
    colours(&r);
    for (int i = 0; i < WALKS; i++) {
        static const double all[D] = {1, 1, 1, 1, 1}, any[D] = {0.5, -2, 0, 3, 1};
        const struct imp_arena_mark mark = imp__arena_mark(&r.arena);
        struct imp_walk w;
        struct imp_entry entry[D] = {0};
        imp_spec sum = {0};
        imp__walk_trace(&r.tracer, &r.arena, i % 8, i / 8 % 8, i, &w);
        const imp_spec L = w.L;
        whole = fmax(whole, walk_error(&r, &w, all));
        w.entry = entry;
        for (int j = 0; j < D; j++) {
            double one[D] = {0};
            one[j] = 1;
            for (int k = 0; k < D; k++) entry[k].e = entry[k].b = imp__spec(one[k]);
            inner = fmax(inner, walk_error(&r, &w, one));
            sum += imp__walk_fold(&w);
        }
        for (int k = 0; k < D; k++) entry[k].e = entry[k].b = imp__spec(any[k]);
        mixed = fmax(mixed, walk_error(&r, &w, any));
        for (int c = 0; c < 3; c++) parts = fmax(parts, fabs(sum[c] / L[c] - 1));
        imp__arena_rewind(&r.arena, mark);
    }
    tap_ok(whole < STORED, "glowing room: L, sweep, tangent, frozen # %.1e", whole);
    tap_ok(inner < STORED, "adjoint at vertex j: rho^j and its derivatives # %.1e",
           inner);
    tap_ok(mixed < 8 * STORED, "another adjoint at each vertex # %.1e", mixed);
    tap_ok(parts < 1e-14, "the vertices' parts add up to L # %.1e", parts);
    leave(&r);
}

/* ---- Side walks ------------------------------------------------------------------- */

static void sides(void)
{
    struct room r;
    double error = 0, value = 0;
    int hanging = 0;
    colours(&r);
    r.tracer.split = 4;
    for (int i = 0; i < WALKS; i++) {
        static const double all[D] = {1, 1, 1, 1, 1};
        const struct imp_arena_mark mark = imp__arena_mark(&r.arena);
        struct imp_tracer plain = r.tracer;
        struct imp_walk w, v;
        plain.value_only = true;
        imp__walk_trace(&r.tracer, &r.arena, i % 8, i / 8 % 8, i, &w);
        imp__walk_trace(&plain, &r.arena, i % 8, i / 8 % 8, i, &v);
        for (const struct imp_side *s = w.first->side; s; s = s->next)
            hanging += s->walk.n == D;
        error = fmax(error, walk_error(&r, &w, all));
        for (int c = 0; c < 3; c++) value = fmax(value, fabs(v.L[c] - w.L[c]));
        imp__arena_rewind(&r.arena, mark);
    }
    tap_ok(hanging == 3 * WALKS, "three side walks hang on each first vertex # %d",
           hanging);
    tap_ok(error < STORED, "split: L, sweep, tangent, frozen # %.1e", error);
    tap_ok(value == 0, "the same bits where only the value is wanted # %.1e", value);
    leave(&r);
}

/* Where walks differ: the mean stays, and the sample with its branches is less noisy.
 * Lights are met by continuations alone: what a light sample brings is not split. */
static void split_means(void)
{
    struct room r = {.scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8")};
    struct tap_stat one = {0}, four = {0}, less = {0};
    struct tap_stat few_one = {0}, few_four = {0}; /* of 64 walks, one a pixel */
    double dot = 0;
    choose(&r);
    struct imp_walk_integrator met = *r.tracer.integrator;
    met.lights = false;
    r.tracer.integrator = &met;
    for (int i = 0; i < 25600; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&r.arena);
        struct imp_walk w;
        double x_dot[64];
        r.tracer.split = 0;
        imp__walk_trace(&r.tracer, &r.arena, i % 8, i / 8 % 8, i, &w);
        tap_add(&one, w.L[0]);
        tap_add(&few_one, w.L[0]);
        r.tracer.split = 4;
        r.tracer.seed = 6;
        imp__walk_trace(&r.tracer, &r.arena, i % 8, i / 8 % 8, i, &w);
        tap_add(&four, w.L[0]);
        tap_add(&few_four, w.L[0]);
        if (i % 64 == 63) {
            tap_add(&less, imp__sqr(tap_se(&few_one)) - imp__sqr(tap_se(&few_four)));
            few_one = few_four = (struct tap_stat){0};
        }
        const struct gather g = swept(&r, &w, (imp_spec){1, 1, 1, 0});
        double reverse = 0;
        for (size_t k = 0; k < r.active.n; k++) {
            x_dot[k] = imp__u01(imp__key(8, k, 0), 0);
            reverse += x_dot[k] * g.g[k];
        }
        const double forward = imp__sum3(imp__walk_tangent(&r.tracer, &w, x_dot));
        dot = fmax(dot, fabs(forward - reverse) / (1 + fabs(forward)));
        imp__arena_rewind(&r.arena, mark);
    }
    const double z = (four.mean - one.mean) / hypot(tap_se(&one), tap_se(&four));
    tap_ok(fabs(z) < 4.5, "Cornell box, split: the same mean # z %.2f", z);
    /* The variance of blocks of samples, which are independent. */
    tap_ok(less.mean > 4 * tap_se(&less),
           "and less noise a sample # se %.2g, %.2g, z %.1f", tap_se(&four), tap_se(&one),
           less.mean / tap_se(&less));
    tap_ok(dot < 1e-12, "split: forward and reverse # %.1e", dot);
    leave(&r);
}

/* ---- Wavelengths ------------------------------------------------------------------ */

static const double nodes[4] = {400, 500, 600, 700};
static double at(const double *v, double nm, int k) /* k >= 0: d/dv[k] */
{
    double sum = 0;
    if (nm < 400 || nm > 700) return 0;
    for (int i = 0; i < 4; i++) {
        const double hat = fmax(0, 1 - fabs(nm - nodes[i]) / 100);
        sum += k < 0 ? hat * v[i] : i == k ? hat : 0;
    }
    return sum;
}

static void wavelengths(void)
{
    static const double R[4] = {.2, .6, .4, .9}, E[4] = {1, 3, 2, .5};
    struct room r = {.scene =
                         test_scene_text(ctx,
                                         ROOM("<spectrum name='reflectance' "
                                              "value='400:.2, 500:.6, 600:.4, 700:.9'/>",
                                              "<spectrum name='radiance' "
                                              "value='400:1, 500:3, 600:2, 700:.5'/>"),
                                         IMP_SPECTRAL)};
    static const double all[D] = {1, 1, 1, 1, 1};
    double value = 0, gradient = 0, frozen = 0, single = 0;
    choose(&r);
    const struct imp_wavelengths *four = r.scene->wavelengths;
    const size_t wall = index_of(&r, "wall.reflectance.values"),
                 lamp = index_of(&r, "glow.radiance.values");
    for (int i = 0; i < WALKS; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&r.arena);
        struct imp_walk w;
        struct imp_wavelengths one = *four;
        r.tracer.wavelengths = four;
        imp__walk_trace(&r.tracer, &r.arena, i % 8, i / 8 % 8, i, &w);
        const imp_spec F = imp__walk_frozen(&r.tracer, &w);
        imp_spec L = {0};
        for (int c = 0; c < 4; c++) {
            const double nm = w.waves->carried.nm[c], e = at(E, nm, -1);
            double slope, p = poly(all, at(R, nm, -1), &slope);
            imp_spec lane = {0};
            lane[c] = 1;
            L[c] = e * p;
            const struct gather g = swept(&r, &w, lane);
            for (int k = 0; k < 4; k++) {
                const double by_r = e * slope * at(R, nm, k), by_e = p * at(E, nm, k);
                gradient =
                    fmax(gradient, fabs(g.g[wall + (size_t)k] - by_r) / (1 + by_r));
                gradient =
                    fmax(gradient, fabs(g.g[lamp + (size_t)k] - by_e) / (1 + by_e));
            }
        }
        const imp_spec seen = imp__walk_seen(&w, L);
        for (int c = 0; c < 3; c++) {
            value = fmax(value, fabs(w.L[c] - seen[c]) / (1 + fabs(seen[c])));
            frozen = fmax(frozen, fabs(F[c] - w.L[c]) / (1 + fabs(seen[c])));
        }
        one.lanes = 1;
        r.tracer.wavelengths = &one;
        imp__walk_trace(&r.tracer, &r.arena, i % 8, i / 8 % 8, i, &w);
        const double nm = w.waves->carried.nm[0];
        double slope;
        L = imp__spec(at(E, nm, -1) * poly(all, at(R, nm, -1), &slope));
        const imp_spec alone = imp__walk_seen(&w, L);
        for (int c = 0; c < 3; c++)
            single = fmax(single, fabs(w.L[c] - alone[c]) / (1 + fabs(alone[c])));
        imp__arena_rewind(&r.arena, mark);
    }
    tap_ok(value < STORED, "four wavelengths: E sum rho^k # %.1e", value);
    tap_ok(frozen < 1e-14, "and evaluated again # %.1e", frozen);
    tap_ok(gradient < STORED, "and by the samples of both spectra # %.1e", gradient);
    tap_ok(single < STORED, "one wavelength in all lanes # %.1e", single);
    leave(&r);
}

/* ---- An input that is the luminance of another -------------------------------------- */

static double read_dot(const void *x_dot, int param, size_t element)
{
    return ((const double *)x_dot)[3 * param + (int)element];
}
struct apart {
    struct imp_sink sink; /* first */
    double x[2][3][3];    /* [param][number][lane] */
};
static void apart_add(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    struct apart *a = (struct apart *)sink;
    for (int c = 0; c < 3; c++)
        a->x[param][element + (size_t)(channels == 3 ? c : 0)][c] += (*bar)[c];
}

static void luminances(void)
{
    static const double weight[3] = {0.212671, 0.715160, 0.072169};
    const struct imp_input tint = {.value = {.2, .5, .7, NAN}, .param = 0, .count = 3};
    const struct imp_input number = {.value = imp__spec(.4), .param = 1, .count = 1};
    const struct imp_input of_tint = {.param = -1,
                                      .count = 1,
                                      .luminance = 2,
                                      .weight = {weight[0], weight[1], weight[2], 0}};
    const struct imp_input *const list[3] = {&tint, &number, &of_tint};
    const struct imp_texcoord where = {.uv = {0, 0}};
    const double x_dot[6] = {1, -2, 3, .5, 0, 0};
    const imp_spec bar[3] = {{.3, .1, -.2, NAN}, {1, 2, 3, NAN}, {.7, -.4, 2, NAN}};
    imp_spec in[3], in_dot[3];
    struct apart a = {.sink = {apart_add, true}};
    imp__inputs_eval(list, 3, &where, in);
    imp__inputs_tangent(list, 3, &where, read_dot, x_dot, in_dot);
    imp__inputs_scatter(list, 3, &where, bar, &a.sink);
    const double Y = .2 * weight[0] + .5 * weight[1] + .7 * weight[2];
    const double Y_dot = weight[0] - 2 * weight[1] + 3 * weight[2];
    double value = 0, reverse = 0;
    for (int c = 0; c < 3; c++) {
        value = fmax(value, fabs(in[2][c] - Y));
        value = fmax(value, fabs(in_dot[2][c] - Y_dot));
        for (int n = 0; n < 3; n++) { /* lane c of the picture by number n of the tint */
            const double want = (n == c ? bar[0][c] : 0) + weight[n] * bar[2][c];
            reverse = fmax(reverse, fabs(a.x[0][n][c] - want));
        }
        reverse = fmax(reverse, fabs(a.x[1][0][c] - bar[1][c]));
    }
    tap_ok(value < 1e-15, "luminance of another input, and its tangent # %.1e", value);
    tap_ok(reverse < 1e-15, "and its transpose, lane by lane # %.1e", reverse);
}

int main(void)
{
    ctx = test_context(1);
    entries();
    sides();
    split_means();
    wavelengths();
    luminances();
    imp_context_destroy(ctx);
    return tap_done();
}
