// The experiments to choose from: cards in groups, with pictures and a search.

import { closeButton, element } from "./view.js";

const PICTURES = "/download/pictures.json"; // {name: data URL}
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Gallery {
  constructor(dialog, opener, open) {
    Object.assign(this, { dialog, opener, open, entries: [], cards: [] });
    opener.addEventListener("click", () => this.show());
    dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
    dialog.addEventListener("keydown", (event) => this.press(event));
  }

  take(entries) {
    this.entries = entries;
    this.cards = [];
  }

  show() {
    if (!this.cards.length) this.build();
    this.field.value = "";
    this.search();
    this.dialog.showModal();
    this.dialog.scrollTop = 0;
    this.field.focus({ preventScroll: true });
    this.loadPictures();
  }

  build() {
    this.field = element("input");
    Object.assign(this.field, { type: "search", placeholder: "search", autocomplete: "off" });
    this.field.setAttribute("aria-label", "search the experiments");
    this.field.addEventListener("input", () => this.search());
    this.none = element("p", "No experiment has these words.", "none");
    this.none.setAttribute("role", "status");
    const head = element("div", "", "head");
    head.append(element("h2", "Experiments"), this.field, closeButton(this.dialog));
    const groups = [...new Set(this.entries.map((entry) => entry.group))];
    this.dialog.replaceChildren(head, ...groups.map((group) => this.group(group)), this.none);
  }

  group(name) {
    const section = element("section");
    const grid = element("div", "", "grid");
    const cards = this.entries.filter((entry) => entry.group === name).map((entry) => this.card(entry));
    grid.append(...cards.map((card) => card.button));
    if (name) section.append(element("h3", name));
    section.append(grid);
    this.cards.push(...cards.map((card) => ({ ...card, section })));
    return section;
  }

  card({ name, title, about, more }) {
    const button = element("button", "", "card");
    button.type = "button";
    button.dataset.name = name;
    const picture = element("span", "", "picture");
    picture.setAttribute("aria-hidden", "true");
    picture.append(element("span", title.trim().charAt(0).toUpperCase(), "initial"));
    button.append(picture, element("strong", title), element("span", about, "about"));
    button.addEventListener("click", () => this.choose(name));
    return { name, button, picture, words: `${name} ${title} ${about} ${more}`.toLowerCase() };
  }

  choose(name) {
    this.dialog.close();
    this.open(name);
  }

  // Show the cards that have every word of the search.
  search() {
    const words = this.field.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const card of this.cards) card.button.hidden = !words.every((word) => card.words.includes(word));
    const left = this.cards.filter((card) => !card.button.hidden);
    const sections = new Set(left.map((card) => card.section));
    for (const { section } of this.cards) section.hidden = !sections.has(section);
    this.none.hidden = left.length > 0;
  }

  press(event) {
    event.stopPropagation(); // the keys of the page rest while the gallery is open
    const left = this.cards.map((card) => card.button).filter((button) => !button.hidden);
    const here = document.activeElement;
    if (here === this.field && event.key === "Enter" && left.length) left[0].click();
    else if (here === this.field && event.key === "ArrowDown") left[0]?.focus();
    else if (left.includes(here) && ARROWS[event.key]) (nearest(here, left, ARROWS[event.key]) ?? this.field).focus();
    else return;
    event.preventDefault();
  }

  async loadPictures() {
    if (this.pictures) return this.paint();
    try {
      const answer = await fetch(PICTURES);
      this.pictures = answer.ok ? await answer.json() : null;
    } catch {
      this.pictures = null; // the cards keep their initials
    }
    return this.paint();
  }

  paint() {
    for (const { name, picture } of this.cards) {
      if (!this.pictures?.[name] || picture.querySelector("img")) continue;
      const image = element("img");
      Object.assign(image, { src: this.pictures[name], alt: "" });
      picture.replaceChildren(image);
    }
  }
}

// The next card in a direction; left and right follow the order of reading.
function nearest(here, cards, [right, down]) {
  if (right) return cards[cards.indexOf(here) + right] ?? here;
  const from = here.getBoundingClientRect();
  const beyond = cards.filter((card) => down * (card.getBoundingClientRect().top - from.top) > 1);
  const away = (card) => {
    const at = card.getBoundingClientRect();
    return Math.abs(at.left - from.left) + 10 * Math.abs(at.top - from.top);
  };
  return beyond.sort((one, other) => away(one) - away(other))[0] ?? (down > 0 ? here : undefined);
}
