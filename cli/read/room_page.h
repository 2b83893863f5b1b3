/* SPDX-License-Identifier: Apache-2.0
 *
 * The page of a room that a client is shown: what is wanted and what is there, plans with
 * isolines, luminaires, a view; numbers in HTML, without a script. */
#ifndef IMP_CLI_ROOM_PAGE_H
#define IMP_CLI_ROOM_PAGE_H

#include "read_grid.h"
#include "room_wants.h"

#define PAGE_GRIDS 64

struct room_page {
    struct imp_design_want want[WANTS_MAX];
    size_t n_wants;
    struct grid grid[PAGE_GRIDS]; /* it owns them */
    size_t n_grids;
    /* For a design: what the answer says of each emitter, by name; NULL: of `read`, what the
     * scene says. */
    const char *(*file_of)(const char *lamp, void *payload);
    double (*level_of)(const char *lamp, void *payload); /* 0: it is not there */
    double (*watts_of)(const char *lamp, void *payload); /* 0: by the file */
    void *payload;
    const char *heading; /* a sentence, plain; NULL: none */
};

/* The grid becomes the page's; beyond PAGE_GRIDS it is left out. */
void room_page_add(struct room_page *p, struct grid *g);
void room_page_free(struct room_page *p);
/* Glare ratings and the view are made here. *met: all that is wanted is there, with the whole of each
 * 95 % interval. 0, or an exit code with the reason printed. */
int room_page_write(struct room_page *p, const char *path, struct imp_run run, bool *met);

#endif
