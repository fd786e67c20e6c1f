"use strict";
// Shows what the JSON and the pictures hold; computes no figure of its own but per-pixel differences.
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const [W, H] = data.size;

// ---- pictures: half floats to floats ----
const HALF = new Float32Array(65536);
for (let i = 0; i < 65536; i++) {
  const s = i & 0x8000 ? -1 : 1, e = (i >> 10) & 31, m = i & 1023;
  HALF[i] = e === 0 ? s * m * 2 ** -24 : e === 31 ? (m ? NaN : s * Infinity) : s * (1 + m / 1024) * 2 ** (e - 15);
}
function decode(id) {
  const bytes = Uint8Array.from(atob($(id).textContent), (c) => c.charCodeAt(0));
  const halves = new Uint16Array(bytes.buffer);
  return Float32Array.from(halves, (h) => HALF[h]);
}
const names = ["reference", ...data.methods.map((m) => m.label)];
const pictures = names.map((name, i) => ({ name, rgb: decode("rgb-" + i), err: decode("err-" + i), shown: new Map() }));
const color = (i) => (i === 0 ? "var(--soft)" : COLORS[(i - 1) % COLORS.length]);

// ---- colours ----
const srgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.pow(x, 1 / 2.4) - 0.055);
const SRGB = new Uint8ClampedArray(4097);
for (let i = 0; i <= 4096; i++) SRGB[i] = 255 * srgb(i / 4096);
const CURVES = {
  clamp: (r, g, b) => [r, g, b],
  reinhard: (r, g, b) => { const s = 1 / (1 + 0.2126 * r + 0.7152 * g + 0.0722 * b); return [r * s, g * s, b * s]; },
  filmic: (...c) => c.map((x) => (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)),
};
const STOPS = [[0,0,4],[20,14,54],[59,15,112],[99,26,128],[140,41,129],[183,55,121],[221,73,104],[247,112,92],[254,159,109],[254,207,146],[252,253,191]];
const SIGNED = [[5,48,97],[67,147,195],[209,229,240],[247,247,247],[253,219,199],[214,96,77],[103,0,31]];
function ramp(stops, x) {
  const at = Math.min(Math.max(x || 0, 0), 1) * (stops.length - 1), i = Math.min(at | 0, stops.length - 2), t = at - i;
  return [0, 1, 2].map((c) => stops[i][c] + (stops[i + 1][c] - stops[i][c]) * t);
}
const LAYERS = {
  // Errors from 1 % to 1000 % in logarithm.
  error: { stops: STOPS, marks: ["1 %", "32 %", "1000 %"], of: (p, k) => {
    let s = 0;
    for (let c = 0; c < 3; c++) { const r = pictures[0].rgb[k + c], d = p.rgb[k + c] - r; s += (d * d) / (r * r + 0.01); }
    return (Math.log10(Math.sqrt(s / 3)) + 2) / 3;
  } },
  z: { stops: SIGNED, marks: ["−4 σ: too dark", "0", "too bright: +4 σ"], of: (p, k) => {
    let d = 0, v = 0;
    for (let c = 0; c < 3; c++) { d += p.rgb[k + c] - pictures[0].rgb[k + c]; v += p.err[k + c] ** 2 + pictures[0].err[k + c] ** 2; }
    return v > 0 && p !== pictures[0] ? 0.5 + d / Math.sqrt(v) / 8 : 0.5;
  } },
  noise: { stops: STOPS, marks: ["1 %", "32 %", "1000 %"], of: (p, k) => {
    let s = 0;
    for (let c = 0; c < 3; c++) s += p.err[k + c] ** 2 / (p.rgb[k + c] ** 2 + 0.01);
    return (Math.log10(Math.sqrt(s / 3)) + 2) / 3;
  } },
};

function render(p) {
  const layer = $("layer").value, ev = +$("exposure").value, curve = $("curve").value;
  const key = layer === "picture" ? ev + curve : layer;
  if (p.shown.has(key)) return p.shown.get(key);
  const canvas = new OffscreenCanvas(W, H), ctx = canvas.getContext("2d"), image = ctx.createImageData(W, H);
  const f = 2 ** ev, map = CURVES[curve];
  for (let i = 0; i < W * H; i++) {
    const k = 3 * i;
    let rgb;
    if (layer === "picture") {
      rgb = map(p.rgb[k] * f, p.rgb[k + 1] * f, p.rgb[k + 2] * f).map((x) => SRGB[Math.round(4096 * Math.min(Math.max(x || 0, 0), 1))]);
    } else rgb = ramp(LAYERS[layer].stops, LAYERS[layer].of(p, k));
    image.data.set([...rgb, 255], 4 * i);
  }
  ctx.putImageData(image, 0, 0);
  if (p.shown.size > 6) p.shown.clear();
  p.shown.set(key, canvas);
  return canvas;
}

// ---- stage ----
const stage = $("stage"), view = { zoom: 1, x: 0, y: 0, split: 0.5 };
let left = 0, right = Math.min(1, names.length - 1);
function fit() {
  const width = stage.clientWidth, height = Math.min((width * H) / W, Math.max(260, innerHeight * 0.72));
  stage.width = width * devicePixelRatio; stage.height = height * devicePixelRatio; stage.style.height = height + "px";
  view.zoom = Math.min(stage.width / W, stage.height / H);
  view.x = (stage.width - W * view.zoom) / 2; view.y = (stage.height - H * view.zoom) / 2;
}
function draw() {
  const ctx = stage.getContext("2d"), at = view.split * stage.width;
  ctx.imageSmoothingEnabled = view.zoom < 1;
  ctx.clearRect(0, 0, stage.width, stage.height);
  const side = (p, x0, x1) => {
    ctx.save(); ctx.beginPath(); ctx.rect(x0, 0, x1 - x0, stage.height); ctx.clip();
    ctx.drawImage(render(p), view.x, view.y, W * view.zoom, H * view.zoom); ctx.restore();
  };
  side(pictures[left], 0, at); side(pictures[right], at, stage.width);
  ctx.fillStyle = "#fff"; ctx.fillRect(at - 1, 0, 2, stage.height);
  ctx.beginPath(); ctx.arc(at, stage.height / 2, 9 * devicePixelRatio, 0, 7); ctx.fill();
  ctx.font = 13 * devicePixelRatio + "px system-ui, sans-serif";
  const tag = (text, x, align) => {
    ctx.textAlign = align; const w = ctx.measureText(text).width, d = devicePixelRatio, x0 = align === "left" ? x : x - w;
    ctx.fillStyle = "rgba(0,0,0,.62)"; ctx.fillRect(x0 - 6 * d, 8 * d, w + 12 * d, 22 * d);
    ctx.fillStyle = "#fff"; ctx.fillText(text, x, 24 * d);
  };
  tag(names[left], 14 * devicePixelRatio, "left"); tag(names[right], stage.width - 14 * devicePixelRatio, "right");
  const layer = LAYERS[$("layer").value];
  $("scale").hidden = !layer;
  if (layer) {
    const c = $("ramp").getContext("2d");
    for (let i = 0; i < 256; i++) { c.fillStyle = "rgb(" + ramp(layer.stops, i / 255).join() + ")"; c.fillRect(i, 0, 1, 1); }
    ["low", "mid", "high"].forEach((n, i) => ($("ramp-" + n).textContent = layer.marks[i]));
  }
}
for (const id of ["left", "right"]) for (const [i, name] of names.entries()) $(id).add(new Option(name, i));
function choose(l, r) { left = l; right = r; $("left").value = l; $("right").value = r; draw(); }
$("left").onchange = () => choose(+$("left").value, right);
$("right").onchange = () => choose(left, +$("right").value);
$("flip").onclick = () => choose(right, left);
$("layer").onchange = $("curve").onchange = draw;
$("exposure").oninput = () => { const ev = +$("exposure").value; $("ev").textContent = (ev > 0 ? "+" : "") + ev + " EV"; draw(); };
$("fit").onclick = () => { fit(); draw(); };
addEventListener("resize", () => { fit(); draw(); });
addEventListener("keydown", (e) => {
  if (/INPUT|SELECT/.test(e.target.tagName) || e.ctrlKey || e.metaKey) return;
  if (e.key === " ") { e.preventDefault(); choose(right, left); }
  else if (/^[0-9]$/.test(e.key) && +e.key < names.length) choose(left, +e.key);
});
let drag = null;
const where = (e) => { const b = stage.getBoundingClientRect(); return [(e.clientX - b.left) * devicePixelRatio, (e.clientY - b.top) * devicePixelRatio]; };
stage.onpointerdown = (e) => {
  const [x, y] = where(e); stage.setPointerCapture(e.pointerId);
  drag = Math.abs(x - view.split * stage.width) < 14 * devicePixelRatio ? { split: true } : { x: x - view.x, y: y - view.y };
};
stage.onpointerup = stage.onpointercancel = () => (drag = null);
stage.onpointermove = (e) => {
  const [x, y] = where(e);
  if (drag?.split) view.split = Math.min(Math.max(x / stage.width, 0), 1);
  else if (drag) { view.x = x - drag.x; view.y = y - drag.y; }
  if (drag) draw();
  inspect(Math.floor((x - view.x) / view.zoom), Math.floor((y - view.y) / view.zoom));
};
stage.addEventListener("wheel", (e) => {
  e.preventDefault();
  const [x, y] = where(e), zoom = Math.min(Math.max(view.zoom * 2 ** (-e.deltaY / 240), 0.1), 64), f = zoom / view.zoom;
  view.x = x - (x - view.x) * f; view.y = y - (y - view.y) * f; view.zoom = zoom; draw();
}, { passive: false });

function inspect(x, y) {
  if (x < 0 || y < 0 || x >= W || y >= H) return;
  const k = 3 * (y * W + x), n = (v) => (Math.abs(v) >= 1e-3 && Math.abs(v) < 1e4 ? v.toPrecision(4) : v === 0 ? "0" : v.toExponential(2));
  const cell = (p, c) => n(p.rgb[k + c]) + (p.err[k + c] > 0 && isFinite(p.err[k + c]) ? ` ± ${n(1.96 * p.err[k + c])}` : "");
  const rows = pictures.map((p, i) => `<tr><td><span class="swatch" style="background:${color(i)}"></span></td>` +
    [0, 1, 2].map((c) => `<td>${cell(p, c)}</td>`).join("") + "</tr>");
  const table = document.createElement("table");
  table.innerHTML = `<tr><th>pixel ${x}, ${y}</th><th>R</th><th>G</th><th>B</th></tr>` + rows.join("");
  [...table.rows].slice(1).forEach((row, i) => row.cells[0].append(names[i]));
  $("inspector").replaceChildren(table);
}

// ---- figures ----
const f = (x, d = 3) => (x === null || !isFinite(x) ? "–" : (Math.abs(x) >= 1e-3 && Math.abs(x) < 1e5) || x === 0 ? +x.toPrecision(d) + "" : x.toExponential(d - 1));
const interval = (i) => f(i.value) + (i.low === null || i.high === null || !isFinite(i.low) ? "" : `<small>${f(i.low)} … ${f(i.high)}</small>`);
function row(table, cells, tag = "td") {
  const r = table.insertRow();
  for (const c of cells) {
    const e = document.createElement(tag);
    if (c && c.html !== undefined) e.innerHTML = c.html; else e.textContent = c;
    if (c && c.cls) e.className = c.cls;
    r.append(e);
  }
  return r;
}
const head = $("figures");
row(head, ["method", "spp", "seconds", "relMSE", "trimmed relMSE", "FLIP", "efficiency", "slope / samples", "slope / time", "noise", "mean over reference", "Mrays/s"], "th");
const best = (of) => Math.min(...data.methods.map(of).filter((x) => x !== null && isFinite(x)));
const bests = { relmse: best((m) => m.relmse.value), trimmed: best((m) => m.trimmed_relmse.value), flip: best((m) => m.flip) };
data.methods.forEach((m, i) => {
  const r = row(head, ["", f(m.spp), f(m.seconds), { html: interval(m.relmse), cls: m.relmse.value === bests.relmse ? "best" : "" },
    { html: interval(m.trimmed_relmse), cls: m.trimmed_relmse.value === bests.trimmed ? "best" : "" },
    { html: f(m.flip), cls: m.flip === bests.flip ? "best" : "" }, { html: interval(m.efficiency) },
    { html: m.slope ? interval(m.slope.samples) : "–" }, { html: m.slope ? interval(m.slope.time) : "–" },
    f(100 * m.explained_by_noise) + " %", m.mean_ratio.map((x) => (x === null ? "–" : x.toFixed(4))).join("  "), f(m.mrays_per_second)]);
  const swatch = document.createElement("span"); swatch.className = "swatch"; swatch.style.background = color(i + 1);
  r.cells[0].append(swatch, m.label + (m.unbiased ? "" : " (biased)"));
});
row($("agreement"), ["", "verdict", "largest |t|", "p", "tests", "tile", "difference there"], "th");
for (const a of data.agreements) {
  const v = a.verdict;
  row($("agreement"), [`${a.a} and ${a.b}`, { html: v.agrees ? "agree" : "differ", cls: v.agrees ? "ok" : "no" }, f(v.statistic), f(v.p_value),
    v.tests, v.tile.join(", "), f(100 * v.difference) + " %"]);
}
const settings = $("settings"), ref = data.reference;
row(settings, ["reference", { html: "", cls: "text" }]).cells[1].textContent = [ref.name, ref.spp ? ref.spp + " samples" : "", ref.settings || "",
  ref.relmse === null ? "its noise is not known" : `relMSE of its own noise ${f(ref.relmse)}` + (ref.is_accurate ? "" : ", more than was asked for")].filter(Boolean).join(" · ");
for (const m of data.methods) row(settings, [m.label, { html: "", cls: "text" }]).cells[1].textContent = m.settings;
row(settings, ["seeds", { html: data.seeds.join(", "), cls: "text" }]);
row(settings, ["scene", { html: data.scene, cls: "text" }]);
row(settings, ["machine", { html: "", cls: "text" }]).cells[1].textContent = `${data.machine.threads} threads, ${data.machine.isa}, ${data.machine.platform}, Steradian ${data.machine.version}`;
$("summary").textContent = `${W} × ${H} pixels${data.spectral ? ", spectral" : ""}, ${data.budget}, ${data.seeds.length} run${data.seeds.length > 1 ? "s" : ""} of each method`;
const verdict = (cls, text) => { const li = document.createElement("li"); li.className = cls; li.textContent = text; $("verdicts").append(li); };
const winner = data.methods.reduce((a, b) => (b.trimmed_relmse.value < a.trimmed_relmse.value ? b : a));
const others = data.methods.filter((m) => m !== winner).map((m) => `${f(m.trimmed_relmse.value / winner.trimmed_relmse.value, 2)}× ${m.label}`);
verdict("note", `lowest trimmed relMSE: ${winner.label}` + (others.length ? ` (errors of the others: ${others.join(", ")})` : ""));
const pairs = data.agreements.filter((a) => a.b !== "reference");
if (pairs.length) verdict(pairs.every((a) => a.verdict.agrees) ? "good" : "bad", pairs.every((a) => a.verdict.agrees) ? "unbiased methods agree" : "unbiased methods differ");
for (const a of data.agreements.filter((a) => a.b === "reference" && !a.verdict.agrees)) {
  const m = data.methods.find((m) => m.label === a.a);
  verdict(m.unbiased ? "bad" : "note", `${a.a} differs from the reference` + (m.unbiased ? `; it cannot find: ${m.misses}` : " (it is biased)"));
}
fit(); choose(left, right);
