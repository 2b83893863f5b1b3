/* SPDX-License-Identifier: Apache-2.0
 *
 * Manifests: what a result was made from, hashes of its bits, and the messages of a team
 * (base/team.h) with the sums of chunks, by which a part of the work can be done again. */
#include "base/arguments.h"
#include "base/file.h"
#include "base/team.h"
#include "math/hash.h"
#include "math/rng.h"
#include "parts.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MAGIC          "impproof"
#define MANIFEST_ORDER 0x01020304u
#define VERSION        1
#define NODES_MOST     ((size_t)256 << 20) /* bytes of sums that are kept */

/* Bytes of messages that are no sums: what a call has in common, at most. */
#define SMALL (IMP_SAME_MAX * sizeof(uint64_t))

enum kind { INPUT, RESULT, OUTPUT };

/* Something that has a hash. */
struct item {
    uint32_t kind;
    bool met; /* when verifying: it was there */
    uint64_t size, hash;
    char *name;
};

struct message {
    size_t at, size;
};

struct imp_manifest {
    imp_context *ctx;
    bool making, whole; /* whole: without sums */
    char machine[256];
    char *command;
    size_t n_items, cap_items;
    struct item *items;
    struct imp_bytes bytes; /* the messages; when reading, the file */
    size_t n_messages, cap_messages, next;
    struct message *messages;
    uint64_t n_sums, n_verified;
    double fraction;
    uint64_t seed;
    bool no_memory;
    char refuted[512];
};

static void refute(imp_manifest *m, const char *what, const char *name, const char *why)
{
    if (!m->refuted[0])
        snprintf(m->refuted, sizeof m->refuted, "%s %s %s", what, name, why);
}

/* ---- Hashes -------------------------------------------------------------------------- */

static struct item *item_find(imp_manifest *m, enum kind kind, const char *name)
{
    for (size_t k = 0; k < m->n_items; k++)
        if (m->items[k].kind == (uint32_t)kind && !strcmp(m->items[k].name, name))
            return &m->items[k];
    return NULL;
}

static bool item_add(imp_manifest *m, enum kind kind, const char *name, uint64_t size,
                     uint64_t hash)
{
    struct item *grown =
        imp__grow(m->ctx, m->items, &m->cap_items, m->n_items + 1, sizeof *grown);
    if (!grown) return false;
    m->items = grown;
    struct item *i = &m->items[m->n_items];
    *i = (struct item){kind, false, size, hash, imp__strdup(m->ctx, name)};
    if (i->name) m->n_items++;
    return i->name != NULL;
}

/* Keep it; or compare it with what was kept. */
static void item_note(imp_manifest *m, enum kind kind, const char *name,
                      const void *bytes, size_t n)
{
    static const char *const what[] = {"the file", "the result", "the file"};
    const uint64_t hash = imp__hash(0, bytes, n);
    struct item *i = item_find(m, kind, name);
    if (m->making) {
        /* Read again, a file must still be the same. */
        if (!i) m->no_memory |= !item_add(m, kind, name, n, hash);
        else if (i->hash != hash || i->size != n)
            refute(m, what[kind], name, "changed while it was read");
        return;
    }
    if (!i) {
        refute(m, what[kind], name, "is not one of the manifest");
        return;
    }
    i->met = true;
    if (i->hash != hash || i->size != n)
        refute(m, what[kind], name, kind == RESULT ? "has other bits" : "was changed");
}

static void on_read(void *payload, const char *path, const void *bytes, size_t n)
{
    item_note(payload, INPUT, path, bytes, n);
}

/* ---- The team that keeps, and verifies ------------------------------------------------ */

static enum imp_status keep(const void *message, size_t bytes,
                            void (*receive)(void *, int, const void *, size_t),
                            void *receiver, void *payload)
{
    imp_manifest *m = payload;
    (void)receive, (void)receiver;
    m->n_sums += bytes > SMALL;
    if (m->whole) return IMP_OK;
    const struct message here = {m->bytes.size, bytes};
    struct message *grown = imp__grow(m->ctx, m->messages, &m->cap_messages,
                                      m->n_messages + 1, sizeof *grown);
    if (grown) m->messages = grown;
    /* Proofs that are larger than that, or than memory, are left to the whole. */
    if (!grown || m->bytes.size + bytes > NODES_MOST ||
        !imp__bytes_add(m->ctx, &m->bytes, message, bytes)) {
        m->whole = true;
        imp__bytes_free(m->ctx, &m->bytes);
        m->n_messages = 0;
        return IMP_OK;
    }
    m->messages[m->n_messages++] = here;
    return IMP_OK;
}

static enum imp_status read_back(const void *message, size_t bytes,
                                 void (*receive)(void *, int, const void *, size_t),
                                 void *receiver, void *payload)
{
    imp_manifest *m = payload;
    (void)message, (void)bytes;
    if (m->next >= m->n_messages) {
        refute(m, "the call", "that follows", "was not made");
        return imp__error(m->ctx, IMP_E_ARG, "the manifest ends before this call");
    }
    const struct message *here = &m->messages[m->next++];
    receive(receiver, 0, m->bytes.data + here->at, here->size);
    return IMP_OK;
}

static bool pick(void *payload)
{
    imp_manifest *m = payload;
    const struct imp_key key = imp__key(m->seed, (uint32_t)m->next, 0);
    const bool is = imp__u01(key, 0) < m->fraction;
    m->n_verified += is;
    return is;
}

enum imp_status imp_context_set_manifest(imp_context *ctx, imp_manifest *m)
{
    struct imp_team team = {.size = sizeof team};
    IMP_REQUIRE(NULL, ctx, "context");
    const bool kept = ctx->team && (ctx->team->role == IMP_TEAM_RECORD ||
                                    ctx->team->role == IMP_TEAM_VERIFY);
    if (kept) {
        imp_manifest *before = ctx->team->host.payload;
        if (ctx->team->in_fixed) before->whole = true;
        if (ctx->team->differs)
            refute(before, "the sums", "of a chunk", "have other bits");
    }
    if (!m) return kept ? imp__team_join(ctx, &team, IMP_TEAM_RANK) : IMP_OK;
    if (m->ctx != ctx)
        return imp__error(ctx, IMP_E_ARG, "%s: the manifest is of another context",
                          __func__);
    if (ctx->team && !kept) m->whole = true;
    if ((ctx->team && !kept) || (!m->making && m->whole)) return IMP_OK;
    team.payload = m;
    team.ranks = 1;
    team.gather = m->making ? keep : read_back;
    const enum imp_status st =
        imp__team_join(ctx, &team, m->making ? IMP_TEAM_RECORD : IMP_TEAM_VERIFY);
    if (st == IMP_OK) ctx->team->pick = pick;
    return st;
}

/* ---- Files --------------------------------------------------------------------------- */

struct head {
    char magic[8];
    uint32_t byte_order, version;
    char machine[256];
    uint64_t command_bytes, n_items, n_sums, n_messages;
};

struct reading {
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

/* Text of n bytes, in new memory; NULL: there is none. */
static char *take_text(imp_context *ctx, struct reading *r, uint64_t n)
{
    if (n > r->end - r->at) return NULL;
    char *text = imp__alloc(ctx, (size_t)n + 1, 1);
    if (text && !take(r, text, (size_t)n)) return NULL;
    return text;
}

static bool contents_read(imp_manifest *m, struct reading *r, const struct head *head)
{
    if (!(m->command = take_text(m->ctx, r, head->command_bytes))) return false;
    for (uint64_t k = 0; k < head->n_items; k++) {
        struct item i = {0};
        uint32_t kind;
        uint64_t bytes;
        if (!take(r, &kind, sizeof kind) || !take(r, &i.size, sizeof i.size) ||
            !take(r, &i.hash, sizeof i.hash) || !take(r, &bytes, sizeof bytes) ||
            kind > OUTPUT || !(i.name = take_text(m->ctx, r, bytes)))
            return false;
        const bool added = item_add(m, (enum kind)kind, i.name, i.size, i.hash);
        imp__release(m->ctx, i.name);
        if (!added) return false;
    }
    if (head->n_messages > (r->end - r->at) / sizeof(uint64_t)) return false;
    m->messages = imp__alloc(m->ctx, (size_t)head->n_messages + 1, sizeof *m->messages);
    if (!m->messages) return false;
    for (; m->n_messages < head->n_messages; m->n_messages++) {
        uint64_t size;
        if (!take(r, &size, sizeof size) || size > r->end - r->at) return false;
        m->messages[m->n_messages] = (struct message){r->at, (size_t)size};
        r->at += (size_t)size;
        m->n_sums += size > SMALL;
    }
    m->whole = head->n_messages == 0;
    return r->at == r->end;
}

/* Is the result's file still as it was written? */
static enum imp_status outputs_verify(imp_manifest *m)
{
    for (size_t k = 0; k < m->n_items; k++) {
        struct imp_bytes bytes = {0};
        if (m->items[k].kind != OUTPUT) continue;
        const enum imp_status st =
            imp__file_read(m->ctx, m->items[k].name, SIZE_MAX / 2, &bytes);
        if (st != IMP_OK) return st;
        item_note(m, OUTPUT, m->items[k].name, bytes.data, bytes.size);
        imp__bytes_free(m->ctx, &bytes);
    }
    return IMP_OK;
}

static enum imp_status manifest_new(imp_context *ctx, imp_manifest **out)
{
    imp_manifest *m = imp__alloc(ctx, 1, sizeof *m);
    if (!m) return imp__error(ctx, IMP_E_NOMEM, "no memory for a manifest");
    m->ctx = ctx;
    imp__context_hold(ctx);
    imp__machine_text(m->machine);
    *out = m;
    return IMP_OK;
}

enum imp_status imp_manifest_create(imp_context *ctx, const char *command,
                                    imp_manifest **out)
{
    imp_manifest *m = NULL;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, command, "command");
    IMP_REQUIRE(ctx, out, "out");
    enum imp_status st = manifest_new(ctx, &m);
    if (st != IMP_OK) return st;
    m->making = true;
    m->command = imp__strdup(ctx, command);
    if (!m->command) {
        imp_manifest_destroy(m);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for a manifest");
    }
    ctx->on_read = on_read;
    ctx->on_read_payload = m;
    *out = m;
    return IMP_OK;
}

enum imp_status imp_manifest_read(imp_context *ctx, const char *path, double fraction,
                                  uint64_t seed, imp_manifest **out)
{
    enum imp_status st = IMP_OK;
    imp_manifest *m = NULL;
    struct head head;
    uint64_t sum;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    if (!(fraction > 0 && fraction <= 1))
        return imp__error(ctx, IMP_E_ARG, "%s: fraction %g is not in (0, 1]", __func__,
                          fraction);
    IMP_TRY(manifest_new(ctx, &m));
    IMP_TRY(imp__file_read(ctx, path, SIZE_MAX / 2, &m->bytes));
    const struct imp_bytes *file = &m->bytes;
    if (file->size < sizeof head + sizeof sum || memcmp(file->data, MAGIC, 8))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: not a manifest", path));
    struct reading r = {file, 0, file->size - sizeof sum};
    take(&r, &head, sizeof head);
    memcpy(&sum, file->data + r.end, sizeof sum);
    if (head.byte_order != MANIFEST_ORDER || head.version != VERSION)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: a manifest of another version or byte order", path));
    if (sum != imp__hash(0, file->data, r.end))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: damaged: its checksum differs", path));
    head.machine[sizeof head.machine - 1] = 0;
    if (strcmp(head.machine, m->machine))
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "%s: made on \"%s\", this is \"%s\": bits cannot be compared",
                           path, head.machine, m->machine));
    if (!contents_read(m, &r, &head))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: damaged", path));
    m->fraction = fraction;
    m->seed = seed;
    IMP_TRY(outputs_verify(m));
    ctx->on_read = on_read;
    ctx->on_read_payload = m;
    *out = m;
    m = NULL;
out:
    imp_manifest_destroy(m);
    return st;
}

enum imp_status imp_manifest_write(const imp_manifest *m, const char *path)
{
    struct imp_bytes out = {0};
    struct head head;
    IMP_REQUIRE(NULL, m, "manifest");
    IMP_REQUIRE(m->ctx, path, "path");
    if (!path[0]) return imp__error(m->ctx, IMP_E_ARG, "%s: path is empty", __func__);
    if (m->refuted[0]) return imp__error(m->ctx, IMP_E_IO, "%s", m->refuted);
    memset(&head, 0, sizeof head);
    memcpy(head.magic, MAGIC, sizeof head.magic);
    head.byte_order = MANIFEST_ORDER;
    head.version = VERSION;
    memcpy(head.machine, m->machine, sizeof head.machine);
    head.command_bytes = strlen(m->command);
    head.n_items = m->n_items;
    head.n_sums = m->n_sums;
    head.n_messages = m->whole ? 0 : m->n_messages;
    imp_context *ctx = m->ctx;
    bool fits = !m->no_memory && imp__bytes_add(ctx, &out, &head, sizeof head) &&
                imp__bytes_add(ctx, &out, m->command, head.command_bytes);
    for (size_t k = 0; k < m->n_items && fits; k++) {
        const struct item *i = &m->items[k];
        const uint64_t bytes = strlen(i->name);
        fits = imp__bytes_add(ctx, &out, &i->kind, sizeof i->kind) &&
               imp__bytes_add(ctx, &out, &i->size, sizeof i->size) &&
               imp__bytes_add(ctx, &out, &i->hash, sizeof i->hash) &&
               imp__bytes_add(ctx, &out, &bytes, sizeof bytes) &&
               imp__bytes_add(ctx, &out, i->name, bytes);
    }
    for (size_t k = 0; k < head.n_messages && fits; k++) {
        const uint64_t size = m->messages[k].size;
        fits = imp__bytes_add(ctx, &out, &size, sizeof size) &&
               imp__bytes_add(ctx, &out, m->bytes.data + m->messages[k].at, size);
    }
    const uint64_t sum = imp__hash(0, out.data, out.size);
    fits = fits && imp__bytes_add(ctx, &out, &sum, sizeof sum);
    const enum imp_status st =
        fits ? imp__file_write(ctx, path, out.data, out.size)
             : imp__error(ctx, IMP_E_NOMEM, "no memory to write a manifest");
    imp__bytes_free(ctx, &out);
    return st;
}

void imp_manifest_destroy(imp_manifest *m)
{
    if (!m) return;
    imp_context *ctx = m->ctx;
    if (ctx->team && ctx->team->host.payload == m)
        (void)imp__team_join(ctx, &(struct imp_team){.ranks = 0}, IMP_TEAM_RANK);
    if (ctx->on_read_payload == m) {
        ctx->on_read = NULL;
        ctx->on_read_payload = NULL;
    }
    for (size_t k = 0; k < m->n_items; k++) imp__release(ctx, m->items[k].name);
    imp__release(ctx, m->items);
    imp__release(ctx, m->messages);
    imp__release(ctx, m->command);
    imp__bytes_free(ctx, &m->bytes);
    imp__release(ctx, m);
    imp__context_drop(ctx);
}

/* ---- Results ------------------------------------------------------------------------- */

enum imp_status imp_manifest_result(imp_manifest *m, const char *name, const void *bytes,
                                    size_t n)
{
    IMP_REQUIRE(NULL, m, "manifest");
    IMP_REQUIRE(m->ctx, name, "name");
    IMP_REQUIRE(m->ctx, bytes, "bytes");
    item_note(m, RESULT, name, bytes, n);
    return m->no_memory ? imp__error(m->ctx, IMP_E_NOMEM, "no memory for a manifest")
                        : IMP_OK;
}

enum imp_status imp_manifest_output(imp_manifest *m, const char *path)
{
    struct imp_bytes bytes = {0};
    IMP_REQUIRE(NULL, m, "manifest");
    IMP_REQUIRE(m->ctx, path, "path");
    if (!m->making) return IMP_OK;
    imp_context *ctx = m->ctx;
    ctx->on_read = NULL; /* it is no input */
    const enum imp_status st = imp__file_read(ctx, path, SIZE_MAX / 2, &bytes);
    ctx->on_read = on_read;
    if (st != IMP_OK) return st;
    item_note(m, OUTPUT, path, bytes.data, bytes.size);
    imp__bytes_free(ctx, &bytes);
    return m->no_memory ? imp__error(ctx, IMP_E_NOMEM, "no memory for a manifest")
                        : IMP_OK;
}

enum imp_status imp_manifest_get_info(imp_manifest *m, struct imp_manifest_info *info)
{
    IMP_REQUIRE(NULL, m, "manifest");
    IMP_REQUIRE(m->ctx, info, "info");
    struct imp_manifest_info all = {.size = sizeof all,
                                    .command = m->command,
                                    .n_sums = m->whole ? 0 : m->n_sums,
                                    .n_verified = m->n_verified,
                                    .refuted = m->refuted[0] ? m->refuted : NULL};
    for (size_t k = 0; k < m->n_items; k++) {
        const struct item *i = &m->items[k];
        all.n_inputs += i->kind == INPUT;
        all.n_results += i->kind == RESULT;
        all.n_outputs += i->kind == OUTPUT;
        all.n_missing += !m->making && !i->met;
    }
    IMP_GIVE(m->ctx, info, all, "info");
    return IMP_OK;
}
