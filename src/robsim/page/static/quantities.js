// Numbers with units, as a person reads and types them.

const PER_DEGREE = Math.PI / 180; // radians
const [LEAST_METRES, LEAST_DEGREES] = [1e-4, 0.01]; // smaller distances are not distinguished
const SCALES = {
  m: { mm: 1e-3, cm: 1e-2, m: 1 },
  s: { us: 1e-6, ms: 1e-3, s: 1 },
  deg: { deg: 1, "°": 1, rad: 1 / PER_DEGREE },
  "1/s": { "1/s": 1, "/s": 1, Hz: 1 },
};

// The unit in which the page shows a declared unit; angles are shown in degrees.
export function shownUnit(unit) {
  if (unit === "1") return "";
  return unit === "per second" ? "1/s" : unit.replace("rad", "deg");
}

export function toShown(value, unit) {
  return unit.startsWith("rad") && value !== null ? value / PER_DEGREE : value;
}

export function fromShown(value, unit) {
  return unit.startsWith("rad") ? value * PER_DEGREE : value;
}

// The shortest text of a number without rounding errors of binary fractions; long fractions have six digits.
export function numberText(value) {
  if (value === null) return "";
  if (Number.isInteger(value)) return String(value);
  if (Math.abs(value) < 1e-4) return value.toExponential(5).replace(/\.?0+e/, "e");
  const text = String(Number(value.toPrecision(12)));
  return text.replace("-", "").length <= 9 ? text : String(Number(value.toPrecision(6)));
}

// The number of a typed text, in the shown unit; throws an error with the reason if there is none.
export function readNumber(typed, unit, whole = false) {
  const text = typed.trim().replace("−", "-");
  const parts = /^([-+]?[\d.,]*\d[\d.,]*(?:e[-+]?\d+)?)\s*(.*)$/i.exec(text);
  if (!parts) throw new Error(`expected a number${unit && ` in ${unit}`}, got ${text ? `"${text}"` : "nothing"}`);
  const scale = parts[2] ? (SCALES[unit] ?? { [unit]: 1 })[parts[2]] : 1;
  if (scale === undefined) throw new Error(`expected ${unit ? `a number in ${unit}` : "a number without a unit"}, got "${text}"`);
  const value = Number((Number(pointed(parts[1])) * scale).toPrecision(15));
  if (!Number.isFinite(value)) throw new Error(`expected a finite number, got "${text}"`);
  if (whole && !Number.isSafeInteger(value)) throw new Error(`expected a whole number up to ${Number.MAX_SAFE_INTEGER}, got "${text}"`);
  return value;
}

// A number with a decimal point instead of a decimal comma; separators of thousands are refused.
function pointed(number) {
  const ambiguous = /^[-+]?[1-9]\d{0,2},\d{3}$/.test(number);
  const plain = /^[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?$/i.test(number);
  if (plain && !ambiguous) return number.replace(",", ".");
  const digits = number.replace(/[.,]/g, "");
  const advice = ambiguous ? `${number.replace(",", ".")} or ${digits}` : "one decimal point, and no separators of thousands";
  throw new Error(`"${number}" can be read in two ways: write ${advice}`);
}

// The largest step of 1, 2 or 5 times a power of ten that divides a span into at least 200 parts.
export function stepOf(span) {
  const most = span / 200;
  const decade = 10 ** Math.floor(Math.log10(most) + 1e-9);
  return decade * [5, 2, 1].find((each) => each * decade <= most * (1 + 1e-9));
}

// The multiple of a step that is nearest to a value and lies within bounds, free of rounding errors.
export function snapped(value, step, low, high) {
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  const count = Math.min(Math.max(Math.round(value / step), first), last);
  return Number((count * step).toPrecision(12)) || 0; // never -0
}

// A distance with the digits of a person; small ones are not distinguished.
export function distanceText({ length, angle }) {
  const parts = [];
  if (length !== null) parts.push(length < LEAST_METRES ? `less than ${1000 * LEAST_METRES} mm` : lengthText(length));
  if (angle !== null) parts.push(angle < LEAST_DEGREES * PER_DEGREE ? `${LEAST_DEGREES} deg` : angleText(angle));
  return parts.join(" and ");
}

// A length with a unit of its size.
export function lengthText(metres) {
  if (metres < 0.01) return `${rounded(1000 * metres, metres < 0.001 ? 2 : 1)} mm`;
  return metres < 1 ? `${(100 * metres).toFixed(1)} cm` : `${metres.toFixed(2)} m`;
}

export function angleText(radians) {
  const degrees = radians / PER_DEGREE;
  return `${rounded(degrees, degrees < 1 ? 2 : 1)} deg`;
}

// A number with at most some decimals; zero has none.
function rounded(value, decimals) {
  return Number(value.toFixed(decimals)) ? value.toFixed(decimals) : "0";
}
