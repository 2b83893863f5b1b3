/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks written into a file; under MPI the ranks send theirs to the first. */
#include "base/arguments.h"
#include "base/team.h"
#include "math/hash.h"
#include "twin_scene.h"
#include "walks_file.h"
#include <errno.h>
#include <string.h>

#define PIECE ((size_t)4 << 20) /* bytes that a rank sends at once */

/* Is what a reader makes of the scene's bytes what these walks are evaluated with? */
static enum imp_status scene_prove(const struct imp_walks *w,
                                   const struct imp_bytes *bytes)
{
    imp_scene *again = NULL;
    const enum imp_status st = imp__twin_take(w->scene, w->theta, bytes, &again);
    imp_scene_destroy(again);
    return st;
}

struct writing {
    const struct imp_walks *walks;
    struct imp_walks_head head;
    const struct imp_bytes *scene;
    struct imp_file_writer *to;
    bool begun;             /* the file is there, and its start is written */
    bool again;             /* the rank has more to send */
    enum imp_status status; /* of the team */
};

/* What follows the last byte of a message: nothing, another one, or that there was no
 * memory for it. */
enum { LAST, AGAIN, FAILED };

static void start_put(struct imp_file_writer *to, const struct writing *x)
{
    const struct imp_walks *w = x->walks;
    uint64_t sum = imp__hash(0, &x->head, sizeof x->head);
    imp__file_put(to, &x->head, sizeof x->head);
    sum = imp__hash(sum, x->scene->data, x->scene->size);
    imp__file_put(to, x->scene->data, x->scene->size);
    for (size_t k = 0; k < w->scene->n_params; k++) {
        const struct imp_param *p = &w->scene->params[k];
        const double *at = w->theta + p->info.offset;
        if (!imp__walks_is_number(p)) continue;
        sum = imp__hash(sum, at, p->info.count * sizeof *at);
        imp__file_put(to, at, p->info.count * sizeof *at);
    }
    imp__file_put(to, &sum, sizeof sum);
}

static void piece_receive(void *receiver, int rank, const void *message, size_t bytes)
{
    struct writing *x = receiver;
    (void)rank;
    if (bytes == 0) return;
    const unsigned char follows = ((const unsigned char *)message)[bytes - 1];
    x->again = follows == AGAIN;
    if (follows == FAILED) x->status = IMP_E_NOMEM;
    if (x->to) imp__file_put(x->to, message, bytes - 1);
}

/* The tiles of one rank; `to` NULL: they are not written here. */
static void share_put(struct writing *x, const struct imp_store *s, int rank)
{
    imp_context *ctx = x->walks->ctx;
    const struct imp_team *host = &ctx->team->host;
    const bool own = host->rank == rank;
    size_t at = imp__store_share(s, rank, host->ranks);
    const size_t end = imp__store_share(s, rank + 1, host->ranks);
    if (rank == 0) {
        if (x->to) imp__store_put(x->to, s, at, end);
        return;
    }
    x->again = true;
    while (x->again && x->status == IMP_OK) {
        static const unsigned char failed = FAILED;
        struct imp_bytes piece = {0};
        bool fits = true;
        while (own && at < end && piece.size < PIECE && fits)
            fits = imp__record_bytes_put(&s->records[at++], &piece);
        const unsigned char follows = at < end ? AGAIN : LAST;
        fits = fits && (!own || imp__bytes_add(ctx, &piece, &follows, 1));
        const enum imp_status sent =
            host->gather(fits ? piece.data : &failed, fits ? piece.size : own,
                         piece_receive, x, host->payload);
        if (sent != IMP_OK) x->status = sent;
        imp__bytes_free(ctx, &piece);
    }
}

static void stores_put(struct writing *x)
{
    const struct imp_walks *w = x->walks;
    for (int k = 0; k < w->n_stores; k++) {
        const struct imp_store *s = &w->stores[k];
        const struct imp_walks_store_head head = {s->records[0].of, s->index,
                                                  atomic_load(&s->roulette)};
        if (x->to) imp__file_put(x->to, &head, sizeof head);
        if (!w->spread) imp__store_put(x->to, s, 0, imp__store_tiles(s));
        for (int rank = 0; w->spread && rank < w->ctx->team->host.ranks; rank++)
            share_put(x, s, rank);
    }
}

/* As of imp__file_write_by. */
static void walks_fill(struct imp_file_writer *to, const void *payload)
{
    struct writing *x = *(struct writing *const *)payload;
    x->begun = true;
    x->to = to;
    start_put(to, x);
    stores_put(x);
    if (x->status != IMP_OK && !to->error) to->error = EIO;
}

enum imp_status imp_walks_write(const imp_walks *w, const char *path)
{
    IMP_REQUIRE(NULL, w, "walks");
    IMP_REQUIRE(w->ctx, path, "path");
    IMP_FLOAT_MODE;
    IMP_READS(w->scene);
    imp_context *ctx = w->ctx;
    struct imp_bytes scene = {0}, none = {0};
    struct writing x = {.walks = w, .scene = &scene}, *const payload = &x;
    const bool team = imp__team_ranks(ctx);
    enum imp_status st = imp__tree_put(w->scene, w->theta, &scene);
    if (st == IMP_OK) st = scene_prove(w, &scene);
    if (st == IMP_OK) {
        x.head =
            (struct imp_walks_head){.magic = IMP_WALKS_MAGIC,
                                    .byte_order = IMP_WALKS_BYTE_ORDER,
                                    .version = IMP_WALKS_VERSION,
                                    .scene_bytes = scene.size,
                                    .n_theta = w->scene->n_theta,
                                    .evaluated = imp__fingerprint_evaluated(w->scene),
                                    .seed = w->run.seed,
                                    .spp = w->run.spp,
                                    .points = (int32_t)w->run.points,
                                    .wavelengths = (int32_t)w->run.wavelengths,
                                    .wavelength_set = w->run.wavelength_set,
                                    .losses = w->losses,
                                    .n_stores = w->n_stores,
                                    .guided = w->guided,
                                    .survival = w->survival,
                                    .ess = w->ess,
                                    .headroom = w->headroom};
        st = imp__file_write_by(ctx, path, walks_fill, &payload);
        if (w->spread && !x.begun) stores_put(&x); /* the others wait for it */
        if (x.status != IMP_OK)
            st = imp__error(ctx, x.status, "%s: recorded walks did not come together",
                            path);
        if (team) {
            const enum imp_status first = imp__team_broadcast(ctx, st, &none);
            if (st == IMP_OK) st = first;
        }
    }
    imp__bytes_free(ctx, &none);
    imp__bytes_free(ctx, &scene);
    return st;
}
