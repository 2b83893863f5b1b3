/* SPDX-License-Identifier: Apache-2.0
 *
 * Bytes of a glTF file: buffers, views of them, and accessors, whose every element lies
 * inside its buffer. */
#include "format/image.h"
#include "format/search.h"
#include "gltf.h"
#include <math.h>
#include <string.h>
#include <strings.h>

#define BUFFER_MAX ((size_t)1 << 36)
#define ALWAYS     0x1p30 /* bytes in memory that a file of any size may become */

enum imp_status imp__gltf_made(struct gltf *g, double bytes)
{
    g->bytes_made += bytes;
    return imp__unpacks(g->ctx, g->in->name, g->bytes_read, g->bytes_made, ALWAYS);
}

/* ---- Uris ------------------------------------------------------------------------------- */

static int sextet(char c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+' || c == '-') return 62; /* -, _: of the alphabet for urls */
    return c == '/' || c == '_' ? 63 : -1;
}

static enum imp_status base64(const struct gltf *g, const char *text,
                              struct imp_bytes *out)
{
    size_t n = strlen(text), used = 0;
    while (n > 0 && text[n - 1] == '=') n--;
    if (n % 4 == 1) return imp__gltf_error(g, "its data ends inside a byte of base64");
    const size_t size = n / 4 * 3 + (n % 4 ? n % 4 - 1 : 0);
    unsigned char *to = imp__alloc(g->ctx, size + 1, 1);
    if (!to) return imp__gltf_memory(g);
    *out = (struct imp_bytes){to, size, size + 1};
    uint32_t bits = 0;
    for (size_t i = 0; i < n; i++) {
        const int s = sextet(text[i]);
        if (s < 0) return imp__gltf_error(g, "its data is not base64");
        bits = bits << 6 | (uint32_t)s;
        if (i % 4 && used < size) to[used++] = (unsigned char)(bits >> (6 - 2 * (i % 4)));
    }
    to[size] = 0;
    return IMP_OK;
}

static int hex(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    c |= 0x20;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

enum imp_status imp__gltf_uri(struct gltf *g, const char *uri, struct imp_bytes *out)
{
    if (strncasecmp(uri, "data:", 5) == 0) {
        const char *comma = strchr(uri, ',');
        if (!comma || comma - uri < 12 || strncasecmp(comma - 7, ";base64", 7) != 0)
            return imp__gltf_error(g, "its data is not base64");
        return base64(g, comma + 1, out);
    }
    if (strstr(uri, "://"))
        return imp__gltf_error(g, "uri '%.80s': nothing is fetched from elsewhere", uri);
    /* "my%20room.bin" */
    char *name = imp__arena_take(&g->in->scene->files, strlen(uri) + 1, 1), *to = name;
    const char *path;
    if (!name) return imp__gltf_memory(g);
    for (const char *from = uri; *from; from++) {
        const bool coded = *from == '%' && hex(from[1]) >= 0 && hex(from[2]) >= 0;
        *to++ = coded ? (char)(hex(from[1]) * 16 + hex(from[2])) : *from;
        if (coded) from += 2;
    }
    *to = 0;
    enum imp_status st = imp__search(g->in->scene, g->folder, name, &path);
    if (st == IMP_OK) st = imp__file_read(g->ctx, path, BUFFER_MAX, out);
    if (st != IMP_OK)
        return imp__error_prefix(g->ctx, st, "%s: %s", g->in->name, g->where);
    g->bytes_read += (double)out->size;
    return st;
}

/* ---- Buffers and views -------------------------------------------------------------------- */

static enum imp_status buffer_of(struct gltf *g, size_t index, struct gltf_buffer **out)
{
    struct gltf_buffer *b = *out = &g->buffer[index];
    const json_t *object;
    size_t length = 0;
    if (b->read) return IMP_OK;
    IMP_CHECKED(imp__gltf_item(g, "buffers", index, &object));
    IMP_CHECKED(imp__gltf_size(g, object, "byteLength", BUFFER_MAX, &length));
    const char *uri = imp__gltf_text(object, "uri");
    if (uri) {
        IMP_CHECKED(imp__gltf_uri(g, uri, &b->own));
        b->data = b->own.data;
        b->size = b->own.size;
    } else if (index == 0 && g->binary) {
        b->data = g->binary;
        b->size = g->n_binary;
    } else return imp__gltf_error(g, "it has no uri, and the file has no bytes for it");
    if (b->size < length)
        return imp__gltf_error(g, "has %zu bytes, not %zu", b->size, length);
    b->size = length;
    b->read = true;
    return IMP_OK;
}

enum imp_status imp__gltf_view(struct gltf *g, size_t view, const unsigned char **data,
                               size_t *size, size_t *stride)
{
    const json_t *object;
    struct gltf_buffer *b;
    size_t buffer = SIZE_MAX, offset = 0;
    *size = *stride = 0;
    IMP_CHECKED(imp__gltf_item(g, "bufferViews", view, &object));
    IMP_CHECKED(imp__gltf_size(g, object, "buffer", g->n_buffers, &buffer));
    IMP_CHECKED(imp__gltf_size(g, object, "byteOffset", BUFFER_MAX, &offset));
    IMP_CHECKED(imp__gltf_size(g, object, "byteLength", BUFFER_MAX, size));
    IMP_CHECKED(imp__gltf_size(g, object, "byteStride", 253, stride));
    if (buffer == SIZE_MAX) return imp__gltf_error(g, "names no buffer");
    if (imp__gltf_extension(object, "EXT_meshopt_compression"))
        return imp__gltf_error(g, "EXT_meshopt_compression is not supported");
    IMP_CHECKED(buffer_of(g, buffer, &b));
    if (offset > b->size || *size > b->size - offset)
        return imp__gltf_error(g, "bufferViews[%zu] ends at byte %zu of %zu", view,
                               offset + *size, b->size);
    *data = b->data + offset;
    return IMP_OK;
}

/* ---- Accessors ------------------------------------------------------------------------------ */

static size_t bytes_of(int component)
{
    switch (component) {
    case 5120:
    case 5121: return 1; /* byte, unsigned byte */
    case 5122:
    case 5123: return 2; /* short, unsigned short */
    case 5125:           /* unsigned int */
    case 5126: return 4; /* float */
    default: return 0;
    }
}

enum imp_status imp__gltf_accessor(struct gltf *g, size_t index,
                                   struct gltf_accessor *out)
{
    static const char *const types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    struct gltf_accessor a = {0};
    const json_t *object;
    size_t view = SIZE_MAX, offset = 0, size, component = 0;
    IMP_CHECKED(imp__gltf_item(g, "accessors", index, &object));
    IMP_CHECKED(imp__gltf_size(g, object, "bufferView", imp__gltf_count(g, "bufferViews"),
                               &view));
    IMP_CHECKED(imp__gltf_size(g, object, "byteOffset", BUFFER_MAX, &offset));
    IMP_CHECKED(imp__gltf_size(g, object, "componentType", 6000, &component));
    IMP_CHECKED(imp__gltf_size(g, object, "count", (size_t)INT32_MAX, &a.count));
    const char *type = imp__gltf_text(object, "type");
    for (int k = 0; type && k < 4; k++)
        if (strcmp(type, types[k]) == 0) a.n = k + 1;
    a.component = (int)component;
    a.normalized = imp__gltf_flag(object, "normalized");
    const size_t each = bytes_of(a.component) * (size_t)a.n;
    if (!each || !a.count)
        return imp__gltf_error(g, "type '%.20s', component %d, count %zu",
                               type ? type : "", a.component, a.count);
    if (json_object_get(object, "sparse") || view == SIZE_MAX)
        return imp__gltf_error(g, "accessors that are sparse, or have no bufferView, are "
                                  "not supported");
    IMP_CHECKED(imp__gltf_view(g, view, &a.data, &size, &a.stride));
    if (!a.stride) a.stride = each;
    if (a.stride < each)
        return imp__gltf_error(g, "byteStride is %zu, an element has %zu bytes", a.stride,
                               each);
    if (offset > size || each > size - offset ||
        (a.count - 1) > (size - offset - each) / a.stride)
        return imp__gltf_error(g, "accessors[%zu] does not lie inside of its view",
                               index);
    a.data += offset;
    *out = a;
    return IMP_OK;
}

static double component_of(const struct gltf_accessor *a, const unsigned char *p)
{
    int8_t c;
    int16_t s;
    uint16_t us;
    uint32_t u;
    float f;
    switch (a->component) {
    case 5120: memcpy(&c, p, 1); return a->normalized ? fmax(c / 127., -1) : c;
    case 5121: return a->normalized ? *p / 255. : *p;
    case 5122: memcpy(&s, p, 2); return a->normalized ? fmax(s / 32767., -1) : s;
    case 5123: memcpy(&us, p, 2); return a->normalized ? us / 65535. : us;
    case 5125: memcpy(&u, p, 4); return a->normalized ? u / 4294967295. : u;
    default: memcpy(&f, p, 4); return (double)f;
    }
}

void imp__gltf_element(const struct gltf_accessor *a, size_t i, int n, float *out)
{
    const unsigned char *p = a->data + i * a->stride;
    for (int k = 0; k < n; k++)
        out[k] = (float)component_of(a, p + (size_t)k * bytes_of(a->component));
}

uint32_t imp__gltf_integer(const struct gltf_accessor *a, size_t i)
{
    return (uint32_t)component_of(a, a->data + i * a->stride);
}
