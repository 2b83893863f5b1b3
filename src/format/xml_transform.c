/* SPDX-License-Identifier: Apache-2.0
 *
 * Operations inside <transform>: each multiplies from the left
 * (docs/scene-format.md 1.4). */
#include "value.h"
#include "xml.h"
#include <string.h>

static void apply(struct xml_file *f, struct imp_mat4 op)
{
    struct xml_level *l = imp__xml_top(f);
    l->matrix = imp__mat4_multiply(&op, &l->matrix);
    if (!imp__mat4_is_finite(&l->matrix))
        imp__xml_fail(f, IMP_E_SCENE, "the transform is not finite");
}

void imp__xml_translate(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (imp__xml_xyz(f, "translate", a, 0, v))
        apply(f, imp__translate(imp__v3(v[0], v[1], v[2])));
}

void imp__xml_scale(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (imp__xml_xyz(f, "scale", a, 1, v))
        apply(f, imp__scale(imp__v3(v[0], v[1], v[2])));
}

void imp__xml_rotate(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3], angle;
    if (!imp__value_float(imp__xml_get(a, "angle"), &angle)) {
        imp__xml_fail(f, IMP_E_SCENE, "rotate: angle = '%.80s' is not a finite number",
                      imp__xml_get(a, "angle"));
        return;
    }
    if (!imp__xml_xyz(f, "rotate", a, 0, v)) return;
    const imp_v3 axis = imp__v3(v[0], v[1], v[2]);
    const double length = imp__length(axis);
    if (!(length > 0) || !isfinite(length)) {
        imp__xml_fail(f, IMP_E_SCENE, "rotate: the axis is %s",
                      length > 0 ? "too long" : "zero");
        return;
    }
    if (fabs(length - 1) > 1e-6) {
        char where[512];
        imp__warn(f->reader->ctx, "%s: rotate: the axis has length %g; it is normalised",
                  imp__loc_text(imp__xml_loc(f), where, sizeof where), length);
    }
    apply(f, imp__rotate(axis * (1 / length), angle));
}

void imp__xml_matrix(struct xml_file *f, const struct xml_attributes *a)
{
    double v[16];
    const int n = imp__value_list(imp__xml_get(a, "value"), 16, v);
    if (n != 16 && n != 9) {
        imp__xml_fail(f, IMP_E_SCENE, "matrix: needs 16 or 9 finite numbers");
        return;
    }
    struct imp_mat4 m = imp__mat4_identity();
    for (int i = 0; i < n; i++) m.m[n == 16 ? i : 4 * (i / 3) + i % 3] = v[i];
    apply(f, m);
}

void imp__xml_lookat(struct xml_file *f, const struct xml_attributes *a)
{
    static const char *const names[] = {"origin", "target", "up"};
    double v[3][3] = {{0}};
    for (int i = 0; i < 3; i++) {
        const char *text = imp__xml_get(a, names[i]);
        if (text && imp__value_list(text, 3, v[i]) != 3) {
            imp__xml_fail(f, IMP_E_SCENE,
                          "lookat: %s = '%.80s' is not three finite numbers", names[i],
                          text);
            return;
        }
    }
    struct imp_mat4 m;
    if (!imp__lookat(imp__v3(v[0][0], v[0][1], v[0][2]),
                     imp__v3(v[1][0], v[1][1], v[1][2]),
                     imp__v3(v[2][0], v[2][1], v[2][2]), &m)) {
        imp__xml_fail(
            f, IMP_E_SCENE,
            "lookat: origin and target are equal, or up is parallel to the view");
        return;
    }
    apply(f, m);
}
