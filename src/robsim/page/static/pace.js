// Drawing resolution of a scene on a slow machine.

const SLOW = 45; // milliseconds from frame to frame, after a frame that was drawn
const LINGER = 400; // milliseconds without motion; then the resolution is full
const COARSE = 0.5; // resolution while frames are slow, as a share of the full one

// The resolution during motion, from the duration of frames.
export class Pace {
  constructor() {
    Object.assign(this, { slow: 0, moved: 0, before: 0, longest: 0, coarse: false });
  }

  share(now, moving) {
    this.longest = Math.max(this.longest, now - this.before);
    this.before = now;
    if (moving && now - this.moved < LINGER) this.slow += ((this.longest > SLOW ? 1 : 0) - this.slow) * 0.3;
    if (moving) [this.moved, this.longest] = [now, 0];
    if (now - this.moved > LINGER) return 1;
    if (this.slow > 0.6) this.coarse = true;
    if (this.slow < 0.1) this.coarse = false;
    return this.coarse ? COARSE : 1;
  }
}
