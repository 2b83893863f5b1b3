/* SPDX-License-Identifier: Apache-2.0
 *
 * The page in order: the verdict, pictures, parameters, correlations, derivatives, loss,
 * checks, provenance. docs/report.md describes the data. */
"use strict";

function verdict(fit) {
    const lines = [];
    if (is_number(fit.value)) lines.push(make("p", {}, `${fit.loss || "loss"} ${show_error(fit.value, fit.se)} after ${fit.iterations} iterations: ${fit.reason || ""}`));
    if (is_number(fit.residual_hi)) {
        const p = (x) => `${show(100 * x, 2)} %`;
        lines.push(make("p", {class: fit.residual > 0.2 ? "warning" : ""}, fit.residual_hi <= 0 ? "The residual is within its noise."
            : fit.residual_hi > 1.5 * fit.residual ? `The residual is below ${p(fit.residual_hi)} of the targets.` : `The residual is ${p(fit.residual)} of the targets.`));
    }
    if (is_number(fit.chi2_per_freedom)) lines.push(make("p", {}, fit.chi2_se < 1 || fit.chi2_per_freedom > 3 * fit.chi2_se
        ? `Chi-square per degree of freedom: ${show_error(fit.chi2_per_freedom, fit.chi2_se)}.`
        : "Chi-square needs more samples: the noise of the fit's own pictures is above the targets'."));
    if (fit.warning) lines.push(make("p", {class: "warning"}, String(fit.warning)));
    if (fit.complete === false) lines.push(make("p", {class: "warning"}, "The fit was interrupted; this is the state that it had reached."));
    return lines;
}

function page(report) {
    const items = Array.isArray(report.items) ? report.items : [], of = (kind) => items.filter((i) => i.kind === kind);
    const fit = of("fit").map((i) => i.data)[0];
    const layers = [], failed = [];
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
    const main = document.getElementById("page");
    main.replaceChildren(make("header", {}, make("h1", {}, report.title || "importon report"), ...(fit ? verdict(fit) : [])));
    document.title = report.title || "importon report";
    for (const text of failed) main.append(make("p", {class: "error"}, `This picture cannot be shown: ${text}`));
    const derivatives = layers.filter((l) => l.signed && l.role === "");
    const pictures = layers.length ? picture_section(layers) : null;
    const sections = [pictures, fit && Array.isArray(fit.params) ? parameter_section(fit) : null, fit && Array.isArray(fit.params) ? correlation_section(fit) : null,
        derivatives.length ? derivative_section(derivatives, pictures.choose) : null, fit ? loss_section(fit) : null,
        ...of("check").map((i) => check_section(i.data)), ...of("walks").map((i) => walks_section(i.data)),
        of("image").length ? image_section(of("image")) : null,
        ...items.filter((i) => i.data && !["fit", "check", "walks"].includes(i.kind)).map(answer_section), provenance_section(report.command, report, items)];
    for (const section of sections) if (section) main.append(section);
    if (!items.length) main.append(make("p", {class: "warning"}, "This report holds nothing: no picture, no fit, no check."));
    document.documentElement.dataset.ready = "1";
}

try {
    const report = JSON.parse(document.getElementById("data").textContent);
    if (report.schema !== "importon-report" || report.version !== 1) throw new Error(`the data is of schema ${report.schema}, version ${report.version}; this page shows importon-report, version 1`);
    page(report);
} catch (error) {
    document.getElementById("page").replaceChildren(make("p", {class: "error"}, `This page cannot show its data: ${error.message}`));
    document.documentElement.dataset.ready = "failed";
}
