"use strict";
// A model on a canvas: its shapes, and a stick figure of what has none, placed by the bodies' poses and seen by a camera that is turned (drag),
// moved (Shift and drag, or two fingers) and brought nearer (wheel, or two fingers), toward the pointer. The projection is parallel
// (orthographic): lengths in the plane of the picture are true.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

// Colours of the style sheet by name, looked up once, and again when the theme changes.
let colours = {};
const colourOf = (name) => (colours[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim());
onTheme(() => { colours = {}; });

// Single-precision numbers from text, little-endian as every browser's machine.
function numbers(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

// A point (owner, place) in the world: poses are rows of [R p], 12 numbers a body; the base, -1, stands still.
function placed(poses, owner, p) {
  if (owner < 0) return p;
  const X = poses.subarray(12 * owner, 12 * owner + 12);
  return [0, 4, 8].map((i) => X[i] * p[0] + X[i + 1] * p[1] + X[i + 2] * p[2] + X[i + 3]);
}
function turned(poses, owner, d) {
  if (owner < 0) return d;
  const X = poses.subarray(12 * owner, 12 * owner + 12);
  return [0, 4, 8].map((i) => X[i] * d[0] + X[i + 1] * d[1] + X[i + 2] * d[2]);
}

// Directions that the figure is seen from: yaw and pitch, rad.
const VIEWS = { "from above": [0.6, 0.35], "side": [0, 0], "front": [Math.PI / 2, 0], "back": [-Math.PI / 2, 0], "top": [0, Math.PI / 2] };
const TINTS = 64; // of a colour by the light
const SEAM = 0.7; // pixels that triangles reach over their edges
const NEAREST = 400, FARTHEST = 0.02; // of the zoom, 1 at first

class Figure {
  // data: what pycraft/view/figure_data.py says of a model; picked(body): a body was clicked, -1 for none; hands: what a body that is held by
  // the pointer is told to, { holding(event): whether it is held and not turned, begin(body, place), move(body, place, to), end(body) }, places in
  // the body's frame and the world
  constructor(canvas, data, picked = () => {}, hands = null) {
    Object.assign(this, {
      canvas, data, picked, hands, poses: new Float32Array(), ghosts: [], arrows: [], way: null, chosen: -1, shade: null, solid: true,
      sticks: !data.solids.length, beyond: new Set(), extras: [], follow: "", opaque: false,
    });
    this.context = canvas.getContext("2d");
    this.look();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // The camera as at first: the plane of a flat model, else from the side and above.
  look() {
    [this.yaw, this.pitch] = this.data.flat ? [0, 0] : VIEWS["from above"];
    this.zoom = 1;
    this.centre = this.followed() || this.data.centre;
    this.draw();
  }

  lookFrom([yaw, pitch]) {
    [this.yaw, this.pitch] = [yaw, pitch];
    this.draw();
  }

  // "" nothing, "robot" the middle of its bodies, or the number of a body: the camera goes with it.
  setFollow(what) {
    this.follow = what;
    this.look();
  }

  // Where what the camera follows is; null where it follows nothing.
  followed() {
    if (this.follow === "" || this.poses.length < 12) return null;
    const count = this.data.bodies.length, of = this.follow === "robot" ? [...Array(count).keys()] : [+this.follow];
    return [3, 7, 11].map((i) => of.reduce((sum, k) => sum + this.poses[12 * k + i], 0) / of.length);
  }

  basis() {
    const [right, up] = [this.data.right, this.data.up], front = cross(right, up);
    const [c, s] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const level = along(right.map((x) => s * x), c, front);
    const toward = along(level.map((x) => Math.cos(this.pitch) * x), Math.sin(this.pitch), up);
    const across = along(right.map((x) => c * x), -s, front);
    return [across, cross(toward, across), toward];
  }

  listen() {
    const { canvas } = this, fingers = new Map();
    let moved = 0, held = null;
    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
      canvas.setPointerCapture(event.pointerId);
      moved = 0;
      if (fingers.size > 1) return this.release(held), (held = null);
      const hit = this.hands?.holding(event) ? this.hitAt(event.offsetX, event.offsetY) : { body: -1 };
      if (hit.body < 0) return;
      const at = this.unseen(event.offsetX, event.offsetY, hit.depth);
      held = { body: hit.body, at, place: withinBody(this.poses, hit.body, at) };
      this.hands.begin(held.body, held.place);
    });
    canvas.addEventListener("pointermove", (event) => {
      const from = fingers.get(event.pointerId), to = [event.offsetX, event.offsetY];
      if (!from) return;
      const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
      if (fingers.size === 2) return this.pinch(fingers, event.pointerId, to);
      fingers.set(event.pointerId, to);
      moved += Math.abs(dx) + Math.abs(dy);
      if (moved < 4) return;
      if (held) { // in the plane of the picture through the place that is held
        held.at = this.unseen(...to, this.seen(held.at)[2]);
        this.hands.move(held.body, held.place, held.at);
        return;
      }
      if (event.shiftKey || event.buttons > 1) {
        this.shift(dx, dy);
      } else {
        this.yaw -= 0.008 * dx;
        this.pitch = Math.max(-1.57, Math.min(1.57, this.pitch + 0.008 * dy));
      }
      this.draw();
    });
    const lifted = (event) => {
      if (event.type === "pointerup" && fingers.size === 1 && moved < 4 && !held) this.picked(this.bodyAt(event.offsetX, event.offsetY));
      fingers.delete(event.pointerId);
      this.release(held);
      held = null;
    };
    canvas.addEventListener("pointerup", lifted);
    canvas.addEventListener("pointercancel", lifted);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomAt(event.offsetX, event.offsetY, Math.exp(-0.0012 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.look());
    onTheme(() => this.draw());
  }

  release(held) {
    if (held) this.hands.end(held.body);
  }

  // Two fingers: what is between them stays between them.
  pinch(fingers, id, to) {
    const other = [...fingers].find(([known]) => known !== id)[1], from = fingers.get(id);
    const apart = (a) => Math.max(1, Math.hypot(a[0] - other[0], a[1] - other[1]));
    const factor = apart(to) / apart(from);
    fingers.set(id, to);
    this.shift((to[0] - from[0]) / 2, (to[1] - from[1]) / 2);
    this.zoomAt((to[0] + other[0]) / 2, (to[1] + other[1]) / 2, factor);
  }

  // The picture by some pixels.
  shift(dx, dy) {
    const [across, up] = this.basis();
    this.centre = along(along(this.centre, -dx / this.scale, across), dy / this.scale, up);
  }

  // Nearer or farther, and what is seen at a place of the picture stays there.
  zoomAt(x, y, factor) {
    const zoom = Math.max(FARTHEST, Math.min(NEAREST, factor * this.zoom)), less = (1 - this.zoom / zoom) / this.scale;
    const [across, up] = this.basis(), { clientWidth: width, clientHeight: height } = this.canvas;
    this.centre = along(along(this.centre, (x - width / 2) * less, across), (height / 2 - y) * less, up);
    this.zoom = zoom;
    this.draw();
  }

  // The point in the world that is seen at a place of the picture, at a depth as `seen` gives it.
  unseen(x, y, depth) {
    const [across, up, toward] = this.basis(), { clientWidth: width, clientHeight: height } = this.canvas;
    return along(along(along(this.centre, (x - width / 2) / this.scale, across), (height / 2 - y) / this.scale, up), depth, toward);
  }

  // Pixels a metre, and where things are seen.
  prepare() {
    const { canvas, data } = this, ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    }
    const half = this.follow === "" ? data.half : data.near; // what is followed fills the picture, not its way
    const span = (axis) => 2 * axis.reduce((sum, x, i) => sum + Math.abs(x) * half[i], 0);
    const axes = (this.axes = this.basis());
    this.scale = this.zoom * 0.9 * Math.min(width / span(axes[0]), height / span(axes[1]));
    this.seen = (p) => {
      const d = along(p, -1, this.centre);
      return [width / 2 + this.scale * dot(d, axes[0]), height / 2 - this.scale * dot(d, axes[1]), dot(d, axes[2])];
    };
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.context.clearRect(0, 0, width, height);
    if (!this.opaque) return;
    this.context.fillStyle = colourOf("--page"); // films and pictures have no page behind them
    this.context.fillRect(0, 0, width, height);
  }

  show(poses) {
    const before = this.followed();
    this.poses = poses;
    const now = this.followed();
    if (now) this.centre = before ? along(along(this.centre, 1, now), -1, before) : now;
    this.draw();
  }

  draw() {
    if (!this.canvas.clientWidth || !this.canvas.clientHeight) return;
    this.prepare();
    if (!this.data.flat) this.drawFloor();
    if (this.way) this.drawLine(this.way, colourOf("--way"), 1.2);
    for (const ghost of this.ghosts) this.drawModel(ghost.data, ghost.poses, 0.4, colourOf("--ghost"));
    this.drawModel(this.data, this.poses, 1, null);
    if (this.chosen >= 0 && this.poses.length) this.drawFrame(this.chosen);
    for (const arrow of this.arrows) this.drawArrow(arrow);
    for (const extra of this.extras) this.drawExtra(extra);
    this.drawScale();
    if (this.shade) this.drawShade();
  }

  drawLine(points, colour, width) {
    const { context } = this;
    context.beginPath();
    for (const point of points) context.lineTo(...this.seen(point).slice(0, 2));
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
  }

  drawFloor() {
    const { floor, half, near, right, up } = this.data, front = cross(right, up), follows = this.follow !== "";
    const reach = Math.max(...(follows ? near : half)), pitch = niceStep(reach / 4), lines = 6, centre = follows ? this.centre : this.data.centre;
    const onGrid = (axis) => pitch * Math.round(dot(centre, axis) / pitch); // the lines stand still under a camera that goes
    const middle = along(along(up.map((x) => floor * x), onGrid(right), right), onGrid(front), front);
    for (let i = -lines; i <= lines; i++) {
      for (const [a, b] of [[right, front], [front, right]]) {
        const at = along(middle, i * pitch, a);
        this.drawLine([along(at, -lines * pitch, b), along(at, lines * pitch, b)], colourOf("--grid"), 1);
      }
    }
  }

  // A length in the picture, in metres.
  drawScale() {
    const { context } = this, height = this.canvas.clientHeight, length = niceStep(90 / this.scale);
    context.fillStyle = context.strokeStyle = colourOf("--faint");
    context.lineWidth = 1.5;
    context.setLineDash([]);
    context.strokeRect(14, height - 14, length * this.scale, 0);
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "left";
    context.fillText(`${+length.toPrecision(6)} m`, 14, height - 20);
  }

  // The axes of a body's frame, with their names.
  drawFrame(body) {
    const { context } = this, origin = placed(this.poses, body, [0, 0, 0]), length = Math.max(2 * this.data.tick, 34 / this.scale);
    ["x", "y", "z"].forEach((name, i) => {
      const d = turned(this.poses, body, [0, 1, 2].map((j) => (i === j ? length : 0))), colour = colourOf(`--line${[1, 2, 0][i]}`);
      this.drawArrow({ at: origin, along: d, colour });
      const [x, y] = this.seen(along(origin, 1.18, d));
      context.fillStyle = colour;
      context.font = "12px system-ui, sans-serif";
      context.textAlign = "center";
      context.fillText(name, x, y + 4);
    });
  }

  // The colours of numbers: a strip with the numbers of its ends and what they are of.
  drawShade() {
    const { context } = this, { low, high, label } = this.shade, [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const long = Math.min(240, 0.5 * width), [left, top] = [width - long - 14, height - 30];
    const gradient = context.createLinearGradient(left, 0, left + long, 0);
    this.data.ramp.forEach((stop, i) => gradient.addColorStop(i / (this.data.ramp.length - 1), stop));
    context.fillStyle = gradient;
    context.fillRect(left, top, long, 10);
    context.fillStyle = colourOf("--text");
    context.font = "12px system-ui, sans-serif";
    for (const [share, align] of [[0, "left"], [0.5, "center"], [1, "right"]]) {
      context.textAlign = align;
      context.fillText(`${+(low + share * (high - low)).toPrecision(3)}`, left + share * long, height - 6);
    }
    context.textAlign = "right";
    context.fillText(label, left + long, top - 6);
    context.textAlign = "left";
  }

  // The colour of a body by its number in `shade`: { values, low, high, label }; null where there is none.
  shadeOf(body) {
    if (!this.shade || body < 0) return null;
    const { values, low, high } = this.shade, { ramp } = this.data, value = values[body];
    if (!Number.isFinite(value)) return colourOf("--faint");
    const place = (ramp.length - 1) * Math.max(0, Math.min(1, high > low ? (value - low) / (high - low) : 0));
    const k = Math.min(Math.floor(place), ramp.length - 2), part = (stop, i) => parseInt(stop.slice(i, i + 2), 16);
    return `rgb(${[1, 3, 5].map((i) => Math.round(part(ramp[k], i) + (place - k) * (part(ramp[k + 1], i) - part(ramp[k], i)))).join(", ")})`;
  }

  drawModel(data, poses, alpha, colour) {
    if (poses.length < 12 * data.bodies.length) return;
    const { context } = this, items = [], solids = colour ? data.solids : [...data.solids, ...this.extras.flatMap((extra) => extra.solids || [])];
    const clad = this.solid && !this.sticks ? new Set(data.solids.map((solid) => solid.of)) : new Set(); // bodies that are seen by their shapes
    const width = Math.min(3.5, Math.max(1, 3.5 * (20 / Math.max(data.bodies.length, 1)) ** 0.4));
    const styles = { ground: ["--faint", 0.5, [2, 4]], tie: ["--tie", 0.4, []], slide: ["--slide", 0.7, [5, 3]], bone: ["--bone", 1, []] };
    for (const [kind, [name, share, dashes]] of Object.entries(styles)) {
      if (kind === "ground" && !data.grounded) continue;
      const { of, at } = data.lines[kind];
      of.forEach((owners, i) => {
        if (clad.has(owners[kind === "slide" || kind === "ground" ? 1 : 0])) return;
        const ends = owners.map((owner, j) => this.seen(placed(poses, owner, at[i][j])));
        const own = !colour && kind === "bone" && owners.includes(this.chosen) && owners[0] === this.chosen;
        items.push({ depth: (ends[0][2] + ends[1][2]) / 2, ends, stroke: colour || (own ? colourOf("--chosen") : (kind === "bone" && this.shadeOf(owners[0])) || colourOf(name)),
          width: width * share * (own ? 1.6 : 1), dashes, body: owners[0] });
      });
    }
    const size = data.tick;
    data.axes.of.forEach((owner, i) => {
      if (clad.has(data.axes.hinge[i])) return;
      const p = placed(poses, owner, data.axes.at[i]), d = turned(poses, owner, data.axes.along[i]);
      const ends = [this.seen(along(p, -size, d)), this.seen(along(p, size, d))];
      items.push({ depth: (ends[0][2] + ends[1][2]) / 2, ends, stroke: colour || data.colours[data.axes.hinge[i]] || colourOf("--text"), width: 0.6 * width, dashes: [], body: -1 });
    });
    const joints = data.points.joint.of.map((owner, i) => this.seen(placed(poses, owner, data.points.joint.at[i])));
    joints.forEach((at, i) => {
      const beyond = !colour && this.beyond.has(i);
      if (clad.has(i) && !beyond) return;
      const fill = beyond ? colourOf("--beyond") : colour || this.shadeOf(i) || data.colours[i] || colourOf("--text");
      items.push({ depth: at[2], dot: at, fill, body: i, radius: (beyond ? 2.6 : 1.7) * width });
    });
    for (const [kind, share] of [["node", 0.9]]) {
      const { of, at } = data.points[kind];
      of.forEach((owner, i) => {
        if (clad.has(owner)) return;
        const seen = this.seen(placed(poses, owner, at[i]));
        items.push({ depth: seen[2], dot: seen, fill: colour || colourOf("--tie"), body: owner, radius: share * width });
      });
    }
    if (data.grounded && !clad.size) { // the base
      const seen = this.seen([0, 0, 0]);
      items.push({ depth: seen[2], dot: seen, fill: colourOf("--faint"), body: -1, radius: 1.3 * width });
    }
    items.sort((a, b) => a.depth - b.depth);
    context.globalAlpha = alpha;
    const faces = this.solid && solids.length ? this.faces(solids, poses, colour) : [];
    for (const face of faces) this.drawFace(face);
    if (!colour) this.drawn = faces;
    context.lineCap = "round";
    for (const item of items) this.drawItem(item);
    context.setLineDash([]);
    context.globalAlpha = 1;
    if (!colour) this.items = items;
  }

  // Triangles of the bodies' shapes as they are seen, from back to front, lit from where they are looked at: { depth, points, body, fill },
  // points the three places in the picture one after the other, depth three times their average.
  faces(solids, poses, colour) {
    const found = [], { axes, scale, centre } = this, [left, top] = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    for (const solid of solids) {
      solid.read ??= { vertices: numbers(solid.vertices), faces: numbers(solid.faces) };
      const { vertices, faces } = solid.read, X = solid.of < 0 ? null : poses.subarray(12 * solid.of, 12 * solid.of + 12);
      const rows = axes.map((e) => (X ? [0, 1, 2].map((j) => e[0] * X[j] + e[1] * X[4 + j] + e[2] * X[8 + j]) : e)); // of the body's axes
      const [u0, v0, w0] = axes.map((e) => dot(e, along(X ? [X[3], X[7], X[11]] : [0, 0, 0], -1, centre)));
      const seen = (solid.seen ??= new Float64Array(vertices.length)), [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = rows;
      for (let i = 0; i < vertices.length; i += 3) {
        const [x, y, z] = [vertices[i], vertices[i + 1], vertices[i + 2]];
        seen[i] = left + scale * (a0 * x + a1 * y + a2 * z + u0);
        seen[i + 1] = top - scale * (b0 * x + b1 * y + b2 * z + v0);
        seen[i + 2] = c0 * x + c1 * y + c2 * z + w0;
      }
      const tints = this.tintsOf(solid, colour);
      for (let i = 0; i < faces.length; i += 3) {
        const [a, b, c] = [3 * faces[i], 3 * faces[i + 1], 3 * faces[i + 2]], [ax, ay, az] = [seen[a], seen[a + 1], seen[a + 2]];
        const [ux, uy, uz] = [seen[b] - ax, seen[b + 1] - ay, (seen[b + 2] - az) * scale], [vx, vy, vz] = [seen[c] - ax, seen[c + 1] - ay, (seen[c + 2] - az) * scale];
        const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], size = Math.sqrt(nx * nx + ny * ny + nz * nz);
        if (!(size > 1e-9)) continue;
        const fill = tints[Math.round((TINTS - 1) * (Math.abs(nz) / size))]; // of both sides: meshes do not all say which is out
        found.push({ depth: az + seen[b + 2] + seen[c + 2], points: [ax, ay, seen[b], seen[b + 1], seen[c], seen[c + 1]], body: solid.of, fill });
      }
    }
    return found.sort((one, other) => one.depth - other.depth);
  }

  // A solid's colour from seen edgewise to seen from the front.
  tintsOf(solid, colour) {
    const own = colour || (solid.of === this.chosen && solid.of >= 0 ? colourOf("--chosen") : this.shadeOf(solid.of)) || solid.colour || colourOf("--solid");
    if (solid.tints?.own === own) return solid.tints;
    const parts = (own.match(/^#/) ? [1, 3, 5].map((i) => parseInt(own.slice(i, i + 2), 16)) : own.match(/[\d.]+/g).map(Number)).slice(0, 3);
    solid.tints = Array.from({ length: TINTS }, (_, i) => `rgb(${parts.map((x) => Math.round((0.45 + 0.55 * (i / (TINTS - 1))) * x)).join(", ")})`);
    solid.tints.own = own;
    return solid.tints;
  }

  drawFace({ points: [ax, ay, bx, by, cx, cy], fill }) {
    const { context } = this, [mx, my] = [(ax + bx + cx) / 3, (ay + by + cy) / 3];
    const out = (x, y) => { // a little farther from the middle: no light between neighbours
      const more = 1 + SEAM / (Math.abs(x - mx) + Math.abs(y - my) + SEAM);
      context.lineTo(mx + more * (x - mx), my + more * (y - my));
    };
    context.beginPath();
    out(ax, ay);
    out(bx, by);
    out(cx, cy);
    context.fillStyle = fill;
    context.fill();
  }

  drawItem({ ends, dot: at, stroke, fill, width, dashes, radius, body }) {
    const { context } = this;
    context.beginPath();
    if (ends) {
      context.setLineDash(dashes);
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.moveTo(ends[0][0], ends[0][1]);
      context.lineTo(ends[1][0], ends[1][1]);
      context.stroke();
      return;
    }
    context.setLineDash([]);
    context.arc(at[0], at[1], radius * (body >= 0 && body === this.chosen ? 1.5 : 1), 0, 2 * Math.PI);
    context.fillStyle = fill;
    context.fill();
    context.strokeStyle = colourOf("--page");
    context.lineWidth = 1;
    context.stroke();
  }

  // { at, along, colour }: from a point along a vector, both in metres
  drawArrow({ at, along: vector, colour }) {
    const { context } = this, [x, y] = this.seen(at), [u, v] = this.seen(along(at, 1, vector));
    const length = Math.hypot(u - x, v - y);
    if (!(length > 1)) return;
    const head = Math.min(9, 0.4 * length), [a, b] = [(u - x) / length, (v - y) / length];
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(u - 0.8 * head * a, v - 0.8 * head * b);
    context.stroke();
    context.beginPath();
    context.moveTo(u, v);
    context.lineTo(u - head * (a - 0.45 * b), v - head * (b + 0.45 * a));
    context.lineTo(u - head * (a + 0.45 * b), v - head * (b - 0.45 * a));
    context.fill();
  }

  // What a user's code shows: { kind: "frame" | "label" | "line" | "shape", of, ... }, places in the frame of the body `of`, -1 the world's.
  drawExtra({ kind, of, name, at, axes, size, points, text, colour }) {
    const { context } = this, own = colour || colourOf("--text"), poses = this.poses;
    const write = (words, place, fill) => {
      const [x, y] = this.seen(place);
      Object.assign(context, { fillStyle: fill, font: "12px system-ui, sans-serif", textAlign: "left" });
      context.fillText(words, x + 6, y - 6);
    };
    if (kind === "line") this.drawLine(points.map((point) => placed(poses, of, point)), own, 2);
    if (kind === "label") {
      const [x, y] = this.seen(placed(poses, of, at));
      context.beginPath();
      context.arc(x, y, 3, 0, 2 * Math.PI);
      context.fillStyle = own;
      context.fill();
      write(text, placed(poses, of, at), own);
    }
    if (kind === "frame") {
      const origin = placed(poses, of, at);
      axes.forEach((axis, i) => this.drawArrow({ at: origin, along: turned(poses, of, axis).map((x) => size * x), colour: colourOf(`--line${[1, 2, 0][i]}`) }));
      write(name, origin, own);
    }
  }

  // The body whose hinge or line is nearest to a place in the picture, within 14 pixels, or whose shape is seen there, and its depth there;
  // body -1 for none.
  hitAt(x, y) {
    let nearest = { body: -1, depth: 0 }, least = 14;
    for (const { ends, dot: at, body, depth } of this.items || []) {
      if (body < 0) continue;
      let distance;
      if (at) {
        distance = Math.hypot(at[0] - x, at[1] - y) - 4; // a hinge before the lines that meet at it
      } else {
        const [u, v] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        const share = Math.max(0, Math.min(1, ((x - ends[0][0]) * u + (y - ends[0][1]) * v) / (u * u + v * v || 1)));
        distance = Math.hypot(ends[0][0] + share * u - x, ends[0][1] + share * v - y);
      }
      if (distance < least) [nearest, least] = [{ body, depth }, distance];
    }
    if (nearest.body >= 0) return nearest;
    const side = (ax, ay, bx, by) => (bx - ax) * (y - ay) - (by - ay) * (x - ax);
    const hit = (this.drawn || []).findLast(({ points: [ax, ay, bx, by, cx, cy] }) => {
      const sides = [side(ax, ay, bx, by), side(bx, by, cx, cy), side(cx, cy, ax, ay)];
      return sides.every((s) => s >= 0) || sides.every((s) => s <= 0);
    });
    return hit ? { body: hit.body, depth: hit.depth / 3 } : nearest;
  }

  bodyAt(x, y) {
    return this.hitAt(x, y).body;
  }
}

// A point in the world, in the frame of a body.
function withinBody(poses, body, point) {
  const X = poses.subarray(12 * body, 12 * body + 12), d = [3, 7, 11].map((i, j) => point[j] - X[i]);
  return [0, 1, 2].map((j) => X[j] * d[0] + X[4 + j] * d[1] + X[8 + j] * d[2]);
}

// 1, 2 or 5 times a power of ten, at most the given length.
function niceStep(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return power * [5, 2, 1].find((factor) => factor * power <= length * (1 + 1e-9));
}
