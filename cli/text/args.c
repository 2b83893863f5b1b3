/* SPDX-License-Identifier: Apache-2.0
 *
 * Parser of the command line: options from tables, help texts, suggestions for what is
 * misspelt. */
#include "args.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define MAX_OPTIONS 64
#define MAX_WORD    64

void args_list_add(struct arg_list *list, const char *item)
{
    const char **grown = realloc(list->item, (list->n + 1) * sizeof *grown);
    if (!grown) {
        fprintf(stderr, "importon: out of memory\n");
        exit(3);
    }
    list->item = grown;
    list->item[list->n++] = item;
}
void args_list_free(struct arg_list *list)
{
    free(list->item);
    *list = (struct arg_list){0};
}

/* Levenshtein's distance, one row at a time. */
static int edit_distance(const char *a, const char *b)
{
    int row[MAX_WORD + 1];
    const int n = (int)strlen(b);
    if (n > MAX_WORD || strlen(a) > MAX_WORD) return MAX_WORD;
    for (int j = 0; j <= n; j++) row[j] = j;
    for (int i = 1; a[i - 1]; i++) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= n; j++) {
            const int swap = diagonal + (a[i - 1] != b[j - 1]);
            const int gap = 1 + (row[j] < row[j - 1] ? row[j] : row[j - 1]);
            diagonal = row[j];
            row[j] = swap < gap ? swap : gap;
        }
    }
    return row[n];
}
const char *args_nearest(const char *word, const char *const *words)
{
    const char *best = NULL;
    int least = 1 + (int)strlen(word) / 3; /* one slip in three letters, at least one */
    for (; *words; words++) {
        const int d = edit_distance(word, *words);
        if (d <= least && (!best || d < least)) best = *words, least = d;
    }
    return best;
}

static int usage_error(const struct args_spec *spec)
{
    fprintf(stderr, "Try 'importon help %s'.\n", spec->command);
    return 2;
}

static int parse_int(const char *text, double lo, double hi, int *out)
{
    char *end;
    errno = 0;
    const long v = strtol(text, &end, 10);
    const int bounded = lo != 0 || hi != 0;
    if (end == text || *end || errno || v < INT32_MIN || v > INT32_MAX) return 0;
    if (bounded && ((double)v < lo || (double)v > hi)) return 0;
    *out = (int)v;
    return 1;
}

static int is_flag(const struct arg_option *o)
{
    return (o->type & ARG_KIND) == ARG_FLAG;
}

const struct arg_option *args_find(const struct args_spec *spec, const char *word)
{
    if (strncmp(word, "--", 2) != 0) return NULL;
    const size_t n = strcspn(word + 2, "=");
    for (int g = 0; spec->group[g]; g++)
        for (const struct arg_option *o = spec->group[g]; o->type; o++)
            if (strlen(o->name) == n && !strncmp(o->name, word + 2, n) &&
                is_flag(o) == !word[2 + n])
                return o;
    return NULL;
}

/* Store the value of one option; 0: the value is not good. */
static int store(const struct arg_option *o, const char *text)
{
    char *end;
    switch ((enum arg_type)(o->type & ARG_KIND)) {
    case ARG_END: return 0;
    case ARG_FLAG: *(int *)o->target = 1; return 1;
    case ARG_INT: return parse_int(text, o->lo, o->hi, o->target);
    case ARG_SEED: {
        errno = 0;
        const unsigned long long v = strtoull(text, &end, 10);
        if (end == text || *end || errno || strchr(text, '-')) return 0;
        *(uint64_t *)o->target = v;
        return 1;
    }
    case ARG_NUMBER: {
        const double v = strtod(text, &end);
        if (end == text || *end || !isfinite(v)) return 0;
        if ((o->lo != 0 || o->hi != 0) && (v < o->lo || v > o->hi)) return 0;
        *(double *)o->target = v;
        return 1;
    }
    case ARG_TEXT: *(const char **)o->target = text; return 1;
    case ARG_LIST: args_list_add(o->target, text); return 1;
    case ARG_CHOICE:
        for (int i = 0; o->words[i]; i++)
            if (!strcmp(text, o->words[i])) return *(int *)o->target = i, 1;
        return 0;
    case ARG_PAIR: {
        const char *comma = strchr(text, ',');
        char first[16];
        if (!comma || comma - text >= (int)sizeof first) return 0;
        memcpy(first, text, (size_t)(comma - text));
        first[comma - text] = 0;
        return parse_int(first, 0, 0, o->target) &&
               parse_int(comma + 1, 0, 0, (int *)o->target + 1);
    }
    }
    return 0;
}

static void explain_value(const struct args_spec *spec, const struct arg_option *o,
                          const char *text)
{
    fprintf(stderr, "importon: %s: --%s %s is not good: expected ", spec->command,
            o->name, text);
    switch ((enum arg_type)(o->type & ARG_KIND)) {
    case ARG_CHOICE:
        for (int i = 0; o->words[i]; i++)
            fprintf(stderr, "%s%s", i ? ", " : "one of ", o->words[i]);
        break;
    case ARG_INT:
        fprintf(stderr, "a whole number");
        if (o->lo != 0 || o->hi != 0) fprintf(stderr, " from %.0f to %.0f", o->lo, o->hi);
        break;
    case ARG_SEED: fprintf(stderr, "a whole number, 0 or more"); break;
    case ARG_NUMBER:
        fprintf(stderr, "a number");
        if (o->lo != 0 || o->hi != 0) fprintf(stderr, " from %g to %g", o->lo, o->hi);
        break;
    case ARG_PAIR: fprintf(stderr, "two whole numbers, x,y"); break;
    default: fprintf(stderr, "%s", o->value);
    }
    fprintf(stderr, "\n");
}

static int flatten(const struct args_spec *spec, const struct arg_option *all[])
{
    int n = 0;
    for (int g = 0; spec->group[g]; g++)
        for (const struct arg_option *o = spec->group[g]; o->type && n < MAX_OPTIONS; o++)
            all[n++] = o;
    return n;
}

static int unknown_option(const struct args_spec *spec, const char *word,
                          const struct arg_option *all[], int n)
{
    const char *names[MAX_OPTIONS + 1] = {0};
    char name[MAX_WORD];
    fprintf(stderr, "importon: %s: unknown option '%s'", spec->command, word);
    if (word[0] == '-' && word[1] == '-') {
        for (int i = 0; i < n; i++) names[i] = all[i]->name;
        snprintf(name, sizeof name, "%s", word + 2);
        name[strcspn(name, "=")] = 0;
        const char *near = args_nearest(name, names);
        if (near) fprintf(stderr, "; did you mean '--%s'?", near);
    }
    fprintf(stderr, "\n");
    return usage_error(spec);
}

/* Was a list of patterns given, whose first the shell may have made several? */
static int takes_patterns(const struct args_spec *spec)
{
    for (int g = 0; spec->group[g]; g++)
        for (const struct arg_option *o = spec->group[g]; o->type; o++)
            if ((o->type & ARG_KIND) == ARG_LIST && !strncmp(o->value, "GLOB", 4) &&
                ((const struct arg_list *)o->target)->n > 0)
                return 1;
    return 0;
}

static void typed_add(struct arg_list *typed, const struct arg_option *o,
                      const char *value)
{
    const size_t n = strlen(o->name) + (value ? strlen(value) : 0) + 4;
    char *text = malloc(n);
    if (!text) return;
    snprintf(text, n, "--%s%s%s", o->name, value ? "=" : "", value ? value : "");
    args_list_add(typed, text);
}

int args_parse(const struct args_spec *spec, int argc, char **argv, int *first,
               struct arg_list *typed)
{
    const struct arg_option *all[MAX_OPTIONS];
    struct option options[MAX_OPTIONS + 1] = {{0}};
    char letters[2 * MAX_OPTIONS + 2] = ":", *letter = letters + 1;
    const int n = flatten(spec, all);

    for (int i = 0; i < n; i++) {
        options[i] = (struct option){all[i]->name,
                                     is_flag(all[i]) ? no_argument : required_argument,
                                     NULL, 256 + i};
        if (!all[i]->letter) continue;
        *letter++ = all[i]->letter;
        if (!is_flag(all[i])) *letter++ = ':';
    }
    opterr = 0;
    optind = 1;
    for (int c; (c = getopt_long(argc, argv, letters, options, NULL)) != -1;) {
        const struct arg_option *o = NULL;
        const int code = c == ':' || c == '?' ? optopt : c;
        if (code >= 256) o = all[code - 256];
        for (int i = 0; i < n && !o && code; i++)
            if (all[i]->letter == code) o = all[i];
        if (c == ':') {
            fprintf(stderr, "importon: %s: --%s needs a value: %s\n", spec->command,
                    o ? o->name : "?", o ? o->value : "");
            return usage_error(spec);
        }
        if (c == '?' && o) { /* a flag was given a value */
            fprintf(stderr, "importon: %s: --%s takes no value\n", spec->command,
                    o->name);
            return usage_error(spec);
        }
        if (c == '?') {
            char short_name[3] = {'-', (char)optopt, 0};
            return unknown_option(spec, optopt ? short_name : argv[optind - 1], all, n);
        }
        if (!store(o, optarg)) {
            explain_value(spec, o, optarg);
            return usage_error(spec);
        }
        typed_add(typed, o, is_flag(o) ? NULL : optarg);
    }
    *first = optind;
    if (argc - optind < spec->min_operands) {
        fprintf(stderr, "importon: %s: expected %s\n", spec->command, spec->operands);
        return usage_error(spec);
    }
    if (spec->max_operands >= 0 && argc - optind > spec->max_operands) {
        fprintf(stderr, "importon: %s: one argument too many: '%s'%s\n", spec->command,
                argv[optind + spec->max_operands],
                takes_patterns(spec)
                    ? " (patterns need quotes, or the shell puts file names in their "
                      "place: -p 'ball.*')"
                    : "");
        return usage_error(spec);
    }
    return 0;
}

/* Words from column `column` on, in lines that end before WIDTH. */
static void put_wrapped(FILE *to, const char *text, int column)
{
    enum { WIDTH = 80 };
    int at = column;
    while (*text) {
        const int n = (int)strcspn(text, " ");
        if (at > column && at + 1 + n >= WIDTH) {
            fprintf(to, "\n%*s", column, "");
            at = column;
        }
        at += fprintf(to, "%s%.*s", at > column ? " " : "", n, text);
        text += n;
        text += strspn(text, " ");
    }
    fputc('\n', to);
}

void args_help(const struct args_spec *spec, FILE *to)
{
    enum { COLUMN = 31 };
    fprintf(to, "usage: importon %s [options] %s\n\n", spec->command, spec->operands);
    put_wrapped(to, spec->summary, 0);
    fputc('\n', to);
    for (int g = 0; spec->group[g]; g++) {
        for (const struct arg_option *o = spec->group[g]; o->type; o++) {
            char left[64];
            snprintf(left, sizeof left, "  %c%c%s --%s%s%s", o->letter ? '-' : ' ',
                     o->letter ? o->letter : ' ', o->letter ? "," : " ", o->name,
                     o->value ? " " : "", o->value ? o->value : "");
            fprintf(to, "%-*s", COLUMN, left);
            if (strlen(left) >= COLUMN) fprintf(to, "\n%*s", COLUMN, "");
            put_wrapped(to, o->help, COLUMN);
        }
        fprintf(to, "\n");
    }
}

int args_help_option(const struct args_spec *spec, const char *name, FILE *to)
{
    name += strspn(name, "-");
    for (int g = 0; spec->group[g]; g++)
        for (const struct arg_option *o = spec->group[g]; o->type; o++) {
            if (strcmp(name, o->name) && !(name[0] == o->letter && !name[1])) continue;
            if ((o->type & ARG_KIND) == ARG_CHOICE)
                for (int i = 0; o->words[i]; i++) fprintf(to, "%s\n", o->words[i]);
            else if (o->value) fprintf(to, "%s\n", o->value);
            return 0;
        }
    fprintf(stderr, "importon: %s: unknown option '%s'\n", spec->command, name);
    return usage_error(spec);
}
