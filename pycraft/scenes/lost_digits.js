// One state of the run at a time: its figure, its point in the plot, and what is known of it.
for (const root of document.querySelectorAll(".pycraft-digits:not([data-ready])")) {
  root.dataset.ready = "yes";
  const words = JSON.parse(root.querySelector("script[type='application/json']").textContent);
  const frames = [...root.querySelectorAll(".frame")], points = [...root.querySelectorAll(".at")];
  const slider = root.querySelector("input"), told = root.querySelector(".told");
  const show = (now) => {
    frames.forEach((frame, i) => { frame.style.display = i === now ? "" : "none"; });
    points.forEach((point, i) => point.classList.toggle("now", i === now));
    slider.value = now;
    told.textContent = words[now];
  };
  points.forEach((point, i) => { point.onclick = () => show(i); });
  slider.oninput = () => show(Number(slider.value));
  slider.hidden = false;
  show(Number(slider.value));
}
