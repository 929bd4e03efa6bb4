"use strict";
(() => {
const R = JSON.parse(document.getElementById("review-data").textContent), T = R.timeline, N = T.samples, HZ = T.rate_hz;
const $ = id => document.getElementById(id), css = n => getComputedStyle(document.documentElement).getPropertyValue(n).trim();
const C = {ink: css("--ink"), quiet: css("--quiet"), rule: css("--rule"), accent: css("--accent"), seen: css("--seen"), band: css("--band"), force: "#5c6c80"};
const W = R.texts || {}, tx = (s, p = {}) => (W[s] || s).replace(/\{(\w+)\}/g, (all, k) => k in p ? p[k] : all), dec = s => R.decimal ? s.replace(".", R.decimal) : s;
const esc = s => String(s).replace(/[&<>"]/g, c => ({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"}[c]));
const num = v => v === null || v === undefined || !isFinite(v) ? "–" : dec(Math.abs(v) >= 10 ? v.toFixed(0) : Math.abs(v) >= 1 ? v.toFixed(1) : v.toFixed(2));
const clock = (s, fine) => { const h = Math.floor(s / 3600), m = Math.floor(s / 60) % 60, r = s % 60;
  const t = fine ? dec(r.toFixed(1).padStart(4, "0")) : String(Math.floor(r)).padStart(2, "0"); return h ? h + ":" + String(m).padStart(2, "0") + ":" + t : m + ":" + t; };
const END = Math.max(0.1, N / HZ);
let from = 0, to = END, hover = null, drag = null;

// --- the timeline -------------------------------------------------------------------------------------------------
const box = $("timeline");
const niceStep = (range, n) => { const raw = range / n, p = Math.pow(10, Math.floor(Math.log10(raw))); for (const m of [1, 2, 5]) if (raw <= m * p * 1.0001) return m * p; return 10 * p; };
const clockStep = (range, n) => { for (const s of [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 1800]) if (range / s <= n) return s; return 3600; };
const peak = (a, i, j) => { let m = 0; for (let k = i; k < j; ++k) if (a[k] > m) m = a[k]; return m; };
const least = (a, i, j) => { let m = null; for (let k = i; k < j; ++k) if (a[k] !== null && (m === null || a[k] < m)) m = a[k]; return m; };
const total = (a, i, j) => { let m = 0; for (let k = i; k < j; ++k) m += a[k]; return m; };
const sortedSpeed = Float32Array.from(T.speed_mm_s).sort();
const FAST = Math.max(1, 1.2 * (sortedSpeed[Math.floor((N - 1) * 0.98)] || 1)), FORCE = Math.max(0.5, peak(T.force_n, 0, N));
let G = null;
function draw() {
  if (!box) return;
  const W = Math.max(300, box.clientWidth), L = W < 560 ? 58 : 112, w = W - L - 8, lane = 54, gap = 16, top = 18;
  const i0 = Math.max(0, Math.floor(from * HZ)), i1 = Math.min(N, Math.max(i0 + 1, Math.ceil(to * HZ))), n = i1 - i0;
  const cols = Math.max(1, Math.min(n, Math.floor(w))), x = t => L + w * (t - from) / (to - from);
  const lo = c => i0 + Math.floor(c * n / cols), hi = c => Math.max(lo(c) + 1, i0 + Math.floor((c + 1) * n / cols)), cx = c => x((i0 + c * n / cols) / HZ), cw = x((i0 + n / cols) / HZ) - x(i0 / HZ);
  let s = "", y = top;
  const f = v => v.toFixed(1);
  const grid = (name, unit, max, step) => {
    s += `<text x="0" y="${y + 11}" font-size="12" font-weight="600" fill="${C.ink}">${name}</text>` + (W < 560 ? "" : `<text x="0" y="${y + 25}" font-size="10" fill="${C.quiet}">${unit}</text>`);
    for (let v = 0; v <= max * 1.0001; v += step) { const at = y + lane * (1 - v / max);
      s += `<line x1="${L}" x2="${L + w}" y1="${f(at)}" y2="${f(at)}" stroke="${C.rule}"/><text x="${L - 4}" y="${f(at + 3.5)}" font-size="10" text-anchor="end" fill="${C.quiet}">${dec(String(+v.toFixed(3)))}</text>`; } };
  const area = (get, max, fill, opacity) => { let d = `M${f(cx(0))} ${y + lane}`;
    for (let c = 0; c < cols; ++c) { const at = y + lane * (1 - Math.min(1, get(c) / max)); d += `L${f(cx(c))} ${f(at)}L${f(cx(c) + cw)} ${f(at)}`; }
    s += `<path d="${d}L${f(cx(cols - 1) + cw)} ${y + lane}Z" fill="${fill}" opacity="${opacity}"/>`; };
  const height = top + 4 * (lane + gap) + 62;
  for (const e of T.events) if (e.kind === "gap" && e.end_s >= from && e.t_s <= to) s += `<rect x="${f(x(Math.max(from, e.t_s)))}" y="${top}" width="${f(Math.max(1, x(Math.min(to, e.end_s)) - x(Math.max(from, e.t_s))))}" height="${4 * (lane + gap)}" fill="${C.rule}"/>`;
  let step = niceStep(FORCE, 2), max = Math.ceil(FORCE / step) * step;
  grid(tx("Force"), tx("N, of the burr"), max, step); area(c => peak(T.force_n, lo(c), hi(c)), max, C.force, 0.75);
  y += lane + gap; grid(tx("Clearance"), tx("mm, nearest"), 8, 4);
  s += `<rect x="${L}" y="${f(y + lane * 0.75)}" width="${w}" height="${f(lane * 0.25)}" fill="${C.accent}" opacity="0.1"/>`;
  let d = "", on = false;
  for (let c = 0; c < cols; ++c) { const v = least(T.distance_mm, lo(c), hi(c)); if (v === null) { on = false; continue; }
    const at = y + lane * (1 - Math.max(-0.5, Math.min(8, v)) / 8); d += (on ? "L" : "M") + f(cx(c)) + " " + f(at) + "L" + f(cx(c) + cw) + " " + f(at); on = true; }
  s += `<path d="${d}" fill="none" stroke="${C.ink}" stroke-width="1.2"/>`;
  y += lane + gap;
  let most = 0.1; const rate = c => HZ / (hi(c) - lo(c)), seen = c => (total(T.seen_mm3, lo(c), hi(c)) + total(T.unknown_mm3, lo(c), hi(c))) * rate(c), hid = c => total(T.hidden_mm3, lo(c), hi(c)) * rate(c);
  for (let c = 0; c < cols; ++c) most = Math.max(most, seen(c) + hid(c));
  step = niceStep(most, 2); most = Math.ceil(most / step) * step; grid(tx("Bone"), tx("mm³/s; orange unseen"), most, step);
  area(c => seen(c) + hid(c), most, C.seen, 1); area(hid, most, C.accent, 1);
  y += lane + gap; step = niceStep(FAST, 2); max = Math.ceil(FAST / step) * step;
  grid(tx("Tip speed"), tx("mm/s"), max, step); area(c => total(T.speed_mm_s, lo(c), hi(c)) / (hi(c) - lo(c)), max, C.force, 0.4);
  y += lane + 8;
  s += `<text x="0" y="${y + 12}" font-size="12" font-weight="600" fill="${C.ink}">${tx("In hand")}</text>`;
  for (let k = i0, b = i0, shade = 0; k <= i1; ++k) if (k === i1 || T.tool[k] !== T.tool[b]) { const a = x(b / HZ), e = x(k / HZ), name = T.instruments[T.tool[b]];
    s += `<rect x="${f(a)}" y="${y}" width="${f(Math.max(0.5, e - a))}" height="16" fill="${shade++ % 2 ? C.rule : C.band}"/>`;
    if (e - a > 6 * name.length + 6) s += `<text x="${f(a + 4)}" y="${y + 12}" font-size="10.5" fill="${C.ink}">${esc(name)}</text>`; b = k; }
  y += 16;
  const tick = clockStep(to - from, Math.max(3, w / 80));
  for (let t = Math.ceil(from / tick) * tick; t <= to + 1e-9; t += tick) s += `<line x1="${f(x(t))}" x2="${f(x(t))}" y1="${y + 2}" y2="${y + 6}" stroke="${C.quiet}"/><text x="${f(x(t))}" y="${y + 18}" font-size="10.5" text-anchor="${x(t) > L + w - 16 ? "end" : "middle"}" fill="${C.quiet}">${clock(t, tick < 1)}</text>`;
  for (const e of T.events) { if (e.kind === "instrument" || e.kind === "gap" || e.t_s < from || e.t_s > to) continue;
    const bad = e.kind === "injury"; s += bad ? `<path d="M${f(x(e.t_s) - 5)} 3h10l-5 10z" fill="${C.accent}"><title>${esc(e.what)}</title></path>` : `<line x1="${f(x(e.t_s))}" x2="${f(x(e.t_s))}" y1="3" y2="13" stroke="${C.quiet}"><title>${esc(e.what)}</title></line>`; }
  if (to - from < END - 0.05) { const a = L + w * from / END, b = L + w * to / END; s += `<rect x="${L}" y="${height - 7}" width="${w}" height="4" fill="${C.rule}"/><rect x="${f(a)}" y="${height - 8}" width="${f(Math.max(3, b - a))}" height="6" fill="${C.ink}"/>`; }
  if (drag) s += `<rect x="${f(x(Math.min(drag.a, drag.b)))}" y="${top - 4}" width="${f(Math.abs(x(drag.b) - x(drag.a)))}" height="${4 * (lane + gap)}" fill="${C.accent}" opacity="0.13"/>`;
  s += `<line id="cross" x1="-9" x2="-9" y1="${top - 4}" y2="${y}" stroke="${C.accent}"/>`;
  box.innerHTML = `<svg viewBox="0 0 ${W} ${height}" height="${height}" role="img" aria-label="${esc(box.dataset.alt)}">${s}</svg>`;
  G = {L, w, W};
  range();
}
function range() {
  const i = Math.max(0, Math.floor(from * HZ)), j = Math.min(N, Math.ceil(to * HZ)), near = least(T.distance_mm, i, j);
  let who = ""; if (near !== null) for (let k = i; k < j; ++k) if (T.distance_mm[k] === near) { who = " (" + (T.structures[T.structure[k]] || "") + ")"; break; }
  const nearest = near === null ? tx("nothing") : tx(near < 0 ? "{mm} mm inside" : "{mm} mm", {mm: num(Math.abs(near))}) + who;
  $("range").textContent = tx("{from} to {to}: {taken} mm³ taken, {unseen} mm³ of what is gone unseen; hardest press {force} N; nearest {nearest}", {from: clock(from), to: clock(to), taken: num(total(T.removed_mm3, i, j)), unseen: num(total(T.hidden_mm3, i, j)), force: num(peak(T.force_n, i, j)), nearest});
  let shown = 0, all = 0, rows = "";
  for (let k = 0; k < T.events.length; ++k) { const e = T.events[k]; if (e.end_s < from || e.t_s > to) continue; ++all; if (shown >= 500) continue; ++shown;
    const long = e.end_s - e.t_s;
    rows += `<tr class="go${e.kind === "injury" ? " bad" : ""}" data-n="${k}" tabindex="0"><td class="n">${clock(e.t_s, true)}</td><td>${esc(e.what)}</td><td class="n">${long > 0.05 ? num(long) + " s" : ""}</td></tr>`; }
  $("events").tBodies[0].innerHTML = rows || `<tr><td colspan="3">${tx("nothing in this time")}</td></tr>`;
  $("event-count").textContent = all > shown ? tx("the first {n} of {all}", {n: shown, all}) : all === 1 ? tx("1 event") : tx("{n} events", {n: all});
}
function show(a, b) { const least = Math.min(1, END); if (b - a < least) { const m = (a + b) / 2; a = m - least / 2; b = m + least / 2; }
  if (a < 0) { b -= a; a = 0; } if (b > END) { a -= b - END; b = END; } from = Math.max(0, a); to = Math.min(END, b); draw(); }
function readout(t) {
  const k = Math.min(N - 1, Math.max(0, Math.floor(t * HZ))), cross = $("cross");
  if (cross && G) { const px = G.L + G.w * (t - from) / (to - from); cross.setAttribute("x1", px); cross.setAttribute("x2", px); }
  const dist = T.distance_mm[k];
  $("readout").innerHTML = T.known[k] ? `<b>${clock(t, true)}</b> &ensp; ${num(T.force_n[k])} N &ensp; ${dist === null ? tx("no structure near") : tx("{mm} mm to the {structure}", {mm: num(dist), structure: esc(T.structures[T.structure[k]] || "")})} &ensp; ${num(T.speed_mm_s[k])} mm/s &ensp; ${esc(T.instruments[T.tool[k]])}${T.drilling[k] ? tx(", drilling") : ""}` : `<b>${clock(t, true)}</b> &ensp; ${tx("not recorded")}`;
  scene && scene.tip(T.known[k] ? T.at_mm[k] : null);
}
let scene = null;
if (box && N > 0) {
  const at = e => { const r = box.getBoundingClientRect(); return Math.max(from, Math.min(to, from + ((e.clientX - r.left) * G.W / r.width - G.L) / G.w * (to - from))); };
  box.addEventListener("pointerdown", e => { if (e.pointerType === "touch" || e.button === 0) { drag = {a: at(e), b: at(e)}; box.setPointerCapture(e.pointerId); } });
  box.addEventListener("pointermove", e => { const t = at(e); if (drag) { drag.b = t; draw(); } readout(t); });
  const up = () => { if (!drag) return; const d = drag; drag = null; Math.abs(d.b - d.a) > (to - from) * 0.01 ? show(Math.min(d.a, d.b), Math.max(d.a, d.b)) : draw(); };
  box.addEventListener("pointerup", up); box.addEventListener("pointercancel", () => { drag = null; draw(); });
  box.addEventListener("dblclick", () => show(0, END));
  box.addEventListener("keydown", e => { const w = to - from; const go = {ArrowLeft: [from - w / 4, to - w / 4], ArrowRight: [from + w / 4, to + w / 4], "+": [from + w / 4, to - w / 4], "=": [from + w / 4, to - w / 4], "-": [from - w / 2, to + w / 2], Escape: [0, END], Home: [0, END]}[e.key];
    if (go) { e.preventDefault(); show(...go); } });
  $("whole").addEventListener("click", () => show(0, END));
  $("events").addEventListener("click", e => { const r = e.target.closest("tr.go"); if (r) visit(T.events[+r.dataset.n]); });
  $("events").addEventListener("keydown", e => { const r = e.target.closest("tr.go"); if (r && e.key === "Enter") visit(T.events[+r.dataset.n]); });
  new ResizeObserver(() => draw()).observe(box.parentElement); addEventListener("beforeprint", draw);
  draw();
}
function visit(e) { show(e.t_s - 4, Math.max(e.end_s, e.t_s) + 4); readout(e.t_s); if (scene && e.at_mm) scene.look(e.at_mm, 12); }
for (const b of document.querySelectorAll("button[data-t]")) b.addEventListener("click", () => { const t = +b.dataset.t; show(t - 4, t + 4); readout(t); $("over-time").scrollIntoView({behavior: "smooth"}); });

// --- the view in 3D ----------------------------------------------------------------------------------------------
const bytes = s => { const b = atob(s), a = new Uint8Array(b.length); for (let n = 0; n < b.length; ++n) a[n] = b.charCodeAt(n); return a.buffer; };
function make_scene() {
  const canvas = $("view") && $("view").querySelector("canvas"); if (!canvas) return null;
  const gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true}); if (!gl) { $("view").hidden = true; $("no-view").hidden = false; return null; }
  const program = (v, f) => { const p = gl.createProgram(); for (const [t, src] of [[gl.VERTEX_SHADER, v], [gl.FRAGMENT_SHADER, f]]) { const s = gl.createShader(t); gl.shaderSource(s, "#version 300 es\nprecision highp float;" + src); gl.compileShader(s); if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(s)); gl.attachShader(p, s); } gl.linkProgram(p); return p; };
  const solid = program("layout(location=0) in vec3 p;layout(location=1) in vec3 n;uniform vec3 lo,size;uniform mat4 m;uniform mat3 r;out vec3 N;out float z;void main(){vec3 w=lo+p*size;gl_Position=m*vec4(w,1.);N=r*n;z=gl_Position.z;}",
    "in vec3 N;in float z;uniform vec4 c;out vec4 o;void main(){vec3 n=normalize(N);float back=gl_FrontFacing?1.:.55;if(!gl_FrontFacing)n=-n;float a=max(0.,dot(n,normalize(vec3(-.3,.42,1.)))),b=max(0.,dot(n,normalize(vec3(.8,-.6,.5))));float l=.20+.74*a+.16*b;o=vec4(pow(c.rgb,vec3(1.06))*l*back*(1.-.16*z),c.a);}");
  const dots = program("layout(location=0) in vec3 p;uniform mat4 m;uniform float s;void main(){gl_Position=m*vec4(p,1.);gl_PointSize=s;}",
    "uniform vec4 c;out vec4 o;void main(){vec2 d=gl_PointCoord*2.-1.;float r=dot(d,d);if(r>1.)discard;o=vec4(c.rgb*(r>.6?.55:1.),c.a);}");
  const meshes = R.meshes.map(d => { const vao = gl.createVertexArray(), wide = d.wide; gl.bindVertexArray(vao);
    const buf = (t, a) => { gl.bindBuffer(t, gl.createBuffer()); gl.bufferData(t, a, gl.STATIC_DRAW); };
    buf(gl.ARRAY_BUFFER, bytes(d.points)); gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 6, 0);
    buf(gl.ARRAY_BUFFER, bytes(d.normals)); gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 3, gl.BYTE, true, 3, 0);
    buf(gl.ELEMENT_ARRAY_BUFFER, bytes(d.triangles)); gl.bindVertexArray(null);
    return {...d, vao, type: wide ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT, on: d.id !== "before" && d.id !== "seen" && !d.id.startsWith("opened-")}; });
  const V = R.view; let centre = V.centre.slice(), radius = V.radius, clear = 0, tip = null, queued = false, marks = [];
  const norm = a => { const l = Math.hypot(...a) || 1; return a.map(v => v / l); }, cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  let eye, right, up;
  const aim = e => { eye = norm(e); const u = Math.abs(eye[2]) > 0.95 ? [0, -1, 0] : [0, 0, 1]; right = norm(cross(u, eye)); up = cross(eye, right); };
  aim(V.eye);
  const pointBuf = gl.createBuffer(), pointVao = gl.createVertexArray(); gl.bindVertexArray(pointVao); gl.bindBuffer(gl.ARRAY_BUFFER, pointBuf); gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0); gl.bindVertexArray(null);
  const rgba = (c, a) => [c[0] / 255, c[1] / 255, c[2] / 255, a];
  function paint() {
    queued = false;
    const dpr = Math.min(2, devicePixelRatio || 1), w = Math.round(canvas.clientWidth * dpr), h = Math.round(canvas.clientHeight * dpr);
    if (!w || !h) return; if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h); gl.clearColor(0.957, 0.953, 0.941, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT); gl.enable(gl.DEPTH_TEST);
    const sy = 1 / radius, sx = sy * h / w, sz = -1 / (6 * V.radius), rows = [right.map(v => v * sx), up.map(v => v * sy), eye.map(v => v * sz)], m = new Float32Array(16);
    rows.forEach((r, k) => { for (let c = 0; c < 3; ++c) m[4 * c + k] = r[c]; m[12 + k] = -dot(r, centre); }); m[15] = 1;
    const rot = new Float32Array(9); [right, up, eye].forEach((r, k) => { for (let c = 0; c < 3; ++c) rot[3 * c + k] = r[c]; });
    gl.useProgram(solid); gl.uniformMatrix4fv(gl.getUniformLocation(solid, "m"), false, m); gl.uniformMatrix3fv(gl.getUniformLocation(solid, "r"), false, rot);
    const put = (d, alpha) => { gl.uniform3fv(gl.getUniformLocation(solid, "lo"), d.lo); gl.uniform3fv(gl.getUniformLocation(solid, "size"), d.size); gl.uniform4fv(gl.getUniformLocation(solid, "c"), rgba(d.rgb, alpha)); gl.bindVertexArray(d.vao); gl.drawElements(gl.TRIANGLES, d.count, d.type, 0); };
    const bone = d => d.id === "after" || d.id === "before", faint = d => bone(d) && clear > 0 || d.id === "seen";
    for (const d of meshes) if (d.on && !faint(d)) put(d, 1);
    const points = (list, colour, size) => { if (!list.length) return; gl.useProgram(dots); gl.uniformMatrix4fv(gl.getUniformLocation(dots, "m"), false, m); gl.uniform4fv(gl.getUniformLocation(dots, "c"), colour); gl.uniform1f(gl.getUniformLocation(dots, "s"), size * dpr);
      gl.bindVertexArray(pointVao); gl.bindBuffer(gl.ARRAY_BUFFER, pointBuf); gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list.flat()), gl.DYNAMIC_DRAW); gl.drawArrays(gl.POINTS, 0, list.length); gl.useProgram(solid); };
    points(marks, [0.8, 0.31, 0.13, 1], Math.max(4, 0.35 * canvas.clientHeight / radius / 2));
    // What is clear shows its nearest face only: its depth first, then its colour.
    for (const d of meshes) if (d.on && faint(d)) { gl.colorMask(false, false, false, false); put(d, 1); gl.colorMask(true, true, true, true); gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA); gl.depthFunc(gl.EQUAL); put(d, bone(d) ? 1 - clear : 0.45); gl.depthFunc(gl.LESS); gl.disable(gl.BLEND); }
    if (tip) { gl.disable(gl.DEPTH_TEST); points([tip], [0.15, 0.16, 0.18, 1], 11); gl.enable(gl.DEPTH_TEST); }
    gl.bindVertexArray(null);
  }
  const again = () => { if (!queued) { queued = true; requestAnimationFrame(paint); } };
  const turn = (dx, dy) => { const rot = (v, k, a) => { const c = Math.cos(a), s = Math.sin(a), x = cross(k, v), d = dot(k, v) * (1 - c); return v.map((q, n) => q * c + x[n] * s + k[n] * d); };
    eye = norm(rot(eye, up, -dx)); eye = norm(rot(eye, right, -dy)); up = norm(rot(up, right, -dy)); right = norm(cross(up, eye)); up = cross(eye, right); again(); };
  const shift = (dx, dy) => { const mm = 2 * radius / canvas.clientHeight; centre = centre.map((v, n) => v - right[n] * dx * mm + up[n] * dy * mm); again(); };
  const zoom = f => { radius = Math.max(1.5, Math.min(4 * V.radius, radius * f)); again(); };
  const held = new Map(); let span = 0;
  canvas.addEventListener("pointerdown", e => { held.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); span = 0; });
  canvas.addEventListener("pointermove", e => { if (!held.has(e.pointerId)) return; const [x, y] = held.get(e.pointerId), dx = e.clientX - x, dy = e.clientY - y; held.set(e.pointerId, [e.clientX, e.clientY]);
    if (held.size === 2) { const [a, b] = [...held.values()], now = Math.hypot(a[0] - b[0], a[1] - b[1]); if (span) zoom(span / now); span = now; shift(dx / 2, dy / 2); }
    else if (e.shiftKey || e.buttons & 6) shift(dx, dy); else turn(dx * 0.008, dy * 0.008); });
  for (const n of ["pointerup", "pointercancel"]) canvas.addEventListener(n, e => { held.delete(e.pointerId); span = 0; });
  canvas.addEventListener("wheel", e => { e.preventDefault(); zoom(Math.exp(e.deltaY * 0.0012)); }, {passive: false});
  canvas.addEventListener("contextmenu", e => e.preventDefault());
  canvas.addEventListener("keydown", e => { const k = {ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1), "+": () => zoom(0.85), "=": () => zoom(0.85), "-": () => zoom(1.18), Home: home}[e.key]; if (k) { e.preventDefault(); k(); } });
  const home = () => { centre = V.centre.slice(); radius = V.radius; aim(V.eye); marks = []; again(); };
  const bar = $("parts");
  for (const d of meshes) { const b = document.createElement("button"); b.type = "button"; b.setAttribute("aria-pressed", d.on); b.innerHTML = `<span class="swatch" style="background:rgb(${d.rgb});margin-left:0"></span>${esc(d.name)}`; b.addEventListener("click", () => { d.on = !d.on; b.setAttribute("aria-pressed", d.on);
    if (d.on && (d.id === "after" || d.id === "before")) { const other = meshes.find(q => q.id === (d.id === "after" ? "before" : "after")); if (other && other.on) { other.on = false; other.button.setAttribute("aria-pressed", false); } } again(); }); d.button = b; bar.append(b); }
  $("clear").addEventListener("input", e => { clear = e.target.value / 100; again(); });
  $("home").addEventListener("click", home);
  new ResizeObserver(again).observe(canvas); addEventListener("beforeprint", paint); again();
  return {tip: p => { tip = p; again(); }, look: (at, r) => { centre = at.slice(); radius = r; again(); }, mark: list => { marks = list; again(); }, aim: e => { aim(e); again(); }};
}
try { scene = make_scene(); } catch (e) { $("view").hidden = true; $("no-view").hidden = false; }
for (const b of document.querySelectorAll("button[data-f]")) b.addEventListener("click", () => { const f = R.findings.find(q => q.id === b.dataset.f); if (!f || !scene) return; scene.mark(f.places || []); scene.look(f.at_mm, f.radius); $("in-3d").scrollIntoView({behavior: "smooth"}); });
if (!scene) for (const b of document.querySelectorAll("button[data-f]")) b.hidden = true;
})();
