/* SPDX-License-Identifier: Apache-2.0
 *
 * Contexts of OpenEXRCore that read and write memory, use our allocator and keep the
 * library's message. */
#include "exr.h"
#include "hooks.h"
#include <stdio.h>
#include <string.h>

/* The handler cannot get the user data from its context: while writing, the context is
 * locked when the handler is called. */
static _Thread_local struct imp_exr *current;

static void on_error(exr_const_context_t c, exr_result_t code, const char *message)
{
    (void)c, (void)code;
    if (current && !*current->message)
        snprintf(current->message, sizeof current->message, "%s", message);
}

static int64_t on_size(exr_const_context_t c, void *payload)
{
    (void)c;
    const struct imp_exr *io = payload;
    return (int64_t)io->from->size;
}

static int64_t on_read(exr_const_context_t c, void *payload, void *buffer, uint64_t n,
                       uint64_t offset, exr_stream_error_func_ptr_t error)
{
    (void)c, (void)error;
    const struct imp_exr *io = payload;
    if (offset >= io->from->size) return 0;
    n = imp_min(n, (uint64_t)io->from->size - offset);
    memcpy(buffer, io->from->data + offset, n);
    return (int64_t)n;
}

static int64_t on_write(exr_const_context_t c, void *payload, const void *data,
                        uint64_t n, uint64_t offset, exr_stream_error_func_ptr_t error)
{
    (void)c, (void)error;
    struct imp_exr *io = payload;
    if (!imp__bytes_put(io->ctx, io->to, offset, data, n)) {
        io->no_memory = true;
        return -1;
    }
    return (int64_t)n;
}

exr_context_initializer_t imp__exr_begin(struct imp_exr *io)
{
    io->previous = imp__hooks_enter(io->ctx);
    (void)imp__hooks_failed();
    io->outer = current;
    current = io;
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = on_error;
    setup.alloc_fn = imp__hooks_malloc;
    setup.free_fn = imp__hooks_free;
    setup.user_data = io;
    if (io->to) setup.write_fn = on_write;
    if (io->from) {
        setup.read_fn = on_read;
        setup.size_fn = on_size;
    }
    return setup;
}

void imp__exr_end(struct imp_exr *io)
{
    imp__hooks_leave(io->previous);
    current = io->outer;
}

enum imp_status imp__exr_error(const struct imp_exr *io, exr_result_t code)
{
    if (code == EXR_ERR_OUT_OF_MEMORY || io->no_memory || imp__hooks_failed())
        return imp__error(io->ctx, IMP_E_NOMEM, "%s: no memory for the picture",
                          io->name ? io->name : "EXR");
    const char *text = *io->message ? io->message : exr_get_default_error_message(code);
    if (!io->name) return imp__error(io->ctx, IMP_E_ARG, "EXR: %s", text);
    return imp__error(io->ctx, IMP_E_SCENE, "%s: %s", io->name, text);
}
