/* SPDX-License-Identifier: Apache-2.0
 *
 * Items are counted where all can reach the counter: by ranks of one machine in memory
 * that they share; otherwise rank 0 answers requests from a thread of its own, and ranks
 * ask for their next number while they compute the one before. MPI's one-sided
 * fetch-and-add is not used: over TCP, Open MPI 4 and MPICH 4 carry it out only while the
 * target is inside MPI, that is, hardly ever while it computes. */
#include "team_mpi.h"
#include <time.h>

enum { TAG_ASK = 1, TAG_ANSWER };

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
    return imp__mpi_wait(m, &m->asking) && imp__mpi_wait(m, &m->answering) ? m->answer
                                                                           : -1;
}

int64_t imp__mpi_next(uint64_t round, void *payload)
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

void imp__mpi_counter_settle(struct imp_mpi *m)
{
    if (m->asked) (void)answer_take(m);
}

/* Do all ranks share memory? Then the counter is there. */
enum imp_status imp__mpi_counter_open(struct imp_mpi *m)
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

void imp__mpi_counter_close(struct imp_mpi *m)
{
    if (m->serving) {
        atomic_store(&m->stop_serving, true);
        pthread_join(m->server, NULL);
    }
    /* A collective call would wait for ever for a rank that has died. */
    if (m->counter && !m->lost) MPI_Win_free(&m->window);
}
