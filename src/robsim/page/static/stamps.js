// Discs and rings as pixels, for images with hundreds of thousands of them.

import { element } from "./view.js";

// The pixels of a disc or a ring: their offsets from its middle, colours and alphas.
export function stampOf(look, radius, ratio, width) {
  const middle = Math.ceil((radius + 1.5) * ratio);
  const side = 2 * middle + 1;
  const { data } = discOf(look, radius * ratio, ratio, side).getImageData(0, 0, side, side);
  const stamp = { steps: [], colors: [], alphas: [] };
  for (let i = 0; i < side * side; i++) {
    if (!data[4 * i + 3]) continue;
    stamp.steps.push(width * (Math.floor(i / side) - middle) + (i % side) - middle);
    stamp.colors.push(data[4 * i], data[4 * i + 1], data[4 * i + 2]);
    stamp.alphas.push(data[4 * i + 3] / 255);
  }
  return stamp;
}

// A disc or a ring in its own square, with a rim that separates it from others.
function discOf({ color, hollow }, radius, ratio, side) {
  const canvas = element("canvas");
  canvas.width = canvas.height = side;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  const dark = document.documentElement.dataset.theme === "dark";
  context.beginPath();
  context.arc(side / 2, side / 2, hollow ? radius - 0.4 * ratio : radius, 0, 2 * Math.PI);
  context.fillStyle = color;
  if (!hollow) context.fill();
  context.lineWidth = (hollow ? 1.5 : 0.7) * ratio;
  context.strokeStyle = hollow ? color : dark ? "rgba(255, 255, 255, 0.45)" : "rgba(0, 0, 0, 0.35)";
  context.stroke();
  return context;
}

// Blend a stamp into an opaque image that contains it.
export function press(data, { steps, colors, alphas }, middle) {
  for (let i = 0; i < steps.length; i++) {
    const at = 4 * (middle + steps[i]);
    for (let k = 0; k < 3; k++) data[at + k] += alphas[i] * (colors[3 * i + k] - data[at + k]);
  }
}
