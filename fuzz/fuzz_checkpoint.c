/* SPDX-License-Identifier: Apache-2.0
 *
 * Checkpoints of searches. Good ones are made here, and the bytes say which is changed and
 * where: after the first, every three are a place (two bytes) and what is xored there. The
 * first: bit 0, the checksum is made to fit again; bit 1, half of the file is missing; bits 2
 * and 3, the optimiser. What is read is within its bounds, and is continued. */
#include "../tests/toy_goal.h"
#include "math/hash.h"
#include "memory_file.h"
#include "search/checkpoint.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { KINDS = 4, BYTES = 1 << 16 };
static const enum imp_optimizer kinds[KINDS] = {IMP_ADAM, IMP_LM, IMP_LBFGS, IMP_MMA};
static const struct imp__fingerprint of = {1, 2, 3, 4};
static imp_context *ctx;
static char good[KINDS][BYTES];
static size_t n_good[KINDS];
static struct memory_file file;

static struct imp__search *search_of(struct toy *t, enum imp_optimizer kind,
                                     const struct imp__opt_options *o)
{
    struct imp__search *s;
    double x0[TOY_N];
    toy_make(t, ctx, 9, 0.1, 0.2);
    for (int k = 0; k < TOY_N; k++) x0[k] = 0.5 * t->truth[k];
    if (imp__search_create(&t->goal, kind, o, x0, &s) != IMP_OK) abort();
    return s;
}

static void begin(void)
{
    const struct imp__opt_options o = {
        .max_iterations = 12, .learning_rate = 0.05, .tolerance = 1e-6};
    if (imp_context_create(NULL, &ctx) != IMP_OK) abort();
    for (int k = 0; k < KINDS; k++) {
        struct toy t;
        char name[64];
        struct imp__search *s = search_of(&t, kinds[k], &o);
        t.stop_after = 5;
        (void)!imp__optimize(&t.goal, &o, s);
        good_file_name(name);
        if (imp__checkpoint_write(ctx, name, &of, s) != IMP_OK) abort();
        imp__search_destroy(s);
        n_good[k] = good_file_take(name, good[k], BYTES);
    }
    memory_file_open(&file);
}

/* The number of a line "word number"; 0 if there is none. */
static uint64_t number_of(const char *text, const char *word)
{
    const char *line = strstr(text, word);
    return line ? strtoull(line + strlen(word), NULL, 10) : 0;
}

/* Of the head and of all lines of 16 digits, as the last line has it. */
static void sum_fit(char *text, size_t n)
{
    const uint64_t head[4] = {
        number_of(text, "\noptimizer "), number_of(text, "\nvariables "),
        number_of(text, "\niteration "), number_of(text, "\nfinished ")};
    uint64_t h = imp__hash(0, head, sizeof head);
    for (const char *s = text; (s = strchr(s, '\n')); s++) {
        if (strspn(s + 1, "0123456789abcdef") != 16 || s[17] != '\n') continue;
        const uint64_t bits = strtoull(s + 1, NULL, 16);
        h = imp__hash(h, &bits, sizeof bits);
    }
    char *end = strstr(text, "\nend ");
    if (end && (size_t)(end - text) + 22 <= n) {
        char line[24];
        snprintf(line, sizeof line, "\nend %016llx\n", (unsigned long long)h);
        memcpy(end, line, 22);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char text[BYTES];
    if (!ctx) begin();
    if (size == 0) return 0;
    const int how = data[0], k = how >> 2 & 3;
    const struct imp__opt_options o = {
        .max_iterations = 12, .learning_rate = 0.05, .tolerance = 1e-6};
    const size_t n = how & 2 ? n_good[k] / 2 : n_good[k];
    memset(text, 0, sizeof text);
    memcpy(text, good[k], n);
    for (size_t i = 1; i + 3 <= size; i += 3)
        text[(data[i] | (size_t)data[i + 1] << 8) % n] ^= (char)data[i + 2];
    if (how & 1) sum_fit(text, n);
    memory_file_put(&file, text, n);
    struct toy t;
    struct imp__search *s = search_of(&t, kinds[k], &o);
    bool found;
    if (imp__checkpoint_read(ctx, file.path, &of, &t.goal, s, &found) == IMP_OK) {
        for (size_t i = 0; i < s->n; i++)
            if (!(s->x[i] >= t.goal.lo[i] && s->x[i] <= t.goal.hi[i])) abort();
        (void)!imp__optimize(&t.goal, &o, s);
    } else if (size < 4 && (how & 2) == 0) {
        fprintf(stderr, "%s\n", imp_last_error(ctx)); /* nothing was changed */
        abort();
    }
    imp__search_destroy(s);
    return 0;
}
