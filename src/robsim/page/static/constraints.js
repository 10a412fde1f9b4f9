// Constraints of the law: a list of those that act, and what they concern in the images.

import { element } from "./view.js";

const BITS = 16; // constraints in a number of an array
const MOST_CHIPS = 8; // of a list that also shows the constraints that do not act
const MEANINGS = { holding: "holds the command back", yielding: "gives way: no command satisfies all constraints" };

export class ActingConstraints {
  constructor(panel) {
    this.panel = panel;
    this.told = () => {}; // set by a studio; receives the states of the constraints by their paths
    this.load(null, {});
  }

  // Show the constraints of a recording; null without any.
  load(entries, arrays) {
    this.entries = entries ?? [];
    this.holding = arrays["constraints holding"];
    this.yielding = arrays["constraints yielding"];
    this.states = this.entries.map(() => "");
    this.chips = new Map();
    this.key = undefined;
    this.panel.hidden = !entries;
    this.line = element("p", "", "line");
    this.list = element("ul");
    this.panel.replaceChildren(this.line, this.list);
    this.extend(0);
    this.told(new Map());
  }

  // List the constraints that act at an instant from number `from` on.
  extend(from) {
    if (!this.holding) return;
    const acted = new Set(this.chips.keys());
    for (let t = from; t < this.holding.shape[0]; t++)
      for (let i = 0; i < this.entries.length; i++) if (this.stateAt(t, i)) acted.add(i);
    if (acted.size === this.chips.size) return;
    const chips = [...acted].sort((a, b) => a - b).map((i) => [i, this.chips.get(i) ?? element("li", this.entries[i].name)]);
    this.chips = new Map(chips);
    this.key = undefined; // new chips have no state yet
    this.list.replaceChildren(...this.chips.values());
    this.list.classList.toggle("many", acted.size > MOST_CHIPS);
  }

  stateAt(t, i) {
    const set = ({ shape, values }) => (values[t * shape[1] + Math.floor(i / BITS)] >>> i % BITS) & 1;
    return set(this.yielding) ? "yielding" : set(this.holding) ? "holding" : "";
  }

  // Show the states at an instant.
  place(index) {
    if (!this.holding || index < 0 || index >= this.holding.shape[0]) return;
    this.states = this.entries.map((_, i) => this.stateAt(index, i));
    const key = this.states.join();
    if (key === this.key) return;
    this.key = key;
    for (const [i, chip] of this.chips) {
      chip.dataset.acts = this.states[i];
      chip.title = MEANINGS[this.states[i]] ?? "";
    }
    const [held, given] = ["holding", "yielding"].map((state) => this.states.filter((each) => each === state).length);
    this.line.textContent = sentenceOf(held, given);
    this.line.classList.toggle("warning", given > 0);
    this.told(this.statesByPath());
  }

  statesByPath() {
    const found = new Map();
    this.entries.forEach(({ of: owners = [] }, i) => {
      for (const path of owners) if (this.states[i] && found.get(path) !== "yielding") found.set(path, this.states[i]);
    });
    return found;
  }

  // The states by the sides and the numbers of the feature points of the image of a camera.
  statesIn({ name, targets }) {
    const [sides, marks] = [new Map(), new Map()];
    this.entries.forEach(({ side, mark, target, camera }, i) => {
      const state = this.states[i];
      if (!state || mark === undefined || (camera ?? name) !== name) return;
      const own = targets.map((each, at) => (each === (target ?? each) ? at : -1)).filter((at) => at >= 0);
      if (side && sides.get(side) !== "yielding") sides.set(side, state);
      if (marks.get(own[mark]) !== "yielding") marks.set(own[mark], state);
    });
    return { sides, marks };
  }
}

function sentenceOf(held, given) {
  const holds = `${held === 1 ? "holds" : "hold"} the command back`;
  if (given) return `${given === 1 ? "1 constraint gives" : `${given} constraints give`} way${held ? `, ${held} ${holds}` : ""}`;
  return held ? `${held} ${held === 1 ? "constraint" : "constraints"} ${holds}` : "no constraint holds the command back";
}
