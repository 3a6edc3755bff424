"use strict";
// Lines over time, with units on their axis, a cursor at the present time and a legend of names.

const NAMED = 8; // lines that have names: of more, the first ones
const lineColour = (i) => colourOf(`--line${i % NAMED}`);

class Plot {
  // panel: {title, axis, names}; chosen(t): a time was clicked
  constructor(parent, panel, chosen = null) {
    const box = parent.appendChild(document.createElement("figure"));
    const more = panel.names.length - NAMED;
    const caption = box.appendChild(document.createElement("figcaption"));
    caption.textContent = `${panel.title}, ${panel.axis}${more > 0 ? ` (and ${more} more)` : ""}`;
    this.canvas = box.appendChild(document.createElement("canvas"));
    const legend = box.appendChild(document.createElement("div"));
    legend.className = "legend";
    panel.names.slice(0, NAMED).forEach((name, i) => {
      const entry = legend.appendChild(document.createElement("span"));
      entry.style.setProperty("--own", `var(--line${i})`);
      entry.textContent = name;
    });
    Object.assign(this, { box, panel, context: this.canvas.getContext("2d"), t: [], lines: [], marks: [], now: null });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${panel.title} over time`);
    if (chosen) this.canvas.addEventListener("click", (event) => {
      const [left, right] = this.sides, [first, last] = [this.t[0], this.t[this.t.length - 1]];
      chosen(first + (last - first) * Math.max(0, Math.min(1, (event.offsetX - left) / (right - left))));
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    onTheme(() => this.draw());
  }

  set(t, lines, marks = []) {
    Object.assign(this, { t, lines, marks });
    this.draw();
  }

  at(now) {
    this.now = now;
    this.draw();
  }

  range() {
    let [low, high] = [Infinity, -Infinity];
    for (const line of this.lines) for (const y of line) if (Number.isFinite(y)) { low = Math.min(low, y); high = Math.max(high, y); }
    if (low > high) return [-1, 1];
    const margin = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
    return [low - margin, high + margin];
  }

  draw() {
    const { canvas, context, t } = this, ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const [left, right, top, bottom] = [58, width - 12, 6, height - 20];
    this.sides = [left, right];
    if (!t.length) return;
    const [low, high] = this.range(), first = t[0], last = t[t.length - 1] > first ? t[t.length - 1] : first + 1;
    const x = (time) => left + ((time - first) / (last - first)) * (right - left);
    const y = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
    context.font = "11px system-ui, sans-serif";
    this.ticks(low, high, (bottom - top) / 28, (value, label) => {
      this.stroke([[left, y(value)], [right, y(value)]], colourOf("--grid"), 1);
      context.textAlign = "right";
      context.fillText(label, left - 6, y(value) + 4);
    });
    this.ticks(first, last, (right - left) / 70, (value, label) => {
      context.textAlign = "center";
      context.fillText(`${label} s`, Math.min(x(value), right - 8), height - 5);
    });
    for (const mark of this.marks) this.stroke([[x(mark), top], [x(mark), bottom]], colourOf("--faint"), 0.6);
    this.lines.forEach((line, i) => {
      context.setLineDash(i < NAMED ? [] : [4, 3]);
      this.stroke(Array.from(line, (value, k) => [x(t[k]), y(value)]), lineColour(i), 1.5);
    });
    context.setLineDash([]);
    if (this.now !== null) this.stroke([[x(this.now), top], [x(this.now), bottom]], colourOf("--chosen"), 1.5);
  }

  ticks(low, high, most, put) {
    let step = niceStep((high - low) / Math.max(most, 1.5));
    if ((high - low) / step > 2 * most) step *= 2;
    this.context.fillStyle = colourOf("--text");
    for (let k = Math.ceil(low / step); k * step <= high; k++) put(k * step, `${+(k * step).toPrecision(4)}`);
  }

  // What is not finite is not drawn.
  stroke(points, colour, width) {
    const { context } = this;
    context.beginPath();
    let drawn = false;
    for (const [x, y] of points) {
      if (Number.isFinite(y)) drawn ? context.lineTo(x, y) : context.moveTo(x, y);
      drawn = Number.isFinite(y);
    }
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
  }
}
