/* SPDX-License-Identifier: Apache-2.0
 *
 * envmap: a picture of the light from all around (sphere_map.h),
 *
 *     L(d) = scale map(R d),    R: to_world undone, then `rotation` about the map's up.
 *
 * The map is bilinear in the texels, a sum of hats with the luminances l_k of the texels
 * in front. So it is drawn as it is interpolated: texel k with probability l_k w_k/N, w_k
 * the solid angle of its hat, and a direction by the hat. All together have the density
 *
 *     p(d) = l(d)/N,    l(d) = sum l_k hat_k(d),    N = sum l_k w_k,
 *
 * exactly, and 0 only where the map is. It follows the texels through `changed`.
 *
 * The rotation moves the lookup along the columns, u = phi/2pi + rotation/360, by a
 * derivative that is the slope of the map: it is continuous and moves no edge of
 * visibility. */
#include "color/rgb.h"
#include "emission.h"
#include "emitter_lanes.h"
#include "kind/build.h"
#include "kind/shape/shape.h"
#include "kind/texture/bitmap.h"
#include "math/trig.h"
#include "math/warp.h"
#include "math/weight_table.h"
#include "sphere_map.h"

enum { DATA, SCALE, ROTATION };

static const struct imp_input_desc inputs[] = {{.name = "data",
                                                .role = IMP_EMISSION,
                                                .flags = IMP_INPUT_DAYLIGHT,
                                                .fallback = 1,
                                                .unit = "W m^-2 sr^-1"},
                                               {.name = "scale",
                                                .role = IMP_UNBOUNDED,
                                                .flags = IMP_INPUT_SCALAR,
                                                .fallback = 1,
                                                .unit = "1"},
                                               {.name = "rotation",
                                                .role = IMP_UNBOUNDED,
                                                .flags = IMP_INPUT_SCALAR,
                                                .lo = -INFINITY,
                                                .hi = INFINITY,
                                                .unit = "degree"},
                                               {0}};

struct envmap {
    struct imp__sphere_map map;
    struct imp__texels texels;
    struct imp__weight_table table;
    double *weight;              /* [height] solid angle of a texel's hat */
    struct imp__sphere_row *row; /* [height] */
    imp_v3 axis[3];              /* of the map, world, unit */
};

/* ---- Building ------------------------------------------------------------------ */

static double luminance(const struct imp__texels *t, size_t k)
{
    const float *p = t->data + k * (size_t)t->channels;
    return t->channels == 1 ? p[0] : imp__luminance(p[0], p[1], p[2]);
}

static void changed(const struct imp_emitter *e)
{
    const struct envmap *s = e->self;
    struct imp__weight_table t = s->table;
    const size_t n = (size_t)t.width * (size_t)t.height;
    for (size_t k = 0; k < n; k++) t.column[k] = luminance(&s->texels, k);
    imp__weight_table_sum(&t, s->weight);
}

static enum imp_status texels_check(const struct imp_build *b,
                                    const struct imp__texels *t)
{
    const size_t n = (size_t)t->width * (size_t)t->height;
    bool lit = false;
    if (t->width < 2 || t->height < 2)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "a map of %d x %d texels: it needs 2 x 2 or more",
                               t->width, t->height);
    if (t->negative >= 0)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "texel (%d, %d) of the map is negative: %g",
                               (int)(t->negative % t->width),
                               (int)(t->negative / t->width), t->negative_value);
    for (size_t k = 0; k < n * (size_t)t->channels; k++) lit |= t->data[k] > 0;
    if (!lit)
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "all %zu texels of the map are 0: there is no light in it",
                               n);
    return IMP_OK;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    static const char *const projections[] = {"latlong", "equal_area"};
    enum imp_status st = IMP_OK;
    struct envmap *s = self;
    const struct imp_texture *data = e->input[DATA]->texture;
    const char *filename;
    bool compensation;
    int projection;

    IMP_TRY(imp_build_string(b, "filename", NULL, &filename));
    IMP_TRY(imp_build_choice(b, "projection", projections, 2, IMP_LATLONG, &projection));
    /* Mitsuba's, for less noise: accepted, without effect here. */
    IMP_TRY(imp_build_bool(b, "mis_compensation", false, &compensation));
    IMP_TRY(imp__sky_axes(b, s->axis));
    if (!data || !imp__bitmap_texels(data, &s->texels))
        IMP_TRY(imp_build_error(b, "data", IMP_E_SCENE,
                                "data needs a picture: 'filename', or a texture of type "
                                "'bitmap'"));
    if (!s->texels.plain)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_UNSUPPORTED,
                                "its bitmap is bilinear and repeated, without to_uv: an "
                                "environment is turned by to_world or rotation"));
    if (e->input[SCALE]->texture || e->input[ROTATION]->texture)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "scale and rotation are numbers, not textures"));
    IMP_TRY(texels_check(b, &s->texels));
    const int w = s->texels.width, h = s->texels.height;
    s->map = (struct imp__sphere_map){(enum imp_sky_projection)projection, w, h};
    s->table = (struct imp__weight_table){
        w, h, imp_build_alloc(b, (size_t)h, sizeof(double)),
        imp_build_alloc(b, (size_t)w * (size_t)h, sizeof(double))};
    s->weight = imp_build_alloc(b, (size_t)h, sizeof(double));
    s->row = imp_build_alloc(b, (size_t)h, sizeof *s->row);
    if (!s->table.row || !s->table.column || !s->weight || !s->row)
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "scene: no memory for an environment"));
    for (int i = 0; i < h; i++) {
        s->weight[i] = imp__sphere_map_weight(&s->map, i);
        s->row[i] = imp__sphere_map_row(&s->map, i);
    }
    changed(e);
out:
    return st;
}

/* ---- Light --------------------------------------------------------------------- */

static double turns(const struct imp_emitter *e)
{
    return e->input[ROTATION]->value[0] / 360;
}

/* Where the map has direction w (world, towards the sky). */
static void lookup(const struct imp_emitter *e, imp_v3 w, double uv[2])
{
    const struct envmap *s = e->self;
    const imp_v3 d = imp__v3(imp__dot(w, s->axis[0]), imp__dot(w, s->axis[1]),
                             imp__dot(w, s->axis[2]));
    double u, row;
    imp__sphere_map_place(&s->map, d, &u, &row);
    u += turns(e);
    uv[0] = u - floor(u);
    uv[1] = (row + 0.5) / s->map.height;
}

static void place(const struct imp_emitter *e, const struct imp_emission *x, double uv[2])
{
    lookup(e, -x->d, uv);
}
static void place_d(const struct imp_emitter *e, const struct imp_emission *x, int j,
                    double duv[2])
{
    (void)e, (void)x;
    duv[0] = j == ROTATION ? 1.0 / 360 : 0;
    duv[1] = 0;
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    (void)e, (void)x;
    *le = in[DATA] * in[SCALE][0];
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    (void)e, (void)x;
    dle[DATA] = imp__spec(in[SCALE][0]);
    dle[SCALE] = in[DATA];
    dle[ROTATION] = imp__spec(0); /* through the lookup alone: place_d */
}

/* ---- Sampling ------------------------------------------------------------------ */

static double density(const struct imp_emitter *e, imp_v3 w)
{
    const struct envmap *s = e->self;
    const struct imp_texture *map = e->input[DATA]->texture;
    const double total = imp__weight_table_total(&s->table);
    struct imp_texcoord at = {.p = w};
    imp_spec l;
    if (!(total > 0)) return IMP_INV_PI / 4; /* all texels have been set to 0 */
    lookup(e, w, at.uv);
    map->ops->eval(map, &at, true, &l);
    return l[0] / total;
}

static imp_v3 draw(const struct imp_emitter *e, const double u[2])
{
    const struct envmap *s = e->self;
    double r[2], cos_theta, sin_theta;
    int i, j;
    if (!(imp__weight_table_total(&s->table) > 0)) return imp__uniform_sphere(u);
    imp__weight_table_draw(&s->table, u, &i, &j, r);
    imp__sphere_map_draw(&s->map, &s->row[i], i, r[1], &cos_theta, &sin_theta);
    const double column = (j + 0.5 + imp__hat_draw(r[0])) / s->map.width;
    const imp_v3 d = imp__sphere_direction(column - turns(e), cos_theta, sin_theta);
    return s->axis[0] * d[0] + s->axis[1] * d[1] + s->axis[2] * d[2];
}
static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    const imp_v3 w = draw(e, u);
    (void)ref;
    *out = (struct imp_light_sample){
        .wi = w, .dist = INFINITY, .pdf = density(e, w), .cos_light = 1};
    return true;
}

static double pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)ref, (void)hit, (void)at;
    return density(e, *wi);
}

static void move(struct imp_emitter *e, const double to_world[12])
{
    struct envmap *s = e->self;
    imp__sky_axes_turn(s->axis, to_world);
}

const struct imp_emitter_ops imp__envmap = {.size = sizeof(struct imp_emitter_ops),
                                            .name = "envmap",
                                            .object_size = sizeof(struct envmap),
                                            .flags = IMP_EMITTER_ENVIRONMENT |
                                                     IMP_EMITTER_GAPS,
                                            .inputs = inputs,
                                            .build = build,
                                            .eval = eval,
                                            .eval_d = eval_d,
                                            .sample = sample,
                                            .pdf = pdf,
                                            .changed = changed,
                                            .place = place,
                                            .place_d = place_d,
                                            .sample_emission = imp__sky_emission_sample,
                                            .pdf_emission = imp__sky_emission_pdf,
                                            .jumps = imp__sky_without_jumps,
                                            .move = move};

/* ---- In lanes ---------------------------------------------------------------------------- */

static bool covers(const struct imp_emitter *e)
{
    return imp__texture_lanes(e->input[DATA]->texture) && e->input[SCALE]->plain;
}

/* imp__sphere_map_place, and lookup. */
static void lookups(const struct imp_emitter *e, const imp_wide3 *w, imp_wide uv[2])
{
    const struct envmap *s = e->self;
    const imp_wide zero = imp__wide(0);
    const double height = s->map.height, last = s->map.height - 1;
    const imp_wide3 d = {imp__wide3_inner(*w, imp__wide3_of(s->axis[0])),
                         imp__wide3_inner(*w, imp__wide3_of(s->axis[1])),
                         imp__wide3_inner(*w, imp__wide3_of(s->axis[2]))};
    const imp_wide out = imp__wide_root(d.x * d.x + d.z * d.z),
                   around = IMP_WIDE_OF(imp__angles_signed)(-d.z, d.x) * (IMP_INV_PI / 2);
    const imp_wide u = imp__wide_choose(around < zero, around + 1, around) + turns(e);
    const imp_wide row =
        s->map.projection == IMP_LATLONG
            ? IMP_WIDE_OF(imp__angles_signed)(d.y, out) * IMP_INV_PI * last
            : (1 - d.y) * 0.5 * height - 0.5;
    uv[0] = u - imp__wide_floor(u);
    uv[1] =
        (imp__wide_larger(imp__wide_lesser(row, imp__wide(last)), zero) + 0.5) / height;
}

static imp_wide pdf_lanes(const struct imp_emitter *e, const imp_wide3 *ref,
                          const imp_wide3 *wi)
{
    const struct envmap *s = e->self;
    const struct imp_texture *map = e->input[DATA]->texture;
    const double total = imp__weight_table_total(&s->table);
    imp_wide uv[2];
    struct imp_wide_color l;
    (void)ref;
    if (!(total > 0)) return imp__wide(IMP_INV_PI / 4);
    lookups(e, wi, uv);
    imp__texture_lanes(map)->eval(map, uv, true, &l);
    return l.c[0] / total;
}
static void sample_lanes(const struct imp_emitter *e, const imp_wide3 *ref,
                         const imp_wide u[2], struct imp_wide_light *out)
{
    const struct envmap *s = e->self;
    unsigned left = imp__wide_bits(out->drawn);
    out->wi = imp__wide3_of(s->axis[1]);
    for (; left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        imp__wide3_set(&out->wi, k, draw(e, (double[]){u[0][k], u[1][k]}));
    }
    imp__wide_light_far(out);
    out->pdf = pdf_lanes(e, ref, &out->wi);
}
static void radiance_lanes(const struct imp_emitter *e, const imp_wide3 *wi,
                           struct imp_wide_color *le)
{
    const struct imp_texture *map = e->input[DATA]->texture;
    imp_wide uv[2];
    lookups(e, wi, uv);
    imp__texture_lanes(map)->eval(map, uv, false, le);
    for (int c = 0; c < 3; c++) le->c[c] *= e->input[SCALE]->value[0];
}

const struct imp_emitter_lanes imp__envmap_lanes = {.covers = covers,
                                                    .sample = sample_lanes,
                                                    .far = true,
                                                    .pdf = pdf_lanes,
                                                    .radiance = radiance_lanes};
