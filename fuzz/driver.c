/* SPDX-License-Identifier: Apache-2.0
 *
 * Replays a corpus through a fuzz target as an ordinary test: no fuzzing engine is
 * needed.
 *
 *     replay_xml fuzz/corpus/xml
 */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define BYTES_MAX (1 << 20)

static int not_hidden(const struct dirent *entry) { return entry->d_name[0] != '.'; }

/* In memory of exactly its size, so that reading beyond the end is seen. */
static int replay(const char *path)
{
    static uint8_t buffer[BYTES_MAX];
    FILE *f = fopen(path, "rb");
    if (!f) return 0;
    const size_t n = fread(buffer, 1, sizeof buffer, f);
    fclose(f);
    uint8_t *exact = malloc(n ? n : 1);
    if (!exact) return 0;
    memcpy(exact, buffer, n);
    LLVMFuzzerTestOneInput(exact, n);
    free(exact);
    return 1;
}

int main(int argc, char **argv)
{
    int count = 0, failed = 0;
    for (int a = 1; a < argc; a++) {
        struct dirent **entries;
        const int n = scandir(argv[a], &entries, not_hidden, alphasort);
        for (int i = 0; i < n; i++) {
            char path[4096];
            snprintf(path, sizeof path, "%s/%s", argv[a], entries[i]->d_name);
            const int ok = replay(path);
            failed += !ok;
            printf("%sok %d - %s\n", ok ? "" : "not ", ++count, entries[i]->d_name);
            fflush(stdout);
            free(entries[i]);
        }
        if (n > 0) free(entries);
    }
    printf("%sok %d - the corpus is there\n", count ? "" : "not ", count + 1);
    printf("1..%d\n", count + 1);
    return failed || !count;
}
