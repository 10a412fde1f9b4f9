// The displayed instant, and its advance in time.

export class Clock {
  constructor(times) {
    this.times = times;
    this.index = 0;
    this.seconds = times[0] ?? 0;
    this.speed = 1;
    this.playing = false;
    this.listeners = [];
    this.following = false; // whether the last instant is displayed as instants arrive
  }

  get end() {
    return this.times[this.times.length - 1] ?? 0;
  }

  listen(listener) {
    this.listeners.push(listener);
    listener(this);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
  }

  // Replace the times by more or fewer ones.
  renew(times) {
    this.times = times;
    if (this.following) this.toEnd();
    else this.seek(this.seconds);
  }

  toEnd() {
    this.index = this.times.length - 1;
    this.seconds = this.end;
    this.tell();
  }

  seek(seconds) {
    this.seconds = Math.min(Math.max(seconds, this.times[0]), this.end);
    this.index = this.indexAt(this.seconds);
    this.tell();
  }

  step(count) {
    const last = this.times.length - 1;
    this.index = Math.min(Math.max(this.index + count, 0), last);
    this.seconds = this.times[this.index];
    this.playing = false;
    this.tell();
  }

  toggle() {
    this.playing = !this.playing && this.times.length > 1;
    if (this.playing && this.index === this.times.length - 1) this.seek(this.times[0]);
    this.tell();
  }

  // Advance by seconds of the wall clock.
  pass(wall) {
    if (!this.playing) return;
    this.seconds += wall * this.speed;
    if (this.seconds >= this.end) {
      this.seconds = this.end;
      this.playing = false;
    }
    this.index = this.indexAt(this.seconds);
    this.tell();
  }

  indexAt(seconds) {
    let low = 0;
    let high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= seconds + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  }
}
