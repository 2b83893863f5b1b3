/* SPDX-License-Identifier: Apache-2.0
 *
 * The page in order: the verdict, pictures, parameters, correlations, derivatives, loss,
 * checks, walks, rays, elements, drawings, other answers, provenance. docs/report.md
 * describes the data. */
"use strict";

/* Layers of all pictures, with residuals; messages of those that cannot be shown. */
function all_layers(items) {
    const layers = [], failed = [], of = (kind) => items.filter((i) => i.kind === kind);
    for (const item of [...of("picture"), ...of("derivative")])
        try {
            layers.push(...layers_of(item));
        } catch (error) {
            failed.push(`${item.name}: ${error.message}`);
        }
    for (const view of new Set(layers.map((l) => l.view))) {
        const find = (role) => layers.find((l) => l.view === view && l.role === role), target = find("target"), picture = find("picture");
        const residual = target && picture && residual_of(picture, target);
        if (residual) layers.splice(layers.indexOf(picture) + 1, 0, residual);
    }
    return {layers, failed};
}

/* Sections in their order: the kinds of items that each is made of, and the elements that
 * it makes. A section whose items change is made again, and the others stay. */
const known_kinds = ["picture", "explained", "derivative", "fit", "check", "walks", "rays", "bend", "elements", "mesh", "image", "truth", "places"];
const listed_kinds = ["bend", "elements"]; /* they have sections, and the answer is a table besides */
const sections = [
    {kinds: ["fit", "elements", "explained"], make: (report, of, page) => [make("header", {}, make("h1", {}, report.title || "importon report"), ...explained_lines(of("explained"), of("picture"), (r, view) => { if (page.pictures) page.pictures.show(view, "residual", Math.floor(r.x + r.width / 2), Math.floor(r.y + r.height / 2)); }),
        ...(of("fit").length && of("fit")[0].data ? verdict(of("fit")[0].data) : []),
        ...of("elements").filter((i) => i.data).flatMap((i) => elements_verdict(i.data)))]},
    {kinds: ["places", "fit", "gradient"], make: (report, of, page) => {
        page.things = things_of(report.items);
        if (page.pictures) page.pictures.redraw();
        return [];
    }},
    {kinds: ["picture", "derivative"], make: (report, of, page) => {
        const {layers, failed} = all_layers([...of("picture"), ...of("derivative")]);
        const notes = failed.map((text) => make("p", {class: "error"}, `This picture cannot be shown: ${text}`));
        if (page.pictures && layers.length) page.pictures.update(layers);
        else page.pictures = layers.length ? picture_section(layers, page) : null;
        page.layers = layers;
        page.derivatives = layers.filter((l) => l.signed && l.role === "");
        return [...notes, page.pictures];
    }},
    {kinds: ["fit"], make: (report, of, page) => {
        const fit = of("fit").length && of("fit")[0].data;
        if (!fit || !Array.isArray(fit.params)) return [];
        const loose = fit.undetermined ? page.layers.filter((l) => l.role === "undetermined") : [], parameters = parameter_section(fit);
        if (loose.length) parameters.append(loosest_figures(loose, fit.undetermined, page.pictures.choose));
        return [parameters, correlation_section(fit)];
    }},
    {kinds: ["picture", "derivative", "fit"], make: (report, of, page) => [page.derivatives && page.derivatives.length ? derivative_section(page.derivatives, page.pictures.choose) : null]},
    {kinds: ["fit", "bend"], make: (report, of) => [...of("fit"), ...of("bend")].map((i) => (i.data ? loss_section(i.data) : null))},
    {kinds: ["check"], make: (report, of) => of("check").map((i) => check_section(i.data))},
    {kinds: ["walks"], make: (report, of) => of("walks").map((i) => walks_section(i.data, i.name, report))},
    {kinds: ["rays"], make: (report, of) => of("rays").sort((a, b) => /^before/.test(a.name) - /^before/.test(b.name)).map((i) => rays_section(i.data, i.name))},
    {kinds: ["mesh"], make: (report, of) => of("mesh").map((i) => (i.data ? elements_section(i.data) : null))},
    {kinds: ["image"], make: (report, of) => [of("image").length ? image_section(of("image")) : null]},
    {kinds: null, make: (report) => report.items.filter((i) => i.data && (!known_kinds.includes(i.kind) || listed_kinds.includes(i.kind))).map(answer_section)},
    {kinds: null, make: (report) => [provenance_section(report.command, report, report.items)]},
];

/* Numbers of fits get their truth, where it is known, by name. */
function truths_set(items) {
    for (const truth of items.filter((i) => i && i.kind === "truth" && i.data))
        for (const fit of items.filter((i) => i && i.kind === "fit" && i.data && Array.isArray(i.data.params)))
            for (const p of fit.data.params) if (p.truth === undefined && Object.hasOwn(truth.data, String(p.name))) p.truth = truth.data[String(p.name)];
}

function page_of(report) {
    const page = {live: null, things: [], places: sections.map(() => make("div"))}, main = document.getElementById("page");
    const empty = make("p", {class: "warning"}, "This report holds nothing: no picture, no fit, no check.");
    /* changed: kinds of items; null: all. */
    page.update = (changed) => {
        const of = (kind) => report.items.filter((i) => i.kind === kind);
        sections.forEach((section, k) => {
            if (changed && !(section.kinds ? section.kinds.some((kind) => changed.includes(kind)) : changed.some((kind) => !known_kinds.includes(kind) || listed_kinds.includes(kind)))) return;
            let made;
            try {
                made = section.make(report, of, page).filter(Boolean);
            } catch (error) { /* data that others wrote: the rest of the page stands */
                made = [make("p", {class: "error"}, `${section.kinds ? `This part (${section.kinds.join(", ")})` : "A part"} cannot be shown: ${error.message}`)];
            }
            const place = page.places[k];
            if (made.length !== place.children.length || made.some((e, i) => e !== place.children[i])) place.replaceChildren(...made);
        });
        empty.hidden = report.items.length > 0 || Boolean(report.live);
    };
    if (!Array.isArray(report.items)) report.items = [];
    truths_set(report.items);
    document.title = report.title || "importon report";
    main.replaceChildren(page.places[0]);
    if (report.live) main.append(live_section(report, page));
    main.append(...page.places.slice(1), empty);
    page.update(null);
    return page;
}

async function begin() {
    document.getElementById("wait").textContent = "The pictures are being read.";
    try {
        const report = JSON.parse(document.getElementById("data").textContent);
        if (report.schema !== "importon-report" || report.version !== 2) throw new Error(`the data is of schema ${report.schema}, version ${report.version}; this page shows importon-report, version 2`);
        if (Array.isArray(report.items)) await unpack(report.items);
        page_of(report);
        document.documentElement.dataset.ready = "1";
    } catch (error) {
        document.getElementById("page").replaceChildren(make("p", {class: "error"}, `This page cannot show its data: ${error.message}`));
        document.documentElement.dataset.ready = "failed";
    }
    performance.mark("ready");
}
begin();
