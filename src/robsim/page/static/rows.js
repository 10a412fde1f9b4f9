// Parts beside a map: the counts of outcomes, the row of a run, and the worst runs.

import { written } from "./columns.js";
import { element } from "./view.js";

// The counts of each group: a bar of its outcomes, and the share of each with its interval.
export function countsOf(header) {
  const table = element("table", "", "counts");
  for (const group of header.counts) {
    const head = element("tbody");
    head.append(groupRow(group, header.by), barRow(group, header.outcomes));
    for (const share of group.shares) head.append(shareRow(share, header.outcomes));
    table.append(head);
  }
  return table;
}

function groupRow({ label, runs, began }, by) {
  const row = element("tr");
  const name = element("th", by ? label : "all runs");
  name.scope = "rowgroup";
  name.colSpan = 2;
  if (by) name.title = `${by} = ${label}`;
  row.append(name, element("td", `${began} of ${runs} began`));
  return row;
}

function barRow({ shares }, outcomes) {
  const row = element("tr", "", "stacked");
  const cell = element("td");
  cell.colSpan = 3;
  for (const [number, , value] of shares) {
    const part = element("span");
    part.style.setProperty("width", `${100 * value}%`);
    part.style.setProperty("background", outcomes[number].color);
    cell.append(part);
  }
  row.append(cell);
  return row;
}

function shareRow([number, count, , text], outcomes) {
  const row = element("tr");
  const name = element("td");
  name.append(swatch(outcomes[number].color), outcomes[number].words);
  row.append(name, element("td", String(count)), element("td", text));
  return row;
}

export function swatch(color, hollow = false) {
  const made = element("span", "", hollow ? "swatch hollow" : "swatch");
  made.style.setProperty("--own", color);
  return made;
}

// The row of a run as a card, with a button that opens the run if a studio can simulate it.
export function cardOf(columns, i, open) {
  const card = element("div");
  const head = element("p", "", "head");
  head.append(swatch(columns.outcomes[columns.outcome[i]].color, !columns.began[i]), element("strong", `run ${columns.run[i]}`));
  head.append(element("span", columns.words(i)));
  const list = element("dl");
  for (const name of columns.known.keys()) {
    if (name === "run" || name === "began") continue;
    list.append(element("dt", columns.title(name)), element("dd", columns.text(name, i)));
  }
  card.append(head, list);
  if (open) {
    const button = element("button", `open run ${columns.run[i]}`);
    button.addEventListener("click", () => open(i));
    card.append(button);
  }
  return card;
}

// The runs with the largest numbers, as a list of buttons.
export function worstOf(columns, name, kept, { pick, point }) {
  const list = element("ol", "", "worst");
  for (const i of columns.worst(name, kept)) {
    const button = element("button");
    const value = element("span", written(columns.numbers(name)[i]), "value");
    button.append(swatch(columns.outcomes[columns.outcome[i]].color), `run ${columns.run[i]}`, element("span", columns.turn(i), "turn"), value);
    button.title = columns.words(i);
    button.addEventListener("click", () => pick(i));
    for (const kind of ["focus", "pointerenter"]) button.addEventListener(kind, () => point(i));
    for (const kind of ["blur", "pointerleave"]) button.addEventListener(kind, () => point(-1));
    const item = element("li");
    item.append(button);
    list.append(item);
  }
  return list;
}
