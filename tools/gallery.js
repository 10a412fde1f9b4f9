"use strict";
const cards = [...document.querySelectorAll(".card")];
document.querySelector("#wanted").addEventListener("input", (event) => {
  const words = event.target.value.toLowerCase().split(/\s+/);
  for (const card of cards) {
    const text = `${card.textContent} ${card.getAttribute("href")}`.toLowerCase();
    card.hidden = !words.every((word) => text.includes(word));
  }
  for (const group of document.querySelectorAll("section")) {
    group.hidden = !group.querySelector(".card:not([hidden])");
  }
  document.querySelector("#none").hidden = cards.some((card) => !card.hidden);
});
document.body.dataset.ready = "yes";
