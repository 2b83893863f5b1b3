/* SPDX-License-Identifier: Apache-2.0
 *
 * sunsky: the clear sky of skylight.h with its sun, in the frame of Mitsuba's kind: z is up,
 * and the sun is at sun_direction, or where a place and a time put it. Below the
 * horizon all is black.
 *
 *     L = sky_scale L_sky + sun_scale L_sun (r_0/r)^2 inside the disc of radius r
 *
 * approximately: the disc may be larger than the sun's, r_0, and its power stays, so that
 * the factor is the ratio of their solid angles. L_sun is the mean over the disc, or darker
 * towards its limb and towards the horizon (complex_sun).
 *
 * Directions are drawn from the disc, evenly, and from cells of the upper hemisphere by the
 * luminance of the sky there, with a share of each by its power. */
#include "sunsky.h"
#include "color/rgb.h"
#include "emission.h"
#include "math/transform.h"
#include "math/trig.h"
#include "sky_sun.h"
#include "sun_position.h"

enum { TURBIDITY, ALBEDO, SKY_SCALE, SUN_SCALE, WAVELENGTH, N_INPUTS };

#define SCALE(key)                                                                       \
    {                                                                                    \
        .name = key, .role = IMP_UNBOUNDED,                                              \
        .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER, .fallback = 1, .unit = "1"         \
    }
static const struct imp_input_desc inputs[] = {
    {.name = "turbidity",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER,
     .fallback = 3,
     .lo = 1,
     .hi = 10,
     .unit = "1"},
    {.name = "albedo",
     .role = IMP_REFLECTANCE,
     .flags = IMP_INPUT_NUMBER,
     .fallback = 0.3,
     .hi = 1,
     .unit = "1"},
    SCALE("sky_scale"),
    SCALE("sun_scale"),
    {.name = "wavelength", .flags = IMP_INPUT_WAVELENGTH, .unit = "nm"},
    {0}};

#define SUN_RADIUS_DEGREES (0.5358 / 2)
enum { TURNS = 64, HEIGHTS = 32 }; /* cells, of equal solid angle */
#define CELL_LEAST  0.02           /* of the mean: what a cell's middle does not see */
#define SHARE_LEAST 0.05           /* of the sky, and of the sun */

static imp_v3 local(const struct sunsky *s, imp_v3 w)
{
    return imp__v3(imp__dot(w, s->axis[0]), imp__dot(w, s->axis[1]),
                   imp__dot(w, s->axis[2]));
}

static void eval(const struct imp_emitter *e, const imp_spec *in,
                 const struct imp_emission *x, imp_spec *le)
{
    const struct sunsky *s = e->self;
    struct sunsky_both b[4];
    imp__sunsky_lanes(s, in[TURBIDITY][0], &in[ALBEDO], &in[WAVELENGTH], local(s, -x->d),
                      b);
    for (int c = 0; c < 4; c++)
        (*le)[c] = in[SKY_SCALE][0] * b[c].sky.value + in[SUN_SCALE][0] * b[c].sun.value;
}
static void eval_d(const struct imp_emitter *e, const imp_spec *in,
                   const struct imp_emission *x, imp_spec *dle)
{
    const struct sunsky *s = e->self;
    const double sky = in[SKY_SCALE][0], sun = in[SUN_SCALE][0];
    struct sunsky_both b[4];
    imp__sunsky_lanes(s, in[TURBIDITY][0], &in[ALBEDO], &in[WAVELENGTH], local(s, -x->d),
                      b);
    for (int c = 0; c < 4; c++) {
        dle[TURBIDITY][c] = sky * b[c].sky.by_turbidity + sun * b[c].sun.by_turbidity;
        dle[ALBEDO][c] = sky * b[c].sky.by_albedo;
        dle[SKY_SCALE][c] = b[c].sky.value;
        dle[SUN_SCALE][c] = b[c].sun.value;
        dle[WAVELENGTH][c] = 0;
    }
}

/* ---- Sampling -------------------------------------------------------------------- */

/* Luminance of the sky, and of the sun, in a direction, at the present parameters. */
static void luminances(const struct imp_emitter *e, imp_v3 w, double *sky, double *sun)
{
    const struct sunsky *s = e->self;
    const imp_spec a = e->input[ALBEDO]->value;
    const bool one = s->mono || e->input[ALBEDO]->count == 1;
    imp_spec in[N_INPUTS] = {
        [TURBIDITY] = e->input[TURBIDITY]->value,
        [ALBEDO] = imp__spec(one ? a[0] : imp__luminance(a[0], a[1], a[2]))};
    double y_sky = 0, y_sun = 0;
    for (int first = 0; first < (s->by_wave ? IMP_SKY_WAVES : 1); first += 4) {
        struct sunsky_both b[4];
        for (int c = 0; c < 4; c++)
            in[WAVELENGTH][c] = IMP_SKY_FIRST_NM +
                                IMP_SKY_STEP_NM * imp_min(first + c, IMP_SKY_WAVES - 1);
        imp__sunsky_lanes(s, in[TURBIDITY][0], &in[ALBEDO], &in[WAVELENGTH], w, b);
        for (int c = 0; c < (s->by_wave ? 4 : 3) && first + c < IMP_SKY_WAVES; c++) {
            const int k = first + c;
            const double y =
                s->by_wave ? imp__luminance(s->light.color[0][k], s->light.color[1][k],
                                            s->light.color[2][k])
                           : imp__luminance(c == 0 && !s->mono, c == 1 && !s->mono,
                                            c == 2 && !s->mono) +
                                 (s->mono && c == 0);
            y_sky += y * b[c].sky.value;
            y_sun += y * b[c].sun.value;
        }
    }
    *sky = y_sky;
    *sun = y_sun;
}

static imp_v3 cell_direction(int i, int j, double up, double round)
{
    const double z = (i + up) / HEIGHTS, r = sqrt(imp_max((1 - z) * (1 + z), 0.0));
    double sine, cosine;
    imp__sincos_turn((j + round) / TURNS, &sine, &cosine);
    return imp__v3(r * cosine, r * sine, z);
}

static void changed(const struct imp_emitter *e)
{
    const struct sunsky *s = e->self;
    struct imp__weight_table t = s->table;
    double total = 0, unused, sun;
    for (int i = 0; i < HEIGHTS; i++)
        for (int j = 0; j < TURNS; j++) {
            double sum = 0, y;
            for (int k = 0; k < 4; k++) {
                luminances(e, cell_direction(i, j, k / 2 ? .75 : .25, k % 2 ? .75 : .25),
                           &y, &unused);
                sum += imp_max(y, 0.0) / 4;
            }
            t.column[i * TURNS + j] = sum;
            total += sum;
        }
    const double mean = total / (HEIGHTS * TURNS);
    for (int k = 0; k < HEIGHTS * TURNS; k++)
        t.column[k] += mean > 0 ? CELL_LEAST * mean : 1;
    imp__weight_table_sum(&t, NULL);
    luminances(e, s->sun, &unused, &sun);
    sun = imp_max(sun, 0.0) * s->sun_solid * e->input[SUN_SCALE]->value[0];
    const double sky = mean * IMP_2PI * e->input[SKY_SCALE]->value[0];
    *s->sun_share =
        sun + sky > 0 ? imp_clamp(sun / (sun + sky), SHARE_LEAST, 1 - SHARE_LEAST) : 0.5;
}

static double density(const struct imp_emitter *e, imp_v3 w)
{
    const struct sunsky *s = e->self;
    const struct imp__weight_table *t = &s->table;
    double p =
        imp__sunsky_in_disc(s, imp__dot(w, s->sun)) ? *s->sun_share / s->sun_solid : 0;
    if (w[2] >= 0) {
        const double turn = atan2(w[1], w[0]) * (IMP_INV_PI / 2);
        const int i = imp_min((int)(w[2] * HEIGHTS), HEIGHTS - 1);
        const int j = imp_min((int)((turn < 0 ? turn + 1 : turn) * TURNS), TURNS - 1);
        const double *c = t->column + i * TURNS;
        const double weight = c[j] - (j ? c[j - 1] : 0);
        p += (1 - *s->sun_share) * weight / imp__weight_table_total(t) *
             (HEIGHTS * TURNS / IMP_2PI);
    }
    return p;
}

static bool sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                   struct imp_light_sample *out)
{
    const struct sunsky *s = e->self;
    const double share = *s->sun_share;
    imp_v3 d;
    (void)ref;
    if (u[0] < share) {
        const struct imp_frame f = imp__frame_from_normal(s->sun);
        const double away = u[0] / share * (1 - s->cos_radius);
        const double r = sqrt(away * (2 - away));
        double sine, cosine;
        imp__sincos_turn(u[1], &sine, &cosine);
        d = imp__normalize(imp__to_world(&f, imp__v3(r * cosine, r * sine, 1 - away)));
    } else {
        const double v[2] = {(u[0] - share) / (1 - share), u[1]};
        double r[2];
        int i, j;
        imp__weight_table_draw(&s->table, v, &i, &j, r);
        d = cell_direction(i, j, r[1], r[0]);
    }
    const imp_v3 w = s->axis[0] * d[0] + s->axis[1] * d[1] + s->axis[2] * d[2];
    *out = (struct imp_light_sample){
        .wi = w, .dist = INFINITY, .pdf = density(e, local(s, w)), .cos_light = 1};
    return true;
}

static double pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                  const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)ref, (void)hit, (void)at;
    return density(e, local(e->self, *wi));
}

/* ---- Building -------------------------------------------------------------------- */

/* In their frame. */
static void sun_place(struct sunsky *s, imp_v3 sun, double radius)
{
    const double half = sin(radius / 2), own = sin(SUN_RADIUS_DEGREES * IMP_PI / 360);
    s->sun = sun;
    s->cos_radius = cos(radius);
    s->sun_solid = 4 * IMP_PI * half * half;
    s->dim = own * own / (half * half);
    s->dark = sun[2] < 0;
    imp__skylight_set(&s->light, asin(imp_clamp(sun[2], 0.0, 1.0)), radius, s->by_wave);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct sunsky *s = self;
    double aperture;
    bool of_world;
    const enum imp_color_mode mode = imp_build_color_mode(b);
    s->mono = mode == IMP_MONO;
    s->by_wave = mode != IMP_MONO && mode != IMP_RGB;
    IMP_TRY(imp__sky_axes(b, s->axis));
    IMP_TRY(imp__sun_read(b, &s->sun, &of_world));
    if (of_world) s->sun = local(s, s->sun);
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "sun_aperture", 2 * SUN_RADIUS_DEGREES,
                                (struct imp_interval){0, 180, IMP_OPEN}, &aperture));
    IMP_TRY(imp_build_bool(b, "complex_sun", false, &s->limb));
    sun_place(s, s->sun, aperture * IMP_PI / 360);
    if (s->dark) {
        char where[512];
        imp__warn(b->ctx,
                  "%s: emitter '%s' (%s): the sun is %.3g degrees below the horizon: "
                  "there is no light from it",
                  imp__loc_text(b->node->loc, where, sizeof where),
                  b->node->id ? b->node->id : "", b->node->type,
                  asin(imp_min(-s->sun[2], 1.0)) * 180 / IMP_PI);
    }
    s->table = (struct imp__weight_table){
        TURNS, HEIGHTS, imp_build_alloc(b, HEIGHTS, sizeof(double)),
        imp_build_alloc(b, (size_t)HEIGHTS * TURNS, sizeof(double))};
    s->sun_share = imp_build_alloc(b, 1, sizeof *s->sun_share);
    if (!s->table.row || !s->table.column || !s->sun_share)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "no memory for a sky"));
    changed(e);
out:
    return st;
}

static imp_v3 towards(const struct sunsky *s)
{
    return s->axis[0] * s->sun[0] + s->axis[1] * s->sun[1] + s->axis[2] * s->sun[2];
}

/* The horizon, and the border of the disc. */
static int jumps(const struct imp_emitter *e, struct imp_sky_circle out[IMP_SKY_CIRCLES])
{
    const struct sunsky *s = e->self;
    if (s->dark) return 0;
    out[0] = (struct imp_sky_circle){s->axis[2], 0};
    out[1] = (struct imp_sky_circle){towards(s), s->cos_radius};
    return 2;
}

bool imp__sunsky_sun_read(const struct imp_emitter *e, struct imp__sky_sun *out)
{
    const struct sunsky *s = e->self;
    *out = (struct imp__sky_sun){
        .towards = towards(s), .radius = s->light.radius, .power = true};
    return !s->dark;
}
bool imp__sunsky_sun_set(struct imp_emitter *e, const struct imp__sky_sun *sun)
{
    struct sunsky *s = e->self;
    sun_place(s, local(s, sun->towards), sun->radius);
    return !s->dark;
}
void imp__sunsky_part(bool disc, imp_spec *in)
{
    in[disc ? SKY_SCALE : SUN_SCALE] = imp__spec(0);
}

static void move(struct imp_emitter *e, const double to_world[12])
{
    struct sunsky *s = e->self;
    imp__sky_axes_turn(s->axis, to_world);
}

const struct imp_emitter_ops imp__sunsky = {.size = sizeof(struct imp_emitter_ops),
                                            .name = "sunsky",
                                            .object_size = sizeof(struct sunsky),
                                            .flags = IMP_EMITTER_ENVIRONMENT,
                                            .inputs = inputs,
                                            .build = build,
                                            .eval = eval,
                                            .eval_d = eval_d,
                                            .sample = sample,
                                            .pdf = pdf,
                                            .changed = changed,
                                            .sample_emission = imp__sky_emission_sample,
                                            .pdf_emission = imp__sky_emission_pdf,
                                            .jumps = jumps,
                                            .move = move};
