"use strict";
// Light or dark: as the JupyterLab that shows the page in a cell, where it can be read, else as the system. A page in a notebook is of its origin; the
// viewer's is not, and follows the system.

const systemDark = matchMedia("(prefers-color-scheme: dark)");
const notebook = (() => {
  try {
    const around = window.parent === window ? null : window.parent.document.body;
    return around && "jpThemeLight" in around.dataset ? around : null;
  } catch {
    return null;
  }
})();
const atThemes = [];
const onTheme = (call) => atThemes.push(call); // when it changes
function takeTheme() {
  const dark = notebook ? notebook.dataset.jpThemeLight === "false" : systemDark.matches;
  document.documentElement.classList.toggle("dark", dark);
  for (const call of atThemes) call();
}
systemDark.addEventListener("change", takeTheme);
if (notebook) new MutationObserver(takeTheme).observe(notebook, { attributes: true, attributeFilter: ["data-jp-theme-light"] });
takeTheme();
