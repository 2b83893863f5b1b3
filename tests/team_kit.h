/* SPDX-License-Identifier: Apache-2.0
 *
 * A team whose ranks are threads of one process: what a message-passing library does, by
 * a barrier. */
#ifndef TEAM_KIT_H
#define TEAM_KIT_H

#include <importon/importon.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <unistd.h>

enum { TEAM_MAX = 7 };

struct team_hub {
    int ranks;
    int shares; /* no counter: equal shares */
    int sums;   /* integers are added up, not gathered */
    const char *(*tamper)(const void *message, size_t bytes); /* with what rank 1 sends */
    pthread_barrier_t barrier;
    const void *message[TEAM_MAX];
    size_t bytes[TEAM_MAX];
    size_t sent; /* by rank 0, all in all */
    size_t most; /* of its messages */
    int64_t *numbers[TEAM_MAX];
    _Atomic int64_t counter[2];
    int slow; /* rank 1 takes its time before it asks for more */
    _Atomic int taken[TEAM_MAX];
};

struct team_rank {
    struct team_hub *hub;
    int rank;
};

static enum imp_status team_gather(const void *message, size_t bytes,
                                   void (*receive)(void *, int, const void *, size_t),
                                   void *receiver, void *payload)
{
    const struct team_rank *r = payload;
    struct team_hub *hub = r->hub;
    if (hub->tamper && r->rank == 1) message = hub->tamper(message, bytes);
    hub->message[r->rank] = message;
    hub->bytes[r->rank] = bytes;
    if (r->rank == 0) hub->sent += bytes;
    if (r->rank == 0 && bytes > hub->most) hub->most = bytes;
    pthread_barrier_wait(&hub->barrier);
    for (int k = 0; k < hub->ranks; k++)
        receive(receiver, k, hub->message[k], hub->bytes[k]);
    pthread_barrier_wait(&hub->barrier);
    return IMP_OK;
}

/* Rounds take turns with two counters: nobody is in the last round any more when one of
 * the ranks begins the next. */
static int64_t team_next(uint64_t round, void *payload)
{
    const struct team_rank *r = payload;
    struct team_hub *hub = r->hub;
    hub->taken[r->rank]++;
    if (hub->slow && r->rank == 1) usleep(50000);
    atomic_store(&hub->counter[(round + 1) % 2], 0);
    return atomic_fetch_add(&hub->counter[round % 2], 1);
}

static enum imp_status team_sum(int64_t *numbers, size_t n, void *payload)
{
    const struct team_rank *r = payload;
    struct team_hub *hub = r->hub;
    hub->numbers[r->rank] = numbers;
    pthread_barrier_wait(&hub->barrier);
    if (r->rank == 0) {
        hub->sent += 2 * n * sizeof *numbers;
        for (int k = 1; k < hub->ranks; k++)
            for (size_t i = 0; i < n; i++) numbers[i] += hub->numbers[k][i];
    }
    pthread_barrier_wait(&hub->barrier);
    if (r->rank > 0) memcpy(numbers, hub->numbers[0], n * sizeof *numbers);
    pthread_barrier_wait(&hub->barrier);
    return IMP_OK;
}

/* Join with a context. */
static enum imp_status team_join(imp_context *context, struct team_rank *rank)
{
    struct imp_team team = IMP_TEAM_INIT;
    team.rank = rank->rank;
    team.ranks = rank->hub->ranks;
    team.gather = team_gather;
    team.next = rank->hub->shares ? NULL : team_next;
    team.sum = rank->hub->sums ? team_sum : NULL;
    team.payload = rank;
    return imp_context_set_team(context, &team);
}

#endif
