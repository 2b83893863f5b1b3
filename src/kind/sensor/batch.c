/* SPDX-License-Identifier: Apache-2.0
 *
 * Several sensors, whose pictures are side by side in one film: columns [k w, (k + 1) w)
 * are those of sensor k, with w the width over the number of sensors. */
#include "kind/build.h"

struct batch {
    double width; /* of each, in pixels */
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s);

static const struct imp_sensor *child_at(const struct imp_sensor *s, double *px)
{
    const struct batch *batch = s->self;
    const int k = (int)imp_clamp(*px / batch->width, 0.0, s->n_child - 1.0);
    *px -= k * batch->width;
    return s->child[k];
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    const struct imp_sensor *child = child_at(s, &px);
    child->ops->ray(child, px, py, lens, out);
}

/* One of them, each as likely. A film position beside its own picture is another's. */
static bool connect(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out)
{
    const struct batch *batch = s->self;
    const int n = s->n_child, k = imp_min((int)(u[0] * n), n - 1);
    const double v[4] = {imp_clamp(u[0] * n - k, 0.0, 1.0), u[1], u[2], u[3]};
    const struct imp_sensor *child = s->child[k];
    if (!child->ops->connect(child, ref, far, v, out)) return false;
    if (!(out->px >= 0 && out->px < batch->width)) return false;
    out->px += k * batch->width;
    out->weight *= n;
    return true;
}

#define BATCH(flags_, connect_)                                                          \
    {                                                                                    \
        .size = sizeof(struct imp_sensor_ops), .name = "batch",                          \
        .object_size = sizeof(struct batch), .build = build, .ray = ray,                 \
        .flags = IMP_SENSOR_GROUP | (flags_), .connect = connect_                        \
    }
const struct imp_sensor_ops imp__batch = BATCH(0, connect);
/* What one of its sensors cannot do, it cannot. */
static const struct imp_sensor_ops parallel = BATCH(IMP_SENSOR_PARALLEL, connect),
                                   unconnected = BATCH(0, NULL);

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    struct batch *batch = self;
    if (s->film.sample_border)
        return imp_build_error(b, NULL, IMP_E_UNSUPPORTED,
                               "its film has sample_border, and what is beside a picture "
                               "is the next one");
    batch->width = (double)s->film.width / s->n_child;
    for (int k = 0; k < s->n_child; k++)
        if (s->child[k]->ops->flags & IMP_SENSOR_PARALLEL) s->ops = &parallel;
    for (int k = 0; k < s->n_child; k++)
        if (!s->child[k]->ops->connect) s->ops = &unconnected;
    return IMP_OK;
}
