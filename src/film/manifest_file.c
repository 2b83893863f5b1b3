/* SPDX-License-Identifier: Apache-2.0
 *
 * The file of a manifest. */
#include "manifest_file.h"
#include "math/hash.h"
#include <stdio.h>
#include <unistd.h>

#define MAGIC          "impproof"
#define MANIFEST_ORDER 0x01020304u
#define VERSION        5

struct head {
    char magic[8];
    uint32_t byte_order, version;
    char machine[256];
    uint64_t command_bytes, n_items, n_sums, n_messages;
};

static enum imp_status no_memory(imp_context *ctx)
{
    return imp__error(ctx, IMP_E_NOMEM, "no memory for a manifest");
}

/* Text of n bytes, in new memory. Here and below, IMP_E_SCENE, without a message, is for
 * damaged bytes. */
static enum imp_status take_text(imp_context *ctx, struct imp__reading *r, uint64_t n,
                                 char **out)
{
    if (n > r->end - r->at) return IMP_E_SCENE;
    *out = imp__alloc(ctx, (size_t)n + 1, 1);
    if (!*out) return no_memory(ctx);
    imp__take(r, *out, (size_t)n);
    return IMP_OK;
}

static enum imp_status item_read(imp_manifest *m, struct imp__reading *r)
{
    uint32_t kind;
    uint64_t size, hash, bytes;
    char *name = NULL;
    if (!imp__take(r, &kind, sizeof kind) || !imp__take(r, &size, sizeof size) ||
        !imp__take(r, &hash, sizeof hash) || !imp__take(r, &bytes, sizeof bytes) ||
        kind > IMP_ITEM_OUTPUT)
        return IMP_E_SCENE;
    enum imp_status st = take_text(m->ctx, r, bytes, &name);
    if (st == IMP_OK &&
        !imp__manifest_add(m, (enum imp__item_kind)kind, name, size, hash))
        st = no_memory(m->ctx);
    imp__release(m->ctx, name);
    return st;
}

static enum imp_status contents_read(imp_manifest *m, struct imp__reading *r,
                                     const struct head *head)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(take_text(m->ctx, r, head->command_bytes, &m->command));
    for (uint64_t k = 0; k < head->n_items; k++) IMP_TRY(item_read(m, r));
    if (head->n_messages > (r->end - r->at) / sizeof(uint64_t)) return IMP_E_SCENE;
    m->messages = imp__alloc(m->ctx, (size_t)head->n_messages + 1, sizeof *m->messages);
    if (!m->messages) return no_memory(m->ctx);
    for (; m->n_messages < head->n_messages; m->n_messages++) {
        uint64_t size;
        if (!imp__take(r, &size, sizeof size) || size > r->end - r->at)
            return IMP_E_SCENE;
        m->messages[m->n_messages] = (struct imp__kept_message){r->at, (size_t)size};
        r->at += (size_t)size;
    }
    m->n_sums = head->n_sums;
    m->whole = head->n_messages == 0;
    if (r->at != r->end) return IMP_E_SCENE;
out:
    return st;
}

/* The name of a result in place of its manifest's, which lies beside it. */
static enum imp_status not_manifest(imp_context *ctx, const char *path)
{
    char beside[1024];
    const int n = snprintf(beside, sizeof beside, "%s.manifest", path);
    if (n > 0 && (size_t)n < sizeof beside && access(beside, F_OK) == 0)
        return imp__error(ctx, IMP_E_SCENE, "%s: not a manifest; that of it is %s", path,
                          beside);
    return imp__error(ctx, IMP_E_SCENE, "%s: not a manifest", path);
}

enum imp_status imp__manifest_take(imp_manifest *m, const char *path)
{
    struct head head;
    uint64_t sum;
    const struct imp_bytes *file = &m->bytes;
    if (file->size < sizeof head + sizeof sum || memcmp(file->data, MAGIC, 8))
        return not_manifest(m->ctx, path);
    struct imp__reading r = {file, 0, file->size - sizeof sum};
    imp__take(&r, &head, sizeof head);
    memcpy(&sum, file->data + r.end, sizeof sum);
    if (head.byte_order != MANIFEST_ORDER || head.version != VERSION)
        return imp__error(m->ctx, IMP_E_SCENE,
                          "%s: a manifest of format %08x, version %u; this importon has "
                          "%08x, version %u",
                          path, head.byte_order, head.version, MANIFEST_ORDER, VERSION);
    if (sum != imp__hash(0, file->data, r.end))
        return imp__error(m->ctx, IMP_E_IO, "%s: damaged: its checksum differs", path);
    head.machine[sizeof head.machine - 1] = 0;
    if (strcmp(head.machine, m->machine))
        return imp__error(m->ctx, IMP_E_ARG,
                          "%s: made on \"%s\", this is \"%s\": bits cannot be compared",
                          path, head.machine, m->machine);
    const enum imp_status st = contents_read(m, &r, &head);
    return st == IMP_E_SCENE ? imp__error(m->ctx, IMP_E_IO, "%s: damaged", path) : st;
}

bool imp__manifest_bytes(const imp_manifest *m, struct imp_bytes *out)
{
    imp_context *ctx = m->ctx;
    struct head head;
    memset(&head, 0, sizeof head);
    memcpy(head.magic, MAGIC, sizeof head.magic);
    head.byte_order = MANIFEST_ORDER;
    head.version = VERSION;
    memcpy(head.machine, m->machine, sizeof head.machine);
    head.command_bytes = strlen(m->command);
    head.n_items = m->n_items;
    head.n_sums = m->n_sums;
    head.n_messages = m->whole || m->n_sums == 0 ? 0 : m->n_messages;
    bool fits = imp__bytes_add(ctx, out, &head, sizeof head) &&
                imp__bytes_add(ctx, out, m->command, head.command_bytes);
    for (size_t k = 0; k < m->n_items && fits; k++) {
        const struct imp__item *i = &m->items[k];
        const uint64_t bytes = strlen(i->name);
        fits = imp__bytes_add(ctx, out, &i->kind, sizeof i->kind) &&
               imp__bytes_add(ctx, out, &i->size, sizeof i->size) &&
               imp__bytes_add(ctx, out, &i->hash, sizeof i->hash) &&
               imp__bytes_add(ctx, out, &bytes, sizeof bytes) &&
               imp__bytes_add(ctx, out, i->name, bytes);
    }
    for (size_t k = 0; k < head.n_messages && fits; k++)
        fits = imp__message_put(ctx, out, &m->bytes, &m->messages[k]);
    const uint64_t sum = imp__hash(0, out->data, out->size);
    return fits && imp__bytes_add(ctx, out, &sum, sizeof sum);
}
