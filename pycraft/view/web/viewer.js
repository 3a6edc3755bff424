"use strict";
// The live viewer: asks the server that it came from for the state, draws it, and sends what is done. What it keeps is bounded.

const KEPT = 600; // states of the plots
const SLIDERS = 60; // sliders that are shown at once: of more, those of the picked body
const byId = (id) => document.getElementById(id);
let setup = JSON.parse(byId("data").textContent), state = null, picked = -1, busy = false, longest = {};
let figure = null, kept = [], energies = null, chosen = null, looked = 0;

async function ask(path, body) {
  const options = body ? { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } } : {};
  const answer = await fetch(path, options), told = await answer.json();
  if (told.error) throw new Error(told.error);
  return told;
}

async function act(action, given = {}) {
  try {
    await ask("/do", { action, ...given });
    byId("message").textContent = "";
  } catch (error) {
    byId("message").textContent = error.message;
  }
  await refresh();
}

// --- what is made once, and again after effects or the ghost have changed
function make(tag, parent, text = "", properties = {}) {
  const element = parent.appendChild(document.createElement(tag));
  if (text) element.textContent = text;
  return Object.assign(element, properties);
}

function build() {
  byId("said").textContent = setup.effects.filter((effect) => effect.on).map((effect) => effect.name).join(", ") || "no effects";
  byId("loops").textContent = setup.loops.length ? `the rest follows on the loops: ${setup.loops.join(", ")}` : "";
  figure.ghosts = setup.ghost ? [{ data: setup.ghost, poses: new Float32Array() }] : [];
  const ghost = byId("ghost");
  ghost.replaceChildren(new Option("none", ""), ...setup.ghosts.map((name) => new Option(name, name)));
  ghost.value = setup.ghost_name;
  byId("effects").replaceChildren();
  for (const effect of setup.effects) {
    const box = make("div", byId("effects"), "", { className: "effect" }), label = make("label", box);
    const on = make("input", label, "", { type: "checkbox", checked: effect.on, id: `on_${effect.name}` });
    label.append(` ${effect.name}`);
    on.addEventListener("change", () => act("effect", { name: effect.name, on: on.checked }));
    for (const field of effect.fields) buildField(box, effect, field);
  }
}

function buildField(box, effect, field) {
  const row = make("label", box, "", { className: "field" });
  make("span", row, field.name);
  if (!("value" in field)) return make("span", row, field.text, { title: field.text });
  const several = Array.isArray(field.value);
  const input = make("input", row, "", { id: `${effect.name}_${field.name}`, value: several ? field.value.join(", ") : field.value });
  input.addEventListener("change", () => {
    const value = several ? input.value.split(",").map(Number) : Number(input.value);
    act("parameter", { effect: effect.name, field: field.name, value });
  });
}

function buildTree() {
  const depth = [];
  setup.figure.bodies.forEach((name, k) => {
    depth.push(setup.figure.parents[k] < 0 ? 0 : depth[setup.figure.parents[k]] + 1);
    const button = make("button", byId("tree"), name, { title: `hinge ${setup.figure.hinges[k]}` });
    button.setAttribute("role", "treeitem");
    button.style.marginLeft = `${12 * Math.min(depth[k], 10)}px`;
    make("small", button, ` ${setup.figure.kinds[k]}`);
    button.addEventListener("click", () => pick(k));
  });
}

function buildSliders() {
  const all = setup.coordinates.map((coordinate, j) => ({ ...coordinate, j }));
  const shown = all.length <= SLIDERS ? all : all.filter((coordinate) => coordinate.body === picked);
  byId("sliders").replaceChildren();
  if (shown.length < all.length) make("p", byId("sliders"), `${all.length} coordinates: those of the picked body`, { className: "faint" });
  for (const coordinate of shown) {
    const box = make("label", byId("sliders"), "", { className: "slider" });
    const name = make("span", box, coordinate.name), [low, high] = [coordinate.low, coordinate.high].map((x) => +x.toPrecision(3));
    make("small", name, coordinate.bounded ? ` ${low} … ${high}` : " no limits", { className: "faint" });
    const value = make("output", box), range = make("input", box, "", {
      type: "range", min: coordinate.low, max: coordinate.high, step: "any", id: `u${coordinate.j}`,
    });
    range.setAttribute("aria-label", `${coordinate.name}, ${coordinate.unit}, from ${coordinate.low} to ${coordinate.high}`);
    let wanted = null;
    range.addEventListener("input", async () => { // the last of many moves counts
      const first = wanted === null;
      wanted = +range.value + coordinate.turns;
      if (!first) return;
      while (wanted !== null) {
        const to = wanted;
        await act("move", { coordinate: coordinate.j, to });
        if (wanted === to) wanted = null;
      }
    });
    coordinate.turns = 0; // whole turns of an angle without limits, which the slider leaves as they are
    coordinate.show = (u) => {
      value.textContent = `${u.toFixed(3)} ${coordinate.unit}`;
      if (wanted !== null) return;
      if (coordinate.unit === "rad" && !coordinate.bounded) coordinate.turns = 2 * Math.PI * Math.round(u / (2 * Math.PI));
      range.value = u - coordinate.turns;
    };
  }
  buildSliders.shown = shown;
}

// --- picking
function pick(k) {
  picked = figure.chosen = k;
  [...byId("tree").children].forEach((button, i) => button.classList.toggle("picked", i === k));
  if (k >= 0) byId("tree").children[k].scrollIntoView({ block: "nearest" });
  byId("picked_name").textContent = k < 0 ? "no body picked" : setup.figure.bodies[k];
  byId("numbers").replaceChildren();
  if (setup.coordinates.length > SLIDERS) buildSliders();
  makeChart();
  looked = 0;
  figure.draw();
  refresh();
}

function table(rows) {
  const made = document.createElement("table");
  for (const row of rows) {
    const line = make("tr", made);
    for (const x of row) make("td", line, x === null ? "-" : `${+x.toPrecision(row.length > 4 ? 3 : 4)}`, { title: `${x}` });
  }
  return made;
}

async function inspect() {
  const of = picked, name = setup.figure.bodies[of];
  if (of >= 0) {
    const body = await ask(`/body?name=${encodeURIComponent(name)}`);
    if (of !== picked) return;
    const box = document.createElement("div");
    make("div", box, `${body.kind} ${body.hinge} on ${body.parent ?? "the base"}; ${body.mass} kg`);
    const parts = [["X_WB, m", body.pose], ["velocity (angular; linear), own axes, rad/s and m/s", [body.twist]], ["centre of mass, own axes, m", [body.com]],
      ...["M", "P", "D"].map((letter) => [letter, body[letter]]), ...Object.entries(body.frames).map(([node, at]) => [`frame ${node}, m`, [at]])];
    for (const [title, rows] of parts) if (rows && rows.length && rows[0].length) {
      make("div", box, title, { className: "faint" });
      box.append(table(rows));
    }
    byId("numbers").replaceChildren(box);
  }
  const letter = byId("letter").value;
  if (letter) drawBlocks(await ask(`/blocks?of=${encodeURIComponent(letter)}`));
}

// Blocks, darker by the logarithm of their largest entry; blue positive, orange negative.
function drawBlocks({ rows, columns, values }) {
  const canvas = byId("blocks"), context = canvas.getContext("2d"), ratio = devicePixelRatio || 1;
  const side = Math.min(canvas.clientWidth, canvas.clientHeight);
  [canvas.width, canvas.height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const cell = side / Math.max(rows.length, columns.length, 1), sizes = values.flat().map(Math.abs), most = Math.max(...sizes, 1e-300);
  values.forEach((row, i) => row.forEach((x, j) => {
    const depth = x ? Math.max(0.12, 1 + Math.log10(Math.abs(x) / most) / 6) : 0;
    context.globalAlpha = 1;
    context.fillStyle = colourOf("--panel");
    context.fillRect(j * cell, i * cell, cell - 1, cell - 1);
    context.globalAlpha = depth;
    context.fillStyle = x > 0 ? colourOf("--line0") : colourOf("--line1");
    context.fillRect(j * cell, i * cell, cell - 1, cell - 1);
    context.globalAlpha = 1;
    if (cell < 42) return;
    context.fillStyle = depth > 0.6 ? colourOf("--page") : colourOf("--text");
    context.textAlign = "center";
    context.font = "11px system-ui, sans-serif";
    context.fillText(`${+x.toPrecision(3)}`, (j + 0.5) * cell, (i + 0.5) * cell + 4);
  }));
  canvas.onpointermove = (event) => {
    const [i, j] = [Math.floor(event.offsetY / cell), Math.floor(event.offsetX / cell)];
    byId("block").textContent = i < rows.length && j < columns.length ? `${rows[i]}, ${columns[j]}: ${values[i][j]}` : "";
  };
}

// --- plots
function makeChart() {
  if (chosen) chosen.box.remove();
  const what = byId("what").value, all = setup.coordinates.map((coordinate, j) => ({ ...coordinate, j }));
  const own = all.filter((coordinate) => picked >= 0 && coordinate.body === picked), shown = (own.length ? own : all).slice(0, NAMED);
  const per = { u: "", v: "/s", vdot: "/s²" }[what], units = [...new Set(shown.map((coordinate) => coordinate.unit + per))];
  const title = { u: "coordinates", v: "velocities", vdot: "accelerations" }[what];
  chosen = shown.length ? new Plot(byId("charts"), { title, axis: units.join(" and "), names: shown.map((coordinate) => coordinate.name) }) : null;
  if (chosen) chosen.of = (entry) => shown.map((coordinate) => entry[what][coordinate.j]);
  drawCharts();
}

function drawCharts() {
  const times = kept.map((entry) => entry.t);
  energies.set(times, [0, 1, 2].map((i) => kept.map((entry) => entry.energy[i])));
  if (!chosen) return;
  const rows = kept.map(chosen.of);
  chosen.set(times, chosen.panel.names.map((_, i) => rows.map((row) => row[i])));
}

// --- from moment to moment
function arrows() {
  const reach = Math.max(...setup.figure.half), units = { velocity: "m/s", force: "N" }, styles = { velocity: "--line2", force: "--line3" };
  figure.arrows = [];
  byId("longest").textContent = Object.entries(state.arrows).map(([kind, list]) => {
    const now = Math.max(0, ...list.map(([, vector]) => Math.hypot(...vector)));
    longest[kind] = Math.max(longest[kind] || 0, now); // lengths are compared over time
    const share = longest[kind] ? (0.6 * reach) / longest[kind] : 0;
    for (const [at, vector] of list) figure.arrows.push({ at, along: vector.map((x) => share * x), colour: colourOf(styles[kind]) });
    return `longest ${kind}: ${+now.toPrecision(3)} ${units[kind]}`;
  }).concat(state.missing, setup.figure.unshown).join("; ");
}

function show(now) {
  if (state && now.t < state.t) [kept, longest] = [[], {}];
  state = now;
  if (!kept.length || kept[kept.length - 1].t !== now.t) kept.push(now);
  else kept[kept.length - 1] = now;
  if (kept.length > KEPT) kept = kept.filter((_, i) => i % 2 === 0 || i > KEPT / 2); // the older half thins out
  arrows();
  figure.shade = now.shade;
  if (figure.ghosts.length && now.ghost) figure.ghosts[0].poses = numbers(now.ghost);
  figure.show(numbers(now.poses));
  buildSliders.shown.forEach((coordinate) => coordinate.show(now.u[coordinate.j]));
  drawCharts();
  byId("now").textContent = `t = ${now.t.toFixed(2)} s${now.playing && now.rate < 0.9 * now.scale ? ` (×${now.rate.toPrecision(2)})` : ""}`;
  byId("play").textContent = now.playing ? "❚❚" : "▶";
  byId("play").setAttribute("aria-label", now.playing ? "pause" : "play");
  if (document.activeElement !== byId("scale")) byId("scale").value = now.scale;
  if (now.message) byId("message").textContent = now.message;
}

async function refresh() {
  if (busy) return;
  busy = true;
  try {
    const kinds = ["velocity", "force"].filter((kind) => byId(kind).checked).join(",");
    const shade = byId("shade").value, now = await ask(`/state?arrows=${kinds}${shade && `&shade=${shade}`}`);
    if (now.edits !== setup.edits) {
      setup = await ask("/setup");
      build();
    }
    show(now);
    if (Date.now() - looked > 250) {
      looked = Date.now();
      await inspect();
    }
  } catch (error) {
    byId("message").textContent = error instanceof TypeError ? "the viewer was closed, or its process has ended" : error.message;
  }
  busy = false;
}

async function live() {
  if (!document.hidden) await refresh();
  setTimeout(live, document.hidden ? 1000 : state && state.playing ? 30 : 300);
}

figure = new Figure(byId("figure"), setup.figure, pick);
energies = new Plot(byId("charts"), { title: "energies", axis: "J", names: ["kinetic", "potential", "kinetic + potential - work"] });
byId("letter").replaceChildren(new Option("none", ""), ...setup.letters.map((letter) => new Option(letter)));
byId("letter").addEventListener("change", () => { looked = 0; refresh(); });
byId("letter").addEventListener("click", (event) => event.stopPropagation());
byId("what").addEventListener("change", makeChart);
byId("play").addEventListener("click", () => act(state.playing ? "pause" : "play"));
for (const action of ["step", "reset", "neutral", "random", "rest"]) byId(action).addEventListener("click", () => act(action));
byId("scale").addEventListener("change", (event) => act("scale", { to: +event.target.value }));
byId("ghost").addEventListener("change", (event) => act("ghost", { name: event.target.value }));
for (const kind of ["velocity", "force", "shade"]) byId(kind).addEventListener("change", refresh);
byId("solid").addEventListener("change", (event) => { figure.solid = event.target.checked; figure.draw(); });
byId("solids").hidden = !setup.figure.solids.length;
byId("said").title = setup.figure.unshown.join("; ");
byId("look").addEventListener("click", () => figure.look());
build();
buildTree();
buildSliders();
makeChart();
live();
