/* SPDX-License-Identifier: Apache-2.0
 *
 * What shapes share (shape.h), a text in lanes (math/lane_text.h). */

/* imp__frame_from_normal: axes across n. */
static inline void WIDE(imp__axes_across)(real3 n, real3 *s, real3 *t)
{
    const real sign = signed_as(number(1), n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
    *s = (real3){1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    *t = (real3){b, sign + n.y * n.y * a, -n.y};
}

/* imp__surface_frame. */
static inline void WIDE(imp__surface_frames)(struct WIDE(imp_frames) * f, real3 dp_du)
{
    const real3 n = f->n, s = minus3(dp_du, times3(n, inner(n, dp_du)));
    const real l2 = inner(s, s);
    const truth good = l2 > 1e-20 * inner(dp_du, dp_du);
    const real3 along = times3(s, 1 / root_of(l2));
    real3 any_s, any_t;
    WIDE(imp__axes_across)(n, &any_s, &any_t);
    f->s = choose3(good, along, any_s);
    f->t = choose3(good, WIDE(imp__outer)(n, along), any_t);
}

/* imp__area_to_angle. */
static inline real WIDE(imp__areas_to_angles)(real3 ref, real3 p, real3 ng, real inv_area)
{
    const real3 d = minus3(p, ref);
    const real r2 = inner(d, d), c = magnitude(inner(d, ng)), r = root_of(r2);
    return choose(c > IMP_GRAZING * r, r2 * r * inv_area / c, number(0));
}
