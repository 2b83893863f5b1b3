/* SPDX-License-Identifier: Apache-2.0
 *
 * Text of a search's state: writing, and strict reading. */
#include "checkpoint.h"
#include "base/file.h"
#include "math/hash.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define MAGIC "importon checkpoint 5\n"

/* ---- Writing ------------------------------------------------------------------- */

/* A number a line, straight to the file: text of millions of numbers would take more
 * memory than the search. */
struct sink {
    struct imp_file_writer *to;
    uint64_t hash; /* of everything but the fingerprint, against damage */
};

IMP_PRINTF(2, 3) static void put(struct sink *s, const char *format, ...)
{
    char line[128]; /* longer than any of them */
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(line, sizeof line, format, args);
    va_end(args);
    imp__file_put(s->to, line, (size_t)n);
}

static void put_array(struct sink *s, const char *name, const double *v, size_t n)
{
    static const char digit[] = "0123456789abcdef";
    put(s, "%s %zu\n", name, n);
    for (size_t i = 0; i < n; i++) {
        char text[17];
        uint64_t bits;
        memcpy(&bits, &v[i], 8);
        for (int k = 0; k < 16; k++) text[k] = digit[(bits >> (60 - 4 * k)) & 15];
        text[16] = '\n';
        imp__file_put(s->to, text, sizeof text);
    }
    s->hash = imp__hash(s->hash, v, n * sizeof *v);
}

static uint64_t head_hash(int kind, size_t n, int iteration, int finished)
{
    const uint64_t head[4] = {(uint64_t)kind, n, (uint64_t)iteration, (uint64_t)finished};
    return imp__hash(0, head, sizeof head);
}

struct contents {
    const struct imp__fingerprint *of;
    const struct imp__search *search;
};

static void contents_put(struct imp_file_writer *w, const void *payload)
{
    const struct contents *c = payload;
    const struct imp__search *search = c->search;
    char name[16];
    struct sink s = {w, head_hash((int)search->kind, search->n, search->iteration,
                                  (int)search->finished)};

    put(&s, MAGIC "optimizer %d\nvariables %zu\n", (int)search->kind, search->n);
    put(&s, "of %016llx %016llx %016llx %016llx\n", (unsigned long long)c->of->parameters,
        (unsigned long long)c->of->scene, (unsigned long long)c->of->targets,
        (unsigned long long)c->of->options);
    put(&s, "iteration %d\nfinished %d\n", search->iteration, (int)search->finished);
    put_array(&s, "start", search->start, search->start ? search->n : 0);
    put_array(&s, "x", search->x, search->n);
    put_array(&s, "history", search->history, search->n_history);
    put_array(&s, "history_se", search->history_se, search->n_history);
    put_array(&s, "history_x", search->history_x, imp__search_trail(search));
    put_array(&s, "scalars", search->scalar, IMP_SEARCH_SCALARS);
    for (int k = 0; k < IMP_SEARCH_ARRAYS; k++) {
        snprintf(name, sizeof name, "array%d", k);
        put_array(&s, name, search->array[k], search->array_n[k]);
    }
    if (search->n_goal > 0) put_array(&s, "goal", search->goal_numbers, search->n_goal);
    put(&s, "end %016llx\n", (unsigned long long)s.hash);
}

enum imp_status imp__checkpoint_write(imp_context *ctx, const char *path,
                                      const struct imp__fingerprint *of,
                                      const struct imp__search *search)
{
    return imp__file_write_by(ctx, path, contents_put, &(struct contents){of, search});
}

/* ---- Reading ------------------------------------------------------------------- */

/* The file is read twice: checked, then taken over. A second search, to be filled and
 * then checked, would take as much memory as the first. */
struct source {
    FILE *f;
    imp_context *ctx;
    const char *path;
    size_t max; /* numbers the file has room for */
    uint64_t hash;
    const struct imp__goal *goal;
    bool take;
};

static enum imp_status damaged(const struct source *s, const char *what)
{
    return imp__error(s->ctx, IMP_E_IO, "%s: damaged checkpoint (%s)", s->path, what);
}

/* "name count" with a count that fits the file. */
static enum imp_status get_head(struct source *s, const char *name, size_t *n)
{
    char line[64], word[32];
    unsigned long long count;
    if (!fgets(line, sizeof line, s->f) || sscanf(line, "%31s %llu", word, &count) != 2 ||
        strcmp(word, name) != 0 || count > s->max)
        return damaged(s, name);
    *n = (size_t)count;
    return IMP_OK;
}

static enum imp_status get_number(struct source *s, const char *name, double *v)
{
    char text[17];
    uint64_t bits = 0;
    if (fread(text, 1, 17, s->f) != 17 || text[16] != '\n') return damaged(s, name);
    for (int k = 0; k < 16; k++) {
        const char c = text[k];
        const int d = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                             : -1;
        if (d < 0) return damaged(s, name);
        bits = bits << 4 | (uint64_t)d;
    }
    memcpy(v, &bits, 8);
    s->hash = imp__hash(s->hash, v, sizeof *v);
    return IMP_OK;
}

/* v [n], written when the file is taken. `fits`, if any, must be true of every number. */
static enum imp_status
get_numbers(struct source *s, const char *name, double *v, size_t n,
            bool (*fits)(const struct imp__goal *goal, size_t k, double value))
{
    for (size_t i = 0; i < n; i++) {
        double value = 0;
        const enum imp_status st = get_number(s, name, &value);
        if (st != IMP_OK) return st;
        if (fits && !fits(s->goal, i, value))
            return damaged(s, "values outside their bounds");
        if (s->take) v[i] = value;
    }
    return IMP_OK;
}

static enum imp_status get_array(struct source *s, const char *name, double *v, size_t n,
                                 bool (*fits)(const struct imp__goal *goal, size_t k,
                                              double value))
{
    size_t count = 0;
    const enum imp_status st = get_head(s, name, &count);
    if (st != IMP_OK) return st;
    return count == n ? get_numbers(s, name, v, n, fits) : damaged(s, name);
}

static bool is_number(const struct imp__goal *goal, size_t k, double value)
{
    (void)goal, (void)k;
    return isfinite(value);
}
static bool is_inside(const struct imp__goal *goal, size_t k, double value)
{
    return imp__into_bounds(goal, k, value) == value;
}

static enum imp_status same_problem(const struct source *s,
                                    const struct imp__fingerprint *is,
                                    const struct imp__fingerprint *of)
{
    const char *what = is->parameters != of->parameters ? "other parameters are active"
                       : is->targets != of->targets ? "its targets or regularisers differ"
                       : is->scene != of->scene
                           ? "the scene, or a parameter that is held, differs"
                       : is->options != of->options
                           ? "seed, samples per pixel or optimiser's options differ"
                           : NULL;
    if (!what) return IMP_OK;
    return imp__error(s->ctx, IMP_E_ARG, "%s: the checkpoint is of another fit: %s",
                      s->path, what);
}

static enum imp_status read_head(struct source *s, const struct imp__fingerprint *of,
                                 const struct imp__search *search, int *iteration,
                                 int *finished)
{
    char magic[sizeof MAGIC];
    int kind;
    unsigned long long n, h[4];
    if (!fgets(magic, sizeof magic, s->f) || strcmp(magic, MAGIC) != 0)
        return imp__error(s->ctx, IMP_E_SCENE, "%s: not a checkpoint of this version",
                          s->path);
    if (fscanf(
            s->f,
            "optimizer %d variables %llu of %llx %llx %llx %llx iteration %d finished %d",
            &kind, &n, &h[0], &h[1], &h[2], &h[3], iteration, finished) != 8 ||
        fgetc(s->f) != '\n' || *iteration < 0 || *iteration > 1000000000 ||
        *finished < 0 || *finished >= IMP_FINISH_KINDS)
        return damaged(s, "head");
    const struct imp__fingerprint is = {h[0], h[1], h[2], h[3]};
    const enum imp_status st = same_problem(s, &is, of);
    if (st != IMP_OK) return st;
    return n == search->n && kind == (int)search->kind ? IMP_OK : damaged(s, "head");
}

static enum imp_status read_body(struct source *s, struct imp__search *t)
{
    enum imp_status st = IMP_OK;
    size_t n = 0;
    char name[16];

    IMP_TRY(get_array(s, "start", t->start, t->start ? t->n : 0, is_number));
    IMP_TRY(get_array(s, "x", t->x, t->n, is_inside));
    IMP_TRY(get_head(s, "history", &n));
    for (size_t k = 0; s->take && k < n; k++)
        IMP_TRY(imp__search_log(t, (struct imp_estimate){0}, t->x));
    IMP_TRY(get_numbers(s, "history", t->history, n, NULL));
    IMP_TRY(get_array(s, "history_se", t->history_se, n, NULL));
    IMP_TRY(get_array(s, "history_x", t->history_x, imp__search_trails(t) ? n * t->n : 0,
                      is_number));
    IMP_TRY(get_array(s, "scalars", t->scalar, IMP_SEARCH_SCALARS, NULL));
    for (int k = 0; k < IMP_SEARCH_ARRAYS; k++) {
        snprintf(name, sizeof name, "array%d", k);
        IMP_TRY(get_head(s, name, &n));
        /* Arrays that exist from the start have their size; the others grow. */
        if (t->array_n[k] != 0 && t->array_n[k] != n) IMP_TRY(damaged(s, name));
        if (n > 0 && s->take) IMP_TRY(imp__search_array(t, k, n));
        IMP_TRY(get_numbers(s, name, t->array[k], n, NULL));
    }
    if (t->n_goal > 0)
        IMP_TRY(get_array(s, "goal", t->goal_numbers, t->n_goal, is_number));
    const uint64_t hash = s->hash;
    unsigned long long end;
    if (fscanf(s->f, "end %16llx", &end) != 1 || end != hash || fgetc(s->f) != '\n' ||
        fgetc(s->f) != EOF)
        IMP_TRY(damaged(s, "checksum"));
out:
    return st;
}

enum imp_status imp__checkpoint_read(imp_context *ctx, const char *path,
                                     const struct imp__fingerprint *of,
                                     const struct imp__goal *goal,
                                     struct imp__search *search, bool *found)
{
    enum imp_status st = IMP_OK;
    struct source s = {.ctx = ctx, .path = path, .goal = goal};
    struct imp_bytes held;
    int iteration = 0, finished = 0;

    st = imp__file_open(ctx, path, &held, &s.f);
    *found = s.f != NULL;
    if (!s.f) return st;
    if (fseek(s.f, 0, SEEK_END) != 0)
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: cannot be read", path));
    const long size = ftell(s.f);
    s.max = size > 0 ? (size_t)size / 17 : 0;
    for (int pass = 0; pass < 2; pass++) {
        if (size < 0 || fseek(s.f, 0, SEEK_SET) != 0)
            IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: cannot be read", path));
        s.take = pass == 1;
        IMP_TRY(read_head(&s, of, search, &iteration, &finished));
        s.hash = head_hash((int)search->kind, search->n, iteration, finished);
        IMP_TRY(read_body(&s, search));
    }
    search->iteration = iteration;
    imp__search_finish(search, (enum imp__finish)finished);
out:
    fclose(s.f);
    imp__bytes_free(ctx, &held);
    return st;
}
