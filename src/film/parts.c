/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of a run: the messages that a rank of a team would have sent (base/team.h), in a
 * file. A file holds one part or several, and what it was made by; merging it with the
 * others runs the same calls again, with their messages in the place of walks. */
#include "base/arguments.h"
#include "math/hash.h"
#include "parts_file.h"
#include <stdio.h>
#include <stdlib.h>

/* ---- Sharing: the team that parts are ----------------------------------------------- */

static enum imp_status keep(const void *message, size_t bytes,
                            void (*receive)(void *, int, const void *, size_t),
                            void *receiver, void *payload)
{
    struct imp_parts *p = payload;
    struct imp__part_source *s = &p->sources[0];
    const struct imp__kept_message m = {p->files[0].size, bytes};
    (void)receive, (void)receiver;
    struct imp__kept_message *grown = imp__grow(p->ctx, s->messages, &s->cap_messages,
                                                s->n_messages + 1, sizeof *grown);
    if (grown) s->messages = grown;
    if (!grown || !imp__bytes_add(p->ctx, &p->files[0], message, bytes))
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a part");
    s->messages[s->n_messages++] = m;
    return IMP_OK;
}

static enum imp_status read_back(const void *message, size_t bytes,
                                 void (*receive)(void *, int, const void *, size_t),
                                 void *receiver, void *payload)
{
    struct imp_parts *p = payload;
    (void)message, (void)bytes;
    for (size_t k = 0; k < p->n_sources; k++) {
        const struct imp__part_source *s = &p->sources[k];
        if (p->next >= s->n_messages)
            return imp__error(
                p->ctx, IMP_E_ARG,
                "part %u of %u ends before this call: it was made by another", s->index,
                s->count);
        const struct imp__kept_message *m = &s->messages[p->next];
        receive(receiver, (int)k, p->files[s->file].data + m->at, m->size);
    }
    p->next++;
    return IMP_OK;
}

/* ---- Coverage ----------------------------------------------------------------------- */

/* Where a part begins and ends, as fractions of the whole. */
static int border_compare(uint64_t a, uint64_t n, uint64_t b, uint64_t m)
{
    const uint64_t left = a * m, right = b * n; /* 32 bits each */
    return (left > right) - (left < right);
}

static int source_compare(const void *a, const void *b)
{
    const struct imp__part_source *x = a, *y = b;
    const int order = border_compare(x->index - 1, x->count, y->index - 1, y->count);
    return order ? order : (x->file > y->file) - (x->file < y->file);
}

/* Holes between the parts: their number, and a list for a message. */
static int holes(struct imp_parts *p)
{
    char *text = p->holes;
    const size_t size = sizeof p->holes;
    uint64_t at = 0, of = 1;
    int n = 0;
    text[0] = 0;
    for (size_t k = 0; k <= p->n_sources; k++) {
        const struct imp__part_source *s = &p->sources[k];
        const uint64_t begin = k < p->n_sources ? s->index - 1 : 1;
        const uint64_t count = k < p->n_sources ? s->count : 1;
        if (border_compare(at, of, begin, count) != 0) {
            const size_t used = strlen(text);
            const uint32_t parts = p->sources[0].count;
            /* In parts of the same cut, where that is what is missing. */
            if (at * parts % of == 0 && begin * parts % count == 0) {
                const uint64_t first = at * parts / of + 1, last = begin * parts / count;
                snprintf(text + used, size - used,
                         first == last ? "%s%llu/%u" : "%s%llu/%u to %llu/%u",
                         n ? ", " : "", (unsigned long long)first, parts,
                         (unsigned long long)last, parts);
            } else {
                snprintf(text + used, size - used, "%sfrom %llu/%llu to %llu/%llu",
                         n ? ", " : "", (unsigned long long)at, (unsigned long long)of,
                         (unsigned long long)begin, (unsigned long long)count);
            }
            n++;
        }
        if (k < p->n_sources) at = s->index, of = s->count;
    }
    return n;
}

static uint64_t source_hash(const struct imp_parts *p, const struct imp__part_source *s)
{
    uint64_t hash = 0;
    for (size_t k = 0; k < s->n_messages; k++)
        hash = imp__hash(hash, p->files[s->file].data + s->messages[k].at,
                         s->messages[k].size);
    return hash;
}

static enum imp_status overlaps_refuse(const struct imp_parts *p,
                                       const char *const *paths)
{
    for (size_t k = 1; k < p->n_sources; k++) {
        const struct imp__part_source *a = &p->sources[k - 1], *b = &p->sources[k];
        if (border_compare(a->index, a->count, b->index - 1, b->count) <= 0) continue;
        if (a->index == b->index && a->count == b->count)
            return imp__error(
                p->ctx, IMP_E_ARG,
                "part %u of %u is there twice, with %s contents: %s, %s", a->index,
                a->count, source_hash(p, a) == source_hash(p, b) ? "equal" : "different",
                paths[a->file], paths[b->file]);
        return imp__error(p->ctx, IMP_E_ARG,
                          "part %u of %u and part %u of %u overlap: %s, %s", a->index,
                          a->count, b->index, b->count, paths[a->file], paths[b->file]);
    }
    return IMP_OK;
}

/* ---- Public ------------------------------------------------------------------------- */

void imp_parts_destroy(imp_parts *p)
{
    if (!p) return;
    imp_context *ctx = p->ctx;
    if (ctx->team && ctx->team->host.payload == p)
        (void)imp__team_join(ctx, &(struct imp_team){.ranks = 0}, IMP_TEAM_RANK);
    for (size_t k = 0; k < p->n_sources; k++) imp__release(ctx, p->sources[k].messages);
    for (size_t k = 0; p->files && k < p->n_files; k++)
        imp__bytes_free(ctx, &p->files[k]);
    imp__release(ctx, p->sources);
    imp__release(ctx, p->files);
    imp__release(ctx, p->command);
    imp__release(ctx, p);
    imp__context_drop(ctx);
}

static enum imp_status parts_new(imp_context *ctx, size_t n_files, imp_parts **out)
{
    imp_parts *p = imp__alloc(ctx, 1, sizeof *p);
    if (!p) return imp__error(ctx, IMP_E_NOMEM, "no memory for parts");
    p->ctx = ctx;
    imp__context_hold(ctx);
    p->n_files = n_files;
    p->files = imp__alloc(ctx, n_files, sizeof *p->files);
    *out = p;
    return p->files ? IMP_OK : imp__error(ctx, IMP_E_NOMEM, "no memory for parts");
}

enum imp_status imp_parts_create(imp_context *ctx, int index, int count,
                                 const char *command, imp_parts **out)
{
    enum imp_status st = IMP_OK;
    imp_parts *p = NULL;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, command, "command");
    IMP_REQUIRE(ctx, out, "out");
    if (count < 1 || index < 1 || index > count)
        return imp__error(ctx, IMP_E_ARG, "%s: index %d of count %d parts is none",
                          __func__, index, count);
    IMP_TRY(parts_new(ctx, 1, &p));
    p->making = true;
    imp__machine_text(p->machine);
    p->command = imp__strdup(ctx, command);
    p->sources = imp__grow(ctx, NULL, &p->cap_sources, 1, sizeof *p->sources);
    if (!p->command || !p->sources)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for parts"));
    p->sources[0] =
        (struct imp__part_source){.index = (uint32_t)index, .count = (uint32_t)count};
    p->n_sources = 1;
    *out = p;
    p = NULL;
out:
    imp_parts_destroy(p);
    return st;
}

enum imp_status imp_parts_read(imp_context *ctx, const char *const *paths, size_t n,
                               imp_parts **out)
{
    enum imp_status st = IMP_OK;
    imp_parts *p = NULL;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, paths, "paths");
    IMP_REQUIRE(ctx, out, "out");
    if (n == 0) return imp__error(ctx, IMP_E_ARG, "%s: paths are none", __func__);
    for (size_t k = 0; k < n; k++) IMP_REQUIRE(ctx, paths[k], "paths");
    IMP_TRY(parts_new(ctx, n, &p));
    for (size_t k = 0; k < n; k++) IMP_TRY(imp__parts_file_read(p, paths[k], k));
    qsort(p->sources, p->n_sources, sizeof *p->sources, source_compare);
    IMP_TRY(overlaps_refuse(p, paths));
    *out = p;
    p = NULL;
out:
    imp_parts_destroy(p);
    return st;
}

enum imp_status imp_parts_write(const imp_parts *p, const char *path)
{
    struct imp_bytes all = {0};
    IMP_REQUIRE(NULL, p, "parts");
    IMP_REQUIRE(p->ctx, path, "path");
    if (!path[0]) return imp__error(p->ctx, IMP_E_ARG, "%s: path is empty", __func__);
    const enum imp_status st =
        imp__parts_bytes(p, &all)
            ? imp__file_write(p->ctx, path, all.data, all.size)
            : imp__error(p->ctx, IMP_E_NOMEM, "no memory to write parts");
    imp__bytes_free(p->ctx, &all);
    return st;
}

enum imp_status imp_parts_get_info(imp_parts *p, struct imp_parts_info *info)
{
    IMP_REQUIRE(NULL, p, "parts");
    IMP_REQUIRE(p->ctx, info, "info");
    struct imp_parts_info all = {
        .size = sizeof all, .n = (int)p->n_sources, .missing = holes(p)};
    all.holes = p->holes;
    all.command = p->command;
    IMP_GIVE(p->ctx, info, all, "info");
    return IMP_OK;
}

enum imp_status imp_context_set_parts(imp_context *ctx, imp_parts *p)
{
    struct imp_team team = {.size = sizeof team};
    char machine[256];
    IMP_REQUIRE(NULL, ctx, "context");
    if (!p) return imp__team_join(ctx, &team, IMP_TEAM_RANK);
    if (p->ctx != ctx)
        return imp__error(ctx, IMP_E_ARG, "%s: parts are of another context", __func__);
    imp__machine_text(machine);
    if (strcmp(machine, p->machine))
        return imp__error(ctx, IMP_E_ARG,
                          "the parts were made on \"%s\", this is \"%s\": the rest would "
                          "not have the same bits",
                          p->machine, machine);
    team.payload = p;
    if (p->making) {
        team.rank = (int)p->sources[0].index - 1;
        team.ranks = (int)p->sources[0].count;
        team.gather = keep;
        return imp__team_join(ctx, &team, IMP_TEAM_PART);
    }
    if (holes(p) > 0)
        return imp__error(ctx, IMP_E_ARG, "parts are missing: %s", p->holes);
    team.rank = -1;
    team.ranks = (int)p->n_sources;
    team.gather = read_back;
    p->next = 0;
    return imp__team_join(ctx, &team, IMP_TEAM_MERGE);
}
