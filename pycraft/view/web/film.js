"use strict";
// A run that plays: poses of frames, a slider of time, plots with a cursor.

const film = JSON.parse(document.getElementById("data").textContent);
const poses = numbers(film.poses), times = numbers(film.times), way = film.way ? numbers(film.way) : null;
const count = times.length, width = 12 * film.figure.bodies.length;
const byId = (id) => document.getElementById(id);
const figure = new Figure(byId("figure"), film.figure);
const plots = film.panels.map((panel) => {
  const plot = new Plot(byId("plots"), panel, (t) => { stop(); show(frameAt(t)); });
  plot.set(numbers(panel.t), panel.lines.map(numbers), film.marks);
  return plot;
});
let frame = 0, playing = false, since = 0, began = 0;

function frameAt(t) {
  let [low, high] = [0, count - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + 1e-6 * Math.abs(t)) low = middle; else high = middle - 1;
  }
  return low;
}

function show(k) {
  frame = k;
  if (way) figure.way = Array.from({ length: k + 1 }, (_, i) => way.subarray(3 * i, 3 * i + 3));
  figure.beyond = new Set(film.beyond.filter(({ spans }) => spans.some(([first, last]) => first <= k && k <= last)).map(({ body }) => body));
  figure.show(poses.subarray(width * k, width * (k + 1)));
  plots.forEach((plot) => plot.at(times[k]));
  byId("time").value = k;
  byId("now").textContent = `t = ${times[k].toFixed(2)} s`;
}

function step(stamp) {
  if (!playing) return;
  if (!since) [since, began] = [stamp, times[frame]];
  const t = began + ((stamp - since) / 1000) * byId("speed").value;
  show(frameAt(t));
  if (frame === count - 1) return stop();
  requestAnimationFrame(step);
}

function start() {
  if (frame === count - 1) show(0);
  [playing, since] = [true, 0];
  byId("play").textContent = "❚❚";
  byId("play").setAttribute("aria-label", "pause");
  requestAnimationFrame(step);
}

function stop() {
  playing = false;
  byId("play").textContent = "▶";
  byId("play").setAttribute("aria-label", "play");
}

byId("time").max = count - 1;
byId("time").addEventListener("input", (event) => { stop(); show(+event.target.value); });
byId("play").addEventListener("click", () => (playing ? stop() : start()));
byId("speed").addEventListener("change", () => { since = 0; });
if (film.follow) figure.follow = film.follow;
cameraControls(figure, byId("camera"), film.figure.name);
document.addEventListener("keydown", (event) => {
  if (["SELECT", "INPUT", "BUTTON"].includes(event.target.tagName)) return;
  if (event.key === " ") playing ? stop() : start();
  else if (event.key === "ArrowRight") { stop(); show(Math.min(frame + 1, count - 1)); }
  else if (event.key === "ArrowLeft") { stop(); show(Math.max(frame - 1, 0)); }
  else return;
  event.preventDefault();
});
show(0);
