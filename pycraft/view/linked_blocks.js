// A block lights the links between its two bodies, a body its row and its column; a click keeps what is lit.
for (const root of document.querySelectorAll(".pycraft-linked:not([data-ready])")) {
  root.dataset.ready = "yes";
  const { parents, names } = JSON.parse(root.querySelector("script[type='application/json']").textContent);
  const all = (name) => [...root.querySelectorAll("." + name)];
  const blocks = all("block"), bodies = all("body"), edges = all("edge"), told = root.querySelector(".told");
  const first = told.textContent;
  let kept = false;

  const up = (k) => { const line = []; for (; k >= 0; k = parents[k]) line.push(k); return line; };
  // Bodies on the way from one to another, and the links between them: link k goes from body k to what carries it.
  const path = (a, b) => {
    const left = up(a), right = up(b), common = left.find((k) => right.includes(k));
    const rise = left.slice(0, common === undefined ? left.length : left.indexOf(common));
    const fall = right.slice(0, common === undefined ? right.length : right.indexOf(common)).reverse();
    return { links: [...rise, ...fall], bodies: [...rise, ...(common === undefined ? [] : [common]), ...fall] };
  };
  const light = (links, lit, ends, squares, text) => {
    edges.forEach((element, k) => element.classList.toggle("lit", links.includes(k)));
    bodies.forEach((element, k) => {
      element.classList.toggle("lit", lit.includes(k));
      element.classList.toggle("end", ends.includes(k));
    });
    blocks.forEach((element) => element.classList.toggle("lit", squares.includes(element)));
    told.textContent = text;
  };
  const dark = () => { if (!kept) light([], [], [], [], first); };
  const ofBlock = (element) => {
    const row = Number(element.dataset.row), column = Number(element.dataset.column);
    const title = element.querySelector("title").textContent;
    if ("zero" in element.dataset) return light([], [], [row, column], [element], title);
    const way = path(column, row);
    light(way.links, way.bodies, [row, column], [element], `${title}; ${way.bodies.map((k) => names[k]).join(" → ")}`);
  };
  const ofBody = (k) => {
    const squares = blocks.filter((b) => Number(b.dataset.row) === k || Number(b.dataset.column) === k);
    light([], [], [k], squares, names[k]);
  };
  const offer = (element, show) => {
    element.addEventListener("pointerenter", () => { if (!kept) show(); });
    element.addEventListener("pointerleave", dark);
    element.addEventListener("click", () => { kept = false; show(); kept = true; });
  };
  blocks.forEach((element) => offer(element, () => ofBlock(element)));
  bodies.forEach((element, k) => offer(element, () => ofBody(k)));
  root.addEventListener("click", (event) => {
    if (event.target.closest(".block, .body")) return;
    kept = false;
    dark();
  });
}
