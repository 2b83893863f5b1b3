/* SPDX-License-Identifier: Apache-2.0
 *
 * Command-line options from tables: one table holds how an option is spelled, where its
 * value goes, which values are good and what help prints about it. */
#ifndef IMP_CLI_ARGS_H
#define IMP_CLI_ARGS_H

#include <stddef.h>
#include <stdio.h>

enum arg_type {
    ARG_END = 0,
    ARG_FLAG,   /* int *: set to 1 */
    ARG_INT,    /* int * */
    ARG_SEED,   /* uint64_t * */
    ARG_NUMBER, /* double * */
    ARG_TEXT,   /* const char ** */
    ARG_LIST,   /* struct arg_list *: every use adds one */
    ARG_CHOICE, /* int *: index of one of `words` */
    ARG_PAIR    /* int[2]: "x,y" */
};

/* Or-ed to the type. A file that another person sends (a part, a manifest) carries a command, and
 * only options with ARG_REPLAYS: they choose what is computed, and never a place to write to, a
 * place to send to, or how the user's files are treated. An option without either is refused
 * there, and does not go together with --part and --manifest. */
enum {
    ARG_KIND = 0xf,
    ARG_REPLAYS = 0x10,
    ARG_ASIDE =
        0x20 /* it does not change the result: it is left out of what is carried */
};

struct arg_list {
    const char **item;
    size_t n;
};

struct arg_option { /* tables end with {0} */
    int type;       /* enum arg_type, with ARG_REPLAYS or ARG_ASIDE */
    char letter;    /* 0: long name only */
    const char *name;
    const char *value; /* what help calls the value; NULL for flags */
    const char *help;
    void *target;
    double lo, hi;            /* of ARG_INT and ARG_NUMBER; both 0: no bounds */
    const char *const *words; /* of ARG_CHOICE, NULL-terminated */
};

#define ARGS_MAX_GROUPS 12
struct args_spec {
    const char *command, *operands, *summary;
    const struct arg_option *group[ARGS_MAX_GROUPS + 1]; /* NULL-terminated */
    int min_operands, max_operands;                      /* max -1: any number */
};

/* Parse argv[1..]; operands are moved to the end of argv, *first is the index of the
 * first. Every option that was given is added to `typed` as "--name" or "--name=value",
 * and its text lives as long as the process. Returns 0, or prints what is wrong on stderr
 * and returns 2. */
int args_parse(const struct args_spec *spec, int argc, char **argv, int *first,
               struct arg_list *typed);
void args_help(const struct args_spec *spec, FILE *to);
/* What one option takes ("--name", "-n"): a word a line, or what help calls its value; a
 * flag: nothing. 0, or 2 with the reason printed. */
int args_help_option(const struct args_spec *spec, const char *name, FILE *to);
void args_list_add(struct arg_list *list, const char *item);
void args_list_free(struct arg_list *list);

/* The option that "--name" or "--name=value" spells out in full, or NULL. */
const struct arg_option *args_find(const struct args_spec *spec, const char *word);

/* The word of `words` (NULL-terminated) with the smallest edit distance, or NULL if none
 * is close. */
const char *args_nearest(const char *word, const char *const *words);

#endif
