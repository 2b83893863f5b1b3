/* SPDX-License-Identifier: Apache-2.0
 *
 * Manifests: what a result was made from, hashes of its bits, and the messages of a team
 * (base/team.h) with the sums of chunks, by which a part of the work can be done again. */
#include "base/arguments.h"
#include "manifest_file.h"
#include "math/hash.h"
#include "math/rng.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define LIMIT ((size_t)256 << 20) /* bytes of sums, by default */

static void refute(imp_manifest *m, const char *what, const char *name, const char *why)
{
    if (!m->refuted[0])
        snprintf(m->refuted, sizeof m->refuted, "%s %s %s", what, name, why);
}

/* ---- Hashes -------------------------------------------------------------------------- */

static struct imp__item *item_find(imp_manifest *m, enum imp__item_kind kind,
                                   const char *name)
{
    for (size_t k = 0; k < m->n_items; k++)
        if (m->items[k].kind == (uint32_t)kind && !strcmp(m->items[k].name, name))
            return &m->items[k];
    return NULL;
}

bool imp__manifest_add(imp_manifest *m, enum imp__item_kind kind, const char *name,
                       uint64_t size, uint64_t hash)
{
    struct imp__item *grown =
        imp__grow(m->ctx, m->items, &m->cap_items, m->n_items + 1, sizeof *grown);
    if (!grown) return false;
    m->items = grown;
    struct imp__item *i = &m->items[m->n_items];
    *i = (struct imp__item){kind, false, size, hash, imp__strdup(m->ctx, name)};
    if (i->name) m->n_items++;
    return i->name != NULL;
}

/* Keep it; or compare it with what was kept. False: it is not as it was. */
static bool item_note(imp_manifest *m, enum imp__item_kind kind, const char *name,
                      const void *bytes, size_t n)
{
    static const char *const what[] = {"the file", "the result", "the file"};
    const uint64_t hash = imp__hash_array(0, bytes, n);
    struct imp__item *i = item_find(m, kind, name);
    if (m->making) {
        /* Read again, a file must still be the same; written again, its last bytes count. */
        if (i && kind == IMP_ITEM_OUTPUT) i->hash = hash, i->size = n;
        else if (!i) m->no_memory |= !imp__manifest_add(m, kind, name, n, hash);
        else if (i->hash != hash || i->size != n)
            refute(m, what[kind], name, "changed while it was read");
        return true;
    }
    if (!i) {
        refute(m, what[kind], name, "is not one of the manifest");
        return false;
    }
    i->met = true;
    if (i->hash == hash && i->size == n) return true;
    refute(m, what[kind], name,
           kind == IMP_ITEM_RESULT ? "has other bits" : "was changed");
    return false;
}

/* Files that a manifest does not list, or lists with other bytes, are not read further.
 * What a run reads of its own results (a sheet of its pictures) is no input. */
static enum imp_status on_read(void *payload, const char *path, const void *bytes,
                               size_t n)
{
    imp_manifest *m = payload;
    if (m->making && item_find(m, IMP_ITEM_OUTPUT, path)) return IMP_OK;
    if (item_note(m, IMP_ITEM_INPUT, path, bytes, n)) return IMP_OK;
    return imp__error(m->ctx, IMP_E_IO, "%s", m->refuted);
}

/* ---- The team that keeps, and verifies ------------------------------------------------ */

static void without_sums(imp_manifest *m)
{
    m->whole = true;
    imp__bytes_free(m->ctx, &m->bytes);
    m->n_messages = 0;
}

static enum imp_status keep(const void *message, size_t bytes,
                            void (*receive)(void *, int, const void *, size_t),
                            void *receiver, void *payload)
{
    imp_manifest *m = payload;
    (void)receive, (void)receiver;
    if (m->whole) return IMP_OK;
    const struct imp__kept_message here = {m->bytes.size, bytes};
    struct imp__kept_message *grown = imp__grow(m->ctx, m->messages, &m->cap_messages,
                                                m->n_messages + 1, sizeof *grown);
    if (grown) m->messages = grown;
    /* Proofs that are larger than that, or than memory, are left to the whole. */
    if (!grown || bytes > m->limit - m->bytes.size ||
        !imp__bytes_add(m->ctx, &m->bytes, message, bytes))
        without_sums(m);
    else m->messages[m->n_messages++] = here;
    return IMP_OK;
}

/* The first sums of a run get much room, later ones little: one sum is verified in parts,
 * of many sums only some. A step of a fit takes a thousandth of the remaining room. */
static size_t chunks(size_t bytes, size_t each, size_t most, void *payload)
{
    imp_manifest *m = payload;
    if (m->whole) return 0;
    const size_t left = m->limit - m->bytes.size;
    const unsigned before = imp_min(m->n_calls, 60u);
    const size_t room = imp_max(left / 1024, m->limit / 8 >> before);
    size_t n = most;
    while (n > 1 && n * each > room) n /= 2;
    if (bytes > left || n * each > left - bytes) {
        without_sums(m);
        return 0;
    }
    m->n_calls++;
    return n;
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
    const struct imp__kept_message *here = &m->messages[m->next++];
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
        before->n_sums += ctx->team->n_kept;
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
    if (st == IMP_OK) {
        ctx->team->pick = pick;
        ctx->team->chunks = chunks;
    }
    return st;
}

/* Is the result's file still as it was written? */
static enum imp_status outputs_verify(imp_manifest *m)
{
    for (size_t k = 0; k < m->n_items; k++) {
        struct imp_bytes bytes = {0};
        if (m->items[k].kind != IMP_ITEM_OUTPUT) continue;
        const enum imp_status st =
            imp__file_read(m->ctx, m->items[k].name, SIZE_MAX / 2, &bytes);
        if (st != IMP_OK) return st;
        item_note(m, IMP_ITEM_OUTPUT, m->items[k].name, bytes.data, bytes.size);
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
    m->limit = LIMIT;
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

enum imp_status imp_manifest_set_limit(imp_manifest *m, size_t bytes)
{
    IMP_REQUIRE(NULL, m, "manifest");
    m->limit = imp_max(bytes, m->bytes.size);
    return IMP_OK;
}

enum imp_status imp_manifest_read(imp_context *ctx, const char *path, double fraction,
                                  uint64_t seed, imp_manifest **out)
{
    enum imp_status st = IMP_OK;
    imp_manifest *m = NULL;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    if (!(fraction > 0 && fraction <= 1))
        return imp__error(ctx, IMP_E_ARG, "%s: fraction %g is not in (0, 1]", __func__,
                          fraction);
    IMP_TRY(manifest_new(ctx, &m));
    IMP_TRY(imp__file_read(ctx, path, SIZE_MAX / 2, &m->bytes));
    IMP_TRY(imp__manifest_take(m, path));
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
    IMP_REQUIRE(NULL, m, "manifest");
    IMP_REQUIRE(m->ctx, path, "path");
    imp_context *ctx = m->ctx;
    if (!path[0]) return imp__error(ctx, IMP_E_ARG, "%s: path is empty", __func__);
    if (m->refuted[0]) return imp__error(ctx, IMP_E_IO, "%s", m->refuted);
    const enum imp_status st =
        !m->no_memory && imp__manifest_bytes(m, &out)
            ? imp__file_write(ctx, path, out.data, out.size)
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
    item_note(m, IMP_ITEM_RESULT, name, bytes, n);
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
    const enum imp_status st = imp__file_read_own(ctx, path, SIZE_MAX / 2, &bytes);
    if (st != IMP_OK) return st;
    item_note(m, IMP_ITEM_OUTPUT, path, bytes.data, bytes.size);
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
        const struct imp__item *i = &m->items[k];
        all.n_inputs += i->kind == IMP_ITEM_INPUT;
        all.n_results += i->kind == IMP_ITEM_RESULT;
        all.n_outputs += i->kind == IMP_ITEM_OUTPUT;
        all.n_missing += !m->making && !i->met;
    }
    IMP_GIVE(m->ctx, info, all, "info");
    return IMP_OK;
}
