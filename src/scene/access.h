/* SPDX-License-Identifier: Apache-2.0
 *
 * Who may touch a scene's parameters: any number of calls that read them, or one that
 * sets them (a fit, an objective that is given x). Others wait. What a callback calls
 * inside a call is part of that call, except that it may not set what the call reads.
 *
 *     IMP_READS(scene);          void, for the rest of the block
 *     IMP_SETS(scene, status);   status: IMP_E_ARG inside a call that reads */
#ifndef IMP_SCENE_ACCESS_H
#define IMP_SCENE_ACCESS_H

#include "base/context.h"

struct imp__access { /* guarded by the context's lock */
    pthread_cond_t changed;
    int readers;
    bool setting;
    long process; /* 0: none yet; another: all of this is the parent's */
};

struct imp__access_held {
    const struct imp_scene *scene; /* NULL: there is nothing to give back */
    const struct imp_scene *outer;
    bool outer_sets, sets;
};

struct imp__access_held imp__access_read(const struct imp_scene *scene);
struct imp__access_held imp__access_set(const struct imp_scene *scene,
                                        enum imp_status *status);
void imp__access_leave(const struct imp__access_held *held);
void imp__access_destroy(struct imp__access *access);

#define IMP_READS(scene)                                                                 \
    const struct imp__access_held access_                                                \
        __attribute__((cleanup(imp__access_leave), unused)) = imp__access_read(scene)
#define IMP_SETS(scene, status)                                                          \
    const struct imp__access_held access_                                                \
        __attribute__((cleanup(imp__access_leave), unused)) =                            \
            imp__access_set(scene, &(status))

#endif
