"use strict";
// A smoother over time and forward dynamics of a chain, by one recursion: step by step, each equation with its numbers on both sides.

const told = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id), last = told.steps.length - 1;
const figure = new Figure(byId("figure"), told.figure), track = byId("track");
figure.poses = numbers(told.poses);
const masses = told.steps.filter((step) => step[6] !== null).map((step) => step[6]);
let now = 0, timer = null, seen = 0; // seen: which of what is measured at each step is drawn

const rows = told.words.map(([letter, filter, mechanics]) => {
  const row = byId("rows").insertRow(), first = told.steps.find((step) => step[3] === letter);
  row.insertCell().textContent = first ? told.lines[first[0]].trim() : letter;
  row.insertCell().textContent = filter;
  row.insertCell();
  row.insertCell().textContent = mechanics;
  row.insertCell();
  return { letter, row };
});

// What is known by now of each time step: its prediction after ε, its smoothed value after α.
function known() {
  const found = { predicted: new Set(), smoothed: new Set() };
  for (const [, t, , letter] of told.steps.slice(0, now + 1)) {
    if (letter === "ε") found.predicted.add(t);
    if (letter === "α") found.smoothed.add(t);
  }
  return found;
}

function drawTrack() {
  const context = track.getContext("2d"), ratio = devicePixelRatio || 1, [width, height] = [track.clientWidth, track.clientHeight];
  if (!width || !height) return;
  [track.width, track.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [measured, predicted, smoothed, deviation] = [told.measured, told.predicted, told.smoothed, told.deviation].map((rows) => rows[seen]);
  const all = [...measured, ...smoothed, ...predicted.flatMap((z, t) => [z - 2 * (deviation[t] || 0), z + 2 * (deviation[t] || 0)])]
    .filter((x) => x !== null);
  const [low, high] = [Math.min(...all), Math.max(...all)], [left, right, top, bottom] = [66, width - 14, 10, height - 36];
  const count = measured.length, x = (t) => left + ((t + 0.5) / count) * (right - left);
  const y = (value) => bottom - ((value - low) / (high - low || 1)) * (bottom - top);
  const step = niceStep((high - low || 1) / 4);
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = colourOf("--text");
  context.strokeStyle = colourOf("--grid");
  context.lineWidth = 1;
  context.textAlign = "right";
  for (let k = Math.ceil(low / step); k * step <= high; k++) {
    context.beginPath();
    context.moveTo(left, y(k * step));
    context.lineTo(right, y(k * step));
    context.stroke();
    context.fillText(`${+(k * step).toPrecision(4)}`, left - 6, y(k * step) + 4);
  }
  context.textAlign = "center";
  const every = Math.max(1, Math.ceil(count / 12));
  for (let t = 0; t < count; t += every) context.fillText(`${t}`, x(t), height - 20);
  context.fillText("time step t", (left + right) / 2, height - 5);
  context.save();
  context.translate(12, (top + bottom) / 2);
  context.rotate(-Math.PI / 2);
  context.fillText(told.measured.length > 1 ? `measurement y${seen + 1}(t)` : "measurement y(t)", 0, 0);
  context.restore();
  const here = told.steps[now][1], found = known();
  context.fillStyle = colourOf("--panel");
  context.fillRect(x(here) - 0.5 * (x(1) - x(0)), top, x(1) - x(0), bottom - top);
  const dot = (t, value, colour, radius) => {
    if (value === null) return;
    context.beginPath();
    context.arc(x(t), y(value), radius, 0, 2 * Math.PI);
    context.fillStyle = colourOf(colour);
    context.fill();
  };
  for (const t of found.predicted) {
    context.strokeStyle = colourOf("--line0");
    context.lineWidth = 3;
    context.globalAlpha = 0.45;
    if (deviation[t] !== null) {
      context.beginPath();
      context.moveTo(x(t), y(predicted[t] - 2 * deviation[t]));
      context.lineTo(x(t), y(predicted[t] + 2 * deviation[t]));
      context.stroke();
    }
    context.globalAlpha = 1;
    dot(t, predicted[t], "--line0", 4);
    dot(t, measured[t], "--text", 3);
  }
  context.strokeStyle = colourOf("--line2");
  context.lineWidth = 2;
  context.beginPath();
  for (const t of [...found.smoothed].sort((a, b) => a - b)) context.lineTo(x(t), y(smoothed[t]));
  context.stroke();
  for (const t of found.smoothed) dot(t, smoothed[t], "--line2", 4);
}

function show(k) {
  now = k;
  const [line, t, body, letter] = told.steps[k], values = Array(told.figure.bodies.length).fill(NaN);
  for (const { letter: own, row } of rows) { // the newest of each letter: of this body, or what was handed on
    const at = told.steps.findLastIndex((step, i) => i <= k && step[3] === own && step[2] === body);
    for (const side of [0, 1]) row.cells[2 + 2 * side].textContent = row.cells[2 + 2 * side].title = at < 0 ? "" : told.steps[at][4 + side];
    row.classList.toggle("lit", own === letter);
    if (own !== letter) continue;
    row.cells[0].textContent = told.lines[line].trim();
    const box = byId("table"), [from, to] = [row.offsetTop - box.offsetTop, row.offsetTop - box.offsetTop + row.offsetHeight];
    if (from < box.scrollTop || to > box.scrollTop + box.clientHeight) box.scrollTop = to - box.clientHeight; // the page itself stays
  }
  for (const [, , of, , , , mass] of told.steps.slice(0, k + 1)) if (mass !== null) values[of] = mass;
  figure.shade = { values, low: 0, high: Math.max(...masses), label: "P(k) known by now, kg" };
  figure.chosen = body;
  figure.draw();
  drawTrack();
  byId("at_time").textContent = `at t = ${t}`;
  byId("at_body").textContent = `at ${told.names[body]}`;
  byId("time").value = k;
  byId("now").textContent = `${k + 1} of ${last + 1}`;
}

function stop() {
  clearInterval(timer);
  timer = null;
  byId("play").textContent = "▶";
  byId("play").setAttribute("aria-label", "play");
}

function start() {
  if (now === last) show(0);
  byId("play").textContent = "❚❚";
  byId("play").setAttribute("aria-label", "pause");
  timer = setInterval(() => (now === last ? stop() : show(now + 1)), 1000 / byId("pace").value);
}

byId("of").hidden = told.measured.length < 2;
told.measured.forEach((_, row) => byId("row").add(new Option(row + 1, row)));
byId("row").addEventListener("change", () => { seen = +byId("row").value; drawTrack(); });
byId("time").max = last;
byId("time").addEventListener("input", (event) => { stop(); show(+event.target.value); });
byId("play").addEventListener("click", () => (timer ? stop() : start()));
byId("back").addEventListener("click", () => { stop(); show(Math.max(0, now - 1)); });
byId("next").addEventListener("click", () => { stop(); show(Math.min(last, now + 1)); });
byId("pace").addEventListener("change", () => { if (timer) { stop(); start(); } });
new ResizeObserver(drawTrack).observe(track);
onTheme(drawTrack);
show(last);
