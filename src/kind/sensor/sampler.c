/* SPDX-License-Identifier: Apache-2.0
 *
 * Samplers. `independent` leaves the choice of points to the run, as no sampler does: exporters
 * write it into every file. All other names mean points in sets here. There are as many samples
 * as the kind rounds up to, so that a file costs the same everywhere (docs/scene-format.md 10). */
#include "base/compiler.h"
#include "kind/registry.h"
#include "sensor_film.h"
#include <string.h>

#define SPP_MAX ((int64_t)1 << 30)

static int64_t root_down(int64_t n)
{
    int64_t r = 1;
    while ((r + 1) * (r + 1) <= n) r++;
    return r;
}
static int64_t root_up(int64_t n)
{
    const int64_t r = root_down(n);
    return r * r < n ? r + 1 : r;
}
static bool is_prime(int64_t n)
{
    for (int64_t k = 2; k * k <= n; k++)
        if (n % k == 0) return false;
    return n >= 2;
}

static int64_t round_none(int64_t n) { return n; }
static int64_t round_square(int64_t n) { return root_up(n) * root_up(n); }
static int64_t round_multijitter(int64_t n)
{
    const int64_t b = root_down(n);
    return b * ((n + b - 1) / b);
}
static int64_t round_orthogonal(int64_t n)
{
    int64_t p = root_up(n);
    while (!is_prime(p)) p++;
    return p * p;
}
static int64_t round_ldsampler(int64_t n)
{
    int64_t r = 4;
    while (r < n) r *= 4;
    return r;
}

#define SIZE sizeof(struct sampler)
static const struct sampler {
    size_t size;
    const char *name;
    int64_t (*round)(int64_t n);
    bool jitter, strength;
} kinds[] = {{SIZE, "independent", round_none, false, false},
             {SIZE, "stratified", round_square, true, false},
             {SIZE, "multijitter", round_multijitter, true, false},
             {SIZE, "orthogonal", round_orthogonal, true, true},
             {SIZE, "ldsampler", round_ldsampler, false, false}};

const void *imp__sampler_at(const void *payload, size_t i)
{
    (void)payload;
    return i < imp_count(kinds) ? &kinds[i] : NULL;
}

enum imp_status imp__sampler_build(const struct imp_build *b, int *spp,
                                   enum imp_points *points)
{
    enum imp_status st = IMP_OK;
    int64_t count = 4, ignored;
    bool jitter = true;
    size_t kind = 0;
    const void *none;

    if (!b->node) {
        *spp = 4;
        *points = IMP_POINTS_SCENE;
        return IMP_OK;
    }
    while (kind < imp_count(kinds) && strcmp(kinds[kind].name, b->node->type) != 0)
        kind++;
    if (kind == imp_count(kinds))
        IMP_TRY(imp__kind_choose(b->ctx, b->node, imp__sampler_at, NULL, &none));
    IMP_TRY(imp_build_int(b, "sample_count", 4, 1, SPP_MAX, &count));
    IMP_TRY(imp_build_int(b, "seed", 0, 0, INT64_MAX, &ignored));
    if (kinds[kind].jitter) IMP_TRY(imp_build_bool(b, "jitter", true, &jitter));
    if (kinds[kind].strength) IMP_TRY(imp_build_int(b, "strength", 2, 1, 100, &ignored));
    if (!jitter)
        imp__warn(b->ctx, "sampler '%s': jitter=false is ignored, samples stay random",
                  b->node->type);
    IMP_TRY(imp__props_finish(b->ctx, b->node));
    *spp = (int)imp_min(kinds[kind].round(count), SPP_MAX);
    *points = kind == 0 ? IMP_POINTS_SCENE : IMP_POINTS_SOBOL;
out:
    return st;
}
