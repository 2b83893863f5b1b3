/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of a run: the messages that a rank of a team would have sent (base/team.h), in a
 * file. A file holds one part or several, and what it was made by; merging it with the
 * others runs the same calls again, with their messages in the place of walks. */
#include "parts.h"
#include "base/arguments.h"
#include "base/file.h"
#include "math/hash.h"
#include "scene/fingerprint.h"
#include "walk/walk.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC       "impparts"
#define PARTS_ORDER 0x01020304u
#define VERSION     2

struct message {
    size_t at, size; /* in the bytes of its file */
};

/* One part i of n, counted from 1. */
struct source {
    uint32_t index, count;
    size_t file;
    size_t n_messages, cap_messages;
    struct message *messages;
};

struct imp_parts {
    imp_context *ctx;
    bool making; /* a part that is computed now */
    char machine[256];
    char *command;
    size_t n_files;
    struct imp_bytes *files; /* [n_files]; of a part in the making, its messages */
    size_t n_sources, cap_sources;
    struct source *sources; /* by where their share begins */
    char holes[256];        /* which are missing */
    size_t next;            /* message of every source that the merge reads next */
};

/* ---- Sharing: the team that parts are ----------------------------------------------- */

static enum imp_status keep(const void *message, size_t bytes,
                            void (*receive)(void *, int, const void *, size_t),
                            void *receiver, void *payload)
{
    struct imp_parts *p = payload;
    struct source *s = &p->sources[0];
    const struct message m = {p->files[0].size, bytes};
    (void)receive, (void)receiver;
    struct message *grown = imp__grow(p->ctx, s->messages, &s->cap_messages,
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
        const struct source *s = &p->sources[k];
        if (p->next >= s->n_messages)
            return imp__error(
                p->ctx, IMP_E_ARG,
                "part %u of %u ends before this call: it was made by another", s->index,
                s->count);
        const struct message *m = &s->messages[p->next];
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
    const struct source *x = a, *y = b;
    return border_compare(x->index - 1, x->count, y->index - 1, y->count);
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
        const struct source *s = &p->sources[k];
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

static enum imp_status overlaps_refuse(const struct imp_parts *p)
{
    for (size_t k = 1; k < p->n_sources; k++) {
        const struct source *a = &p->sources[k - 1], *b = &p->sources[k];
        if (border_compare(a->index, a->count, b->index - 1, b->count) <= 0) continue;
        if (a->index == b->index && a->count == b->count)
            return imp__error(p->ctx, IMP_E_ARG, "part %u of %u is there twice", a->index,
                              a->count);
        return imp__error(p->ctx, IMP_E_ARG, "part %u of %u and part %u of %u overlap",
                          a->index, a->count, b->index, b->count);
    }
    return IMP_OK;
}

/* ---- Files -------------------------------------------------------------------------- */

struct head {
    char magic[8];
    uint32_t byte_order, version;
    char machine[256];
    uint64_t command_bytes, n_sources;
};

/* Bytes of a file that are still to be read. */
struct reading {
    const char *path;
    const struct imp_bytes *file;
    size_t at, end;
};

static bool take(struct reading *r, void *out, size_t n)
{
    if (r->end - r->at < n) return false;
    memcpy(out, r->file->data + r->at, n);
    r->at += n;
    return true;
}

static bool source_read(struct imp_parts *p, struct reading *r, size_t file)
{
    struct source s = {.file = file};
    uint64_t n = 0;
    if (!take(r, &s.index, sizeof s.index) || !take(r, &s.count, sizeof s.count) ||
        !take(r, &n, sizeof n) || s.index < 1 || s.index > s.count ||
        n > (r->end - r->at) / sizeof(uint64_t))
        return false;
    struct source *grown =
        imp__grow(p->ctx, p->sources, &p->cap_sources, p->n_sources + 1, sizeof *grown);
    if (!grown) return false;
    p->sources = grown;
    s.n_messages = (size_t)n;
    s.messages = imp__alloc(p->ctx, s.n_messages + 1, sizeof *s.messages);
    p->sources[p->n_sources++] = s;
    if (!s.messages) return false;
    for (size_t k = 0; k < s.n_messages; k++) {
        uint64_t size;
        if (!take(r, &size, sizeof size) || size > r->end - r->at) return false;
        s.messages[k] = (struct message){r->at, (size_t)size};
        r->at += (size_t)size;
    }
    return true;
}

static enum imp_status file_read(struct imp_parts *p, const char *path, size_t k)
{
    struct imp_bytes *file = &p->files[k];
    struct head head;
    uint64_t sum;
    enum imp_status st = imp__file_read(p->ctx, path, SIZE_MAX / 2, file);
    if (st != IMP_OK) return st;
    if (file->size < sizeof head + sizeof sum || memcmp(file->data, MAGIC, 8))
        return imp__error(p->ctx, IMP_E_SCENE, "%s: not a part of a run", path);
    struct reading r = {path, file, 0, file->size - sizeof sum};
    take(&r, &head, sizeof head);
    memcpy(&sum, file->data + r.end, sizeof sum);
    if (head.byte_order != PARTS_ORDER || head.version != VERSION)
        return imp__error(p->ctx, IMP_E_SCENE,
                          "%s: a part of another version or byte order", path);
    if (sum != imp__hash(0, file->data, r.end))
        return imp__error(p->ctx, IMP_E_SCENE, "%s: damaged: its checksum differs", path);
    head.machine[sizeof head.machine - 1] = 0;
    if (head.command_bytes > r.end - r.at)
        return imp__error(p->ctx, IMP_E_SCENE, "%s: damaged", path);
    const char *command = (const char *)file->data + r.at;
    const size_t bytes = (size_t)head.command_bytes;
    if (!p->command) {
        p->command = imp__alloc(p->ctx, bytes + 1, 1);
        if (!p->command) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for parts");
        memcpy(p->command, command, bytes);
        memcpy(p->machine, head.machine, sizeof p->machine);
    } else if (strlen(p->command) != bytes || memcmp(p->command, command, bytes)) {
        return imp__error(p->ctx, IMP_E_ARG, "%s: made by another command: %.*s", path,
                          (int)imp_min(bytes, (size_t)400), command);
    } else if (strcmp(p->machine, head.machine)) {
        return imp__error(p->ctx, IMP_E_ARG,
                          "%s: made on \"%s\", the first part on \"%s\": their results "
                          "do not go together to the bit",
                          path, head.machine, p->machine);
    }
    r.at += bytes;
    for (uint64_t n = 0; n < head.n_sources; n++)
        if (!source_read(p, &r, k))
            return imp__error(p->ctx, IMP_E_SCENE, "%s: damaged", path);
    if (r.at != r.end || head.n_sources == 0)
        return imp__error(p->ctx, IMP_E_SCENE, "%s: damaged", path);
    return IMP_OK;
}

static bool all_write(const struct imp_parts *p, struct imp_bytes *out)
{
    struct head head;
    memset(&head, 0, sizeof head);
    memcpy(head.magic, MAGIC, sizeof head.magic);
    head.byte_order = PARTS_ORDER;
    head.version = VERSION;
    memcpy(head.machine, p->machine, sizeof head.machine);
    head.command_bytes = strlen(p->command);
    head.n_sources = p->n_sources;
    bool fits = imp__bytes_add(p->ctx, out, &head, sizeof head) &&
                imp__bytes_add(p->ctx, out, p->command, head.command_bytes);
    for (size_t k = 0; k < p->n_sources && fits; k++) {
        const struct source *s = &p->sources[k];
        const uint64_t n = s->n_messages;
        fits = imp__bytes_add(p->ctx, out, &s->index, sizeof s->index) &&
               imp__bytes_add(p->ctx, out, &s->count, sizeof s->count) &&
               imp__bytes_add(p->ctx, out, &n, sizeof n);
        for (size_t m = 0; m < s->n_messages && fits; m++) {
            const uint64_t size = s->messages[m].size;
            fits = imp__bytes_add(p->ctx, out, &size, sizeof size) &&
                   imp__bytes_add(p->ctx, out, p->files[s->file].data + s->messages[m].at,
                                  s->messages[m].size);
        }
    }
    if (!fits) return false;
    const uint64_t sum = imp__hash(0, out->data, out->size);
    return imp__bytes_add(p->ctx, out, &sum, sizeof sum);
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
    p->sources[0] = (struct source){.index = (uint32_t)index, .count = (uint32_t)count};
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
    for (size_t k = 0; k < n; k++) IMP_TRY(file_read(p, paths[k], k));
    qsort(p->sources, p->n_sources, sizeof *p->sources, source_compare);
    IMP_TRY(overlaps_refuse(p));
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
        all_write(p, &all) ? imp__file_write(p->ctx, path, all.data, all.size)
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

/* ---- The same run? ------------------------------------------------------------------ */

struct comparing {
    const struct imp_same *same;
    int n, differs; /* index of the first that does; n: none */
    int rank;
};

static void compare(void *receiver, int rank, const void *message, size_t bytes)
{
    struct comparing *c = receiver;
    uint64_t theirs[IMP_SAME_MAX];
    if (c->differs < c->n) return;
    c->rank = rank;
    if (bytes != (size_t)c->n * sizeof *theirs) {
        c->differs = 0;
        return;
    }
    memcpy(theirs, message, bytes);
    for (c->differs = 0;
         c->differs < c->n && theirs[c->differs] == c->same[c->differs].hash;)
        c->differs++;
}

enum imp_status imp__team_same(imp_context *ctx, const struct imp_same *same, int n)
{
    struct comparing c = {.same = same, .n = n, .differs = n};
    uint64_t own[IMP_SAME_MAX];
    if (!imp__team_shares(ctx)) return IMP_OK;
    const struct imp__team *team = ctx->team;
    for (int k = 0; k < n; k++) own[k] = same[k].hash;
    const enum imp_status st =
        team->host.gather(own, (size_t)n * sizeof *own, compare, &c, team->host.payload);
    if (st != IMP_OK || c.differs == n) return st;
    if (team->role == IMP_TEAM_RANK)
        return imp__error(ctx, IMP_E_ARG,
                          "the %s of rank %d differs from that of rank %d",
                          same[c.differs].name, c.rank, team->host.rank);
    if (team->role == IMP_TEAM_VERIFY)
        return imp__error(ctx, IMP_E_ARG, "the result was made with another %s",
                          same[c.differs].name);
    const struct imp_parts *p = team->host.payload;
    return imp__error(ctx, IMP_E_ARG, "part %u of %u was made with another %s",
                      p->sources[c.rank].index, p->sources[c.rank].count,
                      same[c.differs].name);
}

int imp__same_run(const struct imp_scene *scene, const struct imp_run *run,
                  const char *call, struct imp_same same[IMP_SAME_MAX])
{
    const struct imp_sensor *sensor = scene->sensors[run->sensor];
    const uint64_t rays = imp__fingerprint_rays(scene);
    uint64_t theta = imp__hash(0, &rays, sizeof rays);
    for (size_t k = 0; k < scene->n_params; k++) {
        const struct imp_param *q = &scene->params[k];
        if (q->store == IMP_STORE_BULK) {
            theta = imp__hash(theta, q->bulk, q->info.count * sizeof *q->bulk);
            continue;
        }
        for (size_t e = 0; e < q->info.count; e++) {
            const double value = imp__param_get(q, e);
            theta = imp__hash(theta, &value, sizeof value);
        }
    }
    const uint64_t how[3] = {run->seed, (uint64_t)(run->spp > 0 ? run->spp : sensor->spp),
                             (uint64_t)(run->guide != NULL) | (uint64_t)run->from << 1};
    int n = 0;
    same[n++] = (struct imp_same){"call", imp__hash_text(0, call)};
    same[n++] = (struct imp_same){"scene", imp__fingerprint_objects(scene)};
    same[n++] = (struct imp_same){"integrator",
                                  imp__walk_integrator_hash(imp__walk_integrator(scene))};
    same[n++] = (struct imp_same){"sensor", imp__fingerprint_sensor(sensor)};
    same[n++] = (struct imp_same){"set of parameter values", theta};
    same[n++] =
        (struct imp_same){"seed or number of samples", imp__hash(0, how, sizeof how)};
    same[n++] = (struct imp_same){"kind of points",
                                  imp__points_of(sensor, run) == IMP_POINTS_SOBOL};
    return n;
}
