// One viewer: the picture, the controls and the figures.

import { SCHEMES, css } from './colours.js';
import { count, labelled, make, range, select, short, withUnit } from './dom.js';
import { facts, isBeyond, poseTable } from './figures.js';
import { Scene } from './scene.js';

const LAYERS = [
  ['ghost', 'Source before'],
  ['source', 'Source after'],
  ['target', 'Target'],
  ['skeletons', 'Skeletons'],
  ['matches', 'Matches'],
];
const KEYS = 'Drag to turn, scroll or pinch to zoom, drag with two fingers or the right button to move. ' +
  'Keys: arrows turn, + and − zoom, B goes before and after, F fits.';
const NO_WEBGL = 'The 3D view cannot be drawn: WebGL 2 is missing or switched off in this browser. The figures ' +
  'and the description beside it are complete without it.';

const scheme = () => SCHEMES[matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'];

export class Viewer {
  constructor(root, data) {
    this.root = root;
    this.pairs = data.pairs;
    this.state = {
      t: 1,
      colour: 'cloud',
      layers: { ghost: false, source: true, target: true, skeletons: false, matches: false },
    };
    this.build();
    try {
      this.scene = new Scene(this.canvas, () => this.drawn());
    } catch {
      this.stage.replaceChildren(make('p', { className: 'sv-fault', attributes: { role: 'alert' } }, NO_WEBGL));
      this.bar.hidden = true;
      root.classList.add('sv-flat');
    }
    this.choosePair(0);
    if (!this.scene) return;
    new ResizeObserver(() => this.scene.resize(this.stage.clientWidth, this.stage.clientHeight)).observe(this.stage);
    this.scene.resize(this.stage.clientWidth, this.stage.clientHeight);
    this.scene.fit(this.pose);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.refresh());
  }

  build() {
    const id = this.root.id || 'srrf-view';
    this.canvas = make('canvas', {
      tabIndex: 0,
      attributes: {
        role: 'application',
        'aria-roledescription': '3D view',
        'aria-label': `Interactive 3D view of two point clouds. ${KEYS}`,
        'aria-describedby': `${id}-words`,
      },
      on: { keydown: (event) => this.key(event) },
    });
    this.canvas.addEventListener('webglcontextlost', () => this.say('The graphics card gave up; reload the page.'));
    this.legend = make('div', { className: 'sv-legend' });
    this.status = make('p', { className: 'sv-status', attributes: { role: 'status' } });
    this.bar = make('div', { className: 'sv-bar' });
    this.stage = make('div', { className: 'sv-stage' }, this.canvas, this.legend, this.status);
    // A page that scrolls keeps its wheel until the view has been clicked.
    this.stage.addEventListener('wheel', (event) => {
      const page = document.documentElement;
      if (document.activeElement !== this.canvas && page.scrollHeight > page.clientHeight + 1) event.stopPropagation();
    }, { capture: true, passive: true });
    this.side = make('div', { className: 'sv-side' });
    this.words = make('p', { id: `${id}-words` });
    this.root.replaceChildren(make('div', { className: 'sv-main' }, this.stage, this.bar), this.side);
  }

  get unit() {
    return this.pair.unit;
  }

  length(x) {
    return withUnit(short(x), this.unit);
  }

  /** A distance to the target, which may be known only to be large. */
  distance(x) {
    return (isBeyond(this.pair, x) ? '≥ ' : '') + this.length(x);
  }

  choosePair(index) {
    this.pair = this.pairs[index];
    if (!this.pair) {
      this.side.replaceChildren(make('p', {}, 'This page holds no pair.'));
      return;
    }
    this.index = index;
    this.poseIndex = 0;
    this.state.up = this.pair.up;
    this.scale = this.defaultScale();
    this.scene?.load(this.pair);
    this.scene?.orient(this.state.up);
    this.pointSize = (this.pair.source.shown + this.pair.target.shown < 12000 ? 4 : 2.5) * (innerWidth < 500 ? 0.65 : 1);
    this.scene?.setPointSize(this.pointSize);
    this.fill();
    this.refresh();
    this.scene?.fit(this.pose);
  }

  get pose() {
    return this.pair.poses[this.poseIndex] ?? this.pair.before;
  }

  /** The pose whose distances are shown: the nearer end of the slider. */
  get end() {
    return this.state.t < 0.5 ? this.pair.before : this.pose;
  }

  scaleLimits() {
    const all = [this.pair.before, ...this.pair.poses].map((p) => p.residual?.max ?? 0);
    const high = Math.max(...all) || 1;
    const typical = Math.min(...this.pair.poses.map((p) => p.summary?.p90 ?? high), high) || high;
    return [Math.min(typical, high) / 10, high];
  }

  defaultScale() {
    // Between the best pose and the start, so that good and bad poses differ, but near the best.
    const [tenth, high] = this.scaleLimits();
    const best = 10 * tenth;
    const middle = Math.sqrt(best * (this.pair.before.summary?.p90 ?? best));
    return Math.min(high, Math.max(2 * best, Math.min(middle, 10 * best)));
  }

  /** The parts that depend on the pair. */
  fill() {
    const { pair, state } = this;
    const moved = pair.poses.length > 0;
    this.slider = range(0, 1, 0.01, state.t, (t) => this.move(t));
    this.slider.setAttribute('aria-label', 'From before to after');
    this.play = make('button', { type: 'button', on: { click: () => this.toggle() } });
    const poses = select(pair.poses.map((p) => p.name), 0, (i) => this.choosePose(i));
    this.poseSelect = poses;
    const fit = make('button', { type: 'button', on: { click: () => this.scene.fit() } }, 'Fit');
    const slide = make('div', { className: 'sv-slide' }, make('span', {}, 'Before'), this.slider,
      make('span', {}, 'After'));
    const several = pair.poses.length > 1;
    this.bar.replaceChildren(...[moved ? slide : null, moved ? this.play : null, several ? labelled('Pose', poses) : null, fit].filter(Boolean));

    const names = this.pairs.map((p) => p.name);
    const choose = this.pairs.length > 1 ? labelled('Pair', select(names, this.index, (i) => this.choosePair(i))) : null;
    const warnings = pair.warnings.map((text) => make('p', { className: 'sv-warning' }, make('strong', {}, 'Note: '), text));
    this.table = make('div');
    this.words.textContent = pair.description;
    const parts = [
      choose && make('section', {}, choose),
      warnings.length > 0 && make('section', { attributes: { 'aria-label': 'Notes' } }, ...warnings),
      pair.numbers.length > 0 && make('section', {}, make('h2', {}, 'Figures'), facts(pair.numbers)),
      this.scene && this.layerSection(),
      this.scene && this.colourSection(),
      moved && make('section', {}, make('h2', {}, pair.poses.length > 1 ? 'Poses' : 'Pose'), this.table),
      this.scene && this.viewSection(),
      make('details', { open: !this.scene }, make('summary', {}, 'Description of the picture'), this.words),
      make('details', {}, make('summary', {}, 'About this page'), ...this.about().map((text) => make('p', {}, text))),
    ];
    this.side.replaceChildren(...parts.filter(Boolean));
  }

  about() {
    const { source, target, match_count: all, matches } = this.pair;
    const worst = Math.max(...source.extent, ...target.extent) / 65535 / 2;
    const lines = [
      `Points are drawn to within ${this.length(worst)}, and distances are those of the points drawn.`,
      KEYS,
      'This file needs no network. It contains three.js (MIT licence, its text is in the source of this page).',
    ];
    if (this.pair.distance_limit) lines.splice(1, 0, `Distances over ${this.length(this.pair.distance_limit)} are not told apart.`);
    if (matches.length < all) lines.unshift(`The ${count(matches.length)} strongest of ${count(all)} matches are drawn.`);
    return lines;
  }

  layerSection() {
    const { pair, state } = this;
    const list = make('fieldset', {}, make('legend', {}, 'Layers'));
    const amounts = {
      ghost: null,
      source: pair.source.shown,
      target: pair.target.shown,
      skeletons: (pair.skeletons ?? []).reduce((n, s) => n + s.points.length, 0),
      matches: pair.matches.length,
    };
    this.swatches = {};
    for (const [key, text] of LAYERS) {
      const missing = amounts[key] === 0 || (key === 'ghost' && pair.poses.length === 0);
      if (missing) continue;
      const change = (event) => {
        state.layers[key] = event.target.checked;
        this.refresh();
      };
      const box = make('input', { type: 'checkbox', checked: state.layers[key], name: key, on: { change } });
      this.swatches[key] = make('span', { className: `sv-swatch sv-${key}`, attributes: { 'aria-hidden': 'true' } });
      const label = key === 'source' && pair.poses.length === 0 ? 'Source' : text;
      const amount = amounts[key] === null ? '' : count(amounts[key]);
      list.append(make('label', { className: 'sv-check' }, box, this.swatches[key], make('span', {}, label),
        make('span', { className: 'sv-amount' }, amount)));
    }
    return list;
  }

  colourSection() {
    const list = make('fieldset', {}, make('legend', {}, 'Colours'));
    const both = [this.pair.source, this.pair.target];
    const ways = [['cloud', 'One colour for each cloud'], ['residual', 'Distance to the target']];
    if (both.some((cloud) => cloud.colours)) ways.push(['colours', 'Colours of the points']);
    if (both.some((cloud) => cloud.intensities)) ways.push(['intensities', 'Intensity, dark to bright']);
    if (!ways.some(([value]) => value === this.state.colour)) this.state.colour = 'cloud';
    for (const [value, text] of ways) {
      const change = () => {
        this.state.colour = value;
        this.refresh();
      };
      const checked = this.state.colour === value;
      const box = make('input', { type: 'radio', name: `${this.root.id}-colour`, value, checked, on: { change } });
      list.append(make('label', { className: 'sv-check' }, box, make('span', {}, text)));
    }
    const [low, high] = this.scaleLimits();
    const at = (scale) => Math.log(scale / low) / (Math.log(high / low) || 1);
    const slider = range(0, 1, 0.005, at(this.scale), (x) => {
      this.scale = low * (high / low) ** x;
      slider.setAttribute('aria-valuetext', this.length(this.scale));
      this.refresh();
    });
    slider.setAttribute('aria-valuetext', this.length(this.scale));
    this.scaleField = labelled('Colours up to', slider);
    list.append(this.scaleField);
    return list;
  }

  viewSection() {
    const size = range(1, 10, 0.1, this.pointSize, (pixels) => this.scene.setPointSize(pixels));
    const axes = ['z', 'y', 'x', '-z', '-y', '-x'];
    const up = select(axes.map((axis) => axis.toUpperCase().replace('-', '−')), axes.indexOf(this.state.up), (i) => {
      this.state.up = axes[i];
      this.scene.orient(this.state.up);
      this.scene.fit();
    });
    const save = () => make('a', { href: this.scene.snapshot(), download: `${this.pair.name}.png` }).click();
    return make('fieldset', {}, make('legend', {}, 'View'), labelled('Point size', size), labelled('Axis up', up),
      make('button', { type: 'button', on: { click: save } }, 'Save picture'));
  }

  choosePose(index) {
    this.poseIndex = index;
    this.poseSelect.value = index;
    this.refresh();
  }

  move(t) {
    this.state.t = t;
    this.slider.value = t;
    this.refresh();
  }

  toggle() {
    const goal = this.state.t > 0.5 ? 0 : 1;
    cancelAnimationFrame(this.motion);
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) return this.move(goal);
    const [from, start] = [this.state.t, performance.now()];
    const step = (now) => {
      const share = Math.min(1, Math.max(0, (now - start) / 1100));
      const eased = share * share * (3 - 2 * share);
      this.move(from + (goal - from) * eased);
      if (share < 1) this.motion = requestAnimationFrame(step);
    };
    this.motion = requestAnimationFrame(step);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.scene) return;
    const angle = Math.PI / 24;
    const actions = {
      ArrowLeft: () => this.scene.turn(angle, 0),
      ArrowRight: () => this.scene.turn(-angle, 0),
      ArrowUp: () => this.scene.turn(0, angle),
      ArrowDown: () => this.scene.turn(0, -angle),
      '+': () => this.scene.zoom(1 / 1.15),
      '=': () => this.scene.zoom(1 / 1.15),
      '-': () => this.scene.zoom(1.15),
      b: () => this.pair.poses.length > 0 && this.toggle(),
      f: () => this.scene.fit(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  /** Brings everything in line with the state. */
  refresh() {
    const { state, pair } = this;
    this.table.replaceChildren(poseTable(pair, this.poseIndex, (i) => this.choosePose(i)));
    if (!this.scene) return;
    const colours = scheme();
    const residual = state.colour === 'residual';
    this.scene.show(state.layers);
    this.scene.showResidual(this.end);
    this.scene.place(this.pose, state.t);
    this.scene.paint(colours, state.colour, this.scale);
    for (const [key, swatch] of Object.entries(this.swatches)) {
      const own = key === 'matches' ? 'match' : key;
      const paint = key === 'skeletons' ? `linear-gradient(90deg, ${css(colours.source)} 50%, ${css(colours.target)} 50%)`
        : residual && key === 'target' ? css(colours.neutral)
        : residual && key === 'source' ? `linear-gradient(90deg, ${colours.ramp.map(css).join(',')})`
        : css(colours[own]);
      swatch.style.background = paint;
    }
    this.scaleField.hidden = !residual;
    this.play.textContent = state.t > 0.5 ? 'Show before' : 'Show after';
    const words = { 0: 'before', 1: `after, ${this.pose.name}` };
    this.slider.setAttribute('aria-valuetext', words[state.t] ?? `${Math.round(100 * state.t)} % of the way`);
    this.drawLegend(colours, residual);
    this.say(this.farAway());
  }

  drawLegend(colours, residual) {
    const rows = [];
    const { layers } = this.state;
    const at = this.pair.poses.length === 0 ? '' : this.end === this.pair.before ? ' (before)' : ` (after: ${this.end.name})`;
    const entries = [
      ['source', !residual, `Source${at}`, 'source'], ['ghost', true, 'Source before', 'ghost'],
      ['target', true, 'Target', residual ? 'neutral' : 'target'], ['matches', true, 'Matches', 'match'],
    ].filter(([key, use]) => use && layers[key] && this.swatches[key]);
    const entry = ([, , text, colour]) => {
      const dot = make('span', { className: 'sv-dot', attributes: { 'aria-hidden': 'true' } });
      dot.style.background = css(colours[colour]);
      return make('span', { className: 'sv-entry' }, dot, text);
    };
    if (residual) {
      const which = this.end === this.pair.before ? 'before' : `after: ${this.end.name}`;
      const bar = make('div', { className: 'sv-ramp' });
      bar.style.background = `linear-gradient(90deg, ${colours.ramp.map(css).join(',')})`;
      rows.push(make('p', {}, `Distance to the target (${which})`), bar,
        make('p', { className: 'sv-ticks' }, make('span', {}, '0'), make('span', {}, this.length(this.scale / 2)),
          make('span', {}, `≥ ${this.length(this.scale)}`)));
      const { summary } = this.end;
      if (summary) rows.push(make('p', { className: 'sv-muted' }, `median ${this.distance(summary.median)}, 90 % within ${this.distance(summary.p90)}`));
    }
    rows.push(make('p', { className: 'sv-entries' }, ...entries.map(entry)));
    const own = { colours: 'Points in their own colours, where they have any', intensities: 'Points by intensity, where it is known' };
    if (own[this.state.colour]) rows.push(make('p', { className: 'sv-muted' }, own[this.state.colour]));
    for (const [name, cloud] of [['source', this.pair.source], ['target', this.pair.target]]) {
      if (cloud.shown < cloud.count) {
        rows.push(make('p', { className: 'sv-muted' }, `Showing ${count(cloud.shown)} of ${count(cloud.count)} ${name} points`));
      }
    }
    this.legend.replaceChildren(...rows);
  }

  /** What to say where the source before registration lies far outside the view. */
  farAway() {
    const shown = this.state.t < 0.5 || this.state.layers.ghost;
    const away = this.scene.distanceBefore();
    if (!shown || away < 6 * this.scene.radius) return '';
    return `Before registration the source lies ${this.length(away)} away from the target; “Fit” shows both.`;
  }

  say(text) {
    if (this.status.textContent !== text) this.status.textContent = text;
    this.status.hidden = text === '';
  }

  drawn() {
    this.root.dataset.frames = Number(this.root.dataset.frames ?? 0) + 1;
  }
}
