/* SPDX-License-Identifier: Apache-2.0
 *
 * A search that went through a file has the bits of one that did not; a file of another
 * fit, a damaged or a truncated one is refused and changes nothing. */
#include "search/checkpoint.h"
#include "imp_tap.h"
#include "toy_goal.h"
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static imp_context *ctx;
static char path[64];
static const struct imp__fingerprint of = {1, 2, 3, 4};

static struct imp__opt_options options_of(enum imp_optimizer kind)
{
    return (struct imp__opt_options){kind == IMP_ADAM ? 90 : 20, 0.05, 1e-6, 0, false};
}

static struct imp__search *begin(struct toy *t, enum imp_optimizer kind)
{
    const struct imp__opt_options o = options_of(kind);
    struct imp__search *s = NULL;
    double x0[TOY_N];
    toy_make(t, ctx, 9, 0.1, 0.2);
    for (int k = 0; k < TOY_N; k++) x0[k] = 0.5 * t->truth[k];
    if (imp__search_create(&t->goal, kind, &o, x0, &s) != IMP_OK) exit(1);
    return s;
}

static void round_trip(enum imp_optimizer kind, const char *name)
{
    struct toy t;
    const struct imp__opt_options o = options_of(kind);
    bool found = false;
    struct imp__search *whole = begin(&t, kind);
    enum imp_status st = imp__optimize(&t.goal, &o, whole);

    struct imp__search *part = begin(&t, kind);
    t.stop_after = kind == IMP_ADAM ? 47 : 5;
    enum imp_status stopped = imp__optimize(&t.goal, &o, part);
    enum imp_status wrote = imp__checkpoint_write(ctx, path, &of, part);
    const int at = part->iteration;
    imp__search_destroy(part);

    part = begin(&t, kind);
    const enum imp_status read =
        imp__checkpoint_read(ctx, path, &of, &t.goal, part, &found);
    const enum imp_status ended = imp__optimize(&t.goal, &o, part);
    tap_ok(
        st == IMP_OK && stopped == IMP_CANCELLED && wrote == IMP_OK && read == IMP_OK &&
            found && ended == IMP_OK && part->iteration == whole->iteration &&
            part->n_history == whole->n_history &&
            !memcmp(part->x, whole->x, TOY_N * sizeof(double)) &&
            !memcmp(part->history, whole->history, whole->n_history * sizeof(double)) &&
            !memcmp(part->history_se, whole->history_se,
                    whole->n_history * sizeof(double)) &&
            !memcmp(part->history_x, whole->history_x,
                    imp__search_trail(whole) * sizeof(double)),
        "%s: stopped after %d of %d iterations, resumed: the same bits", name, at,
        whole->iteration);
    imp__search_destroy(part);
    imp__search_destroy(whole);
}

static long file_size(void)
{
    FILE *f = fopen(path, "rb");
    if (!f || fseek(f, 0, SEEK_END) != 0) return -1;
    const long size = ftell(f);
    fclose(f);
    return size;
}

static void write_bytes(const char *bytes, size_t n)
{
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(bytes, 1, n, f) != n) exit(1);
    fclose(f);
}

int main(void)
{
    struct toy t;
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    snprintf(path, sizeof path, "checkpoint-test-%d.imp", (int)getpid());
    round_trip(IMP_ADAM, "Adam");
    round_trip(IMP_LM, "LM");
    round_trip(IMP_LBFGS, "L-BFGS");
    round_trip(IMP_MMA, "MMA");
    round_trip(IMP_SLSQP, "SLSQP");

    /* A checkpoint with something in every array. */
    struct imp__search *s = begin(&t, IMP_ADAM);
    t.stop_after = 30;
    if (imp__optimize(&t.goal, &(struct imp__opt_options){90, 0.05, 1e-6, 0, false}, s) !=
            IMP_CANCELLED ||
        imp__checkpoint_write(ctx, path, &of, s) != IMP_OK)
        return 1;
    imp__search_destroy(s);
    const long size = file_size();
    char *bytes = malloc((size_t)size);
    FILE *f = fopen(path, "rb");
    if (!f || !bytes || fread(bytes, 1, (size_t)size, f) != (size_t)size) return 1;
    fclose(f);

    s = begin(&t, IMP_ADAM);
    double before[TOY_N];
    bool found = false;
    memcpy(before, s->x, sizeof before);
    struct imp__fingerprint other[4] = {of, of, of, of};
    other[0].parameters++, other[1].scene++, other[2].targets++, other[3].options++;
    for (int k = 0; k < 4; k++)
        tap_ok(imp__checkpoint_read(ctx, path, &other[k], &t.goal, s, &found) ==
                   IMP_E_ARG,
               "of another fit is refused # %s", imp_last_error(ctx));

    int refused = 0, tried = 0, crashes = 0;
    for (long n = 0; n < size - 1;
         n += 1 + (n > 150) * 6) { /* the last byte is the newline */
        write_bytes(bytes, (size_t)n);
        tried++;
        refused += imp__checkpoint_read(ctx, path, &of, &t.goal, s, &found) != IMP_OK;
    }
    tap_ok(refused == tried, "truncated anywhere is refused # %d of %d", refused, tried);
    int harmless = 0;
    for (long n = 0; n < size; n += 1 + (n > 150) * 6) {
        const char old = bytes[n];
        bytes[n] = old == '1' ? '2' : '1';
        write_bytes(bytes, (size_t)size);
        const enum imp_status st =
            imp__checkpoint_read(ctx, path, &of, &t.goal, s, &found);
        if (st == IMP_OK) harmless++;
        else if (st != IMP_E_IO && st != IMP_E_SCENE && st != IMP_E_ARG) crashes++;
        bytes[n] = old;
    }
    tap_ok(crashes == 0 && harmless == 0, "one byte changed is refused # %d not noticed",
           harmless);
    tap_ok(!memcmp(s->x, before, sizeof before), "and changes nothing");

    write_bytes("importon checkpoint 5\noptimizer 0\nvariables 4\n"
                "of 1 2 3 4\niteration 1\nfinished 0\nstart 99999999999999\n",
                101);
    tap_ok(imp__checkpoint_read(ctx, path, &of, &t.goal, s, &found) == IMP_E_IO,
           "an absurd size is refused # %s", imp_last_error(ctx));
    remove(path);
    tap_ok(imp__checkpoint_read(ctx, path, &of, &t.goal, s, &found) == IMP_OK && !found,
           "no file: nothing to resume, no error");
    tap_ok(imp__checkpoint_write(ctx, "no/such/folder/file", &of, s) == IMP_E_IO,
           "unwritable # %s", imp_last_error(ctx));
    tap_ok(imp__checkpoint_write(ctx, "/dev/full", &of, s) == IMP_E_IO, "full disk # %s",
           imp_last_error(ctx));
    free(bytes);
    imp__search_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
