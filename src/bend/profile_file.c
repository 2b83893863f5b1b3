/* SPDX-License-Identifier: Apache-2.0
 *
 * Radial and rz fields as text, # begins a comment:
 *
 *     importon-profile 1                        importon-profile 1
 *     radial sphere|cylinder                    rz
 *     centre X Y Z                              centre X Y Z
 *     axis X Y Z                                axis X Y Z
 *     radius R                                  radius R
 *     coefficients N  c_1 ... c_N               z LO HI
 *                                               coefficients NR NZ  c_1 ... (r fastest)
 *
 * with cells + 3 coefficients along r^2 and along z. */
#include "base/file.h"
#include "base/number.h"
#include "bend_rays.h"
#include <stdio.h>
#include <string.h>

struct text {
    const char *s, *end;
};

static void blank(struct text *t)
{
    while (t->s < t->end) {
        if (*t->s == '#') {
            while (t->s < t->end && *t->s != '\n') t->s++;
        } else if (*t->s == ' ' || *t->s == '\t' || *t->s == '\r' || *t->s == '\n') {
            t->s++;
        } else {
            break;
        }
    }
}
static bool word_is(struct text *t, const char *word)
{
    blank(t);
    const size_t n = strlen(word);
    if ((size_t)(t->end - t->s) < n || memcmp(t->s, word, n) != 0) return false;
    t->s += n;
    return true;
}
/* Powers of larger numbers, and of lengths in units of smaller ones, overflow where a
 * profile goes on beyond its radius. */
#define LARGEST  1e12
#define SHORTEST 1e-12

static bool is_large(double x) { return !(fabs(x) <= LARGEST); }
static bool is_short(double length) { return length > 0 && length < SHORTEST; }

static bool numbers(struct text *t, int n, double *out)
{
    for (int i = 0; i < n; i++) {
        blank(t);
        if (!imp__number(&t->s, t->end, &out[i]) || is_large(out[i])) return false;
    }
    return true;
}

/* The file after its first word: sizes, then coefficients. */
static enum imp_status radial_read(imp_context *ctx, const char *path, struct text *t,
                                   double *count, imp_field **out)
{
    struct imp_field_radial r = IMP_FIELD_RADIAL_INIT;
    bool ok = true;
    if (word_is(t, "cylinder")) r.cylinder = 1;
    else ok = word_is(t, "sphere");
    ok = ok && word_is(t, "centre") && numbers(t, 3, r.centre) && word_is(t, "axis") &&
         numbers(t, 3, r.axis) && word_is(t, "radius") && numbers(t, 1, &r.radius) &&
         word_is(t, "coefficients") && numbers(t, 1, count);
    if (!ok || is_short(r.radius) || !(*count >= 4) || !(*count <= 65539))
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: not a profile (importon-profile 1) of numbers up to "
                          "1e12 and of a radius from 1e-12",
                          path);
    r.cells = (int)*count - 3;
    return imp_field_radial_create(ctx, &r, 1, out);
}
static enum imp_status rz_read(imp_context *ctx, const char *path, struct text *t,
                               double *count, imp_field **out)
{
    struct imp_field_rz r = IMP_FIELD_RZ_INIT;
    double z[2] = {0}, n[2] = {0};
    const bool ok = word_is(t, "centre") && numbers(t, 3, r.centre) &&
                    word_is(t, "axis") && numbers(t, 3, r.axis) && word_is(t, "radius") &&
                    numbers(t, 1, &r.radius) && word_is(t, "z") && numbers(t, 2, z) &&
                    word_is(t, "coefficients") && numbers(t, 2, n);
    const bool thin = is_short(r.radius) || is_short(z[1] - z[0]);
    if (!ok || thin || !(n[0] >= 4 && n[0] <= 8195 && n[1] >= 4 && n[1] <= 8195))
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: not an rz profile (importon-profile 1) of numbers "
                          "up to 1e12 and of a radius and height from 1e-12",
                          path);
    r.lo = z[0], r.hi = z[1];
    r.cells_r = (int)n[0] - 3, r.cells_z = (int)n[1] - 3;
    *count = (double)((int)n[0] * (int)n[1]);
    if (*count > (double)(t->end - t->s)) /* each takes at least one character */
        return imp__error(ctx, IMP_E_SCENE, "%s: fewer than %.0f coefficients", path,
                          *count);
    return imp_field_rz_create(ctx, &r, 1, out);
}

enum imp_status imp__profile_read(imp_context *ctx, const char *path,
                                  const struct imp_bytes *b, imp_field **out)
{
    enum imp_status st = IMP_OK;
    struct text t = {(const char *)b->data, (const char *)b->data + b->size};
    double count = 0, *c = NULL;
    imp_field *f = NULL;
    if (!word_is(&t, "importon-profile") || !word_is(&t, "1"))
        IMP_TRY(
            imp__error(ctx, IMP_E_SCENE, "%s: not a profile (importon-profile 1)", path));
    if (word_is(&t, "radial")) st = radial_read(ctx, path, &t, &count, &f);
    else if (word_is(&t, "rz")) st = rz_read(ctx, path, &t, &count, &f);
    else st = imp__error(ctx, IMP_E_SCENE, "%s: a profile is radial or rz", path);
    if (st == IMP_E_ARG) st = imp__error_prefix(ctx, IMP_E_SCENE, "%s", path);
    if (st != IMP_OK) goto out;
    c = imp__alloc(ctx, f->n_theta, sizeof *c);
    if (!c) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: no memory", path));
    if (!numbers(&t, (int)f->n_theta, c))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: fewer than %zu coefficients", path,
                           f->n_theta));
    IMP_TRY(imp_field_set_theta(f, c));
    *out = f;
    f = NULL;
out:
    imp__release(ctx, c);
    imp_field_destroy(f);
    return st;
}

static size_t place_print(char *s, size_t room, imp_v3 centre, imp_v3 axis, double radius)
{
    return (size_t)snprintf(s, room,
                            "centre %.17g %.17g %.17g\naxis %.17g %.17g %.17g\n"
                            "radius %.17g\n",
                            centre[0], centre[1], centre[2], axis[0], axis[1], axis[2],
                            radius);
}

/* Are all numbers of a field such as are read? */
static bool is_within(const imp_field *f)
{
    imp_v3 centre, axis;
    double length[4]; /* radius, lo, hi, height */
    if (f->ops == &imp__field_radial) {
        const struct imp__radial *r = (const struct imp__radial *)f;
        centre = r->centre;
        axis = imp__v3_load(r->desc.axis);
        memcpy(length, (double[4]){r->desc.radius}, sizeof length);
    } else {
        const struct imp__rz *r = (const struct imp__rz *)f;
        const double lo = r->desc.lo, hi = r->desc.hi;
        centre = r->centre;
        axis = r->axis;
        memcpy(length, (double[4]){r->desc.radius, lo, hi, hi - lo}, sizeof length);
    }
    bool large = false;
    for (int i = 0; i < 3; i++) large |= is_large(centre[i]) || is_large(axis[i]);
    for (int i = 0; i < 3; i++) large |= is_large(length[i]);
    for (size_t i = 0; i < f->n_theta; i++) large |= is_large(f->theta[i]);
    return !large && !is_short(length[0]) && !is_short(length[3]);
}

enum imp_status imp__profile_write(const imp_field *f, const char *path)
{
    if (!is_within(f))
        return imp__error(f->ctx, IMP_E_UNSUPPORTED,
                          "%s: not written, since it could not be read: files of "
                          "profiles hold numbers up to 1e12, a radius and a height from "
                          "1e-12",
                          path);
    const size_t room = 1024 + 32 * f->n_theta;
    char *s = imp__alloc(f->ctx, room, 1);
    size_t at;
    if (!s) return imp__error(f->ctx, IMP_E_NOMEM, "%s: no memory", path);
    if (f->ops == &imp__field_radial) {
        const struct imp__radial *r = (const struct imp__radial *)f;
        at = (size_t)snprintf(s, room, "importon-profile 1\nradial %s\n",
                              r->desc.cylinder ? "cylinder" : "sphere");
        at += place_print(s + at, room - at, r->centre, imp__v3_load(r->desc.axis),
                          r->desc.radius);
        at += (size_t)snprintf(s + at, room - at, "coefficients %zu\n", f->n_theta);
    } else {
        const struct imp__rz *r = (const struct imp__rz *)f;
        at = (size_t)snprintf(s, room, "importon-profile 1\nrz\n");
        at += place_print(s + at, room - at, r->centre, r->axis, r->desc.radius);
        at += (size_t)snprintf(s + at, room - at, "z %.17g %.17g\ncoefficients %d %d\n",
                               r->desc.lo, r->desc.hi, r->n_u, r->n_z);
    }
    for (size_t i = 0; i < f->n_theta; i++)
        at += (size_t)snprintf(s + at, room - at, "%.17g\n", f->theta[i]);
    for (size_t i = 0; i < at; i++)
        if (s[i] == ',') s[i] = '.'; /* whatever the host's locale */
    const enum imp_status st = imp__file_write(f->ctx, path, s, at);
    imp__release(f->ctx, s);
    return st;
}
