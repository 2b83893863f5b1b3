/* SPDX-License-Identifier: Apache-2.0
 *
 * What a kind of an older header leaves alone at the end of a struct that it fills is zero:
 * the engine's calls (kind/cleared.h) clear rays and samples that hold anything before. */
#include "imp_tap.h"
#include "kind/cleared.h"
#include "kind/shape/shape.h"
#include <stddef.h>
#include <string.h>

static size_t filled; /* bytes that the kind's header knows */

static void fill(void *out) { memset(out, 1, filled); }
static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    (void)s, (void)px, (void)py, (void)lens;
    fill(out);
}
static bool reach(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                  const double u[4], struct imp_sensor_sample *out)
{
    (void)s, (void)ref, (void)far, (void)u;
    fill(out);
    return true;
}
static bool start(const struct imp_emitter *e, const struct imp_ball *scene,
                  const double u[4], struct imp_emission_sample *out)
{
    (void)e, (void)scene, (void)u;
    fill(out);
    return true;
}
static void round_of(const struct imp_shape *s, struct imp_round *out)
{
    (void)s;
    fill(out);
}

/* Bytes up to the end of the last field: those behind it belong to nobody. */
#define END(name, last)                                                                  \
    (offsetof(struct name, last) + sizeof(((struct name *)NULL)->last))

static void compare(const void *out, size_t size, const char *what)
{
    const unsigned char *byte = out;
    bool right = true;
    for (size_t i = 0; i < size; i++) right &= byte[i] == (i < filled);
    tap_ok(right, "%s of a header that knows %zu of %zu bytes", what, filled, size);
}

int main(void)
{
    const struct imp_sensor_ops sensor_ops = {.ray = ray, .connect = reach};
    const struct imp_emitter_ops emitter_ops = {.sample_emission = start};
    const struct imp_shape_ops shape_ops = {.round = round_of};
    const struct imp_sensor sensor = {.ops = &sensor_ops};
    const struct imp_emitter emitter = {.ops = &emitter_ops};
    const struct imp_shape shape = {.ops = &shape_ops};
    const imp_v3 ref = {0};
    const double u[4] = {0};
    struct imp_sensor_ray r;
    struct imp_sensor_sample seen;
    struct imp_emission_sample begin;
    struct imp_round round;
    const struct imp_ball ball = {.radius = 1};
    for (filled = 32; filled <= 64; filled += 16) {
        memset(&r, 0xa5, sizeof r);
        memset(&seen, 0xa5, sizeof seen);
        memset(&begin, 0xa5, sizeof begin);
        memset(&round, 0xa5, sizeof round);
        imp__sensor_ray(&sensor, 0, 0, u, &r);
        compare(&r, END(imp_sensor_ray, t_far), "a ray");
        imp__sensor_connect(&sensor, &ref, false, u, &seen);
        compare(&seen, END(imp_sensor_sample, cos_sensor), "a connection");
        imp__emission_sample(&emitter, &ball, u, &begin);
        compare(&begin, END(imp_emission_sample, pdf_d), "a start at a light");
        imp__shape_round(&shape, &round);
        compare(&round, END(imp_round, radius), "a sphere");
    }
    return tap_done();
}
