/* SPDX-License-Identifier: Apache-2.0
 *
 * Creation and public access of films. */
#include "film.h"
#include "arguments.h"
#include "float_mode.h"
#include <math.h>
#include <string.h>

/* "R,G,B" -> names; blanks around names do not count, empty and repeated names are
 * errors. */
static enum imp_status names_split(imp_film *f, const char *list)
{
    size_t n = 1;
    for (const char *c = list; *c; c++) n += *c == ',';
    if (n > IMP_FILM_CHANNELS_MAX)
        return imp__error(f->ctx, IMP_E_ARG, "film: %zu channels, at most %d", n,
                          IMP_FILM_CHANNELS_MAX);
    f->names = imp__alloc(f->ctx, n, sizeof *f->names);
    if (!f->names) return imp__error(f->ctx, IMP_E_NOMEM, "film: out of memory");
    for (const char *c = list;; c++) {
        c += strspn(c, " ");
        const size_t length = strcspn(c, ",");
        size_t used = length;
        while (used && c[used - 1] == ' ') used--;
        if (!used || used > 200)
            return imp__error(f->ctx, IMP_E_ARG, "film: bad channel name in '%.200s'",
                              list);
        char *name = imp__alloc(f->ctx, used + 1, 1);
        if (!name) return imp__error(f->ctx, IMP_E_NOMEM, "film: out of memory");
        memcpy(name, c, used);
        if (imp__film_find(f, name) >= 0) {
            imp__release(f->ctx, name);
            return imp__error(f->ctx, IMP_E_ARG, "film: channel name twice in '%.200s'",
                              list);
        }
        f->names[f->channels++] = name;
        c += length;
        if (!*c) return IMP_OK;
    }
}

enum imp_status imp__film_describe(imp_context *ctx, int width, int height,
                                   const char *names, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *f = imp__alloc(ctx, 1, sizeof *f);
    if (!f) return imp__error(ctx, IMP_E_NOMEM, "film: out of memory");
    f->ctx = ctx;
    imp__context_hold(ctx);
    if (width < 1 || height < 1 || width > IMP_FILM_SIDE_MAX ||
        height > IMP_FILM_SIDE_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "film: size %d x %d is not between 1 and %d",
                           width, height, IMP_FILM_SIDE_MAX));
    IMP_TRY(names_split(f, names));
    f->width = width;
    f->height = height;
    if (imp__film_values(f) > IMP_FILM_VALUES_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM,
                           "film: %d x %d with %d channels is too large", width, height,
                           f->channels));
    *out = f;
    return IMP_OK;
out:
    imp_film_destroy(f);
    return st;
}

enum imp_status imp__film_room(imp_film *f, float **array)
{
    *array = imp__alloc_raw(f->ctx, imp__film_values(f), sizeof **array);
    if (*array) return IMP_OK;
    return imp__error(f->ctx, IMP_E_NOMEM, "film: no memory for %d x %d with %d channels",
                      f->width, f->height, f->channels);
}

enum imp_status imp__film_create(imp_context *ctx, int width, int height,
                                 const char *names, bool with_se, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *f = NULL;
    IMP_TRY(imp__film_describe(ctx, width, height, names, &f));
    IMP_TRY(imp__film_room(f, &f->mean));
    memset(f->mean, 0, imp__film_values(f) * sizeof *f->mean);
    if (with_se) {
        IMP_TRY(imp__film_room(f, &f->se));
        memset(f->se, 0, imp__film_values(f) * sizeof *f->se);
    }
    *out = f;
    return IMP_OK;
out:
    imp_film_destroy(f);
    return st;
}

int imp__film_find(const imp_film *f, const char *name)
{
    for (int c = 0; c < f->channels; c++)
        if (strcmp(f->names[c], name) == 0) return c;
    return -1;
}

enum imp_status imp_film_create(imp_context *ctx, int width, int height,
                                const char *names, imp_film **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, names, "names");
    IMP_REQUIRE(ctx, out, "out");
    return imp__film_create(ctx, width, height, names, false, out);
}

static bool same_shape(const imp_film *a, const imp_film *b)
{
    bool same =
        a->width == b->width && a->height == b->height && a->channels == b->channels;
    for (int c = 0; same && c < a->channels; c++)
        same = !strcmp(a->names[c], b->names[c]);
    return same;
}

/* With n1 and n2 samples, w = n2/(n1 + n2):
 *
 *     m = (1 - w) m1 + w m2,    s^2 = (1 - w)^2 s1^2 + w^2 s2^2 */
enum imp_status imp_film_merge(imp_film *f, const imp_film *other)
{
    IMP_REQUIRE(NULL, f, "film");
    IMP_REQUIRE(f->ctx, other, "other");
    IMP_FLOAT_MODE;
    if (!same_shape(f, other))
        return imp__error(f->ctx, IMP_E_ARG, "pictures of other sizes or channels");
    if (f->spp < 1 || other->spp < 1)
        return imp__error(f->ctx, IMP_E_ARG,
                          "a picture without samples per pixel is not merged");
    const size_t n = imp__film_values(f);
    const double w = (double)other->spp / ((double)f->spp + (double)other->spp);
    for (size_t i = 0; i < n; i++)
        f->mean[i] = (float)((1 - w) * f->mean[i] + w * other->mean[i]);
    if (!other->se) {
        imp__release(f->ctx, f->se);
        f->se = NULL;
    }
    for (size_t i = 0; f->se && i < n; i++)
        f->se[i] = (float)hypot((1 - w) * f->se[i], w * other->se[i]);
    f->spp += other->spp;
    f->sets += other->sets;
    f->dropped += other->dropped;
    imp__drops_merge(&f->drops, &other->drops);
    return IMP_OK;
}

void imp_film_destroy(imp_film *f)
{
    if (!f) return;
    imp_context *ctx = f->ctx;
    for (int c = 0; c < f->channels; c++) imp__release(ctx, f->names[c]);
    for (size_t i = 0; i < f->n_texts; i++) {
        imp__release(ctx, f->texts[i].key);
        imp__release(ctx, f->texts[i].value);
    }
    imp__release(ctx, f->texts);
    imp__release(ctx, f->names);
    imp__release(ctx, f->mean);
    imp__release(ctx, f->se);
    imp__release(ctx, f);
    imp__context_drop(ctx);
}

enum imp_status imp_film_get_info(const imp_film *f, struct imp_film_info *info)
{
    IMP_REQUIRE(NULL, f, "film");
    IMP_REQUIRE(f->ctx, info, "info");
    struct imp_film_info all = {.size = sizeof all,
                                .width = f->width,
                                .height = f->height,
                                .channels = f->channels,
                                .spp = f->spp,
                                .has_se = f->se != NULL,
                                .dropped = f->dropped,
                                .n_drop_keys = f->drops.n_keys};
    memcpy(all.dropped_by_cause, f->drops.by_cause, sizeof all.dropped_by_cause);
    all.drop_keys = f->drops.keys;
    IMP_GIVE(f->ctx, info, all, "info");
    return IMP_OK;
}

const char *imp_film_channel(const imp_film *f, int channel)
{
    return f && channel >= 0 && channel < f->channels ? f->names[channel] : NULL;
}

float *imp_film_mean(imp_film *f) { return f ? f->mean : NULL; }
float *imp_film_se(imp_film *f) { return f ? f->se : NULL; }

const char *imp_film_text(const imp_film *f, const char *key)
{
    for (size_t i = 0; f && key && i < f->n_texts; i++)
        if (strcmp(f->texts[i].key, key) == 0) return f->texts[i].value;
    return NULL;
}

enum imp_status imp_film_set_text(imp_film *f, const char *key, const char *value)
{
    IMP_REQUIRE(NULL, f, "film");
    imp_context *ctx = f->ctx;
    IMP_REQUIRE(ctx, key, "key");
    IMP_REQUIRE(ctx, value, "value");
    if (!*key || strlen(key) > 200)
        return imp__error(ctx, IMP_E_ARG, "film: a text needs a key of 1 to 200 bytes");
    char *copy = imp__strdup(ctx, value);
    if (!copy) return imp__error(ctx, IMP_E_NOMEM, "film: out of memory");
    for (size_t i = 0; i < f->n_texts; i++)
        if (strcmp(f->texts[i].key, key) == 0) {
            imp__release(ctx, f->texts[i].value);
            f->texts[i].value = copy;
            return IMP_OK;
        }
    struct imp_film_text *texts =
        imp__grow(ctx, f->texts, &f->cap_texts, f->n_texts + 1, sizeof *texts);
    if (texts) f->texts = texts;
    char *key_copy = texts ? imp__strdup(ctx, key) : NULL;
    if (!key_copy) {
        imp__release(ctx, copy);
        return imp__error(ctx, IMP_E_NOMEM, "film: out of memory");
    }
    f->texts[f->n_texts++] = (struct imp_film_text){key_copy, copy};
    return IMP_OK;
}
