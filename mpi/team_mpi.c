/* SPDX-License-Identifier: Apache-2.0
 *
 * The functions of a team by MPI.
 *
 * A gather begins with a head from every rank: how many bytes it has, or that it has
 * ended. Waiting is a loop of tests with short sleeps, so that ranks that wait leave the
 * processor to those that compute.
 *
 * Items are counted where all can reach the counter: by ranks of one machine in memory
 * that they share; otherwise rank 0 answers requests from a thread of its own, and ranks
 * ask for their next number while they compute the one before. MPI's one-sided
 * fetch-and-add is not used: over TCP, Open MPI 4 and MPICH 4 carry it out only while the
 * target is inside MPI, that is, hardly ever while it computes. */
#include <importon/mpi.h>
#include <limits.h>
#include <mpi.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define TOGETHER ((uint64_t)16 << 20) /* bytes of all that are gathered in one piece */
#define PIECE    ((uint64_t)1 << 30)  /* larger messages go in pieces: counts are int */
#define TEXT     2048

enum { TAG_ASK = 1, TAG_ANSWER, TAG_STOP };
enum { MESSAGE, ENDED };

struct head {
    uint64_t bytes;
    int32_t kind, code;
};

struct imp_mpi {
    MPI_Comm comm;
    int rank, ranks;
    bool initialised; /* by this */
    int (*give_up)(void *payload);
    void *payload;

    pthread_mutex_t lock; /* of MPI: one thread at a time is in it */
    struct head *heads;   /* [ranks] */
    int *counts, *places; /* [ranks] */
    char *buffer;
    size_t capacity;
    uint64_t sent, received;

    bool over, lost; /* some rank has ended; or does not answer */
    int code;
    char ended[TEXT + 32];

    /* The counter: its round in the upper half, the count in the lower. */
    _Atomic uint64_t *counter; /* NULL: rank 0 is asked */
    _Atomic uint64_t own;      /* rank 0's, when asked */
    MPI_Win window;
    pthread_t server;
    bool serving;
    _Atomic bool stop_serving;
    bool asked; /* a request is under way */
    MPI_Request asking, answering;
    uint64_t question;
    int64_t answer;
};

/* ---- Waiting ------------------------------------------------------------------------- */

static void nap(unsigned tries)
{
    /* 20 us when it may be any moment, then up to 1 ms. */
    const long us = tries < 50 ? 20 : tries < 200 ? 100 : tries < 1000 ? 300 : 1000;
    nanosleep(&(struct timespec){0, 1000 * us}, NULL);
}

static bool wait_for(struct imp_mpi *m, MPI_Request *request)
{
    for (unsigned tries = 0;; tries++) {
        int done = 0;
        pthread_mutex_lock(&m->lock);
        MPI_Test(request, &done, MPI_STATUS_IGNORE);
        pthread_mutex_unlock(&m->lock);
        if (done) return true;
        if (tries < 20) continue;
        if (m->give_up && m->give_up(m->payload)) {
            m->lost = m->over = true;
            snprintf(m->ended, sizeof m->ended,
                     "other ranks do not answer: one has died, or mpirun ends the run");
            return false;
        }
        nap(tries - 20);
    }
}

/* ---- Counting ------------------------------------------------------------------------ */

/* The next of a round; the first call of a round finds the count of another. */
static int64_t count_on(_Atomic uint64_t *counter, uint64_t round)
{
    const uint64_t begin = (round + 1) << 32; /* + 1: no round is 0, as memory begins */
    uint64_t was = atomic_load(counter), is;
    do {
        is = was >> 32 == begin >> 32 ? was : begin;
    } while (!atomic_compare_exchange_weak(counter, &was, is + 1));
    return (int64_t)(is & UINT32_MAX);
}

static void *serve(void *payload)
{
    struct imp_mpi *m = payload;
    while (!atomic_load(&m->stop_serving)) {
        int there = 0;
        MPI_Status from;
        pthread_mutex_lock(&m->lock);
        MPI_Iprobe(MPI_ANY_SOURCE, TAG_ASK, m->comm, &there, &from);
        if (there) {
            uint64_t round;
            MPI_Recv(&round, 1, MPI_UINT64_T, from.MPI_SOURCE, TAG_ASK, m->comm,
                     MPI_STATUS_IGNORE);
            const int64_t n = count_on(&m->own, round);
            /* Eight bytes are sent at once, without the receiver's help. */
            MPI_Send(&n, 1, MPI_INT64_T, from.MPI_SOURCE, TAG_ANSWER, m->comm);
        }
        pthread_mutex_unlock(&m->lock);
        if (!there) nanosleep(&(struct timespec){0, 100000}, NULL);
    }
    return NULL;
}

static void ask(struct imp_mpi *m, uint64_t round)
{
    m->question = round;
    m->asked = true;
    pthread_mutex_lock(&m->lock);
    MPI_Irecv(&m->answer, 1, MPI_INT64_T, 0, TAG_ANSWER, m->comm, &m->answering);
    MPI_Isend(&m->question, 1, MPI_UINT64_T, 0, TAG_ASK, m->comm, &m->asking);
    pthread_mutex_unlock(&m->lock);
}

/* -1: rank 0 does not answer. */
static int64_t answer_take(struct imp_mpi *m)
{
    m->asked = false;
    return wait_for(m, &m->asking) && wait_for(m, &m->answering) ? m->answer : -1;
}

static int64_t next(uint64_t round, void *payload)
{
    struct imp_mpi *m = payload;
    if (m->over) return -1;
    if (m->counter) return count_on(m->counter, round);
    if (m->rank == 0) return count_on(&m->own, round);
    if (!m->asked) ask(m, round);
    const int64_t n = answer_take(m);
    if (n >= 0) ask(m, round); /* answered while n is computed */
    return n;
}

/* ---- Gathering ----------------------------------------------------------------------- */

static bool buffer_fit(struct imp_mpi *m, size_t bytes)
{
    if (bytes <= m->capacity) return true;
    char *grown = realloc(m->buffer, bytes);
    if (!grown) return false;
    m->buffer = grown;
    m->capacity = bytes;
    return true;
}

static bool heads_exchange(struct imp_mpi *m, struct head own)
{
    MPI_Request request;
    pthread_mutex_lock(&m->lock);
    MPI_Iallgather(&own, sizeof own, MPI_BYTE, m->heads, sizeof own, MPI_BYTE, m->comm,
                   &request);
    pthread_mutex_unlock(&m->lock);
    return wait_for(m, &request);
}

static bool send_to_all(struct imp_mpi *m, void *bytes, uint64_t n, int from)
{
    for (uint64_t at = 0; at < n; at += PIECE) {
        MPI_Request request;
        pthread_mutex_lock(&m->lock);
        MPI_Ibcast((char *)bytes + at, (int)(n - at < PIECE ? n - at : PIECE), MPI_BYTE,
                   from, m->comm, &request);
        pthread_mutex_unlock(&m->lock);
        if (!wait_for(m, &request)) return false;
    }
    return true;
}

/* The texts of those that have ended, to all. */
static void endings(struct imp_mpi *m, const char *own,
                    void (*said)(int rank, const char *text, void *payload),
                    void *payload)
{
    char text[TEXT];
    m->over = true;
    for (int k = 0; k < m->ranks; k++) {
        const struct head *h = &m->heads[k];
        if (h->kind != ENDED) continue;
        const size_t n = h->bytes < TEXT ? (size_t)h->bytes : TEXT - 1;
        memset(text, 0, sizeof text);
        if (k == m->rank) memcpy(text, own, n);
        if (!send_to_all(m, text, n, k)) return;
        if (said && m->rank == 0) said(k, text, payload);
        if (!m->ended[0] || (h->code && !m->code))
            snprintf(m->ended, sizeof m->ended, "rank %d: %s", k,
                     n ? text : "it has ended before the others");
        if (h->code > m->code) m->code = h->code;
    }
}

typedef void receive_fn(void *receiver, int rank, const void *message, size_t bytes);

static bool gather_together(struct imp_mpi *m, const void *message, size_t bytes,
                            receive_fn *receive, void *receiver)
{
    MPI_Request request;
    size_t at = 0;
    for (int k = 0; k < m->ranks; k++) {
        m->counts[k] = (int)m->heads[k].bytes;
        m->places[k] = (int)at;
        at += (size_t)m->heads[k].bytes;
    }
    pthread_mutex_lock(&m->lock);
    MPI_Iallgatherv(message, (int)bytes, MPI_BYTE, m->buffer, m->counts, m->places,
                    MPI_BYTE, m->comm, &request);
    pthread_mutex_unlock(&m->lock);
    if (!wait_for(m, &request)) return false;
    for (int k = 0; k < m->ranks; k++)
        receive(receiver, k, m->buffer + m->places[k], (size_t)m->counts[k]);
    return true;
}

static bool room_for_all(struct imp_mpi *m, size_t bytes)
{
    const int own = buffer_fit(m, bytes);
    int all = 0;
    MPI_Request request;
    pthread_mutex_lock(&m->lock);
    MPI_Iallreduce(&own, &all, 1, MPI_INT, MPI_MIN, m->comm, &request);
    pthread_mutex_unlock(&m->lock);
    return wait_for(m, &request) && all;
}

/* Rank by rank: memory for the largest message, not for all. */
static bool gather_in_turn(struct imp_mpi *m, const void *message, receive_fn *receive,
                           void *receiver)
{
    for (int k = 0; k < m->ranks; k++) {
        const uint64_t n = m->heads[k].bytes;
        /* What is sent is not changed; the room of others is the buffer. */
        void *at = k == m->rank ? (void *)(uintptr_t)message : m->buffer;
        if (!send_to_all(m, at, n, k)) return false;
        receive(receiver, k, at, (size_t)n);
    }
    return true;
}

static enum imp_status gather(const void *message, size_t bytes, receive_fn *receive,
                              void *receiver, void *payload)
{
    struct imp_mpi *m = payload;
    uint64_t all = 0, largest = 0;
    bool ended = false, good;
    if (m->over) return IMP_E_IO;
    if (m->asked) (void)answer_take(m); /* of a round that is over */
    if (m->over || !heads_exchange(m, (struct head){bytes, MESSAGE, 0})) return IMP_E_IO;
    for (int k = 0; k < m->ranks; k++) {
        const struct head *h = &m->heads[k];
        ended |= h->kind == ENDED;
        all += h->bytes;
        if (h->bytes > largest) largest = h->bytes;
    }
    if (ended) {
        endings(m, "", NULL, NULL);
        return IMP_E_IO;
    }
    m->sent += bytes;
    m->received += all - bytes;
    /* One that has no room would leave the others waiting. */
    if (all <= TOGETHER) good = gather_together(m, message, bytes, receive, receiver);
    else if (!(good = room_for_all(m, (size_t)largest)) && !m->over) return IMP_E_NOMEM;
    else good = good && gather_in_turn(m, message, receive, receiver);
    return good ? IMP_OK : IMP_E_IO;
}

/* ---- Sums ---------------------------------------------------------------------------- */

static enum imp_status sum(int64_t *numbers, size_t n, void *payload)
{
    struct imp_mpi *m = payload;
    const size_t piece = PIECE / sizeof *numbers;
    if (m->over) return IMP_E_IO;
    if (m->asked) (void)answer_take(m);
    /* A rank that has ended is met by its head. */
    if (m->over || !heads_exchange(m, (struct head){0, MESSAGE, 0})) return IMP_E_IO;
    for (int k = 0; k < m->ranks; k++) {
        if (m->heads[k].kind != ENDED) continue;
        endings(m, "", NULL, NULL);
        return IMP_E_IO;
    }
    for (size_t at = 0; at < n; at += piece) {
        const size_t here = n - at < piece ? n - at : piece;
        MPI_Request request;
        pthread_mutex_lock(&m->lock);
        MPI_Iallreduce(MPI_IN_PLACE, numbers + at, (int)here, MPI_INT64_T, MPI_SUM,
                       m->comm, &request);
        pthread_mutex_unlock(&m->lock);
        if (!wait_for(m, &request)) return IMP_E_IO;
    }
    m->sent += 2 * n * sizeof *numbers;
    m->received += 2 * n * sizeof *numbers;
    return IMP_OK;
}

/* ---- Public -------------------------------------------------------------------------- */

/* Do all ranks share memory? Then the counter is there. */
static enum imp_status counter_make(struct imp_mpi *m)
{
    MPI_Comm near;
    int n = 0;
    MPI_Comm_split_type(m->comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &near);
    MPI_Comm_size(near, &n);
    MPI_Comm_free(&near);
    /* Equal on all ranks: either each sees all, or none does. */
    if (n == m->ranks) {
        MPI_Aint size;
        int unit;
        void *at;
        MPI_Win_allocate_shared(m->rank == 0 ? sizeof *m->counter : 0, 1, MPI_INFO_NULL,
                                m->comm, &at, &m->window);
        MPI_Win_shared_query(m->window, 0, &size, &unit, &at);
        m->counter = at;
        if (m->rank == 0) atomic_init(m->counter, 0);
    } else if (m->rank == 0) {
        m->serving = pthread_create(&m->server, NULL, serve, m) == 0;
    }
    int good = m->counter || m->rank != 0 || m->serving;
    MPI_Bcast(&good, 1, MPI_INT, 0, m->comm);
    return good ? IMP_OK : IMP_E_NOMEM;
}

enum imp_status imp_mpi_open(const struct imp_mpi_options *options, imp_mpi **out,
                             struct imp_team *team)
{
    struct imp_mpi_options o = IMP_MPI_OPTIONS_INIT;
    int is = 0, level = 0;
    if (!out || !team || team->size < offsetof(struct imp_team, broadcast))
        return IMP_E_ARG;
    if (options && options->size != sizeof o) return IMP_E_ARG;
    if (options) o = *options;
    struct imp_mpi *m = calloc(1, sizeof *m);
    if (!m) return IMP_E_NOMEM;
    m->give_up = o.give_up;
    m->payload = o.payload;
    MPI_Initialized(&is);
    m->initialised = !is;
    if (is) MPI_Query_thread(&level);
    else MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &level);
    MPI_Comm_dup(o.comm ? MPI_Comm_f2c(o.comm) : MPI_COMM_WORLD, &m->comm);
    MPI_Comm_rank(m->comm, &m->rank);
    MPI_Comm_size(m->comm, &m->ranks);

    const size_t n = (size_t)m->ranks;
    enum imp_status st = level < MPI_THREAD_SERIALIZED ? IMP_E_UNSUPPORTED : IMP_OK;
    m->heads = malloc(n * sizeof *m->heads);
    m->counts = malloc(n * sizeof *m->counts);
    m->places = malloc(n * sizeof *m->places);
    const bool fits = m->heads && m->counts && m->places && buffer_fit(m, TOGETHER) &&
                      pthread_mutex_init(&m->lock, NULL) == 0;
    if (!fits) st = IMP_E_NOMEM;
    int worst = st;
    MPI_Allreduce(&(int){st}, &worst, 1, MPI_INT, MPI_MAX, m->comm);
    st = (enum imp_status)worst;
    if (st == IMP_OK) st = counter_make(m);
    if (st != IMP_OK) {
        m->over = true;
        imp_mpi_close(m);
        return st;
    }
    team->rank = m->rank;
    team->ranks = m->ranks;
    team->gather = gather;
    team->next = next;
    if (team->size >= sizeof *team) team->sum = sum;
    team->payload = m;
    *out = m;
    return IMP_OK;
}

const char *imp_mpi_ended(const imp_mpi *m, int *code)
{
    if (!m) return "";
    if (code) *code = m->code;
    return m->ended;
}

void imp_mpi_end(imp_mpi *m, int *code, const char *text,
                 void (*said)(int rank, const char *text, void *payload), void *payload)
{
    if (!m || !code) return;
    if (!text) text = "";
    if (!m->over && m->asked) (void)answer_take(m);
    if (!m->over && heads_exchange(m, (struct head){strlen(text), ENDED, *code}))
        endings(m, text, said, payload);
    if (m->code > *code) *code = m->code;
}

void imp_mpi_traffic(const imp_mpi *m, uint64_t *sent, uint64_t *received)
{
    if (m && sent) *sent = m->sent;
    if (m && received) *received = m->received;
}

void imp_mpi_close(imp_mpi *m)
{
    if (!m) return;
    int code = 0;
    imp_mpi_end(m, &code, NULL, NULL, NULL);
    if (m->serving) {
        atomic_store(&m->stop_serving, true);
        pthread_join(m->server, NULL);
    }
    /* Collective calls would wait for ever for a rank that has died. */
    if (!m->lost) {
        if (m->counter) MPI_Win_free(&m->window);
        MPI_Comm_free(&m->comm);
        if (m->initialised) MPI_Finalize();
    }
    free(m->heads);
    free(m->counts);
    free(m->places);
    free(m->buffer);
    free(m);
}
