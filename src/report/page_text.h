/* SPDX-License-Identifier: Apache-2.0
 *
 * The page's template, made of page.html, page.css and the scripts by
 * tools/embed_page.py: what precedes the addresses it may connect to (of the content
 * security policy), between these and the answer in HTML, between that and the data, and
 * behind. */
#ifndef IMP_REPORT_PAGE_TEXT_H
#define IMP_REPORT_PAGE_TEXT_H

extern const char imp__page_head[], imp__page_body[], imp__page_data[], imp__page_tail[];

#endif
