// Plays the steps of a recursion: the figure's bodies, the line of the recursion, and the blocks that are there by now.
for (const root of document.querySelectorAll(".pycraft-sweeps:not([data-ready])")) {
  root.dataset.ready = "yes";
  const film = JSON.parse(root.querySelector("script[type='application/json']").textContent);
  const find = (name) => root.querySelector("." + name);
  const all = (name) => [...root.querySelectorAll("." + name)];
  const lines = all("line"), bodies = all("body"), edges = all("edge"), made = all("made");
  const slider = find("at"), play = find("play"), told = find("told"), pace = find("pace");
  let timer = null;

  const show = (now) => {
    const [line, count, pass, direction, body, text] = film.steps[now];
    slider.value = now;
    lines.forEach((element, i) => element.classList.toggle("lit", i >= line && i < line + count));
    lines[line]?.parentElement.scrollTo({ top: lines[line].offsetTop - lines[line].parentElement.offsetTop - 80 });
    const done = new Set();
    for (let i = 0; i <= now; ++i) if (film.steps[i][2] === pass) done.add(film.steps[i][4]);
    bodies.forEach((element, k) => {
      element.classList.toggle("now", k === body);
      element.classList.toggle("done", done.has(k) && k !== body);
    });
    edges.forEach((element, k) => element.classList.toggle("travels",
      direction > 0 ? k === body : direction < 0 && body >= 0 && film.parents[k] === body));
    made.forEach((element) => { element.style.visibility = Number(element.dataset.step) <= now ? "visible" : "hidden"; });
    told.textContent = `${now + 1} of ${film.steps.length}   ${text}`;
  };
  const stop = () => { clearInterval(timer); timer = null; play.textContent = "▶"; play.setAttribute("aria-label", "play"); };
  const start = () => {
    if (Number(slider.value) >= film.steps.length - 1) show(0);
    play.textContent = "❚❚", play.setAttribute("aria-label", "pause");
    timer = setInterval(() => {
      const next = Number(slider.value) + 1;
      if (next >= film.steps.length) return stop();
      show(next);
    }, 1000 / Number(pace.value));
  };
  play.onclick = () => (timer ? stop() : start());
  pace.onchange = () => { if (timer) stop(), start(); };
  slider.oninput = () => { stop(); show(Number(slider.value)); };
  find("back").onclick = () => { stop(); show(Math.max(0, Number(slider.value) - 1)); };
  find("next").onclick = () => { stop(); show(Math.min(film.steps.length - 1, Number(slider.value) + 1)); };
  [find("controls").hidden, find("controls").style.display] = [false, ""];
  show(film.steps.length - 1);
}
