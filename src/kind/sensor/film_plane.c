/* SPDX-License-Identifier: Apache-2.0
 *
 * The film of a camera with a perspective: field of view and principal point, as Mitsuba
 * names them or as a calibration by OpenCV gives them, and the distortion of its lens. */
#include "projection.h"
#include <math.h>

/* OpenCV counts pixels from the middle of the first one, and lengths in pixels:
 * px - 1/2 = fx x'' + cx. A calibration made from larger or smaller pictures is scaled. */
static enum imp_status calibration_read(const struct imp_build *b,
                                        const struct imp_film_desc *film,
                                        struct imp_film_plane *out)
{
    enum imp_status st = IMP_OK;
    static const char *const others[] = {"fov", "fov_axis", "focal_length",
                                         "principal_point_offset_x",
                                         "principal_point_offset_y"};
    int64_t width, height;
    double fx, fy, cx, cy;
    for (size_t i = 0; i < imp_count(others); i++)
        if (imp_build_has(b, others[i]))
            IMP_TRY(imp_build_error(b, others[i], IMP_E_SCENE,
                                    "give %s or opencv_fx, not both", others[i]));
    IMP_TRY(imp_build_int(b, "opencv_width", film->width, 1, 1 << 30, &width));
    IMP_TRY(imp_build_int(b, "opencv_height", film->height, 1, 1 << 30, &height));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "opencv_fx", 0, IMP_POSITIVE, &fx));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "opencv_fy", fx, IMP_POSITIVE, &fy));
    IMP_TRY(imp_build_float(b, "opencv_cx", 0.5 * ((double)width - 1), &cx));
    IMP_TRY(imp_build_float(b, "opencv_cy", 0.5 * ((double)height - 1), &cy));
    out->x0 = (cx + 0.5) / fx;
    out->dx = -1 / fx * ((double)width / film->width);
    out->y0 = (cy + 0.5) / fy;
    out->dy = -1 / fy * ((double)height / film->height);
    const double wide = -out->dx * film->width, high = -out->dy * film->height;
    const bool x_fits = fabs(out->x0) < 1e12 && wide > 1e-12 && wide < 1e12;
    const bool y_fits = fabs(out->y0) < 1e12 && high > 1e-12 && high < 1e12;
    const char *const odd = x_fits ? "opencv_fy" : "opencv_fx", *const centre =
                                                                    x_fits ? "opencv_cy"
                                                                           : "opencv_cx";
    if (!x_fits || !y_fits)
        IMP_TRY(imp_build_error(b, imp_build_has(b, centre) ? centre : odd, IMP_E_SCENE,
                                "opencv_fx = %g, opencv_fy = %g, opencv_cx = %g, "
                                "opencv_cy = %g: no picture has such a field of view",
                                fx, fy, cx, cy));
out:
    return st;
}

static enum imp_status field_read(const struct imp_build *b, bool offset,
                                  const struct imp_film_desc *film,
                                  struct imp_film_plane *out)
{
    enum imp_status st = IMP_OK;
    static const char *const others[] = {"opencv_fy", "opencv_cx", "opencv_cy",
                                         "opencv_width", "opencv_height"};
    const double w = film->width, h = film->height, a = w / h;
    double t, offset_x = 0, offset_y = 0;
    for (size_t i = 0; i < imp_count(others); i++)
        if (imp_build_has(b, others[i]))
            IMP_TRY(imp_build_error(b, others[i], IMP_E_SCENE, "%s needs opencv_fx",
                                    others[i]));
    IMP_TRY(imp__fov_build(b, a, &t));
    if (offset) {
        IMP_TRY(imp_build_float(b, "principal_point_offset_x", 0, &offset_x));
        IMP_TRY(imp_build_float(b, "principal_point_offset_y", 0, &offset_y));
    }
    out->x0 = t * (1 - 2 * offset_x);
    out->dx = -2 * t / w;
    out->y0 = t / a * (1 - 2 * offset_y);
    out->dy = -2 * t / a / h;
out:
    return st;
}

/* One side of the film and its border: x0 + px dx. */
static void side_bound(double x0, double dx, double pixels, double beside, double *least,
                       double *most)
{
    const double a = x0 - beside * dx, b = x0 + (pixels + beside) * dx;
    *least = fmin(a, b);
    *most = fmax(a, b);
}

static void film_bound(struct imp_film_plane *p, double beside)
{
    side_bound(p->x0, p->dx, p->width, beside, &p->x_least, &p->x_most);
    side_bound(p->y0, p->dy, p->height, beside, &p->y_least, &p->y_most);
}

/* What x and y reach without the lens: the table's nodes, and a cell more. */
static void lens_bound(const struct imp_distortion *d, struct imp_film_plane *out)
{
    enum { N = IMP_DISTORTION_NODES };
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY}, cell[2];
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++)
            for (int k = 0; k < 2; k++) {
                lo[k] = imp_min(d->node[j][i][k], lo[k]);
                hi[k] = imp_max(d->node[j][i][k], hi[k]);
            }
    for (int k = 0; k < 2; k++) cell[k] = (hi[k] - lo[k]) / (N - 1);
    out->x_least = -hi[0] - cell[0];
    out->x_most = -lo[0] + cell[0];
    out->y_least = -hi[1] - cell[1];
    out->y_most = -lo[1] + cell[1];
}

/* Bounds of the film, and the table of a lens that distorts. False: it has no inverse where *seen
 * is. */
static bool film_settle(struct imp_film_plane *f, double seen[2])
{
    bool distorts = false;
    for (int i = 0; i < 5; i++) distorts |= f->k[i] != 0;
    f->lens = NULL;
    film_bound(f, distorts ? f->beside : ceil(f->beside) + 1);
    if (!distorts) return true;
    /* No walk is connected farther out. */
    const double lo[2] = {-f->x_most, -f->y_most}, hi[2] = {-f->x_least, -f->y_least};
    struct imp_distortion *d = f->table;
    d->k1 = f->k[0];
    d->k2 = f->k[1];
    d->p1 = f->k[2];
    d->p2 = f->k[3];
    d->k3 = f->k[4];
    if (!imp__distortion_invert(d, lo, hi, seen)) return false;
    lens_bound(d, f);
    f->lens = d;
    return true;
}

static enum imp_status lens_build(const struct imp_build *b, struct imp_film_plane *out)
{
    enum imp_status st = IMP_OK;
    static const char *const names[5] = {"opencv_k1", "opencv_k2", "opencv_p1",
                                         "opencv_p2", "opencv_k3"};
    double seen[2];
    int first = 0;
    for (int i = 0; i < 5; i++) IMP_TRY(imp_build_float(b, names[i], 0, &out->k[i]));
    while (first < 4 && out->k[first] == 0) first++;
    out->table = imp_build_alloc(b, 1, sizeof *out->table);
    if (!out->table)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_NOMEM, "no memory for a distortion"));
    if (!film_settle(out, seen))
        IMP_TRY(imp_build_error(
            b, names[first], IMP_E_SCENE,
            "the distortion %s = %g has no inverse in the picture: it folds before film "
            "position (%.1f, %.1f)",
            names[first], out->k[first], (-seen[0] - out->x0) / out->dx,
            (-seen[1] - out->y0) / out->dy));
out:
    return st;
}

enum imp_status imp__film_plane_build(const struct imp_build *b, bool offset,
                                      const struct imp_film_desc *film,
                                      struct imp_film_plane *out)
{
    enum imp_status st = IMP_OK;
    *out = (struct imp_film_plane){
        .beside = film->filter.radius, .width = film->width, .height = film->height};
    if (imp_build_has(b, "opencv_fx")) IMP_TRY(calibration_read(b, film, out));
    else IMP_TRY(field_read(b, offset, film, out));
    IMP_TRY(lens_build(b, out));
out:
    return st;
}

bool imp__film_plane_view(struct imp_film_plane *f, double number[IMP_VIEW_NUMBERS],
                          bool set)
{
    const double t = -f->dx * f->width / 2, ty = -f->dy * f->height / 2;
    double seen[2];
    if (!set) {
        number[0] = atan(t) * (360 / IMP_PI);
        number[1] = (1 - f->x0 / t) / 2;
        number[2] = (1 - f->y0 / ty) / 2;
        for (int i = 0; i < 5; i++) number[3 + i] = f->k[i];
        return true;
    }
    const double wide = tan(number[0] * (IMP_PI / 360)), high = ty * (wide / t);
    f->dx = -2 * wide / f->width;
    f->dy = -2 * high / f->height;
    f->x0 = wide * (1 - 2 * number[1]);
    f->y0 = high * (1 - 2 * number[2]);
    for (int i = 0; i < 5; i++) f->k[i] = number[3 + i];
    return film_settle(f, seen);
}

/* x'' = x''(x; k) stays where it is on a film that moves by w: with the lens's slope J,
 *
 *     J x' + dx''/dk = w
 */
void imp__film_plane_velocity(const struct imp_film_plane *f, int number,
                              const double at[2], double out[2])
{
    const double t = -f->dx * f->width / 2, ty = -f->dy * f->height / 2;
    const double x[2] = {-at[0], -at[1]}; /* axes to the right and down */
    double seen[2] = {x[0], x[1]}, slope[3] = {1, 0, 1}, w[2] = {0, 0};
    if (f->lens) imp__distort(f->lens, x, seen, slope);
    if (number == 0) { /* all lengths on the film are as t */
        const double rate = (1 + t * t) / (2 * t) * (IMP_PI / 180);
        w[0] = seen[0] * rate;
        w[1] = seen[1] * rate;
    } else if (number <= 2) {
        w[number - 1] = number == 1 ? 2 * t : 2 * ty;
    } else {
        imp__distort_by(x, number - 3, w);
        w[0] = -w[0];
        w[1] = -w[1];
    }
    const double det = slope[0] * slope[2] - slope[1] * slope[1];
    out[0] = -(slope[2] * w[0] - slope[1] * w[1]) / det;
    out[1] = -(slope[0] * w[1] - slope[1] * w[0]) / det;
}
