/* SPDX-License-Identifier: Apache-2.0
 *
 * Open-addressing hash table of names. */
#include "names.h"
#include <stdint.h>
#include <string.h>

/* FNV-1a over the name, from a start that depends on the owner; the last multiplication
 * brings high bits down. */
static size_t hash(const void *owner, const char *name)
{
    uint64_t h = 0xcbf29ce484222325u ^ ((uintptr_t)owner >> 5);
    for (; *name; name++) h = (h ^ (unsigned char)*name) * 0x100000001b3u;
    return (size_t)((h ^ (h >> 32)) * 0x9e3779b97f4a7c15u >> 16);
}

static struct imp_name *slot(const struct imp_names *t, const void *owner,
                             const char *name)
{
    for (size_t i = hash(owner, name);; i++) {
        struct imp_name *s = &t->slots[i & (t->capacity - 1)];
        if (!s->name || (s->owner == owner && strcmp(s->name, name) == 0)) return s;
    }
}

struct imp_name *imp__names_find(const struct imp_names *t, const void *owner,
                                 const char *name)
{
    if (!t->capacity) return NULL;
    struct imp_name *s = slot(t, owner, name);
    return s->name ? s : NULL;
}

struct imp_name *imp__names_add(struct imp_names *t, const void *owner, const char *name,
                                void *value, struct imp_loc loc)
{
    if (2 * (t->n + 1) > t->capacity) {
        struct imp_names grown = {
            .ctx = t->ctx, .n = t->n, .capacity = t->capacity ? 2 * t->capacity : 64};
        grown.slots = imp__alloc(t->ctx, grown.capacity, sizeof *grown.slots);
        if (!grown.slots) return NULL;
        for (size_t i = 0; i < t->capacity; i++)
            if (t->slots[i].name)
                *slot(&grown, t->slots[i].owner, t->slots[i].name) = t->slots[i];
        imp__release(t->ctx, t->slots);
        *t = grown;
    }
    struct imp_name *s = slot(t, owner, name);
    *s = (struct imp_name){owner, name, value, loc};
    t->n++;
    return s;
}

void imp__names_free(struct imp_names *t)
{
    imp__release(t->ctx, t->slots);
    *t = (struct imp_names){.ctx = t->ctx};
}
