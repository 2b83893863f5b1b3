/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of a team by MPI. */
#ifndef IMP_TEAM_MPI_H
#define IMP_TEAM_MPI_H

#include <importon/mpi.h>
#include <mpi.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

#define IMP_MPI_TEXT 2048

struct imp__mpi_head {
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
    /* [ranks] heads, each before the first bytes of its message; and this rank's */
    char *heads, *head;
    size_t at_once;       /* bytes of a message that go with its head */
    int *counts, *places; /* [ranks] */
    char *buffer;
    size_t capacity;
    uint64_t sent, received;

    bool over, lost; /* some rank has ended; or does not answer */
    int code;
    char ended[IMP_MPI_TEXT + 32];

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

/* False: the others have been given up. */
bool imp__mpi_wait(struct imp_mpi *m, MPI_Request *request);

/* The counter of work, where all ranks reach it. */
enum imp_status imp__mpi_counter_open(struct imp_mpi *m);
void imp__mpi_counter_close(struct imp_mpi *m);
/* As struct imp_team's next. */
int64_t imp__mpi_next(uint64_t round, void *payload);
/* Before a gather: the answer to a question of a round that is over. */
void imp__mpi_counter_settle(struct imp_mpi *m);

#endif
