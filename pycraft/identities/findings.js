// Shows the rows of the verdicts whose buttons are pressed that have every word of the field; a heading where it has a row.
for (const root of document.querySelectorAll(".pycraft-report:not([data-ready])")) {
  root.dataset.ready = "yes";
  const buttons = [...root.querySelectorAll("button")], field = root.querySelector("input");
  const rows = [...root.querySelectorAll("tr[data-verdict]")], groups = [...root.querySelectorAll("tr.group")];
  const show = () => {
    const shown = new Set(buttons.filter((b) => b.getAttribute("aria-pressed") === "true").map((b) => b.dataset.verdict));
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const row of rows) {
      row.hidden = !shown.has(row.dataset.verdict) || !words.every((word) => row.dataset.words.includes(word));
      count += !row.hidden;
    }
    for (const group of groups) {
      let row = group.nextElementSibling;
      while (row && !row.classList.contains("group") && row.hidden) row = row.nextElementSibling;
      group.hidden = !row || row.classList.contains("group");
    }
    root.querySelector(".count").textContent = `${count} of ${rows.length}`;
  };
  for (const button of buttons) {
    button.onclick = () => {
      button.setAttribute("aria-pressed", button.getAttribute("aria-pressed") !== "true");
      show();
    };
  }
  field.oninput = show;
  const controls = root.querySelector(".controls");
  [controls.hidden, controls.style.display] = [false, ""];
  show();
}
