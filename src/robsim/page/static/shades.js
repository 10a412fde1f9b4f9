// Looks of points: the colour of their outcome, or a shade for a number.

import { written } from "./columns.js";
import { element } from "./view.js";

export const NOT_SHOWN = 255;
const LEVELS = 24;
const RAMPS = {
  light: ["#dbe7ee", "#7fb5d5", "#1f6fa8", "#08264a"],
  dark: ["#34495a", "#2f7fb3", "#7cc3ea", "#f2f9ff"],
};

// The looks of a map: the index of the look of each point, and the looks {color, hollow}.
export function byOutcome(columns, kept) {
  const looks = columns.outcomes.flatMap(({ color }) => [{ color }, { color, hollow: true }]);
  const kinds = kindsOf(columns, kept, (i) => 2 * columns.outcome[i] + (columns.began[i] ? 0 : 1));
  return { looks, kinds };
}

export function byNumber(columns, kept, name) {
  const places = columns.places(name);
  const { low, high } = columns.ends(name);
  const looks = Array.from({ length: LEVELS }, (_, i) => ({ color: shadeAt(i / (LEVELS - 1)) }));
  looks.push({ color: "#8c8c8c", hollow: true });
  const kinds = kindsOf(columns, kept, (i) => {
    if (!columns.began[i] || Number.isNaN(places[i])) return LEVELS;
    const share = (places[i] - low) / (high - low);
    return Math.round(Math.min(Math.max(share, 0), 1) * (LEVELS - 1));
  });
  return { looks, kinds };
}

function kindsOf(columns, kept, kindOf) {
  const kinds = new Uint8Array(columns.count).fill(NOT_SHOWN);
  for (let i = 0; i < columns.count; i++) if (kept[i]) kinds[i] = kindOf(i);
  return kinds;
}

// The colour at a share of the ramp of the theme.
function shadeAt(share) {
  const ramp = RAMPS[document.documentElement.dataset.theme] ?? RAMPS.light;
  const place = share * (ramp.length - 1);
  const at = Math.min(Math.floor(place), ramp.length - 2);
  const part = (hex, i) => parseInt(hex.slice(1 + 2 * i, 3 + 2 * i), 16);
  const mixed = [0, 1, 2].map((i) => {
    const [from, to] = [part(ramp[at], i), part(ramp[at + 1], i)];
    return Math.round(from + (place - at) * (to - from));
  });
  return `rgb(${mixed.join(", ")})`;
}

// A bar of the shades with the numbers at its ends.
export function shadeBar(columns, name) {
  const { low, high, log } = columns.ends(name);
  const [least, most] = log ? [10 ** low, 10 ** high] : [low, high];
  const bar = element("span", "", "bar");
  const stops = [0, 1 / 3, 2 / 3, 1].map(shadeAt);
  bar.style.setProperty("background", `linear-gradient(to right, ${stops.join(", ")})`);
  const made = element("span", "", "shades");
  made.append(element("span", `${columns.title(name)}: ${written(least)}`), bar, element("span", written(most) + (log ? ", in decades" : "")));
  return made;
}
