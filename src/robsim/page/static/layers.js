// The rendered picture beneath the feature points of a camera: stored in the page, or sent by a studio.

const LAYER_MODES = ["marks", "picture", "difference"];
const LAYER_TITLES = {
  marks: "the feature points alone",
  picture: "the rendered picture beneath the feature points",
  difference: "half of the picture minus the picture at the goal; grey where they are equal",
};
const EQUAL_GREY = 127; // of equal pictures in a difference
const LAYER_PERIOD = 200; // least milliseconds between two requests
const LAYER_PATIENCE = 2000; // milliseconds until a request counts as lost
const LAYER_KEY = "robsim pictures"; // of the choice in the storage of the tab

// The choice of what all images of the page show.
export class LayerChoice {
  constructor() {
    this.listeners = new Set();
    this.mode = stored();
  }

  // The mode of a camera: the choice, or the picture if something printed is there to see.
  of({ pictures }) {
    if (!pictures) return "marks";
    const mode = this.mode ?? (pictures.prints ? "picture" : "marks");
    return mode === "difference" && pictures.goal === null ? "picture" : mode;
  }

  choose(mode) {
    this.mode = mode;
    try {
      sessionStorage.setItem(LAYER_KEY, mode);
    } catch {
      // a page in a frame of a notebook may have no storage
    }
    for (const listener of this.listeners) listener();
  }

  // The mode of the first of several cameras.
  ofFirst(cameras) {
    return this.of(cameras.find((each) => each.pictures?.goal !== null) ?? cameras[0]);
  }

  // Choose the next mode.
  turn(cameras) {
    const drawn = cameras.filter((each) => each.pictures);
    if (!drawn.length) return;
    const modes = modesOf(drawn);
    this.choose(modes[(modes.indexOf(this.ofFirst(drawn)) + 1) % modes.length]);
  }

  // The buttons of the modes of cameras with pictures.
  buttons(cameras) {
    const group = document.createElement("span");
    group.className = "layers";
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", "content of the images");
    for (const mode of modesOf(cameras)) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: mode, title: LAYER_TITLES[mode] });
      button.addEventListener("click", () => this.choose(mode));
      group.append(button);
    }
    const mark = () => {
      const own = this.ofFirst(cameras);
      for (const each of group.children) each.setAttribute("aria-pressed", each.textContent === own);
    };
    mark();
    this.listeners.add(mark);
    return group;
  }
}

function stored() {
  try {
    const mode = sessionStorage.getItem(LAYER_KEY);
    return LAYER_MODES.includes(mode) ? mode : null;
  } catch {
    return null;
  }
}

function modesOf(cameras) {
  const goals = cameras.some(({ pictures }) => pictures.goal !== null);
  return LAYER_MODES.filter((mode) => mode !== "difference" || goals);
}

// Pictures at some instants of a recording; a picture is decoded once, and the next one in advance.
export class StoredLayer {
  // `changed` is called when a picture can be drawn that was demanded before.
  constructor({ instants, images, goal }, changed) {
    Object.assign(this, { instants, images, goal, changed, decoded: new Map(), differences: new Map(), drawn: {} });
  }

  // The picture of the last stored instant up to an instant, or its difference from the goal.
  // While it is decoded, the picture before; null before the first stored instant.
  at(index, mode) {
    const number = this.instants.findLastIndex((each) => each <= index);
    if (number < 0) return null;
    const image = mode === "picture" ? this.decode(this.images[number]) : this.difference(number);
    if (image) this.drawn[mode] = image;
    if (number + 1 < this.images.length) this.decode(this.images[number + 1]);
    return this.drawn[mode] ?? null;
  }

  difference(number) {
    const [image, goal] = [this.images[number], this.goal].map((address) => this.decode(address));
    if (image && goal && !this.differences.has(number)) this.differences.set(number, differenceOf(image, goal));
    return this.differences.get(number);
  }

  decode(address) {
    if (!this.decoded.has(address)) {
      this.decoded.set(address, null);
      decodeImage(address).then((image) => {
        this.decoded.set(address, image);
        this.changed();
      });
    }
    return this.decoded.get(address);
  }
}

// Pictures that a studio draws on request: of the shown instant, one at a time, and at most five a second.
export class LiveLayer {
  constructor(name, ask, changed) {
    Object.assign(this, { name, ask, changed, image: null, key: "", demanded: null, asked: null, before: -LAYER_PERIOD });
  }

  // The newest picture of a mode. `version` changes with the content of an instant.
  at(index, mode, version) {
    this.demanded = { index, mode, key: `${mode} ${index} ${version}` };
    this.renew();
    return this.mode === mode ? this.image : null;
  }

  renew() {
    clearTimeout(this.timer);
    const { demanded, asked } = this;
    if (!demanded || demanded.key === this.key) return;
    const wait = this.before + (asked ? LAYER_PATIENCE : LAYER_PERIOD) - performance.now();
    if (wait > 0) {
      this.timer = setTimeout(() => this.renew(), wait);
      return;
    }
    this.before = performance.now();
    this.asked = demanded;
    this.ask({ picture: [this.name, demanded.index, demanded.mode] });
  }

  // Take the answer of a studio; another page may have asked for it.
  async hear({ camera, index, mode, image }) {
    const { asked } = this;
    if (camera !== this.name || asked?.index !== index || asked.mode !== mode) return;
    const drawn = image && (await decodeImage(image));
    Object.assign(this, { image: drawn, mode, key: asked.key, asked: null });
    this.changed();
  }

  // Request no more, until a picture is demanded again.
  rest() {
    clearTimeout(this.timer);
    this.demanded = null;
  }
}

async function decodeImage(address) {
  const image = new Image();
  image.src = address;
  await image.decode();
  return image;
}

// Half of the difference of two images of equal size, plus the grey of equal pictures.
function differenceOf(image, goal) {
  const [own, other] = [image, goal].map(pixelsOf);
  const { data } = own.pixels;
  for (let i = 0; i < data.length; i += 4)
    data[i] = data[i + 1] = data[i + 2] = EQUAL_GREY + (data[i] - other.pixels.data[i]) / 2; // rounded
  own.pen.putImageData(own.pixels, 0, 0);
  return own.canvas;
}

function pixelsOf(image) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  const pen = canvas.getContext("2d", { willReadFrequently: true });
  pen.drawImage(image, 0, 0);
  return { canvas, pen, pixels: pen.getImageData(0, 0, canvas.width, canvas.height) };
}
