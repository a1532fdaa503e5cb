// The picture, its layers, and moving about in it.

/** From nothing to much; the legend has the same colours. */
const RAMP = [[0, 0, 5], [82, 18, 122], [184, 56, 120], [252, 138, 97], [252, 252, 191]];

/** sRGB levels of linear values, 0 to 1. */
const LEVELS = Uint8Array.from({ length: 4097 }, (_, i) => {
  const v = i / 4096;
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
});

/** What stands for a pixel without samples. */
const ABSENT = 0xf8000000;

/** Fetches a part of a layer; null while there is none. */
async function fetchLayer(run, layer, rect, k, signal) {
  const [x0, y0, x1, y1] = rect;
  const address = `runs/${run}/layers/${layer}?x0=${x0}&y0=${y0}&x1=${x1}&y1=${y1}&k=${k}`;
  let answer = await fetch(address, { signal });
  while (answer.status === 503) {
    await new Promise((done) => setTimeout(done, 2000));
    answer = await fetch(address, { signal });
  }
  if (answer.status !== 200) return null;
  const bytes = await answer.arrayBuffer();
  const head = new Uint32Array(bytes, 0, 6);
  const [version, ...at] = head;
  const step = head[5];
  const values = new (layer === "picture" ? Uint32Array : Float32Array)(bytes, 24);
  const width = Math.ceil((at[2] - at[0]) / step), height = Math.ceil((at[3] - at[1]) / step);
  return { run, layer, version, rect: at.slice(0, 4), k: step, width, height, values, canvas: null, painted: null };
}

/** The least and greatest value that a map shows: all but few, between round numbers for errors. */
function mapRange(data) {
  const all = data.values.filter((v) => v === v).sort();
  if (!all.length) return [0, 1];
  const at = (q) => all[Math.round(q * (all.length - 1))];
  if (data.layer === "samples") return [all[0], all[all.length - 1]];
  const round = (x, up) => {
    const decade = 10 ** Math.floor(Math.log10(x));
    const steps = [1, 2, 5, 10].map((s) => s * decade);
    return up ? steps.find((s) => s >= x * 0.999) : steps.reverse().find((s) => s <= x * 1.001);
  };
  const high = at(0.98) > 0 ? round(at(0.98), true) : 1;
  const low = at(0.02) > high * 1e-4 ? round(at(0.02), false) : high * 1e-3;
  return low < high ? [low, high] : [high / 10, high];
}

/** Where a value stands between the ends of a map, 0 to 1. */
function mapPlace(layer, [low, high], value) {
  if (layer === "samples") return high > low ? (value - low) / (high - low) : 0.5;
  return Math.log(Math.max(value, low) / low) / Math.log(high / low);
}

/** Paints a part of a layer on a canvas of its own. */
function paint(data, ev, range) {
  const key = data.layer === "picture" ? String(ev) : range.join();
  if (data.painted === key) return;
  const canvas = data.canvas || document.createElement("canvas");
  canvas.width = data.width;
  canvas.height = data.height;
  const context = canvas.getContext("2d");
  const image = context.createImageData(data.width, data.height);
  const out = image.data;
  if (data.layer === "picture") {
    const units = Array.from({ length: 32 }, (_, e) => 4096 * 2 ** (e - 24 + ev));
    data.values.forEach((bits, i) => {
      if (bits === ABSENT) return;
      const unit = units[bits >>> 27];
      for (let c = 0; c < 3; c++) out[4 * i + c] = LEVELS[Math.min(4096, ((bits >>> (9 * c)) & 511) * unit + 0.5) | 0];
      out[4 * i + 3] = 255;
    });
  } else {
    data.values.forEach((value, i) => {
      if (value !== value) return;
      const t = 4 * Math.min(1, Math.max(0, mapPlace(data.layer, range, value)));
      const k = Math.min(3, Math.floor(t));
      for (let c = 0; c < 3; c++) out[4 * i + c] = RAMP[k][c] + (t - k) * (RAMP[k + 1][c] - RAMP[k][c]);
      out[4 * i + 3] = 255;
    });
  }
  context.putImageData(image, 0, 0);
  data.canvas = canvas;
  data.painted = key;
}

class PictureView {
  constructor(canvas, onPixel, onDrawn) {
    Object.assign(this, { canvas, onPixel, onDrawn });
    this.layer = "picture";
    this.ev = 0;
    this.run = null;
    this.pointers = new Map();
    new ResizeObserver(() => this.changed()).observe(canvas);
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => this.pointers.delete(e.pointerId));
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(2 ** (-e.deltaY / (e.deltaMode ? 8 : 250)), this.at(e));
    }, { passive: false });
    canvas.addEventListener("keydown", (e) => this.key(e));
  }

  /** Shows a run, of pictures of this size, with the regions that are rendered and the tile that was rendered last. */
  show(run, size, regions, tile) {
    this.regions = regions;
    const moved = String(this.tile) !== String(tile);
    this.tile = tile;
    if (this.run === run && this.size && this.size.join() === size.join()) {
      if (moved) this.draw();
      return;
    }
    if (!size[0]) return;
    Object.assign(this, { run, size, scale: 0, center: size.map((n) => n / 2), whole: null, part: null, pixel: null, range: null });
    this.changed();
  }

  setLayer(layer) {
    if (layer === this.layer) return;
    Object.assign(this, { layer, whole: null, part: null, range: null });
    this.changed();
  }

  setExposure(ev) {
    this.ev = ev;
    this.draw();
  }

  /** CSS pixels of a pixel of the picture when the whole picture is seen. */
  get fitting() {
    return Math.min(this.canvas.clientWidth / this.size[0], this.canvas.clientHeight / this.size[1]);
  }

  get zoomed() {
    return this.scale || this.fitting;
  }

  fit() {
    this.scale = 0;
    this.center = this.size.map((n) => n / 2);
    this.changed();
  }

  /** Makes a pixel of the picture this many pixels of the screen. */
  toScale(pixels) {
    if (this.size) this.zoom(pixels / devicePixelRatio / this.zoomed);
  }

  /** Zooms by a factor, with the point `at` of the picture where it is. */
  zoom(factor, at = this.center) {
    if (!this.size) return;
    const before = this.zoomed;
    const smallest = Math.min(this.fitting, 1 / devicePixelRatio);
    const scale = Math.min(64, Math.max(smallest, before * factor));
    const moved = before / scale;
    this.center = [0, 1].map((i) => at[i] + (this.center[i] - at[i]) * moved);
    this.scale = Math.abs(scale / this.fitting - 1) < 0.001 ? 0 : scale;
    this.clamp();
    this.changed();
  }

  clamp() {
    const half = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => n / 2 / this.zoomed);
    this.center = this.center.map((c, i) => (2 * half[i] >= this.size[i] ? this.size[i] / 2 : Math.min(this.size[i] - half[i], Math.max(half[i], c))));
  }

  /** The point of the picture at an event. */
  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left - box.width / 2) / this.zoomed + this.center[0], (event.clientY - box.top - box.height / 2) / this.zoomed + this.center[1]];
  }

  down(event) {
    if (!this.size) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.point(this.at(event));
  }

  move(event) {
    if (!this.size) return;
    const before = this.pointers.get(event.pointerId);
    if (!before) return this.point(this.at(event));
    const others = [...this.pointers].filter(([n]) => n !== event.pointerId).map(([, p]) => p);
    const now = [event.clientX, event.clientY];
    this.pointers.set(event.pointerId, now);
    if (others.length) {
      const apart = (p) => Math.hypot(p[0] - others[0][0], p[1] - others[0][1]) || 1;
      return this.zoom(apart(now) / apart(before), this.at({ clientX: (now[0] + others[0][0]) / 2, clientY: (now[1] + others[0][1]) / 2 }));
    }
    this.center = this.center.map((c, i) => c - (now[i] - before[i]) / this.zoomed);
    this.clamp();
    this.changed();
  }

  key(event) {
    const step = event.shiftKey ? 10 : 1;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way || !this.size) return;
    event.preventDefault();
    const from = this.pixel || this.center.map(Math.floor);
    this.point(this.pixel ? from.map((n, i) => n + way[i] * step) : from, true);
  }

  /** Chooses the pixel at a point, and moves there if it is not seen. */
  point(at, follow = false) {
    const pixel = at.map((n, i) => Math.min(this.size[i] - 1, Math.max(0, Math.floor(n))));
    const same = this.pixel && this.pixel.join() === pixel.join();
    this.pixel = pixel;
    if (follow) {
      const half = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => n / 2 / this.zoomed);
      this.center = this.center.map((c, i) => Math.min(pixel[i] + half[i] - 0.5, Math.max(pixel[i] - half[i] + 1.5, c)));
      this.clamp();
      this.changed();
    } else this.draw();
    if (!same) this.onPixel(pixel);
  }

  /** Another part is seen: draws what there is, and fetches the rest when all is calm. */
  changed() {
    this.draw();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.refresh(), this.whole ? 120 : 0);
  }

  /** Fetches what is seen, in as many pixels as the screen has. */
  async refresh() {
    if (this.run === null || !this.size || document.hidden || !this.canvas.clientWidth) return;
    if (this.fetching) {
      this.again = true;
      return;
    }
    this.fetching = new AbortController();
    try {
      const { run, layer, size } = this;
      const dense = this.zoomed * devicePixelRatio;
      const step = (scale) => Math.max(1, Math.floor(1 / scale + 0.01));
      const everything = [0, 0, ...size];
      const whole = await fetchLayer(run, layer, everything, step(this.fitting * devicePixelRatio), this.fetching.signal);
      let part = null;
      if (whole && step(dense) < whole.k) {
        const half = [this.canvas.clientWidth, this.canvas.clientHeight].map((n) => n / 2 / this.zoomed);
        const low = this.center.map((c, i) => Math.max(0, Math.floor(c - half[i])));
        const high = this.center.map((c, i) => Math.min(size[i], Math.ceil(c + half[i])));
        part = await fetchLayer(run, layer, [...low, ...high], step(dense), this.fetching.signal);
      }
      if (run === this.run && layer === this.layer) {
        if (whole) Object.assign(this, { whole, part });
        if (whole && layer !== "picture") this.range = mapRange(whole);
        this.draw();
        if (whole && this.pixel) this.onPixel(this.pixel);
      }
    } catch (e) {
      // The server has gone, which its events tell.
    } finally {
      this.fetching = null;
      if (this.again) {
        this.again = false;
        this.refresh();
      }
    }
  }

  draw() {
    const { canvas } = this;
    const ratio = devicePixelRatio;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    if (!this.size || !width) return;
    const scale = this.zoomed * ratio;
    const corner = [width / 2 - this.center[0] * scale, height / 2 - this.center[1] * scale];
    const place = (x, i) => Math.round(corner[i] + x * scale);
    for (const data of [this.whole, this.part]) {
      if (!data) continue;
      paint(data, this.ev, this.range);
      const [x0, y0] = data.rect;
      context.imageSmoothingEnabled = data.k * scale < 2;
      const [left, top] = [place(x0, 0), place(y0, 1)];
      context.drawImage(data.canvas, left, top, place(x0 + data.width * data.k, 0) - left, place(y0 + data.height * data.k, 1) - top);
    }
    const frame = ([x0, y0, x1, y1], colour, wide, dashes) => {
      Object.assign(context, { strokeStyle: colour, lineWidth: wide * ratio });
      context.setLineDash(dashes.map((n) => n * ratio));
      context.strokeRect(place(x0, 0), place(y0, 1), place(x1, 0) - place(x0, 0), place(y1, 1) - place(y0, 1));
      context.setLineDash([]);
    };
    for (const region of this.regions || []) frame(region, "#888", 1, [4, 3]);
    // Small pictures are one tile, of which nothing need be said.
    if (this.tile && String(this.tile) !== String([0, 0, ...this.size])) {
      frame(this.tile, "#000", 3, []);
      frame(this.tile, "#56b4e9", 1, []);
    }
    if (this.pixel && this.whole) {
      const [x, y] = this.pixel;
      const side = Math.max(scale, 9 * ratio);
      const at = [corner[0] + (x + 0.5) * scale - side / 2, corner[1] + (y + 0.5) * scale - side / 2];
      for (const [colour, wide] of [["#000", 3], ["#fff", 1]]) {
        context.strokeStyle = colour;
        context.lineWidth = wide * ratio;
        context.strokeRect(at[0], at[1], side, side);
      }
    }
    this.onDrawn(this);
  }
}
