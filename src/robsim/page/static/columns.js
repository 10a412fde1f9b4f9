// The columns of a study: the numbers of each, their range, and their texts.

const UNITS = { "per second": "1/s" };
const TAIL = 0.005; // share of the numbers at each end that may be outliers
const FAR_OUT = 2; // times the span of the others; outliers farther out are drawn on the border
const JITTER = 0.62; // width of the strip of a label, of the gap between two
const MOST_STRIPS = 12; // labels with a strip
const DECADES = 1000; // largest over least number; above it an axis is logarithmic
const MOST_DECADES = 12; // smaller values are rounding errors

export class Columns {
  constructor(header, arrays) {
    this.outcomes = header.outcomes;
    this.inTurn = header.in_turn;
    this.cells = header.cells;
    this.outcome = arrays.outcome.values;
    this.began = arrays.began.values;
    this.run = arrays.run.values;
    this.count = this.run.length;
    this.known = new Map(header.columns.map((c) => [c.name, { ...c, values: arrays[c.name].values }]));
    this.placed = new Map();
  }

  // Names of the columns with at least two different numbers.
  get names() {
    return [...this.known.keys()].filter((name) => name !== "began" && this.span(name) > 0);
  }

  // Names of the columns that shades can show.
  get measures() {
    return this.names.filter((name) => this.isNumber(name) && name !== "run" && name !== "draw");
  }

  isNumber(name) {
    const { labels, numbers } = this.known.get(name);
    return !labels || Boolean(numbers);
  }

  isShared(name) {
    return this.known.get(name).shared;
  }

  title(name) {
    const { unit } = this.known.get(name);
    return unit ? `${name} (${UNITS[unit] ?? unit})` : name;
  }

  // Numbers of a column, one for each run.
  numbers(name) {
    const { values, numbers } = this.known.get(name);
    return numbers ? values.map((code) => numbers[code]) : values;
  }

  // Places of runs on an axis: their numbers, the logarithms of numbers that span decades, or
  // places beside each other in the strip of their label.
  places(name) {
    if (!this.placed.has(name)) this.placed.set(name, this.place(name));
    return this.placed.get(name).places;
  }

  // Least and largest place of a map, whether they are logarithms, and labels of 0, 1, 2, ...
  ends(name) {
    this.places(name);
    return this.placed.get(name).ends;
  }

  place(name) {
    const { values, labels, numbers, measure } = this.known.get(name);
    const places = Float64Array.from(values);
    if (labels) {
      const few = labels.length <= MOST_STRIPS;
      const gap = numbers ? gapOf(numbers) : 1;
      for (let i = 0; i < places.length; i++) {
        const strip = few ? JITTER * gap * scattered(i) : 0;
        places[i] = (numbers ? numbers[values[i]] : values[i]) + strip;
      }
      if (!numbers) return { places, ends: { low: -0.5, high: labels.length - 0.5, labels } };
    }
    if (measure) for (let i = 0; i < places.length; i++) if (!this.began[i]) places[i] = NaN;
    const sorted = places.filter(Number.isFinite).sort();
    const least = sorted.find((number) => number > 0);
    const log = measure && sorted[0] >= 0 && sorted.at(-1) > DECADES * least;
    if (!log) return { places, ends: endsOf(sorted) };
    const far = Math.log10(sorted.at(-1));
    const low = Math.max(Math.log10(least), far - MOST_DECADES);
    return { places: places.map(Math.log10), ends: { low, high: far, log } };
  }

  span(name) {
    const { low, high, labels } = this.ends(name);
    return labels ? labels.length - 1 : high - low;
  }

  // The value of a run as a text.
  text(name, i) {
    const { values, labels } = this.known.get(name);
    if (labels) return labels[values[i]];
    if (name === "began") return values[i] ? "yes" : "no";
    return written(values[i]);
  }

  // The values that distinguish a run from the others of its draw.
  turn(i) {
    return this.inTurn.map((name) => this.text(name, i)).join(", ");
  }

  // The possible ends: the outcomes, followed by "could not begin".
  get endings() {
    return [...this.outcomes, { words: "could not begin" }];
  }

  ending(i) {
    return this.began[i] ? this.outcome[i] : this.outcomes.length;
  }

  words(i) {
    return this.outcomes[this.outcome[i]].words + (this.began[i] ? "" : " at once");
  }

  // The ten runs with the largest numbers, among the `kept` runs that began.
  worst(name, kept, count = 10) {
    const numbers = this.numbers(name);
    const found = [];
    for (let i = 0; i < this.count; i++) {
      if (!kept[i] || !this.began[i] || !Number.isFinite(numbers[i])) continue;
      if (found.length === count && numbers[i] <= numbers[found.at(-1)]) continue;
      const at = found.findIndex((other) => numbers[other] < numbers[i]);
      found.splice(at < 0 ? found.length : at, 0, i);
      found.length = Math.min(found.length, count);
    }
    return found;
  }
}

export function written(value) {
  if (value && Math.abs(value) < 1e-4) return value.toExponential(3);
  return Number.isFinite(value) ? String(Number(value.toPrecision(5))) : "–";
}

// A number from -1/2 to 1/2, always the same for a run.
function scattered(i) {
  return (Math.imul(i, 2654435761) >>> 0) / 2 ** 32 - 0.5;
}

function gapOf(numbers) {
  const sorted = Float64Array.from(numbers).sort();
  return sorted.length < 2 ? 0 : Math.min(...sorted.slice(1).map((number, i) => number - sorted[i]));
}

function endsOf(sorted) {
  const last = sorted.length - 1;
  if (last < 0) return { low: 0, high: 0 };
  const [near, far] = [sorted[Math.floor(TAIL * last)], sorted[Math.ceil((1 - TAIL) * last)]];
  const reach = FAR_OUT * (far - near);
  const low = reach && sorted[0] < near - reach ? near : sorted[0];
  const high = reach && sorted[last] > far + reach ? far : sorted[last];
  return { low, high };
}
