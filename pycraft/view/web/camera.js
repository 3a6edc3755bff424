"use strict";
// What a page has below a figure: shapes and sticks, the direction, what the camera follows, a picture and a film of it.

function cameraControls(figure, box, name) {
  const { data } = figure, put = (tag, text, properties = {}) => Object.assign(box.appendChild(document.createElement(tag)), { textContent: text }, properties);
  const choice = (label, id, options, chosen) => {
    const select = put("label", `${label} `).appendChild(document.createElement("select"));
    select.id = id;
    for (const [text, value] of options) select.add(new Option(text, value));
    select.addEventListener("change", () => chosen(select.value));
    return select;
  };
  const tick = (label, id, on, changed) => {
    const line = put("label", ""), input = Object.assign(document.createElement("input"), { type: "checkbox", id, checked: on });
    line.append(input, ` ${label}`);
    input.addEventListener("change", () => { changed(input.checked); figure.draw(); });
  };
  if (data.solids.length) {
    tick("shapes", "solid", figure.solid, (on) => { figure.solid = on; });
    tick("sticks", "sticks", figure.sticks, (on) => { figure.sticks = on; });
  }
  if (!data.flat) choice("view", "direction", [["as at first", ""], ...Object.keys(VIEWS).map((key) => [key, key])], (key) => (key ? figure.lookFrom(VIEWS[key]) : figure.look()));
  const follow = choice("follow", "follow", [["nothing", ""], ["the robot", "robot"], ...data.bodies.map((body, k) => [body, k])], (what) => figure.setFollow(what));
  follow.value = figure.follow;
  const look = put("button", "⌂", { id: "look", title: "look as at first (double click)" });
  look.addEventListener("click", () => {
    figure.look();
    if (byId("direction")) byId("direction").value = "";
  });
  const picture = put("button", "picture", { id: "picture", title: "save what is seen as a PNG file" });
  picture.addEventListener("click", () => {
    figure.opaque = true;
    figure.draw();
    figure.canvas.toBlob((blob) => download(blob, `${name}.png`));
    figure.opaque = false;
    figure.draw();
  });
  if (window.MediaRecorder && figure.canvas.captureStream) recordButton(figure, put("button", "record", { id: "record" }), name);
}

// Films what is seen until it is pressed again, and saves it: WebM in most browsers, MP4 in Safari.
function recordButton(figure, button, name) {
  let recorder = null;
  button.title = "film what is seen, as a WebM file";
  button.addEventListener("click", () => {
    if (recorder) return recorder.stop();
    figure.opaque = true;
    figure.draw();
    const parts = [];
    recorder = new MediaRecorder(figure.canvas.captureStream(30), { videoBitsPerSecond: 8e6 });
    recorder.addEventListener("dataavailable", (event) => parts.push(event.data));
    recorder.addEventListener("stop", () => {
      download(new Blob(parts, { type: recorder.mimeType }), `${name}.${recorder.mimeType.includes("mp4") ? "mp4" : "webm"}`);
      [recorder, figure.opaque] = [null, false];
      button.textContent = "record";
      button.classList.remove("on");
      figure.draw();
    });
    recorder.start();
    button.textContent = "stop";
    button.classList.add("on");
  });
}

function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
