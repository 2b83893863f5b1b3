/* SPDX-License-Identifier: Apache-2.0
 *
 * A team of processes: who belongs to it, and what its ranks tell each other besides
 * sums. */
#include "team.h"
#include "arguments.h"
#include "file.h"
#include <stdio.h>
#include <string.h>

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

/* Embree and libm choose their code by these. */
void imp__machine_text(char text[256])
{
    snprintf(text, 256, "importon %s", IMP_VERSION_STRING);
#if defined(__x86_64__)
    __builtin_cpu_init();
#define IMP_HAS(name)                                                                    \
    if (__builtin_cpu_supports(name)) strncat(text, " " name, 255 - strlen(text))
    IMP_HAS("sse4.2");
    IMP_HAS("avx");
    IMP_HAS("fma");
    IMP_HAS("avx2");
    IMP_HAS("avx512f");
    IMP_HAS("avx512dq");
    IMP_HAS("avx512vl");
#undef IMP_HAS
#endif
}

/* What results depend on besides the calls: equal on all ranks, or bits would differ. */
struct hello {
    int32_t ranks, rank;
    char machine[256];
};

struct greeting {
    imp_context *ctx;
    struct hello own, first;
    bool differs;
    int other;
    struct hello seen;
};

static void greet(void *receiver, int rank, const void *message, size_t bytes)
{
    struct greeting *g = receiver;
    struct hello h = {0};
    if (g->differs) return;
    if (bytes == sizeof h) memcpy(&h, message, sizeof h);
    h.machine[sizeof h.machine - 1] = 0;
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

struct broadcast {
    imp_context *ctx;
    enum imp_status st;
    struct imp_bytes message; /* the status, then bytes or an error's text */
};

static void broadcast_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct broadcast *b = receiver;
    if (rank != 0) return;
    if (bytes < sizeof(uint32_t))
        b->st = imp__error(b->ctx, IMP_E_ARG, "rank 0 reads no file here");
    else if (!imp__bytes_add(b->ctx, &b->message, message, bytes) ||
             !imp__bytes_add(b->ctx, &b->message, "", 1)) /* a zero behind the end */
        b->st =
            imp__error(b->ctx, IMP_E_NOMEM, "no memory for a file of %zu bytes", bytes);
}

enum imp_status imp__team_broadcast(imp_context *ctx, enum imp_status st,
                                    struct imp_bytes *bytes)
{
    const struct imp__team *team = ctx->team;
    const bool first = team->host.rank == 0;
    const char *text = imp_last_error(ctx);
    const uint32_t own = st;
    struct broadcast b = {.ctx = ctx};
    struct imp_bytes out = {0};
    const bool fits =
        !first ||
        (imp__bytes_add(ctx, &out, &own, sizeof own) &&
         imp__bytes_add(ctx, &out, st == IMP_OK ? (const void *)bytes->data : text,
                        st == IMP_OK ? bytes->size : strlen(text)));
    /* Without memory for it, rank 0 sends nothing, and all fail. */
    if (!fits) out.size = 0;
    const enum imp_status sent =
        team->host.gather(out.data, out.size, broadcast_receive, &b, team->host.payload);
    imp__bytes_free(ctx, &out);
    imp__bytes_free(ctx, bytes);
    if (sent != IMP_OK) st = imp__error_prefix(ctx, sent, "the team");
    else st = b.st;
    if (st == IMP_OK) {
        uint32_t theirs;
        memcpy(&theirs, b.message.data, sizeof theirs);
        b.message.size -= sizeof theirs + 1;
        memmove(b.message.data, b.message.data + sizeof theirs, b.message.size + 1);
        if (theirs != IMP_OK)
            st = imp__error(ctx, (enum imp_status)theirs, "%s",
                            (const char *)b.message.data);
    }
    if (st == IMP_OK) *bytes = b.message;
    else imp__bytes_free(ctx, &b.message);
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
