/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of a run: which, where they go, and the command that they carry, as a line for
 * the shell: options spelled out, every word in quotes. */
#include "part.h"
#include "overwrite.h"

#include <stdlib.h>
#include <string.h>

static int index_, count;

int part_begin(void)
{
    char rest;
    if (!cli.part) return 0;
    if (sscanf(cli.part, "%d/%d%c", &index_, &count, &rest) != 2 || index_ < 1 ||
        index_ > count)
        return cli_error(EXIT_USAGE,
                         "%s: --part %s is not good: expected I/N with I from 1 to N",
                         cli.name, cli.part);
    if (cli.time_s > 0)
        return cli_error(EXIT_USAGE,
                         "%s: --part and --time do not go together: parts "
                         "end with their samples",
                         cli.name);
    if (!cli.out || !strcmp(cli.out, "-"))
        return cli_error(EXIT_USAGE, "%s: --part needs -o FILE for the part", cli.name);
    cli.part_out = cli.out;
    cli.out = NULL;
    const int rc = overwrite_check(cli.part_out, OUTPUT_PART);
    return rc;
}

/* Options that do not change the result. */
static int aside(const char *option)
{
    static const char *const names[] = {
        "part",     "output",    "overwrite", "threads",    "json",   "progress",
        "quiet",    "help",      "manifest",  "checkpoint", "resume", "sheet",
        "textures", "mpi-files", "display",   "no-manifest"};
    const size_t n = strcspn(option + 2, "=");
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        if (strlen(names[k]) == n && !strncmp(option + 2, names[k], n)) return 1;
    return 0;
}

static void word_print(FILE *to, const char *word)
{
    fputs(ftell(to) > 0 ? " '" : "'", to);
    for (; *word; word++)
        if (*word == '\'') fputs("'\\''", to);
        else fputc(*word, to);
    fputc('\'', to);
}

char *part_command(void)
{
    char *text = NULL;
    size_t size;
    FILE *to = open_memstream(&text, &size);
    if (!to) return NULL;
    word_print(to, cli.name);
    for (size_t k = 0; k < cli.typed.n; k++)
        if (!aside(cli.typed.item[k])) word_print(to, cli.typed.item[k]);
    word_print(to, "--");
    for (int k = 0; k < cli.n_operands; k++) word_print(to, cli.operand[k]);
    if (fclose(to) == 0) return text;
    free(text);
    return NULL;
}

char **part_command_words(const char *text, int *argc)
{
    const size_t n = strlen(text);
    char **argv = cli_alloc(n / 2 + 2, sizeof *argv), *to = cli_alloc(n + 1, 1);
    char *const words = to;
    *argc = 0;
    while (*text == '\'') {
        argv[(*argc)++] = to;
        for (text++; *text; text++) {
            if (*text != '\'') *to++ = *text;
            else if (!strncmp(text, "'\\''", 4)) *to++ = '\'', text += 3;
            else break;
        }
        *to++ = 0;
        if (*text == '\'') text++;
        if (*text == ' ') text++;
    }
    if (*text == 0 && *argc > 0) return argv;
    free(words);
    free(argv);
    return NULL;
}

int part_open(void)
{
    if (!cli.part) return 0;
    char *text = part_command();
    if (!text) return cli_error(EXIT_RUN, "out of memory");
    enum imp_status st = imp_parts_create(cli.context, index_, count, text, &cli.parts);
    if (st == IMP_OK) st = imp_context_set_parts(cli.context, cli.parts);
    free(text);
    return st == IMP_OK ? 0 : cli_fail(st, NULL);
}

int part_end(void)
{
    const enum imp_status st = imp_parts_write(cli.parts, cli.part_out);
    if (st != IMP_OK) return cli_fail(st, NULL);
    cli_say("%s: part %d of %d", cli.part_out, index_, count);
    return EXIT_STOP;
}
