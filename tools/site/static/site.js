// Live experiments in the text, the menu of versions, and the search box of the experiments.
"use strict";

if (location.protocol === "file:" && typeof DOCUMENTATION_OPTIONS === "object") {
  DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false; // a browser loads no pages from a folder
}

function colours() {
  return document.documentElement.dataset.theme === "dark" ? "dark" : "light";
}

// A page of an experiment is loaded when its figure comes near, and removed when it is far away:
// a browser draws at most sixteen scenes at a time.
function play(figure) {
  if (figure.querySelector("iframe")) return;
  const frame = document.createElement("iframe");
  frame.src = `${figure.dataset.page}#framed&theme=${colours()}`;
  frame.title = figure.querySelector("figcaption a").textContent;
  frame.addEventListener("load", () => figure.classList.add("playing"));
  const stage = figure.querySelector(".stage");
  stage.append(frame);
  figure.sizes = new ResizeObserver(() => fit(figure, stage, frame));
  figure.sizes.observe(stage); // which also reports the first size
}

// A page has its wide layout from 761 pixels on: in a narrower column it is drawn smaller.
function fit(figure, stage, frame) {
  const scale = Math.min(1, stage.clientWidth / 900);
  const wide = scale < 1 && stage.clientWidth > 560;
  figure.classList.toggle("wide", wide);
  frame.style.transform = wide ? `scale(${scale})` : "";
  frame.style.height = wide ? `${100 / scale}%` : "";
}

function rest(figure) {
  figure.querySelector("iframe")?.remove();
  figure.sizes?.disconnect();
  figure.classList.remove("playing");
}

function watchFigures() {
  const figures = [...document.querySelectorAll("figure.live")];
  const near = new IntersectionObserver(
    (entries) => entries.forEach((each) => each.isIntersecting && play(each.target)),
    { rootMargin: "100px" },
  );
  const far = new IntersectionObserver(
    (entries) => entries.forEach((each) => each.isIntersecting || rest(each.target)),
    { rootMargin: "1200px" },
  );
  figures.forEach((figure) => [near, far].forEach((each) => each.observe(figure)));
  new MutationObserver(() => {
    for (const figure of figures.filter((each) => each.querySelector("iframe"))) {
      rest(figure);
      play(figure);
    }
  }).observe(document.documentElement, { attributeFilter: ["data-theme"] });
}

function offerVersions() {
  for (const menu of document.querySelectorAll(".versions")) {
    const here = menu.dataset.version;
    const versions = [...new Set([...(window.ROBSIM_VERSIONS ?? []), here])];
    menu.replaceChildren(...versions.map((name) => new Option(name, name, name === here, name === here)));
    const root = new URL(menu.dataset.root, location.href);
    menu.addEventListener("change", () => (location.href = new URL(`../${menu.value}/index.html`, root)));
  }
}

function findExperiments() {
  const cards = [...document.querySelectorAll(".experiment")];
  document.querySelector("#wanted")?.addEventListener("input", (event) => {
    const words = event.target.value.toLowerCase().split(/\s+/);
    for (const card of cards) {
      const text = `${card.textContent} ${card.getAttribute("href")}`.toLowerCase();
      card.hidden = !words.every((word) => text.includes(word));
    }
    for (const group of document.querySelectorAll("section section")) {
      group.hidden = !group.querySelector(".experiment:not([hidden])");
    }
    document.querySelector("#none").hidden = cards.some((card) => !card.hidden);
  });
}

// The theme gives no name to the buttons that open the pages below an entry.
function nameFolds() {
  for (const fold of document.querySelectorAll(".bd-sidebar summary, .bd-sidebar-primary summary")) {
    fold.setAttribute("aria-label", "pages below this entry");
  }
}

document.addEventListener("DOMContentLoaded", () => {
  watchFigures();
  offerVersions();
  findExperiments();
  nameFolds();
  document.body.dataset.ready = "yes";
});
