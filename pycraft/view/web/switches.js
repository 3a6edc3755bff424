"use strict";
// Switches for hypotheses: which theorems break on the model that they stand for, and by how much. All numbers are in the page.

const told = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const positions = Object.values(told.switches).map((choices) => choices[0]);
const DECADES = 20; // of the bars: a residual of 1 is a whole one
let figure = null, before = null;

const broken = (row) => row !== null && (row[0] === "breaks" || row[0] === "undefined" || row[0] === "fails");
const ever = told.theorems.map((_, i) => Object.values(told.cases).some((found) => broken(found.rows[i])));

function element(tag, parent, text = "", properties = {}) {
  const made = parent.appendChild(document.createElement(tag));
  if (text) made.textContent = text;
  return Object.assign(made, properties);
}

function buildChoices() {
  Object.entries(told.switches).forEach(([name, choices], i) => {
    const box = element("fieldset", byId("choices"));
    element("legend", box, name);
    choices.forEach((choice, j) => {
      const label = element("label", box), input = element("input", label, "", { type: "radio", name, checked: j === 0, value: choice });
      label.append(` ${choice}`);
      input.addEventListener("change", () => { positions[i] = choice; show(); });
    });
  });
}

function drawFigure(found) {
  if (!figure) figure = new Figure(byId("figure"), found.figure);
  const turned = [figure.yaw, figure.pitch];
  Object.assign(figure, { data: found.figure, centre: found.figure.centre, poses: numbers(found.poses) });
  [figure.yaw, figure.pitch] = turned;
  figure.draw();
}

function sizeBar(cell, row) {
  if (row[1] === null) return void (cell.textContent = row[0] === "undefined" ? "asks for an inverse that is not there" : "");
  const share = row[1] > 0 ? Math.max(0, Math.min(1, 1 + Math.log10(row[1]) / DECADES)) : 0;
  const bar = element("span", cell, "", { className: `size ${broken(row) ? "wrong" : ""}` });
  bar.style.width = `${(100 * share).toFixed(1)}px`;
  element("span", cell, row[1] === 0 ? "0" : broken(row) ? row[1].toPrecision(2) : row[1].toExponential(0));
}

function show() {
  const found = told.cases[positions.join("|")], chosen = byId("shown").value, body = document.createElement("tbody");
  let group = "", unmet = {};
  told.theorems.forEach((theorem, i) => {
    const row = found.rows[i];
    if (row === null) return;
    if (broken(row)) for (const name of row[2]) unmet[name] = (unmet[name] || 0) + 1;
    if (chosen === "ever" ? !ever[i] : chosen === "now" && !broken(row)) return;
    if (theorem.group !== group) element("th", element("tr", body), (group = theorem.group), { colSpan: 4, className: "group" });
    const line = element("tr", body, "", { className: broken(row) ? "broken" : "", title: row[3] });
    if (before && before.rows[i] !== null && before.rows[i][0] !== row[0]) line.classList.add("changed");
    const named = element("td", line, theorem.name);
    element("div", named, theorem.text, { className: "formula" });
    const needs = element("td", line);
    theorem.hypotheses.forEach((name, k) => element("span", needs, (k ? ", " : "") + name, { className: row[2].includes(name) ? "unmet" : "" }));
    element("td", line, { breaks: "✗ breaks", undefined: "✗ undefined", fails: "✗ FAILS" }[row[0]] || `✓ ${row[0]}`, { className: "verdict" });
    sizeBar(element("td", line), row);
  });
  byId("theorems").tBodies[0].replaceWith(body);
  const all = found.rows.filter((row) => row !== null).length, count = found.rows.filter(broken).length, because = Object.entries(unmet).map(([name, n]) => `${n} need${n === 1 ? "s" : ""} ${name}`).join(", ");
  byId("summary").textContent = count ? `${count} of ${all} break${count === 1 ? "s" : ""} here: ${because}` : `none of ${all} breaks here`;
  byId("met").textContent = `${positions.join(", ")}: ${found.said}. Met: ${found.met.join(", ") || "none"}.`;
  drawFigure(found);
  before = found;
}

buildChoices();
byId("shown").addEventListener("change", show);
show();
