// What the events tell, and where it is shown.

const runs = [];
let current = null;
let lost = false;
let hovered = null;

const REASONS = {
  samples: "done", spp: "done", time: "done: time used up", error: "done: target reached", interrupted: "interrupted",
};

const view = new PictureView(id("picture"), showPixel, showLegend);

/** When a run is expected to end: seconds of rendering, and the error then; null while that is unknown. */
function forecast(run) {
  const last = run.curve[run.curve.length - 1];
  const { now, about } = run;
  if (!last || !now || run.ended) return null;
  const left = now.seconds_left;
  const target = about.target.relative_error;
  if (left !== null) {
    const end = about.seconds_before + now.seconds + left;
    return end > last[0] ? [end, last[2] * Math.sqrt(last[0] / end)] : null;
  }
  return target && target < last[2] ? [last[0] * (last[2] / target) ** 2, target] : null;
}

function targetText({ samples, seconds, relative_error }) {
  const all = [];
  if (relative_error !== null) all.push("error " + short(relative_error));
  if (samples !== null) all.push(count(samples) + " samples");
  if (seconds !== null) all.push(clock(seconds));
  return all.join(" or ") || "no limit";
}

/** Seconds of rendering until a run ends, or until its error is the target. */
function leftText(run) {
  if (run.ended) return "none";
  const expected = forecast(run);
  const { now, about } = run;
  if (now && now.seconds_left !== null) return clock(now.seconds_left);
  const target = about.target.relative_error;
  if (target && now && now.relative_error !== null && now.relative_error <= target) return "reached";
  return expected ? "about " + clock(expected[0] - about.seconds_before - (now ? now.seconds : 0)) : "unknown";
}

function stateText(run) {
  if (lost) return "connection lost";
  if (run.ended) return REASONS[run.ended] || run.ended;
  if (run.problem) return "can't be read";
  if (!run.about.live) return run.saved ? "saved " + ago(run.saved) : "waiting";
  return run.now ? "rendering" : "preparing";
}

function ago(when) {
  const seconds = Date.now() / 1000 - when;
  return seconds < 5 ? "just now" : clock(seconds) + " ago";
}

function set(name, text) {
  const element = id(name);
  if (element.textContent !== text) element.textContent = text;
}

/** Shows what is known of the current run. */
function showRun() {
  const run = current;
  if (!run) return;
  const { now, about } = run;
  const many = runs.filter(Boolean).length > 1 && about.file !== about.title;
  set("title", about.title + (many ? " \u00b7 " + about.file : ""));
  const error = now ? errorText(now) : "unknown";
  document.title = (now && now.relative_error !== null ? percent(now.relative_error) + " \u00b7 " : "") + about.title;
  set("state", stateText(run));
  id("state").className = lost ? "lost" : run.ended || !about.live ? "" : "live";
  set("error", error);
  set("samples", now ? (now.samples < 100 ? String(Number(now.samples.toFixed(1))) : count(now.samples)) : "0");
  set("seconds", clock(about.seconds_before + (now ? now.seconds : 0)));
  set("leftname", !run.ended && now && now.seconds_left === null && about.target.relative_error ? "to the target" : "time left");
  set("left", leftText(run));
  set("speed", now && now.paths_per_second !== null ? count(now.paths_per_second) : "unknown");
  set("target", targetText(about.target));
  const part = about.regions.length ? ", " + about.regions.length + (about.regions.length > 1 ? " regions" : " region") : "";
  set("size", about.size[0] + " \u00d7 " + about.size[1] + part);
  set("adapter", about.adapter || "unknown");
  id("savedbox").hidden = !run.saved;
  if (run.saved) set("saved", ago(run.saved));
  const done = run.ended ? 1 : now && now.fraction !== null ? now.fraction : 0;
  id("bar").firstElementChild.style.width = 100 * done + "%";
  id("bar").setAttribute("aria-valuenow", Math.round(100 * done));
  id("problem").hidden = !run.problem;
  set("problem", run.problem ? about.file + ": " + run.problem + (run.picture ? ". The numbers are the last that were read." : "") : "");
  id("none").hidden = run.picture > 0 || !about.size[0];
  showChart();
  const tile = now && !run.ended && about.live ? now.tile : null;
  id("tilebox").hidden = !tile;
  if (tile) set("tile", tile.slice(0, 2).join(", ") + " to " + tile.slice(2).join(", "));
  view.show(run.id, about.size, about.regions, tile);
}

function showChart() {
  const run = current;
  const at = drawChart(id("chart"), run.curve, run.about.target.relative_error, forecast(run), hovered);
  const samples = at && at[1] ? ", " + count(at[1]) + " samples a pixel" : "";
  set("point", at ? `${clock(at[0])}: ${percent(at[2])}${at[3] > 0 ? " \u00b1 " + percent(at[3], 2) : ""}${samples}` : "\u00a0");
}

function showMessages() {
  const list = id("log");
  id("messages").hidden = !current.messages.length;
  const below = list.scrollHeight - list.scrollTop - list.clientHeight < 8;
  list.replaceChildren(...current.messages.map((m) => element("li", { class: m.level }, m.text)));
  if (below) list.scrollTop = list.scrollHeight;
}

/** The legend of a map, and the downloads, which follow the exposure. */
function showLegend(picture) {
  const { layer, range } = picture;
  id("legend").hidden = layer === "picture" || !range;
  if (layer === "picture" || !range) return;
  const [low, high] = range;
  const text = layer === "error" ? (x) => percent(x, 2) : (x) => String(Math.round(x));
  set("low", text(low));
  set("middle", text(layer === "error" ? Math.sqrt(low * high) : (low + high) / 2));
  set("high", text(high));
  set("what", layer === "error" ? "standard error of a pixel over its luminance; of dark pixels over 1/10 of the mean" : "samples of a pixel");
}

let asking = null;

/** Says what a pixel has. */
async function showPixel([x, y]) {
  if (!current) return;
  if (asking) asking.abort();
  const asked = (asking = new AbortController());
  try {
    const answer = await fetch(`runs/${current.id}/pixel?x=${x}&y=${y}`, { signal: asked.signal });
    if (answer.status !== 200) return;
    const p = await answer.json();
    if (!p.samples) return set("readout", `Pixel ${x}, ${y}: no samples yet`);
    const value = (v) => (v === 0 ? "0" : digits(v, 4));
    const list = (all) => all.map(value).join("  ");
    set("readout", `Pixel ${x}, ${y}: radiance ${list(p.radiance)} \u00b1 ${list(p.error.slice(0, 3))}; relative error ${percent(p.relative_error, 2)}; ${count(p.samples)} samples`);
  } catch (e) {
    // Another pixel, or no server any more.
  }
}

/** The part about where the run comes from, when it is opened. */
async function showOrigin() {
  if (!id("origin").querySelector("details").open || !current) return;
  const run = current;
  try {
    const answer = await fetch(`runs/${run.id}/about`);
    if (answer.status !== 200 || run !== current) return;
    const about = await answer.json();
    const pairs = about.entries.map(([key, value]) => {
      const box = element("div");
      box.append(element("dt", {}, key.replaceAll("_", " ")), element("dd", {}, value));
      return box;
    });
    id("entries").replaceChildren(...pairs);
    set("scene", about.scene_text);
  } catch (e) {
    // No server any more.
  }
}

function setExposure(ev) {
  const bounded = Math.min(10, Math.max(-10, ev));
  id("exposure").value = bounded;
  set("ev", (bounded > 0 ? "+" : bounded < 0 ? "\u2212" : "") + Math.abs(bounded) + " EV");
  view.setExposure(bounded);
  showDownloads();
}

function setLayer(layer) {
  document.querySelector(`input[name=layer][value=${layer}]`).checked = true;
  id("stops").style.visibility = layer === "picture" ? "" : "hidden";
  view.setLayer(layer);
}

function showDownloads() {
  if (!current) return;
  const base = `runs/${current.id}/`;
  id("exr").setAttribute("href", base + "picture.exr");
  id("png").setAttribute("href", base + "picture.png?exposure=" + id("exposure").value);
  id("npz").setAttribute("href", base + "film.npz");
}

// All runs at a glance.

const seen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) target.run.inSight = isIntersecting;
  showThumbnails();
}, { rootMargin: "200px" });

function card(run) {
  if (run.card) return run.card;
  const item = element("li");
  const button = item.appendChild(element("button"));
  button.append(element("canvas"), element("span", { class: "told" }));
  for (const part of ["name", "file", "err", "more"]) button.lastChild.append(element("span", { class: part }));
  button.addEventListener("click", () => (location.hash = "run-" + run.id));
  item.run = run;
  seen.observe(item);
  id("cards").append(item);
  return (run.card = item);
}

function showCard(run) {
  const item = card(run);
  const part = (name) => item.querySelector("." + name);
  part("name").textContent = run.about.title;
  // Many films may be of one scene.
  part("file").textContent = run.about.file === run.about.title ? "" : run.about.file;
  part("err").textContent = run.now ? "error " + errorText(run.now) : "";
  const left = leftText(run);
  const more = [stateText(run)];
  if (run.now) more.push(clock(run.about.seconds_before + run.now.seconds) + " of rendering");
  if (left !== "unknown" && left !== "none") more.push(left === "reached" ? "target reached" : left + " left");
  part("more").textContent = run.problem ? run.about.file + ": " + run.problem : more.join(", ");
  part("more").classList.toggle("bad", Boolean(run.problem));
}

let drawing = false;

/** Fetches the small pictures that are in sight and out of date, one at a time. */
async function showThumbnails() {
  if (drawing || document.hidden || id("overview").hidden) return;
  drawing = true;
  try {
    for (const run of runs) {
      if (!run || !run.inSight || run.drawn === run.picture || !run.about.size[0]) continue;
      const canvas = run.card.querySelector("canvas");
      const room = Math.max(200, canvas.clientWidth) * devicePixelRatio;
      const version = run.picture;
      const data = await fetchLayer(run.id, "picture", [0, 0, ...run.about.size], Math.max(1, Math.floor(run.about.size[0] / room)));
      run.drawn = version;
      if (!data) continue;
      paint(data, 0, null);
      [canvas.width, canvas.height] = [room, Math.round(room * 0.75)];
      const scale = Math.min(canvas.width / data.width, canvas.height / data.height);
      const [w, h] = [data.width * scale, data.height * scale];
      canvas.getContext("2d").drawImage(data.canvas, (canvas.width - w) / 2, (canvas.height - h) / 2, w, h);
    }
  } catch (e) {
    // No server any more.
  }
  drawing = false;
}

/** Shows one run, or all: as the address says, or as their number suggests. */
function route() {
  const chosen = /^#run-(\d+)$/.exec(location.hash);
  const all = runs.filter(Boolean);
  const run = chosen ? runs[Number(chosen[1])] : all.length === 1 ? all[0] : null;
  id("overview").hidden = Boolean(run) || all.length < 2;
  id("detail").hidden = !run;
  id("back").hidden = !run || all.length < 2;
  const changed = run !== current;
  current = run || null;
  if (run) {
    if (changed) {
      hovered = null;
      set("readout", "Point at a pixel, or press an arrow key on the picture.");
      showDownloads();
      showMessages();
      showOrigin();
    }
    showRun();
    if (changed) view.refresh();
  } else if (all.length) {
    set("title", all.length + " films");
    document.title = all.length + " films";
    set("state", lost ? "connection lost" : "watching");
    id("state").className = lost ? "lost" : "live";
    id("bar").firstElementChild.style.width = "0";
    all.forEach(showCard);
    showThumbnails();
  }
}

function take(update) {
  const known = runs[update.id];
  const run = known || (runs[update.id] = { id: update.id, curve: [], messages: [], picture: 0, drawn: 0, card: null, inSight: false });
  if (update.about) Object.assign(run, { about: update.about, curve: [], messages: [] });
  run.curve.push(...update.curve);
  run.messages.push(...update.messages);
  const newer = run.picture !== update.picture;
  Object.assign(run, { now: update.now, ended: update.ended, problem: update.problem, picture: update.picture, saved: update.saved });
  if (!known) return route();
  if (run === current) {
    showRun();
    if (update.about || update.messages.length) showMessages();
    if (update.about) showOrigin();
    if (newer) view.refresh();
  } else if (!current) {
    showCard(run);
    if (newer) showThumbnails();
  }
}

// Without this, a page whose server has ended would ask for it forever.
let tries = 0;

function connect() {
  const events = new EventSource("events");
  events.onopen = () => {
    tries = 0;
    lost = false;
    // A new connection tells everything from the beginning.
    route();
  };
  events.onmessage = (event) => take(JSON.parse(event.data));
  events.onerror = () => {
    events.close();
    lost = !(current && current.ended && runs.filter(Boolean).length === 1);
    set("state", lost ? "connection lost" : stateText(current));
    id("state").className = lost ? "lost" : "";
    setTimeout(connect, Math.min(60, 2 * 2 ** tries++) * 1000);
  };
}

document.getElementsByName("layer").forEach((radio) => radio.addEventListener("change", () => setLayer(radio.value)));
id("exposure").addEventListener("input", () => setExposure(Number(id("exposure").value)));
id("in").addEventListener("click", () => view.zoom(2));
id("out").addEventListener("click", () => view.zoom(0.5));
id("fit").addEventListener("click", () => view.fit());
id("one").addEventListener("click", () => view.toScale(1));
id("back").addEventListener("click", () => (location.hash = ""));
id("origin").querySelector("details").addEventListener("toggle", showOrigin);
for (const name of ["pointermove", "pointerdown"]) {
  id("chart").addEventListener(name, (e) => {
    hovered = e.clientX - id("chart").getBoundingClientRect().left;
    if (current) showChart();
  });
}
id("chart").addEventListener("pointerleave", () => {
  hovered = null;
  if (current) showChart();
});
new ResizeObserver(() => current && showChart()).observe(id("chart"));
addEventListener("hashchange", route);
document.addEventListener("visibilitychange", () => {
  if (document.hidden) return;
  view.refresh();
  showThumbnails();
});
// Ages go on.
setInterval(() => (current ? current.saved && showRun() : runs.forEach(showCard)), 10000);

addEventListener("keydown", (e) => {
  if (!current || e.ctrlKey || e.metaKey || e.altKey) return;
  const stops = () => Number(id("exposure").value);
  const actions = {
    p: () => setLayer("picture"), e: () => setLayer("error"), s: () => setLayer("samples"),
    "[": () => setExposure(stops() - 0.5), "]": () => setExposure(stops() + 0.5),
    "+": () => view.zoom(2), "=": () => view.zoom(2), "-": () => view.zoom(0.5), 0: () => view.fit(), 1: () => view.toScale(1),
    Escape: () => id("back").hidden || (location.hash = ""),
  };
  if (!actions[e.key]) return;
  e.preventDefault();
  actions[e.key]();
});

connect();
