/* SPDX-License-Identifier: Apache-2.0
 *
 * ies: a luminaire as it was measured, intensity I by direction from an LM-63 table.
 *
 * Photometry is of the far field: it measures what a whole luminaire sends along w, not from
 * where. At the top of a scene the luminaire is a point: irradiance I(w)/r^2 across the
 * ray. In a shape it is the shape that glows, alike all over:
 *
 *     L(w) = scale I(w) / A(w),      A(w) = Int max(0, n . w) dA,
 *
 * so that far away Int L max(0, n . w) dA = scale I(w) again. For a flat shape A is
 * area x cos: a table of cos^(n+1) is `beam` with exponent n. L grows without bound
 * towards the shape's own plane if the table does not vanish there, but L cos does not:
 * points are drawn as for `area`, by projected area, and the cosine cancels. Meeting such
 * light by chance is bounded by the power heuristic, as the density of light samples has
 * the same pole.
 *
 * Between angles the table is interpolated bilinearly; above and below, it is 0.
 *
 * Directions of the types of LM-63-2002, with nadir n, the plane 0 along c and C90 along d:
 *     C   w = n cos v + (c cos h + d sin h) sin v
 *     B   w = (n cos v + c sin v) cos h - d sin h         h counts clockwise from above
 *     A   w = (c cos h - d sin h) cos v - n sin v         v = -90 is nadir */
#include "ies.h"
#include "emission.h"
#include "from_point.h"
#include "kind/build.h"
#include "kind/shape/shape.h"
#include "math/transform.h"
#include "math/trig.h"

#define PER_WATT 683.0 /* lm/W at 555 nm, by which the candela is defined */

enum { SCALE };

static const struct imp_input_desc inputs[] = {
    {.name = "scale", .role = IMP_EMISSION, .fallback = 1, .unit = "1"}, {0}};

/* ---- Building ------------------------------------------------------------------ */

/* nadir along n, c0 along s as far as it is across n, c90 so that directions turn about
 * the lamp as LM-63 has it, seen from above: (c0, c90, up) is a right hand. */
static void frame_set(struct imp__ies *x, imp_v3 s, imp_v3 n, bool mirrored)
{
    x->nadir = imp__normalize(n);
    const imp_v3 across = s - x->nadir * imp__dot(x->nadir, s);
    x->c0 = imp__length(across) > 1e-9 * imp__length(s)
                ? imp__normalize(across)
                : imp__frame_from_normal(x->nadir).s;
    x->c90 = imp__cross(x->c0, x->nadir) * (mirrored ? -1.0 : 1.0);
}

/* What its lamps keep of their flux when the luminaire is tilted. */
static enum imp_status tilt_read(const struct imp_build *b, struct imp__ies *x)
{
    const struct imp_ies_data *d = x->data;
    double tilt, f;
    enum imp_status st = IMP_OK;
    x->kept = 1;
    if (!imp_build_has(b, "tilt")) goto out;
    IMP_TRY(imp__props_float(b->ctx, b->node, "tilt", 0, &tilt));
    if (d->n_tilts == 0 && tilt == 0) goto out; /* as it was measured */
    if (d->n_tilts == 0)
        IMP_TRY(imp_build_error(b, "tilt", IMP_E_SCENE,
                                "tilt = %g needs a file that says what tilted lamps "
                                "keep; its file has TILT=NONE",
                                tilt));
    tilt = fabs(tilt);
    if (!(tilt >= d->tilt[0] && tilt <= d->tilt[d->n_tilts - 1]))
        IMP_TRY(imp_build_error(b, "tilt", IMP_E_SCENE,
                                "tilt = %g is outside [%g, %g], for which its file says "
                                "what lamps keep",
                                tilt, d->tilt[0], d->tilt[d->n_tilts - 1]));
    if (d->n_tilts == 1) {
        x->kept = d->tilt_factor[0];
    } else {
        const double *k = d->tilt_factor + imp__ies_place(d->tilt, d->n_tilts, tilt, &f);
        x->kept = k[0] + f * (k[1] - k[0]);
    }
out:
    return st;
}

/* What the luminaire gives in operation, as a part of what was measured: a flux in its place, how
 * far it is dimmed, and what age and dirt leave of it (the maintenance factor). */
static enum imp_status operation_read(const struct imp_build *b, struct imp__ies *x)
{
    enum imp_status st = IMP_OK;
    const struct imp_interval part = {0, 1, IMP_CLOSED}, left = {0, 1, IMP_OPEN_LO};
    double flux;
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "dimming", 1, part, &x->dimming));
    IMP_TRY(
        imp__props_float_in(b->ctx, b->node, "maintenance", 1, left, &x->maintenance));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "flux", 0, IMP_NOT_NEGATIVE, &flux));
    const double measured = imp__ies_flux(x) * x->lumens;
    if (imp_build_has(b, "flux") && !(measured > 0))
        IMP_TRY(
            imp_build_error(b, "flux", IMP_E_SCENE,
                            "its table is dark, and has no flux that could be scaled"));
    if (imp_build_has(b, "flux")) x->factor *= flux / measured;
    IMP_TRY(tilt_read(b, x));
    x->factor *= x->dimming * x->maintenance * x->kept;
out:
    return st;
}

static enum imp_status common_build(const struct imp_build *b, struct imp__ies *x)
{
    static const char *const units[] = {"photometric", "radiometric"};
    enum imp_status st = IMP_OK;
    struct imp_mat4 m;
    int unit;
    if (!b->node->ies) IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE, "has no table"));
    x->data = b->node->ies;
    const struct imp_prop *file = imp__node_prop(b->node, "filename");
    x->file = file ? file->string : NULL;
    IMP_TRY(imp_build_choice(b, "units", units, 2, 0, &unit));
    x->lumens = unit == 0 ? 1 : PER_WATT;
    x->factor = 1 / x->lumens;
    IMP_TRY(operation_read(b, x));
    IMP_TRY(imp_build_transform(b, "to_world", m.m));
    const double det = imp__mat4_det3(&m);
    if (!imp__mat4_is_finite(&m) || !imp__mat4_is_affine(&m) || !(fabs(det) > 0) ||
        !isfinite(det))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is not affine and invertible"));
    frame_set(x, imp__mat4_column(&m, 0), imp__mat4_column(&m, 2), det < 0);
    x->position = imp__point(&m, imp__v3(0, 0, 0));
out:
    return st;
}

static enum imp_status point_build(const struct imp_build *b, void *self,
                                   struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    if (e->n_in > SCALE && e->input[SCALE]->texture)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "scale cannot be a texture: a point has no surface"));
    IMP_TRY(common_build(b, self));
out:
    return st;
}

static enum imp_status area_build(const struct imp_build *b, void *self,
                                  struct imp_emitter *e)
{
    enum imp_status st = IMP_OK;
    struct imp__ies *x = self;
    const struct imp_shape *s = e->shape;
    struct imp_surface at = {.uv = {0}};
    if (!s) return imp_build_error(b, NULL, IMP_E_SCENE, "it must be inside a shape");
    if (!(s->area > 0))
        return imp_build_error(b, NULL, IMP_E_SCENE, "its shape '%s' (%s) has no area",
                               s->name ? s->name : "", s->ops->name);
    IMP_TRY(common_build(b, x));
    IMP_TRY(imp__ies_surface_read(b, s, x, &at));
    /* A flat lamp shines along its normal unless it is turned. */
    if (x->n_facets == 1 && !imp_build_has(b, "to_world"))
        frame_set(x, at.s, at.n, false);
out:
    return st;
}

/* ---- As a point ---------------------------------------------------------------- */

static void point_eval_d(const struct imp_emitter *e, const imp_spec *in,
                         const struct imp_emission *x, imp_spec *dle)
{
    (void)in;
    dle[SCALE] = imp__spec(imp__ies_intensity(e->self, x->d) / (x->dist * x->dist));
}
static void point_eval(const struct imp_emitter *e, const imp_spec *in,
                       const struct imp_emission *x, imp_spec *le)
{
    point_eval_d(e, in, x, le);
    *le *= in[SCALE];
}
static bool point_sample(const struct imp_emitter *e, const imp_v3 *ref,
                         const double u[2], struct imp_light_sample *out)
{
    (void)u;
    const struct imp__ies *p = e->self;
    return imp__point_light_sample(p->position, *ref, out);
}

static void aim(struct imp_emitter *e, double v[3], bool set)
{
    struct imp__ies *x = e->self;
    if (set) x->position = imp__v3(v[0], v[1], v[2]);
    for (int k = 0; k < 3; k++) v[k] = x->position[k];
}

void imp__ies_turn(struct imp__ies *x, const struct imp__ies *from, imp_v3 to)
{
    struct imp__light_frame f,
        rest = {{from->c0, from->c90, from->nadir}, from->position};
    imp__light_frame_turn(&f, &rest, to);
    x->c0 = f.axis[0];
    x->c90 = f.axis[1];
    x->nadir = f.axis[2];
}

void imp__ies_move(struct imp__ies *x, const struct imp__ies *from, const double map[12])
{
    struct imp__ies_facet *facet = (struct imp__ies_facet *)(uintptr_t)x->facets;
    x->nadir = imp__rows_vector(map, from->nadir);
    x->c0 = imp__rows_vector(map, from->c0);
    x->c90 = imp__rows_vector(map, from->c90);
    x->axis = imp__rows_vector(map, from->axis);
    for (int k = 0; k < x->n_facets; k++)
        facet[k].n = imp__rows_vector(map, from->facets[k].n);
}

static bool emission_sample(const struct imp_emitter *e, const struct imp_ball *scene,
                            const double u[4], struct imp_emission_sample *out)
{
    (void)scene;
    const struct imp__ies *p = e->self;
    imp__point_emission_sample(p->position, u, out);
    return true;
}

/* ---- As a surface -------------------------------------------------------------- */

static void area_eval_d(const struct imp_emitter *e, const imp_spec *in,
                        const struct imp_emission *x, imp_spec *dle)
{
    (void)in;
    dle[SCALE] = imp__spec(x->cos_light > 0 ? imp__ies_radiance(e->self, x->d) : 0);
}
static void area_eval(const struct imp_emitter *e, const imp_spec *in,
                      const struct imp_emission *x, imp_spec *le)
{
    area_eval_d(e, in, x, le);
    *le *= in[SCALE];
}
static bool area_sample(const struct imp_emitter *e, const imp_v3 *ref, const double u[2],
                        struct imp_light_sample *out)
{
    return e->shape->ops->sample_toward(e->shape, ref, u, out);
}
static double area_pdf(const struct imp_emitter *e, const imp_v3 *ref, const imp_v3 *wi,
                       const struct imp_hit *hit, const struct imp_surface *at)
{
    (void)wi;
    return e->shape->ops->pdf_toward(e->shape, ref, hit, at);
}

static double profile_value(const struct imp_emitter *e, const imp_v3 *w)
{
    return imp__ies_radiance(e->self, *w);
}
static double profile_bound(const struct imp_emitter *e, const imp_v3 *w, double angle)
{
    return imp__ies_bound(e->self, *w, angle);
}
static double profile_mean(const struct imp_emitter *e, const imp_v3 *n)
{
    return imp__ies_mean(e->self, *n);
}
static const struct imp_emitter_profile area_profile = {profile_value, profile_bound,
                                                        profile_mean};

const struct imp_emitter_ops imp__ies_light = {.size = sizeof(struct imp_emitter_ops),
                                               .name = "ies",
                                               .object_size = sizeof(struct imp__ies),
                                               .flags = IMP_EMITTER_DELTA,
                                               .inputs = inputs,
                                               .build = point_build,
                                               .eval = point_eval,
                                               .eval_d = point_eval_d,
                                               .sample = point_sample,
                                               .pdf = imp__point_light_pdf,
                                               .sample_emission = emission_sample,
                                               .pdf_emission = imp__point_emission_pdf,
                                               .aim = aim};
const struct imp_emitter_ops imp__ies_area = {
    .size = sizeof(struct imp_emitter_ops),
    .name = "ies",
    .object_size = sizeof(struct imp__ies),
    .flags = IMP_EMITTER_AREA | IMP_EMITTER_BY_SHAPE,
    .inputs = inputs,
    .build = area_build,
    .eval = area_eval,
    .eval_d = area_eval_d,
    .sample = area_sample,
    .pdf = area_pdf,
    .profile = &area_profile,
    .sample_emission = imp__surface_emission_sample,
    .pdf_emission = imp__surface_emission_pdf};
