/* SPDX-License-Identifier: Apache-2.0
 *
 * The file of one or several parts. */
#include "parts_file.h"
#include "math/hash.h"

#define MAGIC       "impparts"
#define PARTS_ORDER 0x01020304u
#define VERSION     4

struct head {
    char magic[8];
    uint32_t byte_order, version;
    char machine[256];
    uint64_t command_bytes, n_sources;
};

/* IMP_E_SCENE, without a message, for damaged bytes. */
static enum imp_status source_read(struct imp_parts *p, struct imp__reading *r,
                                   size_t file)
{
    struct imp__part_source s = {.file = file};
    uint64_t n = 0;
    if (!imp__take(r, &s.index, sizeof s.index) ||
        !imp__take(r, &s.count, sizeof s.count) || !imp__take(r, &n, sizeof n) ||
        s.index < 1 || s.index > s.count || n > (r->end - r->at) / sizeof(uint64_t))
        return IMP_E_SCENE;
    struct imp__part_source *grown =
        imp__grow(p->ctx, p->sources, &p->cap_sources, p->n_sources + 1, sizeof *grown);
    if (!grown) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for parts");
    p->sources = grown;
    s.n_messages = (size_t)n;
    s.messages = imp__alloc(p->ctx, s.n_messages + 1, sizeof *s.messages);
    p->sources[p->n_sources++] = s;
    if (!s.messages) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for parts");
    for (size_t k = 0; k < s.n_messages; k++) {
        uint64_t size;
        if (!imp__take(r, &size, sizeof size) || size > r->end - r->at)
            return IMP_E_SCENE;
        s.messages[k] = (struct imp__kept_message){r->at, (size_t)size};
        r->at += (size_t)size;
    }
    return IMP_OK;
}

enum imp_status imp__parts_file_read(struct imp_parts *p, const char *path, size_t k)
{
    struct imp_bytes *file = &p->files[k];
    struct head head;
    uint64_t sum;
    enum imp_status st = imp__file_read(p->ctx, path, SIZE_MAX / 2, file);
    if (st != IMP_OK) return st;
    if (file->size < sizeof head + sizeof sum || memcmp(file->data, MAGIC, 8))
        return imp__error(p->ctx, IMP_E_SCENE, "%s: not a part of a run", path);
    struct imp__reading r = {file, 0, file->size - sizeof sum};
    imp__take(&r, &head, sizeof head);
    memcpy(&sum, file->data + r.end, sizeof sum);
    if (head.byte_order != PARTS_ORDER || head.version != VERSION)
        return imp__error(
            p->ctx, IMP_E_SCENE,
            "%s: a part of format %08x, version %u; this importon has %08x, "
            "version %u",
            path, head.byte_order, head.version, PARTS_ORDER, VERSION);
    if (sum != imp__hash(0, file->data, r.end))
        return imp__error(p->ctx, IMP_E_IO, "%s: damaged: its checksum differs", path);
    head.machine[sizeof head.machine - 1] = 0;
    if (head.command_bytes > r.end - r.at)
        return imp__error(p->ctx, IMP_E_IO, "%s: damaged", path);
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
    for (uint64_t n = 0; n < head.n_sources && st == IMP_OK; n++)
        st = source_read(p, &r, k);
    if (st == IMP_E_NOMEM) return st;
    if (st != IMP_OK || r.at != r.end || head.n_sources == 0)
        return imp__error(p->ctx, IMP_E_IO, "%s: damaged", path);
    return IMP_OK;
}

bool imp__parts_bytes(const struct imp_parts *p, struct imp_bytes *out)
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
        const struct imp__part_source *s = &p->sources[k];
        const uint64_t n = s->n_messages;
        fits = imp__bytes_add(p->ctx, out, &s->index, sizeof s->index) &&
               imp__bytes_add(p->ctx, out, &s->count, sizeof s->count) &&
               imp__bytes_add(p->ctx, out, &n, sizeof n);
        for (size_t m = 0; m < s->n_messages && fits; m++)
            fits = imp__message_put(p->ctx, out, &p->files[s->file], &s->messages[m]);
    }
    if (!fits) return false;
    const uint64_t sum = imp__hash(0, out->data, out->size);
    return imp__bytes_add(p->ctx, out, &sum, sizeof sum);
}
