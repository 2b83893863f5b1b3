/* SPDX-License-Identifier: Apache-2.0
 *
 * Reads the properties that perspective, thin-lens and orthographic cameras have in
 * common. */
#include "projection.h"
#include "base/compiler.h"
#include <string.h>
#include <strings.h>

enum imp_status imp__sensor_place(const struct imp_build *b, struct imp_mat4 *m,
                                  struct imp_mat4 *inverse)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(imp_build_transform(b, "to_world", m->m));
    if (!imp__mat4_is_finite(m) || !imp__mat4_is_affine(m))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "to_world is not finite and affine"));
    if (!imp__mat4_inverse(m, inverse))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE, "to_world is singular"));
out:
    return st;
}

static enum imp_status placement_read(const struct imp_build *b, bool rigid,
                                      struct imp_mat4 *out, struct imp_mat4 *out_inverse)
{
    enum imp_status st = IMP_OK;
    struct imp_mat4 m, inverse;

    IMP_TRY(imp__sensor_place(b, &m, &inverse));
    /* Rigid up to mirroring: M M^T = 1. */
    for (int i = 0; rigid && i < 3; i++)
        for (int j = 0; j <= i; j++) {
            const double *r = m.m + 4 * i, *s = m.m + 4 * j;
            const double dot = r[0] * s[0] + r[1] * s[1] + r[2] * s[2];
            if (!(fabs(dot - (i == j)) <= 1e-3))
                IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                        "to_world scales or shears; this sensor allows "
                                        "rotation and translation only"));
        }
    *out = m;
    *out_inverse = inverse;
out:
    return st;
}

enum imp_status imp__projection_build(const struct imp_build *b, bool rigid,
                                      struct imp_projection *out)
{
    enum imp_status st = IMP_OK;
    struct imp_projection p;

    IMP_TRY(placement_read(b, rigid, &p.to_world, &p.to_local));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "near_clip", 1e-2, IMP_POSITIVE,
                                &p.near_clip));
    IMP_TRY(imp_build_float(b, "far_clip", 1e4, &p.far_clip));
    if (!(p.far_clip > p.near_clip) && imp_build_has(b, "far_clip"))
        IMP_TRY(imp_build_error(b, "far_clip", IMP_E_SCENE,
                                "far_clip = %g is outside (near_clip = %g, inf]",
                                p.far_clip, p.near_clip));
    if (!(p.far_clip > p.near_clip))
        IMP_TRY(imp_build_error(b, "near_clip", IMP_E_SCENE,
                                "near_clip = %g is outside (0, far_clip = %g)",
                                p.near_clip, p.far_clip));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "focus_distance", p.far_clip,
                                IMP_POSITIVE, &p.focus_distance));
    *out = p;
out:
    return st;
}

void imp__projection_move(struct imp_projection *p, const double to_world[12])
{
    struct imp_mat4 m = {{0}};
    for (int k = 0; k < 12; k++) m.m[k] = to_world[k];
    m.m[15] = 1;
    p->to_world = imp__mat4_multiply(&m, &p->to_world);
    imp__mat4_inverse(&p->to_world, &p->to_local);
}

/* B = A A_0^-1: B B^T = 1. */
static bool is_turned(const struct imp_mat4 *from, const struct imp_mat4 *to)
{
    struct imp_mat4 back;
    if (!imp__mat4_inverse(from, &back)) return false;
    const struct imp_mat4 by = imp__mat4_multiply(to, &back);
    bool turned = true;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j <= i; j++) {
            const double *r = by.m + 4 * i, *s = by.m + 4 * j;
            const double dot = r[0] * s[0] + r[1] * s[1] + r[2] * s[2];
            turned &= fabs(dot - (i == j)) <= 1e-6;
        }
    return turned;
}

bool imp__projection_placed(struct imp_projection *p, bool rigid, double to_world[12],
                            bool set)
{
    if (!set) {
        memcpy(to_world, p->to_world.m, 12 * sizeof *to_world);
        return true;
    }
    const struct imp_mat4 to = imp__mat4_of_rows(to_world);
    const bool fits = !rigid || is_turned(&p->to_world, &to);
    p->to_world = to;
    return imp__mat4_inverse(&p->to_world, &p->to_local) && fits;
}

/* Where the pinhole's x, y is seen, and film area over that without the lens. False: not
 * on the film, or only where the polynomials have folded the plane back onto it. */
static bool seen_by_lens(const struct imp_film_plane *film, double *x, double *y,
                         double *stretch)
{
    const double at[2] = {-*x, -*y};
    double seen[2], slope[3], back[2];
    imp__distort(film->lens, at, seen, slope);
    *x = -seen[0];
    *y = -seen[1];
    *stretch = slope[0] * slope[2] - slope[1] * slope[1];
    const double px = (*x - film->x0) / film->dx, py = (*y - film->y0) / film->dy;
    if (!(px >= -film->beside && px <= film->width + film->beside &&
          py >= -film->beside && py <= film->height + film->beside))
        return false;
    imp__undistort(film->lens, seen, back);
    return fabs(back[0] - at[0]) + fabs(back[1] - at[1]) <
           1e-6 * (1 + fabs(at[0]) + fabs(at[1]));
}

bool imp__projection_connect(const struct imp_projection *p,
                             const struct imp_film_plane *film, imp_v3 o, double focus,
                             imp_v3 ref, bool far, struct imp_sensor_sample *out)
{
    const imp_v3 q =
        far ? imp__vector(&p->to_local, ref) : imp__point(&p->to_local, ref) - o;
    if (!(q[2] > 0) || (!far && !(q[2] > p->near_clip && q[2] < p->far_clip)))
        return false;
    const double ox = o[0] / focus, oy = o[1] / focus;
    /* Most connections of light walks miss the film: they are rejected before the
     * division. */
    if (q[0] + ox * q[2] < film->x_least * q[2] ||
        q[0] + ox * q[2] > film->x_most * q[2] ||
        q[1] + oy * q[2] < film->y_least * q[2] || q[1] + oy * q[2] > film->y_most * q[2])
        return false;
    const imp_v3 v = q * (1 / q[2]);
    double x = v[0] + ox, y = v[1] + oy, stretch = 1;
    if (film->lens && !seen_by_lens(film, &x, &y, &stretch)) return false;
    const double length = imp__length(v), r2 = far ? 1 : imp__dot(q, q);
    const imp_v3 d = imp__normalize(imp__vector(&p->to_world, v));
    *out = (struct imp_sensor_sample){.wo = -d,
                                      .p = imp__point(&p->to_world, o + v * p->near_clip),
                                      .px = (x - film->x0) / film->dx,
                                      .py = (y - film->y0) / film->dy,
                                      .weight = length * length * length * stretch /
                                                (fabs(film->dx * film->dy) * r2),
                                      .cos_sensor = 1};
    out->dist = far ? INFINITY : imp__length(out->p - ref);
    return true;
}

/* "50mm", "35.5 mm" or "50"; by hand, because strtod follows the host's locale. */
static bool millimetres_parse(const char *text, double *out)
{
    double value = 0, unit = 1;
    int digits = 0;
    bool point = false;
    for (; *text == ' '; text++) {}
    for (; (*text >= '0' && *text <= '9') || (*text == '.' && !point); text++) {
        if (*text == '.') {
            point = true;
            continue;
        }
        value = 10 * value + (*text - '0');
        if (point) unit *= 10;
        if (++digits > 15) return false;
    }
    for (; *text == ' '; text++) {}
    if (strncasecmp(text, "mm", 2) == 0) text += 2;
    if (*text || !digits || !(value > 0)) return false;
    *out = value / unit;
    return true;
}

enum imp_status imp__fov_build(const struct imp_build *b, double a, double *tan_half_x)
{
    enum imp_status st = IMP_OK;
    enum { X, Y, DIAGONAL, SMALLER, LARGER };
    static const char *const axes[] = {"x", "y", "diagonal", "smaller", "larger"};
    const bool by_fov = imp_build_has(b, "fov");
    const char *text;
    double fov = 0, tan_half;
    int axis = DIAGONAL;

    if (by_fov && imp_build_has(b, "focal_length"))
        IMP_TRY(imp_build_error(b, "focal_length", IMP_E_SCENE,
                                "give fov or focal_length, not both"));
    if (by_fov) {
        IMP_TRY(imp__props_float_in(b->ctx, b->node, "fov", 0,
                                    (struct imp_interval){0, 180, IMP_OPEN}, &fov));
        IMP_TRY(imp_build_string(b, "fov_axis", "x", &text));
        for (axis = 0; axis <= LARGER && strcasecmp(axes[axis], text) != 0;) axis++;
        if (axis > LARGER)
            IMP_TRY(imp_build_error(b, "fov_axis", IMP_E_SCENE,
                                    "fov_axis = '%s': must be one of x, y, "
                                    "diagonal, smaller, larger",
                                    text));
        tan_half = tan(fov * (IMP_PI / 360));
    } else { /* the diagonal of a 36 x 24 mm picture; fov_axis then is an unused property
              */
        double f = 0;
        IMP_TRY(imp_build_string(b, "focal_length", "50mm", &text));
        if (!millimetres_parse(text, &f))
            IMP_TRY(imp_build_error(b, "focal_length", IMP_E_SCENE,
                                    "focal_length = '%s': must be like '50mm'", text));
        tan_half = sqrt(36.0 * 36 + 24.0 * 24) / (2 * f);
    }
    if (axis == SMALLER) axis = a > 1 ? Y : X;
    if (axis == LARGER) axis = a > 1 ? X : Y;
    if (axis == Y) tan_half *= a;
    if (axis == DIAGONAL) tan_half /= sqrt(1 + 1 / (a * a));
    /* atan keeps it below 180 degrees; what is left is rounding to 0 or 180. */
    if (!(tan_half > 1e-12 && tan_half < 1e12))
        IMP_TRY(imp_build_error(b, by_fov ? "fov" : "focal_length", IMP_E_SCENE,
                                "the horizontal field of view, %g degrees, is "
                                "outside (0, 180)",
                                atan(tan_half) * (360 / IMP_PI)));
    *tan_half_x = tan_half;
out:
    return st;
}
