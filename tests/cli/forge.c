/* SPDX-License-Identifier: Apache-2.0
 *
 * forge manifest|part FILE LINE: a file with a good checksum, whose command is any line: what
 * somebody could send. */
#include <importon/importon.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    imp_context *ctx = NULL;
    imp_manifest *manifest = NULL;
    imp_parts *parts = NULL;
    if (argc != 4) return 2;
    enum imp_status st = imp_context_create(NULL, &ctx);
    if (st == IMP_OK && !strcmp(argv[1], "manifest")) {
        st = imp_manifest_create(ctx, argv[3], &manifest);
        if (st == IMP_OK) st = imp_manifest_write(manifest, argv[2]);
    } else if (st == IMP_OK) {
        st = imp_parts_create(ctx, 1, 1, argv[3], &parts);
        if (st == IMP_OK) st = imp_parts_write(parts, argv[2]);
    }
    if (st != IMP_OK) fprintf(stderr, "forge: %s\n", imp_last_error(ctx));
    imp_manifest_destroy(manifest);
    imp_parts_destroy(parts);
    imp_context_destroy(ctx);
    return st == IMP_OK ? 0 : 1;
}
