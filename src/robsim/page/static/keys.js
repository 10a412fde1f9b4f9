// The keys of the page, and their list.

import { closeButton, element, find } from "./view.js";

const SHOWN = { " ": "space", ArrowLeft: "←", ArrowRight: "→", "ctrl+z": "Ctrl Z", "ctrl+shift+z": "Ctrl Shift Z", "ctrl+y": "Ctrl Y" };
const GESTURES = [
  ["drag in the scene", "turn the view; with the right button move it, with the wheel zoom"],
  ["↑ and ↓ in a field", "change its number by a step, with shift by ten"],
  ["Escape in a field", "show the value in effect again"],
];

// Listen for keys {keys, words, act} and list them in a dialog; keys typed into a field belong to the field.
export function listenForKeys(bindings) {
  const all = [...bindings, { keys: ["?"], words: "show this list", act: () => showKeys(all) }];
  const acts = new Map(all.flatMap(({ keys, act }) => keys.map((key) => [key, act])));
  find("help").addEventListener("click", () => showKeys(all));
  document.addEventListener("keydown", (event) => {
    if (document.body.classList.contains("map")) return; // the map has its own keys
    const key = keyOf(event);
    const act = acts.get(key);
    if (!act || belongsToField(event, key)) return;
    act(event.shiftKey ? 10 : 1);
    event.preventDefault();
  });
}

// The name of a pressed key, with the modifiers that select an action.
function keyOf({ key, ctrlKey, metaKey, shiftKey, altKey }) {
  if (altKey) return "";
  if (!ctrlKey && !metaKey) return key;
  return `ctrl+${shiftKey ? "shift+" : ""}${key.toLowerCase()}`;
}

// Whether a key belongs to the element with the focus, or to an open dialog.
function belongsToField({ target }, key) {
  if (document.querySelector("dialog[open]") || target.closest("textarea, input[type=text], input[type=search]")) return true;
  if (key.startsWith("ctrl+") || key === "?") return false;
  if (key === " ") return target.closest("summary, button, a, select, input") !== null; // the key presses it
  return target.closest("select") !== null;
}

function showKeys(bindings) {
  const dialog = find("keys");
  const rows = bindings.map(({ keys, words }) => [keys.map((key) => SHOWN[key] ?? key).join(" or "), words]);
  const list = element("dl");
  for (const [keys, words] of [...rows, ...GESTURES]) list.append(element("dt", keys), element("dd", words));
  dialog.replaceChildren(closeButton(dialog), element("h2", "Keys"), list);
  dialog.showModal();
}
