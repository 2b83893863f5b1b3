/* SPDX-License-Identifier: Apache-2.0
 *
 * The checkpoint of a measurement: after each stage its decisions and numbers as text, numbers as the
 * 64 bits of a double in hexadecimal, so that one which goes on has the bits of one that was
 * never stopped. */
#include "base/arguments.h"
#include "base/number.h"
#include "base/text.h"
#include "math/hash.h"
#include "measuring.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC "importon checkpoint measure 1\n"
#define MOST  (1u << 30) /* bytes */

/* ---- Writing --------------------------------------------------------------------------- */

static void put_number(struct imp_text *t, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, 8);
    imp__put(t, "%016" PRIx64 "\n", bits);
}

enum imp_status imp__measure_state_write(const struct imp__measure *m)
{
    struct imp_text t = {.ctx = m->ctx};
    const struct imp_scene *s = m->scene;
    if (!m->o.checkpoint) return IMP_OK;
    imp__put(&t, MAGIC "task %016" PRIx64 "\nnext %d %d\n", m->task, m->round, m->next);
    for (int k = 0; k < IMP_MEASURE_STAGES; k++) imp__put(&t, "%d\n", m->due[k]);
    for (size_t k = 0; k < s->n_params; k++)
        for (size_t e = 0; e < s->params[k].info.count; e++)
            put_number(&t, imp__param_get(&s->params[k], e));
    for (size_t i = 0; i < s->n_theta; i++) put_number(&t, m->at[i]);
    for (size_t i = 0; i < s->n_theta; i++) put_number(&t, m->at_se[i]);
    for (size_t i = 0; i < m->n_photos; i++) {
        const struct imp__photo *p = &m->photos[i];
        put_number(&t, p->noise);
        put_number(&t, p->noise_of);
        for (int k = 0; k < p->columns * p->rows; k++)
            imp__put(&t, "%d%s", p->masked[k], k + 1 < p->columns * p->rows ? "" : "\n");
    }
    imp__put(&t, "rows %zu\n", m->n_rows);
    for (size_t i = 0; i < m->n_rows; i++) {
        const struct imp_measure_row *r = &m->rows[i];
        imp__put(&t, "%d %d %zu %d %d\n", r->round, (int)r->stage, r->n, r->iterations,
                 (int)r->explained);
        put_number(&t, r->residual);
        put_number(&t, r->residual_hi);
        put_number(&t, r->chi2);
        put_number(&t, r->chi2_se);
        put_number(&t, r->moved);
    }
    imp__put(&t, "lines %zu\n", m->n_lines);
    for (size_t i = 0; i < m->n_lines; i++) imp__put(&t, "%s\n", m->lines[i]);
    const uint64_t sum = imp__hash(0, t.bytes.data, t.bytes.size);
    imp__put(&t, "end %016" PRIx64 "\n", sum);
    const enum imp_status st =
        t.failed ? imp__error(m->ctx, IMP_E_NOMEM, "no memory for a checkpoint")
                 : imp__file_write(m->ctx, m->o.checkpoint, t.bytes.data, t.bytes.size);
    imp__bytes_free(m->ctx, &t.bytes);
    return st;
}

/* ---- Reading --------------------------------------------------------------------------- */

struct source {
    const char *at, *end;
    bool bad;
};

/* The next line without its newline; empty with `bad` at the end. */
static size_t line(struct source *s, const char **out)
{
    const char *stop =
        s->at < s->end ? memchr(s->at, '\n', (size_t)(s->end - s->at)) : NULL;
    *out = s->at;
    if (!stop) {
        s->bad = true;
        return 0;
    }
    s->at = stop + 1;
    return (size_t)(stop - *out);
}

/* A line that is a word and n numbers, in decimal. */
static void take(struct source *s, const char *word, int64_t *out, int n)
{
    const char *from;
    const size_t length = line(s, &from), w = strlen(word);
    const char *end = from + length;
    s->bad |= length < w || strncmp(from, word, w) != 0;
    if (s->bad) return;
    from += w;
    for (int k = 0; k < n; k++) {
        while (from < end && *from == ' ') from++;
        s->bad |= !imp__integer(&from, end, &out[k]);
    }
    s->bad |= from != end;
}

static double take_number(struct source *s)
{
    const char *from;
    char text[17];
    double v = 0;
    if (line(s, &from) != 16) s->bad = true;
    if (s->bad) return 0;
    memcpy(text, from, 16);
    text[16] = 0;
    const uint64_t bits = strtoull(text, NULL, 16);
    memcpy(&v, &bits, 8);
    return v;
}

/* The file's own checksum stands behind all that it has, so that what is read below was written so. */
static bool is_whole(const struct imp_bytes *b)
{
    char last[32];
    const size_t tail = sizeof "end 0123456789abcdef\n" - 1;
    if (b->size < tail) return false;
    const uint64_t sum = imp__hash(0, b->data, b->size - tail);
    snprintf(last, sizeof last, "end %016" PRIx64 "\n", sum);
    return !memcmp(b->data + b->size - tail, last, tail);
}

static void photos_take(struct imp__measure *m, struct source *s)
{
    for (size_t i = 0; i < m->n_photos && !s->bad; i++) {
        struct imp__photo *p = &m->photos[i];
        const size_t n = (size_t)p->columns * (size_t)p->rows;
        const char *mask;
        p->noise = take_number(s);
        p->noise_of = take_number(s);
        s->bad |= !(p->noise > 0) || !isfinite(p->noise) || !(p->noise_of >= 0);
        s->bad |= line(s, &mask) != n;
        p->n_masked = 0;
        for (size_t k = 0; k < n && !s->bad; k++) {
            p->masked[k] = mask[k] == '1';
            p->n_masked += p->masked[k];
        }
        for (size_t k = 0; k < p->n_values; k++) p->noise_se[k] = (float)p->noise;
        imp__measure_weights(p);
    }
}

static enum imp_status rows_take(struct imp__measure *m, struct source *s)
{
    int64_t n = 0, v[5] = {0};
    take(s, "rows", &n, 1);
    for (int64_t i = 0; i < n && !s->bad; i++) {
        struct imp_measure_row *rows =
            imp__grow(m->ctx, m->rows, &m->cap_rows, m->n_rows + 1, sizeof *rows);
        if (!rows) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a checkpoint");
        m->rows = rows;
        take(s, "", v, 5);
        s->bad |= v[1] < 0 || v[1] >= IMP_MEASURE_STAGES || v[2] < 0;
        if (s->bad) break;
        struct imp_measure_row *r = &rows[m->n_rows++];
        *r = (struct imp_measure_row){.size = sizeof *r,
                                      .round = (int)v[0],
                                      .stage = (enum imp_measure_stage)v[1],
                                      .n = (size_t)v[2],
                                      .iterations = (int)v[3],
                                      .explained = v[4] != 0};
        r->residual = take_number(s);
        r->residual_hi = take_number(s);
        r->chi2 = take_number(s);
        r->chi2_se = take_number(s);
        r->moved = take_number(s);
    }
    return IMP_OK;
}

static enum imp_status lines_take(struct imp__measure *m, struct source *s)
{
    int64_t n = 0;
    take(s, "lines", &n, 1);
    for (int64_t i = 0; i < n && !s->bad; i++) {
        const char *text;
        const size_t length = line(s, &text);
        if (!s->bad) IMP_CHECKED(imp__measure_say(m, "%.*s", (int)length, text));
    }
    return IMP_OK;
}

static enum imp_status theta_take(struct imp__measure *m, struct source *s)
{
    const size_t n = m->scene->n_theta;
    double *theta = imp__alloc(m->ctx, n + 1, sizeof *theta);
    if (!theta) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a checkpoint");
    for (size_t i = 0; i < n; i++) theta[i] = take_number(s);
    const enum imp_status st = s->bad ? IMP_OK : imp_scene_set_theta(m->scene, theta);
    for (size_t i = 0; i < n; i++) m->at[i] = take_number(s);
    for (size_t i = 0; i < n; i++) m->at_se[i] = take_number(s);
    imp__release(m->ctx, theta);
    return st;
}

enum imp_status imp__measure_state_read(struct imp__measure *m, bool *found)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes bytes = {0};
    char task[48];
    int64_t next[2] = {0}, due = 0;
    const char *path = m->o.checkpoint;
    *found = false;
    if (!path || !m->o.resume || !imp__file_exists(m->ctx, path)) return IMP_OK;
    IMP_TRY(imp__file_read(m->ctx, path, MOST, &bytes));
    const size_t magic = sizeof MAGIC - 1;
    if (bytes.size < magic || memcmp(bytes.data, MAGIC, magic) != 0)
        IMP_TRY(
            imp__error(m->ctx, IMP_E_ARG, "%s is no checkpoint of a measurement", path));
    if (!is_whole(&bytes))
        IMP_TRY(imp__error(m->ctx, IMP_E_IO, "%s: damaged checkpoint", path));
    struct source s = {(const char *)bytes.data + magic,
                       (const char *)bytes.data + bytes.size, false};
    const char *of;
    const size_t length = line(&s, &of);
    snprintf(task, sizeof task, "task %016" PRIx64, m->task);
    if (length != strlen(task) || memcmp(of, task, length) != 0)
        IMP_TRY(
            imp__error(m->ctx, IMP_E_ARG,
                       "%s is of another measurement: its scene, photographs, options, "
                       "samples or seed differ",
                       path));
    take(&s, "next", next, 2);
    for (int k = 0; k < IMP_MEASURE_STAGES; k++) {
        take(&s, "", &due, 1);
        m->due[k] = due != 0;
    }
    IMP_TRY(theta_take(m, &s));
    photos_take(m, &s);
    m->repeats = true;
    IMP_TRY(rows_take(m, &s));
    IMP_TRY(lines_take(m, &s));
    m->repeats = false;
    s.bad |= next[0] < 1 || next[0] > m->o.rounds || next[1] < 0 ||
             next[1] > IMP_MEASURE_STAGES;
    if (s.bad) IMP_TRY(imp__error(m->ctx, IMP_E_IO, "%s: damaged checkpoint", path));
    m->round = (int)next[0];
    m->next = (int)next[1];
    *found = true;
out:
    imp__bytes_free(m->ctx, &bytes);
    return st;
}
