/* SPDX-License-Identifier: Apache-2.0
 *
 * The page of a report: template, data, template. The data is JSON in a script element of
 * the page; '<' stands only in its strings and is written as \u003c, so that no text can
 * end the element. */
#include "base/arguments.h"
#include "base/film.h"
#include "base/text.h"
#include "json_text.h"
#include "page_text.h"
#include "planes.h"
#include <importon/report.h>
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
    imp__put(t, "],\"pixels\":\"");
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

static void fill(struct imp_file_writer *w, const void *payload)
{
    const struct imp_bytes *data = payload;
    const char *at = (const char *)data->data, *end = at + data->size;
    imp__file_put(w, imp__page_head, strlen(imp__page_head));
    while (at < end) {
        const char *bracket = memchr(at, '<', (size_t)(end - at));
        const size_t n = (size_t)((bracket ? bracket : end) - at);
        imp__file_put(w, at, n);
        at += n;
        if (bracket) imp__file_put(w, "\\u003c", 6), at++;
    }
    imp__file_put(w, imp__page_tail, strlen(imp__page_tail));
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
    struct imp_text t = {.ctx = context};
    imp__put(&t, "{\"schema\":\"importon-report\",\"version\":1,\"importon\":");
    put_string(&t, imp_version());
    put_member(&t, "title", own.title);
    put_member(&t, "command", own.command);
    imp__put(&t, ",\"items\":[");
    for (size_t i = 0; i < own.n_items; i++) {
        struct imp_report_item item = IMP_REPORT_ITEM_INIT;
        IMP_TRY(imp__element_take(context, __func__, "report->items", own.items, i, &item,
                                  sizeof item));
        IMP_TRY(put_item(&t, &item, i));
    }
    imp__put(&t, "]}");
    if (t.failed)
        IMP_TRY(imp__error(context, IMP_E_NOMEM, "no memory for the page of a report"));
    IMP_TRY(imp__file_write_by(context, path, fill, &t.bytes));
out:
    imp__bytes_free(context, &t.bytes);
    return st;
}
