/* SPDX-License-Identifier: Apache-2.0
 *
 * The page of a report: template, answer in HTML, template, data, template. The data is JSON in a script element of
 * the page; '<' occurs only in its strings and is written as \u003c, so that no text can
 * end the element. */
#include "base/arguments.h"
#include "base/film.h"
#include "base/text.h"
#include "explained.h"
#include "json_text.h"
#include "page_static.h"
#include "page_text.h"
#include "planes.h"
#include <importon/report.h>
#include <math.h>
#include <string.h>

static void put_string(struct imp_text *t, const char *text)
{
    t->failed = t->failed || !imp__json_string(t->ctx, &t->bytes, text);
}

/* "key":"text", or nothing for NULL. */
static void put_member(struct imp_text *t, const char *key, const char *text)
{
    if (!text) return;
    imp__put(t, ",\"%s\":", key);
    put_string(t, text);
}

static void put_film(struct imp_text *t, const struct imp_report_item *item)
{
    const imp_film *f = item->film;
    imp__put(t, ",\"view\":%d,\"width\":%d,\"height\":%d,\"spp\":%lld,\"channels\":[",
             item->view, f->width, f->height, (long long)f->spp);
    for (int c = 0; c < f->channels; c++) {
        if (c) imp__put(t, ",");
        put_string(t, f->names[c]);
    }
    size_t bad = 0;
    for (size_t i = 0; i < imp__film_values(f); i++) bad += !isfinite(f->mean[i]);
    imp__put(t, "],\"not_finite\":%zu,\"pixels\":\"", bad);
    const double scale = imp__planes_put(t, f, f->mean);
    imp__put(t, "\",\"scale\":%.17g", scale);
    if (!f->se) return;
    imp__put(t, ",\"se\":\"");
    const double se_scale = imp__planes_put(t, f, f->se);
    imp__put(t, "\",\"se_scale\":%.17g", se_scale);
}

/* As data URLs have it; NULL: no file that a browser draws. */
static const char *image_type(const unsigned char *bytes, size_t n)
{
    static const char png[] = "\x89PNG\r\n\x1a\n", svg[] = "<svg ";
    if (n >= 8 && !memcmp(bytes, png, 8)) return "image/png";
    if (n >= 5 && !memcmp(bytes, svg, 5)) return "image/svg+xml";
    return NULL;
}

static enum imp_status put_item(struct imp_text *t, const struct imp_report_item *item,
                                size_t i)
{
    size_t at;
    if (!item->kind || !*item->kind)
        return imp__error(t->ctx, IMP_E_ARG, "items[%zu]: it has no kind", i);
    const char *type = NULL;
    if (!!item->film + !!item->json + !!item->image != 1)
        return imp__error(t->ctx, IMP_E_ARG,
                          "items[%zu] (%s): it needs one of film, json and image", i,
                          item->name ? item->name : item->kind);
    if (item->json && !imp__json_valid(item->json, &at))
        return imp__error(t->ctx, IMP_E_ARG, "items[%zu] (%s): no JSON, at byte %zu", i,
                          item->name ? item->name : item->kind, at);
    if (item->image && !(type = image_type(item->image, item->image_size)))
        return imp__error(t->ctx, IMP_E_ARG, "items[%zu] (%s): no PNG or SVG file", i,
                          item->name ? item->name : item->kind);
    imp__put(t, "%s{\"kind\":", i ? "," : "");
    put_string(t, item->kind);
    put_member(t, "name", item->name);
    put_member(t, "role", item->role);
    put_member(t, "unit", item->unit);
    if (item->film) {
        put_film(t, item);
    } else if (item->image) {
        imp__put(t, ",\"type\":\"%s\",\"file\":\"", type);
        imp__base64_put(t, item->image, item->image_size);
        imp__put(t, "\"");
    } else {
        imp__put(t, ",\"data\":");
        t->failed = t->failed ||
                    !imp__bytes_add(t->ctx, &t->bytes, item->json, strlen(item->json));
    }
    imp__put(t, "}");
    return IMP_OK;
}

/* ---- The page ---------------------------------------------------------------------- */

/* Receives the pieces of a page. */
typedef void (*put_fn)(void *to, const void *bytes, size_t n);

struct page {
    const struct imp_bytes *data, *answer; /* in HTML */
    bool live;
};

static void page_put(const struct page *p, put_fn put, void *to)
{
    const char *at = (const char *)p->data->data, *end = at + p->data->size;
    const char *connect = p->live ? "'self'" : "'none'";
    put(to, imp__page_head, strlen(imp__page_head));
    put(to, connect, strlen(connect));
    put(to, imp__page_body, strlen(imp__page_body));
    put(to, p->answer->data, p->answer->size);
    put(to, imp__page_data, strlen(imp__page_data));
    while (at < end) {
        const char *bracket = memchr(at, '<', (size_t)(end - at));
        const size_t n = (size_t)((bracket ? bracket : end) - at);
        put(to, at, n);
        at += n;
        if (bracket) put(to, "\\u003c", 6), at++;
    }
    put(to, imp__page_tail, strlen(imp__page_tail));
}

static void put_file(void *to, const void *bytes, size_t n)
{
    imp__file_put(to, bytes, n);
}
static void put_text(void *to, const void *bytes, size_t n)
{
    struct imp_text *t = to;
    t->failed = t->failed || !imp__bytes_add(t->ctx, &t->bytes, bytes, n);
}
static void fill(struct imp_file_writer *w, const void *payload)
{
    page_put(payload, put_file, w);
}

/* Pictures that are compared: one of each role a view. */
struct compared {
    const imp_film **picture, **target; /* [views] */
    int *view;
    size_t n;
};

static enum imp_status compared_take(imp_context *context, struct compared *c,
                                     size_t most, const struct imp_report_item *item)
{
    size_t k = 0;
    const bool picture = item->role && !strcmp(item->role, "picture"),
               target = item->role && !strcmp(item->role, "target");
    if (!item->film || !(picture || target)) return IMP_OK;
    if (!c->view) {
        c->view = imp__alloc(context, most, sizeof *c->view);
        c->picture = imp__alloc(context, most, sizeof *c->picture);
        c->target = imp__alloc(context, most, sizeof *c->target);
        if (!c->view || !c->picture || !c->target)
            return imp__error(context, IMP_E_NOMEM, "no memory for the page of a report");
    }
    while (k < c->n && c->view[k] != item->view) k++;
    c->n = imp_max(c->n, k + 1);
    c->view[k] = item->view;
    if (picture && !c->picture[k]) c->picture[k] = item->film;
    if (target && !c->target[k]) c->target[k] = item->film;
    return IMP_OK;
}

static void compared_put(struct imp_text *t, const struct compared *c)
{
    for (size_t k = 0; k < c->n; k++) {
        struct imp_text own = {.ctx = t->ctx};
        if (c->picture[k] && c->target[k] &&
            imp__explained_put(&own, c->picture[k], c->target[k])) {
            imp__put(t, ",{\"kind\":\"explained\",\"view\":%d,\"data\":", c->view[k]);
            t->failed = t->failed || !imp__bytes_add(t->ctx, &t->bytes, own.bytes.data,
                                                     own.bytes.size);
            imp__put(t, "}");
        }
        t->failed = t->failed || own.failed;
        imp__bytes_free(t->ctx, &own.bytes);
    }
}

/* The JSON of a report, whose options are the library's own. */
static enum imp_status data_make(imp_context *context, const char *caller,
                                 const struct imp_report *r, struct imp_text *t)
{
    enum imp_status st = IMP_OK;
    struct compared compared = {0};
    imp__put(t, "{\"schema\":\"importon-report\",\"version\":2,\"importon\":");
    put_string(t, imp_version());
    put_member(t, "title", r->title);
    put_member(t, "command", r->command);
    if (r->live) imp__put(t, ",\"live\":true");
    imp__put(t, ",\"items\":[");
    for (size_t i = 0; i < r->n_items; i++) {
        struct imp_report_item item = IMP_REPORT_ITEM_INIT;
        IMP_TRY(imp__element_take(context, caller, "report->items", r->items, i, &item,
                                  sizeof item));
        IMP_TRY(put_item(t, &item, i));
        IMP_TRY(compared_take(context, &compared, r->n_items, &item));
    }
    compared_put(t, &compared);
    imp__put(t, "]}");
    if (t->failed)
        IMP_TRY(imp__error(context, IMP_E_NOMEM, "no memory for the page of a report"));
out:
    imp__release(context, compared.view);
    imp__release(context, compared.picture);
    imp__release(context, compared.target);
    return st;
}

enum imp_status imp_report_write(imp_context *context, const struct imp_report *report,
                                 const char *path)
{
    enum imp_status st = IMP_OK;
    struct imp_report own = IMP_REPORT_INIT;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, report, "report");
    IMP_REQUIRE(context, path, "path");
    IMP_OPTIONS(context, own, report, "report");
    if (own.n_items) IMP_REQUIRE(context, own.items, "report->items");
    IMP_FLOAT_MODE;
    struct imp_text data = {.ctx = context}, answer = {.ctx = context};
    IMP_TRY(data_make(context, __func__, &own, &data));
    IMP_TRY(imp__page_static(&answer, &own, (const char *)data.bytes.data));
    const struct page page = {&data.bytes, &answer.bytes, own.live};
    IMP_TRY(imp__file_write_by(context, path, fill, &page));
out:
    imp__bytes_free(context, &data.bytes);
    imp__bytes_free(context, &answer.bytes);
    return st;
}

/* The text goes to the caller, who frees it. */
static void give(struct imp_text *t, char **text, size_t *length)
{
    *text = (char *)t->bytes.data;
    if (length) *length = t->bytes.size;
    t->bytes = (struct imp_bytes){0};
}

enum imp_status imp_report_page(imp_context *context, const struct imp_report *report,
                                char **text, size_t *length)
{
    enum imp_status st = IMP_OK;
    struct imp_report own = IMP_REPORT_INIT;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, report, "report");
    IMP_REQUIRE(context, text, "text");
    IMP_OPTIONS(context, own, report, "report");
    if (own.n_items) IMP_REQUIRE(context, own.items, "report->items");
    IMP_FLOAT_MODE;
    struct imp_text data = {.ctx = context}, answer = {.ctx = context},
                    page = {.ctx = context};
    IMP_TRY(data_make(context, __func__, &own, &data));
    IMP_TRY(imp__page_static(&answer, &own, (const char *)data.bytes.data));
    page_put(&(struct page){&data.bytes, &answer.bytes, own.live}, put_text, &page);
    if (page.failed)
        IMP_TRY(imp__error(context, IMP_E_NOMEM, "no memory for the page of a report"));
    give(&page, text, length);
out:
    imp__bytes_free(context, &data.bytes);
    imp__bytes_free(context, &answer.bytes);
    imp__bytes_free(context, &page.bytes);
    return st;
}

enum imp_status imp_report_data(imp_context *context, const struct imp_report *report,
                                char **text, size_t *length)
{
    enum imp_status st = IMP_OK;
    struct imp_report own = IMP_REPORT_INIT;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, report, "report");
    IMP_REQUIRE(context, text, "text");
    IMP_OPTIONS(context, own, report, "report");
    if (own.n_items) IMP_REQUIRE(context, own.items, "report->items");
    IMP_FLOAT_MODE;
    struct imp_text data = {.ctx = context};
    IMP_TRY(data_make(context, __func__, &own, &data));
    give(&data, text, length);
out:
    imp__bytes_free(context, &data.bytes);
    return st;
}
