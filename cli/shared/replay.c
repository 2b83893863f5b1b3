/* SPDX-License-Identifier: Apache-2.0
 *
 * The line of a command that a part or a manifest carries: written, and read with distrust. */
#include "replay.h"

#include "ranks.h"
#include "settings.h"

#include <stdlib.h>
#include <string.h>

/* ---- Writing ----------------------------------------------------------------------- */

static void word_print(FILE *to, const char *word)
{
    fputs(ftell(to) > 0 ? " '" : "'", to);
    for (; *word; word++)
        if (*word == '\'') fputs("'\\''", to);
        else fputc(*word, to);
    fputc('\'', to);
}

/* Each line of a file of settings is an option of its own: the file need not be there when the
 * line is run, and a line never makes a command read a file that somebody chose. */
static void settings_print(FILE *to, const char *path)
{
    size_t length = 0;
    const char *text = ranks_first() ? settings_hold(path, &length) : NULL;
    for (const char *line = text, *next; line && line < text + length; line = next) {
        const char *end = memchr(line, '\n', (size_t)(text + length - line));
        if (!end) end = text + length;
        next = end + 1;
        if (end > line && end[-1] == '\r') end--;
        if (end == line || *line == '#') continue;
        char *word = NULL;
        if (asprintf(&word, "--set=%.*s", (int)(end - line), line) < 0)
            exit(cli_error(EXIT_RUN, "out of memory"));
        word_print(to, word);
        free(word);
    }
}

char *replay_line(void)
{
    static const char file[] = "--set=@";
    const struct command *command = cli_command(cli.name);
    char *text = NULL;
    size_t size;
    FILE *to = open_memstream(&text, &size);
    if (!to) return NULL;
    word_print(to, cli.name);
    for (size_t k = 0; command && k < cli.typed.n; k++) {
        const char *word = cli.typed.item[k];
        const struct arg_option *o = args_find(&command->args, word);
        if (!o || !(o->type & ARG_REPLAYS)) continue;
        if (strncmp(word, file, sizeof file - 1) != 0) word_print(to, word);
        else settings_print(to, word + sizeof file - 1);
    }
    word_print(to, "--");
    for (int k = 0; k < cli.n_operands; k++) word_print(to, cli.operand[k]);
    if (fclose(to) == 0) return text;
    free(text);
    return NULL;
}

const char *replay_unfit(void)
{
    static char name[64];
    const struct command *command = cli_command(cli.name);
    for (size_t k = 0; command && k < cli.typed.n; k++) {
        const struct arg_option *o = args_find(&command->args, cli.typed.item[k]);
        if (!o || o->type & (ARG_REPLAYS | ARG_ASIDE)) continue;
        snprintf(name, sizeof name, "--%s", o->name);
        return name;
    }
    return NULL;
}

/* ---- Reading ----------------------------------------------------------------------- */

/* The words in quotes, or NULL if the line is not of such words. */
static char **split(const char *line, int *argc)
{
    const size_t n = strlen(line);
    char **argv = cli_alloc(n / 2 + 2, sizeof *argv), *to = cli_alloc(n + 1, 1);
    char *const words = to;
    *argc = 0;
    while (*line == '\'') {
        argv[(*argc)++] = to;
        for (line++; *line; line++) {
            if (*line != '\'') *to++ = *line;
            else if (!strncmp(line, "'\\''", 4)) *to++ = '\'', line += 3;
            else break;
        }
        *to++ = 0;
        if (*line == '\'') line++;
        if (*line == ' ') line++;
    }
    if (*line == 0 && *argc > 0) return argv;
    free(words);
    free(argv);
    return NULL;
}

static int refuse(const char *path, const char *name, const char *word, const char *why)
{
    return cli_error(EXIT_USAGE, "%s: refused: its command is '%.40s' with '%.200s': %s",
                     path, name, word, why);
}

/* Options are as replay_line spells them, "--name=value", and end with "--": an abbreviation, a
 * letter or a value in a word of its own is not of our making. */
static int check(const char *path, enum replays kind, int argc, char **argv)
{
    const struct command *command = cli_command(argv[0]);
    int k = 1;
    if (!command || !(command->replays & kind))
        return cli_error(EXIT_USAGE, "%s: refused: its command is '%.200s'; %s carry %s",
                         path, argv[0], kind == REPLAYS_PARTS ? "parts" : "manifests",
                         kind == REPLAYS_PARTS
                             ? "render, gradient, jacobian, read or plan"
                             : "render, gradient or fit");
    for (; k < argc && strcmp(argv[k], "--") != 0; k++) {
        const struct arg_option *o = args_find(&command->args, argv[k]);
        if (!o)
            return refuse(path, argv[0], argv[k], "this is not an option, spelled out");
        if (!(o->type & ARG_REPLAYS))
            return refuse(path, argv[0], argv[k],
                          "a file that carries commands may not have this option");
        if (!strncmp(argv[k], "--set=@", 7))
            return refuse(path, argv[0], argv[k],
                          "settings are carried themselves, not the name of a file");
    }
    if (k == argc)
        return refuse(path, argv[0], argv[k - 1], "'--' is missing at its end");
    const int n = argc - k - 1, most = command->args.max_operands;
    if (n < command->args.min_operands || (most >= 0 && n > most))
        return refuse(path, argv[0], argv[argc - 1], "this is not its number of files");
    for (k++; k < argc; k++)
        if (!*argv[k] || (kind == REPLAYS_MANIFEST && !strcmp(argv[k], "-")))
            return refuse(path, argv[0], argv[k], "this is not the name of a file");
    return 0;
}

int replay_words(const char *path, enum replays kind, const char *line, int *argc,
                 char ***argv)
{
    *argv = split(line, argc);
    if (!*argv)
        return cli_error(EXIT_USAGE, "%s: not made by this command: %.200s", path, line);
    const int rc = check(path, kind, *argc, *argv);
    if (rc) {
        free((*argv)[0]);
        free(*argv);
        *argv = NULL;
    }
    return rc;
}
