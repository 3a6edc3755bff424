"use strict";
// The live viewer: asks the server that it came from for the state, draws it, and sends what is done. What it keeps is bounded.

const KEPT = 600; // states of the plots
const SLIDERS = 60; // sliders that are shown at once: of more, those of the picked body
const byId = (id) => document.getElementById(id);
let setup = JSON.parse(byId("data").textContent), state = null, picked = -1, busy = false, longest = {};
let figure = null, kept = [], energies = null, chosen = null, looked = 0, looking = null;

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
  figure.extras = setup.extras;
  if (setup.camera && setup.camera.count !== looking) lookAs(setup.camera);
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

// As code has it: a direction, what is followed, and how near.
function lookAs({ direction, follow, zoom, count }) {
  looking = count;
  figure.setFollow(follow);
  figure.lookFrom(VIEWS[direction]);
  figure.zoom = zoom;
  byId("follow").value = follow;
  if (byId("direction")) byId("direction").value = direction;
  figure.draw();
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

// -1 below its lower limit, 1 above its upper one, 0 within; what is at a limit to rounding is within.
function beyondLimit({ lower, upper }, u) {
  const slack = (limit) => 1e-9 * Math.max(1, Math.abs(limit));
  return lower !== null && u < lower - slack(lower) ? -1 : upper !== null && u > upper + slack(upper) ? 1 : 0;
}

function showLimits(u) {
  const crossed = setup.coordinates.filter((coordinate, j) => beyondLimit(coordinate, u[j]));
  figure.beyond = new Set(crossed.map((coordinate) => coordinate.body));
  const more = crossed.length - 4, names = crossed.slice(0, 4).map((coordinate) => coordinate.name).join(", ");
  byId("beyond").textContent = crossed.length ? `beyond limits: ${names}${more > 0 ? ` and ${more} more` : ""}` : "";
}

function buildSliders() {
  const all = setup.coordinates.map((coordinate, j) => ({ ...coordinate, j }));
  const shown = all.length <= SLIDERS ? all : all.filter((coordinate) => coordinate.body === picked);
  byId("sliders").replaceChildren();
  if (shown.length < all.length) make("p", byId("sliders"), `${all.length} coordinates: those of the picked body`, { className: "faint" });
  for (const coordinate of shown) {
    const box = make("label", byId("sliders"), "", { className: "slider" });
    make("span", box, coordinate.name, { title: coordinate.name });
    const value = make("output", box), ends = [coordinate.lower, coordinate.upper].map((x) => (x === null ? "" : `${+x.toPrecision(3)}`));
    const below = make("small", box, ends[0], { title: coordinate.lower === null ? "no lower limit" : "lower limit" });
    const range = make("input", box, "", { type: "range", min: coordinate.low, max: coordinate.high, step: "any", id: `u${coordinate.j}` });
    const above = make("small", box, ends[1], { title: coordinate.upper === null ? "no upper limit" : "upper limit" });
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
      const side = beyondLimit(coordinate, u);
      box.classList.toggle("beyond", side !== 0);
      below.classList.toggle("crossed", side < 0);
      above.classList.toggle("crossed", side > 0);
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

// A number with so many figures in as few letters: 1.2e-5 and not 0.0000120.
function short(x, figures) {
  const plain = `${+x.toPrecision(figures)}`, power = x.toExponential(figures - 2).replace("e+", "e");
  return plain.length > figures + 4 && power.length < plain.length ? power : plain;
}

const UNITS = { M: "kg m², kg m; kg m, kg", P: "kg m², kg m; kg m, kg", D: "of the hinge's coordinates: kg m² and kg" };

function table(rows) {
  const made = document.createElement("table");
  for (const row of rows) {
    const line = make("tr", made);
    for (const x of row) make("td", line, x === null ? "-" : short(x, row.length > 4 ? 3 : 4), { title: `${x}` });
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
      ...["M", "P", "D"].map((letter) => [letter, body[letter], UNITS[letter]]), ...Object.entries(body.frames).map(([node, at]) => [`frame ${node}, m`, [at]])];
    for (const [title, rows, units] of parts) if (rows && rows.length && rows[0].length) {
      make("div", box, title, { className: "faint" }).append(...(units ? [` (${units})`] : []));
      box.append(table(rows));
    }
    byId("numbers").replaceChildren(box);
  }
  const letter = byId("letter").value;
  byId("blocks").hidden = !letter;
  if (letter) drawBlocks(await ask(`/blocks?of=${encodeURIComponent(letter)}`));
}

// Blocks, deeper by the logarithm of their largest entry; blue positive, orange negative. Names of rows and columns where they have room.
function drawBlocks({ rows, columns, values, units }) {
  const canvas = byId("blocks"), context = canvas.getContext("2d"), ratio = devicePixelRatio || 1, [width, height] = [canvas.clientWidth, canvas.clientHeight];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = "10px system-ui, sans-serif";
  const cut = (name) => (name.length > 14 ? `${name.slice(0, 6)}…${name.slice(-7)}` : name);
  const room = (names) => Math.min(86, 8 + Math.max(0, ...names.map((name) => context.measureText(cut(name)).width)));
  const [left, top] = [room(rows), room(columns)], cell = Math.min((width - left) / Math.max(columns.length, 1), (height - top) / Math.max(rows.length, 1));
  const sizes = values.flat().map(Math.abs), most = Math.max(...sizes, 1e-300), every = Math.max(1, Math.ceil(11 / cell));
  context.fillStyle = colourOf("--text");
  rows.forEach((name, i) => {
    context.textAlign = "right";
    if (i % every === 0) context.fillText(cut(name), left - 4, top + (i + 0.5) * cell + 3);
  });
  columns.forEach((name, j) => {
    if (j % every) return;
    context.save();
    context.translate(left + (j + 0.5) * cell + 3, top - 4);
    context.rotate(-Math.PI / 2);
    context.textAlign = "left";
    context.fillText(cut(name), 0, 0);
    context.restore();
  });
  values.forEach((row, i) => row.forEach((x, j) => {
    const depth = x ? Math.max(0.12, 1 + Math.log10(Math.abs(x) / most) / 6) : 0, [u, v] = [left + j * cell, top + i * cell];
    context.globalAlpha = 1;
    context.fillStyle = colourOf("--panel");
    context.fillRect(u, v, cell - 1, cell - 1);
    context.globalAlpha = depth;
    context.fillStyle = x > 0 ? colourOf("--line0") : colourOf("--line1");
    context.fillRect(u, v, cell - 1, cell - 1);
    context.globalAlpha = 1;
    const text = short(x, cell < 46 ? 2 : 3);
    if (context.measureText(text).width > cell - 4) return; // pointing at it tells it
    context.fillStyle = depth > 0.6 ? colourOf("--page") : colourOf("--text");
    context.textAlign = "center";
    context.fillText(text, u + 0.5 * cell, v + 0.5 * cell + 3);
  }));
  canvas.onpointermove = (event) => {
    const [i, j] = [Math.floor((event.offsetY - top) / cell), Math.floor((event.offsetX - left) / cell)];
    const inside = i >= 0 && j >= 0 && i < rows.length && j < columns.length;
    byId("block").textContent = inside ? `${rows[i]}, ${columns[j]}: ${values[i][j]}` : `largest entry of each block${units ? `, ${units}` : ""}`;
  };
  if (!byId("block").textContent) byId("block").textContent = `largest entry of each block${units ? `, ${units}` : ""}`;
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
  const reach = Math.max(...setup.figure.half), units = { velocity: "m/s", force: "N" };
  figure.arrows = [];
  const said = byId("longest");
  said.replaceChildren();
  for (const [kind, list] of Object.entries(state.arrows)) {
    const now = Math.max(0, ...list.map(([, vector]) => Math.hypot(...vector)));
    longest[kind] = Math.max(longest[kind] || 0, now); // lengths are compared over time
    const share = longest[kind] ? (0.6 * reach) / longest[kind] : 0;
    for (const [at, vector] of list) figure.arrows.push({ at, along: vector.map((x) => share * x), colour: colourOf(`--${kind}`) });
    make("span", said, `→ longest ${kind}: ${+now.toPrecision(3)} ${units[kind]}`, { className: kind });
  }
  if (state.push) {
    const size = Math.hypot(...state.push.force), share = state.push.most ? (0.6 * reach) / state.push.most : 0;
    figure.arrows.push({ at: state.push.at, along: state.push.force.map((x) => share * x), colour: colourOf("--chosen") });
    make("span", said, `→ push: ${+size.toPrecision(3)} N`);
  }
  if (setup.ghost) make("span", said, `▪ ghost: ${setup.ghost_name}`).style.color = "var(--ghost)";
  said.append(state.missing.join("; "));
}

function show(now) {
  if (state && now.t < state.t) [kept, longest] = [[], {}];
  state = now;
  if (!kept.length || kept[kept.length - 1].t !== now.t) kept.push(now);
  else kept[kept.length - 1] = now;
  if (kept.length > KEPT) kept = kept.filter((_, i) => i % 2 === 0 || i > KEPT / 2); // the older half thins out
  arrows();
  showLimits(now.u);
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

// --- a body held by the pointer: pushed while the scene plays, or led by inverse kinematics
const hands = {
  kind: "", sent: null,
  holding(event) {
    this.kind = event.ctrlKey || event.metaKey ? "push" : event.altKey ? "lead" : byId("hand").value;
    return this.kind !== "";
  },
  begin(body, place) {
    pick(body);
    if (this.kind === "push") act("push", { body: setup.figure.bodies[body], place, to: placed(figure.poses, body, place) });
    if (this.kind === "push" && !state.playing) act("play");
  },
  async move(body, place, to) { // the last of many moves counts
    const waits = this.sent !== null;
    this.sent = { body: setup.figure.bodies[body], place, to };
    if (waits) return;
    while (this.sent !== null) {
      const now = this.sent;
      await act(this.kind, now);
      if (this.sent === now) this.sent = null;
    }
  },
  end() {
    this.sent = null;
    if (this.kind === "push") act("let_go");
  },
};

figure = new Figure(byId("figure"), setup.figure, pick, hands);
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
byId("hand").addEventListener("change", (event) => { byId("figure").style.cursor = event.target.value ? "crosshair" : ""; });
cameraControls(figure, byId("camera"), setup.figure.name);
build();
buildTree();
buildSliders();
makeChart();
live();
