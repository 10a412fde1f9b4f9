// The page of a study: its map, the controls of the map, and the counts of outcomes.

import { Columns } from "./columns.js";
import { cardOf, countsOf, swatch, worstOf } from "./rows.js";
import { Scatter } from "./scatter.js";
import { byNumber, byOutcome, shadeBar } from "./shades.js";
import { element, find } from "./view.js";

const FIRST_AXES = ["start_x", "start_y", "start_z", "start_distance", "start_angle", "end_time", "path_length", "run"];
const LENGTH = /^start_[xyz]$/; // axes with a common scale
const MOST_TURNS = 12; // runs of a draw that are placed in a ring

export class StudyMap {
  // `open` opens the run of a number; null if no studio can simulate it.
  constructor(header, arrays, open) {
    const held = new Map(header.in_turn.map((name) => [name, 0])); // otherwise runs of a draw hide each other
    Object.assign(this, { header, open, hidden: new Set(), held });
    this.columns = new Columns(header, arrays);
    const axes = [...FIRST_AXES, ...this.columns.names].filter((name) => this.columns.names.includes(name));
    this.chosen = { x: axes[0] ?? "run", y: axes[1] ?? "run", color: "outcome" };
    const { measures } = this.columns;
    this.measure = measures.includes("distance_to_goal") ? "distance_to_goal" : measures[0];
    this.build();
    new MutationObserver(() => this.renew()).observe(document.documentElement, { attributeFilter: ["data-theme"] });
    this.renew();
  }

  build() {
    const part = (id) => element("div", "", id);
    this.parts = Object.fromEntries(["tools", "points", "legend", "beside"].map((id) => [id, part(id)]));
    this.card = element("div", "", "card-of-run");
    this.card.setAttribute("aria-live", "polite");
    this.card.hidden = true;
    find("study").replaceChildren(...Object.values(this.parts));
    find("mapped").textContent = document.title = this.header.title;
    find("summary").textContent = this.header.summary;
    this.offerTools();
    this.scatter = new Scatter(this.parts.points, {
      point: (i) => this.point(i),
      pick: (i, touched) => this.pick(i, touched),
      zoomed: (whether) => (this.whole.hidden = !whether),
    });
    this.parts.points.append(this.card);
    this.worst = element("div");
    const heading = element("h2", "the ten worst by ");
    heading.append(this.select("measure", this.columns.measures, this.measure, (name) => (this.measure = name)));
    const notes = this.header.notes.map((text) => element("p", text, "remark"));
    this.parts.beside.append(element("h2", "how the runs ended"), countsOf(this.header), ...notes, heading, this.worst);
  }

  offerTools() {
    const { columns, chosen, parts } = this;
    const tool = (text, ...options) => {
      const made = element("label", `${text} `);
      made.append(this.select(text, ...options));
      parts.tools.append(made);
    };
    tool("across", columns.names, chosen.x, (name) => (chosen.x = name));
    tool("up", columns.names, chosen.y, (name) => (chosen.y = name));
    tool("colour", ["outcome", ...columns.measures], "outcome", (name) => (chosen.color = name));
    for (const name of this.header.filters) {
      const { labels } = columns.known.get(name);
      tool(name, ["all", ...labels], labels[this.held.get(name)] ?? "all", (_, at) => this.held.set(name, at - 1));
    }
    this.whole = element("button", "whole map");
    this.whole.hidden = true;
    this.whole.addEventListener("click", () => this.scatter.zoomTo(null));
    this.note = element("p", "", "said");
    this.note.setAttribute("role", "status");
    parts.tools.append(this.whole, this.note);
  }

  // The name of a run: its number, and the values that are varied in turn.
  name(number) {
    const i = this.columns.run.indexOf(number);
    const turn = i < 0 ? "" : this.columns.turn(i);
    return `run ${number}${turn && `: ${turn}`}`;
  }

  tellNote(text) {
    this.note.textContent = text;
  }

  select(name, options, chosen, changed) {
    const made = element("select");
    made.setAttribute("aria-label", name);
    for (const each of options) made.add(new Option(each, each, each === chosen, each === chosen));
    made.addEventListener("change", () => {
      changed(made.value, made.selectedIndex);
      this.renew();
    });
    return made;
  }

  // Whether each run has the fixed values of the map.
  heldRuns() {
    const kept = new Uint8Array(this.columns.count).fill(1);
    for (const [name, code] of this.held) {
      const { values } = this.columns.known.get(name);
      if (code >= 0) for (let i = 0; i < kept.length; i++) kept[i] &= values[i] === code;
    }
    return kept;
  }

  // Whether runs of one draw would hide each other.
  isCrowded() {
    const { columns, chosen, held } = this;
    const free = columns.inTurn.some((name) => held.get(name) < 0);
    return free && columns.cells <= MOST_TURNS && columns.isShared(chosen.x) && columns.isShared(chosen.y);
  }

  renew() {
    const { columns, chosen, hidden } = this;
    const held = this.heldRuns();
    const kept = held.map((is, i) => is && !hidden.has(columns.ending(i)));
    const shade = chosen.color !== "outcome";
    const painted = shade ? byNumber(columns, kept, chosen.color) : byOutcome(columns, kept);
    const axis = (name) => ({ title: columns.title(name), ...columns.ends(name) });
    this.scatter.show({
      x: columns.places(chosen.x),
      y: columns.places(chosen.y),
      axes: [axis(chosen.x), axis(chosen.y)],
      turns: this.isCrowded() ? columns.run.map((number) => number % columns.cells) : null,
      cells: columns.cells,
      equal: LENGTH.test(chosen.x) && LENGTH.test(chosen.y),
      ...painted,
    });
    this.tellLegend(held, shade);
    this.parts.legend.append(...this.lost(kept).map((text) => element("span", text, "remark")));
    this.worst.replaceChildren(worstOf(columns, this.measure, kept, { pick: (i) => this.pick(i, false), point: (i) => this.pointFrom(i) }));
  }

  // The counts of runs that are not at their numbers: without a number, or outside of the range.
  lost(kept) {
    const { columns, chosen } = this;
    let [without, beyond] = [0, 0];
    const axes = [chosen.x, chosen.y].map((name) => ({ places: columns.places(name), ...columns.ends(name) }));
    for (let i = 0; i < kept.length; i++) {
      if (!kept[i]) continue;
      if (axes.some(({ places }) => Number.isNaN(places[i]))) without += 1;
      else if (axes.some(({ places, low, high }) => places[i] < low || places[i] > high)) beyond += 1;
    }
    return [
      ...(without ? [`${without} without a number on these axes`] : []),
      ...(beyond ? [`${beyond} outside of the range are on the border`] : []),
    ];
  }

  tellLegend(held, shade) {
    const { columns } = this;
    const counts = columns.endings.map(() => null);
    for (let i = 0; i < held.length; i++) counts[columns.ending(i)] += held[i];
    const chips = columns.endings.map(({ words, color }, ending) => counts[ending] !== null && this.chip(ending, words, counts[ending], color));
    this.parts.legend.replaceChildren(...chips.filter(Boolean), ...(shade ? [shadeBar(columns, this.chosen.color)] : []));
  }

  // An outcome with its count; a click hides or shows its runs.
  chip(ending, words, count, color) {
    const { hidden } = this;
    const made = element("button", "", "chip");
    made.append(color ? swatch(color) : swatch("#8c8c8c", true), `${words} `, element("b", String(count)));
    made.dataset.ending = ending;
    made.setAttribute("aria-pressed", String(!hidden.has(ending)));
    made.addEventListener("click", () => {
      if (!hidden.delete(ending)) hidden.add(ending);
      this.renew();
      this.parts.legend.querySelector(`[data-ending="${ending}"]`).focus();
    });
    return made;
  }

  // Show the row of a run beside its point.
  point(i) {
    if (i < 0 && this.pinned) this.scatter.mark(this.shown);
    else this.showCard(i, false);
  }

  pointFrom(i) {
    this.scatter.mark(i);
    this.point(i);
  }

  // Open a run; after a touch, or without a studio, keep its row.
  pick(i, touched) {
    if (this.open && !touched && i >= 0) this.open(this.columns.run[i]);
    else this.showCard(i, true);
  }

  showCard(i, pinned) {
    Object.assign(this, { shown: i, pinned: pinned && i >= 0 });
    this.card.hidden = i < 0;
    if (i < 0) return;
    const open = pinned && this.open && ((k) => this.open(this.columns.run[k]));
    this.card.replaceChildren(cardOf(this.columns, i, open));
    this.card.classList.toggle("pinned", pinned);
    const { px, py, place } = this.scatter;
    const [x, y] = Number.isNaN(px[i] + py[i]) ? [place.clientWidth, 0] : [px[i], py[i]];
    const [width, height] = [this.card.offsetWidth, this.card.offsetHeight];
    const left = x + width + 24 > place.clientWidth ? x - width - 16 : x + 16;
    this.card.style.left = `${Math.max(left, 4)}px`;
    this.card.style.top = `${Math.max(Math.min(y - height / 2, place.clientHeight - height - 4), 4)}px`;
  }
}
