/* SPDX-License-Identifier: Apache-2.0
 *
 * importon with MPI: the functions of a team (importon.h, "Many processes"), by Open
 * MPI (libimporton-openmpi) or by MPICH (libimporton-mpich). libimporton links neither;
 * a host links the one it was built for, or opens it when it finds itself started by
 * mpirun, as the command does:
 *
 *     imp_mpi_open            joins the ranks, fills struct imp_team
 *     imp_context_set_team    every context that shares its work
 *     ...                     renders, gradients, fits: the same calls on every rank
 *     imp_mpi_close           every rank reports how it ended
 *
 * One imp_mpi a process, used by one context at a time. */
#ifndef IMPORTON_MPI_H
#define IMPORTON_MPI_H

#include "importon.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct imp_mpi imp_mpi;

struct imp_mpi_options {
    size_t size;
    int comm; /**< MPI_Comm_c2f of the communicator, which is duplicated; 0: all ranks */
    /** Asked while this rank waits for others. Non-zero: they are given up, and every
     * further call fails; for ranks that will be ended anyway. NULL: waits. */
    int (*give_up)(void *payload);
    void *payload;
};
#define IMP_MPI_OPTIONS_INIT IMP_INIT_ZERO(struct imp_mpi_options)

/** Join: MPI_Init_thread with MPI_THREAD_SERIALIZED unless the host has done it, and then
 * MPI_Finalize when closed. `team` gets rank, ranks, gather, next, sum and payload; it is
 * to be left (imp_context_set_team with NULL, or the end of the context) before
 * imp_mpi_close.
 * @param options NULL for the defaults.
 * @return IMP_OK; IMP_E_ARG; IMP_E_UNSUPPORTED if MPI allows one thread only;
 *         IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status imp_mpi_open(const struct imp_mpi_options *options,
                                                    imp_mpi **out, struct imp_team *team);

/** Why calls of the team fail: another rank has ended, and its text. "" if none has.
 * `code`: of that rank (imp_mpi_end).
 * code [1]. */
IMP_API const char *imp_mpi_ended(const imp_mpi *mpi, int *code);

/** Report to the others that this rank makes no more calls, and wait until they do so
 * too. Where they still make calls, those fail. `text` (NULL: none) is its last message:
 * rank 0 gets that of all, `code` gets the largest.
 * @param report  called on rank 0 with every rank's text; may be NULL.
 * code [1]. */
IMP_API void imp_mpi_end(imp_mpi *mpi, int *code, const char *text,
                         void (*report)(int rank, const char *text, void *payload),
                         void *payload);

/** Bytes that this rank has sent, and received from others, in gathers and sums; of a
 * sum, those that the best algorithms need: twice its numbers. sent [1], received [1]. */
IMP_API void imp_mpi_traffic(const imp_mpi *mpi, uint64_t *sent, uint64_t *received);

/** Free; without imp_mpi_end before, that first. mpi NULL: nothing happens. */
IMP_API void imp_mpi_close(imp_mpi *mpi);

#ifdef __cplusplus
}
#endif

#endif
