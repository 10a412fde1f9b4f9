// How sharply a scene is drawn on a machine that is slow.

const SLOW = 45; // milliseconds from frame to frame
const LINGER = 400; // milliseconds without a motion, after which all is drawn sharply
const COARSE = 0.5; // share of the pixels of a side that are drawn while frames are slow

// How sharp to draw while things move, from how long frames take.
export class Pace {
  constructor() {
    Object.assign(this, { slow: 0, moved: 0, before: 0, coarse: false });
  }

  share(now, moving) {
    const took = now - this.before;
    this.before = now;
    if (moving && now - this.moved < LINGER) this.slow += ((took > SLOW ? 1 : 0) - this.slow) * 0.2;
    if (moving) this.moved = now;
    if (now - this.moved > LINGER) return 1;
    if (this.slow > 0.6) this.coarse = true;
    if (this.slow < 0.1) this.coarse = false;
    return this.coarse ? COARSE : 1;
  }
}
