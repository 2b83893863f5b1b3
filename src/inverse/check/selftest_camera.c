/* SPDX-License-Identifier: Apache-2.0
 *
 * Cameras: the rays of a whole film, its corners and the lens' too. */
#include "kind/cleared.h"
#include "selftest.h"

static enum imp_status camera(struct imp__selftest *t, const struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *f = &s->film;
    double bad = 0, turned = 0, jumps = 0, n = 0;
    const double h = 1e-4;
    for (int k = 0; k < 4000; k++) {
        const struct imp_key key = imp__key(t->options.seed, 21, (uint64_t)k);
        double x[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        double lens[2] = {imp__u01(key, 2), imp__u01(key, 3)};
        for (int c = 0; k < 16 && c < 2; c++) { /* corners */
            x[c] = k >> c & 1;
            lens[c] = k >> (2 + c) & 1 ? 0x1.fffffffffffffp-1 : 0;
        }
        const double px = f->crop_x + x[0] * f->crop_w, py = f->crop_y + x[1] * f->crop_h;
        struct imp_sensor_ray ray[3];
        for (int i = 0; i < 3; i++)
            imp__sensor_ray(s, px + i * h, py - i * h, lens, &ray[i]);
        n++;
        bool sane = ray[0].t_near >= 0 && ray[0].t_near < ray[0].t_far;
        for (int c = 0; c < 3; c++)
            sane &= isfinite(ray[0].o[c]) && isfinite(ray[0].d[c]);
        bad += !sane;
        turned += sane && !(fabs(imp__length(ray[0].d) - 1) < 1e-9);
        /* Neighbouring positions have neighbouring rays: second differences are small. */
        const imp_v3 one = ray[1].d - ray[0].d, two = ray[2].d - ray[1].d;
        const imp_v3 o1 = ray[1].o - ray[0].o, o2 = ray[2].o - ray[1].o;
        const double step = imp__length(one) + imp__length(o1);
        jumps += sane &&
                 !(imp__length(two - one) + imp__length(o2 - o1) < 0.05 * step + 1e-10);
    }
    const char *name = s->name, *kind = s->ops->name;
    IMP_TRY(imp__selftest_count(t, name, kind, "finite", bad, n));
    IMP_TRY(imp__selftest_count(t, name, kind, "unit", turned, n));
    IMP_TRY(imp__selftest_count(t, name, kind, "smooth", jumps, n));

    const struct imp_filter *filter = &f->filter;
    double sum = 0;
    bad = n = 0;
    for (int k = 0; k < 1000; k++, n++) {
        const double x = filter->radius * (2 * (k + 0.5) / 1000 - 1);
        const double value = filter->ops->eval(filter, x);
        bad += !isfinite(value) ||
               fabs(value - filter->ops->eval(filter, -x)) > 1e-9 * fabs(value);
        sum += value;
    }
    IMP_TRY(imp__selftest_count(t, name, filter->ops->name, "filter",
                                bad + !(sum > 0 && filter->radius > 0), n));
out:
    return st;
}

enum imp_status imp__selftest_cameras(struct imp__selftest *t)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < t->scene->n_sensors; k++) {
        t->part = (double)k / t->scene->n_sensors;
        IMP_TRY(camera(t, t->scene->sensors[k]));
    }
out:
    return st;
}
