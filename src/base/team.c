/* SPDX-License-Identifier: Apache-2.0
 *
 * A team of processes: who belongs to it, and the messages of its ranks besides sums. */
#include "team.h"
#include "arguments.h"
#include "file.h"
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#if defined(__x86_64__) && __has_include(<sys/platform/x86.h>)
#include <sys/platform/x86.h> /* glibc 2.33; the 2.34 macro */
#endif

/* ---- Joining ----------------------------------------------------------------------- */

enum imp_status imp__team_join(imp_context *ctx, const struct imp_team *host,
                               enum imp_team_role role)
{
    if (host->ranks == 0) {
        imp__release(ctx, ctx->team);
        ctx->team = NULL;
        return IMP_OK;
    }
    struct imp__team *team = imp__alloc(ctx, 1, sizeof *team);
    if (!team) return imp__error(ctx, IMP_E_NOMEM, "no memory for a team");
    team->host = *host;
    team->role = role;
    imp__release(ctx, ctx->team);
    ctx->team = team;
    return IMP_OK;
}

#ifdef CPU_FEATURE_ACTIVE
/* As the macro, which shifts a signed 1 by 31. */
static bool is_active(unsigned index)
{
    const struct cpuid_feature *leaf = __x86_get_cpuid_feature_leaf(index / 128);
    return leaf->active_array[index % 128 / 32] >> index % 32 & 1;
}
#endif

/* Embree and libm choose their code by these. They come from glibc; GCC's own list would be
 * made by a constructor that every start of a program runs. */
void imp__machine_text(char text[256])
{
    snprintf(text, 256, "importon %s", IMP_VERSION_STRING);
#if defined(__x86_64__)
#ifdef CPU_FEATURE_ACTIVE
#define IMP_HAS(name, feature)                                                           \
    if (is_active(x86_cpu_##feature)) strncat(text, " " name, 255 - strlen(text))
#else
    __builtin_cpu_init();
#define IMP_HAS(name, feature)                                                           \
    if (__builtin_cpu_supports(name)) strncat(text, " " name, 255 - strlen(text))
#endif
    IMP_HAS("sse4.2", SSE4_2);
    IMP_HAS("avx", AVX);
    IMP_HAS("fma", FMA);
    IMP_HAS("avx2", AVX2);
    IMP_HAS("avx512f", AVX512F);
    IMP_HAS("avx512dq", AVX512DQ);
    IMP_HAS("avx512vl", AVX512VL);
#undef IMP_HAS
#endif
}

/* What results depend on besides the calls: equal on all ranks, or bits would differ. And
 * which running kernel it is, whose memory all ranks on it share; "": not known. */
struct hello {
    int32_t ranks, rank;
    char machine[256], kernel[40];
};

static void kernel_text(char text[40])
{
    FILE *f = fopen("/proc/sys/kernel/random/boot_id", "r");
    if (!f || !fgets(text, 40, f)) text[0] = 0;
    if (f) fclose(f);
}

struct greeting {
    imp_context *ctx;
    struct hello own, first;
    bool differs;
    int other, here;
    struct hello seen;
};

static void greet(void *receiver, int rank, const void *message, size_t bytes)
{
    struct greeting *g = receiver;
    struct hello h = {0};
    if (g->differs) return;
    if (bytes == sizeof h) memcpy(&h, message, sizeof h);
    h.machine[sizeof h.machine - 1] = h.kernel[sizeof h.kernel - 1] = 0;
    g->here += h.kernel[0] && !strcmp(h.kernel, g->own.kernel);
    if (bytes == sizeof h && h.ranks == g->own.ranks && h.rank == rank &&
        !strcmp(h.machine, g->own.machine))
        return;
    g->differs = true;
    g->other = rank;
    g->seen = h;
}

enum imp_status imp_context_set_team(imp_context *ctx, const struct imp_team *team)
{
    struct imp_team own = IMP_TEAM_INIT;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_OPTIONS(ctx, own, team, "team");
    if (team && (own.ranks < 1 || own.rank < 0 || own.rank >= own.ranks))
        return imp__error(ctx, IMP_E_ARG, "%s: rank %d of %d ranks is none", __func__,
                          own.rank, own.ranks);
    if (team && !own.gather)
        return imp__error(ctx, IMP_E_ARG, "%s: team has no gather", __func__);
    if (!team || own.ranks == 1) own.ranks = 0;
    enum imp_status st = imp__team_join(ctx, &own, IMP_TEAM_RANK);
    if (st != IMP_OK || own.ranks == 0) return st;

    struct greeting g = {.ctx = ctx, .own = {.ranks = own.ranks, .rank = own.rank}};
    imp__machine_text(g.own.machine);
    kernel_text(g.own.kernel);
    st = own.gather(&g.own, sizeof g.own, greet, &g, own.payload);
    if (st != IMP_OK)
        st = imp__error(ctx, st, "%s: the ranks of the team do not reach each other",
                        __func__);
    else if (g.differs)
        st = imp__error(ctx, IMP_E_ARG,
                        "%s: rank %d runs \"%s\", rank %d \"%s\": their results would "
                        "not have the same bits",
                        __func__, own.rank, g.own.machine, g.other,
                        g.seen.machine[0] ? g.seen.machine : "another version");
    ctx->team->here = g.here;
    if (st != IMP_OK) {
        own.ranks = 0;
        (void)imp__team_join(ctx, &own, IMP_TEAM_RANK);
    }
    return st;
}

/* ---- Agreeing ---------------------------------------------------------------------- */

static void any_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    (void)rank;
    if (bytes == 1) *(bool *)receiver |= *(const unsigned char *)message != 0;
}

enum imp_status imp__team_any(imp_context *ctx, bool here, bool *any)
{
    struct imp__team *team = ctx->team;
    const unsigned char own = here;
    *any = here;
    if (!imp__team_shares(ctx) || team->role != IMP_TEAM_RANK) return IMP_OK;
    return team->host.gather(&own, 1, any_receive, any, team->host.payload);
}

/* The first message of rank 0; the text of an error follows it. */
struct broadcast_head {
    uint64_t bytes;
    uint32_t status;
    bool there;
};

struct broadcast {
    imp_context *ctx;
    struct broadcast_head head;
    char text[512];
    unsigned char *to; /* [head.bytes + 1]; NULL: rank 0 itself, or there is no memory */
    size_t at;
    bool strange;
};

static void head_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct broadcast *b = receiver;
    if (rank != 0 || bytes < sizeof b->head) return;
    memcpy(&b->head, message, sizeof b->head);
    snprintf(b->text, sizeof b->text, "%.*s",
             (int)imp_min(bytes - sizeof b->head, sizeof b->text - 1),
             (const char *)message + sizeof b->head);
}

static void piece_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct broadcast *b = receiver;
    if (rank != 0) return;
    b->strange |= bytes > b->head.bytes - b->at;
    if (b->strange) return;
    if (b->to) memcpy(b->to + b->at, message, bytes);
    b->at += bytes;
}

/* In pieces, so that no rank has a file twice. */
#define BROADCAST_PIECE ((size_t)4 << 20)

enum imp_status imp__team_broadcast(imp_context *ctx, enum imp_status st,
                                    struct imp_bytes *bytes)
{
    const struct imp__team *team = ctx->team;
    const struct imp_team *host = &team->host;
    const bool first = host->rank == 0;
    struct broadcast b = {.ctx = ctx};
    struct {
        struct broadcast_head head;
        char text[512];
    } said = {
        .head = {.bytes = st == IMP_OK ? bytes->size : 0, .status = st, .there = true}};
    if (!first) imp__bytes_free(ctx, bytes);
    if (st != IMP_OK) snprintf(said.text, sizeof said.text, "%s", imp_last_error(ctx));
    const size_t n = offsetof(__typeof__(said), text) + strlen(said.text);
    enum imp_status sent = host->gather(first ? &said : NULL, first ? n : 0, head_receive,
                                        &b, host->payload);
    const enum imp_status theirs = (enum imp_status)b.head.status;
    if (sent == IMP_OK && theirs == IMP_OK && b.head.there && !first) {
        const bool fits = b.head.bytes < SIZE_MAX / 2;
        b.to = fits ? imp__alloc_raw(ctx, (size_t)b.head.bytes + 1, 1) : NULL;
    }
    /* Who has no memory takes part all the same: the others wait for it. */
    while (sent == IMP_OK && b.at < b.head.bytes && !b.strange) {
        const size_t piece = imp_min((size_t)b.head.bytes - b.at, BROADCAST_PIECE);
        sent = host->gather(first ? bytes->data + b.at : NULL, first ? piece : 0,
                            piece_receive, &b, host->payload);
    }
    if (sent != IMP_OK) st = imp__error_prefix(ctx, sent, "the team");
    else if (!b.head.there || b.strange)
        st = imp__error(ctx, IMP_E_ARG, "rank 0 reads no file here");
    else if (theirs != IMP_OK) st = imp__error(ctx, theirs, "%s", b.text);
    else if (!first && !b.to)
        st = imp__error(ctx, IMP_E_NOMEM, "no memory for a file of %llu bytes",
                        (unsigned long long)b.head.bytes);
    else st = IMP_OK;
    if (st == IMP_OK && !first) {
        b.to[b.head.bytes] = 0; /* behind the end, as of files that are read */
        *bytes = (struct imp_bytes){b.to, (size_t)b.head.bytes, (size_t)b.head.bytes + 1};
    } else if (st != IMP_OK) {
        imp__bytes_free(ctx, bytes);
        imp__release(ctx, b.to);
    }
    return st;
}

struct kept {
    void *bytes;
    size_t n;
    bool known, strange;
};

static void kept_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct kept *k = receiver;
    (void)rank;
    k->strange |= bytes != k->n || (k->known && memcmp(k->bytes, message, k->n) != 0);
    if (!k->strange && !k->known) memcpy(k->bytes, message, k->n);
    k->known = true;
}

enum imp_status imp__team_keep(imp_context *ctx, void *bytes, size_t n, bool *known)
{
    struct imp__team *team = ctx->team;
    struct kept k = {bytes, n, false, false};
    *known = false;
    if (!imp__team_shares(ctx) || !imp__team_apart(ctx)) return IMP_OK;
    if (team->role == IMP_TEAM_PART)
        return team->host.gather(bytes, n, NULL, NULL, team->host.payload);
    const enum imp_status st =
        team->host.gather(NULL, 0, kept_receive, &k, team->host.payload);
    if (st == IMP_OK && k.strange)
        return imp__error(ctx, IMP_E_ARG, "the parts are of different runs");
    *known = st == IMP_OK && k.known;
    return st;
}
