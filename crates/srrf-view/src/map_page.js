// A map of scans: points by scan, the graph of pairs, and what is known of each. Plain canvas, no library.
(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const root = document.getElementById('map');
  const el = (name, attributes = {}, ...inside) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made[key] = value;
    made.append(...inside);
    return made;
  };
  const svg = (name, attributes) => {
    // The parser gives the namespace.
    const template = document.createElement('template');
    template.innerHTML = name === 'svg' ? '<svg></svg>' : `<svg><${name}></${name}></svg>`;
    const made = name === 'svg' ? template.content.firstChild : template.content.firstChild.firstChild;
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };
  // Neighbouring numbers get colours far apart: steps of the golden angle.
  const hue = (i) => (i * 137.508) % 360;
  const hsl = (h, s, l) => {
    const f = (n) => {
      const k = (n + h / 30) % 12;
      return Math.round(255 * (l - s * Math.min(l, 1 - l) * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
    };
    return [f(0), f(8), f(4)];
  };
  const decode = (text) => {
    const raw = atob(text);
    const bytes = Uint8Array.from(raw, (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Float32Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
  };
  const scans = data.scans.map((s, i) => ({ ...s, xyz: decode(s.points), colour: hsl(hue(i), 0.7, 0.5) }));
  const most = Math.max(...scans.map((s) => s.residual ?? 0), 1e-300);
  const byResidual = (s) => (s.residual == null ? [136, 136, 136] : hsl(220 * (1 - s.residual / most), 0.8, 0.5));

  const canvas = el('canvas');
  const tools = el('div', { id: 'tools' });
  const view = el('div', { id: 'view' }, canvas, tools);
  const aside = el('aside');
  root.append(view, aside);

  const components = [...new Set(scans.map((s) => s.component))].sort((a, b) => a - b);
  const state = { component: components[0] ?? 0, mode: 'scan', only: null, yaw: 0.6, tilt: 0.9, zoom: 1, at: [0, 0] };
  const choice = el('select', { ariaLabel: 'Map' }, ...components.map((c) => {
    const n = scans.filter((s) => s.component === c).length;
    return el('option', { value: c, textContent: n > 1 ? `map ${c + 1}: ${n} scans` : `alone: ${scans.find((s) => s.component === c).name}` });
  }));
  const mode = el('select', { ariaLabel: 'Colours' }, el('option', { value: 'scan', textContent: 'colour by scan' }), el('option', { value: 'residual', textContent: 'colour by residual' }));
  const all = el('button', { textContent: 'all scans' });
  tools.append(choice, mode, all);
  choice.onchange = () => { state.component = Number(choice.value); state.only = null; state.zoom = 1; state.at = [0, 0]; panel(); draw(); };
  mode.onchange = () => { state.mode = mode.value; draw(); };
  all.onclick = () => { state.only = null; panel(); draw(); };

  const shown = () => scans.map((s, i) => [s, i]).filter(([s, i]) => (state.only ? state.only.includes(i) : s.component === state.component));
  let asked = false;
  const draw = () => { if (!asked) { asked = true; requestAnimationFrame(paint); } };
  function paint() {
    asked = false;
    const scale = Math.min(2, window.devicePixelRatio || 1);
    const [w, h] = [Math.max(1, Math.round(view.clientWidth * scale)), Math.max(1, Math.round(view.clientHeight * scale))];
    canvas.width = w; canvas.height = h;
    const context = canvas.getContext('2d');
    const image = context.createImageData(w, h);
    const depth = new Float32Array(w * h).fill(Infinity);
    const dark = matchMedia('(prefers-color-scheme: dark)').matches;
    new Uint32Array(image.data.buffer).fill(dark ? 0xff1c1714 : 0xfff8f6f5);
    const list = shown();
    let reach = 1e-9;
    for (const [s] of list) for (let k = 0; k < s.xyz.length; k += 3) reach = Math.max(reach, Math.hypot(s.xyz[k], s.xyz[k + 1], s.xyz[k + 2]));
    const unit = (0.5 * Math.min(w, h) * state.zoom) / reach;
    const [cy, sy, ct, st] = [Math.cos(state.yaw), Math.sin(state.yaw), Math.cos(state.tilt), Math.sin(state.tilt)];
    const size = scale > 1 ? 2 : 1;
    for (const [s] of list) {
      const [r, g, b] = state.mode === 'scan' ? s.colour : byResidual(s);
      for (let k = 0; k < s.xyz.length; k += 3) {
        const [x, y, z] = [s.xyz[k], s.xyz[k + 1], s.xyz[k + 2]];
        const [u, v] = [cy * x + sy * y, -sy * x + cy * y];
        const px = Math.round(w / 2 + scale * state.at[0] + unit * u);
        const py = Math.round(h / 2 + scale * state.at[1] - unit * (ct * v + st * z));
        const d = st * v - ct * z;
        for (let i = 0; i < size; i++) for (let j = 0; j < size; j++) {
          const [qx, qy] = [px + i, py + j];
          if (qx < 0 || qy < 0 || qx >= w || qy >= h) continue;
          const at = qy * w + qx;
          if (d < depth[at]) { depth[at] = d; image.data.set([r, g, b, 255], 4 * at); }
        }
      }
    }
    context.putImageData(image, 0, 0);
  }
  const held = new Map();
  canvas.onpointerdown = (e) => { canvas.setPointerCapture(e.pointerId); held.set(e.pointerId, e); };
  canvas.onpointerup = canvas.onpointercancel = (e) => held.delete(e.pointerId);
  canvas.onpointermove = (e) => {
    const before = held.get(e.pointerId);
    if (!before) return;
    const [dx, dy] = [e.clientX - before.clientX, e.clientY - before.clientY];
    if (held.size > 1 || e.shiftKey || e.buttons === 2) state.at = [state.at[0] + dx / held.size, state.at[1] + dy / held.size];
    else { state.yaw -= dx * 0.008; state.tilt = Math.max(0, Math.min(Math.PI / 2, state.tilt - dy * 0.008)); }
    held.set(e.pointerId, e);
    draw();
  };
  canvas.oncontextmenu = (e) => e.preventDefault();
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); state.zoom *= Math.exp(-e.deltaY * 0.001); draw(); }, { passive: false });

  const facts = (list) => el('dl', {}, ...list.flatMap(([label, text]) => [el('dt', { textContent: label }), el('dd', { textContent: text })]));
  const pick = (link) => { state.only = [link.a, link.b]; panel(link); draw(); };
  function graph() {
    const inside = scans.map((s, i) => [s, i]).filter(([s]) => s.component === state.component);
    const links = data.links.filter((l) => scans[l.a].component === state.component || scans[l.b].component === state.component);
    const span = Math.max(1e-9, ...inside.flatMap(([s]) => s.centre.slice(0, 2).map(Math.abs)));
    // Scans whose middles coincide lie on a circle instead.
    const same = inside.length > 1 && span < 1e-3 * Math.max(...inside.map(([s]) => Math.max(...s.xyz.slice(0, 300).map(Math.abs))), 1e-9);
    const place = new Map(inside.map(([s, i], k) => {
      const turn = (2 * Math.PI * k) / inside.length;
      const [x, y] = same || inside.length < 3 ? [Math.cos(turn), Math.sin(turn)] : [s.centre[0] / span, s.centre[1] / span];
      return [i, [160 + 140 * x, 160 - 140 * y]];
    }));
    const picture = svg('svg', { viewBox: '0 0 320 320', role: 'img' });
    for (const link of links) {
      const [p, q] = [place.get(link.a), place.get(link.b)];
      if (!p || !q) continue;
      const ends = { x1: p[0], y1: p[1], x2: q[0], y2: q[1] };
      picture.append(svg('line', { ...ends, class: link.holds ? 'holds' : link.contradicts ? 'contradicts' : 'other' }));
      const hit = svg('line', { ...ends, class: 'hit' });
      hit.addEventListener('click', () => pick(link));
      picture.append(hit);
    }
    for (const [s, i] of inside) {
      const dot = svg('circle', { cx: place.get(i)[0], cy: place.get(i)[1], r: 5, fill: `rgb(${s.colour})` });
      const title = svg('title', {});
      title.textContent = s.name;
      dot.append(title);
      dot.addEventListener('click', () => one(i));
      picture.append(dot);
    }
    return picture;
  }
  const one = (i) => { state.only = [i]; panel(); draw(); };
  function panel(link) {
    aside.replaceChildren(graph());
    if (link) aside.append(el('h2', { textContent: `${scans[link.a].name} and ${scans[link.b].name}` }), facts(link.facts));
    if (state.only && state.only.length === 1) {
      const s = scans[state.only[0]];
      aside.append(el('h2', { textContent: s.name }), facts(s.facts));
    }
    const pairs = data.links.filter((l) => (state.only && state.only.length === 1 ? [l.a, l.b].includes(state.only[0]) : scans[l.a].component === state.component || scans[l.b].component === state.component));
    aside.append(el('h2', { textContent: 'Scans' }), el('ul', {}, ...scans.map((s, i) => [s, i]).filter(([s]) => s.component === state.component).map(([s, i]) => {
      const swatch = el('span', { className: 'swatch' });
      swatch.style.background = `rgb(${s.colour})`;
      return el('li', {}, el('button', { onclick: () => one(i) }, swatch, s.name));
    })));
    aside.append(el('h2', { textContent: 'Pairs' }), el('ul', {}, ...pairs.slice(0, 400).map((l) => el('li', {}, el('button', { onclick: () => pick(l), textContent: `${l.holds ? '●' : l.contradicts ? '✕' : '○'} ${scans[l.a].name} – ${scans[l.b].name}` })))));
  }
  panel();
  draw();
  addEventListener('resize', draw);
})();
