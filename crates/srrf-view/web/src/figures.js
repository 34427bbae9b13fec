// The figures as lists and tables.

import { make, short, withUnit } from './dom.js';

/** Whether a distance is known only to be at least so large. */
export const isBeyond = (pair, x) => Boolean(pair.distance_limit) && x >= pair.distance_limit;

/** Labels and values; the help is shown under them, since touch screens have no tooltips. */
export function facts(numbers) {
  const rows = numbers.map(({ label, value, unit, help, tone }) => {
    const sign = tone && make('span', { className: 'sv-sign', attributes: { 'aria-hidden': 'true' } }, tone === 'good' ? '✓' : '!');
    return make('div', {}, make('dt', {}, label),
      make('dd', { className: tone ? `sv-${tone}` : '' }, sign || null, withUnit(value, unit)),
      help ? make('dd', { className: 'sv-help' }, help) : null);
  });
  return make('dl', { className: 'sv-facts' }, ...rows);
}

/**
 * One row for each pose: its own figures, then what the page measured. The motion is left to the
 * description where there are figures enough.
 */
export function poseTable(pair, chosen, choose) {
  const labels = [];
  for (const { numbers } of pair.poses) {
    for (const { label, unit } of numbers) if (!labels.some((l) => l.label === label)) labels.push({ label, unit });
  }
  const motion = labels.length < 2;
  const heading = (text, unit) => make('th', { scope: 'col' }, unit ? `${text} (${unit})` : text);
  const head = make('tr', {}, heading('Pose'), ...labels.map((l) => heading(l.label, l.unit)),
    heading('Median distance', pair.unit), ...(motion ? [heading('Turn', '°'), heading('Shift', pair.unit)] : []));
  const cell = (text) => make('td', {}, text);
  const row = (pose, name, own) =>
    make('tr', { attributes: name.current ? { 'aria-current': 'true' } : {} }, make('th', { scope: 'row' }, name.node),
      ...labels.map(({ label }) => cell(own.find((n) => n.label === label)?.value ?? '–')),
      cell(pose.summary ? (isBeyond(pair, pose.summary.median) ? '≥ ' : '') + short(pose.summary.median) : '–'), ...(motion ? [pose.turn_deg, pose.shift].map((x) => cell(short(x))) : []));
  const rows = pair.poses.map((pose, i) => {
    const button = make('button', { type: 'button', attributes: { 'aria-pressed': String(i === chosen) },
      on: { click: () => choose(i) } }, pose.name);
    return row(pose, { node: button, current: i === chosen }, pose.numbers);
  });
  rows.unshift(row(pair.before, { node: `before: ${pair.before.name}` }, pair.before.numbers));
  const table = make('table', {}, make('thead', {}, head), make('tbody', {}, ...rows));
  return make('div', { className: 'sv-scroll', tabIndex: 0, attributes: { role: 'region', 'aria-label': 'Table of poses' } }, table);
}
