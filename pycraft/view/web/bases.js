"use strict";
// One motion seen from another base body: the slider chooses the base, the figure stays, and numbers say what changes.

const told = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const figure = new Figure(byId("figure"), told.figure, (body) => { if (told.bases.includes(body)) show(told.bases.indexOf(body)); });
figure.poses = numbers(told.poses);

function element(tag, parent, text = "", properties = {}) {
  const made = parent.appendChild(document.createElement(tag));
  if (text) made.textContent = text;
  return Object.assign(made, properties);
}

// Differences of rounding in two digits, numbers in eight: what stays is seen to stay.
const shown = (name, x) => (name.startsWith("largest") ? (x ? x.toExponential(0) : "0") : `${+x.toPrecision(8)}`);

function table(id, rows, base) {
  byId(id).replaceChildren();
  for (const [name, values] of Object.entries(rows)) {
    const line = element("tr", byId(id));
    element("td", line, name);
    element("td", line, shown(name, values[base]), { className: "number" });
  }
}

function felt(base) {
  const most = Math.max(...told.felt.flat(), 1e-300);
  byId("felt").replaceChildren();
  told.bases.forEach((body, i) => {
    const line = element("tr", byId("felt"), "", { className: i === base ? "chosen" : "" });
    element("td", line, told.figure.bodies[body]);
    const bar = element("div", element("td", line), "", { className: "parts" });
    const [all, out] = [told.felt[base][i], told.outboard[base][i]];
    for (const [name, size] of [["outboard", out], ["inboard", Math.max(0, all - out)]]) {
      element("span", bar, "", { className: name, title: `${name}: ${size.toPrecision(4)} kg` }).style.width = `${(100 * size) / most}%`;
    }
    element("td", line, `${out.toPrecision(4)} + ${Math.abs(all - out) < 1e-9 * all ? 0 : (all - out).toPrecision(4)} = ${all.toPrecision(4)}`, { className: "number" });
  });
}

function show(base) {
  const body = told.bases[base];
  byId("base").value = base;
  byId("now").textContent = told.figure.bodies[body];
  figure.chosen = body;
  figure.shade = { values: told.figure.bodies.map((_, k) => (told.bases.includes(k) ? told.outboard[base][told.bases.indexOf(k)] : NaN)),
    low: 0, high: Math.max(...told.outboard.flat()), label: "P(k), kg: what the body carries, with itself" };
  figure.arrows = told.parents[base].flatMap((parent, k) => (parent < 0 ? [] : [{ at: told.places[parent], colour: colourOf("--chosen"),
    along: told.places[k].map((x, i) => x - told.places[parent][i]) }]));
  figure.draw();
  table("changes", told.changes, base);
  table("stays", told.stays, base);
  felt(base);
}

byId("base").max = told.bases.length - 1;
byId("base").addEventListener("input", (event) => show(+event.target.value));
byId("look").addEventListener("click", () => figure.look());
onTheme(() => show(+byId("base").value));
show(0);
