/* SPDX-License-Identifier: Apache-2.0
 *
 * The functions of a team by MPI.
 *
 * A gather begins with a head from every rank: how many bytes it has, or that it has
 * ended; short messages go with it. Waiting is a loop of tests with short sleeps, so that
 * ranks that wait leave the processor to those that compute. */
#include "team_mpi.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define TOGETHER ((uint64_t)16 << 20) /* bytes of all that are gathered in one piece */
#define PIECE    ((uint64_t)1 << 30)  /* larger messages go in pieces: counts are int */
#define TEXT     IMP_MPI_TEXT

/* Bytes that go with a head: of each rank, and of all. */
#define AT_ONCE     ((size_t)4096)
#define AT_ONCE_ALL ((size_t)1 << 16)

enum { MESSAGE, ENDED };

/* ---- Waiting ------------------------------------------------------------------------- */

static void nap(unsigned tries)
{
    /* 20 us when it may be any moment, then up to 1 ms. */
    const long us = tries < 50 ? 20 : tries < 200 ? 100 : tries < 1000 ? 300 : 1000;
    nanosleep(&(struct timespec){0, 1000 * us}, NULL);
}

bool imp__mpi_wait(struct imp_mpi *m, MPI_Request *request)
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

static struct imp__mpi_head head_of(const struct imp_mpi *m, int rank)
{
    struct imp__mpi_head h;
    memcpy(&h, m->heads + (size_t)rank * (sizeof h + m->at_once), sizeof h);
    return h;
}

/* `message`: of a gather, what goes at once. */
static bool heads_exchange(struct imp_mpi *m, struct imp__mpi_head own,
                           const void *message)
{
    MPI_Request request;
    const size_t n = own.bytes <= m->at_once && message ? (size_t)own.bytes : 0;
    const int all = (int)(sizeof own + m->at_once);
    memcpy(m->head, &own, sizeof own);
    if (n) memcpy(m->head + sizeof own, message, n);
    pthread_mutex_lock(&m->lock);
    MPI_Iallgather(m->head, all, MPI_BYTE, m->heads, all, MPI_BYTE, m->comm, &request);
    pthread_mutex_unlock(&m->lock);
    return imp__mpi_wait(m, &request);
}

static bool send_to_all(struct imp_mpi *m, void *bytes, uint64_t n, int from)
{
    for (uint64_t at = 0; at < n; at += PIECE) {
        MPI_Request request;
        pthread_mutex_lock(&m->lock);
        MPI_Ibcast((char *)bytes + at, (int)(n - at < PIECE ? n - at : PIECE), MPI_BYTE,
                   from, m->comm, &request);
        pthread_mutex_unlock(&m->lock);
        if (!imp__mpi_wait(m, &request)) return false;
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
        const struct imp__mpi_head h = head_of(m, k);
        if (h.kind != ENDED) continue;
        const size_t n = h.bytes < TEXT ? (size_t)h.bytes : TEXT - 1;
        memset(text, 0, sizeof text);
        if (k == m->rank) memcpy(text, own, n);
        if (!send_to_all(m, text, n, k)) return;
        if (said && m->rank == 0) said(k, text, payload);
        if (!m->ended[0] || (h.code && !m->code))
            snprintf(m->ended, sizeof m->ended, "rank %d: %s", k,
                     n ? text : "it has ended before the others");
        if (h.code > m->code) m->code = h.code;
    }
}

typedef void receive_fn(void *receiver, int rank, const void *message, size_t bytes);

static bool gather_together(struct imp_mpi *m, const void *message, size_t bytes,
                            receive_fn *receive, void *receiver)
{
    MPI_Request request;
    size_t at = 0;
    for (int k = 0; k < m->ranks; k++) {
        m->counts[k] = (int)head_of(m, k).bytes;
        m->places[k] = (int)at;
        at += (size_t)m->counts[k];
    }
    pthread_mutex_lock(&m->lock);
    MPI_Iallgatherv(message, (int)bytes, MPI_BYTE, m->buffer, m->counts, m->places,
                    MPI_BYTE, m->comm, &request);
    pthread_mutex_unlock(&m->lock);
    if (!imp__mpi_wait(m, &request)) return false;
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
    return imp__mpi_wait(m, &request) && all;
}

/* Rank by rank: memory for the largest message, not for all. */
static bool gather_in_turn(struct imp_mpi *m, const void *message, receive_fn *receive,
                           void *receiver)
{
    for (int k = 0; k < m->ranks; k++) {
        const uint64_t n = head_of(m, k).bytes;
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
    imp__mpi_counter_settle(m);
    if (m->over || !heads_exchange(m, (struct imp__mpi_head){bytes, MESSAGE, 0}, message))
        return IMP_E_IO;
    for (int k = 0; k < m->ranks; k++) {
        const struct imp__mpi_head h = head_of(m, k);
        ended |= h.kind == ENDED;
        all += h.bytes;
        if (h.bytes > largest) largest = h.bytes;
    }
    if (ended) {
        endings(m, "", NULL, NULL);
        return IMP_E_IO;
    }
    m->sent += bytes;
    m->received += all - bytes;
    if (largest <= m->at_once) {
        for (int k = 0; k < m->ranks; k++) {
            const struct imp__mpi_head h = head_of(m, k);
            receive(receiver, k,
                    m->heads + (size_t)k * (sizeof h + m->at_once) + sizeof h,
                    (size_t)h.bytes);
        }
        return IMP_OK;
    }
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
    imp__mpi_counter_settle(m);
    /* A rank that has ended is met by its head. */
    if (m->over || !heads_exchange(m, (struct imp__mpi_head){0, MESSAGE, 0}, NULL))
        return IMP_E_IO;
    for (int k = 0; k < m->ranks; k++) {
        if (head_of(m, k).kind != ENDED) continue;
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
        if (!imp__mpi_wait(m, &request)) return IMP_E_IO;
    }
    m->sent += 2 * n * sizeof *numbers;
    m->received += 2 * n * sizeof *numbers;
    return IMP_OK;
}

/* ---- Public -------------------------------------------------------------------------- */

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
    m->at_once = AT_ONCE_ALL / n < AT_ONCE ? AT_ONCE_ALL / n : AT_ONCE;
    /* What is beyond a message is not looked at, but sent. */
    m->heads = malloc(n * (sizeof(struct imp__mpi_head) + m->at_once));
    m->head = calloc(1, sizeof(struct imp__mpi_head) + m->at_once);
    m->counts = malloc(n * sizeof *m->counts);
    m->places = malloc(n * sizeof *m->places);
    const bool fits = m->heads && m->head && m->counts && m->places &&
                      buffer_fit(m, TOGETHER) && pthread_mutex_init(&m->lock, NULL) == 0;
    if (!fits) st = IMP_E_NOMEM;
    int worst = st;
    MPI_Allreduce(&(int){st}, &worst, 1, MPI_INT, MPI_MAX, m->comm);
    st = (enum imp_status)worst;
    if (st == IMP_OK) st = imp__mpi_counter_open(m);
    if (st != IMP_OK) {
        m->over = true;
        imp_mpi_close(m);
        return st;
    }
    team->rank = m->rank;
    team->ranks = m->ranks;
    team->gather = gather;
    team->next = imp__mpi_next;
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
    if (!m->over) imp__mpi_counter_settle(m);
    if (!m->over &&
        heads_exchange(m, (struct imp__mpi_head){strlen(text), ENDED, *code}, NULL))
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
    imp__mpi_counter_close(m);
    /* Collective calls would wait for ever for a rank that has died. */
    if (!m->lost) {
        MPI_Comm_free(&m->comm);
        if (m->initialised) MPI_Finalize();
    }
    free(m->heads);
    free(m->head);
    free(m->counts);
    free(m->places);
    free(m->buffer);
    free(m);
}
